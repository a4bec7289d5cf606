"""The components of a set of points of GF(p)^k: affine subspaces, hypersurfaces in affine subspaces, single points.

The members with a given degree sequence are points of certain varieties outside special subvarieties, and a few further
points by chance. So a candidate for a component is a variety through a few random points of the set. A variety of
dimension d has about p^d points; it is accepted as a component if the set contains most of them.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from flint import Ordering, nmod_mpoly_ctx

from kahanmaps.algebra.modular_matrices import echelon, null_space, pivots
from kahanmaps.algebra.work import count_work
from kahanmaps.laboratory.modular_points import Point, exponents_up_to, monomial_tables

Rows = tuple[tuple[int, ...], ...]

Form = tuple[int, ...]

MAX_DEGREE = 6  # maximal degree of the product of all hypersurfaces with the same degree sequence
_SHARE = 0.5  # minimal share of the points of a component in the set; points on special subvarieties are not in it
_SPARE = 1.2  # number of interpolated points per coefficient of a hypersurface
# Numbers of samples of points. With more than 3 parameters a sample rarely lies on one affine subspace. From degree 3
# on the interpolation of a sample is expensive, and useless if its points lie on two components.
_TRIES, _TRIES_MANY_PARAMETERS, _TRIES_HIGH_DEGREE = 80, 3000, 12
_MAX_PRODUCT_DEGREE = 12  # maximal degree of an interpolated product of hypersurfaces
_MAX_SINGLE_POINTS = 400  # if more points lie on no component, they are not reported as isolated points


@dataclass
class ModularComponents:
    """The components of a set of points modulo `prime`.

    `linear` maps dimensions to affine subspaces, i.e. to reduced rows (c_1, ..., c_k, c_0) of their equations
    c_1 a_1 + ... + c_0 = 0. `hypersurfaces` maps affine subspaces (no rows: the full space) to the irreducible
    hypersurfaces in them, lists of coefficients (in the order of `exponents_up_to`) in free variables of the subspace.
    """

    prime: int
    linear: dict[int, list[Rows]] = field(default_factory=dict)
    hypersurfaces: dict[Rows, list[Form]] = field(default_factory=dict)


def find_components(
    points: Sequence[Point],
    prime: int,
    measured: int,
    min_dimension: int,
    rng: random.Random,
    check: Callable[[], None] = lambda: None,
) -> ModularComponents:
    """Return the components, of dimension `min_dimension` or more, of some points among `measured` points.

    `min_dimension` is 0 if all points of GF(p)^k were measured, and k - 1 if only points on random lines were measured.
    `check` is called repeatedly, and may raise an exception.

    >>> line = [(a, (2 * a + 3) % 31) for a in range(31)]
    >>> components = find_components([*line, (5, 5)], 31, 31**2, 0, random.Random(0))
    >>> components.linear
    {1: [((1, 15, 17),)], 0: [((1, 0, 26), (0, 1, 26))]}
    """
    import numpy as np

    dim = len(points[0])
    components = ModularComponents(prime)
    unassigned = np.array(points, dtype=np.int64)

    def affine_subspaces(dimension: int, min_count: float) -> Iterator[tuple[Rows, Any]]:
        """Yield affine subspaces with at least `min_count` unassigned points, each with a mask of the points in it."""
        for _ in range(_TRIES if dim <= 3 else _TRIES_MANY_PARAMETERS):
            check()
            if len(unassigned) < min_count:
                return
            count_work(10 + len(unassigned) * (dim - dimension) / 100)
            sample = [[*unassigned[i].tolist(), 1] for i in rng.sample(range(len(unassigned)), dimension + 1)]
            rows = null_space(sample, dim + 1, prime)
            if len(rows) == dim - dimension:
                ones = np.ones((len(unassigned), 1), dtype=np.int64)
                is_inside = ~(np.hstack([unassigned, ones]) @ np.array(rows).T % prime).any(axis=1)
                if is_inside.sum() >= min_count:
                    yield tuple(map(tuple, rows)), is_inside

    for dimension in range(dim - 1, max(min_dimension, 1) - 1, -1):
        # First affine subspaces of this dimension, then hypersurfaces in affine subspaces of one dimension more.
        # Dimensions decrease, so that a hyperplane does not appear as many smaller components.
        min_count = max(_SHARE * measured / prime ** (dim - dimension), dimension + 3)
        for rows, mask in affine_subspaces(dimension, min_count):
            components.linear.setdefault(dimension, []).append(rows)
            unassigned = unassigned[~mask]
        if dimension == dim - 1:
            for form, mask in _find_hypersurfaces(unassigned, min_count, prime, rng, check):
                components.hypersurfaces.setdefault((), []).append(form)
                unassigned = unassigned[~mask]
            continue
        for rows, mask in affine_subspaces(dimension + 1, min_count):
            free_indices = [k for k in range(dim) if k not in pivots(rows)]
            indices, is_unassigned = np.flatnonzero(mask), np.ones(len(unassigned), dtype=bool)
            for form, form_mask in _find_hypersurfaces(unassigned[mask][:, free_indices], min_count, prime, rng, check):
                components.hypersurfaces.setdefault(rows, []).append(form)
                is_unassigned[indices[form_mask]] = False
                indices = indices[~form_mask]
            unassigned = unassigned[is_unassigned]
    if not min_dimension and len(unassigned) <= _MAX_SINGLE_POINTS:
        equations = ([[*(int(i == j) for j in range(dim)), -y] for i, y in enumerate(x)] for x in unassigned.tolist())
        single_points = [tuple(map(tuple, echelon(rows, prime))) for rows in equations]
        components.linear.setdefault(0, []).extend(single_points)
    return components


def _find_hypersurfaces(
    points: Any, min_count: float, prime: int, rng: random.Random, check: Callable[[], None]
) -> Iterator[tuple[Form, Any]]:
    """Yield irreducible hypersurfaces on which at least `min_count` points lie, each with a mask of these points.

    The first attempt interpolates more points than there are coefficients, and gives the product of all hypersurfaces.
    Further attempts interpolate as many points as determine a hypersurface; they succeed if all points lie on one.
    """
    dim = points.shape[1]
    context = nmod_mpoly_ctx.get([f"a{k}" for k in range(dim)], modulus=prime, ordering=Ordering.degrevlex)
    for degree in range(2, _MAX_PRODUCT_DEGREE + 1):
        coefficient_count = len(exponents_up_to(dim, degree))
        sample_size = int(_SPARE * coefficient_count) + 2
        table = _evaluate_monomials(points, degree, prime)
        for attempt in range(_TRIES if degree == 2 else _TRIES_HIGH_DEGREE if degree <= MAX_DEGREE else 1):
            check()
            if len(points) < max(sample_size, min_count):
                break
            count_work(coefficient_count * len(points) / 500)
            sample = rng.sample(range(len(points)), coefficient_count - 1 if attempt else sample_size)
            basis = null_space(table[sample].tolist(), coefficient_count, prime)
            if len(basis) > 1 or not basis or (table @ basis[0] % prime == 0).sum() < max(sample_size, min_count):
                continue
            terms = {e: c for e, c in zip(exponents_up_to(dim, degree), basis[0], strict=True) if c}
            count_work(50 + 5 * len(terms))
            for factor, _ in context.from_dict(terms).factor()[1]:
                coefficients = {tuple(map(int, e)): int(c) for e, c in factor.to_dict().items()}
                factor_degree = max(map(sum, coefficients))
                row = [coefficients.get(e, 0) for e in exponents_up_to(dim, factor_degree)]
                scale = pow(next(c for c in row if c), -1, prime)  # the first nonzero coefficient becomes 1
                form = tuple(c * scale % prime for c in row)
                is_inside = _evaluate_monomials(points, factor_degree, prime) @ form % prime == 0
                if is_inside.sum() >= min_count:
                    yield form, is_inside
                    points, table = points[~is_inside], table[~is_inside]


def degree_reached(points: float, count: int) -> int:
    """Return the largest degree, at most 6, of hypersurfaces in `count` variables that `points` points can determine.

    >>> degree_reached(53, 2), degree_reached(11, 2)
    (6, 2)
    """
    coefficient_counts = (len(exponents_up_to(count, degree)) for degree in range(1, MAX_DEGREE + 1))
    return sum(_SPARE * coefficient_count + 2 <= points for coefficient_count in coefficient_counts)


def _evaluate_monomials(points: Any, degree: int, prime: int) -> Any:
    """Return the values modulo a prime of all monomials up to a degree, with one row for each point."""
    import numpy as np

    divisors = monomial_tables(points.shape[1], degree)
    count_work(len(divisors) * (5 + len(points) / 100))
    table = np.ones((len(points), len(divisors)), dtype=np.int64)
    for k, divisors_of_monomial in enumerate(divisors[1:], 1):
        variable, _, index = divisors_of_monomial[-1]
        table[:, k] = table[:, index] * points[:, variable] % prime
    return table
