"""How a picture was made: the command line and the system, written into its file and read from it.

PDF has them in Subject and Keywords, SVG in Description and Keywords, PNG in the text chunks Description and Comment.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from html import unescape
from pathlib import Path
from typing import Any

from kahanmaps.errors import InputError
from kahanmaps.version import __version__

_MAX_BYTES = 1 << 28


@dataclass(frozen=True)
class Recipe:
    """The command that makes a picture, the version that made it, and the system as TOML (empty without one)."""

    command: str = ""
    system: str = ""
    version: str = __version__

    def metadata(self, kind: str) -> dict[str, Any]:
        """The recipe in the words of matplotlib's metadata for pdf, svg or png; no dates."""
        creator = f"kahanmaps {self.version}"
        if kind == "pdf":
            fields = {"Creator": creator, "Subject": self.command, "Keywords": self.system, "CreationDate": None}
        elif kind == "svg":
            fields = {"Creator": creator, "Description": self.command, "Keywords": self.system, "Date": None}
        else:
            return {"Software": creator, "Description": self.command, "Comment": self.system}
        return {key: value for key, value in fields.items() if value != ""}


def read_recipe(path: str) -> Recipe:
    """The recipe in a picture that kahanmaps wrote.

    Raises InputError where the file is no PDF, SVG or PNG, or not one of ours.
    """
    with Path(path).open("rb") as file:
        content = file.read(_MAX_BYTES)
    try:
        recipe = _recipe_in(path, content)
    except (ValueError, zlib.error) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: found a recipe that cannot be read ({error}): the picture is damaged") from error
    if recipe is None:
        raise InputError(f"{path}: found no recipe in it, expected a picture that kahanmaps wrote")
    return recipe


def _recipe_in(path: str, content: bytes) -> Recipe | None:
    if content.startswith(b"\x89PNG\r\n\x1a\n"):
        found = dict(_png_texts(content))
        return _from(found.get("Software"), found.get("Description"), found.get("Comment"))
    if content.startswith(b"%PDF"):
        return _from(*(_pdf_text(content, key) for key in ("Creator", "Subject", "Keywords")))
    if b"<svg" in content[:4000]:
        return _from(*(_svg_text(content, key) for key in ("creator", "description", "subject")))
    raise InputError(f"{path}: found neither PDF nor SVG nor PNG, expected a picture that kahanmaps wrote")


def _from(creator: str | None, command: str | None, system: str | None) -> Recipe | None:
    if not creator or not creator.startswith("kahanmaps ") or not command:
        return None
    return Recipe(command, system or "", creator.removeprefix("kahanmaps "))


def _png_texts(content: bytes) -> Iterator[tuple[str, str]]:
    at = 8
    while at + 8 <= len(content):
        length, kind = struct.unpack(">I4s", content[at : at + 8])
        body = content[at + 8 : at + 8 + length]
        if kind == b"tEXt":
            key, _, text = body.partition(b"\0")
            yield key.decode("latin-1"), text.decode("latin-1")
        elif kind == b"iTXt":  # what is not Latin-1: key, compressed?, method, language, translated key, text
            key, _, rest = body.partition(b"\0")
            _, _, text = rest[2:].split(b"\0", 2)
            yield key.decode("latin-1"), (zlib.decompress(text) if rest[:1] == b"\1" else text).decode()
        at += 12 + length


def _pdf_text(content: bytes, key: str) -> str | None:
    """A string of the Info dictionary: (...) in Latin-1 with escapes, UTF-16 after a byte order mark."""
    found = re.search(rb"/" + key.encode() + rb"\s*\(((?:\\.|[^\\)])*)\)", content, re.DOTALL)
    if found is None:
        return None
    letters = {b"n": b"\n", b"r": b"\r", b"t": b"\t"}
    text = re.sub(rb"\\(.)", lambda escaped: letters.get(escaped[1], escaped[1]), found[1], flags=re.DOTALL)
    return text[2:].decode("utf-16-be") if text.startswith(b"\xfe\xff") else text.decode("latin-1")


def _svg_text(content: bytes, key: str) -> str | None:
    element = re.search(rf"<dc:{key}>(.*?)</dc:{key}>", content.decode(errors="replace"), re.DOTALL)
    if element is None:
        return None
    inside = re.search(r"<(?:rdf:li|dc:title)>(.*?)</(?:rdf:li|dc:title)>", element.group(1), re.DOTALL)
    return unescape((inside or element).group(1))
