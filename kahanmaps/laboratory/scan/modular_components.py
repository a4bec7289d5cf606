"""The components of a set of points of GF(p)^k: affine subspaces, hypersurfaces of these, single points.

The points with one degree sequence are the points of some varieties without those of smaller ones, and may hold points
by chance. So components are found from few random points, and count where they hold about as many points as a
variety of their dimension has, p^d.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from flint import Ordering, nmod_mpoly_ctx

from kahanmaps.algebra.modular_matrices import echelon, null_space, pivots
from kahanmaps.algebra.work import count as count_work
from kahanmaps.laboratory.modular_points import Point, exponents_up_to, monomial_tables

Rows = tuple[tuple[int, ...], ...]

Form = tuple[int, ...]

MAX_DEGREE = 6  # of hypersurfaces with the same degrees, all together
_SHARE = 0.5  # of the points of a component that must be there: special ones are missing
_SPARE = 1.2  # points for each coefficient of a hypersurface
_TRIES, _MANY = 80, 3000  # samples; of more than 3 parameters, where all points of a sample have to be on one component
_FEW = 12  # of those for hypersurfaces of degree 3 and more, of which one with points on two is the more useless
_MOST_DEGREE = 12  # of a product
_MOST_POINTS = 400  # that are taken for single ones


@dataclass
class ModularComponents:
    """The components of a set of points modulo `prime`.

    `linear` has affine subspaces by dimension: reduced rows (c_1, ..., c_k, c_0) of equations c_1 a_1 + ... + c_0 = 0.
    `hypersurfaces` has irreducible hypersurfaces by the affine subspace they are in (no rows: the whole space). Each
    is the coefficients of the monomials of `exponents_up_to`, in their order, in the variables that are free there.
    """

    prime: int
    linear: dict[int, list[Rows]] = field(default_factory=dict)
    hypersurfaces: dict[Rows, list[Form]] = field(default_factory=dict)


def find_components(
    points: Sequence[Point],
    prime: int,
    seen: int,
    smallest: int,
    rng: random.Random,
    check: Callable[[], None] = lambda: None,
) -> ModularComponents:
    """The components of a set of points, of `seen` that were tried, from the dimension `smallest` on.

    That is 0 where all of GF(p)^k was tried, and k - 1 for points on random lines. `check` is called now and then, and
    may raise.

    >>> line = [(a, (2 * a + 3) % 31) for a in range(31)]
    >>> components = find_components([*line, (5, 5)], 31, 31**2, 0, random.Random(0))
    >>> components.linear
    {1: [((1, 15, 17),)], 0: [((1, 0, 26), (0, 1, 26))]}
    """
    import numpy as np

    count = len(points[0])
    components = ModularComponents(prime)
    unassigned = np.array(points, dtype=np.int64)

    def affine_subspaces(dimension: int, needed: float) -> Iterator[tuple[Rows, Any]]:
        """Affine subspaces with so many of the points, and which of these are in them."""
        for _ in range(_TRIES if count <= 3 else _MANY):
            check()
            if len(unassigned) < needed:
                return
            count_work(10 + len(unassigned) * (count - dimension) / 100)
            sample = [[*unassigned[i].tolist(), 1] for i in rng.sample(range(len(unassigned)), dimension + 1)]
            rows = null_space(sample, count + 1, prime)
            if len(rows) == count - dimension:
                ones = np.ones((len(unassigned), 1), dtype=np.int64)
                inside = ~(np.hstack([unassigned, ones]) @ np.array(rows).T % prime).any(axis=1)
                if inside.sum() >= needed:
                    yield tuple(map(tuple, rows)), inside

    for dimension in range(count - 1, max(smallest, 1) - 1, -1):
        # Of the dimension that is looked for: affine ones, then others in affine ones of one dimension more.
        needed = max(_SHARE * seen / prime ** (count - dimension), dimension + 3)
        for rows, inside in affine_subspaces(dimension, needed):
            components.linear.setdefault(dimension, []).append(rows)
            unassigned = unassigned[~inside]
        if dimension == count - 1:
            for form, inside in _hypersurfaces(unassigned, needed, prime, rng, check):
                components.hypersurfaces.setdefault((), []).append(form)
                unassigned = unassigned[~inside]
            continue
        for rows, inside in affine_subspaces(dimension + 1, needed):
            free = [k for k in range(count) if k not in pivots(rows)]
            places, kept = np.flatnonzero(inside), np.ones(len(unassigned), dtype=bool)
            for form, some in _hypersurfaces(unassigned[inside][:, free], needed, prime, rng, check):
                components.hypersurfaces.setdefault(rows, []).append(form)
                kept[places[some]] = False
                places = places[~some]
            unassigned = unassigned[kept]
    if not smallest and len(unassigned) <= _MOST_POINTS:
        equations = ([[*(int(i == j) for j in range(count)), -y] for i, y in enumerate(x)] for x in unassigned.tolist())
        single = [tuple(map(tuple, echelon(rows, prime))) for rows in equations]
        components.linear.setdefault(0, []).extend(single)
    return components


def _hypersurfaces(
    here: Any, needed: float, prime: int, rng: random.Random, check: Callable[[], None]
) -> Iterator[tuple[Form, Any]]:
    """Irreducible hypersurfaces with so many of the points `here`, and which of these are in them.

    What a few more points than coefficients are on is the product of all, what fewer are on perhaps one of them.
    """
    for degree in range(2, _MOST_DEGREE + 1):
        size = len(exponents_up_to(here.shape[1], degree))
        enough = int(_SPARE * size) + 2
        table = _monomials(here, degree, prime)
        for attempt in range(_TRIES if degree == 2 else _FEW if degree <= MAX_DEGREE else 1):
            check()
            if len(here) < max(enough, needed):
                break
            count_work(size * len(here) / 500)
            chosen = rng.sample(range(len(here)), size - 1 if attempt else enough)
            basis = null_space(table[chosen].tolist(), size, prime)
            if len(basis) > 1 or not basis or (table @ basis[0] % prime == 0).sum() < max(enough, needed):
                continue
            for factor, power in _factors(basis[0], degree, here.shape[1], prime):
                inside = _monomials(here, power, prime) @ factor % prime == 0
                if inside.sum() >= needed:
                    yield factor, inside
                    here, table = here[~inside], table[~inside]


def degree_reached(points: float, count: int) -> int:
    """Up to which degree, at most `MAX_DEGREE`, so many points are enough for a hypersurface.

    >>> degree_reached(53, 2), degree_reached(11, 2)
    (6, 2)
    """
    sizes = (len(exponents_up_to(count, degree)) for degree in range(1, MAX_DEGREE + 1))
    return sum(_SPARE * size + 2 <= points for size in sizes)


def _monomials(points: Any, degree: int, prime: int) -> Any:
    """The values of all monomials up to a degree at points, one a row."""
    import numpy as np

    slopes = monomial_tables(points.shape[1], degree)
    count_work(len(slopes) * (5 + len(points) / 100))
    table = np.ones((len(points), len(slopes)), dtype=np.int64)
    for k, some in enumerate(slopes[1:], 1):
        variable, _, place = some[-1]
        table[:, k] = table[:, place] * points[:, variable] % prime
    return table


def _factors(form: Sequence[int], degree: int, count: int, prime: int) -> list[tuple[Form, int]]:
    """The irreducible factors of a polynomial and their degrees; of coefficients the first is 1 that is not 0."""
    context = nmod_mpoly_ctx.get([f"a{k}" for k in range(count)], modulus=prime, ordering=Ordering.degrevlex)
    terms = {e: c for e, c in zip(exponents_up_to(count, degree), form, strict=True) if c}
    factors = []
    count_work(50 + 5 * len(terms))
    for factor, _ in context.from_dict(terms).factor()[1]:
        values = {tuple(map(int, e)): int(c) for e, c in factor.to_dict().items()}
        power = max(map(sum, values))
        row = [values.get(e, 0) for e in exponents_up_to(count, power)]
        scale = pow(next(c for c in row if c), -1, prime)
        factors.append((tuple(c * scale % prime for c in row), power))
    return factors
