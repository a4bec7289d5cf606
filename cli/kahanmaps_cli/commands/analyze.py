"""kahanmaps analyze."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.runs.certificates import certificate_option, refuse_certificate_with_eps, write_certificate
from kahanmaps_cli.runs.search import symbols_and_eps
from kahanmaps_cli.screen.progress import SearchProgress, print_stderr
from kahanmaps_cli.screen.render import print_json
from kahanmaps_cli.screen.terminal import abbreviated, on_terminal, print_raw, print_stdout
from kahanmaps_cli.signals import INTERRUPTED, end_interrupts


@click.command("analyze")
@opt.system_options
@opt.eps_options
@opt.symbolic_option
@opt.effort_options
@opt.seed_option
@click.option("--markdown", is_flag=True, help="Print the report in Markdown.")
@certificate_option
@opt.output_options
def command(system: str | None, markdown: bool, as_json: bool, quiet: bool, **options: Any) -> int:
    """Analyze the map of SYSTEM: what it preserves, how fast its iterates grow in complexity, and a verdict.

    \b
      kahanmaps analyze euler_top --symbolic a1,a2,a3
      kahanmaps analyze henon_heiles -p c=-6 --effort 3
      kahanmaps analyze euler_top -p 'a1 = root of t^2 - 2'
      kahanmaps analyze my-system.toml --markdown > report.md
      kahanmaps analyze --rhs "x' = x*(1-y); y' = y*(x-1)" --json
      kahanmaps analyze --vars x,y --image 'y; -x + y + 7/y^2'

    SYSTEM is a vector field, which stands for its Kahan map, or any birational map (docs/system-files.md). The report
    has fixed points with their eigenvalues; a catalogue system that is affinely equivalent; formulas of integrals and
    densities with their proofs; which integrals of the flow the map conserves, deforms or loses; genus and base points
    of the curves of a planar integral; Hirota-Kimura relations; degrees of the iterates with their recurrence; heights;
    symmetries and reversing symmetries; commuting systems; singularity confinement; and whether the system belongs to
    the commuting family, in these or other affine coordinates. Claims in the file are ignored. Without --eps all
    results hold for every eps.

    Each statement begins with its status. Formulas are "proved" or "supported" as identities in x and eps. A growth of
    degrees is "derived" if it follows from the measured singularity patterns. What was computed modulo primes or along
    orbits is "measured", which is evidence and no proof. The number of integrals and the growth of degrees are computed
    separately, neither from the other.

    Exit status: 0 the verdict is decided, 2 usage error, 3 undecided.
    """
    if markdown and as_json:
        raise click.UsageError("give --markdown or --json, one of the two")
    refuse_certificate_with_eps(options)
    symbols, eps = symbols_and_eps(options)
    arguments = {"symbols": symbols, "eps": eps, **opt.pick(options, "effort", "seed"), "processes": 2}
    file = opt.load_system(system, {**options, "quiet": quiet})
    report = _ReportPrinter(as_json or markdown)
    with SearchProgress({**options, "quiet": quiet}) as search:
        report.progress = search
        try:
            lib.analyze(file, **arguments, progress=search, on_result=report)
        except KeyboardInterrupt:
            end_interrupts()
            if report.result is None:
                raise
            report.result.interrupt("stopped (--seconds)" if search.is_over else "interrupted")
    result = report.result
    assert result is not None
    if as_json:
        print_json(result.to_json())
    elif markdown:
        lines = [f"# {lib.markdown(lib.analysis_title(result))}", "", "```"]
        lines += [*str(result.file.map).split("\n"), "```", "", f"**{lib.markdown(result.conclusion.sentence)}**", ""]
        for title, statements in result.sections:
            lines += [f"## {title}", ""]
            for statement in statements:
                text = (lib.code if "=" in statement.text else lib.markdown)(statement.text)
                lines.append(f"* *{statement.status}*: {text}")
            lines.append("")
        print_raw("\n".join([*lines, result.work]))
    else:
        report.print_new(result.sections)
        verdict = result.conclusion
        print_stdout("\nverdict", style="bold")
        print_stdout(verdict.sentence if on_terminal() else f"{verdict.kind}\t{verdict.sentence}", style="bold")
        print_stdout(result.work)
    if search.is_over:
        return 3
    if result.interrupted:
        print_stderr("interrupted: the verdict rests on the results so far")
        return INTERRUPTED
    status = 3 if result.conclusion.kind == "undecided" else 0
    return write_certificate({**options, "quiet": quiet}, file.name, result.certificate, status)


class _ReportPrinter:
    """Print each section of the report as soon as it is final; print nothing if `is_silent` (for JSON or Markdown)."""

    def __init__(self, is_silent: bool) -> None:
        self.result: lib.Analysis | None = None
        self.progress: SearchProgress | None = None
        self._is_silent, self._printed_count = is_silent, 0

    def __call__(self, result: lib.Analysis) -> None:
        is_first, self.result = self.result is None, result
        if self._is_silent:
            return
        if is_first:
            print_stdout(lib.analysis_head(result))
        self.print_new(result.final_sections)

    def print_new(self, sections: Sequence[tuple[str, Sequence[lib.Statement]]]) -> None:
        """Print the sections that have not been printed yet."""
        if self.progress is not None and len(sections) > self._printed_count:
            self.progress.clear()
        for name, lines in sections[self._printed_count :]:
            print_stdout(f"\n{name}", style="bold")
            for line in lines:
                print_stdout(f"{line.status}\t{abbreviated(line.text)}")
        self._printed_count = max(self._printed_count, len(sections))
        sys.stdout.flush()
