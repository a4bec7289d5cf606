"""kahanmaps batch run | status | show | export | summary | merge | tasks."""

from __future__ import annotations

import codecs
import sys
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import click

from kahanmaps_cli import library as lib
from kahanmaps_cli.complete import complete_toml
from kahanmaps_cli.groups import SuggestingGroup
from kahanmaps_cli.options import json_option, output_options
from kahanmaps_cli.params import Shard
from kahanmaps_cli.runs.batch_run import dry_run, run_batch
from kahanmaps_cli.runs.batch_show import print_status, print_task, print_tasks, status_data, task_data
from kahanmaps_cli.screen.outputs import OutputFile
from kahanmaps_cli.screen.progress import say
from kahanmaps_cli.screen.render import envelope, print_json
from kahanmaps_cli.screen.terminal import echo, on_terminal, print_table

F = TypeVar("F", bound=Callable[..., Any])

_ONLY = click.option(
    "-e", "--experiment", "only", multiple=True, metavar="NAME", help="Only this experiment. Repeatable."
)


def _database(required: bool = True) -> Callable[[F], F]:
    return click.option(
        "--db",
        type=click.Path(dir_okay=False),
        envvar="KAHANMAPS_DB",
        required=required,
        metavar="FILE",
        help="The database of results (or set KAHANMAPS_DB).",
    )


@click.group("batch", cls=SuggestingGroup)
def command() -> None:
    """Thousands of experiments from one file: planned, run in worker processes, stored, resumed.

    \b
      kahanmaps batch run study.toml -j 2       # results go to study.db
      kahanmaps batch run study.toml --dry-run
      kahanmaps batch status --db study.db
      kahanmaps batch summary --db study.db --by m,eps
      kahanmaps batch export --db study.db --csv -o study.csv
      kahanmaps batch tasks                     # what an experiment can do

    docs/batch.md describes the file, and how to use many machines.
    """


@command.command("run", short_help="Do the tasks of a spec, with the results in a database.")
@click.argument("spec", required=False, type=click.Path(dir_okay=False), shell_complete=complete_toml)
@_database(required=False)
@click.option(
    "-j",
    "--jobs",
    type=click.IntRange(1, 1024),
    metavar="N",
    help="Worker processes at a time (default: the processors).",
)
@_ONLY
@click.option("--shard", type=Shard(), metavar="I/N", help="Only the I-th of N parts: for job arrays.")
@click.option("--retry-failed", is_flag=True, help="Do failed tasks again as well.")
@click.option("--dry-run", is_flag=True, help="Check the spec, show how many tasks there are and the first few.")
@click.option(
    "--skip-bad",
    is_flag=True,
    help='Leave out systems that cannot be read, and list them in the database (on_error = "skip" in the spec).',
)
@click.option(
    "--max-tasks", type=click.IntRange(1), metavar="N", help="Refuse specs with more tasks (default 1000000)."
)
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Use the workers of a dask scheduler that you trust: tls://host:port, tcp://host:port or its file.",
)
@click.option("--worker-python", metavar="PATH", help="The Python of those workers (default: the path of this one).")
@click.option(
    "--group-seconds",
    type=click.FloatRange(0, 86400),
    metavar="T",
    default=5.0,
    show_default=True,
    help="Short tasks share a worker process, or a command on the cluster, for so long.",
)
@click.option("--jsonl", "as_jsonl", is_flag=True, help="Every record on standard output, as it comes in.")
@output_options
def run(spec: str | None, db: str | None, **options: Any) -> int:
    """Do the tasks of SPEC that have no result yet, and put the results into a database.

    \b
      kahanmaps batch run study.toml --dry-run
      kahanmaps batch run study.toml -j 2              # results in study.db
      kahanmaps batch run study.toml --db all.db       # does what is missing
      kahanmaps batch run --db all.db --retry-failed   # without the spec
      kahanmaps batch run study.toml --shard 3/16 --db part3.db
      kahanmaps batch run study.toml --scheduler tcp://head:8786

    Every result is in the database the moment it is there: whatever is killed, only tasks in flight are lost, and the
    same command continues. Ctrl-C lets the tasks in flight end, for ten seconds at most; a second one ends at once.

    Exit status: 0 every task is done, whatever the verdicts, 2 usage error, 3 some task failed or has no result, 130
    interrupted.
    """
    if options["as_json"] and options["as_jsonl"]:
        raise click.UsageError("give --json or --jsonl, not both")
    if spec is None and (db is None or options["dry_run"]):
        raise click.UsageError("missing SPEC, a TOML file with experiments (or --db FILE, to continue what is in it)")
    if options["scheduler"] is not None and options["jobs"] is not None:
        raise click.UsageError("give --jobs or --scheduler, not both: on a cluster its workers say how many")
    db = db or Path(str(spec)).with_suffix(".db").name
    if options["dry_run"]:
        return dry_run(str(spec), db, options)
    return run_batch(spec, db, options)


@command.command("status")
@_database()
@_ONLY
@json_option
def status(db: str, only: tuple[str, ...], as_json: bool) -> None:
    """How far the experiments in a database have come.

    \b
      kahanmaps batch status --db study.db
      kahanmaps batch status --db study.db --json | jq '.experiments[].missing'

    May be asked while a batch is running.
    """
    with _open(db) as store:
        data = status_data(store, only)
    if as_json:
        print_json(data)
    else:
        print_status(data)


@command.command("show")
@click.argument("key")
@_database()
@json_option
def show(key: str, db: str, as_json: bool) -> None:
    """One task with all that is known of it.

    \b
      kahanmaps batch show 3fa8 --db study.db
      kahanmaps batch show 3fa8 --db study.db --json | jq .result

    KEY: the first digits of its key, four or more; batch run --dry-run and batch export have the keys.
    """
    with _open(db) as store:
        found = store.find(key)
        if not found:
            raise lib.InputError(f"{db} has no task whose key begins with {key[:40]!r}: batch export lists the keys")
        for k, data in enumerate(task_data(store, one) for one in found):
            if as_json:
                print_json(data)
            else:
                click.echo("\n" * (k > 0), nl=False)
                print_task(data)


@command.command("export", short_help="The results as CSV, JSON lines or Parquet.")
@_database()
@click.option("--csv", "form", flag_value="csv", help="A table, a column for each option and each entry of results.")
@click.option("--jsonl", "form", flag_value="jsonl", help="One JSON object a line, everything in it.")
@click.option("--parquet", "form", flag_value="parquet", help="The table of --csv with types; needs pyarrow, and -o.")
@click.option("-o", "--output", type=OutputFile(), metavar="FILE", help="Write to FILE.")
@click.option("--stable", is_flag=True, help="Leave out times, memory, hosts and versions: the same work, same bytes.")
@_ONLY
def export(db: str, form: str | None, output: str | None, stable: bool, only: tuple[str, ...]) -> None:
    """Write the results of a database to standard output or a file, in the order of the plan.

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
        raise click.UsageError("--parquet needs -o FILE: it is no text")
    with _open(db) as store, ExitStack() as stack:
        rows = partial(store.rows, list(only) or None)
        if form == "parquet":
            lib.write_parquet(rows, str(output), stable=stable)
            return
        stream: Any = sys.stdout
        if output not in (None, "-"):  # a file is complete or is not there
            stream = codecs.getwriter("utf-8")(stack.enter_context(lib.whole_file(str(output))))
        if form == "csv":
            lib.write_csv(rows, stream, stable=stable)
        else:
            lib.write_jsonl(rows(), stream, stable=stable)


@command.command("summary", short_help="Counts and quantiles for groups of tasks.")
@_database()
@click.option("--by", default="experiment", show_default=True, metavar="NAME,...", help="Group by these, e.g. m,eps.")
@click.option("--value", "values", multiple=True, metavar="NAME", help="Only these numbers. Repeatable.")
@click.option("--stable", is_flag=True, help="Leave out times and memory.")
@click.option("--markdown", "as_markdown", is_flag=True, help="Tables in Markdown.")
@_ONLY
@json_option
def summary(
    db: str, by: str, values: tuple[str, ...], stable: bool, as_markdown: bool, only: tuple[str, ...], as_json: bool
) -> None:
    """Counts of outcomes and verdicts, and quantiles of the numbers, for groups of tasks.

    \b
      kahanmaps batch summary --db study.db --by m,eps
      kahanmaps batch summary --db study.db --by m --value constant --markdown
      kahanmaps batch summary --db study.db --by outcome,message  # why they fail

    --by takes options (eps), parts of the system (name, m, seed, parameters.a), entries of results (dimension,
    growth), and experiment, task, outcome, verdict, message.
    """
    if as_json and as_markdown:
        raise click.UsageError("give --json or --markdown, not both")
    names = [name.strip() for name in by.split(",") if name.strip()]
    with _open(db) as store:
        rows = store.rows(list(only) or None, missing=True)
        result = lib.summarise(rows, names, list(values) or None, stable=stable)
    if as_json:
        print_json({**envelope("batch summary"), "convention": lib.CONVENTION, **result.to_json()})
    elif as_markdown:
        echo(lib.summary_markdown(result), end="")
    elif on_terminal():
        for table in result.tables(digits=4):
            print_table([table.columns, *table.rows], words=table.words)
    else:
        for line in result.lines():
            echo(line)


@command.command("merge", short_help="Bring the results of several databases together.")
@click.argument("target", type=click.Path(dir_okay=False))
@click.argument("sources", nargs=-1, required=True, type=click.Path(dir_okay=False))
@output_options
def merge(target: str, sources: tuple[str, ...], as_json: bool, quiet: bool) -> int:
    """Bring the results of SOURCES into TARGET, which is made if it is not there.

    \b
      kahanmaps batch merge all.db part1.db part2.db
      kahanmaps batch merge A.db B.db

    Exit status: 0 done, 2 usage error, 3 some task has different results in two of them (those of TARGET are kept).
    """
    for source in sources:  # one that cannot be read is told before an empty target is made
        lib.Store.open(source, readonly=True).close()
    with lib.Store.open(target, create=True) as store:
        merged = [(source, store.merge(source)) for source in sources]
    conflicts = sum(found.conflicts for _, found in merged)
    if as_json:
        data = [{"source": source, **asdict(found)} for source, found in merged]
        print_json({**envelope("batch merge"), "target": target, "merged": data})
    else:
        for source, found in merged:
            counts = f"new results: {found.results}\tfailures replaced: {found.replaced}\tconflicts: {found.conflicts}"
            echo(f"{source}\t{counts}")
    if conflicts and not quiet:
        keys = [key for _, found in merged for key in found.conflicting]
        say(
            f"{lib.counted(conflicts, 'task')} with different results in two databases, those of {target} were kept: "
            f"{', '.join(keys[:3])}{', ...' if len(keys) > 3 else ''} (batch show KEY --db FILE)"
        )
    return 3 if conflicts else 0


@command.command("tasks", short_help="What an experiment can do, with all options.")
@click.argument("name", required=False)
@json_option
def tasks(name: str | None, as_json: bool) -> None:
    """What an experiment can do: the kinds of tasks, and their options with defaults.

    \b
      kahanmaps batch tasks
      kahanmaps batch tasks check-commute
    """
    print_tasks(name, as_json)


def _open(db: str) -> lib.Store:
    return lib.Store.open(db, readonly=True)
