"""Figures of matplotlib without pyplot: no windows, no global state, the same bytes for the same picture.

A drawing function is `draw_...(values, style) -> Figure`; it makes its figure by `new_figure` inside `drawing(style)`:

    with drawing(style):
        figure = new_figure(style, aspect=0.75)
        axes = figure.subplots()
        ...
    return figure
"""

from __future__ import annotations

import io
import math
import re
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import escape

from kahanmaps.algebra.printing import format_number
from kahanmaps.atomic_files import write_atomically
from kahanmaps.display.latex import latex_name
from kahanmaps.errors import InputError
from kahanmaps.plots.style import CENTIMETRES_PER_INCH, Style
from kahanmaps.version import __version__

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMATS = ("pdf", "svg", "png")
# More points than this are stored as an image of `dpi` dots per inch: as vectors, a million are 15 MB and ten seconds.
RASTERISE_ABOVE = 20_000
_LETTER = 0.5  # the width of a letter on average, in its height
_MAX_DIGITS = 40  # of a number in a label
_BAND_COLOUR, _BAND_SHARE = "#e8e8e8", 0.09  # where a logarithmic axis shows zeros; of its height
_MAX_TICKS = 6
_HANDLE = 5.0  # of a legend, the line or mark with the space around it, in heights of a letter
# Where programs show the version, the command and the system; dates are left out, so that the same picture is the same
# file.
_METADATA: dict[str, tuple[tuple[str, str, str], dict[str, Any]]] = {
    "pdf": (("Creator", "Subject", "Keywords"), {"CreationDate": None}),
    "svg": (("Creator", "Description", "Source"), {"Date": None}),
    "png": (("Software", "Description", "Comment"), {}),
}


def require_matplotlib() -> None:
    """Raise InputError with the remedy where matplotlib is missing."""
    try:
        import matplotlib.figure  # noqa: F401 (whether it is there)
    except ModuleNotFoundError as error:
        raise InputError(f"pictures need matplotlib ({error}): pip install 'kahanmaps[plot]'") from error


@contextmanager
def drawing(style: Style) -> Iterator[None]:
    """Inside, matplotlib has its own defaults and those of the style; afterwards whatever it had before.

    Raises InputError where matplotlib is missing.
    """
    require_matplotlib()
    import matplotlib as mpl
    import matplotlib.style

    with mpl.rc_context():
        mpl.rcdefaults()  # nothing of a user's matplotlibrc gets through
        with as_file(files("kahanmaps.plots") / "pictures.mplstyle") as path:
            mpl.style.use([path, style.settings()])
        yield


def new_figure(style: Style, aspect: float = 0.75) -> Figure:
    """An empty figure in the size of the style; `aspect` is height over width where the style has no height."""
    from matplotlib.figure import Figure

    return Figure(figsize=style.inches(aspect), layout="compressed")


def label_of(name: str) -> str:
    r"""A variable, parameter or other name as a label of a picture.

    >>> label_of("x1"), label_of("eps"), label_of("p_a$")
    ('$x_1$', '$\\varepsilon$', 'p_a\\$')
    """
    latex = latex_name(name)
    if latex.startswith(r"\mathrm"):  # matplotlib reads less than TeX: such names stay text
        return name.replace("$", r"\$")
    return f"${latex}$"


def plain(text: str) -> str:
    """Text of a user in which no dollar sign starts a formula."""
    return text.replace("$", r"\$")


def wrapped(text: str, width: float, size: float, most: int = 3) -> str:
    """Plain text in lines of about `width` points, in letters of `size` points; `most` of them, dots for the rest.

    >>> wrapped("relative error of a_very_very_long_name", width=80, size=8)
    'relative error of\\na_very_very_long_...'
    """
    letters = max(8, int(width / (_LETTER * size)))
    lines = textwrap.wrap(text, letters, break_long_words=False, break_on_hyphens=False)
    if len(lines) > most:
        lines = [*lines[: most - 1], " ".join(lines[most - 1 :])]
    return "\n".join(line if len(line) <= letters else line[: letters - 3] + "..." for line in lines)


def label_number(value: Any) -> str:
    """An exact number as text for a label, its middle left out where it is long.

    >>> from flint import fmpq
    >>> label_number(fmpq(3, 10)), len(label_number(fmpq(10) ** 99))
    ('3/10', 26)
    """
    text = format_number(value)
    return text if len(text) <= _MAX_DIGITS else rf"{text[:10]}\ldots{text[-10:]}"


def write_title(figure: Figure, text: str, style: Style) -> None:
    """Set a title above all panels, in lines that fit the figure."""
    size = style.font_size + 1
    with drawing(style):
        figure.suptitle(plain(wrapped(text, 72 * figure.get_size_inches()[0], size)), fontsize=size)


def legend_columns(labels: Sequence[str], style: Style, most: int = 4) -> int:
    """How many columns of these labels fit into the width of the style.

    >>> legend_columns(["RK4", "implicit midpoint"], Style(width=8.6)), legend_columns(["x" * 50] * 2, Style(width=8.6))
    (2, 1)
    """
    width = max(map(_letters, labels), default=0) * _LETTER + _HANDLE
    return max(1, min(most, len(labels), int(_room(style) / width)))


def shortened_name(name: str, rest: str, style: Style) -> str:
    """A name, cut to what a legend of the width of the style has room for together with the rest of its label.

    >>> shortened_name("f", ": linear growth", Style())
    'f'
    >>> shortened_name("x' = x*y - 2, y' = -x*y + 1", ": linear growth", Style(width=7))
    "x' = x*y - 2, y' ..."
    """
    letters = max(8, int((_room(style) - _HANDLE) / _LETTER) - _letters(rest))
    return name if len(name) <= letters else name[: letters - 3] + "..."


def _letters(label: str) -> int:
    """How many letters a label has, about, without what only says how formulas are set."""
    return len(re.sub(r"\\[A-Za-z]+|[${}^_]", "", label))


def _room(style: Style) -> float:
    """The width of a picture in heights of a letter of its legend."""
    return style.width / CENTIMETRES_PER_INCH * 72 / style.small


def legend_above(
    figure: Figure, handles: Sequence[Any], labels: Sequence[str], style: Style, title: str | None = None, most: int = 4
) -> None:
    """Put a legend above the axes, where no data are, at most `most` columns wide; the layout makes room for it."""
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


def points(axes: Axes, *coordinates: Any, of: int | None = None, **how: Any) -> Any:
    """Points as dots, smaller where they are many and stored as an image above RASTERISE_ABOVE; `how` goes to plot.

    `of` is how many there are in the whole picture, where they are drawn in several parts.
    """
    count = len(coordinates[0]) if of is None else of
    return axes.plot(
        *coordinates,
        **{"marker": "o", "linestyle": "none", "markeredgewidth": 0, "markersize": dot_size(count), **how},
        rasterized=count > RASTERISE_ABOVE,
    )[0]


def beside(axes: Axes, text: str, at: Any, offset: tuple[float, float], halo: float = 0.0, **how: Any) -> None:
    """A text beside a point, `offset` points away from it, with `halo` points of white around its letters."""
    if halo:
        from matplotlib.patheffects import withStroke

        how["path_effects"] = [withStroke(linewidth=halo, foreground="white")]
    axes.annotate(text, at, xytext=offset, textcoords="offset points", **how)


def log_scale_with_zero(axes: Axes, least: float, largest: float, has_zeros: bool) -> float | None:
    """Make the vertical axis logarithmic for positive values from `least` to `largest`; return the height for zeros.

    An exact zero has its place at that height, in a grey band at the bottom that is marked 0. None where there are no
    zeros: then there is no band.
    """
    axes.set_yscale("log")
    low, high = math.log10(least), math.log10(largest)
    margin = max(0.04 * (high - low), 0.1)
    low, high = low - margin, high + margin
    if not has_zeros:
        axes.set_ylim(10**low, 10**high)
        return None
    from matplotlib.ticker import FixedLocator, NullLocator

    below = low - _BAND_SHARE / (1 - _BAND_SHARE) * (high - low)
    zero = 10 ** ((below + low) / 2)
    axes.set_ylim(10**below, 10**high)
    axes.axhspan(10**below, 10**low, color=_BAND_COLOUR, linewidth=0, zorder=0)
    powers = range(math.ceil(low), math.floor(high) + 1)
    every = max(1, -(-len(powers) // _MAX_TICKS))
    # Ticks of powers stop above the band, where the scale means nothing.
    axes.yaxis.set_major_locator(FixedLocator([10.0**k for k in powers[::every]]))
    axes.yaxis.set_minor_locator(NullLocator())
    where = ("axes fraction", "data")
    beside(axes, "0", (0, zero), (-3, 0), xycoords=where, ha="right", va="center", fontsize="small")
    return zero


def dot_size(count: int) -> float:
    """The diameter of dots, in points, where there are `count` of them."""
    return 2.4 if count <= 500 else 1.4 if count <= 5_000 else 0.7 if count <= 50_000 else 0.35


def format_of(path: str, asked: str | None) -> str:
    """pdf, svg or png: what is asked for, or by the ending of the path. Raises InputError for anything else."""
    found = asked or Path(path).suffix.removeprefix(".").lower()
    if found not in FORMATS:
        what = f"the ending .{found}" if found else "no ending"
        raise InputError(f"{path}: found {what}, expected .pdf, .svg or .png (or --format)")
    return found


def picture_bytes(figure: Figure, kind: str, style: Style, command: str = "", system: str = "") -> bytes:
    """The figure as a PDF, SVG or PNG file; the command that makes it and the system (as TOML) are in its metadata.

    The same figure gives the same bytes, with the same version of matplotlib: no dates, no random names. Raises
    InputError for more dots than fit into memory.
    """
    style.require_pixels(*figure.get_size_inches())
    keys, no_dates = _METADATA[kind]
    texts = zip(keys, (f"kahanmaps {__version__}", command, system), strict=True)
    held = io.BytesIO()
    with drawing(style):
        figure.savefig(held, format=kind, metadata={**{key: text for key, text in texts if text}, **no_dates})
    return held.getvalue()


def write_picture(figure: Figure, path: str, kind: str, style: Style) -> None:
    """Write the figure to a file, whole or not at all."""
    write_atomically(Path(path), picture_bytes(figure, kind, style))


def svg_text(figure: Figure, name: str, style: Style, alt: str) -> str:
    """The figure as an <svg> element for a page.

    `name` makes its ids different from those of other pictures on the page, `alt` says in words what it shows. It is as
    wide as there is room for, and no wider than the style says.
    """
    text = picture_bytes(figure, "svg", style).decode()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.DOTALL)
    text = re.sub(r'(\bid=")([^"]+)"', rf'\1{name}-\2"', text)
    text = re.sub(r'((?:xlink:)?href="#|url\(#)', rf"\1{name}-", text)
    head, rest = text.split(">", 1)
    head = re.sub(r'\s(width|height)="[^"]*"', "", head)
    head += f' class="picture" role="img" style="width:100%;max-width:{style.width:g}cm;height:auto"'
    return f"{head}>\n <title>{escape(alt)}</title>{rest}"
