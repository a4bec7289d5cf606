"""Poisson tensors that the map preserves."""

from __future__ import annotations

from typing import Any

from kahanmaps.family.system_normal_form import SystemNormalForm
from kahanmaps.laboratory.analyses.part import Run
from kahanmaps.laboratory.findings import Findings
from kahanmaps.laboratory.known import Known, Statement
from kahanmaps.laboratory.preserve.poisson.poisson_tensors import PoissonSearch, find_poisson, with_brackets

_DIMENSIONS = (3, 4)  # in the plane they are densities, and in more dimensions they take long


def poisson(run: Run, **budget: Any) -> PoissonSearch | None:
    """Those of low degree, in dimensions 3 and 4."""
    if run.dim not in _DIMENSIONS:
        return None
    return find_poisson(run.bare, integrals=(), **run.asked, **budget)


def with_brackets_of_integrals(run: Run, seconds: float, **_: Any) -> PoissonSearch | None:
    """Those that were found, with their Casimirs and the integrals in involution."""
    return None if run.found.poisson is None else with_brackets(run.found.poisson, run.integrals, seconds)


def statements(found: Findings) -> list[Statement]:
    """The tensor of a member of the family, and those found."""
    search, lines = found.poisson, []
    if isinstance(found.normal_form, SystemNormalForm) and found.normal_form.form.m > 1:
        text = f"with {found.normal_form.form.m} integrals in involution, as a member of the commuting family"
        lines.append(Statement(Known.PROVED, f"J - eps^2 f'(x)^2 J is an invariant Poisson tensor, {text}"))
    if search is None:
        return lines
    lines += [Statement(Known(one.verdict), f"{one.name}: {one.short_text}; {one.statement}") for one in search.tensors]
    return [*lines, *([Statement(Known.NOTE, search.note)] if search.note else [])]
