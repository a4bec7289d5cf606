"""Points over number fields, from points modulo primes.

A point with coordinates in a number field has residues modulo the primes that have a factor of degree 1 there: for most
fields more than half of the primes. Chinese remainders put one for each of several primes together, which one of the
conjugates does not matter. Small integer relations between products of the coordinates, short vectors of a lattice, are
equations: of the first coordinate over Q, and of each further one over the field of those before it.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence

from flint import fmpq_mpoly, fmpz_mat

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.polynomials import primitive_part, ring
from kahanmaps.algebra.residues import chinese
from kahanmaps.laboratory.scan.members import solutions

MAX_FIELD_DEGREE = 6
SPARE_BITS = 12  # by which the relations of a point must beat what chance would give
_TRIES = 200
_MOST_POINTS = 24  # modulo a prime
_MOST_PRIMES = 14  # that are put together
_AT_LEAST = 3


def lifted_conjugates(
    found: Mapping[int, Sequence[Sequence[int]]],
    names: Sequence[str],
    rng: random.Random,
    check: Callable[[], None] = lambda: None,
) -> list[tuple[tuple[fmpq_mpoly, ...], tuple[int, ...]]]:
    """Equations of points and their conjugates, one for each parameter, and the primes modulo which all are there.

    They have to be there modulo all primes but one modulo which the equations have solutions.

    >>> roots = {p: [(x, x * x % p) for x in range(p) if (x**3 - 2) % p == 0] for p in (53, 59, 67, 71, 83, 89, 97)}
    >>> [(equations, _)] = lifted_conjugates(roots, ["a", "b"], random.Random(0))
    >>> equations
    (a^3 - 2, a^2 - b)
    """
    every = {p: {tuple(x) for x in points} for p, points in found.items()}
    rest = {p: set(points) for p, points in every.items() if len(points) <= _MOST_POINTS}
    known = []
    tries = _TRIES
    while tries and sum(map(bool, rest.values())) >= _AT_LEAST:
        check()
        tries -= 1
        primes = [p for p in rest if rest[p]]
        equations = _guess(rng.sample(primes, min(len(primes), _MOST_PRIMES)), rest, names, rng)
        if equations is None:
            continue
        there = {p: _residues(equations, p) for p in every}
        at = tuple(p for p in sorted(there) if there[p] and there[p] <= every[p])
        if len(at) >= _AT_LEAST and sum(map(bool, there.values())) <= len(at) + 1:
            known.append((equations, at))
            rest = {p: points - there[p] for p, points in rest.items()}
            tries = _TRIES
    return known


def _guess(
    primes: Sequence[int], points: Mapping[int, set[tuple[int, ...]]], names: Sequence[str], rng: random.Random
) -> tuple[fmpq_mpoly, ...] | None:
    """The equations of a point with one of the points modulo each of the first few primes, if they stand out."""
    values: Sequence[int] = [0] * len(names)
    modulus = 1
    for p in primes:
        values, modulus = chinese(values, modulus, rng.choice(sorted(points[p])), p), modulus * p
        equations = _equations(values, modulus, names)
        if equations is not None:
            # of two points that are not conjugate the first coordinates have a product of polynomials
            return equations if len(equations[0].factor()[1]) == 1 else None
    return None


def _equations(values: Sequence[int], modulus: int, names: Sequence[str]) -> tuple[fmpq_mpoly, ...] | None:
    """A relation for each coordinate, of the smallest degree in it; None where there are no small ones."""
    context = ring(names)
    basis = [(context.constant(1), 1)]  # of the field of the coordinates so far: products and their residues
    found = []
    for x, value in zip(context.gens(), values, strict=True):
        lower, (power, residue) = list(basis), (x, value)
        while (relation := _relation([r for _, r in lower] + [residue], modulus, SPARE_BITS // len(names))) is None:
            lower += [(a * power, r * residue % modulus) for a, r in basis]
            power, residue = power * x, residue * value % modulus
            if len(lower) > MAX_FIELD_DEGREE:
                return None
        products = [*(a for a, _ in lower), power]
        found.append(primitive_part(sum((c * a for c, a in zip(relation, products, strict=True)), 0 * x))[1])
        basis = lower
    return tuple(found)


def _relation(residues: Sequence[int], modulus: int, spare: int) -> list[int] | None:
    """Small integers with sum c_i r_i = 0 modulo `modulus`, the last one not 0; the first residue is 1."""
    size = len(residues)
    rows = [[modulus, *[0] * (size - 1)]]
    rows += [[-r, *(int(i == k) for i in range(1, size))] for k, r in enumerate(residues[1:], 1)]
    shortest = min(fmpz_mat(rows).lll().tolist(), key=lambda row: max(map(abs, row)))
    height = max(abs(int(c)) for c in shortest)
    small = (2 * height + 1) ** size << spare <= modulus
    return [int(c) for c in shortest] if small and shortest[-1] else None


def _residues(equations: Sequence[fmpq_mpoly], p: int) -> set[tuple[int, ...]]:
    """The solutions modulo a prime; none where it divides a leading coefficient."""
    count = len(equations)
    for k, one in enumerate(equations):
        highest = tuple(int(one.degrees()[k]) * (i == k) for i in range(count))
        if int(one[highest].p) % p == 0:
            return set()
    return {tuple(map(int, x)) for x in solutions(equations, range(count), [0] * count, GF(p))}
