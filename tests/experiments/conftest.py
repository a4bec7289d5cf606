"""Fixtures that several files of tests share."""

from pathlib import Path

import pytest
from specs import ROTOR

from kahanmaps.experiments.results.store import Store


@pytest.fixture
def path(tmp_path) -> Path:
    return tmp_path / "results.db"


@pytest.fixture
def store(path):
    with Store.open(path, create=True) as store:
        yield store


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with system files in it."""
    (tmp_path / "members").mkdir()
    (tmp_path / "rotor.toml").write_text(ROTOR)
    (tmp_path / "members" / "one.toml").write_text(ROTOR.replace("2", "3"))
    (tmp_path / "members" / "two.toml").write_text(ROTOR.replace("2", "4"))
    (tmp_path / "members" / "notes.txt").write_text("no system")
    (tmp_path / "wrong.toml").write_text('variables = ["x"]\n[system]\nrhs = ["x^3"]\n')
    return tmp_path


@pytest.fixture(scope="module")
def fault_tasks():
    """The tasks of fault_tasks.py, here and in children, where sets have one order whatever is asked for here."""
    here = str(Path(__file__).parent)
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.syspath_prepend(here)
        monkeypatch.setenv("KAHANMAPS_TASKS", "fault_tasks")
        monkeypatch.setenv("PYTHONPATH", here)
        monkeypatch.setenv("PYTHONHASHSEED", "123")
        yield
