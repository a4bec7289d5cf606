"""The options in the examples of help are those that there are."""

import click
import pytest
from command_tree import all_examples, words_of
from helpers import together

from kahanmaps_cli.main import cli


def parsed(words: list[str]) -> None:
    """Let click read the options of an example, and run nothing."""
    command: click.Command = cli
    context = click.Context(cli)
    name = "kahanmaps"
    while isinstance(command, click.Group) and words:
        result = command.get_command(context, words[0])
        assert result is not None, words[0]
        name, command, words = words[0], result, words[1:]
    try:
        command.make_context(name, list(words), parent=context)
    except click.BadParameter as error:
        if not error.message.endswith("does not exist."):  # a file that an example before this one makes
            raise


@together("example", all_examples())
def test_the_options_of_an_example_are_understood(example):
    parsed(words_of(example))


def test_an_example_with_a_wrong_option_would_be_noticed():
    with pytest.raises(click.UsageError):
        parsed(words_of("kahanmaps orbit euler_top --strat 1,2,3  # no such option"))
