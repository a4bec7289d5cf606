"""Running batches: what comes out does not depend on how it was run, and nothing that is killed loses a record."""

import random
import sqlite3
import subprocess
import sys
import time
from collections import Counter
from itertools import islice

import pytest
from small_databases import exported

from kahanmaps.experiments.results.records import Job, Outcome, Record, Task
from kahanmaps.experiments.results.store import Store
from kahanmaps.experiments.running.run import Batch, run
from kahanmaps.experiments.spec import parse_spec

pytestmark = pytest.mark.usefixtures("fault_tasks")
MIXED = """
name = "mixed"
limits = { time = "30 s", memory = "150 MB" }
[experiments.faults]
task = "fault"
axes = { order = [6, 8], seed = "0..1" }
[experiments.space]
task = "family-space"
system = "family"
axes = { m = 2, seed = "0..1" }
[experiments.top]
task = "check-integrals"
system = ["euler_top", "lorenz"]
axes = { time_step = "1/5" }
"""
PAUSES = """
[experiments.pause]
task = "pause"
options = {{ steps = {milliseconds} }}
axes = {{ seed = "0..{last}" }}
"""


@pytest.fixture(scope="module")
def undisturbed(fault_tasks, tmp_path_factory) -> str:
    """What MIXED gives, one child at a time."""
    db = tmp_path_factory.mktemp("undisturbed") / "results.db"
    records = list(run(MIXED, db))
    assert Counter(record.outcome for record in records) == {Outcome.OK: 5, Outcome.FAILED: 2, Outcome.OUT_OF_MEMORY: 1}
    return exported(db)


def test_results_depend_neither_on_children_nor_on_the_order_of_tasks_nor_on_interruptions(undisturbed, tmp_path):
    outcome = run(MIXED, tmp_path / "b.db", jobs=2, only=["space"])
    assert len(list(islice(outcome, 1))) == 1
    outcome.close()
    list(run(MIXED, tmp_path / "b.db", jobs=2))
    assert exported(tmp_path / "b.db") == undisturbed


def test_a_record_is_in_the_database_before_it_is_yielded(tmp_path):
    outcome = run(PAUSES.format(milliseconds=1, last=20), tmp_path / "a.db")
    for record in islice(outcome, 5):
        with Store.open(tmp_path / "a.db", readonly=True) as store:
            ((_, stored, _, _),) = store.find(record.key)
        assert stored == record
    outcome.close()


def test_a_changed_axis_runs_the_new_tasks_only(tmp_path):
    text = PAUSES.format(milliseconds=1, last=5)
    (tmp_path / "spec.toml").write_text(text)
    assert len(list(run(tmp_path / "spec.toml", tmp_path / "a.db"))) == 6
    for spec in (str(tmp_path / "spec.toml"), text, parse_spec(text)):
        assert list(run(spec, tmp_path / "a.db")) == []
    new = list(run(PAUSES.format(milliseconds=1, last=8), tmp_path / "a.db"))
    assert sorted(record.result["seed_squared"] for record in new if record.result) == [36, 49, 64]


class Scripted:
    """An executor that hands back what was submitted, one at a time, and writes down what it was asked."""

    def __init__(self) -> None:
        self.jobs: list[Job] = []

    @property
    def is_free(self) -> bool:
        return len(self.jobs) < 3

    @property
    def in_flight(self) -> int:
        return len(self.jobs)

    def submit(self, job: Job) -> None:
        self.jobs.append(job)

    def wait(self, timeout: float) -> list[Record]:
        return [Record(self.jobs.pop(0).task.key, Outcome.OK)]

    def close(self) -> None:
        pass


def jobs(count: int):
    return (Job(Task("pause", None, {"seed": seed})) for seed in range(count))


def test_nothing_is_handed_out_after_an_interrupt(monkeypatch):
    monkeypatch.setattr("kahanmaps.experiments.running.run._COLLECTION_FACTOR", 0)  # records come one at a time
    batch, seen = Batch(jobs(50), Scripted()), 0
    for records in batch:
        seen += len(records)
        if seen == 10:
            batch.interrupt()
    # The three in flight are done.
    assert (seen, batch.was_interrupted, batch.abandoned) == (13, True, 0)


def test_what_is_not_done_within_the_grace_is_given_up():
    class Slow(Scripted):
        def wait(self, timeout: float) -> list[Record]:
            time.sleep(0.005)
            return []

    executor = Slow()
    batch = Batch(jobs(5), executor, grace=0.02)
    batch.interrupt()
    assert not any(batch)
    batch = Batch(jobs(5), executor, grace=0.02)
    executor.jobs = list(jobs(2))
    batch.interrupt()
    assert not any(batch)
    assert batch.abandoned == 2


@pytest.mark.parametrize(("kills", "last"), [(1, 40), pytest.param(50, 12_000, marks=pytest.mark.slow)])
def test_a_batch_that_is_killed_again_and_again_comes_to_the_same_end(tmp_path, kills, last):
    text = PAUSES.format(milliseconds=4, last=last)
    (tmp_path / "spec.toml").write_text(text)
    list(run(text, tmp_path / "calm.db", jobs=2))
    wild, command = tmp_path / "wild.db", [sys.executable, "-m", "kahanmaps_cli.main", "batch", "run", "spec.toml"]
    rng, killed = random.Random(kills), 0
    while killed < kills:
        process = subprocess.Popen([*command, "--db", wild, "-j", "2", "-q"], cwd=tmp_path)
        try:
            assert process.wait(rng.uniform(0.05, 1.2)) == 0
            wild.unlink()  # done before it could be killed: once more from the start
        except subprocess.TimeoutExpired:
            process.kill()
            killed += 1
            process.wait()
    assert sum(1 for _ in run(text, wild, jobs=2)) <= last + 1
    assert exported(wild) == exported(tmp_path / "calm.db")
    assert sqlite3.connect(wild).execute("PRAGMA integrity_check").fetchone() == ("ok",)
    assert not list(tmp_path.glob("*.db-*"))
