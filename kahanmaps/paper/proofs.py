"""Proof of a claim in normal form, with indeterminate data: for every member with distinct roots at once."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from kahanmaps.algebra.functions import BudgetExceeded
from kahanmaps.checks.claims import Evidence
from kahanmaps.checks.judge import Contradiction
from kahanmaps.errors import counted
from kahanmaps.paper import objects_over
from kahanmaps.paper.evaluate import UNDEFINED, evaluate, witness_of
from kahanmaps.paper.registry import claims

# Enough for every claim up to m = 6; at m = 8 a few claims that sum over all roots exceed it.
PROOF_BUDGET = 50_000_000


@lru_cache(maxsize=4096)
def normal_form_proof(key: str, blocks: int, order: int) -> Evidence | None:
    """The proof of a claim in normal form with so many blocks; None where it grows beyond the budget.

    Raises Contradiction where the two sides are different rational functions.
    """
    claim = next(found for found in claims() if found.key == key)
    bounds = objects_over.universal_bound_objects(blocks, order)
    for _ in claim.function(bounds):
        pass
    vectors = sorted(bounds.used - {"roots"})
    try:
        objects = objects_over.normal_form_objects(blocks, vectors, PROOF_BUDGET, order)
        outcome = evaluate(claim, objects)
    except (BudgetExceeded, *UNDEFINED):
        return None
    K: Any = objects.K
    if not outcome.holds:
        text = f"{claim.place}: {claim.title}: the two sides are different rational functions in normal form"
        raise Contradiction(text, witness_of(outcome))
    if not outcome.pairs:
        return None
    what = counted(blocks, "block")
    return Evidence(
        "symbolic, normal form",
        f"multiplied out in normal form, {what}, all data indeterminate",
        {"blocks": blocks, "indeterminates": len(K.variables), "products_of_terms": PROOF_BUDGET - K.budget},
    )
