"""Drift of exactly conserved integrals in floating-point arithmetic.

First the Euler top by three methods with the same time step: Kahan's map conserves its integrals up to rounding errors,
Runge-Kutta and the implicit midpoint rule do not. Then a member of the commuting family, whose orbits pass close to
indeterminacy points of the map, where digits are lost; the normal form loses fewer. Writes drift.pdf if matplotlib is
installed.
"""

from importlib.util import find_spec

import numpy as np

import kahanmaps as km
from kahanmaps.plots.drifts.drift import METHODS, survey_drift
from kahanmaps.plots.drifts.drift_functions import known_functions

EPS, STEPS = "1/20", 20_000


def errors_of(survey, function):
    """The typical error of a function, by method: the median of the maxima over some 200 bins of steps."""
    return {c.method: float(np.median(c.errors)) for c in survey.curves if c.function == function}


top = km.load("euler_top")
functions = known_functions(top, km.QQ.convert(EPS))
survey = survey_drift(top.system, EPS, [1, "1/2", "1/3"], STEPS, functions, ("generic", "rk4", "midpoint"))
print(f"{top.name}, {STEPS} steps, relative error of {functions[0].name}:")
for method, error in errors_of(survey, functions[0].name).items():
    size = "rounding only" if error < 1e-13 else f"about {error:.0e}"
    print(f"  {METHODS[method]}: {size}")

file = km.load("paper_m2")
functions = known_functions(file, km.QQ.convert(EPS))
start, form = ["1/20", "-1/30", 0, "1/40"], km.normal_form(file.member)
of_member = survey_drift(file.system, EPS, start, STEPS, functions, ("generic", "normal-form"), form=form)
for name in ("I1", "I2"):
    error = errors_of(of_member, name)
    better = error["normal-form"] < error["generic"]
    print(f"{file.name}, {name}: below 1e-6: {error['generic'] < 1e-6}; in normal form smaller: {better}")

if find_spec("matplotlib"):
    from kahanmaps.plots.drifts.drift import plot_drift
    from kahanmaps.plots.figures import write_picture
    from kahanmaps.plots.style import Style

    write_picture(plot_drift(survey), "drift.pdf", "pdf", Style())
