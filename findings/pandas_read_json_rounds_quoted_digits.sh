#!/usr/bin/env bash
# Exact integers that pandas reads from JSON.
#
# Expected: Digits in quotes are text, and stay text: quoting is how JSON keeps integers beyond 53 bits.
# Seen:     A column of quoted digits becomes float64; the same digits read from CSV stay an exact integer, and
#           unquoted in JSON they are refused. One entry such as "1/3" in the column keeps all of it as text.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    pandas==3.1.1
"$folder/venv/bin/python" - <<'PYTHON'
import io

import pandas as pd

print("pandas", pd.__version__)
n = 10**30 + 1
print("expected: the text of n, or the integer n")
quoted = pd.read_json(io.StringIO(f'[{{"a": "{n}"}}]'))["a"]
mixed = pd.read_json(io.StringIO(f'[{{"a": "{n}"}}, {{"a": "1/3"}}]'))["a"]
from_csv = pd.read_csv(io.StringIO(f"a\n{n}\n"))["a"]
print("  JSON, quoted:       ", quoted.tolist(), quoted.dtype)
print("  beside \"1/3\":       ", mixed.tolist())
print("  CSV:                ", from_csv.tolist())
assert quoted.dtype == float and int(quoted[0]) != n
assert mixed.tolist() == [str(n), "1/3"]
assert int(from_csv[0]) == n
try:
    pd.read_json(io.StringIO(f'[{{"a": {n}}}]'))
    raise SystemExit("unquoted integers of 31 digits are read now")
except ValueError as error:
    print("  JSON, without quotes:", error)
print("seen: quoting, which other programs respect, loses the digits unless dtype=False is given")
kept = pd.read_json(io.StringIO(f'[{{"a": "{n}"}}]'), dtype=False)["a"]
assert kept.tolist() == [str(n)], kept.tolist()
PYTHON
# Here: exports keep exact numbers in quotes; read them with dtype=False.
