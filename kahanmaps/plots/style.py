"""How pictures look: sizes as a journal states them, colours that everybody can tell apart.

The colours are those of Okabe and Ito, in an order in which neighbours differ in lightness, so that a grey copy of up
to four curves is readable; beyond colour, curves differ in line style and points in their marks. Values are shown by
the map cividis, whose lightness grows evenly for all eyes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from kahanmaps.errors import InputError

CENTIMETRES_PER_INCH = 2.54
# black, blue, orange, green, sky blue, vermilion, purple
COLOURS = ("#000000", "#0072B2", "#E69F00", "#009E73", "#56B4E9", "#D55E00", "#CC79A7")
LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 1)), (0, (8, 2)))
MARKS = ("o", "s", "^", "D", "v", "P", "X")
COLOUR_MAP = "cividis"


@dataclass(frozen=True)
class Style:
    """How a picture is set: width and height in centimetres, letters in points, dots per inch of what is rasterised.

    A height of None is left to the kind of picture. Raises InputError for sizes out of the range given with each.

    >>> Style(width=25.4, font_size=8).inches(aspect=0.5)
    (10.0, 5.0)
    >>> Style(width=500)
    Traceback (most recent call last):
    ...
    kahanmaps.errors.InputError: found a width of 500 cm, expected 2 to 200
    """

    width: float = 12.0
    height: float | None = None
    font_size: float = 9.0
    dpi: int = 300

    def __post_init__(self) -> None:
        _require("a width of {} cm", self.width, 2, 200)
        if self.height is not None:
            _require("a height of {} cm", self.height, 2, 200)
        _require("a font size of {} pt", self.font_size, 3, 72)
        _require("{} dots per inch", self.dpi, 30, 2400)

    def inches(self, aspect: float) -> tuple[float, float]:
        """Width and height in inches; `aspect` is height over width where no height is asked for."""
        height = self.width * aspect if self.height is None else self.height
        return self.width / CENTIMETRES_PER_INCH, height / CENTIMETRES_PER_INCH

    def settings(self) -> dict[str, Any]:
        """The settings of matplotlib for this style; nothing of a user's matplotlibrc gets through."""
        small = max(3.0, self.font_size - 1)
        return {
            "font.family": "STIXGeneral",
            "font.size": self.font_size,
            "mathtext.fontset": "stix",
            "axes.titlesize": self.font_size,
            "axes.labelsize": self.font_size,
            "axes.linewidth": 0.6,
            "axes.formatter.use_mathtext": True,
            "axes.formatter.limits": (-3, 4),
            "xtick.labelsize": small,
            "ytick.labelsize": small,
            "xtick.major.width": 0.6,
            "ytick.major.width": 0.6,
            "xtick.direction": "in",
            "ytick.direction": "in",
            "legend.fontsize": small,
            "legend.frameon": False,
            "lines.linewidth": 1.0,
            "lines.markersize": 3.0,
            "image.cmap": COLOUR_MAP,
            "savefig.dpi": self.dpi,
            "pdf.fonttype": 42,  # letters stay letters, for editors and for searching
            "svg.fonttype": "path",
            "svg.hashsalt": "kahanmaps",  # names inside an SVG are the same in every run
            "text.parse_math": True,
        }


def _require(what: str, value: float, least: float, most: float) -> None:
    if not least <= value <= most:
        raise InputError(f"found {what.format(f'{value:g}')}, expected {least:g} to {most:g}")
