"""Reports and numbers: a table on a terminal, plain lines in a pipe, or JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli.screen.progress import print_stderr
from kahanmaps_cli.screen.terminal import (
    NUMBER_WIDTH,
    VERDICT_COLORS,
    console,
    on_terminal,
    print_stdout,
    shorten,
    styled,
)

# Maximal number of claims in a list on a terminal.
CLAIMS_SHOWN = 40


def envelope(command: str) -> dict[str, str]:
    """Return the first entries of the JSON object that every command prints: those that identify the command."""
    return {"command": command, "version": lib.__version__}


def record_of(command: str, file: lib.SystemFile, arithmetic: str, **entries: Any) -> dict[str, Any]:
    """Return the JSON object of a command for a system, which includes the content of the system file."""
    common = {"system": file.name, "convention": lib.convention(file.map), "arithmetic": arithmetic}
    return {**envelope(command), **common, **entries, "document": dict(file.document)}


def print_json(data: Mapping[str, Any]) -> None:
    """Print one JSON object on one line."""
    click.echo(json.dumps(data))


def print_report(
    report: lib.Report, as_json: bool, verbose: bool = False, quiet: bool = False, measured: Any = None
) -> int:
    """Print a report and, if given, the numbers `measured` along an orbit; return the exit status for the verdict."""
    if as_json:
        name = click.get_current_context().info_name or ""
        entries = {} if measured is None else {"measured": measured.to_json()}
        print_json({**envelope(name), **report.to_json(), **entries})
    elif on_terminal():
        _print_terminal(report, verbose)
    else:
        print_stdout(str(report))
    for line in () if as_json or measured is None else measured.lines():
        print_stdout(line, 9)
    status = exit_status(report)
    if status == 3 and report.ended_early and not quiet:
        orbit = report.context["orbit"]
        hint = "; --max-digits N raises the budget" if orbit["status"] == "budget" else ""
        print_stderr(f"the requested orbit ended early: {orbit['message']}{hint}")
    return status


def exit_status(report: lib.Report) -> int:
    """Return 0 if all claims hold, 1 if one is refuted, otherwise 3: one is undecided or the orbit ended early."""
    if report.verdict is lib.Certainty.REFUTED:
        return 1
    if report.verdict is lib.Certainty.UNDECIDED or report.ended_early:
        return 3
    return 0


def verdict_style(finding: lib.Finding) -> str:
    """Return the style of a verdict: red if it is not the expected one, none for a control refuted as expected."""
    if not finding.is_as_expected:
        return "bold red"
    return "" if finding.control else VERDICT_COLORS[str(finding.verdict)]


def _print_terminal(report: lib.Report, verbose: bool) -> None:
    from rich.table import Table

    # Of many findings, print the first ones and, further on, those that are controls or not proved.
    is_long = len(report.findings) > CLAIMS_SHOWN
    shown_findings = [
        f
        for k, f in enumerate(report.findings)
        if not is_long or k < CLAIMS_SHOWN or str(f.verdict) != "proved" or f.control
    ]
    table = Table(header_style="bold", show_lines=verbose)
    table.add_column("verdict", no_wrap=True)
    table.add_column("claim", overflow="fold")
    if not verbose:
        table.add_column("decided by", overflow="fold")
    printed_hypotheses: set[str] = set()
    for finding in shown_findings:
        verdict = styled(lib.verdict_text(finding).replace(" (", "\n("), verdict_style(finding))
        if verbose:
            lines = [finding.claim, *lib.details(finding, printed_hypotheses, NUMBER_WIDTH)]
            table.add_row(verdict, styled("\n  ".join(lines)))
            continue
        has_formula = report.check != "commute" and finding.formula not in finding.claim
        claim = finding.claim + (f"\n  {shorten(finding.formula, 300)}" if has_formula else "")
        evidence, hypotheses = finding.evidence, finding.evidence.data.get("hypotheses")
        reason = evidence.summary
        if hypotheses:
            reason = f"{evidence.data['theorem']} ({len(hypotheses)} hypotheses verified exactly)"
        table.add_row(verdict, styled(claim), styled(reason))
    print_stdout(lib.headline(report), style="bold")
    console().print(table)
    if len(shown_findings) < len(report.findings):
        print_stdout(f"{len(report.findings) - len(shown_findings)} more claims, all proved (--json has all)")
    if not verbose:
        # The table without -v omits hypotheses, further evidence and witnesses, which are printed here.
        hypotheses = list(dict.fromkeys(text for f in shown_findings for text in f.evidence.data.get("hypotheses", ())))
        if hypotheses:
            hidden_text = f"; and {len(hypotheses) - 8} more (-v)" if len(hypotheses) > 8 else ""
            print_stdout(f"verified: {'; '.join(hypotheses[:8])}{hidden_text}")
        summaries = dict.fromkeys(evidence.summary for f in shown_findings if not f.control for evidence in f.also)
        for summary in list(summaries)[:4]:
            print_stdout(f"also: {summary}")
        for finding in shown_findings:
            if finding.witness is not None:
                print_stdout(f"{lib.verdict_text(finding)}: {finding.claim}")
                for line in lib.witness_lines(finding.witness, NUMBER_WIDTH):
                    print_stdout(f"  {line}")
    for note in report.notes:
        print_stdout(f"note: {note}")
    print_stdout(f"verdict\t{report.verdict}", 9)


def json_number(value: Any) -> Any:
    """Return a real number for JSON (inf, -inf and nan as text), or the list of real and imaginary part."""
    number = complex(value)
    if isinstance(value, complex) or getattr(value, "dtype", None) == "complex128":
        return [lib.json_float(number.real), lib.json_float(number.imag)]
    return lib.json_float(value)


def short_float(value: Any) -> str:
    """Format a number with three significant digits."""
    return f"{float(value):.3g}"
