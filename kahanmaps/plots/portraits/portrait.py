"""A phase portrait as numbers: orbits projected to two or three axes, with a colour for each point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kahanmaps.errors import InputError, quoted
from kahanmaps.maps.floats.doubles import FloatArray
from kahanmaps.plots.curves.level_sets import LevelCurves
from kahanmaps.plots.point_functions import PointFunction
from kahanmaps.plots.portraits.flow import Flow
from kahanmaps.plots.portraits.neighbours import neighbours
from kahanmaps.plots.portraits.trajectories import Trajectories
from kahanmaps.plots.portraits.windows import Window, outside, window_of

if TYPE_CHECKING:
    from kahanmaps.plots.drifts.drift_functions import WatchedFunction

STEP = "step"
ORBIT = "orbit"


@dataclass(frozen=True, eq=False)
class Portrait:
    """What a portrait shows.

    `points` (records, orbits, 2 or 3) are the coordinates along the axes, NaN where there is no point; `labels` and
    `window` are one for each axis. `values` (records, orbits) colour the points by `value_label`; None is by orbit.
    `left_out` counts the points outside the window, `undefined` those of living orbits where an axis or the colour has
    a pole. `euler` are points (records, orbits, 2 or 3) of explicit Euler, `levels` curves and `flow` what is drawn of
    the differential equation, below the points. `joined` are, for each orbit, pairs (count, 2) of records that are
    neighbours on its curve; successive ones where it is None.
    """

    points: FloatArray
    labels: tuple[str, ...]
    window: Window
    values: FloatArray | None = None
    value_label: str = ""
    left_out: int = 0
    undefined: int = 0
    euler: FloatArray | None = None
    levels: LevelCurves | None = None
    flow: Flow | None = None
    joined: tuple[NDArray[np.int64] | None, ...] = ()

    def pairs(self, orbit: int) -> NDArray[np.int64]:
        """The pairs (count, 2) of records of an orbit that a line joins."""
        found = self.joined[orbit] if self.joined else None
        return (
            np.stack([np.arange(len(self.points) - 1), np.arange(1, len(self.points))], 1) if found is None else found
        )


def portrait_of(
    found: Trajectories,
    axes: Sequence[PointFunction | str],
    *,
    colour: WatchedFunction | str = ORBIT,
    window: Window | None = None,
    euler: Trajectories | None = None,
    join: bool = False,
) -> Portrait:
    """Project orbits to two or three axes: functions of the point, or the word "step".

    `colour` is "orbit", "step" or a function of the point; the window is chosen if none is given. `join` looks for the
    neighbours of each point on the curve of its orbit, unless an axis is the step. Raises InputError for another number
    of axes.

    >>> from kahanmaps.plots.point_functions import point_function
    >>> found = Trajectories(("x",), np.array([[[1.0]], [[3.0]]]), np.arange(2))
    >>> portrait_of(found, ["step", point_function("x", ["x"])]).points[:, 0].tolist()
    [[0.0, 1.0], [1.0, 3.0]]
    """
    if len(axes) not in (2, 3):
        raise InputError(f"found {len(axes)} axes, expected 2 or 3")
    points = _projected(found, axes)
    values, label = None, ""
    if not isinstance(colour, str):
        flat = colour(found.points.reshape(-1, found.points.shape[2]))
        values, label = flat.reshape(found.points.shape[:2]), colour.label
    elif colour == STEP:
        values, label = _steps(found), STEP
    elif colour != ORBIT:
        raise InputError(f"found the colour {quoted(colour)}, expected orbit, step or a function")
    there = ~np.isnan(found.points).any(axis=2)
    shown = ~np.isnan(points).any(axis=2)
    if values is not None:
        shown &= ~np.isnan(values)
    points = np.where(np.asarray(shown)[..., None], points, np.nan)
    flat = points.reshape(-1, len(axes))
    chosen = window or window_of(flat, points[0])
    return Portrait(
        points,
        tuple(axis if isinstance(axis, str) else axis.label for axis in axes),
        chosen,
        values,
        label,
        left_out=outside(flat, chosen),
        undefined=int(there.sum() - shown.sum()),
        euler=None if euler is None else _projected(euler, axes),
        joined=tuple(map(neighbours, found.points.swapaxes(0, 1))) if join and STEP not in axes else (),
    )


def _projected(found: Trajectories, axes: Sequence[PointFunction | str]) -> FloatArray:
    return np.stack([_steps(found) if isinstance(axis, str) else axis(found.points) for axis in axes], axis=-1)


def _steps(found: Trajectories) -> FloatArray:
    steps: FloatArray = np.where(
        np.isnan(found.points).any(axis=2), np.nan, np.asarray(found.steps, dtype=np.float64)[:, None]
    )
    return steps
