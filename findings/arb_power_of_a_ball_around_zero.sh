#!/usr/bin/env bash
# A power of a real ball around 0 in python-flint.
#
# Expected: arb(0, 1)**k encloses the k-th powers of all numbers in [-1, 1], as x*x*... does, for any integer k >= 0.
# Seen:     nan for k = 1, 2, 3, ...; the product x*x is an enclosure, and the same power of a complex ball is one.
# A nan is easy to miss: every comparison with it is False, so that `x**2 < 4` reads as "not proved to be less".
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check python-flint==0.9.0
"$folder/venv/bin/python" - <<'PYTHON'
import flint
from flint import acb, arb

x = arb(0, 1)
print("python-flint", flint.__version__)
print("expected: arb(0, 1)**2 is an enclosure of [0, 1], like x*x")
print("x**1 =", x**1, "  x**2 =", x**2, "  x**3 =", x**3)
print("x*x =", x * x, "  (x + 1)**2 =", (x + 1) ** 2, "  acb(x)**2 =", acb(x) ** 2)
print("x**2 < 4:", x**2 < 4, "  x*x < 4:", x * x < 4)
assert all(not (x**k).is_finite() for k in (1, 2, 3)), "powers of balls around 0 are finite now"
assert (x * x).is_finite() and (acb(x) ** 2).is_finite() and ((x + 1) ** 2).is_finite()
assert not x**2 < 4 and x * x < 4
print("seen: nan for the power, an enclosure for the product")
PYTHON
# Here: normal forms of floating-point maps compare sines of angles; kahanmaps/maps/floats/planar_blocks.py multiplies.
