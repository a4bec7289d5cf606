"""The plane of two parameters of a family of maps, with the conditions under which degrees grow more slowly."""

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
from kahanmaps.plots.portraits.windows import Window, inside, window_of
from kahanmaps.plots.style import COLORS, LINES, MARKS, Style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ASPECT = 0.8
_MANY = f"{Growth.EXPONENTIAL} growth"  # drawn as thin lines without labels
_CONDITION_SIZE = 0.8  # font size of conditions, relative to the font size of other text
_PLACES, _DOTS = 12, 300  # parts of a curve: for the positions of its condition, and to find labels that it crosses
_INNER = 0.85  # the axes as a fraction of the width and height of the picture
_USUAL: Window = ((-2.0, 2.0), (-2.0, 2.0))


def plot_scan(
    scan: Scan, style: Style | None = None, *, window: Window | None = None, modulo: int | None = None
) -> Figure:
    """Draw the special curves and points of the plane of two parameters, with conditions and a color for each growth.

    `window` is (low, high) for each parameter; by default it contains most of the points with rational parameters. With
    `modulo`, a prime for which the scan tried all members, all special members modulo this prime are drawn instead.
    Raises InputError for a scan over another number of parameters, and for another prime.

    >>> from kahanmaps.documents.catalog import load
    >>> from kahanmaps.laboratory.scan.scan import scan
    >>> figure = plot_scan(scan(load("lotka_volterra"), ["a", "c"], terms=2, primes=[5, 7, 11]))
    >>> [text.get_text() for text in figure.legends[0].get_texts()]
    ['linear growth']
    """
    if len(scan.over) != 2:
        raise InputError(f"found a scan over {', '.join(scan.over)}, expected two parameters: a plane is drawn")
    style = style or Style()
    kinds: dict[str, list[Component]] = {}  # growth -> components with this growth, the slowest growth first
    for _, some in scan.classes:
        growth = growth_on(some)
        kinds.setdefault(f"{Growth.UNKNOWN if growth is None else growth.growth} growth", []).extend(some)
    if modulo is not None:
        known = {component.prime: component for component in scan.sweeps if component.complete}
        if modulo not in known:
            tried = ", ".join(map(str, known)) or "none were tried"
            raise InputError(f"found the prime {modulo}, expected one modulo which all members were tried: {tried}")
        # The special members, each with the growth of a component that contains the member and has its degrees.
        unassigned = {degrees: list(points) for degrees, points in known[modulo].classes.items()}
        special = []
        for kind, some in kinds.items():
            dots, texts = list[tuple[int, ...]](), list[tuple[str, Sequence[tuple[float, ...]]]]()
            for component in some:
                before = unassigned.get(component.degrees, [])
                unassigned[component.degrees] = points_outside(before, [component], modulo) if before else []
                on = sorted(set(before) - set(unassigned[component.degrees]))
                dots += on
                texts += [(component.text, [on[len(on) // 2]])] if on and kind != _MANY else []
            special.append(_Kind(kind, dots, [], texts))
        if left := [point for points in unassigned.values() for point in points]:
            special.append(_Kind("on no component", left, [], []))
        return _draw(scan, style, special, ((-1, modulo), (-1, modulo)), f" modulo {modulo}")
    points = {
        kind: [_place(component) for component in some if component.is_rational_point] for kind, some in kinds.items()
    }
    if window is None:
        every = [place for some in points.values() for place in some]
        window = window_of(np.array(every)) if len(every) > 1 else _USUAL
    drawn, context = [], ring(["u", "v", "eps"])
    for kind, some in kinds.items():
        curves = []
        for component in some:
            if component.dimension != 1:
                continue
            equation = component.equations[0].compose(*context.gens()[:2], ctx=context)
            function = PointFunction(component.text, RationalFunction(equation, context.constant(1)))
            if pieces := level_curves(function, (0, 1), 2, [0.0], window)[0]:
                curves.append((component.text, pieces))
        labels: list[tuple[str, Sequence[tuple[float, ...]]]]
        labels = [(component.text, [_place(component)]) for component in some if component.is_rational_point]
        for (
            text,
            pieces,
        ) in curves:  # the label is on the longest piece, preferably off its middle, where curves rarely cross
            longest = max(pieces, key=len)
            ends = _resampled(longest, _PLACES + 1)
            parts = sorted(range(1, _PLACES), key=lambda k: abs(4 * k - 3 * _PLACES))
            nearest = (longest[np.hypot(*(longest - end).T).argmin()] for end in ends[parts])  # vertices of the curve
            labels.append((text, [tuple(map(float, point)) for point in nearest]))
        every_piece = [piece for _, pieces in curves for piece in pieces]
        drawn.append(_Kind(kind, points[kind], every_piece, labels if kind != _MANY else []))
    return _draw(scan, style, drawn, window, "")


@dataclass(frozen=True)
class _Kind:
    """The objects of one color: points, pieces of curves, and conditions with possible label positions."""

    name: str
    points: Sequence[tuple[float, ...]]
    curves: Sequence[np.ndarray]
    labels: Sequence[tuple[str, Sequence[tuple[float, ...]]]]


def _draw(scan: Scan, style: Style, kinds: list[_Kind], window: Window, beside_name: str) -> Figure:
    from matplotlib.collections import LineCollection
    from matplotlib.lines import Line2D

    names = [kind.name for kind in kinds if kind.curves or any(inside(np.array(kind.points, dtype=float), window))]
    with drawing(style):
        figure = new_figure(style, _ASPECT + legend_height(names, style))
        axes = figure.subplots()
        handles = []
        for k, kind in enumerate(kinds):
            color, mark = COLORS[k % len(COLORS)], MARKS[k % len(MARKS)]
            width = 0.5 if kind.name == _MANY else 1.2
            axes.add_collection(
                LineCollection(kind.curves, colors=color, linestyles=[LINES[k % len(LINES)]], linewidths=width),
                autolim=False,
            )
            columns = np.array(kind.points, dtype=float).reshape(-1, 2).T
            size = style.font_size / (4 if beside_name or kind.name == _MANY else 2)
            axes.plot(*columns, mark, color=color, markersize=size, zorder=10 - k)
            if kind.name in names:
                shown: dict[str, Any] = {
                    "marker": mark if kind.points else "",
                    "linestyle": LINES[k % len(LINES)] if kind.curves else "",
                }
                handles.append(Line2D([], [], color=color, markersize=size, linewidth=width, **shown))
        _write(axes, kinds, window, style)
        axes.set(xlim=window[0], ylim=window[1])
        axes.set(xlabel=label_of(scan.over[0]) + beside_name, ylabel=label_of(scan.over[1]) + beside_name)
        if handles:
            legend_above(figure, handles, names, style)
    return figure


def _write(axes: Axes, kinds: list[_Kind], window: Window, style: Style) -> None:
    """Write conditions next to their curves, then next to points, if they fit; labels may cover points.

    Points with the fastest growth that is not exponential are labelled first. Among the positions at which a label
    fits, the position crossed by the fewest curves is chosen.
    """
    em = _CONDITION_SIZE * style.font_size
    across, high = (em / (72 * _INNER * inches) for inches in style.inches(_ASPECT))
    labels = [(*entry, COLORS[k % len(COLORS)]) for k, kind in enumerate(kinds) for entry in kind.labels]
    labels.sort(key=lambda entry: (" = " not in entry[0], -COLORS.index(entry[2])))

    def scaled(place: Sequence[float]) -> tuple[float, ...]:
        return tuple((c - low) / (end - low) for c, (low, end) in zip(place, window, strict=True))

    marks = []
    for x, y in (scaled(place) for kind in kinds for place in kind.points):
        marks.append((x - 0.35 * across, x + 0.35 * across, y - 0.35 * high, y + 0.35 * high))
    lines = np.array([scaled(x) for kind in kinds for piece in kind.curves for x in _resampled(piece, _DOTS)])
    taken: list[tuple[float, ...]] = []
    for text, places, color in labels:
        label, is_curve = label_of(text), " = " in text
        wide = LETTER_WIDTH * letter_count(label) * across
        candidates: list[Any] = []
        for place, side, up in product(places, (1, -1), (1, -1)):
            x, y = scaled(place)
            low, bottom = x + (0.4 * across if side > 0 else -0.4 * across - wide), y + up * 0.7 * high - 0.6 * high
            box = (low, low + wide, bottom, bottom + 1.2 * high)
            covered = sum(_overlap(box, entry) for entry in marks)
            if (
                min(box) < 0
                or max(box) > 1
                or any(_overlap(box, entry) for entry in taken)
                or (covered and not is_curve)
            ):
                continue
            held = (lines.reshape(-1, 2) > (box[0], box[2])) & (lines.reshape(-1, 2) < (box[1], box[3]))
            candidates.append((covered, int(held.all(axis=1).sum()), len(candidates), place, side, up, box))
        if candidates:
            *_, place, side, up, box = min(candidates, key=lambda entry: entry[:3])
            taken.append(box)
            where = {"ha": "left" if side > 0 else "right", "va": "center"}
            offset = (0.4 * em * side, 0.7 * em * up)
            write_beside(axes, label, place, offset, halo=2.5, size=em, color=color, zorder=20, **where)


def _overlap(box: tuple[float, ...], other_box: tuple[float, ...]) -> bool:
    return box[0] < other_box[1] and other_box[0] < box[1] and box[2] < other_box[3] and other_box[2] < box[3]


def _resampled(piece: np.ndarray, count: int) -> np.ndarray:
    lengths = np.concatenate([[0.0], np.hypot(*np.diff(piece, axis=0).T).cumsum()])
    at = np.linspace(0, lengths[-1], count)
    return np.stack([np.interp(at, lengths, column) for column in piece.T], axis=-1)


def _place(component: Component) -> tuple[float, float]:
    first, second = (component.values or {}).values()
    return float(first.p) / float(first.q), float(second.p) / float(second.q)
