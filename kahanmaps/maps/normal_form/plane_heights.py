"""The canonical height of the translation of a plane, over Q or a number field Q[t]/g.

With integral coefficients of h and integral coordinates (U : V : W), let u = W (W^2 + D) and G = u^2 - disc(h) h^2, so
that gamma = G/u^2. With x = 4 u^2 X the Jacobian is the curve with b2 = 9 u^2 + 3 G, b4 = 6 G u^2, b6 = 4 G^2 u^2. It
has an integral Weierstrass equation: modulo 4, disc(h) is the square of s = ad + bc, and b2 = disc(h) h^2, hence
a1 = s h, a3 = 0, a2 = (b2 - a1^2)/4, a4 = b4/2, a6 = b6/4. So at each prime the points with nonsingular reduction form
a group. If m T belongs to this group at all primes, no doubling of m T cancels a common factor, and only the
archimedean parts of Tate's series remain. The first doubling shows at which primes m T belongs to the group. Factors
that are cancelled at the other primes divide a resultant R; hence R bounds the rest of the series.
"""

from __future__ import annotations

import math
from itertools import product
from typing import Any

from flint import acb, arb, fmpq_poly, fmpz

from kahanmaps.algebra.elliptic_curves import MAX_BITS, EllipticCurve
from kahanmaps.algebra.fields import RR
from kahanmaps.algebra.integers import split_by_primes
from kahanmaps.algebra.reduction import norm_of_denominator
from kahanmaps.errors import PrecisionLost
from kahanmaps.maps.normal_form.planar_block import PlanarBlock, Triple

_MULTIPLES = 24  # the largest m for which the reduction of m T is examined
_LARGE_MULTIPLE = 50  # if no such m T has nonsingular reduction at all primes, a multiple with m >= this is used
_MAX_COEFFICIENT = 3  # largest coefficient of elements by which the model is reduced
_TERMS = 40  # number of terms of Tate's series; they decrease like 4^-n
_ACCURACY = 1e-14  # requested accuracy of heights


def plane_height(block: PlanarBlock, point: Triple) -> arb:
    """Return the canonical height of T, normalized like half the height of x(T), as a ball.

    Args:
        block: the cubic of the plane, with coefficients in Q[t]/g, g irreducible.
        point: a point of a smooth level, on which T has infinite order.

    The height is absolute, i.e. the height over the field divided by the degree. The ball is wide if no small multiple
    of T has nonsingular reduction at all primes. Raises PrecisionLost if balls of 32768 bits do not suffice.
    """
    K = point[0].field
    coefficients, (U, V, W) = [block.a, block.b, block.c, block.d], point
    scale, point_scale = _denominator(coefficients), _denominator(point)
    # Multiplying both h and W by `scale` changes neither delta nor the orbit.
    a, b, c, d = (scale * x for x in coefficients)
    block, U, V, W = PlanarBlock(a, b, c, d), point_scale * U, point_scale * V, point_scale * scale * W
    p, q, r = block.D
    u, h = W * (W * W + p * U * U + q * U * V + r * V * V), block.h(U, V)
    G = u * u - block.discriminant * h * h
    (b2, b4, b6, b8), w = _reduce_model((9 * u * u + 3 * G, 6 * G * u * u, 4 * G * G * u * u, 3 * G**3 * u * u))
    curve, T = EllipticCurve(b2 / 4, b4 / 2, b6 / 4), (K.zero, G * u / w**3)
    resultant = (16 * curve.discriminant) ** 2
    norm = abs(K.norm(resultant)).p

    def uncertain_part(Q: Any) -> fmpz:
        """Return the part of the norm of `resultant` at the primes where doubling Q cancels factors; 1 if none."""
        # The numerator of x(2Q) is a quartic form, the denominator 4 Y^2; `norm_of_denominator` gives norms of ideals.
        full_norm = abs(K.norm(4 * Q[1] * Q[1])) * norm_of_denominator(Q[0]) ** 4
        cancelled_norm = full_norm / norm_of_denominator(curve.add(Q, Q)[0])  # type: ignore[index]  # T has infinite order
        return split_by_primes(norm, cancelled_norm.p)[1]

    multiples, Q = list[tuple[fmpz, int, Any]](), T
    while len(multiples) < _MULTIPLES and (not multiples or multiples[-1][0] > 1):
        multiples.append((uncertain_part(Q), len(multiples) + 1, Q))
        Q = curve.add(Q, T)  # type: ignore[assignment]
    cancelled_part, m, Q = min(multiples, key=lambda entry: float(arb(entry[0]).log()) / entry[1] ** 2)
    while cancelled_part > 1 and m < _LARGE_MULTIPLE:  # doubling adds no uncertain primes
        m, Q = 2 * m, curve.add(Q, Q)  # type: ignore[assignment]
    height = _archimedean_height(Q[0], (b2, b4, b6, b8), resultant)
    with RR(128).working():  # the remaining cancelled factors divide R, and lower the height
        correction = arb(cancelled_part).log() / (6 * K.degree)
        result: arb = (height - correction + arb(0, correction.upper())) / (2 * m * m)
    return result


def _reduce_model(b: tuple[Any, ...]) -> tuple[tuple[Any, ...], Any]:
    """Return b2/w^2, b4/w^4, b6/w^6, b8/w^8 and w, a product of small elements for which these quotients are integral.

    The curve must keep an integral Weierstrass equation at each prime; for primes over 2 this equation is searched for.
    """
    K, divisor = b[0].field, b[0].field.one
    vectors = list(product(range(-_MAX_COEFFICIENT, _MAX_COEFFICIENT + 1), repeat=K.degree))
    elements = [K.convert(fmpq_poly(list(vector))) * _denominator([K.generator]) for vector in vectors if any(vector)]
    indices_by_norm = sorted((abs(K.norm(w)), k) for k, w in enumerate(elements))
    residues = [K.convert(fmpq_poly(list(vector))) for vector in product((0, 1), repeat=K.degree)]

    def has_equation(b2: Any, b4: Any, b6: Any) -> bool:
        return any(
            _is_integral((b2 - a1 * a1) / 4) and _is_integral((b4 - a1 * a3) / 2) and _is_integral((b6 - a3 * a3) / 4)
            for a1 in residues
            for a3 in residues
        )

    for norm, k in indices_by_norm:
        w = elements[k]
        while norm > 1:
            quotients = tuple(x / w**power for x, power in zip(b, (2, 4, 6, 8), strict=True))
            if not all(map(_is_integral, quotients)) or (norm.p % 2 == 0 and not has_equation(*quotients[:3])):
                break
            b, divisor = quotients, divisor * w
    return b, divisor


def _is_integral(element: Any) -> bool:
    return bool(element.matrix.charpoly().denom() == 1)


def _denominator(elements: Any) -> int:
    """Return an integer whose products with all `elements` of Q[t]/g are integral."""
    denominator = fmpz(1)
    for element in elements:
        denominator = denominator.lcm(element.polynomial.denom())
    field = elements[0].field
    return int(denominator * field.chi.denom() ** (field.degree - 1))


def _archimedean_height(x: Any, b: Any, resultant: Any) -> arb:
    """Return the height of x plus the archimedean terms of Tate's series."""
    K = x.field
    for bits in (1 << 9, 1 << 11, 1 << 13, MAX_BITS):
        with RR(bits).working():
            total = arb(norm_of_denominator(x)).log()
            for root, _ in K.chi.complex_roots():
                X, b2, b4, b6, b8, R = (value_at_root(element, acb(root)) for element in (x, *b, resultant))
                Z, scale = acb(1), arb(1)
                largest = sum((abs(c) for c in (b2, 2 * b4, 2 * b6, b8)), arb(4))
                bound = abs(abs(R).log()) + 8 * largest.log() + math.log(math.factorial(8))
                for k in range(_TERMS + 1):
                    size = abs(X).max(abs(Z))
                    total += scale * size.log()
                    X, Z = X / size, Z / size
                    X, Z = (
                        X**4 - b4 * (X * Z) ** 2 - 2 * b6 * X * Z**3 - b8 * Z**4,
                        4 * X**3 * Z + b2 * (X * Z) ** 2 + 2 * b4 * X * Z**3 + b6 * Z**4,
                    )
                    scale /= 4 if k < _TERMS else 1
                total += arb(0, (scale * bound).upper())
            if total.is_finite() and float(total.rad()) < _ACCURACY:
                result: arb = total / K.degree
                return result
    raise PrecisionLost(f"the height needs more than {MAX_BITS} bits: the level is almost singular")


def value_at_root(element: Any, root: Any) -> Any:
    """Return the value of an element of Q[t]/g at a root of g, a real or complex ball."""
    total = 0 * root
    for coefficient in reversed(element.polynomial.coeffs()):
        total = total * root + arb(coefficient)
    return total
