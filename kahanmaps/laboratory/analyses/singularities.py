"""What becomes of the hypersurfaces that the map contracts."""

from __future__ import annotations

from typing import Any

from kahanmaps.algebra.written.plain import attributes
from kahanmaps.algebra.written.text import format_number
from kahanmaps.errors import counted
from kahanmaps.laboratory.analyses.part import Run
from kahanmaps.laboratory.findings import Findings
from kahanmaps.laboratory.known import Known, Statement
from kahanmaps.laboratory.singular.outcomes import Outcome
from kahanmaps.laboratory.singular.singularities import SingularityRun, can_be_written, default_eps
from kahanmaps.laboratory.singular.singularities import singularities as follow


def singularities(run: Run, seconds: float, **budget: Any) -> list[SingularityRun]:
    """Their outcomes at the given eps or at two values; none where the map is too large to be written."""
    values = default_eps(run.map, run.seed) if run.found.eps is None else (run.found.eps,)
    seconds /= len(values)
    if not all(can_be_written(run.map, value, seconds) for value in values):
        return []
    return [follow(run.map, value, seed=run.seed, seconds=seconds, **budget) for value in values]


def singularities_json(found: Findings) -> dict[str, Any]:
    """The outcome at each eps."""
    return {"singularities": [attributes(run, "eps", "verdict", "followed", "text") for run in found.singularities]}


def statements(found: Findings) -> list[Statement]:
    """The outcome at all values of eps, where they agree."""
    if not found.singularities:
        return []
    verdicts = {run.verdict for run in found.singularities}
    values = ", ".join(format_number(run.eps) for run in found.singularities)
    if len(verdicts) > 1:
        return [Statement(Known.UNDECIDED, f"the eps {values} disagree: {', '.join(sorted(verdicts))}")]
    first = min(found.singularities, key=lambda run: run.followed or 0)
    at = f" (eps = {values})" if found.file.map.has_eps else ""
    lines = [Statement(Known.UNDECIDED if first.verdict == Outcome.UNDECIDED else Known.MEASURED, f"{first.text}{at}")]
    ends = [h.confined_at for run in found.singularities for h in run.hypersurfaces if h.confined_at is not None]
    if ends:
        lines.append(Statement(Known.MEASURED, f"the last confinement comes after {counted(max(ends), first.unit)}"))
    return lines
