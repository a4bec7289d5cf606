"""Lift components modulo several small primes to varieties over Q, by Chinese remaindering and rational reconstruction.

A variety reconstructed from some primes must also appear modulo all other primes. This does not prove that it is a
component over Q; `scan` measures random members on the variety to confirm it.

A point with coordinates in a number field has residues modulo the primes that have a factor of degree 1 in the field.
For most fields these are more than half of all primes. Modulo each of several primes one point is chosen, no matter
which of the conjugates, and these are combined by the Chinese remainder theorem. The equations of the point are small
integer relations between products of its coordinates, which are short vectors of a lattice: an equation over Q for the
first coordinate, then equations over the field of the earlier coordinates.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from itertools import combinations, product
from math import isqrt, prod

from flint import fmpq, fmpq_mpoly, fmpz_mat

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.polynomials import primitive_part, ring
from kahanmaps.algebra.residues import chinese, rational_reconstruction, rational_vector
from kahanmaps.algebra.work import count_work
from kahanmaps.laboratory.modular_points import exponents_up_to, product_of
from kahanmaps.laboratory.scan.members import solutions
from kahanmaps.laboratory.scan.modular_components import Rows

RationalRows = tuple[tuple[fmpq, ...], ...]

_MAX_PAIRS = 100_000  # maximal number of tried pairs of affine subspaces modulo two primes
_MAX_CONJUGATES = 24  # products of two hypersurfaces modulo a prime are tried for at most so many hypersurfaces
_LOW_HEIGHT = 12  # a subspace of at most this height may be missing modulo one prime
_MIN_PRIMES = 3  # minimal number of primes modulo which a variety over Q must appear
MAX_FIELD_DEGREE = 6
SPARE_BITS = 12  # accepted relations are shorter by so many bits than relations of random residues
_MAX_FAILURES = 200  # maximal number of successive combinations that give no conjugate points
_MAX_POINTS = 24  # maximal number of points modulo a prime
_MAX_PRIMES = 14  # maximal number of combined primes


def height_bound(primes: Sequence[int]) -> int:
    """Return the largest numerator and denominator that can be reconstructed modulo the two smallest primes."""
    return isqrt((prod(sorted(primes)[:2]) - 1) // 2)


def lift_linear(
    subspaces: Mapping[int, Sequence[Rows]], everywhere: bool = True
) -> dict[RationalRows, tuple[int, ...]]:
    """Return a dict: reduced rows of affine subspaces over Q -> the primes modulo which the subspaces occur.

    A subspace must occur modulo all primes (all but one up to height 12) or, if `everywhere` is False, modulo three.

    >>> modulo = {p: [((1, 0, -pow(2, -1, p) % p), (0, 1, p - 3))] for p in (31, 37, 41)}
    >>> lift_linear(modulo)
    {((1, 0, -1/2), (0, 1, -3)): (31, 37, 41)}
    """
    subspace_sets = {p: set(rows) for p, rows in subspaces.items()}
    lifted_subspaces: dict[RationalRows, tuple[int, ...]] = {}
    pair_counts = {(p, q): len(subspaces[p]) * len(subspaces[q]) for p, q in combinations(sorted(subspaces), 2)}
    pair_count = 0
    # A subspace is lifted from two primes. Pairs of primes with few pairs of subspaces come first.
    for p, q in sorted(pair_counts, key=pair_counts.__getitem__):
        pair_count += pair_counts[p, q]
        if pair_count > _MAX_PAIRS:
            break
        count_work(15 * pair_counts[p, q])
        for rows_p, rows_q in product(subspaces[p], subspaces[q]):
            rows = _lift_rows(rows_p, p, rows_q, q)
            if rows is None or rows in lifted_subspaces:
                continue
            count_work(15 * len(subspace_sets))
            primes = tuple(r for r in sorted(subspace_sets) if residues(rows, r) in subspace_sets[r])
            height = max((max(abs(int(x.p)), int(x.q)) for row in rows for x in row), default=0)
            missing_count = sum(r not in primes and residues(rows, r) is not None for r in subspace_sets)
            if len(primes) >= _MIN_PRIMES and (not everywhere or missing_count <= (height <= _LOW_HEIGHT)):
                lifted_subspaces[rows] = primes
    return lifted_subspaces


def linear_equations(rows: RationalRows, names: Sequence[str]) -> tuple[fmpq_mpoly, ...]:
    """Return the equations of the affine subspace with the given `rows` as primitive polynomials in `names`.

    >>> linear_equations(((fmpq(1), fmpq(0), fmpq(-1, 2)),), ["a", "b"])
    (2*a - 1,)
    """
    context = ring(names)
    variables = [*context.gens(), context.constant(1)]
    equations = (sum((c * x for c, x in zip(row, variables, strict=True)), context.constant(0)) for row in rows)
    return tuple(primitive_part(equation)[1] for equation in equations)


def _lift_rows(rows_p: Rows, p: int, rows_q: Rows, q: int) -> RationalRows | None:
    rows = []
    for a, b in zip(rows_p, rows_q, strict=True):
        row = [value for entry in chinese(a, p, b, q) if (value := rational_reconstruction(entry, p * q)) is not None]
        if len(row) < len(a):
            return None
        rows.append(tuple(row))
    return tuple(rows)


def residues(rows: Sequence[Sequence[fmpq]], p: int) -> Rows | None:
    """Return the rows modulo the prime p; None if p divides a denominator."""
    if any(int(x.q) % p == 0 for row in rows for x in row):
        return None
    return tuple(tuple(int(x.p) * pow(int(x.q), -1, p) % p for x in row) for row in rows)


def lift_hypersurfaces(
    hypersurfaces: Mapping[int, Sequence[Sequence[int]]], names: Sequence[str]
) -> list[tuple[fmpq_mpoly, tuple[int, ...]]]:
    """Lift hypersurfaces modulo primes to irreducible hypersurfaces over Q; return them with their primes.

    Three kinds of lifts are tried: those of single hypersurfaces; of products of two, which may be conjugate over a
    quadratic field; and of the product of all remaining hypersurfaces. The latter product is lifted from all primes but
    one, and compared with the product modulo this prime.

    >>> circle = {p: [[1, 0, 0, p - 1, 0, p - 1]] for p in (31, 37, 41)}
    >>> lift_hypersurfaces(circle, ["a", "b"])
    [(a^2 + b^2 - 1, (31, 37, 41))]
    >>> lines = {p: [[0, 1, r], [0, 1, p - r]] for p, r in ((7, 3), (17, 6), (23, 5))}
    >>> lift_hypersurfaces(lines, ["a", "b"])
    [(a^2 - 2*b^2, (7, 17, 23))]
    """
    lifted_hypersurfaces: list[tuple[fmpq_mpoly, tuple[int, ...]]] = []
    pool = {p: [tuple(form) for form in forms] for p, forms in hypersurfaces.items()}
    for group_size in (1, 2):
        products_by_length: dict[int, dict[int, dict[Rows, tuple[tuple[int, ...], ...]]]] = {}
        for p, forms in pool.items():
            if group_size > 1 and len(forms) > _MAX_CONJUGATES:
                continue
            for group in combinations(forms, group_size):
                row = tuple(_multiply(group, p, len(names)))
                products_by_length.setdefault(len(row), {}).setdefault(p, {})[(row,)] = group
        used_forms: dict[int, set[tuple[int, ...]]] = {p: set() for p in pool}
        for by_prime in products_by_length.values():
            for rows, primes in lift_linear({p: list(groups) for p, groups in by_prime.items()}, False).items():
                lifted_hypersurfaces += [(factor, primes) for factor in _factor(rows[0], names)]
                for p in primes:
                    used_forms[p].update(by_prime[p][residues(rows, p) or ()])
        pool = {p: [form for form in forms if form not in used_forms[p]] for p, forms in pool.items()}
    factors, primes = _lift_product(pool, names)
    return lifted_hypersurfaces + [(factor, primes) for factor in factors]


def _lift_product(
    hypersurfaces: Mapping[int, Sequence[Sequence[int]]], names: Sequence[str]
) -> tuple[list[fmpq_mpoly], tuple[int, ...]]:
    """Lift the product of all hypersurfaces; return its irreducible factors over Q and the primes."""
    products = {p: _multiply(forms, p, len(names)) for p, forms in hypersurfaces.items() if forms}
    if not products:
        return [], ()
    length = Counter(map(len, products.values())).most_common(1)[0][0]
    products = {p: form for p, form in products.items() if len(form) == length}
    pivot_indices = {next(k for k, c in enumerate(form) if c) for form in products.values()}
    if len(products) < _MIN_PRIMES or len(pivot_indices) > 1:
        return [], ()
    *primes, last_prime = sorted(products)
    combined_form, modulus = products[primes[0]], primes[0]
    for p in primes[1:]:
        combined_form, modulus = chinese(combined_form, modulus, products[p], p), modulus * p
    values = rational_vector(combined_form, modulus)
    if values is None or residues([values], last_prime) != (tuple(products[last_prime]),):
        return [], ()
    return _factor(values, names), (*primes, last_prime)


def _factor(values: Sequence[fmpq], names: Sequence[str]) -> list[fmpq_mpoly]:
    """Return the primitive irreducible factors over Q of the polynomial with the coefficients `values`."""
    degree = next(d for d in range(100) if len(exponents_up_to(len(names), d)) == len(values))
    terms = {e: c for e, c in zip(exponents_up_to(len(names), degree), values, strict=True) if c != 0}
    return [primitive_part(factor)[1] for factor, _ in ring(names).from_dict(terms).factor()[1]]


def _multiply(forms: Sequence[Sequence[int]], p: int, variable_count: int) -> list[int]:
    """Return the coefficients of the product of `forms` modulo p, scaled so that the first nonzero one is 1."""

    def degree_of(form: Sequence[int]) -> int:
        return next(d for d in range(100) if len(exponents_up_to(variable_count, d)) == len(form))

    degree = sum(map(degree_of, forms))
    count_work(5 * sum(map(len, forms)) + (10 + len(exponents_up_to(variable_count, degree))) * len(forms))
    row = reduce(lambda a, b: product_of(a, b, variable_count, degree, p) or [], forms, [1])
    scale = pow(next(c for c in row if c), -1, p)
    return [c * scale % p for c in row]


def lift_conjugate_points(
    points: Mapping[int, Sequence[Sequence[int]]],
    names: Sequence[str],
    rng: random.Random,
    check: Callable[[], None] = lambda: None,
) -> list[tuple[tuple[fmpq_mpoly, ...], tuple[int, ...]]]:
    """Return, for each set of conjugate points, equations (one for each parameter), and the primes where all occur.

    Modulo at most one prime, the equations may have solutions that are not among the `points`.

    >>> roots = {p: [(x, x * x % p) for x in range(p) if (x**3 - 2) % p == 0] for p in (53, 59, 67, 71, 83, 89, 97)}
    >>> [(equations, _)] = lift_conjugate_points(roots, ["a", "b"], random.Random(0))
    >>> equations
    (a^3 - 2, a^2 - b)
    """
    point_sets = {p: {tuple(x) for x in points_p} for p, points_p in points.items()}
    remaining_points = {p: set(points_p) for p, points_p in point_sets.items() if len(points_p) <= _MAX_POINTS}
    lifted_points = []
    failure_count = 0
    while failure_count < _MAX_FAILURES and sum(map(bool, remaining_points.values())) >= _MIN_PRIMES:
        check()
        failure_count += 1
        candidate_primes = [p for p in remaining_points if remaining_points[p]]
        # Combine one random point modulo each of a few primes until its coordinates have small relations.
        values: Sequence[int] = [0] * len(names)
        modulus, equations = 1, None
        for p in rng.sample(candidate_primes, min(len(candidate_primes), _MAX_PRIMES)):
            values, modulus = chinese(values, modulus, rng.choice(sorted(remaining_points[p])), p), modulus * p
            if (equations := _search_equations(values, modulus, names)) is not None:
                break
        # The relation of the first coordinate is reducible only if the combined points are not conjugate.
        if equations is None or len(equations[0].factor()[1]) > 1:
            continue
        size = len(names)
        leading_coefficients = [
            equation[tuple(int(equation.degrees()[k]) * (i == k) for i in range(size))]
            for k, equation in enumerate(equations)
        ]
        # Modulo a prime that divides a leading coefficient some solutions are at infinity, so that none are counted.
        solution_sets = {
            p: set[tuple[int, ...]]()
            if any(int(c.p) % p == 0 for c in leading_coefficients)
            else {tuple(map(int, x)) for x in solutions(equations, range(size), [0] * size, GF(p))}
            for p in point_sets
        }
        primes = tuple(p for p in sorted(solution_sets) if solution_sets[p] and solution_sets[p] <= point_sets[p])
        if len(primes) >= _MIN_PRIMES and sum(map(bool, solution_sets.values())) <= len(primes) + 1:
            lifted_points.append((equations, primes))
            remaining_points = {p: points_p - solution_sets[p] for p, points_p in remaining_points.items()}
            failure_count = 0
    return lifted_points


def _search_equations(values: Sequence[int], modulus: int, names: Sequence[str]) -> tuple[fmpq_mpoly, ...] | None:
    """Return an equation of least degree for each coordinate; None if an equation would have large coefficients."""
    context = ring(names)
    basis = [(context.constant(1), 1)]  # pairs (product of powers of earlier coordinates, residue)
    equations = []
    for x, value in zip(context.gens(), values, strict=True):
        lower_monomials, (power, residue) = list(basis), (x, value)
        spare_bits = SPARE_BITS // len(names)
        while (relation := _search_relation([r for _, r in lower_monomials] + [residue], modulus, spare_bits)) is None:
            lower_monomials += [(a * power, r * residue % modulus) for a, r in basis]
            power, residue = power * x, residue * value % modulus
            if len(lower_monomials) > MAX_FIELD_DEGREE:
                return None
        monomials = [*(a for a, _ in lower_monomials), power]
        equations.append(primitive_part(sum((c * a for c, a in zip(relation, monomials, strict=True)), 0 * x))[1])
        basis = lower_monomials
    return tuple(equations)


def _search_relation(monomial_residues: Sequence[int], modulus: int, spare_bits: int) -> list[int] | None:
    """Return small integers c_i with sum c_i r_i = 0 modulo `modulus`, the last c_i not 0; None if there are none.

    The r_i are `monomial_residues`, r_0 = 1. Small means smaller, by `spare_bits` bits in total, than for random r_i.
    """
    size = len(monomial_residues)
    rows = [[modulus, *[0] * (size - 1)]]
    rows += [[-r, *(int(i == k) for i in range(1, size))] for k, r in enumerate(monomial_residues[1:], 1)]
    count_work(20 * size + size**3 * modulus.bit_length() / 500)
    shortest_row = min(fmpz_mat(rows).lll().tolist(), key=lambda row: max(map(abs, row)))
    height = max(abs(int(c)) for c in shortest_row)
    # Random residues have relations with (2 height + 1)^size of about `modulus`; this one must be smaller.
    is_small = (2 * height + 1) ** size << spare_bits <= modulus
    return [int(c) for c in shortest_row] if is_small and shortest_row[-1] else None
