"""Pictures of the growth of complexity under iteration: degrees of iterates, and heights of exact orbits.

The data are results of the library, or they are read from the output of `degrees --json` and `heights --json`.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from kahanmaps.algebra.parsing import parse_number
from kahanmaps.errors import InputError, printable
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.growth.degree_bounds import DynamicalDegreeBounds
from kahanmaps.laboratory.growth.degrees import DegreeGrowth
from kahanmaps.laboratory.growth.height_survey import HeightSurvey
from kahanmaps.laboratory.singular.singularities import Patterns
from kahanmaps.plots.figures import (
    drawing,
    escape_dollars,
    label_number,
    legend_above,
    legend_height,
    log_scale_with_zero,
    new_figure,
    shortened_name,
)
from kahanmaps.plots.style import COLORS, LINES, MARKS, Style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SCALES = ("linear", "log", "loglog")
_MAX_SYSTEMS = len(COLORS)
_MAX_FORMULA = 24  # maximal number of letters of the formula for d_n in a legend
_MAX_MARKS = 30  # maximal number of marks for one orbit
_ASPECT = 0.62  # height over width of the axes


def plot_degrees(
    growths: Mapping[str, DegreeGrowth], style: Style | None = None, *, scale: str | None = None
) -> Figure:
    """Plot the degrees d_n of the iterates against n; `growths` maps the names of systems to their degree growth.

    Marks are the measured degrees. A solid line shows degrees that satisfy a checked recurrence. A dotted line joins
    degrees without a recurrence, whose growth is then an estimate. `scale` is "linear", "log" (exponential growth is a
    straight line) or "loglog" (a power is a straight line; n begins with 1). By default it is "log" if some growth is,
    or looks, exponential, and otherwise "linear". On a logarithmic scale a degree 0 lies in a band marked 0. Raises
    InputError unless there are 1 to 7 systems, and for an unknown scale.

    >>> from kahanmaps.laboratory.growth.degrees import degree_growth
    >>> from kahanmaps.documents.catalog import load
    >>> figure = plot_degrees({"Euler top": degree_growth(load("euler_top").system)})
    >>> figure.legends[0].get_texts()[0].get_text()
    'Euler top: $d_n = 2n^{2} + 1$, $\\\\lambda = 1$'
    """
    if not 1 <= len(growths) <= _MAX_SYSTEMS:
        raise InputError(f"found {len(growths)} systems, expected 1 to {_MAX_SYSTEMS} in one picture")
    style = style or Style()
    is_log = any(growth.looks_exponential or growth.growth is Growth.EXPONENTIAL for growth in growths.values())
    scale = _checked_scale(scale, "log" if is_log else "linear")
    suffixes = [_degree_label(growth) for growth in growths.values()]
    names = [shortened_name(name, suffix, style) for name, suffix in zip(growths, suffixes, strict=True)]
    labels = [escape_dollars(name) + suffix for name, suffix in zip(names, suffixes, strict=True)]
    values = [d for growth in growths.values() for d in growth.degrees]
    positive = [d for d in values if d]
    with drawing(style):
        figure = new_figure(style, _ASPECT + legend_height(labels, style, title=True, max_columns=1))
        axes = figure.subplots()
        _format_step_axis(axes, scale, max(len(growth.degrees) for growth in growths.values()))
        zero = 0.0
        if scale == "linear":
            axes.set_ylim(0, 1.05 * max(values))
        else:
            has_zeros = len(positive) < len(values)
            zero = log_scale_with_zero(axes, min(positive), max(positive), has_zeros) or 1.0
        for k, (label, growth) in enumerate(zip(labels, growths.values(), strict=True)):
            mark: dict[str, Any] = {"color": COLORS[k]}
            line: dict[str, Any] = {"linestyle": LINES[0] if growth.recurrence is not None else ":", "linewidth": 0.8}
            steps = np.arange(1 if scale == "loglog" else 0, len(growth.degrees))
            shown_degrees = np.array([float(growth.degrees[n] or zero) for n in steps])
            # On a logarithmic scale a degree 0 lies in the band at the bottom, to which no line leads.
            is_gap = np.array([scale != "linear" and not growth.degrees[n] for n in steps])
            n, d = steps, np.where(is_gap, np.nan, shown_degrees)
            recurrence = growth.recurrence
            if (
                recurrence is not None
                and recurrence.closed_form
                and ";" not in recurrence.closed_form
                and recurrence.preperiod == 0
            ):
                # d_n is one polynomial in n: a smooth curve is drawn, not straight lines between the marks.
                fit_steps = range(recurrence.power + 1)
                fit_degrees = [recurrence.predict(n) for n in fit_steps]
                polynomial = np.polynomial.Polynomial.fit(list(fit_steps), fit_degrees, recurrence.power)
                n = np.linspace(steps[0], steps[-1], 200)
                d = polynomial(n)
            axes.plot(n, d, zorder=2, **line, **mark)
            axes.plot(steps, shown_degrees, marker=MARKS[k], markersize=4, linestyle="none", clip_on=False, **mark)
            # A plot without points is the legend entry: a line with a mark.
            axes.plot([], [], marker=MARKS[k], markersize=4, label=label, **line, **mark)
        axes.set_xlabel("iterate $n$")
        axes.set_ylabel("degree $d_n$")
        title = r"$\lambda$: dynamical degree"
        if any(growth.eps is not None for growth in growths.values()):
            title += r"; the time step is $2\varepsilon$"
        legend_above(figure, *axes.get_legend_handles_labels(), style, title, max_columns=1)
    return figure


def _degree_label(growth: DegreeGrowth) -> str:
    """Return the legend text after the name: d_n, dynamical degree or growth, and whether the growth is estimated."""
    name = ""
    if growth.eps is not None:
        name = rf", $\varepsilon = {label_number(growth.eps)}$"
    dynamical_degree = growth.dynamical_degree
    if growth.growth is Growth.ZERO:
        return f"{name}: constant from $n = {growth.degrees.index(0)}$ on" if 0 in growth.degrees else f"{name}: zero"
    if growth.recurrence is None and growth.proof is None:
        if growth.looks_exponential:
            return rf"{name}: $\lambda \approx {float(growth.estimate or 0):.4g}$ (estimated)"
        n = len(growth.degrees) - 1
        root_text = rf", $d_{{{n}}}^{{1/{n}}} = {float(growth.estimate):.4g}$" if growth.estimate else ""
        return f"{name}: no recurrence found{root_text}"
    phrases = []
    formula = growth.recurrence.closed_form if growth.recurrence is not None else None
    if formula and len(formula) <= _MAX_FORMULA and ";" not in formula:
        phrases.append("$d_n = " + re.sub(r"\^([^ ^]*)", r"^{\1}", formula.replace("*", "")) + "$")
    elif growth.growth is not Growth.EXPONENTIAL:
        phrases.append(f"{growth.growth}")
    if dynamical_degree is not None:
        is_integer = dynamical_degree.minimal_polynomial.degree() == 1
        number = dynamical_degree.digits if is_integer else rf"{float(dynamical_degree.digits):.5f}\ldots"
        phrases.append(rf"$\lambda = {number}$")
    return f"{name}: {', '.join(phrases) or str(growth.growth)}"


def plot_heights(
    survey: HeightSurvey | Sequence[HeightCurve], style: Style | None = None, *, scale: str | None = None
) -> Figure:
    """Plot the heights of exact orbits against the step, with the fitted growth; orbits of one eps have one color.

    Marks are heights in bits. Lines are fits of `kahanmaps.invariants.heights`: c n^2 or c n, with terms of lower
    degree, or an exponential; an orbit with bounded, logarithmic or undecided growth has no line. `scale` is "linear",
    "log" or "loglog" (from step 1 on). By default it is "log" if some growth is exponential; "loglog" if some growth is
    quadratic or linear, and there are at least 8 steps; otherwise "linear". Raises InputError if there is no orbit, for
    more than 7 values of eps, and for an unknown scale.
    """
    curves = height_curves(survey) if isinstance(survey, HeightSurvey) else tuple(survey)
    if not curves:
        raise InputError("found no orbit, expected at least one")
    eps_values = list(dict.fromkeys(curve.eps for curve in curves))
    if len(eps_values) > len(COLORS):
        raise InputError(f"found {len(eps_values)} values of eps, expected at most {len(COLORS)} in one picture")
    kinds = {curve.kind for curve in curves}
    last_step = max(curve.steps[-1] for curve in curves)
    has_power_growth = kinds & {Growth.QUADRATIC, Growth.LINEAR} and last_step >= 8
    scale = _checked_scale(scale, "log" if Growth.EXPONENTIAL in kinds else "loglog" if has_power_growth else "linear")
    style = style or Style()
    with drawing(style):
        figure = new_figure(
            style, _ASPECT + legend_height([label_number(eps) for eps in eps_values], style, max_columns=1)
        )
        axes = figure.subplots()
        _format_step_axis(axes, scale, last_step)
        axes.set_yscale("linear" if scale == "linear" else "log")
        for k, eps in enumerate(eps_values):
            eps_curves, starts_at_one = [curve for curve in curves if curve.eps == eps], scale == "loglog"
            mark_size = 3.2 if len(eps_curves) <= 3 and max(len(curve.steps) for curve in eps_curves) <= 80 else 2
            line: dict[str, Any] = {"color": COLORS[k], "linestyle": LINES[k], "linewidth": 0.7}
            # The marks are hollow, so that the line of the fit remains visible.
            mark: dict[str, Any] = {"marker": MARKS[k], "markerfacecolor": "none", "markeredgewidth": 0.5}
            for curve in eps_curves:
                indices = np.flatnonzero(curve.steps >= (1 if starts_at_one else 0))
                if len(indices) > _MAX_MARKS:
                    # At most _MAX_MARKS marks, evenly spaced along the axis, with the first and the last step.
                    steps = curve.steps[indices].astype(np.float64)
                    spaced = (np.geomspace if starts_at_one else np.linspace)(steps[0], steps[-1], _MAX_MARKS)
                    indices = indices[np.unique(np.abs(steps[:, None] - spaced).argmin(axis=0))]
                points = curve.steps[indices], curve.bits[indices]
                axes.plot(*points, color=COLORS[k], linestyle="none", markersize=mark_size, **mark)
                if (fit := fit_of(curve)) is not None:
                    end_step = curve.steps[-1]
                    n = np.geomspace(1, max(1, end_step), 200) if starts_at_one else np.linspace(0, end_step, 200)
                    axes.plot(n, fit(n), zorder=1.5, **line)
            # The legend text: eps, the time step, and the kinds of growth.
            label = rf"$\varepsilon = {label_number(eps)}$ (time step {label_number(2 * eps)})"
            label = label if eps_curves[0].has_eps else "heights"
            eps_kinds = list(dict.fromkeys(curve.kind for curve in eps_curves))
            constants = [c for c in (curve.constant for curve in eps_curves) if c is not None]
            ratios = [r for r in (curve.ratio for curve in eps_curves) if r is not None]
            if len(eps_kinds) > 1:
                counts = Counter(curve.kind for curve in eps_curves)
                label += ": " + ", ".join(f"{count} {kind}" for kind, count in counts.items())
            elif eps_kinds[0] in (Growth.QUADRATIC, Growth.LINEAR) and constants:
                power = "n^2" if eps_kinds[0] is Growth.QUADRATIC else "n"
                label += rf": $h_n \sim c\,{power}$, $c$ = {_range_of(constants)}"
            else:
                is_known = eps_kinds[0] is Growth.EXPONENTIAL and ratios
                label += f": exponential, factor {_range_of(ratios)}" if is_known else f": {eps_kinds[0]}"
            axes.plot([], [], label=label, markersize=3.2, **line, **mark)
        if scale == "linear":
            axes.set_ylim(bottom=0)
        axes.set_xlabel("step $n$")
        axes.set_ylabel("height $h_n$ (bits)")
        legend_above(figure, *axes.get_legend_handles_labels(), style, max_columns=1)
    return figure


def _range_of(values: Sequence[float]) -> str:
    low, high = f"{min(values):.3g}", f"{max(values):.3g}"
    return low if low == high else f"{low} to {high}"


def _checked_scale(requested: str | None, default: str) -> str:
    if requested is not None and requested not in SCALES:
        raise InputError(f"found the scale {requested[:40]!r}, expected {', '.join(SCALES[:-1])} or {SCALES[-1]}")
    return requested or default


def _format_step_axis(axes: Axes, scale: str, last_step: int) -> None:
    """Format the horizontal axis of steps: its ticks are integers; on a logarithmic scale it begins with 1."""
    from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, StrMethodFormatter

    if last_step <= 1:
        axes.set_xlim(-0.5, 1.5)
    if scale != "loglog":
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
        return
    axes.set_xscale("log")
    axes.set_xlim(0.9, 1.1 * max(last_step, 2))
    if last_step <= 2000:
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if last_step <= 200 else (1,)))
        axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())


_MAX_ORBITS, _MAX_TERMS = 2000, 10_000
_MAX_INTEGER = 10**15  # upper bound for degrees, steps and bits in a record
_READ_ERRORS = (LookupError, TypeError, ValueError, ArithmeticError, AttributeError)


def degrees_of_record(record: Any, where: str = "record") -> tuple[str, DegreeGrowth]:
    """Return a pair: the name of the system, and its degrees, from the JSON object of `kahanmaps degrees --json`.

    The recurrence is computed again. Records of older versions contain no singularity patterns. Raises InputError for
    any other object.

    >>> record = {"command": "degrees", "system": "top", "degrees": [1, 3, 9, 19, 33, 51, 73, 99], "eps": "generic"}
    >>> name, growth = degrees_of_record({**record, "ended": "terms", "message": "8 terms", "seed": 0, "lines": []})
    >>> name, growth.recurrence.closed_form
    ('top', '2*n^2 + 1')
    """
    if not isinstance(record, Mapping) or record.get("command") != "degrees":
        raise InputError(f"{where}: found something else, expected an object written by 'kahanmaps degrees --json'")
    try:
        degrees = tuple(map(_integer, record["degrees"]))
        if not (1 <= len(degrees) <= _MAX_TERMS and any(degrees)):
            raise InputError("no degrees, or all of them 0")
        patterns = bounds = None
        if (data := record.get("singularities")) is not None:
            fraction = data.get("generating_function") or {}
            series = tuple(tuple(map(int, fraction[part])) for part in ("numerator", "denominator") if fraction)
            if series and not (max(map(len, series)) <= _MAX_TERMS and series[1][:1] == (1,)):
                raise InputError("no generating function with a short denominator that begins with 1")
            lengths = tuple(int(length) for length in data["lengths"])
            searched = None if data["searched"] is None else int(data["searched"])
            patterns = Patterns(lengths, searched, data["some_confined"], str(data["running"]), series)
        if (data := record.get("enclosure")) is not None:
            names = ("steps", "degree_below", "degree_above", "prime", "eps_residue")
            bounds = DynamicalDegreeBounds(str(data["lower"]), str(data["upper"]), *(int(data[name]) for name in names))
        growth = DegreeGrowth(
            degrees,
            None if record["eps"] == "generic" else parse_number(record["eps"]),
            str(record["ended"]),
            str(record["message"]),
            int(record["seed"]),
            tuple(int(line["prime"]) for line in record["lines"]),
            tuple(int(line["eps_residue"]) for line in record["lines"]),
            patterns=patterns,
            dynamical_degree_bounds=bounds,
        )
        return printable(str(record["system"])), growth
    except _READ_ERRORS as error:
        raise InputError(
            f"{where}: found degrees that cannot be read ({error}), expected the output of 'degrees --json'"
        ) from error


@dataclass(frozen=True, eq=False)
class HeightCurve:
    """The heights of one orbit, the kind of their growth, and the fitted numbers.

    `bits` are the heights, in bits, at `steps`; `eps` is half the time step (exact). `constant` is c in the fit c n^2
    or c n, `ratio` the factor of one step in an exponential fit. `status` says how the orbit ended, as in OrbitEnd.
    """

    eps: fmpq
    steps: NDArray[np.int64]
    bits: NDArray[np.float64]
    kind: Growth
    constant: float | None
    ratio: float | None
    status: str
    has_eps: bool = True


def height_curves(survey: HeightSurvey) -> tuple[HeightCurve, ...]:
    """Return the orbits of a survey as curves that contain the heights at all steps.

    >>> from kahanmaps.laboratory.growth.height_survey import height_survey
    >>> from kahanmaps.documents.catalog import load
    >>> [curve] = height_curves(height_survey(load("weierstrass").system, "1/10", starts=[[1, "1/2"]], steps=40))
    >>> curve.bits[:6].tolist(), str(curve.kind), round(curve.constant, 4)
    ([2.0, 7.0, 17.0, 32.0, 52.0, 82.0], 'quadratic', 3.0413)
    """
    curves = []
    for orbit in survey.orbits:
        growth = orbit.growth
        steps, bits = np.array(growth.steps, dtype=np.int64), np.array(growth.heights, dtype=np.float64)
        constant = None if growth.constant is None else float(growth.constant)
        ratio = None
        if growth.ratio is not None and growth.kind is Growth.EXPONENTIAL:
            ratio = float(growth.ratio) ** (1 / growth.every)
        curves.append(
            HeightCurve(orbit.eps, steps, bits, growth.kind, constant, ratio, growth.end.status, survey.has_eps)
        )
    return tuple(curves)


def curves_of_record(record: Any, where: str = "record") -> tuple[HeightCurve, ...]:
    """Return the orbits in the JSON object of `kahanmaps heights --json`, with heights at steps 0, 1, 2, 4, 8, ...

    Raises InputError for any other object.
    """
    orbits = record.get("orbits") if isinstance(record, Mapping) and record.get("command") == "heights" else None
    if not isinstance(orbits, list) or not 1 <= len(orbits) <= _MAX_ORBITS:
        raise InputError(f"{where}: found something else, expected an object written by 'kahanmaps heights --json'")
    curves = []
    try:
        for orbit in orbits:
            steps = [_integer(height["step"]) for height in orbit["heights"]]
            bits = [_integer(height["bits"]) for height in orbit["heights"]]
            if not steps or any(later <= earlier for earlier, later in pairwise(steps)):
                raise InputError("expected increasing steps")
            kind, every = Growth(orbit["kind"]), max(1, _integer(orbit["every"]))
            constant = None if orbit["constant"] is None else float(orbit["constant"])
            ratio = None
            if orbit["ratio"] is not None and kind is Growth.EXPONENTIAL:
                ratio = float(orbit["ratio"]) ** (1 / every)
            numbers = np.array(steps, dtype=np.int64), np.array(bits, dtype=np.float64)
            curves.append(
                HeightCurve(parse_number(orbit["eps"]), *numbers, kind, constant, ratio, str(orbit["status"]))
            )
    except _READ_ERRORS as error:
        raise InputError(
            f"{where}: found an orbit that cannot be read ({error}), expected the output of 'heights --json'"
        ) from error
    return tuple(curves)


def _integer(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= _MAX_INTEGER:
        raise InputError(f"found {str(value)[:40]!r}, expected a degree or a number of steps or bits")
    return value


def fit_of(curve: HeightCurve) -> Callable[[Any], Any] | None:
    """Return the fitted height as a function of the step, NaN where it is not positive; None if nothing was fitted.

    In the fits c n^2 and c n, c is `curve.constant`, and the terms of lower degree are fitted to the heights by least
    squares. An exponential fit goes through the last height.
    """
    n, c = curve.steps.astype(np.float64), curve.constant
    if curve.kind is Growth.EXPONENTIAL and curve.ratio is not None:
        ratio = curve.ratio

        def exponential(step: Any) -> Any:
            with np.errstate(all="ignore"):
                return curve.bits[-1] * ratio ** (np.asarray(step, dtype=np.float64) - n[-1])

        return exponential
    if c is None or curve.kind not in (Growth.QUADRATIC, Growth.LINEAR) or len(n) < 3:
        return None
    power = 2 if curve.kind is Growth.QUADRATIC else 1
    lower_terms = np.polynomial.Polynomial.fit(n, curve.bits - c * n**power, power - 1)

    def power_law(step: Any) -> Any:
        step = np.asarray(step, dtype=np.float64)
        value = c * step**power + lower_terms(step)
        return np.where(value > 0, value, np.nan)

    return power_law
