"""Tau functions: the points of an orbit in a plane as products of two integer sequences a third of their length.

On the level cubic E the orbit is P_n = P_0 + n T. For lifts of the points to triples that satisfy

    P_{n+1} W_{n-1} = Psi(P_n)                                                     (natural lifts)

the determinants factor, det(P_i, P_j, P_k) = (const) psi_{j-i} psi_{k-i} psi_{k-j} chi_{i+j+k}, into values psi_n =
sigma(n T) and chi_n = sigma(n T - kappa) of one sigma function, kappa = -3 P_0 for the zero of E with which three
points on a line have sum 0. So

    P_n  ~  -2 psi_{n-1} psi_{n+1} chi_n P_0 + psi_n psi_{n+1} chi_{n-1} P_1 + psi_{n-1} psi_n chi_{n+1} P_{-1},

and for a + b and a - b everything is bilinear (phi is psi or chi; there are no other terms, so no content arises):

    phi_{a+b} phi_{a-b} = phi_{a+1} phi_{a-1} psi_b^2 - psi_{b+1} psi_{b-1} phi_a^2.

psi depends on delta = disc(h) level^2 alone: psi_1 = 1, psi_2 = 2, psi_3 = 3 gamma^(1/3), psi_4 = 4 with
gamma = 1 - delta. The cube roots are taken out: psi_n and chi_n are what is written here times gamma^(1/3) where 3
divides n, and then the one square on the right whose index alone is divisible by 3 has to be multiplied by gamma. So
all values follow from those of half the index (`tau_table`); here are the first ones, and how a point is put together.

Over Q the numbers would grow by powers of the bad primes like everything else, with exponents quadratic in n. So a
value is kept as an integer prime to the bad primes times a scale s_n that is never formed: only
t_n = s_{n+1} s_{n-1} / s_n^2 is needed, a small rational number. docs/mathematics.md has the proofs.
Source: ward-1948, for such sequences.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice

from flint import fmpq, fmpz

from kahanmaps.maps.normal_form.planar_block import determinant
from kahanmaps.maps.normal_form.planar_integers import IntegerBlock, IntegerTriple, bad_part, primitive, strip

_BASES = 3


@dataclass(frozen=True)
class Window:
    """Values of psi or chi from index `first` on: integers prime to the bad primes, and their scales s_n."""

    first: int
    values: list[fmpz]
    scales: list[fmpq]

    def t(self, n: int) -> fmpq:
        """s_{n+1} s_{n-1} / s_n^2."""
        k = n - self.first
        return self.scales[k + 1] * self.scales[k - 1] / (self.scales[k] * self.scales[k])

    def __getitem__(self, n: int) -> fmpz:
        return self.values[n - self.first]

    def scale(self, n: int) -> fmpq:
        """s_n."""
        return self.scales[n - self.first]


class TauStart:
    """psi_1, ..., psi_4, chi_{-2}, ..., chi_2 and the triples P_{-1}, P_0, P_1 around a base point of an orbit.

    `neighbours` are the primitive triples P_{-3}, ..., P_3. `usable` is False where a value is zero that would have to
    be divided by: T of small order, or three of the points on a line. Then another base point may do.
    """

    def __init__(self, block: IntegerBlock, neighbours: Sequence[IntegerTriple], base: int) -> None:
        self.base = base
        self.bad = block.bad
        self.gamma = 1 - block.delta
        P = dict(zip(range(-3, 4), neighbours, strict=True))
        t = {}
        for k in range(-2, 3):
            raw = block.block.image(P[k])
            i = next(i for i in range(3) if P[k + 1][i] != 0)
            t[k] = fmpq(raw[i], P[k + 1][i] * P[k - 1][2]) if P[k - 1][2] != 0 else fmpq(0)
        self.usable = all(value != 0 for value in t.values())
        if not self.usable:
            return
        scales = {0: fmpq(1), 1: fmpq(1)}
        for k in range(0, -3, -1):
            scales[k - 1] = t[k] * scales[k] * scales[k] / scales[k + 1]
        for k in range(1, 3):
            scales[k + 1] = t[k] * scales[k] * scales[k] / scales[k - 1]

        def det(i: int, j: int, k: int) -> fmpq:
            found: fmpq = determinant(P[i], P[j], P[k]) * (scales[i] * scales[j] * scales[k])
            return found

        chi = {0: 3 * det(-1, 0, 1), 1: det(-1, 0, 2), -1: det(-2, 0, 1), 2: det(-1, 1, 2), -2: det(-2, -1, 1)}
        self.usable = all(value != 0 for value in chi.values())
        if not self.usable:
            return
        self.psi = _window(1, [fmpq(n) for n in (1, 2, 3, 4)], self.bad)
        self.chi = _window(-2, [chi[n] for n in range(-2, 3)], self.bad)
        # The three points that span all others, times what the formula multiplies them by; over a common factor.
        self._zero = [-2 * entry for entry in P[0]]
        self._one = P[1]
        self._minus, self._minus_scale = P[-1], scales[-1]
        self._divisor = abs(self.chi[0])

    def point(self, chi: Sequence[fmpz], products: Sequence[fmpz], ratio: fmpq, next_ratio: fmpq) -> IntegerTriple:
        """P_n, primitive, from chi at n-1, n, n+1 and products of psi.

        `products` are psi_{n-1} psi_{n+1}, psi_n psi_{n+1} and psi_{n-1} psi_n; `ratio` is (s_n/s_{n-1} of psi) over
        (that of chi), `next_ratio` the same for n + 1.
        """
        last = self._minus_scale / next_ratio
        common = ratio.q.lcm(last.q)
        right, left = (ratio * common).p, (last * common).p
        A, B, C = products[0] * chi[1], products[1] * chi[0], products[2] * chi[2]
        raw = [
            (common * zero) * A + (right * one) * B + (left * minus) * C
            for zero, one, minus in zip(self._zero, self._one, self._minus, strict=True)
        ]
        return strip(raw, self.bad, self._divisor)


def _window(first: int, values: Sequence[fmpq], bad: fmpz) -> Window:
    integers, scales = [], []
    for value in values:
        integer, part = bad_part(value.p, bad)
        integers.append(integer)
        scales.append(fmpq(part, value.q))
    return Window(first, integers, scales)


def start_near(block: IntegerBlock) -> TauStart | None:
    """A base point P_0, P_1 or P_2 around which no value is zero; None where there is none, or a pole is near.

    chi_n can vanish for one n only, unless T is a torsion point; `block` must not be constant nor degenerate.
    """
    before = _before(block, block.start)
    around = [*before, *islice(block.triples(before[-1]), _BASES + 3)]
    for base in range(_BASES):
        if len(around) >= base + 7:
            start = TauStart(block, around[base : base + 7], base)
            if start.usable:
                return start
    return None


def _before(block: IntegerBlock, point: IntegerTriple) -> list[IntegerTriple]:
    """P_{-3}, P_{-2}, P_{-1}."""
    found: list[IntegerTriple] = []
    for _ in range(3):
        raw = block.block.preimage(point)
        if raw == (0, 0, 0):
            raw = point
        point = primitive(raw)
        found.insert(0, point)
    return found
