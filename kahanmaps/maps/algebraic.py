"""A map whose coefficients contain an algebraic number: a map with a symbol whose value is a root of a polynomial."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from kahanmaps.algebra.fields import QQ, Field
from kahanmaps.algebra.roots import Root
from kahanmaps.errors import InputError
from kahanmaps.maps.implicit import Map, MapFamily


class AlgebraicMap(MapFamily):
    """The map `family` with `root` as the value of its only symbol (if any); g is the minimal polynomial of `root`.

    By default, `at` returns the map over Q[t]/g. `at_number` returns the map for a rational value of the symbol; it is
    pickled with the map, so it must not be a lambda.

    >>> from kahanmaps.algebra.roots import parse_root
    >>> from kahanmaps.algebra.parsing import parse_polynomial
    >>> from kahanmaps.maps.kahan import KahanFamily
    >>> from kahanmaps.systems.quadratic import QuadraticSystem
    >>> riccati = QuadraticSystem((parse_polynomial("a*x^2", ["x", "a"]),), ("a",))
    >>> map_ = AlgebraicMap(KahanFamily(riccati), parse_root("root of t^2 - 2"), lambda a: KahanFamily(riccati.at([a])))
    >>> map_.at("1/2").step([1])
    (-t - 1,)
    """

    root: Root

    def __init__(self, family: MapFamily, root: Root, at_number: Callable[[Any], MapFamily]) -> None:
        self.family, self.root = family, root
        self.variables, self.title, self.time_steps = family.variables, family.title, family.time_steps
        self.denominator_name = family.denominator_name
        self._at_number = at_number
        self._cached_root: tuple[Field, Any] | None = None

    @property
    def has_eps(self) -> bool:
        return self.family.has_eps

    @property
    def seed_data(self) -> tuple[Any, ...]:
        return (*self.family.seed_data, str(self.root))

    @property
    def digits(self) -> int:
        return self.family.digits

    @property
    def real_approximation(self) -> MapFamily:
        """The map whose symbol has a rational value near the root. Raises InputError if the root is not real."""
        return self._at_number(self.root.real_approximation())

    @property
    def rows(self) -> Any:  # type: ignore[override]  # read only
        raise InputError(self.unsupported_reason)

    def at(self, eps: Any, over: Field = QQ, values: Sequence[Any] = ()) -> Map:
        """Return the map over a field that contains a root of g. Raises BadPrime if there is no reduction modulo p."""
        over = self.root.number_field if over is QQ else over
        if self._cached_root is None or self._cached_root[0] is not over:
            self._cached_root = over, self.root.over(over)
        return self.family.at(eps, over, [*values, self._cached_root[1]] if self.family.symbols else values)

    @property
    def _root_name(self) -> str:
        """The name under which the root is printed: the symbol of the map, or t if the map has no symbol."""
        return self.family.symbols[0] if self.family.symbols else "t"

    def to_record(self) -> dict[str, Any]:
        return {**self.family.to_record(), "algebraic": {self._root_name: str(self.root)}}

    def __str__(self) -> str:
        return f"{self.family}\nwhere {self._root_name} is a {self.root}"

    def __repr__(self) -> str:
        return f"AlgebraicMap({self.family!r}, {self._root_name} = {self.root})"


def _without_number(map_: MapFamily, _: Any) -> MapFamily:
    return map_


def over_number_field(map_: MapFamily, root: Root) -> MapFamily:
    """Return the map over Q[t]/g, where `root` is a root of g. Raises InputError if the map contains another root."""
    if map_.root is None:
        return AlgebraicMap(map_, root, partial(_without_number, map_))
    if map_.root != root:
        raise InputError(
            f"found a {map_.root} in the map and a {root} in the point, expected the same algebraic number"
        )
    return map_
