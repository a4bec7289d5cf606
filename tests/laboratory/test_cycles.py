"""Orbits on P^n over GF(p): the arrays against a plain walk with FLINT, and cycles of maps whose lengths are known."""

import itertools
import math
from types import SimpleNamespace

import pytest
from flint import fmpq_mat
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.fields import GF
from kahanmaps.documents.catalog import load
from kahanmaps.errors import BadPrime, InputError
from kahanmaps.laboratory.finite.cycle_laws import _critical, _distance, _passes_components, _reversible, compare
from kahanmaps.laboratory.finite.cycles import cycle_census, default_eps
from kahanmaps.laboratory.symmetry.reversors import find_reversor, is_reversor
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.projective import homogeneous_map
from kahanmaps.maps.residues.projective import hasse_weil
from kahanmaps.systems.quadratic import QuadraticSystem


def system_of(*rhs: str) -> QuadraticSystem:
    return QuadraticSystem.from_text(["x", "y", "z"][: len(rhs)], list(rhs))


# --- a walk by hand: Python integers, the forms evaluated one monomial after the other -----------------------------


def all_points(n: int, p: int):
    for point in itertools.product(range(p), repeat=n + 1):
        lead = next((entry for entry in reversed(point) if entry), 0)
        if lead == 1:
            yield point


def by_hand(system: QuadraticSystem, eps: str, p: int) -> dict[tuple[int, ...], tuple[int, ...] | None]:
    forms = homogeneous_map(KahanMap(system, eps, GF(p))).forms
    image: dict[tuple[int, ...], tuple[int, ...] | None] = {}
    for point in all_points(system.dim, p):
        values = [
            sum(int(c) * math.prod(x ** int(e) for x, e in zip(point, m, strict=True)) for m, c in form.terms()) % p
            for form in forms
        ]
        lead = next((entry for entry in reversed(values) if entry), 0)
        image[point] = tuple(value * pow(lead, -1, p) % p for value in values) if lead else None
    return image


def census_by_hand(image) -> tuple[int, int, int, dict[int, int]]:
    """Lost, falling and transient points, and the number of cycles by length."""
    lost = sum(found is None for found in image.values())
    falling = transient = 0
    lengths: dict[int, int] = {}
    for start in image:
        seen = {start: 0}
        point = image[start]
        while point is not None and point not in seen:
            seen[point] = len(seen)
            point = image[point]
        if point is None:
            falling += image[start] is not None
        elif point == start:
            lengths[len(seen)] = lengths.get(len(seen), 0) + 1
        else:
            transient += 1
    return lost, falling, transient, {length: n // length for length, n in sorted(lengths.items())}


SYSTEMS = {
    "weierstrass": lambda: load("weierstrass").system,
    "lotka_volterra": lambda: load("lotka_volterra").system,
    "euler_top": lambda: load("euler_top").system,
    "harmonic": lambda: load("harmonic").system,
    "riccati": lambda: load("riccati").system,
    "a common factor Z": lambda: system_of("y", "x^2"),
    "zero": lambda: system_of("0", "0"),
}


@pytest.mark.parametrize("name", SYSTEMS)
@pytest.mark.parametrize(("prime", "eps"), [(7, "1/10"), (11, "1/7")])
def test_the_census_is_that_of_a_walk_by_hand(name, prime, eps):
    system = SYSTEMS[name]()
    if system.dim == 3 and prime == 11:
        prime = 3
    found = cycle_census(system, eps, prime)
    assert (found.lost, found.falling, found.transient, found.lengths) == census_by_hand(by_hand(system, eps, prime))
    assert found.points == sum(1 for _ in all_points(system.dim, prime)) == found.looked_at
    assert found.lost + found.falling + found.transient + found.periodic == found.points


# --- known lengths ---------------------------------------------------------------------------------------------------


def test_every_default_eps_differs_up_to_sign():
    for prime in (3, 5, 7, 11, 13, 101, 10007):
        residues = [int(GF(prime).convert(eps)) for eps in default_eps(prime, 3)]
        assert len({min(r, prime - r) for r in residues}) == len(residues) >= 1


@pytest.mark.parametrize("name", ["weierstrass", "nahm_tetrahedral"])
def test_cycles_of_planar_integrable_maps_fit_on_curves_of_genus_one(name):
    for eps in default_eps(101):
        found = compare(cycle_census(load(name).system, eps, 101))
        assert "integrable bound" in found.compatible
        assert found.share_within is not None
        assert found.share_within > 0.98  # some level curves are reducible


MONOMIALS = [("x^3", "3*x^2", "0"), ("x^2*y", "2*x*y", "x^2"), ("x*y^2", "y^2", "2*x*y"), ("y^3", "0", "3*y^2")]
MONOMIALS += [("x^2", "2*x", "0"), ("x*y", "y", "x"), ("y^2", "0", "2*y"), ("x", "1", "0"), ("y", "0", "1")]


def hamiltonian(*coefficients: int) -> QuadraticSystem:
    """f = J grad H for the cubic H with these coefficients of the monomials above."""
    by_x = " + ".join(f"({c})*({m[1]})" for c, m in zip(coefficients, MONOMIALS, strict=True))
    by_y = " + ".join(f"({c})*({m[2]})" for c, m in zip(coefficients, MONOMIALS, strict=True))
    return system_of(by_y, f"-({by_x})")


INTEGRABLE = {
    "a triangle of lines, 150 = 3 (p - 1)/2": (system_of("2*x*y - 1", "-x^2 - y^2 - x"), 101, "1/7"),
    "a pencil of sextics, 50 = 5 (p - 1)/3": (load("nahm_icosahedral").system, 31, "1/7"),
    "all cycles but few have 3 p points, on parallel lines": (hamiltonian(-3, 1, 0, 0, 1, 0, 0, 0, -3), 53, "1/7"),
    "44 cycles of 69 points in space": (load("volterra_periodic_3").system, 47, "1/7"),
}


@pytest.mark.parametrize("name", INTEGRABLE)
def test_cycles_on_reducible_level_curves_do_not_refuse_an_integral(name):
    system, prime, eps = INTEGRABLE[name]
    found = compare(cycle_census(system, eps, prime))
    assert found.longer
    assert all(length > hasse_weil(prime) for length in found.longer)
    assert found.unexplained == ()
    assert found.verdict("integrable bound") == "compatible"
    assert "0 cannot lie on a reducible curve" in found.reasons["integrable bound"]


@given(st.lists(st.integers(-9, 9), min_size=9, max_size=9), st.sampled_from([23, 31, 47, 61, 83, 101]))
def test_cubic_hamiltonians_of_the_plane_are_never_refused(coefficients, prime):
    for eps in default_eps(prime):
        assert "integrable bound" not in compare(cycle_census(hamiltonian(*coefficients), eps, prime)).refused


@pytest.mark.parametrize(
    ("system", "prime"),
    [
        (load("lotka_volterra").system, 101),
        (system_of("y", "y - x"), 41),  # a spiral: linear, and no rational function is conserved
        (load("zhukovski_volterra_2").system, 31),  # one integral in dimension 3
    ],
)
def test_maps_with_too_few_integrals_are_refused(system, prime):
    found = [compare(cycle_census(system, eps, prime)) for eps in default_eps(prime)]
    refused = [one for one in found if "integrable bound" in one.refused]
    assert refused
    assert all(one.unexplained and set(one.unexplained) <= set(one.longer) for one in refused)


def test_lotka_volterra_goes_like_a_random_reversible_map_and_not_along_curves():
    system = load("lotka_volterra").system
    R = find_reversor(system)
    for eps in default_eps(311):
        census = cycle_census(system, eps, 311, reversor=R)
        found = compare(census)
        assert found.compatible == ("random reversible",)
        assert set(found.refused) == {"integrable bound", "random permutation"}
        assert census.longest > hasse_weil(311)
        assert found.model_scale == pytest.approx(311.5, abs=1)
        assert f", where 2 N/(fixed points) = {found.model_scale:.1f}, " in found.reasons["random reversible"]
        assert census.lost == 3  # the base points of a quadratic map of the plane


def test_the_law_is_refused_for_an_integrable_reversible_map():
    system = load("weierstrass").system
    found = compare(cycle_census(system, "1/7", 199, reversor=find_reversor(system)))
    assert "random reversible" in found.refused


@pytest.mark.parametrize(
    ("lengths", "expected"),
    [
        ([(1.0, 7)], 2 / math.e),
        ([(0.5, 1), (1.5, 1)], 2.5 * math.exp(-1.5)),  # from a quarter to 1 at 1.5, where the law is 1 - 2.5 e^-1.5
        ([(0.1, 9), (9.0, 1)], 1 - 10 * math.exp(-9) - 0.9 / 9.9),  # 1/11 until just below 9
    ],
)
def test_the_distance_of_a_distribution_from_the_law_of_random_reversible_maps(lengths, expected):
    assert _distance(lengths) == pytest.approx(expected, rel=1e-12)


def test_the_critical_distance_shrinks_like_that_of_a_mean():
    assert _critical(1600, 3) == pytest.approx(_critical(400, 3) / 2, rel=1e-12)
    assert _critical(20, 3) > _critical(100, 3) > _critical(400, 3)
    # Kolmogorov: 1.63/sqrt(count) for a law without parameters; points count by the lengths of their cycles, which
    # makes it larger, and the mean is fitted, which makes it smaller.
    assert 0.5 < _critical(400, 3) * 20 < 2.5


def test_from_twenty_symmetric_cycles_on_lengths_are_compared():
    def compared(count):
        census = SimpleNamespace(points=10_000, fixed=(60, 40), symmetric={5: count}, complete=True)
        reasons = {}
        return _reversible(census, 0, reasons), reasons["random reversible"]

    (scale, model, distance, critical), why = compared(19)
    assert (scale, model, distance, critical) == (None, 200, None, None)
    assert why == "19 symmetric cycles, too few to compare"
    (scale, model, distance, critical), why = compared(20)
    assert (scale, model) == (5, 200)
    assert distance == pytest.approx(2 / math.e)  # all lengths are the mean
    assert critical < distance
    assert why.startswith("scaled by their mean 5.0, where 2 N/(fixed points) = 200.0, the lengths of 20 symmetric")


def test_a_map_that_degenerates_modulo_the_prime_is_a_constant():
    """For x' = x^2 + x - 1 that is where 5 eps^2 = 1, as 2/11 modulo 101: all is divided out, and one point is left."""
    found = cycle_census(load("riccati").system, "2/11", 101)
    assert (found.degree, found.lengths, found.transient) == (0, {1: 1}, 101)


def test_a_map_without_a_value_anywhere_is_a_value():
    """x' = x with eps = 1 modulo p: I - eps f' = 0."""
    census = cycle_census(system_of("x", "y"), 1, 7)
    assert census.is_undefined
    assert compare(census).compatible == ()


# --- samples -------------------------------------------------------------------------------------------------------


def test_samples_agree_with_the_whole_graph():
    system = load("weierstrass").system
    whole = cycle_census(system, "1/7", 31)
    some = cycle_census(system, "1/7", 31, samples=400, seed=3)
    assert set(some.lengths) <= set(whole.lengths)
    assert some.open == 0
    assert abs(some.periodic / 400 - whole.periodic / whole.points) < 0.1
    assert some == cycle_census(system, "1/7", 31, samples=400, seed=3)
    found = compare(some)
    assert found.compatible == ("integrable bound",)
    assert found.refused == ()


def test_the_clock_stops_samples():
    census = cycle_census(load("lotka_volterra").system, "1/7", 100_003, samples=50, seconds=0.0)
    assert census.stopped
    assert census.steps < 100
    assert census.open > 0
    assert compare(census).refused == ()


def test_orbits_left_too_early_refuse_nothing():
    found = compare(cycle_census(load("weierstrass").system, "1/7", 499, samples=200, steps=250))
    assert found.verdict("integrable bound") == "not tried"
    assert "too early to tell" in found.reasons["integrable bound"]


# --- reversing symmetries --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "expected"),
    [("euler_top", [[-1, 0, 0], [0, -1, 0], [0, 0, -1]]), ("lotka_volterra", [[0, 1], [1, 0]]), ("lorenz", None)],
)
def test_reversing_symmetries_that_are_signed_permutations(name, expected):
    found = find_reversor(load(name).system)
    assert found == (None if expected is None else fmpq_mat(expected))


def test_a_reversor_need_not_be_a_symmetric_matrix():
    """In u = x + y, v = y the reversor diag(1, -1) of x' = y, y' = 6 x^2 - 2 is T R T^{-1} = [[1, -2], [0, -1]]."""
    sheared = system_of("y + 6*(x - y)^2 - 2", "6*(x - y)^2 - 2")
    R = fmpq_mat([[1, -2], [0, -1]])
    assert is_reversor(sheared, R)
    assert not is_reversor(sheared, R.transpose())
    kahan, back = KahanMap(sheared, "1/7"), KahanMap(sheared, "-1/7")
    u, v = kahan.point(["2/3", "1/5"])
    a, b = kahan.step([u, v])
    assert back.step([u - 2 * v, -v]) == (a - 2 * b, -b)


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        ([[1, 0, 0], [0, 1, 0], [0, 0, 1]], "expected 2 x 2"),
        ([[0, 2], [1, 0]], "expected an involution"),
        ([[1, 0], [0, 1]], "does not reverse the system"),
    ],
)
def test_a_wrong_reversor_is_refused(matrix, words):
    with pytest.raises(InputError, match=words):
        cycle_census(load("weierstrass").system, "1/7", 11, reversor=fmpq_mat(matrix))


# --- wrong use -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("eps", "prime", "kind", "words"),
    [
        ("1/7", 2, InputError, "modulo 2 every Kahan map is the identity"),
        ("1/7", 9, InputError, "9 is composite"),
        ("1/7", 7, BadPrime, "divides 1/7"),
        ("7/3", 7, BadPrime, "divides 7/3"),
        ("0", 7, InputError, "eps = 0"),
        ("1/7", 3, BadPrime, "a denominator of the system"),
        ("1/7", 2**61 - 1, InputError, "expected one from 3 to"),
    ],
)
def test_wrong_primes_and_eps_are_refused(eps, prime, kind, words):
    with pytest.raises(kind, match=words):
        cycle_census(load("lorenz").system, eps, prime)


def test_whole_graphs_in_high_dimensions_are_smaller():
    """The minors of a point cost 2^n: over GF(3), 3280 points in dimension 7 are few enough, 797161 in 12 not."""

    def squares(n: int) -> QuadraticSystem:
        names = [f"x{k}" for k in range(n)]
        return QuadraticSystem.from_text(names, [f"{name}^2" for name in names])

    assert cycle_census(squares(7), "1/10", 3).complete
    found = cycle_census(squares(12), "1/10", 3, steps=2)
    assert (found.points, found.complete) == (797161, False)


def census_of(lengths, looked_at, **more):
    """A census of the space over GF(101) with cycles of affine points alone; `lengths` with their numbers."""
    usual = {"prime": 101, "dim": 3, "complete": True, "open": 0, "steps": 1000, "points": 10**6, "at_infinity": {}}
    found = {"lengths": lengths, "looked_at": looked_at, "cycles": sum(lengths.values())}
    return SimpleNamespace(**{**usual, **found, "fixed": None, "symmetric": None, **more})


@pytest.mark.parametrize(
    ("lengths", "looked_at", "more", "bound", "permutation"),
    [
        ({5: 1}, 100, {}, "compatible", "not tried"),  # one point in twenty is periodic
        ({4: 1}, 100, {}, "not tried", "not tried"),
        ({49: 1}, 100, {}, "compatible", "not tried"),
        ({50: 1}, 100, {}, "compatible", "compatible"),  # 1 cycle, where 4.5 are expected: within 3 sqrt(4.5)
        ({1: 50}, 100, {}, "compatible", "not compatible"),
        ({95: 1, 5: 1}, 100, {"open": 5}, "compatible", "compatible"),  # 5 of 105 points are still under way
        ({95: 1, 4: 1}, 100, {"open": 6}, "not compatible", "compatible"),
        ({95: 1, 5: 1}, 100, {"open": 5, "steps": 121}, "not tried", "compatible"),  # fewer than p + 1 + 2 sqrt p = 122
        ({95: 1, 5: 1}, 100, {"open": 5, "steps": 122}, "compatible", "compatible"),
        ({123: 1}, 123, {"dim": 2}, "not compatible", "compatible"),
        ({122: 1}, 122, {"dim": 2}, "compatible", "compatible"),
    ],
)
def test_laws_are_tried_where_there_are_points_enough(lengths, looked_at, more, bound, permutation):
    found = compare(census_of(lengths, looked_at, **more))
    assert found.bound == 122
    assert (found.verdict("integrable bound"), found.verdict("random permutation")) == (bound, permutation)


@pytest.mark.parametrize(("complete", "share"), [(True, 100 / 300), (False, 2 / 3)])
def test_the_share_on_short_cycles_is_one_of_points_which_samples_are(complete, share):
    """Of cycles of 50, 50 and 200 points; or of three sampled points, on cycles of such lengths."""
    found = compare(census_of({50: 2, 200: 1}, 300, complete=complete, cycles=None))
    assert (found.share_within, found.longer) == (share, {200: 1})


@pytest.mark.parametrize(
    ("passes", "lengths"), [(True, (2, 102, 119, 202, 900, 909, 918)), (False, (1, 123, 206, 1000, 1010, 1020))]
)
def test_cycles_on_up_to_nine_rational_curves_have_multiples_of_orders_as_lengths(passes, lengths):
    assert {_passes_components(length, 101) for length in lengths} == {passes}


@pytest.mark.parametrize("samples", [0, 100_001])
def test_a_wrong_number_of_samples_is_refused(samples):
    with pytest.raises(InputError, match="expected 1 to 100000"):
        cycle_census(load("lorenz").system, "1/7", 101, samples=samples)


def test_the_mean_length_is_that_of_all_cycles():
    found = cycle_census(load("weierstrass").system, "1/10", 7)
    lengths = [length for length, n in found.lengths.items() for _ in range(n)]
    assert len(set(lengths)) > 1
    assert (found.cycles, found.mean) == (len(lengths), sum(lengths) / len(lengths))
