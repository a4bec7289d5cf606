"""The file in another language: a comment on top, then a function for everything that was asked for or is needed."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Sequence

from flint import fmpq_mpoly

from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.algebra.text import format_polynomial
from kahanmaps.languages.formulas import Formulas
from kahanmaps.languages.language import Language, broken, fill, listed
from kahanmaps.sources import SOURCES
from kahanmaps.version import __version__

# Parts that are one function of every system.
_FIXED = {
    "system": "vector_field",
    "map": "kahan_map",
    "inverse": "kahan_inverse",
    "jacobian": "kahan_jacobian",
    "map-formulas": "kahan_map_formula",
}
PARTS = (*_FIXED, "integrals", "density")

_INDENT = "        "
# What a function calls, directly.
_NEEDS = {
    "kahan_map": ("vector_field", "vector_field_jacobian"),
    "kahan_inverse": ("kahan_map",),
    "kahan_jacobian": ("kahan_map",),
    "modified_hamiltonian": ("hamiltonian", "hamiltonian_gradient", "kahan_map"),
    "form": ("kahan_map",),
    "determinant": ("vector_field_jacobian",),
}
_WORDS = {
    "vector_field": "x' = f(x)",
    "vector_field_jacobian": "f'(x), the matrix of the derivatives",
    "kahan_map": "The Kahan map: x~ = x + 2 eps (I - eps f'(x))^(-1) f(x)",
    "kahan_inverse": "Its inverse, which is the map with -eps",
    "kahan_jacobian": "Its Jacobi matrix: (I - eps f'(x))^(-1) (I + eps f'(x~))",
    "kahan_map_formula": "The Kahan map as rational functions of x and eps",
    "hamiltonian": "H, with f = J grad H",
    "hamiltonian_gradient": "grad H",
    "modified_hamiltonian": "An integral of the map, by a theorem: H + grad H . (x~ - x)/3",
    "determinant": "dx/phi is invariant under the map, by a theorem: phi = det(I - eps f'(x))",
    "density": "phi; the file says that dx/phi is invariant under the map",
}


def write(language: Language, formulas: Formulas, parts: Sequence[str], prefix: str, command: str) -> str:
    """The file as text: the parts that are asked for, and the functions that they call.

    Args:
        language: the table of the language.
        formulas: what is to be written, exactly.
        parts: of `PARTS`.
        prefix: put before the names of all functions; "" for none.
        command: the command line that made the file, for the comment on top; "" for none.

    Raises:
        InputError: where the closed form of the map is asked for and too large.
    """
    return _Writer(language, formulas, parts, prefix).text(command)


def header(formulas: Formulas, command: str, width: int = 100) -> list[str]:
    """What the comment on top says, line by line: the system, eps, parameters, sources, and what made it."""
    file = formulas.file
    title = file.catalog.get("title", "")
    lines = [f"{file.name}: {title}" if title else file.name]
    if len(formulas.rhs) <= 12:
        texts = [format_polynomial(polynomial) for polynomial in formulas.rhs]
        lines += [
            f"  {name}' = {text if len(text) <= width else text[: width - 4] + ' ...'}"
            for name, text in zip(formulas.variables, texts, strict=True)
        ]
    lines.append("eps is half the time step: the time step is 2 eps.")
    numbers = [f"{name} = {value}" for name, value in file.parameters.items() if name not in formulas.symbols]
    if numbers:
        lines.append(f"Parameters: {', '.join(numbers)}")
    if formulas.symbols:
        lines.append(f"Parameters left as symbols: {', '.join(formulas.symbols)}")
    convention = file.catalog.get("convention")
    lines += [f"Convention of the source: {convention}"] if convention else []
    lines += [f"Source: {SOURCES[key]}" for key in file.catalog.get("sources", ())]
    made = f"Written by kahanmaps {__version__}" + (f": {command}" if command else "")
    lines.append(made)
    wrapped: list[str] = []
    for line in lines:
        shown = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in line)
        keep = line is made or line.startswith("  ")  # a command is to be copied as a whole
        wrapped += [shown] if keep else textwrap.wrap(shown, width, subsequent_indent="  ", break_long_words=False)
    # Python takes "coding: x" in one of the first two lines of a file for the name of its encoding.
    return [re.sub("coding(?=[:=])", "coding ", line) if k < 2 else line for k, line in enumerate(wrapped)]


class _Writer:
    """One file: names are chosen first, then functions are written in the order of their needs."""

    def __init__(self, language: Language, formulas: Formulas, parts: Sequence[str], prefix: str) -> None:
        self.language = language
        self.formulas = formulas
        self.parts = parts
        self.prefix = [prefix] if prefix else []
        self.functions: dict[str, str] = {}  # of fixed functions: what they are -> how they are called here
        for key in (*_WORDS, "form"):
            self.functions[key] = language.naming.function(*self.prefix, key)
        self.functions["determinant"] = self.functions["density"]
        self.used = set(self.functions.values())
        self.claims = {name: self._new_function("integral", name) for name in formulas.integrals}
        self.forms = {name: self._new_function("integral", name) for name in formulas.forms}
        self.safe = language.naming.safe(formulas.names, self.used)
        self.safe["eps"] = "eps"
        self.symbols = [self.safe[name] for name in formulas.symbols]
        self.written: dict[str, str] = {}  # name in the language -> text

    def _new_function(self, *words: str) -> str:
        name = first = self.language.naming.function(*self.prefix, *words)
        number = 2
        while name in self.used:
            name = self.language.naming.function(first, str(number))
            number += 1
        self.used.add(name)
        return name

    def text(self, command: str) -> str:
        """The whole file."""
        for part in self.parts:
            self._part(part)
        language = self.language
        lines = header(self.formulas, command)
        renamed = [f"{old} is called {new}" for old, new in self.safe.items() if old != new]
        if renamed:
            lines.append(f"Names that {language.title} cannot use or reads otherwise: {', '.join(renamed)}")
        values = [str(k) for k in range(1, self.formulas.dim + 1)]
        if self.functions["kahan_map"] in self.written:
            values_text = ", ".join(values) if len(values) <= 12 else f"1, 2, ..., {len(values)}"
            usage = fill(language.usage, {**self.functions, "values": values_text, "more": self._more()})
            lines.append(f"For example: {usage}")
        top = "\n".join(language.comment(line) for line in lines)
        head = fill(language.head, {"functions": listed(list(self.written), "  ")}) if language.head else ""
        return "\n\n".join(filter(None, [top, head, *self.written.values()])) + "\n"

    def _part(self, part: str) -> None:
        formulas = self.formulas
        if part in _FIXED:
            self._fixed(_FIXED[part])
        elif part == "density":
            self._fixed("determinant" if formulas.density is None else "density")
        elif part == "integrals":
            for name, function in formulas.integrals.items():
                words = f"{name}: the file says that it is an integral of the map"
                self._define(self.claims[name], words, self._expression(function), True)
            for k, (name, matrix) in enumerate(formulas.forms.items()):
                self._needed("form")
                form = "J" if k == 0 else "J A^T" if k == 1 else f"J (A^T)^{k}"
                words = f"An integral of the map, by a theorem: x^T M x~/eps with M = {form}"
                self._recipe("form", self.forms[name], words, {"matrix": self.language.constant_matrix(matrix)})
            if formulas.H is not None and not formulas.forms:
                self._fixed("modified_hamiltonian")

    def _needed(self, key: str) -> None:
        for other in _NEEDS.get(key, ()):
            self._fixed(other)

    def _fixed(self, key: str) -> None:
        """Write a function that every system has, once, after those that it calls."""
        name, words, formulas = self.functions[key], _WORDS[key], self.formulas
        if name in self.written:
            return
        self._needed(key)
        if key == "vector_field":
            self._define(name, words, self._vector(formulas.rhs), False)
        elif key == "vector_field_jacobian":
            rows = [[self._broken(entry) for entry in row] for row in formulas.jacobian]
            self._define(name, words, self.language.matrix(rows), False)
        elif key == "kahan_map_formula":
            entries = [self._expression(function) for function in formulas.closed_form()]
            self._define(name, words, self.language.vector(entries), True)
        elif key == "hamiltonian":
            assert formulas.H is not None
            self._define(name, words, self._scalar(self._broken(formulas.H)), False)
        elif key == "hamiltonian_gradient":
            self._define(name, words, self._vector(formulas.gradient), False)
        elif key == "density":
            assert formulas.density is not None
            self._define(name, words, self._expression(formulas.density), True)
        else:
            self._recipe(key, name, words, {})

    def _vector(self, entries: Iterable[fmpq_mpoly]) -> str:
        return self.language.vector([self._broken(entry) for entry in entries])

    def _broken(self, polynomial: fmpq_mpoly) -> str:
        return broken(self.language.polynomial(polynomial, self.safe), _INDENT)

    def _expression(self, function: RationalFunction) -> str:
        return self._scalar(broken(self.language.rational_function(function, self.safe), _INDENT))

    def _scalar(self, text: str) -> str:
        return f"({text})" if "\n" in text else text

    def _define(self, name: str, words: str, body: str, eps: bool) -> None:
        variables = [self.safe[variable] for variable in self.formulas.variables]
        values = {
            "name": name,
            "arguments": self.language.arguments(variables, eps, self.symbols),
            "unpack": self.language.unpack(variables, eps, self.symbols),
            "body": body,
        }
        self._add(words, self.language.function, values)

    def _recipe(self, key: str, name: str, words: str, more: dict[str, str]) -> None:
        values = {
            **self.functions,
            "name": name,
            "n": str(self.formulas.dim),
            "more": self._more(),
            "arguments": self.language.arguments([], True, self.symbols),
            "unpack_eps": self.language.unpack([], True, []),
            **more,
        }
        self._add(words, self.language.recipes[key], values)

    def _add(self, words: str, template: str, values: dict[str, str]) -> None:
        if "<arguments>" not in template:
            body = fill(template.replace("\n", f"\n{self.language.indent}"), values)
            template, values = self.language.definition, {**values, "body": body}
        text = fill(template, values)
        self.written[values["name"]] = f"{self.language.comment(words)}\n{text}"

    def _more(self) -> str:
        return "".join(f", {name}" for name in self.symbols)
