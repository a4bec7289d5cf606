"""The orders along a contracted hypersurface, step after step: all that the degrees of the iterates need of it.

A curve through a generic point of the hypersurface is a power series in t. After each step a power of t is divided out:
its exponent mu says how deep the image lies where the map has no value. The orders nu of the critical hypersurfaces at
the image say how deep it lies on those.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

from flint import fmpz_poly

from kahanmaps.laboratory.singular.jets import Function, Step

_SHOWN = 6  # events in words
Fraction = tuple[fmpz_poly, fmpz_poly]  # numerator and denominator


@dataclass(frozen=True)
class Orders:
    """The rows (mu, nu_1, nu_2, ...) of the steps 1, 2, ..., and how they go on.

    `is_settled`: they are known for all steps. By the recurrences whose characteristic polynomials are given for the
    columns; or after (T, j) as in `returns` the hypersurface is the j-th one, and goes on like that; else all later
    rows are zero, as far as was looked, which is `followed` steps, but for the orders of the hypersurfaces in `beyond`,
    on which its points come to lie again and again: these are not known.
    """

    rows: tuple[tuple[int, ...], ...]
    recurrences: tuple[fmpz_poly, ...] = ()
    followed: int = 0
    is_settled: bool = False
    returns: tuple[int, int] | None = None
    beyond: tuple[int, ...] = ()

    @property
    def known(self) -> tuple[object, ...]:
        """What two points on one hypersurface have to agree on."""
        return self.rows[: 2 * self.settled_at], self.is_settled, self.returns, self.beyond

    @cached_property
    def settled_at(self) -> int:
        """The step after which rows follow from those before."""
        if self.recurrences:
            return max(int(characteristic.degree()) for characteristic in self.recurrences)
        return len(self.rows)

    @property
    def sentences(self) -> list[str]:
        """In words: at which steps powers are divided out, which lowers degrees, and which hypersurfaces are met."""
        rows = self.rows[: self.settled_at]
        costs = [f"{row[0]} at step {t}" for t, row in enumerate(rows, 1) if row[0]]
        meets = [
            f"C{j} at step {t}" + (f" (order {nu})" if nu > 1 else "")
            for t, row in enumerate(rows, 1)
            for j, nu in enumerate(row[1:], 1)
            if nu
        ]
        if self.beyond:
            meets.append(f"then {', '.join(f'C{k + 1}' for k in self.beyond)} for ever, which lowers no degree")
        return [f"{verb} {_first(events) or 'nothing'}" for verb, events in (("costs", costs), ("meets", meets))]

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "divided": [row[0] for row in self.rows],
            "met": [list(row[1:]) for row in self.rows],
            "recurrences": [[str(c) for c in characteristic.coeffs()] for characteristic in self.recurrences],
            "settled": self.is_settled,
            "beyond": [f"C{k + 1}" for k in self.beyond],
            "returns": None if self.returns is None else {"after": self.returns[0], "as": f"C{self.returns[1] + 1}"},
        }

    def of(self, hypersurfaces: Sequence[int]) -> Orders:
        """The same with the columns of these hypersurfaces only."""
        columns = [0, *(1 + k for k in hypersurfaces)]  # of orders without a return
        rows = tuple(tuple(row[k] for k in columns) for row in self.rows)
        return replace(self, rows=rows, recurrences=tuple(self.recurrences[k] for k in columns if self.recurrences))

    def generating_function(self, column: int) -> Fraction:
        """The sum of a column's entries times z, z^2, ..., as a fraction of polynomials in z; up to the return.

        >>> Orders(((1,), (2,), (4,)), (fmpz_poly([-2, 1]),)).generating_function(0)
        (x, (-2)*x + 1)
        """
        entries = [row[column] for row in self.rows]
        if not self.recurrences:
            return fmpz_poly([0, *entries]), fmpz_poly([1])
        characteristic = self.recurrences[column]
        order = int(characteristic.degree())
        below = fmpz_poly(characteristic.coeffs()[::-1])
        above = (below * fmpz_poly(entries[:order])).truncate(order)
        return fmpz_poly([0, 1]) * above, below


NO_ORDERS = Orders(())


def _first(events: list[str]) -> str:
    return ", ".join(events[:_SHOWN]) + (", ..." if len(events) > _SHOWN else "")


class AlongCurves(Protocol):
    """Functions whose orders are looked at along a curve, and what these make of its steps: the rows of `Orders`."""

    @property
    def functions(self) -> tuple[Function, ...]:
        """What `images_of_curve` takes."""

    def rows(self, run: Sequence[Step]) -> tuple[tuple[int, ...], ...]:
        """For each of the steps, or the first of them, what is divided out and the orders of hypersurfaces."""


@dataclass(frozen=True)
class Tracked:
    """The functions whose orders are looked at along curves through a hypersurface.

    `excess` are their exponents in the common factor of the minors of the equation, which is no part of the map;
    `first` are their orders on the hypersurface itself: 1 for its own, 0 for others. The first `critical` of them are
    those of contracted hypersurfaces.
    """

    functions: tuple[Function, ...] = ()
    excess: tuple[int, ...] = ()
    first: tuple[int, ...] = ()
    critical: int = 0

    def rows(self, run: Sequence[Step]) -> tuple[tuple[int, ...], ...]:
        """The rows of `Orders` for steps along a curve. Where nothing is tracked det M(x) stands for it."""
        if not self.functions:
            return tuple((step.common, step.denominator or 0) for step in run)
        found, before = [], self.first
        for step in run:
            divided = step.common - sum(k * order for k, order in zip(self.excess, before, strict=True))
            found.append((divided, *step.orders[: self.critical]))
            before = step.orders
        return tuple(found)


NOTHING = Tracked()
