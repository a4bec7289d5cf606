"""One SQLite file: opening and closing it, one transaction or one read at a time, and errors told in sentences.

It has SQLite's rollback journal, which is sound on every file system, and one writer at a time, who holds an advisory
lock beside it. What lies in the file is not known here, except whether it is ours (schema.py).
"""

from __future__ import annotations

import fcntl
import json
import os
import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Self

from kahanmaps.errors import InputError, KahanmapsError, is_of_the_machine, quoted
from kahanmaps.experiments.results.schema import APPLICATION_ID, FORMATS, SCHEMA
from kahanmaps.whole_files import resolved

_BUSY_SECONDS = 30.0
_SMALLEST = 512  # bytes, the smallest page that SQLite has
# In KiB. The index of a million keys, hit at random while they are planned, is to fit into it; otherwise every key
# costs a page written.
_CACHE = 128 << 10
_OF_THE_MACHINE = {sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR, sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED}


class StoreError(InputError):
    """A database that cannot be used, or not in this way: the message says what to do."""


class Unavailable(KahanmapsError, OSError):
    """A database that cannot be used just now, by nobody's mistake: the disk is full or broken, the file is gone."""


class Database:
    """An SQLite file of ours. Make one with `Database.open`, and close it.

    `name` is the file as it was given, for messages; `path` is resolved, or two names of one file would have two locks.
    """

    def __init__(self, path: str | os.PathLike[str], readonly: bool) -> None:
        self.name = os.fspath(path)
        try:
            self.path = resolved(self.name)
        except OSError as error:
            raise self._unopened(error) from error
        self._is_readonly = readonly
        self._lock: int | None = None
        self._connection: sqlite3.Connection | None = None

    @classmethod
    def open(cls, path: str | os.PathLike[str], create: bool = False, readonly: bool = False) -> Self:
        """The database in this file; `create` makes it if it is not there. Open for writing, it has the lock."""
        if create and readonly:
            raise ValueError("a database opened for reading only cannot be created")
        database = cls(path, readonly)
        try:
            with database._errors():
                database._open(create)
        except BaseException as error:
            database.close()
            if isinstance(error, OSError) and not isinstance(error, Unavailable):
                raise database._unopened(error) from error
            raise
        return database

    def close(self) -> None:
        """Leave one complete file behind. May be called twice."""
        if self._connection is not None:
            with suppress(sqlite3.Error):
                self._connection.close()
            self._connection = None
        if self._lock is not None:
            with suppress(OSError):
                os.unlink(self._lock_path)
            os.close(self._lock)
            self._lock = None

    # Reading and writing

    def fetch(self, sql: str, values: Sequence[Any] = ()) -> list[Any]:
        """All rows at once: a statement half read would keep its lock, and hold the writer up."""
        with self._errors():
            rows = self.execute(sql, values).fetchall()
        if any(isinstance(value, bytes) for row in rows for value in row):
            raise StoreError(f"{self.name} is damaged (bytes in place of a text or a number): take a copy from before")
        return rows

    def chunks(self, table: str, id: str, columns: str, size: int, join: str = "") -> Iterator[list[Any]]:
        """Rows of the table `r` with their numbers, some at a time, in their order."""
        last = 0
        sql = f"SELECT r.{id}, {columns} FROM {table} AS r {join} WHERE r.{id} > ? ORDER BY r.{id} LIMIT ?"
        while rows := self.fetch(sql, (last, size)):
            last = rows[-1][0]
            yield rows

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """What is executed in it is done completely or not at all."""
        if self._is_readonly:
            raise StoreError(f"{self.name} has been opened for reading only: open it for writing")
        with self._errors():
            connection = self._opened
            connection.execute("BEGIN IMMEDIATE")
            try:
                yield
                connection.execute("COMMIT")
            except BaseException:
                if connection.in_transaction:  # after some errors SQLite has rolled back by itself
                    with suppress(sqlite3.Error):
                        connection.execute("ROLLBACK")
                raise

    def execute(self, sql: str, values: Sequence[Any] = ()) -> sqlite3.Cursor:
        """One statement of a transaction."""
        return self._opened.execute(sql, values)

    def execute_many(self, sql: str, rows: Iterable[Sequence[Any]]) -> int:
        """One statement of a transaction for each of these rows; how many rows of the table it changed."""
        return self._opened.executemany(sql, rows).rowcount

    @contextmanager
    def making(self, what: str) -> Iterator[None]:
        """Values are made of what lies in the file: what cannot be made is damage, told with this name."""
        try:
            yield
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
            reason = quoted(" ".join(str(error).split()), 100)
            raise StoreError(f"{self.name} is damaged ({what}: {reason}): take a copy from before") from error

    def table(self, text: str) -> dict[str, Any]:
        """The dict that a text in the file spells. Raises ValueError or TypeError for any other text."""
        found = json.loads(text)
        if not isinstance(found, dict):
            raise TypeError("found no table in JSON")
        return found

    # Opening

    def _open(self, create: bool) -> None:
        if self.path.exists():
            if not self.path.is_file():
                raise StoreError(f"{self.name} is a folder or a device, expected a file: check the name")
            if 0 < self.path.stat().st_size < _SMALLEST:  # SQLite takes it for an empty one, and would write over it
                raise StoreError(f"{self.name} is not an SQLite database: check the name")
        elif not create:
            raise StoreError(f"there is no database {self.name}: check the name, or run the batch to make it")
        elif not self.path.parent.is_dir():
            raise StoreError(f"{self.name} cannot be made: there is no folder {self.path.parent}; make it first")
        if self._is_readonly:
            # Reading may have to write, to play back what a killed writer left. Where nobody may write, nobody does.
            may_write = os.access(self.path, os.W_OK) and os.access(self.path.parent, os.W_OK)
            has_journal = any(Path(f"{self.path}{end}").exists() for end in ("-journal", "-wal"))
            self._connect("rw" if may_write or has_journal else "ro&immutable=1")
            self._require_ours()
            self.execute("PRAGMA query_only = ON")
            return
        if self.path.exists() and not os.access(self.path, os.W_OK):
            raise StoreError(f"{self.name} may not be written to: change its permissions, or work on a copy")
        self._connect("rwc" if create else "rw")
        is_empty = self._is_empty()
        if not (is_empty and create):
            self._require_ours()  # before the lock: no lock file beside what is not ours
        self._take_lock()
        self.execute(f"PRAGMA cache_size = -{_CACHE}")
        self.execute("PRAGMA journal_mode = DELETE")  # older versions wrote WAL, which network file systems ruin
        if create and self._is_empty():  # under the lock once more: somebody else may have been making it
            with self.transaction():
                for statement in SCHEMA.split(";"):  # executescript would commit
                    self.execute(statement)
        self._require_ours()

    def _connect(self, mode: str) -> None:
        self._connection = sqlite3.connect(
            f"{self.path.as_uri()}?mode={mode}", timeout=_BUSY_SECONDS, isolation_level=None, uri=True
        )

    @property
    def _lock_path(self) -> str:
        return f"{self.path}.lock"

    def _take_lock(self) -> None:
        """Become the one that writes. The operating system frees the lock when the process ends, however it ends.

        The locked file cannot be the database: to close any descriptor of that would drop the locks that SQLite has.
        """
        while True:
            descriptor = os.open(self._lock_path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                # The one before may have removed the file after it was opened here: then it locks nobody out.
                with suppress(FileNotFoundError):
                    if os.path.samestat(os.fstat(descriptor), os.stat(self._lock_path)):
                        self._lock = descriptor
                        return
            except BlockingIOError:
                raise StoreError(f"another batch is writing to {self.name}: wait for it, or end it") from None
            finally:
                if self._lock is None:
                    os.close(descriptor)

    @property
    def _opened(self) -> sqlite3.Connection:
        if self._connection is None:
            raise StoreError(f"{self.name} has been closed: open it again")
        return self._connection

    def _is_empty(self) -> bool:
        # The schema first: pragmas alone are answered for files that SQLite cannot read.
        asked = ("SELECT count(*) FROM sqlite_master", "PRAGMA application_id", "PRAGMA user_version")
        return not any(self.execute(sql).fetchone()[0] for sql in asked)

    def _require_ours(self) -> None:
        if self._is_empty():
            raise StoreError(f"{self.name} is empty and not a database of results: check the name")
        if self.execute("PRAGMA application_id").fetchone()[0] != APPLICATION_ID:
            raise StoreError(f"{self.name} is an SQLite database of another program, not one of results: left alone")
        found = self.execute("PRAGMA user_version").fetchone()[0]
        if found not in FORMATS:
            raise StoreError(
                f"{self.name} was written by format {found} of kahanmaps databases, this version reads formats "
                f"{' and '.join(map(str, FORMATS))}: use the kahanmaps that wrote it, or begin another database"
            )

    @contextmanager
    def _errors(self) -> Iterator[None]:
        """The one place where errors of SQLite become sentences."""
        try:
            yield
        except sqlite3.Error as error:
            # Those of Python's module have no code: text that is not UTF-8.
            code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_CORRUPT) & 0xFF
            if code in _OF_THE_MACHINE:
                raise Unavailable(
                    f"{self.name} cannot be read or written: {error}; what was stored before is safe, look after the "
                    "disk, its room and whoever uses the file, and run it again"
                ) from error
            if code == sqlite3.SQLITE_NOTADB:
                raise StoreError(f"{self.name} is not an SQLite database: check the name") from error
            if code in (sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY, sqlite3.SQLITE_PERM):
                raise StoreError(
                    f"{self.name} cannot be opened ({error}): file and folder must be readable, and writable as well "
                    f"where a killed writer left {self.path.name}-journal: change the permissions, or work on a copy"
                ) from error
            raise StoreError(
                f"{self.name} is damaged ({quoted(str(error), 100)}): take a copy from before, or begin another one"
            ) from error

    def _unopened(self, error: OSError) -> KahanmapsError:
        kind = Unavailable if is_of_the_machine(error) else StoreError
        return kind(f"{self.name} cannot be opened ({error.strerror or error}): check its name and permissions")
