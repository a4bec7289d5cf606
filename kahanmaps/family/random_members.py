"""Random members of the family, reproducible from a seed.

In the normal form, A = diag(W^T, W) with W = diag(eigenvalues) or W the companion matrix of chi, and the cubics of A
are known explicitly. In the first case they are sums of planar cubics. In the second case they are the coefficients of
t^(m-1) in cubic forms over Q[t]/chi in X and Y; X = q_1 + q_2 t + ..., and Y has the coordinates p_i in the dual basis.
A random symplectic integer matrix transforms the normal form, so that all numbers are small integers for every m.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly, fmpq_poly

from kahanmaps.algebra.fields import integer, rational
from kahanmaps.algebra.parsing import parse_polynomial
from kahanmaps.algebra.polynomials import linear_combinations, ring
from kahanmaps.errors import InputError
from kahanmaps.family.associated import FamilyMember
from kahanmaps.family.cubics import default_variables
from kahanmaps.family.skew_hamiltonian import companion_matrix, random_symplectic, symplectic_inverse, two_blocks
from kahanmaps.family.tensor import GENERATOR, components, split_names

MAX_M = 16  # for larger m, H may be longer than the texts that system files allow


def random_member_with_eigenvalues(eigenvalues: Sequence[Any], seed: int, size: int = 2) -> FamilyMember:
    """Return a random member whose A has these rational eigenvalues (each twice).

    `size` bounds the integer coefficients of the planar cubics. Repeated eigenvalues are allowed and give a
    diagonalizable, non-generic A.

    >>> member = random_member_with_eigenvalues([1, -2], seed=7)
    >>> [str(factor) for factor in member.factors]
    ['t + 2', 't - 1']
    """
    values = [rational(value) for value in eigenvalues]
    m = _require_m(len(values))
    _require_size(size)
    rng = random.Random(integer(seed, "the seed"))
    A_z = fmpq_mat(2 * m, 2 * m)
    for i, value in enumerate(values):
        A_z[i, i] = A_z[m + i, m + i] = value
    S = random_symplectic(m, rng)
    forms = _linear_forms(symplectic_inverse(S), default_variables(2 * m))
    H = forms[0].context().constant(0)
    for i in range(m):
        u, v = forms[i], forms[m + i]
        a = b = c = d = 0
        while _discriminant(a, b, c, d) == 0:  # a cubic with a double root is not generic
            a, b, c, d = (rng.randint(-size, size) for _ in range(4))
        H += a * u**3 + b * u**2 * v + c * u * v**2 + d * v**3
    return FamilyMember(_in_original_coordinates(A_z, S), H)


def random_member_with_chi(chi: fmpq_poly, seed: int, size: int = 1) -> FamilyMember:
    """Return a random member whose A has the characteristic polynomial chi(t)^2, with chi of degree m.

    `size` bounds the integer coefficients of the cubic form over Q[t]/chi. If chi has repeated roots, A has Jordan
    blocks.

    >>> random_member_with_chi(fmpq_poly([-2, 0, 1]), seed=7).factors[0].degree
    2
    """
    m = _require_m(chi.degree())
    _require_size(size)
    chi = chi / chi.leading_coefficient()
    rng = random.Random(integer(seed, "the seed"))
    companion = companion_matrix(chi)
    A_z = two_blocks(companion.transpose(), companion)
    S = random_symplectic(m, rng)
    forms = _linear_forms(symplectic_inverse(S), default_variables(2 * m))
    zero = forms[0].context().constant(0)
    # Y is in the basis dual to 1, t, ..., t^(m-1) under (a, b) -> coefficient of t^(m-1) in a b, so J is standard.
    Y = [zero] * m
    for j in range(m):
        for k in range(j, m):
            coefficient = fmpq(1) if k == m - 1 else chi[k + 1]
            Y[k - j] = Y[k - j] + coefficient * forms[m + j]
    coefficient_lists: list[list[int]] = []
    # The discriminant must be invertible: then the cubic has no double root, for any root of chi.
    while not coefficient_lists or _discriminant(*map(fmpq_poly, coefficient_lists)).gcd(chi).degree() != 0:
        coefficient_lists = []
        while len(coefficient_lists) < 4:
            numbers = [rng.randint(-size, size) for _ in range(m)]
            if any(numbers):
                coefficient_lists.append(numbers)
    X_, Y_, t = ring(["X", "Y", GENERATOR]).gens()
    a, b, c, d = (sum((t**k * c for k, c in enumerate(numbers)), 0 * t) for numbers in coefficient_lists)
    h = a * X_**3 + b * X_**2 * Y_ + c * X_ * Y_**2 + d * Y_**3
    H = components(h, split_names(["X", "Y"], m), chi)[m - 1].compose(*forms[:m], *Y, ctx=zero.context())
    return FamilyMember(_in_original_coordinates(A_z, S), H)


def random_member(m: int, seed: int, size: int = 1) -> FamilyMember:
    """Return a member of dimension 2m with a random integer chi without repeated roots, typically irreducible.

    >>> random_member(3, seed=7).is_generic
    True
    """
    m = _require_m(m)
    rng = random.Random(f"chi {seed}")
    while True:
        chi = fmpq_poly([rng.choice((-3, -2, -1, 1, 2, 3)), *(rng.randint(-2, 2) for _ in range(m - 1)), 1])
        if all(multiplicity == 1 for _, multiplicity in chi.factor()[1]):
            return random_member_with_chi(chi, seed, size)


def parse_chi(text: str) -> fmpq_poly:
    """Parse chi for `random_member_with_chi`, a polynomial in t of degree at least 1.

    >>> parse_chi("(t - 1)*(t^2 - 2)")
    x^3 + (-1)*x^2 + (-2)*x + 2
    """
    polynomial = parse_polynomial(text, ["t"])
    coefficients = {monomial[0]: coefficient for monomial, coefficient in polynomial.terms()}
    degree = max(coefficients, default=0)
    if degree < 1:
        raise InputError(f"found chi = {text}, expected a polynomial in t of degree m >= 1")
    return fmpq_poly([coefficients.get(k, 0) for k in range(degree + 1)])


def random_eigenvalues(m: int, seed: int) -> list[int]:
    """Return m distinct nonzero small integers, determined by the seed.

    >>> len(set(random_eigenvalues(5, seed=1)))
    5
    """
    m = _require_m(m)
    values = [value for value in range(-m - 1, m + 2) if value != 0]
    return random.Random(f"eigenvalues {seed}").sample(values, m)


def _in_original_coordinates(A_z: fmpq_mat, S: fmpq_mat) -> fmpq_mat:
    """Return A_x in the coordinates x = S z: since Hess_x = S^{-T} Hess_z S^{-1}, it is S^{-T} A_z S^T."""
    return symplectic_inverse(S).transpose() * A_z * S.transpose()


def _linear_forms(matrix: fmpq_mat, variables: tuple[str, ...]) -> tuple[fmpq_mpoly, ...]:
    """Return the rows of `matrix` as linear forms in the variables."""
    return linear_combinations(matrix, ring(variables).gens())


def _discriminant(a: Any, b: Any, c: Any, d: Any) -> Any:
    """Return the discriminant of a x^3 + b x^2 y + c x y^2 + d y^3."""
    return b * b * c * c - 4 * a * c**3 - 4 * b**3 * d - 27 * a * a * d * d + 18 * a * b * c * d


def _require_m(m: int) -> int:
    m = integer(m, "m")
    if not 1 <= m <= MAX_M:
        raise InputError(f"found m = {m}, expected 1 <= m <= {MAX_M} (dimension 2m)")
    return m


def _require_size(size: int) -> None:
    if size < 1:
        raise InputError(f"found the size {size}, expected at least 1: all coefficients would be 0")
