"""A language as a table: how it writes numbers, vectors, functions and solutions of linear equations.

The tables are the files of `tables/`, one a language; everything but LaTeX is written by `writer.py` from one of them.
Exact numbers stay exact in all of them but C, Fortran and NumPy, whose numbers are floats.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files

from flint import fmpq, fmpq_mpoly, fmpz

from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.algebra.written.reading import Notation

LANGUAGES = ("sympy", "pari", "maple", "mathematica", "sage", "julia", "numpy", "c", "fortran")

LINE = 100  # characters of a line of an expression, after which it is broken
_DIGITS = 4000
_TERMS_TOGETHER = 100  # a sum of more terms is bracketed in parts: parsers recurse

# Names that mean nothing else in any of the languages: a small letter with digits (but not i, which may be the
# imaginary unit, and e), and words with an underscore (but those of GP's debugger). All other words may be functions.
_FREE = re.compile(r"(?![ei]$)[a-z][0-9]*|(?!dbg_)[a-z][A-Za-z0-9]*_[A-Za-z0-9_]*")


@dataclass(frozen=True)
class Language:
    """How a language writes what the Kahan map needs. The templates have keys in angle brackets.

    `definition` is a function, with its <name>, the <kind> of its value (of `kinds`: a number, a vector, a matrix), its
    <arguments>, the same with their sizes as they are <declared>, the <local> names, if there are some, what makes
    these of the arguments, <unpack>, and its value, <body>. An argument is a `point`, a `number`, such as eps, or a
    `symbol`, a parameter that stays one. `take` takes a <point> apart into the local <names>, by <coordinates>, each
    `coordinate` with its <name>, and its <number> or its <index>, which begins with 0; `between` is written between
    them. `exact` makes an exact number of one that is given.

    `vector`, `row` and `matrix` are what stands before and after entries and rows, the latter columns where they are
    written `by_columns`. `call` is a call of a function. `solve`, `solve_matrix` and `det` are what to write for the
    solution of a linear equation with a vector or a matrix as its right-hand side, and for a determinant; `solver` what
    has to be defined for them. `head` and `tail` begin and end the file; `usage` is a call of the map, with
    <more> arguments, `tenth` the number 1/10 for eps.

    <n> is the dimension everywhere, <solve>, <vector>, <matrix> and <module> are names for what the head defines.
    `comment` is what stands before and after one, `avoided` what it must not contain, with something else for it.
    """

    title: str
    definition: str
    take: str
    coordinate: str
    solve: str
    det: str
    usage: str
    tenth: str
    comment: tuple[str, str]
    vector: tuple[str, str]
    matrix: tuple[str, str]
    row: tuple[str, str] = ("[", "]")
    solve_matrix: str = ""
    solver: str = ""
    head: str = ""
    tail: str = ""
    point: str = "<name>"
    number: str = "<name>"
    symbol: str = "<name>"
    exact: str = ""
    local: str = ""
    between: str = ","
    call: str = "<name>(<arguments>)"
    integer: str = "{}"
    fraction: str = "{}/{}"
    power: str = "^"  # "": products instead
    hexadecimal: bool = (
        False  # of Python, which reads integers of up to 4300 digits, and hexadecimal ones of any length
    )
    underscores: bool = True  # in names; else functions are called vectorField
    by_columns: bool = False
    between_rows: str = ","
    continued: str = ""  # what ends a line that goes on
    kinds: tuple[str, str, str] = ("", "", "")
    avoided: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def load(cls, key: str) -> Language:
        """The language of a table."""
        return cls(**tomllib.loads(files(__package__).joinpath("tables", f"{key}.toml").read_text("utf-8")))

    def function(self, *words: str) -> str:
        """The name of a function from its words, each of letters, digits and _.

        >>> Language.load("pari").function("integral", "I1"), Language.load("mathematica").function("integral", "a_b")
        ('integral_I1', 'integralAB')
        """
        pieces = [piece for word in words for piece in re.split(r"[^A-Za-z0-9]+", word) if piece]
        if self.underscores:
            return "_".join(pieces)
        first, *others = pieces  # a small letter first: Sin and Integral would make a name of Mathematica
        return first[0].lower() + first[1:] + "".join(piece[0].upper() + piece[1:] for piece in others)

    def safe(self, names: Iterable[str], taken: Iterable[str] = ()) -> dict[str, str]:
        """Every name with the one to use for it: itself where it means nothing else, always different ones.

        `taken` are names in use for something else. Fortran does not tell capital letters from small ones.

        >>> Language.load("pari").safe(["x", "I", "v_I", "_y"])
        {'x': 'x', 'I': 'v_I_2', 'v_I': 'v_I', '_y': 'v_y'}
        """
        wanted = list(names)
        used = {name.lower() for name in (*taken, "point", "image", "eps", "value")}
        found = {}
        for name in sorted(wanted, key=lambda name: not self._is_free(name)):
            found[name] = self.fresh(name if self._is_free(name) else self.function("v", name), used)
        return {name: found[name] for name in wanted}

    def fresh(self, first: str, used: set[str]) -> str:
        """A name, with a number where it is in use, and from then on in use: `used` are names in small letters."""
        name, number = first, 2
        while name.lower() in used:
            name = self.function(first, str(number))
            number += 1
        used.add(name.lower())
        return name

    def _is_free(self, name: str) -> bool:
        return _FREE.fullmatch(name) is not None and (self.underscores or "_" not in name)

    def commented(self, line: str) -> str:
        """A line as a comment."""
        for mark, other in self.avoided.items():
            line = line.replace(mark, other)
        return f"{self.comment[0]}{line}{self.comment[1]}".rstrip() if line else ""

    def rational(self, value: fmpq) -> str:
        """An exact number."""
        above, below = self._integer(value.p), self._integer(value.q)
        return above if value.q == 1 else self.fraction.format(above, below)

    def _integer(self, value: fmpz) -> str:
        text = str(value)
        return self.integer.format(hex(int(value)) if self.hexadecimal and len(text) > _DIGITS else text)

    def _power(self, name: str, exponent: int) -> str:
        return f"{name}{self.power}{exponent}" if self.power else "*".join([name] * exponent)

    def polynomial(self, polynomial: fmpq_mpoly, safe: Mapping[str, str]) -> str:
        """A polynomial as an expression, exactly; blanks only around + and - between terms.

        `safe` maps the names of its ring to those of the language.
        """
        signs = ("-", " + ", " - ")
        written = Notation(safe.__getitem__, self.rational, self._power, signs, gap="", eps_first=False)
        terms = written.terms(polynomial)
        parts = ["".join(terms[k : k + _TERMS_TOGETHER]) for k in range(0, len(terms), _TERMS_TOGETHER)]
        parts = ["-" + part[3:] if part.startswith(" - ") else part.removeprefix(" + ") for part in parts]
        if len(parts) > 1:
            return " + ".join(f"({part})" for part in parts)
        return parts[0]

    def expression(self, function: RationalFunction | fmpq_mpoly, safe: Mapping[str, str]) -> str:
        """A polynomial or a quotient of two as an expression, exactly, on several lines where it is long.

        Each line but the last ends with + or -: in no language that is a whole statement.
        """
        if not isinstance(function, RationalFunction):
            text = self.polynomial(function, safe)
        else:
            text = self.polynomial(function.numerator, safe)
            if not function.is_polynomial:
                text = f"({text})/({self.polynomial(function.denominator, safe)})"
        lines = [""]
        for piece in re.split(r"(?<= [+-] )", text):
            if lines[-1] and len(lines[-1]) + len(piece) > LINE:
                lines.append("")
            lines[-1] += piece
        broken = f"{self.continued}\n        ".join(line.rstrip() for line in lines)
        return f"({broken})" if len(lines) > 1 else broken

    def listed(self, kind: tuple[str, str], entries: Sequence[str], between: str = ",") -> str:
        """Entries with commas between them, on one line where there is room and else one on each line."""
        room = all("\n" not in entry for entry in entries) and sum(len(entry) + 2 for entry in entries) <= LINE
        return kind[0] + (between + (" " if room else f"{self.continued}\n        ")).join(entries) + kind[1]

    def table(self, rows: Sequence[Sequence[str]]) -> str:
        """A matrix of expressions, row by row."""
        lines = zip(*rows, strict=True) if self.by_columns else rows
        return self.listed(self.matrix, [self.listed(self.row, line) for line in lines], self.between_rows)


def fill(template: str, values: Mapping[str, str]) -> str:
    """The template with <key> replaced by values[key].

    >>> print(fill("f(<x>)", {"x": "point"}))
    f(point)
    """
    return re.sub(r"<([A-Za-z]+)>", lambda match: values[match[1]], template)
