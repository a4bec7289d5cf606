"""Reports for people (a rich table on a terminal, plain lines in a pipe) and for scripts (one JSON object)."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import click

from kahanmaps_cli.progress import say

if TYPE_CHECKING:
    from kahanmaps.checks.claims import Evidence, Finding, Report, Witness

COLOURS = {"proved": "green", "supported": "cyan", "refuted": "red", "undecided": "yellow"}
# On a terminal long numbers are shortened to this many characters, and long lists of claims to this many.
NUMBER_WIDTH = 40
CLAIMS_SHOWN = 40


def on_terminal() -> bool:
    """Whether standard output is a terminal."""
    return sys.stdout.isatty()


def print_json(data: Mapping[str, Any]) -> None:
    """One JSON object on a line of its own."""
    click.echo(json.dumps(data))


def shorten(text: str, width: int = NUMBER_WIDTH) -> str:
    """A long number with its middle left out and its length told: 12345...67890 (1234 characters)."""
    if len(text) <= width:
        return text
    keep = max(4, (width - 18) // 2)
    return f"{text[:keep]}...{text[-keep:]} ({len(text)} chars)"


def print_report(report: Report, as_json: bool, verbose: bool = False, quiet: bool = False) -> int:
    """Print a report and return the exit status that its verdict stands for; in a pipe everything is printed."""
    with suppress(BrokenPipeError):  # a reader that has seen enough changes no verdict
        if as_json:
            print_json(report.to_json())
        elif on_terminal():
            _print_table(report, verbose)
        else:
            _print_plain(report)
    status = exit_status(report)
    if status == 3 and report.ended_early and not quiet:
        say(f"the orbit that was asked for ended early: {report.context['orbit']['message']}")
    return status


def exit_status(report: Report) -> int:
    """0 holds, 1 refuted, 3 undecided, or an orbit that was asked for and ended early."""
    from kahanmaps.checks.claims import Verdict

    if report.verdict is Verdict.REFUTED:
        return 1
    if report.verdict is Verdict.UNDECIDED or report.ended_early:
        return 3
    return 0


def headline(report: Report) -> str:
    """The first line: what was checked, of which systems, for which eps."""
    context = report.context
    names = context["system"] + (f", {context['other']}" if "other" in context else "")
    if context["eps"] == "every":
        eps = "every eps (the time step is 2 eps)"
    else:
        eps = f"eps = {context['eps']} (time step 2 eps = {context['time_step']})"
    if "eps2" in context:
        eps += f", second map at eps2 = {context['eps2']}"
    return f"{report.check}: {names}, {eps}"


def _verdict_text(finding: Finding) -> str:
    verdict = str(finding.verdict)
    return f"{verdict} (as expected)" if finding.control and finding.is_as_expected else verdict


def _print_plain(report: Report) -> None:
    click.echo(headline(report))
    told: set[str] = set()
    for finding in report.findings:
        click.echo(f"{_verdict_text(finding)}\t{finding.claim}")
        for line in _details(finding, told):
            click.echo(f"\t{line}")
    for note in report.notes:
        click.echo(f"note\t{note}")
    click.echo(f"verdict\t{report.verdict}")


def _print_table(report: Report, verbose: bool) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console(markup=False, emoji=False, highlight=False)
    console.print(Text(headline(report), style="bold"))
    table = Table(header_style="bold", show_lines=verbose)
    table.add_column("verdict", no_wrap=True)
    table.add_column("claim", overflow="fold")
    if not verbose:
        table.add_column("decided by", overflow="fold")
    shown = _selection(report.findings)
    told: set[str] = set()
    for finding in shown:
        style = COLOURS[str(finding.verdict)] if finding.is_as_expected else "yellow"
        claim = Text(finding.claim)
        verdict = Text(_verdict_text(finding).replace(" (", "\n("), style=style)
        if verbose:
            for line in _details(finding, told, NUMBER_WIDTH):
                claim.append("\n" + line, style="dim")
            table.add_row(verdict, claim)
        else:
            if report.check != "commute" and finding.formula not in finding.claim:
                claim.append("\n" + shorten(finding.formula, 300), style="dim")
            table.add_row(verdict, claim, _short(finding.evidence))
    console.print(table)
    if len(shown) < len(report.findings):
        console.print(f"{len(report.findings) - len(shown)} more claims, proved like those above (--json has all)")
    if not verbose:
        for line in _below(shown):
            console.print(line)
    for note in report.notes:
        console.print(f"note: {note}")
    last = Text("verdict: ")
    last.append(str(report.verdict), style=f"bold {COLOURS[str(report.verdict)]}")
    console.print(last)


def _short(evidence: Evidence) -> str:
    """What decided a claim, in a table cell."""
    hypotheses = evidence.data.get("hypotheses")
    if not hypotheses:
        return evidence.summary
    return f"{evidence.data['theorem']} ({len(hypotheses)} hypotheses verified exactly)"


def _below(findings: list[Finding]) -> list[str]:
    """What a reader of the short table wants to know next: hypotheses, further evidence, witnesses."""
    lines = []
    hypotheses = list(dict.fromkeys(text for f in findings for text in f.evidence.data.get("hypotheses", ())))
    if hypotheses:
        more = f"; and {len(hypotheses) - 8} more (-v)" if len(hypotheses) > 8 else ""
        lines.append(f"verified: {'; '.join(hypotheses[:8])}{more}")
    also = list(dict.fromkeys(evidence.summary for f in findings if not f.control for evidence in f.also))
    lines += [f"also: {summary}" for summary in also[:4]]
    for finding in findings:
        if finding.witness is not None:
            lines.append(f"{_verdict_text(finding)}: {finding.claim}")
            lines += [f"  {line}" for line in witness_lines(finding.witness, NUMBER_WIDTH)]
    return lines


def _selection(findings: tuple[Finding, ...]) -> list[Finding]:
    """All findings, or where they are too many for a terminal the first ones and every one that is not proved."""
    if len(findings) <= CLAIMS_SHOWN:
        return list(findings)
    return [f for k, f in enumerate(findings) if k < CLAIMS_SHOWN or str(f.verdict) != "proved" or f.control]


def _details(finding: Finding, told: set[str], width: int | None = None) -> list[str]:
    """What stands below a claim; `told` are the hypotheses that the reader has seen already."""
    lines = [finding.formula] if finding.formula and finding.formula not in finding.claim else []
    lines.append(_summary(finding.evidence, told))
    lines += [f"also: {evidence.summary}" for evidence in finding.also]
    if finding.witness is not None:
        lines += witness_lines(finding.witness, width)
    if finding.source:
        lines.append(f"source: {finding.source}")
    return [line if width is None else shorten(line, 1200) for line in lines]


def _summary(evidence: Evidence, told: set[str]) -> str:
    """The sentence of the evidence; a hypothesis is spelt out once in a report."""
    hypotheses = evidence.data.get("hypotheses")
    if not hypotheses:
        return evidence.summary
    new = [text for text in hypotheses if text not in told]
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
        f"witness: x = ({numbers(witness.point)}), eps = {witness.eps}{where}",
        *more,
        f"  {witness.left_label} = {numbers(witness.left)}",
        f"  {witness.right_label} = {numbers(witness.right)}",
    ]
