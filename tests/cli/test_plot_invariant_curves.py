"""kahanmaps plot invariant-curves: the file, what is said, exit statuses, wrong use."""

from __future__ import annotations

import pytest

POLE = "--vars x,y --rhs=-6*x*y --rhs '3*y^2 - 3*x^2' --start 3/5,4/5 --eps 1/6"
PAIR = "plot invariant-curves paper_m2 --start 1/2,-1/3,0,1 --eps 1/20 --steps 30"


@pytest.fixture
def unrendered(monkeypatch):
    """Figures are made but not rendered: for tests of what is said."""
    monkeypatch.setattr("kahanmaps.plots.figures.picture_bytes", lambda *_: b"")
    monkeypatch.setattr("kahanmaps.plots.terminal.draw_in_characters", lambda *_: [])


def test_a_picture_is_written_and_the_structure_said(kahanmaps, tmp_path):
    outcome = kahanmaps(PAIR, "-o", tmp_path / "curves.svg")
    assert outcome.status == 0
    assert outcome.out == ""
    assert "a member of the family, chi = (t - 1)*(t - 2); eps = 1/20 (time step 2 eps = 1/10)" in outcome.err
    assert (tmp_path / "curves.svg").read_text().count("<svg") == 1


@pytest.mark.usefixtures("unrendered")
def test_dots_outside_are_counted_unless_the_whole_plane_is_shown(kahanmaps, tmp_path):
    assert "dots outside the windows:" in kahanmaps(PAIR, "-o", tmp_path / "a.png").err
    assert "dots outside" not in kahanmaps(PAIR, "--projective -o", tmp_path / "a.png").err


@pytest.mark.usefixtures("unrendered")
def test_a_recognised_member_is_said_to_be_one(kahanmaps, tmp_path):
    outcome = kahanmaps(
        "plot invariant-curves --vars x,y --rhs=-6*x*y --rhs '3*y^2 - 3*x^2' --start 1,1/3 --eps 1/6 -o",
        tmp_path / "a.png",
    )
    assert outcome.status == 0
    assert "a hidden member of the family" in outcome.err


@pytest.mark.usefixtures("unrendered")
def test_a_pole_is_told_and_gives_status_3_with_a_picture(kahanmaps, tmp_path):
    outcome = kahanmaps(f"plot invariant-curves {POLE} -o", tmp_path / "pole.png")
    assert outcome.status == 3
    assert "the orbit ends before step 1: a pole" in outcome.err
    assert (tmp_path / "pole.png").exists()


@pytest.mark.usefixtures("unrendered")
def test_several_starts_name_the_one_with_the_pole(kahanmaps, tmp_path):
    outcome = kahanmaps(f"plot invariant-curves {POLE} --start 1,1 -o", tmp_path / "pole.png")
    assert outcome.status == 3
    assert "start 1: the orbit ends before step 1" in outcome.err


@pytest.mark.usefixtures("unrendered")
def test_the_orbit_itself_is_shown_in_two_variables(kahanmaps, tmp_path):
    assert kahanmaps(PAIR, "--original x1,x3 --flow -o", tmp_path / "a.pdf").status == 0
    outcome = kahanmaps(PAIR, "--original x1,y -o", tmp_path / "b.pdf")
    assert outcome.status == 2
    assert "found --original x1,y, expected two of the variables x1, x2, x3, x4, as X,Y" in outcome.err


def test_a_repeated_root_is_told(kahanmaps, tmp_path):
    kahanmaps("family new --eigenvalues 1,1 --seed 7 -q -o", tmp_path / "twice.toml")
    outcome = kahanmaps("plot invariant-curves", tmp_path / "twice.toml", "--start 1,0,0,1 --eps 1/20")
    assert outcome.status == 2
    assert "chi has a repeated root" in outcome.err
