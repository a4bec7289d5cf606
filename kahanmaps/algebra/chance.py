"""Random seeds that depend on the claim: random choices are drawn from a hash of the claim and the user's seed.

If only a seed is hashed, anyone knows the primes and points in advance and can write a false claim that passes at all
of them, as for primality tests with fixed bases (albrecht-2018). If the claim is hashed as well, the points are known
only once the claim is written, and change with each of its characters (fiat-shamir-1987). docs/mathematics.md explains
what an error bound then means: the hash is modeled as a random function (bellare-rogaway-1993), an assumption
(canetti-2004).
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
    """Derive a seed of 256 bits from the user's seed and the `subject` of a random test.

    Args:
        seed: the seed that the user chose.
        subject: data that determine the claim: text, integers, fmpq, None, fmpq_mpoly, RationalFunction, fmpq_mat,
            lists of these.

    Returns:
        An integer, the SHA-256 hash of the seed and the subject.

    Raises:
        TypeError: for data of another type, whose text might not determine the value.

    Source: fiat-shamir-1987.

    >>> derive_seed(0, "x*y") == derive_seed(0, "x*y"), derive_seed(0, "x*y") == derive_seed(1, "x*y")
    (True, False)
    >>> derive_seed(0, ["x", "y"]) == derive_seed(0, ["xy"])
    False
    """
    from hashlib import sha256  # imported here, since loading takes milliseconds and a single orbit needs no hash

    return int.from_bytes(sha256(_encode((seed, *subject)).encode()).digest(), "big")


def _encode(part: Any) -> str:
    """Return text that differs for different data; each part starts with its length, so that parts cannot merge."""
    if isinstance(part, int):
        part = fmpz(part)  # str() of a Python int is limited to 4300 digits
    if part is None or isinstance(part, str | fmpz | fmpq):
        text = f"{type(part).__name__} {part}"
    elif isinstance(part, fmpq_mpoly):
        text = f"{' '.join(part.context().names())}: {part}"
    elif isinstance(part, RationalFunction):
        text = _encode((part.numerator, part.denominator))
    elif isinstance(part, fmpq_mat):
        text = f"{part.nrows()} {part.ncols()} {part.entries()}"
    elif isinstance(part, Sequence):
        text = "".join(_encode(piece) for piece in part)
    else:
        raise TypeError(f"found a {type(part).__name__}, expected text, numbers, polynomials, matrices or sequences")
    return f"{len(text)} {text}"


def random_prime_field(rng: random.Random) -> PrimeField:
    """Return GF(p) for a prime p drawn uniformly from [2^62, 2^63), the largest primes that fit into FLINT's nmod."""
    while True:
        candidate = rng.getrandbits(PRIME_BITS) | (1 << PRIME_BITS)
        if candidate % 2 and fmpz(candidate).is_prime():
            return PrimeField(candidate)
