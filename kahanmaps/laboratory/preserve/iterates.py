"""Integrals whose formulas contain iterates x~, x~~, ... as letters: coefficients of relations along orbits.

Functions F_0, F_1, ... of (x, x^(k)), bilinear, whose values along every orbit span a line or a plane are found modulo
a prime (darboux_spaces.py) and interpolated. On a line the ratios of the F are integrals, on a plane those of 2 x 2
minors. Put to the proof is that such a ratio has the same value a step later, stated with x in the middle of the piece
of orbit: then I(x, x~) = I(x_, x) contains one step forward and one backward, and can be multiplied out.

Affine integrals come first: on their levels, where x has fewer coordinates, relations of a low degree show what on the
whole space has coefficients of higher degrees. The values c of the levels are symbols of the search, and v.x takes
their place in what it finds. Source: petrera-suris-2018.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from itertools import count
from typing import Any

from flint import fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.duals import DualField
from kahanmaps.algebra.fields import GF, Field
from kahanmaps.algebra.functions import BudgetExceeded
from kahanmaps.algebra.polynomials import RationalFunction, evaluate, linear_combinations, primitive_part, ring
from kahanmaps.algebra.printing import attributes, format_number, format_polynomial, format_rational_function
from kahanmaps.algebra.work import SPENT, Budget
from kahanmaps.checks.certify import MAX_DIMENSION
from kahanmaps.checks.claims import Certainty, Evidence
from kahanmaps.checks.decide import Identity, Sides
from kahanmaps.display_protocols import latex
from kahanmaps.documents.document import DocumentReader
from kahanmaps.documents.files import SystemFile
from kahanmaps.invariants.phase_functions import normalized, orbit_about
from kahanmaps.laboratory.laboratory import Laboratory, certified
from kahanmaps.laboratory.modular_points import Independent, ModularMap, Point, exponents_up_to
from kahanmaps.laboratory.preserve.darboux.affine_functions import affine_integrals, quotient_by
from kahanmaps.laboratory.preserve.darboux.cofactors import SearchStep, SpaceSearch
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import (
    TWO_POINT_BASES,
    TWO_POINT_DEGREE,
    TwoPointBasis,
    bases_with_spaces,
    pairs_of,
)
from kahanmaps.laboratory.preserve.search import bases_of
from kahanmaps.maps.implicit import MapFamily


@dataclass(frozen=True)
class RatioOfIterates:
    """A function I of a piece of an orbit: the ratio of two of the `functions` or, of rank 2, of two minors of them.

    The functions are polynomials in (variables, variables of the k-th iterate, symbols, eps). `numerator` and
    `denominator` are the places of one function or of two: then F_a F_b~ - F_b F_a~ is meant.
    """

    lift: TwoPointBasis
    functions: tuple[fmpq_mpoly, ...]
    numerator: tuple[int, ...]
    denominator: tuple[int, ...]

    @property
    def length(self) -> int:
        """How many successive points it is a function of."""
        return self.lift.shift + self.lift.rank

    def with_limit(self, count: int) -> RatioOfIterates:
        """The ratio of two functions that tend to one constant normalized, the first `count` letters being points."""
        if self.lift.rank > 1:
            return self
        found = normalized(self.formula[0], count)
        parts = found.function.numerator, found.function.denominator
        return RatioOfIterates(self.lift, parts, (0,), (1,)) if found.is_shifted else self

    @property
    def formula(self) -> tuple[RationalFunction, list[tuple[str, fmpq_mpoly]]]:
        """The ratio, of rank 2 in letters F0, F1, ..., F0~, ... for the functions, and what these letters stand for."""
        if self.lift.rank == 1:
            return RationalFunction(self.functions[self.numerator[0]], self.functions[self.denominator[0]]), []
        taken = self.functions[0].context().names()
        letters = (c * k for k in count(1) for c in "FGKUVW")
        letter = next(c for c in letters if not any(name.startswith(c) for name in taken))
        names = [f"{letter}{k}" for k in range(len(self.functions))]
        gens = ring([*names, *(f"{name}~" for name in names)]).gens()
        here, later = gens[: len(names)], gens[len(names) :]
        P, Q = (here[a] * later[b] - here[b] * later[a] for a, b in (self.numerator, self.denominator))
        used = sorted({*self.numerator, *self.denominator})
        return RationalFunction(P, Q), [(names[k], self.functions[k]) for k in used]

    @property
    def text(self) -> str:
        """The formula; x~ is the image of x, x~~ that of x~."""
        ratio, letters = self.formula
        return ", ".join([format_rational_function(ratio), *(f"{F} = {format_polynomial(P)}" for F, P in letters)])

    @property
    def latex(self) -> str:
        """The formula as LaTeX."""
        ratio, letters = self.formula
        return r",\quad ".join([latex(ratio), *(f"{latex(ring([F]).gens()[0])} = {latex(P)}" for F, P in letters)])

    def sides(self, field: Field, points: Sequence[tuple[Any, ...]], values: Sequence[Any]) -> tuple[Any, Any]:
        """Numerator and denominator on successive points of an orbit, at the values of the symbols and eps."""
        rows = [
            [evaluate(F, field, (*here, *there, *values)) for F in self.functions]
            for here, there in zip(points, points[self.lift.shift :], strict=False)
        ]

        def minor(places: tuple[int, ...]) -> Any:
            if len(places) == 1:
                return rows[0][places[0]]
            a, b = places
            return rows[0][a] * rows[1][b] - rows[0][b] * rows[1][a]

        return minor(self.numerator), minor(self.denominator)


@dataclass(frozen=True)
class IntegralInIterates:
    """An integral in the iterates of a point, with the verdict on its being conserved."""

    name: str
    ratio: RatioOfIterates
    origin: str
    verdict: Certainty
    evidence: Evidence

    @property
    def text(self) -> str:
        """The formula."""
        return self.ratio.text

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            **attributes(self, "name", integral="text"),
            "latex": self.ratio.latex,
            **attributes(self, "origin", "verdict", "evidence"),
        }


def verdict_on_ratio(
    laboratory: Laboratory, ratio: RatioOfIterates, too_long: set[int] | None = None
) -> tuple[Certainty, Evidence]:
    """Whether I has the same value a step later, as an identity for the map of the laboratory.

    `too_long` collects the lengths of orbits that cannot be multiplied out; no ratio of such a length or more is tried.
    """
    map_, eps = laboratory.map, laboratory.eps
    n, hopeless = map_.dim, too_long if too_long is not None else set[int]()

    def sides(field: Field, place: tuple[Any, ...], step: Any) -> Sides | None:
        values = (*place[n:], step)
        try:
            points = orbit_about(map_.at(step, field, place[n:]), place[:n], ratio.length)
        except BudgetExceeded:
            hopeless.add(ratio.length)
            raise
        pairs = [ratio.sides(field, points[k:], values) for k in (0, 1)]
        (P, Q), (P_later, Q_later) = pairs
        if field.is_zero(Q) or field.is_zero(Q_later):
            return None
        return [P_later * Q], [P * Q_later]

    where = [*(["every eps"] if map_.has_eps and eps is None else []), *([f"eps = {eps}"] if eps is not None else [])]
    scope = " and ".join([*where, *([f"every {', '.join(map_.symbols)}"] if map_.symbols else [])])
    subject = (map_.symbols, map_.subject, ratio.text, ratio.numerator, ratio.denominator)
    identity = Identity(
        n + len(map_.symbols),
        sides,
        eps,
        scope=f"for {scope}" if scope else "",
        has_eps=map_.has_eps,
        subject=subject,
    )
    return certified(
        identity, laboratory.seed, expands=n <= MAX_DIMENSION and all(ratio.length < length for length in hopeless)
    )


def integrals_in_iterates(
    laboratory: Laboratory,
    wanted: int,
    known: Independent,
    budget: Budget,
    progress: Callable[[str], None] = lambda _: None,
) -> tuple[list[tuple[RationalFunction, str, str]], list[tuple[RatioOfIterates, str]], str]:
    """Integrals that do not depend on known ones: those in x alone, and those in iterates, each with its origin.

    Args:
        laboratory: the map.
        wanted: how many independent ones there are to be, with the known ones.
        known: the known ones, on the first map of the laboratory.
        budget: nothing is begun when it is spent.
        progress: is told what is being tried.

    Returns:
        Formulas that are to be put to the proof, those in x with an empty text for their factors; and what was not
        tried for lack of budget. Raises NoPoint.

    Source: petrera-suris-2018.
    """
    known = copy(known)
    known.rows = list(known.rows)  # nothing is added to what was given
    plain, ratios = list[tuple[RationalFunction, str, str]](), list[tuple[RatioOfIterates, str]]()
    level = _level(laboratory)
    inside, back = (laboratory, None) if level is None else level
    base = inside.maps[0]
    cut = ""
    for lift in TWO_POINT_BASES if level is not None else TWO_POINT_BASES[1:]:
        if len(known.rows) >= wanted:
            break
        if budget.is_spent:
            cut = f"{lift.text} were not tried: {SPENT}"
            break
        for one, spaces in bases_with_spaces(base, [lift]):
            progress(one.text)
            found = SpaceSearch()
            found.add(SearchStep("iterates", 2, None, one.text, one), sorted(spaces, key=lambda space: space.pattern))
            bases, _ = bases_of(inside, base.prime, found, budget)
            for basis in bases:
                functions = [_lettered(P, one, inside.map) for P in basis]
                functions = functions if back is None else [back(F, one.shift) for F in functions]
                # The ratios that generate all others.
                candidates = [RatioOfIterates(one, (F, functions[0]), (0,), (1,)) for F in functions[1:]]
                if one.rank == 2:
                    pairs = [(first, k) for k in range(2, len(functions)) for first in (0, 1)]
                    candidates = [RatioOfIterates(one, tuple(functions), pair, (0, 1)) for pair in pairs]
                for ratio in candidates:
                    if not known.add(gradient_of(ratio, laboratory.map, laboratory.maps[0], known.point)):
                        continue
                    if lift.shift:
                        ratios.append((ratio, one.text))
                    else:  # no iterate is in it: a function of (variables, symbols, eps)
                        context = ring(laboratory.map.names)
                        gens, n = context.gens(), laboratory.map.dim
                        P, Q = (F.compose(*gens[:n], *gens, ctx=context) for F in ratio.functions)
                        plain.append((RationalFunction(P, Q), one.text, ""))
    return plain, ratios, cut


def _letters(map_: MapFamily, shift: int) -> tuple[str, ...]:
    """The names that formulas are in: variables, those of the iterate, symbols, eps."""
    names = map_.variables
    return (*names, *(name + "~" * max(shift, 1) for name in names), *map_.names[len(names) :])


def _lettered(P: fmpq_mpoly, lift: TwoPointBasis, map_: MapFamily) -> fmpq_mpoly:
    """The function of x and its iterate that a polynomial of degree 2 in (variables, symbols, eps) stands for."""
    n, context = map_.dim, ring(_letters(map_, lift.shift))
    one, gens = context.constant(1), context.gens()
    X, Y = (one, *gens[:n]), (one, *gens[n * min(lift.shift, 1) :][:n])
    places = dict(zip(exponents_up_to(n, TWO_POINT_DEGREE), pairs_of(n), strict=True))
    total = context.constant(0)
    for monomial, coefficient in P.terms():
        exponents = tuple(map(int, monomial))
        i, j = places[exponents[:n]]
        rest = context.from_dict({(0,) * (2 * n) + exponents[n:]: coefficient})
        total = total + rest * (X[i] * Y[j] + lift.sign * X[j] * Y[i])
    return primitive_part(total)[1]


def _level(laboratory: Laboratory) -> tuple[Laboratory, Callable[[fmpq_mpoly, int], fmpq_mpoly]] | None:
    """The map on levels of its affine integrals, the values of which are symbols; and what puts v.x in their place."""
    system, n = laboratory.system, laboratory.map.dim
    integrals = affine_integrals(system) if system is not None else ()
    quotient = quotient_by(integrals, n)
    if system is None or not integrals or len(quotient.free) < 2:
        return None
    used, levels = {*laboratory.map.names, *laboratory.file.parameters}, list[str]()
    for k in count(1):
        if len(levels) == len(integrals):
            break
        levels += [f"c{k}"] if f"c{k}" not in used else []
    free = [laboratory.map.variables[k] for k in quotient.free]
    context = ring((*free, *laboratory.symbols, *levels))
    gens = context.gens()
    forms = fmpq_mat([[*a, *b] for a, b in zip(quotient.section.tolist(), quotient.shift.tolist(), strict=True)])
    x = linear_combinations(forms, [*gens[: len(free)], *gens[len(gens) - len(levels) :]])
    symbols = gens[len(free) : len(free) + len(laboratory.symbols)]
    rhs = [format_polynomial(system.rhs[k].compose(*x, *symbols, ctx=context)) for k in quotient.free]
    values = {name: format_number(laboratory.file.parameters[name]) for name in laboratory.symbols}
    document = {
        "name": laboratory.file.name,
        "variables": free,
        "parameters": {**values, **dict.fromkeys(levels, "1")},
        "system": {"rhs": rhs},
    }
    file = SystemFile(**DocumentReader(document, laboratory.file.name, {}).read())
    inside = Laboratory(file, (*laboratory.symbols, *levels), laboratory.eps, laboratory.seed)

    def back(F: fmpq_mpoly, shift: int) -> fmpq_mpoly:
        whole = ring(_letters(laboratory.map, shift))
        *letters, eps = whole.gens()
        here, there, rest = letters[:n], letters[n : 2 * n], letters[2 * n :]
        sums = [sum((a * g for a, g in zip(v, here, strict=True)), whole.constant(0)) for v in integrals]
        kept = [[side[k] for k in quotient.free] for side in (here, there)]
        return F.compose(*kept[0], *kept[1], *rest, *sums, eps, ctx=whole)

    return inside, back


def gradient_of(ratio: RatioOfIterates, exact: MapFamily, map_: ModularMap, point: Point) -> list[int]:
    """A multiple of the gradient with respect to the first point, on a map modulo a prime."""
    field = DualField(GF(map_.prime))
    values = [field.convert(value) for value in map_.values]
    eps = field.convert(map_.eps)
    over = exact.at(eps, field, values)
    row = []
    for k in range(map_.dim):
        points = [tuple(field.dual(c, int(i == k)) for i, c in enumerate(point))]
        while len(points) < ratio.length:
            points.append(over.step(points[-1]))
        P, Q = ratio.sides(field, points, (*values, eps))
        row.append(int(P.slope * Q.value - P.value * Q.slope))
    return row
