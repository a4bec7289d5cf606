"""The reference of the library: what `kahanmaps` exports, by layers of the library and by module."""

from __future__ import annotations

import inspect
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import kahanmaps
from kahanmaps_docs.docstrings import as_rst
from kahanmaps_docs.markdown import block, code, plain, table


def exported() -> dict[str, dict[str, list[str]]]:
    """Folder -> module -> names, all in the order of `kahanmaps.__all__`."""
    result: dict[str, dict[str, list[str]]] = {}
    for name in kahanmaps.__all__:
        if not name.startswith("__") and not isinstance(getattr(kahanmaps, name), ModuleType):
            home = module_of(getattr(kahanmaps, name))
            result.setdefault(home.split(".")[1], {}).setdefault(home, []).append(name)
    return result


def module_of(value: Any) -> str:
    """The module in which a name is made."""
    return str(getattr(inspect.unwrap(value), "__module__", None) or type(value).__module__)


def api_pages_without_names(docs: Path) -> list[str]:
    """Pages of layers that export nothing (yet)."""
    folders = exported()
    pages = sorted((docs / "reference" / "api").glob("*.md"))
    return [f"reference/api/{page.name}" for page in pages if page.stem not in {"index", *folders}]


def api_index() -> str:
    """The table of contents of the layers, then a table of names for each."""
    folders = exported()
    pieces = [block("\n".join([":maxdepth: 1", "", *folders]), "{toctree}")]
    for folder, modules in folders.items():
        rows = [
            (f"[`{name}`](#kahanmaps.{name})", first_sentence(getattr(kahanmaps, name)))
            for names in modules.values()
            for name in names
        ]
        pieces += [f"## {code('kahanmaps.' + folder)}\n", table(("name", ""), rows)]
    return "\n".join(pieces)


def api_page(folder: str) -> str:
    """All that a layer exports: for each module what it is about, then its names."""
    pieces = []
    for home, names in exported()[folder].items():
        module = sys.modules[home]
        pieces.append(f"## {home}\n")
        pieces.append(
            block("\n".join([*module_text(module), *(line for name in names for line in entry(name))]), "{eval-rst}")
        )
    return "\n".join(pieces)


def module_text(module: ModuleType) -> list[str]:
    """The docstring of a module as reStructuredText."""
    return [*as_rst((inspect.getdoc(module) or "").split("\n")), ""]


def entry(name: str) -> list[str]:
    """The directive that shows a name."""
    value = getattr(kahanmaps, name)
    if inspect.isclass(value):
        kind = "autoexception" if issubclass(value, BaseException) else "autoclass"
        return [f".. {kind}:: kahanmaps.{name}", "   :members:", ""]
    if inspect.isroutine(value):
        return [f".. autofunction:: kahanmaps.{name}", ""]
    text = as_rst((inspect.getdoc(type(value)) or "").split("\n"))
    return [f".. py:data:: kahanmaps.{name}", "", *(f"   {line}" for line in text), ""]


def first_sentence(value: Any) -> str:
    """The first sentence of a docstring, in Markdown."""
    paragraph = (inspect.getdoc(value if callable(value) else type(value)) or "").partition("\n\n")[0]
    sentence = " ".join(paragraph.split())
    end = sentence.find(". ")
    pieces = (sentence if end < 0 else sentence[: end + 1]).split("`")
    return "".join(code(piece) if k % 2 else plain(piece) for k, piece in enumerate(pieces))
