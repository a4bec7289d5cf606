"""Degree sequences of the members of a family modulo a small prime, and the members whose degrees are smaller.

The degrees of any member are at most those of a generic one. So the largest degrees at each step are the generic
sequence, and a member with another sequence is *special*. A generic member on a line in special position looks special,
too: so special members are measured on further lines until none of them turns out to be generic.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

from flint import fmpq

from kahanmaps.algebra.work import count as count_work
from kahanmaps.errors import InputError
from kahanmaps.maps.implicit import MapFamily

Point = tuple[int, ...]
Degrees = tuple[int, ...]
Choice = tuple[int, int | None, int]  # of members: a prime, how many random subspaces of a dimension, None for all

_SLICE = 512
_LINES = (3, 12)  # on which a special member is measured: at least, at most


class TimeOver(Exception):
    """The budget for what is being done is spent, or it was interrupted."""


@dataclass(frozen=True)
class Sweep:
    """The special members modulo one prime: `classes` has their points by degrees, `seen` members were tried.

    `generic` are the degrees of the others. Where not `complete`, the members were on random affine subspaces of this
    `width`: on lines of parameter space, or on planes.
    """

    prime: int
    generic: Degrees
    classes: dict[Degrees, list[Point]]
    seen: int
    complete: bool
    accidents: int
    width: int = 1

    @property
    def on_lines(self) -> bool:
        """Whether the members were on random lines, which hardly meet anything but hypersurfaces."""
        return not self.complete and self.width == 1

    @property
    def special(self) -> dict[Point, Degrees]:
        """The degrees of each special member."""
        return {point: degrees for degrees, points in self.classes.items() for point in points}


def members_of(prime: int, count: int, on: tuple[int, int] | None, rng: random.Random) -> Iterator[Point]:
    """All points of GF(p)^count, or those on so many random affine subspaces of a dimension."""
    if on is None:
        yield from product(range(prime), repeat=count)
        return
    subspaces, width = on
    for _ in range(subspaces):
        base, *ways = ([rng.randrange(prime) for _ in range(count)] for _ in range(1 + width))
        for slopes in product(range(prime), repeat=width):
            yield tuple(
                (b + sum(s * w for s, w in zip(slopes, way, strict=True))) % prime
                for b, *way in zip(base, *ways, strict=True)
            )


def sweep(
    map_: MapFamily,
    count: int,
    prime: int,
    eps: fmpq | None,
    terms: int,
    room: int,
    *,
    on: tuple[int, int] | None = None,
    units: float = 0,
    seed: str = "",
    jobs: int = 1,
    check: Callable[[], None] = lambda: None,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> Sweep:
    """The special members of a family modulo a prime below 2^13, by the degrees d_1, ..., d_terms.

    The `count` parameters that vary are the symbols of the map, and perhaps eps as the last one, which is never 0;
    otherwise `eps` is an exact number, or None for generic eps, in GF(p^2). `room` and `jobs` are as for
    `Family.degrees`. Tried are all members, or those `on` so many random affine subspaces of parameter space, of a
    dimension; one counts as `units` of work. `check` is called now and then, and may raise TimeOver; `progress` is told
    how many members are done, of how many. Raises InputError where the map exists nowhere, or degrees need more room.
    """
    import numpy as np

    from kahanmaps.maps.residues.families import TOO_LARGE, Family

    family, rng = Family(map_, prime), random.Random(seed)

    def measure(points: Sequence[Point], told: Callable[[int, int], None] = lambda done, of: None) -> Any:
        parts = []
        for low in range(0, len(points), _SLICE):
            check()
            some = np.array(points[low : low + _SLICE], dtype=np.int64)
            parts.append(family.degrees(some, eps, terms, room, rng, jobs=jobs))
            count_work(units * len(some))
            told(low + len(some), len(points))
        return np.concatenate(parts)

    points = list(members_of(prime, count, on, rng))
    if count > len(map_.symbols):
        points = [point for point in points if point[-1]]
    found = measure(points, progress)
    if (found == TOO_LARGE).any():
        raise InputError(f"the degrees of {terms} iterates are too large to be scanned, expected fewer terms")
    generic = found.max(axis=0)
    if generic[0] < 0:
        raise InputError("the map is defined nowhere, whatever the parameters are")
    special, accidents = np.flatnonzero((found != generic).any(axis=1)), 0
    for line in range(1, _LINES[1]):
        if not len(special):
            break
        before, found[special] = found[special], np.maximum(found[special], measure([points[i] for i in special]))
        kept = special[(found[special] != generic).any(axis=1)]
        accidents += len(special) - len(kept)
        if line >= _LINES[0] and (before == found[special]).all():
            break
        special = kept
    classes: dict[Degrees, list[Point]] = {}
    for i in special:
        classes.setdefault(tuple(int(d) for d in found[i]), []).append(points[i])
    return Sweep(
        prime, tuple(int(d) for d in generic), classes, len(points), on is None, accidents, 1 if on is None else on[1]
    )
