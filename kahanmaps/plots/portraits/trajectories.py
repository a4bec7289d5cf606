"""Float orbits to be drawn, and those of explicit Euler to compare them with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from kahanmaps.algebra.fields import rational
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError
from kahanmaps.family.planar import NormalForm
from kahanmaps.family.system_normal_form import NoNormalForm
from kahanmaps.maps.floats.classical import VectorField
from kahanmaps.maps.floats.ensemble import FloatEnsemble
from kahanmaps.maps.floats.float_conversion import FloatArray, to_float
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.maps.kahan import KahanFamily
from kahanmaps.maps.orbits.iteration import require_steps
from kahanmaps.systems.quadratic import QuadraticSystem

MAX_POINTS = 4_000_000  # of all orbits together: beyond that a picture of single points shows nothing more
_MAX_NUMBERS = 40_000_000
# Up to this work and number of steps, numpy finishes before compiled code is loaded.
_LITTLE_WORK, _FEW_STEPS = 10_000_000, 20_000


@dataclass(frozen=True, eq=False)
class Trajectories:
    """Orbits side by side: `points` (records, orbits, dim), NaN where an orbit has ended; `steps` (records,).

    `ended` says how many orbits ended early and why, in words.
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
    given: QuadraticSystem | MapFamily,
    eps: Any,
    starts: FloatArray,
    steps: int,
    *,
    backward: bool = False,
    form: NormalForm | None = None,
) -> FloatEnsemble:
    """The ensemble that walks these starts (n, dim), by the kernel that is done first; eps is half the time step."""
    work = len(starts) * steps * (1 + given.dim**3 // 8)
    kernel = "numpy" if work < _LITTLE_WORK and steps < _FEW_STEPS else None
    return FloatEnsemble(given, eps, starts, backward=backward, form=form, kernel=kernel)


def field_of(file: SystemFile) -> QuadraticSystem | None:
    """The vector field whose Kahan map a file has, real approximations for algebraic parameters; None without one."""
    map_ = file.map.real_approximation
    return map_.system if isinstance(map_, KahanFamily) and not map_.system.symbols else None


def float_normal_form(file: SystemFile) -> tuple[NormalForm | None, str]:
    """The normal form in which floats can step, or None and why there is none."""
    form = file.normal_form
    if isinstance(form, NoNormalForm):
        return None, form.reason
    if form.T is not None:
        return None, "in floating point only J = [[0, I], [-I, 0]] has one"
    return form.form, ""


def ensemble_of_file(
    file: SystemFile, eps: fmpq | None, starts: FloatArray, steps: int, *, backward: bool = False
) -> FloatEnsemble:
    """The ensemble for the map of a file, in its normal form where it has one; `eps` is None for a map without it."""
    form, _ = float_normal_form(file)
    return ensemble_for(file.map, fmpq(1) if eps is None else eps, starts, steps, backward=backward, form=form)


def walked(ensemble: FloatEnsemble, steps: int, progress: Callable[[int], None] | None = None) -> Trajectories:
    """Take `steps` steps and keep every point. Raises InputError for more than MAX_POINTS points.

    >>> system = QuadraticSystem.from_text(["x"], ["x"])
    >>> result = walked(ensemble_for(system, "1/2", np.array([[1.0], [2.0]]), 2), 2)
    >>> result.points[:, :, 0].tolist(), result.ended
    ([[1.0, 2.0], [3.0, 6.0], [9.0, 18.0]], {})
    """
    require_steps(steps)
    most = min(MAX_POINTS, _MAX_NUMBERS // ensemble.system.dim)
    if (steps + 1) * ensemble.n > most:
        raise InputError(f"found {steps} steps of {ensemble.n} orbits, expected at most {most} points: use fewer steps")
    points = np.concatenate(list(ensemble.records(steps, 1, progress=progress)))
    words = {"overflow": "left the range of floating-point numbers", "singular": "met a singular matrix I - eps f'"}
    ended = {text: int((ensemble.status == status).sum()) for status, text in words.items()}
    return Trajectories(
        ensemble.system.variables,
        points,
        np.arange(len(points)),
        {text: count for text, count in ended.items() if count},
    )


def euler_orbits(system: QuadraticSystem, eps: Any, starts: FloatArray, steps: int) -> Trajectories:
    """Compute orbits of the explicit Euler method, x~ = x + 2 eps f(x), in doubles; NaN after leaving their range.

    `starts` (n, dim) are doubles, eps is exact, half the time step; a negative one steps backward.

    >>> euler_orbits(QuadraticSystem.from_text(["x"], ["x"]), "1/2", np.array([[1.0]]), 2).points[:, 0, 0].tolist()
    [1.0, 2.0, 4.0]
    """
    require_steps(steps)
    f, h = VectorField(system), to_float(2 * rational(eps))
    points = [np.array(starts, dtype=np.float64)]
    with np.errstate(all="ignore"):
        for _ in range(steps):
            points.append(points[-1] + h * f(points[-1]))
    orbits = np.array(points)
    orbits[~np.isfinite(orbits).all(axis=2)] = np.nan
    gone = int(np.isnan(orbits[-1]).any(axis=1).sum())
    ended = {"left the range of floating-point numbers": gone} if gone else {}
    return Trajectories(system.variables, orbits, np.arange(steps + 1), ended)
