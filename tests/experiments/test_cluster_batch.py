"""`batch run --scheduler` with a real scheduler and workers: the same results as at home, whatever is killed."""

from __future__ import annotations

import importlib.util
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
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
    from kahanmaps.experiments.database import StoreError
    from kahanmaps.experiments.store import Store

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
ROUNDS = int(os.environ.get("KAHANMAPS_TEST_ROUNDS", "2"))
SIGNALS = [signal.SIGTERM, signal.SIGQUIT, signal.SIGHUP, signal.SIGINT, signal.SIGKILL, signal.SIGUSR1]
VICTIMS = ["child"] * 4 + ["group"] * 4 + ["worker", "worker's machine", "coordinator", "everything", "scheduler"]
AT_HOME: dict[str, str] = {}  # the results of a study, once it has been done
LONGER = STUDY.replace("steps = 10 ", "steps = 100 ").replace("0..299", "0..39")


def renew(machines: Any) -> None:
    """A new scheduler with two workers in place of what there is."""
    machines.end()
    machines.file.unlink()
    file = str(machines.file)
    machines.scheduler = machines.start("distributed.cli.dask_scheduler", "--port", "0", "--scheduler-file", file)
    while not machines.is_known():
        time.sleep(0.05)
    for _ in range(2):
        machines.worker(1)


def strike(machines: Any, batch: subprocess.Popen[str], victim: str, number: int, rng: random.Random) -> None:
    """Kill something of this kind, if there is one now."""
    import psutil

    below = []
    for process in machines.running:
        if process is not machines.scheduler:
            with suppress(psutil.NoSuchProcess):
                below += psutil.Process(process.pid).children(recursive=True)
    found: dict[str, list[int]] = {"child": [], "group": [], "worker": []}
    for one in below:
        with suppress(psutil.NoSuchProcess, psutil.ZombieProcess):
            words = " ".join(one.cmdline())
            kinds = [kind for kind in ("child", "group") if f"kahanmaps.experiments.{kind}" in words]
            found[kinds[0] if kinds else "worker"].append(one.pid)
    if victim == "scheduler":
        machines.kill(machines.scheduler)
        batch.communicate(timeout=60)
        renew(machines)
    elif victim == "worker's machine":
        chosen = rng.choice([process for process in machines.running if process is not machines.scheduler])
        machines.kill(chosen)
        machines.worker(1)
    else:
        if victim in ("child", "group", "worker"):
            pids = rng.sample(found[victim], min(1, len(found[victim])))
        else:
            pids = [*found["child"], *found["group"]] if victim == "everything" else []
            pids.insert(rng.choice((0, len(pids))), batch.pid)
        for pid in pids:
            with suppress(ProcessLookupError):
                os.kill(pid, number)


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("number", range(ROUNDS))
def test_whatever_is_killed_by_whatever_signal_the_results_are_those_at_home(
    machines: Any, capsys: pytest.CaptureFixture[str], number: int
):
    Path("study.toml").write_text(LONGER)
    if LONGER not in AT_HOME:
        assert main(["batch", "run", "study.toml", "--db", "home.db", "-q", "-j", "2"]) == 3
        AT_HOME[LONGER] = exported("home.db", capsys)
    rng = random.Random(number)
    for _ in range(2):
        machines.worker(1)
    batch = start(machines)
    until_done("away.db", 5, batch)
    struck = []
    for _ in range(8):
        time.sleep(rng.uniform(0.1, 1.0))
        if batch.poll() is not None:
            batch.communicate()
            batch = start(machines)
            time.sleep(rng.uniform(1.0, 2.0))
        struck.append((rng.choice(VICTIMS), rng.choice(SIGNALS)))
        strike(machines, batch, *struck[-1], rng)
    batch.kill()
    batch.communicate()
    renew(machines)  # a worker that has been asked to end does not come again
    runs = 0
    while done("away.db") < 56:
        runs += 1
        assert runs <= 5, struck
        _, err = start(machines).communicate(timeout=300)
        assert "Traceback" not in err
    assert exported("away.db", capsys) == AT_HOME[LONGER], struck
