"""One-step methods for quadratic vector fields in floating point, to compare with Kahan's method; time step h = 2 eps.

The step of each method is a straight-line program (straight_line_program.py), which runs like a step of a Kahan map: as
numpy code, or compiled. The equations of implicit methods are quadratic. Newton's method solves them, starting at the
step of Kahan's method. After an iteration with the corrections d_j of the stages, the residual of stage i is exactly
h sum_j a_ij Q(d_j, d_j) (Q: quadratic part of f; (a_ij): matrix of the method). Its size is the test of convergence.
The fast step takes two iterations. If the test fails, the careful step takes eight; without convergence the orbit ends.
Source: hairer-lubich-wanner-2006 for the methods, their orders and the coefficients of compositions.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from math import sqrt
from typing import Any, NamedTuple

import numpy as np
from flint import fmpq, fmpz

from kahanmaps.algebra.fields import rational
from kahanmaps.errors import InputError
from kahanmaps.maps.floats.ensemble import FloatEnsemble
from kahanmaps.maps.floats.float_conversion import FloatArray, to_float
from kahanmaps.maps.floats.steps import SINGULAR, FloatStep, Write, map_step
from kahanmaps.maps.floats.straight_line_program import EntryBound, StepChecks, extreme, is_zero, solve
from kahanmaps.maps.kahan import KahanFamily
from kahanmaps.maps.orbits.iteration import OrbitEnd
from kahanmaps.systems.hamiltonian import CubicHamiltonian
from kahanmaps.systems.quadratic import QuadraticSystem

_ROUNDING = 2.0**-52  # relative size of a residual below which the equations count as solved
_STALLED = 1e-10  # relative size below which the last correction of a careful step counts as round-off
_ITERATIONS, _CAREFUL_ITERATIONS = 2, 8  # numbers of Newton iterations in the fast and in the careful step


class Method(NamedTuple):
    """A one-step method: its name in tables, its order, and its work per step.

    `evaluations` counts evaluations of f; for a separable f, evaluating one of its two halves counts as 1/2.
    `systems` counts linear systems; for each of them f' is evaluated at every stage.
    """

    title: str
    order: int
    evaluations: float
    systems: int = 0


METHODS = {
    "kahan": Method("Kahan", 2, 1, 1),
    "normal-form": Method("Kahan, normal form", 2, 1, 1),
    "euler": Method("explicit Euler", 1, 1),
    "symplectic-euler": Method("symplectic Euler", 1, 1),
    "stormer-verlet": Method("Stormer-Verlet", 2, 1.5),
    "midpoint": Method("implicit midpoint", 2, 3, 3),
    "rk4": Method("RK4", 4, 4),
    "gauss4": Method("Gauss 4", 4, 5, 3),
    "yoshida4": Method("Kahan, Yoshida 4", 4, 3, 3),
    "suzuki4": Method("Kahan, Suzuki 4", 4, 5, 5),
    "yoshida6": Method("Kahan, Yoshida 6", 6, 7, 7),
}
SEPARABLE = {"symplectic-euler", "stormer-verlet"}  # methods for systems with positions and momenta only

_TABLEAUS: dict[str, tuple[list[list[float]], list[float]]] = {  # explicit Runge-Kutta methods: rows of A, weights b
    "euler": ([[]], [1.0]),
    "rk4": ([[], [0.5], [0.0, 0.5], [0.0, 0.0, 1.0]], [1 / 6, 1 / 3, 1 / 3, 1 / 6]),
}
_ROOT3 = sqrt(3.0)
# Implicit Runge-Kutta methods: the matrix A, and b^T A^-1, the weights of the increments of the stages in the step.
_IMPLICIT: dict[str, tuple[list[list[float]], list[float]]] = {
    "midpoint": ([[0.5]], [2.0]),
    "gauss4": ([[0.25, 0.25 - _ROOT3 / 6], [0.25 + _ROOT3 / 6, 0.25]], [-_ROOT3, _ROOT3]),
}
IMPLICIT = set(_IMPLICIT)  # names of the implicit methods
# The coefficients of Yoshida's composition of order 6, solution A, to 26 digits (hairer-lubich-wanner-2006, V.3.2).
_YOSHIDA6 = ["-1.17767998417887100694641568", "0.23557321335935813368479318", "0.78451361047755726381949763"]


def composition(method: str) -> list[fmpq]:
    """Return the fractions of the time step taken by the successive Kahan steps of a symmetric composition.

    They are rational numbers, accurate beyond double precision, and their sum is exactly 1.

    >>> [float(share.p) / float(share.q) for share in composition("yoshida4")]
    [1.3512071919596578, -1.7024143839193153, 1.3512071919596578]
    """

    if method == "yoshida6":
        weights = [fmpq(int(text.replace(".", "")), 10 ** len(text.partition(".")[2])) for text in reversed(_YOSHIDA6)]
    else:  # k/2 steps of length 1/(k - k^(1/3)), one step backward in time, and k/2 steps again
        k = 4 if method == "suzuki4" else 2
        weights = [1 / (k - fmpq(fmpz(k << 240).root(3), 1 << 80))] * (k // 2)
    return [*weights, 1 - 2 * sum(weights, fmpq(0)), *reversed(weights)]


def work(method: str, steps: int, repeated: int = 0) -> tuple[float, int]:
    """Return the numbers of evaluations of f and of linear systems in `steps` steps.

    The careful step, which takes more iterations, repeated `repeated` of these steps.

    >>> work("midpoint", 100), work("midpoint", 100, 1)
    ((300, 300), (309, 309))
    """
    properties, stage_count = METHODS[method], len(_IMPLICIT[method][1]) if repeated else 0
    evaluations = properties.evaluations * steps + repeated * (1 + stage_count * _CAREFUL_ITERATIONS)
    return evaluations, properties.systems * steps + repeated * (1 + _CAREFUL_ITERATIONS)


class MethodEnsemble(FloatEnsemble):
    """The orbits of many initial points under a method of `METHODS` except "normal-form", with time step 2 eps.

    `eps` is exact. `halves` are the two groups of variables of a separable system (see `separated`), for the methods
    that need them. The remaining arguments are as in FloatEnsemble. The steps of an orbit in which an implicit method
    needed more than two iterations count as near-singular.

    >>> growth = QuadraticSystem.from_text(["x"], ["x"])
    >>> ensemble = MethodEnsemble(growth, "1/20", [[1]], "midpoint", kernel="numpy")
    >>> ensemble.advance(10)
    >>> round(float(ensemble.x[0, 0]), 10), round((1.05 / 0.95) ** 10, 10)
    (2.7205514142, 2.7205514142)
    """

    def __init__(
        self,
        system: QuadraticSystem,
        eps: Any,
        starts: Any,
        method: str,
        *,
        halves: tuple[frozenset[int], frozenset[int]] | None = None,
        **options: Any,
    ) -> None:
        if method not in METHODS or method == "normal-form" or (method in SEPARABLE and halves is None):
            raise InputError(f"found the method {str(method)[:40]!r}, expected one of {', '.join(METHODS)}")
        self._step_arguments = system, rational(eps), method, halves
        super().__init__(system, eps, starts, **options)

    def _build_step(self) -> None:
        self._step = method_step(*self._step_arguments)
        self._machine_code: Any = None

    def end(self, orbit: int) -> OrbitEnd:
        """Return how one orbit has ended."""
        end, method = super().end(orbit), self._step_arguments[2]
        if self._batch.status[orbit] == SINGULAR and method in IMPLICIT:
            sentence = f"step {end.steps + 1}: Newton's method finds no solution of the equations of {method}"
            return OrbitEnd("singular", end.steps, sentence)
        return end


def method_step(
    system: QuadraticSystem, eps: fmpq, method: str, halves: tuple[frozenset[int], frozenset[int]] | None = None
) -> FloatStep:
    """Return the step of a method; see `MethodEnsemble` for the arguments."""
    if method not in _TABLEAUS and method not in IMPLICIT and method not in SEPARABLE:
        parts = [fmpq(1)] if method == "kahan" else composition(method)
        family = KahanFamily(system)
        return map_step([factor for part in parts for factor in family.at(eps * part).factors])
    field, h = FieldProgram(system), to_float(2 * eps)
    if method in _IMPLICIT:
        return FloatStep(system.dim, _implicit_writer(field, h, *_IMPLICIT[method]))
    if method in SEPARABLE and halves is not None:
        # Change positions and momenta in turn: positions by h first, or momenta by h/2 before and after them.
        positions, momenta = halves
        substeps = [(positions, h), (momenta, h)]
        if method == "stormer-verlet":
            substeps = [(momenta, h / 2), (positions, h), (momenta, h / 2)]

        def write(x: Sequence[Any], checks: StepChecks) -> list[Any]:
            state = list(x)
            for group, duration in substeps:
                slopes = field(state)
                state = [y + duration * slopes[i] if i in group else y for i, y in enumerate(state)]
            return state

    else:
        rows, weights = _TABLEAUS[method]

        def write(x: Sequence[Any], checks: StepChecks) -> list[Any]:
            slopes: list[list[Any]] = []

            def stage_point(factors: Sequence[float]) -> list[Any]:
                return [
                    y + _sum(h * a * k[i] for a, k in zip(factors, slopes, strict=True) if a) for i, y in enumerate(x)
                ]

            for row in rows:
                slopes.append(field(stage_point(row)))
            return stage_point(weights)

    return FloatStep(system.dim, write)


class FieldProgram:
    """A quadratic vector field, its Jacobian and its quadratic part, to be used in straight-line programs.

    `terms[i]` lists the terms of component i as pairs (coefficient, indices of at most two variables).
    """

    def __init__(self, system: QuadraticSystem) -> None:
        self.terms: list[list[tuple[float, tuple[int, ...]]]] = []
        for polynomial in system.rhs:
            self.terms.append([])
            for monomial, coefficient in polynomial.terms():
                indices = tuple(k for k, power in enumerate(monomial) for _ in range(int(power)))
                self.terms[-1].append((to_float(coefficient), indices))

    def __call__(self, x: Sequence[Any], degrees: tuple[int, ...] = (0, 1, 2)) -> Any:
        """Return f(x), or the sum of its terms of the given degrees."""
        selected_terms = [[(c, indices) for c, indices in row if len(indices) in degrees] for row in self.terms]
        return [_sum(c * reduce(lambda a, k: a * x[k], indices, 1.0) for c, indices in row) for row in selected_terms]

    def jacobian(self, x: Sequence[Any]) -> Any:
        """Return the rows of f'(x)."""
        rows = []
        for terms in self.terms:
            row: list[Any] = [0.0] * len(self.terms)
            for c, indices in terms:
                for k, j in enumerate(indices):
                    row[j] = row[j] + c * reduce(lambda a, i: a * x[i], indices[:k] + indices[k + 1 :], 1.0)
            rows.append(row)
        return rows


def _sum(values: Any) -> Any:
    return reduce(lambda a, b: a + b, values, 0.0)


def _implicit_writer(field: FieldProgram, h: float, A: list[list[float]], weights: list[float]) -> Write:
    """Return the writer of the step x~ = x + sum_i w_i z_i, where w is `weights` and z_i = h sum_j A_ij f(x + z_j).

    Newton's method finds the z_i. Their initial values lie on a parabola given by f(x) and a step of Kahan's method.
    """

    def write(x: Sequence[Any], checks: StepChecks) -> list[Any]:
        n, stages = len(x), range(len(A))
        nodes, unbounded = [sum(row) for row in A], EntryBound(1.0, lambda: True)

        def matrix(factors: list[list[float]], jacobians: Sequence[Any]) -> list[list[Any]]:
            """Return the matrix with the blocks delta_rs I - h factors[r][s] jacobians[s] in row r and column s."""
            pairs = [(r, i) for r in range(len(factors)) for i in range(n)]
            return [
                [float((r, i) == (s, j)) - h * factors[r][s] * jacobians[s][i][j] for s, j in pairs] for r, i in pairs
            ]

        def stage_sums(values: Sequence[Any]) -> list[Any]:
            return [_sum(h * A[r][s] * values[s][i] for s in stages) for r in stages for i in range(n)]

        euler_step = [h * entry for entry in field(x)]
        rows = [[*row, b] for row, b in zip(matrix([[0.5]], [field.jacobian(x)]), euler_step, strict=True)]
        kahan_step = solve(rows, unbounded, StepChecks(False))
        z = [c * a + c * c * (b - a) for c in nodes for a, b in zip(euler_step, kahan_step, strict=True)]
        # Newton's method. The pivots need no check: an inaccurate elimination only slows down the convergence.
        for _ in range(_CAREFUL_ITERATIONS if checks.careful else _ITERATIONS):
            points = [[a + w for a, w in zip(x, z[k : k + n], strict=True)] for k in range(0, len(z), n)]
            values, rows = [field(point) for point in points], matrix(A, [field.jacobian(point) for point in points])
            residuals = [a - b for a, b in zip(stage_sums(values), z, strict=True)]
            newton_checks = StepChecks(False)
            correction = solve([[*row, r] for row, r in zip(rows, residuals, strict=True)], unbounded, newton_checks)
            z = [a + b for a, b in zip(z, correction, strict=True)]
        size = reduce(lambda a, b: extreme("max", a, abs(b)), [*x, *z], 0.0)
        if checks.careful:
            for d in correction:
                if not is_zero(d):
                    checks.is_singular = checks.is_singular | (abs(d) > _STALLED * size)
            checks.is_near_singular = True
        else:
            checks.is_valid = checks.is_valid & newton_checks.is_valid
            # The residuals after the last corrections d_s: h sum_s A_rs Q(d_s, d_s), with the quadratic part Q of f.
            for residual in stage_sums([field(correction[s * n : s * n + n], (2,)) for s in stages]):
                if not is_zero(residual):
                    checks.is_valid = checks.is_valid & (abs(residual) <= _ROUNDING * size)
        return [a + _sum(w * z[s * n + i] for s, w in enumerate(weights)) for i, a in enumerate(x)]

    return write


def separated(
    system: QuadraticSystem, hamiltonian: CubicHamiltonian | None
) -> tuple[frozenset[int], frozenset[int]] | str:
    """Return the indices of the positions q and of the momenta p if H = T(p) + V(q), otherwise the reason as text.

    >>> from kahanmaps.documents.catalog import load
    >>> file = load("henon_heiles")
    >>> [sorted(group) for group in separated(file.system, file.hamiltonian)]
    [[0, 1], [2, 3]]
    >>> separated(load("euler_top").system, None)
    'the system has no Hamiltonian form J grad H with constant J that is known'
    """
    if hamiltonian is None:
        return "the system has no Hamiltonian form J grad H with constant J that is known"
    n, names = system.dim, system.variables
    # Derivatives of positions depend on momenta only, and vice versa: color the graph of these dependences.
    neighbours: list[set[int]] = [set() for _ in range(n)]
    for i, polynomial in enumerate(system.rhs):
        for j in range(n):
            if any(int(monomial[j]) for monomial in polynomial.monoms()) or hamiltonian.J[i, j] != 0:
                neighbours[i].add(j)
                neighbours[j].add(i)
    color: dict[int, int] = {}
    for start in range(n):
        stack = [(start, 0)] if start not in color else []
        while stack:
            i, expected_color = stack.pop()
            if i in color:
                if color[i] != expected_color:
                    return f"H is not of the form T(p) + V(q): {names[i]} would be a position and a momentum"
                continue
            color[i] = expected_color
            stack += [(j, 1 - expected_color) for j in sorted(neighbours[i])]
    return frozenset(i for i in color if color[i] == 0), frozenset(i for i in color if color[i] == 1)


class VectorField(FieldProgram):
    """A quadratic vector field and its Jacobian in doubles, at an array of points (..., dim) or at one point.

    >>> f = VectorField(QuadraticSystem.from_text(["x", "y"], ["x*y + 1", "3*x"]))
    >>> f(np.array([2.0, 5.0])).tolist(), f.jacobian(np.array([2.0, 5.0])).tolist()
    ([11.0, 6.0], [[5.0, 2.0], [3.0, 0.0]])
    """

    def __call__(self, x: Any, degrees: tuple[int, ...] = (0, 1, 2)) -> FloatArray:
        with np.errstate(all="ignore"):
            rows = super().__call__(np.moveaxis(x, -1, 0), degrees)
        return np.stack(np.broadcast_arrays(*rows, x[..., 0])[:-1], axis=-1)

    def jacobian(self, x: Any) -> FloatArray:
        return np.array(super().jacobian(x), dtype=np.float64)
