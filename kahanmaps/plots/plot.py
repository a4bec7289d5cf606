"""The functions of `km.plot`: each draws a picture of a result and returns the matplotlib axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from kahanmaps.documents.inline import as_file
from kahanmaps.errors import InputError
from kahanmaps.function_calls import public_function
from kahanmaps.hints import AttributeHints
from kahanmaps.laboratory.growth.degrees import DegreeGrowth
from kahanmaps.laboratory.growth.height_survey import HeightSurvey
from kahanmaps.laboratory.scan.result import Scan
from kahanmaps.maps.convention import either, resolve_eps
from kahanmaps.maps.kahan import SystemLike
from kahanmaps.maps.orbits.orbit import Trajectory
from kahanmaps.maps.values import as_point, as_points, start_rows
from kahanmaps.plots.comparison.compare import Comparison
from kahanmaps.plots.point_functions import point_function
from kahanmaps.plots.portraits.flow import automatic_starts
from kahanmaps.plots.portraits.portrait import portrait_of
from kahanmaps.plots.portraits.trajectories import Trajectories, ensemble_for, follow_orbits
from kahanmaps.plots.style import Style

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Plot(AttributeHints):
    """Pictures of results; each method returns matplotlib axes `ax`. To save a picture: `ax.figure.savefig("a.pdf")`.

    `km.plot(value)` draws a result, an orbit, or the portrait of a system. Raises InputError for any other value.
    """

    def __reduce__(self) -> str:
        return "plot"  # the name under which pickle finds the only instance, `km.plot`

    def __call__(self, value: Any, *arguments: Any, **options: Any) -> Axes:
        """Draw a result that one of the methods can draw, an orbit, or the portrait of a system."""
        methods: dict[type, Any] = {
            DegreeGrowth: self.degrees,
            HeightSurvey: self.heights,
            Scan: self.scan,
            Comparison: self.compare,
            Trajectory: self.orbit,
        }
        axes: Axes = methods.get(type(value), self.portrait)(value, *arguments, **options)
        return axes

    def degrees(self, growth: DegreeGrowth, *, label: str = "degrees", scale: str | None = None) -> Axes:
        """Plot the result of `km.degrees`; `scale` is "linear", "log" or "loglog"."""
        from kahanmaps.plots.growth import plot_degrees

        _require(growth, DegreeGrowth, "a result: km.plot.degrees(km.degrees(...))")
        return _axes(plot_degrees({label: growth}, scale=scale))

    def heights(self, survey: HeightSurvey, *, scale: str | None = None) -> Axes:
        """Plot the result of `km.heights`."""
        from kahanmaps.plots.growth import plot_heights

        _require(survey, HeightSurvey, "a result: km.plot.heights(km.heights(...))")
        return _axes(plot_heights(survey, scale=scale))

    def scan(self, result: Scan) -> Axes:
        """Plot the result of `km.scan` in the plane of two parameters."""
        from kahanmaps.plots.scan import plot_scan

        _require(result, Scan, "a result: km.plot.scan(km.scan(...))")
        return _axes(plot_scan(result, Style()))

    def compare(self, result: Comparison, *, show: str = "drift", scale: str = "loglog") -> Axes:
        """Plot a result of `km.compare`: "drift", "error" (against the time step) or "work" (against evaluations)."""
        from kahanmaps.plots.comparison.plot_compare import plot_comparison

        _require(result, Comparison, "a result: km.plot.compare(km.compare(...))")
        return _axes(plot_comparison(result, show=show, scale=scale))

    def commute(self, system: SystemLike, other: SystemLike | None = None, *, x0: Any, eps: Any, n: int = 1) -> Axes:
        """Draw x, its images under the maps of two (or two associated) systems, and both products of the maps at x."""
        from kahanmaps.plots.squares import pair_of_systems, pairs_of_member, plot_squares, squares

        file = as_file(system)
        pairs = [pair_of_systems(file, as_file(other), eps)] if other is not None else list(pairs_of_member(file))
        return _axes(plot_squares([squares(pair, x0, eps, n) for pair in pairs], Style()))

    def invariant_curves(self, system: SystemLike, *, x0: Any, eps: Any, n: int = 1000) -> Axes:
        """Draw the invariant curves through one or several initial points, in each plane of a member of the family."""
        from kahanmaps.plots.curves.invariant_curves import find_invariant_curves
        from kahanmaps.plots.curves.plot_invariant_curves import plot_invariant_curves

        file = as_file(system)
        return _axes(plot_invariant_curves(find_invariant_curves(file, as_points(x0, file.variables), eps, n), Style()))

    def rotation(
        self,
        system: SystemLike,
        first: Any,
        last: Any,
        *,
        eps: Any = None,
        points: int = 200,
        against: str | None = None,
    ) -> Axes:
        """Plot rotation numbers of initial points from `first` to `last` against their position or an integral."""
        from kahanmaps.plots.rotation import plot_rotation

        file = as_file(system)
        ends = as_point(first, file.variables), as_point(last, file.variables)
        return _axes(plot_rotation(file, eps, *ends, Style(), points=points, against=against))

    def section(
        self,
        system: SystemLike,
        plane: str,
        *,
        x0: Any,
        eps: Any = None,
        n: int = 20_000,
        axes: Sequence[str] | None = None,
        direction: str = "up",
    ) -> Axes:
        """Plot a Poincare section of float orbits, as the command `plot section` does.

        Args:
            system: a map with at least 3 variables, or a system, which stands for its Kahan map.
            plane: the hyperplane, a linear equation in the variables such as "x1 = 1/2".
            x0: one initial point or many.
            eps: half the time step (exact); None for a map without eps.
            n: the number of steps of each orbit.
            axes: two variables or expressions; by default the variables along which the crossings are spread most.
            direction: "up" for crossings to larger values, "down" for crossings to smaller values, or "both".
        """
        from kahanmaps.plots.comparison.functions import requested_axis
        from kahanmaps.plots.section import curves_on, hyperplane_of, plot_section, section_of

        file = as_file(system)
        value = file.real_approximation.at(resolve_eps(eps, None, floats=True)).eps
        hyperplane = hyperplane_of(file, value, plane)
        section = section_of(
            ensemble_for(file.map, value, start_rows(x0, file.variables), n), hyperplane, n, direction=direction
        )
        names = axes or [file.variables[k] for k in section.widest_axes(hyperplane)]
        functions = [requested_axis(file, value, name) for name in names]
        return _axes(plot_section(section, functions, curves=curves_on(file, value, hyperplane, functions)))

    def escape(
        self,
        system: SystemLike,
        *,
        eps: Any = None,
        window: Sequence[Sequence[float]] = ((-2, 2), (-2, 2)),
        n: int = 200,
        show: str = "time",
        cells: int = 300,
        radius: float = 1000,
    ) -> Axes:
        """Plot at which step, or in which direction, float orbits leave a ball, as the command `plot escape` does.

        Args:
            system: a map, or a system, which stands for its Kahan map.
            eps: half the time step (exact); None for a map without eps.
            window: the ranges of the first two coordinates of the initial points; all other coordinates are 0.
            n: the number of steps.
            show: "time" for the steps, or "basin" for the directions.
            cells: the number of initial points along each axis.
            radius: a point is outside of the ball if max |x_i| exceeds this number.
        """
        from kahanmaps.plots.escape import plot_escape, survey_escape

        file = as_file(system).real_approximation
        value = file.at(resolve_eps(eps, None, floats=True)).eps
        (a, b), (c, d) = window
        survey = survey_escape(
            file.map, value, ((a, b), (c, d)), (0, 1), None, cells=cells, steps=n, radius=float(radius)
        )
        return _axes(plot_escape(survey, show=show))

    def orbit(self, trajectory: Trajectory, x: int = 0, y: int = 1) -> Axes:
        """Plot the points of an orbit, a result of `km.orbit`, in the coordinates with the indices `x` and `y`."""
        _require(trajectory, Trajectory, "an orbit: km.plot.orbit(km.orbit(...))")
        points = np.asarray(trajectory)[:, None]
        return _draw_trajectories(
            Trajectories(trajectory.variables, points, np.array([point.step for point in trajectory])), (x, y)
        )

    def portrait(self, system: Any, *arguments: Any, **options: Any) -> Axes:
        """Draw a portrait; the arguments are those of `km.portrait`."""
        return public_function(plot_orbits, "portrait")(system, *arguments, **options)  # type: ignore[no-any-return]


for _name in (
    "degrees",
    "heights",
    "scan",
    "compare",
    "commute",
    "invariant_curves",
    "rotation",
    "section",
    "escape",
    "orbit",
):
    setattr(Plot, _name, public_function(getattr(Plot, _name), f"plot.{_name}"))


def _axes(figure: Any) -> Axes:
    axes: Axes = figure.axes[0]
    return axes


def _require(value: Any, kind: type, expected: str) -> None:
    if not isinstance(value, kind):
        raise InputError(f"found a {type(value).__name__}, expected {expected}")


def plot_orbits(
    system: SystemLike,
    starts: Any = None,
    eps: Any = None,
    steps: int | None = None,
    *,
    x0: Any = None,
    time_step: Any = None,
    h: Any = None,
    n: int | None = None,
    axes: Sequence[int] = (0, 1),
) -> Axes:
    """Draw float orbits of a map in two coordinates; the command `plot portrait` can add the flow and level curves.

    Args:
        system: a map, or a system, which stands for its Kahan map.
        starts, x0: one initial point or many; by default sixteen around a fixed point, as for `plot portrait`.
        eps: half the time step (exact); None for a map without eps.
        steps, n: the number of steps of each orbit, by default 1000.
        axes: the indices of the two coordinates, counted from 0.
    """
    starts, steps = either(starts=starts, x0=x0), 1000 if (steps := either(steps=steps, n=n)) is None else steps
    real_approximation = as_file(system).real_approximation
    value = real_approximation.at(resolve_eps(eps, time_step, h, floats=True)).eps
    if starts is None:
        starts = automatic_starts(real_approximation.system, value, axes)
    x = start_rows(starts, real_approximation.variables)
    return _draw_trajectories(follow_orbits(ensemble_for(real_approximation.map, value, x, steps), steps), axes)


def _draw_trajectories(trajectories: Trajectories, axes: Sequence[int]) -> Axes:
    from kahanmaps.plots.portraits.portrait import plot_portrait

    if not all(0 <= k < len(trajectories.variables) for k in axes):
        raise InputError(f"found the axes {tuple(axes)}, expected numbers below {len(trajectories.variables)}")
    axis_functions = [point_function(trajectories.variables[k], trajectories.variables) for k in axes]
    return _axes(plot_portrait(portrait_of(trajectories, axis_functions), Style()))


plot = Plot()
