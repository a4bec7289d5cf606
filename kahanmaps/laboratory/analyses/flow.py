"""What of the flow the map keeps, deforms and loses."""

from __future__ import annotations

from typing import Any

from kahanmaps.laboratory.analyses.part import Run
from kahanmaps.laboratory.findings import Findings
from kahanmaps.laboratory.known import Known, Statement
from kahanmaps.laboratory.preserve.limit.limits import FlowAndMap, flow_and_map


def flow(run: Run, **budget: Any) -> FlowAndMap | None:
    """The limits of integrals and densities for eps -> 0, and the integrals of the flow."""
    found = run.found
    if found.integrals is None:
        return None
    return flow_and_map(found.integrals, found.densities, known=found.integral_count, **budget)


def statements(found: Findings) -> list[Statement]:
    """A line for each thing kept, deformed or lost."""
    return [] if found.flow is None else [Statement(Known(known), text) for known, text in found.flow.lines()]
