"""What a portrait shows of the differential equation: grey arrows, separatrices, solutions, marks at equilibria."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from kahanmaps.plots.figures import legend_above
from kahanmaps.plots.portraits.equilibria import CENTRE, DEGENERATE, FOCUS, NODE, SADDLE
from kahanmaps.plots.portraits.flow import Flow
from kahanmaps.plots.style import Style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_ARROWS = "#C4C4C4"
_SEPARATRIX = {"color": "#666666", "linewidth": 0.7, "linestyle": (0, (6, 2, 1, 2))}
_SOLUTION = {"color": "#888888", "linewidth": 0.5}
_FILLED: dict[str, Any] = {"color": "black", "markeredgecolor": "white", "markeredgewidth": 0.5}
_OPEN: dict[str, Any] = {"markeredgecolor": "black", "markerfacecolor": "white", "markeredgewidth": 0.8}
_MARKS: dict[str, dict[str, Any]] = {
    SADDLE: {"marker": "x", "markeredgecolor": "black", "markeredgewidth": 1.2, "markersize": 5},
    CENTRE: {"marker": "o", "markersize": 5, **_OPEN},
    FOCUS: {"marker": "D", "markersize": 4.5, **_OPEN},
    NODE: {"marker": "s", "markersize": 5, **_FILLED},
    DEGENERATE: {"marker": "*", "markersize": 7, **_FILLED},
}


def draw_flow(figure: Figure, axes: Any, found: Flow, style: Style) -> None:
    """Draw it below the orbits, equilibria above them; a legend says what marks and lines are."""
    handles: dict[str, Any] = {}
    if len(found.places):
        how: dict[str, Any] = {"width": 0.0018, "headwidth": 4, "headlength": 4, "headaxislength": 3.5}
        axes.quiver(
            *found.places.T, *found.arrows.T, units="width", scale=34, pivot="mid", color=_ARROWS, zorder=0.5, **how
        )
    lines = (("separatrix", found.separatrices, _SEPARATRIX), ("flow", found.solutions, _SOLUTION))
    for word, curves, look in lines:
        for curve in curves:
            (handles[word],) = axes.plot(*curve.T, zorder=1.2, **look)
    for kind, point in found.equilibria:
        (handles[kind],) = axes.plot(*point[:, None], linestyle="none", zorder=4, clip_on=False, **_MARKS[kind])
    if handles:
        legend_above(figure, list(handles.values()), list(handles), style)
