"""Proofs of the growth of degrees, for monomial maps and for maps with a linear iterate.

A monomial map x~_i = c_i x^(a_i) has the exponent matrix A with rows a_i, and its n-th iterate has the exponent matrix
A^n. The dynamical degree is the spectral radius of A (hasselblatt-propp-2007). If the N-th iterate of a map has degree
1 on projective space, the degrees d_n of the iterates satisfy d_(n + N) = d_n; this is proved by composing formulas.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import reduce
from typing import Any

import flint
from flint import fmpq, fmpz_mat, fmpz_poly

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.functions import BudgetExceeded, FunctionField
from kahanmaps.algebra.polynomials import degree_in
from kahanmaps.algebra.printing import attributes
from kahanmaps.errors import InputError, SingularStep
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.growth.recurrences import GrowthRate, growth_rate, polynomial_growth
from kahanmaps.maps.implicit import MapFamily

_BUDGET = 1_000_000  # maximal number of products of terms, to compose formulas
_MAX_FACTORS = 24  # maximal number of factors of a composition
_MAX_ORDER = 12  # maximal order of a linear iterate that is tested
_MAX_DIMENSION = 8  # for the spectral radius, which needs factors of polynomials of degree 2 dim^2
_BITS = 256  # initial precision of the roots
_LARGEST_ORDER = 60  # maximal finite order of an integer matrix with at most 8 rows


@dataclass(frozen=True)
class GrowthProof:
    """A proved statement about the degrees of all iterates.

    The degrees grow as n^power rate^n, where `rate` is the dynamical degree; `reason` is the proof as a phrase. If
    `period` is a number N, the N-th iterate is linear; `is_identity` says whether it is the identity.
    """

    growth: Growth
    power: int
    rate: GrowthRate
    reason: str
    period: int | None = None
    is_identity: bool = False

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        return attributes(self, "reason", "period", "is_identity")


def exponent_matrix(map_: MapFamily, eps: fmpq | None) -> fmpz_mat | None:
    """Return the exponent matrix of a map, at eps or (None) over Q(eps); None if the map is not monomial.

    Row i has the exponents a_i of x~_i = c_i x^(a_i). The matrix of a composition is the product of the matrices.

    >>> from kahanmaps.algebra.parsing import parse_rational_function
    >>> from kahanmaps.maps.explicit import explicit_map
    >>> image = [parse_rational_function(text, ["x", "y", "eps"]) for text in ("3*y", "eps*y^2/x")]
    >>> exponent_matrix(explicit_map(["x", "y"], image), None).tolist()
    [[0, 1], [-1, 2]]
    """
    if map_.symbols or map_.root is not None:
        return None
    field = FunctionField(["eps"]) if eps is None and map_.has_eps else QQ
    value = field.variables[0] if isinstance(field, FunctionField) else fmpq(1) if eps is None else eps
    try:
        equations = map_.at(value, field).equations
    except (BudgetExceeded, InputError):  # InputError: the inverse of a factor is not known
        return None
    if len(equations) > _MAX_FACTORS:
        return None
    n = map_.dim
    product = fmpz_mat([[int(i == j) for j in range(n)] for i in range(n)])
    for equation in equations:  # each row must have the form m x~_j = r with monomials m and r
        rows_by_variable = {}
        for *entries, right_side in equation.terms:
            columns = [j for j, entry in enumerate(entries) if entry]
            if len(columns) != 1 or len(entries[columns[0]]) != 1 or len(right_side) != 1:
                return None
            ((left_monomial, _),), ((right_monomial, _),) = entries[columns[0]], right_side
            left_exponents, right_exponents = equation.exponents[left_monomial], equation.exponents[right_monomial]
            rows_by_variable[columns[0]] = [right_exponents[k] - left_exponents[k] for k in range(n)]
        if len(rows_by_variable) < n:
            return None
        product = fmpz_mat([rows_by_variable[j] for j in range(n)]) * product
    return None if product.det() == 0 else product  # a singular matrix means a map that is not dominant


def monomial_degree(matrix: fmpz_mat) -> int:
    """Return the degree, on projective space, of a monomial map with the exponent matrix `matrix`.

    >>> monomial_degree(fmpz_mat([[0, 1], [-1, 0]])), monomial_degree(fmpz_mat([[2, 1], [1, 1]]))
    (2, 3)
    """
    rows: list[list[int]] = [[int(entry) for entry in row] for row in matrix.tolist()]
    # `powers`: the exponents of the X_j in the least common denominator, the last homogeneous coordinate.
    powers = [max(0, *(-entry for entry in column)) for column in zip(*rows, strict=True)]
    degree: int = sum(powers) + max(0, *(sum(row) for row in rows))
    return degree


def monomial_growth(matrix: fmpz_mat) -> GrowthProof | None:
    """Return how the degrees of a monomial map Phi with exponent matrix A grow; None in dimensions above 8.

    Reason: deg(Phi^n), divided by the largest modulus of an entry of A^n, lies between two positive constants.
    """
    if matrix.nrows() > _MAX_DIMENSION:
        return None
    rate = spectral_radius(matrix)
    power = rate.multiplicity - 1
    rows = [[int(entry) for entry in row] for row in matrix.tolist()]
    if rate.minimal_polynomial != fmpz_poly([-1, 1]):
        reason = f"the spectral radius of the exponent matrix {rows} of a monomial map"
        return GrowthProof(Growth.EXPONENTIAL, power, rate, reason)
    return GrowthProof(polynomial_growth(power), power, rate, f"powers of the exponent matrix {rows} of a monomial map")


def monomial_period(map_: MapFamily, eps: fmpq | None, matrix: fmpz_mat) -> GrowthProof | None:
    """Prove that a monomial map with exponent matrix A is periodic; return None without a proof, or for the identity.

    If A^n = I, the n-th iterate multiplies each variable by a rational number or function of eps. So the map is
    periodic only if this iterate has order 1 or 2.
    """
    identity = matrix**0
    order = next((n for n in range(1, _LARGEST_ORDER + 1) if matrix**n == identity), None)
    periods = [] if order is None else [order, 2 * order]
    proofs = (linear_iterate(map_, eps, period) for period in periods)
    proof_of_period = next((proof for proof in proofs if proof is not None and proof.is_identity), None)
    return None if proof_of_period is None or proof_of_period.period == 1 else proof_of_period


def spectral_radius(matrix: fmpz_mat) -> GrowthRate:
    """Return the largest modulus of an eigenvalue (exact); its `multiplicity` is the size of the largest Jordan block.

    The matrix must be invertible. Only Jordan blocks of eigenvalues with the largest modulus count.

    >>> spectral_radius(fmpz_mat([[2, 1], [1, 1]])).text
    '2.61803398874989484820, root of t^2 - 3*t + 1'
    >>> spectral_radius(fmpz_mat([[0, 1, 0], [0, 0, 1], [-1, -1, 0]])).text
    '1.21060779440608593277, root of t^6 - t^4 - 1'
    """
    minimal_factors = [(factor, int(k)) for factor, k in matrix.minpoly().factor()[1]]
    # The roots of the characteristic polynomial of the Kronecker square are all products of two eigenvalues. For an
    # eigenvalue e, |e|^2 = e conj(e) is such a product; the largest real root is the squared spectral radius.
    rows = matrix.tolist()
    kronecker_square = fmpz_mat([[a * b for a in row for b in other_row] for row in rows for other_row in rows])
    product_factors = [factor for factor, _ in kronecker_square.charpoly().factor()[1]]
    polynomials = [g for factor in product_factors for g, _ in factor(fmpz_poly([0, 0, 1])).factor()[1]]
    bits = _BITS
    while True:
        with flint.ctx.workprec(bits):
            polynomials_with_roots: list[tuple[fmpz_poly, Any]] = [(g, g.complex_roots()) for g in polynomials]
            real_roots = [(root.real, g) for g, roots in polynomials_with_roots for root, _ in roots if root.imag == 0]
            (radius, polynomial), *other_roots = sorted(real_roots, key=lambda pair: pair[0].mid().fmpq(), reverse=True)
            eigenvalues: list[tuple[Any, int]] = [(factor.complex_roots(), k) for factor, k in minimal_factors]
            moduli = [(abs(root), k) for roots, k in eigenvalues for root, _ in roots]
            largest_moduli = [(modulus, k) for modulus, k in moduli if modulus.overlaps(radius)]
            # Each modulus equals a real root. So if its ball meets the ball of only one root, it equals this root.
            if all(radius > other for other, _ in other_roots) and not any(
                modulus.overlaps(other) for modulus, _ in largest_moduli for other, _ in other_roots
            ):
                return growth_rate(polynomial, radius, max(k for _, k in largest_moduli))
        bits *= 2


def linear_iterate(map_: MapFamily, eps: fmpq | None, period: int) -> GrowthProof | None:
    """Prove that the iterate Phi^period is linear on projective space, or the identity, at one eps or over Q(eps).

    Exact, by composing formulas. Returns None if the iterate is not linear, or if the formulas have too many terms. If
    it is linear, its powers up to the 12th are computed; if one of them is the identity, the proof states this.
    """
    if map_.symbols or map_.root is not None:
        return None
    is_generic = eps is None and map_.has_eps
    field = FunctionField([*map_.variables, *(["eps"] if is_generic else [])], _BUDGET, reduces=True)
    n = map_.dim
    variables = tuple(field.variables[:n])
    try:
        map_over_field = map_.at(field.variables[-1] if is_generic else fmpq(1) if eps is None else eps, field)
        point: tuple[Any, ...] = variables
        for _ in range(period):
            point = map_over_field.step(point)
        is_identity = all(field.equal(x, y) for x, y in zip(point, variables, strict=True))
    except (BudgetExceeded, SingularStep):
        return None
    denominator = reduce(lambda P, Q: P * (Q / P.gcd(Q)), (entry.denominator for entry in point))
    forms = [entry.numerator * (denominator / entry.denominator) for entry in point] + [denominator]
    # The forms have no common factor, so that their degree is the degree of the iterate on projective space.
    if not is_identity and max(degree_in(form, n) for form in forms) != 1:
        return None
    linear_period = period
    with suppress(BudgetExceeded, SingularStep):
        while not is_identity and period < _MAX_ORDER * linear_period:
            for _ in range(linear_period):
                point = map_over_field.step(point)
            period += linear_period
            is_identity = all(field.equal(x, y) for x, y in zip(point, variables, strict=True))
    period = period if is_identity else linear_period
    iterate_text = "the map" if period == 1 else f"iterate {period}"
    reason = f"Phi^{period} is the identity" if is_identity else f"{iterate_text} is linear on projective space"
    return GrowthProof(Growth.BOUNDED, 0, GrowthRate(fmpz_poly([-1, 1]), "1", "1", 1), reason, period, is_identity)
