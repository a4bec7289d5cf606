"""The Kahan map on projective space: (X : Z), x = X/Z, goes to the kernel of a matrix of linear forms.

The defining equation times Z, (Z I - eps (f''(X) + Z B)) X~ = ((I + eps B) X + 2 eps c Z) Z~, says that (X~ : Z~) spans
the kernel of an n x (n + 1) matrix L whose entries are linear forms of (X : Z). Its signed maximal minors are n + 1
forms of degree n; what they have in common may be divided out. Source: petrera-suris-2016, eq. (eq: Phi gen).
"""

from __future__ import annotations

from typing import Any

from flint import Ordering, fmpq, fmpq_mpoly_ctx, nmod_mpoly_ctx

from kahanmaps.algebra.fields import Field, PrimeField
from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.systems.quadratic import QuadraticSystem

Forms = list[list[list[Any]]]


def linear_forms(system: QuadraticSystem, eps: Any, field: Field) -> Forms:
    """The coefficients L[i][j][k] of the matrix L: its entry (i, j) is the sum of L[i][j][k] X_k, where X_n is Z.

    `eps` is half the time step, an exact number or an element of `field`; exact over exact fields.
    Raises InputError for eps = 0, BadPrime where the system or eps have no reduction.

    >>> from kahanmaps.algebra.fields import QQ
    >>> linear_forms(QuadraticSystem.from_text(["x"], ["x^2"]), "1/2", QQ)
    [[[-1, 1], [-1, 0]]]
    """
    kahan = KahanMap(system, eps, field)
    local, eps, n = system.over(field), kahan.eps, system.dim
    tensor, B, c = local.tensor.entries(), local.B.entries(), local.c.entries()
    two = field.convert(2)
    forms = []
    for i in range(n):
        row = []
        for j in range(n):
            entries = [-eps * tensor[(i * n + j) * n + k] for k in range(n)]
            row.append([*entries, (field.one if i == j else field.zero) - eps * B[i * n + j]])
        right = [-(field.one if i == j else field.zero) - eps * B[i * n + j] for j in range(n)]
        row.append([*right, -two * eps * c[i]])
        forms.append(row)
    return forms


def homogeneous_map(system: QuadraticSystem, eps: Any, field: Field) -> tuple[list[Any], Any]:
    """The forms without common factor that give the map on projective space, and the factor that was divided out.

    `field` is QQ or GF(p) with p < 2^63; exact. The variables of the forms are those of the system, then Z, under the
    names x1, ..., xn, z. Returns (forms, factor); a last form that is zero says that the map is singular everywhere.
    Raises what `linear_forms` raises.

    >>> from kahanmaps.algebra.fields import QQ
    >>> homogeneous_map(QuadraticSystem.from_text(["x", "y"], ["x*y", "-x^2"]), 1, QQ)
    ([x1*x2 + x1*z, -2*x1^2 - x2^2 + x2*z, 2*x1^2 - x2*z + z^2], 1)
    """
    names = (*(f"x{k + 1}" for k in range(system.dim)), "z")
    context: Any
    if isinstance(field, PrimeField):
        context = nmod_mpoly_ctx.get(names, modulus=field.prime, ordering=Ordering.degrevlex)
    else:
        context = fmpq_mpoly_ctx.get(names, Ordering.degrevlex)
    units = [tuple(int(i == k) for i in range(len(names))) for k in range(len(names))]
    scalar = int if isinstance(field, PrimeField) else fmpq
    rows = [
        [
            context.from_dict({unit: scalar(value) for unit, value in zip(units, entry, strict=True) if value != 0})
            for entry in row
        ]
        for row in linear_forms(system, eps, field)
    ]
    forms = kernel_minors(rows)
    common = context.constant(0)
    for form in forms:
        common = common.gcd(form)
    if common.is_zero() or common.is_constant():
        return forms, context.constant(1)
    return [form / common for form in forms], common
