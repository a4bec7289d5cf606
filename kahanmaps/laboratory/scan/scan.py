"""The search for integrable members of a family of maps: components of parameter space on which degrees are smaller.

For several small primes p, the degrees of the iterates of all members with parameters in GF(p) are measured (`sweep`).
Members with smaller degrees than a generic member are special. Special members with the same degrees form a class,
which is decomposed into components modulo each prime (`modular_components`). Components that appear modulo all primes
are lifted to conditions over Q (`lift`). A condition is *confirmed* if random members that satisfy it modulo large
primes have the same degrees (`members`). None of this is a proof. The growth is that of one member.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate, chain, islice, product
from typing import Any

from flint import fmpq, fmpz

from kahanmaps.algebra.chance import derive_seed
from kahanmaps.algebra.fields import QQ, rational
from kahanmaps.algebra.work import Budget, units_at
from kahanmaps.documents.inline import as_file
from kahanmaps.documents.symbols import map_with_symbols, split_names
from kahanmaps.errors import BadPrime, InputError, counted
from kahanmaps.hard_stop import TimeLimit
from kahanmaps.invariants.growth import GROWTHS_OF_DEGREES, Growth
from kahanmaps.laboratory.analysis import analyze
from kahanmaps.laboratory.growth.curves import Ended
from kahanmaps.laboratory.growth.degrees import DegreeGrowth, degree_growth
from kahanmaps.laboratory.scan.conditions import conditions, points_outside
from kahanmaps.laboratory.scan.members import ScannedFamily, point_on
from kahanmaps.laboratory.scan.parameter_symmetries import symmetries
from kahanmaps.laboratory.scan.result import STEPS, Component, Scan
from kahanmaps.laboratory.scan.sweep import Choice, Degrees, Sweep, TimeOver, sweep
from kahanmaps.maps.convention import resolve_eps
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.maps.kahan import SystemLike
from kahanmaps.processes import processors

Progress = Callable[[str], None]

UNITS = 240e6  # of counted work at effort 1, mostly for sweeps, which run on all processors
MAX_PARAMETERS = 8
# For each number of parameters, the primes modulo which all members are measured: the preferred list, then lists for
# families with expensive members. (One parameter needs many primes: a cubic splits modulo one prime in 6.)
_PRIMES: dict[int, tuple[tuple[int, ...], ...]] = {
    1: (
        tuple(p for p in range(307, 500) if fmpz(p).is_prime()),
        (307, 311, 313, 317, 331, 337, 347, 349, 353, 359),
        (101, 103, 107, 109),
    ),
    2: ((53, 59, 61, 67), (29, 31, 37, 41)),
    3: ((19, 23, 29, 31), (11, 13, 17, 19)),
}
# Further primes, as many as the budget allows, for unassigned members that may be points over number fields.
_FURTHER_PRIMES = {2: (71, 73, 79, 83, 89, 97, 101, 103), 3: (37, 41, 43)}
# The primes for members on random lines of parameter space. Three of them split in Q(sqrt(d)) for each |d| <= 10: a
# hypersurface that is reducible over such a field has points on lines only modulo primes that split.
_LINE_PRIMES = (107, 131, 139, 193, 241, 281)
_LINES = {2: (24, 12), 3: (32, 16)}  # by number of parameters: the preferred number of lines, and a smaller one
_LINE_FACTOR = 4  # the number of lines is multiplied by this factor if hypersurfaces were missed
_MANY_LINES = (150, 60)  # the same two numbers for more than 3 parameters
# The number of random planes, and their primes. Planes meet components of codimension 2, which lines do not meet.
_PLANES, _PLANE_PRIMES = 24, (19, 23, 29, 31)
_SWEEP_SHARE = 0.3  # the share of the budget for the measurement of all members on one line each
# The shares of the budget that may be spent by the end of each stage; analyses use what remains.
_SWEEPS_END, _CONDITIONS_END, _CONFIRMATION_END, _GROWTH_END = 0.6, 0.75, 0.85, 0.9
# Bounds of the numbers of coefficients of polynomials before cancellation: for up to 2 parameters, and for more.
_DEFAULT_LENGTH, _DEFAULT_LENGTH_OF_MANY = 260, 220
_MAX_LENGTH = 4096  # the bound if the number of iterates is given as `terms`
_TRIAL_PRIME = 8179  # so large that random members are rarely special
_MAX_TERMS = 7  # maximal default number of iterates
_CONFIRMING_MEMBERS = 3  # number of random members measured to confirm a component
_TRIES = 20  # maximal number of attempts to obtain a rational member
_GROWTH_UNITS, _GROWTH_ATTEMPTS = 30e6, 2  # budget and maximal number of attempts for the growth of a member
# For the growth without a rational member: the number of measured degrees, and a bound of the degrees.
_FITTED_TERMS, _MAX_FITTED_DEGREE = 26, 1000
_COMPARED_DEGREE = 100  # degrees are compared at least up to this value
# Kinds of growth that are measured on each component, even if its first degrees are those of another component.
_MEASURED_ON_EACH = (Growth.LINEAR, Growth.QUADRATIC, Growth.POLYNOMIAL)


def scan(
    system: SystemLike,
    over: Sequence[str],
    *,
    eps: Any = None,
    time_step: Any = None,
    h: Any = None,
    terms: int | None = None,
    primes: Sequence[int] | None = None,
    effort: int | Budget = 1,
    seed: int = 0,
    jobs: int | None = None,
    analysis: int | None = None,
    progress: Progress = lambda _: None,
) -> Scan:
    """Search for conditions on parameters under which the degrees of the iterates are smaller than generically.

    Args:
        system: the family: a system or map with parameters. The claims of its file are ignored.
        over: names of the parameters that vary (eps may be one of them); the others have the values of the file.
        eps: half the time step (exact), or None for generic eps: the conditions then hold for every eps.
        time_step, h: the time step 2 eps, instead of eps.
        terms: the number of iterates that are measured; by default at most 7, fewer if degrees are large.
        primes: at least three primes; the default depends on the number of parameters and the budget.
        effort: an integer; each increase by 1 doubles the work limit. Stages that are skipped are reported.
        seed: the random seed.
        jobs: the number of threads (threads need numba); by default the number of processors.
        analysis: the effort of an analysis of a rational member on each component without exponential growth; of
            several points with the same degrees only one is analyzed. None: no analyses.
        progress: called repeatedly with a message; a TimeOver that it raises, or a TimeLimit, ends the scan early.

    Returns:
        A `Scan`. Conditions are lifted from primes and confirmed at random members; this is evidence, not proof.

    Raises:
        InputError: for unknown parameters, unsuitable primes, or a map that is nowhere defined.

    >>> from kahanmaps.documents.files import parse_system
    >>> lines = parse_system('''variables = ["x", "y"]
    ... parameters.g = 1
    ... [system]
    ... rhs = ["x*(x + 2*y)", "-y*((g + 1)*x + g*y)"]''')
    >>> scanned = scan(lines, ["g"], terms=4, primes=[31, 37, 41])
    >>> [component.text for component in scanned.components if component.growth.growth == "quadratic"]
    ['2', '1']
    """
    file, eps = as_file(system), resolve_eps(eps, time_step, h)
    names = tuple(dict.fromkeys(split_names(over)))
    if not names:
        raise InputError("found no parameter to scan over, expected at least one")
    if len(names) > MAX_PARAMETERS:
        raise InputError(f"found {len(names)} parameters to scan over, expected at most {MAX_PARAMETERS}")
    symbols = [name for name in names if name != "eps"]
    map_ = map_with_symbols(file, symbols)
    exact_eps = None if eps is None else rational(eps)
    if exact_eps is not None and "eps" in names:
        raise InputError("found eps both as a number and as a parameter to scan over, expected one of the two")
    if "eps" in names and not map_.has_eps:
        raise InputError("found eps as a parameter to scan over, expected a map that depends on it")
    if exact_eps == 0:
        raise InputError("found eps = 0, expected another number: at eps = 0 the Kahan map is the identity")
    names = (*symbols, *(["eps"] if "eps" in names else []))
    family = ScannedFamily(file, names, map_, exact_eps, seed)
    if jobs is not None and jobs < 1:
        raise InputError(f"found {jobs} jobs, expected at least 1")
    composites = [p for p in primes or () if not fmpz(p).is_prime()]
    if composites:
        raise InputError(f"found {composites[0]} among the primes to scan modulo, expected a prime number")
    if primes is not None and (len(set(primes)) < 3 or min(primes) < 5):
        primes_text = ", ".join(map(str, primes))
        raise InputError(f"found the primes {primes_text}, expected at least three different ones, from 5 on")
    rng = random.Random(seed_prefix := f"scan {derive_seed(seed, names, map_.seed_data, exact_eps)}")
    terms, max_polynomial_length, cost = _choose_terms(map_, len(names), exact_eps, terms, rng)
    jobs, budget = jobs or processors(), effort if isinstance(effort, Budget) else Budget(units_at(effort, UNITS))
    max_members = _SWEEP_SHARE * budget.units / cost
    run = _ScanRun(
        family, seed_prefix, {"terms": terms, "max_length": max_polynomial_length, "jobs": jobs}, budget, cost, progress
    )
    run.sweep(_choose_plan(len(names), primes, max_members))
    components, omitted_count = run.components(rng)
    for plan_further_members in (run.plan_lines, run.plan_primes):
        if not (omitted_count or run.omitted) and (plan := plan_further_members(components, primes, max_members)):
            run.sweep(plan)
            components, omitted_count = run.components(rng)
    run.omit(omitted_count, f"all conditions for {counted(omitted_count, 'sequence')} of degrees")
    candidates = components
    components, omitted_count = run.apply(
        candidates,
        "confirms component",
        _CONFIRMATION_END,
        lambda component, check: _confirm(component, family, candidates, rng, check),
    )
    run.omit(omitted_count, f"the confirmation of {counted(omitted_count, 'component')}")
    components.sort(key=lambda component: component.degrees[::-1])
    # Growth measured on one component; another component with the same degrees shares it if further degrees agree.
    shared_growths: dict[Degrees, DegreeGrowth] = {}
    components, omitted_count = run.apply(
        components,
        "growth on component",
        1 if analysis is None else _GROWTH_END,
        lambda component, _: run.with_growth(component, shared_growths),
    )
    run.omit(omitted_count, f"the growth on {omitted_count} components")
    growth_kinds = {component.degrees: Growth.UNKNOWN for component in components}
    growth_kinds |= {
        component.degrees: component.growth.growth for component in reversed(components) if component.growth is not None
    }
    components.sort(key=lambda c: (GROWTHS_OF_DEGREES.index(growth_kinds[c.degrees]), c.degrees[::-1], c.text))
    if analysis is not None:
        analyzed_degrees: set[Degrees] = set()  # the degree sequences of analyzed points

        def add_verdict(component: Component, _: Callable[[], None]) -> Component:
            is_exponential = component.growth is None or component.growth.growth is Growth.EXPONENTIAL
            if component.values is None or is_exponential or component.degrees in analyzed_degrees:
                return component
            if component.dimension == 0:
                analyzed_degrees.add(component.degrees)
            member, eps_of_member = family.member(component.values)
            result = analyze(member, eps=eps_of_member, effort=analysis, seed=family.seed)
            return replace(component, verdict=result.conclusion)

        components, omitted_count = run.apply(components, "analysis of a member on component", 1, add_verdict)
        run.omit(omitted_count, f"{omitted_count} verdicts")
    sweeps = tuple(run.sweeps)
    unassigned = tuple(_count_unassigned(result, components) for result in sweeps)
    parameter_changes: tuple[tuple[str, ...], ...] = ()
    try:
        parameter_changes = tuple(symmetries(sweeps, components, names))
    except TimeLimit:
        run.is_interrupted = True
        run.omit(1, "changes of parameters that permute the special members")
    ended = "interrupted" if run.is_interrupted else "budget" if run.omitted else "complete"
    generic_degrees = sweeps[0].generic if sweeps else ()
    omitted = tuple(run.omitted)
    return Scan(
        file,
        names,
        exact_eps,
        seed,
        generic_degrees,
        tuple(components),
        sweeps,
        unassigned,
        parameter_changes,
        ended,
        omitted,
    )


@dataclass
class _ScanRun:
    """The state of one scan: its sweeps so far, its budget, and what was omitted."""

    family: ScannedFamily
    seed_prefix: str  # the prefix of the seeds of all random choices
    sweep_options: dict[str, Any]
    budget: Budget
    cost: float  # units of work for one member
    progress: Progress
    sweeps: list[Sweep] = field(default_factory=list)
    omitted: list[str] = field(default_factory=list)
    stage: str = "scan"
    is_interrupted: bool = False
    planned_members: int = 0

    def report(self, sentence: str) -> None:
        """Report the current stage as progress. Raises TimeOver if the scan was interrupted."""
        self.stage = sentence
        if self.is_interrupted:
            raise TimeOver
        try:
            self.progress(sentence)
        except TimeOver:
            self.is_interrupted = True
            raise

    def check_until(self, share: float) -> Callable[[], None]:
        """Return a function that raises TimeOver when this share of the budget is spent."""

        def check() -> None:
            self.report(self.stage)
            if self.budget.spent > share * self.budget.units:
                raise TimeOver

        return check

    def omit(self, count: int, text: str) -> None:
        """Record the phrase `text`, which names what was omitted, if `count` is not 0."""
        if count:
            self.omitted.append(text)

    def sweep(self, plan: list[Choice]) -> None:
        """Sweep as planned; then drop all sweeps with smaller generic degrees than another sweep."""
        self.planned_members += _count_members(len(self.family.names), plan)

        def on_progress(done: int, _: int) -> None:
            self.report(
                f"scan: {done + sum(sweep.member_count for sweep in self.sweeps)} of {self.planned_members} members"
            )

        for index, (p, subspace_count, dimension) in enumerate(plan):
            try:
                result = sweep(
                    self.family.map,
                    len(self.family.names),
                    p,
                    self.family.eps,
                    on=None if subspace_count is None else (subspace_count, dimension),
                    units=self.cost,
                    seed=f"{self.seed_prefix} {p} {subspace_count} {dimension}",
                    check=self.check_until(_SWEEPS_END),
                    progress=on_progress,
                    **self.sweep_options,
                )
                self.sweeps.append(result)
            except BadPrime:
                continue
            except (TimeOver, TimeLimit) as stop:
                self.is_interrupted |= isinstance(stop, TimeLimit)
                self.omit(1, f"members modulo {', '.join(str(p) for p, *_ in plan[index:])}")
                break
        generic = max((sweep.generic for sweep in self.sweeps), default=())
        self.sweeps[:] = [sweep for sweep in self.sweeps if sweep.generic == generic]

    def plan_lines(self, components: Sequence[Component], _: Sequence[int] | None, max_members: float) -> list[Choice]:
        """Plan 4 times as many random lines as before, if the lines so far probably missed a hypersurface.

        A hypersurface was probably missed if there are as many unassigned members as a hypersurface has points. The
        plan replaces the earlier sweeps over lines. It is empty if none was missed, or if it is too long.
        """
        pairs = [(sweep, sweep.member_count / sweep.prime) for sweep in self.sweeps if sweep.on_lines]
        plan: list[Choice] = [(sweep.prime, _LINE_FACTOR * round(size), 1) for sweep, size in pairs]
        is_missing = any(_count_unassigned(sweep, components) >= 0.5 * size for sweep, size in pairs)
        if not is_missing or _count_members(len(self.family.names), plan) > max_members:
            return []
        self.sweeps[:] = [sweep for sweep in self.sweeps if not sweep.on_lines]
        return plan

    def plan_primes(
        self, components: Sequence[Component], primes: Sequence[int] | None, max_members: float
    ) -> list[Choice]:
        """Plan further primes, with at most `max_members` members in total, if points were probably missed.

        Points were probably missed if there are unassigned members, but fewer than a curve (on random lines: a
        hypersurface) has points. The plan is empty if no points were missed, or if the user gave the primes.
        """
        pairs = ((sweep, sweep.prime if sweep.complete else sweep.member_count / sweep.prime) for sweep in self.sweeps)
        if primes is not None or not any(
            0 < _count_unassigned(sweep, components) < 0.5 * size for sweep, size in pairs
        ):
            return []
        plan: list[Choice] = [(p, None, 1) for p in _FURTHER_PRIMES.get(len(self.family.names), ())]
        totals = accumulate(
            (_count_members(len(self.family.names), [choice]) for choice in plan), initial=self.planned_members
        )
        return [choice for choice, total in zip(plan, islice(totals, 1, None), strict=True) if total <= max_members]

    def apply(
        self,
        items: Sequence[Any],
        stage_text: str,
        share: float,
        function: Callable[..., Any],
        fallback: Callable[[Any], Any] = lambda item: item,
    ) -> tuple[list[Any], int]:
        """Apply `function` to each item until this share of the budget is spent; apply `fallback` to the other items.

        Returns the results and the number of items for which `fallback` was used.
        """
        results, fallback_count, check = [], 0, self.check_until(share)
        for k, item in enumerate(items):
            try:
                self.stage = f"scan: {stage_text} {k + 1} of {len(items)}"
                check()
                results.append(function(item, check))
            except (TimeOver, TimeLimit) as stop:
                self.is_interrupted |= isinstance(stop, TimeLimit)
                fallback_count += 1
                results.append(fallback(item))
        return results, fallback_count

    def components(self, rng: random.Random) -> tuple[list[Component], int]:
        """Return the components, sorted by degrees, and the number of degree sequences that were not searched."""
        names, classes = self.family.names, sorted({degrees for sweep in self.sweeps for degrees in sweep.classes})
        components, skipped_count = self.apply(
            classes,
            "conditions for sequence of degrees",
            _CONDITIONS_END,
            lambda degrees, check: conditions(degrees, self.sweeps, names, rng, check),
            fallback=lambda _: [],
        )
        return list(chain.from_iterable(components)), skipped_count

    def with_growth(self, component: Component, shared_growths: dict[Degrees, DegreeGrowth]) -> Component:
        """Add the growth of a rational member; if there is none, or its degrees differ, that of `_fit_growth`.

        Nothing is added if the component shares the growth of another component, or if an iterate is nowhere defined.
        """
        family = self.family
        if component.degrees[-1] < 0 or _continues_as(component, shared_growths.get(component.degrees), family):
            return component
        growth = None
        if component.values is not None:
            member, eps_of_member = family.member(component.values)
            for attempt in range(_GROWTH_ATTEMPTS):  # singularities depend on a random eps: retry
                growth = degree_growth(
                    member.map,
                    eps_of_member,
                    seed=family.seed + attempt,
                    effort=Budget(min(_GROWTH_UNITS, self.budget.left)),
                    steps=STEPS,
                    enclosed=False,
                )
                if growth.growth is not Growth.UNKNOWN:
                    break
        if growth is None or not _agree(growth.degrees, (1, *component.degrees)):
            growth = _fit_growth(component, family)
        if growth is not None and growth.growth not in _MEASURED_ON_EACH:
            shared_growths[component.degrees] = growth
        return replace(component, growth=growth)


def _fit_growth(
    component: Component, family: ScannedFamily, max_degree: int = _MAX_FITTED_DEGREE
) -> DegreeGrowth | None:
    """Return the growth fitted to up to 26 degrees of a random member modulo a prime; None without such a member."""
    expected_degrees = [component.degrees[-1]] * _FITTED_TERMS
    degrees = family.degrees_on(component.equations, expected_degrees, random.Random(family.seed), max_degree)
    if degrees is None:
        return None
    message = f"{len(degrees)} iterates measured"
    return DegreeGrowth((1, *degrees), family.eps, Ended.TERMS, message, family.seed, (), ())


def _continues_as(component: Component, other_growth: DegreeGrowth | None, family: ScannedFamily) -> bool:
    """Return whether further degrees agree with those of another component that has the same first degrees."""
    if other_growth is None:
        return False
    growth = _fit_growth(component, family, max(_COMPARED_DEGREE, 2 * component.degrees[-1]))
    return growth is not None and _agree(growth.degrees, other_growth.degrees)


def _agree(degrees: Degrees, other_degrees: Degrees) -> bool:
    return all(a == b for a, b in zip(degrees, other_degrees, strict=False))


def _choose_plan(parameter_count: int, primes: Sequence[int] | None, max_members: float) -> list[Choice]:
    """Choose primes, each with a number and the dimension of random lines or planes, or with None for all members.

    Returns the first of several plans that needs at most `max_members` members, or else the last one.
    """
    plans: list[list[Choice]]
    on_lines: list[list[Choice]] = [[(p, n, 1) for p in _LINE_PRIMES] for n in _LINES.get(parameter_count, _MANY_LINES)]
    if parameter_count in _PRIMES:
        full_plans: list[list[Choice]] = [
            [(p, None, 1) for p in group] for group in (_PRIMES[parameter_count] if primes is None else (primes,))
        ]
        plans = [
            [*main_plan, *(line_plan if parameter_count > 1 else ())]
            for main_plan, line_plan in product(full_plans, [*on_lines, []])
        ]
    else:
        planes: list[Choice] = [(p, _PLANES, 2) for p in _PLANE_PRIMES]
        plans = [[*main_plan, *planes] for main_plan in on_lines] + on_lines
        plans = plans if primes is None else [[(p, n, 1) for p in primes] for n in _MANY_LINES[:1]]
    return next((plan for plan in plans if _count_members(parameter_count, plan) <= max_members), plans[-1])


def _choose_terms(
    map_: MapFamily, parameter_count: int, eps: fmpq | None, terms: int | None, rng: random.Random
) -> tuple[int, int, float]:
    """Return the number of iterates to measure, a bound of the lengths of polynomials, and the work per member.

    These numbers are determined from the degrees of a few members modulo a larger prime.
    """
    import numpy as np

    from kahanmaps.maps.residues.families import LONG, NOWHERE, Family

    if terms is not None and not 1 <= terms <= 2 * _MAX_TERMS:
        raise InputError(f"found {terms} terms, expected 1 to {2 * _MAX_TERMS}")
    family = Family(map_, _TRIAL_PRIME)
    members = np.array([[rng.randrange(1, _TRIAL_PRIME) for _ in range(parameter_count)] for _ in range(8)])
    default_length = _DEFAULT_LENGTH if parameter_count <= 2 else _DEFAULT_LENGTH_OF_MANY
    max_length = default_length if terms is None else _MAX_LENGTH
    degrees = family.degrees(members, eps, terms or _MAX_TERMS, max_length, rng).max(axis=0).tolist()
    if degrees[0] == NOWHERE:
        raise InputError("the map is not defined at any point, for all parameters")
    term_count = sum(degree >= 0 for degree in degrees)
    if term_count == 0 or (terms is not None and term_count < terms):
        raise InputError(f"the degrees of {terms or 1} iterates are too large to be scanned, expected fewer")
    max_length = max(family.dim * family.degree * d + 1 for d in [1, *degrees[: term_count - 1]])
    # Compile the kernel now, when there are no results that Ctrl-C during the compilation could lose.
    family.degrees(np.resize(members, (LONG, parameter_count)), eps, 1, max_length, random.Random(0))
    return term_count, max_length, family.units([1, *degrees[:term_count]])


def _confirm(
    component: Component,
    family: ScannedFamily,
    other_components: Sequence[Component],
    rng: random.Random,
    check: Callable[[], None] = lambda: None,
) -> Component:
    """Measure random members on a component, and search for a rational member outside smaller components."""
    degree_sequences, names = [], family.names
    for _ in range(_CONFIRMING_MEMBERS):
        check()
        degree_sequences.append(family.degrees_on(component.equations, component.degrees, rng))
    sequences = [degrees for degrees in degree_sequences if degrees is not None]
    values = None
    for _ in range(_TRIES):
        point = point_on(component.equations, len(names), QQ, rng)
        if point is None:
            break
        if names[-1] == "eps" and point[-1] == 0:
            continue
        if not any(other.dimension < component.dimension and other.contains(point) for other in other_components):
            values = dict(zip(names, point, strict=True))
            break
    return replace(component, tried=len(sequences), confirmed=sequences.count(component.degrees), values=values)


def _count_unassigned(sweep: Sweep, components: Sequence[Component]) -> int:
    """Return the number of special members modulo the prime of a sweep that lie on no component with their degrees."""
    return sum(
        len(points_outside(points, [c for c in components if c.degrees == degrees], sweep.prime))
        for degrees, points in sweep.classes.items()
    )


def _count_members(dim: int, plan: Sequence[Choice]) -> int:
    return sum(int(p**dim if count is None else p**k * count) for p, count, k in plan)
