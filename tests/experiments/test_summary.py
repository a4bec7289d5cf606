"""Summaries: groups and their order, counts, quantiles that are values which occur, and the tables made of them."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.display.experiments import table_markdown
from kahanmaps.errors import InputError
from kahanmaps.experiments.results.records import Outcome, Record, Row, Task
from kahanmaps.experiments.results.summary import QUANTILES, Table, summarise


def task(kind="orbit", m=2, system=None, **options):
    return Task(kind, {"family": {"m": m}} if system is None else system, options)


def row(result=None, outcome=Outcome.OK, of=None, experiment="e", **more):
    of = of or task()
    return Row(experiment, 0, of, Record(of.key, outcome, result, **more))


def missing(of=None):
    return Row("e", 0, of or task(), None)


def keys(rows, *by):
    """The values of the groups, in order."""
    found = [group.values for group in summarise(rows, by).groups]
    return [value for (value,) in found] if len(by) == 1 else found


def numbers_of(values, name="x"):
    (group,) = summarise([row({name: value}) for value in values], stable=True).groups
    return group.numbers[name]


# Counts


def test_tasks_are_counted_by_outcome_and_verdict():
    rows = [
        row({}, verdict="proved"),
        row({}, verdict="proved"),
        row({}, verdict="refuted"),
        row(outcome=Outcome.TIMEOUT),
        missing(),
    ]
    (group,) = summarise(rows).groups
    assert (group.tasks, group.missing) == (5, 1)
    assert group.outcomes == {"ok": 3, "failed": 0, "crashed": 0, "timeout": 1, "out-of-memory": 0}
    assert group.verdicts == {"proved": 2, "supported": 0, "refuted": 1, "undecided": 0}


# Quantiles


def naive(values, percent):
    """Nearest rank, as it is defined: the smallest value with at least so many percent at or below it."""
    for value in sorted(values):
        if 100 * sum(other <= value for other in values) >= percent * len(values):
            return value
    raise AssertionError


TEXTS = (
    st.fractions().map(str)
    | st.decimals(allow_nan=False, allow_infinity=False, places=3).map("{:f}".format)
    | st.sampled_from(["0.5", "1/2", "+.5", "5.", "1e-3", "1e9999", "-1e9999", "1e-9999", "0.50"])
)
NUMBERS = st.integers(-20, 20) | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | TEXTS


@given(st.lists(NUMBERS, min_size=1, max_size=30))
def test_quantiles_are_those_of_a_naive_implementation(values):
    found = numbers_of(values)
    exact = [Fraction(value) for value in values]
    assert found.n == len(values)
    assert {name: Fraction(value) for name, value in found.quantiles.items()} == {
        name: naive(exact, percent) for name, percent in QUANTILES.items()
    }
    assert found.is_same == (len(set(exact)) == 1)


def test_quantiles_of_the_first_integers():
    # By hand: of 1 to 21 the 5 % value has rank ceil(1.05) = 2, the 25 % value rank ceil(5.25) = 6.
    assert list(numbers_of(list(range(21, 0, -1))).quantiles.values()) == [1, 2, 6, 11, 16, 20, 21]


def test_numbers_that_are_equal_as_floats_are_told_apart():
    third, near = "1/3", "0.3333333333333333333333333"
    quantiles = numbers_of([third, near, 1 / 3]).quantiles
    assert [quantiles[name] for name in ("min", "median", "max")] == [1 / 3, near, third]


@pytest.mark.parametrize("text", ["", "1/0", "1e99999", "0x10", "1_000", "nan", "1" * 2001, "١"])
def test_other_texts_are_no_numbers(text):
    (group,) = summarise([row({"x": text, "y": 1})], stable=True).groups
    assert list(group.numbers) == ["y"]


def test_seconds_and_memory_are_summarised_unless_stable():
    rows = [
        row({"a": 1, "seconds": 7}, seconds=2.5, peak_memory=100),
        row(outcome=Outcome.FAILED, seconds=0.5),
        missing(),
    ]
    (group,) = summarise(rows).groups
    assert list(group.numbers) == ["a", "result.seconds", "peak_memory", "seconds"]
    assert [(group.numbers[name].n, group.numbers[name].quantiles["max"]) for name in ("seconds", "peak_memory")] == [
        (2, 2.5),
        (1, 100),
    ]
    (group,) = summarise(rows, stable=True).groups
    assert list(group.numbers) == ["a", "result.seconds"]


# Groups


def test_groups_are_in_the_order_of_numbers_then_flags_then_texts_then_nothing():
    values = ["x", "1/7", None, 10, "0.5", True, 2, "1/10", "b10", False]
    assert keys([row({"v": value}) for value in values], "v") == [
        "1/10",
        "1/7",
        "0.5",
        2,
        10,
        False,
        True,
        "b10",
        "x",
        None,
    ]


def test_equal_numbers_are_one_group_however_they_are_written():
    assert keys([row({"v": value}) for value in ("1/2", 0.5, "0.50", 1, True, "1")], "v") == ["1/2", 1, True]


def test_rows_are_grouped_by_options_parts_of_the_recipe_and_results():
    file = {"document": "d1", "parameters": {"a": "1/2"}}
    rows = [row({"dimension": 6}, of=task(m=3, eps="1/10")), row({"dimension": 8}, of=task(system=file, eps="1/7"))]
    assert keys(rows, "m") == [3, None]
    assert keys(rows, "eps", "m") == [("1/10", 3), ("1/7", None)]
    assert keys(rows, "parameters.a") == ["1/2", None]
    assert keys([*rows, missing()], "dimension") == [6, 8, None]
    assert keys(rows, "document") == ["d1", None]
    assert keys(rows, "system") == ["d1 a=1/2", "family m=3"]


def test_a_name_is_an_option_before_a_part_of_the_recipe_before_a_result():
    one = task(system={"family": {"seed": 2, "m": 3}}, seed=1)
    rows = [row({"seed": 3, "m": 4, "task": 5}, of=one)]
    assert keys(rows, "seed") == [one.value("seed")] == [1]
    assert keys(rows, "m") == [one.value("m")] == [3]
    names = ("option.seed", "family.seed", "result.seed", "result.m", "result.task")
    assert keys(rows, *names) == [(1, 2, 3, 4, 5)]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"by": ["dimensions"]}, r"unknown name 'dimensions', did you mean dimension\? names to group by: dim"),
        (
            {"by": ["zzz"]},
            r"unknown name 'zzz'; names to group by: dimension, document, eps, experiment, height, m, message, out",
        ),
        ({"values": ["heigth"]}, r"unknown name 'heigth', did you mean height\? names of numbers: height, peak"),
        ({"values": ["status"]}, "unknown name 'status'"),  # a text in all of the rows
        ({"values": ["seconds"], "stable": True}, "unknown name 'seconds'"),
    ],
)
def test_a_mistaken_name_is_told_with_those_that_exist(options, message):
    rows = [row({"dimension": "d", "height": 3, "status": "done"}, of=task(eps="1/10"))]
    with pytest.raises(InputError, match=message):
        summarise(rows, **options)


# What is made of it


EXAMPLE = [
    row({"height": "7/3", "done": True}, of=task(m=10), verdict="proved", seconds=0.123456789),
    row({"height": "5/3", "done": False}, of=task(m=10), verdict="refuted", seconds=0.1),
    row({"height": 4, "done": True}, of=task(m=9), verdict="proved", seconds=3.0),
]


def test_the_lines_are_tables_with_tabs():
    assert list(summarise(EXAMPLE, ["m"], ["height", "done"]).lines()) == [
        "m\ttasks\tok\tproved\trefuted",
        "9\t1\t1\t1\t0",
        "10\t2\t2\t1\t1",
        "",
        "m\tnumber\tn\tsame\tmin\t5 %\tmedian\t95 %\tmax",
        "9\theight\t1\tyes\t4\t4\t4\t4\t4",
        "10\theight\t2\tno\t5/3\t5/3\t5/3\t7/3\t7/3",
        "",
        "m\tflag\ttrue\tfalse",
        "9\tdone\t1\t0",
        "10\tdone\t1\t1",
    ]


def test_long_numbers_become_approximations_for_the_eye_only():
    long = "1" * 60 + "/7"
    found = summarise([row({"x": long})], stable=True)
    assert found.numbers().rows[0][-1] == long
    assert found.numbers(4).rows[0][-1] == "~1.587e+58"


def test_markdown_aligns_numbers_on_the_right_and_escapes_bars():
    table = Table("t", ("m", "n"), (("a|b\nc", "1"),), 1)
    assert table_markdown(table) == "| m | n |\n| --- | ---: |\n| a\\|b c | 1 |\n"
