"""Affine integrals and invariant hyperplanes, exactly over Q, of the flow of a quadratic system.

The Kahan map has these integrals too: if v . f = 0, it conserves v . x. It maps an invariant hyperplane of the flow to
itself if, at the given eps, the map is defined at a generic point of the hyperplane (`under_map`). Let l = v . x + w be
an affine Darboux function: l' = l L along the flow with an affine cofactor L, so the hyperplane l = 0 is invariant. The
defining equation of the map then gives

    l(x~) (1 - eps L(x)) = l(x) (1 + eps L(x~)),

since v . (x~ - x)/(2 eps) is the polar form (l(x) L(x~) + l(x~) L(x))/2 of l L.

Invariant hyperplanes are found by an extactic determinant (pereira-2001): on l = 0 the Taylor coefficients x_1, x_2,
... of the solution through x are all orthogonal to v, so that l divides the polynomial det(x_1, ..., x_n). (The affine
integrals are eliminated first, since they make this determinant vanish.) The zero of l on a random line is a rational
zero of the determinant. At each rational zero the candidate v is the vector that is orthogonal to all x_k.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from flint import fmpq, fmpq_mat, fmpq_mpoly, fmpq_poly, fmpz

from kahanmaps.algebra.chance import derive_seed
from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.functions import BudgetExceeded, Function, FunctionField, FunctionMatrix
from kahanmaps.algebra.matrices import nullspace, primitive_integers, rank
from kahanmaps.algebra.polynomials import degree, evaluate, linear_combinations, primitive_part
from kahanmaps.algebra.printing import format_polynomial
from kahanmaps.algebra.work import count_work
from kahanmaps.display_protocols import ResultPart
from kahanmaps.errors import counted
from kahanmaps.maps.kahan import KahanFamily, SystemLike
from kahanmaps.systems.polynomial import PolynomialField
from kahanmaps.systems.quadratic import LONG_COEFFICIENTS, QuadraticSystem, SystemOver, as_system

# For m variables the determinant has degree m (m + 3)/2 on a line. For m = 12, degree 90, it takes a few seconds.
MAX_EXTACTIC_DIMENSION = 12
_LINE = 10**6  # bound of the modulus of the random integers that define a line
_BUDGET = 20_000_000  # products of terms, for a determinant on a hyperplane


@dataclass(frozen=True)
class AffineDarboux(ResultPart):
    """An affine function l with l' = l L along the flow: `function` is l, with coprime integers; `cofactor` is L."""

    function: fmpq_mpoly
    cofactor: fmpq_mpoly

    @property
    def text(self) -> str:
        """The function and its cofactor."""
        return f"{format_polynomial(self.function)} with cofactor {format_polynomial(self.cofactor)}"


@dataclass(frozen=True)
class AffineDarbouxList(ResultPart):
    """Exact affine Darboux functions over Q. `complete`: whether these are all; if this is unknown, `reason` says why.

    Constants and the affine integrals (cofactor 0) are left out. A `complete` list is wrong only if the random line of
    the search is parallel to an invariant hyperplane. As the direction of the line has random integers up to 10^6, this
    happens with probability below 10^-6 for a given hyperplane.
    """

    functions: tuple[AffineDarboux, ...]
    complete: bool
    reason: str

    @property
    def text(self) -> str:
        """The number of functions, and whether the list is complete."""
        completeness_text = "no others" if self.complete else self.reason
        return f"{counted(len(self.functions), 'affine Darboux function')}, {completeness_text}"


def affine_integrals(system: SystemLike) -> tuple[tuple[fmpz, ...], ...]:
    """Return a basis of all v for which v . x is conserved by the flow, hence by the Kahan map for every eps.

    Args:
        system: a quadratic system over Q.

    Returns:
        Vectors of coprime integers, a basis of { v : v . f = 0 }; exact. Source: cmoq-2013.

    >>> affine_integrals(QuadraticSystem.from_text(["x", "y"], ["x*y", "-x*y"]))
    ((1, 1),)
    """
    system = as_system(system)
    exponents = sorted({monomial for component in system.rhs for monomial in component.monoms()})
    if not exponents:
        n = system.dim
        return tuple(tuple(fmpz(int(i == j)) for j in range(n)) for i in range(n))
    rows = [[fmpq(component[monomial]) for component in system.rhs] for monomial in exponents]
    return tuple(primitive_integers(v) for v in nullspace(QQ, fmpq_mat(rows)))


@dataclass(frozen=True)
class QuotientForms:
    """The linear forms of x modulo the affine integrals z, as forms of the coordinates y = (x_i with i in `free`).

    `section` is the matrix S = dx/dy at fixed z, and `shift` is dx/dz, so that x = S y + shift z. The form v . x is
    (v S) . y modulo z. The system for y has the Jacobi matrix R S, where R consists of the rows `free` of f'.
    """

    integrals: tuple[tuple[fmpz, ...], ...]
    free: tuple[int, ...]
    section: fmpq_mat
    shift: fmpq_mat

    def rows(self, matrix: fmpq_mat) -> fmpq_mat:
        """Return the rows of a matrix that belong to the free coordinates."""
        return fmpq_mat([[matrix[i, j] for j in range(matrix.ncols())] for i in self.free])


def quotient_by(integrals: Sequence[tuple[fmpz, ...]], n: int) -> QuotientForms:
    """Return the linear forms of n variables modulo the independent forms `integrals`.

    The free coordinates are the first coordinates that complete the integrals to a basis.

    >>> quotient_by([(fmpz(1), fmpz(1), fmpz(0))], 3).free
    (0, 2)
    """
    free: list[int] = []
    rows: list[list[fmpq]] = [[fmpq(entry) for entry in vector] for vector in integrals]
    for j in range(n):
        extended_rows = [*rows, [fmpq(int(i == j)) for i in range(n)]]
        if rank(QQ, fmpq_mat(extended_rows)) == len(extended_rows):
            rows = extended_rows
            free.append(j)
    coordinates = fmpq_mat([*rows[len(integrals) :], *rows[: len(integrals)]])  # (y, z) as forms of x
    inverse = coordinates.inv()
    # The columns of the inverse that belong to y and to z: x = section y + shift z.
    section, shift = (
        fmpq_mat(n, len(columns), [inverse[i, j] for i in range(n) for j in columns])
        for columns in (range(len(free)), range(len(free), n))
    )
    return QuotientForms(tuple(integrals), tuple(free), section, shift)


def affine_darboux(system: SystemLike, *, seed: int = 0) -> AffineDarbouxList:
    """Find all invariant hyperplanes l = 0 over Q, with l and L affine and l' = l L along the flow.

    Args:
        system: a quadratic system over Q.
        seed: the random seed of the line on which candidates are computed; the functions are exact for every seed.

    Returns:
        An `AffineDarbouxList`. It has only the l among the factors of the right-hand sides, and is not complete, if the
        extactic determinant vanishes identically (there may be infinitely many l, as for x' = x, y' = y), if more than
        12 variables remain without the affine integrals, or if coefficients are very long. Source: pereira-2001.

    >>> result = affine_darboux(QuadraticSystem.from_text(["x", "y"], ["x*(2 - y)", "y*(3*x - 1)"]))
    >>> [(str(d.function), str(d.cofactor)) for d in result.functions], result.complete
    ([('x', '-y + 2'), ('y', '3*x - 1')], True)
    """
    system = as_system(system)
    n = system.dim
    quotient = quotient_by(affine_integrals(system), n)
    m = len(quotient.free)
    if m == 0:
        return AffineDarbouxList((), True, "")
    coordinates = [[fmpq(int(i == j)) for i in range(n)] for j in range(n)]

    def search_factors_only(reason: str) -> AffineDarbouxList:
        reason = f"{reason}: only factors of the right-hand sides were tried"
        return AffineDarbouxList(_affine_darboux_factors(system, coordinates), False, reason)

    if m > MAX_EXTACTIC_DIMENSION:
        return search_factors_only(f"more than {MAX_EXTACTIC_DIMENSION} variables")
    if system.digits > LONG_COEFFICIENTS:
        return search_factors_only(f"coefficients of more than {LONG_COEFFICIENTS} digits")
    over_Q = system.over(QQ)
    # A line parallel to a hyperplane does not meet it. The seed depends on the system, so that nobody can choose a
    # system with hyperplanes parallel to the line.
    rng = random.Random(f"affine {derive_seed(seed, system.rhs)}")
    start, direction = ([fmpq(rng.randint(-_LINE, _LINE)) for _ in range(n)] for _ in range(2))
    determinant_on_line = _interpolate_determinant(over_Q, start, direction, quotient.free)
    if determinant_on_line.degree() < 0:
        return search_factors_only("the extactic determinant vanishes identically, there may be infinitely many")
    is_complete = True
    candidates = list[list[fmpq]]()
    for t in _rational_roots(determinant_on_line):
        x = [a + t * d for a, d in zip(start, direction, strict=True)]
        normals = nullspace(QQ, _taylor_rows(over_Q, x, quotient.free))
        if len(normals) > 1:
            # The Taylor coefficients do not determine the normal v of l = 0. It is a combination of these vectors, and
            # a left eigenvector of f'(x), since v f'(x) = L(x) v on l = 0.
            basis = fmpq_mat([list(v) for v in normals])
            action = quotient.rows(over_Q.jacobian(x)) * quotient.section
            normals = []
            for eigenvalue in _rational_roots(fmpq_poly(action.charpoly().coeffs())):
                combinations = nullspace(QQ, (basis * action - basis * eigenvalue).transpose())
                is_complete = is_complete and len(combinations) <= 1
                normals += [tuple((fmpq_mat([list(c)]) * basis).entries()) for c in combinations]
        for v in normals:
            entries = dict(zip(quotient.free, v, strict=True))
            candidates.append([entries.get(i, fmpq(0)) for i in range(n)])
    reason = "" if is_complete else "the flow degenerates on an invariant hyperplane: there may be further ones"
    return AffineDarbouxList(_affine_darboux_factors(system, candidates), is_complete, reason)


def _taylor_rows(over_Q: SystemOver, x: Sequence[fmpq], free: Sequence[int]) -> fmpq_mat:
    """Return the coordinates `free` of the first len(free) Taylor coefficients of the solution through x, as rows."""
    series = [fmpq_mat(over_Q.dim, 1, list(x))]
    forms: list[fmpq_mat] = []
    for k in range(len(free)):
        forms.append(over_Q.hessian_times(series[k].entries()))
        derivative = over_Q.B * series[k] + (over_Q.c if k == 0 else over_Q.c * 0)
        for a in range(k + 1):
            derivative = derivative + forms[a] * series[k - a] * fmpq(1, 2)
        series.append(derivative * fmpq(1, k + 1))
    return fmpq_mat([[column[i, 0] for i in free] for column in series[1:]])


def _interpolate_determinant(
    over_Q: SystemOver, start: Sequence[fmpq], direction: Sequence[fmpq], free: Sequence[int]
) -> fmpq_poly:
    """Interpolate the extactic determinant at start + t direction as a polynomial in t."""
    m = len(free)
    count_work(1000 + 3 * m**5)  # for the complete search for hyperplanes, whose main part is this determinant
    nodes = range(m * (m + 3) // 2 + 1)
    values = [
        _taylor_rows(over_Q, [a + t * d for a, d in zip(start, direction, strict=True)], free).det() for t in nodes
    ]
    # Divided differences at 0, 1, 2, ...
    for k in range(1, len(values)):
        differences = [(next_value - value) / k for value, next_value in pairwise(values[k - 1 :])]
        values[k:] = differences
    determinant = fmpq_poly([])
    for t in reversed(nodes):
        determinant = determinant * fmpq_poly([-t, 1]) + values[t]
    return determinant


def _rational_roots(polynomial: fmpq_poly) -> list[fmpq]:
    return [-factor[0] / factor[1] for factor, _ in polynomial.factor()[1] if factor.degree() == 1]


def _affine_darboux_factors(system: QuadraticSystem, normals: Sequence[Sequence[fmpq]]) -> tuple[AffineDarboux, ...]:
    """Return the affine Darboux functions among the factors of v . f, for all v in `normals`; l divides l' = v . f."""
    functions: dict[str, AffineDarboux] = {}
    for normal in normals:
        (component,) = linear_combinations(fmpq_mat([list(normal)]), system.rhs)
        if component.is_zero():
            continue
        for factor, _ in component.factor()[1]:
            if degree(factor) == 1:
                function = primitive_part(factor)[1]
                cofactor = darboux_cofactor(system, function)
                if cofactor is not None and not cofactor.is_zero():
                    functions[str(function)] = AffineDarboux(function, cofactor)
    return tuple(sorted(functions.values(), key=lambda d: _coefficients(d.function), reverse=True))


def darboux_cofactor(system: PolynomialField, function: fmpq_mpoly) -> fmpq_mpoly | None:
    """Return the polynomial L with l' = l L along the flow for a nonzero polynomial l = `function`, or None. Exact.

    >>> system = QuadraticSystem.from_text(["x", "y"], ["x*y", "x"])
    >>> x, y = system.rhs[1].context().gens()
    >>> darboux_cofactor(system, x), darboux_cofactor(system, y)
    (y, None)
    """
    quotient, remainder = divmod(system.derivative(function), function)
    return quotient if remainder.is_zero() else None


def under_map(system: QuadraticSystem, function: fmpq_mpoly, eps: fmpq) -> str:
    """Decide how the Kahan map at eps acts on an invariant hyperplane of the flow; exact.

    Args:
        system: a quadratic system over Q, whose map at eps is birational.
        function: an affine Darboux function l of the flow.
        eps: half the time step, an exact number.

    Returns:
        "invariant" if det(I - eps f') and det(I + eps f') are not identically 0 on l = 0: the restriction of the map to
        the hyperplane is birational then. "undefined" if det(I - eps f') is 0 there; "contracted" if det(I + eps f') is
        0 there, so that the image of l = 0 has a lower dimension; "undecided" if a determinant is too long to expand.

    >>> system = QuadraticSystem.from_text(["x", "y"], ["x*(1 - y)", "y*(x - 1)"])
    >>> x, y = system.rhs[0].context().gens()
    >>> [under_map(system, l, fmpq(eps)) for eps in (1, -1, 2) for l in (x, y)]
    ['contracted', 'undefined', 'undefined', 'contracted', 'invariant', 'invariant']
    """
    n, context = system.dim, function.context()
    *coefficients, _ = _coefficients(function)
    k = next(i for i, c in enumerate(coefficients) if c != 0)
    images = list(context.gens())
    images[k] = images[k] - function / coefficients[k]  # solves l = 0 for x_k
    rng = random.Random("a point of the hyperplane")
    coordinates = [fmpq(rng.randint(-_LINE, _LINE)) for _ in range(n)]
    point = [evaluate(x, QQ, coordinates) for x in images]
    for outcome, signed_eps in (("undefined", eps), ("contracted", -eps)):
        if KahanFamily(system).at(signed_eps).determinant(point) != 0:  # a nonzero value at one point suffices
            continue
        field, one = FunctionField(system.variables, _BUDGET), context.constant(1)
        entries = [
            Function(field, int(i == j) - f.derivative(j).compose(*images, ctx=context) * signed_eps, one)
            for i, f in enumerate(system.rhs)
            for j in range(n)
        ]
        try:
            if FunctionMatrix(field, n, n, entries).det().numerator.is_zero():
                return outcome
        except BudgetExceeded:
            return "undecided"
    return "invariant"


def _coefficients(function: fmpq_mpoly) -> list[fmpq]:
    """Return the coefficients of an affine function: first of the variables, then the constant."""
    n = function.context().nvars()
    return [fmpq(function[tuple(int(i == j) for i in range(n))]) for j in range(n + 1)]
