"""A language as a table: how it names things and writes numbers, vectors, functions and solutions of equations.

Everything but LaTeX is written by `writer.py` from such a table. Names that are illegal or reserved are replaced, and
different names stay different:

I -> v_I in SymPy, vI in Mathematica    a_1 -> a1 in Mathematica    gamma -> v_gamma in PARI, Maple and SymPy
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from flint import fmpq, fmpq_mat, fmpq_mpoly, fmpz

from kahanmaps.algebra.polynomials import RationalFunction, names_of
from kahanmaps.algebra.reading import factors_of

LINE = 100  # characters of a line of an expression, after which it is broken
_DIGITS = 4000
_TERMS_TOGETHER = 100  # a sum of more terms is bracketed in parts: parsers recurse


def words(*lines: str) -> frozenset[str]:
    """The words of some lines of text."""
    return frozenset(" ".join(lines).split())


PYTHON_KEYWORDS = words(
    "False None True and as assert async await break class continue def del elif else except finally for from global",
    "if import in is lambda nonlocal not or pass raise return try while with yield print",
)

# What the written functions call their own arguments and local names.
_OURS = frozenset({"point", "eps", "image", "step", "M", "m"})


@dataclass(frozen=True)
class Naming:
    """How a language names things.

    `legal` is what a name must match, `prefix` what is put before one that is reserved; `underscores` says whether
    names may contain them (then functions are called vector_field, otherwise vectorField). `is_reserved` holds for
    names that mean something else in the language.
    """

    is_reserved: Callable[[str], bool]
    prefix: str = "v_"
    underscores: bool = True
    legal: re.Pattern[str] = field(default=re.compile(r"[A-Za-z][A-Za-z0-9_]*"))

    def function(self, *words: str) -> str:
        """The name of a function from its words, each of letters, digits and _.

        >>> plain = Naming(lambda name: False)
        >>> plain.function("integral", "I1"), Naming(lambda name: False, underscores=False).function("integral", "a_b")
        ('integral_I1', 'integralAB')
        """
        pieces = [piece for word in words for piece in re.split(r"[^A-Za-z0-9]+", word) if piece]
        if self.underscores:
            return "_".join(pieces)
        first, *others = pieces  # a small letter first: Sin and Integral would make a name of Mathematica
        return first[0].lower() + first[1:] + "".join(piece[0].upper() + piece[1:] for piece in others)

    def safe(self, names: Iterable[str], taken: Iterable[str] = ()) -> dict[str, str]:
        """Every name with the one to use for it: itself where that is possible, always different ones.

        `taken` are names in use for something else.

        >>> pari = Naming(lambda name: name == "I")
        >>> pari.safe(["x", "I", "v_I", "_y"])
        {'x': 'x', 'I': 'v_v_I', 'v_I': 'v_I', '_y': 'y'}
        """
        used = {*taken, *_OURS}
        found = {}
        wanted = list(names)
        for name in wanted:  # those that may stay as they are come first, whatever the order
            if self._is_free(name) and name not in used:
                found[name] = name
                used.add(name)
        for name in wanted:
            if name in found:
                continue
            body = re.sub(r"[^A-Za-z0-9_]" if self.underscores else r"[^A-Za-z0-9]", "", name).lstrip("_")
            candidate = body if body != name and self._is_free(body) and body not in used else self.prefix + body
            while candidate in used or not self._is_free(candidate):
                candidate = self.prefix + candidate
            found[name] = candidate
            used.add(candidate)
        return {name: found[name] for name in wanted}

    def _is_free(self, name: str) -> bool:
        return self.legal.fullmatch(name) is not None and not self.is_reserved(name)


@dataclass(frozen=True)
class Language:
    """How a language writes what the Kahan map needs.

    `comment` turns a line of text into a comment, `integer` writes one and `fraction` two of them, `vector` and
    `matrix` write entries that are texts. The arguments of a definition are the point, eps and the symbols: `point`
    takes the names of the variables (none where the point is used as a whole), `argument` and `symbol` one name. `take`
    writes what makes the variables out of the point, `convert` what makes an exact number of an argument ("": nothing).
    `definition` is the template of a function, with <name>, <arguments> and <body>, and `function` that of the body
    where its value is a formula, with <unpack> and <body>. `recipes` are the bodies of the functions that are the same
    for all systems up to the dimension <n>, the further arguments <more> of a call, and the names of functions,
    <vector_field> and so on; one with <arguments> is the whole definition. `naming` says which names may be used;
    `head` is what the file loads first, with <functions>; `usage` is a call of the map.
    """

    key: str
    title: str
    naming: Naming
    vector: Callable[[Sequence[str]], str]
    matrix: Callable[[Sequence[Sequence[str]]], str]
    take: Callable[[Sequence[str]], str]
    definition: str
    function: str
    recipes: Mapping[str, str]
    usage: str
    point: Callable[[Sequence[str]], str] = lambda variables: "point"
    argument: str = "{}"
    symbol: str = "{}"
    convert: str = ""
    comment: Callable[[str], str] = lambda line: f"# {line}".rstrip()
    integer: Callable[[fmpz], str] = str
    fraction: str = "{}/{}"
    power: str = "^"
    head: str = ""

    def number(self, value: fmpq) -> str:
        """An exact number."""
        above = self.integer(value.p)
        return above if value.q == 1 else self.fraction.format(above, self.integer(value.q))

    def arguments(self, variables: Sequence[str], eps: bool, symbols: Sequence[str]) -> str:
        """The list of arguments of a definition."""
        first = [self.point(variables), *[self.argument.format("eps")] * eps]
        return ", ".join([*first, *map(self.symbol.format, symbols)])

    def unpack(self, variables: Sequence[str], eps: bool, symbols: Sequence[str]) -> str:
        """What makes the variables and exact numbers out of the arguments, before the rest of a body."""
        lines = [self.take(variables)] if variables else []
        lines += [self.convert.format(name) for name in (*["eps"] * eps, *symbols)]
        return "".join(f"{line}\n{self.indent}" for line in lines if line)

    @property
    def indent(self) -> str:
        """What the lines of a body begin with."""
        return self.definition.partition("<body>")[0].rpartition("\n")[2]

    def polynomial(self, polynomial: fmpq_mpoly, safe: Mapping[str, str]) -> str:
        """A polynomial as an expression, exactly; blanks only around + and - between terms.

        `safe` maps the names of its ring to those of the language.
        """
        names = [safe[name] for name in names_of(polynomial)]
        terms: list[str] = []
        for monomial, coefficient in polynomial.terms():
            factors = factors_of(abs(coefficient), monomial, names, self._power, self.number)
            terms.append((" - " if coefficient < 0 else " + ") + "*".join(factors))
        if not terms:
            return self.number(fmpq(0))
        if len(terms) > _TERMS_TOGETHER:
            parts = [terms[k : k + _TERMS_TOGETHER] for k in range(0, len(terms), _TERMS_TOGETHER)]
            return " + ".join(f"({_joined(part)})" for part in parts)
        return _joined(terms)

    def rational_function(self, function: RationalFunction, safe: Mapping[str, str]) -> str:
        """A quotient of polynomials as an expression, exactly."""
        above = self.polynomial(function.numerator, safe)
        if function.is_polynomial:
            return above
        return f"({above})/({self.polynomial(function.denominator, safe)})"

    def constant_matrix(self, matrix: fmpq_mat) -> str:
        """A matrix of numbers."""
        return self.matrix([[self.number(entry) for entry in row] for row in matrix.tolist()])

    def _power(self, name: str, exponent: int) -> str:
        return f"{name}{self.power}{exponent}"


def python_integer(value: fmpz) -> str:
    """An integer for a Python that reads up to 4300 decimal digits, hexadecimal ones of any length.

    >>> python_integer(fmpz(-7)), python_integer(fmpz(10)**5000)[:6]
    ('-7', '0x31e2')
    """
    text = str(value)
    return text if len(text) <= _DIGITS else hex(int(value))


def fill(template: str, values: Mapping[str, str]) -> str:
    """The template with <key> replaced by values[key].

    >>> print(fill("f(<x>)", {"x": "point"}))
    f(point)
    """
    return re.sub(r"<([a-z_]+)>", lambda match: values[match[1]], template)


def broken(text: str, indent: str) -> str:
    """A long expression on several lines, each but the last ending with + or -.

    A line that ends so cannot be a whole statement, in any of the languages.

    >>> broken("a + b", "  ")
    'a + b'
    """
    lines: list[str] = []
    current = ""
    for piece in re.split(r"(?<= [+-] )", text):
        if current and len(current) + len(piece) > LINE:
            lines.append(current.rstrip())
            current = ""
        current += piece
    return f"\n{indent}".join([*lines, current])


def listed(entries: Sequence[str], indent: str) -> str:
    """Entries with commas between them, on one line where there is room and else one on each line.

    >>> listed(["a", "b"], "  ")
    'a, b'
    """
    room = all("\n" not in entry for entry in entries) and sum(len(entry) + 2 for entry in entries) <= LINE
    return (", " if room else f",\n{indent}").join(entries)


def _joined(terms: Sequence[str]) -> str:
    text = "".join(terms)
    return "-" + text[3:] if text.startswith(" - ") else text[3:]
