"""Proved lower and upper bounds of the dynamical degree of a planar birational map.

A birational map f of the plane acts by an isometry on a hyperbolic space of infinite dimension. The class e of a line
satisfies e . f^n e = deg f^n = D_n. The translation length of the isometry is log lambda, where lambda is the dynamical
degree (boucksom-favre-jonsson-2008; cantat-lamy-2013 over any algebraically closed field). For every n

    2 cosh(n log lambda) + 2 >= (D_2n - 1) / (D_n - 1),    and    lambda <= D_n^(1/n).

The first inequality is |(f^n u) . u| <= cosh(n log lambda) |u . u| for u = f^n e - e. For lambda = 1 it becomes
D_2n - 1 <= 4 (D_n - 1). The lower bound is computed for f_p, the map f modulo a prime p at a residue eps. It holds for
f as well: deg f_p^n <= deg f^n for every n, and so lambda(f_p) <= lambda(f). For f_p

* the degree of the image of one line under f_p^2n, computed exactly, is a lower bound of deg f_p^2n;
* the degrees of the images of K tangents of a conic under f_p^n give an upper bound of D = deg f_p^n. The degree of the
  image of a line is D minus the sum of the multiplicities m_i of the base points on the line, including infinitely near
  ones. No point lies on more than two tangents, and the sum of all m_i is 3 (D - 1) (Noether). So if all degrees for
  the tangents are at most d, then K (D - d) <= 6 (D - 1).

Only p, the residue eps, the line and the conic are random; the bounds hold for any choice. Proofs: docs/mathematics.md.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import reduce
from math import prod
from typing import Any

import flint
from flint import arb, fmpq, fmpq_mpoly, nmod_mat, nmod_poly

from kahanmaps.algebra.chance import derive_seed
from kahanmaps.algebra.polynomials import degree_in
from kahanmaps.algebra.printing import attributes
from kahanmaps.algebra.work import Budget, count_work
from kahanmaps.display_protocols import ResultPart
from kahanmaps.errors import BadPrime, InputError
from kahanmaps.laboratory.defaults import budget_for
from kahanmaps.laboratory.growth.curves import Line, Stopped, reduce_map
from kahanmaps.laboratory.singular.jets import image_of
from kahanmaps.laboratory.singular.written import forms_over_eps
from kahanmaps.maps.implicit import Map, MapFamily
from kahanmaps.maps.inverse import TooLarge
from kahanmaps.maps.projective import homogeneous_map

_TANGENTS = 96  # number of tangents of the conic
_MAX_DEGREE = 8000  # maximal degree of the image of a line
_MAX_STEPS = 120  # maximal number of steps of the first line
_DIGITS = 6  # number of decimals of the bounds
_TRIES = 4  # number of tried pairs of a prime p and a residue eps
_MAX_FORMULAS = 12  # maximal number of iterates whose formulas are computed
_MAX_TERMS = 300  # maximal number of terms of a coordinate of an iterate that is composed once more
_MAX_NEXT_TERMS = 4000  # maximal number of terms of a coordinate of the last iterate


@dataclass(frozen=True)
class DynamicalDegreeBounds(ResultPart):
    """Proved bounds of the dynamical degree of a planar map, for the given eps or for all but finitely many eps.

    `lower` and `upper` are decimal numbers, rounded down and up; the dynamical degree exceeds `lower`. This lower bound
    is computed for the reduction f of the map modulo `prime` at the residue `eps`. It follows from deg f^(2 steps) >=
    `degree_below` and deg f^steps <= `degree_above`.
    """

    lower: str
    upper: str
    steps: int
    degree_below: int
    degree_above: int
    prime: int
    eps: int

    @property
    def text(self) -> str:
        """The two bounds, and the degrees from which the lower bound follows, as a phrase."""
        return (
            f"dynamical degree between {self.lower} and {self.upper}: degree of iterate {2 * self.steps} at least "
            f"{self.degree_below}, of iterate {self.steps} at most {self.degree_above}"
        )

    def to_json(self) -> dict[str, Any]:
        """Return plain data; `prime` and `eps` are text, since many JSON readers do not read such integers exactly."""
        bounds = attributes(self, "lower", "upper", "steps", "degree_below", "degree_above")
        return {**bounds, "prime": str(self.prime), "eps_residue": str(self.eps), "text": self.text}


def bound_dynamical_degree(
    map_: MapFamily,
    eps: fmpq | None,
    *,
    seed: int = 0,
    effort: int | Budget = 1,
    progress: Callable[[str], None] = lambda _: None,
) -> DynamicalDegreeBounds | None:
    """Search for proved bounds of the dynamical degree of a planar map, with a lower bound above 1 (positive entropy).

    `eps` (half the time step) is exact; with None the bounds hold over Q(eps), and for all but finitely many eps. Each
    increase of `effort` by 1 doubles the work limit. Returns None for algebraic coefficients, and if no lower bound
    above 1 is obtained within the work limit. The result None proves nothing. An integrable map has no such bound.

    Source: docs/mathematics.md.

    >>> from kahanmaps.documents.catalog import load
    >>> result = bound_dynamical_degree(load("lotka_volterra").map, None)
    >>> result.lower, result.upper
    ('1.973638', '2')
    >>> bound_dynamical_degree(load("nahm_tetrahedral").map, None, effort=-6) is None
    True
    """
    if map_.dim != 2 or map_.symbols or map_.root is not None:
        return None
    rng = random.Random(f"enclosure {derive_seed(seed, map_.seed_data, eps)}")
    budget = budget_for("dynamical degree", effort)
    for _ in range(_TRIES):
        try:
            modular_map = reduce_map(map_, eps, rng)
            if not is_birational(modular_map, rng):
                continue
            bounds = _search_lower_bound(modular_map, rng, budget, progress)
        except (BadPrime, ZeroDivisionError):
            continue
        if bounds is None:
            return None
        with flint.ctx.workprec(128):  # the least of the upper bounds (deg f^n)^(1/n), rounded up
            upper_bounds = [arb(degree).root(n) for n, degree in enumerate(_degrees_of_formulas(map_, eps, budget), 1)]
            return replace(bounds, upper=round_up(min(upper_bounds).upper()))
    return None


def is_birational(map_: Map, rng: random.Random) -> bool:
    """Return whether a map over GF(p) is birational; the answer True is proved.

    The answer is also False if the inverse of the map is not known. For every factor x -> x~ two conditions are tested:
    x solves the equation of the inverse at x~ (as an identity of forms), and uniquely so (at one random point).
    """
    for factor in map_.factors:
        try:
            forms = homogeneous_map(factor).forms
            (inverse,) = factor.inverse.equations
        except InputError:
            return False
        X, zero = forms[0].context().gens(), forms[0] * 0
        rows = inverse.rows(inverse.monomials(forms), zero)
        if any(not sum((entry * x for entry, x in zip(row, X, strict=True)), zero).is_zero() for row in rows):
            return False
        image = image_of([factor.equation], [rng.randrange(factor.field.characteristic) for _ in X])
        if image is None or image_of([inverse], image) is None:
            return False
    return True


def degree_above(max_line_degree: int, line_count: int) -> int:
    """Bound the degree D of a planar birational map by the degrees of the images of `line_count` tangents of a conic.

    Returns the largest D with line_count (D - max_line_degree) <= 6 (D - 1); line_count must be above 6.

    >>> degree_above(100, 96), degree_above(1, 96), degree_above(16, 97)
    (106, 1, 16)
    """
    return (line_count * max_line_degree - 6) // (line_count - 6)


def lower_bound(lower: int, upper: int, steps: int) -> arb | None:
    """Bound the dynamical degree of f from below, given deg f^(2n) >= `lower` and deg f^n <= `upper` for n = `steps`.

    Returns a ball that contains the bound, or None if the bound is at most 1, i.e. if lower - 1 <= 4 (upper - 1).

    >>> float(lower_bound(2**20, 2**10, 10)) > 1.99, lower_bound(3 * 99, 99, 7)
    (True, None)
    """
    if upper <= 1 or lower - 1 <= 4 * (upper - 1):
        return None
    with flint.ctx.workprec(128):
        return (arb(fmpq(lower - 1, 2 * (upper - 1)) - 1).acosh() / steps).exp()


def _search_lower_bound(
    map_: Map, rng: random.Random, budget: Budget, progress: Callable[[str], None]
) -> DynamicalDegreeBounds | None:
    """Return the best lower bound above 1, rounded down, with an empty `upper`; None without such a bound."""
    line = Line(map_, rng, budget.part(0.5), _MAX_DEGREE)
    degrees = [1]
    try:
        while len(degrees) <= _MAX_STEPS:
            line.step(0)
            degrees.append(line.degree)
            progress(f"dynamical degree: iterate {line.steps}, degree {line.degree}")
    except Stopped:
        pass
    candidates = range(1, (len(degrees) - 1) // 2 + 1)
    expected_bounds = {n: lower_bound(degrees[2 * n], degree_above(degrees[n], _TANGENTS), n) for n in candidates}
    bounds = {n: float(bound) for n, bound in expected_bounds.items() if bound is not None}
    if not bounds:
        return None
    # Images of tangents are expensive: they are computed only for the number of steps with the best expected bound.
    steps = max(bounds, key=bounds.__getitem__)
    # Tangents of a random conic: the lines X + s Y + s^2 Z = 0 for random s, transformed by a random matrix.
    p, max_tangent_degree = map_.field.characteristic, 0
    matrix = nmod_mat(3, 3, p)
    while not int(matrix.det()):
        matrix = nmod_mat(3, 3, [rng.randrange(p) for _ in range(9)], p)
    for s in rng.sample(range(p), _TANGENTS):
        # the points (-s - s^2 t : 1 : t) of this line
        points, zero = [nmod_poly([-s, -s * s], p), nmod_poly([1], p), nmod_poly([0, 1], p)], nmod_poly([], p)
        start = [sum((matrix[i, j] * points[j] for j in range(3)), zero) for i in range(3)]
        tangent = Line(map_, rng, budget, _MAX_DEGREE, start)
        try:
            while tangent.steps < steps:
                tangent.step(0)
        except Stopped:
            return None
        max_tangent_degree = max(max_tangent_degree, tangent.degree)
        progress(f"dynamical degree: tangents of a conic, degrees of iterate {steps} up to {max_tangent_degree}")
    upper = degree_above(max_tangent_degree, _TANGENTS)
    bound = lower_bound(degrees[2 * steps], upper, steps)
    if bound is None:
        return None
    return DynamicalDegreeBounds(round_up(bound.lower(), -1), "", steps, degrees[2 * steps], upper, p, int(map_.eps))


def _degrees_of_formulas(map_: MapFamily, eps: fmpq | None, budget: Budget) -> Iterator[int]:
    """Yield deg f, deg f^2, ... of the map f, from formulas over Q or Q[eps], until the formulas are too long."""
    try:
        forms = forms_over_eps(map_.rows, eps)
    except TooLarge:  # too large for forms: bound the degree by those of the factors
        equations = map_.at(fmpq(1) if eps is None else eps).equations
        yield prod(2 * equation.degree for equation in equations)
        return
    # The forms of f are composed; minors of composed equations would have large common factors.
    ring = forms[0].context()
    *X, eps_variable = ring.gens()
    degree = max(degree_in(form, 3) for form in forms)
    max_terms = min(_MAX_TERMS, _MAX_NEXT_TERMS // max(1, degree) ** 2)
    iterate = list(X)
    for _ in range(_MAX_FORMULAS):
        image = [form.compose(*iterate, eps_variable, ctx=ring) for form in forms]
        count_work(20 + 10 * sum(map(len, image)))  # includes the work of the gcd
        common_factor = reduce(fmpq_mpoly.gcd, image)
        iterate = [form / common_factor for form in image]
        yield max(degree_in(form, 3) for form in iterate)
        if budget.is_spent or max(map(len, iterate)) > max_terms:
            return


def round_up(number: arb, offset: int = 0) -> str:
    """Round a number (an arb of radius 0) up to six decimals, and add `offset` units of the last decimal.

    With offset -1 the result is strictly less than the number. Then, if the number is a lower bound of the dynamical
    degree over Q(eps), the dynamical degree exceeds the result for all but finitely many eps.
    """
    units = int((number.fmpq() * 10**_DIGITS).ceil()) + offset
    text = f"{units // 10**_DIGITS}.{units % 10**_DIGITS:0{_DIGITS}d}"
    return text.rstrip("0").rstrip(".")
