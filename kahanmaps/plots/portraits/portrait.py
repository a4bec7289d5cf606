"""Phase portraits: orbits projected to two or three axes, drawn as dots or lines with a color for each point.

The flow and level curves are drawn below the orbits, and a color bar is drawn beside the axes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kahanmaps.errors import InputError, quoted
from kahanmaps.maps.floats.float_conversion import FloatArray
from kahanmaps.plots.curves.level_sets import Levels
from kahanmaps.plots.figures import MAX_VECTOR_POINTS, dot_size, draw_points, drawing, legend_above, new_figure
from kahanmaps.plots.point_functions import PointFunction
from kahanmaps.plots.portraits.flow import CENTER, DEGENERATE, FOCUS, NODE, SADDLE, Flow
from kahanmaps.plots.portraits.trajectories import Trajectories
from kahanmaps.plots.portraits.windows import Window, count_outside, is_inside, main_range, window_of
from kahanmaps.plots.style import COLOR_MAP, COLORS, MARKS, Style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from kahanmaps.plots.comparison.functions import WatchedFunction

_MAX_NEIGHBOURS = 2000  # maximal number of points of which all pairs are compared; more points look smooth anyway
_MIN_NEIGHBOURS = 8  # minimal number of points of an orbit that may form a curve
_MIN_CURVE_SHARE = 0.9  # minimal fraction of points with two neighbours for a curve; in a cloud of points it is 0.5
# A line longer than both multiples (of the median length, and of the diameter of the orbit) is a gap in an orbit that
# does not fill its curve. For a nearly rational rotation number, long but shorter lines join bunches of points.
_MAX_LENGTH_RATIO, _MAX_WIDTH_RATIO = 8.0, 0.2
STEP = "step"
ORBIT = "orbit"


@dataclass(frozen=True, eq=False)
class Portrait:
    """The data that a portrait shows; points are arrays (records, orbits, 2 or 3).

    `points` are the coordinates along the axes, NaN for missing points; `labels` and `window` have an entry for each
    axis. `values` (records, orbits) of the function called `value_label` color the points; None means one color for
    each orbit. `left_out` counts the points outside the window, and `undefined` those points of orbits at which an axis
    or the color has a pole. `euler` are points of the explicit Euler method, `levels` are level curves, and `flow` is
    drawn below the points. `joined` contains for each orbit the pairs (count, 2) of records that are neighbours on its
    curve; None means that successive records are joined.
    """

    points: FloatArray
    labels: tuple[str, ...]
    window: Window
    values: FloatArray | None = None
    value_label: str = ""
    left_out: int = 0
    undefined: int = 0
    euler: FloatArray | None = None
    levels: Levels | None = None
    flow: Flow | None = None
    joined: tuple[NDArray[np.int64] | None, ...] = ()

    def pairs(self, orbit: int) -> NDArray[np.int64]:
        """Return the pairs (count, 2) of records of an orbit that a line joins."""
        joined = self.joined[orbit] if self.joined else None
        steps = np.arange(len(self.points))
        return np.stack([steps[:-1], steps[1:]], axis=1) if joined is None else joined


def portrait_of(
    trajectories: Trajectories,
    axes: Sequence[PointFunction | str],
    *,
    color: WatchedFunction | str = ORBIT,
    window: Window | None = None,
    euler: Trajectories | None = None,
    join: bool = False,
) -> Portrait:
    """Project orbits to two or three axes; each axis is a function of the point, or the word "step".

    `color` is "orbit", "step" or a function of the point. By default the window is chosen automatically. If `join`, the
    neighbours of each point on the curve of its orbit are determined, unless an axis is the step. Raises InputError for
    other axes or colors.

    >>> from kahanmaps.plots.point_functions import point_function
    >>> result = Trajectories(("x",), np.array([[[1.0]], [[3.0]]]), np.arange(2))
    >>> portrait_of(result, ["step", point_function("x", ["x"])]).points[:, 0].tolist()
    [[0.0, 1.0], [1.0, 3.0]]
    """
    if len(axes) not in (2, 3):
        raise InputError(f"found {len(axes)} axes, expected 2 or 3")
    points = _projected(trajectories, axes)
    values, label = None, ""
    if not isinstance(color, str):
        *shape, dim = trajectories.points.shape
        values, label = color(trajectories.points.reshape(-1, dim)).reshape(shape), color.label
    elif color == STEP:
        values, label = _step_numbers(trajectories), STEP
    elif color != ORBIT:
        raise InputError(f"found the color {quoted(color)}, expected orbit, step or a function")
    is_defined = ~np.isnan(trajectories.points).any(axis=2)
    is_shown = ~np.isnan(points).any(axis=2)
    if values is not None:
        is_shown &= ~np.isnan(values)
    points = np.where(np.asarray(is_shown)[..., None], points, np.nan)
    flat = points.reshape(-1, len(axes))
    shown_window = window or window_of(flat, points[0])
    return Portrait(
        points,
        tuple(axis if isinstance(axis, str) else axis.label for axis in axes),
        shown_window,
        values,
        label,
        left_out=count_outside(flat, shown_window),
        undefined=int(is_defined.sum() - is_shown.sum()),
        euler=None if euler is None else _projected(euler, axes),
        joined=tuple(map(neighbours, trajectories.points.swapaxes(0, 1))) if join and STEP not in axes else (),
    )


def _projected(trajectories: Trajectories, axes: Sequence[PointFunction | str]) -> FloatArray:
    return np.stack(
        [_step_numbers(trajectories) if isinstance(axis, str) else axis(trajectories.points) for axis in axes], axis=-1
    )


def _step_numbers(trajectories: Trajectories) -> FloatArray:
    steps = np.broadcast_to(np.asarray(trajectories.steps, dtype=np.float64)[:, None], trajectories.points.shape[:2])
    return np.where(np.isnan(trajectories.points).any(axis=2), np.nan, steps)


def neighbours(points: FloatArray) -> NDArray[np.int64] | None:
    """Return the pairs (count, 2) of rows of `points` (n, dim) that are neighbours on a curve; None without a curve.

    Each point p is joined to its nearest neighbour q and to the nearest point r on the other side of p, that is, with
    (q - p).(r - p) < 0. If the points are dense enough, this reconstructs a smooth curve in any dimension and with any
    number of components (Dey and Kumar's NN-crust). NaN and all points after the first 2000 are ignored.

    >>> turn = 2.4 * np.arange(12)
    >>> pairs = neighbours(np.stack([np.cos(turn), np.sin(turn)], axis=1))
    >>> len(pairs), np.bincount(pairs.ravel()).tolist()
    (12, [2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2])
    """
    rows = np.flatnonzero(~np.isnan(points).any(axis=1))[:_MAX_NEIGHBOURS]
    vertices = points[rows]
    _, first_rows = np.unique(vertices.round(12), axis=0, return_index=True)  # a periodic orbit repeats its points
    rows, vertices = rows[np.sort(first_rows)], vertices[np.sort(first_rows)]
    if len(rows) < _MIN_NEIGHBOURS:
        return None
    squares = (vertices**2).sum(axis=1)
    products = vertices @ vertices.T
    distances = squares[:, None] + squares - 2 * products
    np.fill_diagonal(distances, np.inf)
    indices = np.arange(len(rows))
    nearest = distances.argmin(axis=1)
    # Entry [p, r] is (q - p).(r - p), with the nearest neighbour q of p.
    inner_products = products[nearest] - products[indices, nearest][:, None] - products + squares[:, None]
    opposite_distances = np.where(inner_products < 0, distances, np.inf)
    opposite = opposite_distances.argmin(axis=1)
    has_opposite = np.isfinite(opposite_distances[indices, opposite])
    pairs = np.concatenate([np.stack([indices, nearest], 1), np.stack([indices, opposite], 1)[has_opposite]])
    pairs = np.unique(np.sort(pairs, axis=1), axis=0)
    neighbour_counts = np.bincount(pairs.ravel(), minlength=len(rows))
    if (neighbour_counts == 2).mean() < _MIN_CURVE_SHARE:
        return None
    lengths = np.linalg.norm(vertices[pairs[:, 0]] - vertices[pairs[:, 1]], axis=1)
    diameter = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    max_length = max(_MAX_LENGTH_RATIO * float(np.median(lengths)), _MAX_WIDTH_RATIO * diameter)
    return np.asarray(rows[pairs[lengths <= max_length]], dtype=np.int64)


_ASPECT = 0.75  # height over width of the axes
_EULER_COLOR = "#BBBBBB"
_LEVEL_STYLE: dict[str, Any] = {"colors": "#999999", "linewidths": 0.5}
_MAX_JOINED_POINTS = 1_000_000  # maximal number of joined points, which take ten seconds and half a gigabyte
_MAX_MARKED_ORBITS = 40  # maximal number of orbits with marks at their initial points; more would cover the picture
_MAX_MARKED_POINTS = 60  # maximal number of points of an orbit that is drawn with marks
_EXTEND = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}

_ARROW: dict[str, Any] = {"color": "#C4C4C4", "width": 0.0018, "headwidth": 4, "headlength": 4, "headaxislength": 3.5}
_SEPARATRIX_STYLE = {"color": "#666666", "linewidth": 0.7, "linestyle": (0, (6, 2, 1, 2))}
_SOLUTION_STYLE = {"color": "#888888", "linewidth": 0.5}
_FILLED_MARK: dict[str, Any] = {"color": "black", "markeredgecolor": "white", "markeredgewidth": 0.5}
_OPEN_MARK: dict[str, Any] = {"markeredgecolor": "black", "markerfacecolor": "white", "markeredgewidth": 0.8}
# No equilibrium and no orbit has this mark.
_START_MARK: dict[str, Any] = {"marker": ">", "markersize": 3.5, "markeredgecolor": "black", "markeredgewidth": 0.5}
_EQUILIBRIUM_MARKS: dict[str, dict[str, Any]] = {
    SADDLE: {"marker": "x", "markeredgecolor": "black", "markeredgewidth": 1.2, "markersize": 5},
    CENTER: {"marker": "o", "markersize": 5, **_OPEN_MARK},
    FOCUS: {"marker": "D", "markersize": 4.5, **_OPEN_MARK},
    NODE: {"marker": "s", "markersize": 5, **_FILLED_MARK},
    DEGENERATE: {"marker": "*", "markersize": 7, **_FILLED_MARK},
}


def plot_portrait(
    portrait: Portrait, style: Style, *, lines: bool = False, equal: bool = False, note: str = ""
) -> Figure:
    """Draw a portrait as dots or, if `lines`, as joined points; if `equal`, the axes have equal units.

    `note` is written above the upper right corner. Raises InputError if more than a million points are to be joined.
    """
    count = portrait.points[..., 0].size
    if lines and count > _MAX_JOINED_POINTS:
        raise InputError(f"found {count} points to join by lines, expected at most {_MAX_JOINED_POINTS}: draw dots")
    in_space = len(portrait.labels) == 3
    with drawing(style):
        import matplotlib as mpl
        from matplotlib.collections import LineCollection
        from matplotlib.lines import Line2D

        aspect = _ASPECT
        if in_space:
            aspect = 0.9 if portrait.values is None else 0.8
        elif equal:  # the window and the color bar determine the height of the picture
            (x0, x1), (y0, y1) = portrait.window
            aspect = min(1.6, max(0.4, (y1 - y0) / (x1 - x0) * (0.8 if portrait.values is not None else 1.0)))
        figure = new_figure(style, aspect)
        if in_space:
            mpl.rcParams.update({"grid.color": "#DDDDDD", "grid.linewidth": 0.4})  # before the axes are created
        axes: Any = figure.subplots(subplot_kw={"projection": "3d"} if in_space else {})
        handles: dict[str, Any] = {}  # legend text -> handle
        if portrait.flow is not None:
            # The arrows and curves of the differential equation lie below the orbits, its equilibria above them.
            flow = portrait.flow
            if len(flow.places):
                axes.quiver(*flow.places.T, *flow.arrows.T, units="width", scale=34, pivot="mid", zorder=0.5, **_ARROW)
                arrow_style: dict[str, Any] = {"marker": r"$\rightarrow$", "markersize": 9, "linestyle": "none"}
                handles["vector field"] = Line2D([], [], color="#999999", markeredgewidth=0, **arrow_style)
            curves = [("separatrix", curve, _SEPARATRIX_STYLE) for curve in flow.separatrices]
            curves += [("solution", curve, _SOLUTION_STYLE) for curve in flow.solutions]
            for name, curve, curve_style in curves:
                vertices = _hide_outside(curve[:, None], portrait.window)[:, 0] if in_space else curve
                (handles[name],) = axes.plot(*vertices.T, zorder=1.2, **curve_style)
            for kind, point in flow.equilibria:
                mark = {"linestyle": "none", "zorder": 4, "clip_on": False, **_EQUILIBRIUM_MARKS[kind]}
                (handles[kind],) = axes.plot(*point[:, None], **mark)
        pieces = [piece for pieces in portrait.levels or () for piece in pieces]
        if pieces:
            axes.add_collection(LineCollection(pieces, zorder=1, **_LEVEL_STYLE), autolim=False)
            handles["level curve"] = Line2D([], [], color=_LEVEL_STYLE["colors"], linewidth=_LEVEL_STYLE["linewidths"])
        if portrait.euler is not None:
            # Lines continue beyond the edge of the window, but matplotlib cannot draw points far outside of it.
            wide_window = tuple((low - 9 * (high - low), high + 9 * (high - low)) for low, high in portrait.window)
            # The lines are dashed, since colors are hard to distinguish in a gray copy.
            dash_style: dict[str, Any] = {
                "linewidth": 0.6,
                "linestyle": (0, (5, 2)),
                "rasterized": count > MAX_VECTOR_POINTS,
            }
            for orbit in _hide_outside(portrait.euler, portrait.window if in_space else wide_window).swapaxes(0, 1):
                if lines:
                    axes.plot(*orbit.T, color=_EULER_COLOR, zorder=1.5, **dash_style)
                else:
                    draw_points(axes, *orbit.T, color=_EULER_COLOR, zorder=1.5, total=count)
            dot_style: dict[str, Any] = {"linestyle": "none", "marker": "o", "markeredgewidth": 0, "markersize": 2.4}
            handles["explicit Euler"] = Line2D([], [], color=_EULER_COLOR, **(dash_style if lines else dot_style))
        # matplotlib does not clip points outside of axes in space.
        points = _hide_outside(portrait.points, portrait.window) if in_space else portrait.points
        if portrait.values is None and points.shape[1] <= len(COLORS):
            _draw_few_orbits(axes, points, lines, portrait)
        elif portrait.values is None:
            # Each orbit has a color of the color map; the widest orbit is drawn first, so that it covers no other.
            with np.errstate(all="ignore"):
                extent = np.nanmax(points, axis=0, initial=-np.inf) - np.nanmin(points, axis=0, initial=np.inf)
                extent = np.nan_to_num(extent, nan=0, posinf=0, neginf=0)
                scale = extent.max(axis=0, initial=0)
                order = np.argsort(-(extent / np.where(scale > 0, scale, 1)).max(axis=1), kind="stable")
            orbit_numbers = np.broadcast_to(np.arange(points.shape[1], dtype=np.float64), points.shape[:2])
            _draw_colored(axes, points, orbit_numbers, order, (0.0, points.shape[1] - 1.0), lines, portrait)
        else:
            visible_values = portrait.values[~np.isnan(_hide_outside(points, portrait.window)).any(axis=2)]
            low, high = main_range(visible_values)
            orbits = range(points.shape[1])
            mappable = _draw_colored(axes, points, portrait.values, orbits, (low, high), lines, portrait)
            is_beyond = bool((visible_values < low).any()), bool((visible_values > high).any())
            options: dict[str, Any] = {"pad": 0.1 if in_space else 0.02, "aspect": 30, "extend": _EXTEND[is_beyond]}
            figure.colorbar(mappable, ax=axes, **options).set_label(portrait.value_label)
        if portrait.values is None and points.shape[1] <= _MAX_MARKED_ORBITS:
            for k in range(points.shape[1]):
                color = COLORS[k] if points.shape[1] <= len(COLORS) else "white"
                axes.plot(*points[0, k][:, None], linestyle="none", markerfacecolor=color, zorder=3, **_START_MARK)
            if points.shape[1]:
                handles["initial point"] = Line2D([], [], linestyle="none", markerfacecolor="white", **_START_MARK)
        if handles:
            legend_above(figure, list(handles.values()), list(handles), style)
        for letter, label, limits in zip("xyz", portrait.labels, portrait.window, strict=False):
            axes.set(**{f"{letter}label": label, f"{letter}lim": limits})
        if note:
            axes.set_title(note, loc="right", fontsize=style.smallest, color="#555555", pad=2)
        if in_space:
            _format_axes_in_space(axes, portrait.window if equal else None)
        elif equal:
            axes.set_aspect("equal", adjustable="box")
    return figure


def _draw_few_orbits(axes: Any, points: FloatArray, lines: bool, portrait: Portrait) -> None:
    """Draw each orbit in a color of its own, and with a mark of its own if it has few points."""
    count = points.shape[0] * points.shape[1]
    for k, orbit in enumerate(points.swapaxes(0, 1)):
        options: dict[str, Any] = {"color": COLORS[k], "zorder": 2}
        if lines:
            pairs = portrait.pairs(k)
            path = orbit
            if (pairs[:, 1] != pairs[:, 0] + 1).any():  # NaN between lines, so that one call draws all of them
                ends = orbit[pairs]
                path = np.concatenate([ends, np.full_like(ends[:, :1], np.nan)], axis=1).reshape(-1, orbit.shape[1])
            axes.plot(*path.T, linewidth=0.6, rasterized=count > MAX_VECTOR_POINTS, **options)
        else:
            mark = {"markersize": 3.0, "marker": MARKS[k]} if len(orbit) <= _MAX_MARKED_POINTS else {}
            draw_points(axes, *orbit.T, **options, **mark, total=count)


def _draw_colored(
    axes: Any,
    points: FloatArray,
    values: FloatArray,
    order: Iterable[int],
    limits: tuple[float, float],
    lines: bool,
    portrait: Portrait,
) -> Any:
    """Draw the orbits in the order `order`, colored by `values`, as dots or, if `lines`, as segments.

    A segment has the color of its first point; `limits` are the smallest and the largest value of the color bar.
    """
    import matplotlib as mpl
    from matplotlib.collections import LineCollection
    from matplotlib.colors import ListedColormap, Normalize

    # The lightest part of the color map is omitted: small dots would be invisible on white paper.
    color_map = ListedColormap(mpl.colormaps[COLOR_MAP](np.linspace(0, 0.78, 256)))
    is_image = points.shape[0] * points.shape[1] > MAX_VECTOR_POINTS
    options: dict[str, Any] = {"norm": Normalize(*limits), "cmap": color_map, "rasterized": is_image, "zorder": 2}
    in_space = points.shape[2] == 3
    if not lines:
        orbit_indices = list(order)
        dots, dot_values = points[:, orbit_indices].swapaxes(0, 1), values[:, orbit_indices].swapaxes(0, 1)
        is_defined = ~np.isnan(dots).any(axis=2)
        options |= {"s": dot_size(values.size) ** 2, "linewidths": 0, **({"depthshade": False} if in_space else {})}
        return axes.scatter(*dots[is_defined].T, c=dot_values[is_defined], **options)
    pairs_by_orbit = [(portrait.pairs(int(k)), k) for k in order]
    segments = np.concatenate([points[pairs, k] for pairs, k in pairs_by_orbit])
    segment_values = np.concatenate([values[pairs[:, 0], k] for pairs, k in pairs_by_orbit])
    is_defined = ~np.isnan(segments).any(axis=(1, 2))
    if in_space:
        from mpl_toolkits.mplot3d.art3d import Line3DCollection

        del options["zorder"]
        collection: Any = Line3DCollection(segments[is_defined], linewidths=0.6, **options)
        axes.add_collection3d(collection, autolim=False)
    else:
        collection = LineCollection(list(segments[is_defined]), linewidths=0.6, **options)
        axes.add_collection(collection, autolim=False)
    collection.set_array(segment_values[is_defined])
    return collection


def _hide_outside(points: FloatArray, window: Window) -> FloatArray:
    return np.where(is_inside(points, window)[..., None], points, np.nan)


def _format_axes_in_space(axes: Any, window: Window | None) -> None:
    """Format axes in space: light planes, few ticks, labels inside the picture, where the layout cannot cut them.

    With a window the box has the proportions of the window. matplotlib draws the edges of only three planes.
    """
    from matplotlib.ticker import MaxNLocator

    axes.set_box_aspect(None if window is None else [high - low for low, high in window], zoom=0.84)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.pane.set_facecolor("white")
        axis.pane.set_edgecolor("#BBBBBB")
        axis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10], prune="both"))
        axis.labelpad = 0
    limits = (axes.get_xlim(), axes.get_ylim(), axes.get_zlim())
    for first_corner, second_corner in combinations(product(*limits), 2):
        if sum(a != b for a, b in zip(first_corner, second_corner, strict=True)) == 1:
            axes.plot(*zip(first_corner, second_corner, strict=True), color="#BBBBBB", linewidth=0.4, zorder=0)
    axes.tick_params(pad=0)
