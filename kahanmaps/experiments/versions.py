"""With what, and where, a task was done."""

from __future__ import annotations

import platform
from functools import cache
from importlib.metadata import version


@cache
def versions() -> dict[str, str]:
    """The versions that a result may depend on."""
    import flint

    from kahanmaps.version import __version__

    return {
        "kahanmaps": __version__,
        "python": platform.python_version(),
        "python-flint": version("python-flint"),
        "flint": str(getattr(flint, "__FLINT_VERSION__", "unknown")),
    }


@cache
def host_name() -> str:
    """The name of this machine."""
    return platform.node()
