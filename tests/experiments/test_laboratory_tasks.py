"""The tasks of the laboratory: each gives what a direct call gives, in words and numbers that can be grouped by."""

import json
from pathlib import Path

import pytest
from specs import made, perform

import kahanmaps as km
from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import parse_system
from kahanmaps.experiments.registry import task_kind
from kahanmaps.laboratory.cycles import cycle_census
from kahanmaps.laboratory.preserve import densities
from kahanmaps.maps.floats.lyapunov import lyapunov_exponents
from kahanmaps.maps.floats.starts import starts_in_box

TASKS = (
    "degrees", "find-integrals", "find-density", "find-poisson", "find-symmetry", "find-commuting", "analyze",
    "singularities", "cycles", "lyapunov",
)  # fmt: skip
NEEDED = {"cycles": {"prime": 31}, "lyapunov": {"eps": "1/10", "steps": 40}}
SURVEY = Path(__file__).parents[2] / "examples" / "growth_survey.toml"


def of_rhs(*rhs):
    variables = ["x", "y", "z"][: len(rhs)]
    return made(parse_system(f"variables = {json.dumps(variables)}\n[system]\nrhs = {json.dumps(list(rhs))}"))


NAMES = ("euler_top", "lorenz", "lotka_volterra", "weierstrass", "nahm_tetrahedral")
TOP, LORENZ, RIVALS, WEIERSTRASS, NAHM = (made(load(name)) for name in NAMES)
ZERO, LINE, OSCILLATOR = of_rhs("0", "0"), of_rhs("x^2"), of_rhs("y", "-x")


@pytest.mark.parametrize("name", TASKS)
@pytest.mark.parametrize("system", [ZERO, LINE, OSCILLATOR], ids=["zero", "line", "oscillator"])
def test_degenerate_systems_have_results_too(name, system):
    result = perform(name, system, **NEEDED.get(name, {}))
    assert result["status"]
    assert result.get("verdict", "proved") in (None, "proved", "supported", "undecided")
    assert not set(result) & set(task_kind(name).options)  # otherwise a column would be called result.x


def test_the_whole_report_is_kept_if_asked_for():
    short, long = perform("find-density", RIVALS), perform("find-density", RIVALS, report=True)
    assert "report" not in short
    assert long == {**short, "report": json.loads(json.dumps(densities.find_densities(RIVALS).to_json()))}


GROWING = of_rhs("x")  # det(I - eps f') = 1 - eps vanishes identically at eps = 1
QUADRATIC = {"growth": "quadratic", "dynamical_degree": "1", "power": 2, "status": "derived"}
EXPONENTIAL = {"growth": "exponential", "dynamical_degree": "2", "power": 0, "status": "derived"}
BOUNDED = {"growth": "bounded", "dynamical_degree": "1", "power": 0, "status": "recurrence"}
COUNTED = {"status": "complete", "reason": ""}
INTEGRABLE = {"status": "complete", "unfinished": [], "integrability": "integrable", "growth": "quadratic"}
INTEGRABLE |= {"integrals": 1, "confinement": "confined"}
NOT_INTEGRABLE = {"integrability": "not integrable", "dynamical_degree": "2", "densities": 1, "in_family": False}
LINES = {"status": "complete", "growth": "linear", "integrable": ["-1"], "components": 1, "confirmed": 1}
LINES |= {"unassigned": 0, "generic": [2, 4]}


@pytest.mark.parametrize(
    ("name", "system", "requested", "expected"),
    [
        ("degrees", TOP, {}, QUADRATIC),
        ("degrees", RIVALS, {}, EXPONENTIAL),
        ("degrees", OSCILLATOR, {}, BOUNDED),
        ("degrees", LORENZ, {"terms": 2, "eps": "1/7"}, {"status": "terms", "degrees": [1, 3, 9], "reached": 2}),
        ("degrees", LORENZ, {"max_degree": 10}, {"status": "degree", "degrees": [1, 3, 9], "reached": 2}),
        ("find-integrals", TOP, {}, {**COUNTED, "integrals": 2, "codimension": 2, "verdict": "proved"}),
        ("find-integrals", LORENZ, {}, {**COUNTED, "integrals": 0, "codimension": 0, "verdict": None, "formulas": []}),
        ("find-integrals", GROWING, {"eps": 1}, {"status": "not measured", "codimension": None, "verdict": None}),
        ("find-density", GROWING, {"eps": 1}, {"status": "open"}),
        # x y for Lotka and Volterra's equations: sanz-serna-1994.
        ("find-density", RIVALS, {}, {"status": "found", "verdict": "proved", "degree_tried": 2, "formulas": ["x*y"]}),
        ("find-symmetry", TOP, {}, {"verdict": "proved", "symmetries": 8, "reversing": 8, "scaling": True}),
        ("find-commuting", RIVALS, {}, {"status": "complete", "verdict": "proved", "commuting": 0}),
        ("singularities", WEIERSTRASS, {}, {"status": "complete", "confinement": "confined"}),
        ("singularities", RIVALS, {}, {"status": "complete", "confinement": "not confined"}),
        ("analyze", NAHM, {}, INTEGRABLE),
        ("analyze", RIVALS, {}, NOT_INTEGRABLE),
        ("analyze", GROWING, {"eps": 1}, {"integrability": "singular"}),
        ("scan", RIVALS, {"over": "a", "terms": 2, "primes": "11,13,17"}, LINES),
    ],
)
def test_what_is_known_is_found(name, system, requested, expected):
    record = perform(name, system, **requested)
    assert {key: record[key] for key in expected} == expected


def test_a_census_is_that_of_the_library():
    record = perform("cycles", WEIERSTRASS, prime=31, eps="1/10", report=True)
    census = cycle_census(WEIERSTRASS.system, "1/10", 31)
    (run,) = record["runs"]
    assert run["lengths"] == [list(pair) for pair in census.lengths.items()]
    assert (run["indeterminate"], run["pre_indeterminate"], run["periodic"]) == (3, 613, 377)
    assert (record["points"], record["longest"], record["status"]) == ("993", 21, "complete")
    assert "lengths" not in perform("cycles", WEIERSTRASS, prime=31, eps="1/10")["runs"][0]


def test_exponents_are_those_of_the_library():
    record = perform("lyapunov", LORENZ, eps="1/400", orbits=4, box="5", steps=50, transient=10, seed=3)
    direct = lyapunov_exponents(LORENZ.system, starts_in_box(4, 3, 5.0, 3), "1/400", 50, transient=10)
    assert record["exponents"] == direct.mean.tolist()
    assert (record["largest"], record["smallest"]) == (record["exponents"][0], record["exponents"][2])
    assert (record["status"], record["counted"], record["ended"]) == ("completed", 50, 0)
    # The divergence of the Lorenz equations is -10 - 1 - 8/3, and the sum has to be near it.
    assert record["sum"] == pytest.approx(-41 / 3, abs=0.05)


@pytest.mark.slow
def test_the_survey_of_the_catalogue_finds_what_the_catalogue_knows():
    result = {}
    spec = km.read_spec(SURVEY)
    tasks = {task.key: (experiment.name, task) for experiment in spec.experiments for task in experiment.tasks()}
    for record in km.run(spec, jobs=2):
        experiment, task = tasks[record.key]
        assert record.is_ok
        result.setdefault(experiment, []).append((task, record))
    assert {record.result["growth"] for _, record in result["members"]} == {"quadratic"}
    counts = {task.system["name"]: record.result["codimension"] for task, record in result["integrals"]}
    assert {"euler_top": 2, "lorenz": 0, "clebsch_first_flow": 4, "paper_m3": 3}.items() <= counts.items()
