#!/usr/bin/env bash
# Roots of polynomials in python-flint, exact coefficients and balls.
#
# Expected: At a working precision of 200 bits roots have about 200 bits, whether the coefficients are exact or balls.
# Seen:     fmpz_poly.complex_roots does this. acb_poly.roots returns the same radius (here 2e-8) at any precision, with
#           no warning: it stops when the balls are disjoint, unless a tolerance is given. Numbers computed from these
#           roots have seven digits; only their radii tell.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    python-flint==0.9.0
"$folder/venv/bin/python" - <<'PYTHON'
import flint
from flint import acb, acb_poly, arb, ctx, fmpz_poly

print("python-flint", flint.__version__)
coefficients = [64, 48, 15, 1]
for bits in (64, 200, 1000):
    ctx.prec = bits
    of_integers = max(float(root.rad()) for root, _ in fmpz_poly(coefficients).complex_roots())
    of_balls = max(float(root.rad()) for root in acb_poly(coefficients).roots())
    with_tolerance = max(float(root.rad()) for root in acb_poly(coefficients).roots(arb(2) ** (30 - bits)))
    print(f"  {bits} bits: radius {of_integers:.1e} (fmpz_poly), {of_balls:.1e} (acb_poly), {with_tolerance:.1e} (with a tolerance)")
    assert of_integers < 2.0 ** (10 - bits) or of_integers == 0
    assert 1e-9 < of_balls < 1e-2
    assert with_tolerance <= 2.0 ** (30 - bits)
print("expected: a radius that shrinks with the precision")
print("seen: acb_poly.roots() separates the roots and stops")
ctx.prec = 200
x = acb_poly(coefficients).roots()
print("  the product of the roots, which is -64 exactly:", x[0] * x[1] * x[2])
PYTHON
# Here: geometry.py gives a tolerance of half the working precision.
