"""Kahan's picture: the Lotka-Volterra system by Kahan's method with a large step and by Euler's with a small one.

The plotted orbits of Kahan's map stay on rings; those of Euler's method spiral outward. The map preserves the measure
dx dy/(x y), which is proved, so no open set of orbits spirals into a point. Writes lotka_volterra.pdf if matplotlib is
installed.
"""

from importlib.util import find_spec
from math import log

import numpy as np

import kahanmaps as km
from kahanmaps.maps.floats.classical import MethodEnsemble
from kahanmaps.plots.portraits.trajectories import ensemble_for, follow_orbits

lotka_volterra = km.load("lotka_volterra")
system = lotka_volterra.system


def energy(x, y):
    """The integral of the flow; neither method conserves it."""
    return x - log(x) + y - log(y)


starts = np.array([[1.25, 1.0], [1.5, 1.0], [1.75, 1.0]])
kahan = follow_orbits(ensemble_for(system, "1/10", starts, 2000), 2000)
print("time step 2/10, 2000 steps of Kahan: the range of the energy")
for k, start in enumerate(starts):
    values = [energy(*x) for x in kahan.points[:, k]]
    print(f"  from ({start[0]}, {start[1]}): {min(values):.3f} to {max(values):.3f}")

euler = follow_orbits(MethodEnsemble(system, "1/100", starts[:1], "euler", kernel="numpy"), 20000).points[:, 0]
print(f"time step 2/100, 20000 steps of Euler: from {energy(*euler[0]):.3f} to {energy(*euler[-1]):.3f}")

for finding in km.check_measure(lotka_volterra).findings:
    print(f"{finding.verdict}: {finding.claim}")

if find_spec("matplotlib"):
    from kahanmaps.plots.figures import write_picture
    from kahanmaps.plots.point_functions import point_function
    from kahanmaps.plots.portraits.portrait import plot_portrait, portrait_of
    from kahanmaps.plots.style import Style

    axes = [point_function(name, system.variables) for name in system.variables]
    write_picture(plot_portrait(portrait_of(kahan, axes), Style()), "lotka_volterra.pdf", "pdf", Style())
