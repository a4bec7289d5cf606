"""What lies in the tables of a database: plans, with the tasks and documents they need, and the results of tasks.

A plan says which task comes where in which experiment; it is written as a whole and read in stretches. A result is the
latest record of its task. Whatever writes here is part of a transaction that the caller has begun.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import islice
from typing import Any

from kahanmaps.errors import quoted
from kahanmaps.experiments.database import Damaged, Database, StoreError, shown
from kahanmaps.experiments.records import (
    Limits,
    Outcome,
    Record,
    Task,
    canonical,
    checksum,
    digest,
    encodable,
    has_checksum,
)

_LONGEST_NAME, _LONGEST_VERDICT = 1000, 200
_SEALED = "id, name, digest, limits, total, tasks"  # what the checksum of an experiment is of
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
    INSERT OR REPLACE INTO result (task, {", ".join(_COLUMNS)}, attempts, checksum)
    VALUES (?, {", ".join("?" * len(_COLUMNS))}, ?, ?)"""


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
    rows = _experiments(database)
    for row in rows:
        _require_sound(database, row)
    if experiments is not None:
        known = [row[1] for row in rows]
        for name in experiments:
            if name not in known:
                raise StoreError(
                    f"{database.name} has no experiment {name}: it has {', '.join(known) or 'none at all'}"
                )
    chosen: list[Chosen] = []
    offset = 0
    for id, name, limits, total, tasks, *_ in rows:
        if experiments is None or name in experiments:
            chosen.append(Chosen(id, name, limits_of(database, limits), total, tasks, offset))
            offset += total
    return chosen


def sound_experiments(database: Database) -> Iterator[tuple[Any, bool]]:
    """The names of the experiments, and whether all of each is as it was planned."""
    for row in _experiments(database, is_lenient=True):
        id, name, limits, total, tasks, *_ = row
        try:
            _require_sound(database, row)
            definition_of(database, Chosen(id, name, limits_of(database, limits), total, tasks, 0))
        except Damaged:
            yield name, False
        else:
            sql = "SELECT count(*) FROM plan WHERE experiment = ? AND task NOT IN (SELECT id FROM task)"
            yield name, database.fetch(sql, (id,)) == [(0,)]


def _experiments(database: Database, is_lenient: bool = False) -> list[Any]:
    """Their rows, and what is known of their plans: in one statement, so that nobody plans in between."""
    return database.fetch(
        "SELECT id, name, limits, total, tasks, (SELECT count(task) FROM plan WHERE experiment = e.id), "
        "(SELECT min(number) FROM plan WHERE experiment = e.id), "
        "(SELECT max(number) FROM plan WHERE experiment = e.id), "
        f"(SELECT min(task) FROM plan), (SELECT max(task) FROM plan), (SELECT max(id) FROM task), "
        f"digest, {'checksum' if database.format > 1 else 'NULL'} "
        "FROM experiment AS e ORDER BY id",
        is_lenient=is_lenient,
    )


def _require_sound(database: Database, row: Sequence[Any]) -> None:
    """Raise `Damaged` unless the row of an experiment agrees with itself and with its plan."""
    id, name, limits, total, tasks, count, first, last, *ids, name_of_definition, found = row
    database.require(is_a_name(name), "the table of experiments, name", name, "a name")
    what = f"the experiment {quoted(name)}"
    database.require(isinstance(total, int) and total == count, f"{what}, total", total, str(count))
    database.require(isinstance(tasks, int) and 0 <= tasks <= total, f"{what}, tasks", tasks, f"0 to {total}")
    span = (0, total - 1) if total else (None, None)
    database.require((first, last) == span, f"the plan of {quoted(name)}, number", [first, last], str(span))
    is_known = ids[0] is None or (all(isinstance(id, int) for id in ids) and 0 < ids[0] <= ids[1] <= ids[2])
    database.require(is_known, "the table of plans, task", ids[:2], f"1 to {ids[2]}")
    if database.format > 1 and not has_checksum([id, name, name_of_definition, limits, total, tasks], found):
        raise database.damaged(f"{what}: it has not its checksum")


def is_a_name(value: Any) -> bool:
    """Whether it can be the name of an experiment."""
    return isinstance(value, str) and len(value) <= _LONGEST_NAME


def stretches(
    database: Database, sql: str, experiment: Chosen, size: int, numbers: tuple[int, ...] = ()
) -> Iterator[list[Any]]:
    """What `sql` finds in each stretch of the plan: a bounded number of rows is looked at, found or not."""
    for first in range(0, experiment.total, size):
        yield database.fetch(sql, (experiment.id, first, first + size - 1, *numbers))


def whole_stretches(database: Database, sql: str, experiment: Chosen, size: int) -> Iterator[list[Any]]:
    """The same where `sql` finds every row of the plan, its number first; `Damaged` where one is missing."""
    for first, rows in zip(range(0, experiment.total, size), stretches(database, sql, experiment, size), strict=True):
        expected = range(first, min(first + size, experiment.total))
        if [row[0] for row in rows] != list(expected):
            raise database.damaged(
                f"the plan of {quoted(experiment.name)} lacks tasks between {expected.start} and {expected.stop - 1}, "
                "unless it was planned again while it was read"
            )
        yield rows


def definition_of(database: Database, experiment: Chosen) -> str:
    """What an experiment was made from."""
    ((text, name),) = database.fetch("SELECT definition, digest FROM experiment WHERE id = ?", (experiment.id,))
    return _text_of(database, f"the definition of {quoted(experiment.name)}", text, name)


def _text_of(database: Database, what: str, text: Any, name: Any, known_by: str = "digest") -> str:
    database.require(isinstance(text, str) and name == digest(text), what, text, f"the text of its {known_by}")
    return str(text)


def limits_of(database: Database, text: Any) -> Limits:
    """The limits with this text."""
    what = "the limits of an experiment"
    found = database.table(text, what)
    is_sound = found.keys() == {"time", "memory"} and all(
        value is None or (isinstance(value, int | float) and not isinstance(value, bool) and value > 0)
        for value in found.values()
    )
    database.require(is_sound, what, text, "time and memory, numbers or null")
    return Limits(**found)


def task_of(database: Database, key: Any, text: Any) -> Task:
    """The task with this key and text."""
    what = f"the task {key}"
    data = database.table(_text_of(database, what, text, key, "key"), what)
    kind, system, options = data.get("task"), data.get("system"), data.get("options")
    if not (isinstance(kind, str) and isinstance(system, dict | None) and isinstance(options, dict)):
        raise database.damaged(f"{what}: found {shown(text)}, expected a task")
    return Task(kind, system, options)


def document_of(database: Database, name: str) -> str:
    """The text of the document with this digest."""
    rows = database.fetch("SELECT text FROM document WHERE digest = ?", (name,))
    if not rows:
        raise StoreError(f"{database.name} has no document {name}: plan the experiment that needs it again")
    return _text_of(database, f"the document {name}", rows[0][0], name)


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
    before = database.execute(f"SELECT {_SEALED}, checksum FROM experiment WHERE name = ?", (experiment,)).fetchone()
    # One that is damaged is planned anew.
    if before is not None and before[2] == digest(definition) and has_checksum(before[:-1], before[-1]):
        database.execute("UPDATE experiment SET limits = ? WHERE id = ?", (limits_text, before[0]))
        seal(database, before[0])
        return Planned(before[4], before[5], 0, 0, is_resumed=True)
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
    seal(database, experiment)
    return total, different, new


def seal(database: Database, experiment: int) -> None:
    """Write the checksum of an experiment as it is now."""
    row = database.execute(f"SELECT {_SEALED} FROM experiment WHERE id = ?", (experiment,)).fetchone()
    database.execute("UPDATE experiment SET checksum = ? WHERE id = ?", (checksum(row), experiment))


def add_tasks(database: Database, tasks: Sequence[tuple[str, str]]) -> int:
    """How many were not there."""
    return database.execute_many("INSERT INTO task (key, text) VALUES (?, ?) ON CONFLICT (key) DO NOTHING", tasks)


def add_document(database: Database, name: str, text: str) -> None:
    """Keep a document; nothing if it is there."""
    database.execute("INSERT INTO document VALUES (?, ?) ON CONFLICT (digest) DO NOTHING", (name, text))


# Results


def record_columns(database: Database) -> str:
    """What is selected from `result AS r` for `record_of`: the record, the attempts at it, and a checksum."""
    last = "r.checksum" if database.format > 1 else "NULL"
    return ", ".join([*(f"r.{column}" for column in _COLUMNS), "r.attempts", last])


def is_a_verdict(value: Any) -> bool:
    """Whether it can be the verdict of a task, or that there is none."""
    return value is None or (isinstance(value, str) and len(value) <= _LONGEST_VERDICT)


def is_a_time(value: Any) -> bool:
    """Whether it can be how long a task took, in seconds."""
    return isinstance(value, int | float) and 0 <= value < math.inf


_OUTCOMES = frozenset(Outcome)
# What a cell of a row can hold: SQLite keeps anything in any column.
_SOUND: dict[str, tuple[Callable[[Any], bool], str]] = {
    "outcome": (lambda value: value in _OUTCOMES, f"one of {', '.join(Outcome)}"),
    "verdict": (is_a_verdict, "a word or nothing"),
    **dict.fromkeys(("message", "stderr", "host", "finished"), (lambda value: isinstance(value, str), "text")),
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
    if all(value is None for value in row):
        return None
    known = dict(zip(_COLUMNS, row[:ATTEMPTS], strict=True))
    what = f"the record of task {key}"
    for column, (is_sound, expected) in _SOUND.items():
        database.require(is_sound(known[column]), f"{what}, {column}", known[column], expected)
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
