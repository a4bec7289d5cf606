"""Files are written whole or not at all: beside their place, and put there when they are complete."""

import errno
import os
import stat
from pathlib import Path

import pytest

from kahanmaps import whole_files
from kahanmaps.whole_files import whole_file, write_whole


def test_a_file_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    target = tmp_path / "x.svg"
    target.write_bytes(b"before")
    monkeypatch.setattr(whole_files.os, "replace", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        write_whole(target, b"after")
    assert target.read_bytes() == b"before"
    assert list(tmp_path.iterdir()) == [target]


def test_symbolic_links_in_a_circle_are_told_and_stay(tmp_path):
    loop = tmp_path / "loop.svg"
    loop.symlink_to(loop.name)
    with pytest.raises(OSError, match="symbolic links") as caught:
        write_whole(loop, b"")
    assert (caught.value.errno, caught.value.filename) == (errno.ELOOP, str(loop))
    assert loop.is_symlink()


def test_a_name_that_no_file_can_have_is_told():
    with pytest.raises(OSError, match="Invalid argument") as caught:
        write_whole("a\0b", b"")
    assert (caught.value.errno, caught.value.filename) == (errno.EINVAL, "a\0b")


def test_a_symbolic_link_is_written_through(tmp_path):
    (tmp_path / "there").mkdir()
    link = tmp_path / "link.svg"
    link.symlink_to("there/x.svg")
    write_whole(link, b"x")
    assert (link.is_symlink(), (tmp_path / "there" / "x.svg").read_bytes()) == (True, b"x")


def test_a_new_file_has_the_permissions_of_the_user(tmp_path):
    before = os.umask(0o027)
    try:
        write_whole(tmp_path / "x", b"")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "x").stat().st_mode) == 0o640


def test_a_file_that_is_replaced_keeps_its_permissions(tmp_path):
    (tmp_path / "x").write_bytes(b"")
    (tmp_path / "x").chmod(0o600)
    write_whole(tmp_path / "x", b"new")
    assert stat.S_IMODE((tmp_path / "x").stat().st_mode) == 0o600


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "target")
    write_whole(tmp_path / "link", b"new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "target").read_bytes() == b"new"


def test_a_file_that_cannot_be_written_is_named_as_it_was_asked_for(tmp_path):
    wanted = tmp_path / "missing" / "x"
    with pytest.raises(FileNotFoundError) as error:
        write_whole(wanted, b"")
    assert error.value.filename == str(wanted)


def test_a_file_is_on_the_disk_before_it_has_its_name_and_its_name_before_the_end(tmp_path, monkeypatch):
    done: list[str] = []

    def noted(name, path_of):
        real = getattr(os, name)

        def call(*arguments):
            done.append(f"{name} {path_of(arguments[0])}")
            return real(*arguments)

        monkeypatch.setattr(whole_files.os, name, call)

    noted("fsync", lambda descriptor: "folder" if stat.S_ISDIR(os.fstat(descriptor).st_mode) else "file")
    noted("replace", lambda path: "file" if Path(path).read_bytes() == b"new" else "a part of it")
    write_whole(tmp_path / "x", b"new")
    assert done == ["fsync file", "replace file", "fsync folder"]


def test_what_fails_within_leaves_the_old_file_alone(tmp_path):
    (tmp_path / "x").write_bytes(b"before")

    def fail():
        with whole_file(tmp_path / "x") as stream:
            stream.write(b"half of it")
            raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OSError, match="No space") as caught:
        fail()
    assert caught.value.filename == str(tmp_path / "x")
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"before"]


def test_a_pipe_gets_everything_at_the_end_and_stays_a_pipe(tmp_path):
    os.mkfifo(tmp_path / "p")
    reader = os.open(tmp_path / "p", os.O_RDONLY | os.O_NONBLOCK)
    with whole_file(tmp_path / "p") as stream:
        stream.write(b"new")
    found = os.read(reader, 100)
    os.close(reader)
    assert (found, (tmp_path / "p").is_fifo(), list(tmp_path.iterdir())) == (b"new", True, [tmp_path / "p"])
