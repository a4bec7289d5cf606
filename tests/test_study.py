"""The study of examples/members: its spec is sound, its committed results are those of all tasks, its script runs."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import kahanmaps as km

STUDY = Path(__file__).parent.parent / "examples" / "members"


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of the first members."""
    text = (STUDY / "study.toml").read_text()
    text, count = re.subn(r'"0\.\.\d+"', '"0..0"', text)
    assert count == 5
    db = tmp_path_factory.mktemp("study") / "study.db"
    records = list(km.run(text, db))
    assert {record.outcome for record in records} == {"ok"}
    return db


@pytest.mark.slow
def test_what_was_learned_comes_out_of_the_first_members_too(small: Path):
    done = subprocess.run([sys.executable, STUDY / "learned.py", small], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    assert lines[:3] == [f"m = {m}: dimension {4 * m} of the space of cubics, for 2 of 2 members" for m in (2, 3, 4)]
    committed = (STUDY / "learned.out").read_text().splitlines()
    kinds = [re.sub(r"[-\d.e]+", "#", line) for line in lines if not line.startswith(" ")]
    assert kinds[3:5] == [re.sub(r"[-\d.e]+", "#", line) for line in committed if not line.startswith(" ")][3:5]


@pytest.mark.slow
def test_the_dimension_is_4m_for_every_member(small: Path):
    with km.Store.open(small, readonly=True) as store:
        for row in store.rows(["space"]):
            assert row.record is not None
            assert row.record.result is not None
            assert row.record.result["dimension"] == 4 * row.task.value("m")
