"""The file of a database: what is acknowledged is there after any kill, one process writes, and readers hold nobody up.

Faults are real ones: processes killed with signal 9, a disk that is full, bytes overwritten.
"""

import os
import random
import signal
import sqlite3
import time
from contextlib import closing
from pathlib import Path

import pytest
from helpers import refuses
from small_databases import LIMITS, ok, planned, seed, seeds, small_chunks, start, tasks

from kahanmaps.experiments.results import store as store_module
from kahanmaps.experiments.results.store import Store, StoreError, Unavailable


def test_a_missing_file_is_not_made_unless_asked_for(path):
    for readonly in (True, False):
        refuses(r"there is no database .*results\.db", Store.open, path, readonly=readonly, error=StoreError)
    refuses("cannot be created", Store.open, path, create=True, readonly=True, error=ValueError)
    assert os.listdir(path.parent) == []


def of_another_program(path: Path) -> None:
    with closing(sqlite3.connect(path)) as other, other:
        other.execute("CREATE TABLE result (task TEXT)")


def of_another_format(path: Path) -> None:
    planned(path, 1)
    with closing(sqlite3.connect(path)) as other:
        other.execute("PRAGMA user_version = 99")


def damaged(path: Path) -> None:
    planned(path, *range(200))
    content = bytearray(path.read_bytes())
    content[100:4000] = b"\xa5" * 3900
    path.write_bytes(content)


WRONG = [
    (Path.mkdir, "is a folder or a device"),
    (lambda path: path.write_bytes(b"x"), "is not an SQLite database"),  # which SQLite takes for an empty one
    (lambda path: path.write_text("text" * 1000), "is not an SQLite database"),
    (of_another_program, "of another program"),
    (of_another_format, "written by format 99 .* reads formats 1 and 2"),
    (damaged, "is damaged"),
]


@pytest.mark.parametrize(("make", "message"), WRONG)
def test_what_is_no_database_of_results_is_refused_and_left_alone(path, make, message):
    make(path)
    before = path.read_bytes() if path.is_file() else None
    for how in ({"readonly": True}, {}, {"create": True}):
        with pytest.raises(StoreError, match=message):
            Store.open(path, **how).status()
    assert before is None or path.read_bytes() == before
    assert os.listdir(path.parent) == [path.name]


def test_a_store_that_is_closed_or_opened_to_be_read_refuses_to_write(path):
    planned(path, 1)
    with Store.open(path, readonly=True) as store:
        for write in (lambda: store.add([ok(1)]), lambda: store.plan("b", "1", LIMITS, [], {})):
            refuses("opened for reading only", write, error=StoreError)
        with pytest.raises(sqlite3.OperationalError, match="readonly"):  # not even by a mistake of ours
            store._execute("DELETE FROM plan")
    refuses("has been closed", store.status, error=StoreError)


def test_a_full_disk_is_reported_in_a_sentence_and_loses_nothing(store):
    store.plan("a", "1", LIMITS, tasks(*range(500)), {})
    (pages,) = store._execute("PRAGMA page_count").fetchone()
    store._execute(f"PRAGMA max_page_count = {pages + 3}")
    stored = []
    with pytest.raises(Unavailable, match="disk is full; what was stored before is safe"):  # noqa: PT012
        for number in range(500):
            store.add([ok(number, "1/3" * 1000)])
            stored.append(number)
    assert stored
    assert [seed(row.task) for row in store.rows()] == stored
    store._execute("PRAGMA max_page_count = 1000000")
    store.add([ok(number) for number in range(500)])
    assert store.count_pending() == 0


def test_what_was_acknowledged_is_there_after_a_kill_at_any_moment(path):
    script = """
with Store.open(path) as store:
    for job in store.pending():
        store.add([Record(job.task.key, Outcome.OK, {"value": "1/3" * 300})])
        print(job.task.key, flush=True)
"""
    planned(path, *range(10_000))
    acknowledged: set[str] = set()
    with start(script, path) as process:
        acknowledged.add(process.stdout.readline().strip())
        time.sleep(random.uniform(0, 0.15))
        process.kill()
        lines = process.stdout.read().split("\n")
    acknowledged.update(lines[:-1])  # after the last line break there may be half a key
    assert process.returncode == -signal.SIGKILL
    with Store.open(path, readonly=True) as store:
        assert acknowledged <= {row.record.key for row in store.rows() if row.record}
    with Store.open(path) as store:  # and the lock is free
        # At most the one result for which the process was killed before it could say so.
        assert 0 <= 10_000 - store.count_pending() - len(acknowledged) <= 1
    assert acknowledged


def test_a_kill_while_a_plan_is_replaced_leaves_the_old_one(path):
    script = """
def made():
    for number in range(10_000_000):
        if number == 20_000:
            os.kill(os.getpid(), 9)
        yield task(number)

store_module._CACHE_KIB = 100  # so little memory that pages of what is not committed go to the disk
Store.open(path).plan("a", "another", TaskLimits(), made(), {})
"""
    planned(path, 1, 2, 3, records=[ok(2)])
    with start(script, path) as process:
        assert process.wait(60) == -signal.SIGKILL
    assert path.with_name("results.db-journal").stat().st_size > 0
    with Store.open(path, readonly=True) as store:  # which plays it back
        assert seeds(store.pending()) == [1, 3]
        assert [seed(row.task) for row in store.rows()] == [2]


def test_one_process_writes_at_a_time_and_its_lock_is_gone_at_rest(path):
    script = "store = Store.open(path); print('open', flush=True); sys.stdin.read()"
    planned(path, 1)
    link = path.with_name("other.db")
    link.symlink_to(path)
    with start(script, path) as process:
        assert process.stdout.readline() == "open\n"
        for name in (path, link):
            refuses("another batch is writing to", Store.open, name, error=StoreError)
        process.kill()
    with Store.open(link) as store:
        store.add([ok(1)])
        refuses("another batch", Store.open, path, error=StoreError)
    assert sorted(os.listdir(path.parent)) == [link.name, path.name]


def test_a_reader_in_the_middle_of_a_read_does_not_hold_the_writer_up(path, monkeypatch):
    monkeypatch.setattr(store_module, "_BUSY_SECONDS", 0.0)  # whoever has to wait fails
    planned(path, *range(20), records=[ok(number) for number in range(10)])
    with small_chunks(), Store.open(path) as writer, Store.open(path, readonly=True) as reader:
        reads = [reader.rows(), reader.rows(missing=True), reader.pending()]
        for read in reads:
            next(read)
        writer.add([ok(number) for number in range(10, 20)])
        assert [sum(1 for _ in read) for read in reads] == [19, 19, 1]  # the rest of the chunk read before


def test_a_database_is_read_where_nothing_may_be_written(path, monkeypatch):
    planned(path, 1, 2)
    monkeypatch.setattr("os.access", lambda _, mode: mode != os.W_OK)  # who runs the tests may be root
    with Store.open(path, readonly=True) as store:
        assert seeds(store.pending()) == [1, 2]
    refuses("may not be written to", Store.open, path, error=StoreError)
