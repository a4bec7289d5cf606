"""Sweeps kept in a file: each is written as soon as it is finished, and not made again.

A line of JSON each, after one with the settings. A process that is killed while it writes leaves half a line, which the
next one takes away. Files of several processes, put one after another, are a file again.
"""

from __future__ import annotations

import json
import os
from typing import Any

from kahanmaps.errors import InputError
from kahanmaps.laboratory.scan.sweep import Choice, Sweep

_SETTINGS = "settings"
_OTHER = {
    "document": "another system",
    "over": "other parameters",
    "eps": "another eps",
    "by": "another --by",
    "terms": "other --terms",
    "seed": "another seed",
}


class Kept:
    """The sweeps of a scan in a file, which is made if need be; `part` of `parts`, if others do the rest.

    Raises InputError for a part that is none.
    """

    def __init__(self, path: str, part: int = 1, parts: int = 1) -> None:
        if not 1 <= part <= parts:
            raise InputError(f"found the part {part} of {parts}, expected 1 to {parts}")
        self.part, self.parts = part, parts
        self._path = path
        self._sweeps: dict[Choice, Sweep] = {}

    def open(self, settings: dict[str, Any]) -> None:
        """Read what is there of the scan with these settings. Raises InputError for a file of anything else."""
        settings = json.loads(json.dumps(settings, default=str))
        if os.path.exists(self._path) and not os.path.isfile(self._path):  # a device may have no end
            raise InputError(f"found {self._path}, expected a file that a scan has kept")
        with open(self._path, "ab+") as stream:
            stream.seek(0)
            content = stream.read()
            whole = content[: content.rfind(b"\n") + 1]
            try:
                records = [json.loads(line) for line in whole.splitlines()]
                others = [one[_SETTINGS] for one in records if _SETTINGS in one]
                found = [_sweep(one) for one in records if _SETTINGS not in one]
                wrong = [key for key in settings for other in others if other[key] != settings[key]]
            except (ValueError, KeyError, TypeError) as error:
                raise InputError(f"found {self._path}, expected a file that a scan has kept") from error
            if content and not others:
                raise InputError(f"found {self._path}, expected a file that a scan has kept")
            if wrong:
                raise InputError(f"found {self._path} of a scan with {_OTHER[wrong[0]]}, expected one of this scan")
            stream.truncate(len(whole))
            self._sweeps.update(found)
            if not others:
                _write(stream.fileno(), {_SETTINGS: settings})

    def get(self, choice: Choice) -> Sweep | None:
        """The sweep over these members, if it was finished."""
        return self._sweeps.get(choice)

    def add(self, one: Sweep, lines: int | None) -> None:
        """Write a finished sweep."""
        with open(self._path, "ab") as stream:
            _write(stream.fileno(), {"lines": lines, **vars(one), "classes": [*one.classes.items()]})


def _write(file: int, record: dict[str, Any]) -> None:
    left = json.dumps(record).encode() + b"\n"
    while left:
        left = left[os.write(file, left) :]
    os.fsync(file)


def _sweep(record: dict[str, Any]) -> tuple[Choice, Sweep]:
    classes = {tuple(map(int, degrees)): [tuple(map(int, x)) for x in points] for degrees, points in record["classes"]}
    known = {**record, "classes": classes, "generic": tuple(map(int, record["generic"]))}
    lines = known.pop("lines")
    one = Sweep(**known)
    return (one.prime, lines, one.width), one
