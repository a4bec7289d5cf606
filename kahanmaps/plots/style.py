"""The style of pictures: sizes as journals state them, and colors that color-blind readers can distinguish.

The colors are those of Okabe and Ito, ordered such that successive colors differ in lightness: a gray copy of up to
four curves is readable. Curves also differ in line style, and points in their marks. Values have the colors of the
color map cividis, in which lightness increases evenly, also for color-blind readers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from kahanmaps.errors import InputError, quoted

CENTIMETRES_PER_INCH = 2.54
# black, blue, orange, green, sky blue, vermilion, purple
COLORS = ("#000000", "#0072B2", "#E69F00", "#009E73", "#56B4E9", "#D55E00", "#CC79A7")
LINES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 1)), (0, (8, 2)))
MARKS = ("o", "s", "^", "D", "v", "P", "X")
COLOR_MAP = "cividis"
_MAX_PIXELS = 1 << 28  # maximal number of pixels, for which drawing takes a gigabyte of memory


@dataclass(frozen=True)
class Style:
    """The layout of a picture: width and height in centimetres, font size in points, dots per inch of its raster parts.

    If the height is None, it depends on the kind of picture. Raises InputError for sizes out of range, and for a
    picture of more than 2^28 dots.

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
        for description, value, low, high in (
            ("a width of {} cm", self.width, 2, 200),
            ("a height of {} cm", self.height, 2, 200),
            ("a font size of {} pt", self.font_size, 3, 72),
            ("{} dots per inch", self.dpi, 30, 2400),
        ):
            if value is not None and not low <= value <= high:
                # An integer may be too long for a floating-point number.
                given_text = quoted(str(value)).strip("'") if isinstance(value, int) else f"{value:g}"
                raise InputError(f"found {description.format(given_text)}, expected {low} to {high}")
        self.require_pixels(*self.inches(aspect=0.75))

    def inches(self, aspect: float) -> tuple[float, float]:
        """Return width and height in inches; `aspect` is height over width for a style without height."""
        height = self.width * aspect if self.height is None else self.height
        return self.width / CENTIMETRES_PER_INCH, height / CENTIMETRES_PER_INCH

    def require_pixels(self, width: float, height: float) -> None:
        """Raise InputError if a picture of this size in inches, at `dpi` dots per inch, would have too many pixels."""
        pixel_count = width * height * self.dpi**2
        if pixel_count > _MAX_PIXELS:
            raise InputError(
                f"found {pixel_count:.2g} dots in a picture of {width * CENTIMETRES_PER_INCH:.0f} x "
                f"{height * CENTIMETRES_PER_INCH:.0f} cm, expected at most {_MAX_PIXELS:.2g}: use fewer dots per "
                f"inch than {self.dpi}"
            )

    @property
    def small(self) -> float:
        """The font size, in points, of numbers at axes and of legends."""
        return max(3.0, self.font_size - 1)

    @property
    def smallest(self) -> float:
        """The font size, in points, of notes and labels in pictures: `font_size` - 2, but at least 6, to be legible."""
        return min(self.font_size, max(6.0, self.font_size - 2))

    def settings(self) -> dict[str, Any]:
        """Return the settings of matplotlib for this style, in addition to those in the file pictures.mplstyle."""
        sizes = {"axes.titlesize": self.font_size, "axes.labelsize": self.font_size, "font.size": self.font_size}
        small = dict.fromkeys(("xtick.labelsize", "ytick.labelsize", "legend.fontsize"), self.small)
        return {**sizes, **small, "image.cmap": COLOR_MAP, "savefig.dpi": self.dpi}
