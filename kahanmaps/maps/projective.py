"""A map on projective space: (X : Z), x = X/Z, goes to the kernel of the matrix L of its equation.

The n x (n + 1) matrix L of forms of degree d in (X : Z) (implicit.py) has n + 1 signed maximal minors, which are forms
of degree n d; what they have in common may be divided out. Source: petrera-suris-2016, eq. (eq: Phi gen).
"""

from __future__ import annotations

from typing import Any

from flint import Ordering, fmpq, fmpq_mpoly_ctx, nmod_mpoly_ctx

from kahanmaps.algebra.fields import PrimeField
from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.errors import InputError
from kahanmaps.maps.implicit import MapOver

Forms = list[list[list[Any]]]


def linear_forms(map_over: MapOver) -> Forms:
    """The coefficients L[i][j][k] of L where it is linear: its entry (i, j) is the sum of L[i][j][k] X_k, X_n being Z.

    Exact over exact fields. Raises InputError where the forms are of a higher degree.

    >>> from kahanmaps.maps.kahan import KahanMap
    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> linear_forms(KahanMap(QuadraticSystem.from_text(["x"], ["x^2"]), "1/2"))
    [[[-1, 1], [-1, 0]]]
    """
    equation = map_over.equation
    if equation.degree != 1:
        raise InputError(f"found an equation of degree {equation.degree} in the point, expected degree 1")
    zero = [equation.over.zero] * (equation.dim + 1)
    forms = [[list(zero) for _ in row] for row in equation.terms]
    for i, row in enumerate(equation.terms):
        for j, entry in enumerate(row):
            for k, coefficient in entry:
                forms[i][j][k] = coefficient
    return forms


def homogeneous_map(map_over: MapOver) -> tuple[list[Any], Any]:
    """The forms without common factor that give the map on projective space, and the factor that was divided out.

    For maps over QQ or GF(p) with p < 2^63; exact. The variables of the forms are named x1, ..., xn, z. Returns (forms,
    factor); a last form that is zero says that the map is singular everywhere.

    >>> from kahanmaps.maps.kahan import KahanMap
    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> homogeneous_map(KahanMap(QuadraticSystem.from_text(["x", "y"], ["x*y", "-x^2"]), 1))
    ([x1*x2 + x1*z, -2*x1^2 - x2^2 + x2*z, 2*x1^2 - x2*z + z^2], 1)
    """
    equation = map_over.equation
    names = (*(f"x{k + 1}" for k in range(equation.dim)), "z")
    context: Any
    if isinstance(equation.over, PrimeField):
        context = nmod_mpoly_ctx.get(names, modulus=equation.over.prime, ordering=Ordering.degrevlex)
    else:
        context = fmpq_mpoly_ctx.get(names, Ordering.degrevlex)
    scalar = int if isinstance(equation.over, PrimeField) else fmpq
    rows = [
        [context.from_dict({equation.exponents[k]: scalar(value) for k, value in entry}) for entry in row]
        for row in equation.terms
    ]
    forms = kernel_minors(rows)
    common = context.constant(0)
    for form in forms:
        common = common.gcd(form)
    if common.is_zero() or common.is_constant():
        return forms, context.constant(1)
    return [form / common for form in forms], common
