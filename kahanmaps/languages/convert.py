"""Conversion of a system, its Kahan map, integrals and density to a file for another program.

SymPy's code printers (the extra `[sympy]`) write the expressions in every language except PARI and LaTeX. The file
languages.toml contains the code around the expressions. Numbers stay exact except in C, Fortran and NumPy (floats).
"""

from __future__ import annotations

import re
import textwrap
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.resources import files
from string import Template
from typing import Any

from flint import fmpq_mpoly

from kahanmaps.algebra.parsing import is_name
from kahanmaps.algebra.polynomials import RationalFunction, names_of
from kahanmaps.algebra.printing import Notation, terms_of
from kahanmaps.documents.inline import as_file
from kahanmaps.errors import InputError
from kahanmaps.languages.formulas import Formulas
from kahanmaps.languages.latex import write_latex
from kahanmaps.maps.kahan import SystemLike

LANGUAGES = ("latex", "sympy", "pari", "maple", "mathematica", "sage", "julia", "numpy", "c", "fortran")
PARTS = ("system", "map", "inverse", "jacobian", "map-formulas", "integrals", "density")

_MAX_LINE = 100  # maximal number of characters in a line of an expression
_MAX_SUM = 100  # maximal number of terms of a sum: longer sums are grouped by brackets, as parsers recurse over terms
_MAX_INTEGER = 2**31  # in C, Fortran and NumPy, integers of at least this absolute value are written as floats
# Names that have no other meaning in any language: a lower-case letter with digits (except i, which may be the
# imaginary unit, and e), and words with an underscore (except those of GP's debugger). Other words may be functions.
_SAFE_NAME = re.compile(r"(?![ei]$)[a-z][0-9]*|(?!dbg_)[a-z][A-Za-z0-9]*_[A-Za-z0-9_]*")


def convert(
    system: SystemLike,
    language: str,
    what: Iterable[str] | None = None,
    *,
    name: str = "",
    symbols: Sequence[str] = (),
    command: str = "",
) -> str:
    """Return a map with its known integrals and density as a complete, exact file for another program.

    A system stands for its Kahan map.

    Args:
        system: the system; its parameters are replaced by their values in its file.
        language: one of `LANGUAGES`, such as "pari" or "latex".
        what: a list of `PARTS`; None for the system, the map, and the integrals and density if they are known.
        name: prefix of the names of all functions, so that one session can load two systems; ignored in LaTeX.
        symbols: names of parameters that stay symbols (not for a [family] file); they are arguments after eps.
        command: the command line that creates this file, for the initial comment.

    Returns:
        The text of the file, the same for the same arguments. If the map depends on eps, its functions have eps as an
        argument. The initial comment states that the time step is 2 eps.

    Raises:
        InputError: for an unknown language or part, an invalid name, integrals or a density that are not known, a
            closed form ("map-formulas") that is too large, and if SymPy is needed and missing.

    >>> from kahanmaps.documents.catalog import load
    >>> print(convert(load("harmonic"), "pari", ["system"]).split("\\n\\n")[1].strip())
    \\\\ x' = f(x)
    {vector_field(point) =
      my(x = point[1]);
      my(y = point[2]);
      [y, -x]~
    }
    """
    if language not in LANGUAGES:
        raise InputError(f"found the language {str(language)[:40]!r}, expected one of {', '.join(LANGUAGES)}")
    if name and not (is_name(name) and name[0] != "_"):
        raise InputError(f"found the name {name[:40]!r}, expected a letter, then letters, digits and _")
    formulas = Formulas(as_file(system), symbols)
    if what is None:
        parts = [*(["system"] if formulas.rhs else []), "map"]
        parts += [part for part in ("integrals", "density") if part not in formulas.missing]
    else:
        if isinstance(what, str):
            raise InputError(f"found the text {what[:40]!r}, expected a list of parts such as ['system', 'map']")
        requested = list(what)
        for part in requested:
            if part not in PARTS:
                raise InputError(f"found the part {str(part)[:40]!r}, expected one of {', '.join(PARTS)}")
        if not requested:
            raise InputError(f"found no part, expected some of {', '.join(PARTS)}")
        if not formulas.rhs and (of_field := [part for part in ("system", "jacobian") if part in requested]):
            expected = "map, map-formulas, inverse, integrals or density"
            raise InputError(f"found the part {of_field[0]} of {formulas.map.kind}, expected {expected}")
        for part in formulas.missing:
            if part in requested:
                raise InputError(formulas.missing[part])
        parts = [part for part in PARTS if part in requested]
    if language == "latex":
        return write_latex(formulas, parts, command)
    return _Writer(language, formulas, name).text(parts, command)


class _Writer:
    """The writer of one file: names are chosen first; each function is written after the functions that it calls."""

    def __init__(self, language: str, formulas: Formulas, prefix: str) -> None:
        tables = tomllib.loads(files(__package__).joinpath("languages.toml").read_text("utf-8"))
        self.language: dict[str, Any] = tables["defaults"] | tables[language]
        self.formulas = formulas
        self.polynomial = _polynomial_writer(self.language)
        self.written: dict[str, str] = {}  # name of a function in the language -> its text
        self.used_names = {"point", "image", "eps", "value"}  # names in lower case, since Fortran ignores case
        self.prefix = [prefix] if prefix else []
        kind = "kahan" if formulas.rhs else "map"
        default_names = {f"kahan_{part}": f"{kind}_{part}" for part in ("matrix", "vector", "inverse", "jacobian")}
        default_names |= {"kahan_map": "kahan_map" if formulas.rhs else "map_step"}
        default_names |= {"kahan_map_formula": default_names["kahan_map"] + "_formula"}
        default_names |= {key: key for key in ("vector_field", "modified_hamiltonian", "density")}
        # Names of functions: name in this module -> name in the file.
        self.names = {key: self._fresh_name(*self.prefix, name) for key, name in default_names.items()}
        for key in (*formulas.integrals, *formulas.forms):
            self.names[f"integral {key}"] = self._fresh_name(*self.prefix, "integral", key)
        self.placeholders = {"n": str(formulas.dim), "map": self.names["kahan_map"]}
        self.placeholders |= {key: self._fresh_name(*self.prefix, "kahan", key) for key in ("solve", "module")}
        self.placeholders |= {key: self._fresh_name(*self.prefix, key) for key in ("vector", "matrix")}
        # Names of variables and symbols, all distinct; unchanged unless the language may give them another meaning.
        names = (*formulas.names, *formulas.new)
        unchanged = {name for name in names if _SAFE_NAME.fullmatch(name)}
        unchanged -= set() if self.language["underscores"] else {name for name in names if "_" in name}
        self.spelling = {name: self._fresh_name(name) for name in names if name in unchanged}
        self.spelling |= {name: self._fresh_name("v", name) for name in names if name not in unchanged} | {"eps": "eps"}
        self.eps = ["eps"] if formulas.map.has_eps else []
        self.symbols = [self.spelling[name] for name in formulas.symbols]

    def _fresh_name(self, *words: str) -> str:
        """Return an unused name composed of these words, with a number if necessary, and reserve it."""
        number = 1
        while True:
            all_words = [*words, str(number)] if number > 1 else words
            pieces = [piece for word in all_words for piece in re.split(r"[^A-Za-z0-9]+", word) if piece]
            if self.language["underscores"]:
                name = "_".join(pieces)
            else:  # lower case first: Sin and Integral would be names of Mathematica
                name = pieces[0][0].lower() + pieces[0][1:] + "".join(p[0].upper() + p[1:] for p in pieces[1:])
            if name.lower() not in self.used_names:
                self.used_names.add(name.lower())
                return name
            number += 1

    def text(self, parts: Sequence[str], command: str) -> str:
        """Return the text of the file."""
        for part in parts:
            self._write_part(part)
        language, formulas = self.language, self.formulas
        lines = formulas.header(command)
        renamings = [f"{name} is called {new}" for name in formulas.names if (new := self.spelling[name]) != name]
        if renamings:
            lines.append(f"Names that {language['title']} cannot use or reads otherwise: {', '.join(renamings)}")
        if self.names["kahan_map"] in self.written:
            values = [str(k) for k in range(1, formulas.dim + 1)]
            more = "".join(f", {value}" for value in [*[language["tenth"]] * len(self.eps), *self.symbols])
            example_values = ", ".join(values) if len(values) <= 12 else f"1, 2, ..., {len(values)}"
            lines.append(f"For example: {self._fill('usage', values=example_values, more=more)}")
        needs_solver = any(self.placeholders["solve"] in text for text in self.written.values())
        pieces = [
            "\n".join(map(self._comment, lines)),
            self._fill("head", functions=", ".join(self.written)),
            self._fill("solver") if needs_solver else "",
            *self.written.values(),
            self._fill("tail"),
        ]
        return "\n\n".join(filter(None, pieces)) + "\n"

    def _write_part(self, part: str) -> None:
        """Write the functions of a part and the functions that they call; each function is written only once."""
        formulas, is_kahan = self.formulas, bool(self.formulas.rhs)
        point = {"point": formulas.variables}
        if part == "system":
            self._function("vector_field", "x' = f(x)", "vector", self._vector(formulas.rhs), point, eps=False)
        elif part == "map":
            comments = ["M", "r", "The map x -> x~, where M x~ = r"]
            if is_kahan:
                comments = ["M = I - eps f'(x)", "r = M x + 2 eps f(x)"]
                comments.append("The Kahan map: x~ = x + 2 eps (I - eps f'(x))^(-1) f(x), or M x~ = r")
            rows = [self._bracketed("row", list(map(self._expression, row[:-1]))) for row in formulas.equation]
            matrix = self._bracketed("matrix", rows, self.language["between_rows"])
            self._function("kahan_matrix", comments[0], "matrix", matrix, point)
            right = self._vector([row[-1] for row in formulas.equation])
            self._function("kahan_vector", comments[1], "vector", right, point)
            self._function(
                "kahan_map", comments[2], "vector", self._fill_solver("solve", self._call("kahan_vector", "point"))
            )
        elif part == "inverse" and not is_kahan:
            inverse = self._vector(formulas.inverse_form())
            self._function("kahan_inverse", "The inverse of the map", "vector", inverse, point)
        elif part == "inverse":
            self._write_part("map")
            inverse = self._call("kahan_map", "point", "-eps")
            self._function("kahan_inverse", "Its inverse, which is the map with -eps", "vector", inverse)
        elif part == "jacobian":
            self._write_part("map")
            right = self._call("kahan_matrix", self._call("kahan_map", "point"), "-eps")
            comment = "Its Jacobi matrix: (I - eps f'(x))^(-1) (I + eps f'(x~))"
            solve = "solve_matrix" if self.language["solve_matrix"] else "solve"
            self._function("kahan_jacobian", comment, "matrix", self._fill_solver(solve, right))
        elif part == "map-formulas":
            map_name, arguments = "Kahan map" if is_kahan else "map", "x and eps" if self.eps else "x"
            components = self._vector(formulas.closed_form())
            self._function(
                "kahan_map_formula", f"The {map_name} as rational functions of {arguments}", "vector", components, point
            )
        elif part == "density" and formulas.density is not None:
            comment = "phi; the file says that dx/phi is invariant under the map"
            self._function("density", comment, "number", self._expression(formulas.density), point)
        elif part == "density":
            self._write_part("map")
            comment = "dx/phi is invariant under the map, by a theorem: phi = det(I - eps f'(x))"
            self._function("density", comment, "number", self._fill_solver("det"))
        elif part == "integrals":
            for name, function in formulas.integrals.items():
                comment = f"{name}: the file says that it is an integral of the map"
                self._function(f"integral {name}", comment, "number", self._expression(function), point)
            for key, comment, function in formulas.integrals_by_theorem():
                self._write_part("map")
                self.names[f"{key} of two points"] = self._fresh_name(self.names[key], "of")
                value = self._expression(function)
                self._function(f"{key} of two points", comment, "number", value, point | {"image": formulas.new})
                value = self._call(f"{key} of two points", "point", self._call("kahan_map", "point"), "eps")
                self._function(key, "An integral of the map, by a theorem", "number", value)

    def _function(
        self,
        key: str,
        comment: str,
        kind: str,
        value: str,
        points: Mapping[str, Sequence[str]] | None = None,
        eps: bool = True,
    ) -> None:
        """Write a function; `points` maps each argument that is a point to the names of its coordinates in the body.

        Without `points`, the function has one point as its argument, and the body uses it as a vector.
        """
        numbers = [*(self.eps if eps else []), *self.symbols]
        coordinates = {
            point: [self.spelling[name] for name in names] for point, names in (points or {"point": ()}).items()
        }
        arguments = [self._fill("point", name=point) for point in coordinates]
        arguments += [self._fill("number" if name == "eps" else "symbol", name=name) for name in numbers]
        lines = [
            self._fill("take", name=name, point=point, number=str(k + 1), index=str(k))
            for point, names in coordinates.items()
            for k, name in enumerate(names)
        ]
        if lines and self.language["exact"]:
            lines += [self._fill("exact", name=name) for name in numbers]
        names = [name for point_names in coordinates.values() for name in point_names]
        indent = re.split(r"\$\{?lines", self.language["function"])[0].rpartition("\n")[2]
        text = self._fill(
            "function",
            name=self.names[key],
            kind=self._fill(f"{kind}_kind"),
            arguments=", ".join(arguments),
            declared=", ".join([*(f"{point}({self.formulas.dim})" for point in coordinates), *numbers]),
            local=self._fill("local", names=", ".join(names)) if names else "",
            lines="".join(f"{line}\n{indent}" for line in lines),
            value=value,
        ).lstrip("\n")
        if self.language["continued"]:  # lines of Fortran have at most 132 characters
            long_lines = text.replace("\n        ", " ").splitlines()
            broken_lines = [textwrap.wrap(line, 110, break_long_words=False) for line in long_lines]
            text = "\n".join(f"{self.language['continued']}\n        ".join(line) for line in broken_lines)
        self.written[self.names[key]] = f"{self._comment(comment)}\n{text}"

    def _expression(self, function: RationalFunction | fmpq_mpoly) -> str:
        """Return a polynomial or a quotient of polynomials as an exact expression, on several lines if it is long."""
        if isinstance(function, RationalFunction):
            sides = [function.numerator] if function.is_polynomial else [function.numerator, function.denominator]
        else:
            sides = [function]
        texts = []
        for side in sides:
            terms = list(terms_of(side))
            groups = [dict(terms[k : k + _MAX_SUM]) for k in range(0, len(terms), _MAX_SUM)] or [{}]
            sums = [self.polynomial(side.context().from_dict(group), self.spelling) for group in groups]
            texts.append(sums[0] if len(sums) == 1 else " + ".join(f"({text})" for text in sums))
        expression = texts[0] if len(texts) == 1 else f"({texts[0]})/({texts[1]})"
        lines = [""]  # every line but the last ends with + or -, since no language ends a statement there
        for piece in re.split(r"(?<= [+-] )", expression):
            if lines[-1] and len(lines[-1]) + len(piece) > _MAX_LINE:
                lines.append("")
            lines[-1] += piece
        broken_text = "\n        ".join(line.rstrip() for line in lines)
        return f"({broken_text})" if len(lines) > 1 else broken_text

    def _vector(self, entries: Iterable[RationalFunction | fmpq_mpoly]) -> str:
        return self._bracketed("vector", list(map(self._expression, entries)))

    def _bracketed(self, kind: str, entries: Sequence[str], between: str = ",") -> str:
        """Return entries in the brackets of a vector, a row or a matrix, on one line if it is not too long."""
        has_room = all("\n" not in entry for entry in entries) and sum(len(entry) + 2 for entry in entries) <= _MAX_LINE
        before, after = (Template(bracket).substitute(self.placeholders) for bracket in self.language[kind])
        return before + (between + (" " if has_room else "\n        ")).join(entries) + after

    def _call(self, key: str, point: str, *arguments: str) -> str:
        return self._fill(
            "call", name=self.names[key], arguments=", ".join([point, *(arguments or self.eps), *self.symbols])
        )

    def _fill_solver(self, template: str, right: str = "") -> str:
        return self._fill(template, M=self._call("kahan_matrix", "point"), right=right)

    def _fill(self, template: str, **values: str) -> str:
        return Template(self.language[template]).substitute(self.placeholders | values)

    def _comment(self, line: str) -> str:
        # A backslash at the end of a line would continue a comment in C and Maple; *) would end one in Mathematica.
        spelling = re.sub(r"\\$", "/", line.replace("(*", "( *").replace("*)", "* )"))
        before, after = self.language["comment"]
        return f"{before}{spelling}{after}".rstrip()


def _polynomial_writer(language: Mapping[str, Any]) -> Callable[[fmpq_mpoly, Mapping[str, str]], str]:
    """Return the function that writes a polynomial, given names in the language for the names in its ring.

    Raises InputError if SymPy is needed and not installed.
    """
    if not language["printer"]:  # PARI
        return lambda polynomial, spelling: Notation(
            spelling.__getitem__, str, "{}^{}".format, ("-", " + ", " - "), gap="", eps_first=False
        ).polynomial(polynomial)
    try:
        import sympy
        from sympy.printing.str import StrPrinter
    except ImportError as error:
        raise InputError(
            f"{language['title']} is written by SymPy ({error}): pip install 'kahanmaps[sympy]'"
        ) from error

    class ExactPrinter(StrPrinter):  # type: ignore[misc]
        def _print_Rational(self, value: Any) -> str:  # without this, 1/2 would be a float in Python
            return f"Rational({value.p}, {value.q})"

    is_fortran = language["printer"] == "fcode"
    settings = {"source_format": "free", "standard": 95} if is_fortran else {}
    code = ExactPrinter().doprint if language["printer"] == "ExactPrinter" else getattr(sympy, language["printer"])

    def write(polynomial: fmpq_mpoly, spelling: Mapping[str, str]) -> str:
        symbols = [sympy.Symbol(spelling[name]) for name in names_of(polynomial)]
        terms = []
        for powers, value in terms_of(polynomial):
            coefficient = sympy.Rational(int(value.p), int(value.q))
            if language["floats"] and max(abs(value.p), value.q) >= _MAX_INTEGER:
                coefficient = sympy.Float(coefficient, 17)
            terms.append(sympy.Mul(coefficient, *map(sympy.Pow, symbols, powers)))
        try:
            text = str(code(sympy.Add(*terms), **settings))
        except ValueError as error:  # Python refuses to print more than 4300 digits
            raise InputError(f"found a number that is too long for SymPy: {error}") from error
        return re.sub(r"&\n\s*", "", text)  # long lines are broken later, in all languages

    return write
