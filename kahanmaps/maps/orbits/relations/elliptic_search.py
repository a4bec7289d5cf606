"""Search modulo a prime for an elliptic curve on which an orbit is P + n T, with its Somos sequences.

Let the points of an orbit be P + n T on an elliptic curve, and their coordinates sections of a line bundle of degree d.
There are d independent sections. Sections that are not coordinates are products of coordinates of several points,
divided by coordinates of all points but one. Let z be the quotient of two independent sections that vanish at the same
d - 2 points of the orbit; z takes each value twice. With the sigma functions W(n) of n T and U(n) of n T + d P - s,
where s is the sum of the zeros of a section,

    z(n) - z(m) = W(n - m) U(n + m + k)/(r(n) r(m))      for an integer k and a sequence r,

so cross ratios of z give quotients of W and U. The cross ratio at four consecutive points is 1 - y(2n + k - 1) with

    y(u) = H U(u)^2/(U(u + 1) U(u - 1)),      y(u + 1) y(u) (1 - y(u)) y(u - 1) = H,

where W(2) = H and W(3) = H^3. Another choice of four points gives 1 - y(u) at the remaining u, up to a factor K.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import product
from math import prod

from flint import nmod

from kahanmaps.algebra.modular_matrices import echelon, integers, kernel, matrix, null_space, pivots
from kahanmaps.maps.orbits.relations.sections import forms
from kahanmaps.maps.somos import around, first_terms

Rows = list[list[int]]

_MAX_PRODUCTS = 64  # largest number of products of coordinates that are tried as sections
_MAX_DEGREE = 8  # largest degree d of the line bundle
_EXTRA_POINTS = 8  # rows beyond the number of unknowns; a wrong relation passes at each with probability 2^-60
_Z_VALUES = 14  # number of values of z from which the sequences are computed; nine suffice
_POINT_COUNTS, _LAGS = (2, 3), (1, 2)  # possible numbers of points in a product, and possible distances between them


@dataclass(frozen=True)
class Sections:
    """The construction of all sections, as products of independent `coordinates` of `points` points, `lag` steps apart.

    `products` is empty if the coordinates themselves span all sections.
    """

    degree: int
    coordinates: tuple[int, ...]
    points: int
    lag: int
    products: tuple[int, ...]

    @property
    def points_used(self) -> int:
        """The number of points of the orbit that the search uses."""
        row_counts = self.rows, self.degree - 2 + _Z_VALUES, 2 * self.degree + _EXTRA_POINTS
        return (self.points - 1) * self.lag + max(row_counts)

    @property
    def rows(self) -> int:
        """The number of points from which the sections are computed."""
        unknown_count, combinations = len(self.products), (1 << (self.points - 1)) - 1
        return unknown_count + (unknown_count + _EXTRA_POINTS) // combinations + 1


@dataclass(frozen=True)
class Curve:
    """A curve modulo a prime: `sections`; `numbers` are H, y(2), y(3) and the coefficients of the coordinates."""

    sections: Sections
    numbers: list[list[int]]


def points_needed(size: int) -> list[int]:
    """Return the numbers of points to pass to `curve`, in this order of trials, for `size` coordinates."""
    products: list[int] = [(size + 1) ** count for count in _POINT_COUNTS]
    return [number + 2 * _EXTRA_POINTS + 2 * max(_LAGS) for number in products if number <= _MAX_PRODUCTS]


def curve(points: Rows, prime: int, known_sections: Sections | None = None) -> Curve | None:
    """Search for the elliptic curve of an orbit whose points have last coordinate 1; return None if none is found.

    Raises ArithmeticError if the dimensions are those of a curve, but the prime or the initial point is special.
    """
    constructions = [known_sections] if known_sections else []
    if not known_sections:
        coordinates = tuple(pivots(echelon(points[: len(points[0]) + _EXTRA_POINTS], prime)))
        for count, lag in product(_POINT_COUNTS, _LAGS):
            size = len(coordinates) ** count
            point_count = size + _EXTRA_POINTS + (count - 1) * lag
            if len(points) < point_count:
                continue
            values = _products_of_coordinates(points[:point_count], coordinates, count, lag, prime)
            products = pivots(echelon(values, prime))
            if len(products) > count * _MAX_DEGREE:  # the products span a space that is too large for a curve
                break
            degree, remainder = divmod(len(products), count)
            if not remainder and 2 <= degree <= _MAX_DEGREE and len(products) < size:
                new_products = () if degree == len(coordinates) else tuple(products)
                constructions.append(Sections(degree, coordinates, count, lag, new_products))
    for sections in constructions:
        basis = _section_basis(points, sections, prime)
        with suppress(ZeroDivisionError):
            numbers = _numbers_of_curve(points, sections, basis, prime) if basis else None
            if numbers is not None:
                return Curve(sections, numbers)
    if constructions:
        raise ArithmeticError("sections are not as on an elliptic curve")
    return None


def _section_basis(points: Rows, sections: Sections, prime: int) -> Rows | None:
    """Return a basis of the sections at all points that have enough points before them; None if there is no basis."""
    count, lag, coordinates = sections.points, sections.lag, sections.coordinates
    if not sections.products:
        return [[point[i] for i in coordinates] for point in points[(count - 1) * lag :]]
    # t is a section if t g is in the span of the products for all products g of coordinates of the earlier points. Two
    # factors of g suffice: 1 (the last coordinate), and a linear form without zeros in common with the last coordinate.
    all_products = _products_of_coordinates(points, coordinates, count, lag, prime)
    values = [[row[k] for k in sections.products] for row in all_products]
    product_matrix = matrix(values[: sections.rows], prime)
    annihilators = kernel(*product_matrix.transpose().rref())  # the linear forms that are 0 on the span of the products
    factors = [
        [(1, sum((j + 2) ** 3 * x for j, x in enumerate(point))) for point in points_before]
        for _, *points_before in _points_at_lags(points, count, lag)[: sections.rows]
    ]
    weighted_annihilators = []
    for choices in list(product((0, 1), repeat=count - 1))[1:]:
        g = [prod(pair[i] for pair, i in zip(pairs, choices, strict=True)) % prime for pairs in factors]
        weighted_annihilators += [
            [c and c * x % prime for c, x in zip(annihilator, g, strict=True)] for annihilator in annihilators
        ]
    kernel_rows = kernel(*(matrix(weighted_annihilators, prime) * product_matrix).rref())
    if len(kernel_rows) != sections.degree:
        return None
    return integers(matrix(values, prime) * matrix(kernel_rows, prime).transpose())


def _products_of_coordinates(points: Rows, coordinates: Sequence[int], count: int, lag: int, prime: int) -> Rows:
    """Return the products of these coordinates of `count` points, `lag` steps apart."""
    coordinate_rows = [[point[i] for i in coordinates] for point in points]
    return [[prod(x) % prime for x in product(*rows)] for rows in _points_at_lags(coordinate_rows, count, lag)]


def _points_at_lags(points: Rows, count: int, lag: int) -> list[tuple[list[int], ...]]:
    """Return tuples of a point and the `count` - 1 points before it, `lag` steps apart, nearest first."""
    first_index = (count - 1) * lag
    return [tuple(points[n - k * lag] for k in range(count)) for n in range(first_index, len(points))]


def _numbers_of_curve(points: Rows, sections: Sections, values: Rows, prime: int) -> list[list[int]] | None:
    """Return the numbers of a `Curve`; None if there is no pencil or no sequence, or coordinates are not sections."""
    degree, first_index = sections.degree, (sections.points - 1) * sections.lag
    pencil = null_space(values[: degree - 2], degree, prime)
    if len(pencil) != 2:
        return None
    quotients = matrix(values[degree - 2 : degree - 2 + _Z_VALUES], prime) * matrix(pencil, prime).transpose()
    z = [nmod(int(quotients[n, 0]), prime) / int(quotients[n, 1]) for n in range(quotients.nrows())]
    shift = 2 * (first_index + degree - 2) + (degree - 2) * first_index + (degree - 2) * (degree - 3) // 2  # u for z[0]
    sequence = _elliptic_sequence(z, prime)
    if sequence is None:
        return None
    H, y = sequence
    y = {m + shift: value for m, value in y.items()}
    for u in range(min(y), 2, -1):
        y[u - 1] = H / (y[u + 1] * y[u] * (1 - y[u]))
    length = (sections.degree * len(points[0])) // (len(points[0]) - 1) + _EXTRA_POINTS
    initial_W, initial_U = first_terms(H, y[2], y[3])
    W, U = around(initial_W, length + 2), around(initial_U, length + 2, initial_W)
    # The coefficients of the coordinates, up to a common factor.
    last_column, rows = len(points[0]) - 1, []
    for n, point in zip(range(2, length), points[2:], strict=False):
        value = [int(entry) for entry in forms(degree, W, U, n)]
        for i in range(last_column):
            row = [0] * ((last_column + 1) * degree)
            row[i * degree : (i + 1) * degree] = value
            row[last_column * degree :] = [-point[i] * entry % prime for entry in value]
            rows.append(row)
    kernel = null_space(rows, (last_column + 1) * degree, prime)
    return [[int(H)], [int(y[2])], [int(y[3])], kernel[0]] if len(kernel) == 1 else None


def _elliptic_sequence(z: Sequence[nmod], prime: int) -> tuple[nmod, dict[int, nmod]] | None:
    """Return H, and a dict {m: y(m + shift)} for consecutive m, where `shift` is that of `_numbers_of_curve`.

    Returns None if z does not come from sequences W and U.
    """
    y_at_odd = {}  # y(u) is 1 minus this cross ratio
    values_at_even = {}  # y(u) is 1 minus K times this value
    for n in range(2, len(z) - 1):
        z1, z0, z_1, z_2 = z[n + 1], z[n], z[n - 1], z[n - 2]
        y_at_odd[2 * n - 1] = 1 - (z1 - z0) * (z_1 - z_2) / ((z1 - z_1) * (z0 - z_2))
        if n >= 4:
            z_4 = z[n - 4]
            values_at_even[2 * n - 2] = (z1 - z_1) * (z0 - z_4) / ((z1 - z_4) * (z0 - z_1))
    rows = []
    for m in y_at_odd:
        if m - 1 in values_at_even and m + 1 in values_at_even:
            f, a, b = y_at_odd[m] * (1 - y_at_odd[m]), values_at_even[m - 1], values_at_even[m + 1]
            rows.append([int(f), int(-f * (a + b)), int(f * a * b), prime - 1])
    kernel = null_space(rows, 4, prime)
    if len(kernel) != 1 or not kernel[0][0]:
        return None
    K, K_squared, H = (nmod(entry, prime) / kernel[0][0] for entry in kernel[0][1:])
    if K * K != K_squared:
        return None
    y = y_at_odd | {m: 1 - K * value for m, value in values_at_even.items()}
    indices = range(min(values_at_even), max(values_at_even) + 1)
    if any(y[m - 1] * y[m] * (1 - y[m]) * y[m + 1] != H for m in indices[1:-1]):
        return None
    return H, {m: y[m] for m in indices}
