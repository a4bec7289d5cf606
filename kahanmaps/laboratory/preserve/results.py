"""What the searches for preserved things have in common: what they were asked, and the words for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from flint import fmpq

from kahanmaps.display_protocols import PrintableResult
from kahanmaps.documents.files import SystemFile
from kahanmaps.laboratory.modular_points import ModularMap, NoPoint
from kahanmaps.maps.convention import eps_told
from kahanmaps.maps.implicit import MapFamily

_CLOSES_WITHIN = 64  # points of an orbit: as many as relations of some degree take


@dataclass(frozen=True)
class Search(PrintableResult):
    """What was asked: the map of a file, the symbols that formulas contain, and eps, None for every eps.

    With `flow` it is the differential equation that was asked for. Random points were taken modulo the `primes`.
    """

    file: SystemFile
    symbols: tuple[str, ...]
    eps: fmpq | None
    seed: int
    primes: tuple[int, ...]
    flow: bool = field(default=False, kw_only=True)

    @property
    def of_flow(self) -> dict[str, Any]:
        """What plain data begin with: that it is the flow, or nothing."""
        return {"flow": True} if self.flow else {}

    @property
    def toml_comments(self) -> list[str]:
        """The line of a system file that says that formulas hold at one eps only; none where eps is in them."""
        if self.eps is None:
            return []
        step = eps_told(self.eps, self.file.map).removeprefix(f", eps = {self.eps}")
        return [f"# for eps = {self.eps} only{step}: check with --eps {self.eps}"]


def closing_period(maps: Sequence[ModularMap]) -> int | None:
    """The number of points of orbits that close soon, on all maps; None where they do not."""
    try:
        [*others, period] = {len(map_.orbit(_CLOSES_WITHIN)) for map_ in maps}
    except NoPoint:
        return None
    return None if others or period == _CLOSES_WITHIN else period


def closing_note(period: int | None, eps: fmpq | None, map_: MapFamily) -> str:
    """What orbits that close after `period` steps mean at this eps (None: at every one); empty where they do not.

    >>> from kahanmaps.documents.catalog import load
    >>> closing_note(4, fmpq(1), load("weierstrass").map)
    'orbits close after 4 steps: at eps = 1 the map is periodic (measured); nothing follows for other eps'
    """
    if period is None:
        return ""
    closes = f"orbits close after {period} step{'s' * (period != 1)}"
    if not map_.has_eps:
        return f"{closes}: the map is periodic (measured)"
    if eps is None:
        return f"{closes} at every eps that was tried: the map is periodic (measured)"
    return f"{closes}: at eps = {eps} the map is periodic (measured); nothing follows for other eps"
