"""Right-hand sides as differential equations, as one writes them down: "x' = x*y; y' = -x", or dx/dt = x*y."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from kahanmaps.errors import InputError, quoted

_EQUATION = re.compile(r"(?:d\s*(\w+)\s*/\s*d\s*t|(\w+)\s*['′])\s*=([^=]*)")


def without_left_sides(document: Mapping[str, Any]) -> dict[str, Any]:
    """The document with a list of right-hand sides, and variables, where its [system] has equations or one text.

    The order of the equations is that of the variables, where these are not given. Other documents come back equal.
    Raises InputError for equations that are none, or of other variables than those given.

    >>> without_left_sides({"system": {"rhs": "x' = x*y; dy/dt = -x"}})
    {'variables': ['x', 'y'], 'system': {'rhs': ['x*y', '-x']}}
    """
    section = document.get("system")
    given = section.get("rhs") if isinstance(section, dict) else None
    texts = [given] if isinstance(given, str) else given
    if not isinstance(texts, list) or not all(isinstance(text, str) for text in texts):
        return dict(document)
    if isinstance(given, list) and not any(mark in text for text in texts for mark in "=;"):
        return dict(document)
    pieces = [piece.strip() for text in texts for piece in re.split(r"[;\n]", text) if piece.strip()]
    if any("=" in piece for piece in pieces):
        sides = _equations(pieces)
        names = document.get("variables", list(sides))
        if not isinstance(names, list) or set(sides) != set(map(str, names)):
            raise InputError(f"found equations for {', '.join(sides)}, expected one for each of the variables")
        document = {"variables": names, **document}
        pieces = [sides[name] for name in names]
    return {**document, "system": {**document["system"], "rhs": pieces}}


def _equations(pieces: Sequence[str]) -> dict[str, str]:
    sides: dict[str, str] = {}
    for piece in pieces:
        match = _EQUATION.fullmatch(piece)
        if match is None:
            raise InputError(f"found {quoted(piece)}, expected an equation such as x' = x*y or dx/dt = x*y")
        name = match[1] or match[2]
        if name in sides:
            raise InputError(f"found two equations for {name}, expected one")
        sides[name] = match[3].strip()
    return sides
