"""All rational solutions of a small system of polynomial equations over Q, exactly, by factoring and branching.

The solver branches on the factors of an equation and substitutes linear equations. If no equation factors, it computes
a Groebner basis of bounded size. If the solutions are finite in number, it then uses the matrix of multiplication by a
linear form in the quotient ring: the values of the form at the rational solutions are rational eigenvalues of the
matrix. The result also contains linear families with free variables, equations that could not be solved, and
descriptions of the solutions that are not rational. No step discards a rational solution.

FLINT cannot be interrupted, so each operation is bounded in size: Groebner bases are computed one S-polynomial
after the other, and polynomials in several variables are factored only up to a bounded number of terms. All operations
count as work, in units fitted to measurements.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from heapq import heappop, heappush
from math import sqrt
from typing import Any

from flint import Ordering, fmpq, fmpq_mat, fmpq_mpoly, fmpz_mpoly, fmpz_mpoly_ctx, fmpz_mpoly_vec

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.matrices import nullspace
from kahanmaps.algebra.polynomials import common_denominator, degree, evaluate, names_of, primitive_part
from kahanmaps.algebra.work import SPENT, Budget, count_work

MAX_BASIS = 120  # polynomials in a Groebner basis
MAX_TERMS = 400  # terms of a polynomial in a Groebner basis
MAX_BITS = 4_000  # bits of a coefficient in a Groebner basis
MAX_FACTORED = 5_000  # terms of a polynomial in several variables that is factored (about 20 ms)
MAX_PARTS = 400  # points, families and unsolved parts together
MAX_QUOTIENT = 130  # dimension of the quotient ring: the number of complex solutions with multiplicity


@dataclass(frozen=True)
class SolutionComponent:
    """A set of solutions: `values` gives each variable as a polynomial of degree at most 1 in the free variables.

    `equations` are conditions on the free variables; without equations the set is a linear family or a point.
    """

    values: tuple[fmpq_mpoly, ...]
    equations: tuple[fmpq_mpoly, ...] = ()

    @property
    def free(self) -> tuple[int, ...]:
        """The indices of the free variables."""
        degrees = [polynomial.degrees() for polynomial in (*self.values, *self.equations)]
        return tuple(i for i, column in enumerate(zip(*degrees, strict=True)) if max(column) > 0)

    @property
    def point(self) -> tuple[fmpq, ...]:
        """The solution in which all free variables are 0."""
        zero = (0,) * self.values[0].context().nvars()
        return tuple(value[zero] if not value.is_zero() else fmpq(0) for value in self.values)

    def direction(self, i: int) -> list[fmpq]:
        """Return the derivative of the values with respect to the free variable i."""
        return [v.derivative(i).leading_coefficient() if v.degrees()[i] else fmpq(0) for v in self.values]

    def contains(self, other: SolutionComponent) -> bool:
        """Whether this linear family contains `other`, a linear family or a point."""
        directions = [self.direction(i) for i in self.free]
        offset = [a - b for a, b in zip(other.point, self.point, strict=True)]
        vectors = [*directions, offset, *(other.direction(i) for i in other.free)]
        return int(fmpq_mat(vectors).rank()) == len(directions)


@dataclass
class Solutions:
    """The result of `solve_system`: `components` are linear families and points, `unsolved` the parts not solved.

    `conjugate` lists the parts without a rational point; `irrational` describes them, in the same order.
    """

    components: list[SolutionComponent] = field(default_factory=list)
    unsolved: list[SolutionComponent] = field(default_factory=list)
    conjugate: list[SolutionComponent] = field(default_factory=list)
    irrational: list[str] = field(default_factory=list)
    without_basis: list[SolutionComponent] = field(default_factory=list)  # parts whose Groebner basis was too large
    reason: str = ""  # why some part is unsolved

    @property
    def complete(self) -> bool:
        """Whether every rational solution is in one of `components`."""
        return not self.unsolved


def solve_system(equations: Sequence[fmpq_mpoly], variables: Sequence[fmpq_mpoly], budget: Budget) -> Solutions:
    """Solve `equations` = 0 over Q, for polynomials in the ring whose generators are `variables`.

    Exact. Parts that are not yet solved when the `budget` is spent are returned as unsolved.

    >>> from kahanmaps.algebra.polynomials import ring
    >>> x, y = ring(["x", "y"]).gens()
    >>> solutions = solve_system([x**2 - 1, x*y - y], (x, y), Budget())
    >>> [component.values for component in solutions.components]
    [(-1, 0), (1, y)]
    >>> solve_system([x**2 - 2, y], (x, y), Budget()).irrational
    ['x^2 - 2']
    """
    solver = _Solver(budget)
    solver.solve(list(equations), tuple(variables))
    solutions = solver.solutions
    solutions.components = maximal_components(solutions.components)
    solutions.irrational = list(dict.fromkeys(solutions.irrational))
    return solutions


def echelon_basis(polynomials: Iterable[fmpq_mpoly]) -> list[fmpq_mpoly]:
    """Return the reduced echelon basis of the linear span, with coprime integer coefficients.

    >>> from kahanmaps.algebra.polynomials import ring
    >>> x, y = ring(["x", "y"]).gens()
    >>> echelon_basis([x**2 + x, x**2 + y, x - y])
    [x^2 + y, x - y]
    """
    nonzero_polynomials = [p for p in polynomials if not p.is_zero()]
    if not nonzero_polynomials:
        return []
    context = nonzero_polynomials[0].context()
    # A sum of all the monomials lists them in the order of the ring.
    monomials = context.from_dict({m: fmpq(1) for p in nonzero_polynomials for m in p.monoms()}).monoms()
    monomial_column = {tuple(m): k for k, m in enumerate(monomials)}
    count_work(20 + 7 * sum(map(len, nonzero_polynomials)) + len(nonzero_polynomials) ** 2 * len(monomial_column) / 30)
    matrix = fmpq_mat(len(nonzero_polynomials), len(monomial_column))
    for i, p in enumerate(nonzero_polynomials):
        for monomial, value in p.terms():
            matrix[i, monomial_column[tuple(monomial)]] = value
    echelon_form, rank = matrix.rref()
    basis = []
    for i in range(rank):
        row = {m: echelon_form[i, k] for k, m in enumerate(monomials) if echelon_form[i, k] != 0}
        basis.append(primitive_part(context.from_dict(row))[1])
    return basis


def normal_form(p: fmpq_mpoly, basis: Sequence[fmpq_mpoly]) -> fmpq_mpoly:
    """Return the remainder on division by all polynomials of `basis`: the normal form, for a Groebner basis.

    >>> from kahanmaps.algebra.polynomials import ring
    >>> x, y = ring(["x", "y"]).gens()
    >>> normal_form(x**2*y + x, [x*y - 1])
    2*x
    """
    context = p.context()
    remainder = context.constant(0)
    leading_monomials = [(tuple(g.monoms()[0]), g) for g in basis]
    while not p.is_zero():
        leading_exponents, leading_coefficient = tuple(p.monoms()[0]), p.leading_coefficient()
        count_work(10 + len(p) + len(leading_monomials) / 2)
        for divisor, g in leading_monomials:
            if all(a <= b for a, b in zip(divisor, leading_exponents, strict=True)):
                cofactor = context.from_dict(
                    {tuple(b - a for a, b in zip(divisor, leading_exponents, strict=True)): fmpq(1)}
                )
                p = p - g * cofactor * (leading_coefficient / g.leading_coefficient())
                break
        else:
            leading_term = context.from_dict({leading_exponents: leading_coefficient})
            remainder, p = remainder + leading_term, p - leading_term
    return remainder


def decoupling(forms: Sequence[fmpq_mpoly], count: int) -> fmpq_mat | None:
    """Return T such that the cubic forms may decouple in the `count` variables y, x = T y; None if no T was found.

    If the span of the forms has a basis whose elements depend on disjoint sets of coordinates, the Hessians of all
    forms in the span are block diagonal in these coordinates. The blocks are the kernels of p(M), where M is the
    quotient of two Hessians and p a factor of its characteristic polynomial. Any invertible T is a correct answer for
    the caller; the T returned is checked with a third Hessian.
    """
    if not forms or count < 2:
        return None
    rng = random.Random("decoupling")

    def hessian() -> fmpq_mat:
        """Return the Hessian of a random combination of the forms at a random point."""
        total = forms[0].context().constant(0)
        for p in forms:
            total = total + p * fmpq(rng.randint(1, 99))
        point = [fmpq(rng.randint(-99, 99)) for _ in range(count)]
        second_derivatives = (total.derivative(i).derivative(j) for i in range(count) for j in range(count))
        return fmpq_mat(count, count, [evaluate(p, QQ, point) for p in second_derivatives])

    first_hessian = hessian()
    if first_hessian.det() == 0:
        return None
    ratio = first_hessian.solve(hessian())
    _, factors = ratio.charpoly().factor()
    blocks = []
    for factor, multiplicity in factors:
        annihilator = fmpq_mat(count, count)
        power = QQ.identity(count)
        for coefficient in (factor**multiplicity).coeffs():
            annihilator = annihilator + power * coefficient
            power = power * ratio
        blocks.append(nullspace(QQ, annihilator))
    T = fmpq_mat([list(column) for block in blocks for column in block]).transpose()
    # Return None unless the forms decouple: other coordinates would only make their coefficients longer.
    block_of = [k for k, block in enumerate(blocks) for _ in block]
    T_hessian = T.transpose() * hessian() * T
    is_decoupled = all(T_hessian[i, j] == 0 for i in range(count) for j in range(count) if block_of[i] != block_of[j])
    return T if is_decoupled and len(blocks) > 1 else None


class _Solver:
    """The recursion of `solve_system`; `stop_reason` is empty until a limit ends the recursion."""

    def __init__(self, budget: Budget) -> None:
        self.budget = budget
        self.solutions = Solutions()
        self.stop_reason = ""

    def solve(self, equations: list[fmpq_mpoly], values: tuple[fmpq_mpoly, ...], is_basis: bool = False) -> None:
        """Add the solutions of `equations` to the result; `is_basis` says that they are a Groebner basis."""
        if self.stop_reason:  # the reason is already in the result
            return
        count_work(50)
        original_equations = [p for p in equations if not p.is_zero()]
        equations = equations if is_basis else echelon_basis(equations)
        if len(original_equations) > len(equations):
            original_equations = equations
        if any(p.is_constant() for p in equations):
            return
        if not equations:
            self.solutions.components.append(SolutionComponent(values))
            return
        if self.budget.is_spent:
            self.stop_reason = SPENT
        elif len(self.solutions.components) + len(self.solutions.unsolved) > MAX_PARTS:
            self.stop_reason = f"there are more than {MAX_PARTS} parts"
        if self.stop_reason:
            self._give_up(equations, values, self.stop_reason)
            return
        for p in sorted(equations, key=degree):
            if degree(p) == 1:
                context = p.context()
                gens, k = list(context.gens()), max(i for i, e in enumerate(p.degrees()) if e)
                gens[k] = gens[k] - p / p.derivative(k).leading_coefficient()
                count_work(sum(20 + len(q) * len(p) for q in (*original_equations, *values)))
                new_equations = [q.compose(*gens, ctx=context) for q in original_equations]
                self.solve(new_equations, tuple(q.compose(*gens, ctx=context) for q in values))
                return
        # Equations that factor (such as x f, y g, z h) may have an echelon basis that does not factor, so try both.
        factors = _factors_to_branch_on(equations) or _factors_to_branch_on(original_equations)
        if factors is not None:
            for factor in sorted(factors, key=lambda q: (degree(q), str(q))):
                # Pass on remainders modulo the factor: otherwise the solver would branch on the same product again.
                self.solve([factor, *(divmod(p, factor)[1] for p in original_equations)], values)
            return
        for p in equations:
            if sum(e > 0 for e in p.degrees()) == 1:  # in one variable, irreducible and not linear: no rational root
                self._no_rational_point(str(primitive_part(p)[1]), equations, values)
                return
        if is_basis:
            self._solve_finite(equations, values)
            return
        basis = groebner(equations, self.budget)
        if basis is None:
            self._give_up(equations, values, SPENT if self.budget.is_spent else "a Groebner basis would be too large")
            self.solutions.without_basis.append(SolutionComponent(values, tuple(equations)))
            return
        self.solve(basis, values, is_basis=True)

    def _solve_finite(self, basis: list[fmpq_mpoly], values: tuple[fmpq_mpoly, ...]) -> None:
        """Branch on the rational values of a linear form if the Groebner basis shows finitely many solutions."""
        unknowns = sorted({i for p in basis for i, e in enumerate(p.degrees()) if e})
        quotient = quotient_monomials(basis, unknowns)
        if quotient is None:
            self._give_up(basis, values, "the solutions are not isolated points, and not linear families")
            return
        if len(quotient) > MAX_QUOTIENT:
            self._give_up(basis, values, f"there are {len(quotient)} solutions over the complex numbers")
            return
        gens = basis[0].context().gens()
        form = sum((gens[i] * (k * k + 1) for k, i in enumerate(unknowns)), basis[0].context().constant(0))
        context, monomial_index = form.context(), {m: k for k, m in enumerate(quotient)}
        matrix = fmpq_mat(len(quotient), len(quotient))  # multiplication by the form in the quotient ring
        for k, m in enumerate(quotient):
            if self.budget.is_spent:
                self._give_up(basis, values, SPENT)
                return
            for monomial, value in normal_form(form * context.from_dict({m: fmpq(1)}), basis).terms():
                matrix[monomial_index[tuple(int(e) for e in monomial)], k] = value
        size = max((max(abs(e.p), e.q).bit_length() for e in matrix.entries()), default=1)
        count_work(20 + len(quotient) ** 3 * size / 200)
        _, factors = matrix.charpoly().factor()
        for factor, _ in factors:
            if factor.degree() > 1:
                text = f"groups of {factor.degree()} conjugate solutions"
                # Evaluate the factor at the form within the quotient ring: expanded, it may have millions of terms.
                vector = fmpq_mat(len(quotient), 1)
                for coefficient in reversed(factor.coeffs()):
                    vector = matrix * vector
                    vector[0, 0] += coefficient
                factor_value = context.from_dict(dict(zip(quotient, vector.entries(), strict=True)))
                self._no_rational_point(text, [*basis, factor_value], values)
            else:
                self.solve([*basis, form + factor[0] / factor[1]], values)

    def _no_rational_point(self, text: str, equations: Sequence[fmpq_mpoly], values: tuple[fmpq_mpoly, ...]) -> None:
        self.solutions.irrational.append(text)
        self.solutions.conjugate.append(SolutionComponent(values, tuple(equations)))

    def _give_up(self, equations: Sequence[fmpq_mpoly], values: tuple[fmpq_mpoly, ...], reason: str) -> None:
        component = SolutionComponent(values, tuple(equations))
        if component not in self.solutions.unsolved:
            self.solutions.unsolved.append(component)
        self.solutions.reason = reason


def _factors_to_branch_on(equations: Sequence[fmpq_mpoly]) -> list[fmpq_mpoly] | None:
    """Return the factors of the equation whose largest factor has the least degree; None if no equation factors."""
    # Factors of high degree lead to long branches.
    products = []
    for p in equations:
        variable_count = sum(e > 0 for e in p.degrees())
        if variable_count == 1:
            bits = max(max(abs(c.p), c.q).bit_length() for c in p.coeffs())
            count_work(40 + degree(p) ** 2 * (1 + bits / 200) / 2)
        elif len(p) <= MAX_FACTORED:
            count_work(60 + 5 * variable_count**2 + 3 * len(p))
        else:
            continue
        products.append(p.factor()[1])
    factor_lists = [[factor for factor, _ in powers] for powers in products if len(powers) > 1 or powers[0][1] > 1]
    return min(factor_lists, key=lambda factors: (max(map(degree, factors)), sum(map(len, factors))), default=None)


def groebner(equations: Sequence[fmpq_mpoly], budget: Budget) -> list[fmpq_mpoly] | None:
    """Compute the reduced Groebner basis (degree reverse lexicographic); None if a limit or the budget is exceeded.

    >>> from kahanmaps.algebra.polynomials import ring
    >>> x, y = ring(["x", "y"]).gens()
    >>> groebner([x*y - 1, x**2 - y], Budget())
    [x*y - 1, x^2 - y, y^2 - x]
    """
    context = equations[0].context()
    integers = fmpz_mpoly_ctx.get(names_of(equations[0]), Ordering.degrevlex)
    basis: list[Any] = []  # elements are fmpz_mpoly; type checkers do not know their method spoly
    leads: list[tuple[int, ...]] = []
    packed: list[int] = []  # leading exponents, 16 bits each: a divides b if b + guard - a has all guard bits set
    guard = sum(1 << 16 * i + 15 for i in range(integers.nvars()))
    # A heap of pairs of polynomials, ordered by the least common multiple of their leading monomials.
    pairs: list[tuple[int, list[int], int, int]] = []
    pending_pairs: set[tuple[int, int]] = set()  # the pairs in the heap, for lookups
    bits = 1  # length of the longest coefficient

    def pack(monomial: Iterable[int]) -> int:
        return sum(e << 16 * i for i, e in enumerate(monomial))

    def add(p: fmpz_mpoly) -> bool:
        """Add p to the basis and return True; return False if a limit is exceeded."""
        nonlocal bits
        bits = max(bits, *(abs(c).bit_length() for c in p.coeffs()))
        if len(basis) >= MAX_BASIS or len(p) > MAX_TERMS or bits > MAX_BITS:
            return False
        lead = tuple(map(int, p.monoms()[0]))
        for i, other in enumerate(leads):
            lcm = list(map(max, lead, other))
            if sum(lcm) < sum(lead) + sum(other):  # otherwise the S-polynomial reduces to 0 (Buchberger's criterion)
                heappush(pairs, (sum(lcm), [-e for e in reversed(lcm)], i, len(basis)))
                pending_pairs.add((i, len(basis)))
        basis.append(p)
        leads.append(lead)
        packed.append(pack(lead))
        return True

    for p in filter(None, equations):
        denominator = common_denominator(p)
        integer_polynomial = integers.from_dict({tuple(m): c.p * (denominator // c.q) for m, c in p.terms()})
        if not add(integer_polynomial.primitive()[1]):
            return None
    variable_count = sum(any(lead[i] for lead in leads) for i in range(integers.nvars()))
    vector = fmpz_mpoly_vec(basis, integers)
    while pairs:
        if budget.is_spent:
            return None
        lcm_degree, _, i, j = heappop(pairs)
        pending_pairs.remove((i, j))
        count_work(4 + len(basis) / 10)
        # Buchberger's chain criterion: skip the pair i, j if the leading monomial of a third polynomial k divides the
        # least common multiple of those of i and j, and the pairs i, k and j, k are done.
        guarded_lcm = pack(map(max, leads[i], leads[j])) + guard
        if any(
            (guarded_lcm - lead) & guard == guard
            and k not in (i, j)
            and (min(i, k), max(i, k)) not in pending_pairs
            and (min(j, k), max(j, k)) not in pending_pairs
            for k, lead in enumerate(packed)
        ):
            continue
        s_polynomial = basis[i].spoly(basis[j])
        mean_length = sum(map(len, basis)) / len(basis)
        count_work(
            5 + mean_length * lcm_degree * variable_count * sqrt(variable_count * bits * len(s_polynomial)) / 200
        )
        remainder = s_polynomial.reduction_primitive_part(vector)
        if not remainder.is_zero():
            if not add(remainder):
                return None
            vector = fmpz_mpoly_vec(basis, integers)
    return [context.from_dict({tuple(m): fmpq(c) for m, c in p.terms()}) for p in vector.autoreduction()]


def quotient_monomials(basis: Sequence[fmpq_mpoly], unknowns: Sequence[int]) -> list[tuple[int, ...]] | None:
    """Return the monomials in the unknowns that no leading monomial of the basis divides; None for infinitely many.

    `unknowns` are indices of variables. A list of more than 4 times `MAX_QUOTIENT` monomials is incomplete.
    """
    leads = [tuple(int(e) for e in p.monoms()[0]) for p in basis]
    for i in unknowns:
        if not any(all(e == 0 for j, e in enumerate(m) if j != i) for m in leads):
            return None
    count = len(leads[0])
    layer, monomials = [(0,) * count], []
    while layer:
        layer = [m for m in layer if not any(all(a <= b for a, b in zip(lead, m, strict=True)) for lead in leads)]
        monomials += layer
        if len(monomials) > 4 * MAX_QUOTIENT:
            return monomials
        next_layer = (tuple(e + (j == i) for j, e in enumerate(m)) for m, i in itertools.product(layer, unknowns))
        layer = list(dict.fromkeys(next_layer))
    return monomials


def maximal_components(components: Sequence[SolutionComponent]) -> list[SolutionComponent]:
    """Remove components that are equal to another component or contained in one."""
    maximal: list[SolutionComponent] = []
    for component in sorted(components, key=lambda c: -len(c.free)):
        if not any(larger.contains(component) for larger in maximal):
            maximal.append(component)
    return sorted(maximal, key=lambda c: (len(c.free), [str(v) for v in c.values]))
