"""Options that several commands share: the system, eps, effort, evidence and output."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import click

from kahanmaps import internals as lib
from kahanmaps_cli.complete import complete_system
from kahanmaps_cli.groups import similar_words_of
from kahanmaps_cli.params import ExactNumber, NameValue, PointText, Seconds, Whole
from kahanmaps_cli.screen.progress import print_stderr

F = TypeVar("F", bound=Callable[..., Any])


def stack(*decorators: Callable[[F], F]) -> Callable[[F], F]:
    def apply(function: F) -> F:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return apply


class RenamedOption(click.Option):
    """An option whose older names are accepted, but not shown in the help."""

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        names, self.opts = self.opts, self.opts[:1]
        try:
            return super().get_help_record(ctx)
        finally:
            self.opts = names

    def get_error_hint(self, ctx: click.Context | None) -> str:
        return f"'{self.opts[0]}'"


system_argument: Callable[[F], F] = click.argument("system", required=False, shell_complete=complete_system)


def _split_pairs(ctx: click.Context, param: click.Parameter, pairs: Sequence[tuple[str, str]]) -> Any:
    """Return the pairs (NAME, VALUE) of all -p; one -p may set several parameters, as in -p a=1,b=2."""
    settings = []
    for name, value in pairs:
        text, *pieces = value.split(",")
        for piece in pieces:
            if "=" in piece:
                settings.append((name, text.strip()))
                name, text = (side.strip() for side in piece.split("=", 1))
            else:
                text += f",{piece}"
        settings.append((name, text.strip()))
    if not all(value and name.isprintable() for name, value in settings):
        raise click.BadParameter("found a name without a value, expected NAME=VALUE", ctx, param)
    return tuple(settings)


parameter_option: Callable[[F], F] = click.option(
    "-p",
    "--parameter",
    "parameters",
    type=NameValue(),
    multiple=True,
    metavar="NAME=VALUE",
    callback=_split_pairs,
    help="Set parameters of the system, e.g. a=2/3 or a=1,b=2; most commands also accept an algebraic "
    "number: a='root of t^2 - 2', a='sqrt(2)'. Repeatable.",
)

inline_options: Callable[[F], F] = stack(
    click.option(
        "--vars", "variables", metavar="X,Y,...", help="Variables of a system or map given on the command line."
    ),
    click.option(
        "--rhs",
        multiple=True,
        metavar="EXPR",
        help="Right-hand side of a system given on the command line, repeated for each variable; or all equations: "
        "\"x' = x*y; y' = -x\".",
    ),
    click.option(
        "--image",
        multiple=True,
        metavar="EXPR",
        help="Component of a map given on the command line, repeated for each variable; or all: 'y; x/y'.",
    ),
    click.option(
        "--inverse",
        multiple=True,
        metavar="EXPR",
        help="Component of the inverse of that map, repeated for each variable.",
    ),
    parameter_option,
)

system_options: Callable[[F], F] = stack(system_argument, inline_options)

_EPS_HELP = "Half the time step (exact number): h = 2 eps."
_TIME_STEP_HELP = "Time step h = 2 eps (exact number), instead of --eps."

eps_options: Callable[[F], F] = stack(
    click.option("--eps", type=ExactNumber(), metavar="E", help=_EPS_HELP),
    click.option("--time-step", type=ExactNumber(), metavar="H", help=_TIME_STEP_HELP),
)

several_eps_options: Callable[[F], F] = stack(
    click.option("--eps", type=ExactNumber(), multiple=True, metavar="E", help=f"{_EPS_HELP} Repeatable."),
    click.option("--time-step", type=ExactNumber(), multiple=True, metavar="H", help=f"{_TIME_STEP_HELP} Repeatable."),
)

json_option: Callable[[F], F] = click.option(
    "--json", "as_json", is_flag=True, help="Print one JSON object on standard output."
)
quiet_option: Callable[[F], F] = click.option(
    "-q", "--quiet", is_flag=True, help="Print no progress and no messages on standard error."
)
output_options: Callable[[F], F] = stack(json_option, quiet_option)

seed_option: Callable[[F], F] = click.option(
    "--seed", type=Whole(), metavar="S", default=0, show_default=True, help="Random seed."
)

given_starts_options: Callable[[F], F] = stack(
    click.option(
        "--start", type=PointText(), multiple=True, metavar="X", help="Initial point, e.g. 1/2,-1/3. Repeatable."
    ),
    click.option(
        "--starts",
        type=click.Path(),
        metavar="FILE",
        help="File of initial points, one per line (text, CSV) or row (.npy); - is standard input.",
    ),
    click.option(
        "--grid",
        metavar="X=A:B:N,...",
        help="Grid of initial points: N values from A to B for a variable, or one value: x=-1:1:20,y=0:1:9,z=1/2. "
        "Other variables are 0.",
    ),
    click.option("--line", metavar="X:Y:N", help="N initial points on the segment from X to Y, e.g. 0,0:1,1/2:50."),
)

starts_options: Callable[[F], F] = stack(
    given_starts_options,
    click.option("--random", "count", type=Whole(1), metavar="N", help="Start at N random points."),
    click.option("--box", type=ExactNumber(), metavar="R", help="With --random: coordinates from -R to R (default 1)."),
    click.option("--seed", type=Whole(), metavar="S", help="With --random: random seed (default 0)."),
)

symbolic_option: Callable[[F], F] = click.option(
    "--symbolic", metavar="NAMES", help="Keep these parameters symbolic in the formulas, e.g. a1,a2,eps."
)

backward_option: Callable[[F], F] = click.option(
    "--backward", is_flag=True, help="Iterate the inverse map, Phi(., -eps)."
)


def integral_option(help_text: str, flag: str = "--integral", into: str = "integrals") -> Callable[[F], F]:
    """Return the option --integral [NAME=]EXPR; its values are pairs (name, expression), and the name may be empty."""
    return click.option(
        flag, into, type=NameValue(name_is_optional=True), multiple=True, metavar="[NAME=]EXPR", help=help_text
    )


seconds_option: Callable[[F], F] = click.option(
    "--seconds", type=Seconds(), metavar="T", help="Stop after T seconds of wall-clock time (default: no limit)."
)

# The work limit (effort) determines the result of a search; the time limit (seconds) may stop the search earlier.
effort_options: Callable[[F], F] = stack(
    click.option(
        "--effort",
        type=click.IntRange(lib.LEAST_EFFORT, lib.MOST_EFFORT),
        metavar="E",
        default=1,
        show_default=True,
        help="Work limit: each increment by 1 doubles it.",
    ),
    seconds_option,
)


def error_bits_option(help_text: str) -> Callable[[F], F]:
    """Return the option --error-bits BITS."""
    return click.option("--error-bits", type=int, metavar="BITS", default=100, show_default=True, help=help_text)


evidence_options: Callable[[F], F] = stack(
    seed_option, error_bits_option("Test random points until the error probability is below 2^-BITS.")
)

verbose_option: Callable[[F], F] = click.option(
    "-v", "--verbose", is_flag=True, help="Print all evidence on a terminal (always printed to a pipe)."
)

check_options: Callable[[F], F] = stack(
    eps_options,
    click.option(
        "--start",
        type=PointText(True),
        metavar="X",
        help="Initial point of the exact test orbit (default: random); its coordinates may be polynomials in an "
        "algebraic number t, given by -p 't = root of ...'.",
    ),
    click.option("--steps", type=int, metavar="N", help="Number of steps of the test orbit (default 10)."),
    evidence_options,
    click.option(
        "--max-digits",
        type=Whole(1),
        metavar="N",
        help="Stop the test orbit when a number exceeds N digits (default: depends on the dimension).",
    ),
    verbose_option,
    output_options,
)


def pick(options: Mapping[str, Any], *names: str, **renamed: str) -> dict[str, Any]:
    """Return a dict of keyword arguments from the named options; `terms="max"` passes the option max as terms."""
    return {name: options[name] for name in names} | {argument: options[name] for argument, name in renamed.items()}


def requested_eps(eps: Any, time_step: Any, required: bool = True) -> Any:
    """Return eps from --eps or --time-step; without either option, raise UsageError if `required`, else return None."""
    if eps is not None and time_step is not None:
        raise click.UsageError("give --eps or --time-step, not both (the time step is 2 eps)")
    if time_step is not None:
        return time_step / 2
    if eps is None and required:
        raise click.UsageError("missing --eps E, or --time-step H (= 2 eps)")
    return eps


def eps_of(file: lib.SystemFile, options: Mapping[str, Any]) -> Any:
    """Return eps from --eps or --time-step, one of which is required; for a map without eps return None."""
    eps = requested_eps(options["eps"], options["time_step"], required=file.map.has_eps)
    return eps if file.map.has_eps else None


def are_equations(reference: str | None) -> bool:
    """Whether the argument SYSTEM consists of equations: it contains a = and is not the name of a file."""
    return reference is not None and "=" in reference and not os.path.lexists(reference)


def is_inline(options: Mapping[str, Any], reference: str | None = None) -> bool:
    """Whether the command line contains the system or map itself, as equations or by options such as --rhs."""
    return are_equations(reference) or any(options.get(name) for name in ("variables", "rhs", "image", "inverse"))


def in_order(system: str | None, other: str | None, options: Mapping[str, Any]) -> tuple[str | None, str | None]:
    """Return the arguments of the first and the second system; the first is None if options such as --rhs define it."""
    if is_inline(options) and system is not None and other is None:
        system, other = None, system
    if system == other == "-":
        raise click.UsageError("found - twice, but standard input holds one system only")
    return system, other


def load_pair(
    reference: str | None, other: str | None, options: Mapping[str, Any]
) -> tuple[lib.SystemFile, lib.SystemFile | None]:
    """Load one or two systems; -p sets a parameter in each system that has a parameter of this name."""
    values = dict(options.get("parameters", ()))
    if other is None or not values:
        without_parameters = {"quiet": options.get("quiet")}
        return load_system(reference, options), None if other is None else load_system(other, without_parameters)
    if other == "-":  # standard input can be read only once
        raise click.UsageError("-p with OTHER on standard input is ambiguous: write OTHER to a file")

    def parameter_names(system: str) -> set[str]:
        if are_equations(system):
            return set(values)
        return set(_load_without_notes(system, {}).document.get("parameters", ()))

    first_parameters, second_names = options["parameters"], parameter_names(other)
    second_parameters = [pair for pair in options["parameters"] if pair[0] in second_names]
    # The names of the parameters of a first system that is inline or on standard input are not known yet.
    if reference is not None and reference != "-":
        first_names = parameter_names(reference)
        first_parameters = [pair for pair in first_parameters if pair[0] not in second_names or pair[0] in first_names]
    shared_names = [name for name, _ in second_parameters if (name, values[name]) in first_parameters]
    if shared_names and not options.get("quiet"):
        print_stderr(f"-p {', '.join(shared_names)}: set in both systems")
    second_options = {"parameters": second_parameters, "quiet": options.get("quiet")}
    return load_system(reference, {**options, "parameters": first_parameters}), load_system(other, second_options)


def load_system(reference: str | None, options: Mapping[str, Any]) -> lib.SystemFile:
    """Load the system of a command line: a path, a catalogue name, `-` for standard input, equations, or options.

    Notes on how equations were interpreted are printed on standard error, unless the option `quiet` is set.
    """
    file = _load_without_notes(reference, options)
    if not options.get("quiet"):
        for note in file.notes:
            print_stderr(note)
    return file


def _load_without_notes(reference: str | None, options: Mapping[str, Any]) -> lib.SystemFile:
    variables, rhs = options.get("variables"), options.get("rhs", ())
    image, inverse = options.get("image", ()), options.get("inverse", ())
    parameters: Sequence[tuple[str, str]] = options.get("parameters", ())
    values = dict(parameters)
    if are_equations(reference) and not (variables or rhs or image or inverse):
        reference, rhs = None, (str(reference),)
    if len(values) < len(parameters):
        repeated = next(name for k, (name, _) in enumerate(parameters) if name in dict(parameters[:k]))
        raise click.UsageError(f"found -p {repeated}=... twice, expected one value for each parameter")
    if image or inverse:
        if reference is not None or rhs:
            conflict = "--rhs" if rhs else f"a SYSTEM ({reference})"
            raise click.UsageError(f"give {conflict} or a map (--image), not both")
        if variables is None or not image:
            raise click.UsageError("an inline map needs --vars X,Y,... and one --image EXPR for each variable")
        section = {"image": _split_components(image), **({"inverse": _split_components(inverse)} if inverse else {})}
        return lib.parse_system(lib.inline_file(variables, values, "map", section), "inline")
    if variables is not None or rhs:
        if reference is not None:
            raise click.UsageError(f"give a SYSTEM ({reference}) or an inline one (--vars and --rhs), not both")
        if not rhs or (variables is None and not any("=" in text for text in rhs)):
            raise click.UsageError(
                "an inline system needs both --vars X,Y,... and one --rhs EXPR for each variable, "
                "or --rhs \"x' = x*y; y' = -x\""
            )
        return lib.parse_system(
            lib.inline_file(variables, values, "system", {"rhs": list(rhs) if "=" not in rhs[0] else "; ".join(rhs)}),
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
            return lib.parse_system(text, "standard input", values)
    return load_reference(reference, values)


def load_with_start(
    options: dict[str, Any], load: Callable[[Mapping[str, Any]], Any], *arguments: str | None
) -> tuple[Any, Any]:
    """Return a pair: what `load` returns (one system or two), and the initial point, which may contain parameters.

    An algebraic number given by -p whose name is no parameter of the system is used only in the initial point.
    """
    text = options["start"]
    if not isinstance(text, str):
        return load(options), text
    names = set(re.findall(r"[A-Za-z_]\w*", text))
    roots = {name: lib.parse_root(value) for name, value in options["parameters"] if name in names}
    parameter_names = set[str]()
    for argument in arguments:
        if argument is not None and argument != "-" and not are_equations(argument):
            parameter_names |= set(_load_without_notes(argument, {}).document.get("parameters", ()))
    inline_text = " ".join([*map(str, filter(are_equations, arguments)), *options["rhs"], *options["image"]])
    # The names of the parameters of a system on standard input are not known yet.
    parameter_names |= {name for name in roots if "-" in arguments or re.search(rf"\b{name}\b", inline_text)}
    start_roots = {name: root for name, root in roots.items() if root is not None and name not in parameter_names}
    loaded_files = load(
        {**options, "parameters": [pair for pair in options["parameters"] if pair[0] not in start_roots]}
    )
    constants = dict[str, Any]()
    for file in loaded_files if isinstance(loaded_files, tuple) else (loaded_files,):
        if file is not None:
            constants |= file.parameters
            start_roots |= dict.fromkeys(file.claim_names[file.dim : -1], file.map.root)
    return loaded_files, lib.parse_algebraic_point(text, start_roots, constants)


def load_reference(reference: str, parameters: Mapping[str, str]) -> lib.SystemFile:
    """Load a system from a path or the catalogue; the error for a missing file suggests files with similar names."""
    try:
        return lib.load(reference, parameters)
    except lib.InputError as error:
        is_path = reference.endswith((".toml", ".ode")) or os.sep in reference
        if not is_path or os.path.lexists(reference):
            raise
        folder, name = os.path.split(reference)
        try:
            toml_files = sorted(
                path.removesuffix(".toml") for path in os.listdir(folder or ".") if path.endswith(".toml")
            )
            similar = similar_words_of(name.removesuffix(".toml"), toml_files)
            hint = f", did you mean {' or '.join(os.path.join(folder, f'{match}.toml') for match in similar)}?"
        except OSError:
            similar, hint = [folder], f" (there is no folder {folder})"
        raise lib.InputError(f"{error}{hint if similar else ''}") from error


def _split_components(texts: Sequence[str]) -> list[str]:
    return [part.strip() for text in texts for part in text.split(";")]


def settings_from(options: dict[str, Any], progress: Callable[[str], None], start: Any) -> lib.Settings:
    """Return the settings of a check from the values of `check_options` and the initial point `start`."""
    steps = options["steps"]
    if isinstance(start, lib.AlgebraicPoint):
        start = start.over(start.root.number_field)
    return lib.Settings(
        eps=requested_eps(options["eps"], options["time_step"], required=False),
        start=start,
        steps=10 if steps is None else steps,
        seed=options["seed"],
        error_bits=options["error_bits"],
        max_digits=options["max_digits"],
        orbit_is_requested=options["start"] is not None or steps is not None,
        progress=progress,
    )
