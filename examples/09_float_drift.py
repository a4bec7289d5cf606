"""Drift of exactly conserved integrals in floating-point arithmetic.

The first experiment integrates the Euler top by three methods with the same time step: Kahan's map conserves its
integrals up to rounding errors, Runge-Kutta and the implicit midpoint rule do not. The second one is for a member of
the commuting family. Its orbits pass close to indeterminacy points of the map, where digits are lost; steps in normal
form lose fewer digits. Writes drift.pdf if matplotlib is installed.
"""

from importlib.util import find_spec

import numpy as np

import kahanmaps as km

EPS, STEPS = "1/20", 20_000


def errors_of(result, function):
    """The typical error of a function, by method: the median of the maxima over some 200 bins of steps."""
    return {c.method: float(np.median(c.errors)) for c in result.curves if c.function == function}


of_top = km.compare("euler_top", [1, "1/2", "1/3"], EPS, STEPS, methods=["kahan", "rk4", "midpoint"])
first = next(iter(of_top.labels))
print(f"euler_top, {STEPS} steps, relative error of {first}:")
for method, error in errors_of(of_top, first).items():
    size = "rounding only" if error < 1e-13 else f"about {error:.0e}"
    print(f"  {method}: {size}")
print("measured orders:", {run.method: round(run.order, 1) for run in of_top.runs})

start = ["1/20", "-1/30", 0, "1/40"]
of_member = km.compare("paper_m2", start, EPS, STEPS, methods=["kahan", "normal-form"], orders=False)
for name in ("I1", "I2"):
    error = errors_of(of_member, name)
    better = error["normal-form"] < error["kahan"]
    print(f"paper_m2, {name}: below 1e-6: {error['kahan'] < 1e-6}; in normal form smaller: {better}")

if find_spec("matplotlib"):
    km.plot.compare(of_top).figure.savefig("drift.pdf")
