"""All analyses of the report, in the order in which one process does them: each may use what was found before."""

from __future__ import annotations

from kahanmaps.laboratory.analyses import (
    commuting,
    densities,
    family,
    flow,
    growth,
    integrals,
    poisson_tensors,
    singularities,
    symmetries,
    vector_field,
)
from kahanmaps.laboratory.analyses.part import Of, Part
from kahanmaps.laboratory.singular.singularities import WRITTEN_DIMENSION

# The sections in the order of the report; others come after these.
TITLES = (
    *("vector field", "integrals", "measure", "the flow", "Poisson tensors", "growth", "singularities", "symmetry"),
    *("structure", "commuting systems"),
)

ANALYSES = (
    Part("Hamiltonian structure", family.hamiltonian, result="hamiltonian", json=lambda _: {}),
    Part(
        "the commuting family",
        family.family,
        "structure",
        family.statements,
        result="normal_form",
        reads=("Hamiltonian structure", "a larger algebra"),
        json=family.family_json,
    ),
    Part("a larger algebra", family.algebra, result="tensor", json=family.algebra_json),
    Part(
        "fixed points",
        vector_field.fixed_points,
        "vector field",
        vector_field.statements,
        result="fixed_points",
        reads=("equivalent systems",),
    ),
    Part("equivalent systems", vector_field.equivalent, result="equivalent"),
    # Degrees make use of singularities; but in more dimensions these are slow, and come last.
    Part(
        "singularities",
        singularities.singularities,
        "singularities",
        singularities.statements,
        Of.MAPS_OVER_Q,
        share=0.4,
        slow_above=WRITTEN_DIMENSION,
        is_apart=True,
        json=singularities.singularities_json,
    ),
    Part(
        "degrees",
        growth.degrees,
        "growth",
        growth.statements,
        Of.EVERY,
        share=0.25,
        reads=("heights",),
        is_apart=True,
    ),
    Part(
        "integrals",
        integrals.integrals,
        "integrals",
        integrals.statements,
        Of.EVERY,
        share=0.45,
        reads=("the commuting family", "degrees", "invariant curves", "relations along orbits"),
    ),
    Part("invariant curves", integrals.curves, of=Of.MAPS_OVER_Q, result="pencil", json=integrals.curves_json),
    Part("relations along orbits", integrals.relations, of=Of.EVERY, result="relations", json=integrals.relations_json),
    Part("densities", densities.densities, "measure", densities.statements, Of.EVERY, share=0.25),
    Part(
        "the flow",
        flow.flow,
        "the flow",
        flow.statements,
        Of.MAPS_OVER_Q,
        share=0.03,
        result="flow",
        reads=("the limit of a density",),
        needs=("the commuting family", "integrals"),
        is_apart=True,
    ),
    # Put into what was found of the flow: so densities are sought while the flow is looked at.
    Part(
        "the limit of a density",
        flow.with_limit_of_density,
        of=Of.EVERY,
        result="flow",
        needs=("the flow", "densities"),
        json=lambda _: {},
    ),
    Part(
        "Poisson tensors",
        poisson_tensors.poisson,
        "Poisson tensors",
        poisson_tensors.statements,
        Of.MAPS_OVER_Q,
        result="poisson",
        needs=("integrals",),
        is_apart=True,
    ),
    Part("heights", growth.heights, of=Of.EVERY, share=0.08, is_apart=True),
    Part("symmetries", symmetries.symmetries, "symmetry", symmetries.statements, is_apart=True),
    Part(
        "commuting systems",
        commuting.commuting,
        "commuting systems",
        commuting.statements,
        Of.FIELDS | Of.NUMBER_FIELDS,
        result="commuting",
        is_apart=True,
    ),
)
