"""What a map makes of the integrals of its differential equation: which it keeps, deforms and loses.

A map x + 2 eps f(x) + ... has integrals eps^v (I_0 + eps^k I_1 + ...), and their leading terms I_0 are integrals of
the flow: f . grad I_0 = 0. Where I_0 depends on the leading terms J_0, ... of others, R(I_0, J_0, ...) = 0 with a
polynomial R, the integral R(I, J, ...) of the map is small with eps: it is divided by a power of eps and takes the
place of I. The relation of a number I_0 has I_0 alone. If all integrals of the map are functions of some with
independent I_0, an integral of the flow that is no function of these I_0 is no limit of integrals of the map.
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
from kahanmaps.laboratory.modular_points import Independent, exponents_up_to
from kahanmaps.laboratory.preserve.darboux.affine_functions import darboux_cofactor
from kahanmaps.laboratory.preserve.densities import DensitySearch, FoundDensity, densities_of
from kahanmaps.laboratory.preserve.integrals import FoundIntegral, IntegralSearch, integrals_of
from kahanmaps.maps.implicit import ImplicitMap
from kahanmaps.maps.kahan import KahanFamily

_BUDGET = 2_000_000  # products of terms, for all that is done to integrals
_ROUNDS = 5  # how often an integral is combined with others
_MOST_UNKNOWNS = 60  # coefficients of a relation between leading terms
_LONG, _SHOWN_TERMS = 100, 12  # of an integral of the flow, and of the second term of a series
_DENSITY_DEGREE = 4
_TOP = {1: 1, 2: 10, 3: 6, 4: 4}  # degrees of relations along solutions by dimension, 3 beyond


@dataclass(frozen=True)
class Limit:
    """An integral of the flow that the map keeps or deforms: `combination` = `leading` + eps^order `second` + ....

    `combination` is a function of integrals of the map by their names and of eps; `second` is None where it does not
    contain eps. f . grad leading = 0 is proved; `kept` is the verdict on the map conserving `leading` itself. Where the
    phase space consists of several points, `on_solutions`, leading terms are all that is told: those for such points.
    """

    name: str
    combination: str
    leading: RationalFunction
    order: int
    second: RationalFunction | None
    kept: Certainty
    on_solutions: bool = False

    @property
    def text(self) -> str:
        """What it is, and what the map makes of it."""
        done = "one of the map tends to"
        if self.kept.holds or self.kept is Certainty.REFUTED:
            done = f"the map keeps ({self.kept})" if self.kept.holds else "the map deforms"
        series = f"{self.combination} {'tends to' if self.on_solutions else '='} {self.name}"
        series += " where the points are those of a solution" * self.on_solutions
        if self.second is not None:
            power = "eps" if self.order == 1 else f"eps^{self.order}"
            series += f" + {power}*({_short(self.second, _SHOWN_TERMS)}) + ..."
        return f"{self.name} = {_short(self.leading, _LONG)} is an integral of the flow that {done}: {series}"

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        second = None if self.second is None else format_factored(self.second)
        known = attributes(self, "name", "combination", "order", "kept")
        return {**known, "leading": format_factored(self.leading), "second": second}


@dataclass(frozen=True)
class FlowAndMap:
    """The flow beside its map.

    Integrals of the flow are those that integrals of the map tend to, `limits`, and `others`, all independent;
    `without_limit` counts the integrals of the map of which no limit is known, of `count` that it has. `search` is that
    of the flow, None where there can be no more than the limits. `density` is a phi of the flow, `density_search` what
    was sought where that of the map gave none; `polynomials` are those of its Darboux polynomials above degree 1 that
    are known and no integrals, `polynomials_degree` is the degree up to which there are no others, measured; 0 where
    they were not sought; `polynomials_reason` is what leaves the next degree open where something does.
    """

    limits: tuple[Limit, ...]
    others: tuple[FoundIntegral, ...]
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
        """Why no density of the flow is known."""
        return "" if self.density_search is None else self.density_search.reason

    @property
    def lost(self) -> int:
        """How many of the others, at least, no integral of the map of the degrees tried tends to: measured."""
        profile = self.map_search.profile
        return max(0, len(self.others) - self.without_limit) if profile.nullities and profile.agree else 0

    def __str__(self) -> str:
        return "\n".join("\t".join(line) for line in self.lines())

    def lines(self, *, others: bool = True) -> list[tuple[str, str]]:
        """What is known, each sentence with how it is known; without the formulas of the others, if need be."""
        found = [("proved", one.text) for one in self.limits]
        for one in self.others if others else ():
            found.append(
                (str(one.verdict), f"{one.name} = {one.short_text} is an integral of the flow  [{one.origin}]")
            )
        names = ", ".join(one.name for one in self.others)
        shown = counted(self.count, "integral") if self.count else "no integral"
        shown += " free of n" if self.map_search.time_dependent else ""  # others depend on the number of the point
        if self.lost:
            which = names if self.lost == len(self.others) else f"at least {self.lost} of {names}"
            limits = f", with limits independent of {names}" if self.count else ""
            lost = f"{which} {'is' if self.lost == 1 else 'are'} lost up to degree {self.map_search.profile.degree}"
            found.append(("measured", f"{lost}: the map shows {shown}{limits}"))
        if self.lost < len(self.others):
            missing = f"the limits of {counted(self.without_limit, 'integral')} are not known"
            why = missing if self.without_limit else "its integrals were not counted"
            found.append(("undecided", f"what the map makes of {names}: {why}"))
        missing_formulas = 0 if self.search is None else self.search.codimension - len(self.limits) - len(self.others)
        if self.search is not None and missing_formulas > 0:
            number = counted(self.search.codimension, "independent integral")
            found.append(("measured", f"solutions show {number} of the flow, {missing_formulas} without a formula"))
        elif self.search is not None and self.search.profile.nullities and not self.search.is_exact:
            more = "other " * bool(self.limits or self.others)
            tried = f"relations along solutions up to degree {self.search.profile.degree}"
            found.append(("measured", f"no {more}rational integral of the flow shows in {tried}"))
        if self.search is not None and self.search.profile.cut == SPENT:
            tried = f"relations of degree {self.search.profile.degree + 1} and more along solutions were not tried"
            found.append(("undecided", f"of the flow: {tried}: {SPENT}"))
        if self.density is not None:
            found.append((str(self.density.verdict), f"the flow keeps dx/phi, phi = {self.density.text}"))
        elif self.density_search is not None and self.reason:
            known = "measured" if self.density_search.shows_none else "undecided"
            found.append((known, f"of the flow: {self.reason}"))
        if self.polynomials:
            told = ", ".join(map(format_polynomial, self.polynomials))
            found.append(("proved", f"Darboux polynomials of the flow, apart from affine ones: {told}"))
        for timed in self.search.time_dependent if others and self.search is not None else ():
            text = f"{timed.name} = {timed.text} is an integral of the flow that depends on time"
            found.append((str(timed.integral.verdict), text))
        if self.polynomials_degree > 1:
            which, but = ("other ", "") if self.polynomials else ("", "affine ones and ")
            shown = f"no {which}Darboux polynomial of the flow shows up to degree {self.polynomials_degree}"
            found.append(("measured", f"{shown} but {but}those of integrals"))
        if self.polynomials_reason:
            which = f"Darboux polynomials of the flow of degree {self.polynomials_degree + 1}"
            found.append(("undecided", f"{which}: {self.polynomials_reason}"))
        return found

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        known = attributes(self, "limits", "others", "lost", "without_limit", "density", "reason")
        known |= attributes(self, "polynomials", "polynomials_degree", "polynomials_reason")
        return {**known, "degree": None if self.search is None else self.search.profile.degree}


def _short(function: RationalFunction, most: int) -> str:
    """The formula, or its size where it is longer."""
    sizes = len(function.numerator), len(function.denominator)
    return format_factored(function) if sum(sizes) <= most else f"P/Q with {sizes[0]} and {sizes[1]} terms"


def flow_and_map(
    search: IntegralSearch,
    densities: DensitySearch | None = None,
    flow: IntegralSearch | None = None,
    *,
    known: int = 0,
    effort: int | Budget = 1,
    progress: Callable[[str], None] = lambda _: None,
) -> FlowAndMap | None:
    """What a Kahan map, or a polarised one, makes of the integrals of its differential equation.

    Args:
        search: the integrals of the map, for every eps.
        densities: those of the map, if they are known: a limit of one of them is told rather than a density of the flow
            that was sought.
        flow: the integrals of the flow; by default they are sought, up to a low degree, where the limits of those of
            the map are not all there can be.
        known: how many integrals the map is known to have, if that is more than `search` tells.
        effort: 1, or more: each more doubles the work of the search, each less halves it.
        progress: is told what is being tried.

    Returns:
        The flow beside the map, exact apart from what it says to be measured; None for other maps and for one eps.

    >>> from kahanmaps.documents.catalog import load
    >>> from kahanmaps.laboratory.preserve.integrals import find_integrals
    >>> print(*flow_and_map(find_integrals(load("weierstrass"))).lines()[0])
    proved L1 = 4*x^3 - y^2 - 4*x is an integral of the flow that the map deforms: I1 = L1 + ...
    """
    if not isinstance(search, IntegralSearch):
        raise wrong_kind(search, "what km.find_integrals found", "km.flow_and_map(km.find_integrals(...))")
    given = search.file.map
    is_kahan = isinstance(given, KahanFamily)
    if search.eps is not None or not (is_kahan or (isinstance(given, ImplicitMap) and given.of_field is not None)):
        return None
    laboratory = Laboratory(search.file, search.symbols, None, search.seed, flow=True)
    stages = budget_for("limits", effort).share([2, 2, 1])  # Darboux polynomials; integrals; densities
    progress("Darboux polynomials of the flow")
    sought = laboratory.flow_polynomials(next(stages))
    limits = _limits(search, laboratory) if is_kahan else _limits_on_solutions(search, laboratory)
    independent, dim = Independent(laboratory.maps[0], [one.leading for one in limits]), laboratory.map.dim
    stage = next(stages)
    if flow is None and len(limits) < dim - 1:
        flow = integrals_of(laboratory, _TOP.get(dim, 3), stage, progress)
    offered = flow.integrals if flow is not None else ()
    others = [one for one in offered if independent.add(independent.gradient(one.function))]
    functions = [*(one.leading for one in limits), *(one.function for one in others)]
    count = max(known, search.codimension)
    without = max(0, count - len(limits))
    found = densities_of(laboratory, _DENSITY_DEGREE, None, next(stages))
    density = next(iter(found.densities), None)
    functions += [] if density is None else [density.function]
    polynomials = _polynomials(laboratory, sought.functions, functions)
    beside = (tuple(others), without, count, search, flow, density, found, polynomials, sought.degree, sought.reason)
    return with_limit(FlowAndMap(limits, *beside), densities)


def with_limit(found: FlowAndMap, densities: DensitySearch | None) -> FlowAndMap:
    """What was found, the limit of a density of the map in the place of the density if the flow keeps that limit."""
    search = found.map_search
    if densities is None or not isinstance(search.file.map, KahanFamily):
        return found
    laboratory = Laboratory(search.file, search.symbols, None, search.seed, flow=True)
    for one in densities.densities:
        field = FunctionField(laboratory.map.names)
        *_, phi = _leading(Function(field, one.function.numerator, one.function.denominator))
        verdict, evidence = laboratory.verdict_on(phi, is_density=True)
        if verdict.holds:
            density = FoundDensity(phi, verdict, evidence)
            polynomials = _polynomials(laboratory, found.polynomials, [phi])
            return replace(found, density=density, density_search=None, polynomials=polynomials)
    return found


def _limits(search: IntegralSearch, laboratory: Laboratory) -> tuple[Limit, ...]:
    """The independent integrals of the flow that integrals of the map tend to."""
    n, symbols = search.file.dim, search.symbols
    field = FunctionField(laboratory.map.names, _BUDGET)
    labels = [one.name + "(x)" * (one.name in symbols) for one in search.integrals]
    formal = FunctionField((*labels, *symbols, "eps"), reduces=True)
    map_laboratory = Laboratory(search.file, symbols, None, search.seed)
    independent = Independent(laboratory.maps[0])
    found: list[Limit] = []
    used: list[tuple[Function, Function]] = []  # the integrals of the map, and how they are made
    for one, name in zip(search.integrals, formal.variables, strict=False):
        I = Function(field, one.function.numerator, one.function.denominator)
        R = None
        try:
            for _ in range(_ROUNDS):
                order, content, leading = _leading(I)
                I, name = (function * function.field.variables[-1] ** -order / content for function in (I, name))
                if independent.adds(independent.gradient(leading)):
                    break
                R = _relation([leading, *(limit.leading for limit in found)], n, len(symbols))
                I = evaluate(R, field, [I, *(before for before, _ in used), *field.variables[n:-1]])
                name = evaluate(R, formal, [name, *(before for _, before in used), *formal.variables[len(labels) : -1]])
            else:
                continue
            rest = I - Function(field, leading.numerator, leading.denominator)
            order, second = 0, None
            if not rest.above.is_zero():
                order, content, second = _leading(rest)
                second = RationalFunction(second.numerator * content, second.denominator)
        except (BudgetExceeded, _NoLimit):
            continue
        verdict, _ = laboratory.verdict_on(leading)
        if not verdict.holds:
            continue
        independent.add(independent.gradient(leading))
        kept = one.verdict if second is None and R is None else map_laboratory.verdict_on(leading)[0]
        used.append((I, name))
        found.append(Limit(f"L{len(found) + 1}", formal.format(name), leading, order, second, kept))
    return tuple(found)


def _limits_on_solutions(search: IntegralSearch, laboratory: Laboratory) -> tuple[Limit, ...]:
    """The same for a map of several successive points x, x_1, ..., of a symmetric method, of second order therefore.

    On smooth solutions x_k is x + h_k f + h_k^2/2 f'f + O(eps^3), h_k = 2 k eps. So terms of a numerator or denominator
    below eps^3 are known there, and an integral has a limit if its leading terms are among these.
    """
    field, n = laboratory.field, laboratory.map.dim
    assert field is not None
    context = ring(laboratory.map.names)
    gens = context.gens()
    f = [g.compose(*gens[:-1], ctx=context) for g in field.rhs]
    images, lifted = list[fmpq_mpoly](), ring((*search.file.variables, *search.symbols, "eps"))
    for k in range(search.file.dim // n):
        h = 2 * k * gens[-1]
        images += [x + h * g + h**2 * field.derivative(g) / 2 for x, g in zip(gens, f, strict=False)]
    images += gens[n:]
    old = [*lifted.gens()[:n], *lifted.gens()[search.file.dim :]]
    formal = FunctionField([one.name for one in search.integrals] + ["eps"], reduces=True)
    functions = FunctionField(laboratory.map.names, _BUDGET)
    independent = Independent(laboratory.maps[0])
    found: list[Limit] = []
    for one, name in zip(search.integrals, formal.variables, strict=False):
        P, Q = (
            _below_third_order(part.compose(*images, ctx=context))
            for part in (one.function.numerator, one.function.denominator)
        )
        try:
            for _ in range(2):
                order, content, leading = _leading(Function(functions, P, Q))
                if not (leading.is_polynomial and leading.numerator.is_constant()):
                    break
                P = _below_third_order(P - content * Q)
                name = name - formal.convert(content)
            row = independent.gradient(leading)
        except (BudgetExceeded, _NoLimit, ZeroDivisionError):
            continue
        if not (independent.adds(row) and laboratory.verdict_on(leading)[0].holds):
            continue
        independent.add(row)
        combination = formal.format(name * formal.variables[-1] ** -order / formal.convert(content))
        parts = (part.compose(*old, ctx=lifted) for part in (leading.numerator, leading.denominator))
        kept, _ = Laboratory(search.file, search.symbols, None, search.seed).verdict_on(RationalFunction(*parts))
        found.append(Limit(f"L{len(found) + 1}", combination, leading, 0, None, kept, on_solutions=True))
    return tuple(found)


def _below_third_order(P: fmpq_mpoly) -> fmpq_mpoly:
    """P without its terms in eps^3 and above."""
    return P.context().from_dict({monomial: c for monomial, c in P.terms() if monomial[-1] < 3})


class _NoLimit(KahanmapsError):
    """No combination of an integral with others was found that has a limit independent of theirs."""


def _leading(I: Function) -> tuple[int, fmpq, RationalFunction]:
    """v, c and I_0 with I = c eps^v (I_0 + ...), I_0 in lowest terms, of primitive polynomials. Raises _NoLimit."""
    if I.above.is_zero():
        raise _NoLimit("an integral is a function of others")
    lowest = []
    for P in (I.above, I.below):
        order = min(int(monomial[-1]) for monomial in P.monoms())
        terms = {(*monomial[:-1], 0): c for monomial, c in P.terms() if monomial[-1] == order}
        lowest.append((order, P.context().from_dict(terms)))
    (order_of_P, P), (order_of_Q, Q) = lowest
    function = RationalFunction.reduced(P, Q)
    content, primitive = primitive_part(function.numerator)
    return order_of_P - order_of_Q, content, RationalFunction(primitive, function.denominator)


def _relation(functions: Sequence[RationalFunction], n: int, symbols: int) -> fmpq_mpoly:
    """A polynomial relation of the functions and the symbols, of the least degree. Raises _NoLimit.

    It is what vanishes at random points: whoever takes it for a relation has to find that it is one.
    """
    rng = random.Random("relation")
    count = len(functions) + symbols
    for degree in (1, 2, 3):
        support = exponents_up_to(count, degree)
        if len(support) > _MOST_UNKNOWNS:
            break
        rows: list[list[fmpq]] = []
        while len(rows) < len(support) + 3:
            x = [fmpq(rng.randint(2, 999)) for _ in range(n + symbols)]
            values = [one.value(QQ, [*x, fmpq(0)]) for one in functions]
            if None not in values:
                given = [*values, *x[n:]]
                rows.append([prod(map(pow, given, exponents), start=fmpq(1)) for exponents in support])
        if vectors := nullspace(QQ, fmpq_mat(rows)):
            return ring([f"r{k}" for k in range(count)]).from_dict(dict(zip(support, vectors[0], strict=True)))
    raise _NoLimit("leading terms depend on each other, but not by a relation of low degree")


def _polynomials(
    laboratory: Laboratory, sought: Sequence[fmpq_mpoly], functions: Sequence[RationalFunction]
) -> tuple[fmpq_mpoly, ...]:
    """The Darboux polynomials of the flow, neither affine nor integrals: those sought, and factors of the functions."""
    assert laboratory.field is not None
    n = laboratory.map.dim
    found = {str(P): P for P in sought if degree_in(P, n) > 1}
    for function in functions:
        for part, other in permutations((function.numerator, function.denominator)):
            # An irreducible P of the degree of Q is any member of the pencil P - c Q.
            factors = irreducible_factors(part)
            is_any = [k for _, k in factors] == [1] and degree_in(part, n) == degree_in(other, n)
            for factor, _ in [] if is_any else factors:
                P = primitive_part(factor)[1]
                K = darboux_cofactor(laboratory.field, P) if degree_in(P, n) > 1 else None
                if K is not None and not K.is_zero():
                    found[str(P)] = P
    return tuple(found.values())
