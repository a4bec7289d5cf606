"""A map on all points of P^n over GF(p), as arrays: images, and the graph that they make.

Points are columns of n + 1 residues whose last coordinate that is not zero is 1, numbered from 0: first those with
X_1 = ... = 0, the affine space Z = 1 last. An image is the kernel vector of a matrix of forms (projective.py);
where it vanishes, the forms without common factor decide, and where those vanish too, the map has no value.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import isqrt, prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.errors import InputError
from kahanmaps.maps.equation import Equation
from kahanmaps.maps.implicit import BirationalMap
from kahanmaps.maps.inverse import TooLarge
from kahanmaps.maps.kahan import as_map
from kahanmaps.maps.projective import HomogeneousMap, homogeneous_map
from kahanmaps.maps.residues.relations import inverses
from kahanmaps.systems.quadratic import QuadraticSystem

Integers = NDArray[np.int64]
ReducedForms = list[list[tuple[tuple[int, ...], int]]]

MAX_PRIME = 1 << 29  # a sum of a few residues times a residue stays below 2^63
MAX_DIMENSION = 12  # the minors are 2^(n + 1) arrays
MAX_FACTORED = 6  # the dimension up to which the common factor of the forms is looked for
_CHUNK = 1 << 15


class ProjectiveMap:
    """A map at one exact eps on P^n over GF(p), 2 < p < 2^29; a system stands for its Kahan map. Exact.

    `factor` is the common factor of the n + 1 forms as text ("1": there is none), None where it was not looked for or
    forms of several factors are too large; `degree` the degree of the forms without it. A map with several factors has
    no value where a step of one has none; `is_undefined` says that det M(x) vanishes identically.
    Raises InputError for a prime or dimension out of range, BadPrime where eps or the system have no reduction.

    >>> system = QuadraticSystem.from_text(["x", "y"], ["x*y", "-x^2"])
    >>> chart = ProjectiveMap(system, "1/2", 7)
    >>> chart.count, chart.images(np.array([[3], [4], [1]])).ravel().tolist()
    (57, [2, 1, 0])
    """

    def __init__(self, given: QuadraticSystem | BirationalMap, eps: Any, prime: int) -> None:
        field, map_ = GF(prime), as_map(given)
        if not 2 < prime < MAX_PRIME:
            raise InputError(
                f"found the prime {prime}, expected one from 3 to {MAX_PRIME}"
                + (": modulo 2 every Kahan map is the identity" if prime == 2 else "")
            )
        if map_.dim > MAX_DIMENSION:
            raise InputError(f"found a map of dimension {map_.dim}, expected at most {MAX_DIMENSION}")
        self.prime, self.dim = prime, map_.dim
        over = map_.at(eps, field)
        self._factors: list[tuple[Equation, ReducedForms | None]] = [(one, None) for one in over.equations]
        self.factor: str | None = None
        self.degree = prod(map_.dim * equation.degree for equation in over.equations)
        self.is_undefined = False
        if map_.dim <= MAX_FACTORED:
            forms = [homogeneous_map(one) for one in over.factors]
            self._factors = [
                (one, _reduced(form, one.explicit is None)) for one, form in zip(over.equations, forms, strict=True)
            ]
            with suppress(TooLarge):
                found = homogeneous_map(over) if len(forms) > 1 else forms[0]
                self.factor, self.degree = str(found.factor), found.degree
                self.is_undefined = bool(found.denominator.is_zero())

    @property
    def count(self) -> int:
        """The number of points, (p^(n + 1) - 1)/(p - 1)."""
        return int((self.prime ** (self.dim + 1) - 1) // (self.prime - 1))

    def images(self, points: Integers) -> Integers:
        """The images of points in columns, normalised; a column of zeros where the map has no value."""
        p = self.prime
        found = np.empty_like(points)
        for low in range(0, points.shape[1], _CHUNK):
            X = points[:, low : low + _CHUNK]
            for equation, reduced in self._factors:
                monomials = [self._monomial(X, exponents) for exponents in equation.exponents]
                rows: list[list[Integers]] = []
                for row in equation.terms:
                    entries = []
                    for entry in row:
                        total = np.zeros(X.shape[1], dtype=np.int64)
                        for k, coefficient in entry:
                            total = (total + int(coefficient) * monomials[k]) % p
                        entries.append(total)
                    rows.append(entries)
                image = np.stack([entry % p for entry in kernel_minors(rows, lambda a, b: a * b % p)])
                if reduced is not None:
                    lost = np.flatnonzero(~image.any(axis=0) & X.any(axis=0))
                    image[:, lost] = self._values(reduced, X[:, lost])
                X = self.normalised(image)
            found[:, low : low + _CHUNK] = X
        return found

    def _values(self, forms: ReducedForms, X: Integers) -> Integers:
        """The forms without common factor at the columns of X."""
        values = np.zeros_like(X)
        for i, terms in enumerate(forms):
            for exponents, coefficient in terms:
                values[i] = (values[i] + coefficient * self._monomial(X, exponents)) % self.prime
        return values

    def _monomial(self, X: Integers, exponents: Sequence[int]) -> Integers:
        """The values of a monomial at the columns of X."""
        value = np.ones(X.shape[1], dtype=np.int64)
        for row, exponent in zip(X, exponents, strict=True):
            for _ in range(exponent):
                value = value * row % self.prime
        return value

    def normalised(self, X: Integers) -> Integers:
        """The columns divided by their last coordinate that is not zero; columns of zeros stay."""
        lead = np.zeros(X.shape[1], dtype=np.int64)
        for row in X:
            lead = np.where(row != 0, row, lead)
        return X * inverses(lead, self.prime) % self.prime

    def numbers(self, X: Integers) -> Integers:
        """The numbers of normalised points in columns; -1 for columns of zeros."""
        number = np.full(X.shape[1], -1, dtype=np.int64)
        for m in range(self.dim + 1):
            value = np.zeros(X.shape[1], dtype=np.int64)
            for k in range(m - 1, -1, -1):
                value = value * self.prime + X[k]
            first = (self.prime**m - 1) // (self.prime - 1)
            number = np.where(X[m] != 0, first + value, number)
        return number

    def points(self, numbers: Integers) -> Integers:
        """The points with these numbers, in columns."""
        X = np.zeros((self.dim + 1, len(numbers)), dtype=np.int64)
        for m in range(self.dim + 1):
            first = (self.prime**m - 1) // (self.prime - 1)
            inside = (numbers >= first) & (numbers < first + self.prime**m)
            rest = numbers[inside] - first
            for k in range(m):
                X[k, inside] = rest % self.prime
                rest = rest // self.prime
            X[m, inside] = 1
        return X

    def table(self) -> Integers:
        """The number of the image of every point, -1 where the map has no value."""
        found = np.empty(self.count, dtype=np.int64)
        for low in range(0, self.count, _CHUNK):
            chunk = np.arange(low, min(low + _CHUNK, self.count), dtype=np.int64)
            found[low : low + _CHUNK] = self.numbers(self.images(self.points(chunk)))
        return found

    def permutation(self, matrix: Any) -> Integers:
        """The number of R P for every point P, where R is an invertible matrix over GF(p) that acts on X alone."""
        entries = np.array([[int(e) for e in row] for row in matrix.tolist()], dtype=np.int64)
        found = np.empty(self.count, dtype=np.int64)
        for low in range(0, self.count, _CHUNK):
            X = self.points(np.arange(low, min(low + _CHUNK, self.count), dtype=np.int64))
            image = X.copy()
            for i, row in enumerate(entries):
                total = np.zeros(X.shape[1], dtype=np.int64)
                for j in np.flatnonzero(row):
                    total = (total + row[j] * X[j]) % self.prime
                image[i] = total
            found[low : low + _CHUNK] = self.numbers(self.normalised(image))
        return found


def _reduced(one: HomogeneousMap, by_minors: bool) -> ReducedForms | None:
    """The terms of the forms without what they have in common; None where they are the minors."""
    if by_minors and one.factor.is_constant():
        return None
    return [[(tuple(m), int(c)) for m, c in form.terms()] for form in one.forms]


@dataclass(frozen=True, eq=False)
class Graph:
    """The orbits of a map of a finite set: `label` is the least point of its cycle for a periodic point, else -1."""

    label: Integers
    lost: int
    falling: int

    @property
    def lengths(self) -> tuple[Integers, Integers]:
        """The labels of the cycles and their lengths."""
        labels, lengths = np.unique(self.label[self.label >= 0], return_counts=True)
        return labels, lengths.astype(np.int64)

    def is_seen(self, labels: Integers, first: int) -> NDArray[np.bool_]:
        """Whether each of the cycles with these labels has a point whose number is at least `first`."""
        found: NDArray[np.bool_] = np.isin(labels, self.label[first:])
        return found


def graph_of(image: Integers) -> Graph:
    """The cycles of the map i -> image[i], where -1 stands for no value; `lost` counts those, `falling` who get there.

    >>> graph = graph_of(np.array([1, 0, 0, -1, 3]))
    >>> graph.label.tolist(), graph.lost, graph.falling
    ([0, 0, -1, -1, -1], 1, 1)
    """
    count = len(image)
    power = np.append(np.where(image < 0, count, image), count)  # `count` is the sink
    for _ in range(max(1, count.bit_length())):  # 2^k steps, more than there are points
        power = power[power]
    periodic = np.zeros(count + 1, dtype=bool)
    periodic[power] = True
    periodic[count] = False
    members = np.flatnonzero(periodic)
    place = np.full(count + 1, -1, dtype=np.int64)
    place[members] = np.arange(len(members))
    least, jump = members.copy(), place[image[members]]
    for _ in range(len(members).bit_length()):
        least, jump = np.minimum(least, least[jump]), jump[jump]
    label = np.full(count, -1, dtype=np.int64)
    label[members] = least
    lost = int((image < 0).sum())
    return Graph(label, lost, int((power[:count] == count).sum()) - lost)


def walk_until_back(
    chart: ProjectiveMap, starts: Integers, steps: int, keep_on: Any = None
) -> tuple[Integers, Integers]:
    """For starts in columns: the step at which each comes back, and that after which it has no image; -1 for neither.

    At most `steps` steps are taken; `keep_on`, called before each step with its number, may stop earlier by returning
    False.
    """
    back = np.full(starts.shape[1], -1, dtype=np.int64)
    lost = back.copy()
    lanes, X, home = np.arange(starts.shape[1]), starts, starts
    for step in range(1, steps + 1):
        if len(lanes) == 0 or (keep_on is not None and not keep_on(step)):
            break
        X = chart.images(X)
        gone = ~X.any(axis=0)
        here = (X == home).all(axis=0)
        lost[lanes[gone]] = step - 1
        back[lanes[here]] = step
        stay = ~(gone | here)
        if not stay.all():
            lanes, X, home = lanes[stay], np.ascontiguousarray(X[:, stay]), np.ascontiguousarray(home[:, stay])
    return back, lost


def random_points(chart: ProjectiveMap, count: int, seed: int) -> Integers:
    """Normalised points in columns, drawn with equal chances; the same ones for the same seed."""
    rng = np.random.default_rng(seed)
    X = rng.integers(0, chart.prime, (chart.dim + 1, 2 * count + 20), dtype=np.int64)
    X = X[:, X.any(axis=0)][:, :count]
    return chart.normalised(X)


def hasse_weil(prime: int) -> int:
    """The largest number of points, p + 1 + floor(2 sqrt p), of a curve of genus 1 over GF(p).

    >>> hasse_weil(101)
    122
    """
    return prime + 1 + isqrt(4 * prime)
