"""The inverse of a map M(x) x~ = r(x), computed by elimination.

The n equations are polynomials in x and x~ that vanish on the graph of the map. The graph is irreducible, so each
polynomial may be replaced by its irreducible factor that vanishes on the graph; a random point of the graph modulo a
prime shows which factor this is. An equation of degree 1 in an unknown x_k is solved for x_k, which is substituted into
the others; without such an equation, resultants eliminate an unknown. The equation of the last unknown is its minimal
polynomial over the field of functions of x~: degree 1 gives a coordinate of the inverse map, degree d > 1 means that a
generic point of the image has at least d preimages.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from flint import Ordering, fmpq_mpoly, fmpz_mod_mpoly_ctx

from kahanmaps.algebra.chance import derive_seed, random_prime_field
from kahanmaps.algebra.fields import PrimeField
from kahanmaps.algebra.matrices import solve
from kahanmaps.algebra.polynomials import evaluate, names_of, ring
from kahanmaps.algebra.residues import random_prime
from kahanmaps.errors import BadPrime, InputError, SingularMatrix

Rows = tuple[tuple[fmpq_mpoly, ...], ...]
Quotient = tuple[Any, Any]  # numerator and denominator, polynomials
Solution = dict[int, Quotient]  # from the index of an unknown among the variables to the value of the unknown

_MAX_TERMS = 3000  # maximal number of terms of a polynomial in the elimination
_PRIME_BITS = 30  # bits of primes: python-flint sorts factors by their coefficients, read as C integers
_MAX_RESULTANT = 60_000  # maximal product, for a resultant, of the two numbers of terms and the sum of the degrees


class NotBirational(InputError):
    """The map is not birational: a generic point has several preimages, or none."""


class TooLarge(InputError):
    """The polynomials exceed the limits of the elimination."""


def inverse_rows(rows: Rows) -> Rows:
    """Return the rows (M | -r) of the inverse map, with M diagonal; exact.

    Args:
        rows: the rows of the map, polynomials in the n variables, then symbols (if any) and eps.

    Returns:
        The rows of the inverse in the same names.

    Raises:
        InputError: if the map is not birational (NotBirational), or the elimination is too large (TooLarge).

    >>> x, y, eps = ring(["x", "y", "eps"]).gens()
    >>> one, zero = x**0, 0 * x
    >>> henon = ((one, zero, -y), (zero, one, x - y**2))  # (x, y) -> (y, y^2 - x)
    >>> inverse_rows(henon)
    ((1, 0, -x^2 + y), (0, 1, -x))
    """
    n, names = len(rows), names_of(rows[0][-1])
    context = ring(
        (*(f"{name}." for name in names[:n]), *names)
    )  # the variables are x, then x~ (under the names of x), then symbols and eps
    x = [*context.gens()[:n], *context.gens()[2 * n :]]
    x_new = [*context.gens()[n : 2 * n], context.constant(1)]
    equations = [
        sum((entry.compose(*x, ctx=context) * y for entry, y in zip(row, x_new, strict=True)), context.constant(0))
        for row in rows
    ]
    field, sample = _graph_point(rows)
    solution = _solve(equations, list(range(n)), partial(_vanishes, field=field, sample=sample))
    names_ring = ring(names)
    exchanged_variables = [names_ring.constant(0)] * n + list(names_ring.gens())
    inverse = []
    for i in range(n):
        numerator, denominator = (part.compose(*exchanged_variables, ctx=names_ring) for part in solution[i])
        scale = denominator.leading_coefficient()
        inverse.append(
            (*(denominator / scale if i == j else names_ring.constant(0) for j in range(n)), -numerator / scale)
        )
    return tuple(inverse)


def why_not_birational(rows: Rows) -> str:
    """Return why a map is not birational; "" if tests modulo primes at random eps and symbols give no reason."""
    n, names = len(rows), names_of(rows[0][-1])
    reasons = []
    for seed in range(2):
        field, sample = _graph_point(rows, _PRIME_BITS, seed)
        context = fmpz_mod_mpoly_ctx.get(
            (*(f"{name}." for name in names[:n]), *names[:n]), modulus=field.prime, ordering=Ordering.degrevlex
        )
        equations = []
        for row in rows:
            terms: dict[tuple[int, ...], Any] = {}
            for j, entry in enumerate(row):
                for monomial, coefficient in entry.terms():
                    value = field.convert(coefficient)
                    for coordinate, exponent in zip(sample[2 * n :], monomial[n:], strict=True):
                        value = value * coordinate**exponent
                    key = (*monomial[:n], *(int(j == k) for k in range(n)))
                    terms[key] = terms.get(key, field.zero) + value
            equations.append(context.from_dict({key: int(value) for key, value in terms.items() if value != 0}))
        try:
            _solve(equations, list(range(n)), partial(_vanishes, field=field, sample=sample))
        except NotBirational as error:
            reasons.append(str(error))
            continue
        except TooLarge:
            pass
        return ""
    return reasons[0]


def _graph_point(rows: Rows, bits: int = 0, seed: int = 0) -> tuple[PrimeField, list[Any]]:
    """Return a random prime field, and a list over it: a random point (x, x~) of the graph, the symbols and eps."""
    n, names = len(rows), names_of(rows[0][-1])
    rng = random.Random(f"graph {derive_seed(seed, *(entry for row in rows for entry in row))}")
    while True:  # the loop ends: finitely many primes are bad, and M is singular on a hypersurface only
        field = PrimeField(random_prime(rng, bits)) if bits else random_prime_field(rng)
        arguments = [field.random(rng) for _ in names]
        try:
            values = [evaluate(entry, field, arguments) for row in rows for entry in row]
            matrix = field.matrix(n, n, [values[i * (n + 1) + j] for i in range(n) for j in range(n)])
            image = solve(matrix, field.column([-values[i * (n + 1) + n] for i in range(n)])).entries()
        except (BadPrime, SingularMatrix):
            continue
        return field, [*arguments[:n], *image, *arguments[n:]]


def _vanishes(polynomial: Any, field: PrimeField, sample: Sequence[Any]) -> bool:
    total = field.zero
    for monomial, coefficient in polynomial.terms():
        value = field.convert(coefficient)
        for coordinate, exponent in zip(sample, monomial, strict=False):
            value = value * coordinate**exponent
        total = total + value
    return bool(total == 0)


def _solve(polynomials: Sequence[Any], unknowns: Sequence[int], is_on_graph: Callable[[Any], bool]) -> Solution:
    """Solve the equations `polynomials` = 0 of the graph for the unknowns as functions of the other variables."""
    if not unknowns:
        return {}
    relations: list[Any] = []
    for polynomial in polynomials:
        if polynomial.is_zero():
            continue
        if len(polynomial) > _MAX_TERMS:
            raise TooLarge("the inverse of this map is too large to be computed: give it as well")
        factor = next((factor for factor, _ in polynomial.factor()[1] if is_on_graph(factor)), None)
        if factor is None:
            raise TooLarge("the elimination found no inverse of this map: give it as well")
        if factor not in relations:
            relations.append(factor)
    if len(relations) < len(unknowns) or any(not any(p.degrees()[u] for u in unknowns) for p in relations):
        raise NotBirational("the map is not dominant: det dPhi is identically 0")
    candidates = [(len(p), p, u) for p in relations for u in unknowns if p.degrees()[u] == 1]
    if candidates:
        _, relation, u = min(
            candidates, key=lambda candidate: (sum(bool(candidate[1].degrees()[v]) for v in unknowns), candidate[0])
        )
        constant, factor = _coefficients_in(relation, u)  # constant + factor x_u = 0
        remaining_relations = [_substitute_quotient(p, u, -constant, factor) for p in relations if p is not relation]
        solution = _solve(remaining_relations, [v for v in unknowns if v != u], is_on_graph)
        (a, b), (c, d) = (_substitute_solution(part, solution) for part in (-constant, factor))
        return solution | {u: _in_lowest_terms(a * d, b * c)}
    # If no equation is linear in an unknown, resultants eliminate an unknown.
    if len(unknowns) == 1:
        raise NotBirational(
            "the map is not birational: a generic point of its image has at least "
            f"{relations[0].degrees()[unknowns[0]]} preimages"
        )
    u = min(unknowns, key=lambda v: sum(p.degrees()[v] for p in relations))
    relations_with_u = sorted((p for p in relations if p.degrees()[u]), key=lambda p: (p.degrees()[u], len(p)))
    pivot, name = relations_with_u[0], str(relations_with_u[0].context().names()[u])
    relations_without_u = [p for p in relations if not p.degrees()[u]]
    for p in relations_with_u[1:]:
        if len(pivot) * len(p) * (pivot.degrees()[u] + p.degrees()[u]) > _MAX_RESULTANT:
            raise TooLarge("the inverse of this map is too large to be computed: give it as well")
        relations_without_u.append(pivot.resultant(p, name))
    solution = _solve(relations_without_u, [v for v in unknowns if v != u], is_on_graph)
    gcd = None
    for p in relations_with_u:
        numerator, _ = _substitute_solution(p, solution)
        gcd = numerator if gcd is None else gcd.gcd(numerator)
    return solution | _solve([gcd], [u], is_on_graph)


def _coefficients_in(polynomial: Any, u: int) -> list[Any]:
    """Return the coefficients of the powers of the variable with index u, starting with the constant term."""
    context = polynomial.context()
    terms_by_power: list[dict[tuple[int, ...], Any]] = [{} for _ in range(polynomial.degrees()[u] + 1)]
    for monomial, coefficient in polynomial.terms():
        terms_by_power[monomial[u]][(*monomial[:u], 0, *monomial[u + 1 :])] = coefficient
    return [context.from_dict(terms) for terms in terms_by_power]


def _substitute_quotient(polynomial: Any, u: int, numerator: Any, denominator: Any) -> Any:
    """Substitute numerator/denominator for variable number u; multiply by denominator^(degree in this variable)."""
    *coefficients, total = _coefficients_in(polynomial, u)
    power = denominator**0
    for coefficient in reversed(coefficients):
        power = power * denominator
        total = total * numerator + coefficient * power
    return total


def _substitute_solution(polynomial: Any, solution: Solution) -> Quotient:
    """Substitute the values in `solution` for the unknowns; return the result in lowest terms."""
    denominator = polynomial.context().constant(1)
    for u, (numerator, denominator_of_unknown) in solution.items():
        denominator = denominator * denominator_of_unknown ** int(polynomial.degrees()[u])
        polynomial = _substitute_quotient(polynomial, u, numerator, denominator_of_unknown)
    return _in_lowest_terms(polynomial, denominator)


def _in_lowest_terms(numerator: Any, denominator: Any) -> Quotient:
    gcd = numerator.gcd(denominator)
    return numerator / gcd, denominator / gcd
