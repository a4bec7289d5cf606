"""Chance that follows the question: what is drawn comes from a hash of what is asked together with the seed.

A seed alone is public, and whoever knows the primes and points in advance can write a false claim that passes at all of
them, as with tests of primality at fixed bases (albrecht-2018). Hashed with the claim they are known only once it is
written, and change with every letter of it (fiat-shamir-1987). docs/mathematics.md says what an error bound then means:
the hash stands for a random function (bellare-rogaway-1993), which is an assumption (canetti-2004).
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly, fmpz

from kahanmaps.algebra.fields import PrimeField
from kahanmaps.algebra.polynomials import RationalFunction

PRIME_BITS = 62


def derive_seed(seed: int, *subject: Any) -> int:
    """A seed of 256 bits for whatever is drawn about `subject`: the same for the same seed and subject.

    Args:
        seed: the one that the user chose.
        subject: all that determines what is asked: text, integers, fmpq, None, polynomials and rational functions in
            fmpq_mpoly, fmpq_mat, and sequences of these.

    Returns:
        An integer, SHA-256 of all of this.

    Raises:
        TypeError: for a part of another kind, whose text might leave something out.

    Source: fiat-shamir-1987.

    >>> derive_seed(0, "x*y") == derive_seed(0, "x*y"), derive_seed(0, "x*y") == derive_seed(1, "x*y")
    (True, False)
    >>> derive_seed(0, ["x", "y"]) == derive_seed(0, ["xy"])
    False
    """
    from hashlib import sha256  # its library takes milliseconds to load, which a single orbit can do without

    return int.from_bytes(sha256(_written((seed, *subject)).encode()).digest(), "big")


def _written(part: Any) -> str:
    """Text that differs for different parts; its length stands in front of each piece, so that pieces cannot merge."""
    if isinstance(part, int):
        part = fmpz(part)  # whose text may be of any length
    if part is None or isinstance(part, str | fmpz | fmpq):
        text = f"{type(part).__name__} {part}"
    elif isinstance(part, fmpq_mpoly):
        text = f"{' '.join(part.context().names())}: {part}"
    elif isinstance(part, RationalFunction):
        text = _written((part.numerator, part.denominator))
    elif isinstance(part, fmpq_mat):
        text = f"{part.nrows()} {part.ncols()} {part.entries()}"
    elif isinstance(part, Sequence):
        text = "".join(_written(piece) for piece in part)
    else:
        raise TypeError(f"found a {type(part).__name__}, expected text, numbers, polynomials, matrices or sequences")
    return f"{len(text)} {text}"


def random_prime_field(rng: random.Random) -> PrimeField:
    """GF(p) for a prime drawn uniformly from [2^62, 2^63), which is where nmod still holds it."""
    while True:
        candidate = rng.getrandbits(PRIME_BITS) | (1 << PRIME_BITS)
        if candidate % 2 and fmpz(candidate).is_prime():
            return PrimeField(candidate)
