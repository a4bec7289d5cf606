"""Pictures of rotation numbers for the initial points on a segment."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
from flint import fmpq

from kahanmaps.algebra.fields import QQ, integer
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError, PrecisionLost, UnknownCurve, quoted
from kahanmaps.family.system_normal_form import NoNormalForm
from kahanmaps.maps.normal_form.geometry import Rotation, rotation_numbers
from kahanmaps.maps.orbits.relations.orbit_curve import orbit_curve, require_rational
from kahanmaps.plots.figures import drawing, label_number, label_of, legend_above, legend_height, new_figure
from kahanmaps.plots.style import COLORS, LINES, Style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_ASPECT = 0.62  # height over width of the axes
_MIN_SPACING = 0.05  # minimal distance between marked resonances, relative to the height of the axes
_MIN_RESONANCES, _MAX_DENOMINATOR = 3, 1000  # minimal number of marked resonances p/q if possible, upper bound for q
_MAX_POINTS = 10_000  # maximal number of initial points


def plot_rotation(
    file: SystemFile,
    eps: Any,
    first: Sequence[Any],
    last: Sequence[Any],
    style: Style | None = None,
    *,
    points: int = 200,
    against: str | None = None,
) -> Figure:
    """Plot the rotation numbers of a map for initial points on a segment.

    Args:
        file: the system or the map.
        eps: half the time step (exact); None for a map without eps.
        first, last: the end points of the segment (exact).
        points: the number of initial points; points without a rotation number are omitted.
        against: the declared integral whose value is the horizontal coordinate; None for the position on the segment.

    A system with a normal form has a rotation number for each real root of chi, unless the level curve is singular. Any
    other map has a rotation number at a point if a curve of genus 1 or 0 that contains the orbit is found. Solid lines
    belong to the map, dashed lines to an iterate, e.g. the second one if the map exchanges two real components. Dotted
    lines belong to the flow for the time 2 eps, modulo 1 and up to sign. Horizontal lines mark resonances p/q.

    Raises InputError if no initial point has a rotation number, for fewer than 2 or more than 10,000 points, and for an
    unknown integral.
    """
    if not 2 <= integer(points, "points") <= _MAX_POINTS:
        raise InputError(f"found {points} points, expected 2 to {_MAX_POINTS}")
    map_over, integrals, normal_form = file.at(eps), file.integrals, file.normal_form
    require_rational(map_over)
    if against is not None and against not in integrals:
        names = ", ".join(integrals) or "it declares none"
        raise InputError(f"found no integral {quoted(against)} of {file.name}, expected one that it declares: {names}")
    ends = [[QQ.convert(x) for x in map_over.point(end)] for end in (first, last)]
    rows: dict[str, list[tuple[float, float, float, int, int]]] = {}
    for k in range(points):
        position = fmpq(k, points - 1)
        start = [a + position * (b - a) for a, b in zip(*ends, strict=True)]
        abscissa = position if against is None else integrals[against].value(QQ, (*start, map_over.eps))
        rotations: dict[str, Rotation] = {}
        try:
            if not isinstance(normal_form, NoNormalForm):
                rotations = rotation_numbers(normal_form, map_over.eps, start)
            elif (curve := orbit_curve(map_over, start, file.map, list(integrals.values()))).rotation is not None:
                rotations[""] = Rotation("", (curve.rotation,), curve.iterate * curve.steps)
        except (PrecisionLost, UnknownCurve, InputError):  # a finite orbit, an orbit that ends, or no known curve
            continue
        for root, rotation in rotations.items() if abscissa is not None else ():
            if len(rotation.numbers) == 1:
                flow = math.nan if rotation.flow is None else float(rotation.flow.mid()) % 1
                x, rho = float(abscissa.p) / float(abscissa.q), float(rotation.number.mid())
                rows.setdefault(root, []).append((x, rho, min(flow, 1 - flow), rotation.steps, k))
    if not rows:
        raise InputError(
            "found no initial point with a rotation number, expected one on a smooth level at a real root of chi, or "
            "on a curve of genus 1 or 0; kahanmaps geometry describes the curve of a single point"
        )
    if len(rows) > len(COLORS):
        raise InputError(f"found {len(rows)} real roots of chi, expected at most {len(COLORS)} in one picture")
    style = style or Style()
    legend: list[tuple[str, Any]] = []
    for k, (root, root_rows) in enumerate(rows.items()):
        at_root = f", $t = {root}$" if root else ""
        for steps in sorted({row[3] for row in root_rows}):
            name = {1: "map", 2: "its second iterate"}.get(steps, f"its iterate {steps}")
            legend.append((name + at_root, {"color": COLORS[k], "linestyle": LINES[min(steps - 1, 1)]}))
        if root:
            legend.append(("flow" + at_root, {"color": COLORS[k], "linewidth": 0.6, "linestyle": ":"}))
    with drawing(style):
        height = legend_height([name for name, _ in legend], style, max_columns=2)
        figure = new_figure(style, _ASPECT + height)
        axes = figure.subplots()
        for k, root_rows in enumerate(rows.values()):
            table = np.array(root_rows)
            # No line crosses an omitted point, or joins numbers of different iterates.
            breaks = 1 + np.flatnonzero((np.diff(table[:, 4]) > 1) | (np.diff(table[:, 3]) != 0))
            for branch in np.split(table, breaks):
                line = LINES[min(int(branch[0, 3]) - 1, 1)]
                axes.plot(branch[:, 0], branch[:, 1], marker="." * (len(branch) == 1), color=COLORS[k], linestyle=line)
                folds = 1 + np.flatnonzero(np.abs(np.diff(branch[:, 2])) > 0.25)
                for piece in np.split(branch, folds):
                    axes.plot(piece[:, 0], piece[:, 2], color=COLORS[k], linewidth=0.6, linestyle=":", zorder=1.5)
        for name, properties in legend:
            axes.plot([], [], label=name, **properties)
        low, high = axes.get_ylim()
        low, high = max(low, 0), min(high, 0.5)
        axes.set_ylim(low, high)
        if against is None:
            axes.set_xlim(0, 1)
        for value in _resonances(low, high):
            axes.axhline(float(value), color="0.75", linewidth=0.4, zorder=1)
            text_options: Any = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points", "va": "center"}
            axes.annotate(str(value), (1, float(value)), (2, 0), **text_options)
        axes.set_xlabel("position on the segment of initial points" if against is None else label_of(against))
        eps = rf", $\varepsilon = {label_number(map_over.eps)}$" if file.map.has_eps else ""
        axes.set_ylabel(rf"rotation number $\rho${eps}")
        legend_above(figure, *axes.get_legend_handles_labels(), style, max_columns=2)
    return figure


def _resonances(low: float, high: float) -> list[Fraction]:
    """Return spaced fractions p/q in (low, high): all q up to twice the least q, and larger q until there are three."""
    resonances: list[Fraction] = []
    for q in range(2, _MAX_DENOMINATOR):
        if len(resonances) >= _MIN_RESONANCES and q > 2 * resonances[0].denominator:
            break
        for p in range(math.ceil(low * q), math.floor(high * q) + 1):
            value = Fraction(p, q)
            if low < value < high and all(abs(value - r) >= _MIN_SPACING * (high - low) for r in resonances):
                resonances.append(value)
    return resonances
