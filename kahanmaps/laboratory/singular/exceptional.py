"""The exceptional hypersurfaces of a map, represented by points on them and curves through these points.

Let M and M' be the matrices of the equations of a map F and of its inverse, both linear in the point X. The image of a
hypersurface that F contracts lies in the indeterminacy locus of the inverse. So the hypersurface is a pole (a factor of
det M(X) is 0), or infinity (Z = 0), or det M'(F(X)) is 0 on it. Only det M, det M' and their factors over Q are
expanded, since they are short. On a random line modulo a prime, the zeros of these forms are points. Points with the
same multiplicities at all steps are taken to represent one hypersurface.

Along a curve only the orders of forms are known. Each form is a product of powers of equations of hypersurfaces, and
the exponents are the orders of the form at points of the hypersurfaces. So linear equations give the multiplicities and
degrees of the hypersurfaces. These equations do not suffice if several hypersurfaces are zeros of one form over Q. Then
the forms are factored on surfaces through the curves. On a generic ruled surface an irreducible factor of a form stays
irreducible and keeps its degree (Bertini), so that only polynomials of two variables are factored.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from typing import Any

from flint import Ordering, fmpq, fmpq_mat, nmod_mpoly, nmod_mpoly_ctx, nmod_poly

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.algebra.polynomial_work import counted_product, factored, gcd_units
from kahanmaps.algebra.polynomials import evaluate
from kahanmaps.algebra.residues import random_prime
from kahanmaps.algebra.work import count_work
from kahanmaps.errors import BadPrime
from kahanmaps.laboratory.singular.following import AlongCurves, StepLimits, TestCurve, divided_powers
from kahanmaps.laboratory.singular.jets import Function, JetStep, form_order, image_of, modulo, roots_modulo
from kahanmaps.laboratory.singular.outcomes import CONFINED, NOT_CONFINED, POINTS_DIFFER, Hypersurface
from kahanmaps.maps.equation import Equation
from kahanmaps.maps.implicit import ElementaryMap, MapFamily

Kind = tuple[tuple[int, ...], int]  # of a component: its exponents in the forms, and its degree


@dataclass(frozen=True)
class HypersurfaceComponent:
    """A component of the zeros of forms on a surface (t, u): its equation, and the `exponents` of this in the forms.

    `degree` is the degree of the equation in u, `order` its order in t at u = 0 (None if it vanishes for u = 0).
    """

    exponents: tuple[int, ...]
    degree: int
    order: int | None
    equation: nmod_mpoly

    @property
    def kind(self) -> Kind:
        """The exponents and the degree; components are distinguished by them."""
        return self.exponents, self.degree

    def roots(self, t: int) -> list[int]:
        """Return the u in GF(p) for which the point (t, u) lies on the component."""
        p = int(self.equation.context().modulus())
        coefficients = [0] * (self.degree + 1)
        for (i, j), c in self.equation.terms():
            coefficients[j] += int(c) * pow(t, i, p)
        return [int(u) for u, _ in nmod_poly(coefficients, p).roots()]


def components(
    equation: Equation, forms: Sequence[tuple[Any, bool]], curve: Sequence[nmod_poly], direction: Sequence[int]
) -> list[HypersurfaceComponent]:
    """Return the components of the zeros of forms on the surface (t, u) -> curve(t) + u direction, over GF(p).

    `forms` are pairs (form over Q, whether it is evaluated at the image of the point under the map of the equation). If
    `direction` is random, components have the degrees of hypersurfaces. Exact on the surface. Raises BadPrime.
    """
    field = GF(equation.over.characteristic)
    ring = nmod_mpoly_ctx.get(("t", "u"), modulus=field.prime, ordering=Ordering.degrevlex)
    X = [
        ring.from_dict({(k, 0): int(c) for k, c in enumerate(entry.coeffs())}) + ring.gen(1) * w
        for entry, w in zip(curve, direction, strict=True)
    ]
    image = equation.image(X, ring.constant(0), counted_product)
    count_work(2 * sum(map(len, image)))
    common_factor = reduce(nmod_mpoly.gcd, image)
    image = [entry / common_factor for entry in image]
    multiplicities: dict[str, tuple[nmod_mpoly, list[int]]] = {}
    for k, (form, at_image) in enumerate(forms):
        value = modulo(form, field).compose(*(image if at_image else X), ctx=ring)
        for factor, exponent in factored(value):
            _, exponents = multiplicities.setdefault(str(factor), (factor, [0] * len(forms)))
            exponents[k] = exponent
    return [
        HypersurfaceComponent(
            tuple(exponents),
            int(factor.degrees()[1]),
            min((int(power[0]) for power in factor.monoms() if power[1] == 0), default=None),
            factor,
        )
        for factor, exponents in multiplicities.values()
        if factor.degrees()[1]
    ]


_MIN_LINES, _MAX_LINES = 8, 24  # of lines, each modulo its own prime; two must have points of each hypersurface
_MIN_EQUAL_RESULTS = 4  # after so many equal multiplicities for the same orders of forms, they are reused
_DISTINGUISHING_STEPS = 12  # hypersurfaces are distinguished by the multiplicities at so many first steps
_MAX_DIGITS = 1000  # maximal number of digits of the map if its forms are factored
_TRIES = 16  # maximal number of lines t = const on a surface that are searched for a point of a component
_PRECISION = 8  # number of terms of series for the orders before the first step
_BITS = 31  # bits of primes; for larger primes the factors from python-flint have no fixed order


Key = tuple[Any, ...]  # of a hypersurface: contracted or not; orders of the poles, Z and all forms; first rows


class OrbitDataUnknown(ArithmeticError):
    """Raised if the multiplicities of hypersurfaces along orbits cannot be determined."""


@dataclass(frozen=True)
class _Forms:
    """The form Z, the factors of det M, and those of det M', for the matrices M of the map and M' of its inverse."""

    poles: tuple[Any, ...]
    images: tuple[Any, ...]
    infinity: Any

    @property
    def all(self) -> list[tuple[Any, bool]]:
        """Pairs (form, whether it is evaluated at the image), in the order of the columns; a form may occur twice."""
        poles = [(form, False) for form in self.poles]
        return [*poles, *((form, True) for form in self.images), (self.infinity, False)]


@dataclass(frozen=True)
class _Curve:
    """A curve through a point at which a form vanishes, and the functions whose orders are tracked along the curve.

    The curve is the line point + t direction. The random vector `transversal` spans surfaces through the curve. The
    minors of the equation have a common factor, which is not part of the map; `common_exponents` are the exponents of
    the forms in it. `limits` bound the number of steps.
    """

    equation: Equation
    inverse: Equation
    point: tuple[int, ...]
    direction: tuple[int, ...]
    transversal: tuple[int, ...]
    functions: tuple[Function, ...]
    common_exponents: tuple[int, ...]
    forms: _Forms
    limits: StepLimits

    def test_curve(self, tracked: AlongCurves) -> TestCurve:
        """Return this curve as a TestCurve, along which the functions of `tracked` are tracked."""
        return TestCurve([self.equation], self.point, self.direction, self.limits, tracked)

    @property
    def prime(self) -> int:
        """The prime modulo which the curve is computed."""
        return self.equation.over.characteristic

    @cached_property
    def line(self) -> list[nmod_poly]:
        """The curve as polynomials in t."""
        return [nmod_poly([x, v], self.prime) for x, v in zip(self.point, self.direction, strict=True)]

    @cached_property
    def initial_orders(self) -> tuple[int, ...]:
        """The orders of the functions along the curve before the first step."""
        return tuple(function(self.line, _PRECISION) or 0 for function in self.functions)

    @cached_property
    def key(self) -> Key:
        """The key of the hypersurface through the point: whether it is contracted, orders of forms on it, first `rows`.

        Raises OrbitDataUnknown if the first step cannot be computed.
        """
        run = self.test_curve(self).steps(_DISTINGUISHING_STEPS)[0]
        if not run:
            raise OrbitDataUnknown(
                "work limit reached (raise --effort), or a curve touches a hypersurface in too high an order"
            )
        is_contracted = image_of([self.inverse], run[0].limit) is None
        return (
            is_contracted,
            self.initial_orders[: len(self.forms.poles)],
            self.initial_orders[-1],
            *self.form_orders(run)[:1],
            self.rows(run),
        )

    def rows(self, run: Sequence[JetStep]) -> tuple[tuple[int, ...], ...]:
        """Return the rows of `OrbitData` for all steps but the last, with orders of forms instead of hypersurfaces."""
        powers = divided_powers(run, self.initial_orders, self.common_exponents)
        return tuple((mu, *orders) for mu, orders in zip(powers, self.form_orders(run)[1:], strict=False))

    def form_orders(self, run: Sequence[JetStep]) -> list[tuple[int, ...]]:
        """Return the orders of the poles, of the factors of det M'(F(X)), and of Z, before each step of `run`."""
        size, form_orders = len(self.forms.poles), []
        run_orders = [self.initial_orders, *(step.orders for step in run)]
        powers = divided_powers(run, self.initial_orders, self.common_exponents)
        for mu, orders, next_orders in zip(powers, run_orders, run_orders[1:], strict=False):
            images = zip(self.forms.images, next_orders[size:-1], strict=True)
            form_orders.append((*orders[:size], *(k + mu * int(form.total_degree()) for form, k in images), orders[-1]))
        return form_orders

    def components(self, curve: Sequence[nmod_poly]) -> list[HypersurfaceComponent]:
        """Return the components of the zeros of the forms on the surface that `transversal` spans through `curve`."""
        return components(self.equation, self.forms.all, curve, self.transversal)

    def curve_through(self, component: HypersurfaceComponent, curve: Sequence[nmod_poly]) -> _Curve:
        """Return this curve, moved to a point of a component on a surface through `curve`. Raises OrbitDataUnknown."""
        for t in range(1, _TRIES):
            for u in component.roots(t):
                point = tuple(
                    (int(entry(t)) + u * w) % self.prime for entry, w in zip(curve, self.transversal, strict=True)
                )
                return replace(self, point=point)
        raise OrbitDataUnknown("a hypersurface has no point modulo a prime")

    @cached_property
    def components_with_points(self) -> list[tuple[HypersurfaceComponent, _Curve]]:
        """All components on a plane, each with a curve through one of its points; empty if a component has no point."""
        try:
            return [(component, self.curve_through(component, self.line)) for component in self.components(self.line)]
        except OrbitDataUnknown:
            return []


@dataclass(frozen=True)
class _Orders:
    """The orders of hypersurfaces along a curve (the rows of `OrbitData`), computed from the orders of forms.

    The matrix `exponents` has a row for each form and a column for each hypersurface. Its `left_inverse` maps orders of
    forms to orders of hypersurfaces, which are then checked. If the columns are dependent, it is None, and forms are
    factored on surfaces: `keys_of_kind` has the keys of the hypersurfaces with components of a kind. `keys` are all
    keys, in the order of the columns, and `multiplicities` caches the orders of hypersurfaces by step.
    """

    curve: _Curve
    exponents: fmpq_mat
    left_inverse: fmpq_mat | None
    keys: Sequence[Key]
    keys_of_kind: dict[Kind, set[Key]]
    multiplicities: dict[int, fmpq_mat] = field(default_factory=dict)

    @property
    def functions(self) -> tuple[Function, ...]:
        """The functions whose orders are tracked along the curve."""
        return self.curve.functions

    def rows(self, run: Sequence[JetStep]) -> tuple[tuple[int, ...], ...]:
        """Return the rows (mu, orders of hypersurfaces) of all steps except the last. Raises OrbitDataUnknown."""
        rows, powers = [], divided_powers(run, self.curve.initial_orders, self.curve.common_exponents)
        for t, (mu, orders_of_forms) in enumerate(zip(powers, self.curve.form_orders(run)[1:], strict=False)):
            column = fmpq_mat(len(orders_of_forms), 1, list(orders_of_forms))
            if t not in self.multiplicities:
                self.multiplicities[t] = (
                    self._orders_on_surface(column, run[t].curve)
                    if self.left_inverse is None
                    else self.left_inverse * column
                )
            nu = self.multiplicities[t]
            if self.exponents * nu != column or any(entry.q != 1 or entry < 0 for entry in nu.entries()):
                raise OrbitDataUnknown("the multiplicities of hypersurfaces do not follow from the orders of forms")
            rows.append((mu, *(int(entry) for entry in nu.entries())))
        return tuple(rows)

    def _orders_on_surface(self, orders_of_forms: fmpq_mat, curve: Sequence[nmod_poly]) -> fmpq_mat:
        """Return orders of hypersurfaces along a curve, from components on a surface. Raises OrbitDataUnknown."""
        nu, max_order = fmpq_mat(len(self.keys), 1), max(orders_of_forms.entries())
        if max_order == 0:
            return nu
        # Equal orders of forms often come from equal multiplicities. Otherwise try the fewest terms first.
        columns = [column for column in self.multiplicities.values() if self.exponents * column == orders_of_forms]
        if len(columns) >= _MIN_EQUAL_RESULTS and all(column == columns[0] for column in columns):
            return columns[0]
        term_count = 1 + max((int(max(column.entries())) for column in columns), default=1)
        while True:
            truncated_curve = [entry.truncate(term_count) for entry in curve]
            components = self.curve.components(truncated_curve)
            if all(component.order is not None and component.order < term_count for component in components):
                break
            if term_count > max_order:
                raise OrbitDataUnknown("the image of a curve lies on a critical hypersurface")
            term_count *= 2
        for component in components:
            if component.order:
                candidate_keys = self.keys_of_kind.get(component.kind, set())
                key = (
                    next(iter(candidate_keys))
                    if len(candidate_keys) == 1
                    else self.curve.curve_through(component, truncated_curve).key
                )
                if key not in self.keys:
                    raise OrbitDataUnknown("the image of a curve lies in an unknown hypersurface")
                nu[self.keys.index(key), 0] += component.order
        return nu


def exceptional_hypersurfaces(
    map_: MapFamily, eps: fmpq, rng: random.Random, limits: StepLimits
) -> tuple[int, list[Hypersurface]]:
    """Return the degree of a map on projective space and the hypersurfaces that it contracts, at one exact eps.

    Hypersurfaces with the same orders of forms at the first steps count as one. The equations of the map and of its
    inverse must be linear in the point. Orbits of points modulo random primes are computed. If forms do not distinguish
    the hypersurfaces, all degrees are 0, and orders of forms replace orders of hypersurfaces. Raises OrbitDataUnknown.
    """
    map_at_eps = map_.at(eps)

    def determinant_factors(equation: Equation) -> tuple[Any, ...]:
        form = kernel_minors([[*row[:-1], None] for row in equation.polynomials()], counted_product)[-1]
        return (form,) if map_.digits > _MAX_DIGITS else tuple(factor for factor, _ in factored(form))

    infinity = map_at_eps.equations[0].polynomials()[0][0].context().gens()[-1]
    poles = tuple(form for form in determinant_factors(map_at_eps.equations[0]) if form != infinity)
    forms = _Forms(poles, determinant_factors(map_at_eps.inverse.equations[0]), infinity)
    curves_by_key: dict[Key, list[_Curve]] = {}
    for i in range(_MAX_LINES):
        if limits.budget.is_spent:
            break
        field = GF(random_prime(rng, _BITS))
        try:
            map_at_prime = map_.at(eps, field)
            functions = tuple(form_order(form, field) for form, _ in forms.all)
        except BadPrime:
            continue
        degree, zeros, curves = _search_line(map_at_prime.factors[0], forms, functions, limits, rng)
        for curve in curves:
            curves_by_key.setdefault(curve.key, []).append(curve)
        # A hypersurface that splits over an extension of Q may have points in GF(p) only for some primes p.
        if i >= _MIN_LINES and all(len({curve.prime for curve in group}) > 1 for group in curves_by_key.values()):
            curves_by_key = dict(sorted(curves_by_key.items()))  # the order must not depend on random choices
            try:
                return degree, _find_patterns(curves_by_key, forms, degree, zeros)
            except OrbitDataUnknown:
                continue  # some hypersurface may have no points modulo the primes so far
    if limits.budget.is_spent or any(len({curve.prime for curve in group}) < 2 for group in curves_by_key.values()):
        raise OrbitDataUnknown("the exceptional hypersurfaces could not be distinguished by random points")
    curves_with_functions: dict[Key, list[tuple[_Curve, AlongCurves]]] = {
        key: [(curve, curve) for curve in curves] for key, curves in curves_by_key.items()
    }
    return degree, _follow(curves_with_functions, [0] * len(curves_by_key), range(len(forms.all)))


def _find_patterns(
    curves_by_key: dict[Key, list[_Curve]], forms: _Forms, degree: int, zeros: int
) -> list[Hypersurface]:
    """Return the exceptional hypersurfaces. Raises OrbitDataUnknown, e.g. if the sum of all degrees is not `zeros`."""
    keys = list(curves_by_key)
    exponents = fmpq_mat([list(key[3]) for key in keys]).transpose()
    form_degrees = [int(form.total_degree()) * (degree if at_image else 1) for form, at_image in forms.all]
    total_degrees, degrees = fmpq_mat(len(form_degrees), 1, form_degrees), fmpq_mat(len(keys), 1)
    pairs: dict[Key, list[tuple[_Curve, AlongCurves]]] = {key: [] for key in keys}
    if exponents.rank() == len(keys):
        left_inverse = (exponents.transpose() * exponents).inv() * exponents.transpose()
        degrees = left_inverse * total_degrees
        for key, curves in curves_by_key.items():
            pairs[key] = [(curve, _Orders(curve, exponents, left_inverse, keys, {})) for curve in curves]
    else:
        lines = {curve.prime: curve for curves in curves_by_key.values() for curve in curves}
        planes = [line.components_with_points for line in lines.values() if line.components_with_points]
        for components_with_points in planes[:2]:
            keys_of_kind: dict[Kind, set[Key]] = {}
            degrees = fmpq_mat(len(keys), 1)
            for component, curve in components_with_points:
                if curve.key not in curves_by_key:
                    raise OrbitDataUnknown("the image of a curve lies in an unknown hypersurface")
                keys_of_kind.setdefault(component.kind, set()).add(curve.key)
                degrees[keys.index(curve.key), 0] += component.degree
                pairs[curve.key].append((curve, _Orders(curve, exponents, None, keys, keys_of_kind)))
    if exponents * degrees != total_degrees or sum(degrees.entries(), fmpq(0)) != zeros:
        raise OrbitDataUnknown("some hypersurfaces have no point on the random lines")
    # Only the orders of contracted hypersurfaces are needed.
    columns = [k for k, key in enumerate(keys) if key[0]]
    return _follow(pairs, [int(degree) for degree in degrees.entries()], columns)


def _follow(
    curves: dict[Key, list[tuple[_Curve, AlongCurves]]], degrees: Sequence[int], columns: Sequence[int]
) -> list[Hypersurface]:
    """Return the exceptional hypersurfaces; their patterns have these columns, and must agree modulo two primes."""
    hypersurfaces = []
    for degree, (key, curves_with_functions) in zip(degrees, curves.items(), strict=True):
        if key[0]:
            by_prime = {curve.prime: (curve, tracked) for curve, tracked in curves_with_functions}
            patterns = [
                curve.test_curve(tracked).orbit_data(_DISTINGUISHING_STEPS)
                for curve, tracked in list(by_prime.values())[:2]
            ]
            if len(patterns) < 2:
                raise OrbitDataUnknown("a hypersurface has points modulo one prime only")
            if patterns[0].compared != patterns[1].compared:
                raise OrbitDataUnknown(POINTS_DIFFER)
            orbit_data = patterns[0].of(columns)
            status = CONFINED if any(row[0] for row in orbit_data.rows) else NOT_CONFINED
            hypersurface = Hypersurface(
                "Z" if key[2] else "?", degree, any(key[1]), 1, status, 1, orbit_data=orbit_data
            )
            settled_at = orbit_data.settled_at if orbit_data.is_settled else None
            hypersurfaces.append(
                replace(hypersurface, primes=tuple(by_prime)[:2], followed=orbit_data.followed, settled_at=settled_at)
            )
    return hypersurfaces


def _search_line(
    map_: ElementaryMap, forms: _Forms, functions: tuple[Function, ...], limits: StepLimits, rng: random.Random
) -> tuple[int, int, list[_Curve]]:
    """Return (degree of the image of a random line, number of zeros of the forms on the line, curves).

    Zeros are counted over the algebraic closure of GF(p). For each zero in GF(p) there is a curve.
    """
    equation, p = map_.equation, map_.field.characteristic
    base, direction, transversal = (tuple(rng.randrange(p) for _ in range(equation.dim + 1)) for _ in range(3))
    line = [nmod_poly([x, v], p) for x, v in zip(base, direction, strict=True)]
    image = equation.image(line, nmod_poly([], p), counted_product)
    count_work(sum(gcd_units(len(entry)) for entry in image))
    common_factor = reduce(nmod_poly.gcd, image)
    image = [entry // common_factor for entry in image]
    degree = max(int(entry.degree()) for entry in image)
    values = [evaluate(form, map_.field, line) for form in (*forms.poles, forms.infinity)]
    image_values = [evaluate(form, map_.field, image) for form in forms.images]
    point_exponents = []  # the exponent of each form in the common factor of the minors
    for value in values:
        quotient, exponent = common_factor, 0
        while value.degree() > 0 and (quotient % value).is_zero():
            quotient, exponent = quotient // value, exponent + 1
        point_exponents.append(exponent)
    if sum(k * int(value.degree()) for k, value in zip(point_exponents, values, strict=True)) != common_factor.degree():
        raise OrbitDataUnknown("the minors of the equation have a common factor of another kind")
    product = reduce(nmod_poly.__mul__, [*values, *image_values])
    if product.is_zero():
        raise OrbitDataUnknown("the map or its inverse is defined nowhere")
    radical = product // product.gcd(product.derivative())
    common_exponents = (*point_exponents[:-1], *([0] * len(forms.images)), point_exponents[-1])
    points = [tuple((x + s * v) % p for x, v in zip(base, direction, strict=True)) for s in roots_modulo(radical)]
    (inverse,) = map_.inverse.equations
    curves = [
        _Curve(equation, inverse, point, direction, transversal, functions, common_exponents, forms, limits)
        for point in points
    ]
    return degree, int(radical.degree()), curves
