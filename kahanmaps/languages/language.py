"""A language as a table: how it writes numbers, vectors, functions and the solution of linear equations.

Everything but LaTeX is written by `writer.py` from such a table.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from flint import fmpq, fmpq_mat, fmpq_mpoly, fmpz

from kahanmaps.algebra.polynomials import RationalFunction, names_of
from kahanmaps.algebra.reading import factors_of
from kahanmaps.languages.names import Naming

LINE = 100  # characters of a line of an expression, after which it is broken
_DIGITS = 4000
_TERMS_TOGETHER = 100  # a sum of more terms is bracketed in parts: parsers recurse


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
