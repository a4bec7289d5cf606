"""kahanmaps lyapunov: numbers as text and JSON, orbits that end, exit statuses, and wrong use."""

import pytest


def test_numbers_are_printed_per_time_and_per_step(kahanmaps):
    outcome = kahanmaps("lyapunov riccati --eps 1/10 --steps 300 --random 4")
    assert outcome.status == 0
    rows = outcome.rows
    assert rows[0] == ["orbits", "4 of 4"]
    assert rows[1] == ["steps", "300 after 30"]
    assert float(rows[2][1]) == pytest.approx(-2.2745, abs=1e-3)
    assert float(rows[2][2]) == pytest.approx(-2.2745 / 5, abs=1e-3)


def test_starts_from_a_file(kahanmaps, tmp_path):
    (tmp_path / "starts.csv").write_text("x,y\n1,0\n1/2,1/3\n")
    found = kahanmaps("lyapunov harmonic --eps 1/10 --steps 50 --json --starts", tmp_path / "starts.csv").json
    assert found["orbits"] == 2
    assert found["per_time"] == pytest.approx([0, 0], abs=1e-12)
