"""kahanmaps systems: the catalogue, listed, shown, and printed as files to copy and change."""

import pytest

from kahanmaps.documents import catalog
from kahanmaps.documents.files import parse_system
from kahanmaps.maps.kahan import KahanFamily


def test_every_system_has_a_line(kahanmaps):
    listed = {line.split()[0]: line.split()[1] for line in kahanmaps("systems").out.splitlines()}
    assert listed.pop("lv(n,k)") == "n"
    assert listed == {name: str(catalog.load(name).dim) for name in (*catalog.names(), *catalog.map_names())}


@pytest.mark.parametrize("name", ["lyness", "hky", "repaired_octahedral"])
def test_a_map_is_shown_as_text_latex_and_data(kahanmaps, name):
    shown = kahanmaps(f"systems {name}").out
    is_adjusted = isinstance(catalog.load(name).map, KahanFamily)  # these are written as x' = f, with eps in f
    assert "x' = " in shown if is_adjusted else "~ = " in shown or "_new" in shown
    assert r"\begin{aligned}" in kahanmaps(f"systems {name} --latex").out
    assert ("rhs" in kahanmaps(f"systems {name} --json").json) == is_adjusted
    assert parse_system(kahanmaps(f"systems {name} --toml").out, name) == catalog.load(name)


def test_a_system_in_latex_has_its_equations_integrals_and_density(kahanmaps):
    lines = kahanmaps("systems euler_top --latex").out.splitlines()
    assert r"\dot{x_2} &= -2 x_1 x_3 \\" in lines
    assert r"F_2 = \frac{2 \varepsilon^2 x_3^2 + 1}{2 \varepsilon^2 x_1^2 + 1}" in lines
    assert r"\phi = \left(2 \varepsilon^2 x_3^2 + 1\right)^2" in lines
