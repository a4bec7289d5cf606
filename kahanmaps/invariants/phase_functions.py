"""Functions of a point and of eps that a Kahan map may conserve or have for a density."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import reduce
from typing import Any

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.fields import Field
from kahanmaps.algebra.polynomials import RationalFunction, coefficients_in, names_of, primitive_part, substitute
from kahanmaps.algebra.printing import format_polynomial, format_rational_function
from kahanmaps.algebra.roots import Root
from kahanmaps.documents.iterates import iterates_in
from kahanmaps.errors import InputError
from kahanmaps.maps.implicit import BirationalMap, MapOver

_LONGEST_CONDITION = 200  # characters


class PhaseFunction(ABC):
    """A function of x and eps, with a name and a formula for people."""

    name: str
    formula: str
    condition: str = ""  # for which eps it means something, as `where`

    @abstractmethod
    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        """The value at a point over `field`; None at a pole. Raises SingularStep where a map in it has no value."""

    @property
    @abstractmethod
    def subject(self) -> tuple[Any, ...]:
        """All that determines the function, as `seed_for` takes it."""


class ClaimedFunction(PhaseFunction):
    """A rational function of the variables and eps (its last variable) that somebody makes a claim about.

    Where there is a `root`, the variable before eps stands for it. Where it contains x~, the image of x, it is a
    function of x under the map, which is needed then.
    """

    def __init__(
        self, name: str, function: RationalFunction, root: Root | None = None, map_: BirationalMap | None = None
    ) -> None:
        self.name = name
        self.root = root
        self.map = map_
        self.function = function
        self.iterates = iterates_in(*function.names)
        self.formula = format_rational_function(function)
        if self.iterates and map_ is None:
            raise InputError(f"found {name}, a function of x and its iterates, expected one of x alone here")

    @property
    def subject(self) -> tuple[Any, ...]:
        return ("claimed", self.function)

    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        points = [tuple(point)]
        if self.map is not None and self.iterates:
            over = self.map.at(eps, field)
            while len(points) <= self.iterates:
                points.append(over.step(points[-1]))
        return self.on(field, eps, points)

    def on(self, field: Field, eps: Any, points: Sequence[Sequence[Any]]) -> Any:
        """The value on successive points of an orbit, one more than it has iterates; None at a pole."""
        with field.working():
            values = () if self.root is None else (self.root.over(field),)
            coordinates = [entry for point in points[: self.iterates + 1] for entry in point]
            return self.function.value(field, (*coordinates, *values, field.convert(eps)))


def orbit_about(over: MapOver, x: tuple[Any, ...], length: int) -> list[tuple[Any, ...]]:
    """The points of an orbit: length steps, x in the middle or, where the inverse is not known, first.

    Formulas of points on both sides of x have lower degrees than those of as many points ahead of it.
    """
    points, before = [x], 0
    try:
        inverse = over.inverse
        before = length // 2
    except InputError:
        inverse = over
    for _ in range(before):
        points.insert(0, inverse.step(points[0]))
    while len(points) <= length:
        points.append(over.step(points[-1]))
    return points


def at_eps(
    function: RationalFunction, eps: fmpq | None, root: Root | None = None, k: int = 0
) -> tuple[fmpq_mpoly, fmpq_mpoly]:
    """Numerator and denominator, with the number for eps if one is given; the denominator may then be 0.

    With a `root` they are remainders, and their k-th variable stands for it.
    """
    above, below = function.numerator, function.denominator
    if eps is not None:
        above, below = substitute(above, {"eps": eps}), substitute(below, {"eps": eps})
    return (above, below) if root is None else (root.remainder(above, k), root.remainder(below, k))


def where(dim: int, *polynomials: fmpq_mpoly | Sequence[fmpq_mpoly]) -> str:
    """For which symbols and eps none of the polynomials is identically 0, in words; empty where it is so for all.

    Args:
        dim: the dimension; variables of the polynomials beyond so many are symbols, or eps, which is not 0.
        polynomials: none of them 0. The entries of a sequence count as one: they are not to be 0 all together.

    >>> from kahanmaps.algebra.polynomials import ring
    >>> x, y, a, b, eps = ring(["x", "y", "a", "b", "eps"]).gens()
    >>> where(2, a*x + b*y), where(2, (10*eps - 1)*eps*x, a*y), where(2, a*x + eps), where(1, [a*x, b*x])
    ('where a, b are not all 0', 'where 10*eps - 1 is not 0 and a is not 0', '', 'where a, b are not all 0')
    """
    groups = [[one] if isinstance(one, fmpq_mpoly) else one for one in polynomials]
    found = list(dict.fromkeys(filter(None, (_not_all_zero(group, dim) for group in groups))))
    text = f"where {' and '.join(found)}" if found else ""
    return text if len(text) <= _LONGEST_CONDITION else "where it has a value and is not identically 0"


def _not_all_zero(polynomials: Sequence[fmpq_mpoly], dim: int) -> str:
    names = names_of(polynomials[0])
    coefficients = [c for polynomial in polynomials for c in coefficients_in(polynomial, dim)]
    found = coefficients
    if "eps" in names[dim:]:  # the last variable: the highest power of it that divides each is taken out
        least = [min(int(monomial[-1]) for monomial in c.monoms()) for c in coefficients]
        found = [
            c.context().from_dict({(*m[:-1], int(m[-1]) - low): value for m, value in c.terms()})
            for c, low in zip(coefficients, least, strict=True)
        ]
    symbols = {name for c in found for name in names if name not in c.unused_gens()}
    if len(symbols) == 1:
        # In one symbol the common zeros are those of the greatest common divisor.
        found = [reduce(lambda common, c: common.gcd(c), found)]
    if any(c.is_constant() for c in found):
        return ""
    texts = list(dict.fromkeys(format_polynomial(primitive_part(c)[1]) for c in found))
    return f"{', '.join(texts)} {'is not' if len(texts) == 1 else 'are not all'} 0"
