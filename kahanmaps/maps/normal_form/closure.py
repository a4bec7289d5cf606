"""Whether an orbit is dense in the real components of its level set that it visits, and whether it is Zariski dense.

The components are products of circles. Let rho_i be the coordinates of the translation on these circles. The orbit is
dense if and only if sum n_i rho_i = n_0 has no integer solution except n_i = 0 for all i (Kronecker). On one circle the
orbit is dense if the translation has infinite order. For several circles no theorem is known that excludes all such
relations; computations in balls exclude relations with small coefficients. The orbit is Zariski dense if no two level
curves are isogenous; a single prime can prove this. See docs/mathematics.md, "Geometry of the level sets".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import isqrt
from typing import Any

from flint import arb, fmpq, fmpq_poly, fmpz, fmpz_mat, nmod_poly

from kahanmaps.algebra.fields import RR

_SCALE = 10**15  # rotation numbers have errors of at most 1/_SCALE
_MIN_EXCLUDED_SIZE = 10  # if relations with coefficients up to this size are possible, the answer is "undecided"
_MAX_PRIME = 4000  # largest prime modulo which curves are compared


@dataclass(frozen=True)
class Closure:
    """Whether an orbit is dense in the components that it visits: proved if True or False, not proved if None.

    `bound` is the size of coefficients up to which relations of the rotation numbers are excluded (proved), if
    `is_dense` is None. If `prime` is given, no two level curves are isogenous modulo this prime (proved). Then the
    orbit is Zariski dense and all integrals are constant on the level set. Otherwise `prime` is None.
    """

    is_dense: bool | None
    reason: str
    bound: int | None = None
    prime: int | None = None

    @property
    def status(self) -> str:
        """Return "proved", "supported" (dense unless a relation has large coefficients) or "undecided"."""
        return "proved" if self.is_dense is not None else "undecided" if self.bound is None else "supported"

    @property
    def text(self) -> str:
        """The result as one line."""
        answer_text = "not dense" if self.is_dense is False else "dense"
        zariski_text = (
            f"; Zariski dense (proved: no two curves are isogenous modulo {self.prime})" if self.prime else ""
        )
        return f"{answer_text} in the real components that it visits ({self.status}: {self.reason}){zariski_text}"

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "dense": self.is_dense,
            "status": self.status,
            "reason": self.reason,
            "bound": self.bound,
            "zariski_dense": True if self.is_dense or self.prime is not None else self.is_dense,
            "prime": self.prime,
        }


def closure(gammas: Sequence[Any], orders: Sequence[int | None], numbers: Sequence[arb]) -> Closure:
    """Return whether an orbit on a product of smooth levels is dense in the components that it visits.

    Args:
        gammas, orders: for each plane over Q in which the orbit moves, gamma and the order of the translation (None:
            infinite).
        numbers: the rotation numbers at real roots of chi; both coordinates of the translation at complex pairs.
    """
    if any(order is not None for order in orders):
        return Closure(False, "a translation has finite order")
    gamma_polynomial = fmpq_poly([1])
    for gamma in gammas:
        gamma_polynomial *= fmpq_poly([-gamma, 1]) if isinstance(gamma, fmpq) else fmpq_poly(gamma.matrix.charpoly())
    if gamma_polynomial.gcd(gamma_polynomial.derivative()).degree() > 0:
        return Closure(False, "gamma has the same value at two roots of chi, so the rotation numbers are dependent")
    if len(numbers) == 1:
        return Closure(True, "the translation of a circle has infinite order")
    bound, prime = excluded_relations(numbers), separating_prime(gamma_polynomial)
    if bound < _MIN_EXCLUDED_SIZE:
        return Closure(None, "the rotation numbers may be dependent", None, prime)
    return Closure(None, f"no integer relation of the rotation numbers has coefficients up to {bound}", bound, prime)


def separating_prime(gamma_polynomial: fmpq_poly) -> int | None:
    """Return a prime modulo which all curves of roots of `gamma_polynomial` are good and no two are isogenous.

    All roots must lie in GF(p). Two curves are not isogenous over any extension of GF(p) if the product of the
    discriminants a^2 - 4p of their Frobenius maps (a: trace) is not a square. None if no prime below 4000 shows this.

    >>> separating_prime(fmpq_poly([6, -5, 1])), separating_prime(fmpq_poly([9, -6, 1]))
    (7, None)
    """
    numerator, denominator = gamma_polynomial.numer(), gamma_polynomial.denom()
    for p in range(5, _MAX_PRIME):
        if not fmpz(p).is_prime() or denominator % p == 0:
            continue
        roots = [-int(f[0]) for f, _ in nmod_poly(numerator, p).factor()[1] if f.degree() == 1]
        if len(roots) < gamma_polynomial.degree() or any(root % p in (0, 1) for root in roots):
            continue
        squares, discriminants = {x * x % p for x in range(1, p)}, []
        for gamma in roots:
            cubic_values = [(((x + 9 + 3 * gamma) * x + 48 * gamma) * x + 64 * gamma * gamma) % p for x in range(p)]
            trace = sum(1 if y else 0 for y in cubic_values) - 2 * sum(y in squares for y in cubic_values)
            discriminants.append(trace * trace - 4 * p)
        products = (x * y for x, y in combinations(discriminants, 2))
        if all(isqrt(product) ** 2 != product for product in products):
            return p
    return None


def excluded_relations(numbers: Sequence[arb]) -> int:
    """Return an N such that sum n_i rho_i is not an integer for any integers n_i with 0 < max |n_i| <= N.

    The numbers rho_i are balls of radius at most 1e-15.

    With C = 10^15 the vectors (n_1, ..., n_d, sum n_i [C rho_i] - C n_0) form a lattice; relations give short vectors.
    No lattice vector is shorter than the shortest vector of the orthogonalized basis; LLL only makes this bound large.

    >>> excluded_relations([arb(2).sqrt()]) > 10**6, excluded_relations([arb(1) / 3]) < 3
    (True, True)
    """
    d, rows = len(numbers), list[list[int | fmpz]]()
    for k, x in enumerate(numbers):
        with RR(128).working():
            integer = (_SCALE * x).mid().floor().unique_fmpz()
        assert integer is not None  # a midpoint is an exact number
        rows.append([int(i == k) for i in range(d)] + [integer])
    reduced_basis = fmpz_mat([*rows, [0] * d + [_SCALE]]).lll().tolist()
    orthogonal_basis: list[list[fmpq]] = []
    squared_lengths: list[fmpq] = []
    for row in reduced_basis:
        vector = [fmpq(x) for x in row]
        for previous_vector, squared_length in zip(orthogonal_basis, squared_lengths, strict=True):
            factor = sum((x * y for x, y in zip(row, previous_vector, strict=True)), fmpq(0)) / squared_length
            vector = [x - factor * y for x, y in zip(vector, previous_vector, strict=True)]
        orthogonal_basis.append(vector)
        squared_lengths.append(sum((x * x for x in vector), fmpq(0)))
    # [C rho_i] differs from C rho_i by at most 3, so the last entry of the vector of a relation is at most 3 d N.
    min_squared_length = min(squared_lengths)
    return isqrt(int((min_squared_length.p - 1) // (min_squared_length.q * d * (1 + 9 * d))))
