"""Inverse maps by elimination: they lead back, and maps that have none are told from those that have one."""

import pytest
from flint import fmpq
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.maps.explicit import explicit_map
from kahanmaps.maps.inverse import NotBirational, inverse_rows, why_not_birational


def made(variables, *image):
    names = [*variables.split(), "eps"]
    return explicit_map(names[:-1], [parse_rational_function(text, names) for text in image])


BIRATIONAL = [
    made("x y", "y", "-x + y^2 + eps"),
    made("x y", "x^2/y", "x/y"),
    made("x y", "(x^2 + y^2)/x", "y*(x^2 + y^2)/x^2"),  # no equation is linear in an unknown: resultants
    made("x y", "eps*x/(x^2 + y^2)", "y/(x^2 + y^2)"),
    made("x y z", "x + eps*(y + x*z)^2", "y + x*z", "z + x^2"),
    made("x y z", "x + y^2", "y + z^2", "z + (x + y^2)^2"),
    made("x y z w", "y", "z", "w", "(z*x + y*w + 1)/(x*y + z)"),
    # FLINT's Python cannot order the factors here modulo primes of 63 bits
    made("x y", "(x*y + 1)/(x + y)", "(x*y^2 - x*y - y^2 + y)/(4*x + 4*y)"),
]


@pytest.mark.parametrize("map_", BIRATIONAL, ids=str)
@given(data=st.data())
def test_the_inverse_leads_back_from_both_sides(map_, data):
    start = [fmpq(data.draw(st.integers(2, 30)), data.draw(st.integers(1, 9))) for _ in range(map_.dim)]
    eps = fmpq(data.draw(st.integers(1, 9)), 7)
    over = map_.at(eps)
    if over.determinant(start) == 0:
        return
    image = over.step(start)
    if over.inverse.determinant(image) != 0:
        assert over.inverse.step(image) == tuple(start)
    assert why_not_birational(map_.rows) == ""


@pytest.mark.parametrize(
    ("map_", "sentence"),
    [
        (made("x y", "x^2", "y"), "at least 2 preimages"),
        (made("x y", "x*y", "x + y"), "at least 2 preimages"),
        (made("x y", "x*(x + y)/(x - y + 1)", "y*(x + y)/(x - y + 1)"), "at least 2 preimages"),
        (made("x y", "x^3 + y", "y^3 + x"), "at least 9 preimages"),
        (made("x y z", "x^2 + y", "y^2 + z", "z^2 + eps*x"), "at least 8 preimages"),
        (made("x y", "x + y", "(x + y)^2"), "not dominant"),
        (made("x y", "1", "y"), "not dominant"),
        (made("x y", "x + y", "x + y"), "not dominant"),
    ],
    ids=str,
)
def test_a_map_that_is_not_birational_is_found_out(map_, sentence):
    assert sentence in why_not_birational(map_.rows)
    with pytest.raises(NotBirational, match=sentence):
        inverse_rows(map_.rows)
