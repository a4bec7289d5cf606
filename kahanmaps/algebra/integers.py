"""Integers and the primes of another one: contents, what numbers have of these primes, and what they are without.

Numbers are long, and what they have of given primes is short: it is found from residues. Primes are given by an integer
`power` that they divide, best as often as they are expected in the numbers; what is there more often is found as well.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from flint import fmpq, fmpz

SMALL_PRIMES = tuple(n for n in range(2, 100) if all(n % k for k in range(2, int(n**0.5) + 1)))
_LOW = (fmpz(1) << 64) - 1


def over_one(numbers: Iterable[fmpq]) -> tuple[list[fmpz], fmpz]:
    """The numerators of rational numbers over their least common denominator, and that.

    >>> over_one([fmpq(1, 2), fmpq(-2, 3), fmpq(5)])
    ([3, -4, 30], 6)
    """
    pairs, denominator = [(number.p, number.q) for number in numbers], fmpz(1)
    for _, q in pairs:
        denominator = denominator.lcm(q)
    return [p * (denominator // q) for p, q in pairs], denominator


def content(integers: Iterable[fmpz]) -> fmpz:
    """The greatest common divisor of integers."""
    common = fmpz(0)
    for entry in integers:
        common = common.gcd(entry)
        if common == 1:
            break
    return common


def without(number: fmpz, power: fmpz) -> fmpz:
    """A number, not zero, without the primes of `power`."""
    return split_by_primes(number, power)[0]


def split_by_primes(number: fmpz, power: fmpz) -> tuple[fmpz, fmpz]:
    """The number without the primes of `power`, and what has been taken away, positive; zero as (0, 1)."""
    part = fmpz(1)
    if number == 0:
        return number, part
    while (common := power.gcd(number % power)) != 1:
        number = number // common
        part = part * common
        if is_all(common, power):
            break
        power = common * common  # it has all primes that may still be there
    return number, part


def common_part(numbers: Sequence[fmpz], power: fmpz) -> fmpz:
    """The common factor of numbers, not all of them zero, that is made of the primes of `power`, which is positive."""
    while True:
        common = power
        for number in numbers:
            if common == 1:
                break
            common = common.gcd(number % common)
        if common == 1 or is_all(common, power):
            return common
        power = common * common


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
        for prime in SMALL_PRIMES:
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
