"""Geometry of the level sets of a member of the family: j-invariants, translation points, rotation numbers, heights.

In each plane of the normal form the orbit stays on a plane cubic, whose Jacobian is Y^2 = x^3 + (9 + 3 gamma) x^2 +
48 gamma x + 64 gamma^2, and the Kahan map is the translation by T = (0, 8 gamma) (level_curves.py). So the level set
of all integrals is a product of elliptic curves, on which the map is a translation. Proofs: docs/mathematics.md,
"Geometry of the level sets".
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from flint import acb, arb, fmpq

from kahanmaps.algebra.elliptic_curves import MAX_BITS, AffinePoint, canonical_height, complex_roots, rotation_number
from kahanmaps.algebra.fields import QQ, RR, rational
from kahanmaps.algebra.printing import format_number
from kahanmaps.algebra.reduction import BadPrimes, bad_primes_of_plane
from kahanmaps.display_protocols import PrintableResult
from kahanmaps.errors import InputError, PrecisionLost
from kahanmaps.family.planar import NormalForm
from kahanmaps.family.system_normal_form import SystemNormalForm
from kahanmaps.maps.convention import either, resolve_eps
from kahanmaps.maps.kahan import SystemLike, as_map
from kahanmaps.maps.normal_form.closure import Closure, closure
from kahanmaps.maps.normal_form.level_curves import Jacobian
from kahanmaps.maps.normal_form.periods import PeriodKind, classify, torsion_order
from kahanmaps.maps.normal_form.planar_block import PlanarBlock, Triple
from kahanmaps.maps.normal_form.plane_heights import plane_height, value_at_root
from kahanmaps.maps.normal_form.splitting import Plane, Splitting
from kahanmaps.maps.orbits.relations.orbit_curve import OrbitCurve, orbit_curve
from kahanmaps.maps.values import as_point

_ACCURACY = 1e-15  # accuracy of rotation numbers
_RELATIVE_ACCURACY = 1e-12  # relative accuracy of phase errors
_HEIGHT_ACCURACY = 1e-12  # accuracy of heights that are printed without an error
_MAX_HEIGHT_DEGREE = 4  # largest degree of fields over which heights are computed
_MAX_GAMMA_BITS = 4000  # largest number of bits of gamma for which a height is computed


@dataclass(frozen=True)
class Rotation:
    """The rotation of an orbit on its level curve at one real root, or at one pair of complex roots, of chi.

    `number` is the rotation number in (0, 1/2], up to sign: `steps` steps of the map rotate the circle by this part of
    a turn. `steps` is 2 if the level curve has two real components that the map exchanges, otherwise 1. At complex
    roots the orbit lies on a real torus of dimension 2, and `numbers` are the coordinates of the translation in a
    reduced basis of the periods. `flow` is the rotation number of the flow for the time 2 eps. `phase_error` is
    `number` minus `flow`, the error of the phase in one step; it is None if the level of the initial point is singular
    at some smaller eps. If the closed level curve has two components, `component` says which of them contains the
    initial point: "oval" or "unbounded".
    """

    root: str
    numbers: tuple[arb, ...]
    steps: int = 1
    flow: arb | None = None
    phase_error: arb | None = None
    component: str | None = None

    @property
    def number(self) -> arb:
        return self.numbers[0]


@dataclass(frozen=True)
class PlaneGeometry:
    """The geometry of an orbit in the planes at the roots of one irreducible factor of chi.

    `delta` = disc(h) level^2, `gamma` = 1 - delta and the j-invariant lie in the field of the root; they are None if
    the level is not smooth. The Jacobian of the level curve is Y^2 = x^3 + (9 + 3 gamma) x^2 + 48 gamma x + 64 gamma^2.
    On it the map is the translation by `point`. `order` is the order of the translation, None if it is infinite
    (proved). `height` is the canonical height of the translation point (absolute, if the root is not rational), with an
    error of at most `height_error`. `degree` is the degree of the field.
    """

    name: str
    kind: PeriodKind
    delta: Any = None
    gamma: Any = None
    j: Any = None
    order: int | None = None
    reason: str = ""
    height: float | None = None
    rotations: tuple[Rotation, ...] = ()
    height_error: float = _HEIGHT_ACCURACY
    degree: int = 1
    bad_primes: BadPrimes | None = None

    @property
    def discriminant(self) -> Any:
        """The discriminant of the Weierstrass equation; None if the level is not smooth."""
        return None if self.gamma is None else -110592 * self.gamma**3 * self.delta**2

    @property
    def point(self) -> AffinePoint | None:
        """The translation point on the Weierstrass equation; None if the level is not smooth."""
        return None if self.gamma is None else (0 * self.gamma, 8 * self.gamma)

    def lines(self) -> list[str]:
        """Return the lines of the text output."""
        lines = [f"plane {self.name}\t{self.kind}"]
        if self.j is None or self.point is None or self.bad_primes is None:
            return lines
        order_text = "infinite order" if self.order is None else f"order {self.order}"
        minimal_discriminant = self.bad_primes.minimal_discriminant
        lines += [
            f"  k^3\t{_text(self.delta)}",
            f"  Weierstrass model\tY^2 = x^3 + (9 + 3 g) x^2 + 48 g x + 64 g^2, g = 1 - k^3 = {_text(self.gamma)}",
            f"  j-invariant\t{_text(self.j)}",
            f"  discriminant\t{_text(self.discriminant)}"
            + ("" if minimal_discriminant is None else f", minimal {minimal_discriminant}"),
            f"  bad primes\t{self.bad_primes.text}" + (" (the primes of Q below them)" if self.degree > 1 else ""),
            f"  translation\t({', '.join(map(_text, self.point))}), {order_text} (proved: {self.reason})",
        ]
        if self.height is not None:
            is_accurate = self.height_error <= _HEIGHT_ACCURACY
            height_text = f"{self.height:.10g}" if is_accurate else f"{self.height:.5g} +/- {self.height_error:.1g}"
            lines.append(f"  canonical height\t{height_text}")
        for rotation in self.rotations:
            note = ", of the second iterate: the map exchanges two real components" if rotation.steps == 2 else ""
            if len(rotation.numbers) == 2:
                note = ", on a connected torus of real dimension 2"
            numbers_text = ", ".join(x.str(12) for x in rotation.numbers)
            lines.append(f"  rotation number\t{numbers_text} at t = {rotation.root}{note}")
            if rotation.component is not None:
                lines.append(f"    initial point\ton the {rotation.component} component")
            if rotation.flow is not None:
                lines.append(f"    of the flow\t{rotation.flow.str(12)}")
            if rotation.phase_error is not None:
                lines.append(f"    phase error\t{rotation.phase_error.str(12)} turns per step")
        return lines

    def to_json(self) -> dict[str, Any]:
        """Return plain data; exact numbers are given as text."""
        names = ("delta", "gamma", "j", "discriminant")
        exact_texts = {name: None if (x := getattr(self, name)) is None else _text(x) for name in names}
        rotations = [
            {
                "root": rotation.root,
                "steps": rotation.steps,
                "numbers": [x.str(15) for x in rotation.numbers],
                "flow": None if rotation.flow is None else rotation.flow.str(15),
                "phase_error": None if rotation.phase_error is None else rotation.phase_error.str(15),
                "component": rotation.component,
            }
            for rotation in self.rotations
        ]
        summary = {"name": self.name, "kind": self.kind.name.lower(), "order": self.order, "reason": self.reason}
        return {
            **summary,
            **exact_texts,
            "point": None if self.point is None else [_text(x) for x in self.point],
            "bad_primes": None if self.bad_primes is None else self.bad_primes.to_json(),
            "height": self.height,
            "height_error": self.height_error,
            "rotations": rotations,
        }


@dataclass(frozen=True)
class LevelGeometry(PrintableResult):
    """The geometry of the level set of the integrals through a point, and of the map on it.

    The n-th iterate has about `height_constant` n^2 bits for large n, if all levels are smooth. `closure` says whether
    the orbit is dense in the real components that it visits; None if the orbit is fixed or a level is singular.
    """

    planes: tuple[PlaneGeometry, ...]
    height_constant: float | None
    closure: Closure | None = None

    @property
    def components(self) -> int | None:
        """The number of components of the real level set with its points at infinity; None if a level is singular.

        If there are several, the orbit alternates between two: the map exchanges the components in a plane with two.
        """
        if any(plane.kind is not PeriodKind.SMOOTH for plane in self.planes):
            return None
        return math.prod(rotation.steps for plane in self.planes for rotation in plane.rotations)

    @property
    def rank(self) -> int | None:
        """The rank of the group of translations that the commuting maps generate; None if a level is singular.

        It is the number of roots of chi at which the translation has infinite order.
        """
        if any(plane.kind not in (PeriodKind.SMOOTH, PeriodKind.FIXED) for plane in self.planes):
            return None
        return sum(plane.degree for plane in self.planes if plane.kind is PeriodKind.SMOOTH and plane.order is None)

    @property
    def text(self) -> str:
        lines = [line for plane in self.planes for line in plane.lines()]
        if self.rank is not None:
            field_text = "over the splitting field of chi they " if any(p.degree > 1 for p in self.planes) else ""
            lines.append(f"commuting maps\t{field_text}generate a group of translations of rank {self.rank} (proved)")
        if self.components is not None:
            visits_texts = {1: "", 2: ", the orbit visits both in turn"}
            visits_text = visits_texts.get(self.components, ", the orbit visits two of them in turn")
            lines.append(f"real components\t{self.components}{visits_text}")
        if self.closure is not None:
            lines.append(f"orbit\t{self.closure.text}")
        if self.height_constant is not None:
            condition_text = (
                "" if sum(plane.degree for plane in self.planes) == 1 else ", if planes have no long common factors"
            )
            lines.append(f"heights\t{self.height_constant:.8g} n^2 bits, asymptotically{condition_text}")
        return "\n".join(lines)

    def to_json(self) -> dict[str, Any]:
        """Return plain data; exact numbers are given as text."""
        return {
            "planes": [plane.to_json() for plane in self.planes],
            "rank": self.rank,
            "components": self.components,
            "closure": None if self.closure is None else self.closure.to_json(),
            "height_constant": self.height_constant,
        }


def geometry(
    system: SystemLike,
    start: Sequence[Any] | None = None,
    eps: Any = None,
    *,
    x0: Sequence[Any] | None = None,
    time_step: Any = None,
    h: Any = None,
) -> LevelGeometry | OrbitCurve:
    """Return the geometry of the level set or curve on which the orbit of `start` lies.

    Args:
        system: a system, which stands for its Kahan map, or a map.
        start, x0: a point with exact coordinates.
        eps, time_step, h: half the time step, or the time step; exact and not 0. A map without eps needs none.

    Returns:
        For a member of the commuting family, or a system that is linearly equivalent to a member, a `LevelGeometry`:
        the product of the curves in its planes. Otherwise an `OrbitCurve`: the curve of genus 1 or 0 that contains the
        orbit. j-invariants and orders of translations are exact, rotation numbers are balls.

    Raises:
        InputError: if the start or eps is missing, or if the system is no member and the orbit is finite.
        UnknownCurve: if no curve was found that contains the orbit.

    Source: docs/mathematics.md, "Geometry of the level sets" and "Orbits on elliptic curves".

    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> plane = geometry(QuadraticSystem.from_text(["x", "y"], ["3*y^2", "-3*x^2"]), [1, 2], "1/10").planes[0]
    >>> plane.delta, plane.order, plane.rotations[0].number.str(8, radius=False)
    (-2187/46225, None, '0.17182562')
    """
    family, start, eps = as_map(system), either(start=start, x0=x0), resolve_eps(eps, time_step, h)
    if start is None or (eps is None and family.has_eps):
        raise InputError("found no initial point or no eps, expected x0=[...] and eps=, exact numbers")
    start = as_point(start, family.variables)
    if eps is not None and rational(eps) == 0:
        raise InputError("found eps = 0, expected a nonzero number: at 0 the map is the identity")
    file = import_module("kahanmaps.documents.inline").as_file(system)
    normal_form = file.normal_form  # if the file declares a matrix A, the normal form uses this A
    if isinstance(normal_form, SystemNormalForm):
        return geometry_of(normal_form, eps, start)
    return orbit_curve(family.at(fmpq(1) if eps is None else eps, QQ), start, family, list(file.integrals.values()))


def geometry_of(normal_form: SystemNormalForm | NormalForm, eps: Any, start: Sequence[Any]) -> LevelGeometry:
    """Return the geometry for a system whose normal form is given; see `geometry`."""
    planes = []
    for plane, triple, kind, gamma, rotations in _plane_levels(normal_form, eps, start):
        if kind is not PeriodKind.SMOOTH:
            planes.append(PlaneGeometry(plane.name, kind, degree=plane.degree))
            continue
        delta = 1 - gamma
        order, reason = torsion_order(gamma)
        height_ball: arb | None = None
        is_rational = isinstance(gamma, fmpq)
        bits = gamma.height_bits() if is_rational else max(x.height_bits() for x in gamma.coefficients)
        if order is not None:
            height_ball = arb(0)
        elif bits <= _MAX_GAMMA_BITS and is_rational:
            curve = Jacobian(gamma)
            height_ball = canonical_height(curve, curve.T)
        elif bits <= _MAX_GAMMA_BITS and plane.degree <= _MAX_HEIGHT_DEGREE:
            height_ball = plane_height(plane.block, triple)
        j = 27 * delta * (delta + 8) ** 3 / (delta - 1) ** 3
        height_value = None if height_ball is None else float(height_ball.mid())
        height_error = _HEIGHT_ACCURACY if height_ball is None else max(_HEIGHT_ACCURACY, float(height_ball.rad()))
        bad_primes = bad_primes_of_plane(gamma)
        last_fields = rotations, height_error, plane.degree, bad_primes
        planes.append(PlaneGeometry(plane.name, kind, delta, gamma, j, order, reason, height_value, *last_fields))
    # A plane cubic is embedded by a divisor of degree 3, and heights of the planes add up: docs/mathematics.md.
    moving_planes = [plane for plane in planes if plane.kind is not PeriodKind.FIXED]
    height_constant, orbit_closure = None, None
    heights = [3 * plane.degree * plane.height for plane in moving_planes if plane.height is not None]
    if moving_planes and len(heights) == len(moving_planes):
        height_constant = sum(heights) / math.log(2)
    if moving_planes and all(plane.kind is PeriodKind.SMOOTH for plane in moving_planes):
        gammas, orders = [plane.gamma for plane in moving_planes], [plane.order for plane in moving_planes]
        all_rotations = [rotation for plane in moving_planes for rotation in plane.rotations]
        orbit_closure = closure(gammas, orders, [number for rotation in all_rotations for number in rotation.numbers])
    return LevelGeometry(tuple(planes), height_constant, orbit_closure)


def rotation_numbers(normal_form: SystemNormalForm | NormalForm, eps: Any, start: Sequence[Any]) -> dict[str, Rotation]:
    """Return the rotations on the level set through `start`, by the root of chi (text); singular levels are omitted.

    Raises PrecisionLost if a level is almost singular.
    """
    return {
        rotation.root: rotation for *_, rotations in _plane_levels(normal_form, eps, start) for rotation in rotations
    }


def _plane_levels(
    normal_form: SystemNormalForm | NormalForm, eps: Any, start: Sequence[Any]
) -> Iterator[tuple[Plane, Triple, PeriodKind, Any, tuple[Rotation, ...]]]:
    """Yield tuples (plane, initial point in it, kind of the level curve, gamma, rotations on a smooth level)."""
    form: Any = getattr(normal_form, "form", normal_form)
    splitting = Splitting(form, QQ, eps, getattr(normal_form, "T", None))
    for plane, triple in zip(splitting.planes, splitting.triples([QQ.convert(x) for x in start]), strict=True):
        kind, gamma = classify(plane.block, triple)
        rotations: tuple[Rotation, ...] = ()
        if kind is PeriodKind.SMOOTH:
            rotations = rotations_of(gamma, plane.block, triple, plane.name)
        yield plane, triple, kind, gamma, rotations


def _text(x: Any) -> str:
    """Return an element of Q or of Q[t]/g as text."""
    return format_number(x) if isinstance(x, fmpq) else str(x)


# Rotation numbers.


def rotations_of(gamma: Any, block: PlanarBlock, point: Triple, name: str) -> tuple[Rotation, ...]:
    """Return the rotations at each real root and each pair of complex roots of the field of gamma.

    Args:
        gamma: an element of Q or of Q[t]/g, not 0 and not 1.
        block: the cubic of the plane.
        point: a point (U : V : 1) of the level, where (U, V) = 2 eps (u, v).
        name: the name of the plane, for a plane over Q.

    Raises PrecisionLost if 32768 bits do not suffice.
    """
    (U, V, _), (p, q, r) = point, block.D
    exact_values = gamma, block.discriminant, block.h(U, V), p * U * U + q * U * V + r * V * V
    for bits in (128, 512, 2048, 8192, MAX_BITS):
        with RR(bits).working(), suppress(PrecisionLost):
            rotations = []
            if isinstance(gamma, fmpq):
                rotations.append(_real_rotation(*map(arb, exact_values), root=name.removeprefix("t = ")))
            else:
                roots: Any = gamma.field.chi.complex_roots()
                for root in (acb(root) for root, _ in roots if not root.imag < 0):
                    is_real, label = root.imag == 0, root.str(8, radius=False)
                    values = [value_at_root(x, root.real if is_real else root) for x in exact_values]
                    rotations.append(
                        _real_rotation(*values, root=label)
                        if is_real
                        else Rotation(label, _complex_rotation(values[0]))
                    )
            balls = [x for rotation in rotations for x in (*rotation.numbers, rotation.flow) if x is not None]
            errors = [rotation.phase_error for rotation in rotations if rotation.phase_error is not None]
            if all(x.is_finite() and float(x.rad()) < _ACCURACY for x in balls) and (
                bits == MAX_BITS or all(x.rad() < _RELATIVE_ACCURACY * abs(x) for x in errors)
            ):
                return tuple(rotations)
    raise PrecisionLost(
        f"the rotation numbers need more than {MAX_BITS} bits, since the level is almost singular: choose an initial "
        "point or eps with fewer digits"
    )


def _real_rotation(gamma: arb, disc: arb, h: arb, D: arb, *, root: str) -> Rotation:
    """Return the rotation at a real root of chi."""
    curve = Jacobian(gamma)
    # For gamma < 0 the cubic polynomial of the Jacobian has three real roots, and T lies on the oval.
    number, steps = rotation_number(curve, curve.T, has_oval=not gamma > 0)
    # On a level of h, p = -D satisfies p'^2 = 4 p^3 - 27 disc(h) h^2 along the flow u' = h_v, v' = -h_u. If h has three
    # real roots, p has three poles in a period, one at each point at infinity of the level.
    g3, one_third = 27 * disc * h * h, arb(1) / 3
    unit_period = one_third.gamma() ** 3 / (2 * arb.pi())  # the period of p'^2 = 4 p^3 - 1
    period = unit_period / abs(g3).root(6)
    flow = 1 / (3 * period) if g3 > 0 else 1 / (period * arb(3).sqrt())
    phase_error, component = None, None
    if not (D + 1 > 0 or D + 1 < 0) or (steps == 2 and not (D + 3 > 0 or D + 3 < 0)):
        raise PrecisionLost("the position of the point on its level cannot be decided")
    if steps == 2:
        component = "oval" if D + 3 > 0 else "unbounded"
    elif D + 1 > 0:  # gamma > 0 for all smaller eps, and 0 < number < 1/2 is a continuous function of eps
        phase_error = number - flow
    return Rotation(root, (number,), steps, flow, phase_error, component)


def _complex_rotation(gamma: acb) -> tuple[arb, arb]:
    """Return the coordinates of T in a reduced basis of the periods."""
    a, b, c = sorted((-root for root in complex_roots(Jacobian(gamma))), key=lambda e: (e.real.mid(), e.imag.mid()))
    zero = acb(0)
    omega1, omega2 = (2 * acb.elliptic_rf(zero, *pair) for pair in ((b - a, c - a), (a - b, c - b)))
    while True:  # Gauss's reduction of a binary quadratic form
        if abs(omega1) > abs(omega2):
            omega1, omega2 = omega2, omega1
        quotient = (omega2 / omega1).real
        if not quotient.is_finite():
            raise PrecisionLost("the periods are too inaccurate")
        multiple = round(float(quotient.mid()))
        if not multiple:
            break
        omega2 = omega2 - multiple * omega1
    elliptic_logarithm = acb.elliptic_rf(a, b, c)
    area = (omega1.conjugate() * omega2).imag
    x, y = (elliptic_logarithm.conjugate() * omega2).imag / area, (omega1.conjugate() * elliptic_logarithm).imag / area
    return tuple(z - round(float(z.mid())) for z in (x, y))  # type: ignore[return-value]
