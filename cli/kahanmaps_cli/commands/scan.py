"""kahanmaps scan."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli.options import output_options
from kahanmaps_cli.runs.scan_run import ending, run_scan, scan_options
from kahanmaps_cli.screen.outputs import OutputFolder, file_name, will_write
from kahanmaps_cli.screen.progress import print_stderr
from kahanmaps_cli.screen.render import print_json, record_of
from kahanmaps_cli.screen.terminal import print_stdout


@click.command("scan")
@scan_options
@click.option(
    "--analyze",
    "analysis",
    type=click.IntRange(lib.LEAST_EFFORT, lib.MOST_EFFORT),
    metavar="E",
    help="Also analyze a member of each component without exponential growth, of points with equal degrees only one.",
)
@click.option("--toml", "as_toml", is_flag=True, help="Print a member of each component as a system file.")
@click.option(
    "--write-to",
    "folder",
    type=OutputFolder(),
    metavar="DIR",
    help="Write these system files to DIR; those of an earlier scan are replaced.",
)
@output_options
def command(system: str | None, as_json: bool, quiet: bool, **options: Any) -> int:
    """Which members of a family are integrable: where in parameter space degrees grow more slowly.

    \b
      kahanmaps scan henon_heiles --over c
      kahanmaps scan zhukovski_volterra_2 --over b1,b2
      kahanmaps scan --rhs "x' = x*(a*x+y); y' = y*(x+b*y)" --over a,b
      kahanmaps scan zhukovski_volterra_2 --over a1,a2 --analyze -1 --write-to out
      kahanmaps scan lorenz --over s,b,r --effort 3

    The degrees of the first iterates are measured for all members with parameters in GF(p), for several small primes p.
    Members with smaller degrees than a generic member are special. They form points, lines, curves and surfaces; those
    that appear modulo all primes are lifted to conditions over Q. A condition is confirmed if random members that
    satisfy it have these degrees, computed as in `degrees`; the growth beside a condition is that of one rational
    member that satisfies it. All this is evidence, and no proof.

    With two or three parameters, members on random lines of parameter space are tried as well, modulo primes at which
    many quadratic fields split: there a^2 - 2 = 0 has two solutions, and is found as one condition. The effort limits
    the whole scan; the output lists what was not done.

    Without --eps the conditions hold for every eps; with eps among the parameters they may contain it. With more than
    three parameters, only members on random lines and planes of parameter space are tried. This finds conditions of
    codimension 1, and of codimension 2 where at least one of two equations is linear. The output says what may
    have been missed.

    Exit status: 0 completed, with or without conditions; 2 usage error; 3 the work limit was reached, and what was not
    done is reported; 130 interrupted, with the results up to then.
    """
    if as_json and options["as_toml"]:
        raise click.UsageError("give --toml or --json, not both")
    result, search = run_scan(system, quiet, options)
    member_components = [component for component in result.components if component.values is not None]
    if options["folder"] is not None:
        folder, name = Path(options["folder"]), file_name(result.file.name)
        paths = [folder / f"{name}-{k}.toml" for k in range(1, len(member_components) + 1)]
        folder.mkdir(parents=True, exist_ok=True)
        earlier_paths = {path for path in folder.iterdir() if re.fullmatch(rf"{re.escape(name)}-\d+\.toml", path.name)}
        for path in earlier_paths.union(paths):
            will_write(str(path))
        for path in earlier_paths.difference(paths):
            path.unlink()
        for path, component in zip(paths, member_components, strict=True):
            lib.write_atomically(str(path), result.member(component).to_toml().encode())
        if not quiet:
            print_stderr(f"{options['folder']}: {len(member_components)} system files")
    if options["as_toml"]:
        for component in member_components:
            click.echo(f"# {component.text}\n{result.member(component).to_toml()}")
    elif as_json:
        entries = {**lib.eps_record(result.eps, result.file.map), **search.work, **result.to_json()}
        print_json(record_of("scan", result.file, "modulo primes", **entries))
    else:
        at_eps = "" if "eps" in result.over else lib.eps_suffix(result.eps, result.file.map)
        print_stdout(f"# scan: {result.file.name} over {', '.join(result.over)}{at_eps}")
        print_stdout(result.text)
    return ending(result, search)
