"""The subcommands of `kahanmaps batch` as functions: km.batch.run, km.batch.status, ..."""

from __future__ import annotations

import codecs
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from kahanmaps.atomic_files import atomic_write
from kahanmaps.errors import InputError
from kahanmaps.experiments.registry import task_kinds
from kahanmaps.experiments.results.export import write_csv, write_jsonl, write_parquet
from kahanmaps.experiments.results.store import ExperimentStatus, Merged, Store, StoredTask
from kahanmaps.experiments.results.summary import Summary, summarise
from kahanmaps.experiments.running.run import run
from kahanmaps.hints import AttributeHints


class BatchCommands(AttributeHints):
    """The functions of `km.batch`; a database is given by its path. They raise InputError where a command fails."""

    run = staticmethod(run)

    def __reduce__(self) -> str:
        return "batch"  # the name under which pickle finds the only instance, `km.batch`

    def __call__(self, spec: Any, db: str | Path | None = None, **options: Any) -> Any:
        """Run the tasks of a spec and yield their records; see `experiments.running.run.run` for the arguments."""
        if not isinstance(spec, str | Path) and not hasattr(spec, "experiments"):
            raise InputError(
                f"found a {type(spec).__name__}, expected the path or the text of a spec (docs/batch.md); "
                "for a list of systems type [km.analyze(system) for system in systems]"
            )
        return run(spec, db, **options)

    def status(self, db: str | Path) -> list[ExperimentStatus]:
        """Return the progress of each experiment in a database."""
        with Store.open(db, readonly=True) as store:
            return store.status()

    def show(self, db: str | Path, key: str) -> list[StoredTask]:
        """Return the tasks whose keys begin with `key`."""
        with Store.open(db, readonly=True) as store:
            return store.find(key)

    def summary(self, db: str | Path, by: Sequence[str] = (), values: Sequence[str] | None = None) -> Summary:
        """Return counts and quantiles for each group of tasks; tasks with equal entries named in `by` are a group."""
        with Store.open(db, readonly=True) as store:
            return summarise(store.rows(missing=True), by, values)

    def export(self, db: str | Path, path: str | Path) -> None:
        """Write the results in a database to a .csv, .jsonl or .parquet file."""
        suffix = Path(path).suffix
        if suffix not in (".csv", ".jsonl", ".parquet"):
            raise InputError(f"found the suffix {suffix!r} of {path}, expected .csv, .jsonl or .parquet")
        with Store.open(db, readonly=True) as store:
            rows = partial(store.rows, None)
            if suffix == ".parquet":
                write_parquet(rows, str(path))
                return
            with atomic_write(str(path)) as file:
                stream: Any = codecs.getwriter("utf-8")(file)
                if suffix == ".csv":
                    write_csv(rows, stream)
                else:
                    write_jsonl(rows(), stream)

    def merge(self, target: str | Path, *sources: str | Path) -> list[Merged]:
        """Add the experiments and results of other databases to `target`, which is created if necessary."""
        with Store.open(target, create=True) as store:
            return [store.merge(source) for source in sources]

    def tasks(self) -> list[str]:
        """Return the names of the kinds of tasks."""
        return list(task_kinds())


batch = BatchCommands()
