"""The section [composition] of a system file: maps of other files, of the catalogue and in tables, one after the other.

Parameters of the file are numbers or symbols in what the parts are given.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple, Self

from flint import fmpq

from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.algebra.written.text import format_number, parse_rational_function
from kahanmaps.documents.reader import EXPECTED, KEYS, KINDS, PartReader, json_like
from kahanmaps.errors import InputError, quoted, show
from kahanmaps.maps.implicit import BirationalMap

_MOST_FACTORS = 64  # of a composition, those of its parts counted too


Values = dict[str, RationalFunction]


class _Part(NamedTuple):
    """A map of a composition, its power, the values of its symbols, and the entry with the map as a table."""

    map: BirationalMap
    power: int
    values: Values
    plain: dict[str, Any]


class CompositionReader(PartReader, ABC):
    """A reader that knows compositions; another file knows the other sections, and what `read` makes of them all."""

    @abstractmethod
    def read(self) -> Any:
        """The contents of the document, a map among them."""

    @abstractmethod
    def read_map(self, kind: str, symbols: Sequence[str]) -> BirationalMap:
        """The map of a section with these parameters as symbols."""

    def _read_composition(self, section: Mapping[str, Any]) -> BirationalMap | None:
        """The composition; what its parts name is put in their places, so that the document says all by itself."""
        given = self._required("composition", section, "of")
        if not isinstance(given, list) or not given:
            if given is not None:
                self._mistake("composition.of", f"found {show(given)}, expected {EXPECTED['composition', 'of']}")
            return None
        parts = [self._part(f"composition.of[{k + 1}]", entry) for k, entry in enumerate(given)]
        known = [part for part in parts if part is not None]
        if len(known) < len(parts) or self.unsure:
            return None
        if sum(abs(part.power) for part in known) > _MOST_FACTORS:
            self._mistake("composition.of", f"found more than {_MOST_FACTORS} steps, expected at most so many")
            return None
        self.document = {**self.document, "composition": {"of": [part.plain for part in known]}}
        from kahanmaps.maps.composed import composed_map

        values = [part.values for part in known]
        make = partial(composed_map, variables=self.variables, symbols=self.symbols, values=values)
        return self._made("composition.of", make, *((part.map, part.power) for part in known))

    def _part(self, path: str, entry: Any) -> _Part | None:
        if not isinstance(entry, dict):
            self._mistake(path, f'found {show(entry)}, expected a table, e.g. {{ file = "f.toml", power = 2 }}')
            return None
        from kahanmaps.maps.composed import is_involution

        before = len(self.mistakes)
        for key in entry:
            if key not in KEYS["composition.of"]:
                expected = ", ".join(sorted(KEYS["composition.of"]))
                self._mistake(f"{path}.{key}", f"unknown key, expected one of {expected}")
        named = [key for key in ("file", "system", "map") if key in entry]
        if len(named) != 1:
            self._mistake(path, f"found {' and '.join(named) or 'none'} of file, system and map, expected exactly one")
            return None
        (key,) = named
        power, inverse = entry.get("power", 1), entry.get("inverse", False)
        if type(power) is not int or power == 0:
            self._mistake(f"{path}.power", f"found {show(power)}, expected an integer other than 0")
        for name in ("inverse", "involution"):
            if not isinstance(entry.get(name, False), bool):
                self._mistake(f"{path}.{name}", f"found {show(entry[name])}, expected true or false")
        numbers, values = self._part_parameters(path, entry)
        if len(self.mistakes) > before:
            return None
        try:
            reader = self._part_reader(key, entry[key], numbers, values)
            if values:
                map_ = reader.read_map(next(kind for kind in KINDS if kind in reader.document), list(values))
            else:
                map_ = reader.read().map
        except InputError as error:
            self._mistake(f"{path}.{key}", str(error))
            return None
        if entry.get("involution") and not is_involution(map_):
            self._mistake(f"{path}.involution", "found a map whose square is not the identity, expected an involution")
            return None
        plain = {name: value for name, value in entry.items() if name not in named}
        found = dict(reader.document)
        if key != "map":
            found.setdefault("parameters", {})  # so that, as a table, it knows no others
        elif "parameters" not in entry[key]:
            del found["parameters"]
        return _Part(map_, -power if inverse else power, values, {"map": json_like(found), **plain})

    def _part_parameters(self, path: str, entry: Mapping[str, Any]) -> tuple[dict[str, fmpq], Values]:
        """The values of parameters of a part: numbers, and functions of the symbols."""
        numbers: dict[str, fmpq] = {}
        values: Values = {}
        given = entry.get("parameters", {})
        if not isinstance(given, dict):
            self._mistake(f"{path}.parameters", f"found {show(given)}, expected a table of numbers")
            return numbers, values
        table = entry.get("map")
        if isinstance(table, dict) and "parameters" not in table:  # it knows those around it
            context = ring(self.symbols)
            for name, symbol in zip(self.symbols, context.gens(), strict=True):
                values[name] = RationalFunction(symbol, context.constant(1))
        for name, value in given.items():
            text = self._text(f"{path}.parameters.{name}", value)
            if text is None:
                continue
            place = f"{path}.parameters.{name}"
            function = self._made(place, parse_rational_function, text, self.symbols, self.parameters)
            if function is None:
                continue
            values.pop(name, None)
            above, below = function.numerator, function.denominator
            if above.is_constant() and below.is_constant():
                numbers[name] = above.leading_coefficient() / below.leading_coefficient() if above else fmpq(0)
            else:
                values[name] = function
        return numbers, values

    def _part_reader(self, key: str, value: Any, numbers: Mapping[str, fmpq], values: Values) -> Self:
        """What reads a part of a composition."""
        self.parts[0] += 1
        if self.parts[0] > _MOST_FACTORS:
            raise InputError(f"found more than {_MOST_FACTORS} maps in one composition, expected at most so many")
        name, place, other = "map", "", self.other
        if key == "map":
            if not isinstance(value, dict):
                raise InputError(f"found {show(value)}, expected a table like a system file")
            # A table without parameters of its own knows those of the file that it stands in.
            outer = {name: format_number(number) for name, number in self.parameters.items()}
            document = {"parameters": {**outer, **dict.fromkeys(self.symbols, 1)}, **value}
        elif not isinstance(value, str):
            raise InputError(f"found {show(value)}, expected a name in quotes")
        elif self.other is None:
            raise InputError(f"found {quoted(value)}, expected map = {{ ... }}: files are not looked up here")
        else:
            name = value
            document, place, other = self.other(key, value)
            if key == "file" and place in self.inside:
                raise InputError(f"found {quoted(name)} as a part of itself")
        document = {part: data for part, data in document.items() if part not in ("catalog", "integrals", "density")}
        reader = type(self)(document, name, numbers, other)
        reader.inside, reader.parts = (*self.inside, place), self.parts
        return reader
