"""The n-th iterate of a Kahan map directly, without the iterates before it, for members of the family.

In every plane of the normal form the map is a translation on a plane cubic, so n takes about log2(n) doublings: over
Q in integers (`tau_table`), over GF(p), Q[t]/g and balls with field elements (`translation`). Poles on the way are
passed over, except over Q, where none goes unnoticed.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from functools import cached_property
from itertools import islice
from typing import Any

from flint import fmpq, fmpz

from kahanmaps.algebra.fields import GF, QQ, BallField, Field, PrimeField
from kahanmaps.errors import BadPrime, InputError, PrecisionLost, SingularStep
from kahanmaps.family.structure import Structure
from kahanmaps.maps import tau_table, translation
from kahanmaps.maps.normal_steps import NormalSteps, splits
from kahanmaps.maps.planar_block import PlanarBlock, Triple, same_point
from kahanmaps.maps.planar_integers import IntegerBlock, IntegerTriple, primitive
from kahanmaps.maps.planes_point import PlanesPoint
from kahanmaps.maps.splitting import Splitting

_SHORT = 24  # up to here one steps, and from here heights are extrapolated
_GUARDED = 10**7  # beyond it nobody has the memory for the iterate over Q
_PRIMES = 20
_CYCLE = 2 * 10**6  # the longest orbit in a plane over a small field that is walked around


class OverBudget(Exception):
    """The iterate has more digits than allowed. Attribute: `bits`, about how long its integers would be."""

    def __init__(self, bits: int) -> None:
        self.bits = bits
        super().__init__(bits)


class Jump:
    """Iterates of Phi(., eps) over QQ, GF(p) or real balls for a structure; the time step is 2 eps.

    Raises BadPrime where the structure has no reduction modulo p.

    >>> from kahanmaps.algebra.fields import GF
    >>> from kahanmaps.family.draw import draw_with_eigenvalues
    >>> from kahanmaps.family.structure import structure_of
    >>> structure = structure_of(draw_with_eigenvalues([1, -2, 3], seed=7).chosen.system)
    >>> Jump(structure, "1/10", GF(10**9 + 7)).value([1, 2, 3, 4, 5, 6], 10**30)[0]
    946728668
    """

    def __init__(self, structure: Structure, eps: Any, field: Field) -> None:
        self.structure, self.field = structure, field
        self.eps = field.convert(eps)
        if field.characteristic == 2:
            raise BadPrime("2 eps = 0 modulo 2, where the coordinates are 2 eps (u, v): take another prime", 2)
        self.splitting = Splitting(structure.form, field, self.eps, structure.T)

    @cached_property
    def _steps(self) -> NormalSteps:
        return NormalSteps(self.structure, self.eps)

    def value(self, start: Sequence[Any], n: int, max_bits: int | None = None) -> PlanesPoint | tuple[Any, ...]:
        """Phi^n(start) for n >= 0: over Q a PlanesPoint, if chi splits; otherwise the coordinates.

        Raises SingularStep where the map has no value, over Q at any step, elsewhere at one of the first few or the
        last; PrecisionLost for balls that are too wide; OverBudget, over Q, where the result would have more than
        `max_bits` bits.
        """
        if n < 0:
            raise InputError(f"found the step {n}, expected 0 or more (for the inverse map, change the sign of eps)")
        if self.field is QQ:
            return self._over_rationals(start, n, max_bits)
        with self.field.working():
            x = [self.field.convert(entry) for entry in start]
            found = []
            for plane, triple in zip(self.splitting.planes, self.splitting.triples(x), strict=True):
                found.append(self._in_plane(plane.block, triple, n))
            for _, _, W in found:
                if self.field.is_zero(W):
                    raise SingularStep(f"the map has a pole: its iterate {n} has no value at the start")
            return self.splitting.point(found)

    def _in_plane(self, block: PlanarBlock, start: Triple, n: int) -> Triple:
        if block.is_zero or (start[0] == 0 and start[1] == 0):
            return start
        small = isinstance(self.field, PrimeField) and self.field.prime < 5
        if not small:
            try:
                return translation.iterate(block, start, n, self.field.is_zero)
            except translation.NoTranslation:
                if isinstance(self.field, BallField):
                    raise PrecisionLost("the orbit meets special positions that balls cannot decide") from None
        return _around_cycle(block, start, n)

    def _over_rationals(self, start: Sequence[Any], n: int, max_bits: int | None) -> PlanesPoint | tuple[Any, ...]:
        if not splits(self.splitting):
            return self._over_algebras(start, n, max_bits)
        blocks, assembly = self._steps.blocks(start)
        periods = [_small_period(block) if n > _SHORT else None for block in blocks]
        steps = [n if period is None else n % period for period in periods]
        if n > _SHORT:
            self._require_budget(sum(map(_expected_bits, blocks, steps)), max(steps), max_bits)
        point = PlanesPoint(assembly, [_rational_iterate(*pair) for pair in zip(blocks, steps, strict=True)])
        if max_bits is not None and point.bits > max_bits:
            raise OverBudget(point.bits)
        return point

    def _over_algebras(self, start: Sequence[Any], n: int, max_bits: int | None) -> tuple[Any, ...]:
        x = [QQ.convert(entry) for entry in start]

        def point(k: int) -> tuple[Any, ...]:
            found = []
            for plane, triple in zip(self.splitting.planes, self.splitting.triples(x), strict=True):
                if plane.block.is_zero or (triple[0] == 0 and triple[1] == 0):
                    found.append(triple)
                    continue
                try:
                    found.append(translation.iterate(plane.block, triple, k, lambda element: element == 0))
                except translation.NoTranslation:
                    found.append(_stepped_over(plane.block, triple, k))
            return self.splitting.point(found)

        if n > _SHORT:
            half, whole = (
                max(max(abs(entry.p).bit_length(), entry.q.bit_length()) for entry in point(k))
                for k in (_SHORT // 2, _SHORT)
            )
            # Heights grow like n^2, unless the orbit is at rest or moves on lines.
            self._require_budget(whole * n * n // _SHORT**2 if whole > 3 * half else whole * n // _SHORT, n, max_bits)
        try:
            found = point(n)
        except SingularStep:
            self._require_orbit(x, n, None, point)
            raise
        self._require_orbit(x, n, found, point)
        return found

    def _require_orbit(
        self, x: Sequence[fmpq], n: int, found: tuple[Any, ...] | None, point: Callable[[int], tuple[Any, ...]]
    ) -> None:
        """As `_require_orbit` below, for planes over extensions: the orbit is stepped modulo a prime in all planes.

        None stands for an iterate at a pole; then the pole met first is what is to be told.
        """
        generator = random.Random()
        for _ in range(_PRIMES):
            field = GF(_random_prime(generator))
            try:
                jump = Jump(self.structure, self.eps, field)
                expected = None if found is None else tuple(field.convert(entry) for entry in found)
                planes = list(jump.splitting.planes)
                triples = jump.splitting.triples([field.convert(entry) for entry in x])
            except BadPrime:
                continue
            pole = None
            for step in range(1, n + 1):
                triples = [plane.block.image(triple) for plane, triple in zip(planes, triples, strict=True)]
                if any(W == 0 for _, _, W in triples):
                    pole = step
                    break
            if pole is None:
                if expected is not None and jump.splitting.point(triples) != expected:
                    raise ArithmeticError("the iterate disagrees with the orbit modulo a prime: please report this")
                return
            try:
                point(pole)
            except SingularStep:  # a pole over Q, too
                raise SingularStep(f"the map has no value at step {pole - 1}") from None
        raise ArithmeticError("the orbit modulo many primes met a pole that it has not: please report this")

    def _require_budget(self, bits: int, n: int, max_bits: int | None) -> None:
        if (max_bits is not None and bits > max_bits) or n > _GUARDED:
            raise OverBudget(bits)


def _small_period(block: IntegerBlock) -> int | None:
    """The period, if the orbit comes back in the first few steps (over Q it does then or never); 1 at rest."""
    if block.is_constant:
        return 1
    start, *points = islice(tau_table.triples(block), _SHORT + 1)
    return next((k for k, point in enumerate(points, start=1) if same_point(point, start)), None)


def _expected_bits(block: IntegerBlock, n: int) -> int:
    """About the length of P_n: heights grow like n^2, or like n where the level cubic is singular."""
    *_, last = islice(tau_table.triples(block), min(n, _SHORT) + 1)
    bits = max(abs(entry).bit_length() for entry in last)
    if n <= _SHORT or block.is_constant or block.level is None:
        return int(bits)
    return int(bits * n // _SHORT if block.is_degenerate else bits * n * n // _SHORT**2)


def _stepped(block: IntegerBlock, n: int) -> IntegerTriple:
    """P_n by steps. Raises SingularStep."""
    points = list(islice(tau_table.triples(block), n + 1))
    if len(points) <= n:
        raise SingularStep(f"the map has no value at step {len(points) - 1}")
    return points[n]


def _rational_iterate(block: IntegerBlock, n: int) -> IntegerTriple:
    """P_n, primitive. Raises SingularStep at a pole on the way."""
    if block.is_constant:
        return block.start
    if n <= _SHORT or block.level is None:
        return _stepped(block, n)
    found = _reached(block, n)
    _require_orbit(block, n, found)
    return found


def _reached(block: IntegerBlock, n: int) -> IntegerTriple:
    """P_n, primitive; poles on the way are passed over, unless it has to be stepped."""
    found = tau_table.iterate(block, n)
    if found is not None:
        return found
    cubic = block.block
    over_field = PlanarBlock(*(fmpq(entry) for entry in (cubic.a, cubic.b, cubic.c, cubic.d)))
    U, V, W = block.start
    try:
        triple = translation.iterate(over_field, (fmpq(U, W), fmpq(V, W), fmpq(1)), n, lambda element: element == 0)
    except translation.NoTranslation:
        return _stepped(block, n)
    below = fmpz(1)
    for entry in triple:
        below = below.lcm(entry.q)
    return primitive([(entry * below).p for entry in triple])


def _require_orbit(block: IntegerBlock, n: int, found: IntegerTriple) -> None:
    """That P_n is right modulo a random prime of 61 bits, by stepping there, and that there was no pole on the way.

    Raises SingularStep where there was one. The table divides exactly where theory says so; this is the guard.
    """
    generator = random.Random()
    for _ in range(_PRIMES):
        prime = _random_prime(generator)
        pole, point = _steps_modulo(block, n, prime)
        if pole is None:
            if not same_point([entry % prime for entry in found], point, prime):
                raise ArithmeticError("the n-th iterate disagrees with the orbit modulo a prime: please report this")
            return
        if (_stepped(block, pole) if pole <= _SHORT else _reached(block, pole))[2] == 0:
            raise SingularStep(f"the map has no value at step {pole - 1}")
    raise ArithmeticError("the orbit modulo many primes met a pole that it has not: please report this")


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


def _stepped_over(block: PlanarBlock, start: Triple, n: int) -> Triple:
    """P_n over a field, one step after the other. Raises SingularStep."""
    point = start
    for k in range(n):
        U, V, W = block.image(point)
        if W == 0:
            raise SingularStep(f"the map has no value at step {k}")
        point = (U / W, V / W, W / W)
    return point


def _around_cycle(block: PlanarBlock, start: Triple, n: int) -> Triple:
    """P_n over a small finite field, where orbits soon come back or meet a pole. Raises SingularStep."""
    point = start
    for k in range(1, n + 1):
        if k > _CYCLE:
            raise InputError(f"the iterate {n} cannot be reached directly here: take fewer steps or another prime")
        point = _stepped_over(block, point, 1)
        if same_point(point, start):
            return _stepped_over(block, start, n % k)
    return point


def special_start(structure: Structure, eps: Any, start: Sequence[Any]) -> str:
    """Empty, or why the orbit of a rational start is special in a plane, which balls cannot decide.

    Special are planes in which the start is at rest, or on a singular level cubic (delta is 0 or 1).
    """
    splitting = Splitting(structure.form, QQ, eps, structure.T)
    for plane, (U, V, W) in zip(splitting.planes, splitting.triples([QQ.convert(x) for x in start]), strict=True):
        above, below = plane.block.level((U, V, W))
        if plane.block.is_zero or (U == 0 and V == 0):
            return f"the start is at rest in the plane {plane.name}"
        if below == 0 or above == 0 or plane.block.discriminant == 0:
            return f"the start is on a singular level in the plane {plane.name}"
        if plane.block.discriminant * above * above == below * below:
            return f"the start is on three lines in the plane {plane.name}"
    return ""
