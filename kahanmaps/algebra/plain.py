"""Values as plain data, as JSON has them: exact numbers and formulas as text that reads back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flint import fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.text import format_polynomial

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
    if isinstance(value, fmpq_mat):
        return plain(value.tolist())
    return format_polynomial(value) if isinstance(value, fmpq_mpoly) else str(value)


def attributes(value: Any, /, *names: str, **others: str) -> dict[str, Any]:
    """Attributes of a value as plain data, by their names or, after these, by others: `whole="is_whole"`."""
    under = {**dict(zip(names, names, strict=True)), **others}
    return {name: plain(getattr(value, attribute)) for name, attribute in under.items()}
