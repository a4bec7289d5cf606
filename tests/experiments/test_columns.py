"""Pairs of numbers from results: by the names of summaries, exact numbers as doubles, words in their order."""

import pytest

from kahanmaps.errors import InputError
from kahanmaps.experiments.results.columns import value_pairs
from kahanmaps.experiments.results.records import Outcome, Record, Row, Task


def row(number, result, options=None, outcome=Outcome.OK, verdict=None):
    task = Task("orbit", {"family": {"m": 1 + number % 2, "seed": number}}, options or {"eps": f"1/{number + 1}"})
    record = None if result is None else Record(task.key, outcome, result, verdict, seconds=0.5 + number)
    return Row("e", number, task, record)


def test_exact_numbers_are_doubles():
    found = value_pairs([row(0, {"h": "7/2"}), row(1, {"h": 3}), row(2, {"h": 0.25})], "eps", "h")
    assert found.x.values == [1.0, 1 / 2, 1 / 3]
    assert found.y.values == [3.5, 3.0, 0.25]
    assert (found.x.categories, found.missing, found.left_out) == (None, 0, 0)


def test_words_have_places_in_their_order():
    rows = [row(0, {"h": 1}, verdict="refuted"), row(1, {"h": 2}, verdict="proved"), row(2, {"h": 3}, verdict="proved")]
    found = value_pairs(rows, "verdict", "h")
    assert found.x.categories == ("proved", "refuted")
    assert found.x.values == [1.0, 0.0, 0.0]


def test_series_are_words_even_if_they_are_numbers():
    found = value_pairs([row(k, {"h": k}) for k in range(3)], "eps", "h", "m")
    assert (found.series.categories, found.series.values) == (("1", "2"), [0.0, 1.0, 0.0])


def test_what_has_no_number_is_counted():
    rows = [row(0, {"h": 1}), row(1, None), row(2, {}), row(3, {"h": "many"}), row(4, {"h": True})]
    found = value_pairs(rows, "eps", "h")
    assert (len(found.y.values), found.missing, found.left_out) == (1, 1, 3)


@pytest.mark.parametrize(("x", "y"), [("epsi", "h"), ("eps", "hh"), ("eps", "word")])
def test_names_without_numbers_are_refused(x, y):
    with pytest.raises(InputError, match="found the unknown name"):
        value_pairs([row(0, {"h": 1, "word": "many"})], x, y)
