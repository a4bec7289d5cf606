"""Members of the family for these tests: every kind of spectrum, with distinct roots and with repeated ones."""

import pytest
from flint import fmpq_poly

from kahanmaps.family.random_members import random_member, random_member_with_chi, random_member_with_eigenvalues

t = fmpq_poly([0, 1])

GENERIC = {
    "m = 1": random_member(1, 1),
    "m = 2, split": random_member_with_eigenvalues([1, -2], 1),
    "m = 2, irreducible": random_member_with_chi(t**2 - 2, 1),
    "m = 3, split, fractions": random_member_with_eigenvalues(["1/2", "-2/3", 4], 1),
    "m = 3, irreducible": random_member(3, 1),
    "m = 3, partly split": random_member_with_chi((t - 1) * (t**2 + 1), 1),
    "m = 4, two quadratic factors": random_member_with_chi((t**2 + 1) * (t**2 - 2), 1),
    "m = 4, partly split": random_member_with_chi((t - 1) * (2 * t - 1) * (t**2 + t + 3), 1),
}
REPEATED = {
    "m = 3, a root twice, diagonalisable": random_member_with_eigenvalues([1, 1, 2], 1),
    "m = 2, a root twice, not diagonalisable": random_member_with_chi((t - 1) ** 2, 1),
    "m = 3, a root twice, not diagonalisable": random_member_with_chi((t - 1) ** 2 * (t + 1), 1),
}
MEMBERS = GENERIC | REPEATED
over_members = pytest.mark.parametrize("member", MEMBERS.values(), ids=MEMBERS.keys())
