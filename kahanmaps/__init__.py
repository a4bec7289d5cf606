"""Kahan (Hirota-Kimura) maps of quadratic systems, exactly: orbits, integrals, commutativity, with proofs.

>>> import kahanmaps as km
>>> member = km.draw_with_eigenvalues([1, -2, 3], seed=7)
>>> f, g = member.associate([1, 1, 1]), member.associate([1, 1, -1])
>>> phi_f, phi_g = km.KahanMap(f.system, "1/10"), km.KahanMap(g.system, "1/10")
>>> x = phi_f.point(["1/2", "-1/3", 0, 1, "2/5", -1])
>>> phi_f.step(phi_g.step(x)) == phi_g.step(phi_f.step(x))
True
>>> km.check_commute(km.SystemFile.from_member(member)).verdict
<Verdict.PROVED: 'proved'>

Names are imported when they are first used, so that `import kahanmaps` costs next to nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from kahanmaps.version import __version__

if TYPE_CHECKING:
    from kahanmaps.algebra.fields import CC, GF, QQ, RR
    from kahanmaps.algebra.interpolation import reconstruct
    from kahanmaps.algebra.text import parse_point, parse_polynomial, parse_rational_function
    from kahanmaps.checks.claims import Finding, Report, Verdict
    from kahanmaps.checks.commute import check_commute
    from kahanmaps.checks.conserve import check_integrals
    from kahanmaps.checks.preserve import check_measure, check_poisson
    from kahanmaps.checks.settings import Settings
    from kahanmaps.display.latex import latex_polynomial, latex_rational_function
    from kahanmaps.documents.catalog import load, names
    from kahanmaps.documents.files import SystemFile, parse_system, read_system
    from kahanmaps.errors import InputError, KahanmapsError, SingularStep, SystemFileError
    from kahanmaps.experiments.records import Record, Task
    from kahanmaps.experiments.run import run
    from kahanmaps.experiments.spec import Spec, parse_spec, read_spec
    from kahanmaps.experiments.store import Store
    from kahanmaps.family.associated import AssociatedSystem, FamilyMember
    from kahanmaps.family.cubics import cubic_space
    from kahanmaps.family.draw import draw_generic, draw_with_chi, draw_with_eigenvalues
    from kahanmaps.family.hidden import HiddenMember, hidden_member, hidden_member_of
    from kahanmaps.family.planar import NormalForm, normal_form
    from kahanmaps.family.structure import Structure, structure_of
    from kahanmaps.invariants.heights import HeightGrowth, height, height_growth
    from kahanmaps.laboratory.affine_functions import affine_darboux, affine_integrals
    from kahanmaps.laboratory.analysis import Analysis, analyze
    from kahanmaps.laboratory.commuting import CommutingSystems, commuting_systems
    from kahanmaps.laboratory.cycles import Census, cycle_census
    from kahanmaps.laboratory.darboux import DarbouxSearch, darboux_polynomials
    from kahanmaps.laboratory.degrees import DegreeGrowth, degree_growth
    from kahanmaps.laboratory.densities import DensitySearch, find_densities
    from kahanmaps.laboratory.hamiltonian_structure import ConstantStructures, constant_structures
    from kahanmaps.laboratory.height_survey import HeightSurvey, height_survey
    from kahanmaps.laboratory.hirota_kimura import hirota_kimura_basis, orbit_profile
    from kahanmaps.laboratory.integrals import IntegralSearch, find_integrals
    from kahanmaps.laboratory.laboratory import Laboratory
    from kahanmaps.laboratory.recurrences import Recurrence, find_recurrence
    from kahanmaps.laboratory.singularities import SingularityRun, singularities
    from kahanmaps.laboratory.symmetries import Symmetries, linear_symmetries
    from kahanmaps.languages.convert import convert
    from kahanmaps.maps.fast import FloatOrbit, to_floats
    from kahanmaps.maps.float_ensemble import FloatEnsemble
    from kahanmaps.maps.float_lyapunov import Lyapunov, lyapunov_exponents
    from kahanmaps.maps.jump import Jump
    from kahanmaps.maps.kahan import KahanMap
    from kahanmaps.maps.modular import ModularEnsemble
    from kahanmaps.maps.normal_steps import NormalSteps
    from kahanmaps.maps.orbits import Iterates, Orbit
    from kahanmaps.maps.periods import orbit_period, period_over_rationals
    from kahanmaps.paper.examiner import VerifyOptions
    from kahanmaps.paper.verify import verify, verify_universal
    from kahanmaps.reports.report import report_html, write_report
    from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
    from kahanmaps.systems.quadratic import QuadraticSystem

_HOME = {
    "algebra.fields": ("CC", "GF", "QQ", "RR"),
    "algebra.text": ("parse_point", "parse_polynomial", "parse_rational_function"),
    "algebra.interpolation": ("reconstruct",),
    "display.latex": ("latex_polynomial", "latex_rational_function"),
    "systems.quadratic": ("QuadraticSystem",),
    "systems.hamiltonian": ("CubicHamiltonian", "standard_structure"),
    "documents.files": ("SystemFile", "parse_system", "read_system"),
    "documents.catalog": ("load", "names"),
    "family.associated": ("AssociatedSystem", "FamilyMember"),
    "family.cubics": ("cubic_space",),
    "family.draw": ("draw_generic", "draw_with_chi", "draw_with_eigenvalues"),
    "family.planar": ("NormalForm", "normal_form"),
    "family.hidden": ("HiddenMember", "hidden_member", "hidden_member_of"),
    "family.structure": ("Structure", "structure_of"),
    "maps.kahan": ("KahanMap",),
    "maps.orbits": ("Iterates", "Orbit"),
    "maps.jump": ("Jump",),
    "maps.normal_steps": ("NormalSteps",),
    "maps.periods": ("orbit_period", "period_over_rationals"),
    "maps.fast": ("FloatOrbit", "to_floats"),
    "maps.float_ensemble": ("FloatEnsemble",),
    "maps.float_lyapunov": ("Lyapunov", "lyapunov_exponents"),
    "maps.modular": ("ModularEnsemble",),
    "invariants.heights": ("HeightGrowth", "height", "height_growth"),
    "languages.convert": ("convert",),
    "checks.claims": ("Finding", "Report", "Verdict"),
    "checks.settings": ("Settings",),
    "checks.commute": ("check_commute",),
    "checks.conserve": ("check_integrals",),
    "checks.preserve": ("check_measure", "check_poisson"),
    "laboratory.analysis": ("Analysis", "analyze"),
    "laboratory.integrals": ("IntegralSearch", "find_integrals"),
    "laboratory.laboratory": ("Laboratory",),
    "laboratory.hirota_kimura": ("hirota_kimura_basis", "orbit_profile"),
    "laboratory.darboux": ("DarbouxSearch", "darboux_polynomials"),
    "laboratory.densities": ("DensitySearch", "find_densities"),
    "laboratory.degrees": ("DegreeGrowth", "degree_growth"),
    "laboratory.recurrences": ("Recurrence", "find_recurrence"),
    "laboratory.height_survey": ("HeightSurvey", "height_survey"),
    "laboratory.singularities": ("SingularityRun", "singularities"),
    "laboratory.cycles": ("Census", "cycle_census"),
    "laboratory.symmetries": ("Symmetries", "linear_symmetries"),
    "laboratory.commuting": ("CommutingSystems", "commuting_systems"),
    "laboratory.hamiltonian_structure": ("ConstantStructures", "constant_structures"),
    "laboratory.affine_functions": ("affine_darboux", "affine_integrals"),
    "paper.examiner": ("VerifyOptions",),
    "paper.verify": ("verify", "verify_universal"),
    "experiments.records": ("Record", "Task"),
    "experiments.spec": ("Spec", "parse_spec", "read_spec"),
    "experiments.store": ("Store",),
    "experiments.run": ("run",),
    "reports.report": ("report_html", "write_report"),
    "errors": ("InputError", "KahanmapsError", "SingularStep", "SystemFileError"),
}
_MODULE_OF = {name: module for module, exported in _HOME.items() for name in exported}

__all__ = [
    "CC",
    "GF",
    "QQ",
    "RR",
    "parse_point",
    "parse_polynomial",
    "parse_rational_function",
    "reconstruct",
    "latex_polynomial",
    "latex_rational_function",
    "QuadraticSystem",
    "CubicHamiltonian",
    "standard_structure",
    "SystemFile",
    "parse_system",
    "read_system",
    "load",
    "names",
    "AssociatedSystem",
    "FamilyMember",
    "cubic_space",
    "draw_generic",
    "draw_with_chi",
    "draw_with_eigenvalues",
    "NormalForm",
    "normal_form",
    "HiddenMember",
    "hidden_member",
    "hidden_member_of",
    "Structure",
    "structure_of",
    "KahanMap",
    "Orbit",
    "Iterates",
    "Jump",
    "NormalSteps",
    "orbit_period",
    "period_over_rationals",
    "FloatOrbit",
    "FloatEnsemble",
    "Lyapunov",
    "lyapunov_exponents",
    "ModularEnsemble",
    "to_floats",
    "convert",
    "HeightGrowth",
    "height",
    "height_growth",
    "Finding",
    "Report",
    "Verdict",
    "Settings",
    "check_commute",
    "check_integrals",
    "check_measure",
    "check_poisson",
    "Analysis",
    "analyze",
    "IntegralSearch",
    "Laboratory",
    "find_integrals",
    "hirota_kimura_basis",
    "orbit_profile",
    "DarbouxSearch",
    "darboux_polynomials",
    "DensitySearch",
    "find_densities",
    "DegreeGrowth",
    "degree_growth",
    "Recurrence",
    "find_recurrence",
    "HeightSurvey",
    "height_survey",
    "SingularityRun",
    "singularities",
    "Census",
    "cycle_census",
    "Symmetries",
    "linear_symmetries",
    "CommutingSystems",
    "commuting_systems",
    "ConstantStructures",
    "constant_structures",
    "affine_darboux",
    "affine_integrals",
    "verify",
    "verify_universal",
    "VerifyOptions",
    "Record",
    "Spec",
    "Store",
    "Task",
    "parse_spec",
    "read_spec",
    "run",
    "report_html",
    "write_report",
    "InputError",
    "KahanmapsError",
    "SingularStep",
    "SystemFileError",
    "__version__",
]


def __getattr__(name: str) -> Any:
    if name in _MODULE_OF:
        value = getattr(import_module(f"kahanmaps.{_MODULE_OF[name]}"), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module 'kahanmaps' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
