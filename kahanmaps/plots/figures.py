"""Figures of matplotlib without pyplot: no windows, no global state, and equal files for equal pictures.

A plotting function has the form `plot_...(result, style) -> Figure`. It calls `new_figure` inside `drawing(style)`:

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
from dataclasses import replace
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import escape

from kahanmaps.algebra.parsing import is_name, parse_rational_function
from kahanmaps.algebra.printing import format_number
from kahanmaps.atomic_files import write_atomically
from kahanmaps.display.latex import LATEX, latex_name
from kahanmaps.errors import InputError
from kahanmaps.plots.style import CENTIMETRES_PER_INCH, Style
from kahanmaps.version import __version__

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMATS = ("pdf", "svg", "png")
# More points are stored as an image of `dpi` dots per inch: a million points stored as vectors take 15 MB.
MAX_VECTOR_POINTS = 20_000
LETTER_WIDTH = 0.5  # mean width of a letter relative to the font size
_MAX_DIGITS = 40  # maximal number of characters of a number in a label
_MAX_FORMULA = 60  # maximal number of characters of a typeset expression
_BAND_COLOR, _BAND_SHARE = "#e8e8e8", 0.09  # band for zeros on a log axis, fraction of the height
_MAX_TICKS = 6  # maximal number of ticks on a logarithmic axis with a band for zeros
_HANDLE_WIDTH = 5.0  # width of a line or mark in a legend, with space around it, relative to the font size
_ON_ONE_LINE = replace(
    LATEX,
    enclosed="({})".format,
    fraction=lambda numerator, denominator: f"{_in_brackets(numerator)} / {_in_brackets(denominator)}",
)
# Metadata keys for version, command and system; no dates, so that equal figures give equal files.
_METADATA: dict[str, tuple[tuple[str, str, str], dict[str, Any]]] = {
    "pdf": (("Creator", "Subject", "Keywords"), {"CreationDate": None}),
    "svg": (("Creator", "Description", "Source"), {"Date": None}),
    "png": (("Software", "Description", "Comment"), {}),
}


def require_matplotlib() -> None:
    """Raise InputError if matplotlib is missing; the message says how to install it."""
    try:
        import matplotlib.figure  # noqa: F401 (only to test whether it is installed)
    except ModuleNotFoundError as error:
        raise InputError(f"pictures need matplotlib ({error}): pip install 'kahanmaps[plot]'") from error


@contextmanager
def drawing(style: Style) -> Iterator[None]:
    """Use matplotlib's defaults and the settings of the style in the context, then restore the user's settings.

    Raises InputError if matplotlib is missing.
    """
    require_matplotlib()
    import matplotlib as mpl
    import matplotlib.style

    with mpl.rc_context():
        mpl.rcdefaults()  # the user's matplotlibrc must not change pictures
        with as_file(files("kahanmaps.plots") / "pictures.mplstyle") as path:
            mpl.style.use([path, style.settings()])
        yield


def new_figure(style: Style, aspect: float = 0.75) -> Figure:
    """Return an empty figure of the size of the style; `aspect` is height over width if the style has no height."""
    from matplotlib.figure import Figure

    return Figure(figsize=style.inches(aspect), layout="compressed")


def label_of(text: str) -> str:
    r"""Return the label for a name, an expression or an equation, typeset as a formula in matplotlib's mathtext.

    The digits at the end of a name are an index. An underscore separates a letter from its index (p_a) or a word from a
    symbol (modified_H). A text that is long or cannot be parsed as a formula is returned as plain text.

    >>> label_of("x1"), label_of("eps"), label_of("p_a"), label_of("modified_H"), label_of("p_a$")
    ('$x_1$', '$\\varepsilon$', '$p_{a}$', 'modified $H$', 'p_a\\$')
    >>> label_of("(1 - F1)/eps^2"), label_of("b1^2 - b2/3 = 0")
    ('$-(F_1 - 1) / \\varepsilon^2$', '$b_1^2 - \\frac{1}{3} b_2 = 0$')
    """
    if " = " in text:
        sides = [label_of(side) for side in text.split(" = ")]
        if all(side.startswith("$") and side.count("$") == 2 for side in sides):
            return "$" + " = ".join(side.strip("$") for side in sides) + "$"
        return escape_dollars(text)
    if not is_name(text):
        if re.fullmatch(r"-?\d+(/\d+)?", text):
            return f"${text}$"
        names = sorted(set(re.findall(r"[A-Za-z_]\w*~*", text)))
        if len(text) > _MAX_FORMULA or not names:
            return escape_dollars(text)
        try:
            latex = _ON_ONE_LINE.rational(parse_rational_function(text, names))
        except InputError:
            return escape_dollars(text)
        # mathtext supports only a part of TeX. Moreover, stacked fractions in a line of text are too small to be read.
        return escape_dollars(text) if "mathrm" in latex else f"${latex}$"
    latex = latex_name(text)
    if "mathrm" not in latex:
        return f"${latex}$"
    parts = text.split("_")
    symbols = [latex_name(part) if part else r"\mathrm" for part in parts]
    if len(parts) < 2 or any("mathrm" in symbol for symbol in symbols):
        return escape_dollars(text)
    parts_with_symbols = list(zip(parts, symbols, strict=True))
    if _is_word(parts[0]):
        return " ".join(part if _is_word(part) else f"${symbol}$" for part, symbol in parts_with_symbols)
    indices = [rf"\mathrm{{{part}}}" if _is_word(part) else symbol for part, symbol in parts_with_symbols[1:]]
    return f"${symbols[0]}_{{{','.join(indices)}}}$"


def _is_word(text: str) -> bool:
    """Whether letters form a word, as in modified_H, rather than a symbol: x, al, or the name of a Greek letter."""
    return len(text) > 2 and text.isalpha() and latex_name(text) == text


def _in_brackets(text: str) -> str:
    return f"({text})" if " + " in text or " - " in text or " " in text else text


def escape_dollars(text: str) -> str:
    """Escape the dollar signs in a text, so that mathtext typesets no part of it as a formula."""
    return text.replace("$", r"\$")


def wrap_text(text: str, width: float, size: float, max_lines: int = 3) -> str:
    """Break plain text into at most `max_lines` lines, for a width of `width` points and letters of `size` points.

    A text that is too long is cut, and dots mark the cut.

    >>> wrap_text("relative error of a_very_very_long_name", width=80, size=8)
    'relative error of\\na_very_very_long_...'
    """
    letters = max(8, int(width / (LETTER_WIDTH * size)))
    lines = textwrap.wrap(text, letters, break_long_words=False, break_on_hyphens=False)
    if len(lines) > max_lines:
        lines = [*lines[: max_lines - 1], " ".join(lines[max_lines - 1 :])]
    return "\n".join(line if len(line) <= letters else line[: letters - 3] + "..." for line in lines)


def label_number(value: Any) -> str:
    """Return an exact number as text for a label; in a long number dots replace the digits in the middle.

    >>> from flint import fmpq
    >>> label_number(fmpq(3, 10)), len(label_number(fmpq(10) ** 99))
    ('3/10', 26)
    """
    text = format_number(value)
    return text if len(text) <= _MAX_DIGITS else rf"{text[:10]}\ldots{text[-10:]}"


def write_title(figure: Figure, text: str, style: Style) -> None:
    """Write a title above all panels, broken into lines as wide as the figure."""
    size = style.font_size + 1
    with drawing(style):
        figure.suptitle(escape_dollars(wrap_text(text, 72 * figure.get_size_inches()[0], size)), fontsize=size)


def legend_columns(labels: Sequence[str], style: Style, max_columns: int = 4) -> int:
    """Return how many columns of labels, but at most `max_columns`, fit into the width of the style.

    >>> legend_columns(["RK4", "implicit midpoint"], Style(width=8.6)), legend_columns(["x" * 50] * 2, Style(width=8.6))
    (2, 1)
    """
    width = max(map(letter_count, labels), default=0) * LETTER_WIDTH + _HANDLE_WIDTH
    return max(1, min(max_columns, len(labels), int(_letters_across(style) / width)))


def shortened_name(name: str, suffix: str, style: Style) -> str:
    """Return a name, cut such that the name and `suffix` fit into one line of a legend as wide as the style.

    >>> shortened_name("f", ": linear growth", Style())
    'f'
    >>> shortened_name("x' = x*y - 2, y' = -x*y + 1", ": linear growth", Style(width=7))
    "x' = x*y - 2, y' ..."
    """
    letters = max(8, int((_letters_across(style) - _HANDLE_WIDTH) / LETTER_WIDTH) - letter_count(suffix))
    return name if len(name) <= letters else name[: letters - 3] + "..."


def letter_count(label: str) -> int:
    """Return the approximate number of letters in a typeset label, without the commands of mathtext."""
    return len(re.sub(r"\\[A-Za-z]+|[${}^_]", "", label))


def _letters_across(style: Style) -> float:
    """Return the width of a picture divided by the font size of its legend."""
    return style.width / CENTIMETRES_PER_INCH * 72 / style.small


def legend_above(
    figure: Figure,
    handles: Sequence[Any],
    labels: Sequence[str],
    style: Style,
    title: str | None = None,
    max_columns: int = 4,
) -> None:
    """Put a legend of at most `max_columns` columns above the axes, which become smaller."""
    figure.legend(
        list(handles),
        list(labels),
        loc="outside upper left",
        ncols=legend_columns(labels, style, max_columns),
        title=title,
        title_fontsize="small",
        alignment="left",
    )


def legend_height(labels: Sequence[str], style: Style, title: bool = False, max_columns: int = 4) -> float:
    """Return the height of a legend above the axes, relative to the width of the figure."""
    lines = -(-len(labels) // legend_columns(labels, style, max_columns)) + title
    return 1.45 * lines * style.font_size / (style.width / CENTIMETRES_PER_INCH * 72)


def draw_points(axes: Axes, *coordinates: Any, total: int | None = None, **keywords: Any) -> Any:
    """Draw points as dots: many points as small dots, and more than MAX_VECTOR_POINTS as an image.

    `total` is the number of points in the whole picture if several calls draw it; `keywords` go to matplotlib's `plot`.
    """
    count = len(coordinates[0]) if total is None else total
    return axes.plot(
        *coordinates,
        **{"marker": "o", "linestyle": "none", "markeredgewidth": 0, "markersize": dot_size(count), **keywords},
        rasterized=count > MAX_VECTOR_POINTS,
    )[0]


def write_beside(
    axes: Axes, text: str, at: Any, offset: tuple[float, float], halo: float = 0.0, **keywords: Any
) -> None:
    """Write a text beside the point `at`, shifted by `offset` in points; `halo` is the width of its white outline.

    `keywords` go to matplotlib's `annotate`.
    """
    if halo:
        from matplotlib.patheffects import withStroke

        keywords["path_effects"] = [withStroke(linewidth=halo, foreground="white")]
    axes.annotate(text, at, xytext=offset, textcoords="offset points", **keywords)


def log_scale_with_zero(axes: Axes, least: float, largest: float, has_zeros: bool) -> float | None:
    """Make the vertical axis logarithmic from `least` to `largest`; return the height at which zeros are drawn.

    Exact zeros are drawn in a gray band at the bottom, labelled 0. If `has_zeros` is false, the result is None.
    """
    axes.set_yscale("log")
    low, high = math.log10(least), math.log10(largest)
    margin = max(0.04 * (high - low), 0.1)
    low, high = low - margin, high + margin
    if not has_zeros:
        axes.set_ylim(10**low, 10**high)
        return None
    from matplotlib.ticker import FixedLocator, NullLocator

    bottom = low - _BAND_SHARE / (1 - _BAND_SHARE) * (high - low)
    zero = 10 ** ((bottom + low) / 2)
    axes.set_ylim(10**bottom, 10**high)
    axes.axhspan(10**bottom, 10**low, color=_BAND_COLOR, linewidth=0, zorder=0)
    powers = range(math.ceil(low), math.floor(high) + 1)
    stride = max(1, -(-len(powers) // _MAX_TICKS))
    # Ticks at powers of ten are drawn only above the band, in which the scale has no meaning.
    axes.yaxis.set_major_locator(FixedLocator([10.0**k for k in powers[::stride]]))
    axes.yaxis.set_minor_locator(NullLocator())
    write_beside(
        axes, "0", (0, zero), (-3, 0), xycoords=("axes fraction", "data"), ha="right", va="center", fontsize="small"
    )
    return zero


def dot_size(count: int) -> float:
    """Return the diameter, in points, for each of `count` dots."""
    return 2.4 if count <= 500 else 1.4 if count <= 5_000 else 0.7 if count <= 50_000 else 0.35


def format_of(path: str, requested: str | None) -> str:
    """Return the requested format (pdf, svg or png), by default the extension of `path`. Raises InputError."""
    extension = requested or Path(path).suffix.removeprefix(".").lower()
    if extension not in FORMATS:
        given = f"the extension .{extension}" if extension else "no extension"
        raise InputError(f"{path}: found {given}, expected .pdf, .svg or .png, or the option --format")
    return extension


def picture_bytes(figure: Figure, kind: str, style: Style, command: str = "", system: str = "") -> bytes:
    """Return a figure as a PDF, SVG or PNG file, with the command and the system (TOML) as metadata.

    Equal figures give equal bytes if the version of matplotlib is the same, since there are no dates and no random ids.
    Raises InputError if the picture has too many pixels.
    """
    style.require_pixels(*figure.get_size_inches())
    keys, no_dates = _METADATA[kind]
    texts = zip(keys, (f"kahanmaps {__version__}", command, system), strict=True)
    buffer = io.BytesIO()
    with drawing(style):
        figure.savefig(buffer, format=kind, metadata={**{key: text for key, text in texts if text}, **no_dates})
    return buffer.getvalue()


def write_picture(figure: Figure, path: str, kind: str, style: Style) -> None:
    """Write a figure atomically to the file `path` in the format `kind`."""
    write_atomically(Path(path), picture_bytes(figure, kind, style))


def svg_text(figure: Figure, name: str, style: Style, alt: str) -> str:
    """Return a figure as an <svg> element for an HTML page.

    `name` is a prefix that makes the ids of the element unique on the page; `alt` is the alternative text. The element
    takes the available width, but at most the width of the style.
    """
    text = picture_bytes(figure, "svg", style).decode()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.DOTALL)
    text = re.sub(r'(\bid=")([^"]+)"', rf'\1{name}-\2"', text)
    text = re.sub(r'((?:xlink:)?href="#|url\(#)', rf"\1{name}-", text)
    head, body = text.split(">", 1)
    head = re.sub(r'\s(width|height)="[^"]*"', "", head)
    head += f' class="picture" role="img" style="width:100%;max-width:{style.width:g}cm;height:auto"'
    return f"{head}>\n <title>{escape(alt)}</title>{body}"
