"""The steps of an analysis, in the order in which they run; a step may use the results of earlier steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from kahanmaps.algebra.printing import attributes
from kahanmaps.algebra.work import Budget
from kahanmaps.checks.claims import Certainty
from kahanmaps.family.system_normal_form import NoNormalForm, SystemNormalForm, system_normal_form
from kahanmaps.family.tensor import tensor_structure
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.analyses import statements
from kahanmaps.laboratory.analyses.step import AnalysisContext, AnalysisStep, MapKinds
from kahanmaps.laboratory.analysis_result import AnalysisResult
from kahanmaps.laboratory.growth.degrees import DegreeGrowth, degree_growth
from kahanmaps.laboratory.growth.height_survey import height_survey
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.preserve.densities import find_densities, with_factors
from kahanmaps.laboratory.preserve.hirota_kimura import SparseRelation, sparse_relations
from kahanmaps.laboratory.preserve.integrals import find_integrals
from kahanmaps.laboratory.preserve.limit.limits import FlowAndMap, flow_and_map, with_limit
from kahanmaps.laboratory.preserve.poisson.hamiltonian_structure import MAX_DIMENSION, constant_structures
from kahanmaps.laboratory.preserve.poisson.pencil import Pencil, pencil_of
from kahanmaps.laboratory.preserve.poisson.poisson_tensors import PoissonSearch, find_poisson, with_brackets
from kahanmaps.laboratory.singular.singularities import (
    WRITTEN_DIMENSION,
    SingularityRun,
    can_be_written,
    default_eps,
    patterns_of,
)
from kahanmaps.laboratory.singular.singularities import singularities as find_singularities
from kahanmaps.laboratory.symmetry.commuting import find_commuting
from kahanmaps.laboratory.symmetry.symmetries import linear_symmetries
from kahanmaps.laboratory.vector_field.equivalence import equivalent_system
from kahanmaps.laboratory.vector_field.fixed_points import fixed_points

_POISSON_DIMENSIONS = (3, 4)  # Poisson tensors in the plane are densities; above dimension 4 the search is slow


def _find_normal_form(context: AnalysisContext, **_: Any) -> SystemNormalForm | NoNormalForm:
    """Return the normal form of a member of the commuting family, with the centre of its Hamiltonian as the origin."""
    structures = context.result.hamiltonian
    if structures is None or structures.hamiltonian is None:
        return system_normal_form(context.field)
    hamiltonian = structures.hamiltonian
    if hamiltonian.centre is not None:
        hamiltonian = hamiltonian.about(hamiltonian.centre)
    return system_normal_form(hamiltonian.system, hamiltonian)


def _normal_form_json(result: AnalysisResult) -> dict[str, Any]:
    """Return data on a member f = J grad H of the commuting family: x = centre + T y, J = T [[0, I], [-I, 0]] T^T."""
    data = None
    if isinstance(result.normal_form, SystemNormalForm):
        form = result.normal_form.form
        data = {"chi": form.chi_text, "integrals_in_involution": form.m, "associated_maps": 2 ** (form.m - 1)}
        data |= {**attributes(result.normal_form, "A", "T"), **attributes(result, "centre")}
    return {"family": (result.normal_form.text or None) if result.normal_form is not None else None, "member": data}


def _trace_patterns(context: AnalysisContext, effort: Budget, progress: Callable[[str], None]) -> list[SingularityRun]:
    """Return the singularities at the given eps, or at two eps; [] if their formulas would be too large."""
    values = default_eps(context.map, context.seed) if context.result.eps is None else (context.result.eps,)
    if not all(can_be_written(context.map, value, effort.part(1 / len(values))) for value in values):
        return []
    values_with_budget = zip(values, effort.share([1] * len(values)), strict=True)
    return [
        find_singularities(context.map, value, seed=context.seed, effort=budget, progress=progress)
        for value, budget in values_with_budget
    ]


def _measure_degrees(context: AnalysisContext, **options: Any) -> DegreeGrowth:
    """Return the degrees of the iterates; they are derived from the singularity patterns if these are known."""
    singularity_runs = context.result.singularities if context.dim <= WRITTEN_DIMENSION else []
    # Only patterns that are known for all steps are passed on; `degree_growth` traces others again.
    computed_patterns = patterns_of(singularity_runs) if singularity_runs else None
    patterns = None if computed_patterns is None or computed_patterns.running else computed_patterns
    return degree_growth(context.map, context.result.eps, patterns=patterns, seed=context.seed, **options)


def _find_pencil(context: AnalysisContext, effort: Budget, **_: Any) -> Pencil | None:
    """Return the pencil of invariant curves of a planar map with one integral."""
    integrals = [integral for integral in context.integrals if integral.verdict is Certainty.PROVED]
    if context.dim != 2 or len(integrals) != 1 or context.has_symbols:
        return None
    return pencil_of(integrals[0].name, integrals[0].function, context.result.eps, seed=context.seed, effort=effort)


def _pencil_json(result: AnalysisResult) -> dict[str, Any]:
    """Return the pencil of invariant curves and the motion on them for JSON; None if the degrees exclude a pencil."""
    growth = result.degrees.growth if result.degrees is not None else Growth.UNKNOWN
    if result.pencil is None or result.pencil.contradiction(growth):
        return {"invariant_curves": None}
    return {"invariant_curves": {**result.pencil.to_json(), "motion": result.pencil.motion(growth)}}


def _find_relations(context: AnalysisContext, **_: Any) -> tuple[SparseRelation, ...]:
    """Return the Hirota-Kimura relations with few terms, in the lowest degrees in which relations exist."""
    profile = None if context.result.integrals is None else context.result.integrals.profile
    if profile is None or profile.first_degree is None or profile.period is not None:
        return ()
    relations: tuple[SparseRelation, ...] = ()
    maps = Laboratory(context.file_without_claims, (), context.result.eps, context.seed, algebraic=True).maps
    last_degree = profile.degree if profile.dim - profile.codimension <= 1 else profile.first_degree + 1
    for degree in range(profile.first_degree, min(last_degree, profile.degree, 4) + 1):
        first_index = 1 + len({name for relation in relations for name in relation.names})
        relations += sparse_relations(maps, degree, context.map.variables, first=first_index) or ()
    return relations


def _find_poisson_tensors(context: AnalysisContext, effort: Budget, **options: Any) -> PoissonSearch | None:
    """Return the invariant Poisson tensors of low degree, with their Casimirs and the brackets of the integrals."""
    if context.dim not in _POISSON_DIMENSIONS:
        return None
    search = find_poisson(context.file_without_claims, integrals=(), **context.settings, effort=effort, **options)
    return with_brackets(search, context.integrals, effort)


def _find_limits(context: AnalysisContext, **options: Any) -> FlowAndMap | None:
    """Return the limits of the integrals and of a density for eps -> 0, and the integrals and a density of the flow."""
    if context.result.integrals is None:
        return None
    flow = flow_and_map(context.result.integrals, known=context.result.integral_count, **options)
    return None if flow is None else with_limit(flow, context.result.densities)


# The titles of the sections, in the order of the report; sections with other titles follow.
TITLES = (
    *("vector field", "integrals", "measure", "the flow", "Poisson tensors", "growth", "singularities", "symmetry"),
    *("structure", "commuting systems"),
)

ANALYSES = (
    AnalysisStep(
        "Hamiltonian structure",
        lambda context, **_: (
            constant_structures(context.field, seed=context.seed) if context.dim <= MAX_DIMENSION else None
        ),
        key="hamiltonian",
        json=lambda _: {},
    ),
    AnalysisStep(
        "the commuting family",
        _find_normal_form,
        "structure",
        statements.of_structure,
        key="normal_form",
        requires=("Hamiltonian structure", "a larger algebra"),
        json=_normal_form_json,
    ),
    AnalysisStep(
        "a larger algebra",
        # An algebra larger than Q over which f is defined; not searched for if f has a normal form, which implies more.
        lambda context, **_: (
            None if isinstance(context.result.normal_form, SystemNormalForm) else tensor_structure(context.field)
        ),
        key="tensor",
        json=lambda result: {
            "algebra": result.tensor and attributes(result.tensor, "text", "C", "rank", chi="chi_text")
        },
    ),
    AnalysisStep(
        "fixed points",
        lambda context, effort, **_: fixed_points(context.field, effort),
        "vector field",
        statements.of_vector_field,
        key="fixed_points",
        requires=("equivalent systems",),
    ),
    AnalysisStep(
        "equivalent systems",
        lambda context, effort, **_: equivalent_system(context.result.file, context.result.fixed_points, effort),
        key="equivalent",
    ),
    # The step "degrees" uses the singularities up to dimension 4; above it, "singularities" is slow and runs last.
    AnalysisStep(
        "singularities",
        _trace_patterns,
        "singularities",
        statements.of_singularities,
        MapKinds.OVER_Q,
        weight=0.4,
        slow_above=WRITTEN_DIMENSION,
        is_independent=True,
        json=lambda result: {
            "singularities": [attributes(run, "eps", "verdict", "followed", "text") for run in result.singularities]
        },
    ),
    AnalysisStep(
        "degrees",
        _measure_degrees,
        "growth",
        statements.of_growth,
        MapKinds.ALL,
        weight=0.25,
        requires=("heights",),
        is_independent=True,
    ),
    AnalysisStep(
        "integrals",
        lambda context, **options: find_integrals(context.file_without_claims, **context.settings, **options),
        "integrals",
        statements.of_integrals,
        MapKinds.ALL,
        weight=0.4,
        requires=("the commuting family", "degrees", "invariant curves", "relations along orbits"),
    ),
    AnalysisStep("invariant curves", _find_pencil, applies_to=MapKinds.OVER_Q, key="pencil", json=_pencil_json),
    AnalysisStep(
        "relations along orbits",
        _find_relations,
        applies_to=MapKinds.ALL,
        key="relations",
        json=lambda result: {"hirota_kimura": [relation.text for relation in result.relations]},
    ),
    AnalysisStep(
        "Poisson tensors",
        _find_poisson_tensors,
        "Poisson tensors",
        statements.of_poisson_tensors,
        MapKinds.OVER_Q,
        key="poisson",
    ),
    AnalysisStep(
        "densities",
        # The densities are polynomials, or products of powers of factors of the integrals.
        lambda context, **options: with_factors(
            find_densities(context.file_without_claims, **context.settings, integrals=(), **options), context.integrals
        ),
        "measure",
        statements.of_densities,
        MapKinds.ALL,
        weight=0.25,
        requires=("integrals",),
    ),
    AnalysisStep("the flow", _find_limits, "the flow", statements.of_flow, MapKinds.OVER_Q, weight=0.06, key="flow"),
    AnalysisStep(
        "heights",
        lambda context, **options: height_survey(
            context.map, context.result.eps, starts=2, max_digits=5_000, seed=context.seed, **options
        ),
        applies_to=MapKinds.ALL,
        weight=0.08,
        is_independent=True,
    ),
    AnalysisStep(
        "symmetries",
        lambda context, **options: linear_symmetries(context.field, **options),
        "symmetry",
        statements.of_symmetries,
        is_independent=True,
    ),
    AnalysisStep(
        "commuting systems",
        # All g of one ansatz whose Kahan maps commute with that of f for every eps.
        lambda context, **options: (
            find_commuting(context.system or context.map, seed=context.seed, **options)
            if context.result.eps is None
            else None
        ),
        "commuting systems",
        statements.of_commuting_systems,
        MapKinds.VECTOR_FIELDS | MapKinds.OVER_NUMBER_FIELDS,
        key="commuting",
        is_independent=True,
    ),
)
