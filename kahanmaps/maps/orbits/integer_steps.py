"""Steps of a map over Q on integer points: numerators over one common denominator.

A point is x = X / W with integers X and W > 0 without a common factor. Multiplied by a power of W and a common
denominator of its coefficients, the equation M(x) x~ = r(x) is an integer linear system whose entries are forms in
(X, W). No rational number is formed: constructing one runs a gcd that takes longer than the rest of the step.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flint import fmpq, fmpq_mat, fmpz, fmpz_mat, nmod_mat

from kahanmaps.algebra.integers import over_common_denominator
from kahanmaps.maps.orbits.elimination import solve_fraction_free
from kahanmaps.maps.orbits.forward_substitution import forward_substitution
from kahanmaps.maps.orbits.integer_point import IntegerPoint, UnreducedPoint, lowest
from kahanmaps.maps.orbits.short_solution import expected_bits, short_solution

Exponents = tuple[int, ...]
Terms = tuple[tuple[int, fmpq], ...]

# Below this number of bits, FLINT's own solver is faster, since it runs no Python code (benchmarks/bench_exact.py).
_ELIMINATION_BITS = 1000
_ELIMINATION_DIMENSION = 16  # above this dimension FLINT's solver is faster as well
_SMALL_DIMENSION = 3  # up to this dimension, eliminating constant rows takes longer than it saves
_CRAMER_DIMENSION = 3  # up to this dimension the image of a long point is computed by determinants
_CRAMER_BITS = 500  # a point counts as long if the first entry of the matrix has at least this number of bits
_PRIME = 2**61 - 1  # the prime modulo which a determinant is shown not to be 0
_MAX_TRIALS = 2  # after this number of failures (of short solutions: one after the other), a method is no longer tried


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
        self._forms_modulo_prime: nmod_mat | None = None  # the forms modulo the last prime used
        self._remaining_trials = self._remaining_short_trials = _MAX_TRIALS
        self._substitution = forward_substitution(exponents, self._forms, n)
        self._constant_rows: ConstantRows | None = None
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
                self._constant_rows = ConstantRows(constant_rows, A) if A.rank() == len(constant_rows) else None

    def step(self, point: IntegerPoint) -> IntegerPoint | None:
        """Return the image, or None if the map is not defined at the point."""
        if self._substitution:
            return self._substitution.step(point)
        matrix, rhs = self._equation(point)
        image = None
        if self.dim > _CRAMER_DIMENSION and self._remaining_short_trials and (bits := expected_bits(point)):
            image = short_solution(matrix, rhs, point, bits)
            self._remaining_short_trials = self._remaining_short_trials - 1 if image is None else _MAX_TRIALS
        if image is None:
            image = self._solution(matrix, rhs, point)
        if image is not None:
            image.preceding_denominator = point.integers[1]
        return image

    def _solution(self, matrix: fmpz_mat, rhs: fmpz_mat, point: IntegerPoint) -> IntegerPoint | None:
        """Return the solution of the equation of a step from `point`; None if it is singular."""
        _, W = point.integers
        scale = W**self._degree
        if self._constant_rows is not None:
            full_rhs = rhs
            matrix, rhs = self._constant_rows.reduce(matrix, rhs, scale)
        if 0 < matrix.nrows() <= _CRAMER_DIMENSION and matrix[0, 0].bit_length() >= _CRAMER_BITS:
            numerators, denominator = by_determinants(matrix, rhs)
            if denominator == 0:
                return None
            if self._constant_rows is not None:
                numerators, denominator = self._constant_rows.extend(full_rhs, scale, numerators, denominator)
            return UnreducedPoint(numerators, denominator, point)
        solution = None if matrix.nrows() else IntegerPoint((), fmpz(1))
        is_long = solution is None and matrix[0, 0].bit_length() >= _ELIMINATION_BITS
        if self._remaining_trials and is_long and matrix.nrows() <= _ELIMINATION_DIMENSION:
            solution = solve_fraction_free(matrix, rhs)
            self._remaining_trials -= solution is None
        if solution is None:
            try:
                rational_solution: fmpq_mat = matrix.solve(rhs)  # type: ignore[assignment]  # the stub is less precise
            except ZeroDivisionError:
                return None
            column, denominator = rational_solution.numer_denom()
            solution = IntegerPoint(tuple(column.entries()), denominator)
        if self._constant_rows is None:
            return solution
        return lowest(*self._constant_rows.extend(full_rhs, scale, solution.numerators, solution.denominator))

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
        """Return whether `image` is proved to be the image of the point (the answer False may be wrong).

        False is also returned if the determinant is 0 modulo 2^61 - 1.
        """
        matrix, rhs = self._equation(point)
        if not int(nmod_mat(matrix, _PRIME).det()):
            return False
        return bool(matrix * fmpz_mat(self.dim, 1, image.numerators) == rhs * image.denominator)

    def residues(self, point: IntegerPoint, prime: int, length: int) -> list[list[int]] | None:
        """Return `length` points of the orbit modulo a prime < 2^63, each followed by 1; None if one is not defined."""
        points, coordinates = list[list[int]](), point.residues(prime)
        while coordinates is not None:
            points.append(coordinates)
            if len(points) == length:
                return points
            coordinates = self.image_modulo(coordinates, prime)
        return None

    def image_modulo(self, point: Sequence[int], prime: int) -> list[int] | None:
        """Return the image of coordinates modulo a prime, followed by 1; None if the map is not defined there."""
        if self._forms_modulo_prime is None or self._forms_modulo_prime.modulus() != prime:
            self._forms_modulo_prime = nmod_mat(self._forms, prime)
        n, monomials = self.dim, list(point)
        if self._degree != 1:
            monomials = [int(_monomial(point, exponent) % prime) for exponent in self._exponents]
        values = (self._forms_modulo_prime * nmod_mat(len(monomials), 1, monomials, prime)).entries()
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
    A, D, G = e * k - f * h, c * h - b * k, b * f - c * e  # cofactors of the first column
    C, F, K = d * h - e * g, b * g - a * h, a * e - b * d  # cofactors of the last column
    s_t, r_t, r_s = s * k - f * t, c * t - r * k, r * f - c * s  # minors of the last column and the right side
    return [
        r * A + s * D + t * G,
        a * s_t + d * r_t + g * r_s,
        r * C + s * F + t * K,
    ], a * A + d * D + g * G


class ConstantRows:
    """The rows A x~ = r of an integer system in which A does not depend on x; a Schur complement eliminates them.

    On integer points such a row of M is a power of the denominator times constants, and would introduce this power into
    the determinant. In mechanical systems q' = p, p' = F(q), half of the rows are of this kind. `rows` are the indices
    of these rows; A has rational entries and independent rows. With A = (A_1 | A_2) up to the order of the columns and
    A_1 invertible, x~_1 = A_1^{-1} r - A_1^{-1} A_2 x~_2 is substituted into all other rows.
    """

    def __init__(self, rows: Sequence[int], A: fmpq_mat) -> None:
        n, row_indices = A.ncols(), range(A.nrows())
        echelon_form, rank = A.rref()
        self._rows = list(rows)
        self._eliminated_columns = [next(j for j in range(n) if echelon_form[i, j] != 0) for i in range(rank)]
        self._other_rows = [i for i in range(n) if i not in self._rows]
        self._free_columns = [j for j in range(n) if j not in self._eliminated_columns]
        inverse = fmpq_mat([[A[i, j] for j in self._eliminated_columns] for i in row_indices]).inv()
        augmented_rows = [
            [*inverse.tolist()[i], *(echelon_form[i, j] for j in self._free_columns)] for i in row_indices
        ]
        integers, self._denominator = fmpq_mat(augmented_rows).numer_denom()
        self._A_inverse = _submatrix(integers, row_indices, row_indices)
        self._free_part = _submatrix(integers, row_indices, range(len(row_indices), n))

    def reduce(self, matrix: fmpz_mat, rhs: fmpz_mat, scale: fmpz) -> tuple[fmpz_mat, fmpz_mat]:
        """Return the Schur complement and its right-hand side: a system for `scale` times the remaining coordinates.

        In the matrix, A is multiplied by the factor `scale`. The system may be empty.
        """
        constant_part = self._A_inverse * _submatrix(rhs, self._rows, [0])
        eliminated_columns, free_columns = (
            _submatrix(matrix, self._other_rows, self._eliminated_columns),
            _submatrix(matrix, self._other_rows, self._free_columns),
        )
        reduced_rhs = (
            _submatrix(rhs, self._other_rows, [0]) * (scale * self._denominator) - eliminated_columns * constant_part
        )
        return free_columns * self._denominator - eliminated_columns * self._free_part, reduced_rhs

    def extend(
        self, rhs: fmpz_mat, scale: fmpz, numerators: Sequence[fmpz], denominator: fmpz
    ) -> tuple[list[fmpz], fmpz]:
        """Return numerators and denominator of the full solution, perhaps with a common factor."""
        free_values = fmpz_mat(len(numerators), 1, list(numerators))
        constant_part = self._A_inverse * _submatrix(rhs, self._rows, [0])
        eliminated_values = constant_part * denominator - self._free_part * free_values
        values = dict(zip(self._eliminated_columns, eliminated_values.entries(), strict=True))
        values |= {j: entry * self._denominator for j, entry in zip(self._free_columns, numerators, strict=True)}
        return [values[j] for j in range(len(values))], scale * denominator * self._denominator


def _submatrix(matrix: fmpz_mat, rows: Sequence[int], columns: Sequence[int]) -> fmpz_mat:
    return fmpz_mat(len(rows), len(columns), [matrix[i, j] for i in rows for j in columns])
