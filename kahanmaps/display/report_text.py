"""A report as lines of text, a word and a tab at the front: what the commands write into a pipe, and `print` shows."""

from __future__ import annotations

from kahanmaps.checks.claims import Evidence, Finding, Report, Witness
from kahanmaps.displayed import shorten, text_form
from kahanmaps.maps.convention import eps_words


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
