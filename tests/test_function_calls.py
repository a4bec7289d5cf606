"""Calls of public functions at a prompt and in notebooks: an interrupt leaves what was found, progress is shown."""

import signal
import sys
import threading
from types import SimpleNamespace

import pytest
from helpers import refuses

import kahanmaps as km
from kahanmaps import function_calls
from kahanmaps.function_calls import CallError, public_function
from kahanmaps.hard_stop import TimeLimit


@pytest.fixture
def prompt(monkeypatch):
    """A prompt of Python, or a cell of a notebook, runs the test."""
    monkeypatch.setattr(sys, "ps1", ">>> ", raising=False)


def interrupt_at(word):
    """A function for progress= that interrupts this process once, at the first message with the word."""
    done = []

    def progress(message):
        if word in message and not done:
            done.append(message)
            signal.raise_signal(signal.SIGINT)

    return progress


def test_an_interrupt_at_a_prompt_leaves_what_an_analysis_found(prompt):
    analysis = km.analyze("lorenz", progress=interrupt_at("heights"))
    assert analysis.interrupted
    assert analysis.integrals is not None
    assert analysis.degrees is not None
    assert analysis.heights is None
    assert any("interrupted" in line for line in analysis.skipped)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_an_interrupt_at_a_prompt_leaves_the_degrees_measured_so_far(prompt):
    growth = km.degrees("lorenz", progress=interrupt_at("iterate 4"))
    assert growth.degrees == km.degrees("lorenz", max_terms=3).degrees
    assert "interrupted" in growth.message


def test_an_interrupt_at_a_prompt_leaves_the_integrals_found_so_far(prompt):
    found = km.find_integrals("henon_heiles", progress=interrupt_at("products"))
    assert [str(integral.verdict) for integral in found] == ["proved"]
    assert km.check_integrals("henon_heiles", found[0].function).holds
    assert "interrupted" in found.reason


def test_an_interrupt_at_a_prompt_leaves_the_commuting_systems_found_so_far(prompt):
    system = "x' = x^2; y' = y^2"
    found, all_of_them = km.find_commuting(system, progress=interrupt_at("solution 2")), km.find_commuting(system)
    assert found.families == all_of_them.families != []
    assert len(found.solutions) == 1 < len(all_of_them.solutions)
    assert "interrupted" in found.undecided[-1]
    assert str(found.verdict) == "undecided" != str(all_of_them.verdict)
    over_root = km.System({"x": "a*x^2", "y": "y^2"}, a="sqrt(2)")
    found = km.find_commuting(over_root, progress=interrupt_at("solution 3"))
    assert [g.rhs for g in found.solutions] == [g.rhs for g in km.find_commuting(over_root).solutions[:2]]


def test_the_darboux_polynomials_so_far_are_handed_over():
    found = []
    complete = km.darboux_polynomials("lotka_volterra", 2, on_result=found.append)
    assert [result.spaces for result in found] == [complete.spaces[:1], complete.spaces]
    assert "interrupted" in found[0].reason
    assert not complete.reason


def test_an_interrupt_is_an_interrupt_in_scripts_and_where_nothing_was_found(prompt, monkeypatch):
    with pytest.raises(KeyboardInterrupt) as stop:
        km.find_density("lorenz", progress=interrupt_at(""))
    assert not isinstance(stop.value, TimeLimit)
    monkeypatch.delattr(sys, "ps1")
    with pytest.raises(KeyboardInterrupt):
        km.analyze("lorenz", progress=interrupt_at("degrees"))


def test_a_time_limit_stays_one_at_a_prompt(prompt):
    with pytest.raises(TimeLimit, match=r"0\.05 s"), km.time_limit(0.05):
        km.find_integrals("so4_euler_manakov")


def test_progress_is_shown_in_a_notebook_after_a_while_and_removed(monkeypatch):
    shown, seen = [], threading.Event()

    def show(html):
        shown.append(html)
        if "step 2" in html:
            seen.set()

    display = SimpleNamespace(HTML=str, display=lambda html, display_id: (show(html), SimpleNamespace(update=show))[1])
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    monkeypatch.setattr(function_calls, "_in_notebook", lambda: True)
    monkeypatch.setattr(function_calls, "_UPDATE_SECONDS", 0.01)

    def search(progress=lambda _: None):
        progress("step 1")
        progress("step 2 <b>")
        return seen.wait(5)

    search.__annotations__["progress"] = "Callable[[str], None]"
    monkeypatch.setattr(function_calls, "_DELAY_SECONDS", 0.01)
    assert public_function(search, "search")()
    assert "step 2 &lt;b&gt;" in shown[-2]
    assert shown[-1] == ""
    count = len(shown)
    monkeypatch.setattr(function_calls, "_DELAY_SECONDS", 60)
    seen.set()
    assert public_function(search, "search")()
    assert len(shown) == count  # nothing for a short search


def test_a_type_error_of_a_checked_function_is_explained_and_another_one_is_left_alone():
    def add(count: "int", scale: "float" = 1.0, name: "str" = ""):
        return sum(range(count)) * scale + len(name) + None

    call = public_function(add, "add")
    for arguments, words in [
        (("3",), "found count = '3', expected an integer"),
        ((3, "x"), "found scale = 'x', expected a number"),
        ((3, 1.0, 5), "found name = 5, expected a text"),
    ]:
        refuses(words, call, *arguments)
    refuses("NoneType", call, 3, 1.0, "x", error=TypeError)
    refuses("missing a required argument: 'count'; its arguments are count, scale, name", call, error=CallError)
    refuses(r"has no argument scales=; did you mean scale\?", call, 3, scales=2, error=TypeError)
