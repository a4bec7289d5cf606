"""The file of a database: what is acknowledged is there after any kill, and readers hold nobody up.

Faults are real ones: processes killed with signal 9, pages overwritten, a file that may not grow, a folder that may not
be written to.
"""

from __future__ import annotations

import json
import os
import random
import signal
import sqlite3
import time
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from small_databases import LIMITS, killed, ok, output, planned, seed, seeds, small_chunks, start, tasks

from kahanmaps.errors import InputError, KahanmapsError
from kahanmaps.experiments import database
from kahanmaps.experiments.database import Database, StoreError, Unavailable
from kahanmaps.experiments.schema import APPLICATION_ID, FORMAT
from kahanmaps.experiments.store import Store

# Files that cannot be used


def test_errors_of_the_store_are_errors_of_input():
    assert issubclass(StoreError, InputError)


def test_what_the_machine_does_not_allow_is_no_error_of_input():
    assert not issubclass(Unavailable, InputError)
    assert issubclass(Unavailable, (KahanmapsError, OSError))


@pytest.mark.parametrize("readonly", [True, False])
def test_a_missing_file_is_not_made_unless_asked_for(path, readonly):
    with pytest.raises(StoreError, match=r"there is no database .*results\.db"):
        Store.open(path, readonly=readonly)
    assert os.listdir(path.parent) == []


def test_nothing_is_created_to_be_read(path):
    with pytest.raises(ValueError, match="cannot be created"):
        Store.open(path, create=True, readonly=True)


def test_a_missing_folder_is_named(path):
    with pytest.raises(StoreError, match="there is no folder"):
        Store.open(path.parent / "folder" / "r.db", create=True)


def test_a_name_that_is_too_long_is_an_error_in_a_sentence(path):
    with pytest.raises(StoreError, match="File name too long"):
        Store.open(path.parent / ("a" * 300), create=True)


@pytest.mark.parametrize("how", [{"create": True}, {}, {"readonly": True}])
def test_a_folder_is_refused(tmp_path, how):
    with pytest.raises(StoreError, match="is a folder"):
        Store.open(tmp_path, **how)


@pytest.mark.parametrize("how", [{"create": True}, {}, {"readonly": True}])
@pytest.mark.parametrize("content", [b"a", b"experiments:\n" * 1000, bytes(5000), b"SQLite format 3\0" + bytes(5000)])
def test_a_file_that_is_not_sqlite_is_refused_and_left_alone(path, content, how):
    path.write_bytes(content)
    with pytest.raises(StoreError, match="is not an SQLite database"):
        Store.open(path, **how)
    assert (path.read_bytes(), os.listdir(path.parent)) == (content, [path.name])


@pytest.mark.parametrize("how", [{"create": True}, {}, {"readonly": True}])
def test_a_database_of_another_program_is_refused_and_left_alone(path, how):
    with closing(sqlite3.connect(path)) as other:
        other.execute("CREATE TABLE task (name)")
    content = path.read_bytes()
    with pytest.raises(StoreError, match="of another program"):
        Store.open(path, **how)
    assert (path.read_bytes(), os.listdir(path.parent)) == (content, [path.name])


@pytest.mark.parametrize("how", [{"create": True}, {}, {"readonly": True}])
def test_another_format_is_refused_with_both_numbers(path, how):
    planned(path, 1)
    with closing(sqlite3.connect(path)) as other:
        other.execute(f"PRAGMA user_version = {FORMAT + 1}")
    with pytest.raises(StoreError, match="by format 3 of kahanmaps databases, this version reads formats 1 to 2"):
        Store.open(path, **how)


def test_the_file_says_whose_it_is_and_of_which_format(path):
    planned(path, 1)
    with closing(sqlite3.connect(path)) as other:
        assert other.execute("PRAGMA application_id").fetchone() == (APPLICATION_ID,)
        assert other.execute("PRAGMA user_version").fetchone() == (FORMAT,)


def test_an_empty_file_is_used_only_to_create(path):
    path.touch()
    for readonly in (True, False):
        with pytest.raises(StoreError, match="is empty"):
            Store.open(path, readonly=readonly)
    planned(path, 1)
    with Store.open(path, readonly=True) as store:
        assert seeds(store.pending()) == [1]


def overwrite_the_middle(path: Path) -> None:
    size = path.stat().st_size
    with path.open("r+b") as file:
        file.seek(size // 4)
        file.write(b"\xa5" * (size // 2))


def test_a_damaged_database_is_refused_for_writing(path):
    planned(path, *range(2000))
    overwrite_the_middle(path)
    with pytest.raises(StoreError, match=r"is damaged .*take a copy from before"):
        Store.open(path)


def test_damage_met_while_reading_is_told_in_a_sentence(path):
    planned(path, *range(2000))
    overwrite_the_middle(path)
    with pytest.raises(StoreError, match="is damaged"):
        Store.open(path, readonly=True)
    with Store.open(path, readonly=True, is_checked=False) as store, pytest.raises(StoreError, match="is damaged"):
        list(store.rows(missing=True))


def test_a_text_that_is_no_longer_that_of_its_key_is_damage_too(path):
    planned(path, 1)
    with closing(sqlite3.connect(path)) as other, other:
        other.execute("UPDATE task SET text = substr(text, 3)")
    with Store.open(path) as store, pytest.raises(StoreError, match=r"is damaged \(the task .*text of its key"):
        list(store.pending())


def test_a_store_that_is_closed_says_so(path):
    store = Store.open(path, create=True)
    store.close()
    store.close()
    with pytest.raises(StoreError, match="has been closed"):
        store.status()
    with pytest.raises(StoreError, match="has been closed"):
        store.plan("a", "1", LIMITS, [], {})


def test_a_store_opened_to_be_read_refuses_to_write(path):
    planned(path, 1)
    with Store.open(path, readonly=True) as store:
        for write in (
            lambda: store.add([ok(1)]),
            lambda: store.plan("b", "1", LIMITS, [], {}),
            lambda: store.merge(path),
        ):
            with pytest.raises(StoreError, match="opened for reading only"):
                write()
        # Not even by a mistake of ours.
        with pytest.raises(sqlite3.OperationalError, match="readonly"):
            store._database.execute("DELETE FROM plan")


# A full disk


def test_a_full_disk_is_told_in_a_sentence_and_loses_nothing(store):
    store.plan("a", "1", LIMITS, tasks(*range(500)), {})
    pages = store._database.execute("PRAGMA page_count").fetchone()[0]
    store._database.execute(f"PRAGMA max_page_count = {pages + 3}")
    stored = []

    def add_all():
        for number in range(500):
            store.add([ok(number, "1/3" * 1000)])
            stored.append(number)

    with pytest.raises(Unavailable, match="disk is full; what was stored before is safe"):
        add_all()
    assert stored
    assert [seed(row.task) for row in store.rows()] == stored
    with pytest.raises(Unavailable, match="disk is full"):
        store.plan("a", "2", LIMITS, tasks(*range(500, 9000)), {})
    store._database.execute("PRAGMA max_page_count = 1000000")
    store.add([ok(number) for number in range(500)])
    assert store.count_pending() == 0


@pytest.mark.parametrize("journal", ["wal", "delete"])
def test_a_file_that_may_not_grow_is_told_in_a_sentence_and_loses_nothing(path, journal):
    script = """
database.journal_for = lambda path: arguments[0]
stored = []
with Store.open(path) as store:
    size = max(os.path.getsize(path + end) for end in ("", "-wal") if os.path.exists(path + end))
    _, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size + 100_000, hard))
    try:
        for number in range(400):
            store.add([ok(number, "1/3" * 1000)])
            stored.append(number)
    except Unavailable as error:
        message = str(error)
    resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
    store.add([ok(499)])
print(json.dumps([stored, message]))
"""
    planned(path, *range(500))
    stored, message = json.loads(output(script, path, journal))
    assert "disk" in message
    assert "what was stored before is safe" in message
    assert stored
    with Store.open(path) as store:
        assert [seed(row.task) for row in store.rows()] == [*stored, 499]


# Kills


def check_pages(path: Path) -> None:
    with closing(sqlite3.connect(path)) as other:
        assert other.execute("PRAGMA integrity_check").fetchall() == [("ok",)]


@pytest.mark.parametrize("journal", ["wal", "delete"])
def test_what_was_acknowledged_is_there_after_a_kill_at_any_moment(path, journal):
    script = """
database.journal_for = lambda path: arguments[0]
with Store.open(path) as store:
    for job in store.pending():
        store.add([Record(job.task.key, Outcome.OK, {"value": "1/3" * 300})])
        print(job.task.key, flush=True)
"""
    planned(path, *range(10_000))
    acknowledged: set[str] = set()
    for _ in range(3):
        with start(script, path, journal) as process:
            assert process.stdout is not None
            acknowledged.add(process.stdout.readline().strip())
            time.sleep(random.uniform(0, 0.15))
            process.kill()
            lines = process.stdout.read().split("\n")
        acknowledged.update(lines[:-1])  # after the last line break there may be half a key
        assert process.returncode == -signal.SIGKILL
        with Store.open(path, readonly=True) as store:
            assert acknowledged <= {row.record.key for row in store.rows() if row.record}
        with Store.open(path) as store:  # and the lock is free
            # At most the one result for which the process was killed before it could say so, for each kill.
            assert 0 <= 10_000 - store.count_pending() - len(acknowledged) <= 4
        check_pages(path)
    assert len(acknowledged) > 8


@pytest.mark.parametrize("journal", ["wal", "delete"])
def test_a_kill_while_a_plan_is_replaced_leaves_the_old_one(path, journal):
    script = """
database.journal_for = lambda path: arguments[0]

def made():
    for number in range(10_000_000):
        if number == 20_000:
            print("half", flush=True)
        yield task(number)

with Store.open(path) as store:
    # So little memory that pages of what is not committed go to the disk.
    database._LARGE_CACHE = 100
    store.plan("a", "another", Limits(), made(), {})
"""
    planned(path, 1, 2, 3, records=[ok(2)])
    with start(script, path, journal) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "half\n"
        process.kill()
    with Store.open(path) as store:
        assert seeds(store.pending()) == [1, 3]
        assert [seed(row.task) for row in store.rows()] == [2]
        assert store.status()[0].total == 3
    check_pages(path)


def test_a_kill_while_the_file_is_made_leaves_one_that_can_be_made_again(path):
    script = """
database.SCHEMA = database.SCHEMA.replace("CREATE INDEX", "SELECT kill(); CREATE INDEX", 1)
connect = database.sqlite3.connect

def deadly(*positional, **named):
    connection = connect(*positional, **named)
    connection.create_function("kill", 0, lambda: os.kill(os.getpid(), 9))
    return connection

database.sqlite3.connect = deadly
Store.open(path, create=True)
"""
    with start(script, path) as process:
        assert process.wait(60) == -signal.SIGKILL
    assert path.exists()
    planned(path, 1)


# Journals and readers


@pytest.mark.parametrize(("journal", "synchronous"), [("wal", 1), ("delete", 2)])
def test_the_journal_is_as_chosen_and_one_file_is_left_at_rest(path, monkeypatch, journal, synchronous):
    monkeypatch.setattr(database, "journal_for", lambda path: journal)
    with Store.open(path, create=True) as store:
        assert store._database.execute("PRAGMA journal_mode").fetchone() == (journal,)
        assert store._database.execute("PRAGMA synchronous").fetchone() == (synchronous,)
        store.plan("a", "1", LIMITS, tasks(1), {})
        assert path.with_name("results.db-wal").exists() == (journal == "wal")
    assert os.listdir(path.parent) == [path.name]
    with closing(sqlite3.connect(path)) as other:
        assert other.execute("PRAGMA journal_mode").fetchone() == ("delete",)


def test_what_a_killed_writer_left_can_be_read(path):
    killed(path)
    with Store.open(path, readonly=True) as store:
        assert seeds(store.pending()) == [2]


def test_a_reader_at_the_end_of_a_batch_delays_nothing_and_loses_nothing(path):
    planned(path, 1, 2)
    with Store.open(path) as writer:
        reader = Store.open(path, readonly=True)
        assert reader.count_pending() == 2
        writer.add([ok(1)])
        begun = time.perf_counter()
    assert time.perf_counter() - begun < 5  # not the 30 s for which a lock is waited for
    with reader:
        assert reader.count_pending() == 1
    with Store.open(path) as store:
        assert seeds(store.pending()) == [2]
    assert os.listdir(path.parent) == [path.name]


@pytest.mark.parametrize("journal", ["wal", "delete"])
def test_a_reader_in_the_middle_of_a_read_does_not_hold_the_writer_up(path, monkeypatch, journal):
    monkeypatch.setattr(database, "_BUSY_SECONDS", 0.0)  # whoever has to wait fails
    monkeypatch.setattr(database, "journal_for", lambda path: journal)
    planned(path, *range(20), records=[ok(number) for number in range(10)])
    with small_chunks(), Store.open(path) as writer, Store.open(path, readonly=True) as reader:
        reads = [reader.rows(), reader.rows(missing=True), reader.pending()]
        for read in reads:
            next(read)
        writer.add([ok(number) for number in range(10, 20)])
        if journal == "wal":
            # All of the journal can be tidied: no reader is left in an old state.
            busy, *_ = writer._database.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()
            assert busy == 0
        assert [sum(1 for _ in read) for read in reads] == [19, 19, 1]  # the rest of the chunk read before


# Folders and files that may not be written to


@pytest.fixture
def public():
    """A folder that every user can reach: those of pytest are closed to others."""
    with TemporaryDirectory() as folder:
        os.chmod(folder, 0o755)
        yield Path(folder)
        os.chmod(folder, 0o755)


def tried(path: Path, how: str) -> str:
    """What comes of opening as a user who owns nothing, to whom permissions apply: they do not for root."""
    script = """
if os.geteuid() == 0:
    try:
        os.setgroups([])
        os.setgid(65534)
        os.setuid(65534)
    except OSError:
        print("skip")
        sys.exit()
try:
    with Store.open(path, **json.loads(arguments[0])) as store:
        print([job.task.system["family"]["seed"] for job in store.pending()])
except StoreError as error:
    print(error)
"""
    text = output(script, path, how).strip()
    if text == "skip":
        pytest.skip("root without the right to become another user")
    return text


def test_a_database_at_rest_is_read_where_nothing_may_be_written(public):
    planned(public / "results.db", 1, 2)
    (public / "results.db").chmod(0o444)
    public.chmod(0o555)
    assert tried(public / "results.db", '{"readonly": true}') == "[1, 2]"


def test_a_folder_that_may_not_be_written_to_is_named(public):
    planned(public / "results.db", 1, 2).chmod(0o666)
    public.chmod(0o555)
    assert f"the folder {public} may not be written to" in tried(public / "results.db", "{}")
    assert f"the folder {public} may not be written to" in tried(public / "new.db", '{"create": true}')


def test_a_file_that_may_not_be_written_to_or_read_is_named(public):
    planned(public / "results.db", 1, 2).chmod(0o444)
    public.chmod(0o777)
    assert "results.db may not be written to" in tried(public / "results.db", "{}")
    (public / "results.db").chmod(0o000)
    assert "results.db may not be read" in tried(public / "results.db", '{"readonly": true}')
    public.chmod(0o000)
    assert "Permission denied" in tried(public / "results.db", '{"readonly": true}')


def test_what_a_killed_writer_left_is_read_where_something_may_be_written(public):
    killed(public / "results.db")
    for name in os.listdir(public):
        (public / name).chmod(0o666)
    public.chmod(0o777)
    assert tried(public / "results.db", '{"readonly": true}') == "[2]"


def test_what_a_killed_writer_left_where_nothing_may_be_written_is_read_or_explained(public):
    killed(public / "results.db")
    public.chmod(0o555)
    # The index of the journal is there, and can be read.
    assert tried(public / "results.db", '{"readonly": true}') == "[2]"
    public.chmod(0o755)
    (public / "results.db-shm").unlink()
    public.chmod(0o555)
    assert "if its writer was killed" in tried(public / "results.db", '{"readonly": true}')


def test_a_rollback_journal_that_a_killed_writer_left_where_nothing_may_be_written_is_explained(public):
    script = """
database.journal_for = lambda path: "delete"
database._LARGE_CACHE = 100

def made():
    for number in range(10_000_000):
        if number == 20_000:
            os.kill(os.getpid(), 9)
        yield task(number)

Store.open(path).plan("a", "another", Limits(), made(), {})
"""
    planned(public / "results.db", 1, 2)
    with start(script, public / "results.db") as process:
        assert process.wait(60) == -signal.SIGKILL
    public.chmod(0o555)
    assert "if its writer was killed" in tried(public / "results.db", '{"readonly": true}')
    public.chmod(0o755)
    with Store.open(public / "results.db", readonly=True) as store:  # for the owner it is played back
        assert seeds(store.pending()) == [1, 2]


def test_a_database_marked_as_wal_without_a_journal_is_read_where_nothing_may_be_written(public):
    planned(public / "results.db", 1, 2)
    with closing(sqlite3.connect(public / "results.db")) as other:
        other.execute("PRAGMA journal_mode = WAL")
    assert os.listdir(public) == ["results.db"]
    public.chmod(0o555)
    assert tried(public / "results.db", '{"readonly": true}') == "[1, 2]"


def test_a_name_in_the_schema_that_is_not_utf_8_is_damage_too(path):
    planned(path, 1)
    path.write_bytes(path.read_bytes().replace(b"peak_memory INTEGER", b"peak_\xdd\xffmory INTEGER", 1))
    with pytest.raises(StoreError, match="is damaged"), Store.open(path, readonly=True) as store:
        list(store.rows(missing=True))


def test_pages_that_lead_back_do_not_make_a_merge_endless(path, tmp_path, monkeypatch):
    planned(path, 1, 2, 3, records=[ok(1), ok(2), ok(3)])
    fetch = Database.fetch

    def in_circles(self, sql, values=(), **how):
        found = fetch(self, sql, values, **how)
        return list(reversed(found)) if "FROM result AS r JOIN task" in sql else found

    monkeypatch.setattr(Database, "fetch", in_circles)
    with Store.open(tmp_path / "all.db", create=True) as store, pytest.raises(StoreError, match="more than 3"):
        store.merge(path)
