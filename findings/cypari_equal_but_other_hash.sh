#!/usr/bin/env bash
# Numbers of PARI as keys of dictionaries.
#
# Expected: pari(3) == 3, so they have one hash, as Python asks of all that is equal and as FLINT, gmpy2 and SymPy keep
#           it.
# Seen:     Equal, with different hashes: pari(3) is not found among the keys 1, 2, 3, and the set {3, pari(3)} has two
#           elements.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    cypari==2.5.7 python-flint==0.9.0
"$folder/venv/bin/python" - <<'PYTHON'
from importlib.metadata import version

from cypari import pari
from flint import fmpz

print("cypari", version("cypari"))
three = pari(3)
print("expected: equal numbers have equal hashes and are one element of a set")
print("  pari(3) == 3:", bool(three == 3), "  equal hashes:", hash(three) == hash(3), "  elements:", len({3, three}))
assert three == 3 and hash(three) != hash(3)
assert len({3, three}) == 2 and three not in {1: "a", 2: "b", 3: "c"}
assert fmpz(3) == 3 and hash(fmpz(3)) == hash(3) and len({3, fmpz(3)}) == 1
print("  fmpz(3): one element,", len({3, fmpz(3)}))
print("seen: two elements; remainders counted in a dictionary of Python's integers are all missed")
PYTHON
# Here: what comes from PARI in benchmarks is made an int first.
