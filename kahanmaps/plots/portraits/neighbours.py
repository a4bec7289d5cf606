"""Which points of an orbit are neighbours on the curve that it fills.

Every point is joined to the nearest one, and to the nearest of those on its other side: for points that lie densely
enough on a smooth curve, in any dimension and with any number of components, that is the curve (Dey and Kumar's
NN-crust).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kahanmaps.maps.floats.doubles import FloatArray

MOST = 2000  # points: distances are taken pair by pair, and a curve through so many looks smooth
_FEWEST = 8
_OF_DEGREE_2 = 0.9  # of the points on a curve; of those of a cloud it is half
# A gap in an orbit that has not filled its curve: in lengths of a usual line, and in diameters of the orbit. Points
# that come in bunches, where the rotation is nearly rational, have long lines as well, but not so long ones.
_LONG, _WIDE = 8.0, 0.2


def neighbours(points: FloatArray) -> NDArray[np.int64] | None:
    """Pairs (count, 2) of rows of `points` (n, dim) to be joined; None where points do not lie on a curve.

    NaN is passed over, and so is what comes after the first 2000 points.

    >>> turn = 2.4 * np.arange(12)
    >>> pairs = neighbours(np.stack([np.cos(turn), np.sin(turn)], axis=1))
    >>> len(pairs), np.bincount(pairs.ravel()).tolist()
    (12, [2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 2])
    """
    rows = np.flatnonzero(~np.isnan(points).any(axis=1))[:MOST]
    held = points[rows]
    _, first = np.unique(held.round(12), axis=0, return_index=True)  # a cycle comes to the same points again
    rows, held = rows[np.sort(first)], held[np.sort(first)]
    if len(rows) < _FEWEST:
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
