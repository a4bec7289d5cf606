"""Somos sequences: t(n + 2) t(n - 2) = alpha t(n + 1) t(n - 1) + beta t(n)^2.

On an elliptic curve with a point T, sigma functions of Q + n T are such a sequence, and those of n T the elliptic
divisibility sequence W with the same alpha and beta (ward-1948, hone-2005). The sections of a line bundle at a point
that is moved by T are forms in their terms.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Any

from flint import fmpq, fmpz

from kahanmaps.algebra.integers import divide_exactly, split_by_primes

_DIRECT = 8  # up to here quotients of s(n) are found from s(n) itself, then from those at n/2


def first_terms(H: Any, y: Any, z: Any) -> tuple[list[Any], list[Any]]:
    """W(1) to W(4) and U(1) to U(4) over any field, in the scales where W(2) = H, W(3) = H^3 and U(1) = U(2) = 1.

    y and z are H U(n)^2/(U(n + 1) U(n - 1)) for n = 2 and 3. Raises ZeroDivisionError.
    """
    one = H / H
    a = H / y
    U = [one, one, a, a * a * H / z]
    while len(U) < 6:
        U.append(_next(U[-4:], H))
    # U(n + 3) U(n - 2) W(2) W(1) = W(3) W(2) U(n + 2) U(n - 1) - W(4) W(1) U(n + 1) U(n), for n = 3
    return [one, H, H**3, H * (H**3 * U[4] * U[1] - U[5] * U[0]) / (U[3] * U[2])], U[:4]


def around(first: Sequence[Any], most: int, multiples: Sequence[Any] = ()) -> dict[int, Any]:
    """The terms -most to most of W or, with the first terms of W, of another sequence. Raises ZeroDivisionError."""
    terms = list(first)
    while len(terms) < most:
        terms.append(_next(terms[-4:], (multiples or first)[1]))
    found = dict(enumerate(terms, start=1))
    if not multiples:
        return found | {-n: -term for n, term in found.items()} | {0: 0 * first[0]}
    before = list(first)[::-1]  # the recurrence is the same backwards
    while len(before) < most + 5:
        before.append(_next(before[-4:], multiples[1]))
    return found | {4 - k: term for k, term in enumerate(before)}


def _next(terms: Sequence[Any], H: Any) -> Any:
    """The term after four."""
    before, a, b, c = terms
    return (H**2 * c * a - H**3 * b * b) / before


class Integers:
    """Rational terms as integers prime to the primes of `power`, each times a rational scale."""

    def __init__(self, power: fmpz) -> None:
        self.power = power

    def split(self, value: fmpq) -> tuple[fmpz, fmpq]:
        """Integer and scale of a value, not zero, that is integral but for the primes. Raises ArithmeticError."""
        if split_by_primes(value.q, self.power)[0] != 1:
            raise ArithmeticError("a term has a denominator outside the set of primes")
        integer, part = split_by_primes(value.p, self.power)
        return integer, fmpq(part, value.q)

    def divisor(self, value: fmpz) -> fmpz:
        """What `difference` takes for a division by this integer."""
        return value

    def difference(self, s: fmpq, left: fmpz, t: fmpq, right: fmpz, divisor: fmpz | None = None) -> tuple[fmpz, fmpq]:
        """Integer and scale of s left - t right, over the divisor, which divides it but for the primes."""
        below = s.q.lcm(t.q)
        total = s.p * (below // s.q) * left - t.p * (below // t.q) * right
        if divisor is not None:
            total = divide_exactly([total], divisor)[0]
        value, part = split_by_primes(total, self.power)
        return value, fmpq(part, below)


class Terms:
    """W or another sequence U without the primes of a set: t(n) = s(n) w(n), w(n) integers prime to them, s(n) scales.

    Outside a finite set of primes terms have no factors but those that the theory gives them: w(n) is as short as it
    can be. The terms near n are found from those near n/2, of both sequences, with products and divisions by w(1), w(2)
    alone:

        t(i + j) t(i - j) = t(i + 1) t(i - 1) W(j)^2 - t(i)^2 W(j + 1) W(j - 1),      i - j = 1 or 2.

    Of s(n), which would make terms longer, quotients are known that stay short: `part(n)` is s(n + 1) s(n - 1)/s(n)^2,
    and with the s of W, denoted by S, `ratio(n)` is S(n - 1) s(n + 1)/(S(n) s(n)).

    `numbers` (Integers, or what does the same over a number field) splits terms. With a number `gamma` all terms whose
    index 3 divides are without a factor gamma^(1/3): the square above whose index alone 3 divides is multiplied by it.
    """

    def __init__(self, first: Sequence[Any], numbers: Any, multiples: Terms | None = None, gamma: Any = None) -> None:
        """From t(1) to t(4), and W, for all sequences but itself; W(1) = 1, and W(2) a number of the primes."""
        self._W = self if multiples is None else multiples
        self._numbers, self._gamma = numbers, gamma
        self._terms: dict[int, Any] = {}
        self._scales: dict[int, Any] = {}  # s(n)/(s(i) S(j))^2 for n above 4
        self._first: dict[int, Any] = {}  # s(n), as long as it is short
        self._pairs: dict[int, tuple[Any, Any]] = {}
        self._order = deque[int]()  # in which terms were found, but for the first ones
        self._parts: dict[int, Any] = {}
        self._ratios: dict[int, Any] = {}
        for n, term in enumerate(first, start=1):
            if term == 0:
                raise ArithmeticError("one of the first terms is 0")
            self._terms[n], self._first[n] = numbers.split(term)
        # By t(i - j) is divided: by the numbers 1 and W(2) in the scale, otherwise by w, which divides exactly.
        is_by_scale = multiples is None or first[0] == first[1] == 1
        self._low = {
            low: (None, first[low - 1]) if is_by_scale else (numbers.divisor(self._terms[low]), self._first[low])
            for low in (1, 2)
        }

    def integer(self, n: int) -> Any:
        """w(n), for n >= 1."""
        if n not in self._terms:
            if n < 5:
                raise ArithmeticError("a term before the first")
            low = 2 - n % 2
            i, j = (n + low) // 2, (n - low) // 2
            a, b = self.part(i), self._W.part(j)
            if self._gamma is not None and (i % 3 == 0) != (j % 3 == 0):
                a, b = (a * self._gamma, b) if j % 3 == 0 else (a, b * self._gamma)
            (square, outer), (W_square, W_outer) = self.pair(i), self._W.pair(j)
            divisor, scale = self._low[low]
            self._terms[n], part = self._numbers.difference(a, outer * W_square, b, square * W_outer, divisor)
            self._scales[n] = part / scale
            if n > _DIRECT + 1:
                self._order.append(n)
            else:
                known = self._first[i] * self._W._first[j]
                self._first[n] = self._scales[n] * known * known
        return self._terms[n]

    def pair(self, n: int) -> tuple[Any, Any]:
        """w(n)^2 and w(n + 1) w(n - 1), for n >= 2."""
        if n not in self._pairs:
            here = self.integer(n)
            self._pairs[n] = here * here, self.integer(n + 1) * self.integer(n - 1)
        return self._pairs[n]

    def part(self, n: int) -> Any:
        """s(n + 1) s(n - 1)/s(n)^2, for n >= 2."""
        if n not in self._parts:
            before, here, ahead = (self._scale(k, n <= _DIRECT) for k in (n - 1, n, n + 1))
            found = ahead * before / (here * here)
            if n > _DIRECT:
                k = n // 2
                root = self.ratio(k + 1) * self._W.part(k) if n % 2 else 1 / self.ratio(k)
                found = found * root * root
            self._parts[n] = found
        return self._parts[n]

    def ratio(self, n: int) -> Any:
        """S(n - 1) s(n + 1)/(S(n) s(n)), for n >= 2."""
        if self is self._W:
            return self.part(n)
        if n not in self._ratios:
            W = self._W
            is_first = n <= _DIRECT
            found = W._scale(n - 1, is_first) * self._scale(n + 1, is_first)
            found = found / (W._scale(n, is_first) * self._scale(n, is_first))
            if n > _DIRECT:
                k = n // 2
                root = self.ratio(k + 1) * W.part(k) if n % 2 else 1 / W.part(k)
                found = found * root * root
            self._ratios[n] = found
        return self._ratios[n]

    def forget(self, n: int) -> None:
        """Keep what is long and needed for terms near 2 n + 8 and later ones alone, from n on, beside the first terms.

        Products of numbers above are made again when the time comes, in a fifth of the time that they took.
        """
        while self._order and self._order[0] < n:
            self._terms.pop(self._order.popleft(), None)
        for k in [k for k in self._pairs if not (n <= k <= n + 12 or k >= 2 * n + 7)]:
            del self._pairs[k]

    def _scale(self, n: int, is_first: bool) -> Any:
        table = self._first if is_first else self._scales
        if n not in table:
            self.integer(n)
        return table[n]
