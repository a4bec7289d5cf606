"""Integers: contents, common denominators, and the parts of integers that consist of given primes.

The integers are long, and the parts that consist of given primes are short, so these parts are computed from residues.
The primes are given as the divisors of an integer `power`. The computation is fastest if `power` contains each prime
with the multiplicity that it has in the integers; higher multiplicities in the integers are allowed.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from flint import fmpq, fmpz

SMALL_PRIMES = tuple(n for n in range(2, 100) if all(n % k for k in range(2, int(n**0.5) + 1)))
_MASK_64_BITS = (fmpz(1) << 64) - 1


def over_common_denominator(numbers: Iterable[fmpq]) -> tuple[list[fmpz], fmpz]:
    """Return the numerators of rational numbers over their least common denominator, and this denominator.

    >>> over_common_denominator([fmpq(1, 2), fmpq(-2, 3), fmpq(5)])
    ([3, -4, 30], 6)
    """
    pairs, denominator = [(number.p, number.q) for number in numbers], fmpz(1)
    for _, q in pairs:
        denominator = denominator.lcm(q)
    return [p * (denominator // q) for p, q in pairs], denominator


def content(integers: Iterable[fmpz]) -> fmpz:
    """Return the greatest common divisor of integers."""
    gcd = fmpz(0)
    for entry in integers:
        gcd = gcd.gcd(entry)
        if gcd == 1:
            break
    return gcd


def coprime_part(number: fmpz, power: fmpz) -> fmpz:
    """Return the largest divisor of a nonzero integer `number` that is coprime to `power`, with its sign."""
    return split_by_primes(number, power)[0]


def split_by_primes(number: fmpz, power: fmpz) -> tuple[fmpz, fmpz]:
    """Return (a, b), `number` = a b, a coprime to `power`, b > 0 a product of primes dividing `power`; (0, 1) for 0."""
    prime_part = fmpz(1)
    if number == 0:
        return number, prime_part
    while (gcd := power.gcd(number % power)) != 1:
        number = number // gcd
        prime_part = prime_part * gcd
        if has_full_multiplicity(gcd, power):
            break
        power = gcd * gcd  # contains every prime of `power` that may still divide the number
    return number, prime_part


def common_part(numbers: Sequence[fmpz], power: fmpz) -> fmpz:
    """Return the largest common factor of integers (not all 0) that consists of primes dividing `power` > 0."""
    while True:
        gcd = power
        for number in numbers:
            if gcd == 1:
                break
            gcd = gcd.gcd(number % gcd)
        if gcd == 1 or has_full_multiplicity(gcd, power):
            return gcd
        power = gcd * gcd


def has_full_multiplicity(gcd: fmpz, power: fmpz) -> bool:
    """Whether each prime of `gcd` = gcd(n, `power`) occurs more often in `power`; then n has it as often as `gcd`."""
    cofactor = power // gcd
    while gcd != 1:
        common_factor = gcd.gcd(cofactor)
        if common_factor == 1:
            return False
        gcd = gcd // common_factor
    return True


def divide_exactly(values: Sequence[fmpz], divisor: fmpz) -> list[fmpz]:
    """Return all v / divisor, v in `values`. Raises ArithmeticError if the lowest 64 bits of a v reveal a remainder."""
    if divisor == 1:
        return list(values)
    quotients = [value // divisor for value in values]
    low_divisor = divisor & _MASK_64_BITS
    for value, quotient in zip(values, quotients, strict=True):
        if ((quotient & _MASK_64_BITS) * low_divisor - value) & _MASK_64_BITS != 0:
            raise ArithmeticError("a division that should be exact left a remainder: please report this")
    return quotients


def radical(*numbers: fmpz) -> fmpz:
    """Return an integer with the same prime factors as the product of `numbers`; each small prime occurs in it once."""
    product = fmpz(1)
    for number in numbers:
        if number == 0:
            raise ArithmeticError("zero has no radical: please report this")
        cofactor = abs(number)
        for prime in SMALL_PRIMES:
            if cofactor % prime == 0:
                if product % prime != 0:
                    product = product * prime
                while cofactor % prime == 0:
                    cofactor = cofactor // prime
        if cofactor > 1:
            cofactor = coprime_part(cofactor, product) if product > 1 else cofactor
            # Replace perfect powers by their roots.
            for exponent in (2, 3, 5):
                root = cofactor.root(exponent)
                while cofactor > 1 and root**exponent == cofactor:
                    cofactor = root
                    root = cofactor.root(exponent)
            product = product * cofactor
    return product
