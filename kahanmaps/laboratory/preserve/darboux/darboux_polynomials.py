"""The search for discrete Darboux polynomials of a map: P of bounded degree with P(x~) = C(x) P(x), for many C.

C runs through products of the cofactors of cofactors.py, times any number if the cofactors are known up to a number.
The P with one C are listed unless products of polynomials with other C span their space. Source: celledoni-2019.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import comb
from typing import Any

from flint import fmpq_mpoly

from kahanmaps.algebra.fields import GF, Field, integer
from kahanmaps.algebra.modular_matrices import echelon
from kahanmaps.algebra.polynomials import evaluate
from kahanmaps.algebra.printing import attributes, format_polynomial, format_rational_function
from kahanmaps.algebra.work import UNFINISHED, Budget
from kahanmaps.checks.claims import Certainty
from kahanmaps.checks.decide import Identity, Sides
from kahanmaps.display_protocols import LatexDisplay, ResultPart, latex
from kahanmaps.documents.inline import as_file
from kahanmaps.laboratory.defaults import budget_for
from kahanmaps.laboratory.laboratory import Laboratory, certified
from kahanmaps.laboratory.modular_points import ModularMap, NoPoint, product_of
from kahanmaps.laboratory.preserve.darboux.affine_functions import darboux_cofactor
from kahanmaps.laboratory.preserve.darboux.cofactors import (
    Cofactor,
    CofactorProduct,
    Sample,
    SearchStep,
    SpaceSearch,
    cofactor_spaces,
    points_needed,
    products,
)
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import DarbouxSpace
from kahanmaps.laboratory.preserve.limit.flow_polynomials import flow_polynomials
from kahanmaps.laboratory.preserve.products import constants_of
from kahanmaps.laboratory.preserve.results import Search
from kahanmaps.laboratory.preserve.search import interpolate_bases
from kahanmaps.maps.convention import resolve_eps
from kahanmaps.maps.kahan import SystemLike

_MAX_TERMS = 2000  # of a polynomial: the number of unknowns
_MAX_PRODUCTS = 2000  # of cofactors
ScaledProduct = tuple[CofactorProduct, int]  # a product of cofactors and its numerical factor modulo a prime


@dataclass(frozen=True)
class DarbouxPolynomials(LatexDisplay, ResultPart):
    """A basis of all P up to a degree with P(x~) = C(x) P(x), with one verdict for all P: proved or supported.

    `cofactor` is C as text, where C[g] stands for g(x~, -eps)/g(x, eps). For a flow it is K in P' = K P.
    """

    cofactor: str
    polynomials: tuple[fmpq_mpoly, ...]
    verdict: Certainty

    @property
    def text(self) -> str:
        """The polynomials and their cofactor."""
        return f"{', '.join(map(format_polynomial, self.polynomials))} with cofactor {self.cofactor}"

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        formulas = [latex(P) for P in self.polynomials]
        return {**attributes(self, "cofactor", "polynomials"), "latex": formulas, **attributes(self, "verdict")}


@dataclass(frozen=True)
class DarbouxSearch(Search):
    """The result of `darboux_polynomials`: spaces up to `degree`; `cofactors` are the names of the known factors."""

    _parts, _noun = "spaces", ("cofactor", "cofactors")

    degree: int
    cofactors: tuple[str, ...]
    spaces: tuple[DarbouxPolynomials, ...]
    reason: str

    def rows(self) -> list[dict[str, str]]:
        """Return one row for each polynomial, e.g. for `pandas.DataFrame(result.rows())`."""
        return [
            {"cofactor": space.cofactor, "polynomial": format_polynomial(P), "verdict": str(space.verdict)}
            for space in self.spaces
            for P in space.polynomials
        ]

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {**self.of_flow, **attributes(self, "degree", "cofactors", "spaces", "reason", "primes")}


def darboux_polynomials(
    system: SystemLike,
    max_degree: int,
    *,
    symbols: Sequence[str] = (),
    eps: Any = None,
    time_step: Any = None,
    h: Any = None,
    flow: bool = False,
    effort: int | Budget = 1,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
    on_result: Callable[[DarbouxSearch], None] = lambda _: None,
) -> DarbouxSearch:
    """Search for discrete Darboux polynomials of degree at most `max_degree` whose cofactors have known factors.

    A cofactor is a product of the factors in cofactors.py. For maps other than Kahan maps it is such a product times
    any number, which may depend on the symbols and eps.

    Args:
        system: the map; a differential equation stands for its Kahan map.
        max_degree: the largest degree of the polynomials, and of the products of cofactors.
        symbols: names of parameters that stay symbols in the formulas; the others have the values of the file.
        eps: half the time step, an exact number: formulas then hold at this eps only. None: formulas contain eps.
        time_step, h: the time step 2 eps, instead of eps.
        flow: search for Darboux polynomials of the differential equation instead, P' = K P with K other than 0
            (flow_polynomials.py).
        effort: the work that the search may take: each step above 1 doubles it, each step below halves it.
        seed: the random seed.
        progress: called with each cofactor before it is tried.
        on_result: called with the spaces so far after each new space, for searches that may be interrupted.

    Returns:
        A `DarbouxSearch`. With C = 1 the polynomials are integrals (the constant 1 is left out). A space spanned by
        products of elements of other spaces is left out.

    Raises:
        InputError: for unknown symbols and eps = 0.

    Source: celledoni-2019.

    >>> from kahanmaps.documents.catalog import load
    >>> for space in darboux_polynomials(load("lotka_volterra"), 2).spaces:
    ...     print(space.cofactor, *space.polynomials, space.verdict)
    C[x] x proved
    C[y] y proved
    """
    degree = integer(max_degree, "max_degree")
    file, eps = as_file(system), resolve_eps(eps, time_step, h)
    laboratory = Laboratory(file, symbols, eps, seed, flow=flow)
    budget, cofactors = budget_for("Darboux polynomials", effort), laboratory.cofactors()
    spaces = list[DarbouxPolynomials]()
    # If the map has a defect, its image may lie on a hypersurface g = 0, and all multiples of g have the cofactor 0.
    reason = laboratory.defect
    if flow:
        assert laboratory.field is not None
        flow_result = flow_polynomials(laboratory.field, degree, budget, laboratory.seed)
        for P in flow_result.functions:
            K = darboux_cofactor(laboratory.field, P)
            assert K is not None  # `flow_polynomials` lists only polynomials with a cofactor
            spaces.append(DarbouxPolynomials(format_polynomial(K), (P,), Certainty.PROVED))
        if flow_result.degree < degree:
            reason = f"degrees above {flow_result.degree} are not settled: {flow_result.reason}"
    if flow or laboratory.defect:
        names = () if laboratory.defect else tuple(cofactor.name for cofactor in cofactors)
        return DarbouxSearch(*laboratory.request, degree, names, tuple(spaces), reason, flow=flow)
    names, map_, requested_degree = tuple(cofactor.name for cofactor in cofactors), laboratory.maps[0], degree
    while comb(map_.dim + degree, degree) > _MAX_TERMS:
        degree -= 1
    if degree < requested_degree:
        reason = f"degrees above {degree} were not tried: polynomials in dimension {map_.dim} have too many terms"
    candidates = products(cofactors, degree)
    if len(candidates) > _MAX_PRODUCTS:
        reason = f"{len(candidates)} products of cofactors, of which the first {_MAX_PRODUCTS} were tried"
        candidates = candidates[:_MAX_PRODUCTS]
    all_spaces = dict[ScaledProduct, DarbouxSpace]()
    try:
        sample = Sample.of(map_, cofactors, points_needed(map_.dim, degree))
        for product in candidates:
            if budget.is_spent:
                reason = "work limit reached before all products of cofactors were tried; raise --effort"
                break
            progress(f"cofactor {product.text(cofactors)}")
            all_spaces |= {(product, c): space for c, space in cofactor_spaces(sample, product, degree)}
        spaces_by_C = dict[ScaledProduct, DarbouxSpace]()
        for C, space in all_spaces.items():
            basis = [vector for vector in space.basis if any(vector[1:])]  # without constants, which have C = 1
            if basis:
                spaces_by_C[C] = DarbouxSpace(space.dim, space.degree, basis)
        # Different products of cofactors may be the same function, and have equal spaces. If this space is spanned by
        # products of elements of other spaces, it is left out for all of these products of cofactors.
        seen_spaces = [space for C, space in spaces_by_C.items() if _is_spanned_by_products(spaces_by_C, C, map_.prime)]
        for C, space in spaces_by_C.items():
            if space not in seen_spaces:
                seen_spaces.append(space)
                scaled_spaces = [other_space for key, other_space in all_spaces.items() if key[0] == C[0] and key != C]
                result = _find_formulas(laboratory, cofactors, C[0], [all_spaces[C], *scaled_spaces], budget)
                if isinstance(result, str):
                    reason = result
                else:
                    spaces.append(result)
                    on_result(DarbouxSearch(*laboratory.request, requested_degree, names, tuple(spaces), UNFINISHED))
    except NoPoint as error:
        reason = str(error)
    return DarbouxSearch(*laboratory.request, requested_degree, names, tuple(spaces), reason, flow=flow)


def _is_spanned_by_products(spaces: dict[ScaledProduct, DarbouxSpace], C: ScaledProduct, prime: int) -> bool:
    """Return whether the products P Q of elements of other spaces, with cofactors of product C, span the space of C."""
    space, (product, c) = spaces[C], C
    other_spaces = {(key[0].powers, key[1]): other_space for key, other_space in spaces.items() if key != C}
    rows = []
    for (powers, scalar), space_of_P in other_spaces.items():
        quotient = tuple(a - b for a, b in zip(product.powers, powers, strict=True)), c * pow(scalar, -1, prime) % prime
        space_of_Q = other_spaces.get(quotient)
        if space_of_Q is not None and (powers, scalar) <= quotient:
            pairs = ((P, Q) for P in space_of_P.basis for Q in space_of_Q.basis)
            rows += [product_of(P, Q, space.dim, space.degree, prime) for P, Q in pairs]
    return len(echelon([row for row in rows if row is not None], prime)) == len(space.basis)


def _find_formulas(
    laboratory: Laboratory,
    cofactors: Sequence[Cofactor],
    product: CofactorProduct,
    spaces: Sequence[DarbouxSpace],
    budget: Budget,
) -> DarbouxPolynomials | str:
    """Return formulas for the first of the spaces, or the reason why there are none.

    Their cofactors are the `product` times different numbers.
    """
    text, bases, reason = product.text(cofactors), list[list[fmpq_mpoly]](), ""
    # Interpolating all spaces together distinguishes spaces with the same zero pattern. If the interpolation fails, try
    # the first space alone: the other spaces may be conjugate over an extension of Q and have no formula.
    for group in [spaces, spaces[:1]][len(spaces) == 1 :]:
        step = SearchStep("cofactor", spaces[0].degree, product, text, up_to_numbers=True)
        search = SpaceSearch([step], [list(group)], cofactors)
        bases, reason = interpolate_bases(laboratory, laboratory.primes[0], search, budget)
        if bases:
            break
    else:
        return f"no closed form for the cofactor {text}: {reason}"
    polynomials = tuple(P for P in bases[0] if not P.is_constant())

    def find_scalar(map_: ModularMap) -> list[int]:
        """Return, as a list of one residue, the number c for which the cofactor of the first space is c `product`."""
        sample, field = Sample.of(map_, cofactors, 1), GF(map_.prime)
        [(numerator, denominator)], [pair] = sample.values(product, 1), sample.pairs
        arguments = ([field.convert(c) for c in (*x, *map_.values, map_.eps)] for x in pair)
        value, image_value = (int(evaluate(polynomials[0], field, values)) for values in arguments)
        return [image_value * denominator * pow(value * numerator, -1, map_.prime) % map_.prime]

    [c] = constants_of(laboratory, find_scalar)
    if c is None:
        return f"no closed form for the numerical factor of the cofactor {text}"
    factor, map_, n = c, laboratory.map, laboratory.map.dim

    def certify_cofactor(P: fmpq_mpoly) -> Certainty:
        """Certify that P(x~) = c C(x) P(x), where C is the `product`; denominators are cleared."""

        def sides(field: Field, values: tuple[Any, ...], eps: Any) -> Sides:
            x, symbols = values[:n], values[n:]
            map_at_eps = map_.at(eps, field, symbols)
            image = map_at_eps.step(x)
            lhs, rhs = evaluate(P, field, (*image, *symbols, eps)), evaluate(P, field, (*values, eps))
            lhs = lhs * evaluate(factor.denominator, field, (*values, eps))
            rhs = rhs * evaluate(factor.numerator, field, (*values, eps))
            for cofactor, power in zip(cofactors, product.powers, strict=True):
                if power:
                    numerator, denominator = cofactor.fraction(map_at_eps, x, image, symbols)
                    for _ in range(power):
                        lhs, rhs = lhs * denominator, rhs * numerator
            return [lhs], [rhs]

        powers = [(cofactor.polynomial, k) for cofactor, k in zip(cofactors, product.powers, strict=True)]
        identity_key = (map_.symbols, map_.seed_data, P, factor, powers)
        identity = Identity(n + len(map_.symbols), sides, laboratory.eps, has_eps=map_.has_eps, seed_data=identity_key)
        return certified(identity, laboratory.seed)[0]

    verdicts = [certify_cofactor(P) for P in polynomials]
    if not all(verdict.holds for verdict in verdicts):
        return f"a formula for the cofactor {text} did not pass as an identity"
    verdict = Certainty.PROVED if all(v is Certainty.PROVED for v in verdicts) else Certainty.SUPPORTED
    number_text = format_rational_function(c)
    if number_text != "1":
        is_monomial = c.is_polynomial and len(c.numerator) == 1
        text = f"{number_text if is_monomial else f'({number_text})'}*{text}".removesuffix("*1")
    return DarbouxPolynomials(text, polynomials, verdict)
