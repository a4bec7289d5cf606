"""The field of rational functions Q(x1, ..., xn). Expanding both sides of an identity over this field proves it.

FLINT has no fraction field of polynomials. Elements here are quotients. By default no gcd is canceled: a sum or a
comparison uses the larger of two denominators if the other divides it, and their product otherwise. This is fast for
expanding an identity of few terms once. A field with `reduces` cancels a gcd after each sum and product: this is
slower, but quotients with many factors stay small. Products of terms are counted in advance, up to a budget.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import chain, pairwise
from threading import Lock
from typing import Any

from flint import fmpq, fmpq_mpoly
from flint.utils.flint_exceptions import DomainError

from kahanmaps.algebra.fields import Element, Field, rational
from kahanmaps.algebra.matrices import EntryMatrix
from kahanmaps.algebra.minors import PairsCheck, kernel_minors
from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.algebra.printing import format_rational_function
from kahanmaps.algebra.work import count_work, counted
from kahanmaps.errors import KahanmapsError

DEFAULT_BUDGET = 100_000_000  # products of terms: about a second, for coefficients of a few words
_MAX_CACHED, _MAX_CACHED_TERMS = 100, 500_000  # number of matrices with cached minors; terms of all minors: 30 MB
_MAX_ROWS_BY_MINORS = 7  # n <= 7 rows: minors (2^n n/2 products with single entries) are faster than elimination
_MIN_FORECAST = 10_000_000  # products for the next row of a matrix from which on those of later rows are forecast

_BUDGET_MESSAGE = "expanding the identity would take too many products of terms"
_Key = bytes | tuple[bytes, int]  # hash of a matrix; after a failure, with the budget that was too small
_cache: dict[_Key, tuple[list[fmpq_mpoly] | None, int, int]] = {}  # minors, number of products of terms, units of work
_cache_lock = Lock()


class BudgetExceeded(KahanmapsError):
    """An expansion would take more products of terms than the budget allows."""


class FunctionField(Field):
    """The field Q(names) with elements `Function`, matrices `FunctionMatrix`; `budget` bounds the products of terms.

    `reduces` says whether quotients are reduced to lowest terms. `modulus` lists the coefficients, constant term first,
    of an irreducible polynomial in the last variable; this polynomial is 0 in the field. None: no such polynomial.

    >>> K = FunctionField(["x", "y"])
    >>> x, y = K.variables
    >>> K.equal((x * x - y * y) / (x - y), x + y)
    True
    """

    characteristic = 0

    def __init__(
        self,
        names: Sequence[str],
        budget: int = DEFAULT_BUDGET,
        reduces: bool = False,
        modulus: Sequence[fmpq] | None = None,
    ) -> None:
        self.reduces = reduces
        self.name = f"QQ({', '.join(names)})"
        self.context = ring(names)
        self.budget = budget
        self._one = self.context.constant(1)
        self.variables = tuple(Function(self, generator, self._one) for generator in self.context.gens())
        self.modulus: fmpq_mpoly | None = None
        if modulus is not None:
            root = self.context.gens()[-1]
            self.modulus = sum((root**k * c for k, c in enumerate(modulus)), self.context.constant(0))

    @property
    def zero(self) -> Function:
        return Function(self, self.context.constant(0), self._one)

    @property
    def one(self) -> Function:
        return Function(self, self._one, self._one)

    def convert(self, value: Any) -> Function:
        if isinstance(value, Function):
            return value
        return Function(self, self.context.constant(rational(value)), self._one)

    def format(self, element: Function) -> str:
        return format_rational_function(RationalFunction(element.numerator, element.denominator))

    def matrix(self, rows: int, columns: int, entries: Sequence[Any]) -> FunctionMatrix:
        return FunctionMatrix(self, rows, columns, [self.convert(entry) for entry in entries])

    def is_zero(self, element: Function) -> bool:
        return self.vanishes(element.numerator)

    def vanishes(self, polynomial: fmpq_mpoly) -> bool:
        """Whether a polynomial represents zero in this field: it is 0, or a multiple of the modulus."""
        return bool(polynomial.is_zero() or (self.modulus is not None and (polynomial % self.modulus).is_zero()))

    def equal(self, left: Function, right: Function) -> bool:
        return self.vanishes((left - right).numerator)

    def times(self, left: fmpq_mpoly, right: fmpq_mpoly) -> fmpq_mpoly:
        """Charge the budget, then multiply two polynomials. Raises BudgetExceeded."""
        self.pay(len(left) * len(right) + 1)
        return left * right

    def pay(self, product_count: int) -> None:
        """Charge this number of products of terms to the budget. Raises BudgetExceeded if the budget is too small."""
        self.budget -= product_count
        if self.budget < 0:
            raise BudgetExceeded(_BUDGET_MESSAGE)
        count_work(1 + product_count / 100)

    def fraction(self, numerator: fmpq_mpoly, denominator: fmpq_mpoly) -> Function:
        """Return numerator / denominator, in lowest terms if this field reduces."""
        if self.reduces and not denominator.is_constant():
            if numerator.is_zero():
                return self.zero
            count_work(10 + (len(numerator) + len(denominator)) / 2)
            gcd = numerator.gcd(denominator)
            if not gcd.is_constant():
                return Function(self, numerator / gcd, denominator / gcd)
        return Function(self, numerator, denominator)

    def value(self, polynomial: fmpq_mpoly, point: Sequence[Function]) -> Function | None:
        """Evaluate a polynomial over Q by Horner's rule, over a common denominator of the coordinates of `point`.

        Returns None in a field that reduces, where the general evaluation reduces each term before adding it.
        """
        if self.reduces:
            return None
        exponent_columns = enumerate(zip(*(tuple(map(int, m)) for m in polynomial.monoms()), strict=True))
        entries_with_exponents = [(point[k], powers) for k, powers in exponent_columns if any(powers)]
        denominators: list[fmpq_mpoly] = []  # none divides another one
        for entry, _ in sorted(entries_with_exponents, key=lambda pair: -int(pair[0].denominator.total_degree())):
            if (
                all(self.quotient(D, entry.denominator) is None for D in denominators)
                and not entry.denominator.is_constant()
            ):
                denominators.append(entry.denominator)
        exponents = [[0] * len(polynomial) for _ in denominators]
        factor_rows = []
        for entry, powers in entries_with_exponents:
            numerator = entry.numerator / entry.denominator.leading_coefficient()
            if not entry.denominator.is_constant():
                quotients = ((k, self.quotient(D, entry.denominator)) for k, D in enumerate(denominators))
                index, quotient = next((k, quotient) for k, quotient in quotients if quotient is not None)
                numerator = self.times(entry.numerator, quotient)
                exponents[index] = [a - e for a, e in zip(exponents[index], powers, strict=True)]
            factor_rows.append((numerator, powers))
        max_powers = [-min(row) for row in exponents]
        factor_rows += [
            (D, tuple(max_power + a for a in row))
            for D, max_power, row in zip(denominators, max_powers, exponents, strict=True)
        ]
        # The longest polynomial comes last: Horner's rule then adds up its powers with constant coefficients.
        factor_rows.sort(key=lambda row: len(row[0]))
        terms = {tuple(powers[m] for _, powers in factor_rows): c for m, c in enumerate(polynomial.coeffs())}
        total = self._horner(terms, [numerator for numerator, _ in factor_rows])
        powers = tuple((D, max_power) for D, max_power in zip(denominators, max_powers, strict=True) if max_power)
        return Function(self, total, self.product_of(powers), powers)

    def product_of(self, powers: Sequence[tuple[fmpq_mpoly, int]]) -> fmpq_mpoly:
        """Return the product of powers of polynomials."""
        product = self._one
        for factor, exponent in powers:
            for _ in range(exponent):
                product = self.times(product, factor)
        return product

    def _horner(self, terms: dict[tuple[int, ...], fmpq], factors: Sequence[fmpq_mpoly]) -> fmpq_mpoly:
        """Return the sum of c times the powers of `factors` with the exponents e, over `terms` = {e: c, ...}."""
        if not factors:
            return self.context.constant(sum(terms.values(), fmpq(0)))
        terms_by_power: dict[int, dict[tuple[int, ...], fmpq]] = {}
        for (power, *other_exponents), coefficient in terms.items():
            terms_by_power.setdefault(power, {})[tuple(other_exponents)] = coefficient
        total = self.context.constant(0)
        for power in range(max(terms_by_power, default=-1), -1, -1):
            total = self.times(total, factors[0])
            if power in terms_by_power:
                total += self._horner(terms_by_power[power], factors[1:])
        return total

    def quotient(self, dividend: fmpq_mpoly, divisor: fmpq_mpoly) -> fmpq_mpoly | None:
        """Return dividend / divisor if it is a polynomial, else None; the budget is charged as for a product."""
        if divisor.is_constant():
            return dividend / divisor.leading_coefficient()
        if dividend.total_degree() < divisor.total_degree():
            return None
        self.pay(len(dividend) * len(divisor))
        try:
            return dividend / divisor
        except DomainError:
            return None


class Function(Element):
    """A quotient of two polynomials in a `FunctionField`, in lowest terms only if the field reduces.

    For the value of a polynomial, `powers` lists the factors of the denominator, which cancel in quotients of values.
    """

    __slots__ = ("denominator", "numerator", "powers")

    field: FunctionField

    def __init__(
        self,
        field: FunctionField,
        numerator: fmpq_mpoly,
        denominator: fmpq_mpoly,
        powers: tuple[tuple[fmpq_mpoly, int], ...] = (),
    ) -> None:
        self.field = field
        self.numerator = numerator
        self.denominator = denominator
        self.powers = powers

    def _add(self, other: Function) -> Function:
        if self.numerator.is_zero():
            return other
        if other.numerator.is_zero():
            return self
        if self.denominator == other.denominator:
            return self.field.fraction(self.numerator + other.numerator, self.denominator)
        times = self.field.times
        for a, b in ((self, other), (other, self)):
            quotient = self.field.quotient(b.denominator, a.denominator)
            if quotient is not None:
                return self.field.fraction(b.numerator + times(a.numerator, quotient), b.denominator)
        numerator = times(self.numerator, other.denominator) + times(other.numerator, self.denominator)
        return self.field.fraction(numerator, times(self.denominator, other.denominator))

    def __neg__(self) -> Function:
        return Function(self.field, -self.numerator, self.denominator)

    def _multiply(self, other: Function) -> Function:
        if self.numerator.is_zero() or other.numerator.is_zero():
            zero: Function = self.field.zero
            return zero
        times = self.field.times
        return self.field.fraction(times(self.numerator, other.numerator), times(self.denominator, other.denominator))

    def _divide(self, other: Function) -> Function:
        if self.field.vanishes(other.numerator):
            raise ZeroDivisionError("division by the zero function")
        common_powers = [
            (D, min(power, other_power)) for D, power in self.powers for E, other_power in other.powers if D == E
        ]
        if common_powers:
            # (a/D^3)/(b/D^2) is computed as a/(D b); the quotient a D^2/(D^3 b) would have the common factor D^2.
            times, product_of = self.field.times, self.field.product_of
            own_cofactor, other_cofactor = (
                product_of([(D, power - sum(n for E, n in common_powers if D == E)) for D, power in value.powers])
                for value in (self, other)
            )
            return self.field.fraction(times(self.numerator, other_cofactor), times(other.numerator, own_cofactor))
        return self._multiply(Function(self.field, other.denominator, other.numerator))

    def _equals(self, other: Function) -> bool:
        if other.numerator.is_zero():
            return self.field.is_zero(self)
        return self.field.equal(self, other)


class FunctionMatrix(EntryMatrix):
    """A matrix over a `FunctionField`, with determinant and solution of linear systems."""

    def _dot(self, row: Sequence[Function], column: Sequence[Function]) -> Function:
        total: Function = self.field.zero
        for a, b in zip(row, column, strict=True):
            if not a.numerator.is_zero() and not b.numerator.is_zero():  # block matrices consist mostly of zeros
                total = total._add(a._multiply(b))
        return total

    def det(self) -> Function:
        """Compute the determinant block by block, after multiplying each row by a common denominator of its entries."""
        total: Function = self.field.one
        for block in self._diagonal_blocks():
            n = len(block)
            rows, denominator = FunctionMatrix(
                self.field, n, n, [self[i, j] for i in block for j in block]
            )._polynomial_rows()
            if len(rows) > _MAX_ROWS_BY_MINORS:
                value = _bareiss(self.field, rows)
            else:
                minor = _minors(self.field, [[*row, self.field.context.constant(0)] for row in rows])[-1]
                value = -minor if len(rows) % 2 else minor
            total = total * Function(self.field, value, denominator)
        return total

    def solve(self, right: FunctionMatrix) -> FunctionMatrix:
        """Solve self X = right by minors, block by block. Raises ZeroDivisionError if the matrix is singular."""
        columns = right._columns
        solution: list[list[Function]] = [[] for _ in range(self._rows)]
        for block in self._diagonal_blocks():
            n = len(block)
            augmented = [[*(self[i, j] for j in block), *(right[i, j] for j in range(columns))] for i in block]
            entries = [entry for row in augmented for entry in row]
            rows, _ = FunctionMatrix(self.field, n, n + columns, entries)._polynomial_rows()
            sign = -1 if n % 2 else 1  # the last minor is (-1)^n det
            for j in range(n, n + columns):
                *numerators, denominator = _minors(self.field, [[*row[:n], row[j]] for row in rows])
                if self.field.vanishes(denominator):
                    raise ZeroDivisionError("singular matrix in solve()")
                if denominator.is_constant():  # cancel the constant: else the digits double with each affine step
                    factor = denominator.leading_coefficient() * sign
                    numerators, denominator = [entry / factor for entry in numerators], self.field.one.numerator * sign
                for i, entry in zip(block, numerators, strict=True):
                    solution[i].append(Function(self.field, entry * -sign, denominator * sign))
        return FunctionMatrix(self.field, self._rows, columns, [entry for row in solution for entry in row])

    def _diagonal_blocks(self) -> list[list[int]]:
        """Return the finest partition of the indices for which entry i, j is 0 if i and j are in different parts."""
        indices = set(range(self._rows))
        blocks = []
        while indices:
            block = [indices.pop()]
            for i in block:  # the list grows during the loop
                neighbors = {
                    j for j in indices if not (self[i, j].numerator.is_zero() and self[j, i].numerator.is_zero())
                }
                indices -= neighbors
                block += sorted(neighbors)
            blocks.append(sorted(block))
        return blocks

    def _polynomial_rows(self) -> tuple[list[list[fmpq_mpoly]], fmpq_mpoly]:
        """Return each row times a common denominator of its entries, and the product of these denominators."""
        rows, product = [], self.field.context.constant(1)
        for i in range(self._rows):
            row = [self[i, j] for j in range(self._columns)]
            total = self.field.zero
            for entry in row:  # the denominator of the sum of all 1/denominator is a common one
                if entry.numerator.is_zero():
                    continue
                total = total + Function(self.field, self.field.context.constant(1), entry.denominator)
            denominator = total.denominator
            polynomial_row = []
            for entry in row:
                if entry.numerator.is_zero():
                    polynomial_row.append(entry.numerator)
                    continue
                quotient = self.field.quotient(denominator, entry.denominator)
                if quotient is None:
                    raise BudgetExceeded("the denominators of a row have no simple common multiple")
                polynomial_row.append(self.field.times(entry.numerator, quotient))
            rows.append(polynomial_row)
            product = self.field.times(product, denominator)
        return rows, product


def _minors(field: FunctionField, rows: list[list[fmpq_mpoly]]) -> list[fmpq_mpoly]:
    """Return the signed maximal minors of an n x (n + 1) matrix of polynomials; the k-th minor omits column k.

    Many identities contain the same image of the same map, so recent minors are cached. A cached result is charged and
    counted like a new computation, so that no verdict depends on earlier computations. For the same reason a failure is
    cached together with its budget: with another budget, the work done before the failure would differ.
    """
    from hashlib import sha256

    count_work(sum(map(len, chain(*rows))))  # the work of writing the text that is hashed
    key = sha256(repr((field.context.names(), [list(map(str, row)) for row in rows])).encode()).digest()
    budget, units_before = field.budget, counted()
    for cached_key in (key, (key, budget)):
        minors, product_count, units = _cache.get(cached_key, (None, 0, 0))
        if cached_key in _cache and product_count <= budget:
            count_work(units)
            if minors is None:
                field.budget = -1
                raise BudgetExceeded(_BUDGET_MESSAGE)
            field.budget -= product_count
            return minors
    try:
        if len(rows) > _MAX_ROWS_BY_MINORS:
            columns = range(len(rows) + 1)
            minors = [_bareiss(field, [[*row[:k], *row[k + 1 :]] for row in rows]) * (-1) ** k for k in columns]
        else:
            entries = [[None if entry.is_zero() else entry for entry in row] for row in rows]
            kernel = kernel_minors(entries, field.times, _products_check(field, entries))
            minors = [field.context.constant(0) if minor is None else minor for minor in kernel]
    except BudgetExceeded:
        _cache_minors((key, budget), None, 0, counted() - units_before)
        raise
    _cache_minors(key, minors, budget - field.budget, counted() - units_before)
    return minors


def _products_check(field: FunctionField, rows: Sequence[Sequence[fmpq_mpoly | None]]) -> PairsCheck:
    """Return the check of `kernel_minors` that raises BudgetExceeded if the further products will cost too much.

    The products of the next row are counted. If they are many, those of later rows are forecast, because the longest
    minors come last, and a failure there would waste seconds. The forecast assumes that the terms per minor grow like a
    power of the number of rows: by 4, 9/4, 16/9, ... for a square, each factor computed from the smallest one so far.
    It may be too high, for example if the later minors cancel: a computation that would just fit may be refused.
    """
    pair_counts: list[int] = []  # for each row after the first, the number of products if no minor cancels
    patterns = [[None if entry is None else 1 for entry in row] for row in rows]
    kernel_minors(patterns, check_pairs=lambda pairs: pair_counts.append(len(pairs)))
    means: list[Fraction] = []  # the products of terms per pair, for each row up to the next one

    def check(pairs: list[tuple[fmpq_mpoly, fmpq_mpoly]]) -> None:
        product_count = sum(len(left) * len(right) + 1 for left, right in pairs)
        means.append(Fraction(product_count + 1, len(pairs) + 1))
        k = len(means)
        mean, forecast = means[-1], Fraction(product_count)
        if k > 1 and product_count >= _MIN_FORECAST:
            excess = max(Fraction(0), min(b / a for a, b in pairwise(means)) - 1)
            for row in range(k, len(pair_counts)):
                excess *= Fraction(row - 1, row + 1)
                mean *= 1 + excess
                forecast += mean * pair_counts[row]
        if forecast > field.budget:
            field.pay(field.budget + 1)

    return check


def _cache_minors(key: _Key, minors: list[fmpq_mpoly] | None, product_count: int, units: int) -> None:
    """Store minors, or None for a failure; remove the oldest entries of a full cache."""
    with _cache_lock:
        _cache[key] = minors, product_count, units
        while (
            len(_cache) > _MAX_CACHED
            or sum(len(P) for cached_minors, *_ in _cache.values() for P in cached_minors or ()) > _MAX_CACHED_TERMS
        ):
            del _cache[next(iter(_cache))]


def _bareiss(field: FunctionField, matrix: list[list[fmpq_mpoly]]) -> fmpq_mpoly:
    """Compute the determinant of a square matrix of polynomials by fraction-free (Bareiss) elimination."""
    rows = [list(row) for row in matrix]
    n = len(rows)
    previous = field.context.constant(1)
    sign = 1
    for k in range(n - 1):
        pivot_row = min(
            (i for i in range(k, n) if not rows[i][k].is_zero()), key=lambda i: len(rows[i][k]), default=None
        )
        if pivot_row is None:
            return field.context.constant(0)
        if pivot_row != k:
            rows[k], rows[pivot_row] = rows[pivot_row], rows[k]
            sign = -sign
        for i in range(k + 1, n):
            for j in range(k + 1, n):
                value = field.times(rows[i][j], rows[k][k]) - field.times(rows[i][k], rows[k][j])
                rows[i][j] = value if k == 0 else value / previous
        previous = rows[k][k]
    return rows[n - 1][n - 1] * sign
