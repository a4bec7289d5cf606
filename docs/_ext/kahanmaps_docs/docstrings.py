"""Docstrings are written to be read in a terminal; this makes reStructuredText of them.

Names in backquotes become links where they are exported, code otherwise; keys of sources lead to the bibliography;
what is indented is a formula or a program; sections such as Args become fields; nothing else is markup.
"""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from sphinx.ext.napoleon import Config
from sphinx.ext.napoleon.docstring import GoogleDocstring

import kahanmaps
from kahanmaps_docs.literature import KEY

SECTIONS = re.compile(r"(Args|Returns|Raises|Yields|Attributes):$")
_PIECES = re.compile(r"(``.+?``|`[^`]+`)", re.DOTALL)


def process_docstring(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Called by autodoc for every docstring."""
    # As if all were functions: in the docstring of a property it would take what stands before a colon for a type.
    lines[:] = str(GoogleDocstring(as_rst(lines), Config(napoleon_use_rtype=False), what="function")).split("\n")


def process_signature(
    app: Any, what: str, name: str, obj: Any, options: Any, signature: str | None, returns: str | None
) -> tuple[str | None, str | None]:
    """Called by autodoc for every signature: a default that a dataclass makes is not Python, and would not be read."""
    return (signature and signature.replace("<factory>", "..."), returns)


def with_dashes(app: Any, doctree: Any, docname: str) -> None:
    """Called by Sphinx for every page: what it puts between an argument and its description becomes a dash."""
    for text in list(doctree.findall(lambda node: isinstance(node, nodes.Text) and node == " -- ")):
        text.parent.replace(text, nodes.Text(" \N{EN DASH} "))


def as_rst(lines: list[str]) -> list[str]:
    """The lines of a docstring, its margin taken away, as reStructuredText."""
    done: list[str] = []
    for indent, block in blocks(lines):
        in_section = any(SECTIONS.match(line.strip()) for line in block)
        if block[0].lstrip().startswith(">>> "):
            done += block
        elif indent >= 4 and not in_section and not under_section(done):
            done += ["::", "", *block]
        else:
            done += inline("\n".join(block)).split("\n")
            if block[0].strip() in ("Returns:", "Yields:") and len(block) > 1:  # all of it: no type before a colon
                done[1 - len(block)] = re.sub(r"^( *)", r"\1: ", done[1 - len(block)])
        done.append("")
    return done


def blocks(lines: list[str]) -> list[tuple[int, list[str]]]:
    """The paragraphs, each with its indentation."""
    results: list[list[str]] = [[]]
    for line in lines:
        if line.strip():
            results[-1].append(line.rstrip())
        elif results[-1]:
            results.append([])
    return [(min(len(line) - len(line.lstrip()) for line in block), block) for block in results if block]


def under_section(done: list[str]) -> bool:
    """Whether an indented paragraph continues a section like Args: the last line at the margin is its title."""
    at_margin = [line for line in done if line and not line.startswith(" ")]
    return bool(at_margin) and SECTIONS.match(at_margin[-1]) is not None


def inline(text: str) -> str:
    """A paragraph: code, links and keys as markup, everything else without."""
    pieces = _PIECES.split(text)
    return "".join(quoted(piece) if k % 2 else escaped(piece) for k, piece in enumerate(pieces))


def quoted(piece: str) -> str:
    """What stands in backquotes: a link, where it is a name that kahanmaps exports."""
    name = piece.strip("`")
    if name in kahanmaps.__all__ and not name.startswith("_"):
        return f":py:obj:`~kahanmaps.{name}`"
    return f"``{name}``"


def escaped(text: str) -> str:
    """Text without markup; keys of sources lead to the bibliography."""
    pieces = KEY.split(text)
    return "".join(
        f":ref:`{piece} <source-{piece}>`" if k % 2 else _without_markup(piece) for k, piece in enumerate(pieces)
    )


def _without_markup(text: str) -> str:
    text = re.sub(r"(?m)(?<!^)(?<!^    )([*])", r"\\\1", text.replace("\\", "\\\\"))
    return re.sub(r"(\||(?<=\w)_(?!\w))", r"\\\1", text)
