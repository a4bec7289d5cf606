"""Plain data as TOML text, as far as system files need it: text, integers, lists, tables, lists of tables in them.

Python reads TOML and does not write it; a dependency for forty lines would be one too many.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from flint import fmpz


def to_toml(document: Mapping[str, Any], top: Sequence[str], sections: Sequence[str]) -> str:
    """The document as text: the keys `top` first, then the tables `sections`, in this order; others are left out.

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
            plain = {key: value for key, value in document[section].items() if not _is_tables(value)}
            lines += ["", f"[{section}]", *_lines(plain)]
            for key, tables in document[section].items():
                if key not in plain:
                    for table in tables:
                        lines += ["", f"[[{section}.{_toml_key(key)}]]", *_lines(table)]
    return "\n".join(lines) + "\n"


def _is_tables(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(item, dict) for item in value)


def _lines(table: Mapping[str, Any]) -> list[str]:
    return [f"{_toml_key(key)} = {_toml_value(value)}" for key, value in table.items()]


def _toml_key(key: str) -> str:
    bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    return key if bare else _toml_string(key)


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
        # TOML readers written in Python refuse long decimals without quotes.
        return str(value) if value.bit_length() <= 10_000 else _toml_string(str(fmpz(value)))
    parts = [_toml_value(item) for item in value]
    line = f"[{', '.join(parts)}]"
    if len(line) <= 100 and not any(isinstance(item, list) for item in value):
        return line
    return "[\n" + "".join(f"  {part},\n" for part in parts) + "]"


def _toml_string(text: str) -> str:
    # A JSON string is a TOML basic string, but for DEL, which TOML wants escaped; a terminal obeys some others too.
    shown = (c if c.isprintable() else f"\\U{ord(c):08x}" for c in json.dumps(text, ensure_ascii=False))
    return "".join(shown)
