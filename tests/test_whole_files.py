"""Files are written whole or not at all: beside their place, and put there when they are complete."""

from __future__ import annotations

import errno
import os
import stat

import pytest

from kahanmaps import whole_files
from kahanmaps.whole_files import write_whole


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
