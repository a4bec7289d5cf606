"""The page about one system: the verdict first, then what was found, each with how it is known."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kahanmaps.algebra.written.text import format_number
from kahanmaps.display import markup
from kahanmaps.display.laboratory import eps_sentence, result_html
from kahanmaps.display.mathml import formula
from kahanmaps.display.systems import equations_html
from kahanmaps.errors import counted
from kahanmaps.family.system_normal_form import SystemNormalForm
from kahanmaps.plots.growth import draw_degrees, draw_heights
from kahanmaps.reports.page import CHARACTERS, Section, page, statements, text, wide
from kahanmaps.reports.pictures import Pictures
from kahanmaps.reports.portraits import invariant_curves_figure, portrait_figure
from kahanmaps.reports.statement_formulas import formulas_of
from kahanmaps.sources import source

if TYPE_CHECKING:
    from kahanmaps.documents.files import SystemFile
    from kahanmaps.laboratory.analysis import Analysis
    from kahanmaps.plots.recipe import Recipe

_EQUATIONS = 40


def analysis_page(found: Analysis, title: str, recipe: Recipe, pictures: Pictures) -> str:
    """The page about what `analyze` found."""
    words = (found.file.name, f"dimension {found.dim}", eps_sentence(found.eps, found.file.map))
    lead = text(", ".join(filter(None, words)))
    if found.symbols:
        lead += f"; formulas for every {text(', '.join(found.symbols))}"
    is_member = isinstance(found.file.normal_form, SystemNormalForm)  # in the coordinates that the picture is made in
    orbits = invariant_curves_figure if is_member else portrait_figure
    sections = [
        _verdict(found),
        Section("system", "The system", system_html(found.file)),
        *_catalogue(found.file),
        *(_statements(found, name, pictures) for name, _ in found.sections),
        Section("orbits", "Orbits", orbits(found.file, found.eps, pictures)),
    ]
    return page(title, lead, sections, pictures, recipe, found.seed)


def _verdict(found: Analysis) -> Section:
    final = found.conclusion
    of = " in x and eps" if found.file.map.has_eps else ""
    words = (
        f"<p>Proved and supported: formulas, as identities{of}. Measured: modulo primes and along orbits, "
        "which is evidence. The number of integrals and the growth are separate findings.</p>"
    )
    sentence = f'<p class="conclusion"><strong>{text(final.kind)}</strong><br/>{text(final.sentence)}</p>'
    return Section("verdict", "Verdict", f"{sentence}\n{words}")


def system_html(file: SystemFile) -> str:
    """Equations, parameters, the Hamiltonian and claims of a system."""
    if file.is_quadratic:
        pieces = [f"<p>{equations_html(file.system, CHARACTERS, _EQUATIONS)}</p>"]
    else:
        pieces = [f"<pre>{markup.escape(markup.shortened(str(file.map), CHARACTERS))}</pre>"]
    if file.parameters:
        values = ", ".join(f"{name} = {format_number(value)}" for name, value in file.parameters.items())
        pieces.append(f"<p>with {text(values)}</p>")
    if file.hamiltonian is not None:
        kind = "the standard J" if file.hamiltonian.is_standard else "a constant J of the file"
        pieces.append(f"<p>x' = J grad H(x) with {kind}, {formula(file.hamiltonian.H, 'H', CHARACTERS)}</p>")
    return "\n".join(pieces)


def _catalogue(file: SystemFile) -> list[Section]:
    """What the catalogue says of the system; empty for others."""
    facts = [text(fact) for fact in file.catalog.get("facts", [])]
    every = {**file.integrals, **file.integrals_in_iterates}
    claims = [formula(function, name or "I", CHARACTERS) for name, function in every.items()]
    if file.density is not None:
        claims.append(formula(file.density, "phi", CHARACTERS))
    sources = [text(source(key)) for key in file.catalog.get("sources", [])]
    convention = text(file.catalog.get("convention", ""))
    pieces = [markup.listed(facts)] if facts else []
    pieces += (
        [markup.details(f"Its claims: {counted(len(claims), 'formula')}", markup.listed(claims))] if claims else []
    )
    pieces += [f"<p>Step: {convention}</p>"] if convention else []
    pieces += [f"<h3>Sources</h3>\n{markup.listed(sources)}"] if sources else []
    if not pieces:
        return []
    where = "the catalogue" if file.catalog else "the file"
    first = '<p class="soft">The analysis below has not read this: it was given the right-hand sides only.</p>'
    return [Section("known", f"What {where} says", "\n".join([first, *pieces]))]


def _statements(found: Analysis, name: str, pictures: Pictures) -> Section:
    formulas = formulas_of(found)
    lines = [
        (markup.verdict(line.status), formulas.get(line.text) or text(line.text)) for line in dict(found.sections)[name]
    ]
    title = name[0].upper() + name[1:]
    return Section(name.replace(" ", "-"), title, "\n".join([statements(lines), *_more(found, name, pictures)]))


def _more(found: Analysis, name: str, pictures: Pictures) -> list[str]:
    """Pictures and tables below the statements of a section."""
    if name == "growth":
        return [piece for piece in (*_degrees(found, pictures), *_heights(found, pictures)) if piece]
    if name == "singularities":
        return [
            markup.details(
                f"Hypersurfaces{f' at eps = {format_number(run.eps)}' if found.file.map.has_eps else ''}",
                wide(result_html(run, found.file.map)),
            )
            for run in found.singularities
        ]
    return []


def _degrees(found: Analysis, pictures: Pictures) -> list[str]:
    growth = found.degrees
    if growth is None:
        return []

    first = ", ".join(map(str, growth.degrees[:8]))
    alt = f"Degrees of the iterates against their number, from {first}: {growth.growth_text}"
    caption = (
        "Degrees of the iterates" + " and the recurrence that they satisfy" * (growth.recurrence is not None) + "."
    )
    rows = [(str(n), str(d)) for n, d in enumerate(growth.degrees)]
    return [
        pictures.draw("degrees", caption, alt, lambda style: draw_degrees({found.file.label: growth}, style)),
        markup.details("Degrees as a table", wide(markup.table(["n", "degree of the n-th iterate"], rows))),
    ]


def _heights(found: Analysis, pictures: Pictures) -> list[str]:
    survey = found.heights
    if survey is None or not survey.orbits:
        return []

    alt = f"Heights of exact orbits in bits against the step: {survey.text}"
    caption = "Heights of exact orbits, and the growth that was fitted."
    return [
        pictures.draw("heights", caption, alt, lambda style: draw_heights(survey, style)),
        markup.details("Orbits whose heights were measured", wide(result_html(survey))),
    ]
