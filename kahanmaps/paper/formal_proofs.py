"""Formal proofs of the facts (5)-(12), which hold for every quadratic f and every cubic H in every dimension.

In dimension 6, a proof in coordinates would need too many indeterminates. The facts follow without coordinates from a
few identities between multilinear expressions, in which Q is any symmetric bilinear map, B any linear map, T any
symmetric trilinear form and J any skew matrix. Each function yields the pairs of expressions that have to be equal;
docs/mathematics.md, "Formal proofs", says how the claims follow from these identities.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

from flint import fmpq, fmpq_poly

# A term is a letter, ("x",), or a map applied to terms, ("Q", ("x",), ("y",)), or a word of letters, ("J", "S").
Term = tuple[Any, ...]
Scalar = fmpq_poly  # a polynomial in eps
Pairs = Iterator[tuple["Expression", "Expression"]]

EPS = fmpq_poly([0, 1])


@dataclass(frozen=True, eq=False)
class Expression:
    """A linear combination of terms with coefficients in Q[eps]; `==` compares the coefficients."""

    coefficients: dict[Term, Scalar]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Expression) and (self - other).coefficients == {}

    __hash__ = None  # type: ignore[assignment]

    def __add__(self, other: Expression) -> Expression:
        return combine([*self.coefficients.items(), *other.coefficients.items()])

    def __sub__(self, other: Expression) -> Expression:
        return self + other * -1

    def __mul__(self, scalar: int | fmpq | Scalar) -> Expression:
        return combine([(term, coefficient * scalar) for term, coefficient in self.coefficients.items()])

    __rmul__ = __mul__

    def times(self, other: Expression) -> Expression:
        """Return the product of two linear combinations of words; the product of two words is their concatenation."""
        pairs = product(self.coefficients.items(), other.coefficients.items())
        return combine([(left + right, a * b) for (left, a), (right, b) in pairs])


def combine(terms: list[tuple[Term, Scalar]]) -> Expression:
    """Return the sum of the pairs (term, coefficient) as one expression."""
    total: dict[Term, Scalar] = {}
    for term, coefficient in terms:
        total[term] = total.get(term, fmpq_poly()) + coefficient
    return Expression({term: coefficient for term, coefficient in total.items() if not coefficient.is_zero()})


def letter(name: str) -> Expression:
    """Return the expression that is a single letter."""
    return Expression({(name,): fmpq_poly([1])})


@dataclass(frozen=True)
class Multilinear:
    """A multilinear map of which only `symmetry` is known: 1 means symmetric, -1 skew-symmetric, 0 neither."""

    name: str
    symmetry: int = 0

    def __call__(self, *arguments: Expression) -> Expression:
        terms = []
        for term_choice in product(*(argument.coefficients.items() for argument in arguments)):
            coefficient = fmpq_poly([1])
            for _, term_coefficient in term_choice:
                coefficient *= term_coefficient
            letters = [term for term, _ in term_choice]
            if self.symmetry:
                inversions = sum(a > b for i, a in enumerate(letters) for b in letters[i + 1 :])
                coefficient *= self.symmetry**inversions
                if self.symmetry < 0 and len(set(letters)) < len(letters):
                    continue
                letters.sort()
            terms.append(((self.name, *letters), coefficient))
        return combine(terms)


Q = Multilinear("Q", symmetry=1)
B = Multilinear("B")
T = Multilinear("T", symmetry=1)
X, Y, Z = letter("x"), letter("y"), letter("z")


class KahanEquation:
    """Kahan's equation E(x, x~) = 0 for f(x) = Q(x, x) + B x + c, with M = I - eps f'(x) and P = I + eps f'(x)."""

    def __init__(self, Q: Multilinear = Q, is_homogeneous: bool = False) -> None:
        self.Q = Q
        zero = Expression({})
        self.B: Callable[[Expression], Expression] = (lambda v: zero) if is_homogeneous else B
        self.c = zero if is_homogeneous else letter("c")

    def f(self, x: Expression) -> Expression:
        return self.Q(x, x) + self.B(x) + self.c

    def df(self, x: Expression, v: Expression) -> Expression:
        """Return f'(x) v."""
        return self.Q(x, v) * 2 + self.B(v)

    def E(self, x: Expression, y: Expression, eps: Scalar = EPS) -> Expression:
        """Return y - x - 2 eps (Q(x, y) + B(x + y)/2 + c), which is 0 if y = Phi(x)."""
        return y - x - (self.Q(x, y) * 2 + self.B(x + y) + self.c * 2) * eps

    def M(self, x: Expression, v: Expression) -> Expression:
        return v - self.df(x, v) * EPS

    def P(self, x: Expression, v: Expression) -> Expression:
        return v + self.df(x, v) * EPS


def map_of_any_quadratic_system(Q: Multilinear = Q) -> Pairs:
    """Yield the identities that imply (5)-(7): the explicit form, and reversibility."""
    kahan = KahanEquation(Q)
    yield kahan.M(X, Y - X) - 2 * EPS * kahan.f(X), kahan.E(X, Y)
    yield kahan.E(Y, X, -EPS), kahan.E(X, Y) * -1


def map_of_any_homogeneous_system(Q: Multilinear = Q) -> Pairs:
    """Yield the identities that imply (8) and (9)."""
    kahan = KahanEquation(Q, is_homogeneous=True)
    yield kahan.M(X, Y) - X, kahan.E(X, Y)
    yield Y - kahan.P(Y, X), kahan.E(X, Y)


def jacobian_of_any_map(Q: Multilinear = Q) -> Pairs:
    """Yield the identity that implies (10): E(x + v, y + w) = E(x, y) + M(x) w - P(y) v to first order in v and w."""
    kahan, v, w = KahanEquation(Q), letter("v"), letter("w")
    first_order = kahan.M(X, w) - kahan.P(Y, v)
    yield kahan.E(X + v, Y + w) - kahan.E(X, Y), first_order - Q(v, w) * (2 * EPS)


def integral_of_any_cubic(T: Multilinear = T, skew: Multilinear | None = None) -> Pairs:
    """Yield the identities that imply (11), for three successive points x, y, z of an orbit.

    H(x) = T(x, x, x), where a last coordinate 1 is appended to x. G_uv is the covector with G_uv . w = 3 T(u, v, w) for
    all w with last coordinate 0. Kahan's equation reads y - x = 2 eps J G_xy, hence T(u, v, y - x) = (2 eps/3) G_uv . J
    G_xy.
    """
    pairing = skew or Multilinear("G.JG", symmetry=-1)
    steps = {"xy": Y - X, "yz": Z - Y}
    factors = ((X, Y, "xy", "xy"), (Y, Z, "yz", "xy"), (X, Y, "xy", "yz"))  # u, v, the name of G_uv, and the step
    differences = (T(u, v, steps[step]) for u, v, _, step in factors)
    pairings = (pairing(letter(G), letter(step)) for _, _, G, step in factors)
    zero = Expression({})
    yield sum(differences, zero), T(Y, Y, Z) - T(X, X, Y)
    yield sum(pairings, zero), zero
    yield T(X, X, X) + T(X, X, Y - X), T(X, X, Y)  # the second form of the integral, H + (1/3) nabla H . (y - x)


def measure_of_any_hamiltonian_map(sign_of_transpose: int = -1) -> Pairs:
    """Yield the identities that imply (12): det(I + eps J S) = det(I - eps J S) for a skew J and a symmetric S.

    Transposition gives det(I + eps J S) = det(I - eps S J). The products of one block matrix with a shear, in both
    orders, are block triangular with determinants det(I - eps S J) and det(I - eps J S), which are hence equal.
    """
    one, zero = Expression({(): fmpq_poly([1])}), Expression({})
    J, S = letter("J"), letter("S")

    def transpose(expression: Expression) -> Expression:
        terms = expression.coefficients.items()
        return combine([(word[::-1], c * sign_of_transpose ** word.count("J")) for word, c in terms])

    yield transpose(one + EPS * J.times(S)), one - EPS * S.times(J)
    A, C = EPS * J, S
    block_matrix, shear = ((one, A), (C, one)), ((one, A * -1), (zero, one))
    for left, right, triangular in (
        (block_matrix, shear, ((one, zero), (C, one - C.times(A)))),
        (shear, block_matrix, ((one - A.times(C), zero), (C, one))),
    ):
        for i, k in product(range(2), repeat=2):
            yield left[i][0].times(right[0][k]) + left[i][1].times(right[1][k]), triangular[i][k]
