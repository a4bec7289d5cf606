"""One writer at a time, and no lock that outlives its holder."""

from __future__ import annotations

import os
import shutil
import signal
from itertools import product

import pytest
from small_databases import LIMITS, killed, ok, planned, seed, seeds, start, tasks

from kahanmaps.experiments import locks
from kahanmaps.experiments.database import StoreError, Unavailable
from kahanmaps.experiments.locks import Lock
from kahanmaps.experiments.store import Store


def test_a_second_writer_is_refused_and_told_who_the_first_is(path):
    script = """
with Store.open(path, create=True) as store:
    print("open", flush=True)
    time.sleep(60)
"""
    with start(script, path) as process:
        assert process.stdout is not None
        process.stdout.readline()
        who = rf"another batch is writing to .*results\.db \(process {process.pid} on .+ since 20\d\d-.*\): wait"
        with pytest.raises(StoreError, match=who):
            Store.open(path)
        with Store.open(path, readonly=True) as reader:
            assert reader.status() == []
            with pytest.raises(StoreError, match=who):
                reader._database.lock()
        process.kill()
    Store.open(path).close()


def test_a_second_writer_in_the_same_process_is_refused_and_does_not_break_the_lock(path, store):
    for _ in range(2):
        with pytest.raises(StoreError, match=f"another batch is writing .*process {os.getpid()}"):
            Store.open(path)


def test_two_names_of_one_file_have_one_lock(path, store):
    link = path.with_name("link.db")
    link.symlink_to(path)
    with pytest.raises(StoreError, match=r"another batch is writing to .*link\.db"):
        Store.open(link)


def test_two_that_make_the_same_file_do_not_make_it_twice(path, monkeypatch):
    take = Lock.take

    def outrun(lock):
        monkeypatch.setattr(Lock, "take", take)
        planned(path, 1)
        lock.take()

    monkeypatch.setattr(Lock, "take", outrun)
    with Store.open(path, create=True) as store:
        assert seeds(store.pending()) == [1]


def test_the_lock_file_is_gone_at_rest_and_what_a_killed_writer_left_of_it_does_no_harm(path):
    killed(path)
    lock = path.with_name("results.db.lock")
    assert "process" in lock.read_text()
    Store.open(path).close()
    assert not lock.exists()


def test_a_child_does_not_keep_the_lock_of_a_writer_that_was_killed(path):
    script = """
store = Store.open(path, create=True)
child = os.fork()
if child == 0:
    store.close()  # as a `with` would that the child leaves: it belongs to the parent
    os.write(1, b"child\\n")
    time.sleep(60)
    os._exit(0)
os.write(1, b"%d\\n" % child)  # in one piece, which print does not promise
time.sleep(60)
"""
    with start(script, path) as process:
        assert process.stdout is not None
        said = {process.stdout.readline().strip() for _ in range(2)}
        (child,) = map(int, said - {"child"})
        try:
            with pytest.raises(StoreError, match="another batch"):  # the child left the lock to its parent
                Store.open(path)
            process.kill()
            process.wait(10)
            Store.open(path).close()
        finally:
            os.kill(child, signal.SIGKILL)


def test_the_lock_lets_one_in_at_a_time_although_its_file_comes_and_goes(path):
    """Read, wait, write: two at a time would lose one of the counts."""
    script = """
from pathlib import Path
from kahanmaps.experiments.locks import Lock, LockedByAnother

count = path + ".count"
lock = Lock(Path(path + ".lock"))
mine = 0
while mine < 75:
    try:
        lock.take()
    except LockedByAnother:
        continue
    number = int(open(count).read())
    time.sleep(0.0001)
    with open(count, "w") as file:
        file.write(str(number + 1))
    lock.free()
    mine += 1
"""
    count = path.with_name("results.db.count")
    count.write_text("0")
    processes = [start(script, path) for _ in range(4)]
    for process in processes:
        with process:
            assert process.wait(60) == 0
    assert count.read_text() == "300"


# What has two names, or the name of something of ours


def test_a_database_with_two_names_is_refused_under_both_of_them(path):
    planned(path, 1)
    other = path.with_name("other.db")
    os.link(path, other)
    for name in (path, other):
        for readonly in (True, False):
            with pytest.raises(StoreError, match=rf"{name.name} has 2 names .*hard links.* copy of its own"):
                Store.open(name, readonly=readonly)
    with pytest.raises(StoreError, match="has 2 names"):
        Store.open(other, create=True)
    other.unlink()
    Store.open(path).close()


def test_a_second_name_that_a_file_gets_while_it_is_written_to_is_no_way_in(path, store):
    store.plan("a", "1", LIMITS, tasks(1, 2), {})
    os.link(path, path.with_name("other.db"))
    with pytest.raises(StoreError, match="has 2 names"):
        Store.open(path.with_name("other.db"))
    store.add([ok(1)])


def test_a_file_that_is_mounted_by_itself_is_refused(path, monkeypatch):
    planned(path, 1)
    mounts = path.with_name("mounts")
    mounts.write_text(f"/dev/sda1 / ext4 rw 0 0\n/dev/sda1 {path} ext4 rw 0 0\n")
    monkeypatch.setattr(locks, "_MOUNTS", mounts)
    with pytest.raises(StoreError, match=r"results\.db is mounted by itself.*mount its folder"):
        Store.open(path)
    mounts.write_text(f"/dev/sda1 / ext4 rw 0 0\n/dev/sda1 {path.parent} ext4 rw 0 0\n")
    Store.open(path).close()


NOT_OURS = {
    "a symbolic link": lambda name, precious: name.symlink_to(precious),
    "a hard link": lambda name, precious: os.link(precious, name),
    "a folder": lambda name, precious: name.mkdir(),
    "a pipe": lambda name, precious: os.mkfifo(name),
    "a link to nothing": lambda name, precious: name.symlink_to(precious.with_name("nothing")),
}


@pytest.mark.parametrize(
    ("kind", "end"),
    [
        *product(NOT_OURS, ("-wal", "-shm", "-journal", ".lock")),
        *product(["something else"], ("-wal", "-journal", ".lock")),
    ],
)
def test_what_lies_where_the_files_of_a_database_belong_is_left_alone(path, kind, end):
    planned(path, 1)
    precious = path.with_name("precious.txt")
    precious.write_text("process of much work\nsecond line\n")
    name = path.with_name(path.name + end)
    make = NOT_OURS.get(kind, lambda name, precious: shutil.copy(precious, name))
    make(name, precious)
    before = sorted(os.listdir(path.parent))
    with pytest.raises(StoreError, match=rf"results\.db{end} is not .*remove it or move it away"):
        Store.open(path)
    assert precious.read_text() == "process of much work\nsecond line\n"
    assert sorted(os.listdir(path.parent)) == before
    if end != ".lock":
        with pytest.raises(StoreError, match=rf"results\.db{end} is not .*remove it or move it away"):
            Store.open(path, readonly=True)


@pytest.mark.parametrize("end", ["-wal", "-journal"])
def test_what_lies_at_the_name_of_a_journal_before_there_is_a_database_is_left_alone(path, end):
    """SQLite takes it for one that was left behind, and removes it."""
    name = path.with_name(path.name + end)
    name.write_text("notes on much work\n")
    with pytest.raises(StoreError, match=rf"results\.db{end} is not a journal.*remove it or move it away"):
        Store.open(path, create=True)
    assert name.read_text() == "notes on much work\n"
    name.write_bytes(b"")  # what a killed writer leaves may be
    Store.open(path, create=True).close()


def test_a_lock_file_that_cannot_be_written_is_no_lock(path, monkeypatch):
    """A full disk may take some bytes of the line, and nobody could tell afterwards whose it is."""
    planned(path, 1)
    monkeypatch.setattr(os, "write", lambda descriptor, data, write=os.write: write(descriptor, data[:3]))
    with pytest.raises(Unavailable, match=r"results\.db\.lock.*No space left"):
        Store.open(path)
    assert os.listdir(path.parent) == [path.name]


def test_a_database_that_got_another_name_is_not_written_to_any_more(path):
    """Who writes to it by then does not see the journal of the first, which must not come over what they wrote."""
    script = """
with Store.open(path) as store:
    store.add([ok(number) for number in range(200)])
    print("added", flush=True)
    sys.stdin.readline()
    try:
        store.add([ok(1)])
    except Exception as error:
        print(error)
"""
    planned(path, *range(300))
    with start(script, path) as process:
        assert process.stdout is not None
        assert process.stdin is not None
        process.stdout.readline()
        moved = path.rename(path.with_name("moved.db"))
        with Store.open(moved) as other:
            other.add([ok(number, "1/3" * 100) for number in range(100, 300)])
            other._database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        assert "has been removed or replaced" in process.communicate("go on\n", timeout=60)[0]
    with Store.open(moved) as other:
        assert [seed(row.task) for row in other.rows()] == list(range(100, 300))
