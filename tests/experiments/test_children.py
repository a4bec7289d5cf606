"""Child processes: whatever a task does to its child, the others are done and it gets the right record.

The tasks that go wrong are in fault_tasks.py. Negative controls: even seeds, which are done.
"""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from kahanmaps.experiments.results.records import Job, Limits, Outcome, Record, Task
from kahanmaps.experiments.running.children import ChildrenError, LocalChildren
from kahanmaps.experiments.running.run import Batch

pytestmark = pytest.mark.usefixtures("fault_tasks")
HERE = Path(__file__).parent
KILL, ABORT, SEGFAULT, HANG, PYTHON_BOMB, FLINT_BOMB, GMP_BOMB = range(1, 8)
INPUT_ERROR, BUG, NOT_A_NUMBER, CHATTER, EXIT, LARGE = range(8, 14)
NOT_LOADED, OPENBLAS = 21, 22
DEAF, TWINS, _, READER, NOT_PLAIN, VERDICT_OF_NO_TEXT, STARTER = range(14, 21)


def fault(order: int, seed: int = 1, limits: Limits | None = None) -> Job:
    return Job(Task("fault", None, {"order": order, "seed": seed}), limits or Limits(20.0, 400_000_000))


def pause(milliseconds: int, seed: int = 0, limits: Limits | None = None) -> Job:
    return Job(Task("pause", None, {"steps": milliseconds, "seed": seed}), limits or Limits(20.0))


def done(jobs: list[Job], children: int = 2, **settings: Any) -> dict[str, Record]:
    """The records by key; every job has one and only one."""
    found: list[Record] = []
    for records in Batch(jobs, LocalChildren(children, {}.__getitem__, **settings)):
        found += records
    assert sorted(record.key for record in found) == sorted(job.task.key for job in jobs)
    return {record.key: record for record in found}


def among_others(orders: list[int]) -> dict[int, Record]:
    """What became of a task of each fault, in one batch, with as many between them that are done."""
    records = done([fault(order, seed) for order in orders for seed in (0, 1)], tries=2)
    assert all(records[fault(order, 0).task.key].is_ok for order in orders)
    return {order: records[fault(order).task.key] for order in orders}


@pytest.fixture(scope="module")
def faulty(fault_tasks) -> dict[int, Record]:
    """Every fault but that of a child that hangs."""
    return among_others([order for order in range(1, 23) if order not in (HANG, 16)])


@pytest.fixture(scope="module")
def few(fault_tasks) -> dict[int, Record]:
    """A fault of each kind: a signal, want of memory, a bug, a large answer, and what is started and left."""
    return among_others([KILL, FLINT_BOMB, BUG, LARGE, STARTER])


@pytest.mark.parametrize(
    ("order", "outcome", "message"),
    [
        (KILL, Outcome.LOST, "signal 9 (SIGKILL)"),
        (ABORT, Outcome.CRASHED, "signal 6 (SIGABRT)"),
        (SEGFAULT, Outcome.CRASHED, "signal 11 (SIGSEGV)"),
        (EXIT, Outcome.CRASHED, "ended with status 7"),
        (PYTHON_BOMB, Outcome.OUT_OF_MEMORY, "out of memory"),
        (FLINT_BOMB, Outcome.OUT_OF_MEMORY, "out of memory"),
        (GMP_BOMB, Outcome.OUT_OF_MEMORY, "out of memory"),
        (NOT_LOADED, Outcome.OUT_OF_MEMORY, "out of memory"),
        (OPENBLAS, Outcome.OUT_OF_MEMORY, "out of memory"),
        (INPUT_ERROR, Outcome.FAILED, "found nothing, expected something"),
        (BUG, Outcome.FAILED, "ZeroDivisionError"),
        (NOT_A_NUMBER, Outcome.FAILED, "the result cannot be kept"),
        (CHATTER, Outcome.OK, ""),
        (LARGE, Outcome.OK, ""),
        (DEAF, Outcome.CRASHED, "closed the pipe for its answers"),
        (TWINS, Outcome.OK, ""),
        (READER, Outcome.OK, ""),
        (NOT_PLAIN, Outcome.FAILED, "the result cannot be kept: Object of type set"),
        (VERDICT_OF_NO_TEXT, Outcome.FAILED, "found the verdict ['proved'], expected a text"),
    ],
)
def test_what_a_task_does_to_its_child_is_told_of_this_task_alone(faulty, order, outcome, message):
    record = faulty[order]
    assert record.outcome is outcome
    assert message in record.message
    assert (record.result is None) == (outcome is not Outcome.OK)


def test_a_child_that_hangs_is_killed_when_its_time_is_over_and_what_it_printed_before_is_not_told():
    chatter, hang, other = fault(CHATTER), fault(HANG, limits=Limits(time=0.2)), fault(HANG, 0)
    records = done([chatter, hang, other], children=1)
    record = records[hang.task.key]
    assert (record.outcome, record.stderr) == (Outcome.TIMEOUT, "")
    assert record.message == "not done within 0.2 seconds"
    assert records[other.task.key].is_ok


def test_the_time_of_one_task_is_not_that_of_its_group():
    records = done([pause(300, seed, Limits(time=1.0)) for seed in range(6)], children=1)
    assert all(record.is_ok for record in records.values())  # 1.8 seconds in one child


def test_faults_of_each_kind_are_told_of_their_tasks_alone(few):
    kinds = {order: record.outcome for order, record in few.items()}
    assert kinds == {
        KILL: Outcome.LOST,
        FLINT_BOMB: Outcome.OUT_OF_MEMORY,
        BUG: Outcome.FAILED,
        LARGE: Outcome.OK,
        STARTER: Outcome.OK,
    }


def test_the_end_of_what_a_child_printed_is_kept(few):
    assert few[KILL].stderr == "about to die of 9"
    assert "Unable to allocate memory" in few[FLINT_BOMB].stderr
    assert few[BUG].stderr.rstrip().endswith("ZeroDivisionError: integer division or modulo by zero")


def test_answers_of_megabytes_come_whole_with_where_and_how_they_came_about(few):
    record = few[LARGE]
    assert record.result == {"digits": "7" * 3_000_000, "hash_seed": "0"}  # so that sets have one order everywhere
    assert record.host
    assert set(record.versions) == {"kahanmaps", "python", "python-flint", "flint"}
    assert record.finished.endswith("+00:00")
    assert 0 < record.seconds < 5
    assert record.peak_memory is None or record.peak_memory > 10_000_000


def test_what_a_task_has_started_ends_with_its_child(few):
    result = few[STARTER].result
    assert result is not None
    deadline = time.monotonic() + 5
    while is_running(result["pid"]) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not is_running(result["pid"])


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere there is no limit of memory")
def test_what_earlier_tasks_left_does_not_add_to_the_memory_of_a_task():
    jobs = [
        Job(Task("use", None, {"steps": steps, "seed": seed}), Limits(20.0, 60_000_000))
        for seed, steps in enumerate((40, 48, 54, 65, 68, 72))
    ]
    among, alone = done(jobs, children=1), done(jobs, children=1, group_seconds=0.0)
    assert {key: record.outcome for key, record in among.items()} == {key: r.outcome for key, r in alone.items()}
    assert {record.outcome for record in alone.values()} == {Outcome.OK, Outcome.OUT_OF_MEMORY}


def test_an_error_nobody_expected_is_tried_again_in_a_new_child():
    jobs = [Job(Task("first", None, {"steps": 0, "seed": seed}), Limits(20.0)) for seed in range(2)]
    assert all(record.is_ok for record in done(jobs, children=1).values())


class Counted(LocalChildren):
    """Counts the children that it starts."""

    started = 0

    def _new_child(self):
        self.started += 1
        return super()._new_child()


@pytest.mark.parametrize(("group_seconds", "children"), [(60.0, 1), (0.0, 3)])
def test_a_child_serves_tasks_until_it_has_worked_for_some_seconds(group_seconds: float, children: int):
    executor = Counted(1, {}.__getitem__, group_seconds=group_seconds)
    for _ in Batch([pause(1, seed) for seed in range(3)], executor):
        pass
    assert executor.started == children


def test_a_child_that_somebody_kills_once_costs_no_task():
    """A task that kills its child the first time only: it is tried again alone, and done."""
    jobs = [pause(800, seed) for seed in range(2)]
    children = LocalChildren(2, {}.__getitem__)
    for job in jobs:
        children.submit(job)
    children.wait(0.5)
    victims = [child.process.pid for child in children._children]
    os.kill(victims[0], 9)
    records = []
    while children.in_flight:
        records += children.wait(5.0)
    children.close()
    assert sorted(record.key for record in records) == sorted(job.task.key for job in jobs)
    assert all(record.is_ok for record in records)


def test_at_most_so_many_children_work_at_a_time_and_closing_which_may_be_done_twice_kills_them():
    children = LocalChildren(2, {}.__getitem__)
    assert children.is_free
    children.submit(fault(HANG))
    children.submit(pause(60_000))
    assert not children.is_free
    assert children.in_flight == 2
    while sum(not child.is_fresh for child in children._children) < 2:
        assert children.wait(0.1) == []
    pids, begin = [child.process.pid for child in children._children], time.monotonic()
    children.close()
    children.close()
    assert time.monotonic() - begin < 15  # other children would work until the time of their tasks is over, 20 s
    assert all(not is_running(pid) for pid in pids)


def test_children_that_cannot_start_are_told_once(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("KAHANMAPS_TASKS", "no_such_module_anywhere")
    with pytest.raises(ChildrenError, match="no_such_module_anywhere"):
        done([pause(1, seed) for seed in range(5)])


def test_an_interpreter_that_is_not_there_is_told(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(sys, "executable", "/no/such/python")
    with pytest.raises(ChildrenError, match="cannot be started: No such file"):
        done([pause(1)])


@pytest.fixture
def parent() -> Iterator[subprocess.Popen[str]]:
    """A process with two children, one hanging as in a long call of FLINT, whose numbers it prints."""
    code = """
import sys
sys.path.insert(0, sys.argv[1])
from kahanmaps.experiments.running.children import LocalChildren
from test_children import fault, pause, HANG
children = LocalChildren(2, {}.__getitem__)
children.submit(fault(HANG)); children.submit(pause(60_000))
while sum(not child.is_fresh for child in children._children) < 2:
    children.wait(0.1)
print(*(child.process.pid for child in children._children), flush=True)
children.wait(60)
"""
    process = subprocess.Popen([sys.executable, "-c", code, str(HERE)], stdout=subprocess.PIPE, text=True)
    yield process
    process.kill()
    process.communicate()


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a child ends when its task does")
def test_no_child_outlives_a_parent_that_is_killed(parent: subprocess.Popen[str]):
    pids = [int(word) for word in parent.stdout.readline().split()]
    assert len(pids) == 2
    assert all(map(is_running, pids))
    parent.kill()
    parent.wait()
    deadline = time.monotonic() + 5
    while any(map(is_running, pids)) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not any(map(is_running, pids))


def is_running(pid: int) -> bool:
    """Whether there is such a process, not counting the dead that nobody has looked at yet."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"
