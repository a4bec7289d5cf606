"""Scans find the conditions that are known, confirm them, and tell what was tried; points modulo primes become
conditions over Q. Degrees of many members compiled and by FLINT are the same.
"""

import random
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from flint import fmpq
from search_helpers import map_file, system

from kahanmaps import Budget, InputError, TimeLimit, degree_growth, load, parse_system
from kahanmaps.algebra.polynomials import ring
from kahanmaps.documents.symbols import map_with_symbols
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.scan import scan as scan_module
from kahanmaps.laboratory.scan.lift import lift_conjugate_points, lift_hypersurfaces, lift_linear
from kahanmaps.laboratory.scan.members import ScannedFamily
from kahanmaps.laboratory.scan.modular_components import find_components
from kahanmaps.laboratory.scan.result import Component
from kahanmaps.laboratory.scan.scan import _confirm, _continues_as, scan
from kahanmaps.laboratory.scan.sweep import TimeOver, sweep
from kahanmaps.maps.residues.families import NOWHERE, Family

THREE_LINES = system("x y", "x*(g2*(x + y) + y)", "-y*(g1*(x + y) + x)", g1=1, g2=1)
LOTKA_VOLTERRA = system("x y z", "x*(C*y + z)", "y*(x + A*z)", "z*(B*x + y)", A=1, B=1, C=1)


def slow(result, *kinds):
    """The texts of the components whose growth is of these kinds."""
    return {
        entry.text
        for degrees, some in result.classes
        for entry in some
        if any(o.growth is not None and o.growth.growth in kinds for o in some)
    }


@pytest.fixture(scope="module")
def three_lines():
    return scan(THREE_LINES, ["g1", "g2"], primes=(43, 47, 53), seed=1)


def test_the_classification_of_three_lines_is_found(three_lines):
    # zander-2021: the exponents (1, 1, 1), (1, 1, 2), (1, 2, 3), up to permutation and a factor
    assert slow(three_lines, Growth.QUADRATIC) == {
        "(1, 1)",
        *("(1, 2)", "(2, 1)", "(1/2, 1/2)"),
        *("(2, 3)", "(3, 2)", "(1/2, 3/2)", "(3/2, 1/2)", "(1/3, 2/3)", "(2/3, 1/3)"),
    }
    linear = {"(0, 1)", "(1, 0)", "g1 + 1 = 0", "g2 + 1 = 0", "g1 + g2 = 0"}
    assert slow(three_lines, Growth.LINEAR) == linear
    assert "g1 + g2 + 1 = 0" in slow(three_lines, Growth.BOUNDED)


def test_everything_is_confirmed_and_nothing_is_left(three_lines):
    assert all(component.is_confirmed and component.tried == 3 for component in three_lines.components)
    assert not any(three_lines.unassigned)
    # all permutations of the exponents (g1 : g2 : 1), which exchanges and one cycle generate
    assert three_lines.symmetric == (("g2", "g1"), ("g1/g2", "1/g2"))
    assert three_lines.height == 31
    assert "up to 31" in three_lines.coverage


def test_a_wrong_condition_is_not_confirmed():
    family = ScannedFamily(THREE_LINES, ("g1", "g2"), map_with_symbols(THREE_LINES, ["g1", "g2"]), None, 0)
    g1, g2 = ring(["g1", "g2"]).gens()
    good = Component((g1 + g2 - 1,), 1, (2, 4, 7, 12, 20, 33, 54), (43, 47, 53))
    wrong = replace(good, equations=(g1 + g2 - 7,))
    results = [_confirm(entry, family, [], random.Random(1)) for entry in (good, wrong)]
    assert [(entry.confirmed, entry.tried, entry.is_confirmed) for entry in results] == [(3, 3, True), (0, 3, False)]
    # One member speaks for others only as long as their degrees agree.
    member, _ = family.member({"g1": fmpq(2), "g2": fmpq(3)})
    known = degree_growth(member.map, enclosed=False)
    points = [Component((g1 - a, g2 - b), 0, known.degrees[1:8], ()) for a, b in ((3, 2), (1, 2))]
    assert [_continues_as(point, known, family) for point in points] == [True, False]


def test_a_curve_in_a_plane_of_parameters_is_found_beside_the_surface_through_it():
    inverse = ["y - (c - 1)*x^2 - (a*b + 1)*x^3", "x"]
    file = map_file("x y", "y", "x + (c - 1)*y^2 + (a*b + 1)*y^3", inverse=inverse, a=1, b=1, c=0)
    scanned = scan(file, ["a", "b", "c"], primes=(11, 13, 17), terms=2)
    assert {c.text: c.degrees for c in scanned.components} == {"a*b + 1 = 0": (2, 4), "a*b + 1 = 0, c - 1 = 0": (1, 1)}
    assert not any(scanned.unassigned)


def test_the_conditions_of_lotka_volterra_in_space_are_found():
    scanned = scan(LOTKA_VOLTERRA, ["A", "B", "C"], primes=(17, 19, 23), terms=3)
    conditions = {component.text: component for component in scanned.components}
    assert conditions["A*B*C + 1 = 0"].degrees == (3, 7, 15)
    # the curves in it on which the map is integrable
    for entry in ("A*B + 1 = 0, C - 1 = 0", "B*C + 1 = 0, A - 1 = 0", "A*C + 1 = 0, B - 1 = 0"):
        assert conditions[entry].growth.growth is Growth.QUADRATIC
        assert conditions[entry].dimension == 1
    assert not any(scanned.unassigned)


@pytest.mark.parametrize(
    ("second", "names", "text", "dimension"),
    [
        ("x^2 + (a^2 - 2)*y", "a", "a^2 - 2 = 0", 0),
        ("x^2 + b*x + (a^2 - 2)*y", "ab", "a^2 - 2 = 0", 1),  # two lines modulo the primes at which 2 is a square
        ("x^2 + (a^3 - 2)*y + (b - a^2)*x*y", "ab", "a^3 - 2 = 0, a^2 - b = 0", 0),
    ],
)
def test_what_splits_over_a_number_field_is_found_as_one(second, names, text, dimension):
    scanned = scan(system("x y", "y", second, **dict.fromkeys(names, 1)), [*names], terms=4)
    entry = next(component for component in scanned.components if component.text == text)
    assert (entry.dimension, entry.is_confirmed, entry.growth.growth) == (dimension, True, Growth.QUADRATIC)
    assert not any(scanned.unassigned)


REPAIRED = system("x y", "2*x*y", "A*y^2 - 4*x^2 - 6*x - 6", A=1)


def test_a_condition_with_eps_is_found_where_eps_varies_too():
    scanned = scan(REPAIRED, ["eps", "A"], primes=(43, 47, 53), terms=5)
    assert scanned.over == ("A", "eps")
    # the catalogue's repaired_octahedral
    entry = next(component for component in scanned.components if component.text == "24*eps^2 + A + 2 = 0")
    assert entry.is_confirmed
    assert entry.growth.growth is Growth.QUADRATIC
    assert entry.values["A"] == -2 - 24 * entry.values["eps"] ** 2
    without = scan(REPAIRED, ["A"], primes=(43, 47, 53), terms=5)
    assert [component.text for component in without.components] == ["-1"]  # the one that holds for every eps


def test_four_parameters_give_what_has_codimension_2_as_well():
    file = system("x y z", "x*(C*y + z)", "y*(D*x + A*z)", "z*(B*x + y)", **dict.fromkeys("ABCD", 1))
    scanned = scan(file, ["A", "B", "C", "D"], terms=3)
    conditions = {component.text: component for component in scanned.components}
    assert conditions["A*B*C + D = 0"].dimension == 3
    # at D = 1 these are the curves that are known
    for entry in ("A*B + D = 0, C - 1 = 0", "B*C + D = 0, A - 1 = 0", "A*C + 1 = 0, B - D = 0"):
        assert (conditions[entry].dimension, conditions[entry].is_confirmed) == (2, True)
        assert conditions[entry].growth.growth is Growth.QUADRATIC
    assert "24 random planes of parameter space modulo 19, 23, 29, 31" in scanned.coverage
    assert "codimension 2" in scanned.coverage


def test_the_budget_may_be_spent_before_anything_is_known():
    scanned = scan(load("henon_heiles"), ["c"], effort=Budget(1))
    assert (scanned.ended, scanned.components, scanned.height) == ("budget", (), 0)
    assert "not done\tmembers modulo 10" in scanned.text

    def over():
        raise TimeOver

    with pytest.raises(TimeOver):
        sweep(map_with_symbols(load("henon_heiles"), ["c"]), 1, 31, None, 2, 99, check=over)


def test_a_curve_that_is_missed_is_said_to_be_one():
    # over a cubic field: modulo 1/3 of the primes all three lines are there, modulo 1/2 one of them
    scanned = scan(system("x y", "y", "x^2 + b*x + (a^3 - 2)*y", a=1, b=1), ["a", "b"], terms=4)
    assert scanned.components == ()
    assert "as many as a curve has, so one may have been missed" in scanned.text


LEFT_OUT = {
    "conditions": "all conditions for",
    "_confirm": "the confirmation of",
    "degree_growth": "the growth on",
    "symmetries": "changes of parameters",
}


@pytest.mark.parametrize("stage", LEFT_OUT)
def test_a_time_limit_ends_a_scan_with_what_is_known(monkeypatch, stage):
    def stop(*_, **__):
        raise TimeLimit

    monkeypatch.setattr(scan_module, stage, stop)
    scanned = scan(THREE_LINES, ["g1"], primes=(17, 19, 23), terms=3)
    assert scanned.ended == "interrupted"
    assert scanned.omitted[0].startswith(LEFT_OUT[stage])
    assert bool(scanned.components) is (stage != "conditions")
    assert any(component.tried for component in scanned.components) is (stage in ("degree_growth", "symmetries"))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"over": []}, "no parameter"),
        ({"over": ["d"]}, "found the symbol 'd'"),
        ({"eps": 0}, "found eps = 0"),
        ({"over": ["c", "eps"], "eps": 1}, "found eps both"),
        ({"primes": (31, 37)}, "three different ones"),
        ({"primes": (31, 37, 39)}, "found 39 among the primes"),
        ({"terms": 0}, "expected 1 to 14"),
        ({"terms": 8}, "too large to be scanned"),
        ({"jobs": 0}, "expected at least 1"),
    ],
)
def test_what_cannot_be_scanned_is_refused(change, message, monkeypatch):
    monkeypatch.setattr("kahanmaps.laboratory.scan.scan._MAX_LENGTH", 99)
    options = {"over": ["c"], **change}
    with pytest.raises(InputError, match=message):
        scan(load("henon_heiles"), options.pop("over"), **options)


@pytest.mark.parametrize(
    ("rhs", "names", "symmetric"),
    [
        (("y", "x^2 + (a*b - 1)*y"), "ab", (("b", "a"), ("-a", "-b"))),
        (("y", "x^2 + a*y + b*(b - 1)"), "ab", ()),  # a = 0 alone, and affine
        (("a", "b"), "ab", ()),  # no member is slower than others
        (("y", "x^2 + (a - 1)*(a - 4)*y"), "a", (("-a + 5",),)),
    ],
)
def test_symmetries_of_parameter_space_are_found_where_they_permute_special_members(rhs, names, symmetric):
    file = system("x y", *rhs, **dict.fromkeys(names, 1))
    assert scan(file, [*names], primes=(17, 19, 23), terms=4).symmetric == symmetric


FIELD_PRIMES = (53, 59, 61, 67, 71, 73, 79, 83, 89, 97, 101, 103)
PRIMES = (31, 37, 41)


def points_where(condition, p, count):
    return [x for x in product(range(p), repeat=count) if condition(*x) % p == 0]


def found_in(points, p, count, seed=0):
    return find_components(points, p, p**count, 0, random.Random(seed))


def test_two_lines_and_points_beside_them_are_told_apart():
    points = points_where(lambda a, b: (a - 3 * b) * (a + b - 1), 31, 2)
    result = found_in([*points, (5, 0), (7, 1)], 31, 2)
    assert set(result.linear[1]) == {((1, 28, 0),), ((1, 1, 30),)}
    assert set(result.linear[0]) == {((1, 0, 26), (0, 1, 0)), ((1, 0, 24), (0, 1, 30))}
    assert not result.hypersurfaces


def test_a_curve_is_found_among_points_by_chance():
    rng = random.Random(1)
    noise = [(rng.randrange(31), rng.randrange(31)) for _ in range(4)]
    points = points_where(lambda a, b: a * a + b * b - 1, 31, 2)
    result = found_in([*points, *noise], 31, 2)
    assert len(result.hypersurfaces[()]) == 1
    assert len(result.linear[0]) == len(set(noise) - set(points))


def test_a_curve_in_a_plane_of_space_is_found():
    result = found_in([(1, *x) for x in points_where(lambda b, c: b * c + 1, 31, 2)], 31, 3)
    assert list(result.hypersurfaces) == [((1, 0, 0, 30),)]
    assert not result.linear.get(0)


def test_three_hyperplanes_of_a_space_of_dimension_6_are_told_apart():
    rng = random.Random(3)
    points = [tuple(0 if i == k else rng.randrange(1, 79) for i in range(6)) for k in range(3) for _ in range(60)]
    components = find_components(points, 79, 79 * 60, 5, random.Random(0))
    assert sorted(components.linear[5]) == [(tuple(int(i == k) for i in range(7)),) for k in (2, 1, 0)]


def test_what_is_not_there_modulo_the_third_prime_is_not_lifted():
    point = {p: [((1, p - 2),)] for p in PRIMES}
    assert list(lift_linear(point)) == [((fmpq(1), fmpq(-2)),)]
    assert lift_linear({**point, 41: [((1, 41 - 3),)]}) == {}


def test_a_point_of_low_height_may_be_missing_modulo_one_of_four_primes():
    low, high = ({43: [((1, 5),)], **{p: [((1, p - c),)] for p in PRIMES}} for c in (2, 15))
    assert lift_linear(low) == {((fmpq(1), fmpq(-2)),): PRIMES}
    assert lift_linear(high) == {}


def zeros(condition, *others):
    """The points (a, ...) modulo primes where a condition on a holds, the others by functions of a."""
    return {p: [(a, *(f(a) % p for f in others)) for a in range(p) if condition(a) % p == 0] for p in FIELD_PRIMES}


@pytest.mark.parametrize(
    ("condition", "others", "names", "expected"),
    [
        (lambda a: a**2 - 5, [], "a", ["a^2 - 5"]),
        (lambda a: a**2 - 5, [lambda a: 3, lambda a: 2 * a + 1], "abc", ["a^2 - 5", "b - 3", "2*a - c + 1"]),
    ],
)
def test_points_over_number_fields_have_an_equation_for_each_parameter(condition, others, names, expected):
    points = lift_conjugate_points(zeros(condition, *others), names, random.Random(1))
    assert [[*map(str, equations)] for equations, _ in points] == [expected]


def test_points_over_number_fields_have_to_be_there_modulo_all_primes_but_one():
    result = zeros(lambda a: a**2 - 5)
    there = [p for p in FIELD_PRIMES if result[p]]
    assert lift_conjugate_points({**result, there[0]: []}, "a", random.Random(1))  # one is let off
    assert not lift_conjugate_points({**result, there[0]: [], there[1]: []}, "a", random.Random(1))


@pytest.mark.parametrize("spoilt", [False, True])
def test_a_product_is_factored_and_has_to_agree_modulo_the_last_prime(spoilt):
    expected = {"a^2 + 2*b^2 - 3", "a*b - 2"}
    hypersurfaces = {}
    for p in PRIMES:
        both = [[-3 % p, 0, 0, 1, 0, 2], [-2 % p, 0, 0, 0, 1, 0]]
        hypersurfaces[p] = [[-4 % p, 0, 0, 1, 0, 2], both[1]] if spoilt and p == 41 else both
    results = {str(form) for form, _ in lift_hypersurfaces(hypersurfaces, ["a", "b"])}
    assert results == ({"a*b - 2"} if spoilt else expected)


LYNESS = map_file("x y", "y", "(a + b*y^2 + y)/x", a=1, b=1)
CASES = [
    (THREE_LINES, ["g1", "g2"], 6, 67),
    (LOTKA_VOLTERRA, ["A", "B", "C"], 3, 23),
    (LYNESS, ["a", "b"], 5, 31),  # an equation of degree 2 in the point
]


def degrees_of(file, names, prime, points, terms, bound, seed=1, **kernel):
    family = Family(map_with_symbols(file, names), prime)
    return family.degrees(np.array(points), None, terms, bound, random.Random(seed), **kernel).tolist()


@pytest.mark.parametrize(("file", "names", "terms", "prime"), CASES)
def test_the_compiled_loop_and_flint_give_the_same_degrees_on_the_same_lines(file, names, terms, prime):
    pytest.importorskip("numba")
    points = [[random.Random(k).randrange(prime) for k in range(i, i + len(names))] for i in range(40)]
    compiled, plain = (degrees_of(file, names, prime, points, terms, 400, kernel=k) for k in ("numba", "numpy"))
    assert compiled == plain
    assert len({*map(tuple, compiled)}) > 1  # members are told from each other


def test_special_members_have_smaller_degrees():
    points = [[1, 1], [1, 2], [2, 3], [5, 6], [3, 12]]
    results = [degrees_of(THREE_LINES, ["g1", "g2"], 8179, points, 7, 300, seed) for seed in (1, 2)]
    assert np.max(results, axis=0).tolist() == [
        [2, 4, 8, 13, 20, 28, 38],  # zander-2021
        [2, 4, 7, 12, 18, 25, 34],
        [2, 4, 7, 11, 16, 23, 31],
        [2, 4, 7, 12, 20, 33, 54],
        [2, 4, 8, 16, 32, 64, 128],
    ]


@pytest.mark.parametrize("kernel", ["numba", "numpy"])
def test_an_iterate_defined_nowhere_is_reported(kernel):
    if kernel == "numba":
        pytest.importorskip("numba")
    vanishing = 'variables = ["x"]\nparameters.a = 1\n[bilinear]\nequations = ["a*(X - x) = eps*a*x*X"]'
    result = degrees_of(parse_system(vanishing), ["a"], 13, [[2], [0]], 2, 99, kernel=kernel)
    assert result == [[1, 1], [NOWHERE, NOWHERE]]
