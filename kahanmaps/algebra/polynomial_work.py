"""Units of work (see work.py) for polynomials: in one variable modulo primes below 2^64, and in several over Q.

A length is a number of coefficients or terms. The formulas agree with times measured for FLINT 3 within a factor of
two, for 2 to 100,000 coefficients; FLINT uses classical algorithms for small lengths, and fast ones for large lengths.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

from flint import fmpq_mpoly, nmod_mpoly, nmod_poly

from kahanmaps.algebra.work import count_work


def product_units(length: int, other_length: int) -> float:
    """Return the units of work for a product of two polynomials, or truncated series, with these numbers of terms."""
    min_length, max_length = (length, other_length) if length < other_length else (other_length, length)
    return 0.4 + max_length * (0.05 + min(min_length / 3000, 0.05 * min_length.bit_length()))


def series_units(length: int) -> float:
    """Return the units of work for the inverse of a series with `length` terms, or for a quotient of two of them."""
    return 0.5 + 2 * product_units(length, length)


def gcd_units(length: int, gcd_length: int = 0) -> float:
    """Return the units of work for a gcd with `gcd_length` terms of two polynomials with `length` terms."""
    return 0.5 + length * (0.2 + min((length - gcd_length) / 500, 0.1 * sqrt(length)))


def minpoly_units(length: int) -> float:
    """Return the units of work for the shortest linear recurrence of a sequence with this number of terms."""
    return 3 + length * (1.2 + min(length / 100, 0.2 * sqrt(length)))


def roots_units(length: int, root_count: int = 0) -> float:
    """Return the units of work for the `root_count` roots, modulo a 61-bit prime, of a polynomial of `length` terms."""
    return 150 * (product_units(length, length) + product_units(root_count, root_count) * root_count.bit_length())


def counted_product(left: Any, right: Any) -> Any:
    """Return the product of two polynomials, and count its work."""
    if isinstance(left, nmod_poly):
        count_work(product_units(len(left), len(right)))
    elif isinstance(left, fmpq_mpoly | nmod_mpoly):
        count_work(1 + len(left) * len(right) / 100)
    return left * right


def factored(polynomial: Any) -> list[tuple[Any, int]]:
    """Return the irreducible factors over Q of a polynomial in several variables, with multiplicities.

    Work is counted in proportion to the number of terms, which the caller must bound.
    """
    count_work(50 + 10 * len(polynomial))
    return [(factor, int(k)) for factor, k in polynomial.factor()[1]]
