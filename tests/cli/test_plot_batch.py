"""kahanmaps plot batch."""

import re

import pytest

from kahanmaps.experiments.results.records import Limits, Outcome, Record, Task
from kahanmaps.experiments.results.store import Store


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Thirty tasks of two sizes: three have failed, three have no result, one number is beyond doubles."""
    path = tmp_path_factory.mktemp("study") / "study.db"
    tasks = [Task("orbit", {"family": {"m": 1 + k % 2, "seed": k}}, {"eps": f"1/{k + 1}"}) for k in range(30)]
    records = [
        Record(task.key, Outcome.OK, {"c": k, "far": "1" + "0" * 400 if k == 5 else k}, "proved")
        if k % 10
        else Record(task.key, Outcome.FAILED, message="no")
        for k, task in enumerate(tasks[:-3])
    ]
    with Store.open(path, create=True) as store:
        store.plan("study", "thirty", Limits(time=1, memory=1 << 30), tasks, {})
        store.add(records)
    return path


def test_counts_are_bars(kahanmaps, study):
    done = kahanmaps("plot batch", study, "--by m")
    assert done.status == 0
    for word in ("proved", "failed", "missing"):
        assert word in done.out


def test_numbers_are_boxes(kahanmaps, study, tmp_path):
    done = kahanmaps("plot batch --db", study, "--by m --value c -o", tmp_path / "c.pdf")
    assert (done.status, (tmp_path / "c.pdf").read_bytes()[:4]) == (0, b"%PDF")
    assert "3 tasks have no result yet" in done.err


def test_one_number_against_another(kahanmaps, study):
    done = kahanmaps("plot batch", study, "--x eps --y c --by m")
    assert done.status == 0
    assert re.search(r"^ +m$", done.out, re.MULTILINE)
    assert "3 results have no eps or no number c: left out" in done.err


def test_numbers_beyond_doubles_are_told(kahanmaps, study):
    assert "1 numbers are beyond" not in kahanmaps("plot batch", study, "--x eps --y c").err
    assert "beyond the range of machine floats" in kahanmaps("plot batch", study, "--x eps --y far").err
    assert "far: 1 group with numbers beyond" in kahanmaps("plot batch", study, "--by m --value far").err


def test_an_empty_database_is_said_to_be_empty(kahanmaps, tmp_path):
    Store.open(tmp_path / "empty.db", create=True).close()
    for more in ("", "--x eps --y c", "--value c"):
        done = kahanmaps("plot batch", tmp_path / "empty.db", more)
        assert (done.status, done.out) == (2, "")
        assert "found no task in" in done.err


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        ("--by mm", "did you mean m?"),
        ("--value nosuch", "found the unknown name 'nosuch'"),
        ("--x eps", "give --x NAME and --y NAME"),
        ("--x eps --y c --value c", "found --x with --value"),
        ("--x eps --y c --by m,seed", "at most one name in --by"),
    ],
)
def test_wrong_use_is_refused(kahanmaps, study, more, expected):
    done = kahanmaps("plot batch", study, more)
    assert (done.status, done.out, expected in done.err) == (2, "", True)
