"""Poincare sections: crossings of float orbits with a hyperplane a.x = c, and level curves of integrals on it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from flint import fmpq

from kahanmaps.algebra.polynomials import RationalFunction, degree_in
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError, quoted
from kahanmaps.maps.floats.ensemble import FloatEnsemble
from kahanmaps.maps.floats.float_conversion import FloatArray
from kahanmaps.plots.comparison.functions import requested_axis
from kahanmaps.plots.curves.level_sets import MAX_LEVELS, level_curves, levels_through
from kahanmaps.plots.figures import draw_points, drawing, legend_above, new_figure
from kahanmaps.plots.point_functions import PointFunction
from kahanmaps.plots.portraits.windows import Window, fullest_axes, window_of
from kahanmaps.plots.style import COLOR_MAP, COLORS, LINES, Style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

UP, DOWN, BOTH = "up", "down", "both"
_NODE_COUNT = 6  # number of interpolation nodes: three points on each side of the hyperplane
_NEWTON_STEPS = 12  # number of steps of Newton's method for the zero of an interpolation polynomial
_MAX_DIFFERENCE = 0.1  # maximal distance, in steps, of the crossings interpolated with four and with six nodes
_ASPECT = 0.75  # height over width of the axes


@dataclass(frozen=True, eq=False)
class Section:
    """The crossings of orbits with a hyperplane, and the number of those that were omitted.

    `crossings` has for each orbit an array (count, dim) of its crossings, in the order of the orbit. `skipped` counts
    the crossings that were omitted, since the steps beside them are too long for an interpolation.
    """

    crossings: tuple[FloatArray, ...]
    skipped: int

    @property
    def points(self) -> FloatArray:
        """The crossings of all orbits as one array (count, dim)."""
        return np.concatenate(self.crossings)

    def widest_axes(self, hyperplane: PointFunction) -> tuple[int, ...]:
        """Return the two variables along which the crossings are spread most, neither constant on the hyperplane."""
        powers = [sum(column) for column in zip(*hyperplane.function.numerator.monoms(), strict=True)]
        dim = self.points.shape[1]
        free_indices = [k for k in range(dim) if powers[k] == 0 or sum(powers) > 1]
        return tuple(free_indices[k] for k in fullest_axes(self.points[:, free_indices], 2))


def hyperplane_of(file: SystemFile, eps: fmpq | None, text: str) -> PointFunction:
    """Return the function F - C for a text F=C. Raises InputError unless it is affine and free of eps."""
    left, _, right = text.partition("=")
    function = requested_axis(file, eps, left if right.strip() in ("", "0") else f"{left} - ({right})")
    polynomial = function.function.numerator
    if (
        not function.function.denominator.is_one()
        or not degree_in(polynomial, file.dim) == polynomial.total_degree() == 1
    ):
        raise InputError(f"found {quoted(text)}, expected a linear equation in the variables, such as x1 - x2 = 1")
    return function


def curves_on(
    file: SystemFile, eps: fmpq | None, hyperplane: PointFunction, axes: Sequence[PointFunction]
) -> list[PointFunction]:
    """Return those integrals, restricted to the hyperplane, that depend only on the variables along the axes."""
    plane = [axis.variable for axis in axes if axis.variable is not None]
    if len(plane) != 2:
        return []
    restrictions = (restrict(requested_axis(file, eps, name), hyperplane, plane) for name in file.integrals)
    return [function for function in restrictions if function is not None]


def section_of(
    ensemble: FloatEnsemble,
    hyperplane: PointFunction,
    steps: int,
    *,
    direction: str = UP,
    progress: Callable[[int], None] | None = None,
) -> Section:
    """Return the crossings of the orbits of an ensemble with a hyperplane.

    Args:
        ensemble: the orbits.
        hyperplane: an affine function of the variables that is 0 on the hyperplane.
        steps: the number of steps of each orbit.
        direction: "up" for crossings to positive values of this function, "down" to negative values, or "both".
        progress: called with the current step.

    Crossings are interpolated through six consecutive points by polynomials in the step number. Raises InputError for
    any other direction.
    """
    if direction not in (UP, DOWN, BOTH):
        raise InputError(f"found the direction {direction}, expected {UP}, {DOWN} or {BOTH}")
    crossings_by_orbit: list[list[FloatArray]] = [[] for _ in range(ensemble.n)]
    skipped, last_points = 0, np.empty((0, ensemble.n, ensemble.system.dim))
    for chunk in ensemble.records(steps, 1, progress=progress):
        points = np.concatenate([last_points, chunk])
        last_points = points[-(_NODE_COUNT - 1) :]
        values = hyperplane(points)
        for k in range(ensemble.n):
            crossings, omitted = crossings_of(points[:, k], values[:, k], direction)
            crossings_by_orbit[k].append(crossings)
            skipped += omitted
    return Section(tuple(np.concatenate(chunks) for chunks in crossings_by_orbit), skipped)


def crossings_of(points: FloatArray, values: FloatArray, direction: str = UP) -> tuple[FloatArray, int]:
    """Return the interpolated points of an orbit at which an affine function is 0, and the number of omitted ones.

    Args:
        points: the points of the orbit (count, dim). values: the values (count,) of an affine function at these points.
        direction: "up" for zeros at which the function increases, "down" or "both".

    A zero is interpolated only if the orbit has three points before it and three points after it.

    >>> t = 0.3 * np.arange(12)
    >>> circle = np.stack([np.cos(t), np.sin(t)], axis=1)
    >>> crossings_of(circle, circle[:, 0], "down")[0][:, 1].round(4).tolist()
    [1.0]
    """
    signs = np.sign(values)
    up, down = (signs[:-1] < 0) & (signs[1:] >= 0), (signs[:-1] > 0) & (signs[1:] <= 0)
    is_crossed = {UP: up, DOWN: down, BOTH: up | down}[direction]
    indices = np.flatnonzero(is_crossed)
    indices = indices[(indices >= _NODE_COUNT // 2 - 1) & (indices + _NODE_COUNT // 2 < len(points))]
    node_rows = indices[:, None] + np.arange(1 - _NODE_COUNT // 2, _NODE_COUNT // 2 + 1)
    is_finite = np.isfinite(values[node_rows]).all(axis=1)
    indices, node_rows = indices[is_finite], node_rows[is_finite]
    node_points, node_values = points[node_rows], values[node_rows]

    def interpolate_zero(nodes: slice) -> FloatArray:
        """Return the crossings, each interpolated through those of its six nodes that the slice `nodes` selects."""
        node_steps = np.arange(1 - _NODE_COUNT // 2, _NODE_COUNT // 2 + 1, dtype=np.float64)[nodes]
        inverse = np.linalg.inv(np.vander(node_steps, increasing=True))  # maps values at nodes to coefficients
        coefficients = node_values[:, nodes] @ inverse.T
        powers = np.arange(len(node_steps))
        low, high = np.zeros(len(coefficients)), np.ones(len(coefficients))
        t = np.clip(values[indices] / (values[indices] - values[indices + 1]), 0, 1)
        rising = values[indices] < values[indices + 1]
        for _ in range(_NEWTON_STEPS):  # Newton's method, or bisection if it leaves the interval with the zero
            value = (coefficients * t[:, None] ** powers).sum(axis=1)
            slope = (coefficients[:, 1:] * powers[1:] * t[:, None] ** powers[:-1]).sum(axis=1)
            is_below = (value < 0) == rising
            low, high = np.where(is_below, t, low), np.where(is_below, high, t)
            newton = t - value / slope
            t = np.where((newton >= low) & (newton <= high), newton, (low + high) / 2)
        crossings: FloatArray = np.einsum("nk,kj,njd->nd", t[:, None] ** powers, inverse, node_points[:, nodes])
        return crossings

    with np.errstate(all="ignore"):
        fine_points, coarse_points = interpolate_zero(slice(None)), interpolate_zero(slice(1, _NODE_COUNT - 1))
        step_lengths = np.linalg.norm(points[indices + 1] - points[indices], axis=1)
        is_trusted = np.linalg.norm(fine_points - coarse_points, axis=1) <= _MAX_DIFFERENCE * step_lengths
        # If |function| increases on both sides away from a change of sign, the function has a pole there.
        middle = _NODE_COUNT // 2
        approach, departure = np.diff(np.abs(node_values), axis=1)[:, [middle - 2, middle]].T
        is_trusted &= (approach < 0) | (departure > 0)
    return fine_points[is_trusted], int((~is_trusted).sum())


def restrict(function: PointFunction, hyperplane: PointFunction, plane: Sequence[int]) -> PointFunction | None:
    """Return a function restricted to a hyperplane as a function of two variables; None if it depends on others."""
    affine = hyperplane.function.numerator
    names = function.function.names
    context = affine.context()
    generators = list(context.gens())
    dim = len(names) - 1
    for k in (k for k in range(dim) if k not in plane):
        slope = affine.derivative(k)
        if not slope.is_zero():
            generators[k] = generators[k] - affine / slope.leading_coefficient()
            break
    polynomials = (function.function.numerator, function.function.denominator)
    fraction = [p.compose(*generators, ctx=context) for p in polynomials]
    if any(int(p.degrees()[k]) > 0 for p in fraction for k in range(dim) if k not in plane) or fraction[1].is_zero():
        return None
    return PointFunction(function.name, RationalFunction.reduced(*fraction), function.eps)


def plot_section(
    section: Section,
    axes: Sequence[PointFunction],
    style: Style | None = None,
    *,
    curves: Sequence[PointFunction] = (),
    window: Window | None = None,
    equal: bool = False,
) -> Figure:
    """Plot the crossings in the plane of two axes, with a color for each orbit, and level curves of integrals.

    Args:
        section: the crossings.
        axes: two functions of the point.
        style: sizes and fonts of the picture.
        curves: integrals that are functions of the variables along the axes, as `restrict` returns them; the level
            through the first crossing of each orbit is drawn.
        window: the part of the plane that is shown; None for all crossings.
        equal: whether both axes have the same unit.

    Raises InputError if there are no crossings.
    """
    projections = [np.stack([axis(points) for axis in axes], axis=-1) for points in section.crossings]
    count = len(section.points)
    if not count:
        raise InputError("found no crossing of the hyperplane, expected at least one: use more steps or another plane")
    window = window or window_of(np.concatenate(projections))
    style = style or Style()
    with drawing(style):
        import matplotlib as mpl
        from matplotlib.collections import LineCollection

        figure = new_figure(style, _ASPECT)
        plot_axes: Any = figure.subplots()
        handles: dict[str, Any] = {}
        for k, function in enumerate(curves):
            levels = levels_through(function, np.concatenate([points[:1] for points in section.crossings]))
            plane = [axis.variable for axis in axes if axis.variable is not None]
            dim = len(function.function.names) - 1
            curves_by_level = level_curves(function, plane, dim, levels[:MAX_LEVELS], window)
            pieces = [piece for level in curves_by_level for piece in level]
            if pieces:
                line = LINES[k % len(LINES)]
                collection = LineCollection(pieces, zorder=1, colors="#999999", linewidths=0.5, linestyles=line)
                plot_axes.add_collection(collection, autolim=False)
                (handles[f"levels of {function.name}"],) = plot_axes.plot(
                    [], [], color="#999999", linewidth=0.5, linestyle=LINES[k % len(LINES)]
                )
        has_few_orbits = len(projections) <= len(COLORS)
        colors = COLORS if has_few_orbits else mpl.colormaps[COLOR_MAP](np.linspace(0, 0.78, len(projections)))
        for k, points in enumerate(projections):
            draw_points(plot_axes, *points.T, color=colors[k], zorder=2, total=count)
        for letter, axis, limits in zip("xy", axes, window, strict=True):
            plot_axes.set(**{f"{letter}label": axis.label, f"{letter}lim": limits})
        if equal:
            plot_axes.set_aspect("equal", adjustable="box")
        if handles:
            legend_above(figure, list(handles.values()), list(handles), style)
    return figure
