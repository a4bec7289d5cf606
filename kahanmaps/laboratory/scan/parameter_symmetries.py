"""Changes of parameters that permute the special members of a family: projective ones of a few kinds.

Exchanges, cycles and signs, these with a shift or a factor for each parameter, and permutations of the homogeneous
coordinates (a : b : ... : 1), which families have whose parameters are ratios.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import permutations, product

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.polynomials import primitive_part, ring
from kahanmaps.algebra.printing import format_polynomial
from kahanmaps.algebra.work import count
from kahanmaps.laboratory.scan.lift import residues
from kahanmaps.laboratory.scan.result import Component
from kahanmaps.laboratory.scan.sweep import Degrees, Point, Sweep

Row = tuple[fmpq, ...]
Change = tuple[Row, ...]  # a matrix that acts on (a, b, ..., 1), up to a factor: the first entry in its last row is 1

_MOST_POINTS = 24


def symmetries(sweeps: Sequence[Sweep], components: Sequence[Component], names: Sequence[str]) -> list[tuple[str, ...]]:
    """Generators of the changes of parameters that were found, as images of the parameters.

    Each preserves the degrees of the special members modulo each prime for which all members were tried, and the
    hypersurfaces over Q, except for what is mapped to infinity. Only changes that move a component, or
    preserve one that is not affine, are reported.

    >>> a, b = ring(["a", "b"]).gens()
    >>> lines = [Component((line,), 1, (1,), ()) for line in (a - 3 * b, a + 3 * b, 3 * a - b, 3 * a + b)]
    >>> points = [(x, y) for x in range(7) for y in range(7) if (x * x - 9 * y * y) * (y * y - 9 * x * x) % 7 == 0]
    >>> symmetries([Sweep(7, (2,), {(1,): points}, 49, True, 0)], lines, ["a", "b"])
    [('b', 'a'), ('a', '-b')]
    """
    complete = [(one.prime, one.special) for one in sweeps if one.complete]
    if not complete or not components:
        return []
    found: list[Change] = []
    known = _generated(found, len(names))
    for change in _changes(len(names), components):
        if change in known or not all(_permutes(change, p, special) for p, special in complete):
            continue
        if _matters(change, components, names):
            found.append(change)
            known = _generated(found, len(names))
    texts = []
    for change in found:  # denominators are constants or one parameter
        *images, below = map(format_polynomial, _images(change, names))
        texts.append(
            tuple(images if below == "1" else [f"{image}/{below}" if image != below else "1" for image in images])
        )
    return texts


def _permutes(change: Change, p: int, special: Mapping[Point, Degrees]) -> bool:
    """Whether all special members modulo a prime go to such with the same degrees, or to infinity."""
    rows = residues(change, p)
    count(20)
    for point, degrees in special.items() if rows is not None else ():
        *image, below = (sum(c * x for c, x in zip(row, (*point, 1), strict=True)) % p for row in rows or ())
        count(5)
        if below and special.get(tuple(x * pow(below, -1, p) % p for x in image)) != degrees:
            return False
    return True


def _changes(count: int, components: Sequence[Component]) -> Iterator[Change]:
    """Those that are tried, plain ones first; shifts and factors take one rational point to another."""
    signed = [
        tuple(
            tuple(fmpq(sign * (k == place)) for k in range(count + 1))
            for place, sign in zip(places, (*signs, 1), strict=True)
        )
        for signs in sorted(product((1, -1), repeat=count), key=lambda signs: signs.count(-1))
        for places in permutations(range(count + 1))
    ]
    plain = [change for change in signed if change[-1][-1] != 0]
    yield from plain
    points = [(*(one.values or {}).values(), fmpq(1)) for one in components if one.is_rational_point][:_MOST_POINTS]
    for change, point in product(plain, points):
        start = _times(change, points[0])
        yield tuple((*row[:-1], row[-1] + y - x) for row, x, y in zip(change, start, point, strict=True))
        if all(start) and all(point):
            yield tuple(tuple(y / x * c for c in row) for row, x, y in zip(change, start, point, strict=True))
    if count > 1:
        yield from signed


def _times(change: Change, vector: Sequence[fmpq]) -> Row:
    return tuple(sum((c * x for c, x in zip(row, vector, strict=True)), fmpq(0)) for row in change)


def _images(change: Change, names: Sequence[str]) -> list[fmpq_mpoly]:
    """The images of the parameters times the last one, which is a denominator."""
    context = ring(names)
    vector = [*context.gens(), context.constant(1)]
    return [sum((c * x for c, x in zip(row, vector, strict=True)), context.constant(0)) for row in change]


def _matters(change: Change, components: Sequence[Component], names: Sequence[str]) -> bool:
    """Whether hypersurfaces go to such with the same degrees, and something is moved or not affine."""
    *images, below = _images(change, names)

    def moved_by(equation: fmpq_mpoly) -> fmpq_mpoly:
        """What holds where the image of a point satisfies an equation; a constant where only points at infinity do."""
        terms = {(*m, equation.total_degree() - sum(m)): c for m, c in equation.terms()}
        form = ring([f"x{k}" for k in range(len(images) + 1)]).from_dict(terms)
        return primitive_part(form.compose(*images, below, ctx=below.context()))[1]

    known = {(str(one.equations[0]), one.degrees) for one in components if len(one.equations) == 1}
    matters = False
    for one in components:
        moved = [moved_by(equation) for equation in one.equations]
        if any(equation.total_degree() == 0 for equation in moved):
            continue
        if len(moved) == 1 and (str(moved[0]), one.degrees) not in known:
            return False
        is_affine = all(equation.total_degree() == 1 for equation in one.equations)
        if one.values is None:
            stays = set(map(str, moved)) == set(map(str, one.equations))
        else:  # a random member, or the point itself
            stays = replace(one, equations=tuple(moved)).contains([*one.values.values()])
        matters = matters or not (is_affine and stays)
    return matters


def _generated(found: Sequence[Change], count: int) -> set[Change]:
    """The group that changes generate; it is finite, for it permutes points."""

    def composed(one: Change, other: Change) -> Change:
        """First `one`, then `other`."""
        rows = tuple(zip(*(_times(other, column) for column in zip(*one, strict=True)), strict=True))
        scale = next(c for c in rows[-1] if c != 0)
        return tuple(tuple(c / scale for c in row) for row in rows)

    known = new = {tuple(tuple(fmpq(int(i == k)) for k in range(count + 1)) for i in range(count + 1))}
    while new and len(known) < 2000:
        new = {composed(one, other) for one in new for other in found} - known
        known = known | new
    return known
