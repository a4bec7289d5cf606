"""Points, steps and values of monomials modulo a prime: what the searches for integrals and densities feed on."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from functools import cache

from flint import nmod_mat

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.polynomials import monomials
from kahanmaps.errors import KahanmapsError, SingularStep
from kahanmaps.maps.kahan import KahanMapOver
from kahanmaps.systems.quadratic import QuadraticSystem

Point = tuple[int, ...]
_TRIES = 60


class NoPoint(KahanmapsError):
    """The map has no value at any of many random points modulo a prime."""


class ModularMap:
    """The Kahan map of a system modulo `prime`, at the residues `values` of its symbols and `eps`; time step 2 eps.

    Everything drawn at random comes from `rng`.
    """

    def __init__(
        self, system: QuadraticSystem, prime: int, eps: int, values: Sequence[int] = (), seed: int = 0
    ) -> None:
        self.prime = prime
        self.eps = eps
        self.dim = system.dim
        self.values = tuple(values)
        self.rng = random.Random(f"{seed} {prime} {eps} {tuple(values)}")
        field = GF(prime)
        self.local = system.over(field, [field.convert(value) for value in values])
        self.map = KahanMapOver(self.local, field.convert(eps))

    def random_point(self) -> Point:
        """A random point modulo the prime."""
        return tuple(self.rng.randrange(self.prime) for _ in range(self.dim))

    def step(self, x: Point) -> Point | None:
        """The image of a point, None where the map has no value."""
        try:
            return tuple(int(entry) for entry in self.map.step(x))
        except SingularStep:
            return None

    def determinant(self, x: Point, sign: int = 1) -> int:
        """det(I - eps f'(x)), with sign = -1 det(I + eps f'(x))."""
        return int((self.map if sign > 0 else self.map.inverse).determinant(x))

    def pairs(self, count: int) -> Iterator[tuple[Point, Point]]:
        """So many random points with their images. Raises NoPoint where the map has hardly any."""
        missed = 0
        while count > 0:
            x = self.random_point()
            image = self.step(x)
            if image is not None:
                yield x, image
                count -= 1
            else:
                missed += 1
                if missed > _TRIES:
                    raise NoPoint("the map has no value at random points modulo a prime")

    def orbit(self, count: int, start: Point | None = None) -> list[Point]:
        """Up to `count` points of an orbit; fewer where it is periodic: then all of its points.

        An orbit that meets the singular set is given up for another. Raises NoPoint where all do.
        """
        longest = 0
        for _ in range(_TRIES):
            x = self.random_point() if start is None else start
            found, first = [x], x
            while len(found) < count:
                image = self.step(x)
                if image is None or image == first:
                    break
                found.append(image)
                x = image
            else:
                return found
            if image is not None:
                return found
            longest = max(longest, len(found))
            if start is not None:
                break
        if longest == 1:
            raise NoPoint("the map has no value at random points modulo a prime")
        raise NoPoint("orbits modulo a prime meet the singular set")


@cache
def exponents_up_to(dim: int, degree: int) -> tuple[tuple[int, ...], ...]:
    """The exponents of all monomials of degree at most `degree`, by increasing degree."""
    return tuple(m for k in range(degree + 1) for m in monomials(dim, k))


@cache
def _recipe(support: tuple[tuple[int, ...], ...]) -> tuple[list[tuple[int, int]], list[int]]:
    """How to compute monomials one product each: (index of an earlier one, variable), and where `support` is found."""
    index: dict[tuple[int, ...], int] = {}
    steps: list[tuple[int, int]] = []

    def place(exponent: tuple[int, ...]) -> int:
        found = index.get(exponent)
        if found is None:
            last = max((k for k, e in enumerate(exponent) if e), default=-1)
            if last >= 0:
                parent = place((*exponent[:last], exponent[last] - 1, *exponent[last + 1 :]))
                steps.append((parent, last))
            else:
                steps.append((-1, -1))
            found = index[exponent] = len(steps) - 1
        return found

    return steps, [place(exponent) for exponent in support]


def monomial_values(support: tuple[tuple[int, ...], ...], point: Point, prime: int) -> list[int]:
    """The values of monomials at a point modulo a prime."""
    steps, places = _recipe(support)
    table: list[int] = []
    for parent, variable in steps:
        table.append(table[parent] * point[variable] % prime if parent >= 0 else 1)
    return [table[place] for place in places]


def null_space(rows: Sequence[Sequence[int]], columns: int, prime: int) -> list[list[int]]:
    """The canonical basis (reduced echelon form) of the vectors that all rows annihilate, modulo a prime."""
    if not rows:
        return [[int(i == j) for j in range(columns)] for i in range(columns)]
    matrix = nmod_mat(len(rows), columns, [entry for row in rows for entry in row], prime)
    basis, nullity = matrix.nullspace()
    if nullity == 0:
        return []
    vectors = [[int(basis[i, j]) for i in range(columns)] for j in range(nullity)]
    return echelon(vectors, prime)


def echelon(vectors: Sequence[Sequence[int]], prime: int) -> list[list[int]]:
    """The reduced echelon basis of the span of vectors modulo a prime."""
    if not vectors:
        return []
    columns = len(vectors[0])
    matrix, rank = nmod_mat(len(vectors), columns, [entry for row in vectors for entry in row], prime).rref()
    return [[int(matrix[i, j]) for j in range(columns)] for i in range(rank)]


def combine(weights: Sequence[Sequence[int]], vectors: Sequence[Sequence[int]], prime: int) -> list[list[int]]:
    """The combinations sum_k w_k v_k of vectors modulo a prime, one for each row w of weights."""
    if not weights or not vectors:
        return []
    left = nmod_mat(len(weights), len(vectors), [entry for row in weights for entry in row], prime)
    right = nmod_mat(len(vectors), len(vectors[0]), [entry for row in vectors for entry in row], prime)
    product = left * right
    return [[int(product[i, j]) for j in range(len(vectors[0]))] for i in range(len(weights))]


def rank(vectors: Sequence[Sequence[int]], prime: int) -> int:
    """The rank of vectors modulo a prime."""
    if not vectors or not vectors[0]:
        return 0
    entries = [entry for row in vectors for entry in row]
    return int(nmod_mat(len(vectors), len(vectors[0]), entries, prime).rank())


def gradient_values(
    vector: Sequence[int], support: tuple[tuple[int, ...], ...], point: Point, prime: int
) -> tuple[int, list[int]]:
    """The value and the gradient at a point of the polynomial with these coefficients."""
    value, slopes = 0, [0] * len(point)
    powers = monomial_values(support, point, prime)
    inverses = [pow(x, -1, prime) if x else None for x in point]
    for coefficient, exponent, power in zip(vector, support, powers, strict=True):
        if not coefficient:
            continue
        value += coefficient * power
        for k, e in enumerate(exponent):
            if e:
                inverse = inverses[k]
                if inverse is None:  # random points have no zero; orbits on coordinate planes do
                    lowered = (*exponent[:k], e - 1, *exponent[k + 1 :])
                    slope = monomial_values((lowered,), point, prime)[0]
                else:
                    slope = power * inverse
                slopes[k] = (slopes[k] + coefficient * e * slope) % prime
    return value % prime, slopes
