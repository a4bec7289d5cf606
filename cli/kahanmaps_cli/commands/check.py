"""kahanmaps check-commute, check-integrals, ...: one command for each row of kahanmaps/checks/table.py."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from inspect import cleandoc
from itertools import count
from typing import Any

import click

from kahanmaps.checks.table import CHECKS, Check, ClaimOption
from kahanmaps_cli import library as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.complete import complete_system
from kahanmaps_cli.params import ExactNumber
from kahanmaps_cli.screen.progress import Progress
from kahanmaps_cli.screen.render import print_report

_ARGUMENT_IS_FIRST = "kahanmaps: the argument stands before the inline system"
_STATUS = "Exit status: 0 {} (proved or supported), 1 refuted, 2 usage error, 3 undecided or stopped early."


def command(name: str) -> click.Command:
    """The command of a check."""
    check = CHECKS[name]

    def run(system: str | None, other: str | None = None, eps2: Any = None, claim: Any = None, **options: Any) -> int:
        swapped = False
        if check.is_of_pair:
            system, other = _pair(system, other, options)
            swapped = click.get_current_context().meta.get(_ARGUMENT_IS_FIRST, False)
        with Progress(options["quiet"]) as progress:
            if check.is_of_pair:
                pair, start = opt.load_with_start(options, partial(opt.load_pair, system, other), system, other)
                settings = opt.settings_from(options, progress, start)
                file, second = pair
                if swapped and second is not None:
                    file, second = second, file
                report = check(file, second, settings, eps2)
            else:
                file, start = opt.load_with_start(options, partial(opt.load_system, system), system)
                settings = opt.settings_from(options, progress, start)
                options_of_check = {}
                if check.claim is not None and check.claim.many:
                    options_of_check["known"] = ("", "known") in claim
                report = check(file, settings, _claimed(file, check.claim, claim), **options_of_check)
        return print_report(report, options["as_json"], options["verbose"], options["quiet"])

    run = opt.check_options(run)
    if check.is_of_pair:
        run = click.option(
            "--eps2", type=ExactNumber(), metavar="E", help="Another eps for the second map (needs --eps)."
        )(run)
        run = opt.inline_options(run)
        run = click.argument("other", required=False, shell_complete=complete_system)(run)
        run = opt.system_argument(run)
    else:
        run = _option(check.claim)(run) if check.claim is not None else run
        run = opt.system_options(run)
    kind = _PairCommand if check.is_of_pair else click.Command
    made: click.Command = click.command(name, cls=kind, help=_help(check))(run)
    return made


class _PairCommand(click.Command):
    """A command with an argument and an inline system, which are f and g in the order in which they are typed.

    click keeps the order of options, but takes arguments after all of them.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        flags = ("--vars", "--rhs", "--image", "--inverse")
        inline = next((k for k, word in enumerate(args) if word.partition("=")[0] in flags), len(args))
        if inline < len(args):
            before, _, _ = self.make_parser(ctx).parse_args(args[:inline])
            ctx.meta[_ARGUMENT_IS_FIRST] = isinstance(before.get("system"), str)
        return super().parse_args(ctx, args)


def _option(claim: ClaimOption) -> Any:
    if claim.many:
        return opt.integral_option(claim.help, claim.flag, "claim")
    kind = click.Path() if claim.metavar == "FILE" else None
    return click.option(claim.flag, "claim", type=kind, metavar=claim.metavar, help=claim.help)


def _help(check: Check) -> str:
    lines = [line for example in check.examples for line in f"kahanmaps {check.command} {example}".split("\n")]
    shown = [line if line.startswith("kahanmaps ") else f"    {line}" for line in lines]
    examples = "\n".join(["\b", *(f"  {line}" for line in shown)])
    return "\n\n".join([check.headline, examples, cleandoc(check.text), _STATUS.format(check.outcome)])


def _pair(system: str | None, other: str | None, options: dict[str, Any]) -> tuple[str | None, str | None]:
    """An inline system in the place of the first, and the argument as the second."""
    if opt.is_inline(options) and system is not None and other is None:
        system, other = None, system
    if system == other == "-":
        raise click.UsageError("found - twice, but standard input holds one system only")
    return system, other


def _claimed(file: lib.SystemFile, option: ClaimOption | None, claim: Any) -> Any:
    """What the check takes, from what was given on the line."""
    if option is None or not claim:
        return None
    if option.many:
        return {name: option.read(file, text) for name, text in _named(claim, file)} or None
    return option.read(file, claim)


def _named(claims: Sequence[tuple[str, str]], file: lib.SystemFile) -> list[tuple[str, str]]:
    """The claims but for the word known, with their names.

    An integral of the file keeps its name; others without one are called I1, I2, ..., as far as these are free.
    """
    of_file = {**file.integrals, **file.integrals_in_iterates}
    claims = [(name or text if text in of_file else name, text) for name, text in claims]
    claims = [claim for claim in claims if claim != ("", "known")]
    taken = [name for name, _ in claims if name]
    for name in taken:
        if taken.count(name) > 1:
            raise click.UsageError(f"found two integrals of the name {name}, expected a name of its own for each")
    free = (f"I{k}" for k in count(1) if f"I{k}" not in {*taken, *file.integrals})
    return [(name or next(free), text) for name, text in claims]
