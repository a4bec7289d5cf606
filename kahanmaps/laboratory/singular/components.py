"""The components over GF(p) of the zeros of forms, on a surface: told apart where one form over Q has several.

Restricted to a generic ruled surface, an irreducible factor of a form in many variables stays irreducible (Bertini),
with its degree. So a polynomial of two variables is factored where that form could not even be written down.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

from flint import Ordering, nmod_mpoly, nmod_mpoly_ctx, nmod_poly

from kahanmaps.algebra.fields import GF
from kahanmaps.laboratory.singular.jets import modulo
from kahanmaps.maps.equation import Equation

Kind = tuple[tuple[int, ...], int]  # exponents in forms, and degree


@dataclass(frozen=True)
class Component:
    """A hypersurface: its exponents in the forms, its degree, its order along the curve t (None: it contains it), and
    its equation on the surface (t, u)."""

    exponents: tuple[int, ...]
    degree: int
    order: int | None
    equation: nmod_mpoly

    @property
    def kind(self) -> Kind:
        """What two components have to differ in if they are to be told apart."""
        return self.exponents, self.degree

    def roots(self, t: int) -> list[int]:
        """The points u in GF(p) that it has at this t."""
        p = int(self.equation.context().modulus())
        on_line = [0] * (self.degree + 1)
        for (i, j), c in self.equation.terms():
            on_line[j] += int(c) * pow(t, i, p)
        return [int(u) for u, _ in nmod_poly(on_line, p).roots()]


def components(
    equation: Equation, forms: Sequence[tuple[Any, bool]], curve: Sequence[nmod_poly], direction: Sequence[int]
) -> list[Component]:
    """The components of the zeros of forms on the surface curve(t) + u direction, in projective space over GF(p).

    With each of the forms over Q stands whether it is one at the image of the point under the map of the equation.
    `direction` is a random vector: then degrees are those of hypersurfaces. Exact for the surface. Raises BadPrime.
    """
    field = GF(equation.over.characteristic)
    ring = nmod_mpoly_ctx.get(("t", "u"), modulus=field.prime, ordering=Ordering.degrevlex)
    X = [
        ring.from_dict({(k, 0): int(c) for k, c in enumerate(entry.coeffs())}) + ring.gen(1) * w
        for entry, w in zip(curve, direction, strict=True)
    ]
    image = equation.image(X, ring.constant(0))
    common = reduce(nmod_mpoly.gcd, image)
    image = [entry / common for entry in image]
    found: dict[str, tuple[nmod_mpoly, list[int]]] = {}
    for k, (form, is_there) in enumerate(forms):
        value = modulo(form, field).compose(*(image if is_there else X), ctx=ring)
        for factor, exponent in value.factor()[1]:
            _, exponents = found.setdefault(str(factor), (factor, [0] * len(forms)))
            exponents[k] = int(exponent)
    return [
        Component(
            tuple(exponents),
            int(factor.degrees()[1]),
            min((int(power[0]) for power in factor.monoms() if power[1] == 0), default=None),
            factor,
        )
        for factor, exponents in found.values()
        if factor.degrees()[1]
    ]
