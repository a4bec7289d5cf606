"""Whether a database holds what was written: pages are seen to by SQLite, texts by digests, rows by checksums.

Everything that reads does the same with what it reads. Here all is read, and what is damaged is named and not an error.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from kahanmaps.experiments import tables
from kahanmaps.experiments.database import Damaged, Database
from kahanmaps.experiments.records import digest

_PROBLEMS = 20  # of the pages of a file, told at most


@dataclass(frozen=True)
class Checked:
    """What is whole in a database: `whole` counts it, and `damaged` names what is not, both by kind.

    `pages` is what is wrong with the file itself: what is counted is then what could still be read. Without
    `has_checksums` (format 1) only the forms of results were looked at.
    """

    pages: tuple[str, ...]
    whole: dict[str, int]
    damaged: dict[str, tuple[str, ...]]
    has_checksums: bool

    @property
    def is_whole(self) -> bool:
        """Whether nothing is damaged."""
        return not self.pages and not any(self.damaged.values())


def check(database: Database) -> Checked:
    """Read all of it; see `Store.check`."""
    try:
        pages = database.problems(_PROBLEMS)
    except Damaged as error:
        pages = [str(error)]
    whole: dict[str, int] = {}
    damaged: dict[str, tuple[str, ...]] = {}
    for kind, rows in {
        "experiments": tables.sound_experiments(database),
        "tasks": _texts(database, "task", "key"),
        "documents": _texts(database, "document", "digest"),
        "results": ((key, is_sound) for _, key, is_sound in _results(database)),
    }.items():
        names = []
        whole[kind] = 0
        try:
            for name, is_sound in rows:
                whole[kind] += is_sound
                if not is_sound:
                    names.append(str(name))
        except Damaged:  # a page: the rest of this table cannot be reached
            names.append("the rest")
        damaged[kind] = tuple(names)
    return Checked(tuple(pages), whole, damaged, database.format > 1)


def forget_damaged(database: Database) -> list[str]:
    """Remove damaged results; see `Store.forget_damaged`."""
    found = [(task, str(key)) for task, key, is_sound in _results(database) if not is_sound]
    with database.transaction():
        database.execute_many("DELETE FROM result WHERE task = ?", [(task,) for task, _ in found])
    return [key for _, key in found]


def add_checksums(database: Database) -> None:
    """Bring a file to the latest format. What cannot be what was written stays without a checksum, and is damaged."""
    with database.upgrade():
        for (experiment,) in database.fetch("SELECT id FROM experiment"):
            tables.seal(database, experiment)
        for task, key, row in _rows(database):
            if _can_be(database, key, row):
                tables.put_result(database, task, key, row[-2], row)


def _rows(database: Database) -> Iterator[tuple[int, Any, list[Any]]]:
    """The task of each result, its key, and the row."""
    columns, join = f"t.key, {tables.record_columns(database)}", "LEFT JOIN task AS t ON t.id = r.task"
    for rows in database.chunks("result", "task", columns, tables.RESULT_CHUNK, join):
        for task, key, *row in rows:
            yield task, key, row


def _results(database: Database) -> Iterator[tuple[int, Any, bool]]:
    """The task of each result, its key, and whether the result is sound."""
    for task, key, row in _rows(database):
        yield task, key, tables.is_as_written(key, row) if database.format > 1 else _can_be(database, key, row)


def _can_be(database: Database, key: Any, row: list[Any]) -> bool:
    try:
        return isinstance(key, str) and tables.record_of(database, key, row) is not None
    except Damaged:
        return False


def _texts(database: Database, table: str, name: str) -> Iterator[tuple[Any, bool]]:
    """The name of each text, and whether it is the digest of the text."""
    for rows in database.chunks(table, "rowid", f"r.{name}, r.text", tables.RESULT_CHUNK):
        for _, found, text in rows:
            yield found, isinstance(text, str) and found == digest(text)
