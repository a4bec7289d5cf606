"""Invariant measures dx/phi of Kahan maps: phi(x~) = phi(x) det dPhi(x).

For Hamiltonian f with constant J the density is phi = det(I - eps f'(x)). Source: cmoq-2013; petrera-suris-2016, eq.
(eq: CMOQ measure).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

from kahanmaps.algebra.fields import Field
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.algebra.text import format_rational_function
from kahanmaps.invariants.sizes import Fraction, Size, determinant_size, function_size
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.systems.quadratic import QuadraticSystem


class Density(ABC):
    """A function phi of x and eps such that dx/phi may be invariant."""

    name: str
    formula: str

    @abstractmethod
    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        """The value at a point over `field`, None at a pole."""

    @abstractmethod
    def size(self, eps: Size, point: Size) -> Fraction:
        """Bounds for numerator and denominator of the value at a point of this size."""


class DeterminantDensity(Density):
    """phi = det(I - eps f'(x))."""

    name = "phi"
    formula = "phi = det(I - eps f'(x))"

    def __init__(self, system: QuadraticSystem) -> None:
        self.system = system

    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        return KahanMap(self.system, eps, field).determinant(point)

    def size(self, eps: Size, point: Size) -> Fraction:
        return determinant_size(self.system, eps, point)


class ClaimedDensity(Density):
    """A rational function of the variables and eps that somebody claims is a density."""

    name = "phi"

    def __init__(self, function: RationalFunction) -> None:
        self.function = function
        self.formula = f"phi = {format_rational_function(function)}"

    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        with field.working():
            return self.function.value(field, (*point, field.convert(eps)))

    def size(self, eps: Size, point: Size) -> Fraction:
        return function_size(self.function, len(self.function.names) - 1, eps, point)


def jacobian_determinant_sides(kahan: KahanMap, x: Sequence[Any], image: Sequence[Any]) -> tuple[Any, Any]:
    """Numerator and denominator of det dPhi(x): det(I + eps f'(x~)) and det(I - eps f'(x))."""
    return kahan.inverse.determinant(image), kahan.determinant(x)
