"""Pictures of a comparison of methods: drift against time, error against step size, work against precision."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from kahanmaps.errors import InputError
from kahanmaps.maps.convention import time_step
from kahanmaps.maps.floats.classical import METHODS
from kahanmaps.maps.floats.float_conversion import to_float
from kahanmaps.plots.comparison.compare import Comparison
from kahanmaps.plots.figures import (
    LETTER_WIDTH,
    drawing,
    label_number,
    legend_above,
    legend_height,
    letter_count,
    log_scale_with_zero,
    new_figure,
    wrap_text,
    write_beside,
)
from kahanmaps.plots.style import COLORS, LINES, MARKS, Style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

KINDS = ("drift", "error", "work")
SCALES = ("loglog", "semilog")
_MIN_PANEL_WIDTH = 5.5  # minimal width in centimetres of panels that are side by side
_MIN_CLIPPED_ERROR = 1e3  # no arrow at the top replaces an error below this bound
_MAX_PANELS = 6  # maximal number of panels of one picture; each panel shows the drift of one function
_DEFAULT_LIMITS = (1e-17, 1e-15)  # limits of the error axis if all errors are exactly 0


def plot_comparison(
    result: Comparison, style: Style | None = None, *, show: str = "drift", scale: str = "loglog"
) -> Figure:
    """Plot the "drift", "error" or "work" of a comparison; raise InputError if it was not measured.

    "drift" is the picture of `plot_drift`. "error" plots the error of the solution at a fixed time against the time
    step; each dotted line has an order as its slope. "work" plots this error against the number of evaluations of f.
    """
    style = style or Style()
    if show == "drift":
        return plot_drift(result, style, scale=scale)
    if show not in KINDS:
        raise InputError(f"found the picture {show[:40]!r}, expected {', '.join(KINDS)}")
    runs = [run for run in result.runs if any(sample.error > 0 for sample in run.errors)]
    if result.time is None or not runs:
        raise InputError("found no error above 0, expected one: there is no reference solution, or all errors are 0")
    labels = [METHODS[run.method].title for run in runs]
    with drawing(style):
        from matplotlib.lines import Line2D

        figure = new_figure(style, 0.72 + legend_height(labels, style, title=True, max_columns=2))
        axes = figure.subplots()
        axes.set_xscale("log")
        axes.set_yscale("log")
        handles = []
        line_starts: dict[int, tuple[float, float]] = {}  # order -> time step and error at which its dotted line starts
        for k, run in enumerate(runs):
            samples = [sample for sample in run.errors if sample.error > 0]
            x = [abs(to_float(2 * sample.eps)) if show == "error" else sample.evaluations for sample in samples]
            line_style = {**_line_style(k), "marker": MARKS[k % len(MARKS)], "markersize": 3.5, "linewidth": 0.9}
            axes.plot(x, [sample.error for sample in samples], **line_style)
            handles.append(Line2D([], [], **line_style))
            order = METHODS[run.method].order
            if order not in line_starts or samples[0].error < line_starts[order][1]:
                line_starts[order] = x[0], samples[0].error
        if show == "error":
            # Draw a dotted line for each order, a little below its best method, and a line at the time step.
            low, high = axes.get_ylim()
            for order, (step, error) in sorted(line_starts.items()):
                y = error / 3
                end = max(axes.get_xlim()[0], step * (low / y) ** (1 / order))
                axes.plot(
                    [step, end], [y, y * (end / step) ** order], color="0.6", linestyle=":", linewidth=0.8, zorder=1
                )
                # The label of a line is at its end with small steps, where lines of different orders are far apart.
                write_beside(axes, str(order), (end, y * (end / step) ** order), (13, 0), color="0.4", fontsize="small")
            axes.set_ylim(low, high)
            axes.axvline(abs(to_float(time_step(result.eps))), color="0.85", linewidth=0.8, zorder=0)
            axes.set_xlabel("time step $h$")
        else:
            axes.set_xlabel("evaluations of $f$ for one initial point")
        axes.set_ylabel(f"error at time {label_number(result.time)}")
        legend_above(figure, handles, labels, style, None, max_columns=2)
    return figure


def plot_drift(result: Comparison, style: Style | None = None, *, scale: str = "loglog") -> Figure:
    """Plot the drift of functions against the step: a panel for each function, and in it a line for each method.

    `scale` is "loglog", or "semilog" with a linear axis of steps. Errors of exactly 0 lie in a band at the bottom that
    is labelled 0. An arrow at the top stands for errors above `clipped_from`. If an orbit ended early, its line ends in
    a cross, and the legend gives the step. Raises InputError for an unknown scale.
    """
    if scale not in SCALES:
        raise InputError(f"found the scale {scale[:40]!r}, expected {' or '.join(SCALES)}")
    style = style or Style()
    names = list(result.labels)[:_MAX_PANELS]
    count = len(names)
    if not count:
        raise InputError(f"found no known integral of {result.file.name}, expected one: give --integral NAME=EXPR")
    columns = 1 if count <= 3 else 3 if count > 4 and style.width >= 3 * _MIN_PANEL_WIDTH else 2
    if count <= 3 and style.width >= _MIN_PANEL_WIDTH * count:
        columns = count
    rows = -(-count // columns)
    with drawing(style):
        from matplotlib.lines import Line2D

        methods = [run.method for run in result.runs]
        ended = {run.method: max(end.steps for end in run.early) for run in result.runs if run.early}
        labels = [
            METHODS[method].title + (f" (ended at step {ended[method]})" if method in ended else "")
            for method in methods
        ]
        panel_aspect = 0.62 if count == 1 else 0.85 / columns if columns > 1 else 0.5 if rows == 2 else 0.45
        aspect = panel_aspect * rows + legend_height(labels, style, title=True, max_columns=3)
        figure = new_figure(style, aspect)
        height = 0.75 / rows * 72 * style.inches(aspect)[1]  # height of a panel in points
        panels = figure.subplots(rows, columns, sharex=True, squeeze=False).ravel()
        for axes, name in zip(panels, names, strict=False):
            curves = [curve for curve in result.curves if curve.function == name]
            errors = np.concatenate([curve.errors for curve in curves]) if curves else np.array([])
            limit = clipped_from(result, name)
            positive = np.minimum(errors[errors > 0], limit)
            least, largest = (positive.min(), positive.max()) if len(positive) else _DEFAULT_LIMITS
            zero = log_scale_with_zero(axes, float(least), float(largest), len(positive) < len(errors))
            if scale == "loglog":
                axes.set_xscale("log")
                axes.set_xlim(1 if result.steps > 9 else 0.9, max(result.steps, 2))
            else:
                axes.set_xlim(0, result.steps)
            for curve in curves:
                line_style = _line_style(methods.index(curve.method))
                heights = np.where(curve.errors > 0, curve.errors, np.nan if zero is None else zero)
                axes.plot(curve.steps, heights, linewidth=0.9, marker="o" if len(heights) == 1 else None, **line_style)
                mark_style = {"color": line_style["color"], "markersize": 5, "clip_on": False}
                clipped_indices = np.flatnonzero(heights > limit)
                if len(clipped_indices):
                    axes.plot(curve.steps[clipped_indices[:1]], [limit], marker="^", **mark_style)
                elif len(heights) and curve.method in ended:
                    axes.plot(curve.steps[-1:], heights[-1:], marker="x", **mark_style)
            # A line break only before the name, which may be a formula that contains spaces.
            function, kind = result.labels[name], "relative" if result.relative[name] else "absolute"
            if "$" in function:
                is_long = letter_count(f"{kind} error of {function}") * LETTER_WIDTH * style.font_size > height
                label = f"{kind} error of{chr(10) if is_long else ' '}{function}"
            else:
                label = f"{kind} error of " + function.replace(" ", "\N{NO-BREAK SPACE}")
                label = wrap_text(label, height, style.font_size, max_lines=2)
            axes.set_ylabel(label)
        for k, axes in enumerate(panels):
            if k >= count:
                axes.set_visible(False)
            elif k + columns >= count:
                axes.set_xlabel("step $n$")
                axes.tick_params(labelbottom=True)
        title = rf"time step $2\varepsilon = {label_number(time_step(result.eps))}$"
        handles = [Line2D([], [], linewidth=0.9, **_line_style(k)) for k in range(len(methods))]
        legend_above(figure, handles, labels, style, title, max_columns=3)
    return figure


def clipped_from(result: Comparison, name: str) -> float:
    """Return the error of the function `name` above which `plot_drift` draws an arrow at the top.

    The bound is 1000, or ten times the largest error along completed orbits if this is larger. Without it an orbit that
    diverges would flatten all other curves.
    """
    methods = {run.method for run in result.runs if not run.early}
    curves = [curve for curve in result.curves if curve.function == name and curve.method in methods]
    return max([_MIN_CLIPPED_ERROR, *(10 * curve.largest for curve in curves if len(curve.errors))])


def _line_style(k: int) -> dict[str, Any]:
    """Return color and line style of the k-th method; colors repeat after seven methods, with other line styles."""
    return {"color": COLORS[k % len(COLORS)], "linestyle": LINES[(k + k // len(COLORS)) % len(LINES)]}
