#!/usr/bin/env bash
# The determinant of a matrix of intervals in mpmath's interval context `iv`.
#
# Expected: an interval with the determinant of every matrix between the bounds, or an error when no pivot is known to
#           differ from 0, as A**-1 and lu_solve raise it.
# Seen:     0, an exact one: det catches the error "numerically singular" and takes it for a proof. The matrices
#           [[1, 10], [1, 10 + e]] with e in [-1, 1] have every determinant from -1 to 1. Beside it, the argument of
#           the interval [-1, 1] is pi, and that of 0.5 is 0.
# The page about `iv` calls it experimental, with many functions that do not support intervals properly yet; it does
# not say which, and the docstring of det has no warning.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check mpmath==1.4.1
"$folder/venv/bin/python" - <<'PYTHON'
import mpmath
from mpmath import iv, mp

print("mpmath", mpmath.__version__)
e = iv.mpf([-1, 1])
between = iv.matrix([[1, 10], [1, 10 + e]])
print("expected: the determinant of [[1, 10], [1, 10 + e]], e in [-1, 1], is", (10 + e) - 10, "or wider")
found = iv.det(between)
print("seen:", repr(found), "of type", type(found).__name__)
one = mp.det(mp.matrix([[1, 10], [1, 10.5]]))
print("one of the matrices, e = 0.5, has the determinant", one)
try:
    print(between**-1)
    refused = False
except ZeroDivisionError as error:
    print("its inverse:", error)
    refused = True
argument = iv.arg(e)
print("argument of [-1, 1]:", argument, " of 0.5:", iv.arg(iv.mpf(0.5)))
assert refused and one == 0.5 and found == 0 and 0.5 not in iv.mpf(found)
assert 0.5 in e and iv.arg(iv.mpf(0.5)) == 0 and 0 not in argument
print("seen: 'could not be decided' is returned as the number 0")
PYTHON
# Here: nothing depends on it; determinants are exact.
