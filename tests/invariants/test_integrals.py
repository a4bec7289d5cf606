"""Integrals of Kahan maps, as functions of x and eps.

For f = J grad H with any cubic H and any constant skew J, "modified H" is H + (2 eps/3) grad H^T (I - eps f')^{-1}
f. It is conserved, tends to H with a defect of order eps^2, and is -1/6 of the paper's H~ where that is defined.
"""

import pytest
from check_helpers import (
    claim,
    dot,
    exact,
    function_value,
    hamiltonian_of,
    hamiltonians,
    kahan_step,
    modified_value,
    rows_of,
    times,
    transposed,
)
from flint import fmpq, fmpq_poly
from helpers import fraction, over_exact_fields, points, rationals
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.algebra.fields import GF, QQ
from kahanmaps.errors import BadPrime, InputError, SingularStep
from kahanmaps.family.draw import draw_with_chi, draw_with_eigenvalues
from kahanmaps.invariants.integrals import ClaimedIntegral, CommutantIntegral, ModifiedHamiltonian, PaperIntegral
from kahanmaps.systems.hamiltonian import standard_structure

nonzero = rationals(6).filter(lambda eps: eps != 0)

HENON = hamiltonian_of("q1 q2 p1 p2", "p1^2/2 + p2^2/2 + q1^2/2 + q2^2/2 + q1^2*q2 - q2^3/3")
PLANE_CUBIC = hamiltonian_of("q p", "q^3/3 - 2*q*p^2 + p^3")


@st.composite
def with_points(draw, dims=(1, 2, 3), homogeneous=False, standard=False):
    hamiltonian = draw(hamiltonians(dims, homogeneous, standard))
    return hamiltonian, draw(points(hamiltonian.dim, rationals(9)))


# Modified H


@given(with_points(), nonzero)
def test_modified_h_is_what_its_formula_says(drawn, eps):
    hamiltonian, x = drawn
    expected = modified_value(hamiltonian, fraction(eps), exact(*x))
    assume(expected is not None)
    assert fraction(ModifiedHamiltonian(hamiltonian).value(QQ, eps, x)) == expected


@given(with_points(), nonzero)
def test_modified_h_is_conserved(drawn, eps):
    hamiltonian, x = drawn
    image = kahan_step(hamiltonian.system, fraction(eps), exact(*x))
    assume(image is not None)
    after = modified_value(hamiltonian, fraction(eps), image)
    assume(after is not None)
    assert after == modified_value(hamiltonian, fraction(eps), exact(*x))


# The paper's H~


@given(with_points(dims=(2, 4), homogeneous=True, standard=True), nonzero)
def test_modified_h_is_minus_one_sixth_of_the_papers_integral(drawn, eps):
    hamiltonian, x = drawn
    try:
        modified = ModifiedHamiltonian(hamiltonian).value(QQ, eps, x)
        paper = PaperIntegral(hamiltonian).value(QQ, eps, x)
    except SingularStep:
        assume(False)
    assert modified == paper / -6


@pytest.mark.parametrize(
    "hamiltonian",
    [
        HENON,
        hamiltonian_of("q p", "q^3 + p^2"),
        hamiltonian_of("q p", "q^3", [[0, 2], [-2, 0]]),
        hamiltonian_of("x y z", "x^3", [[0, 1, 0], [-1, 0, 0], [0, 0, 0]]),
    ],
    ids=["quadratic terms", "p^2", "J doubled", "odd dimension"],
)
def test_the_papers_integral_is_refused_for_inhomogeneous_h_and_other_j(hamiltonian):
    with pytest.raises(InputError, match="homogeneous H and the standard J only"):
        PaperIntegral(hamiltonian)


@pytest.mark.parametrize("power", [1, 2])
def test_an_integral_of_the_commutant_is_what_its_formula_says(power):
    member, eps = draw_with_chi(fmpq_poly([1, 1, 0, 1]), seed=3), fmpq(1, 7)
    x = tuple(fmpq(k, 3) for k in (1, -2, 4, 1, 5, -1))
    image = kahan_step(member.chosen.system, fraction(eps), exact(*x))
    assert image is not None
    matrix = rows_of(standard_structure(6))
    for _ in range(power):
        matrix = times(matrix, transposed(rows_of(member.A)))
    expected = dot(exact(*x), [dot(line, image) for line in matrix]) / fraction(eps)
    assert fraction(CommutantIntegral(member.chosen.hamiltonian, member.A, power).value(QQ, eps, x)) == expected


@pytest.mark.parametrize(("power", "matrix"), [(1, "A^T"), (2, "(A^T)^2")])
def test_an_integral_of_the_commutant_is_called_after_the_power(power, matrix):
    member = draw_with_eigenvalues([1, -2, 3], seed=3)
    integral = CommutantIntegral(member.chosen.hamiltonian, member.A, power)
    assert integral.name == f"H~_{power}"
    assert integral.formula == f"H~_{power} = eps^(-1) x^T J {matrix} x~"


# Claimed functions


@pytest.mark.parametrize("text", ["(x - 2*eps*y)/(1 - eps^2*x^2)", "3/7"])
@given(points(2, rationals(9)), nonzero)
def test_a_claimed_function_has_the_value_that_its_text_says(text, x, eps):
    function = claim(text, "x y")
    expected = function_value(function, exact(*x), fraction(eps))
    found = ClaimedIntegral("I", function).value(QQ, eps, x)
    assert (found is None) == (expected is None)
    assert expected is None or fraction(found) == expected


def test_a_claimed_function_is_shown_as_text_that_reads_back():
    integral = ClaimedIntegral("I", claim("(x^2 + 1/2)/(2 - eps)", "x y"))
    assert claim(integral.formula, "x y") == integral.function


# Fields and singular points


@over_exact_fields
@given(x=points(2, rationals(9)))
def test_over_a_prime_field_every_integral_is_its_rational_value_reduced(field, x):
    eps = fmpq(5, 11)
    for integral in (ModifiedHamiltonian(PLANE_CUBIC), PaperIntegral(PLANE_CUBIC)):
        try:
            value = integral.value(QQ, eps, x)
            reduced = integral.value(field, field.convert(eps), tuple(field.convert(entry) for entry in x))
        except (SingularStep, BadPrime):
            continue
        assert reduced == field.convert(value)


@pytest.mark.parametrize("kind", [ModifiedHamiltonian, PaperIntegral])
def test_a_singular_point_is_named_by_the_map_and_not_hidden(kind):
    # det(I - eps f') = 1 + eps^2 det Hess H = 1 - eps^2 for H = q p (q + p)/2 at (0, 1).
    hamiltonian = hamiltonian_of("q p", "q*p*(q + p)/2")
    with pytest.raises(SingularStep):
        kind(hamiltonian).value(QQ, fmpq(1), (fmpq(0), fmpq(1)))


def test_a_prime_that_divides_a_coefficient_is_refused():
    with pytest.raises(BadPrime):
        ClaimedIntegral("I", claim("x/7", "x y")).value(GF(7), GF(7).one, (GF(7).one, GF(7).one))


def test_names_and_formulas_tell_the_two_normalisations_apart():
    modified, paper = ModifiedHamiltonian(PLANE_CUBIC), PaperIntegral(PLANE_CUBIC, "K")
    assert modified.name == "modified H"
    assert modified.formula == "H + (2 eps/3) grad H^T (I - eps f')^(-1) f, f = J grad H"
    assert paper.name == "K~"
    assert paper.formula.startswith("K~ = eps^(-1) x^T J x^ = -6 (modified K), x^ the image")
