"""Members of the family for these tests: every kind of spectrum, with distinct roots and with repeated ones."""

import pytest
from flint import fmpq_poly

from kahanmaps.family.draw import draw_generic, draw_with_chi, draw_with_eigenvalues

t = fmpq_poly([0, 1])

GENERIC = {
    "m = 1": draw_generic(1, 1),
    "m = 2, split": draw_with_eigenvalues([1, -2], 1),
    "m = 2, irreducible": draw_with_chi(t**2 - 2, 1),
    "m = 3, split, fractions": draw_with_eigenvalues(["1/2", "-2/3", 4], 1),
    "m = 3, irreducible": draw_generic(3, 1),
    "m = 3, partly split": draw_with_chi((t - 1) * (t**2 + 1), 1),
    "m = 4, two quadratic factors": draw_with_chi((t**2 + 1) * (t**2 - 2), 1),
    "m = 4, partly split": draw_with_chi((t - 1) * (2 * t - 1) * (t**2 + t + 3), 1),
}
REPEATED = {
    "m = 3, a root twice, diagonalisable": draw_with_eigenvalues([1, 1, 2], 1),
    "m = 2, a root twice, not diagonalisable": draw_with_chi((t - 1) ** 2, 1),
    "m = 3, a root twice, not diagonalisable": draw_with_chi((t - 1) ** 2 * (t + 1), 1),
}
MEMBERS = GENERIC | REPEATED
over_members = pytest.mark.parametrize("member", MEMBERS.values(), ids=MEMBERS.keys())
