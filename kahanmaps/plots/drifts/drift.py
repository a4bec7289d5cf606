"""The drift of functions along float orbits of the Kahan map and of other methods with the same time step.

The survey and its plot, with a panel for each function and a line for each method.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from kahanmaps.algebra.fields import rational
from kahanmaps.errors import InputError, counted
from kahanmaps.family.planar import NormalForm
from kahanmaps.maps.convention import time_step
from kahanmaps.maps.floats.classical import ClassicalOrbit
from kahanmaps.maps.floats.float_conversion import FloatArray, to_floats
from kahanmaps.maps.floats.float_orbit import FloatOrbit
from kahanmaps.maps.orbits.iteration import OrbitEnd
from kahanmaps.plots.drifts.drift_functions import WatchedFunction
from kahanmaps.plots.figures import (
    LETTER_WIDTH,
    drawing,
    label_number,
    legend_above,
    legend_height,
    letter_count,
    log_scale_with_zero,
    new_figure,
    wrapped,
)
from kahanmaps.plots.style import COLORS, LINES, Style
from kahanmaps.systems.quadratic import QuadraticSystem

if TYPE_CHECKING:
    from matplotlib.figure import Figure

METHODS = {
    "generic": "Kahan",
    "normal-form": "Kahan, normal form",
    "rk4": "RK4",
    "midpoint": "implicit midpoint",
}
BINS = 200
MAX_STEPS = 10**9
MAX_FUNCTIONS = 6
_RANDOM_STARTS = 40
_OF_ONE_SIZE = 5  # of them; the next ones are half as large
_PROBE_STEPS = 1000


@dataclass(frozen=True, eq=False)
class DriftCurve:
    """The error of a function along the orbit of a method: the maximum in each bin of steps, and its step.

    The error is exactly 0 if all values in the bin are equal to the initial value. Bins without values are omitted;
    `undefined` counts points of the orbit where the function is undefined.
    """

    method: str
    function: str
    steps: NDArray[np.int64]
    errors: FloatArray
    undefined: int


@dataclass(frozen=True, eq=False)
class DriftSurvey:
    """The curves of all methods and functions.

    `relative` is true for functions whose errors are relative to I(x_0); they are absolute where I(x_0) = 0. `labels`
    are the names of the functions in plots, `ends` has the end of the orbit of each method; `eps` is half the time step
    (exact).
    """

    eps: fmpq
    start: tuple[fmpq, ...]
    steps: int
    labels: Mapping[str, str]
    relative: Mapping[str, bool]
    curves: tuple[DriftCurve, ...]
    ends: Mapping[str, OrbitEnd]


def survey_drift(
    system: QuadraticSystem,
    eps: Any,
    start: Sequence[Any],
    steps: int,
    functions: Sequence[WatchedFunction],
    methods: Sequence[str] = ("generic", "rk4", "midpoint"),
    *,
    form: NormalForm | None = None,
    linear_bins: bool = False,
    progress: Callable[[str], None] = lambda _: None,
) -> DriftSurvey:
    """Compute errors |I(x_n) - I(x_0)|/|I(x_0)| of functions along the orbits of several methods, `steps` steps each.

    Only the maximum over each of about 200 bins of steps is stored; bins are equally long or (by default) grow with n.
    `eps` (half the time step) and `start` are exact; `methods` are names of METHODS, and "normal-form" needs `form`.
    Raises InputError for invalid values, and if a function is undefined at the initial point.

    >>> from kahanmaps.plots.drifts.drift_functions import known_functions
    >>> from kahanmaps.documents.catalog import load
    >>> top = load("euler_top")
    >>> survey = survey_drift(top.system, "1/10", [1, "1/2", "1/3"], 1000, known_functions(top, fmpq(1, 10)))
    >>> [f"{curve.errors.max():.0e}" for curve in survey.curves if curve.function == "(-F1 + 1)/eps^2"][1:]
    ['1e-02', '2e-03']
    """
    eps = rational(eps)
    point = tuple(rational(entry) for entry in start)
    if not 1 <= steps <= MAX_STEPS:
        raise InputError(f"found {steps} steps, expected 1 to {MAX_STEPS}")
    if eps == 0:
        raise InputError("found eps = 0, expected another number: nothing moves")
    if not 1 <= len(functions) <= MAX_FUNCTIONS:
        raise InputError(f"found {len(functions)} functions, expected 1 to {MAX_FUNCTIONS} in one picture")
    if len(point) != system.dim:
        raise InputError(
            f"found a start with {counted(len(point), 'coordinate')}, expected {system.dim}: "
            f"{', '.join(system.variables)}"
        )
    origins: list[tuple[float, float]] = []  # the initial value, and the divisor of errors
    relative: dict[str, bool] = {}
    for function in functions:
        exact, value = function.at(point), float(function(to_floats(point)[None])[0])
        if exact is None or not np.isfinite(value):
            raise InputError(
                f"{function.name} is not defined in floating point at the initial point: choose another one"
            )
        # Whether I(x_0) is 0 is decided exactly; the value in doubles may be round-off then.
        relative[function.name] = exact != 0 and value != 0.0
        origins.append((value, abs(value) if relative[function.name] else 1.0))
    edges = _edges(steps, linear_bins)
    curves, ends = [], {}
    for method in methods:
        orbit: Any
        if method not in METHODS:
            raise InputError(f"found the method {str(method)[:40]!r}, expected one of {', '.join(METHODS)}")
        if method == "normal-form" and form is None:
            raise InputError("the method normal-form needs a normal form, and there is none")
        if method in ("generic", "normal-form"):
            orbit = FloatOrbit(system, eps, point, steps, form=form if method == "normal-form" else None)
        else:
            orbit = ClassicalOrbit(system, eps, point, steps, method)
        bins = [_Bins(edges) for _ in functions]
        for step, points in orbit.portions():
            if step:  # at step 0 errors are 0 by definition
                for function, (at_start, scale), function_bins in zip(functions, origins, bins, strict=True):
                    with np.errstate(all="ignore"):
                        function_bins.add(step - len(points) + 1, np.abs(function(points) - at_start) / scale)
            progress(f"{METHODS[method]}: step {step} of {steps}")
        ends[method] = orbit.end
        curves += [b.curve(method, function.name) for function, b in zip(functions, bins, strict=True)]
    labels = {function.name: function.label for function in functions}
    return DriftSurvey(eps, point, steps, labels, relative, tuple(curves), ends)


def small_start(system: QuadraticSystem, eps: Any, seed: int = 0) -> tuple[fmpq, ...]:
    """Return a random initial point with small rational coordinates, determined by the seed.

    It is the first of 40 candidates, decreasing in size, from which RK4 completes a thousand steps, so that methods can
    be compared; the first candidate if there is none. `eps` is half the time step.

    >>> small_start(QuadraticSystem.from_text(["x", "y"], ["y", "-x"]), "1/10")
    (1/2, 2/3)
    """
    rng = random.Random(f"drift {seed}")
    starts = []
    for k in range(_RANDOM_STARTS):
        sizes = ((rng.choice((-1, 1)) * rng.randint(1, 6), rng.randint(9, 16)) for _ in range(system.dim))
        starts.append(tuple(fmpq(p, q << k // _OF_ONE_SIZE) for p, q in sizes))
    for start in starts:
        orbit = ClassicalOrbit(system, eps, start, _PROBE_STEPS, "rk4")
        for _ in orbit.portions():
            pass
        if orbit.end is not None and orbit.end.is_complete:
            return start
    return starts[0]


def _edges(steps: int, linear: bool) -> NDArray[np.int64]:
    """Return the ends of the bins: 0 = e_0 < e_1 < ... = steps; bin k holds the steps e_(k-1) < n <= e_k."""
    if steps <= BINS:
        return np.arange(steps + 1)
    ends = np.linspace(0, steps, BINS + 1) if linear else np.geomspace(1, steps, BINS)
    return np.unique(np.concatenate(([0], np.rint(ends).astype(np.int64), [steps])))


class _Bins:
    """The largest error so far in each bin."""

    def __init__(self, edges: NDArray[np.int64]) -> None:
        self._edges = edges
        self._largest = np.full(len(edges) - 1, -1.0)
        self._where = np.zeros(len(edges) - 1, dtype=np.int64)
        self._undefined = 0

    def add(self, first: int, errors: FloatArray) -> None:
        """Add errors at the steps first, first + 1, ...; NaN if undefined."""
        missing = ~np.isfinite(errors)
        self._undefined += int(missing.sum())
        errors = np.where(missing, -1.0, errors)
        bins = np.searchsorted(self._edges, np.arange(first, first + len(errors))) - 1
        for part in np.split(np.arange(len(errors)), np.flatnonzero(np.diff(bins)) + 1):
            best = part[errors[part].argmax()]
            if errors[best] > self._largest[bins[best]]:
                self._largest[bins[best]], self._where[bins[best]] = errors[best], first + best

    def curve(self, method: str, function: str) -> DriftCurve:
        """Return the curve of the largest errors, without empty bins."""
        kept = self._largest >= 0
        return DriftCurve(method, function, self._where[kept], self._largest[kept], self._undefined)


SCALES = ("loglog", "semilog")
_PANEL = 5.5  # minimal width of a panel beside another, in centimetres
_LOST = 1e3
_NO_VALUES = (1e-17, 1e-15)  # limits of the axis if all errors are 0


def plot_drift(survey: DriftSurvey, style: Style | None = None, *, scale: str = "loglog") -> Figure:
    """Plot the errors of a survey against the step, with a panel for each function and a line for each method.

    `scale` is "loglog", or "semilog" with a linear axis of steps. An error of exactly 0 is in a band marked 0 at the
    bottom; an arrow at the top stands for errors above `clipped_from`. A cross ends the line of an orbit that ended
    early, at the step given in the legend. Raises InputError for an unknown scale.
    """
    if scale not in SCALES:
        raise InputError(f"found the scale {scale[:40]!r}, expected {' or '.join(SCALES)}")
    style = style or Style()
    count = len(survey.labels)
    columns = 1 if count <= 3 else 3 if count > 4 and style.width >= 3 * _PANEL else 2
    if count <= 3 and style.width >= _PANEL * count:
        columns = count
    rows = -(-count // columns)
    with drawing(style):
        from matplotlib.lines import Line2D

        ended = {
            method: "" if end.is_complete else f" (ended at step {end.steps})" for method, end in survey.ends.items()
        }
        labels = [METHODS[method] + ending for method, ending in ended.items()]
        panel = 0.62 if count == 1 else 0.85 / columns if columns > 1 else 0.5 if rows == 2 else 0.45
        aspect = panel * rows + legend_height(labels, style, title=True)
        figure = new_figure(style, aspect)
        height = 0.75 / rows * 72 * style.inches(aspect)[1]  # of a panel, in points
        panels = figure.subplots(rows, columns, sharex=True, squeeze=False).ravel()
        for axes, name in zip(panels, survey.labels, strict=False):
            curves = [curve for curve in survey.curves if curve.function == name]
            errors = np.concatenate([curve.errors for curve in curves]) if curves else np.array([])
            limit = clipped_from(survey, name)
            positive = np.minimum(errors[errors > 0], limit)
            least, largest = (positive.min(), positive.max()) if len(positive) else _NO_VALUES
            zero = log_scale_with_zero(axes, float(least), float(largest), len(positive) < len(errors))
            if scale == "loglog":
                axes.set_xscale("log")
                axes.set_xlim(1 if survey.steps > 9 else 0.9, max(survey.steps, 2))
            else:
                axes.set_xlim(0, survey.steps)
            for curve in curves:
                look = _look(curve.method)
                heights = np.where(curve.errors > 0, curve.errors, np.nan if zero is None else zero)
                axes.plot(curve.steps, heights, linewidth=0.9, marker="o" if len(heights) == 1 else None, **look)
                end = {"color": look["color"], "markersize": 5, "clip_on": False}
                beyond = np.flatnonzero(heights > limit)
                if len(beyond):
                    axes.plot(curve.steps[beyond[:1]], [limit], marker="^", **end)
                elif len(heights) and not survey.ends[curve.method].is_complete:
                    axes.plot(curve.steps[-1:], heights[-1:], marker="x", **end)
            # Break the line before the name only: the name may be a formula that contains spaces.
            function, kind = survey.labels[name], "relative" if survey.relative[name] else "absolute"
            if "$" in function:
                is_long = letter_count(f"{kind} error of {function}") * LETTER_WIDTH * style.font_size > height
                label = f"{kind} error of{chr(10) if is_long else ' '}{function}"
            else:
                label = f"{kind} error of " + function.replace(" ", "\N{NO-BREAK SPACE}")
                label = wrapped(label, height, style.font_size, max_lines=2)
            axes.set_ylabel(label)
        for k, axes in enumerate(panels):
            if k >= count:
                axes.set_visible(False)
            elif k + columns >= count:
                axes.set_xlabel("step $n$")
                axes.tick_params(labelbottom=True)
        title = rf"time step $2\varepsilon = {label_number(time_step(survey.eps))}$"
        handles = [Line2D([], [], linewidth=0.9, **_look(method)) for method in survey.ends]
        legend_above(figure, handles, labels, style, title)
    return figure


def clipped_from(survey: DriftSurvey, name: str) -> float:
    """Return the error of a function above which errors are not plotted, but shown as an arrow at the top.

    It is a thousand, or ten times the largest error of the completed orbits if that is larger: a diverging orbit would
    flatten all other curves.
    """
    completed = [
        curve.errors for curve in survey.curves if curve.function == name and survey.ends[curve.method].is_complete
    ]
    return max([_LOST, *(10 * float(errors.max()) for errors in completed if len(errors))])


def _look(method: str) -> dict[str, Any]:
    k = list(METHODS).index(method)
    return {"color": COLORS[k], "linestyle": LINES[k]}
