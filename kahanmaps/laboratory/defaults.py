"""Default work limits of searches: one table for `analyze` and for the commands that run a single search.

Searches are bounded by units of counted work (algebra/work.py). The share of a step of `analyze` depends on the
dimension. It is at most the value in this table, so that a command never has a lower limit than the step of `analyze`.
"""

from __future__ import annotations

from kahanmaps.algebra.work import Budget, units_at

UNITS = {
    "integrals": 60e6,
    "densities": 60e6,
    "Poisson tensors": 60e6,
    "Darboux polynomials": 60e6,
    "singularities": 60e6,  # for each eps
    "degrees": 40e6,  # includes the singularity patterns, which are a separate step of `analyze`
    "dynamical degree": 10e6,
    "heights": 30e6,
    "symmetries": 30e6,
    "commuting systems": 60e6,
    "fixed points": 10e6,
    "equivalent systems": 10e6,
    "limits": 10e6,
    "invariant curves": 2e6,
}
ITERATE_DEGREE = 200_000  # the maximal degree of an iterate that is measured


def tensor_degree(dim: int) -> int:
    """Return the maximal degree of entries in searches for Poisson tensors: 3 in dimension 3, otherwise 2."""
    return 3 if dim == 3 else 2


def budget_for(search: str, effort: int | Budget) -> Budget:
    """Return the budget of a search, which doubles when the effort increases by 1; a Budget is returned unchanged."""
    return effort if isinstance(effort, Budget) else Budget(units_at(effort, UNITS[search]))
