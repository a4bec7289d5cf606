"""A figure as characters: Braille dots, two across and four down in each cell, with the figure's texts in between.

The figure itself is drawn, at one pixel a dot and without its texts; so every kind of picture can be seen in a
terminal, though coarsely.
"""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from kahanmaps.errors import InputError
from kahanmaps.plots.figures import drawing
from kahanmaps.plots.style import Style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DOTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
_INK = 48  # how far from white, in steps of 255, a dot has to be to be seen
_FRAME = "#808080"
_LEAST_ROWS = 4  # of one panel of several, in which something is to be seen


@dataclass(frozen=True)
class Cell:
    """A character and its colour (red, green, blue), None for the terminal's own."""

    character: str
    colour: tuple[int, int, int] | None


def draw_in_characters(figure: Figure, columns: int, rows: int, style: Style) -> list[list[Cell]]:
    """The figure in `rows` rows of `columns` cells.

    The figure is changed (size and line widths): draw what goes into a file before, or make it anew. Raises InputError
    for fewer than 20 columns or 8 rows, and for too few to hold this figure; it may be tried again with more.
    """
    if columns < 20 or rows < 8:
        raise InputError(f"found {columns} columns and {rows} rows, expected at least 20 and 8 for a picture")
    with drawing(style):
        # A cell is 2 by 4 pixels, and so large is every letter: the layout makes room for the characters themselves.
        figure.set_dpi(72)
        figure.set_size_inches(2 * columns / 72, 4 * rows / 72)
        _coarsen(figure)
        canvas = _canvas(figure)
        with warnings.catch_warnings():
            warnings.filterwarnings("error", message="constrained_layout not applied", category=UserWarning)
            try:
                canvas.draw()
                every = [axes for axes in figure.axes if axes.get_visible()]  # side by side: none inside others
                panels = [axes for axes in every if axes.get_label() != "<colorbar>"]
                enough = len(panels) < 2 or all(axes.bbox.height >= 4 * _LEAST_ROWS for axes in panels)
            except UserWarning:
                enough = False
    if not enough:
        raise InputError(
            f"found {columns} columns and {rows} rows, expected more for this picture: make the terminal larger, "
            "or write a file with -o"
        )
    pixels = np.asarray(canvas.buffer_rgba())[: 4 * rows, : 2 * columns, :3].astype(int)
    cells = _braille(pixels, columns, rows)
    for content, x, y, text in canvas.renderer.written:
        row, column = _place(content, x, y, text, columns, rows)
        for k, character in enumerate(content):
            if 0 <= row < rows and 0 <= column + k < columns:
                cells[row][column + k] = Cell(character, None)
    return cells


def _canvas(figure: Figure) -> Any:
    """Where all but the texts is drawn; these are held as they are written, two pixels a character and four high."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg, RendererAgg

    class Renderer(RendererAgg):  # type: ignore[misc]  # matplotlib has no types here
        def __init__(self, width: float, height: float, dpi: float) -> None:
            super().__init__(width, height, dpi)
            self.written: list[tuple[str, float, float, Any]] = []

        def get_text_width_height_descent(self, s: str, prop: Any, ismath: Any) -> tuple[float, float, float]:
            return 2.0 * len(_content(s, ismath)), 4.0, 1.0

        def draw_text(  # matplotlib sets how it is called
            self, gc: Any, x: float, y: float, s: str, prop: Any, angle: float, ismath: Any = False, mtext: Any = None
        ) -> None:
            content = _content(s, ismath)
            if angle and mtext is not None:  # it is written lying, around the middle of the place it has
                box = mtext.get_window_extent(self)
                x, y = (box.x0 + box.x1) / 2 - len(content), self.height - (box.y0 + box.y1) / 2 + 1
            self.written.append((content, x, y, mtext))

    class Canvas(FigureCanvasAgg):  # type: ignore[misc]
        renderer: Any = None

        def get_renderer(self) -> Any:
            width, height = self.figure.bbox.size
            self.renderer = self.renderer or Renderer(width, height, self.figure.dpi)
            return self.renderer

    return Canvas(figure)


def _content(text: str, is_formula: Any) -> str:
    return " ".join(readable(text if is_formula else text.replace("$", r"\$")).split())


def _place(content: str, x: float, y: float, text: Any, columns: int, rows: int) -> tuple[int, int]:
    """Row and column of a text whose line begins at this pixel, inside the picture as far as that is possible."""
    from matplotlib.text import Annotation

    row, column = int((y - 1) / 4), round(x / 2)
    if isinstance(text, Annotation) and text.axes is not None and text.xycoords == "data":
        panel = text.axes.bbox  # the names of points stay inside, where they cover no numbers
        row = min(max(row, rows - int(panel.y1 / 4)), rows - 2 - int(panel.y0 / 4))
        column = min(max(column, 1 + int(panel.x0 / 2)), max(0, int(panel.x1 / 2) - len(content)))
    return min(max(0, row), rows - 1), min(max(0, column), max(0, columns - len(content)))


def readable(text: str) -> str:
    r"""A label of matplotlib as plain text.

    >>> readable(r"$x_{12}$"), readable(r"$\mathdefault{10^{-3}}$"), readable(r"euler_top, $\varepsilon$ = 1/10")
    ('x12', '10^-3', 'euler_top, eps = 1/10')
    """
    pieces = text.replace(r"\$", "\0").split("$")
    if len(pieces) % 2 == 0:  # a dollar sign without another is no formula
        pieces = ["$".join(pieces)]
    read = "".join(_readable_formula(piece) if k % 2 else piece for k, piece in enumerate(pieces))
    return read.replace("\0", "$").replace("\N{MINUS SIGN}", "-")


def _readable_formula(text: str) -> str:
    text = re.sub(r"\\math\w+|\\left|\\right|\\operatorname", "", text)
    text = text.replace(r"\varepsilon", "eps").replace(r"\times", "*").replace(r"\cdot", "*").replace(r"\,", " ")
    text = text.replace(r"\tilde", "~").replace(r"\leq", "<=").replace(r"\geq", ">=").replace(r"\neq", "!=")
    text = text.replace(r"\nabla", "grad ").replace(r"\pm", "+-")
    text = text.replace(r"\approx", "~").replace(r"\ldots", "...")
    return re.sub(r"[\\{}]", "", re.sub(r"_\{?", "", text))


def _coarsen(figure: Figure) -> None:
    """Lines one dot wide, marks of a dot, letters of one row: what can be seen at this size."""
    from matplotlib.collections import LineCollection, PathCollection
    from matplotlib.legend import Legend
    from matplotlib.lines import Line2D
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        text.set_fontsize(4)
        text.set_path_effects([])  # they would draw the letters
    for line in figure.findobj(Line2D):
        line.set_antialiased(False)
        line.set_linewidth(min(line.get_linewidth(), 0.8))
        line.set_markersize(min(line.get_markersize(), 1.2))
        line.set_markerfacecolor(line.get_markeredgecolor())  # hollow marks of a dot would be nothing
        line.set_markeredgewidth(0)
    for collection in figure.findobj(LineCollection):
        collection.set_antialiased(False)
        collection.set_linewidth(0.8)
    for cloud in figure.findobj(PathCollection):
        cloud.set_sizes([1.2])
        cloud.set_linewidth(0)
    for legend in figure.findobj(Legend):
        _close_up(legend)
    _put_labels_above(figure)
    for axes in figure.axes:
        axes.tick_params(which="both", length=0, pad=3)
        for spine in axes.spines.values():
            spine.set_color(_FRAME)
            spine.set_linewidth(0.5)


def _put_labels_above(figure: Figure) -> None:
    """Labels of vertical axes above their axes: lying, they would cover the numbers beside which they stood."""
    for axes in figure.axes:
        label = axes.get_ylabel()
        if not label or hasattr(axes, "zaxis") or axes.get_title():
            continue
        side: Any = axes.yaxis.get_label_position()  # left or right
        before = axes.get_title(loc=side)
        axes.set_title(f"{before}  {label}" if before else label, loc=side, fontsize=4, pad=2)
        axes.set_ylabel("")


def _close_up(legend: Any) -> None:
    """Lines of a legend one below the other: it was laid out for letters of another size."""
    from matplotlib.lines import Line2D
    from matplotlib.offsetbox import DrawingArea, HPacker, VPacker
    from matplotlib.patches import Rectangle

    for column in legend.findobj(VPacker):
        column.sep = 0
    for row in legend.findobj(HPacker):
        row.sep = 4
    for area in legend.findobj(DrawingArea):
        area.width, area.height, area.ydescent = 8, 2.5, 0
    for handle in legend.legend_handles:
        if isinstance(handle, Rectangle):
            handle.set_bounds(0, 0, 8, 2.5)
        elif isinstance(handle, Line2D):
            count = np.size(handle.get_xdata(orig=True))
            handle.set_data(np.linspace(0, 8, count) if count > 1 else [4], [1.25] * count)


def _braille(pixels: Any, columns: int, rows: int) -> list[list[Cell]]:
    """Cells of 4 by 2 pixels; the colour of a cell is that of its darkest or most coloured dot."""
    ink = 255 - pixels.min(axis=2) > _INK
    blocks = ink.reshape(rows, 4, columns, 2).transpose(0, 2, 1, 3)
    codes = (blocks * _DOTS).sum(axis=(2, 3))
    values = pixels.reshape(rows, 4, columns, 2, 3).transpose(0, 2, 1, 3, 4).reshape(rows, columns, 8, 3)
    strongest = values.min(axis=3).argmin(axis=2)
    cells = []
    for i in range(rows):
        row = []
        for j in range(columns):
            if codes[i, j] == 0:
                row.append(Cell(" ", None))
                continue
            red, green, blue = (int(c) for c in values[i, j, strongest[i, j]])
            grey = max(red, green, blue) - min(red, green, blue) < 24  # black on white is white on black elsewhere
            row.append(Cell(chr(0x2800 + int(codes[i, j])), None if grey else (red, green, blue)))
        cells.append(row)
    return cells
