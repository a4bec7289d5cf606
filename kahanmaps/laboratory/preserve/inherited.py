"""The integrals that a Kahan map has by theorems, and how many of them are independent.

    v . x                              for every v with v . f = 0;
    H + grad H . (x~ - x)/3            for every constant skew K with K f_y = grad_y H, in coordinates (y, z) with these
                                       integrals z.

K need not be invertible: for an invertible one f = J grad H with J = K^{-1} (cmoq-2013); the proof for any K is in
docs/mathematics.md. Forms and functions are exact. The gradients are taken at a point modulo a prime: a rank that is
found there is not larger than the number of independent integrals.
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.fields import GF, Field
from kahanmaps.algebra.modular_matrices import rank
from kahanmaps.errors import counted
from kahanmaps.invariants.integrals import modified
from kahanmaps.laboratory.modular_points import ModularMap, Point
from kahanmaps.laboratory.preserve.darboux.affine_functions import QuotientForms, affine_integrals, quotient_by
from kahanmaps.laboratory.preserve.poisson.hamiltonian_structure import (
    MAX_DIMENSION,
    closed_forms,
    hamiltonian_function,
)
from kahanmaps.maps.kahan import Kahan, KahanMapOver
from kahanmaps.systems.quadratic import QuadraticSystem


@dataclass(frozen=True, eq=False)
class InheritedIntegrals:
    """What `inherited_integrals` found: the affine integrals are in `quotient`, the K with respect to y are `forms`."""

    system: QuadraticSystem
    quotient: QuotientForms
    forms: tuple[fmpq_mat, ...]

    @property
    def text(self) -> str:
        """What there is, in words; empty where there is nothing."""
        affine, modified = len(self.quotient.integrals), len(self.forms)
        parts = [counted(affine, "affine integral")] if affine else []
        return " and ".join([*parts, counted(modified, "modified Hamiltonian")] if modified else parts)

    def gradients(self, map_: ModularMap, x: Point) -> list[list[int]]:
        """Covectors that span those of all these integrals at a point; none where the map has no value there.

        `map_` is that of the system modulo a prime that divides none of its denominators.
        """
        assert isinstance(map_.map, KahanMapOver)
        field, n, free = GF(map_.prime), map_.dim, self.quotient.free
        rows = [[int(entry) % map_.prime for entry in vector] for vector in self.quotient.integrals]
        image = map_.step(x)
        if image is None or not self.forms:
            return rows
        here, there = ([field.convert(c) for c in point] for point in (x, image))
        S, local = field.convert_matrix(self.quotient.section), map_.map.local
        A, A_there = (
            field.matrix(len(free), len(free), [slopes[i, j] for i in free for j in range(len(free))])
            for slopes in (local.jacobian(point) * S for point in (here, there))
        )
        one, eps = field.identity(len(free)), field.convert(map_.eps)
        f = local.value(here)
        f_y = field.column([f[i] for i in free])
        u = field.column([there[i] - here[i] for i in free])
        change = (one - A * eps).inv() * (one + A_there * eps) - one  # du/dy
        third = field.convert(fmpq(1, 3))
        for form in self.forms:
            K = field.convert_matrix(form)
            slopes = K * f_y + (K * A * u + change.transpose() * K * f_y) * third
            row = [0] * n
            for i, slope in zip(free, slopes.entries(), strict=True):
                row[i] = int(slope)
            rows.append(row)
        return rows

    def count(self, map_: ModularMap) -> int:
        """How many of them are independent, at a random point: at least so many integrals the map has."""
        return rank(self.gradients(map_, map_.random_point()), map_.prime)

    def hamiltonian(self, k: int) -> fmpq_mpoly:
        """The H that belongs to the k-th form."""
        return hamiltonian_function(self.system, self.quotient, self.forms[k])

    def modified(self, k: int, field: Field, eps: Any, x: tuple[Any, ...]) -> Any:
        """The integral that belongs to the k-th form, at a point over a field."""
        H = self.hamiltonian(k)
        slopes = [H.derivative(i) for i in range(self.system.dim)]
        return modified(H, slopes, Kahan(self.system).at(eps, field), x)


def inherited_integrals(system: QuadraticSystem, *, seed: int = 0) -> InheritedIntegrals:
    """The integrals that a Kahan map has for every eps because the flow is what it is; all exact.

    Args:
        system: a quadratic system over Q.
        seed: decides a random point at which the linear equations for K are reduced first.

    Returns:
        The `InheritedIntegrals`: all affine ones and, up to dimension 30, a basis of the K. Source: cmoq-2013.

    >>> from kahanmaps.documents.catalog import load
    >>> found = inherited_integrals(load("volterra_periodic_3").system)
    >>> found.text, found.hamiltonian(0)
    ('1 affine integral and 1 modified Hamiltonian', x1*x2*x3)
    """
    quotient = quotient_by(affine_integrals(system), system.dim)
    forms = closed_forms(system, quotient, random.Random(seed)) if 1 < len(quotient.free) <= MAX_DIMENSION else ()
    return InheritedIntegrals(system, quotient, forms)
