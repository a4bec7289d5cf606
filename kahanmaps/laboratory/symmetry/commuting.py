"""Search for quadratic systems g of a given shape whose Kahan maps commute with that of a given f, for every eps.

The search has three stages. First, [f, g] = f' g - g' f = 0 gives a linear space of candidates g. Second, the next
terms in eps of Phi_f o Phi_g - Phi_g o Phi_f must vanish, where Phi_f and Phi_g are the Kahan maps: these are
polynomial equations on the space, solved over Q. Both conditions are necessary, so no solution is discarded. Third,
that Phi_f and Phi_g commute is certified for every solution g: it is proved, or supported at random points.

A quadratic system f in n variables over a number field K of degree m is also a quadratic system in n m variables over
Q, with the same Kahan map (docs/beyond.md). So all g over K are among the rational solutions for the larger system.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from flint import fmpq, fmpq_mat

from kahanmaps.algebra.chance import derive_seed
from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.matrices import combination_of, primitive_integers
from kahanmaps.algebra.polynomials import ring
from kahanmaps.algebra.printing import attributes, format_polynomial, plain
from kahanmaps.algebra.small_systems import (
    SolutionComponent,
    decoupling,
    maximal_components,
    normal_form,
    solve_system,
)
from kahanmaps.algebra.work import SPENT, UNFINISHED, Budget
from kahanmaps.checks.claims import Certainty, Finding, combined
from kahanmaps.checks.decide import DEFAULT_ERROR_BITS
from kahanmaps.checks.settings import Settings
from kahanmaps.display_protocols import PrintableResult, ResultPart
from kahanmaps.errors import InputError, counted
from kahanmaps.family.tensor import GENERATOR, over_algebra
from kahanmaps.laboratory.defaults import budget_for
from kahanmaps.laboratory.symmetry.commuting_proofs import certify_family, certify_field, proof_by_affine_lemma
from kahanmaps.laboratory.symmetry.commuting_space import (
    MAX_UNKNOWNS,
    SHAPES,
    CommutingSpace,
    commutator_equations,
    commuting_space,
    field_at,
    unknowns,
)
from kahanmaps.maps.algebraic import AlgebraicMap
from kahanmaps.maps.kahan import KahanFamily, SystemLike, as_map
from kahanmaps.systems.quadratic import LONG_COEFFICIENTS, QuadraticSystem, as_system

ORDERS = (4, 6, 8)  # powers of eps in the commutator; equations at an odd power follow from those at lower powers
MAX_MESSAGES = 6  # messages on equations that were not solved
# By default the shape "quadratic" is tried first. The work limit of this attempt does not depend on the effort, so that
# all commands choose the same shape; usually a few hundredths of the limit suffice.
QUICK_DIMENSION, QUICK_UNITS = 3, 1e6
MAX_SPACE = 24  # dimension l of the space of candidates: the cubic equations have up to C(l + 2, 3) + l terms


@dataclass(frozen=True)
class CommutingField(ResultPart):
    """A `system` g whose Kahan map commutes with that of f; `finding` has the verdict on this.

    `B` is the matrix with g = B f (None for the shape "quadratic"). `trivial` is "0", "f" or "-f" for these g, else "".
    """

    system: QuadraticSystem
    B: fmpq_mat | None
    trivial: str
    finding: Finding

    @property
    def rhs(self) -> list[str]:
        """The right-hand sides as text that can be parsed again."""
        return [format_polynomial(p) for p in self.system.rhs]

    def to_json(self) -> dict[str, Any]:
        """Plain data: rhs, B, trivial, verdict and evidence."""
        return {
            **attributes(self, "rhs", "B"),
            "trivial": self.trivial or None,
            **attributes(self.finding, "verdict", "evidence"),
        }


@dataclass(frozen=True)
class CommutingFamily(ResultPart):
    """A linear family: g = `base` + sum t_i `directions[i]` is a solution for all values of the parameters t_i."""

    base: CommutingField
    directions: tuple[CommutingField, ...]
    finding: Finding

    @property
    def text(self) -> str:
        """The formula of g with the parameters t1, t2, ..."""
        terms = [self.base, *self.directions]
        texts = [f"{f't{k}*' if k else ''}({', '.join(g.rhs)})" for k, g in enumerate(terms)]
        return " + ".join(texts)

    def to_json(self) -> dict[str, Any]:
        """Plain data: base, directions (rhs and B), verdict and evidence."""
        return {
            "parameters": len(self.directions),
            "base": attributes(self.base, "rhs", "B"),
            "directions": [attributes(direction, "rhs", "B") for direction in self.directions],
            **attributes(self.finding, "verdict", "evidence"),
        }


@dataclass
class CommutingSystems(PrintableResult):
    """The quadratic g whose Kahan maps commute with that of f; if `complete`, there are no others of this shape.

    `basis` and `dimension` describe the space of all g of this shape with [f, g] = 0. `irrational` describes solutions
    that are not rational; `discarded` counts solutions of the equations whose maps do not commute. `every_g_commutes`
    is True if f = 0 and the shape is "quadratic"; then only g = 0 is listed. `undecided` lists the open questions.
    """

    _parts, _noun = "nontrivial", ("commuting system", "commuting systems")

    system: QuadraticSystem
    shape: str
    dimension: int | None = None
    basis: list[QuadraticSystem] = field(default_factory=list)
    solutions: list[CommutingField] = field(default_factory=list)
    families: list[CommutingFamily] = field(default_factory=list)
    irrational: list[str] = field(default_factory=list)
    every_g_commutes: bool = False
    discarded: int = 0
    order: int = 2  # the highest power of eps whose equations were used
    undecided: list[str] = field(default_factory=list)
    root: str = ""  # the algebraic number in f, if there is one
    note: str = ""  # on the quadratic shape, if it was tried first and given up

    @property
    def complete(self) -> bool:
        """Whether all rational solutions g of this shape were found."""
        return not self.undecided

    @property
    def kind_text(self) -> str:
        """A phrase for the set of fields g that was searched."""
        field_text = f" over the number field of a {self.root}" if self.root else ""
        if self.shape == "linear":
            return f"fields g = B f (B a constant {'matrix' if field_text else 'rational matrix'}{field_text})"
        return f"fields g of degree at most 2{field_text or ' with rational coefficients'}"

    @property
    def nontrivial(self) -> list[CommutingField]:
        """The isolated solutions other than 0, f and -f."""
        return [g for g in self.solutions if not g.trivial]

    @property
    def verdict(self) -> Certainty:
        """The weakest verdict on the solutions; undecided if the list may not be complete."""
        verdicts = [g.finding.verdict for g in self.solutions] + [family.finding.verdict for family in self.families]
        return combined([*verdicts, *([] if self.complete else [Certainty.UNDECIDED])])

    def rows(self) -> list[dict[str, str]]:
        """Return a row for each g other than 0, f and -f, for example for `pandas.DataFrame(result.rows())`."""
        return [{"g": ", ".join(g.rhs), "verdict": str(g.finding.verdict)} for g in self.nontrivial]

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            **attributes(self, "shape"),
            "status": "complete" if self.complete else "undecided",
            **attributes(self, "verdict"),
            "bracket_space": {"dimension": self.dimension, "basis": plain([g.rhs for g in self.basis])},
            **attributes(self, "solutions", "families", "every_g_commutes"),
            **attributes(self, "irrational", "discarded", "order", "undecided"),
        }


def commuting_systems(
    system: SystemLike,
    shape: str | None = None,
    *,
    seed: int = 0,
    error_bits: int = DEFAULT_ERROR_BITS,
    effort: int | Budget = 1,
    progress: Callable[[str], None] = lambda _: None,
    on_result: Callable[[CommutingSystems], None] = lambda _: None,
    C: fmpq_mat | None = None,
) -> CommutingSystems:
    """Find all rational quadratic g whose Kahan map commutes with that of f = `system` at the same eps, for every eps.

    The candidates g are exact. That the maps commute is proved by a lemma, or else supported at random points.

    Args:
        system: f, a quadratic system over Q.
        shape: "linear" for g = B f with a constant matrix B; "quadratic" for any g of degree at most 2; None for
            "quadratic" if the dimension is at most 3 and a short search finds all g, otherwise for "linear".
        seed: the random seed.
        error_bits: a supported solution is wrong with a probability below 2^-error_bits.
        effort: each increase by 1 doubles the work limit.
        progress: called with a message at each stage.
        on_result: called with the solutions so far after each new solution, for searches that may be interrupted.
        C: a matrix with C f' = f' C; only g with C g' = g' C are searched.

    Returns:
        The solutions; `undecided` reports everything that is too large to be searched.

    Raises:
        InputError: for an unknown shape, or an `error_bits` that is not positive.

    Source: petrera-suris-2016.

    >>> f = QuadraticSystem.from_text(["x", "y"], ["x^2 + 1", "y^2 - x*y"])
    >>> [(g.trivial, str(g.finding.verdict)) for g in commuting_systems(f).solutions]
    [('0', 'proved'), ('f', 'proved'), ('-f', 'proved')]
    """
    system, budget = as_system(system), budget_for("commuting systems", effort)
    if shape is None:
        note = ""
        options: dict[str, Any] = {"seed": seed, "error_bits": error_bits, "progress": progress, "on_result": on_result}
        if system.dim <= QUICK_DIMENSION and not budget.is_spent:
            result = commuting_systems(system, "quadratic", **options, effort=Budget(QUICK_UNITS))
            if result.complete:
                return result
            note = (
                f"the {result.kind_text} were tried first, and a short search did not find all; try --shape quadratic"
            )
        return replace(commuting_systems(system, "linear", **options, effort=budget, C=C), note=note)
    if shape not in SHAPES:
        raise InputError(f"found the shape {shape!r}, expected {' or '.join(SHAPES)}")
    settings = Settings(seed=derive_seed(seed, system.rhs), error_bits=error_bits, progress=progress)
    search = _Search(system, settings, budget, C, CommutingSystems(system, shape), on_result)
    search.run()
    return search.result


@dataclass
class _Search:
    """A search in the `space` of g with [f, g] = 0; `points` and linear `families` are the solutions so far."""

    f: QuadraticSystem
    settings: Settings
    budget: Budget
    C: fmpq_mat | None
    result: CommutingSystems
    on_result: Callable[[CommutingSystems], None]
    space: CommutingSpace = field(default_factory=lambda: CommutingSpace((), (), 0))
    points: list[SolutionComponent] = field(default_factory=list)
    families: list[SolutionComponent] = field(default_factory=list)

    def run(self) -> None:
        f, result = self.f, self.result
        count = unknowns(f, result.shape)
        if all(p.is_zero() for p in f.rhs):
            result.dimension = count
            matrix = fmpq_mat(f.dim, f.dim) if result.shape == "linear" else None
            result.solutions.append(CommutingField(f, matrix, "0", certify_field(f, f, self.settings)))
            result.every_g_commutes = result.shape == "quadratic"
            return
        if count > MAX_UNKNOWNS:
            result.undecided.append(f"g has {count} unknown coefficients, and at most {MAX_UNKNOWNS} are tried")
        elif f.digits > LONG_COEFFICIENTS:
            result.undecided.append(f"other g are searched for coefficients of up to {LONG_COEFFICIENTS} digits only")
        if result.undecided:
            self.space = CommutingSpace((f,), (QQ.identity(f.dim),) * (result.shape == "linear"), 1)
        else:
            self.settings.progress("the fields g with [f, g] = 0")
            self.space = commuting_space(f, result.shape, self.settings.seed, self.C)
            result.basis = list(self.space.fields)
            result.dimension = len(result.basis) if len(result.basis) == self.space.dimension else None
            dimension = self.space.dimension
            all_fields = SolutionComponent(tuple(ring([f"b{k + 1}" for k in range(len(self.space.fields))]).gens()))
            # For affine f the space may be large, but the lemma of affine maps often proves that each g is a solution.
            if (
                result.dimension is not None
                and f.degree <= 1
                and proof_by_affine_lemma(f, self.space.fields) is not None
            ):
                self._add_family(all_fields, certify_family(f, self.space, all_fields, self.settings))
            elif dimension > MAX_SPACE:
                result.undecided.append(
                    f"the fields g with [f, g] = 0 have dimension {'up to ' * (result.dimension is None)}{dimension}, "
                    f"and equations are solved up to {MAX_SPACE}"
                )
            else:
                self._solve(all_fields, 0)
        zeros = [fmpq(0)] * (len(self.space.fields) - 1)
        trivial_points = [(fmpq(f_weight), *zeros) for f_weight in (0, 1, -1)]
        isolated_points = [c.point for c in maximal_components([*self.families, *self.points]) if not c.free]
        # Each -g directly follows g in the list.
        signs = {p: 1 if next(w for w in p if w != 0) > 0 else -1 for p in isolated_points if p not in trivial_points}
        sorted_points = sorted(signs, key=lambda p: (*map(abs, p), *(w * signs[p] for w in p), signs[p] < 0))
        for k, weights in enumerate([*trivial_points, *sorted_points]):
            if self.budget.is_spent and weights not in trivial_points:
                result.undecided.append(f"{counted(len(sorted_points) + 3 - k, 'solution')} not certified: {SPENT}")
                return
            self.settings.progress(f"solution {k + 1} of {len(sorted_points) + 3}")
            finding = certify_field(f, field_at(self.space, weights), self.settings)
            if finding.verdict is Certainty.REFUTED:
                result.discarded += 1
            elif finding.verdict is Certainty.UNDECIDED:
                result.undecided.append(f"one solution: {finding.evidence.summary}")
            else:
                result.solutions.append(self._build_field(weights, finding))
                self._report()

    def _report(self) -> None:
        """Call `on_result` with a copy of the solutions so far."""
        result = self.result
        copied_lists: dict[str, Any] = {"solutions": [*result.solutions], "families": [*result.families]}
        self.on_result(replace(result, **copied_lists, undecided=[*result.undecided, UNFINISHED]))

    def _solve(self, region: SolutionComponent, order_index: int) -> None:
        """Solve the equations up to eps^ORDERS[order_index] on a region: a set of solutions of a lower order."""
        order, result = ORDERS[order_index], self.result
        self.settings.progress(f"equations at eps^{order}, {len(region.free)} unknowns")
        result.order = max(result.order, order)
        rng = random.Random(f"commuting {self.settings.seed} {order}")
        equations = commutator_equations(self.f, self.space.fields, region.values, order, rng, self.budget)
        equations = [*region.equations, *(normal_form(p, region.equations) for p in equations)]
        gens = region.values[0].context().gens()
        # T gives coordinates in which each equation has few unknowns. They are used at the first order only: regions
        # of later orders have equations of their own, which would have to be transformed as well.
        T = decoupling(equations, len(gens))
        if T is not None and order_index == 0:
            zero = gens[0].context().constant(0)
            old_coordinates = [
                sum((y * T[i, j] for j, y in enumerate(gens) if T[i, j] != 0), zero) for i in range(len(gens))
            ]
            equations = [p.compose(*old_coordinates, ctx=zero.context()) for p in equations]
            region = SolutionComponent(tuple(v.compose(*old_coordinates, ctx=zero.context()) for v in region.values))
        solutions = solve_system(equations, region.values, self.budget)
        result.irrational += [text for text in solutions.irrational if text not in result.irrational]
        self.points += [component for component in solutions.components if not component.free]
        for family in [component for component in solutions.components if component.free]:
            if any(known_family.contains(family) for known_family in self.families):
                continue
            if self.budget.is_spent:
                self._report_unsolved(family, SPENT)
                continue
            self.settings.progress(f"a family with {len(family.free)} parameters")
            finding = certify_family(self.f, self.space, family, self.settings)
            if finding.verdict is not Certainty.REFUTED:
                self._add_family(family, finding)
            elif order_index + 1 < len(ORDERS) and not self.budget.is_spent:
                self._solve(family, order_index + 1)
            else:
                result.undecided.append(
                    f"a family with {len(family.free)} parameters solves the equations up to eps^{order}, "
                    "and not all of it commutes"
                )
        for component in solutions.unsolved:
            if order_index + 1 < len(ORDERS) and not self.budget.is_spent:
                self._solve(component, order_index + 1)
            else:
                self._report_unsolved(component, solutions.reason)

    def _report_unsolved(self, region: SolutionComponent, reason: str) -> None:
        """Report equations that were not solved: a message for each of the first few, then one for all others."""
        texts = [format_polynomial(p) for p in region.equations]
        equations_text = "; ".join(f"{text if len(text) < 200 else text[:200] + '...'} = 0" for text in texts[:6])
        message = f"equations for b1, ..., b{len(region.values)} were not solved over Q ({reason}): {equations_text}"
        if message in self.result.undecided:
            return
        if len(self.result.undecided) < MAX_MESSAGES:
            self.result.undecided.append(message)
        elif len(self.result.undecided) == MAX_MESSAGES:
            self.result.undecided.append("and more equations that were not solved")

    def _add_family(self, family: SolutionComponent, finding: Finding) -> None:
        if finding.verdict is Certainty.UNDECIDED:
            self.result.undecided.append(f"a family with {len(family.free)} parameters: {finding.evidence.summary}")
            return
        # A family that solves the equations of a higher order is added later, and may contain earlier families.
        kept_indices = [k for k, known_family in enumerate(self.families) if not family.contains(known_family)]
        self.families = [*(self.families[k] for k in kept_indices), family]
        self.result.families = [self.result.families[k] for k in kept_indices]
        # Reduce the directions to echelon form, and take as the base the member with the entry 0 at each pivot.
        direction_matrix, _ = fmpq_mat([family.direction(i) for i in family.free]).rref()
        base = list(family.point)
        for row in direction_matrix.tolist():
            pivot = next(k for k, entry in enumerate(row) if entry != 0)
            base = [b - base[pivot] * entry for b, entry in zip(base, row, strict=True)]
        directions = [tuple(fmpq(e) for e in primitive_integers(tuple(row))) for row in direction_matrix.tolist()]
        base_field, *fields = (self._build_field(weights, finding) for weights in (base, *directions))
        self.result.families.append(CommutingFamily(base_field, tuple(fields), finding))
        self._report()

    def _build_field(self, weights: Sequence[fmpq], finding: Finding) -> CommutingField:
        matrix = combination_of(weights, self.space.matrices) if self.space.matrices else None
        g = field_at(self.space, weights)
        trivial_names = [name for name, multiple in (("0", 0), ("f", 1), ("-f", -1)) if g == self.f.scaled(multiple)]
        return CommutingField(g, matrix, trivial_names[0] if trivial_names else "", finding)


def find_commuting(
    system: SystemLike,
    shape: str | None = None,
    *,
    seed: int = 0,
    error_bits: int = DEFAULT_ERROR_BITS,
    effort: int | Budget = 1,
    progress: Callable[[str], None] = lambda _: None,
    on_result: Callable[[CommutingSystems], None] = lambda _: None,
) -> CommutingSystems:
    """Find all quadratic g whose Kahan map commutes with that of f at the same eps, over Q or the number field of f.

    `system` is f or its Kahan map, possibly with an algebraic number; the other arguments are those of
    `commuting_systems`. Over a number field the default shape is "linear" (g = B f); the right-hand sides of g contain
    the algebraic number, and B is not returned.
    Raises InputError for maps that are no Kahan maps, and in the cases in which `commuting_systems` raises it.

    >>> from kahanmaps.documents.inline import System
    >>> systems = find_commuting(System("x' = a*x^2; y' = y^2", a="root of t^2 - 2").map)
    >>> [g.rhs for g in systems.solutions]
    [['0', '0'], ['x^2*a', 'y^2'], ['-x^2*a', '-y^2']]
    >>> [[g.rhs for g in family.directions] for family in systems.families]
    [[['x^2*a', 'y^2'], ['2*x^2', '0'], ['x^2*a', '0'], ['0', 'y^2*a']]]
    """
    options: dict[str, Any] = {"seed": seed, "error_bits": error_bits, "effort": effort, "progress": progress}
    map_ = as_map(system)
    kahan = map_.family if isinstance(map_, AlgebraicMap) else map_
    if not isinstance(kahan, KahanFamily) or "eps" in kahan.system.symbols:
        raise InputError(f"found {kahan.kind}, expected a quadratic vector field without eps")
    if not isinstance(map_, AlgebraicMap):
        return commuting_systems(kahan.system, shape, **options, on_result=on_result)
    f, minimal_polynomial = kahan.system, map_.root.polynomial
    if GENERATOR in f.variables:
        raise InputError(f"found a variable {GENERATOR}, expected another name: this one denotes the algebraic number")
    gens = ring((*f.variables, GENERATOR)).gens()
    over_t = QuadraticSystem(tuple(p.compose(*gens, ctx=gens[0].context()) for p in f.rhs), (GENERATOR,))
    m, times_t = map_.root.degree, map_.root.number_field.generator.matrix
    C = fmpq_mat(f.dim * m, f.dim * m)  # the matrix, over Q, of multiplication by the algebraic number t
    for k, i, j in itertools.product(range(f.dim), range(m), range(m)):
        C[k * m + i, k * m + j] = times_t[i, j]
    *x, a = ring((*f.variables, *f.symbols)).gens()
    rational_point = [x[k // m] if k % m == 0 else 0 * a for k in range(f.dim * m)]

    def descend(G: QuadraticSystem) -> QuadraticSystem:
        """Return the system over the number field that G represents, from the values of G at points of Q^n."""
        coordinates = [p.compose(*rational_point, ctx=a.context()) for p in G.rhs]
        rhs = (sum((coordinates[i * m + j] * a**j for j in range(m)), 0 * a) for i in range(f.dim))
        return QuadraticSystem(tuple(rhs), f.symbols)

    def descend_field(g: CommutingField) -> CommutingField:
        return replace(g, system=descend(g.system), B=None)

    def descend_all(result: CommutingSystems) -> CommutingSystems:
        return replace(
            result,
            system=f,
            basis=[descend(G) for G in result.basis],
            dimension=None if result.dimension is None else result.dimension // m,
            solutions=[descend_field(g) for g in result.solutions],
            families=[
                replace(
                    family, base=descend_field(family.base), directions=tuple(map(descend_field, family.directions))
                )
                for family in result.families
            ],
            irrational=[],  # irrational solutions are defined over extensions of the field only
            root=str(map_.root),
        )

    options["on_result"] = lambda result: on_result(descend_all(result))
    return descend_all(commuting_systems(over_algebra(over_t, minimal_polynomial), shape or "linear", **options, C=C))
