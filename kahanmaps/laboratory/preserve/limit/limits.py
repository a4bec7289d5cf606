"""Limits of integrals of a map as eps -> 0: the integrals of its flow that the map conserves, deforms or loses.

An integral of a map x + 2 eps f(x) + ... has an expansion eps^v (I_0 + eps^k I_1 + ...). Its leading term I_0 is an
integral of the flow: f . grad I_0 = 0. Let I, J, ... be integrals with v = 0 whose leading terms satisfy a polynomial
relation R(I_0, J_0, ...) = 0. Then the integral R(I, J, ...) of the map tends to 0 with eps. Divided by a power of eps
it replaces I. (If I_0 is constant, R contains only I.) If all integrals of the map are functions of integrals with
independent leading terms, then an integral of the flow that is not a function of these leading terms is not a limit of
integrals of the map.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import permutations
from math import prod
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.functions import BudgetExceeded, Function, FunctionField
from kahanmaps.algebra.matrices import nullspace
from kahanmaps.algebra.parsing import wrong_kind
from kahanmaps.algebra.polynomials import (
    RationalFunction,
    degree_in,
    evaluate,
    irreducible_factors,
    primitive_part,
    ring,
)
from kahanmaps.algebra.printing import attributes, format_factored, format_polynomial
from kahanmaps.algebra.work import SPENT, Budget
from kahanmaps.checks.claims import Certainty
from kahanmaps.errors import KahanmapsError, counted
from kahanmaps.laboratory.defaults import budget_for
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.modular_points import IndependentGradients, exponents_up_to
from kahanmaps.laboratory.preserve.darboux.affine_functions import darboux_cofactor
from kahanmaps.laboratory.preserve.densities import DensitySearch, FoundDensity, densities_of
from kahanmaps.laboratory.preserve.integrals import FoundIntegral, IntegralSearch, integrals_of
from kahanmaps.maps.implicit import ImplicitMap
from kahanmaps.maps.kahan import KahanFamily

_BUDGET = 2_000_000  # products of terms, for the arithmetic with integrals
_MAX_ROUNDS = 5  # combinations of an integral with other integrals
_MAX_UNKNOWNS = 60  # coefficients of a relation between leading terms
_SHOWN_TERMS, _SHOWN_TERMS_SECOND = 100, 12  # monomials of an integral of the flow, and of the second term of a series
_DENSITY_DEGREE = 4  # the largest degree of the densities of the flow that are searched for
_MAX_DEGREE = {1: 1, 2: 10, 3: 6, 4: 4}  # of relations along solutions, by dimension; 3 in higher dimension


@dataclass(frozen=True)
class Limit:
    """An integral of the flow that the map conserves or deforms: `combination` = `leading` + eps^order `second` + ....

    `combination` is a function of eps and of the names of integrals of the map; `second` is None if the series has no
    further term. f . grad leading = 0 is proved; `conserved` is the verdict on `leading` being an integral of the map.
    A phase point of a polarized map consists of several successive points. Then `on_solutions` is True, and `leading`
    is the leading term for points of one solution of the differential equation; further terms are not computed.
    """

    name: str
    combination: str
    leading: RationalFunction
    order: int
    second: RationalFunction | None
    conserved: Certainty
    on_solutions: bool = False

    @property
    def text(self) -> str:
        """A sentence on the integral of the flow: whether the map conserves or deforms it."""
        clause = "one of the map tends to"
        if self.conserved.holds or self.conserved is Certainty.REFUTED:
            clause = f"the map conserves ({self.conserved})" if self.conserved.holds else "the map deforms"
        series = f"{self.combination} {'tends to' if self.on_solutions else '='} {self.name}"
        series += " at successive points of one solution" * self.on_solutions
        if self.second is not None:
            eps_power = "eps" if self.order == 1 else f"eps^{self.order}"
            series += f" + {eps_power}*({_short_text(self.second, _SHOWN_TERMS_SECOND)}) + ..."
        formula = _short_text(self.leading, _SHOWN_TERMS)
        return f"{self.name} = {formula} is an integral of the flow that {clause}: {series}"

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        second = None if self.second is None else format_factored(self.second)
        fields = attributes(self, "name", "combination", "order", "conserved")
        return {**fields, "leading": format_factored(self.leading), "second": second}


@dataclass(frozen=True)
class FlowAndMap:
    """A comparison of the integrals of a flow with those of its Kahan map, or of a polarized map.

    The known integrals of the flow are `limits`, to which integrals of the map tend, and `other_integrals`; together
    they are independent. The map has `count` integrals; for `without_limit` of them no limit is known. `search` is the
    search for integrals of the flow, or None if there are already as many limits as possible. `density` is a density of
    the flow; `density_search` is the search for densities, or None if `density` is the limit of a density of the map.
    `polynomials` are the known Darboux polynomials of the flow of degree above 1 that are not integrals. Up to
    `polynomials_degree` there are no others (measured; 0: no search). `polynomials_reason`: why higher ones are open.
    """

    limits: tuple[Limit, ...]
    other_integrals: tuple[FoundIntegral, ...]
    without_limit: int
    count: int
    map_search: IntegralSearch
    search: IntegralSearch | None
    density: FoundDensity | None
    density_search: DensitySearch | None
    polynomials: tuple[fmpq_mpoly, ...]
    polynomials_degree: int
    polynomials_reason: str = ""

    @property
    def reason(self) -> str:
        """The reason why no density of the flow is known; empty if one is known."""
        return "" if self.density_search is None else self.density_search.reason

    @property
    def lost(self) -> int:
        """A lower bound (measured) of the number of `other_integrals` that are not limits of integrals of the map."""
        profile = self.map_search.profile
        return max(0, len(self.other_integrals) - self.without_limit) if profile.nullities and profile.maps_agree else 0

    def __str__(self) -> str:
        return "\n".join("\t".join(line) for line in self.lines())

    def lines(self, *, others: bool = True) -> list[tuple[str, str]]:
        """Return statements as pairs (certainty, sentence); if `others`, also the formulas of `other_integrals`."""
        statements = [("proved", limit.text) for limit in self.limits]
        for F in self.other_integrals if others else ():
            statements.append((str(F.verdict), f"{F.name} = {F.short_text} is an integral of the flow  [{F.origin}]"))
        names = ", ".join(F.name for F in self.other_integrals)
        count_text = counted(self.count, "integral") if self.count else "no integral"
        count_text += " free of n" * bool(self.map_search.time_dependent)  # time-dependent ones contain the step n
        if self.lost:
            lost_names = names if self.lost == len(self.other_integrals) else f"at least {self.lost} of {names}"
            count_text += f", with limits independent of {names}" if self.count else ""
            verb, degree = "is" if self.lost == 1 else "are", self.map_search.profile.degree
            statements.append(
                ("measured", f"{lost_names} {verb} lost up to degree {degree}: the map shows {count_text}")
            )
        if self.lost < len(self.other_integrals):
            missing_text = f"the limits of {counted(self.without_limit, 'integral')} are not known"
            reason = missing_text if self.without_limit else "its integrals were not counted"
            statements.append(("undecided", f"what the map makes of {names}: {reason}"))
        missing_count = (
            0 if self.search is None else self.search.codimension - len(self.limits) - len(self.other_integrals)
        )
        if self.search is not None and missing_count > 0:
            counted_text = counted(self.search.codimension, "independent integral")
            statements.append(
                ("measured", f"solutions show {counted_text} of the flow, {missing_count} without a formula")
            )
        elif self.search is not None and self.search.profile.nullities and not self.search.is_exact:
            other_text = "other " * bool(self.limits or self.other_integrals)
            scope = f"relations along solutions up to degree {self.search.profile.degree}"
            statements.append(("measured", f"no {other_text}rational integral of the flow shows in {scope}"))
        if self.search is not None and self.search.profile.stop_reason == SPENT:
            scope = f"relations of degree {self.search.profile.degree + 1} and more along solutions were not tried"
            statements.append(("undecided", f"of the flow: {scope}: {SPENT}"))
        if self.density is not None:
            statements.append((str(self.density.verdict), f"the flow preserves dx/phi, phi = {self.density.text}"))
        elif self.density_search is not None and self.reason:
            certainty = "measured" if self.density_search.shows_none else "undecided"
            statements.append((certainty, f"of the flow: {self.reason}"))
        if self.polynomials:
            formulas = ", ".join(map(format_polynomial, self.polynomials))
            statements.append(("proved", f"Darboux polynomials of the flow, apart from affine ones: {formulas}"))
        for time_dependent in self.search.time_dependent if others and self.search is not None else ():
            text = f"{time_dependent.name} = {time_dependent.text} is a time-dependent integral of the flow"
            statements.append((str(time_dependent.integral.verdict), text))
        if self.polynomials_degree > 1:
            other_text, exception = ("other ", "except") if self.polynomials else ("", "other than affine ones and")
            scope = f"of the flow of degree <= {self.polynomials_degree} were found"
            statements.append(
                ("measured", f"no {other_text}Darboux polynomials {scope} {exception} factors of known integrals")
            )
        if self.polynomials_reason:
            subject_text = f"Darboux polynomials of the flow of degree {self.polynomials_degree + 1}"
            statements.append(("undecided", f"{subject_text}: {self.polynomials_reason}"))
        return statements

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            **attributes(self, "limits", "other_integrals", "lost", "without_limit", "density", "reason"),
            **attributes(self, "polynomials", "polynomials_degree", "polynomials_reason"),
            "degree": None if self.search is None else self.search.profile.degree,
        }


def _short_text(function: RationalFunction, max_terms: int) -> str:
    """Return the formula, or the numbers of terms of numerator and denominator if there are more than `max_terms`."""
    counts = len(function.numerator), len(function.denominator)
    return format_factored(function) if sum(counts) <= max_terms else f"P/Q with {counts[0]} and {counts[1]} terms"


def flow_and_map(
    search: IntegralSearch,
    densities: DensitySearch | None = None,
    flow: IntegralSearch | None = None,
    *,
    known: int = 0,
    effort: int | Budget = 1,
    progress: Callable[[str], None] = lambda _: None,
) -> FlowAndMap | None:
    """Compare the integrals of a Kahan map, or of a polarized map, with the integrals of its differential equation.

    Args:
        search: the result of `find_integrals` for the map, with eps as a symbol.
        densities: the densities of the map, if known. If the flow preserves the limit of one of them, this limit
            replaces the density of the flow that the search finds.
        flow: the result of `find_integrals` for the flow. By default integrals of the flow are searched for up to a low
            degree, unless the integrals of the map have n - 1 independent limits in dimension n.
        known: the number of integrals that the map is known to have, if `search` shows fewer.
        effort: the work of the search: each step above 1 doubles it, each step below halves it.
        progress: called with a sentence at each stage of the search.

    Returns:
        The comparison, exact except for statements marked as measured. None for other maps, and if eps is a number.

    >>> from kahanmaps.documents.catalog import load
    >>> from kahanmaps.laboratory.preserve.integrals import find_integrals
    >>> print(*flow_and_map(find_integrals(load("weierstrass"))).lines()[0])
    proved L1 = 4*x^3 - y^2 - 4*x is an integral of the flow that the map deforms: I1 = L1 + ...
    """
    if not isinstance(search, IntegralSearch):
        raise wrong_kind(search, "what km.find_integrals found", "km.flow_and_map(km.find_integrals(...))")
    map_ = search.file.map
    is_kahan = isinstance(map_, KahanFamily)
    if search.eps is not None or not (is_kahan or (isinstance(map_, ImplicitMap) and map_.of_field is not None)):
        return None
    laboratory = Laboratory(search.file, search.symbols, None, search.seed, flow=True)
    budgets = budget_for("limits", effort).share([2, 2, 1])  # Darboux polynomials; integrals; densities
    progress("Darboux polynomials of the flow")
    darboux_search = laboratory.flow_polynomials(next(budgets))
    limits = _find_limits(search, laboratory) if is_kahan else _find_limits_on_solutions(search, laboratory)
    independent, dim = IndependentGradients(laboratory.maps[0], [limit.leading for limit in limits]), laboratory.map.dim
    integral_budget = next(budgets)
    if flow is None and len(limits) < dim - 1:
        flow = integrals_of(laboratory, _MAX_DEGREE.get(dim, 3), integral_budget, progress)
    flow_integrals = flow.integrals if flow is not None else ()
    other_integrals = [F for F in flow_integrals if independent.add(independent.gradient(F.function))]
    functions = [*(limit.leading for limit in limits), *(F.function for F in other_integrals)]
    count = max(known, search.codimension)
    density_search = densities_of(laboratory, _DENSITY_DEGREE, None, next(budgets))
    density = next(iter(density_search.densities), None)
    functions += [] if density is None else [density.function]
    comparison = FlowAndMap(
        limits,
        tuple(other_integrals),
        max(0, count - len(limits)),
        count,
        search,
        flow,
        density,
        density_search,
        _collect_polynomials(laboratory, darboux_search.functions, functions),
        darboux_search.degree,
        darboux_search.reason,
    )
    return with_limit(comparison, densities)


def with_limit(comparison: FlowAndMap, densities: DensitySearch | None) -> FlowAndMap:
    """Replace the density of the flow by the limit of a density of the map, if the flow preserves this limit."""
    search = comparison.map_search
    if densities is None or not isinstance(search.file.map, KahanFamily):
        return comparison
    laboratory = Laboratory(search.file, search.symbols, None, search.seed, flow=True)
    for map_density in densities.densities:
        field = FunctionField(laboratory.map.names)
        *_, phi = _leading_term(Function(field, map_density.function.numerator, map_density.function.denominator))
        verdict, evidence = laboratory.verdict_on(phi, is_density=True)
        if verdict.holds:
            density = FoundDensity(phi, verdict, evidence)
            polynomials = _collect_polynomials(laboratory, comparison.polynomials, [phi])
            return replace(comparison, density=density, density_search=None, polynomials=polynomials)
    return comparison


def _find_limits(search: IntegralSearch, laboratory: Laboratory) -> tuple[Limit, ...]:
    """Compute independent integrals of the flow to which combinations of the integrals of a Kahan map tend."""
    n, symbols = search.file.dim, search.symbols
    field = FunctionField(laboratory.map.names, _BUDGET)
    labels = [integral.name + "(x)" * (integral.name in symbols) for integral in search.integrals]
    formal_field = FunctionField((*labels, *symbols, "eps"), reduces=True)
    map_laboratory = Laboratory(search.file, symbols, None, search.seed)
    independent = IndependentGradients(laboratory.maps[0])
    limits: list[Limit] = []
    # The combinations of integrals that tend to the limits so far: pairs (function of x, formula in their names).
    combinations: list[tuple[Function, Function]] = []
    for integral, formula in zip(search.integrals, formal_field.variables, strict=False):
        I = Function(field, integral.function.numerator, integral.function.denominator)
        R = None
        try:
            for _ in range(_MAX_ROUNDS):
                order, content, leading = _leading_term(I)
                I, formula = (function * function.field.variables[-1] ** -order / content for function in (I, formula))
                if independent.adds(independent.gradient(leading)):
                    break
                R = _find_relation([leading, *(limit.leading for limit in limits)], n, len(symbols))
                I = evaluate(R, field, [I, *(F for F, _ in combinations), *field.variables[n:-1]])
                formula = evaluate(
                    R, formal_field, [formula, *(F for _, F in combinations), *formal_field.variables[len(labels) : -1]]
                )
            else:
                continue
            remainder = I - Function(field, leading.numerator, leading.denominator)
            order, second = 0, None
            if not remainder.numerator.is_zero():
                order, content, second = _leading_term(remainder)
                second = RationalFunction(second.numerator * content, second.denominator)
        except (BudgetExceeded, _NoLimit):
            continue
        verdict, _ = laboratory.verdict_on(leading)
        if not verdict.holds:
            continue
        independent.add(independent.gradient(leading))
        verdict = integral.verdict if second is None and R is None else map_laboratory.verdict_on(leading)[0]
        combinations.append((I, formula))
        limits.append(Limit(f"L{len(limits) + 1}", formal_field.format(formula), leading, order, second, verdict))
    return tuple(limits)


def _find_limits_on_solutions(search: IntegralSearch, laboratory: Laboratory) -> tuple[Limit, ...]:
    """Compute the integrals of the flow to which integrals of a polarized map tend.

    A point of such a map consists of several successive points x, x_1, ... of an orbit of a method of order 2.

    Along a smooth solution x_k = x + h_k f + h_k^2/2 f'f + O(eps^3) with h_k = 2 k eps. So the terms of numerator and
    denominator of an integral up to eps^2 are known. The limit is known if these contain both leading terms.
    """
    field, n = laboratory.field, laboratory.map.dim
    assert field is not None
    context = ring(laboratory.map.names)
    gens = context.gens()
    f = [g.compose(*gens[:-1], ctx=context) for g in field.rhs]
    images, map_ring = list[fmpq_mpoly](), ring((*search.file.variables, *search.symbols, "eps"))
    for k in range(search.file.dim // n):
        h = 2 * k * gens[-1]
        images += [x + h * g + h**2 * field.derivative(g) / 2 for x, g in zip(gens, f, strict=False)]
    images += gens[n:]
    map_gens = [*map_ring.gens()[:n], *map_ring.gens()[search.file.dim :]]
    formal_field = FunctionField([integral.name for integral in search.integrals] + ["eps"], reduces=True)
    function_field = FunctionField(laboratory.map.names, _BUDGET)
    independent = IndependentGradients(laboratory.maps[0])
    limits: list[Limit] = []
    for integral, formula in zip(search.integrals, formal_field.variables, strict=False):
        P, Q = (
            _truncate_at_third_order(polynomial.compose(*images, ctx=context))
            for polynomial in (integral.function.numerator, integral.function.denominator)
        )
        try:
            # A constant leading term is no integral: subtract it, and take the next term instead.
            for _ in range(2):
                order, content, leading = _leading_term(Function(function_field, P, Q))
                if not (leading.is_polynomial and leading.numerator.is_constant()):
                    break
                P = _truncate_at_third_order(P - content * Q)
                formula = formula - formal_field.convert(content)
            row = independent.gradient(leading)
        except (BudgetExceeded, _NoLimit, ZeroDivisionError):
            continue
        if not (independent.adds(row) and laboratory.verdict_on(leading)[0].holds):
            continue
        independent.add(row)
        combination = formal_field.format(
            formula * formal_field.variables[-1] ** -order / formal_field.convert(content)
        )
        polynomials = (
            polynomial.compose(*map_gens, ctx=map_ring) for polynomial in (leading.numerator, leading.denominator)
        )
        verdict, _ = Laboratory(search.file, search.symbols, None, search.seed).verdict_on(
            RationalFunction(*polynomials)
        )
        limits.append(Limit(f"L{len(limits) + 1}", combination, leading, 0, None, verdict, on_solutions=True))
    return tuple(limits)


def _truncate_at_third_order(P: fmpq_mpoly) -> fmpq_mpoly:
    """Drop the terms of order eps^3 and higher."""
    return P.context().from_dict({monomial: c for monomial, c in P.terms() if monomial[-1] < 3})


class _NoLimit(KahanmapsError):
    """Raised if no combination of an integral with other integrals has a limit independent of their limits."""


def _leading_term(I: Function) -> tuple[int, fmpq, RationalFunction]:
    """Return v, c and I_0 with I = c eps^v (I_0 + ...), I_0 a reduced quotient of primitive polynomials.

    Raises _NoLimit for I = 0.
    """
    if I.numerator.is_zero():
        raise _NoLimit("an integral is a function of others")
    lowest_terms = []
    for P in (I.numerator, I.denominator):
        order = min(int(monomial[-1]) for monomial in P.monoms())
        terms = {(*monomial[:-1], 0): c for monomial, c in P.terms() if monomial[-1] == order}
        lowest_terms.append((order, P.context().from_dict(terms)))
    (order_of_P, P), (order_of_Q, Q) = lowest_terms
    function = RationalFunction.reduced(P, Q)
    content, primitive_numerator = primitive_part(function.numerator)
    return order_of_P - order_of_Q, content, RationalFunction(primitive_numerator, function.denominator)


def _find_relation(functions: Sequence[RationalFunction], n: int, symbol_count: int) -> fmpq_mpoly:
    """Find a polynomial relation of least degree between the functions and the symbols. Raises _NoLimit.

    The relation is only known to hold at random points: the caller has to verify it.
    """
    rng = random.Random("relation")
    count = len(functions) + symbol_count
    for degree in (1, 2, 3):
        support = exponents_up_to(count, degree)
        if len(support) > _MAX_UNKNOWNS:
            break
        rows: list[list[fmpq]] = []
        while len(rows) < len(support) + 3:
            x = [fmpq(rng.randint(2, 999)) for _ in range(n + symbol_count)]
            values = [function.value(QQ, [*x, fmpq(0)]) for function in functions]
            if None not in values:
                arguments = [*values, *x[n:]]
                rows.append([prod(map(pow, arguments, exponents), start=fmpq(1)) for exponents in support])
        if vectors := nullspace(QQ, fmpq_mat(rows)):
            return ring([f"r{k}" for k in range(count)]).from_dict(dict(zip(support, vectors[0], strict=True)))
    raise _NoLimit("leading terms depend on each other, but not by a relation of low degree")


def _collect_polynomials(
    laboratory: Laboratory, candidates: Sequence[fmpq_mpoly], functions: Sequence[RationalFunction]
) -> tuple[fmpq_mpoly, ...]:
    """Collect Darboux polynomials of the flow, not affine and no integrals: `candidates` and factors of `functions`."""
    assert laboratory.field is not None
    n = laboratory.map.dim
    polynomials = {str(P): P for P in candidates if degree_in(P, n) > 1}
    for function in functions:
        for polynomial, other in permutations((function.numerator, function.denominator)):
            # If P is irreducible and has the degree of Q, it is no more special than any P - c Q of the pencil.
            factors = irreducible_factors(polynomial)
            is_generic = [k for _, k in factors] == [1] and degree_in(polynomial, n) == degree_in(other, n)
            for factor, _ in [] if is_generic else factors:
                P = primitive_part(factor)[1]
                K = darboux_cofactor(laboratory.field, P) if degree_in(P, n) > 1 else None
                if K is not None and not K.is_zero():
                    polynomials[str(P)] = P
    return tuple(polynomials.values())
