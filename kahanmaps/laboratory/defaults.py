"""How far analyses go unless they are told: one table for `analyze` and for the commands that do one of them alone.

`analyze` gives each of its parts a share of a time by dimension, of which no share is longer than what stands here, so
that no command finds less than `analyze` does.
"""

from __future__ import annotations

SECONDS = {
    "integrals": 60.0,
    "densities": 60.0,
    "Poisson tensors": 60.0,
    "singularities": 60.0,  # for each eps
    "degrees": 40.0,  # singularities are followed in this time, which `analyze` does apart
    "heights": 30.0,
    "symmetries": 30.0,
    "commuting systems": 60.0,
}
ITERATE_DEGREE = 200_000  # the largest of an iterate that is measured


def tensor_degree(dim: int) -> int:
    """The largest degree of the entries of Poisson tensors: 3 in dimension 3, where it takes a second, and else 2."""
    return 3 if dim == 3 else 2
