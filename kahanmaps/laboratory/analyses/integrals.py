"""Integrals, the curves of one in the plane, and relations along orbits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from kahanmaps.checks.claims import Verdict
from kahanmaps.errors import counted
from kahanmaps.family.system_normal_form import SystemNormalForm
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.analyses.part import Run
from kahanmaps.laboratory.findings import Findings
from kahanmaps.laboratory.known import Known, Statement
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.preserve.hirota_kimura import Profile
from kahanmaps.laboratory.preserve.integrals import IntegralSearch, find_integrals
from kahanmaps.laboratory.preserve.poisson.pencil import Pencil, pencil_of
from kahanmaps.laboratory.preserve.sparse_relations import SparseRelation, sparse_relations

_NAMES = 6  # that are listed one by one


def integrals(run: Run, **budget: Any) -> IntegralSearch:
    """Those in closed form, and how many orbits show."""
    return find_integrals(run.bare, **run.asked, **budget)


def curves(run: Run, seconds: float, **_: Any) -> Pencil | None:
    """On which curves a planar map with one integral moves."""
    proved = [one for one in run.integrals if one.verdict is Verdict.PROVED]
    if run.dim != 2 or len(proved) != 1 or run.has_symbols:
        return None
    return pencil_of(proved[0].name, proved[0].function, run.found.eps, seed=run.seed, seconds=seconds)


def relations(run: Run, **_: Any) -> tuple[SparseRelation, ...]:
    """Hirota-Kimura relations with few terms, of the lowest degrees that have some."""
    profile = None if run.found.integrals is None else run.found.integrals.profile
    if profile is None or profile.first_degree is None or profile.period is not None:
        return ()
    found: tuple[SparseRelation, ...] = ()
    maps = Laboratory(run.bare, (), run.found.eps, run.seed, algebraic=True).maps
    top = profile.degree if profile.dim - profile.codimension <= 1 else profile.first_degree + 1
    for degree in range(profile.first_degree, min(top, profile.degree, 4) + 1):
        first = 1 + len({name for relation in found for name in relation.names})
        found += sparse_relations(maps, degree, run.map.variables, first=first) or ()
    return found


def curves_json(found: Findings) -> dict[str, Any]:
    """The curves, and what the map is on them; null where the degrees contradict them."""
    growth = found.degrees.growth if found.degrees is not None else Growth.UNKNOWN
    if found.pencil is None or found.pencil.against(growth):
        return {"invariant_curves": None}
    return {"invariant_curves": {**found.pencil.to_json(), "motion": found.pencil.motion(growth)}}


def relations_json(found: Findings) -> dict[str, Any]:
    """Their texts."""
    return {"hirota_kimura": [relation.text for relation in found.relations]}


def statements(found: Findings) -> list[Statement]:
    """Formulas, what is measured along orbits, relations there, and the curves of a planar integral."""
    search, family = found.integrals, []
    if isinstance(found.normal_form, SystemNormalForm):
        number = counted(found.normal_form.form.m, "independent integral")
        family = [Statement(Known.PROVED, f"{number}, as a member of the commuting family")]
    if search is None:
        return [*family, *_curve_lines(found)]
    texts = [(one, one.short_text) for one in search.integrals] + [(one, one.text) for one in search.in_iterates]
    lines = [Statement(Known(one.verdict), f"{one.name} = {text}  [{one.origin}]") for one, text in texts]
    for timed in search.in_time:
        text = f"{timed.name} = {timed.text} at the n-th point, an integral that depends on n"
        lines.append(Statement(Known(timed.integral.verdict), text))
    profile = search.profile
    if search.by_theorems:
        number = counted(search.by_theorems, "independent integral")
        status = Known.MEASURED if search.symbols else Known.PROVED  # of symbols random values are looked at
        lines.append(Statement(status, f"{number} by theorems: {search.theorems}"))
    if not profile.nullities:
        lines.append(Statement(Known.UNDECIDED, f"how many integrals there are was not measured: {search.reason}"))
    elif profile.period is not None:
        lines.append(Statement(Known.MEASURED, f"all orbits tried close after {counted(profile.period, 'step')}"))
    else:
        if search.codimension:
            seen = "" if search.is_exact else "at least "
            number = f"{seen}{counted(search.codimension, 'independent integral')}"
            text = f"generic orbits lie on varieties of codimension {seen}{search.codimension}, which means {number}"
        else:
            text = "orbits show no integral"
        lines.append(Statement(Known.MEASURED, f"{text}; relations along an orbit: {_relations(profile)}"))
        if not profile.agree:
            lines.append(Statement(Known.NOTE, "the orbits that were compared do not agree"))
    lines += [Statement(Known.MEASURED, f"along orbits {relation.text}") for relation in found.relations]
    integrals = list(dict.fromkeys(name for relation in found.relations for name in relation.integrals))
    if integrals:
        if len(integrals) == 1:
            text = "is constant on each orbit and differs between orbits, so it is an integral"
        else:
            text = "are constant on each orbit and differ between orbits, so they are integrals"
        lines.append(Statement(Known.NOTE, f"{listed(integrals)} {text}"))
    functions = list(dict.fromkeys(name for relation in found.relations for name in relation.functions_of_eps))
    if functions:
        depend = "depends" if len(functions) == 1 else "depend"
        lines.append(Statement(Known.NOTE, f"{listed(functions)} {depend} on eps only"))
    if search.reason and profile.nullities:
        lines.append(Statement(Known.NOTE, search.reason))
    return [*lines, *family, *_curve_lines(found)]


def _relations(profile: Profile) -> str:
    """How many independent ones there are of each degree from the first that has some."""
    degrees = list(enumerate(profile.nullities, 1))
    some = [f"a {k}-dimensional space up to degree {degree}" for degree, k in degrees if k]
    none = max((degree for degree, k in degrees if not k), default=0)
    before = [f"none up to degree {none}" if none > 1 else "none of degree 1"] if none else []
    return ", ".join(before + some)


def listed(names: Sequence[str]) -> str:
    """The names, only the first and the last one of many."""
    return ", ".join(names) if len(names) <= _NAMES else f"{names[0]}, ..., {names[-1]}"


def _curve_lines(found: Findings) -> list[Statement]:
    if found.pencil is None:
        return []
    growth = found.degrees.growth if found.degrees is not None else Growth.UNKNOWN
    against = found.pencil.against(growth)
    follows = f"but {against}" if against else found.pencil.motion(growth)
    text = "; ".join(filter(None, [found.pencil.text, follows]))
    return [Statement(Known.UNDECIDED if against else Known.MEASURED, text)]
