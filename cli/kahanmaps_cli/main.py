"""The entry point: the lazy group of commands, and the one place where errors become messages and exit statuses.

Exit statuses: 0 the claim holds or the work is done; 1 refuted, and nothing else; 2 usage error or bad input; 3
undecided or stopped early, or the output was lost; 70 an internal error; 130 interrupted by Ctrl-C or SIGTERM.
"""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING, ClassVar

import click

from kahanmaps.checks.table import CHECKS
from kahanmaps.errors import InputError, KahanmapsError, bounded, is_of_the_machine, is_out_of_memory
from kahanmaps.hard_stop import TimeLimit
from kahanmaps_cli.groups import SuggestingGroup, in_our_words
from kahanmaps_cli.params import HELP_OPTIONS, with_our_rules
from kahanmaps_cli.screen.progress import as_typed, say
from kahanmaps_cli.screen.streams import have_standard_streams, leave_nothing_to_flush, output_was_lost
from kahanmaps_cli.screen.terminal import colour_option
from kahanmaps_cli.signals import INTERRUPTED

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

HOLDS, REFUTED, WRONG_USE, UNDECIDED, INTERNAL = 0, 1, 2, 3, 70

COMPLETION = "_KAHANMAPS_COMPLETE"  # set by the shell that asks what may follow

# heading -> name -> (module in kahanmaps_cli.commands, one line for the list of commands)
SECTIONS = {
    "Maps and orbits": {
        "systems": ("systems", "The catalogue of named systems."),
        "orbit": ("orbit", "Iterate the map: exactly, modulo p, in balls or floats."),
        "period": ("period", "The exact period of an orbit, modulo p or over Q."),
        "ensemble": ("ensemble", "Many orbits at once, in floating point."),
    },
    "Checks": {name: ("check", check.question) for name, check in CHECKS.items()},
    "Laboratory": {
        "analyze": ("analyze", "What a map preserves, how it grows: all of it, a verdict."),
        "degrees": ("degrees", "Degrees of the iterates, recurrence, dynamical degree."),
        "scan": ("scan", "Which members of a family are integrable?"),
        "heights": ("heights", "How fast the heights of exact orbits grow."),
        "find-integrals": ("find_integrals", "Integrals in closed form, with their proofs."),
        "find-density": ("find_density", "Invariant measures dx/phi, phi in closed form."),
        "find-poisson": ("find_poisson", "Poisson tensors with polynomial entries."),
        "find-symmetry": ("find_symmetry", "Linear symmetries and reversing symmetries of the map."),
        "find-commuting": ("find_commuting", "All quadratic systems whose maps commute with this one."),
        "singularities": ("singularities", "Are the singularities confined, and after how many steps?"),
        "cycles": ("cycles", "The cycles of the map over a finite field."),
        "lyapunov": ("lyapunov", "Lyapunov exponents of float orbits."),
    },
    "The paper's family": {
        "verify": ("verify", "Every statement of the paper, for a member with any m."),
        "family": ("family", "Make and look at members of the commuting family."),
    },
    "Many experiments": {"batch": ("batch", "Thousands of experiments: run, resume, summarise.")},
    "Pictures and pages": {
        "plot": ("plot", "Pictures: portraits, invariant curves, drift, growth."),
        "report": ("report", "A page about a system, member or batch: one HTML file."),
        "certificate": ("certificate", "Proofs that Coq (Rocq), PARI/GP or SymPy checks."),
        "convert": ("convert", "LaTeX, SymPy, PARI/GP, Maple, ... of a system, its map."),
    },
    "About": {
        "completion": ("completion", "Completion of commands, systems and options for your shell."),
        "version": ("version", "The versions of kahanmaps and of what it computes with."),
    },
}
COMMANDS = {name: entry for commands in SECTIONS.values() for name, entry in commands.items()}

WELCOME = """\
What does the Kahan map of a system preserve, and is it integrable?

  a system of the catalogue, from its equations to a verdict:
    kahanmaps systems
    kahanmaps analyze euler_top

  a system of your own, on the line, or in a file like the one written here:
    kahanmaps analyze --rhs "x' = x*(1-y); y' = y*(x-1)"
    kahanmaps systems euler_top --toml > my-top.toml

  any other birational map:
    kahanmaps analyze --vars x,y --image 'y; (3 + y)/x'

  the theorem of the paper, on a random member of its commuting family:
    kahanmaps family new --m 3 --seed 7 -o pair.toml
    kahanmaps check-commute pair.toml

  help:
    kahanmaps --help              all commands
    kahanmaps COMMAND --help      one of them, examples first

eps is the paper's epsilon throughout: the time step is 2 eps."""


class LazyGroup(SuggestingGroup):
    """A group that imports a command only when it is needed, so that --help stays light."""

    removed: ClassVar = {
        "schema": "the keys of JSON are described in docs/cli.md",
        "manual": "kahanmaps --help and kahanmaps COMMAND --help say the same",
    }

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        module = import_module(f"kahanmaps_cli.commands.{COMMANDS[cmd_name][0]}")
        command: click.Command = module.command(cmd_name) if cmd_name in CHECKS else module.command
        return with_our_rules(command)

    def hint(self, written: str, known: list[str]) -> str:
        from kahanmaps.documents.catalog import names

        if written in names() or written.endswith(".toml"):
            return f" To see what the map of {written} preserves: {as_typed(['kahanmaps', 'analyze', written])}"
        if written == "help":
            return " For help: kahanmaps --help, or kahanmaps COMMAND --help."
        return super().hint(written, known)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        from click.shell_completion import CompletionItem

        if incomplete.startswith("-"):
            return super().shell_complete(ctx, incomplete)
        return [CompletionItem(name, help=line) for name, (_, line) in COMMANDS.items() if name.startswith(incomplete)]

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        width = max(map(len, COMMANDS))
        for heading, commands in SECTIONS.items():
            with formatter.section(heading):
                formatter.write_dl([(name.ljust(width), line) for name, (_, line) in commands.items()])


@click.group(
    cls=LazyGroup,
    params=[colour_option()],
    invoke_without_command=True,
    context_settings={"help_option_names": HELP_OPTIONS},
)
@click.option("--version", "show_version", is_flag=True, help="Print the version and exit.")
@click.pass_context
def cli(ctx: click.Context, show_version: bool) -> None:
    """Kahan (Hirota-Kimura) maps of quadratic systems, exactly over the rationals: what do they preserve, do they
    commute, are they integrable?

    \b
      kahanmaps systems
      kahanmaps analyze euler_top
      kahanmaps orbit lotka_volterra --start 1,2 --eps 1/10 --steps 5
      kahanmaps family new --m 3 --eigenvalues 1,-2,3 --seed 7 -o pair.toml
      kahanmaps check-commute pair.toml

    eps is the paper's epsilon throughout: the time step is 2 eps. Every command has a help of its own, examples
    first: kahanmaps COMMAND --help.

    Exit status: 0 done, or the claim holds, 1 refuted, 2 usage error, 3 undecided or stopped early, 70 an internal
    error, 130 interrupted by Ctrl-C or SIGTERM.
    """
    if show_version:
        from kahanmaps.version import __version__

        click.echo(f"kahanmaps {__version__}")
        ctx.exit()
    elif ctx.invoked_subcommand is None:
        click.echo(WELCOME)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    try:
        have_standard_streams()
        if any("\0" in word for word in argv or ()):  # a shell cannot say it, who calls this can
            raise click.UsageError("found a zero byte among the arguments: no file and no name can have it")
        result = cli.main(args=None if argv is None else list(argv), prog_name="kahanmaps", standalone_mode=False)
        sys.stdout.flush()
        status = result if isinstance(result, int) else HOLDS
        if status == HOLDS and output_was_lost():
            say("Error: standard output is closed: what was printed is lost; name a file with >, or -o")
            return UNDECIDED
        return status
    except click.exceptions.Exit as stop:
        return stop.exit_code
    except click.ClickException as error:
        shown = io.StringIO()
        in_our_words(error).show(shown)
        say(bounded(shown.getvalue().removesuffix("\n")))
        return WRONG_USE
    except (click.Abort, KeyboardInterrupt) as stop:  # click makes Abort of the other
        return _interrupted(stop.__cause__ or stop)
    except SystemExit as stop:  # click ends a completion with 0, and with 1 where nobody reads a pipe any longer
        return UNDECIDED if stop.code else HOLDS
    except BrokenPipeError:
        return UNDECIDED
    except Exception as error:
        # Python makes RuntimeError of Ctrl-C where a class is being made, in an import.
        cause: BaseException | None = error
        while cause is not None and not isinstance(cause, KeyboardInterrupt):
            cause = cause.__cause__ or cause.__context__
        if cause is not None:
            return _interrupted(cause)
        return INTERNAL if os.environ.get(COMPLETION) else _report(error)  # no traceback in the middle of a line
    finally:
        leave_nothing_to_flush()


def _interrupted(stop: BaseException) -> int:
    is_over = isinstance(stop, TimeLimit)  # --seconds, at the very end of a search: elsewhere it says what was cut
    say(f"stopped: {stop} (--seconds)" if is_over else "interrupted")
    return UNDECIDED if is_over else INTERRUPTED


def _report(error: Exception) -> int:
    if os.environ.get("KAHANMAPS_DEBUG"):
        import traceback

        traceback.print_exc()
    if isinstance(error, KahanmapsError):
        say(f"Error: {error}")
        return WRONG_USE if isinstance(error, InputError) else UNDECIDED
    if is_out_of_memory(error):
        why = f" ({error})" if str(error) else ""
        remedy = "ask for fewer steps or a smaller --max-digits, or allow more memory (ulimit -v)"
        say(bounded(f"Error: out of memory{why}: {remedy}"))
        return UNDECIDED
    if isinstance(error, OSError):
        where = f": {error.filename or repr('')}" if error.filename is not None else ""
        folder = os.path.dirname(error.filename) if isinstance(error.filename, str) else ""
        is_missing = isinstance(error, FileNotFoundError) and bool(folder) and not os.path.isdir(folder)
        hint = f" (there is no folder {folder}: make it first, or check the name)" if is_missing else ""
        say(bounded(f"Error: {error.strerror or error}{where}{hint}"))
        return UNDECIDED if is_of_the_machine(error) else WRONG_USE
    if isinstance(error, ImportError) and not (error.name or "").startswith("kahanmaps"):
        say(bounded(f"Error: {error.name or 'a library'} cannot be loaded: {error}; install it again"))
        return UNDECIDED
    say(bounded(f"Internal error: {type(error).__name__}: {error}"))
    read = " and ".join(getattr(error, "__notes__", ()))
    blame = f"Either {read}, which was being read, is damaged, or this" if read else "This"
    say(bounded(f"{blame} is a bug in kahanmaps. KAHANMAPS_DEBUG=1 shows where it happened."))
    return INTERNAL


if __name__ == "__main__":
    sys.exit(main())
