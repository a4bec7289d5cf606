"""The dynamical degree of a planar birational map between two bounds, proved: is it more than 1?

A birational map f of the plane acts by an isometry on a hyperbolic space of infinite dimension; e the class of a line,
e . f^n e = deg f^n = D_n. Its translation length is log lambda, lambda the dynamical degree
(boucksom-favre-jonsson-2008, over any algebraically closed field cantat-lamy-2013). For every n

    2 cosh(n log lambda) + 2 >= (D_2n - 1) / (D_n - 1),    and    lambda <= D_n^(1/n).

For u = f^n e - e this says that (f^n u) . u is at most cosh(n log lambda) times u . u in absolute value. Where
lambda = 1 it says D_2n - 1 <= 4 (D_n - 1). The lower bound is computed for f_p, the map modulo a prime p with eps a
residue: deg f_p^n <= deg f^n for every n, so that lambda(f_p) <= lambda(f). For it

* deg f_p^2n is bounded below by the degree along one line, exactly;
* deg f_p^n is bounded above by the degrees along K lines that touch a conic. On a line the degree falls by the
  multiplicities m_i of the base points that lie on it, infinitely near ones included; no point lies on more than two of
  the lines, and 3 (D - 1) is the sum of all m_i for D = deg f_p^n (Noether). With no degree above u that leaves
  K (D - u) <= 6 (D - 1).

Nothing here is random but the choice of p, eps and the conic. docs/mathematics.md has the proofs.
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
from kahanmaps.algebra.work import Budget, count
from kahanmaps.errors import BadPrime, InputError
from kahanmaps.laboratory.defaults import budget_for
from kahanmaps.laboratory.growth.curves import Line, Stopped, reduced
from kahanmaps.laboratory.singular.jets import image_of
from kahanmaps.laboratory.singular.written import forms_over_eps
from kahanmaps.maps.implicit import Map, MapFamily
from kahanmaps.maps.inverse import TooLarge
from kahanmaps.maps.projective import homogeneous_map

_LINES = 96  # that touch a conic
_LARGEST = 8000  # degree along the first line
_MOST_STEPS = 120
_DIGITS = 6
_TRIES = 4
_MOST_WRITTEN = 12  # iterates
_MOST_TERMS = 300  # of a coordinate of the last but one
_MOST_NEXT_TERMS = 4000  # of the last one, which has about degree^2 times as many


@dataclass(frozen=True)
class DynamicalDegreeBounds:
    """Bounds of the dynamical degree of a planar map that are proved, for generic eps or for the eps given.

    `lower` and `upper` are decimal numbers, rounded down and up; the dynamical degree is more than `lower`, for generic
    eps and then for all but finitely many. `lower` is that of the map modulo `prime` at `eps`, a residue, and comes
    from deg f^(2 steps) >= `degree_below`, deg f^steps <= `degree_above`.
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
        """The interval and what gives its lower end."""
        return (
            f"dynamical degree between {self.lower} and {self.upper}: degree of iterate {2 * self.steps} at least "
            f"{self.degree_below}, of iterate {self.steps} at most {self.degree_above}"
        )

    def to_json(self) -> dict[str, Any]:
        """Plain data; the prime and the residue are text, for they exceed what readers of JSON hold exactly."""
        found = attributes(self, "lower", "upper", "steps", "degree_below", "degree_above")
        return {**found, "prime": str(self.prime), "eps_residue": str(self.eps), "text": self.text}


def bound_dynamical_degree(
    map_: MapFamily,
    eps: fmpq | None,
    *,
    seed: int = 0,
    effort: int | Budget = 1,
    progress: Callable[[str], None] = lambda _: None,
) -> DynamicalDegreeBounds | None:
    """Bounds of the dynamical degree of a planar map, the lower one above 1: positive entropy, proved.

    `eps` (half the time step) is exact, or None: then the bounds hold over Q(eps), and for all but finitely many eps.
    Returns None for algebraic coefficients, and where no lower bound above 1 was found within the budget: each
    more of `effort` doubles it. Then nothing is said: there is none for an integrable map.

    Source: docs/mathematics.md.

    >>> from kahanmaps.documents.catalog import load
    >>> found = bound_dynamical_degree(load("lotka_volterra").map, None)
    >>> found.lower, found.upper
    ('1.973638', '2')
    >>> bound_dynamical_degree(load("nahm_tetrahedral").map, None, effort=-6) is None
    True
    """
    if map_.dim != 2 or map_.symbols or map_.root is not None:
        return None
    rng = random.Random(f"enclosure {derive_seed(seed, map_.subject, eps)}")
    budget = budget_for("dynamical degree", effort)
    for _ in range(_TRIES):
        try:
            over = reduced(map_, eps, rng)
            if not is_birational(over, rng):
                continue
            found = _lower(over, rng, budget, progress)
        except (BadPrime, ZeroDivisionError):
            continue
        if found is None:
            return None
        with flint.ctx.workprec(128):  # the least (deg f^n)^(1/n) of the iterates that are written out, rounded up
            roots = [arb(degree).root(n) for n, degree in enumerate(_written_degrees(map_, eps, budget), 1)]
            return replace(found, upper=decimal(min(roots).upper()))
    return None


def is_birational(map_: Map, rng: random.Random) -> bool:
    """Whether a map over GF(p) is birational, proved where the answer is yes.

    It is not where the inverse is not known. Of every factor: the equation of its inverse, at the image of a generic
    point, is to annihilate that point, as forms, and nothing else, which one point shows.
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


def degree_above(largest: int, lines: int) -> int:
    """The largest degree D of a birational map of the plane with no degree above `largest` along so many lines.

    The lines touch a conic, and there are more than six of them. The largest D with lines (D - largest) <= 6 (D - 1).

    >>> degree_above(100, 96), degree_above(1, 96), degree_above(16, 97)
    (106, 1, 16)
    """
    return (lines * largest - 6) // (lines - 6)


def lower_bound(below: int, above: int, steps: int) -> arb | None:
    """The number that the dynamical degree is not less than, if D_2n >= `below` and D_n <= `above`, n = `steps`.

    Returns a ball with it, or None where it is not more than 1: where below - 1 <= 4 (above - 1).

    >>> float(lower_bound(2**20, 2**10, 10)) > 1.99, lower_bound(3 * 99, 99, 7)
    (True, None)
    """
    if above <= 1 or below - 1 <= 4 * (above - 1):
        return None
    with flint.ctx.workprec(128):
        return (arb(fmpq(below - 1, 2 * (above - 1)) - 1).acosh() / steps).exp()


def _lower(
    map_: Map, rng: random.Random, budget: Budget, progress: Callable[[str], None]
) -> DynamicalDegreeBounds | None:
    """The best lower bound above 1, rounded down; there is no upper one yet."""
    line = Line(map_, rng, budget.part(0.5), _LARGEST)
    degrees = [1]
    try:
        while len(degrees) <= _MOST_STEPS:
            line.step(0)
            degrees.append(line.degree)
            progress(f"dynamical degree: iterate {line.steps}, degree {line.degree}")
    except Stopped:
        pass
    candidates = range(1, (len(degrees) - 1) // 2 + 1)
    likely = {n: lower_bound(degrees[2 * n], degree_above(degrees[n], _LINES), n) for n in candidates}
    bounds = {n: float(bound) for n, bound in likely.items() if bound is not None}
    if not bounds:
        return None
    steps = max(bounds, key=bounds.__getitem__)
    largest = 0
    for start in _tangents(map_.field.characteristic, rng):
        tangent = Line(map_, rng, budget, _LARGEST, start)
        try:
            while tangent.steps < steps:
                tangent.step(0)
        except Stopped:
            return None
        largest = max(largest, tangent.degree)
        progress(f"dynamical degree: tangents of a conic, degrees of iterate {steps} up to {largest}")
    above = degree_above(largest, _LINES)
    bound = lower_bound(degrees[2 * steps], above, steps)
    if bound is None:
        return None
    prime, eps = map_.field.characteristic, int(map_.eps)
    return DynamicalDegreeBounds(decimal(bound.lower(), -1), "", steps, degrees[2 * steps], above, prime, eps)


def _tangents(p: int, rng: random.Random) -> list[list[nmod_poly]]:
    """Lines that touch a random conic: those with the coordinates (1 : s : s^2), moved by a random matrix."""
    while True:
        matrix = nmod_mat(3, 3, [rng.randrange(p) for _ in range(9)], p)
        if int(matrix.det()):
            break
    lines = []
    for s in rng.sample(range(p), _LINES):
        # X + s Y + s^2 Z = 0 at (-s - s^2 t : 1 : t)
        points = [nmod_poly([-s, -s * s], p), nmod_poly([1], p), nmod_poly([0, 1], p)]
        zero = nmod_poly([], p)
        lines.append([sum((matrix[i, j] * points[j] for j in range(3)), zero) for i in range(3)])
    return lines


def _written_degrees(map_: MapFamily, eps: fmpq | None, budget: Budget) -> Iterator[int]:
    """The degrees of f, f^2, ... from forms without common factor over Q, or Q[eps], while they are short enough."""
    try:
        forms = forms_over_eps(map_.rows, eps)
    except TooLarge:  # a composition: the product of the degrees of its factors
        equations = map_.at(fmpq(1) if eps is None else eps).equations
        yield prod(2 * equation.degree for equation in equations)
        return
    # Minors of composed rows would have the same forms with a power of their common factor, of a far higher degree.
    ring = forms[0].context()
    *X, symbol = ring.gens()
    degree = max(degree_in(entry, 3) for entry in forms)
    most_terms = min(_MOST_TERMS, _MOST_NEXT_TERMS // max(1, degree) ** 2)
    iterate = list(X)
    for _ in range(_MOST_WRITTEN):
        image = [entry.compose(*iterate, symbol, ctx=ring) for entry in forms]
        count(20 + 10 * sum(map(len, image)))  # with their gcd
        common = reduce(fmpq_mpoly.gcd, image)
        iterate = [entry / common for entry in image]
        yield max(degree_in(entry, 3) for entry in iterate)
        if budget.is_spent or max(map(len, iterate)) > most_terms:
            return


def decimal(end: arb, more: int = 0) -> str:
    """An exact number rounded up to a few decimals, and so many units of the last one more.

    With -1 it is less than the number, not at most: that the dynamical degree is more than it holds for all but
    finitely many eps.
    """
    units = int((end.fmpq() * 10**_DIGITS).ceil()) + more
    text = f"{units // 10**_DIGITS}.{units % 10**_DIGITS:0{_DIGITS}d}"
    return text.rstrip("0").rstrip(".")
