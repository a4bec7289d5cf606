"""Skew-Hamiltonian matrices: A^T J = J A, with J = [[0, I], [-I, 0]].

In blocks, A = [[W, X], [Y, W^T]] with X and Y skew. The characteristic polynomial is a square chi^2 with chi of degree
m; A is generic if chi has no repeated root. Sources: petrera-suris-2016, eqs. (cond A), (cond2);
fassbender-1999.
"""

from __future__ import annotations

import random
from dataclasses import dataclass

from flint import fmpq, fmpq_mat, fmpq_poly

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.printing import format_number
from kahanmaps.algebra.printing import format_univariate as format_univariate
from kahanmaps.errors import HypothesisError
from kahanmaps.systems.hamiltonian import standard_structure


@dataclass(frozen=True)
class Factor:
    """An irreducible factor of chi over Q, monic, with its multiplicity."""

    polynomial: fmpq_poly
    multiplicity: int

    @property
    def degree(self) -> int:
        return int(self.polynomial.degree())

    @property
    def root(self) -> fmpq | None:
        """The root if the factor is linear, otherwise None."""
        return -self.polynomial[0] if self.degree == 1 else None

    def __str__(self) -> str:
        return format_univariate(self.polynomial)


def defects(A: fmpq_mat) -> list[str]:
    """Return the conditions for a skew-Hamiltonian matrix that A violates, entry by entry; empty if there are none.

    >>> defects(fmpq_mat([[1, 2], [0, 1]]))
    ['entry (1,2) is 2, expected 0: the upper right block must be skew']
    """
    n = A.nrows()
    if n != A.ncols() or n % 2 or n == 0:
        return [f"A is {n} x {A.ncols()}, expected a square matrix of even size 2m"]
    m, J = n // 2, standard_structure(n)
    expected_matrix = -(J * A.transpose() * J)  # equal to A if and only if A^T J = J A
    skew_rule = "block must be skew"
    messages = []
    for rule, top_row, left_column in (
        ("lower right block must be the transpose of the upper left one", m, m),
        (f"upper right {skew_rule}", 0, m),
        (f"lower left {skew_rule}", m, 0),
    ):
        for i in range(m):
            for j in range(0 if top_row == left_column else i, m):
                row, column = top_row + j, left_column + i
                expected_entry = fmpq(0) if top_row != left_column and i == j else expected_matrix[row, column]
                if A[row, column] != expected_entry:
                    position_text = f"entry ({row + 1},{column + 1})"
                    texts = _short_text(A[row, column]), _short_text(expected_entry)
                    messages.append(f"{position_text} is {texts[0]}, expected {texts[1]}: the {rule}")
    return messages


def require_skew_hamiltonian(A: fmpq_mat) -> None:
    """Raise HypothesisError, with the wrong entries, unless A^T J = J A."""
    messages = defects(A)
    if messages:
        first_messages = messages[:4]
        if len(messages) > len(first_messages):
            first_messages.append(f"and {len(messages) - len(first_messages)} more")
        raise HypothesisError("A is not skew-Hamiltonian: " + "; ".join(first_messages))


def factors_of_chi(A: fmpq_mat) -> tuple[Factor, ...]:
    """Return the irreducible factors of chi, where det(t - A) = chi(t)^2.

    The signs that define an associated system are in the same order: linear factors come first, by increasing root,
    then the others by degree, and by the coefficients of the monic polynomial, constant term first.
    """
    require_skew_hamiltonian(A)
    _, pairs = A.charpoly().factor()
    factors = []
    for polynomial, multiplicity in pairs:
        monic_polynomial = fmpq_poly(polynomial.coeffs()) / polynomial.leading_coefficient()
        factors.append(Factor(monic_polynomial, multiplicity // 2))

    def sort_key(factor: Factor) -> tuple[int, tuple[fmpq, ...]]:
        return factor.degree, (-factor.polynomial[0],) if factor.degree == 1 else tuple(factor.polynomial.coeffs())

    return tuple(sorted(factors, key=sort_key))


def chi(A: fmpq_mat) -> fmpq_poly:
    """Return the monic polynomial chi of degree m with det(t - A) = chi(t)^2.

    >>> format_univariate(chi(fmpq_mat([[3, 0], [0, 3]])))
    't - 3'
    """
    product = fmpq_poly([1])
    for factor in factors_of_chi(A):
        product *= factor.polynomial**factor.multiplicity
    return product


def diagnosis(A: fmpq_mat) -> str:
    """Describe how chi factors over Q, and what this means for A and its associated systems."""
    factors = factors_of_chi(A)
    repeated_factors = [factor for factor in factors if factor.multiplicity > 1]
    chi_text = " ".join(
        f"({factor})" + (f"^{factor.multiplicity}" if factor.multiplicity > 1 else "") for factor in factors
    )
    if not repeated_factors:
        if all(factor.degree == 1 for factor in factors):
            splitting_text = "all roots rational"
        elif len(factors) == 1:
            splitting_text = "irreducible over Q"
        else:
            splitting_text = f"{len(factors)} irreducible factors over Q"
        return f"A is generic: chi = {chi_text}, without repeated roots, {splitting_text}"
    repeated_text = ", ".join(f"({factor}) {factor.multiplicity} times" for factor in repeated_factors)
    beginning_text = f"A is not generic: chi = {chi_text} has repeated roots, {repeated_text}"
    degree = minimal_degree(A)
    m = sum(factor.degree * factor.multiplicity for factor in factors)
    if degree == m:
        return (
            f"{beginning_text}; A is not diagonalisable, but chi is its minimal polynomial. The space of cubics has "
            "dimension 4m, and the invariant Poisson structure and m independent integrals are there as for distinct "
            "roots"
        )
    is_diagonalisable = degree == sum(factor.degree for factor in factors)
    return (
        f"{beginning_text}; A is derogatory: its minimal polynomial has degree {degree}, less than m = {m}; A is "
        f"{'diagonalisable' if is_diagonalisable else 'not diagonalisable'}. The space of cubics is larger than 4m, "
        "and the theorems on the invariant Poisson structure and m independent integrals do not apply; commutativity "
        "of associated maps does"
    )


def minimal_degree(A: fmpq_mat) -> int:
    """Return the degree of the minimal polynomial of A, at most m; A is called derogatory if it is less than m.

    >>> minimal_degree(fmpq_mat([[3, 0], [0, 3]]))
    1
    """
    return int(A.minpoly().degree())


def evaluate_at_matrix(polynomial: fmpq_poly, A: fmpq_mat) -> fmpq_mat:
    """Return polynomial(A), by Horner's scheme."""
    n = A.nrows()
    identity: fmpq_mat = QQ.identity(n)
    value = fmpq_mat(n, n)
    for coefficient in reversed(polynomial.coeffs()):
        value = value * A + identity * coefficient
    return value


def companion_matrix(chi: fmpq_poly) -> fmpq_mat:
    """Return the matrix of multiplication by t on Q[t]/chi in the basis 1, t, ..., t^(m-1), for chi of degree m.

    >>> companion_matrix(fmpq_poly([-2, 0, 1]))
    [0, 2]
    [1, 0]
    """
    m = int(chi.degree())
    entries = [-chi[i] / chi[m] if j == m - 1 else fmpq(i == j + 1) for i in range(m) for j in range(m)]
    return fmpq_mat(m, m, entries)


def two_blocks(first: fmpq_mat, second: fmpq_mat) -> fmpq_mat:
    """Return diag(first, second) for two square matrices of the same size."""
    zeros = [fmpq(0)] * first.nrows()
    return fmpq_mat([[*row, *zeros] for row in first.tolist()] + [[*zeros, *row] for row in second.tolist()])


def random_symplectic(m: int, rng: random.Random, rounds: int = 2) -> fmpq_mat:
    """Return a random integer matrix S with S^T J S = J and small entries, a product of elementary symplectic matrices.

    Each factor has only a few nonzero off-diagonal entries, so that transformed systems keep small coefficients.
    """
    n = 2 * m
    S: fmpq_mat = QQ.identity(n)

    def add(to: int, source: int, times: int) -> None:
        """Add `times` times row `source` of S to row `to`."""
        nonlocal S
        elementary = QQ.identity(n)
        elementary[to, source] = elementary[to, source] + times
        S = elementary * S

    for _ in range(rounds):
        permutation = list(range(m))
        rng.shuffle(permutation)
        for i, j in zip(permutation, permutation[1:] + permutation[:1], strict=True):
            sign = rng.choice((-1, 1))
            if i != j:  # q_i += s q_j requires p_j -= s p_i
                add(i, j, sign)
                add(m + j, m + i, -sign)
            shear = rng.choice((-1, 1))
            if rng.random() < 0.5:  # q += X p for a symmetric X
                add(i, m + j, shear)
                if i != j:
                    add(j, m + i, shear)
            else:  # p += Y q for a symmetric Y
                add(m + i, j, shear)
                if i != j:
                    add(m + j, i, shear)
    return S


def bits_of(number: fmpq) -> int:
    """Return the bits of numerator and denominator together, minus 1: the result is 1 for 1, and 0 for 0."""
    return int(abs(number.p).bit_length() + number.q.bit_length()) - 1


def symplectic_inverse(S: fmpq_mat) -> fmpq_mat:
    """Return S^{-1} = J^{-1} S^T J for symplectic S."""
    J = standard_structure(S.nrows())
    return -(J * S.transpose() * J)


def _short_text(number: fmpq) -> str:
    text = format_number(number)
    return text if len(text) <= 40 else f"{text[:18]}...{text[-18:]}"
