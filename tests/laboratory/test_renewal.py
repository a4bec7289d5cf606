"""Degrees by the renewal equation, against degrees measured by polynomials and gcds, and against known laws.

Compositions that are too long to be multiplied out are followed map by map.
"""

import random
from dataclasses import replace
from functools import cache

import pytest
from flint import fmpq, fmpz_poly
from helpers import DIMENSION, quick
from hypothesis import given
from hypothesis import strategies as st
from search_helpers import by_formulas, file_of

from kahanmaps import Budget, QuadraticSystem, degree_growth, parse_system
from kahanmaps.documents.catalog import load, map_names, names
from kahanmaps.laboratory.growth.renewal import coefficients, degree_series, every_nth, needed_hypersurfaces
from kahanmaps.laboratory.singular.following import OrbitData, StepLimits
from kahanmaps.laboratory.singular.singularities import Patterns, default_eps, patterns
from kahanmaps.laboratory.singular.written import Word, followed_map_by_map


def settled(*rows, continues_as=None):
    return OrbitData(rows, (), 100, True, continues_as)


@cache
def derived(name):
    return patterns(load(name).map, None)


WRITTEN = [name for name in (*names(), *map_names()) if DIMENSION[name] <= 4]
DAILY = ["riccati", "weierstrass", "euler_top", "mcmillan", "hietarinta_viallet"]
# In these several contracted hypersurfaces are zeros of one form over Q: the degrees of all of them.
OF_ONE_FORM = {
    "clebsch_first_flow": [1, 5, 8, 18],
    "kirchhoff_case": [5, 10, 20],
    "lagrange_top": [1, 4, 4, 8],
    "so4_euler_manakov": [5, 10, 20],
    "three_wave": [10, 15],
    "coupled_euler_tops": [8, 16],  # 8 + 8, each of which splits over a field of degree 2
}


@pytest.mark.parametrize("name", quick(WRITTEN, DAILY))
def test_the_degrees_of_the_catalogue_are_derived(name):
    growth = degree_growth(load(name).map, max_degree=500)
    if growth.degrees[1] > 1 and growth.proof is None:
        assert growth.derived is not None
        assert tuple(coefficients(growth.patterns.fraction, len(growth.degrees))) == growth.degrees
        assert growth.derived.characteristic == (growth.fitted or growth.derived).characteristic


@pytest.mark.parametrize("name", quick(list(OF_ONE_FORM), ["kirchhoff_case", "three_wave"]))
def test_hypersurfaces_of_one_form_are_told_apart_and_derive_degrees(name):
    result = patterns(file_of(name).map, fmpq(2, 7))
    assert sorted(h.degree for h in result.exceptional) == OF_ONE_FORM[name]
    measured = degree_growth(file_of(name).map, max_terms=6, patterns=result)
    assert measured.derived is not None
    # Each degree counts: with another one in its place the degrees of the map are other ones.
    for entry in result.exceptional:
        wrong = [(h.degree + (h is entry), h.orbit_data) for h in result.exceptional]
        costs = any(row[0] for row in entry.orbit_data.rows)
        assert (tuple(coefficients(degree_series([measured.degrees[1]], wrong), 7)) != measured.degrees) == costs


def test_a_hypersurface_with_points_modulo_some_primes_only_is_met():
    """One form of degree 15: three conjugate hypersurfaces of degree 3, which cost nothing, and two others."""
    rhs = ["-x3*x4", "-x3*x1", "3*x2*x1", "2*x2*x3", "-x1*x2"]
    system = QuadraticSystem.from_text(["x1", "x2", "x3", "x4", "x5"], rhs)
    result = patterns(system, default_eps(system, 0)[0], steps=12)
    assert sorted(h.degree for h in result.exceptional) == [1, 4, 6, 9]
    measured = degree_growth(system, max_terms=5).degrees
    assert tuple(coefficients(result.fraction, 6)) == measured == (1, 5, 17, 59, 209, 743)


MEMBERS = [(1, "planar_cubic_hamiltonian"), (2, "paper_m2"), (3, "paper_m3")]


@pytest.mark.parametrize(("m", "name"), quick(MEMBERS, MEMBERS[:2]))
def test_the_degrees_of_the_family_are_those_of_m_planes(m, name):
    """docs/mathematics.md: 3 m n^2/4 + 1 for even n, m (3 n^2 + 5)/4 for odd n, from a recursion in the plane."""
    planar = [1, 2]
    for n in range(1, 40):
        planar.append(2 * planar[n] - planar[n - 1] + (1 if n % 2 else 2))
    law = [m * D - (m - 1) * (n % 2 == 0) for n, D in enumerate(planar)]
    assert law == [m * (3 * n * n + 5) // 4 if n % 2 else 3 * m * n * n // 4 + 1 for n in range(41)]
    assert coefficients(derived(name).fraction, 41) == law


def test_orders_that_are_wrong_derive_nothing():
    """Each number in the orders of a map counts: changed, the degrees are not those measured."""
    pairs = [(h.degree, h.orbit_data) for h in derived("euler_top").exceptional]
    true = degree_growth(load("euler_top").map, max_terms=8).degrees
    assert tuple(coefficients(degree_series([3], pairs), 9)) == true
    for k, (size, orders) in enumerate(pairs):
        for t, row in enumerate(orders.rows):
            for column, value in enumerate(row):
                wrong = (*row[:column], value + 1, *row[column + 1 :])
                other = replace(orders, rows=(*orders.rows[:t], wrong, *orders.rows[t + 1 :]))
                changed = [*pairs[:k], (size, other), *pairs[k + 1 :]]
                assert tuple(coefficients(degree_series([3], changed), 9)) != true


def test_a_hypersurface_that_returns_goes_on_as_the_other():
    """The same pattern three ways: as a return to itself, by recurrences, and written out."""
    rows = ((0, 1), (1, 0))
    laws = (fmpz_poly([-1, 0, 1]), fmpz_poly([-1, 0, 1]))
    returning = settled(*rows, continues_as=(2, 0))
    recurring = OrbitData(rows, laws, 100, True)
    written = settled(*(rows * 10))
    ways = [coefficients(degree_series([2], [(1, orders)]), 20) for orders in (returning, recurring, written)]
    assert ways[0] == ways[1] == ways[2]


@given(st.integers(2, 5), st.integers(1, 4), st.lists(st.tuples(st.integers(0, 2), st.integers(0, 2)), max_size=5))
def test_the_fraction_is_what_the_two_equations_give_step_by_step(degree, size, rows):
    """One hypersurface with any orders, however absurd: s(k) and d(k) summed directly."""
    d, s = [1], list[int]()
    for k in range(10):
        nu = [rows[k - l - 1][1] if k - l - 1 < len(rows) else 0 for l in range(k)]
        s.append(size * d[k] - sum(n * other for n, other in zip(nu, s, strict=True)))
        mu = [rows[k - l][0] if k - l < len(rows) else 0 for l in range(k + 1)]
        d.append(degree * d[k] - sum(m * other for m, other in zip(mu, s, strict=True)))
    assert coefficients(degree_series([degree], [(size, settled(*rows))]), 11) == d


def test_a_superattracting_point_lowers_no_degree():
    """A Henon map: infinity goes to a fixed point on it, with orders 2, 4, 8, ...; the degrees are 2^n."""
    growth = degree_growth(by_formulas("x,y", "y; x + y^2"), max_degree=500)
    assert growth.patterns.series == ((1,), (1, -2))
    (infinity,) = growth.patterns.exceptional
    assert [row[1] for row in infinity.orbit_data.rows] == [2**t for t in range(1, len(infinity.orbit_data.rows) + 1)]
    assert growth.dynamical_degree.text == "2"


def test_unknown_orders_that_are_needed_derive_nothing():
    costly, attracted = settled((1, 0, 0)), settled((0, 1, 2))
    assert needed_hypersurfaces([costly, attracted]) == [0, 1]
    assert needed_hypersurfaces([costly, replace(attracted, eventually_in=(1,))]) is None
    assert needed_hypersurfaces([costly, replace(attracted, eventually_in=(0,))]) is None
    assert needed_hypersurfaces([costly, replace(attracted, rows=((0, 0, 2),), eventually_in=(1,))]) == [0]
    # Through a return as well: the first becomes the third, which costs and is met by the second.
    returning = replace(settled((0, 0, 0, 0), (0, 0, 0, 1)), continues_as=(2, 2))
    chain = [returning, settled((0, 0, 0, 1)), settled((1, 0, 0, 0))]
    assert needed_hypersurfaces(chain) == [0, 1, 2]
    assert needed_hypersurfaces([*chain[:2], replace(chain[2], eventually_in=(0,))]) is None
    with pytest.raises(ValueError, match="expected known multiplicities"):
        degree_series([2], [(1, costly), (1, replace(attracted, eventually_in=(0,)))])
    # What is not needed does not count.
    more = degree_series([2], [(1, costly), (1, replace(attracted, rows=((0, 0, 2),)))])
    assert more == degree_series([2], [(1, settled((1, 0)))])


def word(*letters, power=1):
    """The composition of systems of the catalogue, "-" for the inverse, or of inline maps of the plane."""
    entries = []
    for letter in letters:
        if ";" in letter:
            image = ", ".join(f'"{part}"' for part in letter.split(";"))
            entries.append(f'{{ map = {{ variables = ["x", "y"], map = {{ image = [{image}] }} }} }}')
        else:
            entries.append(f'{{ system = "{letter.strip("-")}", inverse = {str(letter[0] == "-").lower()} }}')
    return parse_system(f"[composition]\nof = [{', '.join(entries * power)}]").map


def followed(map_, terms, stage_of=lambda h: h.stage):
    """The word of a composition, and its degrees as its maps give them, followed one by one."""
    limits = StepLimits(12, 60, 40, Budget(), 40)
    result, hypersurfaces = followed_map_by_map(map_, fmpq(3, 11), random.Random(1), limits, lambda _: None)
    pairs = [(h.degree, h.orbit_data) for h in hypersurfaces]
    series = degree_series(result.degrees, pairs, [stage_of(h) for h in hypersurfaces])
    return result, coefficients(every_nth(series, result.length), terms + 1)


@pytest.mark.parametrize(
    ("letters", "power", "terms", "expected"),
    [
        (["lotka_volterra", "-lyness"], 1, 6, Word((2, 2), 1)),
        (["weierstrass", "hietarinta_viallet"], 2, 2, Word((2, 3), 2)),
        (["zander_120", "-zander_120", "nahm_tetrahedral"], 2, 5, Word((2,), 2)),  # the first two are no step
        (["y;(2+y)/x", "y;-x+y+3/y^2"], 1, 6, Word((2, 3), 1)),  # meets what the other map contracts
        (["y;x+y^2-2", "y;2*x+3*y-1"], 1, 5, Word((2, 1), 1)),  # an affine map contracts nothing
        (["y;(y+1/3)/(x+2/5)"], 5, 5, Word((2,), 5)),
    ],
)
def test_words_give_the_measured_degrees(letters, power, terms, expected):
    map_ = word(*letters, power=power)
    found, degrees = followed(map_, terms)
    assert found == expected
    eps = "3/11" if map_.has_eps else None
    assert tuple(degrees) == degree_growth(map_, eps, max_terms=terms, patterns=Patterns((), None, False)).degrees


def test_a_hypersurface_of_another_map_gives_other_degrees():
    """Negative control: with the maps in the other order the same hypersurfaces stand for another composition."""
    map_ = word("y;(2+y)/x", "y;-x+y+3/y^2")
    right = [1, 4, 13, 43, 141, 463]
    assert followed(map_, 5)[1] == right != followed(map_, 5, lambda h: 1 - h.stage)[1]


@pytest.mark.parametrize(("name", "k", "square"), [("mcmillan", 7, 2), ("euler_top", 2, 2)])
def test_powers_have_every_kth_degree(name, k, square):
    growth = degree_growth(word(name, power=k))
    assert (growth.ended, growth.derived.closed_form) == ("derived", f"{square * k * k}*n^2 + 1")
    assert growth.patterns.word == Word((3,), k)
    assert f"one iterate consists of {k} maps" in growth.text


def test_every_nth_coefficient_of_a_fraction():
    above, below = fmpz_poly([1, 2]), fmpz_poly([1, -3, 1, 5])
    values = coefficients((above, below), 40)
    for n, first in ((1, 0), (2, 0), (2, 1), (3, 2), (5, 7)):
        assert coefficients(every_nth((above, below), n, first), 6) == values[first::n][:6]
    with pytest.raises(ArithmeticError, match="coefficients that are too large"):
        every_nth((fmpz_poly([1]), fmpz_poly([1, -2, -3])), 600)
