"""Degrees of the iterates of many members of a family of maps: all modulo one small prime p, on lines over GF(p^2).

The parameters of the members are residues modulo p, so that all of them can be tried. A line over GF(p) would often
meet indeterminacy points; a line over GF(p^2) meets each of them with a probability of about 1/p^2. A line can give
degrees that are too small, but not too large: take the maximum over several lines.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import reduce
from math import prod
from typing import Any

import numpy as np
from flint import fmpq, fmpz, fmpz_mod_ctx, fmpz_mod_poly_ctx, fq_default_ctx, fq_default_poly_ctx
from numpy.typing import NDArray

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.errors import InputError
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.maps.kernels import choose_kernel

MAX_PRIME = 1 << 13  # sums of a few thousand products of residues, also multiplied by nu, stay below 2^53
MAX_DIMENSION = 6  # largest number of variables of a map
NOWHERE, TOO_LARGE = -1, -2  # stored instead of a degree
_CHUNK_SIZE = 128  # number of members measured in one call of the kernel
LONG = 200  # number of members from which on compiling saves time

Members = NDArray[np.int64]


class Family:
    """A map with symbols modulo an odd prime p < 2^13; a coefficient is a polynomial (table) in the symbols and eps.

    Raises InputError for values out of range, BadPrime if the prime divides a denominator.
    """

    def __init__(self, map_: MapFamily, prime: int) -> None:
        if not 2 < prime < MAX_PRIME or not fmpz(prime).is_prime():
            raise InputError(f"found the prime {prime}, expected an odd prime below {MAX_PRIME}")
        if map_.dim > MAX_DIMENSION:
            raise InputError(f"found a map of dimension {map_.dim}, expected at most {MAX_DIMENSION}")
        self.prime, self.dim, self.symbols = prime, map_.dim, map_.symbols
        field, n = GF(prime), map_.dim
        self.terms: list[tuple[int, int, int, int]] = []
        self._values: list[list[tuple[tuple[int, ...], int]]] = []  # polynomials in the symbols and eps
        positions: dict[tuple[int, ...], int] = {}
        for i, row in enumerate(map_.rows):
            for j, entry in enumerate(row):
                terms: dict[tuple[int, ...], list[tuple[tuple[int, ...], int]]] = {}
                for monomial, coefficient in entry.terms():
                    value = int(field.convert(coefficient))
                    if value:
                        exponents = tuple(int(e) for e in monomial)
                        terms.setdefault(exponents[:n], []).append((exponents[n:], value))
                for exponent, polynomial in terms.items():
                    position = positions.setdefault(exponent, len(positions))
                    self.terms.append((i, j, position, len(self._values)))
                    self._values.append(polynomial)
        self.degree = max(1, *(sum(exponent) for exponent in positions))
        self.exponents = [(*exponent, self.degree - sum(exponent)) for exponent in positions]
        self._nu = next(c for c in range(2, prime) if pow(c, (prime - 1) // 2, prime) == prime - 1)
        self._inverses = np.array([0, *(pow(c, -1, prime) for c in range(1, prime))], dtype=float)

    def degrees(
        self,
        members: Members,
        eps: fmpq | None,
        terms: int,
        max_length: int,
        rng: random.Random,
        *,
        kernel: str | None = None,
        jobs: int = 1,
    ) -> NDArray[np.int64]:
        """Return the degrees d_1, ..., d_terms of each member as a row, for one random line each.

        `members` are residues of the symbols, one row for each member; an additional column contains eps. Without this
        column, `eps` is an exact number, or None: a random element of GF(p^2) per member. `max_length` is the largest
        number of coefficients of a polynomial before common factors are removed. A degree is -2 (TOO_LARGE) beyond this
        number, and -1 (NOWHERE) if the iterate is defined nowhere. `kernel`: "numpy" or "numba"; `jobs`: threads.
        """
        numpy_rng = np.random.default_rng(rng.getrandbits(64))
        p, count = self.prime, len(members)
        values = self.coefficients(members, eps, numpy_rng)
        start = numpy_rng.integers(0, p, (count, self.dim + 1, 2, 2)).astype(float)
        start[:, -1] = 0.0
        start[:, -1, 0, 0] = 1.0
        weights = numpy_rng.integers(0, p, (terms, 2, 2, self.dim + 1)).astype(float)
        degrees = np.full((count, terms), TOO_LARGE, dtype=np.int64)
        walk = _walk_in_flint
        if choose_kernel(kernel, is_long=count >= LONG) == "numba":
            from kahanmaps.maps.residues import curve_kernel

            walk = curve_kernel.kernel()
        exponents = np.array(self.exponents, dtype=np.int64)
        term_table = np.array(self.terms, dtype=np.int64)

        def measure_chunk(low: int) -> None:
            chunk = slice(low, low + _CHUNK_SIZE)
            walk(start[chunk], exponents, term_table, values[chunk], weights, self._inverses, float(p), float(self._nu),
                 max_length, degrees[chunk])  # fmt: skip

        measure_chunk(count)  # without members: compile in this thread, which Ctrl-C can end, not in the pool
        with ThreadPoolExecutor(jobs) as pool:
            for _ in pool.map(measure_chunk, range(0, count, _CHUNK_SIZE)):
                pass
        return degrees

    def units(self, degrees: Sequence[int]) -> float:
        """Return the work, in units (algebra/work.py), for one member whose iterates 0, 1, ... have these degrees.

        The units were fitted to the compiled kernel in dimensions 2 to 5; the slower kernel counts the same units.
        """
        lengths = (self.dim * self.degree * d + 1 for d in degrees[:-1])
        return sum(2 + length / 2 + self.dim * length**2 / 400 for length in lengths)

    def coefficients(self, members: Members, eps: fmpq | None, numpy_rng: np.random.Generator) -> NDArray[np.float64]:
        """Return the coefficients of the equation in GF(p^2), an array (members, 2, coefficients)."""
        p, count = self.prime, len(members)
        if members.shape[1] > len(self.symbols):
            eps_values = np.stack([members[:, -1], np.zeros(count, dtype=np.int64)])
        elif eps is None:
            eps_values = numpy_rng.integers(0, p, (2, count))
            eps_values[0, ~eps_values.any(axis=0)] = 1  # replace eps = 0, for which the map would be the identity
        else:
            eps_values = np.zeros((2, count), dtype=np.int64)
            eps_values[0] = int(GF(p).convert(eps))
        powers = [np.array([[1], [0]]) + 0 * eps_values]
        coefficients = np.zeros((count, 2, len(self._values)))
        for position, polynomial in enumerate(self._values):
            total = np.zeros((2, count), dtype=np.int64)
            for exponents, coefficient in polynomial:
                while len(powers) <= exponents[-1]:
                    a, b = powers[-1], eps_values
                    powers.append(np.stack([a[0] * b[0] + self._nu * a[1] % p * b[1], a[0] * b[1] + a[1] * b[0]]) % p)
                term = np.full(count, coefficient)
                for k, exponent in enumerate(exponents[:-1]):
                    for _ in range(exponent):
                        term = term * members[:, k] % p
                total += term * powers[exponents[-1]] % p
            coefficients[:, :, position] = (total % p).T
        return coefficients


def _walk_in_flint(
    start: Any, exponents: Any, term_table: Any, values: Any, weights: Any, inverses: Any, p: float, nu: float,
    max_length: int, degrees: Any,
) -> None:  # fmt: skip
    """Measure degrees like `walk` of curve_kernel.py, without numba."""
    modulus = fmpz_mod_poly_ctx(fmpz_mod_ctx(int(p)))([-int(nu), 0, 1])
    field: Any = fq_default_ctx(modulus=modulus, var="w")
    context: Any = fq_default_poly_ctx(field)

    def polynomial(pairs: Any) -> Any:
        return context([field([int(a), int(b)]) for a, b in pairs.T])

    zero, one, power = context([]), context([1]), int(exponents[0].sum())
    for m in range(len(start)):
        X = [polynomial(entry) for entry in start[m]]
        for step in range(degrees.shape[1]):
            n = len(X) - 1
            if n * power * max(entry.degree() for entry in X) + 1 > max_length:
                break
            rows: list[list[Any]] = [[None] * (n + 1) for _ in range(n)]
            monomials = [prod((x**e for x, e in zip(X, row, strict=True)), start=one) for row in exponents.tolist()]
            for i, j, k, position in term_table:
                term = monomials[k] * polynomial(values[m][:, position : position + 1])
                rows[i][j] = term if rows[i][j] is None else rows[i][j] + term
            image = [zero if minor is None else minor for minor in kernel_minors(rows)]
            common_factor = reduce(lambda a, b: a.gcd(b), image)
            if common_factor.is_zero():
                degrees[m, step:] = NOWHERE
                break
            X = [entry // common_factor for entry in image]
            degrees[m, step] = max(entry.degree() for entry in X)
