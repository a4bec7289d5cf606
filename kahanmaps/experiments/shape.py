"""The shape of a spec, checked by pydantic: which keys there are and what kind of value each has.

What the values mean depends on the task and is not checked here. Whoever reads the meaning of a part asks the document
for it, and tells it what is wrong.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, WithJsonSchema

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


def _amount(units: Mapping[str, int]) -> WithJsonSchema:
    """How a schema says what `_with_unit` reads."""
    number = r"\s*[0-9]{1,18}(\.[0-9]{1,9})?([eE][+-]?[0-9]{1,2})?\s*"
    text = {"type": "string", "pattern": f"^({number}({'|'.join(units)})?\\s*|{_NONE})$"}
    return WithJsonSchema({"anyOf": [{"type": "number", "exclusiveMinimum": 0}, text]})


_TEXT = {"type": "string", "minLength": 1}
_SYSTEM_SCHEMA = WithJsonSchema({"anyOf": [_TEXT, {"type": "array", "items": _TEXT, "minItems": 1}]})


class _Shape(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class _LimitsShape(_Shape):
    time: Annotated[Any, BeforeValidator(read_time), _amount(_TIME_UNITS)] = Field(
        default=None, description="seconds, or a text like 90 s"
    )
    memory: Annotated[Any, BeforeValidator(read_memory), _amount(_MEMORY_UNITS)] = Field(
        default=None, description="bytes, or a text like 2 GB"
    )
    digits: int | None = Field(default=None, ge=1, le=2**63 - 1, description="a whole number of digits, at least 1")


class _ExperimentShape(_Shape):
    task: str = Field(description="the name of a task, e.g. check-commute")
    system: Annotated[Any, BeforeValidator(_read_system), _SYSTEM_SCHEMA] = Field(default=None, description=_SYSTEM)
    options: dict[str, Any] = Field(default={}, description="a table of options with their values")
    axes: dict[str, Any] = Field(default={}, description="a table of options with lists or ranges of values")
    zip: list[list[str]] = Field(default=[], description='a list of lists of axes, e.g. [["m", "steps"]]')
    limits: _LimitsShape | None = Field(default=None, description="a table with time, memory, digits")


class _SpecShape(_Shape):
    name: str = Field(default="", description="text")
    limits: _LimitsShape | None = Field(default=None, description="a table with time, memory, digits")
    experiments: dict[str, _ExperimentShape] = Field(min_length=1, description="at least one table [experiments.NAME]")


def shape_mistakes(document: Mapping[str, Any]) -> list[tuple[Place, str, str]]:
    """What is wrong with the shape: where, the key as people write it, and a sentence.

    >>> shape_mistakes({"experiments": {"a": {"task": 1}}})
    [(('experiments', 'a', 'task'), 'experiments.a.task', 'found 1, expected the name of a task, e.g. check-commute')]
    """
    try:
        _SpecShape.model_validate(document)
    except ValidationError as error:
        return [_mistake(detail) for detail in error.errors(include_url=False)]
    return []


_OF_SYSTEM_FILES = (("system",), ("hamiltonian",), ("family",), ("variables",))


def shape_schema() -> dict[str, Any]:
    """The shape as a JSON schema, with the parts `_ExperimentShape` and `_LimitsShape`."""
    return _SpecShape.model_json_schema()


def _mistake(detail: Any) -> tuple[Place, str, str]:
    place: Place = detail["loc"]
    shape, name = _field(place)
    field = shape.model_fields.get(name)
    expected = f"expected {field.description if field and field.description else 'a table'}"
    if detail["type"] == "extra_forbidden":
        known = list(shape.model_fields)
        hint = " (a system file is for the other commands)" if place in _OF_SYSTEM_FILES else suggestion(name, known)
        sentence = f"unknown key, expected one of {', '.join(known)}{hint}"
    elif detail["type"] == "missing":
        sentence = f"missing, {expected}"
    elif detail["type"] == "value_error":  # ours, a sentence already
        sentence = str(detail["ctx"]["error"])
    else:
        sentence = f"found {show(detail['input'])}, {expected}"
    return place, key_of(place), sentence


def _field(place: Place) -> tuple[type[BaseModel], str]:
    """The shape that a place belongs to, and the name of its field."""
    keys = [str(part) for part in place]
    shape: type[BaseModel] = _SpecShape
    if keys[0] == "experiments" and len(keys) > 1:
        shape, keys = (_ExperimentShape, keys[2:]) if len(keys) > 2 else (shape, [""])
    return (_LimitsShape, keys[1]) if keys[0] == "limits" and len(keys) > 1 else (shape, keys[0])


def key_of(place: Place) -> str:
    """A place as people write it, lists counted from 1: experiments.a.zip[1]."""
    return "".join(f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in place).removeprefix(".")


class SpecDocument:
    """A whole spec; paths of systems in it are relative to `folder`.

    `mistakes` are pairs of key and sentence, those of the shape first. `documents` are of the systems found on the way.
    """

    def __init__(self, document: Mapping[str, Any], folder: Path) -> None:
        self.document = document
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
