"""Rational numbers from their residues: Wang's reconstruction, several numbers with one denominator, and the CRT.

Infinitely many fractions have a given residue; these functions return the simplest one. The caller must check the
result, for instance modulo another prime.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence

from flint import fmpq, fmpz, fmpz_mat

_MAX_LATTICE_RESIDUES = 7  # residues in one lattice: heights up to m^(7/8) for the modulus m; Wang's bound is m^(1/2)
_SPARE_BITS = 4  # a common denominator must be shorter by this number of bits than one of random residues


def random_prime(rng: random.Random, bits: int = 61) -> int:
    """Draw a random prime with this number of bits (at least 2); the prime depends only on the state of `rng`.

    For 61 bits FLINT computes gcds of polynomials and echelon forms in two thirds of the time that 63 bits take.

    >>> random_prime(random.Random(1)).bit_length()
    61
    """
    while True:
        candidate = rng.getrandbits(bits) | (1 << (bits - 1)) | (bits > 2)
        if fmpz(candidate).is_prime():
            return candidate


def rational_reconstruction(residue: int, modulus: int) -> fmpq | None:
    """Return the fraction n/d = residue modulo `modulus` with |n| and d at most sqrt((modulus - 1)/2), or None.

    At most one such fraction exists. The result is exact; `modulus` is at least 2 and need not be prime.

    >>> rational_reconstruction(pow(3, -1, 101) * 2, 101)
    2/3
    >>> rational_reconstruction(12, 101) is None
    True
    """
    bound = int(fmpz((modulus - 1) // 2).isqrt())
    previous, remainder = (modulus, 0), (residue % modulus, 1)
    while remainder[0] > bound:
        quotient = previous[0] // remainder[0]
        previous, remainder = (
            remainder,
            (previous[0] - quotient * remainder[0], previous[1] - quotient * remainder[1]),
        )
    n, d = remainder
    if d == 0 or abs(d) > bound or fmpz(n).gcd(fmpz(d)) != 1:
        return None
    return fmpq(n, d)


def simple_fraction(residue: int, modulus: int, spare_bits: int) -> fmpq | None:
    """Return the fraction n/d with this residue and the least |n| d; None unless |n| d < modulus / 2^spare_bits.

    A random residue has such a fraction with probability about 2^-spare_bits times the number of bits of the modulus.
    Trap: the modulus must be random too; modulo a number near a power of 10, a simple fraction may have the residue of
    a simpler one. The numerator may be much longer than the denominator, or much shorter. The result is exact.

    >>> m = (2**61 - 1) * (2**63 - 25)
    >>> simple_fraction(10**20 * pow(7, -1, m), m, 40), simple_fraction(3**84, m, 40)
    (100000000000000000000/7, None)
    """
    previous, remainder = (modulus, 0), (residue % modulus, 1)
    simplest_pair = remainder
    while remainder[0] * abs(remainder[1]):
        simplest_pair = min(simplest_pair, remainder, key=lambda pair: pair[0] * abs(pair[1]))
        quotient = previous[0] // remainder[0]
        previous, remainder = (
            remainder,
            (previous[0] - quotient * remainder[0], previous[1] - quotient * remainder[1]),
        )
    n, d = simplest_pair
    return fmpq(n, d) if n * abs(d) < modulus >> spare_bits else None


def rational_vector(residues: Sequence[int], modulus: int) -> tuple[fmpq, ...] | None:
    """Return the simplest fractions with these residues, computed together; None if a residue has no simple one.

    k fractions with a common denominator are also found if their heights are larger than sqrt(modulus), up to
    about modulus^(k/(k+1)), as a short vector of a lattice (LLL). The result is a guess that must be checked.

    >>> m = 2**61 - 1
    >>> numbers = [fmpq(n, 10**10 + 19) for n in (10**10, -3141592653)]
    >>> residues = [int(x.p) * pow(int(x.q), -1, m) % m for x in numbers]
    >>> rational_vector(residues, m) == tuple(numbers), rational_reconstruction(residues[0], m) == numbers[0]
    (True, False)
    """
    nontrivial_indices = [i for i, residue in enumerate(residues) if residue not in (0, 1, modulus - 1)]
    step = -(-len(nontrivial_indices) // _MAX_LATTICE_RESIDUES) or 1
    sample = [residues[i] for i in nontrivial_indices[::step]]
    denominator, bound, k = 1, int(fmpz((modulus - 1) // 2).isqrt()), len(sample)
    if k > 1:
        # Find q > 0 such that q r modulo `modulus` is small for each residue r, smaller than for random residues.
        rows = [[1, *sample], *([0] + [modulus if i == j else 0 for i in range(k)] for j in range(k))]
        shortest = min(fmpz_mat(rows).lll().tolist(), key=lambda row: max(abs(entry) for entry in row))
        size, q = max(abs(int(entry)) for entry in shortest), abs(int(shortest[0]))
        if q and size ** (k + 1) << (_SPARE_BITS * (k + 1)) <= modulus**k:
            denominator, bound = q, int(fmpz(modulus**k).root(k + 1)) >> _SPARE_BITS
    fractions = []
    for residue in residues:
        n = residue * denominator % modulus
        n = n - modulus if n > modulus // 2 else n
        if abs(n) > bound:
            fraction = rational_reconstruction(n, modulus)
            if fraction is None:
                return None
            denominator *= int(fraction.q)  # probably a factor of the remaining denominators as well
            fractions.append(fraction / (denominator // int(fraction.q)))
        else:
            fractions.append(fmpq(n, denominator))
    return tuple(fractions)


def chinese(old: Sequence[int], modulus: int, new: Sequence[int], prime: int) -> list[int]:
    """Return the residues modulo `modulus * prime` that are `old` modulo `modulus` and `new` modulo `prime`.

    >>> chinese([1, 2], 3, [4, 0], 5)
    [4, 5]
    """
    inverse = pow(modulus, -1, prime)
    return [x + modulus * ((y - x) * inverse % prime) for x, y in zip(old, new, strict=True)]


def from_residues(
    modulo: Callable[[int], Sequence[Sequence[int]] | None], max_primes: int
) -> list[tuple[fmpq, ...]] | None:
    """Return the simplest fractions with the residues `modulo(prime)`, found with some primes, tested with another.

    `modulo` returns lists of residues; the fractions for one list probably share a denominator. The result is None if
    `modulo` returns None, or if `max_primes` primes do not suffice. Every call uses the same primes: since the result
    is checked, an unsuitable prime costs only time.

    >>> numbers = (fmpq(355, 113), fmpq(-7, 3**40))
    >>> from_residues(lambda p: [[int(x.p % p) * pow(int(x.q), -1, p) % p] for x in numbers], 5)
    [(355/113,), (-7/12157665459056928801,)]
    """
    rng = random.Random(0)
    residues, modulus, candidates, next_count = list[list[int]](), 1, list[tuple[fmpq, ...]](), 2
    for count in range(1, max_primes + 1):
        prime = random_prime(rng)
        new_residues = modulo(prime)
        if new_residues is None:
            return None
        if candidates and all(
            (x.p - r * x.q) % prime == 0
            for fractions, group in zip(candidates, new_residues, strict=True)
            for x, r in zip(fractions, group, strict=True)
        ):
            return candidates
        residues = [
            chinese(group_residues, modulus, group, prime)
            for group_residues, group in zip(residues or new_residues, new_residues, strict=True)
        ]
        modulus *= prime
        candidates = []
        if count >= next_count:  # not after each prime, since a guess takes longer than a call of `modulo`
            for group in residues:
                fractions = rational_vector(group, modulus)
                if fractions is None:
                    candidates = []
                    break
                candidates.append(fractions)
            next_count = count + 1 + count // 6
    return None
