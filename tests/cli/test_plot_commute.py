"""kahanmaps plot commute: both outcomes, missing points, wrong use."""

from __future__ import annotations

import pytest

PAIR = "plot commute paper_m2 --start 1/2,-1/3,0,1 --eps 1/50"


@pytest.fixture
def unrendered(monkeypatch):
    """Figures are made but not rendered: for tests of what is said."""
    monkeypatch.setattr("kahanmaps.plots.figures.picture_bytes", lambda *_: b"")
    monkeypatch.setattr("kahanmaps.plots.terminal.draw_in_characters", lambda *_: [])


def test_the_associated_maps_close_and_the_control_does_not(kahanmaps, tmp_path):
    outcome = kahanmaps(PAIR, "-o", tmp_path / "square.pdf")
    assert outcome.status == 0
    assert "f_++ and f_+-: closes exactly" in outcome.err
    assert "J grad H_0 and J grad H_1: gap 0.00281" in outcome.err
    assert (tmp_path / "square.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.usefixtures("unrendered")
def test_two_systems_are_one_panel(kahanmaps, tmp_path):
    words = "plot commute euler_top zhukovski_volterra_1 --start 1,1/2,-1 --eps 1/10 -o"
    outcome = kahanmaps(words, tmp_path / "open.svg")
    assert outcome.status == 0
    assert "f = euler_top, g = zhukovski_volterra_1: gap" in outcome.err


@pytest.mark.usefixtures("unrendered")
def test_a_system_commutes_with_itself_but_not_at_another_step(kahanmaps, tmp_path):
    words = "plot commute lorenz lorenz --start 1,2,3 --eps 1/100"
    assert "closes exactly" in kahanmaps(words, "-o", tmp_path / "a.png").err
    assert ": gap " in kahanmaps(words, "--eps2 1/50 --axes x,z -o", tmp_path / "b.png").err


@pytest.mark.usefixtures("unrendered")
def test_missing_points_are_told_with_status_3(kahanmaps, tmp_path):
    words = "plot commute --vars x,y --rhs=-6*x*y --rhs '3*y^2 - 3*x^2' --start 3/5,4/5 --eps 1/6 -o"
    outcome = kahanmaps(words, tmp_path / "a.png")
    assert outcome.status == 3
    assert "points are missing: Phi_f: the map has no value at a point on the way" in outcome.err
    assert (tmp_path / "a.png").exists()
