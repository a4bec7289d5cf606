"""Elliptic curves Y^2 = x^3 + a2 x^2 + a4 x + a6: group law, orders of points, canonical heights, rotation numbers.

Points are pairs (x, Y); None is the point at infinity, the zero of the group. Orders and heights are for points over Q.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from typing import Any

from flint import acb, arb, fmpq, fmpz

from kahanmaps.algebra.fields import RR
from kahanmaps.errors import PrecisionLost

AffinePoint = tuple[Any, Any]

MAX_BITS = 1 << 15  # maximal precision of the balls in which heights and rotation numbers are computed
_ACCURACY = 1e-15  # requested accuracy of rotation numbers and heights
_HEIGHT_TERMS = 40  # terms of the series for a height; they decrease like 4^-n
_EXACT_TERMS = 4  # the first terms of this series, computed without a modulus
_MAX_TORSION = 12  # the largest order of a rational torsion point (mazur-1977)
_MAX_PRIME_BITS = 20  # maximal size of the primes whose powers are removed from the coefficients of a model


class EllipticCurve:
    """The curve Y^2 = x^3 + a2 x^2 + a4 x + a6 over a field.

    >>> E, T = EllipticCurve(fmpq(0), fmpq(0), fmpq(1)), (fmpq(2), fmpq(3))
    >>> E.add(T, T), E.multiple(6, T), E.order(T)
    ((0, 1), None, 6)
    """

    def __init__(self, a2: Any, a4: Any, a6: Any) -> None:
        self.a2, self.a4, self.a6 = a2, a4, a6

    @staticmethod
    def negative(P: AffinePoint | None) -> AffinePoint | None:
        """Return -P."""
        return None if P is None else (P[0], -P[1])

    def add(self, P: AffinePoint | None, Q: AffinePoint | None) -> AffinePoint | None:
        """Return P + Q; None is the point at infinity, the zero of the group."""
        if P is None or Q is None:
            return Q if P is None else P
        if P[0] != Q[0]:
            slope = (Q[1] - P[1]) / (Q[0] - P[0])
        elif P[1] == -Q[1]:
            return None
        else:
            slope = ((3 * P[0] + 2 * self.a2) * P[0] + self.a4) / (2 * P[1])
        x = slope * slope - self.a2 - P[0] - Q[0]
        return x, slope * (P[0] - x) - P[1]

    def multiple(self, n: int, P: AffinePoint | None) -> AffinePoint | None:
        """Return n P for n >= 0."""
        multiple: AffinePoint | None = by_doublings(self.add, None, n, P)
        return multiple

    @property
    def discriminant(self) -> Any:
        """The discriminant of x^3 + a2 x^2 + a4 x + a6; the curve is singular if and only if it is 0."""
        a, b, c = self.a2, self.a4, self.a6
        return (a * a - 4 * b) * b * b + (18 * a * b - 4 * a * a * a - 27 * c) * c

    @property
    def j(self) -> Any:
        """The j-invariant of the curve."""
        return 256 * (self.a2 * self.a2 - 3 * self.a4) ** 3 / self.discriminant

    def order(self, P: AffinePoint) -> int | None:
        """Return the order of a point over Q; None if it is infinite.

        By Mazur's theorem, a point of finite order over Q has an order of at most 12.
        """
        multiple: AffinePoint | None = P
        for n in range(1, _MAX_TORSION + 1):
            if multiple is None:
                return n
            multiple = self.add(multiple, P)
        return None

    def short_model(self, P: AffinePoint) -> tuple[EllipticCurve, AffinePoint]:
        """Return an isomorphic curve Y^2 = x^3 + A x + B over Q with small integers A, B, and the image of P on it.

        A and B are as small as possible, unless p^4 divides A and p^6 divides B for a prime p of more than 20 bits.
        """
        shift = self.a2 / 3
        A, B, x, y = self.a4 - self.a2 * shift, (2 * shift * shift - self.a4) * shift + self.a6, P[0] + shift, P[1]
        u = A.q.lcm(B.q)
        A, B, scale = A * u**4, B * u**6, fmpq(u)
        gcd = (A.p**3).gcd(B.p**2)
        for factor in _candidate_factors(gcd):
            while A.p % factor**4 == 0 and B.p % factor**6 == 0:
                A, B, scale = A / factor**4, B / factor**6, scale / factor
        return EllipticCurve(fmpq(0), A, B), (x * scale**2, y * scale**3)


def _candidate_factors(number: fmpz) -> list[fmpz]:
    """Return the primes of at most 20 bits dividing `number`, the cofactor, and the rounded roots above 1 of these."""
    if number == 0:
        return []
    factors = [abs(factor) for factor, _ in number.factor_smooth(_MAX_PRIME_BITS)]
    roots = [factor.root(k) for factor in factors for k in (12, 6, 4, 3, 2, 1)]
    return [root for root in roots if root > 1]


def by_doublings(add: Callable[[Any, Any], Any], zero: Any, n: int, P: Any) -> Any:
    """Return n P for n >= 0 in the group with addition `add` and zero element `zero`."""
    total = zero
    for bit in bin(n)[2:]:
        total = add(total, total)
        if bit == "1":
            total = add(total, P)
    return total


def canonical_height(curve: EllipticCurve, P: AffinePoint) -> arb:
    """Return the canonical height of a point over Q as a ball; it is half the height of x up to a bounded amount.

    Tate's series sums the bounded differences h(2Q) - 4 h(Q) with weights 4^-n over Q = P, 2P, 4P, ...; h is the height
    of x. Doubling x = X/Z evaluates two forms of degree 4. The sizes of their values are computed in balls. The common
    factor of the two values divides the resultant R of the forms, so that X and Z modulo a power of R determine it. The
    sizes of R and of the coefficients of the forms bound the remainder of the series.

    Raises PrecisionLost if 32768 bits do not suffice.

    >>> canonical_height(EllipticCurve(fmpq(0), fmpq(-1), fmpq(1)), (fmpq(1), fmpq(1))).str(10, radius=False)
    '0.02490419865'
    """
    d = fmpq(curve.a2.q.lcm(curve.a4.q).lcm(curve.a6.q))
    for factor in _candidate_factors((curve.a2 * d**2).p.gcd((curve.a4 * d**4).p).gcd((curve.a6 * d**6).p)):
        while all((a * (d / factor) ** k).q == 1 for a, k in ((curve.a2, 2), (curve.a4, 4), (curve.a6, 6))):
            d /= factor
    a2, a4, a6 = ((a * d**k).p for a, k in ((curve.a2, 2), (curve.a4, 4), (curve.a6, 6)))
    b2, b4, b6, b8 = 4 * a2, 2 * a4, 4 * a6, 4 * a2 * a6 - a4 * a4
    resultant = fmpz((256 * curve.discriminant**2 * d**24).p)
    x = P[0] * d**2

    def double(X: Any, Z: Any) -> tuple[Any, Any]:
        return (
            X**4 - b4 * (X * Z) ** 2 - 2 * b6 * X * Z**3 - b8 * Z**4,
            4 * X**3 * Z + b2 * (X * Z) ** 2 + 2 * b4 * X * Z**3 + b6 * Z**4,
        )

    def common_factors(terms: int, modulus: fmpz | None) -> list[fmpz]:
        """Return the gcds canceled in the first `terms` doublings of P, or fewer if the modulus determines fewer."""
        X, Z, gcds = x.p, x.q, list[fmpz]()
        while len(gcds) < terms and (modulus is None or modulus % resultant == 0):
            X, Z = double(X, Z)
            gcd = (X % resultant).gcd(resultant).gcd(Z % resultant)  # the gcd divides R, so reduce modulo R first
            X, Z = X // gcd, Z // gcd
            if modulus is not None:
                modulus //= gcd
                X, Z = X % modulus, Z % modulus
            gcds.append(gcd)
        return gcds

    # The gcds usually divide the lcm of the first ones, which are computed without a modulus and are smaller than R.
    typical_factor = reduce(fmpz.lcm, common_factors(_EXACT_TERMS, None))
    gcds = common_factors(_HEIGHT_TERMS, resultant * typical_factor**_HEIGHT_TERMS)
    if len(gcds) < _HEIGHT_TERMS:
        gcds = common_factors(_HEIGHT_TERMS, resultant ** (_HEIGHT_TERMS + 1))
    # R = f F + g G for the forms F, G, where f and g are minors of a matrix with eight rows. This bounds the size of F
    # and G, hence the terms of the series, from below. The sums of the coefficients of F and G bound them from above.
    largest = max(abs(c) for c in (fmpz(4), 2 * b4, 2 * b6, b8, b2, b6)) + 1
    bound = resultant.bit_length() + 8 * (largest.bit_length() + 3)
    for bits in (1 << 9, 1 << 12, MAX_BITS):
        sizes = list[arb]()
        with RR(bits).working():
            size = max(abs(x.p), x.q)
            initial_size, point = arb(size), (arb(x.p) / size, arb(x.q) / size)
            for _ in range(_HEIGHT_TERMS):
                point = double(*point)
                sizes.append(abs(point[0]).max(abs(point[1])))
                point = (point[0] / sizes[-1], point[1] / sizes[-1])
        with RR(128).working():  # the sum needs few bits: only doublings lose digits
            total, scale = initial_size.log(), arb(1)
            for size, gcd in zip(sizes, gcds, strict=True):
                scale /= 4
                total += scale * (size.log() - arb(gcd).log())
            total += arb(0, scale * bound)
            if total.is_finite() and float(total.rad()) < _ACCURACY:
                return total / 2
    raise PrecisionLost(f"the height needs more than {MAX_BITS} bits: the curve is almost singular")


def real_roots(curve: EllipticCurve, has_oval: bool) -> list[acb]:
    """Return the roots of x^3 + a2 x^2 + a4 x + a6 with arb coefficients; the first is the largest real root.

    If `has_oval` (the discriminant is positive), all roots are real, in decreasing order; otherwise two are conjugate.
    """
    shift, A, B = _depressed_cubic(curve)
    s = B * B / 4 + A * A * A / 27
    if has_oval:  # Viete's formula
        radius, angle = 2 * (-A / 3).sqrt(), arb.atan2((-s).sqrt(), -B / 2) / 3
        return [acb(radius * (angle - 2 * k * arb.pi() / 3).cos() - shift) for k in range(3)]
    # Cardano's formula, with the one of the two values of u^3 whose computation suffers no cancellation.
    u_cubed = -B / 2 - s.sqrt() if B > 0 else -B / 2 + s.sqrt()
    u = -((-u_cubed).root(3)) if u_cubed < 0 else u_cubed.root(3)
    v = -A / (3 * u)
    re, im = (u + v) / 2, (u - v) * arb(3).sqrt() / 2
    return [acb(2 * re - shift), acb(-re - shift, im), acb(-re - shift, -im)]


def complex_roots(curve: EllipticCurve) -> list[acb]:
    """Return the roots of x^3 + a2 x^2 + a4 x + a6 with acb coefficients, by Cardano's formula."""
    shift, A, B = _depressed_cubic(curve)
    sqrt = (B * B / 4 + A * A * A / 27).sqrt()
    u_cubed = max((-B / 2 + sqrt, -B / 2 - sqrt), key=lambda z: abs(z).mid())
    u, omega = u_cubed.root(3), acb(arb(-1) / 2, arb(3).sqrt() / 2)
    v = -A / (3 * u)
    return [u - shift + v, u * omega + v / omega - shift, u / omega + v * omega - shift]


def _depressed_cubic(curve: EllipticCurve) -> tuple[Any, Any, Any]:
    """Return (c, A, B) such that x^3 + a2 x^2 + a4 x + a6 = z^3 + A z + B for z = x + c."""
    shift = curve.a2 / 3
    return shift, curve.a4 - curve.a2 * shift, (2 * shift * shift - curve.a4) * shift + curve.a6


def rotation_number(curve: EllipticCurve, P: AffinePoint, has_oval: bool) -> tuple[arb, int]:
    """Return (r, k): r in [0, 1/2] is, up to sign, the rotation number of the translation by k P on the real curve.

    k is 2 if the translation by P exchanges the two real components of the curve, and 1 otherwise.

    Args:
        curve, P: the curve and the point, with coefficients and coordinates in arb.
        has_oval: whether x^3 + a2 x^2 + a4 x + a6 has three real roots, i.e. a positive discriminant.
    """
    a, b, c = (-root for root in real_roots(curve, has_oval))
    steps, x = 1, P[0]
    if has_oval and not x + a.real > 0:
        if not x + a.real < 0:
            raise PrecisionLost("the component of the translation cannot be decided")
        double = curve.add(P, P)
        if double is None:
            return arb(0), 2
        steps, x = 2, double[0]
    # For the roots e_i, Carlson's R_F(x - e_1, x - e_2, x - e_3) is the integral of dx/(2Y) from x to infinity.
    integral = acb.elliptic_rf(x + a, x + b, x + c)
    period = 2 * acb.elliptic_rf(acb(0), b - a, c - a)
    return (integral / period).real, steps
