"""kahanmaps find-density: densities that check-measure accepts, honest words where there are none, no traceback."""

import pytest

from kahanmaps.documents.catalog import load


def without_density(name):
    return load(name).to_toml().split("[density]")[0]


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
