"""Invariant measures dx/phi of Kahan maps: phi(x~) = phi(x) det dPhi(x).

For Hamiltonian f with constant J the density is phi = det(I - eps f'(x)). Source: cmoq-2013; petrera-suris-2016, eq.
(eq: CMOQ measure).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from kahanmaps.algebra.fields import Field
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.invariants.phase_functions import ClaimedFunction, PhaseFunction
from kahanmaps.invariants.sizes import Fraction, Size, determinant_size
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.systems.quadratic import QuadraticSystem


class DeterminantDensity(PhaseFunction):
    """phi = det(I - eps f'(x))."""

    name = "phi"
    formula = "phi = det(I - eps f'(x))"

    def __init__(self, system: QuadraticSystem) -> None:
        self.system = system

    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        return KahanMap(self.system, eps, field).determinant(point)

    def size(self, eps: Size, point: Size) -> Fraction:
        return determinant_size(self.system, eps, point)


class ClaimedDensity(ClaimedFunction):
    """A rational function of the variables and eps that somebody claims is a density."""

    def __init__(self, function: RationalFunction) -> None:
        super().__init__("phi", function)
        self.formula = f"phi = {self.formula}"


def jacobian_determinant_sides(kahan: KahanMap, x: Sequence[Any], image: Sequence[Any]) -> tuple[Any, Any]:
    """Numerator and denominator of det dPhi(x): det(I + eps f'(x~)) and det(I - eps f'(x))."""
    return kahan.inverse.determinant(image), kahan.determinant(x)
