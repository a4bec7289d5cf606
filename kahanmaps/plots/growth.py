"""How complexity grows, as pictures: degrees of iterates, and heights of exact orbits."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from kahanmaps.errors import InputError
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.growth.degrees import DegreeGrowth
from kahanmaps.laboratory.growth.height_survey import HeightSurvey
from kahanmaps.plots.figures import (
    drawing,
    label_number,
    legend_above,
    legend_height,
    log_scale_with_zero,
    new_figure,
    plain,
    shortened_name,
)
from kahanmaps.plots.growth_records import HeightCurve, fit_of, height_curves
from kahanmaps.plots.style import COLOURS, LINES, MARKS, Style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SCALES = ("linear", "log", "loglog")
_MAX_SYSTEMS = len(COLOURS)
_MAX_FORMULA = 24  # letters
_MARKS = 30  # of one orbit
_ASPECT = 0.62  # of the axes


def draw_degrees(
    growths: Mapping[str, DegreeGrowth], style: Style | None = None, *, scale: str | None = None
) -> Figure:
    """Degrees d_n of the iterates against n, for one or more systems by their names.

    Marks are the measured degrees. A solid line is the recurrence that they satisfy; dots join degrees for which none
    could be checked, and what the legend says of their growth is estimated. `scale` is "linear", "log" (exponential
    growth is a straight line) or "loglog" (a power is a straight line, from n = 1 on); by default "log" where some
    growth is exponential or looks so, else "linear". On a logarithmic scale a degree 0 lies in a band marked 0.
    Raises InputError for no system or more than 7, and for a scale of another name.

    >>> from kahanmaps.laboratory.growth.degrees import degree_growth
    >>> from kahanmaps.documents.catalog import load
    >>> figure = draw_degrees({"Euler top": degree_growth(load("euler_top").system)})
    >>> figure.legends[0].get_texts()[0].get_text()
    'Euler top: $d_n = 2n^{2} + 1$, $\\\\lambda = 1$'
    """
    if not 1 <= len(growths) <= _MAX_SYSTEMS:
        raise InputError(f"found {len(growths)} systems, expected 1 to {_MAX_SYSTEMS} in one picture")
    style = style or Style()
    is_log = any(one.looks_exponential or one.growth is Growth.EXPONENTIAL for one in growths.values())
    scale = _scale(scale, "log" if is_log else "linear")
    rests = [_degree_label(growth) for growth in growths.values()]
    labels = [plain(shortened_name(name, rest, style)) + rest for name, rest in zip(growths, rests, strict=True)]
    values = [d for growth in growths.values() for d in growth.degrees]
    positive = [d for d in values if d]
    with drawing(style):
        figure = new_figure(style, _ASPECT + legend_height(labels, style, title=True, most=1))
        axes = figure.subplots()
        _step_axis(axes, scale, max(len(growth.degrees) for growth in growths.values()))
        zero = 0.0
        if scale == "linear":
            axes.set_ylim(0, 1.05 * max(values))
        else:
            has_zeros = len(positive) < len(values)
            zero = log_scale_with_zero(axes, min(positive), max(positive), has_zeros) or 1.0
        for k, (label, growth) in enumerate(zip(labels, growths.values(), strict=True)):
            look: dict[str, Any] = {"color": COLOURS[k]}
            line: dict[str, Any] = {"linestyle": LINES[0] if growth.recurrence is not None else ":", "linewidth": 0.8}
            steps = np.arange(1 if scale == "loglog" else 0, len(growth.degrees))
            heights = np.array([float(growth.degrees[n] or zero) for n in steps])
            # On a logarithmic scale no line leads to a degree 0, which lies in its band.
            is_gap = np.array([scale != "linear" and not growth.degrees[n] for n in steps])
            n, d = steps, np.where(is_gap, np.nan, heights)
            found = growth.recurrence
            if found is not None and found.closed_form and ";" not in found.closed_form and found.preperiod == 0:
                # One polynomial: a smooth curve, else straight lines from point to point.
                few = range(found.power + 1)
                law = np.polynomial.Polynomial.fit(list(few), [found.predict(n) for n in few], found.power)
                n = np.linspace(steps[0], steps[-1], 200)
                d = law(n)
            axes.plot(n, d, zorder=2, **line, **look)
            axes.plot(steps, heights, marker=MARKS[k], markersize=4, linestyle="none", clip_on=False, **look)
            # The legend shows both: a line with a mark.
            axes.plot([], [], marker=MARKS[k], markersize=4, label=label, **line, **look)
        axes.set_xlabel("iterate $n$")
        axes.set_ylabel("degree $d_n$")
        title = r"$\lambda$: dynamical degree"
        if any(growth.eps is not None for growth in growths.values()):
            title += r"; the time step is $2\varepsilon$"
        legend_above(figure, *axes.get_legend_handles_labels(), style, title, most=1)
    return figure


def _degree_label(growth: DegreeGrowth) -> str:
    """A line of the legend behind the name: what d_n is, the dynamical degree and what is estimated."""
    name = ""
    if growth.eps is not None:
        name = rf", $\varepsilon = {label_number(growth.eps)}$"
    rate = growth.dynamical_degree
    if growth.growth is Growth.ZERO:
        return f"{name}: constant from $n = {growth.degrees.index(0)}$ on" if 0 in growth.degrees else f"{name}: zero"
    if growth.recurrence is None and growth.proof is None:
        if growth.looks_exponential:
            return rf"{name}: $\lambda \approx {float(growth.estimate or 0):.4g}$ (estimated)"
        n = len(growth.degrees) - 1
        quotient = rf", $d_{{{n}}}^{{1/{n}}} = {float(growth.estimate):.4g}$" if growth.estimate else ""
        return f"{name}: no recurrence found{quotient}"
    parts = []
    formula = growth.recurrence.closed_form if growth.recurrence is not None else None
    if formula and len(formula) <= _MAX_FORMULA and ";" not in formula:
        parts.append("$d_n = " + re.sub(r"\^([^ ^]*)", r"^{\1}", formula.replace("*", "")) + "$")
    elif growth.growth is not Growth.EXPONENTIAL:
        parts.append(f"{growth.growth}")
    if rate is not None:
        whole = rate.minimal_polynomial.degree() == 1
        number = rate.digits if whole else rf"{float(rate.digits):.5f}\ldots"
        parts.append(rf"$\lambda = {number}$")
    return f"{name}: {', '.join(parts) or str(growth.growth)}"


def draw_heights(
    survey: HeightSurvey | Sequence[HeightCurve], style: Style | None = None, *, scale: str | None = None
) -> Figure:
    """Heights of exact orbits against the step, with the growth that was fitted, a colour for each eps.

    Marks are heights in bits; lines are the fits of `kahanmaps.invariants.heights`: c n^2, c n (each with its lower
    terms) or a factor in each step; orbits whose growth is bounded, logarithmic or undecided have none. `scale` is
    "linear", "log" or "loglog" (from step 1 on); by default "log" where some growth is exponential, "loglog" where it
    is quadratic or linear and there are 8 steps or more, else "linear". Raises InputError where there is no orbit, for
    more than 7 values of eps, and for a scale of another name.
    """
    curves = height_curves(survey) if isinstance(survey, HeightSurvey) else tuple(survey)
    if not curves:
        raise InputError("found no orbit, expected at least one")
    every_eps = list(dict.fromkeys(curve.eps for curve in curves))
    if len(every_eps) > len(COLOURS):
        raise InputError(f"found {len(every_eps)} values of eps, expected at most {len(COLOURS)} in one picture")
    kinds = {curve.kind for curve in curves}
    longest = max(curve.steps[-1] for curve in curves)
    grows = kinds & {Growth.QUADRATIC, Growth.LINEAR} and longest >= 8
    scale = _scale(scale, "log" if Growth.EXPONENTIAL in kinds else "loglog" if grows else "linear")
    style = style or Style()
    with drawing(style):
        figure = new_figure(style, _ASPECT + legend_height([label_number(eps) for eps in every_eps], style, most=1))
        axes = figure.subplots()
        _step_axis(axes, scale, longest)
        axes.set_yscale("linear" if scale == "linear" else "log")
        for k, eps in enumerate(every_eps):
            some, from_one = [curve for curve in curves if curve.eps == eps], scale == "loglog"
            size = 3.2 if len(some) <= 3 and max(len(curve.steps) for curve in some) <= 80 else 2
            line: dict[str, Any] = {"color": COLOURS[k], "linestyle": LINES[k], "linewidth": 0.7}
            # Hollow marks, through which the line of the fit is seen.
            mark: dict[str, Any] = {"marker": MARKS[k], "markerfacecolor": "none", "markeredgewidth": 0.5}
            for curve in some:
                rows = np.flatnonzero(curve.steps >= (1 if from_one else 0))
                if len(rows) > _MARKS:  # as many marks as stand apart along the axis, the first and the last among them
                    steps = curve.steps[rows].astype(np.float64)
                    spaced = (np.geomspace if from_one else np.linspace)(steps[0], steps[-1], _MARKS)
                    rows = rows[np.unique(np.abs(steps[:, None] - spaced).argmin(axis=0))]
                points = curve.steps[rows], curve.bits[rows]
                axes.plot(*points, color=COLOURS[k], linestyle="none", markersize=size, **mark)
                if (fit := fit_of(curve)) is not None:
                    last = curve.steps[-1]
                    n = np.geomspace(1, max(1, last), 200) if from_one else np.linspace(0, last, 200)
                    axes.plot(n, fit(n), zorder=1.5, **line)
            # The legend: eps, the time step, and what kinds of growth were found.
            label = rf"$\varepsilon = {label_number(eps)}$, $2\varepsilon = {label_number(2 * eps)}$"
            label = label if some[0].has_eps else "heights"
            several = list(dict.fromkeys(curve.kind for curve in some))
            constants = [c for c in (curve.constant for curve in some) if c is not None]
            ratios = [r for r in (curve.ratio for curve in some) if r is not None]
            if len(several) > 1:
                label += ": " + ", ".join(f"{sum(curve.kind is kind for curve in some)} {kind}" for kind in several)
            elif several[0] in (Growth.QUADRATIC, Growth.LINEAR) and constants:
                power = "n^2" if several[0] is Growth.QUADRATIC else "n"
                label += rf": $c\,{power}$, $c$ = {_range_of(constants)}"
            else:
                is_known = several[0] is Growth.EXPONENTIAL and ratios
                label += f": exponential, factor {_range_of(ratios)}" if is_known else f": {several[0]}"
            axes.plot([], [], label=label, markersize=3.2, **line, **mark)
        if scale == "linear":
            axes.set_ylim(bottom=0)
        axes.set_xlabel("step $n$")
        axes.set_ylabel("height $h_n$ (bits)")
        legend_above(figure, *axes.get_legend_handles_labels(), style, most=1)
    return figure


def _range_of(values: Sequence[float]) -> str:
    low, high = f"{min(values):.3g}", f"{max(values):.3g}"
    return low if low == high else f"{low} to {high}"


def _scale(asked: str | None, default: str) -> str:
    if asked is not None and asked not in SCALES:
        raise InputError(f"found the scale {asked[:40]!r}, expected {', '.join(SCALES[:-1])} or {SCALES[-1]}")
    return asked or default


def _step_axis(axes: Axes, scale: str, longest: int) -> None:
    """The horizontal axis: whole numbers, or their logarithms from 1 on."""
    from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, StrMethodFormatter

    if longest <= 1:
        axes.set_xlim(-0.5, 1.5)
    if scale != "loglog":
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
        return
    axes.set_xscale("log")
    axes.set_xlim(0.9, 1.1 * max(longest, 2))
    if longest <= 2000:
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if longest <= 200 else (1,)))
        axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
