#!/usr/bin/env bash
# Division of a polynomial with integer coefficients by an integer in SymPy's polynomial rings.
#
# Expected: (3*X + 4)/2 in ZZ[X] raises ExactQuotientFailed, as division by the polynomial 2 does; and divmod, whatever
#           it rounds to, returns q and r with 2*q + r = 3*X + 4.
# Seen:     2: the terms whose coefficients are not divisible are left out, by / and by //. divmod leaves them out of q,
#           and takes the coefficients of r modulo 2, so that 2*q + r is X + 4. Poly.quo_ground of the same polynomial
#           is x + 2, rounded coefficient by coefficient; Poly / 2 is 3*x/2 + 2.
# Known: SymPy's issue 28395 asks for an error. The documentation does not say what / does with a remainder.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check sympy==1.14.0
"$folder/venv/bin/python" - <<'PYTHON'
import sympy
from sympy import ZZ, Poly, ring
from sympy.abc import x
from sympy.polys.polyerrors import ExactQuotientFailed

print("SymPy", sympy.__version__)
R, X = ring("X", ZZ)
f = 3 * X + 4
print("expected: ExactQuotientFailed for (3*X + 4)/2")
try:
    print(f / R(2))
    refused = False
except ExactQuotientFailed as error:
    print("division by the polynomial 2:", error)
    refused = True
q, r = divmod(f, 2)
print("seen: f/2 =", f / 2, "  f//2 =", f // 2, "  divmod(f, 2) =", (q, r), "  2*q + r =", 2 * q + r)
poly = Poly(3 * x + 4, x)
print("Poly.quo_ground(2):", poly.quo_ground(2).as_expr(), "  Poly/2:", poly / 2)
print("exact where it can be: (4*X + 6)/2 =", (4 * X + 6) / 2)
assert refused and f / 2 == f // 2 == 2 and 2 * q + r == X + 4 != f
assert poly.quo_ground(2).as_expr() == x + 2 and (4 * X + 6) / 2 == 2 * X + 3
PYTHON
# Here: nothing depends on it; polynomials over Q are those of FLINT.
