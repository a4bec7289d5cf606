"""The growth of heights along several exact orbits, which have different initial points and different eps.

A single orbit is weak evidence: it may lie on a special curve, and its eps may be special. For example, the fourth
iterate of the Kahan map of q'' = -w^2 q + Q(q), Q quadratic, is the identity if eps^2 w^2 = 1. The module
`kahanmaps.invariants.heights` decides the kind of growth of one orbit; this one compares orbits.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from flint import fmpq

from kahanmaps.algebra.chance import derive_seed
from kahanmaps.algebra.fields import QQ, rational
from kahanmaps.algebra.printing import attributes, format_point
from kahanmaps.algebra.work import Budget
from kahanmaps.display_protocols import PrintableResult
from kahanmaps.errors import InputError, counted
from kahanmaps.family.system_normal_form import NoNormalForm, SystemNormalForm
from kahanmaps.hard_stop import TimeLimit
from kahanmaps.invariants.growth import Growth
from kahanmaps.invariants.heights import HeightGrowth, height_growth
from kahanmaps.laboratory.defaults import budget_for
from kahanmaps.maps.convention import resolve_eps
from kahanmaps.maps.kahan import SystemLike, as_map
from kahanmaps.maps.values import as_points, coordinates

DEFAULT_EPS = (fmpq(1, 10), fmpq(3, 11))
DEFAULT_STARTS = 3
DEFAULT_STEPS = 60
DEFAULT_MAX_DIGITS = 20_000
_NUMERATORS = (13, 17, 19, 23, 29, 31, 37, 41, 43, 47)
_DENOMINATORS = (7, 8, 9, 16, 25, 27)
_MAX_STARTS = 1000  # maximal number of initial points for each eps
_GROWTH_TEXTS = {
    Growth.PERIODIC: "points come back",
    Growth.BOUNDED: "bit lengths stay bounded",
    Growth.LOGARITHMIC: "bit lengths grow logarithmically",
    Growth.LINEAR: "bit lengths grow linearly",
    Growth.QUADRATIC: "bit lengths grow quadratically",
    Growth.EXPONENTIAL: "bit lengths grow exponentially",
}
_MAX_ATTEMPTS = 20  # random initial points are tried until an orbit has no singular point, but at most so many


@dataclass(frozen=True)
class SurveyedOrbit:
    """One orbit of the survey: its eps, its initial point and the growth of its heights."""

    eps: fmpq
    start: tuple[fmpq, ...]
    growth: HeightGrowth

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        return {**attributes(self, "eps", "start"), **self.growth.to_json()}


@dataclass(frozen=True)
class HeightSurvey(PrintableResult):
    """The orbits of the survey, in the order of eps and then of initial points.

    `is_complete` is False if the budget or a TimeLimit ended the survey. If the map has no eps, the `eps` of the orbits
    has no meaning. For heights over number fields see `kahanmaps.invariants.heights`.
    """

    _parts = "orbits"

    orbits: tuple[SurveyedOrbit, ...]
    is_complete: bool
    has_eps: bool = True
    over: str = ""  # the number field, if it is not Q

    @property
    def kinds(self) -> tuple[Growth, ...]:
        """The distinct kinds of growth of the decided orbits, in order of first occurrence."""
        kinds = [orbit.growth.kind for orbit in self.orbits]
        return tuple(dict.fromkeys(kind for kind in kinds if kind is not Growth.UNDECIDED))

    @property
    def kind(self) -> Growth:
        """The kind of growth of the decided orbits; UNDECIDED if kinds differ, or if an eps has no decided orbit."""
        all_eps = {orbit.eps for orbit in self.orbits}
        decided_eps = {orbit.eps for orbit in self.orbits if orbit.growth.kind is not Growth.UNDECIDED}
        return self.kinds[0] if len(self.kinds) == 1 and decided_eps == all_eps else Growth.UNDECIDED

    @property
    def text(self) -> str:
        """A sentence with the kind of growth and the number of orbits of this kind, or with the different kinds."""
        total, note = len(self.orbits), "" if self.is_complete else "; the survey ended early; raise --effort"
        if len(self.kinds) > 1:
            counts = (f"{sum(o.growth.kind is kind for o in self.orbits)} {kind}" for kind in self.kinds)
            # If the kinds agree at each eps, they differ only between different eps.
            decided_kinds = {(o.eps, o.growth.kind) for o in self.orbits if o.growth.kind is not Growth.UNDECIDED}
            cause_text = "the eps" if len(decided_kinds) == len({value for value, _ in decided_kinds}) else "the starts"
            return f"heights of exact orbits are undecided: {cause_text} disagree ({', '.join(counts)}){note}"
        decided_count = sum(orbit.growth.kind is not Growth.UNDECIDED for orbit in self.orbits)
        if self.kind is Growth.UNDECIDED:
            return f"heights of exact orbits are undecided: {decided_count} of {counted(total, 'orbit')} decided{note}"
        eps = {orbit.eps for orbit in self.orbits}
        count_text = f"{decided_count} of {total}" if decided_count < total else f"all {total}" if total > 1 else "the"
        eps_text = f", at {counted(len(eps), 'value')} of eps" if self.has_eps else ""
        field_text = f", of the coefficients over one denominator of points over {self.over}" if self.over else ""
        orbits_text = f"{count_text} exact {'orbit' if total == 1 else 'orbits'} tried"
        return f"{_GROWTH_TEXTS[self.kind]} on {orbits_text}{eps_text}{field_text}{note}"

    def rows(self) -> list[dict[str, str]]:
        """Return a row for each orbit, for example for `pandas.DataFrame(survey.rows())`."""
        return [
            {"eps": str(orbit.eps), "start": format_point(orbit.start), "growth": str(orbit.growth.kind)}
            for orbit in self.orbits
        ]

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        return attributes(self, "kind", "kinds", "text", complete="is_complete", orbits="orbits")


def height_survey(
    system: SystemLike,
    eps: Any = None,
    *,
    time_step: Any = None,
    h: Any = None,
    starts: Sequence[Any] | int = DEFAULT_STARTS,
    steps: int = DEFAULT_STEPS,
    max_digits: int | None = DEFAULT_MAX_DIGITS,
    effort: int | Budget = 1,
    normal_form: SystemNormalForm | NoNormalForm | None = None,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
) -> HeightSurvey:
    """Measure the growth of heights along exact orbits over Q, for one or two eps.

    Args:
        system: a map, or a system, which stands for its Kahan map.
        eps: half the time step (exact), or None for 1/10 and 3/11.
        time_step, h: the time step 2 eps, instead of eps.
        starts: the initial points, or the number of random points whose orbits contain no singular point.
        steps: the number of steps of each orbit.
        max_digits: an orbit ends at a coordinate with more digits; None means no limit.
        effort: each increase by 1 doubles the work limit; at this limit the survey ends with the current orbit.
        normal_form: the normal form of the system, if it is known.
        seed: the random seed.
        progress: called with a message before each orbit.

    Returns:
        The survey. If a TimeLimit expires, it has the orbits that were complete. If there are none, or if `effort` is a
        Budget (of a computation of which the survey is a part), the TimeLimit is raised.

    Raises:
        InputError: for eps = 0, for no or too many initial points, and for points of a wrong dimension.

    >>> from kahanmaps.documents.catalog import load
    >>> survey = height_survey(load("weierstrass").system, starts=2, steps=40)
    >>> survey.kind, survey.text
    (<Growth.QUADRATIC: 'quadratic'>, 'bit lengths grow quadratically on all 4 exact orbits tried, at 2 values of eps')
    """
    eps = resolve_eps(eps, time_step, h)
    if isinstance(starts, int) and not 1 <= starts <= _MAX_STARTS:
        raise InputError(f"found {starts} initial points, expected 1 to {_MAX_STARTS}")
    if hasattr(starts, "__len__") and len(starts) == 0:
        raise InputError("found no initial points, expected at least one")
    is_stage, budget = isinstance(effort, Budget), budget_for("heights", effort)
    orbits: list[SurveyedOrbit] = []
    map_ = as_map(system)
    field_name = "" if map_.root is None else map_.root.number_field.name
    eps_values = DEFAULT_EPS if eps is None else (rational(eps),)  # rejects invalid text for every map
    for value in eps_values if map_.has_eps else (fmpq(1),):
        map_at_eps = map_.at(value)
        rng = random.Random(f"heights {derive_seed(seed, map_.seed_data, value)}")
        initial_points = (
            [None] * starts
            if isinstance(starts, int)
            else [coordinates(start, QQ, map_.variables, map_.dim) for start in as_points(starts, map_.variables)]
        )
        for k, start in enumerate(initial_points):
            if orbits and budget.is_spent:
                return HeightSurvey(tuple(orbits), False, map_.has_eps, field_name)
            try:
                progress(f"heights: {f'eps = {value}, ' if map_.has_eps else ''}orbit {k + 1} of {len(initial_points)}")
                for _ in range(_MAX_ATTEMPTS if start is None else 1):
                    # Many maps have invariant curves with short equations, such as eps^2 x^2 = 1. Random points avoid
                    # these curves: their numerators are primes, so that no coordinate is a simple multiple of 1/eps.
                    candidate = start or tuple(
                        fmpq(rng.choice((-1, 1)) * rng.choice(_NUMERATORS), rng.choice(_DENOMINATORS))
                        for _ in range(map_.dim)
                    )
                    growth = height_growth(
                        map_at_eps, candidate, steps, normal_form=normal_form, max_digits=max_digits, budget=budget
                    )
                    if growth.end.status != "singular" or budget.is_spent:
                        break
            except TimeLimit:
                if is_stage or not orbits:
                    raise
                return HeightSurvey(tuple(orbits), False, map_.has_eps, field_name)
            orbits.append(SurveyedOrbit(value, tuple(candidate), growth))
            if growth.end.status == "interrupted":
                return HeightSurvey(tuple(orbits), False, map_.has_eps, field_name)
    return HeightSurvey(tuple(orbits), True, map_.has_eps, field_name)
