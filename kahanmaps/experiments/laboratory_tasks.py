"""The tasks of the laboratory: what a map preserves and how it grows, and what is seen of it from outside.

As in tasks.py results are small, words and numbers to group by; `report = true` keeps all that was found. Without eps
an analysis is for every eps. The effort bounds its work, and so belongs to the key; "status" says what is open. The
verdict is that of the formulas that were found; growth and numbers of integrals are measured, and have words of their
own. Singularities, cycles and exponents are all measured: they have no verdict.
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

POISSON = {"symbolic": "symbols", "max_degree": "degree"}
_ENDINGS = ("constant", "singular")  # of degrees without a recurrence that are known for all iterates


@analysis(
    "degrees", "growth.degrees:degree_growth", of="map", eps=None, terms=None, max_degree=20_000, effort=1, seed=0
)
def degrees(found: DegreeGrowth) -> Result:
    """Compute degrees of the iterates: growth, dynamical degree, recurrence."""
    return {
        "status": found.ended,
        **_growth(found),
        "estimate": found.estimate,
        "degrees": list(found.degrees),
        "reached": len(found.degrees) - 1,
        "ending": found.message,
    }


@task("scan", reports=True)
def scan_parameters(
    system: SystemFile,
    over: list[str],
    eps: Any = None,
    by: str = "degrees",  # nothing else any more; it stays for the keys of earlier databases
    terms: int | None = None,
    primes: list[int] | None = None,
    effort: int = 1,
    seed: int = 0,
) -> FullResult:
    """Find the conditions on parameters under which degrees are smaller, and the growth there."""
    from kahanmaps.laboratory.scan.result import growth_on
    from kahanmaps.laboratory.scan.scan import scan

    found = scan(system, over, eps=eps, terms=terms, primes=primes, effort=effort, seed=seed, jobs=1)
    kinds = [(str(growth.growth), some) for _, some in found.classes if (growth := growth_on(some)) is not None]
    return {
        "status": found.ended,
        "growth": kinds[0][0] if kinds else None,  # the slowest
        "components": len(found.components),
        "confirmed": sum(one.is_confirmed for one in found.components),
        "integrable": [one.text for kind, some in kinds if kind != "exponential" for one in some if one.is_confirmed],
        "generic": list(found.generic),
        "unassigned": max(found.unassigned, default=0),
    }, found


@analysis(
    "find-integrals", "preserve.integrals:find_integrals", eps=None, symbolic=None, max_degree=None, effort=1, seed=0
)
def integrals(found: IntegralSearch) -> Result:
    """Search for rational integrals, and find their number by theorems and by orbits."""
    return {
        "verdict": _weakest(verdict for _, verdict in found.formulas),
        "status": _state_of_integrals(found),
        "integrals": found.formula_count,
        "codimension": found.codimension if found.profile.nullities else found.by_theorems or None,
        "formulas": [text for text, _ in found.formulas],
        "nullities": list(found.profile.nullities),
        "period": found.profile.period,
        "reason": found.reason,
    }


@analysis(
    "find-density", "preserve.densities:find_densities", eps=None, symbolic=None, max_degree=None, effort=1, seed=0
)
def density(found: DensitySearch) -> Result:
    """Search for invariant volume forms dx/phi with phi of least degree or a product of powers."""
    return {
        "verdict": _weakest(one.verdict for one in found.densities),
        "status": _state_of_densities(found),
        "densities": len(found.densities),
        "degree_tried": None if found.degree < 0 else found.degree,
        "formulas": [one.text for one in found.densities],
        "period": found.period,
        "reason": found.reason,
    }


@analysis(
    "find-poisson",
    "preserve.poisson.poisson_tensors:find_poisson",
    renamed=POISSON,
    eps=None,
    symbolic=None,
    max_degree=None,
    effort=1,
    seed=0,
)
def poisson(found: PoissonSearch) -> Result:
    """Search for Poisson tensors with polynomial entries: number, ranks, Casimirs among the integrals."""
    return {
        "verdict": _weakest(one.verdict for one in found.tensors),
        "status": "found" if found.tensors else "none" if found.reason.startswith("no tensor") else "open",
        "tensors": len(found.tensors),
        "degree_tried": None if found.degree < 0 else found.degree,
        "formulas": [one.text for one in found.tensors],
        "ranks": [one.rank for one in found.tensors],
        "jacobi": [str(one.jacobi) for one in found.tensors],
        "casimirs": [list(one.casimirs) for one in found.tensors],
        "reason": found.reason,
    }


@analysis("find-symmetry", "symmetry.symmetries:linear_symmetries", of="system", effort=1)
def symmetry(found: Symmetries) -> Result:
    """Find affine symmetries and reversing symmetries for every eps: number and generators."""
    return {
        "verdict": str(Certainty.PROVED if found.complete else Certainty.UNDECIDED),
        "status": "complete" if found.complete else "undecided",
        "group_order": found.order,
        "symmetries": len(found.symmetries),
        "reversing": len(found.reversing),
        "infinitesimal": len(found.infinitesimal),
        "scaling": found.scaling is not None,
        "generators": [one.text for one in found.generators],
        "open": found.undecided,
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
def commuting(found: CommutingSystems) -> Result:
    """Find the quadratic systems whose Kahan maps commute with this one for every eps."""
    return {
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


@analysis("analyze", "analysis:analyze", eps=None, symbolic=None, effort=1, seed=0)
def all_analyses(found: Analysis) -> Result:
    """Run all analyses: integrability, integrals, growth, densities, symmetries, commuting systems."""
    from kahanmaps.family.system_normal_form import SystemNormalForm

    final, confined = found.conclusion, {run.verdict for run in found.singularities}
    # The parts that were begun and did not come to their end, be it for want of budget or of formulas.
    states = {
        "degrees": found.degrees is None or found.degrees.recurrence is not None or found.degrees.ended in _ENDINGS,
        "integrals": found.integrals is None or _state_of_integrals(found.integrals) == "complete",
        "densities": found.densities is None or _state_of_densities(found.densities) != "open",
        "symmetries": found.symmetries is None or found.symmetries.complete,
        "commuting systems": found.commuting is None or found.commuting.complete,
        "singularities": not any(run.stopped or run.verdict == "undecided" for run in found.singularities),
    }
    unfinished = [name for name, is_done in states.items() if not is_done]
    return {
        "status": "partial" if found.skipped or unfinished else "complete",
        "integrability": final.kind,
        "integrals": final.integrals if found.integrals_were_counted else None,
        **(_growth(found.degrees) if found.degrees is not None else {}),
        "growth": final.growth,
        "densities": None if found.densities is None else len(found.densities.densities),
        "group_order": None if found.symmetries is None else found.symmetries.order,
        "commuting": None if found.commuting is None else len(found.commuting.nontrivial),
        "confinement": None if not confined else confined.pop() if len(confined) == 1 else "undecided",
        "in_family": isinstance(found.normal_form, SystemNormalForm),
        "sentence": final.sentence,
        "unfinished": unfinished,
        "skipped": found.skipped,
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

    values = default_eps(system.map, seed) if eps is None else (eps,)
    runs = [singularities(system.map, value, steps=steps, seed=seed, effort=effort) for value in values]
    agree = len({run.shape for run in runs}) == 1
    first = runs[0]
    result: Result = {
        "confinement": first.verdict if agree else UNDECIDED,
        "status": "budget" if any(run.stopped for run in runs) else "complete" if agree else "eps differ",
        "tried": [format_number(run.eps) for run in runs],
        "followed": first.followed,  # for so many steps, where something is not confined
        **fields(first, "map_degree", "critical_degree"),
        "contracted": sum(h.status != NOT_CONTRACTED for h in first.hypersurfaces),
        "longest_pattern": max((h.confined_at for h in first.hypersurfaces if h.confined_at is not None), default=None),
        "hypersurfaces": _hypersurfaces(first),
    }
    if report:
        result["report"] = [
            {
                "eps": format_number(run.eps),
                **fields(run, "verdict", "denominator"),
                "polynomials": [h.polynomial for h in run.hypersurfaces],
                "hypersurfaces": _hypersurfaces(run),
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
    values = (1,) if not system.map.has_eps else default_eps(prime) if eps is None else (eps,)
    limits: dict[str, Any] = {"samples": samples, "steps": steps or DEFAULT_STEPS, "seed": seed}
    runs = [cycle_census(system.map, value, prime, **limits) for value in values]
    return {
        "status": "complete" if all(census.complete for census in runs) else "sampled",
        "points": str(runs[0].points),  # may be longer than integers of databases
        "longest": max(census.longest for census in runs),
        "runs": [
            {
                "eps": format_number(census.eps),
                **fields(census, "looked_at", "indeterminate", "pre_indeterminate", "preperiodic", "open", "periodic"),
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
    """Lyapunov exponents of float orbits from random starts, by the exact tangent map, per unit of time."""
    from kahanmaps.maps.floats.ensemble import starts_in_box
    from kahanmaps.maps.floats.float_conversion import to_floats
    from kahanmaps.maps.floats.lyapunov import lyapunov_exponents

    starts = starts_in_box(orbits, system.dim, float(to_floats([box])[0]), seed)
    skipped = steps // 10 if transient is None else transient
    found = lyapunov_exponents(system.map, starts, eps, steps, transient=skipped)
    mean, volume = found.mean, found.log_volume
    return {
        "status": "completed" if len(found.exponents) else "no orbit left",
        "ended": found.ended,
        "counted": found.steps,
        "largest": _number(mean[0]),
        "smallest": _number(mean[-1]),
        "exponents": [_number(value) for value in mean],
        "spread": [_number(value) for value in found.spread],
        "change_from_half": [_number(value) for value in found.change],
        "sum": _number(mean.sum()),
        "log_volume": _number(volume.mean()) if len(volume) else None,
        "residual": _number(found.residual) if len(volume) else None,
    }


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


def _weakest(verdicts: Iterable[Certainty]) -> str | None:
    """The weakest of the verdicts; None where nothing was found: that there is nothing is no claim here."""
    given = list(verdicts)
    return str(combined(given)) if given else None


def _growth(found: DegreeGrowth) -> Result:
    """Return the entries on the growth of degrees."""
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


def _hypersurfaces(run: SingularityRun) -> list[Result]:
    return [
        {
            **fields(h, "degree", "is_pole", "multiplicity", "status", "contracted_at", "confined_at"),
            "ranks": [step.rank for step in h.steps],
            "poles": [step.pole for step in h.steps],
        }
        for h in run.hypersurfaces
    ]


def _number(value: Any) -> float | None:
    """Return a float of numpy as a number of JSON."""
    return float(value) if isfinite(value) else None
