"""The database of the results of a batch: one SQLite file, which one process writes while others may read it.

A store contains the experiments with their plans (rows of tasks in order), the texts of tasks and system documents, and
the latest result of each task. A task is stored once even if it is planned several times. Hence a changed batch reuses
the results of all tasks that it has in common with the previous batch.

Three rules ensure consistency:

* a result that is reported as stored is on the disk: each method that writes is one transaction, so that a kill at
  any time leaves the state before or after it;
* there is one writer: opening for writing takes a lock, which the operating system releases when the process ends;
* readers block the writer only briefly: they read in chunks, and fetch a chunk completely before they yield its first
  row. Only counts are single queries; counting a million tasks takes a second.

SQLite's rollback journal is used, never WAL: it is safe on all file systems, including network file systems.
"""

from __future__ import annotations

import fcntl
import json
import math
import os
import re
import sqlite3
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from itertools import islice
from operator import index
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self

from kahanmaps.atomic_files import resolve_path
from kahanmaps.display_protocols import HtmlDisplay
from kahanmaps.errors import InputError, KahanmapsError, is_machine_failure, note_source, quoted
from kahanmaps.experiments.results.records import (
    KEY_LENGTH,
    Job,
    Outcome,
    Record,
    Row,
    Task,
    TaskLimits,
    canonical,
    digest,
    encodable,
)

# Increase the format if older versions cannot read the file. Format 2 is format 1 with two more columns, both unused.
FORMATS = (1, 2)
APPLICATION_ID = 0x4B61684D  # "KahM" in ASCII, which identifies databases of kahanmaps
SKIPPED = "TABLE skipped (experiment INTEGER, system TEXT, reason TEXT, PRIMARY KEY (experiment, system))"
SCHEMA = f"""
CREATE TABLE document (digest TEXT PRIMARY KEY NOT NULL, text TEXT NOT NULL);
CREATE TABLE task (id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE, text TEXT NOT NULL);
-- id: also the position among the experiments
CREATE TABLE experiment (
    id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, definition TEXT NOT NULL, digest TEXT NOT NULL,
    limits TEXT NOT NULL, total INTEGER NOT NULL, tasks INTEGER NOT NULL
);
-- number: from 0 without gaps. The same task may be planned twice.
CREATE TABLE plan (
    experiment INTEGER NOT NULL, number INTEGER NOT NULL, task INTEGER NOT NULL, PRIMARY KEY (experiment, number)
) WITHOUT ROWID;
-- Systems of an experiment that could not be used when it was planned.
CREATE {SKIPPED};
CREATE INDEX plan_of_task ON plan (task, experiment, number);
CREATE TABLE result (
    task INTEGER PRIMARY KEY, outcome TEXT NOT NULL, verdict TEXT, seconds REAL NOT NULL, attempts INTEGER NOT NULL,
    peak_memory INTEGER, host TEXT NOT NULL, finished TEXT NOT NULL, versions TEXT NOT NULL, message TEXT NOT NULL,
    stderr TEXT NOT NULL, result TEXT
);
-- Counting uses this index, since the pages of the table itself contain long results.
CREATE INDEX result_summary ON result (task, outcome, verdict, seconds);
PRAGMA application_id = {APPLICATION_ID};
PRAGMA user_version = 1;
"""
PLAN_CHUNK = 1000  # number of rows of a plan that are read at once
RESULT_CHUNK = 50  # number of rows that are read at once with their results, each of which may take megabytes
MAX_FOUND_TASKS = 20  # maximal number of tasks returned for one prefix of a key
MAX_CONFLICTS_SHOWN = 5  # maximal number of keys of conflicting tasks in the result of a merge

_BUSY_SECONDS = 30.0  # seconds of waiting for a lock of another process
_MIN_BYTES = 512  # the smallest page size of SQLite
# KiB of cache for SQLite. Planning accesses the index of keys in random order: if the cache does not hold the index of
# a million keys, every key causes a page to be written.
_CACHE_KIB = 128 << 10
_MACHINE_CODES = {sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR, sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED}
# fmt: off
_COLUMNS = (
    "outcome", "result", "verdict", "message", "stderr", "seconds", "peak_memory", "host", "versions", "finished",
)
# fmt: on
_SELECTED_COLUMNS = ", ".join(f"r.{column}" for column in (*_COLUMNS, "attempts"))


class StoreError(InputError):
    """Raised for a database that cannot be used, or not for the requested operation; the message says what to do."""


class Unavailable(KahanmapsError, OSError):
    """Raised if a database is temporarily unusable, for example since the disk is full or the file was removed."""


@dataclass(frozen=True)
class StoredExperiment:
    """A planned experiment: `total` is the number of rows of its plan, `tasks` the number of distinct tasks in it.

    `id` is the number of the experiment in the database. `offset` is the sum of `total` over all earlier experiments.
    """

    name: str
    definition: str
    limits: TaskLimits
    total: int
    tasks: int
    id: int = field(compare=False)
    offset: int = field(compare=False)


@dataclass(frozen=True)
class ExperimentStatus:
    """The progress of an experiment: `total` counts the rows of its plan, all other counts refer to distinct tasks.

    Hence `tasks` is the sum of `missing` and of all `outcomes`. `seconds` is the total time of the latest attempts;
    `skipped` lists pairs of a system that the plan omits, and the reason.
    """

    name: str
    total: int
    tasks: int
    missing: int
    outcomes: Mapping[Outcome, int]
    verdicts: Mapping[str, int]
    seconds: float
    skipped: Sequence[tuple[str, str]] = ()


@dataclass(frozen=True)
class Planned:
    """The result of planning: `total` counts the rows of the plan, all other counts refer to distinct tasks.

    `known` counts tasks that the store already contained, `new_tasks` those that it did not, `dropped` those that only
    the replaced plan contained. `is_resumed` is true if the stored plan had the same definition.
    """

    total: int
    known: int
    new_tasks: int
    dropped: int
    is_resumed: bool = False


@dataclass(frozen=True)
class Merged:
    """The result of a merge: numbers of new tasks, of new `results`, and of failures that were `replaced` by results.

    `conflicts` counts the tasks with different results in the two databases; `conflicting` contains the keys of the
    first few of them.
    """

    tasks: int
    results: int
    replaced: int
    conflicts: int
    conflicting: tuple[str, ...] = ()


class StoredTask(NamedTuple):
    """A task, its record (None if missing), its positions (experiment, row number) in plans, the number of attempts."""

    task: Task
    record: Record | None
    places: list[tuple[str, int]]
    attempts: int


class Store(HtmlDisplay):
    """A database of results. `Store.open` opens it; use a `with` block, or close it.

    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder, Store.open(f"{folder}/results.db", create=True) as store:
    ...     store.plan("steps", "orbit, m = 2", TaskLimits(time=60), [Task("orbit", {"family": {"m": 2}}, {})], {})
    ...     [job.task.kind for job in store.pending()]
    Planned(total=1, known=0, new_tasks=1, dropped=0, is_resumed=False)
    ['orbit']
    """

    path: Path  # with links resolved, since two names of one file must have the same lock

    def __init__(self, path: str | os.PathLike[str], readonly: bool) -> None:
        self.name = os.fspath(path)  # the path as given, for messages
        self._is_readonly = readonly
        self._lock: int | None = None
        self._connection: sqlite3.Connection | None = None

    # Opening and closing

    @classmethod
    def open(cls, path: str | os.PathLike[str], create: bool = False, readonly: bool = False) -> Self:
        """Open the store in a file, for writing unless `readonly`; a missing file is created if `create`."""
        if create and readonly:
            raise ValueError("a database opened for reading only cannot be created")
        store = cls(path, readonly)
        try:
            store.path = resolve_path(store.name)
            with store._translate_errors():
                store._open(create)
        except BaseException as error:
            store.close()
            if isinstance(error, OSError) and not isinstance(error, Unavailable):
                kind = Unavailable if is_machine_failure(error) else StoreError
                reason = error.strerror or error
                raise kind(f"{store.name} cannot be opened ({reason}): check its name and permissions") from error
            raise
        return store

    def close(self) -> None:
        """Close the database and release the lock; closing it twice has no effect."""
        if self._connection is not None:
            with suppress(sqlite3.Error):
                self._connection.close()
            self._connection = None
        if self._lock is not None:
            with suppress(OSError):
                os.unlink(f"{self.path}.lock")
            os.close(self._lock)
            self._lock = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        if error is not None:
            note_source(error, self.name)
        self.close()

    def _open(self, create: bool) -> None:
        exists = self.path.exists()
        if exists and not self.path.is_file():
            raise StoreError(f"{self.name} is a folder or a device, expected a file: check the name")
        # SQLite would treat a file shorter than a page as an empty database, and overwrite it.
        if exists and 0 < self.path.stat().st_size < _MIN_BYTES:
            raise StoreError(f"{self.name} is not an SQLite database: check the name")
        if not exists and not create:
            raise StoreError(f"there is no database {self.name}: check the name, or run the batch to make it")
        if not self.path.parent.is_dir():
            raise StoreError(f"{self.name} cannot be made: there is no folder {self.path.parent}; create it first")
        mode = "rwc" if create else "rw"
        if self._is_readonly:
            # After a kill of the writer, opening the file rolls back its journal, and so even a reader has to write.
            may_write = os.access(self.path, os.W_OK) and os.access(self.path.parent, os.W_OK)
            has_journal = any(Path(f"{self.path}{end}").exists() for end in ("-journal", "-wal"))
            mode = "rw" if may_write or has_journal else "ro&immutable=1"
        elif exists and not os.access(self.path, os.W_OK):
            raise StoreError(f"{self.name} may not be written to: change its permissions, or work on a copy")
        address = f"{self.path.as_uri()}?mode={mode}"
        self._connection = sqlite3.connect(address, timeout=_BUSY_SECONDS, isolation_level=None, uri=True)
        self._is_initialized(create)  # before locking, so that no lock file appears beside a file of another program
        if not self._is_readonly:
            # The operating system releases this lock when the process ends. The locked file is not the database itself:
            # closing any descriptor of the database would release the locks of SQLite.
            while self._lock is None:
                descriptor = os.open(f"{self.path}.lock", os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666)
                try:
                    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    # The previous writer may have removed the lock file after it was opened here; a lock on a removed
                    # file has no effect.
                    with suppress(FileNotFoundError):
                        if os.path.samestat(os.fstat(descriptor), os.stat(f"{self.path}.lock")):
                            self._lock = descriptor
                except BlockingIOError:
                    raise StoreError(f"another batch is writing to {self.name}: wait for it, or end it") from None
                finally:
                    if self._lock is None:
                        os.close(descriptor)
            self._execute(f"PRAGMA cache_size = -{_CACHE_KIB}")
            self._execute("PRAGMA journal_mode = DELETE")  # older versions of kahanmaps used WAL
            if not self._is_initialized(create):  # another process may have created the tables meanwhile
                with self._transaction():
                    for statement in SCHEMA.split(";"):  # `executescript` would commit the transaction
                        self._execute(statement)
        if not self._execute("SELECT 1 FROM sqlite_master WHERE name = 'skipped'").fetchone():  # an older file
            self._execute(f"CREATE {'TEMP ' * self._is_readonly}{SKIPPED}")
        if self._is_readonly:
            self._execute("PRAGMA query_only = ON")

    def _is_initialized(self, create: bool) -> bool:
        """Whether the file is a database of kahanmaps (False: empty, and `create`). Raises StoreError otherwise."""
        # The schema is read first, since pragmas succeed even for a file that SQLite cannot read.
        queries = ("SELECT count(*) FROM sqlite_master", "PRAGMA application_id", "PRAGMA user_version")
        tables, application, version = [self._execute(sql).fetchone()[0] for sql in queries]
        if not (tables or application or version):
            if create:
                return False
            raise StoreError(f"{self.name} is empty and not a database of results: check the name")
        if application != APPLICATION_ID:
            raise StoreError(f"{self.name} is an SQLite database of another program, not one of results: left alone")
        if version not in FORMATS:
            raise StoreError(
                f"{self.name} was written by format {version} of kahanmaps databases, this version reads formats "
                f"{' and '.join(map(str, FORMATS))}: use the kahanmaps that wrote it, or begin another database"
            )
        return True

    # SQL, with messages for the errors of SQLite

    def _execute(self, sql: str, values: Sequence[Any] = ()) -> sqlite3.Cursor:
        """Execute one statement."""
        return self._require_connection().execute(sql, values)

    def _require_connection(self) -> sqlite3.Connection:
        if self._connection is None:
            raise StoreError(f"{self.name} has been closed: open it again")
        return self._connection

    def _fetch(self, sql: str, values: Sequence[Any] = ()) -> list[Any]:
        """Return all rows of a query at once: a statement with unread rows would keep its lock and block the writer."""
        with self._translate_errors():
            rows = self._execute(sql, values).fetchall()
        if any(isinstance(value, bytes) for row in rows for value in row):
            raise StoreError(f"{self.name} is damaged (bytes in place of a text or a number): restore an earlier copy")
        return rows

    def _fetch_plan(self, sql: str, experiment: StoredExperiment, size: int, *values: int) -> Iterator[list[Any]]:
        """Yield, for each chunk of `size` rows of the plan, the rows of a query, so that each read is bounded."""
        for first in range(0, experiment.total, size):
            yield self._fetch(sql, (experiment.id, first, first + size - 1, *values))

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        """Execute all statements in the block as one transaction: all of them or none."""
        if self._is_readonly:
            raise StoreError(f"{self.name} has been opened for reading only: open it for writing")
        # At the end of the block the connection commits the transaction, or after an exception rolls it back.
        with self._translate_errors(), self._require_connection() as connection:
            connection.execute("BEGIN IMMEDIATE")
            yield

    @contextmanager
    def _translate_errors(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            # An error without a code comes from Python's sqlite3 module: a text is not UTF-8.
            code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT) & 0xFF
            kind = Unavailable if code in _MACHINE_CODES else StoreError
            if kind is Unavailable:
                reason = f"cannot be read or written: {error}; what was stored before is safe; check the disk, its "
                reason += "free space and other users of the file, and run it again"
            elif code == sqlite3.SQLITE_NOTADB:
                reason = "is not an SQLite database: check the name"
            elif code in (sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY, sqlite3.SQLITE_PERM):
                reason = f"cannot be opened ({error}): file and folder must be readable, and writable as well where a "
                reason += f"killed writer left {self.path.name}-journal: change the permissions, or work on a copy"
            else:
                reason = f"is damaged ({quoted(str(error), 100)}): restore an earlier copy, or begin another one"
            raise kind(f"{self.name} {reason}") from error

    @contextmanager
    def _report_damage(self, entry: str) -> Iterator[None]:
        """Report parsing errors in the block as damage of the database; `entry` names the entry that is parsed."""
        try:
            yield
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
            reason = quoted(" ".join(str(error).split()), 100)
            raise StoreError(f"{self.name} is damaged ({entry}: {reason}): restore an earlier copy") from error

    def _task(self, key: str, text: str) -> Task:
        with self._report_damage(f"the task {key}"):
            return Task.from_text(text)

    def _record(self, key: str, row: Sequence[Any]) -> Record | None:
        """Return the record in `row`, which has the columns `_SELECTED_COLUMNS`; None if the task has no result."""
        if row[0] is None:
            return None
        cells = dict(zip((*_COLUMNS, "attempts"), row, strict=True))
        del cells["attempts"]
        with self._report_damage(f"the record of task {key}"):
            cells["outcome"] = Outcome(cells["outcome"])
            if (cells["outcome"] is Outcome.OK) is not (cells["result"] is not None):
                presence = "no" if cells["result"] is None else "a"
                raise ValueError(f"the outcome is {cells['outcome']}, and there is {presence} result")
            cells["result"] = None if cells["result"] is None else _parse_dict(cells["result"])
            cells["versions"] = _parse_dict(cells["versions"])
            cells["seconds"] = float(cells["seconds"])
            cells["peak_memory"] = None if cells["peak_memory"] is None else index(cells["peak_memory"])
            return Record(key=key, **cells)

    # Experiments and their plans

    def experiments(self, names: Sequence[str] | None = None) -> list[StoredExperiment]:
        """Return the planned experiments in order; if `names` is given, only those with these names."""
        rows = self._fetch(
            "SELECT name, definition, limits, total, tasks, id, "
            "(SELECT max(number) + 1 FROM plan WHERE experiment = e.id) FROM experiment AS e ORDER BY id"
        )
        all_names = [row[0] for row in rows]
        for name in names or ():
            if name not in all_names:
                raise StoreError(
                    f"{self.name} has no experiment {name}: it has {', '.join(all_names) or 'none at all'}"
                )
        experiments: list[StoredExperiment] = []
        offset = 0
        for name, definition, limits, total, tasks, id, plan_size in rows:
            if names is None or name in names:
                with self._report_damage(f"the experiment {quoted(name)}"):
                    if total != (plan_size or 0):
                        raise ValueError(f"the plan has {plan_size or 0} tasks, expected {total}")
                    task_limits = TaskLimits(**_parse_dict(limits))
                    experiments.append(StoredExperiment(name, definition, task_limits, total, index(tasks), id, offset))
                    offset += total
        return experiments

    def plan(
        self,
        experiment: str,
        definition: str,
        limits: TaskLimits,
        tasks: Iterable[Task],
        documents: Mapping[str, str],
        skipped: Iterable[tuple[str, str]] = (),
    ) -> Planned:
        """Store the plan of an experiment: tasks in order. After a kill or an exception the previous plan is unchanged.

        `definition` determines the tasks. If it equals the stored one, `tasks` is not read, and only limits are
        updated. Otherwise the new plan replaces the stored plan; all results remain. `documents` (digest to text) is
        read after `tasks`, whose iterator may fill it. `skipped` lists pairs of an omitted system and the reason.
        """
        with self._transaction():
            sql = "SELECT digest, total, tasks FROM experiment WHERE name = ?"
            stored = self._execute(sql, (experiment,)).fetchone()
            if stored is not None and stored[0] == digest(definition):
                sql = "UPDATE experiment SET limits = ? WHERE name = ?"
                self._execute(sql, (canonical(asdict(limits)), experiment))
                result = Planned(stored[1], stored[2], 0, 0, is_resumed=True)
            else:
                texts = ((task.key, task.text) for task in tasks)
                result = self._replace_plan(experiment, definition, limits, texts)
                for name, text in documents.items():
                    if name != digest(text):
                        raise StoreError(
                            f"the document {name} is not the one with this digest, which is {digest(text)}"
                        )
                    self._execute("INSERT OR IGNORE INTO document VALUES (?, ?)", (name, text))
            self._replace_skipped(experiment, skipped)
            return result

    def _replace_skipped(self, experiment: str, skipped: Iterable[tuple[str, str]]) -> None:
        (id,) = self._execute("SELECT id FROM experiment WHERE name = ?", (experiment,)).fetchone()
        self._execute("DELETE FROM skipped WHERE experiment = ?", (id,))
        rows = ((id, system, reason) for system, reason in skipped)
        self._require_connection().executemany("INSERT OR REPLACE INTO skipped VALUES (?, ?, ?)", rows)

    def _replace_plan(
        self, experiment: str, definition: str, limits: TaskLimits, tasks: Iterable[tuple[str, str]]
    ) -> Planned:
        """Store a plan of (key, text) pairs; delete tasks of the old plan to which no plan and no result refers."""
        values = (experiment, definition, digest(definition), canonical(asdict(limits)))
        self._execute(
            "INSERT INTO experiment (name, definition, digest, limits, total, tasks) VALUES (?, ?, ?, ?, 0, 0) ON "
            "CONFLICT (name) DO UPDATE SET (definition, digest, limits) = "
            "(excluded.definition, excluded.digest, excluded.limits)",
            values,
        )
        (id,) = self._execute("SELECT id FROM experiment WHERE name = ?", (experiment,)).fetchone()
        self._execute("CREATE TEMP TABLE earlier (task INTEGER PRIMARY KEY)")
        self._execute("INSERT INTO earlier SELECT DISTINCT task FROM plan WHERE experiment = ?", (id,))
        self._execute("DELETE FROM plan WHERE experiment = ?", (id,))
        total = new_tasks = 0
        tasks = iter(tasks)
        while batch := list(islice(tasks, PLAN_CHUNK)):
            new_tasks += self._add_tasks(batch)
            rows = [(id, number, key) for number, (key, _) in enumerate(batch, total)]
            self._require_connection().executemany("INSERT INTO plan SELECT ?, ?, id FROM task WHERE key = ?", rows)
            total += len(batch)
        sql = "SELECT count(DISTINCT task) FROM plan WHERE experiment = ?"
        (distinct,) = self._execute(sql, (id,)).fetchone()
        self._execute("UPDATE experiment SET total = ?, tasks = ? WHERE id = ?", (total, distinct, id))
        sql = "SELECT count(*) FROM earlier WHERE task NOT IN (SELECT task FROM plan WHERE experiment = ?)"
        (dropped,) = self._execute(sql, (id,)).fetchone()
        self._execute(
            "DELETE FROM task WHERE id IN (SELECT task FROM earlier) "
            "AND NOT EXISTS (SELECT 1 FROM plan WHERE plan.task = task.id) "
            "AND NOT EXISTS (SELECT 1 FROM result WHERE result.task = task.id)"
        )
        self._execute("DROP TABLE earlier")
        return Planned(total, distinct - new_tasks, new_tasks, dropped)

    def _add_tasks(self, tasks: Sequence[tuple[str, str]]) -> int:
        """Add tasks, given as pairs (key, text), and return the number of those that were not in the store."""
        sql = "INSERT OR IGNORE INTO task (key, text) VALUES (?, ?)"
        return self._require_connection().executemany(sql, tasks).rowcount

    # Tasks to be run

    def pending(
        self,
        experiments: Sequence[str] | None = None,
        *,
        retry_failed: bool = False,
        shard: tuple[int, int] = (1, 1),
    ) -> Iterator[Job]:
        """Yield a job once for each task without a result, in plan order; results may be added during the iteration.

        If `retry_failed`, failed tasks are included, each once even if it fails again. `shard` = (i, n) selects the
        i-th of n disjoint parts of the tasks.
        """
        sql, queries = self._pending_query(experiments, retry_failed, shard)
        sql = sql.format("t.key, t.text", "JOIN task AS t ON t.id = p.task")
        return (
            Job(self._task(key, text), experiment.limits)
            for experiment, *values in queries
            for rows in self._fetch_plan(sql, experiment, PLAN_CHUNK, *values)
            for key, text in rows
        )

    def count_pending(self, experiments: Sequence[str] | None = None, **options: Any) -> int:
        """Return the number of jobs that `pending` yields with these arguments."""
        sql, queries = self._pending_query(experiments, **options)
        sql = sql.format("count(*)", "")
        return sum(self._fetch(sql, (e.id, 0, e.total, *values))[0][0] for e, *values in queries)

    def _pending_query(
        self, experiments: Sequence[str] | None, retry_failed: bool = False, shard: tuple[int, int] = (1, 1)
    ) -> tuple[str, list[tuple[StoredExperiment, int, int, int]]]:
        """Return a pair: the SQL text that selects the pending tasks in a chunk of a plan, and its parameters.

        `format` inserts the columns and a JOIN into the text. There is a tuple of parameters for each experiment: the
        experiment itself, and the last three parameters of the text.
        """
        part, parts = shard
        if not 1 <= part <= parts:
            raise StoreError(f"there is no part {part} of {parts}: parts are counted 1/{parts} to {parts}/{parts}")
        chosen = self.experiments(experiments)
        # A task planned several times belongs to its first row in the chosen experiments. Hence it is yielded once and
        # lies in one shard, without a list of the tasks already yielded.
        restriction = "" if experiments is None else f"AND q.experiment IN ({', '.join(str(c.id) for c in chosen)})"
        sql = f"""
            SELECT {{}} FROM plan AS p {{}}
            LEFT JOIN result AS r INDEXED BY result_summary ON r.task = p.task
            WHERE p.experiment = ? AND p.number BETWEEN ? AND ?
            AND (r.task IS NULL {"OR r.outcome <> 'ok'" if retry_failed else ""}) AND (p.number + ?) % ? = ?
            AND NOT EXISTS (
                SELECT 1 FROM plan AS q
                WHERE q.task = p.task AND (q.experiment, q.number) < (p.experiment, p.number) {restriction}
            )
            ORDER BY p.number"""
        return sql, [(experiment, experiment.offset, parts, part - 1) for experiment in chosen]

    # Results

    def add(self, records: Sequence[Record]) -> None:
        """Store all of the records or none; a record replaces an earlier one, but a failure does not replace a success.

        Records with the outcome `lost` are ignored.
        """
        records = [record for record in records if record.outcome is not Outcome.LOST]
        rows = []
        for record in records:  # raise an error here for values that JSON cannot represent
            if not math.isfinite(record.seconds):
                raise ValueError(f"a record cannot have taken {record.seconds} seconds")
            columns = {name: getattr(record, name) for name in _COLUMNS}  # not `asdict`, which would copy the results
            for name in ("result", "versions"):
                columns[name] = None if columns[name] is None else canonical(dict(columns[name]))
            columns |= {name: columns[name] and encodable(columns[name]) for name in ("verdict", "message", "stderr")}
            rows.append([*{**columns, "outcome": str(record.outcome), "seconds": float(record.seconds)}.values()])
        with self._transaction():
            for record, row in zip(records, rows, strict=True):
                stored = self._find_result(record.key)
                if stored is None:
                    raise StoreError(f"{self.name} has no task {record.key}: plan it before its result is added")
                task, *old_row, attempts = stored
                is_kept = old_row[0] == Outcome.OK and not record.is_ok
                self._put_result(task, old_row if is_kept else row, (attempts or 0) + 1)

    def _find_result(self, key: str) -> Sequence[Any] | None:
        """Return (id, *columns of the result, attempts) of a task (None for each missing column); None for no task."""
        sql = f"SELECT t.id, {_SELECTED_COLUMNS} FROM task AS t LEFT JOIN result AS r ON r.task = t.id WHERE t.key = ?"
        row: Sequence[Any] | None = self._execute(sql, (key,)).fetchone()
        return row

    def _put_result(self, task: int, row: Sequence[Any], attempts: int) -> None:
        columns, places = ", ".join(_COLUMNS), ", ".join("?" * (len(_COLUMNS) + 2))
        sql = f"INSERT OR REPLACE INTO result (task, {columns}, attempts) VALUES ({places})"
        self._execute(sql, (task, *row, attempts))

    def rows(self, experiments: Sequence[str] | None = None, *, missing: bool = False) -> Iterator[Row]:
        """Yield the rows of the plans in order with the records of their tasks; if `missing`, also rows without one."""
        stored = self.experiments(experiments)  # raises its errors here, not when the first row is read
        sql = f"""
            SELECT p.number, t.key, t.text, {_SELECTED_COLUMNS}
            FROM plan AS p JOIN task AS t ON t.id = p.task LEFT JOIN result AS r ON r.task = p.task
            WHERE p.experiment = ? AND p.number BETWEEN ? AND ? ORDER BY p.number"""
        return (
            Row(experiment.name, number, self._task(key, text), self._record(key, cells))
            for experiment in stored
            for rows in self._fetch_plan(sql, experiment, RESULT_CHUNK)
            for number, key, text, *cells in rows
            if missing or cells[0] is not None
        )

    def merge(self, other: str | os.PathLike[str]) -> Merged:
        """Add the experiments and results of another database, all or none; a repeated merge changes nothing.

        New experiments are added with their plans. Of two results of a task, a success replaces a failure; otherwise
        the result of this database remains. Experiments of the same name must have equal definitions.
        """
        new_tasks = results = replaced = conflicts = 0
        conflicting: list[str] = []
        with Store.open(other, readonly=True) as source, self._transaction():
            if source.path.samefile(self.path):
                raise StoreError(f"{source.name} is this database itself: there is nothing to merge")
            own_digests = dict(self._execute("SELECT name, digest FROM experiment").fetchall())
            for experiment in source.experiments():
                if own_digests.get(experiment.name, source_digest := digest(experiment.definition)) != source_digest:
                    raise StoreError(
                        f"the experiment {experiment.name} is defined in one way in {self.name} and in another way in "
                        f"{source.name}: rename it in one of them; nothing was merged"
                    )
                if experiment.name not in own_digests:
                    sql = """
                        SELECT t.key, t.text FROM plan AS p JOIN task AS t ON t.id = p.task
                        WHERE p.experiment = ? AND p.number BETWEEN ? AND ? ORDER BY p.number"""
                    tasks = (row for rows in source._fetch_plan(sql, experiment, PLAN_CHUNK) for row in rows)
                    planned = self._replace_plan(experiment.name, experiment.definition, experiment.limits, tasks)
                    self._replace_skipped(experiment.name, source._skipped(experiment))
                    new_tasks += planned.new_tasks
            for (name,) in source._fetch("SELECT digest FROM document"):  # one at a time, since a document may be long
                self._execute("INSERT OR IGNORE INTO document VALUES (?, ?)", (name, source.document(name)))
            sql = f"""
                SELECT r.task, t.key, t.text, {_SELECTED_COLUMNS} FROM result AS r JOIN task AS t ON t.id = r.task
                WHERE r.task > ? ORDER BY r.task LIMIT ?"""
            last_task = 0
            while rows := source._fetch(sql, (last_task, RESULT_CHUNK)):
                last_task = rows[-1][0]
                for _, key, text, *other_result, attempts in rows:
                    new_tasks += self._add_tasks([(key, text)])
                    task, *own_result, own_attempts = self._find_result(key) or ()
                    if own_result[0] is None or other_result[0] == Outcome.OK != own_result[0]:
                        results += own_result[0] is None
                        replaced += own_result[0] is not None
                        self._put_result(task, other_result, attempts + (own_attempts or 0))
                    elif other_result[0] == Outcome.OK and other_result[1:3] != own_result[1:3]:
                        conflicts += 1
                        conflicting += [key] if conflicts <= MAX_CONFLICTS_SHOWN else []
        return Merged(new_tasks, results, replaced, conflicts, tuple(conflicting))

    # Queries

    def status(self) -> list[ExperimentStatus]:
        """Return the progress of each experiment."""
        experiments = {experiment.id: experiment for experiment in self.experiments()}
        outcomes: dict[int, Counter[Outcome]] = {id: Counter() for id in experiments}
        verdicts: dict[int, Counter[str]] = {id: Counter() for id in experiments}
        seconds = dict.fromkeys(experiments, 0.0)
        counts = self._fetch(
            "SELECT p.experiment, r.outcome, r.verdict, count(*), sum(r.seconds) "
            "FROM (SELECT DISTINCT task, experiment FROM plan INDEXED BY plan_of_task) AS p "  # may be planned twice
            "JOIN result AS r INDEXED BY result_summary ON r.task = p.task GROUP BY p.experiment, r.outcome, r.verdict"
        )
        for id, outcome, verdict, count, total_seconds in counts:
            with self._report_damage(f"the outcomes of {quoted(experiments[id].name)}"):
                outcomes[id][Outcome(outcome)] += count
                seconds[id] += total_seconds
                if verdict is not None:
                    verdicts[id][verdict] += count
        return [
            ExperimentStatus(
                experiment.name,
                experiment.total,
                experiment.tasks,
                experiment.tasks - outcomes[id].total(),
                dict(outcomes[id]),
                dict(verdicts[id]),
                seconds[id],
                self._skipped(experiment),
            )
            for id, experiment in experiments.items()
        ]

    def _skipped(self, experiment: StoredExperiment) -> list[tuple[str, str]]:
        sql = "SELECT system, reason FROM skipped WHERE experiment = ? ORDER BY system"
        return self._fetch(sql, (experiment.id,))

    def unplanned(self) -> int:
        """Return the number of results whose task belongs to no plan."""
        sql = """
            SELECT count(*) FROM result AS r INDEXED BY result_summary
            WHERE NOT EXISTS (SELECT 1 FROM plan AS p WHERE p.task = r.task)"""
        return int(self._fetch(sql)[0][0])

    def find(self, prefix: str) -> list[StoredTask]:
        """Return at most 20 tasks whose keys begin with `prefix`, which has at least 4 hexadecimal digits."""
        prefix = prefix.lower()
        if not re.fullmatch(f"[0-9a-f]{{4,{KEY_LENGTH}}}", prefix):
            raise StoreError(
                f"{quoted(prefix)} is not the beginning of a key: give at least 4 of its {KEY_LENGTH} hexadecimal "
                "digits"
            )
        tasks = self._fetch(
            f"SELECT t.id, t.key, t.text, {_SELECTED_COLUMNS} FROM task AS t LEFT JOIN result AS r ON r.task = t.id "
            "WHERE t.key >= ? AND t.key < ? ORDER BY t.key LIMIT ?",
            (prefix, f"{prefix}g", MAX_FOUND_TASKS),  # in this order g follows every hexadecimal digit
        )
        places_sql = (
            "SELECT e.name, p.number FROM plan AS p JOIN experiment AS e ON e.id = p.experiment "
            "WHERE p.task = ? ORDER BY p.experiment, p.number"
        )
        return [
            StoredTask(self._task(key, text), self._record(key, row), self._fetch(places_sql, (id,)), row[-1] or 0)
            for id, key, text, *row in tasks
        ]

    def document(self, digest: str) -> str:
        """Return the text of the document with this digest."""
        rows = self._fetch("SELECT text FROM document WHERE digest = ?", (digest,))
        if not rows:
            raise StoreError(f"{self.name} has no document {digest}: plan the experiment that needs it again")
        return str(rows[0][0])


def _parse_dict(text: str) -> dict[str, Any]:
    """Return the dict that a JSON text encodes. Raises ValueError or TypeError for any other text."""
    table = json.loads(text)
    if not isinstance(table, dict):
        raise TypeError("found no table in JSON")
    return table
