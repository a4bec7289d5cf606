#!/usr/bin/env bash
# The orders of the integrators of desolver, as they are stated and as they are.
#
# Expected: halving the step of a method whose class says __order__ = p divides the error by about 2^p.
# Seen:     RadauIIA3, stated 3, has order 1: its last coefficient is 1/3 where Radau IIA has 1/4, so that a row does
#           not sum to its node. The symplectic methods ABAs5o6H and BABs9o7H, stated 6 and 7 and called so in their
#           docstrings, have order 4 for a pendulum: the paper that they are taken from is about methods of order 4 that
#           gain orders where the motion is nearly harmonic. The symplectic Euler method, stated 1, has order 2: it is
#           the leapfrog. RadauIA3, GaussLegendre4 and the explicit methods tried have the orders that are stated.
# No report of this was found.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    desolver==5.1.0 numpy==2.4.6 scipy==1.17.1
"$folder/venv/bin/python" - <<'PYTHON'
import warnings
from importlib.metadata import version

import numpy as np
from scipy.integrate import solve_ivp

warnings.simplefilter("ignore")
import desolver
from desolver import integrators

print("desolver", version("desolver"))


def pendulum(t, y, **_):
    return np.array([y[1], -np.sin(y[0])])


start, end = [2.0, 0.0], 4.0
true = solve_ivp(pendulum, (0, end), start, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]


def error(method, steps):
    """The error at the end; the implicit methods would choose other steps if they were not stopped at each."""
    system = desolver.OdeSystem(pendulum, y0=np.array(start), dt=end / steps, t=(0.0, end), rtol=1e-12, atol=1e-12)
    system.method = method
    if method.__name__.startswith(("Radau", "Gauss")):
        for step in range(steps):
            system.dt = end / steps
            system.integrate((step + 1) * end / steps)
    else:
        system.integrate()
    return np.abs(system.y[-1] - true).max()


seen = {}
right = ("RadauIA3", "GaussLegendre4", "RK4Solver", "RK5Solver")
for name in (*right, "RadauIIA3", "ABAs5o6HSolver", "BABs9o7HSolver", "SymplecticEulerSolver"):
    method = getattr(integrators, name)
    steps = (80, 160) if name.startswith(("RK", "Radau", "Gauss")) else (10, 20)
    coarse, fine = (error(method, n) for n in steps)
    measured = np.log2(coarse / fine)
    seen[name] = (method.__order__, round(measured))
    stated = f"{method.__order__:.0f}"
    print(f"  {name:22} expected (stated) {stated}  seen {measured:4.2f}  errors {coarse:.1e} {fine:.1e}")
table = np.asarray(integrators.RadauIIA3.tableau_intermediate)
print("RadauIIA3, nodes:", table[:, 0], " sums of rows:", table[:, 1:].sum(axis=1), " last coefficient:", table[1, 2])
assert table[1, 2] == 1 / 3 and abs(table[1, 1:].sum() - table[1, 0] - 1 / 12) < 1e-14
assert seen["RadauIIA3"] == (3, 1)
assert seen["ABAs5o6HSolver"] == (6, 4) and seen["BABs9o7HSolver"] == (7, 4) and seen["SymplecticEulerSolver"] == (1, 2)
assert all(seen[name][0] == seen[name][1] for name in right)
PYTHON
# Here: nothing depends on it.
