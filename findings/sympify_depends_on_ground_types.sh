#!/usr/bin/env bash
# Exact numbers of FLINT handed to SymPy.
#
# Expected: sympify(fmpq(1, 3)) is Rational(1, 3), or an error that says it is not understood, in every configuration.
# Seen:     Rational(1, 3) where SYMPY_GROUND_TYPES=flint, and with SYMPY_GROUND_TYPES=python a Float of 15 digits,
#           without a warning; an integer of FLINT with 31 digits is rounded in the same way.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check sympy==1.14.0 python-flint==0.9.0
cat >"$folder/sympify.py" <<'PYTHON'
import flint
import sympy
from sympy.external.gmpy import GROUND_TYPES

third, large = sympy.sympify(flint.fmpq(1, 3)), sympy.sympify(flint.fmpz(10**30 + 1))
print(f"SymPy {sympy.__version__}, python-flint {flint.__version__}, ground types {GROUND_TYPES}")
print("  sympify(fmpq(1, 3)) =", repr(third), type(third).__name__)
print("  sympify(fmpz(10**30 + 1)) =", repr(large), type(large).__name__)
is_exact = (third == sympy.Rational(1, 3), large == sympy.Integer(10**30 + 1))
assert is_exact == (GROUND_TYPES == "flint",) * 2, is_exact
PYTHON
echo "expected: the same exact numbers with both ground types"
for types in flint python; do
    SYMPY_GROUND_TYPES=$types "$folder/venv/bin/python" "$folder/sympify.py"
done
echo "seen: exact with flint, rounded without a word with python"
# Here: code that `kahanmaps convert --to sympy` writes reads numbers by numerator and denominator.
