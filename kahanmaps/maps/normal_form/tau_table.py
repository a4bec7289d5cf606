"""psi_n and chi_n over Q for any n, from those near n/2: the table behind exact steps and behind the n-th iterate.

A value phi_n is kept as an integer prime to the bad primes times a scale s_n that is never formed (see `tau`). With k
= n // 2 the bilinear relation for psi_{2k}, psi_{2k+1} takes (a, b) = (k+1, k-1), (k+1, k), and for chi_n it takes
(a, b) = (k, n-k); the left sides are then phi_n psi_2, phi_n, or phi_n chi_0 and phi_n chi_{-1}, so that nothing is
divided by but constants. Each new value is a difference of two products of four factors a quarter of its length. Let
rho_n be what a new value is to be multiplied by, so that s_n = s_a^2 s_b^2 rho_n; then

    t_{2k} = rho_{2k+1} rho_{2k-1} / (t_k rho_{2k})^2,     t_{2k+1} = (t_k t_{k+1})^2 rho_{2k+2} rho_{2k} /
    rho_{2k+1}^2      for psi

with t_n = s_{n+1} s_{n-1} / s_n^2, and similar formulas give t_n for chi and r_n = (s_n / s_{n-1} of psi) / (that of
chi). All these are small rational numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import islice
from types import MappingProxyType
from typing import Any

from kahanmaps.maps.normal_form.planar_block import Triple
from kahanmaps.maps.normal_form.tau import TauStart, start_near

_FIRST = 4  # below it psi_{n-2} would be zero
_SHARED = 8  # so many points are taken from one table, which holds some ten times the digits of a point then


def triples(block: Any) -> Iterator[Triple]:
    """P_0, P_1, ... as `IntegerBlock.triples` gives them, up to signs, three times as fast.

    What the table has to remember is less than the points between n/2 and n themselves.
    """
    start = _start(block)
    if start is None:
        yield from block.triples()
        return
    yield from islice(block.triples(), start.base + _FIRST)
    yield from TauTable(start).points()


def iterate(block: Any, n: int) -> Triple | None:
    """P_n, primitive, up to sign, for n >= 0; None where the table does not apply, so that one has to step.

    That is where the cubic is singular, T has small order, or n is small. Poles on the way are passed over.
    """
    if block.is_constant:
        at_rest: Triple = block.start
        return at_rest
    table = _table(block)
    if table is None or n - table.base < _FIRST:
        return None
    found: Triple = table.point(n - table.base)
    return found


def most_bits(block: Any, n: int) -> int | None:
    """A number of bits that no entry of P_n over Q has more of, from what P_n is made of; None as for `iterate`."""
    table = None if block.is_constant else _table(block)
    return None if table is None or n - table.base < _FIRST else table.most_bits(n - table.base)


def _table(block: Any) -> TauTable | None:
    if block.table is None or block.table.points_taken >= _SHARED:
        start = _start(block)
        block.table = None if start is None else TauTable(start)
    table: TauTable | None = block.table
    return table


def _start(block: Any) -> TauStart | None:
    if block.is_constant or block.level is None or block.is_degenerate:
        return None
    return start_near(block)


def _second_ratio(rho: Callable[[int], Any], n: int) -> Any:
    """rho_{n+1} rho_{n-1} / rho_n^2."""
    middle = rho(n)
    return rho(n + 1) * rho(n - 1) / (middle * middle)


class _Table(dict[int, Any]):
    """Values by index, each worked out by a rule when it is first asked for."""

    def __init__(self, rule: Callable[[int], Any], known: Mapping[int, Any] = MappingProxyType({})) -> None:
        super().__init__(known)
        self._rule = rule

    def __missing__(self, n: int) -> Any:
        found = self[n] = self._rule(n)
        return found


class TauTable:
    """psi_n and chi_n, n >= 1, and the points P_n, n >= 4, relative to the base point of a start; all as needed.

    Values of psi and chi are over their scales; `_psi_rho` and the like hold the small rational numbers of the
    module's head: t_n = s_{n+1} s_{n-1} / s_n^2, and r_n = (s_n / s_{n-1} of psi) / (that of chi).
    """

    def __init__(self, start: TauStart) -> None:
        self._start, self._gamma = start, start.gamma
        self.base, self.points_taken = start.base, 0
        self._one = start.gamma * 0 + 1
        psi, chi = start.psi, start.chi
        s = {n: psi.scale(n) for n in range(1, 5)}
        c = {n: chi.scale(n) for n in range(-1, 3)}
        self.psi = _Table(self._new_psi, {n: psi[n] for n in range(1, 5)})
        self.chi = _Table(self._new_chi, {n: chi[n] for n in range(-1, 3)})
        self._psi_rho = {3: s[3] / s[2] ** 2, 4: s[4] / s[3] ** 2}
        self._chi_rho = {1: c[1] / c[0] ** 2, 2: c[2] / c[1] ** 2}
        self.psi_t = _Table(self._new_psi_t, {2: psi.t(2), 3: psi.t(3)})
        self.chi_t = _Table(self._new_chi_t, {n: chi.t(n) for n in (0, 1)})
        self._r = _Table(self._new_r, {2: s[2] / s[1] * c[1] / c[2]})
        # (s_{n+1} / s_n of psi) / (s_n / s_{n-1} of chi)
        self._r_next = _Table(lambda n: self._r[n] * self.psi_t[n], {1: s[2] / s[1] * c[0] / c[1]})
        self._divisors = tuple(start.numbers.divisor(chi[n]) for n in (0, -1))
        self._divisor_scales = (c[0], c[-1])
        self._psi_square = _Table(lambda n: self.psi[n] * self.psi[n])
        self._psi_around = _Table(lambda n: self.psi[n + 1] * self.psi[n - 1])
        self._chi_square = _Table(lambda n: self.chi[n] * self.chi[n])
        self._chi_around = _Table(lambda n: self.chi[n + 1] * self.chi[n - 1])

    def points(self) -> Iterator[Triple]:
        """P_4, P_5, ..., primitive, as long as the map has a value."""
        n, before = _FIRST, self.psi[_FIRST - 1] * self.psi[_FIRST]
        while True:
            after = self.psi[n] * self.psi[n + 1]
            chi = [self.chi[n - 1], self.chi[n], self.chi[n + 1]]
            point = self._start.point(chi, [self._psi_around[n], after, before], self._r[n], self._r[n + 1])
            if point[2] == 0:
                return
            yield point
            n, before = n + 1, after
            for products in (self._psi_square, self._psi_around, self._chi_square, self._chi_around):
                products.pop(n // 2 - 4, None)
            self.psi.pop(n // 2 - 6, None)
            self.chi.pop(n // 2 - 6, None)

    def point(self, n: int) -> Triple:
        """P_n for n >= 4, primitive."""
        self.points_taken += 1
        before, here, after = self.psi[n - 1], self.psi[n], self.psi[n + 1]
        chi = [self.chi[n - 1], self.chi[n], self.chi[n + 1]]
        return self._start.point(chi, [before * after, here * after, before * here], self._r[n], self._r[n + 1])

    def most_bits(self, n: int) -> int:
        """What the terms of P_n may have at most, over Q."""
        psi, chi = ([table[k].bit_length() for k in (n - 1, n, n + 1)] for table in (self.psi, self.chi))
        scales = sum(scale.p.bit_length() + scale.q.bit_length() for scale in (self._r[n], self._r[n + 1]))
        terms = max(sum(psi) - one + other for one, other in zip(psi, chi, strict=True))
        return int(terms + scales + self._start.lift_bits + 2)

    def _new_psi(self, n: int) -> Any:
        k = n // 2
        a, b = (k + 1, k) if n % 2 else (k + 1, k - 1)
        left = self._psi_around[a] * self._psi_square[b]
        right = self._psi_around[b] * self._psi_square[a] if b > 1 else left * 0  # psi_0 = 0
        value, part = self._difference(self.psi_t[a], left, self.psi_t[b] if b > 1 else self._one, right, a, b)
        self._psi_rho[n] = part if n % 2 else part / 2
        return value

    def _new_chi(self, n: int) -> Any:
        a = n // 2
        b = n - a
        left, right = self._chi_around[a] * self._psi_square[b], self._psi_around[b] * self._chi_square[a]
        value, part = self._difference(self.chi_t[a], left, self.psi_t[b], right, a, b, self._divisors[b - a])
        self._chi_rho[n] = part / self._divisor_scales[b - a]
        return value

    def _difference(
        self, t_a: Any, left: Any, t_b: Any, right: Any, a: int, b: int, divisor: Any = None
    ) -> tuple[Any, Any]:
        """t_a left - t_b right, the square whose index alone is divisible by 3 times gamma; value and scale."""
        if (a % 3 == 0) != (b % 3 == 0):
            t_a, t_b = (t_a * self._gamma, t_b) if b % 3 == 0 else (t_a, t_b * self._gamma)
        found: tuple[Any, Any] = self._start.numbers.difference(t_a, left, t_b, right, divisor)
        return found

    def _new_psi_t(self, n: int) -> Any:
        k = n // 2
        root = self.psi_t[k] * self.psi_t[k + 1] if n % 2 else 1 / self.psi_t[k]
        return root * root * _second_ratio(self._rho_of_psi, n)

    def _new_chi_t(self, n: int) -> Any:
        k = n // 2
        root = 1 / self._r[k + 1] if n % 2 else self._r_next[k]
        return root * root * _second_ratio(self._rho_of_chi, n)

    def _new_r(self, n: int) -> Any:
        if n == 3:
            return self._r[2] * self.psi_t[2] / self.chi_t[2]
        k = n // 2
        root = 1 / self.psi_t[k] if n % 2 else self._r_next[k]
        of_psi = self._rho_of_psi(n) / self._rho_of_psi(n - 1)
        return root * root * of_psi * self._rho_of_chi(n - 1) / self._rho_of_chi(n)

    def _rho_of_psi(self, n: int) -> Any:
        if n not in self._psi_rho:
            _ = self.psi[n]
        return self._psi_rho[n]

    def _rho_of_chi(self, n: int) -> Any:
        if n not in self._chi_rho:
            _ = self.chi[n]
        return self._chi_rho[n]
