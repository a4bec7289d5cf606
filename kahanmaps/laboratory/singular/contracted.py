"""The hypersurfaces that a map contracts, where none of their polynomials is written: as points, by what happens there.

Let M and M' be the matrices of a map F and of its inverse, both linear in the point. A hypersurface that is contracted
goes to where the inverse has no value. So it is a pole, a factor of det M(X), or infinity Z = 0, or a zero of
det M'(F(X)). Of these forms only det M, det M' and their factors over Q are written, which are short. On a random line
modulo a prime their zeros are points. Those that share all orders from the first step on stand for one hypersurface.

What is known along a curve are the orders of forms, each a product of powers of hypersurfaces. The exponents are the
orders at the points themselves, and so linear equations give the orders of the hypersurfaces and their degrees. Where
these do not suffice, as hypersurfaces are zeros of one form, forms are factored on surfaces through the curves.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from typing import Any

from flint import Ordering, fmpq, fmpq_mat, fmpq_mpoly_ctx, nmod_poly

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.algebra.polynomials import evaluate
from kahanmaps.algebra.residues import random_prime
from kahanmaps.errors import BadPrime
from kahanmaps.laboratory.singular.components import Component, Kind, components
from kahanmaps.laboratory.singular.fates import CONFINED, NOT_CONFINED, Hypersurface, Range, orders_at, walked
from kahanmaps.laboratory.singular.jets import Function, Step, form_order, image_of
from kahanmaps.laboratory.singular.orders import Orders
from kahanmaps.maps.equation import Equation
from kahanmaps.maps.implicit import BirationalMap

_MOST_LINES = 24  # modulo primes of their own; they end when two have points of every hypersurface
_FIRST = 12  # steps that tell hypersurfaces apart
_MOST_DIGITS = 1000  # in forms that are factored
_PRECISION = 8  # of the orders at points themselves
_BITS = 31  # of primes: with larger ones python-flint does not order the factors of polynomials in several variables


class Untold(ArithmeticError):
    """Why the orders along the hypersurfaces are not known."""


@dataclass(frozen=True)
class _Forms:
    """The factors over Q of det M, which count at a point, those of det M', which count at its image, and Z."""

    poles: tuple[Any, ...]
    images: tuple[Any, ...]
    infinity: Any

    @property
    def all(self) -> tuple[Any, ...]:
        """The forms in the order of columns; one may stand there twice."""
        return (*self.poles, *self.images, self.infinity)

    @property
    def placed(self) -> list[tuple[Any, bool]]:
        """The same, each with whether it counts at the image."""
        return [(form, k in self.at_images) for k, form in enumerate(self.all)]

    @property
    def at_images(self) -> range:
        """The columns of those that count at the image."""
        return range(len(self.poles), len(self.poles) + len(self.images))


@dataclass(frozen=True)
class _Curve:
    """A curve through a point of a line where a form vanishes, and what is tracked along it.

    `across` is another random vector, for surfaces. `excess` are the exponents of the forms in the common factor of the
    minors of the equation, which is no part of the map, `own` their orders at the point. `solved` turns orders of forms
    into those of hypersurfaces, exactly or not: `exponents` turns them back. Without it `places` say which hypersurface
    it is of which there is a component on surfaces.
    """

    equation: Equation
    point: tuple[int, ...]
    direction: tuple[int, ...]
    across: tuple[int, ...]
    functions: tuple[Function, ...]
    excess: tuple[int, ...]
    own: tuple[int, ...]
    forms: _Forms
    exponents: fmpq_mat | None = None
    solved: fmpq_mat | None = None
    places: dict[Kind, int] = field(default_factory=dict)
    told: dict[int, tuple[int, ...]] = field(default_factory=dict, init=False)

    @property
    def prime(self) -> int:
        """The prime modulo which all is computed."""
        return self.equation.over.characteristic

    @cached_property
    def components(self) -> list[Component]:
        """Those on a random plane through the curve, which is a line."""
        line = [nmod_poly([x, v], self.prime) for x, v in zip(self.point, self.direction, strict=True)]
        return components(self.equation, self.forms.placed, line, self.across)

    @property
    def kind(self) -> Kind:
        """That of the component with the point. Raises Untold."""
        found = [one.kind for one in self.components if one.order != 0]
        if len(found) != 1:
            raise Untold("a point where several critical hypersurfaces meet")
        return found[0]

    def divided(self, run: Sequence[Step]) -> list[int]:
        """The powers of t divided out that belong to the map."""
        before = [self.own, *(step.orders for step in run)]
        return [
            step.common - sum(k * order for k, order in zip(self.excess, orders, strict=True))
            for step, orders in zip(run, before, strict=False)
        ]

    def levels(self, run: Sequence[Step]) -> list[tuple[int, ...]]:
        """The orders of the poles, of the factors of det M'(F(X)), and of Z, at the point and after 1, 2, ... steps."""
        poles, found = len(self.forms.poles), []
        orders = [self.own, *(step.orders for step in run)]
        for mu, here, there in zip(self.divided(run), orders, orders[1:], strict=False):
            images = zip(self.forms.images, there[poles:-1], strict=True)
            found.append((*here[:poles], *(k + mu * int(form.total_degree()) for form, k in images), here[-1]))
        return found

    def rows(self, run: Sequence[Step]) -> tuple[tuple[int, ...], ...]:
        """The rows of `Orders` for steps along the curve but the last. Raises Untold."""
        levels = self.levels(run)[1:]
        return tuple(
            (mu, *(level if self.exponents is None else self._told_apart(t, level, run[t].curve)))
            for t, (mu, level) in enumerate(zip(self.divided(run), levels, strict=False))
        )

    def _told_apart(self, t: int, level: Sequence[int], curve: Sequence[nmod_poly]) -> tuple[int, ...]:
        """The orders of hypersurfaces along the curve after a step, from those of forms. Raises Untold."""
        assert self.exponents is not None
        if not any(level):
            return (0,) * self.exponents.ncols()
        if t not in self.told:
            column = fmpq_mat(len(level), 1, list(level))
            nu = self._on_surface(curve, max(level)) if self.solved is None else self.solved * column
            if self.exponents * nu != column or any(entry.q != 1 or entry < 0 for entry in nu.entries()):
                raise Untold("the orders of hypersurfaces do not follow from those of forms")
            self.told[t] = tuple(int(entry) for entry in nu.entries())
        return self.told[t]

    def _on_surface(self, curve: Sequence[nmod_poly], largest: int) -> fmpq_mat:
        """The orders of hypersurfaces along a curve, by factors on a surface through it. Raises Untold."""
        assert self.exponents is not None
        # As few terms as show the orders, none of which is larger than the `largest` one of forms: often as before.
        terms = 2 + max((max(orders) for orders in self.told.values()), default=1)
        while True:
            cut = [entry.truncate(terms) for entry in curve]
            found = components(self.equation, self.forms.placed, cut, self.across)
            if all(one.order is not None and one.order < terms for one in found):
                break
            if terms > largest:
                raise Untold("the image of a curve lies on a critical hypersurface")
            terms *= 2
        nu = [0] * self.exponents.ncols()
        for one in found:
            if one.kind not in self.places:
                raise Untold("a critical hypersurface of a kind that was not met before")
            nu[self.places[one.kind]] += one.order or 0
        return fmpq_mat(len(nu), 1, nu)


def contracted(map_: BirationalMap, eps: fmpq, rng: random.Random, limits: Range) -> tuple[int, list[Hypersurface]]:
    """The degree of a map on projective space and the hypersurfaces that it contracts, at one exact eps.

    Hypersurfaces of the same orders count as one. The equation of the map and that of its inverse are linear in the
    point. Nothing but points modulo random primes is followed. Where the forms do not suffice to tell the hypersurfaces
    apart, their degrees are 0 and their orders those of the forms. Raises Untold.
    """
    here = map_.at(eps)
    forms = _forms(here.equations[0], here.inverse.equations[0], map_.digits)
    kinds: dict[tuple[Any, ...], list[_Curve]] = {}
    for _ in range(_MOST_LINES):
        if limits.is_over:
            break
        field = GF(random_prime(rng, _BITS))
        try:
            over = map_.at(eps, field)
            functions = tuple(form_order(form, field) for form in forms.all)
        except BadPrime:
            continue
        degree, zeros, curves = _on_line(over.equations[0], forms, functions, field, rng)
        for curve in curves:
            run = walked([curve.equation], curve.point, curve.direction, [], _FIRST, limits.end, functions=functions)[0]
            is_contracted = image_of(over.inverse.equations, run[0].limit) is None
            key = (is_contracted, curve.own[: len(forms.poles)], curve.own[-1], *curve.levels(run)[:1], curve.rows(run))
            kinds.setdefault(key, []).append(curve)
        if all(len({curve.prime for curve in kind}) > 1 for kind in kinds.values()):
            try:
                return degree, _resolved(kinds, forms, degree, zeros, limits)
            except Untold:
                continue  # a hypersurface without points modulo the primes so far
    raise Untold("the contracted hypersurfaces could not be told apart at random points")


def _resolved(
    kinds: dict[tuple[Any, ...], list[_Curve]], forms: _Forms, degree: int, zeros: int, limits: Range
) -> list[Hypersurface]:
    exponents = fmpq_mat([list(key[3]) for key in kinds]).transpose()
    total = [int(form.total_degree()) * (degree if k in forms.at_images else 1) for k, form in enumerate(forms.all)]
    column = fmpq_mat(len(total), 1, total)
    solved, sizes, places = None, fmpq_mat(len(kinds), 1), dict[Kind, int]()
    if exponents.rank() == len(kinds):
        solved = (exponents.transpose() * exponents).inv() * exponents.transpose()
        sizes = solved * column
    elif places := _places(kinds.values()):
        kinds = {
            key: [curve for curve in curves if all(one.kind in places for one in curve.components)]
            for key, curves in kinds.items()
        }
        for one in next((curve.components for curves in kinds.values() for curve in curves), []):
            sizes[places[one.kind], 0] += one.degree
    is_told = solved is not None or bool(places)
    if is_told and (exponents * sizes != column or sum(sizes.entries(), fmpq(0)) != zeros):
        raise Untold("not all hypersurfaces were met")
    # Orders on hypersurfaces that are not contracted have no part in what follows.
    chosen = [k for k, key in enumerate(kinds) if key[0]] if is_told else range(len(total))
    found = []
    for k, (key, curves) in enumerate(kinds.items()):
        if key[0]:
            by_prime = {curve.prime: curve for curve in curves}
            every = [
                orders_at(
                    [curve.equation],
                    curve.point,
                    curve.direction,
                    replace(curve, exponents=exponents if is_told else None, solved=solved, places=places),
                    (_FIRST, limits.reach),
                    limits,
                )
                for curve in list(by_prime.values())[:2]
            ]
            if len({one.known for one in every}) != 1 or len(every) < 2:
                raise Untold("two points tell different things")
            found.append(_hypersurface(key, int(sizes[k, 0]), tuple(by_prime)[:2], every[0].of(chosen)))
    return found


def _places(kinds: Iterable[Sequence[_Curve]]) -> dict[Kind, int]:
    """Of which hypersurface there is a component of each kind; empty where that is not unique. Raises Untold."""
    places = dict[Kind, int]()
    for k, curves in enumerate(kinds):
        if any(places.setdefault(curve.kind, k) != k for curve in curves):
            return {}
    return places


def _hypersurface(key: tuple[Any, ...], degree: int, primes: tuple[int, ...], orders: Orders) -> Hypersurface:
    return Hypersurface(
        "Z" if key[2] else "?",
        degree,
        any(key[1]),
        1,
        CONFINED if any(row[0] for row in orders.rows) else NOT_CONFINED,
        1,
        None,
        (),
        primes,
        followed=orders.followed,
        settled_at=orders.settled_at if orders.is_settled else None,
        orders=orders,
    )


def _forms(equation: Equation, inverse: Equation, digits: int) -> _Forms:
    names = [f"x{k + 1}" for k in range(equation.dim)]
    context = fmpq_mpoly_ctx.get((*names, "z"), Ordering.degrevlex)

    def factors(one: Equation) -> tuple[Any, ...]:
        rows = [
            [context.from_dict({one.exponents[k]: fmpq(value) for k, value in entry}) for entry in row[:-1]] + [None]
            for row in one.terms
        ]
        form = kernel_minors(rows)[-1]
        return (form,) if digits > _MOST_DIGITS else tuple(factor for factor, _ in form.factor()[1])

    infinity = context.gens()[-1]
    poles = tuple(form for form in factors(equation) if form != infinity)
    return _Forms(poles, factors(inverse), infinity)


def _on_line(
    equation: Equation, forms: _Forms, functions: tuple[Function, ...], field: Any, rng: random.Random
) -> tuple[int, int, list[_Curve]]:
    """The degree of the map on a random line, the number of points over the closure where forms vanish, and those in
    GF(p), each with the line as a curve through it."""
    p = field.prime
    a, b = (tuple(rng.randrange(p) for _ in range(equation.dim + 1)) for _ in range(2))
    line = [nmod_poly([x, v], p) for x, v in zip(a, b, strict=True)]
    image = kernel_minors(equation.rows(equation.monomials(line), nmod_poly([], p)))
    common = reduce(nmod_poly.gcd, image)
    image = [entry // common for entry in image]
    degree = max(int(entry.degree()) for entry in image)
    at_points = [evaluate(form, field, line) for form in (*forms.poles, forms.infinity)]
    at_images = [evaluate(form, field, image) for form in forms.images]
    excess = [_exponent(value, common) for value in at_points]
    if sum(k * int(value.degree()) for k, value in zip(excess, at_points, strict=True)) != common.degree():
        raise Untold("the minors of the equation have a common factor of another kind")
    product = reduce(nmod_poly.__mul__, [*at_points, *at_images])
    if product.is_zero():
        raise Untold("the map or its inverse has no value anywhere")
    radical = product // product.gcd(product.derivative())
    *poles, infinity = excess
    curves = []
    for factor, _ in radical.factor()[1]:
        if factor.degree() == 1:
            s = -int(factor[0])
            point = tuple((x + s * v) % p for x, v in zip(a, b, strict=True))
            start = [nmod_poly([x, v], p) for x, v in zip(point, b, strict=True)]
            own = tuple(function(start, _PRECISION) or 0 for function in functions)
            across = tuple(rng.randrange(p) for _ in b)
            every = (*poles, *([0] * len(forms.images)), infinity)
            curves.append(_Curve(equation, point, b, across, functions, every, own, forms))
    return degree, int(radical.degree()), curves


def _exponent(value: nmod_poly, product: nmod_poly) -> int:
    """How often a polynomial divides another one that is not zero."""
    count = 0
    while value.degree() > 0 and (product % value).is_zero():
        product, count = product // value, count + 1
    return count
