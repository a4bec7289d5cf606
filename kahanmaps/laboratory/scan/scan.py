"""Which members of a family of maps are integrable: components of parameter space where degrees grow more slowly.

All members with parameters in GF(p) are tried for several small primes p (`sweep`). Those whose degrees are smaller
than in general fall into classes by their degrees, these into pieces (`pieces`), and pieces that are there modulo all
primes are lifted to conditions over Q (`lift`). A condition is *found modulo* these primes. It is *confirmed* where
members on it, random modulo large primes, have the same degrees by the computation that `degrees` does. Nothing of this
is a proof. The kind of growth is that of one rational member, as `degrees` has it.
"""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

from flint import fmpq, fmpq_mpoly, fmpz

from kahanmaps.algebra.chance import seed_for
from kahanmaps.algebra.fields import GF, QQ, Field, rational
from kahanmaps.algebra.plain import attributes
from kahanmaps.algebra.polynomials import evaluate, ring
from kahanmaps.algebra.text import format_number, format_polynomial
from kahanmaps.displayed import Displayed
from kahanmaps.documents.files import SystemFile
from kahanmaps.documents.symbols import map_with_symbols, member_of
from kahanmaps.errors import InputError
from kahanmaps.laboratory.growth.degrees import DegreeGrowth, degree_growth
from kahanmaps.laboratory.growth.recurrences import GrowthClass
from kahanmaps.laboratory.scan.lift import flat_equations, height_bound, lifted_flats, lifted_forms, residues
from kahanmaps.laboratory.scan.members import degrees_on, point_on
from kahanmaps.laboratory.scan.pieces import pieces, pivots
from kahanmaps.laboratory.scan.sweep import Degrees, Sweep, TimeOver, sweep
from kahanmaps.maps.implicit import BirationalMap

DEFAULT_SECONDS = 120.0
MAX_PARAMETERS = 8
_PRIMES = {1: (389, 397, 401, 409), 2: (53, 59, 61, 67), 3: (19, 23, 29, 31)}
_PRIMES_OF_LINES, _LINES = (199, 211, 223, 227), 40  # where there are more parameters
_ROOM = 220  # for the degrees before common factors are removed
_MOST_ROOM = 4096
_TRIAL_PRIME = 8179  # modulo which hardly a member is special
_MOST_TERMS = 7
_MEMBERS = 3  # that confirm a component
_SHARE = 0.5  # of the prime, points of a curve at least
_TRIES = 20  # for a rational member
_GROWTH_SECONDS, _STEPS = 2.0, 40
_MEASURED_EACH = (GrowthClass.LINEAR, GrowthClass.QUADRATIC, GrowthClass.POLYNOMIAL)
_ORDER = (*(c for c in GrowthClass if c is not GrowthClass.UNKNOWN), GrowthClass.UNKNOWN)


@dataclass(frozen=True)
class Component:
    """A condition on the parameters: `equations`, polynomials over Q that vanish on it, found modulo `primes`.

    `degrees` are d_1, ..., d_N there. `confirmed` of `tried` random members have them. `values` are those of a rational
    member, None where none was found, and `growth` what its degrees do, None where that was not measured.
    """

    equations: tuple[fmpq_mpoly, ...]
    dimension: int
    degrees: Degrees
    primes: tuple[int, ...]
    confirmed: int = 0
    tried: int = 0
    values: dict[str, fmpq] | None = None
    growth: DegreeGrowth | None = None

    @property
    def is_confirmed(self) -> bool:
        """Whether all members tried have the degrees."""
        return 0 < self.tried == self.confirmed

    @property
    def text(self) -> str:
        """The condition: values of a point, else equations."""
        if self.dimension == 0 and self.values is not None:
            return f"({', '.join(map(format_number, self.values.values()))})"
        return ", ".join(f"{format_polynomial(equation)} = 0" for equation in self.equations)

    def contains(self, other: Component) -> bool:
        """Whether a smaller component, with a rational member, lies on this one: known from that member."""
        if self.dimension <= other.dimension or other.values is None:
            return False
        return _vanishes(self, list(other.values.values()))

    def to_json(self) -> dict[str, Any]:
        """Plain data; equations as text."""
        growth = self.growth
        return {
            **attributes(self, "equations", "dimension", "primes", "confirmed", "tried", "is_confirmed", "values"),
            "growth": None if growth is None else str(growth.growth),
            "growth_text": None if growth is None else growth.growth_text,
        }


@dataclass(frozen=True)
class Scan(Displayed):
    """What a scan found: components, the ones with the slowest growth first.

    `generic` are the degrees d_1, ..., d_N of the other members, `sweeps` what was seen modulo each prime. `left` is
    the number of slow members on no component modulo each of them: points over number fields, of a height above
    `height`, or there by chance. `symmetric` are pairs of parameters whose exchange permutes the slow members.
    `ended` is "complete" or "time".
    """

    file: SystemFile
    over: tuple[str, ...]
    eps: fmpq | None
    seed: int
    generic: Degrees
    components: tuple[Component, ...]
    sweeps: tuple[Sweep, ...]
    left: tuple[int, ...]
    symmetric: tuple[tuple[str, str], ...]
    ended: str

    @property
    def height(self) -> int:
        """Numerators and denominators of single points up to which they are found."""
        return height_bound([one.prime for one in self.sweeps])

    @property
    def complete(self) -> bool:
        """Whether all members modulo the primes were tried, rather than those on random lines of parameter space."""
        return all(one.complete for one in self.sweeps)

    @property
    def classes(self) -> list[tuple[Degrees, list[Component]]]:
        """The components by degrees, in their order."""
        found: dict[Degrees, list[Component]] = {}
        for one in self.components:
            found.setdefault(one.degrees, []).append(one)
        return list(found.items())

    @property
    def coverage(self) -> str:
        """What was tried, and what can have been missed: a sentence or two."""
        parts = [f"{one.seen} modulo {one.prime}" for one in self.sweeps]
        if self.complete:
            return (
                f"all members with parameters modulo the primes: {', '.join(parts)}; single points are found with "
                f"numerators and denominators up to {self.height}, hypersurfaces of a degree up to 6"
            )
        return f"members on random lines of parameter space: {', '.join(parts)}; only hypersurfaces are looked for"

    @property
    def text(self) -> str:
        """Lines for people, a word and a tab at the front."""
        lines = [("in general", ", ".join(map(str, self.generic)))]
        for degrees, members in self.classes:
            growth = next((one.growth for one in members if one.growth is not None), None)
            told = ", ".join("none" if d < 0 else str(d) for d in degrees)
            lines.append(("degrees", told + (f"\t{growth.growth_text}" if growth is not None else "")))
            for dimension in sorted({one.dimension for one in members}, reverse=True):
                here = [one for one in members if one.dimension == dimension]
                for confirmed in (True, False):
                    some = [one.text for one in here if one.is_confirmed is confirmed]
                    if some:
                        where = f"at ({', '.join(self.over)}) =" if dimension == 0 else "where"
                        mark = "" if confirmed else "\tnot confirmed"
                        lines.append((where, f"{(', ' if dimension == 0 else '; ').join(some)}{mark}"))
        if not self.components:
            lines.append(("found", "no condition on the parameters under which degrees are smaller"))
        lines += [("symmetry", f"exchanging {a} and {b} permutes the slow members") for a, b in self.symmetric]
        lines.append(("tried", self.coverage))
        rest = ", ".join(f"{n} modulo {one.prime}" for n, one in zip(self.left, self.sweeps, strict=True))
        lines.append(("left", f"slow members on no component: {rest}"))
        return "\n".join(f"{word}\t{rest}" for word, rest in lines)

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            **attributes(self, "over", "seed", "generic"),
            "classes": [
                {"degrees": list(degrees), "components": [one.to_json() for one in some]}
                for degrees, some in self.classes
            ],
            "symmetric": [list(pair) for pair in self.symmetric],
            "sweeps": [
                {
                    **attributes(one, "prime", "seen", "complete", "accidents"),
                    "slow": sum(map(len, one.classes.values())),
                    "left": left,
                }
                for one, left in zip(self.sweeps, self.left, strict=True)
            ],
            **attributes(self, "height", "coverage", "ended"),
        }

    def member(self, component: Component) -> SystemFile:
        """The system of a rational member on a component. Raises InputError where none is known."""
        if component.values is None:
            raise InputError(f"no rational member is known where {component.text}")
        return member_of(self.file, component.values)


def scan(
    file: SystemFile,
    over: Sequence[str],
    *,
    eps: Any = None,
    terms: int | None = None,
    primes: Sequence[int] | None = None,
    seconds: float = DEFAULT_SECONDS,
    seed: int = 0,
    jobs: int = 1,
    progress: Callable[[str], None] = lambda _: None,
) -> Scan:
    """The conditions on parameters under which the degrees of the iterates are smaller than in general.

    Args:
        file: the family; its claims are not looked at.
        over: names of its parameters that vary, the others have the values of the file.
        eps: an exact number, or None for generic eps: conditions that hold for every eps.
        terms: how many iterates are measured, by default as many as have small degrees, at most 7.
        primes: at least three primes, by default such that the members are some ten thousand.
        seconds: time for everything, about.
        seed: of everything random.
        jobs: threads.
        progress: is told what is being done.

    Returns:
        A `Scan`. Found modulo primes and confirmed at members, which is evidence and no proof.

    Raises:
        InputError: for unknown parameters, wrong primes, a map that exists nowhere.

    >>> from kahanmaps.documents.files import parse_system
    >>> lines = parse_system('''variables = ["x", "y"]
    ... parameters.g = 1
    ... [system]
    ... rhs = ["x*(x + 2*y)", "-y*((g + 1)*x + g*y)"]''')
    >>> found = scan(lines, ["g"], terms=5)
    >>> [one.text for one in found.components if one.growth.growth == "quadratic"]
    ['(1)', '(1/2)', '(2)']
    """
    names = tuple(dict.fromkeys(over))
    if not names:
        raise InputError("found no parameter to scan over, expected at least one")
    if len(names) > MAX_PARAMETERS:
        raise InputError(f"found {len(names)} parameters to scan over, expected at most {MAX_PARAMETERS}")
    map_ = map_with_symbols(file, names)
    exact = None if eps is None else rational(eps)
    if exact == 0:
        raise InputError("found eps = 0, expected another number: at eps = 0 the Kahan map is the identity")
    lines = None if len(names) in _PRIMES else _LINES
    chosen = tuple(primes) if primes is not None else _PRIMES.get(len(names), _PRIMES_OF_LINES)
    if len(set(chosen)) < 3 or any(p < 5 or not fmpz(p).is_prime() for p in chosen):
        raise InputError(f"found the primes {', '.join(map(str, chosen))}, expected three or more different ones from 5")
    rng = random.Random(f"scan {seed_for(seed, names, map_.subject, exact)}")
    began = time.monotonic()
    terms, room = _terms(map_, exact, terms, rng)
    sweeps: list[Sweep] = []
    ended = "complete"
    total = sum(p ** len(names) if lines is None else p * lines for p in chosen)

    def told(done: int, _: int) -> None:
        done += sum(one.seen for one in sweeps)
        left = (time.monotonic() - began) * (total - done) / done
        progress(f"scan: {done} of {total} members, {left:.0f} s left")

    for p in chosen:
        try:
            sweeps.append(
                sweep(
                    map_,
                    p,
                    exact,
                    terms,
                    room,
                    lines=lines,
                    seed=f"{rng.getrandbits(64)} {p}",
                    jobs=jobs,
                    deadline=began + 0.8 * seconds,
                    progress=told,
                )
            )
        except TimeOver:
            ended = "time"
            break
    if not sweeps:
        raise InputError(f"found {seconds} seconds, which is not enough for the members modulo {chosen[0]}")
    generic = max(one.generic for one in sweeps)
    sweeps = [one for one in sweeps if one.generic == generic]
    found = _components(sweeps, names, rng)
    known = []
    for k, one in enumerate(found):
        progress(f"scan: confirms component {k + 1} of {len(found)}")
        known.append(_confirmed(one, names, map_, exact, found, rng))
    known = _with_growth(sorted(known, key=lambda one: one.degrees[::-1]), file, exact, began + seconds, seed, progress)
    left = tuple(_left(one, known) for one in sweeps)
    symmetric = tuple(
        (names[i], names[j]) for i, j in combinations(range(len(names)), 2) if _is_symmetric(sweeps, i, j)
    )
    return Scan(file, names, exact, seed, generic, tuple(known), tuple(sweeps), left, symmetric, ended)


def _terms(map_: BirationalMap, eps: fmpq | None, terms: int | None, rng: random.Random) -> tuple[int, int]:
    """How many iterates are measured, and the room that they need: tried on members modulo a larger prime."""
    import numpy as np

    from kahanmaps.maps.residues.families import NOWHERE, Family

    if terms is not None and not 1 <= terms <= 2 * _MOST_TERMS:
        raise InputError(f"found {terms} terms, expected 1 to {2 * _MOST_TERMS}")
    family = Family(map_, _TRIAL_PRIME)
    tried = np.array([[rng.randrange(_TRIAL_PRIME) for _ in map_.symbols] for _ in range(8)])
    room = _ROOM if terms is None else _MOST_ROOM
    found = family.degrees(tried, eps, terms or _MOST_TERMS, room, rng).max(axis=0).tolist()
    if found[0] == NOWHERE:
        raise InputError("the map has no value anywhere, whatever the parameters are")
    measured = sum(degree >= 0 for degree in found)
    if measured == 0 or (terms is not None and measured < terms):
        raise InputError(f"the degrees of {terms or 1} iterates are too large to be scanned, expected fewer")
    return measured, max(family.dim * family.degree * d + 1 for d in [1, *found[: measured - 1]])


def _components(sweeps: Sequence[Sweep], names: tuple[str, ...], rng: random.Random) -> list[Component]:
    """What the pieces of each class modulo the primes are lifted to."""
    found = []
    for degrees in sorted({degrees for one in sweeps for degrees in one.classes}):
        parts = [
            pieces(one.classes[degrees], one.prime, one.seen, one.complete, rng)
            for one in sweeps
            if degrees in one.classes
        ]
        for dimension in range(len(names)):
            flats = {part.prime: part.flats[dimension] for part in parts if part.flats.get(dimension)}
            if dimension == 0 and _is_a_curve({p: len(points) for p, points in flats.items()}):
                continue
            for rows, at in lifted_flats(flats).items():
                found.append(Component(flat_equations(rows, names), dimension, degrees, at))
        for size in {len(rows) for part in parts for rows in part.forms}:
            inside = {part.prime: [rows for rows in part.forms if len(rows) == size] for part in parts}
            for rows in lifted_flats(inside):
                forms = {part.prime: part.forms.get(residues(rows, part.prime) or (), []) for part in parts}
                equations = flat_equations(rows, names)
                free = [name for k, name in enumerate(names) if k not in pivots(rows)]
                for form, at in lifted_forms(forms, free):
                    whole = form.project_to_context(ring(names))
                    found.append(Component((whole, *equations), len(free) - 1, degrees, at))
    return found


def _is_a_curve(counts: dict[int, int]) -> bool:
    """Whether numbers of points modulo primes grow as those of a curve do."""
    if len(counts) < 2:
        return False
    low, high = min(counts), max(counts)
    return counts[low] >= _SHARE * low and counts[high] - counts[low] >= _SHARE * (high - low)


def _confirmed(
    one: Component, names: Sequence[str], map_: BirationalMap, eps: fmpq | None, others: Sequence[Component], rng: random.Random
) -> Component:
    """The component with what random members on it say, and a rational one that is on no smaller component."""
    measured = [degrees_on(map_, one.equations, eps, one.degrees, rng) for _ in range(_MEMBERS)]
    known = [degrees for degrees in measured if degrees is not None]
    values = None
    for _ in range(_TRIES):
        point = point_on(one.equations, len(names), QQ, rng)
        if point is None:
            break
        if not any(other.dimension < one.dimension and _vanishes(other, point) for other in others):
            values = dict(zip(names, point, strict=True))
            break
    return replace(one, tried=len(known), confirmed=known.count(one.degrees), values=values)


def _with_growth(
    components: list[Component],
    file: SystemFile,
    eps: fmpq | None,
    deadline: float,
    seed: int,
    progress: Callable[[str], None],
) -> list[Component]:
    """The components with the growth at a rational member, slow ones first, as long as there is time.

    Where it is bounded or exponential, one member of each class is enough.
    """
    found = []
    enough: set[Degrees] = set()
    for k, one in enumerate(components):
        progress(f"scan: growth on component {k + 1} of {len(components)}")
        left = deadline - time.monotonic()
        if one.values is not None and one.degrees not in enough and left > 0 and one.degrees[-1] >= 0:
            member = member_of(file, one.values).map
            part = min(_GROWTH_SECONDS, max(0.1, left))
            growth = degree_growth(member, eps, seconds=part, steps=_STEPS, seed=seed, enclosed=False)
            one = replace(one, growth=growth)
            if growth.growth not in _MEASURED_EACH:
                enough.add(one.degrees)
        found.append(one)
    kinds = {one.degrees: one.growth.growth for one in reversed(found) if one.growth is not None}

    def order(one: Component) -> tuple[int, Degrees]:
        return _ORDER.index(kinds.get(one.degrees, GrowthClass.UNKNOWN)), one.degrees[::-1]

    return sorted(found, key=order)


def _vanishes(one: Component, point: Sequence[Any], prime: int | None = None) -> bool:
    """Whether the component contains a rational point, or one modulo a prime."""
    field: Field = QQ if prime is None else GF(prime)
    return all(field.is_zero(evaluate(equation, field, [field.convert(x) for x in point])) for equation in one.equations)


def _left(one: Sweep, components: Sequence[Component]) -> int:
    """The number of slow members modulo a prime that are on no component with their degrees."""
    return sum(
        not any(_vanishes(other, point, one.prime) for other in components if other.degrees == degrees)
        for degrees, points in one.classes.items()
        for point in points
    )


def _is_symmetric(sweeps: Sequence[Sweep], i: int, j: int) -> bool:
    """Whether exchanging two parameters leaves the degrees of all members that were tried as they are."""

    def exchanged(point: tuple[int, ...]) -> tuple[int, ...]:
        values = list(point)
        values[i], values[j] = values[j], values[i]
        return tuple(values)

    return all(
        one.complete and all(one.slow.get(exchanged(x)) == degrees for x, degrees in one.slow.items()) for one in sweeps
    )
