"""kahanmaps lyapunov: numbers as text and JSON, orbits that end, exit statuses, and wrong use."""

from __future__ import annotations

import pytest
from cli_helpers import shell

from kahanmaps.version import __version__


def test_numbers_are_printed_per_time_and_per_step(kahanmaps):
    outcome = kahanmaps("lyapunov riccati --eps 1/10 --steps 300 --random 4")
    assert outcome.status == 0
    rows = outcome.rows
    assert rows[0] == ["orbits", "4 of 4"]
    assert rows[1] == ["steps", "300 after 30"]
    assert float(rows[2][1]) == pytest.approx(-2.2745, abs=1e-3)
    assert float(rows[2][2]) == pytest.approx(-2.2745 / 5, abs=1e-3)


def test_the_json_is_enough_to_redo_the_run(kahanmaps):
    command = "lyapunov lorenz --eps 1/100 --steps 200 --random 3 --box 5 --seed 4 --json"
    found = kahanmaps(command).json
    assert (found["command"], found["version"], found["seed"]) == ("lyapunov", __version__, 4)
    assert found["starts"] == {"random": 3, "box": "5"}
    assert (found["eps"], found["time_step"], found["steps"], found["transient"]) == ("1/100", "1/50", 200, 20)
    assert (found["steps_asked"], found["seconds"]) == (200, 60.0)
    assert len(found["per_time"]) == len(found["spread"]) == len(found["change_from_half"]) == 3
    assert found["sum"] == pytest.approx(found["log_volume"], abs=1e-9)
    assert found["residual"] < 1e-10
    assert found == kahanmaps(command).json


def test_starts_from_a_file(kahanmaps, tmp_path):
    (tmp_path / "starts.csv").write_text("x,y\n1,0\n1/2,1/3\n")
    found = kahanmaps("lyapunov harmonic --eps 1/10 --steps 50 --json --starts", tmp_path / "starts.csv").json
    assert found["orbits"] == 2
    assert found["per_time"] == pytest.approx([0, 0], abs=1e-12)


def test_orbits_that_end_are_counted(kahanmaps, tmp_path):
    (tmp_path / "starts.csv").write_text("10\n-1\n")  # 10 is the pole of x^2 at eps = 1/20
    outcome = kahanmaps("lyapunov --vars x --rhs x^2 --eps 1/20 --steps 50 --starts", tmp_path / "starts.csv")
    assert outcome.status == 3
    assert outcome.rows[0] == ["orbits", "1 of 2"]
    assert "1 of 2 orbits left the range of floats or met a pole" in outcome.err


def test_no_orbit_left_is_null_in_json(kahanmaps, tmp_path):
    (tmp_path / "starts.csv").write_text("10\n")
    outcome = kahanmaps("lyapunov --vars x --rhs x^2 --eps 1/20 --steps 50 --json --starts", tmp_path / "starts.csv")
    assert outcome.status == 3
    assert (outcome.json["per_time"], outcome.json["sum"], outcome.json["log_volume"]) == ([None], None, None)
    assert outcome.json["residual"] is None


def test_a_clock_that_stops_is_status_three(kahanmaps):
    outcome = kahanmaps("lyapunov lorenz --eps 1/100 --seconds 0.0000001")
    assert outcome.status == 3
    assert "stopped by the clock" in outcome.err


def test_help_fits_the_screen(tmp_path):
    outcome = shell("kahanmaps lyapunov --help", tmp_path, COLUMNS="80")
    assert outcome.status == 0
    assert max(map(len, outcome.out.splitlines())) <= 80
