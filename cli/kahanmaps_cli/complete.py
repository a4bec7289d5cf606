"""What a shell is offered while a command is being written: systems, files, parameters, kinds of tasks.

It has to be there at once, so nothing is loaded that computes, and it says nothing when something is wrong: a
traceback in the middle of a command line helps nobody.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Callable, Sequence
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import click
    from click.shell_completion import CompletionItem

Completer = Callable[["click.Context", "click.Parameter", str], "list[CompletionItem]"]
_MAX_BYTES = 1_000_000


def _silently(function: Callable[[click.Context, str], Sequence[str]]) -> Completer:
    """The completions that the function finds, none where it fails."""

    @wraps(function)
    def complete(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
        from click.shell_completion import CompletionItem

        try:
            return [CompletionItem(text) for text in function(context, incomplete)]
        except Exception:  # a line that is being typed is no place for a message, whatever stands in somebody's file
            if os.environ.get("KAHANMAPS_DEBUG"):
                raise
            return []

    return complete


@_silently
def complete_system(context: click.Context, incomplete: str) -> list[str]:
    """Names of the catalogue, and system files."""
    return [*_catalogue_names(incomplete), *toml_files(incomplete)]


@_silently
def complete_toml(context: click.Context, incomplete: str) -> list[str]:
    """TOML files."""
    return toml_files(incomplete)


@_silently
def complete_parameter(context: click.Context, incomplete: str) -> list[str]:
    """NAME= for the parameters of the system that the line names."""
    return [f"{name}=" for name in _parameters(context) if name.startswith(incomplete)]


@_silently
def complete_symbols(context: click.Context, incomplete: str) -> list[str]:
    """One more parameter of the system in a list with commas."""
    before, comma, last = incomplete.rpartition(",")
    given = before.split(",")
    names = [name for name in (*_parameters(context), "eps") if name not in given]
    return [before + comma + name for name in names if name.startswith(last)]


@_silently
def complete_task(context: click.Context, incomplete: str) -> list[str]:
    """Kinds of tasks."""
    from kahanmaps.experiments.registry import task_kinds

    return [name for name in task_kinds() if name.startswith(incomplete)]


def toml_files(incomplete: str) -> list[str]:
    """The TOML files that begin so, and the folders, which end with a slash."""
    _, _, start = incomplete.rpartition("/")
    prefix = incomplete[: len(incomplete) - len(start)]
    found = []
    with os.scandir(os.path.expanduser(prefix) or ".") as entries:
        for entry in entries:
            if not entry.name.startswith(start) or (entry.name.startswith(".") and not start):
                continue
            if entry.is_dir():
                found.append(f"{prefix}{entry.name}/")
            elif entry.name.endswith(".toml"):
                found.append(prefix + entry.name)
    return sorted(found)


def _catalogue_names(incomplete: str) -> list[str]:
    from kahanmaps.documents.catalog import names

    return [name for name in names() if name.startswith(incomplete)]


def _parameters(context: click.Context) -> list[str]:
    """The names in the section [parameters] of the file of the system, read as data."""
    # Where a value is missing at the end click has not told the arguments from each other.
    named = context.params.get("system") or context.params.get("name") or next(iter(context.args), "")
    reference = str(named)
    path = Path(reference).expanduser()
    if reference in _catalogue_names(""):
        from kahanmaps.documents import catalog

        path = Path(catalog.__file__).with_name(f"{reference}.toml")
    if not path.is_file() or path.stat().st_size > _MAX_BYTES:
        return []
    section: Any = tomllib.loads(path.read_text(encoding="utf-8")).get("parameters", {})
    return list(section) if isinstance(section, dict) else []
