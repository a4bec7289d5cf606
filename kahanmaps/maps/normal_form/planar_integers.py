"""Planes over Q in integers: primitive triples, and the bad primes.

h and the initial point are scaled such that h is a primitive integer form and (U, V, W) are integers without a common
factor; the scale contains eps. Psi is quadratic, so the content of Psi(P_k) must be removed: otherwise the numbers
would double their length with every step. Up to primes that divide 6 disc(h) den(level), the content of
Psi(P_k) is W_{k-1}, the last coordinate of the point before P_k (proved in docs/mathematics.md); this gives the natural
lifts of `tau`. Single steps remove the content by gcds. They are used for short orbits, and on singular cubics, where
numbers hardly grow.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from itertools import chain, islice
from typing import Any

from flint import fmpq, fmpz, nmod

from kahanmaps.algebra.integers import common_part, content, divide_exactly, over_common_denominator, radical
from kahanmaps.maps.normal_form.planar_block import PlanarBlock, Triple
from kahanmaps.maps.somos import Integers

IntegerTriple = tuple[fmpz, fmpz, fmpz]


class LevelBlock(ABC):
    """A plane with an initial point, the level of this point, and the test whether the level is special."""

    block: PlanarBlock
    start: Triple
    table: Any = None  # the table of tau functions, stored for consecutive points

    @property
    def is_constant(self) -> bool:
        """Whether the initial point is a fixed point because h = 0 or the point is the origin."""
        return bool(self.block.is_zero or (self.start[0] == 0 and self.start[1] == 0))

    @cached_property
    def level(self) -> Any:
        """The conserved level h / (W (W^2 + D)); None if the first step is undefined."""
        numerator, denominator = self.block.level(self.start)
        return None if denominator == 0 else (fmpq(1) * numerator) / denominator

    @cached_property
    def delta(self) -> Any:
        """disc(h) level^2; the level cubic is singular if delta is 0 or 1."""
        assert self.level is not None
        return self.block.discriminant * self.level * self.level

    @property
    def is_degenerate(self) -> bool:
        """Whether the level cubic is singular (delta is 0 or 1), so that heights grow at most linearly."""
        return bool(self.delta == 0 or self.delta == 1)

    def triples(self) -> Iterator[Triple]:
        """Yield P_0, P_1, ... as primitive triples, up to the first indeterminacy point."""
        point = self.start
        while True:
            yield point
            if not self.is_constant:
                image = self.block.image(point)
                if image[2] == 0:
                    return
                point = self.shortest(image)

    @staticmethod
    @abstractmethod
    def shortest(triple: Triple) -> Triple:
        """Return the normalized triple that is proportional to `triple`."""


class IntegerBlock(LevelBlock):
    """One plane over Q for the map with time step 2 eps: `cubic` lists the coefficients of h, (u, v) is the start.

    `start` is a primitive triple, and `scale` the number with (U/W, V/W) = scale (u, v).

    >>> block = IntegerBlock([fmpq(1), fmpq(0), fmpq(0), fmpq(1)], fmpq(1, 10), fmpq(1, 2), fmpq(1, 3))
    >>> block.start, block.scale
    ((3, 2, 30), 1/5)
    """

    def __init__(self, cubic: Sequence[fmpq], eps: fmpq, u: fmpq, v: fmpq) -> None:
        integers, denominator = over_common_denominator(cubic)
        gcd = content(integers)
        if gcd == 0:
            gcd = fmpz(1)
        self.block = PlanarBlock(*(entry // gcd for entry in integers))
        self.scale: fmpq = 2 * eps * fmpq(gcd, denominator)
        (U, V), W = over_common_denominator((u * self.scale, v * self.scale))
        self.start = U, V, W

    @cached_property
    def bad(self) -> fmpz:
        """An integer divisible by all primes at which the content rule (module docstring) may fail; disc(h) != 0."""
        assert self.level is not None
        return radical(6 * self.block.discriminant, self.level.q)

    @cached_property
    def power(self) -> fmpz:
        """A power of `bad` that is divisible by the bad parts of most numbers."""
        return self.bad**3

    @cached_property
    def numbers(self) -> PlaneIntegers:
        """The representation of the values of tau functions."""
        return PlaneIntegers(self.power)

    @property
    def lifts(self) -> tuple[PlanarBlock, Triple, Triple]:
        """The cubic, and natural lifts of the start and its image; all lifts are then primitive outside `bad`."""
        one, points = fmpq(1), list(islice(self.triples(), 2))
        if len(points) < 2:  # the start is a pole
            points.append(primitive(self.block.image(self.start)))
        start_lift, image_lift = (tuple(one * entry for entry in P) for P in points)
        return self.block, start_lift, image_lift

    slack = 0

    @property
    def primes(self) -> list[fmpz]:
        """Integers whose prime factors include all primes at which a sum of coordinates may cancel."""
        assert self.level is not None
        return [self.level.q]

    @staticmethod
    def bits(triple: IntegerTriple) -> tuple[int, int]:
        """Return the approximate bit lengths of the numerators and the denominator returned by `fraction`."""
        return int(max(triple[0].bit_length(), triple[1].bit_length())), int(triple[2].bit_length())

    @staticmethod
    def fraction(triple: IntegerTriple) -> tuple[list[fmpz], fmpz, fmpz]:
        """Return the numerators of U/W and V/W, the denominator, and 1 (no further primes may cancel)."""
        return [triple[0], triple[1]], triple[2], fmpz(1)

    def fixed_number(self, form: Sequence[fmpz]) -> fmpz | None:
        """Return a number divisible by all primes that alpha U + beta V, (alpha, beta) = `form`, and W may share.

        None if every prime may be common to both.
        """
        alpha, beta = form
        value = self.block.h(beta, -alpha)
        return None if value == 0 else value

    @staticmethod
    def is_same_point(P: IntegerTriple, Q: IntegerTriple) -> bool:
        """Return whether two primitive triples are the same point."""
        return P[2] in (Q[2], -Q[2]) and tuple(P) in (tuple(Q), tuple(-entry for entry in Q))

    @staticmethod
    def integral(triple: Triple) -> IntegerTriple:
        """Return a rational triple as a primitive triple of integers."""
        return primitive(_clear_denominators([triple])[0])

    @staticmethod
    def residue_map(prime: int) -> Callable[[fmpz], nmod] | None:
        """Return the map that reduces integers modulo a prime."""
        return lambda entry: nmod(entry, prime)

    @staticmethod
    def shortest(triple: IntegerTriple) -> IntegerTriple:
        """Divide the triple by its content."""
        return primitive(triple)


class PlaneIntegers(Integers):
    """Terms of tau functions over Q, and points computed from them."""

    def lifts(self, points: Sequence[Triple]) -> list[IntegerTriple]:
        """Multiply triples of rational numbers by a common denominator."""
        return _clear_denominators(points)

    def combine(
        self, scales: Sequence[fmpq], terms: Sequence[fmpz], lifts: Sequence[IntegerTriple], divisor: fmpz
    ) -> IntegerTriple:
        """Return the primitive triple of the sum of scale * term * lift; `divisor` divides the sum."""
        factors, _ = over_common_denominator(scales)
        undivided_entries = [
            sum(((f * lift[i]) * term for f, term, lift in zip(factors, terms, lifts, strict=True)), fmpz(0))
            for i in range(3)
        ]
        # No bad prime divides `divisor`.
        U, V, W = divide_exactly(undivided_entries, common_part(undivided_entries[::-1], self.power) * divisor)
        return U, V, W


def _clear_denominators(points: Sequence[Triple]) -> list[IntegerTriple]:
    integers, _ = over_common_denominator(chain(*points))
    return list(zip(integers[::3], integers[1::3], integers[2::3], strict=True))


def primitive(triple: Sequence[fmpz]) -> IntegerTriple:
    """Divide the triple by its content."""
    gcd = content(triple)
    U, V, W = triple
    return (U, V, W) if gcd <= 1 else (U // gcd, V // gcd, W // gcd)
