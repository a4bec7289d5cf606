"""How the degrees of the iterates grow, and the heights of exact orbits."""

from __future__ import annotations

from typing import Any

from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.analyses.part import Run
from kahanmaps.laboratory.consistency import doubt_of_heights
from kahanmaps.laboratory.findings import Findings
from kahanmaps.laboratory.growth.degrees import DegreeGrowth, degree_growth
from kahanmaps.laboratory.growth.height_survey import HeightSurvey, height_survey
from kahanmaps.laboratory.known import Known, Statement
from kahanmaps.laboratory.singular.singularities import WRITTEN_DIMENSION, patterns_of

_SHOWN_DEGREES = 12


def degrees(run: Run, **budget: Any) -> DegreeGrowth:
    """Degrees of the iterates, with the patterns of singularities to explain them."""
    runs = run.found.singularities if run.dim <= WRITTEN_DIMENSION else []
    # Where they are known to the end and are those that `degrees` would ask for itself.
    known = patterns_of(runs) if runs else None
    given: dict[str, Any] = {"patterns": None if known is None or known.running else known, "seed": run.seed}
    return degree_growth(run.map, run.found.eps, **given, **budget)


def heights(run: Run, **budget: Any) -> HeightSurvey:
    """Heights of a few orbits."""
    return height_survey(run.map, run.found.eps, starts=2, max_digits=5_000, seed=run.seed, **budget)


def statements(found: Findings) -> list[Statement]:
    """Degrees with their recurrence, then heights."""
    lines = []
    if found.degrees is not None:
        shown = ", ".join(map(str, found.degrees.degrees[1 : _SHOWN_DEGREES + 1]))
        more = ", ..." if len(found.degrees.degrees) > _SHOWN_DEGREES + 1 else ""
        if shown:
            status = Known.MEASURED if found.degrees.primes else Known.PROVED  # by powers of a matrix
            lines.append(Statement(status, f"degrees of the iterates: {shown}{more}"))
        known = found.degrees.known
        lines.append(Statement(known, found.degrees.growth_text))
        recurrence = found.degrees.recurrence
        if recurrence is not None:
            known = Known.MEASURED if found.degrees.explained is None else Known.EXPLAINED
            lines.append(Statement(known, f"recurrence: {recurrence.text}"))
            if recurrence.closed_form_text:
                lines.append(Statement(known, f"d_n = {recurrence.closed_form_text}"))
        if found.degrees.enclosure is not None:
            lines.append(Statement(Known.PROVED, found.degrees.enclosure.text))
    if found.heights is not None:
        doubt = doubt_of_heights(found)
        status = Known.UNDECIDED if doubt or found.heights.kind is Growth.UNDECIDED else Known.MEASURED
        text = found.heights.text
        lines.append(Statement(status, f"{text}, but {doubt}" if doubt else text))
    return lines
