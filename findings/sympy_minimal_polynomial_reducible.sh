#!/usr/bin/env bash
# The minimal polynomial of a rational multiple of a root of unity in SymPy.
#
# Expected: minimal_polynomial of 2*(-1)**(1/3) = 1 + sqrt(3)*I, which SymPy makes of root(-8, 3), is x**2 - 2*x + 4.
# Seen:     x**3 + 8, which is reducible: a product is raised to the least common multiple of the denominators of its
#           exponents, and the result is not factored. (-1)**(1/3) alone, the same number written as 1 + sqrt(3)*I or
#           2*exp(I*pi/3), and compose=False give the right answer.
# QQ<2*(-1)**(1/3)> is therefore no field: it has dimension 3, and a factorization over it ends with "zero divisor".
# The docstring promises the minimal polynomial; no report of this case was found.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check sympy==1.14.0
"$folder/venv/bin/python" - <<'PYTHON'
import sympy
from sympy import I, QQ, Poly, Rational, exp, factor, minimal_polynomial, pi, root, sqrt
from sympy.abc import x
from sympy.polys.polyerrors import NotInvertible

print("SymPy", sympy.__version__)
number, right = root(-8, 3), x**2 - 2 * x + 4
assert number == 2 * (-1) ** Rational(1, 3) and (number - 1 - sqrt(3) * I).expand(complex=True) == 0
print("expected: the minimal polynomial of", number, "is", right)
found = minimal_polynomial(number, x)
print("seen:", found, "=", factor(found), " irreducible:", Poly(found, x).is_irreducible)
others = [minimal_polynomial(same, x) for same in (1 + sqrt(3) * I, 2 * exp(I * pi / 3))]
others.append(minimal_polynomial(number, x, compose=False))
print("written in another way, and with compose=False:", others)
assert found == x**3 + 8 and not Poly(found, x).is_irreducible and others == [right] * 3
print("of 2*(-1)**(2/5):", minimal_polynomial(2 * (-1) ** Rational(2, 5), x))
print("dimension of", QQ.algebraic_field(number), "over QQ:", QQ.algebraic_field(number).ext.minpoly.degree())
try:
    print(factor(right, extension=number))
    refused = False
except NotInvertible as error:
    print("factors of", right, "over it:", error)
    refused = True
assert refused
PYTHON
# Here: nothing depends on it; polynomials are factored by FLINT.
