"""Linear systems with long integers and a short solution, modulo a power of 2: no gcd of long integers, no minors.

By Cramer's rule the solution is a quotient of determinants, n times as long as the entries. On orbits of integrable
maps nearly all of that cancels: the solution is hardly longer than the entries. Here nothing gets longer than twice the
solution, and the common denominator comes out of one lattice with two vectors instead of long gcds.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import prod
from typing import Any

from flint import fmpz, fmpz_mat

from kahanmaps.maps.orbits.integer_point import IntegerPoint

_MOST_ZEROS = 64  # factors 2 in a pivot
# What the denominator of a combination of coordinates often lacks.
_SMALL_PRIMES = fmpz(prod(p ** (12 // p.bit_length()) for p in (3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47)))
_SPARE_BITS = 3 * _MOST_ZEROS + _SMALL_PRIMES.bit_length()


def short_solution(matrix: fmpz_mat, right: fmpz_mat, bits: int) -> IntegerPoint | None:
    """The solution of matrix x = right in lowest terms, if its integers have at most so many bits.

    What is returned is certain: it satisfies the equation modulo a power of 2 that both sides are too short for, and
    there is no other, since the matrix is regular over the 2-adic numbers. None where the solution is longer, where
    there is none, and rarely by bad luck.
    """
    longest = max(entry.bit_length() for entry in matrix.entries() + right.entries())
    precision = max(bits, (longest + bits) // 2) + _SPARE_BITS
    factors = _Factors(matrix, precision)
    zeros = factors.zeros
    if zeros > _MOST_ZEROS:
        return None
    # z = 2^zeros x has no factor 2 in its denominators. Half of its digits, then what is missing, as the other half.
    half = precision - zeros
    below = (fmpz(1) << half) - 1
    scaled = right * (fmpz(1) << zeros)
    first = [entry & below for entry in factors.solve(scaled.entries())]
    missing = (scaled - matrix * fmpz_mat(len(first), 1, first)).entries()
    second = factors.solve([entry >> half for entry in missing])
    modulus = fmpz(1) << (2 * half)
    z = [(low + (high << half)) % modulus for low, high in zip(first, second, strict=True)]

    # The denominator of one combination is that of all, but for a factor now and then: small, or found at a coordinate.
    combination = sum((entry * pow(10, k, 1021) for k, entry in enumerate(z)), fmpz(0))
    denominator = _denominator(combination, modulus) * _SMALL_PRIMES
    limit = modulus >> (longest + len(z).bit_length() + 1)
    numerators: list[fmpz] = []
    for entry in z:
        value = _least_residue(entry * denominator, modulus)
        if abs(value) >= limit:
            lacking = _denominator(value, modulus)
            denominator *= lacking
            numerators = [known * lacking for known in numerators]
            value = _least_residue(value * lacking, modulus)
        numerators.append(value)
    if max(denominator << zeros, *(abs(entry) for entry in numerators)) >= limit:
        return None
    common = _SMALL_PRIMES << zeros
    for entry in numerators:
        common = common.gcd(entry % common)
    return IntegerPoint(tuple(entry // common for entry in numerators), (denominator << zeros) // common)


def _denominator(residue: fmpz, modulus: fmpz) -> fmpz:
    """The denominator w of a fraction modulo the modulus: (w, w * residue) is the shortest vector of a lattice."""
    shortest: fmpz = abs(fmpz_mat([[1, residue % modulus], [0, modulus]]).lll()[0, 0])
    return shortest


def _least_residue(value: fmpz, modulus: fmpz) -> fmpz:
    """The residue of the value between -modulus/2 and modulus/2."""
    residue = value % modulus
    return residue - modulus if 2 * residue >= modulus else residue


class _Factors:
    """P A Q = L U modulo 2^bits, each pivot with the fewest factors 2 in what is left of A.

    So multipliers are integers modulo 2^bits though det A may be even. `zeros` is the number of factors 2 in the last
    pivot, the most of any; it is `bits` for a matrix that is singular as far as can be seen.
    """

    def __init__(self, matrix: fmpz_mat, bits: int) -> None:
        n = matrix.nrows()
        self._mask = mask = (fmpz(1) << bits) - 1
        self._rows = rows = [[entry & mask for entry in row] for row in matrix.tolist()]
        self._order = list(range(n))  # of the rows
        self._columns = list(range(n))
        self._pivots: list[tuple[int, fmpz]] = []  # factors 2, and the inverse of the rest
        self.zeros = 0
        for k in range(n):
            self.zeros, i, j = _least_even(rows, k, bits)
            if self.zeros == bits:
                return
            _swap(rows, i, k)
            _swap(self._order, i, k)
            for row in rows:
                _swap(row, j, k)
            _swap(self._columns, j, k)
            inverse = inverse_modulo_power_of_two(rows[k][k] >> self.zeros, bits)
            self._pivots.append((self.zeros, inverse))
            for row in rows[k + 1 :]:
                if row[k]:
                    row[k] = (row[k] >> self.zeros) * inverse & mask
                    row[k + 1 :] = [
                        (entry - row[k] * above) & mask if above else entry
                        for entry, above in zip(row[k + 1 :], rows[k][k + 1 :], strict=True)
                    ]

    def solve(self, right: Sequence[fmpz]) -> list[fmpz]:
        """x with A x = right, right modulo 2^(bits - zeros), if x has no factor 2 in its denominators."""
        x = [right[k] for k in self._order]
        for i, row in enumerate(self._rows):
            x[i] = _minus(x[i], row[:i], x) & self._mask
        for i in reversed(range(len(x))):
            zeros, inverse = self._pivots[i]
            value = _minus(x[i], self._rows[i][i + 1 :], x[i + 1 :])
            x[i] = ((value & self._mask) >> zeros) * inverse & self._mask
        return [entry for _, entry in sorted(zip(self._columns, x, strict=True))]


def _swap(entries: list[Any], i: int, k: int) -> None:
    if i != k:
        entries[i], entries[k] = entries[k], entries[i]


def _minus(value: fmpz, row: Sequence[fmpz], x: Sequence[fmpz]) -> fmpz:
    """The value minus the product of a row, which may have zeros, with as many entries of x."""
    for entry, factor in zip(row, x, strict=False):
        if entry:
            value -= entry * factor
    return value


def _least_even(rows: Sequence[Sequence[fmpz]], k: int, bits: int) -> tuple[int, int, int]:
    """The fewest factors 2 of an entry from row and column k on, and where that is; `bits` where all are 0."""
    least = (bits, k, k)
    for i in range(k, len(rows)):
        for j in range(k, len(rows)):
            if rows[i][j]:
                least = min(least, (trailing_zeros(rows[i][j]), i, j))
                if least[0] == 0:
                    return least
    return least


def inverse_modulo_power_of_two(odd: fmpz, bits: int) -> fmpz:
    """1 / odd modulo 2^bits, by Newton's iteration."""
    precision = 64
    inverse = fmpz(pow(int(odd & ((1 << 64) - 1)), -1, 1 << 64))
    while precision < bits:
        precision = min(2 * precision, bits)
        mask = (fmpz(1) << precision) - 1
        inverse = (inverse * (2 - (odd & mask) * inverse)) & mask
    return inverse & ((fmpz(1) << bits) - 1)


def trailing_zeros(value: fmpz) -> int:
    """The number of factors 2 of an integer that is not 0."""
    low = int(value & ((1 << 64) - 1))
    if low:
        return (low & -low).bit_length() - 1
    return int((value & -value).bit_length()) - 1
