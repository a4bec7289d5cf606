"""kahanmaps plot portrait: what is drawn from which words, what is said, exit statuses, stored orbits, wrong use."""

import signal

import numpy as np
import pytest

import kahanmaps as km
from kahanmaps.documents.catalog import load
from kahanmaps.maps.floats.fast import FloatOrbit
from kahanmaps.plots.portraits import draw_portrait as drawing
from kahanmaps_cli.screen.progress import Progress

LV = "plot portrait lotka_volterra --eps 1/20 --start 1,2 --steps 30"


@pytest.fixture
def drawn(monkeypatch):
    """What was drawn last, as the numbers that were handed to the drawing functions; figures are not rendered."""
    monkeypatch.setattr("kahanmaps.plots.figures.picture_bytes", lambda *_: b"")
    monkeypatch.setattr("kahanmaps.plots.terminal.draw_in_characters", lambda *_: [])
    seen = []
    for name in ("draw_portrait", "draw_density"):
        draw = getattr(drawing, name)

        def spy(found, style, draw=draw, **how):
            seen.append((found, how))
            return draw(found, style, **how)

        monkeypatch.setattr(drawing, name, spy)
    return seen


def test_a_portrait_is_drawn_in_the_terminal_unless_a_file_is_named(kahanmaps):
    outcome = kahanmaps(LV)
    assert outcome.status == 0
    assert any("\N{BRAILLE PATTERN BLANK}" < mark <= "\N{BRAILLE PATTERN DOTS-12345678}" for mark in outcome.out)
    assert outcome.err == "lotka_volterra: 1 orbit, 30 steps, eps = 1/20 (time step 2 eps = 1/10)\n"


def test_a_long_title_is_set_in_lines_and_no_formula(kahanmaps, monkeypatch):
    titles = []
    monkeypatch.setattr("kahanmaps.plots.figures.picture_bytes", lambda figure, *_: titles.append(figure) or b"")
    kahanmaps(LV + " --format svg --size 8 --title", "'" + "costs $5 " * 12 + "'")
    first, _, third = titles[0].get_suptitle().split("\n")
    assert first.startswith(r"costs \$5 costs \$5")
    assert third


def test_an_algebraic_parameter_is_rounded_for_starts_and_flow(kahanmaps, drawn):
    line = "plot portrait lotka_volterra --eps 1/20 --steps 30 --flow -p"
    assert kahanmaps(line, "a=1.4142135623730951").status == kahanmaps(line, "'a=root of t^2 - 2 near 1.4'").status == 0
    near, found = (portrait for portrait, _ in drawn)
    np.testing.assert_allclose(found.points, near.points, rtol=1e-9)
    assert len(found.flow.solutions) == len(near.flow.solutions) > 0
    top = "plot portrait euler_top --eps 1/10 --start 1,1,1 --colour-by F1 -p"
    assert kahanmaps(top, "'a1=root of t^2 - 2 near 1.4'").status == 0
    top = "plot portrait euler_top --eps 1/10 --start 1,1,1 --levels a1*x1+eps*x2 --axes x1,x2 -p"
    assert kahanmaps(top, "'a1=root of t^2 - 2 near 1.4'").status == 0


@pytest.mark.parametrize("ending", [".csv", ".npz"])
def test_stored_points_over_a_number_field_are_drawn_at_the_root_that_is_meant(kahanmaps, drawn, tmp_path, ending):
    line = "orbit euler_top --eps 1/4 --start 1,1,1 --steps 6 -p"
    for k, a in enumerate(("root of t^2 - 2 near 1.4", "root of t^2 - 2 near -1.4", "root of t^2 - 2")):
        assert kahanmaps(line, f"'a1={a}'", "-o", tmp_path / f"{k}{ending}").status == 0
    assert kahanmaps("plot portrait --from", tmp_path / f"0{ending}").status == 0
    assert kahanmaps("plot portrait --from", tmp_path / f"1{ending}").status == 0
    assert "may be" in kahanmaps("plot portrait --from", tmp_path / f"2{ending}").err
    file = km.load("euler_top", a1="root of t^2 - 2 near 1.4")
    known = [point.x[:2] for point in km.orbit(file, [1, 1, 1], "1/4", 6, arithmetic="float")]
    np.testing.assert_allclose(drawn[0][0].points[:, 0], known, rtol=1e-12)
    assert not np.allclose(drawn[1][0].points[:, 0], known, rtol=1e-3)


def test_the_points_are_those_of_the_float_orbit(kahanmaps, drawn, tmp_path):
    kahanmaps(LV)
    kahanmaps(
        "orbit lotka_volterra --eps 1/20 --start 1,2 --steps 30 --arithmetic float --kernel numpy -o",
        tmp_path / "o.npy",
    )
    np.testing.assert_allclose(drawn[0][0].points[:, 0], np.load(tmp_path / "o.npy"), rtol=1e-13)


def test_backward_steps_by_the_inverse(kahanmaps, drawn):
    kahanmaps("plot portrait lotka_volterra --eps 1/20 --start 1,2 --start 1,3 --steps 1 --backward")
    # the exact image of (1, 2) is (191/211, 420/211); back from there
    kahanmaps("plot portrait lotka_volterra --eps 1/20 --start 191/211,420/211 --steps 1 --backward")
    np.testing.assert_allclose(drawn[1][0].points[1, 0], [1, 2], rtol=1e-14)


def test_starts_come_from_a_file_or_at_random(kahanmaps, drawn, tmp_path):
    (tmp_path / "starts.csv").write_text("y,x\n2,1\n3,1\n")
    kahanmaps("plot portrait lotka_volterra --eps 1/20 --steps 0 --starts", tmp_path / "starts.csv")
    kahanmaps("plot portrait harmonic --eps 1/20 --steps 0 --random 5 --box 2 --seed 3")
    assert drawn[0][0].points[0].tolist() == [[1, 2], [1, 3]]
    assert drawn[1][0].points.shape == (1, 5, 2)


def test_of_more_than_two_variables_the_axes_are_chosen_and_said(kahanmaps, drawn):
    outcome = kahanmaps("plot portrait euler_top --eps 1/10 --start 1,1/2,1/3 --steps 50")
    assert "axes x1, x2" in outcome.err or "axes x1, x3" in outcome.err or "axes x2, x3" in outcome.err
    assert len(drawn[0][0].labels) == 2


def test_a_plane_over_the_step_has_no_arrows(kahanmaps, drawn):
    assert kahanmaps(LV + " --axes x,y,step").status == kahanmaps(LV).status == 0
    assert [len(portrait.flow.places) > 0 for portrait, _ in drawn] == [False, True]


def test_level_curves_go_through_the_starts_or_where_they_are_wanted(kahanmaps, drawn):
    command = "plot portrait weierstrass --eps 1/10 --start=-1/2,0 --steps 40 --window=-2,2,-2,2 --levels modified_H"
    kahanmaps(command)
    outcome = kahanmaps(command + " --levels-at=-1/2,1000")
    through, at = (found.levels for found, _ in drawn)
    assert len(through.levels) == 1
    assert at.levels == (-0.5, 1000.0)
    assert "1 of 2 levels of modified_H have no curve in the window" in outcome.err


def test_points_outside_are_counted_on_standard_error_and_in_the_picture(kahanmaps, drawn):
    outcome = kahanmaps("plot portrait --vars x,y --rhs x --rhs y --eps 1/4 --start 1,1 --steps 40")
    assert "points lie outside the window" in outcome.err
    assert drawn[0][1]["note"] == f"{drawn[0][0].left_out} points outside"


def test_a_density_counts_every_point(kahanmaps, drawn):
    outcome = kahanmaps("plot portrait lotka_volterra --eps 1/20 --start 1,2 --start 1,3 --steps 400 --density")
    assert outcome.status == 0
    assert drawn[0][0].points == drawn[0][0].counts.sum() + drawn[0][0].outside == 802


def test_ctrl_c_ends_a_portrait_without_a_picture(kahanmaps, drawn, monkeypatch, tmp_path):
    """Also where the orbits are complete already, as those of one portion are."""
    monkeypatch.setattr(Progress, "__call__", lambda self, sentence: signal.raise_signal(signal.SIGINT))
    outcome = kahanmaps(LV, "-o", tmp_path / "part.svg")
    assert (outcome.status, outcome.err.split()) == (130, ["interrupted"])
    assert not drawn
    assert not (tmp_path / "part.svg").exists()


@pytest.mark.parametrize(
    ("name", "how"),
    [
        ("o.npy", "--arithmetic float --kernel numpy"),
        ("exact.npz", ""),
        ("o.csv", "--integral x*y --format csv"),
        ("balls.jsonl", "--arithmetic ball:100"),
    ],
)
def test_stored_orbits_are_drawn_like_walked_ones(kahanmaps, drawn, tmp_path, name, how):
    path = tmp_path / name
    kahanmaps(f"orbit lotka_volterra --eps 1/20 --start 1,2 --steps 8 -q {how} -o", path)
    assert kahanmaps("plot portrait --from", path).status == 0
    orbit = FloatOrbit(load("lotka_volterra", {}).system, "1/20", [1, 2], 8)
    np.testing.assert_allclose(drawn[0][0].points[:, 0], [x for _, x in orbit], rtol=1e-13)


def test_points_are_coloured_by_an_integral_that_a_theorem_gives(kahanmaps, drawn):
    words = "plot portrait weierstrass --eps 1/10 --start=-1/2,0 --steps 40 --colour-by"
    kahanmaps(f"{words} 'modified H'")
    kahanmaps(f"{words} H")  # of the flow, which the map does not conserve
    kept, moved = (np.ptp(found.values) for found, _ in drawn)
    assert kept < 1e-13
    assert moved > 1e-4


def test_a_stored_ensemble_takes_its_names_from_the_system(kahanmaps, drawn, tmp_path):
    path = tmp_path / "e.npy"
    kahanmaps("ensemble weierstrass --random 3 --box 1/4 --eps 1/10 --steps 30 --every 1 -q -o", path)
    assert kahanmaps("plot portrait weierstrass --eps 1/10 --colour-by modified_H --from", path).status == 0
    assert drawn[0][0].labels == ("$x$", "$y$")
    assert kahanmaps("plot portrait --density --from", path).status == 0
    assert drawn[1][0].points == 3 * 31


def test_the_steps_of_a_file_are_kept_and_those_of_npy_are_records(kahanmaps, drawn, tmp_path):
    for name in ("a.npz", "a.npy"):
        kahanmaps(
            "orbit riccati --eps 1/20 --start 0 --steps 8 --every 4 --arithmetic float --kernel numpy -q -o",
            tmp_path / name,
        )
    assert "number of the record" not in kahanmaps("plot portrait --from", tmp_path / "a.npz").err
    assert "number of the record" in kahanmaps("plot portrait --from", tmp_path / "a.npy").err
    assert [found.points[:, 0, 0].tolist() for found, _ in drawn] == [[0, 4, 8], [0, 1, 2]]


def test_a_file_of_another_system_is_refused(kahanmaps, tmp_path):
    np.save(tmp_path / "o.npy", np.ones((3, 2)))
    outcome = kahanmaps("plot portrait euler_top --from", tmp_path / "o.npy")
    assert (outcome.status, "found points of dimension 2, expected 3" in outcome.err) == (2, True)
