"""Grids: all combinations of axes, counted without being walked, in an order that is fixed; ranges are exact."""

import re
from itertools import product

import pytest
from helpers import fraction, rationals, refuses
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.experiments.grid import Grid, RationalRange

HUGE = 10**18


def naive(first, last, step):
    """What a range is, value by value."""
    values = []
    while first <= last if step > 0 else first >= last:
        values.append(first)
        first += step
    return values


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("1..3", ["1", "2", "3"]),
        ("0.1..0.3 step 0.1", ["1/10", "1/5", "3/10"]),  # floating-point numbers would end at 0.2
        ("0..1 step 0.3", ["0", "3/10", "3/5", "9/10"]),  # the end is not met
        ("0..1 step 2", ["0"]),
        ("0..1:1/2", ["0", "1/2", "1"]),
        ("1/2..-1/2 step -1/3", ["1/2", "1/6", "-1/6", "-1/2"]),
        (" 1 .. 2  step  1/2 ", ["1", "3/2", "2"]),
        (".5..1.5", ["1/2", "3/2"]),
        ("1/3...5 step .1", ["1/3", "13/30"]),  # up to .5
    ],
)
def test_a_range_is_exact(text, values):
    assert list(map(str, RationalRange.from_text(text))) == values


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1..5 step 0", "found a range of step 0, expected another step"),
        ("5..1", "found a range without values, from 5 to 1 in steps of 1 (for a falling range write a negative step)"),

        ("..", 'found \'..\', expected "FIRST..LAST", "FIRST..LAST:STEP" or "FIRST..LAST step STEP", e.g. "1'),
        ("1..", "expected \"FIRST..LAST\""),
        ("5", "expected \"FIRST..LAST\""),
        ("1..5 step", "expected \"FIRST..LAST\""),
        ("1..5:1:2", "found '1:2', expected an integer, p/q or a decimal"),
        ("1..5 step 1 2", "expected \"FIRST..LAST\""),
        ("1..5 Step 2", "expected \"FIRST..LAST\""),
        ("1..3..5", "found '3..5', expected an integer, p/q or a decimal"),
        ("a..b", "found 'a', expected an integer, p/q or a decimal"),
        ("0..1e30", "too many values"),
        ("0..1 step 1e-5000", "too many values"),
    ],
)  # fmt: skip
def test_a_wrong_range_is_refused_in_a_sentence(text, words):
    refuses(re.escape(words), RationalRange.from_text, text)


@given(rationals(12), rationals(12), rationals(6))
def test_a_range_is_what_a_loop_gives(first, last, step):
    assume(step != 0)
    expected = naive(fraction(first), fraction(last), fraction(step))
    if not expected:
        refuses("without values", RationalRange, first, last, step)
        return
    result = RationalRange(first, last, step)
    assert len(result) == len(expected)
    assert [fraction(value) for value in result] == expected


def combinations(axes, zips):
    """What a grid is: itertools.product of the axes, zipped ones in one."""
    groups: list[list[str]] = []
    for name in axes:
        group = next((names for names in zips if name in names), [name])
        if group not in groups:
            groups.append(group)
    columns = [list(zip(*(axes[name] for name in group), strict=True)) for group in groups]
    return [
        {name: x for group, values in zip(groups, row, strict=True) for name, x in zip(group, values, strict=True)}
        for row in product(*columns)
    ]


@st.composite
def grids(draw):
    names = draw(st.permutations("abcde"))[: draw(st.integers(0, 5))]
    axes = {name: draw(st.lists(st.integers(0, 9), min_size=1, max_size=3)) for name in names}
    zips: list[list[str]] = []
    free = list(names)
    while len(free) > 1 and draw(st.booleans()):
        chosen = draw(st.lists(st.sampled_from(free), min_size=2, max_size=3, unique=True))
        length = min(len(axes[name]) for name in chosen)
        axes |= {name: axes[name][:length] for name in chosen}
        zips.append(chosen)
        free = [name for name in free if name not in chosen]
    return axes, zips


@given(grids())
def test_a_grid_is_the_product_of_its_axes_in_order(case):
    axes, zips = case
    grid, expected = Grid(axes, zips), combinations(axes, zips)
    assert grid.size == len(expected)
    assert list(grid) == expected
    assert [grid[k] for k in range(grid.size)] == expected


def test_a_huge_grid_is_not_enumerated():
    axis = RationalRange.from_text(f"0..{HUGE - 1}")
    grid = Grid({"a": axis, "b": axis, "c": axis})
    assert grid.size == HUGE**3  # more than `len` may be
    assert grid[grid.size - 1] == {"a": HUGE - 1, "b": HUGE - 1, "c": HUGE - 1}
    assert grid[HUGE + 7] == {"a": 0, "b": 1, "c": 7}
    assert next(iter(grid)) == {"a": 0, "b": 0, "c": 0}
