"""The default window and the default projection of a picture."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from kahanmaps.errors import InputError
from kahanmaps.maps.floats.float_conversion import FloatArray

Window = tuple[tuple[float, float], ...]  # (low, high) along each axis

_OUTER_PERCENT = 10.0  # percent of the points at each end that are ignored if some point is far away
_FAR_RATIO = 3.0  # a point is far away if its distance exceeds this multiple of the inner range
_MAX_RATIO, _SHOWN_RATIO = 1e12, 10  # a window beyond 1e12 times the initial coordinates is cut at 10 times these
_MARGIN_RATIO = 0.04  # margin at each end, relative to the length of the range
_MAX_NUMBER = 1e307  # maximal number that matplotlib can subtract
_MAX_POINTS = 4000  # maximal number of points from which axes are chosen
_MAX_VARIABLES = 16  # maximal number of variables from which two or three are chosen as axes
_CELLS_PER_AXIS = {1: 400, 2: 24, 3: 10}  # dimension of the picture -> grid cells along each axis


def window_of(points: FloatArray, starts: FloatArray | None = None) -> Window:
    """Return a window for points (n, d) in which a few points far away are ignored.

    Along each axis the window is the range of all points, widened if its length is 0. The inner range omits a tenth of
    the points, and of `starts`, at each end. If a point is farther from the inner range than three times its length,
    the window is the inner range, extended by at most half its length at each end. If the window exceeds 10^12 times
    the largest coordinate of `starts`, points beyond ten times this coordinate are omitted. NaN is ignored.

    >>> window_of(np.array([[0.0], [1.0]]))
    ((-0.04, 1.04),)
    >>> far = np.append(np.linspace(0, 1, 101), 1e9)[:, None]
    >>> window_of(far)[0][1] < 2
    True
    >>> window_of(10.0 ** np.arange(30)[:, None], np.array([[1.0]]))[0][1] < 11
    True
    """
    initial_points = points[:0] if starts is None else starts
    largest_coordinate = float(np.abs(initial_points[np.isfinite(initial_points)]).max(initial=0))
    window = []
    for column, initial_column in zip(points.T, initial_points.T, strict=True):
        low, high = main_range(column, initial_column)
        if 0 < _MAX_RATIO * largest_coordinate < max(-low, high):
            low, high = main_range(column[np.abs(column) <= _SHOWN_RATIO * largest_coordinate], initial_column)
        unit = max(abs(low), abs(high), np.finfo(float).tiny)  # in this unit nothing overflows
        margin = (high / unit - low / unit) * _MARGIN_RATIO
        window.append(((low / unit - margin) * unit, (high / unit + margin) * unit))
    return tuple(window)


def main_range(values: FloatArray, required: FloatArray | None = None) -> tuple[float, float]:
    """Return the interval of `window_of` for values of one coordinate, without margin; `required` are initial values.

    >>> main_range(np.array([1.0, 2.0, np.nan])), main_range(np.array([5.0]))
    ((1.0, 2.0), (4.5, 5.5))
    """
    values = np.clip(values[np.isfinite(values)], -_MAX_NUMBER, _MAX_NUMBER)
    unit = float(np.abs(values).max(initial=0))
    if unit == 0:
        return -1.0, 1.0
    samples = [values]
    if required is not None and len(required := np.clip(required[np.isfinite(required)], -_MAX_NUMBER, _MAX_NUMBER)):
        samples.append(required)
    # The ends of the inner range, in a unit in which nothing overflows.
    percents = [_OUTER_PERCENT, 100 - _OUTER_PERCENT]
    ranges = [np.percentile(sample, percents, method="nearest") / unit for sample in samples]
    left, right = float(min(first for first, _ in ranges)), float(max(last for _, last in ranges))
    low, high = float(values.min()) / unit, float(values.max()) / unit
    if low < left - _FAR_RATIO * (right - left) or high > right + _FAR_RATIO * (right - left):
        low = max(low, left - (right - left) / 2)
        high = min(high, right + (right - left) / 2)
    if high - low < 1e-9 * max(abs(low), abs(high)):  # values equal up to rounding lie in the middle
        low, high = low - max(abs(low), abs(high)) / 10, high + max(abs(low), abs(high)) / 10
    return low * unit, high * unit


def require_window(numbers: Sequence[float], axes: int) -> Window:
    """Return numbers low, high, low, high, ... as a window. Raises InputError unless low < high for each axis."""
    if len(numbers) != 2 * axes:
        raise InputError(f"found a window of {len(numbers)} numbers, expected {2 * axes}: low and high for each axis")
    window = tuple((float(numbers[2 * k]), float(numbers[2 * k + 1])) for k in range(axes))
    for low, high in window:
        if not -_MAX_NUMBER <= low < high <= _MAX_NUMBER:
            limits = f", and numbers between -{_MAX_NUMBER:g} and {_MAX_NUMBER:g}" if low < high else ""
            raise InputError(f"found the window {low:g} to {high:g}, expected low < high{limits}")
    return window


def is_inside(points: FloatArray, window: Window) -> NDArray[np.bool_]:
    """Return an array (...) of booleans: whether each of the points (..., d) lies in the window; False for NaN."""
    low, high = (np.array(side) for side in zip(*window, strict=True))
    return np.asarray(((points >= low) & (points <= high)).all(axis=-1))


def count_outside(points: FloatArray, window: Window) -> int:
    """Return the number of points (n, d) outside of the window; points with NaN are not counted."""
    return int((~np.isnan(points).any(axis=1) & ~is_inside(points, window)).sum())


def fullest_axes(points: FloatArray, count: int) -> tuple[int, ...]:
    """Return the increasing indices of `count` variables, those along which the points (n, dim) are spread most.

    Each variable is scaled to its own window. The choice maximizes the number of grid boxes that contain a point; of
    equal choices the first is taken. If there are more than 16 variables, only the first 16 that vary are compared.

    >>> t = np.linspace(0, 6, 200)
    >>> fullest_axes(np.stack([t, t, 0 * t, np.sin(5 * t)], axis=1), 2)
    (0, 3)
    """
    dim = points.shape[1]
    if dim <= count:
        return tuple(range(dim))
    points = points[~np.isnan(points).any(axis=1)]
    if not len(points):
        return tuple(range(count))
    points = points[np.linspace(0, len(points) - 1, min(len(points), _MAX_POINTS)).astype(int)]
    cells = _CELLS_PER_AXIS[count]
    with np.errstate(all="ignore"):
        low, high = np.array(window_of(points)).T
        boxes = np.clip(np.nan_to_num((points - low) / (high - low) * cells), 0, cells - 1).astype(int).T
    varying = [k for k in range(dim) if boxes[k].min() != boxes[k].max()]
    candidates = (varying + [k for k in range(dim) if k not in varying])[: max(count, min(_MAX_VARIABLES, dim))]

    def count_boxes(axes: tuple[int, ...]) -> int:
        return len(np.unique(sum(boxes[k] * cells**position for position, k in enumerate(axes))))

    return max(combinations(sorted(candidates), count), key=count_boxes)
