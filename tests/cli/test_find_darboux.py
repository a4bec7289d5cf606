"""kahanmaps find-integrals --darboux: all discrete Darboux polynomials, as text and as JSON."""

from schema_helpers import mistakes


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
