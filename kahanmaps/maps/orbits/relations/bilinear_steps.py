"""Steps by bilinear relations along an orbit (of Hirota type): few products, and no gcds of long integers.

Cramer's rule gives the integers of the next point as determinants, several times as long as in lowest terms. If the
orbit lies on an abelian variety, such as an elliptic curve, and the map is a translation on it, then the homogeneous
coordinates X are sections of a line bundle. By the theorem of the square (mumford-1970), all products
X_i(n + 1) X_j(n - lag) and X_k(n) X_l(n + 1 - lag) are sections of one bundle. If the products X_k(n) X_l(n + 1 - lag)
span all sections of this bundle, then

    f_n X_i(n + 1) X_j(n - lag) = B_ij(X(n), X(n + 1 - lag)),      lag = 1 or 2,

with bilinear forms B_ij that have integer coefficients and do not depend on n. The factors f_n are short integers. A
step consists of products and of exact divisions by the last coordinate at step n - lag.
The forms are computed modulo primes and need no proof: each point that they give is verified exactly in the equation of
the step.
"""

from __future__ import annotations

from collections.abc import Sequence

from flint import fmpq, fmpz, fmpz_mat

from kahanmaps.algebra.matrices import primitive_integers
from kahanmaps.algebra.modular_matrices import echelon, integers, kernel, matrix, pivots
from kahanmaps.algebra.residues import from_residues
from kahanmaps.maps.implicit import Map
from kahanmaps.maps.orbits.integer_point import IntegerPoint, lowest
from kahanmaps.maps.orbits.integer_steps import IntegerSteps

Pairs = Sequence[tuple[int, int]]  # indices i, j of products X_i Y_j of coordinates

_MAX_PRIMES = 50  # maximal number of primes from which the coefficients are computed
_MAX_DIMENSION = 12  # largest dimension, in which the search for forms, with 169 products, takes some seconds
_EXTRA_POINTS = 8  # points beyond the number of unknowns; wrong forms pass at each with probability 2^-60


class BilinearForms:
    """The forms B_ij for the last j: one row of coefficients for each i, one column for each of `products`."""

    name = "bilinear forms along the orbit"

    def __init__(self, steps: IntegerSteps, lag: int, products: Pairs, coefficients: fmpz_mat) -> None:
        self.lag, self.products, self.coefficients = lag, products, coefficients
        self._steps = steps
        # Only B_ij for the last j are known, so f_n may have a denominator: `_multiple` is divisible by all so far.
        self._multiple = fmpz(1)

    def may_skip(self, number: int) -> bool:
        """Return False: every point is needed for the points after it."""
        return False

    def point(self, number: int) -> IntegerPoint | None:
        """Return None: a point is computed only from the points before it."""

    def step(self, last_points: Sequence[IntegerPoint], number: int) -> IntegerPoint | None:
        """Return the point after the points in `last_points`; None if the forms do not give it."""
        last_coordinates, lagged_coordinates, divisor_coordinates = (
            [*last_points[k].numerators, last_points[k].denominator] for k in (-1, -self.lag, -1 - self.lag)
        )
        products = [last_coordinates[i] * lagged_coordinates[j] for i, j in self.products]
        column = fmpz_mat(len(products), 1, products)
        values: list[fmpz] = (self.coefficients * column).entries()
        quotients = [self._multiple * value // divisor_coordinates[-1] for value in values]
        image = lowest(quotients[:-1], quotients[-1])
        if image is not None and self._steps.is_image(last_points[-1], image):
            return image
        image = lowest(values[:-1], values[-1])
        if image is None or not self._steps.is_image(last_points[-1], image):
            return None
        self._multiple = self._multiple.lcm(fmpq(values[-1], image.denominator * divisor_coordinates[-1]).q)
        return image


def bilinear_forms(map_over: Map, point: IntegerPoint) -> BilinearForms | None:
    """Search for bilinear forms along the orbit of a point, with lag 1, then 2; return None if none are found."""
    if len(map_over.factors) > 1 or map_over.dim > _MAX_DIMENSION:
        return None
    steps = map_over.factors[0].integer_steps
    for lag in (1, 2):
        search = _Search(steps, point, lag)
        if (numbers := from_residues(search.modulo, _MAX_PRIMES)) is not None:
            rows = fmpz_mat(steps.dim + 1, len(search.products), primitive_integers(numbers[0]))
            return BilinearForms(steps, lag, search.products, rows)
    return None


class _Search:
    """The computation of the forms modulo primes; the first prime shows which unknowns are 0."""

    def __init__(self, steps: IntegerSteps, point: IntegerPoint, lag: int) -> None:
        self._steps, self._point, self._lag = steps, point, lag
        size = steps.dim + 1
        self.products = [(i, j) for i in range(size) for j in range(size) if lag > 1 or i <= j]
        self._nonzero_unknowns: list[int] | None = None  # the unknowns that are not 0 modulo the first prime

    def modulo(self, prime: int) -> list[list[int]] | None:
        """Return the coefficients of the forms modulo a prime; None if no forms exist or they are not unique."""
        lag, unknown_count = self._lag, len(self.products)
        length = 3 * unknown_count // 2 + _EXTRA_POINTS
        if self._nonzero_unknowns is not None:
            length = max(unknown_count, len(self._nonzero_unknowns) // 2) + _EXTRA_POINTS
        points = self._steps.residues(self._point, prime, length + 1 + lag)
        if points is None:
            return None
        images, points_at_n, points_before, earliest_points = (points[k : k + length] for k in (lag + 1, lag, 1, 0))
        values = [
            [x[i] * y[j] % prime for i, j in self.products] for x, y in zip(points_at_n, points_before, strict=True)
        ]
        if self._nonzero_unknowns is None:
            independent_columns = pivots(echelon(values, prime))
            self.products = [self.products[k] for k in independent_columns]
            values = [[row[k] for k in independent_columns] for row in values]
        # With f = f_n and last coordinates 1, the functions f, g(X(n + 1)) f and g(X(n - lag)) f lie in the span of the
        # columns, if g is a linear form whose divisor has no component in common with that of the last coordinate.
        unknown_count = len(values[0])
        zeros, rows = [0] * unknown_count, []
        for row, *outer_points in zip(values, images, earliest_points, strict=True):
            g, h = (sum((k * k + 2) * entry for k, entry in enumerate(point)) for point in outer_points)
            rows.append([*row, *zeros, *(-g * entry % prime for entry in row)])
            rows.append([*zeros, *row, *(-h * entry % prime for entry in row)])
        columns = list(range(3 * unknown_count)) if self._nonzero_unknowns is None else self._nonzero_unknowns
        relations = kernel(*matrix([[row[k] for k in columns] for row in rows], prime).rref())
        if len(relations) != 1:
            return None
        weights = dict(zip(columns, relations[0], strict=True))
        self._nonzero_unknowns = [k for k, weight in weights.items() if weight]
        factors = [sum(weights.get(2 * unknown_count + k, 0) * x for k, x in enumerate(row)) % prime for row in values]
        # The combinations of the columns that are f_n times the coordinates of the next point:
        right_sides = [[f * x % prime for x in coordinates] for f, coordinates in zip(factors, images, strict=True)]
        try:
            solution = matrix(values[:unknown_count], prime).solve(matrix(right_sides[:unknown_count], prime))
        except ZeroDivisionError:
            return None
        if matrix(values, prime) * solution != matrix(right_sides, prime):
            return None
        return [[entry for column in integers(solution.transpose()) for entry in column]]
