"""kahanmaps analyze."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.runs.search import symbols_and_eps
from kahanmaps_cli.screen.progress import SearchProgress, say
from kahanmaps_cli.screen.render import print_json
from kahanmaps_cli.screen.terminal import echo, formula, on_terminal, tell
from kahanmaps_cli.signals import INTERRUPTED


@click.command("analyze")
@opt.system_options
@opt.eps_options
@opt.symbolic_option
@opt.effort_options
@opt.seed_option
@click.option("--markdown", is_flag=True, help="The report in Markdown.")
@opt.output_options
def command(system: str | None, markdown: bool, as_json: bool, quiet: bool, **options: Any) -> int:
    """What the map of SYSTEM preserves, and how it grows: one report, and a verdict in words.

    \b
      kahanmaps analyze euler_top --symbolic a1,a2,a3
      kahanmaps analyze henon_heiles -p c=-6 --effort 3
      kahanmaps analyze euler_top -p 'a1 = root of t^2 - 2'
      kahanmaps analyze my-system.toml --markdown > report.md
      kahanmaps analyze --rhs "x' = x*(1-y); y' = y*(x-1)" --json
      kahanmaps analyze --vars x,y --image 'y; -x + y + 7/y^2'

    SYSTEM is a vector field, which stands for its Kahan map, or any birational map (docs/system-files.md).
    Fixed points with eigenvalues, and a system of the catalogue that an affine change of variables leads to.
    Integrals and densities in closed form with their proofs, which integrals of the flow it keeps, deforms and loses,
    genus and base points of the curves of a planar integral, Hirota-Kimura relations, degrees of the iterates and their
    recurrence, heights, symmetries and reversing ones, commuting systems, singularity confinement, and whether the
    system belongs to the commuting family, in these or other affine coordinates. Claims in the file are not read.
    Without --eps everything is for every eps.

    proved, supported: formulas, as identities in x and eps. measured: modulo primes and along orbits, which is
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
            lib.analyze(file, **asked, progress=search, on_result=report)
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
        echo("\n".join([*lines, found.work]))
    else:
        report.tell(found.sections)
        final = found.conclusion
        tell("\nverdict", style="bold")
        tell(final.sentence if on_terminal() else f"{final.kind}\t{final.sentence}", style="bold")
        tell(found.work)
    if search.is_over:
        return 3
    if found.interrupted:
        say("interrupted: the verdict rests on what was found so far")
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
            tell(lib.analysis_head(found))
        self.tell(found.final_sections)

    def tell(self, sections: Sequence[tuple[str, Sequence[lib.Statement]]]) -> None:
        """Print the sections that have not been printed yet."""
        if self.progress is not None and len(sections) > self._told:
            self.progress.clear()
        for name, lines in sections[self._told :]:
            tell(f"\n{name}", style="bold")
            for line in lines:
                tell(f"{line.status}\t{formula(line.text)}")
        self._told = max(self._told, len(sections))
        sys.stdout.flush()
