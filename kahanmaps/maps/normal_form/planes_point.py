"""Rational points that are kept as their primitive triples in the planes; x is put together only when asked for.

x_r = sum over i of (alpha_{ri} U_i + beta_{ri} V_i) / W_i with fixed rational alpha and beta. The numerators over the
product of the W_i cost a few multiplications. In lowest terms they are after three more things: the gcds of the W_i
among each other; the primes of the fixed numbers (denominators of alpha, beta and of the level, and h_i(beta,
-alpha): a prime that divides alpha U + beta V and W divides h(U, V) too, so it divides h(beta, -alpha)); and, where
h_i(beta, -alpha) = 0, the gcd of alpha U + beta V and W.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flint import fmpq, fmpz

from kahanmaps.maps.integer_steps import IntegerPoint
from kahanmaps.maps.normal_form.planar_integers import (
    IntegerBlock,
    IntegerTriple,
    content,
    divide_exactly,
    is_all,
    radical,
)

# Powers of the fixed primes up to this one are found in one residue.
_POWER = 3


@dataclass(frozen=True)
class _Row:
    """One coordinate: sum of (alpha_i U_i + beta_i V_i) / (below W_i) over the planes of `support`, with integers."""

    support: tuple[int, ...]
    forms: tuple[tuple[fmpz, fmpz], ...]
    below: fmpz
    fixed: fmpz
    dividing: tuple[int, ...]  # the planes whose h the form divides

    def over(self, scaled: dict[int, tuple[fmpz, fmpz]], product: fmpz) -> tuple[fmpz, fmpz]:
        """Numerator and denominator, from U_i and V_i times the other W of the support, and the product of all."""
        above = fmpz(0)
        for i, (alpha, beta) in zip(self.support, self.forms, strict=True):
            U, V = scaled[i]
            above += alpha * U + beta * V
        return above, self.below * product


class Assembly:
    """How points are put together from triples: for blocks and, for each, the rows of x = sum of R (u, v)."""

    def __init__(self, blocks: Sequence[IntegerBlock], matrices: Sequence[Sequence[Sequence[fmpq]]]) -> None:
        self.dim = len(matrices[0])
        self.rows = [
            _row(
                blocks,
                [[entry / block.scale for entry in matrix[r]] for block, matrix in zip(blocks, matrices, strict=True)],
            )
            for r in range(self.dim)
        ]
        self.fixed = radical(*(row.fixed for row in self.rows))
        # By so many bits numerators may be longer than the products of the triples they are made of.
        below = fmpz(1)
        for row in self.rows:
            below = below.lcm(row.below)
        largest = max(
            (abs(entry) * (below // row.below) for row in self.rows for form in row.forms for entry in form),
            default=fmpz(1),
        )
        self.excess = int(max(below.bit_length(), (2 * len(blocks) * largest).bit_length()))


def _row(blocks: Sequence[IntegerBlock], forms: Sequence[Sequence[fmpq]]) -> _Row:
    support = tuple(i for i, (alpha, beta) in enumerate(forms) if alpha != 0 or beta != 0)
    below = fmpz(1)
    for i in support:
        below = below.lcm(forms[i][0].q).lcm(forms[i][1].q)
    integers, factors, dividing = [], [below], []
    for i in support:
        alpha, beta = ((entry * below).p for entry in forms[i])
        integers.append((alpha, beta))
        block = blocks[i]
        if block.is_constant:
            factors.append(block.start[2])
            continue
        factors += [content((alpha, beta)), fmpz(1) if block.level is None else block.level.q]
        value = block.block.h(beta, -alpha)
        if value == 0 or block.level is None:
            dividing.append(i)
        else:
            factors.append(value)
    return _Row(support, tuple(integers), below, radical(*factors), tuple(dividing))


class PlanesPoint:
    """The point of R^{2m} with these primitive triples in the planes of an assembly."""

    __slots__ = ("_assembly", "_height", "triples")

    def __init__(self, assembly: Assembly, triples: Sequence[IntegerTriple]) -> None:
        self._assembly = assembly
        self._height: int | None = None
        self.triples = tuple(triples)

    @property
    def bits(self) -> int:
        """About the bit length of the largest of the integers over one common denominator."""
        below = sum(W.bit_length() for _, _, W in self.triples)
        return below + max(0, *(max(U.bit_length(), V.bit_length()) - W.bit_length() for U, V, W in self.triples))

    @property
    def height(self) -> int:
        """The bit length of the largest of the integers over one common denominator in lowest terms; costs a gcd.

        `bits` is a few bits off, and much too high where planes have denominators in common.
        """
        if self._height is None:
            numerators, below = self.common()
            common = below
            for entry in numerators:
                if common == 1:
                    break
                common = common.gcd(entry % common)  # large once, small from then on
            largest = max(map(abs, [*numerators, below]))
            self._height = int((largest // abs(common)).bit_length())
        return self._height

    def exceeding(self, limit: int) -> int:
        """The height if it is more than the limit, otherwise 0; a gcd is run only where that is needed to tell."""
        if self.bits + self._assembly.excess <= limit:
            return 0
        return self.height if self.height > limit else 0

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, PlanesPoint):
            return NotImplemented
        return all(
            W == w * sign and U == u * sign and V == v * sign
            for (U, V, W), (u, v, w) in zip(self.triples, other.triples, strict=True)
            for sign in [1 if (W > 0) == (w > 0) else -1]
        )

    def __hash__(self) -> int:
        return hash(tuple(abs(W) for _, _, W in self.triples))

    def common(self) -> tuple[list[fmpz], fmpz]:
        """Numerators of all coordinates over one denominator; what the W_i have in common is left in both."""
        below = fmpz(1)
        for row in self._assembly.rows:
            below = below.lcm(row.below)
        everything = tuple(range(len(self.triples)))
        scaled, product = _scaled(self.triples, everything)
        numerators = []
        for row in self._assembly.rows:
            factor = below // row.below
            total = fmpz(0)
            for i, (alpha, beta) in zip(row.support, row.forms, strict=True):
                U, V = scaled[i]
                total += (alpha * factor) * U + (beta * factor) * V
            numerators.append(total)
        return numerators, below * product

    def integer_point(self) -> IntegerPoint:
        """The point over one denominator in lowest terms."""
        pairs = self.lowest_terms()
        below = fmpz(1)
        for _, denominator in pairs:
            below = below.lcm(denominator)
        return IntegerPoint(tuple(above * (below // denominator) for above, denominator in pairs), below)

    def lowest_terms(self) -> list[tuple[fmpz, fmpz]]:
        """Numerator and denominator of each coordinate, reduced, denominators positive."""
        modulus = (self._assembly.fixed * _shared([W for _, _, W in self.triples])) ** _POWER
        residues = [(U % modulus, V % modulus, W % modulus) for U, V, W in self.triples]
        sets: dict[tuple[int, ...], tuple[dict[int, tuple[fmpz, fmpz]], fmpz]] = {}
        small: dict[tuple[int, ...], tuple[dict[int, tuple[fmpz, fmpz]], fmpz]] = {}
        divisors: dict[tuple[int, fmpz, fmpz], fmpz] = {}
        pairs = []
        for row in self._assembly.rows:
            if row.support not in sets:
                sets[row.support] = _scaled(self.triples, row.support)
                small[row.support] = _scaled(residues, row.support)
            above, below = row.over(*sets[row.support])
            if above == 0:
                pairs.append((above, fmpz(1)))
                continue
            common = fmpz(1)
            for i, (alpha, beta) in zip(row.support, row.forms, strict=True):
                if i in row.dividing:
                    common = common * self._divisor(i, alpha, beta, divisors)
            if common != 1:
                above, below = divide_exactly((above, below), common)
                common = _common_part(above, below, modulus)
            else:
                common = _common_part(*row.over(*small[row.support]), modulus)
            power = modulus
            while common != 1:
                above, below = above // common, below // common
                if is_all(common, power):
                    break
                power = power * power  # a prime may be there to a high power
                common = _common_part(above, below, power)
            pairs.append((above, below) if below > 0 else (-above, -below))
        return pairs

    def _divisor(self, i: int, alpha: fmpz, beta: fmpz, known: dict[tuple[int, fmpz, fmpz], fmpz]) -> fmpz:
        """gcd(alpha U + beta V, W) but for fixed primes, where alpha U + beta V divides h: one gcd for all rows."""
        common = content((alpha, beta))
        key = (i, alpha // common, beta // common)
        if key not in known:
            U, V, W = self.triples[i]
            known[key] = (key[1] * U + key[2] * V).gcd(W)
        return known[key]

    def rationals(self) -> tuple[fmpq, ...]:
        """The coordinates as fmpq (whose constructor runs a gcd of its own)."""
        return tuple(fmpq(above, below) for above, below in self.lowest_terms())


def _scaled(triples: Sequence[IntegerTriple], support: tuple[int, ...]) -> tuple[dict[int, tuple[fmpz, fmpz]], fmpz]:
    """U_i and V_i times the other W of the support, and the product of all."""
    # Products of all but one, from both ends.
    count = len(support)
    left, right = [fmpz(1)], [fmpz(1)]
    for i in support:
        left.append(left[-1] * triples[i][2])
    for i in reversed(support[1:]):
        right.append(right[-1] * triples[i][2])
    scaled = {}
    for k, i in enumerate(support):
        others = left[k] * right[count - 1 - k]
        U, V, _ = triples[i]
        scaled[i] = (U * others, V * others)
    return scaled, left[-1]


def _common_part(above: fmpz, below: fmpz, modulus: fmpz) -> fmpz:
    """What two numbers and the modulus have in common: all of it, unless one of its primes is there to a high power."""
    common = modulus.gcd(above % modulus)
    return common if common == 1 else common.gcd(below % common)


def _shared(numbers: Sequence[fmpz]) -> fmpz:
    """A number with all primes that divide two of these."""
    *others, product = sorted(numbers, key=fmpz.bit_length)  # the longest one is only reduced modulo others
    shared = fmpz(1)
    while others:
        number = others.pop()
        common = number.gcd(product % number)
        if common != 1:
            shared = shared * common
        if others:
            product = product * number
    return shared
