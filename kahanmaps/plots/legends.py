"""A legend above the axes, where no data are, in as many columns as there is room for."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from kahanmaps.algebra.text import format_number
from kahanmaps.plots.style import CENTIMETRES_PER_INCH, Style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LONGEST = 40  # digits of a number
_WIDTH = 0.5  # of a letter on average, in its height
_HANDLE = 5.0  # the line or mark with the space around it


def label_number(value: Any) -> str:
    """An exact number as text for a label, its middle left out where it is long.

    >>> from flint import fmpq
    >>> label_number(fmpq(3, 10)), len(label_number(fmpq(10) ** 99))
    ('3/10', 26)
    """
    text = format_number(value)
    return text if len(text) <= _LONGEST else rf"{text[:10]}\ldots{text[-10:]}"


def legend_columns(labels: Sequence[str], style: Style, most: int = 4) -> int:
    """How many columns of these labels fit into the width of the style.

    >>> legend_columns(["RK4", "implicit midpoint"], Style(width=8.6)), legend_columns(["x" * 50] * 2, Style(width=8.6))
    (2, 1)
    """
    letters = max((len(re.sub(r"\\[A-Za-z]+|[${}^_]", "", label)) for label in labels), default=0)
    width = (letters * _WIDTH + _HANDLE) * max(3.0, style.font_size - 1)
    room = style.width / CENTIMETRES_PER_INCH * 72
    return max(1, min(most, len(labels), int(room / width)))


def legend_above(
    figure: Figure, handles: Sequence[Any], labels: Sequence[str], style: Style, title: str | None = None, most: int = 4
) -> None:
    """Put a legend above the axes of a figure, at most `most` columns wide; its layout makes room for it."""
    figure.legend(
        list(handles),
        list(labels),
        loc="outside upper left",
        ncols=legend_columns(labels, style, most),
        title=title,
        title_fontsize="small",
        alignment="left",
    )


def legend_height(labels: Sequence[str], style: Style, title: bool = False, most: int = 4) -> float:
    """How high the legend is, over the width of the figure."""
    lines = -(-len(labels) // legend_columns(labels, style, most)) + title
    return 1.45 * lines * style.font_size / (style.width / CENTIMETRES_PER_INCH * 72)
