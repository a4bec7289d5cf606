"""Formulas that were found are put to the proof: as identities in x, eps and the symbols.

They are stated without quotients, for I = P/Q that P(x~) Q(x) = P(x) Q(x~): that is the smaller form to expand. In
coordinates in which the planes of a normal form separate, identities that are too long to expand are short.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.fields import QQ, Field
from kahanmaps.algebra.functions import DEFAULT_BUDGET
from kahanmaps.algebra.polynomials import RationalFunction, evaluate, linear_combinations
from kahanmaps.checks.claims import Certainty, Evidence
from kahanmaps.checks.decide import Identity, Sides, decide
from kahanmaps.checks.judge import MAX_DIMENSION, settle
from kahanmaps.family.system_normal_form import SystemNormalForm, system_normal_form
from kahanmaps.invariants.phase_functions import density_condition, integral_condition, jacobian_determinant_sides
from kahanmaps.maps.implicit import BirationalMap
from kahanmaps.maps.kahan import as_map
from kahanmaps.maps.normal_form.splitting import Splitting
from kahanmaps.systems.quadratic import QuadraticSystem

_BUDGET = DEFAULT_BUDGET  # as `check-integrals` has it: what is proved there is proved here


def verdict_on(
    given: QuadraticSystem | BirationalMap,
    function: RationalFunction,
    eps: fmpq | None,
    seed: int = 0,
    *,
    is_density: bool,
    factor: RationalFunction | None = None,
    expands: bool = True,
) -> tuple[Certainty, Evidence]:
    """Whether I(x~) = I(x); of a density phi whether phi(x~) = det dPhi(x) phi(x), which says that dx/phi is invariant.

    Both are for every value of the symbols of the map and, if `eps` is None, every eps.

    Args:
        given: the map, some of its parameters symbols; a system stands for its Kahan map.
        function: I or phi, an exact function of (variables, symbols, eps); an algebraic number is one of the symbols.
        eps: the paper's epsilon, an exact number (the time step is 2 eps), or None for every eps.
        seed: of the random points.
        is_density: whether the function is a phi.
        factor: c, a function of the same names, for I(x~) = c I(x) or c phi; None for 1.
        expands: whether to try a proof where random points support it.

    Returns:
        The verdict with its evidence: proved by expansion, supported or refuted at random points modulo primes, or
        undecided where the two sides have no values, as for a map that is singular everywhere; of a density also where
        the map is not invertible.

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
    map_ = as_map(given)
    n, root = map_.dim, map_.root

    def sides(field: Field, place: tuple[Any, ...], step: Any) -> Sides | None:
        """P(x~) Q(x) and P(x) Q(x~) for P/Q, of a density times the determinants: in x, the symbols and eps."""
        point, symbols = place[:n], place[n:]
        over = map_.at(step, field, symbols)
        image = over.step(point)
        values = symbols if root is None else (root.over(field),)
        here, there = (*point, *values, step), (*image, *values, step)
        P, Q = (evaluate(part, field, here) for part in (function.numerator, function.denominator))
        P_there, Q_there = (evaluate(part, field, there) for part in (function.numerator, function.denominator))
        # Q may vanish at the eps in force, and where a map is not invertible on its image: then P/Q has no value there.
        if field.is_zero(Q) or field.is_zero(Q_there):
            return None
        left, right = P_there * Q, P * Q_there
        if factor is not None:
            left = left * evaluate(factor.denominator, field, here)
            right = right * evaluate(factor.numerator, field, here)
        if is_density:
            numerator, denominator = jacobian_determinant_sides(over, point, image)
            if field.is_zero(numerator):
                return None  # the map is not invertible here, and 0 = 0 says nothing
            left, right = left * denominator, right * numerator
        return [left], [right]

    condition = (density_condition if is_density else integral_condition)(function, n, eps, root)
    step = [] if not map_.has_eps else ["every eps" if eps is None else f"eps = {eps}"]
    values = " and ".join([*step, *([f"every {', '.join(map_.symbols)}"] if map_.symbols else [])])
    told = f"{' ' if condition.startswith('where') else ', '}{condition}" if condition else ""
    scope = f"for {values}{told}" if values else told.removeprefix(", ").strip()
    subject = (map_.symbols, map_.subject, function, is_density, *([] if factor is None else [factor]))
    identity = Identity(
        n + len(map_.symbols), sides, eps, scope=scope, has_eps=map_.has_eps, root=root, subject=subject
    )
    return judged(identity, seed, expands=expands and n <= MAX_DIMENSION)


def judged(identity: Identity, seed: int, *, expands: bool = True) -> tuple[Certainty, Evidence]:
    """The verdict on an identity, by random points and, if `expands`, by expansion."""
    decision = decide(identity, seed)
    found = settle(identity, decision, seed, _BUDGET) if expands else decision
    return found.verdict, found.evidence


@dataclass(frozen=True)
class Separated:
    """The `system` that another one is in z, where x = T z. A Kahan map is the same in all linear coordinates."""

    system: QuadraticSystem
    T: fmpq_mat

    def function(self, given: RationalFunction) -> RationalFunction:
        """A function of (x, ...) as one of (z, ...)."""

        def there(polynomial: fmpq_mpoly) -> fmpq_mpoly:
            context, n = polynomial.context(), self.system.dim
            x = linear_combinations(self.T, context.gens()[:n])
            return polynomial.compose(*x, *context.gens()[n:], ctx=context)

        return RationalFunction(there(given.numerator), there(given.denominator))


def separated(system: QuadraticSystem) -> Separated | None:
    """The system where its planes over Q separate; None for one without such planes, and where it is not shorter.

    >>> from kahanmaps.documents.catalog import load
    >>> system = load("paper_m2").system
    >>> [len(f) for f in system.rhs], [len(f) for f in separated(system).system.rhs]
    ([8, 8, 9, 9], [2, 3, 3, 2])
    """
    known = system_normal_form(system)
    if not isinstance(known, SystemNormalForm):
        return None
    splitting = Splitting(known.form, QQ, 1, known.T)
    matrices = [splitting.matrix(plane) for plane in range(len(splitting.planes))]
    T = fmpq_mat([list(chain(*rows)) for rows in zip(*matrices, strict=True)])
    there = system.composed(T, [fmpq(0)] * system.dim).transformed(T.inv())
    return Separated(there, T) if sum(map(len, there.rhs)) < sum(map(len, system.rhs)) else None
