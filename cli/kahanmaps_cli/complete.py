"""What a shell is offered while a command is being written: systems and files.

It has to be there at once, so nothing is loaded that computes, and it says nothing when something is wrong: a
traceback in the middle of a command line helps nobody.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import wraps
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import click
    from click.shell_completion import CompletionItem

Completer = Callable[["click.Context", "click.Parameter", str], "list[CompletionItem]"]


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
    from kahanmaps.documents.catalog import names

    return [*(name for name in names() if name.startswith(incomplete)), *toml_files(incomplete)]


@_silently
def complete_toml(context: click.Context, incomplete: str) -> list[str]:
    """TOML files."""
    return toml_files(incomplete)


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
