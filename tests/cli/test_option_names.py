"""One name for one thing: what an option refuses is refused by every command that has it; examples of help use those
that there are.
"""

from collections import defaultdict

import click
import pytest
from command_tree import all_commands, all_examples, names_of, options_of, words_of
from helpers import together

from kahanmaps_cli.main import cli

REFUSED = [
    ("--seed", "-1", "'-1', expected an integer, 0 or more"),
    *(("--seconds", value, f"'{value}', expected a number of seconds above 0") for value in ("0", "inf", "x")),
    ("--effort", "x", "'x', expected an integer"),
    ("--effort", "99", "99, expected -20 to 40"),
]


def by_name() -> dict[str, set[str]]:
    """The commands that have an option; pictures and pages have words of their own for a few things."""
    result: dict[str, set[str]] = defaultdict(set)
    for words, command in all_commands():
        if not isinstance(command, click.Group) and words.split()[0] not in ("plot", "report", "convert"):
            for option in options_of(command):
                for name in names_of(option):
                    result[name].add(words)
    return result


def test_whoever_takes_eps_takes_the_time_step():
    assert by_name()["--eps"] == by_name()["--time-step"] != set()


@together("option, value, result", REFUSED)
def test_a_value_that_is_none_is_refused_by_every_command(kahanmaps, option, value, result):
    assert by_name()[option]
    for words in by_name()[option]:
        outcome = kahanmaps(words, f"{option} {value}")
        assert (outcome.status, f"found {result}" in outcome.err) == (2, True), words


def test_the_old_name_of_an_option_still_works(kahanmaps):
    new = kahanmaps("heights weierstrass --eps 1/10 --random 1 --steps 20")
    assert kahanmaps("heights weierstrass --eps 1/10 --starts 1 --steps 20") == new


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
