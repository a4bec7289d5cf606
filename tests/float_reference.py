"""The Kahan map in doubles by LAPACK: an implementation of its own, with which the kernels are compared."""

from __future__ import annotations

from typing import Any

import numpy as np

from kahanmaps.algebra.fields import rational
from kahanmaps.errors import InputError
from kahanmaps.maps.floats.doubles import FloatArray, exact, to_float, to_floats
from kahanmaps.systems.quadratic import QuadraticSystem


class FloatKahanMap:
    """Phi(., eps) in double precision, one linear solve by LAPACK a step; the time step is 2 eps."""

    def __init__(self, system: QuadraticSystem, eps: Any) -> None:
        n = system.dim
        self.system = system
        self.eps = to_float(rational(eps))
        if self.eps == 0.0:
            raise InputError("eps is 0 in machine numbers, and the Kahan map the identity: take a larger eps")
        forms = [2 * entry for form in system.Q for entry in form.entries()]
        with np.errstate(all="ignore"):
            self._tensor = to_floats(forms).reshape(n, n, n) * self.eps
            self._linear = to_floats(system.B.entries()).reshape(n, n) * self.eps
            self._constant = to_floats(system.c) * (2 * self.eps)
        if not all(np.isfinite(part).all() for part in (self._tensor, self._linear, self._constant)):
            raise InputError("eps times a coefficient leaves the range of machine floats: use exact arithmetic")
        self._identity = np.eye(n)

    @property
    def inverse(self) -> FloatKahanMap:
        """The inverse map, Phi(., -eps)."""
        return FloatKahanMap(self.system, exact(-self.eps))

    def step(self, x: FloatArray) -> FloatArray | None:
        """The image, or None where the matrix I - eps f'(x) is singular in machine numbers."""
        matrix = self._identity - self._tensor @ x - self._linear
        right = x + self._linear @ x + self._constant
        try:
            image: FloatArray = np.linalg.solve(matrix, right).astype(np.float64, copy=False)
            return image
        except np.linalg.LinAlgError:
            return None
