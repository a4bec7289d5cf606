"""The shape of a spec, which spec.schema.json describes: which keys there are and what kind of value each has.

What the values mean depends on the task and is not checked here. Whoever reads the meaning of a part asks the document
for it, and tells it what is wrong.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

from kahanmaps.errors import show, suggestion

_TIME_UNITS = {"s": 1, "min": 60, "h": 3600, "d": 86400}
_MEMORY_UNITS = {"kB": 10**3, "MB": 10**6, "GB": 10**9, "TB": 10**12, "KiB": 2**10, "MiB": 2**20, "GiB": 2**30}
_MOST_SECONDS, _MOST_BYTES = 10**9, 10**18  # what system calls take
_NONE = "none"
_SYSTEM = '"family", a name of the catalogue, a path, or a list of these'

Place = tuple[str | int, ...]


def read_time(value: Any) -> float | None:
    """Seconds, from a number or a text such as "90 s", "5 min", "2 h"; "none" for no limit.

    >>> read_time("1.5 min"), read_time("none")
    (90.0, None)
    """
    expected = "seconds, or a text like 90 s, 5 min, 2 h, none"
    found = _with_unit(value, _TIME_UNITS, expected, Fraction(1, 1000), _MOST_SECONDS)
    return None if found is None else float(found)


def read_memory(value: Any) -> int | None:
    """Bytes, from a number or a text such as "500 MB", "2 GiB"; "none" for no limit.

    >>> read_memory("1.5 GB")
    1500000000
    """
    expected = "bytes, or a text like 500 MB, 2 GB, 1 GiB, none"
    found = _with_unit(value, _MEMORY_UNITS, expected, Fraction(1), _MOST_BYTES)
    return None if found is None else int(found)


def _with_unit(value: Any, units: Mapping[str, int], expected: str, least: Fraction, most: int) -> Fraction | None:
    if value == _NONE:
        return None
    text = value if isinstance(value, str) else show(value)
    found = re.fullmatch(r"\s*([0-9]{1,18}(?:\.[0-9]{1,9})?(?:[eE][+-]?[0-9]{1,2})?)\s*([A-Za-z]*)\s*", text)
    if found is None or (found[2] and found[2] not in units):
        raise ValueError(f"found {show(value)}, expected {expected}")
    amount = Fraction(found[1]) * units.get(found[2], 1)
    if not least <= amount <= most:
        unit = "s" if units is _TIME_UNITS else "bytes"
        raise ValueError(f"found {show(value)}, expected {float(least):g} to {float(most):g} {unit}, or none")
    return amount


def _read_system(value: Any) -> Any:
    names = value if isinstance(value, list) else [value]
    if not all(isinstance(name, str) and name for name in names):
        raise ValueError(f"found {show(value)}, expected {_SYSTEM}")
    return value


# What has more than a type, by its format in the schema; each raises ValueError with a sentence.
_READERS: Mapping[str, Callable[[Any], Any]] = {
    "systems": _read_system,
    "time-limit": read_time,
    "memory-limit": read_memory,
}
_TYPES: Mapping[str, type] = {"string": str, "integer": int, "array": list, "object": dict}
_OF_SYSTEM_FILES = (("system",), ("hamiltonian",), ("family",), ("variables",))


def shape_schema() -> dict[str, Any]:
    """The shape of a spec as a JSON schema, which is what a spec is checked against."""
    found: dict[str, Any] = json.loads(Path(__file__).with_name("spec.schema.json").read_text(encoding="ascii"))
    return found


def shape_mistakes(document: Mapping[str, Any]) -> list[tuple[Place, str, str]]:
    """What is wrong with the shape: where, the key as people write it, and a sentence.

    >>> shape_mistakes({"experiments": {"a": {"task": 1}}})
    [(('experiments', 'a', 'task'), 'experiments.a.task', 'found 1, expected the name of a task, e.g. check-commute')]
    """
    schema = shape_schema()
    found = _mistakes(document, schema, (), schema["$defs"], "")
    return [(place, key_of(place), sentence) for place, sentence in found]


def _mistakes(
    value: Any, shape: Mapping[str, Any], place: Place, shared: Mapping[str, Any], expected: str
) -> Iterator[tuple[Place, str]]:
    """The places in a value that are not as a part of the schema says, and what is wrong there."""
    shape = shared.get(shape.get("$ref", "").rpartition("/")[2], shape)
    expected = shape.get("description", expected)
    if reader := _READERS.get(shape.get("format", "")):
        try:
            reader(value)
        except ValueError as error:
            yield place, str(error)
        return
    is_right = isinstance(value, _TYPES[shape["type"]]) and not isinstance(value, bool)
    if is_right and isinstance(value, int):
        is_right = shape["minimum"] <= value <= shape["maximum"]
    if not is_right or (isinstance(value, dict) and len(value) < shape.get("minProperties", 0)):
        yield place, f"found {show(value)}, expected {expected}"
    elif isinstance(value, list):
        for k, item in enumerate(value):
            yield from _mistakes(item, shape["items"], (*place, k), shared, expected)
    elif isinstance(value, dict):
        yield from _mistakes_of_table(value, shape, place, shared)


def _mistakes_of_table(
    table: Mapping[str, Any], shape: Mapping[str, Any], place: Place, shared: Mapping[str, Any]
) -> Iterator[tuple[Place, str]]:
    known, others = shape.get("properties", {}), shape.get("additionalProperties", True)
    for name, part in known.items():
        if name in table:
            yield from _mistakes(table[name], part, (*place, name), shared, "")
        elif name in shape.get("required", ()):
            yield (*place, name), f"missing, expected {part['description']}"
    for name in (name for name in table if name not in known):
        here = (*place, name)
        if isinstance(others, dict):
            yield from _mistakes(table[name], others, here, shared, "")
        elif not others:
            hint = (
                " (a system file is for the other commands)"
                if here in _OF_SYSTEM_FILES
                else suggestion(name, list(known))
            )
            yield here, f"unknown key, expected one of {', '.join(known)}{hint}"


def key_of(place: Place) -> str:
    """A place as people write it, lists counted from 1: experiments.a.zip[1]."""
    return "".join(f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in place).removeprefix(".")


class SpecDocument:
    """A whole spec; paths of systems in it are relative to `folder`.

    `mistakes` are pairs of key and sentence, those of the shape first. `documents` are of the systems found on the way.
    With `skip_bad` systems that cannot be read are left out of all experiments, as with on_error = "skip".
    """

    def __init__(self, document: Mapping[str, Any], folder: Path, skip_bad: bool = False) -> None:
        self.document = document
        self.skip_bad = skip_bad
        self.folder = folder
        self.mistakes: list[tuple[str, str]] = []
        self.documents: dict[str, str] = {}
        self._misshapen: list[Place] = []
        for path, key, sentence in shape_mistakes(document):
            self._misshapen.append(path)
            self.mistake(key, sentence)

    def mistake(self, key: str, sentence: str) -> None:
        """Tell that something is wrong."""
        # Keys and words come from the file: nothing in them may reach a terminal as an escape sequence.
        printable = ["".join(c if c.isprintable() or c == "\n" else "_" for c in text) for text in (key, sentence)]
        self.mistakes.append((printable[0].replace("\n", "_")[:120], printable[1]))

    def sound(self, *path: str | int) -> Any:
        """The value at a place, None where it is missing or has not the right shape."""
        if any(bad == path[: len(bad)] for bad in self._misshapen):
            return None
        value: Any = self.document
        for key in path:
            if isinstance(value, dict) and key not in value:
                return None
            value = value[key]
        return value
