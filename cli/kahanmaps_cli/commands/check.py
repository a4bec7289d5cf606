"""kahanmaps check-commute, check-integrals, ...: one command for each row of kahanmaps/checks/table.py."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from inspect import cleandoc
from itertools import count
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps.checks.table import CHECKS
from kahanmaps_cli import options as opt
from kahanmaps_cli.complete import complete_system
from kahanmaps_cli.params import ExactNumber
from kahanmaps_cli.runs.certificates import certificate_option, refuse_certificate_with_eps, write_certificate
from kahanmaps_cli.screen.progress import Progress
from kahanmaps_cli.screen.render import print_report

_ARGUMENT_IS_FIRST = "kahanmaps: the argument stands before the inline system"
_EXIT_STATUSES = "Exit status: 0 {} (proved or supported), 1 refuted, 2 usage error, 3 undecided or stopped early."


def command(name: str) -> click.Command:
    """Return the command for the check called `name`."""
    check = CHECKS[name]

    def run(system: str | None, other: str | None = None, eps2: Any = None, claim: Any = None, **options: Any) -> int:
        is_swapped, commutator = False, None
        refuse_certificate_with_eps(options)
        if check.is_of_pair:
            system, other = opt.in_order(system, other, options)
            is_swapped = click.get_current_context().meta.get(_ARGUMENT_IS_FIRST, False)
        with Progress(options["quiet"]) as progress:
            if check.is_of_pair:
                pair, start = opt.load_with_start(options, partial(opt.load_pair, system, other), system, other)
                file, second_file = pair
                if is_swapped and second_file is not None:
                    file, second_file = second_file, file
                if options["arithmetic"] == "float":
                    eps = opt.requested_eps(options["eps"], options["time_step"], required=False)
                    if second_file is None or start is None or eps is None:
                        raise click.UsageError(
                            "--arithmetic float needs OTHER, --start X and --eps E (or --time-step H)"
                        )
                    initial_point = start.real_approximation() if isinstance(start, lib.AlgebraicPoint) else start
                    f, g = file.real_approximation, second_file.real_approximation
                    steps = 1000 if options["steps"] is None else options["steps"]
                    eps_ratio = 1 if eps2 is None else eps2 / eps
                    g_map = lib.match_variables(f, g)[0]
                    commutator = lib.commutator(f.map, g_map, eps, initial_point, steps, eps_ratio)
                    options |= {"start": None, "steps": None}  # both options concern only the commutator
                settings = opt.settings_from(options, progress, options["start"] and start)
                report = check(file, second_file, settings, eps2)
            else:
                file, start = opt.load_with_start(options, partial(opt.load_system, system), system)
                settings = opt.settings_from(options, progress, start)
                option, check_options = check.claim, dict[str, bool]()
                if option is not None and option.many:
                    check_options["known"] = ("", "known") in claim
                    claim = {name: option.read(file, text) for name, text in _name_claims(claim, file)} or None
                elif option is not None:
                    claim = option.read(file, claim) if claim else None
                report = check(file, settings, claim, **check_options)
        status = print_report(report, options["as_json"], options["verbose"], options["quiet"], commutator)
        return write_certificate(options, file.name, report.certificate, status)

    run = opt.check_options(certificate_option(run))
    if check.is_of_pair:
        run = click.option(
            "--eps2",
            type=ExactNumber(),
            metavar="E",
            help="Half the time step of the second map (needs --eps; default: the same).",
        )(run)
        run = click.option(
            "--arithmetic",
            type=click.Choice(("exact", "float")),
            default="exact",
            show_default=True,
            help="float: also measure the commutator along the float orbit of --start, for --steps steps (default "
            "1000), and for smaller eps.",
        )(run)
        run = opt.inline_options(run)
        run = click.argument("other", required=False, shell_complete=complete_system)(run)
        run = opt.system_argument(run)
    else:
        if check.claim is not None and check.claim.many:
            run = opt.integral_option(check.claim.help, check.claim.flag, "claim")(run)
        elif check.claim is not None:
            metavar, path_type = check.claim.metavar, click.Path() if check.claim.metavar == "FILE" else None
            run = click.option(check.claim.flag, "claim", type=path_type, metavar=metavar, help=check.claim.help)(run)
        run = opt.system_options(run)
    kind = _PairCommand if check.is_of_pair else click.Command
    lines = [line for example in check.examples for line in f"kahanmaps {check.command} {example}".split("\n")]
    indented = [line if line.startswith("kahanmaps ") else f"    {line}" for line in lines]
    examples = "\n".join(["\b", *(f"  {line}" for line in indented)])
    help_text = "\n\n".join([check.headline, examples, cleandoc(check.text), _EXIT_STATUSES.format(check.outcome)])
    click_command: click.Command = click.command(name, cls=kind, help=help_text)(run)
    return click_command


class _PairCommand(click.Command):
    """A command with an argument SYSTEM and an inline system: f is whichever is typed first, g the other one.

    click processes arguments after all options, so its own parsing does not tell which of the two was typed first.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        flags = ("--vars", "--rhs", "--image", "--inverse")
        inline_index = next((k for k, word in enumerate(args) if word.partition("=")[0] in flags), len(args))
        if inline_index < len(args):
            parsed, _, _ = self.make_parser(ctx).parse_args(args[:inline_index])
            ctx.meta[_ARGUMENT_IS_FIRST] = isinstance(parsed.get("system"), str)
        return super().parse_args(ctx, args)


def _name_claims(claims: Sequence[tuple[str, str]], file: lib.SystemFile) -> list[tuple[str, str]]:
    """Return the pairs (name, text) of --integral with every name filled in, and without the request "known".

    A claim whose text is the name of an integral of the file gets this name. Any other claim without a name gets the
    first unused name among I1, I2, ...
    """
    file_integrals = {**file.integrals, **file.integrals_in_iterates}
    claims = [(name or text if text in file_integrals else name, text) for name, text in claims]
    claims = [claim for claim in claims if claim != ("", "known")]
    used_names = [name for name, _ in claims if name]
    for name in used_names:
        if used_names.count(name) > 1:
            raise click.UsageError(f"found two integrals of the name {name}, expected different names")
    unused_names = (f"I{k}" for k in count(1) if f"I{k}" not in {*used_names, *file.integrals})
    return [(name or next(unused_names), text) for name, text in claims]
