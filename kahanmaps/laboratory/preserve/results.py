"""What the results of all searches for invariants have in common: the request, and the note on periodic orbits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from flint import fmpq

from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.display_protocols import LatexDisplay, PrintableResult, ResultPart
from kahanmaps.documents.files import SystemFile
from kahanmaps.laboratory.modular_points import ModularMap, NoPoint
from kahanmaps.maps.convention import eps_suffix
from kahanmaps.maps.implicit import MapFamily

_CLOSES_WITHIN = 64  # points of an orbit; a search for relations of a low degree uses about as many


class FoundFunction(LatexDisplay, ResultPart):
    """Base class of a function I that a search finds: `function` is its formula; I(x, eps) evaluates the formula."""

    function: RationalFunction

    def __call__(self, *point: Any, **named: Any) -> Any:
        """Return the value at a point and eps: exact, or rounded if a coordinate is a float; None at a pole."""
        return self.function(*point, **named)


@dataclass(frozen=True)
class Search(PrintableResult):
    """The request of a search: the system file, the symbols that formulas contain, and eps (None: a symbol as well).

    With `flow` the search is for invariants of the flow, not of the map. Random points are taken modulo the `primes`.
    """

    file: SystemFile
    symbols: tuple[str, ...]
    eps: fmpq | None
    seed: int
    primes: tuple[int, ...]
    flow: bool = field(default=False, kw_only=True)

    def latex(self) -> str:
        """Return the formulas as LaTeX, one on each line."""
        return "\n".join(part.latex() for part in self)

    def to_sympy(self) -> list[Any]:
        """Return the formulas as expressions of SymPy."""
        return [part.to_sympy() for part in self]

    @property
    def of_flow(self) -> dict[str, Any]:
        """The first entry of the JSON record if the search is for the flow; empty for a map."""
        return {"flow": True} if self.flow else {}

    @property
    def toml_comments(self) -> list[str]:
        """The comment, for a system file, that formulas hold at one eps only; empty if the formulas contain eps."""
        if self.eps is None:
            return []
        time_step_text = eps_suffix(self.eps, self.file.map).removeprefix(f", eps = {self.eps}")
        return [f"# for eps = {self.eps} only{time_step_text}: check with --eps {self.eps}"]


def common_orbit_period(maps: Sequence[ModularMap]) -> int | None:
    """Return the period of a random orbit of each map; None if periods differ or an orbit has 64 or more points."""
    try:
        [*other_periods, period] = {len(map_.orbit(_CLOSES_WITHIN)) for map_ in maps}
    except NoPoint:
        return None
    return None if other_periods or period == _CLOSES_WITHIN else period


def closing_note(period: int | None, eps: fmpq | None, map_: MapFamily) -> str:
    """Return a sentence on orbits that close after `period` steps at this eps (None: every eps); "" without a period.

    >>> from kahanmaps.documents.catalog import load
    >>> closing_note(4, fmpq(1), load("weierstrass").map)
    'orbits close after 4 steps: at eps = 1 the map is periodic (measured); nothing follows for other eps'
    """
    if period is None:
        return ""
    closing_text = f"orbits close after {period} step{'s' * (period != 1)}"
    if not map_.has_eps:
        return f"{closing_text}: the map is periodic (measured)"
    if eps is None:
        return f"{closing_text} at every eps that was tried: the map is periodic (measured)"
    return f"{closing_text}: at eps = {eps} the map is periodic (measured); nothing follows for other eps"
