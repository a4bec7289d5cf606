"""Cofactors that discrete Darboux polynomials of a map can be expected to have.

P o Phi = C P with polynomials P and a rational function C. The zeros and poles of C lie on what Phi contracts, which
the Jacobi determinant shows: for Kahan maps det dPhi(x) = det(I + eps f'(x~))/det(I - eps f'(x)), and candidates are
the products of

    D_i(x~, -eps)/D_i(x, eps)   for the irreducible factors D_i of det(I - eps f'(x)) over Q,
    l(x~)/l(x)                  for the affine l with l' = l L, which are Darboux polynomials themselves.

A polynomial that is even in eps has a cofactor with C(x, eps) C(x~, -eps) = 1, as these have. For other maps they are
the products of the irreducible factors of det dPhi(x), and of 1/det M(x), each times any number: which numbers there
are is an eigenvalue problem, and they change with the scales of the variables. Source: celledoni-2019.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import product as cartesian
from math import prod
from operator import sub
from typing import Any

from flint import fmpq, fmpq_mpoly, nmod, nmod_mpoly, nmod_mpoly_ctx

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.functions import BudgetExceeded, Function, FunctionField, FunctionMatrix
from kahanmaps.algebra.modular_matrices import combine, echelon, integers, matrix, multiply, null_space, pivots, rank
from kahanmaps.algebra.polynomials import degree_in, evaluate, irreducible_factors, substitute
from kahanmaps.algebra.printing import format_polynomial, format_product
from kahanmaps.algebra.work import SPENT, Budget
from kahanmaps.algebra.work import count as count_work
from kahanmaps.invariants.phase_functions import jacobian_determinant_sides
from kahanmaps.laboratory.modular_points import Exponent, ModularMap, Point, exponents_up_to, gradient_values, places_of
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import (
    DarbouxSpace,
    TwoPointBasis,
    gradient_rank,
    gradients_of_ratios,
)
from kahanmaps.laboratory.preserve.hirota_kimura import relations_on_orbit
from kahanmaps.laboratory.singular.jets import modulo
from kahanmaps.maps.implicit import Map, MapFamily
from kahanmaps.maps.inverse import TooLarge
from kahanmaps.systems.quadratic import LONG_COEFFICIENTS

_SPARE = 8
_DETERMINANT_BUDGET = 20_000_000
_DENOMINATOR_DEGREE, _MAX_DENOMINATORS = 6, 1000  # so many products of denominators up to this degree
_MAX_WORK = 4_000_000  # entries of matrices, about two seconds
_MAX_DIMENSION = 16  # beyond it the determinant is not expanded: even a sparse one costs more than it tells


@dataclass(frozen=True, eq=False)
class Cofactor:
    """A function of x that is made of a polynomial g in the variables, the symbols and eps, as `kind` says.

    "reversed": g(x~, -eps)/g(x, eps); "factor": g(x, eps); "pole": 1/g(x, eps); "denominator": g(x~, eps)/g(x, eps).
    Without a polynomial it is det dPhi itself. `weight` says from which degree on polynomials may have it for a
    cofactor, about.
    """

    name: str
    weight: int
    polynomial: fmpq_mpoly | None
    kind: str = "reversed"

    def over(self, map_: Map, x: Sequence[Any], image: Sequence[Any], values: Sequence[Any]) -> tuple[Any, Any]:
        """Numerator and denominator of the value at a point, the symbols having these values."""
        if self.polynomial is None:
            return jacobian_determinant_sides(map_, x, image)
        field, eps = map_.field, map_.eps
        here = evaluate(self.polynomial, field, (*x, *values, eps))
        if self.kind == "reversed":
            return evaluate(self.polynomial, field, (*image, *values, -eps)), here
        if self.kind == "denominator":
            return evaluate(self.polynomial, field, (*image, *values, eps)), here
        return (here, field.one) if self.kind == "factor" else (field.one, here)

    def sides(self, map_: ModularMap, x: Point, image: Point) -> tuple[int, int]:
        """The same at a point modulo a prime."""
        if self.polynomial is None:
            return map_.determinant(x, image)
        given = ([map_.map.field.convert(c) for c in entries] for entries in (x, image, map_.values))
        numerator, denominator = self.over(map_.map, *given)
        return int(numerator), int(denominator)

    @property
    def text(self) -> str:
        """The function in words: C[g] is g(x~, -eps)/g(x, eps)."""
        if self.polynomial is None or self.kind == "reversed":
            return f"C[{self.name}]"
        return f"({self.name})" if self.kind == "factor" else f"1/({self.name})"


DETERMINANT = Cofactor("det dPhi", 1, None)


def determinant_polynomial(map_: MapFamily) -> fmpq_mpoly | None:
    """det M in (variables, symbols, eps), for Kahan maps det(I - eps f'(x)); None where it is too large to expand."""
    if map_.dim > _MAX_DIMENSION or map_.digits > LONG_COEFFICIENTS:
        return None
    field = FunctionField(map_.names, _DETERMINANT_BUDGET)
    one, n = field.context.constant(1), map_.dim
    try:
        entries = [Function(field, entry, one) for row in map_.matrix for entry in row]
        D: fmpq_mpoly = FunctionMatrix(field, n, n, entries).det().above
    except (BudgetExceeded, TooLarge):
        return None
    return D


def jacobian_factors(map_: MapFamily) -> tuple[Cofactor, ...]:
    """The irreducible factors over Q of det dPhi(x) and those of 1/det M(x); det dPhi alone where it is too large."""
    n, D = map_.dim, determinant_polynomial(map_)
    field = FunctionField(map_.names, _DETERMINANT_BUDGET, reduces=True)
    *x, eps = field.variables
    try:
        over = map_.at(eps, field, x[n:])
        image = over.step(x[:n])
        numerator, denominator = jacobian_determinant_sides(over, x[:n], image)
        J = numerator / denominator
    except BudgetExceeded:
        D = None
    if D is None:
        return (Cofactor("det dPhi", n, None),)
    degree_of_map = max(degree_in(part, n) for entry in image for part in (entry.above, entry.below))
    found = []
    for kind, polynomials in (("factor", [J.above]), ("pole", [J.below, D])):
        factors = {str(factor): factor for polynomial in polynomials for factor, _ in irreducible_factors(polynomial)}
        for factor in factors.values():
            if weight := -(-degree_in(factor, n) // max(1, degree_of_map)):
                found.append(Cofactor(format_polynomial(factor), weight, factor, kind))
    return tuple(sorted(found, key=lambda one: (one.weight, one.kind, one.name)))


def determinant_factors(map_: MapFamily) -> tuple[Cofactor, ...]:
    """The cofactors of the irreducible factors over Q of det(I - eps f'(x)); det dPhi alone where it is too large."""
    n = map_.dim
    D = determinant_polynomial(map_)
    if D is None:
        return (Cofactor("det dPhi", n, None),)
    found = []
    for factor, _ in irreducible_factors(D):
        weight = degree_in(factor, n)
        if weight == 0:
            continue  # a number that depends on eps
        # D is 1 at eps = 0, so that every factor is a number there: divide by it, and cofactors become 1 at eps = 0.
        constant = substitute(factor, {"eps": fmpq(0)})
        found.append(Cofactor(format_polynomial(factor), weight, factor / constant.leading_coefficient()))
    return tuple(sorted(found, key=lambda one: (one.weight, one.name)))


@dataclass(frozen=True)
class CofactorProduct:
    """A product of powers of cofactors; `powers` goes with a list of them."""

    powers: tuple[int, ...]
    weight: int

    def text(self, cofactors: Sequence[Cofactor]) -> str:
        """The product in words, e.g. C[x1]*C[x3]^2."""
        parts = [
            one.text + (f"^{power}" if power > 1 else "")
            for one, power in zip(cofactors, self.powers, strict=True)
            if power
        ]
        return "*".join(parts) or "1"

    def origin(self, cofactors: Sequence[Cofactor]) -> str:
        """Where the ratios of polynomials with this cofactor come from, in words."""
        powers = [(one, power) for one, power in zip(cofactors, self.powers, strict=True) if power]
        if not powers or powers[0][0].kind != "denominator":
            return f"common cofactor {self.text(cofactors)}"
        factors = [(one.polynomial, power) for one, power in powers if one.polynomial is not None]
        return f"denominator {format_product(factors)}"


def products(cofactors: Sequence[Cofactor], max_weight: int) -> list[CofactorProduct]:
    """All products of weight at most `max_weight`, by increasing weight; the first is 1."""
    found: list[tuple[int, ...]] = [()]
    for one in cofactors:
        found = [
            (*powers, power)
            for powers in found
            for power in range(max_weight // one.weight + 1)
            if sum(p * c.weight for p, c in zip((*powers, power), cofactors, strict=False)) <= max_weight
        ]
    weighed = [CofactorProduct(p, sum(e * c.weight for e, c in zip(p, cofactors, strict=True))) for p in found]
    return sorted(weighed, key=lambda one: (one.weight, tuple(-p for p in one.powers)))


@dataclass(frozen=True)
class Sample:
    """Random points with their images and the values of cofactors there, for many searches on one map."""

    map: ModularMap
    pairs: list[tuple[Point, Point]]
    cofactors: Sequence[Cofactor]
    sides: dict[int, list[tuple[int, int]]] = field(default_factory=dict)  # of cofactors that were needed, by point

    @property
    def up_to_numbers(self) -> bool:
        """Whether cofactors are those that occur, times unknown numbers."""
        return any(one.kind in ("factor", "pole") for one in self.cofactors)

    @classmethod
    def of(cls, map_: ModularMap, cofactors: Sequence[Cofactor], count: int) -> Sample:
        """So many points."""
        return cls(map_, list(map_.pairs(count)), cofactors)

    def values(self, product: CofactorProduct, count: int) -> list[tuple[int, int]]:
        """Numerator and denominator of a product, at each of the first points."""
        prime = self.map.prime
        found = [(1, 1)] * min(count, len(self.pairs))
        for k, (power, one) in enumerate(zip(product.powers, self.cofactors, strict=True)):
            if power:
                count_work(4 * len(found))
                if k not in self.sides:
                    self.sides[k] = [one.sides(self.map, x, image) for x, image in self.pairs]
                found = [
                    (a * pow(c, power, prime) % prime, b * pow(d, power, prime) % prime)
                    for (a, b), (c, d) in zip(found, self.sides[k], strict=False)
                ]
        return found


def cofactor_space(
    sample: Sample, product: CofactorProduct, degree: int, model: DarbouxSpace | None = None
) -> DarbouxSpace:
    """All polynomials P of degree at most `degree` with P(x~) = C(x) P(x); their basis may be empty.

    With a `model`, the space modulo another prime, they have no other monomials than its elements. The sample must have
    `points_needed`.
    """
    places = range(len(exponents_up_to(sample.map.dim, degree))) if model is None else model.places
    here, there = _values(sample, product, degree, places)
    rows = [list(map(sub, after, before)) for before, after in zip(here, there, strict=True)]
    vectors = null_space(rows, len(places), sample.map.prime)
    return DarbouxSpace.spanned_by(sample.map.dim, degree, vectors, sample.map.prime, places)


def cofactor_spaces(
    sample: Sample, product: CofactorProduct, degree: int, models: Sequence[DarbouxSpace] = ()
) -> list[tuple[int, DarbouxSpace]]:
    """The same for P(x~) = c C(x) P(x) with each number c that has any P, where cofactors are known up to numbers.

    With several `models` there are no other monomials than in all of them. Numbers c that are not in the field of the
    prime are left out, and of a cofactor that is no product of factors up to numbers, c is 1.
    """
    prime, terms = sample.map.prime, len(exponents_up_to(sample.map.dim, degree))
    places = sorted({k for one in models for k in one.places}) if models else range(terms)
    if not sample.up_to_numbers:
        model = DarbouxSpace(sample.map.dim, degree, [v for one in models for v in one.basis]) if models else None
        space = cofactor_space(sample, product, degree, model)
        return [(1, space)] if space.basis else []
    # As many points as unknowns give the matrix M with C M P = P(x~) there. M P = c P has to hold at others too, for
    # M P, M M P, ... as well: K M^j P = 0, of which the first j leave next to nothing as a rule.
    count = len(places)
    before, after = _values(sample, product, degree, places)
    count_work(count**3 / 500)
    M = matrix(before[:count], prime).solve(matrix(after[:count], prime))
    K = matrix(after[count:], prime) - multiply(matrix(before[count:], prime), M)
    entries = list[nmod]()
    for _ in range(count // _SPARE + 2):
        entries += K.entries()
        K = multiply(K, M)
    basis, dimension = null_space([entries[k : k + count] for k in range(0, len(entries), count)], count, prime), -1
    while basis and len(basis) != dimension:  # of the space the part that M keeps in it
        dimension = len(basis)
        moved = integers(multiply(matrix(basis, prime), M.transpose()))
        inside = null_space(list(zip(*basis, *moved, strict=True)), 2 * dimension, prime)
        basis = combine([weights[dimension:] for weights in inside], basis, prime)
    if not basis:
        return []
    basis = echelon(basis, prime)
    moved = integers(multiply(matrix(basis, prime), M.transpose()))
    action = matrix([[row[k] for k in pivots(basis)] for row in moved], prime)
    found = []
    count_work(10 + 2 * len(basis) ** 3)
    for factor, _ in action.charpoly().factor()[1]:
        if factor.degree() == 1:
            c = int(-factor[0] / factor[1])
            shifted = [[entry - c * (i == j) for j, entry in enumerate(row)] for i, row in enumerate(integers(action))]
            weights = null_space(list(zip(*shifted, strict=True)), len(basis), prime)
            vectors = combine(weights, basis, prime)
            found.append((c, DarbouxSpace.spanned_by(sample.map.dim, degree, vectors, prime, places)))
    return found


def _values(
    sample: Sample, product: CofactorProduct, degree: int, places: Sequence[int]
) -> tuple[list[list[Any]], list[list[Any]]]:
    """The values of monomials times C at the points, and at their images, both times the denominators of C."""
    here, there, count = [], [], len(places) + _SPARE
    count_work(count * len(places) / 8)
    for (x, image), sides in zip(sample.pairs[:count], sample.values(product, count), strict=True):
        before, after = sample.map.moved(x, image, degree, sides)
        here.append([before[k] for k in places])
        there.append([after[k] for k in places])
    return here, there


def points_needed(dim: int, degree: int, *models: DarbouxSpace) -> int:
    """How many points a sample needs for polynomials of this degree, with the monomials of models if there are any.

    >>> points_needed(2, 3), points_needed(2, 3, DarbouxSpace(2, 3, [[1, 0, 1] + [0] * 7]))
    (18, 10)
    """
    places = {k for model in models for k in model.places}
    return (len(places) if models else len(exponents_up_to(dim, degree))) + _SPARE


def denominators_among(polynomials: Sequence[fmpq_mpoly], dim: int) -> list[Cofactor]:
    """The cofactors g(x~)/g(x) that denominators of integrals have which are products of these polynomials g.

    Of many polynomials the first are taken.
    """
    found = list[Cofactor]()
    for g in polynomials:
        one = Cofactor(format_polynomial(g), degree_in(g, dim), g, "denominator")
        if len(products([*found, one], _DENOMINATOR_DEGREE)) > _MAX_DENOMINATORS:
            break
        found.append(one)
    return found


@dataclass(frozen=True)
class SearchStep:
    """One step of a search; `product` is None except for cofactors. `text` says how for people."""

    kind: str  # "affine", "relations", "cofactor" or "iterates"
    degree: int
    product: CofactorProduct | None
    text: str
    lift: TwoPointBasis | None = None  # of "iterates"
    up_to_numbers: bool = False  # whether the cofactors of spaces are the product times numbers


@dataclass(frozen=True)
class SpaceSearch:
    """What a search found on one map: a list of spaces for each step.

    The products of the steps are of the `cofactors`, which were tried up to a degree; `searched` are the degrees of
    relations along orbits whose span was searched. `cut` says which cofactors were not tried for lack of budget.
    """

    steps: list[SearchStep] = field(default_factory=list)
    spaces: list[list[DarbouxSpace]] = field(default_factory=list)
    cofactors: Sequence[Cofactor] = ()
    cofactor_degree: int = 0
    searched: list[int] = field(default_factory=list)
    cut: str = ""

    @property
    def all_spaces(self) -> list[DarbouxSpace]:
        """The spaces of all steps."""
        return [space for spaces in self.spaces for space in spaces]

    @property
    def tried(self) -> str:
        """Among which functions integrals were sought."""
        parts = []
        if self.cofactor_degree:
            parts.append(f"P and Q of degree up to {self.cofactor_degree} with known cofactors or denominators")
        if self.searched:
            parts.append(f"relations of degree {', '.join(map(str, self.searched))} along orbits")
        return f"among {' and '.join(parts)}" if parts else "that was found"

    def add(self, step: SearchStep, spaces: list[DarbouxSpace]) -> None:
        """One more step."""
        self.steps.append(step)
        self.spaces.append(spaces)


def search_cofactors(
    map_: ModularMap,
    cofactors: Sequence[Cofactor],
    denominators: Sequence[Cofactor],
    known: Sequence[DarbouxSpace],
    wanted: int,
    max_degree: int,
    budget: Budget,
) -> SpaceSearch:
    """Spaces with a common cofactor whose ratios are new integrals, by increasing degree; until `wanted` are known.

    A space is new if the integrals of `known` and of those found before do not account for its own. The cofactors are
    products of the `cofactors`, or of the `denominators`. Last come the `cofactors` times any numbers, where they are
    known up to numbers. The search ends where it is too much work, or the `budget` is spent.

    Where P/Q = c on an orbit, P - c Q is a relation along this orbit: so unknown are only the coordinates of P - c Q in
    a basis of its relations. And Q is, up to a factor, the difference of the relations along two orbits, which tells
    the few products that can be denominators from all others.
    """
    prime, dim, every, work = map_.prime, map_.dim, [*cofactors, *denominators], 0
    found = SpaceSearch(cofactors=every)
    spaces = list(known)
    independent = gradient_rank(map_, spaces)
    context, field = nmod_mpoly_ctx.get([f"x{k}" for k in range(dim)], modulus=prime), GF(prime)
    at = [*context.gens(), *(context.constant(c) for c in (*map_.values, map_.eps))]
    polynomials = [
        modulo(one.polynomial, field).compose(*at, ctx=context) for one in denominators if one.polynomial is not None
    ]
    for degree in range(1, max_degree + 1):
        if independent >= wanted:
            break
        cut = f"polynomials of degree {degree} and more with known cofactors were not all tried: {SPENT}"
        if budget.is_spent:
            return replace(found, cut=cut)
        orbit = relations_on_orbit(map_, degree)
        relations, places = orbit.vectors, places_of(dim, degree)
        if relations:
            sums = echelon([*relations, *relations_on_orbit(map_, degree).vectors], prime)
            rows = dict(zip(pivots(sums), sums, strict=True))
            tried = [
                replace(one, powers=(*one.powers, *[0] * len(denominators)))
                for one in products(cofactors, min(degree + 1, max_degree))
            ]
            tried += [
                replace(one, powers=(*[0] * len(cofactors), *one.powers))
                for one in products(denominators, degree)[1:]
                if _is_spanned(prod(map(pow, polynomials, one.powers), start=context.constant(1)), places, rows, prime)
            ]
            count = len(relations) + _SPARE
            sample = Sample.of(map_, every, points_needed(dim, degree))
            basis = matrix(relations, prime).transpose()
            moved = zip(*(map_.moved(x, image, degree) for x, image in sample.pairs[:count]), strict=True)
            here, there = (multiply(matrix(list(values), prime), basis).tolist() for values in moved)
        for product in tried if relations else ():
            if independent >= wanted:
                break
            work += count**2
            if work > _MAX_WORK or budget.is_spent:
                return replace(found, cut=cut) if budget.is_spent else found
            count_work(count * len(relations) / 3)
            equations = [
                [b * v - a * u for u, v in zip(before, after, strict=True)]
                for (a, b), before, after in zip(sample.values(product, count), here, there, strict=True)
            ]
            coordinates = null_space(equations, len(relations), prime)
            # At a point of the orbit, where P = c Q, the gradient of P/Q is that of P - c Q up to a factor.
            slopes = [gradient_values(R, orbit.point, degree, prime)[1] for R in combine(coordinates, relations, prime)]
            before = gradients_of_ratios(orbit.point, spaces, prime)
            if rank([*before, *slopes], prime) == rank(before, prime):
                continue
            space = cofactor_space(sample, product, degree)
            more = gradient_rank(map_, [*spaces, space])
            if more > independent:
                independent = more
                spaces.append(space)
                found.add(SearchStep("cofactor", degree, product, product.origin(every)), [space])
        found = replace(found, cofactor_degree=degree)
    # Factors of determinants are cofactors up to numbers. The number 1 is a third of the work, and often enough.
    if all(one.kind == "reversed" for one in cofactors):
        return found
    sample = Sample.of(map_, every, points_needed(dim, max_degree))
    for degree, product in cartesian(range(1, max_degree + 1), products(cofactors, max_degree)[1:]):
        if independent >= wanted:
            break
        if product.weight > degree + 1:
            continue
        work += 3 * points_needed(dim, degree) ** 2
        if budget.is_spent:
            cut = f"polynomials of degree {degree} and more with known cofactors up to numbers were not all tried"
            return replace(found, cut=f"{cut}: {SPENT}")
        if work > 2 * _MAX_WORK:
            break
        product = replace(product, powers=(*product.powers, *[0] * len(denominators)))
        some = [space for _, space in cofactor_spaces(sample, product, degree) if len(space.basis) > 1]
        more = gradient_rank(map_, [*spaces, *some]) if some else independent
        if more > independent:
            independent = more
            spaces += some
            text = f"{product.origin(every)}, up to a number"
            step = SearchStep("cofactor", degree, product, text, up_to_numbers=True)
            found.add(step, sorted(some, key=lambda space: space.pattern))
    return found


def _is_spanned(polynomial: nmod_mpoly, places: dict[Exponent, int], rows: dict[int, list[int]], prime: int) -> bool:
    """Whether a polynomial is in the span of rows of an echelon form, each under the place of its first entry."""
    left = {places[exponents]: int(c) for exponents, c in polynomial.terms()}
    count_work(5 + 2 * len(left))
    while left:
        first = min(left)
        if first not in rows:
            return False
        factor = left[first]
        count_work(len(rows[first]) / 10)
        for k, entry in enumerate(rows[first][first:], first):
            if entry:
                left[k] = (left.get(k, 0) - factor * entry) % prime
        left = {k: c for k, c in left.items() if c}
    return True
