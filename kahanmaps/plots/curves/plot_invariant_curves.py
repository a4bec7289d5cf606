"""Plots of the planes of a member of the commuting family: orbits and their invariant cubics, colored by step.

Dots of the same color are the projections of the same point of an orbit to the planes. Each projection moves along a
curve of its own, which shows that the map is a product. A panel shows a window that contains most of the dots, or the
projective plane as a disc.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np

from kahanmaps.errors import InputError
from kahanmaps.plots.curves.invariant_curves import InvariantCurves, InvariantPlane
from kahanmaps.plots.curves.level_sets import zero_curves
from kahanmaps.plots.curves.plane_cubics import THREE_LINES, Floats, PlaneCubic
from kahanmaps.plots.figures import MAX_VECTOR_POINTS, drawing, escape_dollars, label_of, new_figure, write_beside
from kahanmaps.plots.portraits.windows import Window, count_outside, window_of
from kahanmaps.plots.style import CENTIMETRES_PER_INCH, COLOR_MAP, COLORS, MARKS, Style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_CURVE_COLOR, _FLOW_COLOR = "#9a9a9a", "#444444"
_MIN_DISTANCE = 0.06  # in units of the panel width: a dot closer to an earlier dot has no number
_NUMBERED_STEPS = 4  # number of steps at the beginning whose dots are numbered


def plot_invariant_curves(
    curves: InvariantCurves,
    style: Style,
    projective: bool = False,
    flow: bool = False,
    original: tuple[int, int] | None = None,
    labels: Sequence[str] = (),
) -> Figure:
    """Plot the invariant cubics and the orbits on them: one panel for each real plane, two for each complex plane.

    If `projective`, a panel shows the projective plane as a disc; opposite points of its rim are the same point at
    infinity. `flow` adds a dashed curve through each initial point, the level curve of the differential equation.
    `original` is a pair of indices of variables: the first panel then shows the orbits in these variables. `labels` are
    the names of the initial points, if there are several. Raises InputError for invalid indices.
    """
    if original is not None and not all(0 <= k < len(curves.variables) for k in original):
        raise InputError(f"found the variables {original}, expected two numbers from 0 to {len(curves.variables) - 1}")
    panels = panels_of(curves)
    count = len(panels) + (original is not None)
    columns = count if count <= 3 else 2 if count == 4 else 3 if count <= 9 else 4
    letter_size = style.font_size * CENTIMETRES_PER_INCH / 72  # size of a letter in centimetres
    columns = min(columns, max(1, int(style.width / (12 * letter_size))))  # a panel is at least 12 letters wide
    rows = ceil(count / columns)
    # The panels are squares, with space for labels and a color bar.
    panel_width = max(1.0, style.width / max(columns, 1.25) - (0.5 if projective else 4.2) * letter_size)
    height = rows * (panel_width + (4.0 if projective else 5.2) * letter_size) + 4.6 * letter_size
    with drawing(style):
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize
        from matplotlib.lines import Line2D
        from matplotlib.ticker import MaxNLocator

        figure = new_figure(style, height / style.width)
        steps = max(len(x) for x in curves.originals) - 1
        # A single orbit is colored by step; of several orbits each has a color and a mark.
        pen = _Pen(Normalize(0, max(1, steps)) if len(curves.originals) == 1 else None, style)
        grid = iter(figure.subplots(rows, columns, squeeze=False).flat)
        if original is not None:
            axes = next(grid)
            clouds = [(x[:, original[0]], x[:, original[1]]) for x in curves.originals]
            axis_labels = label_of(curves.variables[original[0]]), label_of(curves.variables[original[1]])
            Rectangle.around(clouds).prepare(axes, axis_labels)
            axes.set_title("orbit")
            for number, cloud in enumerate(clouds):
                pen.orbit(axes, *cloud, number, None)
        for number_of_root, plane, column in panels:
            _draw_plane(next(grid), plane, column, number_of_root, projective, flow, pen)
        for axes in grid:
            axes.remove()
        if pen.scale is None:
            names = [labels[k] if k < len(labels) else f"start {k + 1}" for k in range(len(curves.poles))]
            ends = ["" if pole is None else f" (a pole at step {pole})" for pole in curves.poles]
            handles = [
                Line2D([], [], linestyle="none", marker=MARKS[k], color=COLORS[k], label=escape_dollars(name) + end)
                for k, (name, end) in enumerate(zip(names, ends, strict=True))
            ]
            figure.legend(handles=handles, loc="outside lower center", ncols=2)
        elif steps:
            options: dict[str, Any] = {"location": "bottom", "shrink": 0.6, "aspect": 40, "pad": 0.04}
            colorbar = figure.colorbar(ScalarMappable(pen.scale, COLOR_MAP), ax=figure.axes, **options)
            pole = curves.poles[0]
            ending = "" if pole is None else f"; a pole at step {pole} ends the orbit"
            colorbar.set_label(f"step $n$ (rings mark steps 0 to {min(_NUMBERED_STEPS - 1, steps)}{ending})")
            colorbar.outline.set_linewidth(0.4)
            colorbar.locator = MaxNLocator(nbins=6, integer=True)
    return figure


def panels_of(curves: InvariantCurves) -> list[tuple[str, InvariantPlane, str]]:
    """Return triples for the panels: number of the root, plane, and "uv" (real plane), "u" or "v" (complex plane)."""
    panels, number = [], 0
    for plane in curves.planes:
        number += 1
        if plane.is_real:
            panels.append((str(number), plane, "uv"))
        else:
            panels += [(str(number), plane, "u"), (str(number), plane, "v")]
            number += 1  # the conjugate root has a number too
    return panels


class _Pen:
    """The style of dots: with a color `scale`, a single orbit is colored by step; without, each orbit has a color."""

    def __init__(self, scale: Any, style: Style) -> None:
        self.scale, self.style = scale, style

    def orbit(self, axes: Axes, x: Floats, y: Floats, number: int, normals: Floats | None) -> None:
        count = len(x)
        size = 11.0 if count <= 120 else 6.0 if count <= 500 else 2.0 if count <= 5_000 else 0.6
        options: dict[str, Any] = {"color": COLORS[number], "marker": MARKS[number]}
        if self.scale is not None:
            options = {"c": np.arange(count), "norm": self.scale, "cmap": COLOR_MAP}
        axes.scatter(x, y, s=size, linewidths=0, zorder=2, rasterized=count > MAX_VECTOR_POINTS, **options)
        if self.scale is None:
            return
        for k in range(min(_NUMBERED_STEPS, count)):
            axes.plot(x[k], y[k], "o", markersize=4.2, fillstyle="none", color="black", markeredgewidth=0.5, zorder=3)
            limits = np.array([axes.get_xlim(), axes.get_ylim()])
            low, length = limits[:, 0], limits[:, 1] - limits[:, 0]
            positions = (np.stack([x[: k + 1], y[: k + 1]], axis=1) - low) / length
            if np.any(np.hypot(*(positions[:k] - positions[k]).T) < _MIN_DISTANCE):
                continue
            shift = np.array([0.7, 0.7]) if normals is None else normals[k]
            if np.any(np.abs(positions[k] + 2 * _MIN_DISTANCE * shift - 0.5) > 0.5):  # outside the panel
                shift = -shift
            options = {"fontsize": self.style.smallest, "ha": "center", "va": "center", "annotation_clip": True}
            write_beside(axes, str(k), (x[k], y[k]), tuple(8 * shift), 1.5, zorder=4, **options)


def _draw_plane(
    axes: Axes, plane: InvariantPlane, column: str, number_of_root: str, projective: bool, flow: bool, pen: _Pen
) -> None:
    view: Disc | Rectangle = Disc.of(plane, column) if projective else view_of(plane, column)
    if plane.is_real:
        names = f"$u_{{{number_of_root}}}$", f"$v_{{{number_of_root}}}$"
        axes.set_title(rf"$\lambda_{{{number_of_root}}} = {plane.root_text}$")
    else:
        name = f"{column}_{{{number_of_root}}}"
        names = rf"$\mathrm{{Re}}\,{name}$", rf"$\mathrm{{Im}}\,{name}$"
        root = f"{plane.root.real:.3g}" * (plane.root.real != 0) + rf" \pm {plane.root.imag:.3g}\,\mathrm{{i}}"
        axes.set_title(rf"$\lambda_{{{number_of_root},{int(number_of_root) + 1}}} = {root}$")
    view.prepare(axes, names)
    for orbit in plane.orbits:
        if orbit.cubic is None:
            continue
        for vertices in view.curves(orbit.cubic):
            axes.plot(*vertices.T, color=_CURVE_COLOR, linewidth=0.9, zorder=1)
        if flow:
            for vertices in view.curves(orbit.cubic.flow_through(float(orbit.u[0]), float(orbit.v[0]))):
                axes.plot(*vertices.T, color=_FLOW_COLOR, linewidth=0.5, linestyle=(0, (4, 3)), zorder=1.1)
    for number, (orbit, (x, y)) in enumerate(zip(plane.orbits, clouds_of(plane, column), strict=True)):
        normals = None
        if orbit.cubic is not None:  # unit normals of the drawn curve; the numbers of dots are shifted along them
            along_u, along_v = orbit.cubic.gradient(x[:_NUMBERED_STEPS], y[:_NUMBERED_STEPS])
            gradients = np.stack([along_u, along_v * view.stretch], axis=1)
            length = np.linalg.norm(gradients, axis=1, keepdims=True)
            normals = np.where(length > 0, gradients / np.where(length > 0, length, 1), np.sqrt(0.5))
        pen.orbit(axes, *view.place(x, y), number, normals)


Cloud = tuple[Floats, Floats]

_MIN_SHOWN_SHARE = 0.85  # minimal fraction of the dots in the window: orbits repeatedly come close to infinity
_CUT_ANGLE = 0.7390851  # a direction in which no cubic form with simple coefficients is 0
_MARGIN = 0.08  # fraction of the width added on each side for the numbers beside dots


@dataclass(frozen=True)
class Rectangle:
    """A window of the plane, and the number of dots outside of it."""

    window: Window
    outside: int

    @classmethod
    def of(cls, clouds: Sequence[Cloud], window: Window) -> Rectangle:
        """Return the rectangle of a window, with the number of dots of the `clouds` outside of it."""
        return cls(window, count_outside(np.concatenate([_rows(cloud) for cloud in clouds]), window))

    @classmethod
    def around(cls, clouds: Sequence[Cloud]) -> Rectangle:
        """Return a rectangle that contains most of the dots and all initial points."""
        points, starts = (
            np.concatenate(rows) for rows in zip(*((_rows(c), _rows(c)[:1]) for c in clouds), strict=True)
        )
        distances = np.hypot(*points.T)
        max_distance = np.quantile(distances, _MIN_SHOWN_SHARE, method="higher")
        if distances.max() > 2 * max_distance:
            points = points[distances <= max_distance]
        return cls.of(clouds, window_of(points, starts))

    @property
    def stretch(self) -> float:
        """The height of the window divided by its width, by which the normals of curves are scaled."""
        (left, right), (low, high) = self.window
        return (high - low) / (right - left)

    def prepare(self, axes: Axes, names: tuple[str, str]) -> None:
        """Make the panel square, and set its limits and labels."""
        axes.set_box_aspect(1)
        axes.set(xlim=self.window[0], ylim=self.window[1], xlabel=names[0], ylabel=names[1])
        axes.locator_params(nbins=5)

    def place(self, x: Floats, y: Floats) -> Cloud:
        """Return the positions of the points (x, y) in the panel: the points themselves."""
        return x, y

    def curves(self, cubic: PlaneCubic) -> tuple[Floats, ...]:
        """Return the components, arrays (n, 2), of a cubic in the window."""
        return zero_curves(cubic.value, self.window)


@dataclass(frozen=True)
class Disc:
    """The projective plane as a half sphere seen from above: 45 degrees is distance `length`, 90 degrees infinity."""

    length: float
    stretch: float = 1.0

    @classmethod
    def of(cls, plane: InvariantPlane, column: str = "uv") -> Disc:
        """Return the disc scaled by the conic that the map sends to infinity or, if it is empty, by the dots."""
        cubic = plane.orbits[0].cubic
        if cubic is not None and plane.shape != "0":
            return cls(cubic.length)
        distances = np.concatenate([np.hypot(x, y) for x, y in clouds_of(plane, column)])
        return cls(float(np.median(distances)) or 1.0)

    def prepare(self, axes: Axes, names: tuple[str, str]) -> None:
        """Draw the rim of the disc, and hide the axes."""
        from matplotlib.patches import Circle

        axes.set_aspect("equal")
        label = f"({names[0]} : {names[1]} : 1)"
        axes.set(xlim=(-1.03, 1.03), ylim=(-1.03, 1.03), xticks=[], yticks=[], frame_on=False, xlabel=label)
        axes.add_patch(Circle((0, 0), 1, fill=False, linewidth=0.6, zorder=1))

    def place(self, x: Floats, y: Floats) -> Cloud:
        """Return the positions of the points (x, y) in the disc."""
        x, y = x / self.length, y / self.length
        radius = np.hypot(np.hypot(x, y), 1)
        return x / radius, y / radius

    def curves(self, cubic: PlaneCubic) -> tuple[Floats, ...]:
        """Return the components, arrays (n, 2), of a cubic in the disc; each closes or joins two points of the rim."""
        domain = ((_CUT_ANGLE, _CUT_ANGLE + 2 * np.pi), (0.0, np.pi / 2))
        pieces = zero_curves(lambda angles: cubic.value_on_sphere(angles, self.length), domain)
        directions = [np.concatenate([np.cos(p[:, :1]), np.sin(p[:, :1])], axis=1) for p in pieces]
        return tuple(np.sin(p[:, 1:]) * direction for p, direction in zip(pieces, directions, strict=True))


def _rows(cloud: Cloud) -> Floats:
    return np.stack(cloud, axis=1)


def clouds_of(plane: InvariantPlane, column: str = "uv") -> list[Cloud]:
    """Return the dots of each orbit: (u, v), or for a complex plane the real and imaginary parts of u or of v."""
    if plane.is_real:
        return [(orbit.u, orbit.v) for orbit in plane.orbits]
    values = [orbit.u if column == "u" else orbit.v for orbit in plane.orbits]
    return [(value.real, value.imag) for value in values]


def view_of(plane: InvariantPlane, column: str = "uv") -> Rectangle:
    """Return the window of a plane: it contains most of the dots, and the origin unless they are far away from it.

    If the cubic h has a threefold symmetry, the origin is the center of the window, and u and v have the same scale.
    """
    clouds = clouds_of(plane, column)
    ranges = []
    for low, high in Rectangle.around(clouds).window:
        if abs(low + high) <= 3 * (high - low):
            margin = 0.1 * ((high - low) / 2)
            low, high = min(low, -margin), max(high, margin)
        ranges.append((low, high))
    if plane.shape == THREE_LINES and all(low <= 0 <= high for low, high in ranges):
        max_coordinate = max(max(abs(low), abs(high)) for low, high in ranges)
        ranges = [(-max_coordinate, max_coordinate), (-max_coordinate, max_coordinate)]
    margins = [_MARGIN * (high - low) for low, high in ranges]
    window = tuple((low - margin, high + margin) for (low, high), margin in zip(ranges, margins, strict=True))
    return Rectangle.of(clouds, window)
