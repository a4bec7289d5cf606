"""One report of everything: it reads no claims, concludes nothing from one eps, and says what it did not do; what no
search can be asked is named, and no field contradicts another one."""

import json
from dataclasses import replace
from typing import Any

import pytest
from helpers import refuses, together
from search_helpers import analysis_of, system

import kahanmaps as km
from kahanmaps import InputError, analyze, find_densities, find_integrals, find_poisson, load, names, parse_system
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.analyses import table
from kahanmaps.laboratory.analyses.table import ANALYSES
from kahanmaps.laboratory.growth.degree_bounds import bound_dynamical_degree
from kahanmaps.laboratory.growth.degrees import DegreeGrowth, degree_growth
from kahanmaps.laboratory.singular.singularities import Patterns, singularities
from kahanmaps.laboratory.symmetry.commuting import commuting_systems
from kahanmaps.laboratory.symmetry.symmetries import linear_symmetries

# In dimension 3 singularities come last.
PARTS = tuple(sorted((part.name for part in ANALYSES), key="singularities".__eq__))

PLANE = """variables = ["x", "y"]
[parameters]
a = "3"
b = "1/2"
[system]
rhs = ["a*y", "6*x^2 - b"]
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


def results(result):
    """Everything but the file itself."""
    return {key: value for key, value in result.to_json().items() if key != "document"}


@pytest.mark.parametrize(("symbols", "eps"), [((), None), (("b",), "1/3")])
def test_the_claims_and_facts_of_a_file_are_not_read(symbols, eps):
    result = [
        results(analyze(parse_system(PLANE + claims, "same"), symbols=symbols, eps=eps)) for claims in ("", NONSENSE)
    ]
    assert result[0] == result[1]
    assert result[0]["verdict"]["integrals"] == 1


def test_at_an_eps_where_the_map_is_periodic_nothing_is_said_of_others():
    special, generic = analyze(system(*FOUR), eps=1), analyze(system(*FOUR))
    assert (special.conclusion.kind, special.integrals.profile.period) == ("linearisable", 4)
    assert special.conclusion.sentence == (
        "The map is periodic: Phi^4 is the identity (proved); 2 independent integrals in dimension 2. "
        "All this holds at eps = 1; other eps may differ."
    )
    assert (special.degrees.degrees[4], special.degrees.growth) == (1, Growth.BOUNDED)
    assert (generic.conclusion.kind, generic.conclusion.integrals) == ("integrable", 1)
    assert generic.conclusion.growth == "quadratic"
    assert "only" not in generic.conclusion.sentence
    assert generic.integrals.profile.period is None


def test_where_the_budget_is_spent_steps_are_skipped_and_reported():
    analysis = analyze(load("lagrange_top"), effort=-20)
    skipped = [text.partition(": ")[0] for text in analysis.skipped]
    assert analysis.skipped == [f"{part}: work limit reached; raise --effort" for part in skipped]
    assert {"integrals", "densities", "heights", "commuting systems"} <= set(skipped) <= set(PARTS)
    assert analysis.work == "effort -20, 0.0 million units"
    assert [line.text for line in dict(analysis.sections)["not done"]] == analysis.skipped
    assert (analysis.conclusion.kind, analysis.conclusion.growth) == ("undecided", "unknown")
    # none was found, which is not that there is none
    assert analysis.conclusion.sentence.startswith("The growth is undecided: ")
    assert analysis.conclusion.sentence.endswith("; the integrals were not counted.")
    data = json.loads(json.dumps(analysis.to_json()))
    assert (data["verdict"]["integrals"], data["integrals"], data["skipped"]) == (None, None, analysis.skipped)


def test_a_part_that_gives_up_leaves_the_others(monkeypatch):
    def refuses(*_, **__):
        raise InputError("found 1, expected 2")

    monkeypatch.setattr(table, "linear_symmetries", refuses)
    analysis = analyze(load("nahm_tetrahedral"))
    assert analysis.skipped == ["symmetries: found 1, expected 2"]
    assert analysis.symmetries is None
    assert analysis.commuting is not None
    assert analysis.conclusion.kind == "integrable"


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_mistakes_and_interrupts_are_not_swallowed(monkeypatch, error):
    def fails(*_, **__):
        raise error

    monkeypatch.setattr(table, "linear_symmetries", fails)
    with pytest.raises(error):
        analyze(load("nahm_tetrahedral"), analyses=steps("symmetries"))


def test_the_flow_of_a_polarised_map_is_part_of_the_report():
    analysis = analyze(load("duffing_polarised"), analyses=steps("integrals", "densities", "the flow"))
    assert dict(analysis.sections)["the flow"]
    assert [line for line in analysis.skipped if "flow" in line] == []


def lines_of(result, title):
    return [line.text for name, lines in result.sections if name == title for line in lines]


def steps(*names):
    return [part for part in ANALYSES if part.name in names]


QUICK_STEPS = steps("the commuting family", "a larger algebra", "fixed points", "symmetries")
KEPT = ["the lines x = 0 and y = 0 are invariant, for flow and map"]
LOST = [
    "the line x = 0 is invariant for the flow; at eps = 1 the map contracts it: det(I + eps f'(x)) is 0 there",
    "the line y = 0 is invariant for the flow; at eps = 1 the map is not defined on it: det(I - eps f'(x)) is 0 there",
]


@pytest.mark.parametrize(("eps", "expected"), [(None, KEPT), ("1/2", KEPT), ("1", LOST)])
def test_what_is_said_of_hyperplanes_holds_at_the_eps_in_force(eps, expected):
    analysis = analyze(load("lotka_volterra"), eps=eps, analyses=QUICK_STEPS)
    assert [line for line in lines_of(analysis, "structure") if "invariant" in line] == expected


SAME = "flow and map have the same fixed points"
WHERE = f"{SAME} where det(I - eps f'(x)) is not 0"
SOME = f"{WHERE}; at eps = 1 it is 0 at the fixed point (0, 0), where the map is not defined;"
NONE = "at eps = 1 det(I - eps f'(x)) is 0 at all of them, where the map is not defined"


@pytest.mark.parametrize(
    ("given", "eps", "expected"),
    [
        (load("lotka_volterra"), None, f"{SAME};"),
        (load("lotka_volterra"), "1/2", f"{SAME};"),
        (load("lotka_volterra"), "1", SOME),
        (system("x y", "x", "-y"), "1", NONE),
        (system("x y", "x*y", "x^2"), None, f"{WHERE}; an eigenvalue"),  # the line (0, y), eigenvalues 0 and y
    ],
)
def test_what_is_said_of_fixed_points_holds_at_the_eps_in_force(given, eps, expected):
    assert lines_of(analyze(given, eps=eps, analyses=QUICK_STEPS), "vector field")[-1].startswith(expected)


NOWHERE = "at eps = 1 the map is defined nowhere: det(I - eps f'(x)) is identically 0"
SINGULAR = "at eps = 1 the map is not invertible: det(I + eps f'(x)) is 0 at all images"


@pytest.mark.parametrize(
    ("rhs", "eps", "defect"),
    [
        (("x", "-y"), "1", NOWHERE),
        (("x", "-y"), "1/2", ""),
        (("x^2 - 1/4", "x*y + y^2"), "1", SINGULAR),
        (("x^2 - 1/4", "x*y + y^2"), "1/2", ""),
    ],
)
def test_of_a_map_that_is_not_birational_symmetries_and_hyperplanes_are_those_of_the_flow(rhs, eps, defect):
    analysis = analyze(system("x y", *rhs), eps=eps, analyses=QUICK_STEPS)
    assert analysis.defect == defect
    restricted = f"these are symmetries of the vector field only: {defect}"
    assert (restricted in lines_of(analysis, "symmetry")) == bool(defect)
    (planes,) = [line for line in lines_of(analysis, "structure") if line.startswith("the lines")]
    assert planes.endswith("are invariant for the flow" if defect else "are invariant, for flow and map")
    algebra = [line for line in lines_of(analysis, "structure") if "over K" in line]
    assert all(("Kahan map over K" in line) == (not defect) for line in algebra)


@pytest.mark.parametrize(("eps", "kind"), [("1", "singular"), ("1/2", "linear"), (None, "linear")])
def test_a_linear_system_has_a_linear_map_where_it_has_one(eps, kind):
    assert analyze(system("x y", "x", "-y"), eps=eps, analyses=QUICK_STEPS).conclusion.kind == kind


def test_where_an_iterate_is_constant():
    analysis = analyze(system("x y", "x^2 - y^2 - 1", "2*x*y"), eps="1/2")
    assert analysis.conclusion.sentence == (
        "An iterate of the map is a constant map (measured): orbits end in one point. "
        "All this holds at eps = 1/2; other eps may differ."
    )
    assert (analysis.conclusion.kind, analysis.conclusion.growth) == ("linearisable", "zero")
    linear = analyze(system("x", "x"), eps=-1)
    assert linear.conclusion.sentence.startswith(
        "The system is linear, and so is its Kahan map; the integrals were not counted."
    )


SENSES = {
    "lotka_volterra": "not integrable",
    "hietarinta_viallet": "confining and not integrable",
    "euler_top": "superintegrable",
    "weierstrass": "integrable",
    "harmonic": "linear",
}


@pytest.mark.parametrize("name", SENSES)
def test_a_verdict_says_in_which_sense_and_that_it_is_proved(name):
    result = analysis_of(name).conclusion
    assert (result.sense, result.ground) == (SENSES[name], "proved")
    assert "proved" in result.sentence or result.sense == "linear"


def test_what_is_proved_of_a_verdict_goes_with_its_proof():
    analysis = analysis_of("lotka_volterra")
    unproved = replace(analysis, degrees=replace(analysis.degrees, dynamical_degree_bounds=None))
    assert (unproved.conclusion.sense, unproved.conclusion.ground) == ("not integrable", "derived")
    underived = replace(unproved, degrees=replace(unproved.degrees, patterns=None))
    assert (underived.conclusion.kind, underived.conclusion.ground) == ("not integrable", "measured")
    estimated = replace(unproved, degrees=replace(unproved.degrees, patterns=Patterns((30,), None, True)))
    assert (estimated.conclusion.kind, estimated.conclusion.ground) == ("not integrable", "estimated")
    # A proof of entropy beside an integral is a contradiction, and no verdict.
    both = replace(analysis_of("weierstrass"), degrees=analysis.degrees)
    assert both.conclusion.kind == "undecided"
    assert "positive algebraic entropy is proved, which excludes an integral" in both.conclusion.sentence


FILE = load("euler_top")
TWICE = {"eps": 1, "symbols": ["eps"]}
WRONG = [
    (analyze, FILE, {"eps": 0}, "found eps = 0"),
    (analyze, FILE, {"symbols": ["zz"]}, "found the symbol 'zz'"),
    (analyze, FILE, TWICE, "both as a number and as a symbol"),
    (analyze, FILE, {"effort": 1.5}, "found the effort 1.5, expected an integer"),
    (analyze, FILE, {"effort": 41}, "found the effort 41"),
    (find_integrals, FILE, {"eps": 0}, "found eps = 0"),
    (find_integrals, FILE, {"eps": 0.5}, "0.5"),
    (find_integrals, FILE, TWICE, "found eps both as a number and as a symbol"),
    (find_integrals, FILE, {"symbols": ["a9"]}, "found the symbol 'a9'"),
    (find_integrals, FILE, {"effort": 0.5}, "found the effort 0.5, expected an integer from -20 to 40"),
    (find_integrals, FILE, {"max_degree": 0}, "found the largest degree 0"),
    (find_densities, FILE, {"eps": 0}, "found eps = 0"),
    (find_densities, FILE, TWICE, "found eps both"),
    (find_densities, FILE, {"effort": 41}, "found the effort 41"),
    (find_densities, FILE, {"max_degree": -1}, "found the largest degree -1"),
    (find_poisson, FILE, {"max_degree": -1}, "found the degree -1"),
    (find_poisson, FILE, {"effort": -21}, "found the effort -21"),
    (find_poisson, FILE, {"eps": 0}, "found eps = 0"),
    (degree_growth, FILE.system, {"eps": 0}, "found eps = 0"),
    (degree_growth, FILE.system, {"effort": float("nan")}, "found the effort nan"),
    (degree_growth, FILE.system, {"max_terms": -1}, "found -1 terms"),
    (degree_growth, FILE.system, {"max_degree": 0}, "the largest degree 0"),
    (degree_growth, FILE.system, {"steps": 0}, "found 0 steps"),
    (singularities, FILE.system, {"eps": 1, "steps": 0}, "found 0 steps, expected 1 to 10000"),
    (singularities, FILE.system, {"eps": 1, "steps": 10_001}, "found 10001 steps, expected 1 to 10000"),
    (commuting_systems, FILE.system, {"shape": "cubic"}, "expected"),
    (commuting_systems, FILE.system, {"effort": True}, "found the effort True"),
    (commuting_systems, FILE.system, {"error_bits": 0}, "expected"),
    (linear_symmetries, FILE.system, {"effort": float("nan")}, "found the effort nan"),
]


@together("search, given, options, words", WRONG)
def test_what_cannot_be_searched_is_refused(search, given, options, words):
    refuses(words, search, given, **options)


SYSTEMS: list[tuple[str, dict[str, Any]]] = [
    ("lotka_volterra", {"effort": -5}),
    ("lotka_volterra", {}),
    ("weierstrass", {}),
    ("weierstrass", {"eps": "1/5"}),
    ("zander_120", {}),
    ("riccati", {}),
    ("harmonic", {}),
    ("weierstrass", {"symbols": ["g2"]}),
    ("x' = 0; y' = 0", {}),
    ("x' = 0; y' = 0; z' = 0", {}),
]


def disagreements(result: dict[str, Any]) -> list[str]:
    """Which fields of the JSON of `analyze` contradict each other."""
    verdict, degrees = result["verdict"], result["degrees"]
    word, growth, exact = verdict["integrability"], verdict["growth"], verdict["integrals_exact"]
    messages = {line["status"] for line in result["statements"] if degrees and line["text"] == degrees["growth_text"]}
    enclosed = bool(degrees and degrees["enclosure"])
    limits = {
        "a map that is not integrable grows exponentially": word != "not integrable" or growth == "exponential",
        "an integrable map does not": word != "integrable" or growth != "exponential",
        "a dynamical degree above 1 is exponential growth": not enclosed or degrees["growth"] == "exponential",
        "it decides": not enclosed or word in ("not integrable", "undecided"),
        "the growth of the verdict is that of the degrees": not degrees
        or growth == degrees["growth"]
        or (degrees["looks_exponential"] and growth == "exponential"),
        "a rate is of a recurrence": not degrees
        or (degrees["dynamical_degree"] is None or degrees["recurrence"] is not None),
        "the status of the growth is its basis": not degrees or messages <= {degrees["basis"].partition(":")[0]},
        "an undecided verdict has no ground, others have one": (verdict["ground"] == "") == (word == "undecided")
        or word == "singular",
        "superintegrable maps have dim - 1 integrals": verdict["sense"] != "superintegrable"
        or verdict["integrals"] >= result["dim"] - 1,
        "a number of integrals is exact on curves and points only": not exact
        or verdict["integrals"] >= result["dim"] - 1,
        "a lower bound is called so": exact
        or not verdict["integrals"]
        or "at least" in verdict["sentence"]
        or "integral" not in verdict["sentence"]
        or word == "not integrable",
        "and nothing else is": not exact or "at least" not in verdict["sentence"] or enclosed,
        "periodic maps have as many integrals as coordinates, or more are possible": not exact
        or verdict["integrals"] == result["dim"]
        or result["integrals"]["relations"]["period"] is None,
    }
    return [words for words, holds in limits.items() if not holds]


@pytest.mark.parametrize(("system", "options"), SYSTEMS, ids=[f"{name} {more}" for name, more in SYSTEMS])
def test_the_fields_of_an_analysis_agree(system, options):
    result = km.analyze(system, **options) if options or system not in names() else analysis_of(system)
    assert disagreements(result.to_json()) == []


def test_fields_that_disagree_would_be_noticed():
    result = analysis_of("lotka_volterra").to_json()
    assert result["degrees"]["enclosure"]
    result["verdict"]["growth"] = "unknown"
    result["degrees"]["growth"] = "unknown"
    result["verdict"]["ground"] = ""
    assert len(disagreements(result)) == 3


def test_growth_is_exponential_where_positive_entropy_is_proved_and_no_recurrence_confirmed():
    # Degrees of lotka_volterra, whose singularities the budget left out.
    bounds = bound_dynamical_degree(load("lotka_volterra").map, None)
    for known_bounds, expected in ((bounds, ("exponential", "proved")), (None, ("unknown", "undecided"))):
        growth = DegreeGrowth((1, 2, 4), None, "budget", "", 0, (), (), dynamical_degree_bounds=known_bounds)
        assert (str(growth.growth), str(growth.known)) == expected
        assert ("exponential growth" in growth.kind_text, growth.recurrence) == (known_bounds is not None, None)


# x' = a y, y' = -a x, z' = a x y has two integrals for generic a; at a = 0 every point is fixed.
TURNING = "x' = a*y; y' = -a*x; z' = a*x*y"


@pytest.mark.parametrize(("a", "is_exact"), [(0, False), (1, True)])
@pytest.mark.parametrize("flow", [False, True])
def test_a_number_of_integrals_is_a_lower_bound_where_orbits_close_at_the_values_of_the_file(a, is_exact, flow):
    search = km.find_integrals(km.System(TURNING, a=a), symbols=["a"], flow=flow)
    assert (search.codimension, search.is_exact) == (2, is_exact)
    assert ("at least" in search.count_text) is not is_exact
    assert ("at a = 0" in search.note) is not is_exact
