"""Functions of a point and of eps that a Kahan map may conserve or have for a density."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

from kahanmaps.algebra.fields import Field
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.algebra.text import format_rational_function
from kahanmaps.invariants.sizes import Fraction, Size, function_size


class PhaseFunction(ABC):
    """A function of x and eps, with a name and a formula for people."""

    name: str
    formula: str

    @abstractmethod
    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        """The value at a point over `field`; None at a pole. Raises SingularStep where a map in it has no value."""

    @property
    @abstractmethod
    def subject(self) -> tuple[Any, ...]:
        """All that determines the function, as `seed_for` takes it."""

    @abstractmethod
    def size(self, eps: Size, point: Size) -> Fraction:
        """Bounds for numerator and denominator of the value at a point of this size."""


class ClaimedFunction(PhaseFunction):
    """A rational function of the variables and eps (its last variable) that somebody makes a claim about."""

    def __init__(self, name: str, function: RationalFunction) -> None:
        self.name = name
        self.function = function
        self.formula = format_rational_function(function)

    @property
    def subject(self) -> tuple[Any, ...]:
        return ("claimed", self.function)

    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        with field.working():
            return self.function.value(field, (*point, field.convert(eps)))

    def size(self, eps: Size, point: Size) -> Fraction:
        return function_size(self.function, len(self.function.names) - 1, eps, point)
