"""One analysis as a part of the report: what it looks for and what is said of it; and what it is given to work with."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Flag, auto
from math import inf
from typing import Any

from kahanmaps.algebra.printing import plain
from kahanmaps.algebra.work import Budget
from kahanmaps.documents.files import SystemFile
from kahanmaps.laboratory.findings import Findings, Statement
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.preserve.integrals import FoundIntegral
from kahanmaps.systems.quadratic import QuadraticSystem


class Of(Flag):
    """What a part can be done of."""

    FIELDS = auto()  # vector fields over Q
    MAPS = auto()  # others over Q
    NUMBER_FIELDS = auto()  # both over number fields
    MAPS_OVER_Q = FIELDS | MAPS
    EVERY = MAPS_OVER_Q | NUMBER_FIELDS


@dataclass(frozen=True)
class Part:
    """One analysis, a row of `table.py`.

    `look(run, effort=..., progress=...)` returns what was found, or None where it does not apply. It becomes
    `found[result]`, and by its `to_json` the value of this key in JSON, unless `json` says it in another way.
    `statements` are the lines of the section `title`; the section is complete after this part and those in `reads`.
    """

    name: str
    look: Callable[..., Any]
    title: str = ""
    statements: Callable[[Any], Iterable[Statement]] | None = None
    of: Of = Of.FIELDS
    share: float = 0.1  # of the whole budget
    result: str = ""  # the name, unless another is given
    reads: tuple[str, ...] = ()
    # The dimension above which it comes last and gets a quarter of its share: others cannot make use of it then.
    slow_above: float = inf
    # Another process may do it: it reads, and is read by, others of this kind alone, and its result can be pickled.
    is_apart: bool = False
    json: Callable[[Any], dict[str, Any]] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "result", self.result or self.name)

    def to_json(self, found: Findings) -> dict[str, Any]:
        """What it says in JSON."""
        return {self.result: plain(found[self.result])} if self.json is None else self.json(found)


class Run:
    """One map under analysis, and what was found so far."""

    def __init__(
        self, found: Findings, laboratory: Laboratory, symbols: Sequence[str], progress: Callable[[str], None]
    ) -> None:
        file = found.file
        self.found, self.map, self.dim, self.root, self.seed = found, file.map, file.dim, laboratory.root, found.seed
        self.system = file.system if file.is_quadratic else None
        # Without its claims, so that none can be read; with symbols the file itself is needed, and its claims are not
        # read.
        self.bare = file if symbols or self.system is None else SystemFile.from_system(self.system, file.name)
        self.asked: dict[str, Any] = {"symbols": symbols, "eps": found.eps, "seed": found.seed}
        self.has_symbols, self.progress = bool(laboratory.symbols), progress

    @property
    def field(self) -> QuadraticSystem:
        """The vector field; there is one for parts that are `Of.FIELDS` only."""
        assert self.system is not None
        return self.system

    @property
    def integrals(self) -> tuple[FoundIntegral, ...]:
        """The integrals that were found in closed form."""
        return () if self.found.integrals is None else self.found.integrals.integrals

    def applies(self, part: Part) -> bool:
        """Whether the part can be done over the field of numbers, and for a map of this kind."""
        kind = Of.NUMBER_FIELDS if self.root is not None else Of.MAPS if self.system is None else Of.FIELDS
        return kind in part.of

    def weight(self, part: Part) -> float:
        """The weight of a part among the others, by which they share the budget."""
        return part.share / 4 if self.dim > part.slow_above else part.share

    def given(self, part: Part, budget: Budget) -> dict[str, Any]:
        """What a part is called with: its budget, and whom it tells what it does."""
        return {"effort": budget, "progress": lambda text: self.progress(f"{part.name}: {text}")}
