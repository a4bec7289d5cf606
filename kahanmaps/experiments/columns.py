"""Two numbers of many results side by side, one pair a task: what a scatter plot shows."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from kahanmaps.errors import InputError
from kahanmaps.experiments.export import Entry, entries, plain
from kahanmaps.experiments.records import Row
from kahanmaps.experiments.summary import (
    _WORDS,
    OF_THE_RUN,
    _approximate,
    _is_number,
    _must_exist,
    _order,
    _place,
    names_of_entry,
)

_MOST_CATEGORIES = 60


@dataclass(frozen=True)
class Column:
    """Values of one name, one for each pair: numbers, or places in `categories` where some value is no number."""

    name: str
    values: array[float]
    categories: tuple[str, ...] | None


@dataclass(frozen=True)
class Pairs:
    """The values `x` and `y` of the tasks that have both, and how many have not (`left_out`) or no result (`missing`).

    `series` are values of a third name by which the pairs are told apart, None without one.
    """

    x: Column
    y: Column
    series: Column | None
    missing: int
    left_out: int


def value_pairs(rows: Iterable[Row], x: str, y: str, by: str | None = None) -> Pairs:
    """The values that `x` and `y` name, by the rules of `summarise`; y has to be a number, x may be a word.

    With `by` also the values of that name, as categories. Rows are read once; kept are 16 bytes for each of them and
    what is different among the words. Raises InputError for names that no row has, where y has no numbers, and for more
    than 60 different words.

    >>> from kahanmaps.experiments.records import Outcome, Record, Task
    >>> def row(number, eps, height):
    ...     task = Task("orbit", None, {"eps": eps, "seed": number})
    ...     return Row("e", number, task, Record(task.key, Outcome.OK, {"height": height}))
    >>> found = value_pairs([row(0, "1/2", 3), row(1, "1/4", "7/2")], "eps", "height")
    >>> found.x.values.tolist(), found.y.values.tolist()
    ([0.5, 0.25], [3.0, 3.5])
    """
    names = list(dict.fromkeys([x, y] if by is None else [x, y, by]))
    codes = {name: _Codes() for name in (x, by) if name is not None}
    held, xs, series = array("d"), array("q"), array("q")
    seen, numeric = set[Entry](), set(OF_THE_RUN)
    missing = left_out = 0
    for row in rows:
        found = list(entries(row))
        for entry, value in found:
            seen.add(entry)
            if _is_number(value):
                numeric.update(names_of_entry(entry))
        if row.record is None:
            missing += 1
            continue
        at = dict(zip(names, (value for _, value in _place(row, names, found)), strict=True))
        at.update({name: getattr(row.record, name) for name in OF_THE_RUN if name in at and at[name] is None})
        number, value = at[y], at[x]
        if value is None or isinstance(number, bool) or not _is_number(number):
            left_out += 1
            continue
        held.append(_approximate(Fraction(number)))
        xs.append(codes[x].of(value))
        if by is not None:
            series.append(codes[by].of(at[by]))
    if held or missing or left_out:
        known = {*_WORDS, *OF_THE_RUN}.union(*map(names_of_entry, seen))
        for name in names:
            _must_exist(name, known, "to draw")
        _must_exist(y, numeric, "of numbers")
    return Pairs(
        codes[x].column(x, xs),
        Column(y, held, None),
        None if by is None else codes[by].column(by, series, words=True),
        missing,
        left_out,
    )


class _Codes:
    """Different values, numbered as they come."""

    def __init__(self) -> None:
        self._values: dict[Any, tuple[int, Any]] = {}  # by what they are sorted by

    def of(self, value: Any) -> int:
        return self._values.setdefault(_order(value), (len(self._values), value))[0]

    def column(self, name: str, codes: Sequence[int], words: bool = False) -> Column:
        """The numbers, or the places among the words in their order."""
        values = [value for _, value in self._values.values()]
        if not words and all(_is_number(value) and not isinstance(value, bool) for value in values):
            numbers = [_approximate(Fraction(value)) for value in values]
            return Column(name, array("d", (numbers[code] for code in codes)), None)
        if len(values) > _MOST_CATEGORIES:
            raise InputError(
                f"found {len(values)} different values of {name}, expected numbers, or at most {_MOST_CATEGORIES} words"
            )
        ordered = [self._values[key] for key in sorted(self._values)]
        place = {code: float(k) for k, (code, _) in enumerate(ordered)}
        texts = tuple(plain(value) or "none" for _, value in ordered)
        return Column(name, array("d", (place[code] for code in codes)), texts)
