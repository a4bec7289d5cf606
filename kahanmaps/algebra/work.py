"""Counted work: it limits a search in place of a clock, so that a search has the same result on every machine.

A unit of work is about a microsecond of field operations on a laptop of 2020. Expensive operations call `count_work`
in advance, with an estimate from the sizes of their arguments. A `Budget` is a number of units; all work that is
counted after its creation is charged to it. `benchmarks/units.py` compares units with seconds.

Trap: a result from a module-level cache would cost no work the second time, so the outcome would depend on earlier
calls. `counted_cache` counts the work of a cached result again. A cache for one search only needs no such care.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache, wraps
from math import ceil, inf
from typing import Any

from kahanmaps.errors import InputError

LEAST_EFFORT, MOST_EFFORT = -20, 40
SPENT = "work limit reached; raise --effort"  # the reason given for a search that ended early
UNFINISHED = "the search was interrupted before all stages were completed"


class _Counter(threading.local):
    units = 0  # an integer, since sums of floats would depend on their order


_counter = _Counter()


def count_work(units: float) -> None:
    """Add units to the work counted in this thread."""
    _counter.units += ceil(units)


def counted() -> int:
    """Return the units of work counted in this thread so far."""
    return _counter.units


class Budget:
    """A limit on the units of work counted after its creation in the thread that created it.

    >>> budget = Budget(100)
    >>> stages = budget.share([1, 3])
    >>> next(stages).units
    25.0
    >>> count_work(5)
    >>> budget.spent, budget.left, next(stages).units  # the unused units of the first stage go to the second
    (5, 95.0, 95.0)
    """

    def __init__(self, units: float = inf) -> None:
        self.units = float(units)
        self._units_before = counted()

    def __repr__(self) -> str:
        return f"Budget({self.units:.0f})"

    @property
    def spent(self) -> int:
        """The units counted since the budget was created."""
        return counted() - self._units_before

    @property
    def left(self) -> float:
        """The remaining units, at least 0."""
        return max(0.0, self.units - self.spent)

    @property
    def is_spent(self) -> bool:
        """Whether no units remain."""
        return self.spent >= self.units

    def part(self, fraction: float) -> Budget:
        """Return a new budget that has this fraction of the units left in `self`."""
        return Budget(self.left * fraction)

    def share(self, weights: Sequence[float]) -> Iterator[Budget]:
        """Yield budgets for stages, in proportion to their weights; each is created when the stage begins.

        Units that a stage does not use are available to the later stages.
        """
        for k, weight in enumerate(weights):
            yield self.part(weight / sum(weights[k:]))


def units_at(effort: int, units: float) -> float:
    """Return the units for an effort: `units` for effort 1, doubled for each step up and halved for each step down.

    Raises InputError for an effort that is not an integer from -20 to 40.

    >>> units_at(1, 100), units_at(3, 100), units_at(0, 100)
    (100.0, 400.0, 50.0)
    """
    if isinstance(effort, bool) or not isinstance(effort, int) or not LEAST_EFFORT <= effort <= MOST_EFFORT:
        raise InputError(f"found the effort {effort!r}, expected an integer from {LEAST_EFFORT} to {MOST_EFFORT}")
    return units * 2.0 ** (effort - 1)


def counted_cache(size: int) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Decorate a function: cache its last `size` results, and count the work of a cached result on every call."""

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        @lru_cache(size)
        def call_cached(*arguments: Any) -> tuple[Any, int]:
            units_before = counted()
            return function(*arguments), counted() - units_before

        @wraps(function)
        def call(*arguments: Any) -> Any:
            units_before = counted()
            result, units = call_cached(*arguments)
            count_work(units - (counted() - units_before))
            return result

        return call

    return decorate
