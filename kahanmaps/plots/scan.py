"""The plane of two parameters of a family of maps, with the conditions under which degrees grow more slowly."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.errors import InputError
from kahanmaps.laboratory.growth.recurrences import GrowthClass
from kahanmaps.laboratory.scan.result import Component, Scan, growth_on
from kahanmaps.plots.figures import drawing, label_of, legend_above, legend_height, new_figure
from kahanmaps.plots.level_sets import level_curves
from kahanmaps.plots.point_functions import PointFunction
from kahanmaps.plots.style import COLOURS, LINES, MARKS, Style
from kahanmaps.plots.windows import Window, window_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_ASPECT = 0.8
_USUAL: Window = ((-2.0, 2.0), (-2.0, 2.0))


def draw_scan(found: Scan, style: Style | None = None, *, window: Window | None = None) -> Figure:
    """Curves and points of the plane of two parameters, a colour for each kind of growth.

    `window` is (low, high) of each parameter; by default it holds most of the points with rational parameters. Raises
    InputError for a scan over another number of parameters.

    >>> from kahanmaps.documents.catalog import load
    >>> from kahanmaps.laboratory.scan.scan import scan
    >>> figure = draw_scan(scan(load("zhukovski_volterra_2"), ["b1", "b2"], terms=3, primes=[11, 13, 17]))
    >>> [text.get_text() for text in figure.legends[0].get_texts()]
    ['quadratic growth']
    """
    from matplotlib.collections import LineCollection

    if len(found.over) != 2:
        raise InputError(f"found a scan over {', '.join(found.over)}, expected two parameters: a plane is drawn")
    style = style or Style()
    kinds = _kinds(found)
    points = {kind: [_place(one) for one in some if one.is_rational_point] for kind, some in kinds.items()}
    if window is None:
        every = [place for some in points.values() for place in some]
        window = window_of(np.array(every)) if len(every) > 1 else _USUAL
    with drawing(style):
        figure = new_figure(style, _ASPECT + legend_height(list(kinds), style))
        axes = figure.subplots()
        handles = []
        for k, (kind, some) in enumerate(kinds.items()):
            pieces = [piece for one in some if one.dimension == 1 for piece in _curve(one, window)]
            axes.add_collection(LineCollection(pieces, colors=COLOURS[k], linestyles=[LINES[k]]), autolim=False)
            columns = np.array(points[kind]).reshape(-1, 2).T
            handles += axes.plot(*columns, MARKS[k], color=COLOURS[k], markersize=style.font_size / 2, zorder=10 - k)
        axes.set(xlim=window[0], ylim=window[1], xlabel=label_of(found.over[0]), ylabel=label_of(found.over[1]))
        if handles:
            legend_above(figure, handles, list(kinds), style)
    return figure


def _kinds(found: Scan) -> dict[str, list[Component]]:
    """The components by the growth of their blocks, the slowest first."""
    kinds: dict[str, list[Component]] = {}
    for _, some in found.classes:
        growth = growth_on(some)
        kind = GrowthClass.UNKNOWN if growth is None else growth.growth
        kinds.setdefault(f"{kind} growth", []).extend(some)
    return kinds


def _place(one: Component) -> tuple[float, float]:
    first, second = (one.values or {}).values()
    return float(first.p) / float(first.q), float(second.p) / float(second.q)


def _curve(one: Component, window: Window) -> list[np.ndarray]:
    """The curve in the window, in pieces."""
    context = ring(["u", "v", "eps"])
    equation = one.equations[0].compose(*context.gens()[:2], ctx=context)
    function = PointFunction(one.text, RationalFunction(equation, context.constant(1)), 0.0)
    return [piece for pieces in level_curves(function, (0, 1), 2, [0.0], window).pieces for piece in pieces]
