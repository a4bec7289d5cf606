"""What an orbit has in common with multiples of a point on an elliptic curve: found modulo a prime.

Let the points of an orbit be P + n T on an elliptic curve, and their coordinates sections of a line bundle of degree d.
There are d independent sections; those that are no coordinates are found among the products of coordinates of several
points, divided by coordinates of all but one. Two of them vanish at d - 2 points of the orbit, and the quotient z of
these takes each value twice. With sigma functions W(n) of n T and U(n) of n T + d P - s, where s is the sum of the
zeros of a section,

    z(n) - z(m) = W(n - m) U(n + m + k)/(r(n) r(m)),

so that cross ratios of z give quotients of both. Those of consecutive points are 1 - y(2n + k - 1) with

    y(u) = H U(u)^2/(U(u + 1) U(u - 1)),      y(u + 1) y(u) (1 - y(u)) y(u - 1) = H,

where W(2) = H and W(3) = H^3; other four points give y(u) at the u in between, up to one more unknown number.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import product
from math import prod

from flint import nmod

from kahanmaps.algebra.modular_matrices import echelon, integers, kernel, matrix, null_space, pivots
from kahanmaps.maps.orbits.relations.forms import forms
from kahanmaps.maps.somos import around, first_terms

Rows = list[list[int]]

_MOST_PRODUCTS = 64
_MOST_DEGREE = 8
_SPARE = 8  # rows beyond the unknowns: each lets what is no relation pass with a chance of 2^-60
_VALUES = 14  # of z, from which the sequences are found: nine are enough
_POINTS, _LAGS = (2, 3), (1, 2)  # of which products are made


@dataclass(frozen=True)
class Sections:
    """How all sections are made: of products of independent coordinates at so many points, each `lag` before the next.

    There are no products where coordinates are all there is.
    """

    degree: int
    coordinates: tuple[int, ...]
    points: int
    lag: int
    products: tuple[int, ...]

    @property
    def points_used(self) -> int:
        """How many points of the orbit it takes to make them at all that are used."""
        return (self.points - 1) * self.lag + max(self.rows, self.degree - 2 + _VALUES, 2 * self.degree + _SPARE)

    @property
    def rows(self) -> int:
        """How many points sections are found from."""
        unknowns, others = len(self.products), (1 << (self.points - 1)) - 1
        return unknowns + (unknowns + _SPARE) // others + 1


@dataclass(frozen=True)
class Curve:
    """Modulo a prime: `sections`; H, y(2), y(3) and all coefficients of the coordinates, row by row, as residues."""

    sections: Sections
    numbers: list[list[int]]


def points_needed(size: int) -> list[int]:
    """How many points `curve` is to be given for so many coordinates, and how many if it finds nothing with these."""
    products: list[int] = [(size + 1) ** count for count in _POINTS]
    return [number + 2 * _SPARE + 2 * max(_LAGS) for number in products if number <= _MOST_PRODUCTS]


def curve(points: Rows, prime: int, known: Sections | None = None) -> Curve | None:
    """The curve of an orbit whose points have last coordinate 1; None where there is none.

    Raises ArithmeticError where there seems to be one: then the prime is unlucky, or the start is special.
    """
    tries = [known] if known else list(_tries(points, prime))
    for sections in tries:
        values = _all_sections(points, sections, prime)
        with suppress(ZeroDivisionError):
            numbers = _numbers(points, sections, values, prime) if values else None
            if numbers is not None:
                return Curve(sections, numbers)
    if tries:
        raise ArithmeticError("sections are not as on an elliptic curve")
    return None


def _tries(points: Rows, prime: int) -> Iterator[Sections]:
    """How sections may be made: where products are too independent for a curve, or points too few, there is no way."""
    coordinates = tuple(pivots(echelon(points[: len(points[0]) + _SPARE], prime)))
    for count, lag in product(_POINTS, _LAGS):
        size = len(coordinates) ** count
        used = size + _SPARE + (count - 1) * lag
        if len(points) < used:
            continue
        products = pivots(echelon(_table(points[:used], coordinates, count, lag, prime), prime))
        if len(products) > count * _MOST_DEGREE:
            return
        degree, rest = divmod(len(products), count)
        if not rest and 2 <= degree <= _MOST_DEGREE and len(products) < size:
            yield Sections(degree, coordinates, count, lag, () if degree == len(coordinates) else tuple(products))


def _all_sections(points: Rows, sections: Sections, prime: int) -> Rows | None:
    """A basis of all sections at the points that have enough behind them; None where there seems to be none."""
    count, lag, coordinates = sections.points, sections.lag, sections.coordinates
    if not sections.products:
        return [[point[i] for i in coordinates] for point in points[(count - 1) * lag :]]
    # Sections t are such that t g is a sum of products for products g of coordinates of the points before: of the last
    # ones, which are 1, and of combinations that have no zeros in common with these. Sums are what `checks` annihilate.
    values = [[row[k] for k in sections.products] for row in _table(points, coordinates, count, lag, prime)]
    sums = matrix(values[: sections.rows], prime)
    checks = kernel(*sums.transpose().rref())
    factors = [
        [(1, sum((j + 2) ** 3 * x for j, x in enumerate(one))) for one in before]
        for _, *before in _together(points, count, lag)[: sections.rows]
    ]
    weighed = []
    for chosen in list(product((0, 1), repeat=count - 1))[1:]:
        g = [prod(one[i] for one, i in zip(before, chosen, strict=True)) % prime for before in factors]
        weighed += [[c and c * x % prime for c, x in zip(check, g, strict=True)] for check in checks]
    found = kernel(*(matrix(weighed, prime) * sums).rref())
    if len(found) != sections.degree:
        return None
    return integers(matrix(values, prime) * matrix(found, prime).transpose())


def _table(points: Rows, coordinates: Sequence[int], count: int, lag: int, prime: int) -> Rows:
    """The products of these coordinates of so many points."""
    chosen = [[point[i] for i in coordinates] for point in points]
    return [[prod(x) % prime for x in product(*rows)] for rows in _together(chosen, count, lag)]


def _together(points: Rows, count: int, lag: int) -> list[tuple[list[int], ...]]:
    """Each point behind which there are enough, with those before it, nearest first."""
    first = (count - 1) * lag
    return [tuple(points[n - k * lag] for k in range(count)) for n in range(first, len(points))]


def _numbers(points: Rows, sections: Sections, values: Rows, prime: int) -> list[list[int]] | None:
    """Those of `Curve`; None where there is no pencil or sequence, or the coordinates are no sections."""
    degree, first = sections.degree, (sections.points - 1) * sections.lag
    pencil = null_space(values[: degree - 2], degree, prime)
    if len(pencil) != 2:
        return None
    quotients = matrix(values[degree - 2 : degree - 2 + _VALUES], prime) * matrix(pencil, prime).transpose()
    z = [nmod(int(quotients[n, 0]), prime) / int(quotients[n, 1]) for n in range(quotients.nrows())]
    shift = 2 * (first + degree - 2) + (degree - 2) * first + (degree - 2) * (degree - 3) // 2  # of u, for z[0]
    found = _sequence(z, prime)
    if found is None:
        return None
    H, y = found
    y = {m + shift: value for m, value in y.items()}
    for u in range(min(y), 2, -1):
        y[u - 1] = H / (y[u + 1] * y[u] * (1 - y[u]))
    length = (sections.degree * len(points[0])) // (len(points[0]) - 1) + _SPARE
    multiples, others = first_terms(H, y[2], y[3])
    W, U = around(multiples, length + 2), around(others, length + 2, multiples)
    # The rows of coefficients of the coordinates, up to one factor.
    last, rows = len(points[0]) - 1, []
    for n, point in zip(range(2, length), points[2:], strict=False):
        value = [int(entry) for entry in forms(degree, W, U, n)]
        for i in range(last):
            row = [0] * ((last + 1) * degree)
            row[i * degree : (i + 1) * degree] = value
            row[last * degree :] = [-point[i] * entry % prime for entry in value]
            rows.append(row)
    kernel = null_space(rows, (last + 1) * degree, prime)
    return [[int(H)], [int(y[2])], [int(y[3])], kernel[0]] if len(kernel) == 1 else None


def _sequence(z: Sequence[nmod], prime: int) -> tuple[nmod, dict[int, nmod]] | None:
    """H and y at consecutive u, of which the first belongs to the four points around z[2], z[3]; None if z has none."""
    odd = {}  # 1 - cross ratio is y(u)
    even = {}  # 1 - K times this is y(u)
    for n in range(2, len(z) - 1):
        ahead, here, before, behind = z[n + 1], z[n], z[n - 1], z[n - 2]
        odd[2 * n - 1] = 1 - (ahead - here) * (before - behind) / ((ahead - before) * (here - behind))
        if n >= 4:
            far = z[n - 4]
            even[2 * n - 2] = (ahead - before) * (here - far) / ((ahead - far) * (here - before))
    rows = []
    for m in odd:
        if m - 1 in even and m + 1 in even:
            f, a, b = odd[m] * (1 - odd[m]), even[m - 1], even[m + 1]
            rows.append([int(f), int(-f * (a + b)), int(f * a * b), prime - 1])
    kernel = null_space(rows, 4, prime)
    if len(kernel) != 1 or not kernel[0][0]:
        return None
    K, again, H = (nmod(entry, prime) / kernel[0][0] for entry in kernel[0][1:])
    if K * K != again:
        return None
    y = odd | {m: 1 - K * value for m, value in even.items()}
    run = range(min(even), max(even) + 1)
    if any(y[m - 1] * y[m] * (1 - y[m]) * y[m + 1] != H for m in run[1:-1]):
        return None
    return H, {m: y[m] for m in run}
