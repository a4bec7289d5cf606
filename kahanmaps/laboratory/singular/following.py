"""The singularity pattern of an exceptional hypersurface: multiplicities at its images after 1, 2, ... steps.

A curve through a generic point of the hypersurface is a power series in t. After each step a power of t is divided out.
Its exponent mu is the multiplicity of the indeterminacy locus at the image. The multiplicities nu of the critical
hypersurfaces are the orders in t of their forms along the image. Steps are computed until the pattern settles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice
from typing import Any, Protocol

from flint import fmpz_poly, nmod_poly

from kahanmaps.algebra.work import Budget
from kahanmaps.laboratory.growth.recurrences import find_recurrence
from kahanmaps.laboratory.singular.jets import (
    Function,
    JetStep,
    MapSequence,
    NotGeneric,
    PrecisionTooLow,
    equations_of,
    image_of,
    images_of_curve,
    orders_of,
)
from kahanmaps.maps.equation import Equation

_MAX_PRECISION = 4096  # maximal number of terms of a series
# Limits for the number of terms of series, the second one for patterns that need more terms than the first allows.
_FIRST_PRECISION, _LONG_PRECISION = 512, 2048
_MIN_ROWS = 8  # a pattern settles if at least so many last rows are zero, or so many rows satisfy a recurrence
_CONFIRMING_ORDERS = 4  # number of terms that must satisfy a recurrence, beyond those that determine it
_STEPS_AFTER_FIRST = 100  # number of steps, after the first steps, for which a confined hypersurface is followed
_SHOWN_EVENTS = 6  # maximal number of events in a sentence

Fraction = tuple[fmpz_poly, fmpz_poly]  # numerator and denominator


@dataclass(frozen=True)
class OrbitData:
    """A singularity pattern: for each step the power mu of t that is divided out and the orders nu_k of hypersurfaces.

    If `is_settled`, the rows (mu, nu_1, ...) are known for all steps. Either the columns satisfy `recurrences`, given
    by characteristic polynomials. Or `continues_as` is (T, j): after T steps the image is the hypersurface j (from 0),
    whose pattern continues this one. Or all later rows up to the step `followed` are zero, except for unknown
    multiplicities of the hypersurfaces `eventually_in`, in which images lie again and again.
    """

    rows: tuple[tuple[int, ...], ...]
    recurrences: tuple[fmpz_poly, ...] = ()
    followed: int = 0
    is_settled: bool = False
    continues_as: tuple[int, int] | None = None
    eventually_in: tuple[int, ...] = ()

    @property
    def compared(self) -> tuple[object, ...]:
        """The rows and other data that must agree for two points of the same hypersurface."""
        return self.rows[: 2 * self.settled_at], self.is_settled, self.continues_as, self.eventually_in

    @cached_property
    def settled_at(self) -> int:
        """The step after which all later rows follow from earlier ones."""
        if self.recurrences:
            return max(int(characteristic.degree()) for characteristic in self.recurrences)
        return len(self.rows)

    @property
    def sentences(self) -> list[str]:
        """Two phrases: on steps at which the degree drops; on the exceptional hypersurfaces in which images lie."""
        rows = self.rows[: self.settled_at]
        drops = [f"{row[0]} at step {t}" for t, row in enumerate(rows, 1) if row[0]]
        incidences = [
            f"C{j} at step {t}" + (f" (multiplicity {nu})" if nu > 1 else "")
            for t, row in enumerate(rows, 1)
            for j, nu in enumerate(row[1:], 1)
            if nu
        ]
        if self.eventually_in:
            names = ", ".join(f"C{k + 1}" for k in self.eventually_in)
            incidences.append(f"{names} at all later steps, which lowers no degree")
        drops_text = f"lowers the degree by {_shorten(drops)}" if drops else "lowers no degree"
        return [drops_text, f"its image lies in {_shorten(incidences) or 'no exceptional hypersurface'}"]

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "degree_drops": [row[0] for row in self.rows],
            "incidences": [list(row[1:]) for row in self.rows],
            "recurrences": [[str(c) for c in characteristic.coeffs()] for characteristic in self.recurrences],
            "is_settled": self.is_settled,
            "eventually_in": [f"C{k + 1}" for k in self.eventually_in],
            "continues_as": None
            if self.continues_as is None
            else {"steps": self.continues_as[0], "hypersurface": f"C{self.continues_as[1] + 1}"},
        }

    def of(self, hypersurfaces: Sequence[int]) -> OrbitData:
        """Return the data with mu and the columns of these hypersurfaces only."""
        columns = [0, *(1 + k for k in hypersurfaces)]  # the columns of mu and of the given hypersurfaces
        rows = tuple(tuple(row[k] for k in columns) for row in self.rows)
        return replace(self, rows=rows, recurrences=tuple(self.recurrences[k] for k in columns if self.recurrences))

    def generating_function(self, column: int) -> Fraction:
        """Return the generating function of a column (the entries times z, z^2, ...), without a continuation.

        >>> OrbitData(((1,), (2,), (4,)), (fmpz_poly([-2, 1]),)).generating_function(0)
        (x, (-2)*x + 1)
        """
        entries = [row[column] for row in self.rows]
        if not self.recurrences:
            return fmpz_poly([0, *entries]), fmpz_poly([1])
        characteristic = self.recurrences[column]
        order = int(characteristic.degree())
        denominator = fmpz_poly(characteristic.coeffs()[::-1])
        numerator = (denominator * fmpz_poly(entries[:order])).truncate(order)
        return fmpz_poly([0, 1]) * numerator, denominator


def _shorten(events: Sequence[str]) -> str:
    return ", ".join(events[:_SHOWN_EVENTS]) + (", ..." if len(events) > _SHOWN_EVENTS else "")


NO_ORBIT_DATA = OrbitData(())


class AlongCurves(Protocol):
    """Functions whose orders are measured along a curve, and the rows of `OrbitData` computed from these orders."""

    @property
    def functions(self) -> tuple[Function, ...]:
        """The functions, as arguments of `images_of_curve`."""

    def rows(self, run: Sequence[JetStep]) -> tuple[tuple[int, ...], ...]:
        """Return rows (power of t that is divided out, orders of hypersurfaces) for all steps, or all but the last."""


@dataclass(frozen=True)
class TrackedFunctions:
    """Functions whose orders are measured along curves through a hypersurface.

    The minors of the equation of the map have a common factor, which is not part of the map; `common_exponents` are the
    exponents of the functions in this factor. `initial_orders` are the orders on the hypersurface: 1 for its own form,
    0 for others. The first `critical` functions are forms of exceptional hypersurfaces.
    """

    functions: tuple[Function, ...] = ()
    common_exponents: tuple[int, ...] = ()
    initial_orders: tuple[int, ...] = ()
    critical: int = 0

    def rows(self, run: Sequence[JetStep]) -> tuple[tuple[int, ...], ...]:
        """Return the rows of `OrbitData`; without functions, return `common` and `denominator` of each step instead."""
        if not self.functions:
            return tuple((step.common, step.denominator or 0) for step in run)
        pairs = zip(divided_powers(run, self.initial_orders, self.common_exponents), run, strict=True)
        return tuple((mu, *step.orders[: self.critical]) for mu, step in pairs)


def divided_powers(run: Sequence[JetStep], initial_orders: Sequence[int], common_exponents: Sequence[int]) -> list[int]:
    """Return, for each step, the power of t that is divided out, without that in the common factor of the minors.

    This factor is not part of the map. It is a product of the functions whose orders are measured; their exponents are
    `common_exponents`. `initial_orders` are the orders of the functions before the first step.
    """
    orders_before = [initial_orders, *(step.orders for step in run)]
    return [
        step.common - sum(k * order for k, order in zip(common_exponents, orders, strict=True))
        for step, orders in zip(run, orders_before, strict=False)
    ]


NOTHING_TRACKED = TrackedFunctions()


@dataclass(frozen=True)
class StepLimits:
    """Limits for the number of steps: `first_steps` steps with series at the beginning, and `max_steps` steps in all.

    A singularity can be confined only where the image lies in the indeterminacy locus. After the first steps only the
    orbit of a point of the image is computed, which is fast. If this point reaches the locus, series are computed
    again, which is slow, for at most `series_steps` steps. If multiplicities repeat and every step loses terms of the
    series, the limit is `repeating_steps`. The computation stops when the `budget` is spent.
    """

    first_steps: int
    max_steps: int
    series_steps: int
    budget: Budget
    repeating_steps: int


@dataclass(frozen=True)
class TestCurve:
    """The curve point + t direction over GF(p), the equations of a map, and the functions tracked along its images."""

    equations: Sequence[Equation]
    point: Sequence[int]
    direction: Sequence[int]
    limits: StepLimits
    tracked: AlongCurves = NOTHING_TRACKED

    @property
    def prime(self) -> int:
        """The prime modulo which the curve is computed."""
        return self.equations[0].over.characteristic

    def steps(
        self, count: int, tangents: Sequence[Sequence[int]] = (), max_precision: int = _MAX_PRECISION
    ) -> tuple[list[JetStep], bool]:
        """Return (steps, whether all `count` steps were possible within budget and precision); series are long enough.

        If `tangents` are given, no function is tracked.
        """
        precision = 8
        functions = () if tangents else self.tracked.functions
        arguments = self.equations, self.point, self.direction
        while True:
            run: list[JetStep] = []
            try:
                for step in islice(images_of_curve(*arguments, precision, tangents, functions), count):
                    run.append(step)
                    if self.limits.budget.is_spent:
                        return run, len(run) == count
                return run, True
            except PrecisionTooLow:
                if precision >= max_precision or self.limits.budget.is_spent:
                    return run, False
                precision = min(max_precision, max(2 * precision, 8 + precision * count // max(1, len(run))))

    def all_steps(self, count: int, tangents: Sequence[Sequence[int]] = ()) -> tuple[JetStep, ...]:
        """Return `count` steps. Raises PrecisionTooLow if only fewer steps are possible within budget and precision."""
        run, is_complete = self.steps(count, tangents)
        if not is_complete:
            raise PrecisionTooLow
        return tuple(run)

    def orbit_data_until_return(self, return_step: int) -> OrbitData:
        """Return the orbit data along a curve; its hypersurface has a hypersurface as image at step `return_step`.

        If an image is a critical hypersurface, later orders are those of the pattern of this hypersurface.
        """
        step_count = self.limits.first_steps
        max_steps = min(self.limits.max_steps, step_count + _STEPS_AFTER_FIRST)
        while True:
            run = self.all_steps(step_count)
            rows = self.tracked.rows(run)
            for t, (_, *nu) in enumerate(rows, 1):
                if t >= return_step and any(nu) and self.tracked.functions:
                    if sorted(nu)[-2:] not in ([1], [0, 1]):
                        raise NotGeneric("a point on several critical hypersurfaces")
                    return OrbitData(rows[:t], (), t, True, (t, nu.index(1)))
            event, last_step = self._next_event(run[-1].limit, len(run), max_steps)
            if event is None or not self.tracked.functions:  # no orders are needed after the return
                return OrbitData(rows[:return_step], (), last_step, True)
            step_count = event

    def orbit_data(self, first_steps: int) -> OrbitData:
        """Return the orbit data along the curve; steps are added until the data are settled or a limit is reached.

        The computation begins with `first_steps` steps. The image may stay in a critical hypersurface for many steps
        before it meets another one; so a recurrence is accepted only if it holds for all steps that the limits allow.
        """
        step_count, limits, max_precision = first_steps, self.limits, _FIRST_PRECISION
        while True:
            run, is_complete = self.steps(step_count, max_precision=max_precision)
            rows = self.tracked.rows(run)
            last_nonzero = max((k for k, row in enumerate(rows, 1) if any(row)), default=0)
            event = None
            if is_complete and len(rows) - last_nonzero >= _MIN_ROWS:
                event, last_step = self._next_event(run[-1].limit, len(run), limits.max_steps)
                if event is None:
                    return OrbitData(rows[:last_nonzero], (), last_step, True)
            recurrences = [find_recurrence(column) for column in zip(*rows, strict=True)]
            is_recurrent = all(
                recurrence is not None and len(rows) >= max(_MIN_ROWS, 2 * recurrence.order + _CONFIRMING_ORDERS)
                for recurrence in recurrences
            )
            is_cut = not is_complete and not limits.budget.is_spent  # the maximal precision did not suffice
            is_long = len(run) >= min(limits.max_steps, limits.series_steps)
            if (
                rows
                and is_recurrent
                and (is_long or (is_cut and (max_precision == _LONG_PRECISION or len(rows) >= limits.repeating_steps)))
            ):
                polynomials = tuple(recurrence.characteristic for recurrence in recurrences if recurrence is not None)
                row_count = max(_MIN_ROWS, *(2 * int(polynomial.degree()) for polynomial in polynomials))
                return OrbitData(rows[:row_count], polynomials, len(run), True)
            if is_cut and max_precision < _LONG_PRECISION:
                max_precision *= 2
                continue
            step_limit = min(limits.max_steps, max(limits.series_steps, 2 * (event or 0)))
            if rows and is_cut and (hypersurfaces := self._find_incidences(run[-1].limit)) is not None:
                other_steps = (
                    t
                    for t, (mu, *nu) in enumerate(rows, 1)
                    if mu or any(order for k, order in enumerate(nu) if k not in hypersurfaces)
                )
                return OrbitData(rows[: max(other_steps, default=1)], (), limits.max_steps, True, None, hypersurfaces)
            if not is_complete or step_count >= step_limit:
                return OrbitData(rows, (), len(rows), False)
            step_count = step_limit

    def _find_incidences(self, point: Sequence[int]) -> tuple[int, ...] | None:
        """Return the indices of the critical hypersurfaces that a periodic orbit meets; None if it is not periodic.

        Also returns None if the orbit contains an indeterminacy point, where a power of t would be divided out. To
        detect such points, the map is evaluated along lines in the direction of the curve.
        """
        tracked, p = self.tracked, self.prime
        if not isinstance(tracked, TrackedFunctions) or isinstance(self.equations, MapSequence):
            return None
        point, visited_points, incident_hypersurfaces = _normalize_point(point, p), set[tuple[int, ...]](), set[int]()
        for _ in range(self.limits.max_steps):
            visited_points.add(point)
            line = [nmod_poly([x, v], p) for x, v in zip(point, self.direction, strict=True)]
            orders_here = [function(line, _MAX_PRECISION) for function in tracked.functions]
            run = replace(self, point=point).steps(1)[0]
            if not run or None in orders_here:
                return None
            ((mu, *orders),) = replace(tracked, initial_orders=tuple(k or 0 for k in orders_here)).rows(run)
            if mu:
                return None
            point = _normalize_point(run[0].limit, p)
            incident_hypersurfaces |= {k for k, order in enumerate(orders) if order}
            if point in visited_points:
                return tuple(sorted(incident_hypersurfaces))
        return None

    def _next_event(self, limit: Sequence[int], first_step: int, max_step: int) -> tuple[int | None, int]:
        """Iterate a point until the next step at which the map is undefined or a tracked function is zero.

        Returns this step (None if it is not reached) and the last computed step, at most `max_step`.
        """
        point: Sequence[int] = limit
        for step in range(first_step + 1, max_step + 1):
            image = image_of(equations_of(self.equations, step), point)
            if image is None:
                return step, step
            point = image
            constants = [nmod_poly([x], self.prime) for x in point]
            if None in orders_of(self.equations, self.tracked.functions, step, constants, 1):
                return step, step
            if self.limits.budget.is_spent:
                return None, step
        return None, max_step


def _normalize_point(point: Sequence[int], p: int) -> tuple[int, ...]:
    """Return the homogeneous coordinates of a point, divided by the first nonzero one."""
    inverse = pow(next(x for x in point if x), -1, p)
    return tuple(x * inverse % p for x in point)
