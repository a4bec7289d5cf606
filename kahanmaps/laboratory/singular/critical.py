"""Points on the hypersurfaces that a map contracts, where their polynomials are too large to be written down.

For an equation M(x) x~ = r(x) that is linear in both points det dPhi(x) is det M'(x~)/det M(x) up to its sign, with the
M' of the inverse map. So away from poles and infinity they are the zeros of E(X) = det M'(X~), where (X~ : Z~) is the
image of X. On a line E is a polynomial of one variable. Source: petrera-suris-2016, eq. (Jac).
"""

from __future__ import annotations

import operator
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise

from flint import nmod_poly

from kahanmaps.algebra.minors import Product, kernel_minors
from kahanmaps.maps.equation import Equation


@dataclass(frozen=True)
class CriticalPoint:
    """A point modulo p where the differential degenerates, how often it is a zero of E, and the gradient there.

    Or a pole: then E stands for det(I - eps f').
    """

    point: tuple[int, ...]
    gradient: tuple[int, ...]
    multiplicity: int


def critical_points(
    equations: Sequence[Equation], inverses: Sequence[Equation], rng: random.Random
) -> tuple[list[CriticalPoint], dict[int, int]]:
    """The critical points modulo p on a random line that are neither poles nor at infinity; exact.

    `equations` are those of the factors of the map over the field, linear in the point, and `inverses` those of their
    inverses; of several factors the product of their E is meant. Returns the points and, for each multiplicity, the
    number of zeros of E over the closure of GF(p): there may be zeros without points in GF(p).
    """
    a, b, line = _random_line(equations[0], rng)
    one = line[-1] * 0 + 1
    value, poles = one, one
    for equation, inverse in zip(equations, inverses, strict=True):
        image, common = _image(equation, line)
        value = value * _denominator(inverse, image)
        poles = poles * image[-1] * common * line[-1]
        line = image

    def E(X: Sequence[nmod_poly], times: Product) -> nmod_poly:
        total = one
        for equation, inverse in zip(equations, inverses, strict=True):
            X = equation.image(X, one * 0, times)
            total = times(total, _denominator(inverse, X, times))
        return total

    return _zeros(_without(value, poles), E, a, b, rng)


def pole_points(equations: Sequence[Equation], rng: random.Random) -> tuple[list[CriticalPoint], dict[int, int]]:
    """The poles modulo p on a random line that are not at infinity, as `critical_points` gives critical points."""
    a, b, line = _random_line(equations[0], rng)
    infinity, value = line[-1], line[-1] * 0 + 1
    for k, equation in enumerate(equations):
        value = value * _denominator(equation, line)
        if k + 1 < len(equations):
            line, _ = _image(equation, line)

    def determinants(X: Sequence[nmod_poly], times: Product) -> nmod_poly:
        total = _denominator(equations[0], X, times)
        for before, equation in pairwise(equations):
            X = before.image(X, infinity * 0, times)
            total = times(total, _denominator(equation, X, times))
        return total

    return _zeros(_without(value, infinity), determinants, a, b, rng)


def _random_line(equation: Equation, rng: random.Random) -> tuple[list[int], list[int], list[nmod_poly]]:
    p = equation.over.characteristic
    a, b = ([rng.randrange(p) for _ in range(equation.dim + 1)] for _ in range(2))
    return a, b, [nmod_poly([x, v], p) for x, v in zip(a, b, strict=True)]


def _image(equation: Equation, curve: Sequence[nmod_poly]) -> tuple[list[nmod_poly], nmod_poly]:
    """The image of a curve without common factor, and the factor that was divided out."""
    image = equation.image(curve, curve[-1] * 0)
    common = reduce(nmod_poly.gcd, image)
    return ([entry // common for entry in image] if common.degree() > 0 else image), common


def _without(value: nmod_poly, *others: nmod_poly) -> nmod_poly:
    """What is left of a polynomial when the zeros of others are divided out."""
    for other in others:
        while (shared := value.gcd(other)).degree() > 0:
            value = value // shared
    return value


def _zeros(
    value: nmod_poly,
    function: Callable[[Sequence[nmod_poly], Product], nmod_poly],
    a: Sequence[int],
    b: Sequence[int],
    rng: random.Random,
) -> tuple[list[CriticalPoint], dict[int, int]]:
    """The zeros in GF(p) of a function that has the given value on the line, and how many there are in all."""
    if value.degree() < 1:
        return [], {}
    p = value.modulus()
    found, degrees = [], dict[int, int]()
    t = nmod_poly([0, 1], p)
    for part, exponent in value.factor_squarefree()[1]:
        power = int(exponent)
        degrees[power] = degrees.get(power, 0) + int(part.degree())
        # Only zeros in GF(p) are of use: a whole factorization would take a hundred times as long at high degrees.
        linear = part.gcd(t.pow_mod(p, part) - t) if part.degree() > 1 else part
        for factor, _ in linear.factor()[1]:
            s = -int(factor[0])
            point = [(x + s * v) % p for x, v in zip(a, b, strict=True)]
            gradient = _gradient(function, point, power, p, rng)
            if any(gradient):
                found.append(CriticalPoint(tuple(point), tuple(gradient), power))
    return found, degrees


def _gradient(
    function: Callable[[Sequence[nmod_poly], Product], nmod_poly],
    point: Sequence[int],
    power: int,
    p: int,
    rng: random.Random,
) -> list[int]:
    """The gradient of F up to a factor, where E = F^power G: on x + t v + d w it is (t F_v + d F_w)^power G + ...

    A power of t above all those that count stands for d.
    """
    apart = power + 1
    far = nmod_poly([0] * apart + [1], p)
    curve = [nmod_poly([x, rng.randrange(p)], p) for x in point]

    def coefficient(X: Sequence[nmod_poly]) -> int:
        return int(function(X, lambda left, right: left.mul_low(right, apart + power))[apart + power - 1])

    here = coefficient(curve)
    moved = ([x + far if i == k else x for i, x in enumerate(curve)] for k in range(len(point)))
    return [(coefficient(X) - here) % p for X in moved]


def _denominator(equation: Equation, X: Sequence[nmod_poly], times: Product = operator.mul) -> nmod_poly:
    """The last minor of L at X, whose coordinates are polynomials: up to its sign det M."""
    zero = X[0] * 0
    rows = equation.rows(equation.monomials(X, times), zero)
    minor: nmod_poly = kernel_minors([[*row[:-1], zero] for row in rows], times)[-1]
    return minor
