"""Somos sequences: t(n + 2) t(n - 2) = alpha t(n + 1) t(n - 1) + beta t(n)^2.

On an elliptic curve with a point T, the values of the sigma function at Q + n T form such a sequence, and its values at
n T form the elliptic divisibility sequence W, with the same alpha and beta (ward-1948, hone-2005). The sections of a
line bundle at the points Q + n T are forms in the terms of both sequences.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Any

from flint import fmpq, fmpz

from kahanmaps.algebra.integers import divide_exactly, split_by_primes

_MAX_DIRECT_INDEX = 8  # up to this n, quotients of s(n) are computed from s(n); for larger n, from quotients at n/2


def first_terms(H: Any, y: Any, z: Any) -> tuple[list[Any], list[Any]]:
    """Return the lists of W(1) to W(4) and U(1) to U(4), with W(1) = U(1) = U(2) = 1, W(2) = H and W(3) = H^3.

    U is a sequence at Q + n T: H U(n)^2/(U(n + 1) U(n - 1)) is y for n = 2, z for n = 3. Raises ZeroDivisionError.
    """
    one = H / H
    a = H / y
    U = [one, one, a, a * a * H / z]
    while len(U) < 6:
        U.append(_next_term(U[-4:], H))
    # W(4) from U(n + 3) U(n - 2) W(2) W(1) = W(3) W(2) U(n + 2) U(n - 1) - W(4) W(1) U(n + 1) U(n), for n = 3
    return [one, H, H**3, H * (H**3 * U[4] * U[1] - U[5] * U[0]) / (U[3] * U[2])], U[:4]


def around(first: Sequence[Any], bound: int, multiples: Sequence[Any] = ()) -> dict[int, Any]:
    """Return {n: W(n)} for -bound <= n <= bound, or {n: U(n)} if `multiples` is the list of W(1) to W(4).

    `first` contains the terms with n = 1 to 4. Raises ZeroDivisionError if the recurrence divides by a term that is 0.
    """
    terms = list(first)
    while len(terms) < bound:
        terms.append(_next_term(terms[-4:], (multiples or first)[1]))
    terms_by_index = dict(enumerate(terms, start=1))
    if not multiples:
        return terms_by_index | {-n: -term for n, term in terms_by_index.items()} | {0: 0 * first[0]}
    backward_terms = list(first)[::-1]  # the recurrence is symmetric
    while len(backward_terms) < bound + 5:
        backward_terms.append(_next_term(backward_terms[-4:], multiples[1]))
    return terms_by_index | {4 - k: term for k, term in enumerate(backward_terms)}


def _next_term(terms: Sequence[Any], H: Any) -> Any:
    """Return the term that follows four given terms, for alpha = H^2 and beta = -H^3."""
    previous, a, b, c = terms
    return (H**2 * c * a - H**3 * b * b) / previous


class Integers:
    """Arithmetic of rational terms, each written as an integer coprime to `power` times a rational scale."""

    def __init__(self, power: fmpz) -> None:
        self.power = power

    def split(self, value: fmpq) -> tuple[fmpz, fmpq]:
        """Split a nonzero value as (integer, scale). ArithmeticError if a denominator has primes not in `power`."""
        if split_by_primes(value.q, self.power)[0] != 1:
            raise ArithmeticError("a term has a denominator outside the set of primes")
        integer, bad_part = split_by_primes(value.p, self.power)
        return integer, fmpq(bad_part, value.q)

    def prepared_divisor(self, value: fmpz) -> fmpz:
        """Return the divisor in the form that `difference` needs; here the integer itself."""
        return value

    def difference(self, s: fmpq, first: fmpz, t: fmpq, second: fmpz, divisor: fmpz | None = None) -> tuple[fmpz, fmpq]:
        """Return (integer, scale) for (s first - t second)/divisor, which is integral except at primes of `power`."""
        denominator = s.q.lcm(t.q)
        numerator = s.p * (denominator // s.q) * first - t.p * (denominator // t.q) * second
        if divisor is not None:
            numerator = divide_exactly([numerator], divisor)[0]
        value, scale_numerator = split_by_primes(numerator, self.power)
        return value, fmpq(scale_numerator, denominator)


class Terms:
    """W or a sequence U, with the primes of a finite set split off: t(n) = s(n) w(n), w(n) integers and s(n) scales.

    The integers w(n) are coprime to the primes in the set. At all other primes the terms have no superfluous factors,
    so w(n) is as short as possible. The terms near n are computed from the terms near n/2 of both sequences, with
    divisions by w(1) and w(2) only:

        t(i + j) t(i - j) = t(i + 1) t(i - 1) W(j)^2 - t(i)^2 W(j + 1) W(j - 1),      i - j = 1 or 2.

    The scales s(n) are long, but two quotients of them stay short: `own_quotient(n)` is s(n + 1) s(n - 1)/s(n)^2,
    and `mixed_quotient(n)` is S(n - 1) s(n + 1)/(S(n) s(n)), where S denotes the scales of W.

    `numbers` (Integers, or its equivalent over a number field) splits terms into integer and scale. If `gamma` is
    given, all terms with an index divisible by 3 are stored without a factor gamma^(1/3). In the formula above, a
    square whose index is divisible by 3 is then multiplied by gamma if the index of the other square is not.
    """

    def __init__(self, first: Sequence[Any], numbers: Any, multiples: Terms | None = None, gamma: Any = None) -> None:
        """`first` is t(1), ..., t(4). `multiples` is W, or None if t = W. W(1) = 1; primes of W(2) are in the set."""
        self._W = self if multiples is None else multiples
        self._numbers, self._gamma = numbers, gamma
        self._terms: dict[int, Any] = {}
        self._scales: dict[int, Any] = {}  # s(n)/(s(i) S(j))^2 for n = i + j above 4, with i - j = 1 or 2
        self._short_scales: dict[int, Any] = {}  # s(n) for n up to _MAX_DIRECT_INDEX + 1
        self._pairs: dict[int, tuple[Any, Any]] = {}
        self._computation_order = deque[int]()  # the order in which the terms after the first ones were computed
        self._own_quotients: dict[int, Any] = {}
        self._mixed_quotients: dict[int, Any] = {}
        for n, term in enumerate(first, start=1):
            if term == 0:
                raise ArithmeticError("one of the first terms is 0")
            self._terms[n], self._short_scales[n] = numbers.split(term)
        # Division by t(i - j): for W, and if t(1) = t(2) = 1, only the scale is divided; else w(i - j) divides exactly.
        is_by_scale = multiples is None or first[0] == first[1] == 1
        self._divisor_and_scale = {
            small_index: (None, first[small_index - 1])
            if is_by_scale
            else (numbers.prepared_divisor(self._terms[small_index]), self._short_scales[small_index])
            for small_index in (1, 2)
        }

    def value(self, n: int) -> Any:
        """Return t(n) itself, for n = 1 to 4."""
        return self._short_scales[n] * self._terms[n]

    def integer(self, n: int) -> Any:
        """Return w(n), for n >= 1."""
        if n not in self._terms:
            if n < 5:
                raise ArithmeticError("found an index before the first term")
            small_index = 2 - n % 2
            i, j = (n + small_index) // 2, (n - small_index) // 2
            a, b = self.own_quotient(i), self._W.own_quotient(j)
            if self._gamma is not None and (i % 3 == 0) != (j % 3 == 0):
                a, b = (a * self._gamma, b) if j % 3 == 0 else (a, b * self._gamma)
            (square, neighbour_product), (W_square, W_neighbour_product) = self.pair(i), self._W.pair(j)
            divisor, scale = self._divisor_and_scale[small_index]
            self._terms[n], numerator_scale = self._numbers.difference(
                a, neighbour_product * W_square, b, square * W_neighbour_product, divisor
            )
            self._scales[n] = numerator_scale / scale
            if n > _MAX_DIRECT_INDEX + 1:
                self._computation_order.append(n)
            else:
                scale_product = self._short_scales[i] * self._W._short_scales[j]
                self._short_scales[n] = self._scales[n] * scale_product * scale_product
        return self._terms[n]

    def pair(self, n: int) -> tuple[Any, Any]:
        """Return w(n)^2 and w(n + 1) w(n - 1), for n >= 2."""
        if n not in self._pairs:
            term = self.integer(n)
            self._pairs[n] = term * term, self.integer(n + 1) * self.integer(n - 1)
        return self._pairs[n]

    def own_quotient(self, n: int) -> Any:
        """Return s(n + 1) s(n - 1)/s(n)^2, for n >= 2."""
        if n not in self._own_quotients:
            scale_before, scale_n, scale_after = (self._scale(k, n <= _MAX_DIRECT_INDEX) for k in (n - 1, n, n + 1))
            quotient = scale_after * scale_before / (scale_n * scale_n)
            if n > _MAX_DIRECT_INDEX:
                k = n // 2
                root = self.mixed_quotient(k + 1) * self._W.own_quotient(k) if n % 2 else 1 / self.mixed_quotient(k)
                quotient = quotient * root * root
            self._own_quotients[n] = quotient
        return self._own_quotients[n]

    def mixed_quotient(self, n: int) -> Any:
        """Return S(n - 1) s(n + 1)/(S(n) s(n)), for n >= 2."""
        if self is self._W:
            return self.own_quotient(n)
        if n not in self._mixed_quotients:
            W = self._W
            is_short = n <= _MAX_DIRECT_INDEX
            quotient = W._scale(n - 1, is_short) * self._scale(n + 1, is_short)
            quotient = quotient / (W._scale(n, is_short) * self._scale(n, is_short))
            if n > _MAX_DIRECT_INDEX:
                k = n // 2
                root = self.mixed_quotient(k + 1) * W.own_quotient(k) if n % 2 else 1 / W.own_quotient(k)
                quotient = quotient * root * root
            self._mixed_quotients[n] = quotient
        return self._mixed_quotients[n]

    def forget(self, n: int) -> None:
        """Discard terms with index below n, which the terms near 2 n + 8 and later do not need; the first terms remain.

        Some discarded products are needed again. Recomputing them takes a fifth of the time of the first computation.
        """
        while self._computation_order and self._computation_order[0] < n:
            self._terms.pop(self._computation_order.popleft(), None)
        for k in [k for k in self._pairs if not (n <= k <= n + 12 or k >= 2 * n + 7)]:
            del self._pairs[k]

    def _scale(self, n: int, is_short: bool) -> Any:
        table = self._short_scales if is_short else self._scales
        if n not in table:
            self.integer(n)
        return table[n]
