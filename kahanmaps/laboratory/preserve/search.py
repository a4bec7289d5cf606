"""The search for spaces of polynomials with a common cofactor, recorded so that it can be repeated on another map.

A search runs on one map: modulo a prime, at one eps, at one value of each symbol. What it found are steps: affine
integrals, the relations of a degree, a product of cofactors. Repeating the steps on maps with other primes, eps and
values of the symbols gives the coefficients of the same polynomials there, from which closed forms are interpolated.

Spaces that look alike are told apart on every map, so that one rational function belongs to each of them. Two pencils
may have zeros at the same places: then nothing on a single map, modulo one prime and at one value of the symbols, says
which of them is which. Take a coefficient w in which they differ. Its values w_1, ..., w_k on the k spaces are the
roots of chi(T) = (T - w_1) ... (T - w_k), whose coefficients do not depend on the order of the spaces: they can be
interpolated. The factors of chi over Q are the spaces again: a linear one is the w_i of one space as a function of the
symbols and eps, by whose value this space is known on any other map. A factor of higher degree belongs to spaces that
are conjugate over an extension and have no formula over Q.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product as cartesian
from itertools import takewhile
from math import comb
from types import MappingProxyType

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.modular_matrices import null_space
from kahanmaps.algebra.polynomials import RationalFunction, irreducible_factors, over_one_denominator, ring, substitute
from kahanmaps.algebra.residues import chinese, simple_fraction
from kahanmaps.algebra.roots import Root
from kahanmaps.algebra.work import SPENT, Budget
from kahanmaps.algebra.work import count as count_work
from kahanmaps.errors import BadPrime
from kahanmaps.laboratory.laboratory import Laboratory, reconstruct_at
from kahanmaps.laboratory.modular_points import ModularFlow, ModularMap, NoPoint
from kahanmaps.laboratory.preserve.darboux.cofactors import (
    Cofactor,
    Sample,
    SearchStep,
    SpaceSearch,
    cofactor_space,
    cofactor_spaces,
    points_needed,
    search_cofactors,
)
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import (
    SMALL_SPAN,
    DarbouxSpace,
    Pattern,
    darboux_spaces,
    gradient_rank,
    two_point_spaces,
)
from kahanmaps.laboratory.preserve.hirota_kimura import Profile
from kahanmaps.maps.kahan import KahanMap

# Degrees up to which polynomials with a given cofactor are sought, by dimension.
_COFACTOR_DEGREE = {1: 6, 2: 9, 3: 7, 4: 6, 5: 6, 6: 4}
_MOST_TERMS = 1000
Alike = Callable[[int, tuple[int, ...]], Sequence[DarbouxSpace] | None]

_SAMPLES = (150, 600, 3000)  # a simple coefficient is looked for before many values are taken for one
_COEFFICIENTS = 6
NOTHING: Mapping[int, Mapping[Pattern, Branches]] = MappingProxyType({})
_SPARE = 8
AFFINE = "v.x with v.f(x) = 0"
_CHANCE = 20  # bits by which a fraction is simpler than one of a random residue


@dataclass(frozen=True)
class Branches:
    """Spaces of one pattern by the values of their coefficient at `place`: `roots` are its functions, one a space."""

    place: tuple[int, int]
    roots: tuple[RationalFunction, ...]

    def in_order(self, alike: Sequence[DarbouxSpace], map_: ModularMap) -> list[DarbouxSpace] | None:
        """The spaces on a map in the order of the roots; None where two agree there, or one is missing."""
        field = GF(map_.prime)
        at = [field.convert(value) for value in (*map_.values, map_.eps)]
        row, column = self.place
        by_value = {space.basis[row][column]: space for space in alike}
        values = [root.value(field, at[: len(root.names)]) for root in self.roots]
        if len(by_value) < len(alike) or None in values:
            return None
        found = [by_value.get(int(value)) for value in values]
        return None if None in found else [space for space in found if space is not None]


def affine_space(map_: ModularMap) -> DarbouxSpace | None:
    """The span of 1 and the affine integrals v.x, for Kahan maps those with v.f = 0; None where there are none."""
    n, prime = map_.dim, map_.prime
    changes = [[b - a for a, b in zip(x, image, strict=True)] for x, image in map_.pairs(n + _SPARE)]
    vectors = null_space(changes, n, prime)
    if not vectors:
        return None
    return DarbouxSpace.spanned_by(n, 1, [[1] + [0] * n, *([0, *vector] for vector in vectors)], prime)


def search(
    map_: ModularMap,
    profile: Profile,
    cofactors: Sequence[Cofactor],
    denominators: Sequence[Cofactor] = (),
    *,
    budget: Budget,
    progress: Callable[[str], None] = lambda _: None,
) -> SpaceSearch:
    """Spaces whose ratios are as many independent integrals as the profile shows, as far as cheap searches find them.

    These are the span of few relations along orbits, and polynomials with known cofactors or over known denominators.
    Nothing but affine integrals is begun when the `budget` is spent. Raises NoPoint.
    """
    found, wanted = SpaceSearch(), profile.codimension
    is_of_field = isinstance(map_, ModularFlow) or isinstance(map_.map, KahanMap)
    affine = affine_space(map_)
    if affine is not None:
        found.add(SearchStep("affine", 1, None, AFFINE if is_of_field else "affine integral"), [affine])
    if is_of_field:  # whose denominators are factors of a determinant, which is longer than few relations
        take_relations(map_, profile, found, SMALL_SPAN, budget, progress)
    if gradient_rank(map_, found.all_spaces) >= wanted:
        return found
    dim, top = map_.dim, _COFACTOR_DEGREE.get(map_.dim, 2)
    while comb(dim + top, top) > _MOST_TERMS:
        top -= 1
    progress(f"polynomials of degree up to {top} with {comb(dim + top, top)} terms and known cofactors")
    more = search_cofactors(map_, cofactors, denominators, found.all_spaces, wanted, top, budget)
    steps, spaces = [*found.steps, *more.steps], [*found.spaces, *more.spaces]
    found = replace(more, steps=steps, spaces=spaces, searched=found.searched)
    if not is_of_field:
        take_relations(map_, profile, found, SMALL_SPAN, budget, progress)
    return found


def take_relations(
    map_: ModularMap,
    profile: Profile,
    found: SpaceSearch,
    largest: int,
    budget: Budget,
    progress: Callable[[str], None],
) -> str:
    """Add the spaces that are seen in the span of the relations of a degree, until there are as many as wanted.

    Taken are the degrees in which the relations of all orbits span at most `largest` dimensions. Returns what was not
    tried for lack of budget.
    """
    few = takewhile(lambda size: size < largest, profile.nullities)
    for degree in [degree for degree, size in enumerate(few, 1) if size]:
        known = found.all_spaces
        independent = gradient_rank(map_, known)
        if independent >= profile.codimension:
            break
        if degree in found.searched:
            continue
        if budget.is_spent:
            return f"relations of degree {degree} and more were not searched: {SPENT}"
        progress(f"closed forms from the relations of degree {degree}")
        spaces = darboux_spaces(map_, degree, known, largest)
        if spaces is not None:
            found.searched.append(degree)
        if spaces and gradient_rank(map_, [*known, *spaces]) > independent:
            step = SearchStep("relations", degree, None, f"relations of degree {degree} along orbits")
            found.add(step, sorted(spaces, key=lambda space: space.pattern))
    return ""


def repeat(
    found: SpaceSearch,
    map_: ModularMap,
    reference: int,
    branches: Mapping[int, Mapping[Pattern, Branches]] = NOTHING,
) -> SpaceSearch | None:
    """The same steps on another map; None where they give spaces of another shape (a special value).

    `reference` is the prime of `found`. Spaces of the same shape come in any order where there are no `branches` of
    their step, by which they are told apart.
    """
    again = SpaceSearch(cofactors=found.cofactors)
    steps = list(zip(found.steps, found.spaces, strict=True))
    needed = [points_needed(map_.dim, step.degree, *model) for step, model in steps if step.product is not None]
    sample = Sample.of(map_, found.cofactors, max(needed, default=0))
    for number, (step, model) in enumerate(steps):
        if step.kind == "affine":
            affine = affine_space(map_)
            group = [affine] if affine is not None else []
        elif step.product is not None:
            if step.up_to_numbers:
                group = [space for _, space in cofactor_spaces(sample, step.product, step.degree, model)]
            else:
                group = [cofactor_space(sample, step.product, step.degree, *model)]
        elif step.lift is not None:
            group = two_point_spaces(map_, step.lift)
        else:
            group = darboux_spaces(map_, step.degree, again.all_spaces) or []
        # In the order of the model, by the places of their zeros and, where these agree, by branches. There may be more
        # of them than in the model, see `may_be_conjugate`.
        by_pattern, of_step, waiting = classes(group), branches.get(number, {}), dict[Pattern, list[DarbouxSpace]]()
        for kind, wanted in classes(model).items():
            alike = by_pattern.get(kind, [])
            if kind in of_step:
                alike = of_step[kind].in_order(alike, map_) or []
            elif len(alike) > len(wanted):
                alike = _most_alike(alike, wanted, map_.prime, reference)
            if len(alike) < len(wanted):
                return None
            waiting[kind] = alike
        again.add(step, [waiting[space.pattern].pop(0) for space in model])
    return again


def classes(group: Sequence[DarbouxSpace]) -> dict[Pattern, list[DarbouxSpace]]:
    """The spaces by the places of their zeros."""
    found: dict[Pattern, list[DarbouxSpace]] = {}
    for space in group:
        found.setdefault(space.pattern, []).append(space)
    return found


def may_be_conjugate(found: SpaceSearch) -> bool:
    """Whether spaces of one degree have the same monomials, as spaces have that are conjugate over an extension of Q.

    These exist only modulo primes where the extension splits, and have no formula over Q.
    """
    return any(len(classes(group)) < len(group) for group in found.spaces)


def _most_alike(
    alike: list[DarbouxSpace], wanted: list[DarbouxSpace], prime: int, reference: int
) -> list[DarbouxSpace]:
    """Those spaces that share most numbers with the wanted ones: conjugate ones, which are too many, share none.

    Two coefficients seem to be the same rational number if one simple fraction has them modulo both primes.
    """
    waiting = list(alike)
    found = []
    for model in wanted:
        counts = []
        for space in waiting:
            rows = zip(space.basis, model.basis, strict=True)
            pairs = [(a, b) for row in rows for a, b in zip(*row, strict=True) if b and b != 1]
            count_work(60 * len(pairs))
            residues = chinese([a for a, _ in pairs], prime, [b for _, b in pairs], reference)
            counts.append(sum(simple_fraction(c, prime * reference, _CHANCE) is not None for c in residues))
        found.append(waiting.pop(counts.index(max(counts))))
    return found


def bases_of(
    laboratory: Laboratory, reference: int, found: SpaceSearch, budget: Budget
) -> tuple[list[list[fmpq_mpoly]], str]:
    """Bases of all spaces, polynomials in (variables, symbols, eps); none, and a reason, where that failed.

    `reference` is the prime modulo which the spaces were found.
    """
    if repeat(found, laboratory.maps[1], reference) is None:
        return [], "what was found at one eps was not found at another"
    names = (*laboratory.symbols, "eps") if laboratory.eps_enters == "symbol" else laboratory.symbols

    @cache
    def again_at(prime: int, values: tuple[int, ...]) -> SpaceSearch | None:
        try:
            return repeat(found, laboratory.map_for(prime, values), reference)
        except (NoPoint, BadPrime):
            return None

    branches: dict[int, dict[Pattern, Branches]] = {}  # what tells spaces apart that have zeros at the same places
    for number, group in enumerate(found.spaces):
        for kind, model in classes(group).items():
            if len(model) == 1:
                continue

            def alike(
                prime: int, values: tuple[int, ...], number: int = number, kind: Pattern = kind
            ) -> list[DarbouxSpace] | None:
                other = again_at(prime, values)
                return None if other is None else classes(other.spaces[number])[kind]

            known = tell_apart(model, alike, names, laboratory.seed, budget, laboratory.root)
            if known is None:
                why = f"nothing rational tells {len(model)} spaces of degree {model[0].degree} apart"
                why = SPENT if budget.is_spent else why
                return [], f"integrals were found modulo primes, but no closed form: {why}"
            branches.setdefault(number, {})[kind] = known

    def spaces_on(map_: ModularMap) -> list[DarbouxSpace] | None:
        again = repeat(found, map_, reference, branches)
        return None if again is None else again.all_spaces

    forms = laboratory.formulas(found.all_spaces, spaces_on, budget)
    if forms.bases is None:
        return [], f"integrals were found modulo primes, but no closed form: {forms.reason}"
    return forms.bases, ""


def tell_apart(
    model: Sequence[DarbouxSpace],
    alike: Alike,
    names: Sequence[str],
    seed: int,
    budget: Budget,
    root: Root | None = None,
) -> Branches | None:
    """What tells spaces of one pattern apart at every value of `names`; None where they are conjugate.

    None also where the budget is spent first.

    `model` are the spaces on one map, `alike(prime, values)` those on others, in any order; None at special values.
    """
    places = [
        (i, k)
        for i, vector in enumerate(model[0].basis)
        for k in range(len(vector))
        if len({space.basis[i][k] for space in model}) == len(model)
    ]
    count, context = len(model), ring((*names, "T"))
    *gens, T = context.gens()
    origin = {"T": fmpq(0)}
    for samples, place in cartesian(_SAMPLES, places[:_COEFFICIENTS]):
        if budget.is_spent:
            return None

        def symmetric_functions(
            prime: int, values: tuple[int, ...], place: tuple[int, int] = place
        ) -> list[int] | None:
            spaces = alike(prime, values)
            if spaces is None or len(spaces) != count:
                return None
            coefficients = [1]  # of prod (T - w), the highest first
            for space in spaces:
                w = space.basis[place[0]][place[1]]
                shifted = zip([*coefficients, 0], [0, *coefficients], strict=True)
                coefficients = [(here - w * before) % prime for here, before in shifted]
            return coefficients[1:]

        answer = reconstruct_at(root, symmetric_functions, names, seed=seed, max_samples=samples, budget=budget)
        if answer.functions is None:
            continue
        numerators, denominator = over_one_denominator(answer.functions, context, gens)
        chi = sum((P * T ** (count - k) for k, P in enumerate(numerators, 1)), denominator * T**count)
        linear = [factor for factor, _ in irreducible_factors(chi) if factor.degrees()[-1] == 1]
        roots = tuple(
            RationalFunction(-substitute(factor, origin), substitute(factor.derivative(len(gens)), origin))
            for factor in linear
        )
        return Branches(place, roots) if len(roots) == count else None
    return None
