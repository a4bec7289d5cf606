"""Pictures of results in one call each, as axes: what `km.plot` offers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from kahanmaps.documents.inline import as_file
from kahanmaps.errors import InputError
from kahanmaps.laboratory.growth.degrees import DegreeGrowth
from kahanmaps.laboratory.growth.height_survey import HeightSurvey
from kahanmaps.maps.convention import resolve_eps
from kahanmaps.maps.floats.float_conversion import start_rows
from kahanmaps.maps.kahan import SystemLike
from kahanmaps.maps.orbits.orbit import Trajectory
from kahanmaps.plots.point_functions import point_function
from kahanmaps.plots.portraits.flow import automatic_starts
from kahanmaps.plots.portraits.portrait import portrait_of
from kahanmaps.plots.portraits.trajectories import Trajectories, ensemble_for, walked
from kahanmaps.plots.style import Style

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Plot:
    """The pictures; `ax.figure.savefig("degrees.pdf")` writes one. Raises InputError for other results."""

    def __reduce__(self) -> str:
        return "plot"  # there is one, `km.plot`

    def degrees(self, growth: DegreeGrowth, *, label: str = "degrees", scale: str | None = None) -> Axes:
        """Plot the result of `km.degrees`; `scale` is "linear", "log" or "loglog"."""
        from kahanmaps.plots.growth import plot_degrees

        _require(growth, DegreeGrowth, "a result: km.plot.degrees(km.degrees(...))")
        axes: Axes = plot_degrees({label: growth}, scale=scale).axes[0]
        return axes

    def heights(self, survey: HeightSurvey, *, scale: str | None = None) -> Axes:
        """Plot the result of `km.heights`."""
        from kahanmaps.plots.growth import plot_heights

        _require(survey, HeightSurvey, "a result: km.plot.heights(km.heights(...))")
        axes: Axes = plot_heights(survey, scale=scale).axes[0]
        return axes

    def orbit(self, trajectory: Trajectory, x: int = 0, y: int = 1) -> Axes:
        """The points of what `km.orbit` returned, in two of its coordinates."""
        _require(trajectory, Trajectory, "an orbit: km.plot.orbit(km.orbit(...))")
        points = np.asarray(trajectory)[:, None]
        return _drawn(
            Trajectories(trajectory.variables, points, np.array([point.step for point in trajectory])), (x, y)
        )

    def portrait(self, given: Any, *others: Any, **options: Any) -> Axes:
        """Draw a portrait, as `km.portrait` does."""
        return plot_orbits(given, *others, **options)


def _require(value: Any, kind: type, expected: str) -> None:
    if not isinstance(value, kind):
        raise InputError(f"found a {type(value).__name__}, expected {expected}")


def plot_orbits(
    system: SystemLike,
    starts: Any = None,
    eps: Any = None,
    steps: int = 1000,
    *,
    time_step: Any = None,
    axes: Sequence[int] = (0, 1),
) -> Axes:
    """The float orbits of a map as a portrait in two coordinates: `plot portrait` has all that may be drawn beside.

    Args:
        system: the map.
        starts: one start or many; by default those that `plot portrait` takes, around the fixed points of the field.
        eps: an exact number, half the time step where there is one.
        steps: of each orbit.
        axes: the numbers of the two coordinates.
    """
    real_approximation = as_file(system).real_approximation
    value = real_approximation.at(resolve_eps(eps, time_step)).eps
    if starts is None:
        starts = automatic_starts(real_approximation.system, value, axes)
    x = start_rows(starts)
    return _drawn(walked(ensemble_for(real_approximation.map, value, x, steps), steps), axes)


def _drawn(trajectories: Trajectories, axes: Sequence[int]) -> Axes:
    from kahanmaps.plots.portraits.portrait import plot_portrait

    if not all(0 <= k < len(trajectories.variables) for k in axes):
        raise InputError(f"found the axes {tuple(axes)}, expected numbers below {len(trajectories.variables)}")
    shown = [point_function(trajectories.variables[k], trajectories.variables) for k in axes]
    drawn: Axes = plot_portrait(portrait_of(trajectories, shown), Style()).axes[0]
    return drawn


plot = Plot()
