"""Cycles on P^n over GF(p): the arrays against a walk by hand, and maps whose cycles are known."""

import itertools
import math
from dataclasses import replace

import pytest
from check_helpers import system_of
from search_helpers import by_formulas

from kahanmaps import GF, TimeLimit, composed_map, cycle_census, load
from kahanmaps.errors import BadPrime, InputError
from kahanmaps.maps.kahan import as_map
from kahanmaps.maps.projective import homogeneous_map

# --- a walk by hand: Python integers, the forms evaluated one monomial after the other -------------------------------


def normalized(values, p):
    lead = next((entry for entry in reversed(values) if entry % p), 0)
    return tuple(entry * pow(lead, -1, p) % p for entry in values) if lead else None


def images_by_hand(map_, eps, p):
    every_forms = [homogeneous_map(factor).forms for factor in as_map(map_).at(eps, GF(p)).factors]
    points = [x for x in itertools.product(range(p), repeat=as_map(map_).dim + 1) if normalized(x, p) == x]
    image = dict(zip(points, points, strict=True))
    for forms in every_forms:
        for start, point in image.items():
            if point is not None:
                terms = [[(int(c), map(int, m)) for m, c in form.terms()] for form in forms]
                values = [sum(c * math.prod(map(pow, point, m)) for c, m in form) for form in terms]
                image[start] = normalized(values, p)
    return image


def census_by_hand(image):
    """Indeterminate, pre-indeterminate and preperiodic points, and the number of cycles by length."""
    indeterminate = sum(point is None for point in image.values())
    pre_indeterminate = preperiodic = 0
    lengths = {}
    for start in image:
        seen, point = {start}, image[start]
        while point is not None and point not in seen:
            seen.add(point)
            point = image[point]
        if point is None:
            pre_indeterminate += image[start] is not None
        elif point == start:
            lengths[len(seen)] = lengths.get(len(seen), 0) + 1
        else:
            preperiodic += 1
    counts = {length: n // length for length, n in sorted(lengths.items())}
    return indeterminate, pre_indeterminate, preperiodic, counts


def counts_of(census):
    return census.indeterminate, census.pre_indeterminate, census.preperiodic, dict(census.lengths)


MAPS = {
    "weierstrass": lambda: load("weierstrass").map,
    "lotka_volterra": lambda: load("lotka_volterra").map,
    "euler_top": lambda: load("euler_top").map,
    "riccati": lambda: load("riccati").map,
    "the minors have a factor in common": lambda: system_of("x y", "y", "x^2"),
    "linear": lambda: system_of("x y", "x + y", "1 - y"),
    "the identity": lambda: system_of("x y", "0", "0"),
    "explicit": lambda: by_formulas("x,y", "y; (3 + y)/x"),
    "explicit, with powers": lambda: by_formulas("x,y", "y; -x + 1/y^3"),
    "a composition": lambda: composed_map(load("lotka_volterra").map, (load("lyness").map, -1)),
}


@pytest.mark.parametrize("name", MAPS)
@pytest.mark.parametrize(("prime", "eps"), [(7, "1/10"), (11, "1/6")])
def test_the_counts_are_those_of_a_walk_by_hand(name, prime, eps):
    map_ = MAPS[name]()
    prime = 5 if name == "euler_top" and prime == 11 else prime
    census = cycle_census(map_, "1/6" if prime == 5 else eps, prime)
    expected = census_by_hand(images_by_hand(map_, census.eps, prime))
    assert counts_of(census) == expected
    assert census.points == census.examined == (prime ** (census.dim + 1) - 1) // (prime - 1)
    assert census.indeterminate + census.pre_indeterminate + census.preperiodic + census.periodic == census.points
    assert census.cycles == sum(census.lengths.values())


def test_more_points_than_one_portion_holds_are_those_of_random_walks():
    """P^2 over GF(257) has 66307 points, portions 65536: samples, which take another way, end in the same ways."""
    complete = cycle_census(load("weierstrass").system, "1/7", 257)
    some = cycle_census(load("weierstrass").system, "1/7", 257, samples=2000, seed=3)
    assert (complete.complete, some.complete, some.open) == (True, False, 0)
    assert set(some.lengths) <= set(complete.lengths)
    # A share of 2000 samples has a standard deviation of at most 0.011.
    assert some.periodic / 2000 == pytest.approx(complete.periodic / complete.points, abs=0.05)
    assert some.pre_indeterminate / 2000 == pytest.approx(complete.pre_indeterminate / complete.points, abs=0.05)
    assert some == cycle_census(load("weierstrass").system, "1/7", 257, samples=2000, seed=3)
    assert some != cycle_census(load("weierstrass").system, "1/7", 257, samples=2000, seed=4)


@pytest.mark.parametrize(
    ("map_", "eps", "lengths"),
    [
        (by_formulas("x", "x + 1"), 1, {1: 1, 101: 1}),
        (by_formulas("x", "2*x"), 1, {1: 2, 100: 1}),  # 2 is a primitive root modulo 101
        (load("riccati").map, "2/11", {1: 1}),  # a constant, for x' = x^2 + x - 1 where 5 eps^2 = 1
    ],
)
def test_the_cycles_of_a_map_of_the_line_are_known(map_, eps, lengths):
    census = cycle_census(map_, eps, 101)
    assert (census.lengths, census.indeterminate, census.pre_indeterminate) == (lengths, 0, 0)


EXCHANGES_LEVELS = "(-2*x^4*y^2-x^4-2*x^2*y-y^2-2)/(x^5*y^2+x^5*y+x^5-x^3*y^2+x^3+x*y^2-x*y+x); (x^2-y)/(x^2*y+1)"


def test_cycles_of_an_integrable_map_are_longer_than_the_bound_of_hasse_and_weil():
    """The map sends the level I = c to I = -c, and a cycle goes through both."""
    assert cycle_census(by_formulas("x,y", EXCHANGES_LEVELS), 1, 47).longest == 114 > 47 + 1 + math.isqrt(4 * 47)


def test_a_map_without_eps_needs_none():
    assert cycle_census(load("mcmillan"), prime=31) == cycle_census(load("mcmillan"), 1, 31)
    with pytest.raises(InputError, match="found None, expected an exact number"):
        cycle_census(load("weierstrass"), prime=31)


def test_a_time_limit_keeps_the_complete_steps_of_random_points():
    def stop(sentence):
        if sentence == "p = 997: step 3 of at most 10000":
            raise TimeLimit

    system = load("lotka_volterra").system
    census = cycle_census(system, "1/7", 997, samples=50, progress=stop)
    assert census == replace(cycle_census(system, "1/7", 997, samples=50, steps=3), is_stopped=True)


@pytest.mark.parametrize(
    ("eps", "prime", "kind", "words"),
    [
        ("1/7", 9, InputError, "9 is composite"),
        ("1/7", 7, BadPrime, "the prime 7 divides the denominator of 1/7"),
        ("7/3", 7, BadPrime, "the prime 7 divides the numerator of eps = 7/3"),
        ("1/7", 3, BadPrime, "the prime 3 divides the denominator of -8/3"),
        ("1/7", 2**61 - 1, InputError, "expected an odd prime below 2147483648"),
    ],
)
def test_wrong_primes_and_eps_are_refused(eps, prime, kind, words):
    with pytest.raises(kind, match=words):
        cycle_census(load("lorenz").system, eps, prime)
