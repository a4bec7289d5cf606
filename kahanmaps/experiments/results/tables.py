"""What lies in the tables of a database: plans, with the tasks and documents they need, and the results of tasks.

A plan says which task comes where in which experiment; it is written as a whole and read in stretches. A result is the
latest record of its task. Whatever writes here is part of a transaction that the caller has begun.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import islice
from operator import index
from typing import Any

from kahanmaps.errors import quoted
from kahanmaps.experiments.results.database import Database, StoreError
from kahanmaps.experiments.results.records import (
    Limits,
    Outcome,
    Record,
    Task,
    canonical,
    digest,
    encodable,
)
from kahanmaps.experiments.results.schema import SKIPPED

PLAN_CHUNK = 1000  # rows of the plan that one read takes: they are short
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
    INSERT OR REPLACE INTO result (task, {", ".join(_COLUMNS)}, attempts)
    VALUES (?, {", ".join("?" * len(_COLUMNS))}, ?)"""


@dataclass(frozen=True)
class Planned:
    """What planning did. `total` counts rows of the plan, everything else different tasks.

    `known` of them were in the store already, `new_tasks` were not; `dropped` were in the plan that this one replaces
    and are no longer. `is_resumed`: the same definition had been planned before, and nothing was done.
    """

    total: int
    known: int
    new_tasks: int
    dropped: int
    is_resumed: bool = False


@dataclass(frozen=True)
class Chosen:
    """An experiment that was asked for; `tasks` different ones, `offset` rows of the plan before its own."""

    id: int
    name: str
    limits: Limits
    total: int
    tasks: int
    offset: int


# Plans read


def choose(database: Database, experiments: Sequence[str] | None) -> list[Chosen]:
    """These experiments, or all, in their order in the database."""
    rows = database.fetch(
        "SELECT id, name, limits, total, tasks, (SELECT max(number) + 1 FROM plan WHERE experiment = e.id) "
        "FROM experiment AS e ORDER BY id"
    )
    if experiments is not None:
        known = [row[1] for row in rows]
        for name in experiments:
            if name not in known:
                raise StoreError(
                    f"{database.name} has no experiment {name}: it has {', '.join(known) or 'none at all'}"
                )
    chosen: list[Chosen] = []
    offset = 0
    for id, name, limits, total, tasks, planned in rows:
        if experiments is None or name in experiments:
            with database.making(f"the experiment {quoted(name)}"):
                if total != (planned or 0):
                    raise ValueError(f"{total} tasks are said to be planned, and {planned or 0} are")
                chosen.append(Chosen(id, name, Limits(**database.table(limits)), total, index(tasks), offset))
                offset += total
    return chosen


def stretches(
    database: Database, sql: str, experiment: Chosen, size: int, numbers: tuple[int, ...] = ()
) -> Iterator[list[Any]]:
    """What `sql` finds in each stretch of the plan: a bounded number of rows is looked at, found or not."""
    for first in range(0, experiment.total, size):
        yield database.fetch(sql, (experiment.id, first, first + size - 1, *numbers))


def definition_of(database: Database, experiment: Chosen) -> str:
    """What an experiment was made from."""
    ((text,),) = database.fetch("SELECT definition FROM experiment WHERE id = ?", (experiment.id,))
    return str(text)


def task_of(database: Database, key: str, text: str) -> Task:
    """The task with this key and text."""
    with database.making(f"the task {key}"):
        return Task.from_text(text)


def document_of(database: Database, name: str) -> str:
    """The text of the document with this digest."""
    rows = database.fetch("SELECT text FROM document WHERE digest = ?", (name,))
    if not rows:
        raise StoreError(f"{database.name} has no document {name}: plan the experiment that needs it again")
    return str(rows[0][0])


# Plans written


def replace_plan(
    database: Database,
    experiment: str,
    definition: str,
    limits: Limits,
    tasks: Iterable[Task],
    documents: Mapping[str, str],
) -> Planned:
    """Plan an experiment, new or with another definition than before; see `Store.plan`."""
    limits_text = canonical(asdict(limits))
    before = database.execute(
        "SELECT id, digest, total, tasks FROM experiment WHERE name = ?", (experiment,)
    ).fetchone()
    if before is not None and before[1] == digest(definition):
        database.execute("UPDATE experiment SET limits = ? WHERE id = ?", (limits_text, before[0]))
        return Planned(before[2], before[3], 0, 0, is_resumed=True)
    id = add_experiment(database, experiment) if before is None else before[0]
    database.execute("CREATE TEMP TABLE earlier (task INTEGER PRIMARY KEY)")
    database.execute("INSERT INTO earlier SELECT DISTINCT task FROM plan WHERE experiment = ?", (id,))
    database.execute("DELETE FROM plan WHERE experiment = ?", (id,))
    total, different, new = fill_plan(database, id, definition, limits_text, ((task.key, task.text) for task in tasks))
    for name, text in documents.items():
        if name != digest(text):
            raise StoreError(f"the document {name} is not the one with this digest, which is {digest(text)}")
        add_document(database, name, text)
    dropped = database.execute(
        "SELECT count(*) FROM earlier AS e "
        "WHERE NOT EXISTS (SELECT 1 FROM plan WHERE task = e.task AND experiment = ?)",
        (id,),
    ).fetchone()[0]
    database.execute(
        "DELETE FROM task WHERE id IN (SELECT task FROM earlier) "
        "AND NOT EXISTS (SELECT 1 FROM plan WHERE plan.task = task.id) "
        "AND NOT EXISTS (SELECT 1 FROM result WHERE result.task = task.id)"
    )
    database.execute("DROP TABLE earlier")
    return Planned(total, different - new, new, dropped)


def put_skipped(database: Database, experiment: str, skipped: Iterable[tuple[str, str]]) -> None:
    """Set the systems that a planned experiment leaves out, and why."""
    database.execute(SKIPPED)  # databases of earlier versions lack the table
    id = database.execute("SELECT id FROM experiment WHERE name = ?", (experiment,)).fetchone()[0]
    database.execute("DELETE FROM skipped WHERE experiment = ?", (id,))
    rows = ((id, system, reason) for system, reason in skipped)
    database.execute_many("INSERT OR REPLACE INTO skipped VALUES (?, ?, ?)", rows)


def skipped_of(database: Database, id: int) -> list[tuple[str, str]]:
    """The systems that an experiment leaves out, and why."""
    if not database.fetch("SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = 'skipped'"):
        return []
    rows = database.fetch("SELECT system, reason FROM skipped WHERE experiment = ? ORDER BY system", (id,))
    return [(system, reason) for system, reason in rows]


def add_experiment(database: Database, name: str) -> int:
    """Its number; `fill_plan` has to fill in the rest."""
    made = database.execute(
        "INSERT INTO experiment (name, definition, digest, limits, total, tasks) VALUES (?, '', '', '', 0, 0)",
        (name,),
    )
    assert made.lastrowid is not None
    return made.lastrowid


def fill_plan(
    database: Database, experiment: int, definition: str, limits: str, tasks: Iterable[tuple[str, str]]
) -> tuple[int, int, int]:
    """Write keys and texts to an empty plan: how many rows it has, how many different tasks, how many of them new."""
    total = new = 0
    tasks = iter(tasks)
    while batch := list(islice(tasks, PLAN_CHUNK)):
        new += add_tasks(database, batch)
        database.execute_many(
            "INSERT INTO plan SELECT ?, ?, id FROM task WHERE key = ?",
            [(experiment, number, key) for number, (key, _) in enumerate(batch, total)],
        )
        total += len(batch)
    different: int = database.execute(
        "SELECT count(*) FROM plan AS p WHERE experiment = ? AND NOT EXISTS "
        "(SELECT 1 FROM plan AS q WHERE q.task = p.task AND q.experiment = p.experiment AND q.number < p.number)",
        (experiment,),
    ).fetchone()[0]
    database.execute(
        "UPDATE experiment SET definition = ?, digest = ?, limits = ?, total = ?, tasks = ? WHERE id = ?",
        (definition, digest(definition), limits, total, different, experiment),
    )
    return total, different, new


def add_tasks(database: Database, tasks: Sequence[tuple[str, str]]) -> int:
    """How many were not there."""
    return database.execute_many("INSERT INTO task (key, text) VALUES (?, ?) ON CONFLICT (key) DO NOTHING", tasks)


def add_document(database: Database, name: str, text: str) -> None:
    """Keep a document; nothing if it is there."""
    database.execute("INSERT INTO document VALUES (?, ?) ON CONFLICT (digest) DO NOTHING", (name, text))


# Results


# What is selected from `result AS r` for `record_of`: the record, and the attempts at it.
RECORD_COLUMNS = ", ".join(f"r.{column}" for column in (*_COLUMNS, "attempts"))


def find_result(database: Database, key: str) -> tuple[int, list[Any]] | None:
    """The task and the row of its result, all None if it has none; None if there is no such task."""
    found = database.execute(
        f"SELECT t.id, {RECORD_COLUMNS} FROM task AS t LEFT JOIN result AS r ON r.task = t.id WHERE t.key = ?", (key,)
    ).fetchone()
    return None if found is None else (found[0], list(found[1:]))


def put_result(database: Database, task: int, attempts: int, row: Sequence[Any]) -> None:
    """Write a row, whose attempts do not count, over the result there may be."""
    database.execute(_PUT, (task, *row[:ATTEMPTS], attempts))


def row_of(record: Record) -> tuple[Any, ...]:
    """The record as it lies in a row, without attempts; what JSON cannot hold is a ValueError."""
    if not math.isfinite(record.seconds):
        raise ValueError(f"a record cannot have taken {record.seconds} seconds")
    return (
        str(record.outcome),
        None if record.result is None else canonical(dict(record.result)),
        None if record.verdict is None else encodable(record.verdict),
        encodable(record.message),
        encodable(record.stderr),
        float(record.seconds),
        record.peak_memory,
        record.host,
        canonical(dict(record.versions)),
        record.finished,
    )


def record_of(database: Database, key: str, row: Sequence[Any]) -> Record | None:
    """The record that lies in a row like this; None if the task has no result."""
    if row[0] is None:
        return None
    known = dict(zip(_COLUMNS, row[:ATTEMPTS], strict=True))
    with database.making(f"the record of task {key}"):
        known["outcome"] = Outcome(known["outcome"])
        if (known["outcome"] is Outcome.OK) is not (known["result"] is not None):
            raise ValueError(
                f"the outcome is {known['outcome']}, and the result {'no ' * (known['result'] is None)}text"
            )
        known["result"] = None if known["result"] is None else database.table(known["result"])
        known["versions"] = database.table(known["versions"])
        known["seconds"] = float(known["seconds"])
        known["peak_memory"] = None if known["peak_memory"] is None else index(known["peak_memory"])
        return Record(key=key, **known)
