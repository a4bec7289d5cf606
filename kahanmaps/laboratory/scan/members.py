"""Members of a family on a component of parameter space, and a measurement of the degrees of their iterates."""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from flint import fmpq, fmpq_mpoly, fmpq_poly, nmod_poly

from kahanmaps.algebra.fields import GF, QQ, Field
from kahanmaps.algebra.residues import random_prime
from kahanmaps.algebra.work import Budget, count_work
from kahanmaps.documents.files import SystemFile
from kahanmaps.documents.symbols import member_of
from kahanmaps.errors import BadPrime
from kahanmaps.laboratory.growth.curves import Line, Stopped
from kahanmaps.laboratory.scan.sweep import Degrees
from kahanmaps.maps.implicit import MapFamily

_TRIES = 200  # maximal number of random values of the free variables for which the equations are solved
_PRIMES = 40  # maximal number of random primes that are tried for a member
_HEIGHT = 120  # height of random values if the equations are linear in their pivots
_SMALL_HEIGHT = 12  # height of random values if an equation of higher degree must have a rational root


def point_on(equations: Sequence[fmpq_mpoly], count: int, field: Field, rng: random.Random) -> tuple[Any, ...] | None:
    """Return random values of `count` variables that solve equations, over Q or GF(p); None if no solution occurs.

    `equations` define an affine subspace (reduced: the first variable of an equation occurs in no other equation), a
    hypersurface, or a point over a number field (each equation has one variable more than the previous one). Raises
    BadPrime if the prime divides a denominator.

    >>> from kahanmaps.algebra.polynomials import ring
    >>> a, b = ring(["a", "b"]).gens()
    >>> x, y = point_on([a**2 + b**2 - 1], 2, QQ, random.Random(1))
    >>> x**2 + y**2
    1
    """
    pivots: list[int] = []
    for equation in equations:
        # An equation is solved for its pivot, the variable of least positive degree that is no earlier pivot.
        degrees = [int(d) for d in equation.degrees()]
        pivots.append(min((k for k, d in enumerate(degrees) if d and k not in pivots), key=lambda k: degrees[k]))
    is_linear = all(int(equation.degrees()[k]) == 1 for equation, k in zip(equations, pivots, strict=True))
    height = _HEIGHT if is_linear else _SMALL_HEIGHT
    for _ in range(_TRIES if len(equations) < count else 1):
        count_work(10 + 20 * sum(map(len, equations)))
        points = list(solutions(equations, pivots, [field.random(rng, height) for _ in range(count)], field))
        if points:
            return rng.choice(points)
    return None


def solutions(
    equations: Sequence[fmpq_mpoly], pivots: Sequence[int], values: Sequence[Any], field: Field
) -> Iterator[tuple[Any, ...]]:
    """Yield all solutions over a field; the variables that are not pivots have the given `values`.

    Each equation is solved for its pivot, and must not contain the pivots of later equations.
    """
    if not equations:
        yield tuple(values)
        return
    pivot = pivots[0]
    coefficients = [field.zero] * (1 + int(equations[0].degrees()[pivot]))
    for monomial, coefficient in equations[0].terms():
        term = field.convert(coefficient)
        for k, exponent in enumerate(monomial):
            if k != pivot:
                term = term * values[k] ** int(exponent)
        coefficients[int(monomial[pivot])] += term
    polynomial: Any = (
        fmpq_poly(coefficients) if field is QQ else nmod_poly([*map(int, coefficients)], field.characteristic)
    )
    for root, _ in [] if polynomial.is_zero() else polynomial.roots():
        x = root if field is QQ else field.convert(int(root))
        yield from solutions(equations[1:], pivots[1:], [*values[:pivot], x, *values[pivot + 1 :]], field)


@dataclass(frozen=True)
class ScannedFamily:
    """A scanned family: a file, and its map with the parameters `names` as symbols; the last name may be eps.

    `eps` is half the time step: an exact number, or None for generic eps.
    """

    file: SystemFile
    names: tuple[str, ...]
    map: MapFamily
    eps: fmpq | None
    seed: int

    def member(self, values: Mapping[str, fmpq]) -> tuple[SystemFile, fmpq | None]:
        """Return the system and the eps of the member with these values of the parameters."""
        parameters = {name: value for name, value in values.items() if name != "eps"}
        return member_of(self.file, parameters), values.get("eps", self.eps)

    def degrees_on(
        self, equations: Sequence[fmpq_mpoly], expected: Sequence[int], rng: random.Random, max_degree: int = 1 << 20
    ) -> Degrees | None:
        """Measure the degrees of iterates of a random member on a component, modulo a random prime, on a random line.

        Returns None if no point on the component was obtained modulo random primes of 61 bits. A degree is -1 if the
        iterate is nowhere defined. The sequence is as long as `expected` (guesses of the degrees, which only affect
        speed), or ends before a degree above `max_degree`.
        """
        for _ in range(_PRIMES):  # a point over a number field has residues only modulo some primes
            field = GF(random_prime(rng))
            try:
                values = point_on(equations, len(self.names), field, rng)
                if values is None:
                    continue
                *parameters, eps = values if len(self.names) > len(self.map.symbols) else (*values, self.eps)
                member = self.map.at(field.random(rng) if eps is None else field.convert(eps), field, parameters)
            except BadPrime:
                continue
            break
        else:
            return None
        line = Line(member, rng, Budget(), max_degree)
        degrees: list[int] = []
        try:
            for degree in expected:
                line.step(max(1, degree))
                degrees.append(line.degree)
        except Stopped:
            pass
        except ZeroDivisionError:
            degrees += [-1] * (len(expected) - len(degrees))
        return tuple(degrees)
