"""Functions whose drift is plotted: integrals of the Kahan map, which depend on eps, and H of the vector field."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.algebra.polynomials import RationalFunction, primitive_part
from kahanmaps.algebra.printing import format_polynomial, format_rational_function
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError, SingularStep
from kahanmaps.invariants.integrals_and_densities import (
    CommutantIntegral,
    ModifiedHamiltonian,
    measured_integrals,
    normalized,
)
from kahanmaps.laboratory.preserve.integrals import find_integrals
from kahanmaps.maps.floats.float_conversion import FloatArray, to_float, to_floats
from kahanmaps.maps.floats.steps import images_of
from kahanmaps.plots.point_functions import PointFunction, point_function
from kahanmaps.systems.hamiltonian import CubicHamiltonian

_MAX_NAME = 30  # maximal number of characters of the name of a function
_EFFORT = -2  # effort of the search for integrals, with which it takes at most a few seconds


class TwoPointFunction:
    """An integral that depends on x and its Kahan image x~: the modified H, or x^T M x~/eps for a matrix M."""

    of_arrays = True  # ensembles may call it with arrays of points

    def __init__(self, function: ModifiedHamiltonian | CommutantIntegral, eps: fmpq, label: str) -> None:
        self.name, self.label = function.name, label
        self._function, self._eps = function, eps
        hamiltonian = function.hamiltonian
        self._values: Callable[[FloatArray, FloatArray], FloatArray]  # returns values at pairs (x, x~)
        if isinstance(function, ModifiedHamiltonian):
            polynomials = (hamiltonian.H, *hamiltonian.gradient)
            H, *gradient = (PointFunction("", _as_function(hamiltonian, polynomial)) for polynomial in polynomials)
            self._values = lambda x, image: (
                H(x) + ((image - x) * np.stack([partial(x) for partial in gradient], axis=1)).sum(axis=1) / 3.0
            )
        else:
            matrix = to_floats((hamiltonian.J * function.matrix).entries()).reshape(hamiltonian.dim, hamiltonian.dim)
            self._values = lambda x, image: ((x @ matrix) * image).sum(axis=1) / to_float(eps)

    def at(self, start: Sequence[fmpq]) -> fmpq | None:
        """Return the exact value at the point x = `start`; None if x is an indeterminacy point of the Kahan map."""
        try:
            value: fmpq | None = self._function.value(QQ, self._eps, start)
        except SingularStep:
            return None
        return value

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the values at points (..., dim), computed with one Kahan step x -> x~ for all points together."""
        flat_points = points.reshape(-1, points.shape[-1])
        with np.errstate(all="ignore"):
            values = self._values(flat_points, images_of(self._function.map.at(self._eps), flat_points))
        return np.where(np.isfinite(values), values, np.nan).reshape(points.shape[:-1])


WatchedFunction = PointFunction | TwoPointFunction


def functions_of(file: SystemFile, eps: fmpq) -> dict[str, WatchedFunction]:
    """Return a dict from names to known integrals of the Kahan map of a system, and to H of the differential equation.

    The order is: integrals claimed in the file; the modified H of a cubic Hamiltonian H; for a member (A, H) of the
    family, integrals from powers of A; and H itself, which the Kahan map does not conserve. `eps` is half the time step
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
        functions["modified H"] = TwoPointFunction(ModifiedHamiltonian(hamiltonian), eps, "modified $H$")
        if file.member is not None and hamiltonian.is_homogeneous and hamiltonian.is_standard:
            letter = "H" if all(sign > 0 for sign in file.member.signs) else "K"  # the letters of check-integrals
            for power in range(1, hamiltonian.dim // 2):
                integral = CommutantIntegral(hamiltonian, file.member.A, power, letter)
                functions[integral.name] = TwoPointFunction(integral, eps, rf"$\tilde{{{letter}}}_{{{power}}}$")
    if hamiltonian is not None and "H" not in functions:
        functions["H"] = PointFunction("H", _as_function(hamiltonian, hamiltonian.H), eps)
    return functions


def watched_functions(
    file: SystemFile, eps: fmpq, progress: Callable[[str], None] = lambda _: None
) -> tuple[list[WatchedFunction], dict[str, str]]:
    """Return the known integrals of the Kahan map and of the flow, and a dict from their names to their origins.

    Integrals of the map are the `known_functions` or, if there are none, normalized integrals from a quick search.
    Integrals of the flow are limits of integrals of the map for eps -> 0. An origin is "declared", "theorem", "found"
    or "flow". `eps` is half the time step (exact).

    >>> from kahanmaps.documents.catalog import load
    >>> watched_functions(load("euler_top"), fmpq(1, 10))[1]
    {'(-F1 + 1)/eps^2': 'declared', 'x2^2 + 2*x3^2': 'flow', '(-F2/2 + 1/2)/eps^2': 'declared', 'x1^2 - x3^2': 'flow'}
    """
    map_functions: list[WatchedFunction]
    if file.hamiltonian is None and not measured_integrals(file):
        progress("searching for integrals")
        search = find_integrals(file, effort=_EFFORT)
        map_functions = [
            PointFunction(integral.name, normalized(integral.function, file.dim).function, eps)
            for integral in search.integrals
        ]
    else:
        map_functions = known_functions(file, eps)
    declared, hamiltonian = measured_integrals(file), file.hamiltonian
    flow_integrals = [] if hamiltonian is None else [_as_function(hamiltonian, primitive_part(hamiltonian.H)[1])]
    functions: list[WatchedFunction] = []
    origins: dict[str, str] = {}
    for function in map_functions:
        functions.append(function)
        name = function.name
        default_origin = "theorem" if hamiltonian else "found"
        origins[name] = "declared" if name in declared else "flow" if name == "H" else default_origin
        if isinstance(function, PointFunction) and name != "H":
            limit = normalized(function.function, file.dim).leading
            if limit is not None and limit != function.function and limit not in flow_integrals:
                flow_integrals.append(limit)
                text = format_rational_function(limit)
                functions.append(PointFunction(text if len(text) <= _MAX_NAME else f"limit of {name}", limit, eps))
                origins[functions[-1].name] = "flow"
    return functions, origins


def known_functions(file: SystemFile, eps: fmpq) -> list[WatchedFunction]:
    """Return H and the integrals claimed in the file or, if the file claims none, those that follow from theorems.

    Claimed integrals are normalized by `measured_integrals`: if the limit of an integral for eps -> 0 is constant, its
    drift is small along the orbits of every method. Raises InputError if no integral is known.
    """
    functions = functions_of(file, eps)
    functions |= {
        name: PointFunction(name, integral, eps)
        for name, integral in measured_integrals(file).items()
        if name not in functions
    }
    chosen_names = list(measured_integrals(file)) or [name for name in functions if name != "H"]
    if "H" in functions:
        chosen_names.append("H")
    if not chosen_names:
        problem = f"found no known integral of {file.name}, expected one"
        if file.integrals_in_iterates:
            names = ", ".join(file.integrals_in_iterates)
            problem = f"found only known integrals of {file.name} that contain x~ ({names}), expected others"
        raise InputError(f"{problem}: give --integral NAME=EXPR, an expression in the variables and eps")
    return [functions[name] for name in dict.fromkeys(chosen_names)]


def requested_functions(file: SystemFile, eps: fmpq, requests: Sequence[tuple[str, str]]) -> list[WatchedFunction]:
    """Return the functions for pairs (name, text); each text is "known", a name in `functions_of`, or a formula.

    A formula may contain eps. Raises InputError for an invalid text or a repeated name, and if no integral is known.
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
    """Return the function that a name in `functions_of` or a formula denotes; it has no eps if `eps` is None."""
    function = functions_of(file.real_approximation, fmpq(0) if eps is None else eps).get(text.strip())
    return requested_axis(file, eps, text) if function is None else function


def requested_axis(file: SystemFile, eps: fmpq | None, text: str) -> PointFunction:
    """Return the function of x that a name or a formula denotes. Raises InputError if it depends on the image x~."""
    available = functions_of(file.real_approximation, fmpq(0) if eps is None else eps)
    rational_functions = {
        name: function.function for name, function in available.items() if isinstance(function, PointFunction)
    }
    return point_function(text.strip(), file.variables, eps, file.real_approximation.parameters, rational_functions)


def _as_function(hamiltonian: CubicHamiltonian, polynomial: fmpq_mpoly) -> RationalFunction:
    return parse_rational_function(format_polynomial(polynomial), (*hamiltonian.variables, "eps"))
