"""Changes of parameters that permute the slow members of a family: exchanges, cycles, signs, and these with a shift."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import permutations, product
from typing import Any

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.polynomials import primitive_part, ring
from kahanmaps.laboratory.scan.lift import residues
from kahanmaps.laboratory.scan.result import Component
from kahanmaps.laboratory.scan.sweep import Degrees, Point, Sweep

Change = tuple[tuple[int, int, fmpq], ...]  # a_k becomes sign * a_place + shift: place, sign and shift for each k

_MOST_SHIFTS = 24


def symmetries(
    sweeps: Sequence[Sweep], components: Sequence[Component], names: Sequence[str]
) -> list[tuple[fmpq_mpoly, ...]]:
    """Changes of parameters that generate all which were found; the images of the parameters.

    Each keeps the degrees of slow members modulo each prime modulo which all were tried, and the hypersurfaces over Q.
    Named are those that move a component, or keep one that is not affine.

    >>> a, b = ring(["a", "b"]).gens()
    >>> lines = [Component((line,), 1, (1,), ()) for line in (a - 3 * b, a + 3 * b, 3 * a - b, 3 * a + b)]
    >>> points = [(x, y) for x in range(7) for y in range(7) if (x * x - 9 * y * y) * (y * y - 9 * x * x) % 7 == 0]
    >>> symmetries([Sweep(7, (2,), {(1,): points}, 49, True, 0)], lines, ["a", "b"])
    [(b, a), (a, -b)]
    """
    complete = [(one.prime, one.slow) for one in sweeps if one.complete]
    if not complete or not components:
        return []
    found: list[Change] = []
    known = {_identity(len(names))}
    for change in _changes(len(names), components):
        if change in known or not all(_permutes(change, p, slow) for p, slow in complete):
            continue
        if _matters(change, components, names):
            found.append(change)
            known = _generated(found, len(names))
    return [_images(change, names) for change in found]


def _changes(count: int, components: Sequence[Component]) -> Iterator[Change]:
    """Those that are tried, plain ones first; shifts are those that move one rational point to another."""
    plain = [
        tuple((place, sign, fmpq(0)) for place, sign in zip(places, signs, strict=True))
        for signs in sorted(product((1, -1), repeat=count), key=lambda signs: signs.count(-1))
        for places in permutations(range(count))
    ]
    yield from plain
    points = [[*(one.values or {}).values()] for one in components if one.is_rational_point]
    for change in plain if points else ():
        start = _applied(change, points[0])
        for point in points[:_MOST_SHIFTS]:
            shifts = [y - x for x, y in zip(start, point, strict=True)]
            if any(shifts):
                yield tuple((place, sign, s) for (place, sign, _), s in zip(change, shifts, strict=True))


def _identity(count: int) -> Change:
    return tuple((k, 1, fmpq(0)) for k in range(count))


def _applied(change: Change, values: Sequence[Any]) -> list[Any]:
    return [sign * values[place] + shift for place, sign, shift in change]


def _images(change: Change, names: Sequence[str]) -> tuple[fmpq_mpoly, ...]:
    return tuple(_applied(change, ring(names).gens()))


def _matters(change: Change, components: Sequence[Component], names: Sequence[str]) -> bool:
    """Whether hypersurfaces go to such with the same degrees, and something is moved or not affine."""
    images = _images(change, names)
    known = {(str(one.equations[0]), one.degrees) for one in components if len(one.equations) == 1}
    matters = False
    for one in components:
        moved = [str(primitive_part(equation.compose(*images))[1]) for equation in one.equations]
        if len(moved) == 1 and (moved[0], one.degrees) not in known:
            return False
        is_affine = all(equation.total_degree() == 1 for equation in one.equations)
        matters = matters or not is_affine or set(moved) != set(map(str, one.equations))
    return matters


def _permutes(change: Change, p: int, slow: Mapping[Point, Degrees]) -> bool:
    """Whether all slow members modulo a prime go to such with the same degrees."""
    shifts = residues([[shift for _, _, shift in change]], p)
    if shifts is None:
        return True
    pairs = [(place, sign, shift) for (place, sign, _), shift in zip(change, shifts[0], strict=True)]
    return all(
        slow.get(tuple((sign * point[place] + shift) % p for place, sign, shift in pairs)) == degrees
        for point, degrees in slow.items()
    )


def _generated(found: Sequence[Change], count: int) -> set[Change]:
    """The group that changes generate; it is finite, for it permutes points."""
    known = new = {_identity(count)}
    while new and len(known) < 2000:
        new = {_composed(one, other) for one in new for other in found} - known
        known = known | new
    return known


def _composed(one: Change, other: Change) -> Change:
    """First `one`, then `other`."""
    return tuple((one[place][0], sign * one[place][1], sign * one[place][2] + shift) for place, sign, shift in other)
