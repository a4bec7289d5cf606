"""Two databases into one: shards of a batch that ran apart, or batches that share tasks."""

from __future__ import annotations

import os
from contextlib import closing
from dataclasses import asdict, dataclass

from kahanmaps.experiments.results import tables
from kahanmaps.experiments.results.database import Database, StoreError
from kahanmaps.experiments.results.records import Outcome, canonical, digest

CONFLICTS_SHOWN = 5


@dataclass(frozen=True)
class Merged:
    """What came from another database: new tasks, new results, failures `replaced` by results.

    `conflicts` counts tasks which are done in both with different results; `conflicting` has the keys of the first few.
    """

    tasks: int
    results: int
    replaced: int
    conflicts: int
    conflicting: tuple[str, ...] = ()


def merge(database: Database, other: str | os.PathLike[str]) -> Merged:
    """Take over what another database has, all or nothing; see `Store.merge`."""
    with closing(Database.open(other, readonly=True)) as source:
        if source.path.samefile(database.path):
            raise StoreError(f"{source.name} is this database itself: there is nothing to merge")
        with database.transaction():
            new = _merge_plans(database, source)
            for (name,) in source.fetch("SELECT digest FROM document"):  # one by one: each may be long
                tables.add_document(database, name, tables.document_of(source, name))
            return _merge_results(database, source, new)


def _merge_plans(database: Database, source: Database) -> int:
    """How many tasks are new."""
    new = 0
    for experiment in tables.choose(source, None):
        definition = tables.definition_of(source, experiment)
        mine = database.execute("SELECT digest FROM experiment WHERE name = ?", (experiment.name,)).fetchone()
        if mine is not None:
            if mine[0] != digest(definition):
                raise StoreError(
                    f"the experiment {experiment.name} is defined in one way in {database.name} and in another way in "
                    f"{source.name}: rename it in one of them; nothing was merged"
                )
            continue
        id = tables.add_experiment(database, experiment.name)
        sql = """
            SELECT p.number, t.key, t.text FROM plan AS p JOIN task AS t ON t.id = p.task
            WHERE p.experiment = ? AND p.number BETWEEN ? AND ? ORDER BY p.number"""
        chunks = tables.stretches(source, sql, experiment, tables.PLAN_CHUNK)
        tasks = ((key, text) for rows in chunks for _, key, text in rows)
        _, _, added = tables.fill_plan(database, id, definition, canonical(asdict(experiment.limits)), tasks)
        new += added
        tables.put_skipped(database, experiment.name, tables.skipped_of(source, experiment.id))
    return new


def _merge_results(database: Database, source: Database, new: int) -> Merged:
    """What came along; `new` tasks came with the plans."""
    results = replaced = conflicts = 0
    conflicting: list[str] = []
    columns, join = f"t.key, t.text, {tables.RECORD_COLUMNS}", "JOIN task AS t ON t.id = r.task"
    for rows in source.chunks("result", "task", columns, tables.RESULT_CHUNK, join):
        for _, key, text, *row in rows:
            new += tables.add_tasks(database, [(key, text)])
            found = tables.find_result(database, key)
            assert found is not None
            task, mine = found
            attempts = row[tables.ATTEMPTS] + (mine[tables.ATTEMPTS] or 0)
            if mine[0] is None or row[0] == Outcome.OK != mine[0]:
                results += mine[0] is None
                replaced += mine[0] is not None
                tables.put_result(database, task, attempts, row)
            elif row[0] == Outcome.OK and row[1:3] != mine[1:3]:
                conflicts += 1
                if conflicts <= CONFLICTS_SHOWN:
                    conflicting.append(key)
    return Merged(new, results, replaced, conflicts, tuple(conflicting))
