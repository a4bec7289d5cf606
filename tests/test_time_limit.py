"""The hard stop: the only thing that a clock decides, and no module of the library reads one for its answers."""

import math
import signal
import time
from contextlib import suppress

import pytest

from kahanmaps.documents.catalog import load
from kahanmaps.errors import InputError
from kahanmaps.hard_stop import TimeLimit, time_limit
from kahanmaps.laboratory.analysis import analyze
from kahanmaps.laboratory.preserve.densities import find_densities
from kahanmaps.laboratory.preserve.poisson.poisson_tensors import find_poisson
from kahanmaps.laboratory.symmetry.symmetries import linear_symmetries

pytestmark = pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timers here")


def busy():
    while True:
        math.sqrt(2)


def test_what_is_done_in_time_is_not_disturbed_and_all_is_as_before():
    before, timer = signal.getsignal(signal.SIGALRM), signal.getitimer(signal.ITIMER_REAL)[0]  # pytest may have one
    with time_limit(20):
        assert signal.getsignal(signal.SIGALRM) is not before
    assert signal.getsignal(signal.SIGALRM) is before
    assert timer - 10 < signal.getitimer(signal.ITIMER_REAL)[0] <= timer
    with time_limit(None):
        assert signal.getsignal(signal.SIGALRM) is before
    with pytest.raises(ZeroDivisionError), time_limit(20):
        1 // 0  # noqa: B018
    assert signal.getsignal(signal.SIGALRM) is before


@pytest.mark.parametrize(("outer", "inner", "which"), [(60, 0.02, "0.02"), (0.02, 60, "0.02")])
def test_the_shorter_of_two_limits_stops(outer, inner, which):
    began = time.monotonic()
    with pytest.raises(TimeLimit, match=f"the time limit of {which} s is over"), time_limit(outer), time_limit(inner):
        busy()
    assert time.monotonic() - began < 10


def test_the_outer_limit_goes_on_after_the_inner_one():
    def two():
        with time_limit(0.01), suppress(TimeLimit):
            busy()
        busy()

    with pytest.raises(TimeLimit, match=r"of 0.1 s"), time_limit(0.1):
        two()


def test_the_time_of_an_inner_limit_is_taken_from_the_outer_one():
    with time_limit(20):
        with time_limit(0.3), suppress(TimeLimit):
            busy()
        assert signal.getitimer(signal.ITIMER_REAL)[0] < 19.8


@pytest.mark.parametrize("seconds", [0, -1, float("nan"), float("inf")])
def test_other_times_are_refused(seconds):
    with pytest.raises(InputError, match="expected a positive number"), time_limit(seconds):
        pass


def test_what_an_analysis_had_completed_stays_as_it_is():
    last = []

    def on_result(result):
        last[:] = [result]
        if len(result.pending) < 12:
            busy()

    with pytest.raises(TimeLimit) as stop, time_limit(0.5):
        analyze(load("harmonic"), on_result=on_result)
    (result,) = last
    complete = analyze(load("harmonic"))
    assert result.pending
    done = [step for step in complete.analyses if step.name not in result.pending]
    assert [step.to_json(result) for step in done] == [step.to_json(complete) for step in done]
    pending = list(result.pending)
    result.interrupt(str(stop.value))
    assert result.skipped == [f"{part}: the time limit of 0.5 s is over" for part in pending]
    assert (result.interrupted, result.pending) == (True, [])


@pytest.mark.parametrize(
    ("search", "system", "parts"),
    [
        (find_poisson, "euler_top", "tensors"),
        (find_densities, "lotka_volterra", "densities"),
        (linear_symmetries, "euler_top", "symmetries"),
    ],
)
def test_a_search_hands_over_what_it_has_before_it_goes_on(search, system, parts):
    results = []
    final = search(load(system), on_result=results.append)
    assert results
    partial = getattr(results[-1], parts)
    assert 0 < len(partial) <= len(getattr(final, parts))
    if search is not linear_symmetries:  # which goes on to fill its result
        assert "interrupted" in results[-1].reason
        assert "interrupted" not in final.reason
