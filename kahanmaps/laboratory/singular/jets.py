"""Images of curves in projective space, and of tangent directions along them, under a map over GF(p)((t)).

Homogeneous coordinates are power series in t, known up to a power of t; common powers of t are divided out. The
differential is computed from neighbours of the curve: the curve plus t^N times a tangent direction. Modulo t^2N the
square of t^N is 0, so the terms from t^N on of the image of a neighbour give the derivative.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain
from itertools import count as integers
from typing import Any

from flint import Ordering, nmod, nmod_mat, nmod_mpoly, nmod_mpoly_ctx, nmod_poly

from kahanmaps.algebra.fields import PrimeField
from kahanmaps.algebra.polynomial_work import product_units, roots_units, series_units
from kahanmaps.algebra.work import count_work
from kahanmaps.maps.equation import Equation

# (coordinates of a curve, precision) -> order in t of a function along the curve; None if it is not below the precision
Function = Callable[[Sequence[nmod_poly], int], int | None]


Pivot = tuple[int, int, int]  # exponent of t, row and column of the entry
_MIN_ELIMINATION_DIMENSION = 4  # from this dimension on elimination needs fewer operations than minors
_LOW_PRECISION = 4  # number of terms that usually determine the order of a function


class PrecisionTooLow(ArithmeticError):
    """Raised if series have too few terms; the caller repeats the computation with more terms."""


class NotGeneric(ArithmeticError):
    """Raised if a point is in special position on its hypersurface; the caller takes another point."""


class MapSequence(tuple[Equation, ...]):
    """The equations of the factors of a composition, applied periodically, one in each step.

    Each tracked function belongs to one factor. It is evaluated at the steps offset, offset + k, offset + 2 k, ... for
    k factors; `offsets` has the offset of each function.
    """

    offsets: tuple[int, ...] = ()


def equations_of(equations: Sequence[Equation], step: int) -> Sequence[Equation]:
    """Return the equations of a step (counted from 1): one equation of a `MapSequence`, otherwise all equations."""
    return (equations[(step - 1) % len(equations)],) if isinstance(equations, MapSequence) else equations


def orders_of(
    equations: Sequence[Equation], functions: Sequence[Function], step: int, X: Sequence[nmod_poly], precision: int
) -> list[int | None]:
    """Return the orders of functions along a curve X after a step; 0 for functions that belong to another factor."""
    if isinstance(equations, MapSequence):
        are_due = [(step - offset) % len(equations) == 0 for offset in equations.offsets]
        return [function(X, precision) if is_due else 0 for function, is_due in zip(functions, are_due, strict=True)]
    return [function(X, precision) for function in functions]


def valuation(series: nmod_poly, precision: int) -> int | None:
    """Return the exponent of the first nonzero term of a series below t^precision; None if all these terms are 0.

    >>> valuation(nmod_poly([0, 0, 3], 7), 5)
    2
    """
    return next((k for k in range(min(len(series), precision)) if int(series[k])), None)


@dataclass(frozen=True)
class JetStep:
    """The result of a step of a curve: valuations in t (None: the precision or more), and the rank of the differential.

    Attributes:
        common: the power of t divided out of all coordinates (for several factors, of their composed minors).
        pole: the valuation of the coordinate Z at the image; the least valuation of all coordinates is 0.
        denominator: the valuation of det(I - eps f') at the point before the step.
        rank: the rank of the differential of the map from the hypersurface to the limits of the images of its points.
        limit: the limit of the image of the curve for t -> 0.
        orders: the valuations of the requested functions along the image.
        curve: the known terms of the image of the curve; empty if no functions were requested.
    """

    common: int
    pole: int | None
    denominator: int | None
    rank: int
    limit: tuple[int, ...] = field(repr=False)
    orders: tuple[int, ...] = field(default=(), repr=False)
    curve: tuple[nmod_poly, ...] = field(default=(), repr=False, compare=False)


def images_of_curve(
    equations: Sequence[Equation],
    point: Sequence[int],
    direction: Sequence[int],
    precision: int,
    tangents: Sequence[Sequence[int]] = (),
    functions: Sequence[Function] = (),
) -> Iterator[JetStep]:
    """Yield the successive steps of the curve point + t direction and of its neighbours in tangent directions.

    Exact. The equations of the map are over GF(p); points and vectors are coordinates (X : Z) in GF(p). Give either
    `tangents`, to compute the rank, or `functions`, to compute their orders. Raises PrecisionTooLow and NotGeneric.
    """
    prime = equations[0].over.characteristic
    shift = precision if tangents else 0  # N: neighbours are curve + t^N tangent
    line = [nmod_poly([x, v], prime) for x, v in zip(point, direction, strict=True)]
    shift_power = nmod_poly([0] * shift + [1], prime)
    curves = [line, *([x + shift_power * w for x, w in zip(line, tangent, strict=True)] for tangent in tangents)]
    curves = [[entry.truncate(shift + precision) for entry in curve] for curve in curves]
    for step_number in integers(1):
        divided_power, denominators = 0, list[int | None]()
        for equation in equations_of(equations, step_number):
            pivots: list[Pivot] = []
            images = [_image_of_curve(equation, curve, precision, shift + precision, pivots) for curve in curves]
            common_power = sum(exponent for exponent, *_ in pivots)
            if common_power + 1 > precision - 1:
                raise PrecisionTooLow
            precision -= common_power
            curves = [[entry.truncate(shift + precision) for entry in curve] for curve in images]
            # The coordinates of the neighbours minus those of the curve.
            differences = [b - a for neighbour in curves[1:] for a, b in zip(curves[0], neighbour, strict=True)]
            if not all(difference.truncate(shift).is_zero() for difference in differences):
                raise NotGeneric("the valuation differs at neighbouring points")
            order_of_Z = valuation(curves[0][-1], precision)
            divided_power = divided_power * equation.image_degree + common_power
            denominators.append(None if order_of_Z is None else order_of_Z + common_power)
        orders = orders_of(equations, functions, step_number, curves[0], precision) if functions else []
        if None in orders:
            raise PrecisionTooLow
        limit = tuple(int(entry[0]) for entry in curves[0])
        rank = 0
        if tangents:  # the rank at t = 0; tangent vectors in projective space are vectors modulo the limit point
            entries = [*limit, *(int(difference[shift]) for difference in differences)]
            rank = int(nmod_mat(len(curves), len(limit), entries, prime).rank()) - 1
        valuations = tuple(order or 0 for order in orders)
        denominator = None if None in denominators else sum(order or 0 for order in denominators)
        yield JetStep(
            divided_power, order_of_Z, denominator, rank, limit, valuations, tuple(curves[0]) if functions else ()
        )


def _image_of_curve(
    equation: Equation, X: Sequence[nmod_poly], precision: int, known_terms: int, pivots: list[Pivot]
) -> list[nmod_poly]:
    """Return the image of a curve X known below t^known_terms, divided by a common power of t.

    An empty list `pivots` is filled with the pivots that are used; they determine this power. For a neighbour of a
    curve, `pivots` must be those of the curve. Raises PrecisionTooLow.
    """
    zero, units_per_product = X[0] * 0, product_units(known_terms, known_terms)
    count_work(row_units(equation, known_terms))

    def times(left: nmod_poly, right: nmod_poly) -> nmod_poly:
        count_work(units_per_product)
        return left.mul_low(right, known_terms)

    if equation.dim >= _MIN_ELIMINATION_DIMENSION and equation.explicit is None:
        return kernel(equation.rows(equation.monomials(X, times), zero), precision, known_terms, pivots)
    image = equation.image(X, zero, times)
    if not pivots:
        pivots.append(_search_pivot([image], [0], range(len(image)), precision))
    return [entry.right_shift(pivots[0][0]) for entry in image]


def kernel(
    rows: list[list[nmod_poly]],
    precision: int,
    known_terms: int,
    pivots: list[Pivot],
    check: Callable[[], None] = lambda: None,
) -> list[nmod_poly]:
    """Return the kernel of an n x (n + 1) matrix of series known below t^known_terms, with no common power of t.

    The minors are, up to a unit, the kernel times t^s, with s the sum of the exponents of all `pivots`. Missing pivots
    are chosen and appended. A pivot has the least exponent of all remaining entries, so that only its power of t is
    divided out. Its exponent must be below `precision`; then neighbours of a curve, which differ from it only from
    t^precision on, have the same pivots. `check` is called before each row, and may raise. Raises PrecisionTooLow.
    """
    free_rows, free_columns = list(range(len(rows))), list(range(len(rows) + 1))
    units_per_inversion, units_per_product = series_units(known_terms), 0.3 + product_units(known_terms, known_terms)
    solved_rows: list[tuple[int, dict[int, nmod_poly]]] = []
    for k in range(len(rows)):
        if len(pivots) == k:
            pivots.append(_search_pivot(rows, free_rows, free_columns, precision))
        power, i, j = pivots[k]
        free_rows.remove(i)
        free_columns.remove(j)
        # The factor 2 includes the products of the back substitution.
        count_work(units_per_inversion + units_per_product * len(free_columns) * 2)
        inverse = rows[i][j].right_shift(power).inverse_series_trunc(known_terms - power)
        scaled_row = {c: rows[i][c].right_shift(power).mul_low(inverse, known_terms - power) for c in free_columns}
        for r in free_rows:
            check()
            factor = rows[r][j]
            if not factor.is_zero():
                count_work(units_per_product * sum(not entry.is_zero() for entry in scaled_row.values()))
                for c in free_columns:
                    if not scaled_row[c].is_zero():
                        rows[r][c] = rows[r][c] - factor.mul_low(scaled_row[c], known_terms)
        solved_rows.append((j, scaled_row))
    X = [rows[0][0] * 0 + 1] * (len(rows) + 1)
    for j, scaled_row in reversed(solved_rows):
        X[j] = -sum((entry.mul_low(X[c], known_terms) for c, entry in scaled_row.items()), 0 * X[j])
    return X


def _search_pivot(
    rows: Sequence[Sequence[nmod_poly]], free_rows: Sequence[int], free_columns: Sequence[int], precision: int
) -> Pivot:
    """Return the entry of least order in t in the free rows and columns. Raises PrecisionTooLow if all are 0."""
    pivot: Pivot | None = None
    # Rows with few nonzero entries come first: as pivot rows they create the fewest new nonzero entries.
    for i in sorted(free_rows, key=lambda i: sum(not rows[i][j].is_zero() for j in free_columns)):
        for j in free_columns:
            power = valuation(rows[i][j], precision)
            if power is not None and (pivot is None or power < pivot[0]):
                pivot = power, i, j
                if power == 0:
                    return pivot
    if pivot is None:
        raise PrecisionTooLow
    return pivot


def roots_modulo(polynomial: nmod_poly) -> list[int]:
    """Return the distinct roots in GF(p) of a nonconstant polynomial.

    The gcd with t^p - t is the product of the distinct linear factors; only this product is factored. At high degrees a
    complete factorization of the polynomial would take a hundred times as long.

    >>> sorted(roots_modulo(nmod_poly([1, 0, 1], 5) * nmod_poly([2, 0, 1], 5)))
    [2, 3]
    """
    t = nmod_poly([0, 1], polynomial.modulus())
    count_work(roots_units(len(polynomial)))
    linear = polynomial.gcd(t.pow_mod(polynomial.modulus(), polynomial) - t) if polynomial.degree() > 1 else polynomial
    count_work(roots_units(1, len(linear)))
    return [-int(factor[0]) % polynomial.modulus() for factor, _ in linear.factor()[1]]


def modulo(form: Any, field: PrimeField) -> nmod_mpoly:
    """Return a form over Q, reduced modulo the prime of `field`. Raises BadPrime."""
    context = nmod_mpoly_ctx.get(form.context().names(), modulus=field.prime, ordering=Ordering.degrevlex)
    return context.from_dict({exponents: int(field.convert(c)) for exponents, c in form.terms()})


def form_order(form: Any, field: PrimeField) -> Function:
    """Return the function that computes the order of a form over Q, in (X : Z), along curves modulo a prime.

    Raises BadPrime.
    """
    p, modular_form = field.prime, modulo(form, field)
    terms = [(exponents, nmod_poly([int(c)], p)) for exponents, c in modular_form.terms()]
    product_count = sum(map(bool, chain.from_iterable(exponents for exponents, _ in terms)))
    count_work(20 + 2 * len(terms))

    def order(X: Sequence[nmod_poly], precision: int) -> int | None:
        count_work(2 + len(terms) / 5)
        if int(modular_form(*(int(entry[0]) for entry in X))):
            return 0
        if precision > _LOW_PRECISION:  # most orders are below 4, for which few terms suffice
            low_order = order([entry.truncate(_LOW_PRECISION) for entry in X], _LOW_PRECISION)
            if low_order is not None:
                return low_order
        count_work(product_count * (0.3 + product_units(precision, precision)))
        powers = [[nmod_poly([1], p), entry] for entry in X]
        value = nmod_poly([], p)
        for exponents, term in terms:
            for powers_of_coordinate, e in zip(powers, exponents, strict=True):
                while len(powers_of_coordinate) <= e:
                    powers_of_coordinate.append(powers_of_coordinate[-1].mul_low(powers_of_coordinate[1], precision))
                if e:
                    term = term.mul_low(powers_of_coordinate[e], precision)
            value += term
        return valuation(value, precision)

    return order


def row_units(equation: Equation, length: int) -> float:
    """Return the units of work to evaluate the matrix of an equation at polynomials or series of this length."""
    return 1 + sum(len(entry) for row in equation.terms for entry in row) * (0.5 + length / 100)


def image_of(equations: Sequence[Equation], point: Sequence[int]) -> list[int] | None:
    """Return the image of a point of projective space over GF(p); None at an indeterminacy point."""
    prime, X = equations[0].over.characteristic, list(point)
    for equation in equations:
        count_work(row_units(equation, 1) + equation.dim**2 / 2)
        values = [nmod(x, prime) for x in X]
        if equation.explicit is not None:
            X = [int(x) for x in equation.image(values, nmod(0, prime))]
            if not any(X):
                return None
            continue
        rows = equation.rows(equation.monomials(values), nmod(0, prime))
        null_vectors, nullity = nmod_mat(rows, prime).nullspace()
        if nullity != 1:
            return None
        X = [int(null_vectors[k, 0]) for k in range(len(X))]
    return X
