"""Starts for a picture of a system of which nothing else is known: around an equilibrium, as far out as orbits stay."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from kahanmaps.maps.floats.doubles import FloatArray
from kahanmaps.plots.portraits.flow import equilibria
from kahanmaps.plots.portraits.trajectories import ensemble_for
from kahanmaps.systems.quadratic import QuadraticSystem

COUNT = 16
_CENTRES = 4  # equilibria tried
_SIZES = 24
_SHRINK = 0.8
_STEPS = 300
_GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))
_FAR = 4.0  # an orbit stays if it is never farther from the centre than so many times the largest start


def automatic_starts(
    system: QuadraticSystem, eps: Any, plane: Sequence[int] = (0, 1), *, backward: bool = False
) -> FloatArray:
    """Sixteen starts (16, dim) which make a good picture, the same ones every time; eps is half the time step.

    Around an equilibrium, the most stable one that is found: on a ray in the plane of these two variables, or where
    the field is homogeneous (and points of a ray move alike) on a circle; other coordinates are moved a little. They
    are as far out as all their orbits stay nearby for 300 steps.

    >>> lotka_volterra = QuadraticSystem.from_text(["x", "y"], ["x - x*y", "x*y - y"])
    >>> starts = automatic_starts(lotka_volterra, "1/20")
    >>> starts.shape, bool((starts > 1).all())
    ((16, 2), True)
    """
    plane = [index for index in plane if index < system.dim][:2]
    # Equilibria, those first at which the field expands least, then those without negative coordinates; the origin.
    order = sorted(equilibria(system), key=lambda one: (one.expansion, bool((one.point < 0).any())))
    centres = [one.point for one in order[:_CENTRES]]
    if all(centre.any() for centre in centres):
        centres.append(np.zeros(system.dim))
    others = [index for index in range(system.dim) if index not in plane]
    found: list[tuple[int, FloatArray]] = []
    for centre in centres:
        # Around the origin of a homogeneous field a smaller size is only a slower motion.
        is_scaled = system.is_homogeneous and not centre.any()
        for k in range(1 if is_scaled else _SIZES):
            size = (3 * float(np.abs(centre[plane]).max()) or 1.5) * _SHRINK**k
            starts = np.tile(centre, (COUNT, 1))
            if is_scaled and len(plane) == 2:
                angles = (np.arange(COUNT) + 0.5) * _GOLDEN_ANGLE  # so that no symmetry takes one start to another
                starts[:, plane] += size * np.stack([np.cos(angles), np.sin(angles)], axis=1)
                starts[:, others] += size / 5
            else:
                shares = np.arange(1, COUNT + 1) / COUNT * size
                for index, part in zip(plane, (1.0, 0.25), strict=False):
                    starts[:, index] += part * shares
                for place, index in enumerate(others):
                    starts[:, index] += shares / (4 + place)
            ensemble = ensemble_for(system, eps, starts, _STEPS, backward=backward)
            points = np.concatenate(list(ensemble.records(_STEPS, 1)))
            with np.errstate(all="ignore"):
                distance = np.abs(points - centre).max(axis=2)
                moves = np.abs(points[-1] - starts).max(axis=1) > 1e-9 * np.abs(starts).max()
            stays = (distance <= _FAR * np.abs(starts - centre).max()).all(axis=0)
            if (stays & moves).all():
                return starts
            found.append((int((stays & moves).sum()), starts))
    return max(found, key=lambda one: one[0])[1]
