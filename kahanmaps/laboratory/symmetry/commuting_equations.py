"""The polynomial equations that g = b_1 g_1 + ... + b_l g_l solves if its Kahan map commutes with that of f.

Both maps are power series in eps at a fixed rational point x, the coefficients polynomials in b. So is the difference
Phi_f(Phi_g(x)) - Phi_g(Phi_f(x)), and every coefficient of it is an equation for b that holds exactly. The first one,
at eps^2, is the Lie bracket [g, f] = g' f - f' g. The Kahan map is the flow over the time h = 2 eps of the field
f + h^2 f_2 + ..., f_2 = f'f'f/12 - f''(f, f)/6; where the bracket vanishes, the next equations, at eps^4, are cubic in
b: [f_2, g] + [f, g_2] = 0.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Callable, Sequence
from typing import Any

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.polynomials import monomials, ring
from kahanmaps.algebra.small_systems import independent
from kahanmaps.systems.quadratic import QuadraticSystem

# A vector of power series in eps: series[k][i] is the coefficient of eps^k in coordinate i.
Series = list[list[Any]]


def coefficients_of(system: QuadraticSystem) -> list[list[fmpq]]:
    """For each component the coefficients of x_j x_k (j <= k), of x_j, and the constant, in this order.

    >>> coefficients_of(QuadraticSystem.from_text(["x", "y"], ["x*y", "x - 2"]))
    [[0, 1, 0, 0, 0, 0], [0, 0, 0, 1, 0, -2]]
    """
    support = [m for degree in (2, 1, 0) for m in monomials(system.dim, degree)]
    return [[fmpq(component[m]) for m in support] for component in system.rhs]


def system_of(variables: Sequence[str], rows: Sequence[Sequence[fmpq]]) -> QuadraticSystem:
    """The system with these coefficients: the inverse of `coefficients_of`.

    >>> print(system_of(["x"], [[fmpq(1), fmpq(0), fmpq(-3)]]))
    x' = x^2 - 3
    """
    support = [m for degree in (2, 1, 0) for m in monomials(len(variables), degree)]
    return QuadraticSystem(tuple(ring(variables).from_dict(dict(zip(support, row, strict=True))) for row in rows))


def combination(systems: Sequence[QuadraticSystem], weights: Sequence[Any], zero: Any) -> list[list[Any]]:
    """The coefficients of sum weights[i] systems[i]; weights are numbers, or polynomials with `zero` in their ring.

    >>> f = QuadraticSystem.from_text(["x"], ["x^2 - 1"])
    >>> combination([f, f], [fmpq(2), fmpq(1)], fmpq(0))
    [[3, 0, -3]]
    """
    tables = [coefficients_of(system) for system in systems]
    total = [[zero for _ in row] for row in tables[0]]
    for weight, table in zip(weights, tables, strict=True):
        if weight != 0:
            for i, row in enumerate(table):
                total[i] = [a + weight * c if c != 0 else a for a, c in zip(total[i], row, strict=True)]
    return total


def commutator_equations(
    f: QuadraticSystem,
    basis: Sequence[QuadraticSystem],
    weights: Sequence[fmpq_mpoly],
    order: int,
    rng: random.Random,
    go_on: Callable[[], bool],
) -> list[fmpq_mpoly]:
    """Equations that hold for b if the Kahan maps of f and g = sum `weights[i]` `basis[i]` commute for every eps.

    `weights` are polynomials in b. Exact: coefficients of eps^2, ..., eps^order of the commutator at small random
    integer points. Points are added until two in a row bring nothing new; `go_on` says whether there is time for
    one more. Returns linearly independent polynomials in b. Source: kahan-1993.

    >>> from kahanmaps.algebra.polynomials import ring
    >>> f = QuadraticSystem.from_text(["x", "y"], ["x*y", "-x^2"])
    >>> commutator_equations(f, [f], ring(["b"]).gens(), 4, random.Random(1), lambda: True)
    [b^3 - b]
    """
    n = f.dim
    of_f = _Terms(coefficients_of(f), n)
    of_g = _Terms(combination(basis, weights, weights[0].context().constant(0)), n)
    found: list[fmpq_mpoly] = []
    idle = 0
    while idle < 2 and go_on():
        point = [fmpq(rng.randint(-9, 9)) for _ in range(n)]
        x: Series = [point, *([fmpq(0)] * n for _ in range(order))]
        left, right = of_f.step(of_g.step(x)), of_g.step(of_f.step(x))
        new = [a - b for u, v in zip(left, right, strict=True) for a, b in zip(u, v, strict=True)]
        spanned = independent([*found, *(p for p in new if isinstance(p, fmpq_mpoly))])
        idle = idle + 1 if len(spanned) == len(found) else 0
        found = spanned
    return found


class _Terms:
    """A quadratic field given by its coefficients (numbers, or polynomials in b), as steps of power series in eps."""

    def __init__(self, rows: Sequence[Sequence[Any]], n: int) -> None:
        self._n = n
        pairs = list(itertools.combinations_with_replacement(range(n), 2))
        self._quadratic = [[(c, j, k) for c, (j, k) in zip(row, pairs, strict=False) if c != 0] for row in rows]
        self._linear = [[(c, j) for j, c in enumerate(row[len(pairs) : len(pairs) + n]) if c != 0] for row in rows]
        self._constant = [row[-1] for row in rows]

    def step(self, y: Series) -> Series:
        """y + 2 eps v with v = g(y) + eps g'(y) v, order by order."""
        v: Series = []
        for order in range(len(y)):
            value = list(self._constant) if order == 0 else [fmpq(0)] * self._n
            for a in range(order + 1):
                self._add(value, y[a], y[order - a], half=True)
            for a in range(order):
                self._add(value, y[a], v[order - 1 - a], half=False)
            self._add_linear(value, y[order])
            if order:
                self._add_linear(value, v[order - 1])
            v.append(value)
        return [y[0], *([a + 2 * b for a, b in zip(y[k], v[k - 1], strict=True)] for k in range(1, len(y)))]

    def _add(self, value: list[Any], y: Sequence[Any], z: Sequence[Any], half: bool) -> None:
        """value += Q(y, z), or twice that."""
        for i, terms in enumerate(self._quadratic):
            for c, j, k in terms:
                product = y[j] * z[k] if half else y[j] * z[k] + y[k] * z[j]
                if product != 0:
                    value[i] = value[i] + c * product

    def _add_linear(self, value: list[Any], y: Sequence[Any]) -> None:
        for i, terms in enumerate(self._linear):
            for c, j in terms:
                if y[j] != 0:
                    value[i] = value[i] + c * y[j]
