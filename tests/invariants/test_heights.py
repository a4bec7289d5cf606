"""Heights of rational points, and how they grow along orbits of Kahan maps.

Specified here: a height is the bit length of the largest of coprime homogeneous coordinates, however the orbit was
walked; the kind of growth of every system of the catalogue and of controls whose answer is known from theory; the
constant of linear growth from the multiplier of a Moebius map, that of quadratic growth from canonical heights; what is
too short or fits no rule is undecided.
"""

from fractions import Fraction
from math import gcd, lcm, log2

import pytest
from check_helpers import system_of
from flint import fmpq
from helpers import quick
from hypothesis import given
from hypothesis import strategies as st
from planar_helpers import over_members, side_by_side, structure_and_system

from kahanmaps import KahanMap, NormalSteps, TimeLimit, height_survey, load, system_normal_form
from kahanmaps.algebra.work import Budget, counted
from kahanmaps.invariants.growth import Growth
from kahanmaps.invariants.heights import HeightGrowth, decimal_text, height, height_growth
from kahanmaps.maps.normal_form.planar_integers import IntegerBlock
from kahanmaps.maps.orbits.iteration import Orbit, OrbitEnd

START = ["1/2", "1/3", "-1/5", "2/7", "3/4", "-2/3"]
P, LOG, LIN = Growth.PERIODIC, Growth.LOGARITHMIC, Growth.LINEAR
Q, E, U = Growth.QUADRATIC, Growth.EXPONENTIAL, Growth.UNDECIDED


def growth(system, start, steps, eps="1/10", **options) -> HeightGrowth:
    return height_growth(KahanMap(system, eps), start, steps, **options)


def of_heights(heights, every: int = 1) -> HeightGrowth:
    return HeightGrowth(tuple(heights), OrbitEnd("completed", len(heights) - 1, "made up"), every)


@given(st.lists(st.fractions(max_denominator=10**6), min_size=1, max_size=5))
def test_the_height_is_the_bit_length_of_the_largest_of_coprime_homogeneous_coordinates(point):
    below = lcm(*(entry.denominator for entry in point))
    integers = [int(entry * below) for entry in point] + [below]
    assert gcd(*integers) == 1
    assert height(point) == height([*map(str, point)]) == max(map(abs, integers)).bit_length()


@over_members
def test_heights_in_normal_form_are_those_of_the_points_of_the_generic_orbit(name):
    normal_form, system = structure_and_system(name)
    start, steps = START[: system.dim], 12
    expected = [height(point.x) for point in Orbit(KahanMap(system, "1/10"), start, steps)]
    result = growth(system, start, steps, normal_form=normal_form)
    assert result.heights == tuple(expected)
    assert result.method == "normal-form"
    assert growth(system, start, steps).heights == tuple(expected)


@pytest.mark.parametrize(
    ("name", "every", "method"),
    [("m = 2", 7, "normal-form"), ("m = 2", 20, "doubling"), ("m = 2, sqrt 2", 2, "normal-form")],
)
def test_heights_at_some_steps_are_those_of_all_steps(name, every, method):
    normal_form, system = structure_and_system(name)
    every_step = growth(system, START[:4], 40).heights
    result = growth(system, START[:4], 40, normal_form=normal_form, every=every)
    assert result.steps == tuple(range(0, 41, every))
    assert result.heights == every_step[::every]
    assert result.method == method


# The catalogue: every system, with the reason for the answer. Elliptic: orbits on elliptic curves (or, for the
# members and the three waves, on Abelian varieties), where a translation is. Degrees: those of the file grow like g^n.
CATALOGUE = {
    "euler_top": (Q, "15.4647", "two integrals in three dimensions, elliptic"),
    "harmonic": (LIN, "6.65870", "a rotation by (10 + i)^2/101: log2(101) = 6.65821"),
    "henon_heiles": (E, None, "degrees: g = 2.297"),
    "paper_m2": (Q, "12.0332", "a member"),
    "riccati": (LIN, "2.43641", "a Moebius map with multiplier (21 + 4 sqrt 5)/19"),
    "weierstrass": (Q, "2.39568", "a pencil of cubics"),
}


@pytest.mark.parametrize("name", CATALOGUE)
def test_systems_of_the_catalogue_grow_as_theory_says(name):
    kind, constant, _ = CATALOGUE[name]
    file = load(name)
    normal_form = system_normal_form(file.system, file.hamiltonian, file.member)
    result = growth(file.system, START[: file.system.dim], 64, normal_form=normal_form, max_digits=12_000)
    assert result.kind is kind
    assert (result.constant is None) == (constant is None)
    if constant is not None and result.end.is_complete:
        assert decimal_text(result.constant) == constant
    elif constant is not None:  # the last steps are missing: the constant is less accurate
        assert abs(result.constant / Fraction(constant) - 1) < Fraction(1, 500)


@pytest.mark.parametrize(("name", "factor"), [("lorenz", Fraction(3)), ("lotka_volterra", Fraction(2))])
def test_exponential_growth_ends_at_the_budget_with_the_growth_of_the_degrees_as_its_ratio(name, factor):
    system = load(name).system
    result = growth(system, START[: system.dim], 64)
    assert (result.kind, result.end.status) == (E, "budget")
    assert result.constant is None
    assert abs(result.ratio / factor - 1) < Fraction(1, 1000)


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("three rational roots", Q),
        ("delta = 1", LIN),  # three lines, each multiplied by -8 every third step
        ("delta = 1, a vertex", P),
        ("level 0", LOG),  # a cuspidal or reducible cubic with an additive group
        ("a double root", LOG),
        ("h = 0", P),
        ("no value at the start", U),
        ("a pole at step 6", U),
    ],
)
def test_the_level_cubic_of_a_plane_decides_how_heights_grow(name, kind):
    system, normal_form, start = side_by_side(name)
    assert growth(system, start, 64, "1/2", normal_form=normal_form).kind is kind


@pytest.mark.parametrize(
    ("rhs", "eps", "expected"),
    [
        ("-x", "1/10", log2(11)),  # multiplier 9/11
        ("x^2 + x - 1", "1/10", log2(21 + 4 * 5**0.5) / 2),  # multiplier (21 + 4 sqrt 5)/19, Mahler measure 19 of it
        ("x^2 + 1/28", "1", 0.5),  # multiplier (3 + i sqrt 7)/4, Mahler measure 2: as slow as it gets
    ],
)
def test_the_constant_of_a_moebius_map_is_the_height_of_its_multiplier(rhs, eps, expected):
    result = growth(system_of("x", rhs), ["1/3"], 256, eps)
    assert result.kind is LIN
    # Heights are off a line by rounding and by O(1), a few bits: 3.5 s/n^1.5 is below 0.005 then.
    assert abs(float(result.constant) - expected) < 0.005


def translation_constant(block: IntegerBlock, doublings: int = 8) -> Fraction:
    """3 hhat(T)/log 2 for the plane, on the curve with gamma = 1 - delta, from x(2^k T); the error is O(4^-k)."""
    gamma = 1 - block.delta
    a1, a2, a3 = 6, 3 * gamma, 16 * gamma
    x, y = fmpq(0), fmpq(0)
    for _ in range(doublings):
        slope = (3 * x * x + 2 * a2 * x - a1 * y) / (2 * y + a1 * x + a3)
        doubled = slope * slope + a1 * slope - a2 - 2 * x
        x, y = doubled, -(slope + a1) * doubled - (y - slope * x) - a3
    return Fraction(3 * height([x]), 2 * 4**doublings)  # the height of x belongs to the divisor 2 (O)


@pytest.mark.parametrize("name", quick(["m = 1", "m = 2", "m = 3", "m = 3, fractions", "m = 3, another J"], ["m = 2"]))
def test_the_constant_of_a_member_is_the_sum_of_the_canonical_heights_of_its_planes(name):
    normal_form, system = structure_and_system(name)
    start = KahanMap(system, "1/10").point(START[: system.dim])
    blocks, _ = NormalSteps(normal_form, fmpq(1, 10)).blocks(start)
    expected = sum(map(translation_constant, blocks))
    result = growth(system, start, 60, normal_form=normal_form)
    assert result.kind is Q
    assert abs(result.constant / expected - 1) < Fraction(1, 2000)  # measured: at most 2 parts in 10^4
    # Control: the constants of the planes are not so small that one of them might be missing.
    assert all(translation_constant(block) > expected / 5 for block in blocks)


@given(st.integers(1, 500), st.integers(-300, 300), st.integers(0, 10**4), st.integers(8, 60), st.integers(1, 9))
def test_the_constant_of_a_parabola_is_its_leading_coefficient(a, b, c, n, every):
    result = of_heights([a * k * k + b * k + c for k in range(n + 1)], every)
    assert result.kind is Q
    assert result.constant == Fraction(a, every**2)


@pytest.mark.parametrize(
    ("heights", "why"),
    [
        ([100 + k * k if k < 9 else 1000 for k in range(12)], "the last heights count"),
        ([5, 5, 6, 7, 8, 10, 11, 13, 15], "four quarters of 1, 2, 3, 4 bits may be noise"),
        ([8 * k - k * (k - 1) // 8 for k in range(17)], "slower and slower, and not slow"),
        ([1000 - 20 * k for k in range(30)], "no heights fall for ever"),
        ([3, 9] + [max(1, abs(k - 20) * 30) for k in range(41)], "a line down and a line up"),
    ],
)
def test_what_fits_no_rule_is_undecided(heights, why):
    assert of_heights(heights).kind is U, why


@pytest.mark.parametrize("heights", [[7], [7, 8], [k * k + 9 for k in range(8)], [20 * k + 9 for k in range(8)]])
def test_few_heights_decide_nothing(heights):
    result = of_heights(heights)
    assert (result.kind, result.constant) == (U, None)
    assert "expected 9 or more" in result.reason


def test_a_budget_that_is_spent_ends_an_orbit_and_a_survey_and_says_so():
    top = load("euler_top").system
    complete = height_survey(top, "1/10", starts=3, steps=20)
    assert (complete.is_complete, "early" in complete.text) == (True, False)
    before = counted()
    height_survey(top, "1/10", starts=1, steps=20)
    entry = counted() - before
    survey = height_survey(top, "1/10", starts=3, steps=20, effort=Budget(1.5 * entry))
    assert (survey.is_complete, len(survey.orbits)) == (False, 2)
    assert survey.orbits[0] == complete.orbits[0]
    cut = survey.orbits[1].growth
    assert cut.end.message == f"work limit reached after step {cut.end.steps}; raise --effort"
    assert cut.heights == complete.orbits[1].growth.heights[: len(cut.heights)]
    assert 9 < len(cut.heights) < 21
    assert survey.text.endswith("; the survey ended early; raise --effort")


def test_a_time_limit_leaves_the_orbits_that_were_finished():
    top, messages = load("euler_top").system, []

    def stop(sentence):
        messages.append(sentence)
        if len(messages) == 3:
            raise TimeLimit

    survey = height_survey(top, "1/10", starts=3, steps=20, progress=stop)
    assert (survey.is_complete, survey.orbits) == (False, height_survey(top, "1/10", starts=3, steps=20).orbits[:2])
    messages.clear()
    with pytest.raises(TimeLimit):  # a stage of something else, which ends as well
        height_survey(top, "1/10", starts=3, steps=20, effort=Budget(1e9), progress=stop)
