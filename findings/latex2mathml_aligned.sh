#!/usr/bin/env bash
# Aligned equations in latex2mathml.
#
# Expected: convert(latex) returns well-formed XML or raises, for any environment; aligned is the one most used for
#           systems.
# Seen:     In aligned an ampersand is copied into the XML as it is, so that no parser reads the page; align*, array,
#           cases and matrices are right. An unknown command is shown as an identifier with its backslash, without an
#           error.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    latex2mathml==3.81.1
"$folder/venv/bin/python" - <<'PYTHON'
import xml.etree.ElementTree as ElementTree
from importlib.metadata import version

from latex2mathml.converter import convert

print("latex2mathml", version("latex2mathml"))


def is_well_formed(latex):
    try:
        ElementTree.fromstring(convert(latex))
    except ElementTree.ParseError:
        return False
    return True


rows = r"x &= y \\ y &= 1"
print("expected: XML that a parser reads")
for environment in ("aligned", "align*", "cases"):
    readable = is_well_formed(rf"\begin{{{environment}}} {rows} \end{{{environment}}}")
    print(f"  {environment:<8} read by a parser: {readable}")
    assert readable == (environment != "aligned"), environment
unknown = convert(r"\nosuchcommand{x}")
print("  an unknown command:", unknown[unknown.index("<mrow>") :])
assert r"<mi>\nosuchcommand</mi>" in unknown
print("seen: a page with aligned equations is not XML")
PYTHON
# Here: systems of equations are laid out as arrays, and tests parse what is written.
