"""What `print` shows of a result of the laboratory: the lines of its command below the heading, cells between tabs."""

from __future__ import annotations

from collections.abc import Iterator

from kahanmaps.displayed import text_form
from kahanmaps.laboratory.symmetry.commuting import CommutingField, CommutingSystems
from kahanmaps.laboratory.symmetry.symmetries import SIGNED, Symmetries
from kahanmaps.systems.quadratic import QuadraticSystem


@text_form.register
def symmetries_text(found: Symmetries) -> str:
    """One-parameter groups, a scaling, the finite group by its generators, and what was searched."""
    return "\n".join(_symmetry_lines(found))


def _symmetry_lines(found: Symmetries) -> Iterator[str]:
    for x in found.infinitesimal:
        kind = "linear" if x.is_linear else "affine"
        yield f"one-parameter group\t{kind}, the flow of ({', '.join(x.rhs)})"
    if found.scaling is not None:
        rhs = ", ".join(found.scaling.rhs)
        yield f"scaling\tthe flow of ({rhs}) by t takes the map at eps to that at e^-t eps"
    if found.order is not None:
        yield f"group\t{found.group_text or 'the identity alone'}"
    elements = [("generator", t) for t in found.generators]
    elements += [("besides", t) for t in found.others if found.group_of == SIGNED]
    for name, t in elements:
        yield f"{name}\t{t.kind} {t.text}" + ("\tobvious" if t.obvious else "")
    yield from (f"searched\t{sentence}" for sentence in found.searched)
    yield f"# {'complete: every search came to its end' if found.complete else f'undecided: {found.undecided[0]}'}"


@text_form.register
def commuting_text(found: CommutingSystems) -> str:
    """The g that commute other than 0, f and -f, each with g as options of any other command."""
    return "\n".join(_commuting_lines(found))


def _commuting_lines(found: CommutingSystems) -> Iterator[str]:
    if found.dimension is not None:
        yield f"bracket\tthe g with [f, g] = 0 have dimension {found.dimension}"
    if found.every_g_commutes:
        yield "proved\tf = 0 and its map is x -> x: every g commutes"
    told: list[QuadraticSystem] = []
    for g in found.nontrivial:
        if g.system.scaled(-1) not in told:
            told.append(g.system)
            yield f"{g.finding.verdict}\tg and -g\t{_pasted(g, found.root)}"
            yield f"\t{g.finding.evidence.summary}"
    for family in found.families:
        letters = [f"t{k + 1}" for k in range(len(family.directions))]
        base = "" if family.base.trivial == "0" else "base + "
        total = " + ".join(f"{t}*g{k + 1}" for k, t in enumerate(letters))
        yield f"{family.finding.verdict}\tfamily\tg = {base}{total} for all {', '.join(letters)}"
        named = [("base", family.base)] * bool(base) + [(f"g{k + 1}", g) for k, g in enumerate(family.directions)]
        yield from (f"\t{name}\t{_pasted(g, found.root)}" for name, g in named)
        yield f"\t{family.finding.evidence.summary}"
    if found.irrational:
        yield f"note\tmore solutions, not rational: {'; '.join(found.irrational)}"
    if found.discarded:
        yield f"note\t{found.discarded} solutions of the equations up to eps^{found.order} do not commute"
    if found.every_g_commutes:
        yield "# complete: every g commutes"
    elif found.complete:
        listed = bool(told or found.families or found.irrational)
        but = "these, 0, f and -f" if listed else "0, f and -f"
        yield f"# complete: among the {found.kind_text} only {but} commute with f"
    else:
        yield f"# undecided: there may be more; {found.undecided[0]}"


def _pasted(g: CommutingField, root: str) -> str:
    """The system as options of any other command, and B below it where g = B f."""
    texts = [f"--rhs='{text}'" for text in g.rhs]
    text = f"--vars {','.join(g.system.variables)} {' '.join(texts)}"
    if root:
        text = f"{text} -p '{g.system.symbols[0]}={root}'"
    if g.B is None:
        return text
    rows = [", ".join(map(str, row)) for row in g.B.tolist()]
    return f"{text}\n\tB = [{', '.join(f'[{row}]' for row in rows)}]"
