"""Where pictures go and how they are remade: colours in a terminal, `plot recipe`."""

import pytest

from kahanmaps_cli.pictures.output import _seen_on_both_grounds

TWO = "plot degrees euler_top lotka_volterra --max-degree 60"


def test_a_pipe_gets_no_escape_sequences_unless_it_is_asked_for(kahanmaps):
    plain, coloured = kahanmaps(TWO), kahanmaps(f"{TWO} --color always")
    assert "\x1b" not in plain.out
    assert "\x1b[38;" in coloured.out
    assert "\x1b" not in kahanmaps(f"{TWO} --color never").out


@pytest.mark.parametrize("colour", [(255, 255, 180), (0, 0, 40), (230, 159, 0), (0, 32, 77), (254, 232, 56)])
def test_a_colour_is_seen_on_white_and_on_black(colour):
    red, green, blue = _seen_on_both_grounds(colour)
    assert 80 < 0.299 * red + 0.587 * green + 0.114 * blue < 170


def test_a_picture_tells_the_command_and_the_system(kahanmaps, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    kahanmaps("plot degrees harmonic -o d.svg -q --size 6")
    assert kahanmaps("plot recipe d.svg").out == "kahanmaps plot degrees harmonic -o d.svg -q --size 6\n"
    assert (
        kahanmaps("plot recipe d.svg --json").json["command"] == "kahanmaps plot degrees harmonic -o d.svg -q --size 6"
    )
