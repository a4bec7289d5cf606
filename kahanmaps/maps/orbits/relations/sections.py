"""Sections of a line bundle on an elliptic curve at n T, as forms in the terms of the sequences W and U.

Sections of degree d are products of one term of U near n and d - 1 terms of W near n. A basis consists of the monomials
in the even functions A = W(n)^2 and B = W(n + 1) W(n - 1), each times one of two products that are not even.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from flint import fmpq, fmpq_mat, fmpz, fmpz_mat

from kahanmaps.algebra.matrices import primitive_integers
from kahanmaps.algebra.modular_matrices import echelon, pivots
from kahanmaps.maps.somos import around

_PRIME = 2**61 - 1  # the prime modulo which independent products are chosen


def forms(degree: int, W: Mapping[int, Any], U: Mapping[int, Any], n: int) -> list[Any]:
    """Return the values at n of the basis of sections that `exponents` describes."""
    square, neighbour_product = W[n] * W[n], W[n + 1] * W[n - 1]
    product0, product1 = U[n], U[n + 1] * W[n - 1]
    product0, product1 = (product0, product1 * W[n]) if degree % 2 else (product0 * W[n], product1)
    return [(product1 if k else product0) * square**i * neighbour_product**j for k, i, j in exponents(degree)]


def exponents(degree: int) -> list[tuple[int, int, int]]:
    """Return the triples (k, i, j) that describe a basis of the sections of a degree.

    k is 0 for U(n) and 1 for U(n + 1) W(n - 1); i and j are the exponents of W(n)^2 and W(n + 1) W(n - 1). The products
    with k = 0 (for odd degree, those with k = 1) have an additional factor W(n).
    """
    max_exponents = ((degree - 1) // 2, (degree - 2) // 2)
    return [(k, max_exponent - j, j) for k, max_exponent in enumerate(max_exponents) for j in range(max_exponent + 1)]


def common_primes(degree: int, table: fmpz_mat, W: Sequence[fmpq], U: Sequence[fmpq]) -> fmpq:
    """Return a number divisible by every prime that divides all coordinates at some n.

    A common prime of all coordinates divides all products of a coordinate and a section psi(n) that depends only on
    n T. If these products span the forms of their degree, such primes divide the index of the lattice of the products,
    since the only common primes of the forms are those of the first terms. Raises ArithmeticError if they do not span.
    """
    for extra_degree in (0, *range(2, degree + 1)):  # no section of degree 1 depends only on n T
        length = degree + extra_degree
        if table.nrows() * max(extra_degree, 1) < length:
            continue
        basis, products, factor = [], [], fmpq(1)
        terms = around(W, length // 2 + 3), around(U, length // 2 + 3, W)
        for n in range(-(length // 2), length - length // 2):
            values = (fmpq_mat(table) * fmpq_mat(degree, 1, forms(degree, *terms, n))).entries()
            scale_of_basis, basis_row = _primitive(forms(length, *terms, n))
            scale_of_products, product_row = _primitive(
                [value * psi for value in values for psi in _sections_of_multiples(extra_degree, terms[0], n)]
            )
            basis.append(basis_row)
            products.append(product_row)
            factor *= scale_of_products / scale_of_basis
        columns = pivots(echelon([[int(x % _PRIME) for x in row] for row in products], _PRIME))
        if len(columns) == length:
            independent_products = fmpz_mat([[row[k] for k in columns] for row in products])
            return factor * independent_products.det() / fmpz_mat(basis).det()
    raise ArithmeticError("coordinates have zeros in common")


def _primitive(row: Sequence[fmpq]) -> tuple[fmpq, Sequence[fmpz]]:
    """Write a row as a number times integers without a common factor. Raises ArithmeticError for a row of zeros."""
    integers = primitive_integers(tuple(row))
    for value, integer in zip(row, integers, strict=True):
        if integer:
            return value / integer, integers
    raise ArithmeticError("all values at a point are 0")


def _sections_of_multiples(degree: int, W: Mapping[int, fmpq], n: int) -> list[fmpq]:
    """Return a basis, at n, of the sections of a degree other than 1 that depend only on n T (that is, on W)."""
    square, neighbour_product, odd_product = W[n] * W[n], W[n + 1] * W[n - 1], W[n - 1] ** 2 * W[n + 2]

    def monomials(degree_in_squares: int) -> list[fmpq]:
        return [square ** (degree_in_squares - j) * neighbour_product**j for j in range(degree_in_squares + 1)]

    m, is_odd = divmod(degree, 2)
    if is_odd:
        return [W[n] * value for value in monomials(m)] + [odd_product * value for value in monomials(m - 1)]
    return monomials(m) + [odd_product * W[n] * value for value in monomials(m - 2)]
