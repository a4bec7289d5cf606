"""Reports for people (a rich table on a terminal, plain lines in a pipe) and for scripts (one JSON object)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import click

from kahanmaps_cli import library as lib
from kahanmaps_cli.screen.progress import say
from kahanmaps_cli.screen.terminal import COLOURS, NUMBER_WIDTH, console, on_terminal, shorten, styled, tell

# On a terminal long lists of claims are cut to this many.
CLAIMS_SHOWN = 40


def envelope(command: str) -> dict[str, str]:
    """What every object begins with that a command prints as JSON."""
    return {"command": command, "version": lib.__version__}


def record_of(command: str, file: lib.SystemFile, arithmetic: str, **more: Any) -> dict[str, Any]:
    """What a command found of a system, as plain data, with the system itself."""
    common = {"system": file.name, "convention": lib.convention(file.map), "arithmetic": arithmetic}
    return {**envelope(command), **common, **more, "document": dict(file.document)}


def print_json(data: Mapping[str, Any]) -> None:
    """One JSON object on a line of its own."""
    click.echo(json.dumps(data))


def print_report(report: lib.Report, as_json: bool, verbose: bool = False, quiet: bool = False) -> int:
    """Print a report and return the exit status that its verdict stands for; in a pipe everything is printed."""
    if as_json:
        name = click.get_current_context().info_name or ""
        print_json({**envelope(name), **report.to_json()})
    elif on_terminal():
        _print_terminal(report, verbose)
    else:
        tell(str(report))
    status = exit_status(report)
    if status == 3 and report.ended_early and not quiet:
        orbit = report.context["orbit"]
        hint = "; --max-digits N raises the budget" if orbit["status"] == "budget" else ""
        say(f"the orbit that was asked for ended early: {orbit['message']}{hint}")
    return status


def exit_status(report: lib.Report) -> int:
    """0 holds, 1 refuted, 3 undecided, or an orbit that was asked for and ended early."""
    if report.verdict is lib.Verdict.REFUTED:
        return 1
    if report.verdict is lib.Verdict.UNDECIDED or report.ended_early:
        return 3
    return 0


def verdict_style(finding: lib.Finding) -> str:
    """Red is for what nobody expected: a control that is refuted, as it should be, stays without a colour."""
    if not finding.is_as_expected:
        return "bold red"
    return "" if finding.control else COLOURS[str(finding.verdict)]


def _print_terminal(report: lib.Report, verbose: bool) -> None:
    tell(lib.headline(report), style="bold")
    shown = _selection(report.findings)
    _print_table(report, shown, verbose)
    if len(shown) < len(report.findings):
        tell(f"{len(report.findings) - len(shown)} more claims, proved like those above (--json has all)")
    if not verbose:
        for line in _below(shown):
            tell(line)
    for note in report.notes:
        tell(f"note: {note}")
    tell(f"verdict\t{report.verdict}", 9)


def _print_table(report: lib.Report, shown: list[lib.Finding], verbose: bool) -> None:
    from rich.table import Table

    table = Table(header_style="bold", show_lines=verbose)
    table.add_column("verdict", no_wrap=True)
    table.add_column("claim", overflow="fold")
    if not verbose:
        table.add_column("decided by", overflow="fold")
    told: set[str] = set()
    for finding in shown:
        claim = finding.claim
        verdict = styled(lib.verdict_text(finding).replace(" (", "\n("), verdict_style(finding))
        if verbose:
            for line in lib.details(finding, told, NUMBER_WIDTH):
                claim += "\n  " + line
            table.add_row(verdict, styled(claim))
        else:
            if report.check != "commute" and finding.formula not in finding.claim:
                claim += "\n  " + shorten(finding.formula, 300)
            table.add_row(verdict, styled(claim), styled(_short(finding.evidence)))
    console().print(table)


def _short(evidence: lib.Evidence) -> str:
    """What decided a claim, in a table cell."""
    hypotheses = evidence.data.get("hypotheses")
    if not hypotheses:
        return evidence.summary
    return f"{evidence.data['theorem']} ({len(hypotheses)} hypotheses verified exactly)"


def _below(findings: list[lib.Finding]) -> list[str]:
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
            lines.append(f"{lib.verdict_text(finding)}: {finding.claim}")
            lines += [f"  {line}" for line in lib.witness_lines(finding.witness, NUMBER_WIDTH)]
    return lines


def _selection(findings: tuple[lib.Finding, ...]) -> list[lib.Finding]:
    """All findings, or where they are too many for a terminal the first ones and every one that is not proved."""
    if len(findings) <= CLAIMS_SHOWN:
        return list(findings)
    return [f for k, f in enumerate(findings) if k < CLAIMS_SHOWN or str(f.verdict) != "proved" or f.control]
