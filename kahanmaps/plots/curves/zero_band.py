"""A logarithmic axis on which an exact zero has a place: a grey band at the bottom, marked 0."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from kahanmaps.plots.figures import beside

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_BAND = "#e8e8e8"
_SHARE = 0.09  # of the height
_MOST_TICKS = 6


def log_scale_with_zero(axes: Axes, least: float, largest: float, has_zeros: bool) -> float | None:
    """Make the vertical axis logarithmic for positive values from `least` to `largest`; gives the height for zeros.

    Zeros are drawn at that height, inside the band. None where there are no zeros: then there is no band.
    """
    axes.set_yscale("log")
    low, high = math.log10(least), math.log10(largest)
    margin = max(0.04 * (high - low), 0.1)
    low, high = low - margin, high + margin
    if not has_zeros:
        axes.set_ylim(10**low, 10**high)
        return None
    from matplotlib.ticker import FixedLocator, NullLocator

    below = low - _SHARE / (1 - _SHARE) * (high - low)
    zero = 10 ** ((below + low) / 2)
    axes.set_ylim(10**below, 10**high)
    axes.axhspan(10**below, 10**low, color=_BAND, linewidth=0, zorder=0)
    powers = range(math.ceil(low), math.floor(high) + 1)
    every = max(1, -(-len(powers) // _MOST_TICKS))
    # Ticks of powers stop above the band, where the scale means nothing.
    axes.yaxis.set_major_locator(FixedLocator([10.0**k for k in powers[::every]]))
    axes.yaxis.set_minor_locator(NullLocator())
    where = ("axes fraction", "data")
    beside(axes, "0", (0, zero), (-3, 0), xycoords=where, ha="right", va="center", fontsize="small")
    return zero
