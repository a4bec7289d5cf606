"""Small pieces of Markdown: text in which nothing is markup, cells of tables, code."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence


def plain(text: str) -> str:
    """Text that shows as it is written."""
    return re.sub(r"([\\`*_\[\]<>$|~#])", r"\\\1", text)


def code(text: str) -> str:
    """A piece of code in a line; there is no backquote in it."""
    return f"`{text}`"


def cell(text: str) -> str:
    """Markdown that fits into the cell of a table."""
    return re.sub(r"(?<!\\)\|", r"\\|", " ".join(text.split()))


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; its cells are Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cell(entry) for entry in line) + " |" for line in lines) + "\n"


def block(text: str, language: str = "") -> str:
    """A block of code."""
    return f"```{language}\n{text.rstrip()}\n```\n"
