"""The tasks of the laboratory that watch a map: its singularities, its cycles over finite fields, its exponents.

Results are small, words and numbers to group by, and all of it is measured: nothing here has a verdict. Where the time
(`seconds`) cut a result short, "status" says so.
"""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Any

from kahanmaps.algebra.text import format_number
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError
from kahanmaps.experiments.registry import Result, task

if TYPE_CHECKING:
    from kahanmaps.laboratory.cycle_laws import Comparison
    from kahanmaps.laboratory.cycles import Census
    from kahanmaps.laboratory.singularities import SingularityRun


@task("singularities")
def confinement(
    system: SystemFile,
    eps: Any = None,
    steps: int | None = None,
    seconds: int = 60,
    seed: int = 0,
    report: bool = False,
) -> Result:
    """Are singularities confined? The hypersurfaces that the map contracts; without eps two values are compared."""
    from kahanmaps.laboratory.fates import NOT_CONTRACTED, UNDECIDED
    from kahanmaps.laboratory.singularities import default_eps, singularities

    values = default_eps(system.system, seed) if eps is None else (eps,)
    runs = [singularities(system.system, value, steps=steps, seed=seed, seconds=seconds) for value in values]
    agree = len({run.shape for run in runs}) == 1
    first = runs[0]
    result: Result = {
        "confinement": first.verdict if agree else UNDECIDED,
        "status": "time" if any(run.stopped for run in runs) else "complete" if agree else "eps differ",
        "tried": [format_number(run.eps) for run in runs],
        "followed": first.followed,  # for so many steps, where something is not confined
        "map_degree": first.map_degree,
        "critical_degree": first.critical_degree,
        "contracted": sum(h.status != NOT_CONTRACTED for h in first.hypersurfaces),
        "longest_pattern": max((h.confined_at for h in first.hypersurfaces if h.confined_at is not None), default=None),
        "hypersurfaces": _hypersurfaces(first),
    }
    if report:
        result["report"] = [
            {
                "eps": format_number(run.eps),
                "verdict": run.verdict,
                "denominator": run.denominator,
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
    seconds: int = 60,
    seed: int = 0,
    report: bool = False,
) -> Result:
    """The cycles of the map over a finite field, and the laws that their lengths are compatible with."""
    from kahanmaps.laboratory.cycle_laws import LAWS, compare
    from kahanmaps.laboratory.cycles import cycle_census, default_eps
    from kahanmaps.laboratory.reversors import find_reversor

    if steps is not None and samples is None:
        raise InputError(f"found steps = {steps} without samples, expected both: whole graphs have no last step")
    reversor = find_reversor(system.system)
    runs: list[tuple[Census, Comparison]] = []
    for value in default_eps(prime) if eps is None else (eps,):
        census = cycle_census(
            system.system,
            value,
            prime,
            reversor=reversor,
            samples=samples,
            steps=steps,
            seed=seed,
            seconds=seconds,
        )
        runs.append((census, compare(census, seed)))
    whole = all(census.complete for census, _ in runs)
    stopped = any(census.stopped for census, _ in runs)
    verdicts = {law: {found.verdict(law) for _, found in runs} for law in LAWS}
    shares = [found.share_within for _, found in runs if found.share_within is not None]
    return {
        "status": "time" if stopped else "complete" if whole else "sampled",
        **{law.replace(" ", "_"): one.pop() if len(one) == 1 else "eps differ" for law, one in verdicts.items()},
        "points": str(runs[0][0].points),  # may be longer than integers of databases
        "bound": runs[0][1].bound,
        "least_share_within_bound": min(shares, default=None),
        "longest": max(census.longest for census, _ in runs),
        "has_reversor": reversor is not None,
        "runs": [_census(census, found, report) for census, found in runs],
    }


@task("lyapunov")
def lyapunov(
    system: SystemFile,
    eps: Any,
    orbits: int = 16,
    box: Any = "1",
    steps: int = 10_000,
    transient: int | None = None,
    seconds: int = 60,
    seed: int = 0,
) -> Result:
    """Lyapunov exponents of float orbits from random starts, by the exact tangent map, per unit of time."""
    from kahanmaps.maps.float_ensemble import starts_in_box
    from kahanmaps.maps.float_lyapunov import lyapunov_exponents
    from kahanmaps.maps.float_numbers import to_floats

    starts = starts_in_box(orbits, system.system.dim, float(to_floats([box])[0]), seed)
    skipped = steps // 10 if transient is None else transient
    found = lyapunov_exponents(system.system, eps, starts, steps, transient=skipped, seconds=seconds)
    mean, volume = found.mean, found.log_volume
    return {
        "status": "time" if found.stopped else "completed" if len(found.exponents) else "no orbit left",
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


def _hypersurfaces(run: SingularityRun) -> list[Result]:
    return [
        {
            "degree": h.degree,
            "is_pole": h.is_pole,
            "multiplicity": h.multiplicity,
            "status": h.status,
            "contracted_at": h.contracted_at,
            "confined_at": h.confined_at,
            "ranks": [step.rank for step in h.steps],
            "poles": [step.pole for step in h.steps],
        }
        for h in run.hypersurfaces
    ]


def _census(census: Census, found: Comparison, lengths: bool) -> Result:
    result: Result = {
        "eps": format_number(census.eps),
        **{
            name: getattr(census, name)
            for name in ("looked_at", "lost", "falling", "transient", "open", "periodic", "cycles", "longest", "mean")
        },
        "share_within_bound": found.share_within,
        "distance": found.distance,
        "critical_distance": found.critical,
        "compatible": list(found.compatible),
        "not_compatible": list(found.refused),
    }
    if lengths:
        result["lengths"] = [list(pair) for pair in census.lengths.items()]
        result["reasons"] = dict(found.reasons)
    return result


def _number(value: Any) -> float | None:
    """A float of numpy as one that JSON has."""
    return float(value) if isfinite(value) else None
