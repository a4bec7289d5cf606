"""The results in a database: the latest of every task, and how a record lies in the columns of a row."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from kahanmaps.experiments.database import Database
from kahanmaps.experiments.records import Outcome, Record, canonical

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
    outcome, result, verdict, message, stderr, seconds, peak_memory, host, versions, finished = row
    if outcome is None:
        return None
    return Record(
        key=key,
        outcome=Outcome(outcome),
        result=None if result is None else database.plain(result),
        verdict=verdict,
        message=message,
        stderr=stderr,
        seconds=seconds,
        peak_memory=peak_memory,
        host=host,
        versions=database.plain(versions),
        finished=finished,
    )


def _encodable(text: str) -> str:
    """What a child printed may have been no text at all: lone surrogates are no UTF-8, so they are written out."""
    return text.encode(errors="backslashreplace").decode()
