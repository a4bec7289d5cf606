"""A map on projective space: the image of (X : Z), x = X/Z, is the kernel of the matrix L of its equation.

The n x (n + 1) matrix L of forms of degree d in (X : Z) (equation.py) has n + 1 signed maximal minors, which are forms
of degree n d; a common factor is divided out if there is one. For several factors of a map, the forms are composed.
Source: petrera-suris-2016, eq. (eq: Phi gen).
"""

from __future__ import annotations

from math import comb, prod
from typing import Any, NamedTuple

from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.maps.equation import Equation
from kahanmaps.maps.implicit import Map
from kahanmaps.maps.inverse import TooLarge

_MAX_TERMS = 3_000  # maximal number of terms of a form of a composition, before the common factor is divided out


class HomogeneousMap(NamedTuple):
    """The `forms` without common factor that give a map on projective space.

    `factor` is the common factor by which the forms of `Equation.image`, composed for several factors of a map, were
    divided. `denominator` is, up to sign, det M(x) made homogeneous; for several factors, it is the product of their
    denominators. If the last form is zero, the map is singular everywhere.
    """

    forms: list[Any]
    factor: Any
    denominator: Any

    @property
    def degree(self) -> int:
        """The degree of the forms."""
        return max((int(form.total_degree()) for form in self.forms if not form.is_zero()), default=0)


def homogeneous_map(map_over: Map) -> HomogeneousMap:
    """Return the forms of a map over QQ or GF(p) with p < 2^63; exact. Their variables are named x1, ..., xn, z.

    Raises TooLarge if a form of a composition of several factors has too many terms.

    >>> from kahanmaps.maps.kahan import KahanMap
    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> homogeneous_map(KahanMap(QuadraticSystem.from_text(["x", "y"], ["x*y", "-x^2"]), 1)).forms
    [x1*x2 + x1*z, -2*x1^2 - x2^2 + x2*z, 2*x1^2 - x2*z + z^2]
    """
    first_equation, *equations = map_over.equations
    composition = _map_of_equation(first_equation)
    for equation in equations:
        factor_map = _map_of_equation(equation)
        size, degree = equation.dim, composition.degree * factor_map.degree
        if comb(degree + size, size) > _MAX_TERMS:
            raise TooLarge(f"the composition of {len(equations) + 1} maps is too large for forms on projective space")
        forms, gcd = _divide_by_common_factor([form.compose(*composition.forms) for form in factor_map.forms])
        factor = factor_map.factor.compose(*composition.forms)
        denominator = factor_map.denominator.compose(*composition.forms)
        outer_factor = composition.factor**equation.image_degree
        composition = HomogeneousMap(forms, outer_factor * factor * gcd, composition.denominator * denominator)
    return composition


def _map_of_equation(equation: Equation) -> HomogeneousMap:
    rows = equation.polynomials()
    if equation.explicit is None:
        minors = kernel_minors(rows)
        return HomogeneousMap(*_divide_by_common_factor(minors), minors[-1])
    (forms,) = equation.explicit.polynomials()
    return HomogeneousMap(forms, forms[0] * 0 + 1, prod(-row[i] for i, row in enumerate(rows)))


def _divide_by_common_factor(forms: list[Any]) -> tuple[list[Any], Any]:
    """Return the forms divided by their common factor, and this factor; the factor is 1 if it is constant."""
    context = forms[0].context()
    gcd = context.constant(0)
    for form in forms:
        gcd = gcd.gcd(form)
    if gcd.is_zero() or gcd.is_constant():
        return forms, context.constant(1)
    return [form / gcd for form in forms], gcd
