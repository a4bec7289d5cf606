"""Polynomials and rational functions over Q from spaces that are known modulo primes, at values of the symbols."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from flint import fmpq_mpoly

from kahanmaps.algebra.polynomials import RationalFunction, over_one_denominator, primitive_part, ring
from kahanmaps.algebra.roots import Root
from kahanmaps.errors import BadPrime
from kahanmaps.laboratory.modular_points import NoPoint, exponents_up_to
from kahanmaps.laboratory.preserve.darboux_spaces import DarbouxSpace
from kahanmaps.laboratory.preserve.number_fields import primitive_over, reconstruct_at

Spaces = Sequence[DarbouxSpace]


@dataclass(frozen=True)
class ClosedForms:
    """The bases of spaces as polynomials in the variables, the symbols and eps; None and a reason if not found."""

    bases: list[list[fmpq_mpoly]] | None
    reason: str = ""


def closed_forms(
    model: Spaces,
    spaces_at: Callable[[int, tuple[int, ...]], Spaces | None],
    variables: Sequence[str],
    symbols: Sequence[str],
    eps_enters: str,
    *,
    root: Root | None = None,
    seed: int = 0,
    seconds: float = 60.0,
) -> ClosedForms:
    """The polynomials that span spaces whose reduced echelon bases are known modulo primes.

    `spaces_at(prime, values)` gives the spaces modulo the prime, in the order of `model`, for values of the symbols
    and, where it enters as a "symbol", of eps last; None at a special value. eps "not" entering, they are for a given
    number; entering "by weight", they are for eps = 1, and x becomes eps x in them: so it is for homogeneous f. The
    results are polynomials in (variables, symbols, eps), primitive: integer coefficients without a common factor,
    that of a polynomial in the symbols included. With a `root` the only symbol stands for it.
    """
    supports = [space.support for space in model]
    places = [_places(space) for space in model]

    def box(prime: int, values: tuple[int, ...]) -> tuple[int, ...] | None:
        try:
            found = spaces_at(prime, values)
        except (NoPoint, BadPrime):
            return None
        if found is None:
            return None
        entries: list[int] = []
        for space, support, cells, wanted in zip(found, supports, places, model, strict=True):
            if not set(space.support) <= set(support) or len(space.basis) != len(wanted.basis):
                return None
            entries += [space.basis[i][k] for i, k in cells]
        return tuple(entries)

    names = (*symbols, "eps") if eps_enters == "symbol" else tuple(symbols)
    deadline = time.monotonic() + seconds
    functions: list[RationalFunction] = []
    if any(places):
        answer = reconstruct_at(root, box, names, seed=seed, deadline=deadline)
        if answer.functions is None:
            return ClosedForms(None, answer.reason)
        functions += answer.functions
    context = ring((*variables, *symbols, "eps"))
    bases = []
    for space, cells in zip(model, places, strict=True):
        coefficients = {cell: functions.pop(0) for cell in cells}
        basis = [_polynomial(space, i, coefficients, context, len(variables)) for i in range(len(space.basis))]
        if root is not None:
            basis = [primitive_over(root, P, len(variables)) for P in basis]
        bases.append([_weighted(P, len(variables)) for P in basis] if eps_enters == "by weight" else basis)
    return ClosedForms(bases)


def _places(space: DarbouxSpace) -> list[tuple[int, int]]:
    """Where the basis has entries other than the zeros and ones of the echelon form."""
    pivots = [_leading(vector) for vector in space.basis]
    return [
        (i, k) for i, vector in enumerate(space.basis) for k, entry in enumerate(vector) if entry and k != pivots[i]
    ]


def _weighted(polynomial: fmpq_mpoly, n: int) -> fmpq_mpoly:
    """P(eps x), divided by a power of eps."""
    least = min(sum(int(e) for e in monomial[:n]) for monomial in polynomial.monoms())
    weighted: fmpq_mpoly = polynomial.context().from_dict(
        {(*m[:-1], sum(int(e) for e in m[:n]) - least): coefficient for m, coefficient in polynomial.terms()}
    )
    return weighted


def _leading(vector: list[int]) -> int:
    return max(k for k, entry in enumerate(vector) if entry)


def _polynomial(
    space: DarbouxSpace, row: int, coefficients: dict[tuple[int, int], RationalFunction], context: Any, n: int
) -> fmpq_mpoly:
    """One polynomial of the basis, cleared of denominators and primitive."""
    monomials = exponents_up_to(space.dim, space.degree)
    mine = {k: function for (i, k), function in coefficients.items() if i == row}
    pivot = _leading(space.basis[row])
    gens = context.gens()[n:]
    above, below = over_one_denominator(list(mine.values()), context, gens)
    total = context.constant(0)
    for k, factor in (*zip(mine, above, strict=True), (pivot, below)):
        total = total + factor * context.from_dict({(*monomials[k], *([0] * len(gens))): 1})
    return primitive_part(total)[1]
