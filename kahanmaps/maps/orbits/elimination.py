"""Fraction-free elimination on long integers whose minors share a known factor, as for maps of the commuting family."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache, partial

from flint import fmpz, fmpz_mat, nmod_mat

from kahanmaps.maps.orbits.integer_point import IntegerPoint

# A common divisor shorter than this is not worth a division of every entry.
_USEFUL_BITS = 64
_PRIME = 2**61 - 1


def eliminated(matrix: fmpz_mat, right: fmpz_mat, likely: fmpz) -> IntegerPoint | None:
    """The solution of matrix x = right; `likely` is an integer whose powers may divide the minors. None if in doubt.

    The elimination assumes that certain divisions are exact; what it finds is tried in the equation.
    """
    found = _eliminate(matrix, right, likely)
    return found if found is not None and is_the_solution(found, matrix, right) else None


def is_the_solution(found: IntegerPoint, matrix: fmpz_mat, right: fmpz_mat) -> bool:
    """Whether matrix x = right has this solution and no other; False also if det is 0 modulo a certain prime only."""
    if not int(nmod_mat(matrix, _PRIME).det()):
        return False
    return bool(matrix * fmpz_mat(right.nrows(), 1, found.numerators) == right * found.denominator)


def _eliminate(matrix: fmpz_mat, right: fmpz_mat, likely: fmpz) -> IntegerPoint | None:
    """Fraction-free elimination, two columns at a time, that also removes what the minors share with `likely`.

    For maps of the commuting family the matrix has rank 2 modulo (nearly) every prime of the denominator W, so that
    minors of order k share the (k - 2)-th power of W up to small primes. Taken out once, at order 3, this keeps all
    later entries at twice the size of W instead of up to n times: the exact divisions by the previous pivot then
    take out the higher powers by themselves. Where nothing is shared this is Bareiss' two-step algorithm. The
    caller has to verify the result; None where a pivot vanishes.
    """
    n = matrix.nrows()
    rows = [[*row, right[i, 0]] for i, row in enumerate(matrix.tolist())]
    previous: ExactDivisor | None = None
    k = 0
    while k + 1 < n:
        a, b = rows[k], rows[k + 1]
        below = range(k + 2, n)
        pivots = [a[k] * b[k + 1] - a[k + 1] * b[k]]
        pivots += [a[k + 1] * rows[i][k] - a[k] * rows[i][k + 1] for i in below]
        pivots += [b[k] * rows[i][k + 1] - b[k + 1] * rows[i][k] for i in below]
        second = [a[k] * b[j] - b[k] * a[j] for j in range(k + 2, n + 1)]
        if previous is not None:
            quotients = previous.into(pivots + second)
            pivots, second = quotients[: len(pivots)], quotients[len(pivots) :]
        pivot = pivots[0]
        if pivot == 0:
            return None
        places = [(i, j) for i in below for j in range(k + 2, n + 1)]

        def bordered(weights: Sequence[fmpz], chosen: Sequence[tuple[int, int]], top: int = k) -> list[fmpz]:
            """The minors of the two pivot rows and row i, column j, over the previous pivot: linear in `weights`."""
            first, second = rows[top], rows[top + 1]
            half = (len(weights) - 1) // 2
            return [
                rows[i][j] * weights[0] + second[j] * weights[i - top - 1] + first[j] * weights[i - top - 1 + half]
                for i, j in chosen
            ]

        divisor = previous
        if divisor is None and places:
            # A few entries decide what all share; the result is verified in the end.
            divisor = _shared(likely, bordered(pivots, places[:: max(1, len(places) // 3)]))
        if divisor is None or not places:
            block = bordered(pivots, places)
        else:
            size = 2 + max(entry.bit_length() for row in rows[k:] for entry in row[k + 2 :])
            block = divisor.through(pivots, partial(bordered, chosen=places), size)
        b[k + 1 :] = [pivot, *second]
        width = n - 1 - k
        for i in below:
            rows[i][k + 2 :] = block[(i - k - 2) * width : (i - k - 1) * width]
        previous = ExactDivisor(pivot)
        k += 2
    return _substitute_back(rows)


def _substitute_back(rows: list[list[fmpz]]) -> IntegerPoint | None:
    """The solution of a triangular system [U | r], one gcd of large numbers in all."""
    n = len(rows)
    if any(rows[i][i] == 0 for i in range(n)):
        return None
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
    return IntegerPoint(tuple(numerator * sign for numerator in solution), denominator * sign)


def _shared(likely: fmpz, values: list[fmpz]) -> ExactDivisor | None:
    """The part of `likely` without small primes that divides the values, or None where it is not worth removing.

    Small primes often divide minors of order 3 by accident and then not, to the power needed, those of higher order.
    """
    common = likely
    while (small := common.gcd(_small_primes())) != 1:  # first of all: what is left often divides as it stands
        common = common // small
    for value in values:
        remainder = value % common
        if remainder != 0:
            common = common.gcd(remainder)
            if common.bit_length() < _USEFUL_BITS:
                return None
    return ExactDivisor(common) if common.bit_length() >= _USEFUL_BITS else None


@lru_cache(maxsize=1)
def _small_primes() -> fmpz:
    return fmpz.primorial_ui(fmpz(1000))


class ExactDivisor:
    """Divides many integers by one, where every division is known to be exact (otherwise quotients are meaningless).

    The inverse modulo a power of 2 turns each division into one multiplication.
    """

    def __init__(self, divisor: fmpz) -> None:
        self._divisor = divisor
        self._zeros = _trailing_zeros(divisor)
        self._bits = 0
        self._inverse = fmpz(0)

    def into(self, values: list[fmpz]) -> list[fmpz]:
        """values / divisor."""
        bits = max(value.bit_length() for value in values) - self._divisor.bit_length() + 2
        if bits <= 0 or (bits > self._bits and len(values) < 4):
            return [value // self._divisor for value in values]
        mask = (fmpz(1) << bits) - 1
        inverse = self._inverse_to(bits)
        return _signed([((value >> self._zeros) & mask) * inverse & mask for value in values], bits)

    def through(
        self, weights: Sequence[fmpz], values_of: Callable[[Sequence[fmpz]], list[fmpz]], size: int
    ) -> list[fmpz]:
        """values_of(weights) / divisor for values linear in the weights, with coefficients below 2^size in sum.

        The few weights are multiplied by the inverse, instead of the many values.
        """
        bits = size + max(weight.bit_length() for weight in weights) - self._divisor.bit_length() + 2
        if bits <= 0:
            return self.into(values_of(weights))
        precision = bits + self._zeros
        mask = (fmpz(1) << precision) - 1
        inverse = self._inverse_to(precision)
        values = values_of([weight * inverse & mask for weight in weights])
        return _signed([(value & mask) >> self._zeros for value in values], bits)

    def _inverse_to(self, bits: int) -> fmpz:
        """The inverse of the odd part of the divisor modulo 2^bits."""
        if bits > self._bits:
            self._bits = bits
            self._inverse = _inverse_modulo_power_of_two(self._divisor >> self._zeros, bits)
        return self._inverse & ((fmpz(1) << bits) - 1)


def _signed(residues: list[fmpz], bits: int) -> list[fmpz]:
    """Residues modulo 2^bits as numbers between -2^(bits-1) and 2^(bits-1)."""
    modulus = fmpz(1) << bits
    half = modulus >> 1
    return [residue - modulus if residue >= half else residue for residue in residues]


def _inverse_modulo_power_of_two(odd: fmpz, bits: int) -> fmpz:
    """1 / odd modulo 2^bits, by Newton's iteration."""
    precision = 64
    inverse = fmpz(pow(int(odd & ((1 << 64) - 1)), -1, 1 << 64))
    while precision < bits:
        precision = min(2 * precision, bits)
        mask = (fmpz(1) << precision) - 1
        inverse = (inverse * (2 - (odd & mask) * inverse)) & mask
    return inverse & ((fmpz(1) << bits) - 1)


def _trailing_zeros(value: fmpz) -> int:
    """The number of factors 2 of an integer that is not 0."""
    low = int(value & ((1 << 64) - 1))
    if low:
        return (low & -low).bit_length() - 1
    return int((value & -value).bit_length()) - 1
