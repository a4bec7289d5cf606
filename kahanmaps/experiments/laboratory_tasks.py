"""The tasks of the laboratory: preserved structures and growth of degrees, singularities, cycles, Lyapunov exponents.

As in tasks.py, results are short texts and numbers by which tasks can be grouped; `report = true` also stores the full
result. Without eps an analysis is valid for every eps. The effort bounds the work, so it belongs to the key of the
task, and "status" names what remains undecided. The verdict is the weakest verdict among the formulas in the result.
Growth and numbers of integrals are measured and are separate entries. Singularities, cycles and Lyapunov exponents
are measured and have no verdict.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import isfinite
from typing import TYPE_CHECKING, Any

from flint import fmpq_poly

from kahanmaps.algebra.printing import format_number, format_univariate
from kahanmaps.checks.claims import Certainty, combined
from kahanmaps.checks.decide import DEFAULT_ERROR_BITS
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError
from kahanmaps.experiments.registry import FullResult, Result, analysis, fields, task

if TYPE_CHECKING:
    from kahanmaps.laboratory.analysis import Analysis
    from kahanmaps.laboratory.growth.degrees import DegreeGrowth
    from kahanmaps.laboratory.preserve.densities import DensitySearch
    from kahanmaps.laboratory.preserve.integrals import IntegralSearch
    from kahanmaps.laboratory.preserve.poisson.poisson_tensors import PoissonSearch
    from kahanmaps.laboratory.singular.singularities import SingularityRun
    from kahanmaps.laboratory.symmetry.commuting import CommutingSystems
    from kahanmaps.laboratory.symmetry.symmetries import Symmetries

POISSON_ARGUMENTS = {"symbolic": "symbols", "max_degree": "degree"}
_ENDINGS = ("constant", "singular")  # a degree sequence with one of these endings is known without a recurrence


@analysis(
    "degrees", "growth.degrees:degree_growth", of="map", eps=None, terms=None, max_degree=20_000, effort=1, seed=0
)
def degrees(growth: DegreeGrowth) -> Result:
    """Compute degrees of the iterates: growth, dynamical degree, recurrence."""
    return {
        "status": growth.ended,
        **_growth_entries(growth),
        "estimate": growth.estimate,
        "degrees": list(growth.degrees),
        "reached": len(growth.degrees) - 1,
        "ending": growth.message,
    }


@task("scan", reports=True)
def scan_parameters(
    system: SystemFile,
    over: list[str],
    eps: Any = None,
    by: str = "degrees",  # the only allowed value; it is part of the keys in databases of earlier versions
    terms: int | None = None,
    primes: list[int] | None = None,
    effort: int = 1,
    seed: int = 0,
) -> FullResult:
    """Find the conditions on parameters under which degrees are smaller, and the growth there."""
    from kahanmaps.laboratory.scan.result import growth_on
    from kahanmaps.laboratory.scan.scan import scan

    result = scan(system, over, eps=eps, terms=terms, primes=primes, effort=effort, seed=seed, jobs=1)
    by_growth = [
        (str(growth.growth), components)
        for _, components in result.classes
        if (growth := growth_on(components)) is not None
    ]
    return {
        "status": result.ended,
        "growth": by_growth[0][0] if by_growth else None,  # the kind of the slowest growth
        "components": len(result.components),
        "confirmed": sum(component.is_confirmed for component in result.components),
        "integrable": [
            component.text
            for growth_kind, components in by_growth
            if growth_kind != "exponential"
            for component in components
            if component.is_confirmed
        ],
        "generic": list(result.generic),
        "unassigned": max(result.unassigned, default=0),
    }, result


@analysis(
    "find-integrals", "preserve.integrals:find_integrals", eps=None, symbolic=None, max_degree=None, effort=1, seed=0
)
def integrals(search: IntegralSearch) -> Result:
    """Search for rational integrals, and find their number by theorems and by orbits."""
    return {
        "verdict": _weakest_verdict(verdict for _, verdict in search.formulas),
        "status": _state_of_integrals(search),
        "integrals": search.formula_count,
        "codimension": search.codimension if search.profile.nullities else search.by_theorems or None,
        "formulas": [text for text, _ in search.formulas],
        "nullities": list(search.profile.nullities),
        "period": search.profile.period,
        "reason": search.reason,
    }


@analysis(
    "find-density", "preserve.densities:find_densities", eps=None, symbolic=None, max_degree=None, effort=1, seed=0
)
def density(search: DensitySearch) -> Result:
    """Search for invariant volume forms dx/phi with phi of least degree or a product of powers."""
    return {
        "verdict": _weakest_verdict(density.verdict for density in search.densities),
        "status": _state_of_densities(search),
        "densities": len(search.densities),
        "degree_tried": None if search.degree < 0 else search.degree,
        "formulas": [density.text for density in search.densities],
        "period": search.period,
        "reason": search.reason,
    }


@analysis(
    "find-poisson",
    "preserve.poisson.poisson_tensors:find_poisson",
    renamed=POISSON_ARGUMENTS,
    eps=None,
    symbolic=None,
    max_degree=None,
    effort=1,
    seed=0,
)
def poisson(search: PoissonSearch) -> Result:
    """Search for Poisson tensors with polynomial entries: number, ranks, Casimirs among the integrals."""
    return {
        "verdict": _weakest_verdict(tensor.verdict for tensor in search.tensors),
        "status": "found" if search.tensors else "none" if search.reason.startswith("no tensor") else "open",
        "tensors": len(search.tensors),
        "degree_tried": None if search.degree < 0 else search.degree,
        "formulas": [tensor.text for tensor in search.tensors],
        "ranks": [tensor.rank for tensor in search.tensors],
        "jacobi": [str(tensor.jacobi) for tensor in search.tensors],
        "casimirs": [list(tensor.casimirs) for tensor in search.tensors],
        "reason": search.reason,
    }


@analysis("find-symmetry", "symmetry.symmetries:linear_symmetries", of="system", effort=1)
def symmetry(result: Symmetries) -> Result:
    """Find affine symmetries and reversing symmetries for every eps: number and generators."""
    return {
        "verdict": str(Certainty.PROVED if result.complete else Certainty.UNDECIDED),
        "status": "complete" if result.complete else "undecided",
        "group_order": result.order,
        "symmetries": len(result.symmetries),
        "reversing": len(result.reversing),
        "infinitesimal": len(result.infinitesimal),
        "scaling": result.scaling is not None,
        "generators": [generator.text for generator in result.generators],
        "open": result.undecided,
    }


@analysis(
    "find-commuting",
    "symmetry.commuting:commuting_systems",
    of="system",
    shape="linear",
    effort=1,
    seed=0,
    error_bits=DEFAULT_ERROR_BITS,
)
def commuting(result: CommutingSystems) -> Result:
    """Find the quadratic systems whose Kahan maps commute with this system for every eps."""
    return {
        "verdict": str(result.verdict),
        "status": "complete" if result.complete else "undecided",
        "commuting": len(result.nontrivial),
        "families": len(result.families),
        "family_parameters": max((len(family.directions) for family in result.families), default=0),
        "bracket_dimension": result.dimension,
        "every_g_commutes": result.every_g_commutes,
        "systems": [system.rhs for system in result.nontrivial],
        "irrational": result.irrational,
        "open": result.undecided,
    }


@analysis("analyze", "analysis:analyze", eps=None, symbolic=None, effort=1, seed=0)
def all_analyses(result: Analysis) -> Result:
    """Run all analyses: integrability, integrals, growth, densities, symmetries, commuting systems."""
    from kahanmaps.family.system_normal_form import SystemNormalForm

    conclusion, verdicts = result.conclusion, {run.verdict for run in result.singularities}
    # Analyses that were begun but left something undecided: the work limit was reached, or formulas are missing.
    is_finished = {
        "degrees": result.degrees is None or result.degrees.recurrence is not None or result.degrees.ended in _ENDINGS,
        "integrals": result.integrals is None or _state_of_integrals(result.integrals) == "complete",
        "densities": result.densities is None or _state_of_densities(result.densities) != "open",
        "symmetries": result.symmetries is None or result.symmetries.complete,
        "commuting systems": result.commuting is None or result.commuting.complete,
        "singularities": not any(run.is_stopped or run.verdict == "undecided" for run in result.singularities),
    }
    unfinished = [name for name, is_done in is_finished.items() if not is_done]
    return {
        "status": "partial" if result.skipped or unfinished else "complete",
        "integrability": conclusion.kind,
        "integrals": conclusion.integrals if result.integrals_were_counted else None,
        **(_growth_entries(result.degrees) if result.degrees is not None else {}),
        "growth": conclusion.growth,
        "densities": None if result.densities is None else len(result.densities.densities),
        "group_order": None if result.symmetries is None else result.symmetries.order,
        "commuting": None if result.commuting is None else len(result.commuting.nontrivial),
        "confinement": None if not verdicts else verdicts.pop() if len(verdicts) == 1 else "undecided",
        "in_family": isinstance(result.normal_form, SystemNormalForm),
        "sentence": conclusion.sentence,
        "unfinished": unfinished,
        "skipped": result.skipped,
    }


@task("singularities")
def confinement(
    system: SystemFile,
    eps: Any = None,
    steps: int | None = None,
    effort: int = 1,
    seed: int = 0,
    report: bool = False,
) -> Result:
    """Trace the exceptional hypersurfaces: are singularities confined? Without eps, two values are compared."""
    from kahanmaps.laboratory.singular.outcomes import NOT_CONTRACTED, UNDECIDED
    from kahanmaps.laboratory.singular.singularities import default_eps, singularities

    eps_values = default_eps(system.map, seed) if eps is None else (eps,)
    runs = [singularities(system.map, value, steps=steps, seed=seed, effort=effort) for value in eps_values]
    is_consistent = len({run.shape for run in runs}) == 1
    first = runs[0]
    result: Result = {
        "confinement": first.verdict if is_consistent else UNDECIDED,
        "status": "budget" if any(run.is_stopped for run in runs) else "complete" if is_consistent else "eps differ",
        "tried": [format_number(run.eps) for run in runs],
        "followed": first.followed,  # number of steps over which unconfined singularities were followed
        **fields(first, "map_degree", "critical_degree"),
        "exceptional_count": sum(h.status != NOT_CONTRACTED for h in first.hypersurfaces),
        "longest_pattern": max((h.confined_at for h in first.hypersurfaces if h.confined_at is not None), default=None),
        "hypersurfaces": _hypersurface_entries(first),
    }
    if report:
        result["report"] = [
            {
                "eps": format_number(run.eps),
                **fields(run, "verdict", "denominator"),
                "polynomials": [h.polynomial for h in run.hypersurfaces],
                "hypersurfaces": _hypersurface_entries(run),
            }
            for run in runs
        ]
    return result


@task("cycles")
def cycles(
    system: SystemFile,
    prime: int,
    eps: Any = None,
    samples: int | None = None,
    steps: int | None = None,
    seed: int = 0,
    report: bool = False,
) -> Result:
    """Count the lengths of the cycles over a finite field."""
    from kahanmaps.laboratory.cycles import DEFAULT_STEPS, cycle_census, default_eps

    if steps is not None and samples is None:
        raise InputError(f"found steps = {steps} without samples, expected both: only samples have a last step")
    eps_values = (1,) if not system.map.has_eps else default_eps(prime) if eps is None else (eps,)
    limits: dict[str, Any] = {"samples": samples, "steps": steps or DEFAULT_STEPS, "seed": seed}
    runs = [cycle_census(system.map, value, prime, **limits) for value in eps_values]
    return {
        "status": "complete" if all(census.complete for census in runs) else "sampled",
        "points": str(runs[0].points),  # a text, since the number may exceed the integers of a database
        "longest": max(census.longest for census in runs),
        "runs": [
            {
                "eps": format_number(census.eps),
                **fields(census, "examined", "indeterminate", "pre_indeterminate", "preperiodic", "open", "periodic"),
                **fields(census, "cycles", "longest"),
                **({"lengths": [list(pair) for pair in census.lengths.items()]} if report else {}),
            }
            for census in runs
        ],
    }


@task("lyapunov")
def lyapunov(
    system: SystemFile,
    eps: Any,
    orbits: int = 16,
    box: Any = "1",
    steps: int = 10_000,
    transient: int | None = None,
    seed: int = 0,
) -> Result:
    """Compute Lyapunov exponents per unit of time of float orbits from random points, by the exact tangent map."""
    from kahanmaps.maps.floats.float_conversion import to_floats
    from kahanmaps.maps.floats.lyapunov import lyapunov_exponents
    from kahanmaps.maps.floats.starts import starts_in_box

    starts = starts_in_box(orbits, system.dim, float(to_floats([box])[0]), seed)
    skipped = steps // 10 if transient is None else transient
    result = lyapunov_exponents(system.map, starts, eps, steps, transient=skipped)
    mean, volume = result.mean, result.log_volume
    return {
        "status": "completed" if len(result.exponents) else "no orbit left",
        "ended": result.ended_count,
        "counted": result.steps,
        "largest": _json_number(mean[0]),
        "smallest": _json_number(mean[-1]),
        "exponents": [_json_number(value) for value in mean],
        "spread": [_json_number(value) for value in result.spread],
        "change_from_half": [_json_number(value) for value in result.change],
        "sum": _json_number(mean.sum()),
        "log_volume": _json_number(volume.mean()) if len(volume) else None,
        "residual": _json_number(result.residual) if len(volume) else None,
    }


def _state_of_integrals(search: IntegralSearch) -> str:
    if not search.profile.nullities:
        return "not measured"
    if not search.is_complete:
        return "formulas missing"
    return "unfinished" if search.reason else "complete"


def _state_of_densities(search: DensitySearch) -> str:
    """Return "found", "none" (measured, up to the largest degree that was searched) or "open" (undecided)."""
    if search.densities:
        return "found"
    return "none" if search.reason.startswith("no polynomial") else "open"


def _weakest_verdict(verdicts: Iterable[Certainty]) -> str | None:
    verdict_list = list(verdicts)
    return str(combined(verdict_list)) if verdict_list else None


def _growth_entries(growth: DegreeGrowth) -> Result:
    """Return the entries of a result that describe the growth of degrees."""
    recurrence, rate = growth.recurrence, growth.dynamical_degree
    return {
        "growth": str(growth.growth),
        "looks_exponential": growth.looks_exponential,  # without a recurrence this is an estimate
        "unconfirmed": growth.unconfirmed,  # the reason why a recurrence that fits the degrees is not accepted
        "singularities": None if growth.patterns is None else growth.patterns.text,
        "dynamical_degree": None if rate is None else rate.digits,
        "minimal_polynomial": None if rate is None else format_univariate(fmpq_poly(rate.minimal_polynomial)),
        "power": None if recurrence is None else recurrence.power,
        "recurrence": None if recurrence is None else recurrence.text,
        "closed_form": None if recurrence is None else recurrence.closed_form or None,
    }


def _hypersurface_entries(run: SingularityRun) -> list[Result]:
    return [
        {
            **fields(h, "degree", "divides_denominator", "multiplicity", "status", "contracted_at", "confined_at"),
            "ranks": [step.rank for step in h.steps],
            "poles": [step.pole for step in h.steps],
        }
        for h in run.hypersurfaces
    ]


def _json_number(value: Any) -> float | None:
    """Return a number as a float, or None if JSON cannot represent it."""
    return float(value) if isfinite(value) else None
