"""Rational points as integers: numerators over one common denominator."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

from flint import fmpq, fmpz

Fraction = tuple[fmpz, fmpz]  # numerator and denominator without a common factor, the latter positive


class IntegerPoint:
    """The rational point numerators / denominator; the integers have no common factor, the denominator is positive."""

    def __init__(self, numerators: tuple[fmpz, ...], denominator: fmpz) -> None:
        self.numerators, self.denominator = numerators, denominator

    @staticmethod
    def from_rationals(point: Sequence[fmpq]) -> IntegerPoint:
        """Return the point with these coordinates."""
        return FractionsPoint([(entry.p, entry.q) for entry in point])

    def rationals(self) -> tuple[fmpq, ...]:
        """Return the coordinates as reduced fractions, with one gcd each."""
        return tuple(fmpq(entry, self.denominator) for entry in self.numerators)

    def lowest_terms(self) -> list[Fraction]:
        """Return the reduced numerator and denominator of each coordinate, with a single gcd of large numbers.

        A common factor of a numerator and W is also one of W and the product of all numerators modulo W.
        """
        W = self.denominator
        product = fmpz(1)
        for entry in self.numerators:
            product = product * entry % W
        common = W.gcd(product)
        return [(entry // g, W // g) for entry in self.numerators for g in [common.gcd(entry % common)]]

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

    def exceeding(self, limit: int) -> int:
        """Return the bit length if it exceeds the limit, otherwise 0; usually without the common denominator."""
        lengths = [(abs(p).bit_length(), q.bit_length()) for p, q in self._fractions]
        upper_bound = sum(q for _, q in lengths) + max((max(p - q + 1, 0) for p, q in lengths), default=0)
        return 0 if upper_bound <= limit else super().exceeding(limit)

    def __eq__(self, other: object) -> bool:
        return self._fractions == other._fractions if isinstance(other, FractionsPoint) else super().__eq__(other)

    __hash__ = IntegerPoint.__hash__
