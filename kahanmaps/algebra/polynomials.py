"""Polynomials and rational functions in named variables with exact rational coefficients.

A polynomial is an `fmpq_mpoly` of FLINT in a ring made by `ring`. This module adds: values over any field (`evaluate`),
primitive integer forms, monomials up to a degree, and quotients of two polynomials. Importing it also registers
pickling of FLINT's polynomials, matrices, balls and residues, so that results can be sent between processes.

>>> import pickle
>>> x, y = ring(["x", "y"]).gens()
>>> pickle.loads(pickle.dumps(x + 2 * y)) == x + 2 * y
True
"""

from __future__ import annotations

import copyreg
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from flint import (
    Ordering,
    acb,
    arb,
    fmpq,
    fmpq_mat,
    fmpq_mpoly,
    fmpq_mpoly_ctx,
    fmpq_poly,
    fmpz,
    fmpz_mat,
    fmpz_mod,
    fmpz_mod_ctx,
    fmpz_poly,
    nmod,
)

from kahanmaps.algebra.integers import content, over_common_denominator
from kahanmaps.algebra.work import count_work
from kahanmaps.display_protocols import LatexDisplay, shorten
from kahanmaps.errors import InputError, quoted

_MAX_FACTORED_TERMS = 100_000  # polynomials with more terms are not factored


def ring(names: Sequence[str]) -> fmpq_mpoly_ctx:
    """Return the ring Q[names], with monomials ordered by degree, then reverse lexicographically.

    >>> ring(["x", "y"]).gens()
    (x, y)
    """
    if len(set(names)) != len(names):
        repeated_names = sorted({name for name in names if list(names).count(name) > 1})
        raise InputError(f"found the variable {quoted(repeated_names[0])} twice, expected distinct names")
    return fmpq_mpoly_ctx.get(tuple(names), Ordering.degrevlex)


def names_of(polynomial: fmpq_mpoly) -> tuple[str, ...]:
    """Return the names of the variables of the ring of `polynomial`."""
    return tuple(polynomial.context().names())


def degree(polynomial: fmpq_mpoly) -> int:
    """Return the total degree; -1 for the zero polynomial."""
    return -1 if polynomial.is_zero() else int(polynomial.total_degree())


def degree_in(polynomial: fmpq_mpoly, count: int) -> int:
    """Return the total degree in the first `count` variables, and 0 for the zero polynomial.

    >>> x, a = ring(["x", "a"]).gens()
    >>> degree_in(a**3*x**2 + a**7, 1)
    2
    """
    return max((sum(int(e) for e in monomial[:count]) for monomial in polynomial.monoms()), default=0)


def is_homogeneous(polynomial: fmpq_mpoly, of_degree: int) -> bool:
    """Whether every monomial has total degree `of_degree` (true for the zero polynomial)."""
    return all(sum(monomial) == of_degree for monomial in polynomial.monoms())


def is_weighted_homogeneous(polynomial: fmpq_mpoly, weights: Sequence[int]) -> bool:
    """Whether all monomials have the same degree if the variables have these weights.

    >>> x, y = ring(["x", "y"]).gens()
    >>> is_weighted_homogeneous(x**2 + x * y**3, [3, 1])
    True
    """
    degrees = {sum(w * int(e) for w, e in zip(weights, monomial, strict=True)) for monomial in polynomial.monoms()}
    return len(degrees) <= 1


def gradient(polynomial: fmpq_mpoly) -> tuple[fmpq_mpoly, ...]:
    """Return the partial derivatives, in the order of the variables of the ring.

    >>> x, y = ring(["x", "y"]).gens()
    >>> gradient(x**2*y)
    (2*x*y, x^2)
    """
    return tuple(polynomial.derivative(i) for i in range(polynomial.context().nvars()))


def monomials(count: int, of_degree: int) -> Iterator[tuple[int, ...]]:
    """Yield the exponent vectors of all monomials of degree `of_degree` in `count` variables, starting with x1^degree.

    >>> list(monomials(2, 2))
    [(2, 0), (1, 1), (0, 2)]
    """
    if count == 0:
        if of_degree == 0:
            yield ()
        return
    if count == 1:
        yield (of_degree,)
        return
    for first_exponent in range(of_degree, -1, -1):
        for remaining_exponents in monomials(count - 1, of_degree - first_exponent):
            yield (first_exponent, *remaining_exponents)


def common_denominator(polynomial: fmpq_mpoly) -> fmpz:
    """Return the least positive integer whose product with `polynomial` has integer coefficients."""
    return over_common_denominator(polynomial.coeffs())[1]


def digits_of(polynomials: Iterable[fmpq_mpoly]) -> int:
    """Return the approximate number of digits of the longest coefficient if all are written over one denominator.

    >>> x, y = ring(["x", "y"]).gens()
    >>> digits_of([x/3, 1000*y])
    4
    """
    integers, denominator = over_common_denominator(
        coefficient for polynomial in polynomials for coefficient in polynomial.coeffs()
    )
    largest = max([denominator, *integers], key=abs)
    return int(largest.bit_length() * 0.30103) + 1


def over_one_denominator(
    functions: Sequence[RationalFunction], context: fmpq_mpoly_ctx, images: Sequence[fmpq_mpoly]
) -> tuple[list[fmpq_mpoly], fmpq_mpoly]:
    """Return the numerators of the functions over their least common denominator, and this denominator.

    The variables are replaced by the polynomials `images`, elements of the ring `context`.

    >>> x, y = ring(["x", "y"]).gens()
    >>> over_one_denominator([RationalFunction(y, x), RationalFunction(x, x * y)], x.context(), [x, y])
    ([y^2, x], x*y)
    """

    def substitute_images(polynomial: fmpq_mpoly) -> fmpq_mpoly:
        count = polynomial.context().nvars()
        if count:
            return polynomial.compose(*images[:count], ctx=context)
        return context.constant(0 if polynomial.is_zero() else polynomial.leading_coefficient())

    pairs = [(substitute_images(function.numerator), substitute_images(function.denominator)) for function in functions]
    denominator = context.constant(1)
    for _, entry_denominator in pairs:
        denominator = denominator * entry_denominator / denominator.gcd(entry_denominator)
    return [numerator * (denominator / entry_denominator) for numerator, entry_denominator in pairs], denominator


def primitive_part(polynomial: fmpq_mpoly) -> tuple[fmpq, fmpq_mpoly]:
    """Return (c, P) with `polynomial` = c P, where P has coprime integer coefficients, the leading one positive.

    >>> x, y = ring(["x", "y"]).gens()
    >>> primitive_part(x/2 - 3*y/4)
    (1/4, 2*x - 3*y)
    """
    if polynomial.is_zero():
        return fmpq(1), polynomial
    integers, denominator = over_common_denominator(polynomial.coeffs())
    factor = fmpq(content(integers), denominator)
    if polynomial.leading_coefficient() < 0:
        factor = -factor
    return factor, polynomial / factor


def irreducible_factors(polynomial: fmpq_mpoly) -> list[tuple[fmpq_mpoly, int]]:
    """Return the nonconstant irreducible factors over Q with their exponents.

    A polynomial with more than 100,000 terms is returned unfactored: FLINT takes about ten microseconds for each term,
    and cannot be interrupted.

    >>> x, y = ring(["x", "y"]).gens()
    >>> irreducible_factors(2 * x**2 * (x + y))
    [(x + y, 1), (x, 2)]
    """
    if len(polynomial) > _MAX_FACTORED_TERMS:
        return [(polynomial, 1)]
    count_work(10 + 12 * len(polynomial))
    return [(factor, int(power)) for factor, power in polynomial.factor()[1]]


def evaluate(polynomial: fmpq_mpoly, field: Any, point: Sequence[Any]) -> Any:
    """Return the value at `point`, a sequence of elements of `field`; the coefficients are converted to `field`.

    Raises `BadPrime` if the field is GF(p) and p divides the denominator of a coefficient.
    """
    if all(isinstance(entry, fmpq) for entry in point):
        # Compute with integers over a common denominator: one gcd for the result instead of one for each term.
        total_degree = degree(polynomial)
        if total_degree <= 0:
            return polynomial.leading_coefficient() if total_degree == 0 else fmpq(0)
        X, W = over_common_denominator(point)
        denominator = common_denominator(polynomial)
        powers: list[list[Any]] = [*([fmpz(1), entry] for entry in X), [fmpz(1), W]]
        total: Any = fmpz(0)
        for monomial, coefficient in polynomial.terms():
            term: Any = coefficient.p * (denominator // coefficient.q)
            for base_powers, exponent in zip(powers, (*monomial, total_degree - int(sum(monomial))), strict=True):
                if exponent:
                    term = term * _power(base_powers, exponent)
            total += term
        return fmpq(total, denominator * _power(powers[-1], total_degree))
    field_value = field.value(polynomial, point)
    if field_value is not None:
        return field_value
    count_work(1 + 3 * len(polynomial))
    powers = [[field.one, entry] for entry in point]
    total = field.zero
    with field.working():
        for monomial, coefficient in polynomial.terms():
            term = field.convert(coefficient)
            for i, exponent in enumerate(monomial):
                if exponent:
                    term = term * _power(powers[i], exponent)
            total = total + term
    return total


def _power(powers: list[Any], exponent: int) -> Any:
    """Return powers[1]^exponent, where powers[k] = powers[1]^k; the list is extended if it is too short."""
    while len(powers) <= exponent:
        powers.append(powers[-1] * powers[1])
    return powers[exponent]


def linear_combinations(matrix: fmpq_mat, polynomials: Sequence[fmpq_mpoly]) -> tuple[fmpq_mpoly, ...]:
    """Return the product of `matrix` and the column vector of `polynomials`."""
    zero: Any = polynomials[0].context().constant(0)
    combinations = []
    for i in range(matrix.nrows()):
        total = zero
        for j, polynomial in enumerate(polynomials):
            if matrix[i, j] != fmpq(0):
                total = total + matrix[i, j] * polynomial
        combinations.append(total)
    return tuple(combinations)


def substitute(polynomial: fmpq_mpoly, values: Mapping[str, fmpq]) -> fmpq_mpoly:
    """Replace some variables by numbers; the result is in the ring of the remaining variables."""
    names = names_of(polynomial)
    numbers: dict[Any, Any] = {name: value for name, value in values.items() if name in names}
    return polynomial.subs(numbers).project_to_context(ring([name for name in names if name not in numbers]))


def coefficients_in(polynomial: fmpq_mpoly, count: int) -> list[fmpq_mpoly]:
    """Return the coefficients of a polynomial with respect to monomials in the first `count` variables.

    The coefficients are polynomials in the remaining variables, as elements of the same ring.

    >>> x, a, b = ring(["x", "a", "b"]).gens()
    >>> coefficients_in(a*x**2 + b*x - a*b*x + 3, 1)
    [a, -a*b + b, 3]
    """
    coefficients: dict[tuple[int, ...], dict[tuple[int, ...], fmpq]] = {}
    for monomial, value in polynomial.terms():
        exponents = tuple(int(e) for e in monomial)
        coefficients.setdefault(exponents[:count], {})[((0,) * count + exponents[count:])] = value
    return [polynomial.context().from_dict(terms) for terms in coefficients.values()]


@dataclass(frozen=True, eq=False, repr=False)
class RationalFunction(LatexDisplay):
    """A quotient of polynomials over Q; the denominator has coprime integer coefficients, the first of them positive.

    Common factors are not canceled, since a gcd of large polynomials is expensive. Two rational functions are equal if
    their cross products are equal.

    >>> x, y = ring(["x", "y"]).gens()
    >>> RationalFunction(x, 2*y) == RationalFunction(x*y, 2*y**2)
    True
    """

    numerator: fmpq_mpoly
    denominator: fmpq_mpoly

    def __post_init__(self) -> None:
        if self.denominator.is_zero():
            raise InputError("found a rational function with denominator 0")
        factor, primitive = primitive_part(self.denominator)
        object.__setattr__(self, "numerator", self.numerator / factor)
        object.__setattr__(self, "denominator", primitive)

    @classmethod
    def reduced(cls, numerator: fmpq_mpoly, denominator: fmpq_mpoly) -> RationalFunction:
        """Return the quotient in lowest terms.

        >>> x, y = ring(["x", "y"]).gens()
        >>> RationalFunction.reduced(x * y, 2 * y**2).denominator
        y
        """
        count_work(10 + (len(numerator) + len(denominator)) / 2)
        gcd = numerator.gcd(denominator)
        return cls(numerator / gcd, denominator / gcd)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, RationalFunction):
            return NotImplemented
        if names_of(self.numerator) != names_of(other.numerator):
            return False
        return bool(self.numerator * other.denominator == other.numerator * self.denominator)

    # Equal functions may be stored with different common factors, so no fast hash is consistent with ==.
    __hash__ = None  # type: ignore[assignment]

    @property
    def is_polynomial(self) -> bool:
        return bool(self.denominator.is_constant())

    @property
    def names(self) -> tuple[str, ...]:
        return names_of(self.numerator)

    def __str__(self) -> str:
        text: str = import_module("kahanmaps.algebra.printing").format_rational_function(self)
        return text

    def __repr__(self) -> str:
        return f"RationalFunction({shorten(str(self), 100)})"

    def __call__(self, *point: Any, **named: Any) -> Any:
        """Return the value at a point: exact for exact numbers, rounded if a coordinate is a float, None at a pole.

        The arguments are the values of `names`, in order. The variables may be one point: I(x, eps) for a function I,
        with x such as "1,2" or {"x": 1, "y": 2}. Names may be keywords: I(x, eps="1/10"), I(x, h="1/5"). For several
        points, such as an orbit, the result is the array of values; for float points, NaN marks a pole.
        """
        return import_module("kahanmaps.maps.values").function_value(self, point, named)

    def value(self, field: Any, point: Sequence[Any]) -> Any:
        """Return the value at `point`, an element of `field`, or None if the denominator is zero at this point."""
        denominator = evaluate(self.denominator, field, point)
        if field.is_zero(denominator):
            return None
        numerator = evaluate(self.numerator, field, point)
        with field.working():
            return numerator / denominator


# Pickling.


def _make_polynomial(names: tuple[str, ...], ordering: str, terms: dict[tuple[int, ...], fmpq]) -> fmpq_mpoly:
    return fmpq_mpoly_ctx.get(names, Ordering[ordering]).from_dict(terms)


def _make_residue(value: int, modulus: int) -> fmpz_mod:
    return fmpz_mod_ctx(modulus)(value)


def _reduce_matrix(A: Any) -> tuple[Any, ...]:
    return type(A), (A.nrows(), A.ncols(), A.entries())


def _reduce_univariate(P: Any) -> tuple[Any, ...]:
    return type(P), (P.coeffs(),)


copyreg.pickle(fmpq_mat, _reduce_matrix)
copyreg.pickle(fmpz_mat, _reduce_matrix)
copyreg.pickle(fmpq_poly, _reduce_univariate)
copyreg.pickle(fmpz_poly, _reduce_univariate)
copyreg.pickle(
    fmpq_mpoly, lambda P: (_make_polynomial, (P.context().names(), P.context().ordering().name, P.to_dict()))
)
# Midpoint and radius are exact integers times powers of 2, independent of the current precision.
copyreg.pickle(arb, lambda x: (arb, tuple(y.man_exp() if y.is_finite() else float(y) for y in (x.mid(), x.rad()))))
copyreg.pickle(acb, lambda x: (acb, (x.real, x.imag)))
copyreg.pickle(nmod, lambda x: (nmod, (int(x), x.modulus())))
# fmpz_mod has no method that returns its modulus p: the residue 0 x - 1 is p - 1.
copyreg.pickle(fmpz_mod, lambda x: (_make_residue, (int(x), int(0 * x - 1) + 1)))
