"""One name for one thing: what an option refuses is refused by every command that has it."""

from collections import defaultdict

import click
from command_tree import all_commands, names_of, options_of
from helpers import together

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
