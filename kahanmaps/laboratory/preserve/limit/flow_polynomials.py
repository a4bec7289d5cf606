"""Darboux polynomials of a flow: P with f . grad P = K P, the hypersurfaces P = 0 that solutions do not leave.

They are sought with no cofactor K given. On P = 0 the Taylor coefficients of a solution, in all monomials up to a
degree, are orthogonal to the coefficients of P: the matrix of these, an order a row, has a smaller rank there than at
random points, and P divides its minors, the extactic determinants (pereira-2001). These are interpolated on a random
line modulo a prime. A P of degree d has there d zeros in all, conjugate ones in one irreducible factor, and is one of
the polynomials that vanish along the solutions from all of them. So it is in the space of one of the choices of factors
whose degrees add up to d: those of a line, or what those of several lines have in common. Where these spaces are 0
there is no P; where one is a line, P is lifted to Q, and whether it divides f . grad P is decided exactly.
"""

from __future__ import annotations

import random
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache, reduce
from math import comb, inf
from operator import mul

from flint import fmpq_mpoly, nmod_mat, nmod_poly

from kahanmaps.algebra.chance import seed_for
from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.modular_matrices import combine, matrix, null_space, rank
from kahanmaps.algebra.polynomials import degree_in, evaluate, primitive_part
from kahanmaps.algebra.residues import random_prime, rational_vector
from kahanmaps.errors import BadPrime
from kahanmaps.laboratory.modular_points import Point, exponents_up_to, interpolated
from kahanmaps.laboratory.preserve.darboux.affine_functions import darboux_cofactor
from kahanmaps.laboratory.preserve.limit.flow import ModularFlow
from kahanmaps.systems.polynomial import PolynomialField

_MOST_MONOMIALS = 21  # of the degree that is gone to unasked, within a second
_MOST_EVER = 56  # with which a line takes a minute
_SPARE = 8  # orders of a series beyond the number of monomials
_LARGEST = 10**6  # coefficient: in a random fraction modulo primes of 61 bits it is as small once in 2^20 times
_MOST_CHOICES = 400  # of zeros on a line, and of pairs of choices
_PRIMES = 12  # of which the first mostly suffices
_LINES = 4  # modulo one of them

Vectors = list[list[int]]


@dataclass(frozen=True)
class FlowPolynomials:
    """Darboux polynomials of a field, irreducible over Q, that are no integrals, each exact, short ones first.

    Members P - c Q for an integral P/Q of the same degree are left out unless they are factors of right-hand sides.
    There are no others of at most `degree` with coefficients of at most 10^6: measured on lines modulo primes. Symbols
    count for the degree. `reason` says why higher degrees that were asked for are not settled.
    """

    functions: tuple[fmpq_mpoly, ...]
    degree: int
    reason: str = ""


@lru_cache(maxsize=16)
def flow_polynomials(
    field: PolynomialField, max_degree: int | None = None, seconds: float = inf, seed: int = 0
) -> FlowPolynomials:
    """The Darboux polynomials of a field, up to a degree.

    Args:
        field: x' = f(x), exact. A symbol s counts as a variable with s' = 0.
        max_degree: of the polynomials in variables and symbols; by default up to 4, as long as there are at most 21
            monomials.
        seconds: the time that the search may take, about.
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
        known = flow_polynomials(wider, max_degree, seconds, seed)
        return replace(known, functions=tuple(P for P in known.functions if degree_in(P, field.dim)))
    n = field.dim
    if max_degree is not None:
        top = max((d for d in range(max_degree + 1) if comb(n + d, d) <= _MOST_EVER), default=0)
    else:
        top = max((d for d in (1, 2, 3, 4) if comb(n + d, d) <= _MOST_MONOMIALS), default=0)
    deadline = time.monotonic() + seconds
    rng = random.Random(f"flow polynomials {seed_for(seed, field.rhs)}")
    found: dict[str, fmpq_mpoly] = {}
    # Where all right-hand sides have a factor nothing moves; and of infinitely many, as with x' = x, y' = y, these are
    # the ones that formulas need.
    for P in [primitive_part(P)[1] for f in field.rhs if not f.is_zero() for P, _ in f.factor()[1]]:
        if darboux_cofactor(field, P) is not None:
            found.setdefault(str(P), P)
    done, reason = 0, "too many monomials" if max_degree is not None and top < max_degree else ""
    while done < top:
        unsettled = _unsettled(field, done + 1, rng, deadline, found)
        if unsettled:
            reason = unsettled
            break
        done += 1
    listed = [P for P in found.values() if not field.derivative(P).is_zero()]
    by_size = sorted(listed, key=lambda P: (degree_in(P, n), len(P), [[-int(e) for e in m] for m in P.monoms()]))
    return FlowPolynomials(tuple(by_size), done, reason)


def _unsettled(
    field: PolynomialField, degree: int, rng: random.Random, deadline: float, found: dict[str, fmpq_mpoly]
) -> str:
    """Adds the polynomials of a degree, given those of lower ones; why there may be others, "" where there are none."""
    for _ in range(_PRIMES):
        try:
            flow = ModularFlow(field, random_prime(rng), (), rng.getrandbits(64))
        except BadPrime:
            continue
        common: list[Vectors] = []
        for k in range(_LINES):
            if time.monotonic() > deadline:
                return "the time was over"
            here = _Line(flow, degree, found.values()).spaces()
            if here is None or (k and len(common) * len(here) > _MOST_CHOICES):
                break
            if k:
                pairs = (_intersection(A, B, flow.prime) for A in common for B in here)
                here = [list(map(list, key)) for key in {tuple(map(tuple, space)) for space in pairs if space}]
            common = here
            for vector in [space[0] for space in common if len(space) == 1]:
                P = _lifted(vector, degree, flow.prime, field)
                if P is not None and darboux_cofactor(field, P) is not None:
                    found.setdefault(str(P), P)
            if all(len(space) == 1 for space in common):
                return ""
    return "lines modulo primes leave others possible"


def _rank(flow: ModularFlow, degree: int) -> int:
    """How many monomials up to a degree are independent along the solution from a random point."""
    orders = comb(flow.dim + degree, degree) + _SPARE
    return rank(flow.series(flow.random_point(), degree, orders), flow.prime)


class _Line:
    """A random line, x = start + t slope, and the polynomials in t that are 0 where solutions lie on more than others.

    `left` is the extactic determinant without the factors that are known.
    """

    def __init__(self, flow: ModularFlow, degree: int, known: Iterable[fmpq_mpoly]) -> None:
        self.flow, self.degree = flow, degree
        self.count = comb(flow.dim + degree, degree)
        self.rank = _rank(flow, degree)
        self.start, self.slope = flow.random_point(), flow.random_point()
        self.left = self._without(self._extactic(), known)

    def at(self, t: int) -> Point:
        """The point of a parameter."""
        return tuple((a + t * b) % self.flow.prime for a, b in zip(self.start, self.slope, strict=True))

    def spaces(self) -> list[Vectors] | None:
        """What vanishes along the solutions from as many zeros as the degree is, for each choice; None if too many.

        Only where that is more than from as many random points: there products of integrals less a number do.
        """
        p = self.flow.prime
        usual = cache(lambda k: len(null_space([row for _ in range(k) for row in self._rows(None)], self.count, p)))
        points = []
        for factor, _ in self.left.factor()[1] if self.left.degree() > 0 else ():
            if factor.degree() <= self.degree:
                space = null_space(self._conjugates(factor), self.count, p)
                if len(space) > usual(factor.degree()):
                    points.append((factor.degree(), space))
        found: list[Vectors] = []
        waiting: list[tuple[int, int, Vectors]] = [(0, 0, [])]
        tried = 0
        while waiting:
            start, size, common = waiting.pop()
            for k in range(start, len(points)):
                degree, space = points[k]
                if size + degree > self.degree:
                    continue
                tried += 1
                both = _intersection(common, space, p) if size else space
                if size and len(both) <= usual(size + degree):
                    continue
                if size + degree == self.degree:
                    found.append(both)
                else:
                    waiting.append((k + 1, size + degree, both))
            if tried > _MOST_CHOICES:
                return None
        return found

    def _rows(self, x: Point | None) -> Vectors:
        """The Taylor coefficients along the solution from a point, or a random one."""
        return self.flow.series(x or self.flow.random_point(), self.degree, self.count + _SPARE)

    def _conjugates(self, factor: nmod_poly) -> Vectors:
        """The Taylor coefficients from a zero of an irreducible polynomial in t, in the powers of the zero.

        They are polynomials in t: with their values at nodes j, the sum of value * L_j(t) modulo the polynomial, where
        L_j is 1 at its own node and 0 at the others.
        """
        p, flow, orders = self.flow.prime, self.flow, self.count + _SPARE
        if factor.degree() == 1:
            return self._rows(self.at(int(-factor[0] / factor[1])))
        nodes = range(self.degree + (orders - 1) * max(0, flow.degree - 1) + 1)
        values = [[c for row in self._rows(self.at(t)) for c in row] for t in nodes]
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
        p, flow, size = self.flow.prime, self.flow, self.rank
        mixes = [nmod_mat(self.count, size, [flow.rng.randrange(p) for _ in range(self.count * size)], p)] * 2
        if size < self.count:
            mixes[1] = nmod_mat(self.count, size, [flow.rng.randrange(p) for _ in range(self.count * size)], p)
        # The i-th derivative of a monomial has a degree higher by i (deg f - 1).
        step = max(0, flow.degree - 1)
        top = sum(self.degree + order * step for order in range(size)) + step
        values: list[tuple[int, ...]] = []
        for t in range(top + 1):
            *rows, last, following = flow.series(self.at(t), self.degree, size + 1)
            minors = (matrix([*rows, one], p) * mix for one, mix in zip((last, following), mixes, strict=True))
            values.append(tuple(int(minor.det()) for minor in minors))
        first, second = (interpolated(range(top + 1), column, p) for column in zip(*values, strict=True))
        return first.gcd(second)

    def _without(self, whole: nmod_poly, known: Iterable[fmpq_mpoly]) -> nmod_poly:
        """A polynomial in t without the factors of known polynomials."""
        residues = GF(self.flow.prime)
        for P in known:
            nodes = range(degree_in(P, self.flow.dim) + 1)
            places = ([residues.convert(c) for c in self.at(t)] for t in nodes)
            factor = interpolated(nodes, [int(evaluate(P, residues, x)) for x in places], self.flow.prime)
            while (common := whole.gcd(factor)).degree() > 0:
                whole = whole // common
        return whole


def _intersection(A: Vectors, B: Vectors, prime: int) -> Vectors:
    """A basis of what the spans of two bases have in common."""
    kernel = null_space(list(zip(*A, *B, strict=True)), len(A) + len(B), prime)
    return combine([weights[: len(A)] for weights in kernel], A, prime)


def _lifted(vector: Sequence[int], degree: int, prime: int, field: PolynomialField) -> fmpq_mpoly | None:
    """The polynomial over Q with these coefficients modulo the prime, up to a factor; None where they are too long.

    A residue that is no small number is a fraction of two of half its length, and where a pencil has a member for every
    number that fraction would pass: so is x^2 + y^2 - 1 + 2 i y, a product of conjugate lines of two special members.
    """
    lead = pow(next(c for c in vector if c), -1, prime)
    values = rational_vector([c * lead % prime for c in vector], prime)
    if values is None:
        return None
    support = exponents_up_to(field.dim, degree)
    terms = {exponent: c for exponent, c in zip(support, values, strict=True) if c}
    P = primitive_part(field.rhs[0].context().from_dict(terms))[1]
    return P if max(abs(c) for c in P.coeffs()) <= _LARGEST else None
