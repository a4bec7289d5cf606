#!/usr/bin/env bash
# Sums of holonomic functions in SymPy: power series that are given by linear differential equations.
#
# Expected: solutions of linear differential equations with polynomial coefficients are closed under sums, and a sum is
#           determined by its equation and initial values: x exp(x) + (x^2 + 1) = 1 + x + 2 x^2 + x^3/2 + ..., in either
#           order of the summands.
# Seen:     if the initial values of one summand are given at a singular point of its equation (those of x exp(x), whose
#           equation is x y' = (x + 1) y, are kept as {1: [1]}), those of both are stored side by side, and the series is
#           that of one summand alone: f + g is 1 + x^2, g + f is x + x^2 + x^3/2 + ... The other summand is lost without
#           a word. The differential equation of the sum is right, and so are products, and sums at ordinary points.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check sympy==1.14.0
"$folder/venv/bin/python" - <<'PYTHON'
import sympy
from sympy import O, exp, series, sin, symbols
from sympy.holonomic import expr_to_holonomic

print("SymPy", sympy.__version__)
x = symbols("x")
F, G = x * exp(x), x**2 + 1
f, g = expr_to_holonomic(F), expr_to_holonomic(G)
assert f.series(n=6) == series(F, x, 0, 6) and g.series(n=6) == G + O(x**6)
print("expected: f + g = g + f =", series(F + G, x, 0, 6))
print("f + g =", (f + g).series(n=6), "  initial values", (f + g).y0)
print("g + f =", (g + f).series(n=6), "  initial values", (g + f).y0)
assert (f + g).series(n=6) == G + O(x**6)
assert (g + f).series(n=6) == series(F, x, 0, 6)

equation = (f + g).annihilator.listofpoly  # p0 + p1 Dx + p2 Dx^2
residue = sum(p.as_expr() * (F + G).diff(x, k) for k, p in enumerate(map(f.annihilator.parent.base.to_sympy, equation)))
assert residue.expand() == 0  # the equation itself holds for the true sum
assert (f * g).series(n=6) == series(F * G, x, 0, 6)
h = expr_to_holonomic(sin(x))
assert (h + g).series(n=6) == series(sin(x) + G, x, 0, 6)  # the control: both at an ordinary point
print("seen: one of the two summands; right for the equation, for f g, and for sin(x) + g")
PYTHON
# Here: series of solutions are computed from the vector field itself (kahanmaps/laboratory/modular_points.py).
