"""kahanmaps find-integrals --darboux: all discrete Darboux polynomials, as text and as JSON."""

from __future__ import annotations

import pytest
from schema_helpers import mistakes


def test_text_and_json_agree(kahanmaps):
    text = kahanmaps("find-integrals nahm_octahedral --darboux 3")
    assert text.status == 0
    assert "C = C[x - y]\n\tproved\tx - y\n" in text.out
    data = kahanmaps("find-integrals nahm_octahedral --darboux 3 --json").json
    assert data["command"] == "darboux-polynomials"
    assert ["x - y"] in [space["polynomials"] for space in data["spaces"]]
    assert data["eps"] == "every"


def test_products_are_left_out(kahanmaps):
    """x*y would be one, and C[x]*C[y] = det dPhi has no other."""
    assert "x*y" not in kahanmaps("find-integrals lotka_volterra --darboux 3").out.split("left out\n")[1]


@pytest.mark.parametrize(
    "options",
    ["--darboux 2 --toml", "--darboux 2 --latex", "--darboux 2 --monomials x,1", "--darboux 0", "--darboux x"],
)
def test_wrong_use(kahanmaps, options):
    outcome = kahanmaps(f"find-integrals weierstrass {options}")
    assert outcome.status == 2
    assert outcome.out == ""


def test_those_of_a_flow_have_cofactors_that_nobody_gave(kahanmaps):
    words = "find-integrals lorenz -p b=20 --flow --darboux 2"
    text = kahanmaps(words)
    assert text.status == 0
    assert text.out.splitlines() == [
        "Darboux polynomials: lorenz, the flow x' = f(x)",
        "P' = K P, irreducible; integrals left out",
        "K = -20",
        "\tproved\tx^2 - 20*z",
    ]
    data = kahanmaps(f"{words} --json").json
    assert (data["flow"], data["cofactors"], data["reason"]) == (True, [], "")
    assert mistakes("find-integrals", data) == []
    assert [one["cofactor"] for one in data["spaces"]] == ["-20"]
    beside = kahanmaps("find-integrals lorenz -p b=20 --flow --max-degree 2 -q").out
    assert "T1\tproved\texp(20*t)*(x^2 - 20*z)\n\tdepends on time\n" in beside
    data = kahanmaps("find-integrals lorenz -p b=20 --flow --max-degree 2 -q --json").json
    assert data["beside_map"]["polynomials_degree"] == 3
    assert mistakes("find-integrals", data) == []


def test_next_to_special_parameters_a_flow_has_none(kahanmaps):
    outcome = kahanmaps("find-integrals lorenz -p b=19 --flow --darboux 2")
    assert outcome.status == 0
    assert "proved" not in outcome.out


def test_other_maps_and_maps_at_one_eps_have_no_search_of_a_flow(kahanmaps):
    for words in ("lyness", "lorenz --eps 1/10"):
        outcome = kahanmaps(f"find-integrals {words} --flow --darboux 2")
        assert (outcome.status, outcome.out) == (2, "")


def test_a_degree_out_of_reach_is_told(kahanmaps):
    outcome = kahanmaps("find-integrals volterra_periodic_5 --flow --darboux 12 --seconds 0.5")
    assert outcome.status == 3
    assert "note\tdegrees above" in outcome.out
