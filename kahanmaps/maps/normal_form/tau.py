"""Tau functions: points of an orbit in a plane from two Somos sequences, whose terms have a third of the digits.

On the level cubic E the orbit is P_n = P_0 + n T. For lifts of the points to triples that satisfy

    P_{n+1} W_{n-1} = Psi(P_n)                                                     (natural lifts)

the determinants factor: det(P_i, P_j, P_k) = (const) psi_{j-i} psi_{k-i} psi_{k-j} chi_{i+j+k}, with the values psi_n =
sigma(n T) and chi_n = sigma(n T - kappa) of one sigma function; kappa = -3 P_0, where the zero of E is chosen such that
three points on a line have sum 0. So

    P_n  ~  -2 psi_{n-1} psi_{n+1} chi_n P_0 + psi_n psi_{n+1} chi_{n-1} P_1 + psi_{n-1} psi_n chi_{n+1} P_{-1},

and both sequences satisfy bilinear identities (phi is psi or chi; there are no further terms, so no content arises):

    phi_{a+b} phi_{a-b} = phi_{a+1} phi_{a-1} psi_b^2 - psi_{b+1} psi_{b-1} phi_a^2.

psi depends only on delta = disc(h) level^2: psi_1 = 1, psi_2 = 2, psi_3 = 3 gamma^(1/3), psi_4 = 4 with
gamma = 1 - delta. For n divisible by 3, the cube root is factored out. psi and chi are the sequences W and U of
`somos`: a term follows from terms of half its index. Over Q the terms are integers coprime to the bad primes, times
scales that are never computed, since they contain powers of the bad primes with exponents quadratic in n.
docs/mathematics.md has the proofs. Source: ward-1948, for such sequences.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import count, islice
from typing import Any

from kahanmaps.maps.normal_form.planar_block import Triple, determinant
from kahanmaps.maps.somos import Terms

_MAX_BASES = 3  # number of base points that are tried
_MIN_INDEX = 2  # the least n: for smaller n, psi_{n-1} would be 0
_MAX_SHARED_POINTS = 8  # number of points taken from one table, which then holds about ten times the digits of a point


def triples(block: Any) -> Iterator[Triple]:
    """Yield P_0, P_1, ... like `IntegerBlock.triples`, up to signs, but three times as fast.

    After P_n, only the terms of both sequences from the index n/2 - 4 on are stored.
    """
    table = table_near(block)
    if table is None:
        yield from block.triples()
        return
    yield from islice(block.triples(), table.base + _MIN_INDEX)
    yield from table.points()


def iterate(block: Any, n: int) -> Triple | None:
    """Return the primitive triple P_n up to sign, n >= 0; None if the sequences do not apply and steps are needed.

    They do not apply if the cubic is singular, T has small order, or n is small. Poles at earlier steps are ignored.
    """
    if block.is_constant:
        fixed_point: Triple = block.start
        return fixed_point
    if block.table is None or block.table.points_taken >= _MAX_SHARED_POINTS:
        block.table = table_near(block)
    table: TauTable | None = block.table
    if table is None or n - table.base < _MIN_INDEX:
        return None
    table.points_taken += 1
    return table.point(n - table.base)


def table_near(block: Any) -> TauTable | None:
    """Return a table for the first base point among P_0, P_1, P_2 near which no W and no chi is zero; None without one.

    Unless T is a torsion point, chi_n is zero for at most one n. Near a pole there are no natural lifts.
    """
    if block.is_constant or block.level is None or block.is_degenerate:
        return None
    over_field, P0, P1 = block.lifts
    lifts = {0: P0, 1: P1}
    for k in range(1, _MAX_BASES + 2):
        if lifts[k - 1][2] == 0 or lifts[k][2] == 0:
            break
        lifts[k + 1] = _divide(over_field.image(lifts[k]), lifts[k - 1][2])
    if P1[2] != 0:
        lifts[-1] = _divide(over_field.preimage(P0), P1[2])
    for base in range(_MAX_BASES):
        if all(k in lifts and lifts[k][2] != 0 for k in range(base - 1, base + 4)):
            P = {k: lifts[base + k] for k in range(-1, 4)}
            chi = first_chi(P, range(5))
            if all(value != 0 for value in chi.values()):
                return TauTable(block, base, P, chi)
    return None


def _divide(triple: Triple, denominator: Any) -> Triple:
    U, V, W = triple
    return U / denominator, V / denominator, W / denominator


def first_chi(P: Mapping[int, Triple], indices: Iterable[int]) -> dict[int, Any]:
    """Return {n: chi_n} for `indices` between -2 and 4, from natural lifts of the points around P_0."""
    rows = {-2: (-2, -1, 1), -1: (-2, 0, 1), 0: (-1, 0, 1), 1: (-1, 0, 2), 2: (-1, 1, 2), 3: (0, 1, 2), 4: (0, 1, 3)}
    values = {n: determinant(*(P[k] for k in rows[n])) for n in indices}
    return {n: value if n % 3 else 3 * value for n, value in values.items()}


class TauTable:
    """The values psi_n, chi_n and the points P_n, n >= 2, relative to a base point of an orbit in a plane.

    `P` are natural lifts of the points around the base point, `chi` the values chi_0, ..., chi_4.
    """

    def __init__(self, block: Any, base: int, P: Mapping[int, Triple], chi: Mapping[int, Any]) -> None:
        self.base, self.points_taken = base, 0
        self._numbers, gamma = block.numbers, 1 - block.delta
        self._one = gamma * 0 + 1
        self.psi = Terms([self._one * n for n in (1, 2, 3, 4)], self._numbers, gamma=gamma)
        self.chi = Terms([chi[n] for n in (1, 2, 3, 4)], self._numbers, self.psi, gamma)
        # The three points of which all points are combinations, times the constant factors of the formula.
        self._lifts = self._numbers.lifts([tuple(-2 * entry for entry in P[0]), P[1], P[-1]])
        self._divisor = self._numbers.prepared_divisor(self._numbers.split(chi[0])[0])
        self._product: tuple[int, Any] = (0, None)  # n and psi_{n-1} psi_n, for the next point

    def points(self) -> Iterator[Triple]:
        """Yield P_2, P_3, ... as primitive triples, as long as the map is defined."""
        for n in count(_MIN_INDEX):
            point = self.point(n)
            if point[2] == 0:
                return
            yield point
            self.psi.forget(n // 2 - 4)
            self.chi.forget(n // 2 - 4)

    def point(self, n: int) -> Triple:
        """Return P_n for n >= 2, a primitive triple over Q."""
        psi, chi = self.psi, self.chi
        psi_before, psi_n, psi_after = (psi.integer(n + k) for k in (-1, 0, 1))
        product_before = self._product[1] if self._product[0] == n else psi_before * psi_n
        self._product = n + 1, psi_n * psi_after
        product_after = self._product[1]
        terms = [
            psi_before * psi_after * chi.integer(n),
            product_after * chi.integer(n - 1),
            product_before * chi.integer(n + 1),
        ]
        # The scales, divided by the scale of the first term.
        ratio = chi.mixed_quotient(n)
        scales = [self._one, chi.own_quotient(n) / ratio, ratio / psi.own_quotient(n)]
        point: Triple = self._numbers.combine(scales, terms, self._lifts, self._divisor)
        return point
