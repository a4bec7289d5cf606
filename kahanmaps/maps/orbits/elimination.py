"""Fraction-free Gaussian elimination for integer systems: Bareiss' two-step algorithm.

All its divisions are exact, since each entry is a minor of the matrix.
"""

from __future__ import annotations

from flint import fmpz, fmpz_mat

from kahanmaps.maps.orbits.integer_point import IntegerPoint


def solve_fraction_free(matrix: fmpz_mat, rhs: fmpz_mat) -> IntegerPoint | None:
    """Solve matrix x = rhs over Q; return None if the matrix is singular or a pivot is 0."""
    n = matrix.nrows()
    rows = [[*row, rhs[i, 0]] for i, row in enumerate(matrix.tolist())]
    previous_pivot = fmpz(1)
    for k in range(0, n - 1, 2):
        a, b, rows_below, m = rows[k], rows[k + 1], rows[k + 2 :], n - k - 2
        pivot, *cofactors = (
            (x[k] * y[k + 1] - x[k + 1] * y[k]) // previous_pivot
            for x, y in [(a, b), *((row, a) for row in rows_below), *((b, row) for row in rows_below)]
        )
        if pivot == 0:
            return None
        for row, factor_of_b, factor_of_a in zip(rows_below, cofactors[:m], cofactors[m:], strict=True):
            row[k + 2 :] = [
                (pivot * row[j] + factor_of_b * b[j] + factor_of_a * a[j]) // previous_pivot
                for j in range(k + 2, n + 1)
            ]
        b[k + 1 :] = [pivot, *((a[k] * b[j] - b[k] * a[j]) // previous_pivot for j in range(k + 2, n + 1))]
        previous_pivot = pivot
    if any(rows[i][i] == 0 for i in range(n)):
        return None
    return _back_substitution(rows)


def _back_substitution(rows: list[list[fmpz]]) -> IntegerPoint:
    """Return the solution of a triangular system, in lowest terms, with a single gcd of the longest numbers."""
    n = len(rows)
    numerator, denominator = rows[-1][n], rows[-1][n - 1]
    content = numerator.gcd(denominator)
    solution = [numerator // content]
    denominator = denominator // content
    for i in range(n - 2, -1, -1):
        value = denominator * rows[i][n]
        for j, component in enumerate(solution, start=i + 1):
            value -= rows[i][j] * component
        quotient, remainder = divmod(value, rows[i][i])
        if remainder != 0:
            content = remainder.gcd(rows[i][i])
            missing_factor = rows[i][i] // content
            solution = [component * missing_factor for component in solution]
            denominator = denominator * missing_factor
            quotient = value // content
        solution.insert(0, quotient)
    # The point is in lowest terms: each new numerator is coprime to the factor that multiplied the other numerators.
    sign = 1 if denominator > 0 else -1
    return IntegerPoint(tuple(numerator * sign for numerator in solution), denominator * sign)
