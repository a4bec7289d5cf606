"""Values of options (lists, exact ranges "1/10..1/2 step 1/10") and their combinations (products, zips).

Ranges and combinations are computed on demand, and the size of a grid is known without iterating over it.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from itertools import accumulate
from math import lcm, prod
from typing import Any

from flint import fmpq

from kahanmaps.algebra.parsing import parse_number
from kahanmaps.errors import InputError, show
from kahanmaps.experiments.options import Option

_RANGE_FORM = 'expected "FIRST..LAST", "FIRST..LAST:STEP" or "FIRST..LAST step STEP", e.g. "1/10..1/2:1/10"'
_MAX_VALUES = 2**62  # maximal number of values of an axis: Python's `len` cannot exceed 2^63
_TOO_MANY = "too many values"  # part of messages

Mistake = tuple[tuple[int, ...], str]  # a position in a list of values, as a tuple (k,) or (), and a message


class RationalRange(Sequence[fmpq]):
    """The numbers first, first + step, ... up to last; last is included if last - first is a multiple of step.

    >>> [str(value) for value in RationalRange.from_text("1/10..1/2 step 1/5")]
    ['1/10', '3/10', '1/2']
    >>> len(RationalRange.from_text("0..9999"))
    10000
    """

    def __init__(self, first: fmpq, last: fmpq, step: fmpq) -> None:
        if step == 0:
            raise InputError("found a range of step 0, expected another step")
        count = (last - first) / step
        if count < 0:
            hint = " (for a falling range write a negative step)" if step > 0 else ""
            raise InputError(
                f"found a range without values, from {show(first)} to {show(last)} in steps of {show(step)}{hint}"
            )
        if count >= _MAX_VALUES:
            raise InputError(f"found a range from {show(first)} to {show(last)} in steps of {show(step)}: {_TOO_MANY}")
        self._scale = lcm(int(first.q), int(last.q), int(step.q))
        start, stop, scaled_step = (int((self._scale * number).p) for number in (first, last, step))
        self.numerators = range(start, stop + (1 if scaled_step > 0 else -1), scaled_step)

    @classmethod
    def from_text(cls, text: str) -> RationalRange:
        """Return the range that a text such as "2..5" describes. Raises InputError for any other text."""
        first, separator, last_and_step = text.partition("..")
        words = last_and_step.replace(":", " step ", 1).split()
        if not separator or not first.strip() or not (len(words) == 1 or (len(words) == 3 and words[1] == "step")):
            raise InputError(f"found {show(text)}, {_RANGE_FORM}")
        return cls(parse_number(first), parse_number(words[0]), parse_number(words[2]) if len(words) > 1 else fmpq(1))

    def __len__(self) -> int:
        return len(self.numerators)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return [fmpq(numerator, self._scale) for numerator in self.numerators[index]]
        return fmpq(self.numerators[index], self._scale)


class AxisValues(Sequence[Any]):
    """The canonical values of an option, as a sequence composed of `pieces`: single values and ranges."""

    def __init__(self, option: Option, pieces: Sequence[Sequence[Any]]) -> None:
        self.option = option
        self.pieces = pieces
        self._ends = list(accumulate(len(piece) for piece in pieces))

    def __len__(self) -> int:
        return self._ends[-1]

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return [self[k] for k in range(len(self))[index]]
        index = range(len(self))[index]
        piece_index = bisect_right(self._ends, index)
        value = self.pieces[piece_index][index - (self._ends[piece_index - 1] if piece_index else 0)]
        return self.option.read(value) if isinstance(value, fmpq) else value


def is_range(raw: Any) -> bool:
    """Whether a value in a spec has the form of a range; the range may be invalid."""
    return isinstance(raw, str) and ".." in raw


def read_values(option: Option, raw: Any, repeats: bool = False) -> tuple[AxisValues | None, list[Mistake]]:
    """Return a pair: the values of an option in a spec (None if invalid), and mistakes at positions counted from 1.

    `raw` is one value, a range, or a list of values and ranges. If `repeats` is true, values may occur repeatedly.
    """
    pieces: list[Sequence[Any]] = []
    mistakes: list[Mistake] = []
    positions: dict[Any, int] = {}
    items = raw if isinstance(raw, list) else [raw]
    if not items:
        mistakes.append(((), "found an empty list, expected at least one value"))
    for number, item in enumerate(items, start=1):
        position = (number,) if isinstance(raw, list) else ()
        try:
            if option.numbers and is_range(item):
                values_range = RationalRange.from_text(item)
                # Both ends, the second value and 0 are tried: an option may exclude 0 or numbers that are not integers.
                values = AxisValues(option, [values_range])
                zero_index = values_range.numerators.index(0) if 0 in values_range.numerators else 0
                for k in {0, min(1, len(values_range) - 1), len(values_range) - 1, zero_index}:
                    values[k]
                pieces.append(values_range)
                continue
            value = option.read(item)
            if value in positions and not repeats:
                raise InputError(f"found {show(item)}, the same value as in place {positions[value]}: expected it once")
            positions[value] = number
            pieces.append((value,))
        except InputError as error:
            mistakes.append((position, str(error)))
    if not mistakes and sum(map(len, pieces)) > _MAX_VALUES:
        mistakes.append(((), f"found {_TOO_MANY}"))
    return (None if mistakes else AxisValues(option, pieces)), mistakes


def has_repeats(values: AxisValues) -> bool:
    """Whether some single value occurs more than once; values within ranges are not compared."""
    single_values = [repr(piece[0]) for piece in values.pieces if not isinstance(piece, RationalRange)]
    return len(set(single_values)) < len(single_values)


class Grid:
    """All combinations of the values of named axes; the last axis varies fastest, and zipped axes vary together.

    >>> grid = Grid({"m": [2, 3], "seed": range(3), "steps": [10, 20]}, zips=[("m", "steps")])
    >>> grid.size, grid[3]
    (6, {'m': 3, 'steps': 20, 'seed': 0})
    """

    def __init__(self, axes: Mapping[str, Sequence[Any]], zips: Sequence[Sequence[str]] = ()) -> None:
        group_of_axis = (next((tuple(names) for names in zips if name in names), (name,)) for name in axes)
        self.axes = axes
        self.groups: list[tuple[str, ...]] = list(dict.fromkeys(group_of_axis))
        self._lengths = [len(axes[group[0]]) for group in self.groups]

    @property
    def size(self) -> int:
        """The number of combinations, which may exceed the maximum 2^63 - 1 of `len`."""
        return prod(self._lengths)

    def __getitem__(self, index: int) -> dict[str, Any]:
        if not 0 <= index < self.size:
            raise IndexError(index)
        indices = []
        for length in reversed(self._lengths):
            index, position = divmod(index, length)
            indices.append(position)
        return {
            name: self.axes[name][position]
            for group, position in zip(self.groups, reversed(indices), strict=True)
            for name in group
        }
