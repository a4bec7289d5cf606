"""The maps modulo primes on which one map is examined, and the way from what is found on them to formulas."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

from flint import fmpq

from kahanmaps.algebra.chance import seed_for
from kahanmaps.algebra.fields import GF, rational
from kahanmaps.algebra.polynomials import RationalFunction, ring, substitute
from kahanmaps.algebra.residues import random_prime
from kahanmaps.algebra.roots import Root
from kahanmaps.algebra.work import Budget
from kahanmaps.checks.claims import Certainty, Evidence
from kahanmaps.documents.files import SystemFile
from kahanmaps.documents.symbols import map_with_symbols
from kahanmaps.errors import BadPrime, InputError
from kahanmaps.laboratory.modular_points import ModularMap, NoPoint
from kahanmaps.laboratory.preserve.closed_forms import MAX_DEGREE, ClosedForms, Spaces, closed_forms
from kahanmaps.laboratory.preserve.darboux.affine_functions import affine_darboux, darboux_cofactor
from kahanmaps.laboratory.preserve.darboux.cofactors import (
    Cofactor,
    cofactor_of_affine,
    determinant_factors,
    jacobian_factors,
)
from kahanmaps.laboratory.preserve.identities import Separated, separated, verdict_on
from kahanmaps.laboratory.preserve.limit.flow import ModularFlow, euler_map, is_kept_by_flow
from kahanmaps.laboratory.preserve.limit.flow_polynomials import FlowPolynomials, flow_polynomials
from kahanmaps.maps.algebraic import AlgebraicMap
from kahanmaps.maps.implicit import ImplicitMap
from kahanmaps.maps.kahan import Kahan
from kahanmaps.systems.polynomial import PolynomialField
from kahanmaps.systems.quadratic import QuadraticSystem

_INTEGRAL = Evidence("expansion", "f . grad I is 0, multiplied out")
_TIMED = Evidence("expansion", "f . grad I is c I for the constant c, multiplied out")
_DENSITY = Evidence("expansion", "f . grad phi is phi div f, multiplied out")
_STAND_IN = fmpq(1000003, 7)  # for an algebraic number, where invariant hyperplanes over Q are looked for


class Laboratory:
    """The maps on which a file's map is examined: two primes, each with its own eps and its own values of the symbols.

    With `eps` (exact; the time step is 2 eps) all maps are at that eps. With `flow` they are flows, of an adjusted
    Kahan map that of the field at eps = 0, and of a polarised map `map` is then x + eps f. `system` is there if the map
    is the Kahan map of a system without eps in its coefficients: what theorems say of these is known then. `field` is
    the system or, with `flow`, the field of any degree. Where a parameter is an algebraic number, the `root`, and this
    is `algebraic`, it is the only one of the `symbols`, with no values but the roots modulo primes; `free_symbols` are
    those that have any value.
    Raises InputError for eps = 0, for eps both a number and a symbol, and for symbols that `map_with_symbols` refuses.

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
        self.symbols = self.free_symbols = tuple(name for name in dict.fromkeys(symbols) if name != "eps")
        self.root: Root | None = None
        self.eps = None if eps is None else rational(eps)
        if self.eps == 0:
            raise InputError("found eps = 0, expected another number: at eps = 0 the Kahan map is the identity")
        if self.eps is not None and "eps" in symbols:
            raise InputError("found eps both as a number and as a symbol, expected one of the two")
        if flow and file.map.root is not None:
            raise InputError(f"found a {file.map.root}, expected rational parameters: it is the flow that is asked for")
        if algebraic and isinstance(file.map, AlgebraicMap):
            self.root, self.map = file.map.root, file.map.given
            if symbols or self.root.degree > MAX_DEGREE:
                found = f"a symbol beside a {self.root}" if symbols else f"a {self.root}"
                raise InputError(f"found {found}, expected no other symbols and a degree of at most {MAX_DEGREE}")
            self.symbols = self.map.symbols
        else:
            self.map = map_with_symbols(file, self.symbols)
        if flow and isinstance(self.map, Kahan) and self.map.system.symbols == ("eps",):
            rhs = tuple(substitute(polynomial, {"eps": fmpq(0)}) for polynomial in self.map.system.rhs)
            self.file = SystemFile.from_system(QuadraticSystem(rhs), file.name)
            self.map = self.file.map
        self.system = None
        if isinstance(self.map, Kahan) and "eps" not in self.map.system.symbols:
            self.system = self.map.system
        self.field: PolynomialField | None = self.system
        if flow and isinstance(self.map, ImplicitMap) and self.map.of_field is not None:
            self.field = self.map.of_field
            self.map = euler_map(self.field)
        self.flow = flow
        # What one search knows already; searches have laboratories of their own, so that no answer depends on others.
        self._too_long: dict[bool, int] = {}  # of integrals and of densities: how many terms the shortest one had
        self._flow_polynomials: FlowPolynomials | None = None
        if flow and (self.field is None or self.eps is not None):
            what = "eps = " + str(self.eps) if self.field is not None else self.map.kind
            raise InputError(f"found {what}, expected a polynomial vector field without eps: its flow is asked for")
        subject = self.map.subject if self.root is None else file.map.subject
        self.seed = seed_for(seed, self.symbols, subject, self.eps)  # of all that is drawn for this map
        self.maps = list(self._drawn("laboratory", 2))
        self.primes = tuple(map_.prime for map_ in self.maps)
        self.asked = file, self.free_symbols, self.eps, seed, self.primes  # with which all results of searches begin

    def map_at(self, prime: int, values: Sequence[int], eps: int) -> ModularMap:
        """The map modulo a prime; the residue `eps` counts only where eps is no given number. Raises BadPrime."""
        if self.eps is not None:
            eps = int(GF(prime).convert(self.eps))
            if eps == 0:
                raise BadPrime(f"the prime {prime} divides the numerator of eps", prime)
        if self.flow and self.field is not None:
            return ModularFlow(self.field, prime, values, self.seed)
        return ModularMap(self.map, prime, eps, values, self.seed)

    def map_for(self, prime: int, values: Sequence[int]) -> ModularMap:
        """The map for values of what formulas contain: of the symbols and, where it enters as one, of eps last."""
        count = len(self.symbols)
        return self.map_at(prime, values[:count], (*values, 1)[count])

    def other_maps(self, count: int) -> Iterator[ModularMap]:
        """So many maps modulo further primes, each at other random residues of the symbols and eps."""
        return self._drawn("other maps", count)

    def _drawn(self, name: str, count: int) -> Iterator[ModularMap]:
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
        """How eps enters formulas: "not", where it is a number, "by weight" for homogeneous f, else as a "symbol"."""
        if self.eps is not None or self.flow or not self.map.has_eps:
            return "not"
        if self.system is None:
            return "symbol"
        return "by weight" if self.system.is_homogeneous else "symbol"

    @property
    def defect(self) -> str:
        """Why the maps at the given eps are no birational maps, measured at random points; empty where they are."""
        if self.flow or (self.eps is None and self.system is not None):
            return ""  # det(I - eps f'(x)) is 1 at eps = 0
        at = "" if self.eps is None else f"at eps = {self.eps} "
        name, above = self.map.denominator_name, "det dPhi(x)"
        if self.system is not None:
            name, above = "det(I - eps f'(x))", "det(I + eps f'(x))"
        try:
            pairs = [(map_, *pair) for map_ in self.maps for pair in map_.pairs(2)]
        except NoPoint:
            return f"{at}the map has no value anywhere: {name} is identically 0"
        if not any(map_.determinant(x, image)[0] for map_, x, image in pairs):
            return f"{at}the map is not invertible: {above} is 0 at all {'points' if self.system is None else 'images'}"
        return ""

    def cofactors(self) -> list[Cofactor]:
        """The cofactors that polynomials are tried with."""
        if self.flow:
            return []
        if self.system is None:
            return list(jacobian_factors(self.map))
        return [*self.affine_cofactors(), *determinant_factors(self.map)]

    def affine_cofactors(self) -> list[Cofactor]:
        """Those of affine Darboux functions of the system, which is there."""
        assert self.system is not None
        context = self.system.rhs[0].context()
        gens = context.gens()[: self.system.dim]
        return [
            cofactor_of_affine(one.function, self.system)
            for one in affine_darboux(self.system.at([_STAND_IN]) if self.root else self.file.system).functions
            # l is to divide l' with the symbols free, not only at the values that the file gives them, or at that one
            if darboux_cofactor(self.system, one.function.compose(*gens, ctx=context)) is not None
        ]

    def flow_polynomials(self, budget: Budget) -> FlowPolynomials:
        """Darboux polynomials of the flow in (variables, symbols, eps); they are sought once, within that budget."""
        if self._flow_polynomials is not None:
            return self._flow_polynomials
        assert self.field is not None
        found, context = flow_polynomials(self.field, budget=budget, seed=self.seed), ring(self.map.names)
        gens = context.gens()[:-1]
        functions = [P.compose(*gens, ctx=context) for P in found.functions]
        # With symbols that search ends at a low degree in all names.
        affine = self.affine_cofactors() if self.symbols and self.system is not None else []
        more = [one.polynomial for one in affine if one.polynomial is not None and one.polynomial not in functions]
        self._flow_polynomials = replace(found, functions=(*functions, *more))
        return self._flow_polynomials

    def verdict_on(
        self, function: RationalFunction, *, is_density: bool = False, factor: RationalFunction | None = None
    ) -> tuple[Certainty, Evidence]:
        """Whether the map, or the flow, keeps I or dx/phi, as identities.verdict_on has it; of a flow by expansion.

        What is no shorter than what was too long to expand is not expanded.
        """
        if self.field is not None and self.flow:
            kept = is_kept_by_flow(self.field, function, is_density=is_density, factor=factor)
            evidence = _DENSITY if is_density else _INTEGRAL if factor is None else _TIMED
            return (Certainty.PROVED if kept else Certainty.REFUTED), evidence
        map_ = self.map if self.root is None else self.file.map
        told: dict[str, Any] = {"eps": self.eps, "seed": self.seed, "is_density": is_density}
        separated = self._separated
        terms = len(function.numerator) + len(function.denominator)
        expands = separated is None and terms < self._too_long.get(is_density, math.inf)
        verdict, evidence = verdict_on(map_, function, **told, factor=factor, expands=expands)
        if verdict is Certainty.SUPPORTED and separated is not None:
            given = separated.function(function), None if factor is None else separated.function(factor)
            there, proof = verdict_on(separated.system, given[0], **told, factor=given[1])
            if there is not Certainty.SUPPORTED:
                return there, replace(proof, summary=f"{proof.summary}, in coordinates in which the planes separate")
        elif verdict is Certainty.SUPPORTED and expands:
            self._too_long[is_density] = terms
        return verdict, evidence

    @cached_property
    def _separated(self) -> Separated | None:
        return None if self.system is None or self.symbols else separated(self.system)

    def formulas(
        self,
        model: Spaces,
        spaces_on: Callable[[ModularMap], Spaces | None],
        budget: Budget,
        variables: Sequence[str] = (),
        eps_enters: str = "",
    ) -> ClosedForms:
        """The polynomials that span spaces known modulo primes: `model` on the first map, `spaces_on(map)` on others.

        `spaces_on` returns None where the map is special. The search ends when the `budget` is spent.
        Without other `variables` they are those of the map; `eps_enters` is as for formulas in these unless given.
        """
        return closed_forms(
            model,
            lambda prime, values: spaces_on(self.map_for(prime, values)),
            variables or self.map.variables,
            self.symbols,
            eps_enters or self.eps_enters,
            root=self.root,
            seed=self.seed,
            budget=budget,
        )
