"""All analyses of the report, in the order in which they are done: each may use what was found before."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from kahanmaps.algebra.printing import attributes
from kahanmaps.algebra.work import Budget
from kahanmaps.checks.claims import Certainty
from kahanmaps.family.system_normal_form import NoNormalForm, SystemNormalForm, system_normal_form
from kahanmaps.family.tensor import TensorStructure, tensor_structure
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.analyses import statements
from kahanmaps.laboratory.analyses.part import Of, Part, Run
from kahanmaps.laboratory.findings import Findings
from kahanmaps.laboratory.growth.degrees import DegreeGrowth, degree_growth
from kahanmaps.laboratory.growth.height_survey import height_survey
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.preserve.densities import DensitySearch, find_densities, with_factors
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
from kahanmaps.laboratory.singular.singularities import singularities as follow
from kahanmaps.laboratory.symmetry.commuting import find_commuting
from kahanmaps.laboratory.symmetry.symmetries import linear_symmetries
from kahanmaps.laboratory.vector_field.equivalence import equivalent_system
from kahanmaps.laboratory.vector_field.fixed_points import fixed_points

_POISSON_DIMENSIONS = (3, 4)  # in the plane Poisson tensors are densities, and in more dimensions they take long


def _family(run: Run, **_: Any) -> SystemNormalForm | NoNormalForm:
    """The normal form of a member of the commuting family, in coordinates with the centre as origin."""
    known = run.found.hamiltonian
    if known is None or known.hamiltonian is None:
        return system_normal_form(run.field)
    moved = known.hamiltonian if known.hamiltonian.centre is None else known.hamiltonian.about(known.hamiltonian.centre)
    return system_normal_form(moved.system, moved)


def _family_json(found: Findings) -> dict[str, Any]:
    """What a member of the family is one by, and what follows: x = centre + T y, J = T [[0, I], [-I, 0]] T^T."""
    member = None
    if isinstance(found.normal_form, SystemNormalForm):
        form = found.normal_form.form
        member = {"chi": form.chi_text, "integrals_in_involution": form.m, "associated_maps": 2 ** (form.m - 1)}
        member |= {**attributes(found.normal_form, "A", "T"), **attributes(found, "centre")}
    return {"family": (found.normal_form.text or None) if found.normal_form is not None else None, "member": member}


def _algebra(run: Run, **_: Any) -> TensorStructure | None:
    """The algebra larger than Q over which it is a system; of a member of the family its normal form says more."""
    return None if isinstance(run.found.normal_form, SystemNormalForm) else tensor_structure(run.field)


def _singularities(run: Run, effort: Budget, progress: Callable[[str], None]) -> list[SingularityRun]:
    """What becomes of contracted hypersurfaces, at two values of eps or the given one; none of too large a map."""
    values = default_eps(run.map, run.seed) if run.found.eps is None else (run.found.eps,)
    if not all(can_be_written(run.map, value, effort.part(1 / len(values))) for value in values):
        return []
    stages = zip(values, effort.share([1] * len(values)), strict=True)
    return [follow(run.map, value, seed=run.seed, effort=stage, progress=progress) for value, stage in stages]


def _degrees(run: Run, **given: Any) -> DegreeGrowth:
    """Degrees of the iterates, with the patterns of singularities to explain them."""
    runs = run.found.singularities if run.dim <= WRITTEN_DIMENSION else []
    # Where they are known to the end and are those that `degrees` would ask for itself.
    known = patterns_of(runs) if runs else None
    patterns = None if known is None or known.running else known
    return degree_growth(run.map, run.found.eps, patterns=patterns, seed=run.seed, **given)


def _curves(run: Run, effort: Budget, **_: Any) -> Pencil | None:
    """On which curves a planar map with one integral moves."""
    proved = [one for one in run.integrals if one.verdict is Certainty.PROVED]
    if run.dim != 2 or len(proved) != 1 or run.has_symbols:
        return None
    return pencil_of(proved[0].name, proved[0].function, run.found.eps, seed=run.seed, effort=effort)


def _curves_json(found: Findings) -> dict[str, Any]:
    """The curves, and what the map is on them; null where the degrees contradict them."""
    growth = found.degrees.growth if found.degrees is not None else Growth.UNKNOWN
    if found.pencil is None or found.pencil.contradiction(growth):
        return {"invariant_curves": None}
    return {"invariant_curves": {**found.pencil.to_json(), "motion": found.pencil.motion(growth)}}


def _relations(run: Run, **_: Any) -> tuple[SparseRelation, ...]:
    """Hirota-Kimura relations with few terms, of the lowest degrees that have some."""
    profile = None if run.found.integrals is None else run.found.integrals.profile
    if profile is None or profile.first_degree is None or profile.period is not None:
        return ()
    found: tuple[SparseRelation, ...] = ()
    maps = Laboratory(run.bare, (), run.found.eps, run.seed, algebraic=True).maps
    top = profile.degree if profile.dim - profile.codimension <= 1 else profile.first_degree + 1
    for degree in range(profile.first_degree, min(top, profile.degree, 4) + 1):
        first = 1 + len({name for relation in found for name in relation.names})
        found += sparse_relations(maps, degree, run.map.variables, first=first) or ()
    return found


def _poisson(run: Run, effort: Budget, **given: Any) -> PoissonSearch | None:
    """Invariant tensors of low degree, with their Casimirs and the integrals in involution."""
    if run.dim not in _POISSON_DIMENSIONS:
        return None
    found = find_poisson(run.bare, integrals=(), **run.asked, effort=effort, **given)
    return with_brackets(found, run.integrals, effort)


def _densities(run: Run, **given: Any) -> DensitySearch:
    """One in closed form, or else a product of powers of factors of the integrals, and whether there are others."""
    return with_factors(find_densities(run.bare, **run.asked, integrals=(), **given), run.integrals)


def _flow(run: Run, **given: Any) -> FlowAndMap | None:
    """The limits for eps -> 0 of integrals and of a density, and integrals and a density of the flow."""
    if run.found.integrals is None:
        return None
    flow = flow_and_map(run.found.integrals, known=run.found.integral_count, **given)
    return None if flow is None else with_limit(flow, run.found.densities)


# The sections in the order of the report; others come after these.
TITLES = (
    *("vector field", "integrals", "measure", "the flow", "Poisson tensors", "growth", "singularities", "symmetry"),
    *("structure", "commuting systems"),
)

ANALYSES = (
    Part(
        "Hamiltonian structure",
        lambda run, **_: constant_structures(run.field, seed=run.seed) if run.dim <= MAX_DIMENSION else None,
        result="hamiltonian",
        json=lambda _: {},
    ),
    Part(
        "the commuting family",
        _family,
        "structure",
        statements.of_structure,
        result="normal_form",
        reads=("Hamiltonian structure", "a larger algebra"),
        json=_family_json,
    ),
    Part(
        "a larger algebra",
        _algebra,
        result="tensor",
        json=lambda found: {"algebra": found.tensor and attributes(found.tensor, "text", "C", "rank", chi="chi_text")},
    ),
    Part(
        "fixed points",
        lambda run, effort, **_: fixed_points(run.field, effort),
        "vector field",
        statements.of_vector_field,
        result="fixed_points",
        reads=("equivalent systems",),
    ),
    Part(
        "equivalent systems",
        lambda run, effort, **_: equivalent_system(run.found.file, run.found.fixed_points, effort),
        result="equivalent",
    ),
    # Degrees make use of singularities; but in more dimensions these are slow, come last, and are not waited for.
    Part(
        "singularities",
        _singularities,
        "singularities",
        statements.of_singularities,
        Of.MAPS_OVER_Q,
        share=0.4,
        slow_above=WRITTEN_DIMENSION,
        is_apart=True,
        json=lambda found: {
            "singularities": [attributes(run, "eps", "verdict", "followed", "text") for run in found.singularities]
        },
    ),
    Part("degrees", _degrees, "growth", statements.of_growth, Of.EVERY, share=0.25, reads=("heights",), is_apart=True),
    Part(
        "integrals",
        lambda run, **given: find_integrals(run.bare, **run.asked, **given),
        "integrals",
        statements.of_integrals,
        Of.EVERY,
        share=0.4,
        reads=("the commuting family", "degrees", "invariant curves", "relations along orbits"),
    ),
    Part("invariant curves", _curves, of=Of.MAPS_OVER_Q, result="pencil", json=_curves_json),
    Part(
        "relations along orbits",
        _relations,
        of=Of.EVERY,
        result="relations",
        json=lambda found: {"hirota_kimura": [relation.text for relation in found.relations]},
    ),
    Part(
        "Poisson tensors",
        _poisson,
        "Poisson tensors",
        statements.of_poisson_tensors,
        Of.MAPS_OVER_Q,
        result="poisson",
    ),
    Part("densities", _densities, "measure", statements.of_densities, Of.EVERY, share=0.25, reads=("integrals",)),
    Part("the flow", _flow, "the flow", statements.of_flow, Of.MAPS_OVER_Q, share=0.06, result="flow"),
    Part(
        "heights",
        lambda run, **given: height_survey(run.map, run.found.eps, starts=2, max_digits=5_000, seed=run.seed, **given),
        of=Of.EVERY,
        share=0.08,
        is_apart=True,
    ),
    Part(
        "symmetries",
        lambda run, **given: linear_symmetries(run.field, **given),
        "symmetry",
        statements.of_symmetries,
        is_apart=True,
    ),
    Part(
        "commuting systems",
        # All g of a kind, for every eps.
        lambda run, **given: (
            find_commuting(run.system or run.map, seed=run.seed, **given) if run.found.eps is None else None
        ),
        "commuting systems",
        statements.of_commuting_systems,
        Of.FIELDS | Of.NUMBER_FIELDS,
        result="commuting",
        is_apart=True,
    ),
)
