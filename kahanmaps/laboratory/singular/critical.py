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
from functools import partial, reduce
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

    def E(X: Sequence[nmod_poly], times: Product) -> nmod_poly:
        total = X[0] * 0 + 1
        for equation, inverse in zip(equations, inverses, strict=True):
            X = equation.image(X, X[0] * 0, times)
            total = times(total, _denominator(inverse, X, times))
        return total

    return _zeros(equations, inverses, E, rng)


def pole_points(equations: Sequence[Equation], rng: random.Random) -> tuple[list[CriticalPoint], dict[int, int]]:
    """The poles modulo p on a random line that are not at infinity, as `critical_points` gives critical points."""

    def determinants(X: Sequence[nmod_poly], times: Product) -> nmod_poly:
        total = _denominator(equations[0], X, times)
        for before, equation in pairwise(equations):
            X = before.image(X, X[0] * 0, times)
            total = times(total, _denominator(equation, X, times))
        return total

    return _zeros(equations, None, determinants, rng)


def _zeros(
    equations: Sequence[Equation],
    inverses: Sequence[Equation] | None,
    function: Callable[[Sequence[nmod_poly], Product], nmod_poly],
    rng: random.Random,
) -> tuple[list[CriticalPoint], dict[int, int]]:
    """The zeros in GF(p) of a function on a random line, and how many there are in all.

    The function is E or, without inverses, det M; its value is computed from images without their common factors, and
    poles and infinity, or infinity alone, are divided out.
    """
    p = equations[0].over.characteristic
    a, b = ([rng.randrange(p) for _ in range(equations[0].dim + 1)] for _ in range(2))
    line = [nmod_poly([x, v], p) for x, v in zip(a, b, strict=True)]
    value, excluded = nmod_poly([1], p), line[-1] if inverses is None else nmod_poly([1], p)
    for k, equation in enumerate(equations):
        if inverses is None:
            value = value * _denominator(equation, line)
            if k + 1 == len(equations):
                break
        image = equation.image(line, line[-1] * 0)
        common = reduce(nmod_poly.gcd, image)
        image = [entry // common for entry in image] if common.degree() > 0 else image
        if inverses is not None:
            value = value * _denominator(inverses[k], image)
            excluded = excluded * image[-1] * common * line[-1]
        line = image
    while (shared := value.gcd(excluded)).degree() > 0:
        value = value // shared
    if value.degree() < 1:
        return [], {}
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
            # The gradient of F up to a factor, where E = F^power G: on x + t v + d w it is
            # (t F_v + d F_w)^power G + ... A power of t above all those that count stands for d.
            apart = power + 1
            curve = [nmod_poly([x, rng.randrange(p)], p) for x in point]
            far = nmod_poly([0] * apart + [1], p)
            moved = [curve, *([x + far if i == k else x for i, x in enumerate(curve)] for k in range(len(point)))]
            values = [function(X, partial(nmod_poly.mul_low, n=apart + power)) for X in moved]
            here, *there = (int(on[apart + power - 1]) for on in values)
            gradient = [(c - here) % p for c in there]
            if any(gradient):
                found.append(CriticalPoint(tuple(point), tuple(gradient), power))
    return found, degrees


def _denominator(equation: Equation, X: Sequence[nmod_poly], times: Product = operator.mul) -> nmod_poly:
    """The last minor of L at X, whose coordinates are polynomials: up to its sign det M."""
    zero = X[0] * 0
    rows = equation.rows(equation.monomials(X, times), zero)
    minor: nmod_poly = kernel_minors([[*row[:-1], zero] for row in rows], times)[-1]
    return minor
