"""Compositions of maps and of their inverses, evaluated factor by factor.

A composition is not defined at a point if one of its steps is not defined there, even if the expanded formulas of the
composition have a value at this point. Formulas are expanded only for output.
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from flint import fmpq_mpoly

from kahanmaps.algebra.chance import derive_seed, random_prime_field
from kahanmaps.algebra.fields import QQ, Field, integer
from kahanmaps.algebra.functions import BudgetExceeded, FunctionField
from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.errors import BadPrime, InputError, SingularStep, counted, quoted
from kahanmaps.maps.explicit import explicit_map
from kahanmaps.maps.implicit import ImplicitMap, Map, MapFamily, nonzero_eps
from kahanmaps.maps.inverse import Rows, TooLarge

_BUDGET = 20_000_000  # maximal number of products of terms in one expansion
_TRIES = 20  # random points at which `is_involution` tests a map


@dataclass(frozen=True, eq=False)
class MapFactor:
    """A factor of a composition: a map or its inverse; `values` are the values of the symbols of the map."""

    map: MapFamily
    is_inverse: bool
    values: tuple[RationalFunction, ...] = ()

    @property
    def seed_data(self) -> tuple[Any, ...]:
        """The data that determine the factor, including its direction."""
        return (int(self.is_inverse), *self.map_and_values)

    @property
    def map_and_values(self) -> tuple[Any, ...]:
        """The data that determine the factor, without its direction."""
        return (self.map.seed_data, self.values)

    def at(self, eps: Any, over: Field, symbols: Sequence[Any]) -> Map:
        """Return the map over a field. A pole of a symbol's value raises BadPrime, in characteristic 0 InputError."""
        values = [function.value(over, symbols) for function in self.values]
        if any(value is None for value in values):
            if over.characteristic:
                raise BadPrime(f"modulo {over.characteristic} a parameter has a pole", over.characteristic)
            raise InputError("a parameter of a part has a pole at these values of the symbols")
        map_at_eps = self.map.at(eps, over, values)
        return map_at_eps.inverse if self.is_inverse else map_at_eps


class ComposedMap(MapFamily):
    """The composition of several maps; constructed by `composed_map`."""

    title = "composition"

    def __init__(self, variables: tuple[str, ...], parts: Sequence[MapFactor], symbols: tuple[str, ...]) -> None:
        self.variables, self.parts, self._symbols = variables, tuple(parts), symbols
        self._cache: tuple[Field, Any, Map] | None = None

    @property
    def symbols(self) -> tuple[str, ...]:
        return self._symbols

    @cached_property
    def has_eps(self) -> bool:
        """Whether eps occurs in a factor."""
        return any(part.map.has_eps for part in self.parts)

    @property
    def seed_data(self) -> tuple[Any, ...]:
        return (self.variables, self.symbols, [part.seed_data for part in self.parts])

    @cached_property
    def time_steps(self) -> int:  # type: ignore[override]  # read only
        """The sum of the factors' `time_steps` if all factors are powers of one map, otherwise 0 (no common flow)."""
        factors = self._elementary_factors
        return sum(steps for _, steps in factors) if all(factor == factors[0][0] for factor, _ in factors) else 0

    @property
    def _elementary_factors(self) -> list[tuple[Any, int]]:
        """The elementary factors, nested ones included: pairs (data, `time_steps`, which is < 0 for an inverse)."""
        elementary_factors: list[tuple[Any, int]] = []
        for map_factor in self.parts:
            factors = [(map_factor.map_and_values, map_factor.map.time_steps)]
            if isinstance(map_factor.map, ComposedMap) and not map_factor.values:
                factors = map_factor.map._elementary_factors
            elementary_factors += [(factor, -steps if map_factor.is_inverse else steps) for factor, steps in factors]
        return elementary_factors

    @property
    def digits(self) -> int:
        return sum(part.map.digits for part in self.parts)

    def at(self, eps: Any, over: Field = QQ, values: Sequence[Any] = ()) -> Map:
        """Return the map over a field. Raises InputError for eps = 0, BadPrime if it has no reduction modulo p."""
        eps_element = nonzero_eps(eps, over) if self.has_eps else over.convert(eps)
        if self._cache is None or values or self._cache[0] is not over or self._cache[1] is not eps_element:
            parts = [part.at(eps_element, over, values) for part in self.parts]
            self._cache = (over, None if values else eps_element, Map(parts, eps_element, self.variables))
        return self._cache[2]

    @cached_property
    def _multiplied_out(self) -> ImplicitMap | None:
        image = _expand_image(self.names, self.parts)
        return None if image is None else explicit_map(self.variables, image)

    @property
    def is_small(self) -> bool:
        """Whether the formulas of the map are short enough to be expanded."""
        return self._multiplied_out is not None

    @property
    def multiplied_out(self) -> ImplicitMap:
        """The expanded map, without an inverse. Raises TooLarge (an InputError) if its formulas are too long."""
        if self._multiplied_out is None:
            raise TooLarge(_too_large_message(self.parts))
        return self._multiplied_out

    @property
    def image(self) -> tuple[RationalFunction, ...] | None:
        """The coordinates of x~ as functions of `names`. Raises InputError if these functions are too long."""
        return self.multiplied_out.image

    @property
    def rows(self) -> Rows:  # type: ignore[override]  # read only
        """The rows of the expanded map. Raises InputError if the formulas are too long."""
        return self.multiplied_out.rows

    @cached_property
    def inverse_rows(self) -> Rows:
        """The rows of the expanded inverse. Raises InputError if the formulas are too long."""
        inverse_factors = _invert_factors(self.parts)
        image = _expand_image(self.names, inverse_factors)
        if image is None:
            raise TooLarge(_too_large_message(inverse_factors))
        return explicit_map(self.variables, image).rows

    @property
    def equations(self) -> tuple[fmpq_mpoly, ...]:
        """The equations of the expanded map. Raises InputError if the formulas are too long."""
        return self.multiplied_out.equations

    def to_record(self) -> dict[str, Any]:
        if self.is_small:
            return self.multiplied_out.to_record()
        return {
            "composition": [
                {"variables": list(part.map.variables), **part.map.to_record(), "inverse": part.is_inverse}
                for part in self.parts
            ]
        }

    def __str__(self) -> str:
        if self.is_small:
            return str(self.multiplied_out)
        lines = [f"{counted(len(self.parts), 'map')} one after the other, too large to be multiplied out:"]
        for part in self.parts:
            title = "inverse of the " * part.is_inverse + part.map.title
            lines.append(f"the {title} in {', '.join(part.map.variables)}")
            lines += [f"  {line}" for line in str(part.map).split("\n")]
        return "\n".join(lines)

    def __repr__(self) -> str:
        return f"ComposedMap({counted(len(self.parts), 'map')} in {', '.join(self.variables)})"


def composed_map(
    *maps: tuple[MapFamily, int] | MapFamily,
    variables: Sequence[str] | None = None,
    symbols: Sequence[str] | None = None,
    values: Sequence[Mapping[str, RationalFunction]] = (),
) -> ComposedMap:
    """Compose maps: apply one step of each map after the other, all with the same eps.

    Args:
        maps: the maps in the order in which they are applied, or pairs (map, power) with any integer as power.
        variables: names for the coordinates, by default those of the first map; coordinates are matched by position.
        symbols: the symbols of the composition, by default those of all maps; equal names mean the same symbol.
        values: for each map a dict {symbol: rational function of `symbols`}; by default each symbol is its own value.

    Returns:
        The map, exact; its inverse is known if each of `maps` has a known inverse.

    Raises:
        InputError: if the maps have different dimensions or the same variables in another order, and for a negative
            power of a map without inverse.

    >>> from kahanmaps.maps.kahan import KahanFamily
    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> f, g = (KahanFamily(QuadraticSystem.from_text(["x"], [rhs])) for rhs in ("x^2", "x"))
    >>> conjugate = composed_map(g, f, (g, -1)).at("1/2")
    >>> conjugate.step(["1/9"]), g.at("1/2").inverse.step(f.at("1/2").step(g.at("1/2").step(["1/9"])))
    ((1/6,), (1/6,))
    """
    powers = [entry if isinstance(entry, tuple) else (entry, 1) for entry in maps]
    for entry in powers:
        if len(entry) != 2 or not isinstance(entry[0], MapFamily):
            raise InputError(f"found {quoted(str(entry[0]))}, expected maps for every eps: composed_map(f, g, (h, -1))")
        integer(entry[1], "the power")
    if symbols is None:
        symbols = tuple(dict.fromkeys(name for map_, _ in powers for name in map_.symbols))
    context = ring(symbols)
    symbols_as_functions = {
        name: RationalFunction(x, context.constant(1)) for name, x in zip(symbols, context.gens(), strict=True)
    }
    requested_factors: list[MapFactor] = []
    for k, (map_, power) in enumerate(powers):
        functions = symbols_as_functions | dict(values[k]) if values else symbols_as_functions
        missing_symbol = next((name for name in map_.symbols if name not in functions), None)
        if missing_symbol is not None:
            raise InputError(
                f"found a map with the symbol {missing_symbol}: give its value, or make it a symbol of the composition"
            )
        requested_factors += [MapFactor(map_, power < 0, tuple(functions[name] for name in map_.symbols))] * abs(power)
    if not requested_factors:
        raise InputError("found no map to compose, expected at least one")
    factors: list[MapFactor] = []  # adjacent factors that are inverse to each other are cancelled
    for factor in requested_factors:
        if (
            factors
            and factors[-1].is_inverse != factor.is_inverse
            and factors[-1].map_and_values == factor.map_and_values
        ):
            factors.pop()
        else:
            factors.append(factor)
    first_map = requested_factors[0].map
    factors = factors or [*requested_factors[:1], *_invert_factors(requested_factors[:1])]
    if any(factor.map.dim != first_map.dim for factor in factors):
        dimensions_text = ", ".join(str(factor.map.dim) for factor in factors)
        raise InputError(f"the maps must have the same dimension: got {dimensions_text}")
    for factor in factors:
        if set(factor.map.variables) == set(first_map.variables) and factor.map.variables != first_map.variables:
            orders_text = f"{', '.join(first_map.variables)} and {', '.join(factor.map.variables)}"
            raise InputError(f"the maps must have their variables in the same order: got {orders_text}")
        if factor.is_inverse:
            _ = factor.map.at(1, QQ, [QQ.one for _ in factor.values]).inverse  # InputError if the inverse is unknown
    variables = first_map.variables if variables is None else tuple(variables)
    if len(variables) != first_map.dim:
        raise InputError(f"found {len(variables)} variables for maps of dimension {first_map.dim}, expected as many")
    return ComposedMap(tuple(variables), factors, tuple(symbols))


def _invert_factors(parts: Sequence[MapFactor]) -> list[MapFactor]:
    """Return the inverses of the factors in the opposite order."""
    return [MapFactor(part.map, not part.is_inverse, part.values) for part in reversed(parts)]


def is_involution(map_: MapFamily) -> bool:
    """Test Phi(Phi(x)) = x for the map Phi at 3 random points modulo primes; True is wrong with probability < 2^-40."""
    rng, success_count = random.Random(f"involution {derive_seed(0, *map_.seed_data)}"), 0
    for _ in range(_TRIES):
        field = random_prime_field(rng)
        x = tuple(field.random(rng) for _ in map_.variables)
        try:
            map_at_eps = map_.at(field.random(rng), field, [field.random(rng) for _ in map_.symbols])
            if map_at_eps.step(map_at_eps.step(x)) != x:
                return False
        except (BadPrime, SingularStep):
            continue
        success_count += 1
        if success_count == 3:
            return True
    return False


def _expand_image(names: Sequence[str], parts: Sequence[MapFactor]) -> list[RationalFunction] | None:
    """Return the coordinates of the image of x as functions of `names` (variables, symbols, eps), in lowest terms.

    Returns None if the expansion takes more than `_BUDGET` products of terms.
    """
    field = FunctionField(names, _BUDGET, reduces=True)
    n = parts[0].map.dim
    *values, eps = field.variables[n:]
    point: tuple[Any, ...] = tuple(field.variables[:n])
    try:
        for part in parts:
            point = part.at(eps, field, values).step(point)
    except BudgetExceeded:
        return None
    return [RationalFunction(entry.numerator, entry.denominator) for entry in point]


def _too_large_message(parts: Sequence[MapFactor]) -> str:
    return (
        f"found a composition of {counted(len(parts), 'map')} whose formulas are too large to be multiplied out, "
        "expected a shorter one, since the request needs its formulas"
    )
