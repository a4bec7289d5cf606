"""Where the results of a batch lie: one SQLite file, written by one process, read by others at the same time.

A store holds experiments with their plans (which task comes where), the texts of tasks and of the documents that they
need, and the latest result of every task. Tasks lie once, however often they are planned, so that a batch which has
changed keeps what it has in common with the old one.

Three rules keep it whole:

* what is said to be done is done: each method that writes is one transaction, and a kill at any moment leaves the state
  before it or after it;
* one writer: opening for writing takes a lock that the operating system frees when the process ends, however it ends;
* no reader holds the writer up: long reads go in chunks, each fetched completely before the first row is handed out.

The file itself is the matter of database.py, its tables are in schema.py. What plans and results are in them is in
tables.py, and merging.py makes one database of two.
"""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Any, NamedTuple, Self

from kahanmaps.displayed import Displayed
from kahanmaps.errors import note_source, quoted
from kahanmaps.experiments.results import tables
from kahanmaps.experiments.results.database import Database, StoreError
from kahanmaps.experiments.results.merging import Merged, merge
from kahanmaps.experiments.results.records import KEY_LENGTH, Job, Limits, Outcome, Record, Row, Task
from kahanmaps.experiments.results.tables import Chosen, Planned

COUNT_CHUNK = 50_000  # rows that are only counted: some 50 ms
FOUND_AT_MOST = 20


@dataclass(frozen=True)
class Experiment:
    """An experiment as it was planned: `total` rows, in which `tasks` different tasks appear."""

    name: str
    definition: str
    limits: Limits
    total: int
    tasks: int


@dataclass(frozen=True)
class ExperimentStatus:
    """How far an experiment has come. `total` counts rows of its plan, everything else its `tasks` different tasks.

    So `missing` and the `outcomes` add up to `tasks`. `seconds` is the time the latest attempts took.
    """

    name: str
    total: int
    tasks: int
    missing: int
    outcomes: Mapping[Outcome, int]
    verdicts: Mapping[str, int]
    seconds: float
    skipped: Sequence[tuple[str, str]] = ()  # systems that were left out when it was planned, and why


class Found(NamedTuple):
    """A task by its key, with its record if there is one, its places (experiment, number), and attempts at it."""

    task: Task
    record: Record | None
    places: list[tuple[str, int]]
    attempts: int


class Store(Displayed):
    """A database of results. Make one with `Store.open`, and close it, best by `with`.

    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder, Store.open(f"{folder}/results.db", create=True) as store:
    ...     store.plan("steps", "orbit, m = 2", Limits(time=60), [Task("orbit", {"family": {"m": 2}}, {})], {})
    ...     [job.task.kind for job in store.pending()]
    Planned(total=1, known=0, new_tasks=1, dropped=0, is_resumed=False)
    ['orbit']
    """

    def __init__(self, database: Database) -> None:
        self._database = database

    # Opening and closing

    @classmethod
    def open(cls, path: str | os.PathLike[str], create: bool = False, readonly: bool = False) -> Self:
        """The store in this file; `create` makes it if it is not there. Open for writing, it has the lock."""
        return cls(Database.open(path, create, readonly))

    def close(self) -> None:
        """Leave one complete file behind. May be called twice."""
        self._database.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if error is not None:
            note_source(error, self._database.name)
        self.close()

    # Experiments and their plans

    def experiments(self) -> list[Experiment]:
        """What is planned, in order."""
        return [
            Experiment(one.name, tables.definition_of(self._database, one), one.limits, one.total, one.tasks)
            for one in tables.choose(self._database, None)
        ]

    def plan(
        self,
        experiment: str,
        definition: str,
        limits: Limits,
        tasks: Iterable[Task],
        documents: Mapping[str, str],
        skipped: Iterable[tuple[str, str]] = (),
    ) -> Planned:
        """Plan these tasks in this order; a kill or an exception on the way leaves the plan there was.

        `definition` is what the tasks were made from: if it is the one planned before, `tasks` is not even begun, and
        only the limits are set. If it is another one, this plan replaces the old; results stay, planned or not.
        `documents` (digest to text) is read after `tasks`, so whoever makes the tasks may fill it meanwhile. `skipped`
        are systems that are left out, and why.
        """
        with self._database.transaction():
            planned = tables.replace_plan(self._database, experiment, definition, limits, tasks, documents)
            tables.put_skipped(self._database, experiment, skipped)
            return planned

    def merge(self, other: str | os.PathLike[str]) -> Merged:
        """Take over what another database has, all or nothing; doing it again changes nothing.

        Experiments that this one lacks come with their plans. Of two results of a task the one that is ok is kept, and
        this one's if both are or neither is. Of two experiments with one name the definitions must agree.
        """
        return merge(self._database, other)

    # What there is to do

    def pending(
        self,
        experiments: Sequence[str] | None = None,
        *,
        retry_failed: bool = False,
        shard: tuple[int, int] = (1, 1),
    ) -> Iterator[Job]:
        """The tasks without a result in plan order, each once, while results may be added in between.

        With `retry_failed` also those that failed: each is looked at once, so one that fails again does not come back.
        `shard` (i, n) is the i-th part of n, counting rows of the plan of these experiments; no task is in two parts.
        """
        found = self._pending("t.key, t.text", tables.PLAN_CHUNK, experiments, retry_failed, shard)
        return (
            Job(tables.task_of(self._database, key, text), experiment.limits)
            for experiment, rows in found
            for key, text in rows
        )

    def count_pending(
        self,
        experiments: Sequence[str] | None = None,
        *,
        retry_failed: bool = False,
        shard: tuple[int, int] = (1, 1),
    ) -> int:
        """How many jobs `pending` has with these arguments."""
        found = self._pending("count(*)", COUNT_CHUNK, experiments, retry_failed, shard)
        return sum(rows[0][0] for _, rows in found)

    def _pending(
        self, what: str, size: int, experiments: Sequence[str] | None, retry_failed: bool, shard: tuple[int, int]
    ) -> Iterator[tuple[Chosen, list[Any]]]:
        """What is selected of the tasks without a result, some rows of the plan at a time."""
        part, parts = shard
        if not 1 <= part <= parts:
            raise StoreError(f"there is no part {part} of {parts}: parts are counted 1/{parts} to {parts}/{parts}")
        chosen = tables.choose(self._database, experiments)
        # A task planned twice belongs to its first row among the chosen ones: so it comes once, without a memory of
        # what has come, and lies in one shard.
        among = "" if experiments is None else f"AND q.experiment IN ({', '.join(str(c.id) for c in chosen)})"
        failed = "OR r.outcome <> 'ok'" if retry_failed else ""
        text = "JOIN task AS t ON t.id = p.task" if what.startswith("t.") else ""
        sql = f"""
            SELECT {what} FROM plan AS p {text}
            LEFT JOIN result AS r INDEXED BY result_summary ON r.task = p.task
            WHERE p.experiment = ? AND p.number BETWEEN ? AND ?
            AND (r.task IS NULL {failed}) AND (p.number + ?) % ? = ?
            AND NOT EXISTS (
                SELECT 1 FROM plan AS q
                WHERE q.task = p.task AND (q.experiment, q.number) < (p.experiment, p.number) {among}
            )
            ORDER BY p.number"""
        return (
            (experiment, rows)
            for experiment in chosen
            for rows in tables.stretches(self._database, sql, experiment, size, (experiment.offset, parts, part - 1))
        )

    # Results

    def add(self, records: Sequence[Record]) -> None:
        """Store these records, all or none. A failure does not replace a result, otherwise the later one counts.

        What is lost is no result, and leaves the task as it was.
        """
        records = [record for record in records if record.outcome is not Outcome.LOST]
        rows = [tables.row_of(record) for record in records]  # what JSON cannot hold is refused here
        with self._database.transaction():
            for record, row in zip(records, rows, strict=True):
                found = tables.find_result(self._database, record.key)
                if found is None:
                    raise StoreError(
                        f"{self._database.name} has no task {record.key}: plan it before its result is added"
                    )
                task, before = found
                is_kept = before[0] == Outcome.OK and not record.is_ok
                attempts = (before[tables.ATTEMPTS] or 0) + 1
                tables.put_result(self._database, task, attempts, before if is_kept else row)

    def rows(self, experiments: Sequence[str] | None = None, *, missing: bool = False) -> Iterator[Row]:
        """The tasks with their records in plan order; with `missing` also those that have none."""
        return self._rows(tables.choose(self._database, experiments), missing)

    def _rows(self, chosen: list[Chosen], missing: bool) -> Iterator[Row]:
        # All rows of the plan, so that what is missing is seen.
        sql = f"""
            SELECT p.number, t.key, t.text, {tables.RECORD_COLUMNS}
            FROM plan AS p JOIN task AS t ON t.id = p.task LEFT JOIN result AS r ON r.task = p.task
            WHERE p.experiment = ? AND p.number BETWEEN ? AND ? ORDER BY p.number"""
        for experiment in chosen:
            for rows in tables.stretches(self._database, sql, experiment, tables.RESULT_CHUNK):
                for number, key, text, *cells in rows:
                    record = tables.record_of(self._database, key, cells)
                    if record is not None or missing:
                        yield Row(experiment.name, number, tables.task_of(self._database, key, text), record)

    def unplanned(self) -> int:
        """How many results no plan asks for."""
        found, last = 0, 0
        while last is not None:
            # In stretches, so that no reader holds the writer up.
            count, last = self._database.fetch(
                "SELECT sum(NOT EXISTS (SELECT 1 FROM plan AS p WHERE p.task = r.task)), max(r.task) FROM "
                "(SELECT task FROM result INDEXED BY result_summary WHERE task > ? ORDER BY task LIMIT ?) AS r",
                (last, COUNT_CHUNK),
            )[0]
            found += count or 0
        return found

    # Looking

    def status(self) -> list[ExperimentStatus]:
        """How far each experiment has come."""
        return [self._status(experiment) for experiment in tables.choose(self._database, None)]

    def _status(self, experiment: Chosen) -> ExperimentStatus:
        # A task planned twice counts at its first row; the look at earlier rows costs most, and mostly there are none.
        once = """AND NOT EXISTS (
            SELECT 1 FROM plan AS q WHERE q.task = p.task AND q.experiment = p.experiment AND q.number < p.number
        )"""
        sql = f"""
            SELECT r.outcome, r.verdict, count(*), sum(r.seconds)
            FROM plan AS p
            JOIN result AS r INDEXED BY result_summary ON r.task = p.task
            WHERE p.experiment = ? AND p.number BETWEEN ? AND ? {once if experiment.tasks < experiment.total else ""}
            GROUP BY r.outcome, r.verdict"""
        outcomes: Counter[Outcome] = Counter()
        verdicts: Counter[str] = Counter()
        seconds = 0.0
        for rows in tables.stretches(self._database, sql, experiment, COUNT_CHUNK):
            for outcome, verdict, count, time in rows:
                with self._database.making(f"the outcomes of {quoted(experiment.name)}"):
                    outcomes[Outcome(outcome)] += count
                    seconds += time
                if verdict is not None:
                    verdicts[verdict] += count
        missing = experiment.tasks - outcomes.total()
        return ExperimentStatus(
            experiment.name,
            experiment.total,
            experiment.tasks,
            missing,
            dict(outcomes),
            dict(verdicts),
            seconds,
            tables.skipped_of(self._database, experiment.id),
        )

    def find(self, prefix: str) -> list[Found]:
        """The tasks whose key begins like this, at most 20; the first 4 digits at least."""
        prefix = prefix.lower()
        if not re.fullmatch(f"[0-9a-f]{{4,{KEY_LENGTH}}}", prefix):
            raise StoreError(
                f"{quoted(prefix)} is not the beginning of a key: give at least 4 of its {KEY_LENGTH} hexadecimal "
                "digits"
            )
        rows = self._database.fetch(
            f"SELECT t.id, t.key, t.text, {tables.RECORD_COLUMNS} "
            "FROM task AS t LEFT JOIN result AS r ON r.task = t.id "
            "WHERE t.key >= ? AND t.key < ? ORDER BY t.key LIMIT ?",
            (prefix, f"{prefix}g", FOUND_AT_MOST),  # g comes after every hexadecimal digit
        )
        return [
            Found(
                tables.task_of(self._database, key, text),
                tables.record_of(self._database, key, record),
                self._database.fetch(
                    "SELECT e.name, p.number FROM plan AS p JOIN experiment AS e ON e.id = p.experiment "
                    "WHERE p.task = ? ORDER BY p.experiment, p.number",
                    (id,),
                ),
                record[tables.ATTEMPTS] or 0,
            )
            for id, key, text, *record in rows
        ]

    def task(self, key: str) -> Task:
        """The task with this key."""
        rows = self._database.fetch("SELECT text FROM task WHERE key = ?", (key,))
        if not rows:
            raise StoreError(f"{self._database.name} has no task {key}: plan the experiment that has it")
        return tables.task_of(self._database, key, rows[0][0])

    def document(self, digest: str) -> str:
        """The text of the document with this digest."""
        return tables.document_of(self._database, digest)
