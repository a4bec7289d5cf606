"""One report of everything: it reads no claims, concludes nothing from one eps, and says what it did not do."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from flint import fmpq
from search_helpers import random_system, system

from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import SystemFile, parse_system, read_system
from kahanmaps.documents.inline import System
from kahanmaps.errors import InputError
from kahanmaps.laboratory.analyses import commuting, family, growth, integrals, singularities, symmetries
from kahanmaps.laboratory.analyses.table import ANALYSES
from kahanmaps.laboratory.analysis import Analysis, analyze
from kahanmaps.laboratory.preserve.hirota_kimura import Profile
from kahanmaps.laboratory.preserve.integrals import IntegralSearch
from kahanmaps.laboratory.singular.singularities import Patterns
from kahanmaps.laboratory.symmetry.commuting_over import find_commuting
from kahanmaps.laboratory.vector_field.fixed_points import fixed_points

FURTHER = Path(__file__).parent / "further_systems"
# In dimension 3 singularities come last.
PARTS = tuple(sorted((part.name for part in ANALYSES), key="singularities".__eq__))

PLANE = """variables = ["x", "y"]
[parameters]
a = "3"
b = "1/2"
[system]
rhs = ["a*y", "6*x^2 - b"]
"""
TRUTH = """[density]
phi = "1 - 12*eps^2*a*x"
[catalog]
degrees = [2, 3, 5, 7]
growth = "quadratic"
verdict = "integrable"
codimension = 1
"""
NONSENSE = """[integrals]
lie = "x"
other = "(x^5 + eps)/y"
third = "y"
[density]
phi = "x^7 + 1"
[catalog]
degrees = [1, 2, 3, 4]
growth = "exponential"
dynamical_degree = "x - 5"
verdict = "not integrable"
codimension = 0
relations = [{monomials = "degree <= 2", dimension = 0}]
"""
FOUR = ("x y", "y", "-x + x^2")  # q'' = -q + q^2: at eps = 1 the fourth iterate is the identity


def text_of(found):
    return "\n".join(line.text for _, lines in found.sections for line in lines)


def results(found):
    """Everything but the file itself."""
    return {key: value for key, value in found.to_json().items() if key != "document"}


# What a file claims is not read


@pytest.mark.parametrize(("symbols", "eps"), [((), None), (("a", "b"), None), ((), "1/3"), (("b",), "1/3")])
def test_the_claims_and_facts_of_a_file_are_not_read(symbols, eps):
    found = [
        results(analyze(parse_system(PLANE + claims, "same"), symbols=symbols, eps=eps))
        for claims in ("", TRUTH, NONSENSE)
    ]
    assert found[0] == found[1] == found[2]
    assert found[0]["verdict"]["integrals"] == 1


def test_a_hamiltonian_and_a_member_of_the_family_are_not_read_either():
    for name in ("weierstrass", "harmonic"):
        file = load(name)
        one, other = (results(analyze(each)) for each in (file, SystemFile.from_system(file.system, file.name)))
        assert one.pop("parameters") == {key: str(value) for key, value in file.parameters.items()}
        assert other.pop("parameters") == {}
        assert one == other


def test_another_system_under_the_same_claims_is_seen_to_be_another():
    same = analyze(parse_system(PLANE + TRUTH))
    assert (same.conclusion.integrals, same.conclusion.kind) == (1, "integrable")
    found = analyze(parse_system((PLANE + TRUTH).replace("6*x^2 - b", "6*x^2 - b + y^2/9")))
    assert (found.conclusion.integrals, found.conclusion.kind) == (0, "not integrable")


# One eps says nothing of others


def test_at_an_eps_where_the_map_is_periodic_nothing_is_said_of_others():
    special, generic = analyze(system(*FOUR), eps=1), analyze(system(*FOUR))
    assert (special.conclusion.kind, special.integrals.profile.period) == ("linearisable", 4)
    assert special.conclusion.sentence == (
        "Orbits close after 4 steps (measured): the map is periodic there; bounded growth, dynamical degree 1. "
        "All this at eps = 1 only: other eps may differ."
    )
    assert (generic.conclusion.kind, generic.conclusion.integrals) == ("integrable", 1)
    assert generic.conclusion.growth == "quadratic"
    assert "only" not in generic.conclusion.sentence
    assert generic.integrals.profile.period is None


def test_no_density_is_measured_where_degrees_were_searched_and_undecided_where_they_were_not():
    found = analyze(system("x", "1 + x^2"))

    def status(cut):
        none = replace(found, densities=replace(found.densities, densities=(), degree=4, cut=cut))
        (line,) = dict(none.sections)["measure"]
        return line.status, line.text

    searched, stopped = "no polynomial of degree at most 4", "the time was over"
    assert status("") == ("measured", f"{searched}, and no product of powers of known ones, is a density")
    assert status(stopped) == ("undecided", stopped)


def test_dots_stand_where_more_degrees_are_known_than_shown():
    found = analyze(system("x", "1 + x^2"))

    def told(count):
        cut = replace(found, degrees=replace(found.degrees, degrees=(1,) * (count + 1)))
        (line,) = [line for line in text_of(cut).splitlines() if line.startswith("degrees of the iterates: ")]
        return line.removeprefix("degrees of the iterates: ")

    assert told(12) == ", ".join(["1"] * 12)
    assert told(13) == told(12) + ", ..."


@pytest.mark.slow
def test_henon_heiles_is_not_integrable_at_other_eps():
    generic = analyze(load("henon_heiles"), seconds=4)
    assert (generic.conclusion.kind, generic.conclusion.integrals) == ("not integrable", 1)


def test_a_linear_system_at_one_eps():
    assert analyze(load("harmonic"), eps=1).conclusion.sentence == (
        "The system is linear, and so is its Kahan map; 2 independent integrals in dimension 2; orbits close after 4 "
        "steps (measured). All this at eps = 1 only: other eps may differ."
    )
    assert analyze(load("harmonic")).conclusion.integrals == 1


# Integrals and growth are two findings


@pytest.mark.parametrize("name", ["sir", pytest.param("zhukovski_volterra_2", marks=pytest.mark.slow)])
def test_one_integral_and_exponential_growth(name):
    found = analyze(read_system(FURTHER / "sir.toml") if name == "sir" else load(name), seconds=3)
    assert (found.conclusion.kind, found.conclusion.integrals) == ("not integrable", 1)
    assert found.conclusion.growth == "exponential"
    assert "although there is at least 1 independent integral in dimension 3" in found.conclusion.sentence


def test_quadratic_growth_without_integrals():
    found = analyze(read_system(FURTHER / "painleve_1.toml"))
    assert (found.conclusion.kind, found.conclusion.integrals, found.conclusion.growth) == (
        "integrable",
        0,
        "quadratic",
    )
    assert found.conclusion.sentence.endswith(
        "(explained); no integral in dimension 3 up to degree 10 (relations along orbits)."
    )


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow), pytest.param(2, marks=pytest.mark.slow)])
def test_random_systems_have_nothing(seed):
    found = analyze(random_system(2, seed))
    assert (found.conclusion.kind, found.conclusion.integrals) == ("not integrable", 0)
    assert found.relations == found.densities.densities == ()
    assert "not Hamiltonian" in text_of(found)


def test_a_system_of_the_commuting_family_is_recognised():
    found = analyze(load("nahm_tetrahedral"))
    assert "belongs to the commuting family" in text_of(found)
    assert ("proved", "1 independent integral, as a member of the commuting family") in [
        (line.status, line.text) for line in dict(found.sections)["integrals"]
    ]


# What was not done


def test_where_the_time_is_over_parts_are_skipped_and_told():
    began = time.monotonic()
    found = analyze(load("lagrange_top"), seconds=1e-9)
    assert time.monotonic() - began < 5
    assert found.skipped == [f"{part}: the time was over" for part in PARTS]
    assert [line.text for line in dict(found.sections)["not done"]] == found.skipped
    assert (found.conclusion.kind, found.conclusion.growth) == ("undecided", "unknown")
    # none was found, which is not that there is none
    assert found.conclusion.sentence == "The growth is undecided: degrees not measured; the integrals were not counted."
    data = json.loads(json.dumps(found.to_json()))
    assert (data["verdict"]["integrals"], data["integrals"], data["skipped"]) == (None, None, found.skipped)


@pytest.mark.slow
def test_in_twelve_dimensions_the_time_is_kept():
    names = [f"x{k}" for k in range(12)]
    rhs = [f"x{k}*(x{(k + 1) % 12} - x{(k - 1) % 12})" for k in range(12)]
    began = time.process_time()
    found = analyze(system(" ".join(names), *rhs), seconds=3)
    assert time.process_time() - began < 15
    assert found.conclusion.integrals == 1


def test_a_part_that_gives_up_leaves_the_others(monkeypatch):
    def refuses(*_, **__):
        raise InputError("found 1, expected 2")

    monkeypatch.setattr(symmetries, "linear_symmetries", refuses)
    found = analyze(load("nahm_tetrahedral"))
    assert found.skipped == ["symmetries: found 1, expected 2"]
    assert found.symmetries is None
    assert found.commuting is not None
    assert found.conclusion.kind == "integrable"


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_mistakes_and_interrupts_are_not_swallowed(monkeypatch, error):
    def fails(*_, **__):
        raise error

    monkeypatch.setattr(symmetries, "linear_symmetries", fails)
    with pytest.raises(error):
        analyze(load("nahm_tetrahedral"))


def test_nothing_done_yet_is_undecided():
    empty = Analysis(load("lorenz"), None, 1.0, 0)
    assert empty.conclusion.kind == "undecided"
    assert not empty.integrals_were_counted
    assert json.dumps(empty.to_json())


# Degenerate systems


def test_where_the_map_has_no_value():
    found = analyze(system("x", "x"), eps=1)
    assert (found.conclusion.kind, found.to_json()["verdict"]["integrals"]) == ("singular", None)
    assert found.conclusion.sentence.startswith("The map is nowhere defined")


def test_where_an_iterate_is_constant():
    found = analyze(system("x y", "x^2 - y^2 - 1", "2*x*y"), eps="1/2")
    assert found.conclusion.sentence == (
        "An iterate of the map is a constant map (measured): orbits end in one point. "
        "All this at eps = 1/2 only: other eps may differ."
    )
    assert (found.conclusion.kind, found.conclusion.growth) == ("linearisable", "zero")
    linear = analyze(system("x", "x"), eps=-1)
    assert linear.conclusion.sentence.startswith(
        "The system is linear, and so is its Kahan map; the integrals were not counted."
    )


def test_the_identity():
    found = analyze(system("x y z", "0", "0", "0"))
    assert (found.conclusion.kind, found.conclusion.integrals) == ("linear", 3)
    assert found.conclusion.sentence == (
        "The system is linear, and so is its Kahan map; 3 independent integrals in dimension 3; "
        "orbits close after 1 step (measured)."
    )
    assert "all orbits tried close after 1 step\n" in text_of(found)


# Form


def test_relations_of_several_degrees_do_not_share_names():
    found = analyze(read_system(FURTHER / "volterra_open_3.toml"))
    assert [one.text for one in found.relations] == [
        "x1 + x2 + x3 + c1 = 0",
        "x2^2 + c2*x2*x3 + c2*x3^2 + c3*x3 - 1/eps^2 = 0",
    ]
    lines = text_of(found)
    assert "c1, c2, c3 are constant on each orbit and differ between orbits, so they are integrals" in lines
    assert "on eps only" not in lines
    assert "depend on eps only" in text_of(analyze(load("planar_cubic_hamiltonian")))


def test_symbols_enter_formulas_and_the_json_says_which():
    found = analyze(parse_system(PLANE), symbols=("a", "eps", "b"))
    assert found.symbols == ("a", "b")
    assert found.to_json()["symbols"] == ["a", "b"]
    assert {"a", "b", "eps"} <= set(found.integrals.integrals[0].function.names)


def test_the_same_seed_gives_the_same_and_another_the_same_verdict():
    one, again, other = (analyze(load("nahm_octahedral"), seed=seed).to_json() for seed in (3, 3, 4))
    assert one == again
    assert one["seed"] == 3
    assert other["verdict"] == one["verdict"]
    assert [each["integral"] for each in other["integrals"]["integrals"]] == [
        each["integral"] for each in one["integrals"]["integrals"]
    ]
    assert other["integrals"]["primes"] != one["integrals"]["primes"]


def test_statements_say_how_they_are_known():
    found = analyze(load("weierstrass"))
    known = {"proved", "supported", "explained", "measured", "undecided", "note"}
    assert {line.status for _, lines in found.sections for line in lines} <= known
    growth = dict(found.sections)["growth"]
    assert {line.status for line in growth} == {"measured", "explained"}  # degrees are never proved
    assert {line.status for line in dict(found.sections)["measure"]} == {"proved"}


def test_progress_names_the_parts():
    told = []
    analyze(load("nahm_tetrahedral"), progress=told.append)
    assert {part for part in told if ":" not in part} >= set(PARTS)
    assert any(text.startswith("degrees: ") for text in told)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"eps": 0}, "found eps = 0"),
        ({"symbols": ("zz",)}, "found the symbol 'zz'"),
        ({"symbols": ("eps",), "eps": 1}, "both as a number and as a symbol"),
        ({"seconds": 0}, "found 0 seconds"),
        ({"seconds": -1}, "found -1 seconds"),
        ({"seconds": float("nan")}, "found nan seconds"),
        ({"seconds": float("inf")}, "found inf seconds"),
    ],
)
def test_wrong_use(options, words):
    with pytest.raises(InputError, match=words):
        analyze(load("euler_top"), **options)


LIE = "generic orbits lie on varieties of codimension "
ALONG = "relations along an orbit: none of degree 1, a 2-dimensional space up to degree 2"


@pytest.mark.parametrize(
    ("profile", "others", "expected"),
    [
        ({}, {}, [("measured", f"{LIE}2, which means 2 independent integrals; {ALONG}")]),
        (
            {"codimensions": (0, 1)},
            {"reason": "no closed form"},
            [
                ("measured", f"{LIE}at least 1, which means at least 1 independent integral; {ALONG}"),
                ("note", "no closed form"),
            ],
        ),
        (
            {"codimensions": (0, 0), "agree": False},
            {},
            [
                ("measured", f"orbits show no integral; {ALONG}"),
                ("note", "the orbits that were compared do not agree"),
            ],
        ),
        ({"period": 1}, {}, [("measured", "all orbits tried close after 1 step")]),
        (
            {"nullities": (), "codimensions": ()},
            {"reason": "no time"},
            [("undecided", "how many integrals there are was not measured: no time")],
        ),
        (
            {"period": 6},
            {"by_theorems": 1},
            [
                ("proved", "1 independent integral by theorems: Prop. 1"),
                ("measured", "all orbits tried close after 6 steps"),
            ],
        ),
        (
            {"period": 6},
            {"by_theorems": 2, "symbols": ("a",)},
            [
                ("measured", "2 independent integrals by theorems: Prop. 1"),
                ("measured", "all orbits tried close after 6 steps"),
            ],
        ),
    ],
)
def test_what_is_said_of_integrals(profile, others, expected):
    measured = {"nullities": (0, 2), "codimensions": (0, 2), "period": None, "agree": True, **profile}
    search = {"symbols": (), "reason": "", "by_theorems": 0, **others}
    found = IntegralSearch(
        file=None,
        eps=None,
        integrals=(),
        profile=Profile(3, complete=True, **measured),
        primes=(),
        seed=0,
        theorems="Prop. 1",
        **search,
    )
    lines = integrals.statements(SimpleNamespace(integrals=found, relations=(), structure=None, pencil=None))
    assert [(str(line.status), line.text) for line in lines] == expected


@pytest.mark.parametrize(
    ("runs", "expected"),
    [
        ([], []),
        ([("1", "a", 3, []), ("2", "b", 4, [])], [("undecided", "the eps 1, 2 disagree: a, b")]),
        (
            [("1", "a", 9, [4, None]), ("2", "a", 3, [6])],
            [("measured", "a within 3 (eps = 1, 2)"), ("measured", "the last confinement comes after 6 steps")],
        ),
        (
            [("1", "a", 9, [1]), ("2", "a", None, [])],
            [("measured", "a within None (eps = 1, 2)"), ("measured", "the last confinement comes after 1 step")],
        ),
        ([("1/3", "undecided", None, [None])], [("undecided", "undecided within None (eps = 1/3)")]),
    ],
)
def test_what_is_said_of_singularities(runs, expected):
    found = [
        SimpleNamespace(
            eps=fmpq(*map(int, eps.split("/"))),
            verdict=verdict,
            followed=followed,
            unit="step",
            text=f"{verdict} within {followed}",
            hypersurfaces=[SimpleNamespace(confined_at=at) for at in ends],
        )
        for eps, verdict, followed, ends in runs
    ]
    lines = singularities.statements(SimpleNamespace(singularities=found, file=load("euler_top")))
    assert [(str(line.status), line.text) for line in lines] == expected


def test_poisson_tensors_are_told_in_dimensions_three_and_four():
    found = analyze(load("euler_top"), seconds=30)
    lines = dict(found.sections)["Poisson tensors"]
    assert [line.status for line in lines] == ["proved"] * 3 + ["note"]
    assert lines[0].text.startswith("P1: {x1,x3} = 2*x1^2*x2*eps^2 + x2")
    assert found.to_json()["poisson"]["pencil"] == "proved"
    planar = analyze(load("nahm_tetrahedral"))
    assert planar.poisson is None
    assert "Poisson tensors" not in dict(planar.sections)


@pytest.mark.parametrize(("most", "first"), [(2, True), (1, False)])
def test_singularities_come_before_degrees_and_help_them_up_to_a_dimension(most, first, monkeypatch):
    given, told, real = [], [], growth.degree_growth

    def recorded(*arguments, **options):
        given.append(options["patterns"])
        return real(*arguments, **options)

    monkeypatch.setattr(growth, "degree_growth", recorded)
    monkeypatch.setattr(growth, "WRITTEN_DIMENSION", most)
    table = [replace(part, slow_above=most) if part.name == "singularities" else part for part in ANALYSES]
    analyze(load("zander_111"), parts=table, progress=lambda text: told.append(text.partition(":")[0]))
    parts = [part for part in dict.fromkeys(told) if part in PARTS]
    assert parts.index("singularities") == (5 if first else len(PARTS) - 1)
    assert [patterns is not None for patterns in given] == [first]


@pytest.mark.parametrize(("most", "looked_for"), [(1, True), (0, False)])
def test_constant_structures_are_looked_for_up_to_a_dimension(most, looked_for, monkeypatch):
    monkeypatch.setattr(family, "MAX_DIMENSION", most)
    assert (analyze(load("riccati")).hamiltonian is not None) == looked_for


def test_commuting_systems_are_sought_for_every_eps_only():
    assert analyze(load("riccati")).commuting is not None
    assert analyze(load("riccati"), eps="1/3").commuting is None


def test_linear_families_of_commuting_systems_are_written_out(monkeypatch):
    found = Analysis(System("S' = -2*S*I; I' = 2*S*I - I; R' = I"), None, 1.0, 0, ())
    found.commuting = find_commuting(found.file.system)
    moved = (
        "t1*(0, 0, S + I + R) + t2*(0, 0, S^2 + 2*S*I + I^2 + 2*S*R + 2*I*R + R^2) + t3*(0, 0, 1), for all t1, t2, t3"
    )

    def told():
        return [line.text for line in dict(found.sections)["commuting systems"]]

    assert told() == [
        f"commutes with the Kahan maps of all g = {moved}",
        f"commutes with the Kahan maps of g and -g, g = (2*S*I, -2*S*I + I, S + R) + {moved}",
    ]
    monkeypatch.setattr(commuting, "_LONG", 10)
    assert told() == ["commutes with a linear family of 3 parameters, which find-commuting writes out"] * 2


@pytest.mark.parametrize(("points", "more"), [(8, []), (9, ["and 1 more set of fixed points: --json lists them"])])
def test_as_many_fixed_points_are_told_as_three_quadratic_equations_have(points, more):
    found = Analysis(System("x' = x^2 - 1; y' = y^2 - 1; z' = z^2 - 1"), None, 1.0, 0, ())
    search = fixed_points(found.file.system)
    found.fixed_points = replace(search, found=(*search.found, search.found[0])[:points])
    lines = [line.text for line in dict(found.sections)["vector field"]]
    assert sum(line.startswith("fixed point ") for line in lines) == 8
    assert [line for line in lines if "more" in line] == more


@pytest.mark.parametrize(
    ("name", "sense", "ground"),
    [
        ("lotka_volterra", "not integrable", "proved"),
        ("hietarinta_viallet", "confining and not integrable", "proved"),
        ("henon_heiles", "confining and not integrable", "explained"),
        ("lorenz", "not integrable", "explained"),
        ("euler_top", "superintegrable", "proved"),
        ("weierstrass", "integrable", "proved"),
        ("paper_m2", "Liouville integrable", "proved"),
        ("harmonic", "linear", "proved"),
        ("zhukovski_volterra_2", "not integrable", "explained"),
    ],
)
def test_a_verdict_says_in_which_sense_and_on_what_ground(name, sense, ground):
    found = analyze(load(name), seconds=20).conclusion
    assert (found.sense, found.ground) == (sense, ground)
    assert ground != "proved" or "proved" in found.sentence or sense == "linear"


def test_what_is_proved_of_a_verdict_goes_with_its_proof():
    found = analyze(load("lotka_volterra"))
    unproved = replace(found, degrees=replace(found.degrees, enclosure=None))
    assert (unproved.conclusion.sense, unproved.conclusion.ground) == ("not integrable", "explained")
    unexplained = replace(unproved, degrees=replace(unproved.degrees, patterns=None))
    assert (unexplained.conclusion.kind, unexplained.conclusion.ground) == ("not integrable", "measured")
    estimated = replace(unproved, degrees=replace(unproved.degrees, patterns=Patterns((30,), None, True)))
    assert (estimated.conclusion.kind, estimated.conclusion.ground) == ("not integrable", "estimated")
    # A proof of entropy beside an integral is a contradiction, and no verdict.
    integrable = analyze(load("weierstrass"))
    both = replace(integrable, degrees=found.degrees)
    assert both.conclusion.kind == "undecided"
    assert "positive algebraic entropy is proved, which excludes an integral" in both.conclusion.sentence
