"""Hamiltonian systems f = J grad H with a cubic H and a constant skew matrix J.

Gradients are columns. The standard structure on R^{2m} is J = [[0, I], [-I, 0]], so that {x_i, x_{m+i}} = 1. Any
constant skew J is allowed, including singular J and odd dimensions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.fields import QQ, integer
from kahanmaps.algebra.matrices import nullspace
from kahanmaps.algebra.polynomials import degree, evaluate, gradient, is_homogeneous, linear_combinations, names_of
from kahanmaps.algebra.printing import format_polynomial
from kahanmaps.display_protocols import LatexDisplay, shorten
from kahanmaps.errors import InputError
from kahanmaps.systems.quadratic import QuadraticSystem


def standard_structure(dim: int) -> fmpq_mat:
    """Return the matrix [[0, I], [-I, 0]] of even size `dim`.

    >>> standard_structure(2)
    [ 0, 1]
    [-1, 0]
    """
    if integer(dim, "the dimension") % 2 or dim <= 0:
        raise InputError(f"the standard structure J = [[0, I], [-I, 0]] needs an even dimension, found {dim}")
    m = dim // 2
    return fmpq_mat(dim, dim, [(j == i + m) - (i == j + m) for i in range(dim) for j in range(dim)])


@dataclass(frozen=True, eq=False)
class CubicHamiltonian(LatexDisplay):
    """A polynomial H of degree at most 3 and a constant skew matrix J; the system is f = J grad H.

    >>> from kahanmaps.algebra.parsing import parse_polynomial
    >>> H = parse_polynomial("q^3/3 + p^2/2", ["q", "p"])
    >>> print(CubicHamiltonian(H, standard_structure(2)).system)
    q' = p
    p' = -q^2
    """

    H: fmpq_mpoly
    J: fmpq_mat

    def __repr__(self) -> str:
        kind = "standard" if self.is_standard else "another"
        return f"CubicHamiltonian({shorten(format_polynomial(self.H), 100)}; {kind} J)"

    def __post_init__(self) -> None:
        n = len(names_of(self.H))
        if degree(self.H) > 3:
            raise InputError(f"H has degree {degree(self.H)}, expected at most 3: otherwise x' = f(x) is not quadratic")
        if (self.J.nrows(), self.J.ncols()) != (n, n):
            raise InputError(f"J is {self.J.nrows()} x {self.J.ncols()}, expected {n} x {n} for {n} variables")
        for i in range(n):
            for j in range(i, n):
                if self.J[i, j] != -self.J[j, i]:
                    raise InputError(
                        f"J is not skew: entry ({i + 1},{j + 1}) is {self.J[i, j]}, entry ({j + 1},{i + 1}) is "
                        f"{self.J[j, i]}, expected opposite numbers"
                    )

    @property
    def dim(self) -> int:
        return len(names_of(self.H))

    @property
    def variables(self) -> tuple[str, ...]:
        return names_of(self.H)

    @property
    def is_homogeneous(self) -> bool:
        """Whether every term of H has degree 3."""
        return is_homogeneous(self.H, 3)

    @cached_property
    def is_standard(self) -> bool:
        """Whether J = [[0, I], [-I, 0]]."""
        return self.dim % 2 == 0 and bool(self.J == standard_structure(self.dim))

    @cached_property
    def gradient(self) -> tuple[fmpq_mpoly, ...]:
        """The partial derivatives of H."""
        return gradient(self.H)

    @cached_property
    def system(self) -> QuadraticSystem:
        """The quadratic system x' = J grad H(x)."""
        return QuadraticSystem(linear_combinations(self.J, self.gradient))

    @cached_property
    def centre(self) -> tuple[fmpq, ...] | None:
        """Return a point c for which H(c + x) - H(c) is a homogeneous cubic, or None.

        Hess H(c) = 0 is a system of linear equations. Two solutions differ by a direction on which the cubic part does
        not depend, so that grad H has the same value at all solutions.
        """
        n, zero = self.dim, (0,) * self.dim
        hessian_entries = [component.derivative(j) for i, component in enumerate(self.gradient) for j in range(i + 1)]
        rows = [[*(entry.derivative(k)[zero] for k in range(n)), entry[zero]] for entry in hessian_entries]
        # In the vector with v[n] != 0, all free unknowns except the last are 0: so c = 0 is taken if it is a solution.
        solution = next((v for v in nullspace(QQ, fmpq_mat(rows)) if v[n] != 0), None)
        if solution is None or any(evaluate(component, QQ, solution[:n]) != 0 for component in self.gradient):
            return None
        return solution[:n]

    def about(self, point: Sequence[fmpq]) -> CubicHamiltonian:
        """Return the system in coordinates with this point as origin: H(point + x) - H(point)."""
        context = self.H.context()
        H = self.H.compose(*(x + c for x, c in zip(context.gens(), point, strict=True)), ctx=context)
        return CubicHamiltonian(H - H[(0,) * self.dim], self.J)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, CubicHamiltonian):
            return NotImplemented
        return bool(self.variables == other.variables and self.H == other.H and self.J == other.J)

    def __hash__(self) -> int:
        return hash((self.variables, str(self.H)))
