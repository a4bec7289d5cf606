"""The page about claims and their verdicts: those of the paper by section, or those of the checks of one system."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

from kahanmaps.checks.claims import combined
from kahanmaps.display import markup
from kahanmaps.display.checks import (
    counts,
    ending_sentence,
    eps_sentence,
    evidence_rows,
    sections_of,
    systems_sentence,
    verdict_html,
)
from kahanmaps.reports.analysis_page import system_html
from kahanmaps.reports.page import ROOM, Section, page, text, wide
from kahanmaps.reports.pictures import Pictures
from kahanmaps.reports.portraits import invariant_curves_figure, portrait_figure
from kahanmaps.sources import source

if TYPE_CHECKING:
    from kahanmaps.checks.claims import Finding, Report
    from kahanmaps.documents.files import SystemFile
    from kahanmaps.plots.recipe import Recipe

_PAPER = "petrera-suris-2016"
_EXPLAINED = (
    "<p>Proved: exactly, for every eps or the one that is named. Supported: held at random points over GF(p), with a "
    "bound for the error, or along an orbit. Refuted: there is a witness. A control, and a misprint as it is printed, "
    "are expected to be refuted, and do not count. Each line unfolds to its evidence.</p>"
)


def claims_page(
    reports: Sequence[Report],
    title: str,
    recipe: Recipe,
    pictures: Pictures,
    file: SystemFile | None = None,
    left_out: Sequence[str] = (),
) -> str:
    """The page about one or several reports on one system; `left_out` are sentences on checks that do not apply."""
    lead = ", ".join(text(part) for part in (systems_sentence(reports[0]), eps_sentence(reports[0])) if part)
    groups = _groups(reports)
    verdict = combined(report.verdict for report in reports)
    every = [finding for report in reports for finding in report.findings]
    rows = [
        (f'<a href="#{section_id}">{text(name)}</a>', text(counts(findings))) for section_id, name, findings in groups
    ]
    conclusion = f'<p class="conclusion">{markup.verdict(verdict)}<br/>{text(counts(every))}</p>'
    ids: Counter[str] = Counter()
    told = [note for report in reports for note in (ending_sentence(report), *report.notes)]
    notes = [text(note) for note in (*told, *left_out) if note]
    sections = [
        Section("verdict", "Verdict", f"{conclusion}\n{_EXPLAINED}\n{wide(markup.table(['part', 'claims'], rows))}"),
        Section("system", "The system", "" if file is None else system_html(file)),
        Section("orbits", "Orbits", "" if file is None else _orbits(file, reports[0], pictures)),
        *(
            Section(section_id, name, "\n".join(_claim(finding, ids) for finding in findings))
            for section_id, name, findings in groups
        ),
        Section("notes", "Notes", markup.listed(notes) if notes else ""),
        Section("sources", "Source", f"<p>{text(source(_PAPER))}</p>" if reports[0].check == "verify" else ""),
    ]
    return page(title, lead, sections, pictures, recipe, reports[0].context.get("seed"))


def _groups(reports: Sequence[Report]) -> list[tuple[str, str, list[Finding]]]:
    """Claims as they stand on the page: id, title, findings."""
    if len(reports) == 1 and reports[0].check == "verify":
        return [
            (f"section-{found[0].place.get('section', 'none')}", name or "Together", found)
            for name, found in sections_of(reports[0].findings).items()
        ]
    return [(f"check-{_slug(r.check)}", f"Check: {r.check}", list(r.findings)) for r in reports]


def _claim(finding: Finding, ids: Counter[str]) -> str:
    """One line with its verdict, to be unfolded; what is refuted and should not be stands open.

    `ids` counts those that are on the page: a control has the key of its claim, once for each hypothesis it breaks.
    """
    key = finding.place.get("key")
    name = f"claim-{_slug(str(key))}"
    ids[name] += 1
    mark = f' id="{name if ids[name] == 1 else f"{name}-{ids[name]}"}"' if key else ""
    place = finding.place.get("place")
    words = finding.claim.removeprefix(f"{place}: ")
    above = f"<strong>{text(place)}</strong> " if place else ""
    is_open = ' open="open"' if str(finding.verdict) == "refuted" and not finding.control else ""
    summary = f"{verdict_html(finding)} {above}{text(words)}"
    return (
        f'<details class="claim"{mark}{is_open}><summary>{summary}</summary>\n'
        f"{wide(markup.definitions(evidence_rows(finding, ROOM)))}\n</details>"
    )


def _orbits(file: SystemFile, report: Report, pictures: Pictures) -> str:
    eps = report.context.get("eps")
    given = None if eps in (None, "every") else str(eps)
    if file.member is not None:
        return invariant_curves_figure(file, given, pictures)
    return portrait_figure(file, given, pictures)


def _slug(words: str) -> str:
    return re.sub("[^A-Za-z0-9]+", "-", words).strip("-") or "x"
