"""Functions of a point and its k-th iterate in the place of polynomials of degree 2, for the searches of integrals.

With X = (1, x) and Y = (1, y), y the k-th iterate of x, the monomial X_i X_j stands for X_i Y_j + X_j Y_i, or for
X_i Y_j - X_j Y_i. The first are polarised quadratic polynomials, the second Wronskians. Along an orbit they satisfy
linear relations as monomials do, and the same null spaces tell which combinations have a common cofactor.

Where all s functions of a space satisfy s - 2 independent relations along every orbit, ratios of functions need not be
integrals, but those of minors (F_a F_b~ - F_b F_a~)/(F_c F_d~ - F_d F_c~) are, ~ a step later: the values of F along
an orbit lie in a plane, and its Pluecker coordinates are these minors. Source: petrera-suris-2018.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

from kahanmaps.algebra.work import count as count_work
from kahanmaps.laboratory.modular_points import ModularMap, NoPoint, Point, Values, exponents_up_to
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import DarbouxSpace, darboux_spaces
from kahanmaps.laboratory.preserve.hirota_kimura import relations_on_orbit, span_of_relations

DEGREE = 2


class Lift(NamedTuple):
    """Which functions: k, the sign, and the dimension of what they span along an orbit, 1 or 2."""

    shift: int
    sign: int
    rank: int = 1

    @property
    def text(self) -> str:
        """How integrals are found among these functions, for people."""
        if self.shift == 0:
            return "relations of degree 2 along orbits on levels of the affine integrals"
        kind = "bilinear relations" if self.sign > 0 else "relations of Wronskians"
        minors = ", 2 x 2 minors" if self.rank == 2 else ""
        return f"{kind} between x and x{'~' * self.shift}{minors}"


LIFTS = (Lift(0, 1), Lift(1, 1), Lift(1, -1), Lift(2, -1), Lift(3, -1), Lift(4, -1))


@cache
def pairs_of(dim: int) -> tuple[tuple[int, int], ...]:
    """The places i <= j in (1, x) of the factors of each monomial of degree at most 2."""
    found = []
    for exponent in exponents_up_to(dim, DEGREE):
        places = [k for k, e in enumerate(exponent, 1) for _ in range(e)]
        i, j = [0] * (DEGREE - len(places)) + places
        found.append((i, j))
    return tuple(found)


class Lifted(ModularMap):
    """A map modulo a prime on whose points monomials of degree at most 2 have the values of a `Lift`."""

    def __init__(self, base: ModularMap, lift: Lift) -> None:
        # The same map; only what a monomial is differs.
        self.prime, self.eps, self.dim, self.values = base.prime, base.eps, base.dim, base.values
        self.rng, self.map, self.lift = base.rng, base.map, lift

    def _values(self, x: Point, y: Point) -> list[int]:
        p, sign, X, Y = self.prime, self.lift.sign, (1, *x), (1, *y)
        count_work(len(pairs_of(self.dim)) / 2)
        # Squares have no Wronskian. Random numbers in their place are in no relation, as zeros would be.
        return [
            self.rng.randrange(p) if sign < 0 and i == j else (X[i] * Y[j] + sign * X[j] * Y[i]) % p
            for i, j in pairs_of(self.dim)
        ]

    def along_orbit(
        self, degree: int, count: int, support: Sequence[int] | None = None
    ) -> tuple[Sequence[Values], Point, int | None]:
        """The values along an orbit, as for other maps."""
        points, shift = self.orbit(count + self.lift.shift), self.lift.shift
        closed = len(points) < count + shift
        ahead = points[shift % len(points) :] + (points[: shift % len(points)] if closed else [])
        rows = [self._values(x, y) for x, y in zip(points, ahead, strict=False)]
        chosen = rows if support is None else [[row[k] for k in support] for row in rows]
        return chosen, points[0], len(points) if closed else None

    def moved(self, x: Point, image: Point, degree: int, by: tuple[int, int] = (1, 1)) -> tuple[Values, Values]:
        """The values at a point, and those a step later; each times its number of `by`."""
        points = [x, image]
        while len(points) < self.lift.shift + 2:
            after = self.step(points[-1])
            if after is None:
                raise NoPoint("iterates of a random point modulo a prime have no value")
            points.append(after)
        here, there = (self._values(points[k], points[k + self.lift.shift]) for k in (0, 1))
        return [by[0] * value for value in here], [by[1] * value for value in there]


def lifted_spaces(map_: ModularMap, lift: Lift) -> list[DarbouxSpace]:
    """The spaces of functions with a common cofactor; of rank 2 the space of all functions that are in relations."""
    lifted = Lifted(map_, lift)
    if lift.rank == 1:
        return darboux_spaces(lifted, DEGREE) or []
    span = span_of_relations(lifted, DEGREE)
    if len(span) - relations_on_orbit(lifted, DEGREE).dimension != lift.rank:
        return []
    return [DarbouxSpace.spanned_by(map_.dim, DEGREE, span, map_.prime)]


def lifts_with_spaces(map_: ModularMap, lifts: Sequence[Lift] = LIFTS) -> list[tuple[Lift, list[DarbouxSpace]]]:
    """The lifts that have spaces, with these: of rank 1 or, where there are none, of rank 2."""
    found = []
    for lift in lifts:
        for one in (lift, lift._replace(rank=2)):
            spaces = lifted_spaces(map_, one)
            if spaces:
                found.append((one, spaces))
                break
    return found
