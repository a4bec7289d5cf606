"""The number of points of an elliptic curve modulo small primes, by Schoof's algorithm, over a field of any size.

For a curve y^2 = c(x) over q elements with q + 1 - t points, the Frobenius map F, (x, y) -> (x^q, y^q), satisfies
F^2 - t F + q = 0. To find t modulo l, the equation is tested for t = 0, ..., l - 1 on the points of order l. Their
x-coordinates are the roots of the division polynomial f of degree (l^2 - 1)/2: computations are modulo f and y^2 = c.
An element without inverse modulo f gives a divisor of f, which replaces f. FLINT's polynomials make this fast enough.
"""

from __future__ import annotations

from typing import Any

from flint import fmpz, fq_default_ctx, fq_default_poly_ctx

from kahanmaps.algebra.elliptic_curves import by_doublings

Poly = Any
Point = tuple[Poly, Poly] | None


class _Divisor(Exception):
    """A proper divisor of the modulus was found. Attribute: `divisor`."""

    def __init__(self, divisor: Poly) -> None:
        self.divisor = divisor
        super().__init__()


class _TorsionPoints:
    """Points (X, y Y) of y^2 = c = x^3 + A x + B, where X and Y are polynomials in x modulo f."""

    def __init__(self, f: Poly, c: Poly, A: Any) -> None:
        self.f, self.c, self.A = f, c % f, A

    def inverse(self, value: Poly) -> Poly:
        """Return 1/value modulo f. Raises _Divisor if there is no inverse."""
        common_factor, inverse, _ = value.xgcd(self.f)
        if common_factor.degree() > 0:
            raise _Divisor(common_factor)
        return inverse % self.f

    def add(self, P: Point, Q: Point) -> Point:
        """Return P + Q. Raises _Divisor if an element has no inverse modulo f."""
        if P is None or Q is None:
            return Q if P is None else P
        (X, Y), (Z, T), f = P, Q, self.f
        if X != Z:
            slope = (Y - T) * self.inverse((X - Z) % f) % f
        elif Y == T:
            slope = (3 * X * X + self.A) * self.inverse(2 * self.c * Y % f) % f
        elif (Y + T) % f == 0 * f:
            return None
        else:
            # The points agree modulo some factors of f and are opposite modulo the others: f splits.
            raise _Divisor((Y - T).gcd(f))
        x_sum = (slope * slope % f * self.c - X - Z) % f
        return x_sum, (slope * (X - x_sum) - Y) % f


def trace_modulo(a2: Any, a4: Any, a6: Any, context: fq_default_ctx, bound: int) -> tuple[int, int]:
    """Return (t mod M, M): the trace t of Frobenius of y^2 = x^3 + a2 x^2 + a4 x + a6, M = 2 3 5 7 ... >= `bound`.

    The field has characteristic at least 5.

    >>> K = fq_default_ctx(10007, 1)
    >>> trace_modulo(K(0), K(1), K(1), K, 100)
    (153, 210)
    """
    q = int(context.order())
    A = a4 - a2 * a2 / 3
    B = a6 - a2 * a4 / 3 + 2 * a2 * a2 * a2 / 27
    ring = fq_default_poly_ctx(context)
    x = ring([0, 1])  # type: ignore[arg-type]
    c = x * x * x + A * x + B
    division_polynomials = _DivisionPolynomials(x, c, A, B)
    is_odd = (pow(x, q, c) - x).gcd(c).degree() == 0
    trace, modulus, prime = int(is_odd), 2, 2
    while modulus < bound:
        prime = next(n for n in range(prime + 1, 2 * prime) if fmpz(n).is_prime())
        if q % prime == 0:
            continue
        f, residue = division_polynomials[prime], None
        while residue is None:
            torsion = _TorsionPoints(f, c, A)  # find the trace that satisfies the equation on the points with f = 0
            try:
                frobenius = (pow(x % f, q, f), pow(torsion.c, (q - 1) // 2, f))
                frobenius_squared = (pow(frobenius[0], q, f), frobenius[1] * pow(frobenius[1], q, f) % f)
                target_point = torsion.add(
                    frobenius_squared, by_doublings(torsion.add, None, q % prime, (x % f, 0 * x + 1))
                )
                image: Point = None
                for t in range(1, prime // 2 + 1) if target_point else ():
                    image = torsion.add(image, frobenius)
                    if image is not None and target_point is not None and image[0] == target_point[0]:
                        residue = t if image[1] == target_point[1] else prime - t
                        break
                else:
                    if target_point is not None:
                        raise AssertionError("no trace of Frobenius fits: please report this")
                    residue = 0
            except _Divisor as error:
                f = error.divisor
        trace += modulus * ((residue - trace) * pow(modulus, -1, prime) % prime)
        modulus *= prime
    return trace, modulus


class _DivisionPolynomials:
    """The polynomials psi_n for odd n, and psi_n / (2y) for even n, as polynomials in x."""

    def __init__(self, x: Poly, c: Poly, A: Any, B: Any) -> None:
        x2 = x * x
        x3 = x2 * x
        self._sixteen_c_squared = 16 * c * c
        self._values: dict[int, Poly] = {
            -1: 0 * x - 1,
            0: 0 * x,
            1: 0 * x + 1,
            2: 0 * x + 1,
            3: 3 * x2 * x2 + 6 * A * x2 + 12 * B * x - A * A,
            4: 2 * (x3 * x3 + 5 * A * x2 * x2 + 20 * B * x3 - 5 * A * A * x2 - 4 * A * B * x - 8 * B * B - A * A * A),
        }

    def __getitem__(self, n: int) -> Poly:
        if n not in self._values:
            m, is_odd = divmod(n, 2)
            # psi_n with an even n is stored without its factor 2 y. In the recurrence for an odd index, one of the two
            # products contains four such factors, 16 y^4 = 16 c^2.
            if is_odd:
                first_product = self[m + 2] * self[m] * self[m] * self[m]
                second_product = self[m - 1] * self[m + 1] * self[m + 1] * self[m + 1]
                self._values[n] = (
                    first_product - second_product * self._sixteen_c_squared
                    if m % 2
                    else first_product * self._sixteen_c_squared - second_product
                )
            else:
                bracket = self[m + 2] * self[m - 1] * self[m - 1] - self[m - 2] * self[m + 1] * self[m + 1]
                self._values[n] = self[m] * bracket
        return self._values[n]
