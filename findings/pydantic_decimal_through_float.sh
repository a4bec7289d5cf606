#!/usr/bin/env bash
# Decimals and fractions in JSON, read by pydantic.
#
# Expected: A field of type Decimal or Fraction gets the digits that stand in the JSON document; that is what these
#           types are for.
# Seen:     A JSON number passes through a double first: 0.1000000000000000000000000001 is Decimal('0.1') and
#           Fraction(1, 10). In quotes it is exact. Integers are exact, and one of 5,000 digits is written but cannot
#           be read again.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    pydantic==2.14.4
"$folder/venv/bin/python" - <<'PYTHON'
from decimal import Decimal
from fractions import Fraction

import pydantic
from pydantic import TypeAdapter, ValidationError

print("pydantic", pydantic.VERSION)
digits = "0.1000000000000000000000000001"
print("expected: all 28 digits of", digits)
for kind in (Decimal, Fraction):
    bare = TypeAdapter(kind).validate_json(digits)
    quoted = TypeAdapter(kind).validate_json(f'"{digits}"')
    print(f"  {kind.__name__:<9} number: {bare!r}   text: {quoted!r}")
    assert bare == kind("0.1") and quoted == kind(digits)
integer = TypeAdapter(int)
written = integer.dump_json(10**5000)
print("  an integer of 5001 digits is written in", len(written), "bytes and read back:", end=" ")
try:
    integer.validate_json(written)
    raise SystemExit("it can be read now")
except ValidationError as error:
    print("ValidationError:", error.errors()[0]["type"])
print("seen: exact types, rounded digits")
PYTHON
# Here: TOML and JSON of kahanmaps are read with numbers as text, and exact numbers are written in quotes.
