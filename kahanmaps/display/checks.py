"""How claims and their verdicts look: in lines of text, in a notebook and on a page, where no colour stands alone.

The text of a report is what the commands write into a pipe and `print` shows: a word and a tab at the front.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from kahanmaps.checks.claims import Certainty, Evidence, Finding, Report, Witness
from kahanmaps.display import markup
from kahanmaps.display_protocols import html_form, shorten, text_form
from kahanmaps.errors import counted
from kahanmaps.maps.convention import eps_words

_CLAIMS = 30  # in a notebook
_TEXT = 400


@dataclass(frozen=True)
class DisplayLimits:
    """How much of a claim is shown: characters of a sentence, a formula and a number, and how many of a list."""

    text: int
    formula: int
    number: int
    entries: int


_NOTEBOOK = DisplayLimits(_TEXT, 1_200, 60, 8)


html_form.register(Certainty, markup.verdict)


def verdict_html(finding: Finding) -> str:
    """The verdict of a finding; that of a control says that it is as expected."""
    word = markup.verdict(finding.verdict)
    if finding.place.get("misprint"):
        return f"{word} as printed"
    if finding.control:
        return f"{word} (as expected)" if finding.is_as_expected else f"{word} (expected: refuted)"
    return word if finding.applies else f"{word} (does not count here)"


@html_form.register
def finding_html(finding: Finding) -> str:
    """A claim with its verdict, the evidence and the witness."""
    rows = [("verdict", verdict_html(finding)), *evidence_rows(finding)]
    return markup.titled(markup.shortened(finding.claim, _TEXT), markup.definitions(rows))


def evidence_rows(finding: Finding, limits: DisplayLimits = _NOTEBOOK) -> list[tuple[str, str]]:
    """What stands below a claim: formula, evidence, witness, source; each row a word and HTML."""
    rows = []
    if finding.formula and finding.formula not in finding.claim:
        rows.append(("formula", f"<code>{_text(finding.formula, limits.formula)}</code>"))
    rows.append(("because", because(finding.evidence, limits)))
    rows += [("also", _text(evidence.summary, limits.text)) for evidence in finding.also[: limits.entries]]
    if len(finding.also) > limits.entries:
        rows.append(("also", f"… and {len(finding.also) - limits.entries} more"))
    if finding.witness is not None:
        rows.append(("witness", _witness(finding.witness, limits)))
    last = {**{word: finding.place.get(word) for word in ("misprint", "broken")}, "source": finding.source}
    return rows + [(word, _text(str(what), limits.text)) for word, what in last.items() if what]


def because(evidence: Evidence, limits: DisplayLimits = _NOTEBOOK) -> str:
    """What decided a claim: a sentence, and the hypotheses that were verified."""
    return _text(summary(evidence), limits.formula if evidence.data.get("hypotheses") else limits.text)


def counts(findings: Iterable[Finding]) -> str:
    """How many of the claims that count have which verdict, as text: 3 proved, 1 refuted."""
    every = list(findings)
    found = Counter(str(f.verdict) for f in every if f.applies and not f.control)
    told = [f"{number} {verdict}" for verdict, number in found.items()]
    controls = sum(f.control and not f.place.get("misprint") for f in every)
    misprints = sum(bool(f.place.get("misprint")) for f in every)
    told += [counted(controls, "control")] * bool(controls)
    told += [f"{counted(misprints, 'misprint')}, refuted as printed"] * bool(misprints)
    return ", ".join(told) or "no claims"


def eps_sentence(report: Report) -> str:
    """For which eps the report is, with the time step."""
    context = report.context
    if "eps" not in context:
        return ""
    second = f", second map at eps2 = {markup.shortened(context['eps2'])}" if "eps2" in context else ""
    return markup.eps_phrase(context) + second


def ending_sentence(report: Report) -> str:
    """That an orbit which was asked for ended early, and how; empty where none did."""
    if not report.ended_early:
        return ""
    return (
        f"The orbit that was asked for ended early: {report.context.get('orbit', {}).get('message', 'no reason told')}."
    )


def systems_sentence(report: Report) -> str:
    """The names of the systems that the report is about."""
    return ", ".join(str(report.context[key]) for key in ("system", "other") if key in report.context)


@html_form.register
def report_html(report: Report) -> str:
    """The findings of a check as a table; of many claims the number in each section, and those that are not proved."""
    title = f"{report.check}: {systems_sentence(report)}"
    pieces = [f"<p>{markup.verdict(report.verdict)} ({_text(counts(report.findings))})</p>"]
    chosen = list(report.findings)
    if len(chosen) > _CLAIMS:
        sections = sections_of(report.findings).items()
        rows = [(_text(title or "claims"), _text(counts(found))) for title, found in sections]
        pieces.append(markup.table(["section", "claims"], rows))
        chosen = [f for f in chosen if str(f.verdict) != "proved" and not f.control and f.applies]
    if chosen:
        told = [
            (verdict_html(f), _text(f.claim), because(f.evidence) if f.witness is None else _witness(f.witness))
            for f in chosen[:_CLAIMS]
        ]
        pieces.append(markup.table(["verdict", "claim", "because"], told))
    if len(chosen) > _CLAIMS:
        pieces.append(f"<p>… and {len(chosen) - _CLAIMS} more claims</p>")
    notes = [*filter(None, [ending_sentence(report)]), *report.notes[:5]]
    pieces += [f"<p>{_text(note)}</p>" for note in notes]
    return markup.titled(markup.shortened(title, 200), "\n".join(pieces), eps_sentence(report))


def sections_of(findings: Iterable[Finding]) -> dict[str, list[Finding]]:
    """The findings of `verify` by the title of their section, in order; elsewhere all under an empty title."""
    by_section: dict[str, list[Finding]] = {}
    for finding in findings:
        number, title = finding.place.get("section"), str(finding.place.get("section_title", ""))
        name = f"Section {number}. {title}" if number not in (None, 10) else title
        by_section.setdefault(name, []).append(finding)
    return by_section


def _witness(witness: Witness, limits: DisplayLimits = _NOTEBOOK) -> str:
    lines = witness_lines(witness, limits.number)
    if (more := len(witness.vectors) - limits.entries) > 0:
        lines[limits.entries + 1 : -2] = [f"… and {more} more vectors"]
    return "<br/>".join(_text(line.strip().removeprefix("witness: "), limits.formula) for line in lines)


def _text(text: str, width: int = _TEXT) -> str:
    return markup.escape(markup.shortened(text, width))


# -- as text


@text_form.register
def report_text(report: Report) -> str:
    """All findings with their evidence, then the verdict."""
    lines, told = [headline(report)], set[str]()
    for finding in report.findings:
        lines.append(f"{verdict_text(finding)}\t{finding.claim}")
        lines += [f"\t{line}" for line in details(finding, told)]
    lines += [f"note\t{note}" for note in report.notes]
    return "\n".join([*lines, f"verdict\t{report.verdict}"])


def headline(report: Report) -> str:
    """The first line: what was checked, of which systems, with which values of parameters, for which eps."""
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
    eps = eps_words(context)
    if "eps2" in context:
        eps += f", second map at eps2 = {context['eps2']}"
    return f"{report.check}: {names}{eps}"


def verdict_text(finding: Finding) -> str:
    """The verdict in words, and that a control was refuted as it should be."""
    verdict = str(finding.verdict)
    return f"{verdict} (as expected)" if finding.control and finding.is_as_expected else verdict


def details(finding: Finding, told: set[str], width: int | None = None) -> list[str]:
    """What stands below a claim; `told` are the hypotheses that the reader has seen already."""
    lines = [finding.formula] if finding.formula and finding.formula not in finding.claim else []
    lines.append(summary(finding.evidence, told))
    lines += [f"also: {evidence.summary}" for evidence in finding.also]
    if finding.witness is not None:
        lines += witness_lines(finding.witness, width)
    if finding.source:
        lines.append(f"source: {finding.source}")
    return [line if width is None else shorten(line, 1200) for line in lines]


def summary(evidence: Evidence, told: set[str] | None = None) -> str:
    """The sentence of the evidence; a hypothesis is spelt out once in a report, of which `told` remembers it."""
    hypotheses = evidence.data.get("hypotheses")
    if not hypotheses:
        return evidence.summary
    new = [text for text in hypotheses if text not in (told or ())]
    if told is not None:
        told.update(new)
    rest = len(hypotheses) - len(new)
    above = f"{rest} hypotheses as above" if rest > 1 else "1 hypothesis as above" if rest else ""
    return f"{evidence.data['theorem']} applies: {'; '.join(new + [above] * bool(above))}"


def witness_lines(witness: Witness, width: int | None) -> list[str]:
    """A witness, the numbers shortened to `width`."""

    def numbers(values: tuple[str, ...]) -> str:
        return ", ".join(value if width is None else shorten(value, width) for value in values)

    where = "" if witness.field == "QQ" else f" over {witness.field}"
    more = [f"  {name} = ({numbers(vector)})" for name, vector in witness.vectors.items()]
    return [
        f"witness: x = ({numbers(witness.point)}){f', eps = {witness.eps}' if witness.eps else ''}{where}",
        *more,
        f"  {witness.left_label} = {numbers(witness.left)}",
        f"  {witness.right_label} = {numbers(witness.right)}",
    ]
