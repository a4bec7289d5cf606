"""Tasks on a dask cluster: every record comes back exactly once, whatever dies on the way, and nothing hangs.

Schedulers and workers are real ones, on 127.0.0.1. The workers run a script that reads and prints what the command of a
group does, and misbehaves where a task asks it to; batches run the command itself.
"""

import json
import os
import shlex
import signal
import socket
import subprocess
import sys
import time
from collections import Counter
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path

import pytest
from cli_helpers import COMMAND
from helpers import refuses
from small_databases import exported, recorded, until

from kahanmaps.experiments.results.records import Job, Outcome, Task, TaskLimits
from kahanmaps.experiments.running import cluster
from kahanmaps.experiments.running.cluster import ClusterLost, ClusterWorkers, WorkersUnfit
from kahanmaps.experiments.running.local import TRIES
from kahanmaps.experiments.running.run import run

pytest.importorskip("distributed")

# What a task asks for is in its options: `sleep` seconds, `claim` other seconds than it took, `die` with a signal,
# `leave` with a status, `once` only where this file is not there yet, `size` of the result, `twice` printed.
GROUP = """
import hashlib, json, os, sys, time
read = json.load(sys.stdin)
for job in read["jobs"]:
    options = json.loads(job["task"])["options"]
    once = options.get("once")
    if once is None or not os.path.exists(once):
        if once is not None:
            open(once, "x").close()
        if "die" in options:
            sys.stderr.write("x" * 5000 + "the last words")
            sys.stderr.flush()
            os.kill(os.getpid(), options["die"])
        if "leave" in options:
            sys.exit(options["leave"])
        time.sleep(options.get("sleep", 0))
    result = {
        "documents": read["documents"], "jobs": len(read["jobs"]), "limits": job["limits"], "pid": os.getpid(),
        "home": os.environ.get("OF_THE_WORKER"), "padding": "x" * options.get("size", 0),
    }
    record = {
        "key": hashlib.sha256(job["task"].encode()).hexdigest()[:32], "outcome": "ok", "result": result,
        "seconds": options.get("claim", options.get("sleep", 0)),
    }
    print("a stray line\\n{}\\n" + json.dumps({**record, "key": "unknown"}))
    for _ in range(2 if options.get("twice") else 1):
        print(json.dumps(record), flush=True)
"""


class Machines:
    """A scheduler and workers, each in a process group of its own, that end with the test."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.file = folder / "scheduler.json"
        self.running: list[subprocess.Popen[bytes]] = []
        self.scheduler = self.start("distributed.cli.dask_scheduler", "--port", "0", "--scheduler-file", str(self.file))
        self.script = folder / "group.py"
        self.script.write_text(GROUP, encoding="utf-8")
        self.command = [sys.executable, "-S", str(self.script)]

    def is_known(self) -> bool:
        """Whether the scheduler has written its file, to the end."""
        try:
            return "address" in json.loads(self.file.read_text())
        except (OSError, ValueError):
            return False

    def start(self, module: str, *options: str) -> subprocess.Popen[bytes]:
        # --no-dashboard alone leaves a server of HTTP on all interfaces.
        here = ["--host", "127.0.0.1", "--no-dashboard", "--dashboard-address", "127.0.0.1:0"]
        command = [sys.executable, "-m", module, *here, *options]
        env = {**os.environ, "OF_THE_WORKER": "kept", "PYTHONWARNINGS": "ignore"}
        with (self.folder / "log").open("ab") as log:
            where = {"stdout": log, "stderr": log, "cwd": self.folder, "env": env}
            self.running.append(subprocess.Popen(command, start_new_session=True, **where))
        return self.running[-1]

    def worker(self, threads: int = 2, nanny: bool = True) -> subprocess.Popen[bytes]:
        place = ["--scheduler-file", str(self.file), "--local-directory", str(self.folder)]
        kind = "--nanny" if nanny else "--no-nanny"
        return self.start("distributed.cli.dask_worker", *place, "--nthreads", str(threads), kind)

    def kill(self, process: subprocess.Popen[bytes]) -> None:
        """End a process, its nanny's child and the group commands, all at once and for good."""
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        self.running.remove(process)

    def end(self) -> None:
        for process in self.running.copy():
            self.kill(process)

    def workers(self, documents=lambda digest: digest, **options) -> ClusterWorkers:
        """An executor on this scheduler, with our script."""
        return ClusterWorkers(str(self.file), documents, **{"command": self.command, **options})


@contextmanager
def machines_in(folder, threads=0):
    """A scheduler, and a worker with so many threads that is started at the same time."""
    with ExitStack() as stack:
        machines = Machines(folder)
        stack.callback(machines.end)
        if threads:
            machines.worker(threads, nanny=False)
        until(machines.is_known)
        yield machines


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    """A scheduler with two threads, for tests that leave it as it was."""
    with machines_in(tmp_path_factory.mktemp("cluster"), threads=2) as machines:
        yield machines


@pytest.fixture
def own(tmp_path):
    """A scheduler, still without workers, that the test may destroy."""
    with machines_in(tmp_path) as machines:
        yield machines


def jobs_of(number, limits=TaskLimits(), kind="test", **options):  # noqa: B008
    """Jobs that differ in their number only."""
    return [Job(Task(kind, None, {"number": n, **options}), limits) for n in range(number)]


def done(workers, jobs, seconds=100.0, meanwhile=lambda records: None):
    """Run jobs as a batch does, and return all that comes back."""
    left, records = list(reversed(jobs)), []
    end = time.monotonic() + seconds
    while left or workers.in_flight:
        assert time.monotonic() < end, f"{workers.in_flight} jobs never came back"
        while left and workers.is_free:
            workers.submit(left.pop())
        records += workers.wait(0.5)
        meanwhile(records)
    return records


def assert_exactly_once(records, jobs):
    assert Counter(record.key for record in records) == Counter(job.task.key for job in jobs)


@pytest.fixture
def workers(shared):
    """An executor on the shared scheduler, closed afterwards."""
    with closing(shared.workers()) as opened:
        yield opened


def test_a_record_that_is_printed_twice_is_handed_back_once(workers):
    jobs = jobs_of(10, twice=True)
    assert_exactly_once(done(workers, jobs), jobs)
    assert (workers.in_flight, len(workers._groups)) == (0, 0)


def test_a_group_carries_the_documents_it_needs_and_no_others(shared):
    tasks = [Task("test", {"document": name, "parameters": {}}, {}) for name in ("first", "second")]
    tasks.append(Task("test", {"family": {"m": 2}}, {}))
    tasks.append(Task("test", {"document": "first", "parameters": {}}, {"other": {"document": "third"}}))
    with closing(shared.workers("text of {}".format)) as workers:
        results = {record.key: record.result["documents"] for record in done(workers, [Job(task) for task in tasks])}
    needed = [["first"], ["second"], [], ["first", "third"]]
    assert [results[task.key] for task in tasks] == [{name: f"text of {name}" for name in names} for names in needed]


def test_a_group_that_is_killed_leaves_only_the_guilty_job_lost(workers):
    good, bad = jobs_of(12), jobs_of(1, die=9)
    records = done(workers, [*good[:8], *bad, *good[8:]])
    assert_exactly_once(records, good + bad)
    (lost,) = [record for record in records if not record.is_ok]
    assert (lost.key, lost.outcome) == (bad[0].task.key, Outcome.LOST)
    assert lost.message == "the worker's command was killed by signal 9 (SIGKILL), from outside or for want of memory"
    assert lost.stderr.endswith("the last words")
    assert len(lost.stderr) == 2000


def test_a_job_is_done_at_the_second_try_with_its_limits_in_the_environment_of_the_worker(workers, tmp_path):
    (job,) = jobs_of(1, die=9, once=str(tmp_path / "been-here"), size=1 << 20, limits=TaskLimits(7.5, 10**9))
    (record,) = done(workers, [job])
    assert record.result["limits"] == {"time": 7.5, "memory": 10**9}
    assert record.result["home"] == "kept"
    assert len(record.result["padding"]) == 1 << 20


def test_a_job_whose_group_always_ends_early_is_lost_after_a_few_tries_and_has_no_result(workers, tmp_path):
    counted = f"printf x >> {shlex.quote(str(tmp_path / 'tries'))}; exec {shlex.join(workers._command)}"
    workers._command = ["/bin/sh", "-c", counted]
    bad, good = jobs_of(1, leave=3), jobs_of(1, kind="other", sleep=1)  # nobody has printed a record meanwhile
    records = {record.key: record for record in done(workers, [*bad, *good])}
    assert (tmp_path / "tries").stat().st_size == TRIES + 1
    assert (list(workers._retries), workers._groups) == ([], {})  # nor is it tried again when it is told
    lost = records[bad[0].task.key]
    assert (lost.outcome, lost.message) == (Outcome.LOST, "the worker's command ended with status 3")
    assert records[good[0].task.key].is_ok


def test_a_group_that_hangs_is_ended_and_only_the_guilty_job_is_lost(shared, monkeypatch):
    monkeypatch.setattr(cluster, "GROUP_START", 0.5)
    monkeypatch.setattr(cluster, "JOB_START", 0.05)
    limits = TaskLimits(time=0.05)
    good = jobs_of(12, limits=limits)
    bad = jobs_of(1, limits=limits, sleep=600, claim=0)
    with closing(shared.workers()) as workers:
        records = done(workers, [*good[:8], *bad, *good[8:]])
    assert_exactly_once(records, good + bad)
    (hung,) = [record for record in records if not record.is_ok]
    assert (hung.key, hung.outcome) == (bad[0].task.key, Outcome.LOST)
    assert hung.message == "the worker's command did not end within 0.6 s"


def test_a_module_that_the_workers_lack_is_one_error_and_not_a_record_for_each_task(shared):
    command = [sys.executable, "-S", "-m", "no_such_module"]
    with closing(shared.workers(command=command)) as workers, pytest.raises(WorkersUnfit, match="no_such_module"):
        done(workers, jobs_of(3))


def test_every_record_is_returned_once_although_a_worker_and_its_nanny_are_killed(own):
    first = own.worker()
    own.worker()
    jobs = jobs_of(60, sleep=0.05)

    def kill(records):
        if len(records) > 10 and first in own.running:
            own.kill(first)

    with closing(own.workers(group_seconds=0.5)) as workers:
        records = done(workers, jobs, meanwhile=kill)
    assert_exactly_once(records, jobs)
    assert all(record.is_ok for record in records)


def test_a_killed_scheduler_is_reported_at_once_without_waiting(own):
    own.worker(nanny=False)
    with closing(own.workers()) as workers:
        workers.submit(jobs_of(1, sleep=600)[0])
        assert workers.wait(0.5) == []
        own.kill(own.scheduler)
        refuses(r"what was recorded is safe; run the same command again", workers.wait, 100, error=ClusterLost)


# Batches

HERE = Path(__file__).resolve().parent
STUDY = """
limits = { time = "60 s", memory = "300 MB" }
[experiments.pause]
task = "pause"
options = { steps = 10 }
axes = { seed = "0..299" }
[experiments.faults]
task = "fault"
axes = { order = [2, 5, 8], seed = "0..3" }
[experiments.top]
task = "check-integrals"
system = ["euler_top", "lorenz"]
axes = { eps = ["1/10", "1/3"] }
"""
SHORT = STUDY.replace("0..299", "0..1").replace("[2, 5, 8]", "[8]").replace("0..3", "0..1").replace(', "1/3"', "")


@pytest.fixture
def study(monkeypatch, tmp_path):
    """Start `batch run` of STUDY on a scheduler, with the tasks of fault_tasks.py; wait until some tasks are done."""
    monkeypatch.syspath_prepend(str(HERE))
    monkeypatch.setenv("KAHANMAPS_TASKS", "fault_tasks")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(map(str, (HERE, HERE.parents[1], HERE.parents[1] / "cli"))))
    monkeypatch.chdir(tmp_path)
    Path("study.toml").write_text(STUDY)

    def start(machines, number):
        command = [*COMMAND, "batch", "run", "study.toml", "--db", "away.db", "-q", "--group-seconds", "0.3"]
        command += ["--scheduler", str(machines.file)]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        until(lambda: recorded("away.db") >= number or process.poll() is not None, 60)
        return process

    return start


@pytest.mark.usefixtures("study")
def test_a_batch_done_by_workers_has_the_results_of_one_at_home(shared):
    away, home = list(run(SHORT, "away.db", scheduler=str(shared.file))), list(run(SHORT, "home.db", jobs=2))
    assert len(away) == len(home) == 2 + 2 + 2
    assert exported("away.db") == exported("home.db")


@pytest.mark.slow
def test_what_is_killed_on_a_cluster_changes_nothing(own, study):
    first, _ = own.worker(1), own.worker(1)
    batch = study(own, 20)
    own.kill(first)  # a worker with its nanny, in the middle of its groups
    own.worker(1)
    until(lambda: recorded("away.db") >= 60, 60)
    batch.send_signal(signal.SIGKILL)  # the coordinator
    batch.communicate()
    assert 60 <= recorded("away.db") < 316
    batch = study(own, 0)
    _, err = batch.communicate(timeout=100)
    assert batch.returncode == 3, err  # some tasks fail, as meant
    list(run("study.toml", "home.db", jobs=2))
    assert exported("away.db") == exported("home.db")


def test_an_address_where_no_scheduler_answers_is_refused_in_a_sentence():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{taken.getsockname()[1]}"
        said = f"no dask scheduler answers at {address} within 0.3 s"
        refuses(said, ClusterWorkers, address, str, connect_seconds=0.3)


@pytest.mark.parametrize(
    ("address", "sentence"),
    [
        ("tcp://host", "'tcp://host' is not the address of a scheduler: write tcp://host:port"),
        ("no-such-file.json", "cannot read the scheduler file no-such-file.json: No such file or directory"),
        ("udp://127.0.0.1:8786", "no dask scheduler answers"),
    ],
)
def test_a_malformed_address_is_refused_in_a_sentence(address, sentence):
    refuses(sentence, ClusterWorkers, address, str, connect_seconds=0.3)


def test_a_missing_installation_is_reported_with_the_command_that_repairs_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    refuses(r"pip install 'kahanmaps\[cluster\]'", ClusterWorkers, "tcp://127.0.0.1:8786", str)
