"""Pieces modulo several small primes that belong to one variety over Q: by Chinese remainders and reconstruction.

What is reconstructed from some primes has to be there modulo the others. Nothing here proves that it is a piece of the
family over Q: that is tried on members of it.

A point with coordinates in a number field has residues modulo the primes that have a factor of degree 1 there: for most
fields more than half of the primes. Chinese remainders put one for each of several primes together, which one of the
conjugates does not matter. Small integer relations between products of the coordinates, short vectors of a lattice, are
equations: of the first coordinate over Q, and of each further one over the field of those before it.
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
from kahanmaps.algebra.work import count
from kahanmaps.laboratory.modular_points import exponents_up_to, product_of
from kahanmaps.laboratory.scan.members import solutions
from kahanmaps.laboratory.scan.modular_components import Rows

RationalRows = tuple[tuple[fmpq, ...], ...]

_MOST_PAIRS = 100_000  # of affine subspaces modulo two primes that are tried
_MOST_CONJUGATES = 24  # hypersurfaces modulo a prime of which pairs are taken
_LOW = 12  # heights up to which one prime may be bad
_AT_LEAST = 3  # primes
MAX_FIELD_DEGREE = 6
SPARE_BITS = 12  # by which the relations of a point must beat what chance would give
_TRIES = 200
_MOST_SINGLE = 24  # modulo a prime
_MOST_PRIMES = 14  # that are put together


def height_bound(primes: Sequence[int]) -> int:
    """The numerators and denominators that two of the primes suffice for."""
    low = sorted(primes)[:2]
    return isqrt((prod(low) - 1) // 2)


def lift_linear(found: Mapping[int, Sequence[Rows]], everywhere: bool = True) -> dict[RationalRows, tuple[int, ...]]:
    """Affine subspaces over Q whose residues are among those found modulo the primes: reduced rows, and these primes.

    They have to be found modulo all primes, if not `everywhere` modulo three.

    >>> modulo = {p: [((1, 0, -pow(2, -1, p) % p), (0, 1, p - 3))] for p in (31, 37, 41)}
    >>> lift_linear(modulo)
    {((1, 0, -1/2), (0, 1, -3)): (31, 37, 41)}
    """
    sets = {p: set(subspaces) for p, subspaces in found.items()}
    done: dict[RationalRows, tuple[int, ...]] = {}
    spent = 0
    for p, q in sorted(combinations(sorted(found), 2), key=lambda pair: len(found[pair[0]]) * len(found[pair[1]])):
        spent += len(found[p]) * len(found[q])
        if spent > _MOST_PAIRS:
            break
        count(15 * len(found[p]) * len(found[q]))
        for one, other in product(found[p], found[q]):
            lifted = _lifted_rows(one, p, other, q)
            if lifted is None or lifted in done:
                continue
            count(15 * len(sets))
            at = tuple(r for r in sorted(sets) if residues(lifted, r) in sets[r])
            height = max((max(abs(int(x.p)), int(x.q)) for row in lifted for x in row), default=0)
            missing = sum(r not in at and residues(lifted, r) is not None for r in sets)
            if len(at) >= _AT_LEAST and (not everywhere or missing <= (height <= _LOW)):
                done[lifted] = at
    return done


def linear_equations(rows: RationalRows, names: Sequence[str]) -> tuple[fmpq_mpoly, ...]:
    """The equations of an affine subspace, primitive polynomials.

    >>> linear_equations(((fmpq(1), fmpq(0), fmpq(-1, 2)),), ["a", "b"])
    (2*a - 1,)
    """
    context = ring(names)
    variables = [*context.gens(), context.constant(1)]
    sums = (sum((c * x for c, x in zip(row, variables, strict=True)), context.constant(0)) for row in rows)
    return tuple(primitive_part(one)[1] for one in sums)


def _lifted_rows(one: Rows, p: int, other: Rows, q: int) -> RationalRows | None:
    rows = []
    for a, b in zip(one, other, strict=True):
        row = [value for entry in chinese(a, p, b, q) if (value := rational_reconstruction(entry, p * q)) is not None]
        if len(row) < len(a):
            return None
        rows.append(tuple(row))
    return tuple(rows)


def residues(rows: Sequence[Sequence[fmpq]], p: int) -> Rows | None:
    """The rows modulo a prime, None where it divides a denominator."""
    if any(int(x.q) % p == 0 for row in rows for x in row):
        return None
    return tuple(tuple(int(x.p) * pow(int(x.q), -1, p) % p for x in row) for row in rows)


def lift_hypersurfaces(
    found: Mapping[int, Sequence[Sequence[int]]], names: Sequence[str]
) -> list[tuple[fmpq_mpoly, tuple[int, ...]]]:
    """The irreducible hypersurfaces over Q behind those modulo the primes, and these primes.

    Tried are each of them, then the products of two, which may be conjugate over a quadratic field, and the product of
    all that are left, which is lifted from all primes but one, where it has to agree.

    >>> circle = {p: [[1, 0, 0, p - 1, 0, p - 1]] for p in (31, 37, 41)}
    >>> lift_hypersurfaces(circle, ["a", "b"])
    [(a^2 + b^2 - 1, (31, 37, 41))]
    >>> lines = {p: [[0, 1, r], [0, 1, p - r]] for p, r in ((7, 3), (17, 6), (23, 5))}
    >>> lift_hypersurfaces(lines, ["a", "b"])
    [(a^2 - 2*b^2, (7, 17, 23))]
    """
    known: list[tuple[fmpq_mpoly, tuple[int, ...]]] = []
    rest = {p: [tuple(form) for form in forms] for p, forms in found.items()}
    for together in (1, 2):
        parts: dict[int, dict[int, dict[Rows, tuple[tuple[int, ...], ...]]]] = {}
        for p, forms in rest.items():
            some = list(combinations(forms, together)) if len(forms) <= _MOST_CONJUGATES or together == 1 else []
            for group in some:
                row = tuple(_product(group, p, len(names)))
                parts.setdefault(len(row), {}).setdefault(p, {})[(row,)] = group
        used: dict[int, set[tuple[int, ...]]] = {p: set() for p in rest}
        for by_prime in parts.values():
            for rows, at in lift_linear({p: list(some) for p, some in by_prime.items()}, False).items():
                known += [(factor, at) for factor in _factors(rows[0], names)]
                for p in at:
                    used[p].update(by_prime[p][residues(rows, p) or ()])
        rest = {p: [form for form in forms if form not in used[p]] for p, forms in rest.items()}
    factors, at = _lifted_product(rest, names)
    return known + [(factor, at) for factor in factors]


def _lifted_product(
    found: Mapping[int, Sequence[Sequence[int]]], names: Sequence[str]
) -> tuple[list[fmpq_mpoly], tuple[int, ...]]:
    """The factors of what the products of all polynomials are lifted to, and the primes."""
    products = {p: _product(forms, p, len(names)) for p, forms in found.items() if forms}
    if not products:
        return [], ()
    size = Counter(map(len, products.values())).most_common(1)[0][0]
    scaled = {p: form for p, form in products.items() if len(form) == size}
    if len(scaled) < _AT_LEAST or len({next(k for k, c in enumerate(form) if c) for form in scaled.values()}) > 1:
        return [], ()
    *first, last = sorted(scaled)
    together, modulus = scaled[first[0]], first[0]
    for p in first[1:]:
        together, modulus = chinese(together, modulus, scaled[p], p), modulus * p
    values = rational_vector(together, modulus)
    if values is None or residues([values], last) != (tuple(scaled[last]),):
        return [], ()
    return _factors(values, names), tuple(sorted(scaled))


def _factors(values: Sequence[fmpq], names: Sequence[str]) -> list[fmpq_mpoly]:
    """The irreducible factors over Q, primitive, of a polynomial by its coefficients."""
    degree = next(d for d in range(100) if len(exponents_up_to(len(names), d)) == len(values))
    terms = {e: c for e, c in zip(exponents_up_to(len(names), degree), values, strict=True) if c != 0}
    return [primitive_part(factor)[1] for factor, _ in ring(names).from_dict(terms).factor()[1]]


def _product(forms: Sequence[Sequence[int]], p: int, variables: int) -> list[int]:
    """The coefficients of the product of polynomials, up to its degree, the first that is not 0 being 1."""

    def degree_of(form: Sequence[int]) -> int:
        return next(d for d in range(100) if len(exponents_up_to(variables, d)) == len(form))

    top = sum(map(degree_of, forms))
    count(5 * sum(map(len, forms)) + (10 + len(exponents_up_to(variables, top))) * len(forms))
    row = reduce(lambda a, b: product_of(a, b, variables, top, p) or [], forms, [1])
    scale = pow(next(c for c in row if c), -1, p)
    return [c * scale % p for c in row]


def lift_conjugate_points(
    found: Mapping[int, Sequence[Sequence[int]]],
    names: Sequence[str],
    rng: random.Random,
    check: Callable[[], None] = lambda: None,
) -> list[tuple[tuple[fmpq_mpoly, ...], tuple[int, ...]]]:
    """Equations of points and their conjugates, one for each parameter, and the primes modulo which all are there.

    They have to be there modulo all primes but one modulo which the equations have solutions.

    >>> roots = {p: [(x, x * x % p) for x in range(p) if (x**3 - 2) % p == 0] for p in (53, 59, 67, 71, 83, 89, 97)}
    >>> [(equations, _)] = lift_conjugate_points(roots, ["a", "b"], random.Random(0))
    >>> equations
    (a^3 - 2, a^2 - b)
    """
    every = {p: {tuple(x) for x in points} for p, points in found.items()}
    rest = {p: set(points) for p, points in every.items() if len(points) <= _MOST_SINGLE}
    known = []
    tries = _TRIES
    while tries and sum(map(bool, rest.values())) >= _AT_LEAST:
        check()
        tries -= 1
        primes = [p for p in rest if rest[p]]
        # one of the points modulo each of the first few primes, until their equations stand out
        values: Sequence[int] = [0] * len(names)
        modulus, equations = 1, None
        for p in rng.sample(primes, min(len(primes), _MOST_PRIMES)):
            values, modulus = chinese(values, modulus, rng.choice(sorted(rest[p])), p), modulus * p
            if (equations := _equations(values, modulus, names)) is not None:
                break
        # of two points that are not conjugate the first coordinates have a product of polynomials
        if equations is None or len(equations[0].factor()[1]) > 1:
            continue
        there = {p: _residues(equations, p) for p in every}
        at = tuple(p for p in sorted(there) if there[p] and there[p] <= every[p])
        if len(at) >= _AT_LEAST and sum(map(bool, there.values())) <= len(at) + 1:
            known.append((equations, at))
            rest = {p: points - there[p] for p, points in rest.items()}
            tries = _TRIES
    return known


def _equations(values: Sequence[int], modulus: int, names: Sequence[str]) -> tuple[fmpq_mpoly, ...] | None:
    """A relation for each coordinate, of the smallest degree in it; None where there are no small ones."""
    context = ring(names)
    basis = [(context.constant(1), 1)]  # of the field of the coordinates so far: products and their residues
    found = []
    for x, value in zip(context.gens(), values, strict=True):
        lower, (power, residue) = list(basis), (x, value)
        while (relation := _relation([r for _, r in lower] + [residue], modulus, SPARE_BITS // len(names))) is None:
            lower += [(a * power, r * residue % modulus) for a, r in basis]
            power, residue = power * x, residue * value % modulus
            if len(lower) > MAX_FIELD_DEGREE:
                return None
        products = [*(a for a, _ in lower), power]
        found.append(primitive_part(sum((c * a for c, a in zip(relation, products, strict=True)), 0 * x))[1])
        basis = lower
    return tuple(found)


def _relation(residues: Sequence[int], modulus: int, spare: int) -> list[int] | None:
    """Small integers with sum c_i r_i = 0 modulo `modulus`, the last one not 0; the first residue is 1."""
    size = len(residues)
    rows = [[modulus, *[0] * (size - 1)]]
    rows += [[-r, *(int(i == k) for i in range(1, size))] for k, r in enumerate(residues[1:], 1)]
    count(20 * size + size**3 * modulus.bit_length() / 500)
    shortest = min(fmpz_mat(rows).lll().tolist(), key=lambda row: max(map(abs, row)))
    height = max(abs(int(c)) for c in shortest)
    small = (2 * height + 1) ** size << spare <= modulus
    return [int(c) for c in shortest] if small and shortest[-1] else None


def _residues(equations: Sequence[fmpq_mpoly], p: int) -> set[tuple[int, ...]]:
    """The solutions modulo a prime; none where it divides a leading coefficient."""
    size = len(equations)
    for k, one in enumerate(equations):
        highest = tuple(int(one.degrees()[k]) * (i == k) for i in range(size))
        if int(one[highest].p) % p == 0:
            return set()
    return {tuple(map(int, x)) for x in solutions(equations, range(size), [0] * size, GF(p))}
