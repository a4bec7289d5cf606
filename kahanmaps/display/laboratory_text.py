"""What `print` shows of a result of the laboratory: the lines of its command below the heading, cells between tabs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from kahanmaps.algebra.text import format_number, format_polynomial
from kahanmaps.checks.settings import eps_record, eps_words
from kahanmaps.displayed import text_form
from kahanmaps.laboratory.analysis import Analysis
from kahanmaps.laboratory.finite.cycles import Census
from kahanmaps.laboratory.growth.degrees import DegreeGrowth
from kahanmaps.laboratory.growth.height_survey import HeightSurvey
from kahanmaps.laboratory.preserve.darboux import DarbouxSearch
from kahanmaps.laboratory.preserve.densities import DensitySearch
from kahanmaps.laboratory.preserve.hamiltonian_structure import ConstantStructures
from kahanmaps.laboratory.preserve.integrals import IntegralSearch
from kahanmaps.laboratory.preserve.poisson_tensors import PoissonSearch
from kahanmaps.laboratory.scan.result import Scan
from kahanmaps.laboratory.singular.outcomes import Hypersurface
from kahanmaps.laboratory.singular.singularities import SingularityRun
from kahanmaps.laboratory.symmetry.commuting import CommutingField, CommutingSystems
from kahanmaps.laboratory.symmetry.symmetries import SIGNED, Symmetries
from kahanmaps.systems.quadratic import QuadraticSystem

_LENGTHS_SHOWN = 12
WORDS = (
    "proved: an identity of rational functions, or a theorem; supported: true at random points; explained: follows "
    "from singularities that were measured; measured: modulo primes or along orbits, which is evidence"
)


def analysis_title(found: Analysis) -> str:
    """The system, its dimension and parameters, and for which eps the report is."""
    step = eps_words(eps_record(found.eps, found.file.map))
    values = "".join(f", {name} = {value}" for name, value in found.file.parameters.items())
    formulas = f"; formulas for every {', '.join(found.symbols)}" if found.symbols else ""
    return f"{found.file.name}, dimension {found.dim}{values}{step}{formulas}"


def analysis_head(found: Analysis) -> str:
    """What stands above the sections: the title, the equations, what the words mean."""
    return f"analyze: {analysis_title(found)}\n{found.file.map}\n{WORDS}"


@text_form.register
def analysis_text(found: Analysis) -> str:
    """The whole report."""
    lines = [analysis_head(found)]
    for name, told in found.sections:
        lines += ["", name, *(f"{line.status}\t{line.text}" for line in told)]
    return "\n".join([*lines, "", "verdict", f"{found.conclusion.kind}\t{found.conclusion.sentence}"])


@text_form.register
def degrees_text(found: DegreeGrowth | Scan) -> str:
    """The lines that it has itself."""
    return found.text


@text_form.register
def integrals_text(found: IntegralSearch) -> str:
    """Every formula with its verdict and what that rests on, then why there are no more."""
    return _formulas([(one.name, one, "") for one in found.integrals], (found.note, found.reason))


@text_form.register
def densities_text(found: DensitySearch) -> str:
    """The formula with its verdict and what that rests on, then what more there is, or why there is none."""
    return _formulas([("phi", one, "") for one in found.shown], (found.further, found.note, found.reason))


@text_form.register
def poisson_text(found: PoissonSearch) -> str:
    """Every tensor with its verdict and what is known of it, then why there are no more."""
    named = [(one.name, one, f"{one.statement}; ") for one in found.tensors]
    return _formulas(named, (found.note, found.reason))


def _formulas(named: Sequence[tuple[str, Any, str]], notes: Sequence[str]) -> str:
    lines = [f"{name}\t{one.verdict}\t{one.text}\n\t{what}{one.evidence.summary}" for name, one, what in named]
    return "\n".join([*lines, *(f"note\t{text}" for text in notes if text)])


@text_form.register
def darboux_text(found: DarbouxSearch) -> str:
    """The law, the polynomials by cofactor, or that there are none."""
    meaning = ", C a product of C[g] = g(x~, -eps)/g(x, eps)" if "C[" in "".join(found.cofactors) else ""
    law = f"P(x~) = C P(x){meaning}; spaces spanned by products left out"
    lines = ["P' = K P, irreducible; integrals left out" if found.flow else law]
    for space in found.spaces:
        lines.append(f"{'K' if found.flow else 'C'} = {space.cofactor}")
        lines += [f"\t{space.verdict}\t{format_polynomial(P)}" for P in space.polynomials]
    if found.reason:
        lines.append(f"note\t{found.reason}")
    elif not found.spaces:
        lines.append(f"none of degree up to {found.degree}")
    return "\n".join(lines)


@text_form.register
def heights_text(found: HeightSurvey) -> str:
    """A line for each orbit, and what they say together."""
    lines = []
    for orbit in found.orbits:
        point = ",".join(format_number(entry) for entry in orbit.start)
        eps = [f"eps {orbit.eps}"] if found.has_eps else []
        lines.append("\t".join(["orbit", *eps, f"start {point}", orbit.growth.text]))
    return "\n".join([*lines, f"heights\t{found.text}"])


@text_form.register
def census_text(census: Census) -> str:
    """The counts, and the longest cycles."""
    lines = [("points", str(census.points) if census.complete else f"{census.points}, sampled {census.looked_at}")]
    if census.is_undefined:
        lines.append(("map", "singular everywhere modulo this prime"))
    elif census.factor is None:
        lines.append(("map", f"forms of degree {census.degree}; a common factor was not looked for"))
    elif census.factor != "1":
        lines.append(("map", f"forms of degree {census.degree}, a common factor divided out"))
    lines += [("lost", str(census.lost)), ("falling", str(census.falling))]
    lines.append(
        ("transient", str(census.transient))
        if census.complete
        else ("open", f"{census.open} after {census.steps} steps")
    )
    lines.append(("periodic", str(census.periodic)))
    if census.cycles:
        lines.append(("cycles", f"{census.cycles}, longest {census.longest}, mean {census.mean:.2f}"))
        if census.at_infinity:
            lines.append(("at infinity", f"{sum(census.at_infinity.values())} of them"))
        if census.symmetric is not None:
            lines.append(("symmetric", f"{sum(census.symmetric.values())} of the others"))
    shown = list(census.lengths.items())[-_LENGTHS_SHOWN:]
    if shown:
        what = "length x cycles" if census.complete else "length x points"
        more = "... " if len(census.lengths) > len(shown) else ""
        lines.append((what, more + " ".join(f"{length}x{n}" for length, n in shown)))
    return "\n".join("\t".join(line) for line in lines)


@text_form.register
def singularities_text(run: SingularityRun) -> str:
    """The denominator, and each hypersurface with its outcome."""
    lines = [f"# map of degree {run.map_degree}, {run.text}"]
    if run.word is not None:
        lines.append(f"# {run.word.text}")
    lines.append(f"denominator\t{run.denominator}")
    for found in run.hypersurfaces:
        kind = f"degree {found.degree}" + (", pole" if found.is_pole else "")
        kind += " in all" if found.polynomial == "?" else ""
        kind += "" if found.stage is None else f", of map {found.stage + 1}"
        lines.append(f"{found.polynomial}\t{kind}\t{_outcome(found)}")
        if found.steps:
            ranks = " ".join(str(step.rank) for step in found.steps)
            poles = " ".join("?" if step.pole is None else str(step.pole) for step in found.steps)
            lines.append(f"  ranks {ranks}\tpoles {poles}")
    return "\n".join(lines)


def _outcome(found: Hypersurface) -> str:
    if found.status == "confined":
        return f"contracted by step {found.contracted_at}, confined after {found.confined_at} steps"
    if found.status == "not confined":
        return f"contracted by step {found.contracted_at}, not confined within {found.followed} steps"
    return found.status + (f": {found.note}" if found.note else "")


@text_form.register
def structures_text(found: ConstantStructures) -> str:
    """The Hamiltonian form, or why there is none."""
    if found.hamiltonian is None:
        return f"not Hamiltonian with a constant J: {found.reason}"
    lines = [f"H\t{format_polynomial(found.hamiltonian.H)}", f"J\t{found.hamiltonian.J.tolist()}"]
    return "\n".join([*lines, *(f"Casimir\t{format_polynomial(casimir)}" for casimir in found.casimirs)])


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
