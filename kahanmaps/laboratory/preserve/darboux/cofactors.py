"""Candidates for the cofactors of discrete Darboux polynomials, and the search for polynomials with these cofactors.

A discrete Darboux polynomial P of a map Phi satisfies P o Phi = C P with a rational function C, the cofactor. All zeros
and poles of C lie on hypersurfaces that Phi contracts; there det dPhi vanishes or has a pole. For Kahan maps
det dPhi(x) = det(I + eps f'(x~))/det(I - eps f'(x)) with x~ = Phi(x), and the candidates for C are the products of

    D_i(x~, -eps)/D_i(x, eps)   for the irreducible factors D_i of det(I - eps f'(x)) over Q,
    l(x~)/l(x)                  for the affine l with l' = l L along the flow, which are discrete Darboux polynomials.

The cofactor of a P that is even in eps satisfies C(x, eps) C(x~, -eps) = 1, and so do these products. Other maps are
given by equations M(x) x~ = r(x). The candidates are then the products of the irreducible factors of det dPhi(x) and of
1/det M(x), times a number that is the eigenvalue of a matrix. Source: celledoni-2019.
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
from kahanmaps.algebra.work import SPENT, Budget, count_work
from kahanmaps.invariants.integrals_and_densities import jacobian_determinant_fraction
from kahanmaps.laboratory.modular_points import (
    Exponent,
    ModularMap,
    Point,
    exponents_up_to,
    gradient_values,
    monomial_index,
)
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

_SPARE = 8  # points beyond the number of unknowns
_DETERMINANT_BUDGET = 20_000_000  # products of terms in the expansion of a determinant
_DENOMINATOR_DEGREE, _MAX_DENOMINATORS = 6, 1000  # at most 1000 products of denominators up to degree 6 are allowed
_MAX_WORK = 4_000_000  # entries of matrices in one search, about two seconds
_MAX_DIMENSION = 16  # in higher dimension even a sparse determinant takes too long to expand


@dataclass(frozen=True, eq=False)
class Cofactor:
    """A candidate cofactor: a function of x, given by its `kind` and a polynomial g in (variables, symbols, eps).

    "reversed": g(x~, -eps)/g(x, eps); "factor": g(x, eps); "pole": 1/g(x, eps); "denominator": g(x~, eps)/g(x, eps).
    Without a polynomial the cofactor is det dPhi. `weight` approximates the least degree of a P with this cofactor.
    """

    name: str
    weight: int
    polynomial: fmpq_mpoly | None
    kind: str = "reversed"

    def fraction(self, map_: Map, x: Sequence[Any], image: Sequence[Any], values: Sequence[Any]) -> tuple[Any, Any]:
        """Return numerator and denominator of the cofactor at a point x, for `values` of the symbols."""
        if self.polynomial is None:
            return jacobian_determinant_fraction(map_, x, image)
        field, eps = map_.field, map_.eps
        g = evaluate(self.polynomial, field, (*x, *values, eps))
        if self.kind == "reversed":
            return evaluate(self.polynomial, field, (*image, *values, -eps)), g
        if self.kind == "denominator":
            return evaluate(self.polynomial, field, (*image, *values, eps)), g
        return (g, field.one) if self.kind == "factor" else (field.one, g)

    def modular_fraction(self, map_: ModularMap, x: Point, image: Point) -> tuple[int, int]:
        """Return numerator and denominator of the cofactor at a point modulo a prime."""
        if self.polynomial is None:
            return map_.determinant(x, image)
        residues = ([map_.map.field.convert(c) for c in entries] for entries in (x, image, map_.values))
        numerator, denominator = self.fraction(map_.map, *residues)
        return int(numerator), int(denominator)

    @property
    def text(self) -> str:
        """The function as text, where C[g] stands for g(x~, -eps)/g(x, eps)."""
        if self.polynomial is None or self.kind == "reversed":
            return f"C[{self.name}]"
        return f"({self.name})" if self.kind == "factor" else f"1/({self.name})"


DETERMINANT = Cofactor("det dPhi", 1, None)


def determinant_polynomial(map_: MapFamily) -> fmpq_mpoly | None:
    """Return det M for the map M(x) x~ = r(x) (Kahan maps: M = I - eps f'); None if it is too large to expand."""
    if map_.dim > _MAX_DIMENSION or map_.digits > LONG_COEFFICIENTS:
        return None
    field = FunctionField(map_.names, _DETERMINANT_BUDGET)
    one, n = field.context.constant(1), map_.dim
    try:
        entries = [Function(field, entry, one) for row in map_.matrix for entry in row]
        D: fmpq_mpoly = FunctionMatrix(field, n, n, entries).det().numerator
    except (BudgetExceeded, TooLarge):
        return None
    return D


def jacobian_factors(map_: MapFamily) -> tuple[Cofactor, ...]:
    """Return cofactors from the irreducible factors over Q of det dPhi(x) and 1/det M(x).

    M is the matrix in M(x) x~ = r(x). Returns det dPhi alone if one of the determinants is too large to expand.
    """
    n, D = map_.dim, determinant_polynomial(map_)
    field = FunctionField(map_.names, _DETERMINANT_BUDGET, reduces=True)
    *x, eps = field.variables
    try:
        map_over_field = map_.at(eps, field, x[n:])
        image = map_over_field.step(x[:n])
        numerator, denominator = jacobian_determinant_fraction(map_over_field, x[:n], image)
        J = numerator / denominator
    except BudgetExceeded:
        D = None
    if D is None:
        return (Cofactor("det dPhi", n, None),)
    degree_of_map = max(degree_in(P, n) for entry in image for P in (entry.numerator, entry.denominator))
    cofactors = []
    for kind, polynomials in (("factor", [J.numerator]), ("pole", [J.denominator, D])):
        factors = {str(factor): factor for polynomial in polynomials for factor, _ in irreducible_factors(polynomial)}
        for factor in factors.values():
            if weight := -(-degree_in(factor, n) // max(1, degree_of_map)):
                cofactors.append(Cofactor(format_polynomial(factor), weight, factor, kind))
    return tuple(sorted(cofactors, key=lambda cofactor: (cofactor.weight, cofactor.kind, cofactor.name)))


def determinant_factors(map_: MapFamily) -> tuple[Cofactor, ...]:
    """Return cofactors from the irreducible factors over Q of D = det(I - eps f'); only det dPhi if D is too large."""
    n = map_.dim
    D = determinant_polynomial(map_)
    if D is None:
        return (Cofactor("det dPhi", n, None),)
    cofactors = []
    for factor, _ in irreducible_factors(D):
        weight = degree_in(factor, n)
        if weight == 0:
            continue  # a function of eps
        # At eps = 0 the determinant is 1, so every factor is a number there. The factor is divided by this number.
        constant = substitute(factor, {"eps": fmpq(0)})
        cofactors.append(Cofactor(format_polynomial(factor), weight, factor / constant.leading_coefficient()))
    return tuple(sorted(cofactors, key=lambda cofactor: (cofactor.weight, cofactor.name)))


@dataclass(frozen=True)
class CofactorProduct:
    """A product of powers of cofactors; `powers` are the exponents, in the order of a list of cofactors."""

    powers: tuple[int, ...]
    weight: int

    def text(self, cofactors: Sequence[Cofactor]) -> str:
        """Return the product as text, e.g. C[x1]*C[x3]^2."""
        factors = [
            cofactor.text + (f"^{power}" if power > 1 else "")
            for cofactor, power in zip(cofactors, self.powers, strict=True)
            if power
        ]
        return "*".join(factors) or "1"

    def origin(self, cofactors: Sequence[Cofactor]) -> str:
        """Return a phrase on the origin of integrals that are ratios of polynomials with this cofactor."""
        powers = [(cofactor, power) for cofactor, power in zip(cofactors, self.powers, strict=True) if power]
        if not powers or powers[0][0].kind != "denominator":
            return f"common cofactor {self.text(cofactors)}"
        factors = [(cofactor.polynomial, power) for cofactor, power in powers if cofactor.polynomial is not None]
        return f"denominator {format_product(factors)}"


def products(cofactors: Sequence[Cofactor], max_weight: int) -> list[CofactorProduct]:
    """Return all products of weight at most `max_weight`, by increasing weight; the first is 1."""
    all_powers: list[tuple[int, ...]] = [()]
    for cofactor in cofactors:
        all_powers = [
            (*powers, power)
            for powers in all_powers
            for power in range(max_weight // cofactor.weight + 1)
            if sum(p * c.weight for p, c in zip((*powers, power), cofactors, strict=False)) <= max_weight
        ]
    result = [CofactorProduct(p, sum(e * c.weight for e, c in zip(p, cofactors, strict=True))) for p in all_powers]
    return sorted(result, key=lambda product: (product.weight, tuple(-p for p in product.powers)))


@dataclass(frozen=True)
class Sample:
    """Random points, their images, and the values of cofactors there, shared by many searches on one map."""

    map: ModularMap
    pairs: list[tuple[Point, Point]]
    cofactors: Sequence[Cofactor]
    fractions: dict[int, list[tuple[int, int]]] = field(default_factory=dict)  # cache: values of the k-th cofactor

    @property
    def up_to_numbers(self) -> bool:
        """Whether the cofactors are known only up to a numerical factor."""
        return any(cofactor.kind in ("factor", "pole") for cofactor in self.cofactors)

    @classmethod
    def of(cls, map_: ModularMap, cofactors: Sequence[Cofactor], count: int) -> Sample:
        """Draw `count` random points."""
        return cls(map_, list(map_.pairs(count)), cofactors)

    def values(self, product: CofactorProduct, count: int) -> list[tuple[int, int]]:
        """Return numerator and denominator of a product of cofactors at each of the first `count` points."""
        prime = self.map.prime
        values = [(1, 1)] * min(count, len(self.pairs))
        for k, (power, cofactor) in enumerate(zip(product.powers, self.cofactors, strict=True)):
            if power:
                count_work(4 * len(values))
                if k not in self.fractions:
                    self.fractions[k] = [cofactor.modular_fraction(self.map, x, image) for x, image in self.pairs]
                values = [
                    (a * pow(c, power, prime) % prime, b * pow(d, power, prime) % prime)
                    for (a, b), (c, d) in zip(values, self.fractions[k], strict=False)
                ]
        return values


def cofactor_space(
    sample: Sample, product: CofactorProduct, degree: int, model: DarbouxSpace | None = None
) -> DarbouxSpace:
    """Return the space of all P of degree at most `degree` with P(x~) = C(x) P(x), where C is the `product`.

    The basis may be empty. If `model`, the space modulo another prime, is given, P has only monomials of its elements.
    The sample must have at least `points_needed` points.
    """
    indices = range(len(exponents_up_to(sample.map.dim, degree))) if model is None else model.indices
    values, image_values = _evaluate_monomials(sample, product, degree, indices)
    rows = [list(map(sub, image_row, row)) for row, image_row in zip(values, image_values, strict=True)]
    vectors = null_space(rows, len(indices), sample.map.prime)
    return DarbouxSpace.spanned_by(sample.map.dim, degree, vectors, sample.map.prime, indices)


def cofactor_spaces(
    sample: Sample, product: CofactorProduct, degree: int, models: Sequence[DarbouxSpace] = ()
) -> list[tuple[int, DarbouxSpace]]:
    """Return all pairs of a number c and the space of the P with P(x~) = c C(x) P(x), where C is the `product`.

    If there are `models`, only the monomials of their elements are used. Eigenvalues c in extensions of GF(p) are left
    out. If the cofactors of the sample are known exactly, only c = 1 is tried.
    """
    prime, term_count = sample.map.prime, len(exponents_up_to(sample.map.dim, degree))
    indices = sorted({k for model in models for k in model.indices}) if models else range(term_count)
    if not sample.up_to_numbers:
        union = DarbouxSpace(sample.map.dim, degree, [v for model in models for v in model.basis]) if models else None
        space = cofactor_space(sample, product, degree, union)
        return [(1, space)] if space.basis else []
    # On as many points as unknowns, P(x~) = C(x) (M P)(x) for all P defines a matrix M; an eigenvector P is sought. The
    # same equations at the other points are K P = 0. M P, M^2 P, ... must satisfy them too; a few of the equations
    # K M^j P = 0 usually suffice.
    size = len(indices)
    values, image_values = _evaluate_monomials(sample, product, degree, indices)
    count_work(size**3 / 500)
    M = matrix(values[:size], prime).solve(matrix(image_values[:size], prime))
    K = matrix(image_values[size:], prime) - multiply(matrix(values[size:], prime), M)
    entries = list[nmod]()
    for _ in range(size // _SPARE + 2):
        entries += K.entries()
        K = multiply(K, M)
    basis, dimension = null_space([entries[k : k + size] for k in range(0, len(entries), size)], size, prime), -1
    while basis and len(basis) != dimension:  # shrink to the largest subspace that M maps into itself
        dimension = len(basis)
        images = integers(multiply(matrix(basis, prime), M.transpose()))
        dependences = null_space(list(zip(*basis, *images, strict=True)), 2 * dimension, prime)
        basis = combine([weights[dimension:] for weights in dependences], basis, prime)
    if not basis:
        return []
    basis = echelon(basis, prime)
    images = integers(multiply(matrix(basis, prime), M.transpose()))
    action = matrix([[row[k] for k in pivots(basis)] for row in images], prime)
    spaces = []
    count_work(10 + 2 * len(basis) ** 3)
    for factor, _ in action.charpoly().factor()[1]:
        if factor.degree() == 1:
            c = int(-factor[0] / factor[1])
            A_c = [[entry - c * (i == j) for j, entry in enumerate(row)] for i, row in enumerate(integers(action))]
            weights = null_space(list(zip(*A_c, strict=True)), len(basis), prime)
            vectors = combine(weights, basis, prime)
            spaces.append((c, DarbouxSpace.spanned_by(sample.map.dim, degree, vectors, prime, indices)))
    return spaces


def _evaluate_monomials(
    sample: Sample, product: CofactorProduct, degree: int, indices: Sequence[int]
) -> tuple[list[list[Any]], list[list[Any]]]:
    """Return d C m(x) and d m(x~) for the monomials m, a row for each point; C is `product`, d the denominator of C."""
    values, image_values, point_count = [], [], len(indices) + _SPARE
    count_work(point_count * len(indices) / 8)
    for (x, image), fraction in zip(sample.pairs[:point_count], sample.values(product, point_count), strict=True):
        monomials_at_x, monomials_at_image = sample.map.monomials_at_both(x, image, degree, fraction)
        values.append([monomials_at_x[k] for k in indices])
        image_values.append([monomials_at_image[k] for k in indices])
    return values, image_values


def points_needed(dim: int, degree: int, *models: DarbouxSpace) -> int:
    """Return the number of points that are needed for all polynomials of a degree, or for the monomials of `models`.

    >>> points_needed(2, 3), points_needed(2, 3, DarbouxSpace(2, 3, [[1, 0, 1] + [0] * 7]))
    (18, 10)
    """
    indices = {k for model in models for k in model.indices}
    return (len(indices) if models else len(exponents_up_to(dim, degree))) + _SPARE


def denominators_among(polynomials: Sequence[fmpq_mpoly], dim: int) -> list[Cofactor]:
    """Return the cofactors g(x~)/g(x) of `polynomials` g, for integrals whose denominators are products of the g.

    If there are too many products of the g, only the first polynomials are used.
    """
    cofactors = list[Cofactor]()
    for g in polynomials:
        cofactor = Cofactor(format_polynomial(g), degree_in(g, dim), g, "denominator")
        if len(products([*cofactors, cofactor], _DENOMINATOR_DEGREE)) > _MAX_DENOMINATORS:
            break
        cofactors.append(cofactor)
    return cofactors


@dataclass(frozen=True)
class SearchStep:
    """One step of a search; `product` is None except for kind "cofactor". `text` describes the step to the user."""

    kind: str  # "affine", "relations", "cofactor" or "iterates"
    degree: int
    product: CofactorProduct | None
    text: str
    two_point_basis: TwoPointBasis | None = None  # only for kind "iterates"
    up_to_numbers: bool = False  # whether the cofactors of the spaces are numerical multiples of the product


@dataclass(frozen=True)
class SpaceSearch:
    """The result of a search on one map: a list of spaces for each step.

    The steps of kind "cofactor" refer to products of the `cofactors`; for these, polynomials up to `cofactor_degree`
    were tried. `searched` lists the degrees in which the span of the relations along orbits was searched. `stop_reason`
    says which cofactors were left out because the budget was spent.
    """

    steps: list[SearchStep] = field(default_factory=list)
    spaces: list[list[DarbouxSpace]] = field(default_factory=list)
    cofactors: Sequence[Cofactor] = ()
    cofactor_degree: int = 0
    searched: list[int] = field(default_factory=list)
    stop_reason: str = ""

    @property
    def all_spaces(self) -> list[DarbouxSpace]:
        """The spaces of all steps."""
        return [space for spaces in self.spaces for space in spaces]

    @property
    def tried(self) -> str:
        """A phrase for the functions that were searched for integrals."""
        phrases = []
        if self.cofactor_degree:
            phrases.append(f"P and Q of degree up to {self.cofactor_degree} with known cofactors or denominators")
        if self.searched:
            phrases.append(f"relations of degree {', '.join(map(str, self.searched))} along orbits")
        return f"among {' and '.join(phrases)}" if phrases else "that was found"

    def add(self, step: SearchStep, spaces: list[DarbouxSpace]) -> None:
        """Append a step with its spaces."""
        self.steps.append(step)
        self.spaces.append(spaces)


def search_cofactors(
    map_: ModularMap,
    cofactors: Sequence[Cofactor],
    denominator_cofactors: Sequence[Cofactor],
    known_spaces: Sequence[DarbouxSpace],
    required: int,
    max_degree: int,
    budget: Budget,
) -> SpaceSearch:
    """Search by increasing degree for spaces with a common cofactor in which ratios P/Q are new integrals.

    The search ends when `required` independent integrals are known, when it takes too much work, or when the `budget`
    is spent. A space is added only if it gives an integral independent of the integrals of the `known_spaces` and of
    earlier spaces.

    The cofactors that are tried are products of the `cofactors`, then products of the `denominator_cofactors`. The
    latter have the form g(x~)/g(x) with known polynomials g, so they lead to integrals P/Q with a product Q of the g.
    If the `cofactors` are known only up to a numerical factor, their products times any number come last.

    Two observations save work. If P/Q = c on an orbit, then P - c Q vanishes along this orbit, so only the coordinates
    of P - c Q in a basis of the relations of the orbit are unknown. If P/Q = d on a second orbit, then P - d Q vanishes
    there, so (d - c) Q is a sum of relations of the two orbits. This excludes most products Q of the g.
    """
    prime, dim, all_cofactors, work = map_.prime, map_.dim, [*cofactors, *denominator_cofactors], 0
    result = SpaceSearch(cofactors=all_cofactors)
    spaces = list(known_spaces)
    independent_count = gradient_rank(map_, spaces)
    context, field = nmod_mpoly_ctx.get([f"x{k}" for k in range(dim)], modulus=prime), GF(prime)
    arguments = [*context.gens(), *(context.constant(c) for c in (*map_.values, map_.eps))]
    denominator_factors = [
        modulo(cofactor.polynomial, field).compose(*arguments, ctx=context)
        for cofactor in denominator_cofactors
        if cofactor.polynomial is not None
    ]
    for degree in range(1, max_degree + 1):
        if independent_count >= required:
            break
        message = f"polynomials of degree {degree} and more with known cofactors were not all tried: {SPENT}"
        if budget.is_spent:
            return replace(result, stop_reason=message)
        orbit = relations_on_orbit(map_, degree)
        relations, indices = orbit.vectors, monomial_index(dim, degree)
        if relations:
            joint_relations = echelon([*relations, *relations_on_orbit(map_, degree).vectors], prime)
            rows_by_pivot = dict(zip(pivots(joint_relations), joint_relations, strict=True))
            candidates = [
                replace(product, powers=(*product.powers, *[0] * len(denominator_cofactors)))
                for product in products(cofactors, min(degree + 1, max_degree))
            ]
            for product in products(denominator_cofactors, degree)[1:]:
                denominator = prod(map(pow, denominator_factors, product.powers), start=context.constant(1))
                if _is_spanned(denominator, indices, rows_by_pivot, prime):
                    candidates.append(replace(product, powers=(*[0] * len(cofactors), *product.powers)))
            point_count = len(relations) + _SPARE
            sample = Sample.of(map_, all_cofactors, points_needed(dim, degree))
            basis = matrix(relations, prime).transpose()
            pairs_of_values = zip(
                *(map_.monomials_at_both(x, image, degree) for x, image in sample.pairs[:point_count]), strict=True
            )
            x_values, image_values = (
                multiply(matrix(list(values), prime), basis).tolist() for values in pairs_of_values
            )
        for product in candidates if relations else ():
            if independent_count >= required:
                break
            work += point_count**2
            if work > _MAX_WORK or budget.is_spent:
                return replace(result, stop_reason=message) if budget.is_spent else result
            count_work(point_count * len(relations) / 3)
            # The equations are b P(x~) = a P(x), where a/b is the value of the cofactor at the point x.
            fractions = sample.values(product, point_count)
            equations = [
                [b * v - a * u for u, v in zip(row, image_row, strict=True)]
                for (a, b), row, image_row in zip(fractions, x_values, image_values, strict=True)
            ]
            coordinates = null_space(equations, len(relations), prime)
            # At a point of the orbit P = c Q, so the gradients of P/Q and of P - c Q are proportional.
            gradients = [
                gradient_values(R, orbit.point, degree, prime)[1] for R in combine(coordinates, relations, prime)
            ]
            known_gradients = gradients_of_ratios(orbit.point, spaces, prime)
            if rank([*known_gradients, *gradients], prime) == rank(known_gradients, prime):
                continue
            space = cofactor_space(sample, product, degree)
            new_rank = gradient_rank(map_, [*spaces, space])
            if new_rank > independent_count:
                independent_count = new_rank
                spaces.append(space)
                result.add(SearchStep("cofactor", degree, product, product.origin(all_cofactors)), [space])
        result = replace(result, cofactor_degree=degree)
    # The factors of determinants are cofactors only up to a number. The first loop tried the number 1: this often
    # suffices, and takes a third of the work of the next loop.
    if all(cofactor.kind == "reversed" for cofactor in cofactors):
        return result
    sample = Sample.of(map_, all_cofactors, points_needed(dim, max_degree))
    for degree, product in cartesian(range(1, max_degree + 1), products(cofactors, max_degree)[1:]):
        if independent_count >= required:
            break
        if product.weight > degree + 1:
            continue
        work += 3 * points_needed(dim, degree) ** 2
        if budget.is_spent:
            message = f"polynomials of degree {degree} and more with known cofactors up to numbers were not all tried"
            return replace(result, stop_reason=f"{message}: {SPENT}")
        if work > 2 * _MAX_WORK:
            break
        product = replace(product, powers=(*product.powers, *[0] * len(denominator_cofactors)))
        new_spaces = [space for _, space in cofactor_spaces(sample, product, degree) if len(space.basis) > 1]
        new_rank = gradient_rank(map_, [*spaces, *new_spaces]) if new_spaces else independent_count
        if new_rank > independent_count:
            independent_count = new_rank
            spaces += new_spaces
            text = f"{product.origin(all_cofactors)}, up to a number"
            step = SearchStep("cofactor", degree, product, text, up_to_numbers=True)
            result.add(step, sorted(new_spaces, key=lambda space: space.pattern))
    return result


def _is_spanned(polynomial: nmod_mpoly, indices: dict[Exponent, int], rows: dict[int, list[int]], prime: int) -> bool:
    """Return whether a polynomial is in the span of the rows of an echelon form; the keys of `rows` are pivots."""
    remainder = {indices[exponents]: int(c) for exponents, c in polynomial.terms()}
    count_work(5 + 2 * len(remainder))
    while remainder:
        pivot = min(remainder)
        if pivot not in rows:
            return False
        factor = remainder[pivot]
        count_work(len(rows[pivot]) / 10)
        for k, entry in enumerate(rows[pivot][pivot:], pivot):
            if entry:
                remainder[k] = (remainder.get(k, 0) - factor * entry) % prime
        remainder = {k: c for k, c in remainder.items() if c}
    return True
