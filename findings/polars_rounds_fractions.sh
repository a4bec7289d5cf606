#!/usr/bin/env bash
# Fractions handed to polars.
#
# Expected: pl.Series([Fraction(1, 3)]) is an error or a column of objects: polars has no rationals, and pyarrow
#           refuses them.
# Seen:     A column of 64-bit floats, without a word; integers beyond 64 bits, which other libraries round, become
#           Int128 exactly, also from CSV and JSON.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    polars==2.1.0 pyarrow==26.0.1
"$folder/venv/bin/python" - <<'PYTHON'
import io
from fractions import Fraction

import polars as pl
import pyarrow as pa

print("polars", pl.__version__, " pyarrow", pa.__version__)
series = pl.Series([Fraction(1, 3)])
print("expected: an error, or objects;  seen:", series.dtype, series.to_list())
assert series.dtype == pl.Float64 and series[0] == 1 / 3
try:
    pa.array([Fraction(1, 3)])
    raise SystemExit("pyarrow accepts fractions now")
except pa.ArrowInvalid as error:
    print("  pyarrow:", str(error)[:70])
n = 10**30 + 1
print("  10**30 + 1 from Python, CSV and JSON:", end=" ")
columns = [
    pl.Series([n]),
    pl.read_csv(io.StringIO(f"a\n{n}\n"))["a"],
    pl.read_json(io.StringIO(f'[{{"a": {n}}}]'))["a"],
]
print([str(column.dtype) for column in columns])
assert all(column.dtype == pl.Int128 and column[0] == n for column in columns)
PYTHON
# Here: rationals are written as text before a table is made.
