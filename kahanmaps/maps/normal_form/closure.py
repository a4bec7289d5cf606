"""Whether an orbit is dense in the real components of the level set that it visits.

The orbit is dense if and only if no integers n_0 and n_i, not all n_i = 0, satisfy sum n_i rho_i = n_0 (Kronecker),
where rho_i are the coordinates of the translation on the circles of which the components are products. On one circle it
is enough that the translation has infinite order. For several circles no theorem is known that excludes all relations;
balls exclude those with small coefficients. docs/mathematics.md, "Geometry of the level sets".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isqrt
from typing import Any

from flint import arb, fmpq, fmpq_poly, fmpz, fmpz_mat

from kahanmaps.algebra.fields import RR

_SCALE = 10**15  # the inverse of the accuracy of rotation numbers
_SUPPORT = 10  # relations up to this size have to be excluded, or nothing is said


@dataclass(frozen=True)
class Closure:
    """Whether an orbit is dense in the components that it visits: True and False are proved, None is not decided.

    `bound` is the size of coefficients up to which relations of the rotation numbers are excluded (proved), if this is
    all that is known.
    """

    is_dense: bool | None
    reason: str
    bound: int | None = None

    @property
    def status(self) -> str:
        """Return "proved", "supported" (dense, if there are no relations with large coefficients) or "undecided"."""
        return "proved" if self.is_dense is not None else "undecided" if self.bound is None else "supported"

    @property
    def text(self) -> str:
        """A line of text."""
        verb = "not dense" if self.is_dense is False else "dense"
        return f"{verb} in the real components that it visits ({self.status}: {self.reason})"

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        return {"dense": self.is_dense, "status": self.status, "reason": self.reason, "bound": self.bound}


def closure(gammas: Sequence[Any], orders: Sequence[int | None], numbers: Sequence[arb]) -> Closure:
    """Return whether an orbit on a product of smooth levels is dense in the components that it visits.

    Args:
        gammas, orders: gamma and the order of the translation (None: infinite) in each plane over Q in which the orbit
            moves.
        numbers: the rotation numbers at real roots of chi, and both coordinates at each pair of complex roots.
    """
    if any(order is not None for order in orders):
        return Closure(False, "a translation has finite order")
    values = fmpq_poly([1])
    for gamma in gammas:
        own = fmpq_poly([-gamma, 1]) if isinstance(gamma, fmpq) else fmpq_poly(gamma.matrix.charpoly())
        values *= own
    if values.gcd(values.derivative()).degree() > 0:
        return Closure(False, "gamma has the same value at two roots of chi, so the rotation numbers are dependent")
    if len(numbers) == 1:
        return Closure(True, "the translation of a circle has infinite order")
    bound = excluded_relations(numbers)
    if bound < _SUPPORT:
        return Closure(None, "the rotation numbers may be dependent")
    return Closure(None, f"no integer relation of the rotation numbers has coefficients up to {bound}", bound)


def excluded_relations(numbers: Sequence[arb]) -> int:
    """Return some N such that no integers n_i, not all 0 and at most N in size, have an integer sum n_i rho_i.

    The numbers are balls of radius at most 1e-15.

    With C = 10^15 the vectors (n_1, ..., n_d, sum n_i [C rho_i] - C n_0) form a lattice, and a relation is a short one
    of them. No vector is shorter than the shortest one of an orthogonalized basis; LLL only makes this bound large.

    >>> excluded_relations([arb(2).sqrt()]) > 10**6, excluded_relations([arb(1) / 3]) < 3
    (True, True)
    """
    d, rows = len(numbers), list[list[int | fmpz]]()
    for k, x in enumerate(numbers):
        with RR(128).working():
            integer = (_SCALE * x).mid().floor().unique_fmpz()
        assert integer is not None  # a midpoint is an exact number
        rows.append([int(i == k) for i in range(d)] + [integer])
    reduced = fmpz_mat([*rows, [0] * d + [_SCALE]]).lll().tolist()
    orthogonal: list[list[fmpq]] = []
    lengths: list[fmpq] = []
    for row in reduced:
        vector = [fmpq(x) for x in row]
        for other, length in zip(orthogonal, lengths, strict=True):
            factor = sum((x * y for x, y in zip(row, other, strict=True)), fmpq(0)) / length
            vector = [x - factor * y for x, y in zip(vector, other, strict=True)]
        orthogonal.append(vector)
        lengths.append(sum((x * x for x in vector), fmpq(0)))
    # [C rho] has at most the error 3, so the last entry of a relation is at most 3 d N.
    least = min(lengths)
    return isqrt(int((least.p - 1) // (least.q * d * (1 + 9 * d))))
