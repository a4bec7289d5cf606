"""The level cubics of a plane as groups: the order of the translation Psi, and whether two points lie on one orbit.

The levels are smooth. Orders are computed in fields with q elements, of characteristic at least 5; over number fields
points are added, but no orders are computed. planar_block.py defines Psi, the cubic E, its Jacobian and T.
"""

from __future__ import annotations

from math import isqrt
from typing import Any

from flint import fmpz, fq_default_ctx

from kahanmaps.algebra.elliptic_curves import AffinePoint, EllipticCurve, by_doublings
from kahanmaps.maps.normal_form.planar_block import PlanarBlock, Triple, same_point
from kahanmaps.maps.normal_form.schoof import trace_modulo

_MAX_DIGIT = 2000  # largest prime l at which parts of l-power order are compared, by counting for each digit to base l
_MAX_RADIUS = 1 << 32  # radius of the largest interval searched without Schoof's algorithm, in about 2^17 steps


class Jacobian(EllipticCurve):
    """Y^2 = x^3 + a2 x^2 + a4 x + a6, the Jacobian of E with Y = y + 3x + 8 gamma; None is the zero of the group.

    a2 = 9 + 3 gamma, a4 = 48 gamma, a6 = 64 gamma^2. The attribute `T` is the point (0, 8 gamma).

    >>> from flint import fmpq
    >>> E = Jacobian(fmpq(32, 27))
    >>> E.multiple(5, E.T) is None, E.multiple(4, E.T) == E.negative(E.T)
    (True, True)
    """

    def __init__(self, gamma: Any) -> None:
        super().__init__(9 + 3 * gamma, 48 * gamma, 64 * gamma * gamma)
        self.T: AffinePoint = (0 * gamma, 8 * gamma)


def translation_order(gamma: Any, q: int, context: fq_default_ctx | None = None) -> int:
    """Return the order of T over GF(q), or over the field `context` of q elements; gamma is not 0 or 1.

    A number k with k T = 0 is searched for among those with |k - q - 1| <= 2 sqrt(q); the number of points is one of
    them (Hasse). In a large field the number of points is first computed modulo a product of small primes (schoof.py).
    Finally k is divided by all prime factors that it contains in excess of the order of T.
    """
    curve = Jacobian(gamma)
    radius, center, modulus = isqrt(4 * q), q + 1, 1
    if q < 1000:  # adding T until the sum is 0 is faster than a search, and needs no Hasse interval
        point, order = curve.add(curve.T, None), 1
        while point is not None:
            point, order = curve.add(point, curve.T), order + 1
        return order
    if radius > _MAX_RADIUS:
        field = fq_default_ctx(q, 1) if context is None else context
        a2, a4, a6 = (c if context is not None else field(int(c)) for c in (curve.a2, curve.a4, curve.a6))
        trace, modulus = trace_modulo(a2, a4, a6, field, radius // _MAX_RADIUS)
        # The representative of the trace closest to 0, so that all candidates are near `center`.
        center -= trace if 2 * trace <= modulus else trace - modulus
    k = _annihilator(curve, center, modulus, radius // modulus + 2)
    for factor, exponent in fmpz(k).factor():
        for _ in range(int(exponent)):
            if curve.multiple(k // int(factor), curve.T) is not None:
                break
            k //= int(factor)
    return k


def _annihilator(curve: Jacobian, center: int, modulus: int, radius: int) -> int:
    """Return some k > 0 with k T = 0; some number `center` + m `modulus`, |m| <= `radius`, must annihilate T.

    m is written as i (2b + 1) - j, |j| <= b: there are b baby steps of `modulus` T, and a giant step is 2b + 1 of them.
    """
    baby_step_count, step = isqrt(radius) + 2, curve.multiple(modulus, curve.T)
    index: dict[Any, tuple[int, Any]] = {}
    point = step
    for j in range(1, baby_step_count + 1):
        if point is None:
            return modulus * j
        index.setdefault(point[0], (modulus * j, point[1]))
        point = curve.add(point, step)
    stride = (2 * baby_step_count + 1) * modulus
    giant_step, upper_multiple = curve.multiple(stride, curve.T), curve.multiple(center, curve.T)
    negative_giant_step, lower_multiple = curve.negative(giant_step), upper_multiple
    for i in range(radius * modulus // stride + 3):
        for k, point in ((center + i * stride, upper_multiple), (center - i * stride, lower_multiple)):
            if point is None:
                return abs(k)
            if point[0] in index:
                j, y = index[point[0]]  # k T = +-j T
                return abs(k - j if point[1] == y else k + j)
        upper_multiple = curve.add(upper_multiple, giant_step)
        lower_multiple = curve.add(lower_multiple, negative_giant_step)
    raise AssertionError("no multiple of T in the Hasse interval is zero: please report this")


class LevelCubic:
    """The smooth level cubic denominator h = numerator W (W^2 + D), as a group with one of its points as zero.

    Sums are computed from chords and tangents, without a Weierstrass equation. Points are triples, not normalized.
    """

    def __init__(self, block: PlanarBlock, numerator: Any, denominator: Any, zero: Triple) -> None:
        self.block, self.numerator, self.denominator, self.zero = block, numerator, denominator, zero
        self._tangential_point = self.third_point(zero, zero)

    def gradient(self, P: Triple) -> Triple:
        """Return the three derivatives at P of F = denominator h - numerator W (W^2 + D)."""
        (U, V, W), (p, q, r), block = P, self.block.D, self.block
        factor = self.numerator * W
        return (
            self.denominator * ((3 * block.a * U + 2 * block.b * V) * U + block.c * V * V)
            - factor * (2 * p * U + q * V),
            self.denominator * (block.b * U * U + (2 * block.c * U + 3 * block.d * V) * V)
            - factor * (q * U + 2 * r * V),
            -self.numerator * (3 * W * W + p * U * U + q * U * V + r * V * V),
        )

    def third_point(self, P: Triple, Q: Triple) -> Triple:
        """Return the third point of the cubic on the line through P and Q, or on the tangent if they are equal."""
        # A cubic form on a line has four coefficients. Two of them are 0, since P and Q are zeros of the form. The two
        # others are derivatives of the form; no equation has to be solved.
        if not same_point(P, Q):
            s, t = _dot(self.gradient(P), Q), _dot(self.gradient(Q), P)
            return t * P[0] - s * Q[0], t * P[1] - s * Q[1], t * P[2] - s * Q[2]
        a, b, c = self.gradient(P)
        zero = 0 * a
        candidates = [(b, -a, zero), (c, zero, -a), (zero, c, -b)]
        X = next(X for X in candidates if any(entry != 0 for entry in X) and not same_point(X, P))
        gradient = self.gradient(X)
        s, t = _dot(gradient, P), _dot(gradient, X) / 3
        return t * P[0] - s * X[0], t * P[1] - s * X[1], t * P[2] - s * X[2]

    def add(self, P: Triple, Q: Triple) -> Triple:
        """Return P + Q."""
        return self.third_point(self.zero, self.third_point(P, Q))

    def subtract(self, P: Triple, Q: Triple) -> Triple:
        """Return P - Q."""
        return self.add(P, self.third_point(Q, self._tangential_point))

    def multiple(self, n: int, P: Triple) -> Triple:
        """Return n P for n >= 0."""
        multiple: Triple = by_doublings(self.add, self.zero, n, P)
        return multiple

    def is_zero(self, P: Triple) -> bool:
        """Return whether P is the zero of the group."""
        return same_point(P, self.zero)

    def is_multiple(self, P: Triple, T: Triple, order: int, q: int) -> bool | None:
        """Return whether P is a multiple of T, whose order is `order`; None if this is not decided.

        If `order` P is not zero, P is no multiple of T. Otherwise, for every prime l that divides both the order of T
        and the index of the multiples of T in the group, one discrete logarithm compares the parts of P and T of
        l-power order. For all other primes no comparison is needed.
        """
        if not self.is_zero(self.multiple(order, P)):
            return False
        # `point_count` is the number of points if only one multiple of the order of T lies in the Hasse interval.
        radius = isqrt(4 * q)
        point_count = -(-(q + 1 - radius) // order) * order
        if point_count + order <= q + 1 + radius:
            return None
        is_unknown = False
        for factor, exponent in fmpz(order).factor():
            prime, power = int(factor), int(factor) ** int(exponent)
            if point_count // order % prime != 0:
                continue
            if prime > _MAX_DIGIT:
                is_unknown = True
                continue
            # The logarithm of the part of P to the base of the part of T, of order `power`, by Pohlig and Hellman.
            P_part, T_part = self.multiple(order // power, P), self.multiple(order // power, T)
            generator, digit_weight = self.multiple(power // prime, T_part), 1
            while digit_weight < power:
                # The known digits are subtracted from `P_part`; `generator_multiple` is `digit` times `generator`.
                P_multiple = self.multiple(power // prime // digit_weight, P_part)
                digit, generator_multiple = 0, self.zero
                while not same_point(P_multiple, generator_multiple):
                    digit, generator_multiple = digit + 1, self.add(generator_multiple, generator)
                    if digit == prime:
                        return False
                P_part = self.subtract(P_part, self.multiple(digit * digit_weight, T_part))
                digit_weight *= prime
            if not self.is_zero(P_part):
                return False
        return None if is_unknown else True


def _dot(P: Triple, Q: Triple) -> Any:
    return P[0] * Q[0] + P[1] * Q[1] + P[2] * Q[2]
