"""All commands of the command line, and the examples in their help."""

import re
import shlex
from collections.abc import Iterator

import click

from kahanmaps.checks.table import CHECKS
from kahanmaps_cli.main import WELCOME, cli
from kahanmaps_cli.options import Renamed

# The least that a command needs, as quick as it can be, in the folder of the fixture `least_folder`.
LEAST = {
    "systems": "euler_top",
    "orbit": "harmonic --start 1,2 --eps 1/10 --steps 1",
    "period": "paper_m2 --start 1,2,3,4 --eps 1/10 --arithmetic mod:7",
    "ensemble": "harmonic --random 1 --eps 1/10 --steps 1",
    **{name: "harmonic harmonic" if check.is_of_pair else "harmonic" for name, check in CHECKS.items()},
    "analyze": "harmonic --seconds 1",
    "degrees": "harmonic --terms 3 --seconds 1",
    "scan": "henon_heiles --over c --primes 5,7,11 --terms 2",
    "heights": "harmonic --steps 20 --seconds 1",
    "find-integrals": "harmonic --seconds 1",
    "find-density": "harmonic --seconds 1",
    "find-poisson": "harmonic --seconds 1",
    "find-symmetry": "harmonic --seconds 1",
    "find-commuting": "harmonic --seconds 1",
    "singularities": "harmonic --seconds 1",
    "cycles": "harmonic --prime 5 --eps 1/3 --seconds 1",
    "lyapunov": "harmonic --random 1 --eps 1/10 --steps 100 --seconds 1",
    "verify": "--m 1 --section 2",
    "family new": "--m 1",
    "family show": "paper_m2",
    "family space": "paper_m2",
    "family tensor": "harmonic --algebra t^2-2",
    "family associated": "paper_m2",
    "batch run": "SPEC --dry-run",
    "batch status": "--db DB",
    "batch show": "0000 --db DB",
    "batch export": "--csv --db DB",
    "batch summary": "--db DB",
    "batch merge": "OTHER DB",
    "batch tasks": "",
    "plot commute": "harmonic harmonic --start 1,2 --eps 1/10 --steps 1 --format text",
    "plot degrees": "harmonic --terms 3 --seconds 1 --format text",
    "plot drift": "harmonic --start 1,2 --eps 1/10 --steps 2 --format text",
    "plot heights": "harmonic --start 1,2 --eps 1/10 --steps 3 --seconds 1 --format text",
    "plot invariant-curves": "paper_m2 --start 1,2,3,4 --eps 1/100 --steps 2 --format text",
    "plot scan": "zhukovski_volterra_2 --over b1,b2 --primes 5,7,11 --terms 2 --format text",
    "plot portrait": "harmonic --start 1,2 --eps 1/10 --steps 2 --format text",
    "plot batch": "DB --format text",
    "plot recipe": "PICTURE",
    "report": "harmonic --from checks --no-pictures",
    "convert": "harmonic --to latex",
    "schema": "",
    "completion": "bash",
    "manual": "",
    "version": "",
}


def all_commands() -> list[tuple[str, click.Command]]:
    """Every command and subcommand with the words that call it, without `kahanmaps`; the group itself first."""
    return list(_below("", cli))


def _below(words: str, command: click.Command) -> Iterator[tuple[str, click.Command]]:
    yield words, command
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            found = command.get_command(context, name)
            assert found is not None
            yield from _below(f"{words} {name}".strip(), found)


def names_of(option: click.Option) -> list[str]:
    """The names of an option that its help shows."""
    return option.opts[:1] if isinstance(option, Renamed) else list(option.opts)


def options_of(command: click.Command) -> list[click.Option]:
    """The options that its help shows."""
    return [option for option in command.params if isinstance(option, click.Option) and not option.hidden]


def examples_in(text: str) -> list[str]:
    """The lines that begin with `kahanmaps`, those that end with a backslash joined with the next."""
    joined = re.sub(r"\\\n\s*", "", text)
    return [line.strip() for line in joined.splitlines() if re.match(r"\s+kahanmaps( |$)", line)]


def all_examples() -> list[str]:
    """Every example in the help of every command, and in the first steps."""
    texts = [command.help or "" for _, command in all_commands()]
    found = [example for text in [*texts, WELCOME] for example in examples_in(text)]
    return list(dict.fromkeys(example for example in found if "--help" not in example))


def words_of(example: str) -> list[str]:
    """What an example hands to kahanmaps: without comments, redirections and what comes behind a pipe."""
    words = shlex.split(example, comments=True)
    end = next((k for k, word in enumerate(words) if word in ("|", ">")), len(words))
    return words[1:end]
