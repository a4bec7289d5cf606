"""Phase portraits drawn: dots or lines of orbits, level curves below them, a bar for the colours."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from kahanmaps.errors import InputError
from kahanmaps.maps.floats.doubles import FloatArray
from kahanmaps.plots.figures import RASTERISE_ABOVE, dot_size, drawing, new_figure, points
from kahanmaps.plots.portraits.draw_flow import draw_flow
from kahanmaps.plots.portraits.portrait import Portrait
from kahanmaps.plots.portraits.windows import Window, main_range
from kahanmaps.plots.style import COLOUR_MAP, COLOURS, MARKS, Style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LEVEL = {"colors": "#999999", "linewidths": 0.5}
_EULER = "#BBBBBB"
_ASPECT = 0.75
_ENDS = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}
_MOST_JOINED = 1_000_000  # points: ten seconds, half a gigabyte
_MARKED = 40  # orbits whose starts are marked: of more they would cover the picture
_FEW = 60  # points of an orbit, up to which each is worth a mark of its orbit's own


def draw_portrait(found: Portrait, style: Style, *, lines: bool = False, equal: bool = False, note: str = "") -> Figure:
    """Draw a portrait: dots, or with `lines` orbits joined; `equal` gives both axes the same unit.

    `note` stands above the right corner, small. Raises InputError for more than a million points to be joined.
    """
    if lines and found.points[..., 0].size > _MOST_JOINED:
        raise InputError(
            f"found {found.points[..., 0].size} points to join by lines, expected at most {_MOST_JOINED}: draw dots"
        )
    space = len(found.labels) == 3
    with drawing(style):
        import matplotlib as mpl

        figure = new_figure(style, _aspect(found, equal))
        if space:
            mpl.rcParams.update({"grid.color": "#DDDDDD", "grid.linewidth": 0.4})  # before the axes are made
        axes: Any = figure.subplots(subplot_kw={"projection": "3d"} if space else {})
        inside = _inside(found.points, found.window) if space else found.points
        if found.flow is not None:
            flow = found.flow
            if space:
                flow = replace(flow, solutions=tuple(_inside(x[:, None], found.window)[:, 0] for x in flow.solutions))
            draw_flow(figure, axes, flow, style)
        if found.levels is not None:
            _draw_levels(axes, found)
        if found.euler is not None:
            # in the plane lines go on to the edge; what is far beyond may be too large to draw
            euler = _inside(found.euler, found.window if space else _around(found.window))
            _draw_orbits(axes, euler, lines, [_EULER] * euler.shape[1])
        if found.values is not None:
            _draw_values(figure, axes, found, inside, lines)
        elif inside.shape[1] <= len(COLOURS):
            _draw_orbits(axes, inside, lines, list(COLOURS), found)
        else:
            _draw_many(axes, inside, lines, found)
        _finish(axes, found.labels, found.window)
        _write_note(axes, note, style)
        if space:
            _make_room(axes, found.window if equal else None)
        elif equal:
            axes.set_aspect("equal", adjustable="box")
    return figure


def _aspect(found: Portrait, equal: bool) -> float:
    """Height over width: what the window asks for where both axes have the same unit."""
    if len(found.labels) == 3:
        return 0.9 if found.values is None else 0.8
    if not equal:
        return _ASPECT
    (x0, x1), (y0, y1) = found.window
    return float(min(1.6, max(0.4, (y1 - y0) / (x1 - x0) * (0.8 if found.values is not None else 1.0))))


def _draw_levels(axes: Axes, found: Portrait) -> None:
    from matplotlib.collections import LineCollection

    assert found.levels is not None
    pieces = [piece for pieces in found.levels.pieces for piece in pieces]
    axes.add_collection(LineCollection(pieces, zorder=1, **_LEVEL), autolim=False)


def _draw_orbits(axes: Any, shown: FloatArray, lines: bool, colours: list[str], found: Portrait | None = None) -> None:
    """A colour and a mark for each of a few orbits; where there are many dots only the start gets the mark.

    Without the portrait `found` they are those of another method, below.
    """
    count = shown.shape[0] * shown.shape[1]
    below = found is None
    for k in range(shown.shape[1]):
        orbit = shown[:, k]
        how: dict[str, Any] = {"color": colours[k % len(colours)], "zorder": 1.5 if below else 2}
        if lines:
            dashes: Any = (0, (5, 2)) if below else "-"  # in a grey copy the colours tell less
            path = orbit if found is None else _path(orbit, found.pairs(k))
            axes.plot(*path.T, linewidth=0.6, linestyle=dashes, rasterized=count > RASTERISE_ABOVE, **how)
        else:
            few = len(orbit) <= _FEW and not below
            mark = {"markersize": 3.0, "marker": MARKS[k % len(MARKS)]} if few else {}
            points(axes, *orbit.T, **mark, **how, of=count)
        if not below and (lines or len(orbit) > _FEW):
            start = {"marker": MARKS[k % len(MARKS)], "markersize": 4.0, "markeredgecolor": "white"}
            axes.plot(*orbit[:1].T, linestyle="none", markeredgewidth=0.5, **start, **{**how, "zorder": 3})


def _path(orbit: FloatArray, pairs: NDArray[np.int64]) -> FloatArray:
    """Points with NaN between the lines that join them, as plot takes many lines at once."""
    if (pairs[:, 1] == pairs[:, 0] + 1).all():
        return orbit
    ends = orbit[pairs]
    return np.concatenate([ends, np.full_like(ends[:, :1], np.nan)], axis=1).reshape(-1, orbit.shape[1])


def _draw_many(axes: Any, shown: FloatArray, lines: bool, found: Portrait) -> None:
    """Orbits in the colours of the map, the widest below, so that those inside are seen; a ring is a start."""
    orbits = shown.shape[1]
    with np.errstate(all="ignore"):
        extent = np.nanmax(shown, axis=0, initial=-np.inf) - np.nanmin(shown, axis=0, initial=np.inf)
        extent = np.nan_to_num(extent, nan=0, posinf=0, neginf=0)
        scale = extent.max(axis=0, initial=0)
        order = np.argsort(-(extent / np.where(scale > 0, scale, 1)).max(axis=1), kind="stable")
    numbers = np.broadcast_to(np.arange(orbits, dtype=np.float64), shown.shape[:2])
    pairs = [found.pairs(int(k)) for k in order] if lines else None
    _draw_coloured(axes, shown[:, order], numbers[:, order], pairs, (0.0, orbits - 1.0))
    if orbits <= _MARKED:
        how = {"markeredgecolor": "black", "markeredgewidth": 0.5, "markerfacecolor": "white", "zorder": 3}
        axes.plot(*shown[0].T, linestyle="none", marker="o", markersize=2.6, **how)


def _draw_values(figure: Figure, axes: Any, found: Portrait, shown: FloatArray, lines: bool) -> None:
    assert found.values is not None
    seen = found.values[~np.isnan(_inside(shown, found.window)).any(axis=2)]
    low, high = main_range(seen)
    beyond = (bool((seen < low).any()), bool((seen > high).any()))
    pairs = [found.pairs(k) for k in range(shown.shape[1])] if lines else None
    drawn = _draw_coloured(axes, shown, found.values, pairs, (low, high))
    pad = 0.1 if len(found.labels) == 3 else 0.02
    bar = figure.colorbar(drawn, ax=axes, pad=pad, aspect=30, extend=_ENDS[beyond])
    bar.set_label(found.value_label)


def _draw_coloured(
    axes: Any, shown: FloatArray, values: FloatArray, joined: list[Any] | None, limits: tuple[float, float]
) -> Any:
    """Dots, or the lines that join these pairs of records of each orbit, in the colours of the values."""
    from matplotlib.collections import LineCollection
    from matplotlib.colors import Normalize

    norm = Normalize(*limits)
    count = shown.shape[0] * shown.shape[1]
    if joined is None:
        shown, values = shown.swapaxes(0, 1), values.swapaxes(0, 1)  # orbit after orbit
        there = ~np.isnan(shown).any(axis=2)
        size = {"s": dot_size(count) ** 2, "linewidths": 0, "rasterized": count > RASTERISE_ABOVE, "zorder": 2}
        more = {"depthshade": False} if shown.shape[2] == 3 else {}
        return axes.scatter(*shown[there].T, c=values[there], norm=norm, cmap=_on_white(), **size, **more)
    pairs = np.concatenate([shown[found, k] for k, found in enumerate(joined)])
    colours = np.concatenate([values[found[:, 0], k] for k, found in enumerate(joined)])
    there = ~np.isnan(pairs).any(axis=(1, 2))
    how: dict[str, Any] = {"norm": norm, "cmap": _on_white(), "linewidths": 0.6, "rasterized": count > RASTERISE_ABOVE}
    if shown.shape[2] == 3:
        from mpl_toolkits.mplot3d.art3d import Line3DCollection

        collection: Any = axes.add_collection3d(Line3DCollection(pairs[there], **how), autolim=False)
    else:
        collection = axes.add_collection(LineCollection(list(pairs[there]), zorder=2, **how), autolim=False)
    collection.set_array(colours[there])
    return collection


def _on_white() -> Any:
    """The map of colours without its lightest part: dots are small, and paper is white."""
    import matplotlib as mpl
    from matplotlib.colors import ListedColormap

    return ListedColormap(mpl.colormaps[COLOUR_MAP](np.linspace(0, 0.78, 256)))


def _inside(shown: FloatArray, window: Window) -> FloatArray:
    """NaN for points outside the window: axes in space do not cut them off."""
    low, high = (np.array(side) for side in zip(*window, strict=True))
    with np.errstate(invalid="ignore"):
        inside = np.all((shown >= low) & (shown <= high), axis=2)
    return np.where(np.asarray(inside)[..., None], shown, np.nan)


def _around(window: Window) -> Window:
    return tuple((low - 9 * (high - low), high + 9 * (high - low)) for low, high in window)


def _finish(axes: Any, labels: tuple[str, ...], window: Window) -> None:
    sides = "xyz"[: len(labels)]
    for side, label, limits in zip(sides, labels, window, strict=True):
        getattr(axes, f"set_{side}label")(label)
        getattr(axes, f"set_{side}lim")(*limits)


def _write_note(axes: Any, note: str, style: Style) -> None:
    if note:
        axes.set_title(note, loc="right", fontsize=style.smallest, color="#555555", pad=2)


def _make_room(axes: Any, window: Window | None) -> None:
    """Axes in space: light planes, few ticks, and labels inside the picture, which layouts do not look after.

    With a window the box has the proportions of its sides. Of the twelve edges matplotlib draws those of three planes.
    """
    from itertools import combinations, product

    from matplotlib.ticker import MaxNLocator

    axes.set_box_aspect(None if window is None else [high - low for low, high in window], zoom=0.84)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.pane.set_facecolor("white")
        axis.pane.set_edgecolor("#BBBBBB")
        axis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10], prune="both"))
    limits = (axes.get_xlim(), axes.get_ylim(), axes.get_zlim())
    for one, other in combinations(product(*limits), 2):
        if sum(a != b for a, b in zip(one, other, strict=True)) == 1:
            axes.plot(*zip(one, other, strict=True), color="#BBBBBB", linewidth=0.4, zorder=0)
    axes.tick_params(pad=0)
    axes.xaxis.labelpad = axes.yaxis.labelpad = axes.zaxis.labelpad = 0
