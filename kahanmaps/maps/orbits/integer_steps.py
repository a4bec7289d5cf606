"""Steps of a map over Q on integer points: numerators over one common denominator.

A point is x = X / W with integers X and W > 0 without a common factor. Multiplied by a power of W and a common
denominator of its coefficients, the equation M(x) x~ = r(x) is an integer linear system whose entries are forms in
(X, W). No rational number is formed: constructing one runs a gcd that takes longer than the rest of the step.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flint import fmpq, fmpq_mat, fmpz, fmpz_mat, nmod_mat

from kahanmaps.algebra.integers import content, over_common_denominator
from kahanmaps.maps.orbits.elimination import is_unique_solution, solve_fraction_free
from kahanmaps.maps.orbits.forward_substitution import forward_substitution
from kahanmaps.maps.orbits.integer_point import IntegerPoint, UnreducedPoint

Exponents = tuple[int, ...]
Terms = tuple[tuple[int, fmpq], ...]

# Below this number of bits, FLINT's own solver is faster, since it runs no Python code (benchmarks/bench_exact.py).
_ELIMINATION_BITS = 1000
_ELIMINATION_DIMENSION = 16  # above this dimension FLINT's solver is faster as well
_SMALL_DIMENSION = 3  # up to this dimension, eliminating constant rows takes longer than it saves
_CRAMER_DIMENSION = 3  # up to this dimension the image of a long point is computed by determinants
_CRAMER_BITS = 500
_TRIALS = 2  # after this number of failures, the elimination is no longer tried


class IntegerSteps:
    """Steps on integer points of the map with the equation (M | -r).

    `exponents` lists the exponents of the monomials in (X, W), all of the same degree; `terms[i][j]` lists the pairs
    (index of a monomial, rational coefficient) of entry (i, j).
    """

    def __init__(self, exponents: Sequence[Exponents], terms: Sequence[Sequence[Terms]]) -> None:
        n = self.dim = len(terms)
        self._degree = sum(exponents[0])
        self._exponents = exponents
        entries = [fmpz(0)] * (n * (n + 1) * len(exponents))
        self._scale = fmpz(1)
        for i, row in enumerate(terms):
            _, denominator = over_common_denominator(coefficient for entry in row for _, coefficient in entry)
            self._scale *= denominator
            for j, entry in enumerate(row):
                for k, coefficient in entry:
                    sign = 1 if j < n else -1
                    entries[(i * (n + 1) + j) * len(exponents) + k] = (
                        sign * coefficient.p * (denominator // coefficient.q)
                    )
        self._forms = fmpz_mat(n * (n + 1), len(exponents), entries)
        self._modular: nmod_mat | None = None  # the forms modulo the last prime used
        self._remaining_trials = _TRIALS
        self._substitution = forward_substitution(exponents, self._forms, n)
        self._constant: ConstantRows | None = None
        if not self._substitution and n > _SMALL_DIMENSION:
            # Rows of M that do not contain x are eliminated in advance, unless they are linearly dependent.
            forms = self._forms.tolist()
            constant_monomials = [k for k, exponent in enumerate(exponents) if not any(exponent[:-1])]
            other_monomials = [k for k in range(len(exponents)) if k not in constant_monomials]
            constant_rows = [
                i for i in range(n) if not any(forms[i * (n + 1) + j][k] for j in range(n) for k in other_monomials)
            ]
            if constant_rows and constant_monomials:
                A = fmpq_mat(
                    [[fmpq(forms[i * (n + 1) + j][constant_monomials[0]]) for j in range(n)] for i in constant_rows]
                )
                self._constant = ConstantRows(constant_rows, A) if A.rank() == len(constant_rows) else None

    def step(self, point: IntegerPoint) -> IntegerPoint | None:
        """Return the image, or None if the map is not defined at the point."""
        if self._substitution:
            return self._substitution.step(point)
        matrix, rhs = self._equation(point)
        _, W = point.integers
        scale = W**self._degree
        if self._constant is not None:
            whole_rhs = rhs
            matrix, rhs = self._constant.reduce(matrix, rhs, scale)
        if 0 < matrix.nrows() <= _CRAMER_DIMENSION and matrix[0, 0].bit_length() >= _CRAMER_BITS:
            numerators, denominator = by_determinants(matrix, rhs)
            if denominator == 0:
                return None
            if self._constant is not None:
                numerators, denominator = self._constant.extend(whole_rhs, scale, numerators, denominator)
            return UnreducedPoint(numerators, denominator, point)
        solution = self._solved(matrix, rhs, W) if matrix.nrows() else IntegerPoint((), fmpz(1))
        if self._constant is None or solution is None:
            return solution
        return lowest(*self._constant.extend(whole_rhs, scale, solution.numerators, solution.denominator))

    def _solved(self, matrix: fmpz_mat, rhs: fmpz_mat, W: fmpz) -> IntegerPoint | None:
        """Return the solution of matrix x = rhs in lowest terms; None if the matrix is singular."""
        is_long = matrix[0, 0].bit_length() >= _ELIMINATION_BITS
        if self._remaining_trials and is_long and matrix.nrows() <= _ELIMINATION_DIMENSION:
            point = solve_fraction_free(matrix, rhs, W)
            if point is not None:
                return point
            self._remaining_trials -= 1
        try:
            solution: fmpq_mat = matrix.solve(rhs)  # type: ignore[assignment]  # the stub has a less precise type
        except ZeroDivisionError:
            return None
        column, denominator = solution.numer_denom()
        return IntegerPoint(tuple(column.entries()), denominator)

    @property
    def is_triangular(self) -> bool:
        """Whether the equation is triangular, so that steps are forward substitutions on fractions."""
        return self._substitution is not None

    def determinant(self, point: IntegerPoint) -> fmpq:
        """Return det M(x)."""
        matrix, _ = self._equation(point)
        _, W = point.integers
        return fmpq(matrix.det(), self._scale * W ** (self._degree * self.dim))

    def is_image(self, point: IntegerPoint, image: IntegerPoint) -> bool:
        """Return whether `image` is proved to be the image of the point (the answer False may be wrong)."""
        return is_unique_solution(image, *self._equation(point))

    def residues(self, point: IntegerPoint, prime: int, length: int) -> list[list[int]] | None:
        """Return `length` points of the orbit modulo a prime below 2^63, each followed by 1; None if not defined."""
        points, last = list[list[int]](), point.residues(prime)
        while last is not None:
            points.append(last)
            if len(points) == length:
                return points
            last = self.image_modulo(last, prime)
        return None

    def image_modulo(self, point: Sequence[int], prime: int) -> list[int] | None:
        """Return the image of coordinates modulo a prime, followed by 1; None if the map is not defined there."""
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
        """Return M(x) and r(x), each row multiplied by a common denominator of its coefficients and a power of W."""
        numerators, W = point.integers
        n, X = self.dim, [*numerators, W]
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


def by_determinants(matrix: fmpz_mat, rhs: fmpz_mat) -> tuple[list[fmpz], fmpz]:
    """Return numerators and denominator det(matrix) of the solution of matrix x = rhs, in dimension 1 to 3."""
    rows, n = [[*row, rhs[i, 0]] for i, row in enumerate(matrix.tolist())], matrix.nrows()
    if n == 1:
        return [rows[0][1]], rows[0][0]
    if n == 2:
        (a, b, r), (c, d, s) = rows
        return [r * d - b * s, a * s - r * c], a * d - b * c
    (a, b, c, r), (d, e, f, s), (g, h, k, t) = rows
    first, second, third = e * k - f * h, c * h - b * k, b * f - c * e  # minors of the last two columns
    fourth, fifth, sixth = d * h - e * g, b * g - a * h, a * e - b * d  # minors of the first two columns
    s_t, r_t, r_s = s * k - f * t, c * t - r * k, r * f - c * s  # minors of the last column and the right side
    return [
        r * first + s * second + t * third,
        a * s_t + d * r_t + g * r_s,
        r * fourth + s * fifth + t * sixth,
    ], a * first + d * second + g * third


def lowest(numerators: Sequence[fmpz], denominator: fmpz) -> IntegerPoint | None:
    """Return the point in lowest terms; None if the denominator is 0."""
    if denominator == 0:
        return None
    common = content((denominator, *numerators))
    if denominator < 0:
        common = -common
    return IntegerPoint(tuple(numerator // common for numerator in numerators), denominator // common)


class ConstantRows:
    """The rows A x~ = r of an integer system in which A does not depend on x; a Schur complement eliminates them.

    On integer points such a row of M is a power of the denominator times constants, and would introduce this power into
    the determinant. In mechanical systems q' = p, p' = F(q), half of the rows are of this kind. `rows` are the indices
    of these rows; A has rational entries and independent rows. With A = (A_1 | A_2) up to the order of the columns and
    A_1 invertible, x~_1 = A_1^{-1} r - A_1^{-1} A_2 x~_2 is substituted into all other rows.
    """

    def __init__(self, rows: Sequence[int], A: fmpq_mat) -> None:
        n, row_indices = A.ncols(), range(A.nrows())
        reduced, rank = A.rref()
        self._rows = list(rows)
        self._columns = [next(j for j in range(n) if reduced[i, j] != 0) for i in range(rank)]
        self._other_rows = [i for i in range(n) if i not in self._rows]
        self._free = [j for j in range(n) if j not in self._columns]
        inverse = fmpq_mat([[A[i, j] for j in self._columns] for i in row_indices]).inv()
        augmented = [[*inverse.tolist()[i], *(reduced[i, j] for j in self._free)] for i in row_indices]
        integers, self._denominator = fmpq_mat(augmented).numer_denom()
        self._inverse = _submatrix(integers, row_indices, row_indices)
        self._free_part = _submatrix(integers, row_indices, range(len(row_indices), n))

    def reduce(self, matrix: fmpz_mat, rhs: fmpz_mat, scale: fmpz) -> tuple[fmpz_mat, fmpz_mat]:
        """Return the Schur complement and its right-hand side: a system for `scale` times the remaining coordinates.

        In the matrix, A is multiplied by the factor `scale`. The system may be empty.
        """
        constant_part = self._inverse * _submatrix(rhs, self._rows, [0])
        of_eliminated, of_free = (
            _submatrix(matrix, self._other_rows, self._columns),
            _submatrix(matrix, self._other_rows, self._free),
        )
        reduced_rhs = (
            _submatrix(rhs, self._other_rows, [0]) * (scale * self._denominator) - of_eliminated * constant_part
        )
        return of_free * self._denominator - of_eliminated * self._free_part, reduced_rhs

    def extend(
        self, rhs: fmpz_mat, scale: fmpz, numerators: Sequence[fmpz], denominator: fmpz
    ) -> tuple[list[fmpz], fmpz]:
        """Return numerators and denominator of the full solution, perhaps with a common factor."""
        free = fmpz_mat(len(numerators), 1, list(numerators))
        eliminated = self._inverse * _submatrix(rhs, self._rows, [0]) * denominator - self._free_part * free
        values_by_column = dict(zip(self._columns, eliminated.entries(), strict=True))
        values_by_column |= {j: entry * self._denominator for j, entry in zip(self._free, numerators, strict=True)}
        return [values_by_column[j] for j in range(len(values_by_column))], scale * denominator * self._denominator


def _submatrix(matrix: fmpz_mat, rows: Sequence[int], columns: Sequence[int]) -> fmpz_mat:
    return fmpz_mat(len(rows), len(columns), [matrix[i, j] for i in rows for j in columns])
