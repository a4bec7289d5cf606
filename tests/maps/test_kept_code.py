"""What numba keeps on disk may be damaged, stale or impossible to write: the numbers are the same, and nothing ends."""

from __future__ import annotations

import importlib.util
import resource
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

numba = pytest.importorskip("numba")

from kahanmaps.maps.kept_code import compiled  # noqa: E402

SOURCE = "def add(a, b):\n    return a + b\n"


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Compute 2 + 3 by a function that nobody has compiled before; whether its machine code came from the disk."""
    source = tmp_path / "adding.py"
    source.write_text(SOURCE)

    def run(cache="cache"):
        monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / cache))
        monkeypatch.setattr(sys, "dont_write_bytecode", True)  # Python 3.11.2 believes what a full disk has cut off
        spec = importlib.util.spec_from_file_location("adding", source)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        add = compiled(module.add, nogil=True)
        assert add(2, 3) == 5
        return sum(add.stats.cache_hits.values()) == 1

    return run


@contextmanager
def full_disk():
    """No file may grow beyond a hundred bytes."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def kept(folder: Path) -> list[Path]:
    """The files of the cache."""
    return sorted(path for path in (folder / "cache").rglob("*.nb?"))


def cut(path):
    path.write_bytes(path.read_bytes()[:-40])


def empty(path):
    path.write_bytes(b"")


def flip(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    path.write_bytes(content)


def folder(path):
    path.unlink()
    path.mkdir()


def test_machine_code_comes_from_the_disk_the_second_time(run):
    assert [run(), run()] == [False, True]


@pytest.mark.parametrize("damage", [cut, empty, flip, folder])
def test_damaged_machine_code_is_compiled_anew_and_replaced(run, tmp_path, damage):
    run()
    files = kept(tmp_path)
    assert [path.suffix for path in files] == [".nbc", ".nbi"]
    for path in files:
        damage(path)
        assert not run()
        assert run() == (damage is not folder)  # nothing can take the place of a folder
        if damage is folder:
            path.rmdir()


def test_machine_code_of_another_source_is_not_run(run, tmp_path):
    """As numba leaves it that is killed between its two files: a new index, and the code of yesterday."""
    run()
    code = kept(tmp_path)[0]
    of_yesterday = code.read_bytes()
    (tmp_path / "adding.py").write_text(SOURCE + "# changed\n")
    run()
    code.write_bytes(of_yesterday)
    assert not run()


def test_a_disk_that_takes_nothing_is_done_without(run, tmp_path):
    with full_disk():
        assert [run(), run()] == [False, False]
    assert kept(tmp_path) == []


def test_a_file_in_the_place_of_the_folder_is_done_without(run, tmp_path):
    (tmp_path / "taken").write_text("")
    assert not run(cache="taken/cache")
