"""Candidates for Casimirs of a tensor P among functions of known integrals: products of powers, polynomials, quotients.

C is a Casimir if P grad C = 0. For C = prod I_i^k_i this says sum k_i P grad I_i / I_i = 0. For a polynomial C in the
I_i it is a linear relation among multiples of the P grad I_i. At random points modulo a prime these are linear
equations for the k_i or the coefficients of C, which may contain eps and the symbols. No candidate is verified here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import combinations
from math import comb, lcm, prod

from flint import fmpq_mpoly, fmpq_mpoly_ctx

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.functions import BudgetExceeded, Function, FunctionField
from kahanmaps.algebra.modular_matrices import null_space
from kahanmaps.algebra.polynomials import RationalFunction, degree_in, evaluate, ring
from kahanmaps.algebra.printing import format_rational_function
from kahanmaps.algebra.residues import rational_vector
from kahanmaps.algebra.work import Budget
from kahanmaps.invariants.poisson import MatrixPoissonTensor
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.modular_points import ModularMap, NoPoint, exponents_up_to, scaled_gradient
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import DarbouxSpace
from kahanmaps.laboratory.preserve.integrals import FoundIntegral

_DEGREE = 2  # of polynomials in the integrals
_MAX_TERMS = 40  # monomials of a polynomial in the integrals
_MAX_EXPONENT = 12  # in a product of powers
_BUDGET = 200_000  # products of terms, to expand a candidate
_SPARE = 4  # points beyond the number of unknowns


def casimir_candidates(
    laboratory: Laboratory, tensor: MatrixPoissonTensor, integrals: Sequence[FoundIntegral], budget: Budget
) -> Iterator[tuple[str, RationalFunction]]:
    """Yield possible Casimirs, each as a text in the names of the integrals and as an expanded function.

    Args:
        laboratory: the reductions of the map modulo primes.
        tensor: a tensor that the map preserves.
        integrals: the known integrals.
        budget: the work allowed for finding the coefficients of polynomials.

    Yields:
        Products of powers, polynomials of degree at most 2, then quotients of affine functions. They are Casimirs
        modulo a prime, and need not be independent: powers and polynomials of another candidate may occur.
    """
    names = [integral.name for integral in integrals]
    if set(names) & {*laboratory.symbols, "eps"}:
        return
    field = FunctionField(laboratory.map.names, _BUDGET)
    functions = [Function(field, I.function.numerator, I.function.denominator) for I in integrals]
    context = ring((*names, *laboratory.symbols, "eps"))
    try:
        candidates = [
            *_find_products(laboratory.maps[0], tensor, integrals, context),
            *_find_polynomials(laboratory, tensor, integrals, budget),
            *_find_fractions(laboratory, tensor, integrals, budget),
        ]
    except NoPoint:
        return
    for candidate in candidates:
        try:
            arguments = [*functions, *field.variables[laboratory.map.dim :]]
            value = evaluate(candidate.numerator, field, arguments) / evaluate(candidate.denominator, field, arguments)
        except BudgetExceeded:
            continue
        yield format_rational_function(candidate), RationalFunction.reduced(value.numerator, value.denominator)


def _find_products(
    map_: ModularMap, tensor: MatrixPoissonTensor, integrals: Sequence[FoundIntegral], context: fmpq_mpoly_ctx
) -> Iterator[RationalFunction]:
    """Yield the Casimirs that are products of powers of at least two integrals."""
    p, rows = map_.prime, list[list[int]]()
    for _ in range(_SPARE + len(integrals)):
        values, fields = _evaluate_fields(map_, tensor, integrals)
        # I_1^a I_2^b ... is a Casimir if and only if a P grad I_1/I_1 + b P grad I_2/I_2 + ... = 0.
        columns = [[c * pow(I, -1, p) % p for c in v] for I, v in zip(values, fields, strict=True)]
        rows += [list(row) for row in zip(*columns, strict=True)]
    for vector in null_space(rows, len(integrals), p):
        exponents = rational_vector(vector, p)
        if exponents is None:
            continue
        common_denominator = lcm(*(int(e.q) for e in exponents))
        powers = [int(e * common_denominator) for e in exponents]
        if sum(e != 0 for e in powers) > 1 and max(map(abs, powers)) <= _MAX_EXPONENT:
            numerator, denominator = (
                prod(
                    (I ** max(0, sign * e) for I, e in zip(context.gens(), powers, strict=False)),
                    start=context.constant(1),
                )
                for sign in (1, -1)
            )
            yield RationalFunction(numerator, denominator)


def _find_polynomials(
    laboratory: Laboratory, tensor: MatrixPoissonTensor, integrals: Sequence[FoundIntegral], budget: Budget
) -> Iterator[RationalFunction]:
    """Yield a basis of the Casimirs that are polynomials of degree at most 2 in the integrals."""
    degree = _DEGREE if comb(len(integrals) + _DEGREE, _DEGREE) <= _MAX_TERMS else 1
    powers = exponents_up_to(len(integrals), degree)[1:]

    def columns_at_point(values: list[int], fields: list[list[int]], p: int) -> list[list[int]]:
        rows = []
        for exponents in powers:
            weights = [
                e * prod(pow(I, k - (i == j), p) for j, (I, k) in enumerate(zip(values, exponents, strict=True)) if k)
                if e
                else 0
                for i, e in enumerate(exponents)
            ]
            rows.append([sum(w * v for w, v in zip(weights, row, strict=True)) for row in zip(*fields, strict=True)])
        return rows

    for P in _find_linear_relations(laboratory, tensor, integrals, powers, columns_at_point, budget):
        if degree_in(P, len(integrals)) > 1 or len(P) > 1:
            yield RationalFunction(P, P.context().constant(1))


def _find_fractions(
    laboratory: Laboratory, tensor: MatrixPoissonTensor, integrals: Sequence[FoundIntegral], budget: Budget
) -> Iterator[RationalFunction]:
    """Yield Casimirs that are quotients of affine functions of the integrals.

    With J = (1, I_1, ...) the quotient (u.J)/(v.J) is a Casimir if sum w_ab (J_a P grad J_b - J_b P grad J_a) = 0 for
    w_ab = u_a v_b - u_b v_a. This is linear in w, and any two independent rows of w span the same plane as u and v.
    """
    count = len(integrals)
    if comb(count + 2, 2) > _MAX_TERMS:
        return
    pairs = list(combinations(range(count + 1), 2))
    powers = [tuple(int(k in (a - 1, b - 1)) for k in range(count)) for a, b in pairs]

    def columns_at_point(values: list[int], fields: list[list[int]], p: int) -> list[list[int]]:
        J, P = [1, *values], [[0] * len(fields[0]), *fields]
        return [[J[a] * y - J[b] * x for x, y in zip(P[a], P[b], strict=True)] for a, b in pairs]

    for form in _find_linear_relations(laboratory, tensor, integrals, powers, columns_at_point, budget):
        basis, zero = [form.context().constant(1), *form.context().gens()[:count]], form.context().constant(0)
        w = dict.fromkeys(pairs, zero)
        for monomial, value in form.terms():
            pair = pairs[powers.index(tuple(map(int, monomial[:count])))]
            w[pair] += form.context().from_dict({(*([0] * count), *map(int, monomial[count:])): value})
        a, b = next(pair for pair in pairs if not w[pair].is_zero())
        u, v = (
            sum(((w.get((k, c), zero) - w.get((c, k), zero)) * J for c, J in enumerate(basis)), start=zero)
            for k in (a, b)
        )
        yield RationalFunction.reduced(u, v)


def _find_linear_relations(
    laboratory: Laboratory,
    tensor: MatrixPoissonTensor,
    integrals: Sequence[FoundIntegral],
    powers: Sequence[tuple[int, ...]],
    columns: Callable[[list[int], list[list[int]], int], list[list[int]]],
    budget: Budget,
) -> Sequence[fmpq_mpoly]:
    """Interpolate a basis of the linear relations sum c_m column_m = 0, as polynomials sum c_m m in the integrals.

    m runs through the monomials with exponents in `powers`, and the c_m may contain eps and the symbols. `columns`
    computes one column for each m from the result of `_evaluate_fields` and the prime.
    """
    count, degree = len(integrals), max(map(sum, powers))
    all_exponents = exponents_up_to(count, degree)
    indices = [all_exponents.index(exponents) for exponents in powers]

    def compute_space(map_: ModularMap) -> DarbouxSpace:
        p, rows = map_.prime, list[list[int]]()
        for _ in range(_SPARE + len(powers)):
            columns_at_point = columns(*_evaluate_fields(map_, tensor, integrals), p)
            rows += [[entry % p for entry in row] for row in zip(*columns_at_point, strict=True)]
        return DarbouxSpace.spanned_by(count, degree, null_space(rows, len(powers), p), p, indices)

    model = compute_space(laboratory.maps[0])
    if not model.basis:
        return ()
    eps_enters = "symbol" if laboratory.eps is None and laboratory.map.has_eps else "not"
    names = [integral.name for integral in integrals]
    closed_forms = laboratory.formulas([model], lambda map_: [compute_space(map_)], budget, names, eps_enters)
    return closed_forms.bases[0] if closed_forms.bases is not None else ()


def _evaluate_fields(
    map_: ModularMap, tensor: MatrixPoissonTensor, integrals: Sequence[FoundIntegral]
) -> tuple[list[int], list[list[int]]]:
    """Return the values of the integrals I at a random point, and the vectors P grad I there, where P is the tensor.

    Raises NoPoint if a value is 0 or undefined.
    """
    field = GF(map_.prime)
    x = [field.convert(c) for c in (*map_.random_point(), *map_.values)]
    eps = field.convert(map_.eps)
    P = tensor.value(field, eps, tuple(x))
    values, fields = [], []
    for integral in integrals:
        function = integral.function
        value, denominator = function.value(field, [*x, eps]), evaluate(function.denominator, field, [*x, eps])
        if P is None or value is None or value == 0:
            raise NoPoint("an integral or the tensor is 0 or infinite at a random point modulo a prime")
        hamiltonian_field = (P * field.column(scaled_gradient(function, field, [*x, eps], map_.dim))).entries()
        values.append(int(value))
        fields.append([int(entry / (denominator * denominator)) for entry in hamiltonian_field])
    return values, fields
