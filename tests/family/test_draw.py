"""Members of the family drawn from a seed.

Specified here: a seed gives the same member, for ever; the matrix has the spectrum asked for; the cubic belongs to it,
and its planar cubics have no repeated line; large m is quick; and what cannot be drawn is refused.
"""

import pytest
from flint import fmpq_mat, fmpq_poly

from kahanmaps.algebra.printing import format_polynomial
from kahanmaps.family.cubics import belongs
from kahanmaps.family.planar import normal_form
from kahanmaps.family.random_members import random_member, random_member_with_chi, random_member_with_eigenvalues
from kahanmaps.family.skew_hamiltonian import chi, defects

t = fmpq_poly([0, 1])

DRAWS = {
    "eigenvalues": lambda seed: random_member_with_eigenvalues([1, -2, "1/2"], seed),
    "a repeated eigenvalue": lambda seed: random_member_with_eigenvalues([1, 1, 2], seed),
    "chi": lambda seed: random_member_with_chi(t**3 - t - 1, seed),
    "chi with a repeated root": lambda seed: random_member_with_chi((t - 1) ** 2 * (t + 1), seed),
    "generic": lambda seed: random_member(3, seed),
}
over_draws = pytest.mark.parametrize("draw", DRAWS.values(), ids=DRAWS.keys())
over_seeds = pytest.mark.parametrize("seed", range(5))


def test_a_seed_gives_the_member_that_it_always_gave():
    # Records of experiments name members by seed: when this fails, old records no longer say what they were about.
    member = random_member_with_chi(t**2 - 2, seed=7)
    assert member.A == fmpq_mat([[4, -3, 0, -2], [-6, -4, 2, 0], [0, -16, 4, -6], [16, 0, -3, -4]])
    assert format_polynomial(member.H).startswith("47*x1^3 - 66*x1^2*x2 + 30*x1*x2^2 - 4*x2^3 + 256*x1^2*x3")


@over_draws
@over_seeds
def test_the_matrix_is_skew_hamiltonian_and_the_cubic_belongs_to_it(draw, seed):
    member = draw(seed)
    assert (defects(member.A), belongs(member.A, member.H)) == ([], True)


@pytest.mark.parametrize(
    "draw", [DRAWS["chi"], DRAWS["generic"], lambda seed: random_member_with_eigenvalues([1, 2], seed)]
)
@over_seeds
def test_no_planar_cubic_has_a_repeated_line(draw, seed):
    form = normal_form(draw(seed))
    p, q, r = form.D_coefficients  # the discriminant of D = p X^2 + q X Y + r Y^2 is that of h, but for a factor
    assert (q * q - 4 * p * r).gcd(form.chi).degree() == 0


@pytest.mark.parametrize("polynomial", [t - 5, t**2 - 2, t**3 - t - 1, (t - 1) ** 2 * (t**2 + 1), t**4], ids=str)
@over_seeds
def test_chi_is_the_polynomial_asked_for(polynomial, seed):
    assert chi(random_member_with_chi(polynomial, seed).A) == polynomial
