"""Escape times and basins: when, and in which direction, the orbits of a plane of initial points leave a ball."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kahanmaps.errors import InputError, counted
from kahanmaps.maps.floats.float_conversion import to_floats
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.plots.figures import drawing, label_of, legend_above, legend_height, new_figure
from kahanmaps.plots.portraits.trajectories import ensemble_for
from kahanmaps.plots.portraits.windows import Window
from kahanmaps.plots.style import COLOR_MAP, COLORS, Style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_CELLS, MAX_STEPS = 2000, 1_000_000  # maximal number of cells along each axis, maximal number of steps
STAYS, ENDS = -1, -2  # in place of a direction: the orbit stays in the ball; it ends at a pole or by overflow


@dataclass(frozen=True, eq=False)
class Escape:
    """Arrays (rows, columns) over a window: `times`, when max |x_i| first exceeds the radius, and `directions`.

    A time is -1 if the orbit stays in the ball up to the last step. A direction is 2 i if x_i is the largest of the
    numbers x_0, -x_0, x_1, ..., and 2 i + 1 if -x_i is; it is `STAYS` if the orbit stays in the ball, and `ENDS` if the
    orbit ended before it left the ball, at a step that is then its time.
    """

    variables: tuple[str, ...]
    axes: tuple[int, int]
    window: Window
    radius: float
    steps: int
    times: NDArray[np.int64]
    directions: NDArray[np.int64]


def survey_escape(
    map_: MapFamily,
    eps: Any,
    window: Window,
    axes: tuple[int, int] = (0, 1),
    base_point: Sequence[Any] | None = None,
    *,
    cells: int = 300,
    steps: int = 200,
    radius: float = 1000.0,
    progress: Callable[[int], None] | None = None,
) -> Escape:
    """Follow the float orbits whose initial points are the centers of `cells` x `cells` cells of a window.

    The window lies in the plane through `base_point` (default: 0) along the variables with the indices `axes`.
    Orbits of Kahan maps may return from points near poles: an orbit that leaves the ball need not go to infinity.

    >>> from kahanmaps.maps.kahan import as_map
    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> saddle = as_map(QuadraticSystem.from_text(["x", "y"], ["x", "-y"]))
    >>> found = survey_escape(saddle, "1/2", ((-1.0, 1.0), (-1.0, 1.0)), cells=2, steps=9)
    >>> found.times.tolist(), found.directions.tolist()  # x~ = 3 x leaves 1000 from 1/2 at step 7
    ([[7, 7], [7, 7]], [[1, 0], [1, 0]])
    """
    if not (1 <= steps <= MAX_STEPS and 1 <= cells <= MAX_CELLS and radius > 0):
        sizes = f"{steps} steps, {cells} x {cells} cells, radius {radius:g}"
        raise InputError(f"found {sizes}, expected 1 to {MAX_STEPS} steps, 1 to {MAX_CELLS} cells, radius > 0")
    if map_.dim < 2:
        raise InputError(f"found {counted(map_.dim, 'variable')}, expected at least 2")
    if len(set(axes)) != 2 or (base_point is not None and len(base_point) != map_.dim):
        raise InputError(f"found axes {axes} and a point {base_point}, expected two axes and {map_.dim} coordinates")
    with np.errstate(over="ignore"):
        centers = [low + (np.arange(cells) + 0.5) * (high - low) / cells for low, high in window]
    if not np.isfinite(centers).all():
        raise InputError(f"found the window {window}, expected a smaller one")
    starts = np.tile(np.zeros(map_.dim) if base_point is None else to_floats(base_point), (cells * cells, 1))
    starts[:, axes[0]], starts[:, axes[1]] = np.tile(centers[0], cells), np.repeat(centers[1], cells)
    ensemble = ensemble_for(map_, eps, starts, steps, radius=radius)
    ensemble.advance(steps, progress=progress)
    has_left, has_ended = ensemble.escaped_at >= 0, ensemble.failed_at >= 0
    escape_points = np.nan_to_num(ensemble.escaped_to)
    largest_index = np.abs(escape_points).argmax(axis=1)
    escape_directions = 2 * largest_index + (escape_points[np.arange(len(escape_points)), largest_index] < 0)
    times = np.where(has_left, ensemble.escaped_at, ensemble.failed_at)  # both are -1 for an orbit that stays
    directions = np.where(has_left, escape_directions, np.where(has_ended, ENDS, STAYS))
    shape = cells, cells
    return Escape(map_.variables, axes, window, radius, steps, times.reshape(shape), directions.reshape(shape))


def plot_escape(result: Escape, style: Style | None = None, *, show: str = "time") -> Figure:
    """Plot the escape times ("time") or the directions ("basin"); initial points of orbits that stay are white."""
    style, (x, y) = style or Style(), result.window
    names = [side + label_of(name) for name in result.variables for side in ("+", "\N{MINUS SIGN}")]
    directions, counts = np.unique(result.directions[result.directions != STAYS], return_counts=True)
    directions = directions[np.argsort(-counts, kind="stable")][: len(COLORS)]  # the rarest directions are white too
    labels = ["ends at a pole" if direction == ENDS else names[int(direction)] for direction in directions]
    with drawing(style):
        from matplotlib.colors import ListedColormap, LogNorm
        from matplotlib.patches import Patch

        is_basin = show == "basin"
        figure = new_figure(style, 0.8 + (legend_height(labels, style, title=True) if is_basin else 0))
        axes = figure.subplots()
        image_options: Any = {"extent": (*x, *y), "origin": "lower", "aspect": "auto", "interpolation": "nearest"}
        if is_basin:
            cells = np.full(result.times.shape, np.nan)
            for number, direction in enumerate(directions):
                cells[result.directions == direction] = number
            colors = COLORS[: max(1, len(directions))]
            axes.imshow(cells, cmap=ListedColormap(colors), vmin=-0.5, vmax=len(colors) - 0.5, **image_options)
            handles = [Patch(color=color) for color in colors[: len(directions)]]
            legend_above(figure, handles, labels, style, f"direction in which |x| > {result.radius:g}")
        else:
            cells = np.where(result.times >= 0, np.maximum(result.times, 1.0), np.nan)
            first_step = float(np.nanmin(cells, initial=result.steps))
            norm = LogNorm(first_step, np.nanmax(cells, initial=first_step + 1))
            mappable = axes.imshow(cells, cmap=COLOR_MAP, norm=norm, **image_options)
            figure.colorbar(mappable, ax=axes, label=f"steps until |x| > {result.radius:g}")
        axes.set_xlabel(label_of(result.variables[result.axes[0]]))
        axes.set_ylabel(label_of(result.variables[result.axes[1]]))
    return figure
