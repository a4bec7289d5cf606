"""Steps by relations along an orbit, Somos sequences or bilinear forms, against single steps by linear systems.

On curves that are made up sections of every degree are found from coordinates that are some of them.
"""

import random
from io import StringIO
from math import prod

import pytest
from flint import fmpq, fmpq_mat, fmpz, nmod
from hypothesis import given, settings
from hypothesis import strategies as st

import kahanmaps.maps.orbits.relations.bilinear_steps as bilinear
import kahanmaps.maps.orbits.relations.elliptic_orbit as elliptic
import kahanmaps.maps.orbits.relations.elliptic_search as search
import kahanmaps.maps.orbits.relations.elliptic_steps as elliptic_steps
import kahanmaps.maps.orbits.relations.rational_orbit as rational_orbit
from kahanmaps import Orbit, load, orbit
from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.maps.explicit import explicit_map
from kahanmaps.maps.orbits.integer_point import IntegerPoint, lowest
from kahanmaps.maps.orbits.relations.bilinear_steps import bilinear_forms
from kahanmaps.maps.orbits.relations.sections import _sections_of_multiples, forms
from kahanmaps.maps.somos import Integers, Terms, around, first_terms

BITS = 10_000
small = st.fractions(min_value=-3, max_value=3, max_denominator=7).map(lambda x: fmpq(x.numerator, x.denominator))


START = tuple(fmpq(p, q) for p, q in ((1, 2), (-1, 3), (2, 5), (1, 1), (3, 4), (-2, 7)))


def over(name, eps="3/11"):
    return load(name).map.at(eps)


def begin(map_over):
    """A start without special properties."""
    return IntegerPoint.from_rationals(START[: map_over.dim])


def single_steps(map_over, start, steps):
    """The points of an orbit, by one linear system each, as far as there are any."""
    points = [start]
    while len(points) <= steps and (image := map_over.integer_step(points[-1])) is not None:
        points.append(image)
    return points


def walked(map_over, start, steps):
    """The points as orbits have them, and the orbit."""
    orbit = rational_orbit.RationalOrbit(map_over, start)
    return [point for point, _ in zip(orbit, range(steps + 1), strict=False)], orbit


@pytest.fixture(autouse=True)
def early(monkeypatch):
    """Sequences are searched for as soon as numbers grow slowly enough, and orbits here need not be long."""
    monkeypatch.setattr(rational_orbit, "_MIN_BITS", 20)
    monkeypatch.setattr(rational_orbit, "_MIN_BITS_BY_COORDINATES", 3)
    monkeypatch.setattr(rational_orbit, "_LONGER_THAN_START", 0)
    monkeypatch.setattr(bilinear, "bilinear_forms", lambda *_: None)
    monkeypatch.setattr(elliptic, "_BITS_PER_PRIME", 1)


@pytest.fixture
def no_curves(monkeypatch):
    monkeypatch.setattr(elliptic, "elliptic_steps", lambda *_: None)
    monkeypatch.setattr(bilinear, "bilinear_forms", bilinear_forms)


# Origin of the degrees: orbits of Kahan's discretization in the plane lie on cubics, those of the Euler top on
# intersections of two quadrics, those of QRT maps on curves of degree (2, 2), in each coordinate a double cover.
@pytest.mark.parametrize(
    ("name", "stride", "degrees"),
    [
        ("weierstrass", 1, [3]),
        ("nahm_tetrahedral", 1, [3]),
        ("zander_111", 1, [3]),
        ("planar_cubic_hamiltonian", 1, [3]),
        ("euler_top", 1, [4]),
        ("zhukovski_volterra_1", 1, [4]),
        ("dressing_chain_3", 1, [3]),  # a Casimir function: in a plane
        ("volterra_periodic_4", 1, [4]),  # likewise
        ("repaired_octahedral", 1, [4]),  # one section is no coordinate
        ("mcmillan", 1, [2]),
        ("lyness", 1, [2]),
        ("discrete_painleve_1", 1, [2]),
        ("todd", 2, [2, 2]),  # on two curves in turn
        ("qrt_asymmetric", 2, [2, 2]),  # two factors, each with one new coordinate
        ("hky", 4, [2, 2, 2, 2]),
        ("repaired_icosahedral", 1, [6]),  # three are none
    ],
)
def test_points_are_those_of_single_steps_in_lowest_terms(name, stride, degrees):
    map_over = over(name)
    expected = single_steps(map_over, begin(map_over), 60)
    points, orbit = walked(map_over, expected[0], 60)
    assert points == expected
    assert orbit.relations is not None
    search = elliptic._Search(map_over.factors, expected[0], stride)
    assert search.numbers() is not None
    assert [search.sections[place].degree for place in search.new_groups] == degrees


@pytest.mark.parametrize("name", ["euler_top", "planar_cubic_hamiltonian", "todd", "mcmillan"])
@settings(max_examples=4)
@given(data=st.data())
def test_any_start_and_eps(name, data):
    map_over = over(name, data.draw(small.filter(bool), label="eps"))
    start = IntegerPoint.from_rationals(data.draw(st.tuples(*[small] * map_over.dim), label="start"))
    assert walked(map_over, start, 30)[0] == single_steps(map_over, start, 30)


@pytest.mark.parametrize(
    "name", ["lorenz", "lotka_volterra", "hietarinta_viallet", "clebsch_first_flow", "duffing_polarised", "fibonacci"]
)
def test_there_are_none_where_there_is_no_curve(name):
    map_over = over(name)
    assert elliptic.elliptic_steps(map_over, begin(map_over), BITS) is None


def test_compositions_and_inverses_move_points_of_a_curve_as_well():
    map_over = over("weierstrass")
    for changed in (map_over**2, map_over.inverse, over("lyness").inverse):
        expected = single_steps(changed, begin(changed), 30)
        points, orbit = walked(changed, expected[0], 30)
        assert points == expected
        assert orbit.relations is not None


def sequences(name, stride=None):
    map_over = over(name)
    search = elliptic._Search(map_over.factors, begin(map_over), stride or len(map_over.factors))
    return map_over, search, search.numbers()


@pytest.mark.parametrize("name", ["weierstrass", "qrt_asymmetric"])
def test_a_wrong_number_is_refuted(name):
    map_over, search, numbers = sequences(name)
    start = begin(map_over)
    assert elliptic._is_proved(start, search, elliptic._ExactCurves(search, numbers).steps(map_over))
    for place, entry in numbers.items():
        coefficients = list(entry.coefficients)
        coefficients[0] += 1
        for changed in (
            entry._replace(H=entry.H + 1),
            entry._replace(y=entry.y + 1),
            entry._replace(z=-entry.z),
            entry._replace(coefficients=tuple(coefficients)),
        ):
            wrong = {**numbers, place: changed}
            try:
                steps = elliptic._ExactCurves(search, wrong).steps(map_over)
            except ArithmeticError:  # for instance that two curves differ
                continue
            assert not elliptic._is_proved(start, search, steps)


@pytest.mark.parametrize(
    ("name", "stride", "last"),
    [("weierstrass", 1, 11), ("mcmillan", 1, 15), ("qrt_asymmetric", 2, 38), ("todd", 2, 36)],
)
def test_forms_have_to_agree_at_more_steps_than_the_degree(name, stride, last):
    # The equation is of degree 3 + 3 for cubics; 2 * 2 + 2, for the new coordinate in the old ones, and 2 for a double
    # cover: one step more has to agree, after the first ones that are compared.
    map_over, search, numbers = sequences(name, stride)
    steps = elliptic._ExactCurves(search, numbers).steps(map_over)

    class Wrong(elliptic_steps.EllipticSteps):
        def at(self, number):
            return begin(map_over) if number == last else super().at(number)

    assert not elliptic._is_proved(begin(map_over), search, Wrong(map_over, steps._groups, steps._first))
    assert steps.at(search.first - 1) is None  # nothing is given that has not been compared
    assert steps.at(search.first) is not None


def test_primes_that_coordinates_have_in_common_are_found(monkeypatch):
    # Of coordinates (Y x - X y, q y) a prime q divides all where it divides the denominator W of the point (X, Y)/W.
    map_over, search, numbers = sequences("weierstrass")
    points = single_steps(map_over, begin(map_over), 30)
    bad = elliptic._ExactCurves(search, numbers).steps(map_over)._groups[0][0]._primes
    at, q = next((n, q) for n in range(8, 31) for q in range(50, 500) if points[n].denominator % q == 0 != bad % q)
    X, Y = points[at].numerators
    rows = fmpq_mat(3, 3, numbers[0, 0].coefficients)
    changed = fmpq_mat([[Y, -X, 0], [0, q, 0], [0, 0, 1]]) * rows
    changed = {(0, 0): numbers[0, 0]._replace(coefficients=tuple(changed.entries()))}
    expected = [lowest([Y * x - X * y, q * y], z) for (x, y), z in ((p.numerators, p.denominator) for p in points)]
    steps = elliptic._ExactCurves(search, changed).steps(map_over)
    assert [steps.at(n) for n in range(4, 31)] == expected[4:]
    monkeypatch.setattr(elliptic, "common_primes", lambda *_: fmpq(1))
    steps = elliptic._ExactCurves(search, changed).steps(map_over)
    assert steps.at(at) != expected[at]
    assert steps.at(at).rationals() == expected[at].rationals()


def test_a_start_on_a_curve_of_genus_0_or_of_finite_order_has_no_sequences():
    map_over = over("euler_top")
    assert elliptic.elliptic_steps(map_over, IntegerPoint.from_rationals((fmpq(1, 2), fmpq(0), fmpq(0))), BITS) is None
    field = ring(["x", "y", "eps"])
    x, y, _ = field.gens()
    images = [RationalFunction(y, field.constant(1)), RationalFunction(1 + y, x)]
    pentagon = explicit_map(["x", "y"], images).at(1)  # of Gauss: period 5
    assert elliptic.elliptic_steps(pentagon, IntegerPoint.from_rationals((fmpq(1, 2), fmpq(2))), BITS) is None


@pytest.mark.parametrize("name", ["euler_top", "todd", "hky", "mcmillan", "clebsch_first_flow"])
def test_points_that_are_not_wanted_are_left_out(name):
    map_over = over(name)
    steps = 20 if name.startswith("clebsch") else 90
    expected = single_steps(map_over, begin(map_over), steps)
    at = (3, steps - 7, steps - 6, steps)
    orbit = rational_orbit.RationalOrbit(map_over, expected[0], is_requested=at.__contains__)
    points = [point for point, _ in zip(orbit, range(steps + 1), strict=False)]
    assert [points[n] for n in at] == [expected[n] for n in at]
    assert all(point in (None, right) for point, right in zip(points, expected, strict=True))
    assert (None in points) == (name != "clebsch_first_flow")


@pytest.mark.parametrize("arithmetic", ["exact", "float", "mod:10007", "ball:200"])
@pytest.mark.parametrize("requested", [{"steps": 7, "every": 3}, {"at": [3, 6]}, {"at": []}])
def test_points_of_an_orbit_are_those_asked_for_in_every_arithmetic(arithmetic, requested):
    result = orbit(load("euler_top").map, START[:3], "3/11", arithmetic=arithmetic, **requested)
    steps = requested.get("at", [0, 3, 6])
    assert [point.step for point in result] == [row["step"] for row in result.rows()] == steps
    assert len(result) == len(list(result)) == len(steps)
    stream = StringIO()
    result.write(stream, "csv")
    assert [line.split(",")[0] for line in stream.getvalue().splitlines()[1:]] == list(map(str, steps))


def test_a_pole_or_too_many_bits_on_the_way_end_an_orbit_though_points_are_left_out(monkeypatch):
    map_over = over("euler_top")
    points = [point.step for point in Orbit(map_over, START[:3], 150, max_digits=1000, is_requested={150}.__contains__)]
    complete = Orbit(map_over, START[:3], 150, max_digits=1000)
    orbit = Orbit(map_over, START[:3], 150, max_digits=1000, is_requested={150}.__contains__)
    assert len(list(complete)) > len(list(orbit)) == len(points)
    assert (orbit.end, orbit.end.status) == (complete.end, "budget")
    # Modulo 7 there seems to be a pole every few steps: then points are made all the same.
    monkeypatch.setattr(elliptic_steps, "_PRIME", 7)
    expected = single_steps(map_over, begin(map_over), 50)
    at = [point.value for point in Orbit(map_over, START[:3], 50, is_requested={50}.__contains__)]
    assert at[-1] == expected[-1]


P = 2**61 - 1
WARD = tuple(first_terms(fmpq(2), fmpq(3), fmpq(5)))


def modular(length):
    first, others = first_terms(*(nmod(x, P) for x in (12345, 678910, 1112131415)))
    return around(first, length), around(others, length, first)


def points_on_a_curve(degree, size, length):
    """Points whose coordinates are random combinations of the sections."""
    W, U = modular(length + 4)
    rng = random.Random(10 * degree + size)
    rows = [[rng.randrange(P) for _ in range(degree)] for _ in range(size)]
    points = []
    for n in range(2, length):
        values = [sum((f * c for f, c in zip(forms(degree, W, U, n), row, strict=True)), nmod(0, P)) for row in rows]
        points.append([int(value / values[-1]) for value in values])
    return points


@pytest.mark.parametrize(
    ("degree", "size"),
    [(2, 2), (3, 3), (4, 3), (4, 4), (5, 3), (5, 4), (5, 5), (6, 3), (6, 6), (7, 3), (7, 5), (7, 7), (8, 4), (8, 8)],
)
def test_curves_of_any_degree(degree, size):
    points = points_on_a_curve(degree, size, 150)
    result = None
    for needed in search.points_needed(size - 1):
        try:
            result = result or search.curve(points[:needed], P)
        except ArithmeticError:
            continue
    assert result is not None
    assert result.sections.degree == degree
    assert search.curve(points[: result.sections.points_used], P, result.sections) == result


@pytest.mark.parametrize("degree", range(2, 8))
def test_sections_of_multiples_are_a_basis_and_belong_to_their_degree(degree):
    W, U = (around(WARD[0], 20), around(WARD[1], 20, WARD[0]))
    rows = [
        [*forms(degree + 1, W, U, n), *(U[n] * entry for entry in _sections_of_multiples(degree, W, n))]
        for n in range(2, 18)
    ]
    assert len(rows[0]) == 2 * degree + 1
    assert fmpq_mat(rows).rank() == degree + 1
    assert fmpq_mat([row[degree + 1 :] for row in rows]).rank() == degree


def test_the_elliptic_divisibility_sequence_of_ward():
    # 0, 1, 1, -1, 1, 2, -1, -3, -5, 7, -4, -23, 29, 59, 129, ...: y^2 + y = x^3 - x with (0, 0), OEIS A006769.
    expected = [1, 1, -1, 1, 2, -1, -3, -5, 7, -4, -23, 29, 59, 129, -314]
    terms = Terms([fmpq(x) for x in expected[:4]], Integers(fmpz(1)))
    with pytest.raises(ArithmeticError):
        Terms([fmpq(x) for x in (1, 0, -1, 1)], Integers(fmpz(1)))
    with pytest.raises(ArithmeticError):
        Terms([fmpq(1), fmpq(1, 3), fmpq(1), fmpq(1)], Integers(fmpz(2)))
    assert [terms.integer(n) for n in range(1, 16)] == expected
    assert terms.pair(9) == (expected[8] ** 2, expected[7] * expected[9])


# By bilinear forms, without curves.


@pytest.mark.parametrize(
    ("name", "steps", "lag"),
    [
        ("euler_top", 40, 1),
        ("volterra_periodic_4", 30, 1),  # in a hyperplane
        ("weierstrass", 60, 1),
        ("discrete_painleve_1", 60, 1),
        ("lagrange_top", 18, 1),
        ("three_wave", 18, 1),
        ("clebsch_first_flow", 16, 2),  # Abelian surfaces, one section more than coordinates
    ],
)
def test_points_by_bilinear_forms_are_those_of_single_steps_in_lowest_terms(name, steps, lag, no_curves):
    map_over = over(name)
    expected = single_steps(map_over, begin(map_over), steps)
    points, orbit = walked(map_over, expected[0], steps)
    assert points == expected
    assert orbit.since is not None
    assert orbit.since < steps
    forms = bilinear_forms(map_over, points[-1])
    assert forms is not None
    assert forms.lag == lag
    assert [forms.step(expected[k - 3 : k], k) for k in range(3, steps + 1)] == expected[3:]  # of the whole orbit


@pytest.mark.parametrize("name", ["lorenz", "henon_heiles", "kirchhoff_generic", "hietarinta_viallet"])
def test_there_are_no_forms_where_there_is_no_abelian_variety(name):
    map_over = over(name)
    assert bilinear_forms(map_over, begin(map_over)) is None


def test_wrong_forms_give_no_point_and_the_orbit_goes_on(monkeypatch, no_curves):
    map_over = over("euler_top")
    expected = single_steps(map_over, begin(map_over), 25)
    right = bilinear_forms(map_over, expected[0])
    for k in range(4):
        changed = bilinear_forms(map_over, expected[0])
        changed.coefficients[k, 0] += 1
        assert changed.step(expected[10:13], 13) is None
        assert right.step(expected[10:13], 13) == expected[13]
    monkeypatch.setattr(bilinear, "bilinear_forms", lambda *_: changed)
    assert walked(map_over, begin(map_over), 25)[0] == expected


def test_points_by_bilinear_forms_are_in_lowest_terms_also_where_an_orbit_leaves_a_curve_for_one_step(monkeypatch):
    monkeypatch.setattr(bilinear, "bilinear_forms", bilinear_forms)
    # z -> z / (1 + z) is 1/Z, 1/(Z + 1), ..., and y is 0 but where Z + k is none of the zeros of p.
    field = ring(["z", "y", "u", "eps"])
    z, y, u, _ = field.gens()
    entry, last, Z = field.constant(1), 32, fmpz(2) ** 360
    p = prod((1 - z * (Z + k) for k in range(last + 1) if k != last - 1), start=entry)
    images = [
        RationalFunction(z, 1 + z),
        RationalFunction(p + u, entry),
        RationalFunction(y * (1 - z * (Z + last)), entry),
    ]
    map_over = explicit_map(["z", "y", "u"], images).at(1)
    start = IntegerPoint.from_rationals((fmpq(1, Z), fmpq(0), fmpq(0)))
    points, orbit = walked(map_over, start, last + 3)
    assert points == single_steps(map_over, start, last + 3)
    assert orbit.since < last - 1
    assert any(point.numerators[1] for point in points)
