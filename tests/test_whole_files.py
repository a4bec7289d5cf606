"""Files are written whole or not at all: beside their place, and put there when they are complete."""

import errno
import os
import stat
from pathlib import Path

import pytest

from kahanmaps import atomic_files
from kahanmaps.atomic_files import atomic_write, write_atomically


def interrupted(*_):
    raise KeyboardInterrupt


@pytest.mark.parametrize("where", ["before the end", "at the end"])
def test_a_file_is_written_whole_or_not_at_all(tmp_path, monkeypatch, where):
    target = tmp_path / "x.svg"
    target.write_bytes(b"before")
    if where == "at the end":
        monkeypatch.setattr(atomic_files.os, "replace", interrupted)
    fail = interrupted if where == "before the end" else len
    with pytest.raises(KeyboardInterrupt), atomic_write(target) as stream:
        fail(b"half of it" * stream.write(b"half of it"))
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"before"]


@pytest.mark.parametrize(
    ("name", "number"), [("loop", errno.ELOOP), ("missing/x", errno.ENOENT), ("a\0b", errno.EINVAL)]
)
def test_a_file_that_cannot_be_written_is_named_as_it_was_asked_for(tmp_path, name, number):
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(OSError, match=r"Errno") as caught:
        write_atomically(f"{tmp_path}/{name}", b"")
    assert (caught.value.errno, caught.value.filename) == (number, f"{tmp_path}/{name}")
    assert (tmp_path / "loop").is_symlink()


def test_a_new_file_has_the_permissions_of_the_user_and_a_replaced_one_keeps_its_own(tmp_path):
    before = os.umask(0o027)
    try:
        write_atomically(tmp_path / "new", b"")
    finally:
        os.umask(before)
    (tmp_path / "old").write_bytes(b"")
    (tmp_path / "old").chmod(0o600)
    write_atomically(tmp_path / "old", b"new")
    assert [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("new", "old")] == [0o640, 0o600]


def test_a_file_is_on_the_disk_before_it_has_its_name_and_its_name_before_the_end(tmp_path, monkeypatch):
    done: list[str] = []

    def noted(name, path_of):
        real = getattr(os, name)

        def call(*arguments):
            done.append(f"{name} {path_of(arguments[0])}")
            return real(*arguments)

        monkeypatch.setattr(atomic_files.os, name, call)

    noted("fsync", lambda descriptor: "folder" if stat.S_ISDIR(os.fstat(descriptor).st_mode) else "file")
    noted("replace", lambda path: "file" if Path(path).read_bytes() == b"new" else "a part of it")
    write_atomically(tmp_path / "x", b"new")
    assert done == ["fsync file", "replace file", "fsync folder"]


def test_a_pipe_gets_everything_at_the_end_and_stays_a_pipe(tmp_path):
    os.mkfifo(tmp_path / "p")
    reader = os.open(tmp_path / "p", os.O_RDONLY | os.O_NONBLOCK)
    write_atomically(tmp_path / "p", b"new")
    result = os.read(reader, 100)
    os.close(reader)
    assert (result, (tmp_path / "p").is_fifo(), list(tmp_path.iterdir())) == (b"new", True, [tmp_path / "p"])
