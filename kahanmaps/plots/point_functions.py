"""Functions that pictures evaluate in floating point at many points at once: coordinates, integrals, expressions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.parsing import is_name, parse_rational_function
from kahanmaps.algebra.polynomials import RationalFunction, evaluate
from kahanmaps.display.latex import latex_polynomial
from kahanmaps.errors import InputError
from kahanmaps.maps.floats.float_conversion import FloatArray, to_float
from kahanmaps.maps.floats.float_orbit import FLOATS
from kahanmaps.plots.figures import escape_dollars, label_of

ZERO = fmpq(0)
_MAX_FORMULA = 60  # maximal number of characters of a formula as the label of an axis


@dataclass(frozen=True, eq=False)
class PointFunction:
    """A rational function of the variables and eps (in this order), evaluated in doubles.

    `name` is the name of the function in output; `eps` (exact, half the time step) is the value of the last argument.

    >>> radius = point_function("x^2 + y^2", ["x", "y"])
    >>> radius(np.array([[3.0, 4.0], [np.nan, 0.0]]))
    array([25., nan])
    """

    name: str
    function: RationalFunction
    eps: fmpq = ZERO
    of_arrays: ClassVar[bool] = True  # ensembles may call it with arrays of points

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the values at points (..., dim), an array (...); NaN at poles and where a value overflows."""
        variable = self.variable
        if variable is not None:
            return np.array(points[..., variable], dtype=np.float64)
        numerator, denominator = self.numerator_and_denominator(points)
        with np.errstate(all="ignore"):
            values = numerator / denominator
        return np.where(np.isfinite(values), values, np.nan)

    def at(self, point: Sequence[fmpq]) -> fmpq | None:
        """Return the exact value of the function at a rational point; None at a pole."""
        value: fmpq | None = self.function.value(QQ, [*point, self.eps])
        return value

    def numerator_and_denominator(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the values of numerator and denominator of the function at points (..., dim), as two arrays (...)."""
        with np.errstate(all="ignore"):
            return self._value(self.function.numerator, points), self._value(self.function.denominator, points)

    @property
    def variable(self) -> int | None:
        """The index i if the function is the variable x_i; None for any other function."""
        if not self.function.denominator.is_one():
            return None
        for index, generator in enumerate(self.function.numerator.context().gens()[:-1]):
            if self.function.numerator == generator:
                return index
        return None

    @property
    def label(self) -> str:
        """The name as a label in a picture; a short formula is typeset."""
        if is_name(self.name) or not self.function.denominator.is_one():
            return label_of(self.name)
        formula = latex_polynomial(self.function.numerator)
        return f"${formula}$" if len(formula) <= _MAX_FORMULA and "mathrm" not in formula else escape_dollars(self.name)

    def _value(self, polynomial: fmpq_mpoly, points: FloatArray) -> FloatArray:
        coordinates = [*np.moveaxis(points, -1, 0), to_float(self.eps)]
        value = np.asarray(evaluate(polynomial, FLOATS, coordinates), dtype=np.float64)
        values: FloatArray = np.array(np.broadcast_to(value, points.shape[:-1]))
        values[np.isnan(points).any(axis=-1)] = np.nan  # also for a constant function
        return values


def point_function(
    text: str,
    variables: Sequence[str],
    eps: fmpq | None = None,
    parameters: Mapping[str, fmpq] | None = None,
    known_functions: Mapping[str, RationalFunction] | None = None,
) -> PointFunction:
    """Return the function that `text` denotes: a known function, or an expression in variables, eps and parameters.

    `known_functions` maps names to rational functions of the variables and eps, in this order. Without `eps` (exact,
    half the time step) an expression must not contain eps. Raises InputError for an invalid text.

    >>> point_function("(x - eps)/y", ["x", "y"], fmpq(1, 2))(np.array([2.5, 4.0]))
    array(0.5)
    """
    names = (*variables, "eps")
    function = (known_functions or {}).get(text)
    if function is None:
        if is_name(text) and text not in (*names, *(parameters or {})):
            integrals = f"; integrals are named {', '.join(known_functions)}" if known_functions else ""
            raise InputError(
                f"found the name {text}, expected one of {', '.join((*names, *(parameters or {})))}{integrals}"
            )
        function = parse_rational_function(text, names, dict(parameters or {}))
    uses_eps = any(int(polynomial.degrees()[-1]) > 0 for polynomial in (function.numerator, function.denominator))
    if uses_eps and eps is None:
        raise InputError(f"{text}: found eps in it, and no value of eps: give --eps")
    return PointFunction(text, function, ZERO if eps is None else eps)
