"""Steps by bilinear forms that hold along one orbit: few products, and no gcds of long integers.

By Cramer's rule the integers of the next point come out as determinants, several times as long as in lowest terms. But
where an orbit lies on an abelian variety, such as an elliptic curve, and the map is a translation there, homogeneous
coordinates X are sections of a line bundle. By the theorem of the square (mumford-1970), products of a coordinate at
step n + 1 and one at step n - lag are sections of the same bundle as products of one at step n and one at step
n + 1 - lag. Where the latter span what they have to,

    f_n X_i(n + 1) X_j(n - lag) = B_ij(X(n), X(n + 1 - lag)),      lag = 1 or 2,

with bilinear forms B_ij that have integer coefficients and are the same for all n. The factors f_n are integers, if
all points are in lowest terms, and divide one integer R (see `_bound`): a step is some products, exact divisions by the
last coordinate at step n - lag, and gcds with R. Kahan's discretizations of integrable systems are called after Hirota,
whose method makes bilinear equations of them.

The forms are found modulo primes. Nothing has to be proved of them: what they give is put into the equation of the
step, exactly. Only that a point is in lowest terms rests on all of them, which are tried at each step modulo a prime.
"""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Iterator, Sequence
from functools import reduce
from itertools import count

from flint import fmpq, fmpz, fmpz_mat, nmod_mat

from kahanmaps.algebra.matrices import primitive_integers
from kahanmaps.algebra.residues import chinese, random_prime, rational_vector
from kahanmaps.maps.equation import Equation
from kahanmaps.maps.implicit import MapOver
from kahanmaps.maps.orbits.elimination import ExactDivisor
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.integer_steps import IntegerSteps, lowest
from kahanmaps.maps.orbits.symmetric_qrt import POINTS, SymmetricQRT, symmetric_qrt

Rows = list[list[int]]
Pairs = Sequence[tuple[int, int]]  # i and j of products of coordinates

# Forms are looked for once, when points have _LONG times the square of the number of coordinates bits, and numbers grow
# by less than _SLOW_GROWTH in a step: elsewhere there are none, or no steps for which they pay. As their coefficients
# are about as long as the start, points have to be longer.
_LONG = 500
_LONGER_THAN_START = 8
_SLOW_GROWTH = 1.5
_MOST_PRIMES = 50  # for the coefficients
_PRIME = 2**61 - 1
_MOST_DIMENSION = 12  # where to look for forms of 169 products takes some seconds
_FORMS_DIMENSION = 2  # above, no forms of degree 2 are an image everywhere
_BOUND_DIMENSION = 4  # above, R is so long that it takes more time to find than it saves
_SPARE = 8  # points beyond the unknowns: each lets wrong forms pass with a chance of 2^-60


class RationalOrbit:
    """The points of an orbit over Q: iterate once; ends where the map has no value, or after one with too many bits.

    `since` is the number of the step from which on bilinear forms are in use, None before.
    """

    def __init__(self, map_over: MapOver, start: IntegerPoint, max_bits: int | None = None) -> None:
        self.map, self.start, self.max_bits = map_over, start, max_bits
        self.since: int | None = None

    def __iter__(self) -> Iterator[IntegerPoint]:
        first, last = [self.start], deque([self.start], maxlen=3)
        forms: BilinearForms | SymmetricQRT | None = None
        is_tried = len(self.map.factors) > 1 or self.map.dim > _MOST_DIMENSION
        long = max(_LONG * (self.map.dim + 1) ** 2, _LONGER_THAN_START * self.start.bits)
        yield self.start
        for step in count(2):
            image = None if forms is None else forms.step(last)
            if image is None:
                image = self.map.integer_step(last[-1], self.max_bits)
            if image is None:
                return
            yield image
            if self.max_bits is not None and image.exceeding(self.max_bits):
                return
            last.append(image)
            if len(first) < POINTS:
                first.append(image)
            if is_tried or len(first) < POINTS or image.bits < long:
                continue
            if image.bits < _SLOW_GROWTH * last[1].bits:
                is_tried = True
                factor = self.map.factors[0]
                forms = symmetric_qrt(factor.equation, first)
                if forms is None and (forms := bilinear_forms(factor.integer_steps, image)) is not None:
                    forms.try_everywhere(factor.equation)
                self.since = None if forms is None else step


class BilinearForms:
    """The forms B_ij for the last j: a row of coefficients for each i, a column for each of the products.

    With a `bound` R, `relations` has residues of the rows of all B_ij and of the products that are left out, and
    `pairs` their i and j.
    """

    def __init__(
        self,
        steps: IntegerSteps,
        lag: int,
        products: Pairs,
        coefficients: fmpz_mat,
        bound: fmpz | None = None,
        relations: nmod_mat | None = None,
        pairs: tuple[Pairs, Pairs] = ((), ()),
    ) -> None:
        self.lag, self.products, self.coefficients, self.bound = lag, products, coefficients, bound
        self._steps, self._relations, self._pairs = steps, relations, pairs
        self.holds_everywhere = False
        # Without a bound not all B_ij are known: f_n may have a denominator, which divides this once it is seen.
        self._multiple = fmpz(1)

    def step(self, last: Sequence[IntegerPoint]) -> IntegerPoint | None:
        """The point after the last ones; None where the forms do not give it."""
        point = last[-1]
        X, Y, behind = ([*last[k].numerators, last[k].denominator] for k in (-1, -self.lag, -1 - self.lag))
        column = fmpz_mat(len(self.products), 1, [X[i] * Y[j] for i, j in self.products])
        values: list[fmpz] = (self.coefficients * column).entries()
        if self.holds_everywhere:
            quotients, rests = zip(*(divmod(value, behind[-1]) for value in values), strict=True)
            is_sure = not any(rests) and self._steps.is_regular(point)
            return self._divided(list(quotients), X, Y, behind) if is_sure else None
        divided = ExactDivisor(behind[-1]).into([self._multiple * value for value in values])
        image = self._divided(divided, X, Y, behind)
        if image is not None and self._steps.is_image(point, image):
            return image
        image = lowest(values[:-1], values[-1]) if self.bound is None else None
        if image is None or not self._steps.is_image(point, image):
            return None
        self._multiple = self._multiple.lcm(fmpq(values[-1], image.denominator * behind[-1]).q)
        return image

    def _divided(self, values: list[fmpz], *points: list[fmpz]) -> IntegerPoint | None:
        """The point whose multiple by f_n this is, in lowest terms; the last points are those here, before, behind."""
        if self.bound is not None:
            common = self.bound
            for value in values:
                common = common.gcd(value % common)
            values = [value // common for value in values]
        if self._relations is None or not self._hold(self._relations, values, *points):
            return lowest(values[:-1], values[-1])
        sign = -1 if values[-1] < 0 else 1
        return IntegerPoint(tuple(sign * value for value in values[:-1]), sign * values[-1])

    def try_everywhere(self, equation: Equation) -> None:
        """Find out whether the forms give the image of all points, not only of those of the orbit.

        So it is for Kahan's discretizations in the plane, whose images are forms of degree 2 themselves.
        """
        if self.lag != 1 or equation.dim > _FORMS_DIMENSION:
            return
        rows = equation.polynomials()
        X = rows[0][0].context().gens()
        products = [X[i] * X[j] for i, j in self.products]
        images = [
            sum((P * c for P, c in zip(products, row, strict=True)), 0 * X[0]) for row in self.coefficients.tolist()
        ]
        self.holds_everywhere = all(
            sum((a * b for a, b in zip(row, images, strict=True)), 0 * X[0]) == 0 for row in rows
        )

    def _hold(self, relations: nmod_mat, *points: list[fmpz]) -> bool:
        """Whether all that R rests on is true at the points ahead, here, before and behind, modulo a prime."""
        a, x, y, b = ([int(entry % _PRIME) for entry in one] for one in points)
        forms, others = self._pairs
        products = nmod_mat(len(self.products), 1, [x[i] * y[j] % _PRIME for i, j in self.products], _PRIME)
        found = [int(entry) for entry in (relations * products).entries()]
        f, scale = found[forms.index((len(x) - 1, len(x) - 1))], a[-1] * b[-1] % _PRIME
        wanted = [f * a[i] * b[j] % _PRIME for i, j in forms] + [x[i] * y[j] * scale % _PRIME for i, j in others]
        return scale != 0 and all(entry * scale % _PRIME == side for entry, side in zip(found, wanted, strict=True))


def bilinear_forms(steps: IntegerSteps, point: IntegerPoint) -> BilinearForms | None:
    """The forms along the orbit of a point, with lag 1 if there are such; None where none are found."""
    found = (_Search(steps, point, lag).found() for lag in (1, 2))
    return next((forms for forms in found if forms is not None), None)


class _Search:
    """The forms along the orbit of a point: modulo primes, then over Q."""

    def __init__(self, steps: IntegerSteps, point: IntegerPoint, lag: int) -> None:
        self._steps, self._point, self._lag = steps, point, lag
        self._last = [(i, steps.dim) for i in range(steps.dim + 1)]
        pairs = [(i, j) for i in range(steps.dim + 1) for j in range(steps.dim + 1)]
        self._wanted = pairs if steps.dim <= _BOUND_DIMENSION else self._last  # i and j of the forms
        self._products = [(i, j) for i, j in pairs if lag > 1 or i <= j]
        self._others = list[tuple[int, int]]()  # products that are left out, since these span them
        self._used: list[int] | None = None  # which unknowns for f_n are not 0; fewer are sought after the first prime

    def found(self) -> BilinearForms | None:
        """The forms; None where there are none, or their coefficients are too long."""
        rng = random.Random(0)  # of unlucky primes only the work is wasted
        residues, modulus, guess = list[int](), 1, None
        for _ in range(_MOST_PRIMES):
            prime = random_prime(rng)
            new = self._modulo(prime)
            if new is None:
                return None
            if guess is not None and all((x.p - r * x.q) % prime == 0 for x, r in zip(guess, new, strict=True)):
                return self._forms(guess)
            residues, modulus = (chinese(residues, modulus, new, prime), modulus * prime) if residues else (new, prime)
            guess = rational_vector(residues, modulus)
        return None

    def _forms(self, entries: Sequence[fmpq]) -> BilinearForms:
        columns = len(self._products)
        size = len(self._wanted) * columns
        numbers, others = primitive_integers(tuple(entries[:size])), entries[size:]
        rows = [numbers[k : k + columns] for k in range(0, size, columns)]
        last = [row for row, pair in zip(rows, self._wanted, strict=True) if pair in self._last]
        below = reduce(fmpz.lcm, (entry.q for entry in others), fmpz(1))
        bound = below * _bound(rows) if self._wanted != self._last else fmpz(0)
        if bound == 0:
            return BilinearForms(self._steps, self._lag, self._products, fmpz_mat(last))
        residues = [int(entry % _PRIME) for entry in numbers]
        residues += [int(entry.p % _PRIME) * pow(int(entry.q), -1, _PRIME) % _PRIME for entry in others]
        relations = nmod_mat(len(residues) // columns, columns, residues, _PRIME)
        pairs = (self._wanted, self._others)
        return BilinearForms(self._steps, self._lag, self._products, fmpz_mat(last), bound, relations, pairs)

    def _modulo(self, prime: int) -> list[int] | None:
        """The coefficients of the forms modulo a prime, then those of the products that are left out."""
        lag, unknowns, is_first = self._lag, len(self._products), self._used is None
        length = (3 * unknowns // 2 if self._used is None else max(unknowns, len(self._used) // 2)) + _SPARE
        points = self._steps.residues(self._point, prime, length + 1 + lag)
        if points is None:
            return None
        ahead, here, before, behind = (points[k : k + length] for k in (lag + 1, lag, 1, 0))
        values = _table(self._products, here, before, prime)
        if self._used is None:
            pivots = _pivots(values, prime)
            if self._wanted != self._last:
                self._others = [pair for k, pair in enumerate(self._products) if k not in pivots]
            self._products = [self._products[k] for k in pivots]
            values = [[row[k] for k in pivots] for row in values]
        found = _factors(values, ahead, behind, self._used, prime)
        if found is None:
            return None
        factors, self._used = found
        left = [
            [entry * f % prime for entry in row]
            for f, row in zip(factors, _table(self._wanted, ahead, behind, prime), strict=True)
        ]
        sides = [a + b for a, b in zip(left, _table(self._others, here, before, prime), strict=True)]
        columns = _solved(values, sides, prime)
        if columns is None and is_first and self._wanted != self._last:
            self._wanted, self._others, self._used = self._last, [], None
            return self._modulo(prime)
        return None if columns is None else [entry for column in columns for entry in column]


def _table(pairs: Pairs, first: Rows, second: Rows, prime: int) -> Rows:
    """The products of coordinates i of the first and j of the second point, a row for each pair of points."""
    return [[x[i] * y[j] % prime for i, j in pairs] for x, y in zip(first, second, strict=True)]


def _pivots(rows: Rows, prime: int) -> list[int]:
    """The columns that those before them do not span."""
    reduced, rank = nmod_mat(rows, prime).rref()
    return [next(k for k in range(len(rows[0])) if int(reduced[i, k])) for i in range(rank)]


def _factors(
    values: Rows, ahead: Rows, behind: Rows, used: list[int] | None, prime: int
) -> tuple[list[int], list[int]] | None:
    """f_n for points with last coordinate 1, and which unknowns are not 0; None where there are none, or several.

    f and g(X(n + 1)) f and g(X(n - lag)) f are in the span of the columns, where g is a combination of coordinates that
    has no zeros in common with the last one along a whole divisor.
    """
    unknowns = len(values[0])
    zeros = [0] * unknowns
    rows = []
    for row, *points in zip(values, ahead, behind, strict=True):
        g, h = (sum((k * k + 2) * entry for k, entry in enumerate(point)) for point in points)
        rows.append([*row, *zeros, *(-g * entry % prime for entry in row)])
        rows.append([*zeros, *row, *(-h * entry % prime for entry in row)])
    used = list(range(3 * unknowns)) if used is None else used
    kernel, nullity = nmod_mat([[row[k] for k in used] for row in rows], prime).nullspace()
    if nullity != 1:
        return None
    weights = {k: int(kernel[i, 0]) for i, k in enumerate(used)}
    factors = [sum(weights.get(2 * unknowns + k, 0) * entry for k, entry in enumerate(row)) % prime for row in values]
    return factors, [k for k, weight in weights.items() if weight]


def _solved(values: Rows, sides: Rows, prime: int) -> Rows | None:
    """The combinations of the columns of the first that are the columns of the second; None if one of them is not."""
    unknowns = len(values[0])
    try:
        found = nmod_mat(values[:unknowns], prime).solve(nmod_mat(sides[:unknowns], prime))
    except ZeroDivisionError:
        return None
    if nmod_mat(values, prime) * found != nmod_mat(sides, prime):
        return None
    return [[int(entry) for entry in column] for column in found.transpose().tolist()]


def _bound(forms: Sequence[Sequence[fmpz]]) -> fmpz:
    """An integer that is divisible by all f_n, up to the denominator for products that are left out; 0 if none is seen.

    As many forms as there are products, with determinant D, give D times each product as integers times f_n: f_n
    divides D times what the products have in common. All products together have no common factor.
    """
    unknowns = len(forms[0])
    pivots = _pivots([[int(row[k] % _PRIME) for row in forms] for k in range(unknowns)], _PRIME)
    return abs(fmpz_mat([forms[k] for k in pivots]).det()) if len(pivots) == unknowns else fmpz(0)
