"""The search for integrals of a map in closed form, from the map alone.

Theorems (hamiltonian_structure.py) and the measured codimension of orbits (hirota_kimura.py) give lower bounds of the
number of integrals. Then the search looks for spaces of polynomials with a common cofactor modulo a prime (search.py):
ratios of elements of one space are integrals. The coefficients are functions of eps and of the parameters that stay
symbols; they are interpolated, and every formula is verified as an identity (laboratory.py).
Integrals that theorems give are added if the search missed them. Finally, formulas in iterates are tried (iterates.py).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from flint import fmpq

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.functions import BudgetExceeded, FunctionField
from kahanmaps.algebra.polynomials import RationalFunction, degree, ring, substitute
from kahanmaps.algebra.printing import attributes, format_factored, format_polynomial, format_rational_function
from kahanmaps.algebra.work import SPENT, UNFINISHED, Budget
from kahanmaps.checks.claims import Certainty, Evidence
from kahanmaps.display_protocols import ResultPart, latex
from kahanmaps.documents.inline import as_file
from kahanmaps.errors import InputError
from kahanmaps.invariants.integrals_and_densities import normalized
from kahanmaps.laboratory.defaults import budget_for
from kahanmaps.laboratory.laboratory import Laboratory, flow_preserves
from kahanmaps.laboratory.modular_points import IndependentGradients, ModularMap, NoPoint, Point
from kahanmaps.laboratory.preserve.darboux.cofactors import Cofactor, SpaceSearch, denominators_among
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import LARGEST_SPAN
from kahanmaps.laboratory.preserve.hirota_kimura import Profile, orbit_profile
from kahanmaps.laboratory.preserve.iterates import (
    IntegralInIterates,
    gradient_of,
    integrals_in_iterates,
    verdict_on_ratio,
)
from kahanmaps.laboratory.preserve.poisson.hamiltonian_structure import InheritedIntegrals, inherited_integrals
from kahanmaps.laboratory.preserve.products import candidates, products_of
from kahanmaps.laboratory.preserve.results import FoundFunction, Search, closing_note, common_orbit_period
from kahanmaps.laboratory.preserve.search import (
    AFFINE,
    add_relation_spaces,
    interpolate_bases,
    may_be_conjugate,
    repeat_search,
    search_spaces,
)
from kahanmaps.maps.convention import resolve_eps
from kahanmaps.maps.kahan import SystemLike

_AFFINE_EVIDENCE = Evidence("theorem", "v.f(x) = 0, so v.(x~ - x) = 0: v.x is conserved")
_SHOWN_TERMS = 500  # of numerator and denominator together: longer formulas are not printed in a report
Formula = tuple[RationalFunction, str, str]  # a function, its origin, and its factored form (empty if not known)
_CONJUGATE_PRIMES = 4  # conjugate pencils are rational modulo the first and all of these primes with probability 1/32


@dataclass(frozen=True)
class FoundIntegral(FoundFunction):
    """An integral I(x, eps), a function of (variables, symbols, eps), with the verdict on I(x~) = I(x), x~ = Phi(x)."""

    name: str
    function: RationalFunction
    origin: str
    verdict: Certainty
    evidence: Evidence
    product: str = ""  # the formula in factored form, if the search gives it

    @property
    def text(self) -> str:
        """The formula."""
        return self.product or format_factored(self.function)

    @property
    def short_text(self) -> str:
        """The formula, or its number of terms if it has more than 500."""
        term_counts = len(self.function.numerator), len(self.function.denominator)
        if sum(term_counts) <= _SHOWN_TERMS:
            return self.text
        return f"P/Q with {term_counts[0]} and {term_counts[1]} terms, which find-integrals writes out"

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        degrees = [degree(self.function.numerator), degree(self.function.denominator)]
        return {
            **attributes(self, "name", integral="text"),
            "latex": latex(self.function),
            "degrees": degrees,
            **attributes(self, "origin", "verdict", "evidence"),
        }


@dataclass(frozen=True)
class TimeDependentIntegral(ResultPart):
    """A time-dependent integral c^-n I(x), where x is the n-th point of an orbit: I(x~) = c I(x), c independent of x.

    For a flow the time-dependent integral is exp(-c t) I(x) with I' = c I. `integral` is I, and `factor` is c.
    """

    name: str
    integral: FoundIntegral
    factor: RationalFunction
    flow: bool = False

    @property
    def text(self) -> str:
        """The formula."""
        I = self.integral.text
        bracketed_text = I if I.isidentifier() else f"({I})"
        if self.flow:
            rate = format_polynomial(-self.factor.numerator)
            exponent = {"1": "t", "-1": "-t"}.get(rate, f"({rate})*t" if " " in rate else f"{rate}*t")
            return f"exp({exponent})*{bracketed_text}"
        return f"({format_rational_function(self.factor)})^-n*{bracketed_text}"

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            **attributes(self, "name"),
            "integral": self.integral.text,
            "factor": format_rational_function(self.factor),
            **attributes(self.integral, "verdict", "evidence"),
        }


@dataclass(frozen=True)
class IntegralSearch(Search):
    """The result of `find_integrals`.

    `integrals`, `time_dependent` integrals and integrals `in_iterates`, whose formulas contain iterates of x, are
    together functionally independent. `profile` holds the dimensions of the relations along orbits (measured).
    `by_theorems` is the number of independent integrals that theorems give the Kahan map, at random values of the
    symbols; `theorems` is a phrase on these (hamiltonian_structure.py). `reason` says what is missing and why; it is
    empty if nothing is missing. `period_at_values` is the period of the map at the values that the file gives the
    symbols, if orbits close there.
    """

    _parts, _noun = "all_integrals", ("integral", "integrals")

    integrals: tuple[FoundIntegral, ...]
    profile: Profile
    reason: str
    by_theorems: int = 0
    theorems: str = ""
    time_dependent: tuple[TimeDependentIntegral, ...] = ()
    in_iterates: tuple[IntegralInIterates, ...] = ()
    period_at_values: int | None = None

    @property
    def note(self) -> str:
        """A sentence on the period of the map; empty if orbits do not close."""
        if self.profile.period is None and self.period_at_values is not None:
            values = ", ".join(f"{name} = {self.file.parameters[name]}" for name in self.symbols)
            if self.flow:
                return f"at {values} the right-hand side is 0, and every function is an integral"
            return f"at {values} {closing_note(self.period_at_values, self.eps, self.file.map)}"
        return closing_note(self.profile.period, self.eps, self.file.map)

    @property
    def codimension(self) -> int:
        """The largest number of independent integrals that orbits show, theorems give or formulas prove."""
        return max(self.profile.codimension, self.profile.with_known, self.by_theorems, self.formula_count)

    @property
    def all_integrals(self) -> list[FoundIntegral | IntegralInIterates]:
        """The integrals with a formula; integrals in iterates come last."""
        return [*self.integrals, *self.in_iterates]

    @property
    def formulas(self) -> list[tuple[str, Certainty]]:
        """Each formula with its verdict; integrals in iterates come last."""
        return [(integral.text, integral.verdict) for integral in self.all_integrals]

    @property
    def formula_count(self) -> int:
        """The number of integrals with a formula."""
        return len(self.all_integrals)

    @property
    def is_exact(self) -> bool:
        """Whether there are exactly `codimension` integrals; if not, this number is a lower bound.

        Relations of higher degrees could show more integrals, unless generic orbits fill curves or are finite.
        """
        dim, has_profile = self.profile.dim, bool(self.profile.nullities)
        is_closed = self.profile.period is not None or self.period_at_values is not None
        return self.codimension >= (dim - 1 if has_profile and not is_closed else dim)

    @property
    def count_text(self) -> str:
        """The number of integrals, with the evidence for it."""
        scope = f"relations of degree up to {self.profile.degree} along orbits"
        if self.codimension == 0:
            if not self.profile.nullities:
                return "orbits were not measured"
            return f"there is no integral (measured, {scope})" if self.is_exact else f"none shows in {scope} (measured)"
        phrases = [f"{self.by_theorems} by theorems: {self.theorems}"] if self.by_theorems else []
        if self.profile.nullities:
            count = max(self.profile.codimension, self.profile.with_known, self.by_theorems)
            phrases.append(f"measured: {scope} show {'no more' if count == self.by_theorems else count}")
            if self.formula_count > count:
                phrases.append(f"{self.formula_count} have formulas")
        at_least = "" if self.is_exact else "at least "
        verb = "is" if self.codimension == 1 else "are"
        return f"there {verb} {at_least}{self.codimension} in all ({'; '.join(phrases)})"

    @property
    def is_complete(self) -> bool:
        """Whether there is a formula for each of the independent integrals that are known to exist."""
        return self.formula_count >= self.codimension

    def rows(self) -> list[dict[str, str]]:
        """Return one row for each formula, e.g. for `pandas.DataFrame(result.rows())`."""
        return [{"name": I.name, "formula": I.text, "verdict": str(I.verdict)} for I in self.integrals]

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            **self.of_flow,
            **attributes(self, "integrals"),
            **attributes(self, found="formula_count"),
            **attributes(self, "time_dependent", "in_iterates"),
            **attributes(self, "codimension", codimension_is_exact="is_exact"),
            **attributes(self, "by_theorems", relations="profile"),
            **attributes(self, "note", "reason", "primes"),
        }

    def toml_section(self) -> str:
        """Return the section [integrals] of a system file, for `check-integrals`; empty without integrals.

        If eps was given, a comment says that the formulas hold at this eps only.
        """
        lines = [f'{integral.name} = "{integral.text}"' for integral in self.all_integrals]
        return "\n".join([*self.toml_comments, "[integrals]", *lines, ""]) if lines else ""


def find_integrals(
    system: SystemLike,
    *,
    symbols: Sequence[str] = (),
    eps: Any = None,
    time_step: Any = None,
    h: Any = None,
    flow: bool = False,
    max_degree: int | None = None,
    effort: int | Budget = 1,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
    on_result: Callable[[IntegralSearch], None] = lambda _: None,
) -> IntegralSearch:
    """Search for independent integrals of a map in closed form, and verify each formula.

    Args:
        system: the map; a differential equation stands for its Kahan map.
        symbols: names of parameters that stay symbols in the formulas; the others have the values of the file.
        eps: half the time step, an exact number: formulas then hold at this eps only. None: formulas contain eps.
        time_step, h: the time step 2 eps, instead of eps.
        flow: search for rational integrals of the differential equation instead.
        max_degree: the largest degree of relations along orbits; the default depends on dimension and budget.
        effort: the work that the search may take: each step above 1 doubles it, each step below halves it.
        seed: the random seed.
        progress: called with a sentence at each stage of the search.
        on_result: called with the results so far after each stage, for searches that may be interrupted.

    Returns:
        An `IntegralSearch`. Its formulas are exact, and proved or supported as identities; the number of integrals
        that orbits show is measured modulo two primes.

    Raises:
        InputError: for unknown symbols, symbols in a [family] file, or eps = 0.

    Source: petrera-pfadler-suris-2009, celledoni-2019, cmoq-2013.

    >>> from kahanmaps.documents.catalog import load
    >>> result = find_integrals(load("nahm_tetrahedral"))
    >>> [(integral.text, str(integral.verdict)) for integral in result.integrals], result.codimension
    ([('-y*(3*x^2 - y^2)/(4*x^2*eps^2 + 4*y^2*eps^2 - 1)', 'proved')], 1)
    """
    file, eps = as_file(system), resolve_eps(eps, time_step, h)
    if max_degree is not None and max_degree < 1:
        raise InputError(f"found the largest degree {max_degree}, expected at least 1")
    laboratory = Laboratory(file, symbols, eps, seed, flow=flow, algebraic=True)
    return integrals_of(laboratory, max_degree, budget_for("integrals", effort), progress, on_result)


def integrals_of(
    laboratory: Laboratory,
    max_degree: int | None,
    budget: Budget,
    progress: Callable[[str], None],
    on_result: Callable[[IntegralSearch], None] = lambda _: None,
) -> IntegralSearch:
    """Run `find_integrals` on the maps of a laboratory."""
    flow, seed = laboratory.flow, laboratory.request[3]
    # Shares of the stages: orbits; fast searches and formulas; products; larger relations and formulas; iterates. Work
    # that a stage does not use goes to later stages, and no stage can use up the share of a later one.
    budgets = budget.share([3, 4, 1, 3, 3])
    collection = _IntegralCollection(laboratory, progress)
    # The integrals that theorems give, for each map of the laboratory; without symbols they are the same for all maps.
    inherited = list[InheritedIntegrals]()
    if laboratory.system is not None and not flow and laboratory.root is None:
        systems = {
            values: inherited_integrals(laboratory.system.at(values), seed=seed)
            for values in {map_.values for map_ in laboratory.maps}
        }
        inherited = [systems[map_.values] for map_ in laboratory.maps]
    theorems, by_theorems = "", 0
    if inherited:
        values_text = ", ".join(laboratory.free_symbols)
        theorems = inherited[0].text + (f", at random values of {values_text}" if values_text else "")
        if not laboratory.defect:
            pairs = zip(inherited, laboratory.maps, strict=True)
            by_theorems = min(integrals.count(map_) for integrals, map_ in pairs)
    # The map modulo the first prime, at the values that the file gives to the symbols, if it gives values to all.
    map_at_values, values = None, [laboratory.file.parameters.get(name) for name in laboratory.symbols]
    if values and None not in values:
        prime = laboratory.maps[0].prime
        residues = [int(GF(prime).convert(value)) for value in values]
        map_at_values = laboratory.map_at(prime, residues, laboratory.maps[0].eps)
    period_at_values = None if map_at_values is None or laboratory.defect else common_orbit_period([map_at_values])

    def build_result(profile: Profile, reason: str) -> IntegralSearch:
        return IntegralSearch(
            *laboratory.request,
            tuple(collection.integrals),
            profile,
            reason,
            by_theorems,
            theorems,
            tuple(collection.time_dependent),
            tuple(collection.in_iterates),
            period_at_values,
            flow=flow,
        )

    def known_gradients(map_: ModularMap, x: Point) -> list[list[int]]:
        return inherited[laboratory.maps.index(map_)].gradients(map_, x) if inherited else []

    note = ""
    empty_profile = Profile(laboratory.map.dim, (), (), None, True, False)
    if laboratory.defect:
        return build_result(empty_profile, laboratory.defect)
    try:
        profile = orbit_profile(
            laboratory.maps,
            max_degree=max_degree,
            budget=next(budgets),
            known_gradients=known_gradients,
            progress=progress,
        )
        on_result(build_result(profile, UNFINISHED))
        share = next(budgets)
        cofactors = laboratory.cofactors()
        # For a vector field, `candidates` would be too many; most denominators have no factors but these polynomials.
        factors = [cofactor.polynomial for cofactor in cofactors if cofactor.polynomial is not None]
        factors = factors if laboratory.field is not None else candidates(laboratory, cofactors, share)
        denominator_cofactors = denominators_among(factors, laboratory.map.dim)

        def quick_search(map_: ModularMap) -> SpaceSearch:
            # The search on each map gets half of the work that is left; the other half is for the formulas.
            return search_spaces(
                map_, profile, cofactors, denominator_cofactors, budget=share.part(0.5), progress=progress
            )

        base_map = laboratory.maps[0]
        base_map, space_search, formulas, reason = _interpolate_formulas(
            laboratory, base_map, quick_search(base_map), quick_search, share, progress
        )
    except NoPoint as error:
        return build_result(empty_profile, str(error))
    collection.add_formulas(formulas)
    if inherited and not laboratory.symbols:
        collection.add_by_theorems(inherited[0])
    on_result(build_result(profile, UNFINISHED))
    share = next(budgets)
    if len(collection.integrals) < laboratory.map.dim - 1:
        progress("products of powers of known polynomials")
        collection.add_products(cofactors, share)
    result_so_far, share = build_result(profile, ""), next(budgets)
    on_result(replace(result_so_far, reason=UNFINISHED))
    if not result_so_far.is_complete:
        # This stage may take longer than all earlier stages, so it comes after their formulas.
        steps_before = len(space_search.steps)
        note = add_relation_spaces(base_map, profile, space_search, LARGEST_SPAN, share.part(0.5), progress)
        if len(space_search.steps) > steps_before:

            def thorough_search(map_: ModularMap) -> SpaceSearch:
                second_search = search_spaces(
                    map_, profile, cofactors, denominator_cofactors, budget=share.part(0.5), progress=progress
                )
                add_relation_spaces(map_, profile, second_search, LARGEST_SPAN, share.part(0.5), progress)
                return second_search

            _, space_search, formulas, reason = _interpolate_formulas(
                laboratory, base_map, space_search, thorough_search, share, progress
            )
            collection.add_formulas(formulas)
            result_so_far = build_result(profile, "")
    if not flow and not result_so_far.is_complete and laboratory.root is None:
        collection.add_in_iterates(result_so_far.codimension, next(budgets))
        result_so_far = build_result(profile, "")
    missing_count = result_so_far.codimension - result_so_far.formula_count
    if missing_count <= 0:
        reason = ""
    elif not reason:
        verb = "has" if missing_count == 1 else "have"
        reason = f"{missing_count} of the {result_so_far.codimension} independent integrals {verb} no closed form P/Q"
        reason += f" {space_search.tried}: coefficients of Hirota-Kimura bases are such integrals"
    reasons = [reason, *([space_search.stop_reason, note] if missing_count > 0 else []), *collection.skipped_searches]
    if map_at_values is not None:
        # At the values of the file, integrals with symbols may become dependent or vanish.
        independent = IndependentGradients(map_at_values)
        rows = [independent.gradient(integral.function) for integral in result_so_far.integrals]
        point = independent.point
        rows += [
            gradient_of(integral.ratio, laboratory.map, map_at_values, point) for integral in result_so_far.in_iterates
        ]
        rank = sum(map(independent.add, rows))
        if rank < len(rows):
            values_text = ", ".join(f"{name} = {value}" for name, value in zip(laboratory.symbols, values, strict=True))
            count_text = f"only {rank} of the {len(rows)} formulas {'is' if rank == 1 else 'are'} independent"
            reasons.append(f"at {values_text} {count_text}: without --symbolic others may be found")
    if profile.stop_reason and (profile.stop_reason == SPENT or max_degree is not None or not profile.is_settled):
        reasons.append(f"relations of degree {profile.degree + 1} and more were not tried: {profile.stop_reason}")
    elif not profile.maps_agree:
        reasons.append("the orbits that were compared do not agree: try another --seed")
    return replace(result_so_far, reason="; ".join(filter(None, reasons)))


def _interpolate_formulas(
    laboratory: Laboratory,
    base_map: ModularMap,
    result: SpaceSearch,
    search_on: Callable[[ModularMap], SpaceSearch],
    budget: Budget,
    progress: Callable[[str], None],
) -> tuple[ModularMap, SpaceSearch, list[Formula], str]:
    """Interpolate the ratios of the polynomials that a search on the map `base_map` found.

    If two spaces may be conjugate over an extension of Q, `search_on` searches again on maps modulo other primes, on
    which conjugate spaces may not exist. Returns the map and the result of the search that were used, the formulas, and
    the reason why there are no further formulas. Raises NoPoint.
    """
    if may_be_conjugate(result):
        for map_ in laboratory.other_maps(_CONJUGATE_PRIMES):
            if not budget.is_spent and repeat_search(result, map_, base_map.prime) is None:
                base_map, result = map_, search_on(map_)
    if not result.steps:
        return base_map, result, [], ""
    progress("interpolating closed forms")
    bases, reason = interpolate_bases(laboratory, base_map.prime, result, budget)
    origins = [step.text for step, spaces in zip(result.steps, result.spaces, strict=True) for _ in spaces]
    formulas = list[Formula]()
    for (Q, *numerators), origin in zip(bases, origins, strict=False):
        for P in numerators:  # prefer P/Q or Q/P, whichever has a constant denominator at eps = 0
            P_is_number, Q_is_number = (substitute(F, {"eps": fmpq(0)}).is_constant() for F in (P, Q))
            is_inverse = P_is_number and not Q_is_number
            formulas.append((RationalFunction(Q, P) if is_inverse else RationalFunction(P, Q), origin, ""))
    return base_map, result, formulas, reason


class _IntegralCollection:
    """Functionally independent integrals with verdicts, none of them refuted.

    `skipped_searches` names the searches that were skipped because the work limit was reached.
    """

    def __init__(self, laboratory: Laboratory, progress: Callable[[str], None]) -> None:
        self._laboratory, self._progress = laboratory, progress
        self.skipped_searches: list[str] = []
        self._gradients = IndependentGradients(laboratory.maps[0])
        self.integrals: list[FoundIntegral] = []
        self.time_dependent: list[TimeDependentIntegral] = []
        self.in_iterates: list[IntegralInIterates] = []

    def add_formulas(self, formulas: Sequence[Formula]) -> None:
        """Add the formulas that are independent of the collected integrals and not refuted, short formulas first."""

        def sort_key(formula: Formula) -> tuple[int, int, list[list[int]]]:
            """Return the sort key: size and monomials of the numerator. The order must not depend on the primes."""
            P = formula[0].numerator
            return degree(P), len(P), [[-int(e) for e in monomial] for monomial in P.monoms()]

        for function, origin, factored_text in sorted(map(self._normalize, formulas), key=sort_key):
            gradient = self._gradients.gradient(function)
            if not self._gradients.adds(gradient):
                continue
            self._progress("verifying an integral")
            laboratory, evidence = self._laboratory, _AFFINE_EVIDENCE
            n, monomials = laboratory.map.dim, function.numerator.monoms()
            is_affine = function.is_polynomial and all(sum(map(int, m[:n])) <= 1 and not m[-1] for m in monomials)
            system = None if laboratory.flow else laboratory.system
            if is_affine and system is not None and flow_preserves(system, function):
                verdict = Certainty.PROVED  # v.x with v.f = 0; v may contain the symbols
            else:
                verdict, evidence = laboratory.verdict_on(function)
            if verdict.holds:
                self._add(gradient, function, origin, verdict, evidence, factored_text)

    def _normalize(self, formula: Formula) -> Formula:
        """Normalize the formula so that it tends to an integral of the flow as eps -> 0, if that is possible."""
        function, origin, factored_text = formula
        if not self._has_limit:
            return formula
        normalized_function = normalized(function, self._laboratory.map.dim).function
        return normalized_function, origin, factored_text if normalized_function == function else ""

    @property
    def _has_limit(self) -> bool:
        """Whether a limit eps -> 0 is defined: for flows, and for maps that approximate a flow, if eps is a symbol."""
        laboratory = self._laboratory
        approximates_flow = laboratory.flow or (laboratory.map.has_eps and laboratory.map.time_steps != 0)
        return approximates_flow and laboratory.eps is None and laboratory.root is None

    def _add(self, gradient: list[int], *fields: Any) -> None:
        self._gradients.add(gradient)
        name = f"{'F' if self._laboratory.flow else 'I'}{len(self.integrals) + 1}"
        self.integrals.append(FoundIntegral(name, *fields))

    def add_by_theorems(self, inherited: InheritedIntegrals) -> None:
        """Add the integrals that theorems give, unless the formula is too long to expand."""
        laboratory = self._laboratory
        affine_count, context = len(inherited.quotient.integrals), ring((*laboratory.map.variables, "eps"))
        for k, gradient in enumerate(inherited.gradients(laboratory.maps[0], self._gradients.point)):
            if not self._gradients.adds(gradient):
                continue
            if k < affine_count:
                terms = zip(context.gens(), inherited.quotient.integrals[k], strict=False)
                affine_integral = RationalFunction(
                    sum((x * v for x, v in terms), context.constant(0)), context.constant(1)
                )
                self._add(gradient, affine_integral, AFFINE, Certainty.PROVED, _AFFINE_EVIDENCE)
                continue
            field = FunctionField((*laboratory.map.variables, "eps"), reduces=False)
            eps = field.variables[-1] if laboratory.eps is None else field.convert(laboratory.eps)
            try:
                value = inherited.modified(k - affine_count, field, eps, field.variables[:-1])
            except BudgetExceeded:
                continue  # too long to expand
            function = RationalFunction.reduced(value.numerator, value.denominator)
            is_hamiltonian = inherited.forms[k - affine_count].rank() == len(inherited.quotient.free)
            form_text = "f = J grad H with" if is_hamiltonian else "K f = grad H with"
            summary = f"{form_text} a constant skew matrix {'J' if is_hamiltonian else 'K'}"
            summary = f"{summary}: H + grad H . (x~ - x)/3 is conserved (cmoq-2013)"
            evidence = Evidence("theorem", summary, {"H": str(inherited.hamiltonian(k - affine_count))})
            formula = self._normalize((function, "modified Hamiltonian (cmoq-2013)", ""))
            self._add(gradient, *formula[:2], Certainty.PROVED, evidence)

    def add_products(self, cofactors: Sequence[Cofactor], budget: Budget) -> None:
        """Add integrals and time-dependent integrals that are products of powers of known polynomials."""
        laboratory, origin = self._laboratory, "product of powers of known polynomials"
        if budget.is_spent:
            self.skipped_searches.append(f"products of powers of known polynomials were not tried: {SPENT}")
            return
        try:
            products = products_of(laboratory, candidates(laboratory, cofactors, budget))
        except NoPoint:
            return
        pairs = ((product, product.function) for product in products.integrals)
        self.add_formulas([(function, origin, product.text) for product, function in pairs if function is not None])
        for product in products.time_dependent:
            function = product.function
            if function is None or len(self.integrals) + len(self.time_dependent) >= laboratory.map.dim:
                continue
            gradient = self._gradients.gradient(function)
            if not self._gradients.adds(gradient):
                continue
            verdict, evidence = laboratory.verdict_on(function, factor=product.constant)
            if verdict.holds:
                self._gradients.add(gradient)
                name = f"T{len(self.time_dependent) + 1}"
                integral = FoundIntegral(name, function, origin, verdict, evidence, product.text)
                self.time_dependent.append(TimeDependentIntegral(name, integral, product.constant, laboratory.flow))

    def add_in_iterates(self, required: int, budget: Budget) -> None:
        """Add integrals in iterates of x, and further ones in x alone, until `required` integrals are known in all."""
        laboratory = self._laboratory
        # Time-dependent integrals do not count here.
        self._gradients = IndependentGradients(laboratory.maps[0], [integral.function for integral in self.integrals])
        try:
            formulas, ratios, note = integrals_in_iterates(
                laboratory, required, self._gradients, budget, self._progress
            )
        except NoPoint:
            return
        self.skipped_searches += filter(None, [note])
        self.add_formulas(formulas)
        too_long = set[int]()
        for raw_ratio, origin in ratios:
            ratio = raw_ratio.with_limit(2 * laboratory.map.dim) if self._has_limit else raw_ratio
            verdict, evidence = verdict_on_ratio(laboratory, ratio, too_long)
            if verdict.holds:
                name = f"I{len(self.integrals) + len(self.in_iterates) + 1}"
                self.in_iterates.append(IntegralInIterates(name, ratio, origin, verdict, evidence))
