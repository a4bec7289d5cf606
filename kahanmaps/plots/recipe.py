"""How a picture was made: the command line and the system, as plain text in the metadata of its file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from kahanmaps.version import __version__

# The keys of the version, the command and the system, where programs show them; dates are left out, so that the same
# picture is the same file.
_KEYS: dict[str, tuple[str, str, str]] = {
    "pdf": ("Creator", "Subject", "Keywords"),
    "svg": ("Creator", "Description", "Source"),
    "png": ("Software", "Description", "Comment"),
}
_NO_DATES = {"pdf": {"CreationDate": None}, "svg": {"Date": None}, "png": {}}


@dataclass(frozen=True)
class Recipe:
    """The command that makes a picture, the version that made it, and the system as TOML (empty without one).

    >>> Recipe("kahanmaps plot degrees harmonic -o d.png", version="1.0").metadata("png")
    {'Software': 'kahanmaps 1.0', 'Description': 'kahanmaps plot degrees harmonic -o d.png'}
    """

    command: str = ""
    system: str = ""
    version: str = __version__

    def metadata(self, kind: str) -> dict[str, Any]:
        """The recipe as metadata of matplotlib for "pdf", "svg" or "png"."""
        texts = zip(_KEYS[kind], (f"kahanmaps {self.version}", self.command, self.system), strict=True)
        return {**{key: text for key, text in texts if text}, **_NO_DATES[kind]}
