"""Which part of a plane is drawn: a window around most of the dots, or all of the projective plane as a disc."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from kahanmaps.plots.curves.invariant_curves import InvariantPlane
from kahanmaps.plots.curves.level_sets import zero_curves
from kahanmaps.plots.curves.plane_cubics import Floats, PlaneCubic
from kahanmaps.plots.curves.symmetric_planes import THREE_LINES
from kahanmaps.plots.portraits.windows import Window, outside, window_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Cloud = tuple[Floats, Floats]

_SHARE = 0.85  # of the dots: orbits come close to infinity again and again
_CUT = 0.7390851  # a direction in which no nice form is zero
_MARGIN = 0.08  # of the width, on either side, for the numbers beside the dots


@dataclass(frozen=True)
class Rectangle:
    """A window of the plane, and how many dots lie outside it."""

    window: Window
    outside: int

    @classmethod
    def of(cls, clouds: Sequence[Cloud], window: Window) -> Rectangle:
        """This window, for these dots."""
        return cls(window, outside(np.concatenate([_rows(cloud) for cloud in clouds]), window))

    @classmethod
    def around(cls, clouds: Sequence[Cloud]) -> Rectangle:
        """Where most dots are, all starts among them."""
        points, starts = (
            np.concatenate(rows) for rows in zip(*((_rows(c), _rows(c)[:1]) for c in clouds), strict=True)
        )
        sizes = np.hypot(*points.T)
        most = np.quantile(sizes, _SHARE, method="higher")
        return cls.of(clouds, window_of(points[sizes <= most] if sizes.max() > 2 * most else points, starts))

    @property
    def stretch(self) -> float:
        """How much longer a unit upwards appears than one to the right, inverted: what normals are scaled by."""
        (left, right), (low, high) = self.window
        return (high - low) / (right - left)

    def prepare(self, axes: Axes, names: tuple[str, str]) -> None:
        """Limits and labels of the axes, which become a square."""
        axes.set_box_aspect(1)
        axes.set(xlim=self.window[0], ylim=self.window[1], xlabel=names[0], ylabel=names[1])
        axes.locator_params(nbins=5)

    def place(self, x: Floats, y: Floats) -> Cloud:
        """Where points are drawn."""
        return x, y

    def curves(self, cubic: PlaneCubic) -> tuple[Floats, ...]:
        """The pieces (n, 2) of a curve, as they are drawn."""
        return zero_curves(cubic.value, self.window)


@dataclass(frozen=True)
class Disc:
    """The projective plane as half a sphere seen from above, infinity as its rim; `length` is that of 45 degrees."""

    length: float
    stretch: float = 1.0

    @classmethod
    def of(cls, plane: InvariantPlane, column: str = "uv") -> Disc:
        """The disc on whose circle of radius 1/sqrt(2) the map goes to infinity; by the dots, if there is none."""
        cubic = plane.orbits[0].cubic
        if cubic is not None and plane.shape != "0":
            return cls(cubic.length)
        sizes = np.concatenate([np.hypot(x, y) for x, y in clouds_of(plane, column)])
        return cls(float(np.median(sizes)) or 1.0)

    def prepare(self, axes: Axes, names: tuple[str, str]) -> None:
        """The rim, and no axes."""
        from matplotlib.patches import Circle

        axes.set_aspect("equal")
        label = f"({names[0]} : {names[1]} : 1)"
        axes.set(xlim=(-1.03, 1.03), ylim=(-1.03, 1.03), xticks=[], yticks=[], frame_on=False, xlabel=label)
        axes.add_patch(Circle((0, 0), 1, fill=False, linewidth=0.6, zorder=1))

    def place(self, x: Floats, y: Floats) -> Cloud:
        """Where points are drawn."""
        x, y = x / self.length, y / self.length
        radius = np.hypot(np.hypot(x, y), 1)
        return x / radius, y / radius

    def curves(self, cubic: PlaneCubic) -> tuple[Floats, ...]:
        """The pieces (n, 2) of a curve, as they are drawn, from the rim to itself or closed."""
        turn = ((_CUT, _CUT + 2 * np.pi), (0.0, np.pi / 2))
        pieces = zero_curves(lambda angles: cubic.value_in_space(angles, self.length), turn)
        return tuple(
            np.sin(rows[:, 1:]) * np.stack([np.cos(rows[:, 0]), np.sin(rows[:, 0])], axis=1) for rows in pieces
        )


def _rows(cloud: Cloud) -> Floats:
    return np.stack(cloud, axis=1)


def clouds_of(plane: InvariantPlane, column: str = "uv") -> list[Cloud]:
    """The dots of every orbit: (u, v), or in a complex plane the real and imaginary parts of the column "u" or "v"."""
    if plane.is_real:
        return [(orbit.u, orbit.v) for orbit in plane.orbits]
    values = [orbit.u if column == "u" else orbit.v for orbit in plane.orbits]
    return [(value.real, value.imag) for value in values]


def view_of(plane: InvariantPlane, column: str = "uv") -> Rectangle:
    """What is shown of a plane: where most dots are and, unless it is far away, the origin.

    The origin is in the middle, and scales are equal along u and v, where the cubic has its threefold symmetry.
    """
    clouds = clouds_of(plane, column)
    ranges = []
    for low, high in Rectangle.around(clouds).window:
        middle, half = (low + high) / 2, (high - low) / 2
        ranges.append((min(low, -0.1 * half), max(high, 0.1 * half)) if abs(middle) <= 3 * half else (low, high))
    if plane.shape == THREE_LINES and all(low <= 0 <= high for low, high in ranges):
        reach = max(max(abs(low), abs(high)) for low, high in ranges)
        ranges = [(-reach, reach), (-reach, reach)]
    margins = [_MARGIN * (high - low) for low, high in ranges]
    window = tuple((low - more, high + more) for (low, high), more in zip(ranges, margins, strict=True))
    return Rectangle.of(clouds, window)
