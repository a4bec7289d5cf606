"""Level curves of a rational function F in the plane, accurate to rounding errors.

The level F = c of F = N/D is the zero set of the polynomial N - c D. This set is approximated on a grid; then Newton's
method moves each vertex of the approximation to the curve.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from kahanmaps.errors import InputError
from kahanmaps.maps.floats.float_conversion import FloatArray
from kahanmaps.plots.figures import require_matplotlib
from kahanmaps.plots.point_functions import PointFunction
from kahanmaps.plots.portraits.windows import Window

MAX_LEVELS = 200  # maximal number of levels of one function in one picture
GRID = 301  # number of grid lines in each direction
_NEWTON_STEPS = 8  # number of steps of Newton's method for each vertex


Levels = tuple[tuple[FloatArray, ...], ...]  # level -> components of its curve, each an array (n, 2) of vertices


def levels_through(function: PointFunction, starts: FloatArray) -> tuple[float, ...]:
    """Return the finite values of `function` at points (n, dim), sorted; values equal up to rounding occur once."""
    values = np.sort(function(starts))
    levels: list[float] = []
    for value in values[np.isfinite(values)].tolist():
        if not levels or abs(value - levels[-1]) > 1e-10 * max(abs(value), abs(levels[-1])):
            levels.append(value)
    return tuple(levels)


def level_curves(
    function: PointFunction, plane: Sequence[int], dim: int, levels: Sequence[float], window: Window
) -> Levels:
    """Compute the curves F = level of the function F in a window of the plane of two variables with indices `plane`.

    Raises InputError if F depends on other variables, and if there are more than 200 levels.

    >>> from kahanmaps.plots.point_functions import point_function
    >>> circle = level_curves(point_function("x^2 + y^2", "xy"), (0, 1), 2, [1.0], ((-2, 2), (-2, 2)))
    >>> bool(np.allclose((circle[0][0] ** 2).sum(axis=1), 1, rtol=1e-12))
    True
    """
    if len(plane) != 2 or len(window) != 2:
        raise InputError("level curves are for pictures of two variables")
    degrees_of_parts = (function.function.numerator.degrees(), function.function.denominator.degrees())
    outside = [k for k in range(dim) if k not in plane and any(int(degrees[k]) > 0 for degrees in degrees_of_parts)]
    if outside:
        names = function.function.names
        raise InputError(
            f"{function.name}: found {', '.join(names[k] for k in outside)} in it, expected a function of "
            f"{names[plane[0]]} and {names[plane[1]]} alone: the level curves of others are not curves in this plane"
        )
    if len(levels) > MAX_LEVELS:
        raise InputError(f"found {len(levels)} levels, expected at most {MAX_LEVELS}: choose some of them")

    def fraction_at(points: FloatArray) -> tuple[FloatArray, FloatArray]:
        full_points = np.zeros((*points.shape[:-1], dim))
        full_points[..., list(plane)] = points
        return function.numerator_and_denominator(full_points)

    fraction_on_grid = fraction_at(_grid(window)[-1])
    curves = []
    for level in levels:

        def value(points: FloatArray, level: float = level) -> FloatArray:
            numerator, denominator = fraction_at(points)
            return numerator - level * denominator

        with np.errstate(all="ignore"):
            curves.append(zero_curves(value, window, fraction_on_grid[0] - level * fraction_on_grid[1]))
    return tuple(curves)


def zero_curves(
    value: Callable[[FloatArray], FloatArray], window: Window, on_grid: FloatArray | None = None
) -> tuple[FloatArray, ...]:
    """Compute the zero set of the function `value` of points (..., 2) in a window as curves, arrays (n, 2) of vertices.

    The curves are approximated on a grid, and Newton's method moves each vertex onto the zero set. `on_grid` are the
    values of the function on the grid, if they are known.

    >>> (circle,) = zero_curves(lambda x: (x**2).sum(axis=-1) - 1, ((-2, 2), (-2, 2)))
    >>> bool(np.allclose((circle**2).sum(axis=1), 1, rtol=1e-12))
    True
    """
    require_matplotlib()
    from contourpy import contour_generator

    xs, ys, points = _grid(window)
    mesh = np.array([(high - low) / (GRID - 1) for low, high in window])
    step = 1e-4 * mesh
    with np.errstate(all="ignore"):
        values = value(points) if on_grid is None else on_grid
        if not np.isfinite(values).all():
            values = np.ma.masked_invalid(values)
        contours = [np.asarray(vertices) for vertices in contour_generator(xs, ys, values).lines(0.0)]
        # Newton's method moves each vertex along the gradient, in total by at most the mesh size of the grid.
        for vertices in contours:
            x = vertices.copy()
            for _ in range(_NEWTON_STEPS):
                gradient = np.stack(
                    [(value(x + e * step) - value(x - e * step)) / (2 * step[k]) for k, e in enumerate(np.eye(2))],
                    axis=-1,
                )
                slope = gradient * mesh  # in units of the mesh size, so that both axes have equal weight
                x = x - (value(x) / (slope**2).sum(axis=-1))[:, None] * slope * mesh
            is_closer = np.isfinite(x).all(axis=-1) & (np.abs(x - vertices) <= mesh).all(axis=-1)
            is_closer &= np.abs(value(x)) <= np.abs(value(vertices))
            vertices[is_closer] = x[is_closer]
    return tuple(contours)


def _grid(window: Window) -> tuple[FloatArray, FloatArray, FloatArray]:
    xs, ys = (np.linspace(low, high, GRID) for low, high in window)
    return xs, ys, np.stack(np.meshgrid(xs, ys), axis=-1)
