"""One name for one thing: options that several commands share have one spelling, one metavar and one meaning."""

from collections import defaultdict

import click
import pytest
from command_tree import all_commands, names_of, options_of

LEAVES = [(words, command) for words, command in all_commands() if not isinstance(command, click.Group)]
# Others tell how the command uses them: what --steps counts.
SAME_WORDS = [
    *("json", "eps", "time-step", "vars", "rhs", "symbolic", "backward", "starts"),
    *("random", "box", "db", "m", "eigenvalues", "chi", "color", "effort", "seconds"),
]


def by_name() -> dict[str, list[tuple[str, click.Option]]]:
    """Every long option with the commands that have it."""
    found: dict[str, list[tuple[str, click.Option]]] = defaultdict(list)
    for words, command in LEAVES:
        for option in options_of(command):
            for name in names_of(option):
                found[name].append((words, option))
    return found


def own(words: str) -> bool:
    """Whether a command is older than pictures and pages, which have words of their own for a few things."""
    return words.split()[0] not in ("plot", "report", "convert")


@pytest.mark.parametrize("name", SAME_WORDS)
def test_an_option_that_means_the_same_says_the_same(name):
    told = {str(option.help).removesuffix(" Repeatable.") for words, option in by_name()[f"--{name}"] if own(words)}
    if name == "random":  # of heights as well, which has no --starts FILE
        told.discard("N starts drawn at random (default 3).")
    assert len(told) == 1


def test_an_option_has_the_same_metavar_everywhere():
    found = {
        name: {option.metavar or option.type.name for words, option in options if own(words) and not option.is_flag}
        for name, options in by_name().items()
    }
    exceptions = {"-o", "--output", "--integral", "--experiment", "-e", "--by"}
    assert {name: several for name, several in found.items() if len(several) > 1 and name not in exceptions} == {}


def test_whoever_takes_eps_takes_the_time_step():
    options = by_name()
    with_eps = {words for words, _ in options["--eps"] if own(words)}
    assert with_eps == {words for words, _ in options["--time-step"] if own(words)}


def test_whoever_takes_right_hand_sides_takes_parameters():
    options = by_name()
    assert {words for words, _ in options["--rhs"]} <= {words for words, _ in options["-p"]}


@pytest.mark.parametrize("words", [words for words, _ in by_name()["--seed"] if own(words)])
def test_a_negative_seed_is_refused_by_every_command(kahanmaps, words):
    outcome = kahanmaps(words, "--seed -1")
    assert outcome.status == 2
    assert "found '-1', expected an integer, 0 or more" in outcome.err


@pytest.mark.parametrize("value", ["0", "inf", "x"])
@pytest.mark.parametrize("words", [words for words, _ in by_name()["--seconds"] if own(words)])
def test_a_time_that_is_none_is_refused_by_every_command(kahanmaps, words, value):
    outcome = kahanmaps(words, f"--seconds {value}")
    assert outcome.status == 2
    assert f"found '{value}', expected a number of seconds above 0" in outcome.err


@pytest.mark.parametrize(("value", "found"), [("x", "'x', expected an integer"), ("99", "99, expected -20 to 40")])
@pytest.mark.parametrize("words", [words for words, _ in by_name()["--effort"] if own(words)])
def test_an_effort_that_is_none_is_refused_by_every_command(kahanmaps, words, value, found):
    outcome = kahanmaps(words, f"--effort {value}")
    assert outcome.status == 2
    assert f"found {found}" in outcome.err


def test_the_old_name_of_an_option_still_works(kahanmaps):
    new = kahanmaps("heights weierstrass --eps 1/10 --random 1 --steps 20")
    assert kahanmaps("heights weierstrass --eps 1/10 --starts 1 --steps 20") == new
