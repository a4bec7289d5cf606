"""Display of the results of the laboratory: lines for commands and `print`, tables for notebooks.

`lines_of` returns the lines of a result; a line is a sequence of cells. `print` separates the cells by tabs; a notebook
shows a table of bounded size, with typeset formulas and colored verdicts. Nothing is computed for the display.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import singledispatch
from itertools import islice
from typing import Any

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.algebra.printing import format_number, format_polynomial
from kahanmaps.display import markup
from kahanmaps.display.latex import formula, latex_polynomial, latex_rational_function
from kahanmaps.display.systems import CHARACTERS, equations_html, map_html
from kahanmaps.display_protocols import html_form, latex_form, text_form
from kahanmaps.laboratory.analysis import Analysis
from kahanmaps.laboratory.cycles import Census
from kahanmaps.laboratory.growth.degrees import DegreeGrowth
from kahanmaps.laboratory.growth.height_survey import HeightSurvey
from kahanmaps.laboratory.preserve.darboux.darboux_polynomials import DarbouxPolynomials, DarbouxSearch
from kahanmaps.laboratory.preserve.densities import DensitySearch
from kahanmaps.laboratory.preserve.integrals import IntegralSearch
from kahanmaps.laboratory.preserve.iterates import IntegralInIterates
from kahanmaps.laboratory.preserve.poisson.hamiltonian_structure import ConstantStructures
from kahanmaps.laboratory.preserve.poisson.poisson_tensors import FoundTensor, PoissonSearch
from kahanmaps.laboratory.preserve.results import FoundFunction
from kahanmaps.laboratory.scan.result import Scan
from kahanmaps.laboratory.singular.singularities import SingularityRun
from kahanmaps.laboratory.symmetry.commuting import CommutingField, CommutingSystems
from kahanmaps.laboratory.symmetry.symmetries import MATRICES, Symmetries
from kahanmaps.maps.convention import eps_record, eps_suffix
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.systems.quadratic import QuadraticSystem

_MAX_ROWS = 60  # maximal number of rows of a table in a notebook
_MAX_TEXT_CHARACTERS = 300  # maximal number of characters of a cell in a notebook
_MAX_CYCLE_LENGTHS = 12  # maximal number of cycle lengths that are listed, the largest ones
STATUS_LEGEND = (
    "proved: an identity of rational functions, or a theorem; supported: true at random points; derived: follows "
    "exactly from the measured singularity patterns; measured: modulo primes or along orbits, which is evidence"
)


@dataclass(frozen=True)
class HtmlCell:
    """A cell with a text, which a notebook replaces by `html()`."""

    text: str
    html: Callable[[], str]

    def __str__(self) -> str:
        return self.text


Line = Sequence[object]  # the cells of a line: each is an `HtmlCell` or converted to text by str()


def _formula(text: str, function: fmpq_mpoly | RationalFunction, name: str = "") -> HtmlCell:
    return HtmlCell(text, lambda: formula(function, name, CHARACTERS))


def _polynomial(polynomial: fmpq_mpoly, name: str = "") -> HtmlCell:
    return _formula(format_polynomial(polynomial), polynomial, name)


@latex_form.register
def _found_function(result: FoundFunction) -> str:
    return latex_rational_function(result.function)


@latex_form.register
def _darboux_polynomials(space: DarbouxPolynomials) -> str:
    return r",\quad ".join(map(latex_polynomial, space.polynomials))


@latex_form.register
def _found_tensor(result: FoundTensor | IntegralInIterates) -> str:
    return result.latex()


def eps_sentence(eps: fmpq | None, *maps: MapFamily) -> str:
    """Return a phrase with the eps of a result and the time step 2 eps; empty if no map in `maps` depends on eps."""
    return markup.eps_phrase(eps_record(eps, *maps))


@singledispatch
def lines_of(result: object) -> Iterator[Line]:
    """Yield the lines of a result, which its command prints below the heading."""
    raise TypeError(f"no display is registered for {type(result).__name__}")


def result_text(result: object) -> str:
    """Return the lines of a result as text; tabs separate the cells of a line."""
    return "\n".join("\t".join(map(str, line)) for line in lines_of(result))


def result_html(result: Any, map_: MapFamily | None = None) -> str:
    """Return the lines of a result as a table in HTML; `map_` is needed if the result does not contain its map."""

    def cell_html(cell: object) -> str:
        if isinstance(cell, HtmlCell):
            return cell.html()
        text = str(cell).strip().removeprefix("# ")
        return markup.verdict(text) if text in markup.SYMBOLS else _html(text)

    rows = [[cell_html(cell) for cell in line] for line in islice(lines_of(result), _MAX_ROWS + 1)]
    ellipsis = "\n<p>… print shows all lines</p>" if len(rows) > _MAX_ROWS else ""
    title, subtitle = _TITLES[type(result)](result)
    if map_ is not None:
        subtitle = eps_sentence(result.eps, map_)
    return markup.block(title, (markup.folded_table(rows[:_MAX_ROWS]) if rows else "<p>none</p>") + ellipsis, subtitle)


def _html(text: str, width: int = _MAX_TEXT_CHARACTERS) -> str:
    return markup.escape(markup.abbreviate(text, width))


# -- complete analyses


def analysis_title(analysis: Analysis) -> str:
    """Return the title of the report on an analysis: the system, its dimension, its parameters, and eps."""
    eps_text = eps_suffix(analysis.eps, analysis.file.map)
    values = "".join(f", {name} = {value}" for name, value in analysis.file.parameters.items())
    formulas = f"; formulas for every {', '.join(analysis.symbols)}" if analysis.symbols else ""
    return f"{analysis.file.name}, dimension {analysis.dim}{values}{eps_text}{formulas}"


def analysis_head(analysis: Analysis) -> str:
    """Return the beginning of the report: title, equations, and explanations of the words for verdicts."""
    return f"analyze: {analysis_title(analysis)}\n{analysis.file.map}\n{STATUS_LEGEND}"


@text_form.register
def analysis_text(analysis: Analysis) -> str:
    """Return the complete report on an analysis as text."""
    lines = [analysis_head(analysis)]
    for title, statements in analysis.sections:
        lines += ["", title, *(f"{line.status}\t{line.text}" for line in statements)]
    return "\n".join(
        [*lines, "", "verdict", f"{analysis.conclusion.kind}\t{analysis.conclusion.sentence}", analysis.work]
    )


@html_form.register
def analysis_html(analysis: Analysis) -> str:
    """Return the verdict of an analysis and then its statements, as HTML."""
    conclusion = analysis.conclusion
    statements = [(title, line) for title, lines in analysis.sections for line in lines]
    rows = [(_html(title), markup.verdict(line.status), _html(line.text)) for title, line in statements[:_MAX_ROWS]]
    ellipsis = f"<p>… and {len(statements) - _MAX_ROWS} more statements</p>" if len(statements) > _MAX_ROWS else ""
    pieces = [
        f"<p>{map_html(analysis.file.map)}</p>",
        f"<p><strong>{_html(conclusion.kind)}</strong>: {_html(conclusion.sentence, 800)}</p>",
        markup.folded_table(rows, ["", "known how", ""]) + ellipsis,
    ]
    subtitle = ", ".join(filter(None, (f"dimension {analysis.dim}", eps_sentence(analysis.eps, analysis.file.map))))
    return markup.block(markup.abbreviate(analysis.file.name), "\n".join(pieces), subtitle)


# -- preserved structures


@lines_of.register
def _integrals(search: IntegralSearch) -> Iterator[Line]:
    """Yield each integral with its verdict and evidence, and then the remarks on the search."""
    return _formulas([(integral.name, integral, "") for integral in search.integrals], (search.note, search.reason))


@lines_of.register
def _densities(search: DensitySearch) -> Iterator[Line]:
    """Yield the densities shown with verdict and evidence, and then remarks: on others, or why there is none."""
    return _formulas([("phi", density, "") for density in search.shown], (search.further, search.note, search.reason))


@lines_of.register
def _tensors(search: PoissonSearch) -> Iterator[Line]:
    """Yield each Poisson tensor with its verdict and properties, and then the remarks on the search."""
    named_results = [(tensor.name, tensor, f"{tensor.statement}; ") for tensor in search.tensors]
    return _formulas(named_results, (search.note, search.reason))


def _formulas(named_results: Sequence[tuple[str, Any, str]], notes: Sequence[str]) -> Iterator[Line]:
    for name, result, properties in named_results:
        is_tensor = hasattr(result, "tensor")
        yield name, result.verdict, _brackets(result) if is_tensor else _formula(result.text, result.function, name)
        yield "", f"{properties}{result.evidence.summary}"
    yield from (("note", text) for text in notes if text)


def _brackets(tensor: Any) -> HtmlCell:
    brackets = islice(tensor.tensor.brackets.items(), _MAX_ROWS)
    return HtmlCell(
        tensor.text, lambda: "<br/>".join(formula(entry, f"{{{a},{b}}}", CHARACTERS) for (a, b), entry in brackets)
    )


@lines_of.register
def _darboux(search: DarbouxSearch) -> Iterator[Line]:
    """Yield the equation of Darboux polynomials, and each cofactor with its polynomials, or that there are none."""
    meaning = ", C a product of C[g] = g(x~, -eps)/g(x, eps)" if "C[" in "".join(search.cofactors) else ""
    equation = f"P(x~) = C P(x){meaning}; spaces spanned by products of others are omitted"
    yield ("P' = K P, irreducible; integrals left out" if search.flow else equation,)
    for space in search.spaces:
        yield (f"{'K' if search.flow else 'C'} = {space.cofactor}",)
        yield from (("", space.verdict, _polynomial(P)) for P in space.polynomials)
    if search.reason:
        yield "note", search.reason
    elif not search.spaces:
        yield (f"none of degree up to {search.degree}",)


@lines_of.register
def _structures(structures: ConstantStructures) -> Iterator[Line]:
    """Yield H, J and the Casimirs if f = J grad H with a constant matrix J, otherwise the reason why there is none."""
    if structures.hamiltonian is None:
        yield (f"not Hamiltonian with a constant J: {structures.reason}",)
        return
    yield "H", _polynomial(structures.hamiltonian.H)
    yield "J", structures.hamiltonian.J.tolist()
    yield from (("Casimir", _polynomial(casimir)) for casimir in structures.casimirs)


# -- growth and singularities


@lines_of.register
def _growth(growth: DegreeGrowth | Scan) -> Iterator[Line]:
    """Yield the lines of the text of a degree growth or of a scan."""
    return (line.split("\t") for line in growth.text.split("\n"))


@lines_of.register
def _heights(survey: HeightSurvey) -> Iterator[Line]:
    """Yield a line on the heights along each orbit, and then the conclusion from all orbits."""
    for orbit in survey.orbits:
        point = ",".join(format_number(entry) for entry in orbit.start)
        yield "orbit", *([f"eps {orbit.eps}"] if survey.has_eps else []), f"start {point}", orbit.growth.text
    yield "heights", survey.text


@lines_of.register
def _census(census: Census) -> Iterator[Line]:
    """Yield the counts of cycles and the lengths of the longest ones."""
    if not census.examined:
        yield "points", census.points
        yield "stopped", "time limit, before the images of all points were known"
        return
    yield "points", str(census.points) if census.complete else f"{census.points}, sampled {census.examined}"
    yield "indeterminate", census.indeterminate
    yield "pre-indeterminate", census.pre_indeterminate
    if census.complete:
        yield "preperiodic", census.preperiodic
    else:
        limit_text = ", stopped: time limit" if census.is_stopped else ""
        yield "open", f"{census.open} after {census.steps} steps{limit_text}"
    yield "periodic", census.periodic
    if census.cycles:
        yield "cycles", f"{census.cycles}, longest {census.longest}"
    longest = list(census.lengths.items())[-_MAX_CYCLE_LENGTHS:]
    if longest:
        label = "length x cycles" if census.complete else "length x points"
        ellipsis = "... " if len(census.lengths) > len(longest) else ""
        yield label, ellipsis + " ".join(f"{length}x{n}" for length, n in longest)


@lines_of.register
def _singularities(run: SingularityRun) -> Iterator[Line]:
    """Yield the denominator of the map, and each exceptional hypersurface with its singularity pattern or outcome."""
    yield (f"# map of degree {run.map_degree}, {run.text}",)
    if run.word is not None:
        yield (f"# {run.word.text}",)
    yield "denominator", run.denominator
    for hypersurface in run.hypersurfaces:
        kind = f"degree {hypersurface.degree}" + (
            ", factor of the denominator" if hypersurface.divides_denominator else ""
        )
        kind += " in all" if hypersurface.polynomial == "?" else ""
        kind += "" if hypersurface.stage is None else f", of map {hypersurface.stage + 1}"
        outcome = hypersurface.status + (f": {hypersurface.note}" if hypersurface.note else "")
        if hypersurface.status in ("confined", "not confined"):
            end = f"confined after {hypersurface.confined_at} steps"
            if hypersurface.status == "not confined":
                end = f"not confined within {hypersurface.followed} steps"
            outcome = f"contracted by step {hypersurface.contracted_at}, {end}"
        yield hypersurface.polynomial, kind, outcome
        if hypersurface.steps:
            ranks = " ".join(str(step.rank) for step in hypersurface.steps)
            poles = " ".join("?" if step.pole is None else str(step.pole) for step in hypersurface.steps)
            yield f"  ranks {ranks}", f"pole orders {poles}"


# -- symmetries


@lines_of.register
def _symmetries(symmetries: Symmetries) -> Iterator[Line]:
    """Yield one-parameter groups, a flow that rescales eps, generators of the finite group, and completed searches."""
    for generator in symmetries.infinitesimal:
        kind = "linear" if generator.is_linear else "affine"
        yield "one-parameter group", f"{kind}, the flow of ({', '.join(generator.rhs)})"
    if symmetries.scaling is not None:
        rhs = ", ".join(symmetries.scaling.rhs)
        yield "scaling", f"the flow of ({rhs}) by t takes the map at eps to that at e^-t eps"
    if symmetries.order is not None:
        yield "group", symmetries.group_text or "only the identity"
    elements = [("generator", t) for t in symmetries.generators]
    elements += [("further", t) for t in symmetries.others if symmetries.group_of != MATRICES]
    for name, t in elements:
        yield name, f"{t.kind} {t.text}", *["trivial"] * t.is_trivial
    yield from (("searched", sentence) for sentence in symmetries.searched)
    ending = "complete: every search was completed"
    yield (f"# {ending if symmetries.complete else f'undecided: {symmetries.undecided[0]}'}",)


@lines_of.register
def _commuting(systems: CommutingSystems) -> Iterator[Line]:
    """Yield, as options of a command, the fields g whose Kahan maps commute with that of f, except 0, f and -f."""
    if systems.dimension is not None:
        yield "bracket", f"the g with [f, g] = 0 have dimension {systems.dimension}"
    if systems.every_g_commutes:
        yield "proved", "f = 0 and its map is x -> x: every g commutes"
    shown_systems: list[QuadraticSystem] = []
    for g in systems.nontrivial:
        if g.system.scaled(-1) not in shown_systems:
            shown_systems.append(g.system)
            yield g.finding.verdict, "g and -g", _as_options(g, systems.root)
            yield "", g.finding.evidence.summary
    for family in systems.families:
        letters = [f"t{k + 1}" for k in range(len(family.directions))]
        base = "" if family.base.trivial == "0" else "base + "
        total = " + ".join(f"{t}*g{k + 1}" for k, t in enumerate(letters))
        yield family.finding.verdict, "family", f"g = {base}{total} for all {', '.join(letters)}"
        pairs = [("base", family.base)] * bool(base) + [(f"g{k + 1}", g) for k, g in enumerate(family.directions)]
        yield from (("", name, _as_options(g, systems.root)) for name, g in pairs)
        yield "", family.finding.evidence.summary
    if systems.irrational:
        yield "note", f"more solutions, not rational: {'; '.join(systems.irrational)}"
    if systems.note:
        yield "note", systems.note
    if systems.discarded:
        yield "note", f"{systems.discarded} solutions of the equations up to eps^{systems.order} do not commute"
    if systems.every_g_commutes:
        yield ("# complete: every g commutes",)
    elif systems.complete:
        has_others = bool(shown_systems or systems.families or systems.irrational)
        exceptions = "these, 0, f and -f" if has_others else "0, f and -f"
        yield (f"# complete: among the {systems.kind_text} only {exceptions} commute with f",)
    else:
        yield (f"# undecided: there may be more; {systems.undecided[0]}",)


def _as_options(g: CommutingField, root: str) -> HtmlCell:
    """Return g as options of a command, and the matrix B if g = B f; a notebook shows the equations of g instead."""
    texts = [f"--rhs='{text}'" for text in g.rhs]
    text = f"--vars {','.join(g.system.variables)} {' '.join(texts)}"
    if root:
        text = f"{text} -p '{g.system.symbols[0]}={root}'"
    if g.B is not None:
        rows = [", ".join(map(str, row)) for row in g.B.tolist()]
        text += f"\n\tB = [{', '.join(f'[{row}]' for row in rows)}]"
    return HtmlCell(text, lambda: equations_html(g.system, CHARACTERS // 4))


# -- titles


def _title(subject: str, result: Any, *subtitle: str) -> tuple[str, str]:
    """Return (title, subtitle) of a result: the title names the system, and the subtitle ends with eps."""
    phrases = (*subtitle, eps_sentence(result.eps, result.file.map))
    return f"{subject} of {markup.abbreviate(result.file.name)}", "; ".join(filter(None, phrases))


# Result type -> function that returns title and subtitle, for the results that are displayed as lines.
_TITLES: dict[type, Callable[[Any], tuple[str, str]]] = {
    IntegralSearch: lambda result: _title("integrals", result, f"{result.formula_count} found; {result.count_text}"),
    DensitySearch: lambda result: _title("densities", result, "dx/phi is invariant"),
    PoissonSearch: lambda result: _title("Poisson tensors", result),
    DarbouxSearch: lambda result: _title("Darboux polynomials", result, f"by cofactor, up to degree {result.degree}"),
    ConstantStructures: lambda result: (
        "Hamiltonian with a constant J" if result.hamiltonian else "not Hamiltonian with a constant J",
        "proved" if result.proved or result.hamiltonian else "undecided",
    ),
    DegreeGrowth: lambda result: ("degrees of the iterates", f"measured, {eps_sentence(result.eps)}"),
    Scan: lambda result: _title("scan", result, f"over {', '.join(result.over)}"),
    HeightSurvey: lambda result: ("heights of exact orbits", "the time step is 2 eps" if result.has_eps else ""),
    Census: lambda result: (f"cycles on P^{result.dim} over GF({result.prime})", eps_sentence(result.eps)),
    SingularityRun: lambda result: (f"singularities: {result.text}", eps_sentence(result.eps)),
    Symmetries: lambda result: ("affine symmetries of the map", "proved, for every eps"),
    CommutingSystems: lambda result: ("systems x' = g(x) whose Kahan maps commute", f"{result.shape} g, every eps"),
}
for _kind in _TITLES:
    text_form.register(_kind, result_text)
    html_form.register(_kind, result_html)
