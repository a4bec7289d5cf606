"""Orbits x, Phi(x), Phi^2(x), ... over any exact field or over balls: lazy, with an end that says what happened.

An orbit is walked with a `for` loop; afterwards `orbit.end` tells how it ended. Meeting the singular set or running
out of the digit budget is no exception: what was computed is delivered. Heights of non-integrable orbits multiply
with every step, so the budget is never absent by accident.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import count
from threading import get_ident
from typing import TYPE_CHECKING, Any

from flint import fmpq

from kahanmaps.algebra.etale import EtaleAlgebra
from kahanmaps.algebra.fields import QQ, BallField, Field, integer
from kahanmaps.display_protocols import HtmlDisplay, shorten
from kahanmaps.errors import InputError, PrecisionLost, SingularStep, counted
from kahanmaps.maps.implicit import Map, det_of
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.relations.rational_orbit import RationalOrbit

# Normal forms are loaded where they are used: an orbit by single steps, which most are, starts in half the time.
if TYPE_CHECKING:
    from kahanmaps.family.system_normal_form import SystemNormalForm
    from kahanmaps.maps.normal_form.iterate import NthIterate
    from kahanmaps.maps.normal_form.planes_point import PlanesPoint

DEFAULT_MAX_DIGITS = 200_000
LONGEST_INPUT = 10_000  # digits of eps and of the start, unless --max-digits says more
FIRST_POINTS = 3  # that an orbit remembers
_DIGITS_PER_BIT = 0.30103


@dataclass(frozen=True)
class OrbitEnd:
    """How an orbit ended.

    `status` is "completed", "periodic" (completed, and the start came back), "singular", "budget", "precision"
    (balls too wide), "overflow" (machine floats) or "interrupted"; `steps` is the number of the last point, delivered
    or left out as not wanted. Modulo p a birational map need not be injective: an orbit may run into a cycle that its
    start is not on, and is then "completed".
    """

    status: str
    steps: int
    message: str
    period: int | None = None

    @property
    def is_whole(self) -> bool:
        """Whether every step that was asked for has been delivered."""
        return self.status in ("completed", "periodic")

    @property
    def text(self) -> str:
        """How it ended, in a sentence that says it once."""
        return self.message if self.message.startswith(self.status) else f"{self.status}: {self.message}"

    def to_json(self) -> dict[str, Any]:
        """Its fields; the period where there is one."""
        return {name: value for name, value in asdict(self).items() if value is not None}


class OrbitPoint:
    """The point after `step` steps; coordinates over Q are reduced to lowest terms only when `x` is asked for."""

    def __init__(self, step: int, field: Field, value: IntegerPoint | PlanesPoint | tuple[Any, ...]) -> None:
        self.step = step
        self.field = field
        self.value = value

    @cached_property
    def x(self) -> tuple[Any, ...]:
        """The coordinates, elements of the field."""
        return self.value if isinstance(self.value, tuple) else self.value.rationals()

    @property
    def text(self) -> list[str]:
        """The coordinates as text that parses back (over Q cheaper than `x`: no fraction has to be formed)."""
        if isinstance(self.value, tuple):
            return [self.field.format(entry) for entry in self.x]
        return [str(above) if below == 1 else f"{above}/{below}" for above, below in self.value.lowest_terms()]

    @property
    def digits(self) -> int:
        """About how many decimal digits the largest integer over the common denominator has (0 unless over Q)."""
        return 0 if isinstance(self.value, tuple) else _digits(self.value.bits)

    def __repr__(self) -> str:
        return f"OrbitPoint({self.step}: {','.join(shorten(text, 60) for text in self.text)})"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, OrbitPoint):
            return NotImplemented
        return (self.step, self.field, self.x) == (other.step, other.field, other.x)

    __hash__ = None  # type: ignore[assignment]  # residues have no hash


class _GivenUp(Exception):
    """Raised by `Orbit.interrupt` in the thread that computes an iterate directly."""


class Orbit(HtmlDisplay):
    """The orbit of `start` under a map, or some iterates of it: iterate over it once, then look at `end`.

    `start` is a sequence of exact numbers, `steps` how many steps to take (None: no limit, even after the start came
    back), `backward` steps by the inverse map. `max_digits` bounds the decimal digits of the integers over one common
    denominator (over Q). With a `normal_form` (family.system_normal_form) the orbit is walked in normal form: over
    Q plane by plane; over balls every point directly, so that balls do not widen from step to step. Points that are not
    `wanted` are left out where that saves time. With a normal form and the steps `at`, each of these iterates is
    reached directly, not by way of those before it; poles on the way are passed over then, except over Q. `first` and
    `last` are the first points and the last one that were delivered so far.

    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> from kahanmaps.maps.kahan import KahanMap
    >>> orbit = Orbit(KahanMap(QuadraticSystem.from_text(["x"], ["x^2"]), "1/2"), ["1/5"], 3)
    >>> [point.text for point in orbit]
    [['1/5'], ['1/4'], ['1/3'], ['1/2']]
    >>> orbit.end.status
    'completed'
    >>> from kahanmaps.algebra.fields import GF
    >>> from kahanmaps.family.random_members import random_member_with_eigenvalues
    >>> from kahanmaps.family.system_normal_form import system_normal_form
    >>> system = random_member_with_eigenvalues([1, -2, 3], seed=7).chosen.system
    >>> phi, normal_form = KahanMap(system, "1/10", GF(10007)), system_normal_form(system)
    >>> [point.text for point in Orbit(phi, [1, 2, 3, 4, 5, 6], at=[10**30], normal_form=normal_form)]
    [['5212', '9799', '6471', '5788', '2175', '9896']]
    """

    def __init__(
        self,
        kahan_map: Map,
        start: Sequence[Any],
        steps: int | None = None,
        *,
        at: Iterable[int] | None = None,
        backward: bool = False,
        max_digits: int | None = DEFAULT_MAX_DIGITS,
        normal_form: SystemNormalForm | None = None,
        wanted: Callable[[int], bool] | None = None,
    ) -> None:
        self.at = None if at is None else sorted(set(at))
        for number in [steps] if self.at is None else self.at:
            require_steps(number)
        if max_digits is not None and max_digits < 1:
            raise InputError(f"found a budget of {max_digits} digits, expected at least 1")
        self.map = kahan_map.inverse if backward else kahan_map
        self.start = kahan_map.point(start)
        self.steps = steps
        self.backward = backward
        self.max_digits = max_digits
        self.normal_form = normal_form
        self._wanted = wanted
        self._jump: NthIterate | None = None
        if normal_form is not None and (at is not None or isinstance(self.map.field, BallField)):
            from kahanmaps.maps.normal_form.iterate import NthIterate

            self._jump = NthIterate(normal_form, self.map.eps, self.map.field)
        elif at is not None:
            raise InputError("found at= without a normal form: only there iterates are reached directly")
        self.end: OrbitEnd | None = None
        self.first: list[OrbitPoint] = []  # up to FIRST_POINTS of them
        self.last: OrbitPoint | None = None
        self._interrupted = False
        self._busy_in: int | None = None  # the thread that computes an iterate directly
        self._walk: RationalOrbit | None = None

    @property
    def relations(self) -> str | None:
        """The relations along the orbit that are in use, and from which step on; None where there are none."""
        walk = self._walk
        return None if walk is None or walk.relations is None else f"{walk.relations.name} from step {walk.since} on"

    def interrupt(self) -> None:
        """Ask a running orbit to end after the step in flight (safe to call from a signal handler).

        An iterate that is being reached directly, which may be a long one, is given up.
        """
        self._interrupted = True
        if self._busy_in == get_ident():
            raise _GivenUp

    def __iter__(self) -> Iterator[OrbitPoint]:
        self.first, self.last = [], None
        try:
            for point in self._points() if self.at is None else self._iterates(self.at):
                if len(self.first) < FIRST_POINTS:
                    self.first.append(point)
                self.last = point
                yield point
        except _GivenUp:
            self._end_interrupted(0 if self.last is None else self.last.step)
        finally:
            self._busy_in = None

    def _end_interrupted(self, step: int, period: int | None = None) -> None:
        self.end = OrbitEnd("interrupted", step, f"interrupted after step {step}", period)

    def _points(self) -> Iterator[OrbitPoint]:
        field = self.map.field
        images = self._images()
        value = start = next(images)
        step, period = 0, None
        yield OrbitPoint(0, field, value)  # the budget is for what is computed
        if bits := self._excess(value):
            self.end = OrbitEnd("budget", 0, _budget_text(0, bits, self.max_digits))
            return
        while self.steps is None or step < self.steps:
            if self._interrupted:
                self._end_interrupted(step, period)
                return
            try:
                value = next(images)
            except (SingularStep, StopIteration):
                det = det_of(self.map.denominator_name(self.backward))
                self.end = OrbitEnd("singular", step, f"{det} = 0 at step {step}: the map has no value there")
                return
            except PrecisionLost as error:
                self.end = OrbitEnd("precision", step, f"step {step + 1} cannot be decided: {error}")
                return
            if value is None:  # left out
                step += 1
                continue
            if bits := self._excess(value):
                self.end = OrbitEnd("budget", step, _budget_text(step + 1, bits, self.max_digits))
                return
            step += 1
            if period is None and field.exact and value == start:
                period = step
            yield OrbitPoint(step, field, value)
        if period is not None:
            self.end = OrbitEnd("periodic", step, f"the start came back after {counted(period, 'step')}", period)
        else:
            self.end = OrbitEnd("completed", step, counted(step, "step"))

    def _images(self) -> Iterator[Any]:
        """The start and its images; ends, or raises SingularStep, where the map has no value."""
        field = self.map.field
        if self.normal_form is not None and field is QQ:
            from kahanmaps.maps.normal_form.planes_point import NormalSteps

            yield from NormalSteps(self.normal_form, self.map.eps).points(self.start)
        elif self._jump is not None:
            value: Any = self.start
            yield value
            for step in count(1):
                try:
                    value = self._jump.value(self.start, step)
                except PrecisionLost:  # for tiny eps a step from the last point may need fewer bits
                    value = self.map.step(value)
                yield value
        elif field is QQ:
            start = IntegerPoint.from_rationals(self.start)
            walk = self._walk = RationalOrbit(self.map, start, _bits(self.max_digits), self._wanted)
            yield from walk
        else:
            value = self.start
            while True:
                yield value
                value = self.map.step(value)

    def _excess(self, value: Any) -> int:
        """The bits of a value that is beyond the budget, otherwise 0."""
        limit = _bits(self.max_digits)
        if limit is None:
            return 0
        if not isinstance(value, tuple):
            return int(value.exceeding(limit))
        if not isinstance(self.map.field, EtaleAlgebra):
            return 0
        numbers = [number for entry in value for number in entry.coefficients]
        bits = max((max(x.p.bit_length(), x.q.bit_length()) for x in numbers), default=0)
        return bits if bits > limit else 0

    def _iterates(self, at: Sequence[int]) -> Iterator[OrbitPoint]:
        """Each of these iterates directly."""
        from kahanmaps.maps.normal_form.rational_iterate import OverBudget

        assert self._jump is not None
        done = 0
        for step in at:
            if self._interrupted:
                self._end_interrupted(done)
                return
            try:
                self._busy_in = get_ident()
                value = self._jump.value(self.start, step, _bits(self.max_digits))
            except SingularStep as error:
                self.end = OrbitEnd("singular", done, f"step {step} cannot be reached: {error}")
                return
            except PrecisionLost as error:
                self.end = OrbitEnd("precision", done, f"step {step} cannot be decided: {error}")
                return
            except OverBudget as error:
                self.end = OrbitEnd("budget", done, _budget_text(error.step, error.bits, self.max_digits, step))
                return
            finally:
                self._busy_in = None
            done = step
            yield OrbitPoint(step, self.map.field, value)
        self.end = OrbitEnd("completed", done, f"{counted(len(at), 'iterate')} reached directly")


def require_short(eps: fmpq | None, start: Sequence[fmpq], max_digits: int | None) -> None:
    """Raises InputError where eps or the start is longer than anybody means, unless the budget is as long.

    The first step alone would take minutes, in calls that nothing can interrupt.
    """
    most = max(LONGEST_INPUT, max_digits or 0)
    for name, numbers in (("eps", () if eps is None else (eps,)), ("start", start)):
        digits = max((_digits(max(x.p.bit_length(), x.q.bit_length())) for x in numbers), default=0)
        if digits > most:
            raise InputError(
                f"found numbers of about {digits} digits for {name}, expected at most {most}: "
                "a larger --max-digits allows as many"
            )


def _bits(max_digits: int | None) -> int | None:
    """A budget of digits in bits."""
    return None if max_digits is None else max_digits * 100_000 // 30103


def _budget_text(step: int, bits: int | None, max_digits: int | None, wanted: int | None = None) -> str:
    """How the budget is exceeded at a step, perhaps on the way to the one that is wanted."""
    limit = "can be held" if max_digits is None else f"the budget of {max_digits} (--max-digits)"
    has = "would have longer numbers" if bits is None else f"has numbers of {counted(_digits(bits), 'digit')}, more"
    text = f"step {step} {has} than {limit}"
    return text if wanted is None or wanted == step else f"step {wanted} cannot be reached: {text}"


def _digits(bits: int) -> int:
    return int(bits * _DIGITS_PER_BIT) + 1


def require_steps(steps: int | None) -> None:
    """Raises InputError for a negative number of steps, and one that is not whole."""
    if steps is not None and integer(steps, "steps") < 0:
        raise InputError(f"found {steps} steps, expected 0 or more (for the inverse map, step backward)")
