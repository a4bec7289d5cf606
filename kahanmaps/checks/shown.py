"""How claims and their verdicts look in a notebook and in a report: words with marks, never colour alone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from kahanmaps import markup
from kahanmaps.errors import counted
from kahanmaps.maps.shown import eps_words

if TYPE_CHECKING:
    from kahanmaps.checks.claims import Evidence, Finding, Report, Witness

_CLAIMS = 30  # in a notebook
_TEXT = 400
_NUMBER = 60


class ShownAsWord:
    """For an Enum, whose body may not have a method with such a name."""

    def _repr_html_(self) -> str:
        return markup.verdict(self)


def verdict_html(finding: Finding) -> str:
    """The verdict of a finding; that of a control says that it is as expected."""
    word = markup.verdict(finding.verdict)
    if finding.place.get("misprint"):
        return f"{word} as printed"
    if finding.control:
        return f"{word} (as expected)" if finding.is_as_expected else f"{word} (expected: refuted)"
    return word if finding.applies else f"{word} (does not count here)"


def finding_html(finding: Finding) -> str:
    """A claim with its verdict, the evidence and the witness."""
    rows = [("verdict", verdict_html(finding)), *evidence_rows(finding)]
    return markup.titled(markup.shortened(finding.claim, _TEXT), markup.definitions(rows))


def evidence_rows(finding: Finding) -> list[tuple[str, str]]:
    """What stands below a claim: formula, evidence, witness, source; each row a word and HTML."""
    rows = []
    if finding.formula and finding.formula not in finding.claim:
        rows.append(("formula", f"<code>{_text(finding.formula, 1200)}</code>"))
    rows.append(("because", because(finding.evidence)))
    rows += [("also", _text(evidence.summary)) for evidence in finding.also[:6]]
    if finding.witness is not None:
        rows.append(("witness", _witness(finding.witness)))
    if finding.place.get("misprint"):
        rows.append(("misprint", _text(str(finding.place["misprint"]))))
    if finding.place.get("broken"):
        rows.append(("broken", _text(str(finding.place["broken"]))))
    if finding.source:
        rows.append(("source", _text(finding.source)))
    return rows


def because(evidence: Evidence) -> str:
    """What decided a claim: a sentence, and the hypotheses that were verified."""
    hypotheses: Sequence[str] = evidence.data.get("hypotheses") or ()
    if not hypotheses:
        return _text(evidence.summary)
    more = f"; and {len(hypotheses) - 8} more" if len(hypotheses) > 8 else ""
    return _text(f"{evidence.data['theorem']} applies: {'; '.join(hypotheses[:8])}{more}", 1200)


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
    if context["eps"] == "every":
        return eps_words()
    return eps_words(context["eps"], context["time_step"])


def report_html(report: Report) -> str:
    """The findings of a check as a table; of many claims the number in each section, and those that are not proved."""
    systems = [str(report.context[key]) for key in ("system", "other") if key in report.context]
    title = f"{report.check}: {', '.join(systems)}"
    pieces = [f"<p>{markup.verdict(report.verdict)} ({_text(counts(report.findings))})</p>"]
    chosen = list(report.findings)
    if len(chosen) > _CLAIMS:
        pieces.append(sections_table(report.findings))
        chosen = [f for f in chosen if str(f.verdict) != "proved" and not f.control and f.applies]
    if chosen:
        rows = [
            (verdict_html(f), _text(f.claim), because(f.evidence) if f.witness is None else _witness(f.witness))
            for f in chosen[:_CLAIMS]
        ]
        pieces.append(markup.table(["verdict", "claim", "because"], rows))
    if len(chosen) > _CLAIMS:
        pieces.append(f"<p>… and {len(chosen) - _CLAIMS} more claims</p>")
    pieces += [f"<p>{_text(note)}</p>" for note in report.notes[:5]]
    return markup.titled(markup.shortened(title, 200), "\n".join(pieces), eps_sentence(report))


def sections_of(findings: Iterable[Finding]) -> dict[str, list[Finding]]:
    """The findings of `verify` by the title of their section, in order; elsewhere all under an empty title."""
    by_section: dict[str, list[Finding]] = {}
    for finding in findings:
        number, title = finding.place.get("section"), str(finding.place.get("section_title", ""))
        name = f"Section {number}. {title}" if number not in (None, 10) else title
        by_section.setdefault(name, []).append(finding)
    return by_section


def sections_table(findings: Iterable[Finding]) -> str:
    """How many claims of each section have which verdict."""
    rows = [(_text(title or "claims"), _text(counts(found))) for title, found in sections_of(findings).items()]
    return markup.table(["section", "claims"], rows)


def _witness(witness: Witness) -> str:
    where = "" if witness.field == "QQ" else f" over {witness.field}"
    lines = [f"x = ({_numbers(witness.point)}), eps = {_short(witness.eps)}{where}"]
    lines += [f"{name} = ({_numbers(vector)})" for name, vector in list(witness.vectors.items())[:4]]
    lines += [f"{witness.left_label} = {_numbers(witness.left)}", f"{witness.right_label} = {_numbers(witness.right)}"]
    return "<br/>".join(markup.escape(markup.shortened(line, 800)) for line in lines)


def _numbers(values: Sequence[str]) -> str:
    shown = ", ".join(_short(value) for value in values[:8])
    return f"{shown}, … ({len(values)} numbers)" if len(values) > 8 else shown


def _short(number: str) -> str:
    return markup.shortened(number, _NUMBER)


def _text(text: str, width: int = _TEXT) -> str:
    return markup.escape(markup.shortened(text, width))
