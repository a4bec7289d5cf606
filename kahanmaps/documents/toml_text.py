"""Reading and writing of TOML: system files, and specs of experiments.

Python's standard library reads TOML but does not write it. The writer supports what system files need: text, integers,
lists, tables, and lists of tables.
"""

from __future__ import annotations

import json
import os
import stat
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from flint import fmpz

from kahanmaps.errors import InputError, SystemFileError


class TomlKind(NamedTuple):
    """A kind of TOML file: its name, its maximal size in bytes, and the class of errors that report its mistakes."""

    name: str
    max_bytes: int
    error: type[SystemFileError]

    def read(self, path: str | Path) -> bytes:
        """Return the bytes of a file, at most `max_bytes` + 1 of them. Raises InputError if the file cannot be read."""
        try:
            # Refuse a device or named pipe, which may never end; accept /dev/fd/63, which a shell passes for <(...).
            mode = os.stat(path).st_mode
            is_of_shell = stat.S_ISFIFO(mode) and str(path).startswith(("/dev/fd/", "/dev/stdin"))
            if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode) or is_of_shell):
                raise InputError(f"cannot read the {self.name} {path}: it is a pipe or a device, expected a file")
            with open(path, "rb") as stream:
                return stream.read(self.max_bytes + 1)
        except InputError:  # a subclass of ValueError, which is caught below
            raise
        except OSError as error:
            raise InputError(f"cannot read the {self.name} {path}: {error.strerror or error}") from error
        except ValueError as error:  # the path contains a NUL character
            raise InputError(f"cannot read the {self.name} {str(path)!r}: {error}") from error

    def document(self, text: str | bytes, where: str) -> dict[str, Any]:
        """Parse TOML to plain data, decimals as text; messages call it `where`. Raises InputError, or `error`."""
        if len(text) > self.max_bytes:
            raise InputError(f"{where} is larger than {self.max_bytes} bytes, the limit for a {self.name}")
        try:
            # Some editors begin a file with a byte order mark.
            decoded = text.decode("utf-8-sig") if isinstance(text, bytes) else text
            # Decimals remain text. Python's limit on digits applies only to integers without quotes.
            return tomllib.loads(decoded, parse_float=lambda number: number.replace("_", ""))
        except (RecursionError, ValueError) as error:
            hint = "nested too deeply" if isinstance(error, RecursionError) else "write long numbers in quotes"
            reason = f"cannot be read: {hint}"
            if isinstance(error, UnicodeDecodeError):
                reason = f"not UTF-8 text: {error.reason} at byte {error.start}"
            elif isinstance(error, tomllib.TOMLDecodeError):
                reason = str(error)
            raise self.error(where, [("TOML", reason)]) from error


def to_toml(document: Mapping[str, Any], top: Sequence[str], sections: Sequence[str]) -> str:
    """Return a document as TOML: first the keys `top`, then the tables `sections`; other entries are omitted.

    >>> print(to_toml({"name": "a", "system": {"rhs": ["x^2"]}}, ["name"], ["system"]), end="")
    name = "a"
    <BLANKLINE>
    [system]
    rhs = ["x^2"]
    """
    lines = []
    for key in top:
        if key in document:
            lines.append(f"{key} = {_toml_value(document[key])}")
    for section in sections:
        if section in document and document[section] is not None:
            entries = {
                key: value
                for key, value in document[section].items()
                if not (isinstance(value, list) and value and all(isinstance(item, dict) for item in value))
            }
            lines += ["", f"[{section}]", *_lines(entries)]
            for key, tables in document[section].items():
                if key not in entries:
                    for table in tables:
                        lines += ["", f"[[{section}.{_toml_key(key)}]]", *_lines(table)]
    return "\n".join(lines) + "\n"


def _lines(table: Mapping[str, Any]) -> list[str]:
    return [f"{_toml_key(key)} = {_toml_value(value)}" for key, value in table.items()]


def _toml_key(key: str) -> str:
    is_bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    return key if is_bare else _toml_string(key)


def _toml_value(value: Any) -> str:
    if isinstance(value, Mapping):
        return f"{{ {', '.join(_lines(value))} }}" if value else "{}"
    if isinstance(value, bool):
        return "true" if value else "false"
    if not isinstance(value, str | int | Sequence):
        return _toml_string(str(value))
    if isinstance(value, str):
        return _toml_string(value)
    if isinstance(value, int):
        # TOML readers written in Python refuse long integers without quotes.
        return str(value) if value.bit_length() <= 10_000 else _toml_string(str(fmpz(value)))
    items = [_toml_value(item) for item in value]
    line = f"[{', '.join(items)}]"
    if len(line) <= 100 and not any(isinstance(item, list) for item in value):
        return line
    return "[\n" + "".join(f"  {text},\n" for text in items) + "]"


def _toml_string(text: str) -> str:
    # A JSON string is a TOML basic string if DEL is escaped. Escaping other control characters protects terminals.
    characters = (c if c.isprintable() else f"\\U{ord(c):08x}" for c in json.dumps(text, ensure_ascii=False))
    return "".join(characters)
