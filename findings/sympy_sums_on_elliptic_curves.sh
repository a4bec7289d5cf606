#!/usr/bin/env bash
# Points of elliptic curves in SymPy: sums, torsion and orders, for equations with a term a1 x y or a3 y.
#
# Expected: on y^2 + y = x^3 - x^2 - 10 x - 20 the points (5, 5), (5, -6), (16, 60), (16, -61) and O are a group of order
#           5 (the curve of conductor 11): the sum of a point and its negative is O, and five times a point is O. The
#           number of points over a finite field is the order of the group: it annihilates all points.
# Seen:     (5, 5) + (5, -6) is (16, -61), although -(5, 5) is (5, -6); five times a point is never O; the list of torsion
#           points is [O]. Over GF(7), y^2 = x^3 + 2 x + 3 has order 5: O is not counted, and the group has 6 points. For
#           short equations y^2 = x^3 + a x + b sums and torsion points are right.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check sympy==1.14.0
"$folder/venv/bin/python" - <<'PYTHON'
import sympy
from sympy.ntheory.elliptic_curve import EllipticCurve

print("SymPy", sympy.__version__)
curve, points = EllipticCurve(-10, -20, a1=0, a2=-1, a3=1), [(5, 5), (5, -6), (16, 60), (16, -61)]
assert all(y**2 + y == x**3 - x**2 - 10 * x - 20 for x, y in points)
total = curve(5, 5) + curve(5, -6)
print("expected: (5, 5) + (5, -6) = O, 5 P = O for each point P, five torsion points")
print("-(5, 5) =", -curve(5, 5), "  (5, 5) + (5, -6) =", total)
print("5 P =", [5 * curve(x, y) for x, y in points], "  torsion points:", curve.torsion_points())
assert (-curve(5, 5)).y == -6 and (total.x, total.y) == (16, -61), total
assert all((5 * curve(x, y)).z != 0 for x, y in points)
assert len(curve.torsion_points()) == 1

modular = EllipticCurve(2, 3, modulus=7)
affine = [(x, y) for x in range(7) for y in range(7) if (y * y - x**3 - 2 * x - 3) % 7 == 0]
print("over GF(7): order", modular.order, "with", len(affine), "points besides O")
print("order times P:", [modular.order * modular(x, y) for x, y in affine])
assert modular.order == len(affine) == 5
assert all((6 * modular(x, y)).z == 0 and (5 * modular(x, y)).z != 0 for x, y in affine)

short = EllipticCurve(-43, 166)  # the control: a short equation, torsion Z/7
assert (7 * short(3, 8)).z == 0 and len(short.torsion_points()) == 7
print("seen: sums of another group law, no torsion, and an order without O; right for y^2 = x^3 - 43 x + 166 over Q")
PYTHON
# Here: kahanmaps/algebra/elliptic_curves.py has its own sums, for Y^2 = x^3 + a2 x^2 + a4 x + a6; tests compare with PARI.
