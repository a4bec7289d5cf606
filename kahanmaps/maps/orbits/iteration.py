"""Lazy iteration of orbits x, Phi(x), Phi^2(x), ... over any exact field or over balls.

An orbit is iterated in a `for` loop; afterwards `orbit.end` says how it ended. If the orbit reaches a singular point or
the digit budget, no exception is raised: the points computed so far are yielded. Heights of nonintegrable orbits grow
by a factor in every step, so there is a default budget.
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
from kahanmaps.display_protocols import HtmlDisplay, ResultPart, shorten
from kahanmaps.errors import InputError, PrecisionLost, SingularStep, counted
from kahanmaps.maps.implicit import Map, det_of
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.relations.rational_orbit import RationalOrbit

# Normal forms are imported when they are used: most orbits do not need them, and start in half the time without them.
if TYPE_CHECKING:
    from kahanmaps.family.system_normal_form import SystemNormalForm
    from kahanmaps.maps.normal_form.iterate import NthIterate
    from kahanmaps.maps.normal_form.planes_point import PlanesPoint

DEFAULT_MAX_DIGITS = 200_000  # maximal decimal digits of the integers of a point over one common denominator
LONGEST_INPUT = 10_000  # maximal digits of eps and of the initial point, unless --max-digits is larger
FIRST_POINTS = 3  # number of points at the beginning that an orbit stores
_DIGITS_PER_BIT = 0.30103


@dataclass(frozen=True)
class OrbitEnd(ResultPart):
    """How an orbit ended.

    `status` is "completed", "periodic" (completed, and the orbit returned to its initial point), "singular", "budget",
    "precision" (balls are too wide), "overflow" (floating-point numbers) or "interrupted". `steps` is the number of
    steps taken. Modulo p a birational map need not be injective: an orbit may enter a cycle that does not contain its
    initial point; it is then "completed".
    """

    status: str
    steps: int
    message: str
    period: int | None = None

    @property
    def is_complete(self) -> bool:
        """Whether all requested steps were taken."""
        return self.status in ("completed", "periodic")

    @property
    def text(self) -> str:
        """The status with the message; the message alone if it contains the status."""
        return self.message if self.message.startswith(self.status) else f"{self.status}: {self.message}"

    def to_json(self) -> dict[str, Any]:
        """Return the fields as plain data; the period is omitted if there is none."""
        return {name: value for name, value in asdict(self).items() if value is not None}


class OrbitPoint:
    """The point after `step` steps, a sequence of its coordinates `x`.

    Over Q the coordinates are reduced to lowest terms only when they are read.
    """

    def __init__(self, step: int, field: Field, value: IntegerPoint | PlanesPoint | tuple[Any, ...]) -> None:
        self.step = step
        self.field = field
        self.value = value

    @cached_property
    def x(self) -> tuple[Any, ...]:
        """The coordinates, elements of the field."""
        return self.value if isinstance(self.value, tuple) else self.value.rationals()

    def __len__(self) -> int:
        return len(self.x)

    def __getitem__(self, index: Any) -> Any:
        return self.x[index]

    @property
    def text(self) -> list[str]:
        """The coordinates as text that can be parsed again; over Q this is faster than `x`."""
        if isinstance(self.value, tuple):
            return [self.field.format(entry) for entry in self.x]
        return [
            str(numerator) if denominator == 1 else f"{numerator}/{denominator}"
            for numerator, denominator in self.value.lowest_terms()
        ]

    @property
    def digits(self) -> int:
        """The approximate number of digits of the largest integer, over one common denominator; 0 except over Q."""
        return 0 if isinstance(self.value, tuple) else _digits_of_bits(self.value.bits)

    def __repr__(self) -> str:
        return f"OrbitPoint({self.step}: {','.join(shorten(text, 60) for text in self.text)})"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, OrbitPoint):
            return NotImplemented
        return (self.step, self.field, self.x) == (other.step, other.field, other.x)

    __hash__ = None  # type: ignore[assignment]  # residues have no hash


class _IterateInterrupted(Exception):
    """`Orbit.interrupt` was called while an iterate was computed directly; raised in the computing thread."""


class Orbit(HtmlDisplay):
    """The orbit of an initial point under a map, or some of its iterates: iterate over it once, then read `end`.

    Args:
        kahan_map: a map (not only a Kahan map), over any exact field or over balls.
        start: the initial point, a sequence of exact numbers.
        steps: the number of steps; None for no limit.
        at: the requested iterates, each computed directly from the normal form. Except over Q, poles at steps
            in between are not noticed.
        backward: whether steps are taken by the inverse map.
        max_digits: the largest number of decimal digits of the numerators and their common denominator (over Q).
        normal_form: if given (family.system_normal_form), steps are taken in the normal form: over Q plane by plane;
            over balls each point directly from the initial point, so that balls do not widen from step to step.
        is_requested: a function that returns whether a step is requested; other steps may be skipped.

    `first` is the list of the first points, `last` the last point yielded so far.

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
        is_requested: Callable[[int], bool] | None = None,
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
        self._is_requested = is_requested
        self._nth_iterate: NthIterate | None = None
        if normal_form is not None and (at is not None or isinstance(self.map.field, BallField)):
            from kahanmaps.maps.normal_form.iterate import NthIterate

            self._nth_iterate = NthIterate(normal_form, self.map.eps, self.map.field)
        elif at is not None:
            raise InputError("at= requires a normal form, by which iterates are computed directly")
        self.end: OrbitEnd | None = None
        self.first: list[OrbitPoint] = []  # at most FIRST_POINTS points
        self.last: OrbitPoint | None = None
        self._interrupted = False
        self._computing_thread: int | None = None  # the thread that computes an iterate directly
        self._rational_orbit: RationalOrbit | None = None

    def __repr__(self) -> str:
        state_text = "no point computed yet" if self.last is None else f"computed to step {self.last.step}"
        return f"<Orbit: {state_text if self.end is None else self.end.text}>"

    @property
    def relations(self) -> str | None:
        """The relations between points in use, with the first step that uses them, as text; None if there are none."""
        if self._rational_orbit is None or self._rational_orbit.relations is None:
            return None
        return f"{self._rational_orbit.relations.name} from step {self._rational_orbit.since} on"

    def interrupt(self) -> None:
        """Stop a running orbit after the current step (safe to call from a signal handler).

        If an iterate is being computed directly, which may take long, the computation is abandoned.
        """
        self._interrupted = True
        if self._computing_thread == get_ident():
            raise _IterateInterrupted

    def __iter__(self) -> Iterator[OrbitPoint]:
        self.first, self.last = [], None
        try:
            for point in self._points() if self.at is None else self._iterates_by_doubling(self.at):
                if len(self.first) < FIRST_POINTS:
                    self.first.append(point)
                self.last = point
                yield point
        except _IterateInterrupted:
            self._set_interrupted(0 if self.last is None else self.last.step)
        finally:
            self._computing_thread = None

    def _set_interrupted(self, step: int, period: int | None = None) -> None:
        self.end = OrbitEnd("interrupted", step, f"interrupted after step {step}", period)

    def _points(self) -> Iterator[OrbitPoint]:
        field = self.map.field
        images = self._images()
        value = start = next(images)
        step, period = 0, None
        yield OrbitPoint(0, field, value)  # yielded even if it exceeds the budget
        if bits := self._bits_over_budget(value):
            self.end = OrbitEnd("budget", 0, _budget_text(0, bits, self.max_digits))
            return
        while self.steps is None or step < self.steps:
            if self._interrupted:
                self._set_interrupted(step, period)
                return
            try:
                value = next(images)
            except (SingularStep, StopIteration):
                det = det_of(self.map.denominator_name(self.backward))
                self.end = OrbitEnd("singular", step, f"{det} = 0 at step {step}: the map is not defined there")
                return
            except PrecisionLost as error:
                self.end = OrbitEnd("precision", step, f"step {step + 1} cannot be decided: {error}")
                return
            if value is None:  # skipped, since the step is not requested
                step += 1
                continue
            if bits := self._bits_over_budget(value):
                self.end = OrbitEnd("budget", step, _budget_text(step + 1, bits, self.max_digits))
                return
            step += 1
            if period is None and field.exact and value == start:
                period = step
            yield OrbitPoint(step, field, value)
        if period is not None:
            self.end = OrbitEnd("periodic", step, f"back at the initial point after {counted(period, 'step')}", period)
        else:
            self.end = OrbitEnd("completed", step, counted(step, "step"))

    def _images(self) -> Iterator[Any]:
        """Yield the initial point and its images; end, or raise SingularStep, if the map is not defined at a point."""
        field = self.map.field
        if self.normal_form is not None and field is QQ:
            from kahanmaps.maps.normal_form.planes_point import NormalSteps

            yield from NormalSteps(self.normal_form, self.map.eps).points(self.start)
        elif self._nth_iterate is not None:
            value: Any = self.start
            yield value
            for step in count(1):
                try:
                    value = self._nth_iterate.value(self.start, step)
                except PrecisionLost:  # for very small eps, a step from the last point may need fewer bits
                    value = self.map.step(value)
                yield value
        elif field is QQ:
            start = IntegerPoint.from_rationals(self.start)
            max_bits = _bits_of_digits(self.max_digits)
            self._rational_orbit = RationalOrbit(self.map, start, max_bits, self._is_requested)
            yield from self._rational_orbit
        else:
            value = self.start
            while True:
                yield value
                value = self.map.step(value)

    def _bits_over_budget(self, value: Any) -> int:
        """Return the bit length of a point that exceeds the budget, otherwise 0."""
        limit = _bits_of_digits(self.max_digits)
        if limit is None:
            return 0
        if not isinstance(value, tuple):
            return int(value.exceeding(limit))
        if not isinstance(self.map.field, EtaleAlgebra):
            return 0
        numbers = [number for entry in value for number in entry.coefficients]
        bits = max((max(x.p.bit_length(), x.q.bit_length()) for x in numbers), default=0)
        return bits if bits > limit else 0

    def _iterates_by_doubling(self, at: Sequence[int]) -> Iterator[OrbitPoint]:
        """Yield the requested iterates, each computed directly."""
        from kahanmaps.maps.normal_form.rational_iterate import OverBudget

        assert self._nth_iterate is not None
        last_step = 0
        for step in at:
            if self._interrupted:
                self._set_interrupted(last_step)
                return
            try:
                self._computing_thread = get_ident()
                value = self._nth_iterate.value(self.start, step, _bits_of_digits(self.max_digits))
            except SingularStep as error:
                self.end = OrbitEnd("singular", last_step, f"step {step} cannot be reached: {error}")
                return
            except PrecisionLost as error:
                self.end = OrbitEnd("precision", last_step, f"step {step} cannot be decided: {error}")
                return
            except OverBudget as error:
                self.end = OrbitEnd("budget", last_step, _budget_text(error.step, error.bits, self.max_digits, step))
                return
            finally:
                self._computing_thread = None
            last_step = step
            yield OrbitPoint(step, self.map.field, value)
        self.end = OrbitEnd("completed", last_step, f"{counted(len(at), 'iterate')} computed directly")


def require_short(eps: fmpq | None, start: Sequence[fmpq], max_digits: int | None) -> None:
    """Raise InputError if eps or the initial point has more digits than both the budget and LONGEST_INPUT.

    For such input the first step alone would take minutes, in calls that cannot be interrupted.
    """
    max_length = max(LONGEST_INPUT, max_digits or 0)
    for name, numbers in (("eps", () if eps is None else (eps,)), ("start", start)):
        digits = max((_digits_of_bits(max(x.p.bit_length(), x.q.bit_length())) for x in numbers), default=0)
        if digits > max_length:
            raise InputError(
                f"found numbers of about {digits} digits for {name}, expected at most {max_length}: "
                "raise --max-digits to allow longer numbers"
            )


def _bits_of_digits(max_digits: int | None) -> int | None:
    """Convert a budget of decimal digits to bits."""
    return None if max_digits is None else max_digits * 100_000 // 30103


def _budget_text(step: int, bits: int | None, max_digits: int | None, requested: int | None = None) -> str:
    """Return a sentence saying that a step, perhaps one before the requested step, exceeds the budget."""
    limit_text = "can be held" if max_digits is None else f"the budget of {max_digits} (--max-digits)"
    size_text = "would have longer numbers"
    if bits is not None:
        size_text = f"has numbers of {counted(_digits_of_bits(bits), 'digit')}, more"
    text = f"step {step} {size_text} than {limit_text}"
    return text if requested is None or requested == step else f"step {requested} cannot be reached: {text}"


def _digits_of_bits(bits: int) -> int:
    return int(bits * _DIGITS_PER_BIT) + 1


def require_steps(steps: int | None) -> None:
    """Raise InputError unless the number of steps is an integer >= 0 or None."""
    if steps is not None and integer(steps, "steps") < 0:
        raise InputError(f"found {steps} steps, expected 0 or more (for the inverse map, step backward)")
