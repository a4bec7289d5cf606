"""The pictures of a page as inline SVG, or sentences that say why a picture is missing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, Any

from flint import fmpq

from kahanmaps.algebra.fields import rational
from kahanmaps.checks.settings import random_starts
from kahanmaps.display import markup
from kahanmaps.errors import InputError, KahanmapsError, counted
from kahanmaps.maps.convention import eps_suffix
from kahanmaps.maps.floats.starts import starts_in_box
from kahanmaps.plots.curves.invariant_curves import find_invariant_curves
from kahanmaps.plots.curves.plot_invariant_curves import plot_invariant_curves
from kahanmaps.plots.figures import require_matplotlib, svg_text
from kahanmaps.plots.point_functions import point_function
from kahanmaps.plots.portraits.flow import automatic_starts, plane_flow
from kahanmaps.plots.portraits.portrait import plot_portrait, portrait_of
from kahanmaps.plots.portraits.trajectories import ensemble_for, follow_orbits
from kahanmaps.plots.style import Style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from kahanmaps.documents.files import SystemFile

DEFAULT_EPS = fmpq(1, 20)  # eps of the pictures on a page that is about every eps
_STYLE = Style(width=14, font_size=11, dpi=150)  # letters of this size are legible on a phone
_MAX_ELEMENTS = 1_500  # maximal number of points drawn as SVG elements, each of which takes a hundred bytes
_STEPS = 600  # number of steps of each orbit of a portrait
_PORTRAIT_STARTS = 16  # number of random initial points of a portrait
_CURVE_COUNT = 3  # number of orbits on invariant curves
_CURVE_STEPS = 300  # number of steps of an orbit on invariant curves


class Pictures:
    """The pictures of a page; there are none unless they are `requested` and matplotlib is installed.

    `note` is a sentence for the page if matplotlib is missing, and otherwise empty.
    """

    def __init__(self, requested: bool = True) -> None:
        self.note = ""
        self._requested = requested
        if requested:
            try:
                require_matplotlib()
            except InputError as error:
                self._requested, self.note = False, f"Pictures are left out: {error}"

    def draw(
        self, name: str, caption: str, alt: str, drawing: Callable[[Style], Figure], remarks: Sequence[str] = ()
    ) -> str:
        """Return a <figure> with the picture that `drawing` returns; `name` is its id, `alt` its alternative text.

        `drawing` may append sentences to `remarks`, which are printed below the caption. If there are to be no
        pictures, the result is an empty text; if the picture cannot be drawn, it is a sentence with the reason.
        """
        if not self._requested:
            return ""
        try:
            figure = drawing(_STYLE)
            for axes in figure.axes:
                # Lines and dots with many points are stored as images; axes and letters remain vectors.
                lines: list[Any] = list(axes.lines)
                collections: list[Any] = list(axes.collections)
                points = sum(len(line.get_xdata()) for line in lines) + sum(
                    len(dots.get_offsets()) for dots in collections
                )
                if points > _MAX_ELEMENTS:
                    for artist in (*lines, *collections):
                        artist.set_rasterized(True)
            svg = svg_text(figure, name, _STYLE, alt)
        except KahanmapsError as error:
            title = markup.escape(caption.removesuffix("."))
            return f'<p class="soft">{title}: not drawn, for {markup.escape(error)}</p>'
        caption_html = "<br/>".join(map(markup.escape, (caption, *remarks)))
        return f'<figure id="{name}">\n{svg}\n<figcaption>{caption_html}</figcaption>\n</figure>'

    def portrait(self, file: SystemFile, eps: Any) -> str:
        """Draw sixteen orbits in the plane of the first two variables; a single variable is drawn against the step.

        The initial points lie around an equilibrium of the vector field; for a map without a field they are random.
        """
        eps_value = DEFAULT_EPS if eps is None else rational(eps)
        remarks: list[str] = []
        axes = file.variables[:2] if file.dim > 1 else ("step", file.variables[0])

        def drawing(style: Style) -> Figure:
            real_approximation = file.real_approximation
            if is_field := real_approximation.is_quadratic:
                starts = automatic_starts(real_approximation.system, eps_value)
            else:
                starts = starts_in_box(_PORTRAIT_STARTS, file.dim, 2.0, 0)
            orbits = follow_orbits(ensemble_for(real_approximation.map, eps_value, starts, _STEPS), _STEPS)
            functions = [axis if axis == "step" else point_function(axis, file.variables) for axis in axes]
            portrait = portrait_of(orbits, functions)
            if is_field:
                portrait = replace(
                    portrait, flow=plane_flow(real_approximation.system, range(file.dim), portrait.window)
                )
            for reason, count in orbits.ended.items():
                remarks.append(f"{count} of {counted(orbits.orbits, 'orbit')} ended early: {reason}.")
            if portrait.left_out:
                remarks.append(f"{portrait.left_out} of {orbits.points[..., 0].size} points lie outside the window.")
            return plot_portrait(portrait, style)

        axis_names = " and ".join(axes)
        sentence = f"{eps_suffix(eps_value, file.map)}, {_STEPS} steps in floating point".removeprefix(", ")
        caption = f"Orbits of {'the Kahan map' if file.is_quadratic else 'the map'} in {axis_names}: {sentence}."
        return self.draw("portrait", caption, f"Portrait of orbits in {axis_names}, {sentence}", drawing, remarks)

    def invariant_curves(self, file: SystemFile, eps: Any) -> str:
        """Draw three orbits of a member of the family on their invariant cubics, in a panel for each plane."""
        eps_value = DEFAULT_EPS if eps is None else rational(eps)
        remarks: list[str] = []

        def drawing(style: Style) -> Figure:
            starts = list(islice(random_starts(file.system.dim, 0), _CURVE_COUNT))
            curves = find_invariant_curves(file, starts, eps_value, _CURVE_STEPS)
            for k, pole in enumerate(curves.poles, 1):
                if pole is not None:
                    remarks.append(f"Orbit {k} ends before step {pole}: a pole, or closer to one than 2^-96.")
            return plot_invariant_curves(curves, style)

        sentence = f"{eps_suffix(eps_value)}, {_CURVE_STEPS} steps".removeprefix(", ")
        caption = f"{_CURVE_COUNT} orbits in the planes of the normal form, and the invariant curves through them: "
        alt = f"Invariant plane cubics with orbits on them, {sentence}"
        return self.draw("invariant-curves", f"{caption}{sentence}.", alt, drawing, remarks)
