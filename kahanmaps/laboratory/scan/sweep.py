"""The degrees of the iterates of the members of a family modulo a small prime, and the members with smaller degrees.

The degrees of any member are at most those of a generic member. So the largest degree at each step gives the generic
sequence of degrees, and a member with another sequence is *special*. A generic member looks special if its random line
is in special position. So special members are measured on further lines until none of them turns out to be generic.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

from flint import fmpq

from kahanmaps.algebra.work import count_work
from kahanmaps.errors import InputError
from kahanmaps.maps.implicit import MapFamily

Point = tuple[int, ...]
Degrees = tuple[int, ...]
Choice = tuple[int, int | None, int]  # prime, number of random affine subspaces (None: all members), dimension

_BATCH_SIZE = 512  # members measured together
_MIN_LINES, _MAX_LINES = 3, 12  # bounds for the number of lines on which a special member is measured


class TimeOver(Exception):
    """The budget of the current stage is spent, or the scan was interrupted."""


@dataclass(frozen=True)
class Sweep:
    """The special members modulo one prime: `classes` maps degrees d_1, d_2, ... to lists of points.

    `member_count` is the number of measured members, and `generic` are the degrees of the generic ones. If not
    `complete`, only members on random affine subspaces of dimension `subspace_dimension` were measured. `false_alarms`
    is the number of generic members that looked special on their first line.
    """

    prime: int
    generic: Degrees
    classes: dict[Degrees, list[Point]]
    member_count: int
    complete: bool
    false_alarms: int
    subspace_dimension: int = 1

    @property
    def on_lines(self) -> bool:
        """Whether only members on random lines were measured; lines rarely meet components other than hypersurfaces."""
        return not self.complete and self.subspace_dimension == 1

    @property
    def special(self) -> dict[Point, Degrees]:
        """A dict that maps each special member (a point) to its degrees."""
        return {point: degrees for degrees, points in self.classes.items() for point in points}


def members_of(prime: int, count: int, on: tuple[int, int] | None, rng: random.Random) -> Iterator[Point]:
    """Yield all points of GF(p)^count, or, if `on` = (number, dimension), the points of random affine subspaces."""
    if on is None:
        yield from product(range(prime), repeat=count)
        return
    subspace_count, dimension = on
    for _ in range(subspace_count):
        base, *directions = ([rng.randrange(prime) for _ in range(count)] for _ in range(1 + dimension))
        for multipliers in product(range(prime), repeat=dimension):
            yield tuple(
                (b + sum(s * d for s, d in zip(multipliers, direction, strict=True))) % prime
                for b, *direction in zip(base, *directions, strict=True)
            )


def sweep(
    map_: MapFamily,
    count: int,
    prime: int,
    eps: fmpq | None,
    terms: int,
    max_length: int,
    *,
    on: tuple[int, int] | None = None,
    units: float = 0,
    seed: str = "",
    jobs: int = 1,
    check: Callable[[], None] = lambda: None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Sweep:
    """Search for the special members of a family modulo a prime below 2^13, by the degrees of their iterates.

    Args:
        map_: the family; its symbols are the parameters that vary.
        count: the number of parameters that vary. If it is one more than the number of symbols, eps is the last
            parameter, with values other than 0.
        prime: the prime.
        eps: half the time step (exact), or None for generic eps; eps is then a random element of GF(p^2).
        terms: the number of iterates whose degrees are measured.
        max_length: the largest number of coefficients of a polynomial, as in `Family.degrees`.
        on: number and dimension of the random affine subspaces whose members are measured; None for all members.
        units: the units of work that are counted for one member.
        seed: the random seed.
        jobs: the number of threads, as in `Family.degrees`.
        check: called repeatedly; it may raise TimeOver.
        progress: called with the number of measured members and the number of all members.

    Raises:
        InputError: if the map is nowhere defined, or the degrees are too large.
    """
    import numpy as np

    from kahanmaps.maps.residues.families import TOO_LARGE, Family

    family, rng = Family(map_, prime), random.Random(seed)

    def measure(points: Sequence[Point], on_progress: Callable[[int, int], None] = lambda done, total: None) -> Any:
        batches = []
        for start in range(0, len(points), _BATCH_SIZE):
            check()
            batch = np.array(points[start : start + _BATCH_SIZE], dtype=np.int64)
            batches.append(family.degrees(batch, eps, terms, max_length, rng, jobs=jobs))
            count_work(units * len(batch))
            on_progress(start + len(batch), len(points))
        return np.concatenate(batches)

    points = list(members_of(prime, count, on, rng))
    if count > len(map_.symbols):
        points = [point for point in points if point[-1]]
    degrees = measure(points, progress)
    if (degrees == TOO_LARGE).any():
        raise InputError(f"the degrees of {terms} iterates are too large to be scanned, expected fewer terms")
    generic_degrees = degrees.max(axis=0)
    if generic_degrees[0] < 0:
        raise InputError("the map is not defined at any point, for all parameters")
    special_indices, false_alarms = np.flatnonzero((degrees != generic_degrees).any(axis=1)), 0
    for line_count in range(1, _MAX_LINES):
        if not len(special_indices):
            break
        # The degree of an iterate is the maximum over all lines, since a line in special position can only lower it.
        earlier_degrees, new_degrees = degrees[special_indices], measure([points[i] for i in special_indices])
        degrees[special_indices] = np.maximum(earlier_degrees, new_degrees)
        remaining_indices = special_indices[(degrees[special_indices] != generic_degrees).any(axis=1)]
        false_alarms += len(special_indices) - len(remaining_indices)
        if line_count >= _MIN_LINES and (earlier_degrees == degrees[special_indices]).all():
            break
        special_indices = remaining_indices
    classes: dict[Degrees, list[Point]] = {}
    for i in special_indices:
        classes.setdefault(tuple(int(d) for d in degrees[i]), []).append(points[i])
    return Sweep(
        prime,
        tuple(int(d) for d in generic_degrees),
        classes,
        len(points),
        on is None,
        false_alarms,
        1 if on is None else on[1],
    )
