"""Values as plain data, as JSON has them: exact numbers and formulas as text that reads back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from math import isfinite
from typing import Any

from flint import fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.written.text import format_polynomial

_EXACT = 2**53  # up to which every reader of JSON holds integers exactly


def plain(value: Any) -> Any:
    """The value as plain data: by its `to_json` where it has one; sequences as lists, larger integers as text.

    >>> from flint import fmpq
    >>> plain([fmpq(1, 2), 7, 2**61 - 1, fmpq_mat([[1, -3]]), {"eps": None}])
    ['1/2', 7, '2305843009213693951', [['1', '-3']], {'eps': None}]
    """
    if value is None or isinstance(value, bool | float) or (isinstance(value, int) and abs(value) < _EXACT):
        return value
    if hasattr(value, "to_json"):
        return value.to_json()
    if isinstance(value, Mapping):
        return {name: plain(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    if isinstance(value, fmpq_mat) or type(value).__module__ == "numpy":
        return plain(value.tolist())
    return format_polynomial(value) if isinstance(value, fmpq_mpoly) else str(value)


def json_float(value: Any) -> float | str:
    """A JSON number, or the text inf, -inf or nan."""
    number = float(value)
    return number if isfinite(number) else repr(number)


def all_fields(value: Any) -> dict[str, Any]:
    """All fields of a dataclass as plain data, and those of the dataclasses in it."""
    return {one.name: _deep(getattr(value, one.name)) for one in fields(value) if one.name[0] != "_"}


def _deep(value: Any) -> Any:
    if is_dataclass(value) and not hasattr(value, "to_json"):
        return all_fields(value)
    return [_deep(entry) for entry in value] if isinstance(value, list | tuple) else plain(value)


def attributes(value: Any, /, *names: str, **others: str) -> dict[str, Any]:
    """Attributes of a value as plain data, by their names or, after these, by others: `whole="is_whole"`."""
    under = {**dict(zip(names, names, strict=True)), **others}
    return {name: plain(getattr(value, attribute)) for name, attribute in under.items()}
