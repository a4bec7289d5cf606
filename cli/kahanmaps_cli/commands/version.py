"""kahanmaps version."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as version_of

import click

from kahanmaps_cli.options import json_option
from kahanmaps_cli.screen.render import print_json
from kahanmaps_cli.screen.terminal import print_stdout


@click.command("version")
@json_option
def command(as_json: bool) -> None:
    """Print the versions of kahanmaps and its libraries.

    \b
      kahanmaps version --json
    """
    import flint

    from kahanmaps.version import __version__

    versions = {
        "kahanmaps": __version__,
        "python": platform.python_version(),
        "python-flint": version_of("python-flint"),
        "flint": str(getattr(flint, "__FLINT_VERSION__", "unknown")),
    }
    for package in ("numpy", "click", "rich"):
        try:
            versions[package] = version_of(package)
        except PackageNotFoundError:
            versions[package] = "absent"
    if as_json:
        print_json(versions)
        return
    for name, number in versions.items():
        print_stdout(f"{name}\t{number}")
