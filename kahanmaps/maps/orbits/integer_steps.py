"""A map over Q on integer points: numerators over ONE common denominator.

A point is x = X / W with integers X and W > 0 without a common factor. The equation M(x) x~ = r(x), times a power of W
and a common denominator of its coefficients, is a linear system with integers that are forms of (X, W). No rational
number is formed on the way: a rational constructor runs a gcd that costs more than the rest of the step.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

from flint import fmpq, fmpq_mat, fmpz, fmpz_mat

from kahanmaps.maps.orbits.constant_rows import ConstantRows
from kahanmaps.maps.orbits.elimination import eliminated
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.two_adic import short_solution

Exponents = tuple[int, ...]
Terms = tuple[tuple[int, fmpq], ...]


class IntegerSteps:
    """Steps of the map with the equation (M | -r) on integer points.

    `exponents` are those of the monomials in (X, W), all of one degree; the rational coefficients of entry (i, j) are
    the pairs (monomial, coefficient) of `terms[i][j]`.
    """

    def __init__(self, exponents: Sequence[Exponents], terms: Sequence[Sequence[Terms]]) -> None:
        n = self._dim = len(terms)
        self._degree = sum(exponents[0])
        self._exponents = exponents
        entries = [fmpz(0)] * (n * (n + 1) * len(exponents))
        self._scale = fmpz(1)
        for i, row in enumerate(terms):
            below = fmpz(1)
            for entry in row:
                for _, coefficient in entry:
                    below = below.lcm(coefficient.q)
            self._scale *= below
            for j, entry in enumerate(row):
                for k, coefficient in entry:
                    sign = 1 if j < n else -1
                    entries[(i * (n + 1) + j) * len(exponents) + k] = sign * coefficient.p * (below // coefficient.q)
        self._forms = fmpz_mat(n * (n + 1), len(exponents), entries)
        self._trials = _TRIALS  # of the elimination that are left; none is counted where it is right
        self._growth = inf  # the bits of the last image over those of its point
        self._is_diagonal = all(i == j or not terms[i][j] for i in range(n) for j in range(n))
        self._constant = self._constant_rows()

    def step(self, point: IntegerPoint) -> IntegerPoint | None:
        """The image, or None where the map has no value."""
        matrix, right = self._equation(point)
        if self._is_diagonal:
            return _quotients(matrix, right)
        found = None
        if self._growth < _SLOW_GROWTH and point.bits >= self._short_from():
            found = short_solution(matrix, right, int(point.bits * (self._growth + 1 / 64)))
        if found is None:
            found = self._solution(matrix, right, point.denominator)
        self._growth = inf if found is None else found.bits / point.bits
        return found

    def _short_from(self) -> float:
        """From how many bits of a point on its image is looked for modulo powers of 2."""
        if self._dim < _SHORT_DIMENSION:
            return inf
        helps = self._dim < _LARGE_DIMENSION and self._constant is None and self._trials > 0
        return _VERY_LONG if helps else _LONG / self._dim**2

    def _solution(self, matrix: fmpz_mat, right: fmpz_mat, below: fmpz) -> IntegerPoint | None:
        if self._constant is None:
            return self._by_elimination(matrix, right, below) or _solved(matrix, right)
        scale = below**self._degree
        rest, side = self._constant.without(matrix, right, scale)
        found = _solved(rest, side) if rest.nrows() else IntegerPoint((), fmpz(1))
        return found and _lowest(*self._constant.whole(right, scale, found.numerators, found.denominator))

    def _by_elimination(self, matrix: fmpz_mat, right: fmpz_mat, below: fmpz) -> IntegerPoint | None:
        is_medium = _CRAMER_DIMENSION < self._dim <= _ELIMINATION_DIMENSION
        if not (self._trials and is_medium and below.bit_length() >= _ELIMINATION_BITS):
            return None
        found = eliminated(matrix, right, below)
        self._trials -= found is None
        return found

    def _constant_rows(self) -> ConstantRows | None:
        """The rows without x to the left; None where there are none or they do not pay, and for a singular equation."""
        n, forms = self._dim, self._forms.tolist()
        alone = [k for k, exponent in enumerate(self._exponents) if not any(exponent[:-1])]
        others = [k for k in range(len(self._exponents)) if k not in alone]
        rows = [i for i in range(n) if not any(forms[i * (n + 1) + j][k] for j in range(n) for k in others)]
        if not rows or not alone or n <= _CRAMER_DIMENSION:
            return None
        A = fmpq_mat([[fmpq(forms[i * (n + 1) + j][alone[0]]) for j in range(n)] for i in rows])
        return ConstantRows(rows, A) if A.rank() == len(rows) else None

    def determinant(self, point: IntegerPoint) -> fmpq:
        """det M(x)."""
        matrix, _ = self._equation(point)
        return fmpq(matrix.det(), self._scale * point.denominator ** (self._dim * self._degree))

    def _equation(self, point: IntegerPoint) -> tuple[fmpz_mat, fmpz_mat]:
        """W^d M(x) and W^d r(x), each row times a common denominator of its coefficients."""
        n, X = self._dim, [*point.numerators, point.denominator]
        if self._degree != 1:
            X = [_monomial(X, exponent) for exponent in self._exponents]
        values = fmpz_mat(n, n + 1, (self._forms * fmpz_mat(len(X), 1, X)).entries()).tolist()
        return fmpz_mat([row[:n] for row in values]), fmpz_mat([[row[n]] for row in values])


def _monomial(X: Sequence[fmpz], exponents: Exponents) -> fmpz:
    total = fmpz(1)
    for entry, exponent in zip(X, exponents, strict=True):
        if exponent:
            total *= entry**exponent
    return total


_CRAMER_DIMENSION = 3
# Below this size FLINT's own solver, free of Python's overhead, is faster (benchmarks/bench_exact.py).
_ELIMINATION_BITS = 4000
_ELIMINATION_DIMENSION = 16  # and above this dimension as well
_TRIALS = 2  # where minors share nothing with W for good, elimination and what makes it certain are lost time
# Solutions modulo powers of 2 are faster where numbers grow by less than _SLOW_GROWTH in a step and a point has more
# than _LONG / n^2 bits, or _VERY_LONG where elimination helps, as it may below _LARGE_DIMENSION.
_SLOW_GROWTH = 1.5
_LONG, _VERY_LONG = 120_000, 8000
_SHORT_DIMENSION, _LARGE_DIMENSION = 5, 8


def _quotients(matrix: fmpz_mat, right: fmpz_mat) -> IntegerPoint | None:
    """The solution for a diagonal matrix: gcds of two entries each are shorter than those with the determinant."""
    n = matrix.nrows()
    if any(matrix[i, i] == 0 for i in range(n)):
        return None
    return IntegerPoint.from_rationals([fmpq(right[i, 0], matrix[i, i]) for i in range(n)])


def _solved(matrix: fmpz_mat, right: fmpz_mat) -> IntegerPoint | None:
    """The solution of matrix x = right in lowest terms; None where the matrix is singular."""
    if matrix.nrows() <= _CRAMER_DIMENSION:
        return _cramer(matrix, right)
    try:
        solution: fmpq_mat = matrix.solve(right)  # type: ignore[assignment]  # the stub promises less
        column, denominator = solution.numer_denom()
    except ZeroDivisionError:
        return None
    return IntegerPoint(tuple(column.entries()), denominator)


def _cramer(matrix: fmpz_mat, right: fmpz_mat) -> IntegerPoint | None:
    """The solution in dimension 1, 2 or 3 by Cramer's rule; its common factor is found by gcds, with few numbers."""
    n = matrix.nrows()
    rows, sides = matrix.tolist(), right.entries()
    if n == 1:
        numerators, denominator = sides, rows[0][0]
    elif n == 2:
        (a, b), (c, d) = rows
        numerators, denominator = [sides[0] * d - sides[1] * b, a * sides[1] - c * sides[0]], a * d - b * c
    else:
        (a, b, c), (d, e, f), (g, h, i) = rows
        cofactors = (e * i - f * h, f * g - d * i, d * h - e * g)
        denominator = a * cofactors[0] + b * cofactors[1] + c * cofactors[2]
        r, s, t = sides
        numerators = [
            r * cofactors[0] + s * (c * h - b * i) + t * (b * f - c * e),
            r * cofactors[1] + s * (a * i - c * g) + t * (c * d - a * f),
            r * cofactors[2] + s * (b * g - a * h) + t * (a * e - b * d),
        ]
    return _lowest(numerators, denominator)


def _lowest(numerators: Sequence[fmpz], denominator: fmpz) -> IntegerPoint | None:
    """The point in lowest terms; None where the denominator is 0."""
    if denominator == 0:
        return None
    common = denominator  # of any sign: a gcd is positive
    for numerator in numerators:
        if common == 1:
            break
        common = common.gcd(numerator % common)
    if denominator < 0:
        common = -common
    return IntegerPoint(tuple(numerator // common for numerator in numerators), denominator // common)
