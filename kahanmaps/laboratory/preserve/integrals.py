"""Integrals of a map in closed form, found without being told anything but the map.

How many there are at least is found first: by theorems (inherited.py) and by the codimension of orbits, which is
measured (hirota_kimura.py). Then spaces of polynomials with a common cofactor are sought modulo a prime (search.py);
their ratios are the integrals. The coefficients are functions of eps and of the parameters that are left as symbols;
they are interpolated (closed_forms.py), and what comes out is put to the proof as an identity (identities.py). What the
theorems give and was not found is added. What is missing then is sought with iterates of x as letters (iterates.py).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from flint import fmpq, fmpq_mpoly, fmpz

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.functions import BudgetExceeded, FunctionField
from kahanmaps.algebra.plain import attributes
from kahanmaps.algebra.polynomials import RationalFunction, degree, evaluate, ring
from kahanmaps.algebra.text import format_factored, format_polynomial, format_rational_function
from kahanmaps.checks.claims import Evidence, Verdict
from kahanmaps.displayed import Printed, latex
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.modular_points import ModularMap, NoPoint, Point, rank
from kahanmaps.laboratory.preserve.cofactors import Cofactor
from kahanmaps.laboratory.preserve.flow import is_kept_by_flow
from kahanmaps.laboratory.preserve.hirota_kimura import Profile, orbit_profile
from kahanmaps.laboratory.preserve.inherited import InheritedIntegrals, inherited_integrals
from kahanmaps.laboratory.preserve.interpolated import bases_of
from kahanmaps.laboratory.preserve.iterates import (
    IntegralInIterates,
    gradient_of,
    integrals_in_iterates,
    verdict_on_ratio,
)
from kahanmaps.laboratory.preserve.products import candidates, products_of
from kahanmaps.laboratory.preserve.search import AFFINE, Found, may_be_conjugate, repeat, search
from kahanmaps.maps.implicit import BirationalMap
from kahanmaps.systems.quadratic import QuadraticSystem

_AFFINE_EVIDENCE = Evidence("theorem", "v.f(x) = 0, so v.(x~ - x) = 0: v.x is conserved")
_SHOWN_TERMS = 500
_CONJUGATE_PRIMES = 4  # an irrational pencil splits modulo all of them and the first with a probability of 1/32


@dataclass(frozen=True)
class FoundIntegral:
    """An integral I(x, eps), a function of (variables, symbols, eps), with the verdict on I(x~) = I(x)."""

    name: str
    function: RationalFunction
    origin: str
    verdict: Verdict
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
class TimedIntegral:
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
class IntegralSearch(Printed):
    """What `find_integrals` found.

    `integrals` are functionally independent, also together with those that depend on time, `in_time`, or those whose
    formulas contain iterates of x as letters, `in_iterates`. `profile` is what relations along orbits show (measured);
    `by_theorems` is how many independent integrals the Kahan map has by the theorems of inherited.py, and `theorems`
    says which (with symbols: at random values). `reason` says what is missing and why, empty where nothing is. `eps` is
    None for every eps.
    """

    file: SystemFile
    symbols: tuple[str, ...]
    eps: fmpq | None
    integrals: tuple[FoundIntegral, ...]
    profile: Profile
    reason: str
    primes: tuple[int, ...]
    seed: int
    by_theorems: int
    theorems: str
    in_time: tuple[TimedIntegral, ...] = ()
    flow: bool = False  # whether the integrals are those of the differential equation
    in_iterates: tuple[IntegralInIterates, ...] = ()

    @property
    def note(self) -> str:
        """What is special about the orbits: that they close; empty where they do not."""
        return closing_note(self.profile.period, self.eps, self.file.map)

    @property
    def codimension(self) -> int:
        """How many independent integrals are known: shown by orbits, given by theorems, or found in closed form."""
        return max(self.profile.codimension, self.profile.with_known, self.by_theorems, self.found)

    @property
    def formulas(self) -> list[tuple[str, Verdict]]:
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
        return self.codimension >= (dim - 1 if measured and self.profile.period is None else dim)

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
            **({"flow": True} if self.flow else {}),
            **attributes(self, "integrals"),
            **attributes(self, "found", "in_time", "in_iterates"),
            **attributes(self, "codimension", codimension_is_exact="is_exact"),
            **attributes(self, "by_theorems", relations="profile"),
            **attributes(self, "note", "reason", "primes"),
        }

    def toml_section(self) -> str:
        """The integrals as a section [integrals] of a system file, which `check-integrals` accepts.

        Empty where there are none; for a given eps a comment says that they hold there only. Those in iterates are
        comments.
        """
        if not self.integrals:
            return ""
        lines = ["[integrals]", *(f'{one.name} = "{one.text}"' for one in self.integrals)]
        lines += [f"# {one.name}: {one.text}" for one in self.in_iterates]
        return "\n".join([*toml_comment(self.eps, self.file.map), *lines]) + "\n"


def closing_note(period: int | None, eps: fmpq | None, map_: BirationalMap) -> str:
    """What orbits that close after `period` steps mean at this eps (None: at every one); empty where they do not.

    >>> from kahanmaps.documents.catalog import load
    >>> closing_note(4, fmpq(1), load("weierstrass").map)
    'orbits close after 4 steps: at eps = 1 the map is periodic (measured); nothing follows for other eps'
    """
    if period is None:
        return ""
    closes = f"orbits close after {period} step{'s' * (period != 1)}"
    if not map_.has_eps:
        return f"{closes}: the map is periodic (measured)"
    if eps is None:
        return f"{closes} at every eps that was tried: the map is periodic (measured)"
    return f"{closes}: at eps = {eps} the map is periodic (measured); nothing follows for other eps"


def toml_comment(eps: fmpq | None, map_: BirationalMap) -> list[str]:
    """The line of a system file that says that formulas hold at one eps only; none where eps is in them."""
    if eps is None:
        return []
    step = f" (time step 2 eps = {2 * eps})" if map_.has_time_step else ""
    return [f"# for eps = {eps} only{step}: check with --eps {eps}"]


def find_integrals(
    file: SystemFile,
    *,
    symbols: Sequence[str] = (),
    eps: Any = None,
    flow: bool = False,
    max_degree: int | None = None,
    seconds: float = 60.0,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
) -> IntegralSearch:
    """Independent integrals of a map in closed form, each with its verdict.

    Args:
        file: the map; a differential equation stands for its Kahan map.
        symbols: names of parameters that formulas are to contain; the others have the values of the file.
        eps: an exact number, the formulas are then for this eps only; None: formulas contain eps (time step 2 eps).
        flow: ask for the rational integrals of the differential equation instead.
        max_degree: the largest degree of relations along orbits; by default as dimension and time allow.
        seconds: the time that the search may take, about.
        seed: of everything random.
        progress: is told what is being tried.

    Returns:
        An `IntegralSearch`. Its formulas are exact and proved or supported as identities; the number of integrals
        that orbits show is measured modulo two primes.

    Raises:
        InputError: for unknown symbols, symbols in a [family] file, eps = 0 and less than no time.

    Source: petrera-pfadler-suris-2009, celledoni-2019, cmoq-2013.

    >>> from kahanmaps.documents.catalog import load
    >>> found = find_integrals(load("nahm_tetrahedral"))
    >>> [(one.text, str(one.verdict)) for one in found.integrals], found.codimension
    ([('y*(3*x^2 - y^2)/(4*x^2*eps^2 + 4*y^2*eps^2 - 1)', 'proved')], 1)
    """
    if not seconds > 0:
        raise InputError(f"found {seconds} seconds, expected a time above 0")
    if max_degree is not None and max_degree < 1:
        raise InputError(f"found the largest degree {max_degree}, expected at least 1")
    laboratory = Laboratory(file, symbols, eps, seed, flow=flow, algebraic=True)
    deadline = time.monotonic() + seconds
    primes = laboratory.primes

    inherited: list[InheritedIntegrals] = []  # of each map; theorems speak of Kahan maps
    if laboratory.system is not None and not flow and laboratory.root is None:
        # Without symbols the maps have the same values, none, and one system.
        systems = {
            values: inherited_integrals(laboratory.system.at(values), seed=seed)
            for values in {map_.values for map_ in laboratory.maps}
        }
        inherited = [systems[map_.values] for map_ in laboratory.maps]
    by_theorems = 0
    in_time: list[TimedIntegral] = []
    in_iterates: list[IntegralInIterates] = []

    def gradients(map_: ModularMap, x: Point) -> list[list[int]]:
        return inherited[laboratory.maps.index(map_)].gradients(map_, x) if inherited else []

    def result(integrals: Sequence[FoundIntegral], profile: Profile, reason: str) -> IntegralSearch:
        values = f", at random values of {', '.join(symbols)}" if laboratory.free_symbols else ""
        theorems = inherited[0].text + values if inherited else ""
        found = (tuple(integrals), profile, reason, primes, seed, by_theorems, theorems)
        more = tuple(in_time), flow, tuple(in_iterates)
        return IntegralSearch(file, laboratory.free_symbols, laboratory.eps, *found, *more)

    empty = Profile(laboratory.map.dim, (), (), None, True, False)
    if laboratory.defect:
        return result([], empty, laboratory.defect)
    if inherited:
        by_theorems = min(one.count(map_) for one, map_ in zip(inherited, laboratory.maps, strict=True))
    try:
        profile = orbit_profile(
            laboratory.maps, max_degree=max_degree, seconds=seconds / 3, known=gradients, progress=progress
        )
        cofactors = laboratory.cofactors()
        base, found = _search(laboratory, profile, cofactors, deadline, progress)
        formulas: list[tuple[RationalFunction, str]] = []
        reason = ""
        if found.steps:
            progress("interpolating closed forms")
            bases, reason = bases_of(laboratory, base.prime, found, cofactors, deadline)
            origins = [step.text for step, spaces in zip(found.steps, found.spaces, strict=True) for _ in spaces]
            formulas = [
                (_ratio(P, Q), origin) for (Q, *more), origin in zip(bases, origins, strict=False) for P in more
            ]
    except NoPoint as error:
        return result([], empty, str(error))
    integrals = _independent(laboratory, formulas, progress)
    if inherited and not laboratory.symbols:
        integrals = _by_theorems(laboratory, inherited[0], integrals, deadline)
    if len(integrals) < laboratory.map.dim - 1:
        progress("products of powers of known polynomials")
        integrals, in_time = _products(laboratory, cofactors, integrals, progress)
    done = result(integrals, profile, "")
    if not flow and not done.is_complete and laboratory.root is None:
        integrals, in_iterates = _in_iterates(laboratory, done, deadline, progress)
        done = result(integrals, profile, "")
    missing = done.codimension - done.found
    if missing <= 0:
        reason = ""
    elif not reason:
        have = "has" if missing == 1 else "have"
        reason = (
            f"{missing} of the {done.codimension} independent integrals {have} no closed form P/Q of the degrees and "
            "sizes that were tried: coefficients of Hirota-Kimura bases are such integrals"
        )
    reasons = (reason, _at_the_values(laboratory, done), _unfinished(profile, max_degree))
    return replace(done, reason="; ".join(filter(None, reasons)))


def _at_the_values(laboratory: Laboratory, search: IntegralSearch) -> str:
    """That formulas with symbols depend on each other, or vanish, where these have the values that the file gives."""
    values = [laboratory.file.parameters.get(name) for name in laboratory.symbols]
    if not values or None in values:
        return ""
    prime = laboratory.maps[0].prime
    map_ = laboratory.map_at(prime, [int(GF(prime).convert(value)) for value in values], laboratory.maps[0].eps)
    point = map_.random_point()
    rows = [gradient_at(map_, one.function, point) for one in search.integrals]
    rows += [gradient_of(one.ratio, laboratory.map, map_, point) for one in search.in_iterates]
    left = rank(rows, prime)
    if left == len(rows):
        return ""
    told = ", ".join(f"{name} = {value}" for name, value in zip(laboratory.symbols, values, strict=True))
    return f"at {told} only {left} of the {len(rows)} formulas are independent: without --symbolic others may be found"


def _unfinished(profile: Profile, max_degree: int | None) -> str:
    """What the profile leaves open; empty where it left nothing that was asked for or is likely to show more."""
    if not profile.complete and (max_degree is not None or not profile.is_settled):
        return f"relations of degree {profile.degree + 1} and more were not tried: too many unknowns or too little time"
    return "" if profile.agree else "the orbits that were compared do not agree: try another --seed"


def _search(
    laboratory: Laboratory,
    profile: Profile,
    cofactors: Sequence[Cofactor],
    deadline: float,
    progress: Callable[[str], None],
) -> tuple[ModularMap, Found]:
    """What is found modulo a prime where spaces that are conjugate over an extension of Q do not occur, and the map."""
    base = laboratory.maps[0]
    found = search(base, profile, cofactors, (deadline - time.monotonic()) / 2, progress)
    if may_be_conjugate(found):
        for map_ in laboratory.other_maps(_CONJUGATE_PRIMES):
            if time.monotonic() < deadline and repeat(found, map_, cofactors, base.prime) is None:
                base, found = map_, search(map_, profile, cofactors, (deadline - time.monotonic()) / 2, progress)
    return base, found


def _ratio(P: fmpq_mpoly, Q: fmpq_mpoly) -> RationalFunction:
    """P/Q, or Q/P where P is the one that becomes a number for eps = 0."""
    origin: dict[str | int, int | fmpz | fmpq] = {"eps": 0}
    if P.subs(origin).is_constant() and not Q.subs(origin).is_constant():
        return RationalFunction(Q, P)
    return RationalFunction(P, Q)


def _products(
    laboratory: Laboratory,
    cofactors: Sequence[Cofactor],
    integrals: Sequence[FoundIntegral],
    progress: Callable[[str], None],
) -> tuple[list[FoundIntegral], list[TimedIntegral]]:
    """The integrals and those among products of powers that do not depend on them; and such that depend on time."""
    origin = "product of powers of known polynomials"
    try:
        products = products_of(laboratory, candidates(laboratory, cofactors))
    except NoPoint:
        return list(integrals), []
    written = [(function, one) for one in products.integrals if (function := one.function) is not None]
    text = {id(function): one.text for function, one in written}
    found = _independent(laboratory, [(function, origin) for function, _ in written], progress, integrals)
    found = [replace(one, product=text.get(id(one.function), one.product)) for one in found]
    in_time: list[TimedIntegral] = []
    map_ = laboratory.maps[0]
    point = map_.random_point()
    rows = [gradient_at(map_, one.function, point) for one in found]
    for product in products.in_time:
        function = product.function
        if function is None or len(found) + len(in_time) >= laboratory.map.dim:
            continue
        row = gradient_at(map_, function, point)
        if rank([*rows, row], map_.prime) == len(rows):
            continue
        verdict, evidence = laboratory.verdict_on(function, factor=product.constant)
        if verdict.holds:
            rows.append(row)
            name = f"T{len(in_time) + 1}"
            one = FoundIntegral(name, function, origin, verdict, evidence, product.text)
            in_time.append(TimedIntegral(name, one, product.constant, laboratory.flow))
    return found, in_time


def _in_iterates(
    laboratory: Laboratory, search: IntegralSearch, deadline: float, progress: Callable[[str], None]
) -> tuple[list[FoundIntegral], list[IntegralInIterates]]:
    """The integrals found so far with more of them in x, and those in iterates of x; none that was refuted."""
    map_, known = laboratory.maps[0], search.integrals
    point = map_.random_point()
    rows = [gradient_at(map_, one.function, point) for one in known]
    try:
        plain, ratios = integrals_in_iterates(laboratory, search.codimension, rows, point, deadline, progress)
    except NoPoint:
        return list(known), []
    integrals, found = _independent(laboratory, plain, progress, known), list[IntegralInIterates]()
    too_long = set[int]()
    for ratio, origin in ratios:
        verdict, evidence = verdict_on_ratio(laboratory, ratio, too_long)
        if verdict.holds:
            name = f"I{len(integrals) + len(found) + 1}"
            found.append(IntegralInIterates(name, ratio, origin, verdict, evidence))
    return integrals, found


def _independent(
    laboratory: Laboratory,
    formulas: Sequence[tuple[RationalFunction, str]],
    progress: Callable[[str], None],
    known: Sequence[FoundIntegral] = (),
) -> list[FoundIntegral]:
    """The known integrals and those that do not depend on them and each other, with verdicts; none that was refuted."""
    map_ = laboratory.maps[0]
    point = map_.random_point()
    found = list(known)
    rows = [gradient_at(map_, one.function, point) for one in known]

    # By size, then by monomials: the order must not depend on the primes.
    def size(P: fmpq_mpoly) -> tuple[int, int, list[list[int]]]:
        return degree(P), len(P), [[-int(e) for e in monomial] for monomial in P.monoms()]

    by_size = sorted(formulas, key=lambda pair: size(pair[0].numerator))
    for function, origin in by_size:
        row = gradient_at(map_, function, point)
        if rank([*rows, row], map_.prime) == len(rows):
            continue
        progress("verifying an integral")
        if not laboratory.flow and laboratory.system is not None and _is_affine_integral(laboratory.system, function):
            verdict, evidence = Verdict.PROVED, _AFFINE_EVIDENCE
        else:
            verdict, evidence = laboratory.verdict_on(function)
        if verdict.holds:
            rows.append(row)
            name = f"{'F' if laboratory.flow else 'I'}{len(found) + 1}"
            found.append(FoundIntegral(name, function, origin, verdict, evidence))
    return found


def _is_affine_integral(system: QuadraticSystem, function: RationalFunction) -> bool:
    """Whether the function is v.x with v.f = 0; v may contain the symbols."""
    if not function.is_polynomial:
        return False
    is_affine = all(sum(map(int, m[: system.dim])) <= 1 and not m[-1] for m in function.numerator.monoms())
    return is_affine and is_kept_by_flow(system, function)


def gradient_at(map_: ModularMap, function: RationalFunction, point: Sequence[int]) -> list[int]:
    """A multiple of the gradient of P/Q with respect to the variables, modulo the prime."""
    field = GF(map_.prime)
    at = [field.convert(c) for c in (*point, *map_.values, map_.eps)]
    P, Q = evaluate(function.numerator, field, at), evaluate(function.denominator, field, at)
    return [
        int(
            evaluate(function.numerator.derivative(k), field, at) * Q
            - evaluate(function.denominator.derivative(k), field, at) * P
        )
        for k in range(map_.dim)
    ]


def _by_theorems(
    laboratory: Laboratory, inherited: InheritedIntegrals, known: Sequence[FoundIntegral], deadline: float
) -> list[FoundIntegral]:
    """The integrals of the theorems that do not depend on the known ones, as far as they can be written out."""
    map_ = laboratory.maps[0]
    point = map_.random_point()
    rows = [gradient_at(map_, one.function, point) for one in known]
    found = list(known)
    affine = len(inherited.quotient.integrals)
    for k, row in enumerate(inherited.gradients(map_, point)):
        if rank([*rows, row], map_.prime) == len(rows):
            continue
        if k < affine:
            function, origin, evidence = _affine(laboratory, inherited.quotient.integrals[k])
        else:
            written = None if time.monotonic() > deadline else _modified(laboratory, inherited, k - affine)
            if written is None:
                continue
            function, origin, evidence = written
        rows.append(row)
        found.append(FoundIntegral(f"I{len(found) + 1}", function, origin, Verdict.PROVED, evidence))
    return found


def _affine(laboratory: Laboratory, vector: Sequence[fmpz]) -> tuple[RationalFunction, str, Evidence]:
    """v.x as a function of the variables and eps."""
    context = ring((*laboratory.map.variables, "eps"))
    total = sum((gen * v for gen, v in zip(context.gens(), vector, strict=False)), context.constant(0))
    return RationalFunction(total, context.constant(1)), AFFINE, _AFFINE_EVIDENCE


def _modified(
    laboratory: Laboratory, inherited: InheritedIntegrals, k: int
) -> tuple[RationalFunction, str, Evidence] | None:
    """The modified Hamiltonian that belongs to the k-th form; None where it is too long to be written out."""
    field = FunctionField((*laboratory.map.variables, "eps"), reduces=False)
    eps = field.variables[-1] if laboratory.eps is None else field.convert(laboratory.eps)
    try:
        value = inherited.modified(k, field, eps, field.variables[:-1])
    except BudgetExceeded:
        return None
    common = value.above.gcd(value.below)
    function = RationalFunction(value.above / common, value.below / common)
    is_hamiltonian = inherited.forms[k].rank() == len(inherited.quotient.free)
    what = (
        "f = J grad H with a constant skew matrix J" if is_hamiltonian else "K f = grad H with a constant skew matrix K"
    )
    summary = f"{what}: H + grad H . (x~ - x)/3 is conserved (cmoq-2013)"
    evidence = Evidence("theorem", summary, {"H": str(inherited.hamiltonian(k))})
    return function, "modified Hamiltonian (cmoq-2013)", evidence
