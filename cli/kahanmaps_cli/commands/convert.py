"""kahanmaps convert."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps.errors import counted
from kahanmaps_cli.options import load_system, quiet_option, symbolic_option, system_options
from kahanmaps_cli.screen.outputs import OutputFile
from kahanmaps_cli.screen.progress import as_typed, print_stderr

# The languages of kahanmaps.languages.convert, which is not imported for --help.
_LANGUAGES = ("latex", "sympy", "pari", "maple", "mathematica", "sage", "julia", "numpy", "c", "fortran", "toml")


@click.command("convert")
@system_options
@click.option(
    "--to",
    "language",
    type=click.Choice(_LANGUAGES),
    required=True,
    metavar="LANG",
    help=f"{', '.join(_LANGUAGES[:-1])} or {_LANGUAGES[-1]}.",
)
@click.option(
    "--what",
    "parts",
    metavar="PARTS",
    multiple=True,
    help="Any of system, map, inverse, jacobian, map-formulas, integrals, density "
    "(default: system, map, and integrals and density if known).",
)
@symbolic_option
@click.option("--name", default="", metavar="NAME", help="Prefix of the names of all functions.")
@click.option("-o", "--output", type=OutputFile(), metavar="FILE", help="Write to FILE.")
@quiet_option
def command(system: str | None, language: str, output: str | None, quiet: bool, **options: Any) -> None:
    """Convert SYSTEM, its map, integrals and density to code for another program.

    \b
      kahanmaps convert euler_top --to pari
      kahanmaps convert euler_top --to sympy --symbolic a1,a2,a3
      kahanmaps convert euler_top -p 'a1 = root of t^2 - 2' --to sage
      kahanmaps convert lagrange_top --to latex -o lagrange_top.tex
      kahanmaps convert weierstrass --to julia --what map-formulas,inverse
      kahanmaps convert --vars x,y --rhs x*y --rhs=-x^2 --to toml -o my.toml

    The output is a complete program file; toml is a system file. eps, if the map depends on it, is an argument of the
    map; the time step is 2 eps. Numbers are exact, except in numpy, c and fortran.
    """
    file = load_system(system, {**options, "quiet": quiet})
    if language == "toml":
        if options["parts"] or options["symbolic"] or options["name"]:
            raise click.UsageError("a system file holds the whole system: leave out --what, --symbolic and --name")
        write_text(file.to_toml(), f"{file.name} for {language}", output, quiet)
        return
    symbols = [name for name in _split(options["symbolic"] or "") if name != "eps"]
    parts = [part for text in options["parts"] for part in _split(text)]
    # The command that reproduces the converted text, without the option -o.
    command_words = ["kahanmaps", "convert", *([system] if system is not None else [])]
    command_words += [f"--vars={options['variables']}"] if options["variables"] is not None else []
    command_words += [f"--{key}={text}" for key in ("rhs", "image", "inverse") for text in options[key]]
    command_words += [word for name, value in options["parameters"] for word in ("-p", f"{name}={value}")]
    command_words += ["--to", language, *(word for text in options["parts"] for word in ("--what", text))]
    command_words += [word for key in ("symbolic", "name") if options[key] for word in (f"--{key}", options[key])]
    options_of_conversion = {"name": options["name"], "symbols": symbols, "command": as_typed(command_words)}
    text = lib.convert(file, language, parts if options["parts"] else None, **options_of_conversion)
    write_text(text, f"{file.name} for {language}", output, quiet)


def write_text(text: str, title: str, output: str | None, quiet: bool) -> None:
    """Write a text to standard output, or to a file and report it on standard error; `title` describes the text."""
    if output is None or output == "-":
        click.echo(text, nl=False)
        return
    lib.write_atomically(output, text.encode())
    if not quiet:
        print_stderr(f"{output}: {title}, {counted(len(text.splitlines()), 'line')}")


def _split(text: str) -> list[str]:
    return [piece.strip() for piece in text.split(",") if piece.strip()]
