"""Functions whose drift is plotted: integrals of the Kahan map, which depend on eps, and H of the vector field."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.algebra.printing import format_polynomial
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError, SingularStep
from kahanmaps.invariants.integrals_and_densities import CommutantIntegral, ModifiedHamiltonian, measured_integrals
from kahanmaps.maps.floats.ensemble import FloatEnsemble
from kahanmaps.maps.floats.float_conversion import FloatArray, to_float, to_floats
from kahanmaps.plots.point_functions import PointFunction, point_function
from kahanmaps.systems.hamiltonian import CubicHamiltonian

_MAX_NAME = 30  # characters


class OfTheImage:
    """An integral that depends on x and its image x~ under the Kahan map: the modified H, or one of the commutant."""

    def __init__(self, function: ModifiedHamiltonian | CommutantIntegral, eps: fmpq, label: str) -> None:
        self.name, self.label = function.name, label
        self._function, self._eps = function, eps
        hamiltonian = function.hamiltonian
        self._values: Callable[[FloatArray, FloatArray], FloatArray]  # at points and their images
        if isinstance(function, ModifiedHamiltonian):
            polynomials = (hamiltonian.H, *hamiltonian.gradient)
            H, *gradient = (PointFunction("", _as_function(hamiltonian, polynomial)) for polynomial in polynomials)
            self._values = lambda x, image: (
                H(x) + ((image - x) * np.stack([slope(x) for slope in gradient], axis=1)).sum(axis=1) / 3.0
            )
        else:
            matrix = to_floats((hamiltonian.J * function.matrix).entries()).reshape(hamiltonian.dim, hamiltonian.dim)
            self._values = lambda x, image: ((x @ matrix) * image).sum(axis=1) / to_float(eps)

    def at(self, start: Sequence[fmpq]) -> fmpq | None:
        """Return the exact value; None at an indeterminacy point of the Kahan map."""
        try:
            value: fmpq | None = self._function.value(QQ, self._eps, start)
        except SingularStep:
            return None
        return value

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the values, computed with one step of the Kahan map for all points at once."""
        values = np.full(len(points), np.nan)
        good = np.isfinite(points).all(axis=1)
        if good.any():
            x = points[good]
            ensemble = FloatEnsemble(self._function.hamiltonian.system, self._eps, x, kernel="numpy")
            ensemble.advance(1)
            image = np.where((ensemble.failed_at >= 0)[:, None], np.nan, ensemble.x)
            with np.errstate(all="ignore"):
                computed = self._values(x, image)
            values[good] = np.where(np.isfinite(computed), computed, np.nan)
        return values


WatchedFunction = PointFunction | OfTheImage


def functions_of(file: SystemFile, eps: fmpq) -> dict[str, WatchedFunction]:
    """Return the known integrals of the Kahan map of a system by name, and H of the differential equation.

    These are the integrals claimed in the file; the modified H of a cubic Hamiltonian; for a member of the family the
    integrals of the commutant; and last the plain H, which the Kahan map does not conserve. `eps` is half the time step
    (exact).

    >>> from kahanmaps.documents.catalog import load
    >>> list(functions_of(load("paper_m2"), fmpq(1, 9)))
    ['I1', 'I2', 'modified H', 'H~_1', 'H']
    """
    functions: dict[str, WatchedFunction] = {
        name: PointFunction(name, function, eps) for name, function in file.integrals.items()
    }
    hamiltonian = file.hamiltonian
    if hamiltonian is not None and eps != 0:
        functions["modified H"] = OfTheImage(ModifiedHamiltonian(hamiltonian), eps, "modified $H$")
        if file.member is not None and hamiltonian.is_homogeneous and hamiltonian.is_standard:
            letter = "H" if all(sign > 0 for sign in file.member.signs) else "K"  # as in check-integrals
            for power in range(1, hamiltonian.dim // 2):
                integral = CommutantIntegral(hamiltonian, file.member.A, power, letter)
                functions[integral.name] = OfTheImage(integral, eps, rf"$\tilde{{{letter}}}_{{{power}}}$")
    if hamiltonian is not None and "H" not in functions:
        functions["H"] = PointFunction("H", _as_function(hamiltonian, hamiltonian.H), eps)
    return functions


def known_functions(file: SystemFile, eps: fmpq) -> list[WatchedFunction]:
    """Return the integrals claimed in the file, or if there are none those that follow from theorems; and H.

    Claims are normalized by `measured_integrals`, since an integral with a constant limit as eps -> 0 has a small drift
    in any case. Raises InputError if no integral is known.
    """
    functions = functions_of(file, eps)
    functions |= {
        name: PointFunction(name, integral, eps)
        for name, integral in measured_integrals(file).items()
        if name not in functions
    }
    chosen = list(measured_integrals(file)) or [name for name in functions if name != "H"]
    if "H" in functions:
        chosen.append("H")
    if not chosen:
        problem = f"found no known integral of {file.name}, expected one"
        if file.integrals_in_iterates:
            names = ", ".join(file.integrals_in_iterates)
            problem = f"found only known integrals of {file.name} that contain x~ ({names}), expected others"
        raise InputError(f"{problem}: give --integral NAME=EXPR, an expression in the variables and eps")
    return [functions[name] for name in dict.fromkeys(chosen)]


def requested_functions(file: SystemFile, eps: fmpq, requests: Sequence[tuple[str, str]]) -> list[WatchedFunction]:
    """Return the functions requested by pairs (name, text): "known", a name in `functions_of`, or an expression.

    Expressions may contain eps. Raises InputError for invalid text, for a repeated name, and if no integral is known.
    """
    available = functions_of(file, eps)
    functions: list[WatchedFunction] = []
    for name, text in requests:
        if text == "known" and not name:
            functions += known_functions(file, eps)
        elif text in available and name in ("", text):
            functions.append(available[text])
        else:
            function = parse_rational_function(text, (*file.variables, "eps"), file.parameters)
            functions.append(PointFunction(name or text[:_MAX_NAME], function, eps))
    names = [function.name for function in functions]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"found two functions of the name {name}: write --integral NAME=EXPR")
    return functions


def requested_function(file: SystemFile, eps: fmpq | None, text: str) -> WatchedFunction:
    """Return one of `functions_of` by its name, or an expression; without `eps` it must not contain eps."""
    known = functions_of(file.real_approximation, fmpq(0) if eps is None else eps).get(text.strip())
    return requested_axis(file, eps, text) if known is None else known


def requested_axis(file: SystemFile, eps: fmpq | None, text: str) -> PointFunction:
    """Return a function as `requested_function`, but refuse integrals that depend on the image x~ of the point."""
    known = functions_of(file.real_approximation, fmpq(0) if eps is None else eps)
    named = {
        name: known_function.function
        for name, known_function in known.items()
        if isinstance(known_function, PointFunction)
    }
    return point_function(text.strip(), file.variables, eps, file.real_approximation.parameters, named)


def _as_function(hamiltonian: CubicHamiltonian, polynomial: fmpq_mpoly) -> RationalFunction:
    return parse_rational_function(format_polynomial(polynomial), (*hamiltonian.variables, "eps"))
