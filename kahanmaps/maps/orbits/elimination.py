"""Fraction-free Gaussian elimination (Bareiss' two-step algorithm) for integer systems whose minors share a factor.

The equations that define a step of a map of the commuting family are such systems.
"""

from __future__ import annotations

from flint import fmpz, fmpz_mat, nmod_mat

from kahanmaps.maps.orbits.integer_point import IntegerPoint

# If a common divisor has fewer bits than this, dividing every entry by it takes longer than it saves.
_USEFUL_BITS = 64
_PRIME = 2**61 - 1  # the prime modulo which a determinant is shown not to be 0


def solve_fraction_free(matrix: fmpz_mat, rhs: fmpz_mat, candidate_divisor: fmpz) -> IntegerPoint | None:
    """Solve matrix x = rhs over Q; return None if the matrix is singular or the elimination fails.

    Bareiss' two-step algorithm eliminates two columns at a time. For maps of the commuting family the matrix has rank 2
    modulo (nearly) every prime of the denominator W of the point, so all minors of order k are divisible by W^(k - 2),
    up to small primes. Dividing the minors of order 3 by W (`candidate_divisor`) keeps all later entries at twice the
    length of W instead of up to n times this length: exact divisions by the previous pivot remove the higher powers. If
    the minors have no common factor with `candidate_divisor`, this is Bareiss' algorithm. In other matrices the pivot
    before a division by W need not divide the later entries: a block that is W times the identity gives the pivot W^2.
    Then gcds find the part of the pivot that divides them. The divisions are not checked one by one: the solution is
    verified in the equation.
    """
    n = matrix.nrows()
    rows = [[*row, rhs[i, 0]] for i, row in enumerate(matrix.tolist())]
    previous_pivot = fmpz(1)  # 1 at the beginning, and after a pivot that need not divide the entries
    for k in range(0, n - 1, 2):
        a, b, rows_below, m = rows[k], rows[k + 1], rows[k + 2 :], n - k - 2
        # Replace each entry of the other rows by its minor of order 3 with the pivot rows, divided by `previous_pivot`.
        pivot, *cofactors = (
            x[k] * y[k + 1] - x[k + 1] * y[k]
            for x, y in [(a, b), *((row, a) for row in rows_below), *((b, row) for row in rows_below)]
        )
        if previous_pivot != 1:
            quotients = [divmod(minor, previous_pivot) for minor in (pivot, *cofactors)]
            if any(remainder != 0 for _, remainder in quotients):
                candidate_divisor, previous_pivot = abs(previous_pivot), fmpz(1)
            else:
                pivot, *cofactors = (quotient for quotient, _ in quotients)
        if pivot == 0:
            return None
        minors = [
            [pivot * row[j] + factor_of_b * b[j] + factor_of_a * a[j] for j in range(k + 2, n + 1)]
            for row, factor_of_b, factor_of_a in zip(rows_below, cofactors[:m], cofactors[m:], strict=True)
        ]
        divisor = previous_pivot
        if previous_pivot == 1 and minors:
            # The divisor is determined from a few entries only.
            entries = [entry for row in minors for entry in row]
            divisor = _divisor_of_all(candidate_divisor, entries[:: max(1, len(entries) // 3)])
        for row, entries in zip(rows_below, minors, strict=True):
            row[k + 2 :] = entries if divisor == 1 else [entry // divisor for entry in entries]
        b[k + 1 :] = [pivot, *((a[k] * b[j] - b[k] * a[j]) // previous_pivot for j in range(k + 2, n + 1))]
        if k == 0 or previous_pivot != 1:
            previous_pivot = pivot
        else:
            candidate_divisor = abs(pivot)
    if any(rows[i][i] == 0 for i in range(n)):
        return None
    # Back substitution, with a single gcd of large numbers.
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
    point = IntegerPoint(tuple(numerator * sign for numerator in solution), denominator * sign)
    return point if is_unique_solution(point, matrix, rhs) else None


def is_unique_solution(point: IntegerPoint, matrix: fmpz_mat, rhs: fmpz_mat) -> bool:
    """Return whether the point is the only solution of matrix x = rhs.

    True is proved. False may be wrong, as it is also returned if the determinant is 0 only modulo 2^61 - 1.
    """
    if not int(nmod_mat(matrix, _PRIME).det()):
        return False
    return bool(matrix * fmpz_mat(rhs.nrows(), 1, point.numerators) == rhs * point.denominator)


def _divisor_of_all(candidate_divisor: fmpz, values: list[fmpz]) -> fmpz:
    """Return the part of `candidate_divisor` without small primes that divides all values, or 1 if this part is short.

    Small primes are excluded: they often divide all minors of order 3 by chance, but not the minors of higher order
    with the exponent needed.
    """
    divisor, small_primes = candidate_divisor, fmpz.primorial_ui(fmpz(1000))
    while (small_part := divisor.gcd(small_primes)) != 1:  # first, since the remaining part usually divides the values
        divisor = divisor // small_part
    for value in values:
        if (remainder := value % divisor) != 0:
            divisor = divisor.gcd(remainder)
            if divisor.bit_length() < _USEFUL_BITS:
                return fmpz(1)
    return divisor if divisor.bit_length() >= _USEFUL_BITS else fmpz(1)
