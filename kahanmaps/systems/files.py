"""System files: a differential equation in TOML, all its mistakes told at once, written so that it reads back equal.

A file has exactly one of [system] (right-hand sides), [hamiltonian] (H and J) and [family] (A, H, signs), and may have
[parameters], [integrals] and [density]; docs/system-files.md describes them. Numbers are exact: decimals are read as
decimals, quoted or not.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.fields import rational
from kahanmaps.algebra.polynomials import RationalFunction, degree
from kahanmaps.algebra.text import (
    check_names,
    format_number,
    format_polynomial,
    parse_constant,
    parse_polynomial,
    parse_rational_function,
    shorten,
)
from kahanmaps.errors import InputError, SystemFileError
from kahanmaps.family.associated import FamilyMember
from kahanmaps.family.cubics import default_variables
from kahanmaps.sources import SOURCES
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import MAX_DIMENSION, QuadraticSystem

MAX_FILE_BYTES = 16_000_000
KINDS = ("system", "hamiltonian", "family")
_KEYS = {
    "": {"name", "variables", "parameters", *KINDS, "integrals", "density", "catalog"},
    "system": {"rhs"},
    "hamiltonian": {"H", "J"},
    "family": {"A", "H", "signs"},
    "density": {"phi"},
    "catalog": {"title", "sources", "convention", "facts"},
}


@dataclass(frozen=True, eq=False)
class SystemFile:
    """A system with everything that its file says of it.

    `system` is the quadratic system whose Kahan map is meant; `hamiltonian` and `member` are there when the file
    (or the Python object it was made from) says so. `integrals` and `density` are claims: rational functions in the
    variables and `eps`. `document` is the file as plain data, parameters not yet inserted.
    """

    name: str
    kind: str
    parameters: Mapping[str, fmpq]
    system: QuadraticSystem
    hamiltonian: CubicHamiltonian | None
    member: FamilyMember | None
    integrals: Mapping[str, RationalFunction]
    density: RationalFunction | None
    document: Mapping[str, Any] = field(repr=False)

    @property
    def variables(self) -> tuple[str, ...]:
        """The names of the variables."""
        return self.system.variables

    def require_claim(self, what: str, function: RationalFunction) -> None:
        """Raises InputError unless the function is one of the system's variables and eps, in this order."""
        expected = (*self.variables, "eps")
        if function.names != expected:
            raise InputError(
                f"found {what} in the variables {', '.join(function.names)}, expected a rational function of "
                f"{', '.join(expected)}: make it with parse_rational_function(text, {list(expected)})"
            )

    @property
    def catalog(self) -> Mapping[str, Any]:
        """Title, sources, convention and facts, for files of the catalogue."""
        found: Mapping[str, Any] = self.document.get("catalog", {})
        return found

    @classmethod
    def from_system(cls, system: QuadraticSystem, name: str = "system") -> SystemFile:
        """A quadratic system without further structure."""
        rhs = [format_polynomial(polynomial) for polynomial in system.rhs]
        document = {"name": name, "variables": list(system.variables), "system": {"rhs": rhs}}
        return cls(name, "system", {}, system, None, None, {}, None, document)

    @classmethod
    def from_hamiltonian(cls, hamiltonian: CubicHamiltonian, name: str = "system") -> SystemFile:
        """A Hamiltonian system."""
        structure: Any = "standard" if hamiltonian.is_standard else _rows(hamiltonian.J)
        section = {"H": format_polynomial(hamiltonian.H), "J": structure}
        document = {"name": name, "variables": list(hamiltonian.variables), "hamiltonian": section}
        return cls(name, "hamiltonian", {}, hamiltonian.system, hamiltonian, None, {}, None, document)

    @classmethod
    def from_member(cls, member: FamilyMember, name: str = "member") -> SystemFile:
        """A member of the commuting family, or the associated system that its signs pick."""
        section: dict[str, Any] = {"A": _rows(member.A), "H": format_polynomial(member.H)}
        if any(sign < 0 for sign in member.signs):
            section["signs"] = list(member.signs)
        document: dict[str, Any] = {"name": name, "family": section}
        if member.variables != default_variables(member.dim):
            document["variables"] = list(member.variables)
        chosen = member.chosen
        return cls(name, "family", {}, chosen.system, chosen.hamiltonian, member, {}, None, document)

    def to_toml(self) -> str:
        """The file as text; `parse_system` reads it back equal."""
        return _to_toml(self.document)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, SystemFile):
            return NotImplemented
        return (
            (self.name, self.kind, self.parameters) == (other.name, other.kind, other.parameters)
            and self.system == other.system
            and self.hamiltonian == other.hamiltonian
            and self.member == other.member
            and self.integrals == other.integrals
            and self.density == other.density
        )

    __hash__ = None  # type: ignore[assignment]  # the claims have no hash that agrees with ==


def read_system(path: str | Path, parameters: Mapping[str, Any] | None = None) -> SystemFile:
    """The system in a TOML file; `parameters` replace those of the file.

    Raises SystemFileError with every mistake of the file, InputError where it cannot be read.
    """
    try:
        with open(path, "rb") as stream:
            data = stream.read(MAX_FILE_BYTES + 1)
    except OSError as error:
        raise InputError(f"cannot read the system file {path}: {error.strerror or error}") from error
    except ValueError as error:  # a path with a NUL character
        raise InputError(f"cannot read the system file {str(path)!r}: {error}") from error
    return parse_system(data, str(path), parameters)


def parse_system(text: str | bytes, where: str = "system", parameters: Mapping[str, Any] | None = None) -> SystemFile:
    """The system that a text in TOML describes; `where` names the text in messages.

    >>> parse_system('variables = ["x"]\\n[system]\\nrhs = ["x^3"]', "example")
    Traceback (most recent call last):
        ...
    kahanmaps.errors.SystemFileError: example: 1 mistake
      system.rhs[1]: found a polynomial of degree 3, expected at most 2
    """
    if len(text) > MAX_FILE_BYTES:
        raise InputError(f"{where} is larger than {MAX_FILE_BYTES} bytes, the limit for a system file")
    try:
        # Some editors put a byte order mark first.
        decoded = text.decode("utf-8-sig") if isinstance(text, bytes) else text
        # Python's own limit on digits applies to integers written without quotes, before we see them.
        document = tomllib.loads(decoded, parse_float=str)
    except UnicodeDecodeError as error:
        raise SystemFileError(where, [("TOML", f"not UTF-8 text: {error.reason} at byte {error.start}")]) from error
    except tomllib.TOMLDecodeError as error:
        raise SystemFileError(where, [("TOML", f"{error}")]) from error
    except (RecursionError, ValueError) as error:
        hint = "nested too deeply" if isinstance(error, RecursionError) else "write long numbers in quotes"
        raise SystemFileError(where, [("TOML", f"cannot be read: {hint}")]) from error
    return _Reader(document, where, parameters or {}).read()


class _Reader:
    """One pass over a document: every part is read as far as it can be, mistakes are collected."""

    def __init__(self, document: dict[str, Any], where: str, overrides: Mapping[str, Any]) -> None:
        self.document = document
        self.where = where
        self.overrides = overrides
        self.mistakes: list[tuple[str, str]] = []
        self.parameters: dict[str, fmpq] = {}
        self.unsure = False  # some parameter has no value: what depends on values is not judged
        self.variables: tuple[str, ...] | None = None

    def read(self) -> SystemFile:
        self._unknown_keys("", self.document)
        kinds = [kind for kind in KINDS if kind in self.document]
        if len(kinds) != 1:
            found = ", ".join(f"[{kind}]" for kind in kinds) or "none"
            self._mistake(
                "file", f"found {found} of the sections [system], [hamiltonian], [family], expected exactly one"
            )
        self._read_parameters()
        name = self.document.get("name", self._default_name())
        if not isinstance(name, str):
            self._mistake("name", f"found {_show(name)}, expected text")
        kind = kinds[0] if len(kinds) == 1 else ""
        self._read_variables(kind)
        system, hamiltonian, member = None, None, None
        section = self._table(kind) if kind else None
        if section is not None:
            self._unknown_keys(kind, section)
            if kind == "system":
                system = self._read_rhs(section)
            elif kind == "hamiltonian":
                hamiltonian = self._read_hamiltonian(section)
                system = hamiltonian.system if hamiltonian else None
            else:
                member = self._read_member(section)
                hamiltonian = member.chosen.hamiltonian if member else None
                system = hamiltonian.system if hamiltonian else None
        integrals = self._read_integrals()
        density = self._read_density()
        self._read_catalog()
        if self.mistakes or system is None:
            raise SystemFileError(self.where, self.mistakes)
        return SystemFile(
            name, kind, self.parameters, system, hamiltonian, member, integrals, density, self._normalised()
        )

    def _mistake(self, key: str, sentence: str) -> None:
        # Keys come from the file: nothing in them may reach a terminal as an escape sequence.
        self.mistakes.append((key if key.isprintable() and len(key) <= 100 else shorten(key, 100), sentence))

    def _unknown_keys(self, section: str, table: Mapping[str, Any]) -> None:
        known = _KEYS[section]
        for key in table:
            if key not in known:
                path = f"{section}.{key}" if section else key
                self._mistake(path, f"unknown key, expected one of {', '.join(sorted(known))}")

    def _table(self, key: str) -> dict[str, Any] | None:
        value = self.document.get(key, {})
        if isinstance(value, dict):
            return value
        self._mistake(key, f"found {_show(value)}, expected a table [{key}]")
        return None

    def _default_name(self) -> str:
        return Path(self.where).stem if self.where.endswith(".toml") else self.where

    def _read_parameters(self) -> None:
        for name, value in (self._table("parameters") or {}).items():
            path = f"parameters.{name}"
            if name == "eps":
                self._mistake(path, "eps is the step of the map and cannot be a parameter")
                continue
            try:
                check_names([name])
            except InputError as error:
                self._mistake(path, str(error))
                continue
            try:
                self.parameters[name] = rational(_plain_number(self.overrides.get(name, value)))
            except InputError as error:
                self._mistake(path, str(error))
                self.parameters[name] = fmpq(1)  # or every use of it would be a mistake of its own
                self.unsure = True
        declared = self.document.get("parameters", {})
        for name in self.overrides:
            if not isinstance(declared, dict) or name not in declared:
                known = ", ".join(self.parameters) or "none"
                self._mistake("parameters", f"unknown parameter {name!r}, this system has: {known}")

    def _read_variables(self, kind: str) -> None:
        given = self.document.get("variables")
        if given is None:
            if kind == "family":
                A = (self._table("family") or {}).get("A")
                if isinstance(A, list) and 0 < len(A) <= MAX_DIMENSION:
                    self.variables = default_variables(len(A))
            else:
                self._mistake("variables", 'missing, expected a list of names, e.g. ["x", "y"]')
            return
        if not isinstance(given, list) or not given or not all(isinstance(name, str) for name in given):
            self._mistake("variables", f'found {_show(given)}, expected a list of names, e.g. ["x", "y"]')
            return
        if len(given) > MAX_DIMENSION:
            self._mistake("variables", f"found {len(given)} variables, expected at most {MAX_DIMENSION}")
            return
        try:
            check_names(given)
        except InputError as error:
            self._mistake("variables", str(error))
            return
        clash = [name for name in given if name in self.parameters]
        if "eps" in given:
            self._mistake("variables", "eps is the step of the map and cannot be a variable")
        elif clash:
            self._mistake("variables", f"{clash[0]!r} is a parameter as well, expected distinct names")
        else:
            self.variables = tuple(given)

    def _text(self, path: str, value: Any) -> str | None:
        if isinstance(value, int | str) and not isinstance(value, bool):
            try:
                return _plain_text(value)
            except InputError as error:
                self._mistake(path, str(error))
                return None
        self._mistake(path, f"found {_show(value)}, expected an expression in quotes")
        return None

    def _polynomial(self, path: str, value: Any, at_most: int) -> fmpq_mpoly | None:
        text = self._text(path, value)
        if text is None or self.variables is None:
            return None
        try:
            polynomial = parse_polynomial(text, self.variables, self.parameters)
        except InputError as error:
            self._mistake(path, str(error))
            return None
        if degree(polynomial) > at_most and not self.unsure:
            self._mistake(path, f"found a polynomial of degree {degree(polynomial)}, expected at most {at_most}")
            return None
        return polynomial

    def _matrix(self, path: str, value: Any, size: int | None) -> fmpq_mat | None:
        if not isinstance(value, list) or not value or not all(isinstance(row, list) for row in value):
            self._mistake(path, f'found {_show(value)}, expected rows of numbers, e.g. [["0", "1"], ["-1", "0"]]')
            return None
        expected = size or len(value)
        if expected > MAX_DIMENSION:
            self._mistake(path, f"found {expected} rows, expected at most {MAX_DIMENSION}")
            return None
        bad = False
        if len(value) != expected:
            self._mistake(path, f"found {len(value)} rows, expected {expected}")
            bad = True
        entries: list[fmpq] = []
        for i, row in enumerate(value):
            if len(row) != expected:
                self._mistake(f"{path}[{i + 1}]", f"found {len(row)} entries, expected {expected}")
                bad = True
            for j, entry in enumerate(row):
                text = self._text(f"{path}[{i + 1}][{j + 1}]", entry)
                try:
                    entries.append(parse_constant(text, self.parameters) if text is not None else fmpq(0))
                    bad = bad or text is None
                except InputError as error:
                    self._mistake(f"{path}[{i + 1}][{j + 1}]", str(error))
                    bad = True
        return None if bad else fmpq_mat(expected, expected, entries)

    def _required(self, section: str, table: Mapping[str, Any], key: str) -> Any:
        if key not in table:
            self._mistake(f"{section}.{key}", "missing")
        return table.get(key)

    def _read_rhs(self, section: Mapping[str, Any]) -> QuadraticSystem | None:
        rhs = self._required("system", section, "rhs")
        if rhs is None:
            return None
        if not isinstance(rhs, list):
            self._mistake("system.rhs", f"found {_show(rhs)}, expected a list of polynomials in quotes")
            return None
        polynomials = [self._polynomial(f"system.rhs[{i + 1}]", value, 2) for i, value in enumerate(rhs)]
        if self.variables is None:
            return None
        if len(rhs) != len(self.variables):
            count = len(self.variables)
            self._mistake("system.rhs", f"found {len(rhs)} right-hand sides, expected {count}, one for each variable")
            return None
        known = [polynomial for polynomial in polynomials if polynomial is not None]
        return QuadraticSystem.from_polynomials(known) if len(known) == len(rhs) else None

    def _read_hamiltonian(self, section: Mapping[str, Any]) -> CubicHamiltonian | None:
        value = self._required("hamiltonian", section, "H")
        H = self._polynomial("hamiltonian.H", value, 3) if value is not None else None
        given = self._required("hamiltonian", section, "J")
        if given is None:
            return None
        n = len(self.variables) if self.variables is not None else None
        J: fmpq_mat | None = None
        if given == "standard":
            try:
                J = standard_structure(n) if n is not None else None
            except InputError as error:
                self._mistake("hamiltonian.J", str(error))
        elif isinstance(given, str):
            self._mistake("hamiltonian.J", f'found {_show(given)}, expected "standard" or a skew matrix')
        else:
            J = self._matrix("hamiltonian.J", given, n)
        if J is None or self.variables is None or self.unsure:
            return None
        try:
            zero = parse_polynomial("0", self.variables)
            hamiltonian = CubicHamiltonian(H if H is not None else zero, J)
        except InputError as error:
            self._mistake("hamiltonian.J", str(error))
            return None
        return hamiltonian if H is not None else None

    def _read_member(self, section: Mapping[str, Any]) -> FamilyMember | None:
        given, value = self._required("family", section, "A"), self._required("family", section, "H")
        size = len(self.variables) if self.variables is not None else None
        A = self._matrix("family.A", given, size) if given is not None else None
        H = self._polynomial("family.H", value, 3) if value is not None else None
        signs = section.get("signs", [])
        signs_are_good = isinstance(signs, list) and all(type(sign) is int and sign in (1, -1) for sign in signs)
        if not signs_are_good:
            self._mistake("family.signs", f"found {_show(signs)}, expected a list of 1 and -1")
        if A is None or H is None or self.unsure:
            return None
        try:
            return FamilyMember(A, H, tuple(signs) if signs_are_good else ())
        except InputError as error:
            message = str(error)
            key = "A" if message.startswith("A is") else "signs" if "signs" in message.split(",")[0] else "H"
            self._mistake(f"family.{key}", message)
            return None

    def _claim(self, path: str, value: Any) -> RationalFunction | None:
        text = self._text(path, value)
        if text is None or self.variables is None:
            return None
        try:
            return parse_rational_function(text, (*self.variables, "eps"), self.parameters)
        except InputError as error:
            self._mistake(path, str(error))
            return None

    def _read_integrals(self) -> dict[str, RationalFunction]:
        claims = {}
        for name, value in (self._table("integrals") or {}).items():
            claim = self._claim(f"integrals.{name}", value)
            if claim is not None:
                claims[name] = claim
        return claims

    def _read_density(self) -> RationalFunction | None:
        if "density" not in self.document:
            return None
        section = self._table("density")
        if section is None:
            return None
        self._unknown_keys("density", section)
        value = self._required("density", section, "phi")
        claim = self._claim("density.phi", value) if value is not None else None
        if claim is not None and claim.numerator.is_zero() and not self.unsure:
            self._mistake("density.phi", "found 0, expected a function that is not zero: the measure is dx/phi")
            return None
        return claim

    def _read_catalog(self) -> None:
        section = self._table("catalog")
        if not section:
            return
        self._unknown_keys("catalog", section)
        for key in ("title", "convention"):
            if not isinstance(section.get(key, ""), str):
                self._mistake(f"catalog.{key}", f"found {_show(section[key])}, expected text")
        for key in ("sources", "facts"):
            value = section.get(key, [])
            if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
                self._mistake(f"catalog.{key}", f"found {_show(value)}, expected a list of texts")
            elif key == "sources":
                for item in value:
                    if item not in SOURCES:
                        self._mistake("catalog.sources", f"unknown source {item!r}, expected a key of sources.py")

    def _normalised(self) -> dict[str, Any]:
        """The document with its name and the parameters that hold."""
        document = {key: value for key, value in self.document.items() if key not in ("name", "parameters")}
        document = {"name": self.document.get("name", self._default_name()), **document}
        if self.parameters:
            document["parameters"] = {name: format_number(value) for name, value in self.parameters.items()}
        return document


def _plain_number(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, int | str | fmpq):
        if isinstance(value, list | dict):
            raise InputError(f"found {_show(value)}, expected a number")
        return value
    return value


def _plain_text(value: int | str) -> str:
    return value if isinstance(value, str) else format_number(fmpq(value))


def _rows(matrix: fmpq_mat) -> list[list[str]]:
    return [[format_number(entry) for entry in row] for row in matrix.tolist()]


def _show(value: Any) -> str:
    try:
        text = repr(value)
    except (RecursionError, ValueError):  # tables nested by dotted keys; hexadecimal integers of any length
        return "a value too large to show"
    return text if len(text) <= 60 else f"{text[:40]}...{text[-15:]}"


def _to_toml(document: Mapping[str, Any]) -> str:
    lines = []
    for key in ("name", "variables"):
        if key in document:
            lines.append(f"{key} = {_toml_value(document[key])}")
    for section in ("catalog", "parameters", *KINDS, "integrals", "density"):
        if section in document and document[section] is not None:
            lines += ["", f"[{section}]"]
            lines += [f"{_toml_key(key)} = {_toml_value(value)}" for key, value in document[section].items()]
    return "\n".join(lines) + "\n"


def _toml_key(key: str) -> str:
    bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    return key if bare else _toml_string(key)


def _toml_value(value: Any) -> str:
    if isinstance(value, bool) or not isinstance(value, str | int | Sequence):
        return _toml_string(str(value))
    if isinstance(value, str):
        return _toml_string(value)
    if isinstance(value, int):
        # TOML readers written in Python refuse long decimals without quotes.
        return str(value) if value.bit_length() <= 10_000 else _toml_string(format_number(fmpq(value)))
    parts = [_toml_value(item) for item in value]
    line = f"[{', '.join(parts)}]"
    if len(line) <= 100 and not any(isinstance(item, list) for item in value):
        return line
    return "[\n" + "".join(f"  {part},\n" for part in parts) + "]"


def _toml_string(text: str) -> str:
    # A JSON string is a TOML basic string, but for DEL, which TOML wants escaped.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
