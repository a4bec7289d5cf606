"""kahanmaps plot portrait, degrees and heights: what is drawn from which words, and what is said."""

import io
import json
import signal
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.image import imread

from kahanmaps.plots.portraits import portrait as drawing
from kahanmaps_cli.screen.progress import Progress

PLOT = "plot portrait -o - --format svg"
FISH = f"{PLOT} weierstrass --eps 1/10 --start=-1/2,0 --steps 40 --no-field"


@pytest.fixture
def drawn(monkeypatch):
    """What was drawn last, as the numbers that were handed to the drawing functions; figures are not rendered."""
    monkeypatch.setattr("kahanmaps.plots.figures.picture_bytes", lambda *_: b"")
    seen = []
    draw = drawing.plot_portrait

    def spy(result, style, **how):
        seen.append((result, how))
        return draw(result, style, **how)

    monkeypatch.setattr(drawing, "plot_portrait", spy)
    return seen


def test_an_algebraic_parameter_is_rounded_for_starts_and_flow(kahanmaps, drawn, monkeypatch):
    monkeypatch.setattr("kahanmaps.plots.portraits.flow.START_COUNT", 3)
    line = f"{PLOT} lotka_volterra --eps 1/20 --steps 30 --flow -p"
    assert kahanmaps(line, "a=1.4142135623730951").status == kahanmaps(line, "'a=root of t^2 - 2 near 1.4'").status == 0
    near, result = (portrait for portrait, _ in drawn)
    np.testing.assert_allclose(result.points, near.points, rtol=1e-9)
    assert len(result.flow.solutions) == len(near.flow.solutions) > 0
    top = f"{PLOT} euler_top --eps 1/10 --start 1,1,1 --colour-by F1 -p"
    assert kahanmaps(top, "'a1=root of t^2 - 2 near 1.4'").status == 0


def test_the_points_are_those_of_the_float_orbit(kahanmaps, drawn, tmp_path):
    line = "lotka_volterra --eps 1/20 --start 1,2 --steps 30"
    kahanmaps(f"{PLOT} {line}")
    kahanmaps(f"orbit {line} --arithmetic float --kernel numpy -o", tmp_path / "o.npy")
    np.testing.assert_allclose(drawn[0][0].points[:, 0], np.load(tmp_path / "o.npy"), rtol=1e-13)


def test_backward_steps_by_the_inverse(kahanmaps, drawn):
    kahanmaps(f"{PLOT} lotka_volterra --eps 1/20 --start 1,2 --start 1,3 --steps 1 --backward")
    # the exact image of (1, 2) is (191/211, 420/211); back from there
    kahanmaps(f"{PLOT} lotka_volterra --eps 1/20 --start 191/211,420/211 --steps 1 --backward")
    np.testing.assert_allclose(drawn[1][0].points[1, 0], [1, 2], rtol=1e-14)


def test_starts_come_from_a_file_or_at_random(kahanmaps, drawn, tmp_path):
    (tmp_path / "starts.csv").write_text("y,x\n2,1\n3,1\n")
    kahanmaps(f"{PLOT} lotka_volterra --eps 1/20 --steps 0 --starts", tmp_path / "starts.csv")
    kahanmaps(f"{PLOT} harmonic --eps 1/20 --steps 0 --random 5 --box 2 --seed 3")
    assert drawn[0][0].points[0].tolist() == [[1, 2], [1, 3]]
    assert drawn[1][0].points.shape == (1, 5, 2)


def test_level_curves_go_through_the_starts_or_where_they_are_wanted(kahanmaps, drawn):
    command = f"{FISH} --window=-2,2,-2,2 --levels modified_H"
    kahanmaps(command)
    outcome = kahanmaps(command + " --levels-at=-1/2,1000")
    through, at = (portrait.levels for portrait, _ in drawn)
    assert len(through) == 1
    assert [bool(pieces) for pieces in at] == [True, False]
    assert "1 of 2 levels of modified_H have no curve in the window" in outcome.err


def test_ctrl_c_ends_a_portrait_without_a_picture(kahanmaps, drawn, monkeypatch, tmp_path):
    """Also where the orbits are complete already, as those of one portion are."""
    monkeypatch.setattr(Progress, "__call__", lambda self, sentence: signal.raise_signal(signal.SIGINT))
    outcome = kahanmaps("plot portrait harmonic --eps 1/20 --start 1,2 --steps 30 -o", tmp_path / "part.svg")
    assert (outcome.status, outcome.err.split()) == (130, ["interrupted"])
    assert not drawn
    assert not (tmp_path / "part.svg").exists()


def test_points_are_coloured_by_an_integral_that_a_theorem_gives(kahanmaps, drawn):
    kahanmaps(f"{FISH} --colour-by 'modified H'")
    kahanmaps(f"{FISH} --colour-by H")  # of the flow, which the map does not conserve
    kept, moved = (np.ptp(portrait.values) for portrait, _ in drawn)
    assert kept < 1e-13
    assert moved > 1e-4


def test_degrees_of_a_record_are_the_same_picture(kahanmaps, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    record = kahanmaps("degrees euler_top --json").out
    Path("record.json").write_text(record)
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO(record.encode())))
    for source, name in (("euler_top", "a"), ("--from record.json", "b"), ("--from -", "c")):
        assert kahanmaps(f"plot degrees {source} --size 4 -q -o {name}.png").status == 0
    # The metadata tell the commands; the pixels are the same.
    first, second, third = (imread(f"{name}.png") for name in "abc")
    assert (first == second).all()
    assert (first == third).all()


@pytest.mark.usefixtures("unrendered")
def test_a_record_of_an_incomplete_survey_is_reported(kahanmaps, tmp_path):
    record = kahanmaps("heights weierstrass --eps 1/10 --starts 1 --steps 20 --json").json
    (tmp_path / "r.json").write_text(json.dumps({**record, "complete": False}))
    done = kahanmaps("plot heights -o - --format svg --from", tmp_path / "r.json")
    assert (done.status, "stopped early" in done.err) == (3, True)
