"""Confinement: the integrable systems of the catalogue against those of maximal degree, and series against points.

Contracted hypersurfaces are told apart over GF(p) by factors on surfaces, and named for every eps: over Q[eps], by
polynomials that are those at the eps followed.
"""

import random
from itertools import islice

import pytest
from check_helpers import system_of
from flint import fmpq, nmod_poly

from kahanmaps import GF, QQ, KahanMap, TimeLimit, degree_growth, load, parse_polynomial, parse_system
from kahanmaps.algebra.polynomials import evaluate, ring
from kahanmaps.algebra.work import Budget, counted
from kahanmaps.laboratory.singular import outcomes
from kahanmaps.laboratory.singular.exceptional import components
from kahanmaps.laboratory.singular.jets import image_of, images_of_curve
from kahanmaps.laboratory.singular.outcomes import BUDGET_SPENT, NOT_CONFINED, critical_points
from kahanmaps.laboratory.singular.singularities import default_eps, singularities
from kahanmaps.laboratory.singular.written import with_eps
from kahanmaps.maps.projective import homogeneous_map

PRIME = 2**61 - 1


def runs(name: str, **options):
    system = load(name).system
    return [singularities(system, eps, **options) for eps in default_eps(system, 0)]


@pytest.mark.parametrize("name", ["weierstrass", "planar_cubic_hamiltonian", "volterra_periodic_4", "paper_m2"])
def test_singularities_of_integrable_maps_are_confined(name):
    """zander-2021 for the planar systems; the others have integrals, and degrees that grow polynomially."""
    result = runs(name)
    assert [run.verdict for run in result] == ["confined", "confined"]
    assert result[0].shape == result[1].shape


@pytest.mark.parametrize("name", ["lotka_volterra", "lorenz"])
def test_nothing_is_confined_where_degrees_are_the_largest_possible(name):
    """The degrees 2^n and 3^n say that no contracted hypersurface ever meets an indeterminacy point."""
    for run in runs(name, steps=60):
        assert run.verdict == "not confined"
        assert {h.status for h in run.hypersurfaces} == {NOT_CONFINED}
        assert all(step.common == 0 for h in run.hypersurfaces for step in h.steps)


def test_the_degrees_of_the_critical_locus_add_up():
    """The Jacobian determinant of n + 1 forms of degree d has degree (n + 1)(d - 1)."""
    for name in ("weierstrass", "lotka_volterra", "lorenz", "henon_heiles", "euler_top"):
        for run in runs(name, steps=1):
            assert run.critical_degree == (load(name).system.dim + 1) * (run.map_degree - 1)
            assert sum(h.degree * (h.multiplicity or 0) for h in run.hypersurfaces) == run.critical_degree


@pytest.mark.parametrize("name", ["euler_top", "weierstrass", "lotka_volterra"])
def test_random_points_tell_what_polynomials_do(name, monkeypatch):
    system = load(name).system
    written = singularities(system, "4/13")
    monkeypatch.setattr("kahanmaps.laboratory.singular.written._MAX_TERMS", 0)
    unwritten = singularities(system, "4/13")
    assert unwritten.verdict == written.verdict

    def outcomes(run):
        return {
            (h.multiplicity, h.status, h.contracted_at, h.confined_at, tuple(step.rank for step in h.steps))
            for h in run.hypersurfaces
            if not h.divides_denominator and h.polynomial != "Z"
        }

    assert outcomes(unwritten) == outcomes(written)
    assert {h.polynomial for h in unwritten.hypersurfaces if h.divides_denominator} == {
        h.polynomial for h in written.hypersurfaces if h.divides_denominator
    }
    degrees = sum(h.degree for h in unwritten.hypersurfaces if h.polynomial == "?")
    assert degrees == sum(h.degree for h in written.hypersurfaces if not h.divides_denominator and h.polynomial != "Z")


def test_a_budget_that_is_spent_stops_it():
    top, before = load("euler_top").system, counted()
    complete = singularities(top, "1/7")
    run = singularities(top, "1/7", effort=Budget((counted() - before) / 2))
    assert (run.is_stopped, run.verdict) == (True, "undecided")
    assert run.hypersurfaces[0] == complete.hypersurfaces[0]
    assert run.hypersurfaces[-1].note == BUDGET_SPENT


def test_a_time_limit_keeps_the_hypersurfaces_that_were_followed():
    top, complete = load("euler_top").system, singularities(load("euler_top").system, "1/7")

    def stop(sentence):
        if sentence == f"following {complete.hypersurfaces[1].polynomial[:40]}":
            raise TimeLimit("the time limit of 1 s is over")

    run = singularities(top, "1/7", progress=stop)
    assert (run.is_stopped, run.hypersurfaces) == (True, complete.hypersurfaces[:1])
    with pytest.raises(TimeLimit):  # a stage of something else, which ends as well
        singularities(top, "1/7", effort=Budget(1e9), progress=stop)


def power_of(number: fmpq, prime: int) -> int | None:
    """The exponent of the prime in a rational number, None for 0."""
    power = 0
    while number and number.p % prime == 0:
        number, power = number / prime, power + 1
    while number.q % prime == 0:
        number, power = number * prime, power - 1
    return power if number else None


@pytest.mark.parametrize(
    ("name", "eps", "point", "steps"),
    [("weierstrass", "1/2", ("1/3", 5), 6), ("lorenz", "1/7", (3, 5, 7), 3), ("riccati", "1/2", (2,), 2)],
)
def test_a_series_divides_as_rational_numbers_at_a_large_prime_do(name, eps, point, steps):
    """With t = p the curve is one rational point, which exact arithmetic carries on: its powers of p are those of t."""
    system, field = load(name).system, GF(PRIME)
    start, direction = [*map(fmpq, point), fmpq(1)], [*range(1, system.dim + 1), 0]
    X = [x + PRIME * v for x, v in zip(start, direction, strict=True)]
    forms = homogeneous_map(KahanMap(system, eps, QQ)).forms
    residues = [int(field.convert(x)) for x in start]
    curve = images_of_curve([KahanMap(system, eps, field).equation], residues, direction, 32, [])
    for step in islice(curve, steps):
        image = [form(*X) for form in forms]
        powers = [power_of(entry, PRIME) for entry in image]
        common = min(power for power in powers if power is not None)
        X = [entry / fmpq(PRIME) ** common for entry in image]
        pole = None if powers[-1] is None else powers[-1] - common
        assert (step.common, step.pole, step.denominator) == (common, pole, powers[-1])
        limit = [int(field.convert(x)) for x in X]
        assert any(step.limit)
        assert [a * limit[0] % PRIME for a in step.limit] == [b * step.limit[0] % PRIME for b in limit]


def test_a_point_has_the_image_of_the_map_and_none_where_all_minors_vanish():
    system = load("lorenz").system
    image = image_of([KahanMap(system, "1/7", GF(PRIME)).equation], [3, 5, 7, 1])
    inverse = pow(image[-1], -1, PRIME)
    expected = KahanMap(system, "1/7", GF(PRIME)).step([GF(PRIME).convert(c) for c in (3, 5, 7)])
    assert [c * inverse % PRIME for c in image[:-1]] == [int(c) for c in expected]
    # x' = x^2, y' = x y at eps = 1: x (Z - x) : y (Z - x) : (Z - 2 x) (Z - x), 0 on a line where curves have images
    special = KahanMap(system_of("x y", "x^2", "x*y"), 1, GF(PRIME)).equation
    assert [image_of([special], [1, y, 1]) for y in (0, 5)] == [None, None]
    assert image_of([special], [0, 5, 1]) is not None


@pytest.mark.parametrize("name", ["euler_top", "volterra_periodic_4"])
def test_steps_by_elimination_are_those_by_minors(name, monkeypatch):
    rng, field = random.Random(name), GF(PRIME)
    here = load(name).map.at(fmpq(3, 11), field)
    for critical in (
        critical_points(here.equations, None, rng)[0] + critical_points(here.equations, here.inverse.equations, rng)[0]
    ):
        tangents = outcomes._tangent_vectors(critical.point, critical.gradient, field)
        direction = [rng.randrange(PRIME) for _ in critical.point]
        for moved in (tangents, ()):
            messages = []
            for dimension in (1, 100):
                monkeypatch.setattr("kahanmaps.laboratory.singular.jets._MIN_ELIMINATION_DIMENSION", dimension)
                steps = islice(images_of_curve(here.equations, critical.point, direction, 30, moved), 6)
                messages.append([(step.common, step.pole, step.denominator, step.rank) for step in steps])
            assert messages[0] == messages[1]


@pytest.mark.parametrize("name", ["riccati", "lorenz", "volterra_periodic_5"])
def test_the_denominator_is_that_determinant_in_every_dimension(name):
    system = load(name).system
    point = [fmpq(2 * k + 1, k + 2) for k in range(system.dim)]
    denominator = parse_polynomial(singularities(system, "1/7", steps=1).denominator, system.variables)
    assert evaluate(denominator, QQ, point) == KahanMap(system, "1/7").determinant(point)


@pytest.mark.parametrize(("p", "degrees"), [(1000033, [1, 1, 2]), (1000003, [2, 2])])
def test_a_form_splits_modulo_primes_with_a_root_of_minus_one(p, degrees):
    x1, x2, x3, z = ring(["x1", "x2", "x3", "z"]).gens()
    form, curve = (x1**2 + x2**2) * (x1 * x3 + z**2) ** 3, [nmod_poly([k, k + 1], p) for k in (1, 3, 5, 7)]
    equation = load("euler_top").map.at(1, GF(p)).equations[0]
    some = components(equation, [(form, False)], curve, (31, 41, 59, 26))
    assert sorted(entry.degree for entry in some) == degrees
    assert sorted(entry.exponents for entry in some if entry.degree == 1) == [(1,)] * degrees.count(1)
    assert (3,) in [entry.exponents for entry in some]
    assert all(entry.order == 0 for entry in some)


def conics(*signs):
    """What the map of the Euler top contracts, with these signs; that of its inverse at -eps."""
    return {
        f"2*x1^2*eps^2 + x2^2*eps^2 {first} 4*x1*x3*eps^2 + 2*x3^2*eps^2 {second} 2*x2*eps + 1"
        for first, second in signs
    }


def contracted(map_, eps):
    return [h for h in singularities(map_, eps).hypersurfaces if h.multiplicity]


def test_names_by_hand():
    """1 - 12 eps^2 x is det(I - eps f') of weierstrass; the conics of the Euler top go over into each other."""
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
