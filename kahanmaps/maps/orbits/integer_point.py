"""Rational points as integers: numerators over one common denominator."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

from flint import fmpq, fmpz

from kahanmaps.algebra.integers import common_part, content

Fraction = tuple[fmpz, fmpz]  # numerator and positive denominator without a common factor


# If numbers have fewer bits than this, common factors are always removed.
_LONG_BITS = 3000
# A common factor is short if it has at most _SHORT_BITS + (bits of the numbers)/_SHORT_PART bits; it is not removed ...
_SHORT_BITS, _SHORT_PART = 64, 64
# ... until the numbers have become this many times as long as at the last division.
_MAX_RATIO = 8
_SMALL_PRIMES = fmpz.primorial_ui(fmpz(50)) ** 8  # the primes below 50, each with the exponent 8


class IntegerPoint:
    """The rational point numerators / denominator; the integers have no common factor, the denominator is positive."""

    has_long_factors = False  # whether the integers of some step of the orbit so far had a long common factor
    keeps_factors = False  # whether the integers for the next step may have a common factor
    preceding_denominator: fmpz | None = None  # the denominator of the point whose image this point is, if known

    def __init__(self, numerators: tuple[fmpz, ...], denominator: fmpz) -> None:
        self.numerators, self.denominator = numerators, denominator

    @property
    def integers(self) -> tuple[Sequence[fmpz], fmpz]:
        """The numerators and the denominator for the next step; they may have a short common factor."""
        return self.numerators, self.denominator

    @property
    def reduced_bits(self) -> int:
        """The bit length of the last point of the orbit that was certainly reduced (no common factor)."""
        return self.bits

    @staticmethod
    def from_rationals(point: Sequence[fmpq]) -> IntegerPoint:
        """Return the point with these coordinates."""
        return FractionsPoint([(entry.p, entry.q) for entry in point])

    def rationals(self) -> tuple[fmpq, ...]:
        """Return the coordinates as reduced fractions, with one gcd each."""
        return tuple(fmpq(entry, self.denominator) for entry in self.numerators)

    def lowest_terms(self) -> list[Fraction]:
        """Return the reduced numerator and denominator of each coordinate, with a single gcd of large numbers.

        A common factor of a numerator and the denominator W divides W and the product of all numerators modulo W.
        """
        return _lowest_terms(self.numerators, self.denominator, _gcd_with_product(self.numerators, self.denominator))

    def residues(self, prime: int) -> list[int] | None:
        """Return the coordinates modulo a prime, followed by 1; None if the prime divides the denominator."""
        denominator = int(self.denominator % prime)
        if not denominator:
            return None
        inverse = pow(denominator, -1, prime)
        return [*(int(entry * inverse % prime) for entry in self.numerators), 1]

    @property
    def bits(self) -> int:
        """The largest bit length of the numerators and the denominator."""
        return max(self.denominator.bit_length(), *(entry.bit_length() for entry in self.numerators))

    @property
    def approximate_bits(self) -> int:
        """A bit length that is fast to compute and grows from point to point like `bits`."""
        return self.bits

    def exceeding(self, limit: int) -> int:
        """Return the bit length if it exceeds the limit, otherwise 0."""
        bits = self.bits
        return bits if bits > limit else 0

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, IntegerPoint):
            return NotImplemented
        return (self.numerators, self.denominator) == (other.numerators, other.denominator)

    def __hash__(self) -> int:
        return hash((self.numerators, self.denominator))

    def __repr__(self) -> str:
        return f"IntegerPoint({self.numerators}, {self.denominator})"


def _gcd_with_product(numerators: Sequence[fmpz], W: fmpz) -> fmpz:
    product = fmpz(1)
    for entry in numerators:
        product = product * entry % W
    return W.gcd(product)


def _lowest_terms(numerators: Sequence[fmpz], W: fmpz, common_factors: fmpz) -> list[Fraction]:
    return [(entry // g, W // g) for entry in numerators for g in [common_factors.gcd(entry % common_factors)]]


def lowest(numerators: Sequence[fmpz], denominator: fmpz) -> IntegerPoint | None:
    """Return the point in lowest terms; None if the denominator is 0."""
    if denominator == 0:
        return None
    gcd = content((denominator, *numerators))
    if denominator < 0:
        gcd = -gcd
    return IntegerPoint(tuple(numerator // gcd for numerator in numerators), denominator // gcd)


class UnreducedPoint(IntegerPoint):
    """The image of a point, as integers whose common factor is removed only if this is needed.

    The gcds of long numbers take most of the time of an orbit whose heights grow exponentially, and usually have only a
    few bits. A factor that is not removed costs little: its share of the length of the integers stays the same from
    step to step. So only small primes are divided out at each step, and other common factors if the numbers have
    become `_MAX_RATIO` times as long, or when coordinates are read. After a long common factor all points are reduced.
    """

    def __init__(self, numerators: Sequence[fmpz], denominator: fmpz, previous_point: IntegerPoint) -> None:
        if denominator < 0:
            numerators, denominator = [-entry for entry in numerators], -denominator
        self._previous_state = previous_point.has_long_factors, previous_point.reduced_bits
        self._integers = numerators, denominator
        self._common_factor_multiple: fmpz | None = None  # a multiple of the common factor, if known
        bits = self._bits_with_factors
        self.keeps_factors = _LONG_BITS <= bits < _MAX_RATIO * self._previous_state[1] and not self._previous_state[0]
        if self.keeps_factors:
            self._divide(common_part([denominator, *numerators], _SMALL_PRIMES))

    def _divide(self, factor: fmpz) -> None:
        numerators, denominator = self._integers
        if factor != 1:
            self._integers = [entry // factor for entry in numerators], denominator // factor

    @property
    def _bits_with_factors(self) -> int:
        numerators, denominator = self._integers
        return max(denominator.bit_length(), *(entry.bit_length() for entry in numerators))

    @property
    def integers(self) -> tuple[Sequence[fmpz], fmpz]:
        """The numerators and the denominator for the next step; they may have a short common factor."""
        return self._integers if self.keeps_factors else self._reduced_integers

    @cached_property
    def _reduced_integers(self) -> tuple[tuple[fmpz, ...], fmpz]:
        numerators, denominator = self._integers
        multiple = denominator if self._common_factor_multiple is None else self._common_factor_multiple
        factor = content((multiple, *numerators))
        bits = self._bits_with_factors
        self.has_long_factors = self._previous_state[0] or factor.bit_length() > _SHORT_BITS + bits // _SHORT_PART
        self._divide(factor)
        numerators, denominator = self._integers
        return tuple(numerators), denominator

    @property
    def numerators(self) -> tuple[fmpz, ...]:  # type: ignore[override]
        """The coordinates times the least common denominator."""
        return self._reduced_integers[0]

    @property
    def denominator(self) -> fmpz:  # type: ignore[override]
        """The least common denominator of the coordinates."""
        return self._reduced_integers[1]

    @property
    def reduced_bits(self) -> int:
        """The bit length of the last point of the orbit that was certainly reduced (no common factor)."""
        return self._previous_state[1] if self.keeps_factors else self.bits

    def lowest_terms(self) -> list[Fraction]:
        """Return the reduced numerator and denominator of each coordinate, with a single gcd of large numbers."""
        numerators, W = self._integers
        self._common_factor_multiple = _gcd_with_product(numerators, W)
        return _lowest_terms(numerators, W, self._common_factor_multiple)

    def exceeding(self, limit: int) -> int:
        """Return the bit length if it exceeds the limit, otherwise 0; a gcd is computed only near the limit."""
        return 0 if self._bits_with_factors <= limit else super().exceeding(limit)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, IntegerPoint):
            return NotImplemented
        (numerators, W), (other_numerators, V) = self._integers, other.integers
        return all(x * V == y * W for x, y in zip(numerators, other_numerators, strict=True))

    __hash__ = IntegerPoint.__hash__


class FractionsPoint(IntegerPoint):
    """A point given by coordinates in lowest terms; their common denominator is computed on demand."""

    def __init__(self, fractions: Sequence[Fraction]) -> None:
        self._fractions = list(fractions)

    @cached_property
    def denominator(self) -> fmpz:  # type: ignore[override]
        """The least common denominator of the coordinates."""
        denominator = fmpz(1)
        for _, q in self._fractions:
            denominator = denominator.lcm(q)
        return denominator

    @cached_property
    def numerators(self) -> tuple[fmpz, ...]:  # type: ignore[override]
        """The coordinates times the least common denominator."""
        return tuple(p * (self.denominator // q) for p, q in self._fractions)

    def rationals(self) -> tuple[fmpq, ...]:
        """Return the coordinates as reduced fractions, with one gcd each."""
        return tuple(fmpq(p, q) for p, q in self._fractions)

    def lowest_terms(self) -> list[Fraction]:
        """Return the reduced numerator and denominator of each coordinate."""
        return list(self._fractions)

    @property
    def approximate_bits(self) -> int:
        """The largest bit length of a numerator or denominator, without computing the common denominator."""
        return max(max(p.bit_length(), q.bit_length()) for p, q in self._fractions)

    def exceeding(self, limit: int) -> int:
        """Return the bit length if it exceeds the limit, else 0; usually without computing the common denominator."""
        lengths = [(abs(p).bit_length(), q.bit_length()) for p, q in self._fractions]
        upper_bound = sum(q for _, q in lengths) + max((max(p - q + 1, 0) for p, q in lengths), default=0)
        return 0 if upper_bound <= limit else super().exceeding(limit)

    def __eq__(self, other: object) -> bool:
        return self._fractions == other._fractions if isinstance(other, FractionsPoint) else super().__eq__(other)

    __hash__ = IntegerPoint.__hash__
