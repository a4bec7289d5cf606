"""Integrals of a map in closed form, found without being told anything but the map.

How many there are at least is found first: by theorems (hamiltonian_structure.py) and by the codimension of orbits,
which is measured (hirota_kimura.py). Then spaces of polynomials with a common cofactor are sought modulo a prime
(search.py); their ratios are the integrals. The coefficients are functions of eps and of the parameters that are left
as symbols; they are interpolated, and what comes out is put to the proof as an identity (laboratory.py). What the
theorems give and was not found is added. What is missing then is sought with iterates of x as letters (iterates.py).
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
from kahanmaps.algebra.work import SPENT, Budget
from kahanmaps.checks.claims import Certainty, Evidence
from kahanmaps.display_protocols import latex
from kahanmaps.documents.inline import as_file
from kahanmaps.errors import InputError
from kahanmaps.invariants.phase_functions import normalized
from kahanmaps.laboratory.defaults import budget_for
from kahanmaps.laboratory.laboratory import Laboratory, is_kept_by_flow
from kahanmaps.laboratory.modular_points import Independent, ModularMap, NoPoint, Point
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
from kahanmaps.laboratory.preserve.results import Search, closing_note, closing_period
from kahanmaps.laboratory.preserve.search import (
    AFFINE,
    bases_of,
    may_be_conjugate,
    repeat,
    search,
    take_relations,
)
from kahanmaps.maps.convention import resolve_eps
from kahanmaps.maps.kahan import SystemLike

_AFFINE_EVIDENCE = Evidence("theorem", "v.f(x) = 0, so v.(x~ - x) = 0: v.x is conserved")
_SHOWN_TERMS = 500
Formula = tuple[RationalFunction, str, str]  # where it comes from; in factors, where it is known so
_CONJUGATE_PRIMES = 4  # an irrational pencil splits modulo all of them and the first with a probability of 1/32


@dataclass(frozen=True)
class FoundIntegral:
    """An integral I(x, eps), a function of (variables, symbols, eps), with the verdict on I(x~) = I(x)."""

    name: str
    function: RationalFunction
    origin: str
    verdict: Certainty
    evidence: Evidence
    product: str = ""  # the formula in factors, where it is known so

    @property
    def text(self) -> str:
        """The formula."""
        return self.product or format_factored(self.function)

    @property
    def short_text(self) -> str:
        """The formula, or its size where it would fill pages."""
        sizes = len(self.function.numerator), len(self.function.denominator)
        if sum(sizes) <= _SHOWN_TERMS:
            return self.text
        return f"P/Q with {sizes[0]} and {sizes[1]} terms, which find-integrals writes out"

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
class TimeDependentIntegral:
    """An integral c^-n I(x) that depends on time, x being the n-th point of an orbit: I(x~) = c I(x), c a number.

    Of a flow it is exp(-c t) I(x), with I' = c I.
    """

    name: str
    integral: FoundIntegral
    factor: RationalFunction
    flow: bool = False

    @property
    def text(self) -> str:
        """The formula."""
        I = self.integral.text
        bracketed = I if I.isidentifier() else f"({I})"
        if self.flow:
            rate = format_polynomial(-self.factor.numerator)
            power = {"1": "t", "-1": "-t"}.get(rate, f"({rate})*t" if " " in rate else f"{rate}*t")
            return f"exp({power})*{bracketed}"
        return f"({format_rational_function(self.factor)})^-n*{bracketed}"

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
    """What `find_integrals` found.

    `integrals` are functionally independent, also together with those that depend on time, `time_dependent`, or
    those whose formulas contain iterates of x as letters, `in_iterates`. `profile` is what relations along orbits
    show (measured); `by_theorems` is how many independent integrals the Kahan map has by theorems
    (hamiltonian_structure.py), `theorems` says which (with symbols: at random values). `reason` says what is
    missing and why, empty where nothing is. `period_at_values` is the number of points of orbits that close where
    the symbols have the values of the file.
    """

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
        """What is special about the orbits: that they close; empty where they do not."""
        if self.profile.period is None and self.period_at_values is not None:
            values = ", ".join(f"{name} = {self.file.parameters[name]}" for name in self.symbols)
            if self.flow:
                return f"at {values} the right-hand side is 0, and every function an integral"
            return f"at {values} {closing_note(self.period_at_values, self.eps, self.file.map)}"
        return closing_note(self.profile.period, self.eps, self.file.map)

    @property
    def codimension(self) -> int:
        """How many independent integrals are known: shown by orbits, given by theorems, or found in closed form."""
        return max(self.profile.codimension, self.profile.with_known, self.by_theorems, self.found)

    @property
    def formulas(self) -> list[tuple[str, Certainty]]:
        """The formulas, those in iterates last, each with its verdict."""
        every: list[FoundIntegral | IntegralInIterates] = [*self.integrals, *self.in_iterates]
        return [(one.text, one.verdict) for one in every]

    @property
    def found(self) -> int:
        """How many have a formula."""
        return len(self.integrals) + len(self.in_iterates)

    @property
    def is_exact(self) -> bool:
        """Whether there can be no more than `codimension` integrals: else it is a lower bound.

        Relations of higher degrees, which were not tried, can show more, until orbits lie on curves; points, where
        they close.
        """
        dim, measured = self.profile.dim, bool(self.profile.nullities)
        closes = self.profile.period is not None or self.period_at_values is not None
        return self.codimension >= (dim - 1 if measured and not closes else dim)

    @property
    def count_text(self) -> str:
        """How many integrals there are, and how that is known."""
        tried = f"relations of degree up to {self.profile.degree} along orbits"
        if self.codimension == 0:
            if not self.profile.nullities:
                return "orbits were not measured"
            return f"there is no integral (measured, {tried})" if self.is_exact else f"none shows in {tried} (measured)"
        parts = [f"{self.by_theorems} by theorems: {self.theorems}"] if self.by_theorems else []
        if self.profile.nullities:
            shown = max(self.profile.codimension, self.profile.with_known, self.by_theorems)
            parts.append(f"measured: {tried} show {'no more' if shown == self.by_theorems else shown}")
            if self.found > shown:
                parts.append(f"{self.found} have formulas")
        at_least = "" if self.is_exact else "at least "
        return f"in all {at_least}{self.codimension} independent ({'; '.join(parts)})"

    @property
    def is_complete(self) -> bool:
        """Whether there is a closed form for every integral that is known."""
        return self.found >= self.codimension

    def rows(self) -> list[dict[str, str]]:
        """A row for each formula, for `pandas.DataFrame(found.rows())` and the like."""
        return [{"name": one.name, "formula": one.text, "verdict": str(one.verdict)} for one in self.integrals]

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            **self.of_flow,
            **attributes(self, "integrals"),
            **attributes(self, "found", "time_dependent", "in_iterates"),
            **attributes(self, "codimension", codimension_is_exact="is_exact"),
            **attributes(self, "by_theorems", relations="profile"),
            **attributes(self, "note", "reason", "primes"),
        }

    def toml_section(self) -> str:
        """The integrals as a section [integrals] of a system file, which `check-integrals` accepts.

        Empty where there are none; for a given eps a comment says that they hold there only.
        """
        every: list[FoundIntegral | IntegralInIterates] = [*self.integrals, *self.in_iterates]
        lines = [f'{one.name} = "{one.text}"' for one in every]
        return "\n".join([*self.toml_comments, "[integrals]", *lines, ""]) if lines else ""


def find_integrals(
    system: SystemLike,
    *,
    symbols: Sequence[str] = (),
    eps: Any = None,
    time_step: Any = None,
    flow: bool = False,
    max_degree: int | None = None,
    effort: int | Budget = 1,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
) -> IntegralSearch:
    """Independent integrals of a map in closed form, each with its verdict.

    Args:
        system: the map; a differential equation stands for its Kahan map.
        symbols: names of parameters that formulas are to contain; the others have the values of the file.
        eps: an exact number, the formulas are then for this eps only; None: formulas contain eps.
        time_step: 2 eps, in its place.
        flow: ask for the rational integrals of the differential equation instead.
        max_degree: the largest degree of relations along orbits; by default as the dimension and the budget allow.
        effort: 1, or more: each more doubles the work that the search may take, each less halves it.
        seed: of everything random.
        progress: is told what is being tried.

    Returns:
        An `IntegralSearch`. Its formulas are exact and proved or supported as identities; the number of integrals
        that orbits show is measured modulo two primes.

    Raises:
        InputError: for unknown symbols, symbols in a [family] file, and eps = 0.

    Source: petrera-pfadler-suris-2009, celledoni-2019, cmoq-2013.

    >>> from kahanmaps.documents.catalog import load
    >>> found = find_integrals(load("nahm_tetrahedral"))
    >>> [(one.text, str(one.verdict)) for one in found.integrals], found.codimension
    ([('-y*(3*x^2 - y^2)/(4*x^2*eps^2 + 4*y^2*eps^2 - 1)', 'proved')], 1)
    """
    file, eps = as_file(system), resolve_eps(eps, time_step)
    if max_degree is not None and max_degree < 1:
        raise InputError(f"found the largest degree {max_degree}, expected at least 1")
    laboratory = Laboratory(file, symbols, eps, seed, flow=flow, algebraic=True)
    return integrals_of(laboratory, max_degree, budget_for("integrals", effort), progress)


def integrals_of(
    laboratory: Laboratory, max_degree: int | None, budget: Budget, progress: Callable[[str], None]
) -> IntegralSearch:
    """What `find_integrals` finds, on the maps of a laboratory."""
    flow, seed = laboratory.flow, laboratory.asked[3]
    # Orbits; cheap searches and their formulas; products; larger relations and their formulas; iterates. What a stage
    # leaves goes to those after it, and none can take what belongs to these.
    stages = budget.share([3, 4, 1, 3, 3])
    collected = _Collected(laboratory, progress)
    # What theorems say of the integrals of a Kahan map, on each of the maps: without symbols these have one system.
    inherited = list[InheritedIntegrals]()
    if laboratory.system is not None and not flow and laboratory.root is None:
        systems = {
            values: inherited_integrals(laboratory.system.at(values), seed=seed)
            for values in {map_.values for map_ in laboratory.maps}
        }
        inherited = [systems[map_.values] for map_ in laboratory.maps]
    theorems, by_theorems = "", 0
    if inherited:
        at = ", ".join(laboratory.free_symbols)
        theorems = inherited[0].text + (f", at random values of {at}" if at else "")
        if not laboratory.defect:
            by_theorems = min(one.count(map_) for one, map_ in zip(inherited, laboratory.maps, strict=True))
    # The map modulo the first prime with the values that the file gives to the symbols, if it gives any.
    at_values, values = None, [laboratory.file.parameters.get(name) for name in laboratory.symbols]
    if values and None not in values:
        prime = laboratory.maps[0].prime
        residues = [int(GF(prime).convert(value)) for value in values]
        at_values = laboratory.map_at(prime, residues, laboratory.maps[0].eps)
    period_at_values = None if at_values is None or laboratory.defect else closing_period([at_values])

    def result(profile: Profile, reason: str) -> IntegralSearch:
        integrals = tuple(collected.integrals), profile, reason, by_theorems, theorems
        more = tuple(collected.time_dependent), tuple(collected.in_iterates)
        return IntegralSearch(*laboratory.asked, *integrals, *more, period_at_values, flow=flow)

    def known(map_: ModularMap, x: Point) -> list[list[int]]:
        return inherited[laboratory.maps.index(map_)].gradients(map_, x) if inherited else []

    cut = ""
    empty = Profile(laboratory.map.dim, (), (), None, True, False)
    if laboratory.defect:
        return result(empty, laboratory.defect)
    try:
        profile = orbit_profile(
            laboratory.maps, max_degree=max_degree, budget=next(stages), known=known, progress=progress
        )
        stage = next(stages)
        cofactors = laboratory.cofactors()
        # Of a system these would be too many, and few integrals of its map have other denominators than those.
        factors = [one.polynomial for one in cofactors if one.polynomial is not None]
        factors = factors if laboratory.field is not None else candidates(laboratory, cofactors, stage)
        denominators = denominators_among(factors, laboratory.map.dim)

        def quickly(map_: ModularMap) -> SpaceSearch:
            # Half of what is left, on each map: the rest is for formulas.
            return search(map_, profile, cofactors, denominators, budget=stage.part(0.5), progress=progress)

        base = laboratory.maps[0]
        base, found, formulas, reason = _formulas(laboratory, base, quickly(base), quickly, stage, progress)
    except NoPoint as error:
        return result(empty, str(error))
    collected.offer(formulas)
    if inherited and not laboratory.symbols:
        collected.add_by_theorems(inherited[0])
    stage = next(stages)
    if len(collected.integrals) < laboratory.map.dim - 1:
        progress("products of powers of known polynomials")
        collected.add_products(cofactors, stage)
    done, stage = result(profile, ""), next(stages)
    if not done.is_complete:
        # This may take longer than all that went before, whose formulas are therefore known by now.
        steps = len(found.steps)
        cut = take_relations(base, profile, found, LARGEST_SPAN, stage.part(0.5), progress)
        if len(found.steps) > steps:

            def thoroughly(map_: ModularMap) -> SpaceSearch:
                again = search(map_, profile, cofactors, denominators, budget=stage.part(0.5), progress=progress)
                take_relations(map_, profile, again, LARGEST_SPAN, stage.part(0.5), progress)
                return again

            _, found, formulas, reason = _formulas(laboratory, base, found, thoroughly, stage, progress)
            collected.offer(formulas)
            done = result(profile, "")
    if not flow and not done.is_complete and laboratory.root is None:
        collected.add_in_iterates(done.codimension, next(stages))
        done = result(profile, "")
    missing = done.codimension - done.found
    if missing <= 0:
        reason = ""
    elif not reason:
        have = "has" if missing == 1 else "have"
        reason = f"{missing} of the {done.codimension} independent integrals {have} no closed form P/Q {found.tried}"
        reason += ": coefficients of Hirota-Kimura bases are such integrals"
    reasons = [reason, *([found.cut, cut] if missing > 0 else []), *collected.cut]
    if at_values is not None:
        # Formulas with symbols may depend on each other, or vanish, at the values of the file.
        there = Independent(at_values)
        rows = [there.gradient(one.function) for one in done.integrals]
        rows += [gradient_of(one.ratio, laboratory.map, at_values, there.point) for one in done.in_iterates]
        left = sum(map(there.add, rows))
        if left < len(rows):
            at = ", ".join(f"{name} = {value}" for name, value in zip(laboratory.symbols, values, strict=True))
            how_many = f"only {left} of the {len(rows)} formulas {'is' if left == 1 else 'are'} independent"
            reasons.append(f"at {at} {how_many}: without --symbolic others may be found")
    if profile.cut and (profile.cut == SPENT or max_degree is not None or not profile.is_settled):
        reasons.append(f"relations of degree {profile.degree + 1} and more were not tried: {profile.cut}")
    elif not profile.agree:
        reasons.append("the orbits that were compared do not agree: try another --seed")
    return replace(done, reason="; ".join(filter(None, reasons)))


def _formulas(
    laboratory: Laboratory,
    base: ModularMap,
    found: SpaceSearch,
    look: Callable[[ModularMap], SpaceSearch],
    budget: Budget,
    progress: Callable[[str], None],
) -> tuple[ModularMap, SpaceSearch, list[Formula], str]:
    """The ratios of the polynomials `found` on the map `base`, and why there are no others; first the map and spaces.

    Where these may be conjugate over an extension of Q, `look` finds those on maps modulo other primes, where conjugate
    ones do not occur. Raises NoPoint.
    """
    if may_be_conjugate(found):
        for map_ in laboratory.other_maps(_CONJUGATE_PRIMES):
            if not budget.is_spent and repeat(found, map_, base.prime) is None:
                base, found = map_, look(map_)
    if not found.steps:
        return base, found, [], ""
    progress("interpolating closed forms")
    bases, reason = bases_of(laboratory, base.prime, found, budget)
    origins = [step.text for step, spaces in zip(found.steps, found.spaces, strict=True) for _ in spaces]
    formulas = list[Formula]()
    for (Q, *more), origin in zip(bases, origins, strict=False):
        for P in more:  # of P/Q and Q/P the one whose denominator becomes a number for eps = 0, if only one does
            P_is_number, Q_is_number = (substitute(F, {"eps": fmpq(0)}).is_constant() for F in (P, Q))
            is_inverse = P_is_number and not Q_is_number
            formulas.append((RationalFunction(Q, P) if is_inverse else RationalFunction(P, Q), origin, ""))
    return base, found, formulas, reason


class _Collected:
    """Integrals that do not depend on each other, with verdicts; none that was refuted.

    `cut` says what was not tried for lack of budget.
    """

    def __init__(self, laboratory: Laboratory, progress: Callable[[str], None]) -> None:
        self._laboratory, self._progress = laboratory, progress
        self.cut: list[str] = []
        self._gradients = Independent(laboratory.maps[0])
        self.integrals: list[FoundIntegral] = []
        self.time_dependent: list[TimeDependentIntegral] = []
        self.in_iterates: list[IntegralInIterates] = []

    def offer(self, formulas: Sequence[Formula]) -> None:
        """Take those that do not depend on others and pass as identities, short ones first."""

        def size(formula: Formula) -> tuple[int, int, list[list[int]]]:
            """By size, then by monomials: the order must not depend on the primes."""
            P = formula[0].numerator
            return degree(P), len(P), [[-int(e) for e in monomial] for monomial in P.monoms()]

        for function, origin, product in sorted(map(self._normalized, formulas), key=size):
            row = self._gradients.gradient(function)
            if not self._gradients.adds(row):
                continue
            self._progress("verifying an integral")
            laboratory, evidence = self._laboratory, _AFFINE_EVIDENCE
            n, monomials = laboratory.map.dim, function.numerator.monoms()
            is_affine = function.is_polynomial and all(sum(map(int, m[:n])) <= 1 and not m[-1] for m in monomials)
            system = None if laboratory.flow else laboratory.system
            if is_affine and system is not None and is_kept_by_flow(system, function):
                verdict = Certainty.PROVED  # v.x with v.f = 0; v may contain the symbols
            else:
                verdict, evidence = laboratory.verdict_on(function)
            if verdict.holds:
                self._add(row, function, origin, verdict, evidence, product)

    def _normalized(self, formula: Formula) -> Formula:
        """The formula as it is shown: with its limit eps -> 0, an integral of the flow, where there is one."""
        function, origin, product = formula
        if not self._has_limit:
            return formula
        shown = normalized(function, self._laboratory.map.dim).function
        return shown, origin, product if shown == function else ""

    @property
    def _has_limit(self) -> bool:
        """Whether the map approximates a flow, for every eps; or it is the flow itself."""
        laboratory = self._laboratory
        of_flow = laboratory.flow or (laboratory.map.has_eps and laboratory.map.time_steps != 0)
        return of_flow and laboratory.eps is None and laboratory.root is None

    def _add(self, row: list[int], *known: Any) -> None:
        self._gradients.add(row)
        name = f"{'F' if self._laboratory.flow else 'I'}{len(self.integrals) + 1}"
        self.integrals.append(FoundIntegral(name, *known))

    def add_by_theorems(self, inherited: InheritedIntegrals) -> None:
        """Those of the theorems, as far as they can be written out."""
        laboratory = self._laboratory
        affine, context = len(inherited.quotient.integrals), ring((*laboratory.map.variables, "eps"))
        for k, row in enumerate(inherited.gradients(laboratory.maps[0], self._gradients.point)):
            if not self._gradients.adds(row):
                continue
            if k < affine:
                terms = zip(context.gens(), inherited.quotient.integrals[k], strict=False)
                form = RationalFunction(sum((x * v for x, v in terms), context.constant(0)), context.constant(1))
                self._add(row, form, AFFINE, Certainty.PROVED, _AFFINE_EVIDENCE)
                continue
            field = FunctionField((*laboratory.map.variables, "eps"), reduces=False)
            eps = field.variables[-1] if laboratory.eps is None else field.convert(laboratory.eps)
            try:
                value = inherited.modified(k - affine, field, eps, field.variables[:-1])
            except BudgetExceeded:
                continue  # too long to be written out
            function = RationalFunction.reduced(value.above, value.below)
            is_hamiltonian = inherited.forms[k - affine].rank() == len(inherited.quotient.free)
            what = "f = J grad H with" if is_hamiltonian else "K f = grad H with"
            summary = f"{what} a constant skew matrix {'J' if is_hamiltonian else 'K'}"
            summary = f"{summary}: H + grad H . (x~ - x)/3 is conserved (cmoq-2013)"
            evidence = Evidence("theorem", summary, {"H": str(inherited.hamiltonian(k - affine))})
            formula = self._normalized((function, "modified Hamiltonian (cmoq-2013)", ""))
            self._add(row, *formula[:2], Certainty.PROVED, evidence)

    def add_products(self, cofactors: Sequence[Cofactor], budget: Budget) -> None:
        """Products of powers of known polynomials, and such that depend on time."""
        laboratory, origin = self._laboratory, "product of powers of known polynomials"
        if budget.is_spent:
            self.cut.append(f"products of powers of known polynomials were not tried: {SPENT}")
            return
        try:
            products = products_of(laboratory, candidates(laboratory, cofactors, budget))
        except NoPoint:
            return
        written = ((one, one.function) for one in products.integrals)
        self.offer([(function, origin, one.text) for one, function in written if function is not None])
        for product in products.time_dependent:
            function = product.function
            if function is None or len(self.integrals) + len(self.time_dependent) >= laboratory.map.dim:
                continue
            row = self._gradients.gradient(function)
            if not self._gradients.adds(row):
                continue
            verdict, evidence = laboratory.verdict_on(function, factor=product.constant)
            if verdict.holds:
                self._gradients.add(row)
                name = f"T{len(self.time_dependent) + 1}"
                one = FoundIntegral(name, function, origin, verdict, evidence, product.text)
                self.time_dependent.append(TimeDependentIntegral(name, one, product.constant, laboratory.flow))

    def add_in_iterates(self, wanted: int, budget: Budget) -> None:
        """Those in iterates of x, and more of them in x, until there are as many as wanted."""
        laboratory = self._laboratory
        self._gradients = Independent(laboratory.maps[0], [one.function for one in self.integrals])  # free of time
        try:
            plain, ratios, cut = integrals_in_iterates(laboratory, wanted, self._gradients, budget, self._progress)
        except NoPoint:
            return
        self.cut += filter(None, [cut])
        self.offer(plain)
        too_long = set[int]()
        for found, origin in ratios:
            ratio = found.with_limit(2 * laboratory.map.dim) if self._has_limit else found
            verdict, evidence = verdict_on_ratio(laboratory, ratio, too_long)
            if verdict.holds:
                name = f"I{len(self.integrals) + len(self.in_iterates) + 1}"
                self.in_iterates.append(IntegralInIterates(name, ratio, origin, verdict, evidence))
