"""Two processes find what one finds; what goes wrong in the second is done again in the first, and it ends with it."""

import os
import signal
import subprocess
import sys
import time

import pytest

from kahanmaps import InputError, analyze, load
from kahanmaps.laboratory import analysis
from kahanmaps.laboratory.analyses.step import AnalysisStep, MapKinds

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="a second process is for Linux")
HERE = os.getpid()


@pytest.fixture(autouse=True)
def two_processors(monkeypatch):
    monkeypatch.setattr(analysis, "processors", lambda: 2)


def where(*_, **__):
    return os.getpid()


def step(name, run=where, *, is_independent=True):
    return AnalysisStep(
        name, run, applies_to=MapKinds.ALL, is_independent=is_independent, json=lambda result: {name: result[name]}
    )


def test_independent_steps_run_elsewhere_in_their_order_and_the_others_here():
    steps = [step("first"), step("second", lambda c, **_: c.result["first"]), step("third", is_independent=False)]
    analysis = analyze(load("harmonic"), analyses=steps, processes=2)
    assert analysis["first"] == analysis["second"] != analysis["third"] == HERE
    assert analyze(load("harmonic"), analyses=steps)["first"] == HERE  # with one process


def test_what_a_killed_process_did_not_do_is_done_here():
    def killed(*_, **__):
        if os.getpid() != HERE:
            os.kill(os.getpid(), signal.SIGKILL)
        return os.getpid()

    analysis = analyze(load("harmonic"), analyses=[step("first"), step("second", killed), step("third")], processes=2)
    assert analysis["first"] != analysis["second"] == analysis["third"] == HERE
    assert analysis.skipped == []


def test_a_failed_step_of_the_second_process_is_reported_and_a_mistake_is_raised():
    def gives_up(*_, **__):
        raise InputError("too hard")

    steps = [step("first", gives_up), step("second"), step("third", gives_up, is_independent=False)]
    assert analyze(load("harmonic"), analyses=steps, processes=2).skipped == ["first: too hard", "third: too hard"]
    with pytest.raises(ZeroDivisionError):
        analyze(load("harmonic"), analyses=[step("first", lambda *_, **__: 1 // 0)], processes=2)


ENDED = """
import os, signal, sys, time
from kahanmaps.documents.catalog import load
from kahanmaps.laboratory import analysis
from kahanmaps.laboratory.analyses.step import AnalysisStep, MapKinds

def sleeping(*_, **__):
    print(os.getpid(), flush=True)
    time.sleep(60)

analysis.processors = lambda: 2
steps = [
    AnalysisStep("far", sleeping, applies_to=MapKinds.ALL, is_independent=True),
    AnalysisStep("near", sleeping, applies_to=MapKinds.ALL),
]
analysis.analyze(load("harmonic"), analyses=steps, processes=2)
"""


def is_running(process):
    try:
        with open(f"/proc/{process}/stat") as stat:
            return stat.read().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_the_second_process_ends_with_the_first(how):
    line = [sys.executable, "-c", ENDED]
    with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        (other,) = {int(process.stdout.readline()) for _ in range(2)} - {process.pid}
        process.send_signal(how)
        process.wait(timeout=30)
    end = time.monotonic() + 30
    while is_running(other):
        assert time.monotonic() < end
        time.sleep(0.01)
