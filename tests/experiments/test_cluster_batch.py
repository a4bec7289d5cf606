"""`batch run --scheduler` with a real scheduler and workers: the same results as at home, whatever is killed."""

import importlib.util
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from kahanmaps_cli.main import main

pytest.importorskip("distributed")

HERE = Path(__file__).resolve().parent
BATCH = [sys.executable, "-m", "kahanmaps_cli.main", "batch", "run", "study.toml"]
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


@pytest.fixture
def machines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """A scheduler, whose workers are started by the test, and the folder of the study as the current one."""
    monkeypatch.syspath_prepend(str(HERE))
    monkeypatch.setenv("KAHANMAPS_TASKS", "fault_tasks")
    monkeypatch.setenv("PYTHONPATH", f"{HERE}{os.pathsep}{HERE.parents[1]}{os.pathsep}{HERE.parents[1] / 'cli'}")
    (tmp_path / "cluster").mkdir()
    (tmp_path / "study.toml").write_text(STUDY)
    monkeypatch.chdir(tmp_path)
    spec = importlib.util.spec_from_file_location("the_cluster_tests", HERE / "test_cluster.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    with module.machines_in(tmp_path / "cluster") as found:
        yield found


def exported(db: str, capsys: pytest.CaptureFixture[str]) -> str:
    """The results, without times and places."""
    capsys.readouterr()
    assert main(["batch", "export", "--db", db, "--jsonl", "--stable"]) == 0
    return capsys.readouterr().out


def done(db: str) -> int:
    """How many tasks have a record."""
    from kahanmaps.experiments.results.store import Store, StoreError

    try:
        with Store.open(db, readonly=True) as store:
            return sum(one.tasks - one.missing for one in store.status())
    except StoreError:
        return 0


def start(machines: Any) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*BATCH, "--db", "away.db", "--scheduler", str(machines.file), "-q", "--group-seconds", "0.3"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def until_done(db: str, number: int, process: subprocess.Popen[str]) -> None:
    deadline = time.monotonic() + 40
    while done(db) < number:
        assert time.monotonic() < deadline, "the batch does not get on"
        assert process.poll() is None, process.stderr.read() if process.stderr else ""
        time.sleep(0.05)


@pytest.mark.slow
def test_what_is_killed_on_a_cluster_changes_nothing(machines: Any, capsys: pytest.CaptureFixture[str]):
    assert main(["batch", "run", "study.toml", "--db", "home.db", "-q", "-j", "2"]) == 3  # some tasks fail, as meant
    first, _ = machines.worker(1), machines.worker(1)
    batch = start(machines)
    until_done("away.db", 20, batch)
    machines.kill(first)  # a worker with its nanny, in the middle of its groups
    machines.worker(1)
    until_done("away.db", 60, batch)
    batch.send_signal(signal.SIGKILL)  # the coordinator
    batch.communicate()
    kept = done("away.db")
    assert 60 <= kept < 316
    batch = start(machines)
    _, err = batch.communicate(timeout=100)
    assert batch.returncode == 3, err
    assert exported("away.db", capsys) == exported("home.db", capsys)


@pytest.mark.slow
def test_a_scheduler_that_dies_is_a_sentence_and_the_batch_goes_on_elsewhere(
    machines: Any, capsys: pytest.CaptureFixture[str]
):
    machines.worker(2)
    batch = start(machines)
    until_done("away.db", 10, batch)
    machines.kill(machines.scheduler)
    _, err = batch.communicate(timeout=60)
    assert batch.returncode == 3
    assert "what was recorded is safe" in err
    assert "Traceback" not in err
    kept = done("away.db")
    assert kept >= 10
    assert main(["batch", "run", "study.toml", "--db", "away.db", "-q", "-j", "2"]) == 3
    assert main(["batch", "run", "study.toml", "--db", "home.db", "-q", "-j", "2"]) == 3
    assert exported("away.db", capsys) == exported("home.db", capsys)


# What is killed in a round, with which signal, and how often that is tried, is drawn from the number of the round.
