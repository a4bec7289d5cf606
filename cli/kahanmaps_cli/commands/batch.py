"""kahanmaps batch run | status | show | export | summary | merge | tasks."""

from __future__ import annotations

import codecs
import json
import os
import sys
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import click

from kahanmaps import internals as lib
from kahanmaps.errors import counted, quoted, suggestion
from kahanmaps_cli.complete import complete_toml
from kahanmaps_cli.groups import SuggestingGroup
from kahanmaps_cli.options import json_option, output_options
from kahanmaps_cli.params import Shard
from kahanmaps_cli.screen.outputs import OutputFile
from kahanmaps_cli.screen.progress import Progress, as_typed, duration, print_stderr
from kahanmaps_cli.screen.render import envelope, print_json
from kahanmaps_cli.screen.terminal import on_terminal, print_entry, print_raw, print_stdout, print_table, shorten
from kahanmaps_cli.signals import interruptible

F = TypeVar("F", bound=Callable[..., Any])

_MAX_TASKS_SHOWN = 3  # number of tasks of each experiment that a dry run prints
_MAX_VALUE_WIDTH = 300  # maximal length of a value that `batch show` prints on a terminal
_SYSTEMS_OF_TASKS = {
    None: "none",
    "system": '"family", a name of the catalogue, a file, or a list of these',
    "member": '"family", or files of kind [family]',
    "member or other": '"family", files of kind [family], or any other system together with a second one (other)',
}

_experiment_option = click.option(
    "-e", "--experiment", "only", multiple=True, metavar="NAME", help="Restrict to this experiment. Repeatable."
)


def _database_option(required: bool = True) -> Callable[[F], F]:
    return click.option(
        "--db",
        type=click.Path(dir_okay=False),
        envvar="KAHANMAPS_DB",
        required=required,
        metavar="FILE",
        help="Database of results (default: the variable KAHANMAPS_DB).",
    )


@click.group("batch", cls=SuggestingGroup)
def command() -> None:
    """Run thousands of tasks described in one file in worker processes; store their results; resume after a stop.

    \b
      kahanmaps batch run study.toml -j 2       # results go to study.db
      kahanmaps batch run study.toml --dry-run
      kahanmaps batch status --db study.db
      kahanmaps batch summary --db study.db --by m,eps
      kahanmaps batch export --db study.db --csv -o study.csv
      kahanmaps batch tasks                     # the kinds of tasks

    Each experiment of the file gives one task for each combination of its systems and options, and each task has one
    result. docs/batch.md describes the file and the use of several machines.
    """


@command.command("run", short_help="Run the tasks that a file describes; store the results in a database.")
@click.argument("spec", required=False, type=click.Path(dir_okay=False), shell_complete=complete_toml)
@_database_option(required=False)
@click.option(
    "-j",
    "--jobs",
    type=click.IntRange(1, 1024),
    metavar="N",
    help="Number of worker processes (default: one per processor).",
)
@_experiment_option
@click.option("--shard", type=Shard(), metavar="I/N", help="Run the I-th of N parts only (for job arrays).")
@click.option("--retry-failed", is_flag=True, help="Repeat failed tasks too.")
@click.option("--dry-run", is_flag=True, help="Check the spec and list its first tasks; run none.")
@click.option(
    "--skip-bad",
    is_flag=True,
    help='Skip systems that cannot be read, and list them in the database (as on_error = "skip" in the spec).',
)
@click.option(
    "--max-tasks", type=click.IntRange(1), metavar="N", help="Refuse specs with more than N tasks (default 1000000)."
)
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Use the workers of a dask scheduler that you trust: tls://host:port, tcp://host:port or its file.",
)
@click.option("--worker-python", metavar="PATH", help="Path of Python on those workers (default: as on this machine).")
@click.option(
    "--group-seconds",
    type=click.FloatRange(0, 86400),
    metavar="T",
    default=5.0,
    show_default=True,
    help="Run short tasks together, about T seconds in one worker process or one job of the cluster.",
)
@click.option("--jsonl", "as_jsonl", is_flag=True, help="Print each record on standard output when it is finished.")
@output_options
def run(spec: str | None, db: str | None, **options: Any) -> int:
    """Run the tasks in SPEC that have no result yet, and store the results in a database.

    \b
      kahanmaps batch run study.toml --dry-run
      kahanmaps batch run study.toml -j 2              # results in study.db
      kahanmaps batch run study.toml --db all.db       # runs what is missing
      kahanmaps batch run --db all.db --retry-failed   # without the spec
      kahanmaps batch run study.toml --shard 3/16 --db part3.db
      kahanmaps batch run study.toml --scheduler tcp://head:8786

    Each result is stored as soon as it is finished: if the run is killed, only running tasks are lost, and the same
    command continues. The first Ctrl-C waits up to ten seconds for running tasks; the second one ends at once.

    Exit status: 0 every task has a result, whatever its verdict, 2 usage error, 3 some task failed or has no result,
    130 interrupted.
    """
    if options["as_json"] and options["as_jsonl"]:
        raise click.UsageError("give --json or --jsonl, not both")
    if spec is None and (db is None or options["dry_run"]):
        raise click.UsageError("missing SPEC, a TOML file with experiments (or --db FILE, to continue its experiments)")
    if options["scheduler"] is not None and options["jobs"] is not None:
        raise click.UsageError("give --jobs or --scheduler, not both: a cluster has its own number of workers")
    db = db or Path(str(spec)).with_suffix(".db").name
    if options["dry_run"]:
        _print_dry_run(str(spec), db, options)
        return 0
    return _run_tasks(spec, db, options)


def _print_dry_run(path: str, db: str, options: Mapping[str, Any]) -> None:
    """Print the tasks of a spec file, and how many of them have no result yet; run nothing."""
    spec = lib.read_spec(path, max_tasks=options["max_tasks"] or lib.MAX_TASKS, skip_bad=options["skip_bad"])
    experiments = [e for e in spec.experiments if not options["only"] or e.name in options["only"]]
    _require_experiments(options["only"], [experiment.name for experiment in spec.experiments])
    missing = None
    if os.path.exists(db):  # a dry run must not change the database
        with lib.Store.open(db, readonly=True) as store:
            finished_keys = {row.task.key for row in store.rows() if row.record is not None}
        missing = len({task.key for experiment in experiments for task in experiment.tasks()} - finished_keys)
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
                    for task in map(experiment.__getitem__, range(min(_MAX_TASKS_SHOWN, experiment.size)))
                ],
                "skipped": [{"system": system, "reason": reason} for system, reason in experiment.skipped],
            }
            for experiment in experiments
        ]
        print_json(
            {
                **envelope("batch run --dry-run"),
                "convention": lib.CONVENTION,
                "spec": path,
                "tasks": sum(experiment.size for experiment in experiments),
                "missing": missing,
                "experiments": data,
            }
        )
        return
    for experiment in experiments:
        print_stdout(f"{experiment.name}\t{experiment.kind.name}\t{_count_text(experiment.size)}\t{experiment.product}")
        for k in range(min(_MAX_TASKS_SHOWN, experiment.size)):
            task = experiment[k]
            set_options = {name: value for name, value in task.options.items() if value is not None}
            if "other" in set_options:
                set_options["other"] = lib.system_words(set_options["other"])
            print_stdout(f"\t{task.key[:8]}\t{lib.system_words(task.system)}\t{lib.option_words(set_options)}")
        if experiment.size > _MAX_TASKS_SHOWN:
            print_stdout(f"\t... and {experiment.size - _MAX_TASKS_SHOWN} more")
        for system, reason in experiment.skipped:
            print_stdout(f"\tskipped\t{system}\t{reason}")
    total = _count_text(sum(experiment.size for experiment in experiments))
    print_stdout(total if missing is None else f"{total}, {missing} of them without a result")


def _run_tasks(path: str | None, db: str, options: Mapping[str, Any]) -> int:
    """Run the tasks without a result and return the exit status; `path` is the spec, None to resume a database."""
    limits = {"max_tasks": options["max_tasks"] or lib.MAX_TASKS, "skip_bad": options["skip_bad"]}
    spec = None if path is None else lib.read_spec(path, **limits)
    experiments = () if spec is None else spec.experiments
    if spec is not None:
        _require_experiments(options["only"], [experiment.name for experiment in experiments])
    with lib.Store.open(db, create=spec is not None) as store:
        planned = {} if spec is None else lib.plan(spec, store)
        names = list(options["only"]) or ([e.name for e in experiments] if spec is not None else None)
        selection: dict[str, Any] = {"experiments": names, "shard": options["shard"] or (1, 1)}
        progress = BatchProgress(
            store.count_pending(**selection, retry_failed=options["retry_failed"]), options["quiet"]
        )
        for experiment in experiments:
            if experiment.skipped:
                progress.print(
                    f"{experiment.name}: {counted(len(experiment.skipped), 'system')} skipped (see batch status)"
                )
        for name, plan in planned.items():
            if not plan.is_resumed:
                phrases = [_count_text(plan.total)]
                phrases += [f"{plan.new_tasks} of them new"] if plan.new_tasks < plan.total else []
                phrases += [f"{plan.dropped} of the earlier plan are not in it"] if plan.dropped else []
                progress.print(f"{name}: {', '.join(phrases)}")
        expected_count = f"{_count_text(progress.expected_count)} to do, results go to {db}"
        progress.print(expected_count if progress.expected_count else f"nothing to do: every task has a result in {db}")
        was_interrupted = False
        if progress.expected_count:
            jobs = store.pending(**selection, retry_failed=options["retry_failed"])
            cluster = (options["scheduler"], options["worker_python"])
            processes = options["jobs"] or lib.processors()
            executor = lib.executor_for(store.document, processes, *cluster, options["group_seconds"], progress.print)
            with progress, closing(executor):
                batch, is_announced = lib.Batch(jobs, executor), False
                with interruptible(batch.interrupt):
                    for records in batch:
                        if batch.was_interrupted and not is_announced:  # not by the handler, which might split a line
                            is_announced = True
                            if executor.in_flight:
                                running = _count_text(executor.in_flight)
                                progress.print(f"finishing {running} in flight (Ctrl-C again ends at once)")
                        if records:  # store the records before the next job is submitted
                            store.add(records)
                        progress.add(records, executor.in_flight)
                        for record in records if options["as_jsonl"] else ():
                            click.echo(json.dumps({"record": "result", **record.to_json()}))
                was_interrupted = batch.was_interrupted
        missing = store.count_pending(**selection)
        data = _status_record(store, names or ())
    is_interrupted = was_interrupted and missing > 0
    failed_count = sum(count for e in data["experiments"] for name, count in e["outcomes"].items() if name != "ok")
    if options["as_json"]:
        run_entries = {"command": "batch run", "spec": path, "done": dict(progress.outcomes), "missing": missing}
        print_json({**data, **run_entries, "interrupted": is_interrupted, "seconds": round(progress.seconds, 3)})
    elif not options["as_jsonl"]:
        _print_status(data)
    if progress.done:
        progress.print(f"{_count_text(progress.done)} in {duration(progress.seconds)}")
    if progress.lost:
        progress.print(
            f"{_count_text(progress.lost)} lost without a result: their worker was killed or could not be started "
            f"{lib.TRIES} times ({progress.last_loss})"
        )
    command_words = ["kahanmaps", "batch", "run", *([f"./{path}" if path.startswith("-") else path] if path else [])]
    command_words += ["--db", db, *(word for name in options["only"] for word in ("-e", name))]
    for name in ("scheduler", "worker_python"):
        if options[name] is not None:
            command_words += [f"--{name.replace('_', '-')}", options[name]]
    if options["shard"]:
        command_words += ["--shard", f"{options['shard'][0]}/{options['shard'][1]}"]
    same_command = as_typed(command_words)
    if missing:
        prefix = "interrupted: " if is_interrupted else ""
        progress.print(f"{prefix}{_count_text(missing)} without a result yet; to continue: {same_command}")
    if failed_count:
        why = as_typed(["kahanmaps", "batch", "summary", "--db", db, "--by", "outcome,message"])
        progress.print(f"{_count_text(failed_count)} failed, why: {why}; to try again: {same_command} --retry-failed")
    if is_interrupted:
        return 130
    return 3 if failed_count or missing else 0


def _count_text(number: int) -> str:
    return counted(number, "task")


class BatchProgress(Progress):
    """Progress of a batch run; `expected_count` is the number of tasks to run."""

    def __init__(self, expected_count: int, quiet: bool) -> None:
        super().__init__(quiet)
        self.expected_count = expected_count
        self.outcomes: Counter[str] = Counter()
        self.last_loss = ""  # the message of the most recently lost task
        self._begin = time.monotonic()

    @property
    def done(self) -> int:
        """The number of tasks that have a result."""
        return sum(self.outcomes.values()) - self.lost

    @property
    def lost(self) -> int:
        """The number of lost tasks: they have no result, since their worker process was killed or did not start."""
        return self.outcomes["lost"]

    @property
    def seconds(self) -> float:
        """Seconds since the progress object was created."""
        return time.monotonic() - self._begin

    def add(self, records: Sequence[lib.Record], in_flight: int) -> None:
        """Count the new `records` (possibly none) and show progress; `in_flight` is the number of running tasks."""
        for record in records:
            self.outcomes[str(record.outcome)] += 1
            if record.outcome == "lost":
                self.last_loss = record.message
        rate = self.done / max(self.seconds, 1e-9)
        failed = self.done - self.outcomes["ok"]
        phrases = [f"{self.done} of {_count_text(self.expected_count)}", f"{rate:.3g} a second"]
        if self.done and self.done < self.expected_count:
            phrases.append(f"about {duration((self.expected_count - self.done) / rate)} left")
        counts = {"running": in_flight, "failed": failed, "lost": self.lost}
        self(", ".join([*phrases, *(f"{count} {word}" for word, count in counts.items() if count)]))

    def print(self, text: str) -> None:
        """Print a message on a line of its own, unless `quiet`."""
        if not self.quiet:
            self.clear()
            print_stderr(text)


@command.command("status")
@_database_option()
@_experiment_option
@json_option
def status(db: str, only: tuple[str, ...], as_json: bool) -> None:
    """Show the progress of the experiments in a database.

    \b
      kahanmaps batch status --db study.db
      kahanmaps batch status --db study.db --json | jq '.experiments[].missing'

    It may be used while a batch is running.
    """
    with lib.Store.open(db, readonly=True) as store:
        data = _status_record(store, only)
    if as_json:
        print_json(data)
    else:
        _print_status(data)


def _status_record(store: lib.Store, only: Sequence[str]) -> dict[str, Any]:
    experiments = store.status()
    _require_experiments(only, [experiment.name for experiment in experiments])
    return {
        **envelope("batch status"),
        "experiments": [
            {
                "name": experiment.name,
                "tasks": experiment.tasks,
                "missing": experiment.missing,
                "outcomes": {str(outcome): count for outcome, count in experiment.outcomes.items()},
                "verdicts": dict(experiment.verdicts),
                "seconds": round(experiment.seconds, 3),
                "skipped": [{"system": system, "reason": reason} for system, reason in experiment.skipped],
            }
            for experiment in experiments
            if not only or experiment.name in only
        ],
        "unplanned": store.unplanned(),
    }


def _require_experiments(only: Sequence[str], names: Sequence[str]) -> None:
    for name in only:
        if name not in names:
            hint = suggestion(name, names)
            raise lib.InputError(
                f"there is no experiment {quoted(name)}, expected one of {', '.join(names) or 'none'}{hint}"
            )


def _print_status(data: Mapping[str, Any]) -> None:
    rows = data["experiments"]
    kinds = ["ok", *(kind for kind in lib.STORED_OUTCOMES[1:] if any(row["outcomes"].get(kind) for row in rows))]
    verdicts = [verdict for verdict in lib.VERDICTS if any(row["verdicts"].get(verdict) for row in rows)]
    table = [["experiment", "tasks", "missing", *kinds, *verdicts, "time"]]
    for row in rows:
        counts = [row["tasks"], row["missing"], *(row["outcomes"].get(kind, 0) for kind in kinds)]
        counts += [row["verdicts"].get(verdict, 0) for verdict in verdicts]
        table.append([row["name"], *map(str, counts), duration(row["seconds"])])
    print_table(table)
    for row in rows:
        for skipped in row["skipped"]:
            print_raw(f"{row['name']} skips {skipped['system']}: {skipped['reason']}")
    if data["unplanned"]:
        click.echo(f"{data['unplanned']} results in addition belong to tasks of no current experiment")


@command.command("show")
@click.argument("key")
@_database_option()
@json_option
def show(key: str, db: str, as_json: bool) -> None:
    """Show a task of a database with its options and its result.

    \b
      kahanmaps batch show 3fa8 --db study.db
      kahanmaps batch show 3fa8 --db study.db --json | jq .result

    KEY is the key of the task or its first digits, at least four; batch run --dry-run and batch export list keys.
    With --json the system files of the task are shown as well ("documents").
    """
    with lib.Store.open(db, readonly=True) as store:
        matches = store.find(key)
        if not matches:
            raise lib.InputError(f"{db} has no task whose key begins with {key[:40]!r}: batch export lists the keys")
        for k, (task, record, places, attempts) in enumerate(matches):
            data: dict[str, Any] = {
                **envelope("batch show"),
                "convention": lib.CONVENTION,
                "key": task.key,
                "task": task.kind,
                "system": task.system,
                "options": dict(task.options),
                "places": [{"experiment": name, "number": number} for name, number in places],
                "attempts": attempts,
                **({} if record is None else {k: v for k, v in record.to_json().items() if k != "key"}),
                "documents": {key: json.loads(store.document(key)) for key in task.documents},
            }
            if as_json:
                print_json(data)
                continue
            click.echo("\n" * (k > 0), nl=False)
            entries = {
                "key": data["key"],
                "task": data["task"],
                "in": ", ".join(f"{place['experiment']} {place['number']}" for place in data["places"]) or "no plan",
                "system": data["system"],
                "options": {name: value for name, value in data["options"].items() if value is not None},
                "outcome": "none yet",
            }
            if "outcome" in data:
                entries["outcome"] = data["outcome"] + (f": {data['message']}" if data["message"] else "")
                entries |= {name: data[name] for name in ("verdict", "stderr") if data[name]}
                entries |= {f"result.{name}": value for name, value in (data["result"] or {}).items()}
                memory = "" if data["peak_memory"] is None else f", {data['peak_memory'] / 1e6:.0f} MB at most"
                entries["took"] = f"{data['seconds']:.3g} s{memory}, attempts: {data['attempts']}"
                versions = ", ".join(f"{name} {number}" for name, number in data["versions"].items())
                entries["where"] = f"{data['host']}, {data['finished']}, {versions}"
            for name, value in entries.items():
                text = value if isinstance(value, str) else json.dumps(value)
                print_stdout(
                    f"{name}\t" + (shorten(text, _MAX_VALUE_WIDTH) if on_terminal() else text).replace("\n", "\n\t")
                )


@command.command("export", short_help="Export results as CSV, JSON lines or Parquet.")
@_database_option()
@click.option("--csv", "form", flag_value="csv", help="Write a table: a column for each option and each result.")
@click.option("--jsonl", "form", flag_value="jsonl", help="Write one complete JSON object per line.")
@click.option(
    "--parquet", "form", flag_value="parquet", help="Write the table of --csv with typed columns (needs pyarrow, -o)."
)
@click.option("-o", "--output", type=OutputFile(), metavar="FILE", help="Write to FILE (default: standard output).")
@click.option("--stable", is_flag=True, help="Omit times, memory, hosts and versions, which differ between runs.")
@_experiment_option
def export(db: str, form: str | None, output: str | None, stable: bool, only: tuple[str, ...]) -> None:
    """Export the results of a database in the order of the plan.

    \b
      kahanmaps batch export --db study.db --csv -o study.csv
      kahanmaps batch export --db study.db --jsonl | jq .verdict
      kahanmaps batch export --db study.db --parquet -o study.parquet
    """
    if form is None:
        endings = {".csv": "csv", ".jsonl": "jsonl", ".parquet": "parquet"}
        form = endings.get(Path(output).suffix.lower()) if output else None
    if form is None:
        raise click.UsageError("missing --csv, --jsonl or --parquet")
    if form == "parquet" and output in (None, "-"):
        raise click.UsageError("--parquet needs -o FILE: Parquet is binary")
    with lib.Store.open(db, readonly=True) as store, ExitStack() as stack:
        rows = partial(store.rows, list(only) or None)
        if form == "parquet":
            lib.write_parquet(rows, str(output), stable=stable)
            return
        stream: Any = sys.stdout
        if output not in (None, "-"):  # a file is written atomically
            stream = codecs.getwriter("utf-8")(stack.enter_context(lib.atomic_write(str(output))))
        if form == "csv":
            lib.write_csv(rows, stream, stable=stable)
        else:
            lib.write_jsonl(rows(), stream, stable=stable)


@command.command("summary", short_help="Summarize groups of tasks by counts and quantiles.")
@_database_option()
@click.option("--by", default="experiment", show_default=True, metavar="NAME,...", help="Defines groups, e.g. m,eps.")
@click.option("--value", "values", multiple=True, metavar="NAME", help="Summarize only this entry. Repeatable.")
@click.option("--stable", is_flag=True, help="Omit times and memory.")
@click.option("--markdown", "as_markdown", is_flag=True, help="Print tables in Markdown.")
@_experiment_option
@json_option
def summary(
    db: str, by: str, values: tuple[str, ...], stable: bool, as_markdown: bool, only: tuple[str, ...], as_json: bool
) -> None:
    """Summarize groups of tasks: outcomes, verdicts, and quantiles of numbers.

    \b
      kahanmaps batch summary --db study.db --by m,eps
      kahanmaps batch summary --db study.db --by m --value constant --markdown
      kahanmaps batch summary --db study.db --by outcome,message  # why tasks fail

    --by accepts options (eps), parts of the system (name, m, seed, parameters.a), entries of results (dimension,
    growth), and experiment, task, outcome, verdict, message.
    """
    if as_json and as_markdown:
        raise click.UsageError("give --json or --markdown, not both")
    names = [name.strip() for name in by.split(",") if name.strip()]
    with lib.Store.open(db, readonly=True) as store:
        rows = store.rows(list(only) or None, missing=True)
        result = lib.summarise(rows, names, list(values) or None, stable=stable)
    if as_json:
        print_json({**envelope("batch summary"), "convention": lib.CONVENTION, **result.to_json()})
    elif as_markdown:
        print_raw(lib.summary_markdown(result), end="")
    elif on_terminal():
        for table in result.tables(digits=4):
            print_table([table.columns, *table.rows], text_count=table.words)
    else:
        for line in result.lines():
            print_raw(line)


@command.command("merge", short_help="Merge databases of results.")
@click.argument("target", type=click.Path(dir_okay=False))
@click.argument("sources", nargs=-1, required=True, type=click.Path(dir_okay=False))
@output_options
def merge(target: str, sources: tuple[str, ...], as_json: bool, quiet: bool) -> int:
    """Merge the results of SOURCES into TARGET, which is created if it does not exist.

    \b
      kahanmaps batch merge all.db part1.db part2.db
      kahanmaps batch merge A.db B.db

    Exit status: 0 done, 2 usage error, 3 some task has different results in two databases (those of TARGET are kept).
    """
    for source in sources:  # check all sources before an empty target is created
        lib.Store.open(source, readonly=True).close()
    with lib.Store.open(target, create=True) as store:
        merged = [(source, store.merge(source)) for source in sources]
    conflicts = sum(counts.conflicts for _, counts in merged)
    if as_json:
        data = [{"source": source, **asdict(counts)} for source, counts in merged]
        print_json({**envelope("batch merge"), "target": target, "merged": data})
    else:
        for source, counts in merged:
            print_raw(
                f"{source}\tnew results: {counts.results}\tfailures replaced: {counts.replaced}\t"
                f"conflicts: {counts.conflicts}"
            )
    if conflicts and not quiet:
        keys = [key for _, counts in merged for key in counts.conflicting]
        print_stderr(
            f"{lib.counted(conflicts, 'task')} with different results in two databases, those of {target} were kept: "
            f"{', '.join(keys[:3])}{', ...' if len(keys) > 3 else ''} (batch show KEY --db FILE)"
        )
    return 3 if conflicts else 0


@command.command("tasks", short_help="List the kinds of tasks and their options.")
@click.argument("name", required=False)
@json_option
def tasks(name: str | None, as_json: bool) -> None:
    """List the kinds of tasks of an experiment, or the options of one kind with defaults.

    \b
      kahanmaps batch tasks
      kahanmaps batch tasks check-commute
    """
    kinds = list(lib.task_kinds().values()) if name is None else [lib.task_kind(name)]
    if as_json:
        data = [
            {
                "name": kind.name,
                "summary": kind.summary,
                "needs": kind.needs,
                "options": {
                    key: {"help": option.help, "required": key in kind.required, "default": kind.defaults.get(key)}
                    for key, option in kind.options.items()
                },
            }
            for kind in kinds
        ]
        print_json({**envelope("batch tasks"), "tasks": data})
        return
    width = max(len(kind.name) for kind in kinds)
    for kind in kinds:
        print_entry(f"{kind.name:<{width}}  ", kind.summary)
    if name is None:
        print_stdout("'kahanmaps batch tasks NAME' lists the options of a kind")
        return
    kind = kinds[0]
    print_stdout(f"system: {_SYSTEMS_OF_TASKS[kind.needs]}")
    for key, option in kind.options.items():
        default = "required" if key in kind.required else f"default {json.dumps(kind.defaults[key])}"
        print_entry(f"  {key:<12}  ", option.help + (f" ({default})" if default != "default null" else ""))
    if kind.needs is not None:
        print_stdout('with system = "family" also:')
        for key, option in lib.FAMILY.items():
            print_entry(f"  {key:<12}  ", option.help)
        if "seed" not in kind.options:
            print_entry(f"  {'seed':<12}  ", "random seed (default 0)")
