"""What is in a database of results, and what tasks there are: as plain data, and printed."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
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
    experiments = store.status()
    require_experiments(only, [experiment.name for experiment in experiments])
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
    rows = data["experiments"]
    kinds = ["ok", *(kind for kind in lib.KEPT[1:] if any(row["outcomes"].get(kind) for row in rows))]
    verdicts = [verdict for verdict in lib.VERDICTS if any(row["verdicts"].get(verdict) for row in rows)]
    table = [["experiment", "tasks", "missing", *kinds, *verdicts, "time"]]
    for row in rows:
        counts = [row["tasks"], row["missing"], *(row["outcomes"].get(kind, 0) for kind in kinds)]
        counts += [row["verdicts"].get(verdict, 0) for verdict in verdicts]
        table.append([row["name"], *map(str, counts), duration(row["seconds"])])
    print_table(table)
    for row in rows:
        for skipped in row["skipped"]:
            echo(f"{row['name']} skips {skipped['system']}: {skipped['reason']}")
    if data["unplanned"]:
        click.echo(f"{data['unplanned']} more results belong to tasks that no experiment has now")


def task_data(store: lib.Store, found: lib.Found) -> dict[str, Any]:
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


def print_task(data: Mapping[str, Any]) -> None:
    """A block of lines."""
    lines = {
        "key": data["key"],
        "task": data["task"],
        "in": ", ".join(f"{place['experiment']} {place['number']}" for place in data["places"]) or "no plan",
        "system": data["system"],
        "options": {name: value for name, value in data["options"].items() if value is not None},
        "outcome": "none yet",
    }
    if "outcome" in data:
        lines["outcome"] = data["outcome"] + (f": {data['message']}" if data["message"] else "")
        lines |= {name: data[name] for name in ("verdict", "stderr") if data[name]}
        lines |= {f"result.{name}": value for name, value in (data["result"] or {}).items()}
        memory = "" if data["peak_memory"] is None else f", {data['peak_memory'] / 1e6:.0f} MB at most"
        lines["took"] = f"{data['seconds']:.3g} s{memory}, attempts: {data['attempts']}"
        versions = ", ".join(f"{name} {number}" for name, number in data["versions"].items())
        lines["where"] = f"{data['host']}, {data['finished']}, {versions}"
    for name, value in lines.items():
        text = value if isinstance(value, str) else json.dumps(value)
        tell(f"{name}\t" + (shorten(text, _VALUE_WIDTH) if on_terminal() else text).replace("\n", "\n\t"))


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
