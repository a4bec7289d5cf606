"""Default limits of analyses: one table for `analyze` and for the commands that run a single analysis.

Analyses are bounded by units of counted work (algebra/work.py). `analyze` gives each of its steps a share of units that
depends on the dimension and is at most the value here, so that a single command never has a lower limit than its step.
"""

from __future__ import annotations

from kahanmaps.algebra.work import Budget, units_at

UNITS = {
    "integrals": 60e6,
    "densities": 60e6,
    "Poisson tensors": 60e6,
    "Darboux polynomials": 60e6,
    "singularities": 60e6,  # for each eps
    "degrees": 40e6,  # includes the singularity patterns, for which `analyze` has a separate step
    "dynamical degree": 10e6,
    "heights": 30e6,
    "symmetries": 30e6,
    "commuting systems": 60e6,
    "fixed points": 10e6,
    "equivalent systems": 10e6,
    "limits": 10e6,
    "invariant curves": 2e6,
}
ITERATE_DEGREE = 200_000  # the largest degree of an iterate that is measured


def tensor_degree(dim: int) -> int:
    """Return the largest degree of entries of Poisson tensors that is tried: 3 in dimension 3, and 2 in all others."""
    return 3 if dim == 3 else 2


def budget_for(search: str, effort: int | Budget) -> Budget:
    """Return the budget of a search, doubled with each increase of the effort by 1; return a Budget unchanged."""
    return effort if isinstance(effort, Budget) else Budget(units_at(effort, UNITS[search]))
