"""A rational point as integers: numerators over ONE common denominator."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

from flint import fmpq, fmpz

Fraction = tuple[fmpz, fmpz]  # numerator and denominator without a common factor, the latter positive


class IntegerPoint:
    """The rational point numerators / denominator, in lowest terms as a whole, denominator positive."""

    def __init__(self, numerators: tuple[fmpz, ...], denominator: fmpz) -> None:
        self.numerators, self.denominator = numerators, denominator

    @staticmethod
    def from_rationals(point: Sequence[fmpq]) -> IntegerPoint:
        """The point with these coordinates."""
        return FractionsPoint([(entry.p, entry.q) for entry in point])

    def rationals(self) -> tuple[fmpq, ...]:
        """The coordinates as reduced fractions; one gcd each."""
        return tuple(fmpq(entry, self.denominator) for entry in self.numerators)

    def lowest_terms(self) -> list[Fraction]:
        """Numerator and denominator of each coordinate, reduced; one gcd of large numbers in all.

        What a numerator shares with W it shares with the product of all numerators modulo W.
        """
        W = self.denominator
        product = fmpz(1)
        for entry in self.numerators:
            product = product * entry % W
        common = W.gcd(product)
        return [(entry // g, W // g) for entry in self.numerators for g in [common.gcd(entry % common)]]

    def residues(self, prime: int) -> list[int] | None:
        """The point modulo a prime, with 1 behind its coordinates; None where the prime divides its denominator."""
        below = int(self.denominator % prime)
        if not below:
            return None
        inverse = pow(below, -1, prime)
        return [*(int(entry * inverse % prime) for entry in self.numerators), 1]

    @property
    def bits(self) -> int:
        """The bit length of the largest of the integers."""
        return max(self.denominator.bit_length(), *(entry.bit_length() for entry in self.numerators))

    def exceeding(self, limit: int) -> int:
        """The bits if they are more than the limit, otherwise 0."""
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


class FractionsPoint(IntegerPoint):
    """A point whose coordinates are known in lowest terms: it looks for their common denominator when that is asked."""

    def __init__(self, fractions: Sequence[Fraction]) -> None:
        self._fractions = list(fractions)

    @cached_property
    def denominator(self) -> fmpz:  # type: ignore[override]
        """The least common denominator."""
        below = fmpz(1)
        for _, q in self._fractions:
            below = below.lcm(q)
        return below

    @cached_property
    def numerators(self) -> tuple[fmpz, ...]:  # type: ignore[override]
        """The coordinates times the least common denominator."""
        return tuple(p * (self.denominator // q) for p, q in self._fractions)

    def rationals(self) -> tuple[fmpq, ...]:
        """The coordinates as reduced fractions; one gcd each."""
        return tuple(fmpq(p, q) for p, q in self._fractions)

    def lowest_terms(self) -> list[Fraction]:
        """Numerator and denominator of each coordinate."""
        return list(self._fractions)

    def exceeding(self, limit: int) -> int:
        """The bits if they are more than the limit, otherwise 0; mostly without looking for the common denominator."""
        lengths = [(abs(p).bit_length(), q.bit_length()) for p, q in self._fractions]
        most = sum(q for _, q in lengths) + max((max(p - q + 1, 0) for p, q in lengths), default=0)
        return 0 if most <= limit else super().exceeding(limit)

    def __eq__(self, other: object) -> bool:
        return self._fractions == other._fractions if isinstance(other, FractionsPoint) else super().__eq__(other)

    __hash__ = IntegerPoint.__hash__
