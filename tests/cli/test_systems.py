"""kahanmaps systems and convert: the catalogue listed and shown, systems written as files to copy and change."""

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


def test_the_command_in_the_comment_makes_the_same_file_again(kahanmaps):
    line = "convert --vars=I,y --rhs=I*y --rhs='-2/3*I^2' --to pari --what map,jacobian --name two"
    first = kahanmaps(line).out
    (messages,) = [text for text in first.splitlines() if "kahanmaps convert" in text]
    assert kahanmaps(messages.split("kahanmaps ", 2)[2]).out == first


def test_an_inline_system_becomes_a_system_file(kahanmaps, tmp_path):
    system = "--vars x,y --rhs=a*x*y --rhs=-x^2 -p a=2/3"
    path = tmp_path / "own.toml"
    assert kahanmaps(f"convert {system} --to toml -o", path).status == 0
    start = "--start 1,2 --eps 1/10 --steps 3 --format csv"
    assert kahanmaps("orbit", path, start).out == kahanmaps(f"orbit {system} {start}").out
    assert kahanmaps("convert", path, "--to toml").out == path.read_text()
    assert kahanmaps("convert", path, "--to toml -p a=1").out != path.read_text()


def test_a_file_is_written_whole_and_named_on_standard_error(kahanmaps, tmp_path):
    path = tmp_path / "top.jl"
    outcome = kahanmaps("convert euler_top --to julia -o", path)
    assert (outcome.status, outcome.out) == (0, "")
    assert outcome.err == f"{path}: euler_top for julia, {len(path.read_text().splitlines())} lines\n"
    assert [file.name for file in tmp_path.iterdir()] == ["top.jl"]
    assert path.read_text() == kahanmaps("convert euler_top --to julia").out
    assert kahanmaps("convert euler_top --to julia -q -o", path).err == ""
