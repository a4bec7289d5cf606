"""Maps made in Python, at every eps or at one, are taken wherever a system is."""

import pickle

import pytest
from helpers import refuses

import kahanmaps as km
from kahanmaps.documents.inline import as_file
from kahanmaps.maps.kahan import as_map

FISH = "q' = p; p' = q^2 - q"
LYNESS = km.explicit_map(["x", "y"], ["y", "(1 + y)/x"])
SHEAR = km.explicit_map(["q", "p"], ["q + eps*p^2", "p"], ["q - eps*p^2", "p"])
BILINEAR = [
    km.parse_polynomial(text, ["x", "y", "X", "Y", "eps"]) for text in ("X - x - eps*(x*Y + y*X)", "Y - y - eps")
]


def kahan(system=FISH):
    return km.KahanFamily(km.System(system).system)


MAPS = {
    "Kahan": kahan(),
    "Kahan, eps in the coefficients": km.System("q' = p + eps*q^2; p' = q^2 - q").map,
    "explicit": LYNESS,
    "explicit, with its inverse": SHEAR,
    "bilinear": km.bilinear_map(["x", "y"], BILINEAR),
    "composed": km.composed_map(SHEAR, (kahan(), -1)),
    "algebraic": km.System("x' = a*x^2 + y; y' = x", a="sqrt(2)").map,
    "Kahan at one eps": kahan().at("1/10"),
    "power": kahan().at("1/10") ** 2,
    "inverse": kahan().at("1/10").inverse,
    "two eps": kahan().at("1/10") @ kahan("q' = p; p' = q").at("1/7"),
    "explicit at one eps": LYNESS.at(1) ** -1,
}


@pytest.mark.parametrize("map_", MAPS.values(), ids=MAPS)
def test_the_file_of_a_map_has_its_values_and_is_pickled(map_):
    file, at_eps = as_file(map_), map_ if hasattr(map_, "field") else map_.at("1/7")
    other = pickle.loads(pickle.dumps(file))
    assert other == file
    assert file.map.has_eps == (not hasattr(map_, "field") and map_.has_eps)
    for each in (file.map, as_map(map_), other.map):
        again, x = each.at("1/7"), [2, "1/3"]
        assert again.step(x) == at_eps.step(x) != tuple(at_eps.point(x))
        assert again.inverse.step(again.step(x)) == at_eps.point(x)


def test_searches_checks_and_certificates_take_a_map_at_one_eps():
    phi = km.map(FISH, "1/10")
    [found] = km.find_integrals(phi)
    [integral] = km.find_integrals(FISH)
    assert km.check_integrals(phi, found).holds
    assert km.check_integrals(FISH, found, eps="1/10").holds
    assert km.check_integrals(FISH, found, eps="1/9").holds is False
    assert km.check_integrals(phi, integral).holds is False  # which is for all eps
    assert km.check_integrals(phi**2, found).holds
    assert km.analyze(phi, effort=0).integrable is True
    assert km.find_density(phi)[0].verdict == "proved"
    assert km.degrees(km.map("harmonic", "1/10") ** 2).proof.reason == "the map is linear on projective space"
    assert km.check_commute(phi, phi @ phi).holds
    assert km.check_commute(phi, km.map("q' = q; p' = p", "1/10")).holds is False
    assert "~" in km.certificate(LYNESS, "sympy", integrals="(x + 1)*(y + 1)*(x + y + 1)/(x*y)")


def test_a_composition_of_maps_with_constant_denominators_is_expanded():
    image = km.load("qrt_asymmetric").map.image
    assert [f.names for f in image] == [("x", "y", "eps")] * 2


def test_what_is_no_map_over_the_rationals_or_no_vector_field_is_refused_in_words():
    refuses("expected a map over the rational numbers", km.find_integrals, kahan().at(1, km.GF(101)))
    symbolic = km.explicit_map(["x"], [km.parse_rational_function("x + a*eps", ["x", "a", "eps"])])
    refuses("a map with the symbols a, expected numbers", km.analyze, symbolic)
    refuses("if it is a Kahan map, give its system x' = f", km.find_symmetry, kahan().at("1/10"))
    refuses("not dominant", km.degrees, km.explicit_map(["x", "y"], ["x", "x"]).at(1))
