"""What becomes of a hypersurface under the Kahan map: points on it modulo large primes, followed along series.

Source: grammaticos-ramani-papageorgiou-1991.
"""

from __future__ import annotations

import random
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from flint import fmpq, nmod_poly

from kahanmaps.algebra.fields import PrimeField
from kahanmaps.algebra.matrices import nullspace
from kahanmaps.checks.decide import random_prime_field
from kahanmaps.errors import BadPrime
from kahanmaps.laboratory.critical import critical_points
from kahanmaps.laboratory.jets import NotGeneric, PrecisionTooLow, Step, follow
from kahanmaps.maps.projective import linear_forms
from kahanmaps.systems.quadratic import QuadraticSystem

_MAX_PRECISION = 4096
_TRIES = 40
_LINES = 6  # on which critical points are looked for
_POINTS = 2  # each modulo a prime of its own

CONFINED = "confined"
NOT_CONFINED = "not confined"
NOT_CONTRACTED = "not contracted"
UNDECIDED = "undecided"


@dataclass(frozen=True)
class Hypersurface:
    """An irreducible hypersurface over Q and what becomes of it under the map, at one exact eps.

    `is_pole`: it is a factor of det(I - eps f'(x)); `multiplicity`: how often it divides the Jacobian determinant of
    the homogeneous map (None: not computed); `polynomial` is "Z" for the hyperplane at infinity, and "?" where it is
    too large: then `degree` is that of all components of this multiplicity together. `status` is
    "confined", "not confined", "not contracted" or "undecided"; it is contracted by the step `contracted_at` and is a
    hypersurface again after the step `confined_at` (each None if that did not happen). `steps` tells every step, at
    the first of two points, modulo the first of the `primes`.
    """

    polynomial: str
    degree: int
    is_pole: bool
    multiplicity: int | None
    status: str
    contracted_at: int | None
    confined_at: int | None
    steps: tuple[Step, ...]
    primes: tuple[int, ...]
    note: str = ""


def fate_of(
    system: QuadraticSystem, eps: fmpq, factor: Any, steps: int, rng: random.Random, end: float
) -> tuple[str, int | None, int | None, tuple[Step, ...], tuple[int, ...], str]:
    """What becomes of the hypersurface on which a form over Q vanishes, at one exact eps (half the time step).

    `factor` is irreducible, in the variables (X : Z); two points modulo two random primes are followed for `steps`
    steps, until `end` of the monotonic clock. Returns status, the step that contracts, the step that confines (or
    None), the steps, the primes and a note: the fields of a Hypersurface. Source: grammaticos-ramani-papageorgiou-1991.
    """
    runs: list[list[Step]] = []
    primes: list[int] = []
    for _ in range(_TRIES):
        if len(runs) == _POINTS or time.monotonic() > end:
            break
        field = random_prime_field(rng)
        try:
            forms = linear_forms(system, eps, field)
            place = _point_on(factor, field, rng)
        except BadPrime:
            continue
        if place is None or field.prime in primes:
            continue
        try:
            runs.append(_followed(forms, *place, field, rng, steps, end))
            primes.append(field.prime)
        except NotGeneric:
            continue
        except PrecisionTooLow:
            return UNDECIDED, None, None, (), tuple(primes), "the series lost all their terms"
    if len(runs) < _POINTS:
        return UNDECIDED, None, None, (), tuple(primes), "no two points could be followed in time"
    full = system.dim - 1
    fates = [_told([step.rank for step in run], full) for run in runs]
    if fates[0] != fates[1]:
        return UNDECIDED, None, None, tuple(runs[0]), tuple(primes), "two points tell different things"
    return (*fates[0], tuple(runs[0]), tuple(primes), "")


def unwritten(system: QuadraticSystem, eps: fmpq, steps: int, rng: random.Random, end: float) -> list[Hypersurface]:
    """The contracted hypersurfaces without their polynomials, told apart by multiplicity and fate of random points.

    At one exact `eps` (half the time step), on lines modulo random primes, until `end` of the monotonic clock. Poles
    and infinity are left out. One with a multiplicity of which no point was found is undecided. Source: zander-2021.
    """
    found: dict[tuple[Any, ...], Hypersurface] = {}
    degrees: dict[int, int] = {}
    for _ in range(_LINES):
        field = random_prime_field(rng)
        try:
            forms, inverse = linear_forms(system, eps, field), linear_forms(system, -eps, field)
        except BadPrime:
            continue
        points, seen = critical_points(forms, inverse, field, rng)
        degrees |= seen
        for critical in points:
            tangents = _tangents(critical.point, critical.gradient, field)
            if tangents is None or time.monotonic() > end:
                continue
            try:
                run = _followed(forms, critical.point, tangents, field, rng, steps, end)
                fate = _told([step.rank for step in run], system.dim - 1)
            except NotGeneric:
                continue
            except PrecisionTooLow:
                run, fate = [], (UNDECIDED, None, None)
            key = (critical.multiplicity, *fate)
            before = found.get(key)
            primes = (*(before.primes if before else ()), field.prime)
            found[key] = Hypersurface(
                "?",
                seen[critical.multiplicity],
                False,
                critical.multiplicity,
                *fate,
                before.steps if before else tuple(run),
                tuple(dict.fromkeys(primes)),
            )
    for multiplicity in set(degrees) - {h.multiplicity for h in found.values()}:
        nothing = (
            "?",
            degrees[multiplicity],
            False,
            multiplicity,
            UNDECIDED,
            None,
            None,
            (),
            (),
            "no point was followed",
        )
        found[(multiplicity,)] = Hypersurface(*nothing)
    return sorted(found.values(), key=lambda h: (h.multiplicity, h.status, h.confined_at or 0))


def _told(ranks: Sequence[int], full: int) -> tuple[str, int | None, int | None]:
    """Status, the step that contracts and the step that ends it."""
    down = next((k for k, rank in enumerate(ranks, 1) if rank < full), None)
    if down is None:
        return NOT_CONTRACTED, None, None
    up = next((k for k, rank in enumerate(ranks, 1) if k > down and rank == full), None)
    return (NOT_CONFINED, down, None) if up is None else (CONFINED, down, up)


def _followed(
    forms: Any,
    point: Sequence[int],
    tangents: list[list[int]],
    field: PrimeField,
    rng: random.Random,
    steps: int,
    end: float,
) -> list[Step]:
    direction = [rng.randrange(field.prime) for _ in point]
    precision = 8
    while True:
        try:
            return follow(forms, point, direction, tangents, field.prime, steps, precision)
        except PrecisionTooLow:
            precision *= 2
            if precision > _MAX_PRECISION or time.monotonic() > end:
                raise


def _point_on(factor: Any, field: PrimeField, rng: random.Random) -> tuple[list[int], list[list[int]]] | None:
    """A random point of the hypersurface modulo p and a basis of its tangent space in projective space, or None."""
    p = field.prime
    terms = [(tuple(int(e) for e in m), int(field.convert(c))) for m, c in factor.terms()]
    size = factor.context().nvars()
    a, b = ([rng.randrange(p) for _ in range(size)] for _ in range(2))
    line = nmod_poly([], p)
    for exponents, coefficient in terms:
        term = nmod_poly([coefficient], p)
        for x, v, exponent in zip(a, b, exponents, strict=True):
            term = term * nmod_poly([x, v], p) ** exponent
        line = line + term
    if line.degree() < 1:
        return None
    roots = [-int(found[0]) for found, _ in line.factor()[1] if found.degree() == 1]
    if not roots:
        return None
    point = [(x + roots[0] * v) % p for x, v in zip(a, b, strict=True)]
    gradient = []
    for k in range(size):
        total = 0
        for exponents, coefficient in terms:
            value = coefficient * exponents[k]
            for j, exponent in enumerate(exponents):
                value = value * pow(point[j], max(0, exponent - (j == k)), p) % p
            total += value
        gradient.append(total % p)
    tangents = _tangents(point, gradient, field) if any(gradient) else None
    return None if tangents is None else (point, tangents)


def _tangents(point: Sequence[int], gradient: Sequence[int], field: PrimeField) -> list[list[int]] | None:
    """A basis of the tangent space of a hypersurface at a point, modulo the point itself; None in special position."""
    size = len(point)
    basis = [[int(entry) for entry in vector] for vector in nullspace(field, field.matrix(1, size, list(gradient)))]
    # The point itself is tangent to the cone: a basis vector that occurs in it makes room for it. Basis vectors belong
    # to the columns without the pivot, which is the first that is not zero.
    pivot = next(k for k in range(size) if gradient[k])
    free = [k for k in range(size) if k != pivot]
    occurs = next((index for index, k in enumerate(free) if point[k]), None)
    return None if occurs is None else basis[:occurs] + basis[occurs + 1 :]
