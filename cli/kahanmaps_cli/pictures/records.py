"""Records that `kahanmaps degrees --json` and `kahanmaps heights --json` wrote, read again for pictures."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from kahanmaps.errors import InputError

_MAX_BYTES = 64_000_000


def read_record(path: str) -> Any:
    """The JSON object in a file, `-` for standard input. Raises InputError where there is none."""
    try:
        if path == "-":
            content = sys.stdin.buffer.read(_MAX_BYTES + 1)
        else:
            with Path(path).open("rb") as file:
                content = file.read(_MAX_BYTES + 1)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from error
    if len(content) > _MAX_BYTES:
        raise InputError(f"{path}: found more than {_MAX_BYTES // 10**6} MB, expected one record")
    try:
        return json.loads(content)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: found no JSON ({error}), expected an object written by --json") from error
