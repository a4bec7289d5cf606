"""Orbits and checks of maps over Q from points over a number field: exact, and the same in every field."""

import pytest
from flint import fmpq

import kahanmaps as km
from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.roots import AlgebraicPoint, parse_algebraic_point, parse_root
from kahanmaps.checks.claims import Certainty
from kahanmaps.maps.algebraic import over_number_field

I = parse_root("root of t^2 + 1")


def start_of(text, **roots):
    return parse_algebraic_point(text, {name: parse_root(root) for name, root in roots.items()}, {"c": fmpq(3)})


# The image of a point over Q(i) is a computation with pairs of rational numbers: here by hand, for x' = y, y' = -x.
def test_a_step_from_a_point_over_the_gaussian_numbers():
    map_ = over_number_field(km.System("x' = y; y' = -x").map, I)
    eps, i = fmpq(1, 2), I.number_field.generator
    image = map_.at(eps).step((1, i))
    scale = 1 + eps**2
    assert image == ((1 - eps**2) / scale + i * (2 * eps / scale), i * ((1 - eps**2) / scale) - 2 * eps / scale)


@pytest.mark.parametrize("name", ["euler_top", "paper_m2", "henon_heiles"])
def test_orbits_over_a_number_field_reduce_to_those_modulo_a_prime(name):
    file = km.load(name)
    root = parse_root("root of t^2 - 2")
    field = GF(2**61 - 1)
    point = AlgebraicPoint(root, start_of(",".join(["t"] + ["1"] * (file.dim - 1)), t="root of t^2 - 2").entries)
    map_ = over_number_field(file.map, root)
    exact = list(km.orbit(map_, point.over(root.number_field), "1/3", 3))
    modular = list(km.orbit(map_, point.over(field), "1/3", 3, arithmetic=f"mod:{2**61 - 1}"))
    at_root = root.over(field)
    for item, other in zip(exact, modular, strict=True):
        values = [sum(field.convert(c) * at_root**k for k, c in enumerate(entry.coefficients)) for entry in item.x]
        assert [int(value) for value in values] == [int(entry) for entry in other.x]


def test_a_check_tries_its_claims_along_such_an_orbit():
    start = start_of("1,t,1", t="root of t^2 + 1").over(I.number_field)
    settings = km.Settings(eps="1/3", start=start, steps=3)
    held, *_, refuted = km.check_integrals(km.load("euler_top"), settings, {"F1": "F1", "B": "x1*x2"}).findings
    assert (held.verdict, refuted.verdict) == (Certainty.PROVED, Certainty.REFUTED)
    assert "held exactly at 4 points of an orbit" in held.also[-1].summary
    assert "fails at step 0 of an exact orbit" in refuted.also[-1].summary
