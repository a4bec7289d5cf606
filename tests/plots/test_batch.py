"""Batches drawn: bars that add up, boxes that are the quantiles of the summary, dots for all of few numbers."""

import numpy as np
import pytest

from kahanmaps.errors import InputError
from kahanmaps.experiments.results.columns import value_pairs
from kahanmaps.experiments.results.records import Outcome, Record, Row, Task
from kahanmaps.experiments.results.summary import summarise
from kahanmaps.plots.batch import clipped, draw_batch, draw_pairs, groups_beyond
from kahanmaps.plots.style import Style


def row(number, result=None, *, m=1, outcome=Outcome.OK, verdict=None, missing=False):
    task = Task("orbit", {"family": {"m": m, "seed": number}}, {"eps": f"1/{number + 1}"})
    record = None if missing else Record(task.key, outcome, result or {}, verdict, seconds=0.5)
    return Row("e", number, task, record)


def numbers(values, m=1):
    return [row(1000 * m + k, {"c": value}, m=m) for k, value in enumerate(values)]


def bars(axes):
    """The widths of the bars by kind, from the top down."""
    return {c.get_label(): [patch.get_width() for patch in c.patches] for c in axes.containers}


def test_bars_are_what_became_of_the_tasks():
    rows = [
        row(0, verdict="proved"),
        row(1, verdict="proved"),
        row(2, verdict="refuted"),
        row(3),
        row(4, outcome=Outcome.FAILED),
        row(5, missing=True),
        row(6, m=2, verdict="proved"),
    ]
    [axes] = draw_batch(summarise(rows, ["m"])).axes
    assert bars(axes) == {"proved": [2, 1], "refuted": [1, 0], "ok": [1, 0], "failed": [1, 0], "missing": [1, 0]}
    assert [text.get_text() for text in axes.texts] == ["6", "1"]
    assert axes.get_ylabel() == "$m$"


def test_bars_stand_one_after_the_other():
    [axes] = draw_batch(summarise([row(0, verdict="proved"), row(1, missing=True)], ["m"])).axes
    proved, missing = axes.containers
    assert (proved.patches[0].get_x(), missing.patches[0].get_x()) == (0, 1)


def test_a_box_is_made_of_the_quantiles_of_the_summary():
    summary = summarise(numbers(range(101)), ["m"])
    [axes] = draw_batch(summary, ["c"]).axes
    q = summary.groups[0].numbers["c"].quantiles
    [box] = [patch for patch in axes.patches if patch.get_path().vertices[:, 0].min() == q["p25"]]
    assert box.get_path().vertices[:, 0].max() == q["p75"]
    drawn = {float(x) for line in axes.lines for x in line.get_xdata()}
    assert {float(q[name]) for name in ("min", "p5", "median", "p95", "max")} <= drawn


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
def test_few_numbers_are_dots_all_of_them(count):
    values = [3, 1, 4, 15, 9][:count]
    [axes] = draw_batch(summarise(numbers(values), ["m"]), ["c"]).axes
    assert len(axes.patches) == 0
    assert sorted(axes.lines[0].get_xdata()) == sorted(values)


def test_six_numbers_are_a_box():
    [axes] = draw_batch(summarise(numbers(range(6)), ["m"]), ["c"]).axes
    assert len(axes.patches) == 1


@pytest.mark.parametrize(
    ("values", "asked", "expected"),
    [([1, 10, 2000], None, "log"), ([0, 10, 2000], None, "linear"), ([1, 2], None, "linear"), ([1, 2], "log", "log")],
)
def test_the_scale_is_by_the_range_of_the_numbers(values, asked, expected):
    assert draw_batch(summarise(numbers(values), ["m"]), ["c"], scale=asked).axes[0].get_xscale() == expected


def test_a_logarithmic_scale_of_negative_numbers_is_refused():
    with pytest.raises(InputError, match="found the number -1, expected positive ones"):
        draw_batch(summarise(numbers([-1, 2]), ["m"]), ["c"], scale="log")


def test_true_and_false_are_counted():
    rows = [row(k, {"flag": k < 3}) for k in range(4)]
    [axes] = draw_batch(summarise(rows, ["m"]), ["flag"]).axes
    assert bars(axes) == {"true": [3], "false": [1]}


def test_numbers_with_few_values_are_counted_unless_a_scale_is_given():
    rows = numbers([1, 1, 1, 2, 2, 1, 1, "2.29663026288653824570"] * 2)
    axes = draw_batch(summarise(rows, []), ["c"]).axes[0]
    assert [label.get_text() for label in axes.figure.legends[0].get_texts()] == ["c = 1", "c = 2", "c = 2.29663"]
    assert [bar.get_width() for bar in axes.patches] == [10, 4, 2]
    assert not draw_batch(summarise(rows, []), ["c"], scale="linear").legends
    assert not draw_batch(summarise(numbers(range(16)), []), ["c"]).legends


def test_several_values_are_several_panels():
    figure = draw_batch(summarise(numbers(range(9)), ["m"]), ["c", "seconds"], Style(width=17))
    assert [axes.get_xlabel() for axes in figure.axes] == ["$c$", "tasks by seconds"]


def test_of_numbers_beyond_doubles_the_finite_quantiles_are_drawn_and_the_others_told():
    summary = summarise(numbers(["1" + "0" * 400, 1, 2, 3, 4, 5]), ["m"])
    [axes] = draw_batch(summary, ["c"]).axes
    assert sorted(axes.lines[0].get_xdata()) == [1, 2, 3, 5]
    assert groups_beyond(summary, "c") == 1


@pytest.mark.parametrize("count", [0, 41])
def test_no_group_and_too_many_are_refused(count):
    with pytest.raises(InputError, match=f"found {count} groups"):
        draw_batch(summarise([row(k, m=k) for k in range(count)], ["m"]))


def test_a_number_that_nobody_has_is_refused():
    with pytest.raises(InputError, match="found no number d"):
        draw_batch(summarise(numbers([1]), ["m"]), ["d"])


def test_pairs_are_dots():
    [axes] = draw_pairs(value_pairs(numbers([3, 1, 2]), "eps", "c")).axes
    assert axes.lines[0].get_ydata().tolist() == [3, 1, 2]
    assert (axes.get_xlabel(), axes.get_ylabel()) == (r"$\varepsilon$", "$c$")


def test_series_differ_in_colour_and_mark():
    rows = [*numbers([1, 2], m=1), *numbers([3, 4], m=2)]
    figure = draw_pairs(value_pairs(rows, "eps", "c", "m"))
    first, second = (line for line in figure.axes[0].lines if len(line.get_xdata()))
    assert first.get_color() != second.get_color()
    assert first.get_marker() != second.get_marker()
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["1", "2"]
    assert figure.legends[0].get_title().get_text() == "$m$"


def test_words_along_the_axis_have_medians():
    rows = [row(k, {"c": c}, verdict="proved") for k, c in enumerate([1, 5, 100])]
    [axes] = draw_pairs(value_pairs(rows, "verdict", "c")).axes
    assert [label.get_text() for label in axes.get_xticklabels()] == ["proved"]
    assert axes.lines[1].get_ydata().tolist() == [5, 5]
    assert np.abs(axes.lines[0].get_xdata()).max() < 0.3


def test_infinite_numbers_are_left_out_and_counted():
    pairs = value_pairs(numbers(["1" + "0" * 400, 1]), "eps", "c")
    assert clipped(pairs) == 1
    assert draw_pairs(pairs).axes[0].lines[0].get_ydata().tolist() == [1]
