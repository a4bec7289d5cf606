"""The equilibria of a vector field f as fixed points of its Kahan map Phi, and the eigenvalues of f' at them.

Since Phi(x) = x + 2 eps (I - eps f'(x))^{-1} f(x), at a zero of f the map Phi has the derivative
(I - eps f')^{-1} (I + eps f'). So an eigenvalue lambda of f' gives the multiplier (1 + eps lambda)/(1 - eps lambda). If
det(I - eps f'(x)) = 0 at an equilibrium x, it is no fixed point: the equation of the map does not determine Phi(x). All
is exact. Points that are not rational, and nonlinear sets of points, are given by equations. Source: cmoq-2013.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.algebra.polynomials import names_of, primitive_part, ring
from kahanmaps.algebra.printing import attributes, format_polynomial, format_product
from kahanmaps.algebra.small_systems import (
    SolutionComponent,
    groebner,
    normal_form,
    quotient_monomials,
    solve_system,
)
from kahanmaps.algebra.work import SPENT, Budget
from kahanmaps.display_protocols import ResultPart
from kahanmaps.errors import counted
from kahanmaps.laboratory.defaults import budget_for
from kahanmaps.maps.kahan import SystemLike
from kahanmaps.systems.quadratic import QuadraticSystem, as_system

MAX_DIMENSION = 6  # in higher dimensions Groebner bases of quadrics may take long, and they cannot be interrupted
_UNITS = 1e6  # the work limit of the Groebner basis that `are_fixed_by_map` computes
_NAMES_BY_DIMENSION = {1: "line", 2: "plane"}


@dataclass(frozen=True)
class FixedPoints(ResultPart):
    """A set of fixed points: `coordinates` are affine functions of the free variables, which satisfy `equations` = 0.

    `dimension` is the dimension of the set, `count` the number of its points over the complex numbers (None: infinitely
    many). `eigenvalues` is the characteristic polynomial of f' on the set; its coefficients may contain free variables.
    """

    coordinates: tuple[fmpq_mpoly, ...]
    equations: tuple[fmpq_mpoly, ...]
    dimension: int
    count: int | None
    eigenvalues: fmpq_mpoly

    @property
    def where(self) -> str:
        """A phrase: "fixed point (1, 0)", "line of fixed points (x, 0)", "2 fixed points (x, 1) with x^2 - 2 = 0"."""
        point_text = f"({', '.join(format_polynomial(value) for value in self.coordinates)})"
        kind_text = _NAMES_BY_DIMENSION.get(self.dimension, f"space of dimension {self.dimension}")
        if not self.equations:
            return f"{kind_text} of fixed points {point_text}" if self.dimension else f"fixed point {point_text}"
        count_text = f"set of dimension {self.dimension} of fixed points" if self.count is None else ""
        count_text = count_text or counted(self.count or 0, "fixed point")
        if len(self.equations) > len(self.coordinates):  # more equations than f = 0 has components
            return f"{count_text} {point_text} with f = 0{'' if self.count is None else ', not rational'}"
        return f"{count_text} {point_text} with {', '.join(f'{format_polynomial(p)} = 0' for p in self.equations)}"

    @property
    def eigenvalues_text(self) -> str:
        """The factored characteristic polynomial of f'."""
        return format_product([(primitive_part(g)[1], int(k)) for g, k in self.eigenvalues.factor()[1]])

    @property
    def text(self) -> str:
        """A phrase for the set, with the eigenvalues of f' there."""
        return f"{self.where}, eigenvalues of f': {self.eigenvalues_text} = 0"

    def are_fixed_by_map(self, eps: fmpq | None) -> bool | None:
        """Whether det(I - eps f') is not 0: True (at all points), False (at no point) or None (at some, or unknown).

        Args:
            eps: an exact number, or None for all but finitely many eps.

        >>> pendulum = QuadraticSystem.from_text(["x", "y"], ["y", "x - x^2"])
        >>> [points.are_fixed_by_map(fmpq(1)) for points in fixed_points(pendulum).fixed_points]
        [False, True]
        >>> line = fixed_points(QuadraticSystem.from_text(["x", "y"], ["x*y", "0"])).fixed_points[0]
        >>> line.where, line.are_fixed_by_map(None)
        ('line of fixed points (0, y)', None)
        """
        if eps is None:
            # At one point, or at conjugate points, det(I - eps f') = 0 only for finitely many eps.
            have_same_eigenvalues = self.dimension == 0 or not any(any(m[1:]) for m in self.eigenvalues.monoms())
            return True if have_same_eigenvalues else None
        context = self.coordinates[0].context()
        determinant_at_eps = self.eigenvalues.compose(context.constant(1 / eps), *context.gens(), ctx=context)
        value = normal_form(determinant_at_eps, self.equations)
        if value.is_constant():
            return not value.is_zero()
        basis = groebner([*self.equations, value], Budget(_UNITS)) if self.equations else None
        return True if basis is not None and any(p.is_constant() for p in basis) else None

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        fields = attributes(self, "coordinates", "equations", "dimension", "count")
        return {**fields, "eigenvalues": self.eigenvalues_text}


@dataclass(frozen=True)
class FixedPointSearch(ResultPart):
    """All fixed points, rational ones first; `undecided` says why some may be missing (empty: none are missing)."""

    fixed_points: tuple[FixedPoints, ...]
    undecided: str

    @property
    def text(self) -> str:
        """A line for each point or set of points, and a last line for `undecided` if it is not empty."""
        texts = [points.text for points in self.fixed_points] or ["no fixed point"] * (not self.undecided)
        return "\n".join([*texts, *([f"undecided: {self.undecided}"] if self.undecided else [])])

    def __str__(self) -> str:
        return self.text

    def __iter__(self) -> Iterator[FixedPoints]:
        return iter(self.fixed_points)

    def __len__(self) -> int:
        return len(self.fixed_points)

    def __getitem__(self, index: int) -> FixedPoints:
        return self.fixed_points[index]

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return attributes(self, found="fixed_points", undecided="undecided")


def fixed_points(system: SystemLike, effort: int | Budget = 1) -> FixedPointSearch:
    """Compute all equilibria of the system over the complex numbers, with the eigenvalues of f' there; exact.

    Each increase of `effort` by 1 doubles the work limit; there is no search above dimension 6.

    >>> pendulum = QuadraticSystem.from_text(["x", "y"], ["y", "x - x^2"])
    >>> print(fixed_points(pendulum))
    fixed point (0, 0), eigenvalues of f': (lambda - 1)*(lambda + 1) = 0
    fixed point (1, 0), eigenvalues of f': lambda^2 + 1 = 0
    >>> [points.where for points in fixed_points(QuadraticSystem.from_text(["x", "y"], ["x*y", "x^2 - 2*x"]))]
    ['fixed point (2, 0)', 'line of fixed points (0, y)']
    >>> [points.text for points in fixed_points(QuadraticSystem.from_text(["x"], ["x^2 - 2"]))]
    ["2 fixed points (x) with x^2 - 2 = 0, eigenvalues of f': lambda - 2*x = 0"]
    """
    system = as_system(system)
    if system.dim > MAX_DIMENSION:
        return FixedPointSearch((), f"they are computed up to dimension {MAX_DIMENSION}")
    context = ring(system.variables)
    budget = budget_for("fixed points", effort)
    solutions = solve_system([p for p in system.rhs if not p.is_zero()], context.gens(), budget)
    components, undecided = [_points_of(system, component, []) for component in solutions.components], ""
    for component in (*solutions.conjugate, *solutions.unsolved):
        basis = None if component in solutions.without_basis else groebner(component.equations, budget)
        if basis is None:
            undecided = solutions.reason or (SPENT if budget.is_spent else "a Groebner basis would be too large")
        elif not any(p.is_constant() for p in basis):
            components.append(_points_of(system, component, basis))
    return FixedPointSearch(tuple(components), undecided)


def _points_of(system: QuadraticSystem, component: SolutionComponent, basis: Sequence[fmpq_mpoly]) -> FixedPoints:
    """Return the fixed points on a component of the solutions; `basis` is a Groebner basis of its equations."""
    leading_monomials = [tuple(int(e) for e in p.monoms()[0]) for p in basis]
    free_variables = sorted({*component.free, *(i for p in basis for i, e in enumerate(p.degrees()) if e)})
    # The dimension is the largest size of a set of variables such that no leading monomial has only these variables.
    dimensions = [
        len(subset)
        for size in range(len(free_variables) + 1)
        for subset in itertools.combinations(free_variables, size)
        if not any(all(e == 0 for i, e in enumerate(m) if i not in subset) for m in leading_monomials)
    ]
    dimension = max(dimensions)
    count = len(quotient_monomials(basis, free_variables) or ()) if basis else 1
    # det(lambda I - f'), reduced modulo the equations of the points
    n = system.dim
    symbol = next(name for name in ("lambda", "mu", *(f"mu{k}" for k in range(n))) if name not in system.variables)
    joint_ring = ring([symbol, *names_of(component.values[0])])
    eigenvalue, *x = joint_ring.gens()
    coordinates = [p.compose(*x, ctx=joint_ring) for p in component.values]
    rows = [
        [
            *((eigenvalue if i == j else 0) - p.derivative(j).compose(*coordinates, ctx=joint_ring) for j in range(n)),
            None,
        ]
        for i, p in enumerate(system.rhs)
    ]
    eigenvalues = normal_form(kernel_minors(rows)[-1] * (-1) ** n, [p.compose(*x, ctx=joint_ring) for p in basis])
    return FixedPoints(component.values, tuple(basis), dimension, None if dimension else count, eigenvalues)
