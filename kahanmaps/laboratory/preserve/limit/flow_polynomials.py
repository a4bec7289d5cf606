"""The search for Darboux polynomials of a flow: P with f . grad P = K P, so that P = 0 is an invariant hypersurface.

The cofactor K is not given. Expand the monomials up to a degree along the solution from a point x, and write their
Taylor coefficients into a matrix, one order in each row. If P(x) = 0, every row is orthogonal to the coefficients of P.
So the matrix has a smaller rank there than at random points, and P divides its minors, the extactic determinants
(pereira-2001). The minors are interpolated on a random line modulo a prime p. On the line a P of degree d has d zeros,
with conjugate zeros in one irreducible factor, and P vanishes along the solutions from all these zeros. So, for each
choice of factors of the minors whose degrees add up to d, the search computes the space of polynomials that vanish
along the solutions from the zeros of the factors. P lies in one of these spaces. Intersections of the spaces of several
lines are smaller. If all spaces are 0, there is no P. If a space has dimension 1, its element P is lifted to Q, and an
exact division shows whether P divides f . grad P.

Lifting uses Newton's iteration: P and K modulo p solve f . grad P = K P, usually as a simple solution, so that they are
determined modulo powers of p. If the coefficients modulo a power are residues of simple rational numbers, P is lifted.
If they are residues of algebraic numbers, P is one of several conjugate polynomials, whose product has a higher degree.
Any other P is combined, by the Chinese remainder theorem, with the polynomials modulo the next prime. A degree is
settled once every polynomial modulo some prime is lifted or irrational.

Weights w of the variables form a grading if w . a - w_i is the same for all terms x^a of x_i' and all i. Then the
cofactor K of a P is homogeneous, and it is the cofactor of every homogeneous part of P. Quotients of these parts are
integrals. So a P that belongs to no integral is homogeneous in every grading: each search uses monomials of one weight.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import reduce
from math import comb, lcm
from operator import mul

from flint import fmpq_mat, fmpq_mpoly, fmpz_mat, fmpz_poly, nmod_mat, nmod_poly

from kahanmaps.algebra.chance import derive_seed
from kahanmaps.algebra.fields import GF, QQ
from kahanmaps.algebra.matrices import nullspace, primitive_integers
from kahanmaps.algebra.modular_matrices import combine, determinant, echelon, matrix, multiply, null_space, pivots, rank
from kahanmaps.algebra.polynomials import common_denominator, degree_in, evaluate, primitive_part
from kahanmaps.algebra.residues import chinese, random_prime, rational_vector
from kahanmaps.algebra.work import SPENT, Budget, count_work
from kahanmaps.errors import BadPrime, counted
from kahanmaps.laboratory.modular_points import ModularFlow, Point, Values, exponents_up_to, interpolated
from kahanmaps.laboratory.preserve.darboux.affine_functions import darboux_cofactor
from kahanmaps.systems.polynomial import PolynomialField

_DEFAULT_MONOMIALS = 21  # bound of the number of monomials for the default degree; a search takes about a second
_MAX_MONOMIALS = 56  # bound of the number of monomials for a requested degree; a line takes a minute
_MAX_LISTED = 20_000  # monomials up to a degree, before they are grouped by weight
_SPARE = 8  # orders of a series beyond the number of monomials
_MAX_CHOICES = 400  # choices of zeros on a line, and pairs of choices on two lines
_PRIMES = 12  # the largest number of primes; the first one usually suffices
_PRECISION = 24  # exponent of a prime power, which has 1,464 bits
_MAX_CONJUGATES = 8  # the largest degree of coefficients that are recognized as algebraic
_LINES = 4  # the largest number of lines modulo each prime

Vectors = list[list[int]]


@dataclass(frozen=True)
class FlowPolynomials:
    """Darboux polynomials of a vector field, irreducible over Q and not integrals, each exact, short ones first.

    Members P - c Q of the pencil of an integral P/Q are left out unless they are factors of right-hand sides. There are
    no other polynomials of degree at most `degree`, in variables and symbols (measured on lines modulo primes).
    `reason` says why higher requested degrees are not settled, for example because a polynomial was not lifted to Q.
    """

    functions: tuple[fmpq_mpoly, ...]
    degree: int
    reason: str = ""


def flow_polynomials(
    field: PolynomialField, max_degree: int | None = None, budget: Budget | None = None, seed: int = 0
) -> FlowPolynomials:
    """Search for the Darboux polynomials of a vector field, up to a degree.

    Args:
        field: the vector field x' = f(x), exact. A symbol s counts as a variable with s' = 0.
        max_degree: the largest degree of the polynomials in variables and symbols; by default the largest one up to 4
            with at most 21 monomials (of one weight, if the field has gradings).
        budget: the work limit; None means no limit.
        seed: the random seed of lines and primes.

    Returns:
        The polynomials, exact, in the ring of the right-hand sides. Source: pereira-2001.

    >>> from kahanmaps.documents.catalog import load
    >>> flow_polynomials(load("lorenz", {"b": 20}).system).functions
    (x^2 - 20*z,)
    """
    if field.symbols:
        context = field.rhs[0].context()
        extended_field = PolynomialField((*field.rhs, *[context.constant(0)] * len(field.symbols)))
        result = flow_polynomials(extended_field, max_degree, budget, seed)
        return replace(result, functions=tuple(P for P in result.functions if degree_in(P, field.dim)))
    n, last_degree = field.dim, 0
    requested_degree, max_monomials = (4, _DEFAULT_MONOMIALS) if max_degree is None else (max_degree, _MAX_MONOMIALS)
    weights = gradings(field)
    # The work of a degree is about the sum of the cubes of the sizes of its supports.
    while last_degree < requested_degree and comb(n + last_degree + 1, n) <= _MAX_LISTED:
        if sum(len(support) ** 3 for support in _supports(n, last_degree + 1, weights)) > max_monomials**3:
            break
        last_degree += 1
    budget = budget or Budget()
    rng = random.Random(f"flow polynomials {derive_seed(seed, field.rhs)}")
    known_polynomials: dict[str, fmpq_mpoly] = {}
    # Factors of the right-hand sides come first: the search does not find a common factor of all of them, whose zeros
    # are fixed points; and it leaves out the members of pencils, such as all linear P for x' = x, y' = y.
    for P in [primitive_part(P)[1] for f in field.rhs if not f.is_zero() for P, _ in f.factor()[1]]:
        if darboux_cofactor(field, P) is not None:
            known_polynomials.setdefault(str(P), P)
    settled_degree, reason = 0, ""
    primes = [random_prime(rng) for _ in range(_PRIMES)]
    while settled_degree < last_degree and not reason:
        for support in _supports(n, settled_degree + 1, weights):
            reason = _Search(field, settled_degree + 1, support, rng, known_polynomials).run(primes, budget)
            if reason:
                break
        else:
            settled_degree += 1
    if not reason and max_degree is not None and last_degree < max_degree:
        reason = "too many monomials"
    nonintegrals = [P for P in known_polynomials.values() if not field.derivative(P).is_zero()]
    sorted_polynomials = sorted(
        nonintegrals, key=lambda P: (degree_in(P, n), len(P), [[-int(e) for e in m] for m in P.monoms()], str(P))
    )
    return FlowPolynomials(tuple(sorted_polynomials), settled_degree, reason)


def gradings(field: PolynomialField) -> list[tuple[int, ...]]:
    """Return a basis of the weights w of the variables such that all terms x^a of all x_i' have the same w . a - w_i.

    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> gradings(QuadraticSystem.from_text(["x", "y"], ["y", "x^2"]))
    [(2, 3)]
    """
    n = field.dim
    terms = ((i, [int(e) for e in m]) for i, f in enumerate(field.rhs) for m in f.monoms())
    rows = [[*(e - (i == k) for k, e in enumerate(m)), -1] for i, m in terms] or [[0] * n + [1]]
    return [tuple(map(int, primitive_integers(w)[:n])) for w in nullspace(QQ, fmpq_mat(rows))]


def _supports(n: int, degree: int, weights: Sequence[Sequence[int]]) -> list[tuple[int, ...]]:
    """Return the possible supports of an irreducible polynomial of a degree, as tuples of indices of monomials.

    The monomials of a support have the same weight in each grading and no common variable; one has this degree.
    """
    exponents, by_weight = exponents_up_to(n, degree), dict[tuple[int, ...], list[int]]()
    for k, exponent in enumerate(exponents):
        by_weight.setdefault(tuple(sum(map(mul, w, exponent)) for w in weights), []).append(k)
    return [
        tuple(support)
        for support in by_weight.values()
        if max(sum(exponents[k]) for k in support) == degree
        and not any(map(min, *(exponents[k] for k in support), exponents[support[0]]))
    ]


@dataclass
class _Search:
    """The search for Darboux polynomials of one degree with the monomials of `support` (indices)."""

    field: PolynomialField
    degree: int
    support: Sequence[int]
    rng: random.Random
    known_polynomials: dict[str, fmpq_mpoly]

    def __post_init__(self) -> None:
        exponents = exponents_up_to(self.field.dim, self.degree)
        self.monomials = [exponents[k] for k in self.support]

    def run(self, primes: list[int], budget: Budget) -> str:
        """Add the polynomials to the known ones; return why there may be further polynomials, or "" if there are none.

        The prime that settles this search becomes the first of `primes`, for the next search: modulo this prime no
        conjugate polynomials exist whose products would reappear in a higher degree.
        """
        reason = "lines modulo primes leave others possible"
        combinations: list[tuple[list[int], int]] = []  # residues of polynomials that are not lifted yet, with moduli
        for prime in list(primes):
            if budget.is_spent:
                return SPENT
            try:
                flow = ModularFlow(self.field, prime, (), self.rng.getrandbits(64))
            except BadPrime:
                continue
            vectors, is_complete = self._search_modulo(flow, budget)
            unlifted = list[list[int]]()
            for vector in vectors:
                if not self._try_lift(vector, prime):  # a power of the prime decides: rational or conjugate
                    residues, modulus = self._lift_to_power(vector, prime), prime**_PRECISION
                    is_known = residues and self._try_lift(residues, modulus)
                    if not is_known and not any(_is_irrational(c, modulus) for c in residues):
                        unlifted.append(vector)
            if not is_complete:
                continue
            pairs = [(chinese(c, m, vector, prime), m * prime, vector) for c, m in combinations for vector in unlifted]
            combinations = []
            for residues, modulus, vector in pairs[:_MAX_CHOICES]:
                if vector in unlifted and self._try_lift(residues, modulus):
                    unlifted.remove(vector)
                combinations.append((residues, modulus))
            if not unlifted:
                primes.sort(key=lambda p: p != prime)
                return ""
            combinations = combinations or [(vector, prime) for vector in unlifted]
            reason = (
                f"{counted(len(unlifted), 'polynomial')} of degree {self.degree} modulo a prime not lifted to Q "
                f"(limit: {_PRIMES} primes)"
            )
        return reason

    def _search_modulo(self, flow: ModularFlow, budget: Budget) -> tuple[Vectors, bool]:
        """Return coefficients of monic Darboux polynomials modulo the prime of a flow, and whether these are all."""
        spaces_so_far: list[Vectors] = []
        for k in range(_LINES):
            spaces = _Line(flow, self.degree, self.support, self.known_polynomials.values()).spaces()
            if spaces is None or (k and len(spaces_so_far) * len(spaces) > _MAX_CHOICES):
                break
            if k:
                intersections = (_intersect(A, B, flow.prime) for A in spaces_so_far for B in spaces)
                distinct_spaces = dict.fromkeys(tuple(map(tuple, space)) for space in intersections if space)
                spaces = [list(map(list, key)) for key in distinct_spaces]
            spaces_so_far = spaces
            if all(len(space) == 1 for space in spaces_so_far):
                return [_make_monic(vector, flow.prime) for [vector] in spaces_so_far], True
            if budget.is_spent:
                break
        return [_make_monic(space[0], flow.prime) for space in spaces_so_far if len(space) == 1], False

    def _try_lift(self, residues: Sequence[int], modulus: int) -> bool:
        """Lift residues to a polynomial P over Q; add P if it is special, and return whether P is known afterwards."""
        values = rational_vector(residues, modulus)
        if values is None:
            return False
        terms = {monomial: c for monomial, c in zip(self.monomials, values, strict=True) if c}
        P = primitive_part(self.field.rhs[0].context().from_dict(terms))[1]
        if str(P) in self.known_polynomials:
            return True
        if darboux_cofactor(self.field, P) is None:
            return False
        # Test that P is special: along the solution from a zero of P, modulo a new prime, more polynomials vanish than
        # along a generic solution. If not, P may be any member P_1 - c P_2 of a pencil: every residue c lifts to Q. An
        # example is a product of conjugate lines, one from each of two special members: x^2 + y^2 - 1 + 2 i y.
        is_special = None
        while is_special is None:
            with suppress(BadPrime):
                flow = ModularFlow(self.field, random_prime(self.rng), (), self.rng.getrandbits(64))
                line = _Line(flow, self.degree, self.support, ())
                zeros = [factor for factor, _ in line.restricted(P).factor()[1] if factor.degree() == 1]
                is_special = bool(line.special(zeros[0])) if zeros else None
        if is_special:
            self.known_polynomials[str(P)] = P
        return is_special

    def _lift_to_power(self, vector: Sequence[int], p: int) -> list[int]:
        """Lift the coefficients of P modulo p to a power of p; return [] if P' = K P has no simple solution (P, K)."""
        field, context = self.field, self.field.rhs[0].context()
        denominator = lcm(*(int(common_denominator(f)) for f in field.rhs))
        f = [component * denominator for component in field.rhs]
        cofactor = [context.from_dict({m: 1}) for m in exponents_up_to(field.dim, max(0, field.degree - 1))]
        terms = [context.from_dict({m: 1}) for m in self.monomials]

        def combine_polynomials(weights: Sequence[int], polynomials: Sequence[fmpq_mpoly]) -> fmpq_mpoly:
            return sum((c * P for c, P in zip(weights, polynomials, strict=True) if c), context.constant(0))

        def flow_derivative(P: fmpq_mpoly) -> fmpq_mpoly:
            return sum((P.derivative(k) * g for k, g in enumerate(f)), context.constant(0))

        def solve(columns: Sequence[fmpq_mpoly], rhs: fmpq_mpoly) -> list[int] | None:
            """Solve sum c_k column_k = rhs modulo p; None unless there is exactly one solution."""
            monomials = {tuple(m) for column in (*columns, rhs) for m in column.monoms()}
            rows = [[int(column[m].p) % p for column in (*columns, rhs)] for m in sorted(monomials)]
            solution = echelon(rows, p)
            is_unique = pivots(solution) == list(range(len(columns)))
            return [row[-1] for row in solution] if is_unique else None

        # P is determined up to a number. One coefficient of P stays fixed: then the linear systems have one solution.
        fixed_index = next(k for k, c in enumerate(vector) if c)
        P, P_coefficients = combine_polynomials(vector, terms), list(vector)
        K_coefficients = solve([P * k for k in cofactor], flow_derivative(P))
        if K_coefficients is None:
            return []
        K = combine_polynomials(K_coefficients, cofactor)
        indices = [k for k in range(len(terms)) if k != fixed_index]
        columns = [*(flow_derivative(terms[k]) - K * terms[k] for k in indices), *(-P * k for k in cofactor)]
        modulus = p
        for _ in range(_PRECISION - 1):
            P = combine_polynomials(P_coefficients, terms)
            residual = flow_derivative(P) - combine_polynomials(K_coefficients, cofactor) * P
            if any(int(c.p) % modulus for c in residual.coeffs()):
                return []
            count_work(len(terms) * sum(map(len, f)))  # `solve` counts its own work
            correction = solve(columns, residual / -modulus)
            if correction is None:
                return []
            for k, c in zip(indices, correction, strict=False):
                P_coefficients[k] += c * modulus
            K_coefficients = [a + c * modulus for a, c in zip(K_coefficients, correction[len(indices) :], strict=True)]
            modulus *= p
        return P_coefficients


def _is_irrational(residue: int, modulus: int) -> bool:
    """Return whether a residue is a root of an irreducible polynomial of degree 2 to 8 with small coefficients.

    >>> p = 7**60
    >>> root = 3  # of x^2 - 2 modulo 7
    >>> for _ in range(6):
    ...     root = (root - (root**2 - 2) * pow(2 * root, -1, p)) % p
    >>> [_is_irrational(n, p) for n in (root, 5**20 % p, 11**60 % p)]
    [True, False, False]
    """
    for degree in range(2, _MAX_CONJUGATES + 1):
        powers = [pow(residue, k, modulus) for k in range(1, degree + 1)]
        rows = [[modulus, *[0] * degree]]
        rows += [[-power, *(int(k == j) for j in range(1, degree + 1))] for k, power in enumerate(powers, 1)]
        count_work(50 * degree**3)
        shortest_vector = min(fmpz_mat(rows).lll().tolist(), key=lambda row: max(map(abs, row)))
        # For a random residue the entries of the shortest vector have about 1/(degree + 1) of the bits of the modulus.
        if max(map(abs, shortest_vector)) ** (degree + 1) < modulus >> modulus.bit_length() // 4:
            factors = [factor for factor, _ in fmpz_poly(shortest_vector).factor()[1] if factor(residue) % modulus == 0]
            return bool(factors) and all(factor.degree() > 1 for factor in factors)
    return False


def _make_monic(vector: Sequence[int], prime: int) -> list[int]:
    """Scale a vector modulo a prime so that its first nonzero entry is 1."""
    inverse = pow(next(c for c in vector if c), -1, prime)
    return [c * inverse % prime for c in vector]


class _Line:
    """A random line x = start + t slope, and the special points on it.

    A point is special if more polynomials with monomials in the `support` vanish along the solution from the point than
    along a generic solution. Zeros of the known polynomials are left out.
    """

    def __init__(self, flow: ModularFlow, degree: int, support: Sequence[int], factors: Iterable[fmpq_mpoly]) -> None:
        self.flow, self.degree, self.support, self.known_polynomials = flow, degree, support, factors
        self.count = len(support)  # the number of monomials
        self.start, self.slope = flow.random_point(), flow.random_point()
        self._generic_dimensions: dict[int, int] = {}

    def at(self, t: int) -> Point:
        """Return the point with parameter t."""
        return tuple((a + t * b) % self.flow.prime for a, b in zip(self.start, self.slope, strict=True))

    def special(self, polynomial: nmod_poly) -> list[tuple[int, Vectors]]:
        """Return, for each special factor of a polynomial in t, its degree and its space.

        The space consists of the polynomials that vanish along the solutions from the zeros of the factor. A factor is
        special if this space is larger than that of equally many random points (which has products of integrals I - c).
        """
        points = []
        count_work(max(0, int(polynomial.degree())) ** 2)
        for factor, _ in polynomial.factor()[1] if polynomial.degree() > 0 else ():
            if factor.degree() <= self.degree:
                space = null_space(self._rows_at_zero(factor), self.count, self.flow.prime)
                if len(space) > self._generic_dimension(factor.degree()):
                    points.append((factor.degree(), space))
        return points

    def _generic_dimension(self, count: int) -> int:
        """Return the dimension of the space of polynomials that vanish along solutions from `count` random points."""
        if count not in self._generic_dimensions:
            rows = [row for _ in range(count) for row in self._rows(None)]
            self._generic_dimensions[count] = len(null_space(rows, self.count, self.flow.prime))
        return self._generic_dimensions[count]

    def spaces(self) -> list[Vectors] | None:
        """Return, for each choice of special factors of total degree `self.degree`, the intersection of their spaces.

        Returns None if there are too many choices.
        """
        # Compute the common factor, on the line, of the minors of the matrix of Taylor coefficients. The minors have as
        # many rows as the rank at random points; the first rows are independent there. A minor with the next row in
        # place of the last one is its derivative along the flow. The common factor of a minor and its derivative
        # contains all invariant factors, and multiple factors. Columns are combined at random. If there are more
        # columns than the rank, the two minors use different combinations, and share the factor common to all minors.
        p, flow, size = self.flow.prime, self.flow, rank(self._rows(None), self.flow.prime)
        matrices = [nmod_mat(self.count, size, [flow.rng.randrange(p) for _ in range(self.count * size)], p)] * 2
        if size < self.count:
            matrices[1] = nmod_mat(self.count, size, [flow.rng.randrange(p) for _ in range(self.count * size)], p)
        # The i-th derivative of a monomial has the degree of the monomial plus i (deg f - 1).
        degree_step = max(0, flow.degree - 1)
        degree_bound = sum(self.degree + order * degree_step for order in range(size)) + degree_step
        values: list[tuple[int, ...]] = []
        for t in range(degree_bound + 1):
            *rows, last_row, next_row = flow.series(self.at(t), self.degree, size + 1, self.support)
            minors = (
                multiply(matrix([*rows, row], p), M) for row, M in zip((last_row, next_row), matrices, strict=True)
            )
            values.append(tuple(map(determinant, minors)))
        minor, other_minor = (interpolated(range(degree_bound + 1), column, p) for column in zip(*values, strict=True))
        extactic = minor.gcd(other_minor)
        for P in self.known_polynomials:
            factor = self.restricted(P)
            while (common_factor := extactic.gcd(factor)).degree() > 0:
                extactic = extactic // common_factor
        special_factors = self.special(extactic)
        spaces: list[Vectors] = []
        partial_choices: list[tuple[int, int, Vectors]] = [(0, 0, [])]
        choice_count = 0
        while partial_choices:
            first_index, total_degree, space_so_far = partial_choices.pop()
            for k in range(first_index, len(special_factors)):
                degree, space = special_factors[k]
                if total_degree + degree > self.degree:
                    continue
                choice_count += 1
                intersection = _intersect(space_so_far, space, p) if total_degree else space
                if total_degree and len(intersection) <= self._generic_dimension(total_degree + degree):
                    continue
                if total_degree + degree == self.degree:
                    spaces.append(intersection)
                else:
                    partial_choices.append((k + 1, total_degree + degree, intersection))
            if choice_count > _MAX_CHOICES:
                return None
        return spaces

    def _rows(self, x: Point | None) -> Sequence[Values]:
        """Return the Taylor coefficients of the monomials along the solution from a point (None: a random point)."""
        return self.flow.series(x or self.flow.random_point(), self.degree, self.count + _SPARE, self.support)

    def _rows_at_zero(self, factor: nmod_poly) -> Sequence[Values]:
        """Return the Taylor coefficients at a zero of an irreducible polynomial in t, expanded in powers of the zero.

        These are polynomials in t, interpolated from values at nodes with Lagrange polynomials modulo `factor`.
        """
        p, flow, orders = self.flow.prime, self.flow, self.count + _SPARE
        if factor.degree() == 1:
            return self._rows(self.at(int(-factor[0] / factor[1])))
        nodes = range(self.degree + (orders - 1) * max(0, flow.degree - 1) + 1)
        values = [[c for row in self._rows(self.at(t)) for c in row] for t in nodes]
        count_work(len(nodes) ** 2 / 5)
        all_nodes = reduce(mul, (nmod_poly([-t, 1], p) for t in nodes))
        basis = []
        for t in nodes:
            other_nodes = all_nodes // nmod_poly([-t, 1], p)
            L = other_nodes * ~other_nodes(t) % factor
            basis.append([int(L[k]) for k in range(factor.degree())])
        coefficients = combine(list(zip(*basis, strict=True)), values, p)
        return [row[k : k + self.count] for row in coefficients for k in range(0, len(row), self.count)]

    def restricted(self, P: fmpq_mpoly) -> nmod_poly:
        """Return the restriction of a polynomial to the line, as a polynomial in t."""
        field_p, nodes = GF(self.flow.prime), range(degree_in(P, self.flow.dim) + 1)
        points = ([field_p.convert(c) for c in self.at(t)] for t in nodes)
        return interpolated(nodes, [int(evaluate(P, field_p, x)) for x in points], self.flow.prime)


def _intersect(A: Vectors, B: Vectors, prime: int) -> Vectors:
    """Return a basis of the intersection of the spans of two bases."""
    kernel = null_space(list(zip(*A, *B, strict=True)), len(A) + len(B), prime)
    return combine([weights[: len(A)] for weights in kernel], A, prime)
