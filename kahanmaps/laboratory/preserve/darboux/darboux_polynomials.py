"""The discrete Darboux polynomials of a map: all P of bounded degree with P(x~) = C(x) P(x), for many C.

C runs through the products of the cofactors in cofactors.py, times numbers where these are known up to numbers. A space
of such P is listed unless products of elements of spaces listed before span it. Source: celledoni-2019.
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
from kahanmaps.algebra.work import Budget
from kahanmaps.checks.claims import Certainty
from kahanmaps.checks.decide import Identity, Sides
from kahanmaps.displayed import latex
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

_MOST_TERMS = 2000  # of a polynomial: as many unknowns
_MOST_PRODUCTS = 2000
Law = tuple[CofactorProduct, int]  # a product of cofactors, and the number that it is multiplied by, modulo a prime


@dataclass(frozen=True)
class DarbouxPolynomials:
    """A basis of all P with P(x~) = C(x) P(x); `cofactor` is C as text, where C[g] = g(x~, -eps)/g(x, eps).

    Of a flow it is K in P' = K P. The verdict is on the identity, for all of them: proved by expansion or supported at
    random points.
    """

    cofactor: str
    polynomials: tuple[fmpq_mpoly, ...]
    verdict: Certainty

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        formulas = [latex(P) for P in self.polynomials]
        return {**attributes(self, "cofactor", "polynomials"), "latex": formulas, **attributes(self, "verdict")}


@dataclass(frozen=True)
class DarbouxSearch(Search):
    """What `darboux_polynomials` found: spaces by the weight of their cofactor; `reason` if the search ended early."""

    degree: int
    cofactors: tuple[str, ...]
    spaces: tuple[DarbouxPolynomials, ...]
    reason: str

    def rows(self) -> list[dict[str, str]]:
        """A row for each polynomial, for `pandas.DataFrame(found.rows())` and the like."""
        pairs = [(space, P) for space in self.spaces for P in space.polynomials]
        return [
            {"cofactor": one.cofactor, "polynomial": format_polynomial(P), "verdict": str(one.verdict)}
            for one, P in pairs
        ]

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        known = attributes(self, "degree", "cofactors", "spaces", "reason", "primes")
        return {**self.of_flow, **known}


def darboux_polynomials(
    system: SystemLike,
    degree: int,
    *,
    symbols: Sequence[str] = (),
    eps: Any = None,
    time_step: Any = None,
    flow: bool = False,
    effort: int | Budget = 1,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
) -> DarbouxSearch:
    """All discrete Darboux polynomials of degree at most `degree` whose cofactor is a product of the usual ones.

    For maps that are no Kahan maps, the product times any number, which may contain the symbols and eps.

    Args:
        system: the system.
        degree: the largest degree of the polynomials, and of the products of cofactors.
        symbols: names of parameters that formulas are to contain; the others have the values of the file.
        eps: an exact number, or None for formulas that contain eps.
        time_step: 2 eps, in its place.
        flow: ask for those of the differential equation instead, P' = K P with any K but 0 (flow_polynomials.py).
        effort: 1, or more: each more doubles the work that the search may take, each less halves it.
        seed: of everything random.
        progress: is told what is being tried.

    Returns:
        A `DarbouxSearch`. With C = 1 the polynomials are integrals (the constant 1 is left out). A space that
        products of elements of others span is left out.

    Raises:
        InputError: for unknown symbols and eps = 0.

    Source: celledoni-2019.

    >>> from kahanmaps.documents.catalog import load
    >>> for space in darboux_polynomials(load("lotka_volterra"), 2).spaces:
    ...     print(space.cofactor, *space.polynomials, space.verdict)
    C[x] x proved
    C[y] y proved
    """
    degree = integer(degree, "degree")
    file, eps = as_file(system), resolve_eps(eps, time_step)
    laboratory = Laboratory(file, symbols, eps, seed, flow=flow)
    budget, cofactors = budget_for("Darboux polynomials", effort), laboratory.cofactors()
    spaces = list[DarbouxPolynomials]()
    reason = laboratory.defect  # all multiples of what vanishes on the image have the cofactor 0
    if flow:
        assert laboratory.field is not None
        settled = flow_polynomials(laboratory.field, degree, budget, laboratory.seed)
        for P in settled.functions:
            K = darboux_cofactor(laboratory.field, P)
            assert K is not None  # or it would not have been listed
            spaces.append(DarbouxPolynomials(format_polynomial(K), (P,), Certainty.PROVED))
        if settled.degree < degree:
            reason = f"degrees above {settled.degree} are not settled: {settled.reason}"
    if flow or laboratory.defect:
        names = () if laboratory.defect else tuple(one.name for one in cofactors)
        return DarbouxSearch(*laboratory.asked, degree, names, tuple(spaces), reason, flow=flow)
    names, map_, asked = tuple(one.name for one in cofactors), laboratory.maps[0], degree
    while comb(map_.dim + degree, degree) > _MOST_TERMS:
        degree -= 1
    if degree < asked:
        reason = f"degrees above {degree} were not tried: polynomials in dimension {map_.dim} have too many terms"
    candidates = products(cofactors, degree)
    if len(candidates) > _MOST_PRODUCTS:
        reason = f"{len(candidates)} products of cofactors, of which the first {_MOST_PRODUCTS} were tried"
        candidates = candidates[:_MOST_PRODUCTS]
    found = dict[Law, DarbouxSpace]()
    try:
        sample = Sample.of(map_, cofactors, points_needed(map_.dim, degree))
        for product in candidates:
            if budget.is_spent:
                reason = "the budget was spent before all products of cofactors were tried (--effort)"
                break
            progress(f"cofactor {product.text(cofactors)}")
            found |= {(product, c): space for c, space in cofactor_spaces(sample, product, degree)}
        known = dict[Law, DarbouxSpace]()
        for law, space in found.items():
            basis = [vector for vector in space.basis if any(vector[1:])]  # the constants have C = 1, and are left out
            if basis:
                known[law] = DarbouxSpace(space.dim, space.degree, basis)
        # Different products of cofactors may be the same function, and one of them may show that products span the
        # space.
        listed = [space for law, space in known.items() if _is_spanned_by_products(known, law, map_.prime)]
        for law, space in known.items():
            if space not in listed:
                listed.append(space)
                others = [one for other, one in found.items() if other[0] == law[0] and other != law]
                written = _written(laboratory, cofactors, law[0], [found[law], *others], budget)
                if isinstance(written, str):
                    reason = written
                else:
                    spaces.append(written)
    except NoPoint as error:
        reason = str(error)
    return DarbouxSearch(*laboratory.asked, asked, names, tuple(spaces), reason, flow=flow)


def _is_spanned_by_products(known: dict[Law, DarbouxSpace], law: Law, prime: int) -> bool:
    """Whether products P Q of elements of other spaces, whose cofactors multiply to the given one, span its space."""
    space, (product, c) = known[law], law
    others = {(one.powers, number): other for (one, number), other in known.items() if (one, number) != law}
    rows = []
    for (powers, number), left in others.items():
        rest = tuple(a - b for a, b in zip(product.powers, powers, strict=True)), c * pow(number, -1, prime) % prime
        right = others.get(rest)
        if right is not None and (powers, number) <= rest:
            rows += [product_of(P, Q, space.dim, space.degree, prime) for P in left.basis for Q in right.basis]
    return len(echelon([row for row in rows if row is not None], prime)) == len(space.basis)


def _written(
    laboratory: Laboratory,
    cofactors: Sequence[Cofactor],
    product: CofactorProduct,
    spaces: Sequence[DarbouxSpace],
    budget: Budget,
) -> DarbouxPolynomials | str:
    """The first of spaces in closed form, or why there is none; the cofactors of the others differ by numbers."""
    text, bases, reason = product.text(cofactors), list[list[fmpq_mpoly]](), ""
    # The others tell spaces that look alike apart; where they are conjugate they have no formulas themselves.
    for together in [spaces, spaces[:1]][len(spaces) == 1 :]:
        step = SearchStep("cofactor", spaces[0].degree, product, text, up_to_numbers=True)
        search = SpaceSearch([step], [list(together)], cofactors)
        bases, reason = interpolate_bases(laboratory, laboratory.primes[0], search, budget)
        if bases:
            break
    else:
        return f"no closed form for the cofactor {text}: {reason}"
    polynomials = tuple(P for P in bases[0] if not P.is_constant())

    def number(map_: ModularMap) -> list[int]:
        """The number by which the cofactor differs from the product."""
        sample, field = Sample.of(map_, cofactors, 1), GF(map_.prime)
        [(numerator, denominator)], [pair] = sample.values(product, 1), sample.pairs
        places = ([field.convert(c) for c in (*x, *map_.values, map_.eps)] for x in pair)
        before, after = (int(evaluate(polynomials[0], field, place)) for place in places)
        return [after * denominator * pow(before * numerator, -1, map_.prime) % map_.prime]

    [c] = constants_of(laboratory, number)
    if c is None:
        return f"no closed form for the number in front of the cofactor {text}"
    factor, map_, n = c, laboratory.map, laboratory.map.dim

    def keeps(P: fmpq_mpoly) -> Certainty:
        """Whether P(x~) = c P(x) prod C^k, the denominators multiplied out."""

        def sides(field: Field, place: tuple[Any, ...], eps: Any) -> Sides:
            point, values = place[:n], place[n:]
            over = map_.at(eps, field, values)
            image = over.step(point)
            left, right = evaluate(P, field, (*image, *values, eps)), evaluate(P, field, (*place, eps))
            left = left * evaluate(factor.denominator, field, (*place, eps))
            right = right * evaluate(factor.numerator, field, (*place, eps))
            for one, power in zip(cofactors, product.powers, strict=True):
                numerator, denominator = one.over(over, point, image, values) if power else (field.one, field.one)
                for _ in range(power):
                    left, right = left * denominator, right * numerator
            return [left], [right]

        powers = [(one.polynomial, k) for one, k in zip(cofactors, product.powers, strict=True)]
        subject = (map_.symbols, map_.subject, P, factor, powers)
        identity = Identity(n + len(map_.symbols), sides, laboratory.eps, has_eps=map_.has_eps, subject=subject)
        return certified(identity, laboratory.seed)[0]

    outcomes = [keeps(P) for P in polynomials]
    if not all(outcome.holds for outcome in outcomes):
        return f"a formula for the cofactor {text} did not pass as an identity"
    verdict = Certainty.PROVED if all(one is Certainty.PROVED for one in outcomes) else Certainty.SUPPORTED
    told = format_rational_function(c)
    if told != "1":
        text = f"{told if c.is_polynomial and len(c.numerator) == 1 else f'({told})'}*{text}".removesuffix("*1")
    return DarbouxPolynomials(text, polynomials, verdict)
