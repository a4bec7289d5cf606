"""Darboux polynomials of a flow: P with f . grad P = K P, the hypersurfaces P = 0 that solutions do not leave.

They are sought with no cofactor K given. On P = 0 the Taylor coefficients of a solution, in all monomials up to a
degree, are orthogonal to the coefficients of P: the matrix of these, an order a row, has a smaller rank there than at
random points, and P divides its minors, the extactic determinants (pereira-2001). These are interpolated on a random
line modulo a prime. Where P vanishes on the line they all do; and at each such point the polynomials that vanish along
its solution are one null space, which contains P. Where integrals I have that degree, multiples of some I - c are in it
at every point: enough points of P = 0 have P in common, but no such multiples. So have points of two conjugate
hypersurfaces the product of these. P is lifted to Q; whether it divides f . grad P is then decided exactly.
"""

from __future__ import annotations

import random
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import comb, inf

from flint import fmpq_mpoly, nmod_mat, nmod_poly

from kahanmaps.algebra.chance import seed_for
from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.polynomials import degree_in, evaluate, primitive_part
from kahanmaps.algebra.residues import random_prime, rational_vector
from kahanmaps.errors import BadPrime
from kahanmaps.laboratory.modular_points import Point, combine, exponents_up_to, interpolated, null_space, rank
from kahanmaps.laboratory.preserve.affine_functions import darboux_cofactor
from kahanmaps.laboratory.preserve.flow import ModularFlow
from kahanmaps.systems.polynomial import PolynomialField

_MOST_MONOMIALS = 21  # of the degree that is gone to unasked, within a second
_MOST_EVER = 56  # with which a line takes a minute
_SPARE = 8  # orders of a series beyond the number of monomials
_LARGEST = 10**6  # coefficient: in a random fraction modulo primes of 61 bits it is as small once in 2^20 times
_MOST_SPACES = 24  # of which all choices of some are looked at
_PRIMES = 12  # of which the first mostly suffices

Vectors = list[list[int]]


@dataclass(frozen=True)
class FlowPolynomials:
    """Darboux polynomials of a field, irreducible over Q, that are no integrals, each exact, short ones first.

    Members P - c Q for an integral P/Q of the same degree are left out unless they are factors of right-hand sides.
    There are no others of at most `degree` that are irreducible over the complex numbers, or have two conjugate factors
    there: measured on lines modulo primes. Symbols count for the degree. Coefficients are
    at most 10^6.
    """

    functions: tuple[fmpq_mpoly, ...]
    degree: int


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
        max_degree = max((d for d in range(max_degree + 1) if comb(n + d, d) <= _MOST_EVER), default=0)
    else:
        max_degree = max((d for d in (1, 2, 3, 4) if comb(n + d, d) <= _MOST_MONOMIALS), default=0)
    deadline = time.monotonic() + seconds
    rng = random.Random(f"flow polynomials {seed_for(seed, field.rhs)}")
    found: dict[str, fmpq_mpoly] = {}
    # Where all right-hand sides have a factor nothing moves; and of infinitely many, as with x' = x, y' = y, these are
    # the ones that formulas need.
    for P in [primitive_part(P)[1] for f in field.rhs if not f.is_zero() for P, _ in f.factor()[1]]:
        if darboux_cofactor(field, P) is not None:
            found.setdefault(str(P), P)
    done, lowest = 0, 0  # the lowest degree of integrals
    for degree in range(1, max_degree + 1):
        for _ in range(_PRIMES):
            if time.monotonic() > deadline:
                break
            try:
                flow = ModularFlow(field, random_prime(rng), (), rng.getrandbits(64))
            except BadPrime:
                continue
            if not lowest and _rank(flow, degree) < comb(n + degree, degree):
                lowest = degree
            # Products of integrals less a number at all points are no more common to one point more.
            if _has_all(flow, field, degree, degree // lowest + 1 if lowest else 1, found):
                done = degree
                break
        if done < degree:
            break
    listed = [P for P in found.values() if not field.derivative(P).is_zero()]
    by_size = sorted(listed, key=lambda P: (degree_in(P, n), len(P), [[-int(e) for e in m] for m in P.monoms()]))
    return FlowPolynomials(tuple(by_size), done)


def _has_all(flow: ModularFlow, field: PolynomialField, degree: int, points: int, found: dict[str, fmpq_mpoly]) -> bool:
    """Adds the polynomials that so many lines show, and tells whether these show that there are no others.

    They do if what is left on them, without what was found, has no irreducible factor of a degree from 2 on that
    another polynomial could have there: then at least `points` points of it were seen.
    """
    lines = [_Line(flow, degree, found.values()) for _ in range(points)]
    spaces = [space for line in lines for space in line.spaces()]
    for vector in _in_common(spaces, points + 1, flow.prime):
        P = _lifted(vector, degree, flow.prime, field)
        if P is not None and darboux_cofactor(field, P) is not None:
            found.setdefault(str(P), P)
    return len(spaces) <= _MOST_SPACES and all(line.is_explained_by(found.values()) for line in lines)


def _in_common(spaces: Sequence[Vectors], most: int, prime: int) -> Iterator[list[int]]:
    """What up to so many of the spaces have in common, where that is one vector."""

    def further(common: Vectors, start: int, left: int) -> Iterator[list[int]]:
        if len(common) == 1:
            yield common[0]
        elif common and left:
            for k in range(start, len(spaces)):
                yield from further(_intersection(common, spaces[k], prime), k + 1, left - 1)

    for k, space in enumerate(spaces[:_MOST_SPACES]):
        yield from further(space, k + 1, max(1, most - 1))


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

    def spaces(self) -> list[Vectors]:
        """What vanishes along the solution from each point of the line where that is more than at others."""
        p, found = self.flow.prime, []
        for root, _ in self.left.roots():
            space = null_space(self._rows(self.at(int(root))), self.count, p)
            if len(space) > self.count - self.rank:
                found.append(space)
        return found

    def is_explained_by(self, known: Iterable[fmpq_mpoly]) -> bool:
        """Whether no irreducible factor of a degree from 2 to that of the polynomials is left over."""
        p, rest = self.flow.prime, self._without(self.left, known)
        t = nmod_poly([0, 1], p)
        power = t
        for degree in range(1, self.degree + 1):
            if rest.degree() < degree:
                break
            power = power.pow_mod(p, rest)  # t^(p^degree): gcds with it minus t are products of factors of that degree
            factors = rest.gcd(power - t)
            if degree > 1 and factors.degree() > 0:
                return False
            while factors.degree() > 0:
                rest = rest // factors
                factors = rest.gcd(factors)
            power = power % rest if rest.degree() > 0 else power
        return True

    def _rows(self, x: Point) -> Vectors:
        return self.flow.series(x, self.degree, self.count + _SPARE)

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
            minors = (nmod_mat([*rows, one], p) * mix for one, mix in zip((last, following), mixes, strict=True))
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
