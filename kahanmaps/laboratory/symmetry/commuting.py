"""All quadratic systems g, of a given shape, whose Kahan map commutes with that of f at equal eps, for every eps.

The search has three stages. The Lie bracket [f, g] vanishes: this gives a linear space of candidates. The next terms of
the commutator, in powers of eps, vanish: these are polynomial equations on that space, solved over Q. Both conditions
are necessary, so that no solution is discarded. Then every solution is certified as an identity in x and eps: proved,
or supported at random points.

A quadratic system in n variables over a number field K of degree m is one in n m variables over Q, and its Kahan map is
that over K (docs/beyond.md). So the g over K whose maps commute with that of f are among the rational ones for this
larger system.
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
    normal_form,
    solve_system,
    without_contained,
)
from kahanmaps.algebra.work import SPENT, Budget
from kahanmaps.checks.claims import Certainty, Finding, combined
from kahanmaps.checks.decide import DEFAULT_ERROR_BITS
from kahanmaps.checks.settings import Settings
from kahanmaps.display_protocols import PrintableResult
from kahanmaps.errors import InputError, counted
from kahanmaps.family.tensor import GENERATOR, over_algebra
from kahanmaps.laboratory.defaults import budget_for
from kahanmaps.laboratory.symmetry.commuting_proofs import affine, certify_family, certify_field
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

ORDERS = (4, 6, 8)  # powers of eps in the commutator; odd ones follow from those before
MAX_TOLD = 6  # sentences about equations that were not solved
# All quadratic g are tried by default, within the same units at every effort, so that the shape is the same in every
# command; some hundredths of this suffice as a rule.
QUICK_DIMENSION, QUICK_UNITS = 3, 1e6
MAX_SPACE = 24  # the cubic equations have up to C(l + 2, 3) + l terms


@dataclass(frozen=True)
class CommutingField:
    """A system g that commutes with f, the matrix B if the shape is g = B f, and the finding on it.

    `trivial` says "0", "f" or "-f" where g is that, else it is empty.
    """

    system: QuadraticSystem
    B: fmpq_mat | None
    trivial: str
    finding: Finding

    @property
    def rhs(self) -> list[str]:
        """The right-hand sides as text, to be given back as a system."""
        return [format_polynomial(p) for p in self.system.rhs]

    def to_json(self) -> dict[str, Any]:
        """Plain data: rhs, B, trivial, verdict and evidence."""
        return {
            **attributes(self, "rhs", "B"),
            "trivial": self.trivial or None,
            **attributes(self.finding, "verdict", "evidence"),
        }


@dataclass(frozen=True)
class CommutingFamily:
    """A linear family of g that commute: `base` + sum t_i `directions[i]`, for all values of the parameters t."""

    base: CommutingField
    directions: tuple[CommutingField, ...]
    finding: Finding

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
    """The result of the search; if `complete`, there are no other rational g of this shape.

    `dimension` is that of the space of g with [f, g] = 0; `irrational` describes solutions that are not rational;
    `discarded` counts solutions of the equations that do not commute; `every_g_commutes` where f = 0, and then nothing
    is listed; `undecided` has sentences on what was not decided.
    """

    system: QuadraticSystem
    shape: str
    dimension: int | None = None
    basis: list[QuadraticSystem] = field(default_factory=list)
    solutions: list[CommutingField] = field(default_factory=list)
    families: list[CommutingFamily] = field(default_factory=list)
    irrational: list[str] = field(default_factory=list)
    every_g_commutes: bool = False
    discarded: int = 0
    order: int = 2  # the highest power of eps of which equations were taken
    undecided: list[str] = field(default_factory=list)
    root: str = ""  # the algebraic number in f, where there is one
    note: str = ""  # on another shape that was tried first

    @property
    def complete(self) -> bool:
        """Whether all rational g of this shape that commute were found."""
        return not self.undecided

    @property
    def kind_text(self) -> str:
        """The kind of g that were searched."""
        over = f" over the number field of a {self.root}" if self.root else ""
        if self.shape == "linear":
            return f"fields g = B f (B a constant {'matrix' if over else 'rational matrix'}{over})"
        return f"fields g of degree at most 2{over or ' with rational coefficients'}"

    @property
    def nontrivial(self) -> list[CommutingField]:
        """The single solutions other than 0, f and -f."""
        return [g for g in self.solutions if not g.trivial]

    @property
    def verdict(self) -> Certainty:
        """The weakest verdict on the solutions; undecided where the list may not be complete."""
        found = [g.finding.verdict for g in self.solutions] + [family.finding.verdict for family in self.families]
        return combined([*found, *([] if self.complete else [Certainty.UNDECIDED])])

    def rows(self) -> list[dict[str, str]]:
        """A row for each g other than 0, f and -f, for `pandas.DataFrame(found.rows())` and the like."""
        return [{"g": ", ".join(g.rhs), "verdict": str(g.finding.verdict)} for g in self.nontrivial]

    def to_json(self) -> dict[str, Any]:
        """Plain data, the shape that scripts rely on."""
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
    C: fmpq_mat | None = None,
) -> CommutingSystems:
    """Find all rational quadratic g whose Kahan map commutes with that of f = `system` at the same eps, for every eps.

    `shape` "linear": g = B f with a constant matrix B; "quadratic": any g with terms of degree at most 2; None: these
    where the dimension is at most 3 and little work finds all of them, else those, which a `note` says. Exact over Q;
    what no lemma proves is supported at random points, with a probability of error below 2^-error_bits. Each more of
    `effort` doubles the work that the search may take. With a matrix C, for which C f' = f' C, only g with C g' = g' C.
    Raises InputError for another shape or a bound that is not positive. What was too large to be searched is reported
    in `undecided`.
    Source: petrera-suris-2016.

    >>> f = QuadraticSystem.from_text(["x", "y"], ["x^2 + 1", "y^2 - x*y"])
    >>> [(g.trivial, str(g.finding.verdict)) for g in commuting_systems(f).solutions]
    [('0', 'proved'), ('f', 'proved'), ('-f', 'proved')]
    """
    system, budget = as_system(system), budget_for("commuting systems", effort)
    if shape is None:
        note = ""
        options: dict[str, Any] = {"seed": seed, "error_bits": error_bits, "progress": progress}
        if system.dim <= QUICK_DIMENSION and not budget.is_spent:
            found = commuting_systems(system, "quadratic", **options, effort=Budget(QUICK_UNITS))
            if found.complete:
                return found
            note = f"the {found.kind_text} were tried first, and a short search did not find all; try --shape quadratic"
        found = commuting_systems(system, "linear", **options, effort=budget, C=C)
        return replace(found, note=note)
    if shape not in SHAPES:
        raise InputError(f"found the shape {shape!r}, expected {' or '.join(SHAPES)}")
    settings = Settings(seed=derive_seed(seed, system.rhs), error_bits=error_bits, progress=progress)
    search = _Search(system, settings, budget, C, CommutingSystems(system, shape))
    search.run()
    return search.found


@dataclass
class _Search:
    f: QuadraticSystem
    settings: Settings
    budget: Budget
    C: fmpq_mat | None
    found: CommutingSystems
    space: CommutingSpace = field(default_factory=lambda: CommutingSpace((), (), 0))
    points: list[SolutionComponent] = field(default_factory=list)
    families: list[SolutionComponent] = field(default_factory=list)

    def run(self) -> None:
        f, found = self.f, self.found
        count = unknowns(f, found.shape)
        if all(p.is_zero() for p in f.rhs):
            found.dimension = count
            matrix = fmpq_mat(f.dim, f.dim) if found.shape == "linear" else None
            found.solutions.append(CommutingField(f, matrix, "0", certify_field(f, f, self.settings)))
            found.every_g_commutes = found.shape == "quadratic"
            return
        if count > MAX_UNKNOWNS:
            found.undecided.append(f"g has {count} unknown coefficients, and at most {MAX_UNKNOWNS} are tried")
        elif f.digits > LONG_COEFFICIENTS:
            found.undecided.append(f"other g are searched for coefficients of up to {LONG_COEFFICIENTS} digits only")
        if found.undecided:
            self.space = CommutingSpace((f,), (QQ.identity(f.dim),) * (found.shape == "linear"), 1)
        else:
            self.settings.progress("the fields g with [f, g] = 0")
            self.space = commuting_space(f, found.shape, self.settings.seed, self.C)
            found.basis = list(self.space.fields)
            found.dimension = len(found.basis) if len(found.basis) == self.space.dimension else None
            size = self.space.dimension
            whole = SolutionComponent(tuple(ring([f"b{k + 1}" for k in range(len(self.space.fields))]).gens()))
            # Where f is affine the space may be large, and often all of it commutes: a proof without equations.
            if found.dimension is not None and f.degree <= 1 and affine(f, self.space.fields) is not None:
                self._add_family(whole, certify_family(f, self.space, whole, self.settings))
            elif size > MAX_SPACE:
                found.undecided.append(
                    f"the fields g with [f, g] = 0 have dimension {'up to ' * (found.dimension is None)}{size}, "
                    f"and equations are solved up to {MAX_SPACE}"
                )
            else:
                self._solve(whole, 0)
        zeros = [fmpq(0)] * (len(self.space.fields) - 1)
        trivial = [(fmpq(first), *zeros) for first in (0, 1, -1)]
        single = [c.point for c in without_contained([*self.families, *self.points]) if not c.free]
        # g and -g stand together, as 1 and -1 times the same integers.
        signs = {p: 1 if next(w for w in p if w != 0) > 0 else -1 for p in single if p not in trivial}
        others = sorted(signs, key=lambda p: (*map(abs, p), *(w * signs[p] for w in p), signs[p] < 0))
        for k, weights in enumerate([*trivial, *others]):
            if self.budget.is_spent and weights not in trivial:
                found.undecided.append(f"{counted(len(others) + 3 - k, 'solution')} not certified: {SPENT}")
                return
            self.settings.progress(f"solution {k + 1} of {len(others) + 3}")
            finding = certify_field(f, field_at(self.space, weights), self.settings)
            if finding.verdict is Certainty.REFUTED:
                found.discarded += 1
            elif finding.verdict is Certainty.UNDECIDED:
                found.undecided.append(f"one solution: {finding.evidence.summary}")
            else:
                found.solutions.append(self._field(weights, finding))

    def _solve(self, part: SolutionComponent, level: int) -> None:
        """Solve the equations of the order that belongs to `level` inside a part of the space."""
        order, found = ORDERS[level], self.found
        self.settings.progress(f"equations at eps^{order}, {len(part.free)} unknowns")
        found.order = max(found.order, order)
        rng = random.Random(f"commuting {self.settings.seed} {order}")
        equations = commutator_equations(self.f, self.space.fields, part.values, order, rng, self.budget)
        equations = [*part.equations, *(normal_form(p, part.equations) for p in equations)]
        gens = part.values[0].context().gens()
        T = decoupling(equations, len(gens))
        if T is not None and level == 0:
            zero = gens[0].context().constant(0)
            moved = [sum((y * T[i, j] for j, y in enumerate(gens) if T[i, j] != 0), zero) for i in range(len(gens))]
            equations = [p.compose(*moved, ctx=zero.context()) for p in equations]
            part = SolutionComponent(tuple(v.compose(*moved, ctx=zero.context()) for v in part.values))
        solutions = solve_system(equations, part.values, self.budget)
        found.irrational += [text for text in solutions.irrational if text not in found.irrational]
        self.points += [component for component in solutions.components if not component.free]
        for family in [component for component in solutions.components if component.free]:
            if any(known.contains(family) for known in self.families):
                continue
            if self.budget.is_spent:
                self._leave(family, SPENT)
                continue
            self.settings.progress(f"a family with {len(family.free)} parameters")
            finding = certify_family(self.f, self.space, family, self.settings)
            if finding.verdict is not Certainty.REFUTED:
                self._add_family(family, finding)
            elif level + 1 < len(ORDERS) and not self.budget.is_spent:
                self._solve(family, level + 1)
            else:
                found.undecided.append(
                    f"a family with {len(family.free)} parameters solves the equations up to eps^{order}, "
                    "and not all of it commutes"
                )
        for component in solutions.unsolved:
            if level + 1 < len(ORDERS) and not self.budget.is_spent:
                self._solve(component, level + 1)
            else:
                self._leave(component, solutions.reason)

    def _leave(self, part: SolutionComponent, reason: str) -> None:
        """Tell of equations that were not solved; a few of them are enough."""
        texts = [format_polynomial(p) for p in part.equations]
        shown = "; ".join(f"{text if len(text) < 200 else text[:200] + '...'} = 0" for text in texts[:6])
        message = f"equations for b1, ..., b{len(part.values)} were not solved over Q ({reason}): {shown}"
        if message in self.found.undecided:
            return
        if len(self.found.undecided) < MAX_TOLD:
            self.found.undecided.append(message)
        elif len(self.found.undecided) == MAX_TOLD:
            self.found.undecided.append("and more equations that were not solved")

    def _add_family(self, family: SolutionComponent, finding: Finding) -> None:
        if finding.verdict is Certainty.UNDECIDED:
            self.found.undecided.append(f"a family with {len(family.free)} parameters: {finding.evidence.summary}")
            return
        # A family found later, at a higher order, may hold an earlier one.
        kept = [k for k, known in enumerate(self.families) if not family.contains(known)]
        self.families = [*(self.families[k] for k in kept), family]
        self.found.families = [self.found.families[k] for k in kept]
        # Short directions, and as the base the member that has zeros where these have their leading ones.
        slopes, _ = fmpq_mat([family.slopes(i) for i in family.free]).rref()
        base = list(family.point)
        for row in slopes.tolist():
            lead = next(k for k, entry in enumerate(row) if entry != 0)
            base = [b - base[lead] * entry for b, entry in zip(base, row, strict=True)]
        directions = [tuple(fmpq(e) for e in primitive_integers(tuple(row))) for row in slopes.tolist()]
        self.found.families.append(
            CommutingFamily(self._field(base, finding), tuple(self._field(d, finding) for d in directions), finding)
        )

    def _field(self, weights: Sequence[fmpq], finding: Finding) -> CommutingField:
        matrix = combination_of(weights, self.space.matrices) if self.space.matrices else None
        g = field_at(self.space, weights)
        names = [name for name, factor in (("0", 0), ("f", 1), ("-f", -1)) if g == self.f.scaled(factor)]
        return CommutingField(g, matrix, names[0] if names else "", finding)


def find_commuting(
    system: SystemLike,
    shape: str | None = None,
    *,
    seed: int = 0,
    error_bits: int = DEFAULT_ERROR_BITS,
    effort: int | Budget = 1,
    progress: Callable[[str], None] = lambda _: None,
) -> CommutingSystems:
    """All quadratic g whose Kahan map commutes with that of f at the same eps, over Q or the number field of f.

    `system` is f, or its Kahan map, with an algebraic number in it or none; the rest is as for `commuting_systems`.
    Over a number field g are of the shape B f unless "quadratic" is asked for, their right-hand sides contain the root,
    and B is not given.
    Raises InputError for other maps and for what that function refuses.

    >>> from kahanmaps.documents.inline import System
    >>> found = find_commuting(System("x' = a*x^2; y' = y^2", a="root of t^2 - 2").map)
    >>> [g.rhs for g in found.solutions]
    [['0', '0'], ['x^2*a', 'y^2'], ['-x^2*a', '-y^2']]
    >>> [[g.rhs for g in family.directions] for family in found.families]
    [[['x^2*a', 'y^2'], ['2*x^2', '0'], ['x^2*a', '0'], ['0', 'y^2*a']]]
    """
    options: dict[str, Any] = {"seed": seed, "error_bits": error_bits, "effort": effort, "progress": progress}
    given = as_map(system)
    kahan = given.given if isinstance(given, AlgebraicMap) else given
    if not isinstance(kahan, KahanFamily) or "eps" in kahan.system.symbols:
        raise InputError(f"found {kahan.kind}, expected a quadratic vector field without eps: g is sought for fields")
    if not isinstance(given, AlgebraicMap):
        return commuting_systems(kahan.system, shape, **options)
    f, chi = kahan.system, given.root.polynomial
    if GENERATOR in f.variables:
        raise InputError(f"found a variable {GENERATOR}, expected another name: it is that of the root over a field")
    letters = ring((*f.variables, GENERATOR)).gens()
    over_t = QuadraticSystem(tuple(p.compose(*letters, ctx=letters[0].context()) for p in f.rhs), (GENERATOR,))
    m, times_t = given.root.degree, given.root.number_field.generator.matrix
    C = fmpq_mat(f.dim * m, f.dim * m)  # t times a point
    for k, i, j in itertools.product(range(f.dim), range(m), range(m)):
        C[k * m + i, k * m + j] = times_t[i, j]
    found = commuting_systems(over_algebra(over_t, chi), shape or "linear", **options, C=C)
    *x, a = ring((*f.variables, *f.symbols)).gens()
    at = [x[k // m] if k % m == 0 else 0 * a for k in range(f.dim * m)]

    def back(G: QuadraticSystem) -> QuadraticSystem:
        """The system over K that one over Q comes from: its values at points of Q^n tell."""
        parts = [p.compose(*at, ctx=a.context()) for p in G.rhs]
        rhs = (sum((parts[i * m + j] * a**j for j in range(m)), 0 * a) for i in range(f.dim))
        return QuadraticSystem(tuple(rhs), f.symbols)

    def over(one: CommutingField) -> CommutingField:
        return replace(one, system=back(one.system), B=None)

    return replace(
        found,
        system=f,
        basis=[back(G) for G in found.basis],
        dimension=None if found.dimension is None else found.dimension // m,
        solutions=[over(g) for g in found.solutions],
        families=[
            replace(family, base=over(family.base), directions=tuple(map(over, family.directions)))
            for family in found.families
        ],
        irrational=[],  # these are not over the field either, but over its products with others
        root=str(given.root),
    )
