"""kahanmaps find-density: densities that check-measure accepts, honest words where there are none, no traceback."""

from __future__ import annotations

import pytest
from schema_helpers import mistakes

from kahanmaps.documents.catalog import load

RAMP = "--vars x,y --rhs x --rhs 3*y"


def without_density(name):
    return load(name).to_toml().split("[density]")[0]


def test_densities_and_verdicts(kahanmaps):
    outcome = kahanmaps("find-density lotka_volterra")
    assert outcome.status == 0
    assert outcome.out.splitlines() == [
        "find-density: lotka_volterra, every eps (the time step is 2 eps)",
        "phi\tproved\tx*y",
        "\tthe lemma on Lotka-Volterra systems (docs/mathematics.md) applies: phi is a multiple of x_1 ... x_n; "
        "x_i divides f_i; a is skew",
    ]


@pytest.mark.parametrize(
    ("name", "options", "check"),
    [
        ("euler_top", "", ""),
        ("euler_top", "--symbolic a1,a2,a3", "-p a1=3/2 -p a2=5"),
        ("euler_top", "--eps 1/3", "--eps 1/3"),
        ("dressing_chain_3", "--symbolic b1,b2,b3", "-p b1=7"),
        ("weierstrass", "--symbolic g2", "-p g2=-3/5"),
        ("henon_heiles", "", "--steps 3"),
        pytest.param("volterra_periodic_4", "", "", marks=pytest.mark.slow),
        ("lotka_volterra", "", ""),
    ],
)
def test_the_section_is_accepted_by_check_measure(kahanmaps, tmp_path, name, options, check):
    section = kahanmaps(f"find-density {name} --toml", options)
    assert (section.status, section.out.count("[density]\nphi = ")) == (0, 1)
    path = tmp_path / "system.toml"
    path.write_text(without_density(name) + section.out)
    report = kahanmaps("check-measure", path, "--json", check)
    assert report.status == 0
    assert {finding["verdict"] for finding in report.json["claims"]} <= {"proved", "supported"}


def test_a_density_for_one_eps_is_refuted_at_another(kahanmaps, tmp_path):
    section = kahanmaps("find-density euler_top --eps 1/3 --toml").out
    assert section.startswith("# for eps = 1/3 only (time step 2 eps = 2/3): check with --eps 1/3\n")
    path = tmp_path / "system.toml"
    path.write_text(without_density("euler_top") + section)
    assert kahanmaps("check-measure", path, "--eps 1/4").status == 1


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (
            "lorenz --max-degree 3",
            "no polynomial of degree at most 3, and no product of powers of known ones, is a density",
        ),
        (f"{RAMP} --eps 1", "at eps = 1 the map has no value anywhere"),
        ("--vars x,y --rhs=-x --rhs=-y --eps 1", "at eps = 1 the map is not invertible"),
    ],
)
def test_none_gives_3(kahanmaps, command, words):
    outcome = kahanmaps(f"find-density {command}")
    assert (outcome.status, words in outcome.out, "phi\t" in outcome.out) == (3, True, False)
    toml = kahanmaps(f"find-density {command} --toml")
    assert (toml.status, toml.out) == (3, "")


def test_a_map_that_is_periodic_at_this_eps_is_told(kahanmaps):
    outcome = kahanmaps("find-density henon_heiles --eps 1")
    assert outcome.status == 0
    assert outcome.out.splitlines()[-1] == (
        "note\torbits close after 4 steps: at eps = 1 the map is periodic (measured); nothing follows for other eps"
    )
    assert "every eps" not in outcome.out


def test_a_density_of_the_flow(kahanmaps):
    lines = kahanmaps("find-density zander_120 --flow -q").out.splitlines()
    assert lines[:2] == ["find-density: zander_120, the flow x' = f(x)", "phi\tproved\tx*y*(x + 2*y)"]
    record = kahanmaps("find-density zander_120 --flow --json -q").json
    assert record["flow"] is True
    assert mistakes("find-density", record) == []
