"""Somos sequences: t(n + 2) t(n - 2) = alpha t(n + 1) t(n - 1) + beta t(n)^2.

On an elliptic curve with a point T, sigma functions of Q + n T are such a sequence, and those of n T the elliptic
divisibility sequence W with the same alpha and beta (ward-1948, hone-2005). The sections of a line bundle at a point
that is moved by T are forms in their terms.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flint import fmpq, fmpz


def extended(first: Sequence[Any], alpha: Any, beta: Any, length: int) -> list[Any]:
    """So many terms of the sequence with these first four, over any field. Raises ZeroDivisionError."""
    terms = list(first)
    while len(terms) < length:
        before, a, b, c = terms[-4:]
        terms.append((alpha * c * a + beta * b * b) / before)
    return terms


def divisibility(others: Sequence[Any], H: Any) -> list[Any]:
    """W(1) to W(4) from six terms in a row of another sequence, in the scale where W(2) = H and W(3) = H^3.

    Then alpha = W(2)^2 and beta = -W(1) W(3). The fourth is found from t(m + 3) t(m - 2) W(2) W(1) = W(3) W(2) t(m + 2)
    t(m - 1) - W(4) W(1) t(m + 1) t(m). Raises ZeroDivisionError.
    """
    a, b, c, d, e, f = others
    return [H / H, H, H**3, H * (H**3 * e * b - f * a) / (d * c)]


class Somos:
    """A sequence over Q without the primes that divide `primes`: t(n) = s(n) w(n) with integers w(n) prime to that.

    Outside a finite set of primes terms have no factors but those that the theory gives them: w(n) is as short as it
    can be. Of s(n), which would make terms longer, what changes slowly is kept: q(n) = s(n + 1) s(n - 1)/s(n)^2.

    `window` has w(n - 1) to w(n + 2), `parts` has q(n) and q(n + 1); `square` and `outer` are w(n)^2 and
    w(n + 1) w(n - 1).
    """

    def __init__(self, first: Sequence[fmpq], alpha: fmpq, beta: fmpq, primes: fmpz) -> None:
        """From t(n - 1) to t(n + 2), none of them 0."""
        self._alpha, self._beta, self._primes = alpha, beta, primes
        split = [(*without(term.p, primes), *without(term.q, primes)) for term in first]
        if any(below != 1 for _, _, below, _ in split):
            raise ArithmeticError("the first terms have denominators outside the set of primes")
        self.window = [above for above, *_ in split]
        self.scales = s = [fmpq(part, below) for _, part, _, below in split]  # s(n - 1) to s(n + 2), at the beginning
        self.parts = [s[k + 1] * s[k - 1] / (s[k] * s[k]) for k in (1, 2)]
        before, here, ahead, _ = self.window
        self.square, self.outer = here * here, ahead * before

    def advance(self) -> None:
        """n + 1 for n. Raises ArithmeticError where a term is 0, or has a denominator that it should not have."""
        before, here, ahead, last = self.window
        q, r = self.parts
        self.square, self.outer = ahead * ahead, last * here
        a, b = self._alpha * r, self._beta
        below = a.q.lcm(b.q)
        total = a.p * (below // a.q) * self.outer + b.p * (below // b.q) * self.square
        value, rest = divmod(total, before)
        if rest != 0 or value == 0:
            raise ArithmeticError("a Somos sequence ends, or has a prime that it should not have")
        new, part = without(value, self._primes)
        self.window = [here, ahead, last, new]
        self.parts = [r, fmpq(part, below) / (r * r * q)]


def without(value: fmpz, primes: fmpz) -> tuple[fmpz, fmpz]:
    """An integer that is not 0 without the primes that divide the other, and what has been taken away, positive."""
    taken = fmpz(1)
    common = primes.gcd(value % primes)
    while common != 1:
        value, taken = value // common, taken * common
        common = common.gcd(value % common)
    return value, taken
