"""The search for invariant volume forms dx/phi of a map; phi is a polynomial or a product of powers of polynomials.

dx/phi is invariant if phi(x~) = det dPhi(x) phi(x): phi is a discrete Darboux polynomial with the cofactor det dPhi.
All polynomials phi up to a degree form one null space modulo a prime. For products of powers of known polynomials, of
any degree, the exponents are computed (products.py). In this module "density" means the denominator phi, not 1/phi.
Source: celledoni-2019.
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
from kahanmaps.algebra.work import SPENT, UNFINISHED, Budget
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
from kahanmaps.laboratory.preserve.results import FoundFunction, Search, closing_note, common_orbit_period
from kahanmaps.maps.convention import resolve_eps
from kahanmaps.maps.kahan import SystemLike

_MAX_UNKNOWNS = 1000  # monomials of phi
_MAX_DEGREE = 12  # of phi, if the caller gives no degree
_FIRST_POWER = CofactorProduct((1,), 1)  # of det dPhi


@dataclass(frozen=True)
class FoundDensity(FoundFunction):
    """A denominator phi(x, eps) of an invariant volume form dx/phi; `product` is phi in factored form, or empty."""

    function: RationalFunction
    verdict: Certainty
    evidence: Evidence
    product: str = ""

    def degree(self, dim: int) -> int:
        """The larger of the degrees of numerator and denominator of phi in the variables."""
        return max(degree_in(polynomial, dim) for polynomial in (self.function.numerator, self.function.denominator))

    @property
    def text(self) -> str:
        """The formula of phi."""
        return self.product or format_factored(self.function)

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {"phi": self.text, "latex": latex(self.function), **attributes(self, "verdict", "evidence")}


@dataclass(frozen=True)
class DensitySearch(Search):
    """The result of `find_densities`.

    `densities` is a basis of all phi of the least degree in which any exist, with two exceptions. If no phi of this
    basis is proved, a known proved phi of another degree comes first. For a Hamiltonian system the list has only
    det(I - eps f'), whose degree need not be the least. `degree` is the largest degree that was tried; `stop_reason`
    says why the search stopped before the requested degree, or is empty. `period` is the period of the map, if orbits
    close. `anti_invariant` is a phi with phi(x~) = -det dPhi(x) phi(x): the map takes dx/phi to -dx/phi, and |dx/phi|
    is invariant.
    """

    _parts, _noun = "densities", ("density", "densities")

    densities: tuple[FoundDensity, ...]
    degree: int
    stop_reason: str
    period: int | None = None
    anti_invariant: FoundDensity | None = None

    @property
    def shows_none(self) -> bool:
        """Whether all requested degrees were searched and no density of these degrees exists (measured)."""
        return not self.densities and not self.stop_reason

    @property
    def may_use_integrals(self) -> bool:
        """Whether factors of the integrals should be tried, since a search for a map (not a flow) found no density."""
        return not (self.densities or self.anti_invariant or self.flow)

    @property
    def reason(self) -> str:
        """Why there is no density, or why the search ended before the requested degree; empty otherwise."""
        if self.shows_none:
            polynomials_text = f"no polynomial of degree at most {self.degree}"
            return f"{polynomials_text}, and no product of powers of known ones, is a density"
        return self.stop_reason

    @property
    def shown(self) -> tuple[FoundDensity, ...]:
        """A tuple of the density to print: the shortest proved one, or else the shortest; () without a density."""
        return tuple(sorted(self.densities, key=lambda phi: (phi.verdict is not Certainty.PROVED, len(phi.text)))[:1])

    @property
    def further(self) -> str:
        """A sentence on the densities that are not shown; empty if all are shown."""
        if len(self.densities) < 2:
            return ""
        count = len(self.densities) - 1
        others_text = f"{counted(count, 'further polynomial')} of this kind"
        return f"phi times any integral is a density again; --json lists {others_text}"

    @property
    def note(self) -> str:
        """Sentences on an anti-invariant density and on the period of the map; empty if there is neither."""
        period_text = closing_note(self.period, self.eps, self.file.map)
        if self.anti_invariant is None:
            return period_text
        sentence = f"|dx/phi| is invariant for phi = {self.anti_invariant.text}: phi(x~) = -det dPhi(x) phi(x)"
        return "; ".join(filter(None, (f"{sentence} ({self.anti_invariant.verdict})", period_text)))

    def rows(self) -> list[dict[str, str]]:
        """Return one row for each formula, e.g. for `pandas.DataFrame(result.rows())`."""
        return [{"name": "phi", "formula": phi.text, "verdict": str(phi.verdict)} for phi in self.densities]

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            **self.of_flow,
            **attributes(self, "densities", degree_tried="degree"),
            **attributes(self, "period", "note", "reason", "primes"),
        }

    def toml_section(self) -> str:
        """Return the section [density] of a system file, for `check-measure`; empty without a density.

        If eps was given, a comment says that the formula holds at this eps only.
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
    h: Any = None,
    flow: bool = False,
    max_degree: int | None = None,
    integrals: Sequence[FoundIntegral] | None = None,
    effort: int | Budget = 1,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
    on_result: Callable[[DensitySearch], None] = lambda _: None,
) -> DensitySearch:
    """Search for densities phi: the map preserves the volume form dx/phi.

    The result is a basis of the polynomials phi of the least degree, or a product of powers if no polynomial is found.

    Args:
        system: the map; a differential equation stands for its Kahan map.
        symbols: names of parameters that stay symbols in the formulas; the others have the values of the file.
        eps: half the time step, an exact number: formulas then hold at this eps only. None: formulas contain eps.
        time_step, h: the time step 2 eps, instead of eps.
        flow: search for densities of the differential equation instead, div(f/phi) = 0.
        max_degree: the largest degree of phi; by default 12, or less if a phi would have too many unknown coefficients.
        integrals: the known integrals. If the other searches find no density, products of powers of factors of the
            integrals are tried. By default the integrals are searched for in this case.
        effort: the work that the search may take: each step above 1 doubles it, each step below halves it.
        seed: the random seed.
        progress: called with a sentence at each stage of the search.
        on_result: called with the densities so far at each stage, for searches that may be interrupted.

    Returns:
        A `DensitySearch`; formulas are exact, proved or supported. That there are no other densities up to a degree is
        measured modulo primes, not proved.

    Raises:
        InputError: for unknown symbols, symbols in a [family] file, eps = 0, or a negative degree.

    Source: celledoni-2019.

    >>> from kahanmaps.documents.catalog import load
    >>> result = find_densities(load("lotka_volterra"))
    >>> [(phi.text, str(phi.verdict)) for phi in result.densities]
    [('x*y', 'proved')]
    """
    file, eps = as_file(system), resolve_eps(eps, time_step, h)
    if max_degree is not None and max_degree < 0:
        raise InputError(f"found the largest degree {max_degree}, expected at least 0")
    laboratory = Laboratory(file, symbols, eps, seed, flow=flow, algebraic=True)
    return densities_of(laboratory, max_degree, integrals, budget_for("densities", effort), progress, on_result)


def densities_of(
    laboratory: Laboratory,
    max_degree: int | None,
    integrals: Sequence[FoundIntegral] | None,
    budget: Budget,
    progress: Callable[[str], None] = lambda _: None,
    on_result: Callable[[DensitySearch], None] = lambda _: None,
) -> DensitySearch:
    """Run `find_densities` on the maps of a laboratory."""
    flow = laboratory.flow
    if laboratory.defect:
        return DensitySearch(*laboratory.request, (), -1, laboratory.defect, flow=flow)
    period = None if flow else common_orbit_period(laboratory.maps)
    product = anti_invariant = None
    hamiltonian_density, dim, reason = _find_hamiltonian_density(laboratory), laboratory.map.dim, ""
    if hamiltonian_density is not None and (max_degree is None or hamiltonian_density.degree(dim) <= max_degree):
        densities, degree = [hamiltonian_density], hamiltonian_density.degree(dim)
    else:
        progress("densities that are products")
        budgets = budget.share([1, 2, 2])  # the stages: products; polynomials; integrals, whose factors are tried
        product, anti_invariant = _find_product_density(laboratory, max_degree, next(budgets))
        products = () if product is None else (product,)
        on_result(DensitySearch(*laboratory.request, products, -1, UNFINISHED, period, anti_invariant, flow=flow))
        # Reserve a share for the search for integrals, unless the caller gives the integrals or a product is known.
        polynomial_budget = budget if integrals is not None or product is not None else next(budgets)
        densities, degree, reason = _search_polynomials(laboratory, product, max_degree, polynomial_budget, progress)
        are_unproved = densities and all(phi.verdict is not Certainty.PROVED for phi in densities)
        if are_unproved and laboratory.system is not None and not flow and (max_degree is None or dim <= max_degree):
            # The lemma on Lotka-Volterra systems may prove phi = x_1 ... x_n in any dimension n.
            x = ring(laboratory.map.names).gens()
            phi = RationalFunction(prod(x[:dim], start=x[0] ** 0), x[0] ** 0)
            proof = product_density_invariant(laboratory.system, phi)
            densities = densities if proof is None else [FoundDensity(phi, Certainty.PROVED, proof), *densities]
    result = DensitySearch(*laboratory.request, tuple(densities), degree, reason, period, anti_invariant, flow=flow)
    if result.may_use_integrals:
        on_result(replace(result, stop_reason=UNFINISHED))
        if integrals is None:
            file, symbols, eps, seed, _ = laboratory.request
            integral_search = find_integrals(
                file, symbols=symbols, eps=eps, effort=budget, seed=seed, progress=progress
            )
            integrals = integral_search.integrals
        progress("densities that are products of factors of integrals")
        result = with_factors(result, integrals, max_degree)
    return result


def with_factors(
    result: DensitySearch, integrals: Sequence[FoundIntegral], max_degree: int | None = None
) -> DensitySearch:
    """Try products of powers of factors of integrals, to complete a search that found no density."""
    if not (result.may_use_integrals and integrals):
        return result
    laboratory = Laboratory(result.file, result.symbols, result.eps, result.seed, algebraic=True)
    if laboratory.defect:
        return result
    # The budget is not used: `candidates` needs it only for flows, and this laboratory is that of a map.
    product, anti_invariant = _find_product_density(laboratory, max_degree, Budget(), integrals)
    if product is None:
        return replace(result, anti_invariant=anti_invariant)
    return replace(
        result, densities=(product,), degree=product.degree(laboratory.map.dim), anti_invariant=anti_invariant
    )


def _search_polynomials(
    laboratory: Laboratory,
    product: FoundDensity | None,
    max_degree: int | None,
    budget: Budget,
    progress: Callable[[str], None],
) -> tuple[list[FoundDensity], int, str]:
    """Search for polynomial densities; a known `product` is the result unless a simpler density is found.

    Returns the densities, the largest degree that was tried, and the reason why the search ended too early ("": none).
    """
    dim = laboratory.map.dim
    last_degree = max_degree if max_degree is not None else _MAX_DEGREE
    last_degree, degree_budget = (
        max((d for d in range(last_degree + 1) if comb(dim + d, d) <= _MAX_UNKNOWNS), default=0),
        budget,
    )
    if product is not None:
        # Degrees above that of a known product are not needed, and the other degrees get a third of the budget.
        degree_budget, last_degree = budget.part(1 / 3), min(last_degree, product.degree(dim))
    # The space of a degree contains those of lower degrees: try degrees with about twice as many monomials each time.
    degrees, tried_degree = [last_degree] if product is None else [max(last_degree - 1, 0), last_degree], -1
    while degrees[0] > 0:
        low_degrees = (d for d in range(degrees[0] - 1, -1, -1) if 2 * comb(dim + d, d) <= comb(dim + degrees[0], dim))
        degrees.insert(0, next(low_degrees, degrees[0] - 1))
    try:
        while tried_degree < last_degree and not degree_budget.is_spent:
            degree = next(d for d in degrees if d > tried_degree)
            progress(f"densities of degree {degree}")
            model = _compute_space(laboratory.maps[0], degree)
            if model.basis and degree > tried_degree + 1:
                degrees = list(range(last_degree + 1))  # search again for the least degree with a density
                continue
            if model.basis and len(model.basis) == len(_compute_space(laboratory.maps[1], degree, model).basis):
                densities, reason = list[FoundDensity](), ""

                def spaces_on(
                    map_: ModularMap, degree: int = degree, model: DarbouxSpace = model
                ) -> list[DarbouxSpace]:
                    return [_compute_space(map_, degree, model)]

                closed_forms = laboratory.formulas([model], spaces_on, budget)
                if closed_forms.bases is None:
                    reason = f"there is a density of degree {degree} modulo primes"
                    reason += f", but no closed form: {closed_forms.reason}"
                for P in [] if closed_forms.bases is None else closed_forms.bases[0]:
                    phi = RationalFunction(P, P.context().constant(1))
                    verdict, evidence = _certify(laboratory, phi)
                    densities += [FoundDensity(phi, verdict, evidence)] if verdict.holds else []
                    reason = f"a density of degree {degree} that was found modulo primes did not pass as an identity"
                if densities or product is None:
                    return densities, degree, "" if densities else reason
            tried_degree = degree
    except NoPoint as error:
        return [], tried_degree, str(error)
    ending = f"polynomials of degree {tried_degree + 1} and more were not tried: {SPENT}"
    ending = "" if tried_degree == last_degree else ending
    return ([], tried_degree, ending) if product is None else ([product], product.degree(dim), ending)


def _find_product_density(
    laboratory: Laboratory, max_degree: int | None, budget: Budget, integrals: Sequence[FoundIntegral] = ()
) -> tuple[FoundDensity | None, FoundDensity | None]:
    """Search for a phi that is a product of powers of known polynomials.

    Returns (phi, None) if dx/phi is invariant, (None, phi) if it is anti-invariant, (None, None) if no phi is found.
    """
    polynomials = [polynomial for I in integrals for polynomial in (I.function.numerator, I.function.denominator)]
    try:
        product = products_of(laboratory, candidates(laboratory, laboratory.cofactors(), budget, polynomials)).density
    except NoPoint:
        return None, None
    if product is None or (phi := product.function) is None:
        return None, None
    verdict, evidence = _certify(laboratory, phi, product.constant)
    density = FoundDensity(phi, verdict, evidence, product.text)
    if not verdict.holds or (max_degree is not None and density.degree(laboratory.map.dim) > max_degree):
        return None, None
    return (density, None) if product.constant.numerator == product.constant.denominator else (None, density)


def _certify(
    laboratory: Laboratory, phi: RationalFunction, factor: RationalFunction | None = None
) -> tuple[Certainty, Evidence]:
    """Certify phi(x~) = factor det dPhi phi (None: 1), by the lemma on Lotka-Volterra systems or as an identity."""
    if laboratory.system is not None and not laboratory.flow:
        proof = product_density_invariant(laboratory.system, phi)
        if proof is not None:
            return Certainty.PROVED, proof
    return laboratory.verdict_on(phi, is_density=True, factor=factor)


def _find_hamiltonian_density(laboratory: Laboratory) -> FoundDensity | None:
    """Return the primitive part of det(I - eps f') for a Hamiltonian system without symbols; None for other systems."""
    if laboratory.symbols or laboratory.flow or laboratory.system is None or laboratory.system.dim > MAX_DIMENSION:
        return None
    if constant_structures(laboratory.system).hamiltonian is None:
        return None
    D = determinant_polynomial(laboratory.map)
    if D is None:
        return None
    if laboratory.eps is not None:
        substitution: dict[str | int, int | fmpz | fmpq] = {"eps": laboratory.eps}
        D = D.subs(substitution)
    if D.is_zero():
        return None
    content = reduce(lambda divisor, c: divisor.gcd(c), coefficients_in(D, laboratory.system.dim))
    _, phi = primitive_part(D / content)
    evidence = Evidence(
        "theorem", "f = J grad H with a constant skew matrix J: dx/det(I - eps f'(x)) is invariant (cmoq-2013)"
    )
    return FoundDensity(RationalFunction(phi, phi.context().constant(1)), Certainty.PROVED, evidence)


def _compute_space(map_: ModularMap, degree: int, model: DarbouxSpace | None = None) -> DarbouxSpace:
    """Compute all P of degree at most `degree` with P(x~) = det dPhi P(x), with monomials of the `model` if given."""
    sample = Sample.of(map_, [DETERMINANT], points_needed(map_.dim, degree, *([] if model is None else [model])))
    return cofactor_space(sample, _FIRST_POWER, degree, model)
