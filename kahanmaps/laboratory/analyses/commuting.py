"""Systems whose Kahan maps commute with that of the system."""

from __future__ import annotations

from typing import Any

from kahanmaps.errors import counted
from kahanmaps.family.skew_hamiltonian import factors_of_chi
from kahanmaps.family.system_normal_form import SystemNormalForm
from kahanmaps.laboratory.analyses.part import Run
from kahanmaps.laboratory.findings import Findings
from kahanmaps.laboratory.known import Known, Statement
from kahanmaps.laboratory.symmetry.commuting import CommutingFamily, CommutingField, CommutingSystems
from kahanmaps.laboratory.symmetry.commuting_over import find_commuting

_LONG = 300  # characters of a sentence with a formula


def commuting(run: Run, **budget: Any) -> CommutingSystems | None:
    """All g of a kind, for every eps."""
    if run.found.eps is not None:
        return None
    return find_commuting(run.system or run.map, seed=run.seed, **budget)


def statements(found: Findings) -> list[Statement]:
    """The g that commute, with g there is -g."""
    lines = []
    if isinstance(found.normal_form, SystemNormalForm) and (m := found.normal_form.form.m) > 1:
        text = f"the Kahan maps of its {2 ** (m - 1)} associated systems, f itself among them, commute"
        split = all(factor.degree == 1 for factor in factors_of_chi(found.normal_form.form.A))
        lines.append(Statement(Known.PROVED, text if split else f"{text} over the splitting field of chi"))
    search = found.commuting
    if search is None:
        return lines
    if search.every_g_commutes:
        lines.append(Statement(Known.PROVED, "the map is the identity and commutes with every other"))
    told: list[CommutingField] = []
    for one in search.nontrivial:  # with g there is -g, whose map is the inverse
        if not any(one.system == other.system.scaled(-1) for other in told):
            told.append(one)
            text = f"commutes with the Kahan maps of g and -g, g = ({', '.join(one.rhs)})"
            lines.append(Statement(Known(one.finding.verdict), text))
    for k, family in enumerate(search.families):
        if not any(_are_opposite(family, other) for other in search.families[:k]):
            lines.append(Statement(Known(family.finding.verdict), _family_text(family)))
    lines += [Statement(Known.NOTE, text) for text in search.irrational]
    lines += [Statement(Known.UNDECIDED, text) for text in search.undecided]
    if not (told or search.every_g_commutes or search.families or search.irrational or search.undecided):
        lines.append(Statement(Known.PROVED, f"among the {search.kind_text} only 0, f and -f commute with f"))
    return lines


def _family_text(family: CommutingFamily) -> str:
    """All g of a linear family, or how many parameters it has where that is long."""
    base = [] if family.base.trivial == "0" else [f"({', '.join(family.base.rhs)})"]
    moved = [f"t{k}*({', '.join(g.rhs)})" for k, g in enumerate(family.directions, 1)]
    which = "g and -g, g" if base else "all g"  # the negatives of these are among them
    letters = ", ".join(f"t{k}" for k in range(1, len(moved) + 1))
    text = f"commutes with the Kahan maps of {which} = {' + '.join([*base, *moved])}, for all {letters}"
    if len(text) > _LONG:
        return f"commutes with a linear family of {counted(len(moved), 'parameter')}, which find-commuting writes out"
    return text


def _are_opposite(family: CommutingFamily, other: CommutingFamily) -> bool:
    """Whether the negatives of the one are the other."""
    directions, others = ([g.system for g in one.directions] for one in (family, other))
    return directions == others and family.base.system == other.base.system.scaled(-1)
