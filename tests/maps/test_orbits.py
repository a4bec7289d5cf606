"""Orbits x, Phi(x), Phi^2(x), ...: lazy, exact, and with an end that says what happened.

Specified here: the points are those of the map, one after the other and only when asked for; each way to end
(completed, periodic, singular, budget, precision, interrupted) with its step and its sentence, and that all before it
is delivered. With a structure, walked in normal form, all that is the same, and balls stay narrow; iterates that are
reached directly are points of the orbit.
"""

from __future__ import annotations

import signal
from itertools import product
from threading import get_ident

import pytest
from flint import fmpq
from helpers import (
    EULER_TOP,
    HENON_HEILES,
    LOTKA_VOLTERRA,
    encloses,
    over_all_fields,
    over_named_systems,
    random_point,
    step_or_none,
    systems_with_points,
)
from hypothesis import assume, given, settings
from planar_helpers import (
    STARTS,
    before,
    over_members,
    over_split,
    side_by_side,
    structure_and_system,
)

from kahanmaps.algebra.fields import GF, QQ, RR
from kahanmaps.algebra.written.text import parse_number
from kahanmaps.errors import BadPrime, InexactNumber, InputError
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.orbits.integer_steps import IntegerPoint, IntegerSteps
from kahanmaps.maps.orbits.iteration import DEFAULT_MAX_DIGITS, Iterates, Orbit, OrbitEnd, OrbitPoint
from kahanmaps.systems.quadratic import QuadraticSystem

RICCATI = QuadraticSystem.from_text(["x"], ["x^2"])
FALL = QuadraticSystem.from_text(["x", "v"], ["v", "1"])  # det(I - eps f') = 1: never singular, over any field
OSCILLATOR = QuadraticSystem.from_text(["x", "y"], ["y", "-x"])


def henon_heiles(**options) -> Orbit:
    return Orbit(KahanMap(HENON_HEILES, "1/10"), ["1/5", "1/7", 0, "1/3"], **{"steps": 6, **options})


def ended(orbit: Orbit) -> OrbitEnd:
    """Walks the orbit to its end."""
    for _ in orbit:
        pass
    return orbit.end


# The points.


@over_named_systems
def test_each_point_is_the_image_of_the_one_before(system):
    phi = KahanMap(system, "1/10")
    points = [point.x for point in Orbit(phi, random_point(system.dim, seed=2), 5)]
    assert points[1:] == [phi.step(x) for x in points[:-1]]


@over_all_fields
def test_the_orbit_begins_with_the_start_as_step_zero(field):
    first = next(iter(Orbit(KahanMap(EULER_TOP, 3, field), [1, 0, 2], 5)))
    assert (first.step, first.x) == (0, KahanMap(EULER_TOP, 3, field).point([1, 0, 2]))


def test_no_steps_deliver_the_start_alone():
    orbit = henon_heiles(steps=0)
    assert [point.step for point in orbit] == [0]
    assert (orbit.end.status, orbit.end.steps) == ("completed", 0)


def test_an_orbit_takes_no_step_before_it_is_asked_for(monkeypatch):
    taken = []
    step = IntegerSteps.step
    monkeypatch.setattr(IntegerSteps, "step", lambda self, point: taken.append(1) or step(self, point))
    walk = iter(henon_heiles(steps=5))
    counts = [len(taken)]
    for _ in range(3):
        next(walk)
        counts.append(len(taken))
    assert counts == [0, 0, 1, 2]


def test_a_stepped_orbit_has_no_end_until_it_is_over():
    orbit = henon_heiles(steps=2)
    ends = [orbit.end for _ in orbit]
    assert ends == [None, None, None]
    assert orbit.end is not None


@settings(max_examples=25)
@given(pair=systems_with_points())
def test_backward_undoes_forward(pair):
    system, x = pair
    phi = KahanMap(system, "1/3")
    there = list(Orbit(phi, x, 3))
    assume(len(there) == 4)
    back = list(Orbit(phi, there[-1].x, 3, backward=True))
    assume(len(back) == 4)
    assert [point.x for point in back] == [point.x for point in reversed(there)]


# A point of an orbit.


@over_all_fields
def test_the_text_of_a_point_parses_back(field):
    *_, last = Orbit(KahanMap(HENON_HEILES, 3, field), [1, 0, 0, 0], 3)
    with field.working():
        assert all(field.equal(field.parse(text), entry) for text, entry in zip(last.text, last.x, strict=True))


def test_the_text_of_a_rational_point_is_in_lowest_terms_and_of_any_length():
    *_, last = Orbit(KahanMap(HENON_HEILES, "1/10"), ["1/5", "1/7", 0, "1/3"], 9)
    assert len(last.text[0]) > 10_000  # Python's own str stops at 4300 digits
    assert [parse_number(text) for text in last.text] == list(last.x)
    assert last.text == [QQ.format(entry) for entry in last.x]


@pytest.mark.parametrize(
    ("x", "digits"),
    [((fmpq(9),), 2), ((fmpq(1, 10**100),), 101), ((fmpq(-(10**1000)), fmpq(1, 3)), 1001)],
    ids=["9", "10^-100", "-10^1000/3"],
)
def test_the_digits_of_a_point_are_about_those_of_its_longest_integer(x, digits):
    assert abs(OrbitPoint(0, QQ, IntegerPoint.from_rationals(x)).digits - digits) <= 1


# Completed.


@over_all_fields
def test_an_orbit_that_takes_all_its_steps_is_completed(field):
    end = ended(Orbit(KahanMap(FALL, 3, field), [1, 0], 2))
    assert (end.status in ("completed", "periodic"), end.steps, end.is_whole) == (True, 2, True)


# Singular: x' = x^2 with eps = 1/2 is x~ = x/(1 - x), and 1/5, 1/4, 1/3, 1/2, 1 has no successor.


@pytest.mark.parametrize(
    ("start", "last"), [("1", 0), ("1/2", 1), ("1/3", 2), ("1/5", 4), ("1/20", 19)], ids=lambda value: str(value)
)
def test_an_orbit_that_meets_the_singular_set_ends_there(start, last):
    orbit = Orbit(KahanMap(RICCATI, "1/2"), [start], 100)
    points = [point.x for point in orbit]
    assert (orbit.end.status, orbit.end.steps, orbit.end.is_whole) == ("singular", last, False)
    assert points[-1] == (1,)
    assert len(points) == last + 1


def test_the_end_at_a_singular_point_names_the_step():
    assert ended(Orbit(KahanMap(RICCATI, "1/2"), ["1/5"], 9)).message == (
        "det(I - eps f'(x)) = 0 at step 4: the map has no value there"
    )


def test_backward_the_end_at_a_singular_point_names_the_other_sign():
    assert ended(Orbit(KahanMap(RICCATI, "1/2"), ["-1/5"], 9, backward=True)).message == (
        "det(I + eps f'(x)) = 0 at step 4: the map has no value there"
    )


@pytest.mark.parametrize("field", [GF(11), GF(2**89 - 1), RR(64)], ids=repr)
def test_the_singular_set_is_met_over_other_fields_too(field):
    # 1/2 and 1 are exact also as balls
    end = ended(Orbit(KahanMap(RICCATI, "1/2", field), ["1/2"], 9))
    assert (end.status, end.steps) == ("singular", 1)


# Periodic.

# q'' = -w^2 q + Q(q) with Q homogeneous of degree 2 and eps^2 w^2 = 1: there Phi^4 is the identity.
FOUR_CYCLES = [
    (HENON_HEILES, 1, (1, 2, "1/3", -1)),
    (QuadraticSystem.from_text(["q", "p"], ["p", "-4*q + 7*q^2"]), "1/2", ("2/3", 5)),
    (QuadraticSystem.from_text(["q", "p"], ["p", "-q/9 - q^2"]), 3, (1, "1/7")),
]


@pytest.mark.parametrize(("system", "eps", "start"), FOUR_CYCLES, ids=["henon_heiles", "w = 2", "w = 1/3"])
def test_at_eps_times_w_equal_to_one_every_orbit_has_period_four(system, eps, start):
    end = ended(Orbit(KahanMap(system, eps), start, 10))
    assert (end.status, end.period, end.steps, end.is_whole) == ("periodic", 4, 10, True)


def test_at_another_eps_the_same_orbit_is_not_periodic():
    end = ended(Orbit(KahanMap(HENON_HEILES, "1/2"), (1, 2, "1/3", -1), 5))
    assert (end.status, end.period) == ("completed", None)


def test_a_periodic_orbit_delivers_all_the_steps_that_were_asked_for():
    points = [point.x for point in Orbit(KahanMap(HENON_HEILES, 1), (1, 2, "1/3", -1), 9)]
    assert points[:5] == points[4:9]
    assert len(points) == 10


def test_an_equilibrium_has_period_one():
    assert ended(Orbit(KahanMap(OSCILLATOR, "1/3"), [0, 0], 3)).period == 1


def test_balls_do_not_tell_whether_the_start_came_back():
    end = ended(Orbit(KahanMap(OSCILLATOR, "1/3", RR(64)), [0, 0], 3))
    assert (end.status, end.period) == ("completed", None)


def test_an_orbit_that_stops_just_before_the_start_comes_back_is_completed():
    assert ended(Orbit(KahanMap(OSCILLATOR, 1), [1, 0], 3)).status == "completed"


@pytest.mark.parametrize("prime", [5, 7, 11, 13])
@pytest.mark.parametrize("start", [(1, 2), (3, 1), (2, 2)], ids=str)
def test_over_a_prime_field_the_period_is_the_first_return(prime, start):
    phi = KahanMap(LOTKA_VOLTERRA, 3, GF(prime))
    walked = [phi.point(start)]
    while len(walked) <= prime**2 and (x := step_or_none(phi, walked[-1])) is not None:
        walked.append(x)
    period = walked.index(walked[0], 1) if walked[0] in walked[1:] else None
    assert ended(Orbit(phi, start, prime**2)).period == period


def test_over_a_prime_field_an_orbit_may_return_run_into_a_pole_or_enter_a_cycle_without_its_start():
    # Phi is birational, not injective: where dPhi is singular, different points have one image.
    phi = KahanMap(LOTKA_VOLTERRA, 3, GF(7))
    ends = {start: ended(Orbit(phi, start, 49)).status for start in product(range(7), repeat=2)}
    assert set(ends.values()) == {"periodic", "singular", "completed"}
    start = next(start for start, status in ends.items() if status == "completed")
    visited = [point.x for point in Orbit(phi, start, 49)]
    assert visited[0] not in visited[1:]
    assert len(set(map(str, visited))) < len(visited)


# Budget.


def test_an_orbit_ends_before_its_numbers_exceed_the_budget():
    orbit = henon_heiles(steps=50, max_digits=500)
    digits = [point.digits for point in orbit]
    assert orbit.end.status == "budget"
    assert orbit.end.steps == len(digits) - 1
    assert max(digits) <= 500
    beyond = list(henon_heiles(steps=len(digits)))[-1]
    assert beyond.digits > 500


def test_the_end_at_the_budget_says_how_many_digits_the_next_step_has():
    end = ended(henon_heiles(steps=50, max_digits=500))
    beyond = list(henon_heiles(steps=end.steps + 1))[-1]
    assert f"step {end.steps + 1} has numbers of {beyond.digits} digits, more than the budget of 500" in end.message


def test_a_start_beyond_the_budget_is_delivered_and_nothing_else():
    orbit = Orbit(KahanMap(RICCATI, "1/2"), [fmpq(1, 10**30)], 5, max_digits=20)
    assert [point.x for point in orbit] == [(fmpq(1, 10**30),)]
    assert (orbit.end.status, orbit.end.steps) == ("budget", 0)
    assert orbit.end.message.startswith("step 0 has numbers of 31 digits, more than the budget of 20")


def test_without_word_the_budget_protects_a_non_integrable_orbit():
    end = ended(Orbit(KahanMap(LOTKA_VOLTERRA, "1/10"), ["1/2", "1/3"], 1000))
    assert (end.status, end.steps < 30) == ("budget", True)
    assert str(DEFAULT_MAX_DIGITS) in end.message


def test_a_budget_of_none_lifts_the_limit():
    start = [fmpq(1, 10 ** (DEFAULT_MAX_DIGITS + 10))]
    assert ended(Orbit(KahanMap(RICCATI, "1/2"), start, 1)).status == "budget"
    assert ended(Orbit(KahanMap(RICCATI, "1/2"), start, 1, max_digits=None)).status == "completed"


def test_modulo_a_prime_there_is_nothing_to_budget():
    phi = KahanMap(HENON_HEILES, "1/10", GF(2**89 - 1))
    assert ended(Orbit(phi, [1, 2, 3, 4], 200, max_digits=1)).status == "completed"


# Precision.


def test_balls_that_have_grown_too_wide_end_the_orbit():
    orbit = Orbit(KahanMap(HENON_HEILES, "1/10", RR(30)), ["1/5", "1/7", 0, "1/3"], 10_000)
    delivered = sum(1 for _ in orbit)
    assert (orbit.end.status, orbit.end.steps) == ("precision", delivered - 1)
    assert "more bits" in orbit.end.message


# Interrupted.


@over_all_fields
def test_an_interrupted_orbit_ends_after_the_point_in_hand(field):
    orbit = Orbit(KahanMap(FALL, 3, field), [1, 0], 100)
    delivered = []
    for point in orbit:
        delivered.append(point.step)
        if point.step == 2:
            orbit.interrupt()
    assert delivered == [0, 1, 2]
    assert (orbit.end.status, orbit.end.steps, orbit.end.message) == ("interrupted", 2, "interrupted after step 2")


def test_an_interruption_at_the_last_step_comes_too_late():
    orbit = henon_heiles(steps=2)
    for point in orbit:
        if point.step == 2:
            orbit.interrupt()
    assert orbit.end.status == "completed"


def test_an_orbit_interrupted_after_the_start_came_back_keeps_the_period():
    orbit = Orbit(KahanMap(OSCILLATOR, 1), [1, 0], None)
    for point in orbit:
        if point.step == 6:
            orbit.interrupt()
    assert (orbit.end.status, orbit.end.period) == ("interrupted", 4)


# What is refused.


def test_a_start_of_another_dimension_is_refused():
    with pytest.raises(InputError, match="2 coordinates, expected 4: q1, q2, p1, p2"):
        Orbit(KahanMap(HENON_HEILES, 1), [1, 2], 3)


@over_all_fields
def test_a_machine_number_in_the_start_is_refused(field):
    with pytest.raises(InexactNumber):
        Orbit(KahanMap(RICCATI, 3, field), [0.5], 3)


# In normal form.


def both(system, structure, eps, start, steps, field=QQ, **options):
    """Points and end of an orbit walked without and with a structure."""
    answers = []
    for known in (None, structure):
        orbit = Orbit(KahanMap(system, eps, field), start, steps, structure=known, **options)
        answers.append(([point.text for point in orbit], orbit.end))
    return answers


@over_members
@pytest.mark.parametrize("backward", [False, True], ids=["forward", "backward"])
def test_with_a_structure_the_points_and_the_end_are_the_same(name, backward):
    structure, system = structure_and_system(name)
    plain, fast = both(system, structure, "1/10", random_point(system.dim, 3), 9, backward=backward)
    assert fast == plain


ENDS = [
    (("delta = 1, a vertex", "h = 0"), "periodic"),
    (("delta = 1, a vertex", "the origin"), "periodic"),
    (("h = 0", "the origin"), "periodic"),
    (("delta = 1, a vertex", "a double root"), "completed"),
    (("three real roots, irrational", "the origin"), "completed"),
    (("level 0", "a triple root, level 0"), "completed"),
    (("no value at the start", "level 0"), "singular"),
    (("a pole at step 2", "level 0"), "singular"),
    (("a pole at step 3", "a pole at step 2"), "singular"),
    (("period 5 but for a pole", "delta = 1"), "singular"),
    (("delta = 1, a pole at step 3", "a double root"), "singular"),
    (("a pole at step 6", "level 0"), "singular"),
]


@pytest.mark.parametrize(("names", "status"), ENDS, ids=str)
@pytest.mark.parametrize("backward", [False, True], ids=["forward", "backward"])
def test_with_a_structure_every_end_is_the_same(names, status, backward):
    system, structure, start = side_by_side(*names)
    # -eps and backward is forward.
    eps = fmpq(-1, 2) if backward else fmpq(1, 2)
    (plain, end), (fast, fast_end) = both(system, structure, eps, start, 10, backward=backward)
    assert fast_end == end
    assert end.status == status
    assert fast == plain


@pytest.mark.parametrize("more", [2, 3, 10, 20])
def test_with_a_structure_a_late_pole_ends_the_orbit_at_the_same_step(more):
    cubic, start = STARTS["a pole at step 5"]
    U, V, W = before(cubic, start, more)
    system, structure, (_, u, _, v) = side_by_side("a pole at step 5", "level 0")
    (_, end), (_, fast_end) = both(system, structure, "1/2", (fmpq(U, W), u, fmpq(V, W), v), 40)
    assert fast_end == end
    assert (end.status, end.steps) == ("singular", more + 4)


@over_split
def test_with_a_structure_the_budget_ends_at_the_same_step(name):
    structure, system = structure_and_system(name)
    orbits = [
        Orbit(KahanMap(system, "1/10"), random_point(system.dim, 3), 100, structure=known, max_digits=300)
        for known in (None, structure)
    ]
    ends = [ended(orbit) for orbit in orbits]
    assert ends[0] == ends[1]
    assert ends[0].status == "budget"
    assert "more than the budget of 300 (--max-digits)" in ends[1].message


@pytest.mark.parametrize("name", ["m = 2", "m = 3", "m = 2, sqrt 2", "m = 2, i", "m = 3, partly split"])
@pytest.mark.parametrize("backward", [False, True], ids=["forward", "backward"])
def test_balls_with_a_structure_enclose_the_orbit_and_stay_narrow(name, backward):
    structure, system = structure_and_system(name)
    start = tuple(fmpq(k + 1, 7) for k in range(system.dim))
    bits = 500
    phi = KahanMap(system, "1/10", RR(bits))
    balls = [point.x for point in Orbit(phi, start, 100, structure=structure, backward=backward)]
    assert len(balls) == 101
    assert min(ball.rel_accuracy_bits() for x in balls[1:] for ball in x) > bits / 2
    for point in Orbit(KahanMap(system, "1/10"), start, 30, backward=backward, max_digits=2000):
        assert all(encloses(ball, number) for ball, number in zip(balls[point.step], point.x, strict=True))


def test_an_orbit_in_normal_form_is_interrupted_like_any_other():
    structure, system = structure_and_system("m = 2")
    orbit = Orbit(KahanMap(system, "1/10"), [1, 2, 3, 4], 100, structure=structure)
    for point in orbit:
        if point.step == 7:
            orbit.interrupt()
    assert (orbit.end.status, orbit.end.steps) == ("interrupted", 7)


# Iterates reached directly.


def test_iterates_given_up_within_the_first_jump_end_after_step_0(monkeypatch):
    structure, system = structure_and_system("m = 2")
    iterates = Iterates(KahanMap(system, "1/10"), [1, 2, 3, 4], [30, 60], structure=structure)

    def points():
        iterates._busy_in = get_ident()
        iterates.interrupt()  # as a signal does in the middle of a far iterate
        yield

    monkeypatch.setattr(iterates, "_points", points)
    assert list(iterates) == []
    assert iterates.end == OrbitEnd("interrupted", 0, "interrupted after step 0")


@pytest.mark.parametrize("field", [QQ, GF(10007), GF(2**89 - 1)], ids=repr)
@pytest.mark.parametrize("name", ["m = 1", "m = 2", "m = 3, another J", "m = 2, sqrt 2"])
@pytest.mark.parametrize("backward", [False, True], ids=["forward", "backward"])
def test_iterates_are_points_of_the_orbit(name, field, backward):
    structure, system = structure_and_system(name)
    phi, start = KahanMap(system, "1/10", field), random_point(system.dim, 3, height=3)
    points = [point.text for point in Orbit(phi, start, 27, backward=backward)]
    iterates = Iterates(phi, start, [27, 0, 3, 26, 3], structure=structure, backward=backward)
    assert [(point.step, point.text) for point in iterates] == [(n, points[n]) for n in (0, 3, 26, 27)]
    assert iterates.end == OrbitEnd("completed", 27, "4 iterates reached directly")


def test_iterates_of_balls_enclose_the_orbit():
    structure, system = structure_and_system("m = 2")
    start = [1, "1/2", "1/3", 2]
    exact = [point.x for point in Orbit(KahanMap(system, "1/10"), start, 30)]
    for point in Iterates(KahanMap(system, "1/10", RR(300)), start, [1, 20, 30], structure=structure):
        assert all(encloses(ball, number) for ball, number in zip(point.x, exact[point.step], strict=True))


def test_iterates_stop_at_a_pole_on_the_way_over_q():
    system, structure, start = side_by_side("a pole at step 3", "level 0")
    iterates = Iterates(KahanMap(system, "1/2"), start, [0, 2, 30, 40], structure=structure)
    assert [point.step for point in iterates] == [0, 2]
    assert iterates.end == OrbitEnd("singular", 2, "step 30 cannot be reached: the map has no value at step 2")


def test_iterates_stop_where_numbers_would_be_too_long():
    structure, system = structure_and_system("m = 2")
    iterates = Iterates(KahanMap(system, "1/10"), [1, 2, 3, 4], [5, 10**5, 10**6], structure=structure, max_digits=1000)
    assert [point.step for point in iterates] == [5]
    assert (iterates.end.status, iterates.end.steps) == ("budget", 5)
    assert iterates.end.message.startswith("step 100000 cannot be reached: step ")
    assert "more than the budget of 1000 (--max-digits)" in iterates.end.message


def test_iterates_of_balls_too_wide_say_so():
    structure, system = structure_and_system("m = 2")
    iterates = Iterates(KahanMap(system, "1/10", RR(10)), [1, "1/3", 3, "1/7"], [1, 10**12], structure=structure)
    assert [point.step for point in iterates] == [1]
    assert (iterates.end.status, iterates.end.steps) == ("precision", 1)


def test_iterates_are_interrupted_between_two():
    structure, system = structure_and_system("m = 2")
    iterates = Iterates(KahanMap(system, "1/10", GF(101)), [1, 2, 3, 4], [1, 2, 3], structure=structure)
    for point in iterates:
        if point.step == 2:
            iterates.interrupt()
    assert (iterates.end.status, iterates.end.steps) == ("interrupted", 2)


def test_iterates_before_the_start_are_refused():
    structure, system = structure_and_system("m = 2")
    with pytest.raises(InputError, match="found -3 steps"):
        Iterates(KahanMap(system, "1/10"), [1, 2, 3, 4], [1, -3], structure=structure)


def test_iterates_modulo_a_prime_without_planes_are_refused():
    structure, system = structure_and_system("m = 3")
    with pytest.raises(BadPrime):
        Iterates(KahanMap(system, 3, GF(2)), [1] * 6, [5], structure=structure)


def test_an_iterate_in_flight_is_given_up_when_a_signal_asks_for_it():
    structure, system = structure_and_system("m = 2")
    orbit = Iterates(KahanMap(system, "1/10"), random_point(4, 3), [5, 3000], structure=structure, max_digits=10**9)
    seen = []

    def handler(signum, frame):
        orbit.interrupt()

    previous = signal.signal(signal.SIGALRM, handler)
    try:
        for point in orbit:
            seen.append(point.step)
            signal.setitimer(signal.ITIMER_REAL, 0.2)  # the iterate 3000 takes seconds
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)
    assert seen == [5]
    assert (orbit.end.status, orbit.end.steps) == ("interrupted", 5)
