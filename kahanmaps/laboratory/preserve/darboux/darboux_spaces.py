"""Spaces of discrete Darboux polynomials with one common, unknown cofactor, modulo a prime.

If P o Phi = C P and Q o Phi = C Q with the same rational function C, then P/Q is an integral, and P - c Q vanishes
along the orbits on which P/Q = c. The search reverses this:

1. The relations of degree d along all orbits (hirota_kimura.py) span a space W of polynomials. P and Q belong to W.
2. Let w_a be a basis of W. The antisymmetric matrices A with sum A_ab (w_a(x~) w_b(x) - w_b(x~) w_a(x)) = 0 for all x
   form a linear space. For every subspace U of W with a common cofactor it contains all antisymmetric matrices on U.
3. The matrices E with E A = A E^T for all these A are scalars on each U, so each U is an eigenspace of a random E. If
   the sum of the spaces U is not direct, the search looks for matrices A of rank 2, whose 4 x 4 Pfaffians vanish.

The multiples of known spaces of lower degree span a subspace W_T of W. Let V be a complement of W_T. The spaces U are
determined modulo W_T first, from the entries of A with both indices in V. The entries of A with one index in V and the
other in W_T then give the elements of W_T that must be added to elements of V to obtain Darboux polynomials.

Sources: petrera-pfadler-suris-2009 for the relations, celledoni-2019 for discrete Darboux polynomials.

The same search works for functions of a point and its k-th iterate instead of polynomials of degree 2
(`TwoPointBasis`). With X = (1, x) and Y = (1, y), where y is the k-th iterate of x, the monomial X_i X_j stands for the
polarized form X_i Y_j + X_j Y_i, or for the Wronskian X_i Y_j - X_j Y_i. These functions satisfy linear relations along
orbits, as monomials do, and the same null spaces give their combinations with a common cofactor.

If the s functions F of a space satisfy s - 2 independent relations along every orbit, ratios of two functions need not
be integrals, but the ratios of minors (F_a F_b~ - F_b F_a~)/(F_c F_d~ - F_d F_c~) are integrals (F~ is F one step
later). Indeed, the vectors F on an orbit lie in a plane with these Pluecker coordinates. Source: petrera-suris-2018.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

from flint import nmod_mat

from kahanmaps.algebra.matrices import combination_of
from kahanmaps.algebra.modular_matrices import combine, echelon, integers, matrix, multiply, null_space, pivots, rank
from kahanmaps.algebra.work import count_work
from kahanmaps.laboratory.modular_points import (
    ModularMap,
    NoPoint,
    Point,
    Values,
    exponents_up_to,
    gradient_values,
    product_of,
)
from kahanmaps.laboratory.preserve.hirota_kimura import relations_on_orbit, span_of_relations

_SPARE = 8  # points beyond the number of unknowns
_MAX_MATRICES = 12  # antisymmetric matrices A that are used
# Bounds of the number s of rows of A: to solve for its s (s - 1)/2 entries takes 0.2 seconds for s = 30, 10 for s = 60.
SMALL_SPAN, LARGEST_SPAN = 30, 60
TWO_POINT_DEGREE = 2  # of the monomials that encode functions of a point and an iterate

Vectors = list[list[int]]
Pattern = tuple[tuple[bool, ...], ...]


@dataclass(frozen=True)
class DarbouxSpace:
    """A space of polynomials of degree at most `degree` with one common cofactor, modulo a prime.

    `basis` has coefficient vectors on `exponents_up_to(dim, degree)`; ratios of two elements are integrals. The
    coefficient of the largest monomial of each element is 1. If the dimension is 2, the basis has the two sparsest
    elements, ordered by degree, then by number of terms; if not, it is the reduced echelon basis for descending
    monomials. The first element is the denominator of integrals.
    """

    dim: int
    degree: int
    basis: Vectors

    @classmethod
    def spanned_by(
        cls, dim: int, degree: int, vectors: Vectors, prime: int, indices: Sequence[int] | None = None
    ) -> DarbouxSpace:
        """Return the span of vectors of coefficients modulo a prime: of all monomials, or of those with `indices`."""
        if indices is not None:
            full_rows = [[0] * len(exponents_up_to(dim, degree)) for _ in vectors]
            for row, vector in zip(full_rows, vectors, strict=True):
                for k, entry in zip(indices, vector, strict=True):
                    row[k] = entry
            vectors = full_rows
        descending_rows = echelon([vector[::-1] for vector in vectors], prime)
        basis = [vector[::-1] for vector in reversed(descending_rows)]
        if len(basis) != 2:
            return cls(dim, degree, basis)
        # The two sparsest combinations of P and Q are among those in which a monomial of P or Q does not occur.
        P, Q = basis
        degrees = [sum(exponent) for exponent in exponents_up_to(dim, degree)]
        count_work(len(P) + 2 * len(degrees))
        support = [k for k, pair in enumerate(zip(P, Q, strict=True)) if any(pair)]
        zero_sets: dict[int | None, set[int]] = {}  # by the number P_k/Q_k: the absent monomials k
        for k in support:
            zero_sets.setdefault(P[k] * pow(Q[k], -1, prime) % prime if Q[k] else None, set()).add(k)
        supports = [([k for k in support if k not in zeros], min(zeros)) for zeros in zero_sets.values()]
        elements = []
        for terms, zero in sorted(supports, key=lambda pair: (degrees[pair[0][-1]], len(pair[0]), pair[0]))[:2]:
            element = [(Q[zero] * p - P[zero] * q) % prime for p, q in zip(P, Q, strict=True)]
            inverse = pow(element[terms[-1]], -1, prime)
            elements.append([c * inverse % prime for c in element])
        return cls(dim, degree, elements)

    @property
    def support(self) -> tuple[tuple[int, ...], ...]:
        """The exponents of the monomials that occur in the space."""
        exponents = exponents_up_to(self.dim, self.degree)
        return tuple(exponents[k] for k in self.indices)

    @property
    def indices(self) -> list[int]:
        """The indices of the monomials that occur in the space."""
        return [k for k, entries in enumerate(zip(*self.basis, strict=True)) if any(entries)]

    @property
    def pattern(self) -> Pattern:
        """The zero pattern of the basis: True for each nonzero entry."""
        return tuple(tuple(bool(entry) for entry in vector) for vector in self.basis)

    def multiples(self, degree: int, prime: int) -> Vectors:
        """Return a basis of the span of the products of elements and monomials, up to a degree."""
        factors = [[0] * k + [1] for k in range(len(exponents_up_to(self.dim, degree - self.degree)))]
        rows = [product_of(P, vector, self.dim, degree, prime) for P in factors for vector in self.basis]
        return echelon([row for row in rows if row is not None], prime)


def darboux_spaces(
    map_: ModularMap, degree: int, known_spaces: Sequence[DarbouxSpace] = (), max_span: int = LARGEST_SPAN
) -> list[DarbouxSpace] | None:
    """Find the spaces of degree `degree` that are not multiples of the spaces `known_spaces` of lower degree.

    Returns None if the search would be too large: relations and multiples span more than `max_span` dimensions. There
    may be relations outside all spaces. Their coefficients are integrals other than P/Q with P and Q of this degree.
    """
    prime = map_.prime
    span = span_of_relations(map_, degree, 2 * LARGEST_SPAN)
    if len(span) > 2 * LARGEST_SPAN:
        return None
    multiples = echelon([row for space in known_spaces for row in space.multiples(degree, prime)], prime)
    # `complement` completes the multiples of known spaces to a basis of the span of the multiples and relations.
    stacked_rows = [*multiples, *span]
    independent_indices = pivots(echelon(list(zip(*stacked_rows, strict=True)), prime)) if stacked_rows else []
    complement = [stacked_rows[k] for k in independent_indices if k >= len(multiples)]
    if not complement:
        return []
    if not multiples and _is_darboux(map_, complement, degree):
        return [DarbouxSpace.spanned_by(map_.dim, degree, complement, prime)]
    if len(complement) + len(multiples) > max_span:
        return None
    # A basis of the antisymmetric A with sum A_ab w_a(x~) w_b(x) = 0 for all x, w = complement + multiples.
    size = len(complement) + len(multiples)
    upper_positions = [(a, b) for a in range(size) for b in range(a + 1, size)]
    values, image_values = _evaluate_at_random_points(
        map_, [*complement, *multiples], degree, len(upper_positions) + _SPARE
    )
    count_work(len(upper_positions) ** 2 / 2)
    rows = []
    for x, y in zip(integers(values), integers(image_values), strict=True):
        rows.append([(y[a] * x[b] - y[b] * x[a]) % prime for a, b in upper_positions])
    solutions = []
    for vector in null_space(rows, len(upper_positions), prime):
        A = nmod_mat(size, size, prime)
        for (a, b), entry in zip(upper_positions, vector, strict=True):
            A[a, b] = entry
            A[b, a] = -entry
        solutions.append(A)
    bases = [
        basis for basis in _separate_spaces(solutions, complement, multiples, prime) if _is_darboux(map_, basis, degree)
    ]
    if not bases and not multiples:
        bases = [basis for basis in _rank_two_spaces(solutions, complement, prime) if _is_darboux(map_, basis, degree)]
    return [DarbouxSpace.spanned_by(map_.dim, degree, basis, prime) for basis in bases]


def _evaluate_at_random_points(map_: ModularMap, basis: Vectors, degree: int, count: int) -> tuple[nmod_mat, nmod_mat]:
    """Return the values of a basis of polynomials at random points and at their images, one row for each point."""
    prime = map_.prime
    polynomials = matrix(basis, prime).transpose()
    values, image_values = (
        multiply(matrix(rows, prime), polynomials)
        for rows in zip(*(map_.monomials_at_both(x, image, degree) for x, image in map_.pairs(count)), strict=True)
    )
    return values, image_values


def _is_darboux(map_: ModularMap, basis: Vectors, degree: int) -> bool:
    """Return whether all ratios of the polynomials are conserved at random points."""
    u, v = _evaluate_at_random_points(map_, basis, degree, 6)
    return all(u[i, 0] * v[i, a] == u[i, a] * v[i, 0] for i in range(u.nrows()) for a in range(1, len(basis)))


def _separate_spaces(solutions: list[nmod_mat], complement: Vectors, multiples: Vectors, prime: int) -> list[Vectors]:
    """Compute the spaces with a common cofactor from `solutions`, the matrices A on complement + multiples.

    Let B be the block of A on the complement. The projections of the spaces to the complement are eigenspaces of a
    random E such that E B = B E^T for every A.
    """
    k, size, rng = len(complement), len(complement) + len(multiples), random.Random(prime)
    # The columns of the blocks B span the sum of these projections. With an echelon basis b_i of the sum, each block is
    # sum A'_ij b_i b_j^T, where A' has the entries of B at the pivots.
    count_work(len(solutions) * k**2)
    coordinates = echelon([[int(A[a, b]) for a in range(k)] for A in solutions for b in range(k)], prime)
    n, pivot_columns = len(coordinates), pivots(coordinates)
    if n < 2:
        return []
    count_work(len(solutions) * n**2)
    blocks = [nmod_mat([[int(A[i, j]) for j in pivot_columns] for i in pivot_columns], prime) for A in solutions]
    if len(blocks) > _MAX_MATRICES:  # a few random combinations give the same conditions on E
        blocks = [combination_of([rng.randrange(prime) for _ in blocks], blocks) for _ in range(_MAX_MATRICES)]
    rows = []
    count_work(n**3 + n**4 / 100)
    for A in blocks[:2]:  # two A leave few E with E A = A E^T; the other A then restrict these E
        for i in range(n):
            for j in range(i, n):
                row = [0] * (n * n)
                for m in range(n):  # (E A)_ij - (A E^T)_ij = sum E_im A_mj - A_im E_jm
                    row[i * n + m] = (row[i * n + m] + int(A[m, j])) % prime
                    row[j * n + m] = (row[j * n + m] - int(A[i, m])) % prime
                rows.append(row)
    algebra = [nmod_mat(n, n, entries, prime) for entries in null_space(rows, n * n, prime)]
    for A in blocks[2:]:
        count_work(len(algebra) * (n**3 / 500 + n**2))
        differences = [(E * A - A * E.transpose()).entries() for E in algebra]
        weights = null_space([list(map(int, row)) for row in zip(*differences, strict=True)], len(algebra), prime)
        algebra = [combination_of(vector, algebra) for vector in weights]
    E = combination_of([rng.randrange(prime) for _ in algebra], algebra)
    spaces = []
    count_work(10 + 2 * n**3)
    for factor, _ in E.charpoly().factor()[1]:
        if factor.degree() != 1:
            continue  # the spaces of this factor are conjugate over an extension of the field
        root = -int(factor[0]) * pow(int(factor[1]), -1, prime) % prime
        shifted_matrix = [[(int(E[i, j]) - (root if i == j else 0)) % prime for j in range(n)] for i in range(n)]
        eigenvectors = null_space(shifted_matrix, n, prime)
        if len(eigenvectors) > 1:
            block = echelon(combine(eigenvectors, coordinates, prime), prime)
            completed_block = _add_corrections(solutions, block, k, size, prime)
            if completed_block is not None:
                spaces.append(echelon(combine(completed_block, [*complement, *multiples], prime), prime))
    return spaces


def _rank_two_spaces(solutions: list[nmod_mat], complement: Vectors, prime: int) -> list[Vectors]:
    """Return the row space of the combination sum c_s A_s of rank 2 of few matrices A_s; [] if c is not determined.

    The 4 x 4 Pfaffians of sum c_s A_s are quadratic forms in c. They annihilate the symmetric matrix c c^T of a common
    zero c. If all symmetric matrices that they annihilate are multiples of one matrix, it gives c up to a factor.
    """
    count = len(solutions)
    if not 1 <= count <= _MAX_MATRICES:
        return []
    rng = random.Random(prime)
    size = len(complement)
    pairs = [(s, t) for s in range(count) for t in range(s, count)]
    rows = []
    count_work(2 * len(pairs) * (2 * size + count * (3 + size**2 / 100) + 5 * len(pairs)))
    for _ in range(2 * len(pairs)):
        compression = nmod_mat(4, size, [rng.randrange(prime) for _ in range(4 * size)], prime)
        forms = [compression * A * compression.transpose() for A in solutions]

        def pfaffian(A: nmod_mat, B: nmod_mat) -> int:
            return int(
                A[0, 1] * B[2, 3]
                - A[0, 2] * B[1, 3]
                + A[0, 3] * B[1, 2]
                + B[0, 1] * A[2, 3]
                - B[0, 2] * A[1, 3]
                + B[0, 3] * A[1, 2]
            )

        # The coefficient of c_s c_t in the Pfaffian is its polar form at (A_s, A_t), or half of this if s = t.
        one_half = (prime + 1) // 2
        rows.append([pfaffian(forms[s], forms[t]) * (one_half if s == t else 1) % prime for s, t in pairs])
    zeros = null_space(rows, len(pairs), prime)
    if len(zeros) != 1:
        return []
    products = dict(zip(pairs, zeros[0], strict=True))
    pivot = next((s for s in range(count) if products[s, s]), None)
    if pivot is None:
        return []
    form = combination_of([products[min(pivot, t), max(pivot, t)] for t in range(count)], solutions)
    coordinates = echelon(integers(form), prime)
    return [echelon(combine(coordinates, complement, prime), prime)] if len(coordinates) == 2 else []


def _add_corrections(solutions: list[nmod_mat], block: Vectors, k: int, size: int, prime: int) -> Vectors | None:
    """Complete a basis `block` of the projection of a space to the complement by components in the multiples.

    Returns coordinates on complement + multiples, or None if the matrices do not determine these components.
    """
    if size == k:
        return block
    # Take the combinations of the A whose blocks on the complement belong to this space: the columns of such blocks are
    # combinations of the vectors of `block`.
    block_pivots = pivots(block)
    other_indices = [i for i in range(k) if i not in block_pivots]
    conditions = []
    count_work(k * len(other_indices) * len(solutions) * len(block_pivots) / 2)
    for b in range(k):
        for i in other_indices:
            # entry (i, b) is determined by the entries (pivot, b)
            conditions.append(
                [
                    (int(A[i, b]) - sum(int(A[p, b]) * row[i] for p, row in zip(block_pivots, block, strict=True)))
                    % prime
                    for A in solutions
                ]
            )
    combinations = null_space(conditions, len(solutions), prime)
    n = len(block)
    equations = []
    for weights in combinations:
        A = combination_of(weights, solutions)
        for p in block_pivots:
            # A = sum a_pq (p + w_p)(q + w_q)^T with corrections w: row p has the entries sum_q a_pq w_q on multiples
            equations.append([int(A[p, q]) for q in block_pivots] + [int(A[p, t]) for t in range(k, size)])
    reduced_equations = echelon(equations, prime)
    if len(reduced_equations) < n or any(reduced_equations[i][j] != (i == j) for i in range(n) for j in range(n)):
        return None
    return [[*block[i], *reduced_equations[i][n:]] for i in range(n)]


def gradient_rank(map_: ModularMap, spaces: Sequence[DarbouxSpace]) -> int:
    """Return the number of independent integrals among ratios of two elements of a space, at a random point."""
    return rank(gradients_of_ratios(map_.random_point(), spaces, map_.prime), map_.prime)


def gradients_of_ratios(x: Point, spaces: Sequence[DarbouxSpace], prime: int) -> Vectors:
    """Return multiples of the gradients, at a point x, of the ratios of elements of each space to its first element."""
    rows = []
    for space in spaces:
        values = [gradient_values(vector, x, space.degree, prime) for vector in space.basis]
        q, dq = values[0]
        for p, dp in values[1:]:
            rows.append([(q * a - p * b) % prime for a, b in zip(dp, dq, strict=True)])
    return rows


class TwoPointBasis(NamedTuple):
    """A basis of bilinear forms in (1, x) and (1, y), where y is the k-th iterate of x.

    `shift` is k; `sign` is 1 for symmetric forms and -1 for Wronskians. `rank` is 1 or 2: the dimension of the span of
    the vectors (F_1, ..., F_s) along an orbit, where F_1, ..., F_s is a basis of a space of such forms.
    """

    shift: int
    sign: int
    rank: int = 1

    @property
    def text(self) -> str:
        """A phrase on the origin of integrals that are formed from these functions."""
        if self.shift == 0:
            return "relations of degree 2 along orbits on levels of the affine integrals"
        kind = "bilinear relations" if self.sign > 0 else "relations of Wronskians"
        minors = ", 2 x 2 minors" if self.rank == 2 else ""
        return f"{kind} between x and x{'~' * self.shift}{minors}"


TWO_POINT_BASES = (
    TwoPointBasis(0, 1),
    TwoPointBasis(1, 1),
    TwoPointBasis(1, -1),
    TwoPointBasis(2, -1),
    TwoPointBasis(3, -1),
    TwoPointBasis(4, -1),
)


@cache
def pairs_of(dim: int) -> tuple[tuple[int, int], ...]:
    """Return, for each monomial of degree at most 2, the indices i <= j of its two factors in (1, x)."""
    pairs = []
    for exponent in exponents_up_to(dim, TWO_POINT_DEGREE):
        factors = [k for k, e in enumerate(exponent, 1) for _ in range(e)]
        i, j = [0] * (TWO_POINT_DEGREE - len(factors)) + factors
        pairs.append((i, j))
    return tuple(pairs)


class TwoPointMap(ModularMap):
    """A map modulo a prime that gives monomials of degree at most 2 the values of a `TwoPointBasis`."""

    def __init__(self, base: ModularMap, two_point_basis: TwoPointBasis) -> None:
        # The map and the random generator are those of `base`; only the values of monomials differ.
        self.prime, self.eps, self.dim, self.values = base.prime, base.eps, base.dim, base.values
        self.rng, self.map, self.two_point_basis = base.rng, base.map, two_point_basis

    def _bilinear_values(self, x: Point, y: Point) -> list[int]:
        p, sign, X, Y = self.prime, self.two_point_basis.sign, (1, *x), (1, *y)
        count_work(len(pairs_of(self.dim)) / 2)
        # The Wronskian that stands for a square is 0. Random numbers replace it, so that no relation contains it.
        return [
            self.rng.randrange(p) if sign < 0 and i == j else (X[i] * Y[j] + sign * X[j] * Y[i]) % p
            for i, j in pairs_of(self.dim)
        ]

    def along_orbit(
        self, degree: int, count: int, support: Sequence[int] | None = None
    ) -> tuple[Sequence[Values], Point, int | None]:
        """Return the values of the basis along an orbit, the first point, and the period (None: orbit not closed)."""
        points, shift = self.orbit(count + self.two_point_basis.shift), self.two_point_basis.shift
        is_closed = len(points) < count + shift
        shifted_points = points[shift % len(points) :] + (points[: shift % len(points)] if is_closed else [])
        rows = [self._bilinear_values(x, y) for x, y in zip(points, shifted_points, strict=False)]
        supported_rows = rows if support is None else [[row[k] for k in support] for row in rows]
        return supported_rows, points[0], len(points) if is_closed else None

    def monomials_at_both(
        self, x: Point, image: Point, degree: int, factors: tuple[int, int] = (1, 1)
    ) -> tuple[Values, Values]:
        """Return the values of the basis at a point, times factors[0], and at its image, times factors[1]."""
        points = [x, image]
        while len(points) < self.two_point_basis.shift + 2:
            next_point = self.step(points[-1])
            if next_point is None:
                raise NoPoint("an iterate of a random point modulo a prime is an indeterminacy point")
            points.append(next_point)
        at_point, at_image = (self._bilinear_values(points[k], points[k + self.two_point_basis.shift]) for k in (0, 1))
        return [factors[0] * value for value in at_point], [factors[1] * value for value in at_image]


def two_point_spaces(map_: ModularMap, basis: TwoPointBasis) -> list[DarbouxSpace]:
    """Find the spaces of functions of two points with a common cofactor.

    For rank 2 the result is a single space, of all functions that occur in relations along orbits.
    """
    two_point_map = TwoPointMap(map_, basis)
    if basis.rank == 1:
        return darboux_spaces(two_point_map, TWO_POINT_DEGREE) or []
    span = span_of_relations(two_point_map, TWO_POINT_DEGREE)
    if len(span) - relations_on_orbit(two_point_map, TWO_POINT_DEGREE).dimension != basis.rank:
        return []
    return [DarbouxSpace.spanned_by(map_.dim, TWO_POINT_DEGREE, span, map_.prime)]


def bases_with_spaces(
    map_: ModularMap, bases: Sequence[TwoPointBasis] = TWO_POINT_BASES
) -> list[tuple[TwoPointBasis, list[DarbouxSpace]]]:
    """Return pairs (basis, its spaces) for each basis with spaces of rank 1 or, if there are none, of rank 2."""
    pairs = []
    for basis in bases:
        for candidate in (basis, basis._replace(rank=2)):
            spaces = two_point_spaces(map_, candidate)
            if spaces:
                pairs.append((candidate, spaces))
                break
    return pairs
