"""Options that several commands share: where the system comes from, eps, how to check, how to print."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import click

from kahanmaps_cli.params import ExactNumber, NameValue, PointText

if TYPE_CHECKING:
    from kahanmaps.checks.settings import Settings
    from kahanmaps.systems.files import SystemFile

F = TypeVar("F", bound=Callable[..., Any])


def _stack(*decorators: Callable[[F], F]) -> Callable[[F], F]:
    def apply(function: F) -> F:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return apply


def _inline_options(parameter: NameValue, help_text: str) -> Callable[[F], F]:
    return _stack(
        click.option("--vars", "variables", metavar="X,Y,...", help="Inline system: its variables."),
        click.option("--rhs", multiple=True, metavar="EXPR", help="Inline system: one right-hand side a variable."),
        click.option("-p", "--parameter", "parameters", type=parameter, multiple=True, help=help_text),
    )


inline_options: Callable[[F], F] = _inline_options(NameValue(), "Set a parameter of the system.")

system_options: Callable[[F], F] = _stack(click.argument("system", required=False), inline_options)

# For commands about one prime, where -p 101 is natural: values without a name come under the name "".
system_or_prime_options: Callable[[F], F] = _stack(
    click.argument("system", required=False),
    _inline_options(NameValue(name_is_optional=True), "Set a parameter NAME=VALUE; a number alone is the prime."),
)

eps_options: Callable[[F], F] = _stack(
    click.option("--eps", type=ExactNumber(), help="The paper's epsilon, exact; the time step is 2 eps."),
    click.option("--time-step", type=ExactNumber(), help="The time step h = 2 eps, instead of --eps."),
)

output_options: Callable[[F], F] = _stack(
    click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output."),
    click.option("-q", "--quiet", is_flag=True, help="No progress and no talk on standard error."),
)

check_options: Callable[[F], F] = _stack(
    eps_options,
    click.option("--start", type=PointText(), help="Start of the exact orbit that is tried (default: a random one)."),
    click.option("--steps", type=int, help="Steps of that orbit (default 10)."),
    click.option("--seed", type=int, default=0, show_default=True, help="Seed of everything drawn at random."),
    click.option(
        "--error-bits",
        type=int,
        default=100,
        show_default=True,
        help="Random points until the probability of error is below 2^-BITS.",
    ),
    click.option("--max-digits", type=int, help="Digit budget of that orbit (default: by dimension)."),
    click.option("-v", "--verbose", is_flag=True, help="On a terminal: all evidence (a pipe always gets it)."),
    output_options,
)


def the_eps(eps: Any, time_step: Any, required: bool = True) -> Any:
    """eps from --eps or --time-step; None where neither is given and that is allowed."""
    if eps is not None and time_step is not None:
        raise click.UsageError("give --eps or --time-step, not both (the time step is 2 eps)")
    if time_step is not None:
        return time_step / 2
    if eps is None and required:
        raise click.UsageError("missing --eps E, or --time-step H (= 2 eps)")
    return eps


def load_system(
    reference: str | None, variables: str | None, rhs: Sequence[str], parameters: Sequence[tuple[str, str]]
) -> SystemFile:
    """The system that a command line names: a path, a catalogue name, `-` for standard input, or an inline system."""
    from kahanmaps.errors import InputError
    from kahanmaps.systems.catalog import load
    from kahanmaps.systems.files import MAX_FILE_BYTES, parse_system

    given = dict(parameters)
    if len(given) < len(parameters):
        twice = next(name for k, (name, _) in enumerate(parameters) if name in dict(parameters[:k]))
        raise click.UsageError(f"found -p {twice}=... twice, expected one value for each parameter")
    if variables is not None or rhs:
        if reference is not None:
            raise click.UsageError(f"give a SYSTEM ({reference}) or an inline one (--vars and --rhs), not both")
        if variables is None or not rhs:
            raise click.UsageError("an inline system needs both --vars X,Y,... and one --rhs EXPR for each variable")
        return parse_system(_inline_file(variables.split(","), rhs, given), "inline")
    if reference is None:
        raise click.UsageError(
            "missing SYSTEM: a file, a catalogue name ('kahanmaps systems' lists them), - for standard input, "
            "or an inline system: --vars x,y --rhs 'x*y' --rhs '-x^2'"
        )
    if reference == "-":
        text = sys.stdin.buffer.read(MAX_FILE_BYTES + 1)
        if not text.strip():
            raise InputError("found nothing on standard input, expected a system file")
        return parse_system(text, "standard input", given)
    return load(reference, given)


def _inline_file(variables: Sequence[str], rhs: Sequence[str], parameters: Mapping[str, str]) -> str:
    """The system file that an inline system abbreviates, so that the same rules hold for it."""

    def quoted(texts: Sequence[str]) -> str:  # JSON strings are TOML strings
        return json.dumps([text.strip() for text in texts], ensure_ascii=False)

    lines = [f"variables = {quoted(variables)}", "[system]", f"rhs = {quoted(rhs)}", "[parameters]"]
    lines += [f"{quoted([name])[1:-1]} = {quoted([value])[1:-1]}" for name, value in parameters.items()]
    return "\n".join(lines)


def settings_from(options: dict[str, Any], progress: Callable[[str], None]) -> Settings:
    """The settings of a check from the values of `check_options`."""
    from kahanmaps.checks.settings import Settings

    steps = options["steps"]
    digits = options["max_digits"]
    if digits is not None and digits < 1:
        raise click.UsageError(f"found --max-digits {digits}, expected at least 1")
    return Settings(
        eps=the_eps(options["eps"], options["time_step"], required=False),
        start=options["start"],
        steps=10 if steps is None else steps,
        seed=options["seed"],
        error_bits=options["error_bits"],
        max_digits=digits,
        orbit_is_asked=options["start"] is not None or steps is not None,
        progress=progress,
    )
