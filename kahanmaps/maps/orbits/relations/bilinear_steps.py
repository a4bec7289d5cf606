"""Steps by bilinear forms that hold along one orbit: few products, and no gcds of long integers.

By Cramer's rule the integers of the next point come out as determinants, several times as long as in lowest terms. But
where an orbit lies on an abelian variety, such as an elliptic curve, and the map is a translation there, homogeneous
coordinates X are sections of a line bundle. By the theorem of the square (mumford-1970), products of a coordinate at
step n + 1 and one at step n - lag are sections of the same bundle as products of one at step n and one at step
n + 1 - lag. Where the latter span what they have to,

    f_n X_i(n + 1) X_j(n - lag) = B_ij(X(n), X(n + 1 - lag)),      lag = 1 or 2,

with bilinear forms B_ij that have integer coefficients and are the same for all n. The factors f_n are short. A step is
some products, and exact divisions by the last coordinate at step n - lag. Kahan's discretizations of integrable systems
are called after Hirota, whose method makes bilinear equations of them.

The forms are found modulo primes. Nothing has to be proved of them: what they give is put into the equation of the
step, exactly.
"""

from __future__ import annotations

from collections.abc import Sequence

from flint import fmpq, fmpz, fmpz_mat

from kahanmaps.algebra.matrices import primitive_integers
from kahanmaps.algebra.modular_matrices import echelon, integers, kernel, matrix, pivots
from kahanmaps.algebra.residues import from_residues
from kahanmaps.maps.implicit import Map
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.integer_steps import IntegerSteps, lowest

Pairs = Sequence[tuple[int, int]]  # i and j of products of coordinates

_MOST_PRIMES = 50  # for the coefficients
_MOST_DIMENSION = 12  # where to look for forms of 169 products takes some seconds
_SPARE = 8  # points beyond the unknowns: each lets wrong forms pass with a chance of 2^-60


class BilinearForms:
    """The forms B_ij for the last j: a row of coefficients for each i, a column for each of the products."""

    name = "bilinear forms along the orbit"

    def __init__(self, steps: IntegerSteps, lag: int, products: Pairs, coefficients: fmpz_mat) -> None:
        self.lag, self.products, self.coefficients = lag, products, coefficients
        self._steps = steps
        # f_n may have a denominator, as only the last B_ij are known: it divides this once it is seen.
        self._multiple = fmpz(1)

    def skip(self, number: int) -> bool:
        """No point can be left out: the next ones are made of it."""
        return False

    def point(self, number: int) -> IntegerPoint | None:
        """None: there is no way to it but by those before."""

    def step(self, last: Sequence[IntegerPoint], number: int) -> IntegerPoint | None:
        """The point after the last ones; None where the forms do not give it."""
        X, Y, behind = ([*last[k].numerators, last[k].denominator] for k in (-1, -self.lag, -1 - self.lag))
        column = fmpz_mat(len(self.products), 1, [X[i] * Y[j] for i, j in self.products])
        values: list[fmpz] = (self.coefficients * column).entries()
        divided = [self._multiple * value // behind[-1] for value in values]
        image = lowest(divided[:-1], divided[-1])
        if image is not None and self._steps.is_image(last[-1], image):
            return image
        image = lowest(values[:-1], values[-1])
        if image is None or not self._steps.is_image(last[-1], image):
            return None
        self._multiple = self._multiple.lcm(fmpq(values[-1], image.denominator * behind[-1]).q)
        return image


def bilinear_forms(map_over: Map, point: IntegerPoint) -> BilinearForms | None:
    """The forms along the orbit of a point, with lag 1 if there are such; None where none are found."""
    if len(map_over.factors) > 1 or map_over.dim > _MOST_DIMENSION:
        return None
    steps = map_over.factors[0].integer_steps
    for lag in (1, 2):
        search = _Search(steps, point, lag)
        if (numbers := from_residues(search.modulo, _MOST_PRIMES)) is not None:
            rows = fmpz_mat(steps.dim + 1, len(search.products), primitive_integers(numbers[0]))
            return BilinearForms(steps, lag, search.products, rows)
    return None


class _Search:
    """The forms along the orbit of a point modulo primes, the first of which says what may be left out."""

    def __init__(self, steps: IntegerSteps, point: IntegerPoint, lag: int) -> None:
        self._steps, self._point, self._lag = steps, point, lag
        size = steps.dim + 1
        self.products = [(i, j) for i in range(size) for j in range(size) if lag > 1 or i <= j]
        self._used: list[int] | None = None  # which unknowns for f_n are not 0; fewer are sought after the first prime

    def modulo(self, prime: int) -> list[list[int]] | None:
        """The coefficients of the forms modulo a prime; None where there are none, or several."""
        lag, unknowns = self._lag, len(self.products)
        length = (3 * unknowns // 2 if self._used is None else max(unknowns, len(self._used) // 2)) + _SPARE
        points = self._steps.residues(self._point, prime, length + 1 + lag)
        if points is None:
            return None
        ahead, here, before, behind = (points[k : k + length] for k in (lag + 1, lag, 1, 0))
        values = [[x[i] * y[j] % prime for i, j in self.products] for x, y in zip(here, before, strict=True)]
        if self._used is None:
            chosen = pivots(echelon(values, prime))
            self.products = [self.products[k] for k in chosen]
            values = [[row[k] for k in chosen] for row in values]
        # f_n for points with last coordinate 1: f and g(X(n + 1)) f and g(X(n - lag)) f are in the span of the columns,
        # where g is a combination of coordinates that has no zeros in common with the last one along a whole divisor.
        unknowns = len(values[0])
        zeros, rows = [0] * unknowns, []
        for row, *ends in zip(values, ahead, behind, strict=True):
            g, h = (sum((k * k + 2) * entry for k, entry in enumerate(end)) for end in ends)
            rows.append([*row, *zeros, *(-g * entry % prime for entry in row)])
            rows.append([*zeros, *row, *(-h * entry % prime for entry in row)])
        used = list(range(3 * unknowns)) if self._used is None else self._used
        relations = kernel(*matrix([[row[k] for k in used] for row in rows], prime).rref())
        if len(relations) != 1:
            return None
        weights = dict(zip(used, relations[0], strict=True))
        self._used = [k for k, weight in weights.items() if weight]
        factors = [sum(weights.get(2 * unknowns + k, 0) * x for k, x in enumerate(row)) % prime for row in values]
        # The combinations of the columns that are f_n times the coordinates ahead.
        sides = [[f * x % prime for x in one] for f, one in zip(factors, ahead, strict=True)]
        try:
            found = matrix(values[:unknowns], prime).solve(matrix(sides[:unknowns], prime))
        except ZeroDivisionError:
            return None
        if matrix(values, prime) * found != matrix(sides, prime):
            return None
        return [[entry for column in integers(found.transpose()) for entry in column]]
