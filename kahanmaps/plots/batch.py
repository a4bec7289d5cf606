"""Results of a batch as pictures: what became of the tasks, how numbers are distributed, one number against another."""

from __future__ import annotations

import re
from collections.abc import Sequence
from fractions import Fraction
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from kahanmaps.errors import InputError
from kahanmaps.experiments.results.columns import Column, Pairs
from kahanmaps.experiments.results.export import plain as plain_text
from kahanmaps.experiments.results.records import Outcome
from kahanmaps.experiments.results.summary import VERDICTS, Group, Summary, nearest
from kahanmaps.plots.figures import beside, drawing, label_of, legend_above, new_figure, plain, points
from kahanmaps.plots.style import CENTIMETRES_PER_INCH, COLOURS, MARKS, Style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SCALES = ("linear", "log")
MAX_GROUPS = 40
MAX_VALUES = 4
_PANEL = 5.5  # centimetres that a panel needs beside another
_FEW = 5  # numbers, of which the quantiles of a summary are all there are
_WIDE = 1000  # a range of so many times the least is drawn logarithmically
_LONGEST = 28
_SHORT = 12  # characters of a number in a legend
# Kinds of ends in the order of the bars: colour and hatching, so that they differ in grey.
_LOOKS = {
    "proved": ("#0072B2", ""),
    "supported": ("#56B4E9", ""),
    "refuted": ("#D55E00", "xxx"),
    "undecided": ("#CCCCCC", "..."),
    "ok": ("#009E73", ""),
    "failed": ("#E69F00", "///"),
    "timeout": ("#F0E442", "\\\\\\"),
    "out-of-memory": ("#CC79A7", "+++"),
    "crashed": ("#000000", ""),
    "missing": ("#FFFFFF", ""),
    "true": ("#0072B2", ""),
    "false": ("#D55E00", "///"),
}
# ... and of values, or of what else there is.
_VALUES = (("#0072B2", ""), ("#E69F00", "///"), ("#56B4E9", ""), ("#009E73", "..."), ("#999999", "---"))


def draw_batch(
    summary: Summary, values: Sequence[str] = (), style: Style | None = None, *, scale: str | None = None
) -> Figure:
    """The groups of a summary: counts of what became of their tasks, or the distribution of the numbers `values`.

    A box holds the middle half of the numbers, a line in it the median, whiskers the middle nine tenths, dots the least
    and the largest; 5 numbers or fewer are dots, all of them. These are the quantiles of the summary, so numbers that
    occur. Entries that are true or false become counts, and so do numbers that have few values, unless a `scale` is
    given: "linear" or "log"; by default logarithmic where all numbers are positive and range over more than three
    orders of magnitude. Raises InputError for no group or more than 40, for more than 4 values, and for names that no
    group has.

    >>> from kahanmaps.experiments.results.summary import summarise
    >>> from kahanmaps.experiments.results.records import Outcome, Record, Row, Task
    >>> tasks = [Task("orbit", {"family": {"m": 1 + k % 2}}, {"seed": k}) for k in range(20)]
    >>> rows = [Row("e", k, t, Record(t.key, Outcome.OK, {"c": k})) for k, t in enumerate(tasks)]
    >>> axes = draw_batch(summarise(rows, ["m"]), ["c"]).axes[0]
    >>> [label.get_text() for label in axes.get_yticklabels()]
    ['1', '2']
    """
    if scale is not None and scale not in SCALES:
        raise InputError(f"found the scale {scale[:40]!r}, expected {' or '.join(SCALES)}")
    groups = summary.groups
    if not 1 <= len(groups) <= MAX_GROUPS:
        remedy = "; group by fewer names, or draw one number against another with --x" if groups else ""
        raise InputError(f"found {len(groups)} groups, expected 1 to {MAX_GROUPS} in one picture{remedy}")
    if len(values) > MAX_VALUES:
        raise InputError(f"found {len(values)} values, expected at most {MAX_VALUES} in one picture")
    for name in values:
        if not any(name in group.numbers or name in group.flags for group in groups):
            raise InputError(f"found no number {name} in any group, expected one: batch summary lists them")
    style = style or Style()
    panels = max(1, len(values))
    columns = panels if style.width >= _PANEL * panels else 1
    rows = panels // columns
    with drawing(style):
        figure = new_figure(style, _aspect(style, len(groups), rows))
        every = figure.subplots(rows, columns, sharey=columns > 1, squeeze=False).ravel()
        for axes, name in zip(every, values, strict=False):
            few = _few_values(groups, name) if scale is None else None
            if few is None and any(name in group.numbers for group in groups):
                _draw_numbers(axes, groups, name, scale)
            else:
                counts = few or [
                    dict(zip(("true", "false"), group.flags.get(name, (0, 0)), strict=True)) for group in groups
                ]
                _draw_bars(axes, counts, f"tasks by {plain(name)}", style)
        if not values:
            _draw_bars(every[0], [_ends(group) for group in groups], "tasks", style)
        for k, axes in enumerate(every):
            _name_groups(axes, summary, first=k % columns == 0)
        _legend(figure, list(every), style)
    return figure


def draw_pairs(pairs: Pairs, style: Style | None = None, *, scale: str | None = None) -> Figure:
    """One number against another, a dot for each task; colours and marks are those of `pairs.series`.

    `scale` is "linear" or "log" and about the vertical axis; by default as in `draw_batch`. Words along the horizontal
    axis have a place each, with the median of their numbers as a line. Raises InputError where there is no pair, or
    more than 7 series.
    """
    x, y, series = np.array(pairs.x.values), np.array(pairs.y.values), pairs.series
    if not len(y):
        raise InputError(f"found no task with both {pairs.x.name} and {pairs.y.name}, expected at least one")
    if series is not None and len(series.categories or ()) > len(COLOURS):
        raise InputError(f"found {len(series.categories or ())} values of {series.name}, expected at most 7")
    style = style or Style()
    finite = np.isfinite(x) & np.isfinite(y)
    with drawing(style):
        figure = new_figure(style, 0.75)
        axes = figure.subplots()
        if _is_log(scale, y[finite]):
            axes.set_yscale("log")
        if pairs.x.categories is None and len(x[finite]) and _is_log(None, x[finite]):
            axes.set_xscale("log")
        codes = np.zeros(len(y)) if series is None else np.array(series.values)
        for k, label in enumerate((series.categories or ()) if series is not None else ("",)):
            here = finite & (codes == k)
            how: dict[str, Any] = {"color": COLOURS[k], "alpha": 0.7}
            if series is not None:
                axes.plot([], [], color=COLOURS[k], marker=MARKS[k], linestyle="none", label=_shortened(label))
            marker = MARKS[k] if here.sum() <= 5000 else "o"
            if finite.sum() <= 500:
                how["markersize"] = 3.2  # or one mark looks like another
            points(axes, _spread(x[here], pairs.x, k), y[here], marker=marker, **how)
        if len(places := np.unique(x[finite])) <= _FEW and pairs.x.categories is None:
            axes.set_xticks(places)
        if pairs.x.categories is not None:
            _name_words(axes, pairs.x, x, y, finite)
        axes.set_xlabel(_label(pairs.x.name))
        axes.set_ylabel(_label(pairs.y.name))
        if series is not None:
            _legend(figure, [axes], style, _label(series.name))
    return figure


def clipped(pairs: Pairs) -> int:
    """How many pairs are beyond the range of doubles, and so in no picture."""
    return int((~np.isfinite(np.array(pairs.x.values)) | ~np.isfinite(np.array(pairs.y.values))).sum())


def groups_beyond(summary: Summary, name: str) -> int:
    """How many groups have numbers beyond the range of doubles; there only the quantiles within it are drawn, as dots.

    `name` is the name of a number of the summary.
    """
    found = [group.numbers[name].quantiles for group in summary.groups if name in group.numbers]
    return sum(not all(isfinite(nearest(value)) for value in quantiles.values()) for quantiles in found)


def _aspect(style: Style, groups: int, rows: int) -> float:
    """Room for each group, for the axes and for the legend."""
    points_of_text = rows * (max(groups, 3) * 1.9 + 3.5) + 3.5
    return points_of_text * style.font_size / (style.width / CENTIMETRES_PER_INCH * 72)


def _label(name: str) -> str:
    """Single letters with their indices and Greek ones as formulas, words as words."""
    if not name.isprintable():
        return plain(repr(name))
    formula = label_of(name)
    return formula if re.match(r"\$(\\|[A-Za-z](_|\$))", formula) else plain(name)


def _name_groups(axes: Axes, summary: Summary, first: bool) -> None:
    """The groups from top to bottom."""
    axes.set_ylim(len(summary.groups) - 0.4, -0.6)
    names = [_shortened(", ".join(map(_text, group.values))) for group in summary.groups]
    axes.set_yticks(range(len(names)), names if summary.by else ["all"])
    axes.tick_params(axis="y", length=0, labelleft=first)
    if first and summary.by:
        axes.set_ylabel(", ".join(map(_label, summary.by)))


def _text(value: Any) -> str:
    return "none" if value is None else f"{value:.6g}" if isinstance(value, float) else plain_text(value)


def _shortened(text: str) -> str:
    return plain(text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "...")


def _ends(group: Group) -> dict[str, int]:
    """Counts of verdicts; of outcomes where there is no verdict; of tasks without a result."""
    counts = {verdict: group.verdicts.get(verdict, 0) for verdict in (*VERDICTS, *group.verdicts)}
    counts["ok"] = group.outcomes.get("ok", 0) - sum(counts.values())
    counts |= {str(outcome): group.outcomes.get(outcome, 0) for outcome in Outcome if outcome != Outcome.OK}
    counts["missing"] = group.missing
    return {name: count for name, count in counts.items() if count > 0}


def _few_values(groups: Sequence[Group], name: str) -> list[dict[str, int]] | None:
    """How often a number has each of its values, where these are few and some of them are frequent."""
    found = [group.numbers[name] for group in groups if name in group.numbers]
    values = sorted({value for numbers in found for value in numbers.counts}, key=Fraction)
    if not all(numbers.counts for numbers in found) or not len(values) <= _FEW < max((n.n for n in found), default=0):
        return None
    counts = [group.numbers[name].counts if name in group.numbers else {} for group in groups]
    told = {value: value if len(value) <= _SHORT else f"{nearest(value):.6g}" for value in values}
    return [{f"{name} = {told[value]}": count[value] for value in values if value in count} for count in counts]


def _draw_bars(axes: Axes, counts: Sequence[dict[str, int]], label: str, style: Style) -> None:
    from matplotlib.ticker import MaxNLocator

    kinds = dict.fromkeys(
        [*(kind for kind in _LOOKS if any(c.get(kind) for c in counts)), *(k for c in counts for k in c)]
    )
    others = [kind for kind in kinds if kind not in _LOOKS]
    left = np.zeros(len(counts))
    for kind in kinds:
        widths = np.array([float(c.get(kind, 0)) for c in counts])
        if widths.any():
            colour, hatch = _LOOKS[kind] if kind in _LOOKS else _VALUES[others.index(kind) % len(_VALUES)]
            look: dict[str, Any] = {"color": colour, "hatch": hatch, "edgecolor": "black", "linewidth": 0.4}
            axes.barh(range(len(counts)), widths, 0.62, left, label=kind, **look)
            left += widths
    for k, total in enumerate(left):
        beside(axes, f"{int(total)}", (total, k), (3, 0), va="center", fontsize=style.smallest, clip_on=False)
    axes.set_xlim(0, 1.12 * max(float(left.max()), 1.0))
    axes.xaxis.set_major_locator(MaxNLocator(nbins=6, integer=True))
    axes.set_xlabel(label)


def _draw_numbers(axes: Axes, groups: Sequence[Group], name: str, scale: str | None) -> None:
    found = [(k, group.numbers[name]) for k, group in enumerate(groups) if name in group.numbers]
    every = np.array([nearest(value) for _, numbers in found for value in numbers.quantiles.values()])
    if _is_log(scale, every[np.isfinite(every)]):
        axes.set_xscale("log")
    boxes: list[dict[str, Any]] = []
    places = []
    for k, numbers in found:
        q = {key: nearest(value) for key, value in numbers.quantiles.items()}
        if numbers.n <= _FEW or not all(map(isfinite, q.values())):
            dots = [value for value in dict.fromkeys(q.values()) if isfinite(value)]
            points(axes, dots, [k] * len(dots), color="black", markersize=3)
            continue
        whiskers = {"whislo": q["p5"], "whishi": q["p95"], "fliers": [q["min"], q["max"]]}
        boxes.append({"q1": q["p25"], "med": q["median"], "q3": q["p75"], **whiskers})
        places.append(k)
    if boxes:
        line = {"linewidth": 0.7}
        axes.bxp(
            boxes,
            places,
            orientation="horizontal",
            widths=0.55,
            manage_ticks=False,
            patch_artist=True,
            boxprops={**line, "facecolor": "#D9ECF6"},
            medianprops={"color": COLOURS[5], "linewidth": 1.3},
            whiskerprops=line,
            capprops=line,
            flierprops={"marker": "o", "markersize": 2, "markerfacecolor": "black", "markeredgewidth": 0},
        )
    axes.set_xlabel(_label(name))


def _is_log(scale: str | None, values: Any) -> bool:
    if scale is not None:
        if scale == "log" and len(values) and not (values > 0).all():
            raise InputError(f"found the number {values.min():g}, expected positive ones for --scale log")
        return scale == "log"
    return bool(len(values) and values.min() > 0 and values.max() > _WIDE * values.min())


def _spread(x: Any, column: Column, series: int) -> Any:
    """Words have a place each, around which their dots lie side by side; numbers stay where they are."""
    if column.categories is None:
        return x
    steps = np.arange(len(x)) * 0.6180339887498949  # evenly spread, and the same every time
    return x + 0.5 * (steps % 1.0 - 0.5)


def _name_words(axes: Axes, column: Column, x: Any, y: Any, finite: Any) -> None:
    words = [_shortened(word) for word in column.categories or ()]
    axes.set_xticks(range(len(words)), words, rotation=30 if max(map(len, words)) > 6 else 0)
    for k in range(len(words)):
        here = y[finite & (x == k)]
        if len(here) > 1:
            axes.plot([k - 0.35, k + 0.35], [np.sort(here)[(len(here) - 1) // 2]] * 2, color=COLOURS[5], linewidth=1.3)


def _legend(figure: Figure, every: Sequence[Axes], style: Style, title: str | None = None) -> None:
    """Above the panels, each kind once."""
    held: dict[str, Any] = {}
    for axes in every:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            held.setdefault(label, handle)
    if held:
        legend_above(figure, list(held.values()), list(held), style, title)
