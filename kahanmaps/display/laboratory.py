"""The display of results of the laboratory: the lines that commands and `print` show, and a table in notebooks.

`lines_of` gives the lines of a result, as cells. `print` separates cells by tabs; a notebook shows them as a table of
bounded size, with typeset formulas and marked verdicts. Nothing is computed again.
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
from kahanmaps.display.latex import formula
from kahanmaps.display.systems import CHARACTERS, equations_html, map_html
from kahanmaps.display_protocols import html_form, text_form
from kahanmaps.laboratory.analysis import Analysis
from kahanmaps.laboratory.cycles import Census
from kahanmaps.laboratory.growth.degrees import DegreeGrowth
from kahanmaps.laboratory.growth.height_survey import HeightSurvey
from kahanmaps.laboratory.preserve.darboux.darboux_polynomials import DarbouxSearch
from kahanmaps.laboratory.preserve.densities import DensitySearch
from kahanmaps.laboratory.preserve.integrals import IntegralSearch
from kahanmaps.laboratory.preserve.poisson.hamiltonian_structure import ConstantStructures
from kahanmaps.laboratory.preserve.poisson.poisson_tensors import PoissonSearch
from kahanmaps.laboratory.scan.result import Scan
from kahanmaps.laboratory.singular.singularities import SingularityRun
from kahanmaps.laboratory.symmetry.commuting import CommutingField, CommutingSystems
from kahanmaps.laboratory.symmetry.symmetries import MATRICES, Symmetries
from kahanmaps.maps.convention import eps_record, eps_suffix
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.systems.quadratic import QuadraticSystem

_ROWS = 60  # of a table in a notebook
_TEXT = 300
_LENGTHS_SHOWN = 12
WORDS = (
    "proved: an identity of rational functions, or a theorem; supported: true at random points; derived: follows "
    "exactly from the measured singularity patterns; measured: modulo primes or along orbits, which is evidence"
)


@dataclass(frozen=True)
class HtmlCell:
    """A cell that a notebook shows as `html()` instead of its text."""

    text: str
    html: Callable[[], str]

    def __str__(self) -> str:
        return self.text


Line = Sequence[object]  # cells: `HtmlCell`, or anything with a text by str()


def _formula(text: str, function: fmpq_mpoly | RationalFunction, name: str = "") -> HtmlCell:
    return HtmlCell(text, lambda: formula(function, name, CHARACTERS))


def _polynomial(polynomial: fmpq_mpoly, name: str = "") -> HtmlCell:
    return _formula(format_polynomial(polynomial), polynomial, name)


def eps_sentence(eps: fmpq | None, *maps: MapFamily) -> str:
    """The eps of a result, with the time step, as a phrase; empty for a map that does not depend on eps."""
    return markup.eps_phrase(eps_record(eps, *maps))


@singledispatch
def lines_of(result: object) -> Iterator[Line]:
    """The lines of a result, as its command prints them below the heading."""
    raise TypeError(f"no display is registered for {type(result).__name__}")


def result_text(result: object) -> str:
    """The lines of a result, with cells separated by tabs."""
    return "\n".join("\t".join(map(str, line)) for line in lines_of(result))


def result_html(result: Any, map_: MapFamily | None = None) -> str:
    """The lines of a result as a table; give `map_` where the result does not know its map."""

    def shown(cell: object) -> str:
        if isinstance(cell, HtmlCell):
            return cell.html()
        text = str(cell).strip().removeprefix("# ")
        return markup.verdict(text) if text in markup.WORDS else _text(text)

    rows = [[shown(cell) for cell in line] for line in islice(lines_of(result), _ROWS + 1)]
    more = "\n<p>… print shows all lines</p>" if len(rows) > _ROWS else ""
    title, subtitle = _TITLES[type(result)](result)
    if map_ is not None:
        subtitle = eps_sentence(result.eps, map_)
    return markup.titled(title, (markup.table((), rows[:_ROWS]) if rows else "<p>none</p>") + more, subtitle)


def _text(text: str, width: int = _TEXT) -> str:
    return markup.escape(markup.shortened(text, width))


# -- a whole analysis


def analysis_title(found: Analysis) -> str:
    """The title of a report: the system, its dimension and parameters, and eps."""
    step = eps_suffix(found.eps, found.file.map)
    values = "".join(f", {name} = {value}" for name, value in found.file.parameters.items())
    formulas = f"; formulas for every {', '.join(found.symbols)}" if found.symbols else ""
    return f"{found.file.name}, dimension {found.dim}{values}{step}{formulas}"


def analysis_head(found: Analysis) -> str:
    """The head of the report: the title, the equations, and the meaning of the words."""
    return f"analyze: {analysis_title(found)}\n{found.file.map}\n{WORDS}"


@text_form.register
def analysis_text(found: Analysis) -> str:
    """The whole report."""
    lines = [analysis_head(found)]
    for title, statements in found.sections:
        lines += ["", title, *(f"{line.status}\t{line.text}" for line in statements)]
    return "\n".join([*lines, "", "verdict", f"{found.conclusion.kind}\t{found.conclusion.sentence}", found.work])


@html_form.register
def analysis_html(found: Analysis) -> str:
    """The verdict first, then the statements."""
    final = found.conclusion
    statements = [(title, line) for title, lines in found.sections for line in lines]
    rows = [(_text(title), markup.verdict(line.status), _text(line.text)) for title, line in statements[:_ROWS]]
    more = f"<p>… and {len(statements) - _ROWS} more statements</p>" if len(statements) > _ROWS else ""
    inside = [
        f"<p>{map_html(found.file.map)}</p>",
        f"<p><strong>{_text(final.kind)}</strong>: {_text(final.sentence, 800)}</p>",
        markup.table(["", "known how", ""], rows) + more,
    ]
    beside = ", ".join(filter(None, (f"dimension {found.dim}", eps_sentence(found.eps, found.file.map))))
    return markup.titled(markup.shortened(found.file.name), "\n".join(inside), beside)


# -- what is preserved


@lines_of.register
def _integrals(found: IntegralSearch) -> Iterator[Line]:
    """Every formula with its verdict and evidence, then the reason why there are no more."""
    return _formulas([(one.name, one, "") for one in found.integrals], (found.note, found.reason))


@lines_of.register
def _densities(found: DensitySearch) -> Iterator[Line]:
    """The formula with its verdict and evidence, then further densities, or the reason why there is none."""
    return _formulas([("phi", one, "") for one in found.shown], (found.further, found.note, found.reason))


@lines_of.register
def _tensors(found: PoissonSearch) -> Iterator[Line]:
    """Every tensor with its verdict and properties, then the reason why there are no more."""
    named = [(one.name, one, f"{one.statement}; ") for one in found.tensors]
    return _formulas(named, (found.note, found.reason))


def _formulas(named: Sequence[tuple[str, Any, str]], notes: Sequence[str]) -> Iterator[Line]:
    for name, one, what in named:
        is_tensor = hasattr(one, "tensor")
        yield name, one.verdict, _brackets(one) if is_tensor else _formula(one.text, one.function, name)
        yield "", f"{what}{one.evidence.summary}"
    yield from (("note", text) for text in notes if text)


def _brackets(one: Any) -> HtmlCell:
    brackets = islice(one.tensor.brackets.items(), _ROWS)
    return HtmlCell(
        one.text, lambda: "<br/>".join(formula(entry, f"{{{a},{b}}}", CHARACTERS) for (a, b), entry in brackets)
    )


@lines_of.register
def _darboux(found: DarbouxSearch) -> Iterator[Line]:
    """The law, the polynomials by cofactor, or that there are none."""
    meaning = ", C a product of C[g] = g(x~, -eps)/g(x, eps)" if "C[" in "".join(found.cofactors) else ""
    law = f"P(x~) = C P(x){meaning}; spaces spanned by products left out"
    yield ("P' = K P, irreducible; integrals left out" if found.flow else law,)
    for space in found.spaces:
        yield (f"{'K' if found.flow else 'C'} = {space.cofactor}",)
        yield from (("", space.verdict, _polynomial(P)) for P in space.polynomials)
    if found.reason:
        yield "note", found.reason
    elif not found.spaces:
        yield (f"none of degree up to {found.degree}",)


@lines_of.register
def _structures(found: ConstantStructures) -> Iterator[Line]:
    """The Hamiltonian form, or why there is none."""
    if found.hamiltonian is None:
        yield (f"not Hamiltonian with a constant J: {found.reason}",)
        return
    yield "H", _polynomial(found.hamiltonian.H)
    yield "J", found.hamiltonian.J.tolist()
    yield from (("Casimir", _polynomial(casimir)) for casimir in found.casimirs)


# -- growth and singularities


@lines_of.register
def _growth(found: DegreeGrowth | Scan) -> Iterator[Line]:
    """The lines of its `text`."""
    return (line.split("\t") for line in found.text.split("\n"))


@lines_of.register
def _heights(found: HeightSurvey) -> Iterator[Line]:
    """A line for each orbit, and the conclusion from all of them."""
    for orbit in found.orbits:
        point = ",".join(format_number(entry) for entry in orbit.start)
        yield "orbit", *([f"eps {orbit.eps}"] if found.has_eps else []), f"start {point}", orbit.growth.text
    yield "heights", found.text


@lines_of.register
def _census(census: Census) -> Iterator[Line]:
    """The counts, and the longest cycles."""
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
        yield "open", f"{census.open} after {census.steps} steps" + (", stopped: time limit" if census.stopped else "")
    yield "periodic", census.periodic
    if census.cycles:
        yield "cycles", f"{census.cycles}, longest {census.longest}"
    shown = list(census.lengths.items())[-_LENGTHS_SHOWN:]
    if shown:
        what = "length x cycles" if census.complete else "length x points"
        more = "... " if len(census.lengths) > len(shown) else ""
        yield what, more + " ".join(f"{length}x{n}" for length, n in shown)


@lines_of.register
def _singularities(run: SingularityRun) -> Iterator[Line]:
    """The denominator, and each exceptional hypersurface with its outcome."""
    yield (f"# map of degree {run.map_degree}, {run.text}",)
    if run.word is not None:
        yield (f"# {run.word.text}",)
    yield "denominator", run.denominator
    for found in run.hypersurfaces:
        kind = f"degree {found.degree}" + (", factor of the denominator" if found.divides_denominator else "")
        kind += " in all" if found.polynomial == "?" else ""
        kind += "" if found.stage is None else f", of map {found.stage + 1}"
        outcome = found.status + (f": {found.note}" if found.note else "")
        if found.status in ("confined", "not confined"):
            end = f"confined after {found.confined_at} steps"
            if found.status == "not confined":
                end = f"not confined within {found.followed} steps"
            outcome = f"contracted by step {found.contracted_at}, {end}"
        yield found.polynomial, kind, outcome
        if found.steps:
            ranks = " ".join(str(step.rank) for step in found.steps)
            poles = " ".join("?" if step.pole is None else str(step.pole) for step in found.steps)
            yield f"  ranks {ranks}", f"pole orders {poles}"


# -- symmetries


@lines_of.register
def _symmetries(found: Symmetries) -> Iterator[Line]:
    """One-parameter groups, a scaling, the finite group by its generators, and the completed searches."""
    for x in found.infinitesimal:
        kind = "linear" if x.is_linear else "affine"
        yield "one-parameter group", f"{kind}, the flow of ({', '.join(x.rhs)})"
    if found.scaling is not None:
        rhs = ", ".join(found.scaling.rhs)
        yield "scaling", f"the flow of ({rhs}) by t takes the map at eps to that at e^-t eps"
    if found.order is not None:
        yield "group", found.group_text or "only the identity"
    elements = [("generator", t) for t in found.generators]
    elements += [("further", t) for t in found.others if found.group_of != MATRICES]
    for name, t in elements:
        yield name, f"{t.kind} {t.text}", *["trivial"] * t.is_trivial
    yield from (("searched", sentence) for sentence in found.searched)
    yield (f"# {'complete: every search was completed' if found.complete else f'undecided: {found.undecided[0]}'}",)


@lines_of.register
def _commuting(found: CommutingSystems) -> Iterator[Line]:
    """The g that commute, except 0, f and -f, each written as options of a command."""
    if found.dimension is not None:
        yield "bracket", f"the g with [f, g] = 0 have dimension {found.dimension}"
    if found.every_g_commutes:
        yield "proved", "f = 0 and its map is x -> x: every g commutes"
    listed: list[QuadraticSystem] = []
    for g in found.nontrivial:
        if g.system.scaled(-1) not in listed:
            listed.append(g.system)
            yield g.finding.verdict, "g and -g", _as_options(g, found.root)
            yield "", g.finding.evidence.summary
    for family in found.families:
        letters = [f"t{k + 1}" for k in range(len(family.directions))]
        base = "" if family.base.trivial == "0" else "base + "
        total = " + ".join(f"{t}*g{k + 1}" for k, t in enumerate(letters))
        yield family.finding.verdict, "family", f"g = {base}{total} for all {', '.join(letters)}"
        named = [("base", family.base)] * bool(base) + [(f"g{k + 1}", g) for k, g in enumerate(family.directions)]
        yield from (("", name, _as_options(g, found.root)) for name, g in named)
        yield "", family.finding.evidence.summary
    if found.irrational:
        yield "note", f"more solutions, not rational: {'; '.join(found.irrational)}"
    if found.note:
        yield "note", found.note
    if found.discarded:
        yield "note", f"{found.discarded} solutions of the equations up to eps^{found.order} do not commute"
    if found.every_g_commutes:
        yield ("# complete: every g commutes",)
    elif found.complete:
        has_others = bool(listed or found.families or found.irrational)
        which = "these, 0, f and -f" if has_others else "0, f and -f"
        yield (f"# complete: among the {found.kind_text} only {which} commute with f",)
    else:
        yield (f"# undecided: there may be more; {found.undecided[0]}",)


def _as_options(g: CommutingField, root: str) -> HtmlCell:
    """The system as options of a command, and B below it where g = B f; in a notebook its equations."""
    texts = [f"--rhs='{text}'" for text in g.rhs]
    text = f"--vars {','.join(g.system.variables)} {' '.join(texts)}"
    if root:
        text = f"{text} -p '{g.system.symbols[0]}={root}'"
    if g.B is not None:
        rows = [", ".join(map(str, row)) for row in g.B.tolist()]
        text += f"\n\tB = [{', '.join(f'[{row}]' for row in rows)}]"
    return HtmlCell(text, lambda: equations_html(g.system, CHARACTERS // 4))


# -- titles


def _about(what: str, found: Any, *subtitle: str) -> tuple[str, str]:
    """A title with the name of the system, and a subtitle that ends with eps."""
    words = (*subtitle, eps_sentence(found.eps, found.file.map))
    return f"{what} of {markup.shortened(found.file.name)}", "; ".join(filter(None, words))


# Titles and subtitles of the results that are displayed by their lines.
_TITLES: dict[type, Callable[[Any], tuple[str, str]]] = {
    IntegralSearch: lambda found: _about("integrals", found, f"{found.formula_count} found; {found.count_text}"),
    DensitySearch: lambda found: _about("densities", found, "dx/phi is invariant"),
    PoissonSearch: lambda found: _about("Poisson tensors", found),
    DarbouxSearch: lambda found: _about("Darboux polynomials", found, f"by cofactor, up to degree {found.degree}"),
    ConstantStructures: lambda found: (
        "Hamiltonian with a constant J" if found.hamiltonian else "not Hamiltonian with a constant J",
        "proved" if found.proved or found.hamiltonian else "undecided",
    ),
    DegreeGrowth: lambda found: ("degrees of the iterates", f"measured, {eps_sentence(found.eps)}"),
    Scan: lambda found: _about("scan", found, f"over {', '.join(found.over)}"),
    HeightSurvey: lambda found: ("heights of exact orbits", "the time step is 2 eps" if found.has_eps else ""),
    Census: lambda found: (f"cycles on P^{found.dim} over GF({found.prime})", eps_sentence(found.eps)),
    SingularityRun: lambda found: (f"singularities: {found.text}", eps_sentence(found.eps)),
    Symmetries: lambda found: ("affine symmetries of the map", "proved, for every eps"),
    CommutingSystems: lambda found: ("systems x' = g(x) whose Kahan maps commute", f"{found.shape} g, every eps"),
}
for _kind in _TITLES:
    text_form.register(_kind, result_text)
    html_form.register(_kind, result_html)
