"""A phase portrait as numbers: orbits projected to two or three axes, with a colour for each point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kahanmaps.errors import InputError, quoted
from kahanmaps.maps.floats.doubles import FloatArray
from kahanmaps.plots.curves.level_sets import Levels
from kahanmaps.plots.point_functions import PointFunction
from kahanmaps.plots.portraits.flow import Flow
from kahanmaps.plots.portraits.trajectories import Trajectories
from kahanmaps.plots.portraits.windows import Window, outside, window_of

if TYPE_CHECKING:
    from kahanmaps.plots.drifts.drift_functions import WatchedFunction

_MAX_NEIGHBOURS = 2000  # points: distances are taken pair by pair, and a curve through so many looks smooth
_MIN_NEIGHBOURS = 8
_OF_DEGREE_2 = 0.9  # of the points on a curve; of those of a cloud it is half
# A gap in an orbit that has not filled its curve: in lengths of a usual line, and in diameters of the orbit. Points
# that come in bunches, where the rotation is nearly rational, have long lines as well, but not so long ones.
_LONG, _WIDE = 8.0, 0.2
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
    levels: Levels | None = None
    flow: Flow | None = None
    joined: tuple[NDArray[np.int64] | None, ...] = ()

    def pairs(self, orbit: int) -> NDArray[np.int64]:
        """The pairs (count, 2) of records of an orbit that a line joins."""
        found = self.joined[orbit] if self.joined else None
        steps = np.arange(len(self.points))
        return np.stack([steps[:-1], steps[1:]], axis=1) if found is None else found


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
    steps = np.broadcast_to(np.asarray(found.steps, dtype=np.float64)[:, None], found.points.shape[:2])
    return np.where(np.isnan(found.points).any(axis=2), np.nan, steps)


def neighbours(points: FloatArray) -> NDArray[np.int64] | None:
    """Pairs (count, 2) of rows of `points` (n, dim) that are neighbours on their curve; None where they lie on none.

    Every point is joined to the nearest one, and to the nearest of those on its other side: for points that lie densely
    enough on a smooth curve, in any dimension and with any number of components, that is the curve (Dey and Kumar's
    NN-crust). NaN is passed over, and so is what comes after the first 2000 points.

    >>> turn = 2.4 * np.arange(12)
    >>> pairs = neighbours(np.stack([np.cos(turn), np.sin(turn)], axis=1))
    >>> len(pairs), np.bincount(pairs.ravel()).tolist()
    (12, [2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2])
    """
    rows = np.flatnonzero(~np.isnan(points).any(axis=1))[:_MAX_NEIGHBOURS]
    held = points[rows]
    _, first = np.unique(held.round(12), axis=0, return_index=True)  # a cycle comes to the same points again
    rows, held = rows[np.sort(first)], held[np.sort(first)]
    if len(rows) < _MIN_NEIGHBOURS:
        return None
    squares = (held**2).sum(axis=1)
    products = held @ held.T
    distances = squares[:, None] + squares - 2 * products
    np.fill_diagonal(distances, np.inf)
    own = np.arange(len(rows))
    nearest = distances.argmin(axis=1)
    # (q - p).(r - p) < 0: r is on the other side of p than its nearest neighbour q
    other = products[nearest] - products[own, nearest][:, None] - products + squares[:, None]
    beyond = np.where(other < 0, distances, np.inf)
    opposite = beyond.argmin(axis=1)
    is_there = np.isfinite(beyond[own, opposite])
    pairs = np.concatenate([np.stack([own, nearest], 1), np.stack([own, opposite], 1)[is_there]])
    pairs = np.unique(np.sort(pairs, axis=1), axis=0)
    degrees = np.bincount(pairs.ravel(), minlength=len(rows))
    if (degrees == 2).mean() < _OF_DEGREE_2:
        return None
    lengths = np.linalg.norm(held[pairs[:, 0]] - held[pairs[:, 1]], axis=1)
    longest = max(_LONG * float(np.median(lengths)), _WIDE * float(np.linalg.norm(np.ptp(held, axis=0))))
    return np.asarray(rows[pairs[lengths <= longest]], dtype=np.int64)
