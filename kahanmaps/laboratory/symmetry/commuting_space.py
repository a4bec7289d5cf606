"""The space of quadratic g with [f, g] = f' g - g' f = 0, by exact linear algebra over Q, and equations on this space.

If the Kahan maps Phi_f and Phi_g of f and g commute for every eps, the bracket [f, g] vanishes, since it is the first
term in eps of their commutator. So the space contains every g whose Kahan map commutes with that of f.

Let g = b_1 g_1 + ... + b_l g_l for a basis g_1, ..., g_l of the space. At a fixed rational point x the commutator
Phi_f(Phi_g(x)) - Phi_g(Phi_f(x)) is a power series in eps whose coefficients are polynomials in b. All of them must
vanish. The first one, at eps^2, is a multiple of the bracket. The Kahan map is the flow over the time h = 2 eps of the
field f + h^2 F + ... with F = f'f'f/12 - f''(f, f)/6. Let G be the same expression in g. If the bracket vanishes, the
next equations, at eps^4, are cubic in b: [F, g] + [f, G] = 0.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.matrices import combination_of, nullspace, primitive_integers
from kahanmaps.algebra.polynomials import monomials, ring
from kahanmaps.algebra.small_systems import echelon_basis
from kahanmaps.algebra.work import Budget, count_work
from kahanmaps.systems.quadratic import QuadraticSystem

SHAPES = ("linear", "quadratic")
MAX_DIMENSION = 100  # of a space whose basis is stored and verified
MAX_UNKNOWNS = 900  # the null space of a square matrix of this size takes seconds

# A vector of power series in eps: series[k][i] is the coefficient of eps^k in coordinate i.
Series = list[list[Any]]


def coefficients_of(system: QuadraticSystem) -> list[list[fmpq]]:
    """Return, for each component of the system, the coefficients of x_j x_k (j <= k), those of x_j, and the constant.

    >>> coefficients_of(QuadraticSystem.from_text(["x", "y"], ["x*y", "x - 2"]))
    [[0, 1, 0, 0, 0, 0], [0, 0, 0, 1, 0, -2]]
    """
    support = [m for degree in (2, 1, 0) for m in monomials(system.dim, degree)]
    return [[fmpq(component[m]) for m in support] for component in system.rhs]


def system_of(variables: Sequence[str], rows: Sequence[Sequence[fmpq]]) -> QuadraticSystem:
    """Return the system whose components have the coefficients `rows`: the inverse of `coefficients_of`.

    >>> print(system_of(["x"], [[fmpq(1), fmpq(0), fmpq(-3)]]))
    x' = x^2 - 3
    """
    support = [m for degree in (2, 1, 0) for m in monomials(len(variables), degree)]
    return QuadraticSystem(tuple(ring(variables).from_dict(dict(zip(support, row, strict=True))) for row in rows))


def combination(systems: Sequence[QuadraticSystem], weights: Sequence[Any], zero: Any) -> list[list[Any]]:
    """Return the coefficients of sum weights[i] systems[i]; `zero` is the 0 of the field or ring of the weights.

    >>> f = QuadraticSystem.from_text(["x"], ["x^2 - 1"])
    >>> combination([f, f], [fmpq(2), fmpq(1)], fmpq(0))
    [[3, 0, -3]]
    """
    coefficient_tables = [coefficients_of(system) for system in systems]
    sums = [[zero for _ in row] for row in coefficient_tables[0]]
    for weight, coefficients in zip(weights, coefficient_tables, strict=True):
        if weight != 0:
            for i, row in enumerate(coefficients):
                sums[i] = [a + weight * c if c != 0 else a for a, c in zip(sums[i], row, strict=True)]
    return sums


def commutator_equations(
    f: QuadraticSystem,
    basis: Sequence[QuadraticSystem],
    weights: Sequence[fmpq_mpoly],
    order: int,
    rng: random.Random,
    budget: Budget,
) -> list[fmpq_mpoly]:
    """Return polynomials that vanish if the Kahan maps of f and g = sum weights[i] basis[i] commute for every eps.

    `weights` are polynomials in unknowns b. The returned polynomials in b are an exact basis of the span of the
    coefficients of eps^2, ..., eps^order of the commutator at small random integer points. Points are added until two
    successive points give no new equation or the `budget` is spent. Source: kahan-1993.

    >>> from kahanmaps.algebra.polynomials import ring
    >>> f = QuadraticSystem.from_text(["x", "y"], ["x*y", "-x^2"])
    >>> commutator_equations(f, [f], ring(["b"]).gens(), 4, random.Random(1), Budget())
    [b^3 - b]
    """
    n = f.dim
    map_of_f = _SeriesMap(coefficients_of(f), n)
    map_of_g = _SeriesMap(combination(basis, weights, weights[0].context().constant(0)), n)
    equations: list[fmpq_mpoly] = []
    idle_count = 0
    while idle_count < 2 and not budget.is_spent:
        point = [fmpq(rng.randint(-9, 9)) for _ in range(n)]
        x: Series = [point, *([fmpq(0)] * n for _ in range(order))]
        f_after_g, g_after_f = map_of_f.step(map_of_g.step(x)), map_of_g.step(map_of_f.step(x))
        commutator = [a - b for u, v in zip(f_after_g, g_after_f, strict=True) for a, b in zip(u, v, strict=True)]
        spanning_equations = echelon_basis([*equations, *(p for p in commutator if isinstance(p, fmpq_mpoly))])
        idle_count = idle_count + 1 if len(spanning_equations) == len(equations) else 0
        equations = spanning_equations
    return equations


class _SeriesMap:
    """The Kahan map of a field, for power series in eps; `rows` has its coefficients (numbers or polynomials in b)."""

    def __init__(self, rows: Sequence[Sequence[Any]], n: int) -> None:
        # With 1 as an additional coordinate all terms are quadratic.
        pairs = [*itertools.combinations_with_replacement(range(n), 2), *((j, n) for j in range(n + 1))]
        self._terms = [[(c, j, k) for c, (j, k) in zip(row, pairs, strict=True) if c != 0] for row in rows]

    def step(self, y: Series) -> Series:
        """Return the image y + 2 eps v with v = g(y) + eps g'(y) v, computed order by order."""
        # An additional coordinate 1 makes g homogeneous. Each order of eps g'(y) v contains only lower orders of v, so
        # that no linear system has to be solved.
        y = [[*row, fmpq(order == 0)] for order, row in enumerate(y)]
        v: Series = []
        term_counts = [len(c) if isinstance(c, fmpq_mpoly) else 1 for terms in self._terms for c, _, _ in terms]
        for order in range(len(y)):
            lengths = [len(e) if isinstance(e, fmpq_mpoly) else 1 for row in (*y[: order + 1], *v) for e in row]
            count_work((order + 1) * (2 * len(term_counts) + sum(term_counts) * sum(lengths) / len(lengths) / 2))
            value = [fmpq(0)] * len(y[0])
            for i, terms in enumerate(self._terms):
                for c, j, k in terms:
                    for a in range(order + 1):
                        product = y[a][j] * y[order - a][k]
                        if a < order:
                            earlier_v = v[order - 1 - a]
                            product = product + y[a][j] * earlier_v[k] + y[a][k] * earlier_v[j]
                        if product != 0:
                            value[i] = value[i] + c * product
            v.append(value)
        image = [y[0], *([a + 2 * b for a, b in zip(y[k], v[k - 1], strict=True)] for k in range(1, len(y)))]
        return [row[:-1] for row in image]


@dataclass(frozen=True)
class CommutingSpace:
    """A basis of all g with [f, g] = 0, f first; `matrices` has the B with g = B f, () for the shape "quadratic".

    If the components of f are linearly dependent, B is not unique, and `matrices` has one B for each g. If `dimension`
    exceeds the number of fields, the space is too large: `dimension` is then an upper bound, and f is the only field.
    """

    fields: tuple[QuadraticSystem, ...]
    matrices: tuple[fmpq_mat, ...]
    dimension: int


def unknowns(system: QuadraticSystem, shape: str) -> int:
    """Return the number of unknown coefficients of g in the linear equations for the space."""
    n = system.dim
    return n * len(_independent_components(system)) if shape == "linear" else n * (n + 1) * (n + 2) // 2


def commuting_space(f: QuadraticSystem, shape: str, seed: int = 0, C: fmpq_mat | None = None) -> CommutingSpace:
    """Compute all g with [f, g] = 0, of the shape g = B f ("linear") or any quadratic g ("quadratic"); exact.

    f must not be 0. With a matrix C such that C f' = f' C, only the g with C g' = g' C are computed.

    [f, g] = 0 is solved at random integer points, and verified as an identity of polynomials for each solution g.
    Source: petrera-suris-2016.

    >>> f = QuadraticSystem.from_text(["x", "y"], ["x^2", "2*y^2"])
    >>> for g in commuting_space(f, "linear").fields:
    ...     print(str(g).replace(chr(10), ", "))
    x' = x^2, y' = 2*y^2
    x' = x^2, y' = 0
    """
    n = f.dim
    over_Q = f.over(QQ)
    columns = _independent_components(f)
    rng = random.Random(f"commuting space {seed}")
    rows: list[list[fmpq]] = []
    row_count = unknowns(f, shape)
    while True:
        while len(rows) < row_count + 2 * n:
            point = [fmpq(rng.randint(-9, 9)) for _ in range(n)]
            value, jacobian = over_Q.value(point), over_Q.jacobian(point)
            # g is a combination of fields phi e_k. For each function phi: its value and its derivative along f.
            if shape == "linear":
                derivatives = (sum((jacobian[j, k] * value[k] for k in range(n)), fmpq(0)) for j in columns)
                scalars = [*zip((value[j] for j in columns), derivatives, strict=True)]
            else:
                pairs = itertools.combinations_with_replacement(range(n), 2)
                scalars = [(point[j] * point[k], value[j] * point[k] + point[j] * value[k]) for j, k in pairs]
                scalars += [*zip(point, value, strict=True), (fmpq(1), fmpq(0))]
            for i in range(n):
                # component i of f' (phi e_k) - e_k (grad phi . f) for all k and phi
                rows.append(
                    [
                        jacobian[i, k] * phi - (derivative if i == k else 0)
                        for k, (phi, derivative) in itertools.product(range(n), scalars)
                    ]
                )
        count_work(500 + len(rows) * len(rows[0]) * (2 + len(rows[0]) / 400))
        kernel = nullspace(QQ, fmpq_mat(rows))
        if len(kernel) > MAX_DIMENSION:
            return CommutingSpace((f,), (QQ.identity(n),) * (shape == "linear"), len(kernel))
        solutions = [[fmpq(e) for e in primitive_integers(v)] for v in kernel]
        matrices: list[fmpq_mat] = []
        if shape == "linear":
            for v in solutions:
                matrices.append(fmpq_mat(n, n))
                for (i, j), entry in zip(itertools.product(range(n), columns), v, strict=True):
                    matrices[-1][i, j] = entry
            fields = [f.transformed(B) for B in matrices]
        else:
            size = len(solutions[0]) // n
            fields = [system_of(f.variables, [v[i * size : (i + 1) * size] for i in range(n)]) for v in solutions]
        if all(bracket_vanishes(f, g) for g in fields):
            if C is not None:
                defects = []  # all coefficients of C g' - g' C
                for g in fields:
                    zero, defect = 0 * g.rhs[0], list[fmpq]()
                    for i, j in itertools.product(range(n), repeat=2):
                        terms = (C[i, k] * g.rhs[k].derivative(j) - C[k, j] * g.rhs[i].derivative(k) for k in range(n))
                        polynomial = sum(terms, zero)
                        defect += [fmpq(polynomial[tuple(int(l == k) for l in range(n))]) for k in range(n + 1)]
                    defects.append(defect)
                combinations = nullspace(QQ, fmpq_mat(defects).transpose())
                fields = [system_of(f.variables, combination(fields, w, fmpq(0))) for w in combinations]
                matrices = [combination_of(w, matrices) for w in combinations] if matrices else []
            # Replace one member of the basis by f, and move f to the front.
            flat_matrix = fmpq_mat([[e for row in coefficients_of(g) for e in row] for g in [*fields, f]]).transpose()
            (relation,) = nullspace(QQ, flat_matrix)
            replaced_index = max(k for k in range(len(fields)) if relation[k] != 0)
            other_indices = [k for k in range(len(fields)) if k != replaced_index]
            identity = [QQ.identity(n)] if matrices else []
            basis = (f, *(fields[k] for k in other_indices))
            return CommutingSpace(basis, (*identity, *(matrices[k] for k in other_indices if matrices)), len(basis))
        row_count = len(rows) + 2 * n


def bracket_vanishes(f: QuadraticSystem, g: QuadraticSystem) -> bool:
    """Return whether f' g - g' f = 0, as polynomials.

    >>> f = QuadraticSystem.from_text(["x", "y"], ["x^2", "y^2"])
    >>> bracket_vanishes(f, f), bracket_vanishes(f, QuadraticSystem.from_text(["x", "y"], ["x", "y"]))
    (True, False)
    """
    return all(
        sum((a.derivative(k) * g.rhs[k] - b.derivative(k) * f.rhs[k] for k in range(f.dim)), 0 * a).is_zero()
        for a, b in zip(f.rhs, g.rhs, strict=True)
    )


def _independent_components(f: QuadraticSystem) -> list[int]:
    """Return the indices of a basis of the span of the components of f: each one extends the basis of earlier ones."""
    reduced_matrix, rank = fmpq_mat(coefficients_of(f)).transpose().rref()
    return [next(j for j in range(f.dim) if reduced_matrix[i, j] != 0) for i in range(rank)]


def field_at(space: CommutingSpace, weights: Sequence[fmpq]) -> QuadraticSystem:
    """Return the field sum_i weights[i] fields[i]."""
    return system_of(space.fields[0].variables, combination(space.fields, weights, fmpq(0)))
