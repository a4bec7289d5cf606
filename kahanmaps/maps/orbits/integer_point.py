"""A rational point as integers: numerators over ONE common denominator."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flint import fmpq, fmpz


@dataclass(frozen=True)
class IntegerPoint:
    """The rational point numerators / denominator, in lowest terms as a whole, denominator positive."""

    numerators: tuple[fmpz, ...]
    denominator: fmpz

    @classmethod
    def from_rationals(cls, point: Sequence[fmpq]) -> IntegerPoint:
        """The point with these coordinates."""
        below = fmpz(1)
        for entry in point:
            below = below.lcm(entry.q)
        return cls(tuple(entry.p * (below // entry.q) for entry in point), below)

    def rationals(self) -> tuple[fmpq, ...]:
        """The coordinates as reduced fractions; one gcd each."""
        return tuple(fmpq(entry, self.denominator) for entry in self.numerators)

    def lowest_terms(self) -> list[tuple[fmpz, fmpz]]:
        """Numerator and denominator of each coordinate, reduced; one gcd of large numbers in all.

        What a numerator shares with W it shares with the product of all numerators modulo W.
        """
        W = self.denominator
        product = fmpz(1)
        for entry in self.numerators:
            product = product * entry % W
        common = W.gcd(product)
        return [(entry // g, W // g) for entry in self.numerators for g in [common.gcd(entry % common)]]

    @property
    def bits(self) -> int:
        """The bit length of the largest of the integers."""
        return max(self.denominator.bit_length(), *(entry.bit_length() for entry in self.numerators))

    def exceeding(self, limit: int) -> int:
        """The bits if they are more than the limit, otherwise 0."""
        bits = self.bits
        return bits if bits > limit else 0
