"""What was found as one HTML page: formulas, verdicts, pictures, and how to do it again."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

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
from kahanmaps.laboratory.analysis import Analysis
from kahanmaps.plots.growth import plot_degrees, plot_heights
from kahanmaps.reports.explore import explore_sections
from kahanmaps.reports.page import CHARACTERS, Html, Section, page, page_template, system_section, text, wide
from kahanmaps.reports.pictures import Pictures
from kahanmaps.sources import source

if TYPE_CHECKING:
    from kahanmaps.checks.claims import Finding
    from kahanmaps.laboratory.preserve.hirota_kimura import SparseRelation

_LIMITS = checks.DisplayLimits(CHARACTERS, CHARACTERS, CHARACTERS, 100)  # a reader can check a witness that is whole
_PARSED = 4_000  # characters of a relation that is read once more, to be set as a formula
_PAPER = "petrera-suris-2016"
_EXPLAINED = (
    "Proved: exactly, for every eps or the one that is named. Supported: held at random points over GF(p), with a "
    "bound for the error, or along an orbit. Refuted: there is a witness. A control, and a misprint as it is printed, "
    "are expected to be refuted, and do not count. Each line unfolds to its evidence."
)


def report_html(
    found: Analysis | Report | Sequence[Report],
    *,
    file: SystemFile | None = None,
    title: str | None = None,
    pictures: bool = True,
    command: str = "",
    left_out: Sequence[str] = (),
    explore: bool = False,
) -> str:
    """A page about what was found: one HTML text that needs no network, and no JavaScript unless it is to `explore`.

    Args:
        found: an `Analysis`, the `Report` of `verify` or of a check, or several of checks of one system.
        file: the system that reports are about, for its equations and pictures; an Analysis brings its own.
        title: the title (default: the name of the system).
        pictures: whether to draw; without matplotlib the page says that there are none, and how to get them.
        command: the command line that makes the page, printed on the page.
        left_out: sentences on what is not on the page, printed as notes.
        explore: for an Analysis, a page on which eps and the start of an orbit are moved by sliders.

    Returns:
        The page, the same text for the same input (and the same versions of the libraries that make it). Formulas are
        exact; those of more than about 6000 characters are cut, and say so.

    Raises:
        InputError: for something else, no reports, and where the extra [report] is not installed.

    >>> from kahanmaps.checks.conserve import check_integrals
    >>> from kahanmaps.documents.catalog import load
    >>> top = load("euler_top")
    >>> text = report_html(check_integrals(top), file=top, pictures=False)
    >>> text[:15], text.count("</details>")
    ('<!DOCTYPE html>', 3)
    """
    page_template()  # which says what has to be installed, before pictures are drawn
    drawn = Pictures(pictures and not explore)
    script, seed = "", None
    if isinstance(found, Analysis):
        file, seed = found.file, found.seed
        about = (file.name, f"dimension {found.dim}", eps_sentence(found.eps, file.map))
        lead = ", ".join(filter(None, about))
        default_title = _title(file)
        if explore:
            sections = explore_sections(found)
            script = (resources.files("kahanmaps.reports") / "explore.js").read_text(encoding="utf-8")
        else:
            lead += f"; formulas for every {', '.join(found.symbols)}" if found.symbols else ""
            sections = [*_analysis_sections(found, drawn), Section("notes", "Notes", items=left_out)]
    elif explore:
        raise InputError(f"found {type(found).__name__}, expected an Analysis: it is what can be explored")
    else:
        reports = list(found) if isinstance(found, Sequence) else [found]
        if not reports or not all(isinstance(report, Report) for report in reports):
            kinds = ", ".join(sorted({type(report).__name__ for report in reports})) or "nothing"
            raise InputError(f"found {kinds}, expected an Analysis, a Report or several of them")
        first = reports[0]
        lead = ", ".join(filter(None, (checks.systems_sentence(first), checks.eps_sentence(first))))
        name = str(first.context.get("system", "")) if file is None else _title(file)
        what = "The paper, statement by statement" if first.check == "verify" else "Checks"
        default_title, seed = f"{what}: {name}", first.context.get("seed")
        sections = _claims_sections(reports, file, left_out, drawn)
    if drawn.note:
        sections.append(Section("pictures", "Pictures", paragraphs=[drawn.note]))
    title = (title or "").strip() or default_title
    return page(title, lead, sections, command=command, seed=seed, file=file, script=script)


def write_report(path: str | Path, found: Any, **options: Any) -> None:
    """Write the page of `report_html` to a file, whole or not at all; the options are those of `report_html`."""
    write_atomically(Path(path), report_html(found, **options).encode())


def _title(file: SystemFile) -> str:
    """What the catalogue calls it; equations from the command line have no name and stand for themselves, if short."""
    return str(file.catalog.get("title", "")) or file.label


# -- the page of an analysis: the verdict first, then what was found, each with how it is known


def _analysis_sections(found: Analysis, pictures: Pictures) -> list[Section]:
    file, final = found.file, found.conclusion
    of = " in x and eps" if file.map.has_eps else ""
    words = (
        f"Proved and supported: formulas, as identities{of}. Measured: modulo primes and along orbits, "
        "which is evidence. The number of integrals and the growth are separate findings."
    )
    conclusion = Html(f"<strong>{text(final.kind)}</strong>"), final.sentence
    sections = [Section("verdict", "Verdict", conclusion, [words]), system_section(file), _catalogue(file)]
    formulas = formulas_of(found)
    for name, lines in found.sections:
        statements = [(Html(markup.verdict(line.status)), formulas.get(line.text, line.text)) for line in lines]
        pieces, folded = _beside(found, name, pictures)
        title = name[0].upper() + name[1:]
        section = Section(name.replace(" ", "-"), title, statements=statements, pieces=pieces, folded=folded)
        sections.append(section)
    is_member = isinstance(file.normal_form, SystemNormalForm)  # in the coordinates that the picture is made in
    drawn = (pictures.invariant_curves if is_member else pictures.portrait)(file, found.eps)
    return [*sections, Section("orbits", "Orbits", pieces=[Html(drawn)] if drawn else [])]


def _catalogue(file: SystemFile) -> Section:
    """What the catalogue, or the file, says of the system; empty for others."""
    claims = [
        formula(function, name or "I", CHARACTERS)
        for name, function in {**file.integrals, **file.integrals_in_iterates}.items()
    ]
    if file.density is not None:
        claims.append(formula(file.density, "phi", CHARACTERS))
    convention = file.catalog.get("convention", "")
    facts = file.catalog.get("facts", [])
    sources = markup.listed(text(source(key)) for key in file.catalog.get("sources", []))
    pieces = [Html(f"<h3>Sources</h3>\n{sources}")] if file.catalog.get("sources") else []
    title = f"What {'the catalogue' if file.catalog else 'the file'} says"
    if not (facts or claims or convention or pieces):
        return Section("known", title)
    first = Html(
        '<span class="soft">The analysis below has not read this: it was given the right-hand sides only.</span>'
    )
    return Section(
        "known",
        title,
        paragraphs=[first, *[f"Step: {convention}"] * bool(convention)],
        items=facts,
        pieces=pieces,
        folded=[(f"Its claims: {counted(len(claims), 'formula')}", Html(markup.listed(claims)))] if claims else [],
    )


def _beside(found: Analysis, name: str, pictures: Pictures) -> tuple[list[Html], list[tuple[str, Html]]]:
    """Pictures and folded tables below the statements of a section."""
    drawn: list[str] = []
    folded: list[tuple[str, Html]] = []
    if name == "singularities":
        at = " at eps = {}" if found.file.map.has_eps else ""
        for run in found.singularities:
            folded.append((f"Hypersurfaces{at.format(format_number(run.eps))}", wide(result_html(run, found.file.map))))
    growth, survey = found.degrees, found.heights
    if name == "growth" and growth is not None:
        first = ", ".join(map(str, growth.degrees[:8]))
        alt = f"Degrees of the iterates against their number, from {first}: {growth.growth_text}"
        caption = "Degrees of the iterates"
        caption += " and the recurrence that they satisfy." if growth.recurrence is not None else "."
        label = found.file.label
        drawn.append(pictures.draw("degrees", caption, alt, lambda style: plot_degrees({label: growth}, style)))
        rows = [(str(n), str(d)) for n, d in enumerate(growth.degrees)]
        folded.append(("Degrees as a table", wide(markup.table(["n", "degree of the n-th iterate"], rows))))
    if name == "growth" and survey is not None and survey.orbits:
        alt = f"Heights of exact orbits in bits against the step: {survey.text}"
        caption = "Heights of exact orbits, and the growth that was fitted."
        drawn.append(pictures.draw("heights", caption, alt, lambda style: plot_heights(survey, style)))
        folded.append(("Orbits whose heights were measured", wide(result_html(survey))))
    return [Html(figure) for figure in drawn if figure], folded


def formulas_of(found: Analysis) -> dict[str, Html]:
    """HTML for statements that are formulas, by their text in `found.sections`."""
    shown: dict[str, str] = {}

    def evidence(statement: Any) -> str:
        because = checks.because(statement.evidence, _LIMITS)
        return f"<details><summary>evidence</summary>{because}</details>"

    for one in found.integrals.integrals if found.integrals is not None else ():
        html = formula(one.function, one.name, CHARACTERS)
        below = f'<span class="soft">{text(one.origin)}</span>\n{evidence(one)}'
        shown[f"{one.name} = {one.text}  [{one.origin}]"] = f"{html}<br/>{below}"
    for relation in found.relations:
        if html := _relation(relation, (*relation.names, *found.file.variables, "eps")):
            shown[f"along orbits {relation.text}"] = f"along orbits {html}"
    for density in found.densities.densities if found.densities is not None else ():
        html = formula(density.function, "phi", CHARACTERS)
        shown[f"dx/phi is invariant, phi = {density.text}"] = f"dx/ϕ is invariant, {html}\n{evidence(density)}"
    if found.degrees is not None and found.degrees.recurrence is not None and found.degrees.recurrence.closed_form:
        closed = found.degrees.recurrence.closed_form
        with suppress(KahanmapsError):  # where it is something else than a polynomial in n
            shown[f"d_n = {closed}"] = typeset(f"d_n = {latex_polynomial(parse_polynomial(closed, ['n']))}")
    if found.hamiltonian is not None and found.hamiltonian.hamiltonian is not None:
        hamiltonian = found.hamiltonian.hamiltonian
        kind = "the standard J" if hamiltonian.is_standard else "a constant skew J"
        html = f"Hamiltonian with {kind}, {formula(hamiltonian.H, 'H', CHARACTERS)}"
        shown[f"Hamiltonian with {kind}, H = {format_polynomial(hamiltonian.H)}"] = html
    for field in found.commuting.nontrivial if found.commuting is not None else ():
        parts = "<br/>\n".join(formula(g, f"g{k}", CHARACTERS) for k, g in enumerate(field.system.rhs, start=1))
        words = "commutes with the Kahan maps of g and -g"
        shown[f"{words}, g = ({', '.join(field.rhs)})"] = f"{words},<br/>\n{parts}"
    return {text: Html(html) for text, html in shown.items()}


def _relation(relation: SparseRelation, names: tuple[str, ...]) -> str:
    """P = 0 as a formula, term by term in the order of its text; empty where it cannot be read as one."""
    if len(relation.text) > _PARSED:
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


# -- the page of claims: those of the paper by section, or those of the checks of one system


def _claims_sections(
    reports: Sequence[Report], file: SystemFile | None, left_out: Sequence[str], pictures: Pictures
) -> list[Section]:
    first = reports[0]
    is_paper = len(reports) == 1 and first.check == "verify"
    if is_paper:
        groups = [
            (f"section-{findings[0].place.get('section', 'none')}", name or "Together", findings)
            for name, findings in checks.sections_of(first.findings).items()
        ]
    else:
        groups = [(f"check-{_slug(r.check)}", f"Check: {r.check}", list(r.findings)) for r in reports]
    rows = [
        (f'<a href="#{section_id}">{text(name)}</a>', text(checks.counts(findings)))
        for section_id, name, findings in groups
    ]
    verdict = Html(markup.verdict(combined(report.verdict for report in reports)))
    counts = checks.counts([finding for report in reports for finding in report.findings])
    table = wide(markup.table(["part", "claims"], rows))
    sections = [Section("verdict", "Verdict", (verdict, counts), [_EXPLAINED], pieces=[table])]
    if file is not None:
        eps = first.context.get("eps")
        draw = pictures.portrait if file.member is None else pictures.invariant_curves
        drawn = draw(file, None if eps in (None, "every") else str(eps))
        sections += [system_section(file), Section("orbits", "Orbits", pieces=[Html(drawn)] if drawn else [])]
    ids: Counter[str] = Counter()
    for section_id, name, findings in groups:
        sections.append(Section(section_id, name, claims=[_claim(finding, ids) for finding in findings]))
    notes = [note for report in reports for note in (checks.ending_sentence(report), *report.notes)]
    sections.append(Section("notes", "Notes", items=[note for note in (*notes, *left_out) if note]))
    paper = [source(_PAPER)] if first.check == "verify" else []
    return [*sections, Section("sources", "Source", paragraphs=paper)]


def _claim(finding: Finding, ids: Counter[str]) -> dict[str, Any]:
    """One line with its verdict, to be unfolded; what is refuted and should not be stands open.

    `ids` counts those that are on the page: a control has the key of its claim, once for each hypothesis it breaks.
    """
    name = ""
    if key := finding.place.get("key"):
        name = f"claim-{_slug(str(key))}"
        ids[name] += 1
        name = name if ids[name] == 1 else f"{name}-{ids[name]}"
    place = finding.place.get("place")
    return {
        "id": name,
        "is_open": str(finding.verdict) == "refuted" and not finding.control,
        "verdict": Html(checks.verdict_html(finding)),
        "place": place,
        "words": finding.claim.removeprefix(f"{place}: "),
        "rows": [(word, Html(what)) for word, what in checks.evidence_rows(finding, _LIMITS)],
    }


def _slug(words: str) -> str:
    return re.sub("[^A-Za-z0-9]+", "-", words).strip("-") or "x"
