"""The n-th iterate of a Kahan map, computed directly, for members of the family.

In every plane of the normal form the map is a translation on a plane cubic, so the n-th iterate takes about log2(n)
doublings: over Q in integers (`tau`), over GF(p), Q[t]/g and balls with field elements (`translation`). Poles at
earlier steps are detected only over Q.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from kahanmaps.algebra.fields import QQ, BallField, Field, PrimeField
from kahanmaps.errors import BadPrime, InputError, PrecisionLost, SingularStep

if TYPE_CHECKING:
    from kahanmaps.family.system_normal_form import SystemNormalForm
    from kahanmaps.maps.normal_form.planar_block import PlanarBlock, Triple
    from kahanmaps.maps.normal_form.planes_point import PlanesPoint
    from kahanmaps.maps.normal_form.rational_iterate import OrbitInPlanes

_MAX_CYCLE = 2 * 10**6  # the longest orbit in a plane over a small field of which all points are computed


class NthIterate:
    """Iterates of Phi(., eps) over QQ, GF(p) or real balls in a normal form; the time step is 2 eps.

    Raises BadPrime if the normal form has no reduction modulo p.

    >>> from kahanmaps.algebra.fields import GF
    >>> from kahanmaps.family.random_members import random_member_with_eigenvalues
    >>> from kahanmaps.family.system_normal_form import system_normal_form
    >>> normal_form = system_normal_form(random_member_with_eigenvalues([1, -2, 3], seed=7).chosen.system)
    >>> NthIterate(normal_form, "1/10", GF(10**9 + 7)).value([1, 2, 3, 4, 5, 6], 10**30)[0]
    946728668
    """

    def __init__(self, normal_form: SystemNormalForm, eps: Any, field: Field) -> None:
        self.normal_form, self.field = normal_form, field
        self.eps = field.convert(eps)
        if field.characteristic == 2:
            raise BadPrime("2 eps = 0 modulo 2, where the coordinates are 2 eps (u, v): use another prime", 2)
        from kahanmaps.maps.normal_form.splitting import Splitting

        self.splitting = Splitting(normal_form.form, field, self.eps, normal_form.T)
        self._cached_orbit: tuple[Any, OrbitInPlanes] | None = None  # the last orbit over Q, with its arguments

    def value(self, start: Sequence[Any], n: int, max_bits: int | None = None) -> PlanesPoint | tuple[Any, ...]:
        """Return Phi^n(start) for n >= 0: over Q as a PlanesPoint, over other fields as its coordinates.

        Raises SingularStep if the map is not defined at a step: over Q at any step, over other fields at one of the
        first few steps or the last. Raises PrecisionLost for balls that are too wide and, over Q, OverBudget if numbers
        of more than `max_bits` bits occur before step n and before a pole.
        """
        if n < 0:
            raise InputError(f"found the step {n}, expected 0 or more (for the inverse map, change the sign of eps)")
        if self.field is QQ:
            from kahanmaps.maps.normal_form.rational_iterate import OrbitInPlanes

            key = (tuple(start), max_bits)
            if self._cached_orbit is None or self._cached_orbit[0] != key:
                self._cached_orbit = key, OrbitInPlanes(self.normal_form, self.eps, start, max_bits)
            return self._cached_orbit[1].value(n)
        with self.field.working():
            x = [self.field.convert(entry) for entry in start]
            triples = []
            for plane, triple in zip(self.splitting.planes, self.splitting.triples(x), strict=True):
                triples.append(self._point_in_plane(plane.block, triple, n))
                if self.field.is_zero(triples[-1][2]):
                    raise SingularStep(f"the map has a pole: its iterate {n} is not defined at the initial point")
            return self.splitting.point(triples)

    def _point_in_plane(self, block: PlanarBlock, start: Triple, n: int) -> Triple:
        """Return the n-th point P_n of the orbit of `start` in the plane, over a field other than Q."""
        from kahanmaps.maps.normal_form import translation

        if block.is_zero or (start[0] == 0 and start[1] == 0):
            return start
        is_inexact = isinstance(self.field, BallField)
        if not (isinstance(self.field, PrimeField) and self.field.prime < 5):
            try:
                return translation.iterate(block, start, n, self.field.is_zero, inexact=is_inexact)
            except translation.NoTranslation:
                if is_inexact:
                    raise PrecisionLost("the orbit meets special positions that balls cannot decide") from None
        from kahanmaps.maps.normal_form.planar_block import same_point
        from kahanmaps.maps.normal_form.rational_iterate import point_by_steps

        # Over a small finite field an orbit soon returns or reaches a pole.
        point = start
        for k in range(1, n + 1):
            if k > _MAX_CYCLE:
                raise InputError(f"the iterate {n} cannot be reached directly here: use fewer steps or another prime")
            point = point_by_steps(block, point, 1)
            if same_point(point, start):
                return point_by_steps(block, start, n % k)
        return point


def special_start(normal_form: SystemNormalForm, eps: Any, start: Sequence[Any]) -> str:
    """Return why the orbit of a rational initial point is special in a plane, or ""; balls cannot decide this.

    It is special if the initial point is a fixed point in the plane, or on a singular level cubic (delta is 0 or 1).
    """
    from kahanmaps.maps.normal_form.splitting import Splitting

    splitting = Splitting(normal_form.form, QQ, eps, normal_form.T)
    for plane, (U, V, W) in zip(splitting.planes, splitting.triples([QQ.convert(x) for x in start]), strict=True):
        numerator, denominator = plane.block.level((U, V, W))
        if plane.block.is_zero or (U == 0 and V == 0):
            return f"the initial point is fixed in the plane {plane.name}"
        if denominator == 0 or numerator == 0 or plane.block.discriminant == 0:
            return f"the initial point is on a singular level in the plane {plane.name}"
        if plane.block.discriminant * numerator * numerator == denominator * denominator:
            return f"the initial point is on three lines in the plane {plane.name}"
    return ""
