"""Counted work: budgets, shares of them, efforts, and caches that count as if they were none."""

import threading

import pytest
from helpers import refuses

from kahanmaps.algebra.work import Budget, count_work, counted, counted_cache, units_at


def test_a_budget_is_spent_by_what_is_counted_after_it_was_made():
    count_work(1000)
    budget = Budget(10)
    assert (budget.spent, budget.left, budget.is_spent) == (0, 10, False)
    count_work(9)
    assert (budget.spent, budget.left, budget.is_spent) == (9, 1, False)
    count_work(1)
    assert (budget.left, budget.is_spent) == (0, True)
    count_work(5)
    assert (budget.spent, budget.left) == (15, 0)


def test_fractions_are_counted_as_whole_units_so_that_sums_do_not_depend_on_their_order():
    budget, endless = Budget(100), Budget()
    for _ in range(10):
        count_work(0.1)
    assert budget.spent == 10
    assert budget.part(0.1).units == 9  # of what is left
    assert isinstance(counted(), int)
    count_work(10**12)
    assert (Budget(0).is_spent, endless.is_spent) == (True, False)


def test_what_a_stage_leaves_goes_to_those_after_it_and_what_it_takes_too_much_is_theirs_as_well():
    stages = Budget(120).share([1, 2, 3])
    assert next(stages).units == 20
    count_work(0)
    assert next(stages).units == 48  # 2/5 of all 120
    count_work(100)
    assert next(stages).units == 20
    stages = Budget(100).share([1, 1])
    next(stages)
    count_work(150)
    last = next(stages)
    assert (last.units, last.is_spent) == (0, True)


@pytest.mark.parametrize(("effort", "units"), [(1, 12), (2, 24), (4, 96), (0, 6), (-1, 3)])
def test_each_more_effort_doubles_the_units(effort, units):
    assert units_at(effort, 12) == units


@pytest.mark.parametrize("effort", [True, 1.0, "1", None, 41, -21, float("nan")])
def test_other_efforts_are_refused(effort):
    refuses("expected an integer from -20 to 40", units_at, effort, 1)


def test_a_counted_cache_counts_a_hit_as_a_miss():
    calls = []

    @counted_cache(8)
    def inner(x):
        calls.append(x)
        count_work(100)
        return 2 * x

    @counted_cache(8)
    def outer(x):
        count_work(10)
        return inner(x) + inner(x)

    def units(function, x):
        budget = Budget()
        assert function(x) == (2 if function is inner else 4) * x
        return budget.spent

    assert [units(outer, 1), units(outer, 1), units(inner, 1), units(inner, 2)] == [210, 210, 100, 100]
    assert calls == [1, 2]  # negative control: nothing is computed twice, what is not counted by itself
    assert [units(outer, 2), units(outer, 2)] == [210, 210]  # with a part known already


def test_threads_count_for_themselves():
    budget, others = Budget(), []

    def work():
        before = counted()
        count_work(1000)
        others.append(counted() - before)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert (budget.spent, others) == (0, [1000])
