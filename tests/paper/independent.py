"""The objects of the paper computed a second time: Python's Fractions and plain lists, nothing of the library.

H is a dict from exponents to coefficients, differentiated term by term; the Kahan step is solved for from its defining
equation, column by column, with the polarisation of f; matrices B_i are reflections I - 2 E_i with the projectors E_i;
gradients and Jacobi matrices come from dual numbers a + b d. Written from the paper, m = 3 and its generalization.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

from check_helpers import Dual, dot, dual, solve_by_elimination, times, transposed, unit

Vector = list[Any]
Matrix = list[list[Any]]
Polynomial = dict[tuple[int, ...], Fraction]


# Linear algebra


def apply(matrix: Matrix, vector: Sequence[Any]) -> Vector:
    return [dot(row, vector) for row in matrix]


def plus(left: Matrix, right: Matrix) -> Matrix:
    return [[a + b for a, b in zip(one, two, strict=True)] for one, two in zip(left, right, strict=True)]


def scaled(factor: Any, matrix: Matrix) -> Matrix:
    return [[factor * entry for entry in row] for row in matrix]


def combination(terms: Sequence[tuple[Any, Matrix]]) -> Matrix:
    total = scaled(*terms[0])
    for factor, matrix in terms[1:]:
        total = plus(total, scaled(factor, matrix))
    return total


def trace(matrix: Matrix) -> Any:
    total: Any = Fraction(0)
    for i, row in enumerate(matrix):
        total = total + row[i]
    return total


# Polynomials and derivatives


def derivative(polynomial: Polynomial, k: int) -> Polynomial:
    return {(*e[:k], e[k] - 1, *e[k + 1 :]): coefficient * e[k] for e, coefficient in polynomial.items() if e[k] > 0}


def evaluated(polynomial: Polynomial, x: Sequence[Any]) -> Any:
    total: Any = Fraction(0)
    for exponents, coefficient in polynomial.items():
        term: Any = coefficient
        for entry, exponent in zip(x, exponents, strict=True):
            for _ in range(exponent):
                term = term * entry
        total = total + term
    return total


def moved(x: Sequence[Fraction], k: int) -> list[Dual]:
    """x + d e_k."""
    return [Dual(entry, Fraction(int(i == k))) for i, entry in enumerate(x)]


def gradient(function: Callable[[Sequence[Any]], Any], x: Sequence[Fraction]) -> Vector:
    """The gradient of a number-valued function."""
    return [dual(function(moved(x, k))).b for k in range(len(x))]


def jacobi_matrix(function: Callable[[Sequence[Any]], Vector], x: Sequence[Fraction]) -> Matrix:
    """The Jacobi matrix of a vector-valued function."""
    return transposed([[dual(entry).b for entry in function(moved(x, k))] for k in range(len(x))])


# The paper


@dataclass
class Paper:
    """A, H and the roots of chi in their order; eps."""

    A: Matrix
    H: Polynomial
    roots: list[Fraction]
    eps: Fraction

    @property
    def n(self) -> int:
        return len(self.A)

    @property
    def m(self) -> int:
        return self.n // 2

    @cached_property
    def J(self) -> Matrix:
        m = self.m
        return [[Fraction((j == i + m) - (i == j + m)) for j in range(self.n)] for i in range(self.n)]

    @cached_property
    def slopes(self) -> list[Polynomial]:
        return [derivative(self.H, k) for k in range(self.n)]

    def power(self, k: int) -> Matrix:
        """A^k."""
        return times(unit(self.n), *[self.A] * k)

    def nabla(self, x: Sequence[Any], B: Matrix | None = None) -> Vector:
        """B nabla H(x)."""
        found = [evaluated(polynomial, x) for polynomial in self.slopes]
        return found if B is None else apply(B, found)

    def hessian(self, x: Sequence[Any]) -> Matrix:
        return [[evaluated(derivative(slope, k), x) for k in range(self.n)] for slope in self.slopes]

    def K(self, B: Matrix, x: Sequence[Any]) -> Any:
        """The cubic with gradient B nabla H, by Euler: x . nabla K = 3 K."""
        return dot(x, self.nabla(x, B)) * Fraction(1, 3)

    def f(self, x: Sequence[Any], B: Matrix | None = None) -> Vector:
        """J B nabla H(x), for B = I the vector field f, for B = A^i the field f_i, for B = B_i the field g_i."""
        return apply(self.J, self.nabla(x, B))

    def df(self, x: Sequence[Any], B: Matrix | None = None) -> Matrix:
        """The Jacobi matrix of J B nabla H."""
        hessian = self.hessian(x)
        return times(self.J, hessian if B is None else times(B, hessian))

    def step(self, x: Sequence[Any], B: Matrix | None = None, eps: Fraction | None = None) -> Vector:
        """The y with (y - x)/(2 eps) = Q(x, y), Q(x, y) = (f(x + y) - f(x) - f(y))/2: linear in y."""
        eps = self.eps if eps is None else eps
        at_x = self.f(x, B)
        columns = []
        for k in range(self.n):
            e = [Fraction(int(i == k)) for i in range(self.n)]
            whole = self.f([a + b for a, b in zip(x, e, strict=True)], B)
            polarised = [(w - a - b) * Fraction(1, 2) for w, a, b in zip(whole, at_x, self.f(e, B), strict=True)]
            columns.append([b - 2 * eps * q for b, q in zip(e, polarised, strict=True)])
        return solve_by_elimination(transposed(columns), list(x))

    def integral(self, x: Sequence[Any], B: Matrix | None = None) -> Any:
        """x^T J x^/eps, x^ the image under the map of J B nabla H."""
        return dot(x, apply(self.J, self.step(x, B))) / self.eps

    @cached_property
    def projectors(self) -> list[Matrix]:
        """The projectors onto the eigenspaces of A, prod (A - lambda_j)/(lambda_i - lambda_j) over j != i."""
        found = []
        for i in range(self.m):
            product = unit(self.n)
            for j, root in enumerate(self.roots):
                if j != i:
                    shifted = plus(self.A, scaled(-root, unit(self.n)))
                    product = times(product, scaled(1 / (self.roots[i] - root), shifted))
            found.append(product)
        return found

    @cached_property
    def reflections(self) -> list[Matrix]:
        """The B_i: -1 on the eigenspace of lambda_i, 1 on the others."""
        return [plus(unit(self.n), scaled(Fraction(-2), E)) for E in self.projectors]

    def E(self, i: int) -> Matrix:
        """The projector onto the eigenspace of A for lambda_i."""
        return self.projectors[i]

    def B(self, i: int) -> Matrix:
        """B_i."""
        return self.reflections[i]

    def square(self, x: Sequence[Any]) -> Matrix:
        """f'(x)^2."""
        df = self.df(x)
        return times(df, df)

    def Pi(self, x: Sequence[Any]) -> Matrix:
        return plus(self.J, scaled(-self.eps * self.eps, times(self.square(x), self.J)))

    def coefficients(self, x: Sequence[Any]) -> tuple[Any, list[Any]]:
        """p_0 and the q_i."""
        square = self.square(x)
        p0 = Fraction(4 - self.m, 8) * trace(square)
        return p0, [Fraction(1, 8) * trace(times(transposed(B), square)) for B in self.reflections]

    def factors(self, x: Sequence[Any]) -> list[Any]:
        """The s_i = 1 - eps^2 (p_0 + q_1 + ... + q_m - 2 q_i)."""
        p0, q = self.coefficients(x)
        total = p0
        for entry in q:
            total = total + entry
        return [1 - self.eps * self.eps * (total - 2 * entry) for entry in q]

    def p0(self, x: Sequence[Any]) -> Any:
        return self.coefficients(x)[0]

    def q(self, i: int, x: Sequence[Any]) -> Any:
        return self.coefficients(x)[1][i]

    def s(self, i: int, x: Sequence[Any]) -> Any:
        return self.factors(x)[i]

    def P0(self, x: Sequence[Any]) -> Any:
        total: Any = Fraction((self.m - 2) ** 2, 4)
        for s in self.factors(x):
            total = total + Fraction(4 - self.m, 4) / s
        return total

    def Q(self, i: int, x: Sequence[Any]) -> Any:
        factors = self.factors(x)
        total = Fraction(2 - self.m) - 2 / factors[i]
        for s in factors:
            total = total + 1 / s
        return total / (4 * self.eps * self.eps)

    def modified(self, x: Sequence[Any]) -> Any:
        """H + (2 eps/3) nabla H^T (I - eps f')^{-1} f."""
        matrix = plus(unit(self.n), scaled(-self.eps, self.df(x)))
        increment = solve_by_elimination(matrix, self.f(x))
        return evaluated(self.H, x) + Fraction(2, 3) * self.eps * dot(self.nabla(x), increment)
