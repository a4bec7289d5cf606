"""Shell completion of systems and files.

Completion must be fast, so this module does not import the library. It reports no errors, since a traceback would
disturb the command line.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import click


def complete_system(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Return the catalogue names, TOML files and folders that start with `incomplete`."""
    from kahanmaps.documents.catalog import names

    return [*(name for name in names() if name.startswith(incomplete)), *complete_toml(context, parameter, incomplete)]


def complete_toml(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Return the TOML files, and the folders with a final slash, that start with `incomplete`."""
    folder, slash, start = incomplete.rpartition("/")
    prefix = folder + slash
    matches = []
    try:
        with os.scandir(os.path.expanduser(prefix) or ".") as entries:
            for entry in entries:
                if not entry.name.startswith(start) or (entry.name.startswith(".") and not start):
                    continue
                if entry.is_dir():
                    matches.append(f"{prefix}{entry.name}/")
                elif entry.name.endswith(".toml"):
                    matches.append(prefix + entry.name)
    except OSError:  # the folder does not exist
        return []
    return sorted(matches)
