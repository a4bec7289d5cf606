"""Spaces of polynomials with one common cofactor, found without knowing the cofactor, modulo a prime.

If P o Phi = C P and Q o Phi = C Q with the same rational function C, then P/Q is an integral, P and Q are discrete
Darboux polynomials, and P - c Q vanishes along the orbits on which P/Q = c. Read backwards:

1. All relations of degree d of all orbits (hirota_kimura.py) span a space W of polynomials; it contains P and Q.
2. The antisymmetric matrices A on W with sum A_ab (w_a(x~) w_b(x) - w_b(x~) w_a(x)) = 0 for all x are a linear space
   that contains the sum over a, b in U of every space U with a common cofactor.
3. The matrices E with E A = A E^T for all these A are the scalars on each U; eigenvectors of a random E are the U.
   Where the sum is not direct, the A of rank 2 are sought instead, by the vanishing of their 4 x 4 Pfaffians.

What lower degrees explain is taken out first: W_T, the multiples of the spaces that are known. A matrix A that comes
from multiples lives on W_T alone. So the component of A that joins the complement of W_T with W_T tells how elements
of the complement are to be corrected to become Darboux polynomials.

Sources: petrera-pfadler-suris-2009 for the relations, celledoni-2019 for discrete Darboux polynomials.

Functions of a point and its k-th iterate can stand in the place of polynomials of degree 2 (`TwoPointBasis`).
With X = (1, x) and Y = (1, y), y the k-th iterate of x, the monomial X_i X_j stands for X_i Y_j + X_j Y_i, or for
X_i Y_j - X_j Y_i. The first are polarised quadratic polynomials, the second Wronskians. Along an orbit they satisfy
linear relations as monomials do, and the same null spaces tell which combinations have a common cofactor.

Where all s functions of a space satisfy s - 2 independent relations along every orbit, ratios of functions need not be
integrals, but those of minors (F_a F_b~ - F_b F_a~)/(F_c F_d~ - F_d F_c~) are, ~ a step later: the values of F along
an orbit lie in a plane, and its Pluecker coordinates are these minors. Source: petrera-suris-2018.
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
from kahanmaps.algebra.work import count as count_work
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

_SPARE = 8
_ENOUGH = 12
# Of W, whose dimension s gives s (s - 1)/2 unknown entries of A: 0.2 s and 10 s.
SMALL_SPAN, LARGEST_SPAN = 30, 60
TWO_POINT_DEGREE = 2  # of monomials that stand for functions of a point and an iterate

Vectors = list[list[int]]
Pattern = tuple[tuple[bool, ...], ...]


@dataclass(frozen=True)
class DarbouxSpace:
    """Polynomials of degree at most `degree` with one common cofactor, modulo a prime.

    `basis` is on `exponents_up_to(dim, degree)`; ratios of two elements are integrals. Every element ends in a 1 at its
    largest monomial. Two elements are the sparsest that there are, by degree, then by their number of terms; more are
    the reduced echelon basis for the monomials in falling order. The first is the natural denominator.
    """

    dim: int
    degree: int
    basis: Vectors

    @classmethod
    def spanned_by(
        cls, dim: int, degree: int, vectors: Vectors, prime: int, places: Sequence[int] | None = None
    ) -> DarbouxSpace:
        """The space that vectors span modulo a prime: on all monomials, or on those with the numbers `places`."""
        if places is not None:
            whole = [[0] * len(exponents_up_to(dim, degree)) for _ in vectors]
            for row, vector in zip(whole, vectors, strict=True):
                for k, entry in zip(places, vector, strict=True):
                    row[k] = entry
            vectors = whole
        falling = echelon([vector[::-1] for vector in vectors], prime)
        basis = [vector[::-1] for vector in reversed(falling)]
        return cls(dim, degree, _sparsest(basis, dim, degree, prime) if len(basis) == 2 else basis)

    @property
    def support(self) -> tuple[tuple[int, ...], ...]:
        """The monomials that occur in it."""
        everything = exponents_up_to(self.dim, self.degree)
        return tuple(everything[k] for k in self.places)

    @property
    def places(self) -> list[int]:
        """The numbers of these monomials."""
        return [k for k, entries in enumerate(zip(*self.basis, strict=True)) if any(entries)]

    @property
    def pattern(self) -> Pattern:
        """Where the basis has entries other than zero."""
        return tuple(tuple(bool(entry) for entry in vector) for vector in self.basis)

    def multiples(self, degree: int, prime: int) -> Vectors:
        """A basis of the products with all monomials, up to a degree."""
        factors = [[0] * k + [1] for k in range(len(exponents_up_to(self.dim, degree - self.degree)))]
        rows = [product_of(P, vector, self.dim, degree, prime) for P in factors for vector in self.basis]
        return echelon([row for row in rows if row is not None], prime)


def _sparsest(basis: Vectors, dim: int, degree: int, prime: int) -> Vectors:
    """The two sparsest elements of a pencil: among those that lack a monomial which others have."""
    degrees = [sum(exponent) for exponent in exponents_up_to(dim, degree)]
    P, Q = basis
    count_work(len(P) + 2 * len(degrees))
    used = [k for k, pair in enumerate(zip(P, Q, strict=True)) if any(pair)]
    zeros: dict[int | None, set[int]] = {}  # of the members that lack something
    for k in used:
        zeros.setdefault(P[k] * pow(Q[k], -1, prime) % prime if Q[k] else None, set()).add(k)
    supports = [([k for k in used if k not in lacking], min(lacking)) for lacking in zeros.values()]
    found = []
    for support, first in sorted(supports, key=lambda one: (degrees[one[0][-1]], len(one[0]), one[0]))[:2]:
        member = [(Q[first] * p - P[first] * q) % prime for p, q in zip(P, Q, strict=True)]
        inverse = pow(member[support[-1]], -1, prime)
        found.append([c * inverse % prime for c in member])
    return found


def darboux_spaces(
    map_: ModularMap, degree: int, known: Sequence[DarbouxSpace] = (), largest: int = LARGEST_SPAN
) -> list[DarbouxSpace] | None:
    """The spaces of degree `degree` that are not multiples of the `known` ones of lower degree.

    Relations that no space accounts for have integrals for coefficients that are no P/Q of this degree. None are looked
    for, and the answer is None, where relations span more than `largest` dimensions.
    """
    prime = map_.prime
    span = span_of_relations(map_, degree, 2 * LARGEST_SPAN)
    if len(span) > 2 * LARGEST_SPAN:
        return None
    explained = echelon([row for space in known for row in space.multiples(degree, prime)], prime)
    # Vectors of the span that together with those explained are a basis of the sum.
    stacked = [*explained, *span]
    independent = pivots(echelon(list(zip(*stacked, strict=True)), prime)) if stacked else []
    fresh = [stacked[k] for k in independent if k >= len(explained)]
    if not fresh:
        return []
    if not explained and _is_darboux(map_, fresh, degree):
        return [DarbouxSpace.spanned_by(map_.dim, degree, fresh, prime)]
    if len(fresh) + len(explained) > largest:
        return None
    solutions = _antisymmetric(map_, [*fresh, *explained], degree)
    bases = [basis for basis in _separate(solutions, fresh, explained, prime) if _is_darboux(map_, basis, degree)]
    if not bases and not explained:
        bases = [basis for basis in _of_rank_two(solutions, fresh, prime) if _is_darboux(map_, basis, degree)]
    return [DarbouxSpace.spanned_by(map_.dim, degree, basis, prime) for basis in bases]


def _values(map_: ModularMap, basis: Vectors, degree: int, points: int) -> tuple[nmod_mat, nmod_mat]:
    """The values of the polynomials at random points and at their images: one row a point."""
    prime = map_.prime
    polynomials = matrix(basis, prime).transpose()
    here, there = (
        multiply(matrix(rows, prime), polynomials)
        for rows in zip(*(map_.moved(x, image, degree) for x, image in map_.pairs(points)), strict=True)
    )
    return here, there


def _is_darboux(map_: ModularMap, basis: Vectors, degree: int) -> bool:
    """Whether all ratios of the polynomials are conserved, at random points."""
    here, there = _values(map_, basis, degree, 6)
    return all(
        here[i, 0] * there[i, a] == here[i, a] * there[i, 0] for i in range(here.nrows()) for a in range(1, len(basis))
    )


def _antisymmetric(map_: ModularMap, basis: Vectors, degree: int) -> list[nmod_mat]:
    """A basis of the antisymmetric A with sum A_ab w_a(x~) w_b(x) = 0 for all x."""
    size, prime = len(basis), map_.prime
    places = [(a, b) for a in range(size) for b in range(a + 1, size)]
    here, there = _values(map_, basis, degree, len(places) + _SPARE)
    count_work(len(places) ** 2 / 2)
    rows = []
    for x, y in zip(integers(here), integers(there), strict=True):
        rows.append([(y[a] * x[b] - y[b] * x[a]) % prime for a, b in places])
    solutions = []
    for vector in null_space(rows, len(places), prime):
        A = nmod_mat(size, size, prime)
        for (a, b), entry in zip(places, vector, strict=True):
            A[a, b] = entry
            A[b, a] = -entry
        solutions.append(A)
    return solutions


def _separate(solutions: list[nmod_mat], fresh: Vectors, explained: Vectors, prime: int) -> list[Vectors]:
    """The spaces with a common cofactor from the matrices A on fresh + explained.

    Their fresh parts are eigenspaces of a random E with E A = A E^T for all fresh-fresh parts of the A.
    """
    k, size, rng = len(fresh), len(fresh) + len(explained), random.Random(prime)
    # Columns of the fresh-fresh parts span the fresh parts of the spaces, in coordinates: a basis in echelon form, in
    # terms of which sum A'_ij b_i b_j^T has the entries at the pivots.
    count_work(len(solutions) * k**2)
    coordinates = echelon([[int(A[a, b]) for a in range(k)] for A in solutions for b in range(k)], prime)
    n, places = len(coordinates), pivots(coordinates)
    if n < 2:
        return []
    count_work(len(solutions) * n**2)
    forms = [nmod_mat([[int(A[i, j]) for j in places] for i in places], prime) for A in solutions]
    if len(forms) > _ENOUGH:  # what all satisfy can be read off a few random combinations
        forms = [combination_of([rng.randrange(prime) for _ in forms], forms) for _ in range(_ENOUGH)]
    algebra = _intertwining(forms, n, prime)
    E = combination_of([rng.randrange(prime) for _ in algebra], algebra)
    found = []
    count_work(10 + 2 * n**3)
    for factor, _ in E.charpoly().factor()[1]:
        if factor.degree() != 1:
            continue  # spaces that are conjugate over an extension of the field
        root = -int(factor[0]) * pow(int(factor[1]), -1, prime) % prime
        shifted = [[(int(E[i, j]) - (root if i == j else 0)) % prime for j in range(n)] for i in range(n)]
        eigen = null_space(shifted, n, prime)
        if len(eigen) > 1:
            lifted = _lift(solutions, echelon(combine(eigen, coordinates, prime), prime), k, size, prime)
            if lifted is not None:
                found.append(echelon(combine(lifted, [*fresh, *explained], prime), prime))
    return found


def _intertwining(forms: list[nmod_mat], n: int, prime: int) -> list[nmod_mat]:
    """A basis of the n x n matrices E with E A = A E^T for all of these antisymmetric A."""
    rows = []
    count_work(n**3 + n**4 / 100)
    for A in forms[:2]:  # few E are left to which the others apply
        for i in range(n):
            for j in range(i, n):
                row = [0] * (n * n)
                for m in range(n):  # (E A)_ij - (A E^T)_ij = sum E_im A_mj - A_im E_jm
                    row[i * n + m] = (row[i * n + m] + int(A[m, j])) % prime
                    row[j * n + m] = (row[j * n + m] - int(A[i, m])) % prime
                rows.append(row)
    found = [nmod_mat(n, n, entries, prime) for entries in null_space(rows, n * n, prime)]
    for A in forms[2:]:
        count_work(len(found) * (n**3 / 500 + n**2))
        differences = [(E * A - A * E.transpose()).entries() for E in found]
        weights = null_space([list(map(int, row)) for row in zip(*differences, strict=True)], len(found), prime)
        found = [combination_of(each, found) for each in weights]
    return found


def _of_rank_two(solutions: list[nmod_mat], fresh: Vectors, prime: int) -> list[Vectors]:
    """The row space of the only matrix of rank 2 among the combinations of few matrices; nothing where it is not one.

    The 4 x 4 Pfaffians of sum c_s A_s are quadratic forms in c. A single common zero c (up to a factor) shows in the
    matrix c c^T, which spans what all of them annihilate.
    """
    count = len(solutions)
    if not 1 <= count <= _ENOUGH:
        return []
    rng = random.Random(prime)
    size = len(fresh)
    pairs = [(s, t) for s in range(count) for t in range(s, count)]
    rows = []
    count_work(2 * len(pairs) * (2 * size + count * (3 + size**2 / 100) + 5 * len(pairs)))
    for _ in range(2 * len(pairs)):
        mix = nmod_mat(4, size, [rng.randrange(prime) for _ in range(4 * size)], prime)
        small = [mix * A * mix.transpose() for A in solutions]

        def pfaffian(A: nmod_mat, B: nmod_mat) -> int:
            return int(
                A[0, 1] * B[2, 3]
                - A[0, 2] * B[1, 3]
                + A[0, 3] * B[1, 2]
                + B[0, 1] * A[2, 3]
                - B[0, 2] * A[1, 3]
                + B[0, 3] * A[1, 2]
            )

        # entry (s, t) of c c^T is c_s c_t: its factor is the polar form, half of it on the diagonal
        half = (prime + 1) // 2
        rows.append([pfaffian(small[s], small[t]) * (half if s == t else 1) % prime for s, t in pairs])
    common = null_space(rows, len(pairs), prime)
    if len(common) != 1:
        return []
    products = dict(zip(pairs, common[0], strict=True))
    lead = next((s for s in range(count) if products[s, s]), None)
    if lead is None:
        return []
    total = combination_of([products[min(lead, t), max(lead, t)] for t in range(count)], solutions)
    coordinates = echelon(integers(total), prime)
    return [echelon(combine(coordinates, fresh, prime), prime)] if len(coordinates) == 2 else []


def _lift(solutions: list[nmod_mat], block: Vectors, k: int, size: int, prime: int) -> Vectors | None:
    """The block with its corrections by explained polynomials, in coordinates of fresh + explained."""
    if size == k:
        return block
    # Combinations of the A whose fresh-fresh part lives on the block: their columns are combinations of it.
    first = pivots(block)
    others = [i for i in range(k) if i not in first]
    conditions = []
    count_work(k * len(others) * len(solutions) * len(first) / 2)
    for b in range(k):
        for i in others:
            # entry (i, b) must be what the block makes of the entries (pivot, b)
            conditions.append(
                [
                    (int(A[i, b]) - sum(int(A[p, b]) * row[i] for p, row in zip(first, block, strict=True))) % prime
                    for A in solutions
                ]
            )
    combinations = null_space(conditions, len(solutions), prime)
    n = len(block)
    system = []
    for weights in combinations:
        A = combination_of(weights, solutions)
        for p in first:
            # A = sum a_pq (p + w_p)(q + w_q)^T: the part of row p outside the fresh ones is sum_q a_pq w_q
            system.append([int(A[p, q]) for q in first] + [int(A[p, t]) for t in range(k, size)])
    reduced = echelon(system, prime)
    if len(reduced) < n or any(reduced[i][j] != (i == j) for i in range(n) for j in range(n)):
        return None
    return [[*block[i], *reduced[i][n:]] for i in range(n)]


def gradient_rank(map_: ModularMap, spaces: Sequence[DarbouxSpace]) -> int:
    """The number of functionally independent integrals among the ratios of the spaces, at a random point."""
    return rank(gradients_of_ratios(map_.random_point(), spaces, map_.prime), map_.prime)


def gradients_of_ratios(x: Point, spaces: Sequence[DarbouxSpace], prime: int) -> Vectors:
    """Multiples of the gradients of the ratios of the spaces at a point."""
    rows = []
    for space in spaces:
        values = [gradient_values(vector, x, space.degree, prime) for vector in space.basis]
        q, dq = values[0]
        for p, dp in values[1:]:
            rows.append([(q * a - p * b) % prime for a, b in zip(dp, dq, strict=True)])
    return rows


class TwoPointBasis(NamedTuple):
    """Which functions: k, the sign, and the dimension of what they span along an orbit, 1 or 2."""

    shift: int
    sign: int
    rank: int = 1

    @property
    def text(self) -> str:
        """How integrals are found among these functions, for people."""
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
    """The places i <= j in (1, x) of the factors of each monomial of degree at most 2."""
    found = []
    for exponent in exponents_up_to(dim, TWO_POINT_DEGREE):
        places = [k for k, e in enumerate(exponent, 1) for _ in range(e)]
        i, j = [0] * (TWO_POINT_DEGREE - len(places)) + places
        found.append((i, j))
    return tuple(found)


class TwoPointMap(ModularMap):
    """A map modulo a prime on whose points monomials of degree at most 2 have the values of a `TwoPointBasis`."""

    def __init__(self, base: ModularMap, lift: TwoPointBasis) -> None:
        # The same map; only what a monomial is differs.
        self.prime, self.eps, self.dim, self.values = base.prime, base.eps, base.dim, base.values
        self.rng, self.map, self.lift = base.rng, base.map, lift

    def _values(self, x: Point, y: Point) -> list[int]:
        p, sign, X, Y = self.prime, self.lift.sign, (1, *x), (1, *y)
        count_work(len(pairs_of(self.dim)) / 2)
        # Squares have no Wronskian. Random numbers in their place are in no relation, as zeros would be.
        return [
            self.rng.randrange(p) if sign < 0 and i == j else (X[i] * Y[j] + sign * X[j] * Y[i]) % p
            for i, j in pairs_of(self.dim)
        ]

    def along_orbit(
        self, degree: int, count: int, support: Sequence[int] | None = None
    ) -> tuple[Sequence[Values], Point, int | None]:
        """The values along an orbit, as for other maps."""
        points, shift = self.orbit(count + self.lift.shift), self.lift.shift
        closed = len(points) < count + shift
        ahead = points[shift % len(points) :] + (points[: shift % len(points)] if closed else [])
        rows = [self._values(x, y) for x, y in zip(points, ahead, strict=False)]
        chosen = rows if support is None else [[row[k] for k in support] for row in rows]
        return chosen, points[0], len(points) if closed else None

    def moved(self, x: Point, image: Point, degree: int, by: tuple[int, int] = (1, 1)) -> tuple[Values, Values]:
        """The values at a point, and those a step later; each times its number of `by`."""
        points = [x, image]
        while len(points) < self.lift.shift + 2:
            after = self.step(points[-1])
            if after is None:
                raise NoPoint("iterates of a random point modulo a prime have no value")
            points.append(after)
        here, there = (self._values(points[k], points[k + self.lift.shift]) for k in (0, 1))
        return [by[0] * value for value in here], [by[1] * value for value in there]


def two_point_spaces(map_: ModularMap, lift: TwoPointBasis) -> list[DarbouxSpace]:
    """The spaces of functions with a common cofactor; of rank 2 the space of all functions that are in relations."""
    lifted = TwoPointMap(map_, lift)
    if lift.rank == 1:
        return darboux_spaces(lifted, TWO_POINT_DEGREE) or []
    span = span_of_relations(lifted, TWO_POINT_DEGREE)
    if len(span) - relations_on_orbit(lifted, TWO_POINT_DEGREE).dimension != lift.rank:
        return []
    return [DarbouxSpace.spanned_by(map_.dim, TWO_POINT_DEGREE, span, map_.prime)]


def bases_with_spaces(
    map_: ModularMap, lifts: Sequence[TwoPointBasis] = TWO_POINT_BASES
) -> list[tuple[TwoPointBasis, list[DarbouxSpace]]]:
    """The lifts that have spaces, with these: of rank 1 or, where there are none, of rank 2."""
    found = []
    for lift in lifts:
        for one in (lift, lift._replace(rank=2)):
            spaces = two_point_spaces(map_, one)
            if spaces:
                found.append((one, spaces))
                break
    return found
