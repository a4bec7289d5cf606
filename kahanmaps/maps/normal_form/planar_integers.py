"""A plane over Q in integers: primitive triples, and steps whose common factor is known beforehand.

h and the start are scaled such that h is a primitive integer form and (U, V, W) integers without a common factor; eps
is in that scale. Psi(P_k) is quadratic in the triple P_k, and its content has to go, or the numbers would double
their length with every step. **Content rule.** For primes that do not divide 6 disc(h) den(level) the content of
Psi(P_k) is W_{k-1}, the last coordinate of the point before P_k (docs/mathematics.md proves it). So one divides by
W_{k-1}, which is exact, and then strips the few bad primes, by residues: no gcd of large numbers. A division that
leaves a remainder would be a mistake of ours; the lowest 64 bits are multiplied back each time.

For disc(h) = 0 the rule says nothing, but there numbers hardly grow, and gcds are cheap.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

from flint import fmpq, fmpz

from kahanmaps.maps.normal_form.planar_block import PlanarBlock

IntegerTriple = tuple[fmpz, fmpz, fmpz]

_LOW = (fmpz(1) << 64) - 1


class IntegerBlock:
    """One plane over Q for the map with time step 2 eps: `cubic` has the coefficients of h, (u, v) is the start.

    `start` is a primitive triple, `scale` the number with (U/W, V/W) = scale (u, v).

    >>> block = IntegerBlock([fmpq(1), fmpq(0), fmpq(0), fmpq(1)], fmpq(1, 10), fmpq(1, 2), fmpq(1, 3))
    >>> block.start, block.scale
    ((3, 2, 30), 1/5)
    """

    def __init__(self, cubic: Sequence[fmpq], eps: fmpq, u: fmpq, v: fmpq) -> None:
        below = fmpz(1)
        for coefficient in cubic:
            below = below.lcm(coefficient.q)
        integers = [(coefficient * below).p for coefficient in cubic]
        common = content(integers)
        if common == 0:
            common = fmpz(1)
        self.block = PlanarBlock(*(entry // common for entry in integers))
        self.scale: fmpq = 2 * eps * fmpq(common, below)
        U, V = u * self.scale, v * self.scale
        W = U.q.lcm(V.q)
        self.start = primitive(((U * W).p, (V * W).p, W))

    @property
    def is_constant(self) -> bool:
        """Whether every step leads to the start: h = 0, or the start is the origin."""
        return self.block.is_zero or (self.start[0] == 0 and self.start[1] == 0)

    @cached_property
    def level(self) -> fmpq | None:
        """h / (W (W^2 + D)), conserved; None where the first step has no value."""
        above, below = self.block.level(self.start)
        return None if below == 0 else fmpq(above, below)

    @cached_property
    def delta(self) -> fmpq:
        """disc(h) level^2; the level cubic is singular where this is 0 or 1."""
        assert self.level is not None
        found: fmpq = self.block.discriminant * self.level * self.level
        return found

    @property
    def is_degenerate(self) -> bool:
        """Whether the level cubic is singular (delta is 0 or 1): heights grow no faster than linearly then."""
        return self.delta == 0 or self.delta == 1

    @cached_property
    def bad(self) -> fmpz:
        """An integer with exactly the primes for which the content rule does not speak (not for disc(h) = 0)."""
        assert self.level is not None
        return radical(6 * self.block.discriminant, self.level.q)

    def triples(self, previous: IntegerTriple | None = None) -> Iterator[IntegerTriple]:
        """P_0, P_1, ..., primitive, as long as there is a value; by the content rule, or by gcds where it is silent."""
        if self.is_constant:
            while True:
                yield self.start
        if self.level is None:
            yield self.start
            return
        if previous is None:
            previous = primitive(self.block.preimage(self.start))
        yield from self.triples_from(self.start, previous)

    def triples_from(self, point: IntegerTriple, previous: IntegerTriple) -> Iterator[IntegerTriple]:
        """The orbit of `point`, whose predecessor on the cubic is `previous` (both primitive)."""
        by_rule = self.block.discriminant != 0
        while True:
            yield point
            raw = self.block.image(point)
            if raw[2] == 0:
                return
            if by_rule and previous[2] != 0:
                image = strip(divide_exactly(raw, without(previous[2], self.bad)), self.bad)
            else:  # after a pole the previous point is at infinity
                image = primitive(raw)
            previous, point = point, image


def content(integers: Sequence[fmpz]) -> fmpz:
    """The greatest common divisor of integers."""
    common = fmpz(0)
    for entry in integers:
        common = common.gcd(entry)
        if common == 1:
            break
    return common


def primitive(triple: Sequence[fmpz]) -> IntegerTriple:
    """The triple over its content."""
    common = content(triple)
    U, V, W = triple
    return (U, V, W) if common <= 1 else (U // common, V // common, W // common)


def without(number: fmpz, bad: fmpz) -> fmpz:
    """The largest divisor of a number, not zero, that is coprime to `bad`."""
    return bad_part(number, bad)[0]


def bad_part(number: fmpz, bad: fmpz) -> tuple[fmpz, fmpz]:
    """The number as (coprime to `bad`) times (only primes of `bad`); zero as (0, 1)."""
    part, power = fmpz(1), bad * bad * bad
    if number == 0:
        return number, part
    while (common := power.gcd(number % power)) != 1:
        number = number // common
        part = part * common
        if is_all(common, power):
            break
        power = power * power  # a prime may be there to a high power
    return number, part


def strip(triple: Sequence[fmpz], bad: fmpz, divisor: fmpz | None = None, power: fmpz | None = None) -> IntegerTriple:
    """The triple without the common factors that its entries have in the primes of `bad`; and divided by `divisor`.

    The divisor has to divide all entries and to be coprime to `bad`. `power` is a power of `bad` to begin with.
    """
    U, V, W = triple
    power = bad * bad * bad if power is None else power
    common = power.gcd(W % power)
    if common != 1:
        common = common.gcd(U % power)
    if common != 1:
        common = common.gcd(V % power)
    if common != 1 or divisor is not None:
        U, V, W = divide_exactly((U, V, W), common if divisor is None else common * divisor)
    return (U, V, W) if common == 1 or is_all(common, power) else strip((U, V, W), bad, None, power * power)


def is_all(common: fmpz, power: fmpz) -> bool:
    """Whether a common divisor with `power` is all there is: no prime is in it as often as in `power`."""
    rest = power // common
    while common != 1:
        shared = common.gcd(rest)
        if shared == 1:
            return False
        common = common // shared
    return True


def divide_exactly(values: Sequence[fmpz], divisor: fmpz) -> list[fmpz]:
    """values / divisor. Raises ArithmeticError where a remainder shows in the lowest 64 bits."""
    if divisor == 1:
        return list(values)
    quotients = [value // divisor for value in values]
    low = divisor & _LOW
    for value, quotient in zip(values, quotients, strict=True):
        if ((quotient & _LOW) * low - value) & _LOW != 0:
            raise ArithmeticError("a division that should be exact left a remainder: please report this")
    return quotients


def radical(*numbers: fmpz) -> fmpz:
    """An integer with the primes of these numbers (not zero), small ones once, others to low powers."""
    product = fmpz(1)
    for number in numbers:
        if number == 0:
            raise ArithmeticError("zero has no radical: please report this")
        rest = abs(number)
        for prime in _SMALL_PRIMES:
            if rest % prime == 0:
                if product % prime != 0:
                    product = product * prime
                while rest % prime == 0:
                    rest = rest // prime
        if rest > 1:
            rest = without(rest, product) if product > 1 else rest
            # A perfect power counts once.
            for exponent in (2, 3, 5):
                root = rest.root(exponent)
                while rest > 1 and root**exponent == rest:
                    rest = root
                    root = rest.root(exponent)
            product = product * rest
    return product


_SMALL_PRIMES = tuple(n for n in range(2, 100) if all(n % k for k in range(2, int(n**0.5) + 1)))
