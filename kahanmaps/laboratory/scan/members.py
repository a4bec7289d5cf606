"""Members of a family on a component of its parameters, and their degrees by another way than that of the sweep."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from typing import Any

from flint import fmpq, fmpq_mpoly, fmpq_poly, nmod_poly

from kahanmaps.algebra.chance import random_prime_field
from kahanmaps.algebra.fields import QQ, Field
from kahanmaps.errors import BadPrime
from kahanmaps.laboratory.growth.curves import Line, Stopped
from kahanmaps.maps.implicit import BirationalMap

_TRIES = 200
_PRIMES = 40
_HEIGHTS = (12, 120)  # of values at random, for roots of higher degree and others


def point_on(equations: Sequence[fmpq_mpoly], count: int, field: Field, rng: random.Random) -> tuple[Any, ...] | None:
    """A random solution over Q, of small height, or over GF(p); None where none is found.

    `equations` are those of an affine subspace, reduced so that the first variable of each is in no other, or that of a
    hypersurface. Raises BadPrime where the prime divides a denominator.

    >>> from kahanmaps.algebra.polynomials import ring
    >>> a, b = ring(["a", "b"]).gens()
    >>> found = point_on([a**2 + b**2 - 1], 2, QQ, random.Random(1))
    >>> found[0]**2 + found[1]**2
    1
    """
    pivots = [_pivot(equation) for equation in equations]
    height = _HEIGHTS[all(int(equation.degrees()[k]) == 1 for equation, k in zip(equations, pivots, strict=True))]
    for _ in range(_TRIES if len(equations) < count else 1):
        values = [field.random(rng, height) for _ in range(count)]
        for equation, pivot in zip(equations, pivots, strict=True):
            coefficients = [field.zero] * (1 + max(int(m[pivot]) for m in equation.monoms()))
            for monomial, coefficient in equation.terms():
                term = field.convert(coefficient)
                for k, exponent in enumerate(monomial):
                    if k != pivot:
                        term = term * values[k] ** int(exponent)
                coefficients[int(monomial[pivot])] += term
            polynomial = _univariate(coefficients, field)
            roots = [] if polynomial.is_zero() else polynomial.roots()
            if not roots:
                break
            values[pivot] = field.convert(int(rng.choice(roots)[0])) if field is not QQ else rng.choice(roots)[0]
        else:
            return tuple(values)
    return None


def _pivot(equation: fmpq_mpoly) -> int:
    """The first of the variables in which the degree is smallest, but not 0."""
    degrees = [int(d) for d in equation.degrees()]
    return min((k for k, d in enumerate(degrees) if d), key=lambda k: degrees[k])


def _univariate(coefficients: Sequence[Any], field: Field) -> Any:
    if field is QQ:
        return fmpq_poly(list(coefficients))
    return nmod_poly([int(c) for c in coefficients], field.characteristic)


def degrees_on(
    map_: BirationalMap,
    equations: Sequence[fmpq_mpoly],
    count: int,
    eps: fmpq | None,
    expected: Sequence[int],
    rng: random.Random,
    most: int = 1 << 20,
) -> tuple[int, ...] | None:
    """The degrees of a random member on a component modulo a random prime of 63 bits; None where none is found.

    Of `count` parameters eps is the last one where that are more than symbols. On one line; -1 where the iterate exists
    nowhere. `expected` says how many, and about how large; they end before one above `most`.
    """
    for _ in range(_PRIMES):  # a point over a number field has residues modulo some of them only
        field = random_prime_field(rng)
        try:
            values = point_on(equations, count, field, rng)
            if values is None:
                continue
            *parameters, step = values if count > len(map_.symbols) else (*values, eps)
            over = map_.at(field.random(rng) if step is None else field.convert(step), field, parameters)
            break
        except BadPrime:
            continue
    else:
        return None
    line = Line(over, rng, math.inf, most)
    found: list[int] = []
    try:
        for degree in expected:
            line.step(max(1, degree))
            found.append(line.degree)
    except Stopped:
        pass
    except ZeroDivisionError:
        found += [-1] * (len(expected) - len(found))
    return tuple(found)
