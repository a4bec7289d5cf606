"""Which members of a family of maps are integrable: components of parameter space where degrees grow more slowly.

All members with parameters in GF(p) are tried for several small primes p (`sweep`). Those with smaller degrees than a
generic member are special. They fall into classes by their degrees, and these into components modulo each prime
(`modular_components`); components that appear modulo all primes are lifted to conditions over Q (`lift`). A condition
is *found modulo* these primes. It is *confirmed* where members on it, random modulo large primes, have the same degrees
by the computation that `degrees` does. Nothing of this is a proof. The kind of growth is that of one rational member.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate, islice, product
from typing import Any

from flint import fmpq, fmpz

from kahanmaps.algebra.chance import derive_seed
from kahanmaps.algebra.fields import QQ, rational
from kahanmaps.algebra.work import Budget, units_at
from kahanmaps.documents.inline import as_file
from kahanmaps.documents.symbols import map_with_symbols
from kahanmaps.errors import BadPrime, InputError, counted
from kahanmaps.hard_stop import TimeLimit
from kahanmaps.invariants.growth import OF_DEGREES, Growth
from kahanmaps.laboratory.analysis import analyze
from kahanmaps.laboratory.growth.curves import Ended
from kahanmaps.laboratory.growth.degrees import DegreeGrowth, degree_growth
from kahanmaps.laboratory.scan.conditions import conditions, points_outside
from kahanmaps.laboratory.scan.members import Scanned, point_on
from kahanmaps.laboratory.scan.parameter_symmetries import symmetries
from kahanmaps.laboratory.scan.result import STEPS, Component, Scan
from kahanmaps.laboratory.scan.sweep import Choice, Degrees, Sweep, TimeOver, sweep
from kahanmaps.maps.convention import resolve_eps
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.maps.kahan import SystemLike
from kahanmaps.processes import processors

Progress = Callable[[str], None]

UNITS = 240e6  # of counted work at effort 1, most of it that of the kernel, which sweeps on all processors
MAX_PARAMETERS = 8
# By the number of parameters the primes modulo which all members are tried: the ones that are wished, then those for
# families that take their time. A polynomial of degree 3 in one parameter has all its zeros modulo one prime in 6.
_PRIMES: dict[int, tuple[tuple[int, ...], ...]] = {
    1: (
        tuple(p for p in range(307, 500) if fmpz(p).is_prime()),
        (307, 311, 313, 317, 331, 337, 347, 349, 353, 359),
        (101, 103, 107, 109),
    ),
    2: ((53, 59, 61, 67), (29, 31, 37, 41)),
    3: ((19, 23, 29, 31), (11, 13, 17, 19)),
}
# More of these, as many as the budget allows, where members are left that may be points over number fields.
_FURTHER = {2: (71, 73, 79, 83, 89, 97, 101, 103), 3: (37, 41, 43)}
# Those for members on random lines of parameter space. Each of the fields of the roots of d, d up to 10 and down to
# -10, splits modulo three of them: else hypersurfaces that split over such a field have no points to be found.
_SPLIT = (107, 131, 139, 193, 241, 281)
_LINES = {2: (24, 12), 3: (32, 16)}  # how many are wished, and fewer, by the number of parameters
_MORE = 4  # times as many, where hypersurfaces were missed
_MANY_LINES = (150, 60)
_PLANES, _OF_PLANES = 24, (19, 23, 29, 31)  # random ones, for what lines do not meet, and the primes
_PART = 0.3  # of the budget, for all members on their first line
_UNTIL = (0.6, 0.75, 0.85, 0.9)  # of the budget: when members, conditions, their confirmation and growth end
_ROOM, _ROOM_OF_MANY = 260, 220  # for degrees before common factors are removed: up to 2 parameters, and more
_MOST_ROOM = 4096
_TRIAL_PRIME = 8179  # modulo which hardly a member is special
_MOST_TERMS = 7
_MEMBERS = 3  # that confirm a component
_TRIES = 20  # for a rational member
_OF_GROWTH, _ATTEMPTS = 30e6, 2  # for the growth at a member
_TERMS, _LARGE = 26, 1000  # where no rational member is known: so many degrees, as far as they are not above this
_SOME = 100  # the degree up to which they are compared, at least
_MEASURED_EACH = (Growth.LINEAR, Growth.QUADRATIC, Growth.POLYNOMIAL)


def scan(
    system: SystemLike,
    over: Sequence[str],
    *,
    eps: Any = None,
    time_step: Any = None,
    terms: int | None = None,
    primes: Sequence[int] | None = None,
    effort: int | Budget = 1,
    seed: int = 0,
    jobs: int | None = None,
    analysis: int | None = None,
    progress: Progress = lambda _: None,
) -> Scan:
    """The conditions on parameters under which the degrees of the iterates are smaller than in general.

    Args:
        system: the family; its claims are ignored.
        over: names of its parameters that vary, the others have the values of the file; eps may be one of them.
        eps: an exact number, or None for generic eps: conditions that hold for every eps.
        time_step: 2 eps, in its place.
        terms: how many iterates are measured, by default as many as have small degrees, at most 7.
        primes: at least three primes, by default such that the members are some ten thousand.
        effort: an integer; each increase by 1 doubles the work. What was not done is reported.
        seed: the random seed.
        jobs: threads, by default as many as processors; they need numba.
        analysis: the effort of an analysis of a member on each component whose degrees do not grow exponentially; of
            points with the same degrees one is enough. None for none.
        progress: called with a message again and again; if it raises TimeOver, the scan ends with the result so far, as
            it does at a TimeLimit.

    Returns:
        A `Scan`. Conditions are found modulo primes and confirmed at members, which is evidence and no proof.

    Raises:
        InputError: for unknown parameters, wrong primes, a map that exists nowhere.

    >>> from kahanmaps.documents.files import parse_system
    >>> lines = parse_system('''variables = ["x", "y"]
    ... parameters.g = 1
    ... [system]
    ... rhs = ["x*(x + 2*y)", "-y*((g + 1)*x + g*y)"]''')
    >>> found = scan(lines, ["g"], terms=4, primes=[31, 37, 41])
    >>> [one.text for one in found.components if one.growth.growth == "quadratic"]
    ['2', '1']
    """
    file, eps = as_file(system), resolve_eps(eps, time_step)
    names = tuple(dict.fromkeys(over))
    if not names:
        raise InputError("found no parameter to scan over, expected at least one")
    if len(names) > MAX_PARAMETERS:
        raise InputError(f"found {len(names)} parameters to scan over, expected at most {MAX_PARAMETERS}")
    symbols = [name for name in names if name != "eps"]
    map_ = map_with_symbols(file, symbols)
    exact = None if eps is None else rational(eps)
    if exact is not None and "eps" in names:
        raise InputError("found eps both as a number and as a parameter to scan over, expected one of the two")
    if "eps" in names and not map_.has_eps:
        raise InputError("found eps as a parameter to scan over, expected a map that depends on it")
    if exact == 0:
        raise InputError("found eps = 0, expected another number: at eps = 0 the Kahan map is the identity")
    names = (*symbols, *(["eps"] if "eps" in names else []))
    family = Scanned(file, names, map_, exact, seed)
    if jobs is not None and jobs < 1:
        raise InputError(f"found {jobs} jobs, expected at least 1")
    composite = [p for p in primes or () if not fmpz(p).is_prime()]
    if composite:
        raise InputError(f"found {composite[0]} among the primes to scan modulo, which is not one")
    if primes is not None and (len(set(primes)) < 3 or min(primes) < 5):
        given = ", ".join(map(str, primes))
        raise InputError(f"found the primes {given}, expected at least three different ones, from 5 on")
    rng = random.Random(start := f"scan {derive_seed(seed, names, map_.subject, exact)}")
    terms, room, cost = _terms(map_, len(names), exact, terms, rng)
    jobs, budget = jobs or processors(), effort if isinstance(effort, Budget) else Budget(units_at(effort, UNITS))
    most = _PART * budget.units / cost
    run = _Sweeping(family, start, {"terms": terms, "room": room, "jobs": jobs}, budget, cost, progress)
    run.take(_plan(len(names), primes, most))
    known, missed = run.components(rng)
    for more in (run.more_lines, run.more_primes):
        if not (missed or run.omitted) and (further := more(known, primes, most)):
            run.take(further)
            known, missed = run.components(rng)
    run.omit(missed, f"all conditions for {counted(missed, 'sequence')} of degrees")
    before = known
    known, missed = run.each(
        before, "confirms component", _UNTIL[2], lambda one, check: _confirmed(one, family, before, rng, check)
    )
    run.omit(missed, f"the confirmation of {counted(missed, 'component')}")
    known.sort(key=lambda one: one.degrees[::-1])
    enough: dict[Degrees, DegreeGrowth] = {}  # of these one member is enough, if further degrees of others are its own

    def with_growth(one: Component, _: Callable[[], None]) -> Component:
        if one.degrees[-1] < 0 or _goes_on(one, enough.get(one.degrees), family):
            return one
        growth = _growth(one, family, budget)
        if growth is not None and growth.growth not in _MEASURED_EACH:
            enough[one.degrees] = growth
        return replace(one, growth=growth)

    known, missed = run.each(known, "growth on component", 1 if analysis is None else _UNTIL[3], with_growth)
    run.omit(missed, f"the growth on {missed} components")
    kinds = {one.degrees: one.growth.growth for one in reversed(known) if one.growth is not None}
    kinds |= {one.degrees: Growth.UNKNOWN for one in known if one.degrees not in kinds}
    known.sort(key=lambda one: (OF_DEGREES.index(kinds[one.degrees]), one.degrees[::-1], one.text))
    if analysis is not None:
        points: set[Degrees] = set()

        def with_verdict(one: Component, _: Callable[[], None]) -> Component:
            is_exponential = one.growth is None or one.growth.growth is Growth.EXPONENTIAL
            if one.values is None or is_exponential or one.degrees in points:
                return one
            if one.dimension == 0:
                points.add(one.degrees)
            member, step = family.member(one.values)
            told = analyze(member, eps=step, effort=analysis, seed=family.seed)
            return replace(one, verdict=told.conclusion)

        known, missed = run.each(known, "analysis of a member on component", 1, with_verdict)
        run.omit(missed, f"{missed} verdicts")
    sweeps = tuple(run.sweeps)
    unassigned = tuple(_unassigned(one, known) for one in sweeps)
    symmetric: tuple[tuple[str, ...], ...] = ()
    try:
        symmetric = tuple(symmetries(sweeps, known, names))
    except TimeLimit:
        run.is_interrupted = True
        run.omit(1, "changes of parameters that permute the special members")
    ended = "interrupted" if run.is_interrupted else "budget" if run.omitted else "complete"
    found = file, names, exact, seed, sweeps[0].generic if sweeps else (), tuple(known)
    return Scan(*found, sweeps, unassigned, symmetric, ended, tuple(run.omitted))


@dataclass
class _Sweeping:
    """The sweeps of one scan as they are made, the budget for it, and what was left out."""

    family: Scanned
    start: str  # of the seeds
    measured: dict[str, Any]
    budget: Budget
    cost: float  # of a member
    progress: Progress
    sweeps: list[Sweep] = field(default_factory=list)
    omitted: list[str] = field(default_factory=list)
    doing: str = "scan"
    is_interrupted: bool = False
    total: int = 0

    def tell(self, sentence: str) -> None:
        """Say what is done now."""
        self.doing = sentence
        if self.is_interrupted:
            raise TimeOver
        try:
            self.progress(sentence)
        except TimeOver:
            self.is_interrupted = True
            raise

    def until(self, part: float) -> Callable[[], None]:
        """What raises TimeOver when a part of the budget is spent."""

        def check() -> None:
            self.tell(self.doing)
            if self.budget.spent > part * self.budget.units:
                raise TimeOver

        return check

    def omit(self, missed: int, what: str) -> None:
        """Say what was left out, if anything was missed."""
        self.omitted += [what] if missed else []

    def take(self, plan: list[Choice]) -> None:
        """Sweep modulo these primes; what differs in the generic degrees from the largest ones is dropped."""
        self.total += _size(len(self.family.names), plan)

        def told(done: int, _: int) -> None:
            self.tell(f"scan: {done + sum(one.seen for one in self.sweeps)} of {self.total} members")

        for k, (p, lines, width) in enumerate(plan):
            try:
                one = sweep(
                    self.family.map,
                    len(self.family.names),
                    p,
                    self.family.eps,
                    on=None if lines is None else (lines, width),
                    units=self.cost,
                    seed=f"{self.start} {p} {lines} {width}",
                    check=self.until(_UNTIL[0]),
                    progress=told,
                    **self.measured,
                )
                self.sweeps.append(one)
            except BadPrime:
                continue
            except (TimeOver, TimeLimit) as end:
                self.is_interrupted |= isinstance(end, TimeLimit)
                self.omit(1, f"members modulo {', '.join(str(p) for p, *_ in plan[k:])}")
                break
        generic = max((one.generic for one in self.sweeps), default=())
        self.sweeps[:] = [one for one in self.sweeps if one.generic == generic]

    def more_lines(self, known: Sequence[Component], _: Sequence[int] | None, most: float) -> list[Choice]:
        """More random lines in place of those there were, of which as many members are left as a hypersurface has.

        None where they are more than `most` members.
        """
        lines = [one for one in self.sweeps if one.on_lines]
        again: list[Choice] = [(one.prime, _MORE * round(one.seen / one.prime), 1) for one in lines]
        is_lacking = any(_unassigned(one, known) >= 0.5 * one.seen / one.prime for one in lines)
        if not is_lacking or _size(len(self.family.names), again) > most:
            return []
        self.sweeps[:] = [one for one in self.sweeps if not one.on_lines]
        return again

    def more_primes(self, known: Sequence[Component], primes: Sequence[int] | None, most: float) -> list[Choice]:
        """Further primes, unless some are given, while there are not more than `most` members in all.

        Where members are left, fewer than a curve has, or than a hypersurface on random lines.
        """
        sizes = ((one, one.prime if one.complete else one.seen / one.prime) for one in self.sweeps)
        if primes is not None or not any(0 < _unassigned(one, known) < 0.5 * size for one, size in sizes):
            return []
        further: list[Choice] = [(p, None, 1) for p in _FURTHER.get(len(self.family.names), ())]
        totals = accumulate((_size(len(self.family.names), [one]) for one in further), initial=self.total)
        return [one for one, total in zip(further, islice(totals, 1, None), strict=True) if total <= most]

    def each(
        self,
        items: Sequence[Any],
        what: str,
        part: float,
        work: Callable[..., Any],
        left: Callable[[Any], Any] = lambda one: one,
    ) -> tuple[list[Any], int]:
        """What `work` makes of each within a part of the budget, `left` of those for which it is spent; how many."""
        done, missed, check = [], 0, self.until(part)
        for k, one in enumerate(items):
            try:
                self.doing = f"scan: {what} {k + 1} of {len(items)}"
                check()
                done.append(work(one, check))
            except (TimeOver, TimeLimit) as end:
                self.is_interrupted |= isinstance(end, TimeLimit)
                missed += 1
                done.append(left(one))
        return done, missed

    def components(self, rng: random.Random) -> tuple[list[Component], int]:
        """The components, those with smaller degrees first, and how many sequences of degrees they are missing for."""
        names, classes = self.family.names, sorted({degrees for one in self.sweeps for degrees in one.classes})
        found, missed = self.each(
            classes,
            "conditions for sequence of degrees",
            _UNTIL[1],
            lambda degrees, check: conditions(degrees, self.sweeps, names, rng, check),
            left=lambda _: [],
        )
        return [one for some in found for one in some], missed


def _growth(one: Component, family: Scanned, budget: Budget) -> DegreeGrowth | None:
    """The growth at a rational member, or that which more degrees fit where there is none, or it is special."""
    known = None
    if one.values is not None:
        member, step = family.member(one.values)
        for attempt in range(_ATTEMPTS):  # singularities are followed at a random eps, which may be special
            known = degree_growth(
                member.map,
                step,
                seed=family.seed + attempt,
                effort=Budget(min(_OF_GROWTH, budget.left)),
                steps=STEPS,
                enclosed=False,
            )
            if known.growth is not Growth.UNKNOWN:
                break
    return known if known is not None and _agree(known.degrees, (1, *one.degrees)) else _beyond(one, family)


def _beyond(one: Component, family: Scanned, most: int = _LARGE) -> DegreeGrowth | None:
    """The growth that more degrees fit, measured modulo a prime; None where there is no member."""
    found = family.degrees_on(one.equations, [one.degrees[-1]] * _TERMS, random.Random(family.seed), most)
    if found is None:
        return None
    return DegreeGrowth((1, *found), family.eps, Ended.TERMS, f"{len(found)} iterates measured", family.seed, (), ())


def _goes_on(one: Component, known: DegreeGrowth | None, family: Scanned) -> bool:
    """Whether degrees go on as they do at a member of another component with the same first ones."""
    if known is None:
        return False
    found = _beyond(one, family, max(_SOME, 2 * one.degrees[-1]))
    return found is not None and _agree(found.degrees, known.degrees)


def _agree(some: Degrees, others: Degrees) -> bool:
    return all(a == b for a, b in zip(some, others, strict=False))


def _plan(count: int, primes: Sequence[int] | None, most: float) -> list[Choice]:
    """Primes, each with the number of random lines of parameter space, or planes, None for all members.

    As many as are wished where these are not more than `most` members, else fewer.
    """
    plans: list[list[Choice]]
    lines: list[list[Choice]] = [[(p, n, 1) for p in _SPLIT] for n in _LINES.get(count, _MANY_LINES)]
    if count in _PRIMES:
        complete: list[list[Choice]] = [
            [(p, None, 1) for p in some] for some in (_PRIMES[count] if primes is None else (primes,))
        ]
        plans = [[*some, *(more if count > 1 else ())] for some, more in product(complete, [*lines, []])]
    else:
        planes: list[Choice] = [(p, _PLANES, 2) for p in _OF_PLANES]
        plans = [[*some, *planes] for some in lines] + lines
        plans = plans if primes is None else [[(p, n, 1) for p in primes] for n in _MANY_LINES[:1]]
    return next((plan for plan in plans if _size(count, plan) <= most), plans[-1])


def _terms(
    map_: MapFamily, count: int, eps: fmpq | None, terms: int | None, rng: random.Random
) -> tuple[int, int, float]:
    """How many iterates are measured, the room that they need, and the units for a member.

    Tried on members modulo a larger prime.
    """
    import numpy as np

    from kahanmaps.maps.residues.families import LONG, NOWHERE, Family

    if terms is not None and not 1 <= terms <= 2 * _MOST_TERMS:
        raise InputError(f"found {terms} terms, expected 1 to {2 * _MOST_TERMS}")
    family = Family(map_, _TRIAL_PRIME)
    tried = np.array([[rng.randrange(1, _TRIAL_PRIME) for _ in range(count)] for _ in range(8)])
    usual = _ROOM if count <= 2 else _ROOM_OF_MANY
    room = usual if terms is None else _MOST_ROOM
    found = family.degrees(tried, eps, terms or _MOST_TERMS, room, rng).max(axis=0).tolist()
    if found[0] == NOWHERE:
        raise InputError("the map is defined nowhere, whatever the parameters are")
    measured = sum(degree >= 0 for degree in found)
    if measured == 0 or (terms is not None and measured < terms):
        raise InputError(f"the degrees of {terms or 1} iterates are too large to be scanned, expected fewer")
    room = max(family.dim * family.degree * d + 1 for d in [1, *found[: measured - 1]])
    # Compiles the kernel, where there is nothing yet that Ctrl-C could keep.
    family.degrees(np.resize(tried, (LONG, count)), eps, 1, room, random.Random(0))
    return measured, room, family.units([1, *found[:measured]])


def _confirmed(
    one: Component,
    family: Scanned,
    others: Sequence[Component],
    rng: random.Random,
    check: Callable[[], None] = lambda: None,
) -> Component:
    """The component with what random members on it say, and a rational one that is on no smaller component."""
    measured, names = [], family.names
    for _ in range(_MEMBERS):
        check()
        measured.append(family.degrees_on(one.equations, one.degrees, rng))
    known = [degrees for degrees in measured if degrees is not None]
    values = None
    for _ in range(_TRIES):
        point = point_on(one.equations, len(names), QQ, rng)
        if point is None:
            break
        if names[-1] == "eps" and point[-1] == 0:
            continue
        if not any(other.dimension < one.dimension and other.contains(point) for other in others):
            values = dict(zip(names, point, strict=True))
            break
    return replace(one, tried=len(known), confirmed=known.count(one.degrees), values=values)


def _unassigned(one: Sweep, components: Sequence[Component]) -> int:
    """The number of special members modulo a prime that are on no component with their degrees."""
    return sum(
        len(points_outside(points, [other for other in components if other.degrees == degrees], one.prime))
        for degrees, points in one.classes.items()
    )


def _size(count: int, plan: Sequence[Choice]) -> int:
    """The number of members of a plan."""
    return sum(int(p**count if lines is None else p**width * lines) for p, lines, width in plan)
