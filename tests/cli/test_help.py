"""Help: examples first and as they stand, lines that fit 80 columns, commands under headings."""

import click
import pytest
from command_tree import all_commands, all_examples, examples_in, words_of
from helpers import together

from kahanmaps_cli.main import SECTIONS, cli

# What runs in a fraction of a second, and needs no file.
COMMANDS_AND_GROUPS = [words for words, _ in all_commands()]


def parsed(words: list[str]) -> None:
    """Let click read the options of an example, and run nothing."""
    command: click.Command = cli
    context = click.Context(cli)
    name = "kahanmaps"
    while isinstance(command, click.Group) and words:
        found = command.get_command(context, words[0])
        assert found is not None, words[0]
        name, command, words = words[0], found, words[1:]
    try:
        command.make_context(name, list(words), parent=context)
    except click.BadParameter as error:
        if not error.message.endswith("does not exist."):  # a file that an example before this one makes
            raise


@together("words", COMMANDS_AND_GROUPS)
def test_help_fits_80_columns(kahanmaps, monkeypatch, words):
    monkeypatch.setenv("COLUMNS", "80")
    assert [line for line in kahanmaps(words, "--help").out.splitlines() if len(line) > 80] == []


@together("words", COMMANDS_AND_GROUPS)
def test_examples_come_right_after_the_first_sentence(words):
    help_text = dict(all_commands())[words].help or ""
    _, second, *_ = [*help_text.split("\n\n"), "", ""]
    assert examples_in(second)


@together("words", COMMANDS_AND_GROUPS)
def test_the_first_paragraph_is_one_sentence_or_question(words):
    first = " ".join((dict(all_commands())[words].help or "").split("\n\n")[0].split())
    assert first[-1] in ".?"
    assert ". " not in first.replace("e.g. ", "")


@together("example", all_examples())
def test_the_options_of_an_example_are_understood(example):
    parsed(words_of(example))


def test_an_example_with_a_wrong_option_would_be_noticed():
    with pytest.raises(click.UsageError):
        parsed(words_of("kahanmaps orbit euler_top --strat 1,2,3  # no such option"))


def test_the_headings_are_in_the_help(kahanmaps):
    lines = kahanmaps("--help").out.splitlines()
    assert [f"{heading}:" for heading in SECTIONS if f"{heading}:" not in lines] == []


@pytest.mark.parametrize("group", ["family", "batch", "plot"])
def test_the_first_sentences_in_the_list_of_a_group_are_not_cut(kahanmaps, group):
    lines = kahanmaps(group, "--help").out.partition("Commands:\n")[2].splitlines()
    assert [line for line in lines if line.endswith("...")] == []
    assert lines[-1].endswith(".")
