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
from kahanmaps_cli.runs.certificates import certificate_option, require_every_eps, write_certificate
from kahanmaps_cli.screen.progress import Progress
from kahanmaps_cli.screen.render import print_report

_ARGUMENT_IS_FIRST = "kahanmaps: the argument stands before the inline system"
_STATUS = "Exit status: 0 {} (proved or supported), 1 refuted, 2 usage error, 3 undecided or stopped early."


def command(name: str) -> click.Command:
    """Return the command of a check."""
    check = CHECKS[name]

    def run(system: str | None, other: str | None = None, eps2: Any = None, claim: Any = None, **options: Any) -> int:
        is_swapped, measured = False, None
        require_every_eps(options)
        if check.is_of_pair:
            system, other = opt.in_order(system, other, options)
            is_swapped = click.get_current_context().meta.get(_ARGUMENT_IS_FIRST, False)
        with Progress(options["quiet"]) as progress:
            if check.is_of_pair:
                pair, start = opt.load_with_start(options, partial(opt.load_pair, system, other), system, other)
                file, second = pair
                if is_swapped and second is not None:
                    file, second = second, file
                if options["arithmetic"] == "float":
                    measured = _measured_commutator(file, second, start, eps2, options)
                    options |= {"start": None, "steps": None}  # `start` and `steps` concern only the float orbit
                settings = opt.settings_from(options, progress, options["start"] and start)
                report = check(file, second, settings, eps2)
            else:
                file, start = opt.load_with_start(options, partial(opt.load_system, system), system)
                settings = opt.settings_from(options, progress, start)
                option, extra = check.claim, dict[str, bool]()
                if option is not None and option.many:
                    extra["known"] = ("", "known") in claim
                    claim = {name: option.read(file, text) for name, text in _named(claim, file)} or None
                elif option is not None:
                    claim = option.read(file, claim) if claim else None
                report = check(file, settings, claim, **extra)
        status = print_report(report, options["as_json"], options["verbose"], options["quiet"], measured)
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
            metavar, of_path = check.claim.metavar, click.Path() if check.claim.metavar == "FILE" else None
            run = click.option(check.claim.flag, "claim", type=of_path, metavar=metavar, help=check.claim.help)(run)
        run = opt.system_options(run)
    kind = _PairCommand if check.is_of_pair else click.Command
    lines = [line for example in check.examples for line in f"kahanmaps {check.command} {example}".split("\n")]
    indented = [line if line.startswith("kahanmaps ") else f"    {line}" for line in lines]
    examples = "\n".join(["\b", *(f"  {line}" for line in indented)])
    help_text = "\n\n".join([check.headline, examples, cleandoc(check.text), _STATUS.format(check.outcome)])
    click_command: click.Command = click.command(name, cls=kind, help=help_text)(run)
    return click_command


def _measured_commutator(
    file: lib.SystemFile, second: lib.SystemFile | None, start: Any, eps2: Any, options: dict[str, Any]
) -> lib.Commutator:
    eps = opt.requested_eps(options["eps"], options["time_step"], required=False)
    if second is None or start is None or eps is None:
        raise click.UsageError("--arithmetic float needs OTHER, --start X and --eps E (or --time-step H)")
    if isinstance(start, lib.AlgebraicPoint):
        start = start.real_approximation()
    first, other = file.real_approximation, second.real_approximation
    steps, ratio = options["steps"], 1 if eps2 is None else eps2 / eps
    return lib.commutator(
        first.map, lib.match_variables(first, other)[0], eps, start, 1000 if steps is None else steps, ratio
    )


class _PairCommand(click.Command):
    """A command with an argument SYSTEM and an inline system: f is the system that is typed first, g the other one.

    click processes arguments after all options, so this class determines the order.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        flags = ("--vars", "--rhs", "--image", "--inverse")
        inline = next((k for k, word in enumerate(args) if word.partition("=")[0] in flags), len(args))
        if inline < len(args):
            before, _, _ = self.make_parser(ctx).parse_args(args[:inline])
            ctx.meta[_ARGUMENT_IS_FIRST] = isinstance(before.get("system"), str)
        return super().parse_args(ctx, args)


def _named(claims: Sequence[tuple[str, str]], file: lib.SystemFile) -> list[tuple[str, str]]:
    """Return the claims as pairs of a name and a text, without the word "known".

    An integral of the file has its name in the file. Other claims without a name are called I1, I2, ..., skipping names
    in use.
    """
    of_file = {**file.integrals, **file.integrals_in_iterates}
    claims = [(name or text if text in of_file else name, text) for name, text in claims]
    claims = [claim for claim in claims if claim != ("", "known")]
    taken = [name for name, _ in claims if name]
    for name in taken:
        if taken.count(name) > 1:
            raise click.UsageError(f"found two integrals of the name {name}, expected different names")
    free = (f"I{k}" for k in count(1) if f"I{k}" not in {*taken, *file.integrals})
    return [(name or next(free), text) for name, text in claims]
