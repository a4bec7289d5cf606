"""How often orbits visit each cell of a window: counted portion by portion, however many points there are."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kahanmaps.errors import InputError
from kahanmaps.maps.floats.doubles import FloatArray
from kahanmaps.plots.point_functions import PointFunction
from kahanmaps.plots.portraits.windows import Window

MAX_CELLS = 16_000_000
_AT_ONCE = 1 << 18  # points, so that what is worked on stays in the processor's caches


@dataclass(frozen=True, eq=False)
class Density:
    """Points counted in cells: `counts` (rows, columns), the first row lowest; `outside` those not in the window."""

    labels: tuple[str, str]
    window: Window
    counts: NDArray[np.int64]
    points: int
    outside: int


def density_of(
    portions: Iterable[FloatArray],
    axes: Sequence[PointFunction],
    window: Window,
    shape: tuple[int, int],
    progress: Callable[[int], None] | None = None,
) -> Density:
    """Count the points of portions (..., dim) in a grid of `shape` (rows, columns) cells; NaN is not counted.

    Needs the memory of one portion and of the grid; `progress` is called with the number of points so far. Raises
    InputError unless there are two axes, and for grids of more than 16 million cells.

    >>> from kahanmaps.plots.point_functions import point_function
    >>> axes = [point_function(name, "xy") for name in "xy"]
    >>> square = np.array([[0.1, 0.1], [0.9, 0.9], [0.2, 0.3], [7.0, 0.0]])
    >>> found = density_of([square], axes, ((0, 1), (0, 1)), (2, 2))
    >>> found.counts.tolist(), found.points, found.outside
    ([[2, 0], [0, 1]], 4, 1)
    """
    rows, columns = shape
    if len(axes) != 2 or len(window) != 2:
        raise InputError(f"found {len(axes)} axes, expected 2: a density is counted in a plane")
    if rows < 1 or columns < 1 or rows * columns > MAX_CELLS:
        raise InputError(f"found a grid of {rows} x {columns} cells, expected at most {MAX_CELLS}")
    counts = np.zeros(rows * columns, dtype=np.int64)
    gone = seen = 0
    for portion in portions:
        points = portion.reshape(-1, portion.shape[-1])
        for first in range(0, len(points), _AT_ONCE):
            part = points[first : first + _AT_ONCE]
            x, y = axes[0](part), axes[1](part)
            there, cells = _cells(x, y, window, rows, columns)
            gone += len(part) - there
            counts += np.bincount(cells, minlength=len(counts))
        seen += len(points)
        if progress is not None:
            progress(seen)
    inside = int(counts.sum())
    labels = (axes[0].label, axes[1].label)
    return Density(labels, window, counts.reshape(rows, columns), seen - gone, seen - gone - inside)


def _cells(x: FloatArray, y: FloatArray, window: Window, rows: int, columns: int) -> tuple[int, NDArray[np.int64]]:
    """How many points are no NaN, and the cells of those in the window."""
    (x0, x1), (y0, y1) = window
    there = len(x) - int((np.isnan(x) | np.isnan(y)).sum())
    inside = (x >= x0) & (x <= x1) & (y >= y0) & (y <= y1)
    x, y = x[inside], y[inside]
    column = np.minimum(((x - x0) * (columns / (x1 - x0))).astype(np.int64), columns - 1)
    row = np.minimum(((y - y0) * (rows / (y1 - y0))).astype(np.int64), rows - 1)
    return there, row * columns + column
