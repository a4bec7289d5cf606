"""The loop that runs the jobs of a batch and yields their records.

    for record in run("study.toml", jobs=2): ...                 nothing is stored
    for record in run("study.toml", "results.db", jobs=2): ...   each record is stored before it is yielded

`Batch` is this loop for any jobs and any executor.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from pathlib import Path

from kahanmaps.experiments.results.records import Documents, Executor, Job, Record
from kahanmaps.experiments.results.store import Planned, Store
from kahanmaps.experiments.running.local import GROUP_SECONDS, LocalWorkers
from kahanmaps.experiments.spec import Spec, parse_spec, read_spec

_WAIT_SECONDS = 0.1  # the longest wait: an interrupt is noticed, and an empty list is yielded, after at most this time
_COLLECTION_FACTOR = 4  # records are collected for this multiple of the time that writing the previous list took
GRACE_SECONDS = 10.0  # seconds after an interrupt for which tasks in flight may continue


class Batch:
    """An iterable of lists of records, yielded as jobs end: at least ten lists a second, some of them empty.

    Since writing waits for the disk, the records of short tasks are collected in one list, for four times as long as
    writing the last list took. A caller that stores each list at once can lose one list and the tasks in flight.
    """

    def __init__(self, jobs: Iterable[Job], executor: Executor, grace: float = GRACE_SECONDS) -> None:
        self._jobs = iter(jobs)
        self._executor = executor
        self._grace = grace
        self._deadline: float | None = None
        self.abandoned = 0

    @property
    def was_interrupted(self) -> bool:
        """Whether `interrupt` was called."""
        return self._deadline is not None

    def interrupt(self) -> None:
        """Submit no further jobs, and abandon jobs in flight after `grace` seconds; a signal handler may call this."""
        self._deadline = time.monotonic() + self._grace

    def __iter__(self) -> Iterator[list[Record]]:
        executor, write_seconds = self._executor, 0.0
        try:
            self._submit_jobs()
            while executor.in_flight:
                if self._deadline is not None and time.monotonic() > self._deadline:
                    self.abandoned = executor.in_flight
                    return
                records = executor.wait(_WAIT_SECONDS)
                collection_end = time.monotonic() + _COLLECTION_FACTOR * write_seconds
                while records and executor.in_flight and time.monotonic() < collection_end:
                    self._submit_jobs()
                    records += executor.wait(max(0.0, collection_end - time.monotonic()))
                self._submit_jobs()
                write_begin = time.monotonic()
                yield records
                if records:
                    write_seconds = min(time.monotonic() - write_begin, _WAIT_SECONDS)
        finally:
            executor.close()

    def _submit_jobs(self) -> None:
        while self._deadline is None and self._executor.is_free:
            job = next(self._jobs, None)
            if job is None:
                break
            self._executor.submit(job)


def plan(spec: Spec, store: Store) -> dict[str, Planned]:
    """Store the plans of all experiments of a spec in a store; results in the store remain."""
    return {
        experiment.name: store.plan(
            experiment.name,
            experiment.definition,
            experiment.limits,
            experiment.tasks(),
            spec.documents,
            experiment.skipped,
        )
        for experiment in spec.experiments
    }


def executor_for(
    documents: Documents,
    jobs: int = 1,
    scheduler: str | None = None,
    python: str | None = None,
    group_seconds: float = GROUP_SECONDS,
    on_message: Callable[[str], None] | None = None,
) -> Executor:
    """Return an executor that runs jobs in `jobs` local worker processes or, if given, on the workers of a `scheduler`.

    The dask scheduler is given as "tcp://host:port" or by its scheduler file. Short tasks are run in groups of about
    `group_seconds`. `python` is the path of the interpreter on the workers if it differs from the local one.
    `on_message` is called with messages about waiting for the cluster.
    """
    if scheduler is None:
        return LocalWorkers(jobs, documents, group_seconds=group_seconds)
    from kahanmaps.experiments.running.cluster import ClusterWorkers

    return ClusterWorkers(scheduler, documents, python=python, group_seconds=group_seconds, on_message=on_message)


def run(
    spec: Spec | str | Path,
    db: str | Path | None = None,
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    only: Sequence[str] | None = None,
    shard: tuple[int, int] = (1, 1),
    retry_failed: bool = False,
) -> Iterator[Record]:
    """Run the tasks of a spec and yield their records as they finish.

    `spec` is a path, the text of a spec (a text with a line break), or a Spec. `db` is the path of a database: tasks
    with a record in it are not run again, and every record is stored before it is yielded. Without `db` nothing is
    stored. The tasks run in `jobs` local worker processes or on the workers of a dask `scheduler`. `only` names the
    experiments to run, `shard` = (i, n) selects the i-th of n parts of the tasks, and `retry_failed` includes failed
    tasks. A task that is killed from outside at every attempt is yielded as lost and not stored. Closing the generator
    kills the tasks in flight.

    Raises SpecError for an invalid spec, and StoreError for a database that cannot be used.

    >>> table = '[experiments.space]\\ntask = "family-space"\\nsystem = "family"\\naxes = {m = "2..3", seed = "0..1"}'
    >>> sorted(record.result["dimension"] for record in run(table))
    [8, 8, 12, 12]
    """
    if not isinstance(spec, Spec):
        spec = parse_spec(spec) if isinstance(spec, str) and "\n" in spec else read_spec(spec)
    names = [experiment.name for experiment in spec.experiments] if only is None else only
    if db is None:
        with closing(executor_for(spec.documents.__getitem__, jobs, scheduler)) as executor:
            for records in Batch(_jobs(spec, names, shard), executor):
                yield from records
        return
    with Store.open(db, create=True) as store, closing(executor_for(store.document, jobs, scheduler)) as executor:
        plan(spec, store)
        for records in Batch(store.pending(names, retry_failed=retry_failed, shard=shard), executor):
            if records:
                store.add(records)
            yield from records


def _jobs(spec: Spec, names: Sequence[str], shard: tuple[int, int]) -> Iterator[Job]:
    """Yield the jobs of a spec in order; a task that occurs several times is yielded once."""
    seen_keys = set()
    part, parts = shard
    experiments = [experiment for experiment in spec.experiments if experiment.name in names]
    rows = ((experiment, task) for experiment in experiments for task in experiment.tasks())
    for number, (experiment, task) in enumerate(rows):
        if task.key not in seen_keys:
            seen_keys.add(task.key)
            if number % parts == part - 1:
                yield Job(task, experiment.limits)
