"""The planes of a normal form over Q, over prime fields and over real balls.

Specified here: one step in every plane is the step of the Kahan map, in every field, split or not, and also where J is
not the standard one; a prime at which chi has a repeated root is refused.
"""

import pytest
from helpers import random_point, step_or_none
from planar_helpers import over_members, structure_and_system

from kahanmaps.algebra.fields import GF, QQ, RR
from kahanmaps.errors import BadPrime, SingularStep
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.normal_form.splitting import Splitting

FIELDS = [QQ, GF(11), GF(2**61 - 1), GF(2**89 - 1), RR(128)]
over_fields = pytest.mark.parametrize("field", FIELDS, ids=repr)


def splitting_of(name, field, eps="1/10"):
    normal_form, system = structure_and_system(name)
    return Splitting(normal_form.form, field, eps, normal_form.T), system


def same(field, left, right) -> bool:
    with field.working():
        return all(field.equal(a, b) for a, b in zip(left, right, strict=True))


@over_members
@over_fields
def test_a_step_in_every_plane_is_a_step_of_the_kahan_map(name, field):
    splitting, system = splitting_of(name, field)
    phi, stepped = KahanMap(system, "1/10", field), 0
    for seed in range(4):
        x = tuple(map(field.convert, random_point(splitting.dim, seed)))
        expected = step_or_none(phi, x)
        with field.working():
            images = [plane.block.image(P) for plane, P in zip(splitting.planes, splitting.triples(x), strict=True)]
        if expected is None:
            with pytest.raises(SingularStep):
                splitting.point(images)
        else:
            assert same(field, splitting.point(images), expected)
            stepped += 1
    assert stepped > 0


@pytest.mark.parametrize(
    ("name", "field", "degrees"),
    [
        ("m = 2, sqrt 2", QQ, [2]),
        ("m = 2, sqrt 2", GF(7), [1, 1]),  # 3^2 = 2 modulo 7
        ("m = 2, sqrt 2", GF(11), [2]),
        ("m = 2, sqrt 2", RR(64), [1, 1]),
        ("m = 2, i", RR(64), [2]),
        ("m = 2, i", GF(13), [1, 1]),
        ("m = 3, partly split", QQ, [1, 2]),
        ("m = 3, partly split", RR(64), [1, 2]),
        ("m = 3, a cubic field", QQ, [3]),
        ("m = 3, a cubic field", GF(5), [1, 2]),
        ("m = 3, a cubic field", GF(3), [3]),
        ("m = 3", RR(64), [1, 1, 1]),
    ],
    ids=str,
)
def test_planes_are_the_factors_of_chi_in_the_field(name, field, degrees):
    splitting, _ = splitting_of(name, field, 1)
    assert sorted(plane.degree for plane in splitting.planes) == degrees


@pytest.mark.parametrize(
    ("name", "prime"), [("m = 2, sqrt 2", 2), ("m = 2, i", 2), ("m = 3", 2), ("m = 3, a cubic field", 23)]
)
def test_a_prime_at_which_chi_has_a_repeated_root_is_refused(name, prime):
    with pytest.raises(BadPrime):
        splitting_of(name, GF(prime), 1)
