"""Planes over a number field K = Q[t]/g in integers: values of tau functions as short elements of Z[t].

The statements for planes over Q (`planar_integers`, `tau`) hold over K for each prime ideal: outside the bad primes,
natural lifts are integral, and so are psi and chi (of `tau`). But ideals need not be principal, and an element may be
short at one root of g and long at another. So a value is multiplied by a short element of the lattice of all elements
that cancel the bad part of the value. LLL finds such an element, with the lengths at the roots as weights. Any element
is correct, since the product of value and scale is exact.

A point (U : V : W) has the rational coordinates U W'/N and V W'/N, where N = W W' is the norm of W.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, lru_cache, reduce
from itertools import combinations, product
from typing import Any

from flint import arb, fmpq, fmpq_mat, fmpq_poly, fmpz, fmpz_mat, nmod, nmod_poly

from kahanmaps.algebra.etale import EtaleAlgebra, EtaleElement
from kahanmaps.algebra.integers import (
    SMALL_PRIMES,
    common_part,
    content,
    coprime_part,
    over_common_denominator,
    radical,
    split_by_primes,
)
from kahanmaps.maps.normal_form.planar_block import PlanarBlock, Triple, same_point
from kahanmaps.maps.normal_form.planar_integers import LevelBlock

_MAX_LENGTH_RATIO = 1 << 20  # a value is short if its bad part and the ratios of its lengths at the roots are smaller
_MIN_RELATIVE_LENGTH = arb(2) ** -50  # smallest length at a root that is used, relative to the largest


class AlgebraBlock(LevelBlock):
    """One plane over K, with g integral: `block` is the cubic, and `start` is the triple (2 eps u : 2 eps v : 1)."""

    def __init__(self, block: PlanarBlock, start: Triple, scale: fmpq) -> None:
        self.block, self.start, self.scale = block, start, scale
        self.algebra: EtaleAlgebra = start[0].field

    @cached_property
    def bad(self) -> fmpz:
        """An integer divisible by small primes and all primes modulo which the start or its image may be (0, 0, 0)."""
        assert self.level is not None
        cubic, g = self.block, self.algebra.chi
        disc = cubic.discriminant
        numbers = [fmpz(6), g.resultant(g.derivative()).p, self.level.polynomial.denom(), *map(fmpz, SMALL_PRIMES)]
        numbers += [e.polynomial.denom() for e in (cubic.a, cubic.b, cubic.c, cubic.d, disc, *self.start)]
        if disc != 0:
            numbers.append(self.algebra.norm(disc).p)
        image_norms = [self.algebra.norm(entry) for entry in self.lifts[2]]
        numbers += [content(norm.p for norm in image_norms), *(norm.q for norm in image_norms)]
        return radical(*numbers)

    @cached_property
    def numbers(self) -> ShortElements:
        """The object that represents values of tau functions by short elements."""
        return ShortElements(self.algebra, self.bad)

    @cached_property
    def lifts(self) -> tuple[PlanarBlock, Triple, Triple]:
        """The cubic, and lifts of the start and its image; the primes of their contents divide `bad`."""
        return self.block, self.start, self.block.image(self.start)

    @property
    def primes(self) -> list[fmpz]:
        """Integers whose prime factors include all primes at which a sum of coordinates may cancel."""
        return [self.bad]

    def bits(self, triple: Triple) -> tuple[int, int]:
        """Return the approximate bit lengths of the numerators and the denominator returned by `fraction`."""
        U, V, W = (max((int(abs(c.p).bit_length()) for c in entry.polynomial.coeffs()), default=1) for entry in triple)
        if triple[2].polynomial.degree() == 0:
            denominator_bits = int(sum(entry.polynomial.denom().bit_length() for entry in triple))
            return max(U, V) + denominator_bits, W + denominator_bits
        return (self.algebra.degree - 1) * W + max(U, V), self.algebra.degree * W

    @property
    def slack(self) -> int:
        """The largest error of `bits`."""
        largest = max(abs(entry.p) for entry in self.algebra.chi.coeffs())
        return int(self.algebra.degree**2 * (largest.bit_length() + self.algebra.degree + 3))

    def fraction(self, triple: Triple) -> tuple[list[fmpz], fmpz, fmpz]:
        """Return numerators of the coefficients of U/W and V/W, their denominator, and a third number (see below).

        If a prime divides the denominator, but neither `bad` nor the third number, exactly one prime ideal above it
        divides W, and this ideal has degree 1. If W is not rational, the level of the initial point must be defined.
        """
        U, V, W = triple
        if W.polynomial.degree() == 0:
            numerators, denominator = over_common_denominator(e for z in (U, V) for e in (z / W).coefficients)
            return numerators, denominator, denominator
        # W' and the norm N = W W', by Faddeev and LeVerrier's recursion: traces instead of determinants.
        algebra, power = W.field, W
        for k in range(1, algebra.degree):
            cofactor = power - algebra.trace(power) / k
            if k < algebra.degree - 1:
                power = W * cofactor
        # N is rational, so one coefficient of the last product suffices; the full product would cost more.
        norm, multiple = fmpq(0), cofactor
        for entry in W.coefficients:
            norm += entry * multiple.polynomial[0]
            multiple = multiple * algebra.generator
        numerators = [entry.p for z in (U, V) for entry in (z * cofactor).coefficients]
        coprime_content, other_part = split_by_primes(content(entry.p for entry in cofactor.coefficients), self.bad**3)
        # One common factor is removed from all coordinates: reducing each fraction separately costs as many gcds.
        common_factor = common_part([norm.p, *numerators], self.bad**4 * other_part)
        return [entry // common_factor for entry in numerators], norm.p // common_factor, coprime_content

    def fixed_number(self, form: Sequence[fmpz]) -> fmpz | None:
        """Return a number divisible by all primes that may divide the form and its denominator; None if any prime may.

        The form is Tr((alpha U + beta V)/(W g'(t))) for elements alpha and beta of K, since the elements of the basis
        dual to 1, t, ..., t^(n-1) with respect to the trace have the denominator g'(t) (Euler).
        """
        g, degree = self.algebra.chi, self.algebra.degree
        dual_basis = [self.algebra.convert(fmpq_poly([g[j] for j in range(k + 1, degree + 1)])) for k in range(degree)]
        alpha, beta = (
            sum((c * e for c, e in zip(coefficients, dual_basis, strict=True)), self.algebra.zero)
            for coefficients in (form[:degree], form[degree:])
        )
        value = self.block.h(beta, -alpha)
        if value == 0:
            return None
        norm = self.algebra.norm(value)
        return norm.p * norm.q

    @staticmethod
    def shortest(triple: Triple) -> Triple:
        """Return the triple divided by W; unchanged if W = 0."""
        U, V, W = triple
        return triple if W == 0 else (U / W, V / W, W / W)

    integral = shortest  # over K, the integral triple is the same

    def residue_map(self, prime: int) -> Callable[[EtaleElement], nmod] | None:
        """Return a homomorphism from the elements of K integral at p to GF(p); None if g has no root modulo p."""
        g = nmod_poly([int(c.p) for c in self.algebra.chi.coeffs()], prime)
        root = next((-factor[0] / factor[1] for factor, _ in g.factor()[1] if factor.degree() == 1), None)
        if root is None:
            return None

        def residue(element: EtaleElement) -> nmod:
            numerator, denominator = element.polynomial.numer(), element.polynomial.denom()
            return nmod_poly([int(c % prime) for c in numerator.coeffs()], prime)(root) / int(denominator % prime)

        return residue

    @staticmethod
    def is_same_point(P: Triple, Q: Triple) -> bool:
        """Return whether two triples are the same point."""
        return same_point(P, Q)


class ShortElements:
    """Values of tau functions over K, each a product of an element of Z[t] with short coefficients and a scale in K."""

    def __init__(self, algebra: EtaleAlgebra, bad: fmpz) -> None:
        self._algebra, self._bad_power = algebra, bad**3
        roots: Any = algebra.chi.complex_roots()
        # Complex balls, not floating-point numbers: roots may exceed the range of the latter.
        self._root_powers = [[root**k for k in range(algebra.degree)] for root, _ in roots if not root.imag < 0]

    def split(self, value: EtaleElement) -> tuple[EtaleElement, EtaleElement]:
        """Write a nonzero value as the product of a short element and a scale."""
        degree, denominator = self._algebra.degree, value.polynomial.denom()
        integers = [(entry * denominator).p for entry in value.coefficients]
        residue = self._algebra.convert(fmpq_poly([entry % self._bad_power for entry in integers]))
        bad_part = self._bad_power.gcd(self._algebra.norm(residue).p % self._bad_power)
        # Midpoints suffice: the lengths only weight the lattice, and the multiplication is exact.
        min_length = max(abs(entry) for entry in integers) * _MIN_RELATIVE_LENGTH
        embeddings = (sum(c * power for c, power in zip(integers, powers, strict=True)) for powers in self._root_powers)
        lengths = [max(min_length, abs(embedding).mid()) for embedding in embeddings]
        if denominator == 1 and bad_part < _MAX_LENGTH_RATIO and max(lengths) < _MAX_LENGTH_RATIO * min(lengths):
            return value, self._algebra.one
        # The lattice of all b in Z[t] with b * value = 0 modulo `bad_part`.
        rows = (residue.matrix.transpose() if bad_part != 1 else residue.matrix).numer_denom()[0].tolist()
        augmented_rows = [
            [entry % bad_part for entry in row] + [int(i == j) for j in range(degree)] for i, row in enumerate(rows)
        ]
        augmented_rows += [[bad_part * int(i == j) for j in range(degree)] + [0] * degree for i in range(degree)]
        lattice = fmpz_mat([row[degree:] for row in fmpz_mat(augmented_rows).hnf().tolist()[degree:]])
        weights = [2.0**60 * max((length / max(lengths)).mid(), _MIN_RELATIVE_LENGTH) for length in lengths]
        real_approximation: list[Any] = [
            [
                (weight * x).mid().floor().unique_fmpz()
                for powers, weight in zip(self._root_powers, weights, strict=True)
                for x in ([powers[k].real] if powers[1].imag == 0 else [powers[k].real, powers[k].imag])
            ]
            for k in range(degree)
        ]
        _, transformation = (lattice * fmpz_mat(real_approximation)).lll(True)
        rows = (transformation * lattice).tolist()
        for signs in _sign_vectors(degree):
            row = [sum((s * row[k] for s, row in zip(signs, rows, strict=True)), fmpz(0)) for k in range(degree)]
            candidate = self._algebra.convert(fmpq_poly(row))
            if coprime_part(self._algebra.norm(candidate).p, self._bad_power) in (1, -1):
                multiplier = candidate * fmpq(denominator, bad_part)
                return value * multiplier, 1 / multiplier
        if denominator == 1:
            return value, self._algebra.one
        multiplier = self._algebra.convert(denominator)
        return value * multiplier, 1 / multiplier

    @staticmethod
    def prepared_divisor(value: EtaleElement) -> EtaleElement:
        """Return 1/value, by which `difference` and `combine` multiply instead of dividing."""
        return 1 / value

    def difference(
        self, s: EtaleElement, left: EtaleElement, t: EtaleElement, right: EtaleElement, inverse: Any = None
    ) -> tuple[EtaleElement, EtaleElement]:
        """Return (s left - t right) times `inverse` (unless this is None) as (short element, scale)."""
        if inverse is not None:
            s, t = s * inverse, t * inverse
        # Add before reducing modulo g, so that one reduction suffices for both products.
        value = EtaleElement(
            self._algebra,
            (s.polynomial * left.polynomial - t.polynomial * right.polynomial) % self._algebra.chi,
        )
        return (value, self._algebra.one) if value == 0 else self.split(value)

    def lifts(self, points: Sequence[Triple]) -> tuple[fmpz_mat, fmpz]:
        """Return (c M, c), c an integer: M maps the coefficients of a_1, a_2, a_3 to sum a_i P_i, P_i in `points`."""
        degree = self._algebra.degree
        blocks = [[point[i].matrix.tolist() for point in points] for i in range(3)]
        rows = [[entry for block in row for entry in block[k]] for row in blocks for k in range(degree)]
        return fmpq_mat(rows).numer_denom()

    def combine(
        self, scales: Sequence[Any], terms: Sequence[Any], lifts: tuple[fmpz_mat, fmpz], inverse: EtaleElement
    ) -> Triple:
        """Return the triple of the sum of scale * term * lift, times `inverse`, in lowest terms without denominator.

        Hence the result is a triple over Z[t], equal to the sum up to a rational factor. Terms are also in Z[t].
        """
        degree = self._algebra.degree
        factors = [(scale * inverse).matrix.numer_denom() for scale in scales]
        common_denominator = reduce(fmpz.lcm, (denominator for _, denominator in factors))
        scaled_terms: list[fmpz] = []
        for (factor, denominator), term in zip(factors, terms, strict=True):
            column = fmpz_mat(degree, 1, [entry.p for entry in term.coefficients])
            scaled_terms += (factor * (common_denominator // denominator) * column).entries()
        matrix, lifts_denominator = lifts
        entries = (matrix * fmpz_mat(3 * degree, 1, scaled_terms)).entries()
        remaining_denominator = common_denominator * lifts_denominator
        for entry in entries:
            remaining_denominator = remaining_denominator.gcd(entry % remaining_denominator)
        integers = [entry // remaining_denominator for entry in entries] if remaining_denominator != 1 else entries
        U, V, W = (
            EtaleElement(self._algebra, fmpq_poly(integers[k : k + degree])) for k in range(0, 3 * degree, degree)
        )
        return U, V, W


@lru_cache
def _sign_vectors(count: int) -> list[tuple[int, ...]]:
    """Return the vectors with at most four entries 1 or -1 and other entries 0, up to sign, fewest entries first."""
    vectors = []
    for nonzero_count in range(1, min(count, 4) + 1):
        for positions in combinations(range(count), nonzero_count):
            for signs in product((1, -1), repeat=nonzero_count - 1):
                sign_at = dict(zip(positions, (1, *signs), strict=True))
                vectors.append(tuple(sign_at.get(k, 0) for k in range(count)))
    return vectors
