"""Whose doing a death is: what a signal from outside ends is tried again, and at last lost, which is no result.

A task whose own code or libraries die (SIGSEGV, SIGABRT, ...) is recorded as crashed; SIGTERM, SIGKILL and the like
are the machine's doing. The tasks are those of fault_tasks.py.
"""

import io
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from signal import Signals

import pytest
from helpers import quick
from small_databases import exported

from kahanmaps.experiments.results.records import Job, Limits, Outcome, Record, Task
from kahanmaps.experiments.results.store import Store
from kahanmaps.experiments.running.children import TRIES, LocalChildren, is_from_outside
from kahanmaps.experiments.running.group import main as do_group
from kahanmaps.experiments.running.run import Batch, run

pytestmark = pytest.mark.usefixtures("fault_tasks")
OWN = [Signals.SIGSEGV, Signals.SIGABRT, Signals.SIGFPE, Signals.SIGBUS, Signals.SIGILL, Signals.SIGSYS]
OWN += [Signals.SIGTRAP, Signals.SIGXCPU, Signals.SIGXFSZ]
ALWAYS = 99
SPEC = """
[experiments.signalled]
task = "signalled"
axes = { order = [15], seed = [0, 99] }
"""


@pytest.fixture(autouse=True)
def _tries(monkeypatch, tmp_path):
    (tmp_path / "tries").mkdir()
    monkeypatch.setenv("FAULT_TRIES", str(tmp_path / "tries"))


def signalled(number: int, times: int) -> Job:
    return Job(Task("signalled", None, {"order": int(number), "seed": times}), Limits(20.0))


def tries(folder: Path, number: int, times: int) -> int:
    """How often the task has been begun."""
    return (folder / "tries" / f"{int(number)}-{times}").stat().st_size


def done(jobs: Sequence[Job], children: int = 2) -> dict[str, Record]:
    found: list[Record] = []
    for records in Batch(jobs, LocalChildren(children, {}.__getitem__)):
        found += records
    assert sorted(record.key for record in found) == sorted(job.task.key for job in jobs)
    return {record.key: record for record in found}


# Which signals


def test_the_signals_of_a_task_itself_are_those_of_faults_and_limits():
    assert {number for number in Signals if not is_from_outside(-number)} == set(OWN)
    assert not any(map(is_from_outside, (None, 0, 1, 7, 137)))


# Children


def test_a_task_whose_child_is_killed_from_outside_again_and_again_is_lost_and_not_crashed(tmp_path: Path):
    kill, quit_ = signalled(signal.SIGKILL, ALWAYS), signalled(signal.SIGQUIT, TRIES - 1)
    records = done([kill, quit_])
    lost = records[kill.task.key]
    assert (lost.outcome, lost.result, lost.is_ok) == (Outcome.LOST, None, False)
    assert lost.message == "the child was killed by signal 9 (SIGKILL), from outside or for want of memory"
    assert records[quit_.task.key].is_ok
    assert tries(tmp_path, signal.SIGKILL, ALWAYS) == tries(tmp_path, signal.SIGQUIT, TRIES - 1) == TRIES


def test_a_fault_is_recorded_as_a_crash_when_it_comes_again(tmp_path: Path):
    once, always = signalled(signal.SIGSEGV, 1), signalled(signal.SIGABRT, ALWAYS)
    records = done([once, always], children=1)
    assert records[once.task.key].is_ok
    assert records[always.task.key].outcome is Outcome.CRASHED
    assert tries(tmp_path, signal.SIGABRT, ALWAYS) == 2


@pytest.mark.parametrize("seconds", quick([0.0, 0.05, 0.15], [0.05]))
def test_ctrl_c_does_not_reach_a_child_that_begins(tmp_path: Path, seconds: float):
    """There Python has no place for it: it ended in a fatal error with status 1, or in RuntimeError."""
    children = LocalChildren(1, {}.__getitem__)
    try:
        children.submit(signalled(signal.SIGTERM, 0))
        deadline = time.monotonic() + 20
        while not children._children:
            assert time.monotonic() < deadline
        process = children._children[0].process
        time.sleep(seconds)
        process.send_signal(signal.SIGINT)
        (record,) = children.wait(20.0)
        assert record.is_ok
        assert process.poll() is None
        assert [child.process for child in children._children] == [process]
    finally:
        children.close()


def test_a_child_that_dies_while_it_has_nothing_to_do_costs_no_task():
    children = LocalChildren(1, {}.__getitem__)
    try:
        for times in (0, 1):
            children.submit(signalled(signal.SIGTERM, -times))
            (record,) = children.wait(20.0)
            assert record.is_ok
            if times == 0:
                os.kill(children._children[0].process.pid, signal.SIGSEGV)
                children._children[0].process.wait(5)
    finally:
        children.close()


# The group command


def test_the_group_command_hands_a_lost_task_back_at_once_for_another_machine_to_try(tmp_path: Path):
    jobs = [signalled(signal.SIGTERM, ALWAYS), signalled(signal.SIGTERM, 0)]
    text = json.dumps(
        {"documents": {}, "jobs": [{"task": job.task.text, "limits": {"time": 20, "memory": None}} for job in jobs]}
    )
    said = io.StringIO()
    do_group(io.StringIO(text), said)
    outcomes = [json.loads(line)["outcome"] for line in said.getvalue().splitlines()]
    assert outcomes == ["lost", "ok"]
    assert tries(tmp_path, signal.SIGTERM, ALWAYS) == 1


# What remains of it


def test_a_lost_task_has_no_result_and_the_next_run_does_it_again(tmp_path: Path):
    db = tmp_path / "results.db"
    records = list(run(SPEC, db))
    assert sorted(str(record.outcome) for record in records) == ["lost", "ok"]
    with Store.open(db, readonly=True) as store:
        (status,) = store.status()
        assert (status.missing, status.outcomes) == (1, {Outcome.OK: 1})
        assert [row.record is None for row in store.rows(missing=True)] == [False, True]
        lost = [store.find(record.key)[0] for record in records if record.outcome is Outcome.LOST]
        assert [(found.record, found.attempts) for found in lost] == [(None, 0)]
    (tmp_path / "tries" / "15-99").write_text("x" * 99)  # from here on it lives
    again = list(run(SPEC, db))
    assert [str(record.outcome) for record in again] == ["ok"]
    list(run(SPEC, tmp_path / "calm.db"))
    assert exported(db) == exported(tmp_path / "calm.db")


def test_a_task_that_is_lost_when_it_is_tried_again_keeps_the_failure_it_had(tmp_path: Path):
    with Store.open(tmp_path / "results.db", create=True) as store:
        task = signalled(9, ALWAYS).task
        store.plan("one", "one", Limits(), [task], {})
        store.add([Record(task.key, Outcome.FAILED, message="before")])
        store.add([Record(task.key, Outcome.LOST)])
        (found,) = store.find(task.key)
        assert (found.record.outcome, found.record.message, found.attempts) == (Outcome.FAILED, "before", 1)


# The parent and its children together


@pytest.mark.parametrize(
    ("number", "first"),
    [(Signals.SIGTERM, "children"), (Signals.SIGINT, "parent"), (Signals.SIGKILL, "parent")],
)
def test_a_signal_to_a_batch_and_all_its_children_changes_no_result(tmp_path: Path, number: Signals, first: str):
    text = '[experiments.pause]\ntask = "pause"\noptions = { steps = 60 }\naxes = { seed = "0..29" }\n'
    (tmp_path / "spec.toml").write_text(text)
    command = [sys.executable, "-m", "kahanmaps_cli.main", "batch", "run", "spec.toml", "--db", "wild.db", "-j", "2"]
    process = subprocess.Popen(
        [*command, "-q"], cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    children = children_of(process, 2)
    deadline = time.monotonic() + 20
    while not stored(tmp_path / "wild.db"):
        assert time.monotonic() < deadline
        time.sleep(0.02)
    for pid in [process.pid, *children] if first == "parent" else [*children, process.pid]:
        os.kill(pid, number)
    _, err = process.communicate(timeout=20)
    assert process.returncode == (130 if number in (signal.SIGINT, signal.SIGTERM) else -number), err
    with Store.open(tmp_path / "wild.db", readonly=True) as store:
        (status,) = store.status()
    assert set(status.outcomes) == {Outcome.OK}
    assert status.missing > 0
    list(run(text, tmp_path / "wild.db", jobs=2))
    list(run(text, tmp_path / "calm.db", jobs=2))
    assert exported(tmp_path / "wild.db") == exported(tmp_path / "calm.db")


def children_of(process: subprocess.Popen[str], number: int) -> list[int]:
    """The processes that it has started, once there are so many."""
    threads = Path(f"/proc/{process.pid}/task")
    deadline = time.monotonic() + 20
    while len(pids := [pid for file in threads.glob("*/children") for pid in file.read_text().split()]) < number:
        assert time.monotonic() < deadline
        assert process.poll() is None
        time.sleep(0.02)
    return [int(pid) for pid in pids]


def stored(db: Path) -> int:
    if not db.exists():
        return 0
    with Store.open(db, readonly=True) as store:
        return sum(sum(one.outcomes.values()) for one in store.status())
