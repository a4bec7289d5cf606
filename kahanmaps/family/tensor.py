"""Systems over an algebra K = Q[t]/(chi) as systems over Q, and the search for such a structure.

A quadratic system in n variables over K is a system in n m variables over Q, m = deg chi: each variable is written as
x = x_0 + x_1 t + .... The Kahan map of this system is the Kahan map over K and inherits its properties, even if chi has
repeated roots: docs/mathematics.md, "The tensor theorem". A system over Q arises in this way if and only if there is a
matrix C that commutes with f'(x) for all x and makes Q^(n m) a free module over Q[C].
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly, fmpq_poly, fmpz_mat

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.functions import DEFAULT_BUDGET, Function, FunctionField, FunctionMatrix
from kahanmaps.algebra.matrices import combination_of, nullspace, primitive_integers
from kahanmaps.algebra.polynomials import RationalFunction, names_of, ring
from kahanmaps.algebra.printing import format_univariate
from kahanmaps.display_protocols import ResultPart
from kahanmaps.errors import InputError
from kahanmaps.family.skew_hamiltonian import companion_matrix, evaluate_at_matrix
from kahanmaps.systems.quadratic import MAX_DIMENSION, QuadraticSystem, as_system

GENERATOR = "t"
_MAX_DIMENSION = 12  # maximal dimension n in which commuting matrices, with n^2 entries, are computed
_DRAWS = 40  # random combinations of commuting matrices that are tried


def over_algebra(system: QuadraticSystem, chi: fmpq_poly) -> QuadraticSystem:
    """Return the system over Q of a system over K = Q[t]/(chi): each variable x is written as x_0 + x_1 t + ....

    The coefficients of `system` may contain the symbol t, which stands for the generator of K, and no other symbol; chi
    may have repeated roots. Exact. Raises InputError for a constant chi and for other symbols.

    >>> print(over_algebra(QuadraticSystem.from_text(["x"], ["x^2"]), fmpq_poly([-2, 0, 1])))
    x_0' = x_0^2 + 2*x_1^2
    x_1' = 2*x_0*x_1
    """
    if chi.degree() < 1:
        raise InputError(f"found the algebra Q[t]/({format_univariate(chi)}), expected a polynomial in t")
    if set(system.symbols) - {GENERATOR}:
        raise InputError(f"found the symbols {', '.join(system.symbols)}, expected none but {GENERATOR}")
    if system.dim * chi.degree() > MAX_DIMENSION:
        raise InputError(
            f"found {system.dim} variables over an algebra of dimension {chi.degree()}, expected at most "
            f"{MAX_DIMENSION} over Q"
        )
    variables = split_names(system.variables, chi.degree())
    component_lists = [components(polynomial, variables, chi) for polynomial in system.rhs]
    return QuadraticSystem(tuple(itertools.chain.from_iterable(component_lists)))


def split_names(variables: Sequence[str], m: int) -> tuple[str, ...]:
    """Return the names x_0, ..., x_(m-1) for every variable x."""
    return tuple(f"{name}_{k}" for name in variables for k in range(m))


def inherited_integrals(function: RationalFunction, chi: fmpq_poly) -> tuple[RationalFunction, ...]:
    """Return the m components over Q, for t^0, ..., t^(m-1), of a rational function of the variables and eps over K.

    If the Kahan map over K conserves the function, that over Q conserves each component. Raises BudgetExceeded.

    >>> x, eps = ring(["x", "eps"]).gens()
    >>> for integral in inherited_integrals(RationalFunction(x**2, x**0), fmpq_poly([-2, 0, 1])):
    ...     print(integral.numerator)
    x_0^2 + 2*x_1^2
    2*x_0*x_1
    """
    K, numerator, denominator = _as_matrices(function, chi)
    solution = denominator.solve(K.matrix(numerator.nrows(), 1, [numerator[i, 0] for i in range(numerator.nrows())]))
    return tuple(_in_lowest_terms(entry) for entry in solution.entries())


def inherited_density(function: RationalFunction, chi: fmpq_poly) -> RationalFunction:
    """Return the norm N(phi) from K to Q of phi = `function`: if phi is a density over K, N(phi) is one over Q.

    >>> x, eps = ring(["x", "eps"]).gens()
    >>> print(inherited_density(RationalFunction(x, x**0), fmpq_poly([-2, 0, 1])).numerator)
    x_0^2 - 2*x_1^2
    """
    _, numerator, denominator = _as_matrices(function, chi)
    return _in_lowest_terms(numerator.det() / denominator.det())


@dataclass(frozen=True, eq=False)
class TensorStructure(ResultPart):
    """A system over Q as a system in `rank` variables over K = Q[t]/(chi), where t acts as the matrix `C`.

    The constructor verifies that C f'(x) = f'(x) C for all x, that chi is the minimal polynomial of C, and that the
    Q[C]-module of all points is free. It raises InputError otherwise.
    """

    system: QuadraticSystem
    C: fmpq_mat
    chi: fmpq_poly

    def __post_init__(self) -> None:
        if not commutes(self.C, self.system) or self.C.minpoly() != self.chi or not _is_free(self.C, self.chi):
            raise InputError("C does not make this a system over Q[C]")

    @property
    def rank(self) -> int:
        """The number of variables over K."""
        return self.system.dim // int(self.chi.degree())

    @property
    def chi_text(self) -> str:
        """The polynomial chi as text, such as `t^2 - 2`."""
        return format_univariate(self.chi)

    @property
    def text(self) -> str:
        """A sentence that describes the system over K."""
        kind = {1: "a system in one variable", 2: "a planar system"}.get(
            self.rank, f"a system in {self.rank} variables"
        )
        _, factors = self.chi.factor()
        note = ""
        if len(factors) > 1:
            note = f", a product of {len(factors)} systems"
        elif factors[0][1] > 1:
            note = ", which has nilpotent elements"
        return f"{kind} over K = Q[t]/({self.chi_text}){note}"


def tensor_structure(system: QuadraticSystem | Any) -> TensorStructure | None:
    """Search for the largest algebra K = Q[C] over which a system is defined.

    All C with C f'(x) = f'(x) C are computed by linear algebra over Q, in dimension at most 12; exact. Returns None if
    the algebra is Q or is not generated by one matrix, or if the matrices C do not commute (then f is linear or does
    not depend on all variables).

    >>> f = over_algebra(QuadraticSystem.from_text(["x", "y"], ["y^2", "x^2"]), fmpq_poly([0, 0, 1]))
    >>> print(tensor_structure(f).text)
    a planar system over K = Q[t]/(t^2), which has nilpotent elements
    >>> tensor_structure(QuadraticSystem.from_text(["x", "y"], ["y^2", "x^2 + y"])) is None
    True
    """
    system = as_system(system)
    if system.dim > _MAX_DIMENSION or system.symbols:
        return None
    commuting_matrices = centroid(system)
    if len(commuting_matrices) == 1 or any(B * C != C * B for B, C in itertools.combinations(commuting_matrices, 2)):
        return None
    rng = random.Random(len(commuting_matrices))
    draws = ([rng.randint(-2, 2) for _ in commuting_matrices] for _ in range(_DRAWS))
    candidates = []
    for C in [*commuting_matrices, *(combination_of(weights, commuting_matrices) for weights in draws)]:
        chi = C.minpoly()
        if chi.degree() == len(commuting_matrices) and _is_free(C, chi):
            candidates.append((sum(abs(c).p.bit_length() + c.q.bit_length() for c in chi.coeffs()), C, chi))
    if not candidates:
        return None
    _, C, chi = min(candidates, key=lambda candidate: candidate[0])
    return TensorStructure(system, C, chi)


def centroid(system: QuadraticSystem) -> list[fmpq_mat]:
    """Return a reduced integral basis of all C with C f'(x) = f'(x) C for all x, by exact linear algebra."""
    n = system.dim
    derivatives = [system.B, *(fmpq_mat(n, n, [q[j, k] for q in system.Q for j in range(n)]) for k in range(n))]
    rows = []
    for S in derivatives:
        for i, j in itertools.product(range(n), repeat=2):
            row = [fmpq(0)] * (n * n)
            for k in range(n):  # the entry i, j of C S - S C
                row[i * n + k] += S[k, j]
                row[k * n + j] -= S[i, k]
            if any(row):
                rows.append(row)
    if not rows:
        rows = [[fmpq(0)] * (n * n)]
    basis = [primitive_integers(vector) for vector in nullspace(QQ, fmpq_mat(rows))]
    return [fmpq_mat(n, n, [fmpq(entry) for entry in row]) for row in fmpz_mat(basis).lll().tolist()]


def commutes(C: fmpq_mat, f: QuadraticSystem) -> bool:
    """Return whether C f'(x) = f'(x) C for all x; tested for the linear part B and each constant matrix df'/dx_k."""
    n = f.dim
    derivatives = (fmpq_mat(n, n, [q[j, k] for q in f.Q for j in range(n)]) for k in range(n))
    return C * f.B == f.B * C and all(C * S == S * C for S in derivatives)


def _is_free(C: fmpq_mat, chi: fmpq_poly) -> bool:
    """Return whether Q^n is a free Q[C]-module: tested by dim ker p(C) for each irreducible factor p of chi."""
    rank, remainder = divmod(C.nrows(), int(chi.degree()))
    return remainder == 0 and all(
        C.nrows() - evaluate_at_matrix(p, C).rank() == rank * p.degree() for p, _ in chi.factor()[1]
    )


def components(
    polynomial: fmpq_mpoly, variables: Sequence[str], chi: fmpq_poly, names: Sequence[str] = ()
) -> list[fmpq_mpoly]:
    """Return the coefficients of 1, t, ..., t^(m-1) of a polynomial in x = x_0 + x_1 t + ....

    Each of the first variables x is split into m of `variables`; t and the other variables do not change. The results
    are in the ring of `names`, by default that of `variables`.
    """
    names = names or variables
    m = int(chi.degree())
    context = ring((*names, GENERATOR))
    gens = dict(zip(context.names(), context.gens(), strict=True))
    t, zero = gens[GENERATOR], context.constant(0)
    old_names = names_of(polynomial)
    split_count = len(variables) // m
    images = [sum((gens[f"{name}_{k}"] * t**k for k in range(m)), zero) for name in old_names[:split_count]]
    images += [gens[name] for name in old_names[split_count:]]
    modulus = sum((t**k * chi[k] for k in range(m + 1)), zero)
    _, remainder = divmod(polynomial.compose(*images, ctx=context), modulus)
    component_terms: list[dict[tuple[int, ...], fmpq]] = [{} for _ in range(m)]
    for exponent, coefficient in remainder.terms():
        component_terms[exponent[-1]][tuple(exponent[:-1])] = coefficient
    target_ring = ring(names)
    return [target_ring.from_dict(terms) for terms in component_terms]


def _as_matrices(function: RationalFunction, chi: fmpq_poly) -> tuple[FunctionField, FunctionMatrix, FunctionMatrix]:
    """Return (F, P, Q): P, Q are the matrices over the field F of multiplication by numerator and denominator on K."""
    m = int(chi.degree())
    variables = split_names(function.names[:-1], m)
    names = (*variables, "eps")
    K = FunctionField(names, DEFAULT_BUDGET, reduces=True)
    companion = companion_matrix(chi)

    def matrix(polynomial: fmpq_mpoly) -> FunctionMatrix:
        total, power = K.matrix(m, m, [K.zero] * (m * m)), QQ.identity(m)
        for component in components(polynomial, variables, chi, names):
            total = total + K.convert_matrix(power) * Function(K, component, K.context.constant(1))
            power = power * companion
        return total

    return K, matrix(function.numerator), matrix(function.denominator)


def _in_lowest_terms(element: Function) -> RationalFunction:
    """Return the element of the function field as a quotient in lowest terms."""
    common_factor = element.numerator.gcd(element.denominator)
    return RationalFunction(element.numerator / common_factor, element.denominator / common_factor)
