"""The vector field: its divergence, its fixed points, and a system of the catalogue that it is equivalent to."""

from __future__ import annotations

from typing import Any

from kahanmaps.algebra.written.text import format_polynomial
from kahanmaps.errors import counted
from kahanmaps.laboratory.analyses.part import Run
from kahanmaps.laboratory.findings import Findings
from kahanmaps.laboratory.known import Known, Statement
from kahanmaps.laboratory.vector_field.equivalence import Equivalence, equivalent_system
from kahanmaps.laboratory.vector_field.fixed_points import FixedPointSearch
from kahanmaps.laboratory.vector_field.fixed_points import fixed_points as find_fixed_points

_POINTS = 8  # as many fixed points as three quadratic equations have


def fixed_points(run: Run, seconds: float, **_: Any) -> FixedPointSearch:
    """Where f = 0."""
    return find_fixed_points(run.field, seconds=seconds)


def equivalent(run: Run, seconds: float, **_: Any) -> Equivalence | None:
    """A system of the catalogue, after an affine change of variables."""
    return equivalent_system(run.found.file, run.found.fixed_points, seconds=seconds)


def statements(found: Findings) -> list[Statement]:
    """div f and the fixed points, the first of them only where there are many."""
    search = found.fixed_points
    if search is None:
        return []
    divergence = format_polynomial(found.file.system.divergence)
    lines = [
        Statement(Known.PROVED, f"div f = {divergence}" + (": the flow preserves volume" if divergence == "0" else ""))
    ]
    lines += [Statement(Known.PROVED, one.text) for one in search.found[:_POINTS]]
    if len(search.found) > _POINTS:
        more = counted(len(search.found) - _POINTS, "more set")
        lines.append(Statement(Known.NOTE, f"and {more} of fixed points: --json lists them"))
    if search.undecided:
        lines.append(Statement(Known.UNDECIDED, f"not all fixed points were found: {search.undecided}"))
    elif not search.found:
        lines.append(
            Statement(Known.PROVED, "f = 0 has no solution, not over the complex numbers either: no fixed point")
        )
    else:
        text = "flow and map have the same fixed points; an eigenvalue lambda of f' becomes the multiplier"
        lines.append(Statement(Known.NOTE, f"{text} (1 + eps*lambda)/(1 - eps*lambda) of the map"))
    if found.equivalent is not None:
        lines.append(Statement(Known.PROVED, found.equivalent.text))
    return lines
