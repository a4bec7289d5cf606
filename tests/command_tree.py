"""All commands of the command line, and the examples in their help."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import click
from helpers import table

from kahanmaps.checks.table import CHECKS
from kahanmaps_cli.main import WELCOME, cli
from kahanmaps_cli.options import RenamedOption

# The least that a command needs, in the folder of the fixture `least_folder`.
LEAST = dict(line.split(" => ") for line in table(Path(__file__).with_name("cli") / "least.txt")["least"])
LEAST |= {name: "harmonic harmonic" if check.is_of_pair else "harmonic" for name, check in CHECKS.items()}


def all_commands() -> list[tuple[str, click.Command]]:
    """Every command and subcommand with the words that call it, without `kahanmaps`; the group itself first."""
    return list(_below("", cli))


def _below(words: str, command: click.Command) -> Iterator[tuple[str, click.Command]]:
    yield words, command
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            result = command.get_command(context, name)
            assert result is not None
            yield from _below(f"{words} {name}".strip(), result)


def names_of(option: click.Option) -> list[str]:
    """The names of an option that its help shows."""
    return option.opts[:1] if isinstance(option, RenamedOption) else list(option.opts)


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
    results = [example for text in [*texts, WELCOME] for example in examples_in(text)]
    return list(dict.fromkeys(example for example in results if "--help" not in example))


def words_of(example: str) -> list[str]:
    """What an example hands to kahanmaps: without comments, redirections and what comes behind a pipe."""
    words = shlex.split(example, comments=True)
    return words[1 : next((k for k, word in enumerate(words) if word in ("|", ">")), len(words))]
