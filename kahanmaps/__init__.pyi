"""The public names of `import kahanmaps`, with the module of each.

For type checkers, and for lazy_loader, which imports a name when it is first used.
"""

from . import family as family
from . import systems as systems
from .algebra.fields import CC as CC
from .algebra.fields import GF as GF
from .algebra.fields import QQ as QQ
from .algebra.fields import RR as RR
from .algebra.interpolation import reconstruct as reconstruct
from .algebra.parsing import parse_point as parse_point
from .algebra.parsing import parse_polynomial as parse_polynomial
from .algebra.parsing import parse_rational_function as parse_rational_function
from .algebra.work import Budget as Budget
from .certificates.certificate import certificate as certificate
from .certificates.certificate import certificate_of as certificate_of
from .checks.claims import Certainty as Certainty
from .checks.claims import Finding as Finding
from .checks.claims import Report as Report
from .checks.commute import check_commute as check_commute
from .checks.conserve import check_integrals as check_integrals
from .checks.preserve import check_measure as check_measure
from .checks.preserve import check_poisson as check_poisson
from .checks.settings import Settings as Settings
from .display.latex import latex_polynomial as latex_polynomial
from .display.latex import latex_rational_function as latex_rational_function
from .documents.catalog import Catalogue as Catalogue
from .documents.catalog import catalogue as catalogue
from .documents.catalog import load as load
from .documents.catalog import names as names
from .documents.files import SystemFile as SystemFile
from .documents.files import parse_system as parse_system
from .documents.files import read_system as read_system
from .documents.inline import System as System
from .documents.inline import map_at as map_at
from .documents.tensor import tensor_file as tensor_file
from .errors import InputError as InputError
from .errors import KahanmapsError as KahanmapsError
from .errors import SingularStep as SingularStep
from .errors import SystemFileError as SystemFileError
from .experiments.batch import batch as batch
from .experiments.results.records import Record as Record
from .experiments.results.records import Task as Task
from .experiments.results.store import Store as Store
from .experiments.running.run import run as run
from .experiments.spec import Spec as Spec
from .experiments.spec import parse_spec as parse_spec
from .experiments.spec import read_spec as read_spec
from .family.associated import AssociatedSystem as AssociatedSystem
from .family.associated import FamilyMember as FamilyMember
from .family.cubics import cubic_space as cubic_space
from .family.planar import NormalForm as NormalForm
from .family.planar import normal_form as normal_form
from .family.random_members import random_member as random_member
from .family.random_members import random_member_with_chi as random_member_with_chi
from .family.random_members import random_member_with_eigenvalues as random_member_with_eigenvalues
from .family.recognition import FamilyStructure as FamilyStructure
from .family.recognition import find_family_structure as find_family_structure
from .family.recognition import find_family_structure_of as find_family_structure_of
from .family.system_normal_form import SystemNormalForm as SystemNormalForm
from .family.system_normal_form import system_normal_form as system_normal_form
from .family.tensor import TensorStructure as TensorStructure
from .family.tensor import tensor_structure as tensor_structure
from .hard_stop import TimeLimit as TimeLimit
from .hard_stop import time_limit as time_limit
from .invariants.heights import HeightGrowth as HeightGrowth
from .invariants.heights import height as height
from .invariants.heights import height_growth as height_growth
from .invariants.poisson import MatrixPoissonTensor as MatrixPoissonTensor
from .laboratory.analysis import Analysis as Analysis
from .laboratory.analysis import analyze as analyze
from .laboratory.cycles import Census as Census
from .laboratory.cycles import cycle_census as cycle_census
from .laboratory.growth.degrees import DegreeGrowth as DegreeGrowth
from .laboratory.growth.degrees import algebraic_entropy as algebraic_entropy
from .laboratory.growth.degrees import degree_growth as degree_growth
from .laboratory.growth.degrees import dynamical_degree as dynamical_degree
from .laboratory.growth.height_survey import HeightSurvey as HeightSurvey
from .laboratory.growth.height_survey import height_survey as height_survey
from .laboratory.growth.recurrences import Recurrence as Recurrence
from .laboratory.growth.recurrences import find_recurrence as find_recurrence
from .laboratory.laboratory import Laboratory as Laboratory
from .laboratory.preserve.darboux.affine_functions import affine_darboux as affine_darboux
from .laboratory.preserve.darboux.affine_functions import affine_integrals as affine_integrals
from .laboratory.preserve.darboux.darboux_polynomials import DarbouxSearch as DarbouxSearch
from .laboratory.preserve.darboux.darboux_polynomials import darboux_polynomials as darboux_polynomials
from .laboratory.preserve.densities import DensitySearch as DensitySearch
from .laboratory.preserve.densities import find_densities as find_densities
from .laboratory.preserve.hirota_kimura import hirota_kimura_basis as hirota_kimura_basis
from .laboratory.preserve.hirota_kimura import orbit_profile as orbit_profile
from .laboratory.preserve.integrals import IntegralSearch as IntegralSearch
from .laboratory.preserve.integrals import find_integrals as find_integrals
from .laboratory.preserve.limit.limits import flow_and_map as flow_and_map
from .laboratory.preserve.poisson.hamiltonian_structure import ConstantStructures as ConstantStructures
from .laboratory.preserve.poisson.hamiltonian_structure import constant_structures as constant_structures
from .laboratory.preserve.poisson.poisson_tensors import PoissonSearch as PoissonSearch
from .laboratory.preserve.poisson.poisson_tensors import find_poisson as find_poisson
from .laboratory.scan.result import Scan as Scan
from .laboratory.scan.scan import scan as scan
from .laboratory.singular.singularities import SingularityRun as SingularityRun
from .laboratory.singular.singularities import singularities as singularities
from .laboratory.symmetry.commuting import CommutingSystems as CommutingSystems
from .laboratory.symmetry.commuting import commuting_systems as commuting_systems
from .laboratory.symmetry.commuting import find_commuting as find_commuting
from .laboratory.symmetry.symmetries import Symmetries as Symmetries
from .laboratory.symmetry.symmetries import linear_symmetries as linear_symmetries
from .laboratory.vector_field.equivalence import Equivalence as Equivalence
from .laboratory.vector_field.equivalence import equivalent_system as equivalent_system
from .laboratory.vector_field.fixed_points import FixedPointSearch as FixedPointSearch
from .laboratory.vector_field.fixed_points import fixed_points as fixed_points
from .laboratory.vector_field.modified import ModifiedField as ModifiedField
from .laboratory.vector_field.modified import modified as modified
from .languages.convert import convert as convert
from .maps.bilinear import bilinear_map as bilinear_map
from .maps.composed import composed_map as composed_map
from .maps.explicit import explicit_map as explicit_map
from .maps.floats.ensemble import FloatEnsemble as FloatEnsemble
from .maps.floats.ensemble import ensemble as ensemble
from .maps.floats.float_orbit import FloatOrbit as FloatOrbit
from .maps.floats.float_orbit import to_floats as to_floats
from .maps.floats.lyapunov import Lyapunov as Lyapunov
from .maps.floats.lyapunov import lyapunov_exponents as lyapunov_exponents
from .maps.implicit import ImplicitMap as ImplicitMap
from .maps.implicit import MapFamily as MapFamily
from .maps.kahan import KahanFamily as KahanFamily
from .maps.kahan import KahanMap as KahanMap
from .maps.normal_form.geometry import geometry as geometry
from .maps.normal_form.iterate import NthIterate as NthIterate
from .maps.normal_form.periods import orbit_period as orbit_period
from .maps.normal_form.periods import period as period
from .maps.normal_form.periods import period_over_rationals as period_over_rationals
from .maps.normal_form.planes_point import NormalSteps as NormalSteps
from .maps.orbits.arithmetic import Arithmetic as Arithmetic
from .maps.orbits.iteration import Orbit as Orbit
from .maps.orbits.orbit import orbit as orbit
from .maps.polarised import polarised_map as polarised_map
from .paper.verify import VerifyOptions as VerifyOptions
from .paper.verify import verify as verify
from .plots.comparison.compare import Comparison as Comparison
from .plots.comparison.compare import compare as compare
from .plots.plot import plot as plot
from .plots.plot import plot_orbits as plot_orbits
from .reports.report import report as report
from .reports.report import report_html as report_html
from .reports.report import write_report as write_report
from .systems.hamiltonian import CubicHamiltonian as CubicHamiltonian
from .systems.hamiltonian import standard_structure as standard_structure
from .systems.quadratic import QuadraticSystem as QuadraticSystem
from .version import __version__ as __version__

# The names of commands, see _COMMANDS in __init__.py.
cycles = cycle_census
degrees = degree_growth
find_density = find_densities
find_symmetry = linear_symmetries
invariant_measure = find_densities
heights = height_survey
lyapunov = lyapunov_exponents
map = map_at
portrait = plot_orbits
