"""How a picture was made: the command line and the system, written into its file and read from it.

The command stands where programs show what a picture is (Subject in PDF, Description in SVG and PNG). All of it once
more, for `read_recipe`, is one word that no format changes, in the Keywords (PDF, SVG) or the Comment (PNG).
"""

from __future__ import annotations

import json
import re
from base64 import b64decode, b64encode
from dataclasses import asdict, astuple, dataclass
from pathlib import Path
from typing import Any

from kahanmaps.errors import InputError
from kahanmaps.version import __version__

_MAX_BYTES = 1 << 28
_WORD = re.compile(rb"kahanmaps:([A-Za-z0-9+/=]+)\.")


@dataclass(frozen=True)
class Recipe:
    """The command that makes a picture, the version that made it, and the system as TOML (empty without one)."""

    command: str = ""
    system: str = ""
    version: str = __version__

    def metadata(self, kind: str) -> dict[str, Any]:
        """The recipe in the words of matplotlib's metadata for pdf, svg or png; no dates."""
        word = f"kahanmaps:{b64encode(json.dumps(asdict(self)).encode()).decode()}." if self.command else ""
        keys = {
            "pdf": ("Creator", "Subject", "Keywords", "CreationDate"),
            "svg": ("Creator", "Description", "Keywords", "Date"),
            "png": ("Software", "Description", "Comment"),
        }[kind]
        fields = dict(zip(keys, (f"kahanmaps {self.version}", self.command, word, None), strict=False))
        return {key: value for key, value in fields.items() if value != ""}


def read_recipe(path: str) -> Recipe:
    """The recipe in a picture that kahanmaps wrote.

    Raises InputError where the file is no PDF, SVG or PNG, or not one of ours.
    """
    with Path(path).open("rb") as file:
        content = file.read(_MAX_BYTES)
    if not content.startswith((b"\x89PNG\r\n\x1a\n", b"%PDF")) and b"<svg" not in content[:4000]:
        raise InputError(f"{path}: found neither PDF nor SVG nor PNG, expected a picture that kahanmaps wrote")
    word = _WORD.search(content)
    if word is None:
        raise InputError(f"{path}: found no recipe in it, expected a picture that kahanmaps wrote")
    try:
        recipe = Recipe(**json.loads(b64decode(word[1])))
        if not all(isinstance(text, str) for text in astuple(recipe)):
            raise ValueError("a part is no text")
        return recipe
    except (ValueError, TypeError) as error:
        raise InputError(f"{path}: found a recipe that cannot be read ({error}): the picture is damaged") from error
