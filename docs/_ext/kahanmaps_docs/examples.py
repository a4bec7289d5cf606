"""The examples: each script with what it prints."""

from __future__ import annotations

import ast

from kahanmaps_docs.links import ROOT
from kahanmaps_docs.markdown import block, plain


def examples() -> str:
    """All Python scripts of the folder examples, in alphabetical order."""
    pieces = []
    for script in sorted((ROOT / "examples").glob("*.py")):
        text = script.read_text(encoding="utf-8")
        first = (ast.get_docstring(ast.parse(text)) or "").partition("\n\n")[0]
        pieces += [f"## {plain(script.name)}\n", plain(" ".join(first.split())) + "\n", block(text, "python")]
        output = script.with_suffix(".out")
        if output.exists():
            pieces += ["It prints:\n", block(output.read_text(encoding="utf-8"))]
    return "\n".join(pieces)
