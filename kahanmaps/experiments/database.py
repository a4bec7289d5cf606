"""One SQLite file: opening and closing it, one transaction or one read at a time, and errors told in sentences.

Opened for writing it holds the lock, and has the journal that its file system allows (locks.py). What lies
in the file is not known here, except whether it is ours (schema.py).
"""

from __future__ import annotations

import json
import os
import shlex
import sqlite3
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from math import isfinite
from pathlib import Path
from typing import Any, Self

from kahanmaps.errors import InputError, KahanmapsError, is_of_the_machine, quoted
from kahanmaps.experiments.locks import (
    Lock,
    LockedByAnother,
    NotOurs,
    is_mounted,
    journal_for,
    require_journal,
    require_plain,
)
from kahanmaps.experiments.schema import APPLICATION_ID, FORMAT, SCHEMA, UPGRADE
from kahanmaps.whole_files import resolved

_BUSY_SECONDS = 30.0
_SMALLEST = 512  # bytes, the smallest page that SQLite has
# In KiB. The index of a million keys, hit at random while they are planned, is to fit into the large one; otherwise
# every key costs a page written.
_CACHE, _LARGE_CACHE = 16 << 10, 128 << 10
_LARGEST_JOURNAL = 64 << 20  # bytes: what is kept of the journal of a large plan


_DEEPEST = 100  # brackets within brackets of a text that is read: what walks through it is recursive


class StoreError(InputError):
    """A database that cannot be used, or not in this way: the message says what to do."""


class Unavailable(KahanmapsError, OSError):
    """A database that cannot be used just now, by nobody's mistake: the disk is full or broken, the file is gone."""


class Damaged(StoreError):
    """A database in which something cannot be what was written."""


class Database:
    """An SQLite file of ours. Make one with `Database.open`, and close it.

    `name` is the file as it was given, for messages; `path` is resolved.
    """

    def __init__(self, path: str | os.PathLike[str], readonly: bool) -> None:
        self.name = os.fspath(path)
        # Resolved, or two names of one file would have two locks.
        try:
            self.path = resolved(self.name)
        except OSError as error:
            raise self._unopened(error) from error
        self.format = 0  # unknown before it is open
        self._is_readonly = readonly
        self._lock = Lock(Path(f"{self.path}.lock"))
        self._connection: sqlite3.Connection | None = None
        self._process = os.getpid()
        self._identity: tuple[int, int] | None = None

    @classmethod
    def open(
        cls, path: str | os.PathLike[str], create: bool = False, readonly: bool = False, is_checked: bool = True
    ) -> Self:
        """The database in this file; `create` makes it if it is not there. Open for writing, it has the lock.

        `is_checked`: damaged pages, and indexes that do not say what is in the tables, are `Damaged` at once.
        """
        if create and readonly:
            raise ValueError("a database opened for reading only cannot be created")
        database = cls(path, readonly)
        try:
            database._open(create)
            if is_checked and (problems := database.problems(1)):
                raise database.damaged(problems[0])
        except BaseException:
            database.close()
            raise
        return database

    def lock(self) -> None:
        """Become the one that writes, until `close`; opening for writing does it. Another writer: StoreError."""
        try:
            self._lock.take()
        except LockedByAnother as holder:
            raise StoreError(f"another batch is writing to {self.name} ({holder}): wait for it, or end it") from None
        except NotOurs as found:
            raise self._in_the_way(found) from None
        except OSError as error:
            raise (Unavailable if is_of_the_machine(error) else StoreError)(
                f"{self.name} cannot be locked for writing ({self._lock.path}: {error.strerror}): change the "
                "permissions of its folder, or work on a copy elsewhere"
            ) from error

    def close(self) -> None:
        """Leave one complete file behind. May be called twice."""
        if os.getpid() != self._process:
            return  # a forked child has left a `with` of its parent
        try:
            # Under a new name the file may belong to somebody else by now; SQLite itself then leaves it alone.
            is_mine = not self._is_readonly and self._lock.is_held and self._identity == self._named()
            if self._connection is not None and is_mine:
                # Out of WAL, so that the file opens where nothing can be written. A reader may hold on to it, or the
                # disk may be full: then it stays as it is, complete together with its journal.
                with suppress(sqlite3.Error):
                    self._connection.execute("PRAGMA busy_timeout = 0")
                    self._connection.execute("PRAGMA journal_mode = DELETE")
            with suppress(sqlite3.Error):
                self._disconnect()
        finally:
            self._connection = None
            self._lock.free()

    # Reading and writing

    def fetch(self, sql: str, values: Sequence[Any] = (), is_lenient: bool = False) -> list[Any]:
        """All rows at once: a statement half read would keep its snapshot, and the writer from tidying its journal.

        `is_lenient`: text that is not UTF-8 comes with its bytes replaced, for who finds out by other means that it is
        not what was written.
        """
        with self._errors():
            self._opened.text_factory = (lambda data: data.decode(errors="replace")) if is_lenient else str
            return self.execute(sql, values).fetchall()

    def chunks(
        self, table: str, id: str, columns: str, size: int, join: str = "", is_lenient: bool = True
    ) -> Iterator[list[Any]]:
        """Rows of the table `r` with their numbers, some at a time, in their order."""
        last = 0
        sql = f"SELECT r.{id}, {columns} FROM {table} AS r {join} WHERE r.{id} > ? ORDER BY r.{id} LIMIT ?"
        while rows := self.fetch(sql, (last, size), is_lenient=is_lenient):
            for id_of_row, *_ in rows:
                # Not so where pages are damaged, and then it would go round for ever.
                self.require(id_of_row > last, f"the table {table}, number", id_of_row, f"more than {last}")
                last = id_of_row
            yield rows

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """What is executed in it is done completely or not at all."""
        with self._errors():
            connection = self._opened
            self._require_name()
            connection.execute("BEGIN IMMEDIATE")
            try:
                yield
                connection.execute("COMMIT")
                self._require_name()
            except BaseException:
                # After some errors SQLite has rolled back by itself.
                if connection.in_transaction:
                    with suppress(sqlite3.Error):
                        connection.execute("ROLLBACK")
                raise

    @contextmanager
    def large_cache(self) -> Iterator[None]:
        """Memory for a transaction that adds many tasks."""
        with self._errors():
            self.execute(f"PRAGMA cache_size = -{_LARGE_CACHE}")
        try:
            yield
        finally:
            with suppress(sqlite3.Error):
                self.execute(f"PRAGMA cache_size = -{_CACHE}")

    def execute(self, sql: str, values: Sequence[Any] = ()) -> sqlite3.Cursor:
        """One statement of a transaction."""
        return self._opened.execute(sql, values)

    def execute_many(self, sql: str, rows: Iterable[Sequence[Any]]) -> int:
        """One statement of a transaction for each of these rows; how many rows of the table it changed."""
        return self._opened.executemany(sql, rows).rowcount

    def _require_name(self) -> None:
        """Refuse to go on with a file that nobody will find. SQLite itself does not mind."""
        if self._identity is not None and self._identity != self._named():
            raise Unavailable(
                f"{self.name} has been removed or replaced while it was being written to: what was written last is "
                "not in the file of this name; leave it there, and run the batch again"
            )

    def _named(self) -> tuple[int, int] | None:
        """Which file has the name now; None if there is none."""
        try:
            found = os.stat(self.path)
        except OSError:
            return None
        return found.st_dev, found.st_ino

    def must_write(self) -> None:
        """Refuse if it was opened for reading only."""
        if self._is_readonly:
            raise StoreError(f"{self.name} has been opened for reading only: open it for writing")

    def table(self, text: Any, what: str) -> dict[str, Any]:
        """The dict that a text in the file spells, which is JSON unless it is damaged; `what` names it in messages."""
        if not isinstance(text, str):
            raise self.damaged(f"{what}: found {shown(text)}, expected text")
        try:
            found = _DECODER.decode(text)
        except (ValueError, RecursionError) as error:
            raise self.damaged(f"{what} is not JSON: {quoted(str(error), 100)}") from error
        if not isinstance(found, dict) or _is_too_deep(text, found):
            raise self.damaged(f"{what}: found {quoted(text)}, expected a table in JSON")
        return found

    def damaged(self, what: str) -> Damaged:
        """The error that says what in the file cannot be what was written, and what to do."""
        what = " ".join(what.split())
        return Damaged(
            f"{self.name} is damaged ({what}): take a copy from before; `kahanmaps batch check --db "
            f"{shlex.quote(self.name)}` says what is whole, and `batch run` does damaged results again"
        )

    def require(self, is_sound: bool, what: str, found: Any, expected: str) -> None:
        """Raise `Damaged` unless what was found somewhere in the file is what it can be."""
        if not is_sound:
            raise self.damaged(f"{what}: found {shown(found)}, expected {expected}")

    # Opening

    def _open(self, create: bool) -> None:
        try:
            self._look_at_the_file(create)
        except OSError as error:
            raise self._unopened(error) from error
        with self._errors():
            if self._is_readonly:
                self._open_to_read()
            else:
                self._open_to_write(create)

    def _look_at_the_file(self, create: bool) -> None:
        """Refuse what needs no SQLite to see. The file is not opened: closing it would drop SQLite's POSIX locks."""
        if self.path.is_dir():
            raise StoreError(f"{self.name} is a folder: name a file in it, such as {self.name}/results.db")
        if not self.path.exists():
            if not create:
                raise StoreError(f"there is no database {self.name}: check the name, or run the batch to make it")
            if not self.path.parent.is_dir():
                raise StoreError(f"{self.name} cannot be made: there is no folder {self.path.parent}; make it first")
        elif not self.path.is_file():
            raise StoreError(f"{self.name} is a pipe or a device, expected a file: check the name")
        elif (names := self.path.stat().st_nlink) > 1:
            # Lock and journal lie beside a name: whoever comes by another one sees neither.
            raise StoreError(
                f"{self.name} has {names} names (hard links), and its journal lies beside only one of them: remove the "
                f"other names, or make a copy of its own (cp {self.name} copy.db) and use that"
            )
        elif is_mounted(self.path):
            raise StoreError(
                f"{self.name} is mounted by itself, and its journal would not lie beside it where it comes from: "
                "mount its folder instead"
            )
        elif not os.access(self.path, os.R_OK):
            raise StoreError(f"{self.name} may not be read: change the permissions of the file")
        elif 0 < self.path.stat().st_size < _SMALLEST:
            # SQLite takes a file of one byte for an empty one, and would write over it.
            raise StoreError(self._foreign())
        elif not self._is_readonly and not os.access(self.path, os.W_OK):
            raise StoreError(
                f"{self.name} may not be written to: change the permissions of the file, or work on a copy"
            )
        # Of -shm the bytes are not looked at: to close a descriptor of it would drop locks, as of the file itself.
        for end, require in (("-wal", require_journal), ("-shm", require_plain), ("-journal", require_journal)):
            try:
                require(Path(f"{self.path}{end}"))
            except NotOurs as found:
                raise self._in_the_way(found) from None
        if not self._is_readonly and not os.access(self.path.parent, os.W_OK | os.X_OK):
            # SQLite needs more than the file: its journal lies beside it.
            raise StoreError(
                f"{self.name} cannot be written to: the folder {self.path.parent} may not be written to; "
                "change its permissions, or work on a copy elsewhere"
            )

    def _open_to_read(self) -> None:
        # Not mode=ro: the journal of a writer that was killed has to be played back, and that writes.
        self._connect("mode=rw")
        try:
            self._check_format()
        except sqlite3.OperationalError as error:
            if _primary_code(error) not in (sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY) or self._has_journal():
                raise
            # Marked as WAL, because a reader was there when the writer left, and now where SQLite can make no file
            # beside it. No journal: the file is complete, and nobody writes where nobody may.
            self._disconnect()
            self._connect("mode=ro&immutable=1")
            self._check_format()
        self.execute("PRAGMA query_only = ON")

    def _has_journal(self) -> bool:
        beside = [Path(f"{self.path}{end}") for end in ("-wal", "-journal")]
        return any(path.exists() and path.stat().st_size > 0 for path in beside)

    def _open_to_write(self, create: bool) -> None:
        self._connect("mode=rwc" if create else "mode=rw")
        is_empty = self._check_format(may_be_empty=create)  # before the lock: no lock file beside what is not ours
        self.lock()
        self._identity = self._named()
        # Under the lock once more: somebody else may have been making it.
        is_empty = is_empty and self._check_format(may_be_empty=True)
        self.execute(f"PRAGMA cache_size = -{_CACHE}")
        self.execute(f"PRAGMA journal_size_limit = {_LARGEST_JOURNAL}")
        wanted = journal_for(self.path)
        got = self.execute(f"PRAGMA journal_mode = {wanted}").fetchone()[0]
        # WAL is whole after a loss of power as it is, only the last commits may be lost; a rollback journal is not.
        self.execute(f"PRAGMA synchronous = {'NORMAL' if got == 'wal' else 'FULL'}")
        if is_empty:
            with self.transaction():
                for statement in SCHEMA.split(";"):  # executescript would commit
                    self.execute(statement)
            self._check_format()

    def _connect(self, how: str) -> None:
        self._connection = sqlite3.connect(
            f"{self.path.as_uri()}?{how}", timeout=_BUSY_SECONDS, isolation_level=None, uri=True
        )

    def _disconnect(self) -> None:
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    @property
    def _opened(self) -> sqlite3.Connection:
        if self._connection is None:
            raise StoreError(f"{self.name} has been closed: open it again")
        return self._connection

    def _check_format(self, may_be_empty: bool = False) -> bool:
        """Refuse what is not ours; whether it is empty, if it may be."""
        # First of all the schema: pragmas alone are answered for files that SQLite cannot read.
        asked = ("SELECT count(*) FROM sqlite_master", "PRAGMA application_id", "PRAGMA user_version")
        tables, application, version = (self.execute(sql).fetchone()[0] for sql in asked)
        if not tables and not application and not version:
            if may_be_empty:
                return True
            raise StoreError(f"{self.name} is empty and not a database of results: check the name")
        if application != APPLICATION_ID:
            raise StoreError(f"{self.name} is an SQLite database of another program, not one of results: left alone")
        if not 1 <= version <= FORMAT:
            raise StoreError(
                f"{self.name} was written by format {version} of kahanmaps databases, this version reads formats 1 to "
                f"{FORMAT}: use the kahanmaps that wrote it, or begin another database"
            )
        self.format = version
        return False

    def problems(self, most: int) -> list[str]:
        """What is wrong with the pages of the file, and where an index does not say what is in its table."""
        found = [row[0] for row in self.fetch(f"PRAGMA integrity_check({most})")]
        return [] if found == ["ok"] else found

    @contextmanager
    def upgrade(self) -> Iterator[None]:
        """A transaction in which the tables get the form of the latest format, and whoever asks for it fills them."""
        with self.large_cache(), self.transaction():
            for statement in UPGRADE.split(";"):
                self.execute(statement)
            yield
        self.format = FORMAT

    # Errors

    @contextmanager
    def _errors(self) -> Iterator[None]:
        """The one place where errors of SQLite become sentences."""
        try:
            yield
        except (sqlite3.Error, UnicodeDecodeError) as error:
            code = _primary_code(error)
            # Our own statements are wrong only where a table or a column is gone; and what has no code comes from
            # Python, where a text or a name is not UTF-8.
            is_refused = isinstance(error, (sqlite3.OperationalError, UnicodeDecodeError))
            if code in ((sqlite3.SQLITE_ERROR, None) if is_refused else _OF_DAMAGE):
                raise self.damaged(quoted(str(error), 100)) from error
            raise (Unavailable if code in _OF_THE_MACHINE else StoreError)(self._sentence(error)) from error

    def _unopened(self, error: OSError) -> KahanmapsError:
        if is_of_the_machine(error):
            return Unavailable(f"{self.name} cannot be opened ({error.strerror})")
        return StoreError(f"{self.name} cannot be opened ({error.strerror or error}): check the name")

    def _in_the_way(self, found: NotOurs) -> StoreError:
        return StoreError(f"{self.name} cannot be used: {found}; look at it, and remove it or move it away")

    def _sentence(self, error: Exception) -> str:
        match _primary_code(error):
            case sqlite3.SQLITE_NOTADB:
                return self._foreign()
            case sqlite3.SQLITE_FULL:
                return f"{self.name} cannot grow: {error}; what was stored before is safe, make room and run it again"
            case sqlite3.SQLITE_IOERR:
                return (
                    f"{self.name} cannot be read or written: {error}; what was stored before is safe, look after the "
                    "disk, its room and its quota, and run it again"
                )
            case sqlite3.SQLITE_READONLY | sqlite3.SQLITE_PERM if not self._is_readonly:
                return (
                    f"{self.name} may not be written to ({error}): change the permissions of the file and of its "
                    "folder, or work on a copy"
                )
            case sqlite3.SQLITE_CANTOPEN | sqlite3.SQLITE_READONLY | sqlite3.SQLITE_PERM:
                return (
                    f"{self.name} cannot be opened ({error}): the file must be readable, and if its writer was killed "
                    f"(there is a file {self.path.name}-wal or {self.path.name}-journal), file and folder must be "
                    "writable to finish what it left; copy all of them to a folder that is"
                )
            case sqlite3.SQLITE_BUSY | sqlite3.SQLITE_LOCKED:
                return (
                    f"{self.name} has been locked by another program for {_BUSY_SECONDS:.0f} seconds: end it, then "
                    "run it again"
                )
            case _:
                return f"{self.name}: {error}"

    def _foreign(self) -> str:
        return f"{self.name} is not an SQLite database: check the name"


_OF_DAMAGE = {sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_CONSTRAINT, sqlite3.SQLITE_MISMATCH}
_OF_THE_MACHINE = {sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR, sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED}


def _refuse(constant: str) -> Any:
    raise ValueError(f"found {constant}")


def _finite(text: str) -> float:
    found = float(text)
    return found if isfinite(found) else _refuse(text)


_DECODER = json.JSONDecoder(parse_constant=_refuse, parse_float=_finite)  # what `canonical` writes, and no more


def _is_too_deep(text: str, found: Any) -> bool:
    """Whether brackets stand in brackets, too many to walk through; few brackets are not looked at."""
    if text.count("{") + text.count("[") <= _DEEPEST:
        return False
    level = [found]
    for _ in range(_DEEPEST):
        level = [
            inside
            for one in level
            for inside in (one.values() if isinstance(one, dict) else one)
            if isinstance(inside, (dict, list))
        ]
    return bool(level)


def shown(value: Any) -> str:
    """A value of a cell for a message."""
    return "nothing" if value is None else quoted(value) if isinstance(value, str) else quoted(repr(value)).strip("\"'")


def _primary_code(error: Exception) -> int | None:
    """13 for "disk is full" and so on; None if it comes from Python's module and not from SQLite."""
    code: int | None = getattr(error, "sqlite_errorcode", None)
    return None if code is None else code & 0xFF
