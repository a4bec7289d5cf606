#!/usr/bin/env bash
# The inverse of a singular matrix of expressions in SymEngine.
#
# Expected: an error, as in SymPy: the determinant of [[x, x + 1], [x, x + 1]] is 0, and Matrix.det() says so.
# Seen:     a matrix. Its entries divide by 1 + x - (1 + x), which is 0 and is not recognized as 0; once a number is
#           put for x they are complex infinity. For some matrices of numbers the end of the process is what follows.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check symengine==0.15.0 sympy==1.14.0
"$folder/venv/bin/python" - <<'PYTHON'
import symengine
import sympy

print("symengine", symengine.__version__, "SymPy", sympy.__version__)
x = symengine.Symbol("x")
M = symengine.Matrix([[x, x + 1], [x, x + 1]])
print("expected: the inverse is refused; det =", M.det())
inverse = M.inv()
print("entry of the inverse:", inverse[1, 1], "  at x = 1/3:", inverse[1, 1].subs({x: symengine.Rational(1, 3)}))
y = sympy.Symbol("x")
try:
    print(sympy.Matrix([[y, y + 1], [y, y + 1]]).inv())
    refused = False
except sympy.matrices.exceptions.NonInvertibleMatrixError as error:
    print("SymPy:", error)
    refused = True
assert refused and M.det() == 0 and str(inverse[1, 1].subs({x: symengine.Rational(1, 3)})) == "zoo"
print("seen: an inverse of a matrix whose determinant is 0")
PYTHON
# Here: nothing depends on it; elimination over a field compares pivots with zero exactly.
