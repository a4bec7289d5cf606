"""The relations of one degree along orbits, written out: which monomials, which numbers, which integrals.

Of the null space of an orbit the reduced echelon basis is taken for the monomials of the highest degree first, and what
lower degrees imply is left out. A coefficient that differs for two orbits is an integral; these are named c1, c2, ...
One that does not is a number, times a power of eps where the maps differ in eps, or, where no such number is found,
some function of eps named e1, e2, ... Measured, as everything in hirota_kimura.py.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from operator import ge

from kahanmaps.algebra.modular_matrices import echelon
from kahanmaps.algebra.polynomials import ring
from kahanmaps.algebra.printing import format_number, format_polynomial
from kahanmaps.algebra.residues import chinese, simple_fraction
from kahanmaps.algebra.work import count
from kahanmaps.laboratory.modular_points import ModularMap, exponents_up_to
from kahanmaps.laboratory.preserve.hirota_kimura import relations_on_orbit

_SPARE_BITS = 40  # of 122 modulo two primes, by which a number must be simpler than an accident
_POWERS = (0, 2, 1, 4, 3, 6, -2, -1, -4, -3, -6)  # of eps


@dataclass(frozen=True)
class SparseRelation:
    """A polynomial that vanishes along every orbit, with coefficients that are integrals.

    `terms` are pairs of a monomial and its coefficient: text of a number, perhaps with a power of eps, or a name, such
    as "c3" for an integral and "e1" for a function of eps; `integrals` and `functions_of_eps` list these names.
    """

    terms: tuple[tuple[str, str], ...]
    integrals: tuple[str, ...] = ()
    functions_of_eps: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """E.g. m1^2 + m2^2 + c1*p3^2 + c2 = 0."""
        parts = []
        for monomial, coefficient in self.terms:
            if monomial == "1":
                parts.append(coefficient)
            elif coefficient in ("1", "-1"):
                parts.append(coefficient[:-1] + monomial)
            else:
                parts.append(f"{coefficient}*{monomial}")
        return " + ".join(parts).replace("+ -", "- ") + " = 0"

    @property
    def names(self) -> tuple[str, ...]:
        """The coefficients that are names."""
        return tuple(text for _, text in self.terms if text in self.integrals or text in self.functions_of_eps)


def sparse_relations(
    maps: Sequence[ModularMap], degree: int, variables: Sequence[str], most_terms: int = 12, first: int = 1
) -> tuple[SparseRelation, ...] | None:
    """The relations of degree `degree` that those of lower degree do not imply; None where orbits disagree.

    `maps` are two or more maps of one system, with different primes. A relation with more than `most_terms` terms is
    left out. The names of integrals go through all relations of the degree, from c1 or the given `first` on; those
    that are equal have one name. Raises NoPoint where orbits meet the singular set.

    Source: petrera-pfadler-suris-2009.

    >>> from kahanmaps.laboratory.laboratory import Laboratory
    >>> from kahanmaps.documents.catalog import load
    >>> top = load("euler_top")
    >>> [one.text for one in sparse_relations(Laboratory(top).maps, 2, top.variables)]
    ['x1^2 + c1*x3^2 + c2 = 0', 'x2^2 + c3*x3^2 + c4 = 0']
    """
    support = _falling(maps[0].dim, degree)
    tables = [_relations(map_, degree) for map_ in (maps[0], maps[0], maps[1])]
    patterns = {tuple(tuple(bool(c) for c in row) for row in table) for table in tables}
    if len(patterns) != 1:
        return None
    leads = []  # of the relations of lower degree, whose multiples they imply
    if degree > 1:
        lower = _falling(maps[0].dim, degree - 1)
        leads = [lower[next(k for k, c in enumerate(row) if c)] for row in _relations(maps[0], degree - 1)]
    found, context = [], ring(variables)
    # The first letters that names like c1, c2, ... and e1, e2, ... may begin with, none of them being a variable.
    taken = {name.rstrip("0123456789") for name in variables if name[-1].isdigit()}
    integral, function = (next((c for c in choice if c not in taken), f"{choice[0]}_") for choice in ("ckCK", "esES"))
    names: dict[tuple[int, int, int], str] = {}
    functions: dict[tuple[int, int], str] = {}  # of eps
    for one, again, other in zip(*tables, strict=True):
        used = [k for k, entry in enumerate(one) if entry]
        is_implied = any(all(map(ge, support[used[0]], lead)) for lead in leads)
        if is_implied or len(used) > most_terms:
            continue
        terms = []
        for k in used:
            if one[k] != again[k]:
                text = names.setdefault((one[k], again[k], other[k]), f"{integral}{first + len(names)}")
            else:
                number = _number_text(one[k], other[k], maps[0], maps[1])
                text = number or functions.setdefault((one[k], other[k]), f"{function}{first + len(functions)}")
            terms.append((format_polynomial(context.from_dict({support[k]: 1})), text))
        found.append(
            SparseRelation(
                tuple(terms),
                tuple(text for _, text in terms if text in names.values()),
                tuple(text for _, text in terms if text in functions.values()),
            )
        )
    return tuple(found)


def _falling(dim: int, degree: int) -> list[tuple[int, ...]]:
    """The monomials of degree at most `degree`, those of the highest degree first."""
    return sorted(exponents_up_to(dim, degree), key=lambda e: -sum(e))


def _relations(map_: ModularMap, degree: int) -> list[list[int]]:
    """The reduced echelon basis of the relations of a random orbit, on these monomials."""
    places = {exponent: k for k, exponent in enumerate(exponents_up_to(map_.dim, degree))}
    order = [places[exponent] for exponent in _falling(map_.dim, degree)]
    return echelon([[v[k] for k in order] for v in relations_on_orbit(map_, degree).vectors], map_.prime)


def _number_text(one: int, other: int, map_: ModularMap, other_map: ModularMap) -> str | None:
    """The coefficient as a number times a power of eps, modulo both primes simpler than by chance; None otherwise."""
    for power in _POWERS:
        residues = [
            [entry * pow(at.eps, -power, at.prime) % at.prime] for entry, at in ((one, map_), (other, other_map))
        ]
        [residue] = chinese(residues[0], map_.prime, residues[1], other_map.prime)
        count(60)
        value = simple_fraction(residue, map_.prime * other_map.prime, _SPARE_BITS)
        if value is not None:
            number, q = format_number(value), "" if value.q == 1 else f"{value.q}*"
            if power == 0:
                return number
            eps = "eps" if abs(power) == 1 else f"eps^{abs(power)}"
            if power < 0:
                return f"{value.p}/({q}{eps})" if q else f"{value.p}/{eps}"
            return f"{number}*{eps}".replace("1*", "", 1) if abs(value) == 1 else f"{number}*{eps}"
    return None
