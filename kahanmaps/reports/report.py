"""HTML pages of results: formulas, verdicts, pictures, and the command that reproduces them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from kahanmaps.algebra.parsing import parse_polynomial, parse_rational_function
from kahanmaps.algebra.printing import format_number, format_polynomial
from kahanmaps.atomic_files import write_atomically
from kahanmaps.checks.claims import Report, combined
from kahanmaps.display import checks, markup
from kahanmaps.display.laboratory import eps_sentence, result_html
from kahanmaps.display.latex import formula, latex_polynomial, latex_rational_function, typeset
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError, KahanmapsError, counted
from kahanmaps.family.system_normal_form import SystemNormalForm
from kahanmaps.laboratory.analysis import Analysis, analyze
from kahanmaps.maps.kahan import SystemLike
from kahanmaps.plots.growth import plot_degrees, plot_heights
from kahanmaps.reports.explore import explore_sections
from kahanmaps.reports.page import CHARACTERS, Html, PageSection, page, page_template, system_section, text, wide
from kahanmaps.reports.pictures import Pictures
from kahanmaps.sources import source

if TYPE_CHECKING:
    from kahanmaps.checks.claims import Finding
    from kahanmaps.laboratory.preserve.hirota_kimura import SparseRelation

# The limits are large enough for complete witnesses, which a reader can then check.
_LIMITS = checks.DisplayLimits(CHARACTERS, CHARACTERS, CHARACTERS, 100)
_MAX_RELATION = 4_000  # maximal number of characters of a relation that is typeset as a formula
_PAPER = "petrera-suris-2016"
_LEGEND = (
    "Proved: exactly, for every eps or the one that is named. Supported: held at random points over GF(p), with a "
    "bound for the error, or along an orbit. Refuted: there is a witness. A control, and a misprint as it is printed, "
    "are expected to be refuted, and do not count. Each line unfolds to its evidence."
)


def report_html(
    results: Analysis | Report | Sequence[Report],
    *,
    file: SystemFile | None = None,
    title: str | None = None,
    pictures: bool = True,
    command: str = "",
    left_out: Sequence[str] = (),
    explore: bool = False,
    certificate: str = "",
) -> str:
    """Return an HTML page with results; it needs no network, and JavaScript only if `explore` is true.

    Args:
        results: an `Analysis`, the `Report` of `verify` or of a check, or several reports on checks of one system.
        file: the system of the reports, whose equations and pictures are shown; an Analysis contains its system.
        title: the title of the page (default: the name of the system).
        pictures: whether to draw pictures; if matplotlib is missing, a note says how to install it.
        command: the command line that creates the page; it is printed on the page.
        left_out: sentences on results that were omitted, printed as notes.
        certificate: the path, relative to the page, of a file that `certificate` wrote; the page links to it.
        explore: for an Analysis: show an orbit with sliders for eps and the initial point instead of the results.

    Returns:
        The text of the page, which depends only on the input and the versions of the libraries. Formulas are exact;
        those of more than about 6000 characters are truncated, with a note.

    Raises:
        InputError: for results of another type, for no reports, and if the packages of the extra [report] are missing.

    >>> from kahanmaps.checks.conserve import check_integrals
    >>> from kahanmaps.documents.catalog import load
    >>> top = load("euler_top")
    >>> text = report_html(check_integrals(top), file=top, pictures=False)
    >>> text[:15], text.count("</details>")
    ('<!DOCTYPE html>', 3)
    """
    page_template()  # raises InputError for a missing package before pictures are drawn
    page_pictures = Pictures(pictures and not explore)
    script, seed = "", None
    if isinstance(results, Analysis):
        file, seed = results.file, results.seed
        lead_parts = (file.name, f"dimension {results.dim}", eps_sentence(results.eps, file.map))
        lead = ", ".join(filter(None, lead_parts))
        default_title = _title(file)
        if explore:
            sections = explore_sections(results)
            script = (resources.files("kahanmaps.reports") / "explore.js").read_text(encoding="utf-8")
        else:
            lead += f"; formulas for every {', '.join(results.symbols)}" if results.symbols else ""
            sections = [*_analysis_sections(results, page_pictures), PageSection("notes", "Notes", items=left_out)]
    elif explore:
        raise InputError(f"found {type(results).__name__}, expected an Analysis: only its page has sliders")
    else:
        reports = list(results) if isinstance(results, Sequence) else [results]
        if not reports or not all(isinstance(report, Report) for report in reports):
            kinds = ", ".join(sorted({type(report).__name__ for report in reports})) or "nothing"
            raise InputError(f"found {kinds}, expected an Analysis, a Report or several of them")
        first_report = reports[0]
        lead = ", ".join(filter(None, (checks.systems_sentence(first_report), checks.eps_sentence(first_report))))
        name = str(first_report.context.get("system", "")) if file is None else _title(file)
        heading = "The paper, statement by statement" if first_report.check == "verify" else "Checks"
        default_title, seed = f"{heading}: {name}", first_report.context.get("seed")
        sections = _claims_sections(reports, file, left_out, page_pictures)
    if page_pictures.note:
        sections.append(PageSection("pictures", "Pictures", paragraphs=[page_pictures.note]))
    if certificate:
        link = f'<a href="{text(quote(certificate))}">{text(certificate)}</a>'
        sentence = Html(f"Proofs that another program (Coq, PARI/GP or SymPy) checks: {link}")
        sections.append(PageSection("certificate", "Certificate", paragraphs=[sentence]))
    title = (title or "").strip() or default_title
    return page(title, lead, sections, command=command, seed=seed, file=file, script=script)


def report(
    system: SystemLike | Analysis | Report | Sequence[Report],
    path: str | Path | None = None,
    *,
    eps: Any = None,
    time_step: Any = None,
    h: Any = None,
    effort: int = 1,
    seed: int = 0,
    title: str | None = None,
    pictures: bool = True,
    explore: bool = False,
) -> str:
    """Return the HTML page about a system or about results; write it to `path` if a path is given.

    Args:
        system: a system, which is analyzed with `eps` (or `time_step`, `h`), `effort` and `seed` as `analyze` does, or
            results that `report_html` accepts.
        path: the path of the HTML file, which is replaced atomically.
        title, pictures, explore: see `report_html`.

    Returns:
        The text of the page. Raises InputError as `analyze` and `report_html` do.
    """
    results: Any = system
    if not isinstance(results, Analysis | Report | list | tuple):
        results = analyze(results, eps=eps, time_step=time_step, h=h, effort=effort, seed=seed)
    html = report_html(results, title=title, pictures=pictures, explore=explore)
    if path is not None:
        write_atomically(str(path), html.encode())
    return html


def write_report(path: str | Path, results: Any, **options: Any) -> None:
    """Write the page of `report_html` atomically to a file; `options` are further arguments of `report_html`."""
    write_atomically(Path(path), report_html(results, **options).encode())


def _title(file: SystemFile) -> str:
    """Return the title of a catalogue file, or the label of any other file (its name, or short equations)."""
    return str(file.catalog.get("title", "")) or file.label


# -- the page of an analysis: the verdict, then the results with their certainty


def _analysis_sections(analysis: Analysis, pictures: Pictures) -> list[PageSection]:
    file, conclusion = analysis.file, analysis.conclusion
    arguments = " in x and eps" if file.map.has_eps else ""
    explanation = (
        f"Proved and supported: formulas, as identities{arguments}. Measured: modulo primes and along orbits, "
        "which is evidence. The number of integrals and the growth are separate findings."
    )
    heading = Html(f"<strong>{text(conclusion.kind)}</strong>"), conclusion.sentence
    sections = [
        PageSection("verdict", "Verdict", heading, [explanation]),
        system_section(file),
        _catalogue_section(file),
    ]
    formulas = formulas_of(analysis)
    growth, survey, label = analysis.degrees, analysis.heights, file.label
    for name, lines in analysis.sections:
        statements = [(Html(markup.verdict(line.status)), formulas.get(line.text, line.text)) for line in lines]
        # Pictures and folded tables, which follow the statements of a section.
        figures: list[str] = []
        folded: list[tuple[str, Html]] = []
        for run in analysis.singularities if name == "singularities" else ():
            at_eps = f" at eps = {format_number(run.eps)}" if file.map.has_eps else ""
            folded.append((f"Hypersurfaces{at_eps}", wide(result_html(run, file.map))))
        if name == "growth" and growth is not None:
            first_degrees = ", ".join(map(str, growth.degrees[:8]))
            alt = f"Degrees of the iterates against their number, from {first_degrees}: {growth.growth_text}"
            caption = "Degrees of the iterates"
            caption += " and the recurrence that they satisfy." if growth.recurrence is not None else "."
            figures.append(pictures.draw("degrees", caption, alt, partial(plot_degrees, {label: growth})))
            rows = [(str(n), str(d)) for n, d in enumerate(growth.degrees)]
            folded.append(("Degrees as a table", wide(markup.table(["n", "degree of the n-th iterate"], rows))))
        if name == "growth" and survey is not None and survey.orbits:
            alt = f"Heights of exact orbits in bits against the step: {survey.text}"
            caption = "Heights of exact orbits, and the growth that was fitted."
            figures.append(pictures.draw("heights", caption, alt, partial(plot_heights, survey)))
            folded.append(("Orbits whose heights were measured", wide(result_html(survey))))
        pieces = [Html(figure) for figure in figures if figure]
        title = name[0].upper() + name[1:]
        section = PageSection(name.replace(" ", "-"), title, statements=statements, pieces=pieces, folded=folded)
        sections.append(section)
    is_member = isinstance(file.normal_form, SystemNormalForm)  # in the coordinates of the system
    picture = (pictures.invariant_curves if is_member else pictures.portrait)(file, analysis.eps)
    return [*sections, PageSection("orbits", "Orbits", pieces=[Html(picture)] if picture else [])]


def _catalogue_section(file: SystemFile) -> PageSection:
    claims = [
        formula(function, name or "I", CHARACTERS)
        for name, function in {**file.integrals, **file.integrals_in_iterates}.items()
    ]
    if file.density is not None:
        claims.append(formula(file.density, "phi", CHARACTERS))
    convention = file.catalog.get("convention", "")
    facts = file.catalog.get("facts", [])
    sources = markup.bullet_list(text(source(key)) for key in file.catalog.get("sources", []))
    pieces = [Html(f"<h3>Sources</h3>\n{sources}")] if file.catalog.get("sources") else []
    title = f"What {'the catalogue' if file.catalog else 'the file'} says"
    if not (facts or claims or convention or pieces):
        return PageSection("known", title)
    remark = Html(
        '<span class="soft">The analysis below has not read this: it was given the right-hand sides only.</span>'
    )
    return PageSection(
        "known",
        title,
        paragraphs=[remark, *[f"Step: {convention}"] * bool(convention)],
        items=facts,
        pieces=pieces,
        folded=[(f"Its claims: {counted(len(claims), 'formula')}", Html(markup.bullet_list(claims)))] if claims else [],
    )


def formulas_of(analysis: Analysis) -> dict[str, Html]:
    """Return a dict from those statements in `analysis.sections` that are formulas to their HTML."""
    html_by_text: dict[str, str] = {}

    def evidence(statement: Any) -> str:
        text_of_evidence = checks.reason(statement.evidence, _LIMITS)
        return f"<details><summary>evidence</summary>{text_of_evidence}</details>"

    for integral in analysis.integrals.integrals if analysis.integrals is not None else ():
        html = formula(integral.function, integral.name, CHARACTERS)
        origin_and_evidence = f'<span class="soft">{text(integral.origin)}</span>\n{evidence(integral)}'
        html_by_text[f"{integral.name} = {integral.text}  [{integral.origin}]"] = f"{html}<br/>{origin_and_evidence}"
    for relation in analysis.relations:
        if html := _relation_html(relation, (*relation.names, *analysis.file.variables, "eps")):
            html_by_text[f"along orbits {relation.text}"] = f"along orbits {html}"
    for density in analysis.densities.densities if analysis.densities is not None else ():
        html = formula(density.function, "phi", CHARACTERS)
        html_by_text[f"dx/phi is invariant, phi = {density.text}"] = f"dx/ϕ is invariant, {html}\n{evidence(density)}"
    if (
        analysis.degrees is not None
        and analysis.degrees.recurrence is not None
        and analysis.degrees.recurrence.closed_form
    ):
        closed = analysis.degrees.recurrence.closed_form
        with suppress(KahanmapsError):  # raised unless the closed form is a polynomial in n
            html_by_text[f"d_n = {closed}"] = typeset(f"d_n = {latex_polynomial(parse_polynomial(closed, ['n']))}")
    if analysis.hamiltonian is not None and analysis.hamiltonian.hamiltonian is not None:
        hamiltonian = analysis.hamiltonian.hamiltonian
        kind = "the standard J" if hamiltonian.is_standard else "a constant skew J"
        html = f"Hamiltonian with {kind}, {formula(hamiltonian.H, 'H', CHARACTERS)}"
        html_by_text[f"Hamiltonian with {kind}, H = {format_polynomial(hamiltonian.H)}"] = html
    for field in analysis.commuting.nontrivial if analysis.commuting is not None else ():
        equations = "<br/>\n".join(formula(g, f"g{k}", CHARACTERS) for k, g in enumerate(field.system.rhs, start=1))
        statement = "commutes with the Kahan maps of g and -g"
        html_by_text[f"{statement}, g = ({', '.join(field.rhs)})"] = f"{statement},<br/>\n{equations}"
    return {text: Html(html) for text, html in html_by_text.items()}


def _relation_html(relation: SparseRelation, names: tuple[str, ...]) -> str:
    """Return the relation P = 0 as HTML with the terms in the order of its text; "" if it is unparsable or too long."""
    if len(relation.text) > _MAX_RELATION:
        return ""
    text = ""
    for monomial, coefficient in relation.terms:
        try:
            term = latex_rational_function(
                parse_rational_function(f"{coefficient.removeprefix('-')}*{monomial}", names)
            )
        except KahanmapsError:
            return ""
        is_negative = coefficient.startswith("-")
        text += f" {'-' if is_negative else '+'} {term}" if text else f"{'-' * is_negative}{term}"
    return typeset(f"{text} = 0")


# -- the page of claims: of the paper, by section, or of checks of one system


def _claims_sections(
    reports: Sequence[Report], file: SystemFile | None, left_out: Sequence[str], pictures: Pictures
) -> list[PageSection]:
    first_report = reports[0]
    is_paper = len(reports) == 1 and first_report.check == "verify"
    if is_paper:
        groups = [
            (f"section-{findings[0].place.get('section', 'none')}", name or "Together", findings)
            for name, findings in checks.sections_of(first_report.findings).items()
        ]
    else:
        groups = [(f"check-{_slug(r.check)}", f"Check: {r.check}", list(r.findings)) for r in reports]
    rows = [
        (f'<a href="#{section_id}">{text(name)}</a>', text(checks.verdict_counts(findings)))
        for section_id, name, findings in groups
    ]
    verdict = Html(markup.verdict(combined(report.verdict for report in reports)))
    counts = checks.verdict_counts([finding for report in reports for finding in report.findings])
    table = wide(markup.table(["part", "claims"], rows))
    sections = [PageSection("verdict", "Verdict", (verdict, counts), [_LEGEND], pieces=[table])]
    if file is not None:
        eps = first_report.context.get("eps")
        draw = pictures.portrait if file.member is None else pictures.invariant_curves
        picture = draw(file, None if eps in (None, "every") else str(eps))
        sections += [system_section(file), PageSection("orbits", "Orbits", pieces=[Html(picture)] if picture else [])]
    ids: Counter[str] = Counter()
    for section_id, name, findings in groups:
        sections.append(PageSection(section_id, name, claims=[_claim_data(finding, ids) for finding in findings]))
    notes = [note for report in reports for note in (checks.ending_sentence(report), *report.notes)]
    sections.append(PageSection("notes", "Notes", items=[note for note in (*notes, *left_out) if note]))
    paper = [source(_PAPER)] if first_report.check == "verify" else []
    return [*sections, PageSection("sources", "Source", paragraphs=paper)]


def _claim_data(finding: Finding, ids: Counter[str]) -> dict[str, Any]:
    """Return the data of a claim: a line that unfolds to its evidence, open if the claim is refuted and no control.

    `ids` counts how often a key occurs on the page, so that ids are unique: a claim and its controls share a key.
    """
    name = ""
    if key := finding.place.get("key"):
        name = f"claim-{_slug(str(key))}"
        ids[name] += 1
        name = name if ids[name] == 1 else f"{name}-{ids[name]}"
    location = finding.place.get("place")
    return {
        "id": name,
        "is_open": str(finding.verdict) == "refuted" and not finding.control,
        "verdict": Html(checks.verdict_html(finding)),
        "place": location,
        "words": finding.claim.removeprefix(f"{location}: "),
        "rows": [(label, Html(html)) for label, html in checks.evidence_rows(finding, _LIMITS)],
    }


def _slug(words: str) -> str:
    return re.sub("[^A-Za-z0-9]+", "-", words).strip("-") or "x"
