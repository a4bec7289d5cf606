"""The n-th iterate over Q, unless the orbit reaches a pole or exceeds its budget before step n.

An orbit is computed exactly while its numbers are short. Afterwards the step at which a computation by single steps
would end (at a pole or over the budget) is determined as follows.

* Heights are computed at a few steps, at increasing distances. Up to O(1) they are convex functions of the step
  (polynomials of degree 2, or linear). So if the height is within the budget at two steps, it is within the budget in
  between. If heights rise, extrapolation gives a step at which the budget is surely exceeded: no later step matters.
* Poles up to this step are found modulo random primes of 61 bits (a pole over Q is one modulo each prime) and verified.
* If the orbit in a plane is periodic, or its level is parabolic, its poles are known for all steps together, and its
  numbers stay short. If this holds for all planes, any n can be reached.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from itertools import islice
from typing import Any

from flint import fmpq, nmod

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.residues import random_prime
from kahanmaps.errors import SingularStep
from kahanmaps.family.system_normal_form import SystemNormalForm
from kahanmaps.maps.normal_form import tau, translation
from kahanmaps.maps.normal_form.periods import PeriodKind, plane_period_over_rationals
from kahanmaps.maps.normal_form.planar_block import PlanarBlock, Triple, same_point
from kahanmaps.maps.normal_form.planes_point import Block, NormalSteps, PlanesPoint

_RISE = 16  # number of steps over which a rise of the heights is more than a fluctuation
_EXACT_STEPS = 256  # number of steps that are first computed exactly,
_EXACT_BITS = 8192  # as long as the numbers have at most this bit length
_SINGLE_STEPS = 24  # up to this step, single steps are used in a plane
_PRIMES = 20  # number of random primes modulo which a pole is searched for
# The default limits: longer numbers take minutes; so many steps modulo a prime take less time than long numbers.
_MAX_BITS, _MAX_MODULAR_STEPS = 1 << 28, 250_000


class OverBudget(Exception):
    """The numbers of an orbit exceed the budget at `step` or before; at `step` they have `bits` bits, if not None."""

    def __init__(self, step: int, bits: int | None) -> None:
        self.step, self.bits = step, bits
        super().__init__(step, bits)


class OrbitInPlanes:
    """The orbit of an initial point over Q, with direct access to its iterates; poles at earlier steps are detected.

    Points in each plane are triples of integers or of short elements of Z[t], computed from tables of psi and chi.
    """

    def __init__(self, normal_form: SystemNormalForm, eps: Any, start: Sequence[Any], max_bits: int | None) -> None:
        steps = NormalSteps(normal_form, eps)
        x = [QQ.convert(entry) for entry in start]
        self._blocks, self._assembly = steps.blocks(x)
        triples = steps.splitting.triples(x)
        self._planes = [_Plane(plane.block, P) for plane, P in zip(steps.splitting.planes, triples, strict=True)]
        self._numbers_stay_short = all(plane.numbers_stay_short for plane in self._planes)
        self._limit = _MAX_BITS if max_bits is None else max_bits
        self._end_error: SingularStep | OverBudget | None = None
        self._period: int | None = None
        self._first_points: list[PlanesPoint] = []  # the points of the first steps, computed exactly
        for step, value in enumerate(steps.points(x)):
            bits = value.exceeding(self._limit)
            if step == 0 or not bits:
                self._first_points.append(value)  # step 0 is not charged to the budget: the user gave this point
            if bits:
                self._end_error = OverBudget(step, bits)
                break
            if step > 0 and value == self._first_points[0]:
                self._period = step
                break
            if step == _EXACT_STEPS or value.bits > _EXACT_BITS:
                break
        else:
            self._end_error = _undefined_step(len(self._first_points) - 1)
        self._last_reachable_step = (
            len(self._first_points) - 1
        )  # the last step known to be within the budget and before all poles

    def value(self, n: int) -> PlanesPoint:
        """Return Phi^n(start). Raises SingularStep or OverBudget, whichever belongs to the earlier step."""
        if n < len(self._first_points):
            return self._first_points[n]
        if self._end_error is not None:
            raise self._end_error
        if self._period is not None:
            return self._first_points[n % self._period]
        step, value, bits = self._step_within_budget(n)
        pole = self._first_pole(step, value)
        if pole is not None:
            preimage = self._point(pole - 1)
            if excess_bits := preimage.exceeding(self._limit):
                raise OverBudget(pole - 1, excess_bits)
            raise _undefined_step(pole - 1)
        if bits != 0:
            raise OverBudget(step, bits)
        if value is None:
            raise ArithmeticError("an iterate is a pole over Q, but not modulo any prime: please report this")
        self._last_reachable_step = max(self._last_reachable_step, n)
        return value

    def _step_within_budget(self, n: int) -> tuple[int, PlanesPoint | None, int | None]:
        """Return (n, Phi^n(start), 0), or for a step over the budget (step, its point, its bits or None if unknown).

        The point is None if it was not computed. For a pole at step k the result is (k, None, 0).
        """
        step = max(1, min(self._last_reachable_step, n - 1))
        target_step = n if self._numbers_stay_short else _halve_above(n, step)
        previous: tuple[int, int] | None = None
        while True:
            try:
                value = self._point(target_step)
            except SingularStep:
                return target_step, None, 0
            bits = value.exceeding(self._limit)
            if target_step == n or bits:
                return target_step, value, bits
            current = target_step, value.bits
            if previous is not None and current[0] - previous[0] >= _RISE and current[1] > previous[1]:
                # Linear extrapolation, up to four times the budget, where the budget is certainly exceeded.
                surely_exceeded_after = 1 + 4 * self._limit * (current[0] - previous[0]) // (current[1] - previous[1])
                if surely_exceeded_after <= min(n - target_step, _MAX_MODULAR_STEPS):
                    return target_step + surely_exceeded_after, None, None
            previous = current
            # Heights may grow like n^2: the step is doubled only if four times the height is within the budget.
            target_step = (
                _halve_above(n, target_step)
                if 4 * current[1] <= self._limit
                else min(n, target_step + target_step // 2)
            )

    def _point(self, n: int) -> PlanesPoint:
        """Return Phi^n(start), ignoring poles at earlier steps. Raises SingularStep if step n is a pole."""
        triples = [
            _point_in_plane(block, plane.reduced_step(n))
            for block, plane in zip(self._blocks, self._planes, strict=True)
        ]
        if any(W == 0 for _, _, W in triples):
            raise _undefined_step(n - 1)
        return PlanesPoint(self._assembly, triples)

    def _first_pole(self, n: int, value: PlanesPoint | None) -> int | None:
        """Return the first undefined step up to n; `value`, the n-th point, serves as a check modulo a prime."""
        known_poles = [plane.pole for plane in self._planes if plane.pole is not None and plane.pole <= n]
        undecided_planes = [i for i, plane in enumerate(self._planes) if not plane.numbers_stay_short]
        rng = random.Random(f"first pole {n}")  # the same primes, hence the same work, on every machine
        for _ in range(_PRIMES):
            poles: list[int] = []
            for i in undecided_planes:
                block, residue_map = self._blocks[i], None
                while residue_map is None:  # find a homomorphism to the residues modulo a random prime
                    residue_map = block.residue_map(random_prime(rng))
                pole, point = _steps_modulo(block, n, residue_map)
                if pole is None:
                    if value is not None and not same_point(list(map(residue_map, value.triples[i])), point):
                        raise ArithmeticError("the iterate disagrees with the orbit modulo a prime: please report this")
                    continue
                try:
                    is_pole = _point_in_plane(block, pole)[2] == 0
                except SingularStep:
                    is_pole = True
                if not is_pole:  # not a pole over Q: the prime divides W at this step
                    break
                poles.append(pole)
            else:
                return min([*known_poles, *poles], default=None)
        raise ArithmeticError("the orbit meets a pole modulo many primes, but not over Q: please report this")


def _halve_above(n: int, step: int) -> int:
    """Return the least of n, n/2, n/4, ... (rounded down) above `step`; a tau table for n has the values there."""
    while n >> 1 > step:
        n >>= 1
    return n


def _undefined_step(step: int) -> SingularStep:
    return SingularStep(f"the map is not defined at step {step}")


class _Plane:
    """The data of the orbit in one plane for all steps: whether its numbers stay short, its period and its pole.

    The numbers stay short if the orbit returns after `period` steps, or if its level is parabolic (`period` is None).
    In both cases `pole` is the first undefined step, or None.
    """

    def __init__(self, block: PlanarBlock, start: Triple) -> None:
        period = plane_period_over_rationals(block, start)
        self.period = period.period
        self.numbers_stay_short = period.period is not None or period.kind in (
            PeriodKind.ADDITIVE,
            PeriodKind.UNDEFINED,
        )
        self.pole: int | None = None
        if period.kind is PeriodKind.UNDEFINED:
            self.pole = 1
        elif period.kind is PeriodKind.ADDITIVE:
            r = translation.parabolic_ratio(block, start)
            if not (r is None or isinstance(r, fmpq)):  # an element of a number field, perhaps rational
                r = r.coefficients[0] if not any(entry != 0 for entry in r.coefficients[1:]) else None
            self.pole = int(r.p) if r is not None and r.q == 1 and r > 0 else None
        elif period.period is not None and period.meets_pole is not False:
            try:
                point_by_steps(block, start, period.period)
            except _Pole as pole:
                self.pole = pole.step

    def reduced_step(self, n: int) -> int:
        """Return a smaller step at which the orbit has the same point."""
        return n if self.period is None else n % self.period


class _Pole(SingularStep):
    """A pole of the orbit. Attribute: `step`, the first undefined step."""

    def __init__(self, step: int) -> None:
        self.step = step
        super().__init__(f"the map is not defined at step {step - 1}")


def point_by_steps(block: PlanarBlock, start: Triple, n: int) -> Triple:
    """Return P_n over a field, computed step by step. Raises _Pole if a step is undefined."""
    point = start
    for k in range(n):
        U, V, W = block.image(point)
        if W == 0:
            raise _Pole(k + 1)
        point = (U / W, V / W, W / W)
    return point


def _point_in_plane(block: Block, n: int) -> Triple:
    """Return P_n, ignoring poles at earlier steps; if single steps are needed, a pole raises SingularStep."""
    if n <= _SINGLE_STEPS or block.is_constant or block.level is None:
        points = list(islice(tau.triples(block), n + 1))
        if len(points) <= n:
            raise _undefined_step(len(points) - 1)
        return points[n]
    point = tau.iterate(block, n)
    if point is not None:
        return point
    over_field, (U, V, W), _ = block.lifts
    start = (U / W, V / W, W / W)
    try:
        triple = translation.iterate(over_field, start, n, lambda element: element == 0)
    except translation.NoTranslation:
        triple = point_by_steps(over_field, start, n)
    return block.integral(triple)


def _steps_modulo(block: Block, n: int, residue_map: Callable[[Any], nmod]) -> tuple[int | None, Triple]:
    """Return (None, P_n) modulo a prime, or (k, P_k) for the first step k at which W vanishes modulo the prime."""
    cubic = block.block
    block_modulo_prime = PlanarBlock(*map(residue_map, (cubic.a, cubic.b, cubic.c, cubic.d)))
    point: Triple = tuple(map(residue_map, block.start))  # type: ignore[assignment]  # a tuple of three
    for k in range(1, n + 1):
        point = block_modulo_prime.image(point)
        if point[2] == 0:
            return k, point
    return None, point
