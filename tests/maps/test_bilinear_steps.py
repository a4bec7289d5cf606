"""Steps by bilinear forms along an orbit, against single steps by linear systems.

Specified here: every point is the one that single steps give, in lowest terms as well; forms are found where orbits lie
on elliptic curves and Abelian surfaces, and nowhere else; forms that are wrong cost time and nothing else.
"""

from math import prod

import pytest
from flint import fmpq, fmpz
from hypothesis import given, settings
from hypothesis import strategies as st

import kahanmaps.maps.orbits.relations.bilinear_steps as bilinear
from kahanmaps import GF, Orbit, load
from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.maps.explicit import explicit_map
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.integer_steps import IntegerSteps

START = tuple(fmpq(p, q) for p, q in ((1, 2), (-1, 3), (2, 5), (1, 1), (3, 4), (-2, 7)))


@pytest.fixture(autouse=True)
def early(monkeypatch):
    """Forms are looked for as soon as numbers grow slowly enough, and orbits here need not be long."""
    monkeypatch.setattr(bilinear, "_LONG", 20)
    monkeypatch.setattr(bilinear, "_LONGER_THAN_START", 0)


def over(name, eps="3/11"):
    return load(name).map.at(eps)


def single_steps(map_over, start, steps):
    points = [IntegerPoint.from_rationals(start)]
    for _ in range(steps):
        image = map_over.integer_step(points[-1])
        if image is None:
            break
        points.append(image)
    return points


def walked(map_over, start, steps):
    orbit = bilinear.RationalOrbit(map_over, IntegerPoint.from_rationals(start))
    return [point for point, _ in zip(orbit, range(steps + 1), strict=False)], orbit.since


@pytest.mark.parametrize(
    ("name", "steps", "lag", "has_bound"),
    [
        ("euler_top", 40, 1, True),
        ("volterra_periodic_4", 30, 1, True),  # in a hyperplane
        ("weierstrass", 60, 1, True),
        ("discrete_painleve_1", 60, 1, True),
        ("lagrange_top", 18, 1, False),
        ("three_wave", 18, 1, False),
        ("clebsch_first_flow", 16, 2, False),  # Abelian surfaces, one section more than coordinates
    ],
)
def test_points_are_those_of_single_steps_in_lowest_terms(name, steps, lag, has_bound):
    map_over = over(name)
    expected = single_steps(map_over, START[: map_over.dim], steps)
    points, since = walked(map_over, START[: map_over.dim], steps)
    assert points == expected
    assert since is not None
    assert since < steps
    forms = bilinear.bilinear_forms(map_over.factors[0].integer_steps, points[-1])
    assert forms is not None
    assert (forms.lag, forms.bound is not None) == (lag, has_bound)
    assert [forms.step(expected[k - 3 : k]) for k in range(3, steps + 1)] == expected[3:]  # of the whole orbit


small = st.fractions(min_value=-3, max_value=3, max_denominator=7).map(lambda x: fmpq(x.numerator, x.denominator))


@pytest.mark.parametrize("name", ["euler_top", "dressing_chain_3", "volterra_periodic_3", "planar_cubic_hamiltonian"])
@settings(max_examples=6)
@given(data=st.data())
def test_any_start_and_eps(name, data):
    map_over = over(name, data.draw(small.filter(bool), label="eps"))
    start = data.draw(st.tuples(*[small] * map_over.dim), label="start")
    assert walked(map_over, start, 25)[0] == single_steps(map_over, start, 25)


@pytest.mark.parametrize("name", ["lorenz", "henon_heiles", "kirchhoff_generic", "hietarinta_viallet"])
def test_there_are_no_forms_where_there_is_no_abelian_variety(name):
    map_over = over(name)
    start = IntegerPoint.from_rationals(START[: map_over.dim])
    assert bilinear.bilinear_forms(map_over.factors[0].integer_steps, start) is None


def test_factors_divide_the_bound():
    map_over = over("euler_top")
    points = single_steps(map_over, START[:3], 30)
    forms = bilinear.bilinear_forms(map_over.integer_steps, points[0])
    found = set()
    for behind, here, ahead in zip(points, points[1:], points[2:], strict=False):
        X = [*here.numerators, here.denominator]
        products = [X[i] * X[j] for i, j in forms.products]
        value = sum((c * x for c, x in zip(forms.coefficients.tolist()[-1], products, strict=True)), fmpz(0))
        factor = fmpq(value, ahead.denominator * behind.denominator)
        assert factor.q == 1
        assert forms.bound % factor.p == 0
        found.add(abs(factor.p))
    assert len(found) > 1  # so that there is something to bound


def test_wrong_forms_give_no_point_and_the_orbit_goes_on(monkeypatch):
    map_over = over("euler_top")
    expected = single_steps(map_over, START[:3], 25)
    right = bilinear.bilinear_forms(map_over.integer_steps, expected[0])
    for k in range(4):
        changed = bilinear.bilinear_forms(map_over.integer_steps, expected[0])
        changed.coefficients[k, 0] += 1
        assert changed.step(expected[10:13]) is None
        assert right.step(expected[10:13]) == expected[13]
    monkeypatch.setattr(bilinear, "bilinear_forms", lambda *_: changed)
    assert walked(map_over, START[:3], 25)[0] == expected


def test_points_are_in_lowest_terms_also_where_an_orbit_leaves_a_curve_for_one_step():
    # z -> z / (1 + z) is 1/Z, 1/(Z + 1), ..., and y is 0 but where Z + k is none of the zeros of p.
    field = ring(["z", "y", "u", "eps"])
    z, y, u, _ = field.gens()
    one, last, Z = field.constant(1), 32, fmpz(2) ** 360
    p = prod((1 - z * (Z + k) for k in range(last + 1) if k != last - 1), start=one)
    images = [RationalFunction(z, 1 + z), RationalFunction(p + u, one), RationalFunction(y * (1 - z * (Z + last)), one)]
    map_over = explicit_map(["z", "y", "u"], images).at(1)
    start = (fmpq(1, Z), fmpq(0), fmpq(0))
    points, since = walked(map_over, start, last + 3)
    assert points == single_steps(map_over, start, last + 3)
    assert since < last - 1
    assert any(point.numerators[1] for point in points)


@pytest.mark.parametrize("name", ["weierstrass", "planar_cubic_hamiltonian", "zander_111", "nahm_tetrahedral"])
def test_in_the_plane_forms_are_proved_once_and_no_image_is_put_into_the_equation(name, monkeypatch):
    map_over = over(name)
    expected = single_steps(map_over, START[:2], 60)
    monkeypatch.setattr(IntegerSteps, "is_image", lambda *_: pytest.fail("an image was put into the equation"))
    points, since = walked(map_over, START[:2], 60)
    assert points == expected
    assert since is not None


def test_forms_that_do_not_hold_everywhere_are_told_from_those_that_do():
    map_over, space = over("weierstrass"), over("euler_top")

    def holds_everywhere(found, equation):
        found.try_everywhere(equation)
        return found.holds_everywhere

    def forms(map_over):
        start = IntegerPoint.from_rationals(START[: map_over.dim])
        return bilinear.bilinear_forms(map_over.integer_steps, start)

    assert holds_everywhere(forms(map_over), map_over.equation)
    assert not holds_everywhere(forms(map_over), over("weierstrass", "1/5").equation)
    for k in range(9):
        changed = forms(map_over)
        changed.coefficients[k // 3, k % 3] += 1
        assert not holds_everywhere(changed, map_over.equation)
    assert not holds_everywhere(forms(space), space.equation)


def test_where_forms_hold_everywhere_a_point_behind_that_does_not_fit_does_no_harm():
    map_over = over("weierstrass")
    points = single_steps(map_over, START[:2], 30)
    forms = bilinear.bilinear_forms(map_over.integer_steps, points[0])
    forms.try_everywhere(map_over.equation)
    found = [forms.step([points[k - 2], points[k]]) for k in range(2, 30)]
    assert all(image in (None, points[k + 1]) for k, image in enumerate(found, 2))
    assert None in found


def test_where_forms_hold_everywhere_a_singular_point_has_no_image_all_the_same():
    map_over = over("weierstrass")
    forms = bilinear.bilinear_forms(map_over.integer_steps, IntegerPoint.from_rationals(START[:2]))
    forms.try_everywhere(map_over.equation)
    pole = IntegerPoint.from_rationals((fmpq(121, 108), fmpq(5)))  # where 1 - 108 x / 121 = 0
    assert map_over.integer_step(pole) is None
    assert forms.step([pole, IntegerPoint.from_rationals(START[:2]), pole]) is None


def test_an_orbit_ends_after_a_point_with_too_many_bits():
    start = IntegerPoint.from_rationals(START[:3])
    *within, beyond = bilinear.RationalOrbit(over("euler_top"), start, max_bits=400)
    assert max(point.bits for point in within) <= 400 < beyond.bits
    # Of several factors only the first was taken.
    assert len(list(bilinear.RationalOrbit(over("euler_top") ** 2, start, max_bits=400))) < len(within) + 1


def test_an_image_is_told_from_other_points_and_from_a_choice_of_many():
    map_over = over("lotka_volterra", 1)
    steps, point = map_over.integer_steps, IntegerPoint((fmpz(2), fmpz(5)), fmpz(3))
    image = map_over.integer_step(point)
    assert steps.is_image(point, image)
    assert not steps.is_image(point, IntegerPoint((image.numerators[0] + 1, image.numerators[1]), image.denominator))
    singular = over("riccati", "1/2").integer_steps
    pole = IntegerPoint((fmpz(1),), fmpz(2))
    assert singular.determinant(pole) == 0
    assert not singular.is_image(pole, pole)


@pytest.mark.parametrize("name", ["clebsch_first_flow", "discrete_painleve_1"])
def test_residues_are_those_of_the_map_over_the_field(name):
    p = 10_007
    map_over, modulo = over(name), load(name).map.at(fmpq(3, 11), GF(p))
    start = IntegerPoint.from_rationals(START[: map_over.dim])
    expected = [[int(entry) for entry in point.x] for point in Orbit(modulo, START[: map_over.dim], 9)]
    assert map_over.integer_steps.residues(start, p, 10) == [[*x, 1] for x in expected]
    assert map_over.integer_steps.residues(start, 2, 3) is None  # 2 divides the denominator


def test_orbits_tell_from_which_step_on(monkeypatch):
    asked = []
    monkeypatch.setattr(bilinear, "bilinear_forms", lambda steps, point: asked.append(point))
    assert walked(over("euler_top"), START[:3], 12)[1] is None
    monkeypatch.undo()
    monkeypatch.setattr(bilinear, "_LONG", 20)
    monkeypatch.setattr(bilinear, "_LONGER_THAN_START", 0)
    orbit = Orbit(over("euler_top"), START[:3], 12)
    assert orbit.bilinear_since is None
    points = [point.value for point in orbit]
    assert [points[orbit.bilinear_since - 1]] == asked  # once


def test_maps_of_several_factors_step_one_by_one():
    map_over = over("euler_top") ** 2
    points, since = walked(map_over, START[:3], 20)
    assert points == single_steps(map_over, START[:3], 20)
    assert since is None
