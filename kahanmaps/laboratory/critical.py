"""Points on the hypersurfaces that a Kahan map contracts, where their polynomials are too large to be written down.

det dPhi(x) = det(I + eps f'(x~))/det(I - eps f'(x)), so that away from poles and infinity they are the zeros of
E(X) = det(Z~ I + eps (f''(X~) + Z~ B)), where (X~ : Z~) is the image of X. On a line E is a polynomial of one variable.
Source: petrera-suris-2016, eq. (Jac).
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from flint import nmod_poly

from kahanmaps.algebra.fields import PrimeField
from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.laboratory.jets import Jet
from kahanmaps.maps.projective import Forms


@dataclass(frozen=True)
class CriticalPoint:
    """A point modulo p where the differential degenerates, how often it is a zero of E, and the gradient there."""

    point: tuple[int, ...]
    gradient: tuple[int, ...]
    multiplicity: int


def critical_points(
    forms: Forms, inverse: Forms, field: PrimeField, rng: random.Random
) -> tuple[list[CriticalPoint], dict[int, int]]:
    """The critical points modulo p on a random line that are neither poles nor at infinity; exact.

    `forms` are the linear forms of the map at eps over the field, `inverse` those at -eps. Returns the points and, for
    each multiplicity, the number of zeros of E over the closure of GF(p): there may be zeros without points in GF(p).
    """
    p, size = field.prime, len(forms) + 1
    a, b = ([rng.randrange(p) for _ in range(size)] for _ in range(2))
    line = [nmod_poly([x, v], p) for x, v in zip(a, b, strict=True)]
    image = kernel_minors(_entries(forms, line, nmod_poly([], p)))
    common = nmod_poly([], p)
    for entry in image:
        common = common.gcd(entry)
    if common.degree() > 0:
        image = [entry // common for entry in image]
    value = _denominator(inverse, image, nmod_poly([], p))
    for forbidden in (image[-1] * common, line[-1]):  # poles, infinity
        while (shared := value.gcd(forbidden)).degree() > 0:
            value = value // shared
    if value.degree() < 1:
        return [], {}
    found = []
    factors = [(factor, int(power)) for factor, power in value.factor()[1]]
    degrees: dict[int, int] = {}
    for factor, power in factors:
        degrees[power] = degrees.get(power, 0) + int(factor.degree())
    for factor, power in factors:
        if factor.degree() == 1:
            s = -int(factor[0])
            point = [(x + s * v) % p for x, v in zip(a, b, strict=True)]
            gradient = _gradient(forms, inverse, point, power, field, rng)
            if any(gradient):
                found.append(CriticalPoint(tuple(point), tuple(gradient), power))
    return found, degrees


def _gradient(
    forms: Forms, inverse: Forms, point: Sequence[int], power: int, field: PrimeField, rng: random.Random
) -> list[int]:
    """The gradient of F up to a factor, where E = F^power G: on x + t v + d w it is (t F_v + d F_w)^power G + ..."""
    p, size, n = field.prime, len(point), power + 1
    zero, one = nmod_poly([], p), nmod_poly([1], p)
    curve = [
        Jet(nmod_poly([x, rng.randrange(p)], p), [one if i == k else zero for i in range(size)], n)
        for k, x in enumerate(point)
    ]
    nothing = Jet(zero, [zero] * size, n)
    value = _denominator(inverse, kernel_minors(_entries(forms, curve, nothing)), nothing)
    return [int(slope[power - 1]) for slope in value.slopes]


def _entries(forms: Forms, X: Sequence[Any], zero: Any) -> list[list[Any]]:
    """The matrix of linear forms at X, whose coordinates are polynomials or jets."""
    rows = []
    for row in forms:
        entries = []
        for form in row:
            total = zero
            for coefficient, x in zip(form, X, strict=True):
                number = int(coefficient)
                if number:
                    total = total + (x.times(number) if isinstance(x, Jet) else x * number)
            entries.append(total)
        rows.append(entries)
    return rows


def _denominator(forms: Forms, X: Sequence[Any], zero: Any) -> Any:
    """The last minor, det(Z I - eps (f''(X) + Z B)) for the eps of the forms."""
    return kernel_minors([[*row[:-1], zero] for row in _entries(forms, X, zero)])[-1]
