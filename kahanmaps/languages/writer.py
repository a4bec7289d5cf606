"""The file in another language: a comment on top, then a function for everything that was asked for or is needed."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType

from flint import fmpq_mpoly

from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.algebra.written.text import format_polynomial
from kahanmaps.languages.formulas import Formulas
from kahanmaps.languages.language import Language, fill
from kahanmaps.maps.convention import eps_share
from kahanmaps.sources import SOURCES
from kahanmaps.version import __version__

PARTS = ("system", "map", "inverse", "jacobian", "map-formulas", "integrals", "density")

_NUMBER, _VECTOR, _MATRIX = range(3)


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
    return _Writer(language, formulas, prefix).text(parts, command)


def header(formulas: Formulas, command: str, width: int = 100) -> list[str]:
    """What the comment on top says, line by line: the system, eps, parameters, sources, and what made it."""
    file = formulas.file
    title = file.catalog.get("title", "")
    lines = [f"{file.name}: {title}" if title else file.name]
    if not formulas.rhs:
        rows = str(formulas.map).split("\n")[:12]
        lines += [f"  {line if len(line) <= width else line[: width - 4] + ' ...'}" for line in rows]
    elif len(formulas.rhs) <= 12:
        texts = [format_polynomial(polynomial) for polynomial in formulas.rhs]
        lines += [
            f"  {name}' = {text if len(text) <= width else text[: width - 4] + ' ...'}"
            for name, text in zip(formulas.variables, texts, strict=True)
        ]
    if share := eps_share(formulas.map):
        lines.append(f"{share}: the time step is {2 * formulas.map.time_steps} eps.")
    numbers = [f"{name} = {value}" for name, value in file.parameters.items() if name not in formulas.symbols]
    if numbers:
        lines.append(f"Parameters: {', '.join(numbers)}")
    if formulas.symbols:
        lines.append(f"Parameters left as symbols: {', '.join(formulas.symbols)}")
    if (root := file.map.root) is not None:
        lines.append(
            f"where {formulas.symbols[0]} is a {root}{root.decimal}: give that number, or any of its conjugates."
        )
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

    def __init__(self, language: Language, formulas: Formulas, prefix: str) -> None:
        self.language, self.formulas = language, formulas
        self.used: set[str] = set()
        self.prefix = [prefix] if prefix else []
        fixed = "vector_field kahan_matrix kahan_vector kahan_map kahan_inverse kahan_jacobian kahan_map_formula"
        fixed += " modified_hamiltonian density"
        # Of functions: what they are -> how they are called.
        called = {key: key for key in fixed.split()}
        if not formulas.rhs:
            called = {key: key.replace("kahan_map", "map_step").replace("kahan", "map") for key in called}
        self.names = {key: self._new_name(name) for key, name in called.items()}
        self.names |= {f"integral {name}": self._new_name("integral", name) for name in formulas.integrals}
        self.names |= {name: self._new_name("integral", name) for name in formulas.forms}
        self.words = {"n": str(formulas.dim), "map": self.names["kahan_map"]}
        self.words |= {key: self._new_name("kahan", key) for key in ("solve", "module")}
        self.words |= {key: self._new_name(key) for key in ("vector", "matrix")}
        self.safe = language.safe((*formulas.names, *formulas.new), self.used)
        self.safe["eps"] = "eps"
        self.eps = ["eps"] if formulas.map.has_eps else []
        self.symbols = [self.safe[name] for name in formulas.symbols]
        self.written: dict[str, str] = {}  # name in the language -> text

    def _new_name(self, *words: str) -> str:
        return self.language.fresh(self.language.function(*self.prefix, *words), self.used)

    def text(self, parts: Sequence[str], command: str) -> str:
        """The whole file."""
        for part in parts:
            getattr(self, f"_{part.replace('-', '_')}")()
        language, formulas = self.language, self.formulas
        lines = header(formulas, command)
        renamed = [f"{name} is called {used}" for name in formulas.names if (used := self.safe[name]) != name]
        if renamed:
            lines.append(f"Names that {language.title} cannot use or reads otherwise: {', '.join(renamed)}")
        if self.names["kahan_map"] in self.written:
            values = [str(k) for k in range(1, formulas.dim + 1)]
            more = "".join(f", {value}" for value in [*[language.tenth] * len(self.eps), *self.symbols])
            told = ", ".join(values) if len(values) <= 12 else f"1, 2, ..., {len(values)}"
            lines.append(f"For example: {fill(language.usage, self.words | {'values': told, 'more': more})}")
        solver = language.solver if any(self.words["solve"] in text for text in self.written.values()) else ""
        words = self.words | {"functions": language.listed(("", ""), list(self.written))}
        head, solver, tail = (fill(text, words) for text in (language.head, solver, language.tail))
        top = "\n".join(map(language.commented, lines))
        return "\n\n".join(filter(None, [top, head, solver, *self.written.values(), tail])) + "\n"

    def _system(self) -> None:
        self._formulas("vector_field", "x' = f(x)", self.formulas.rhs, eps=False)

    def _map(self) -> None:
        rows = [[self._expression(entry) for entry in row[:-1]] for row in self.formulas.equation]
        body = fill(self.language.table(rows), self.words)
        told = ["M", "r", "The map x -> x~, where M x~ = r"]
        if self.formulas.rhs:
            told = ["M = I - eps f'(x)", "r = M x + 2 eps f(x)"]
            told.append("The Kahan map: x~ = x + 2 eps (I - eps f'(x))^(-1) f(x), or M x~ = r")
        self._function("kahan_matrix", told[0], _MATRIX, body, {"point": self.formulas.variables})
        right = [row[-1] for row in self.formulas.equation]
        self._formulas("kahan_vector", told[1], right)
        body = self._solve(self.language.solve, self._call("kahan_vector", "point", *self.eps))
        self._function("kahan_map", told[2], _VECTOR, body)

    def _inverse(self) -> None:
        if not self.formulas.rhs:
            self._formulas("kahan_inverse", "The inverse of the map", self.formulas.inverse_form())
            return
        self._map()
        body = self._call("kahan_map", "point", "-eps")
        self._function("kahan_inverse", "Its inverse, which is the map with -eps", _VECTOR, body)

    def _jacobian(self) -> None:
        self._map()
        above = self._call("kahan_matrix", self._call("kahan_map", "point", "eps"), "-eps")
        body = self._solve(self.language.solve_matrix or self.language.solve, above)
        words = "Its Jacobi matrix: (I - eps f'(x))^(-1) (I + eps f'(x~))"
        self._function("kahan_jacobian", words, _MATRIX, body)

    def _map_formulas(self) -> None:
        of = "x and eps" if self.eps else "x"
        words = f"The {'Kahan map' if self.formulas.rhs else 'map'} as rational functions of {of}"
        self._formulas("kahan_map_formula", words, self.formulas.closed_form())

    def _integrals(self) -> None:
        formulas = self.formulas
        for name, function in formulas.integrals.items():
            words = f"{name}: the file says that it is an integral of the map"
            body = self._expression(function)
            self._function(f"integral {name}", words, _NUMBER, body, {"point": formulas.variables})
        for k, (name, matrix) in enumerate(formulas.forms.items()):
            form = "J" if k == 0 else "J A^T" if k == 1 else f"J (A^T)^{k}"
            self._of_two_points(name, f"x^T M x~/eps with M = {form}", formulas.of_two_points(matrix))
        if formulas.H is not None and not formulas.forms:
            words = "H + grad H . (x~ - x)/3, where f = J grad H"
            self._of_two_points("modified_hamiltonian", words, formulas.of_two_points())

    def _of_two_points(self, key: str, words: str, function: RationalFunction) -> None:
        self._map()
        of = f"{key} of two points"
        self.names[of] = self._new_name(self.names[key], "of")
        points = {"point": self.formulas.variables, "image": self.formulas.new}
        self._function(of, words, _NUMBER, self._expression(function), points)
        body = self._call(of, "point", self._call("kahan_map", "point", "eps"), "eps")
        self._function(key, "An integral of the map, by a theorem", _NUMBER, body)

    def _density(self) -> None:
        if self.formulas.density is not None:
            words = "phi; the file says that dx/phi is invariant under the map"
            body = self._expression(self.formulas.density)
            self._function("density", words, _NUMBER, body, {"point": self.formulas.variables})
            return
        self._map()
        body = self._solve(self.language.det, "")
        words = "dx/phi is invariant under the map, by a theorem: phi = det(I - eps f'(x))"
        self._function("density", words, _NUMBER, body)

    def _expression(self, function: fmpq_mpoly | RationalFunction) -> str:
        return self.language.expression(function, self.safe)

    def _call(self, key: str, *arguments: str) -> str:
        values = {"name": self.names[key], "arguments": ", ".join([*arguments, *self.symbols])}
        return fill(self.language.call, values)

    def _solve(self, template: str, right: str) -> str:
        return fill(template, self.words | {"M": self._call("kahan_matrix", "point", *self.eps), "right": right})

    def _formulas(
        self, key: str, words: str, entries: Iterable[fmpq_mpoly | RationalFunction], eps: bool = True
    ) -> None:
        body = self.language.listed(self.language.vector, [self._expression(entry) for entry in entries])
        self._function(key, words, _VECTOR, fill(body, self.words), {"point": self.formulas.variables}, eps)

    def _function(
        self,
        key: str,
        words: str,
        kind: int,
        body: str,
        points: Mapping[str, Sequence[str]] = MappingProxyType({"point": ()}),
        eps: bool = True,
    ) -> None:
        """Write a function, once; `points` are its points and what their coordinates are called in the body.

        A point without names for its coordinates is used as a whole.
        """
        language = self.language
        taken = {point: [self.safe[name] for name in names] for point, names in points.items()}
        local = [name for names in taken.values() for name in names]
        eps = eps and bool(self.eps)
        numbers = [*["eps"] * eps, *self.symbols]
        arguments = [fill(language.point, {"name": point, **self.words}) for point in taken]
        arguments += [fill(language.number, {"name": "eps"})] * eps
        arguments += [fill(language.symbol, {"name": name}) for name in self.symbols]
        lines = []
        for point, names in taken.items():
            coordinates = [
                fill(language.coordinate, {"name": name, "point": point, "number": str(k + 1), "index": str(k)})
                for k, name in enumerate(names)
            ]
            if names:
                every = language.listed(("", ""), coordinates, language.between)
                lines.append(fill(language.take, {"coordinates": every, "point": point}))
        lines += [fill(language.exact, {"name": name}) for name in numbers if local]
        indent = language.definition.partition("<unpack>")[0].rpartition("\n")[2]
        values = {
            "name": self.names[key],
            "kind": fill(language.kinds[kind], self.words),
            "arguments": ", ".join(arguments),
            "declared": ", ".join([*(f"{point}({len(self.formulas.variables)})" for point in taken), *numbers]),
            "local": fill(language.local, {"names": ", ".join(local)}) if local else "",
            "unpack": "".join(f"{line}\n{indent}" for line in lines if line),
            "body": body,
        }
        text = fill(language.definition, values)
        if language.continued:
            together = text.replace(f"{language.continued}\n        ", " ").splitlines()
            wrapped = [textwrap.wrap(line, 110, break_long_words=False) for line in together]
            text = "\n".join(f"{language.continued}\n        ".join(line) for line in wrapped)
        self.written[self.names[key]] = f"{language.commented(words)}\n{text}"
