"""The tasks of the laboratory that ask what a map preserves and how it grows, of right-hand sides alone.

As in tasks.py results are small, words and numbers to group by; `report = true` keeps all that was found. Without eps
an analysis is for every eps. A time budget (`seconds`) may cut a result short: it belongs to the key, and "status" says
what is open. The verdict is that of the formulas that were found; growth and numbers of integrals are measured, and
have words of their own.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from flint import fmpq_poly

from kahanmaps.algebra.text import format_univariate
from kahanmaps.checks.claims import Verdict, combined
from kahanmaps.checks.decide import DEFAULT_ERROR_BITS
from kahanmaps.documents.files import SystemFile
from kahanmaps.experiments.registry import Result, task

if TYPE_CHECKING:
    from kahanmaps.laboratory.analysis import Analysis
    from kahanmaps.laboratory.degrees import DegreeGrowth
    from kahanmaps.laboratory.densities import DensitySearch
    from kahanmaps.laboratory.integrals import IntegralSearch

_ENDINGS = ("constant", "singular")  # of degrees without a recurrence that are known for all iterates


@task("degrees")
def degrees(
    system: SystemFile,
    eps: Any = None,
    terms: int | None = None,
    max_degree: int = 20_000,
    seconds: int = 10,
    seed: int = 0,
    report: bool = False,
) -> Result:
    """The degrees of the iterates: the kind of growth, the dynamical degree, a recurrence."""
    from kahanmaps.laboratory.degrees import degree_growth

    found = degree_growth(system.system, eps, seconds=seconds, max_terms=terms, max_degree=max_degree, seed=seed)
    result: Result = {
        "status": found.ended,
        **_growth(found),
        "estimate": found.estimate,
        "degrees": list(found.degrees),
        "reached": len(found.degrees) - 1,
        "ending": found.message,
    }
    return _with_report(result, found, report)


@task("find-integrals")
def integrals(
    system: SystemFile,
    eps: Any = None,
    symbolic: list[str] | None = None,
    max_degree: int | None = None,
    seconds: int = 60,
    seed: int = 0,
    report: bool = False,
) -> Result:
    """Integrals in closed form with their verdict, and how many there are at least, by theorems and by orbits."""
    from kahanmaps.laboratory.integrals import find_integrals

    found = find_integrals(system, symbols=symbolic or (), eps=eps, max_degree=max_degree, seconds=seconds, seed=seed)
    result: Result = {
        "verdict": _weakest(one.verdict for one in found.integrals),
        "status": _state_of_integrals(found),
        "integrals": len(found.integrals),
        "codimension": found.codimension if found.profile.nullities else found.by_theorems or None,
        "formulas": [one.text for one in found.integrals],
        "nullities": list(found.profile.nullities),
        "period": found.profile.period,
        "reason": found.reason,
    }
    return _with_report(result, found, report)


@task("find-density")
def density(
    system: SystemFile,
    eps: Any = None,
    symbolic: list[str] | None = None,
    max_degree: int | None = None,
    seconds: int = 30,
    seed: int = 0,
    report: bool = False,
) -> Result:
    """The densities phi of least degree, or 1/phi, for which the measure dx/phi is invariant."""
    from kahanmaps.laboratory.densities import find_densities

    found = find_densities(system, symbols=symbolic or (), eps=eps, max_degree=max_degree, seconds=seconds, seed=seed)
    result: Result = {
        "verdict": _weakest(one.verdict for one in found.densities),
        "status": _state_of_densities(found),
        "densities": len(found.densities),
        "degree_tried": None if found.degree < 0 else found.degree,
        "formulas": [one.text for one in found.densities],
        "period": found.period,
        "reason": found.reason,
    }
    return _with_report(result, found, report)


@task("find-symmetry")
def symmetry(system: SystemFile, seconds: int = 30, report: bool = False) -> Result:
    """Affine symmetries and reversing symmetries, for every eps: how many, and what generates them."""
    from kahanmaps.laboratory.symmetries import linear_symmetries

    found = linear_symmetries(system.system, seconds=seconds)
    result: Result = {
        "verdict": str(Verdict.PROVED if found.complete else Verdict.UNDECIDED),
        "status": "complete" if found.complete else "undecided",
        "group_order": found.order,
        "symmetries": len(found.symmetries),
        "reversing": len(found.reversing),
        "infinitesimal": len(found.infinitesimal),
        "scaling": found.scaling is not None,
        "generators": [one.text for one in found.generators],
        "open": found.undecided,
    }
    return _with_report(result, found, report)


@task("find-commuting")
def commuting(
    system: SystemFile,
    shape: str = "linear",
    seconds: int = 60,
    seed: int = 0,
    error_bits: int = DEFAULT_ERROR_BITS,
    report: bool = False,
) -> Result:
    """The quadratic systems whose Kahan map commutes with this one at the same eps, for every eps."""
    from kahanmaps.laboratory.commuting import commuting_systems

    found = commuting_systems(system.system, shape, seed=seed, error_bits=error_bits, seconds=seconds)
    result: Result = {
        "verdict": str(found.verdict),
        "status": "complete" if found.complete else "undecided",
        "commuting": len(found.nontrivial),
        "families": len(found.families),
        "family_parameters": max((len(family.directions) for family in found.families), default=0),
        "bracket_dimension": found.dimension,
        "every_g_commutes": found.every_g_commutes,
        "systems": [one.rhs for one in found.nontrivial],
        "irrational": found.irrational,
        "open": found.undecided,
    }
    return _with_report(result, found, report)


@task("analyze")
def analysis(
    system: SystemFile,
    eps: Any = None,
    symbolic: list[str] | None = None,
    seconds: int | None = None,
    seed: int = 0,
    report: bool = False,
) -> Result:
    """All analyses at once: integrability in a word, integrals, growth, densities, symmetries, commuting systems."""
    from kahanmaps.family.structure import Structure
    from kahanmaps.laboratory.analysis import analyze

    found = analyze(system, symbols=symbolic or (), eps=eps, seconds=seconds, seed=seed)
    final, confined = found.conclusion, {run.verdict for run in found.singularities}
    unfinished = _unfinished(found)
    result: Result = {
        "status": "partial" if found.skipped or unfinished else "complete",
        "integrability": final.kind,
        "integrals": final.integrals if found.integrals_were_counted else None,
        **(_growth(found.degrees) if found.degrees is not None else {}),
        "growth": final.growth,
        "densities": None if found.densities is None else len(found.densities.densities),
        "group_order": None if found.symmetries is None else found.symmetries.order,
        "commuting": None if found.commuting is None else len(found.commuting.nontrivial),
        "confinement": None if not confined else confined.pop() if len(confined) == 1 else "undecided",
        "in_family": isinstance(found.structure, Structure),
        "sentence": final.sentence,
        "unfinished": unfinished,
        "skipped": found.skipped,
    }
    return _with_report(result, found, report)


def _with_report(result: Result, found: Any, whole: bool) -> Result:
    return {**result, "report": found.to_json()} if whole else result


def _state_of_integrals(found: IntegralSearch) -> str:
    if not found.profile.nullities:
        return "not measured"
    if not found.is_complete:
        return "formulas missing"
    return "unfinished" if found.reason else "complete"


def _state_of_densities(found: DensitySearch) -> str:
    """ "none" is measured up to the degree that was tried; what is "open" has its reason."""
    if found.densities:
        return "found"
    return "none" if found.reason.startswith("no polynomial") else "open"


def _unfinished(found: Analysis) -> list[str]:
    """The parts that were begun and did not come to their end, be it for want of time or of formulas."""
    states = {
        "degrees": found.degrees is None or found.degrees.recurrence is not None or found.degrees.ended in _ENDINGS,
        "integrals": found.integrals is None or _state_of_integrals(found.integrals) == "complete",
        "densities": found.densities is None or _state_of_densities(found.densities) != "open",
        "symmetries": found.symmetries is None or found.symmetries.complete,
        "commuting systems": found.commuting is None or found.commuting.complete,
        "singularities": not any(run.stopped or run.verdict == "undecided" for run in found.singularities),
    }
    return [name for name, is_done in states.items() if not is_done]


def _weakest(verdicts: Iterable[Verdict]) -> str | None:
    """The weakest of the verdicts; None where nothing was found: that there is nothing is no claim here."""
    given = list(verdicts)
    return str(combined(given)) if given else None


def _growth(found: DegreeGrowth) -> Result:
    """What groups systems by their complexity."""
    recurrence, rate = found.recurrence, found.dynamical_degree
    return {
        "growth": str(found.growth),
        "looks_exponential": found.looks_exponential,  # an estimate, where there is no recurrence
        "unconfirmed": found.unconfirmed,  # why a recurrence that fits is not given
        "singularities": None if found.patterns is None else found.patterns.text,
        "dynamical_degree": None if rate is None else rate.digits,
        "minimal_polynomial": None if rate is None else format_univariate(fmpq_poly(rate.minimal_polynomial)),
        "power": None if recurrence is None else recurrence.power,
        "recurrence": None if recurrence is None else recurrence.text,
        "closed_form": None if recurrence is None else recurrence.closed_form or None,
    }
