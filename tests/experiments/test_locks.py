"""One writer at a time, and no lock that outlives its holder."""

from __future__ import annotations

import os
import signal

import pytest
from small_databases import killed, planned, seeds, start

from kahanmaps.experiments.locks import Lock
from kahanmaps.experiments.store import Store, StoreError


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
                reader.lock()
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
