"""Summaries: groups and their order, counts, quantiles that are values which occur, and the tables made of them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.display.experiments import summary_markdown
from kahanmaps.experiments.results.records import Outcome, Record, Row, Task
from kahanmaps.experiments.results.summary import QUANTILES, summarise


def task(m=2, system=None, **options):
    return Task("orbit", {"family": {"m": m}} if system is None else system, options)


def row(result=None, outcome=Outcome.OK, of=None, **more):
    of = of or task()
    return Row("e", 0, of, Record(of.key, outcome, result, **more))


MISSING = Row("e", 0, task(), None)


def keys(rows, *by):
    """The values of the groups, in order."""
    groups = [group.values for group in summarise(rows, by).groups]
    return [value for (value,) in groups] if len(by) == 1 else groups


def numbers_of(rows, **options):
    """The numbers of the only group."""
    (group,) = summarise(rows, **options).to_json()["groups"]
    return group["numbers"]


def test_tasks_are_counted_by_outcome_and_verdict():
    rows = [row({}, verdict=verdict) for verdict in ("proved", "proved", "refuted", "own word")]
    (group,) = summarise([*rows, row(outcome=Outcome.TIMEOUT), MISSING]).to_json()["groups"]
    assert (group["tasks"], group["missing"]) == (6, 1)
    assert group["outcomes"] == {"ok": 4, "failed": 0, "crashed": 0, "timeout": 1, "out-of-memory": 0}
    assert group["verdicts"] == {"proved": 2, "supported": 0, "refuted": 1, "undecided": 0, "own word": 1}


@given(st.lists(st.integers(-20, 20) | st.floats(-1e9, 1e9) | st.fractions().map(str), min_size=1, max_size=30))
def test_quantiles_are_values_that_occur_at_their_rank(values):
    result = numbers_of([row({"x": value}) for value in values], stable=True)["x"]
    ordered = sorted(eval(str(value)) for value in values)  # Python rounds quotients of integers correctly
    assert (result["n"], result["same"]) == (len(values), len(set(ordered)) == 1)
    for name, percent in QUANTILES.items():  # the least value with so many percent at or below it
        assert result[name] == next(x for x in ordered if 100 * sum(y <= x for y in ordered) >= percent * len(values))


def test_numbers_beyond_the_range_of_doubles_are_counted_at_the_ends():
    result = numbers_of([row({"x": value}) for value in ("1e9999", 7, f"-1{'0' * 400}/3")])["x"]
    assert (result["n"], result["min"], result["median"], result["max"]) == (3, None, 7, None)


@pytest.mark.parametrize("text", ["", "1/0", "1e99999", "0x10", "1_000", "nan", "1" * 2001, "١", None, [1]])
def test_what_is_no_exact_number_is_not_summed_up(text):
    assert list(numbers_of([row({"x": text, "y": 1})], stable=True)) == ["y"]


def test_groups_are_in_the_order_of_numbers_then_flags_then_texts_then_nothing():
    ordered = ["1/10", "1/7", "0.5", 2, 10, False, True, "b10", "x", None]
    assert keys([row({"v": ordered[7 * k % 10]}) for k in range(10)], "v") == ordered


def test_equal_numbers_are_one_group_however_they_are_written_and_no_others():
    assert keys([row({"v": value}) for value in ("1/2", 0.5, "0.50", 1, True, "1")], "v") == ["1/2", 1, True]
    near = "0.33333333333333333333"  # the same double as 1/3
    assert keys([row({"v": value}) for value in ("1/3", near)], "v") == [near, "1/3"]


def test_rows_are_grouped_by_options_parts_of_the_recipe_and_results():
    file = {"document": "d1", "parameters": {"a": "1/2"}}
    rows = [row({"dimension": 6}, of=task(m=3, eps="1/10")), row({"dimension": 8}, of=task(system=file, eps="1/7"))]
    assert keys(rows, "eps", "m") == [("1/10", 3), ("1/7", None)]
    assert keys(rows, "parameters.a") == ["1/2", None]
    assert keys([*rows, MISSING], "dimension") == [6, 8, None]
    assert keys(rows, "document") == ["d1", None]
    assert keys(rows, "system") == ["d1 a=1/2", "family m=3"]
    assert keys([row(outcome=Outcome.FAILED, message="no"), row({})], "outcome", "message") == [
        ("failed", "no"),
        ("ok", None),
    ]


def test_the_tables_have_tabs_or_bars_between_their_cells():
    rows = [
        row({"height": "7/3", "done": True}, of=task(m=10), verdict="proved", seconds=0.123456789),
        row({"height": "5/3", "done": False}, of=task(m=10), verdict="refuted", seconds=0.1),
        row({"height": 4, "done": True}, of=task(m=9), verdict="proved", seconds=3.0),
    ]
    summary = summarise(rows, ["m"], ["height", "done"])
    assert list(summary.lines()) == [
        "m\ttasks\tok\tproved\trefuted",
        "9\t1\t1\t1\t0",
        "10\t2\t2\t1\t1",
        "",
        "m\tnumber\tn\tsame\tmin\t5 %\tmedian\t95 %\tmax",
        "9\theight\t1\tyes" + 5 * "\t4",
        "10\theight\t2\tno" + 3 * "\t1.66667" + 2 * "\t2.33333",
        "",
        "m\tflag\ttrue\tfalse",
        "9\tdone\t1\t0",
        "10\tdone\t1\t1",
    ]
    assert summary_markdown(summary).startswith("| m | tasks | ok | proved | refuted |\n| --- | ---: |")
