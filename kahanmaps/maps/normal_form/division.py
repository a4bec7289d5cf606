"""Division polynomials psi_N of the translation T, in gamma; their roots are the levels with periodic orbits.

On a level of a plane the Kahan map is the translation by T = (0, 0) on y^2 + 6xy + 16 gamma y = x^3 + 3 gamma x^2, with
gamma = 1 - 64 eps^6 disc(h) c^2, c = h/(1 + eps^2 D) (docs/mathematics.md, "A translation, and tau functions"). So the
map has period N on the smooth levels with psi_N(gamma) = 0 and psi_d(gamma) != 0 for 1 <= d < N. By Mazur's theorem the
period at a rational gamma is neither 11 nor larger than 12. Sources: ward-1948 for the recurrence, mazur-1977.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from flint import fmpq, fmpq_poly, fmpz_poly

from kahanmaps.algebra.printing import format_univariate
from kahanmaps.errors import InputError

MAX_PERIOD = 60  # largest N: psi_N has degree about N^2/12
_GAMMA = fmpz_poly([0, 1])


@dataclass(frozen=True)
class PeriodicLevels:
    """The levels with period N: psi_N, its factor for the exact period N, and the rational gamma with this period.

    `psi` is psi_N without the factor gamma^(1/3), which occurs if 3 divides N.
    """

    period: int

    def __post_init__(self) -> None:
        if not 1 <= self.period <= MAX_PERIOD:
            raise InputError(f"found the period {self.period}, expected 1 to {MAX_PERIOD}")

    @cached_property
    def psi(self) -> fmpz_poly:
        """psi_N, a polynomial in gamma with integer coefficients."""
        return division_polynomials(self.period)[self.period]

    @cached_property
    def primitive(self) -> fmpz_poly:
        """The primitive part of psi_N, without the factors that it shares with psi_d for proper divisors d of N."""
        polynomial, psi = self.psi, division_polynomials(self.period)
        for d in range(1, self.period):
            if self.period % d == 0:
                while (common_factor := polynomial.gcd(psi[d])).degree() > 0:
                    polynomial = polynomial / common_factor
        return polynomial / polynomial.content()

    @cached_property
    def gammas(self) -> tuple[fmpq, ...]:
        """The rational gamma with exact period N in increasing order, except 0 and 1, where the cubic is singular."""
        roots = (-fmpq(f[0], f[1]) for f, _ in self.primitive.factor()[1] if f.degree() == 1)
        return tuple(sorted(root for root in roots if root != 0 and root != 1))

    def squares(self, discriminant: fmpq, eps: fmpq) -> tuple[fmpq, ...]:
        """Return for each of `gammas` the square of the level h/(1 + eps^2 D), if disc(h) is `discriminant`.

        The levels with a positive square are real. Raises InputError for disc(h) = 0 or eps = 0.

        >>> PeriodicLevels(5).squares(fmpq(-27), fmpq(1, 2))
        (5/729,)
        """
        if discriminant == 0 or eps == 0:
            raise InputError("found disc(h) = 0 or eps = 0, expected a plane with smooth levels and a nonzero eps")
        return tuple((1 - gamma) / (64 * eps**6 * discriminant) for gamma in self.gammas)


def division_polynomials(largest: int) -> list[fmpz_poly]:
    """Return psi_0, ..., psi_N in gamma, N = `largest`, without the factor gamma^(1/3) of psi_n if 3 divides n.

    >>> division_polynomials(6)[5:]
    [(-27)*x + 32, (-162)*x + 168]
    """
    psi = [fmpz_poly([c]) for c in (0, 1, 2, 3, 4)]

    def term(n: int, indices: tuple[int, ...]) -> fmpz_poly:
        """Return the product of the psi_k, k in `indices`, with the omitted cube roots of gamma, except psi_n's."""
        cube_root_count = sum(k % 3 == 0 for k in indices) - (n % 3 == 0)
        value = _GAMMA ** (cube_root_count // 3)
        for k in indices:
            value = value * psi[k]
        return value

    for n in range(5, largest + 1):
        k = n // 2
        if n % 2:
            psi.append(term(n, (k + 2, k, k, k)) - term(n, (k - 1, k + 1, k + 1, k + 1)))
        else:
            psi.append((term(n, (k, k + 2, k - 1, k - 1)) - term(n, (k, k - 2, k + 1, k + 1))) / 2)
    return psi[: largest + 1]


def text_in_gamma(polynomial: fmpz_poly) -> str:
    """Return a polynomial in gamma as text."""
    return format_univariate(fmpq_poly(polynomial)).replace("t", "gamma")
