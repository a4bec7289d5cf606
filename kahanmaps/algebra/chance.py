"""Random seeds that depend on the claim: random choices are drawn from a hash of the claim and the user's seed.

If the points and primes depended on a seed only, anyone could compute them in advance and write a false claim that
passes at all of them. Primality tests with fixed bases have this weakness (albrecht-2018). If the claim is hashed as
well, the points are known only once the claim is written, and any change of the claim changes them (fiat-shamir-1987).
The error bounds assume that the hash is a random function (bellare-rogaway-1993; limits of this assumption:
canetti-2004). docs/mathematics.md explains what an error bound then means.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly, fmpz

from kahanmaps.algebra.fields import PrimeField
from kahanmaps.algebra.polynomials import RationalFunction

PRIME_BITS = 62  # random primes are at least 2^62 and below 2^63


def derive_seed(seed: int, *data: Any) -> int:
    """Derive a seed of 256 bits from the user's seed and the claim that a random test examines.

    Args:
        seed: the seed that the user chose.
        data: what determines the claim: text, integers, fmpq, None, fmpq_mpoly, RationalFunction, fmpq_mat,
            lists of these.

    Returns:
        An integer, the SHA-256 hash of the seed and the data.

    Raises:
        TypeError: for data of another type, whose text might not determine the value.

    Source: fiat-shamir-1987.

    >>> derive_seed(0, "x*y") == derive_seed(0, "x*y"), derive_seed(0, "x*y") == derive_seed(1, "x*y")
    (True, False)
    >>> derive_seed(0, ["x", "y"]) == derive_seed(0, ["xy"])
    False
    """
    from hashlib import sha256  # imported here, since loading takes milliseconds and a single orbit needs no hash

    return int.from_bytes(sha256(_encode((seed, *data)).encode()).digest(), "big")


def _encode(value: Any) -> str:
    """Return text that differs for different values: each entry of a list is preceded by the length of its text."""
    if isinstance(value, int):
        value = fmpz(value)  # str() of a Python int is limited to 4300 digits
    if value is None or isinstance(value, str | fmpz | fmpq):
        text = f"{type(value).__name__} {value}"
    elif isinstance(value, fmpq_mpoly):
        text = f"{' '.join(value.context().names())}: {value}"
    elif isinstance(value, RationalFunction):
        text = _encode((value.numerator, value.denominator))
    elif isinstance(value, fmpq_mat):
        text = f"{value.nrows()} {value.ncols()} {value.entries()}"
    elif isinstance(value, Sequence):
        text = "".join(_encode(entry) for entry in value)
    else:
        raise TypeError(f"found a {type(value).__name__}, expected text, numbers, polynomials, matrices or sequences")
    return f"{len(text)} {text}"


def random_prime_field(rng: random.Random) -> PrimeField:
    """Return GF(p) for a prime p drawn uniformly from [2^62, 2^63): for larger p, `PrimeField` is slower."""
    while True:
        candidate = rng.getrandbits(PRIME_BITS) | (1 << PRIME_BITS)
        if candidate % 2 and fmpz(candidate).is_prime():
            return PrimeField(candidate)
