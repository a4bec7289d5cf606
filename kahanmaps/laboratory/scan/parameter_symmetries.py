"""Search for projective transformations of the parameters of a family that permute its special members.

Three kinds of changes are tried: signed permutations of the parameters a, b, ...; these with a shift or a factor for
each parameter; and, for parameters that are ratios, signed permutations of the coordinates (a : b : ... : 1).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import permutations, product

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.polynomials import primitive_part, ring
from kahanmaps.algebra.printing import format_polynomial
from kahanmaps.algebra.work import count_work
from kahanmaps.laboratory.scan.lift import residues
from kahanmaps.laboratory.scan.result import Component
from kahanmaps.laboratory.scan.sweep import Degrees, Point, Sweep

Row = tuple[fmpq, ...]
Change = tuple[Row, ...]  # a matrix acting on (a, b, ..., 1); in its last row the first nonzero entry is 1

_MAX_POINTS = 24  # maximal number of rational points that determine shifts and factors


def symmetries(sweeps: Sequence[Sweep], components: Sequence[Component], names: Sequence[str]) -> list[tuple[str, ...]]:
    """Return generators of the group of all changes of parameters that were detected, as images of the parameters.

    Modulo each prime for which all members were tried, such a change maps every special member to a member with equal
    degrees of iterates, or to infinity. It also maps hypersurfaces over Q to hypersurfaces with equal degrees of
    iterates. Only changes that move a component, or preserve a component that is not affine, are reported.

    >>> a, b = ring(["a", "b"]).gens()
    >>> lines = [Component((line,), 1, (1,), ()) for line in (a - 3 * b, a + 3 * b, 3 * a - b, 3 * a + b)]
    >>> points = [(x, y) for x in range(7) for y in range(7) if (x * x - 9 * y * y) * (y * y - 9 * x * x) % 7 == 0]
    >>> symmetries([Sweep(7, (2,), {(1,): points}, 49, True, 0)], lines, ["a", "b"])
    [('b', 'a'), ('a', '-b')]
    """
    special_members = [(sweep.prime, sweep.special) for sweep in sweeps if sweep.complete]
    if not special_members or not components:
        return []
    generators: list[Change] = []
    group = _generate_group(generators, len(names))
    for change in _candidate_changes(len(names), components):
        if change in group or not all(_permutes_members(change, p, special) for p, special in special_members):
            continue
        if _is_reportable(change, components, names):
            generators.append(change)
            group = _generate_group(generators, len(names))
    texts = []
    for change in generators:  # the common denominator is a constant or a multiple of one parameter
        *numerators, denominator = map(format_polynomial, _images_of_parameters(change, names))
        if denominator == "1":
            texts.append(tuple(numerators))
        else:
            texts.append(tuple(f"{P}/{denominator}" if P != denominator else "1" for P in numerators))
    return texts


def _permutes_members(change: Change, p: int, special: Mapping[Point, Degrees]) -> bool:
    """Return whether the change maps every special member modulo p to one with the same degrees, or to infinity."""
    rows = residues(change, p)
    count_work(20)
    for point, degrees in special.items() if rows is not None else ():
        *image, denominator = (sum(c * x for c, x in zip(row, (*point, 1), strict=True)) % p for row in rows or ())
        count_work(5)
        if denominator and special.get(tuple(x * pow(denominator, -1, p) % p for x in image)) != degrees:
            return False
    return True


def _candidate_changes(count: int, components: Sequence[Component]) -> Iterator[Change]:
    """Yield the changes to be tried; shifts and factors map the first rational point of the components to another."""
    signed_permutations = [
        tuple(
            tuple(fmpq(sign * (k == index)) for k in range(count + 1))
            for index, sign in zip(permutation, (*signs, 1), strict=True)
        )
        for signs in sorted(product((1, -1), repeat=count), key=lambda signs: signs.count(-1))
        for permutation in permutations(range(count + 1))
    ]
    affine_changes = [change for change in signed_permutations if change[-1][-1] != 0]
    yield from affine_changes
    rational_components = [component for component in components if component.is_rational_point][:_MAX_POINTS]
    points = [(*(component.values or {}).values(), fmpq(1)) for component in rational_components]
    for change, point in product(affine_changes, points):
        image = _apply_change(change, points[0])
        yield tuple((*row[:-1], row[-1] + y - x) for row, x, y in zip(change, image, point, strict=True))
        if all(image) and all(point):
            yield tuple(tuple(y / x * c for c in row) for row, x, y in zip(change, image, point, strict=True))
    if count > 1:
        yield from signed_permutations


def _apply_change(change: Change, vector: Sequence[fmpq]) -> Row:
    return tuple(sum((c * x for c, x in zip(row, vector, strict=True)), fmpq(0)) for row in change)


def _images_of_parameters(change: Change, names: Sequence[str]) -> list[fmpq_mpoly]:
    """Return the numerators of the images of the parameters, followed by the common denominator of the images."""
    context = ring(names)
    vector = [*context.gens(), context.constant(1)]
    return [sum((c * x for c, x in zip(row, vector, strict=True)), context.constant(0)) for row in change]


def _is_reportable(change: Change, components: Sequence[Component], names: Sequence[str]) -> bool:
    """Return whether preimages of hypersurfaces are components of equal degrees, and a component moves or is curved."""
    *images, denominator = _images_of_parameters(change, names)

    def pull_back(equation: fmpq_mpoly) -> fmpq_mpoly:
        """Return the equation of the preimage of a hypersurface; a constant if its points are all at infinity."""
        terms = {(*m, equation.total_degree() - sum(m)): c for m, c in equation.terms()}
        form = ring([f"x{k}" for k in range(len(images) + 1)]).from_dict(terms)
        return primitive_part(form.compose(*images, denominator, ctx=denominator.context()))[1]

    hypersurfaces = {(str(c.equations[0]), c.degrees) for c in components if len(c.equations) == 1}
    is_reportable = False
    for component in components:
        preimage = [pull_back(equation) for equation in component.equations]
        if any(equation.total_degree() == 0 for equation in preimage):
            continue
        if len(preimage) == 1 and (str(preimage[0]), component.degrees) not in hypersurfaces:
            return False
        is_affine = all(equation.total_degree() == 1 for equation in component.equations)
        if component.values is None:
            is_fixed = set(map(str, preimage)) == set(map(str, component.equations))
        else:  # tested at a rational member of the component; a point component is its only member
            is_fixed = replace(component, equations=tuple(preimage)).contains([*component.values.values()])
        is_reportable = is_reportable or not (is_affine and is_fixed)
    return is_reportable


def _generate_group(generators: Sequence[Change], count: int) -> set[Change]:
    """Return the group that changes generate, or at least 2000 elements; it is finite, since it permutes points."""

    def compose(first: Change, second: Change) -> Change:
        rows = tuple(zip(*(_apply_change(second, column) for column in zip(*first, strict=True)), strict=True))
        scale = next(c for c in rows[-1] if c != 0)
        return tuple(tuple(c / scale for c in row) for row in rows)

    group = new_elements = {tuple(tuple(fmpq(int(i == k)) for k in range(count + 1)) for i in range(count + 1))}
    while new_elements and len(group) < 2000:
        new_elements = {compose(change, generator) for change in new_elements for generator in generators} - group
        group = group | new_elements
    return group
