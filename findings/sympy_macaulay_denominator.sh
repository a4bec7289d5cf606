#!/usr/bin/env bash
# Macaulay's resultant of three forms in SymPy: det(matrix) / det(submatrix).
#
# Expected: the lines x + y + z = 0 and x + 2 y + 4 z = 0 meet in (2 : -3 : 1), where x^2 + y^2 + z^2 is 14: the resultant
#           of the three forms is 14 (up to sign), the quotient of a 6 x 6 and a 1 x 1 determinant, as for forms with
#           other coefficients.
# Seen:     the submatrix has no row at all, and its determinant raises. Its rows are chosen by their values: each row
#           goes in which a number equals the leading coefficient a_i of a form, wherever it stands, and not only the rows
#           of that form. So nearly all forms with small integer coefficients fail, and forms whose coefficients all
#           differ, or are letters, do not.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check sympy==1.14.0
"$folder/venv/bin/python" - <<'PYTHON'
import random

import sympy
from sympy import symbols
from sympy.matrices.exceptions import NonSquareMatrixError
from sympy.polys.multivariate_resultants import MacaulayResultant

print("SymPy", sympy.__version__)
x, y, z = symbols("x y z")
letters = [symbols("a1:4"), symbols("b1:4"), symbols("c1:7")]
monomials = [(x, y, z), (x, y, z), (x**2, x * y, x * z, y**2, y * z, z**2)]


def resultant(coefficients):
    forms = [sum(c * m for c, m in zip(row, ms)) for row, ms in zip(coefficients, monomials)]
    macaulay = MacaulayResultant(forms, [x, y, z])
    matrix = macaulay.get_matrix()
    submatrix = macaulay.get_submatrix(matrix)
    try:
        return matrix.det(), submatrix.det()
    except NonSquareMatrixError:
        return matrix.det(), submatrix.shape


def values(rows):
    return {letter: value for names, row in zip(letters, rows) for letter, value in zip(names, row)}


numerator, denominator = resultant(letters)
generic = sympy.cancel(numerator / denominator)
assert denominator == letters[0][0]
small = [(1, 1, 1), (1, 2, 4), (1, 0, 0, 1, 0, 1)]
print("expected: 14 =", generic.subs(values(small)), "as the value of the formula for letters")
print("seen for the numbers: numerator, and denominator or its shape:", resultant(small))
assert generic.subs(values(small)) == 14 and resultant(small) == (14, (0, 1))
rng, outcomes = random.Random(20261129), {"right": 0, "not square": 0}
for _ in range(60):
    rows = [[rng.choice((-3, -2, -1, 1, 2, 3)) for _ in row] for row in letters]
    d, e = resultant(rows)
    if isinstance(e, tuple):
        outcomes["not square"] += 1
    else:
        assert d == e * generic.subs(values(rows))
        outcomes["right"] += 1
print("60 systems with coefficients -3, ..., 3:", outcomes)
assert outcomes["not square"] > 30
distinct = [(2, 3, 5), (7, 11, 13), (17, 19, 23, 29, 31, 37)]  # the control
d, e = resultant(distinct)
assert d == e * generic.subs(values(distinct)) != 0
print("distinct coefficients are right:", d / e)
PYTHON
# Here: resultants are those of FLINT, in one variable at a time.
