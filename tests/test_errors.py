"""Messages of errors: bounded in length, pickled whole, and with the name of the file that was being read."""

import pickle

import pytest

from kahanmaps.errors import (
    BadPrime,
    ExpressionError,
    InputError,
    SingularStep,
    SystemFileError,
    UnknownName,
    bounded,
    quoted,
)


@pytest.mark.parametrize("text", ["x" * 200_000, "x " * 100_000, "x\n" * 200_000, "0" * 1001])
def test_a_long_message_is_cut_and_its_length_is_reported(text):
    result = bounded(f"found {text}, expected less")
    assert len(result) < 1200
    assert max(map(len, result.split("\n"))) <= 1000
    assert result.startswith("found ")
    assert "characters)" in result or "more lines" in result


def test_every_error_is_bounded_and_what_can_be_read_is_left_alone():
    assert len(str(InputError("x" * 9999))) == 300
    many = SystemFileError("a.toml", [("name", "n" * 9999), ("variables", "v" * 9999)])
    assert max(map(len, str(many).split("\n"))) < 400
    for text in ("", "found 'x', expected 'y'", f"there is no file {'/folder' * 40}", "a\nb\n"):
        assert bounded(text) == text
    assert quoted("\x1b[31m" + "y" * 100) == repr("\x1b[31m" + "y" * 35 + "...")  # nothing for a terminal to obey


@pytest.mark.parametrize(
    "error",
    [
        ExpressionError("found 'q'", "p + q", 4),
        UnknownName("found the unknown name 'q'", "p + q", 4),
        SystemFileError("a.toml", [("name", "missing"), ("variables", "missing")]),
        BadPrime("3 divides a denominator", 3),
        SingularStep("det(I - eps f'(x)) = 0", (1, 2), 1),
    ],
)
def test_an_error_is_the_same_after_a_pickle(error):
    error.add_note("a.toml")
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error)
    assert (str(again), vars(again)) == (str(error), vars(error))
