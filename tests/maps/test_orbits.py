"""Orbits x, Phi(x), Phi^2(x), ...: lazy, exact, and with an end that says what happened.

With a structure, walked in normal form, all that is the same, and balls stay narrow.
"""

import csv
import io
import json
import signal

import numpy as np
import pytest
from flint import fmpq
from helpers import (
    EULER_TOP,
    HENON_HEILES,
    LOTKA_VOLTERRA,
    encloses,
    ended,
    over_all_fields,
    over_named_systems,
    random_point,
    step_or_none,
    systems_with_points,
)
from hypothesis import assume, given
from planar_helpers import over_members, side_by_side, structure_and_system

import kahanmaps as km
from kahanmaps.algebra.fields import GF, QQ, RR
from kahanmaps.algebra.parsing import parse_number
from kahanmaps.checks.conserve import functions_along
from kahanmaps.documents.catalog import load
from kahanmaps.family.random_members import random_member_with_eigenvalues
from kahanmaps.family.system_normal_form import NoNormalForm, system_normal_form
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.orbits import writers
from kahanmaps.maps.orbits.iteration import Orbit, OrbitEnd
from kahanmaps.maps.orbits.methods import choose_method
from kahanmaps.maps.orbits.orbit import bits_for, orbit
from kahanmaps.maps.orbits.writers import writer_to
from kahanmaps.systems.quadratic import QuadraticSystem

RICCATI = QuadraticSystem.from_text(["x"], ["x^2"])
FALL = QuadraticSystem.from_text(["x", "v"], ["v", "1"])  # det(I - eps f') = 1: never singular, over any field


def henon_heiles(**options) -> Orbit:
    return Orbit(KahanMap(HENON_HEILES, "1/10"), ["1/5", "1/7", 0, "1/3"], **{"steps": 6, **options})


@over_named_systems
def test_each_point_is_the_image_of_the_one_before(system):
    phi = KahanMap(system, "1/10")
    points = [point.x for point in Orbit(phi, random_point(system.dim, seed=2), 5)]
    assert points[1:] == [phi.step(x) for x in points[:-1]]


@given(pair=systems_with_points())
def test_backward_undoes_forward(pair):
    system, x = pair
    phi = KahanMap(system, "1/3")
    there = list(Orbit(phi, x, 3))
    assume(len(there) == 4)
    back = list(Orbit(phi, there[-1].x, 3, backward=True))
    assume(len(back) == 4)
    assert [point.x for point in back] == [point.x for point in reversed(there)]


def test_the_text_of_a_rational_point_is_in_lowest_terms_and_of_any_length():
    *_, last = Orbit(KahanMap(HENON_HEILES, "1/10"), ["1/5", "1/7", 0, "1/3"], 9)
    assert len(last.text[0]) > 10_000  # Python's own str stops at 4300 digits
    assert [parse_number(text) for text in last.text] == list(last.x)
    assert last.text == [QQ.format(entry) for entry in last.x]


# Singular: x' = x^2 with eps = 1/2 is x~ = x/(1 - x), and 1/5, 1/4, 1/3, 1/2, 1 has no successor.


@pytest.mark.parametrize(
    ("start", "last"), [("1", 0), ("1/2", 1), ("1/3", 2), ("1/5", 4), ("1/20", 19)], ids=lambda value: str(value)
)
def test_an_orbit_that_meets_the_singular_set_ends_there(start, last):
    orbit = Orbit(KahanMap(RICCATI, "1/2"), [start], 100)
    points = [point.x for point in orbit]
    assert (orbit.end.status, orbit.end.steps, orbit.end.is_complete) == ("singular", last, False)
    assert points[-1] == (1,)
    assert len(points) == last + 1


# q'' = -w^2 q + Q(q) with Q homogeneous of degree 2 and eps^2 w^2 = 1: there Phi^4 is the identity.
FOUR_CYCLES = [
    (HENON_HEILES, 1, (1, 2, "1/3", -1)),
    (QuadraticSystem.from_text(["q", "p"], ["p", "-4*q + 7*q^2"]), "1/2", ("2/3", 5)),
    (QuadraticSystem.from_text(["q", "p"], ["p", "-q/9 - q^2"]), 3, (1, "1/7")),
]


@pytest.mark.parametrize(("system", "eps", "start"), FOUR_CYCLES, ids=["henon_heiles", "w = 2", "w = 1/3"])
def test_at_eps_times_w_equal_to_one_every_orbit_has_period_four(system, eps, start):
    end = ended(Orbit(KahanMap(system, eps), start, 10))
    assert (end.status, end.period, end.steps, end.is_complete) == ("periodic", 4, 10, True)


@pytest.mark.parametrize(("prime", "start"), [(5, (1, 2)), (7, (3, 1)), (11, (2, 2)), (13, (1, 2))])
def test_over_a_prime_field_the_period_is_the_first_return(prime, start):
    phi = KahanMap(LOTKA_VOLTERRA, 3, GF(prime))
    walked = [phi.point(start)]
    while len(walked) <= prime**2 and (x := step_or_none(phi, walked[-1])) is not None:
        walked.append(x)
    period = walked.index(walked[0], 1) if walked[0] in walked[1:] else None
    assert ended(Orbit(phi, start, prime**2)).period == period


def test_an_orbit_ends_before_its_numbers_exceed_the_budget():
    orbit = henon_heiles(steps=50, max_digits=500)
    digits = [point.digits for point in orbit]
    assert orbit.end.status == "budget"
    assert orbit.end.steps == len(digits) - 1
    assert max(digits) <= 500
    assert list(henon_heiles(steps=len(digits)))[-1].digits > 500


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


def both(system, normal_form, eps, start, steps, field=QQ, **options):
    """Points and end of an orbit walked without and with a structure."""
    answers = []
    for known in (None, normal_form):
        orbit = Orbit(KahanMap(system, eps, field), start, steps, normal_form=known, **options)
        answers.append(([point.text for point in orbit], orbit.end))
    return answers


@over_members
@pytest.mark.parametrize("backward", [False, True], ids=["forward", "backward"])
def test_with_a_structure_the_points_and_the_end_are_the_same(name, backward):
    normal_form, system = structure_and_system(name)
    plain, fast = both(system, normal_form, "1/10", random_point(system.dim, 3), 9, backward=backward)
    assert fast == plain


ENDS = [
    (("delta = 1, a vertex", "h = 0"), "periodic"),
    (("h = 0", "the origin"), "periodic"),
    (("delta = 1, a vertex", "a double root"), "completed"),
    (("three real roots, irrational", "the origin"), "completed"),
    (("level 0", "a triple root, level 0"), "completed"),
    (("no value at the start", "level 0"), "singular"),
    (("a pole at step 2", "level 0"), "singular"),
    (("a pole at step 3", "a pole at step 2"), "singular"),
    (("delta = 1, a pole at step 3", "a double root"), "singular"),
]


@pytest.mark.parametrize(("names", "status"), ENDS, ids=str)
def test_with_a_structure_every_end_is_the_same(names, status):
    system, normal_form, start = side_by_side(*names)
    (plain, end), (fast, fast_end) = both(system, normal_form, fmpq(1, 2), start, 10)
    assert fast_end == end
    assert end.status == status
    assert fast == plain


@pytest.mark.parametrize(("name", "backward"), [("m = 2", False), ("m = 2, i", False), ("m = 3, partly split", True)])
def test_balls_with_a_structure_enclose_the_orbit_and_stay_narrow(name, backward):
    normal_form, system = structure_and_system(name)
    start = tuple(fmpq(k + 1, 7) for k in range(system.dim))
    bits = 500
    phi = KahanMap(system, "1/10", RR(bits))
    balls = [point.x for point in Orbit(phi, start, 100, normal_form=normal_form, backward=backward)]
    assert len(balls) == 101
    assert min(ball.rel_accuracy_bits() for x in balls[1:] for ball in x) > bits / 2
    for point in Orbit(KahanMap(system, "1/10"), start, 30, backward=backward, max_digits=2000):
        assert all(encloses(ball, number) for ball, number in zip(balls[point.step], point.x, strict=True))


@pytest.mark.parametrize("field", [QQ, GF(2**89 - 1)], ids=repr)
@pytest.mark.parametrize(("name", "backward"), [("m = 3, another J", True), ("m = 2, sqrt 2", False)])
def test_iterates_are_points_of_the_orbit(name, field, backward):
    normal_form, system = structure_and_system(name)
    phi, start = KahanMap(system, "1/10", field), random_point(system.dim, 3, height=3)
    points = [point.text for point in Orbit(phi, start, 27, backward=backward)]
    iterates = Orbit(phi, start, at=[27, 0, 3, 26, 3], normal_form=normal_form, backward=backward)
    assert [(point.step, point.text) for point in iterates] == [(n, points[n]) for n in (0, 3, 26, 27)]
    assert iterates.end == OrbitEnd("completed", 27, "4 iterates computed directly")


def test_an_iterate_in_flight_is_given_up_when_a_signal_asks_for_it():
    normal_form, system = structure_and_system("m = 2")
    orbit = Orbit(KahanMap(system, "1/10"), random_point(4, 3), at=[5, 3000], normal_form=normal_form, max_digits=10**9)
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


SPLIT, _ = structure_and_system("m = 2")
UNSPLIT, _ = structure_and_system("m = 2, sqrt 2")
NONE = NoNormalForm("H is not a homogeneous cubic")


@pytest.mark.parametrize(
    ("requested", "arithmetic", "normal_form", "at", "expected"),
    [
        (None, "mod", NONE, (10**9,), "generic"),
        ("generic", "exact", SPLIT, (10**9,), "generic"),
        (None, "exact", UNSPLIT, None, "normal-form"),
        (None, "float", UNSPLIT, None, "normal-form"),
        (None, "float", SPLIT, (10**9,), "normal-form"),
        (None, "ball", UNSPLIT, None, "normal-form"),
        ("normal-form", "exact", SPLIT, None, "normal-form"),
        ("normal-form", "ball", UNSPLIT, None, "normal-form"),
        ("doubling", "exact", UNSPLIT, (3,), "doubling"),
        ("doubling", "mod", SPLIT, (3,), "doubling"),
        # Iterates wanted alone are reached directly from a certain step on, where they are few.
        (None, "exact", SPLIT, (23,), "normal-form"),
        (None, "exact", SPLIT, (24,), "doubling"),
        (None, "exact", SPLIT, (1, 2, 3, 4, 5, 40), "normal-form"),
        (None, "exact", SPLIT, (1, 2, 3, 40), "doubling"),
        (None, "exact", UNSPLIT, (24,), "doubling"),
        (None, "exact", UNSPLIT, tuple(range(10, 25)), "normal-form"),
        (None, "mod", UNSPLIT, (9_999,), "generic"),
        (None, "mod", UNSPLIT, (10_000,), "doubling"),
        (None, "mod", UNSPLIT, tuple(range(10_001)), "doubling"),
        (None, "ball", SPLIT, (0,), "normal-form"),
        (None, "ball", SPLIT, (1,), "doubling"),
        (None, "exact", SPLIT, (), "normal-form"),
    ],
)
def test_the_method_follows_from_what_is_asked_for(requested, arithmetic, normal_form, at, expected):
    result = choose_method(requested, arithmetic, normal_form, at)
    assert result.name == expected
    assert result.text == f"method {expected}: {result.reason}"


TOP = load("euler_top")
ARITHMETICS = ["exact", "float", "mod:101", "ball:100"]


def walk(arithmetic="exact", **options):
    orbit = km.orbit(TOP, [1, "1/2", "-1/3"], "1/10", **({"steps": 4} | options), arithmetic=arithmetic)
    orbit.integrals = functions_along(TOP, [("", "F1"), ("p", "1/(x1 - 1)")], arithmetic == "float")
    return orbit


def read(path):
    """The texts of the points in a file, and its first and last record."""
    if path.suffix == ".jsonl":
        header, *points, end = map(json.loads, path.read_text().splitlines())
        return [[str(entry) for entry in point["x"]] for point in points], header, end
    if path.suffix == ".csv":
        meta = json.loads(path.with_name("o.csv.meta.json").read_text())
        _, *rows = csv.reader(path.read_text().splitlines())
        return [row[1:4] for row in rows], meta["header"], meta["end"]
    with np.load(path) as held:
        meta, x = json.loads(str(held["meta"])), held["x"].tolist()
    return [[e.decode() if isinstance(e, bytes) else str(e) for e in row] for row in x], meta["header"], meta["end"]


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize("ending", ["csv", "jsonl", "npz"])
def test_what_is_written_is_read_again(tmp_path, arithmetic, ending):
    path = tmp_path / f"o.{ending}"
    status = walk(arithmetic).write(path, name="top").status
    points, header, end = read(path)
    assert (status, end["status"], header["system"]) == ("completed", "completed", "top")
    assert points == [list(point.text) for point in walk(arithmetic)]


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_a_table_has_the_values_of_integrals_and_none_at_a_pole(arithmetic):
    rows = walk(arithmetic).rows()
    assert list(rows[0]) == ["step", *TOP.variables, "F1", "p"]
    assert rows[0]["p"] is None
    assert rows[1]["p"] is not None
    if arithmetic in ("exact", "mod:101"):
        assert len({row["F1"] for row in rows}) == 1


NEAR = random_member_with_eigenvalues([1, fmpq(10001, 10000), fmpq(10002, 10000)], seed=23)
NORMAL_FORM = system_normal_form(NEAR.chosen.system, member=NEAR)
START = [fmpq(0), fmpq(3, 29), fmpq(2, 27), fmpq(-3, 29), fmpq(3, 26), fmpq(-1, 23)]


@pytest.mark.parametrize("digits", [15, 60])
@pytest.mark.parametrize(
    "steps", [{"steps": 10}, {"steps": 300}, {"at": [1000]}, {"at": [10, 100, 1000, 10000, 100000]}], ids=str
)
def test_points_by_steps_and_by_jumps_are_as_accurate_as_asked_for(steps, digits):
    system, eps, start, normal_form = EULER_TOP, "1/10", [1, 2, 3], None
    if "at" in steps:
        system, eps, start, normal_form = NEAR.chosen.system, "1/20", START, NORMAL_FORM

    def orbit_with(bits):
        return Orbit(KahanMap(system, eps, RR(bits)), start, normal_form=normal_form, **steps)

    orbit = orbit_with(bits_for(orbit_with, digits))
    for point in orbit:
        largest = max(abs(float(entry.mid())) for entry in point.x)
        assert max(float(entry.rad()) for entry in point.x) <= 10.0**-digits * largest
    assert (orbit.end.status, orbit.end.steps) == ("completed", steps["at"][-1] if "at" in steps else steps["steps"])


def test_a_csv_file_has_the_characters_of_repr_with_and_without_pyarrow(monkeypatch):
    pytest.importorskip("pyarrow")
    rng = np.random.default_rng(1)
    numbers = np.frombuffer(rng.bytes(8 * 20_000))
    rounder = [np.exp(rng.uniform(-30, 40, 20_000)), np.arange(-50.0, 50), [-0.0, 1e-310, 1e16]]
    numbers = np.concatenate([numbers[np.isfinite(numbers)], *rounder])
    x = numbers[: len(numbers) // 3 * 3].reshape(-1, 3)
    expected = [",".join([str(7 + 5 * k), *map(repr, row)]) for k, row in enumerate(x.tolist())]
    written = []
    for least in (1, 10**9):
        monkeypatch.setattr(writers, "_MIN_ARROW_ROWS", least)
        stream = io.StringIO()
        writers.Csv(stream, "xyz", ()).portion(7, 5, x)
        written.append(stream.getvalue().splitlines())
    assert written[0] == written[1] == expected


@pytest.mark.parametrize("form", ["text", "json", "jsonl", "csv", "npz", "parquet", "npy"])
@pytest.mark.parametrize("kind", ["complete", "early"])
def test_portions_of_a_float_orbit_give_the_same_file_as_its_points(tmp_path, monkeypatch, form, kind):
    if form == "parquet":
        pytest.importorskip("pyarrow")
    monkeypatch.setattr("kahanmaps.maps.floats.ensemble._RECORDED_NUMBERS", 12)  # so that there are many portions
    system, start, eps = load("euler_top"), [1, "1/2", "1/3"], "1/10"
    if kind == "early":
        system, start, eps = QuadraticSystem.from_text(["x"], ["x"]), [1], "99/101"  # x~ = 100 x overflows at step 155

    def made():
        return orbit(system, start, eps, steps=200, every=3, exact=False)

    made().write(tmp_path / f"a.{form}", form)
    rows = [[point.step, *point.x] for point in made()]
    assert len(rows) == (67 if kind == "complete" else 52)
    if form in ("npz", "npy"):
        held = np.load(tmp_path / f"a.{form}")
        x = held if form == "npy" else held["x"]
        assert x.tolist() == [row[1:] for row in rows]
        assert form == "npy" or held["step"].tolist() == [row[0] for row in rows]
        return
    if form == "parquet":
        import pyarrow.parquet

        table = pyarrow.parquet.read_table(tmp_path / "a.parquet")
        assert [list(row.values()) for row in table.to_pylist()] == rows
        assert json.loads(table.schema.metadata[b"kahanmaps"])["end"]["status"] == made().end.status
        return
    # Point by point, as an orbit with kept points or in another arithmetic is written.
    trajectory = made()
    with writer_to(tmp_path / f"b.{form}", form, trajectory.variables, []) as writer:
        writer.header(trajectory.header())
        for point in trajectory:
            writer.point(point.step, point.text, [])
        writer.end(*trajectory._end_with_float_data(trajectory.end))
    assert (tmp_path / f"a.{form}").read_bytes() == (tmp_path / f"b.{form}").read_bytes()
