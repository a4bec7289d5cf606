"""Integrals of Kahan maps: the modified Hamiltonian in its two normalisations, and claimed rational functions.

For f = J grad H with a cubic H and any constant skew J the map Phi_f conserves

    H + (2 eps/3) grad H^T (I - eps f')^{-1} f  =  H + grad H . (x~ - x)/3  =  H + O(eps^2)    ("modified H"),

and for homogeneous H and J = [[0, I], [-I, 0]] this is -1/6 of the paper's H~ = eps^{-1} x^T J x~.
Sources: cmoq-2013; petrera-suris-2016, eqs. (eq: CMOQ integral), (tH).
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.fields import Field
from kahanmaps.algebra.polynomials import RationalFunction, evaluate
from kahanmaps.algebra.roots import Root
from kahanmaps.errors import InputError
from kahanmaps.invariants.phase_functions import ClaimedFunction, PhaseFunction, at_eps, where
from kahanmaps.maps.implicit import BirationalMap, MapOver
from kahanmaps.maps.kahan import Kahan
from kahanmaps.systems.hamiltonian import CubicHamiltonian


class ImageFunction(PhaseFunction):
    """A function of x and of its image x~ under the Kahan map of J grad H."""

    def __init__(self, hamiltonian: CubicHamiltonian) -> None:
        self.hamiltonian = hamiltonian
        self.map = Kahan(hamiltonian.system)

    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        return self.of_image(self.map.at(eps, field), point)

    @abstractmethod
    def of_image(self, phi: MapOver, point: Sequence[Any]) -> Any:
        """The value at a point, phi being the map over a field."""


def modified(H: fmpq_mpoly, gradient: Sequence[fmpq_mpoly], phi: MapOver, point: Sequence[Any]) -> Any:
    """H + grad H . (x~ - x)/3 at a point, for any map."""
    field, image = phi.field, phi.step(point)
    with field.working():
        total = field.zero
        for x, after, slope in zip(point, image, gradient, strict=True):
            total = total + evaluate(slope, field, point) * (after - x)
        return evaluate(H, field, point) + total * field.convert(fmpq(1, 3))


class ModifiedHamiltonian(ImageFunction):
    """H + grad H . (x~ - x)/3, which tends to H as eps -> 0; x~ is the image under the Kahan map of J grad H."""

    def __init__(self, hamiltonian: CubicHamiltonian, letter: str = "H") -> None:
        super().__init__(hamiltonian)
        self.name = f"modified {letter}"
        self.formula = f"{letter} + (2 eps/3) grad {letter}^T (I - eps f')^(-1) f, f = J grad {letter}"

    @property
    def subject(self) -> tuple[Any, ...]:
        return ("modified", self.hamiltonian.H, self.hamiltonian.J)

    def of_image(self, phi: MapOver, point: Sequence[Any]) -> Any:
        return modified(self.hamiltonian.H, self.hamiltonian.gradient, phi, point)


class PaperIntegral(ImageFunction):
    """The paper's H~ = eps^{-1} x^T J x~ = -6 H + O(eps^2), for homogeneous H and J = [[0, I], [-I, 0]]."""

    def __init__(self, hamiltonian: CubicHamiltonian, letter: str = "H", index: str = "") -> None:
        if not (hamiltonian.is_homogeneous and hamiltonian.is_standard):
            raise InputError("H~ = eps^(-1) x^T J x~ is an integral for homogeneous H and the standard J only")
        super().__init__(hamiltonian)
        self.name = f"{letter}~{index}"
        # x^, as in the paper: the map need not be the one whose integral this is, but another of its class.
        self.formula = (
            f"{self.name} = eps^(-1) x^T J x^ = -6 (modified {letter}{index}), "
            f"x^ the image of x under the Kahan map of J grad {letter}{index}"
        )

    @property
    def subject(self) -> tuple[Any, ...]:
        return ("paper", self.hamiltonian.H)

    def of_image(self, phi: MapOver, point: Sequence[Any]) -> Any:
        image = phi.step(point)
        m = len(image) // 2
        with phi.field.working():
            total = phi.field.zero
            for i in range(m):
                total = total + point[i] * image[m + i] - point[m + i] * image[i]
            return total / phi.eps


class CommutantIntegral(ImageFunction):
    """eps^{-1} x^T J C x~ with C = (A^T)^k, which commutes with f'(x): rational whatever the roots of chi are.

    With C = I this is H~; for k < m these span the same space as the K~_s of all associated systems, over the
    splitting field of chi. Proof in docs/mathematics.md.
    """

    def __init__(self, hamiltonian: CubicHamiltonian, A: fmpq_mat, power: int, letter: str = "H") -> None:
        super().__init__(hamiltonian)
        self.matrix = (A**power).transpose()
        self.name = f"{letter}~_{power}"
        self.formula = f"{self.name} = eps^(-1) x^T J {'A^T' if power == 1 else f'(A^T)^{power}'} x~"

    @property
    def subject(self) -> tuple[Any, ...]:
        return ("commutant", self.hamiltonian.H, self.hamiltonian.J, self.matrix)

    def of_image(self, phi: MapOver, point: Sequence[Any]) -> Any:
        field, image = phi.field, phi.step(point)
        with field.working():
            column = field.convert_matrix(self.hamiltonian.J * self.matrix) * field.column(image)
            return (field.column(point).transpose() * column)[0, 0] / phi.eps


class ClaimedIntegral(ClaimedFunction):
    """A rational function of the variables and eps that somebody claims is conserved at `eps`, or (None) at every eps.

    `condition` says for which eps it has values, `is_constant` whether it is a constant there.
    """

    def __init__(
        self,
        name: str,
        function: RationalFunction,
        eps: fmpq | None = None,
        root: Root | None = None,
        map_: BirationalMap | None = None,
    ) -> None:
        super().__init__(name, function, root, map_)
        dim = len(function.names) - 1 - (root is not None)
        self.condition = integral_condition(function, dim, eps, root)
        above, below = at_eps(function, eps, root, dim)
        self.is_constant = not below.is_zero() and is_constant(above, below, dim, root)


def integral_condition(integral: RationalFunction, dim: int, eps: fmpq | None, root: Root | None = None) -> str:
    """For which symbols and eps I = P/Q has values.

    Args:
        integral: a function of `dim` variables, then of symbols and eps.
        dim: the dimension.
        eps: an exact number, or None for every eps.
        root: what the only symbol stands for, where it is algebraic.

    Returns:
        This in words; empty where I has values at all of them, or at none.

    >>> from kahanmaps.algebra.parsing import parse_rational_function
    >>> for text in ("x/((10*eps - 1)*y)", "x/y"):
    ...     print([integral_condition(parse_rational_function(text, ["x", "y", "eps"]), 2, None)])
    ['where 10*eps - 1 is not 0']
    ['']
    """
    _, below = at_eps(integral, eps, root, dim)
    return "" if below.is_zero() else where(dim, below)


def is_constant(above: fmpq_mpoly, below: fmpq_mpoly, dim: int, root: Root | None = None) -> bool:
    """Whether the quotient of two polynomials does not depend on the first `dim` variables; `below` is not 0."""
    monomial, coefficients = below.monoms()[0][:dim], list[fmpq_mpoly]()
    for part in (above, below):  # of that monomial in the first variables: polynomials in the others, in the same ring
        terms = {(*(0,) * dim, *m[dim:]): value for m, value in part.terms() if m[:dim] == monomial}
        coefficients.append(part.context().from_dict(terms))
    difference = above * coefficients[1] - below * coefficients[0]
    return bool((difference if root is None else root.remainder(difference, dim)).is_zero())
