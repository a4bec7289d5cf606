"""Solutions of integer systems that are much shorter than the determinants of Cramer's rule, by real approximations.

If the heights along an orbit grow slowly, the next point is about as long as the last one, and n times shorter than the
determinant of its equation. Elimination on real numbers of the length of the solution takes n^3/3 products of this
length, and exact residuals add as many correct digits for n^2 products. Two ways lead to the common denominator:

* For the maps of the commuting family, det M(x_n) = k W_n^(n - 2) W_(n - 1) W_(n + 1) with the denominators W of three
  successive points and a short rational number k. The solution is then verified in the equation.
* Half of the Euclidean algorithm finds it from the digits of the coordinates. Then balls prove the solution: if X/V is
  so near to it that the entries of M X - V r, which are integers, are below 1, then they are 0.

The solution is the only one, since no pivot of the elimination contains 0.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from threading import RLock

import flint
from flint import arb, fmpz, fmpz_mat

from kahanmaps.algebra.half_gcd import simple_denominator
from kahanmaps.algebra.integers import content
from kahanmaps.maps.orbits.integer_point import IntegerPoint, lowest

_LEAST_BITS = 1800  # shorter systems are solved exactly in less time
_SPARE_BITS = 64  # beyond the expected length of the solution, for cancellation
_PIVOT_RATIO = 16  # rows are exchanged for a pivot that is so many times as large
# The common denominator of the coordinates is that of a combination of them, but for factors that are usually among:
_SMALL_FACTORS = 2**6 * 3**4 * 5**2 * 7**2 * 11 * 13 * 17 * 19 * 23
# FLINT's precision is global to the process. A thread restores it before another one changes it; a process that was
# forked meanwhile has a lock of its own.
_LOCKS = [RLock()]
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=lambda: _LOCKS.append(RLock()))
_DIGITS = 256  # from this number of binary digits, denominators below 2^112 are recognized


def expected_bits(point: IntegerPoint) -> int | None:
    """Return a bound of the bit length of the next point, if heights grow slowly; None for short points as well."""
    if point.keeps_factors or point.denominator.bit_length() < _LEAST_BITS:
        return None
    if point.preceding_denominator is None:
        return point.bits + point.bits // 4
    preceding_bits = point.preceding_denominator.bit_length()
    growth = max(point.denominator.bit_length() - preceding_bits, 0)
    if 2 * growth > preceding_bits:
        return None
    return point.bits + growth + growth // 4 + _SPARE_BITS  # the growth itself grows slowly


def short_solution(matrix: fmpz_mat, rhs: fmpz_mat, point: IntegerPoint, bits: int) -> IntegerPoint | None:
    """Solve matrix x = rhs over Q, the equation of a step from `point`, and prove that the solution is the only one.

    The result is None if the solution has more than the expected number of `bits`, or is not recognized.
    """
    power = bits + _DIGITS
    with _LOCKS[-1]:
        with flint.ctx.workprec(power + _SPARE_BITS):
            factors = _factors(matrix)
            if factors is None:
                return None
            leading = [_rounded(x, power) for x in factors.solve(rhs)]
            divisor = arb(point.denominator) ** (matrix.nrows() - 2) * (point.preceding_denominator or 1)
            quotient = _rounded(factors.determinant / divisor, _DIGITS)
            solution = _by_determinant(matrix, rhs, [_Real(entry, arb(0), power) for entry in leading], quotient)
        if solution is not None:
            return solution
        with flint.ctx.workprec(bits + _SPARE_BITS):
            residual = rhs * (fmpz(1) << power) - matrix * fmpz_mat(len(leading), 1, leading)
            numbers = [_Real(*parts, power) for parts in zip(leading, factors.solve(residual), strict=True)]
            return _by_digits(matrix, numbers, 2 * (bits + _SPARE_BITS))


def _by_determinant(matrix: fmpz_mat, rhs: fmpz_mat, numbers: Sequence[_Real], quotient: fmpz) -> IntegerPoint | None:
    """Return the solution if a short multiple of quotient / 2^_DIGITS is near a multiple of its denominator."""
    if (factor := simple_denominator(quotient, _DIGITS)) is None:
        return None
    tolerance = fmpz(1) << (numbers[0].power - _DIGITS // 2)
    V, numerators = _fractions(numbers, _nearest(factor * quotient, _DIGITS), tolerance)
    if V == 0 or matrix * fmpz_mat(len(numerators), 1, numerators) != rhs * V:
        return None
    return lowest(numerators, V)


def _by_digits(matrix: fmpz_mat, numbers: Sequence[_Real], length: int) -> IntegerPoint | None:
    """Return the solution, near `numbers`, if it follows from `length` binary digits."""
    # A combination of the coordinates has their common denominator, up to small primes.
    power, weights = numbers[0].power, range(1, 2 * len(numbers), 2)
    leading = sum((weight * number.leading for weight, number in zip(weights, numbers, strict=True)), fmpz(0))
    rest = sum((weight * number.rest for weight, number in zip(weights, numbers, strict=True)), arb(0))
    digits = max(length - power, 0)
    if (denominator := simple_denominator((leading << digits) + _rounded(rest, digits), power + digits)) is None:
        return None
    # M X - V r has entries below 1 if all distances are below this bound.
    tolerance_bits = power - max(entry.bit_length() for entry in matrix.entries()) - len(numbers).bit_length()
    if tolerance_bits < 0:
        return None
    V, numerators = _fractions(numbers, _SMALL_FACTORS * denominator, fmpz(1) << tolerance_bits)
    if V == 0:
        return None
    # If V has less than half of the digits, `denominator` is certainly that of the combination, and divides V.
    multiple = V // denominator if V.bit_length() < length // 2 else V
    common_factor = content((multiple, *numerators))
    return IntegerPoint(tuple(entry // common_factor for entry in numerators), V // common_factor)


@dataclass(frozen=True)
class _Real:
    """The real number (leading + rest) / 2^power."""

    leading: fmpz
    rest: arb
    power: int

    def nearest_integer(self, factor: fmpz) -> tuple[fmpz, arb]:
        """Return an integer near the number times `factor`, and their distance times 2^power."""
        product = factor * self.leading
        integer = _nearest(product, self.power)
        return integer, abs(factor * self.rest + (product - (integer << self.power)))


def _fractions(numbers: Sequence[_Real], V: fmpz, tolerance: fmpz) -> tuple[fmpz, list[fmpz]]:
    """Return a multiple of V and integers X such that |V x - X| < tolerance / 2^power for each number x, or 0 and none.

    Factors below 2^112 that V lacks are recognized.
    """
    for _ in range(len(numbers) + 1):
        approximations = [number.nearest_integer(V) for number in numbers]
        far = [k for k, (_, distance) in enumerate(approximations) if not distance < tolerance]
        if not far:
            return V, [integer for integer, _ in approximations]
        number = numbers[far[0]]
        factor = simple_denominator((V * number.leading) >> (number.power - _DIGITS), _DIGITS)
        if factor is None:
            break
        V = factor * V  # so all distances change
    return fmpz(0), []


@dataclass(frozen=True)
class _Factors:
    """A matrix over balls as the product of a lower and an upper triangular one, up to the order of the rows."""

    order: Sequence[int]
    rows: Sequence[Sequence[arb]]  # below the diagonal the factors of the pivot rows that were subtracted
    inverse_pivots: Sequence[arb]
    determinant: arb  # up to the sign

    def solve(self, rhs: fmpz_mat) -> list[arb]:
        """Return the solution of the system with this right-hand side."""
        values = [arb(rhs[i, 0]) for i in self.order]
        indices = range(len(values))
        for i in indices:
            for j in range(i):
                if not self.rows[i][j].is_zero():
                    values[i] -= self.rows[i][j] * values[j]
        for i in reversed(indices):
            for j in indices[i + 1 :]:
                if not self.rows[i][j].is_zero():
                    values[i] -= self.rows[i][j] * values[j]
            values[i] *= self.inverse_pivots[i]
        return values


def _factors(matrix: fmpz_mat) -> _Factors | None:
    """Return the factors of a matrix; None if a pivot may be 0.

    Rows are exchanged only for a much larger pivot, since this would often replace zeros by other numbers.
    """
    rows = [[arb(entry) for entry in row] for row in matrix.tolist()]
    order, inverses, determinant = list(range(len(rows))), list[arb](), arb(1)
    for k in range(len(rows)):
        best = max(range(k, len(rows)), key=lambda i: abs(rows[i][k]))
        if not abs(rows[best][k]) < _PIVOT_RATIO * abs(rows[k][k]):
            rows[k], rows[best], order[k], order[best] = rows[best], rows[k], order[best], order[k]
        pivot_row = rows[k]
        pivot = pivot_row[k]
        if pivot.contains(0):
            return None
        determinant *= pivot
        inverses.append(1 / pivot)
        for row in rows[k + 1 :]:
            if not row[k].is_zero():
                row[k] *= inverses[k]
                for j in range(k + 1, len(rows)):
                    if not pivot_row[j].is_zero():
                        row[j] -= row[k] * pivot_row[j]
    return _Factors(order, rows, inverses, determinant)


def _rounded(x: arb, power: int) -> fmpz:
    """Return an integer near x 2^power."""
    mantissa, exponent = x.mid().man_exp()
    shift = exponent + power
    return mantissa << shift if shift >= 0 else mantissa >> -shift


def _nearest(number: fmpz, power: int) -> fmpz:
    """Return the integer nearest to number / 2^power."""
    return (number + (fmpz(1) << (power - 1))) >> power
