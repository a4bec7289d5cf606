"""What a search found modulo one prime as polynomials over Q: the search is repeated on other maps and interpolated."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from flint import fmpq_mpoly

from kahanmaps.errors import BadPrime
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.modular_points import ModularMap, NoPoint
from kahanmaps.laboratory.preserve.branches import Branches, Pattern, tell_apart
from kahanmaps.laboratory.preserve.cofactors import Cofactor
from kahanmaps.laboratory.preserve.darboux_spaces import DarbouxSpace
from kahanmaps.laboratory.preserve.search import Found, classes, repeat


def bases_of(
    laboratory: Laboratory, reference: int, found: Found, cofactors: Sequence[Cofactor], deadline: float
) -> tuple[list[list[fmpq_mpoly]], str]:
    """Bases of all spaces, polynomials in (variables, symbols, eps); none, and a reason, where that failed.

    `reference` is the prime modulo which the spaces were found.
    """
    if repeat(found, laboratory.maps[1], cofactors, reference) is None:
        return [], "what was found at one eps was not found at another"
    branches, reason = _branches(laboratory, found, cofactors, reference, deadline)
    if reason:
        return [], f"integrals were found modulo primes, but no closed form: {reason}"

    def spaces_on(map_: ModularMap) -> list[DarbouxSpace] | None:
        again = repeat(found, map_, cofactors, reference, branches)
        return None if again is None else again.all_spaces

    forms = laboratory.formulas(found.all_spaces, spaces_on, deadline)
    if forms.bases is None:
        return [], f"integrals were found modulo primes, but no closed form: {forms.reason}"
    return forms.bases, ""


def _branches(
    laboratory: Laboratory, found: Found, cofactors: Sequence[Cofactor], reference: int, deadline: float
) -> tuple[dict[int, dict[Pattern, Branches]], str]:
    """What tells the spaces of each step apart that have zeros at the same places, and a reason where nothing does."""
    names = (*laboratory.symbols, "eps") if laboratory.eps_enters == "symbol" else laboratory.symbols

    @cache
    def again(prime: int, values: tuple[int, ...]) -> Found | None:
        try:
            return repeat(found, laboratory.map_for(prime, values), cofactors, reference)
        except (NoPoint, BadPrime):
            return None

    branches: dict[int, dict[Pattern, Branches]] = {}
    for number, group in enumerate(found.spaces):
        for kind, model in classes(group).items():
            if len(model) == 1:
                continue

            def alike(
                prime: int, values: tuple[int, ...], number: int = number, kind: Pattern = kind
            ) -> list[DarbouxSpace] | None:
                other = again(prime, values)
                return None if other is None else classes(other.spaces[number])[kind]

            told = tell_apart(model, alike, names, laboratory.seed, deadline, laboratory.root)
            if told is None:
                return {}, f"nothing rational tells {len(model)} spaces of degree {model[0].degree} apart"
            branches.setdefault(number, {})[kind] = told
    return branches, ""
