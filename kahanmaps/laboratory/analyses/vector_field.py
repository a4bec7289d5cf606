"""The vector field: its divergence, its fixed points, and a system of the catalogue that it is equivalent to."""

from __future__ import annotations

from typing import Any

from flint import fmpq

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
        lines.append(Statement(Known.NOTE, _of_the_map(search, found.eps)))
    if found.equivalent is not None:
        lines.append(Statement(Known.PROVED, found.equivalent.text))
    return lines


def _of_the_map(search: FixedPointSearch, eps: fmpq | None) -> str:
    """Which of the fixed points of the flow are fixed points of the map: those with det(I - eps f'(x)) not 0."""
    known = [one.are_fixed_by_map(eps) for one in search.found]
    lost = [one.where for one, is_fixed in zip(search.found, known, strict=True) if is_fixed is False]
    if len(lost) == len(known):
        return f"at eps = {eps} det(I - eps f'(x)) is 0 at all of them: the map has no value there"
    where = "" if all(known) else " where det(I - eps f'(x)) is not 0"
    if lost:
        where += f"; at eps = {eps} it is 0 at the {', the '.join(lost)}, where the map has no value"
    multiplier = "an eigenvalue lambda of f' becomes the multiplier (1 + eps*lambda)/(1 - eps*lambda) of the map"
    return f"flow and map have the same fixed points{where}; {multiplier}"
