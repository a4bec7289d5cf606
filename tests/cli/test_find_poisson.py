"""kahanmaps find-poisson: tensors that check-poisson accepts, in all forms, and honest words where there are none."""

import pytest


@pytest.mark.parametrize("options", ["", "--eps 1/3", "--degree 3 --denominator x"])
def test_what_toml_prints_is_accepted_by_check_poisson(kahanmaps, tmp_path, options):
    section = kahanmaps("find-poisson lotka_volterra --toml", options)
    path = tmp_path / "p.toml"
    path.write_text(section.out)
    eps = options if "eps" in options else ""
    report = kahanmaps("check-poisson lotka_volterra --json --tensor", path, eps)
    assert (section.status, report.status, report.json["verdict"]) == (0, 0, "proved")
    assert kahanmaps("check-poisson weierstrass --json --tensor", path, eps).status == 1
