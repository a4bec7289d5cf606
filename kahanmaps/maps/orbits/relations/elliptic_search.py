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

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from typing import Any

from flint import nmod, nmod_mat

from kahanmaps.maps.orbits.relations.somos import divisibility, extended

Rows = list[list[int]]

_MOST_PRODUCTS = 64
_MOST_DEGREE = 8
_SPARE = 8  # rows beyond the unknowns: each lets what is no relation pass with a chance of 2^-60
_VALUES = 14  # of z, from which the sequences are found: nine are enough
LAGS = (1, 2)


@dataclass(frozen=True)
class Sections:
    """How all sections are made of the coordinates at so many points, each `lag` before the next."""

    degree: int
    points: int
    lag: int

    def points_used(self, dim: int) -> int:
        """How many points of the orbit it takes to make them at all that are used."""
        first = (self.points - 1) * self.lag
        unknowns, forms = self.points * self.degree, dim + 2 * self.points - 3
        rows = 0 if self.degree == dim + 1 else (unknowns * (forms + 1) + _SPARE) // forms + 1
        return first + max(rows, self.degree - 2 + _VALUES, 2 * self.degree + _SPARE)


@dataclass(frozen=True)
class Curve:
    """Modulo a prime: `sections`, then H, y(2), y(3) and the rows of coefficients of the coordinates, as residues."""

    sections: Sections
    numbers: list[int]


def points_needed(dim: int) -> int:
    """How many points `curve` has to be given."""
    coordinates = dim + 1
    return (coordinates**3 if coordinates**3 <= _MOST_PRODUCTS else coordinates**2) + 2 * _SPARE + 2 * max(LAGS)


def curve(points: Rows, prime: int, known: Sections | None = None) -> Curve | None:
    """The curve of an orbit whose points have last coordinate 1; None where there is none."""
    coordinates = len(points[0])
    tries = [(count, lag) for count in (2, 3) for lag in LAGS if coordinates**count <= _MOST_PRODUCTS]
    for count, lag in [(known.points, known.lag)] if known else tries:
        found = _all_sections(points, count, lag, prime)
        if found is None:
            continue
        sections, values = found
        try:
            numbers = _numbers(points, sections, values, prime)
        except ZeroDivisionError:  # of an unlucky prime, or a start that is special
            numbers = None
        if numbers is not None:
            return Curve(sections, numbers)
    return None


def _all_sections(points: Rows, count: int, lag: int, prime: int) -> tuple[Sections, Rows] | None:
    """A basis of all sections at the points from number (count - 1) lag on; None where there seems to be none."""
    coordinates, first = len(points[0]), (count - 1) * lag
    table = [[prod(x) % prime for x in product(*rows)] for rows in _together(points, count, lag)]
    size = coordinates**count
    pivots = _pivots(table[: size + _SPARE], prime)
    degree, rest = divmod(len(pivots), count)
    if rest or not 3 <= degree <= _MOST_DEGREE or len(pivots) == size:
        return None
    sections = Sections(degree, count, lag)
    if degree == coordinates:
        return sections, points[first:]
    # Sections t are such that t g is a sum of products for products g of coordinates of the points before: of the last
    # coordinates, which are 1, and of combinations that have no zeros in common.
    values = [[row[k] for k in pivots] for row in table]
    unknowns, forms = len(pivots), coordinates + 2 * count - 4
    rows = []
    for value, (_, *before) in zip(values, _together(points, count, lag), strict=True):
        for k in range(forms):
            g = prod(sum((k + 2 + i) ** (j + 1) * x for j, x in enumerate(one)) for i, one in enumerate(before)) % prime
            row = [0] * (unknowns * (forms + 1))
            row[:unknowns] = [entry * g % prime for entry in value]
            row[unknowns * (k + 1) : unknowns * (k + 2)] = [-entry % prime for entry in value]
            rows.append(row)
        if len(rows) >= unknowns * (forms + 1) + _SPARE:
            break
    kernel = _kernel(rows, prime)
    if len(kernel) != degree:
        return None
    basis = nmod_mat([vector[:unknowns] for vector in kernel], prime).transpose()
    return sections, _integers(nmod_mat(values, prime) * basis)


def _together(points: Rows, count: int, lag: int) -> list[tuple[list[int], ...]]:
    """Each point behind which there are enough, with those before it, nearest first."""
    first = (count - 1) * lag
    return [tuple(points[n - k * lag] for k in range(count)) for n in range(first, len(points))]


def _numbers(points: Rows, sections: Sections, values: Rows, prime: int) -> list[int] | None:
    degree, first = sections.degree, (sections.points - 1) * sections.lag
    pencil = _kernel(values[: degree - 2], prime) if degree > 2 else []
    if len(pencil) != 2:
        return None
    quotients = nmod_mat(values[degree - 2 : degree - 2 + _VALUES], prime) * nmod_mat(pencil, prime).transpose()
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
    W, U = sequences(H, y[2], y[3], length + 3)
    coefficients = _coefficients(points, [forms(degree, W, U, n) for n in range(2, length)], prime)
    return None if coefficients is None else [int(H), int(y[2]), int(y[3]), *coefficients]


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
    kernel = _kernel(rows, prime)
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


def sequences(H: Any, y: Any, z: Any, length: int) -> tuple[list[Any], list[Any]]:
    """W and U from n = 0 on, where U(0) is no term, from H, y(2) and y(3), with U(1) = U(2) = 1.

    Over any field. Raises ZeroDivisionError.
    """
    one = H / H
    alpha, beta = H**2, -(H**3)
    U = extended([one, one, H / y, (H / y) ** 2 * H / z], alpha, beta, max(length - 1, 6))
    W = extended(divisibility(U[:6], H), alpha, beta, length - 1)
    return [0 * one, *W], [0 * one, *U]


def forms(degree: int, W: Sequence[Any], U: Sequence[Any], n: int) -> list[Any]:
    """A basis of the sections at n >= 2, see `exponents`."""
    square, outer = W[n] * W[n], W[n + 1] * W[n - 1]
    first, second = U[n], U[n + 1] * W[n - 1]
    first, second = (first, second * W[n]) if degree % 2 else (first * W[n], second)
    return [(second if k else first) * square**i * outer**j for k, i, j in exponents(degree)]


def exponents(degree: int) -> list[tuple[int, int, int]]:
    """0 for U(n) or 1 for U(n + 1) W(n - 1), and powers of W(n)^2 and W(n + 1) W(n - 1), in a basis of the sections.

    One of the first two is to be multiplied by W(n), the second for odd degree.
    """
    tops = ((degree - 1) // 2, (degree - 2) // 2)
    return [(k, top - j, j) for k, top in enumerate(tops) for j in range(top + 1)]


def _coefficients(points: Rows, values: list[list[nmod]], prime: int) -> list[int] | None:
    """The rows of coefficients of the coordinates, up to one factor; None where the coordinates are no sections."""
    last, degree = len(points[0]) - 1, len(values[0])
    rows = []
    for point, entries in zip(points[2:], values, strict=False):
        value = [int(entry) for entry in entries]
        for i in range(last):
            row = [0] * ((last + 1) * degree)
            row[i * degree : (i + 1) * degree] = value
            row[last * degree :] = [-point[i] * entry % prime for entry in value]
            rows.append(row)
    kernel = _kernel(rows, prime)
    return kernel[0] if len(kernel) == 1 else None


def _pivots(rows: Rows, prime: int) -> list[int]:
    """The columns that those before them do not span."""
    reduced, rank = nmod_mat(rows, prime).rref()
    return [next(k for k in range(len(rows[0])) if int(reduced[i, k])) for i in range(rank)]


def _kernel(rows: Rows, prime: int) -> Rows:
    """A basis of the vectors that all rows annihilate, each with a 1, and the same for all primes but a few."""
    reduced, rank = nmod_mat(rows, prime).rref()
    width = len(rows[0])
    table = _integers(reduced)[:rank]
    pivots = [next(k for k, entry in enumerate(row) if entry) for row in table]
    basis = []
    for k in sorted(set(range(width)) - set(pivots)):
        vector = [0] * width
        vector[k] = 1
        for pivot, row in zip(pivots, table, strict=True):
            vector[pivot] = -row[k] % prime
        basis.append(vector)
    return basis


def _integers(matrix: nmod_mat) -> Rows:
    return [[int(entry) for entry in row] for row in matrix.tolist()]
