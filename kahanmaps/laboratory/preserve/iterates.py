"""Integrals whose formulas contain iterates x~, x~~, ...: coefficients of bilinear relations along orbits.

Let x^(k) be the k-th iterate of x. The search looks, modulo a prime, for functions F_0, F_1, ... that are bilinear in
(1, x) and (1, x^(k)), and whose vectors (F_0, F_1, ...) along every orbit span a line or a plane (darboux_spaces.py).
It interpolates these functions. For a line the ratios F_a/F_b are integrals, for a plane the ratios of 2 x 2 minors. It
verifies that such a ratio I has the same value one step later. For k = 1 this identity is written I(x, x~) = I(x_, x),
where x_ is the preimage of x: a step forward and a step backward have shorter formulas than two steps forward.

If there are affine integrals v.x, the search runs on their level sets v.x = c, which have fewer coordinates, so that
relations of a lower degree suffice. The values c are symbols of this search; in the results v.x replaces c. Source:
petrera-suris-2018.
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
from kahanmaps.display_protocols import LatexDisplay, ResultPart, latex
from kahanmaps.documents.document import DocumentReader
from kahanmaps.documents.files import SystemFile
from kahanmaps.invariants.integrals_and_densities import normalized, orbit_about
from kahanmaps.laboratory.laboratory import Laboratory, certified
from kahanmaps.laboratory.modular_points import IndependentGradients, ModularMap, Point, exponents_up_to
from kahanmaps.laboratory.preserve.darboux.affine_functions import affine_integrals, quotient_by
from kahanmaps.laboratory.preserve.darboux.cofactors import SearchStep, SpaceSearch
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import (
    TWO_POINT_BASES,
    TWO_POINT_DEGREE,
    TwoPointBasis,
    bases_with_spaces,
    pairs_of,
)
from kahanmaps.laboratory.preserve.search import interpolate_bases
from kahanmaps.maps.implicit import MapFamily


@dataclass(frozen=True)
class RatioOfIterates:
    """A function I of an orbit segment: the ratio of two `functions` or, for rank 2, of two minors of them.

    The functions F_a are polynomials in (variables, variables of the k-th iterate, symbols, eps); F_a~ is F_a one step
    later. `numerator` and `denominator` are tuples of indices: (a,) stands for F_a, (a, b) for F_a F_b~ - F_b F_a~.
    """

    two_point_basis: TwoPointBasis
    functions: tuple[fmpq_mpoly, ...]
    numerator: tuple[int, ...]
    denominator: tuple[int, ...]

    @property
    def length(self) -> int:
        """The number of successive points of an orbit on which I depends."""
        return self.two_point_basis.shift + self.two_point_basis.rank

    def with_limit(self, count: int) -> RatioOfIterates:
        """Normalize I if it tends to a constant as eps -> 0; the first `count` variables of F_a are coordinates."""
        if self.two_point_basis.rank > 1:
            return self
        result = normalized(self.formula[0], count)
        functions = result.function.numerator, result.function.denominator
        return RatioOfIterates(self.two_point_basis, functions, (0,), (1,)) if result.is_shifted else self

    @property
    def formula(self) -> tuple[RationalFunction, list[tuple[str, fmpq_mpoly]]]:
        """The ratio and, for rank 2, pairs (name, function) for the names F0, F1, ... of functions in the ratio."""
        if self.two_point_basis.rank == 1:
            return RationalFunction(self.functions[self.numerator[0]], self.functions[self.denominator[0]]), []
        names_in_use = self.functions[0].context().names()
        letters = (c * k for k in count(1) for c in "FGKUVW")
        letter = next(c for c in letters if not any(name.startswith(c) for name in names_in_use))
        names = [f"{letter}{k}" for k in range(len(self.functions))]
        gens = ring([*names, *(f"{name}~" for name in names)]).gens()
        F, F_next = gens[: len(names)], gens[len(names) :]
        P, Q = (F[a] * F_next[b] - F[b] * F_next[a] for a, b in (self.numerator, self.denominator))
        indices = sorted({*self.numerator, *self.denominator})
        return RationalFunction(P, Q), [(names[k], self.functions[k]) for k in indices]

    @property
    def text(self) -> str:
        """The formula; x~ is the image of x, and x~~ is the image of x~."""
        ratio, definitions = self.formula
        return ", ".join([format_rational_function(ratio), *(f"{F} = {format_polynomial(P)}" for F, P in definitions)])

    @property
    def latex(self) -> str:
        """The formula as LaTeX."""
        ratio, definitions = self.formula
        return r",\quad ".join([latex(ratio), *(f"{latex(ring([F]).gens()[0])} = {latex(P)}" for F, P in definitions)])

    def numerator_and_denominator(
        self, field: Field, points: Sequence[tuple[Any, ...]], values: Sequence[Any]
    ) -> tuple[Any, Any]:
        """Return numerator and denominator of I at successive orbit points, for `values` of the symbols and eps."""
        rows = [
            [evaluate(F, field, (*x, *iterate, *values)) for F in self.functions]
            for x, iterate in zip(points, points[self.two_point_basis.shift :], strict=False)
        ]

        def minor(indices: tuple[int, ...]) -> Any:
            if len(indices) == 1:
                return rows[0][indices[0]]
            a, b = indices
            return rows[0][a] * rows[1][b] - rows[0][b] * rows[1][a]

        return minor(self.numerator), minor(self.denominator)


@dataclass(frozen=True)
class IntegralInIterates(LatexDisplay, ResultPart):
    """An integral whose formula contains iterates of x, with the verdict on its conservation."""

    name: str
    ratio: RatioOfIterates
    origin: str
    verdict: Certainty
    evidence: Evidence

    @property
    def text(self) -> str:
        """The formula."""
        return self.ratio.text

    def latex(self) -> str:
        """Return the formula as LaTeX."""
        return self.ratio.latex

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
    """Decide whether the ratio has the same value one step later, as an identity for the map of the laboratory.

    `too_long` collects the lengths of ratios whose identity was too long; at these and larger lengths none is expanded.
    """
    map_, eps = laboratory.map, laboratory.eps
    n, too_long = map_.dim, too_long if too_long is not None else set[int]()

    def sides(field: Field, point: tuple[Any, ...], eps_value: Any) -> Sides | None:
        values = (*point[n:], eps_value)
        try:
            points = orbit_about(map_.at(eps_value, field, point[n:]), point[:n], ratio.length)
        except BudgetExceeded:
            too_long.add(ratio.length)
            raise
        pairs = [ratio.numerator_and_denominator(field, points[k:], values) for k in (0, 1)]
        (P, Q), (P_image, Q_image) = pairs
        if field.is_zero(Q) or field.is_zero(Q_image):
            return None
        return [P_image * Q], [P * Q_image]

    scopes = [*(["every eps"] if map_.has_eps and eps is None else []), *([f"eps = {eps}"] if eps is not None else [])]
    scope = " and ".join([*scopes, *([f"every {', '.join(map_.symbols)}"] if map_.symbols else [])])
    identity_key = (map_.symbols, map_.seed_data, ratio.text, ratio.numerator, ratio.denominator)
    identity = Identity(
        n + len(map_.symbols),
        sides,
        eps,
        scope=f"for {scope}" if scope else "",
        has_eps=map_.has_eps,
        seed_data=identity_key,
    )
    return certified(
        identity, laboratory.seed, expands=n <= MAX_DIMENSION and all(ratio.length < length for length in too_long)
    )


def integrals_in_iterates(
    laboratory: Laboratory,
    required: int,
    independent: IndependentGradients,
    budget: Budget,
    progress: Callable[[str], None] = lambda _: None,
) -> tuple[list[tuple[RationalFunction, str, str]], list[tuple[RatioOfIterates, str]], str]:
    """Search for integrals, in x alone and in iterates, that are independent of the known integrals.

    Args:
        laboratory: the map.
        required: the number of independent integrals at which the search stops, known ones included.
        independent: the gradients of the known integrals, on the first map of the laboratory.
        budget: no further basis is tried after the budget is spent.
        progress: called with the text of each basis in which spaces were found.

    Returns:
        A list of (formula in x, origin, "" for no factored form), a list of (ratio in iterates, origin), none verified
        yet; and a sentence on what was skipped because the work limit was reached, else "". Raises NoPoint.

    Source: petrera-suris-2018.
    """
    independent = copy(independent)
    independent.rows = list(independent.rows)  # the argument `independent` must not change
    integrals_in_x, ratios = list[tuple[RationalFunction, str, str]](), list[tuple[RatioOfIterates, str]]()
    restriction = _restrict_map(laboratory)
    level_laboratory, replace_levels = (laboratory, None) if restriction is None else restriction
    modular_map = level_laboratory.maps[0]
    omission_text = ""
    for two_point_basis in TWO_POINT_BASES if restriction is not None else TWO_POINT_BASES[1:]:
        if len(independent.rows) >= required:
            break
        if budget.is_spent:
            omission_text = f"{two_point_basis.text} were not tried: {SPENT}"
            break
        for basis_with_rank, spaces in bases_with_spaces(modular_map, [two_point_basis]):
            progress(basis_with_rank.text)
            result = SpaceSearch()
            step = SearchStep("iterates", 2, None, basis_with_rank.text, basis_with_rank)
            result.add(step, sorted(spaces, key=lambda space: space.pattern))
            bases, _ = interpolate_bases(level_laboratory, modular_map.prime, result, budget)
            for basis in bases:
                functions = [_bilinear_function(P, basis_with_rank, level_laboratory.map) for P in basis]
                if replace_levels is not None:
                    functions = [replace_levels(F, basis_with_rank.shift) for F in functions]
                # These ratios generate all ratios of functions or, for rank 2, of minors.
                candidates = [RatioOfIterates(basis_with_rank, (F, functions[0]), (0,), (1,)) for F in functions[1:]]
                if basis_with_rank.rank == 2:
                    pairs = [(index, k) for k in range(2, len(functions)) for index in (0, 1)]
                    candidates = [RatioOfIterates(basis_with_rank, tuple(functions), pair, (0, 1)) for pair in pairs]
                for ratio in candidates:
                    if not independent.add(gradient_of(ratio, laboratory.map, laboratory.maps[0], independent.point)):
                        continue
                    if two_point_basis.shift:
                        ratios.append((ratio, basis_with_rank.text))
                    else:  # the ratio contains no iterate: make it a function of (variables, symbols, eps)
                        context = ring(laboratory.map.names)
                        gens, n = context.gens(), laboratory.map.dim
                        P, Q = (F.compose(*gens[:n], *gens, ctx=context) for F in ratio.functions)
                        integrals_in_x.append((RationalFunction(P, Q), basis_with_rank.text, ""))
    return integrals_in_x, ratios, omission_text


def _names_in_formulas(map_: MapFamily, shift: int) -> tuple[str, ...]:
    """Return the names in formulas: variables, variables of the `shift`-th iterate, symbols, eps."""
    names = map_.variables
    return (*names, *(name + "~" * max(shift, 1) for name in names), *map_.names[len(names) :])


def _bilinear_function(P: fmpq_mpoly, two_point_basis: TwoPointBasis, map_: MapFamily) -> fmpq_mpoly:
    """Return the bilinear function of x and its iterate that a polynomial of degree 2 encodes (`TwoPointBasis`)."""
    n, context = map_.dim, ring(_names_in_formulas(map_, two_point_basis.shift))
    one, gens = context.constant(1), context.gens()
    X, Y = (one, *gens[:n]), (one, *gens[n * min(two_point_basis.shift, 1) :][:n])
    pairs = dict(zip(exponents_up_to(n, TWO_POINT_DEGREE), pairs_of(n), strict=True))
    bilinear = context.constant(0)
    for monomial, coefficient in P.terms():
        exponents = tuple(map(int, monomial))
        i, j = pairs[exponents[:n]]
        scalar = context.from_dict({(0,) * (2 * n) + exponents[n:]: coefficient})
        bilinear = bilinear + scalar * (X[i] * Y[j] + two_point_basis.sign * X[j] * Y[i])
    return primitive_part(bilinear)[1]


def _restrict_map(laboratory: Laboratory) -> tuple[Laboratory, Callable[[fmpq_mpoly, int], fmpq_mpoly]] | None:
    """Restrict the map to level sets of its affine integrals; the values of these integrals become symbols.

    Returns the laboratory of the restricted map and the function that replaces these symbols by v.x in a result, or
    None if there are no affine integrals or fewer than two coordinates remain.
    """
    system, n = laboratory.system, laboratory.map.dim
    integrals = affine_integrals(system) if system is not None else ()
    quotient = quotient_by(integrals, n)
    if system is None or not integrals or len(quotient.free) < 2:
        return None
    names_in_use, level_names = {*laboratory.map.names, *laboratory.file.parameters}, list[str]()
    for k in count(1):
        if len(level_names) == len(integrals):
            break
        level_names += [f"c{k}"] if f"c{k}" not in names_in_use else []
    free_names = [laboratory.map.variables[k] for k in quotient.free]
    context = ring((*free_names, *laboratory.symbols, *level_names))
    gens = context.gens()
    forms = fmpq_mat([[*a, *b] for a, b in zip(quotient.section.tolist(), quotient.shift.tolist(), strict=True)])
    x = linear_combinations(forms, [*gens[: len(free_names)], *gens[len(gens) - len(level_names) :]])
    symbols = gens[len(free_names) : len(free_names) + len(laboratory.symbols)]
    rhs = [format_polynomial(system.rhs[k].compose(*x, *symbols, ctx=context)) for k in quotient.free]
    values = {name: format_number(laboratory.file.parameters[name]) for name in laboratory.symbols}
    document = {
        "name": laboratory.file.name,
        "variables": free_names,
        "parameters": {**values, **dict.fromkeys(level_names, "1")},
        "system": {"rhs": rhs},
    }
    file = SystemFile(**DocumentReader(document, laboratory.file.name, {}).read())
    restricted_laboratory = Laboratory(file, (*laboratory.symbols, *level_names), laboratory.eps, laboratory.seed)

    def replace_levels(F: fmpq_mpoly, shift: int) -> fmpq_mpoly:
        context = ring(_names_in_formulas(laboratory.map, shift))
        *generators, eps = context.gens()
        x, iterate, symbols = generators[:n], generators[n : 2 * n], generators[2 * n :]
        level_values = [sum((a * g for a, g in zip(v, x, strict=True)), context.constant(0)) for v in integrals]
        free_x, free_iterate = ([side[k] for k in quotient.free] for side in (x, iterate))
        return F.compose(*free_x, *free_iterate, *symbols, *level_values, eps, ctx=context)

    return restricted_laboratory, replace_levels


def gradient_of(ratio: RatioOfIterates, exact_map: MapFamily, map_: ModularMap, point: Point) -> list[int]:
    """Return, modulo the prime of `map_`, a multiple of the gradient of the ratio with respect to its first point x."""
    field = DualField(GF(map_.prime))
    values = [field.convert(value) for value in map_.values]
    eps = field.convert(map_.eps)
    map_over_duals = exact_map.at(eps, field, values)
    gradient = []
    for k in range(map_.dim):
        points = [tuple(field.dual(c, int(i == k)) for i, c in enumerate(point))]
        while len(points) < ratio.length:
            points.append(map_over_duals.step(points[-1]))
        P, Q = ratio.numerator_and_denominator(field, points, (*values, eps))
        gradient.append(int(P.slope * Q.value - P.value * Q.slope))
    return gradient
