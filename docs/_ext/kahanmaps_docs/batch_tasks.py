"""What batches can do, from the registry of tasks, and the tables of their databases."""

from __future__ import annotations

from typing import Any

from kahanmaps.experiments.options import VOCABULARY
from kahanmaps.experiments.registry import TaskKind, task_kinds
from kahanmaps.experiments.results.store import SCHEMA
from kahanmaps_docs.markdown import block, code, plain, table


def batch_tasks() -> str:
    """A section for every task, then all options."""
    kinds = list(task_kinds().values())
    pieces = [section(kind) for kind in kinds]
    rows = [(code(name), plain(option.help), ", ".join(asked_by(name, kinds))) for name, option in VOCABULARY.items()]
    return "\n".join([*pieces, "## All options\n", table(("option", "", "tasks"), rows)])


def asked_by(option: str, kinds: list[TaskKind]) -> list[str]:
    """Links to the tasks that have this option."""
    return [f"[{kind.name}](#task-{kind.name})" for kind in kinds if option in kind.options]


def section(kind: TaskKind) -> str:
    """A task: what it does, its options and their defaults."""
    rows = [
        (code(name), plain(option.help), "required" if name in kind.required else default(kind.defaults[name]))
        for name, option in kind.options.items()
    ]
    title = f"(task-{kind.name})=\n## {kind.name}\n\n{plain(kind.summary)}\n"
    return "\n".join([title, table(("option", "", "default"), rows)] if rows else [title])


def default(value: Any) -> str:
    """A default value as a spec would say it."""
    return "" if value is None else code(str(value).lower() if isinstance(value, bool) else str(value))


def database_tables() -> str:
    """The tables, as SQL statements that create them."""
    return block(SCHEMA.strip(), "sql")
