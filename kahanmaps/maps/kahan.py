"""The Kahan (Hirota-Kimura) map of a quadratic system, over any field.

Conventions, for the whole library: `eps` is the paper's epsilon and the time step is 2 eps. The map x -> x~ solves

    (x~ - x) / (2 eps) = Q(x, x~) + B (x + x~)/2 + c,

which is linear in x~; explicitly Phi(x, eps) = x + 2 eps (I - eps f'(x))^{-1} f(x). Its inverse is Phi(., -eps), its
Jacobi matrix (I - eps f'(x))^{-1} (I + eps f'(x~)). Source: petrera-suris-2016, eqs. (eq: Kahan gen), (eq: Phi
gen), (Jac).
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cached_property
from typing import Any

from flint import fmpq, fmpz

from kahanmaps.algebra.fields import QQ, Field, rational
from kahanmaps.algebra.matrices import det, solve
from kahanmaps.displayed import DisplayedAsFormula
from kahanmaps.errors import BadPrime, InputError, SingularMatrix, SingularStep
from kahanmaps.maps.integer_steps import IntegerPoint, IntegerSteps
from kahanmaps.systems.quadratic import QuadraticSystem, SystemOver


class KahanMapOver:
    """The map Phi(., eps) of a system that is given over any field, with eps an element of it; time step 2 eps."""

    def __init__(self, local: SystemOver, eps: Any) -> None:
        self.field = local.field
        self.eps = eps
        self._local = local

    @property
    def dim(self) -> int:
        """The dimension of the phase space."""
        return self._local.dim

    @cached_property
    def inverse(self) -> KahanMapOver:
        """The inverse map, Phi(., -eps)."""
        with self.field.working():  # or -eps would be a ball of FLINT's default precision
            return KahanMapOver(self._local, -self.eps)

    def point(self, values: Sequence[Any]) -> tuple[Any, ...]:
        """The values as a point over the map's field. Raises InputError for a wrong length or inexact numbers."""
        if isinstance(values, str):
            raise InputError(f"found the text {values[:60]!r}, expected a sequence: parse_point reads points from text")
        if len(values) != self.dim:
            raise InputError(f"found a point with {len(values)} coordinates, expected {self.dim}{self._named()}")
        return tuple(self.field.convert(value) for value in values)

    def step(self, point: Sequence[Any]) -> tuple[Any, ...]:
        """The image x~ of a point. Raises SingularStep where det(I - eps f'(x)) = 0."""
        x = self.point(point)
        with self.field.working():
            column = self.field.column(x)
            # (I - eps f'(x)) x~ = (I + eps B) x + 2 eps c: the defining equation, sorted.
            right = column + (self._local.B * column + self._local.c * self.field.convert(2)) * self.eps
            try:
                return tuple(solve(self.denominator_matrix(x), right).entries())
            except SingularMatrix as error:
                raise self._singular(x) from error

    def inverse_step(self, point: Sequence[Any]) -> tuple[Any, ...]:
        """The preimage of a point. Raises SingularStep where det(I + eps f'(x)) = 0."""
        return self.inverse.step(point)

    def denominator_matrix(self, point: Sequence[Any]) -> Any:
        """The matrix I - eps f'(x)."""
        x = self.point(point)
        with self.field.working():
            return self._identity - self._local.jacobian(x) * self.eps

    @cached_property
    def _identity(self) -> Any:
        with self.field.working():
            return self.field.identity(self.dim)

    def determinant(self, point: Sequence[Any]) -> Any:
        """det(I - eps f'(x)), the denominator of the map."""
        with self.field.working():
            return det(self.denominator_matrix(point))

    def jacobian(self, point: Sequence[Any]) -> Any:
        """The Jacobi matrix dPhi(x) = (I - eps f'(x))^{-1} (I + eps f'(x~)). Raises SingularStep."""
        x = self.point(point)
        image = self.step(x)
        with self.field.working():
            return solve(self.denominator_matrix(x), self.inverse.denominator_matrix(image))

    def vector_field(self, point: Sequence[Any]) -> tuple[Any, ...]:
        """f(x)."""
        with self.field.working():
            return self._local.value(self.point(point))

    def vector_field_jacobian(self, point: Sequence[Any]) -> Any:
        """f'(x)."""
        with self.field.working():
            return self._local.jacobian(self.point(point))

    def _named(self) -> str:
        """What an error message may add about the variables."""
        return ""

    def _singular(self, point: tuple[Any, ...]) -> SingularStep:
        shown = ",".join(self.field.format(entry) for entry in point)
        if len(shown) > 200:
            shown = f"{shown[:100]}...{shown[-80:]}"
        return SingularStep(
            f"det(I - eps f'(x)) = 0 at the point {shown} for eps = {self.field.format(self.eps)}: "
            "the Kahan map has no value there",
            point,
            self.eps,
        )


class KahanMap(DisplayedAsFormula, KahanMapOver):
    """The map Phi(., eps) of a rational system over a field (the rationals unless another is given).

    `eps` is an exact number (int, Fraction, text, fmpq) or an element of the field, not zero; the time step is 2 eps.
    Over QQ and GF(p) everything is exact, over RR(bits) it is enclosed.

    >>> system = QuadraticSystem.from_text(["x", "y"], ["x*y", "-x^2"])
    >>> phi = KahanMap(system, "1/2")
    >>> phi.step(["1", "1/3"])
    (7/8, -13/24)
    >>> phi.inverse_step(phi.step(["1", "1/3"]))
    (1, 1/3)
    """

    def __init__(self, system: QuadraticSystem, eps: Any, field: Field = QQ) -> None:
        self.system = system
        element = field.convert(eps)
        if element == 0:
            _refuse_zero_eps(eps, field)
        super().__init__(system.over(field), element)

    @cached_property
    def inverse(self) -> KahanMap:
        """The inverse map, Phi(., -eps)."""
        with self.field.working():
            return KahanMap(self.system, -self.eps, self.field)

    def step(self, point: Sequence[Any]) -> tuple[Any, ...]:
        """The image x~ of a point. Raises SingularStep where det(I - eps f'(x)) = 0."""
        if self.field is not QQ:
            return super().step(point)
        x = self.point(point)
        image = self.integer_steps.step(IntegerPoint.from_rationals(x))
        if image is None:
            raise self._singular(x)
        return image.rationals()

    def determinant(self, point: Sequence[Any]) -> Any:
        """det(I - eps f'(x)), the denominator of the map."""
        if self.field is not QQ:
            return super().determinant(point)
        return self.integer_steps.determinant(IntegerPoint.from_rationals(self.point(point)))

    @cached_property
    def integer_steps(self) -> IntegerSteps:
        """The stepper on integer points, for maps over QQ."""
        return IntegerSteps(self.system, rational(self.eps))

    def _named(self) -> str:
        return f": {', '.join(self.system.variables)}"

    def __repr__(self) -> str:
        return f"KahanMap({', '.join(self.system.variables)}; eps={self.field.format(self.eps)}, over {self.field})"


def _refuse_zero_eps(eps: Any, field: Field) -> None:
    if isinstance(eps, int | str | Fraction | fmpz | fmpq) and rational(eps) != 0:
        raise BadPrime(
            f"the prime {field.characteristic} divides the numerator of eps = {eps}: take another prime",
            field.characteristic,
        )
    raise InputError("found eps = 0, expected another number: at eps = 0 the Kahan map is the identity")
