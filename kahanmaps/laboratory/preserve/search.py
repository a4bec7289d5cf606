"""The search for spaces of polynomials with a common cofactor, recorded so that it can be repeated on another map.

A search runs on one map: modulo a prime, at one eps, at one value of each symbol. It records the steps that gave a
space: affine integrals, the relations of a degree, a product of cofactors. The steps are repeated on maps with other
primes, eps and values of the symbols. From the bases on these maps, the coefficients are interpolated.

Interpolation needs the same space on every map. If two spaces have bases with the same zero pattern, a single map,
modulo one prime and at one value of the symbols, does not determine which space is which. Take a coefficient w in which
the spaces differ. Its values w_1, ..., w_k on the k spaces are the roots of chi(T) = (T - w_1) ... (T - w_k). The
coefficients of chi do not depend on the order of the spaces, so they can be interpolated. A linear factor of chi over Q
gives w_i for one space as a function of the symbols and eps. The value of this function identifies the space on any
other map. A factor of higher degree belongs to spaces conjugate over an extension of Q, without formulas over Q.
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
from kahanmaps.algebra.work import SPENT, Budget, count_work
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

# The largest degree, by dimension, in the search for polynomials with a given cofactor.
_COFACTOR_DEGREE = {1: 6, 2: 9, 3: 7, 4: 6, 5: 6, 6: 4}
_MAX_TERMS = 1000  # monomials of a polynomial in this search
SpacesAt = Callable[[int, tuple[int, ...]], Sequence[DarbouxSpace] | None]  # arguments: a prime, values of `names`

_SAMPLES = (150, 600, 3000)  # numbers of samples; all coefficients are tried with 150 before any is tried with 600
_MAX_COEFFICIENTS = 6  # the number of coefficients that are tried to distinguish spaces
NO_BRANCHES: Mapping[int, Mapping[Pattern, Branches]] = MappingProxyType({})
_SPARE = 8  # points beyond the number of unknowns
AFFINE = "v.x with v.f(x) = 0"
_SPARE_BITS = 20  # bits by which a fraction must be shorter than the fraction of a random residue


@dataclass(frozen=True)
class Branches:
    """Spaces of one zero pattern; the basis of the i-th space has the entry `roots[i]` at `position` (row, column)."""

    position: tuple[int, int]
    roots: tuple[RationalFunction, ...]

    def in_order(self, spaces: Sequence[DarbouxSpace], map_: ModularMap) -> list[DarbouxSpace] | None:
        """Return the spaces in the order of the roots; None if two have the same entry on this map or one is absent."""
        field = GF(map_.prime)
        parameters = [field.convert(value) for value in (*map_.values, map_.eps)]
        row, column = self.position
        by_value = {space.basis[row][column]: space for space in spaces}
        values = [root.value(field, parameters[: len(root.names)]) for root in self.roots]
        if len(by_value) < len(spaces) or None in values:
            return None
        ordered_spaces = [by_value.get(int(value)) for value in values]
        return None if None in ordered_spaces else [space for space in ordered_spaces if space is not None]


def affine_space(map_: ModularMap) -> DarbouxSpace | None:
    """Return the span of 1 and the affine integrals v.x (for Kahan maps: v.f = 0); None if no v.x is an integral."""
    n, prime = map_.dim, map_.prime
    changes = [[b - a for a, b in zip(x, image, strict=True)] for x, image in map_.pairs(n + _SPARE)]
    vectors = null_space(changes, n, prime)
    if not vectors:
        return None
    return DarbouxSpace.spanned_by(n, 1, [[1] + [0] * n, *([0, *vector] for vector in vectors)], prime)


def search_spaces(
    map_: ModularMap,
    profile: Profile,
    cofactors: Sequence[Cofactor],
    denominator_cofactors: Sequence[Cofactor] = (),
    *,
    budget: Budget,
    progress: Callable[[str], None] = lambda _: None,
) -> SpaceSearch:
    """Search by fast methods for spaces, until ratios of their elements give as many integrals as the profile shows.

    The fast methods are: affine integrals, relations along orbits whose span has a small dimension, polynomials with
    known cofactors, and numerators over known denominators. After the `budget` is spent, only affine integrals are
    tried. Raises NoPoint.
    """
    result, required = SpaceSearch(), profile.codimension
    is_of_vector_field = isinstance(map_, ModularFlow) or isinstance(map_.map, KahanMap)
    span = affine_space(map_)
    if span is not None:
        result.add(SearchStep("affine", 1, None, AFFINE if is_of_vector_field else "affine integral"), [span])
    if is_of_vector_field:  # before cofactors: relations of small span are faster than factors of det(I - eps f')
        add_relation_spaces(map_, profile, result, SMALL_SPAN, budget, progress)
    if gradient_rank(map_, result.all_spaces) >= required:
        return result
    dim, max_degree = map_.dim, _COFACTOR_DEGREE.get(map_.dim, 2)
    while comb(dim + max_degree, max_degree) > _MAX_TERMS:
        max_degree -= 1
    progress(
        f"polynomials of degree up to {max_degree} with {comb(dim + max_degree, max_degree)} terms and known cofactors"
    )
    cofactor_result = search_cofactors(
        map_, cofactors, denominator_cofactors, result.all_spaces, required, max_degree, budget
    )
    steps, spaces = [*result.steps, *cofactor_result.steps], [*result.spaces, *cofactor_result.spaces]
    result = replace(cofactor_result, steps=steps, spaces=spaces, searched=result.searched)
    if not is_of_vector_field:
        add_relation_spaces(map_, profile, result, SMALL_SPAN, budget, progress)
    return result


def add_relation_spaces(
    map_: ModularMap,
    profile: Profile,
    result: SpaceSearch,
    max_dimension: int,
    budget: Budget,
    progress: Callable[[str], None],
) -> str:
    """Search the spans of relations along orbits for spaces, until they give as many integrals as the profile shows.

    Only degrees in which the relations of all orbits span at most `max_dimension` dimensions are tried. `result` gets
    the spaces. Returns a sentence on the degrees that were skipped at the work limit, "" if none was skipped.
    """
    small_nullities = takewhile(lambda nullity: nullity < max_dimension, profile.nullities)
    for degree in [degree for degree, nullity in enumerate(small_nullities, 1) if nullity]:
        known_spaces = result.all_spaces
        independent_count = gradient_rank(map_, known_spaces)
        if independent_count >= profile.codimension:
            break
        if degree in result.searched:
            continue
        if budget.is_spent:
            return f"relations of degree {degree} and more were not searched: {SPENT}"
        progress(f"polynomials in the span of the relations of degree {degree}")
        spaces = darboux_spaces(map_, degree, known_spaces, max_dimension)
        if spaces is not None:
            result.searched.append(degree)
        if spaces and gradient_rank(map_, [*known_spaces, *spaces]) > independent_count:
            step = SearchStep("relations", degree, None, f"relations of degree {degree} along orbits")
            result.add(step, sorted(spaces, key=lambda space: space.pattern))
    return ""


def repeat_search(
    original: SpaceSearch,
    map_: ModularMap,
    reference: int,
    branches: Mapping[int, Mapping[Pattern, Branches]] = NO_BRANCHES,
) -> SpaceSearch | None:
    """Repeat the steps of a search on another map; return None if the spaces there have other zero patterns.

    `reference` is the prime of the `original` search. Spaces of one step with the same zero pattern are in any order,
    unless `branches` has an entry for them.
    """
    repeated = SpaceSearch(cofactors=original.cofactors)
    steps = list(zip(original.steps, original.spaces, strict=True))
    point_counts = [points_needed(map_.dim, step.degree, *model) for step, model in steps if step.product is not None]
    sample = Sample.of(map_, original.cofactors, max(point_counts, default=0))
    for step_index, (step, model) in enumerate(steps):
        if step.kind == "affine":
            affine_integrals = affine_space(map_)
            spaces = [affine_integrals] if affine_integrals is not None else []
        elif step.product is not None:
            if step.up_to_numbers:
                spaces = [space for _, space in cofactor_spaces(sample, step.product, step.degree, model)]
            else:
                spaces = [cofactor_space(sample, step.product, step.degree, *model)]
        elif step.two_point_basis is not None:
            spaces = two_point_spaces(map_, step.two_point_basis)
        else:
            spaces = darboux_spaces(map_, step.degree, repeated.all_spaces) or []
        # Order the spaces as in `model`: by zero pattern and, for equal patterns, by branches. There may be more spaces
        # than in `model`, see `may_be_conjugate`.
        by_pattern, step_branches, ordered_spaces = (
            group_by_pattern(spaces),
            branches.get(step_index, {}),
            dict[Pattern, list[DarbouxSpace]](),
        )
        for pattern, model_spaces in group_by_pattern(model).items():
            candidates = by_pattern.get(pattern, [])
            if pattern in step_branches:
                candidates = step_branches[pattern].in_order(candidates, map_) or []
            elif len(candidates) > len(model_spaces):
                candidates = _most_similar_spaces(candidates, model_spaces, map_.prime, reference)
            if len(candidates) < len(model_spaces):
                return None
            ordered_spaces[pattern] = candidates
        repeated.add(step, [ordered_spaces[space.pattern].pop(0) for space in model])
    return repeated


def group_by_pattern(spaces: Sequence[DarbouxSpace]) -> dict[Pattern, list[DarbouxSpace]]:
    """Group the spaces by the zero pattern of their bases."""
    by_pattern: dict[Pattern, list[DarbouxSpace]] = {}
    for space in spaces:
        by_pattern.setdefault(space.pattern, []).append(space)
    return by_pattern


def may_be_conjugate(result: SpaceSearch) -> bool:
    """Return whether two spaces of one step have the same zero pattern, as for spaces conjugate over an extension of Q.

    Conjugate spaces exist only modulo primes at which the extension splits, and have no formula over Q.
    """
    return any(len(group_by_pattern(group)) < len(group) for group in result.spaces)


def _most_similar_spaces(
    spaces: list[DarbouxSpace], models: list[DarbouxSpace], prime: int, reference: int
) -> list[DarbouxSpace]:
    """Return, for each model, the space that has most coefficients in common with it; irrational ones never count.

    Two coefficients count as the same rational number if one simple fraction reduces to them modulo both primes.
    """
    remaining_spaces = list(spaces)
    similar_spaces = []
    for model in models:
        counts = []
        for space in remaining_spaces:
            rows = zip(space.basis, model.basis, strict=True)
            pairs = [(a, b) for row in rows for a, b in zip(*row, strict=True) if b and b != 1]
            count_work(60 * len(pairs))
            residues = chinese([a for a, _ in pairs], prime, [b for _, b in pairs], reference)
            counts.append(sum(simple_fraction(c, prime * reference, _SPARE_BITS) is not None for c in residues))
        similar_spaces.append(remaining_spaces.pop(counts.index(max(counts))))
    return similar_spaces


def interpolate_bases(
    laboratory: Laboratory, reference: int, result: SpaceSearch, budget: Budget
) -> tuple[list[list[fmpq_mpoly]], str]:
    """Interpolate bases of all spaces as polynomials in (variables, symbols, eps).

    `reference` is the prime of the search. Returns the bases and an empty text, or no bases and the reason why.
    """
    if repeat_search(result, laboratory.maps[1], reference) is None:
        return [], "the polynomials found at one eps do not exist at another"
    names = (*laboratory.symbols, "eps") if laboratory.eps_enters == "symbol" else laboratory.symbols

    @cache
    def repeat_at(prime: int, values: tuple[int, ...]) -> SpaceSearch | None:
        try:
            return repeat_search(result, laboratory.map_for(prime, values), reference)
        except (NoPoint, BadPrime):
            return None

    branches: dict[int, dict[Pattern, Branches]] = {}  # by step and zero pattern, if several spaces have this pattern
    for step_index, group in enumerate(result.spaces):
        for pattern, spaces in group_by_pattern(group).items():
            if len(spaces) == 1:
                continue

            def spaces_at(
                prime: int, values: tuple[int, ...], step_index: int = step_index, pattern: Pattern = pattern
            ) -> list[DarbouxSpace] | None:
                repetition = repeat_at(prime, values)
                return None if repetition is None else group_by_pattern(repetition.spaces[step_index])[pattern]

            found_branches = find_branches(spaces, spaces_at, names, laboratory.seed, budget, laboratory.root)
            if found_branches is None:
                count, degree = len(spaces), spaces[0].degree
                reason = f"no rational coefficient distinguishes {count} spaces of degree {degree}"
                reason = SPENT if budget.is_spent else reason
                return [], f"integrals were found modulo primes, but no closed form: {reason}"
            branches.setdefault(step_index, {})[pattern] = found_branches

    def repeated_spaces(map_: ModularMap) -> list[DarbouxSpace] | None:
        repetition = repeat_search(result, map_, reference, branches)
        return None if repetition is None else repetition.all_spaces

    closed_forms = laboratory.formulas(result.all_spaces, repeated_spaces, budget)
    if closed_forms.bases is None:
        return [], f"integrals were found modulo primes, but no closed form: {closed_forms.reason}"
    return closed_forms.bases, ""


def find_branches(
    model: Sequence[DarbouxSpace],
    spaces_at: SpacesAt,
    names: Sequence[str],
    seed: int,
    budget: Budget,
    root: Root | None = None,
) -> Branches | None:
    """Find a coefficient that distinguishes spaces of one zero pattern on every map; `names` are the symbols and eps.

    `model` holds the spaces on one map; `spaces_at(prime, values)` returns the spaces on another map in any order, or
    None at special values. Returns None if the spaces are conjugate over an extension of Q, or at the work limit.
    """
    distinguishing_positions = [
        (i, k)
        for i, vector in enumerate(model[0].basis)
        for k in range(len(vector))
        if len({space.basis[i][k] for space in model}) == len(model)
    ]
    count, context = len(model), ring((*names, "T"))
    *gens, T = context.gens()
    at_zero = {"T": fmpq(0)}
    for samples, position in cartesian(_SAMPLES, distinguishing_positions[:_MAX_COEFFICIENTS]):
        if budget.is_spent:
            return None

        def symmetric_functions(
            prime: int, values: tuple[int, ...], position: tuple[int, int] = position
        ) -> list[int] | None:
            spaces = spaces_at(prime, values)
            if spaces is None or len(spaces) != count:
                return None
            coefficients = [1]  # of prod (T - w), in descending order
            for space in spaces:
                w = space.basis[position[0]][position[1]]
                pairs = zip([*coefficients, 0], [0, *coefficients], strict=True)
                coefficients = [(coefficient - w * previous) % prime for coefficient, previous in pairs]
            return coefficients[1:]

        reconstruction = reconstruct_at(root, symmetric_functions, names, seed=seed, max_samples=samples, budget=budget)
        if reconstruction.functions is None:
            continue
        numerators, denominator = over_one_denominator(reconstruction.functions, context, gens)
        chi = sum((P * T ** (count - k) for k, P in enumerate(numerators, 1)), denominator * T**count)
        linear_factors = [factor for factor, _ in irreducible_factors(chi) if factor.degrees()[-1] == 1]
        roots = tuple(
            RationalFunction(-substitute(factor, at_zero), substitute(factor.derivative(len(gens)), at_zero))
            for factor in linear_factors
        )
        return Branches(position, roots) if len(roots) == count else None
    return None
