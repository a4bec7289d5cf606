"""What is known of one map: the results of all analyses, as far as there was time for them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from flint import fmpq

from kahanmaps.algebra.work import Budget
from kahanmaps.checks.claims import Certainty
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
class Statement:
    """One line of a report and how it is known."""

    status: Certainty
    text: str


@dataclass
class Findings:
    """The results of the parts, None for those not reached; `further` has those that no other part reads."""

    file: SystemFile
    eps: fmpq | None
    effort: int | Budget
    seed: int
    symbols: tuple[str, ...] = ()
    defect: str = ""  # why the Kahan map at this eps is not birational; empty where it is, and for other maps
    fixed_points: FixedPointSearch | None = None
    equivalent: Equivalence | None = None  # a system of the catalogue
    integrals: IntegralSearch | None = None
    pencil: Pencil | None = None  # in the plane
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
    normal_form: SystemNormalForm | NoNormalForm | None = None  # in coordinates with the centre as origin
    tensor: TensorStructure | None = None  # over which algebra larger than Q it is a system
    further: dict[str, Any] = field(default_factory=dict)
    skipped: list[str] = field(default_factory=list)
    pending: list[str] = field(default_factory=list)  # the parts that were not gone through yet
    units: int = 0  # of counted work that the parts took

    def __getitem__(self, result: str) -> Any:
        """The result of a part, None if it was not reached."""
        return getattr(self, result, self.further.get(result))

    def __setitem__(self, result: str, value: Any) -> None:
        if hasattr(self, result):
            setattr(self, result, value)
        else:
            self.further[result] = value

    @property
    def dim(self) -> int:
        """The dimension of the phase space."""
        return self.file.dim

    @property
    def centre(self) -> tuple[fmpq, ...] | None:
        """The origin of the coordinates of `normal_form`; None where H has no centre, or that was not reached."""
        if self.hamiltonian is not None and self.hamiltonian.hamiltonian is not None:
            return self.hamiltonian.hamiltonian.centre
        return None if self.normal_form is None else (fmpq(0),) * self.dim

    @property
    def integral_count(self) -> int:
        """The number of independent integrals: found, shown by orbits, or given by theorems; see `count_is_exact`."""
        known = self.integrals.codimension if self.integrals is not None else 0
        family = self.normal_form.form.m if isinstance(self.normal_form, SystemNormalForm) else 0
        return max(known, family)

    @property
    def count_is_exact(self) -> bool:
        """Whether there are no more than `integral_count` integrals: else it is a lower bound."""
        return self.integrals is not None and self.integrals.is_exact

    @property
    def integrals_were_counted(self) -> bool:
        """Whether `integral_count` says anything: it is 0 as well where the orbits were not reached or not defined."""
        measured = self.integrals is not None and bool(self.integrals.profile.nullities)
        return measured or self.integral_count > 0
