"""The bibliography, from kahanmaps/sources.py, and links to it."""

from __future__ import annotations

import re

from kahanmaps.documents.catalog import load, names
from kahanmaps.sources import SOURCES
from kahanmaps_docs.markdown import plain

_KEYS = "|".join(sorted(map(re.escape, SOURCES), key=len, reverse=True))
KEY = re.compile(rf"(?<![\w-])({_KEYS})(?![\w-])")
_KEY_AS_CODE = re.compile(rf"(?<!\[)`({_KEYS})`(?!`)")
_ARXIV = re.compile(r"arXiv:(\d{4}\.\d{4,5})")


def with_keys_linked(text: str) -> str:
    """Markdown in which keys of sources, written as code, lead to the bibliography."""
    return _KEY_AS_CODE.sub(lambda match: link(match[1]), text)


def link(key: str) -> str:
    """A link to a source, in Markdown."""
    return f"[`{key}`](#source-{key})"


def bibliography() -> str:
    """All sources in the order of their keys, with the systems of the catalogue that cite them."""
    citing: dict[str, list[str]] = {key: [] for key in SOURCES}
    for name in names():
        for key in load(name).catalog.get("sources", []):
            citing[key].append(f"[{plain(name)}](#system-{name})")
    pieces = []
    for key in sorted(SOURCES):
        reference = _ARXIV.sub(r"[arXiv:\1](https://arxiv.org/abs/\1)", plain(SOURCES[key]))
        systems = f"\n\n  Systems: {', '.join(citing[key])}." if citing[key] else ""
        pieces.append(f"(source-{key})=\n## {key}\n\n{reference}{systems.replace('  ', '')}\n")
    return "\n".join(pieces)
