"""The part of the documentation that is made of the code, and how it gets into the pages.

A page asks for it by a comment, which nobody sees where Markdown is shown as it is:

    <!-- generated: commands -->            the parts are in `PARTS`
    <!-- generated: file CHANGELOG.md -->   the whole page is that file of the project
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from kahanmaps_docs.batch_tasks import batch_tasks, database_tables
from kahanmaps_docs.catalogue import catalogue
from kahanmaps_docs.commands import commands
from kahanmaps_docs.docstrings import process_docstring, process_signature, with_dashes
from kahanmaps_docs.examples import examples
from kahanmaps_docs.formulas import block_as_mathml, inline_as_mathml
from kahanmaps_docs.links import ROOT, with_links_for
from kahanmaps_docs.literature import bibliography, with_keys_linked
from kahanmaps_docs.reference import api_index, api_page
from kahanmaps_docs.sessions import ConsoleLexer

PARTS: dict[str, Callable[..., str]] = {
    "api": api_page,
    "api-index": api_index,
    "batch-tasks": batch_tasks,
    "bibliography": bibliography,
    "catalogue": catalogue,
    "commands": commands,
    "database": database_tables,
    "examples": examples,
}
MARK = re.compile(r"^<!-- generated: (.+) -->$", re.MULTILINE)


def expanded(docname: str, text: str) -> str:
    """The text of a page with its generated parts, and links that lead to pages where files are pages."""
    page = ROOT / "docs" / f"{docname}.md"
    complete = re.search(r"^<!-- generated: file (\S+) -->$", text, re.MULTILINE)
    if complete:
        origin = ROOT / complete[1]
        return with_keys_linked(with_links_for(page, origin, origin.read_text(encoding="utf-8")))
    text = with_keys_linked(with_links_for(page, page, text))
    return MARK.sub(lambda mark: part(mark[1]), text)


def part(words: str) -> str:
    """What a comment asks for."""
    name, *arguments = words.split()
    if name not in PARTS:
        raise ValueError(f"found <!-- generated: {words} -->, expected one of {', '.join(PARTS)}, file")
    return PARTS[name](*arguments)


def _expand(app: Any, docname: str, source: list[str]) -> None:
    source[0] = expanded(docname, source[0])


def setup(app: Any) -> dict[str, Any]:
    """Called by Sphinx."""
    app.connect("source-read", _expand)
    app.connect("autodoc-process-docstring", process_docstring)
    app.connect("autodoc-process-signature", process_signature)
    app.connect("doctree-resolved", with_dashes)
    app.add_lexer("console", ConsoleLexer)
    app.add_html_math_renderer("mathml", (inline_as_mathml, None), (block_as_mathml, None))
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
