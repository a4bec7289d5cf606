"""Orbits x, Phi(x), Phi^2(x), ... over any exact field or over balls: lazy, with an end that says what happened.

An orbit is walked with a `for` loop; afterwards `orbit.end` tells how it ended. Meeting the singular set or running
out of the digit budget is no exception: what was computed is delivered. Heights of non-integrable orbits multiply
with every step, so the budget is never absent by accident.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from kahanmaps.algebra.fields import QQ, Field
from kahanmaps.errors import InputError, PrecisionLost, SingularStep
from kahanmaps.maps.integer_steps import IntegerPoint
from kahanmaps.maps.kahan import KahanMap

DEFAULT_MAX_DIGITS = 200_000
_DIGITS_PER_BIT = 0.30103


@dataclass(frozen=True)
class OrbitEnd:
    """How an orbit ended.

    `status` is "completed", "periodic" (completed, and the start came back), "singular", "budget", "precision"
    (balls too wide), "overflow" (machine floats) or "interrupted"; `steps` is the index of the last point
    delivered. Modulo p a birational map need not be injective: an orbit may run into a cycle that its start is not on,
    and is then "completed".
    """

    status: str
    steps: int
    message: str
    period: int | None = None

    @property
    def is_whole(self) -> bool:
        """Whether every step that was asked for has been delivered."""
        return self.status in ("completed", "periodic")


class OrbitPoint:
    """The point after `step` steps; coordinates over Q are reduced to lowest terms only when `x` is asked for."""

    def __init__(self, step: int, field: Field, value: IntegerPoint | tuple[Any, ...]) -> None:
        self.step = step
        self.field = field
        self.value = value

    @cached_property
    def x(self) -> tuple[Any, ...]:
        """The coordinates, elements of the field."""
        return self.value.rationals() if isinstance(self.value, IntegerPoint) else self.value

    @property
    def text(self) -> list[str]:
        """The coordinates as text that parses back (over Q cheaper than `x`: no fraction has to be formed)."""
        if isinstance(self.value, IntegerPoint):
            return [str(above) if below == 1 else f"{above}/{below}" for above, below in self.value.lowest_terms()]
        return [self.field.format(entry) for entry in self.x]

    @property
    def digits(self) -> int:
        """About how many decimal digits the largest integer over the common denominator has (0 unless over Q)."""
        return digits_of(self.value) if isinstance(self.value, IntegerPoint) else 0

    def __repr__(self) -> str:
        return f"OrbitPoint({self.step}: {','.join(self.text)})"


class Orbit:
    """The orbit of `start` under a Kahan map: iterate over it once, then look at `end`.

    `start` is a sequence of exact numbers, `steps` how many steps to take (None: no limit, even after the start came
    back), `backward` steps by the inverse map. `max_digits` bounds the decimal digits of the integers over one
    common denominator (over Q).

    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> orbit = Orbit(KahanMap(QuadraticSystem.from_text(["x"], ["x^2"]), "1/2"), ["1/5"], 3)
    >>> [point.text for point in orbit]
    [['1/5'], ['1/4'], ['1/3'], ['1/2']]
    >>> orbit.end.status
    'completed'
    """

    def __init__(
        self,
        kahan_map: KahanMap,
        start: Sequence[Any],
        steps: int | None,
        *,
        backward: bool = False,
        max_digits: int | None = DEFAULT_MAX_DIGITS,
    ) -> None:
        require_steps(steps)
        if max_digits is not None and max_digits < 1:
            raise InputError(f"found a budget of {max_digits} digits, expected at least 1")
        self.map = kahan_map.inverse if backward else kahan_map
        self.start = kahan_map.point(start)
        self.steps = steps
        self.backward = backward
        self.max_digits = max_digits
        self.end: OrbitEnd | None = None
        self._interrupted = False

    def interrupt(self) -> None:
        """Ask a running orbit to end after the step in flight (safe to call from a signal handler)."""
        self._interrupted = True

    def __iter__(self) -> Iterator[OrbitPoint]:
        field = self.map.field
        value: Any = IntegerPoint.from_rationals(self.start) if field is QQ else self.start
        start, step, period = value, 0, None
        yield OrbitPoint(0, field, value)  # the budget is for what is computed
        if self._too_large(value):
            self.end = self._over_budget(value, 0)
            return
        while self.steps is None or step < self.steps:
            if self._interrupted:
                self.end = OrbitEnd("interrupted", step, f"interrupted after step {step}", period)
                return
            try:
                value = self._next(value)
            except SingularStep:
                self.end = OrbitEnd("singular", step, self._singular_message(step))
                return
            except PrecisionLost as error:
                self.end = OrbitEnd("precision", step, f"step {step + 1} cannot be decided: {error}")
                return
            if self._too_large(value):
                self.end = self._over_budget(value, step + 1)
                return
            step += 1
            if period is None and field.exact and value == start:
                period = step
            yield OrbitPoint(step, field, value)
        if period is not None:
            self.end = OrbitEnd("periodic", step, f"the start came back after {counted(period, 'step')}", period)
        else:
            self.end = OrbitEnd("completed", step, counted(step, "step"))

    def _next(self, value: Any) -> Any:
        if isinstance(value, IntegerPoint):
            image = self.map.integer_steps.step(value)
            if image is None:
                raise SingularStep("det(I - eps f'(x)) = 0")
            return image
        return self.map.step(value)

    def _too_large(self, value: Any) -> bool:
        return self.max_digits is not None and isinstance(value, IntegerPoint) and digits_of(value) > self.max_digits

    def _over_budget(self, value: IntegerPoint, step: int) -> OrbitEnd:
        return OrbitEnd(
            "budget",
            max(0, step - 1),
            f"step {step} has numbers of {counted(digits_of(value), 'digit')}, "
            f"more than the budget of {self.max_digits} (--max-digits)",
        )

    def _singular_message(self, step: int) -> str:
        sign = "+" if self.backward else "-"
        return f"det(I {sign} eps f'(x)) = 0 at step {step}: the map has no value there"


def digits_of(point: IntegerPoint) -> int:
    """About how many decimal digits the largest of the integers has."""
    return int(point.bits * _DIGITS_PER_BIT) + 1


def counted(number: int, word: str) -> str:
    """1 step, 2 steps."""
    return f"{number} {word}" if number == 1 else f"{number} {word}s"


def require_steps(steps: int | None) -> None:
    """Raises InputError for a negative number of steps."""
    if steps is not None and steps < 0:
        raise InputError(f"found {steps} steps, expected 0 or more (for the inverse map, step backward)")
