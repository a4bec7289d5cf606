"""Curves in projective space with their tangent directions, carried by the Kahan map over GF(p)((t)).

A jet is a power series in t, known up to a power of t, with one slope a tangent direction: an element of GF(p)[[t]][d1,
..., dm]/(d_i d_j). Coordinates are homogeneous, so that nothing is ever divided but a common power of t.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import count
from typing import Any

from flint import Ordering, nmod, nmod_mat, nmod_mpoly, nmod_mpoly_ctx, nmod_poly

from kahanmaps.algebra.fields import PrimeField
from kahanmaps.maps.equation import Equation

# The order in t at the point with these coordinates, known below t^precision; None where it is not seen there.
Function = Callable[[Sequence[nmod_poly], int], int | None]


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


class Jet:
    """A power series modulo t^precision and its slopes; sums and products keep the lower precision."""

    __slots__ = ("precision", "slopes", "value")

    def __init__(self, value: nmod_poly, slopes: Sequence[nmod_poly], precision: int) -> None:
        self.value, self.slopes, self.precision = value, slopes, precision

    def __add__(self, other: Jet) -> Jet:
        slopes = [a + b for a, b in zip(self.slopes, other.slopes, strict=True)]
        return Jet(self.value + other.value, slopes, min(self.precision, other.precision))

    def __neg__(self) -> Jet:
        return Jet(-self.value, [-slope for slope in self.slopes], self.precision)

    def __sub__(self, other: Jet) -> Jet:
        return self + (-other)

    def __mul__(self, other: Jet | nmod) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value * other, [slope * other for slope in self.slopes], self.precision)
        n = min(self.precision, other.precision)
        a, b = self.value, other.value
        slopes = [a.mul_low(q, n) + b.mul_low(p, n) for p, q in zip(self.slopes, other.slopes, strict=True)]
        return Jet(a.mul_low(b, n), slopes, n)

    def over_power(self, power: int) -> Jet:
        """The jet divided by t^power. Raises NotGeneric where a slope is not divisible."""
        if any(int(slope[k]) for slope in self.slopes for k in range(power)):
            raise NotGeneric("the valuation differs at neighbouring points")
        slopes = [slope.right_shift(power) for slope in self.slopes]
        return Jet(self.value.right_shift(power), slopes, self.precision - power)


def valuation(series: nmod_poly, precision: int) -> int | None:
    """The exponent of the first term that is not zero below t^precision, None if there is none.

    >>> valuation(nmod_poly([0, 0, 3], 7), 5)
    2
    """
    return next((k for k in range(min(len(series), precision)) if int(series[k])), None)


@dataclass(frozen=True)
class Step:
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


def walk(
    equations: Sequence[Equation],
    point: Sequence[int],
    direction: Sequence[int],
    tangents: Sequence[Sequence[int]],
    precision: int,
) -> Iterator[Step]:
    """The steps of the curve point + t direction and of its neighbours point + d_i tangent_i + t direction; exact.

    The equation of the map is one over GF(p), points and vectors are residues (X : Z). Step after step without an end;
    raises PrecisionTooLow and NotGeneric.
    """
    prime = equations[0].over.characteristic
    X = [
        Jet(
            nmod_poly([x, v], prime).truncate(precision),
            [nmod_poly([tangent[k]], prime) for tangent in tangents],
            precision,
        )
        for k, (x, v) in enumerate(zip(point, direction, strict=True))
    ]
    zero = nmod_poly([], prime)
    for number in count(1):
        divided, denominators = 0, list[int | None]()
        for equation in equations_of(equations, number):
            nothing = Jet(zero, [zero] * len(tangents), X[0].precision)
            image = [nothing if jet is None else jet for jet in equation.image(X, None)]
            known = min(jet.precision for jet in image)
            common, denominator = _divided([jet.value for jet in image], known)
            X = [jet.over_power(common) for jet in image]
            divided = divided * equation.image_degree + common
            denominators.append(denominator)
        pole = None if denominator is None else denominator - common
        limit = tuple(int(jet.value[0]) for jet in X)
        yield Step(divided, pole, _product(denominators), _rank(X, prime), limit)


def walk_along(
    equations: Sequence[Equation],
    point: Sequence[int],
    direction: Sequence[int],
    precision: int,
    functions: Sequence[Function] = (),
) -> Iterator[Step]:
    """The steps of the curve point + t direction alone, which is quicker, with the orders of `functions` along it.

    As `walk` else. Raises PrecisionTooLow.
    """
    prime = equations[0].over.characteristic
    zero = nmod_poly([], prime)
    X = [nmod_poly([x, v], prime).truncate(precision) for x, v in zip(point, direction, strict=True)]
    for number in count(1):
        divided, denominators = 0, list[int | None]()
        for equation in equations_of(equations, number):

            def times(left: nmod_poly, right: nmod_poly, known: int = precision) -> nmod_poly:
                return left.mul_low(right, known)

            image = equation.image(X, zero, times)
            common, denominator = _divided(image, precision)
            precision -= common
            X = [entry.right_shift(common).truncate(precision) for entry in image]
            divided = divided * equation.image_degree + common
            denominators.append(denominator)
        pole = None if denominator is None else denominator - common
        orders = orders_of(equations, functions, number, X, precision)
        if None in orders:
            raise PrecisionTooLow
        limit = tuple(int(entry[0]) for entry in X)
        kept = tuple(order or 0 for order in orders)
        yield Step(divided, pole, _product(denominators), 0, limit, kept, tuple(X) if functions else ())


def _product(valuations: Sequence[int | None]) -> int | None:
    """The valuation of a product."""
    known = [valuation for valuation in valuations if valuation is not None]
    return sum(known) if len(known) == len(valuations) else None


def _divided(image: Sequence[nmod_poly], known: int) -> tuple[int, int | None]:
    """The exponent of t in all coordinates, and in the last one. Raises PrecisionTooLow."""
    sizes = [valuation(entry, known) for entry in image]
    seen = [size for size in sizes if size is not None]
    if not seen or min(seen) + 1 > known - 1:
        raise PrecisionTooLow
    return min(seen), sizes[-1]


def modulo(form: Any, field: PrimeField) -> nmod_mpoly:
    """A form over Q modulo a prime. Raises BadPrime."""
    context = nmod_mpoly_ctx.get(form.context().names(), modulus=field.prime, ordering=Ordering.degrevlex)
    return context.from_dict({exponents: int(field.convert(c)) for exponents, c in form.terms()})


def form_order(form: Any, field: PrimeField) -> Function:
    """The order of a form over Q in (X : Z), along curves modulo the prime of `field`. Raises BadPrime."""
    p, reduced = field.prime, modulo(form, field)
    terms = [(exponents, nmod_poly([int(c)], p)) for exponents, c in reduced.terms()]

    def order(X: Sequence[nmod_poly], precision: int) -> int | None:
        if int(reduced(*(int(entry[0]) for entry in X))):
            return 0
        if precision > _FEW and (found := order([entry.truncate(_FEW) for entry in X], _FEW)) is not None:
            return found
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


def image_of(equations: Sequence[Equation], point: Sequence[int]) -> list[int] | None:
    """The image of a point of projective space modulo p; None where all forms vanish: there only curves have one."""
    prime, X = equations[0].over.characteristic, list(point)
    for equation in equations:
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


def _rank(X: Sequence[Jet], prime: int) -> int:
    """The rank at t = 0 in projective space: the limit itself counts for nothing."""
    rows: list[list[Any]] = [[jet.value[0] for jet in X]]
    rows += [[jet.slopes[i][0] for jet in X] for i in range(len(X[0].slopes))]
    return int(nmod_mat(len(rows), len(X), [int(entry) for row in rows for entry in row], prime).rank()) - 1
