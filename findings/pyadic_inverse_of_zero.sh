#!/usr/bin/env bash
# The inverse of a p-adic number of which no digit is known, in pyadic.
#
# Expected: 1/O(3^5) raises ZeroDivisionError, as 1/0 does for a residue of the same package: O(3^5) contains 0, and 3^6,
#           whose inverse has a larger absolute value than any bound.
# Seen:     it is O(3^-5), the numbers of absolute value at most 3^5; the inverses of O(3^5) are those of absolute value at
#           least 3^5.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check pyadic==0.3.0 numpy==2.4.6 sympy==1.14.0
"$folder/venv/bin/python" - <<'PYTHON'
from fractions import Fraction
from importlib.metadata import version

from pyadic import ModP, PAdic

print("pyadic", version("pyadic"))
zero = PAdic(1, 3, 5) - PAdic(1, 3, 5)
inverse = 1 / zero
print("1 - 1 =", zero, "and its inverse is", inverse)
assert zero == PAdic(0, 3, 5) and inverse.n == -5

inside = PAdic(3**6, 3, 5)  # one of the numbers that are O(3^5)
exact = 1 / inside
print("expected: ZeroDivisionError, or a set with 1/3^6 =", exact)
assert exact == PAdic(Fraction(1, 3**6), 3, 5) and exact.n == -6 < inverse.n

try:  # the control
    1 / ModP(0, 3)
except ZeroDivisionError as error:
    print("a residue:", error)
else:
    raise AssertionError
PYTHON
# Here: a pivot that may be 0 ends an elimination over balls (maps/orbits/short_solution.py; tests/maps/test_short_solution.py).
