"""What `import kahanmaps` offers: the one list of public names, with the module of each.

Type checkers read it, and kahanmaps/__init__.py does, to import a name when it is first used.
"""

from typing import Any

from kahanmaps.algebra.fields import CC as CC
from kahanmaps.algebra.fields import GF as GF
from kahanmaps.algebra.fields import QQ as QQ
from kahanmaps.algebra.fields import RR as RR
from kahanmaps.algebra.interpolation import reconstruct as reconstruct
from kahanmaps.algebra.written.text import parse_point as parse_point
from kahanmaps.algebra.written.text import parse_polynomial as parse_polynomial
from kahanmaps.algebra.written.text import parse_rational_function as parse_rational_function
from kahanmaps.checks.claims import Finding as Finding
from kahanmaps.checks.claims import Report as Report
from kahanmaps.checks.claims import Verdict as Verdict
from kahanmaps.checks.commute import check_commute as _check_commute  # noqa: F401
from kahanmaps.checks.conserve import check_integrals as _check_integrals
from kahanmaps.checks.preserve import check_measure as _check_measure
from kahanmaps.checks.preserve import check_poisson as _check_poisson
from kahanmaps.checks.settings import Settings as Settings
from kahanmaps.display.latex import latex_polynomial as latex_polynomial
from kahanmaps.display.latex import latex_rational_function as latex_rational_function
from kahanmaps.documents.catalog import load as load
from kahanmaps.documents.catalog import names as names
from kahanmaps.documents.files import SystemFile as SystemFile
from kahanmaps.documents.files import map_at as _map_at
from kahanmaps.documents.files import parse_system as parse_system
from kahanmaps.documents.files import read_system as read_system
from kahanmaps.documents.inline import System as System
from kahanmaps.documents.tensor import tensor_file as _tensor_file
from kahanmaps.door import Given, opened
from kahanmaps.errors import InputError as InputError
from kahanmaps.errors import KahanmapsError as KahanmapsError
from kahanmaps.errors import SingularStep as SingularStep
from kahanmaps.errors import SystemFileError as SystemFileError
from kahanmaps.experiments.results.records import Record as Record
from kahanmaps.experiments.results.records import Task as Task
from kahanmaps.experiments.results.store import Store as Store
from kahanmaps.experiments.running.run import run as run
from kahanmaps.experiments.spec import Spec as Spec
from kahanmaps.experiments.spec import parse_spec as parse_spec
from kahanmaps.experiments.spec import read_spec as read_spec
from kahanmaps.family.associated import AssociatedSystem as AssociatedSystem
from kahanmaps.family.associated import FamilyMember as FamilyMember
from kahanmaps.family.cubics import cubic_space as cubic_space
from kahanmaps.family.draw import draw_generic as draw_generic
from kahanmaps.family.draw import draw_with_chi as draw_with_chi
from kahanmaps.family.draw import draw_with_eigenvalues as draw_with_eigenvalues
from kahanmaps.family.planar import NormalForm as NormalForm
from kahanmaps.family.planar import normal_form as normal_form
from kahanmaps.family.recognise import RecognisedMember as RecognisedMember
from kahanmaps.family.recognise import recognised_member as recognised_member
from kahanmaps.family.recognise import recognised_member_of as _recognised_member_of
from kahanmaps.family.system_normal_form import SystemNormalForm as SystemNormalForm
from kahanmaps.family.system_normal_form import system_normal_form as _system_normal_form
from kahanmaps.family.tensor import TensorStructure as TensorStructure
from kahanmaps.family.tensor import tensor_structure as _tensor_structure
from kahanmaps.invariants.heights import HeightGrowth as HeightGrowth
from kahanmaps.invariants.heights import height as height
from kahanmaps.invariants.heights import height_growth as height_growth
from kahanmaps.invariants.poisson import GivenTensor as GivenTensor
from kahanmaps.laboratory.analysis import Analysis as Analysis
from kahanmaps.laboratory.analysis import analyze as _analyze
from kahanmaps.laboratory.cycles import Census as Census
from kahanmaps.laboratory.cycles import cycle_census as _cycle_census
from kahanmaps.laboratory.growth.degrees import DegreeGrowth as DegreeGrowth
from kahanmaps.laboratory.growth.degrees import degree_growth as _degree_growth
from kahanmaps.laboratory.growth.height_survey import HeightSurvey as HeightSurvey
from kahanmaps.laboratory.growth.height_survey import height_survey as _height_survey
from kahanmaps.laboratory.growth.recurrences import Recurrence as Recurrence
from kahanmaps.laboratory.growth.recurrences import find_recurrence as find_recurrence
from kahanmaps.laboratory.laboratory import Laboratory as Laboratory
from kahanmaps.laboratory.preserve.darboux.affine_functions import affine_darboux as _affine_darboux
from kahanmaps.laboratory.preserve.darboux.affine_functions import affine_integrals as _affine_integrals
from kahanmaps.laboratory.preserve.darboux.darboux_polynomials import DarbouxSearch as DarbouxSearch
from kahanmaps.laboratory.preserve.darboux.darboux_polynomials import darboux_polynomials as _darboux_polynomials
from kahanmaps.laboratory.preserve.densities import DensitySearch as DensitySearch
from kahanmaps.laboratory.preserve.densities import find_densities as _find_densities
from kahanmaps.laboratory.preserve.hirota_kimura import hirota_kimura_basis as hirota_kimura_basis
from kahanmaps.laboratory.preserve.hirota_kimura import orbit_profile as orbit_profile
from kahanmaps.laboratory.preserve.integrals import IntegralSearch as IntegralSearch
from kahanmaps.laboratory.preserve.integrals import find_integrals as _find_integrals
from kahanmaps.laboratory.preserve.limit.limits import flow_and_map as flow_and_map
from kahanmaps.laboratory.preserve.poisson.hamiltonian_structure import ConstantStructures as ConstantStructures
from kahanmaps.laboratory.preserve.poisson.hamiltonian_structure import constant_structures as _constant_structures
from kahanmaps.laboratory.preserve.poisson.poisson_tensors import PoissonSearch as PoissonSearch
from kahanmaps.laboratory.preserve.poisson.poisson_tensors import find_poisson as _find_poisson
from kahanmaps.laboratory.scan.result import Scan as Scan
from kahanmaps.laboratory.scan.scan import scan as _scan
from kahanmaps.laboratory.singular.singularities import SingularityRun as SingularityRun
from kahanmaps.laboratory.singular.singularities import singularities as _singularities
from kahanmaps.laboratory.symmetry.commuting import CommutingSystems as CommutingSystems
from kahanmaps.laboratory.symmetry.commuting import commuting_systems as _commuting_systems
from kahanmaps.laboratory.symmetry.commuting import find_commuting as _find_commuting
from kahanmaps.laboratory.symmetry.symmetries import Symmetries as Symmetries
from kahanmaps.laboratory.symmetry.symmetries import linear_symmetries as _linear_symmetries
from kahanmaps.laboratory.vector_field.equivalence import Equivalence as Equivalence
from kahanmaps.laboratory.vector_field.equivalence import equivalent_system as _equivalent_system
from kahanmaps.laboratory.vector_field.fixed_points import FixedPointSearch as FixedPointSearch
from kahanmaps.laboratory.vector_field.fixed_points import fixed_points as _fixed_points
from kahanmaps.languages.convert import convert as _convert
from kahanmaps.maps.bilinear import bilinear_map as bilinear_map
from kahanmaps.maps.composed import composed_map as composed_map
from kahanmaps.maps.explicit import explicit_map as explicit_map
from kahanmaps.maps.floats.ensemble import FloatEnsemble as FloatEnsemble
from kahanmaps.maps.floats.ensemble import ensemble as _ensemble
from kahanmaps.maps.floats.fast import FloatOrbit as FloatOrbit
from kahanmaps.maps.floats.fast import to_floats as to_floats
from kahanmaps.maps.floats.lyapunov import Lyapunov as Lyapunov
from kahanmaps.maps.floats.lyapunov import lyapunov_exponents as _lyapunov_exponents
from kahanmaps.maps.implicit import BirationalMap as BirationalMap
from kahanmaps.maps.implicit import ImplicitMap as ImplicitMap
from kahanmaps.maps.kahan import Kahan as Kahan
from kahanmaps.maps.kahan import KahanMap as KahanMap
from kahanmaps.maps.normal_form.iterate import NthIterate as NthIterate
from kahanmaps.maps.normal_form.periods import orbit_period as orbit_period
from kahanmaps.maps.normal_form.periods import period as _period
from kahanmaps.maps.normal_form.periods import period_over_rationals as period_over_rationals
from kahanmaps.maps.normal_form.steps import NormalSteps as NormalSteps
from kahanmaps.maps.orbits.arithmetic import Arithmetic as Arithmetic
from kahanmaps.maps.orbits.iteration import Orbit as Orbit
from kahanmaps.maps.orbits.orbit import orbit as _orbit
from kahanmaps.maps.polarised import polarised_map as polarised_map
from kahanmaps.paper.verifier import VerifyOptions as VerifyOptions
from kahanmaps.paper.verify import verify as _verify  # noqa: F401
from kahanmaps.paper.verify import verify_universal as verify_universal
from kahanmaps.plots.plot import draw_orbits as _draw_orbits
from kahanmaps.plots.plot import plot as plot
from kahanmaps.reports.report import report_html as report_html
from kahanmaps.reports.report import write_report as write_report
from kahanmaps.systems.hamiltonian import CubicHamiltonian as CubicHamiltonian
from kahanmaps.systems.hamiltonian import standard_structure as standard_structure
from kahanmaps.systems.quadratic import QuadraticSystem as QuadraticSystem
from kahanmaps.version import __version__ as __version__

# Whatever stands for a map is their first argument: see door.py.
check_integrals = opened(_check_integrals)
check_measure = opened(_check_measure)
check_poisson = opened(_check_poisson)
tensor_file = opened(_tensor_file)
recognised_member_of = opened(_recognised_member_of)
system_normal_form = opened(_system_normal_form)
tensor_structure = opened(_tensor_structure)
analyze = opened(_analyze)
cycle_census = opened(_cycle_census)
degree_growth = opened(_degree_growth)
height_survey = opened(_height_survey)
affine_darboux = opened(_affine_darboux)
affine_integrals = opened(_affine_integrals)
darboux_polynomials = opened(_darboux_polynomials)
find_densities = opened(_find_densities)
constant_structures = opened(_constant_structures)
find_integrals = opened(_find_integrals)
find_poisson = opened(_find_poisson)
scan = opened(_scan)
singularities = opened(_singularities)
commuting_systems = opened(_commuting_systems)
find_commuting = opened(_find_commuting)
linear_symmetries = opened(_linear_symmetries)
equivalent_system = opened(_equivalent_system)
fixed_points = opened(_fixed_points)
convert = opened(_convert)
lyapunov_exponents = opened(_lyapunov_exponents)
ensemble = opened(_ensemble)
orbit = opened(_orbit)
period = opened(_period)
map = opened(_map_at)
portrait = opened(_draw_orbits)

# The same under the names of the commands.
cycles = cycle_census
degrees = degree_growth
find_density = find_densities
find_symmetry = linear_symmetries
heights = height_survey
lyapunov = lyapunov_exponents

# A second map too, or none.
def check_commute(
    file: Given,
    other: Given | None = None,
    settings: Settings | None = None,
    eps2: Any = None,
    *,
    eps: Any = None,
    time_step: Any = None,
) -> Report: ...
def verify(
    file: Given | None = None,
    settings: Settings | None = None,
    options: VerifyOptions | None = None,
    *,
    m: int | None = None,
    eps: Any = None,
    time_step: Any = None,
) -> Report: ...
