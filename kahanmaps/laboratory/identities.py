"""Formulas that were found are put to the proof: as identities in x, eps and the symbols.

The two sides are expanded over the field of rational functions, the cofactor form of the claim first, which is the
smaller one: for I = P/Q that P(x~) Q(x) = Q(x~) P(x). Where that exceeds the budget, random points modulo primes
support the identity, with a bound for the error where no parameter is a symbol.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import Any

from flint import fmpq

from kahanmaps.algebra.chance import seed_for
from kahanmaps.algebra.fields import GF, Field
from kahanmaps.algebra.functions import BudgetExceeded, FunctionField
from kahanmaps.algebra.polynomials import RationalFunction, evaluate, ring
from kahanmaps.algebra.residues import random_prime
from kahanmaps.checks.claims import Evidence, Verdict
from kahanmaps.checks.conserve import conservation
from kahanmaps.checks.decide import decide
from kahanmaps.checks.preserve import density_identity
from kahanmaps.documents.parametric import ParametricSystem
from kahanmaps.errors import BadPrime, SingularMatrix, SingularStep
from kahanmaps.invariants.integrals import ClaimedIntegral, integral_condition
from kahanmaps.invariants.measures import ClaimedDensity, density_condition
from kahanmaps.maps.kahan import KahanMapOver
from kahanmaps.systems.quadratic import QuadraticSystem

_BUDGET = 60_000_000
_MAX_DIMENSION = 6
_POINTS = 6


def integral_verdict(
    system: ParametricSystem, integral: RationalFunction, eps: fmpq | None, seed: int = 0
) -> tuple[Verdict, Evidence]:
    """Whether I(x~) = I(x), for every value of the symbols of the system and, if `eps` is None, every eps.

    Args:
        system: the system, some of its parameters symbols.
        integral: an exact function of (variables, symbols, eps).
        eps: the paper's epsilon, an exact number (the time step is 2 eps), or None for every eps.
        seed: of the random points.

    Returns:
        The verdict with its evidence: proved by expansion, supported or refuted at random points modulo primes, or
        undecided where the two sides have no values, as for a map that is singular everywhere.

    Source: celledoni-2019.

    >>> from kahanmaps.algebra.text import parse_rational_function
    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> rotation = ParametricSystem.of_system(QuadraticSystem.from_text(["x", "y"], ["y", "-x"]))
    >>> for text in ("x^2 + y^2", "x^2 - y^2"):
    ...     print(integral_verdict(rotation, parse_rational_function(text, ["x", "y", "eps"]), None)[0])
    proved
    refuted
    """
    return _verdict(system, integral, eps, seed, False)


def density_verdict(
    system: ParametricSystem, density: RationalFunction, eps: fmpq | None, seed: int = 0
) -> tuple[Verdict, Evidence]:
    """Whether phi(x~) det(I - eps f'(x)) = phi(x) det(I + eps f'(x~)), that is, whether dx/phi is invariant.

    Args:
        system: the system, some of its parameters symbols.
        density: phi, an exact function of (variables, symbols, eps).
        eps: the paper's epsilon, an exact number (the time step is 2 eps), or None for every eps.
        seed: of the random points.

    Returns:
        The verdict with its evidence, as `integral_verdict`; undecided as well where the map is not invertible.

    Source: celledoni-2019.

    >>> from kahanmaps.algebra.text import parse_rational_function
    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> system = ParametricSystem.of_system(QuadraticSystem.from_text(["x"], ["x^2"]))
    >>> str(density_verdict(system, parse_rational_function("x^2", ["x", "eps"]), None)[0])
    'proved'
    """
    return _verdict(system, density, eps, seed, True)


def _verdict(
    system: ParametricSystem, function: RationalFunction, eps: fmpq | None, seed: int, is_density: bool
) -> tuple[Verdict, Evidence]:
    condition = (density_condition if is_density else integral_condition)(function, system.dim, eps)
    scope = f"{_scope(system, eps)} {condition}".strip()
    holds = _holds_at_points(system, function, eps, seed, is_density)
    if holds is None:
        return Verdict.UNDECIDED, Evidence("random points over GF(p)", f"has no value at random points, {scope}")
    if not holds:
        return Verdict.REFUTED, Evidence("random points over GF(p)", f"does not hold at a random point, {scope}")
    if system.dim <= _MAX_DIMENSION:
        field = FunctionField((*system.variables, *system.symbols, "eps"), _BUDGET)
        try:
            sides = _sides(
                system,
                function,
                field,
                field.variables[: system.dim],
                field.variables[system.dim : -1],
                field.variables[-1] if eps is None else field.convert(eps),
                is_density,
            )
            if not field.equal(*sides):
                return Verdict.REFUTED, Evidence("expansion", f"the two sides are different functions, {scope}")
            return Verdict.PROVED, Evidence("expansion", f"both sides are the same rational function, {scope}")
        except (BudgetExceeded, SingularMatrix, ZeroDivisionError):
            pass
    if system.symbols:
        return Verdict.SUPPORTED, Evidence(
            "random points over GF(p)",
            f"held at {_POINTS} random points modulo random primes of 61 bits, {scope}",
            {"points": _POINTS},
        )
    quadratic = QuadraticSystem.from_polynomials(
        [polynomial.compose(*ring(system.variables).gens(), ctx=ring(system.variables)) for polynomial in system.rhs]
    )
    if is_density:
        identity = density_identity(quadratic, ClaimedDensity(function, eps), eps)
    else:
        identity = conservation(quadratic, ClaimedIntegral("I", function), eps)
    decision = decide(identity, seed)
    return decision.verdict, decision.evidence


def _scope(system: ParametricSystem, eps: fmpq | None) -> str:
    step = "for every eps" if eps is None else f"for eps = {eps}"
    return f"{step} and every {', '.join(system.symbols)}" if system.symbols else step


def _sides(
    system: ParametricSystem,
    function: RationalFunction,
    field: Field,
    point: Sequence[Any],
    values: Sequence[Any],
    eps: Any,
    is_density: bool,
) -> tuple[Any, Any]:
    """Both sides at a point over a field. Raises ZeroDivisionError where the products are 0 = 0 and say nothing."""
    map_ = KahanMapOver(system.over(field, values), eps)
    image = map_.step(point)
    here, there = (*point, *values, eps), (*image, *values, eps)
    P, Q = (evaluate(part, field, here) for part in (function.numerator, function.denominator))
    P_there, Q_there = (evaluate(part, field, there) for part in (function.numerator, function.denominator))
    # Q may vanish at the eps in force, and where a map is not invertible on its image: then P/Q has no value there.
    if field.is_zero(Q) or field.is_zero(Q_there):
        raise ZeroDivisionError("the denominator is 0")
    left, right = P_there * Q, P * Q_there
    if is_density:
        above, below = map_.inverse.determinant(image), map_.determinant(point)
        if field.is_zero(above):
            raise ZeroDivisionError("the map is not invertible at this point")
        left, right = left * below, right * above
    return left, right


def _holds_at_points(
    system: ParametricSystem, function: RationalFunction, eps: fmpq | None, seed: int, is_density: bool
) -> bool | None:
    """Whether the sides agree at random points modulo primes, None where they had no value at any of many."""
    rng = random.Random(f"identity {seed_for(seed, system.symbols, system.rhs, function, eps, is_density)}")
    good = 0
    for _ in range(10 * _POINTS):
        field: Field = GF(random_prime(rng))
        point = [field.random(rng) for _ in range(system.dim)]
        values = [field.random(rng) for _ in system.symbols]
        try:
            step = field.random(rng) if eps is None else field.convert(eps)
            left, right = _sides(system, function, field, point, values, step, is_density)
        except (BadPrime, SingularStep, SingularMatrix, ZeroDivisionError):
            continue
        if left != right:
            return False
        good += 1
        if good == _POINTS:
            return True
    return None
