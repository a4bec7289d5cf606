"""kahanmaps find-integrals --darboux: all discrete Darboux polynomials, as text and as JSON."""

from __future__ import annotations

import pytest


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
