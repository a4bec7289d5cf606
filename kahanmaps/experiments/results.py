"""The results in a database: the latest of every task, and how a record lies in the columns of a row."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from kahanmaps.experiments.database import Database, shown
from kahanmaps.experiments.records import Outcome, Record, canonical, checksum, has_checksum

_LONGEST_VERDICT = 200
RESULT_CHUNK = 50  # rows with their results, which may be megabytes

_COLUMNS = (
    "outcome",
    "result",
    "verdict",
    "message",
    "stderr",
    "seconds",
    "peak_memory",
    "host",
    "versions",
    "finished",
)
ATTEMPTS = len(_COLUMNS)  # where the number of attempts stands in a row
_PUT = f"""
    INSERT OR REPLACE INTO result (task, {", ".join(_COLUMNS)}, attempts, checksum)
    VALUES (?, {", ".join("?" * len(_COLUMNS))}, ?, ?)"""


def record_columns(database: Database) -> str:
    """What is selected from `result AS r` for `record_of`: the record, the attempts at it, and a checksum."""
    last = "r.checksum" if database.format > 1 else "NULL"
    return ", ".join([*(f"r.{column}" for column in _COLUMNS), "r.attempts", last])


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def is_a_verdict(value: Any) -> bool:
    """Whether it can be the verdict of a task, or that there is none."""
    return value is None or (isinstance(value, str) and len(value) <= _LONGEST_VERDICT)


def is_a_time(value: Any) -> bool:
    """Whether it can be how long a task took, in seconds."""
    return isinstance(value, int | float) and 0 <= value < math.inf


_OUTCOMES = frozenset(Outcome)
# What a cell of a row can hold: SQLite keeps anything in any column.
_TEXT = (_is_text, "text")
_SOUND: dict[str, tuple[Callable[[Any], bool], str]] = {
    "outcome": (lambda value: value in _OUTCOMES, f"one of {', '.join(Outcome)}"),
    "verdict": (is_a_verdict, "a word or nothing"),
    **dict.fromkeys(("message", "stderr", "host", "finished"), _TEXT),
    "seconds": (is_a_time, "a number of seconds"),
    "peak_memory": (lambda value: value is None or isinstance(value, int), "a number of bytes or nothing"),
}


def find_result(database: Database, key: str) -> tuple[int, list[Any]] | None:
    """The task and the row of its result, all None if it has none; None if there is no such task."""
    found = database.execute(
        f"SELECT t.id, {record_columns(database)} FROM task AS t LEFT JOIN result AS r ON r.task = t.id "
        "WHERE t.key = ?",
        (key,),
    ).fetchone()
    if found is None:
        return None
    task, *row = found
    record_of(database, key, row)  # nothing is said about a damaged one, and nothing written over it
    return task, row


def put_result(database: Database, task: int, key: str, attempts: int, row: Sequence[Any]) -> None:
    """Write a row, whose attempts and checksum do not count, over the result there may be."""
    cells = (*row[:ATTEMPTS], attempts)
    database.execute(_PUT, (task, *cells, checksum([key, *cells])))


def is_as_written(key: Any, row: Sequence[Any]) -> bool:
    """Whether the row has its checksum."""
    return has_checksum([key, *row[:-1]], row[-1])


def row_of(record: Record) -> tuple[Any, ...]:
    """The record as it lies in a row, without attempts; what JSON cannot hold is a ValueError."""
    if not math.isfinite(record.seconds):
        raise ValueError(f"a record cannot have taken {record.seconds} seconds")
    return (
        str(record.outcome),
        None if record.result is None else canonical(dict(record.result)),
        None if record.verdict is None else _encodable(record.verdict),
        _encodable(record.message),
        _encodable(record.stderr),
        float(record.seconds),
        record.peak_memory,
        record.host,
        canonical(dict(record.versions)),
        record.finished,
    )


def record_of(database: Database, key: str, row: Sequence[Any]) -> Record | None:
    """The record that lies in a row like this; None if the task has no result."""
    if all(value is None for value in row):
        return None
    known = dict(zip(_COLUMNS, row[:ATTEMPTS], strict=True))
    what = f"the record of task {key}"
    for column, (is_sound, expected) in _SOUND.items():
        if not is_sound(known[column]):
            raise database.damaged(f"{what}, {column}: found {shown(known[column])}, expected {expected}")
    database.require(isinstance(row[ATTEMPTS], int), f"{what}, attempts", row[ATTEMPTS], "a number")
    if database.format > 1 and not is_as_written(key, row):
        raise database.damaged(f"{what}: it has not its checksum")
    outcome = Outcome(known["outcome"])
    is_ok, has_result = outcome is Outcome.OK, known["result"] is not None
    if is_ok is not has_result:
        raise database.damaged(f"{what}: the outcome is {outcome}, and there is {'a' if has_result else 'no'} result")
    known["outcome"] = outcome
    known["result"] = database.table(known["result"], f"{what}, result") if is_ok else None
    known["versions"] = database.table(known["versions"], f"{what}, versions")
    if not all(isinstance(version, str) for version in known["versions"].values()):
        raise database.damaged(f"{what}, versions: expected texts")
    return Record(key=key, **known)


def _encodable(text: str) -> str:
    """What a child printed may have been no text at all: lone surrogates are no UTF-8, so they are written out."""
    return text.encode(errors="backslashreplace").decode()
