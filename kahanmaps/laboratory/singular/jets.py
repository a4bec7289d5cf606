"""Curves in projective space with their tangent directions, carried by the Kahan map over GF(p)((t)).

Coordinates are power series in t, known up to a power of t. They are homogeneous, so that nothing is ever divided but a
common power of t. For the differential a curve has neighbours: moved by t^N in a tangent direction, from which it is
told by the terms from t^N to t^2N, as by a number whose square is 0.
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
from kahanmaps.algebra.work import count
from kahanmaps.maps.equation import Equation

# The order in t at the point with these coordinates, known below t^precision; None where it is not seen there.
Function = Callable[[Sequence[nmod_poly], int], int | None]


Place = tuple[int, int, int]  # an exponent of t, a row and a column
_ELIMINATED = 4  # the least dimension in which there are more minors than steps of an elimination
_FEW = 4  # terms, of which mostly one is the first that is not zero


class PrecisionTooLow(ArithmeticError):
    """The series are not known far enough in t: start again with more terms."""


class NotGeneric(ArithmeticError):
    """The point lies in a special position on its hypersurface: take another."""


class Letters(tuple[Equation, ...]):
    """Equations each of which is a step of its own, one after the other and from the beginning again: a word of maps.

    A function belongs to one place in the word: it is looked at after so many steps as `places` says for it, and after
    whole words more.
    """

    places: tuple[int, ...] = ()


def equations_of(equations: Sequence[Equation], step: int) -> Sequence[Equation]:
    """Those that make the step 1, 2, ...: one letter of a word, else all."""
    return (equations[(step - 1) % len(equations)],) if isinstance(equations, Letters) else equations


def orders_of(
    equations: Sequence[Equation], functions: Sequence[Function], step: int, X: Sequence[nmod_poly], precision: int
) -> list[int | None]:
    """The orders of functions along a curve after a step; 0 for those of another place in a word."""
    if isinstance(equations, Letters):
        here = [(step - place) % len(equations) == 0 for place in equations.places]
        return [function(X, precision) if at else 0 for function, at in zip(functions, here, strict=True)]
    return [function(X, precision) for function in functions]


def valuation(series: nmod_poly, precision: int) -> int | None:
    """The exponent of the first term that is not zero below t^precision, None if there is none.

    >>> valuation(nmod_poly([0, 0, 3], 7), 5)
    2
    """
    return next((k for k in range(min(len(series), precision)) if int(series[k])), None)


@dataclass(frozen=True)
class JetStep:
    """What is found after one step: valuations in t (None: not below the precision), and the rank of the differential.

    `common` is the power of t divided out of all coordinates, of several factors that of their minors put into each
    other; `pole` the valuation of Z at the image when the least of
    all coordinates is 0 (the order of the pole), `denominator` that of det(I - eps f') at the point before the step,
    `rank` the rank of the differential of the map from the hypersurface to the limits of its points, `limit` such a
    point after the step, `orders` the valuations at the image of the functions that were asked for, `curve` the image
    itself as far as it is known, where these are followed.
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
    """The steps of the curve point + t direction, with its neighbours in the tangent directions; exact.

    The equation of the map is one over GF(p), points and vectors are residues (X : Z). Without tangents nothing is said
    of the rank, with them nothing of the orders of `functions`. Step after step without an end; raises PrecisionTooLow
    and NotGeneric.
    """
    prime = equations[0].over.characteristic
    apart = precision if tangents else 0
    line = [nmod_poly([x, v], prime) for x, v in zip(point, direction, strict=True)]
    far = nmod_poly([0] * apart + [1], prime)
    curves = [line, *([x + far * w for x, w in zip(line, tangent, strict=True)] for tangent in tangents)]
    curves = [[entry.truncate(apart + precision) for entry in curve] for curve in curves]
    for number in integers(1):
        divided, denominators = 0, list[int | None]()
        for equation in equations_of(equations, number):
            places: list[Place] = []
            moved = [_moved(equation, curve, precision, apart + precision, places) for curve in curves]
            common = sum(power for power, *_ in places)
            if common + 1 > precision - 1:
                raise PrecisionTooLow
            precision -= common
            curves = [[entry.truncate(apart + precision) for entry in curve] for curve in moved]
            # the differences of coordinates of the neighbours to those of the curve
            slopes = [there - here for curve in curves[1:] for here, there in zip(curves[0], curve, strict=True)]
            if not all(slope.truncate(apart).is_zero() for slope in slopes):
                raise NotGeneric("the valuation differs at neighbouring points")
            last = valuation(curves[0][-1], precision)
            divided = divided * equation.image_degree + common
            denominators.append(None if last is None else last + common)
        orders = orders_of(equations, functions, number, curves[0], precision) if functions else []
        if None in orders:
            raise PrecisionTooLow
        limit = tuple(int(entry[0]) for entry in curves[0])
        rank = 0
        if tangents:  # at t = 0 in projective space: the limit itself counts for nothing
            entries = [*limit, *(int(slope[apart]) for slope in slopes)]
            rank = int(nmod_mat(len(curves), len(limit), entries, prime).rank()) - 1
        kept = tuple(order or 0 for order in orders)
        denominator = None if None in denominators else sum(order or 0 for order in denominators)
        yield JetStep(divided, last, denominator, rank, limit, kept, tuple(curves[0]) if functions else ())


def _moved(
    equation: Equation, X: Sequence[nmod_poly], precision: int, known: int, places: list[Place]
) -> list[nmod_poly]:
    """The image of a curve known below t^known without a common power of t, which is told by `places`.

    They are empty for a curve, and those of the curve for its neighbours. Raises PrecisionTooLow.
    """
    zero, unit = X[0] * 0, product_units(known, known)
    count(row_units(equation, known))

    def times(left: nmod_poly, right: nmod_poly) -> nmod_poly:
        count(unit)
        return left.mul_low(right, known)

    if equation.dim >= _ELIMINATED and equation.explicit is None:
        return kernel(equation.rows(equation.monomials(X, times), zero), precision, known, places)
    image = equation.image(X, zero, times)
    if not places:
        places.append(_least([image], [0], range(len(image)), precision))
    return [entry.right_shift(places[0][0]) for entry in image]


def kernel(
    rows: list[list[nmod_poly]],
    precision: int,
    known: int,
    places: list[Place],
    check: Callable[[], None] = lambda: None,
) -> list[nmod_poly]:
    """The kernel of an n x (n + 1) matrix of series, without a common power of t; its minors have that of all places.

    A pivot has the least exponent of all entries that are left, so that nothing but its own power of t is divided out.
    The exponents are below `precision`. `check` is called before each row, and may raise. Raises PrecisionTooLow.
    """
    left_rows, left = list(range(len(rows))), list(range(len(rows) + 1))
    inversion, product = series_units(known), 0.3 + product_units(known, known)
    solved: list[tuple[int, dict[int, nmod_poly]]] = []
    for k in range(len(rows)):
        if len(places) == k:
            places.append(_least(rows, left_rows, left, precision))
        power, i, j = places[k]
        left_rows.remove(i)
        left.remove(j)
        count(inversion + product * len(left) * 2)  # with those of the kernel
        inverse = rows[i][j].right_shift(power).inverse_series_trunc(known - power)
        normal = {c: rows[i][c].right_shift(power).mul_low(inverse, known - power) for c in left}
        for r in left_rows:
            check()
            factor = rows[r][j]
            if not factor.is_zero():
                count(product * sum(not entry.is_zero() for entry in normal.values()))
                for c in left:
                    if not normal[c].is_zero():
                        rows[r][c] = rows[r][c] - factor.mul_low(normal[c], known)
        solved.append((j, normal))
    X = [rows[0][0] * 0 + 1] * (len(rows) + 1)
    for j, normal in reversed(solved):
        X[j] = -sum((entry.mul_low(X[c], known) for c, entry in normal.items()), 0 * X[j])
    return X


def _least(rows: Sequence[Sequence[nmod_poly]], left_rows: Sequence[int], left: Sequence[int], precision: int) -> Place:
    """The entry of the least exponent of t in these rows and columns. Raises PrecisionTooLow where there is none."""
    best: Place | None = None
    # The row with the fewest entries fills in the fewest others.
    for i in sorted(left_rows, key=lambda i: sum(not rows[i][j].is_zero() for j in left)):
        for j in left:
            power = valuation(rows[i][j], precision)
            if power is not None and (best is None or power < best[0]):
                best = power, i, j
                if power == 0:
                    return best
    if best is None:
        raise PrecisionTooLow
    return best


def roots_modulo(polynomial: nmod_poly) -> list[int]:
    """The different zeros in GF(p) of a polynomial that is no constant.

    Their product is found first: a whole factorization would take a hundred times as long at high degrees.

    >>> sorted(roots_modulo(nmod_poly([1, 0, 1], 5) * nmod_poly([2, 0, 1], 5)))
    [2, 3]
    """
    t = nmod_poly([0, 1], polynomial.modulus())
    count(roots_units(len(polynomial)))
    linear = polynomial.gcd(t.pow_mod(polynomial.modulus(), polynomial) - t) if polynomial.degree() > 1 else polynomial
    count(roots_units(1, len(linear)))
    return [-int(factor[0]) % polynomial.modulus() for factor, _ in linear.factor()[1]]


def modulo(form: Any, field: PrimeField) -> nmod_mpoly:
    """A form over Q modulo a prime. Raises BadPrime."""
    context = nmod_mpoly_ctx.get(form.context().names(), modulus=field.prime, ordering=Ordering.degrevlex)
    return context.from_dict({exponents: int(field.convert(c)) for exponents, c in form.terms()})


def form_order(form: Any, field: PrimeField) -> Function:
    """The order of a form over Q in (X : Z), along curves modulo the prime of `field`. Raises BadPrime."""
    p, reduced = field.prime, modulo(form, field)
    terms = [(exponents, nmod_poly([int(c)], p)) for exponents, c in reduced.terms()]
    products = sum(map(bool, chain.from_iterable(exponents for exponents, _ in terms)))
    count(20 + 2 * len(terms))

    def order(X: Sequence[nmod_poly], precision: int) -> int | None:
        count(2 + len(terms) / 5)
        if int(reduced(*(int(entry[0]) for entry in X))):
            return 0
        if precision > _FEW and (found := order([entry.truncate(_FEW) for entry in X], _FEW)) is not None:
            return found
        count(products * (0.3 + product_units(precision, precision)))
        powers = [[nmod_poly([1], p), entry] for entry in X]
        total = nmod_poly([], p)
        for exponents, term in terms:
            for table, e in zip(powers, exponents, strict=True):
                while len(table) <= e:
                    table.append(table[-1].mul_low(table[1], precision))
                if e:
                    term = term.mul_low(table[e], precision)
            total += term
        return valuation(total, precision)

    return order


def row_units(equation: Equation, length: int) -> float:
    """The units of work for the matrix of an equation at polynomials or series of this length."""
    return 1 + sum(len(entry) for row in equation.terms for entry in row) * (0.5 + length / 100)


def image_of(equations: Sequence[Equation], point: Sequence[int]) -> list[int] | None:
    """The image of a point of projective space modulo p; None where all forms vanish: there only curves have one."""
    prime, X = equations[0].over.characteristic, list(point)
    for equation in equations:
        count(row_units(equation, 1) + equation.dim**2 / 2)
        values = [nmod(x, prime) for x in X]
        if equation.explicit is not None:
            X = [int(x) for x in equation.image(values, nmod(0, prime))]
            if not any(X):
                return None
            continue
        rows = equation.rows(equation.monomials(values), nmod(0, prime))
        kernel, nullity = nmod_mat(rows, prime).nullspace()
        if nullity != 1:
            return None
        X = [int(kernel[k, 0]) for k in range(len(X))]
    return X
