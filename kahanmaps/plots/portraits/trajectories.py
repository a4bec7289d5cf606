"""Float orbits for pictures: of a map, or of the explicit Euler method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from kahanmaps.documents.files import SystemFile, float_normal_form
from kahanmaps.errors import InputError
from kahanmaps.family.planar import NormalForm
from kahanmaps.family.system_normal_form import NoNormalForm
from kahanmaps.maps.floats.ensemble import FloatEnsemble
from kahanmaps.maps.floats.float_conversion import FloatArray
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.maps.kahan import KahanFamily
from kahanmaps.maps.orbits.iteration import require_steps
from kahanmaps.systems.quadratic import QuadraticSystem

MAX_POINTS = 4_000_000  # maximal number of points of all orbits together: more would be indistinguishable in a picture
_MAX_COORDINATES = 40_000_000  # maximal number of coordinates of all points together
# Maximal work and maximal number of steps for which numpy is faster than loading compiled code.
_MAX_NUMPY_WORK, _MAX_NUMPY_STEPS = 10_000_000, 20_000


@dataclass(frozen=True, eq=False)
class Trajectories:
    """Several orbits: `points` (records, orbits, dim), NaN after the end of an orbit, at `steps` (records,).

    `ended` maps each reason why orbits ended early, a phrase to follow "an orbit", to the number of these orbits.
    """

    variables: tuple[str, ...]
    points: FloatArray
    steps: NDArray[Any]
    ended: dict[str, int] = field(default_factory=dict)

    @property
    def orbits(self) -> int:
        """The number of orbits."""
        return int(self.points.shape[1])


def ensemble_for(
    system_or_map: QuadraticSystem | MapFamily,
    eps: Any,
    starts: FloatArray,
    steps: int,
    *,
    backward: bool = False,
    form: NormalForm | None = None,
    radius: float | None = None,
) -> FloatEnsemble:
    """Return an ensemble of orbits from `starts` (n, dim), with the faster kernel; eps is half the time step."""
    work = len(starts) * steps * (1 + system_or_map.dim**3 // 8)
    kernel = "numpy" if work < _MAX_NUMPY_WORK and steps < _MAX_NUMPY_STEPS else None
    return FloatEnsemble(system_or_map, eps, starts, backward=backward, form=form, kernel=kernel, radius=radius)


def field_of(file: SystemFile) -> QuadraticSystem | None:
    """Return the vector field of a file, with rational approximations of algebraic parameters; None if it has none."""
    map_ = file.map.real_approximation
    return map_.system if isinstance(map_, KahanFamily) and not map_.system.symbols else None


def ensemble_of_file(
    file: SystemFile, eps: fmpq | None, starts: FloatArray, steps: int, *, backward: bool = False
) -> FloatEnsemble:
    """Return the ensemble for the map of a file, in normal form if it has one; `eps` is None for a map without eps."""
    normal_form = float_normal_form(file)
    form = None if isinstance(normal_form, NoNormalForm) else normal_form.form
    return ensemble_for(file.map, fmpq(1) if eps is None else eps, starts, steps, backward=backward, form=form)


def follow_orbits(ensemble: FloatEnsemble, steps: int, progress: Callable[[int], None] | None = None) -> Trajectories:
    """Take `steps` steps, and return all points of the orbits. Raises InputError for more than MAX_POINTS points.

    >>> system = QuadraticSystem.from_text(["x"], ["x"])
    >>> result = follow_orbits(ensemble_for(system, "1/2", np.array([[1.0], [2.0]]), 2), 2)
    >>> result.points[:, :, 0].tolist(), result.ended
    ([[1.0, 2.0], [3.0, 6.0], [9.0, 18.0]], {})
    """
    require_steps(steps)
    bound = min(MAX_POINTS, _MAX_COORDINATES // ensemble.system.dim)
    if (steps + 1) * ensemble.n > bound:
        request = f"{steps} steps of {ensemble.n} orbits"
        raise InputError(f"found {request}, expected at most {bound} points: use fewer steps")
    points = np.concatenate(list(ensemble.records(steps, 1, progress=progress)))
    texts = {"overflow": "left the range of floating-point numbers", "singular": "met a singular matrix I - eps f'"}
    ended = {text: int((ensemble.status == status).sum()) for status, text in texts.items()}
    return Trajectories(
        ensemble.system.variables,
        points,
        np.arange(len(points)),
        {text: count for text, count in ended.items() if count},
    )
