"""kahanmaps analyze."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from kahanmaps_cli.options import (
    eps_options,
    load_system,
    output_options,
    seconds_option,
    seed_option,
    symbolic_option,
    system_options,
)
from kahanmaps_cli.progress import Progress
from kahanmaps_cli.render import print_json
from kahanmaps_cli.search import formula, symbols_and_eps
from kahanmaps_cli.terminal import echo, on_terminal, tell

if TYPE_CHECKING:
    from kahanmaps.laboratory.analysis import Analysis


@click.command("analyze")
@system_options
@eps_options
@symbolic_option
@seconds_option(None, "Time for everything (default: 16 to 150 by dimension).")
@seed_option
@click.option("--markdown", is_flag=True, help="The report in Markdown.")
@output_options
def command(system: str | None, markdown: bool, as_json: bool, quiet: bool, **options: Any) -> int:
    """What the map of SYSTEM preserves, and how it grows: one report, and a verdict in words.

    \b
      kahanmaps analyze euler_top --symbolic a1,a2,a3
      kahanmaps analyze henon_heiles -p c=-6 --seconds 30
      kahanmaps analyze my-system.toml --markdown > report.md
      kahanmaps analyze --rhs "x' = x*(1-y); y' = y*(x-1)" --json
      kahanmaps analyze --vars x,y --image 'y; -x + y + 7/y^2'

    SYSTEM is a vector field, which stands for its Kahan map, or any birational map (docs/system-files.md).
    Integrals and densities in closed form with their proofs, which integrals of the flow it keeps, deforms and loses,
    genus and base points of the curves of a planar integral, Hirota-Kimura relations, degrees of the iterates and their
    recurrence, heights, symmetries, commuting systems, singularity confinement, and whether the system belongs to the
    commuting family, in these or other affine coordinates. Claims in the file are not read. Without --eps everything is
    for every eps.

    proved, supported: formulas, as identities in x and eps. measured: modulo primes and along orbits, which is
    evidence. The number of integrals and the growth are separate findings.

    Exit status: 0 there is a verdict, 2 wrong use, 3 undecided.
    """
    from kahanmaps.laboratory.analysis import analyze

    if markdown and as_json:
        raise click.UsageError("give --markdown or --json, one of the two")
    symbols, eps = symbols_and_eps(options)
    file = load_system(system, options)
    with Progress(quiet) as progress:
        found = analyze(
            file, symbols=symbols, eps=eps, seconds=options["seconds"], seed=options["seed"], progress=progress
        )
    if as_json:
        print_json(found.to_json())
    elif markdown:
        _print_markdown(found)
    else:
        _print(found)
    return 3 if found.conclusion.kind == "undecided" else 0


def _title(found: Analysis) -> str:
    from kahanmaps.checks.settings import eps_record, eps_words

    step = eps_words(eps_record(found.eps, found.file.map))
    values = "".join(f", {name} = {value}" for name, value in found.file.parameters.items())
    formulas = f"; formulas for every {', '.join(found.symbols)}" if found.symbols else ""
    return f"{found.file.name}, dimension {found.dim}{values}{step}{formulas}"


def _print(found: Analysis) -> None:
    tell(f"analyze: {_title(found)}")
    for name, lines in found.sections:
        tell(f"\n{name}", style="bold")
        for line in lines:
            tell(f"{line.status}\t{formula(line.text)}")
    final = found.conclusion
    tell("\nverdict", style="bold")
    tell(final.sentence if on_terminal() else f"{final.kind}\t{final.sentence}", style="bold")


def _print_markdown(found: Analysis) -> None:
    from kahanmaps.display.markup import code, markdown

    lines = [f"# {markdown(_title(found))}", "", "```"]
    lines += [*str(found.file.map).split("\n"), "```", "", f"**{markdown(found.conclusion.sentence)}**", ""]
    for name, told in found.sections:
        lines += [f"## {name}", ""]
        lines += [f"* *{one.status}*: {(code if '=' in one.text else markdown)(one.text)}" for one in told]
        lines.append("")
    echo("\n".join(lines))
