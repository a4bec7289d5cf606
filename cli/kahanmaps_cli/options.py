"""Options that several commands share: where the system comes from, eps, how to check, how to print."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import click

from kahanmaps import internals as lib
from kahanmaps_cli.complete import complete_system
from kahanmaps_cli.groups import close_to
from kahanmaps_cli.params import ExactNumber, NameValue, PointText, Seconds, Whole
from kahanmaps_cli.screen.progress import say

F = TypeVar("F", bound=Callable[..., Any])


def stack(*decorators: Callable[[F], F]) -> Callable[[F], F]:
    def apply(function: F) -> F:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return apply


class Renamed(click.Option):
    """An option whose help shows its first name only: the others are old ones, which scripts may use."""

    old_names = True

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        names, self.opts = self.opts, self.opts[:1]
        try:
            return super().get_help_record(ctx)
        finally:
            self.opts = names

    def get_error_hint(self, ctx: click.Context | None) -> str:
        return f"'{self.opts[0]}'"


system_argument: Callable[[F], F] = click.argument("system", required=False, shell_complete=complete_system)


def _one_pair_each(ctx: click.Context, param: click.Parameter, pairs: Sequence[tuple[str, str]]) -> Any:
    """The pairs NAME=VALUE of all -p, of which one may hold several: -p a=1,b=2."""
    found = []
    for name, value in pairs:
        head, *more = value.split(",")
        for piece in more:
            if "=" in piece:
                found.append((name, head.strip()))
                name, head = (side.strip() for side in piece.split("=", 1))
            else:
                head += f",{piece}"
        found.append((name, head.strip()))
    if not all(value and name.isprintable() for name, value in found):
        raise click.BadParameter("found a name without a value, expected NAME=VALUE", ctx, param)
    return tuple(found)


parameter_option: Callable[[F], F] = click.option(
    "-p",
    "--parameter",
    "parameters",
    type=NameValue(),
    multiple=True,
    metavar="NAME=VALUE",
    callback=_one_pair_each,
    help="Set parameters of the system: a=2/3 or a=1,b=2; a='root of t^2 - 2', a='sqrt(2)' for orbit, degrees and "
    "checks.",
)

inline_options: Callable[[F], F] = stack(
    click.option("--vars", "variables", metavar="X,Y,...", help="Inline system: its variables."),
    click.option(
        "--rhs", multiple=True, metavar="EXPR", help="Inline system: a right-hand side, or \"x' = x*y; y' = -x\"."
    ),
    click.option("--image", multiple=True, metavar="EXPR", help="Inline map: a function for each variable."),
    click.option("--inverse", multiple=True, metavar="EXPR", help="Inline map: a function of the inverse map."),
    parameter_option,
)

system_options: Callable[[F], F] = stack(system_argument, inline_options)

_EPS_HELP = "The paper's epsilon, exact; the time step is 2 eps."
_TIME_STEP_HELP = "The time step h = 2 eps, instead of --eps."

eps_options: Callable[[F], F] = stack(
    click.option("--eps", type=ExactNumber(), metavar="E", help=_EPS_HELP),
    click.option("--time-step", type=ExactNumber(), metavar="H", help=_TIME_STEP_HELP),
)

several_eps_options: Callable[[F], F] = stack(
    click.option("--eps", type=ExactNumber(), multiple=True, metavar="E", help=f"{_EPS_HELP} Repeatable."),
    click.option("--time-step", type=ExactNumber(), multiple=True, metavar="H", help=f"{_TIME_STEP_HELP} Repeatable."),
)

json_option: Callable[[F], F] = click.option(
    "--json", "as_json", is_flag=True, help="One JSON object on standard output."
)
quiet_option: Callable[[F], F] = click.option(
    "-q", "--quiet", is_flag=True, help="No progress or messages on standard error."
)
output_options: Callable[[F], F] = stack(json_option, quiet_option)

seed_option: Callable[[F], F] = click.option(
    "--seed", type=Whole(), metavar="S", default=0, show_default=True, help="Seed of everything drawn at random."
)

random_starts_options: Callable[[F], F] = stack(
    click.option(
        "--starts",
        type=click.Path(),
        metavar="FILE",
        help="One point a line (text, csv) or a row (.npy); - standard input.",
    ),
    click.option("--random", "count", type=Whole(1), metavar="N", help="Instead: N starts drawn at random."),
    click.option("--box", type=ExactNumber(), metavar="R", help="... with coordinates from -R to R (default 1)."),
    click.option("--seed", type=Whole(), metavar="S", help="... with this seed (default 0)."),
)

symbolic_option: Callable[[F], F] = click.option(
    "--symbolic", metavar="NAMES", help="Parameters that formulas are to contain, e.g. a1,a2 (eps is one)."
)

backward_option: Callable[[F], F] = click.option(
    "--backward", is_flag=True, help="Step by the inverse map, Phi(., -eps)."
)


def integral_option(help_text: str, flag: str = "--integral", into: str = "integrals") -> Callable[[F], F]:
    """--integral [NAME=]EXPR, repeatable; pairs of a name, which may be empty, and an expression."""
    return click.option(
        flag, into, type=NameValue(name_is_optional=True), multiple=True, metavar="[NAME=]EXPR", help=help_text
    )


seconds_option: Callable[[F], F] = click.option(
    "--seconds", type=Seconds(), metavar="T", help="Stop after T seconds, whatever is being done (default: never)."
)

# How long a search may be: by work, on which its answer depends, and by the clock, which may cut the answer short.
effort_options: Callable[[F], F] = stack(
    click.option(
        "--effort",
        type=click.IntRange(lib.LEAST_EFFORT, lib.MOST_EFFORT),
        metavar="E",
        default=1,
        show_default=True,
        help="How much work: each more doubles it, each less halves it.",
    ),
    seconds_option,
)


def error_bits_option(help_text: str) -> Callable[[F], F]:
    """--error-bits BITS."""
    return click.option("--error-bits", type=int, metavar="BITS", default=100, show_default=True, help=help_text)


evidence_options: Callable[[F], F] = stack(
    seed_option, error_bits_option("Random points until the probability of error is below 2^-BITS.")
)

verbose_option: Callable[[F], F] = click.option(
    "-v", "--verbose", is_flag=True, help="On a terminal: all evidence (a pipe always gets it)."
)

check_options: Callable[[F], F] = stack(
    eps_options,
    click.option(
        "--start",
        type=PointText(True),
        metavar="X",
        help="Start of the exact orbit that is tried (default: a random one); may contain t with -p 't = root of ...'.",
    ),
    click.option("--steps", type=int, metavar="N", help="Steps of that orbit (default 10)."),
    evidence_options,
    click.option("--max-digits", type=Whole(1), metavar="N", help="Digit budget of that orbit (default by dimension)."),
    verbose_option,
    output_options,
)


def given(options: Mapping[str, Any], *names: str, **others: str) -> dict[str, Any]:
    """The values of these options, by their names, or after these by others: `given(options, "seed", terms="max")`."""
    return {name: options[name] for name in names} | {other: options[name] for other, name in others.items()}


def the_eps(eps: Any, time_step: Any, required: bool = True) -> Any:
    """eps from --eps or --time-step; None where neither is given and that is allowed."""
    if eps is not None and time_step is not None:
        raise click.UsageError("give --eps or --time-step, not both (the time step is 2 eps)")
    if time_step is not None:
        return time_step / 2
    if eps is None and required:
        raise click.UsageError("missing --eps E, or --time-step H (= 2 eps)")
    return eps


def eps_of(file: lib.SystemFile, options: Mapping[str, Any]) -> Any:
    """eps from --eps or --time-step, which have to be given where the map depends on it; None where it does not."""
    eps = the_eps(options["eps"], options["time_step"], required=file.map.has_eps)
    return eps if file.map.has_eps else None


def are_equations(reference: str | None) -> bool:
    """Whether what stands in the place of a SYSTEM are equations, and not the name of one."""
    return reference is not None and "=" in reference and not os.path.lexists(reference)


def is_inline(options: Mapping[str, Any], reference: str | None = None) -> bool:
    """Whether a system or map stands on the line itself."""
    return are_equations(reference) or any(options.get(name) for name in ("variables", "rhs", "image", "inverse"))


def in_order(system: str | None, other: str | None, options: Mapping[str, Any]) -> tuple[str | None, str | None]:
    """The first system, which an inline one is, and the second, which is the argument then."""
    if is_inline(options) and system is not None and other is None:
        system, other = None, system
    if system == other == "-":
        raise click.UsageError("found - twice, but standard input holds one system only")
    return system, other


def load_pair(
    reference: str | None, other: str | None, options: Mapping[str, Any]
) -> tuple[lib.SystemFile, lib.SystemFile | None]:
    """Two systems, the second one perhaps none: -p sets a parameter of both, or of the one that has it."""
    given = dict(options.get("parameters", ()))
    if other is None or not given:
        alone = {"quiet": options.get("quiet")}
        return load_system(reference, options), None if other is None else load_system(other, alone)
    if other == "-":  # which can be read once
        raise click.UsageError("found -p with OTHER on standard input, expected a file: is the parameter one of both?")
    named = [
        set(given) if are_equations(one) else set(_loaded(one, {}).document.get("parameters", ()))
        for one in (other, *([] if reference in (None, "-") else [reference]))
    ]
    of_first = [pair for pair in options["parameters"] if pair[0] not in named[0] or pair[0] in named[-1]]
    if len(named) == 1:  # the first one is inline, and may have every parameter
        of_first = options["parameters"]
    of_second = [pair for pair in options["parameters"] if pair[0] in named[0]]
    both = [name for name, _ in of_second if (name, given[name]) in of_first]
    if both and not options.get("quiet"):
        say(f"-p {', '.join(both)}: set in both systems")
    second = {"parameters": of_second, "quiet": options.get("quiet")}
    return load_system(reference, {**options, "parameters": of_first}), load_system(other, second)


def load_system(reference: str | None, options: Mapping[str, Any]) -> lib.SystemFile:
    """The system that a command line names: a path, a catalogue name, `-` for standard input, equations, or options.

    Of the options those of `inline_options` are looked at, as far as they are there. What was made of equations beyond
    their words is said, unless `quiet`.
    """
    file = _loaded(reference, options)
    if not options.get("quiet"):
        for note in file.notes:
            say(note)
    return file


def _loaded(reference: str | None, options: Mapping[str, Any]) -> lib.SystemFile:
    variables, rhs = options.get("variables"), options.get("rhs", ())
    image, inverse = options.get("image", ()), options.get("inverse", ())
    parameters: Sequence[tuple[str, str]] = options.get("parameters", ())
    given = dict(parameters)
    if are_equations(reference) and not (variables or rhs or image or inverse):
        reference, rhs = None, (str(reference),)
    if len(given) < len(parameters):
        twice = next(name for k, (name, _) in enumerate(parameters) if name in dict(parameters[:k]))
        raise click.UsageError(f"found -p {twice}=... twice, expected one value for each parameter")
    if image or inverse:
        if reference is not None or rhs:
            other = "--rhs" if rhs else f"a SYSTEM ({reference})"
            raise click.UsageError(f"give {other} or a map (--image), not both")
        if variables is None or not image:
            raise click.UsageError("an inline map needs --vars X,Y,... and one --image EXPR for each variable")
        section = {"image": _list(image), **({"inverse": _list(inverse)} if inverse else {})}
        return lib.parse_system(lib.inline_file(variables, given, "map", section), "inline")
    if variables is not None or rhs:
        if reference is not None:
            raise click.UsageError(f"give a SYSTEM ({reference}) or an inline one (--vars and --rhs), not both")
        if not rhs or (variables is None and not any("=" in text for text in rhs)):
            raise click.UsageError(
                "an inline system needs both --vars X,Y,... and one --rhs EXPR for each variable, "
                "or --rhs \"x' = x*y; y' = -x\""
            )
        return lib.parse_system(
            lib.inline_file(variables, given, "system", {"rhs": list(rhs) if "=" not in rhs[0] else "; ".join(rhs)}),
            "inline",
        )
    if reference is None:
        raise click.UsageError(
            "missing SYSTEM: a file, a catalogue name ('kahanmaps systems' lists them), - for standard input, "
            "or equations: \"x' = x*y; y' = -x^2\""
        )
    if reference == "-":
        text = sys.stdin.buffer.read(lib.MAX_FILE_BYTES + 1)
        if not text.strip():
            raise lib.InputError("found nothing on standard input, expected a system file")
        with lib.reading("standard input"):
            return lib.parse_system(text, "standard input", given)
    return load_reference(reference, given)


def load_with_start(
    options: dict[str, Any], load: Callable[[Mapping[str, Any]], Any], *references: str | None
) -> tuple[Any, Any]:
    """What `load` makes of the options, a file or a pair of files, and the start, in which parameters may stand.

    An algebraic number that -p gives need not be a parameter of the system: then it is for the start alone.
    """
    text = options["start"]
    if not isinstance(text, str):
        return load(options), text
    words = set(re.findall(r"[A-Za-z_]\w*", text))
    roots = {name: lib.parse_root(value) for name, value in options["parameters"] if name in words}
    known = set[str]()
    for one in references:
        if one is not None and one != "-" and not are_equations(one):
            known |= set(_loaded(one, {}).document.get("parameters", ()))
    inline = " ".join([*map(str, filter(are_equations, references)), *options["rhs"], *options["image"]])
    # What - holds is not known: it may have every parameter.
    known |= {name for name in roots if "-" in references or re.search(rf"\b{name}\b", inline)}
    of_start = {name: root for name, root in roots.items() if root is not None and name not in known}
    made = load({**options, "parameters": [pair for pair in options["parameters"] if pair[0] not in of_start]})
    constants = dict[str, Any]()
    for file in made if isinstance(made, tuple) else (made,):
        if file is not None:
            constants |= file.parameters
            of_start |= dict.fromkeys(file.claim_names[file.dim : -1], file.map.root)
    return made, lib.parse_algebraic_point(text, of_start, constants)


def load_reference(reference: str, parameters: Mapping[str, str]) -> lib.SystemFile:
    """The system of that name or in that file; where there is no such file, those that are named like it are told."""
    try:
        return lib.load(reference, parameters)
    except lib.InputError as error:
        looks_like_a_path = reference.endswith((".toml", ".ode")) or os.sep in reference
        if not looks_like_a_path or os.path.lexists(reference):
            raise
        folder, name = os.path.split(reference)
        try:
            here = sorted(other.removesuffix(".toml") for other in os.listdir(folder or ".") if other.endswith(".toml"))
            close = close_to(name.removesuffix(".toml"), here)
            hint = f", did you mean {' or '.join(os.path.join(folder, f'{like}.toml') for like in close)}?"
        except OSError:
            close, hint = [folder], f" (there is no folder {folder})"
        raise lib.InputError(f"{error}{hint if close else ''}") from error


def _list(texts: Sequence[str]) -> list[str]:
    """The expressions of an option that may be repeated, or have several between semicolons."""
    return [part.strip() for text in texts for part in text.split(";")]


def settings_from(options: dict[str, Any], progress: Callable[[str], None], start: Any) -> lib.Settings:
    """The settings of a check from the values of `check_options`, and the start that these have."""
    steps = options["steps"]
    if isinstance(start, lib.AlgebraicPoint):
        start = start.over(start.root.number_field)
    return lib.Settings(
        eps=the_eps(options["eps"], options["time_step"], required=False),
        start=start,
        steps=10 if steps is None else steps,
        seed=options["seed"],
        error_bits=options["error_bits"],
        max_digits=options["max_digits"],
        orbit_is_asked=options["start"] is not None or steps is not None,
        progress=progress,
    )
