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

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from kahanmaps.maps.normal_form.planar_block import PlanarBlock, Triple, determinant

_BASES = 3


@dataclass(frozen=True)
class Window:
    """Values of psi or chi from index `first` on: integers prime to the bad primes, and their scales s_n."""

    first: int
    values: list[Any]
    scales: list[Any]

    def t(self, n: int) -> Any:
        """s_{n+1} s_{n-1} / s_n^2."""
        k = n - self.first
        return self.scales[k + 1] * self.scales[k - 1] / (self.scales[k] * self.scales[k])

    def __getitem__(self, n: int) -> Any:
        return self.values[n - self.first]

    def scale(self, n: int) -> Any:
        """s_n."""
        return self.scales[n - self.first]


class TauStart:
    """psi_1, ..., psi_4, chi_{-2}, ..., chi_2 and the natural lifts P_{-1}, P_0, P_1 around a base point of an orbit.

    `lifts` are P_{-2}, ..., P_2 over the field, `numbers` says how numbers of it are split and combined. `usable` is
    False where a value is zero that would have to be divided by: T of small order, or three of the points on a line.
    Then another base point may do.
    """

    def __init__(self, numbers: Any, gamma: Any, lifts: Sequence[Triple], base: int) -> None:
        self.base, self.numbers, self.gamma = base, numbers, gamma
        P = dict(zip(range(-2, 3), lifts, strict=True))
        chi = first_chi(P)
        self.usable = all(value != 0 for value in chi.values())
        if not self.usable:
            return
        one = gamma * 0 + 1
        self.psi = _window(1, [one * n for n in (1, 2, 3, 4)], numbers)
        self.chi = _window(-2, [chi[n] for n in range(-2, 3)], numbers)
        # The three points that span all others, times what the formula multiplies them by.
        self._lifts = numbers.lifts([tuple(-2 * entry for entry in P[0]), P[1], P[-1]])
        self._divisor = numbers.divisor(self.chi[0])
        self._one = one

    @property
    def lift_bits(self) -> int:
        """The bit length of the longest entry of the three points, over Q."""
        return max(int(entry.bit_length()) for lift in self._lifts for entry in lift)

    def point(self, chi: Sequence[Any], products: Sequence[Any], ratio: Any, next_ratio: Any) -> Triple:
        """P_n, primitive over Q, from chi at n-1, n, n+1 and products of psi.

        `products` are psi_{n-1} psi_{n+1}, psi_n psi_{n+1} and psi_{n-1} psi_n; `ratio` is (s_n/s_{n-1} of psi) over
        (that of chi), `next_ratio` the same for n + 1.
        """
        terms = [products[0] * chi[1], products[1] * chi[0], products[2] * chi[2]]
        found: Triple = self.numbers.combined([self._one, ratio, 1 / next_ratio], terms, self._lifts, self._divisor)
        return found


def first_chi(P: Mapping[int, Triple]) -> dict[int, Any]:
    """chi_{-2}, ..., chi_2 from natural lifts of P_{-2}, ..., P_2."""
    return {
        0: 3 * determinant(P[-1], P[0], P[1]),
        1: determinant(P[-1], P[0], P[2]),
        -1: determinant(P[-2], P[0], P[1]),
        2: determinant(P[-1], P[1], P[2]),
        -2: determinant(P[-2], P[-1], P[1]),
    }


def _window(first: int, values: Sequence[Any], numbers: Any) -> Window:
    found = [numbers.split(value) for value in values]
    return Window(first, [value for value, _ in found], [scale for _, scale in found])


def start_near(block: Any) -> TauStart | None:
    """A base point P_0, P_1 or P_2 around which no value is zero; None where there is none, or a pole is near.

    chi_n can vanish for one n only, unless T is a torsion point; `block` must not be constant nor degenerate.
    """
    over_field, zero, one = block.lifts
    lifts = _natural_lifts(over_field, zero, one, _BASES + 3)
    for base in range(_BASES):
        if base - 3 in lifts and base + 3 in lifts:
            around = [lifts[k] for k in range(base - 2, base + 3)]
            start = TauStart(block.numbers, 1 - block.delta, around, base)
            if start.usable:
                return start
    return None


def _natural_lifts(block: PlanarBlock, zero: Triple, one: Triple, until: int) -> dict[int, Triple]:
    """P_{-3}, P_{-2}, ... up to a pole, from those of P_0 and P_1."""
    P = {0: zero, 1: one}
    for k in range(1, until):
        if P[k - 1][2] == 0 or P[k][2] == 0:
            break
        P[k + 1] = _over(block.image(P[k]), P[k - 1][2])
    for k in range(0, -3, -1):
        if P[k + 1][2] == 0:
            break
        P[k - 1] = _over(block.preimage(P[k]), P[k + 1][2])
    return {k: lift for k, lift in P.items() if k <= 0 or lift[2] != 0}


def _over(triple: Triple, below: Any) -> Triple:
    U, V, W = triple
    return U / below, V / below, W / below
