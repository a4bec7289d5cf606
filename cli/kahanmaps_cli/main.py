"""The entry point of the command line: it loads commands on demand and turns errors into messages and statuses.

Exit statuses: 0 the claim holds or the work is done; 1 a claim is refuted (no other cause); 2 usage error or invalid
input; 3 undecided, stopped early, or output lost; 70 internal error; 130 interrupted by Ctrl-C or SIGTERM.
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
from kahanmaps.errors import InputError, KahanmapsError, bounded, is_machine_failure, is_out_of_memory
from kahanmaps.hard_stop import TimeLimit
from kahanmaps_cli.groups import SuggestingGroup, rephrase
from kahanmaps_cli.params import HELP_OPTIONS, with_common_rules
from kahanmaps_cli.screen.progress import as_typed, print_stderr
from kahanmaps_cli.screen.streams import discard_unwritable_output, output_was_lost, prepare_standard_streams
from kahanmaps_cli.screen.terminal import color_option
from kahanmaps_cli.signals import INTERRUPTED, end_interrupts

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

SUCCESS, REFUTED, USAGE_ERROR, UNDECIDED, INTERNAL_ERROR = 0, 1, 2, 3, 70

COMPLETION = "_KAHANMAPS_COMPLETE"  # environment variable that a shell sets in order to request completions

# Heading -> name of a command -> (its module in kahanmaps_cli.commands, its line in the list of commands).
SECTIONS = {
    "Maps and orbits": {
        "systems": ("systems", "List or show the named systems of the catalogue."),
        "orbit": ("orbit", "Iterate a map: exactly, modulo p, in balls or floats."),
        "period": ("period", "Compute the exact period of an orbit, modulo p or over Q."),
        "geometry": ("geometry", "Describe the curve of an orbit: j-invariants, heights, rotation numbers."),
        "ensemble": ("ensemble", "Iterate many orbits at once, in floating point."),
        "compare": ("compare", "Compare Kahan's method with others: drift, errors, orders, work."),
    },
    "Checks": {name: ("check", check.question) for name, check in CHECKS.items()},
    "Laboratory": {
        "analyze": ("analyze", "Analyze a map: invariants, growth and a verdict on integrability."),
        "degrees": ("degrees", "Compute degrees of iterates, their recurrence and the dynamical degree."),
        "scan": ("scan", "Search a family for members whose degrees grow more slowly."),
        "heights": ("heights", "Measure the growth of heights along exact orbits."),
        "find-integrals": ("find_integrals", "Search for rational integrals and prove them."),
        "find-density": ("find_density", "Search for invariant volume forms dx/phi with phi polynomial."),
        "find-poisson": ("find_poisson", "Search for invariant Poisson tensors with polynomial entries."),
        "find-symmetry": ("find_symmetry", "Find the affine symmetries and reversing symmetries of a map."),
        "find-commuting": ("find_commuting", "Find quadratic systems whose Kahan maps commute with this one."),
        "modified": ("modified", "Compute the modified vector field of a Kahan map, as a series in eps."),
        "singularities": ("singularities", "Trace singularities: are they confined, and after how many steps?"),
        "cycles": ("cycles", "Count the cycles of a map over a finite field."),
        "lyapunov": ("lyapunov", "Estimate Lyapunov exponents of floating-point orbits."),
    },
    "The paper's family": {
        "verify": ("verify", "Check every statement of the paper for a member of its family."),
        "family": ("family", "Construct and inspect members of the commuting family."),
    },
    "Many experiments": {"batch": ("batch", "Run, resume and summarize thousands of experiments.")},
    "Pictures and pages": {
        "plot": ("plot", "Draw portraits, invariant curves, comparisons of methods and growth."),
        "report": ("report", "Write an HTML page about a system or a member of the family."),
        "certificate": ("certificate", "Write proofs that Coq (Rocq), PARI/GP or SymPy checks."),
        "convert": ("convert", "Convert a system and its map to LaTeX, SymPy, PARI/GP, Maple, ..."),
    },
    "About": {
        "completion": ("completion", "Print the completion script for your shell."),
        "version": ("version", "Print the versions of kahanmaps and its libraries."),
    },
}
COMMANDS = {name: entry for commands in SECTIONS.values() for name, entry in commands.items()}

WELCOME = """\
What does the Kahan map of a system preserve, and is it integrable?

  analyze a system of the catalogue:
    kahanmaps systems
    kahanmaps analyze euler_top

  analyze your own system, on the command line or in a file like this one:
    kahanmaps analyze --rhs "x' = x*(1-y); y' = y*(x-1)"
    kahanmaps systems euler_top --toml > my-top.toml

  analyze any other birational map:
    kahanmaps analyze --vars x,y --image 'y; (3 + y)/x'

  check the theorem of the paper on a random member of its commuting family:
    kahanmaps family new --m 3 --seed 7 -o pair.toml
    kahanmaps check-commute pair.toml

  help:
    kahanmaps --help              all commands
    kahanmaps COMMAND --help      one command, with examples

eps is half the time step throughout: h = 2 eps."""


class LazyGroup(SuggestingGroup):
    """A command group that imports the module of a command only when the command is needed, so that --help is fast."""

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
        return with_common_rules(command)

    def hint(self, written: str, command_names: list[str]) -> str:
        from kahanmaps.documents.catalog import names

        if written in names() or written.endswith(".toml"):
            return f" To see what the map of {written} preserves: {as_typed(['kahanmaps', 'analyze', written])}"
        if written == "help":
            return " For help: kahanmaps --help, or kahanmaps COMMAND --help."
        return super().hint(written, command_names)

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
    params=[color_option()],
    invoke_without_command=True,
    context_settings={"help_option_names": HELP_OPTIONS},
)
@click.option("--version", "show_version", is_flag=True, help="Print the version and exit.")
@click.pass_context
def cli(ctx: click.Context, show_version: bool) -> None:
    """Study Kahan (Hirota-Kimura) maps of quadratic systems exactly over the rationals: what do they preserve, do they
    commute, are they integrable?

    \b
      kahanmaps systems
      kahanmaps analyze euler_top
      kahanmaps orbit lotka_volterra --start 1,2 --eps 1/10 --steps 5
      kahanmaps family new --m 3 --eigenvalues 1,-2,3 --seed 7 -o pair.toml
      kahanmaps check-commute pair.toml

    eps is half the time step throughout: h = 2 eps. kahanmaps COMMAND --help explains a command, examples first.

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
        prepare_standard_streams()
        if any("\0" in word for word in argv or ()):  # a shell cannot pass NUL, but a Python caller can
            raise click.UsageError("found a zero byte in an argument, expected text without one")
        result = cli.main(args=None if argv is None else list(argv), prog_name="kahanmaps", standalone_mode=False)
        sys.stdout.flush()
        status = result if isinstance(result, int) else SUCCESS
        if status == SUCCESS and output_was_lost():
            print_stderr("Error: standard output is closed and the output is lost: redirect it with >, or give -o FILE")
            return UNDECIDED
        return status
    except click.exceptions.Exit as stop:
        return stop.exit_code
    except click.ClickException as error:
        message = io.StringIO()
        rephrase(error).show(message)
        print_stderr(bounded(message.getvalue().removesuffix("\n")))
        return USAGE_ERROR
    except (click.Abort, KeyboardInterrupt) as stop:  # click turns KeyboardInterrupt into Abort
        return _report_interrupt(stop.__cause__ or stop)
    except SystemExit as stop:  # raised by click with code 0 after a completion, and 1 after a broken pipe
        return UNDECIDED if stop.code else SUCCESS
    except BrokenPipeError:
        return UNDECIDED
    except Exception as error:
        # Python turns a KeyboardInterrupt into a RuntimeError if a class is being created during an import.
        cause: BaseException | None = error
        while cause is not None and not isinstance(cause, KeyboardInterrupt):
            cause = cause.__cause__ or cause.__context__
        if cause is not None:
            return _report_interrupt(cause)
        return INTERNAL_ERROR if os.environ.get(COMPLETION) else _report_error(error)  # print nothing in a completion
    finally:
        discard_unwritable_output()


def _report_interrupt(stop: BaseException) -> int:
    end_interrupts()
    is_over = isinstance(stop, TimeLimit)  # the limit --seconds expired just after the end of a search
    print_stderr(f"stopped: {stop} (--seconds)" if is_over else "interrupted")
    return UNDECIDED if is_over else INTERRUPTED


def _report_error(error: Exception) -> int:
    if os.environ.get("KAHANMAPS_DEBUG"):
        import traceback

        traceback.print_exc()
    if isinstance(error, KahanmapsError):
        print_stderr(f"Error: {error}")
        return USAGE_ERROR if isinstance(error, InputError) else UNDECIDED
    if is_out_of_memory(error):
        detail = f" ({error})" if str(error) else ""
        remedy = "reduce the number of steps or --max-digits, or allow more memory (ulimit -v)"
        print_stderr(bounded(f"Error: out of memory{detail}: {remedy}"))
        return UNDECIDED
    if isinstance(error, OSError):
        where = f": {error.filename or repr('')}" if error.filename is not None else ""
        folder = os.path.dirname(error.filename) if isinstance(error.filename, str) else ""
        folder_is_missing = isinstance(error, FileNotFoundError) and bool(folder) and not os.path.isdir(folder)
        hint = f" (there is no folder {folder}: create it, or check the name)" if folder_is_missing else ""
        print_stderr(bounded(f"Error: {error.strerror or error}{where}{hint}"))
        return UNDECIDED if is_machine_failure(error) else USAGE_ERROR
    if isinstance(error, ImportError) and not (error.name or "").startswith("kahanmaps"):
        print_stderr(bounded(f"Error: {error.name or 'a library'} cannot be loaded: {error}; install it again"))
        return UNDECIDED
    print_stderr(bounded(f"Internal error: {type(error).__name__}: {error}"))
    sources = " and ".join(getattr(error, "__notes__", ()))
    cause = f"Either {sources}, which was being read, is damaged, or this" if sources else "This"
    print_stderr(bounded(f"{cause} is a bug in kahanmaps. KAHANMAPS_DEBUG=1 shows where it happened."))
    return INTERNAL_ERROR


if __name__ == "__main__":
    sys.exit(main())
