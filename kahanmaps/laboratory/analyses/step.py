"""A step of an analysis, with its computation and its statements in the report, and the context in which it runs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Flag, auto
from math import inf
from typing import Any

from kahanmaps.algebra.printing import plain
from kahanmaps.algebra.work import Budget
from kahanmaps.documents.files import SystemFile
from kahanmaps.laboratory.analysis_result import AnalysisResult, Statement
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.preserve.integrals import FoundIntegral
from kahanmaps.systems.quadratic import QuadraticSystem


class MapKinds(Flag):
    """The kinds of maps to which a step applies."""

    VECTOR_FIELDS = auto()  # Kahan maps of vector fields over Q
    OTHER_MAPS = auto()  # other birational maps over Q
    OVER_NUMBER_FIELDS = auto()  # Kahan maps and other birational maps over number fields
    OVER_Q = VECTOR_FIELDS | OTHER_MAPS
    ALL = OVER_Q | OVER_NUMBER_FIELDS


@dataclass(frozen=True)
class AnalysisStep:
    """One analysis, a row of `table.py`.

    `run(context, effort=..., progress=...)` returns the result, or None if the step does not apply. The result is
    stored as `result[key]`. In JSON the key has the value of the `to_json` of the result, unless `json` gives other
    entries. `statements` yields the lines of the section `title`; this section is complete after the step and the steps
    in `requires`.
    """

    name: str
    run: Callable[..., Any]
    title: str = ""
    statements: Callable[[Any], Iterable[Statement]] | None = None
    applies_to: MapKinds = MapKinds.VECTOR_FIELDS
    weight: float = 0.1  # the share of the step in the budget, relative to the weights of the other steps
    key: str = ""  # the key of the result; by default the name of the step
    requires: tuple[str, ...] = ()
    # Above this dimension the step is slow: it runs last, with a quarter of its weight; no other step uses its result.
    slow_above: float = inf
    # A second process may run the step: it uses only results of independent steps, and its own result can be pickled.
    is_independent: bool = False
    json: Callable[[Any], dict[str, Any]] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "key", self.key or self.name)

    def to_json(self, result: AnalysisResult) -> dict[str, Any]:
        """Return the entries of the step in JSON."""
        return {self.key: plain(result[self.key])} if self.json is None else self.json(result)


class AnalysisContext:
    """The map under analysis, the results so far, and the options that all steps share."""

    def __init__(
        self, result: AnalysisResult, laboratory: Laboratory, symbols: Sequence[str], progress: Callable[[str], None]
    ) -> None:
        file = result.file
        self.result, self.seed = result, result.seed
        self.map, self.dim, self.root = file.map, file.dim, laboratory.root
        self.system = file.system if file.is_quadratic else None
        # No step may read the claims of a file about its system. If there are symbols, the file itself is needed.
        self.file_without_claims = (
            file if symbols or self.system is None else SystemFile.from_system(self.system, file.name)
        )
        self.settings: dict[str, Any] = {"symbols": symbols, "eps": result.eps, "seed": result.seed}
        self.has_symbols, self.progress = bool(laboratory.symbols), progress

    @property
    def field(self) -> QuadraticSystem:
        """The vector field; it exists for steps that apply only to `MapKinds.VECTOR_FIELDS`."""
        assert self.system is not None
        return self.system

    @property
    def integrals(self) -> tuple[FoundIntegral, ...]:
        """The integrals with a formula."""
        return () if self.result.integrals is None else self.result.integrals.integrals

    def applies(self, step: AnalysisStep) -> bool:
        """Return whether the step applies to this kind of map over this number field."""
        if self.root is not None:
            return MapKinds.OVER_NUMBER_FIELDS in step.applies_to
        kind = MapKinds.OTHER_MAPS if self.system is None else MapKinds.VECTOR_FIELDS
        return kind in step.applies_to

    def weight(self, step: AnalysisStep) -> float:
        """Return the weight of the step in the dimension of the map."""
        return step.weight / 4 if self.dim > step.slow_above else step.weight

    def run(self, step: AnalysisStep, budget: Budget) -> Any:
        """Return the result of the step, within a budget."""
        return step.run(self, effort=budget, progress=lambda text: self.progress(f"{step.name}: {text}"))
