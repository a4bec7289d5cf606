"""kahanmaps analyze."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.runs.search import symbols_and_eps
from kahanmaps_cli.screen.progress import SearchProgress, print_stderr
from kahanmaps_cli.screen.render import print_json
from kahanmaps_cli.screen.terminal import formula, on_terminal, print_raw, print_stdout
from kahanmaps_cli.signals import INTERRUPTED


@click.command("analyze")
@opt.system_options
@opt.eps_options
@opt.symbolic_option
@opt.effort_options
@opt.seed_option
@click.option("--markdown", is_flag=True, help="Print the report in Markdown.")
@opt.output_options
def command(system: str | None, markdown: bool, as_json: bool, quiet: bool, **options: Any) -> int:
    """Analyze the map of SYSTEM: report what it preserves, how it grows, and a verdict on integrability.

    \b
      kahanmaps analyze euler_top --symbolic a1,a2,a3
      kahanmaps analyze henon_heiles -p c=-6 --effort 3
      kahanmaps analyze euler_top -p 'a1 = root of t^2 - 2'
      kahanmaps analyze my-system.toml --markdown > report.md
      kahanmaps analyze --rhs "x' = x*(1-y); y' = y*(x-1)" --json
      kahanmaps analyze --vars x,y --image 'y; -x + y + 7/y^2'

    SYSTEM is a vector field, which stands for its Kahan map, or any birational map (docs/system-files.md). The report
    contains fixed points with eigenvalues; an affinely equivalent system of the catalogue; integrals and densities with
    proofs; the integrals of the flow that the map keeps, deforms or loses; genus and base points of the curves of a
    planar integral; Hirota-Kimura relations; degrees of the iterates and their recurrence; heights; symmetries and
    reversing symmetries; commuting systems; singularity confinement; and membership in the commuting family. Claims in
    the file are not used. Without --eps the results hold for every eps.

    Formulas are proved or supported as identities in x and eps. Results measured modulo primes and along orbits are
    evidence. The number of integrals and the growth are separate findings.

    Exit status: 0 there is a verdict, 2 usage error, 3 undecided.
    """
    if markdown and as_json:
        raise click.UsageError("give --markdown or --json, one of the two")
    symbols, eps = symbols_and_eps(options)
    asked = {"symbols": symbols, "eps": eps, **opt.given(options, "effort", "seed"), "processes": 2}
    file = opt.load_system(system, {**options, "quiet": quiet})
    report = _Report(as_json or markdown)
    with SearchProgress({**options, "quiet": quiet}) as search:
        report.progress = search
        try:
            lib.analyze(file, **asked, progress=search, reached=report)
        except KeyboardInterrupt:
            if report.found is None:
                raise
            report.found.interrupt("stopped (--seconds)" if search.is_over else "interrupted")
    found = report.found
    assert found is not None
    if as_json:
        print_json(found.to_json())
    elif markdown:
        lines = [f"# {lib.markdown(lib.analysis_title(found))}", "", "```"]
        lines += [*str(found.file.map).split("\n"), "```", "", f"**{lib.markdown(found.conclusion.sentence)}**", ""]
        for name, told in found.sections:
            lines += [f"## {name}", ""]
            lines += [f"* *{one.status}*: {(lib.code if '=' in one.text else lib.markdown)(one.text)}" for one in told]
            lines.append("")
        print_raw("\n".join([*lines, found.work]))
    else:
        report.print_new(found.sections)
        final = found.conclusion
        print_stdout("\nverdict", style="bold")
        print_stdout(final.sentence if on_terminal() else f"{final.kind}\t{final.sentence}", style="bold")
        print_stdout(found.work)
    if search.is_over:
        return 3
    if found.interrupted:
        print_stderr("interrupted: the verdict rests on what was found so far")
        return INTERRUPTED
    return 3 if found.conclusion.kind == "undecided" else 0


class _Report:
    """The report as text, each section as soon as it is final; `is_silent` keeps it back for another form."""

    def __init__(self, is_silent: bool) -> None:
        self.found: lib.Analysis | None = None
        self.progress: SearchProgress | None = None
        self._is_silent, self._told = is_silent, 0

    def __call__(self, found: lib.Analysis) -> None:
        begins, self.found = self.found is None, found
        if self._is_silent:
            return
        if begins:
            print_stdout(lib.analysis_head(found))
        self.print_new(found.final_sections)

    def print_new(self, sections: Sequence[tuple[str, Sequence[lib.Statement]]]) -> None:
        """Print the sections that have not been printed yet."""
        if self.progress is not None and len(sections) > self._told:
            self.progress.clear()
        for name, lines in sections[self._told :]:
            print_stdout(f"\n{name}", style="bold")
            for line in lines:
                print_stdout(f"{line.status}\t{formula(line.text)}")
        self._told = max(self._told, len(sections))
        sys.stdout.flush()
