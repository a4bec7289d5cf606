"""No field of what `analyze` and `degrees` say contradicts another one."""

from typing import Any

import pytest
from search_helpers import analysis_of

import kahanmaps as km
from kahanmaps.documents.catalog import names
from kahanmaps.laboratory.growth.degree_bounds import bound_dynamical_degree
from kahanmaps.laboratory.growth.degrees import DegreeGrowth

SYSTEMS: list[tuple[str, dict[str, Any]]] = [
    ("lotka_volterra", {"effort": -5}),
    ("lotka_volterra", {}),
    ("weierstrass", {}),
    ("weierstrass", {"eps": "1/5"}),
    ("zander_120", {}),
    ("riccati", {}),
    ("harmonic", {}),
    ("euler_top", {"symbols": ["a1"]}),
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
    # Degrees 2^n of lotka_volterra, whose singularities the budget left out.
    degrees = tuple(2**n for n in range(9))
    bounds = bound_dynamical_degree(km.load("lotka_volterra").map, None)
    growth = DegreeGrowth(degrees[:3], None, "budget", "", 0, (), (), enclosure=bounds)
    assert (str(growth.growth), growth.recurrence) == ("exponential", None)
    control = DegreeGrowth(degrees[:3], None, "budget", "", 0, (), ())
    assert (str(control.growth), str(control.known)) == ("unknown", "undecided")


# x' = a y, y' = -a x, z' = a x y has two integrals for generic a; at a = 0 every point is fixed.
TURNING = "x' = a*y; y' = -a*x; z' = a*x*y"


@pytest.mark.parametrize(("a", "is_exact"), [(0, False), (1, True)])
@pytest.mark.parametrize("flow", [False, True])
def test_a_number_of_integrals_is_a_lower_bound_where_orbits_close_at_the_values_of_the_file(a, is_exact, flow):
    search = km.find_integrals(km.System(TURNING, a=a), symbols=["a"], flow=flow)
    assert (search.codimension, search.is_exact) == (2, is_exact)
    assert ("at least" in search.count_text) is not is_exact
    assert ("at a = 0" in search.note) is not is_exact
