"""The table of `kahanmaps verify`, section by section; in a pipe and as JSON it is a report like any other."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

from kahanmaps.display import markup
from kahanmaps.display.checks import headline, witness_lines
from kahanmaps_cli import library as lib
from kahanmaps_cli.screen.render import exit_status, print_report, verdict_style
from kahanmaps_cli.screen.terminal import NUMBER_WIDTH, console, echo, on_terminal, shorten, styled, tell

if TYPE_CHECKING:
    from rich.table import Table

_HOW = {
    "symbolic, normal form": "symbolic",
    "symbolic": "symbolic",
    "exact": "exact",
    "exact rational point": "exact",
    "point over GF(p)": "point mod p",
    "random points over GF(p)": "points",
    "random points": "points",
    "outside the hypotheses": "outside",
    "special member": "special",
    "control": "exact",
}
_LEGEND = {
    "symbolic, normal form": "symbolic: an identity of rational functions in indeterminate roots of chi, coefficients "
    "of H, x and eps, multiplied out for the normal form; the hypotheses of this member are verified exactly",
    "symbolic": "symbolic: an identity of rational functions of x (and eps), multiplied out for this member",
    "exact": "exact: no x in it, computed over Q",
    "exact rational point": "exact: shown at an exact rational point, which is a proof (or a refutation)",
    "point over GF(p)": "point mod p: shown at a point over GF(p), which is a proof (or a refutation)",
    "random points over GF(p)": "points: held at random points over GF(p), error below the bound given",
    "special member": "special: the statement is for generic A and H, and this member is special; it does not count",
    "outside the hypotheses": "outside: the member does not satisfy the hypotheses of the statement",
}


def print_verification(report: lib.Report, as_json: bool, as_markdown: bool, verbose: bool, quiet: bool) -> int:
    """Print the report and return the exit status."""
    if report.context.get("beyond") and not as_json:
        echo(lib.table(report))
        return exit_status(report)
    if as_markdown:
        echo(markdown(report))
        return exit_status(report)
    if as_json or not on_terminal():
        return print_report(report, as_json, verbose, quiet)
    _print_terminal(report, verbose)
    return exit_status(report)


def markdown(report: lib.Report) -> str:
    """The table in Markdown; docs/audit.md is made of it."""
    lines = [markup.markdown(headline(report))]
    section = None
    for finding in report.findings:
        if finding.place.get("section") != section:
            section = finding.place.get("section")
            title = finding.place.get("section_title", "Together")
            lines += ["", f"### {title if section in (None, 10) else f'{section} {title}'}", ""]
            lines += ["| statement | formula | how | verdict |", "|---|---|---|---|"]
        verdict = str(finding.verdict) + (" as printed" if finding.place.get("misprint") else "")
        cells = (
            finding.place.get("place", ""),
            markup.code(finding.formula or finding.claim),
            _how(finding.evidence),
            verdict,
        )
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join([*lines, "", f"Verdict: {report.verdict} ({_count(report)})"])


def _print_terminal(report: lib.Report, verbose: bool) -> None:
    tell(headline(report), style="bold")
    by_section: dict[tuple[int, str], list[lib.Finding]] = {}
    others = []
    for finding in report.findings:
        if "section" in finding.place:
            key = (finding.place["section"], finding.place["section_title"])
            by_section.setdefault(key, []).append(finding)
        else:
            others.append(finding)
    controls = bool(report.context.get("controls"))
    for (number, title), findings in by_section.items():
        name = title if number == 10 else f"Section {number}. {title}"
        console().print(_table(name, findings, verbose, controls))
    for finding in others:
        tell(f"{finding.claim}: {finding.evidence.summary}")
    for method in dict.fromkeys(finding.evidence.method for finding in report.findings):
        if method in _LEGEND:
            tell(_LEGEND[method])
    for line in _below(report):
        tell(line)
    for note in report.notes:
        tell(f"note: {note}")
    tell(f"verdict\t{report.verdict}\t({_count(report)})", 9)


def _rows(finding: lib.Finding, verbose: bool) -> list[str]:
    """What is said of a finding, its formula first."""
    lines = [finding.formula or finding.claim]
    misprint = finding.place.get("misprint")
    if misprint:
        lines.append(f"misprint: {misprint}")
    if verbose:
        lines.append(finding.claim.split(": ", 1)[-1])
        lines += [f"{evidence.method}: {evidence.summary}" for evidence in (finding.evidence, *finding.also)]
    shows = finding.witness is not None and (verbose or not finding.control)
    if shows and finding.witness is not None:
        lines += witness_lines(finding.witness, NUMBER_WIDTH)
    return lines


def _table(name: str, findings: list[lib.Finding], verbose: bool, controls: bool) -> Table:
    from rich import box
    from rich.table import Table

    table = Table(
        title=name, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, show_lines=verbose, expand=True
    )
    table.add_column("statement", overflow="fold", min_width=17, max_width=19)
    table.add_column("formula", overflow="fold", ratio=1)
    table.add_column("broken" if controls else "how", overflow="fold", min_width=11, max_width=24 if controls else 14)
    table.add_column("verdict", no_wrap=True)
    for finding in findings:
        formula, *more = _rows(finding, verbose)
        verdict = f"{finding.verdict}\nas printed" if finding.place.get("misprint") else str(finding.verdict)
        is_broken = controls and "broken" in finding.place
        table.add_row(
            styled(finding.place["place"]),
            styled("\n  ".join([formula, *more])),
            styled(str(finding.place["broken"]) if is_broken else _how(finding.evidence)),
            styled(verdict, verdict_style(finding)),
        )
    return table


def _how(evidence: lib.Evidence) -> str:
    word = _HOW.get(evidence.method, evidence.method)
    bound: Any = evidence.data.get("error_bound")
    return f"{word}, {bound}" if bound else word


def _below(report: lib.Report) -> list[str]:
    """Sentences on the evidence beside the one that decided."""
    lines = []
    bounds = [
        int(str(evidence.data["error_bound"])[3:])
        for finding in report.findings
        for evidence in (finding.evidence, *finding.also)
        if "error_bound" in evidence.data
    ]
    if bounds:
        lines.append(
            f"also: {len(bounds)} claims held at random points over GF(p), "
            f"each false with probability below 2^-{min(bounds)}"
        )
    methods = Counter(e.method for f in report.findings for e in f.also if "error_bound" not in e.data)
    lines += [f"also: {count} claims: {method} (-v)" for method, count in methods.items()]
    refuted = [f for f in report.findings if str(f.verdict) == "refuted" and not f.control]
    lines += [f"refuted: {shorten(f.claim, 200)}" for f in refuted]
    return lines


def _count(report: lib.Report) -> str:
    counted = Counter(str(f.verdict) for f in report.findings if f.applies and not f.control)
    text = ", ".join(f"{number} {verdict}" for verdict, number in counted.items())
    misprints = sum(1 for f in report.findings if f.place.get("misprint"))
    return text + (f"; {misprints} misprints, refuted as printed" if misprints else "")
