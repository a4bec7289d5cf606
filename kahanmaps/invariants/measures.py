"""Invariant measures dx/phi of Kahan maps: phi(x~) = phi(x) det dPhi(x).

For Hamiltonian f with constant J the density is phi = det(I - eps f'(x)). Source: cmoq-2013; petrera-suris-2016, eq.
(eq: CMOQ measure).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from operator import mul
from typing import Any

from flint import fmpq

from kahanmaps.algebra.fields import Field
from kahanmaps.algebra.matrices import det
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.algebra.printing import format_rational_function
from kahanmaps.algebra.roots import Root
from kahanmaps.errors import InputError, quoted
from kahanmaps.invariants.phase_functions import ClaimedFunction, PhaseFunction, at_eps, where
from kahanmaps.maps.implicit import MapOver
from kahanmaps.maps.kahan import Kahan
from kahanmaps.systems.quadratic import QuadraticSystem


class DeterminantDensity(PhaseFunction):
    """phi = det(I - eps f'(x))."""

    name = "phi"
    formula = "phi = det(I - eps f'(x))"
    # No condition: it is 1 at eps = 0, and where it is 0 at an eps, the map has no value and nothing is claimed.

    def __init__(self, system: QuadraticSystem) -> None:
        self.map = Kahan(system)

    @property
    def subject(self) -> tuple[Any, ...]:
        return (self.formula, self.map.system.rhs)

    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        return self.map.at(eps, field).determinant(point)


class ClaimedDensity(ClaimedFunction):
    """A rational function of the variables and eps that somebody claims is a density at `eps`, or (None) at every eps.

    `condition` says for which eps that means something, as `density_condition`. Raises InputError as it does.
    """

    def __init__(self, function: RationalFunction, eps: fmpq | None = None, root: Root | None = None) -> None:
        super().__init__("phi", function, root)
        self.condition = density_condition(function, len(function.names) - 1 - (root is not None), eps, root)
        self.formula = f"phi = {self.formula}"


def density_condition(phi: RationalFunction, dim: int, eps: fmpq | None, root: Root | None = None) -> str:
    """The hypothesis that phi is a function other than 0, of which every law for dx/phi holds for no reason.

    Args:
        phi: a function of `dim` variables, then of symbols and eps.
        dim: the dimension.
        eps: an exact number, or None for every eps.
        root: what the only symbol stands for, where it is algebraic.

    Returns:
        For which symbols and eps neither phi nor its denominator is identically 0, in words; empty where it is so
        for all of them.

    Raises:
        InputError: where phi is identically 0 or 0/0, for that eps and root if they are given.

    >>> from kahanmaps.algebra.parsing import parse_rational_function
    >>> for text in ("a*x + b*y", "(10*eps - 1)*x", "x/(a*y)", "a*x + y"):
    ...     phi = parse_rational_function(text, ["x", "y", "a", "b", "eps"])
    ...     print([density_condition(phi, 2, None)])
    ['where a, b are not all 0']
    ['where 10*eps - 1 is not 0']
    ['where a is not 0']
    ['']
    """
    above, below = at_eps(phi, eps, root, dim)
    if above.is_zero():
        text = format_rational_function(phi)
        what = "0/0" if below.is_zero() else "identically 0"
        at = " and ".join([f"eps = {eps}"] * (eps is not None) + [f"a {root}"] * (root is not None))
        which = f", which is {what} at {at}" if text != "0" else ""
        raise InputError(
            f"found the density {quoted(text) if which else text}{which}, expected a function that is not zero: "
            "the measure is dx/phi"
        )
    return where(dim, above) if below.is_zero() else where(dim, above, below)


def jacobian_determinant_sides(kahan: MapOver, x: Sequence[Any], image: Sequence[Any]) -> tuple[Any, Any]:
    """Numerator and denominator of det dPhi(x): for Kahan maps det(I + eps f'(x~)) and det(I - eps f'(x)).

    Of a map with several factors the products of theirs.
    """
    factors, points = zip(*kahan.stages(x), strict=True)
    above = [
        det(one.numerator_matrix(here, there))
        for one, here, there in zip(factors, points, (*points[1:], image), strict=True)
    ]
    below = [one.determinant(here) for one, here in zip(factors, points, strict=True)]
    with kahan.field.working():
        return reduce(mul, above), reduce(mul, below)
