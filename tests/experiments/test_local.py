"""Worker processes: whatever a task does to its worker, the others are done and it gets the right record.

A fault of its own (SIGSEGV, SIGABRT, ...) is recorded, a kill from outside (SIGTERM, SIGKILL, ...) is tried again, and
at last lost, which is no result. The tasks are those of fault_tasks.py; those of even seeds are done.
"""

import errno
import io
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from signal import Signals

import pytest
from cli_helpers import COMMAND
from helpers import quick, refuses
from small_databases import exported, recorded, until

from kahanmaps.errors import InputError
from kahanmaps.experiments.results.records import Job, Outcome, Record, Task, TaskLimits
from kahanmaps.experiments.results.store import Store
from kahanmaps.experiments.running.cluster import run_group
from kahanmaps.experiments.running.local import TRIES, LocalWorkers, WorkersError, failure, is_from_outside
from kahanmaps.experiments.running.run import Batch, run

pytestmark = pytest.mark.usefixtures("fault_tasks")
HERE = Path(__file__).parent
KILL, ABORT, SEGFAULT, HANG, PYTHON_BOMB, FLINT_BOMB, GMP_BOMB = range(1, 8)
INPUT_ERROR, BUG, NOT_A_NUMBER, CHATTER, EXIT, LARGE, AWKWARD, TWINS, EXIT_0 = range(8, 17)
READER, NOT_PLAIN, VERDICT_OF_NO_TEXT, STARTER, NOT_LOADED, OPENBLAS, LEAVE = range(17, 24)
ALWAYS = 99


@pytest.fixture(autouse=True)
def _tries(monkeypatch, tmp_path):
    (tmp_path / "tries").mkdir()
    monkeypatch.setenv("FAULT_TRIES", str(tmp_path / "tries"))


@pytest.fixture
def start():
    """An executor that ends with the test, with some jobs begun."""
    started = []

    def make(jobs, *begun):
        started.append(LocalWorkers(jobs, {}.__getitem__))
        for job in begun:
            started[-1].submit(job)
        return started[-1]

    yield make
    for workers in started:
        workers.close()


def fault(order: int, seed: int = 1, limits: TaskLimits | None = None) -> Job:
    return Job(Task("fault", None, {"order": order, "seed": seed}), limits or TaskLimits(100.0, 400_000_000))


def pause(milliseconds: int, seed: int = 0, seconds: float = 100.0) -> Job:
    return Job(Task("pause", None, {"steps": milliseconds, "seed": seed}), TaskLimits(seconds))


def signalled(number: int, times: int) -> Job:
    return Job(Task("signalled", None, {"order": int(number), "seed": times}), TaskLimits(100.0))


def tries(folder: Path, number: int, times: int) -> int:
    """How often the task has been begun."""
    return (folder / "tries" / f"{int(number)}-{times}").stat().st_size


def done(jobs, workers=2, **settings) -> dict[str, Record]:
    """The records by key; every job has one and only one."""
    results: list[Record] = []
    for records in Batch(jobs, LocalWorkers(workers, {}.__getitem__, **settings)):
        results += records
    assert sorted(record.key for record in results) == sorted(job.task.key for job in jobs)
    return {record.key: record for record in results}


def pids_of(workers: LocalWorkers) -> list[int]:
    """The processes at work, once they wait for tasks or have one."""
    at_work = [worker for worker, _ in workers._running.values()]
    until(lambda: all(worker.is_ready for worker in at_work))
    return [worker.process.pid for worker in at_work]


def is_running(pid: int) -> bool:
    """Whether there is such a process, not counting the dead that nobody has looked at yet."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.fixture(scope="module")
def faulty(fault_tasks) -> dict[int, Record]:
    """What became of a task of each fault but that which hangs, with as many between them that are done."""
    orders = [order for order in range(1, LEAVE + 1) if order != HANG]
    records = done([fault(order, seed) for order in orders for seed in (0, 1)], tries=2)
    assert all(records[fault(order, 0).task.key].is_ok for order in orders)
    return {order: records[fault(order).task.key] for order in orders}


@pytest.mark.parametrize(
    ("order", "outcome", "message"),
    [
        (KILL, Outcome.LOST, "signal 9 (SIGKILL)"),
        (ABORT, Outcome.CRASHED, "signal 6 (SIGABRT)"),
        (SEGFAULT, Outcome.CRASHED, "signal 11 (SIGSEGV)"),
        (EXIT, Outcome.CRASHED, "ended with status 7"),
        (EXIT_0, Outcome.CRASHED, "ended with status 0"),  # of which pebble takes no notice
        (PYTHON_BOMB, Outcome.OUT_OF_MEMORY, "out of memory"),
        (FLINT_BOMB, Outcome.OUT_OF_MEMORY, "out of memory"),
        (GMP_BOMB, Outcome.OUT_OF_MEMORY, "out of memory"),
        (NOT_LOADED, Outcome.OUT_OF_MEMORY, "out of memory"),
        (OPENBLAS, Outcome.OUT_OF_MEMORY, "out of memory"),
        (INPUT_ERROR, Outcome.FAILED, "found nothing, expected something"),
        (BUG, Outcome.FAILED, "ZeroDivisionError"),
        (AWKWARD, Outcome.FAILED, "Awkward: for a reason"),  # pickled, it would break a pool of pebble
        (LEAVE, Outcome.FAILED, "SystemExit: I leave"),
        (NOT_A_NUMBER, Outcome.FAILED, "the result cannot be kept"),
        (NOT_PLAIN, Outcome.FAILED, "the result cannot be kept: Object of type set"),
        (VERDICT_OF_NO_TEXT, Outcome.FAILED, "found the verdict ['proved'], expected a text"),
        (CHATTER, Outcome.OK, ""),
        (LARGE, Outcome.OK, ""),
        (TWINS, Outcome.OK, ""),
        (READER, Outcome.OK, ""),
        (STARTER, Outcome.OK, ""),
    ],
)
def test_a_fault_is_reported_for_the_task_that_caused_it_alone(faulty, order, outcome, message):
    record = faulty[order]
    assert record.outcome is outcome
    assert message in record.message
    assert (record.result is None) == (outcome is not Outcome.OK)


def test_the_end_of_what_a_worker_printed_is_kept(faulty):
    assert faulty[KILL].stderr == "about to die of 9"
    assert "Unable to allocate memory" in faulty[FLINT_BOMB].stderr
    assert faulty[BUG].stderr.rstrip().endswith("ZeroDivisionError: integer division or modulo by zero")


def test_answers_of_megabytes_come_whole_with_where_and_how_they_came_about(faulty):
    record = faulty[LARGE]
    assert record.result == {"digits": "7" * 3_000_000, "hash_seed": "0"}  # so that sets have one order everywhere
    assert os.environ["PYTHONHASHSEED"] == "123"
    assert record.host
    assert set(record.versions) == {"kahanmaps", "python", "python-flint", "flint"}
    assert record.finished.endswith("+00:00")
    assert record.seconds > 0
    assert record.peak_memory is None or record.peak_memory > 10_000_000


def test_what_a_task_has_started_ends_with_its_worker(faulty):
    until(lambda: not is_running(faulty[STARTER].result["pid"]))


def test_a_task_that_hangs_is_killed_at_its_time_limit_and_keeps_no_earlier_output():
    chatter, hang, other = fault(CHATTER), fault(HANG, limits=TaskLimits(time=0.2)), fault(HANG, 0)
    records = done([chatter, hang, other], workers=1)
    record = records[hang.task.key]
    assert (record.outcome, record.stderr) == (Outcome.TIMEOUT, "")
    assert record.message == "not done within 0.2 seconds"
    assert records[other.task.key].is_ok


@pytest.mark.parametrize(
    ("error", "is_memory"),
    [
        (MemoryError(), True),
        (OSError(errno.ENOMEM, "Cannot allocate memory"), True),
        (ImportError("libgmp.so: failed to map segment from shared object"), True),
        (ImportError("libflint.so: cannot allocate memory in static TLS block"), True),
        (OSError(errno.EIO, "Input/output error"), False),
        (ImportError("No module named 'numbers_of_mine'"), False),
        (ValueError("cannot allocate memory"), False),  # somebody's words, not the system's
    ],
)
def test_an_error_caused_by_lack_of_memory_is_reported_as_such(error, is_memory):
    caused, met = InputError("found no numbers"), ValueError("no value")
    caused.__cause__, met.__context__ = error, error
    for raised in (error, caused, met):
        result = failure(raised)
        if is_memory:
            assert result == {"outcome": Outcome.OUT_OF_MEMORY, "message": "out of memory"}
        else:
            assert result["outcome"] is Outcome.FAILED
            assert ("stderr" in result) is (raised is not caused)  # a traceback, where nobody raised it on purpose


def test_the_time_of_one_task_is_not_that_of_the_tasks_before_it():
    records = done([pause(150, seed, 1.5) for seed in range(11)], workers=1)
    assert all(record.is_ok for record in records.values())  # 1.65 seconds in one worker


def test_what_earlier_tasks_left_belongs_to_the_memory_of_a_task():
    limits = TaskLimits(100.0, 60_000_000)
    jobs = [Job(Task("use", None, {"steps": s, "seed": k}), limits) for k, s in enumerate((40, 54, 72))]
    among, alone = done(jobs, workers=1), done(jobs, workers=1, group_seconds=0.0)
    assert {key: record.outcome for key, record in among.items()} == {key: r.outcome for key, r in alone.items()}
    assert {record.outcome for record in alone.values()} == {Outcome.OK, Outcome.OUT_OF_MEMORY}


def test_an_error_nobody_expected_is_tried_again_in_a_fresh_worker():
    jobs = [Job(Task("first", None, {"steps": 0, "seed": seed}), TaskLimits(100.0)) for seed in range(2)]
    assert all(record.is_ok for record in done(jobs, workers=1).values())


def test_the_signals_of_a_task_itself_are_those_of_faults_and_limits():
    own = "SIGSEGV SIGABRT SIGFPE SIGBUS SIGILL SIGSYS SIGTRAP SIGXCPU SIGXFSZ"
    assert {number.name for number in Signals if not is_from_outside(-number)} == set(own.split())
    assert not any(map(is_from_outside, (None, 0, 1, 7, 137)))


def test_a_task_whose_worker_is_killed_from_outside_again_and_again_is_lost_and_not_crashed(tmp_path):
    assert TRIES > 3  # which takes longer
    kill, quit_ = signalled(signal.SIGKILL, ALWAYS), signalled(signal.SIGQUIT, 2)
    records = done([kill, quit_], tries=3)
    lost = records[kill.task.key]
    assert (lost.outcome, lost.result, lost.is_ok) == (Outcome.LOST, None, False)
    assert lost.message == "the child was killed by signal 9 (SIGKILL), from outside or for want of memory"
    assert records[quit_.task.key].is_ok
    assert tries(tmp_path, signal.SIGKILL, ALWAYS) == tries(tmp_path, signal.SIGQUIT, 2) == 3


def test_a_fault_is_recorded_as_a_crash_when_it_comes_again(tmp_path):
    once, always = signalled(signal.SIGSEGV, 1), signalled(signal.SIGABRT, ALWAYS)
    records = done([once, always], workers=1)
    assert records[once.task.key].is_ok
    assert records[always.task.key].outcome is Outcome.CRASHED
    assert tries(tmp_path, signal.SIGABRT, ALWAYS) == 2


@pytest.mark.parametrize("number", quick([signal.SIGKILL, signal.SIGSEGV], [signal.SIGKILL]))
def test_a_worker_that_dies_costs_no_task_whether_it_has_one_or_not(start, number):
    workers = start(1, pause(300, 0))
    for seed in (1, 2):
        (pid,) = pids_of(workers)
        if seed == 1:
            os.kill(pid, number)
        records = []
        while workers.in_flight:
            records += workers.wait(5.0)
        assert [record.is_ok for record in records] == [True]
        for worker in workers._idle:
            os.kill(worker.process.pid, number)
        workers.submit(pause(1, seed))
    assert [record.is_ok for record in workers.wait(100.0) or workers.wait(100.0)] == [True]


@pytest.mark.parametrize("seconds", quick([0.0, 0.05, 0.15], [0.05]))
def test_ctrl_c_does_not_reach_a_worker_that_begins(start, seconds):
    """There Python has no place for it: it ended in a fatal error with status 1, or in RuntimeError."""
    workers = start(1, pause(1))
    ((worker, _),) = workers._running.values()
    time.sleep(seconds)
    os.kill(worker.process.pid, signal.SIGINT)
    (record,) = workers.wait(100.0)
    assert record.is_ok
    assert workers._idle == [worker]


def test_at_most_so_many_workers_are_there_and_closing_which_may_be_done_twice_kills_them(start):
    workers = start(2)
    assert workers.is_free
    workers.submit(fault(HANG))
    workers.submit(pause(60_000))
    assert not workers.is_free
    pids, begin = pids_of(workers), time.monotonic()
    assert len(pids) == workers.in_flight == 2
    workers.close()
    workers.close()
    assert time.monotonic() - begin < 50  # they would work for a minute and more
    assert not any(map(is_running, pids))


def test_workers_that_cannot_start_are_reported_once(monkeypatch):
    monkeypatch.setenv("KAHANMAPS_TASKS", "no_such_module_anywhere")
    refuses("no_such_module_anywhere", done, [pause(1, seed) for seed in range(5)], error=WorkersError)


PARENT = """
import sys
sys.path[:0] = sys.argv[1:]
from test_local import *
workers = LocalWorkers(2, {}.__getitem__)
workers.submit(fault(HANG)); workers.submit(pause(60_000))
print(*pids_of(workers), flush=True)
workers.wait(60)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a worker ends when its task does")
def test_no_worker_outlives_a_parent_that_is_killed():
    """One of them hangs as in a long call of FLINT."""
    parent = subprocess.Popen([sys.executable, "-c", PARENT, HERE, HERE.parent], stdout=subprocess.PIPE, text=True)
    pids = [int(word) for word in parent.stdout.readline().split()]
    assert [is_running(pid) for pid in pids] == [True, True]
    parent.kill()
    until(lambda: not any(map(is_running, pids)))
    parent.communicate()


def test_a_script_may_run_a_batch_without_asking_whether_it_is_the_main_module(tmp_path):
    """multiprocessing would run the script again in each worker, and that one start workers of its own."""
    text = '[experiments.a]\ntask = "pause"\naxes = {seed = "0..3"}'
    (tmp_path / "script.py").write_text(f"import kahanmaps as km\nprint(len(list(km.run({text!r}, jobs=2))))\n")
    ran = subprocess.run([sys.executable, tmp_path / "script.py"], capture_output=True, text=True, timeout=60)
    assert (ran.stdout, ran.stderr) == ("4\n", "")


def test_the_command_of_a_cluster_hands_a_lost_task_back_at_once_for_another_machine_to_try(tmp_path):
    jobs = [signalled(signal.SIGTERM, times).task.text for times in (ALWAYS, 0)]
    limits, said = {"time": 20, "memory": None}, io.StringIO()
    text = json.dumps({"documents": {}, "jobs": [{"task": task, "limits": limits} for task in jobs]})
    run_group(io.StringIO(text), said)
    assert [json.loads(line)["outcome"] for line in said.getvalue().splitlines()] == ["lost", "ok"]
    assert tries(tmp_path, signal.SIGTERM, ALWAYS) == 1


def test_a_lost_task_has_no_result_and_the_next_run_does_it_again(tmp_path):
    db, spec = tmp_path / "results.db", '[experiments.a]\ntask = "signalled"\naxes = { order = [15], seed = [0, 99] }\n'
    records = {str(record.outcome): record for record in run(spec, db)}
    assert set(records) == {"lost", "ok"}
    with Store.open(db, readonly=True) as store:
        (entry,) = store.find(records["lost"].key)
    assert (entry.record, entry.attempts) == (None, 0)
    (tmp_path / "tries" / "15-99").write_text("x" * 99)  # from here on it lives
    assert [str(record.outcome) for record in run(spec, db)] == ["ok"]
    list(run(spec, tmp_path / "calm.db"))
    assert exported(db) == exported(tmp_path / "calm.db")


@pytest.mark.parametrize(("number", "first"), [(Signals.SIGTERM, "workers"), (Signals.SIGKILL, "parent")])
def test_a_signal_to_a_batch_and_all_its_processes_changes_no_result(tmp_path, number, first):
    text = '[experiments.pause]\ntask = "pause"\noptions = { steps = 60 }\naxes = { seed = "0..14" }\n'
    (tmp_path / "spec.toml").write_text(text)
    command = [*COMMAND, "batch", "run", "spec.toml", "--db", "wild.db", "-j", "2", "-q"]
    pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    process = subprocess.Popen(command, cwd=tmp_path, text=True, **pipes)
    until(lambda: recorded(tmp_path / "wild.db"))
    # Two workers, and the process with which Python keeps account of semaphores.
    threads = Path(f"/proc/{process.pid}/task")
    children = [int(pid) for file in threads.glob("*/children") for pid in file.read_text().split()]
    assert len(children) >= 2
    for pid in [process.pid, *children] if first == "parent" else [*children, process.pid]:
        os.kill(pid, number)
    _, err = process.communicate(timeout=100)
    assert process.returncode == (130 if number == signal.SIGTERM else -number), err
    until(lambda: not any(map(is_running, children)))
    with Store.open(tmp_path / "wild.db", readonly=True) as store:
        (status,) = store.status()
    assert set(status.outcomes) == {Outcome.OK}
    assert status.missing > 0
    list(run(text, tmp_path / "wild.db", jobs=2))
    list(run(text, tmp_path / "calm.db", jobs=2))
    assert exported(tmp_path / "wild.db") == exported(tmp_path / "calm.db")
