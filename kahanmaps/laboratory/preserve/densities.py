"""Invariant measures dx/phi of a map with a polynomial phi, or a product of powers of polynomials, in closed form.

dx/phi is invariant if phi(x~) = det dPhi(x) phi(x): phi is a discrete Darboux polynomial with the cofactor det dPhi.
All of them up to a degree are one null space modulo a prime. Products of powers of known polynomials, of any degree,
are found by their exponents (products.py). Source: celledoni-2019.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from math import comb, prod
from typing import Any

from flint import fmpq, fmpz

from kahanmaps.algebra.polynomials import RationalFunction, coefficients_in, degree_in, primitive_part, ring
from kahanmaps.algebra.printing import attributes, format_factored
from kahanmaps.algebra.work import SPENT, Budget
from kahanmaps.checks.claims import Certainty, Evidence
from kahanmaps.checks.theorems import product_density_invariant
from kahanmaps.display_protocols import latex
from kahanmaps.documents.inline import as_file
from kahanmaps.errors import InputError, counted
from kahanmaps.laboratory.defaults import budget_for
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.modular_points import ModularMap, NoPoint
from kahanmaps.laboratory.preserve.darboux.cofactors import (
    DETERMINANT,
    CofactorProduct,
    Sample,
    cofactor_space,
    determinant_polynomial,
    points_needed,
)
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import DarbouxSpace
from kahanmaps.laboratory.preserve.integrals import FoundIntegral, find_integrals
from kahanmaps.laboratory.preserve.poisson.hamiltonian_structure import MAX_DIMENSION, constant_structures
from kahanmaps.laboratory.preserve.products import candidates, products_of
from kahanmaps.laboratory.preserve.results import Search, closing_note, closing_period
from kahanmaps.maps.convention import resolve_eps
from kahanmaps.maps.kahan import SystemLike

_MAX_UNKNOWNS = 1000
_MAX_DEGREE = 12
_ONCE = CofactorProduct((1,), 1)


@dataclass(frozen=True)
class FoundDensity:
    """A density phi(x, eps): the measure dx/phi is invariant, with the verdict on that; `product` is phi in factors."""

    function: RationalFunction
    verdict: Certainty
    evidence: Evidence
    product: str = ""

    def degree(self, dim: int) -> int:
        """The larger of the degrees of numerator and denominator in the variables."""
        return max(degree_in(part, dim) for part in (self.function.numerator, self.function.denominator))

    @property
    def text(self) -> str:
        """The formula of phi."""
        return self.product or format_factored(self.function)

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {"phi": self.text, "latex": latex(self.function), **attributes(self, "verdict", "evidence")}


@dataclass(frozen=True)
class DensitySearch(Search):
    """What `find_densities` found.

    `densities` span all phi of the least degree that has some, after a proved one where these are not, or are
    det(I - eps f') of a Hamiltonian system, which need not be of least degree; `degree` is the largest that was tried,
    and `cut` says why not all that was asked for was tried, empty where it was. `period` is the number of points of
    orbits that close. `turning` is a phi with phi(x~) = -det dPhi(x) phi(x): the map turns dx/phi into -dx/phi, and
    |dx/phi| is invariant.
    """

    densities: tuple[FoundDensity, ...]
    degree: int
    cut: str
    period: int | None = None
    anti_invariant: FoundDensity | None = None

    @property
    def none_there(self) -> bool:
        """Whether all that was asked for was tried, and nothing is a density: measured."""
        return not self.densities and not self.cut

    @property
    def is_open(self) -> bool:
        """Whether nothing was found of a map, so that factors of integrals may be tried."""
        return not (self.densities or self.anti_invariant or self.flow)

    @property
    def reason(self) -> str:
        """Why the search ended without a density, or before all that was asked for was tried."""
        if self.none_there:
            degree = f"no polynomial of degree at most {self.degree}"
            return f"{degree}, and no product of powers of known ones, is a density"
        return self.cut

    @property
    def shown(self) -> tuple[FoundDensity, ...]:
        """The one that stands for all, which are this one times integrals: the shortest, proved if any is."""
        return tuple(sorted(self.densities, key=lambda one: (one.verdict is not Certainty.PROVED, len(one.text)))[:1])

    @property
    def further(self) -> str:
        """That there are more than the one that is shown; empty where there are not."""
        if len(self.densities) < 2:
            return ""
        others = len(self.densities) - 1
        so = f"so {'is' if others == 1 else 'are'} {counted(others, 'further polynomial')}"
        return f"phi times any integral is a density again: {so}, which --json lists"

    @property
    def note(self) -> str:
        """That orbits close, and for which eps; of which phi the sign changes; empty where there is nothing to say."""
        closes = closing_note(self.period, self.eps, self.file.map)
        if self.anti_invariant is None:
            return closes
        turns = f"|dx/phi| is invariant for phi = {self.anti_invariant.text}: phi(x~) = -det dPhi(x) phi(x)"
        return "; ".join(filter(None, (f"{turns} ({self.anti_invariant.verdict})", closes)))

    def rows(self) -> list[dict[str, str]]:
        """A row for each formula, for `pandas.DataFrame(found.rows())` and the like."""
        return [{"name": "phi", "formula": one.text, "verdict": str(one.verdict)} for one in self.densities]

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        more = attributes(self, "period", "note", "reason", "primes")
        return {**self.of_flow, **attributes(self, "densities", degree_tried="degree"), **more}

    def toml_section(self) -> str:
        """The density that is shown as a section [density] of a system file, which `check-measure` accepts.

        Empty where there is none; for a given eps a comment says that it holds there only.
        """
        if not self.densities:
            return ""
        return "\n".join([*self.toml_comments, "[density]", f'phi = "{self.shown[0].text}"', ""])


def find_densities(
    system: SystemLike,
    *,
    symbols: Sequence[str] = (),
    eps: Any = None,
    time_step: Any = None,
    flow: bool = False,
    max_degree: int | None = None,
    integrals: Sequence[FoundIntegral] | None = None,
    effort: int | Budget = 1,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
) -> DensitySearch:
    """The polynomials phi of the least degree for which the map preserves dx/phi; failing these, a product of powers.

    Args:
        system: the map; a differential equation stands for its Kahan map.
        symbols: names of parameters that formulas are to contain; the others have the values of the file.
        eps: an exact number, or None for formulas that contain eps.
        time_step: 2 eps, in its place.
        flow: ask for those of the differential equation instead, div(f/phi) = 0.
        max_degree: of phi; by default as the number of unknowns allows, at most 12.
        integrals: those that are known: where nothing else is found phi may be a product of powers of their factors.
            By default they are then sought.
        effort: 1, or more: each more doubles the work that the search may take, each less halves it.
        seed: of everything random.
        progress: is told what is being tried.

    Returns:
        A `DensitySearch`; formulas are exact, proved or supported. Finding none up to a degree is measured.

    Raises:
        InputError: for unknown symbols, symbols in a [family] file, eps = 0, and a negative degree.

    Source: celledoni-2019.

    >>> from kahanmaps.documents.catalog import load
    >>> found = find_densities(load("lotka_volterra"))
    >>> [(one.text, str(one.verdict)) for one in found.densities]
    [('x*y', 'proved')]
    """
    file, eps = as_file(system), resolve_eps(eps, time_step)
    if max_degree is not None and max_degree < 0:
        raise InputError(f"found the largest degree {max_degree}, expected at least 0")
    laboratory = Laboratory(file, symbols, eps, seed, flow=flow, algebraic=True)
    return densities_of(laboratory, max_degree, integrals, budget_for("densities", effort), progress)


def densities_of(
    laboratory: Laboratory,
    max_degree: int | None,
    integrals: Sequence[FoundIntegral] | None,
    budget: Budget,
    progress: Callable[[str], None] = lambda _: None,
) -> DensitySearch:
    """What `find_densities` finds, on the maps of a laboratory."""
    flow = laboratory.flow
    if laboratory.defect:
        return DensitySearch(*laboratory.asked, (), -1, laboratory.defect, flow=flow)
    period = None if flow else closing_period(laboratory.maps)
    product = anti_invariant = None
    theorem, dim, cut = _theorem(laboratory), laboratory.map.dim, ""
    if theorem is not None and (max_degree is None or theorem.degree(dim) <= max_degree):
        densities, tried = [theorem], theorem.degree(dim)
    else:
        progress("densities that are products")
        stages = budget.share([1, 2, 2])  # products; polynomials; integrals, for their factors
        product, anti_invariant = _products(laboratory, max_degree, next(stages))
        # The first search for integrals is worth as much as high degrees; a caller who has done it needs none.
        second = budget if integrals is not None or product is not None else next(stages)
        densities, tried, cut = _search(laboratory, product, max_degree, second, progress)
        none_proved = densities and all(one.verdict is not Certainty.PROVED for one in densities)
        if none_proved and laboratory.system is not None and not flow and (max_degree is None or dim <= max_degree):
            # x_1 ... x_n where the lemma on Lotka-Volterra systems proves it, whatever its degree.
            x = ring(laboratory.map.names).gens()
            phi = RationalFunction(prod(x[:dim], start=x[0] ** 0), x[0] ** 0)
            proof = product_density_invariant(laboratory.system, phi)
            densities = densities if proof is None else [FoundDensity(phi, Certainty.PROVED, proof), *densities]
    found = DensitySearch(*laboratory.asked, tuple(densities), tried, cut, period, anti_invariant, flow=flow)
    if found.is_open:
        if integrals is None:
            file, symbols, eps, seed, _ = laboratory.asked
            searched = find_integrals(file, symbols=symbols, eps=eps, effort=budget, seed=seed, progress=progress)
            integrals = searched.integrals
        progress("densities that are products of factors of integrals")
        found = with_factors(found, integrals, max_degree)
    return found


def with_factors(
    found: DensitySearch, integrals: Sequence[FoundIntegral], max_degree: int | None = None
) -> DensitySearch:
    """What was found or, if that is nothing, a product of powers of factors of integrals that is a density."""
    if not (found.is_open and integrals):
        return found
    laboratory = Laboratory(found.file, found.symbols, found.eps, found.seed, algebraic=True)
    if laboratory.defect:
        return found
    product, anti_invariant = _products(
        laboratory, max_degree, Budget(), integrals
    )  # of a map: nothing is sought of a flow
    if product is None:
        return replace(found, anti_invariant=anti_invariant)
    return replace(
        found, densities=(product,), degree=product.degree(laboratory.map.dim), anti_invariant=anti_invariant
    )


def _search(
    laboratory: Laboratory,
    product: FoundDensity | None,
    max_degree: int | None,
    budget: Budget,
    progress: Callable[[str], None],
) -> tuple[list[FoundDensity], int, str]:
    """Densities, the largest degree that was tried, and what ended it; the product where none is simpler."""
    dim = laboratory.map.dim
    top = max_degree if max_degree is not None else _MAX_DEGREE
    top, until = max((d for d in range(top + 1) if comb(dim + d, d) <= _MAX_UNKNOWNS), default=0), budget
    if product is not None:
        # Only lower degrees are worth a part of the budget then, and the others of its own degree.
        until, top = budget.part(1 / 3), min(top, product.degree(dim))
    # Where the space of a degree is 0, so are those of lower ones: they are leapt over while monomials at least double.
    leaps, tried = [top] if product is None else [max(top - 1, 0), top], -1
    while leaps[0] > 0:
        halved = (d for d in range(leaps[0] - 1, -1, -1) if 2 * comb(dim + d, d) <= comb(dim + leaps[0], dim))
        leaps.insert(0, next(halved, leaps[0] - 1))
    try:
        while tried < top and not until.is_spent:
            degree = next(leap for leap in leaps if leap > tried)
            progress(f"densities of degree {degree}")
            model = _space(laboratory.maps[0], degree)
            if model.basis and degree > tried + 1:
                leaps = list(range(top + 1))  # the least degree that has some is wanted
                continue
            if model.basis and len(model.basis) == len(_space(laboratory.maps[1], degree, model).basis):
                found, reason = list[FoundDensity](), ""

                def spaces_on(
                    map_: ModularMap, degree: int = degree, model: DarbouxSpace = model
                ) -> list[DarbouxSpace]:
                    return [_space(map_, degree, model)]

                forms = laboratory.formulas([model], spaces_on, budget)
                if forms.bases is None:
                    reason = f"there is a density of degree {degree} modulo primes, but no closed form: {forms.reason}"
                for P in [] if forms.bases is None else forms.bases[0]:
                    phi = RationalFunction(P, P.context().constant(1))
                    verdict, evidence = _certified(laboratory, phi)
                    found += [FoundDensity(phi, verdict, evidence)] if verdict.holds else []
                    reason = f"a density of degree {degree} that was found modulo primes did not pass as an identity"
                if found or product is None:
                    return found, degree, "" if found else reason
            tried = degree
    except NoPoint as error:
        return [], tried, str(error)
    cut = "" if tried == top else f"polynomials of degree {tried + 1} and more were not tried: {SPENT}"
    return ([], tried, cut) if product is None else ([product], product.degree(dim), cut)


def _products(
    laboratory: Laboratory, max_degree: int | None, budget: Budget, integrals: Sequence[FoundIntegral] = ()
) -> tuple[FoundDensity | None, FoundDensity | None]:
    """A density that is a product of powers of known polynomials, or one that changes its sign, as far as there are."""
    parts = [part for one in integrals for part in (one.function.numerator, one.function.denominator)]
    try:
        found = products_of(laboratory, candidates(laboratory, laboratory.cofactors(), budget, parts)).density
    except NoPoint:
        return None, None
    if found is None or (phi := found.function) is None:
        return None, None
    verdict, evidence = _certified(laboratory, phi, found.constant)
    one = FoundDensity(phi, verdict, evidence, found.text)
    if not verdict.holds or (max_degree is not None and one.degree(laboratory.map.dim) > max_degree):
        return None, None
    return (one, None) if found.constant.numerator == found.constant.denominator else (None, one)


def _certified(
    laboratory: Laboratory, phi: RationalFunction, factor: RationalFunction | None = None
) -> tuple[Certainty, Evidence]:
    """The verdict on dx/phi: by the lemma on Lotka-Volterra systems, or as an identity."""
    if laboratory.system is not None and not laboratory.flow:
        proof = product_density_invariant(laboratory.system, phi)
        if proof is not None:
            return Certainty.PROVED, proof
    return laboratory.verdict_on(phi, is_density=True, factor=factor)


def _theorem(laboratory: Laboratory) -> FoundDensity | None:
    """det(I - eps f') of a Hamiltonian system with numbers for parameters, made primitive; None for others."""
    if laboratory.symbols or laboratory.flow or laboratory.system is None or laboratory.system.dim > MAX_DIMENSION:
        return None
    if constant_structures(laboratory.system).hamiltonian is None:
        return None
    D = determinant_polynomial(laboratory.map)
    if D is None:
        return None
    if laboratory.eps is not None:
        at: dict[str | int, int | fmpz | fmpq] = {"eps": laboratory.eps}
        D = D.subs(at)
    if D.is_zero():
        return None
    content = reduce(lambda common, c: common.gcd(c), coefficients_in(D, laboratory.system.dim))
    _, phi = primitive_part(D / content)
    evidence = Evidence(
        "theorem", "f = J grad H with a constant skew matrix J: dx/det(I - eps f'(x)) is invariant (cmoq-2013)"
    )
    return FoundDensity(RationalFunction(phi, phi.context().constant(1)), Certainty.PROVED, evidence)


def _space(map_: ModularMap, degree: int, model: DarbouxSpace | None = None) -> DarbouxSpace:
    """The P of degree at most `degree` with P(x~) = det dPhi P(x), and with the monomials of the model."""
    sample = Sample.of(map_, [DETERMINANT], points_needed(map_.dim, degree, *([] if model is None else [model])))
    return cofactor_space(sample, _ONCE, degree, model)
