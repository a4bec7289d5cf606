#!/usr/bin/env bash
# Names that SymPy writes for the Wolfram Language.
#
# Expected: mathematica_code writes a symbol such that it is read back as a symbol, or refuses a name that is none
#           there, as it renames the function names it knows.
# Seen:     x_1 is printed as it is, which is a pattern; E, I, N and D are printed beside the constants of the same
#           name, so that a parameter E times e is E*E. SymPy's own reader returns something else than was written.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    sympy==1.14.0
"$folder/venv/bin/python" - <<'PYTHON'
import sympy as sp
from sympy.parsing.mathematica import parse_mathematica

print("SymPy", sp.__version__)
first, energy = sp.Symbol("x_1"), sp.Symbol("E")
print("expected: what is written is read as what it was, or refused")
for expression in (first + 1, energy * sp.E):
    code = sp.mathematica_code(expression)
    print(f"  {sp.srepr(expression):<42} -> {code:<9} -> {sp.srepr(parse_mathematica(code))[:60]}")
assert sp.mathematica_code(first) == "x_1" and "Pattern" in sp.srepr(parse_mathematica("x_1"))
assert sp.mathematica_code(energy * sp.E) == "E*E" and parse_mathematica("E*E") != energy * sp.E
print("seen: an indexed variable becomes a pattern, a parameter E the number e, without a warning")
PYTHON
# Here: names are checked against the language before anything is written in it.
