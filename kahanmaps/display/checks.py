"""Claims and verdicts as text, and as HTML for notebooks and pages; colors carry no information of their own.

`print` shows a report as lines that start with a word and a tab, like the output of the command in a pipe.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from kahanmaps.checks.claims import Certainty, Evidence, Finding, Report, Witness
from kahanmaps.display import markup
from kahanmaps.display_protocols import html_form, shorten, text_form
from kahanmaps.errors import counted
from kahanmaps.maps.convention import eps_record_suffix

_MAX_CLAIMS = 30  # maximal number of claims that a notebook displays
_MAX_TEXT = 400  # maximal number of characters of a sentence in a notebook


@dataclass(frozen=True)
class DisplayLimits:
    """Limits of a displayed claim: characters of a sentence, of a formula and of a number; entries of a list."""

    text: int
    formula: int
    number: int
    entries: int


_NOTEBOOK = DisplayLimits(_MAX_TEXT, 1_200, 60, 8)


html_form.register(Certainty, markup.verdict)


def verdict_html(finding: Finding) -> str:
    """Return the verdict of a finding as HTML; for a control, with a note whether it is the expected one."""
    verdict = markup.verdict(finding.verdict)
    if finding.place.get("misprint"):
        return f"{verdict} as printed"
    if finding.control:
        return f"{verdict} (as expected)" if finding.is_as_expected else f"{verdict} (expected: refuted)"
    return verdict if finding.applies else f"{verdict} (does not count here)"


@html_form.register
def finding_html(finding: Finding) -> str:
    """Return a claim as HTML, with its verdict, evidence and witness."""
    rows = [("verdict", verdict_html(finding)), *evidence_rows(finding)]
    return markup.block(markup.abbreviate(finding.claim, _MAX_TEXT), markup.definitions(rows))


def evidence_rows(finding: Finding, limits: DisplayLimits = _NOTEBOOK) -> list[tuple[str, str]]:
    """Return the details of a claim as pairs (label, HTML): formula, evidence, witness, source."""
    rows = []
    if finding.formula and finding.formula not in finding.claim:
        rows.append(("formula", f"<code>{_escaped(finding.formula, limits.formula)}</code>"))
    rows.append(("because", reason(finding.evidence, limits)))
    rows += [("also", _escaped(evidence.summary, limits.text)) for evidence in finding.also[: limits.entries]]
    if len(finding.also) > limits.entries:
        rows.append(("also", f"… and {len(finding.also) - limits.entries} more"))
    if finding.witness is not None:
        rows.append(("witness", _witness_html(finding.witness, limits)))
    origin = {**{label: finding.place.get(label) for label in ("misprint", "violation")}, "source": finding.source}
    return rows + [(label, _escaped(str(value), limits.text)) for label, value in origin.items() if value]


def reason(evidence: Evidence, limits: DisplayLimits = _NOTEBOOK) -> str:
    """Return the evidence of a claim as a sentence in HTML; it lists the verified hypotheses."""
    return _escaped(summary(evidence), limits.formula if evidence.data.get("hypotheses") else limits.text)


def verdict_counts(findings: Iterable[Finding]) -> str:
    """Return the numbers of claims with each verdict as text, such as 3 proved, 1 refuted."""
    findings = list(findings)
    verdicts = Counter(str(f.verdict) for f in findings if f.applies and not f.control)
    phrases = [f"{number} {verdict}" for verdict, number in verdicts.items()]
    controls = sum(f.control and not f.place.get("misprint") for f in findings)
    misprints = sum(bool(f.place.get("misprint")) for f in findings)
    phrases += [counted(controls, "control")] * bool(controls)
    phrases += [f"{counted(misprints, 'misprint')}, refuted as printed"] * bool(misprints)
    return ", ".join(phrases) or "no claims"


def eps_sentence(report: Report) -> str:
    """Return a sentence that states the eps of a report and the time step; empty if no eps is stated."""
    context = report.context
    if "eps" not in context:
        return ""
    second_map = f", second map at eps2 = {markup.abbreviate(context['eps2'])}" if "eps2" in context else ""
    return markup.eps_phrase(context) + second_map


def ending_sentence(report: Report) -> str:
    """Return a sentence that says why the requested orbit ended early; empty if it did not."""
    if not report.ended_early:
        return ""
    return f"The requested orbit ended early: {report.context.get('orbit', {}).get('message', 'no reason given')}."


def systems_sentence(report: Report) -> str:
    """Return the names of the one or two systems of a report."""
    return ", ".join(str(report.context[key]) for key in ("system", "other") if key in report.context)


@html_form.register
def report_html(report: Report) -> str:
    """Return the findings of a check as a table in HTML; of many findings, counts by section and the unproved ones."""
    title = f"{report.check}: {systems_sentence(report)}"
    pieces = [f"<p>{markup.verdict(report.verdict)} ({_escaped(verdict_counts(report.findings))})</p>"]
    shown_findings = list(report.findings)
    if len(shown_findings) > _MAX_CLAIMS:
        sections = sections_of(report.findings).items()
        rows = [(_escaped(title or "claims"), _escaped(verdict_counts(findings))) for title, findings in sections]
        pieces.append(markup.table(["section", "claims"], rows))
        shown_findings = [f for f in shown_findings if str(f.verdict) != "proved" and not f.control and f.applies]
    if shown_findings:
        cells = [
            (verdict_html(f), _escaped(f.claim), reason(f.evidence) if f.witness is None else _witness_html(f.witness))
            for f in shown_findings[:_MAX_CLAIMS]
        ]
        pieces.append(markup.table(["verdict", "claim", "because"], cells))
    if len(shown_findings) > _MAX_CLAIMS:
        pieces.append(f"<p>… and {len(shown_findings) - _MAX_CLAIMS} more claims</p>")
    notes = [*filter(None, [ending_sentence(report)]), *report.notes[:5]]
    pieces += [f"<p>{_escaped(note)}</p>" for note in notes]
    return markup.block(markup.abbreviate(title, 200), "\n".join(pieces), eps_sentence(report))


def sections_of(findings: Iterable[Finding]) -> dict[str, list[Finding]]:
    """Return a dict from the titles of sections of `verify` to their findings; the title is "" for other checks."""
    by_section: dict[str, list[Finding]] = {}
    for finding in findings:
        number, title = finding.place.get("section"), str(finding.place.get("section_title", ""))
        name = f"Section {number}. {title}" if number in range(1, 10) else title
        by_section.setdefault(name, []).append(finding)
    return by_section


def _witness_html(witness: Witness, limits: DisplayLimits = _NOTEBOOK) -> str:
    lines = witness_lines(witness, limits.number)
    if (hidden_count := len(witness.vectors) - limits.entries) > 0:
        lines[limits.entries + 1 : -2] = [f"… and {hidden_count} more vectors"]
    return "<br/>".join(_escaped(line.strip().removeprefix("witness: "), limits.formula) for line in lines)


def _escaped(text: str, width: int = _MAX_TEXT) -> str:
    return markup.escape(markup.abbreviate(text, width))


# -- as text


@text_form.register
def report_text(report: Report) -> str:
    """Return all findings of a report with their evidence, and then the verdict of the report."""
    lines, printed_hypotheses = [headline(report)], set[str]()
    for finding in report.findings:
        lines.append(f"{verdict_text(finding)}\t{finding.claim}")
        lines += [f"\t{line}" for line in details(finding, printed_hypotheses)]
    lines += [f"note\t{note}" for note in report.notes]
    return "\n".join([*lines, f"verdict\t{report.verdict}"])


def headline(report: Report) -> str:
    """Return the first line of a report: the check, the systems, the values of parameters, and eps."""
    context = report.context
    values = [
        ", ".join(
            f"{name} = {shorten(str(value), 60)}" for name, value in context.get(key, {}).get("parameters", {}).items()
        )
        for key in ("document", "other_document")
    ]
    if "other" in context:
        pair = zip((context["system"], context["other"]), values, strict=True)
        names = ", ".join(f"{name} ({text})" if text else name for name, text in pair)
    else:
        names = ", ".join(filter(None, (context["system"], values[0])))
    eps = eps_record_suffix(context)
    if "eps2" in context:
        eps += f", second map at eps2 = {context['eps2']}"
    return f"{report.check}: {names}{eps}"


def verdict_text(finding: Finding) -> str:
    """Return the verdict of a finding as text; "(as expected)" follows it for a control that is refuted."""
    verdict = str(finding.verdict)
    return f"{verdict} (as expected)" if finding.control and finding.is_as_expected else verdict


def details(finding: Finding, printed_hypotheses: set[str], width: int | None = None) -> list[str]:
    """Return the lines printed below a claim; omit the `printed_hypotheses`, and add other hypotheses to this set."""
    lines = [finding.formula] if finding.formula and finding.formula not in finding.claim else []
    lines.append(summary(finding.evidence, printed_hypotheses))
    lines += [f"also: {evidence.summary}" for evidence in finding.also]
    if finding.witness is not None:
        lines += witness_lines(finding.witness, width)
    if finding.source:
        lines.append(f"source: {finding.source}")
    return [line if width is None else shorten(line, 1200) for line in lines]


def summary(evidence: Evidence, printed_hypotheses: set[str] | None = None) -> str:
    """Return the evidence as a sentence; omit the `printed_hypotheses`, and add the other hypotheses to this set."""
    hypotheses = evidence.data.get("hypotheses")
    if not hypotheses:
        return evidence.summary
    new_hypotheses = [text for text in hypotheses if text not in (printed_hypotheses or ())]
    if printed_hypotheses is not None:
        printed_hypotheses.update(new_hypotheses)
    repeated = len(hypotheses) - len(new_hypotheses)
    earlier = f"{repeated} hypotheses as above" if repeated > 1 else "1 hypothesis as above" if repeated else ""
    return f"{evidence.data['theorem']} applies: {'; '.join(new_hypotheses + [earlier] * bool(earlier))}"


def witness_lines(witness: Witness, width: int | None) -> list[str]:
    """Return the lines that show a witness; numbers are shortened to `width` characters (None: not shortened)."""

    def numbers(values: tuple[str, ...]) -> str:
        return ", ".join(value if width is None else shorten(value, width) for value in values)

    where = "" if witness.field == "QQ" else f" over {witness.field}"
    vector_lines = [f"  {name} = ({numbers(vector)})" for name, vector in witness.vectors.items()]
    return [
        f"witness: x = ({numbers(witness.point)}){f', eps = {witness.eps}' if witness.eps else ''}{where}",
        *vector_lines,
        f"  {witness.left_label} = {numbers(witness.left)}",
        f"  {witness.right_label} = {numbers(witness.right)}",
    ]
