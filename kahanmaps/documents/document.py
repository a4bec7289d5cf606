"""Conversion of a document (the plain data of a system file) to the map, member and claims that it describes.

Every part is read as far as possible, so that all mistakes in a document are reported together, each with its key.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Self

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.fields import rational
from kahanmaps.algebra.parsing import check_names, parse_polynomial, parse_rational_function
from kahanmaps.algebra.polynomials import RationalFunction, names_of, ring, substitute
from kahanmaps.algebra.printing import format_number
from kahanmaps.algebra.roots import Root, parse_root
from kahanmaps.documents.equations import without_left_sides
from kahanmaps.documents.expressions import number
from kahanmaps.documents.iterates import iterates_in
from kahanmaps.documents.reader import EXPECTED, KEYS, KINDS, PartReader, json_like
from kahanmaps.documents.structured_facts import read_structured_facts
from kahanmaps.errors import InputError, SystemFileError, quoted, show, suggestion
from kahanmaps.maps.algebraic import AlgebraicMap
from kahanmaps.maps.bilinear import bilinear_map
from kahanmaps.maps.composed import composed_map, is_involution
from kahanmaps.maps.explicit import explicit_map
from kahanmaps.maps.implicit import ImplicitMap, MapFamily, why_no_map
from kahanmaps.maps.kahan import KahanFamily
from kahanmaps.maps.polarised import MAX_DEGREE, polarised_map
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import MAX_DIMENSION, QuadraticSystem

if TYPE_CHECKING:
    from kahanmaps.family.associated import FamilyMember

_MAX_NAME = 1000  # maximal number of characters of the name of a system
_MAX_FACTORS = 64  # maximal number of maps in a composition, including the maps of its parts
_STAND_IN = fmpq(1000003, 7)  # replaces an algebraic number where a rational one reveals the same mistakes


def _kahan(rhs: Sequence[fmpq_mpoly], degree: int) -> KahanFamily:
    """Return the Kahan map of right-hand sides in variables, symbols and eps; with eps it is an adjusted map."""
    symbols = names_of(rhs[0])[len(rhs) :]
    if any("eps" not in polynomial.unused_gens() for polynomial in rhs):
        return KahanFamily(QuadraticSystem(tuple(rhs), symbols))
    return KahanFamily(QuadraticSystem(tuple(substitute(p, {"eps": fmpq(1)}) for p in rhs), symbols[:-1]))


# Method -> (constructor, default degree, maximal degree). The constructor makes a map from the right-hand sides, which
# are polynomials in the variables, the symbols and eps, and from their degree.
_DISCRETIZATIONS: dict[str, tuple[Callable[[Sequence[fmpq_mpoly], int], MapFamily], int, int]] = {
    "kahan": (_kahan, 2, 2),
    "polarised": (polarised_map, 3, MAX_DEGREE),
}


Values = dict[str, RationalFunction]


def _map_at(reader: DocumentReader, parameter: str, value: fmpq) -> MapFamily:
    """Return the map in the document of a reader, with a rational approximation in place of an algebraic number."""
    overrides = {**reader.overrides, parameter: value}
    parsed_map: MapFamily = DocumentReader(reader.document, reader.where, overrides, reader.look_up).read()["map"]
    return parsed_map


class _Part(NamedTuple):
    """A part of a composition: its map, the exponent, functions for the symbols of the map, and its table in TOML."""

    map: MapFamily
    power: int
    values: Values
    table: dict[str, Any]


class DocumentReader(PartReader):
    """Read a document and collect its mistakes. Each reader is used once."""

    def read(self) -> dict[str, Any]:
        """Return a dict of the fields of a `SystemFile`. Raises SystemFileError with all mistakes of the document."""
        try:
            self.document, notes = without_left_sides(self.document)
        except InputError as error:
            raise SystemFileError(self.where, [("system.rhs", str(error))]) from error
        self._report_unknown_keys("", self.document)
        kinds = [kind for kind in KINDS if kind in self.document]
        if len(kinds) != 1:
            sections = ", ".join(f"[{kind}]" for kind in kinds) or "none"
            self._report(
                "file",
                f"found {sections} of the sections {', '.join(f'[{kind}]' for kind in KINDS)}, expected exactly one",
            )
        self._read_parameters()
        stem = Path(self.where).stem if self.where.endswith((".toml", ".ode")) else self.where
        name = self.document.get("name", "".join(c if c.isprintable() else "_" for c in stem))
        if not isinstance(name, str) or not name.isprintable() or len(name) > _MAX_NAME:
            # The name is in the first line of many outputs, so it must not contain line ends or escape sequences.
            self._report(
                "name", f"found {show(name)}, expected printable text on one line, at most {_MAX_NAME} characters"
            )
        kind = kinds[0] if len(kinds) == 1 else ""
        self._read_variables(kind)
        map_, hamiltonian, member = self._read_section(kind, self._read_table(kind) if kind else None)
        claims = {}
        for name_of_claim, value in (self._read_table("integrals") or {}).items():
            if not name_of_claim.isprintable():
                self._report(f"integrals.{quoted(name_of_claim)}", "expected a printable name")
            elif (claim := self._read_claim(f"integrals.{name_of_claim}", value)) is not None:
                claims[name_of_claim] = claim
        in_iterates = {name: function for name, function in claims.items() if iterates_in(*function.names)}
        integrals = {name: function for name, function in claims.items() if name not in in_iterates}
        density, section = None, self._read_table("density") if "density" in self.document else None
        if section is not None:
            self._report_unknown_keys("density", section)
            value = self._require("density", section, "phi")
            density = self._read_claim("density.phi", value) if value is not None else None
            if density is not None and density.numerator.is_zero() and not self.has_bad_parameter:
                self._report("density.phi", "found 0, expected a function that is not zero: the measure is dx/phi")
        if catalog := self._read_table("catalog"):
            self._report_unknown_keys("catalog", catalog)
            read_structured_facts(catalog, self.variables, self._report)
        if self.mistakes or map_ is None:
            raise SystemFileError(self.where, self.mistakes)
        # The document contains the name and the current values of parameters; long integers are text, as JSON requires.
        document = {key: json_like(value) for key, value in self.document.items() if key not in ("name", "parameters")}
        document = {"name": name, **document}
        if self.parameters:
            document["parameters"] = {key: format_number(value) for key, value in self.parameters.items()}
        if self.root is not None:
            document.setdefault("parameters", {})[self.root[0]] = str(self.root[1])
        return {
            "name": name,
            "kind": kind,
            "parameters": self.parameters,
            "map": map_,
            "hamiltonian": hamiltonian,
            "member": member,
            "integrals": integrals,
            "density": density,
            "document": document,
            "notes": tuple(notes),
            "integrals_in_iterates": in_iterates,
        }

    def _read_section(
        self, kind: str, section: Mapping[str, Any] | None
    ) -> tuple[MapFamily | None, CubicHamiltonian | None, FamilyMember | None]:
        """Return (map, Hamiltonian, member) of the section [kind]; each is None if it is absent or invalid."""
        if section is None:
            return None, None, None
        map_, hamiltonian, member = None, None, None
        self._report_unknown_keys(kind, section)
        if self.root is not None and kind in ("family", "composition"):
            self._report(
                f"parameters.{self.root[0]}", f"found an algebraic number in a [{kind}], expected rational ones"
            )
        elif self.root is not None and kind == "hamiltonian":
            self.parameters[self.root[0]] = _STAND_IN
            is_valid = self._read_hamiltonian(section) is not None
            del self.parameters[self.root[0]]
            map_ = self._read_symbolic_field(section) if is_valid else None
        elif kind == "hamiltonian":
            hamiltonian = self._read_hamiltonian(section)
        elif kind == "family":
            member = self._read_member(section)
            hamiltonian = member.chosen.hamiltonian if member else None
        else:
            map_ = self._read_map_of_kind(kind, section)
        if hamiltonian is not None:
            map_ = KahanFamily(hamiltonian.system)
        elif map_ is not None:
            if self.root is not None:
                parameter, root = self.root
                map_ = AlgebraicMap(map_, root, partial(_map_at, self, parameter))
            self.variables = map_.variables  # a polarised map has more variables than the system in the file
            for name in set(self.variables) & set(self.parameters):
                self._report(f"parameters.{name}", "is a variable of the map as well, expected distinct names")
        return map_, hamiltonian, member

    def read_map(self, kind: str, symbols: Sequence[str]) -> MapFamily:
        """Return the map of the document; the parameters `symbols` remain symbols. Raises InputError for a [family]."""
        if kind == "family":
            raise InputError(
                f"found the symbols {', '.join(symbols)} in a [family] file, expected numbers: "
                "write the system as [hamiltonian]"
            )
        self._read_parameters()
        self._read_variables(kind)
        self.symbols = tuple(symbols)
        self.parameters = {name: value for name, value in self.parameters.items() if name not in symbols}
        section = self.document[kind]
        map_ = self._read_symbolic_field(section) if kind == "hamiltonian" else self._read_map_of_kind(kind, section)
        if map_ is None or self.mistakes:
            raise SystemFileError(f"{self.where} with {', '.join(symbols)} as symbols", self.mistakes)
        return map_

    def _read_map_of_kind(self, kind: str, section: Mapping[str, Any]) -> MapFamily | None:
        readers = {"system": self._read_system, "composition": self._read_composition, "bilinear": self._read_bilinear}
        return readers.get(kind, self._read_map)(section)

    def _read_parameters(self) -> None:
        for name, value in (self._read_table("parameters") or {}).items():
            path = f"parameters.{name}"
            if name == "eps":
                self._report(
                    path, "eps is half the time step of the map and cannot be a parameter: rename it, to epsilon, say"
                )
                continue
            try:
                check_names([name])
            except InputError as error:
                self._report(path, str(error))
                continue
            raw_value = self.overrides.get(name, value)
            try:
                raw_value = number(raw_value)
                root = parse_root(raw_value) if isinstance(raw_value, str) else raw_value
                if isinstance(root, Root):
                    if self.root is not None:
                        raise InputError("found a second algebraic parameter, expected at most one")
                    if root.degree == 1:
                        self.parameters[name] = -root.polynomial[0]
                    else:
                        self.root = name, root
                    continue
                if isinstance(raw_value, list | dict):
                    raise InputError(f"found {show(raw_value)}, expected a number")
                self.parameters[name] = rational(raw_value)
            except InputError as error:
                example = "\nan algebraic number is written: root of t^2 - 2"
                hint = example if isinstance(raw_value, str) and "sqrt" in raw_value else ""
                self._report(path, f"{error}{hint}")
                self.parameters[name] = fmpq(1)  # any value, so that no use of the parameter is reported as a mistake
                self.has_bad_parameter = True
        if self.root is not None:
            self.symbols = (self.root[0],)
        declared = self.document.get("parameters", {})
        for name in self.overrides:
            if not isinstance(declared, dict) or name not in declared:
                known_names = ", ".join(self.parameters) or "none"
                hint = suggestion(name, list(self.parameters))
                self._report("parameters", f"unknown parameter {quoted(name)}, this system has: {known_names}{hint}")

    def _read_variables(self, kind: str) -> None:
        names = self.document.get("variables")
        if names is None:
            if kind == "family":
                A = (self._read_table("family") or {}).get("A")
                if isinstance(A, list) and 0 < len(A) <= MAX_DIMENSION:
                    from kahanmaps.family.cubics import default_variables

                    self.variables = default_variables(len(A))
            elif kind != "composition":  # a composition has the variables of its first map
                self._report("variables", 'missing, expected a list of names, e.g. ["x", "y"]')
            return
        if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
            self._report("variables", f'found {show(names)}, expected a list of names, e.g. ["x", "y"]')
            return
        if len(names) > MAX_DIMENSION:
            self._report("variables", f"found {len(names)} variables, expected at most {MAX_DIMENSION}")
            return
        try:
            check_names(names)
        except InputError as error:
            self._report("variables", str(error))
            return
        shared_names = [name for name in names if name in self.parameters]
        if "eps" in names:
            self._report(
                "variables", "eps is half the time step of the map and cannot be a variable: rename it, to epsilon, say"
            )
        elif shared_names:
            self._report("variables", f"{quoted(shared_names[0])} is a parameter as well, expected distinct names")
        else:
            self.variables = tuple(names)

    def _read_system(self, section: Mapping[str, Any]) -> MapFamily | None:
        method = section.get("discretization", "kahan")
        method = "polarised" if method == "polarized" else method
        if method not in _DISCRETIZATIONS:
            allowed = ", ".join(f'"{name}"' for name in _DISCRETIZATIONS)
            return self._refuse("system.discretization", f"found {show(method)}, expected one of {allowed}")
        make_map, default_degree, max_degree = _DISCRETIZATIONS[method]
        degree = section.get("degree", default_degree)
        if type(degree) is not int or not 2 <= degree <= max_degree:
            return self._refuse("system.degree", f"found {show(degree)}, expected a number from 2 to {max_degree}")
        formulas = self._require("system", section, "rhs")
        polynomials = self._read_each("system.rhs", formulas, partial(self._read_polynomial, max_degree=degree))
        texts = self._read_list("system", "rhs", formulas, "right-hand side")
        if texts is None or polynomials is None or self.variables is None or self.has_bad_parameter:
            return None
        return self._try_make("system.rhs", make_map, polynomials, degree)

    def _read_bilinear(self, section: Mapping[str, Any]) -> MapFamily | None:
        new_names = section.get("new", [name.upper() for name in self.variables or ()])
        new_names = self._read_list("bilinear", "new", new_names, "name")
        formulas = self._read_list("bilinear", "equations", self._require("bilinear", section, "equations"), "equation")
        if new_names is None or formulas is None or self.variables is None:
            return None
        try:
            check_names(new_names)
            check_names((*self.variables, *new_names, *self.parameters, *self.symbols, "eps"))
        except InputError as error:
            hint = "" if "new" in section else ': give new = ["..."], names for the coordinates of the new point'
            return self._refuse("bilinear.new", f"{error}{hint}")

        def equation(path: str, value: Any) -> fmpq_mpoly | None:
            sides = (self._read_text(path, value) or "").split("=")
            if len(sides) != 2:
                return self._refuse(path, f'found {show(value)}, expected LEFT = RIGHT, e.g. "X - x = 2*eps*x*X"')
            old_side, new_side = (self._read_polynomial(path, side, 1, new_names) for side in sides)
            return None if old_side is None or new_side is None else old_side - new_side

        polynomials = self._read_each("bilinear.equations", formulas, equation)
        if polynomials is None or self.has_bad_parameter:
            return None
        return self._make_checked_map(bilinear_map, "bilinear", self.variables, polynomials)

    def _read_map(self, section: Mapping[str, Any]) -> MapFamily | None:
        self._require("map", section, "image")
        texts = {key: self._read_list("map", key, section.get(key), "function") for key in ("image", "inverse")}
        image, inverse = (self._read_each(f"map.{key}", texts[key], self._read_claim) or None for key in texts)
        if image is None or self.variables is None or self.has_bad_parameter:
            return None
        if "inverse" in section and inverse is None:
            return None
        return self._make_checked_map(explicit_map, "map", self.variables, image, inverse)

    def _make_checked_map(self, make: Callable[..., ImplicitMap], path: str, *arguments: Any) -> ImplicitMap | None:
        """Return the map that `make` constructs; if it is not dominant, or its inverse is wrong, note a mistake."""
        map_ = self._try_make(path, make, *arguments)
        if map_ is None:
            return None
        if reason := why_no_map(map_, None if self.root is None else self.root[1]):
            return self._refuse(path, reason)
        return map_

    def _read_hamiltonian(self, section: Mapping[str, Any]) -> CubicHamiltonian | None:
        value = self._require("hamiltonian", section, "H")
        H = self._read_polynomial("hamiltonian.H", value, 3, of_map=False) if value is not None else None
        matrix = self._require("hamiltonian", section, "J")
        if matrix is None:
            return None
        n = len(self.variables) if self.variables is not None else None
        J: fmpq_mat | None = None
        if matrix == "standard":
            J = None if n is None else self._try_make("hamiltonian.J", standard_structure, n)
        elif isinstance(matrix, str):
            self._report("hamiltonian.J", f'found {show(matrix)}, expected "standard" or a skew matrix')
        else:
            J = self._read_matrix("hamiltonian.J", matrix, n)
        if J is None or self.variables is None or self.has_bad_parameter:
            return None
        zero = parse_polynomial("0", self.variables)
        hamiltonian = self._try_make("hamiltonian.J", CubicHamiltonian, zero if H is None else H, J)
        return None if H is None else hamiltonian

    def _read_symbolic_field(self, section: Mapping[str, Any]) -> MapFamily | None:
        """Return the Kahan map of f = J grad H; J and H may contain symbols. After a mistake, return None."""
        H, n = self._read_polynomial("hamiltonian.H", section["H"], 3), len(self.variables or ())
        matrix = standard_structure(n).tolist() if section["J"] == "standard" else section["J"]
        J = [
            [self._read_polynomial(f"hamiltonian.J[{i + 1}][{j + 1}]", str(e), 0) for j, e in enumerate(row)]
            for i, row in enumerate(matrix)
        ]
        if H is None or self.mistakes:
            return None
        rhs = []
        for row in J:
            products = (entry * H.derivative(k) for k, entry in enumerate(row) if entry is not None)
            rhs.append(sum(products, H * 0))
        return _kahan(rhs, 2)

    def _read_member(self, section: Mapping[str, Any]) -> FamilyMember | None:
        matrix, value = self._require("family", section, "A"), self._require("family", section, "H")
        size = len(self.variables) if self.variables is not None else None
        A = self._read_matrix("family.A", matrix, size) if matrix is not None else None
        H = self._read_polynomial("family.H", value, 3, of_map=False) if value is not None else None
        signs = section.get("signs", [])
        has_valid_signs = isinstance(signs, list) and all(type(sign) is int and sign in (1, -1) for sign in signs)
        if not has_valid_signs:
            self._report("family.signs", f"found {show(signs)}, expected a list of 1 and -1")
        if A is None or H is None or self.has_bad_parameter:
            return None
        try:
            from kahanmaps.family.associated import FamilyMember

            return FamilyMember(A, H, tuple(signs) if has_valid_signs else ())
        except InputError as error:
            message = str(error)
            key = "A" if message.startswith("A is") else "signs" if "signs" in message.split(",")[0] else "H"
            return self._refuse(f"family.{key}", message)

    # ---- [composition]: maps given by a file, by a catalogue name or in a table ------------------------------------

    def _read_composition(self, section: Mapping[str, Any]) -> MapFamily | None:
        """Read a composition. In the document, the parts given by file or name are replaced by their content."""
        entries = self._require("composition", section, "of")
        if not isinstance(entries, list) or not entries:
            if entries is not None:
                self._report("composition.of", f"found {show(entries)}, expected {EXPECTED['composition', 'of']}")
            return None
        factors = self._read_each("composition.of", entries, self._read_part)
        if factors is None or self.has_bad_parameter:
            return None
        if sum(abs(factor.power) for factor in factors) > _MAX_FACTORS:
            return self._refuse(
                "composition.of", f"found more than {_MAX_FACTORS} steps, expected at most {_MAX_FACTORS}"
            )
        self.document = {**self.document, "composition": {"of": [factor.table for factor in factors]}}
        values = [factor.values for factor in factors]
        make_map = partial(composed_map, variables=self.variables, symbols=self.symbols, values=values)
        return self._try_make("composition.of", make_map, *((factor.map, factor.power) for factor in factors))

    def _read_part(self, path: str, entry: Any) -> _Part | None:
        if not isinstance(entry, dict):
            return self._refuse(path, f'found {show(entry)}, expected a table, e.g. {{ file = "f.toml", power = 2 }}')
        mistakes_before = len(self.mistakes)
        for key in entry:
            if key not in KEYS["composition.of"]:
                expected = ", ".join(sorted(KEYS["composition.of"]))
                self._report(f"{path}.{key}", f"unknown key, expected one of {expected}")
        sources = [key for key in ("file", "system", "map") if key in entry]
        if len(sources) != 1:
            return self._refuse(
                path, f"found {' and '.join(sources) or 'none'} of file, system and map, expected exactly one"
            )
        (key,) = sources
        power, inverse = entry.get("power", 1), entry.get("inverse", False)
        if type(power) is not int or power == 0:
            self._report(f"{path}.power", f"found {show(power)}, expected an integer other than 0")
        for name in ("inverse", "involution"):
            if not isinstance(entry.get(name, False), bool):
                self._report(f"{path}.{name}", f"found {show(entry[name])}, expected true or false")
        numbers, values = self._read_part_parameters(path, entry)
        if len(self.mistakes) > mistakes_before:
            return None
        try:
            reader = self._make_part_reader(key, entry[key], numbers, values)
            if values:
                map_ = reader.read_map(next(kind for kind in KINDS if kind in reader.document), list(values))
            else:
                map_ = reader.read()["map"]
        except InputError as error:
            return self._refuse(f"{path}.{key}", str(error))
        if entry.get("involution") and not is_involution(map_):
            return self._refuse(
                f"{path}.involution", "found a map whose square is not the identity, expected an involution"
            )
        other_entries = {name: value for name, value in entry.items() if name not in sources}
        document = dict(reader.document)
        if key != "map":
            document.setdefault("parameters", {})  # an inline table has only its own parameters
        elif "parameters" not in entry[key]:
            del document["parameters"]
        return _Part(map_, -power if inverse else power, values, {"map": json_like(document), **other_entries})

    def _read_part_parameters(self, path: str, entry: Mapping[str, Any]) -> tuple[dict[str, fmpq], Values]:
        """Return the values that a composition assigns to the parameters of one of its maps, as two dicts.

        The first dict contains those values that are rational numbers, the second one those that depend on symbols.
        """
        numbers: dict[str, fmpq] = {}
        values: Values = {}
        parameters = entry.get("parameters", {})
        if not isinstance(parameters, dict):
            self._report(f"{path}.parameters", f"found {show(parameters)}, expected a table of numbers")
            return numbers, values
        table = entry.get("map")
        if isinstance(table, dict) and "parameters" not in table:  # the map can use the outer parameters
            context = ring(self.symbols)
            for name, symbol in zip(self.symbols, context.gens(), strict=True):
                values[name] = RationalFunction(symbol, context.constant(1))
        for name, value in parameters.items():
            text = self._read_text(f"{path}.parameters.{name}", value)
            if text is None:
                continue
            entry_path = f"{path}.parameters.{name}"
            function = self._try_make(entry_path, parse_rational_function, text, self.symbols, self.parameters)
            if function is None:
                continue
            values.pop(name, None)
            numerator, denominator = function.numerator, function.denominator
            if numerator.is_constant() and denominator.is_constant():
                numbers[name] = (
                    numerator.leading_coefficient() / denominator.leading_coefficient() if numerator else fmpq(0)
                )
            else:
                values[name] = function
        return numbers, values

    def _make_part_reader(self, key: str, value: Any, numbers: Mapping[str, fmpq], values: Values) -> Self:
        """Return the reader of a part of a composition: `key` says how `value` describes the part."""
        self.part_count[0] += 1
        if self.part_count[0] > _MAX_FACTORS:
            raise InputError(f"found more than {_MAX_FACTORS} maps in one composition, expected at most {_MAX_FACTORS}")
        name, name_or_path, look_up = "map", "", self.look_up
        if key == "map":
            if not isinstance(value, dict):
                raise InputError(f"found {show(value)}, expected a table like a system file")
            # A table without parameters has the parameters of the file that contains the table.
            outer_parameters = {name: format_number(number) for name, number in self.parameters.items()}
            document = {"parameters": {**outer_parameters, **dict.fromkeys(self.symbols, 1)}, **value}
        elif not isinstance(value, str):
            raise InputError(f"found {show(value)}, expected a name in quotes")
        elif self.look_up is None:
            raise InputError(f"found {quoted(value)}, expected map = {{ ... }}: files are not looked up here")
        else:
            name = value
            document, name_or_path, look_up = self.look_up(key, value)
            if key == "file" and name_or_path in self.enclosing:
                raise InputError(f"found {quoted(name)} as a part of itself")
        document = {part: data for part, data in document.items() if part not in ("catalog", "integrals", "density")}
        reader = type(self)(document, name, numbers, look_up)
        reader.enclosing, reader.part_count = (*self.enclosing, name_or_path), self.part_count
        return reader
