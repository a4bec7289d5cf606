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
from functools import cached_property

from flint import fmpq, fmpz

from kahanmaps.maps.normal_form.planar_algebra import AlgebraBlock
from kahanmaps.maps.normal_form.planar_block import Triple
from kahanmaps.maps.normal_form.planar_integers import (
    IntegerBlock,
    content,
    divide_exactly,
    is_all,
    radical,
)

Block = IntegerBlock | AlgebraBlock

# Powers of the fixed primes up to this one are found in one residue.
_POWER = 3


@dataclass(frozen=True)
class _Row:
    """One coordinate: sum of (alpha_i U_i + beta_i V_i) / (below W_i) over the planes of `support`, with integers."""

    support: tuple[int, ...]
    forms: tuple[tuple[fmpz, ...], ...]
    below: fmpz
    fixed: fmpz
    dividing: tuple[int, ...]  # the planes whose h the form divides

    def over(self, scaled: dict[int, list[fmpz]], product: fmpz) -> tuple[fmpz, fmpz]:
        """Numerator and denominator, from U_i and V_i times the other W of the support, and the product of all."""
        above = sum((_at(form, scaled[i]) for i, form in zip(self.support, self.forms, strict=True)), fmpz(0))
        return above, self.below * product


class Assembly:
    """How points are put together from triples: for blocks and, for each, the rows of x = sum of R (u, v)."""

    def __init__(self, blocks: Sequence[Block], matrices: Sequence[Sequence[Sequence[fmpq]]]) -> None:
        self.blocks = blocks
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
        self.excess = int(max(below.bit_length(), (self.dim * largest).bit_length()))
        self.excess += sum(block.slack for block in blocks)


def _row(blocks: Sequence[Block], forms: Sequence[Sequence[fmpq]]) -> _Row:
    support = tuple(i for i, form in enumerate(forms) if any(entry != 0 for entry in form))
    below = fmpz(1)
    for i in support:
        for entry in forms[i]:
            below = below.lcm(entry.q)
    integers, factors, dividing = [], [below], []
    for i in support:
        form = tuple((entry * below).p for entry in forms[i])
        integers.append(form)
        block = blocks[i]
        if block.is_constant:
            factors.append(block.fraction(block.start)[1])
            continue
        factors.append(content(form))
        if block.level is not None:
            factors += block.primes
        value = None if block.level is None else block.fixed(form)
        if value is None:
            dividing.append(i)
        else:
            factors.append(value)
    return _Row(support, tuple(integers), below, radical(*factors), tuple(dividing))


class PlanesPoint:
    """The point of R^{2m} with these primitive triples in the planes of an assembly."""

    def __init__(self, assembly: Assembly, triples: Sequence[Triple]) -> None:
        self._assembly = assembly
        self._height: int | None = None
        self.triples = tuple(triples)

    @property
    def bits(self) -> int:
        """About the bit length of the largest of the integers over one common denominator."""
        pairs = [block.bits(triple) for block, triple in zip(self._assembly.blocks, self.triples, strict=True)]
        return sum(below for _, below in pairs) + max(0, *(above - below for above, below in pairs))

    @cached_property
    def _fractions(self) -> list[tuple[list[fmpz], fmpz, fmpz]]:
        """In every plane numerators of the coordinates, their denominator, and primes that may cancel."""
        return [block.fraction(triple) for block, triple in zip(self._assembly.blocks, self.triples, strict=True)]

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
        pairs = zip(self._assembly.blocks, self.triples, other.triples, strict=True)
        return all(block.same(P, Q) for block, P, Q in pairs)

    def __hash__(self) -> int:
        # Triples over an extension are not unique.
        return hash(tuple(abs(W) for _, _, W in self.triples if isinstance(W, fmpz)))

    def common(self) -> tuple[list[fmpz], fmpz]:
        """Numerators of all coordinates over one denominator; what the W_i have in common is left in both."""
        below = fmpz(1)
        for row in self._assembly.rows:
            below = below.lcm(row.below)
        everything = tuple(range(len(self.triples)))
        scaled, product = _scaled([(above, W) for above, W, _ in self._fractions], everything)
        numerators = []
        for row in self._assembly.rows:
            factor = below // row.below
            total = fmpz(0)
            for i, form in zip(row.support, row.forms, strict=True):
                total += _at([entry * factor for entry in form], scaled[i])
            numerators.append(total)
        return numerators, below * product

    def lowest_terms(self) -> list[tuple[fmpz, fmpz]]:
        """Numerator and denominator of each coordinate, reduced, denominators positive."""
        planes = [(above, W) for above, W, _ in self._fractions]
        suspects = _shared([W for _, W in planes])
        for _, _, primes in self._fractions:
            suspects = suspects * primes
        modulus = (self._assembly.fixed * suspects) ** _POWER
        residues = [([entry % modulus for entry in above], W % modulus) for above, W in planes]
        sets: dict[tuple[int, ...], tuple[dict[int, list[fmpz]], fmpz]] = {}
        small: dict[tuple[int, ...], tuple[dict[int, list[fmpz]], fmpz]] = {}
        divisors: dict[tuple[int, ...], fmpz] = {}
        pairs = []
        for row in self._assembly.rows:
            if row.support not in sets:
                sets[row.support] = _scaled(planes, row.support)
                small[row.support] = _scaled(residues, row.support)
            above, below = row.over(*sets[row.support])
            if above == 0:
                pairs.append((above, fmpz(1)))
                continue
            common = fmpz(1)
            for i, form in zip(row.support, row.forms, strict=True):
                if i in row.dividing:
                    common = common * self._divisor(i, form, divisors)
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

    def _divisor(self, i: int, form: Sequence[fmpz], known: dict[tuple[int, ...], fmpz]) -> fmpz:
        """gcd(alpha U + beta V, W) but for fixed primes, where alpha U + beta V divides h: one gcd for all rows."""
        common = content(form)
        primitive = [entry // common for entry in form]
        key = (i, *map(int, primitive))
        if key not in known:
            above, below, _ = self._fractions[i]
            known[key] = _at(primitive, above).gcd(below)
        return known[key]

    def rationals(self) -> tuple[fmpq, ...]:
        """The coordinates as fmpq (whose constructor runs a gcd of its own)."""
        return tuple(fmpq(above, below) for above, below in self.lowest_terms())


def _at(form: Sequence[fmpz], values: Sequence[fmpz]) -> fmpz:
    return sum((c * value for c, value in zip(form, values, strict=True) if c != 0), fmpz(0))


def _scaled(
    planes: Sequence[tuple[Sequence[fmpz], fmpz]], support: tuple[int, ...]
) -> tuple[dict[int, list[fmpz]], fmpz]:
    """U_i and V_i times the other W of the support, and the product of all."""
    # Products of all but one, from both ends.
    count = len(support)
    left, right = [fmpz(1)], [fmpz(1)]
    for i in support:
        left.append(left[-1] * planes[i][1])
    for i in reversed(support[1:]):
        right.append(right[-1] * planes[i][1])
    scaled = {}
    for k, i in enumerate(support):
        others = left[k] * right[count - 1 - k]
        scaled[i] = [entry * others for entry in planes[i][0]]
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
