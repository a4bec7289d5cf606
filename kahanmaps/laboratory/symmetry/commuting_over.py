"""Commuting systems over a number field K = Q[t]/g: those of the system over Q that one over K is, as far as over K.

A quadratic system in n variables over K is one in n m variables over Q, and its Kahan map is that over K
(docs/beyond.md). So the g over K whose maps commute with that of f are among the rational ones for this larger system.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from flint import fmpq_mat

from kahanmaps.algebra.polynomials import ring
from kahanmaps.checks.decide import DEFAULT_ERROR_BITS
from kahanmaps.errors import InputError
from kahanmaps.family.tensor import GENERATOR, over_algebra
from kahanmaps.laboratory.defaults import SECONDS
from kahanmaps.laboratory.symmetry.commuting import (
    CommutingField,
    CommutingSystems,
    commuting_systems,
)
from kahanmaps.maps.algebraic import AlgebraicMap
from kahanmaps.maps.implicit import BirationalMap
from kahanmaps.maps.kahan import Kahan
from kahanmaps.systems.quadratic import QuadraticSystem


def find_commuting(
    given: QuadraticSystem | BirationalMap,
    shape: str | None = None,
    *,
    seed: int = 0,
    error_bits: int = DEFAULT_ERROR_BITS,
    seconds: float = SECONDS["commuting systems"],
    progress: Callable[[str], None] = lambda _: None,
) -> CommutingSystems:
    """All quadratic g whose Kahan map commutes with that of f at the same eps, over Q or the number field of f.

    `given` is f, or its Kahan map, with an algebraic number in it or none; the rest is as for `commuting_systems`. Over
    a number field g are of the shape B f unless "quadratic" is asked for, their right-hand sides contain the root, and
    B is not given.
    Raises InputError for other maps and for what that function refuses.

    >>> from kahanmaps.documents.inline import System
    >>> found = find_commuting(System("x' = a*x^2; y' = y^2", a="root of t^2 - 2").map)
    >>> [g.rhs for g in found.solutions]
    [['0', '0'], ['x^2*a', 'y^2'], ['-x^2*a', '-y^2']]
    >>> [[g.rhs for g in family.directions] for family in found.families]
    [[['x^2*a', 'y^2'], ['2*x^2', '0'], ['x^2*a', '0'], ['0', 'y^2*a']]]
    """
    options: dict[str, Any] = {"seed": seed, "error_bits": error_bits, "seconds": seconds, "progress": progress}
    if isinstance(given, QuadraticSystem):
        return commuting_systems(given, shape, **options)
    kahan = given.given if isinstance(given, AlgebraicMap) else given
    if not isinstance(kahan, Kahan) or "eps" in kahan.system.symbols:
        raise InputError(f"found {kahan.kind}, expected a quadratic vector field without eps: g is sought for fields")
    if not isinstance(given, AlgebraicMap):
        return commuting_systems(kahan.system, shape, **options)
    f, chi = kahan.system, given.root.polynomial
    if GENERATOR in f.variables:
        raise InputError(f"found a variable {GENERATOR}, expected another name: it is that of the root over a field")
    letters = ring((*f.variables, GENERATOR)).gens()
    over_t = QuadraticSystem(tuple(p.compose(*letters, ctx=letters[0].context()) for p in f.rhs), (GENERATOR,))
    m, times_t = given.root.degree, given.root.number_field.generator.matrix
    C = fmpq_mat(f.dim * m, f.dim * m)  # t times a point
    for k, i, j in itertools.product(range(f.dim), range(m), range(m)):
        C[k * m + i, k * m + j] = times_t[i, j]
    found = commuting_systems(over_algebra(over_t, chi), shape or "linear", **options, C=C)
    *x, a = ring((*f.variables, *f.symbols)).gens()
    at = [x[k // m] if k % m == 0 else 0 * a for k in range(f.dim * m)]

    def back(G: QuadraticSystem) -> QuadraticSystem:
        """The system over K that one over Q comes from: its values at points of Q^n tell."""
        parts = [p.compose(*at, ctx=a.context()) for p in G.rhs]
        rhs = (sum((parts[i * m + j] * a**j for j in range(m)), 0 * a) for i in range(f.dim))
        return QuadraticSystem(tuple(rhs), f.symbols)

    def over(one: CommutingField) -> CommutingField:
        return replace(one, system=back(one.system), B=None)

    return replace(
        found,
        system=f,
        basis=[back(G) for G in found.basis],
        dimension=None if found.dimension is None else found.dimension // m,
        solutions=[over(g) for g in found.solutions],
        families=[
            replace(family, base=over(family.base), directions=tuple(map(over, family.directions)))
            for family in found.families
        ],
        irrational=[],  # these are not over the field either, but over its products with others
        root=str(given.root),
    )
