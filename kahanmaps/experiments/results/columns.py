"""Two numbers of many results side by side, one pair a task: what a scatter plot shows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from kahanmaps.errors import InputError
from kahanmaps.experiments.results.export import Entry, entries, plain
from kahanmaps.experiments.results.records import Row
from kahanmaps.experiments.results.summary import (
    _WORDS,
    OF_THE_RUN,
    _is_number,
    _must_exist,
    _order,
    _place,
    names_of_entry,
    nearest,
)

_MOST_CATEGORIES = 60


@dataclass(frozen=True)
class Column:
    """Values of one name, one for each pair: numbers, or places in `categories` where some value is no number."""

    name: str
    values: list[float]
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

    With `by` also the values of that name, as categories. Raises InputError for names that no row has, where y has no
    numbers, and for more than 60 different words.

    >>> from kahanmaps.experiments.results.records import Outcome, Record, Task
    >>> def row(number, eps, height):
    ...     task = Task("orbit", None, {"eps": eps, "seed": number})
    ...     return Row("e", number, task, Record(task.key, Outcome.OK, {"height": height}))
    >>> found = value_pairs([row(0, "1/2", 3), row(1, "1/4", "7/2")], "eps", "height")
    >>> found.x.values, found.y.values
    ([0.5, 0.25], [3.0, 3.5])
    """
    names = list(dict.fromkeys([x, y] if by is None else [x, y, by]))
    held: list[dict[str, Any]] = []
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
        if at[x] is None or isinstance(at[y], bool) or not _is_number(at[y]):
            left_out += 1
        else:
            held.append(at)
    if held or missing or left_out:
        known = {*_WORDS, *OF_THE_RUN}.union(*map(names_of_entry, seen))
        for name in names:
            _must_exist(name, known, "to draw")
        _must_exist(y, numeric, "of numbers")
    return Pairs(
        _column(x, [at[x] for at in held]),
        _column(y, [at[y] for at in held]),
        None if by is None else _column(by, [at[by] for at in held], words=True),
        missing,
        left_out,
    )


def _column(name: str, values: Sequence[Any], words: bool = False) -> Column:
    """The numbers, or the places among the words in their order."""
    if not words and all(_is_number(value) and not isinstance(value, bool) for value in values):
        return Column(name, [nearest(value) for value in values], None)
    keys = [_order(value) for value in values]
    different = dict(sorted(dict(zip(reversed(keys), reversed(values), strict=True)).items(), key=lambda item: item[0]))
    if len(different) > _MOST_CATEGORIES:
        raise InputError(
            f"found {len(different)} different values of {name}, expected numbers, or at most {_MOST_CATEGORIES} words"
        )
    place = {key: float(k) for k, key in enumerate(different)}
    return Column(name, [place[key] for key in keys], tuple(plain(value) or "none" for value in different.values()))
