"""The n-th point of an orbit in a plane over any field, directly: a translation on a plane cubic, by doublings.

In balls the formulas of `tau` are used, with natural lifts and without scales, since they lose the fewest bits. For
exact elements another method is faster. On the Jacobian Y^2 = x^3 + ... (`level_curves`), n T is computed by doublings
and additions. With natural lifts of the points around a base point, chi as in `tau`, and n T = (x, Y), the point is

    P_n ~ chi_0 x (x - x_u) P_0 + chi_{-1} (Y - Y_u - m (x - x_u)) P_1 - chi_1 (Y - Y_u - m' (x - x_u)) P_{-1},

with m = (Y_u + 8 gamma)/x_u and m' = (Y_u - 8 gamma)/x_u, where u = (x_u, Y_u) is the difference between the zero of
chi and the base point (docs/mathematics.md). If the level cubic consists of three lines (gamma = 0), Psi^3 is a
projective map of each line to itself, and its iterates are powers of a 2 x 2 matrix. If delta = 0, there is a formula
for P_n: see `parabolic_ratio`.

P_n is the value of the rational map Psi^n, even if the orbit by single steps would reach a pole W = 0 before.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

from kahanmaps.errors import SingularStep
from kahanmaps.maps.normal_form.planar_block import PlanarBlock, Triple, same_point
from kahanmaps.maps.normal_form.tau import first_chi

# Number of base points that are tried until no divisor is zero.
_MAX_BASES = 12
_MAX_SINGLE_STEPS = 16  # up to this n, the point is computed by single steps


class NoTranslation(Exception):
    """Doublings do not apply to an orbit, which must be computed step by step."""


def iterate(
    block: PlanarBlock, start: Triple, n: int, is_zero: Callable[[Any], bool], *, inexact: bool = False
) -> Triple:
    """Return P_n for n >= 0, as a triple up to a factor, over a field of characteristic 0 or at least 5.

    `is_zero` decides whether an element is zero; `inexact` says that elements are balls. Raises SingularStep if one of
    the first points, which are computed step by step, is a pole; NoTranslation if a divisor is 0 at every base point.

    >>> from kahanmaps.algebra.fields import GF
    >>> F = GF(10007)
    >>> block = PlanarBlock(*map(F.convert, (1, 2, 0, 5)))
    >>> point = start = (F.convert(3), F.convert(4), F.one)
    >>> for _ in range(100):
    ...     point = block.image(point)
    >>> same_point(point, iterate(block, start, 100, F.is_zero))
    True
    """
    points = _first_points(block, [start], min(n, _MAX_SINGLE_STEPS if n <= _MAX_SINGLE_STEPS else 4), is_zero)
    if len(points) > n:
        return points[n]
    numerator, denominator = block.level(start)
    if numerator == 0 or block.discriminant == 0:
        # delta = 0, and the start has an image. (U/W, V/W) is the sum of two parts. In n steps the first part, on which
        # h = 0 (or h has its simple root), is multiplied by r/(r - n), and the second part, in the double root of h, is
        # multiplied by ((r - n)^2 - 1)/(r^2 - 1).
        U, V, W = block.image(start)
        pairs = [(start[0] / start[2], U / W), (start[1] / start[2], V / W)]  # coordinates of the start and its image
        r = parabolic_ratio(block, start)
        if r is None:
            u, v = (z + n * (w - z) for z, w in pairs)
            return u, v, W / W
        difference, divisor = r - n, r * r - 1
        factor = difference * (difference * difference - 1)
        double_root_parts = [(z * r * (r + 1) - w * divisor) / (3 * r) for z, w in pairs]
        u, v = ((z - part) * r * divisor + part * factor for (z, _), part in zip(pairs, double_root_parts, strict=True))
        return u, v, difference * divisor
    level = numerator / denominator
    gamma = 1 - block.discriminant * level * level
    if is_zero(gamma):  # three lines, permuted by Psi: P_n, P_{n+3}, ... are on the same line
        points = _first_points(block, points, n % 3 + 10, is_zero)
        return _point_along_line(points[n % 3 : n % 3 + 10 : 3], n // 3, is_zero)
    # The formulas divide by values that are zero at special points: in that case the next base point is tried.
    for base in range(3, _MAX_BASES + 3):
        points = _first_points(block, points, base + 3 if inexact else base + 1, is_zero)
        if not inexact:
            point = _point_by_curve(points[base - 3 : base + 2], gamma, n - base + 1, is_zero)
        else:
            point = _point_by_doublings(block, points[base - 3 :], gamma, n - base, is_zero) if n - base >= 8 else None
        if point is not None:
            return point
    raise NoTranslation


def parabolic_ratio(block: PlanarBlock, start: Triple) -> Any:
    """Return r = W/s, s^2 = -D, at a start with delta = 0 and an image; None if D = 0 (P_n = P_0 + n (P_1 - P_0)).

    A step decreases r by 1. The image has W' = W^2 - s^2, which is 0 for r = 1 or r = -1. So the orbit meets a pole at
    step r if r is a positive integer, and no pole otherwise. r is computed from r^2 at the start and at its image.
    """

    def squared_ratio(point: Triple) -> Any:
        U, V, W = point
        a, b, c = block.D
        denominator = a * (U * U) + b * (U * V) + c * (V * V)
        return None if denominator == 0 else -(W * W) / denominator

    squared_ratio_at_start = squared_ratio(start)
    return (
        None if squared_ratio_at_start is None else (squared_ratio_at_start - squared_ratio(block.image(start)) + 1) / 2
    )


def _first_points(
    block: PlanarBlock, points: list[Triple], last_index: int, is_zero: Callable[[Any], bool]
) -> list[Triple]:
    """Return P_0, P_1, ..., P_last, as natural lifts from the second point on. Raises SingularStep at a pole."""
    points = list(points)
    for k in range(len(points) - 1, last_index):
        U, V, W = block.image(points[k])
        if is_zero(W):
            raise SingularStep(f"the map is not defined at step {k}")
        if k:
            inverse = 1 / points[k - 1][2]
            U, V, W = U * inverse, V * inverse, W * inverse
        points.append((U, V, W))
    return points


def _point_along_line(points: Sequence[Triple], n: int, is_zero: Callable[[Any], bool]) -> Triple:
    """Return the n-th point of an orbit of a projective map of a line, from its first four points."""
    P, Q = points[0], points[1]
    if same_point(P, Q):
        return P
    # Coordinates (x, y) stand for x P + y Q. Two entries in which P and Q are independent give (x, y).
    i, j = next((i, j) for i, j in ((0, 1), (0, 2), (1, 2)) if not is_zero(P[i] * Q[j] - P[j] * Q[i]))
    determinant = P[i] * Q[j] - P[j] * Q[i]
    (a, b), (c, d) = (
        ((R[i] * Q[j] - R[j] * Q[i]) / determinant, (P[i] * R[j] - P[j] * R[i]) / determinant) for R in points[2:4]
    )
    # The matrix maps (1, 0) to r (0, 1), (0, 1) to (a, b), and (a, b) to a multiple of (c, d):
    # r a (0, 1) + b (a, b) ~ (c, d).
    if is_zero(a):
        return Q
    if is_zero(b):  # the third point is P again
        return points[n % 2]
    if is_zero(c):  # the fourth point is Q; since a translation on the line has no period 2, P_3 = P_1
        raise NoTranslation
    r = (b * a * d / c - b * b) / a
    # The first column of the n-th power of the matrix with these rows.
    one = a / a
    x, y = one, one - one
    (p, q), (s, t) = (one - one, a), (r, b)
    while n:
        if n & 1:
            x, y = p * x + q * y, s * x + t * y
        n >>= 1
        if n:
            p, q, s, t = p * p + q * s, q * (p + t), s * (p + t), t * t + q * s
    return (x * P[0] + y * Q[0], x * P[1] + y * Q[1], x * P[2] + y * Q[2])


def _point_by_curve(points: Sequence[Triple], gamma: Any, n: int, is_zero: Callable[[Any], bool]) -> Triple | None:
    """Return P_n, counted from the third of five consecutive points, n > 0; None if a divisor is zero."""
    P = dict(zip(range(-2, 3), points, strict=False))
    chi = first_chi(P, range(-1, 3))
    if any(is_zero(value) for value in chi.values()):
        return None
    # n T = (x, Y), None for zero, from an expansion of n with digits 0 and odd digits from -3 to 3. With x + shift
    # instead of x the curve is Y^2 = x^3 + c x + ...
    one, shift, c = gamma / gamma, 3 + gamma, -3 * (gamma - 1) * (gamma - 9)
    odd_multiples = {1: (shift, 8 * gamma), 3: (shift - 32 * one / 9, 224 * one / 27 - 8 * gamma)}
    odd_multiples |= {-k: (x, -y) for k, (x, y) in odd_multiples.items()}
    nT: tuple[Any, Any] | None = None
    for digit, zero_count in _digits(n):
        x, y = odd_multiples[digit]
        if nT is None:
            nT = x, y
        elif is_zero(difference := x - nT[0]):
            nT = _times_power(x, y, c, 1) if is_zero(y - nT[1]) else None
        else:
            chord_slope = (y - nT[1]) / difference
            x_sum = chord_slope * chord_slope - nT[0] - x
            nT = x_sum, chord_slope * (x - x_sum) - y
        if nT is not None:
            nT = _times_power(*nT, c, zero_count)
    if nT is None:
        return P[0]
    x, Y = nT[0] - shift, nT[1]
    ratio = 1 / (chi[0] * chi[2] * chi[-1])
    x_u = -4 * chi[-1] * chi[1] * (ratio * chi[2] * chi[-1]) * (ratio * chi[2] * chi[-1])
    eight_gamma = 8 * gamma
    Y_u = -(chi[1] * chi[0] * chi[0] * ratio * x_u * (3 * gamma + x_u) + 3 * x_u + eight_gamma)
    dx, dY = x - x_u, Y - Y_u
    slope = dx / x_u
    A, B = chi[0] * x * dx, chi[-1] * (dY - (Y_u + eight_gamma) * slope)
    C = -chi[1] * (dY - (Y_u - eight_gamma) * slope)
    U, V, W = (A * p + B * q + C * r for p, q, r in zip(P[0], P[1], P[-1], strict=True))
    return None if all(map(is_zero, (U, V, W))) else (U, V, W)


def _times_power(x: Any, y: Any, c: Any, count: int) -> tuple[Any, Any] | None:
    """Return 2^count times the point (x, y), None for zero. FLINT multiplies by integers slowly, so sums are used."""
    try:
        for _ in range(count):
            square = x * x
            slope = (square + square + square + c) / (y + y)
            X = slope * slope - x - x
            x, y = X, slope * (x - X) - y
    except ZeroDivisionError:
        return None
    return x, y


@lru_cache(maxsize=16)
def _digits(n: int) -> list[tuple[int, int]]:
    """Return the odd digits from -3 to 3 of n > 0, highest first, each with the number of binary places to the next.

    >>> _digits(100)
    [(3, 3), (1, 2)]
    """
    digits, zeros_after = [], 0
    while n:
        zero_count = (n & -n).bit_length() - 1
        n, zeros_after = n >> zero_count, zero_count
        digit = (n + 4) % 8 - 4
        digits.append((digit, zeros_after))
        n -= digit
    return digits[::-1]


def _point_by_doublings(
    block: PlanarBlock, points: Sequence[Triple], gamma: Any, n: int, is_zero: Callable[[Any], bool]
) -> Triple | None:
    """Return P_n, counted from the fourth of seven consecutive points, n >= 8; None if a divisor is zero."""
    # Natural lifts around this base point: the first two lifts determine all others.
    P = {-3: points[0], -2: points[1]}
    for k in range(-2, 3):
        denominator = P[k - 1][2]
        U, V, W = block.image(P[k])
        P[k + 1] = (U / denominator, V / denominator, W / denominator)
    chi = first_chi(P, range(-2, 3))
    if any(is_zero(chi[k]) for k in (-2, -1, 0, 1)):
        return None
    one = gamma / gamma
    one_half = one / 2
    inverse = {k: one / chi[k] for k in (-2, -1, 0, 1)}
    # The values psi_{-2}, ..., psi_5 and chi_0, chi_1, chi_2 around the index 1.
    psi_values = [*(k * one for k in range(-2, 5)), 32 * one - 27 * gamma]
    chi_values, center = [chi[k] for k in range(3)], 1
    for digit in f"{n:b}"[1:]:
        # The values around 2 `center` + digit, computed from the values around `center`.
        first_index = center - 3
        squares = [value * value for value in psi_values]
        neighbours = [None, *(psi_values[k + 1] * psi_values[k - 1] for k in range(1, 7)), None]
        # Cube roots of gamma: the square of psi_k, 3 | k, gets the factor gamma unless 3 divides the neighbours' index.
        squares_by_index = [gamma * s if (first_index + k) % 3 == 0 else s for k, s in enumerate(squares)]
        shift = 2 * center + int(digit) - 3
        psi_values = []
        for m in range(shift, shift + 8):
            k = m // 2 - first_index
            a, b = (k + 1, k) if m % 2 else (k + 1, k - 1)
            # Of two indices at distance 1 or 2 at most one is divisible by 3, so `squares_by_index` is right for both.
            value = neighbours[a] * squares_by_index[b] - neighbours[b] * squares_by_index[a]
            psi_values.append(value if m % 2 else value * one_half)
        neighbour_product, square = chi_values[0] * chi_values[2], chi_values[1] * chi_values[1]
        is_center_divisible, chi_values = center % 3 == 0, []
        for m in (shift + 2, shift + 3, shift + 4):
            b = m - center
            k = b - first_index
            if is_center_divisible and b % 3 == 0:
                value = neighbour_product * squares[k] - neighbours[k] * square
            else:
                value = neighbour_product * squares_by_index[k] - neighbours[k] * (
                    gamma * square if is_center_divisible else square
                )
            chi_values.append(value * inverse[center - b])
        center = 2 * center + int(digit)
    psi_before, psi_n, psi_after = psi_values[2:5]
    A, B, C = (
        -2 * (psi_before * psi_after * chi_values[1]),
        psi_n * psi_after * chi_values[0],
        psi_before * psi_n * chi_values[2],
    )
    U, V, W = (A * p + B * q + C * r for p, q, r in zip(P[0], P[1], P[-1], strict=True))
    return U, V, W
