"""The images of a hypersurface under the iterates of a map, along curves through points modulo large primes.

Source: grammaticos-ramani-papageorgiou-1991.

If the polynomials of hypersurfaces are too large to be expanded, their zeros on a random line give points of the
hypersurfaces. Let the equation M(x) x~ = r(x) of a map x~ = Phi(x) be linear in both points. Then det dPhi(x) is
det M'(x~)/det M(x) up to sign, with the matrix M' of the inverse map. So away from poles and infinity the exceptional
hypersurfaces are the zeros of E(X) = det M'(X~), where (X~ : Z~) is the image of X. On a line E is a polynomial in one
variable. Source: petrera-suris-2016, eq. (Jac).
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import reduce
from typing import Any

from flint import fmpq, nmod_poly

from kahanmaps.algebra.fields import GF, PrimeField
from kahanmaps.algebra.minors import Product, kernel_minors
from kahanmaps.algebra.polynomial_work import counted_product, product_units
from kahanmaps.algebra.polynomials import evaluate, gradient
from kahanmaps.algebra.printing import attributes
from kahanmaps.algebra.residues import random_prime
from kahanmaps.algebra.work import count_work
from kahanmaps.display_protocols import ResultPart
from kahanmaps.errors import BadPrime, counted
from kahanmaps.laboratory.singular.following import (
    NO_ORBIT_DATA,
    NOTHING_TRACKED,
    AlongCurves,
    OrbitData,
    StepLimits,
    TestCurve,
    TrackedFunctions,
)
from kahanmaps.laboratory.singular.jets import (
    JetStep,
    MapSequence,
    NotGeneric,
    PrecisionTooLow,
    form_order,
    roots_modulo,
)
from kahanmaps.maps.equation import Equation
from kahanmaps.maps.implicit import MapFamily

_MAX_TANGENT_PRECISION = 1024  # maximal number of terms of series with tangents
_KEY_PRECISION = 64  # maximal number of terms of series for the orders by which points are distinguished
_TRIES = 40  # maximal number of random primes
_MIN_LINES = 6  # minimal number of lines with critical points; more are used while a multiplicity has no point
_POINTS = 2  # number of points of each hypersurface, modulo different primes
MAX_CHARACTERS = 60  # maximal number of characters of a polynomial in a sentence

FIRST_STEPS = 12  # number of steps that are printed


@dataclass(frozen=True)
class CriticalPoint:
    """A zero of E modulo p, with its multiplicity and the gradient of the squarefree part of E there (up to a factor).

    E is det M' at the image, M' the matrix of the inverse map; for a pole E is det M, for Kahan maps det(I - eps f').
    """

    point: tuple[int, ...]
    gradient: tuple[int, ...]
    multiplicity: int


def critical_points(
    equations: Sequence[Equation], inverses: Sequence[Equation] | None, rng: random.Random
) -> tuple[list[CriticalPoint], dict[int, int]]:
    """Return the critical points modulo p on a random line that are neither poles nor at infinity. Exact.

    `equations` are the equations of the factors of the map over GF(p), linear in the point, and `inverses` those of the
    inverses of the factors. E is the product of det M' at the images, for the matrices M' of the inverses. Without
    `inverses`, det M replaces E, and the points are the poles that are not at infinity. Returns the points in GF(p)
    and, for each multiplicity, the number of all zeros of E in the algebraic closure of GF(p).
    """
    p = equations[0].over.characteristic
    a, b = ([rng.randrange(p) for _ in range(equations[0].dim + 1)] for _ in range(2))
    line = [nmod_poly([x, v], p) for x, v in zip(a, b, strict=True)]
    excluded_zeros = line[-1]

    def evaluate_E(X: Sequence[nmod_poly], times: Product, is_line: bool = False) -> nmod_poly:
        """Return E or det M at X; on the line, common factors of images are divided out, and their zeros excluded."""
        nonlocal excluded_zeros
        product = X[0] * 0 + 1
        for k, equation in enumerate(equations):
            if inverses is None:
                product = times(product, _denominator(equation, X, times))
                if k + 1 == len(equations):
                    break
            image = equation.image(X, X[0] * 0, times)
            if is_line and (common_factor := reduce(nmod_poly.gcd, image)).degree() > 0:
                image = [entry // common_factor for entry in image]
                excluded_zeros = excluded_zeros if inverses is None else excluded_zeros * common_factor
            X = image
            if inverses is not None:
                product = times(product, _denominator(inverses[k], X, times))
                excluded_zeros = excluded_zeros * X[-1] if is_line else excluded_zeros
        return product

    E_on_line = evaluate_E(line, counted_product, is_line=True)
    while (common_zeros := E_on_line.gcd(excluded_zeros)).degree() > 0:
        E_on_line = E_on_line // common_zeros
    if E_on_line.degree() < 1:
        return [], {}
    points, degrees = [], dict[int, int]()
    for squarefree_factor, exponent in E_on_line.factor_squarefree()[1]:
        power = int(exponent)
        degrees[power] = degrees.get(power, 0) + int(squarefree_factor.degree())
        for s in roots_modulo(squarefree_factor):
            point = [(x + s * v) % p for x, v in zip(a, b, strict=True)]
            # The gradient of F up to a factor, where E = F^power G: at x + t v + d w the leading terms of E are
            # (t F_v + d F_w)^power G, with derivatives F_v, F_w. A power of t above all relevant ones replaces d.
            gap_order = power + 1
            curve = [nmod_poly([x, rng.randrange(p)], p) for x in point]
            t_to_gap = nmod_poly([0] * gap_order + [1], p)
            curves = [curve, *([x + t_to_gap if i == k else x for i, x in enumerate(curve)] for k in range(len(point)))]
            term_count = gap_order + power

            def times(left: nmod_poly, right: nmod_poly, term_count: int = term_count) -> nmod_poly:
                count_work(product_units(term_count, term_count))
                return left.mul_low(right, term_count)

            value, *nearby_values = (int(evaluate_E(X, times)[term_count - 1]) for X in curves)
            gradient = [(c - value) % p for c in nearby_values]
            if any(gradient):
                points.append(CriticalPoint(tuple(point), tuple(gradient), power))
    return points, degrees


def _denominator(equation: Equation, X: Sequence[nmod_poly], times: Product) -> nmod_poly:
    """Return det M at X up to sign, the last minor of the equation; the coordinates of X are polynomials."""
    zero = X[0] * 0
    rows = equation.rows(equation.monomials(X, times), zero)
    minor: nmod_poly = kernel_minors([[*row[:-1], zero] for row in rows], times)[-1]
    return minor


class SingularityOutcome(StrEnum):
    """The outcome for a hypersurface under the iterates of a map."""

    CONFINED = "confined"
    NOT_CONFINED = "not confined"
    NOT_CONTRACTED = "not contracted"
    UNDECIDED = "undecided"


CONFINED, NOT_CONFINED, NOT_CONTRACTED, UNDECIDED = SingularityOutcome
NO_POINT = "no point was followed"
BUDGET_SPENT = "work limit reached before two points of it were followed; raise --effort"
POINTS_DIFFER = "its multiplicities along two curves modulo different primes differ; try another --seed"


@dataclass(frozen=True)
class Hypersurface(ResultPart):
    """An irreducible hypersurface over Q and its singularity pattern, at one exact eps.

    `polynomial` is its polynomial as text: "Z" for the hyperplane at infinity, "?" if it is too large; in the latter
    case `degree` is the sum of the degrees of all components of this multiplicity. `divides_denominator` says whether
    it is a factor of det(I - eps f'(x)); `multiplicity` is its exponent in the Jacobian determinant of the homogeneous
    map (None: not computed). The step `contracted_at` contracts the hypersurface, and after the step `confined_at` the
    image is a hypersurface again (None: there is no such step). `steps` are the first steps, from a point modulo the
    first of `primes`.

    Its images were computed for `followed` steps. `orbit_data` is its pattern. From the step `settled_at` on (None: it
    has not settled) the pattern follows from earlier rows: it is zero, periodic, or given by a linear recurrence. If
    the factors of a composition are followed one by one, all steps are steps of single factors, and the factor with
    index `stage` (from 0) contracts; otherwise `stage` is None. `generic` is the polynomial over Q[eps] as text.
    """

    polynomial: str = "?"
    degree: int = 0
    divides_denominator: bool = False
    multiplicity: int | None = None
    status: SingularityOutcome = UNDECIDED
    contracted_at: int | None = None
    confined_at: int | None = None
    steps: tuple[JetStep, ...] = ()
    primes: tuple[int, ...] = ()
    note: str = ""
    followed: int = 0
    settled_at: int | None = None
    orbit_data: OrbitData = field(default=NO_ORBIT_DATA, repr=False)
    stage: int | None = None
    generic: str = ""

    @property
    def text(self) -> str:
        """The polynomial and the outcome of the hypersurface, as text."""
        return f"{self.polynomial} = 0: {self.status}"

    def sentence(self, at: str) -> str:
        """Describe the pattern: where images lie, at which steps the degree drops, and whether it is confined.

        `at` is a phrase with the eps of the polynomial, which is added unless the polynomial over Q[eps] is known.
        """
        text, max_characters = (self.generic, 2 * MAX_CHARACTERS) if self.generic else (self.polynomial, MAX_CHARACTERS)
        head = text if len(text) <= max_characters else f"{text[:max_characters]} ..."
        name = {"Z": "infinity", "?": "a hypersurface"}.get(self.polynomial, f"{head} = 0{'' if self.generic else at}")
        if self.orbit_data.continues_as:
            steps, target = self.orbit_data.continues_as
            outcome = f"mapped onto C{target + 1} after {counted(steps, 'step')}"
        elif self.confined_at is not None:
            outcome = f"confined after {counted(self.confined_at, 'step')}"
        elif self.orbit_data.recurrences:
            outcome = f"its multiplicities satisfy a recurrence of order {self.orbit_data.settled_at}"
        else:
            outcome = f"not confined within {counted(self.followed, 'step')}"
        map_text = "" if self.stage is None else f" by map {self.stage + 1}"
        factor_text = ", a factor of the denominator" if self.divides_denominator else ""
        summary = f"{name}, degree {self.degree}{factor_text}: contracted{map_text}, {outcome}"
        return "; ".join([summary, *self.orbit_data.sentences])

    def to_json(self) -> dict[str, Any]:
        """Return plain data, without the first steps."""
        names = (
            "polynomial",
            "degree",
            "divides_denominator",
            "multiplicity",
            "status",
            "contracted_at",
            "confined_at",
        )
        data = attributes(self, *names, "followed", "settled_at", "note", "stage", "generic")
        return {**data, "orbit_data": self.orbit_data.to_json()}


@dataclass(frozen=True)
class HypersurfaceForm:
    """An irreducible form, whether it is a pole, and its exponent in the Jacobian determinant of a map (None: unknown).

    `minor_exponent` is its exponent in the common factor of the minors of the equation of the map with index `stage`.
    """

    form: Any
    divides_denominator: bool
    multiplicity: int | None
    minor_exponent: int = 0
    stage: int = 0


@dataclass(frozen=True)
class Tracking:
    """The forms whose orders are measured along curves through hypersurfaces.

    The map contracts the zeros of the `critical` forms; `of_minors` are the forms in the common factor of the minors of
    an equation of the map. If the factors of a composition are followed one by one, a step is a step of one factor,
    factors repeat after `period` steps, and `stage` is the index (from 0) of the contracting factor.
    """

    critical: Sequence[HypersurfaceForm] = ()
    of_minors: Sequence[HypersurfaceForm] = ()
    stage: int | None = None
    period: int = 1

    def equations(self, map_: MapFamily, eps: fmpq, field: PrimeField) -> Sequence[Equation]:
        """Return the equations of the map modulo a prime; for a composition, in the order from `stage` on."""
        equations: Sequence[Equation] = map_.at(eps, field).equations
        if self.stage is None:
            return equations
        map_sequence = MapSequence([*equations[self.stage : self.period], *equations[: self.stage]])
        map_sequence.offsets = tuple(tracked.stage - self.stage for tracked in (*self.critical, *self.of_minors))
        return map_sequence

    def along(self, form: Any, field: PrimeField) -> TrackedFunctions:
        """Return the functions whose orders are measured along curves through the hypersurface `form` = 0."""
        forms, stage = [*self.critical, *self.of_minors], self.stage or 0
        return TrackedFunctions(
            tuple(form_order(tracked.form, field) for tracked in forms),
            tuple(tracked.minor_exponent for tracked in forms),
            tuple(int(tracked.form == form and tracked.stage == stage) for tracked in forms),
            len(self.critical),
        )


_UNDECIDED_OUTCOME, NONE_TRACKED = Hypersurface(), Tracking()


def outcome_of(
    map_: MapFamily,
    eps: fmpq,
    form: HypersurfaceForm,
    text: str,
    rng: random.Random,
    limits: StepLimits,
    tracking: Tracking = NONE_TRACKED,
) -> Hypersurface:
    """Return the hypersurface of a form over Q with its singularity pattern, at one exact eps (half the time step).

    The form is irreducible, in the variables (X : Z), and `text` is its name in output. The images of two points of the
    hypersurface, modulo two random primes, are computed. Source: grammaticos-ramani-papageorgiou-1991.
    """
    outcomes: dict[int, Hypersurface] = {}  # by prime
    outcome, note = _UNDECIDED_OUTCOME, BUDGET_SPENT
    for _ in range(_TRIES):
        if len(outcomes) == _POINTS or limits.budget.is_spent:
            break
        field = GF(random_prime(rng))
        try:
            equations = tracking.equations(map_, eps, field)
            # A random point of the hypersurface modulo p, on a line, and its tangent space.
            p, size = field.prime, form.form.context().nvars()
            a, b = ([rng.randrange(p) for _ in range(size)] for _ in range(2))
            line = evaluate(form.form, field, [nmod_poly([x, v], p) for x, v in zip(a, b, strict=True)])
            tracked = tracking.along(form.form, field)
            roots = roots_modulo(line) if line.degree() > 0 else []
            if not roots or p in outcomes:
                continue
            point = [(x + roots[0] * v) % p for x, v in zip(a, b, strict=True)]
            field_point = [field.convert(x) for x in point]
            normal_vector = [int(evaluate(slope, field, field_point)) for slope in gradient(form.form)]
            tangents = _tangent_vectors(point, normal_vector, field) if any(normal_vector) else None
            if tangents is not None:
                outcomes[p] = _outcome_at(equations, point, tangents, rng, limits, tracked=tracked)
        except (BadPrime, NotGeneric):
            continue
        except PrecisionTooLow:
            note = BUDGET_SPENT if limits.budget.is_spent else "its series have too few terms"
            break
    if len(outcomes) == _POINTS:
        data, other_data = (
            (h.status, h.contracted_at, h.confined_at, h.orbit_data.compared) for h in outcomes.values()
        )
        outcome, note = next(iter(outcomes.values())), ""
        if data != other_data:  # the budget may have been spent at the second point
            outcome, note = Hypersurface(steps=outcome.steps), BUDGET_SPENT if limits.budget.is_spent else POINTS_DIFFER
    hypersurface = replace(
        outcome,
        polynomial=text,
        degree=int(form.form.total_degree()),
        divides_denominator=form.divides_denominator,
        note=note,
    )
    return replace(hypersurface, multiplicity=form.multiplicity, primes=tuple(outcomes), stage=tracking.stage)


def outcomes_at_random(map_: MapFamily, eps: fmpq, rng: random.Random, limits: StepLimits) -> list[Hypersurface]:
    """Return the outcomes of all exceptional hypersurfaces, poles and infinity, from points without polynomials."""
    hypersurfaces = outcomes_of_points(map_, eps, rng, limits, poles=True) + outcomes_of_points(map_, eps, rng, limits)
    for _ in range(_TRIES):
        field = GF(random_prime(rng))
        try:
            equations = map_.at(eps, field).equations
            point = [rng.randrange(field.prime) for _ in range(map_.dim)] + [0]
            tangents = _tangent_vectors(point, [0] * map_.dim + [1], field)
            outcome = _UNDECIDED_OUTCOME if tangents is None else _outcome_at(equations, point, tangents, rng, limits)
        except (BadPrime, NotGeneric):
            continue
        except PrecisionTooLow:
            outcome = _UNDECIDED_OUTCOME
        return [*hypersurfaces, replace(outcome, polynomial="Z", degree=1, primes=(field.prime,))]
    return hypersurfaces


def outcomes_of_points(
    map_: MapFamily, eps: fmpq, rng: random.Random, limits: StepLimits, poles: bool = False
) -> list[Hypersurface]:
    """Return hypersurfaces without polynomials; they are distinguished by multiplicities and outcomes of random points.

    The points lie on lines modulo random primes, at one exact `eps` (half the time step). If `poles` is True, the poles
    are returned, otherwise all exceptional hypersurfaces except poles and infinity. If a multiplicity has no point in
    GF(p), a hypersurface of this multiplicity is returned as undecided. Source: zander-2021.
    """
    hypersurfaces: dict[tuple[Any, ...], Hypersurface] = {}
    keys_by_orders: dict[
        tuple[Any, ...], list[tuple[Any, ...]]
    ] = {}  # keys in `hypersurfaces` of points, by their orders
    degrees: dict[int, int] = {}
    for line_count in range(4 * _MIN_LINES):
        if limits.budget.is_spent or (line_count >= _MIN_LINES and set(degrees) <= {key[0] for key in hypersurfaces}):
            break
        field = GF(random_prime(rng))
        try:
            map_at_prime = map_.at(eps, field)
            equations, inverses = map_at_prime.equations, map_at_prime.inverse.equations[::-1]
        except BadPrime:
            continue
        points, zeros_by_multiplicity = critical_points(equations, None if poles else inverses, rng)
        degrees |= zeros_by_multiplicity
        for critical_point in points:
            tangents = _tangent_vectors(critical_point.point, critical_point.gradient, field)
            if tangents is None or limits.budget.is_spent:
                continue
            direction = [rng.randrange(field.prime) for _ in critical_point.point]
            run, _ = TestCurve(equations, critical_point.point, direction, limits).steps(
                limits.first_steps, max_precision=_KEY_PRECISION
            )
            orders = critical_point.multiplicity, *((step.common, step.pole, step.denominator) for step in run)
            keys = keys_by_orders.setdefault(orders, [])
            if len(keys) >= _POINTS and len(set(keys)) == 1:  # two such points suffice
                primes = dict.fromkeys((*hypersurfaces[keys[0]].primes, field.prime))
                hypersurfaces[keys[0]] = replace(hypersurfaces[keys[0]], primes=tuple(primes))
                continue
            try:
                outcome = _outcome_at(equations, critical_point.point, tangents, rng, limits)
            except NotGeneric:
                continue
            except PrecisionTooLow:
                outcome = _UNDECIDED_OUTCOME
            key = (critical_point.multiplicity, outcome.status, outcome.contracted_at, outcome.confined_at)
            keys.append(key)
            hypersurface = replace(
                outcome,
                degree=zeros_by_multiplicity[key[0]],
                divides_denominator=poles,
                multiplicity=key[0],
                primes=(field.prime,),
            )
            if key in hypersurfaces:  # of points with the same outcome, the smaller number of steps counts
                earlier_hypersurface = hypersurfaces[key]
                settled_steps = [k for k in (earlier_hypersurface.settled_at, hypersurface.settled_at) if k is not None]
                hypersurfaces[key] = replace(
                    earlier_hypersurface,
                    primes=tuple(dict.fromkeys((*earlier_hypersurface.primes, *hypersurface.primes))),
                    followed=min(earlier_hypersurface.followed, hypersurface.followed),
                    settled_at=max(settled_steps) if len(settled_steps) == 2 else None,
                )
            else:
                hypersurfaces[key] = hypersurface
    for multiplicity in set(degrees) - {h.multiplicity for h in hypersurfaces.values()}:
        hypersurfaces[(multiplicity,)] = Hypersurface("?", degrees[multiplicity], poles, multiplicity, note=NO_POINT)
    return sorted(hypersurfaces.values(), key=lambda h: (h.multiplicity, h.status, h.confined_at or 0))


def _outcome_by_ranks(ranks: Sequence[int], full_rank: int) -> tuple[SingularityOutcome, int | None, int | None]:
    """Return (outcome, contracted_at, confined_at), as in `Hypersurface`, from the ranks of the steps 1, 2, ..."""
    contracted_at = next((k for k, rank in enumerate(ranks, 1) if rank < full_rank), None)
    if contracted_at is None:
        return NOT_CONTRACTED, None, None
    confined_at = next((k for k, rank in enumerate(ranks, 1) if k > contracted_at and rank == full_rank), None)
    return (NOT_CONFINED, contracted_at, None) if confined_at is None else (CONFINED, contracted_at, confined_at)


def _outcome_at(
    equations: Sequence[Equation],
    point: Sequence[int],
    tangents: list[list[int]],
    rng: random.Random,
    limits: StepLimits,
    tracked: AlongCurves = NOTHING_TRACKED,
) -> Hypersurface:
    """Return outcome and singularity pattern of a hypersurface, given by a point and tangent vectors at it."""
    full_rank = len(tangents)
    direction = [rng.randrange(equations[0].over.characteristic) for _ in point]
    curve = TestCurve(equations, point, direction, limits, tracked)
    run, is_complete = curve.steps(limits.first_steps, tangents, _MAX_TANGENT_PRECISION)
    status, contracted_at, confined_at = _outcome_by_ranks([step.rank for step in run], full_rank)
    if not is_complete and (status != NOT_CONFINED or not tracked.functions):
        raise PrecisionTooLow
    if status == NOT_CONTRACTED:
        return Hypersurface(status=status, steps=tuple(run), followed=len(run), settled_at=0)
    data = NO_ORBIT_DATA
    if confined_at is None:
        data = curve.orbit_data(limits.first_steps)
        # After these steps the image may be another hypersurface, whose pattern then continues this one.
        step_limit = min(limits.series_steps, limits.max_steps)
        while confined_at is None and is_complete and not data.is_settled and len(run) < step_limit:
            run, is_complete = curve.steps(min(2 * len(run), step_limit), tangents, _MAX_TANGENT_PRECISION)
            status, contracted_at, confined_at = _outcome_by_ranks([step.rank for step in run], full_rank)
    if confined_at is None:
        # At a superattracting point multiplicities grow too fast for the precision, but may satisfy a recurrence.
        if not is_complete and not data.is_settled:
            raise PrecisionTooLow
    else:
        data = curve.orbit_data_until_return(confined_at)
    if is_complete and data.is_settled and not data.continues_as and len(run) < data.settled_at + 2 <= limits.max_steps:
        run = list(curve.all_steps(data.settled_at + 2, tangents))
        status, contracted_at, confined_at = _outcome_by_ranks([step.rank for step in run], full_rank)
    settled_at = max(confined_at or 0, data.settled_at) if data.is_settled else None
    if len(equations) > 1 and not tracked.functions:  # rows of det M suffice for a single map only
        data = replace(NO_ORBIT_DATA, followed=data.followed)
    return Hypersurface(
        status=status,
        contracted_at=contracted_at,
        confined_at=confined_at,
        steps=tuple(run),
        followed=data.followed,
        settled_at=settled_at,
        orbit_data=data,
    )


def _tangent_vectors(point: Sequence[int], gradient: Sequence[int], field: PrimeField) -> list[list[int]] | None:
    """Return a basis of the tangent space of a hypersurface at a point, modulo the point; None in special position."""
    p, indices = field.prime, range(len(point))
    pivot = next(k for k in indices if gradient[k])
    inverse = pow(gradient[pivot], -1, p)
    # The point itself is a tangent vector of the affine cone, so a basis vector that occurs in it is omitted.
    second_pivot = next((k for k in indices if k != pivot and point[k]), None)
    free_indices = [k for k in indices if k not in (pivot, second_pivot)]
    basis = [[int(i == k) - (i == pivot) * gradient[k] * inverse for i in indices] for k in free_indices]
    return None if second_pivot is None else [[entry % p for entry in vector] for vector in basis]
