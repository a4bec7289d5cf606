#!/usr/bin/env bash
# Factorizations of integers in python-flint.
#
# Expected: The product of what n.factor() returns is n, as for polynomials, whose factor() returns a unit as well.
# Seen:     A list without a unit: n and -n have one factorization, and those of 0, 1 and -1 are all the empty list.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    python-flint==0.9.0
"$folder/venv/bin/python" - <<'PYTHON'
from math import prod

import flint
from flint import fmpz, fmpz_poly

print("python-flint", flint.__version__)
print("expected: the product of prime powers (and of a unit) is the number")
for n in (12, -12, 1, -1, 0):
    factors = fmpz(n).factor()
    print(f"  fmpz({n}).factor() = {factors}   product {prod(p**e for p, e in factors)}")
    assert prod(p**e for p, e in factors) == (abs(n) or 1)
assert fmpz(0).factor() == fmpz(1).factor() == fmpz(-1).factor() == []
print("  fmpz_poly([-12]).factor() =", fmpz_poly([-12]).factor(), "  of the zero polynomial:", fmpz_poly([]).factor())
assert fmpz_poly([-12]).factor() == (-12, []) and fmpz_poly([]).factor() == (0, [])
print("seen: integers lose their sign, zero becomes an empty product; polynomials keep their constant")
PYTHON
# Here: signs and zeros are dealt with before an integer is factored.
