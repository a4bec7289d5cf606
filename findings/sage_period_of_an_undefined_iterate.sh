#!/usr/bin/env bash
# Periodic points of a rational map of the plane in SageMath (passagemath), where the map is not defined everywhere.
#
# Expected: every point P of f.periodic_points(2, minimal=False) satisfies f(f(P)) = P; f.periodic_points(1) leaves out the
#           point at which f is not defined, so periodic_points(2) leaves out those at which f(f(P)) is not.
# Seen:     the list has (1 : 0 : 0), whose image is the indeterminacy point of f: f(f(P)) raises an error. All forms of
#           the second iterate vanish there, which satisfies the equations P x f(f(P)) = 0.
#           On the line through its orbit f is 1/x -> 1/x - 1/5, which has no periodic point but x = 0.
# The default, minimal=True, is refused for such a map; for period 1 the answer is right.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check passagemath-schemes==10.8.13
"$folder/venv/bin/python" - <<'PYTHON'
from sage.all__sagemath_schemes import *
from sage.dynamics.arithmetic_dynamics.projective_ds import DynamicalSystem_projective
from sage.rings.rational_field import QQ
from sage.schemes.projective.projective_space import ProjectiveSpace
from sage.version import version

print("passagemath-schemes", version)
plane = ProjectiveSpace(QQ, 2, "x,y,z")
x, y, z = plane.gens()
# The discretization of x' = x^2 - y^2, y' = -2 x y by Kahan's method with the time step 1/5; birational.
f = DynamicalSystem_projective([5*x**2 - 5*y**2 + 25*x*z, -10*x*y + 25*y*z, -x**2 - y**2 + 25*z**2], domain=plane)
print("f is not defined at", f.indeterminacy_points())
print("periodic_points(1):", f.periodic_points(1))
found = f.periodic_points(2, minimal=False)
print("periodic_points(2, minimal=False):", found)
print("expected: f(f(P)) = P for each of them")
failed = []
for point in found:
    try:
        again = f(f(point))
    except ValueError as error:
        failed.append(point)
        print(f"seen: {point} -> {f(point)} -> {error}")
    else:
        assert again == point
assert failed == [plane(1, 0, 0)]
PYTHON
# Here: `kahanmaps cycles` counts indeterminate and pre-indeterminate points separately; benchmarks/peers.py compares.
