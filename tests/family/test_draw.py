"""Members of the family drawn from a seed.

Specified here: a seed gives the same member, for ever; the matrix has the spectrum asked for; the cubic belongs to it,
and its planar cubics have no repeated line; large m is quick; and what cannot be drawn is refused.
"""

import pytest
from flint import fmpq_mat, fmpq_poly

from kahanmaps.algebra.polynomials import gradient
from kahanmaps.algebra.printing import format_polynomial
from kahanmaps.family.cubics import belongs
from kahanmaps.family.draw import draw_generic, draw_with_chi, draw_with_eigenvalues
from kahanmaps.family.skew_hamiltonian import chi, defects

t = fmpq_poly([0, 1])

DRAWS = {
    "eigenvalues": lambda seed: draw_with_eigenvalues([1, -2, "1/2"], seed),
    "a repeated eigenvalue": lambda seed: draw_with_eigenvalues([1, 1, 2], seed),
    "chi": lambda seed: draw_with_chi(t**3 - t - 1, seed),
    "chi with a repeated root": lambda seed: draw_with_chi((t - 1) ** 2 * (t + 1), seed),
    "generic": lambda seed: draw_generic(3, seed),
}
over_draws = pytest.mark.parametrize("draw", DRAWS.values(), ids=DRAWS.keys())
over_seeds = pytest.mark.parametrize("seed", range(5))


def test_a_seed_gives_the_member_that_it_always_gave():
    # Records of experiments name members by seed: when this fails, old records no longer say what they were about.
    member = draw_with_chi(t**2 - 2, seed=7)
    assert member.A == fmpq_mat([[4, -3, 0, -2], [-6, -4, 2, 0], [0, -16, 4, -6], [16, 0, -3, -4]])
    assert format_polynomial(member.H).startswith("47*x1^3 - 66*x1^2*x2 + 30*x1*x2^2 - 4*x2^3 + 256*x1^2*x3")


@over_draws
@over_seeds
def test_the_matrix_is_skew_hamiltonian_and_the_cubic_belongs_to_it(draw, seed):
    member = draw(seed)
    assert (defects(member.A), belongs(member.A, member.H)) == ([], True)


def determinant(rows):
    """Laplace's expansion along the first row, for polynomial entries."""
    if len(rows) == 1:
        return rows[0][0]
    minors = [determinant([row[:j] + row[j + 1 :] for row in rows[1:]]) for j in range(len(rows))]
    return sum((rows[0][j] * minor * (-1) ** j for j, minor in enumerate(minors)), 0 * rows[0][0])


PARTS = {
    "chi, one root": lambda seed: draw_with_chi(t - 5, seed),
    "chi, two roots": lambda seed: draw_with_chi((t - 1) * (t - 2), seed),
    "eigenvalues": lambda seed: draw_with_eigenvalues([1, 2], seed),
    "generic": lambda seed: draw_generic(1, seed),
}


@pytest.mark.parametrize("draw", PARTS.values(), ids=PARTS.keys())
@pytest.mark.parametrize("seed", range(5))
def test_no_planar_cubic_has_a_repeated_line(draw, seed):
    # det Hess H is the product of the D_i = det Hess h_i of the planar cubics, and D_i is a square if disc h_i = 0.
    member = draw(seed)
    hessian = determinant([list(gradient(component)) for component in gradient(member.H)])
    assert {multiplicity for _, multiplicity in hessian.factor()[1]} == {1}


@pytest.mark.parametrize("polynomial", [t - 5, t**2 - 2, t**3 - t - 1, (t - 1) ** 2 * (t**2 + 1), t**4], ids=str)
@over_seeds
def test_chi_is_the_polynomial_asked_for(polynomial, seed):
    assert chi(draw_with_chi(polynomial, seed).A) == polynomial
