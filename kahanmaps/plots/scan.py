"""Pictures of the plane of two parameters of a family of maps: where degrees of iterates grow more slowly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.errors import InputError
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.scan.conditions import points_outside
from kahanmaps.laboratory.scan.result import Component, Scan, growth_on
from kahanmaps.plots.curves.level_sets import level_curves
from kahanmaps.plots.figures import (
    LETTER_WIDTH,
    drawing,
    label_of,
    legend_above,
    legend_height,
    letter_count,
    new_figure,
    write_beside,
)
from kahanmaps.plots.point_functions import PointFunction
from kahanmaps.plots.portraits.windows import Window, is_inside, window_of
from kahanmaps.plots.style import COLORS, LINES, MARKS, Style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ASPECT = 0.8  # height over width of the axes
_EXPONENTIAL = f"{Growth.EXPONENTIAL} growth"  # components with this growth are thin lines without labels
_CONDITION_FONT_RATIO = 0.8  # font size of conditions, relative to the font size of other text
_LABEL_POSITIONS, _SAMPLES = 12, 300  # points of a curve: tried for its label; used to find labels that it crosses
_AXES_SHARE = 0.85  # the axes as a fraction of the width, and of the height, of the picture
_DEFAULT_WINDOW: Window = ((-2.0, 2.0), (-2.0, 2.0))


def plot_scan(
    scan: Scan, style: Style | None = None, *, window: Window | None = None, modulo: int | None = None
) -> Figure:
    """Draw the special curves and points in the plane of two parameters, with equations and a color for each growth.

    `window` is a pair (low, high) for each parameter; by default it contains most of the special points with rational
    coordinates. If `modulo` is a prime for which the scan tried all members, the special members modulo this prime are
    drawn instead. Raises InputError for a scan that is not over two parameters, and for any other prime.

    >>> from kahanmaps.documents.catalog import load
    >>> from kahanmaps.laboratory.scan.scan import scan
    >>> figure = plot_scan(scan(load("lotka_volterra"), ["a", "c"], terms=2, primes=[5, 7, 11]))
    >>> [text.get_text() for text in figure.legends[0].get_texts()]
    ['linear growth']
    """
    if len(scan.over) != 2:
        raise InputError(f"found a scan over {', '.join(scan.over)}, expected two parameters: a plane is drawn")
    style = style or Style()
    growths: dict[str, list[Component]] = {}  # growth -> its components, the slowest growth first
    for _, components in scan.classes:
        growth = growth_on(components)
        growths.setdefault(f"{Growth.UNKNOWN if growth is None else growth.growth} growth", []).extend(components)
    if modulo is not None:
        sweeps = {sweep.prime: sweep for sweep in scan.sweeps if sweep.complete}
        if modulo not in sweeps:
            primes = ", ".join(map(str, sweeps)) or "none were tried"
            raise InputError(f"found the prime {modulo}, expected one modulo which all members were tried: {primes}")
        # Each special member has the growth of a component that contains it and has its degrees.
        unassigned = {degrees: list(points) for degrees, points in sweeps[modulo].classes.items()}
        special = []
        for name, components in growths.items():
            dots, captions = list[tuple[int, ...]](), list[tuple[str, Sequence[tuple[float, ...]]]]()
            for component in components:
                candidates = unassigned.get(component.degrees, [])
                unassigned[component.degrees] = points_outside(candidates, [component], modulo) if candidates else []
                members = sorted(set(candidates) - set(unassigned[component.degrees]))
                dots += members
                captions += [(component.text, [members[len(members) // 2]])] if members and name != _EXPONENTIAL else []
            special.append(_ColorGroup(name, dots, [], captions))
        if unassigned_points := [point for points in unassigned.values() for point in points]:
            special.append(_ColorGroup("on no component", unassigned_points, [], []))
        return _draw(scan, style, special, ((-1, modulo), (-1, modulo)), f" modulo {modulo}")
    points = {name: [_position(c) for c in growths[name] if c.is_rational_point] for name in growths}
    if window is None:
        all_points = [point for points_of_growth in points.values() for point in points_of_growth]
        window = window_of(np.array(all_points)) if len(all_points) > 1 else _DEFAULT_WINDOW
    groups, context = [], ring(["u", "v", "eps"])
    for name, components in growths.items():
        curves = []
        for component in components:
            if component.dimension != 1:
                continue
            equation = component.equations[0].compose(*context.gens()[:2], ctx=context)
            function = PointFunction(component.text, RationalFunction(equation, context.constant(1)))
            if pieces := level_curves(function, (0, 1), 2, [0.0], window)[0]:
                curves.append((component.text, pieces))
        labels: list[tuple[str, Sequence[tuple[float, ...]]]]
        labels = [(component.text, [_position(component)]) for component in components if component.is_rational_point]
        for text, pieces in curves:
            # The label is on the longest piece, preferably away from its middle, where curves often cross.
            longest = max(pieces, key=len)
            ends = _resampled(longest, _LABEL_POSITIONS + 1)
            indices = sorted(range(1, _LABEL_POSITIONS), key=lambda k: abs(4 * k - 3 * _LABEL_POSITIONS))
            nearest = (longest[np.hypot(*(longest - end).T).argmin()] for end in ends[indices])  # vertices of the curve
            labels.append((text, [tuple(map(float, point)) for point in nearest]))
        every_piece = [piece for _, pieces in curves for piece in pieces]
        groups.append(_ColorGroup(name, points[name], every_piece, labels if name != _EXPONENTIAL else []))
    return _draw(scan, style, groups, window, "")


@dataclass(frozen=True)
class _ColorGroup:
    """What is drawn in one color: points, pieces of curves, and pairs (condition, possible positions of its label)."""

    name: str
    points: Sequence[tuple[float, ...]]
    curves: Sequence[np.ndarray]
    labels: Sequence[tuple[str, Sequence[tuple[float, ...]]]]


def _draw(scan: Scan, style: Style, groups: list[_ColorGroup], window: Window, label_suffix: str) -> Figure:
    from matplotlib.collections import LineCollection
    from matplotlib.lines import Line2D

    points = [np.array(group.points, dtype=float) for group in groups]
    names = [g.name for g, x in zip(groups, points, strict=True) if g.curves or any(is_inside(x, window))]
    with drawing(style):
        figure = new_figure(style, _ASPECT + legend_height(names, style))
        axes = figure.subplots()
        handles = []
        for k, group in enumerate(groups):
            color, mark = COLORS[k % len(COLORS)], MARKS[k % len(MARKS)]
            width = 0.5 if group.name == _EXPONENTIAL else 1.2
            axes.add_collection(
                LineCollection(group.curves, colors=color, linestyles=[LINES[k % len(LINES)]], linewidths=width),
                autolim=False,
            )
            columns = np.array(group.points, dtype=float).reshape(-1, 2).T
            size = style.font_size / (4 if label_suffix or group.name == _EXPONENTIAL else 2)
            axes.plot(*columns, mark, color=color, markersize=size, zorder=10 - k)
            if group.name in names:
                marker_style: dict[str, Any] = {
                    "marker": mark if group.points else "",
                    "linestyle": LINES[k % len(LINES)] if group.curves else "",
                }
                handles.append(Line2D([], [], color=color, markersize=size, linewidth=width, **marker_style))
        _write_labels(axes, groups, window, style)
        axes.set(xlim=window[0], ylim=window[1])
        axes.set(xlabel=label_of(scan.over[0]) + label_suffix, ylabel=label_of(scan.over[1]) + label_suffix)
        if handles:
            legend_above(figure, handles, names, style)
    return figure


def _write_labels(axes: Axes, groups: list[_ColorGroup], window: Window, style: Style) -> None:
    """Write the conditions beside their curves, then those beside their points, if they fit; labels may cover points.

    Points with the fastest growth below exponential are labelled first. If a label fits at several positions, the
    position that is crossed by the fewest curves is chosen.
    """
    em = _CONDITION_FONT_RATIO * style.font_size
    em_x, em_y = (em / (72 * _AXES_SHARE * inches) for inches in style.inches(_ASPECT))
    labels = [(*item, COLORS[k % len(COLORS)]) for k, group in enumerate(groups) for item in group.labels]
    labels.sort(key=lambda item: (" = " not in item[0], -COLORS.index(item[2])))

    def scaled(position: Sequence[float]) -> tuple[float, ...]:
        return tuple((c - low) / (end - low) for c, (low, end) in zip(position, window, strict=True))

    mark_boxes = []
    for x, y in (scaled(position) for group in groups for position in group.points):
        mark_boxes.append((x - 0.35 * em_x, x + 0.35 * em_x, y - 0.35 * em_y, y + 0.35 * em_y))
    samples = np.array([scaled(x) for group in groups for piece in group.curves for x in _resampled(piece, _SAMPLES)])
    boxes: list[tuple[float, ...]] = []
    for text, positions, color in labels:
        label, is_curve = label_of(text), " = " in text
        width = LETTER_WIDTH * letter_count(label) * em_x
        candidates: list[Any] = []
        for position, side, up in product(positions, (1, -1), (1, -1)):
            x, y = scaled(position)
            low, bottom = x + (0.4 * em_x if side > 0 else -0.4 * em_x - width), y + up * 0.7 * em_y - 0.6 * em_y
            box = (low, low + width, bottom, bottom + 1.2 * em_y)
            covered_count = sum(_overlap(box, item) for item in mark_boxes)
            if (
                min(box) < 0
                or max(box) > 1
                or any(_overlap(box, item) for item in boxes)
                or (covered_count and not is_curve)
            ):
                continue
            is_in_box = (samples.reshape(-1, 2) > (box[0], box[2])) & (samples.reshape(-1, 2) < (box[1], box[3]))
            crossings = int(is_in_box.all(axis=1).sum())
            candidates.append((covered_count, crossings, len(candidates), position, side, up, box))
        if candidates:
            *_, position, side, up, box = min(candidates, key=lambda item: item[:3])
            boxes.append(box)
            alignment = {"ha": "left" if side > 0 else "right", "va": "center"}
            offset = (0.4 * em * side, 0.7 * em * up)
            write_beside(axes, label, position, offset, halo=2.5, size=em, color=color, zorder=20, **alignment)


def _overlap(box: tuple[float, ...], other_box: tuple[float, ...]) -> bool:
    return box[0] < other_box[1] and other_box[0] < box[1] and box[2] < other_box[3] and other_box[2] < box[3]


def _resampled(piece: np.ndarray, count: int) -> np.ndarray:
    lengths = np.concatenate([[0.0], np.hypot(*np.diff(piece, axis=0).T).cumsum()])
    arc_lengths = np.linspace(0, lengths[-1], count)
    return np.stack([np.interp(arc_lengths, lengths, column) for column in piece.T], axis=-1)


def _position(component: Component) -> tuple[float, float]:
    first, second = (component.values or {}).values()
    return float(first.p) / float(first.q), float(second.p) / float(second.q)
