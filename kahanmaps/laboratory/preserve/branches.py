"""Spaces that look alike are told apart on every map, so that one rational function belongs to each of them.

Two pencils may have zeros at the same places: then nothing on a single map, modulo one prime and at one value of the
symbols, says which of them is which. Take a coefficient w in which they differ. Its values w_1, ..., w_k on the k
spaces are the roots of chi(T) = (T - w_1) ... (T - w_k), whose coefficients do not depend on the order of the spaces:
they can be interpolated. The factors of chi over Q are the spaces again: a linear one is the w_i of one space as a
function of the symbols and eps, by whose value this space is known on any other map. A factor of higher degree belongs
to spaces that are conjugate over an extension and have no formula over Q.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from flint import fmpq

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.polynomials import RationalFunction, over_one_denominator, ring, substitute
from kahanmaps.algebra.roots import Root
from kahanmaps.laboratory.modular_points import ModularMap
from kahanmaps.laboratory.preserve.closed_forms import reconstruct_at
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import DarbouxSpace

Pattern = tuple[tuple[bool, ...], ...]
Alike = Callable[[int, tuple[int, ...]], Sequence[DarbouxSpace] | None]

_SAMPLES = (150, 600, 3000)  # a simple coefficient is looked for before many values are taken for one
_COEFFICIENTS = 6


def pattern(space: DarbouxSpace) -> Pattern:
    """Where the basis of a space has entries other than zero."""
    return tuple(tuple(bool(entry) for entry in vector) for vector in space.basis)


@dataclass(frozen=True)
class Branches:
    """Spaces of one pattern by the values of their coefficient at `place`: `roots` are its functions, one a space."""

    place: tuple[int, int]
    roots: tuple[RationalFunction, ...]

    def in_order(self, alike: Sequence[DarbouxSpace], map_: ModularMap) -> list[DarbouxSpace] | None:
        """The spaces on a map in the order of the roots; None where two agree there, or one is missing."""
        field = GF(map_.prime)
        at = [field.convert(value) for value in (*map_.values, map_.eps)]
        row, column = self.place
        by_value = {space.basis[row][column]: space for space in alike}
        values = [root.value(field, at[: len(root.names)]) for root in self.roots]
        if len(by_value) < len(alike) or None in values:
            return None
        found = [by_value.get(int(value)) for value in values]
        return None if None in found else [space for space in found if space is not None]


def tell_apart(
    model: Sequence[DarbouxSpace],
    alike: Alike,
    names: Sequence[str],
    seed: int,
    deadline: float,
    root: Root | None = None,
) -> Branches | None:
    """What tells spaces of one pattern apart at every value of `names`; None where they are conjugate or time is over.

    `model` are the spaces on one map, `alike(prime, values)` those on others, in any order; None at special values.
    """
    places = [
        (i, k)
        for i, vector in enumerate(model[0].basis)
        for k in range(len(vector))
        if len({space.basis[i][k] for space in model}) == len(model)
    ]
    for samples in _SAMPLES:
        for place in places[:_COEFFICIENTS]:
            if time.monotonic() > deadline:
                return None
            roots = _roots(place, len(model), alike, names, samples, seed, deadline, root)
            if roots is not None:
                return Branches(place, roots) if len(roots) == len(model) else None
    return None


def _roots(
    place: tuple[int, int],
    count: int,
    alike: Alike,
    names: Sequence[str],
    samples: int,
    seed: int,
    deadline: float,
    root: Root | None,
) -> tuple[RationalFunction, ...] | None:
    """The functions of `names` whose values the coefficient has on so many spaces, as far as they are rational."""
    row, column = place

    def symmetric_functions(prime: int, values: tuple[int, ...]) -> list[int] | None:
        spaces = alike(prime, values)
        if spaces is None or len(spaces) != count:
            return None
        coefficients = [1]  # of prod (T - w), the highest first
        for space in spaces:
            w = space.basis[row][column]
            shifted = zip([*coefficients, 0], [0, *coefficients], strict=True)
            coefficients = [(here - w * before) % prime for here, before in shifted]
        return coefficients[1:]

    answer = reconstruct_at(root, symmetric_functions, names, seed=seed, max_samples=samples, deadline=deadline)
    if answer.functions is None:
        return None
    context = ring((*names, "T"))
    *gens, T = context.gens()
    above, below = over_one_denominator(answer.functions, context, gens)
    chi = sum((P * T ** (count - k) for k, P in enumerate(above, 1)), below * T**count)
    origin = {"T": fmpq(0)}
    return tuple(
        RationalFunction(-substitute(factor, origin), substitute(factor.derivative(len(gens)), origin))
        for factor, _ in chi.factor()[1]
        if factor.degrees()[-1] == 1
    )
