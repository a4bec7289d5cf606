"""`kahanmaps batch`: what it prints, what it says on standard error, its exit statuses, and that it can be interrupted.

Tasks that go wrong are those of tests/experiments/fault_tasks.py; more of what it prints is in docs/howto/run-a-batch.
"""

import json
import re
import shutil
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path

import pytest
from cli_helpers import COMMAND, environment, shell
from helpers import quick
from small_databases import ok, planned, recorded, task, until

import kahanmaps as km
from kahanmaps.experiments.registry import task_kind
from kahanmaps.experiments.results.store import Store
from kahanmaps.experiments.results.system_spec import system_from
from kahanmaps.experiments.running.local import LocalWorkers

FAULTS = Path(__file__).parent.parent / "experiments"
SPACE = """
[experiments.space]
task = "family-space"
system = "family"
axes = { m = "2..3", seed = "0..2" }
"""
PAUSE = """
[experiments.pause]
task = "pause"
options = { steps = 30 }
axes = { seed = "0..39" }
"""
FAULT = """
[experiments.fault]
task = "fault"
axes = { order = [8], seed = "0..3" }
"""


@pytest.fixture(autouse=True)
def _fault_tasks(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(str(FAULTS))
    monkeypatch.setenv("KAHANMAPS_TASKS", "fault_tasks")
    monkeypatch.setenv("PYTHONPATH", str(FAULTS))
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def batch(kahanmaps):
    """`kahanmaps batch`; a text with a line break in it becomes the file study.toml."""

    def run(*pieces):
        words = []
        for piece in pieces:
            if "\n" in piece:
                Path("study.toml").write_text(piece)
                piece = "study.toml"
            words.append(piece)
        return kahanmaps("batch", *words)

    return run


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A folder with SPACE as study.toml, and its results in study.db."""
    folder = tmp_path_factory.mktemp("space")
    (folder / "study.toml").write_text(SPACE)
    list(km.run(folder / "study.toml", folder / "study.db"))
    return folder


@pytest.fixture
def space(results, tmp_path):
    """Both files where the test runs."""
    shutil.copytree(results, tmp_path, dirs_exist_ok=True)


def test_a_batch_runs_and_says_where_the_results_are(batch):
    done = batch("run", SPACE, "-j 2")
    assert done.status == 0
    assert done.rows == [["experiment", "tasks", "missing", "ok", "time"], ["space", "6", "0", "6", done.rows[1][4]]]
    assert "6 tasks to do, results go to study.db" in done.err
    assert Path("study.db").exists()


@pytest.mark.usefixtures("space")
def test_the_second_run_has_nothing_to_do(batch):
    done = batch("run", SPACE)
    assert done.status == 0
    assert done.err == "nothing to do: every task has a result in study.db\n"


def test_failed_tasks_give_status_3_and_say_how_to_try_again(batch):
    done = batch("run", FAULT, "-j", "1")
    assert done.status == 3
    assert "2 tasks failed, why: kahanmaps batch summary --db study.db --by outcome,message; " in done.err
    assert "kahanmaps batch run study.toml --db study.db --retry-failed" in done.err
    assert batch("run", FAULT, "-q").status == 3  # they have not been mended
    assert batch("run --db study.db --retry-failed --json -q").json["done"] == {"failed": 2}


def test_refuted_claims_are_results_like_others(batch):
    done = batch("run", PAUSE.replace("0..39", "0..5").replace("30", "1"), "-q")
    assert done.status == 0
    assert done.rows[0][4:6] == ["proved", "refuted"]
    assert done.rows[1][4:6] == ["4", "2"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("show 12 --db study.db", "4"),
        ("show ffff0000 --db study.db", "no task"),
        ("export --db study.db", "missing --csv, --jsonl or --parquet"),
        ("export --db study.db --parquet", "needs -o"),
        ("summary --db study.db --by sead", "seed"),
        ("merge all.db no.db", "there is no database no.db"),
    ],
)
def test_wrong_use_is_status_2_and_a_sentence(batch, words, message, space):
    done = batch(words)
    assert done.status == 2
    assert message in done.err
    assert "Traceback" not in done.err
    assert not Path("all.db").exists()


def test_the_database_may_be_named_in_the_environment(batch, monkeypatch, space):
    monkeypatch.setenv("KAHANMAPS_DB", "study.db")
    assert batch("status").status == 0


def test_show_has_all_that_is_known_of_a_task(batch, space):
    key = batch("export --db study.db --jsonl").records[1]["key"]
    shown = dict(line.split("\t", 1) for line in batch(f"show {key[:8]} --db study.db").out.splitlines())
    assert shown["task"] == "family-space"
    assert shown["in"] == "space 0"
    assert re.fullmatch(r"[\d.e-]+ s, \d+ MB at most, attempts: 1", shown["took"])
    assert shown["result.dimension"] == "8"
    data = batch(f"show {key} --db study.db --json").json
    assert data["result"]["dimension"] == 8
    assert data["places"] == [{"experiment": "space", "number": 0}]
    assert data["attempts"] == 1


def test_a_task_can_be_redone_from_what_show_prints(batch):
    batch("run", '[experiments.top]\ntask = "check-integrals"\nsystem = "euler_top"\noptions.eps = "1/7"\n', "-q")
    key = batch("export --db study.db --jsonl").records[1]["key"]
    data = batch(f"show {key} --db study.db --json").json
    documents = {digest: json.dumps(document) for digest, document in data["documents"].items()}
    again = task_kind(data["task"]).perform(system_from(data["system"], documents.__getitem__), data["options"])
    assert again.pop("verdict") == data["verdict"]
    assert again == data["result"]


def test_different_results_of_one_task_are_reported_and_those_of_the_target_are_kept(batch):
    for name, value in (("one.db", 1), ("two.db", 2)):
        planned(name, 1, records=[ok(1, value)])
    with Store.open("two.db"):  # nothing is written to what another process may be writing to
        done = batch("merge one.db two.db")
    assert done.status == 3
    assert done.rows == [["two.db", "new results: 0", "failures replaced: 0", "conflicts: 1"]]
    assert "1 task with different results in two databases, those of one.db were kept" in done.err
    assert task(1).key in done.err
    assert batch("export --db one.db --jsonl").records[1]["result"] == {"value": 1}
    (messages,) = batch("merge one.db two.db --json -q").json["merged"]
    assert (messages["conflicts"], messages["conflicting"]) == (1, [task(1).key])
    assert batch("merge one.db one.db").status == 2


@pytest.fixture
def start() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Start a batch in a process of its own and wait until it is at work; it ends with the test."""
    with ExitStack() as processes:

        def run(*words: str, tasks: int = 4) -> subprocess.Popen[str]:
            command, pipe = [*COMMAND, "batch", "run", *words], subprocess.PIPE
            process = subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, env=environment())
            processes.callback(process.communicate)
            processes.callback(process.kill)
            until(lambda: recorded("study.db") >= tasks)
            return process

        yield run


@pytest.mark.parametrize("number", quick([signal.SIGINT, signal.SIGTERM], [signal.SIGINT]))
def test_ctrl_c_ends_the_tasks_in_flight_and_says_how_to_continue(batch, start, number):
    Path("study.toml").write_text(PAUSE)
    process = start("study.toml", "-j", "2")
    process.send_signal(number)
    out, err = process.communicate(timeout=100)
    assert process.returncode == 130
    assert "interrupted: " in err
    assert "to continue: kahanmaps batch run study.toml --db study.db" in err
    row = out.splitlines()[1].split("\t")
    assert int(row[1]) == 40
    assert 0 < int(row[2]) < 40
    assert batch("run", PAUSE, "-q").status == 0


def test_nothing_is_printed_in_the_handler_of_ctrl_c_which_may_find_a_line_half_written(batch, monkeypatch):
    messages: list[str] = []

    @contextmanager
    def pressed(interrupt: Callable[[], None]) -> Iterator[None]:
        with monkeypatch.context() as patched:
            patched.setattr(
                "kahanmaps_cli.screen.progress.click.echo", lambda *_, **__: messages.append("in the handler")
            )
            patched.setattr("kahanmaps.experiments.running.local.LocalWorkers.in_flight", 2)
            interrupt()
        yield

    monkeypatch.setattr("kahanmaps_cli.commands.batch.interruptible", pressed)
    assert (batch("run", PAUSE, "-j", "2").status, messages) == (130, [])


def test_the_end_of_a_run_says_how_many_tasks_were_lost_and_how_to_continue(batch, monkeypatch):
    monkeypatch.setattr("kahanmaps.experiments.running.run.LocalWorkers", partial(LocalWorkers, tries=1))
    spec = FAULT.replace("[8]", "[1]").replace('"0..3"', '"0..2"')  # order 1: killed by SIGKILL, where the seed is odd
    done = batch("run", spec, "--json")
    assert done.status == 3
    assert (done.json["done"], done.json["missing"]) == ({"ok": 2, "lost": 1}, 1)
    assert "1 task lost without a result: their worker was killed or could not be started 5 times" in done.err
    assert "(the child was killed by signal 9 (SIGKILL), from outside or for want of memory)" in done.err
    assert "1 task without a result yet; to continue: kahanmaps batch run study.toml --db study.db" in done.err
    assert "failed" not in done.err
    assert [row[1:4] for row in batch("status --db study.db").rows] == [["tasks", "missing", "ok"], ["3", "1", "2"]]
    lines = batch("export --db study.db --jsonl").records
    assert [line["number"] for line in lines if line["record"] == "result"] == [0, 2]
    (group,) = batch("summary", "--db", "study.db", "--json").json["groups"]
    assert (group["tasks"], group["missing"], sum(group["outcomes"].values())) == (3, 1, 2)
    again = batch("run", spec, "--jsonl")
    assert again.status == 3
    (record,) = again.records
    assert (record["outcome"], record["result"]) == ("lost", None)
    assert "outcome\tnone yet" in batch("show", record["key"], "--db", "study.db").out


def test_a_second_ctrl_c_is_immediate(start):
    Path("study.toml").write_text(PAUSE.replace("steps = 30", "steps = 600000"))
    process = start("study.toml", "-j", "2", tasks=0)
    threads = Path(f"/proc/{process.pid}/task")
    # Two workers, and the process in which Python keeps account of its semaphores.
    until(lambda: sum(len(file.read_text().split()) for file in threads.glob("*/children")) == 3)
    process.send_signal(signal.SIGINT)
    assert any("finishing 2 tasks in flight" in line for line in process.stderr or ())
    assert process.poll() is None  # waits for them
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=100)  # of tasks that take ten minutes
    assert process.returncode == 130
    assert err.split() == ["interrupted"]  # after the grace of the first one there would be a table


@pytest.mark.parametrize("blocks", [0, 40])
def test_a_full_disk_ends_a_batch_with_status_3_and_what_was_stored_before(batch, tmp_path, blocks):
    """What is planned does not fit, or the file itself, or its lock; ulimit counts in units of 1024 bytes."""
    Path("study.toml").write_text(SPACE.replace('"0..2"', '"0..999"'))
    done = shell(f"ulimit -f {blocks}; kahanmaps batch run study.toml -j 1 -q", tmp_path)
    assert done.status == 3, done
    assert re.match("Error: study.db .*(disk|space|too large)", done.err), done.err
    if blocks:
        assert batch("run", SPACE, "-q", "-j", "1").status == 0


def test_bad_files_are_skipped_with_a_list(kahanmaps):
    for name, rhs in (("a", "x' = x"), ("b", "x' = z"), ("c", "x' =")):
        Path(f"{name}.toml").write_text(f'[system]\nrhs = "{rhs}"\n')
    Path("spec").write_text('[experiments.o]\ntask = "orbit"\nsystem = "*.toml"\noptions = {eps = 1}\n')
    assert "skipped\tb.toml" in kahanmaps("batch run spec --dry-run --skip-bad --db o.db").out
    assert not Path("o.db").exists()
    assert kahanmaps("batch run spec --skip-bad -j 1 --db o.db").status == 0
    [entry] = kahanmaps("batch status --db o.db --json").json["experiments"]
    assert (entry["tasks"], [skipped["system"] for skipped in entry["skipped"]]) == (1, ["b.toml", "c.toml"])
