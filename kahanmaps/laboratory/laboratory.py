"""The reductions of a map modulo primes, which searches use, and the reconstruction of formulas from residues.

Over a number field Q[t]/g a coefficient c_0 + c_1 t + ... is interpolated, modulo a prime at which g splits, from its
values at the roots of g. So residues of the c_j are known, from which the c_j are reconstructed as functions over Q.

Formulas are certified as identities in x, eps and the symbols. For an integral I = P/Q the identity is
P(x~) Q(x) = P(x) Q(x~), whose expansion is shorter than that of the quotients. Some identities are too long to expand
in the given coordinates, but short in coordinates in which the planes of a normal form separate.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly, fmpq_poly

from kahanmaps.algebra.chance import derive_seed
from kahanmaps.algebra.etale import EtaleElement
from kahanmaps.algebra.fields import GF, QQ, Field, rational
from kahanmaps.algebra.functions import DEFAULT_BUDGET
from kahanmaps.algebra.interpolation import BlackBox, Reconstruction, reconstruct
from kahanmaps.algebra.polynomials import (
    RationalFunction,
    evaluate,
    linear_combinations,
    over_one_denominator,
    primitive_part,
    ring,
    substitute,
)
from kahanmaps.algebra.printing import format_polynomial
from kahanmaps.algebra.residues import random_prime
from kahanmaps.algebra.roots import Root
from kahanmaps.algebra.work import Budget, count_work
from kahanmaps.checks.certify import MAX_DIMENSION, try_expand
from kahanmaps.checks.claims import Certainty, Evidence
from kahanmaps.checks.decide import Identity, Sides, decide
from kahanmaps.documents.files import SystemFile
from kahanmaps.documents.symbols import map_with_symbols, split_names
from kahanmaps.errors import BadPrime, InputError
from kahanmaps.family.system_normal_form import SystemNormalForm, system_normal_form
from kahanmaps.invariants.integrals_and_densities import (
    density_condition,
    integral_condition,
    jacobian_determinant_fraction,
)
from kahanmaps.laboratory.modular_points import ModularFlow, ModularMap, NoPoint, Point, exponents_up_to, interpolated
from kahanmaps.laboratory.preserve.darboux.affine_functions import affine_darboux, darboux_cofactor
from kahanmaps.laboratory.preserve.darboux.cofactors import (
    Cofactor,
    determinant_factors,
    jacobian_factors,
)
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import DarbouxSpace
from kahanmaps.laboratory.preserve.limit.flow_polynomials import FlowPolynomials, flow_polynomials
from kahanmaps.maps.algebraic import AlgebraicMap
from kahanmaps.maps.explicit import explicit_map
from kahanmaps.maps.implicit import ImplicitMap, MapFamily
from kahanmaps.maps.kahan import KahanFamily, as_map
from kahanmaps.maps.normal_form.splitting import Splitting
from kahanmaps.systems.polynomial import PolynomialField
from kahanmaps.systems.quadratic import QuadraticSystem

_INTEGRAL = Evidence("expansion", "f . grad I is 0, multiplied out")
_TIME_DEPENDENT = Evidence("expansion", "f . grad I is c I for the constant c, multiplied out")
_DENSITY = Evidence("expansion", "f . grad phi is phi div f, multiplied out")
MAX_DEGREE = 6  # of a number field: about one prime in at most 6! = 720 splits
_BUDGET = DEFAULT_BUDGET  # also that of `check-integrals`, except for identities with long coefficients
_STAND_IN = fmpq(1000003, 7)  # replaces an algebraic number in the search for invariant hyperplanes over Q
Spaces = Sequence[DarbouxSpace]


@dataclass(frozen=True)
class ClosedForms:
    """Bases of spaces of polynomials in the variables, the symbols and eps; or None, and the reason why."""

    bases: list[list[fmpq_mpoly]] | None
    reason: str = ""


class Laboratory:
    """The reductions `maps` of the map of a file modulo two primes, each with its own eps and values of the symbols.

    If `eps` (half the time step, exact) is given, both are at this eps. If `flow` is True, the flow is reduced instead
    of the map. An adjusted Kahan map stands for the flow of its field at eps = 0; for a polarised map of f, `map` is
    then x + eps f. If `algebraic` and a parameter is an algebraic number, this `root` is the only symbol.

    `system` is the system if the map is a Kahan map of a system without eps in its coefficients (theorems then apply),
    otherwise None. `field` is `system` or, for the flow of a polarised map, its field of any degree. `free_symbols` are
    the symbols with random values. Raises InputError for eps = 0, eps both a number and a symbol, and wrong symbols.

    >>> from kahanmaps.documents.catalog import load
    >>> laboratory = Laboratory(load("euler_top"), ["a1"])
    >>> len(laboratory.maps), laboratory.eps_enters, laboratory.defect
    (2, 'by weight', '')
    """

    def __init__(
        self,
        file: SystemFile,
        symbols: Sequence[str] = (),
        eps: Any = None,
        seed: int = 0,
        *,
        flow: bool = False,
        algebraic: bool = False,
    ) -> None:
        self.file = file
        symbols = split_names(symbols)
        self.symbols = self.free_symbols = tuple(name for name in dict.fromkeys(symbols) if name != "eps")
        self.root: Root | None = None
        self.eps = None if eps is None else rational(eps)
        if self.eps == 0:
            raise InputError("found eps = 0, expected another number: at eps = 0 the Kahan map is the identity")
        if self.eps is not None and "eps" in symbols:
            raise InputError("found eps both as a number and as a symbol, expected one of the two")
        if flow and file.map.root is not None:
            raise InputError(f"found a {file.map.root}, expected rational parameters for an analysis of the flow")
        if algebraic and isinstance(file.map, AlgebraicMap):
            self.root, self.map = file.map.root, file.map.family
            if symbols or self.root.degree > MAX_DEGREE:
                found_text = f"a symbol beside a {self.root}" if symbols else f"a {self.root}"
                raise InputError(f"found {found_text}, expected no other symbols and a degree of at most {MAX_DEGREE}")
            self.symbols = self.map.symbols
        else:
            self.map = map_with_symbols(file, self.symbols)
        if flow and isinstance(self.map, KahanFamily) and self.map.system.symbols == ("eps",):
            rhs = tuple(substitute(polynomial, {"eps": fmpq(0)}) for polynomial in self.map.system.rhs)
            self.file = SystemFile.from_system(QuadraticSystem(rhs), file.name)
            self.map = self.file.map
        self.system = None
        if isinstance(self.map, KahanFamily) and "eps" not in self.map.system.symbols:
            self.system = self.map.system
        self.field: PolynomialField | None = self.system
        if flow and isinstance(self.map, ImplicitMap) and self.map.of_field is not None:
            self.field = self.map.of_field
            self.map = euler_map(self.field)
        self.flow = flow
        # Caches of one search. Each search has its own laboratory, so that no answer depends on another search.
        # `_too_long`: for integrals (False) and densities (True), the least number of terms too large to expand.
        self._too_long: dict[bool, int] = {}
        self._flow_polynomials: FlowPolynomials | None = None
        if flow and (self.field is None or self.eps is not None):
            found_text = "eps = " + str(self.eps) if self.field is not None else self.map.kind
            raise InputError(
                f"found {found_text}, expected a polynomial vector field without eps for an analysis of the flow"
            )
        map_key = self.map.seed_data if self.root is None else file.map.seed_data
        self.seed = derive_seed(seed, self.symbols, map_key, self.eps)  # the seed of all random choices for this map
        self.maps = list(self._draw_maps("laboratory", 2))
        self.primes = tuple(map_.prime for map_ in self.maps)
        self.request = file, self.free_symbols, self.eps, seed, self.primes  # the first fields of each result

    def map_at(self, prime: int, values: Sequence[int], eps: int) -> ModularMap:
        """Return the map modulo a prime; the residue `eps` is ignored if `self.eps` is a number. Raises BadPrime."""
        if self.eps is not None:
            eps = int(GF(prime).convert(self.eps))
            if eps == 0:
                raise BadPrime(f"the prime {prime} divides the numerator of eps", prime)
        if self.flow and self.field is not None:
            return ModularFlow(self.field, prime, values, self.seed)
        return ModularMap(self.map, prime, eps, values, self.seed)

    def map_for(self, prime: int, values: Sequence[int]) -> ModularMap:
        """Return the map modulo a prime, at `values` of the symbols and, if eps enters formulas as a symbol, of eps.

        If eps does not enter as a symbol, the map is at eps = 1, or at `self.eps` if this is a number.
        """
        count = len(self.symbols)
        return self.map_at(prime, values[:count], values[count] if len(values) > count else 1)

    def other_maps(self, count: int) -> Iterator[ModularMap]:
        """Yield `count` maps modulo other random primes, each at its own random residues of the symbols and eps."""
        return self._draw_maps("other maps", count)

    def _draw_maps(self, name: str, count: int) -> Iterator[ModularMap]:
        rng = random.Random(f"{name} {self.seed}")
        while count > 0:
            prime = random_prime(rng)
            try:
                values = [rng.randrange(2, prime) for _ in self.free_symbols]
                if self.root is not None:
                    values = self.root.residues(GF(prime))[:1]
                yield self.map_at(prime, values, rng.randrange(2, prime))
            except BadPrime:
                continue
            count -= 1

    @property
    def eps_enters(self) -> str:
        """How eps enters formulas: "not" (a number, or no eps), "by weight" if f is homogeneous, else as a "symbol"."""
        if self.eps is not None or self.flow or not self.map.has_eps:
            return "not"
        if self.system is None:
            return "symbol"
        return "by weight" if self.system.is_homogeneous else "symbol"

    @property
    def defect(self) -> str:
        """The reason why the map is not birational, measured at random points; empty if it seems birational."""
        if self.flow or (self.eps is None and self.system is not None):
            return ""  # det(I - eps f'(x)) is 1 at eps = 0
        at_eps_text = "" if self.eps is None else f"at eps = {self.eps} "
        name, numerator = self.map.denominator_name, "det dPhi(x)"
        if self.system is not None:
            name, numerator = "det(I - eps f'(x))", "det(I + eps f'(x))"
        try:
            pairs = [(map_, *pair) for map_ in self.maps for pair in map_.pairs(2)]
        except NoPoint:
            return f"{at_eps_text}the map is defined nowhere: {name} is identically 0"
        if not any(map_.determinant(x, image)[0] for map_, x, image in pairs):
            where_text = "points" if self.system is None else "images"
            return f"{at_eps_text}the map is not invertible: {numerator} is 0 at all {where_text}"
        return ""

    def cofactors(self) -> list[Cofactor]:
        """Return the cofactors that the search for Darboux polynomials of the map tries."""
        if self.flow:
            return []
        if self.system is None:
            return list(jacobian_factors(self.map))
        return [*self.affine_cofactors(), *determinant_factors(self.map)]

    def affine_cofactors(self) -> list[Cofactor]:
        """Return the cofactors of the affine Darboux functions of the system; requires that `system` is not None."""
        assert self.system is not None
        context, full_ring, n = self.system.rhs[0].context(), ring(self.map.names), self.system.dim
        return [
            Cofactor(
                format_polynomial(affine.function), 1, affine.function.compose(*full_ring.gens()[:n], ctx=full_ring)
            )
            for affine in affine_darboux(self.system.at([_STAND_IN]) if self.root else self.file.system).functions
            # the affine function l must divide f . grad l for all values of the symbols, not only those of the search
            if darboux_cofactor(self.system, affine.function.compose(*context.gens()[:n], ctx=context)) is not None
        ]

    def flow_polynomials(self, budget: Budget) -> FlowPolynomials:
        """Return Darboux polynomials of the flow, in (variables, symbols, eps); the first call searches for them."""
        if self._flow_polynomials is not None:
            return self._flow_polynomials
        assert self.field is not None
        result, context = flow_polynomials(self.field, budget=budget, seed=self.seed), ring(self.map.names)
        gens = context.gens()[:-1]
        functions = [P.compose(*gens, ctx=context) for P in result.functions]
        # With symbols the search for Darboux polynomials ends at a low degree, so the affine ones are added here.
        affine = self.affine_cofactors() if self.symbols and self.system is not None else []
        polynomials = [cofactor.polynomial for cofactor in affine if cofactor.polynomial is not None]
        functions += [P for P in polynomials if P not in functions]
        self._flow_polynomials = replace(result, functions=tuple(functions))
        return self._flow_polynomials

    def verdict_on(
        self, function: RationalFunction, *, is_density: bool = False, factor: RationalFunction | None = None
    ) -> tuple[Certainty, Evidence]:
        """Decide whether the map or the flow preserves an integral or a density `function`; see `verdict_on` below.

        The identity is not expanded if that of an earlier function with at most as many terms was too long to expand.
        """
        if self.field is not None and self.flow:
            is_preserved = flow_preserves(self.field, function, is_density=is_density, factor=factor)
            evidence = _DENSITY if is_density else _INTEGRAL if factor is None else _TIME_DEPENDENT
            return (Certainty.PROVED if is_preserved else Certainty.REFUTED), evidence
        map_ = self.map if self.root is None else self.file.map
        options: dict[str, Any] = {"eps": self.eps, "seed": self.seed, "is_density": is_density}
        separated_system = self._separated_system
        terms = len(function.numerator) + len(function.denominator)
        expands = separated_system is None and terms < self._too_long.get(is_density, math.inf)
        verdict, evidence = verdict_on(map_, function, **options, factor=factor, expands=expands)
        if verdict is Certainty.SUPPORTED and separated_system is not None:
            factor_in_z = None if factor is None else separated_system.function(factor)
            certainty, proof = verdict_on(
                separated_system.system, separated_system.function(function), **options, factor=factor_in_z
            )
            if certainty is not Certainty.SUPPORTED:
                summary = f"{proof.summary}, in coordinates in which the planes separate"
                return certainty, replace(proof, summary=summary)
        elif verdict is Certainty.SUPPORTED and expands:
            self._too_long[is_density] = terms
        return verdict, evidence

    @cached_property
    def _separated_system(self) -> SeparatedSystem | None:
        return None if self.system is None or self.symbols else separate_planes(self.system)

    def formulas(
        self,
        model: Spaces,
        spaces_on: Callable[[ModularMap], Spaces | None],
        budget: Budget,
        variables: Sequence[str] = (),
        eps_enters: str = "",
    ) -> ClosedForms:
        """Reconstruct polynomials that span spaces; the reduced echelon bases of these spaces are known modulo primes.

        Args:
            model: the spaces for the first of the maps.
            spaces_on: returns the spaces for another map, in the same order; None if this map is special.
            budget: the work limit.
            variables: the variables of the polynomials, by default those of the map.
            eps_enters: "not" if the spaces are for the given eps; "symbol"; or, for homogeneous f, "by weight": the
                spaces are for eps = 1, and x is replaced by eps x in the polynomials. By default `self.eps_enters`.

        Returns:
            Primitive polynomials in (variables, symbols, eps): the coefficients are integers, and the coefficients of
            monomials in the variables have no common factor.
        """
        variables, symbols, root = variables or self.map.variables, self.symbols, self.root
        eps_enters = eps_enters or self.eps_enters
        supports = [set(space.indices) for space in model]
        # In a reduced echelon basis the coefficient of the largest monomial is 1. The unknowns are the other nonzero
        # coefficients.
        pivots = [[max(k for k, entry in enumerate(vector) if entry) for vector in space.basis] for space in model]
        unknowns = [
            [(i, k) for i, vector in enumerate(space.basis) for k, c in enumerate(vector) if c and k != space_pivots[i]]
            for space, space_pivots in zip(model, pivots, strict=True)
        ]

        def black_box(prime: int, values: tuple[int, ...]) -> tuple[int, ...] | None:
            try:
                spaces = spaces_on(self.map_for(prime, values))
            except (NoPoint, BadPrime):
                return None
            if not spaces or any(
                not set(space.indices) <= support or len(space.basis) != len(space_pivots)
                for space, support, space_pivots in zip(spaces, supports, pivots, strict=True)
            ):
                return None  # the spaces have other monomials or dimensions
            return tuple(
                space.basis[i][k]
                for space, space_unknowns in zip(spaces, unknowns, strict=True)
                for i, k in space_unknowns
            )

        names = (*symbols, "eps") if eps_enters == "symbol" else tuple(symbols)
        functions: list[RationalFunction] = []
        if any(unknowns):
            reconstruction = reconstruct_at(root, black_box, names, seed=self.seed, budget=budget)
            if reconstruction.functions is None:
                return ClosedForms(None, reconstruction.reason)
            functions += reconstruction.functions
        context, n = ring((*variables, *symbols, "eps")), len(variables)
        gens, bases = context.gens()[n:], []
        for space, space_pivots, space_unknowns in zip(model, pivots, unknowns, strict=True):
            basis, monomials = list[fmpq_mpoly](), exponents_up_to(space.dim, space.degree)
            for row, pivot in enumerate(space_pivots):
                columns = [k for i, k in space_unknowns if i == row]
                numerators, denominator = over_one_denominator([functions.pop(0) for _ in columns], context, gens)
                P = context.constant(0)
                for k, factor in (*zip(columns, numerators, strict=True), (pivot, denominator)):
                    P = P + factor * context.from_dict({(*monomials[k], *([0] * len(gens))): 1})
                P = primitive_part(P)[1]
                if root is not None:
                    P = primitive_over(root, P, n)
                if eps_enters == "by weight":  # replace P(x) by P(eps x), divided by a power of eps
                    degrees = {monomial: sum(map(int, monomial[:n])) for monomial in P.monoms()}
                    lowest_degree = min(degrees.values())
                    P = context.from_dict({(*m[:-1], degrees[m] - lowest_degree): c for m, c in P.terms()})
                basis.append(P)
            bases.append(basis)
        return ClosedForms(bases)


def reconstruct_at(root: Root | None, black_box: BlackBox, names: Sequence[str], **options: Any) -> Reconstruction:
    """Reconstruct functions of `names` with `reconstruct`; if `root` is given, the first of the names stands for it.

    In this case the black box is evaluated at all roots of the minimal polynomial modulo primes at which it splits. The
    functions are polynomials in the root, of degree less than that of the field. `options` are passed to `reconstruct`.
    """
    if root is None:
        return reconstruct(black_box, names, **options)
    m = root.degree
    assert m <= MAX_DEGREE  # for higher degrees suitable primes are too rare; Laboratory rejects them

    def draw_splitting_prime(rng: random.Random) -> int:
        while True:
            prime = random_prime(rng)
            with suppress(BadPrime):
                if len(root.residues(GF(prime))) == m:
                    return prime

    def black_box_over_root(prime: int, point: Point) -> list[int] | None:
        roots, rows = root.residues(GF(prime)), []
        for t in roots:
            values = black_box(prime, (t, *point))
            if values is None:
                return None
            rows.append(values)
        interpolants = [interpolated(roots, column, prime) for column in zip(*rows, strict=True)]
        return [int(P[j]) for P in interpolants for j in range(m)]

    reconstruction = reconstruct(black_box_over_root, names[1:], draw=draw_splitting_prime, **options)
    if reconstruction.functions is None:
        return reconstruction
    t, *gens = ring(names).gens()
    functions = []
    for k in range(0, len(reconstruction.functions), m):
        numerators, denominator = over_one_denominator(reconstruction.functions[k : k + m], t.context(), gens)
        functions.append(RationalFunction(sum((P * t**j for j, P in enumerate(numerators)), 0 * t), denominator))
    return replace(reconstruction, functions=tuple(functions))


def primitive_over(root: Root, polynomial: fmpq_mpoly, n: int) -> fmpq_mpoly:
    """Divide a nonzero polynomial in n variables, the root and eps by all factors that do not contain the variables.

    The result has integer coefficients without a common factor. It is determined up to a factor in the number field;
    the shortest of the multiples with a rational coefficient is returned.

    >>> from kahanmaps.algebra.roots import parse_root
    >>> x, y, a, eps = ring(["x", "y", "a", "eps"]).gens()
    >>> primitive_over(parse_root("root of t^2 - 2"), (a*x + 6*y) * (1 - a*eps), 2)
    3*y*a + x
    """
    K = root.number_field
    rows_in_eps: dict[tuple[int, ...], list[EtaleElement]] = {}
    for monomial, coefficient in root.remainder(polynomial, n).terms():
        *exponents, j, e = (int(k) for k in monomial)
        row = rows_in_eps.setdefault(tuple(exponents), [])
        row += [K.zero] * (e + 1 - len(row))
        row[e] = row[e] + K.convert(fmpq_poly([0] * j + [coefficient]))
    # Euclid's algorithm over the number field: the content is a polynomial in eps, up to a factor in the field.
    content: list[EtaleElement] = []
    for row in rows_in_eps.values():
        content, remainder = row, content
        while remainder:
            content, remainder = remainder, _divide(content, remainder)[1]
    entries = {
        (*exponents, e): c
        for exponents, row in rows_in_eps.items()
        for e, c in enumerate(_divide(row, content)[0])
        if c != 0
    }
    multiples = []
    for unit in {str(c): c for c in entries.values()}.values():
        terms = {
            (*m[:-1], j, m[-1]): number
            for m, c in entries.items()
            for j, number in enumerate((c / unit).coefficients)
            if number != 0
        }
        multiples.append(primitive_part(polynomial.context().from_dict(terms))[1])
    return min(multiples, key=lambda P: (len(P), len(str(P)), str(P)))


def _divide(P: Sequence[EtaleElement], Q: Sequence[EtaleElement]) -> tuple[list[EtaleElement], list[EtaleElement]]:
    """Return quotient and remainder of P by Q, polynomials over a field with coefficients in ascending order.

    The last coefficients of P and Q are not 0.
    """
    quotient, remainder = [Q[-1] * 0] * max(0, len(P) - len(Q) + 1), list(P)
    while len(remainder) >= len(Q):
        shift, factor = len(remainder) - len(Q), remainder[-1] / Q[-1]
        quotient[shift] = factor
        remainder = [c - factor * Q[k - shift] if k >= shift else c for k, c in enumerate(remainder[:-1])]
        while remainder and remainder[-1] == 0:
            remainder.pop()
    return quotient, remainder


def euler_map(field: PolynomialField) -> ImplicitMap:
    """Return the map x -> x + eps f(x), which stands for the flow of f; it has the variables and symbols of f."""
    context = ring((*field.variables, *field.symbols, "eps"))
    *gens, eps = context.gens()
    images = (x + eps * f.compose(*gens, ctx=context) for x, f in zip(gens, field.rhs, strict=False))
    return explicit_map(field.variables, [RationalFunction(P, context.constant(1)) for P in images])


def flow_preserves(
    system: PolynomialField,
    function: RationalFunction,
    *,
    is_density: bool = False,
    factor: RationalFunction | None = None,
) -> bool:
    """Return whether f . grad I = 0, or for a density phi whether f . grad phi = phi div f (dx/phi is invariant).

    With a `factor` c, a function of the symbols, return whether f . grad I = c I; then exp(-c t) I is a time-dependent
    integral. Exact: the identity is expanded. `function` is I or phi, in (variables, symbols, eps).

    >>> from kahanmaps.algebra.parsing import parse_rational_function
    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> rotation = QuadraticSystem.from_text(["x", "y"], ["y", "-x"])
    >>> [flow_preserves(rotation, parse_rational_function(t, ["x", "y", "eps"])) for t in ("x^2 + y^2", "x/y")]
    [True, False]
    """
    P, Q = function.numerator, function.denominator
    context = P.context()
    count_work(10 + len(P) * len(Q) * sum(map(len, system.rhs)) / 10)
    change = system.derivative(P) * Q - P * system.derivative(Q)
    if is_density:
        change -= P * Q * system.divergence.compose(*context.gens()[: system.dim + len(system.symbols)], ctx=context)
    if factor is not None:
        change = change * factor.denominator - P * Q * factor.numerator
    return bool(change.is_zero())


def verdict_on(
    system_like: QuadraticSystem | MapFamily,
    function: RationalFunction,
    eps: fmpq | None,
    seed: int = 0,
    *,
    is_density: bool,
    factor: RationalFunction | None = None,
    expands: bool = True,
) -> tuple[Certainty, Evidence]:
    """Certify that I(x~) = I(x), or for a density phi that phi(x~) = det dPhi(x) phi(x) (dx/phi is invariant).

    The verdict is about the identity for every value of the symbols of the map and, if `eps` is None, for every eps.

    Args:
        system_like: the map, whose parameters may be symbols; a system stands for its Kahan map.
        function: I or phi, an exact function of (variables, symbols, eps); an algebraic number is one of the symbols.
        eps: half the time step (exact), or None for every eps.
        seed: the random seed.
        is_density: whether the function is a density phi.
        factor: c, a function of the same names, in I(x~) = c I(x) or phi(x~) = c det dPhi(x) phi(x); None means c = 1.
        expands: whether to try a proof by expansion after random points have supported the identity.

    Returns:
        The pair (verdict, evidence): proved by expansion, supported or refuted at random points modulo primes, or
        undecided. It is undecided if the two sides are undefined at all points, e.g. for a map that is defined nowhere;
        for a density also if the map is not invertible.

    Source: celledoni-2019.

    >>> from kahanmaps.algebra.parsing import parse_rational_function
    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> rotation = QuadraticSystem.from_text(["x", "y"], ["y", "-x"])
    >>> for text in ("x^2 + y^2", "x^2 - y^2"):
    ...     function = parse_rational_function(text, ["x", "y", "eps"])
    ...     print(verdict_on(rotation, function, None, is_density=False)[0])
    proved
    refuted
    >>> system = QuadraticSystem.from_text(["x"], ["x^2"])
    >>> str(verdict_on(system, parse_rational_function("x^2", ["x", "eps"]), None, is_density=True)[0])
    'proved'
    """
    map_ = as_map(system_like)
    n, root = map_.dim, map_.root

    def sides(field: Field, point: tuple[Any, ...], eps_value: Any) -> Sides | None:
        """Return P(x~) Q(x) and P(x) Q(x~) for I = P/Q; for a density, times denominator and numerator of det dPhi."""
        x, symbols = point[:n], point[n:]
        map_at_eps = map_.at(eps_value, field, symbols)
        image = map_at_eps.step(x)
        parameters = (*(symbols if root is None else (root.over(field),)), eps_value)
        at_x, at_image = (*x, *parameters), (*image, *parameters)
        P, Q = (evaluate(part, field, at_x) for part in (function.numerator, function.denominator))
        P_image, Q_image = (evaluate(part, field, at_image) for part in (function.numerator, function.denominator))
        # Q may vanish identically at this eps, or on the image of a map that is not invertible: then I is undefined.
        if field.is_zero(Q) or field.is_zero(Q_image):
            return None
        left, right = P_image * Q, P * Q_image
        if factor is not None:
            left = left * evaluate(factor.denominator, field, at_x)
            right = right * evaluate(factor.numerator, field, at_x)
        if is_density:
            numerator, denominator = jacobian_determinant_fraction(map_at_eps, x, image)
            if field.is_zero(numerator):
                return None  # the map is not invertible at x, where both sides are 0
            left, right = left * denominator, right * numerator
        return [left], [right]

    condition = (density_condition if is_density else integral_condition)(function, n, eps, root)
    eps_texts = [] if not map_.has_eps else ["every eps" if eps is None else f"eps = {eps}"]
    parameters_text = " and ".join([*eps_texts, *([f"every {', '.join(map_.symbols)}"] if map_.symbols else [])])
    restriction = f"{' ' if condition.startswith('where') else ', '}{condition}" if condition else ""
    scope = f"for {parameters_text}{restriction}" if parameters_text else restriction.removeprefix(", ").strip()
    identity_key = (map_.symbols, map_.seed_data, function, is_density, *([] if factor is None else [factor]))
    identity = Identity(
        n + len(map_.symbols), sides, eps, scope=scope, has_eps=map_.has_eps, root=root, seed_data=identity_key
    )
    return certified(identity, seed, expands=expands and n <= MAX_DIMENSION)


def certified(identity: Identity, seed: int, *, expands: bool = True) -> tuple[Certainty, Evidence]:
    """Return the pair (verdict, evidence) for an identity, from random points and, if `expands`, from expansion."""
    decision = decide(identity, seed)
    if expands:
        decision = try_expand(identity, decision, seed, _BUDGET)
    return decision.verdict, decision.evidence


@dataclass(frozen=True)
class SeparatedSystem:
    """A system in coordinates z with x = T z; Kahan's method is equivariant under linear changes of variables."""

    system: QuadraticSystem
    T: fmpq_mat

    def function(self, function: RationalFunction) -> RationalFunction:
        """Return a function of (x, symbols, eps) as a function of (z, symbols, eps)."""

        def change_variables(polynomial: fmpq_mpoly) -> fmpq_mpoly:
            context, n = polynomial.context(), self.system.dim
            x = linear_combinations(self.T, context.gens()[:n])
            return polynomial.compose(*x, *context.gens()[n:], ctx=context)

        return RationalFunction(change_variables(function.numerator), change_variables(function.denominator))


def separate_planes(system: QuadraticSystem) -> SeparatedSystem | None:
    """Return a system in coordinates in which the planes over Q of its normal form separate.

    Returns None for a system without such planes, and if the new formulas are not shorter.

    >>> from kahanmaps.documents.catalog import load
    >>> system = load("paper_m2").system
    >>> [len(f) for f in system.rhs], [len(f) for f in separate_planes(system).system.rhs]
    ([8, 8, 9, 9], [2, 3, 3, 2])
    """
    normal_form = system_normal_form(system)
    if not isinstance(normal_form, SystemNormalForm):
        return None
    splitting = Splitting(normal_form.form, QQ, 1, normal_form.T)
    matrices = [splitting.matrix(plane) for plane in range(len(splitting.planes))]
    T = fmpq_mat([list(chain(*rows)) for rows in zip(*matrices, strict=True)])
    separated_system = system.composed(T, [fmpq(0)] * system.dim).transformed(T.inv())
    is_shorter = sum(map(len, separated_system.rhs)) < sum(map(len, system.rhs))
    return SeparatedSystem(separated_system, T) if is_shorter else None
