"""The cubics that belong to a skew-Hamiltonian A: A (Hess H) = (Hess H) A^T.

They form a vector space, of dimension 4m for generic A. Each H = H_0 starts a chain: grad H_i = A grad H_{i-1}.
Source: petrera-suris-2016, eqs. (d2H), (grad K), (grad L) and the proposition on dimension 12 for m = 3.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.matrices import nullspace, primitive_integers
from kahanmaps.algebra.polynomials import gradient, is_homogeneous, linear_combinations, monomials, names_of, ring
from kahanmaps.algebra.printing import format_number
from kahanmaps.errors import HypothesisError
from kahanmaps.family.skew_hamiltonian import require_skew_hamiltonian


@dataclass(frozen=True)
class CubicSpace:
    """The space of homogeneous cubics H with A (Hess H) = (Hess H) A^T, the solutions of a linear system.

    `basis` has primitive integer cubics, `unknown_count` and `rank` belong to the system, `expected_dimension` is 4m.
    """

    basis: tuple[fmpq_mpoly, ...]
    unknown_count: int
    rank: int
    expected_dimension: int

    @property
    def dimension(self) -> int:
        return len(self.basis)


def default_variables(dim: int) -> tuple[str, ...]:
    """Return the names x1, ..., x{dim}."""
    return tuple(f"x{i + 1}" for i in range(dim))


def cubic_space(A: fmpq_mat, variables: tuple[str, ...] | None = None) -> CubicSpace:
    """Compute the space of homogeneous cubics H with A Hess(H) = Hess(H) A^T for a skew-Hamiltonian A; exact.

    >>> space = cubic_space(fmpq_mat(4, 4, [1, 0, 0, 0,  0, 2, 0, 0,  0, 0, 1, 0,  0, 0, 0, 2]))
    >>> space.dimension, space.rank, space.unknown_count
    (8, 12, 20)
    """
    require_skew_hamiltonian(A)
    n = A.nrows()
    names = variables or default_variables(n)
    context = ring(names)
    exponents = list(monomials(n, 3))
    column = {_indices(exponent): k for k, exponent in enumerate(exponents)}
    weights = {indices: _third_derivative_of_monomial(indices) for indices in column}
    row_entries = [[(k, A[i, k]) for k in range(n) if A[i, k] != 0] for i in range(n)]
    zero = fmpq(0)
    coefficients: list[fmpq] = []
    equation_count = 0
    # A Hess(H) - Hess(H) A^T is skew and linear in x: it gives one equation for each entry i < j and each variable x_l.
    for i in range(n):
        for j in range(i + 1, n):
            for l in range(n):
                row = [zero] * len(exponents)
                for k, value in row_entries[i]:
                    indices = tuple(sorted((k, j, l)))
                    row[column[indices]] += value * weights[indices]
                for k, value in row_entries[j]:
                    indices = tuple(sorted((i, k, l)))
                    row[column[indices]] -= value * weights[indices]
                coefficients += row
                equation_count += 1
    solutions = nullspace(QQ, fmpq_mat(equation_count, len(exponents), coefficients))
    basis = tuple(
        context.from_dict({exponents[k]: fmpq(c) for k, c in enumerate(primitive_integers(vector)) if c != 0})
        for vector in solutions
    )
    return CubicSpace(basis, len(exponents), len(exponents) - len(basis), 2 * n)


def belongs(A: fmpq_mat, H: fmpq_mpoly) -> bool:
    """Return whether H is a homogeneous cubic with A (Hess H) = (Hess H) A^T."""
    return is_homogeneous(H, 3) and next(_failures(A, H), None) is None


def require_member(A: fmpq_mat, H: fmpq_mpoly) -> None:
    """Raise HypothesisError, naming a wrong entry, unless H is a homogeneous cubic with A (Hess H) = (Hess H) A^T."""
    if len(names_of(H)) != A.nrows():
        raise HypothesisError(
            f"A is {A.nrows()} x {A.ncols()} and H has {len(names_of(H))} variables, expected as many as A has rows"
        )
    if not is_homogeneous(H, 3):
        monomial = next(exponent for exponent in H.monoms() if sum(exponent) != 3)
        term = H.context().from_dict({tuple(monomial): fmpq(1)})
        raise HypothesisError(f"H has the term {term} of degree {sum(monomial)}, expected a homogeneous cubic")
    failure = next(_failures(A, H), None)
    if failure is not None:
        i, j, l, left, right = failure
        raise HypothesisError(
            "H is not in the space of A: A Hess(H) = Hess(H) A^T fails in entry "
            f"({i + 1},{j + 1}), where the coefficient of {names_of(H)[l]} is {format_number(left)} on the left and "
            f"{format_number(right)} on the right ('kahanmaps family space' shows the space)"
        )


def chain(A: fmpq_mat, H: fmpq_mpoly, length: int | None = None) -> tuple[fmpq_mpoly, ...]:
    """Return the chain H_0 = H, H_1, ... with grad H_i = A grad H_{i-1}, by default of length m.

    Raises HypothesisError if H does not belong to the cubics of A, so that no H_1 exists.
    """
    require_member(A, H)
    hamiltonians = [H]
    for _ in range((A.nrows() // 2 if length is None else length) - 1):
        hamiltonians.append(potential(linear_combinations(A, gradient(hamiltonians[-1]))))
    return tuple(hamiltonians)


def potential(field: tuple[fmpq_mpoly, ...]) -> fmpq_mpoly:
    """Return the homogeneous cubic H with grad H = `field`, by Euler's formula 3 H = x . grad H.

    Raises HypothesisError if the quadratic forms in `field` are not a gradient.
    """
    context = field[0].context()
    total = context.constant(0)
    for x, component in zip(context.gens(), field, strict=True):
        total = total + x * component
    H = total / 3
    if gradient(H) != field:
        raise HypothesisError("the vector of quadratic forms is not the gradient of a homogeneous cubic")
    return H


def _failures(A: fmpq_mat, H: fmpq_mpoly) -> Iterator[tuple[int, int, int, fmpq, fmpq]]:
    """Yield all (i, j, l, a, b) with the entries a of A T_l and b != a of T_l A^T at (i, j); T_l = d(Hess H)/dx_l."""
    n = A.nrows()
    for l, T in enumerate(third_derivatives(H)):
        left = A * T
        for i in range(n):
            for j in range(i + 1, n):
                if left[i, j] != left[j, i]:
                    yield i, j, l, left[i, j], left[j, i]


def third_derivatives(H: fmpq_mpoly) -> list[fmpq_mat]:
    """Return the constant matrices T_l = d(Hess H)/dx_l of a homogeneous cubic."""
    n = len(names_of(H))
    matrices = [[fmpq(0)] * (n * n) for _ in range(n)]
    for exponent, coefficient in H.terms():
        indices = _indices(tuple(exponent))
        value = coefficient * _third_derivative_of_monomial(indices)
        for a, b, c in {(indices[i], indices[j], indices[3 - i - j]) for i in range(3) for j in range(3) if i != j}:
            matrices[a][b * n + c] = value
    return [fmpq_mat(n, n, matrix) for matrix in matrices]


def _indices(exponents: tuple[int, ...]) -> tuple[int, ...]:
    """Return the indices of the three variables in a cubic monomial, in increasing order."""
    return tuple(i for i, exponent in enumerate(exponents) for _ in range(exponent))


def _third_derivative_of_monomial(indices: tuple[int, ...]) -> int:
    """Return the third derivative of the monomial: 6 for x^3, 2 for x^2 y, 1 for x y z."""
    return {1: 6, 2: 2, 3: 1}[len(set(indices))]
