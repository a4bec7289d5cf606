"""A map over Q on integer points: numerators over ONE common denominator.

A point is x = X / W with integers X and W > 0 without a common factor. The equation M(x) x~ = r(x), times a power of W
and a common denominator of its coefficients, is a linear system with integers that are forms of (X, W). No rational
number is formed on the way: a rational constructor runs a gcd that costs more than the rest of the step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial

from flint import fmpq, fmpq_mat, fmpz, fmpz_mat, nmod_mat

from kahanmaps.maps.orbits.constant_rows import ConstantRows

Exponents = tuple[int, ...]
Terms = tuple[tuple[int, fmpq], ...]


@dataclass(frozen=True)
class IntegerPoint:
    """The rational point numerators / denominator, in lowest terms as a whole, denominator positive."""

    numerators: tuple[fmpz, ...]
    denominator: fmpz

    @classmethod
    def from_rationals(cls, point: Sequence[fmpq]) -> IntegerPoint:
        """The point with these coordinates."""
        below = fmpz(1)
        for entry in point:
            below = below.lcm(entry.q)
        return cls(tuple(entry.p * (below // entry.q) for entry in point), below)

    def rationals(self) -> tuple[fmpq, ...]:
        """The coordinates as reduced fractions; one gcd each."""
        return tuple(fmpq(entry, self.denominator) for entry in self.numerators)

    def lowest_terms(self) -> list[tuple[fmpz, fmpz]]:
        """Numerator and denominator of each coordinate, reduced; one gcd of large numbers in all.

        What a numerator shares with W it shares with the product of all numerators modulo W.
        """
        W = self.denominator
        product = fmpz(1)
        for entry in self.numerators:
            product = product * entry % W
        common = W.gcd(product)
        return [(entry // g, W // g) for entry in self.numerators for g in [common.gcd(entry % common)]]

    @property
    def bits(self) -> int:
        """The bit length of the largest of the integers."""
        return max(self.denominator.bit_length(), *(entry.bit_length() for entry in self.numerators))

    def exceeding(self, limit: int) -> int:
        """The bits if they are more than the limit, otherwise 0."""
        bits = self.bits
        return bits if bits > limit else 0


class IntegerSteps:
    """Steps of the map with the equation (M | -r) on integer points.

    `exponents` are those of the monomials in (X, W), all of one degree; the rational coefficients of entry (i, j) are
    the pairs (monomial, coefficient) of `terms[i][j]`.
    """

    def __init__(self, exponents: Sequence[Exponents], terms: Sequence[Sequence[Terms]]) -> None:
        n = self._dim = len(terms)
        self._degree = sum(exponents[0])
        self._exponents = exponents
        entries = [fmpz(0)] * (n * (n + 1) * len(exponents))
        self._scale = fmpz(1)
        for i, row in enumerate(terms):
            below = fmpz(1)
            for entry in row:
                for _, coefficient in entry:
                    below = below.lcm(coefficient.q)
            self._scale *= below
            for j, entry in enumerate(row):
                for k, coefficient in entry:
                    sign = 1 if j < n else -1
                    entries[(i * (n + 1) + j) * len(exponents) + k] = sign * coefficient.p * (below // coefficient.q)
        self._forms = fmpz_mat(n * (n + 1), len(exponents), entries)
        self._trials = _TRIALS  # of the elimination that are left; none is counted where it is right
        self._is_diagonal = all(i == j or not terms[i][j] for i in range(n) for j in range(n))
        self._constant = self._constant_rows()

    def step(self, point: IntegerPoint) -> IntegerPoint | None:
        """The image, or None where the map has no value."""
        matrix, right = self._equation(point)
        if self._is_diagonal:
            return _quotients(matrix, right)
        if self._constant is None:
            return self._solution(matrix, right, point.denominator)
        scale = point.denominator**self._degree
        rest, side = self._constant.without(matrix, right, scale)
        found = self._solution(rest, side, point.denominator) if rest.nrows() else IntegerPoint((), fmpz(1))
        if found is None:
            return None
        return _lowest(*self._constant.whole(right, scale, found.numerators, found.denominator))

    def _solution(self, matrix: fmpz_mat, right: fmpz_mat, likely: fmpz) -> IntegerPoint | None:
        is_medium = _CRAMER_DIMENSION < matrix.nrows() <= _ELIMINATION_DIMENSION
        if self._trials and is_medium and likely.bit_length() >= _ELIMINATION_BITS:
            found = _eliminated(matrix, right, likely)
            if found is not None:
                return found
            self._trials -= 1
        return _solved(matrix, right)

    def _constant_rows(self) -> ConstantRows | None:
        """The rows without x to the left; None where there are none or they do not pay, and for a singular equation."""
        n, forms = self._dim, self._forms.tolist()
        alone = [k for k, exponent in enumerate(self._exponents) if not any(exponent[:-1])]
        others = [k for k in range(len(self._exponents)) if k not in alone]
        rows = [i for i in range(n) if not any(forms[i * (n + 1) + j][k] for j in range(n) for k in others)]
        if not rows or not alone or n <= _CRAMER_DIMENSION:
            return None
        A = fmpq_mat([[fmpq(forms[i * (n + 1) + j][alone[0]]) for j in range(n)] for i in rows])
        return ConstantRows(rows, A) if A.rank() == len(rows) else None

    def determinant(self, point: IntegerPoint) -> fmpq:
        """det M(x)."""
        matrix, _ = self._equation(point)
        return fmpq(matrix.det(), self._scale * point.denominator ** (self._dim * self._degree))

    def _equation(self, point: IntegerPoint) -> tuple[fmpz_mat, fmpz_mat]:
        """W^d M(x) and W^d r(x), each row times a common denominator of its coefficients."""
        n, X = self._dim, [*point.numerators, point.denominator]
        if self._degree != 1:
            X = [_monomial(X, exponent) for exponent in self._exponents]
        values = fmpz_mat(n, n + 1, (self._forms * fmpz_mat(len(X), 1, X)).entries()).tolist()
        return fmpz_mat([row[:n] for row in values]), fmpz_mat([[row[n]] for row in values])


def _monomial(X: Sequence[fmpz], exponents: Exponents) -> fmpz:
    total = fmpz(1)
    for entry, exponent in zip(X, exponents, strict=True):
        if exponent:
            total *= entry**exponent
    return total


# Below this size FLINT's own solver, free of Python's overhead, is faster (benchmarks/bench_exact.py).
_ELIMINATION_BITS = 4000
_CRAMER_DIMENSION = 3
_ELIMINATION_DIMENSION = 16  # and above this dimension as well
# A common divisor shorter than this is not worth a division of every entry.
_USEFUL_BITS = 64
_PRIME = 2**61 - 1
_TRIALS = 2  # where minors share nothing with W for good, elimination and what makes it certain are lost time


def _eliminated(matrix: fmpz_mat, right: fmpz_mat, likely: fmpz) -> IntegerPoint | None:
    """The solution of matrix x = right; `likely` is an integer whose powers may divide the minors. None if in doubt.

    The elimination assumes that certain divisions are exact. What makes the result certain is this: it is a
    solution, and there is no other, since the determinant does not vanish modulo a prime.
    """
    found = _eliminate(matrix, right, likely)
    if found is None or int(nmod_mat(matrix, _PRIME).det()) == 0:
        return None
    column = fmpz_mat(right.nrows(), 1, found.numerators)
    return found if matrix * column == right * found.denominator else None


def _quotients(matrix: fmpz_mat, right: fmpz_mat) -> IntegerPoint | None:
    """The solution for a diagonal matrix: gcds of two entries each are shorter than those with the determinant."""
    n = matrix.nrows()
    if any(matrix[i, i] == 0 for i in range(n)):
        return None
    return IntegerPoint.from_rationals([fmpq(right[i, 0], matrix[i, i]) for i in range(n)])


def _solved(matrix: fmpz_mat, right: fmpz_mat) -> IntegerPoint | None:
    """The solution of matrix x = right in lowest terms; None where the matrix is singular."""
    if matrix.nrows() <= _CRAMER_DIMENSION:
        return _cramer(matrix, right)
    try:
        solution: fmpq_mat = matrix.solve(right)  # type: ignore[assignment]  # the stub promises less
        column, denominator = solution.numer_denom()
    except ZeroDivisionError:
        return None
    return IntegerPoint(tuple(column.entries()), denominator)


def _cramer(matrix: fmpz_mat, right: fmpz_mat) -> IntegerPoint | None:
    """The solution in dimension 1, 2 or 3 by Cramer's rule; its common factor is found by gcds, with few numbers."""
    n = matrix.nrows()
    rows, sides = matrix.tolist(), right.entries()
    if n == 1:
        numerators, denominator = sides, rows[0][0]
    elif n == 2:
        (a, b), (c, d) = rows
        numerators, denominator = [sides[0] * d - sides[1] * b, a * sides[1] - c * sides[0]], a * d - b * c
    else:
        (a, b, c), (d, e, f), (g, h, i) = rows
        cofactors = (e * i - f * h, f * g - d * i, d * h - e * g)
        denominator = a * cofactors[0] + b * cofactors[1] + c * cofactors[2]
        r, s, t = sides
        numerators = [
            r * cofactors[0] + s * (c * h - b * i) + t * (b * f - c * e),
            r * cofactors[1] + s * (a * i - c * g) + t * (c * d - a * f),
            r * cofactors[2] + s * (b * g - a * h) + t * (a * e - b * d),
        ]
    return _lowest(numerators, denominator)


def _lowest(numerators: Sequence[fmpz], denominator: fmpz) -> IntegerPoint | None:
    """The point in lowest terms; None where the denominator is 0."""
    if denominator == 0:
        return None
    common = denominator  # of any sign: a gcd is positive
    for numerator in numerators:
        if common == 1:
            break
        common = common.gcd(numerator % common)
    if denominator < 0:
        common = -common
    return IntegerPoint(tuple(numerator // common for numerator in numerators), denominator // common)


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
    previous: _ExactDivisor | None = None
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
        previous = _ExactDivisor(pivot)
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


def _shared(likely: fmpz, values: list[fmpz]) -> _ExactDivisor | None:
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
    return _ExactDivisor(common) if common.bit_length() >= _USEFUL_BITS else None


@lru_cache(maxsize=1)
def _small_primes() -> fmpz:
    return fmpz.primorial_ui(fmpz(1000))


class _ExactDivisor:
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
    low = int(value & ((1 << 64) - 1))
    if low:
        return (low & -low).bit_length() - 1
    return int((value & -value).bit_length()) - 1
