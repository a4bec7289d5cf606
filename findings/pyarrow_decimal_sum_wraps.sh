#!/usr/bin/env bash
# Sums, means and quotients of decimals in pyarrow.
#
# Expected: A sum of decimals that does not fit 38 digits is an error, as the product of two such is, or is widened;
#           the mean of 1 and 2 is 1.5; 1/3 has the digits of its type.
# Seen:     The sum of twenty numbers 10**37 is a negative number, the mean of 1 and 2 is 2, and 1/3 is 0.3333.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    pyarrow==26.0.1
"$folder/venv/bin/python" - <<'PYTHON'
from decimal import Decimal

import pyarrow as pa
import pyarrow.compute as pc

print("pyarrow", pa.__version__)
large = pa.array([Decimal(10**37)] * 20)
print("type", large.type, " expected: 2 * 10**38, or an error because it has 39 digits")
total = pc.sum(large).as_py()
print("  sum:", total)
assert total == 2 * 10**38 - 2**128 < 0
try:
    pc.multiply(large, large)
    raise SystemExit("products beyond 38 digits are accepted now")
except pa.ArrowInvalid as error:
    print("  product:", error)
small = pa.array([Decimal(1), Decimal(2)])
print("expected: 1.5 and 0.333...;  mean:", pc.mean(small).as_py(), "  quotient:", end=" ")
quotient = pc.divide(pa.array([Decimal(1)]), pa.array([Decimal(3)]))[0].as_py()
print(quotient)
assert pc.mean(small).as_py() == 2 and quotient == Decimal("0.3333")
print("seen: the sum wraps around without a word; means keep the scale of the column")
PYTHON
# Here: exact numbers stand in tables as text, with a column of floats beside them.
