"""Rotation numbers of a member of the family along a line of initial points, as a picture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from flint import fmpq

from kahanmaps.algebra.fields import QQ, integer
from kahanmaps.errors import InputError, PrecisionLost
from kahanmaps.family.system_normal_form import SystemNormalForm
from kahanmaps.maps.normal_form.geometry import rotation_numbers
from kahanmaps.plots.figures import drawing, label_number, legend_above, legend_height, new_figure
from kahanmaps.plots.style import COLORS, LINES, Style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_ASPECT = 0.62
_SPACING = 0.04  # of marked resonances, relative to the height of the axes


def plot_rotation(
    normal_form: SystemNormalForm,
    eps: Any,
    first: Sequence[Any],
    last: Sequence[Any],
    style: Style | None = None,
    *,
    points: int = 200,
) -> Figure:
    """Plot the rotation numbers of map and flow against the position on the segment from one initial point to another.

    Args:
        normal_form: the normal form of the system.
        eps: half the time step, exact.
        first, last: the ends of the segment, exact.
        points: the number of initial points; singular levels among them are left out.

    Solid lines are the rotation numbers of the map, dashed lines those of its second iterate where the map exchanges
    two real components, dotted lines those of the flow at the time step 2 eps, modulo 1 and up to sign. Horizontal
    lines mark some 1/n. Only real roots of chi have rotation numbers. Raises InputError if there are none, and for
    fewer than two points.
    """
    if integer(points, "points") < 2:
        raise InputError(f"found {points} points, expected at least 2")
    ends = [[QQ.convert(x) for x in end] for end in (first, last)]
    if len(ends[0]) != len(ends[1]):
        raise InputError(f"found points with {len(ends[0])} and {len(ends[1])} coordinates, expected as many")
    positions = [fmpq(k, points - 1) for k in range(points)]
    rows: dict[str, list[tuple[float, float, float, int]]] = {}
    for position in positions:
        start = [a + position * (b - a) for a, b in zip(*ends, strict=True)]
        try:
            rotations = rotation_numbers(normal_form, eps, start)
        except PrecisionLost:
            continue
        for root, rotation in rotations.items():
            if rotation.flow is not None:
                flow = float(rotation.flow.mid()) % 1
                x, rho = float(position.p) / float(position.q), float(rotation.number.mid())
                row = (x, rho, min(flow, 1 - flow), rotation.steps)
                rows.setdefault(root, []).append(row)
    if not rows:
        raise InputError("found no initial point with a smooth level at a real root of chi, expected at least one")
    if len(rows) > len(COLORS):
        raise InputError(f"found {len(rows)} real roots of chi, expected at most {len(COLORS)} in one picture")
    style = style or Style()
    lines = sum(3 if any(row[3] == 2 for row in values) else 2 for values in rows.values())
    gap = 1.5 / max(1, points - 1)
    with drawing(style):
        figure = new_figure(style, _ASPECT + legend_height(["its second iterate, t = 1"] * lines, style, max_columns=2))
        axes = figure.subplots()
        for k, (root, values) in enumerate(rows.items()):
            table = np.array(values)
            # No line leads across a level that was left out, or to one with another number of components.
            breaks = 1 + np.flatnonzero((np.diff(table[:, 0]) > gap) | (np.diff(table[:, 3]) != 0))
            for part in np.split(table, breaks):
                line = LINES[1] if part[0, 3] == 2 else LINES[0]
                axes.plot(part[:, 0], part[:, 1], marker="." * (len(part) == 1), color=COLORS[k], linestyle=line)
                folds = 1 + np.flatnonzero(np.abs(np.diff(part[:, 2])) > 0.25)
                for piece in np.split(part, folds):
                    axes.plot(piece[:, 0], piece[:, 2], color=COLORS[k], linewidth=0.6, linestyle=":", zorder=1.5)
            axes.plot([], [], color=COLORS[k], linestyle=LINES[0], label=f"map, $t = {root}$")
            if (table[:, 3] == 2).any():
                axes.plot([], [], color=COLORS[k], linestyle=LINES[1], label=f"its second iterate, $t = {root}$")
            axes.plot([], [], color=COLORS[k], linewidth=0.6, linestyle=":", label=f"flow, $t = {root}$")
        low, high = axes.get_ylim()
        low, high = max(low, 0), min(high, 0.5)
        axes.set_ylim(low, high)
        axes.set_xlim(0, 1)
        for n in range(2, 1000):
            if 1 / (n - 1) - 1 / n < _SPACING * (high - low):
                break
            if low < 1 / n < high:
                axes.axhline(1 / n, color="0.75", linewidth=0.4, zorder=1)
                at: Any = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points", "va": "center"}
                axes.annotate(f"1/{n}", (1, 1 / n), (2, 0), **at)
        axes.set_xlabel("position on the segment of initial points")
        axes.set_ylabel(rf"rotation number $\rho$, $\varepsilon = {label_number(QQ.convert(eps))}$")
        legend_above(figure, *axes.get_legend_handles_labels(), style, max_columns=2)
    return figure
