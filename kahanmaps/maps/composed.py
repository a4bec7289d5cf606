"""Compositions of maps and of their inverses, multiplied out: given by rational functions then, as others are."""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import Any

from kahanmaps.algebra.chance import random_prime_field, seed_for
from kahanmaps.algebra.functions import BudgetExceeded, FunctionField
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.errors import BadPrime, InputError, SingularStep
from kahanmaps.maps.explicit import explicit_map
from kahanmaps.maps.implicit import BirationalMap, ImplicitMap

_BUDGET = 20_000_000  # products of terms
_TRIES = 20


def composed_map(
    *maps: tuple[BirationalMap, int] | BirationalMap, variables: Sequence[str] | None = None
) -> ImplicitMap:
    """The map that takes one step of each map after the other, all with the same eps.

    Args:
        maps: in the order in which they are applied; with a power, (map, power), which may be negative.
        variables: names for the coordinates, by default those of the first map; the others are matched by position.

    Returns:
        The map, exact; its inverse is known if all the maps have one.

    Raises:
        InputError: for maps of different dimensions, or with the same variables in another order, for a negative power
            of a map without inverse, and where the formulas grow too large.

    >>> from kahanmaps.maps.kahan import Kahan
    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> f, g = (Kahan(QuadraticSystem.from_text(["x"], [rhs])) for rhs in ("x^2", "x"))
    >>> conjugate = composed_map(g, f, (g, -1)).at("1/2")
    >>> conjugate.step(["1/9"]), g.at("1/2").inverse.step(f.at("1/2").step(g.at("1/2").step(["1/9"])))
    ((1/6,), (1/6,))
    """
    steps = [
        (one, 1 if power > 0 else -1)
        for one, power in (given if isinstance(given, tuple) else (given, 1) for given in maps)
        for _ in range(abs(power))
    ]
    if not steps:
        raise InputError("found no map to compose, expected at least one")
    first = steps[0][0]
    steps = _without_inverses(steps) or [steps[0], (first, -steps[0][1])]
    if any(one.dim != first.dim for one, _ in steps):
        raise InputError(f"found maps of the dimensions {', '.join(str(one.dim) for one, _ in steps)}, expected one")
    for one, _ in steps:
        if set(one.variables) == set(first.variables) and one.variables != first.variables:
            orders = f"{', '.join(first.variables)} and {', '.join(one.variables)}"
            raise InputError(f"found the variables in two orders, {orders}, expected one order")
    variables = first.variables if variables is None else tuple(variables)
    if len(variables) != first.dim:
        raise InputError(f"found {len(variables)} variables for maps of dimension {first.dim}, expected as many")
    names = (*variables, *first.names[first.dim :])
    if any(one.symbols != steps[0][0].symbols for one, _ in steps):
        raise InputError("found maps with different symbols, expected the same for all")
    image = _formulas(names, steps)
    try:
        inverse = _formulas(names, [(one, -sign) for one, sign in reversed(steps)])
    except InputError:
        inverse = None
    return explicit_map(variables, image, inverse)


def _without_inverses(steps: Sequence[tuple[BirationalMap, int]]) -> list[tuple[BirationalMap, int]]:
    """The steps without those that their neighbours undo."""
    left: list[tuple[BirationalMap, int]] = []
    for one, sign in steps:
        if left and left[-1][1] == -sign and (left[-1][0] is one or left[-1][0].subject == one.subject):
            left.pop()
        else:
            left.append((one, sign))
    return left


def is_involution(map_: BirationalMap) -> bool:
    """Whether Phi(Phi(x)) = x, at random points modulo primes: one of them fails by chance with probability < 2^-40."""
    rng, tried = random.Random(f"involution {seed_for(0, *map_.subject)}"), 0
    for _ in range(_TRIES):
        field = random_prime_field(rng)
        x = tuple(field.random(rng) for _ in map_.variables)
        try:
            over = map_.at(field.random(rng), field, [field.random(rng) for _ in map_.symbols])
            if over.step(over.step(x)) != x:
                return False
        except (BadPrime, SingularStep):
            continue
        tried += 1
        if tried == 3:
            return True
    return False


def _formulas(names: Sequence[str], steps: Sequence[tuple[BirationalMap, int]]) -> list[RationalFunction]:
    """The coordinates of the image of (x_1, ..., x_n) as functions of the names, eps last, in lowest terms."""
    field = FunctionField(names, _BUDGET, reduces=True)
    n = steps[0][0].dim
    *values, eps = field.variables[n:]
    point: tuple[Any, ...] = tuple(field.variables[:n])
    try:
        for one, sign in steps:
            over = one.at(eps, field, values)
            point = (over if sign > 0 else over.inverse).step(point)
    except BudgetExceeded as error:
        raise InputError("found a composition with formulas too large to be multiplied out") from error
    return [RationalFunction(entry.above, entry.below) for entry in point]
