"""The results of the steps of an analysis, of which some may not have run yet."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from flint import fmpq

from kahanmaps.algebra.work import Budget
from kahanmaps.checks.claims import Certainty
from kahanmaps.display_protocols import ResultPart
from kahanmaps.documents.files import SystemFile
from kahanmaps.family.system_normal_form import NoNormalForm, SystemNormalForm
from kahanmaps.family.tensor import TensorStructure
from kahanmaps.laboratory.growth.degrees import DegreeGrowth
from kahanmaps.laboratory.growth.height_survey import HeightSurvey
from kahanmaps.laboratory.preserve.densities import DensitySearch
from kahanmaps.laboratory.preserve.hirota_kimura import SparseRelation
from kahanmaps.laboratory.preserve.integrals import IntegralSearch
from kahanmaps.laboratory.preserve.limit.limits import FlowAndMap
from kahanmaps.laboratory.preserve.poisson.hamiltonian_structure import ConstantStructures
from kahanmaps.laboratory.preserve.poisson.pencil import Pencil
from kahanmaps.laboratory.preserve.poisson.poisson_tensors import PoissonSearch
from kahanmaps.laboratory.singular.singularities import SingularityRun
from kahanmaps.laboratory.symmetry.commuting import CommutingSystems
from kahanmaps.laboratory.symmetry.symmetries import Symmetries
from kahanmaps.laboratory.vector_field.equivalence import Equivalence
from kahanmaps.laboratory.vector_field.fixed_points import FixedPointSearch


@dataclass(frozen=True)
class Statement(ResultPart):
    """One line of a report, with its certainty."""

    status: Certainty
    text: str


@dataclass
class AnalysisResult:
    """The results of the steps; None means that a step has not run. `further` has results that no other step uses."""

    file: SystemFile
    eps: fmpq | None
    effort: int | Budget
    seed: int
    symbols: tuple[str, ...] = ()
    defect: str = ""  # the reason if the Kahan map at this eps is not birational; otherwise empty
    fixed_points: FixedPointSearch | None = None
    equivalent: Equivalence | None = None  # an affine equivalence to a system of the catalogue
    integrals: IntegralSearch | None = None
    pencil: Pencil | None = None  # the pencil of invariant curves of a map of the plane
    relations: tuple[SparseRelation, ...] = ()
    densities: DensitySearch | None = None
    flow: FlowAndMap | None = None
    poisson: PoissonSearch | None = None
    degrees: DegreeGrowth | None = None
    heights: HeightSurvey | None = None
    singularities: list[SingularityRun] = field(default_factory=list)
    symmetries: Symmetries | None = None
    commuting: CommutingSystems | None = None
    hamiltonian: ConstantStructures | None = None
    normal_form: SystemNormalForm | NoNormalForm | None = None  # the origin is the point `centre`
    tensor: TensorStructure | None = None  # an algebra larger than Q over which f is defined
    further: dict[str, Any] = field(default_factory=dict)
    skipped: list[str] = field(default_factory=list)
    pending: list[str] = field(default_factory=list)  # names of the steps that have not run yet
    units: int = 0  # units of work that the steps used

    def __getitem__(self, key: str) -> Any:
        """Return the result of the step with this key; None if the step has not run."""
        return getattr(self, key, self.further.get(key))

    def __setitem__(self, key: str, value: Any) -> None:
        if hasattr(self, key):
            setattr(self, key, value)
        else:
            self.further[key] = value

    @property
    def dim(self) -> int:
        """The dimension of the phase space."""
        return self.file.dim

    @property
    def centre(self) -> tuple[fmpq, ...] | None:
        """The origin of the coordinates of `normal_form`; None without a normal form or a centre of the Hamiltonian."""
        if self.hamiltonian is not None and self.hamiltonian.hamiltonian is not None:
            return self.hamiltonian.hamiltonian.centre
        return None if self.normal_form is None else (fmpq(0),) * self.dim

    @property
    def integral_count(self) -> int:
        """The number of independent integrals, from formulas, orbits or theorems; or a lower bound of it."""
        codimension = self.integrals.codimension if self.integrals is not None else 0
        family = self.normal_form.form.m if isinstance(self.normal_form, SystemNormalForm) else 0
        return max(codimension, family)

    @property
    def count_is_exact(self) -> bool:
        """Whether `integral_count` is the exact number; otherwise it is a lower bound."""
        return self.integrals is not None and self.integrals.is_exact

    @property
    def integrals_were_counted(self) -> bool:
        """Whether `integral_count` was determined; otherwise it is 0, since no orbit was examined."""
        has_profile = self.integrals is not None and bool(self.integrals.profile.nullities)
        return has_profile or self.integral_count > 0
