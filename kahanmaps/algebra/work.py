"""Counted work: what bounds a search in place of a clock, so that the same question has the same answer on any machine.

Work is counted in units; one is about a microsecond of field operations on a laptop of 2020. Expensive operations
count themselves, from the sizes of what they are given, before they are done: see `count` and the functions below it.
A `Budget` is so many units; it is spent by all that is counted after it was made. `benchmarks/units.py` compares units
with seconds.

Trap: what a cache of a module keeps is not counted when it is asked for again, and budgets would then depend on what
was asked before. For functions that count, `counted_cache` counts it again; caches of one search are harmless.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache, wraps
from math import ceil, inf
from typing import Any

from kahanmaps.errors import InputError

LEAST_EFFORT, MOST_EFFORT = -20, 40
SPENT = "the budget was spent (--effort)"  # why a search ended early


class _Counter(threading.local):
    units = 0  # an integer, so that sums do not depend on their order


_counter = _Counter()


def count(units: float) -> None:
    """Count so many units of work as done, in this thread."""
    _counter.units += ceil(units)


def counted() -> int:
    """The units of work that were counted in this thread so far."""
    return _counter.units


class Budget:
    """Units of counted work that may be spent from now on, in the thread that made it.

    >>> budget = Budget(100)
    >>> stages = budget.share([1, 3])
    >>> next(stages).units
    25.0
    >>> count(5)
    >>> budget.spent, budget.left, next(stages).units  # what the first stage left goes to the second
    (5, 95.0, 95.0)
    """

    def __init__(self, units: float = inf) -> None:
        self.units = float(units)
        self._before = counted()

    def __repr__(self) -> str:
        return f"Budget({self.units:.0f})"

    @property
    def spent(self) -> int:
        """The units that were counted since the budget was made."""
        return counted() - self._before

    @property
    def left(self) -> float:
        """The units that may still be spent, at least 0."""
        return max(0.0, self.units - self.spent)

    @property
    def is_spent(self) -> bool:
        """Whether nothing is left."""
        return self.spent >= self.units

    def part(self, fraction: float) -> Budget:
        """A budget of this fraction of what is left."""
        return Budget(self.left * fraction)

    def share(self, weights: Sequence[float]) -> Iterator[Budget]:
        """Budgets for stages, in proportion to their weights; each is made when it is asked for.

        What one stage leaves goes to those after it.
        """
        for k, weight in enumerate(weights):
            yield self.part(weight / sum(weights[k:]))


def units_at(effort: int, units: float) -> float:
    """The units at an effort, of which 1 is the default; each more doubles them, each less halves them.

    Raises InputError for an effort that is no integer from -20 to 40.

    >>> units_at(1, 100), units_at(3, 100), units_at(0, 100)
    (100.0, 400.0, 50.0)
    """
    if isinstance(effort, bool) or not isinstance(effort, int) or not LEAST_EFFORT <= effort <= MOST_EFFORT:
        raise InputError(f"found the effort {effort!r}, expected an integer from {LEAST_EFFORT} to {MOST_EFFORT}")
    return units * 2.0 ** (effort - 1)


def counted_cache(size: int) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """A decorator: keep the last results of a function, and count its work whenever a result is asked for."""

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        @lru_cache(size)
        def remembered(*arguments: Any) -> tuple[Any, int]:
            before = counted()
            return function(*arguments), counted() - before

        @wraps(function)
        def call(*arguments: Any) -> Any:
            before = counted()
            result, units = remembered(*arguments)
            count(units - (counted() - before))
            return result

        return call

    return decorate
