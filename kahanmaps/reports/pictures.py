"""The pictures of a page, as SVG in its text; where there can be none, a sentence says why."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from math import inf
from typing import TYPE_CHECKING, Any

from kahanmaps.display import markup
from kahanmaps.errors import InputError, KahanmapsError
from kahanmaps.plots.figures import require_matplotlib, svg_text
from kahanmaps.plots.style import Style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_STYLE = Style(width=14, font_size=11, dpi=150)  # letters that are readable on a telephone as well
_RASTERISE_ABOVE = 1_500  # points: as elements of the page they would be a hundred bytes each


class Pictures:
    """Draws pictures into a page, or leaves them out: `wanted` says whether the reader wants any.

    None is begun after `until`, a value of time.monotonic(): a sentence says so in its place. `note` is a sentence for
    the page: that matplotlib is missing, and what to do; empty where it is there.
    """

    def __init__(self, wanted: bool = True, until: float = inf) -> None:
        self.note, self._until = "", until
        self._wanted = wanted
        if wanted:
            try:
                require_matplotlib()
            except InputError as error:
                self._wanted, self.note = False, f"Pictures are left out: {error}"

    def draw(
        self, name: str, caption: str, alt: str, drawing: Callable[[Style], Figure], remarks: Sequence[str] = ()
    ) -> str:
        """A <figure> with the picture that `drawing` makes; `name` is its id, `alt` says in words what it shows.

        `remarks` are read after `drawing` was called, which may have written into them what the picture does not show;
        they stand below the caption. Empty without pictures; where it cannot be drawn, the reason.
        """
        if not self._wanted:
            return ""
        try:
            if time.monotonic() > self._until:
                raise InputError("the time was over (--seconds)")
            figure = drawing(_STYLE)
            _rasterise(figure)
            svg = svg_text(figure, name, _STYLE, alt)
        except KahanmapsError as error:
            what = markup.escape(caption.removesuffix("."))
            return f'<p class="soft">{what}: not drawn, for {markup.escape(error)}</p>'
        words = "<br/>".join(map(markup.escape, (caption, *remarks)))
        return f'<figure id="{name}">\n{svg}\n<figcaption>{words}</figcaption>\n</figure>'


def _rasterise(figure: Figure) -> None:
    """Store what has many points as an image within the picture; axes and letters stay lines."""
    for axes in figure.axes:
        lines: list[Any] = list(axes.lines)
        clouds: list[Any] = list(axes.collections)
        points = sum(len(line.get_xdata()) for line in lines) + sum(len(dots.get_offsets()) for dots in clouds)
        if points > _RASTERISE_ABOVE:
            for artist in (*lines, *clouds):
                artist.set_rasterized(True)
