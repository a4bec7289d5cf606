"""Backward error analysis: the vector field whose flow is the Kahan map, as a series in eps, exactly over Q.

The map x + 2 eps (I - eps f')^{-1} f = x + sum_n 2 eps^n f'^{n-1} f is the flow at time 2 eps of a formal vector field
F = f + eps^2 F_2 + eps^4 F_4 + .... Let D = sum_k eps^k F_k . grad, and let [eps^m] be the coefficient of eps^m. Then

    sum_{j=1}^n 2^j/j! [eps^{n-j}] D^j x = 2 f'^{n-1} f.

This equation determines F_{n-1} from F_0 = f, ..., F_{n-2}. Kahan's method is symmetric, so F_k = 0 for odd k. The
first correction is F_2 = f'f'f/3 - 2 f''(f,f)/3. An integral of the map that is a series in eps is an integral of F. An
integral I_0 of f survives to eps^k if there are polynomials I_2, ..., I_k such that I_0 + ... + eps^k I_k is an
integral of F up to eps^k: f . grad I_2j = -sum_{i=1}^j F_2i . grad I_2(j-i). Sources: hairer-lubich-wanner-2006,
chapter IX; cmoq-2013, where Kahan's method is a Runge-Kutta method.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import factorial
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.fields import QQ, integer
from kahanmaps.algebra.matrices import rank
from kahanmaps.algebra.polynomials import degree, evaluate, gradient, is_homogeneous, monomials, primitive_part, ring
from kahanmaps.algebra.printing import attributes, format_polynomial, plain
from kahanmaps.display_protocols import ResultPart
from kahanmaps.documents.files import SystemFile
from kahanmaps.documents.inline import as_file
from kahanmaps.errors import InputError
from kahanmaps.invariants.integrals_and_densities import measured_integrals, normalized
from kahanmaps.laboratory.preserve.integrals import find_integrals
from kahanmaps.maps.kahan import SystemLike
from kahanmaps.systems.hamiltonian import CubicHamiltonian
from kahanmaps.systems.quadratic import QuadraticSystem

LARGEST_ORDER = 12
_MAX_UNKNOWNS = 1000  # the number of coefficients of all corrections of an integral
_EFFORT = -2  # of the search for integrals of the flow
_SHOWN_TERMS = 60  # the largest number of terms with which a polynomial is printed

Field = tuple[fmpq_mpoly, ...]


@dataclass(frozen=True, eq=False)
class SurvivingIntegral:
    """An integral I of the flow of f, and its continuation I + eps^2 I_2 + ... as an integral of the modified field.

    `corrections` are I_2, I_4, ..., I_order, exact polynomials. `verdict` is "survives" (up to the requested order),
    "lost" (whatever the earlier corrections are, eps^(order + 2) has no correction of degree at most `degree`) or "not
    examined" (the linear equations for the next correction are too large).
    """

    integral: fmpq_mpoly
    corrections: tuple[fmpq_mpoly, ...]
    order: int
    verdict: str
    degree: int

    @property
    def sentence(self) -> str:
        """The result as a sentence."""
        if self.verdict == "survives":
            return f"survives to eps^{self.order}"
        survival_text = f"survives to eps^{self.order}, " if self.order else ""
        if self.verdict == "lost":
            return f"{survival_text}lost at eps^{self.order + 2}: no polynomial correction of degree <= {self.degree}"
        return f"{survival_text}not examined at eps^{self.order + 2}: more than {_MAX_UNKNOWNS} unknown coefficients"


@dataclass(frozen=True, eq=False)
class ModifiedField(ResultPart):
    """The result of `modified`: exact series in eps up to eps^order.

    `fields[k]` is the coefficient of eps^k of the modified vector field, 0 for odd k. `hamiltonian[k]` is the
    coefficient of eps^k of the modified Hamiltonian. The map and the modified field conserve this function. If the
    system declares no Hamiltonian, the tuple is empty. `integrals` are the known polynomial integrals of the flow.
    """

    file: SystemFile = field(repr=False)
    order: int
    fields: tuple[Field, ...]
    hamiltonian: tuple[fmpq_mpoly, ...]
    integrals: tuple[SurvivingIntegral, ...]

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        even_orders, names = range(0, self.order + 1, 2), ("integral", "verdict", "order", "degree", "corrections")
        return {
            "order": self.order,
            "variables": list(self.file.variables),
            "field": [{"order": k, "rhs": plain(self.fields[k])} for k in even_orders],
            "hamiltonian": [{"order": k, "term": plain(self.hamiltonian[k])} for k in even_orders if self.hamiltonian],
            "flow_integrals": [attributes(integral, *names) for integral in self.integrals],
        }

    def lines(self) -> list[str]:
        """Return a tab-separated line for each component and integral; long polynomials are replaced by their sizes."""
        lines = []
        for k in range(2, self.order + 1, 2):
            for name, component in zip(self.file.variables, self.fields[k], strict=True):
                lines.append(f"eps^{k}\t{name}'\t{_short_text(component)}")
        for k in range(0, self.order + 1 if self.hamiltonian else 0, 2):
            lines.append(f"eps^{k}\tmodified H\t{_short_text(self.hamiltonian[k])}")
        lines += [f"proved\t{_short_text(integral.integral)}\t{integral.sentence}" for integral in self.integrals]
        remarks = [] if self.integrals else ["no polynomial integral of the flow is known, or found by a search"]
        return lines + remarks

    @property
    def text(self) -> str:
        """A title, followed by the result of `lines`."""
        title = f"# {self.file.name}: the Kahan map is the flow of f + eps^2 f_2 + eps^4 f_4 + ... at time 2 eps"
        return "\n".join([title, *self.lines()])

    def __str__(self) -> str:
        return self.text


def _short_text(polynomial: fmpq_mpoly) -> str:
    count = len(polynomial)
    return format_polynomial(polynomial) if count <= _SHOWN_TERMS else f"a polynomial of {count} terms (--json has it)"


def modified(system: SystemLike, order: int = 4, *, progress: Callable[[str], None] = lambda _: None) -> ModifiedField:
    """Compute the modified vector field of Kahan's method up to eps^order, and test which integrals of f survive.

    Args:
        system: a quadratic system over Q.
        order: the order of the series in eps, an even number up to 12; the time step is 2 eps.
        progress: called with a sentence at each stage.

    Returns:
        A `ModifiedField`, exact.

    Raises:
        InputError: for an order that is odd or out of range, and for systems that are not quadratic over Q.

    >>> result = modified("weierstrass", 2)
    >>> result.fields[2], result.hamiltonian[2]
    ((4*x*y, 24*x^3 - 8*y^2 - 8*x), -24*x^4 + 8*x*y^2 + 16*x^2 - 8/3)
    >>> [(integral.integral, integral.sentence) for integral in result.integrals]
    [(4*x^3 - y^2 - 4*x, 'survives to eps^2')]
    """
    if integer(order, "the order") % 2 or not 2 <= order <= LARGEST_ORDER:
        raise InputError(f"found the order {order}, expected an even number from 2 to {LARGEST_ORDER}")
    file = as_file(system)
    if file.map.root is not None:
        raise InputError(f"found the algebraic number {file.map.root}, expected a system over the rational numbers")
    fields = modified_fields(file.system, order, progress)
    series = () if file.hamiltonian is None else modified_hamiltonian(file.hamiltonian, order)
    # Candidates for integrals of the flow: H, the limits eps -> 0 of declared integrals, and the results of a search.
    context, candidates = ring(file.variables), []
    if file.hamiltonian is not None:
        candidates.append(file.hamiltonian.H)
    functions = [normalized(function, file.dim).leading for function in measured_integrals(file).values()]
    progress("searching for integrals of the flow")
    functions += [integral.function for integral in find_integrals(file, flow=True, effort=_EFFORT).integrals]
    for function in functions:
        if function is not None and function.denominator.is_constant():
            candidates.append(function.numerator.project_to_context(context))
    integrals, gradients = list[fmpq_mpoly](), list[list[fmpq]]()
    point = [fmpq(k + 2, k * k + 3) for k in range(file.dim)]  # gradients dependent here by chance hide an integral
    for candidate in candidates:
        integral = primitive_part(candidate - candidate[(0,) * file.dim])[1]
        gradient_at_point = [evaluate(p, QQ, point) for p in gradient(integral)]
        is_new = rank(QQ, fmpq_mat([*gradients, gradient_at_point])) > len(gradients)
        if is_new and _derivative(file.system.rhs, [integral])[0].is_zero():
            integrals.append(integral)
            gradients.append(gradient_at_point)
    return ModifiedField(file, order, fields, series, tuple(_continue(I, fields, order) for I in integrals))


def modified_fields(
    system: QuadraticSystem, order: int, progress: Callable[[str], None] = lambda _: None
) -> tuple[Field, ...]:
    """Return the coefficients of eps^0, ..., eps^order of the modified vector field.

    >>> modified_fields(QuadraticSystem.from_text(["x"], ["x"]), 4)  # artanh(eps)/eps x
    ((x,), (0,), (1/3*x,), (0,), (1/5*x,))
    """
    context = ring(system.variables)
    f = tuple(p.project_to_context(context) for p in system.rhs)
    power, fields = f, [f]
    # powers[j][p] is the coefficient of eps^p of D^j x with D = sum_k eps^k F_k . grad, for j > 0.
    powers: list[list[Field]] = [[], [f]]
    for n in range(2, order + 2):
        power = _derivative(power, f)  # f'^{n-1} f
        progress(f"the modified field at eps^{n - 1}")
        remainder = [2 * p for p in power]
        powers.append([])
        for j in range(2, n + 1):
            order_left = n - j  # [eps^{n-j}] D^j x = sum over k of F_k . grad [eps^{n-j-k}] D^{j-1} x
            terms = [_derivative(fields[k], powers[j - 1][order_left - k]) for k in range(order_left + 1)]
            coefficient = tuple(sum(summands, context.constant(0)) for summands in zip(*terms, strict=True))
            powers[j].append(coefficient)
            remainder = [r - fmpq(2**j, factorial(j)) * t for r, t in zip(remainder, coefficient, strict=True)]
        fields.append(tuple(r / 2 for r in remainder))
        powers[1].append(fields[-1])
    return tuple(fields)


def modified_hamiltonian(hamiltonian: CubicHamiltonian, order: int) -> tuple[fmpq_mpoly, ...]:
    """Return the coefficients of eps^0, ..., eps^order of the modified H + (2 eps/3) grad H^T (I - eps f')^{-1} f.

    >>> from kahanmaps.documents.catalog import load
    >>> modified_hamiltonian(load("harmonic").hamiltonian, 2)
    (1/2*x^2 + 1/2*y^2, 0, -2/3*x^2 - 2/3*y^2)
    """
    series, vector = [hamiltonian.H], hamiltonian.system.rhs  # `vector` is f'^k f for k = 0, 1, ...
    for _ in range(order):
        series.append(fmpq(2, 3) * _derivative(vector, [hamiltonian.H])[0])
        vector = _derivative(vector, hamiltonian.system.rhs)
    return tuple(series)


def _derivative(vector: Field, functions: Sequence[fmpq_mpoly]) -> Field:
    """Return the derivatives of functions along a vector field."""
    return tuple(
        sum((v * d for v, d in zip(vector, gradient(function), strict=True)), 0 * function) for function in functions
    )


def _continue(integral: fmpq_mpoly, fields: Sequence[Field], order: int) -> SurvivingIntegral:
    """Continue an integral I of the flow by polynomials I_2, I_4, ... as far as possible, at most up to eps^order.

    All corrections up to an order are unknowns of one linear system. Each of them is determined only up to integrals
    of the flow, and the next one may exist for some choices only. `fields` are F_0 = f, F_1, ..., F_order.
    """
    names = fields[0][0].context().names()
    context, integral_degree = ring(names), degree(integral)
    even_fields = [tuple(p.project_to_context(context) for p in components) for components in fields[::2]]
    integral = integral.project_to_context(context)
    # If f and I are homogeneous, so are all corrections: x -> s x, eps -> eps/s only multiplies f and I by numbers.
    is_graded = all(is_homogeneous(p, 2) for p in even_fields[0]) and is_homogeneous(integral, integral_degree)
    columns: list[tuple[int, fmpq_mpoly]] = []
    corrections: tuple[fmpq_mpoly, ...] = ()
    for m in range(1, order // 2 + 1):
        max_degree = integral_degree + 2 * m
        for d in range(max_degree if is_graded else 1, max_degree + 1):
            columns += [(m, context.from_dict({e: fmpq(1)})) for e in monomials(len(names), d)]
        if len(columns) > _MAX_UNKNOWNS:
            return SurvivingIntegral(integral, corrections, 2 * m - 2, "not examined", max_degree)
        equations: dict[tuple[int, Any], dict[int, fmpq]] = {}
        for c, (order_index, monomial) in enumerate([*columns, (0, integral)]):
            for j in range(max(order_index, 1), m + 1):
                for exponent, value in _derivative(even_fields[j - order_index], [monomial])[0].terms():
                    equations.setdefault((j, exponent), {})[c] = value
        matrix = fmpq_mat(max(1, len(equations)), len(columns) + 1)
        for r, row in enumerate(equations.values()):
            for c, value in row.items():
                matrix[r, c] = value
        reduced_matrix, pivots = matrix.rref()
        solution = [context.constant(0)] * m
        for r in range(pivots):
            pivot = next(c for c in range(len(columns) + 1) if reduced_matrix[r, c] != 0)
            if pivot == len(columns):  # the row is the equation 0 = 1
                return SurvivingIntegral(integral, corrections, 2 * m - 2, "lost", max_degree)
            order_index, monomial = columns[pivot]
            solution[order_index - 1] -= reduced_matrix[r, len(columns)] * monomial
        corrections = tuple(solution)
    return SurvivingIntegral(integral, corrections, order, "survives", integral_degree + order)
