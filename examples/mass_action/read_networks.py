"""Write the quadratic mass-action networks of a clone of crnpy as system files.

    git clone https://github.com/etonello/crnpy && git -C crnpy checkout c8c5ef0
    python read_networks.py crnpy/examples/data/reactions systems

A file has a reaction in each line: `v1: A + 2B (k2)<->(k1) C`. The rate is the bracket times A*B^2. It is mass action
if the bracket is a polynomial in the species with positive coefficients: a species in it is a catalyst. Nothing is
evaluated: kahanmaps parses the brackets. Names in brackets other than species are constants, and become the primes 2,
3, 5, ... in the order of their first appearance; so does a missing bracket. A line for each file says what became of
it.
"""

import itertools
import json
import re
import sys
from collections import Counter
from pathlib import Path

import flint

import kahanmaps as km
from kahanmaps.algebra.parsing import parse_polynomial
from kahanmaps.algebra.polynomials import ring

MAX_SPECIES = 6
LINE = re.compile(r"(?:[^:]*:)?([^()]*?)\s*(?:\((.*)\))?(<?)->(?:\((.*)\))?([^()]*)")
TERM = re.compile(r"(\d*)\s*\*?\s*([A-Za-z_]\w*)")
NAME = re.compile(r"[A-Za-z_]\w*")
POWER_OF_A_NAME = re.compile(r"\^\s*\(?[\s+-]*[A-Za-z_]")
NOTHING = "EmptySet"  # a name that models use for the outside
Reaction = tuple[Counter[str], Counter[str], str]
Terms = dict[tuple[tuple[int, ...], tuple[int, ...]], flint.fmpq]


def read_complex(text: str) -> Counter[str]:
    """The species and their numbers in `A + 2B`."""
    found: Counter[str] = Counter()
    for part in filter(None, map(str.strip, text.split("+"))):
        match = TERM.fullmatch(part)
        if match is None:
            raise ValueError(f"expected a species with its number, found {part}")
        if match[2] != NOTHING:
            found[match[2]] += int(match[1] or 1)
    return found


def read_reactions(text: str) -> list[Reaction]:
    """Reactants, products and bracket of each reaction; a reversible one is two."""
    reactions = []
    for number, line in enumerate(text.splitlines()):
        line = line.partition("#")[0].strip()
        if line:
            match = LINE.fullmatch(line)
            if match is None:
                raise ValueError(f"expected a reaction, found {line}")
            left, right = read_complex(match[1]), read_complex(match[5])
            reactions.append((left, right, match[4] or f"forward{number}"))
            if match[3]:
                reactions.append((right, left, match[2] or f"backward{number}"))
    return reactions


def mass_action(reactions: list[Reaction], species: list[str]) -> Terms:
    """The coefficient of each monomial with each change of the species; ValueError or km.InputError if other rates."""
    brackets = [bracket.replace("**", "^") for _, _, bracket in reactions]
    names = dict.fromkeys(name for bracket in brackets for name in NAME.findall(bracket) if name not in species)
    primes = filter(lambda number: flint.fmpz(number).is_prime(), itertools.count(2))
    constants = dict(zip(names, map(flint.fmpq, primes), strict=False))
    terms: Terms = {}
    for (left, right, _), bracket in zip(reactions, brackets, strict=True):
        if POWER_OF_A_NAME.search(bracket):
            raise ValueError(f"the exponent is not a number: {bracket}")
        change = tuple(right[name] - left[name] for name in species)
        values = {name: constants[name] for name in NAME.findall(bracket) if name in constants}
        for powers, coefficient in parse_polynomial(bracket, species, values).to_dict().items():
            if coefficient < 0:
                raise ValueError(f"a negative coefficient: {bracket}")
            monomial = tuple(power + left[name] for power, name in zip(powers, species, strict=True))
            terms[monomial, change] = terms.get((monomial, change), flint.fmpq(0)) + coefficient
    return terms


def canonical(terms: Terms, dim: int) -> list:
    """The same for networks that differ in names, order and constants."""
    orders = itertools.permutations(range(dim))
    return min(sorted(tuple(tuple(part[i] for i in order) for part in term) for term in terms) for order in orders)


def document(name: str, species: list[str], terms: Terms) -> str:
    """The system file."""
    texts = []
    for i in range(len(species)):
        sums: dict[tuple[int, ...], flint.fmpq] = {}
        for (monomial, change), coefficient in terms.items():
            sums[monomial] = sums.get(monomial, flint.fmpq(0)) + coefficient * change[i]
        texts.append(str(ring(species).from_dict(sums)))
    return f"name = {json.dumps(name)}\nvariables = {json.dumps(species)}\n\n[system]\nrhs = {json.dumps(texts)}\n"


def main(source: str, folder: str) -> None:
    """Write the files, and say what became of each."""
    Path(folder).mkdir(exist_ok=True)
    count: Counter[str] = Counter()
    first: dict[str, str] = {}
    for path in sorted((path for path in Path(source).rglob("*") if path.is_file()), key=lambda path: path.name):
        reactions = read_reactions(path.read_text(encoding="utf-8"))
        species = list(dict.fromkeys(name for left, right, _ in reactions for name in left + right))
        reason = ""
        try:
            terms = mass_action(reactions, species)
        except (ValueError, km.InputError) as error:
            kind, reason = "other rates", str(error).splitlines()[0]
        else:
            degree = max((sum(monomial) for monomial, change in terms if any(change)), default=0)
            if degree != 2:
                kind = f"degree {degree}"
            elif len(species) > MAX_SPECIES:
                kind, reason = f"quadratic in more than {MAX_SPECIES} species", str(len(species))
            else:
                same = first.setdefault(str(canonical(terms, len(species))), path.name)
                kind, reason = ("quadratic", "") if same == path.name else ("repeated", f"as {same}")
        if kind == "quadratic":
            (Path(folder) / f"{path.name}.toml").write_text(document(path.name, species, terms))
        count[kind] += 1
        print(f"{path.name}\t{kind}\t{reason}")
    print(", ".join(f"{number} {kind}" for kind, number in sorted(count.items())), f"of {count.total()}")


if __name__ == "__main__":
    main(*sys.argv[1:])
