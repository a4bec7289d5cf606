"""Reading and writing of system files: an ODE or a map in TOML; all mistakes in a file are reported together.

A file has exactly one of the sections [system] (right-hand sides), [hamiltonian] (H and J), [family] (A, H, signs),
[bilinear], [map] and [composition], and may have [parameters], [integrals] and [density]; docs/system-files.md
describes the format. Numbers are exact: decimals, quoted or not, are read as rational numbers.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.fields import rational
from kahanmaps.algebra.polynomials import RationalFunction, names_of
from kahanmaps.algebra.printing import format_number, format_polynomial
from kahanmaps.atomic_files import write_atomically
from kahanmaps.display_protocols import HtmlDisplay, LatexDisplay, shorten
from kahanmaps.documents.document import DocumentReader
from kahanmaps.documents.families import family_member
from kahanmaps.documents.iterates import iterates_in, with_iterates
from kahanmaps.documents.reader import KINDS
from kahanmaps.documents.toml_text import TomlKind, to_toml
from kahanmaps.documents.xpp import ENDING, is_ode, read_ode
from kahanmaps.errors import InputError, SystemFileError, quoted, reading
from kahanmaps.family.system_normal_form import NoNormalForm, SystemNormalForm, system_normal_form
from kahanmaps.maps.algebraic import AlgebraicMap
from kahanmaps.maps.convention import resolve_eps
from kahanmaps.maps.implicit import Map, MapFamily
from kahanmaps.maps.kahan import KahanFamily
from kahanmaps.maps.values import point_of, values_at
from kahanmaps.systems.hamiltonian import CubicHamiltonian
from kahanmaps.systems.quadratic import QuadraticSystem

if TYPE_CHECKING:
    from kahanmaps.family.associated import ConjugateAssociate, FamilyMember

MAX_FILE_BYTES = 16_000_000
_TOML = TomlKind("system file", MAX_FILE_BYTES, SystemFileError)
_MAX_LABEL = 120  # maximal number of characters of equations that serve as the label of a system
_SECTIONS = ("catalog", "parameters", *KINDS, "integrals", "density")


@dataclass(frozen=True, eq=False)
class SystemFile(HtmlDisplay, LatexDisplay):
    """A system or map with the parameters and claims of its file.

    `map` is the map; for a differential equation it is the Kahan map. `hamiltonian` and `member` are None unless the
    file, or the Python object that was converted, declares them. `integrals` and `density` are claims, rational
    functions of the variables and `eps`. `document` is the file as plain data; formulas in it contain the names of
    parameters, not their values.
    """

    name: str
    kind: str
    parameters: Mapping[str, fmpq]
    map: MapFamily
    hamiltonian: CubicHamiltonian | None
    member: FamilyMember | None
    integrals: Mapping[str, RationalFunction]
    density: RationalFunction | None
    document: Mapping[str, Any] = field(repr=False)
    notes: tuple[str, ...] = ()  # sentences that tell the user how equations were interpreted
    integrals_in_iterates: Mapping[str, RationalFunction] = field(default_factory=dict)  # claims with x~

    @property
    def label(self) -> str:
        """The name in pictures and on pages; for an inline system its equations, if they are short."""
        if self.name != "inline" or not self.is_quadratic:
            return self.name
        rhs = zip(self.variables, self.system.rhs, strict=True)
        equations = ", ".join(f"{name}' = {format_polynomial(f)}" for name, f in rhs)
        return equations if len(equations) <= _MAX_LABEL else self.name

    def labelled(self, letter: str) -> str:
        """Return the label of the system after a letter: f = euler_top, or f: (x' = y, y' = -x)."""
        return f"{letter} = {self.name}" if self.label == self.name else f"{letter}: ({self.label})"

    @property
    def variables(self) -> tuple[str, ...]:
        """The names of the variables."""
        return self.map.variables

    @property
    def dim(self) -> int:
        """The dimension of the phase space."""
        return self.map.dim

    dimension = dim

    def f(self, *point: Any, **named: Any) -> Any:
        """Return the right-hand sides at a point, given as f(x), f({"x": 1, "y": 2}), f("1,2"), f(1, 2) or f(x=1, y=2).

        The result is exact for exact numbers. An array of floats of shape (dim,) or (points, dim) gives an array.
        Raises InputError for a map without a vector field.
        """
        return self.system.f(*point, **named)

    def jacobian(self, *point: Any, **named: Any) -> Any:
        """Return the Jacobi matrix f'(x) at a point, given as in `f`; without a point, a matrix of polynomials."""
        rows = self.system.jacobian(self.variables)
        if not point and not named:
            return rows
        entries = values_at([entry for row in rows for entry in row], self.variables, point_of(point, named))
        if isinstance(entries, tuple):
            return fmpq_mat(self.dim, self.dim, entries)
        return entries.reshape(*entries.shape[:-1], self.dim, self.dim)

    def with_parameters(self, values: Mapping[Any, Any] | None = None, **named: Any) -> SystemFile:
        """Return the system with other parameter values, exact numbers by name. Raises InputError for unknown names."""
        values_by_name = {str(name): value for name, value in {**(values or {}), **named}.items()}
        return parse_system(self.to_toml(), self.name, values_by_name)

    subs = with_parameters

    def kahan(self, eps: Any = None, *, time_step: Any = None, h: Any = None) -> Map:
        """Return the Kahan map at an exact eps or for the time step h = 2 eps. Raises InputError for any other map."""
        _ = self.system
        return self.at(resolve_eps(eps, time_step, h))

    def plot(self, *arguments: Any, **options: Any) -> Any:
        """Draw a portrait and return its axes; the arguments are those of `km.portrait` that follow the system."""
        return import_module("kahanmaps.plots.plot").plot.portrait(self, *arguments, **options)

    @property
    def claim_names(self) -> tuple[str, ...]:
        """The arguments of claimed functions: the variables, the name of the algebraic parameter (if any), and eps."""
        return (*self.variables, *(self.map.family.symbols if isinstance(self.map, AlgebraicMap) else ()), "eps")

    @property
    def is_quadratic(self) -> bool:
        """Whether the map is the Kahan map of a quadratic system without eps in its coefficients."""
        return isinstance(self.map, KahanFamily) and not self.map.system.symbols

    @property
    def system(self) -> QuadraticSystem:
        """The quadratic system whose Kahan map is `map`. Raises InputError if `map` is another map."""
        if self.is_quadratic and isinstance(self.map, KahanFamily):
            return self.map.system
        if self.map.unsupported_reason:
            raise InputError(self.map.unsupported_reason)
        reason = "has eps in its coefficients" if isinstance(self.map, KahanFamily) else f"is of kind [{self.kind}]"
        if self.kind == "system" and not isinstance(self.map, KahanFamily):
            reason = f"stands for a {self.map.title}"
        hint = (
            "; if it is a Kahan map, give its system x' = f(x)"
            if self.kind in ("bilinear", "map", "composition")
            else ""
        )
        raise InputError(f"{self.name} {reason}, expected a quadratic vector field without eps{hint}")

    @property
    def rhs(self) -> tuple[fmpq_mpoly, ...]:
        """The right-hand sides of the quadratic system. Raises InputError if `map` is no Kahan map."""
        return self.system.rhs

    def at(self, eps: Any = None) -> Map:
        """Return the map at an exact eps (half the time step), as a callable. Raises InputError if eps is missing."""
        if hasattr(eps, "__len__") and not isinstance(eps, str):
            raise InputError("found a point, expected eps: system.at(eps)(x) is the image of x, system.f(x) the field")
        if eps is None and self.map.has_eps:
            raise InputError(f'found no eps, expected an exact number such as "1/10": {self.name} depends on it')
        return self.map.at(fmpq(1) if eps is None else rational(eps))

    __call__ = at

    def save(self, path: str | Path) -> None:
        """Write the system to a TOML file."""
        write_atomically(str(path), self.to_toml().encode())

    @property
    def real_approximation(self) -> SystemFile:
        """The file for computations with floats: a rational approximation replaces an algebraic parameter.

        Raises InputError if the algebraic parameter is not real.
        """
        if not isinstance(self.map, AlgebraicMap):
            return self
        overrides = {self.map.family.symbols[0]: self.map.root.real_approximation()}
        return SystemFile(**DocumentReader(dict(self.document), self.name, overrides).read())

    @property
    def normal_form(self) -> SystemNormalForm | NoNormalForm:
        """The normal form of the system, or the reason why there is none. Each access computes it again."""
        if not self.is_quadratic:
            return NoNormalForm(f"it is {self.map.kind}")
        return system_normal_form(self.system, self.hamiltonian, self.member)

    def require_claim(self, what: str, function: RationalFunction) -> None:
        """Raise InputError unless the arguments of the claim `what` are the variables of the system, then eps."""
        expected = self.claim_names
        n = self.dim
        if function.names != with_iterates(expected[:n], iterates_in(*function.names), expected[n:]):
            raise InputError(
                f"found {what} in the variables {', '.join(function.names)}, expected a rational function of "
                f"{', '.join(expected)}: make it with parse_rational_function(text, {list(expected)})"
            )

    @property
    def catalog(self) -> Mapping[str, Any]:
        """The section [catalog] of a catalogue file: title, sources, convention and facts; empty for other files."""
        section: Mapping[str, Any] = self.document.get("catalog", {})
        return section

    @classmethod
    def from_system(cls, system: QuadraticSystem, name: str = "system") -> SystemFile:
        """Return a file for a quadratic system, without Hamiltonian and claims."""
        rhs = [format_polynomial(polynomial) for polynomial in system.rhs]
        document = {"name": name, "variables": list(system.variables), "system": {"rhs": rhs}}
        return cls(name, "system", {}, KahanFamily(system), None, None, {}, None, document)

    @classmethod
    def from_hamiltonian(cls, hamiltonian: CubicHamiltonian, name: str = "system") -> SystemFile:
        """Return a file for a Hamiltonian system."""
        structure: Any = "standard" if hamiltonian.is_standard else _matrix_rows(hamiltonian.J)
        section = {"H": format_polynomial(hamiltonian.H), "J": structure}
        document = {"name": name, "variables": list(hamiltonian.variables), "hamiltonian": section}
        return cls(name, "hamiltonian", {}, KahanFamily(hamiltonian.system), hamiltonian, None, {}, None, document)

    @classmethod
    def from_member(cls, member: FamilyMember, name: str = "member") -> SystemFile:
        """Return a file for a member of the family, or for an associated system if some of `member.signs` are -."""
        from kahanmaps.family.cubics import default_variables

        section: dict[str, Any] = {"A": _matrix_rows(member.A), "H": format_polynomial(member.H)}
        if any(sign < 0 for sign in member.signs):
            section["signs"] = list(member.signs)
        document: dict[str, Any] = {"name": name, "family": section}
        if member.variables != default_variables(member.dim):
            document["variables"] = list(member.variables)
        associate = member.chosen
        return cls(name, "family", {}, KahanFamily(associate.system), associate.hamiltonian, member, {}, None, document)

    @classmethod
    def from_conjugate(cls, associate: ConjugateAssociate, name: str = "conjugate") -> SystemFile:
        """Return a file for an associated system over a number field, whose generator is an algebraic parameter."""
        document = {
            "name": name,
            "variables": list(names_of(associate.chain[0])),
            "parameters": {associate.name: str(associate.root)},
            "hamiltonian": {"H": associate.K_text, "J": "standard"},
        }
        return parse_system(to_toml(document, ("name", "variables"), _SECTIONS), name)

    def to_toml(self) -> str:
        """Return the file as TOML text, from which `parse_system` reads an equal file."""
        return to_toml(self.document, ("name", "variables"), _SECTIONS)

    def __reduce__(self) -> tuple[Any, ...]:
        return parse_system, (self.to_toml(), self.name)

    def __repr__(self) -> str:
        values = "".join(f", {name}={value}" for name, value in self.parameters.items())
        return f"SystemFile({self.name}: {shorten(repr(self.map), 100)}{values})"

    def __str__(self) -> str:
        """Return the equations of the system or map as text; parameters are replaced by their values."""
        return f"{self.name}:\n{self.map}"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, SystemFile):
            return NotImplemented
        return (
            (self.name, self.kind, self.parameters) == (other.name, other.kind, other.parameters)
            and self.map.seed_data == other.map.seed_data
            and self.hamiltonian == other.hamiltonian
            and self.member == other.member
            and self.integrals == other.integrals
            and self.integrals_in_iterates == other.integrals_in_iterates
            and self.density == other.density
        )

    def __hash__(self) -> int:
        return hash((self.name, self.kind, self.variables))


def float_normal_form(file: SystemFile, method: str | None = None) -> SystemNormalForm | NoNormalForm:
    """Return the normal form for orbits in floats, or the reason why none is used, such as the method "generic"."""
    normal_form = NoNormalForm("generic, as requested") if method == "generic" else file.normal_form
    if not isinstance(normal_form, NoNormalForm) and normal_form.T is not None:
        return NoNormalForm("in floating point only J = [[0, I], [-I, 0]] has a normal form")
    return normal_form


def read_system(path: str | Path, parameters: Mapping[str, Any] | None = None) -> SystemFile:
    """Read a system from a TOML file; `parameters` replace values of parameters in the file.

    Raises SystemFileError with all mistakes in the file, and InputError if the file cannot be read.
    """
    data = _TOML.read(path)
    with reading(path):
        return parse_system(data, str(path), parameters)


def parse_system(text: str | bytes, where: str = "system", parameters: Mapping[str, Any] | None = None) -> SystemFile:
    """Parse a system from text in TOML or in the format of XPP; messages call the text `where`.

    >>> parse_system('variables = ["x"]\\n[system]\\nrhs = ["x", "x"]', "example")
    Traceback (most recent call last):
        ...
    kahanmaps.errors.SystemFileError: example: 1 mistake
      system.rhs: found 2 right-hand sides, expected 1, one for each variable
    """
    document, notes = _parse_document(text, where)
    reader = DocumentReader(document, where, parameters or {}, partial(_look_up_part, Path(where).parent))
    reader.enclosing = (os.path.abspath(where),)
    contents = reader.read()
    return SystemFile(**{**contents, "notes": (*notes, *contents["notes"])})


def _parse_document(text: str | bytes, where: str) -> tuple[dict[str, Any], list[str]]:
    """Return the plain data of a text in TOML or in the .ode format of XPP, and notes on how it was interpreted."""
    is_of_xpp = where.endswith(ENDING)
    try:
        if not is_of_xpp:
            return _TOML.document(text, where), []
    except SystemFileError:
        is_of_xpp = not where.endswith(".toml") and is_ode(_decode(text))
        if not is_of_xpp:
            raise
    return read_ode(_decode(text), where)


def _decode(text: str | bytes) -> str:
    return text if isinstance(text, str) else text.decode("utf-8-sig", "replace")


def _look_up_part(base: Path, key: str, name: str) -> tuple[dict[str, Any], str, Any]:
    """Look up a part of a composition: a "system" in the catalogue, or a "file" whose path is relative to `base`.

    Return three things: the document of the part; its catalogue name or its path; the function that looks up the parts
    of the part itself (None for a system of the catalogue).
    """
    if key == "system":
        generated = family_member(name)
        if generated is not None:
            return generated[1], generated[0], None
        folder = Path(__file__).parent / "catalog"
        for candidate in (folder.joinpath(f"{name}.toml"), folder.joinpath("maps", f"{name}.toml")):
            if name.isidentifier() and candidate.is_file():
                return _TOML.document(candidate.read_bytes(), name), name, None
        raise InputError(f"found the unknown system {quoted(name)}, expected a name of the catalogue")
    path = base / name
    return _parse_document(_TOML.read(path), name)[0], os.path.abspath(path), partial(_look_up_part, path.parent)


def _matrix_rows(matrix: fmpq_mat) -> list[list[str]]:
    return [[format_number(entry) for entry in row] for row in matrix.tolist()]


def match_variables(file: SystemFile, other: SystemFile) -> tuple[MapFamily, str]:
    """Return the map of `other` in the variables of `file`, and a note on their matching ("" for equal variables).

    Variables are matched by name if both maps have the same names, otherwise by position. Raises InputError if the
    dimensions differ, and for a map that is no Kahan map if its variables are those of `file` in another order.
    """
    f, g = file.map, other.map
    if f.dim != g.dim:
        raise InputError(f"{file.name} has dimension {f.dim} and {other.name} {g.dim}, expected the same dimension")
    if f.root is not None and g.root is not None and f.root != g.root:
        raise InputError(f"found a {f.root} and a {g.root}, expected the same algebraic number in both systems")
    if f.variables == g.variables:
        return g, ""
    pairing = f"{', '.join(f.variables)} with {', '.join(g.variables)}"
    if set(f.variables) == set(g.variables):
        return KahanFamily(other.system.reordered(f.variables)), f"variables are matched by name: {pairing}"
    return g, f"variables are matched by position: {pairing}"
