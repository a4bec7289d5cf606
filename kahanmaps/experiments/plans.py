"""The plans in a database: which task comes where in which experiment. Written as a whole, read in stretches.

Whatever writes here is part of a transaction that the caller has begun.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

from kahanmaps.experiments.database import Database, StoreError
from kahanmaps.experiments.records import Limits, Task, canonical, digest

PLAN_CHUNK = 1000  # rows of the plan that one read takes: they are short


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


# Reading


def choose(database: Database, experiments: Sequence[str] | None) -> list[Chosen]:
    """These experiments, or all, in their order in the database."""
    rows = database.fetch("SELECT id, name, limits, total, tasks FROM experiment ORDER BY id")
    if experiments is not None:
        known = [row[1] for row in rows]
        for name in experiments:
            if name not in known:
                raise StoreError(
                    f"{database.name} has no experiment {name}: it has {', '.join(known) or 'none at all'}"
                )
    chosen: list[Chosen] = []
    offset = 0
    for id, name, limits, total, tasks in rows:
        if experiments is None or name in experiments:
            chosen.append(Chosen(id, name, limits_of(database, limits), total, tasks, offset))
            offset += total
    return chosen


def stretches(
    database: Database, sql: str, experiment: Chosen, size: int, numbers: tuple[int, ...] = ()
) -> Iterator[list[Any]]:
    """What `sql` finds in each stretch of the plan: a bounded number of rows is looked at, found or not."""
    for first in range(0, experiment.total, size):
        yield database.fetch(sql, (experiment.id, first, first + size - 1, *numbers))


def limits_of(database: Database, text: str) -> Limits:
    """The limits with this text."""
    return Limits(**database.plain(text))


def task_of(database: Database, text: str) -> Task:
    """The task with this text."""
    data = database.plain(text)
    return Task(data["task"], data["system"], data["options"])


def document_of(database: Database, name: str) -> str:
    """The text of the document with this digest."""
    rows = database.fetch("SELECT text FROM document WHERE digest = ?", (name,))
    if not rows:
        raise StoreError(f"{database.name} has no document {name}: plan the experiment that needs it again")
    text: str = rows[0][0]
    return text


# Writing


def replace_plan(
    database: Database,
    experiment: str,
    definition: str,
    limits: Limits,
    tasks: Iterable[Task],
    documents: Mapping[str, str],
) -> Planned:
    """Plan an experiment, new or with another definition than before; see `Store.plan`."""
    limits_text = canonical({"time": limits.time, "memory": limits.memory})
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
