"""The n-th point of an orbit in a plane over Q, directly: windows of psi and chi, doubled along the binary digits of n.

A window around i holds psi at i-3, ..., i+4 and chi at i-1, i, i+1. With the bilinear relation of `tau` for (a, b) =
(k+1, k) and (k+1, k-1) it gives psi_{2k+1} and psi_{2k}, for a = i and b near i it gives chi_{i+b}: each new value is
a difference of two products of four factors a quarter of its length. No number is longer than the result, and no
content arises but of bad primes. The scales s_n stay unformed: t_n of the new window follows from t_n of the old one
and from what was stripped.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import islice

from flint import fmpq, fmpz

from kahanmaps.maps.planar_integers import IntegerBlock, IntegerTriple, bad_part, divide_exactly
from kahanmaps.maps.tau import TauStart, somos, start_near

_CENTRE = 4  # the smallest first centre: below it a window would contain psi_0 = 0


def iterate(block: IntegerBlock, n: int) -> IntegerTriple | None:
    """P_n, primitive, up to sign, for n >= 0; None where doubling does not apply, so that one has to step.

    That is where the cubic is singular, T has small order, or n is small. Poles on the way are passed over.
    """
    if block.is_constant:
        return block.start
    if block.level is None or block.is_degenerate:
        return None
    found = start_near(block)
    if found is None or n - found.base < 2 * _CENTRE:
        return None
    return _point(found, n - found.base)


@dataclass
class _Window:
    """psi on a range of indices with t on its inner ones, chi at three indices with t at the middle one."""

    psi: dict[int, fmpz]
    t_psi: dict[int, fmpq]
    chi: dict[int, fmpz]
    t_chi: fmpq


def _point(start: TauStart, n: int) -> IntegerTriple:
    digits = [int(digit) for digit in f"{n:b}"]
    centre = int(f"{n:b}"[:3], 2)
    ranges = _ranges(n, digits[3:])
    window = _first_window(start, centre)
    for odd, wanted in zip(digits[3:], ranges, strict=True):
        window, ratio = _doubled(start, window, centre, odd, wanted)
        centre = 2 * centre + odd
    next_ratio = ratio * window.t_psi[n] / window.t_chi
    before, here, after = (window.psi[k] for k in (n - 1, n, n + 1))
    products = [before * after, here * after, before * here]
    return start.point([window.chi[k] for k in (n - 1, n, n + 1)], products, ratio, next_ratio)


def _ranges(n: int, digits: list[int]) -> list[range]:
    """Which psi every window after the first has to hold, so that the last one has n-1, n and n+1."""
    first, last, centre = n - 1, n + 1, n
    ranges = []
    for odd in reversed(digits):
        ranges.append(range(first, last + 1))
        centre = (centre - odd) // 2
        needed = [centre - 2, centre + 2 + odd]  # for chi
        for index in (first, last):
            k = index // 2
            needed += [k - 1, k + 2] if index % 2 else [k - 2, k + 2]
        first, last = min(needed), max(needed)
    return ranges[::-1]


def _first_window(start: TauStart, centre: int) -> _Window:
    psi = {n: start.psi[n] for n in range(1, 5)}
    t_psi = {n: start.psi.t(n) for n in (2, 3)}
    for n, (value, t) in enumerate(islice(somos(start.psi, start.bad, start.gamma), centre), start=5):
        psi[n], t_psi[n - 1] = value, t
    chi = {n: start.chi[n] for n in range(-1, 3)}
    t_chi = {n: start.chi.t(n) for n in (0, 1)}
    for n, (value, t) in enumerate(islice(somos(start.chi.after(-1), start.bad, start.gamma), centre), start=3):
        chi[n], t_chi[n - 1] = value, t
    return _Window(psi, t_psi, chi, t_chi[centre])


def _doubled(start: TauStart, old: _Window, i: int, odd: int, wanted: range) -> tuple[_Window, fmpq]:
    """The window around 2i + odd; and (s_n/s_{n-1} of psi) over (that of chi) there."""
    bad, gamma = start.bad, start.gamma
    square = _remembered(lambda k: old.psi[k] * old.psi[k])
    neighbours = _remembered(lambda k: old.psi[k + 1] * old.psi[k - 1])

    def bilinear(
        left: tuple[fmpq, fmpz], b_square: fmpz, right: tuple[fmpq, fmpz], a_square: fmpz, a: int, b: int
    ) -> tuple[fmpz, fmpz]:
        """t_a phi_{a+1} phi_{a-1} psi_b^2 - t_b psi_{b+1} psi_{b-1} phi_a^2, with gamma, and its denominator."""
        first, second = left[0].p * right[0].q, right[0].p * left[0].q
        below = left[0].q * right[0].q
        if (a % 3 == 0) != (b % 3 == 0):
            below = below * gamma.q
            first = first * (gamma.p if b % 3 == 0 else gamma.q)
            second = second * (gamma.p if a % 3 == 0 else gamma.q)
        return first * (left[1] * b_square) - second * (right[1] * a_square), below

    psi, rho = {}, {}
    for n in wanted:
        k = n // 2
        a, b = (k + 1, k) if n % 2 else (k + 1, k - 1)
        raw, below = bilinear((old.t_psi[a], neighbours(a)), square(b), (old.t_psi[b], neighbours(b)), square(a), a, b)
        divisor = a - b
        psi[n], part = bad_part(divide_exactly([raw], start.psi[divisor])[0], bad)
        rho[n] = fmpq(part, below) / start.psi.scale(divisor)
    t_psi = {}
    for n in wanted[1:-1]:
        k = n // 2
        t = old.t_psi[k] * old.t_psi[k + 1] if n % 2 else 1 / old.t_psi[k]
        t_psi[n] = t * t * rho[n + 1] * rho[n - 1] / (rho[n] * rho[n])

    around, middle = old.chi[i + 1] * old.chi[i - 1], old.chi[i] * old.chi[i]
    chi, rho_chi = {}, {}
    centre = 2 * i + odd
    for n in (centre - 1, centre, centre + 1):
        b = n - i
        raw, below = bilinear((old.t_chi, around), square(b), (old.t_psi[b], neighbours(b)), middle, i, b)
        divisor = i - b
        chi[n], part = bad_part(divide_exactly([raw], start.chi[divisor])[0], bad)
        rho_chi[n] = fmpq(part, below) / start.chi.scale(divisor)
    t = old.t_psi[centre - i]
    t_chi = t * t * rho_chi[centre + 1] * rho_chi[centre - 1] / (rho_chi[centre] * rho_chi[centre])
    t = 1 / old.t_psi[i] if odd else old.t_psi[i]
    ratio = t * t * (rho[centre] / rho[centre - 1]) * (rho_chi[centre - 1] / rho_chi[centre])
    return _Window(psi, t_psi, chi, t_chi), ratio


def _remembered(function: Callable[[int], fmpz]) -> Callable[[int], fmpz]:
    known: dict[int, fmpz] = {}

    def value(k: int) -> fmpz:
        if k not in known:
            known[k] = function(k)
        return known[k]

    return value
