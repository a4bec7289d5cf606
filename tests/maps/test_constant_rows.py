"""Rows of the equation that do not depend on x are taken out: the steps are those of fractions solved entry by entry.

Specified here for Kahan maps some of whose equations are linear, in every place; at poles, at huge and tiny eps, and
where the rows themselves are dependent.
"""

from __future__ import annotations

import pytest
from flint import fmpq, fmpq_mat, fmpz, fmpz_mat
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.documents.catalog import load
from kahanmaps.errors import SingularStep
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.orbits.constant_rows import ConstantRows
from kahanmaps.maps.orbits.integer_steps import IntegerPoint
from kahanmaps.systems.quadratic import QuadraticSystem

NAMES = ["x", "y", "z", "w"]
LINEAR = ["y", "x + 2*y - w", "3*z + 1", "0", "x - y + z - w"]
QUADRATIC = ["x*y - z^2", "w^2 + x", "x*z - 2*y*w + 1", "y^2 - y"]
small = st.fractions(-5, 5, max_denominator=7).map(lambda q: fmpq(q.numerator, q.denominator))


@st.composite
def partly_linear(draw) -> QuadraticSystem:
    """Systems of dimension 4, one to four of whose equations are linear, in any order."""
    count = draw(st.integers(1, 4))
    lines = [draw(st.sampled_from(LINEAR)) for _ in range(count)]
    lines += [draw(st.sampled_from(QUADRATIC)) for _ in range(4 - count)]
    return QuadraticSystem.from_text(NAMES, draw(st.permutations(lines)))


@given(system=partly_linear(), eps=small, x=st.tuples(small, small, small, small))
def test_a_step_is_that_of_fractions_and_a_pole_is_one(system, eps, x):
    assume(eps != 0)
    over = KahanMap(system, eps)
    image = over.integer_steps.step(IntegerPoint.from_rationals(x))
    try:
        expected = over.generic_step(x)
    except SingularStep:
        assert image is None
    else:
        assert image == IntegerPoint.from_rationals(expected)


@pytest.mark.parametrize("eps", ["3/11", "1000000007", "1/1000000007"])
@pytest.mark.parametrize("name", ["henon_heiles", "lagrange_top", "kirchhoff_case", "duffing_polarised"])
def test_orbits_of_the_catalogue_are_those_of_fractions(name, eps):
    over = load(name).map.at(eps)
    assert over.integer_steps._constant is not None
    x = tuple(fmpq(i + 1, i + 2) for i in range(over.dim))
    for _ in range(4):
        image = over.generic_step(x)
        assert over.integer_steps.step(IntegerPoint.from_rationals(x)) == IntegerPoint.from_rationals(image)
        x = image


@pytest.mark.parametrize("name", ["clebsch_first_flow", "euler_top", "weierstrass"])
def test_nothing_is_taken_out_where_there_is_nothing_or_where_minors_are_quicker(name):
    assert load(name).map.at("3/11").integer_steps._constant is None


def test_dependent_rows_leave_no_value_anywhere():
    singular = KahanMap(QuadraticSystem.from_text(NAMES, ["x", "y^2", "x*z", "w"]), 1)
    assert singular.integer_steps.step(IntegerPoint.from_rationals((fmpq(1),) * 4)) is None


def test_the_solution_of_what_is_left_gives_that_of_the_whole():
    matrix, right = fmpz_mat([[2, 4, 6], [1, 5, 7], [3, 1, 2]]), fmpz_mat([[5], [-1], [4]])
    rows = ConstantRows([0], fmpq_mat([[1, 2, 3]]))  # the first row is 2 times it
    rest, side = rows.without(matrix, right, fmpz(2))
    found, below = fmpq_mat(rest).solve(fmpq_mat(side)).numer_denom()
    numerators, denominator = rows.whole(right, fmpz(2), found.entries(), below)
    assert [fmpq(entry, denominator) for entry in numerators] == matrix.solve(right).entries()
