"""Linear and affine symmetries of a Kahan map, and its reversing symmetries.

Let Phi be the Kahan map of x' = f(x), and T(x) = S x + r. Kahan's method is equivariant under affine changes of
variables. So T is a symmetry (T Phi T^{-1} = Phi for every eps) if f(T(x)) = S f(x), and a reversing symmetry
(T Phi T^{-1} = Phi^{-1} for every eps) if f(T(x)) = -S f(x). Conversely, the terms of first order in eps of these
relations give the equations for f. Both sides of these equations are polynomials in x, whose coefficients are compared
exactly: every reported symmetry is proved.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.matrices import nullspace, primitive_integers
from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.algebra.polynomials import coefficients_in, linear_combinations, ring
from kahanmaps.algebra.printing import attributes, format_polynomial, plain
from kahanmaps.algebra.small_systems import SolutionComponent, solve_system
from kahanmaps.algebra.work import Budget, count_work
from kahanmaps.display_protocols import PrintableResult, ResultPart
from kahanmaps.laboratory.defaults import budget_for
from kahanmaps.laboratory.symmetry.signed_permutations import MAX_DIMENSION as MAX_SIGNED
from kahanmaps.laboratory.symmetry.signed_permutations import signed_permutations
from kahanmaps.maps.kahan import SystemLike
from kahanmaps.systems.quadratic import LONG_COEFFICIENTS, QuadraticSystem, as_system

MAX_LINEAR = 16  # dimension n up to which infinitesimal symmetries are computed, with n^2 + n + 1 unknowns
MAX_LISTED = 200  # symmetries of each kind in the JSON
MAX_GENERAL = 3  # dimension up to which the polynomial equations for S are solved
SIGNED, SCALED = "signed permutations", "signed permutations of scaled variables"
MATRICES = "rational matrices"


@dataclass(frozen=True)
class Symmetry(ResultPart):
    """An affine T(x) = S x + r: T Phi T^{-1} is Phi or, if `reversing`, Phi^{-1} for the Kahan map Phi at every eps."""

    variables: tuple[str, ...]
    S: fmpq_mat
    r: tuple[fmpq, ...]
    reversing: bool

    @property
    def text(self) -> str:
        """The action as text such as "(x, y) -> (y, -x)"."""
        return f"({', '.join(self.variables)}) -> ({', '.join(_affine_text(self.variables, self.S, self.r))})"

    @property
    def kind(self) -> str:
        """\"symmetry\" or \"reversing symmetry\"."""
        return "reversing symmetry" if self.reversing else "symmetry"

    @property
    def is_trivial(self) -> bool:
        """Whether r = 0 and S is I or -I."""
        return not any(e != 0 for e in self.r) and self.S in (QQ.identity(len(self.r)), -QQ.identity(len(self.r)))

    def to_json(self) -> dict[str, Any]:
        """Plain data: S, r, the kind, the action as text."""
        return {**attributes(self, "kind", "S", "r", "text", trivial="is_trivial"), "verdict": "proved"}


@dataclass(frozen=True)
class Infinitesimal(ResultPart):
    """An affine vector field S x + s with f'(x)(S x + s) - S f(x) = weight f(x); the weight is 0 or 1.

    If T_t is its flow, T_t Phi(., eps) T_t^{-1} = Phi(., e^(-weight t) eps). So with weight 0 each T_t is a symmetry.
    """

    variables: tuple[str, ...]
    S: fmpq_mat
    s: tuple[fmpq, ...]
    weight: int

    @property
    def is_linear(self) -> bool:
        """Whether s = 0."""
        return not any(e != 0 for e in self.s)

    @property
    def rhs(self) -> list[str]:
        """The components of S x + s as text."""
        return _affine_text(self.variables, self.S, self.s)

    def to_json(self) -> dict[str, Any]:
        """Plain data: S, s, weight, the components as text."""
        return {**attributes(self, "S", "s", "rhs", "weight"), "verdict": "proved"}


@dataclass
class Symmetries(PrintableResult):
    """The result of `linear_symmetries`: the symmetries of a Kahan map, and the searches that were completed.

    `infinitesimal` is a basis of the fields of weight 0, linear fields first; `scaling` is a field of weight 1 or None.
    `signed` are the T(x) = S x + r whose S is a signed permutation of the variables or of scaled variables
    (signed_permutations.py); `others` are further linear T. `generators` generate the group of `signed` or, without
    infinitesimal symmetries, of `signed` and `others`; `group_of` names the kind of its matrices S. The number of these
    is `order` (None: unknown). `searched` lists the completed searches, and `undecided` the open questions.
    """

    _parts, _noun = "generators", ("generator", "generators")

    system: QuadraticSystem
    infinitesimal: list[Infinitesimal] = field(default_factory=list)
    scaling: Infinitesimal | None = None
    signed: list[Symmetry] = field(default_factory=list)
    generators: list[Symmetry] = field(default_factory=list)
    order: int | None = None
    group_of: str = SIGNED
    others: list[Symmetry] = field(default_factory=list)
    searched: list[str] = field(default_factory=list)
    undecided: list[str] = field(default_factory=list)

    @property
    def complete(self) -> bool:
        """Whether every search was completed."""
        return not self.undecided

    @property
    def reversing_order(self) -> int:
        """The number of linear parts of reversing symmetries in the group that `generators` generate."""
        if self.group_of != MATRICES:
            return sum(t.reversing for t in self.signed)
        # f is not 0, so no element is both a symmetry and reversing: half of the elements are reversing, or none
        return (self.order or 0) // 2 if any(t.reversing for t in self.generators) else 0

    @property
    def group_text(self) -> str:
        """The group in words, e.g. "4 signed permutations, 2 of them reversing"; empty for the trivial group."""
        if self.order is None or self.order == 1:
            return ""
        return f"{self.order} {self.group_of}, {self.reversing_order or 'none'} of them reversing"

    @property
    def symmetries(self) -> list[Symmetry]:
        """The known symmetries of finite order that are not reversing."""
        return [t for t in (*self.signed, *self.others) if not t.reversing]

    @property
    def reversing(self) -> list[Symmetry]:
        """The known reversing symmetries of finite order."""
        return [t for t in (*self.signed, *self.others) if t.reversing]

    def rows(self) -> list[dict[str, str]]:
        """Return a row for each known symmetry of finite order, e.g. for `pandas.DataFrame(symmetries.rows())`."""
        return [{"kind": t.kind, "action": t.text} for t in (*self.symmetries, *self.reversing)]

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        is_signed = self.group_of != MATRICES
        count = sum(not t.reversing for t in self.signed) if is_signed else (self.order or 0) - self.reversing_order
        group = {
            "of": self.group_of,
            "order": self.order,
            "symmetries": count,
            "reversing_symmetries": self.reversing_order,
            **attributes(self, "generators"),
        }
        lists = {"symmetries": self.symmetries[:MAX_LISTED], "reversing_symmetries": self.reversing[:MAX_LISTED]}
        return {
            "status": "complete" if self.complete else "undecided",
            **attributes(self, "infinitesimal", "scaling"),
            "group": group,
            "listed": sum(map(len, lists.values())),
            **plain(lists),
            **attributes(self, "searched", "undecided"),
        }


def linear_symmetries(
    system: SystemLike,
    *,
    effort: int | Budget = 1,
    progress: Callable[[str], None] = lambda _: None,
    on_result: Callable[[Symmetries], None] = lambda _: None,
) -> Symmetries:
    """Find affine symmetries and reversing symmetries of the Kahan map of `system`, for every eps.

    The search covers the Lie algebra of affine symmetries, an affine field X with [X, f] = f (a scaling), and signed
    permutations of the variables or of scaled variables, with a translation if needed (dimension at most 12). In
    dimension at most 3 it covers all rational matrices, unless the Lie algebra contains a linear field.

    Args:
        system: a quadratic system over Q.
        effort: each increase by 1 doubles the work limit.
        progress: called with a message at each stage.
        on_result: called once, before the first stage; all stages add symmetries to the object that it receives.

    Returns:
        A `Symmetries`, exact and proved. Source: cmoq-2013.

    >>> symmetries = linear_symmetries(QuadraticSystem.from_text(["x", "y", "z"], ["y*z", "z*x", "x*y"]))
    >>> symmetries.order, [t.text for t in symmetries.generators]
    (48, ['(x, y, z) -> (z, x, -y)', '(x, y, z) -> (-x, -z, y)'])
    """
    system = as_system(system)
    budget = budget_for("symmetries", effort)
    symmetries = Symmetries(system)
    on_result(symmetries)
    progress("infinitesimal symmetries")
    _add_lie_algebra(symmetries)
    progress("signed permutations")
    _add_signed_permutations(symmetries, budget)
    if system.dim <= MAX_GENERAL:
        progress("all matrices")
        _add_matrices(symmetries, budget)
    return symmetries


def _add_lie_algebra(symmetries: Symmetries) -> None:
    f = symmetries.system
    n = f.dim
    if n > MAX_LINEAR:
        symmetries.undecided.append(
            f"infinitesimal symmetries are computed up to dimension {MAX_LINEAR}, not in dimension {n}"
        )
        return
    gens = ring(f.variables).gens()
    columns = []
    for i, j in itertools.product(range(n), repeat=2):  # S = E_ij
        columns.append([p.derivative(i) * gens[j] - (f.rhs[j] if k == i else 0) for k, p in enumerate(f.rhs)])
    columns += [[p.derivative(i) for p in f.rhs] for i in range(n)]
    columns.append([-p for p in f.rhs])
    # One equation for each component of f and each monomial.
    rows: dict[tuple[int, tuple[int, ...]], list[fmpq]] = {}
    for column_index, column in enumerate(columns):
        for k, p in enumerate(column):
            for monomial, value in p.terms():
                rows.setdefault((k, tuple(monomial)), [fmpq(0)] * len(columns))[column_index] = value
    equations = list(rows.values()) or [[fmpq(0)] * len(columns)]
    count_work(200 + len(equations) * len(columns) * (3 + len(columns) / 50))
    # The basis is in echelon form from the right, and s comes last: so a basis of the linear fields comes first.
    basis = nullspace(QQ, fmpq_mat([row[:-1] for row in equations]))

    def build_infinitesimal(vector: Sequence[fmpq], weight: int) -> Infinitesimal:
        return Infinitesimal(f.variables, fmpq_mat(n, n, vector[: n * n]), tuple(vector[n * n :]), weight)

    symmetries.infinitesimal = [build_infinitesimal([fmpq(e) for e in primitive_integers(v)], 0) for v in basis]
    scalings = [v for v in nullspace(QQ, fmpq_mat(equations)) if v[-1] != 0]
    if f.is_homogeneous:  # S = I is a scaling, preferred to all others
        symmetries.scaling = Infinitesimal(f.variables, QQ.identity(n), (fmpq(0),) * n, 1)
    elif scalings:
        vector = min(scalings, key=lambda v: sum(e != 0 for e in v))
        symmetries.scaling = build_infinitesimal([e / vector[-1] for e in vector[:-1]], 1)
    symmetries.searched.append("affine infinitesimal symmetries and scalings: all")


def _add_signed_permutations(symmetries: Symmetries, budget: Budget) -> None:
    f = symmetries.system
    if f.dim > MAX_SIGNED:
        symmetries.undecided.append(
            f"signed permutations are tried up to dimension {MAX_SIGNED}, not in dimension {f.dim}"
        )
        return
    is_complete = True
    for sign in (1, -1):
        matrices, is_finished = signed_permutations(f, sign, budget)
        is_complete = is_complete and is_finished
        for S in matrices:
            if budget.is_spent:
                is_complete = False
                break
            r = translation(f, S, sign, budget)
            if r is not None:
                symmetries.signed.append(Symmetry(f.variables, S, r, sign < 0))
    symmetries.signed.sort(key=lambda t: (t.reversing, not t.is_trivial, any(e != 0 for e in t.r)))
    if not is_complete:
        symmetries.undecided.append(
            "not all signed permutations were tried: they are too many, or the work limit was reached; raise --effort"
        )
        return
    symmetries.searched.append("signed permutations, with a translation: all")
    symmetries.order = len({_matrix_key(t.S) for t in symmetries.signed})  # for f = 0 each S occurs twice
    if any(abs(entry) not in (0, 1) for t in symmetries.signed for entry in t.S.entries()):
        symmetries.group_of = SCALED
    symmetries.generators = _find_generators(symmetries.signed)


def _find_generators(elements: Sequence[Symmetry]) -> list[Symmetry]:
    """Return a minimal list of elements, of high order first, whose linear parts generate those of all elements."""

    def order(matrix: fmpq_mat) -> int:
        power, count = matrix, 1
        while power != QQ.identity(matrix.nrows()):
            power, count = power * matrix, count + 1
        return count

    generators: list[Symmetry] = []
    group = _generate_group([], len(elements[0].r))
    for element in sorted(elements, key=lambda t: -order(t.S)):
        if _matrix_key(element.S) not in group:
            generators.append(element)
            group = _generate_group([t.S for t in generators], len(element.r))
    for element in list(generators):
        other_generators = [t for t in generators if t is not element]
        if len(_generate_group([t.S for t in other_generators], len(element.r))) == len(group):
            generators = other_generators
    return generators


def _generate_group(matrices: Sequence[fmpq_mat], n: int) -> set[tuple[str, ...]]:
    """Return the keys (`_matrix_key`) of all elements of the finite group that the n x n matrices generate."""
    new_elements = [QQ.identity(n)]
    group = {_matrix_key(new_elements[0])}
    while new_elements:
        element = new_elements.pop()
        for matrix in matrices:
            count_work(5 + n**2)
            product = element * matrix
            if _matrix_key(product) not in group:
                group.add(_matrix_key(product))
                new_elements.append(product)
    return group


def _add_matrices(symmetries: Symmetries, budget: Budget) -> None:
    """Add all invertible rational S with f(S x) = S f(x) or f(S x) = -S f(x), by solving for the entries."""
    f = symmetries.system
    n = f.dim
    if any(x.is_linear for x in symmetries.infinitesimal):
        symmetries.searched.append("other matrices: not searched, since there are infinitesimal linear symmetries")
        return
    if f.digits > LONG_COEFFICIENTS:
        symmetries.undecided.append(
            f"other matrices are searched for coefficients of up to {LONG_COEFFICIENTS} digits only"
        )
        return
    context = ring([f"s{i + 1}{j + 1}" for i in range(n) for j in range(n)])
    gens = context.gens()
    matrix = [list(gens[i * n : (i + 1) * n]) for i in range(n)]
    known_matrices = {_matrix_key(t.S) for t in symmetries.signed if not any(e != 0 for e in t.r)}
    is_complete = True
    for sign in (1, -1):
        equations = matrix_equations(f, matrix, sign)
        solutions = solve_system(equations, gens, budget)
        for component in solutions.components:
            # In a family of solutions all S are singular: a family of invertible S would give infinitesimal symmetries.
            S = fmpq_mat(n, n, list(component.point))
            if not component.free and S.det() != 0 and _matrix_key(S) not in known_matrices:
                symmetries.others.append(Symmetry(f.variables, S, (fmpq(0),) * n, sign < 0))
        unsolved = [c for c in solutions.unsolved if not is_singular(c, n)]
        if unsolved:
            is_complete = False
            symmetries.undecided.append(
                f"the equations f(S x) = {'-' * (sign < 0)}S f(x) were not solved: {solutions.reason}"
            )
    if is_complete:
        symmetries.searched.append("rational matrices S, without a translation: all")
    # Without infinitesimal symmetries the group of all affine T is finite, and so are all its subgroups.
    if is_complete and symmetries.others and symmetries.order is not None and not symmetries.infinitesimal:
        symmetries.generators = _find_generators([*symmetries.signed, *symmetries.others])
        symmetries.order, symmetries.group_of = len(_generate_group([t.S for t in symmetries.generators], n)), MATRICES


def _matrix_key(matrix: fmpq_mat) -> tuple[str, ...]:
    return tuple(str(e) for e in matrix.entries())


def _affine_text(variables: Sequence[str], S: fmpq_mat, r: Sequence[fmpq]) -> list[str]:
    images = linear_combinations(S, ring(variables).gens())
    return [format_polynomial(image + shift) for image, shift in zip(images, r, strict=True)]


def is_symmetry(system: QuadraticSystem, S: fmpq_mat, r: Sequence[fmpq], sign: int) -> bool:
    """Return whether S is invertible and f(S x + r) = sign S f(x) for all x; exact. The sign -1 means reversing.

    >>> f = QuadraticSystem.from_text(["x", "y"], ["y", "-x^2"])
    >>> is_symmetry(f, fmpq_mat([[1, 0], [0, -1]]), [fmpq(0)] * 2, -1)
    True
    """
    return S.det() != 0 and system.composed(S, r) == system.transformed(S).scaled(sign)


def translation(f: QuadraticSystem, S: fmpq_mat, sign: int, budget: Budget) -> tuple[fmpq, ...] | None:
    """Return an r with f(S x + r) = sign S f(x) for all x, 0 if possible; None if no rational r was found.

    Source: cmoq-2013.

    >>> f = QuadraticSystem.from_text(["x"], ["x^2 + x"])
    >>> translation(f, fmpq_mat([[-1]]), -1, Budget())
    (-1,)
    """
    n = f.dim
    count_work(100 + 6 * n**3)
    zero = (fmpq(0),) * n
    if is_symmetry(f, S, zero, sign):
        return zero
    # The terms linear in x, f''(S x, r) + B S x = sign S B x with B = f'(0), give n^2 linear equations for r.
    defects = (S * f.B * fmpq(sign) - f.B * S).entries()
    derivatives = [(form * S * fmpq(2)).transpose() for form in f.Q]
    rows = [[*(derivatives[i][j, k] for k in range(n)), -defects[i * n + j]] for i in range(n) for j in range(n)]
    solutions = nullspace(QQ, fmpq_mat(rows))
    if not any(v[-1] != 0 for v in solutions):
        return None
    (special_solution,) = [v for v in solutions if v[-1] != 0]
    directions = [v for v in solutions if v[-1] == 0]
    # The remaining condition on the solutions r is f(r) = sign S c, where c = f(0).
    parameters = ring([f"t{k + 1}" for k in range(len(directions) + 1)])
    gens = parameters.gens()
    r = [parameters.constant(special_solution[k] / special_solution[-1]) for k in range(n)]
    for t, v in zip(gens, directions, strict=False):
        r = [a + t * v[k] for k, a in enumerate(r)]
    constants = (S * fmpq_mat(n, 1, list(f.c)) * fmpq(sign)).entries()
    equations = [p.compose(*r, ctx=parameters) - value for p, value in zip(f.rhs, constants, strict=True)]
    solution_set = solve_system([*equations, gens[-1]], r, budget)
    if not solution_set.components:
        return None
    point = solution_set.components[0].point
    return point if is_symmetry(f, S, point, sign) else None


def matrix_equations(f: QuadraticSystem, S: Sequence[Sequence[fmpq_mpoly]], sign: int) -> list[fmpq_mpoly]:
    """Return polynomials in the entries of S that vanish if S is invertible and f(S x) = sign S f(x) for all x.

    `S` holds the generators of a ring, row by row. The coefficients of div f(S x) - sign div f(x) are included: they
    are linear in S, and vanish if S is invertible and the other polynomials vanish.

    >>> s = ring(["s"]).gens()[0]
    >>> matrix_equations(QuadraticSystem.from_text(["x"], ["x^2"]), [[s]], 1)
    [s^2 - s, 2*s - 2]
    """
    n, entries = f.dim, [entry for row in S for entry in row]
    count_work(100 + 10 * n**4)
    joint_ring = ring([f"x{j}" for j in range(n)] + [f"s{k}" for k in range(n * n)])
    x, s = joint_ring.gens()[:n], joint_ring.gens()[n:]
    images = [sum((s[i * n + j] * x[j] for j in range(n)), joint_ring.constant(0)) for i in range(n)]
    *f_at_x, divergence = (p.compose(*x, ctx=joint_ring) * fmpq(sign) for p in (*f.rhs, f.divergence))
    right_sides = [sum((s[i * n + a] * f_at_x[a] for a in range(n)), joint_ring.constant(0)) for i in range(n)]
    differences = [
        p.compose(*images, ctx=joint_ring) - side
        for p, side in zip((*f.rhs, f.divergence), (*right_sides, divergence), strict=True)
    ]
    context = entries[0].context()
    values = [context.constant(0)] * n + entries
    return [c.compose(*values, ctx=context) for difference in differences for c in coefficients_in(difference, n)]


def is_singular(part: SolutionComponent, n: int) -> bool:
    """Return whether det S = 0 for all matrices S of a linear family of n x n matrices, given by entries row by row.

    >>> a = ring(["a"]).gens()[0]
    >>> is_singular(SolutionComponent((a, a, a, a)), 2), is_singular(SolutionComponent((a, a, a, -a)), 2)
    (True, False)
    """
    rows = [[*part.values[i * n : (i + 1) * n], None] for i in range(n)]
    return bool(kernel_minors(rows)[-1].is_zero())
