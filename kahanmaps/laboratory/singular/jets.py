"""Curves in projective space with their tangent directions, carried by the Kahan map over GF(p)((t)).

A jet is a power series in t, known up to a power of t, with one slope a tangent direction: an element of GF(p)[[t]][d1,
..., dm]/(d_i d_j). Coordinates are homogeneous, so that nothing is ever divided but a common power of t.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from flint import nmod, nmod_mat, nmod_poly

from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.maps.equation import Equation


class PrecisionTooLow(ArithmeticError):
    """The series are not known far enough in t: start again with more terms."""


class NotGeneric(ArithmeticError):
    """The point lies in a special position on its hypersurface: take another."""


class Jet:
    """A power series modulo t^precision and its slopes; sums and products keep the lower precision."""

    __slots__ = ("precision", "slopes", "value")

    def __init__(self, value: nmod_poly, slopes: Sequence[nmod_poly], precision: int) -> None:
        self.value, self.slopes, self.precision = value, slopes, precision

    def __add__(self, other: Jet) -> Jet:
        slopes = [a + b for a, b in zip(self.slopes, other.slopes, strict=True)]
        return Jet(self.value + other.value, slopes, min(self.precision, other.precision))

    def __neg__(self) -> Jet:
        return Jet(-self.value, [-slope for slope in self.slopes], self.precision)

    def __sub__(self, other: Jet) -> Jet:
        return self + (-other)

    def __mul__(self, other: Jet | nmod) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value * other, [slope * other for slope in self.slopes], self.precision)
        n = min(self.precision, other.precision)
        a, b = self.value, other.value
        slopes = [a.mul_low(q, n) + b.mul_low(p, n) for p, q in zip(self.slopes, other.slopes, strict=True)]
        return Jet(a.mul_low(b, n), slopes, n)

    def over_power(self, power: int) -> Jet:
        """The jet divided by t^power. Raises NotGeneric where a slope is not divisible."""
        if any(int(slope[k]) for slope in self.slopes for k in range(power)):
            raise NotGeneric("the valuation differs at neighbouring points")
        slopes = [slope.right_shift(power) for slope in self.slopes]
        return Jet(self.value.right_shift(power), slopes, self.precision - power)


def valuation(series: nmod_poly, precision: int) -> int | None:
    """The exponent of the first term that is not zero below t^precision, None if there is none.

    >>> valuation(nmod_poly([0, 0, 3], 7), 5)
    2
    """
    return next((k for k in range(min(len(series), precision)) if int(series[k])), None)


@dataclass(frozen=True)
class Step:
    """What is found after one step: valuations in t (None: not below the precision), and the rank of the differential.

    `common` is the power of t divided out of all coordinates, `pole` the valuation of Z at the image when the least of
    all coordinates is 0 (the order of the pole), `denominator` that of det(I - eps f') at the point before the step,
    `rank` the rank of the differential of the map from the hypersurface to the limits of its points, `limit` such a
    point after the step.
    """

    common: int
    pole: int | None
    denominator: int | None
    rank: int
    limit: tuple[int, ...] = field(repr=False)


def walk(
    equations: Sequence[Equation],
    point: Sequence[int],
    direction: Sequence[int],
    tangents: Sequence[Sequence[int]],
    precision: int,
) -> Iterator[Step]:
    """The steps of the curve point + t direction and of its neighbours point + d_i tangent_i + t direction; exact.

    The equations of the factors of the map are over GF(p), points and vectors are residues (X : Z). Step after step
    without an end; raises PrecisionTooLow and NotGeneric. Of several factors `common` and `denominator` are sums.
    """
    prime = equations[0].over.characteristic
    X = [
        Jet(
            nmod_poly([x, v], prime).truncate(precision),
            [nmod_poly([tangent[k]], prime) for tangent in tangents],
            precision,
        )
        for k, (x, v) in enumerate(zip(point, direction, strict=True))
    ]
    zero = nmod_poly([], prime)
    while True:
        divided, denominators = 0, list[int | None]()
        for equation in equations:
            nothing = Jet(zero, [zero] * len(tangents), X[0].precision)
            minors = kernel_minors(equation.rows(equation.monomials(X), None))
            image = [nothing if jet is None else jet for jet in minors]
            known = min(jet.precision for jet in image)
            sizes = [valuation(jet.value, known) for jet in image]
            seen = [size for size in sizes if size is not None]
            if not seen or min(seen) + 1 > known - 1:
                raise PrecisionTooLow
            common = min(seen)
            X = [jet.over_power(common) for jet in image]
            divided += common
            denominators.append(sizes[-1])
        pole = None if sizes[-1] is None else sizes[-1] - common
        orders = [order for order in denominators if order is not None]
        denominator = sum(orders) if len(orders) == len(denominators) else None
        yield Step(divided, pole, denominator, _rank(X, prime), tuple(int(jet.value[0]) for jet in X))


def image_of(equations: Sequence[Equation], point: Sequence[int]) -> list[int] | None:
    """The image of a point of projective space modulo p; None where all minors vanish: there only curves have one."""
    prime, X = equations[0].over.characteristic, list(point)
    for equation in equations:
        rows = equation.rows(equation.monomials([nmod(x, prime) for x in X]), nmod(0, prime))
        kernel, nullity = nmod_mat(rows, prime).nullspace()
        if nullity != 1:
            return None
        X = [int(kernel[k, 0]) for k in range(len(X))]
    return X


def _rank(X: Sequence[Jet], prime: int) -> int:
    """The rank at t = 0 in projective space: the limit itself counts for nothing."""
    rows: list[list[Any]] = [[jet.value[0] for jet in X]]
    rows += [[jet.slopes[i][0] for jet in X] for i in range(len(X[0].slopes))]
    return int(nmod_mat(len(rows), len(X), [int(entry) for row in rows for entry in row], prime).rank()) - 1
