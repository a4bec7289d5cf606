"""kahanmaps find-poisson: tensors that check-poisson accepts, in all forms, and honest words where there are none."""

from __future__ import annotations

import pytest

NESTED = "--vars x,y,z --rhs x*(y+z) --rhs y*(z-x) --rhs=-z*(x+y)"


def test_tensors_with_what_is_known_of_them(kahanmaps):
    outcome = kahanmaps("find-poisson", NESTED)
    assert outcome.status == 0
    lines = outcome.out.splitlines()
    assert lines[0] == "find-poisson: inline, every eps (the time step is 2 eps)"
    [law] = [k for k, line in enumerate(lines) if line.endswith("{x,y} = x*y, {x,z} = x*z, {y,z} = y*z")]
    assert lines[law + 1].startswith("\trank 2; a Poisson tensor (proved)")


@pytest.mark.parametrize("options", ["", "--eps 1/3", "--degree 3 --denominator x"])
def test_what_toml_prints_is_accepted_by_check_poisson(kahanmaps, tmp_path, options):
    section = kahanmaps("find-poisson lotka_volterra --toml", options)
    path = tmp_path / "p.toml"
    path.write_text(section.out)
    eps = options if "eps" in options else ""
    report = kahanmaps("check-poisson lotka_volterra --json --tensor", path, eps)
    assert (section.status, report.status, report.json["verdict"]) == (0, 0, "proved")
    assert kahanmaps("check-poisson weierstrass --json --tensor", path, eps).status == 1


def test_latex_is_the_matrix(kahanmaps):
    assert kahanmaps("find-poisson lotka_volterra --latex").out == (
        "P = \\begin{pmatrix} 0 & x y \\\\ -x y & 0 \\end{pmatrix}\n"
    )


def test_none_gives_3(kahanmaps):
    outcome = kahanmaps("find-poisson lorenz")
    assert (outcome.status, outcome.out.splitlines()[1:]) == (
        3,
        ["note\tno tensor of degree at most 2 is preserved (measured modulo a prime)"],
    )
    assert kahanmaps("find-poisson lorenz --toml").out == ""
