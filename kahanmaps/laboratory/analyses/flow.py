"""What of the flow the map keeps, deforms and loses."""

from __future__ import annotations

from typing import Any

from kahanmaps.laboratory.analyses.part import Run
from kahanmaps.laboratory.findings import Findings
from kahanmaps.laboratory.known import Known, Statement
from kahanmaps.laboratory.preserve.limit.limits import FlowAndMap, flow_and_map, with_limit


def flow(run: Run, **budget: Any) -> FlowAndMap | None:
    """The limits of integrals for eps -> 0, and integrals and a density of the flow."""
    found = run.found
    return None if found.integrals is None else flow_and_map(found.integrals, known=found.integral_count, **budget)


def with_limit_of_density(run: Run, **_: Any) -> FlowAndMap | None:
    """What was found of the flow, with the limit of a density of the map for its density, if that is one."""
    return None if run.found.flow is None else with_limit(run.found.flow, run.found.densities)


def statements(found: Findings) -> list[Statement]:
    """A line for each thing kept, deformed or lost."""
    return [] if found.flow is None else [Statement(Known(known), text) for known, text in found.flow.lines()]
