"""Darboux polynomials of a flow: P with f . grad P = K P, the hypersurfaces P = 0 that solutions do not leave.

They are sought with no cofactor K given. On P = 0 the Taylor coefficients of a solution, in all monomials up to a
degree, are orthogonal to the coefficients of P: the matrix of these, an order a row, has a smaller rank there than at
random points, and P divides its minors, the extactic determinants (pereira-2001). These are interpolated on a random
line modulo a prime. A P of degree d has there d zeros in all, conjugate ones in one irreducible factor, and is one of
the polynomials that vanish along the solutions from all of them. So it is in the space of one of the choices of factors
whose degrees add up to d: those of a line, or what those of several lines have in common. Where these spaces are 0
there is no P; where one is a line, P is lifted to Q, and whether it divides f . grad P is decided exactly.

Lifted by Newton's iteration: P and K modulo p are a solution of f . grad P = K P, mostly a simple one, so that they are
known modulo powers of p. There the coefficients show as rational, or as algebraic numbers: then P is one of several
conjugate polynomials, and its product with the others is of a higher degree. What is not lifted so is joined with what
is found modulo the next prime, and a degree is settled by a prime that leaves nothing without an answer.

Weights w of the variables are a grading where all terms x^a of all x_i' have the same w . a - w_i. The cofactor K of a
P is homogeneous then, and all homogeneous parts of P have it: their quotients are integrals, and a P that belongs to
no integral is homogeneous in every grading. So the monomials of each weight are a search of their own.
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
from kahanmaps.algebra.work import SPENT, Budget, count
from kahanmaps.errors import BadPrime, counted
from kahanmaps.laboratory.modular_points import ModularFlow, Point, Values, exponents_up_to, interpolated
from kahanmaps.laboratory.preserve.darboux.affine_functions import darboux_cofactor
from kahanmaps.systems.polynomial import PolynomialField

_MOST_MONOMIALS = 21  # of the degree that is gone to unasked, within a second
_MOST_EVER = 56  # with which a line takes a minute
_MOST_LISTED = 20_000  # monomials up to a degree, before they are sorted by their weights
_SPARE = 8  # orders of a series beyond the number of monomials
_MOST_CHOICES = 400  # of zeros on a line, and of pairs of choices
_PRIMES = 12  # of which the first mostly suffices
_PRECISION = 24  # powers of a prime: 1,464 bits
_MOST_CONJUGATES = 8
_LINES = 4  # modulo one of them

Vectors = list[list[int]]


@dataclass(frozen=True)
class FlowPolynomials:
    """Darboux polynomials of a field, irreducible over Q, that are no integrals, each exact, short ones first.

    Members P - c Q for an integral P/Q are left out unless they are factors of right-hand sides. There are no others of
    at most `degree`: measured on lines modulo primes. Symbols count for the degree. `reason` says why higher degrees
    that were asked for are not settled: also where something was found modulo primes and not lifted to Q.
    """

    functions: tuple[fmpq_mpoly, ...]
    degree: int
    reason: str = ""


def flow_polynomials(
    field: PolynomialField, max_degree: int | None = None, budget: Budget | None = None, seed: int = 0
) -> FlowPolynomials:
    """The Darboux polynomials of a field, up to a degree.

    Args:
        field: x' = f(x), exact. A symbol s counts as a variable with s' = 0.
        max_degree: of the polynomials in variables and symbols; by default up to 4, as long as there are at most 21
            monomials (of one weight, where the field has gradings).
        budget: of the search; None for as long as it takes.
        seed: of the random lines and primes.

    Returns:
        The polynomials, exact, in the ring of the right-hand sides. Source: pereira-2001.

    >>> from kahanmaps.documents.catalog import load
    >>> flow_polynomials(load("lorenz", {"b": 20}).system).functions
    (x^2 - 20*z,)
    """
    if field.symbols:
        context = field.rhs[0].context()
        wider = PolynomialField((*field.rhs, *[context.constant(0)] * len(field.symbols)))
        known = flow_polynomials(wider, max_degree, budget, seed)
        return replace(known, functions=tuple(P for P in known.functions if degree_in(P, field.dim)))
    n, top = field.dim, 0
    asked, most = (4, _MOST_MONOMIALS) if max_degree is None else (max_degree, _MOST_EVER)
    weights = gradings(field)
    # The work grows with the cube of a support at least, and is that of all supports of a degree together.
    while top < asked and comb(n + top + 1, n) <= _MOST_LISTED:
        if sum(len(support) ** 3 for support in _supports(n, top + 1, weights)) > most**3:
            break
        top += 1
    budget = budget or Budget()
    rng = random.Random(f"flow polynomials {derive_seed(seed, field.rhs)}")
    found: dict[str, fmpq_mpoly] = {}
    # Where all right-hand sides have a factor nothing moves; and of infinitely many, as with x' = x, y' = y, these are
    # the ones that formulas need.
    for P in [primitive_part(P)[1] for f in field.rhs if not f.is_zero() for P, _ in f.factor()[1]]:
        if darboux_cofactor(field, P) is not None:
            found.setdefault(str(P), P)
    done, reason = 0, ""
    primes = [random_prime(rng) for _ in range(_PRIMES)]
    while done < top and not reason:
        for support in _supports(n, done + 1, weights):
            reason = _Search(field, done + 1, support, rng, found).run(primes, budget)
            if reason:
                break
        else:
            done += 1
    if not reason and max_degree is not None and top < max_degree:
        reason = "too many monomials"
    listed = [P for P in found.values() if not field.derivative(P).is_zero()]
    by_size = sorted(
        listed, key=lambda P: (degree_in(P, n), len(P), [[-int(e) for e in m] for m in P.monoms()], str(P))
    )
    return FlowPolynomials(tuple(by_size), done, reason)


def gradings(field: PolynomialField) -> list[tuple[int, ...]]:
    """A basis of the weights w of the variables for which all terms x^a of all x_i' have the same w . a - w_i.

    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> gradings(QuadraticSystem.from_text(["x", "y"], ["y", "x^2"]))
    [(2, 3)]
    """
    n = field.dim
    terms = ((i, [int(e) for e in m]) for i, f in enumerate(field.rhs) for m in f.monoms())
    rows = [[*(e - (i == k) for k, e in enumerate(m)), -1] for i, m in terms] or [[0] * n + [1]]
    return [tuple(map(int, primitive_integers(w)[:n])) for w in nullspace(QQ, fmpq_mat(rows))]


def _supports(n: int, degree: int, weights: Sequence[Sequence[int]]) -> list[tuple[int, ...]]:
    """The numbers of the monomials that a polynomial of the degree, irreducible and no variable, may consist of.

    They have one weight in each grading, not all of them a variable in common, and one is of the degree.
    """
    exponents, alike = exponents_up_to(n, degree), dict[tuple[int, ...], list[int]]()
    for k, exponent in enumerate(exponents):
        alike.setdefault(tuple(sum(map(mul, w, exponent)) for w in weights), []).append(k)
    return [
        tuple(support)
        for support in alike.values()
        if max(sum(exponents[k]) for k in support) == degree
        and not any(map(min, *(exponents[k] for k in support), exponents[support[0]]))
    ]


@dataclass
class _Search:
    """The search for polynomials of a degree with given monomials; those of lower degrees are among `found`."""

    field: PolynomialField
    degree: int
    support: Sequence[int]
    rng: random.Random
    found: dict[str, fmpq_mpoly]

    def __post_init__(self) -> None:
        exponents = exponents_up_to(self.field.dim, self.degree)
        self.monomials = [exponents[k] for k in self.support]

    def run(self, primes: list[int], budget: Budget) -> str:
        """Adds the polynomials to those found; why there may be others, "" where there are none.

        The prime that settles it comes first for the next search: factors over extensions of Q that have no residues
        modulo this one do not come again in products.
        """
        reason = "lines modulo primes leave others possible"
        joined: list[tuple[list[int], int]] = []  # residues of what is not lifted yet, and their moduli
        for prime in list(primes):
            if budget.is_spent:
                return SPENT
            try:
                flow = ModularFlow(self.field, prime, (), self.rng.getrandbits(64))
            except BadPrime:
                continue
            vectors, are_all = self._modulo(flow, budget)
            missing = list[list[int]]()
            for vector in vectors:
                if not self._lifts(vector, prime):  # a higher power shows it, or that it has conjugate ones
                    residues, modulus = self._newton(vector, prime), prime**_PRECISION
                    is_known = residues and self._lifts(residues, modulus)
                    if not is_known and not any(_is_irrational(c, modulus) for c in residues):
                        missing.append(vector)
            if not are_all:
                continue
            pairs = [(chinese(old, m, new, prime), m * prime, new) for old, m in joined for new in missing]
            joined = []
            for residues, modulus, new in pairs[:_MOST_CHOICES]:
                if new in missing and self._lifts(residues, modulus):
                    missing.remove(new)
                joined.append((residues, modulus))
            if not missing:
                primes.sort(key=lambda one: one != prime)
                return ""
            joined = joined or [(vector, prime) for vector in missing]
            reason = (
                f"{counted(len(missing), 'polynomial')} of degree {self.degree} modulo a prime not lifted to Q "
                f"(limit: {_PRIMES} primes)"
            )
        return reason

    def _modulo(self, flow: ModularFlow, budget: Budget) -> tuple[Vectors, bool]:
        """The coefficients of polynomials modulo the prime of a flow, the first being 1, and whether these are all."""
        common: list[Vectors] = []
        for k in range(_LINES):
            here = _Line(flow, self.degree, self.support, self.found.values()).spaces()
            if here is None or (k and len(common) * len(here) > _MOST_CHOICES):
                break
            if k:
                pairs = (_intersection(A, B, flow.prime) for A in common for B in here)
                different = dict.fromkeys(tuple(map(tuple, space)) for space in pairs if space)
                here = [list(map(list, key)) for key in different]
            common = here
            if all(len(space) == 1 for space in common):
                return [_monic(vector, flow.prime) for [vector] in common], True
            if budget.is_spent:
                break
        return [_monic(space[0], flow.prime) for space in common if len(space) == 1], False

    def _lifts(self, residues: Sequence[int], modulus: int) -> bool:
        """Whether the simplest fractions with these residues are the coefficients of a polynomial: it is added."""
        values = rational_vector(residues, modulus)
        if values is None:
            return False
        terms = {monomial: c for monomial, c in zip(self.monomials, values, strict=True) if c}
        P = primitive_part(self.field.rhs[0].context().from_dict(terms))[1]
        if str(P) in self.found:
            return True
        if darboux_cofactor(self.field, P) is None:
            return False
        # More than usual has to vanish along the solution from a zero of P, modulo a fresh prime where it has one: of a
        # pencil with a member for every number any residue lifts to a member, so x^2 + y^2 - 1 + 2 i y would, a product
        # of conjugate lines of two special members.
        is_special = None
        while is_special is None:
            with suppress(BadPrime):
                flow = ModularFlow(self.field, random_prime(self.rng), (), self.rng.getrandbits(64))
                line = _Line(flow, self.degree, self.support, ())
                zeros = [factor for factor, _ in line.restricted(P).factor()[1] if factor.degree() == 1]
                is_special = bool(line.special(zeros[0])) if zeros else None
        if is_special:
            self.found[str(P)] = P
        return is_special

    def _newton(self, vector: Sequence[int], p: int) -> list[int]:
        """The coefficients modulo a power of p, of a P known modulo p; empty where that is no simple solution."""
        field, context = self.field, self.field.rhs[0].context()
        denominator = lcm(*(int(common_denominator(f)) for f in field.rhs))
        f = [component * denominator for component in field.rhs]
        cofactor = [context.from_dict({m: 1}) for m in exponents_up_to(field.dim, max(0, field.degree - 1))]
        terms = [context.from_dict({m: 1}) for m in self.monomials]

        def total(weights: Sequence[int], polynomials: Sequence[fmpq_mpoly]) -> fmpq_mpoly:
            return sum((c * P for c, P in zip(weights, polynomials, strict=True) if c), context.constant(0))

        def along(P: fmpq_mpoly) -> fmpq_mpoly:
            return sum((P.derivative(k) * g for k, g in enumerate(f)), context.constant(0))

        def solved(columns: Sequence[fmpq_mpoly], right: fmpq_mpoly) -> list[int] | None:
            """The weights of the columns that add up to the right-hand side modulo p, if that is one vector."""
            rows = {tuple(m) for column in (*columns, right) for m in column.monoms()}
            table = [[int(column[m].p) % p for column in (*columns, right)] for m in sorted(rows)]
            found = echelon(table, p)
            is_one = pivots(found) == list(range(len(columns)))
            return [row[-1] for row in found] if is_one else None

        first = next(k for k, c in enumerate(vector) if c)
        P, P_known = total(vector, terms), list(vector)
        K_known = solved([P * k for k in cofactor], along(P))
        if K_known is None:
            return []
        K = total(K_known, cofactor)
        others = [k for k in range(len(terms)) if k != first]
        columns = [*(along(terms[k]) - K * terms[k] for k in others), *(-P * k for k in cofactor)]
        modulus = p
        for _ in range(_PRECISION - 1):
            P = total(P_known, terms)
            rest = along(P) - total(K_known, cofactor) * P
            if any(int(c.p) % modulus for c in rest.coeffs()):
                return []
            count(len(terms) * sum(map(len, f)))  # and solving counts itself
            step = solved(columns, rest / -modulus)
            if step is None:
                return []
            for k, c in zip(others, step, strict=False):
                P_known[k] += c * modulus
            K_known = [a + c * modulus for a, c in zip(K_known, step[len(others) :], strict=True)]
            modulus *= p
        return P_known


def _is_irrational(residue: int, modulus: int) -> bool:
    """Whether an algebraic number of degree 2 to 8, of simple coefficients, has this residue, and no rational one.

    >>> p = 7**60
    >>> root = 3  # of x^2 - 2 modulo 7
    >>> for _ in range(6):
    ...     root = (root - (root**2 - 2) * pow(2 * root, -1, p)) % p
    >>> [_is_irrational(n, p) for n in (root, 5**20 % p, 11**60 % p)]
    [True, False, False]
    """
    for degree in range(2, _MOST_CONJUGATES + 1):
        powers = [pow(residue, k, modulus) for k in range(1, degree + 1)]
        rows = [[modulus, *[0] * degree]]
        rows += [[-power, *(int(k == j) for j in range(1, degree + 1))] for k, power in enumerate(powers, 1)]
        count(50 * degree**3)
        shortest = min(fmpz_mat(rows).lll().tolist(), key=lambda row: max(map(abs, row)))
        # By chance the entries have 1/(degree + 1) of the bits of the modulus.
        if max(map(abs, shortest)) ** (degree + 1) < modulus >> modulus.bit_length() // 4:
            factors = [one for one, _ in fmpz_poly(shortest).factor()[1] if one(residue) % modulus == 0]
            return bool(factors) and all(one.degree() > 1 for one in factors)
    return False


def _monic(vector: Sequence[int], prime: int) -> list[int]:
    """The multiple of a vector modulo a prime whose first entry other than 0 is 1."""
    lead = pow(next(c for c in vector if c), -1, prime)
    return [c * lead % prime for c in vector]


class _Line:
    """A random line, x = start + t slope, and the polynomials in t that are 0 where solutions lie on more than others.

    More polynomials with the monomials of the `support`, that is. Zeros of polynomials that are `known` are left out.
    """

    def __init__(self, flow: ModularFlow, degree: int, support: Sequence[int], known: Iterable[fmpq_mpoly]) -> None:
        self.flow, self.degree, self.support, self.known = flow, degree, support, known
        self.count = len(support)
        self.start, self.slope = flow.random_point(), flow.random_point()
        self._known_usual: dict[int, int] = {}

    def at(self, t: int) -> Point:
        """The point of a parameter."""
        return tuple((a + t * b) % self.flow.prime for a, b in zip(self.start, self.slope, strict=True))

    def special(self, along: nmod_poly) -> list[tuple[int, Vectors]]:
        """The degrees of the factors of a polynomial in t and what vanishes along the solutions from their zeros.

        Only where that is more than from as many random points: there products of integrals less a number do.
        """
        points = []
        count(max(0, int(along.degree())) ** 2)
        for factor, _ in along.factor()[1] if along.degree() > 0 else ():
            if factor.degree() <= self.degree:
                space = null_space(self._conjugates(factor), self.count, self.flow.prime)
                if len(space) > self._usual(factor.degree()):
                    points.append((factor.degree(), space))
        return points

    def _usual(self, points: int) -> int:
        """How many polynomials vanish along the solutions from so many random points."""
        if points not in self._known_usual:
            rows = [row for _ in range(points) for row in self._rows(None)]
            self._known_usual[points] = len(null_space(rows, self.count, self.flow.prime))
        return self._known_usual[points]

    def spaces(self) -> list[Vectors] | None:
        """What vanishes along the solutions from as many zeros as the degree is, for each choice; None if too many."""
        p, left = self.flow.prime, self._extactic()
        for P in self.known:
            factor = self.restricted(P)
            while (common := left.gcd(factor)).degree() > 0:
                left = left // common
        points = self.special(left)
        found: list[Vectors] = []
        waiting: list[tuple[int, int, Vectors]] = [(0, 0, [])]
        tried = 0
        while waiting:
            start, size, shared = waiting.pop()
            for k in range(start, len(points)):
                degree, space = points[k]
                if size + degree > self.degree:
                    continue
                tried += 1
                both = _intersection(shared, space, p) if size else space
                if size and len(both) <= self._usual(size + degree):
                    continue
                if size + degree == self.degree:
                    found.append(both)
                else:
                    waiting.append((k + 1, size + degree, both))
            if tried > _MOST_CHOICES:
                return None
        return found

    def _rows(self, x: Point | None) -> Sequence[Values]:
        """The Taylor coefficients along the solution from a point, or a random one."""
        return self.flow.series(x or self.flow.random_point(), self.degree, self.count + _SPARE, self.support)

    def _conjugates(self, factor: nmod_poly) -> Sequence[Values]:
        """The Taylor coefficients from a zero of an irreducible polynomial in t, in the powers of the zero.

        They are polynomials in t: with their values at nodes j, the sum of value * L_j(t) modulo the polynomial, where
        L_j is 1 at its own node and 0 at the others.
        """
        p, flow, orders = self.flow.prime, self.flow, self.count + _SPARE
        if factor.degree() == 1:
            return self._rows(self.at(int(-factor[0] / factor[1])))
        nodes = range(self.degree + (orders - 1) * max(0, flow.degree - 1) + 1)
        values = [[c for row in self._rows(self.at(t)) for c in row] for t in nodes]
        count(len(nodes) ** 2 / 5)
        whole = reduce(mul, (nmod_poly([-t, 1], p) for t in nodes))
        basis = []
        for t in nodes:
            others = whole // nmod_poly([-t, 1], p)
            L = others * ~others(t) % factor
            basis.append([int(L[k]) for k in range(factor.degree())])
        mixed = combine(list(zip(*basis, strict=True)), values, p)
        return [row[k : k + self.count] for row in mixed for k in range(0, len(row), self.count)]

    def _extactic(self) -> nmod_poly:
        """The factors on the line of the minors of the Taylor coefficients that are 0 along solutions.

        As many rows as the rank are independent at random points, or all further ones would depend on fewer. With the
        next row for the last one it is the derivative of the minor along the flow: what both have in common is kept 0,
        or a factor more than once. The columns are combined at random, differently where there are too many: on a
        random line two such minors have in common what all have.
        """
        p, flow, size = self.flow.prime, self.flow, rank(self._rows(None), self.flow.prime)
        mixes = [nmod_mat(self.count, size, [flow.rng.randrange(p) for _ in range(self.count * size)], p)] * 2
        if size < self.count:
            mixes[1] = nmod_mat(self.count, size, [flow.rng.randrange(p) for _ in range(self.count * size)], p)
        # The i-th derivative of a monomial has a degree higher by i (deg f - 1).
        step = max(0, flow.degree - 1)
        top = sum(self.degree + order * step for order in range(size)) + step
        values: list[tuple[int, ...]] = []
        for t in range(top + 1):
            *rows, last, following = flow.series(self.at(t), self.degree, size + 1, self.support)
            minors = (multiply(matrix([*rows, one], p), mix) for one, mix in zip((last, following), mixes, strict=True))
            values.append(tuple(map(determinant, minors)))
        first, second = (interpolated(range(top + 1), column, p) for column in zip(*values, strict=True))
        return first.gcd(second)

    def restricted(self, P: fmpq_mpoly) -> nmod_poly:
        """A polynomial on the line, in t."""
        residues, nodes = GF(self.flow.prime), range(degree_in(P, self.flow.dim) + 1)
        places = ([residues.convert(c) for c in self.at(t)] for t in nodes)
        return interpolated(nodes, [int(evaluate(P, residues, x)) for x in places], self.flow.prime)


def _intersection(A: Vectors, B: Vectors, prime: int) -> Vectors:
    """A basis of what the spans of two bases have in common."""
    kernel = null_space(list(zip(*A, *B, strict=True)), len(A) + len(B), prime)
    return combine([weights[: len(A)] for weights in kernel], A, prime)
