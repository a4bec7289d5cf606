"""Quotients of polynomials with given monomials from values modulo a prime: the linear systems of interpolation.py.

A value v = N(s)/D(s) at a point s is an equation N(s) - v D(s) = 0 for the coefficients of N and D, and as many of them
as are needed leave one solution up to a factor, as long as the monomials allow no common factor of N and D.
"""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from flint import nmod_mat

from kahanmaps.errors import InputError

Point = tuple[int, ...]
Exponents = tuple[int, ...]
BlackBox = Callable[[int, Point], Sequence[int] | None]

NOTHING: Mapping[int, int] = MappingProxyType({})
_BAD_POINTS = 20  # in a row, before the prime is blamed
_DETERMINING = 4  # entries that determine their common denominator together: more would only make matrices larger


class Stop(Exception):
    """No answer, and another prime would not help."""


class Unlucky(Exception):
    """This prime, or these points, lead nowhere; another prime may."""


@dataclass
class Budget:
    """What may still be spent, and how long the vectors of values are."""

    max_samples: int
    deadline: float | None
    spent: int = 0
    length: int | None = None

    def check(self, wanted: int = 0) -> None:
        if self.spent + wanted > self.max_samples:
            raise Stop(f"{self.spent} values were taken and {wanted} more are needed, the limit is {self.max_samples}")
        if self.deadline is not None and time.monotonic() > self.deadline:
            raise Stop(f"the time is over, after {self.spent} values")


class Values:
    """The values modulo one prime so far, and the monomials at their points."""

    def __init__(self, black_box: BlackBox, prime: int, budget: Budget) -> None:
        self.prime = prime
        self.budget = budget
        self.points: list[Point] = []
        self.values: list[tuple[int, ...]] = []
        self._black_box = black_box
        self._powers: list[dict[Exponents, int]] = []

    def take(self, draw: Callable[[], Point]) -> None:
        """One more value, at the first drawn point that has one."""
        for _ in range(_BAD_POINTS):
            self.budget.check(1)
            point = draw()
            self.budget.spent += 1
            found = self._black_box(self.prime, point)
            if found is not None:
                values = tuple(int(value) % self.prime for value in found)
                if self.budget.length is None:
                    self.budget.length = len(values)
                if len(values) != self.budget.length:
                    lengths = f"{self.budget.length} and {len(values)}"
                    raise InputError(f"found values of lengths {lengths}, expected equally many at all points")
                self.points.append(point)
                self.values.append(values)
                self._powers.append({})
                return
            if not point:
                break
        raise Unlucky(f"no value modulo {self.prime} at {_BAD_POINTS} points in a row")

    def anywhere(self, symbols: int, rng: random.Random, fixed: Mapping[int, int] = NOTHING) -> Callable[[], Point]:
        """What draws random points, some of their coordinates given."""
        return lambda: tuple(fixed[i] if i in fixed else rng.randrange(1, self.prime) for i in range(symbols))

    def monomials(self, k: int, exponents: Sequence[Exponents]) -> list[int]:
        """The values of the monomials at point k."""
        known, point, p = self._powers[k], self.points[k], self.prime
        row = []
        for monomial in exponents:
            value = known.get(monomial)
            if value is None:
                value = 1
                for base, exponent in zip(point, monomial, strict=True):
                    if exponent:
                        value = value * pow(base, exponent, p) % p
                known[monomial] = value
            row.append(value)
        return row


@dataclass(frozen=True)
class Shape:
    """The monomials of a numerator and of a denominator; `lead` of the latter has the coefficient 1."""

    above: tuple[Exponents, ...]
    below: tuple[Exponents, ...]

    @property
    def lead(self) -> Exponents:
        return max(self.below)

    @property
    def unknowns(self) -> int:
        return len(self.above) + len(self.below)


@dataclass(frozen=True)
class Quotient:
    """A fraction of two polynomials modulo a prime: coefficients in the order of the shape's monomials."""

    shape: Shape
    above: tuple[int, ...]
    below: tuple[int, ...]

    def numerator_up_to_factor(self, prime: int) -> tuple[int, ...]:
        """The coefficients of the numerator, the first made 1."""
        factor = pow(self.above[0], -1, prime) if self.above else 1
        return tuple(c * factor % prime for c in self.above)

    @classmethod
    def of(cls, shape: Shape, above: Sequence[int], below: Sequence[int], prime: int) -> Quotient | None:
        """The fraction normalised and without its zero terms; None where no denominator is left."""
        kept_above = {monomial: c for monomial, c in zip(shape.above, above, strict=True) if c}
        kept_below = {monomial: c for monomial, c in zip(shape.below, below, strict=True) if c}
        if not kept_below:
            return None
        kept = Shape(tuple(kept_above), tuple(kept_below))
        factor = pow(kept_below[kept.lead], -1, prime)
        return cls(
            kept,
            tuple(c * factor % prime for c in kept_above.values()),
            tuple(c * factor % prime for c in kept_below.values()),
        )


def split_group(group: list[int], numerators: Sequence[str], shapes: dict[int, Shape]) -> tuple[list[int], list[int]]:
    """Entries with one denominator, as (those that determine it, the others); equal numerators would not help."""
    if len(shapes[group[0]].below) == 1:
        return group[:1], group[1:]
    different = dict(reversed(list(zip(numerators, group, strict=True))))
    determining = sorted(different.values())[:_DETERMINING]
    return determining, [i for i in group if i not in determining]


def fit(
    values: Values,
    shapes: dict[int, Shape],
    pairs: list[tuple[list[int], list[int]]],
    symbols: int,
    rng: random.Random,
    fixed: Mapping[int, int] = NOTHING,
) -> dict[int, Quotient]:
    """The fractions of these shapes through all values but the last, which must agree; takes as many as it needs.

    Some coordinates may be fixed: then the points are those where they have these values.
    """
    done: dict[int, Quotient] = {}
    draw = values.anywhere(symbols, rng, fixed)
    values.take(draw)
    while True:
        usable = [k for k, point in enumerate(values.points) if all(point[i] == v for i, v in fixed.items())]
        wanted = 0
        for determining, others in pairs:
            if determining[0] not in done:
                wanted = max(wanted, _solve(values, usable, shapes, determining, None, done))
            if determining[0] in done:
                below = done[determining[0]]
                for i in others:
                    if i not in done:
                        wanted = max(wanted, _solve(values, usable, shapes, [i], below, done))
        if wanted == 0:
            return done
        values.budget.check(wanted)
        for _ in range(wanted):
            values.take(draw)


def _solve(
    values: Values,
    usable: list[int],
    shapes: dict[int, Shape],
    members: list[int],
    known: Quotient | None,
    done: dict[int, Quotient],
) -> int:
    """Enter the fractions of members with one denominator (perhaps `known`) into `done`, or tell how many values lack.

    Raises Unlucky where there are none.
    """
    p = values.prime
    values.budget.check()
    below = shapes[members[0]].below if known is None else known.shape.below
    widths = [len(shapes[i].above) for i in members]
    # A point more than is solved with is held out; without symbols all points are the same.
    last = usable[-1]
    rows: list[int] = []
    height = 0
    for k in usable[:-1] if values.points[0] else usable[:1]:
        lower = values.monomials(k, below)
        if known is not None:
            lower = [sum(c * m for c, m in zip(known.below, lower, strict=True)) % p]
        offset = 0
        for i, width in zip(members, widths, strict=True):
            v = p - values.values[k][i]
            rows += [0] * offset + values.monomials(k, shapes[i].above) + [0] * (sum(widths) - offset - width)
            rows += [v * m % p for m in lower]
            offset += width
            height += 1
    width = sum(widths) + (len(below) if known is None else 1)
    if height == 0:
        return max(1, -(-(width - 1) // len(members)))
    kernel, nullity = nmod_mat(height, width, rows, p).nullspace()
    if nullity > 1:
        return int(-(-(nullity - 1) // len(members)))
    if nullity == 0:
        raise Unlucky(f"the values modulo {p} do not fit the monomials found")
    solution = [int(kernel[i, 0]) for i in range(width)]
    lower = solution[sum(widths) :] if known is None else [solution[-1] * c % p for c in known.below]
    offset = 0
    for i, size in zip(members, widths, strict=True):
        quotient = Quotient.of(replace(shapes[i], below=below), solution[offset : offset + size], lower, p)
        offset += size
        if quotient is None or not _agrees(values, last, i, quotient):
            raise Unlucky(f"a value modulo {p} that was held out does not agree")
        done[i] = quotient
    return 0


def _agrees(values: Values, k: int, i: int, quotient: Quotient) -> bool:
    p = values.prime
    above, below = (
        sum(c * m for c, m in zip(coefficients, values.monomials(k, monomials), strict=True)) % p
        for coefficients, monomials in ((quotient.above, quotient.shape.above), (quotient.below, quotient.shape.below))
    )
    return below != 0 and (above - values.values[k][i] * below) % p == 0
