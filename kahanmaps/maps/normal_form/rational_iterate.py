"""The n-th iterate over Q, and what an orbit over Q comes to first: a pole, the end of its budget, or step n.

An orbit is stepped exactly while its numbers are short. From there on three things decide, and the order of events is
that of an orbit which is stepped all the way.

* Heights are known at a few steps, farther and farther apart. But for O(1) they are convex in the step (a polynomial
  of degree 2, or linear), so what is within the budget at both ends is so in between, and from a rise it follows where
  the budget is exceeded at the latest; beyond that step nothing has to be known.
* Poles up to there are found modulo random primes of 61 bits and put to the test over Q: a pole over Q is one modulo
  every prime.
* A plane that comes back, or moves on a parabolic level, is no burden: its poles are known for all steps at once, and
  its numbers stay short. If all planes do so, any n is within reach.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Any, Protocol

from flint import fmpq, fmpz

from kahanmaps.algebra.fields import GF, QQ
from kahanmaps.errors import BadPrime, SingularStep
from kahanmaps.family.structure import Structure
from kahanmaps.maps.integer_steps import IntegerPoint
from kahanmaps.maps.normal_form import tau_table, translation
from kahanmaps.maps.normal_form.periods import Kind, plane_period_over_rationals
from kahanmaps.maps.normal_form.planar_block import PlanarBlock, Triple, same_point
from kahanmaps.maps.normal_form.planar_integers import IntegerBlock, IntegerTriple, primitive
from kahanmaps.maps.normal_form.planes_point import PlanesPoint
from kahanmaps.maps.normal_form.splitting import Splitting
from kahanmaps.maps.normal_form.steps import NormalSteps

_RISE = 16  # steps over which a rise of the heights is more than a fluctuation
_WALKED = 256  # steps taken exactly at first,
_LIGHT = 8192  # as long as the numbers have at most so many bits
_SHORT = 24  # up to here a plane is stepped
_PRIMES = 20

Value = PlanesPoint | tuple[Any, ...]


class OverBudget(Exception):
    """The orbit has numbers longer than allowed at `step` or before, of `bits` bits there; None: not computed."""

    def __init__(self, step: int, bits: int | None) -> None:
        self.step, self.bits = step, bits
        super().__init__(step, bits)


class _Planes(Protocol):
    """An orbit in all planes: split into planes over Q, or over extensions."""

    lazy: bool
    most_bits: int  # where no limit is given: longer numbers take minutes
    looked: int  # steps modulo a prime that are cheaper than long numbers

    def walk(self) -> Iterator[Value]: ...

    def point(self, n: int) -> Value: ...

    def height(self, value: Value, limit: int) -> int: ...

    def bits(self, value: Value) -> int: ...

    def first_pole(self, n: int, value: Value | None) -> int | None: ...


class RationalOrbit:
    """The orbit of a start over Q, any iterate of it directly; no pole on the way goes unnoticed."""

    def __init__(self, structure: Structure, eps: Any, start: Sequence[Any], max_bits: int | None) -> None:
        splitting = Splitting(structure.form, QQ, eps, structure.T)
        x = [QQ.convert(entry) for entry in start]
        is_split = all(plane.degree == 1 for plane in splitting.planes)
        self._planes: _Planes = (_SplitPlanes if is_split else _AlgebraPlanes)(structure, splitting, x)
        self._limit = self._planes.most_bits if max_bits is None else max_bits
        self._end: SingularStep | OverBudget | None = None
        self._period: int | None = None
        self._walked: list[Value] = []
        self._walk()
        self._far = len(self._walked) - 1  # the last step that is known to be within the budget and before all poles

    def value(self, n: int) -> Value:
        """Phi^n(start). Raises SingularStep or OverBudget, whichever an orbit that is stepped comes to first."""
        if n < len(self._walked):
            return self._walked[n]
        if self._end is not None:
            raise self._end
        if self._period is not None:
            return self._walked[n % self._period]
        step, value, bits = self._sighted(n)
        pole = self._planes.first_pole(step, value)
        if pole is not None:
            before = self._planes.point(pole - 1)
            if more := self._planes.height(before, self._limit):
                raise OverBudget(pole - 1, more)
            raise _no_value(pole - 1)
        if bits != 0:
            raise OverBudget(step, bits)
        if value is None:
            raise ArithmeticError("an iterate at a pole that no prime shows: please report this")
        self._far = max(self._far, n)
        return value

    def _walk(self) -> None:
        """The first steps, exactly."""
        for step, value in enumerate(self._planes.walk()):
            bits = self._planes.height(value, self._limit)
            if step == 0 or not bits:
                self._walked.append(value)  # the start is given: the budget is for what is computed
            if bits:
                self._end = OverBudget(step, bits)
                return
            if step > 0 and value == self._walked[0]:
                self._period = step
                return
            if step == _WALKED or self._planes.bits(value) > _LIGHT:
                return
        self._end = _no_value(len(self._walked) - 1)

    def _sighted(self, n: int) -> tuple[int, Value | None, int | None]:
        """Step n, its value and 0; or a step before it that is over the budget, and the bits there (None: not known).

        The value is None if it was not computed, or is at a pole.
        """
        step = max(1, min(self._far, n - 1))
        target, before = n if self._planes.lazy else min(n, 2 * step), None
        while True:
            try:
                value = self._planes.point(target)
            except SingularStep:
                return target, None, 0
            bits = self._planes.height(value, self._limit)
            if target == n or bits:
                return target, value, bits
            here = target, self._planes.bits(value)
            if before is not None and here[0] - before[0] >= _RISE and here[1] > before[1]:
                # At four times the budget, by a line, it certainly is over.
                beyond = 1 + 4 * self._limit * (here[0] - before[0]) // (here[1] - before[1])
                if beyond <= min(n - target, self._planes.looked):
                    return target + beyond, None, None
            before = here
            # Four times the size is borne, but not more: heights may grow like n^2.
            target = min(n, 2 * target if 4 * here[1] <= self._limit else target + target // 2)


def _no_value(step: int) -> SingularStep:
    return SingularStep(f"the map has no value at step {step}")


class _Plane:
    """What is known of the orbit in one plane for all steps: whether it is lazy, then its period and its pole.

    Lazy means that its numbers stay short: it comes back after `period` steps, or its level is parabolic (`period` is
    None). `pole` is the first step then that has no value, None for none.
    """

    def __init__(self, block: PlanarBlock, start: Triple) -> None:
        found = plane_period_over_rationals(block, start)
        self.period = found.period
        self.lazy = found.period is not None or found.kind in (Kind.ADDITIVE, Kind.NO_VALUE)
        self.pole: int | None = None
        if found.kind is Kind.NO_VALUE:
            self.pole = 1
        elif found.kind is Kind.ADDITIVE:
            self.pole = _parabolic_pole(block, start)
        elif found.period is not None and found.meets_pole is not False:
            try:
                stepped_over(block, start, found.period)
            except _Pole as pole:
                self.pole = pole.step

    def reduced(self, n: int) -> int:
        """A step with the same point."""
        return n if self.period is None else n % self.period


class _Pole(SingularStep):
    """Attribute: `step`, the first one that has no value."""

    def __init__(self, step: int) -> None:
        self.step = step
        super().__init__(f"the map has no value at step {step - 1}")


def _parabolic_pole(block: PlanarBlock, start: Triple) -> int | None:
    """The first step without a value on a level with delta = 0, None for none."""
    r = translation.parabolic_ratio(block, start)
    if not (r is None or isinstance(r, fmpq)):
        r, *others = r.coefficients
        if any(entry != 0 for entry in others):
            return None
    return int(r.p) if r is not None and r.q == 1 and r > 0 else None


def stepped_over(block: PlanarBlock, start: Triple, n: int) -> Triple:
    """P_n over a field, one step after the other. Raises _Pole."""
    point = start
    for k in range(n):
        U, V, W = block.image(point)
        if W == 0:
            raise _Pole(k + 1)
        point = (U / W, V / W, W / W)
    return point


class _SplitPlanes:
    """Planes over Q: triples of integers, points from tables of psi and chi."""

    most_bits, looked = 1 << 28, 250_000

    def __init__(self, structure: Structure, splitting: Splitting, x: Sequence[fmpq]) -> None:
        self._steps = NormalSteps(structure, splitting.eps)
        self._x = x
        self.blocks, self._assembly = self._steps.blocks(x)
        self._planes = [
            _Plane(plane.block, triple) for plane, triple in zip(splitting.planes, splitting.triples(x), strict=True)
        ]
        self.lazy = all(plane.lazy for plane in self._planes)

    def walk(self) -> Iterator[PlanesPoint]:
        """The orbit, as long as it has values."""
        return self._steps.points(self._x)

    def point(self, n: int) -> PlanesPoint:
        """Phi^n(start), poles on the way passed over. Raises SingularStep at a pole."""
        triples = [_reached(block, plane.reduced(n)) for block, plane in zip(self.blocks, self._planes, strict=True)]
        if any(W == 0 for _, _, W in triples):
            raise _no_value(n - 1)
        return PlanesPoint(self._assembly, triples)

    def height(self, value: Value, limit: int) -> int:
        """The bits of the integers over one common denominator, 0 for at most `limit`."""
        assert isinstance(value, PlanesPoint)
        return value.exceeding(limit)

    def bits(self, value: Value) -> int:
        """About the height, for little work."""
        assert isinstance(value, PlanesPoint)
        return value.bits

    def first_pole(self, n: int, value: Value | None) -> int | None:
        """The first step up to n without a value; `value` is the n-th, to be compared modulo a prime."""
        known = [plane.pole for plane in self._planes if plane.pole is not None and plane.pole <= n]
        busy = [i for i, plane in enumerate(self._planes) if not plane.lazy]
        generator = random.Random()
        for _ in range(_PRIMES):
            prime = _random_prime(generator)
            found = {i: _steps_modulo(self.blocks[i], n, prime) for i in busy}
            poles = {i: pole for i, (pole, _) in found.items() if pole is not None}
            if not all(self._is_pole(self.blocks[i], pole) for i, pole in poles.items()):
                continue
            if isinstance(value, PlanesPoint):
                for i, (pole, point) in found.items():
                    if pole is None and not same_point([entry % prime for entry in value.triples[i]], point, prime):
                        raise ArithmeticError(_DISAGREES)
            return min([*known, *poles.values()], default=None)
        raise ArithmeticError(_NO_POLE)

    @staticmethod
    def _is_pole(block: IntegerBlock, step: int) -> bool:
        """Whether a first pole modulo a prime is one over Q."""
        try:
            return _reached(block, step)[2] == 0
        except SingularStep:
            return True


_DISAGREES = "the iterate disagrees with the orbit modulo a prime: please report this"
_NO_POLE = "the orbit modulo many primes met a pole that it has not: please report this"


class _AlgebraPlanes:
    """Planes over Q[t]/g for the factors g of chi, with points as rational coordinates."""

    most_bits, looked = 1 << 23, 20_000

    def __init__(self, structure: Structure, splitting: Splitting, x: Sequence[fmpq]) -> None:
        self._structure, self._splitting, self._x = structure, splitting, x
        self._triples = splitting.triples(x)
        self._planes = [
            _Plane(plane.block, triple) for plane, triple in zip(splitting.planes, self._triples, strict=True)
        ]
        self.lazy = all(plane.lazy for plane in self._planes)

    def walk(self) -> Iterator[tuple[Any, ...]]:
        """The orbit, as long as it has values."""
        triples = self._triples
        while True:
            yield self._splitting.point(triples)
            try:
                triples = [
                    stepped_over(plane.block, triple, 1)
                    for plane, triple in zip(self._splitting.planes, triples, strict=True)
                ]
            except SingularStep:
                return

    def point(self, n: int) -> tuple[Any, ...]:
        """Phi^n(start), poles on the way passed over, but for the first few. Raises SingularStep at a pole."""
        found = []
        for plane, triple, known in zip(self._splitting.planes, self._triples, self._planes, strict=True):
            step = known.reduced(n)
            try:
                found.append(translation.iterate(plane.block, triple, step, lambda element: element == 0))
            except translation.NoTranslation:
                found.append(stepped_over(plane.block, triple, step))
        return self._splitting.point(found)

    def height(self, value: Value, limit: int) -> int:
        """The bits of the integers over one common denominator, 0 for at most `limit`."""
        assert isinstance(value, tuple)
        return IntegerPoint.from_rationals(value).exceeding(limit)

    def bits(self, value: Value) -> int:
        """About the height, for little work."""
        assert isinstance(value, tuple)
        return max(int(max(abs(entry.p), entry.q).bit_length()) for entry in value)

    def first_pole(self, n: int, value: Value | None) -> int | None:
        """The first step up to n without a value; `value` is the n-th, to be compared modulo a prime."""
        known = min((plane.pole for plane in self._planes if plane.pole is not None and plane.pole <= n), default=None)
        if self.lazy:
            return known
        generator = random.Random()
        for _ in range(_PRIMES):
            field = GF(_random_prime(generator))
            try:
                splitting = Splitting(self._structure.form, field, self._splitting.eps, self._structure.T)
                expected = value and tuple(field.convert(entry) for entry in value)  # type: ignore[union-attr]
                triples = splitting.triples([field.convert(entry) for entry in self._x])
            except BadPrime:
                continue
            for step in range(1, n + 1):
                triples = [plane.block.image(triple) for plane, triple in zip(splitting.planes, triples, strict=True)]
                if any(W == 0 for _, _, W in triples):
                    try:
                        self.point(step)
                    except SingularStep:  # a pole over Q, too
                        return step
                    break
            else:
                if expected is not None and splitting.point(triples) != expected:
                    raise ArithmeticError(_DISAGREES)
                return known
        raise ArithmeticError(_NO_POLE)


def _reached(block: IntegerBlock, n: int) -> IntegerTriple:
    """P_n, primitive; poles on the way are passed over, unless it has to be stepped. Raises SingularStep then."""
    if n <= _SHORT or block.is_constant or block.level is None:
        points = list(islice(tau_table.triples(block), n + 1))
        if len(points) <= n:
            raise _no_value(len(points) - 1)
        return points[n]
    found = tau_table.iterate(block, n)
    if found is not None:
        return found
    cubic = block.block
    over_field = PlanarBlock(*(fmpq(entry) for entry in (cubic.a, cubic.b, cubic.c, cubic.d)))
    U, V, W = block.start
    start = (fmpq(U, W), fmpq(V, W), fmpq(1))
    try:
        triple = translation.iterate(over_field, start, n, lambda element: element == 0)
    except translation.NoTranslation:
        triple = stepped_over(over_field, start, n)
    below = fmpz(1)
    for entry in triple:
        below = below.lcm(entry.q)
    return primitive([(entry * below).p for entry in triple])


def _steps_modulo(block: IntegerBlock, n: int, prime: int) -> tuple[int | None, tuple[int, int, int]]:
    """P_n modulo a prime, or the first step at which W vanishes there."""
    cubic = block.block
    a, b, c, d = (int(entry % prime) for entry in (cubic.a, cubic.b, cubic.c, cubic.d))
    p, q, r = (int(entry % prime) for entry in cubic.D)
    U, V, W = (int(entry % prime) for entry in block.start)
    twice_b, twice_c, thrice_a, thrice_d = 2 * b, 2 * c, 3 * a, 3 * d
    for k in range(1, n + 1):
        UU, UV, VV = U * U % prime, U * V % prime, V * V % prime
        U, V, W = (
            (U * W + b * UU + twice_c * UV + thrice_d * VV) % prime,
            (V * W - thrice_a * UU - twice_b * UV - c * VV) % prime,
            (W * W + p * UU + q * UV + r * VV) % prime,
        )
        if W == 0:
            return k, (U, V, W)
    return None, (U, V, W)


def _random_prime(generator: random.Random) -> int:
    while True:
        candidate = generator.getrandbits(61) | (1 << 60) | 1
        if fmpz(candidate).is_prime():
            return candidate
