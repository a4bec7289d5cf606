"""Search the catalogue for a system g that is affinely equivalent to a given system f: g(P x + q) = c P f(x).

P is an invertible matrix, q a vector, c a number. With y = P x + q the system x' = f(x) becomes y' = g(y)/c. Kahan's
method is equivariant under affine changes of variables: the map of f at eps is the map of g at eps/c, in the variables
y. In dimension 2 all P are tried. In other dimensions P = c T F. Here F is I or a basis from invariant hyperplanes or
lines of fixed points of f, and T is a permutation matrix, in dimension at most 5 also a product of one with a diagonal
matrix. Parameters of g are unknowns too. Every equivalence is verified exactly; if none is found, one may still exist.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly, fmpq_mpoly_ctx

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.polynomials import evaluate, linear_combinations, ring
from kahanmaps.algebra.printing import attributes, format_number, format_polynomial
from kahanmaps.algebra.small_systems import solve_system
from kahanmaps.algebra.work import Budget, count_work
from kahanmaps.display_protocols import ResultPart
from kahanmaps.documents.catalog import load, names, titles
from kahanmaps.documents.files import SystemFile
from kahanmaps.documents.inline import as_file
from kahanmaps.documents.symbols import with_symbols
from kahanmaps.laboratory.defaults import budget_for
from kahanmaps.laboratory.preserve.darboux.affine_functions import affine_darboux
from kahanmaps.laboratory.vector_field.fixed_points import FixedPointSearch, fixed_points
from kahanmaps.maps.kahan import SystemLike
from kahanmaps.systems.quadratic import LONG_COEFFICIENTS, QuadraticSystem

MAX_DIMENSION = 6  # there are 6! = 720 permutations of the variables
MAX_SCALED = 5  # the largest dimension for scaled permutations; in higher dimensions a Groebner basis may take a minute
MAX_ORDERS = 24  # permutations that are tried for each pair of F and g; the monomials may allow all 720
MAX_FRAMES = 6  # matrices F from invariant hyperplanes, and as many from lines of fixed points
_MAX_DEPTH = 4  # the number of unknowns that are set to numbers if there are infinitely many solutions

Monomials = frozenset[tuple[int, ...]]


@dataclass(frozen=True)
class Equivalence(ResultPart):
    """An equivalence g(P x + q) = c P f(x) of f with the system g called `name` in the catalogue, at `parameters`."""

    name: str
    parameters: dict[str, fmpq]
    variables: tuple[str, ...]
    P: fmpq_mat
    q: tuple[fmpq, ...]
    c: fmpq
    file: SystemFile | None = field(default=None, repr=False, compare=False)  # the file of f

    @property
    def system(self) -> QuadraticSystem:
        """The system y' = g(y)/c, with the variable names of f; its map at eps is the map of g at eps/c."""
        return load(self.name, self.parameters).system.renamed(self.variables).scaled(1 / self.c)

    @property
    def text(self) -> str:
        """A phrase with the name and the parameters of g, the change of variables and the change of eps."""
        values = ", ".join(f"{name} = {format_number(value)}" for name, value in self.parameters.items())
        images = linear_combinations(self.P, ring(self.variables).gens())
        point = ", ".join(format_polynomial(image + q) for image, q in zip(images, self.q, strict=True))
        change_text = f"after ({', '.join(self.variables)}) -> ({point})"
        if self.P == QQ.identity(len(self.q)) and not any(e != 0 for e in self.q):
            change_text = "with its variables called " + ", ".join(self.variables)
        factor_text = "-" if self.c == -1 else f"{format_number(1 / self.c)}*"
        eps_text = "" if self.c == 1 else f", with {factor_text}eps in place of eps"
        return f"equivalent to {self.name}{f' at {values}' if values else ''} {change_text}{eps_text}"

    def __str__(self) -> str:
        return self.text

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return attributes(self, "name", "parameters", "P", "q", "c", "text")


def equivalent_system(
    system: SystemLike, fixed: FixedPointSearch | None = None, effort: int | Budget = 1
) -> Equivalence | None:
    """Search the catalogue for a system that is affinely equivalent to `system`; return None if none was found.

    Args:
        system: a quadratic system; for a system that is itself in the catalogue, None is returned.
        fixed: the fixed points of `system`, if they are known; lines of fixed points give candidates for P.
        effort: each increase by 1 doubles the work limit.

    Returns:
        The equivalence, verified exactly.

    >>> from kahanmaps.documents.inline import System
    >>> print(equivalent_system(System("x' = 3*y*z; y' = x*z; z' = -x*y")))
    equivalent to euler_top at a1 = 3, a2 = 1, a3 = -1 with its variables called x, y, z
    """
    file = as_file(system)
    f = file.system
    if f.degree < 2 or f.dim > MAX_DIMENSION or f.digits > LONG_COEFFICIENTS:
        return None
    if file.name in names():  # the system may be from the catalogue itself
        values = file.parameters if load(file.name).parameters.keys() == file.parameters.keys() else {}
        if load(file.name, values).system.rhs == file.system.rhs:
            return None
    # A candidate is a system g, a matrix F, and a permutation for T; None instead of the permutation: T is any matrix.
    catalogue, candidates = _load_catalogue(f.dim), list[tuple[_CatalogueSystem, fmpq_mat, tuple[int, ...] | None]]()
    budget = budget_for("equivalent systems", effort)
    for frame in _candidate_frames(f, fixed_points(f, budget.part(0.5)) if fixed is None else fixed):
        monomials = _quadratic_monomials(f.composed(frame.inv(), [fmpq(0)] * f.dim).transformed(frame))
        for g in catalogue:
            if sorted(map(len, monomials)) != sorted(map(len, g.monomials)):
                continue
            # The permutations that turn the quadratic monomials of each right-hand side of f into those of g.
            permutations = list[tuple[int, ...]]()
            for order in itertools.permutations(range(f.dim)):
                inverse = sorted(range(f.dim), key=order.__getitem__)
                images = ({tuple(m[j] for j in inverse) for m in support} for support in monomials)
                if all(g.monomials[i] == image for image, i in zip(images, order, strict=True)):
                    permutations.append(order)
                if len(permutations) == MAX_ORDERS:
                    break
            candidates += ((g, frame, order) for order in permutations)
    if f.dim == 2:
        candidates += ((g, QQ.identity(2), None) for g in catalogue)
    for is_scaled in (False, True) if f.dim <= MAX_SCALED else (False,):  # without scaling the search is faster
        for g, frame, permutation in candidates:
            if budget.is_spent:
                return None
            if (equivalence := _solve_for_equivalence(f, g, frame, permutation, is_scaled, budget)) is not None:
                return replace(equivalence, file=file)
    return None


@dataclass(frozen=True)
class _CatalogueSystem:
    """A system of the catalogue with parameters as symbols, and the quadratic monomials of each right-hand side."""

    name: str
    system: QuadraticSystem
    defaults: dict[str, fmpq]
    monomials: tuple[Monomials, ...]


@lru_cache(maxsize=MAX_DIMENSION)
def _load_catalogue(dim: int) -> tuple[_CatalogueSystem, ...]:
    """Return the quadratic systems of the catalogue in one dimension, ordered by their number of parameters.

    A system with more than dim + 2 parameters is left out: nearly every vector field is equivalent to a member of it.
    """
    systems, titles_by_name = [], titles()
    for name in names():
        if titles_by_name[name][0] != dim:
            continue
        file = load(name)
        if len(file.parameters) <= dim + 2:
            system = with_symbols(file, tuple(file.parameters))
            if system.degree >= 2:
                systems.append(_CatalogueSystem(name, system, dict(file.parameters), _quadratic_monomials(system)))
    return tuple(sorted(systems, key=lambda catalogue_system: len(catalogue_system.defaults)))


def _quadratic_monomials(f: QuadraticSystem) -> tuple[Monomials, ...]:
    n = f.dim
    return tuple(frozenset(tuple(m[:n]) for m in p.monoms() if sum(m[:n]) == 2) for p in f.rhs)


def _candidate_frames(f: QuadraticSystem, search: FixedPointSearch) -> Iterator[fmpq_mat]:
    """Yield matrices F, beginning with I; in coordinates F x, f may have the monomials of a system of the catalogue."""
    n = f.dim

    def linear_coefficients(p: fmpq_mpoly) -> list[fmpq]:
        """Return the coefficients of the variables in a polynomial of degree 1."""
        return [p.derivative(j)[(0,) * p.context().nvars()] for j in range(p.context().nvars())]

    yield QQ.identity(n)
    normals = [linear_coefficients(affine.function) for affine in affine_darboux(f).functions]
    yield from itertools.islice(_bases_among(normals, n), MAX_FRAMES)
    lines = [component for component in search.fixed_points if component.dimension == 1 and not component.equations]
    directions = [[sum(linear_coefficients(value), fmpq(0)) for value in line.coordinates] for line in lines]
    yield from (columns.transpose().inv() for columns in itertools.islice(_bases_among(directions, n), MAX_FRAMES))


def _bases_among(vectors: Sequence[Sequence[fmpq]], n: int) -> Iterator[fmpq_mat]:
    """Yield the invertible matrices whose rows are n of the vectors."""
    matrices = (fmpq_mat([list(row) for row in rows]) for rows in itertools.combinations(vectors, n))
    return (matrix for matrix in matrices if matrix.det() != 0)


def _solve_for_equivalence(
    f: QuadraticSystem,
    g: _CatalogueSystem,
    frame: fmpq_mat,
    order: Sequence[int] | None,
    is_scaled: bool,
    budget: Budget,
) -> Equivalence | None:
    """Solve g(P x + q) = c P f(x) for P = c T F, where F is the frame.

    T is the permutation matrix of `order`, scaled if `is_scaled`; if `order` is None, T is any matrix. For this P the
    equations from the quadratic terms in x contain neither c nor q. They are solved first.
    """
    n = f.dim
    count_work(300 * n)
    entries = [(i, j) for i in range(n) for j in range(n) if order is None or order[j] == i]
    # The order of the unknowns: if there are infinitely many solutions, earlier unknowns are set to defaults first.
    entry_names = [f"t{i}{j}" for i, j in entries]
    unknowns = ring(["c", *(f"q{i}" for i in range(n)), *entry_names, *(f"a{k}" for k in g.defaults)])
    defaults = [fmpq(1), *[fmpq(0)] * n, *(fmpq(int(order is not None or i == j)) for i, j in entries)]
    defaults += g.defaults.values()
    highest_equations, lower_equations = _equivalence_equations(f, g, frame, entries, unknowns)
    # In the first attempt c, q and T have their default values: the equations for the parameters are usually linear.
    default_equations = [t - value for t, value in zip(unknowns.gens(), defaults, strict=True)]
    fixed_shift, fixed_scale = default_equations[: n + 1], default_equations[n + 1 :][: len(entries)]
    shift = fixed_shift if f.is_homogeneous and g.system.is_homogeneous else []
    for conditions in (shift,) if is_scaled else ([*fixed_shift, *fixed_scale], [*shift, *fixed_scale]):
        solutions = solve_system([*highest_equations, *conditions], unknowns.gens(), budget)
        for component in (*solutions.components, *solutions.unsolved):
            equations = [p.compose(*component.values, ctx=unknowns) for p in lower_equations]
            for point in _rational_solutions([*equations, *component.equations], component.values, defaults, budget):
                c, q, values = point[0], point[1 : n + 1], point[n + 1 + len(entries) :]
                T = fmpq_mat(n, n)
                for (i, j), t in zip(entries, point[n + 1 :], strict=False):
                    T[i, j] = t
                P = T * frame * c
                if c != 0 and P.det() != 0:
                    candidate = (g.system.at(values) if values else g.system).renamed(f.variables)
                    if candidate.composed(P, q).rhs == f.transformed(P).scaled(c).rhs:
                        parameters = dict(zip(g.defaults, values, strict=True))
                        return Equivalence(g.name, parameters, f.variables, P, tuple(q), c)
    return None


def _equivalence_equations(
    f: QuadraticSystem,
    g: _CatalogueSystem,
    frame: fmpq_mat,
    entries: Sequence[tuple[int, int]],
    unknowns: fmpq_mpoly_ctx,
) -> tuple[list[fmpq_mpoly], list[fmpq_mpoly]]:
    """Return the coefficients of g(P x + q) - c P f(x) as two lists: for degree 2 in x, and for lower degrees in x.

    The coefficients of div g(P x + q) - c div f(x) are added: they vanish for each solution, and their degree is lower.
    """
    n = f.dim
    joint = ring([*(f"x{i}" for i in range(n)), *unknowns.names()])
    x, c, q = joint.gens()[:n], joint.gens()[n], joint.gens()[n + 1 : 2 * n + 1]
    zero, T = joint.constant(0), [[joint.constant(0)] * n for _ in range(n)]
    for (i, j), t in zip(entries, joint.gens()[2 * n + 1 :], strict=False):
        T[i][j] = t
    P0 = [[sum((T[i][k] * frame[k, j] for k in range(n)), zero) for j in range(n)] for i in range(n)]
    images = [sum((P0[i][j] * c * x[j] for j in range(n)), q[i]) for i in range(n)]
    images += joint.gens()[2 * n + 1 + len(entries) :]  # the parameters of g
    f_at_x = [p.compose(*x, ctx=joint) for p in f.rhs]
    sides = [sum((P0[i][j] * f_at_x[j] for j in range(n)), zero) * c * c for i in range(n)]
    differences = [p.compose(*images, ctx=joint) - side for p, side in zip(g.system.rhs, sides, strict=True)]
    differences.append(g.system.divergence.compose(*images, ctx=joint) - f.divergence.compose(*x, ctx=joint) * c)
    highest_equations: list[fmpq_mpoly] = []
    lower_equations: list[fmpq_mpoly] = []
    for k, difference in enumerate(differences):
        terms_by_monomial: dict[tuple[int, ...], dict[tuple[int, ...], fmpq]] = {}  # keys: monomials in x
        for monomial, value in difference.terms():
            exponents = tuple(int(e) for e in monomial)
            terms_by_monomial.setdefault(exponents[:n], {})[exponents[n:]] = value
        for x_exponents, terms in terms_by_monomial.items():  # the coefficient is divisible by c^degree
            degree = sum(x_exponents)
            equation = unknowns.from_dict(terms) / unknowns.gen(0) ** degree
            (highest_equations if degree == (2 if k < n else 1) else lower_equations).append(equation)
    return highest_equations, lower_equations


def _rational_solutions(
    equations: Sequence[fmpq_mpoly],
    values: Sequence[fmpq_mpoly],
    defaults: Sequence[fmpq],
    budget: Budget,
    depth: int = 0,
) -> Iterator[list[fmpq]]:
    """Yield the `values` at rational zeros of the equations; of each family of zeros only one is used."""
    context = values[0].context()
    solutions = solve_system([p for p in equations if not p.is_zero()], values, budget)
    for component in solutions.components:
        yield [evaluate(value, QQ, defaults) for value in component.values]
    for unsolved in solutions.unsolved if depth < _MAX_DEPTH and not budget.is_spent else ():
        i = unsolved.free[0]
        for value in (defaults[i], defaults[i] + 1):
            fixed_equations = [*unsolved.equations, context.gen(i) - value]
            yield from _rational_solutions(fixed_equations, unsolved.values, defaults, budget, depth + 1)
