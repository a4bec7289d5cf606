"""The class of the steps of an analysis (computation and statements in the report), and their shared context."""

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
    """A step of an analysis, an entry of the table `ANALYSES`.

    `run(context, effort=..., progress=...)` returns the result, or None if the step does not apply. The result is
    stored as `result[key]` of the analysis. In JSON it is `key: result.to_json()`, unless `json` returns other entries.
    `statements` yields the lines of the section `title` of the report. This section also needs the results of the steps
    in `requires`.
    """

    name: str
    run: Callable[..., Any]
    title: str = ""
    statements: Callable[[Any], Iterable[Statement]] | None = None
    applies_to: MapKinds = MapKinds.VECTOR_FIELDS
    weight: float = 0.1  # the share of the budget, relative to the weights of other steps
    key: str = ""  # the key of the result; default: the name of the step
    requires: tuple[str, ...] = ()
    # Above this dimension the step is slow: it runs last, with a quarter of its weight, so no step may use its result.
    slow_above: float = inf
    # A second process may run the step: it uses only results of independent steps, and its result can be pickled.
    is_independent: bool = False
    json: Callable[[Any], dict[str, Any]] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "key", self.key or self.name)

    def to_json(self, result: AnalysisResult) -> dict[str, Any]:
        """Return the entries of the JSON output that this step contributes."""
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
        # No step may use the claims of a file about its system, so they are removed; symbols need the file itself.
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
        """The integrals for which a formula is known."""
        return () if self.result.integrals is None else self.result.integrals.integrals

    def applies(self, step: AnalysisStep) -> bool:
        """Return whether the step applies to the kind of the map and to the field of its coefficients."""
        if self.root is not None:
            return MapKinds.OVER_NUMBER_FIELDS in step.applies_to
        kind = MapKinds.OTHER_MAPS if self.system is None else MapKinds.VECTOR_FIELDS
        return kind in step.applies_to

    def weight(self, step: AnalysisStep) -> float:
        """Return the weight of the step, which is reduced in dimensions in which the step is slow."""
        return step.weight / 4 if self.dim > step.slow_above else step.weight

    def run(self, step: AnalysisStep, budget: Budget) -> Any:
        """Run the step within a budget of counted work, and return its result."""
        return step.run(self, effort=budget, progress=lambda text: self.progress(f"{step.name}: {text}"))
