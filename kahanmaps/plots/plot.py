"""Pictures of results in one call each, as axes: what `km.plot` offers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from kahanmaps.errors import InputError
from kahanmaps.laboratory.growth.degrees import DegreeGrowth

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Plot:
    """The pictures; `ax.figure.savefig("degrees.pdf")` writes one."""

    def degrees(self, found: DegreeGrowth, *, label: str = "degrees", scale: str | None = None) -> Axes:
        """What `km.degrees` found; `scale` is "linear", "log" or "loglog". Raises InputError for anything else."""
        from kahanmaps.plots.growth import draw_degrees

        given: Any = found
        if not isinstance(given, DegreeGrowth):
            raise InputError(f"found a {type(given).__name__}, expected a result: km.plot.degrees(km.degrees(...))")
        axes: Axes = draw_degrees({label: given}, scale=scale).axes[0]
        return axes


plot = Plot()
