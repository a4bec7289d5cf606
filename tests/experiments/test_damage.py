"""A byte or a cell of a database changed by an accident: what is read is what was written, or a sentence says what not.

SQLite keeps anything in any column, so each kind of value is put into each cell of a small database, and everything
that reads one is asked; and bytes are changed at random. The sentence names the file and says what to do; nothing ends
in another exception, nothing goes round for ever, and no number changes without a word.
"""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from helpers import quick
from small_databases import LIMITS, MEMORY, failed, ok, planned, task, tasks

from kahanmaps.experiments import tables
from kahanmaps.experiments.database import Damaged, StoreError
from kahanmaps.experiments.export import write_csv, write_jsonl
from kahanmaps.experiments.records import digest
from kahanmaps.experiments.store import Store
from kahanmaps.experiments.summary import summarise
from kahanmaps_cli.main import main

DOCUMENT = '{"name": "a"}'
GARBAGE = {
    "nothing": None,
    "a number": 7,
    "a large number": 2**62,
    "not finite": float("inf"),
    "bytes": b"\xff\xfe",
    "words": "no such thing",
    "another table": '{"time": "x", "memory": [], "task": 5, "system": 5, "options": 5}',
    "brackets": "[" * 100_000,
    "brackets that are closed": '{"a":' * 400 + "1" + "}" * 400,
    "a number beyond all": '{"value": 1e999}',
    "no number": '{"value": NaN}',
}
# By its key a task is looked up, and what is not `ok` is done again. What is only counted is read from an index: bytes
# that change there, or in the table, are seen by SQLite, but what is put into both of them as here is not.
NOT_SEEN = {
    ("task", "key", "find"),
    ("result", "outcome", "pending"),
    ("result", "verdict", "status"),
    ("result", "seconds", "status"),
}

CELLS = [
    ("document", "digest"),
    ("document", "text"),
    ("task", "key"),
    ("task", "text"),
    *(("experiment", column) for column in ("name", "definition", "digest", "limits", "total", "tasks", "checksum")),
    *(("plan", column) for column in ("experiment", "number", "task")),
    *(("result", column) for column in ("outcome", "verdict", "seconds", "attempts", "peak_memory", "host")),
    *(("result", column) for column in ("finished", "versions", "message", "stderr", "result", "checksum")),
]


class Text(list[str]):
    """What is written to it."""

    def write(self, text: str) -> int:
        self.append(text)
        return len(text)


def _merged(store: Store, path: Path) -> Any:
    with Store.open(path.with_name("target.db"), create=True) as target:
        return target.merge(path), list(target.rows(missing=True)), target.document(digest(DOCUMENT))


def _exported(write: Callable[..., None], rows: Any) -> str:
    text = Text()
    write(rows, text)
    return "".join(text)


# Each way to read, with the columns that it reads.
READERS: dict[str, Callable[[Store, Path], Any]] = {
    "rows": lambda store, path: list(store.rows(missing=True)),
    "status": lambda store, path: (store.status(), store.unplanned()),
    "pending": lambda store, path: (list(store.pending(retry_failed=True)), store.count_pending(retry_failed=True)),
    "experiments": lambda store, path: store.experiments(),
    "find": lambda store, path: [store.find(task(number).key[:6]) for number in (1, 2, 3)],
    "document": lambda store, path: store.document(digest(DOCUMENT)),
    "summary": lambda store, path: summarise(store.rows(missing=True), ["eps"]).to_json(),
    "csv": lambda store, path: _exported(write_csv, store.rows),
    "jsonl": lambda store, path: _exported(write_jsonl, store.rows()),
    "merge": _merged,
}


@pytest.fixture
def folder() -> Iterator[Path]:
    """Where hundreds of small databases are made in no time."""
    with TemporaryDirectory(dir=MEMORY) as name:
        yield Path(name)


@pytest.fixture
def sound(folder: Path) -> Path:
    """A database with one experiment of three tasks: done, failed, missing."""
    path = folder / "sound.db"
    with Store.open(path, create=True) as store:
        store.plan("a", "made", LIMITS, tasks(1, 2, 3), {digest(DOCUMENT): DOCUMENT})
        store.add([ok(1), failed(2)])
    return path


def read(path: Path) -> dict[str, Any]:
    """What each reader finds, or the damage that it tells."""
    found: dict[str, Any] = {}
    for name, reader in READERS.items():
        path.with_name("target.db").unlink(missing_ok=True)
        try:
            with Store.open(path, readonly=True) as store:
                found[name] = reader(store, path)
        except StoreError as error:
            found[name] = error
    return found


def put(path: Path, table: str, column: str, value: Any) -> None:
    """Put a value into the first row of a table, whatever its column is declared to be."""
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        (sql,) = connection.execute("SELECT sql FROM sqlite_master WHERE name = ?", (table,)).fetchone()
        free = sql.replace(" NOT NULL", "")
        for kind in (" TEXT", " REAL", " INTEGER") if "PRIMARY KEY (" not in sql else ():
            free = free.replace(f"{column}{kind}", column)
        connection.execute("PRAGMA writable_schema = ON")
        connection.execute("UPDATE sqlite_master SET sql = ? WHERE name = ?", (free, table))
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        where = "number = 0" if table == "plan" else f"rowid = (SELECT min(rowid) FROM {table})"
        connection.execute(f"UPDATE {table} SET {column} = ? WHERE {where}", (value,))
        connection.execute("PRAGMA writable_schema = ON")
        connection.execute("UPDATE sqlite_master SET sql = ? WHERE name = ?", (sql, table))


@pytest.mark.parametrize(("table", "column"), quick(CELLS, CELLS[1::2]))
def test_a_damaged_cell_is_told_or_changes_nothing(sound, folder, table, column):
    expected = read(sound)
    wrong = []
    for kind, value in GARBAGE.items():
        path = folder / "results.db"
        shutil.copy(sound, path)
        try:
            put(path, table, column, value)
        except sqlite3.Error:  # a primary key that is NULL, for instance
            continue
        for name, found in read(path).items():
            if isinstance(found, StoreError):
                told = isinstance(found, Damaged) or (table, column) == ("document", "digest")
                if not told or not str(found).startswith(f"{path} ") or "\n" in str(found):
                    wrong.append((kind, name, str(found)))
            elif (table, column, name) not in NOT_SEEN and found != expected[name]:
                wrong.append((kind, name, found))
    assert wrong == []


# Bytes


def pages_of_results(path: Path) -> Path:
    """A database in which trees have several levels and results several pages; no page of it is empty."""
    with Store.open(path, create=True) as store:
        store.plan("a", "made", LIMITS, tasks(*range(40)), {digest(DOCUMENT): DOCUMENT})
        store.plan("b", "made too", LIMITS, tasks(7, 7, *range(30, 60)), {})
        store.add([ok(number, "1/3" * (2 + 200 * (number % 5 == 0)), "proved") for number in range(50)])
        store.add([failed(number) for number in range(50, 55)])
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA page_size = 512")
        connection.execute("VACUUM")
    return path


def flipped(sound: Path, path: Path, random: Random) -> int:
    """A copy with one byte changed: where."""
    content = bytearray(sound.read_bytes())
    place = random.randrange(len(content))
    content[place] ^= random.randrange(1, 256)
    path.write_bytes(content)
    return place


@pytest.mark.parametrize("count", [20, pytest.param(400, marks=pytest.mark.slow)])
def test_a_byte_that_changes_is_told_or_changes_nothing(folder, count, capsys):
    sound, path = pages_of_results(folder / "sound.db"), folder / "results.db"
    expected, random, wrong, whole = read(sound), Random(count), [], 0
    export = ["batch", "export", "--jsonl", "--stable", "--db", str(path)]
    shutil.copy(sound, path)
    assert main(export) == 0
    lines = capsys.readouterr().out
    for _ in range(count):
        place = flipped(sound, path, random)
        content = path.read_bytes()
        status = main(export)
        out = capsys.readouterr().out
        if status not in (0, 2) or (status == 0 and out != lines):
            wrong.append((place, "export", status))
        checked = main(["batch", "check", "--db", str(path)])
        capsys.readouterr()
        if checked not in (0, 2, 3):
            wrong.append((place, "check", checked))
        for name, found in read(path).items():
            if isinstance(found, StoreError) and "\n" not in str(found):
                if checked == 0:
                    wrong.append((place, name, "is told, but not by `batch check`"))
            elif found != expected[name]:
                wrong.append((place, name, found))
        whole += checked == 0
        assert path.read_bytes() == content
    assert wrong == []
    assert 0 < whole < count / 2  # most bytes mean something


# What is damaged is named, and done again


def spoil(path: Path, *numbers: int) -> None:
    """Another result for these tasks, as no program of ours writes it."""
    with closing(sqlite3.connect(path)) as connection, connection:
        for number in numbers:
            sql = "UPDATE result SET result = ? WHERE task = (SELECT id FROM task WHERE key = ?)"
            connection.execute(sql, ('{"value":"1/3"}', task(number).key))


def test_all_that_is_damaged_is_named_and_the_rest_is_counted(sound):
    spoil(sound, 1)
    put(sound, "document", "text", "another")
    put(sound, "experiment", "limits", '{"memory":null,"time":9.0}')
    with Store.open(sound, readonly=True) as store:
        found = store.check()
    assert not found.is_whole
    assert found.damaged == {
        "experiments": ("a",),
        "tasks": (),
        "documents": (digest(DOCUMENT),),
        "results": (task(1).key,),
    }
    assert found.whole == {"experiments": 0, "tasks": 3, "documents": 0, "results": 1}
    assert (found.pages, found.has_checksums) == ((), True)


def test_a_plan_that_lacks_a_task_and_a_result_that_has_none_are_damaged(sound):
    with closing(sqlite3.connect(sound)) as connection, connection:
        connection.execute("DELETE FROM task WHERE key = ?", (task(1).key,))
    with Store.open(sound, readonly=True) as store:
        found = store.check()
    assert (found.damaged["experiments"], found.damaged["results"]) == (("a",), ("None",))


def test_damaged_pages_are_told_with_what_can_still_be_read(folder):
    path = pages_of_results(folder / "results.db")
    with path.open("r+b") as file:
        file.seek(path.stat().st_size // 2)
        file.write(b"\xa5" * 2048)
    with Store.open(path, readonly=True, is_checked=False) as store:
        found = store.check()
    assert found.pages
    assert any("the rest" in names for names in found.damaged.values())
    assert 0 < sum(found.whole.values()) < 2 + 60 + 1 + 55


def test_a_damaged_result_is_forgotten_and_done_again(sound):
    with Store.open(sound, readonly=True) as store:
        rows = list(store.rows())
    spoil(sound, 1)
    with Store.open(sound) as store:
        assert store.forget_damaged() == [task(1).key]
        assert store.forget_damaged() == []
        assert [job.task for job in store.pending()] == tasks(1, 3)
        store.add([ok(1)])
        assert list(store.rows()) == rows


def test_nothing_is_written_over_a_damaged_result_without_a_word(sound, folder):
    """Neither by a batch nor by a merge, in which the damage would look like another result."""
    spoil(sound, 1)
    source = planned(folder / "source.db", 1, records=[ok(1)], definition="made")
    with Store.open(sound) as store:
        with pytest.raises(Damaged, match=f"the record of task {task(1).key}: it has not its checksum"):
            store.add([ok(1)])
        with pytest.raises(Damaged, match=r"sound\.db is damaged"):
            store.merge(source)
        assert store.check().damaged["results"] == (task(1).key,)


# Databases without checksums


def of_format_1(path: Path) -> Path:
    """The same database as older versions wrote it."""
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("ALTER TABLE result DROP COLUMN checksum")
        connection.execute("ALTER TABLE experiment DROP COLUMN checksum")
        connection.execute("PRAGMA user_version = 1")
    return path


def schema_of(path: Path) -> list[tuple[str, ...]]:
    with closing(sqlite3.connect(path)) as connection:
        return connection.execute("SELECT name, sql FROM sqlite_master ORDER BY name").fetchall()


def test_a_database_of_the_first_format_is_read_and_gets_checksums_when_it_is_written_to(sound, folder):
    old = of_format_1(Path(shutil.copy(sound, folder / "old.db")))
    content = old.read_bytes()
    expected = read(sound)
    assert {name: found == expected[name] for name, found in read(old).items()} == dict.fromkeys(READERS, True)
    with Store.open(old, readonly=True) as store:
        assert (store.check().is_whole, store.check().has_checksums) == (True, False)
    assert old.read_bytes() == content
    Store.open(old).close()
    with Store.open(old, readonly=True) as store:
        assert (store.check().is_whole, store.check().has_checksums) == (True, True)
    assert read(old) == expected
    assert schema_of(old) == schema_of(sound)


def test_what_is_damaged_already_gets_no_checksum(sound):
    of_format_1(sound)
    with closing(sqlite3.connect(sound)) as connection, connection:
        connection.execute("UPDATE result SET result = '{\"value\":' WHERE outcome = 'ok'")
    with Store.open(sound) as store:
        assert store.check().damaged["results"] == (task(1).key,)
        assert store.forget_damaged() == [task(1).key]


def test_an_upgrade_that_is_cut_off_leaves_the_old_format(sound, monkeypatch):
    of_format_1(sound)

    def cut_off(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(tables, "put_result", cut_off)
    with pytest.raises(KeyboardInterrupt):
        Store.open(sound)
    with Store.open(sound, readonly=True) as store:
        assert (store.check().is_whole, store.check().has_checksums) == (True, False)
