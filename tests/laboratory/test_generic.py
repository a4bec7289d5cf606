"""Contracted hypersurfaces are named for every eps: over Q[eps], by polynomials that are those at the eps followed."""

import pytest
from flint import fmpq

from kahanmaps.algebra.parsing import parse_polynomial
from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import parse_system
from kahanmaps.laboratory.growth.degrees import degree_growth
from kahanmaps.laboratory.singular.singularities import singularities
from kahanmaps.laboratory.singular.written import with_eps


def conics(*signs):
    """What the map of the Euler top contracts, with these signs; that of its inverse at -eps."""
    return {
        f"2*x1^2*eps^2 + x2^2*eps^2 {first} 4*x1*x3*eps^2 + 2*x3^2*eps^2 {second} 2*x2*eps + 1"
        for first, second in signs
    }


def contracted(map_, eps):
    return [h for h in singularities(map_, eps).hypersurfaces if h.multiplicity]


def test_names_by_hand():
    """Weierstrass: 1 - 12 eps^2 x is det(I - eps f'); the two conics of the Euler top go over into each other."""
    weierstrass = load("weierstrass").map
    (pole,) = (h for h in with_eps(weierstrass, fmpq(1, 7), contracted(weierstrass, "1/7")) if h.divides_denominator)
    assert pole.generic == "12*x*eps^2 - 1"
    growth = degree_growth(load("euler_top").map)
    assert {h.generic for h in growth.patterns.exceptional} == conics("-+", "+-")
    assert not any("at eps" in sentence for sentence in growth.patterns.sentences)


@pytest.mark.parametrize("name", ["zhukovski_volterra_2", "volterra_periodic_4"])
def test_at_the_eps_they_are_what_was_followed(name):
    map_, eps = load(name).map, fmpq(3, 13)
    for h in with_eps(map_, eps, contracted(map_, eps)):
        if h.polynomial == "Z":
            assert h.generic == ""
            continue
        value = parse_polynomial(h.generic, (*map_.variables, "eps")).subs({"eps": eps})
        expected = parse_polynomial(h.polynomial, (*map_.variables, "eps"))
        assert value * expected.leading_coefficient() == expected * value.leading_coefficient()


def test_at_another_eps_nothing_is_named():
    """Negative control: the polynomials of one eps are not those of another."""
    map_ = load("euler_top").map
    assert [h.generic for h in with_eps(map_, fmpq(1, 5), contracted(map_, "1/7"))] == ["", ""]


def test_of_a_composition_of_powers_those_of_its_maps_are_named():
    map_ = parse_system('[composition]\nof = [{ system = "euler_top", power = 2, inverse = true }]').map
    assert {h.generic for h in degree_growth(map_, max_terms=1).patterns.exceptional} == conics("--", "++")
