"""`batch run`: from a spec and a database to results, with a word on how it went."""

from __future__ import annotations

import json
import os
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from typing import Any

import click

from kahanmaps.errors import counted
from kahanmaps_cli import library as lib
from kahanmaps_cli.runs.batch_show import print_status, require_experiments, status_data
from kahanmaps_cli.screen.progress import Progress, as_typed, duration, say
from kahanmaps_cli.screen.render import envelope, print_json
from kahanmaps_cli.screen.terminal import tell
from kahanmaps_cli.signals import interruptible

_SHOWN = 3  # tasks of each experiment in a dry run


def dry_run(path: str, db: str, options: Mapping[str, Any]) -> int:
    """Read the spec, and say what it would do."""
    spec = lib.read_spec(path, max_tasks=options["max_tasks"] or lib.MAX_TASKS, skip_bad=options["skip_bad"])
    chosen = [e for e in spec.experiments if not options["only"] or e.name in options["only"]]
    require_experiments(options["only"], [experiment.name for experiment in spec.experiments])
    missing = None
    if os.path.exists(db):  # it is asked, and not changed
        with lib.Store.open(db, readonly=True) as store:
            done = {row.task.key for row in store.rows() if row.record is not None}
        missing = len({task.key for experiment in chosen for task in experiment.tasks()} - done)
    if options["as_json"]:
        data = [
            {
                "name": experiment.name,
                "task": experiment.kind.name,
                "tasks": experiment.size,
                "axes": {name: len(values) for name, values in experiment.grid.axes.items()},
                "limits": {"time": experiment.limits.time, "memory": experiment.limits.memory},
                "first": [
                    {"key": task.key, "task": task.kind, "system": task.system, "options": dict(task.options)}
                    for task in map(experiment.__getitem__, range(min(_SHOWN, experiment.size)))
                ],
                "skipped": [{"system": system, "reason": reason} for system, reason in experiment.skipped],
            }
            for experiment in chosen
        ]
        print_json(
            {
                **envelope("batch run --dry-run"),
                "convention": lib.CONVENTION,
                "spec": path,
                "tasks": sum(experiment.size for experiment in chosen),
                "missing": missing,
                "experiments": data,
            }
        )
        return 0
    for experiment in chosen:
        tell(f"{experiment.name}\t{experiment.kind.name}\t{_tasks(experiment.size)}\t{experiment.product}")
        for k in range(min(_SHOWN, experiment.size)):
            task = experiment[k]
            given = {name: value for name, value in task.options.items() if value is not None}
            if "other" in given:
                given["other"] = lib.system_words(given["other"])
            tell(f"\t{task.key[:8]}\t{lib.system_words(task.system)}\t{lib.option_words(given)}")
        if experiment.size > _SHOWN:
            tell(f"\t... and {experiment.size - _SHOWN} more")
        for system, reason in experiment.skipped:
            tell(f"\tskipped\t{system}\t{reason}")
    tell(_tasks(sum(e.size for e in chosen)) + ("" if missing is None else f", {missing} of them without result"))
    return 0


def run_batch(path: str | None, db: str, options: Mapping[str, Any]) -> int:
    """Do what is missing; the exit status."""
    limits = {"max_tasks": options["max_tasks"] or lib.MAX_TASKS, "skip_bad": options["skip_bad"]}
    spec = None if path is None else lib.read_spec(path, **limits)
    experiments = () if spec is None else spec.experiments
    if spec is not None:
        require_experiments(options["only"], [experiment.name for experiment in experiments])
    with lib.Store.open(db, create=spec is not None) as store:
        planned = {} if spec is None else lib.plan(spec, store)
        names = list(options["only"]) or ([e.name for e in experiments] if spec is not None else None)
        which: dict[str, Any] = {"experiments": names, "shard": options["shard"] or (1, 1)}
        progress = BatchProgress(store.count_pending(**which, retry_failed=options["retry_failed"]), options["quiet"])
        for experiment in experiments:
            if experiment.skipped:
                progress.say(
                    f"{experiment.name}: {counted(len(experiment.skipped), 'system')} skipped (see batch status)"
                )
        for name, plan in planned.items():
            if not plan.is_resumed:
                words = [_tasks(plan.total)]
                words += [f"{plan.new_tasks} of them new"] if plan.new_tasks < plan.total else []
                words += [f"{plan.dropped} of the earlier plan are not in it"] if plan.dropped else []
                progress.say(f"{name}: {', '.join(words)}")
        todo = f"{_tasks(progress.todo)} to do, results go to {db}"
        progress.say(todo if progress.todo else f"nothing to do: every task has a result in {db}")
        was_interrupted = False
        if progress.todo:
            jobs = store.pending(**which, retry_failed=options["retry_failed"])
            with progress:
                was_interrupted = _do(jobs, store, progress, options)
        missing = store.count_pending(**which)
        data = status_data(store, names or ())
    interrupted = was_interrupted and missing > 0
    failed = sum(count for e in data["experiments"] for name, count in e["outcomes"].items() if name != "ok")
    if options["as_json"]:
        more = {"command": "batch run", "spec": path, "done": dict(progress.outcomes), "missing": missing}
        print_json({**data, **more, "interrupted": interrupted, "seconds": round(progress.seconds, 3)})
    elif not options["as_jsonl"]:
        print_status(data)
    if progress.done:
        progress.say(f"{_tasks(progress.done)} in {duration(progress.seconds)}")
    if progress.lost:
        progress.say(
            f"{_tasks(progress.lost)} lost, without a result: what did them was killed, or could not be run, "
            f"{lib.TRIES} times ({progress.why_lost})"
        )
    words = [
        "kahanmaps",
        "batch",
        "run",
        *([f"./{path}" if path.startswith("-") else path] if path else []),
        "--db",
        db,
    ]
    for name in options["only"]:
        words += ["-e", name]
    for name in ("scheduler", "worker_python"):
        if options[name] is not None:
            words += [f"--{name.replace('_', '-')}", options[name]]
    if options["shard"]:
        words += ["--shard", f"{options['shard'][0]}/{options['shard'][1]}"]
    again = as_typed(words)
    if missing:
        how = "interrupted: " if interrupted else ""
        progress.say(f"{how}{_tasks(missing)} without a result yet; to continue: {again}")
    if failed:
        why = as_typed(["kahanmaps", "batch", "summary", "--db", db, "--by", "outcome,message"])
        progress.say(f"{_tasks(failed)} failed, why: {why}; to try again: {again} --retry-failed")
    if interrupted:
        return 130
    return 3 if failed or missing else 0


def _do(jobs: Iterator[lib.Job], store: lib.Store, progress: BatchProgress, options: Mapping[str, Any]) -> bool:
    """Do the jobs, each record stored before the next job is handed out; whether somebody interrupted."""
    number = options["jobs"] or lib.processors()
    cluster = (options["scheduler"], options["worker_python"])
    executor = lib.executor_for(store.document, number, *cluster, options["group_seconds"], progress.say)
    with closing(executor):
        batch, is_told = lib.Batch(jobs, executor), False
        with interruptible(batch.interrupt):
            for records in batch:
                if batch.was_interrupted and not is_told:  # not in the handler, which may find a line half written
                    is_told = True
                    if executor.in_flight:
                        progress.say(f"finishing {_tasks(executor.in_flight)} in flight (Ctrl-C again ends at once)")
                if records:
                    store.add(records)
                progress.tell(records, executor.in_flight)
                if options["as_jsonl"]:
                    for record in records:
                        click.echo(json.dumps({"record": "result", **record.to_json()}))
    return batch.was_interrupted


def _tasks(number: int) -> str:
    return counted(number, "task")


class BatchProgress(Progress):
    """Progress that is told of records; `todo` of them are expected."""

    def __init__(self, todo: int, quiet: bool) -> None:
        super().__init__(quiet)
        self.todo = todo
        self.outcomes: Counter[str] = Counter()
        self.why_lost = ""  # the last of them
        self._begin = time.monotonic()

    @property
    def done(self) -> int:
        """How many tasks have come to a result."""
        return sum(self.outcomes.values()) - self.lost

    @property
    def lost(self) -> int:
        """How many were given up without a result."""
        return self.outcomes["lost"]

    @property
    def seconds(self) -> float:
        """Since the beginning."""
        return time.monotonic() - self._begin

    def tell(self, records: Sequence[lib.Record], in_flight: int) -> None:
        """Some more records, or none for a while; how many tasks are being done."""
        for record in records:
            self.outcomes[str(record.outcome)] += 1
            if record.outcome == "lost":
                self.why_lost = record.message
        rate = self.done / max(self.seconds, 1e-9)
        bad = self.done - self.outcomes["ok"]
        pieces = [f"{self.done} of {_tasks(self.todo)}", f"{rate:.3g} a second"]
        if self.done and self.done < self.todo:
            pieces.append(f"about {duration((self.todo - self.done) / rate)} left")
        counts = {"running": in_flight, "failed": bad, "lost": self.lost}
        self(", ".join([*pieces, *(f"{count} {word}" for word, count in counts.items() if count)]))

    def say(self, text: str) -> None:
        """A message on a line of its own."""
        if not self.quiet:
            self.clear()
            say(text)
