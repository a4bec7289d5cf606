"""The entry point: the lazy group of commands, and the one place where errors become messages and exit statuses.

Exit statuses: 0 the claim holds or the work is done; 1 refuted, and nothing else; 2 wrong use or bad input; 3
undecided or stopped early; 70 an internal error; 130 interrupted.
"""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module

import click

from kahanmaps_cli.progress import say

HOLDS, REFUTED, WRONG_USE, UNDECIDED, INTERNAL, INTERRUPTED = 0, 1, 2, 3, 70, 130

# name -> (module in kahanmaps_cli.commands, one line for the list of commands)
COMMANDS = {
    "orbit": ("orbit", "Iterate the Kahan map: exactly, modulo a prime, in balls or floats."),
    "period": ("period", "The exact period of an orbit, modulo a prime or over the rationals."),
    "ensemble": ("ensemble", "Many orbits at once, in machine numbers or modulo a prime."),
    "check-commute": ("check_commute", "Do two Kahan maps commute?"),
    "check-integrals": ("check_integrals", "Are the known or claimed integrals conserved?"),
    "check-measure": ("check_measure", "Is the measure dx/phi invariant?"),
    "check-poisson": ("check_poisson", "Is the Poisson tensor J - eps^2 f'(x)^2 J invariant?"),
    "analyze": ("analyze", "What a Kahan map preserves and how it grows: everything below, as one report."),
    "degrees": ("degrees", "Degrees of the iterates, their recurrence and the dynamical degree."),
    "heights": ("heights", "How fast the heights of exact orbits grow."),
    "find-integrals": ("find_integrals", "Integrals in closed form: Hirota-Kimura bases, Darboux polynomials."),
    "find-density": ("find_density", "Invariant measures dx/phi with phi polynomial."),
    "find-symmetry": ("find_symmetry", "Linear symmetries and reversing symmetries of the map."),
    "find-commuting": ("find_commuting", "The quadratic systems whose Kahan maps commute with this one's."),
    "singularities": ("singularities", "Are the singularities confined, and after how many steps?"),
    "cycles": ("cycles", "The orbits of the map on projective space over a finite field."),
    "lyapunov": ("lyapunov", "Lyapunov exponents of float orbits, by the exact tangent map."),
    "verify": ("verify", "Every statement of the paper, for a random or given member, any m."),
    "family": ("family", "Make and look at members of the commuting family."),
    "plot": ("plot", "Pictures: portraits, invariant curves, drift, growth, batches."),
    "report": ("report", "A page about a system, a member or a batch: one HTML file, pictures inside."),
    "convert": ("convert", "A system, its map or its integrals as LaTeX, SymPy, PARI/GP, Maple, ..."),
    "batch": ("batch", "Thousands of experiments from one file: run, resume, summarise."),
    "systems": ("systems", "The catalogue of named systems."),
    "schema": ("schema", "JSON schemas of files and of what --json prints."),
    "completion": ("completion", "Completion of commands, systems and options for your shell."),
    "manual": ("manual", "The manual page, for man."),
    "version": ("version", "The versions of kahanmaps and of what it computes with."),
}


class LazyGroup(click.Group):
    """A group that imports a command only when it is needed, so that --help stays light."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        module = import_module(f"kahanmaps_cli.commands.{COMMANDS[cmd_name][0]}")
        command: click.Command = module.command
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            from difflib import get_close_matches

            close = get_close_matches(args[0], COMMANDS, n=3, cutoff=0.5)
            hint = f" Did you mean {' or '.join(close)}?" if close else ""
            raise click.UsageError(f"There is no command {args[0]!r}.{hint}", ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, line) for name, (_, line) in COMMANDS.items()])


@click.group(cls=LazyGroup, invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--version", "show_version", is_flag=True, help="Print the version and exit.")
@click.pass_context
def cli(ctx: click.Context, show_version: bool) -> None:
    """Kahan (Hirota-Kimura) maps of quadratic systems, exactly over the rationals: what do they preserve, do they
    commute, are they integrable?

    eps is the paper's epsilon throughout: the time step is 2 eps.

    \b
    First steps:
      kahanmaps family new --m 3 --eigenvalues 1,-2,3 --seed 7 -o pair.toml
      kahanmaps check-commute pair.toml
      kahanmaps check-integrals pair.toml
      kahanmaps orbit pair.toml --start 1/2,-1/3,0,1,2/5,-1 --eps 1/10 --steps 5
      kahanmaps systems
    """
    if show_version:
        from kahanmaps.version import __version__

        click.echo(f"kahanmaps {__version__}")
        ctx.exit()
    elif ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    try:
        return _run(argv)
    finally:
        _leave_nothing_to_flush()


def _run(argv: Sequence[str] | None) -> int:
    _have_standard_streams()
    status = HOLDS
    try:
        result = cli.main(args=None if argv is None else list(argv), prog_name="kahanmaps", standalone_mode=False)
        status = result if isinstance(result, int) else HOLDS
        sys.stdout.flush()
    except click.exceptions.Exit as stop:
        return stop.exit_code
    except click.ClickException as error:
        with suppress(OSError):
            error.show(sys.stderr)
        return WRONG_USE
    except (click.Abort, KeyboardInterrupt):
        say("interrupted")
        return INTERRUPTED
    except (BrokenPipeError, SystemExit):  # click turns the one into the other
        pass  # the reader (head, say) has what it wanted
    except Exception as error:
        return _report(error)
    return status


def _report(error: Exception) -> int:
    from kahanmaps.errors import InputError, KahanmapsError

    if os.environ.get("KAHANMAPS_DEBUG"):
        import traceback

        traceback.print_exc()
    if isinstance(error, KahanmapsError):
        say(f"Error: {error}")
        return WRONG_USE if isinstance(error, InputError) else UNDECIDED
    if isinstance(error, OSError):
        where = f": {error.filename or repr('')}" if error.filename is not None else ""
        say(f"Error: {error.strerror or error}{where}")
        return WRONG_USE
    if isinstance(error, MemoryError):
        say("Error: out of memory: ask for fewer steps or a smaller --max-digits")
        return UNDECIDED
    say(
        f"Internal error: {type(error).__name__}: {error}\n"
        "This is a bug in kahanmaps. KAHANMAPS_DEBUG=1 shows where it happened."
    )
    return INTERNAL


def _leave_nothing_to_flush() -> None:
    """Let go of what a stream still holds and cannot write: Python would fail on it once more, and exit with 120."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):
            with suppress(OSError, ValueError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _have_standard_streams() -> None:
    """Put the null device where a standard stream is closed (`>&-`), or the next file opened would take its place.

    Where the encoding of a stream lacks a character, the character is spelt out.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode))  # noqa: SIM115 (open for as long as the process lives)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


if __name__ == "__main__":
    sys.exit(main())
