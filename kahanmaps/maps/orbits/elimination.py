"""Fraction-free elimination on long integers whose minors share a known factor, as for maps of the commuting family."""

from __future__ import annotations

from flint import fmpz, fmpz_mat, nmod_mat

from kahanmaps.maps.orbits.integer_point import IntegerPoint

# A common divisor shorter than this is not worth a division of every entry.
_USEFUL_BITS = 64
_PRIME = 2**61 - 1


def solve_fraction_free(matrix: fmpz_mat, right: fmpz_mat, candidate: fmpz) -> IntegerPoint | None:
    """The solution of matrix x = right; powers of the integer `candidate` may divide the minors. None if in doubt.

    Two columns at a time. For maps of the commuting family the matrix has rank 2 modulo (nearly) every prime of the
    denominator W, so that minors of order k share the (k - 2)-th power of W up to small primes. Taken out once, at
    order 3, this keeps all later entries at twice the size of W instead of up to n times: the exact divisions by the
    previous pivot then take out the higher powers by themselves. Where nothing is shared this is Bareiss' two-step
    algorithm. That divisions are exact is assumed; what is found is tried in the equation.
    """
    n = matrix.nrows()
    rows = [[*row, right[i, 0]] for i, row in enumerate(matrix.tolist())]
    previous = fmpz(1)
    for k in range(0, n - 1, 2):
        a, b, below = rows[k], rows[k + 1], rows[k + 2 :]
        pivot = (a[k] * b[k + 1] - a[k + 1] * b[k]) // previous
        if pivot == 0:
            return None
        # Every entry below becomes the minor of order 3 that it makes with the two pivot rows, over the previous pivot.
        minors = []
        for row in below:
            of_b = (a[k + 1] * row[k] - a[k] * row[k + 1]) // previous
            of_a = (b[k] * row[k + 1] - b[k + 1] * row[k]) // previous
            minors.append([pivot * row[j] + of_b * b[j] + of_a * a[j] for j in range(k + 2, n + 1)])
        divisor = previous
        if k == 0 and minors:
            # A few entries decide what all share; the result is verified in the end.
            entries = [entry for row in minors for entry in row]
            divisor = _shared(candidate, entries[:: max(1, len(entries) // 3)])
        for row, entries in zip(below, minors, strict=True):
            row[k + 2 :] = entries if divisor == 1 else [entry // divisor for entry in entries]
        b[k + 1 :] = [pivot, *((a[k] * b[j] - b[k] * a[j]) // previous for j in range(k + 2, n + 1))]
        previous = pivot
    if any(rows[i][i] == 0 for i in range(n)):
        return None
    # The triangular system, with one gcd of large numbers in all.
    numerator, denominator = rows[-1][n], rows[-1][n - 1]
    content = numerator.gcd(denominator)
    solution = [numerator // content]
    denominator = denominator // content
    for i in range(n - 2, -1, -1):
        value = denominator * rows[i][n]
        for j, known in enumerate(solution, start=i + 1):
            value -= rows[i][j] * known
        quotient, remainder = divmod(value, rows[i][i])
        if remainder != 0:
            content = remainder.gcd(rows[i][i])
            missing = rows[i][i] // content
            solution = [known * missing for known in solution]
            denominator = denominator * missing
            quotient = value // content
        solution.insert(0, quotient)
    # In lowest terms already: each new numerator is coprime to the factor that all others have just received.
    sign = 1 if denominator > 0 else -1
    found = IntegerPoint(tuple(numerator * sign for numerator in solution), denominator * sign)
    return found if is_the_solution(found, matrix, right) else None


def is_the_solution(found: IntegerPoint, matrix: fmpz_mat, right: fmpz_mat) -> bool:
    """Whether matrix x = right has this solution and no other; False also if det is 0 modulo a certain prime only."""
    if not int(nmod_mat(matrix, _PRIME).det()):
        return False
    return bool(matrix * fmpz_mat(right.nrows(), 1, found.numerators) == right * found.denominator)


def _shared(candidate: fmpz, values: list[fmpz]) -> fmpz:
    """The part of `candidate` without small primes that divides the values, or 1 where it is not worth removing.

    Small primes often divide minors of order 3 by accident and then not, to the power needed, those of higher order.
    """
    common, small_primes = candidate, fmpz.primorial_ui(fmpz(1000))
    while (small := common.gcd(small_primes)) != 1:  # first of all: what is left often divides as it stands
        common = common // small
    for value in values:
        if (remainder := value % common) != 0:
            common = common.gcd(remainder)
            if common.bit_length() < _USEFUL_BITS:
                return fmpz(1)
    return common if common.bit_length() >= _USEFUL_BITS else fmpz(1)
