"""kahanmaps report."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.commands.family import MEMBER_OPTIONS, random_member_file, random_member_options
from kahanmaps_cli.params import Section
from kahanmaps_cli.pictures.output import PictureCommand, command_line
from kahanmaps_cli.runs.certificates import certificate_option, refuse_certificate_with_eps, write_certificate
from kahanmaps_cli.screen.outputs import OutputFile, deliver
from kahanmaps_cli.screen.progress import SearchProgress, print_stderr

_SOURCES_OF_OPTIONS = {
    "symbolic": ("analyze",),
    "effort": ("analyze",),
    "seconds": ("analyze",),
    "explore": ("analyze",),
    "sections": ("verify",),
    **dict.fromkeys(MEMBER_OPTIONS, ("verify", "checks")),
}


@click.command("report", cls=PictureCommand)
@opt.system_options
@click.option(
    "--from",
    "source",
    type=click.Choice(["analyze", "verify", "checks"]),
    default="analyze",
    show_default=True,
    help="The command whose results the page shows (checks: all check-... that apply).",
)
@click.option("--explore", is_flag=True, help="Add sliders for eps and the initial point of an orbit (JavaScript).")
@opt.eps_options
@opt.symbolic_option
@opt.effort_options
@opt.seed_option
@random_member_options
@click.option(
    "--section",
    "sections",
    type=Section(),
    multiple=True,
    metavar="N",
    help="With verify: only this section. Repeatable.",
)
@click.option(
    "-o",
    "--output",
    type=OutputFile(),
    default="-",
    show_default=True,
    metavar="FILE",
    help="Output file FILE.html; - is standard output.",
)
@certificate_option
@click.option("--title", help="Title of the page (default: the name of the system).")
@click.option("--no-pictures", is_flag=True, help="Omit pictures.")
@opt.quiet_option
def command(system: str | None, **options: Any) -> int:
    """Write an HTML page about SYSTEM or a member of the family.

    \b
      kahanmaps report euler_top -o top.html
      kahanmaps report henon_heiles -p c=-6 --effort 3 -o hh.html
      kahanmaps report euler_top --explore -o explore.html
      kahanmaps report --from verify --m 2 -o paper.html

    --from analyze shows the results of `analyze`: the verdict, what the map preserves, and how fast its iterates grow
    in complexity. --from verify shows the claims of the paper for a member of the family, by sections. --from checks
    shows the results of the checks that apply to the system. The page is a single file with its pictures and the
    command that made it; it needs neither network nor JavaScript. With --explore it has sliders for eps and the initial
    point beside the exact verdict; with --eps given, only for the initial point.

    --certificate FILE also writes the proofs of `kahanmaps certificate --all`, and the page links to FILE.

    The exit status is that of the command named by --from.
    """
    is_named, is_random = _require_consistent(system, options)
    refuse_certificate_with_eps(options)
    lib.page_template()  # raises InputError before the computation if the package for HTML pages is missing
    page_options = {"title": options["title"], "pictures": not options["no_pictures"], "command": command_line()}
    with SearchProgress(options) as search:
        if options["source"] == "analyze":
            from kahanmaps_cli.runs.search import symbols_and_eps

            symbols, eps = symbols_and_eps(options)
            arguments = {"symbols": symbols, "eps": eps, **opt.pick(options, "effort", "seed"), "processes": 2}
            results: list[lib.Analysis] = []
            try:
                file = opt.load_system(system, options)
                lib.analyze(file, **arguments, progress=search, on_result=results.append)
                page_options["certificate"] = _write_certificate(file, options)
                search("the page")
                html = lib.report_html(results[-1], explore=options["explore"], **page_options)
            except lib.TimeLimit:
                if not results:
                    raise
                results[-1].interrupt("stopped (--seconds)")
                html = lib.report_html(results[-1], **{**page_options, "pictures": False}, left_out=[search.ending])
            status = 3 if search.is_over or results[-1].conclusion.kind == "undecided" else 0
        else:
            # Without SYSTEM, --from verify and the options of a random member refer to a random member of the family.
            needs_random_member = not is_named and (is_random or options["source"] == "verify")
            file = random_member_file(options) if needs_random_member else opt.load_system(system, options)
            eps = opt.requested_eps(options["eps"], options["time_step"], required=False)
            settings = lib.Settings(eps=eps, seed=options["seed"], progress=search)
            left_out: list[str] = []
            if options["source"] == "verify":
                reports = [lib.verify(file, settings, lib.VerifyOptions(options["sections"] or None))]
            else:
                reports = []
                for name, check in sorted(lib.CHECKS.items(), key=lambda item: item[1].is_of_pair):
                    search(name)
                    try:
                        reports.append(check(file, None, settings) if check.is_of_pair else check(file, settings))
                    except lib.InputError as error:
                        left_out.append(f"{name} does not apply: {error}")
                if not reports:
                    raise lib.InputError(f"no check applies to {file.name}: {'; '.join(left_out)}")
            page_options["certificate"] = _write_certificate(file, options)
            search("the page")
            html = lib.report_html(reports, file=file, left_out=left_out, **page_options)
            verdict = lib.combined(report.verdict for report in reports)
            status = {lib.Certainty.REFUTED: 1, lib.Certainty.UNDECIDED: 3}.get(verdict, 0)
    content = html.encode()
    if deliver(options["output"], content) and not options["quiet"]:
        print_stderr(f"{options['output']}: {len(content)} bytes")
    return status


def _write_certificate(file: lib.SystemFile, options: dict[str, Any]) -> str:
    """Write the certificate of all claims if requested; return its path relative to the page, else an empty text."""
    path, page = options["certificate"], options["output"]
    if write_certificate(options, file.name, lambda checker: lib.certificate(file, checker, everything=True)):
        return ""
    return "" if path is None else os.path.relpath(path, os.path.dirname(page) or ".").replace(os.sep, "/")


def _require_consistent(system: str | None, options: dict[str, Any]) -> tuple[bool, bool]:
    """Return whether a system is given, and whether a random member is requested; refuse contradictory options."""
    context = click.get_current_context()
    names = {parameter.name: parameter.opts[0] for parameter in context.command.params}
    typed_options = [
        name
        for name in names
        if name is not None and context.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE
    ]
    for name, sources in _SOURCES_OF_OPTIONS.items():
        if name in typed_options and options["source"] not in sources:
            raise click.UsageError(f"{names[name]} is for --from {' or '.join(sources)}")
    member_options = [name for name in MEMBER_OPTIONS if name in typed_options]
    is_named = system is not None or bool(options["variables"] or options["rhs"])
    if member_options and is_named:
        raise click.UsageError(f"give a SYSTEM or options of a random member ({names[member_options[0]]}), not both")
    if not is_named and options["parameters"] and (member_options or options["source"] == "verify"):
        raise click.UsageError("found -p without SYSTEM, expected a SYSTEM: a random member has no parameters")
    if options["output"] == "-" and sys.stdout.isatty():
        raise click.UsageError("the output is an HTML page: give -o FILE.html, or redirect it")
    if options["explore"] and options["no_pictures"]:
        raise click.UsageError("give --explore or --no-pictures, not both")
    suffix = Path(options["output"]).suffix
    if suffix.lower() not in ("", ".html", ".htm", ".xhtml"):
        raise click.UsageError(f"found the extension {suffix} of {options['output']}, expected .html")
    return is_named, any(options[name] is not None and options[name] is not False for name in MEMBER_OPTIONS)
