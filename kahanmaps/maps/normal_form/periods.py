"""The exact period of an orbit of a family member: over GF(p) without computing the orbit, over Q with a proof.

In every plane of the normal form the Kahan map is a translation of the level cubic (planar_block.py). Its period is the
order of the point T = (0, 0) of the Jacobian y^2 + 6xy + 16 gamma y = x^3 + 3 gamma x^2, for all points of a level.
Over a field of q elements the Hasse interval q + 1 +- 2 sqrt(q) contains a multiple of this order. About q^(1/4) baby
steps and as many giant steps find this multiple; in large fields Schoof's algorithm first narrows the interval. The
period of the orbit is the least common multiple of the periods in the planes.

The translation is also defined at the poles of the map, where W = 0. The program also decides whether an orbit meets a
pole. On a smooth level the poles are the points (U : V : 0) with h(U, V) = 0. If h has no root in the field, there is
no pole. Otherwise the orbit of P meets a pole if and only if P - (U : V : 0) is a multiple of T for a pole (U : V : 0).

On singular level cubics the period is elementary: see `PeriodKind`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from importlib import import_module
from math import lcm
from typing import Any

from flint import fmpq, fmpz, fmpz_mod_ctx, fmpz_mod_poly_ctx, fq_default_ctx, fq_default_poly_ctx

from kahanmaps.algebra.fields import GF, QQ, integer
from kahanmaps.algebra.printing import all_fields
from kahanmaps.display_protocols import PrintableResult
from kahanmaps.errors import InputError
from kahanmaps.family.planar import NormalForm
from kahanmaps.family.system_normal_form import NoNormalForm, SystemNormalForm
from kahanmaps.maps.convention import either, resolve_eps
from kahanmaps.maps.kahan import SystemLike
from kahanmaps.maps.normal_form.level_curves import Jacobian, LevelCubic, translation_order
from kahanmaps.maps.normal_form.planar_block import PlanarBlock, Triple, same_point
from kahanmaps.maps.normal_form.splitting import Splitting
from kahanmaps.maps.values import coordinates
from kahanmaps.systems.quadratic import as_system

LARGEST_FIELD = 1 << 192  # number of elements; a period over such a field takes a minute or two
_MAX_STEPS = 1 << 16  # number of steps taken if no theorem gives the answer
_MAX_AGREEING_PRIMES = 8  # if T has the same order modulo this number of primes, the order is tested over Q or Q[t]/g


class PeriodKind(StrEnum):
    """The type of the level cubic of a plane, which determines how the period modulo p > 3 is computed."""

    FIXED = "a fixed point"  # period 1
    SMOOTH = "a smooth level cubic"  # delta is not 0, 1 or infinite; the period is the order of T
    ADDITIVE = "a level with delta = 0"  # a parabolic map: period p, over Q no period
    TRIANGLE = "a level with delta = 1, three lines"  # Psi^3 multiplies by -8 along a line: 3 ord(-8), over Q none
    VERTEX = "a vertex of the three lines"  # period 3
    AT_POLE = "a pole at the start"  # W (W^2 + D) = 0, a conic and a line: period 4
    UNDEFINED = "an initial point where the map is not defined"  # a base point of the levels, or disc(h) = 0: no period
    STEPPED = "characteristic 2 or 3"  # the period is found by iteration


@dataclass(frozen=True)
class PlanePeriod:
    """The period in one plane, over a field of `q` elements (0 means characteristic 0).

    `period` is None if there is none (`status` "aperiodic" or "undefined") or it was not found ("undecided").
    `meets_pole` says whether the orbit reaches a pole of the map or starts at one; None if this is not known.
    """

    name: str
    q: int
    kind: PeriodKind
    status: str
    period: int | None
    meets_pole: bool | None
    reason: str = ""

    @property
    def text(self) -> str:
        """The result as one line."""
        result_text = f"period {self.period}" if self.period is not None else self.status
        return f"{self.name}: {result_text} ({self.kind}{'; ' + self.reason if self.reason else ''})"


@dataclass(frozen=True)
class OrbitPeriod(PrintableResult):
    """The period of an orbit that is continued through poles: the least common multiple of its periods in the planes.

    `status` is "periodic", "aperiodic" (proved), "undefined" (in some plane the map is not defined at the initial
    point and cannot be continued there) or "undecided". If `meets_pole` is False, `period` is the exact period of the
    map itself. If it is True, the orbit of the map ends at the pole. None means that this is not known.
    """

    period: int | None
    status: str
    meets_pole: bool | None
    planes: tuple[PlanePeriod, ...]

    def rows(self) -> list[dict[str, Any]]:
        """Return one row for each plane, for example for `pandas.DataFrame(period.rows())`."""
        return [{"plane": plane.name, "status": plane.status, "period": plane.period} for plane in self.planes]

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        return all_fields(self)

    @property
    def text(self) -> str:
        """A sentence, followed by one line for each plane."""
        if self.period is None:
            sentence = {
                "aperiodic": "the orbit has no period",
                "undefined": "the orbit reaches a point where the map is not defined and cannot be continued",
            }.get(self.status, "the period was not found")
        elif self.meets_pole is False:
            sentence = f"the orbit has period {self.period} and meets no pole of the map"
        elif self.meets_pole:
            sentence = f"continued through its poles the orbit has period {self.period}; the map itself stops at a pole"
        else:
            sentence = f"continued through its poles, if it meets any, the orbit has period {self.period}"
        return "\n".join([sentence, *(plane.text for plane in self.planes)])


def orbit_period(
    form: NormalForm, eps: Any, start: Sequence[Any], prime: int, *, largest: int = LARGEST_FIELD
) -> OrbitPeriod:
    """Compute the exact period modulo p of the orbit of `start` under the Kahan map at `eps`, half the time step.

    In a plane over a field of more than `largest` elements, the period is "undecided". Raises BadPrime if the normal
    form has no reduction modulo p, InputError if the initial point has another dimension.

    >>> from kahanmaps.family.random_members import random_member_with_eigenvalues
    >>> from kahanmaps.family.planar import normal_form
    >>> form = normal_form(random_member_with_eigenvalues([1, -2], seed=7))
    >>> period = orbit_period(form, "1/10", ["1/2", "-1/3", 0, 1], 2**31 - 1)
    >>> period.period, period.meets_pole
    (85400488827489215, True)
    """
    return period_of(form, eps, start, prime, largest=largest)


# Status, period, and whether a pole is met, for those kinds for which they do not depend on the field.
_PERIOD_OF_KIND = {
    PeriodKind.FIXED: ("periodic", 1, False),
    PeriodKind.UNDEFINED: ("undefined", None, True),
    PeriodKind.AT_POLE: ("periodic", 4, True),
    PeriodKind.VERTEX: ("periodic", 3, False),
}


def plane_period(
    block: PlanarBlock,
    point: Triple,
    prime: int,
    context: fq_default_ctx | None = None,
    *,
    name: str = "the plane",
    largest: int = LARGEST_FIELD,
) -> PlanePeriod:
    """Compute the period of `point` = (U : V : 1) under the map Psi of a block over GF(p) or its extension `context`.

    >>> from flint import nmod
    >>> block = PlanarBlock(*(nmod(c, 10007) for c in (1, 0, 2, 1)))
    >>> plane_period(block, (nmod(3, 10007), nmod(4, 10007), nmod(1, 10007)), 10007).text
    'the plane: period 3347 (a smooth level cubic)'
    """
    q = prime if context is None else int(context.order())
    if prime <= 3:  # the theory of the level cubic excludes 2 and 3: iterate homogeneous coordinates, through poles
        kind, image, has_met_pole = PeriodKind.STEPPED, point, bool(block.level(point)[1] == 0)
        for step in range(1, min(q * q + q + 1, _MAX_STEPS) + 1):
            image = block.image(image)
            if all(entry == 0 for entry in image):
                return PlanePeriod(name, q, kind, "undefined", None, True, f"not defined after {step} steps")
            has_met_pole = has_met_pole or bool(image[2] == 0)
            if same_point(image, point):
                return PlanePeriod(name, q, kind, "periodic", step, has_met_pole)
        reason = f"no return to the initial point within {_MAX_STEPS} steps"
        return PlanePeriod(name, q, kind, "undecided", None, has_met_pole or None, reason)
    kind, gamma = classify(block, point)
    if kind in _PERIOD_OF_KIND:
        return PlanePeriod(name, q, kind, *_PERIOD_OF_KIND[kind])
    if kind is PeriodKind.ADDITIVE:
        # A step decreases W/s by 1, where s^2 = -D: the orbit meets a pole if and only if W/s is in GF(p).
        a, b, c = block.D
        (U, V, W), meets_pole = point, False
        if (D := a * U * U + b * U * V + c * V * V) != 0:
            square = -W * W / D
            meets_pole = bool(square ** ((prime - 1) // 2) == square * 0 + 1)
        return PlanePeriod(name, q, kind, "periodic", prime, meets_pole)
    poles_of_block = poles(block, prime, context)
    if kind is PeriodKind.TRIANGLE:
        order = prime - 1  # a multiple of the order of -8; superfluous prime factors are removed below
        for factor, exponent in fmpz(order).factor():
            for _ in range(exponent):
                if pow(-8, order // int(factor), prime) != 1:
                    break
                order //= int(factor)
        meets_pole_at = _meets_pole_by_iteration(block, point, 3 * order) if poles_of_block else False
        return PlanePeriod(name, q, kind, "periodic", 3 * order, meets_pole_at)
    if q > largest:
        size_text, bound_text = (str(n) if n < 10**6 else f"about 2^{n.bit_length() - 1}" for n in (q, largest))
        reason = f"its field has {size_text} elements, more than {bound_text}"
        return PlanePeriod(name, q, kind, "undecided", None, None if poles_of_block else False, reason)
    order = translation_order(gamma, q, context)
    # With a pole as zero of the group, T is the image of the pole, and the orbit meets the pole if and only if the
    # point is a multiple of T.
    pole_answers: list[bool | None] = []
    for pole in poles_of_block:
        pole_answers.append(
            LevelCubic(block, *block.level(point), pole).is_multiple(point, block.image(pole), order, q)
        )
        if pole_answers[-1]:
            break
    else:
        pole_answers.append(_meets_pole_by_iteration(block, point, order) if None in pole_answers else False)
    return PlanePeriod(name, q, kind, "periodic", order, pole_answers[-1])


def classify(block: PlanarBlock, point: Triple) -> tuple[PeriodKind, Any]:
    """Return the kind of a point (U : V : 1) in characteristic 0 or at least 5, and gamma if the level is smooth."""
    numerator, denominator = block.level(point)
    if block.is_zero or (point[0] == 0 and point[1] == 0):
        return PeriodKind.FIXED, None
    disc = block.discriminant
    if denominator == 0:
        return (PeriodKind.UNDEFINED if numerator == 0 or disc == 0 else PeriodKind.AT_POLE), None
    delta = disc * numerator * numerator / (denominator * denominator)
    if delta == 0:
        return (PeriodKind.FIXED if same_point(block.image(point), point) else PeriodKind.ADDITIVE), None
    gamma = 1 - delta
    if gamma == 0:
        image = point
        for _ in range(3):
            image = block.image(image)
        # (0, 0, 0) is not a point, but `same_point` accepts it: it is the image of a base point, never of a vertex.
        is_vertex = any(entry != 0 for entry in image) and same_point(image, point)
        return (PeriodKind.VERTEX if is_vertex else PeriodKind.TRIANGLE), None
    return PeriodKind.SMOOTH, gamma


def poles(block: PlanarBlock, prime: int, context: fq_default_ctx | None = None) -> list[Triple]:
    """Return the points (U : V : 0) with h(U, V) = 0 over GF(p), or over its extension `context`.

    >>> from flint import nmod
    >>> sorted(poles(PlanarBlock(*(nmod(c, 7) for c in (1, 0, 0, 6))), 7), key=str)
    [(1, 1, 0), (2, 1, 0), (4, 1, 0)]
    """
    zero = 0 * block.a
    one = zero + 1
    pole_triples: list[Triple] = [(one, zero, zero)] if block.a == 0 else []
    coefficients: list[Any] = [block.d, block.c, block.b, block.a]
    if context is None:
        ring = fmpz_mod_poly_ctx(fmpz_mod_ctx(prime))
        factors: Any = ring([fmpz(int(c)) for c in coefficients]).factor()[1]
    else:
        factors = fq_default_poly_ctx(context)(coefficients).factor()[1]  # type: ignore[arg-type]
    roots = [-factor[0] for factor, _ in factors if factor.degree() == 1]
    return pole_triples + [(zero + (int(root) if context is None else root), one, zero) for root in roots]


def _meets_pole_by_iteration(block: PlanarBlock, point: Triple, period: int) -> bool | None:
    """Return whether an orbit reaches a pole, by iteration; None if the first `_MAX_STEPS` steps do not decide."""
    image = point
    for _ in range(min(period, _MAX_STEPS)):
        image = block.image(image)
        if image[2] == 0:
            return True
    return None if period > _MAX_STEPS else False


def period_of(
    normal_form: SystemNormalForm | NormalForm,
    eps: Any,
    start: Sequence[Any],
    prime: int | None = None,
    *,
    largest: int = LARGEST_FIELD,
) -> OrbitPeriod:
    """Compute the period of the orbit of `start`, a point in the coordinates of the system, modulo `prime` or over Q.

    `normal_form` is the normal form of the system (family.system_normal_form), or of a member in the same coordinates.
    `prime` is None over Q. All other arguments and the results are as in `orbit_period` and `period_over_rationals`.

    >>> from kahanmaps.family.random_members import random_member_with_eigenvalues
    >>> from kahanmaps.family.system_normal_form import system_normal_form
    >>> normal_form = system_normal_form(random_member_with_eigenvalues([1, -2], seed=7).chosen.system)
    >>> period_of(normal_form, "1/10", ["1/2", "-1/3", 0, 1]).status
    'aperiodic'
    """
    form: Any = getattr(normal_form, "form", normal_form)
    T = getattr(normal_form, "T", None)
    field = QQ if prime is None else GF(prime)
    splitting = Splitting(form, field, eps, T)
    planes = []
    for plane, triple in zip(splitting.planes, splitting.triples([field.convert(x) for x in start]), strict=True):
        if prime is None:
            planes.append(plane_period_over_rationals(plane.block, triple, name=plane.name))
        else:
            planes.append(plane_period(plane.block, triple, prime, plane.context, name=plane.name, largest=largest))
    # The orbit is periodic if and only if it is in every plane; otherwise its status is the worst status of a plane.
    statuses, pole_answers = [plane.status for plane in planes], [plane.meets_pole for plane in planes]
    worst_status = next((s for s in ("undefined", "aperiodic", "undecided") if s in statuses), "periodic")
    return OrbitPeriod(
        lcm(*(plane.period or 1 for plane in planes)) if worst_status == "periodic" else None,
        worst_status,
        True if True in pole_answers else None if None in pole_answers else False,
        tuple(planes),
    )


def period(
    system: SystemLike,
    start: Sequence[Any] | None = None,
    eps: Any = None,
    prime: int | None = None,
    *,
    x0: Sequence[Any] | None = None,
    time_step: Any = None,
    h: Any = None,
) -> OrbitPeriod:
    """Compute the period of an orbit of the Kahan map, modulo a prime or over Q, for a system with a normal form.

    Args:
        system: a system that has a normal form, for example a member of the commuting family.
        start, x0: the initial point, exact numbers.
        eps, time_step, h: half the time step, or the time step 2 eps; exact.
        prime: a prime, for the period modulo this prime; None for the period over Q.

    Returns:
        An `OrbitPeriod`, exact or proved. Raises InputError if there is no normal form, with the reason.

    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> str(period(QuadraticSystem.from_text(["x", "y"], ["2*x*y", "-x^2 - y^2"]), [1, 2], "1/10").status)
    'aperiodic'
    """
    arguments = normal_form_and_start(system, resolve_eps(eps, time_step, h), either(start=start, x0=x0))
    return period_of(*arguments, None if prime is None else integer(prime, "prime"))


def normal_form_and_start(system: SystemLike, eps: Any, start: Any) -> tuple[SystemNormalForm, Any, Sequence[Any]]:
    """Return the normal form, eps and the initial point. Raises InputError if one of these is missing."""
    normal_form = import_module("kahanmaps.documents.inline").as_file(system).normal_form
    if isinstance(normal_form, NoNormalForm):
        raise InputError(f"found no normal form ({normal_form.reason}), expected a system that has one")
    if start is None or eps is None:
        raise InputError("found no initial point or no eps, expected x0=[...] and eps=, exact numbers")
    variables = as_system(system).variables
    return normal_form, eps, coordinates(start, QQ, variables, len(variables))


def period_over_rationals(form: NormalForm, eps: Any, start: Sequence[Any]) -> OrbitPeriod:
    """Compute the period over Q of the orbit of `start` under the Kahan map at `eps`, or prove that it is aperiodic.

    `eps` is half the time step, exact. Reduction modulo an unramified odd prime of good reduction is injective on
    torsion points. So T has infinite order if its orders modulo two such primes differ. If T has the same order n
    modulo all primes tried, the equation n T = 0 is tested over the field itself.

    >>> from kahanmaps.family.random_members import random_member_with_eigenvalues
    >>> from kahanmaps.family.planar import normal_form
    >>> form = normal_form(random_member_with_eigenvalues([1, -2], seed=7))
    >>> period_over_rationals(form, "1/10", ["1/2", "-1/3", 0, 1]).status
    'aperiodic'
    """
    return period_of(form, eps, start)


def plane_period_over_rationals(block: PlanarBlock, point: Triple, *, name: str = "the plane") -> PlanePeriod:
    """Compute the period of `point` = (U : V : 1) under the map Psi of a block over Q, or over a field Q[t]/g.

    >>> block = PlanarBlock(*(fmpq(c) for c in (0, 2, -1, 2)))
    >>> plane_period_over_rationals(block, (fmpq(-1, 3), fmpq(-1, 3), fmpq(1))).text
    'the plane: period 5 (a smooth level cubic; 5 T = 0)'
    """
    kind, gamma = classify(block, point)
    if kind in _PERIOD_OF_KIND:
        return PlanePeriod(name, 0, kind, *_PERIOD_OF_KIND[kind])
    if kind is not PeriodKind.SMOOTH:
        reason = "a parabolic map" if kind is PeriodKind.ADDITIVE else "-8 is no root of unity"
        return PlanePeriod(name, 0, kind, "aperiodic", None, None, reason)
    order, reason = torsion_order(gamma)
    if order is None:
        return PlanePeriod(name, 0, kind, "aperiodic", None, None, reason)
    return PlanePeriod(name, 0, kind, "periodic", order, _meets_pole_by_iteration(block, point, order), reason)


def torsion_order(gamma: Any) -> tuple[int | None, str]:
    """Return the order of T over Q or Q[t]/g with g irreducible (None: infinite), and the reason.

    >>> torsion_order(fmpq(32, 27)), torsion_order(fmpq(3))
    ((5, '5 T = 0'), (None, 'T has the orders 54 and 88 modulo 101 and 103'))
    """
    orders: list[tuple[int, str]] = []
    for prime, residue, context in _reductions(gamma):
        if residue == 0 or residue == 1:
            continue
        prime_name = f"{prime}" if context is None else f"a prime over {prime}"
        orders.append(
            (translation_order(residue, prime if context is None else int(context.order()), context), prime_name)
        )
        (first_order, first_prime), (last_order, last_prime) = orders[0], orders[-1]
        if first_order != last_order:
            return None, f"T has the orders {first_order} and {last_order} modulo {first_prime} and {last_prime}"
        if len(orders) == _MAX_AGREEING_PRIMES:
            curve = Jacobian(gamma)
            if curve.multiple(first_order, curve.T) is None:
                return first_order, f"{first_order} T = 0"
    raise AssertionError("there are infinitely many primes")


def _reductions(gamma: Any) -> Iterator[tuple[int, Any, fq_default_ctx | None]]:
    """Yield (unramified prime p > 100, gamma in the smallest residue field above p, that field or None for GF(p))."""
    modulus = None if isinstance(gamma, fmpq) else gamma.field.chi
    element = gamma if modulus is None else gamma.polynomial
    denominator = element.q if modulus is None else element.denom() * modulus.denom()
    prime = 100
    while True:
        prime += 1
        if not fmpz(prime).is_prime() or denominator % prime == 0:
            continue
        field = GF(prime)
        if modulus is None:
            yield prime, field.convert(element), None
            continue
        ring = fmpz_mod_poly_ctx(fmpz_mod_ctx(prime))
        factors = ring([fmpz(int(field.convert(c))) for c in modulus.coeffs()]).factor()[1]
        if any(exponent > 1 for _, exponent in factors):
            continue
        factor = min((f for f, _ in factors), key=lambda f: int(f.degree()))
        remainder = ring([fmpz(int(field.convert(c))) for c in element.coeffs()]) % factor
        if factor.degree() == 1:
            yield prime, field.convert(int(remainder[0])), None
        else:
            context = fq_default_ctx(modulus=factor)
            yield prime, context(remainder), context
