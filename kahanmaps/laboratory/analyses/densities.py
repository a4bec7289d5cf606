"""Densities: the volume forms that the map preserves."""

from __future__ import annotations

from typing import Any

from kahanmaps.laboratory.analyses.integrals import listed
from kahanmaps.laboratory.analyses.part import Run
from kahanmaps.laboratory.findings import Findings
from kahanmaps.laboratory.known import Known, Statement
from kahanmaps.laboratory.preserve.densities import DensitySearch, find_densities, with_factors


def densities(run: Run, **budget: Any) -> DensitySearch:
    """One in closed form, and whether there are others."""
    return find_densities(run.bare, **run.asked, integrals=(), **budget)


def with_factors_of_integrals(run: Run, **_: Any) -> DensitySearch | None:
    """What was found, or a product of powers of factors of the integrals."""
    return None if run.found.densities is None else with_factors(run.found.densities, run.integrals)


def statements(found: Findings) -> list[Statement]:
    """The densities, or why none was found."""
    search = found.densities
    if search is None:
        return []
    lines = []
    if search.densities:
        lines += [Statement(Known(one.verdict), f"dx/phi is invariant, phi = {one.text}") for one in search.shown]
        if len(search.densities) > 1:
            names = [] if found.integrals is None else [one.name for one in found.integrals.integrals]
            times = f"any function of {listed(names)}" if names else "any integral"
            lines.append(Statement(Known.NOTE, f"so is dx/phi for this phi times {times}"))
    else:
        lines.append(Statement(Known.MEASURED if search.none_there else Known.UNDECIDED, search.reason))
    if search.turning is not None:
        text = f"|dx/phi| is invariant, and dx/phi changes its sign, phi = {search.turning.text}"
        lines.append(Statement(Known(search.turning.verdict), text))
    return lines
