"""What a shell is offered while a command is being written: systems and files.

It has to be there at once, so nothing is loaded that computes, and it says nothing when something is wrong: a
traceback in the middle of a command line helps nobody.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import click


def complete_system(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Names of the catalogue, and system files."""
    from kahanmaps.documents.catalog import names

    return [*(name for name in names() if name.startswith(incomplete)), *complete_toml(context, parameter, incomplete)]


def complete_toml(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """The TOML files that begin so, and the folders, which end with a slash."""
    folder, slash, start = incomplete.rpartition("/")
    prefix = folder + slash
    found = []
    try:
        with os.scandir(os.path.expanduser(prefix) or ".") as entries:
            for entry in entries:
                if not entry.name.startswith(start) or (entry.name.startswith(".") and not start):
                    continue
                if entry.is_dir():
                    found.append(f"{prefix}{entry.name}/")
                elif entry.name.endswith(".toml"):
                    found.append(prefix + entry.name)
    except OSError:  # there is no such folder
        return []
    return sorted(found)
