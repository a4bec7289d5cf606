"""A map over Q on integer points: numerators over ONE common denominator.

A point is x = X / W with integers X and W > 0 without a common factor. The equation M(x) x~ = r(x), times a power of W
and a common denominator of its coefficients, is a linear system with integers that are forms of (X, W). No rational
number is formed on the way: a rational constructor runs a gcd that costs more than the rest of the step.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flint import fmpq, fmpq_mat, fmpz, fmpz_mat, nmod_mat

from kahanmaps.algebra.integers import content, over_one
from kahanmaps.maps.orbits.elimination import is_the_solution, solve_fraction_free
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.substitution import forward_substitution

Exponents = tuple[int, ...]
Terms = tuple[tuple[int, fmpq], ...]

# Below this size FLINT's own solver, free of Python's overhead, is faster (benchmarks/bench_exact.py).
_ELIMINATION_BITS = 4000
_ELIMINATION_DIMENSION = 16  # and above this dimension as well
_SMALL_DIMENSION = 3  # in which constant rows do not pay
_TRIALS = 2  # where minors share nothing with W for good, elimination and what makes it certain are lost time


class IntegerSteps:
    """Steps of the map with the equation (M | -r) on integer points.

    `exponents` are those of the monomials in (X, W), all of one degree; the rational coefficients of entry (i, j) are
    the pairs (monomial, coefficient) of `terms[i][j]`.
    """

    def __init__(self, exponents: Sequence[Exponents], terms: Sequence[Sequence[Terms]]) -> None:
        n = self.dim = len(terms)
        self._degree = sum(exponents[0])
        self._exponents = exponents
        entries = [fmpz(0)] * (n * (n + 1) * len(exponents))
        self._scale = fmpz(1)
        for i, row in enumerate(terms):
            _, below = over_one(coefficient for entry in row for _, coefficient in entry)
            self._scale *= below
            for j, entry in enumerate(row):
                for k, coefficient in entry:
                    sign = 1 if j < n else -1
                    entries[(i * (n + 1) + j) * len(exponents) + k] = sign * coefficient.p * (below // coefficient.q)
        self._forms = fmpz_mat(n * (n + 1), len(exponents), entries)
        self._modular: nmod_mat | None = None  # the forms modulo the last prime
        self._trials = _TRIALS  # of the elimination that are left; none is counted where it is right
        self._substitution = forward_substitution(exponents, self._forms, n)
        self._constant: ConstantRows | None = None
        if not self._substitution and n > _SMALL_DIMENSION:
            # Rows without x to the left, taken out unless they make the equation singular.
            forms = self._forms.tolist()
            alone = [k for k, exponent in enumerate(exponents) if not any(exponent[:-1])]
            others = [k for k in range(len(exponents)) if k not in alone]
            fixed = [i for i in range(n) if not any(forms[i * (n + 1) + j][k] for j in range(n) for k in others)]
            if fixed and alone:
                A = fmpq_mat([[fmpq(forms[i * (n + 1) + j][alone[0]]) for j in range(n)] for i in fixed])
                self._constant = ConstantRows(fixed, A) if A.rank() == len(fixed) else None

    def step(self, point: IntegerPoint) -> IntegerPoint | None:
        """The image, or None where the map has no value."""
        if self._substitution:
            return self._substitution.step(point)
        matrix, right = self._equation(point)
        if self._constant is None:
            is_long = point.denominator.bit_length() >= _ELIMINATION_BITS
            if self._trials and is_long and self.dim <= _ELIMINATION_DIMENSION:
                found = solve_fraction_free(matrix, right, point.denominator)
                if found is not None:
                    return found
                self._trials -= 1
            return _solved(matrix, right)
        scale = point.denominator**self._degree
        rest, side = self._constant.reduce(matrix, right, scale)
        found = _solved(rest, side) if rest.nrows() else IntegerPoint((), fmpz(1))
        return found and lowest(*self._constant.extend(right, scale, found.numerators, found.denominator))

    @property
    def is_triangular(self) -> bool:
        """Whether the equation gives one coordinate after the other, so that points are fractions."""
        return self._substitution is not None

    def determinant(self, point: IntegerPoint) -> fmpq:
        """det M(x)."""
        matrix, _ = self._equation(point)
        return fmpq(matrix.det(), self._scale * point.denominator ** (self._degree * self.dim))

    def is_image(self, point: IntegerPoint, image: IntegerPoint) -> bool:
        """Whether the map is sure to have this value there."""
        return is_the_solution(image, *self._equation(point))

    def residues(self, point: IntegerPoint, prime: int, length: int) -> list[list[int]] | None:
        """So many points from this one on modulo a prime below 2^63, each with 1 behind its coordinates."""
        points, last = list[list[int]](), point.residues(prime)
        while last is not None:
            points.append(last)
            if len(points) == length:
                return points
            last = self.image_modulo(last, prime)
        return None

    def image_modulo(self, point: Sequence[int], prime: int) -> list[int] | None:
        """The image of residues with 1 behind them, None where there is none."""
        if self._modular is None or self._modular.modulus() != prime:
            self._modular = nmod_mat(self._forms, prime)
        n, monomials = self.dim, list(point)
        if self._degree != 1:
            monomials = [int(_monomial(point, exponent) % prime) for exponent in self._exponents]
        values = (self._modular * nmod_mat(len(monomials), 1, monomials, prime)).entries()
        rows = [values[k : k + n + 1] for k in range(0, len(values), n + 1)]
        try:
            image = nmod_mat([row[:n] for row in rows], prime).solve(nmod_mat([row[n:] for row in rows], prime))
        except ZeroDivisionError:
            return None
        return [*(int(entry) for entry in image.entries()), 1]

    def _equation(self, point: IntegerPoint) -> tuple[fmpz_mat, fmpz_mat]:
        """M(x) and r(x), each row times a common denominator of its coefficients and a power of W."""
        n, X = self.dim, [*point.numerators, point.denominator]
        monomials = X if self._degree == 1 else [_monomial(X, exponents) for exponents in self._exponents]
        values = (self._forms * fmpz_mat(len(monomials), 1, monomials)).entries()
        rows = [values[k : k + n + 1] for k in range(0, len(values), n + 1)]
        return fmpz_mat([row[:n] for row in rows]), fmpz_mat([row[n:] for row in rows])


def _monomial(X: Sequence[Any], exponents: Exponents) -> fmpz:
    total = fmpz(1)
    for entry, exponent in zip(X, exponents, strict=True):
        if exponent:
            total *= entry**exponent
    return total


def _solved(matrix: fmpz_mat, right: fmpz_mat) -> IntegerPoint | None:
    """The solution of matrix x = right in lowest terms; None where the matrix is singular."""
    try:
        solution: fmpq_mat = matrix.solve(right)  # type: ignore[assignment]  # the stub promises less
    except ZeroDivisionError:
        return None
    column, denominator = solution.numer_denom()
    return IntegerPoint(tuple(column.entries()), denominator)


def lowest(numerators: Sequence[fmpz], denominator: fmpz) -> IntegerPoint | None:
    """The point in lowest terms; None where the denominator is 0."""
    if denominator == 0:
        return None
    common = content((denominator, *numerators))
    if denominator < 0:
        common = -common
    return IntegerPoint(tuple(numerator // common for numerator in numerators), denominator // common)


class ConstantRows:
    """Rows A x~ = r of a system with integers whose left side does not depend on x, solved once and for all.

    On integers over one denominator such a row of M is a power of the denominator times constants, which would go into
    the determinant. Mechanical systems q' = p, p' = F(q) have it in half of their rows. `rows` are their places; A has
    rational entries and independent rows. With A = (A_1 | A_2) up to the order of columns, A_1 invertible, x~_1 =
    A_1^{-1} r - A_1^{-1} A_2 x~_2 goes into the other rows: their Schur complement is left.
    """

    def __init__(self, rows: Sequence[int], A: fmpq_mat) -> None:
        n, places = A.ncols(), range(A.nrows())
        reduced, rank = A.rref()
        self._rows = list(rows)
        self._columns = [next(j for j in range(n) if reduced[i, j] != 0) for i in range(rank)]
        self._others = [i for i in range(n) if i not in self._rows]
        self._free = [j for j in range(n) if j not in self._columns]
        solved = fmpq_mat([[A[i, j] for j in self._columns] for i in places]).inv()
        both = [[*solved.tolist()[i], *(reduced[i, j] for j in self._free)] for i in places]
        integers, self._below = fmpq_mat(both).numer_denom()
        self._solved = _part(integers, places, places)
        self._rest = _part(integers, places, range(len(places), n))

    def reduce(self, matrix: fmpz_mat, right: fmpz_mat, scale: fmpz) -> tuple[fmpz_mat, fmpz_mat]:
        """The system that is left for the other coordinates, times `scale`; it may be empty.

        `scale` stands in front of A in the matrix, and times it are all coordinates that are solved for.
        """
        known = self._solved * _part(right, self._rows, [0])
        bound, free = _part(matrix, self._others, self._columns), _part(matrix, self._others, self._free)
        side = _part(right, self._others, [0]) * (scale * self._below) - bound * known
        return free * self._below - bound * self._rest, side

    def extend(
        self, right: fmpz_mat, scale: fmpz, numerators: Sequence[fmpz], denominator: fmpz
    ) -> tuple[list[fmpz], fmpz]:
        """Numerators and denominator of the solution, perhaps with a factor in common, from that of what was left."""
        free = fmpz_mat(len(numerators), 1, list(numerators))
        bound = self._solved * _part(right, self._rows, [0]) * denominator - self._rest * free
        found = dict(zip(self._columns, bound.entries(), strict=True))
        found |= {j: entry * self._below for j, entry in zip(self._free, numerators, strict=True)}
        return [found[j] for j in range(len(found))], scale * denominator * self._below


def _part(matrix: fmpz_mat, rows: Sequence[int], columns: Sequence[int]) -> fmpz_mat:
    return fmpz_mat(len(rows), len(columns), [matrix[i, j] for i in rows for j in columns])
