"""Units of counted work (work.py) for polynomials: of one variable modulo primes below 2^64, and of several over Q.

Lengths are numbers of coefficients, sizes numbers of terms. What stands here was fitted to FLINT 3, from 2 to 100,000
coefficients, within a factor of two: classical products and remainders at small lengths, fast ones beyond.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

from flint import fmpq_mpoly, nmod_mpoly, nmod_poly

from kahanmaps.algebra.work import count


def product_units(length: int, other: int) -> float:
    """A product of two polynomials, or of as many terms of two series."""
    short, long = (length, other) if length < other else (other, length)
    return 0.4 + long * (0.05 + min(short / 3000, 0.05 * short.bit_length()))


def series_units(length: int) -> float:
    """The inverse of a series of so many terms, or a quotient of two."""
    return 0.5 + 2 * product_units(length, length)


def gcd_units(length: int, common: int = 0) -> float:
    """The gcd of two polynomials, which has the length `common`."""
    return 0.5 + length * (0.2 + min((length - common) / 500, 0.1 * sqrt(length)))


def minpoly_units(length: int) -> float:
    """The shortest linear recurrence of so many terms."""
    return 3 + length * (1.2 + min(length / 100, 0.2 * sqrt(length)))


def roots_units(length: int, roots: int = 0) -> float:
    """The roots modulo a prime of 61 bits, so many of them: powers of t modulo the polynomial, then modulo factors."""
    return 150 * (product_units(length, length) + product_units(roots, roots) * roots.bit_length())


def counted_product(left: Any, right: Any) -> Any:
    """The product of two polynomials, counted as work."""
    if isinstance(left, nmod_poly):
        count(product_units(len(left), len(right)))
    elif isinstance(left, fmpq_mpoly | nmod_mpoly):
        count(1 + len(left) * len(right) / 100)
    return left * right


def factored(polynomial: Any) -> list[tuple[Any, int]]:
    """The irreducible factors over Q of a polynomial in several variables, with multiplicities.

    Counted by terms: who calls bounds their number.
    """
    count(50 + 10 * len(polynomial))
    return [(factor, int(k)) for factor, k in polynomial.factor()[1]]
