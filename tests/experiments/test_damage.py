"""One cell of a database changed by an accident: what is read is what was written, or a sentence says what is damaged.

SQLite keeps anything in any column, so each kind of value is put into each cell of a small database, and everything
that reads one is asked. The sentence names the file and says what to do; nothing ends in another exception, nothing
goes round for ever, and no number changes without a word.
"""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from small_databases import LIMITS, MEMORY, failed, ok, task, tasks

from kahanmaps.experiments.export import write_csv, write_jsonl
from kahanmaps.experiments.records import digest
from kahanmaps.experiments.store import Damaged, Store, StoreError
from kahanmaps.experiments.summary import summarise

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
# Where any text is as good as another: only a value that is no text is damage.
TEXTS = {"message", "stderr", "host", "finished", "verdict", "name"}
# Where any table or number is as good as another.
FREE = {"versions": {"another table"}, "result": {"another table"}, "seconds": {"a number", "a large number"}}
FREE["peak_memory"] = FREE["attempts"] = FREE["seconds"] | {"nothing"}

# By its key a task is looked up, and what is not `ok` is done again.
NOT_SEEN = {("task", "key", "find"), ("result", "outcome", "pending")}

CELLS = [
    ("document", "digest"),
    ("document", "text"),
    ("task", "key"),
    ("task", "text"),
    *(("experiment", column) for column in ("name", "definition", "digest", "limits", "total", "tasks")),
    *(("plan", column) for column in ("experiment", "number", "task")),
    *(("result", column) for column in ("outcome", "verdict", "seconds", "attempts", "peak_memory", "host")),
    *(("result", column) for column in ("finished", "versions", "message", "stderr", "result")),
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


def is_as_good(column: str, kind: str) -> bool:
    """Whether the value could have been written there."""
    return kind in FREE.get(column, ()) or (column in TEXTS and isinstance(GARBAGE[kind], str))


@pytest.mark.parametrize(("table", "column"), CELLS)
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
            elif (table, column, name) not in NOT_SEEN and found != expected[name] and not is_as_good(column, kind):
                wrong.append((kind, name, found))
    assert wrong == []
