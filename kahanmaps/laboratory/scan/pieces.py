"""What a set of points of GF(p)^k is made of: hypersurfaces, affine subspaces, single points.

The points with one degree sequence are the points of some varieties without those of smaller ones, and may hold points
by chance besides. So pieces are found from few random points, and count where they hold about as many points as a
variety of their dimension has, p^d.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from kahanmaps.laboratory.modular_points import Point, echelon, exponents_up_to, monomial_values, null_space

Rows = tuple[tuple[int, ...], ...]

MAX_DEGREE = 6
_SHARE = 0.5  # of the points of a piece that must be there: special ones are missing
_SPARE = 1.5  # points for each coefficient of a hypersurface
_TRIES = 80
_MOST_POINTS = 400  # that are taken for single ones


@dataclass
class Pieces:
    """The pieces of a set of points modulo `prime`.

    `flats` has affine subspaces by dimension: reduced rows (c_1, ..., c_k, c_0) of equations c_1 a_1 + ... + c_0 = 0.
    `forms` are hypersurfaces of degree 2 and more, coefficients of the monomials of `exponents_up_to` in their order.
    `left` points are in none of them.
    """

    prime: int
    flats: dict[int, list[Rows]] = field(default_factory=dict)
    forms: list[tuple[int, ...]] = field(default_factory=list)
    left: int = 0


def pieces(points: Sequence[Point], prime: int, seen: int, complete: bool, rng: random.Random) -> Pieces:
    """The pieces of a set of points, of `seen` that were tried; single points where all of GF(p)^k was tried.

    >>> line = [(a, (2 * a + 3) % 31) for a in range(31)]
    >>> found = pieces([*line, (5, 5)], 31, 31**2, True, random.Random(0))
    >>> found.flats
    {1: [((1, 15, 17),)], 0: [((1, 0, 26), (0, 1, 26))]}
    """
    import numpy as np

    count = len(points[0])
    found = Pieces(prime)
    rest = np.array(points, dtype=np.int64)

    def take(flats_or_forms: list[Any], what: Any, inside: Any) -> None:
        nonlocal rest
        flats_or_forms.append(what)
        rest = rest[~inside]

    def flats(dimension: int, needed: float) -> None:
        for _ in _tries(lambda: len(rest) >= needed):
            sample = [rest[i].tolist() for i in rng.sample(range(len(rest)), dimension + 1)]
            rows = null_space([[*point, 1] for point in sample], count + 1, prime)
            if len(rows) == count - dimension:
                values = np.column_stack([rest, np.ones(len(rest), dtype=np.int64)]) @ np.array(rows).T % prime
                inside = ~values.any(axis=1)
                if inside.sum() >= needed:
                    take(found.flats.setdefault(dimension, []), tuple(map(tuple, rows)), inside)

    def hypersurfaces(degree: int, needed: float) -> None:
        size = len(exponents_up_to(count, degree))
        for attempt in _tries(lambda: len(rest) >= max(needed, _SPARE * size)):
            table = np.array([monomial_values(tuple(x), degree, prime) for x in rest.tolist()])
            chosen = range(len(rest)) if attempt == 0 else rng.sample(range(len(rest)), size - 1)
            basis = null_space([table[i].tolist() for i in chosen], size, prime)
            if len(basis) == 1:
                inside = table @ np.array(basis[0]) % prime == 0
                if inside.sum() >= max(needed, _SPARE * size):
                    take(found.forms, tuple(basis[0]), inside)

    most = seen / prime  # points of a hypersurface
    if count > 1:
        flats(count - 1, max(_SHARE * most, count + 2))
        for degree in range(2, MAX_DEGREE + 1):
            hypersurfaces(degree, _SHARE * most)
    if complete:
        for dimension in range(count - 2, 0, -1):
            flats(dimension, max(_SHARE * prime**dimension, dimension + 3))
        if len(rest) <= _MOST_POINTS:
            single = [tuple(map(tuple, echelon(_equations(x), prime))) for x in rest.tolist()]
            found.flats.setdefault(0, []).extend(single)
            rest = rest[:0]
    found.left = len(rest)
    return found


def _tries(go_on: Any) -> Iterator[int]:
    """Numbers of attempts, as long as there is something to try them on."""
    for attempt in range(_TRIES):
        if not go_on():
            return
        yield attempt


def _equations(x: Sequence[int]) -> list[list[int]]:
    """The point as the solution of equations."""
    return [[*(int(i == j) for j in range(len(x))), -value] for i, value in enumerate(x)]
