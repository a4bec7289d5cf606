"""The shape of a spec: which keys there are and what kind of value each has.

What the values mean depends on the task and is not checked here. Whoever reads the meaning of a part asks the document
for it, and tells it what is wrong.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

from kahanmaps.errors import show, suggestion

_TIME_UNITS = {"s": 1, "min": 60, "h": 3600, "d": 86400}
_MEMORY_UNITS = {"kB": 10**3, "MB": 10**6, "GB": 10**9, "TB": 10**12, "KiB": 2**10, "MiB": 2**20, "GiB": 2**30}
_MOST_SECONDS, _MOST_BYTES = 10**9, 10**18  # what system calls take
_NONE = "none"

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


def _read_system(value: Any) -> None:
    names = value if isinstance(value, list) else [value]
    if not all(isinstance(name, str) and name for name in names):
        raise ValueError(f'found {show(value)}, expected "family", a name of the catalogue, a path, or a list of these')


def _read_digits(value: Any) -> None:
    if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value < 2**63:
        raise ValueError(f"found {show(value)}, expected a whole number of digits, at least 1")


# A shape is a function that raises ValueError; or a type, what is expected in words, and the shape of what is in a list
# or under every name of a table, or those under its only names.
_ON_ERROR = (str, "refuse, or skip for systems that cannot be read")
_LIMITS = (
    dict,
    "a table with time, memory, digits",
    {"time": read_time, "memory": read_memory, "digits": _read_digits},
)
_ZIP = 'a list of lists of axes, e.g. [["m", "steps"]]'
_EXPERIMENT = (
    dict,
    "a table",
    {
        "task": (str, "the name of a task, e.g. check-commute"),
        "system": _read_system,
        "options": (dict, "a table of options with their values"),
        "axes": (dict, "a table of options with lists or ranges of values"),
        "zip": (list, _ZIP, (list, _ZIP, (str, _ZIP))),
        "on_error": _ON_ERROR,
        "limits": _LIMITS,
    },
)
_EXPERIMENTS = (dict, "at least one table [experiments.NAME]", _EXPERIMENT)
_SPEC = {"name": (str, "text"), "on_error": _ON_ERROR, "limits": _LIMITS, "experiments": _EXPERIMENTS}
_REQUIRED = ("experiments", "task")
_OF_SYSTEM_FILES = (("system",), ("hamiltonian",), ("family",), ("variables",))


def shape_mistakes(document: Mapping[str, Any]) -> list[tuple[Place, str, str]]:
    """What is wrong with the shape: where, the key as people write it, and a sentence.

    >>> shape_mistakes({"experiments": {"a": {"task": 1}}})
    [(('experiments', 'a', 'task'), 'experiments.a.task', 'found 1, expected the name of a task, e.g. check-commute')]
    """
    found = _mistakes(document, (dict, "a table", _SPEC), ())
    return [(place, key_of(place), sentence) for place, sentence in found]


def _mistakes(value: Any, shape: Any, place: Place) -> Iterator[tuple[Place, str]]:
    """The places in a value that have not their shape, and what is wrong there."""
    if callable(shape):
        try:
            shape(value)
        except ValueError as error:
            yield place, str(error)
        return
    kind, expected, *inner = shape
    if not isinstance(value, kind) or (shape is _EXPERIMENTS and not value):
        yield place, f"found {show(value)}, expected {expected}"
        return
    (parts,) = inner or [None]
    if isinstance(parts, tuple):
        for name, item in enumerate(value) if kind is list else value.items():
            yield from _mistakes(item, parts, (*place, name))
    elif parts is not None:
        for name, part in parts.items():
            if name in value:
                yield from _mistakes(value[name], part, (*place, name))
            elif name in _REQUIRED:
                yield (*place, name), f"missing, expected {part[1]}"
        for name in (name for name in value if name not in parts):
            here = (*place, name)
            is_of_system = here in _OF_SYSTEM_FILES
            hint = " (a system file is for the other commands)" if is_of_system else suggestion(name, list(parts))
            yield here, f"unknown key, expected one of {', '.join(parts)}{hint}"


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
