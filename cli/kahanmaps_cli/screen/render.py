"""Reports and numbers for people (a rich table on a terminal, plain lines in a pipe) and for scripts (JSON)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import click

from kahanmaps import internals as lib
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
    if report.verdict is lib.Certainty.REFUTED:
        return 1
    if report.verdict is lib.Certainty.UNDECIDED or report.ended_early:
        return 3
    return 0


def verdict_style(finding: lib.Finding) -> str:
    """Red is for what nobody expected: a control that is refuted, as it should be, stays without a colour."""
    if not finding.is_as_expected:
        return "bold red"
    return "" if finding.control else COLOURS[str(finding.verdict)]


def _print_terminal(report: lib.Report, verbose: bool) -> None:
    from rich.table import Table

    # Of many findings the first ones, and every one that is not proved.
    is_long = len(report.findings) > CLAIMS_SHOWN
    shown = [
        f
        for k, f in enumerate(report.findings)
        if not is_long or k < CLAIMS_SHOWN or str(f.verdict) != "proved" or f.control
    ]
    table = Table(header_style="bold", show_lines=verbose)
    table.add_column("verdict", no_wrap=True)
    table.add_column("claim", overflow="fold")
    if not verbose:
        table.add_column("decided by", overflow="fold")
    told: set[str] = set()
    for finding in shown:
        verdict = styled(lib.verdict_text(finding).replace(" (", "\n("), verdict_style(finding))
        if verbose:
            lines = [finding.claim, *lib.details(finding, told, NUMBER_WIDTH)]
            table.add_row(verdict, styled("\n  ".join(lines)))
            continue
        has_formula = report.check != "commute" and finding.formula not in finding.claim
        claim = finding.claim + (f"\n  {shorten(finding.formula, 300)}" if has_formula else "")
        evidence, hypotheses = finding.evidence, finding.evidence.data.get("hypotheses")
        reason = evidence.summary
        if hypotheses:
            reason = f"{evidence.data['theorem']} ({len(hypotheses)} hypotheses verified exactly)"
        table.add_row(verdict, styled(claim), styled(reason))
    tell(lib.headline(report), style="bold")
    console().print(table)
    if len(shown) < len(report.findings):
        tell(f"{len(report.findings) - len(shown)} more claims, proved like those above (--json has all)")
    if not verbose:
        # What a reader of the short table wants to know next: hypotheses, further evidence, witnesses.
        hypotheses = list(dict.fromkeys(text for f in shown for text in f.evidence.data.get("hypotheses", ())))
        if hypotheses:
            more = f"; and {len(hypotheses) - 8} more (-v)" if len(hypotheses) > 8 else ""
            tell(f"verified: {'; '.join(hypotheses[:8])}{more}")
        also = dict.fromkeys(evidence.summary for f in shown if not f.control for evidence in f.also)
        for summary in list(also)[:4]:
            tell(f"also: {summary}")
        for finding in shown:
            if finding.witness is not None:
                tell(f"{lib.verdict_text(finding)}: {finding.claim}")
                for line in lib.witness_lines(finding.witness, NUMBER_WIDTH):
                    tell(f"  {line}")
    for note in report.notes:
        tell(f"note: {note}")
    tell(f"verdict\t{report.verdict}", 9)


def json_number(value: Any) -> Any:
    """A JSON number, or the text inf, -inf or nan, which JSON has no numbers for; a complex one as its two parts."""
    number = complex(value)
    if isinstance(value, complex) or getattr(value, "dtype", None) == "complex128":
        return [lib.json_float(number.real), lib.json_float(number.imag)]
    return lib.json_float(value)


def short_float(value: Any) -> str:
    """Three digits."""
    return f"{float(value):.3g}"
