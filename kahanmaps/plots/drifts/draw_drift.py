"""The drift of integrals drawn: a panel for each function, a line for each method."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from kahanmaps.errors import InputError
from kahanmaps.maps.convention import time_step
from kahanmaps.plots.drifts.drift import METHODS, DriftSurvey
from kahanmaps.plots.figures import (
    drawing,
    label_number,
    legend_above,
    legend_height,
    log_scale_with_zero,
    new_figure,
    wrapped,
)
from kahanmaps.plots.style import COLOURS, LINES, Style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SCALES = ("loglog", "semilog")
_PANEL = 5.5  # centimetres that a panel needs beside another
_LOST = 1e3
_NO_VALUES = (1e-17, 1e-15)  # the axis where everything is 0


def draw_drift(survey: DriftSurvey, style: Style | None = None, *, scale: str = "loglog") -> Figure:
    """The errors of a survey against the step, logarithmic: a panel for each function, a line for each method.

    `scale` is "loglog", or "semilog" with a linear axis of steps. An error of exactly 0 lies in a band marked 0 at the
    bottom, an arrow at the top stands for errors beyond `clipped_from`. A cross ends the line of an orbit that ended
    early, and the legend says where. Raises InputError for a scale of another name.
    """
    if scale not in SCALES:
        raise InputError(f"found the scale {scale[:40]!r}, expected {' or '.join(SCALES)}")
    style = style or Style()
    count = len(survey.labels)
    columns = 1 if count <= 3 else 3 if count > 4 and style.width >= 3 * _PANEL else 2
    if count <= 3 and style.width >= _PANEL * count:
        columns = count
    rows = -(-count // columns)
    with drawing(style):
        from matplotlib.lines import Line2D

        ended = {method: "" if end.is_whole else f" (ended at step {end.steps})" for method, end in survey.ends.items()}
        labels = [METHODS[method] + word for method, word in ended.items()]
        panel = 0.62 if count == 1 else 0.85 / columns if columns > 1 else 0.5 if rows == 2 else 0.45
        aspect = panel * rows + legend_height(labels, style, title=True)
        figure = new_figure(style, aspect)
        room = 0.75 / rows * 72 * style.inches(aspect)[1]  # for what stands beside a panel, in points
        panels = figure.subplots(rows, columns, sharex=True, squeeze=False).ravel()
        for axes, name in zip(panels, survey.labels, strict=False):
            curves = [curve for curve in survey.curves if curve.function == name]
            errors = np.concatenate([curve.errors for curve in curves]) if curves else np.array([])
            limit = clipped_from(survey, name)
            positive = np.minimum(errors[errors > 0], limit)
            least, largest = (positive.min(), positive.max()) if len(positive) else _NO_VALUES
            zero = log_scale_with_zero(axes, float(least), float(largest), len(positive) < len(errors))
            if scale == "loglog":
                axes.set_xscale("log")
                axes.set_xlim(1 if survey.steps > 9 else 0.9, max(survey.steps, 2))
            else:
                axes.set_xlim(0, survey.steps)
            for curve in curves:
                look = _look(curve.method)
                heights = np.where(curve.errors > 0, curve.errors, np.nan if zero is None else zero)
                axes.plot(curve.steps, heights, linewidth=0.9, marker="o" if len(heights) == 1 else None, **look)
                end = {"color": look["color"], "markersize": 5, "clip_on": False}
                beyond = np.flatnonzero(heights > limit)
                if len(beyond):
                    axes.plot(curve.steps[beyond[:1]], [limit], marker="^", **end)
                elif len(heights) and not survey.ends[curve.method].is_whole:
                    axes.plot(curve.steps[-1:], heights[-1:], marker="x", **end)
            # A line is broken before the name, and never within: the name may be a formula with blanks in it.
            named = survey.labels[name].replace(" ", "\N{NO-BREAK SPACE}")
            label = f"{'relative' if survey.relative[name] else 'absolute'} error of {named}"
            axes.set_ylabel(label if label.endswith("$") else wrapped(label, room, style.font_size, most=2))
        for k, axes in enumerate(panels):
            if k >= count:
                axes.set_visible(False)
            elif k + columns >= count:
                axes.set_xlabel("step $n$")
                axes.tick_params(labelbottom=True)
        title = rf"time step $2\varepsilon = {label_number(time_step(survey.eps))}$"
        handles = [Line2D([], [], linewidth=0.9, **_look(method)) for method in survey.ends]
        legend_above(figure, handles, labels, style, title)
    return figure


def clipped_from(survey: DriftSurvey, name: str) -> float:
    """The error of a function beyond which a picture shows no more: an arrow at the top stands for what is larger.

    A thousand, or ten times the largest error of methods that got through: what blows up would flatten all others.
    """
    whole = [curve.errors for curve in survey.curves if curve.function == name and survey.ends[curve.method].is_whole]
    return max([_LOST, *(10 * float(errors.max()) for errors in whole if len(errors))])


def _look(method: str) -> dict[str, Any]:
    k = list(METHODS).index(method)
    return {"color": COLOURS[k], "linestyle": LINES[k]}
