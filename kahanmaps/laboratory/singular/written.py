"""The polynomials of the hypersurfaces that a map, or a factor of a composition, may contract.

An exceptional hypersurface of a composition is the preimage, under the factors applied first, of an exceptional
hypersurface of the next factor. Its polynomial is long, but that for the factor is short. So a curve through the latter
hypersurface is used, and each step applies one factor, beginning with the one that contracts the hypersurface.

For generic eps the Jacobian determinant of the homogeneous map is factored over Q as a polynomial in the point and eps.
By Hilbert's irreducibility theorem its factors stay irreducible at most eps, so that they are the factors there.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from math import comb, prod
from typing import Any

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.algebra.polynomial_work import counted_product, factored
from kahanmaps.algebra.polynomials import degree_in, ring
from kahanmaps.algebra.printing import format_polynomial
from kahanmaps.algebra.work import count_work
from kahanmaps.errors import InputError, counted
from kahanmaps.laboratory.singular.following import StepLimits
from kahanmaps.laboratory.singular.outcomes import Hypersurface, HypersurfaceForm, Tracking, outcome_of
from kahanmaps.maps.composed import ComposedMap
from kahanmaps.maps.equation import Equation
from kahanmaps.maps.implicit import Map, MapFamily
from kahanmaps.maps.inverse import TooLarge
from kahanmaps.maps.projective import HomogeneousMap, homogeneous_map

_MAX_TERMS = 6_000  # maximal number of terms of an expanded Jacobian determinant
_MAX_PRODUCTS = 300_000  # maximal number of products of terms to expand the Jacobian determinant of the affine map


@dataclass(frozen=True)
class Word:
    """The factors of a composition: the `degrees` of the factors of one period, and the number `power` of periods."""

    degrees: tuple[int, ...]
    power: int

    @property
    def length(self) -> int:
        """The number of factors of the composition."""
        return len(self.degrees) * self.power

    @property
    def text(self) -> str:
        """A note that each step applies one factor of the composition."""
        return f"one iterate consists of {counted(self.length, 'map')}: each of these steps applies one of them"


def poles_and_critical_factors(map_: HomogeneousMap) -> tuple[list[HypersurfaceForm], int | None]:
    """Return (poles of a map and irreducible factors of its Jacobian determinant, degree of this determinant). Exact.

    If the determinant is too large, the degree is None, and the list contains only the poles and infinity.
    """
    forms, _, denominator = map_
    forms_by_text: dict[str, HypersurfaceForm] = {}
    for factor, _ in factored(denominator):
        if not is_infinity(factor):
            forms_by_text[str(factor)] = HypersurfaceForm(factor, True, 0)
    if map_.degree <= 1:
        return list(forms_by_text.values()), 0
    critical_degree = len(forms) * (map_.degree - 1)
    critical_factors = _critical_factors(forms, critical_degree)
    if critical_factors is None:
        infinity = forms[0].context().gens()[-1]
        poles = [HypersurfaceForm(form.form, form.divides_denominator, None) for form in forms_by_text.values()]
        return [*poles, HypersurfaceForm(infinity, False, None)], None
    for factor, multiplicity in critical_factors:
        forms_by_text[str(factor)] = HypersurfaceForm(factor, str(factor) in forms_by_text, multiplicity)
    return list(forms_by_text.values()), critical_degree


def followed_forms(
    map_: HomogeneousMap, forms: list[HypersurfaceForm], stage: int = 0
) -> tuple[list[HypersurfaceForm], list[HypersurfaceForm]]:
    """Return the forms whose zeros a map may contract, and the forms in the common factor of its minors."""
    contracted_forms = [replace(form, stage=stage) for form in forms if form.multiplicity]
    minor_factors = [] if map_.factor.is_constant() else factored(map_.factor)
    return contracted_forms, [HypersurfaceForm(factor, False, None, k, stage) for factor, k in minor_factors]


def followed_map_by_map(
    map_: MapFamily, eps: fmpq, rng: random.Random, limits: StepLimits, progress: Callable[[str], None]
) -> tuple[Word, list[Hypersurface]] | None:
    """Return the `Word` of the factors of a composition, and the hypersurfaces that factors contract at one exact eps.

    Steps and limits count single factors. Hypersurfaces for which the budget did not suffice are omitted. Returns None
    if the polynomials of a factor are too large.
    """
    equations = map_.at(eps).equations
    period = period_of(equations)
    maps = [homogeneous_map(factor) for factor in map_.at(eps).factors[:period]]
    forms_by_map = [poles_and_critical_factors(h) for h in maps]
    if any(degree is None for _, degree in forms_by_map):
        return None
    followed_by_map = [
        followed_forms(h, hypersurfaces, k)
        for k, (h, (hypersurfaces, _)) in enumerate(zip(maps, forms_by_map, strict=True))
    ]
    critical_forms = [form for forms, _ in followed_by_map for form in forms]
    of_minors = [form for _, forms in followed_by_map for form in forms]
    limits = replace(limits, first_steps=min(limits.first_steps * period, limits.max_steps))
    hypersurfaces = []
    for stage, (forms, _) in enumerate(forms_by_map):
        for factor in forms:
            if not factor.multiplicity or limits.budget.is_spent:
                continue
            text = name_of(factor.form, map_)
            progress(f"following {text[:40]}")
            hypersurfaces.append(
                outcome_of(map_, eps, factor, text, rng, limits, Tracking(critical_forms, of_minors, stage, period))
            )
    return Word(tuple(h.degree for h in maps), len(equations) // period), hypersurfaces


def is_long(map_: Map) -> bool:
    """Return whether the Jacobian determinant of a composition is too large to expand, if no degree drops."""
    degree = prod(equation.image_degree for equation in map_.equations)
    size = map_.dim + 1
    return len(map_.equations) > 1 and not _is_short(size, size * (degree - 1))


def _is_short(size: int, degree: int) -> bool:
    """Return whether forms of degree `degree` in `size` variables have few enough terms to be expanded."""
    return comb(degree + size - 1, size - 1) <= _MAX_TERMS


def period_of(equations: tuple[Equation, ...]) -> int:
    """Return the least period of a list of equations that divides its length."""
    maps = [(equation.exponents, equation.terms) for equation in equations]
    size = len(maps)
    return next(k for k in range(1, size + 1) if size % k == 0 and maps[k:] == maps[: size - k])


def _critical_factors(forms: list[Any], degree: int) -> list[tuple[Any, int]] | None:
    """Return the irreducible factors of the Jacobian determinant of forms, with exponents; None if it is too large.

    The determinant must be nonzero, of degree `degree`. The ring of the forms may contain symbols after Z.
    """
    size, context = len(forms), forms[0].context()
    zero, infinity = context.constant(0), context.gen(size - 1)
    if _is_short(size, degree):
        rows = [[*(form.derivative(j) for j in range(size)), zero] for form in forms]
        return factored(kernel_minors(rows, counted_product)[-1])
    finite_factors = factors_at_finite_points(forms)
    if finite_factors is None:
        return None
    factors = []
    for factor, k in finite_factors:
        total = degree_in(factor, size)
        terms = {(*m[: size - 1], total - sum(m[:size]), *m[size:]): c for m, c in factor.terms()}
        factors.append((context.from_dict(terms), k))
        degree -= k * total
    return [*factors, (infinity, degree)] if degree else factors


def factors_at_finite_points(forms: list[Any]) -> list[tuple[Any, int]] | None:
    """Return the factors of the Jacobian determinant of forms at Z = 1, with exponents; None if it is too large.

    At Z = 1 the determinant of n + 1 forms F_1, ..., F_n, F_0 of degree d in (X : Z) is d F_0^(n+1) det dy/dx, where
    y_i = F_i/F_0, by Euler's relation. Denominators and contents of the rows of dy/dx are split off as factors before
    the expansion. The ring of the forms may contain symbols after Z.
    """
    n, context = len(forms) - 1, forms[0].context()
    affine_point = [context.constant(1) if k == n else x for k, x in enumerate(context.gens())]
    *numerators, denominator = (form.compose(*affine_point, ctx=context) for form in forms)
    multiplicities: dict[str, tuple[Any, int]] = {}

    def multiply(polynomial: Any, power: int) -> None:
        for factor, k in factored(polynomial):
            _, earlier_power = multiplicities.get(str(factor), (factor, 0))
            multiplicities[str(factor)] = factor, earlier_power + power * k

    multiply(denominator, n + 1)
    rows = []
    for numerator in numerators:
        count_work(10 * (len(numerator) + len(denominator)))
        common_factor = numerator.gcd(denominator)
        P, Q = numerator / common_factor, denominator / common_factor
        row = [counted_product(Q, P.derivative(j)) - counted_product(P, Q.derivative(j)) for j in range(n)]
        count_work(sum(map(len, row)))
        content = reduce(lambda left, right: left.gcd(right), row)
        multiply(Q, -2)
        multiply(content, 1)
        rows.append([*(None if entry.is_zero() else entry / content for entry in row), None])
    product_count = 0

    def require_few(pairs: list[tuple[Any, Any]]) -> None:
        nonlocal product_count
        product_count += sum(len(entry) * len(minor) for entry, minor in pairs)
        if product_count > _MAX_PRODUCTS:
            raise TooLarge("the determinant of the affine map is too large")

    try:
        # Shortest rows first, since minors of the first rows occur in all further products. Another order of rows
        # changes only the sign of the determinant.
        rows.sort(key=lambda row: sum(len(entry) for entry in row if entry is not None))
        determinant = kernel_minors(rows, counted_product, require_few)[-1]
    except TooLarge:
        return None
    if len(determinant) > _MAX_TERMS:
        return None
    multiply(determinant, 1)
    return [(factor, k) for factor, k in multiplicities.values() if k]


def is_infinity(factor: Any) -> bool:
    """Return whether an irreducible form is Z (up to a factor), the form of infinity."""
    return len(factor) == 1 and all(exponent == 0 for exponent in factor.monoms()[0][:-1])


def affine(form: Any, map_: MapFamily) -> str:
    """Return a form at Z = 1, in the variables of the map, as text."""
    context = ring(map_.variables)
    return format_polynomial(context.from_dict({tuple(m)[:-1]: c for m, c in form.terms()}))


def name_of(form: Any, map_: MapFamily) -> str:
    """Return the name of a form in output: its affine polynomial, or Z for infinity."""
    return "Z" if is_infinity(form) else affine(form, map_)


def with_eps(map_: MapFamily, eps: fmpq, hypersurfaces: Sequence[Hypersurface]) -> tuple[Hypersurface, ...]:
    """Add polynomials over Q[eps] (`generic`), if they are known, to hypersurfaces that a map contracts at one eps.

    Exact: at this eps, such a polynomial is a multiple of the polynomial of the hypersurface. It is unknown for
    expanded compositions, if forms are too large, and if its value at this eps is reducible.
    """
    polynomials: dict[int | None, dict[str, str]] = {}  # by stage, then by polynomial at this eps
    result = []
    for hypersurface in hypersurfaces:
        if hypersurface.stage not in polynomials:
            polynomials[hypersurface.stage] = _generic_polynomials(map_, eps, hypersurface.stage)
        generic_text = polynomials[hypersurface.stage].get(hypersurface.polynomial, "")
        result.append(replace(hypersurface, generic=generic_text))
    return tuple(result)


def _generic_polynomials(map_: MapFamily, eps: fmpq, stage: int | None) -> dict[str, str]:
    """Return a dict: values at one eps -> polynomials over Q[eps] of the hypersurfaces that a map may contract."""
    variables = map_.variables
    if map_.symbols or "eps" in variables or "Z" in variables:
        return {}
    if not isinstance(map_, ComposedMap):
        rows = map_.rows
    elif stage is None or any(isinstance(part.map, ComposedMap) or part.values for part in map_.parts):
        return {}
    else:
        try:
            rows = map_.parts[stage].map.inverse_rows if map_.parts[stage].is_inverse else map_.parts[stage].map.rows
        except InputError:
            return {}
    n, ring_at_eps, forms = len(variables), ring((*variables, "Z")), forms_over_eps(rows)
    reduced_degree = max(degree_in(form, n + 1) for form in forms) - 1
    factors = (_critical_factors(forms, (n + 1) * reduced_degree) or []) if reduced_degree > 0 else []
    affine_ring, polynomials_by_name = ring((*variables, "eps")), {}
    for factor, _ in factors:
        if all(sum(m[:n]) == 0 for m in factor.monoms()):  # skip infinity and powers of eps
            continue
        value = factor.compose(*ring_at_eps.gens(), ring_at_eps.constant(eps), ctx=ring_at_eps)
        factors_at_eps = factored(value)
        if len(factors_at_eps) == 1 and factors_at_eps[0][1] == 1:
            text = format_polynomial(affine_ring.from_dict({(*m[:n], m[-1]): c for m, c in factor.terms()}))
            polynomials_by_name[name_of(factors_at_eps[0][0], map_)] = text
    return polynomials_by_name


def forms_over_eps(rows: Sequence[Sequence[fmpq_mpoly]], eps: fmpq | None = None) -> list[fmpq_mpoly]:
    """Return the forms in (X : Z), over Q[eps] or at one eps, of the map whose equation has these rows of polynomials.

    `rows` are polynomials in x and eps. The forms have no common factor; their last variables are Z and eps.
    """
    n = len(rows)
    context = ring((*(f"x{k + 1}" for k in range(n)), "Z", "eps"))
    degree = max(degree_in(entry, n) for row in rows for entry in row)
    *X, eps_variable = context.gens()
    value = eps_variable if eps is None else context.constant(eps)

    def homogenize(entry: fmpq_mpoly) -> fmpq_mpoly:
        terms = {(*m[:n], degree - sum(m[:n]), m[-1]): c for m, c in entry.terms()}
        return context.from_dict(terms).compose(*X, value, ctx=context)

    minors = kernel_minors([[homogenize(entry) for entry in row] for row in rows], counted_product)
    count_work(5 * sum(map(len, minors)))
    common_factor = reduce(fmpq_mpoly.gcd, minors)
    return [minor / common_factor for minor in minors]
