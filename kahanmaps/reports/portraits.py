"""The pictures of orbits on a page: a portrait of a system, the invariant curves of a member of the family."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, Any

from flint import fmpq

from kahanmaps.algebra.fields import rational
from kahanmaps.checks.settings import random_starts
from kahanmaps.errors import counted
from kahanmaps.maps.convention import eps_told
from kahanmaps.maps.floats.ensemble import starts_in_box
from kahanmaps.plots.curves.draw_invariant_curves import draw_invariant_curves
from kahanmaps.plots.curves.invariant_curves import find_invariant_curves
from kahanmaps.plots.point_functions import point_function
from kahanmaps.plots.portraits.automatic_starts import automatic_starts
from kahanmaps.plots.portraits.draw_portrait import draw_portrait
from kahanmaps.plots.portraits.flow import plane_flow
from kahanmaps.plots.portraits.portrait import portrait_of
from kahanmaps.plots.portraits.trajectories import ensemble_for, walked
from kahanmaps.plots.style import Style
from kahanmaps.reports.pictures import Pictures

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from kahanmaps.documents.files import SystemFile

_EPS = fmpq(1, 20)  # where a page is for every eps
_STEPS = 600
_ORBITS = 3
_MANY = 16
_CURVE_STEPS = 300


def portrait_figure(file: SystemFile, eps: Any, pictures: Pictures) -> str:
    """Sixteen orbits in the plane of the first two variables (in dimension 1 against the step).

    They start around the fixed points of a vector field, and at random where there is none.
    """
    at = _EPS if eps is None else rational(eps)
    remarks: list[str] = []
    axes = file.variables[:2] if file.dim > 1 else ("step", file.variables[0])

    def drawing(style: Style) -> Figure:
        rounded = file.rounded
        is_field = rounded.is_quadratic
        starts = automatic_starts(rounded.system, at) if is_field else starts_in_box(_MANY, file.dim, 2.0, 0)
        found = walked(ensemble_for(rounded.map, at, starts, _STEPS), _STEPS)
        functions = [axis if axis == "step" else point_function(axis, file.variables) for axis in axes]
        shown = portrait_of(found, functions)
        if is_field:
            shown = replace(shown, flow=plane_flow(rounded.system, range(file.dim), shown.window))
        remarks.extend(
            f"{count} of {counted(found.orbits, 'orbit')} ended early: {r}." for r, count in found.ended.items()
        )
        if shown.left_out:
            remarks.append(f"{shown.left_out} of {found.points[..., 0].size} points lie outside the window.")
        return draw_portrait(shown, style)

    sentence = f"{eps_told(at, file.map)}, {_STEPS} steps in machine numbers".removeprefix(", ")
    caption = f"Orbits of {'the Kahan map' if file.is_quadratic else 'the map'} in {' and '.join(axes)}: {sentence}."
    return pictures.draw(
        "portrait", caption, f"Portrait of orbits in {' and '.join(axes)}, {sentence}", drawing, remarks
    )


def invariant_curves_figure(file: SystemFile, eps: Any, pictures: Pictures) -> str:
    """Three orbits of a member of the family, plane by plane, on the cubic curves that they never leave."""
    at = _EPS if eps is None else rational(eps)
    remarks: list[str] = []

    def drawing(style: Style) -> Figure:
        starts = list(islice(random_starts(file.system.dim, 0), _ORBITS))
        found = find_invariant_curves(file, starts, at, _CURVE_STEPS)
        remarks.extend(
            f"Orbit {k} ends before step {pole}: a pole, or closer to one than 2^-96."
            for k, pole in enumerate(found.poles, 1)
            if pole is not None
        )
        return draw_invariant_curves(found, style)

    sentence = f"{eps_told(at)}, {_CURVE_STEPS} steps".removeprefix(", ")
    caption = f"{_ORBITS} orbits in the planes of the normal form, and the invariant curves through them: {sentence}."
    return pictures.draw(
        "invariant-curves", caption, f"Invariant plane cubics with orbits on them, {sentence}", drawing, remarks
    )
