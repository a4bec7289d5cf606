"""How large the polynomials behind an identity are: degrees and coefficients, derived and never assumed.

An identity of rational functions of x (and of eps, where it is to hold for every eps) is one of integer polynomials
once denominators are cleared. `Size` bounds such a polynomial: its total degree, and log2 of the sum of the
absolute values of its coefficients. That sum is submultiplicative and subadditive, so that bounds follow the
computation step by step. A map point is X / W with all entries of X and W bounded by one Size; a Kahan step is
Cramer's rule.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from flint import fmpq, fmpq_mpoly, fmpz

from kahanmaps.algebra.polynomials import RationalFunction, common_denominator
from kahanmaps.systems.quadratic import QuadraticSystem


@dataclass(frozen=True)
class Size:
    """A bound on an integer polynomial: total degree, and log2 of the sum of the absolute coefficients.

    >>> Size(2, 1.0) * Size(3, 0.5)
    Size(degree=5, bits=1.5)
    >>> Size(2, 1.0) + Size(3, 1.0)
    Size(degree=3, bits=2.0)
    """

    degree: int
    bits: float

    def __mul__(self, other: Size) -> Size:
        return Size(self.degree + other.degree, self.bits + other.bits)

    def __add__(self, other: Size) -> Size:
        return Size(max(self.degree, other.degree), _log_sum(self.bits, other.bits))

    def __pow__(self, exponent: int) -> Size:
        return Size(self.degree * exponent, self.bits * exponent)

    def __or__(self, other: Size) -> Size:
        """A bound for either polynomial."""
        return Size(max(self.degree, other.degree), max(self.bits, other.bits))


ONE = Size(0, 0.0)
VARIABLE = Size(1, 0.0)


@dataclass(frozen=True)
class Fraction:
    """Bounds for numerator and denominator of a rational function."""

    above: Size
    below: Size

    def equation(self, other: Fraction) -> Size:
        """The polynomial that vanishes when the two rational functions are equal."""
        return self.above * other.below + other.above * self.below


def eps_size(eps: fmpq | None) -> Size:
    """eps = p/q: a bound for both p and q; for an indeterminate eps (None) a variable."""
    if eps is None:
        return VARIABLE
    return Size(0, max(_log2(abs(eps.p)), _log2(eps.q)))


def step_size(system: QuadraticSystem, eps: Size, point: Size) -> Size:
    """The image of a point X / W under the Kahan map, by Cramer's rule for (q L W - p L f') x~ = ..."""
    rows = _row_sums(system)
    n = system.dim
    return Size(n * (point.degree + eps.degree), n * (point.bits + eps.bits) + sum(_log2(row) for row in rows))


def determinant_size(system: QuadraticSystem, eps: Size, point: Size) -> Fraction:
    """det(I - eps f'(X / W)) = det(q L W - p L f') / (q L W)^n."""
    common = system.integer_form[0]
    below = (eps * point * Size(0, _log2(common))) ** system.dim
    return Fraction(step_size(system, eps, point), below)


def polynomial_size(polynomial: fmpq_mpoly) -> tuple[Size, fmpz]:
    """The size of the polynomial times its common denominator, and that denominator."""
    below = common_denominator(polynomial)
    total = fmpz(0)
    degree = 0
    for monomial, coefficient in polynomial.terms():
        total += abs(coefficient.p * (below // coefficient.q))
        degree = max(degree, int(sum(monomial)))
    return Size(degree, _log2(total)), below


def function_size(function: RationalFunction, dim: int, eps: Size, point: Size) -> Fraction:
    """The value of a rational function of x_1, ..., x_dim and eps (its last variable) at X / W."""
    numerator, below = polynomial_size(function.numerator)
    denominator, _ = polynomial_size(function.denominator)
    x_degree = eps_degree = 0
    for polynomial in (function.numerator, function.denominator):
        for monomial, _ in polynomial.terms():
            x_degree = max(x_degree, int(sum(monomial[:dim])))
            eps_degree = max(eps_degree, int(sum(monomial[dim:])))
    scale = point**x_degree * eps**eps_degree
    return Fraction(scale * Size(0, numerator.bits), scale * Size(0, denominator.bits + _log2(below)))


def _row_sums(system: QuadraticSystem) -> list[fmpz]:
    """A bound for the coefficient sum in each row of [q L W - p L f' | right-hand side], with |p|, |q| put to 1."""
    common, tensor, linear, constant = system.integer_form
    n = system.dim
    entries = tensor.entries()
    sums = []
    for i in range(n):
        quadratic = sum((abs(entry) for entry in entries[i * n * n : (i + 1) * n * n]), fmpz(0))
        inhomogeneous = sum((abs(linear[i, j]) for j in range(n)), fmpz(0))
        sums.append(common + quadratic + inhomogeneous + common + inhomogeneous + 2 * abs(constant[i, 0]))
    return sums


def _log2(value: fmpz | int) -> float:
    """log2 of a nonnegative integer, rounded up a little; 0 for 0."""
    number = int(value)
    if number <= 1:
        return 0.0
    shift = max(0, number.bit_length() - 60)
    return math.log2((number >> shift) + (1 if shift else 0)) + shift + 1e-9


def _log_sum(left: float, right: float) -> float:
    high, low = max(left, right), min(left, right)
    return high + math.log2(1 + 2 ** (low - high)) if high - low < 200 else high + 1e-9
