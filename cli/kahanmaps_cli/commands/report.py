"""kahanmaps report."""

from __future__ import annotations

import sys
import time
from math import inf
from pathlib import Path
from typing import Any

import click

from kahanmaps_cli import library as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.pictures.output import PictureCommand, command_line
from kahanmaps_cli.runs.draw import DRAWN, draw_options, drawn_file
from kahanmaps_cli.screen.outputs import OutputFile
from kahanmaps_cli.screen.progress import Progress, say

_ONLY_FOR = {
    "symbolic": ("analyze",),
    "seconds": ("analyze",),
    "explore": ("analyze",),
    "sections": ("verify",),
    **dict.fromkeys(DRAWN, ("verify", "checks")),
}


@click.command("report", cls=PictureCommand)
@opt.system_options
@click.option(
    "--from",
    "source",
    type=click.Choice(["analyze", "verify", "checks"]),
    default="analyze",
    show_default=True,
    help="What the page is made of.",
)
@click.option("--explore", is_flag=True, help="A page with sliders: eps and the start of an orbit move.")
@opt.eps_options
@opt.symbolic_option
@opt.seconds_option(
    None,
    "Stop about then, pictures left out (default: 16 to 150 by dimension for the analysis).",
)
@opt.seed_option
@draw_options
@click.option("--section", "sections", type=int, multiple=True, metavar="N", help="With verify: only this section.")
@click.option(
    "-o",
    "--output",
    type=OutputFile(),
    default="-",
    show_default=True,
    metavar="FILE",
    help="FILE.html; - is standard output.",
)
@click.option("--title", help="The title of the page (default: the name of the system).")
@click.option("--no-pictures", is_flag=True, help="Formulas and tables only.")
@opt.quiet_option
def command(system: str | None, **options: Any) -> int:
    """One HTML page about SYSTEM or a member of the family, to be read, printed or sent.

    \b
      kahanmaps report euler_top -o top.html
      kahanmaps report henon_heiles -p c=-6 --seconds 30 -o hh.html
      kahanmaps report euler_top --explore -o explore.html
      kahanmaps report --from verify --m 2 -o paper.html

    analyze: what the map preserves and how it grows, the verdict first. verify: the paper's claims for a member of the
    family, section by section. checks: the four checks, those that apply. The page is one file with its pictures
    inside; it needs no network and no JavaScript, and says how it was made. Only --explore has JavaScript in it: eps
    and the start move by sliders, and the exact verdict stands beside the picture of the orbit. A verdict at one --eps
    leaves only the start to move.

    Exit status: as the command that the page is made of.
    """
    _require_consistent(system, options)
    if options["output"] == "-" and sys.stdout.isatty():
        raise click.UsageError("a terminal cannot show a page: give -o FILE.html")
    if options["explore"] and options["no_pictures"]:
        raise click.UsageError("found --explore and --no-pictures, expected one of the two: what moves is a picture")
    suffix = Path(options["output"]).suffix
    if suffix.lower() not in ("", ".html", ".htm", ".xhtml"):
        raise click.UsageError(f"found the ending {suffix} of {options['output']}, expected .html: a page is HTML")
    with Progress(options["quiet"]) as progress:
        html, status = _page(system, options, progress)
    _write(html, options)
    return status


def _require_consistent(system: str | None, options: dict[str, Any]) -> None:
    context = click.get_current_context()
    for name, sources in _ONLY_FOR.items():
        if _is_given(context, name) and options["source"] not in sources:
            raise click.UsageError(f"{_option_name(name)} is for --from {' or '.join(sources)}")
    drawn = [name for name in DRAWN if _is_given(context, name)]
    if drawn and (system is not None or options["variables"] or options["rhs"]):
        raise click.UsageError(f"give a system or say which member to draw ({_option_name(drawn[0])}), not both")
    no_system = system is None and not (options["variables"] or options["rhs"])
    if no_system and options["parameters"] and (drawn or options["source"] == "verify"):
        raise click.UsageError("found -p without SYSTEM: a member that is drawn has no parameters")


def _is_given(context: click.Context, name: str) -> bool:
    return context.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE


def _option_name(name: str) -> str:
    command = click.get_current_context().command
    return next(parameter.opts[0] for parameter in command.params if parameter.name == name)


def _write(html: str, options: dict[str, Any]) -> None:
    content = html.encode()
    if options["output"] == "-":
        sys.stdout.buffer.write(content)
        sys.stdout.buffer.flush()
        return
    lib.write_whole(options["output"], content)
    if not options["quiet"]:
        say(f"{options['output']}: {len(content)} bytes")


def _page(system: str | None, options: dict[str, Any], progress: Progress) -> tuple[str, int]:
    """The page, and the exit status."""
    how: dict[str, Any] = {
        "title": options["title"],
        "pictures": not options["no_pictures"],
        "command": command_line(),
    }
    if options["source"] == "analyze":
        return _analysis(system, options, progress, how)
    file = _system_or_member(system, options)
    eps = opt.the_eps(options["eps"], options["time_step"], required=False)
    settings = lib.Settings(eps=eps, seed=options["seed"], progress=progress)
    left_out: list[str] = []
    if options["source"] == "verify":
        reports = [lib.verify(file, settings, lib.VerifyOptions(options["sections"] or None))]
    else:
        reports, left_out = _checks(file, settings)
    progress("the page")
    return lib.report_html(reports, file=file, left_out=left_out, **how), _status(reports)


def _analysis(system: str | None, options: dict[str, Any], progress: Progress, how: dict[str, Any]) -> tuple[str, int]:
    from kahanmaps_cli.runs.search import symbols_and_eps

    symbols, eps = symbols_and_eps(options)
    file = opt.load_system(system, options)
    began = time.monotonic()
    found = lib.analyze(
        file, symbols=symbols, eps=eps, seconds=options["seconds"], seed=options["seed"], progress=progress, processes=2
    )
    progress("the page")
    until = inf if options["seconds"] is None else began + options["seconds"]
    return lib.report_html(
        found, explore=options["explore"], until=until, **how
    ), 3 if found.conclusion.kind == "undecided" else 0


def _system_or_member(system: str | None, options: dict[str, Any]) -> lib.SystemFile:
    """The system that is named; for verify, and where one is to be drawn, a member of the family."""
    is_drawn = any(options[name] is not None and options[name] is not False for name in DRAWN)
    named = system is not None or options["variables"] or options["rhs"]
    if named or not (is_drawn or options["source"] == "verify"):
        return opt.load_system(system, options)
    return drawn_file(options)


def _checks(file: lib.SystemFile, settings: lib.Settings) -> tuple[list[lib.Report], list[str]]:
    """The reports of the checks that apply, and a sentence for each that does not."""
    reports: list[lib.Report] = []
    left_out: list[str] = []
    for name, check in sorted(lib.CHECKS.items(), key=lambda named: named[1].is_of_pair):
        settings.progress(name)
        try:
            reports.append(check(file, None, settings) if check.is_of_pair else check(file, settings))
        except lib.InputError as error:
            left_out.append(f"{name} does not apply: {error}")
    if not reports:
        raise lib.InputError(f"no check applies to {file.name}: {'; '.join(left_out)}")
    return reports, left_out


def _status(reports: list[lib.Report]) -> int:
    verdict = lib.combined(report.verdict for report in reports)
    return {lib.Verdict.REFUTED: 1, lib.Verdict.UNDECIDED: 3}.get(verdict, 0)
