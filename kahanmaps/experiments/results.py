"""The results in a database: the latest of every task, and how a record lies in the columns of a row."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from kahanmaps.experiments.database import Database, shown
from kahanmaps.experiments.records import Outcome, Record, canonical

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
RECORD = ", ".join(f"r.{column}" for column in _COLUMNS)  # what is selected from `result AS r` for `record_of`
_PUT = f"""
    INSERT INTO result (task, attempts, {", ".join(_COLUMNS)}) VALUES (?, ?, {", ".join("?" * len(_COLUMNS))})
    ON CONFLICT (task) DO UPDATE SET attempts = attempts + excluded.attempts,
    {", ".join(f"{column} = excluded.{column}" for column in _COLUMNS)}"""


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


def find_result(database: Database, key: str) -> tuple[Any, ...] | None:
    """Task, outcome, result and verdict; None if there is no such task."""
    found: tuple[Any, ...] | None = database.execute(
        "SELECT t.id, r.outcome, r.result, r.verdict FROM task AS t LEFT JOIN result AS r ON r.task = t.id "
        "WHERE t.key = ?",
        (key,),
    ).fetchone()
    return found


def put_result(database: Database, task: int, attempts: int, row: tuple[Any, ...]) -> None:
    """Write a result over the one there may be; its attempts come on top."""
    database.execute(_PUT, (task, attempts, *row))


def row_of(record: Record) -> tuple[Any, ...]:
    """The record as it lies in a row; what JSON cannot hold is a ValueError."""
    if not math.isfinite(record.seconds):
        raise ValueError(f"a record cannot have taken {record.seconds} seconds")
    return (
        str(record.outcome),
        None if record.result is None else canonical(dict(record.result)),
        None if record.verdict is None else _encodable(record.verdict),
        _encodable(record.message),
        _encodable(record.stderr),
        record.seconds,
        record.peak_memory,
        record.host,
        canonical(dict(record.versions)),
        record.finished,
    )


def record_of(database: Database, key: str, row: Sequence[Any]) -> Record | None:
    """The record that lies in a row like this; None if the task has no result."""
    if all(value is None for value in row):
        return None
    known = dict(zip(_COLUMNS, row, strict=True))
    what = f"the record of task {key}"
    for column, (is_sound, expected) in _SOUND.items():
        if not is_sound(known[column]):
            raise database.damaged(f"{what}, {column}: found {shown(known[column])}, expected {expected}")
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
