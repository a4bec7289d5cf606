"""What a database of results looks like: status, single tasks, summaries, exports, the list of tasks."""

from __future__ import annotations

import codecs
import json
import sys
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from typing import Any

import click

from kahanmaps.errors import quoted, suggestion
from kahanmaps_cli import library as lib
from kahanmaps_cli.screen.progress import duration
from kahanmaps_cli.screen.render import envelope, print_json
from kahanmaps_cli.screen.terminal import echo, on_terminal, print_table, shorten, tell, tell_entry

_VALUE_WIDTH = 300


def status_data(store: lib.Store, only: Sequence[str]) -> dict[str, Any]:
    """How far the experiments are, as plain data."""
    found = store.status()
    require_experiments(only, [one.name for one in found])
    return {
        **envelope("batch status"),
        "experiments": [
            {
                "name": one.name,
                "tasks": one.tasks,
                "missing": one.missing,
                "outcomes": {str(outcome): count for outcome, count in one.outcomes.items() if count},
                "verdicts": dict(one.verdicts),
                "seconds": round(one.seconds, 3),
                "skipped": [{"system": system, "reason": reason} for system, reason in one.skipped],
            }
            for one in found
            if not only or one.name in only
        ],
        "unplanned": store.unplanned(),
    }


def require_experiments(only: Sequence[str], known: Sequence[str]) -> None:
    """Raises InputError for a name that no experiment has."""
    for name in only:
        if name not in known:
            hint = suggestion(name, known)
            raise lib.InputError(
                f"there is no experiment {quoted(name)}, expected one of {', '.join(known) or 'none'}{hint}"
            )


def print_status(data: Mapping[str, Any]) -> None:
    """A line for each experiment."""
    kinds = ("ok", "failed", "crashed", "timeout", "out-of-memory")
    verdicts = ("proved", "supported", "refuted", "undecided")
    rows = data["experiments"]
    shown = [kind for kind in kinds if kind == "ok" or any(row["outcomes"].get(kind) for row in rows)]
    given = [verdict for verdict in verdicts if any(row["verdicts"].get(verdict) for row in rows)]
    table = [["experiment", "tasks", "missing", *shown, *given, "time"]]
    for row in rows:
        numbers = [row["tasks"], row["missing"], *(row["outcomes"].get(kind, 0) for kind in shown)]
        numbers += [row["verdicts"].get(verdict, 0) for verdict in given]
        table.append([row["name"], *map(str, numbers), duration(row["seconds"])])
    print_table(table)
    for row in rows:
        for one in row["skipped"]:
            echo(f"{row['name']} skips {one['system']}: {one['reason']}")
    if data["unplanned"]:
        click.echo(f"{data['unplanned']} more results belong to tasks that no experiment has now")


def found_data(store: lib.Store, found: lib.Found) -> dict[str, Any]:
    """A task and its record as plain data."""
    task, record, places, attempts = found
    return {
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


def print_found(data: Sequence[Mapping[str, Any]]) -> None:
    """A block of lines for each task."""
    for k, one in enumerate(data):
        if k:
            click.echo()
        lines = [
            ("key", one["key"]),
            ("task", one["task"]),
            ("in", ", ".join(f"{place['experiment']} {place['number']}" for place in one["places"]) or "no plan"),
            ("system", _compact(one["system"])),
            ("options", _compact({name: v for name, v in one["options"].items() if v is not None})),
        ]
        if "outcome" not in one:
            lines.append(("outcome", "none yet"))
        else:
            lines.append(("outcome", one["outcome"] + (f": {one['message']}" if one["message"] else "")))
            if one["verdict"] is not None:
                lines.append(("verdict", one["verdict"]))
            lines += [("result." + name, _compact(value)) for name, value in (one["result"] or {}).items()]
            if one["stderr"]:
                lines.append(("stderr", one["stderr"]))
            memory = "" if one["peak_memory"] is None else f", {one['peak_memory'] / 1e6:.0f} MB at most"
            lines.append(("took", f"{one['seconds']:.3g} s{memory}, attempts: {one['attempts']}"))
            versions = ", ".join(f"{name} {number}" for name, number in one["versions"].items())
            lines.append(("where", f"{one['host']}, {one['finished']}, {versions}"))
        for name, text in lines:
            tell(f"{name}\t" + (shorten(text, _VALUE_WIDTH) if on_terminal() else text).replace("\n", "\n\t"))


def print_summary(
    store: lib.Store,
    by: Sequence[str],
    *,
    as_json: bool,
    as_markdown: bool,
    values: Sequence[str],
    stable: bool,
    only: Sequence[str],
) -> None:
    """The tables of a summary."""
    found = lib.summarise(store.rows(list(only) or None, missing=True), by, list(values) or None, stable=stable)
    if as_json:
        print_json({**envelope("batch summary"), "convention": lib.CONVENTION, **found.to_json()})
    elif as_markdown:
        echo(lib.summary_markdown(found), end="")
    elif on_terminal():
        for table in found.tables(digits=4):
            print_table([table.columns, *table.rows], words=table.words)
    else:
        for line in found.lines():
            echo(line)


def export_rows(store: lib.Store, form: str, output: str | None, stable: bool, only: list[str] | None) -> None:
    """Write the results; a file is complete or is not there."""
    if form == "parquet" and output is not None:
        lib.write_parquet(lambda: store.rows(only), output, stable=stable)
        return
    with ExitStack() as stack:
        stream: Any = sys.stdout
        if output not in (None, "-"):
            stream = codecs.getwriter("utf-8")(stack.enter_context(lib.whole_file(output)))
        if form == "csv":
            lib.write_csv(lambda: store.rows(only), stream, stable=stable)
        else:
            lib.write_jsonl(store.rows(only), stream, stable=stable)


def print_tasks(name: str | None, as_json: bool) -> None:
    """The kinds of tasks, or one with its options."""
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
        tell_entry(f"{kind.name:<{width}}  ", kind.summary)
    if name is None:
        tell("'kahanmaps batch tasks NAME' has the options of one of them")
        return
    kind = kinds[0]
    tell(f"system: {_NEEDS[kind.needs]}")
    for key, option in kind.options.items():
        default = "required" if key in kind.required else f"default {json.dumps(kind.defaults[key])}"
        tell_entry(f"  {key:<12}  ", option.help + (f" ({default})" if default != "default null" else ""))
    if kind.needs is not None:
        tell('with system = "family" also:')
        for key, option in lib.FAMILY.items():
            tell_entry(f"  {key:<12}  ", option.help)
        if "seed" not in kind.options:
            tell_entry(f"  {'seed':<12}  ", "seed of everything drawn at random (default 0)")


_NEEDS = {
    None: "none",
    "system": '"family", a name of the catalogue, a file, or a list of these',
    "member": '"family", or files of kind [family]',
    "member or other": '"family", files of kind [family], or any other system together with a second one (other)',
}


def _compact(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)
