"""Singularity confinement: the images of poles and of exceptional hypersurfaces (which the map contracts).

A hypersurface on which the differential of the map degenerates may be contracted: its image has lower dimension, and
the image of a point no longer determines the point. The singularity is confined if a later image, computed along curves
through the hypersurface, is a hypersurface again. The degrees of iterates drop below powers of the degree of the map
only if images of exceptional hypersurfaces lie in the indeterminacy locus. The hypersurfaces are computed exactly over
Q, for an exact eps. Their images are computed at random points modulo large primes, which is evidence but no proof.
Source: grammaticos-ramani-papageorgiou-1991, and for Kahan maps zander-2021.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from flint import fmpq, fmpz_poly

from kahanmaps.algebra.chance import derive_seed
from kahanmaps.algebra.fields import GF, rational
from kahanmaps.algebra.matrices import det
from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.algebra.polynomial_work import counted_product, factored
from kahanmaps.algebra.printing import all_fields, attributes, format_number, format_polynomial
from kahanmaps.algebra.residues import random_prime
from kahanmaps.algebra.work import Budget, count_work
from kahanmaps.display_protocols import PrintableResult
from kahanmaps.errors import BadPrime, InputError, SingularStep, counted
from kahanmaps.hard_stop import TimeLimit
from kahanmaps.laboratory.defaults import budget_for
from kahanmaps.laboratory.growth.curves import Line, Stopped, reduce_map
from kahanmaps.laboratory.growth.renewal import degree_series, every_nth, needed_hypersurfaces
from kahanmaps.laboratory.singular.exceptional import OrbitDataUnknown, exceptional_hypersurfaces
from kahanmaps.laboratory.singular.following import Fraction, StepLimits
from kahanmaps.laboratory.singular.outcomes import (
    CONFINED,
    FIRST_STEPS,
    NONE_TRACKED,
    NOT_CONFINED,
    NOT_CONTRACTED,
    UNDECIDED,
    Hypersurface,
    Tracking,
    outcome_of,
    outcomes_at_random,
    outcomes_of_points,
)
from kahanmaps.laboratory.singular.written import (
    Word,
    affine,
    followed_forms,
    followed_map_by_map,
    is_long,
    name_of,
    period_of,
    poles_and_critical_factors,
)
from kahanmaps.maps.convention import resolve_eps
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.maps.inverse import TooLarge
from kahanmaps.maps.kahan import SystemLike, as_map
from kahanmaps.maps.projective import homogeneous_map
from kahanmaps.systems.quadratic import QuadraticSystem

MAX_DIMENSION = 6
MAX_STEPS = 10_000
MAX_DIGITS = 10_000  # maximal number of digits of eps and of the coefficients of the system
_DIGITS_PER_MILLION = {1: 10_000, 2: 10_000, 3: 2_000, 4: 100, 5: 1_000, 6: 500}  # units of work, by dimension
_MIN_DIGITS = 50  # this number of digits is allowed for any budget
_DEFAULT_STEPS = {1: 1000, 2: 1000, 3: 500, 4: 250}  # by dimension
_LEAST_STEPS = 100  # in dimension 5 and 6
_SERIES_STEPS = {1: 400, 2: 400, 3: 150, 4: 60}  # number of steps with series, by dimension
_LEAST_SERIES_STEPS = 40  # in dimension 5 and 6
_REPEATING_STEPS = {1: 60, 2: 60}  # steps after which repeating orders are accepted if series get too long
_MAX_FIRST_STEPS = 200  # maximal number of steps with series before only points are iterated
_MAX_EPS_PAIRS = 2  # maximal number of pairs of eps, since an eps may be special
WRITTEN_DIMENSION = 4  # the largest dimension in which `patterns` uses polynomials; above it they are slow
_POINTS = 3  # number of random points at which det dPhi is evaluated
_MAX_DEGREE = 20_000  # maximal degree of a composition
_STOPPED = "work limit reached before all singularities were traced; raise --effort"
_DIFFERENT = "the singularities at the two values of eps differ; choose one with --eps"


class TooLongFormula(InputError):
    """Raised if the formulas of a composition are too long to compute its singularity patterns."""


@dataclass(frozen=True)
class SingularityRun(PrintableResult):
    """The singularities of a map at one exact eps (half the time step).

    `denominator` is the denominator of the map as text, det(I - eps f'(x)) for a Kahan map, or "?" if it is too large.
    `critical_degree` is the degree of the Jacobian determinant of the homogeneous map; it is None if the determinant is
    too large to expand, and random points then represent the exceptional hypersurfaces. If the determinant vanishes
    identically, the map is not dominant, and no patterns are computed. If the factors of a composition are followed one
    by one, `word` describes these factors, and the steps of hypersurfaces are steps of single factors.
    """

    _parts, _noun = "hypersurfaces", ("hypersurface", "hypersurfaces")

    eps: fmpq
    denominator: str
    map_degree: int
    critical_degree: int | None = None
    hypersurfaces: tuple[Hypersurface, ...] = ()
    is_stopped: bool = False
    is_undefined: bool = False
    is_dominant: bool = True
    word: Word | None = None

    def rows(self) -> list[dict[str, Any]]:
        """Return a row for each hypersurface, for example for `pandas.DataFrame(run.rows())`."""
        names = ("polynomial", "degree", "status", "contracted_at", "confined_at")
        return [attributes(hypersurface, *names) for hypersurface in self.hypersurfaces]

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        return all_fields(self, stopped="is_stopped")

    @property
    def verdict(self) -> str:
        """The combined verdict on all hypersurfaces.

        It is "no singularities", "nothing contracted", "confined", "not confined", "some confined" or "undecided"; for
        a map that is not birational at this eps it is "singular everywhere" (defined nowhere) or "not dominant".
        """
        if self.is_undefined:
            return "singular everywhere"
        if not self.is_dominant:
            return "not dominant"
        states = {h.status for h in self.hypersurfaces if h.status != NOT_CONTRACTED}
        if self.is_stopped or UNDECIDED in states:
            return UNDECIDED
        if not self.hypersurfaces:
            return "no singularities"
        if not states:
            return "nothing contracted"
        return "some confined" if len(states) > 1 else states.pop()

    @property
    def followed(self) -> int | None:
        """The number of steps for which every unconfined hypersurface was followed; None if all are confined."""
        steps = [h.followed for h in self.hypersurfaces if h.status == NOT_CONFINED]
        return min(steps, default=None)

    @property
    def text(self) -> str:
        """The verdict, with the number of steps that were searched for confinement."""
        if self.followed is None or self.verdict not in (NOT_CONFINED, "some confined"):
            return self.verdict
        others_text = ", others not" if self.verdict == "some confined" else ""
        return f"{self.verdict}{others_text} within {counted(self.followed, self.unit)}"

    @property
    def unit(self) -> str:
        """The name of the unit of steps of hypersurfaces: "step" of the map, or "single map" of a composition."""
        return "step" if self.word is None else "single map"

    @property
    def shape(self) -> tuple[Any, ...]:
        """The data that are equal at all generic eps: degrees, multiplicities and outcomes of hypersurfaces."""
        patterns = sorted(
            (h.degree, h.divides_denominator, h.multiplicity or 0, h.status, tuple(step.rank for step in h.steps))
            for h in self.hypersurfaces
        )
        return (self.is_undefined, self.is_dominant, *patterns)


def singularities(
    system: SystemLike,
    eps: Any = None,
    *,
    time_step: Any = None,
    h: Any = None,
    steps: int | None = None,
    seed: int = 0,
    effort: int | Budget = 1,
    progress: Callable[[str], None] = lambda _: None,
) -> SingularityRun:
    """Compute the exceptional hypersurfaces and poles of a map at one exact eps, and their singularity patterns.

    Args:
        system: a map, or a system, which stands for its Kahan map; of dimension at most 6.
        eps: half the time step, an exact number; None: two values are used, at which the patterns must agree.
        time_step, h: the time step 2 eps, instead of eps.
        steps: the number of images of each hypersurface: by default 1000 in dimension 1 and 2, 500 in dimension 3, 250
            in dimension 4 and 100 above; fewer if all steps need power series.
        seed: the random seed.
        effort: each increase by 1 doubles the work limit.
        progress: called with a message for each hypersurface.

    Returns:
        A `SingularityRun`; if eps is None, that for the first of the two values. Hypersurfaces are exact; their outcome
        is measured at two random points modulo two random primes. "Not confined" means: not within `steps` steps. A
        TimeLimit ends the computation early; if `effort` is a Budget, the TimeLimit is raised again.

    Raises:
        InputError: for dimensions above 6, a number of steps out of range, numbers too long for the budget, and
            different patterns at the two eps.

    Source: grammaticos-ramani-papageorgiou-1991, zander-2021.

    >>> run = singularities(QuadraticSystem.from_text(["x", "y"], ["x*(1 - y)", "y*(x - 1)"]), "1/10")
    >>> run.denominator, str(run.verdict)
    ('-9/100*x + 11/100*y + 99/100', 'not confined')
    """
    map_, eps = as_map(system), resolve_eps(eps, time_step, h)
    if eps is None:
        options: dict[str, Any] = {"steps": steps, "seed": seed, "effort": effort, "progress": progress}
        runs = [singularities(map_, value, **options) for value in default_eps(map_, seed)]
        if len({run.shape for run in runs}) > 1:
            raise InputError(f"found no eps, expected one: {_DIFFERENT.replace('--eps', 'eps=')}")
        return runs[0]
    exact_eps = rational(eps)
    if map_.unsupported_reason:
        raise InputError(map_.unsupported_reason)
    if map_.dim > MAX_DIMENSION:
        raise InputError(f"found a system of dimension {map_.dim}, expected at most {MAX_DIMENSION}")
    budget = budget_for("singularities", effort)
    max_digits = _max_digits(map_.dim, budget)
    if (digits := _count_digits(map_, exact_eps)) > max_digits:
        raise InputError(
            f"found numbers of about {digits} digits in eps and the system, expected at most {max_digits}: "
            f"in dimension {map_.dim} formulas with longer numbers exceed the work limit; raise --effort"
        )
    if steps is not None and not 1 <= steps <= MAX_STEPS:
        raise InputError(f"found {steps} steps, expected 1 to {MAX_STEPS}")
    limits = _step_limits(map_.dim, steps, budget)
    map_at_eps, rng = map_.at(exact_eps), random.Random(f"singularities {derive_seed(seed, map_.seed_data, exact_eps)}")
    try:
        if is_long(map_at_eps):
            raise TooLarge("forms that would take long to expand, too long for their determinant")
        map_form = homogeneous_map(map_at_eps)
        count_work(3 * sum(map(len, map_form.forms)))
    except TooLarge:  # for a composition, follow its factors one by one, or use random points
        try:
            line = Line(reduce_map(map_, exact_eps, rng), rng, limits.budget, _MAX_DEGREE)
            line.step(1)
        except Stopped as error:
            raise InputError(f"found a composition whose singularities cannot be followed: {error.message}") from error
        run = SingularityRun(exact_eps, "?", line.degree)
        if not _is_dominant(map_, exact_eps):
            return replace(run, is_dominant=False)
        if (followed_run := _follow_map_by_map(map_, run, seed, limits, progress)) is not None:
            return followed_run
        if not map_at_eps.is_bilinear:
            raise TooLongFormula(
                "found a composition of maps whose forms on projective space are too large, expected smaller maps, or "
                "maps whose equations are linear in both points, which are treated at random points"
            ) from None
        random_hypersurfaces = tuple(outcomes_at_random(map_, exact_eps, rng, limits))
        return replace(run, hypersurfaces=random_hypersurfaces, is_stopped=limits.budget.is_spent)
    denominator = map_form.denominator
    # The minors have signs: the last minor of each factor is (-1)^n det(I - eps f'(x)) at Z = 1.
    run = SingularityRun(
        exact_eps, affine(denominator * (-1) ** (map_.dim * len(map_at_eps.factors)), map_), map_form.degree
    )
    is_undefined = bool(denominator.is_zero())  # det(I - eps f'(x)) = 0 for all x
    if is_undefined or not _is_dominant(map_, exact_eps):
        return replace(run, is_undefined=is_undefined, is_dominant=False)
    if map_form.degree > 1:
        progress("the Jacobian determinant of the homogeneous map")
    forms, critical_degree = poles_and_critical_factors(map_form)
    if critical_degree is None and len(map_at_eps.factors) > 1:
        followed_run = _follow_map_by_map(map_, replace(run, denominator="?"), seed, limits, progress)
        if followed_run is not None:
            return followed_run
    tracking = Tracking(*followed_forms(map_form, forms)) if critical_degree else NONE_TRACKED
    hypersurfaces: list[Hypersurface] = []
    is_stopped = False
    for form in forms:
        if is_stopped := limits.budget.is_spent:
            break
        try:
            text = name_of(form.form, map_)
            progress(f"following {text[:40]}")
            hypersurfaces.append(outcome_of(map_, exact_eps, form, text, rng, limits, tracking))
        except TimeLimit:
            if isinstance(effort, Budget):  # the computation that contains this one must end as well
                raise
            is_stopped = True
            break
    if critical_degree is None and not is_stopped:
        progress("following critical points")
        note = "the polynomials of the exceptional hypersurfaces are too large"
        without_polynomials = (
            outcomes_of_points(map_, exact_eps, rng, limits) if map_at_eps.is_bilinear else [Hypersurface(note=note)]
        )
        hypersurfaces += without_polynomials
    is_stopped |= limits.budget.is_spent and (
        critical_degree is None or any(h.settled_at is None for h in hypersurfaces)
    )
    return replace(run, critical_degree=critical_degree, hypersurfaces=tuple(hypersurfaces), is_stopped=is_stopped)


def _follow_map_by_map(
    map_: MapFamily, run: SingularityRun, seed: int, limits: StepLimits, progress: Callable[[str], None]
) -> SingularityRun | None:
    """Return the run for a composition whose factors are followed one by one; None if a factor is too large."""
    rng = random.Random(f"map by map {derive_seed(seed, map_.seed_data, run.eps)}")
    result = followed_map_by_map(map_, run.eps, rng, limits, progress)
    return result and replace(run, word=result[0], hypersurfaces=tuple(result[1]), is_stopped=limits.budget.is_spent)


@dataclass(frozen=True)
class Patterns:
    """The singularity patterns of a map, and the degrees of its iterates that are derived from them.

    The degrees drop below powers of d_1 only if images of exceptional hypersurfaces lie in the indeterminacy locus. So
    a recurrence of the degrees may fail until the last pattern has settled. `lengths` are the distinct numbers of steps
    after which patterns have settled. `searched` is the number of steps for which all unconfined hypersurfaces were
    followed (None: all are confined); `some_confined` says whether a hypersurface is confined (None: unknown).
    `running` is empty, or the reason why patterns are not known for all steps. `series` has the coefficients of
    numerator and denominator of the generating function of the degrees; it is empty if the patterns do not determine
    the degrees. `exceptional` are the exceptional hypersurfaces at the eps `at`. If `word` is given, their steps are
    steps of the single factors of a composition.
    """

    lengths: tuple[int, ...]
    searched: int | None
    some_confined: bool | None
    running: str = ""
    series: tuple[tuple[int, ...], ...] = ()
    exceptional: tuple[Hypersurface, ...] = field(default=(), compare=False, repr=False)
    at: str = field(default="", compare=False)
    word: Word | None = field(default=None, compare=False)

    def terms_needed(self, order: int) -> int:
        """Return the number of terms, including d_0, that determine a recurrence of this order.

        Two rational generating functions of degrees r and R are equal if their first r + R + 1 terms agree. Here r is
        `order` (of the fitted recurrence). The degree R of the true generating function is at most 1 + sum(lengths).
        """
        return order + sum(self.lengths) + 2

    @property
    def fraction(self) -> Fraction:
        """The numerator and the denominator of the generating function of the degrees; `series` must not be empty."""
        numerator, denominator = self.series
        return fmpz_poly(list(numerator)), fmpz_poly(list(denominator))

    @property
    def series_text(self) -> str:
        """The generating function of the degrees as a formula in z; empty if it is not known."""
        texts = []
        for coefficients in self.series:
            text = ""
            for power, c in enumerate(coefficients):
                if c:
                    z_text = "" if power == 0 else "z" if power == 1 else f"z^{power}"
                    term = "*".join(([] if abs(c) == 1 and z_text else [str(abs(c))]) + ([z_text] if z_text else []))
                    text += f" {'-' if c < 0 else '+'} {term}" if text else f"{'-' if c < 0 else ''}{term}"
            texts.append(f"({text or '0'})")
        return " / ".join(texts)

    @property
    def sentences(self) -> list[str]:
        """A sentence on the singularity pattern of each exceptional hypersurface; empty if `series` is empty."""
        eps_text = f" at eps = {self.at}" if self.at else ""
        return [f"C{k}: {h.sentence(eps_text)}" for k, h in enumerate(self.exceptional, 1) if self.series]

    @property
    def word_text(self) -> str:
        """A note on the unit of steps in `sentences`; empty unless the steps are those of single factors."""
        return self.word.text if self.word is not None and self.word.length > 1 and self.series else ""

    @property
    def limit(self) -> str:
        """The number of steps searched for confinement, as a phrase; empty if all singularities are confined."""
        if self.searched is None:
            return ""
        return f"{'no other' if self.some_confined else 'no'} confinement within {counted(self.searched, 'step')}"

    @property
    def text(self) -> str:
        """The length of the longest pattern and the number of steps searched for confinement, as one line of text."""
        if self.running:
            return self.running
        longest = max(self.lengths, default=0)
        sentence = f"all singularity patterns have settled by step {longest}" if longest else "none lowers the degree"
        return f"{sentence}; {self.limit}" if self.limit else sentence

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        data = attributes(self, "lengths", "searched", "some_confined", "running", "text")
        names = ("numerator", "denominator")
        series = {name: [str(c) for c in coefficients] for name, coefficients in zip(names, self.series, strict=False)}
        exceptional = [{"text": text, **h.to_json()} for text, h in zip(self.sentences, self.exceptional, strict=False)]
        maps_per_step = self.word.length if self.word_text and self.word else None
        fields = {
            "generating_function": series or None,
            "exceptional_hypersurfaces": exceptional,
            "eps": self.at or None,
        }
        return {**data, **fields, "maps_a_step": maps_per_step}


def patterns_of(runs: Sequence[SingularityRun], has_eps: bool = True) -> Patterns:
    """Combine the patterns of `runs` at one eps or at two, which must agree; `has_eps`: whether the map has an eps."""
    results = set()
    for run in runs:
        if not run.is_dominant:
            result = _patterns_if_not_dominant(run.eps)
        elif run.is_stopped:
            result = _no_patterns(_STOPPED)
        else:
            result = _merge_patterns(
                run.map_degree, run.hypersurfaces, format_number(run.eps) if has_eps else "", run.word
            )
        results.add(result)
    return results.pop() if len(results) == 1 else _no_patterns(_DIFFERENT)


def patterns(
    system: QuadraticSystem | MapFamily,
    eps: fmpq | None,
    *,
    steps: int | None = None,
    seed: int = 0,
    effort: int | Budget = 1,
) -> Patterns:
    """Return the patterns of a map at one exact eps (half the time step) or, if `eps` is None, at two values of eps.

    Up to dimension 4 they are computed by `singularities`. In higher dimensions, and if eps has too many digits for
    formulas, random points represent the hypersurfaces.
    """
    map_ = as_map(system)
    budget = budget_for("singularities", effort)
    result = _no_patterns("")
    for attempt in range(_MAX_EPS_PAIRS if eps is None else 1):
        if attempt and (not result.running or budget.is_spent):
            break
        values = default_eps(map_, seed + attempt) if eps is None else (eps,)
        budgets = budget.share([1] * len(values))
        # Random points can represent hypersurfaces only if the equations are linear in both points.
        is_short = map_.dim <= WRITTEN_DIMENSION or not map_.at(values[0]).is_bilinear
        if is_short and all(can_be_written(map_, value, budget.part(1 / len(values))) for value in values):
            try:
                pairs = zip(values, budgets, strict=True)
                runs = [singularities(map_, value, steps=steps, seed=seed, effort=share) for value, share in pairs]
            except TooLongFormula:
                return _no_patterns("the composition is too long for its singularities to be followed")
            result = patterns_of(runs, map_.has_eps)
        else:
            results = set()
            for value, share in zip(values, budgets, strict=True):
                limits, equations = _step_limits(map_.dim, steps, share), map_.at(value).equations
                rng = random.Random(f"patterns {derive_seed(seed, map_.seed_data, value)}")
                if not _is_dominant(map_, value):
                    result_at_eps = _patterns_if_not_dominant(value)
                elif period_of(equations) > 1:
                    outcomes = outcomes_at_random(map_, value, rng, limits)
                    result_at_eps = _no_patterns(_STOPPED) if limits.budget.is_spent else _merge_patterns(0, outcomes)
                else:
                    try:
                        degree, hypersurfaces = exceptional_hypersurfaces(map_, value, rng, limits)
                        result_at_eps = _merge_patterns(degree, hypersurfaces, "", Word((degree,), len(equations)))
                    except OrbitDataUnknown as error:
                        result_at_eps = _no_patterns(_STOPPED if limits.budget.is_spent else str(error))
                results.add(result_at_eps)
            result = results.pop() if len(results) == 1 else _no_patterns(_DIFFERENT)
    return result


def _count_digits(map_: MapFamily, eps: fmpq) -> int:
    return int(max(eps.p.bit_length(), eps.q.bit_length()) * 0.30103) + 1 + map_.digits


def _max_digits(dim: int, budget: Budget) -> int:
    """Return the maximal number of digits of coefficients for which the budget allows formulas, at least 50."""
    return max(_MIN_DIGITS, min(MAX_DIGITS, int(_DIGITS_PER_MILLION[dim] * min(budget.left / 1e6, MAX_DIGITS))))


def can_be_written(system: QuadraticSystem | MapFamily, eps: fmpq, budget: Budget) -> bool:
    """Return whether the dimension and the numbers of digits in map and eps are small enough for `singularities`."""
    map_ = as_map(system)
    return map_.dim <= MAX_DIMENSION and _count_digits(map_, eps) <= _max_digits(map_.dim, budget)


def _patterns_if_not_dominant(eps: fmpq) -> Patterns:
    return _no_patterns(f"the map is not dominant at eps = {format_number(eps)}, so that no singularity is followed")


def _no_patterns(reason: str) -> Patterns:
    return Patterns((), None, None, reason)


def _merge_patterns(
    map_degree: int, hypersurfaces: Sequence[Hypersurface], eps_text: str = "", word: Word | None = None
) -> Patterns:
    maps_per_step = 1 if word is None else word.length
    # A pole with exponent 0 in the Jacobian determinant is not critical: its images lower no degree.
    exceptional = [h for h in hypersurfaces if h.status != NOT_CONTRACTED and h.multiplicity != 0]
    for h in exceptional:
        name = "a hypersurface" if h.polynomial == "?" else f"{h.polynomial[:60]} = 0"
        if h.status == UNDECIDED:
            return _no_patterns(f"the pattern of {name} is undecided: {h.note or 'its series ended'}")
        if h.settled_at is None:
            return _no_patterns(f"the pattern of {name} has not settled after {h.followed} steps; raise --steps")
    lengths = {h.settled_at for h in exceptional if h.settled_at}
    unconfined_steps = [h.followed for h in exceptional if h.status != CONFINED]
    series: tuple[tuple[int, ...], ...] = ()
    if all(h.orbit_data.is_settled and h.degree for h in exceptional) and map_degree > 0:
        if needed_hypersurfaces([h.orbit_data for h in exceptional]) is None:
            return _no_patterns(
                "some images lie in a hypersurface that lowers the degree at all steps, with unknown multiplicities"
            )
        degrees = (map_degree,) if word is None else word.degrees
        fraction = degree_series(
            degrees, [(h.degree, h.orbit_data) for h in exceptional], [h.stage or 0 for h in exceptional]
        )
        if maps_per_step > 1:
            try:
                fraction = every_nth(fraction, maps_per_step)
            except ArithmeticError as error:
                return _no_patterns(f"{error}: those of the degrees of a composition")
        series = tuple(tuple(int(c) for c in polynomial.coeffs()) for polynomial in fraction)
    return Patterns(
        tuple(sorted({-(-length // maps_per_step) for length in lengths})),
        min((steps // maps_per_step for steps in unconfined_steps), default=None),
        any(h.status == CONFINED for h in exceptional),
        "",
        series,
        tuple(exceptional),
        eps_text,
        word,
    )


def steps_by_default(dim: int) -> int:
    """Return the default number of images of a hypersurface that are computed in this dimension."""
    return _DEFAULT_STEPS.get(dim, _LEAST_STEPS)


def _step_limits(dim: int, steps: int | None, budget: Budget) -> StepLimits:
    total, series_steps = steps or steps_by_default(dim), steps or _SERIES_STEPS.get(dim, _LEAST_SERIES_STEPS)
    repeating_steps = steps or min(series_steps, _REPEATING_STEPS.get(dim, series_steps))
    return StepLimits(min(total, steps or FIRST_STEPS, _MAX_FIRST_STEPS), total, series_steps, budget, repeating_steps)


def symbolic_denominator(system: QuadraticSystem | MapFamily) -> list[tuple[str, int]] | None:
    """Return the irreducible factors of det M in Q[x, eps], with exponents; M is I - eps f' for Kahan maps.

    Exact. Returns None above dimension 4, for compositions too large to be expanded, and if a variable is called eps.

    >>> symbolic_denominator(QuadraticSystem.from_text(["x", "y"], ["y", "6*x^2 - 2"]))
    [('12*x*eps^2 - 1', 1)]
    """
    map_ = as_map(system)
    if map_.dim > 4 or "eps" in map_.variables:
        return None
    try:
        rows = [[*row, row[0] * 0] for row in map_.matrix]
    except TooLarge:
        return None
    return [(format_polynomial(factor), power) for factor, power in factored(kernel_minors(rows, counted_product)[-1])]


def default_eps(system: QuadraticSystem | MapFamily, seed: int) -> tuple[fmpq, ...]:
    """Return two rational eps of small height, which depend on map and seed only; (1,) for a map without eps."""
    if unsupported_reason := as_map(system).unsupported_reason:
        raise InputError(unsupported_reason)
    if not as_map(system).has_eps:
        return (fmpq(1),)
    rng = random.Random(f"singularities eps {derive_seed(seed, as_map(system).seed_data)}")
    first_eps = fmpq(rng.randint(2, 9), 11)
    return first_eps, fmpq(rng.randint(2, 11), 13)


def _is_dominant(map_: MapFamily, eps: fmpq) -> bool:
    """Return whether the map is dominant: det dPhi is not 0 at one of a few random points modulo primes.

    The answer True is proved. False is wrong if the determinant vanishes at all these points, but not identically.
    """
    rng = random.Random(f"dominant {derive_seed(0, map_.seed_data, eps)}")
    for _ in range(_POINTS):
        field = GF(random_prime(rng))  # if det dPhi is not 0 modulo p, it is not 0 over Q
        try:
            if det(map_.at(eps, field).jacobian([rng.randrange(field.prime) for _ in range(map_.dim)])) != 0:
                return True
        except (SingularStep, BadPrime):
            continue
    return False
