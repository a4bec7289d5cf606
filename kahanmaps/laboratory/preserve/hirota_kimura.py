"""Hirota-Kimura bases: polynomial relations along orbits, modulo primes.

For a set of polynomials phi_1, ..., phi_M the null space K(x) of the orbit of x consists of all vectors c such that
sum c_j phi_j = 0 at every point of the orbit. The reduced echelon basis of K(x) depends on the orbit only. So an entry
of the basis that is not the same number for all orbits is an integral of the map. The rank of the gradients of these
relations at a point of the orbit is the codimension of the variety that they define, and the number of independent
integrals that they show. All this is measured, modulo two primes, for two eps and several orbits, and proves nothing.

`sparse_relations` writes out the relations of one degree: their monomials, numbers and integrals. It takes the reduced
echelon basis of the null space with monomials of the highest degree first, and leaves out relations that relations of
lower degrees imply. A coefficient that differs for two orbits is an integral, named c1, c2, ... Any other coefficient
is a number times a power of eps or, if no simple number fits, a function of eps, named e1, e2, ...
Source: petrera-pfadler-suris-2009.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import comb, inf
from operator import ge
from typing import Any

from flint import fmpq_mpoly, nmod_mat

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.modular_matrices import (
    echelon,
    integers,
    kernel,
    matrix,
    multiply,
    null_space,
    rank,
    reduced_echelon_form,
    split_columns,
)
from kahanmaps.algebra.polynomials import evaluate, names_of, ring
from kahanmaps.algebra.printing import attributes, format_number, format_polynomial
from kahanmaps.algebra.residues import chinese, simple_fraction
from kahanmaps.algebra.work import SPENT, Budget, count_work
from kahanmaps.laboratory.modular_points import (
    Exponent,
    ModularMap,
    Point,
    exponents_up_to,
    monomial_derivatives,
    monomial_index,
    monomial_tables,
)

_SPARE = 8  # points beyond the number of unknowns; a wrong relation holds at each with probability 1/p
MAX_UNKNOWNS = 1800  # monomials up to a degree
MAX_INDEPENDENT = 800  # monomials that no relation of lower degree reduces; their elimination takes about a second
_SETTLED_DEGREES = 4  # degrees that must be tried before a profile counts as settled
_SPARE_BITS = 40  # a number must have so many bits less than a random residue modulo two primes, which has 122 bits
_POWERS = (0, 2, 1, 4, 3, 6, -2, -1, -4, -3, -6)  # exponents of eps, in the order of the trials
_MAX_DEGREE = {1: 8, 2: 14, 3: 10, 4: 8, 5: 7, 6: 7, 7: 5}  # by dimension


@dataclass(frozen=True)
class OrbitRelations:
    """The space of the polynomials up to a degree that vanish along one orbit; `dimension` is its dimension.

    `rank` is that of the monomials on the orbit. `form` is the reduced echelon form of the values of the
    monomials in `exponents_up_to`. If multiples of leading monomials were left out, `form` has only the other
    monomials, whose relations imply all relations. `leading` are the monomials that depend linearly on earlier ones;
    all multiples of leading monomials are leading. `normals` is a basis of the span of the gradients of the relations
    at `point`, a point of the orbit. `period` is the number of points of a closed orbit, otherwise None.
    """

    form: nmod_mat
    rank: int
    dimension: int
    normals: list[list[int]]
    period: int | None
    point: Point
    leading: frozenset[Exponent] = frozenset()

    @property
    def codimension(self) -> int:
        """The rank of the gradients of the relations at `point`."""
        return len(self.normals)

    @cached_property
    def vectors(self) -> list[list[int]]:
        """The reduced echelon basis of the relations; it requires that no monomials were left out."""
        return echelon(kernel(self.form, self.rank), self.form.modulus())


@dataclass(frozen=True)
class Profile:
    """The dimensions of the spaces of polynomials of degree 1, 2, ... that vanish along a generic orbit.

    `codimensions` are the codimensions of the varieties that these polynomials define, and `with_known` is the largest
    codimension if the known integrals are added. `period` is the number of points of closed orbits, else None. If
    `maps_agree`, all maps gave the same numbers. Unless `complete`, `stop_reason` says why some degrees were not tried.
    """

    dim: int
    nullities: tuple[int, ...]
    codimensions: tuple[int, ...]
    period: int | None
    maps_agree: bool
    complete: bool
    with_known: int = 0
    stop_reason: str = ""

    @property
    def codimension(self) -> int:
        """The number of independent integrals that the relations show."""
        return max(self.codimensions, default=0)

    @property
    def is_settled(self) -> bool:
        """Whether at least 4 degrees were tried and the last one showed no more integrals than the one before."""
        return self.degree >= _SETTLED_DEGREES and self.codimensions[-1] == self.codimensions[-2]

    @property
    def first_degree(self) -> int | None:
        """The least degree in which a polynomial vanishes along orbits."""
        return next((d for d, nullity in enumerate(self.nullities, 1) if nullity), None)

    @property
    def degree(self) -> int:
        """The largest degree that was tried."""
        return len(self.nullities)

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        names = ("nullities", "codimensions", "codimension", "period")
        return attributes(self, *names, "maps_agree", "complete")


def relations_on_orbit(
    map_: ModularMap, degree: int, rank_bound: int | None = None, leading: frozenset[Exponent] = frozenset()
) -> OrbitRelations:
    """Compute the polynomials of degree at most `degree` that vanish along a random orbit modulo a prime.

    `rank_bound` is an upper bound of the number of independent monomials, if one is known: `rank_bound` points and a
    few more suffice. On a generic orbit the rank of the values grows with each point until it is final: if all
    relations of the points 0 to k hold at point k + 1, those of the points 1 to k + 1 hold at point k + 2, and so on.
    `leading` are the leading monomials of relations of lower degrees; proper multiples of these are left out, since
    they are dependent. Raises NoPoint if orbits meet the singular set.
    """
    exponents = exponents_up_to(map_.dim, degree)
    support = _indices_of_non_multiples(map_.dim, degree, leading)
    rank_bound = len(support) if rank_bound is None else min(rank_bound, len(support))
    evaluated_support = support if len(support) < len(exponents) else None
    rows, point, period = map_.along_orbit(degree, rank_bound + _SPARE, evaluated_support)
    form, row_rank = reduced_echelon_form(matrix(rows, map_.prime))
    pivot_columns, free_columns = split_columns(form, row_rank)
    new_leading = frozenset(exponents[support[k]] for k in free_columns)
    if row_rank > rank_bound or not leading <= new_leading:
        return relations_on_orbit(map_, degree)  # `rank_bound` or `leading` came from a special orbit
    # A relation is a dependent monomial minus a combination of independent ones. Differentiate it at the point.
    count_work(len(exponents) / 2 + map_.dim * len(support) / 3)
    monomial_gradients = [[row[k] for k in support] for row in monomial_derivatives(point, degree, map_.prime)]
    pivot_gradients = [[row[k] for k in pivot_columns] + [0] * (form.nrows() - row_rank) for row in monomial_gradients]
    gradients = matrix(monomial_gradients, map_.prime) - multiply(matrix(pivot_gradients, map_.prime), form)
    normals = echelon(integers(gradients.transpose()), map_.prime)
    return OrbitRelations(form, row_rank, len(exponents) - row_rank, normals, period, point, new_leading)


def _indices_of_non_multiples(dim: int, degree: int, leading: frozenset[Exponent]) -> list[int]:
    """Return the indices, in `exponents_up_to`, of the monomials that are not proper multiples of leading ones."""
    exponents = exponents_up_to(dim, degree)
    is_multiple: list[bool] = []  # of a leading monomial, or equal to one
    support = []
    for k, (exponent, factors) in enumerate(zip(exponents, monomial_tables(dim, degree), strict=True)):
        is_proper_multiple = any(is_multiple[quotient_index] for _, _, quotient_index in factors)
        is_multiple.append(is_proper_multiple or exponent in leading)
        if not is_proper_multiple:
            support.append(k)
    return support


def span_of_relations(map_: ModularMap, degree: int, max_dimension: float = inf) -> list[list[int]]:
    """Return the reduced echelon basis of the span of the relations of all orbits.

    Orbits are added until two successive ones do not enlarge the span, or its dimension exceeds `max_dimension`.
    """
    first_orbit, unchanged_count = relations_on_orbit(map_, degree), 0
    basis, rank_bound = first_orbit.vectors, first_orbit.rank
    while basis and unchanged_count < 2 and len(basis) <= max_dimension:
        enlarged_basis = echelon([*basis, *relations_on_orbit(map_, degree, rank_bound).vectors], map_.prime)
        unchanged_count = unchanged_count + 1 if len(enlarged_basis) == len(basis) else 0
        basis = enlarged_basis
    return basis


def orbit_profile(
    maps: Sequence[ModularMap],
    *,
    max_degree: int | None = None,
    budget: Budget | None = None,
    known_gradients: Callable[[ModularMap, Point], list[list[int]]] = lambda map_, x: [],
    progress: Callable[[str], None] = lambda _: None,
) -> Profile:
    """Measure the relations of degree 1, 2, ... on one orbit of each map; their dimensions should agree.

    Args:
        maps: the maps, with different primes and, if eps is not given, different eps.
        max_degree: the largest degree; by default it depends on the dimension and on the number of monomials.
        budget: no further degree is tried after the budget is spent; None means no limit.
        known_gradients: returns the gradients of known integrals at a point.
        progress: called with each degree before it is tried.

    Returns:
        The `Profile`, measured. The search ends at `max_degree`, or when the codimension is dim - 1, so that orbits lie
        on curves (dim if orbits close). It ends early with too many monomials or a spent budget: `complete` is False.

    Raises:
        NoPoint: if orbits meet the singular set.

    Source: petrera-pfadler-suris-2009.

    >>> from kahanmaps.laboratory.laboratory import Laboratory
    >>> from kahanmaps.documents.catalog import load
    >>> profile = orbit_profile(Laboratory(load("euler_top")).maps)
    >>> profile.nullities, profile.codimension
    ((0, 2), 2)
    """
    dim = maps[0].dim
    budget = budget or Budget()
    nullities: list[int] = []
    codimensions: list[int] = []
    with_known = 0
    maps_agree, period, reason = True, None, ""
    leading_by_map: list[frozenset[Exponent]] = [frozenset()] * len(maps)
    last_degree = max_degree if max_degree is not None else _MAX_DEGREE.get(dim, 4)
    if max_degree is None:
        last_degree = max((d for d in range(1, last_degree + 1) if comb(dim + d, d) <= MAX_UNKNOWNS), default=1)
    max_support = MAX_UNKNOWNS if max_degree is not None else MAX_INDEPENDENT
    for degree in range(1, last_degree + 1):
        if comb(dim + degree, degree) > MAX_UNKNOWNS or any(
            len(_indices_of_non_multiples(dim, degree, leading)) > max_support for leading in leading_by_map
        ):
            reason = "too many unknowns"
        elif budget.is_spent:
            reason = SPENT
        if reason:
            break
        progress(f"relations of degree {degree} along orbits")
        orbits = [
            relations_on_orbit(map_, degree, leading=leading)
            for map_, leading in zip(maps, leading_by_map, strict=True)
        ]
        leading_by_map = [orbit.leading for orbit in orbits]
        maps_agree = maps_agree and len({(orbit.dimension, orbit.codimension) for orbit in orbits}) == 1
        # A special orbit never has fewer relations than a generic one, so the minimum counts.
        nullities.append(min(orbit.dimension for orbit in orbits))
        codimensions.append(min(orbit.codimension for orbit in orbits))
        ranks = [
            rank([*orbit.normals, *known_gradients(map_, orbit.point)], map_.prime)
            for map_, orbit in zip(maps, orbits, strict=True)
        ]
        with_known = max(with_known, min(ranks))
        if period is None and len({orbit.period for orbit in orbits}) == 1:
            period = orbits[0].period
        # A closed orbit is a finite set, even if relations of low degree only show a curve through its points.
        if codimensions[-1] >= (dim - 1 if period is None else dim):
            break
    return Profile(dim, tuple(nullities), tuple(codimensions), period, maps_agree, not reason, with_known, reason)


@dataclass(frozen=True)
class Basis:
    """A Hirota-Kimura basis: the set of functions, and the null space of a generic orbit.

    `constant` says for each entry of the reduced echelon basis whether it is the same number for all orbits; if not, it
    is an integral. If `orbits_agree`, all orbits gave this `dimension`. `period` is the period if orbits close.
    """

    functions: tuple[str, ...]
    dimension: int
    constant: tuple[tuple[bool, ...], ...]
    orbits_agree: bool
    period: int | None = None

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        integrals = [[not is_constant for is_constant in row] for row in self.constant]
        agreement = attributes(self, "orbits_agree", "period")
        return {**attributes(self, "functions", "dimension"), "integrals": integrals, **agreement}


def hirota_kimura_basis(maps: Sequence[ModularMap], functions: Sequence[fmpq_mpoly], names: Sequence[str]) -> Basis:
    """Measure the null space of the given polynomials along orbits, on two orbits of each of the maps.

    Args:
        maps: maps of one system, with different primes.
        functions: at least one exact polynomial in the variables of the system, or in the variables and their iterates.
        names: the texts of the functions.

    Returns:
        The `Basis`, measured; its dimension is the smallest one of all orbits.

    Raises:
        NoPoint: if orbits meet the singular set.

    Source: petrera-pfadler-suris-2009.

    >>> from kahanmaps.laboratory.laboratory import Laboratory
    >>> from kahanmaps.documents.catalog import load
    >>> from kahanmaps.documents.structured_facts import relation_functions
    >>> top, squares = load("euler_top"), ["x1^2", "x2^2", "x3^2", "1"]
    >>> hirota_kimura_basis(Laboratory(top).maps, relation_functions(squares, top.variables), squares).dimension
    2
    """
    bases: list[list[list[int]]] = []
    periods: set[int | None] = set()
    point_count = len(functions) + _SPARE
    max_shift = len(names_of(functions[0])) // maps[0].dim - 1
    are_constant: list[list[bool]] | None = None
    for map_ in maps:
        field = GF(map_.prime)
        two_bases: list[list[list[int]]] = []
        for _ in range(2):
            points = map_.orbit(point_count + max_shift)
            is_closed = len(points) < point_count + max_shift  # a cycle, whose points are then repeated
            periods.add(len(points) if is_closed else None)
            orbit = [points[k % len(points)] for k in range(len(points) + max_shift * is_closed)]
            rows = [
                [
                    int(evaluate(function, field, [field.convert(c) for x in segment for c in x]))
                    for function in functions
                ]
                for segment in zip(*(orbit[k : k + len(orbit) - max_shift] for k in range(max_shift + 1)), strict=True)
            ]
            two_bases.append(null_space(rows, len(functions), map_.prime))
        bases += two_bases
        # An entry of the reduced basis that is equal on two orbits of one map is a constant. Every other entry depends
        # on the orbit and is the value of an integral.
        if len(two_bases[0]) == len(two_bases[1]):
            are_equal = [[a == b for a, b in zip(u, v, strict=True)] for u, v in zip(*two_bases, strict=True)]
            are_constant = are_equal if are_constant is None or len(are_constant) != len(are_equal) else are_constant
    dimension = min(len(basis) for basis in bases)
    constant = are_constant if are_constant is not None and len(are_constant) == dimension else []
    return Basis(
        tuple(names),
        dimension,
        tuple(tuple(row) for row in constant),
        len({len(basis) for basis in bases}) == 1,
        periods.pop() if len(periods) == 1 else None,
    )


@dataclass(frozen=True)
class SparseRelation:
    """A polynomial with integrals as coefficients that vanishes along every orbit.

    `terms` are pairs of a monomial and its coefficient. A coefficient is the text of a number, perhaps with a power of
    eps, or a name such as "c3" of an integral or "e1" of a function of eps; `integrals` and `functions_of_eps` list
    these names.
    """

    terms: tuple[tuple[str, str], ...]
    integrals: tuple[str, ...] = ()
    functions_of_eps: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """The equation, e.g. m1^2 + m2^2 + c1*p3^2 + c2 = 0."""
        terms = []
        for monomial, coefficient in self.terms:
            if monomial == "1":
                terms.append(coefficient)
            elif coefficient in ("1", "-1"):
                terms.append(coefficient[:-1] + monomial)
            else:
                terms.append(f"{coefficient}*{monomial}")
        return " + ".join(terms).replace("+ -", "- ") + " = 0"

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the integrals and functions of eps in the coefficients."""
        return tuple(text for _, text in self.terms if text in self.integrals or text in self.functions_of_eps)


def sparse_relations(
    maps: Sequence[ModularMap], degree: int, variables: Sequence[str], max_terms: int = 12, first: int = 1
) -> tuple[SparseRelation, ...] | None:
    """Return the relations of degree `degree` that lower degrees do not imply; None if orbits disagree.

    `maps` are two or more maps of one system, with different primes. Relations with more than `max_terms` terms are
    left out. The integrals in all these relations are numbered from `first` on; equal integrals have the same name.
    Raises NoPoint if orbits meet the singular set.

    Source: petrera-pfadler-suris-2009.

    >>> from kahanmaps.laboratory.laboratory import Laboratory
    >>> from kahanmaps.documents.catalog import load
    >>> top = load("euler_top")
    >>> [relation.text for relation in sparse_relations(Laboratory(top).maps, 2, top.variables)]
    ['x1^2 + c1*x3^2 + c2 = 0', 'x2^2 + c3*x3^2 + c4 = 0']
    """
    support = _descending_exponents(maps[0].dim, degree)
    tables = [_relation_basis(map_, degree) for map_ in (maps[0], maps[0], maps[1])]
    patterns = {tuple(tuple(bool(c) for c in row) for row in table) for table in tables}
    if len(patterns) != 1:
        return None
    leading = []  # monomials; a relation whose leading monomial is a multiple of one of these is implied
    if degree > 1:
        lower_exponents = _descending_exponents(maps[0].dim, degree - 1)
        leading = [
            lower_exponents[next(k for k, c in enumerate(row) if c)] for row in _relation_basis(maps[0], degree - 1)
        ]
    relations, context = [], ring(variables)
    # Letters for the names c1, c2, ... and e1, e2, ... such that no variable has one of these names.
    letters_in_use = {name.rstrip("0123456789") for name in variables if name[-1].isdigit()}
    integral_letter, eps_letter = (
        next((c for c in letters if c not in letters_in_use), f"{letters[0]}_") for letters in ("ckCK", "esES")
    )
    names: dict[tuple[int, int, int], str] = {}
    functions: dict[tuple[int, int], str] = {}  # of eps
    # Two orbits of the first map distinguish integrals from constants; constants are reconstructed from both maps.
    for row, orbit_row, map_row in zip(*tables, strict=True):
        columns = [k for k, entry in enumerate(row) if entry]
        is_implied = any(all(map(ge, support[columns[0]], divisor)) for divisor in leading)
        if is_implied or len(columns) > max_terms:
            continue
        terms = []
        for k in columns:
            if row[k] != orbit_row[k]:
                key = row[k], orbit_row[k], map_row[k]
                text = names.setdefault(key, f"{integral_letter}{first + len(names)}")
            else:
                number = _number_text(row[k], map_row[k], maps[0], maps[1])
                text = number or functions.setdefault((row[k], map_row[k]), f"{eps_letter}{first + len(functions)}")
            terms.append((format_polynomial(context.from_dict({support[k]: 1})), text))
        relations.append(
            SparseRelation(
                tuple(terms),
                tuple(text for _, text in terms if text in names.values()),
                tuple(text for _, text in terms if text in functions.values()),
            )
        )
    return tuple(relations)


def _descending_exponents(dim: int, degree: int) -> list[tuple[int, ...]]:
    """Return the exponents of the monomials of degree at most `degree`, the highest degree first."""
    return sorted(exponents_up_to(dim, degree), key=lambda e: -sum(e))


def _relation_basis(map_: ModularMap, degree: int) -> list[list[int]]:
    """Return the reduced echelon basis of the relations of a random orbit, on `_descending_exponents`."""
    order = [monomial_index(map_.dim, degree)[exponent] for exponent in _descending_exponents(map_.dim, degree)]
    return echelon([[v[k] for k in order] for v in relations_on_orbit(map_, degree).vectors], map_.prime)


def _number_text(coefficient: int, other_coefficient: int, map_: ModularMap, other_map: ModularMap) -> str | None:
    """Return a coefficient, given modulo two primes, as a simple number times a power of eps; None if none fits."""
    for power in _POWERS:
        residues = [
            [residue * pow(modular_map.eps, -power, modular_map.prime) % modular_map.prime]
            for residue, modular_map in ((coefficient, map_), (other_coefficient, other_map))
        ]
        [residue] = chinese(residues[0], map_.prime, residues[1], other_map.prime)
        count_work(60)
        value = simple_fraction(residue, map_.prime * other_map.prime, _SPARE_BITS)
        if value is not None:
            text, q = format_number(value), "" if value.q == 1 else f"{value.q}*"
            if power == 0:
                return text
            eps_text = "eps" if abs(power) == 1 else f"eps^{abs(power)}"
            if power < 0:
                return f"{value.p}/({q}{eps_text})" if q else f"{value.p}/{eps_text}"
            return f"{text}*{eps_text}".replace("1*", "", 1) if abs(value) == 1 else f"{text}*{eps_text}"
    return None
