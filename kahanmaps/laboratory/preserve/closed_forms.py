"""Polynomials and rational functions over Q from spaces that are known modulo primes, at values of the symbols.

Over a number field Q[t]/g a coefficient c_0 + c_1 t + ... is known modulo a prime where g splits from its values at all
roots of g there, by interpolation; the c_j are functions over Q, and are found as those are.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

from flint import fmpq_mpoly, fmpq_poly

from kahanmaps.algebra.etale import EtaleElement
from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.interpolation import BlackBox, Point, Reconstruction, reconstruct
from kahanmaps.algebra.polynomials import RationalFunction, over_one_denominator, primitive_part, ring
from kahanmaps.algebra.residues import random_prime
from kahanmaps.algebra.roots import Root
from kahanmaps.algebra.work import Budget
from kahanmaps.errors import BadPrime
from kahanmaps.laboratory.modular_points import NoPoint, exponents_up_to, interpolated
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import DarbouxSpace

MAX_DEGREE = 6  # of a field: its polynomial splits modulo one prime in 720 or more of them


def reconstruct_at(root: Root | None, black_box: BlackBox, names: Sequence[str], **options: Any) -> Reconstruction:
    """As `reconstruct` does, the first of the names standing for the root where there is one.

    The box is asked at all roots modulo primes at which the polynomial splits; the functions are polynomials of a
    degree below that of the field in the first name. `options` are those of `reconstruct`.
    """
    if root is None:
        return reconstruct(black_box, names, **options)
    m = root.degree
    assert m <= MAX_DEGREE  # or primes are too rare; who makes a laboratory is told so

    def split(rng: random.Random) -> int:
        while True:
            prime = random_prime(rng)
            with suppress(BadPrime):
                if len(root.residues(GF(prime))) == m:
                    return prime

    def box(prime: int, point: Point) -> list[int] | None:
        roots, rows = root.residues(GF(prime)), []
        for t in roots:
            values = black_box(prime, (t, *point))
            if values is None:
                return None
            rows.append(values)
        through = [interpolated(roots, column, prime) for column in zip(*rows, strict=True)]
        return [int(P[j]) for P in through for j in range(m)]

    answer = reconstruct(box, names[1:], draw=split, **options)
    if answer.functions is None:
        return answer
    t, *gens = ring(names).gens()
    functions = []
    for k in range(0, len(answer.functions), m):
        numerators, denominator = over_one_denominator(answer.functions[k : k + m], t.context(), gens)
        functions.append(RationalFunction(sum((P * t**j for j, P in enumerate(numerators)), 0 * t), denominator))
    return replace(answer, functions=tuple(functions))


def primitive_over(root: Root, polynomial: fmpq_mpoly, n: int) -> fmpq_mpoly:
    """A polynomial in n variables, the root and eps, not 0, without factors that contain no variable.

    It has integer coefficients without a common factor; of its multiples by numbers of the field with a rational
    coefficient it is the shortest.

    >>> from kahanmaps.algebra.roots import parse_root
    >>> x, y, a, eps = ring(["x", "y", "a", "eps"]).gens()
    >>> primitive_over(parse_root("root of t^2 - 2"), (a*x + 6*y) * (1 - a*eps), 2)
    3*y*a + x
    """
    K = root.number_field
    parts: dict[tuple[int, ...], list[EtaleElement]] = {}
    for monomial, coefficient in root.remainder(polynomial, n).terms():
        *exponents, j, e = (int(k) for k in monomial)
        row = parts.setdefault(tuple(exponents), [])
        row += [K.zero] * (e + 1 - len(row))
        row[e] = row[e] + K.convert(fmpq_poly([0] * j + [coefficient]))
    content: list[EtaleElement] = []
    for row in parts.values():
        content, rest = row, content
        while rest:
            content, rest = rest, _divided(content, rest)[1]
    entries = {
        (*exponents, e): c
        for exponents, row in parts.items()
        for e, c in enumerate(_divided(row, content)[0])
        if c != 0
    }
    found = []
    for unit in {str(c): c for c in entries.values()}.values():
        terms = {
            (*m[:-1], j, m[-1]): number
            for m, c in entries.items()
            for j, number in enumerate((c / unit).coefficients)
            if number != 0
        }
        found.append(primitive_part(polynomial.context().from_dict(terms))[1])
    return min(found, key=lambda P: (len(P), len(str(P)), str(P)))


def _divided(P: Sequence[EtaleElement], Q: Sequence[EtaleElement]) -> tuple[list[EtaleElement], list[EtaleElement]]:
    """Quotient and remainder of polynomials over a field, coefficients from that of degree 0 on; the last is not 0."""
    quotient, rest = [Q[-1] * 0] * max(0, len(P) - len(Q) + 1), list(P)
    while len(rest) >= len(Q):
        shift, factor = len(rest) - len(Q), rest[-1] / Q[-1]
        quotient[shift] = factor
        rest = [c - factor * Q[k - shift] if k >= shift else c for k, c in enumerate(rest[:-1])]
        while rest and rest[-1] == 0:
            rest.pop()
    return quotient, rest


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
    budget: Budget,
) -> ClosedForms:
    """The polynomials that span spaces whose reduced echelon bases are known modulo primes.

    `spaces_at(prime, values)` gives the spaces modulo the prime, in the order of `model`, for values of the symbols
    and, where it enters as a "symbol", of eps last; None at a special value. eps "not" entering, they are for a given
    number; entering "by weight", they are for eps = 1, and x becomes eps x in them: so it is for homogeneous f. The
    results are polynomials in (variables, symbols, eps), primitive: integer coefficients without a common factor,
    that of a polynomial in the symbols included. With a `root` the only symbol stands for it.
    """
    supports = [space.support for space in model]
    # Echelon forms end in a 1 at the largest monomial; the places of other entries than this and zeros are unknown.
    pivots = [[max(k for k, entry in enumerate(vector) if entry) for vector in space.basis] for space in model]
    places = [
        [(i, k) for i, vector in enumerate(space.basis) for k, c in enumerate(vector) if c and k != ends[i]]
        for space, ends in zip(model, pivots, strict=True)
    ]

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
    functions: list[RationalFunction] = []
    if any(places):
        answer = reconstruct_at(root, box, names, seed=seed, budget=budget)
        if answer.functions is None:
            return ClosedForms(None, answer.reason)
        functions += answer.functions
    context, n = ring((*variables, *symbols, "eps")), len(variables)
    gens, bases = context.gens()[n:], []
    for space, ends, cells in zip(model, pivots, places, strict=True):
        coefficients, monomials = {cell: functions.pop(0) for cell in cells}, exponents_up_to(space.dim, space.degree)
        basis = []
        for row, pivot in enumerate(ends):
            mine = {k: function for (i, k), function in coefficients.items() if i == row}
            numerators, denominator = over_one_denominator(list(mine.values()), context, gens)
            P = context.constant(0)
            for k, factor in (*zip(mine, numerators, strict=True), (pivot, denominator)):
                P = P + factor * context.from_dict({(*monomials[k], *([0] * len(gens))): 1})
            P = primitive_part(P)[1]
            if root is not None:
                P = primitive_over(root, P, n)
            if eps_enters == "by weight":  # P(eps x), divided by a power of eps
                degrees = {monomial: sum(map(int, monomial[:n])) for monomial in P.monoms()}
                least = min(degrees.values())
                P = context.from_dict({(*m[:-1], degrees[m] - least): c for m, c in P.terms()})
            basis.append(P)
        bases.append(basis)
    return ClosedForms(bases)
