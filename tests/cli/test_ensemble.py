"""kahanmaps ensemble: starts from text, .npy files or a seed, and what is summed up and written of many orbits."""

import io
import os
import signal

import numpy as np
import pytest
from cli_helpers import interrupted

TOP = "ensemble euler_top --eps 1/10 --kernel numpy"


@pytest.mark.parametrize(
    "text",
    [
        "1,1/2,-2\n0.25,3,1\n",
        "# two points\n\n1\t0.5\t-2 # the first\n  25e-2 , 3 , 1  \n",
        "step,x3,x1,x2\r\n0,-2,1,1/2\r\n5,1,0.25,3\r\n",
        "\ufeff1,1/2,-2\n0.25,3,1\n",
    ],
    ids=["commas", "comments", "other columns", "byte order mark"],
)
def test_text_has_a_point_in_each_line(kahanmaps, tmp_path, text):
    (tmp_path / "starts.csv").write_text(text, encoding="utf-8")
    kahanmaps(f"{TOP} --steps 0 --starts", tmp_path / "starts.csv", "-o", tmp_path / "x.npy")
    assert np.load(tmp_path / "x.npy").tolist() == [[[1.0, 0.5, -2.0], [0.25, 3.0, 1.0]]]


def test_the_seed_settles_what_is_drawn(kahanmaps, tmp_path):
    def drawn(more):
        assert kahanmaps(f"{TOP} --steps 0 --random 50 {more} -q -o", tmp_path / "x.npy").status == 0
        return np.load(tmp_path / "x.npy")[0]

    assert (drawn("--seed 3") == drawn("--seed 3 --box 1")).all()
    assert (drawn("") == drawn("--seed 0")).all()
    assert (drawn("--seed 3") != drawn("--seed 4")).all()
    assert (drawn("--seed 3 --box 1/4") == drawn("--seed 3") / 4).all()
    assert np.abs(drawn("--box 1/4")).max() <= 0.25
    # so that a change of numpy or of ours does not go unnoticed
    assert drawn("--seed 3")[0].tolist() == pytest.approx([-0.828701666, -0.526379, 0.602548930], abs=1e-6)


def test_members_are_stepped_in_their_normal_form(kahanmaps, pair):
    command = ("ensemble", pair, "--random 5 --eps 1/10 --steps 20 --kernel numpy --json")
    chosen, generic = kahanmaps(*command).json, kahanmaps(*command, "--method generic").json
    assert (chosen["method"], chosen["kernel"]) == ("normal-form", "numpy normal form")
    assert (generic["method"], generic["kernel"]) == ("generic", "numpy generic")
    assert [drift["name"] for drift in chosen["drift"]] == ["h/(1 + eps^2 D) at t = -2", "h/(1 + eps^2 D) at t = 1"]
    assert generic["drift"] == []


def test_grids_and_lines_are_points_in_the_order_of_numpy(kahanmaps, tmp_path):
    path = tmp_path / "x.npy"

    def drawn(command, more="-o"):
        assert kahanmaps(command, "-q", more, path).status == 0
        return np.load(path)[0]

    grid = drawn(f"{TOP} --steps 0 --grid x3=-1:1:5,x1=0:1:3,x2=1/3")
    first, _, third = np.meshgrid([0, 0.5, 1], [1 / 3], np.linspace(-1, 1, 5), indexing="ij")
    assert grid.tolist() == np.stack([first.ravel(), np.full(15, 1 / 3), third.ravel()], axis=1).tolist()
    line = drawn(f"{TOP} --steps 0 --line 0,0,1:1,-1/2,1:5")
    assert line.tolist() == [[k / 4, -k / 8, 1] for k in range(5)]
    assert drawn(f"{TOP} --steps 0 --start 1,2,3 --start 1/3,0,0").tolist() == [[1, 2, 3], [1 / 3, 0, 0]]
    points = {"points": [["1", "2", "3"], ["1/3", "0", "0"]]}
    assert kahanmaps(f"{TOP} --steps 0 --start 1,2,3 --start 1/3,0,0 --json").json["initial_points"] == points


def test_statistics_are_those_of_the_orbits(kahanmaps, tmp_path):
    path = tmp_path / "x.npy"
    command = "ensemble henon_heiles --grid q1=-1:1:9,p2=0:1:5 --eps 1/20 --steps 60 --every 1 --radius 4"
    record = kahanmaps(command, "--integral E=q1^2+p2*q2 --integral known --json -q -o", path).json
    x = np.load(path)
    with np.errstate(over="ignore"):
        values = x[..., 0] ** 2 + x[..., 3] * x[..., 1]
        drift = np.sort(np.abs(values - values[0]).max(axis=0))
        at = (np.abs(x).max(axis=2) > 4).argmax(axis=0)
    left = np.sort(at[(np.abs(x).max(axis=2) > 4).any(axis=0)])
    assert 0 < len(left) < 45
    found = record["drift"][0]["distribution"]
    expected = {"min": drift[0], "25%": drift[11], "50%": drift[22], "95%": drift[42], "max": drift[-1]}
    assert {key: found[key] for key in expected} == pytest.approx(expected, rel=1e-12)
    assert found["mean"] == pytest.approx(drift.mean())
    assert (record["escaped"]["orbits"], record["escaped"]["radius"]) == (len(left), "4")
    assert [record["escaped"]["step"][key] for key in ("min", "max", "mean")] == [left[0], left[-1], left.mean()]
    names = [drift["name"] for drift in record["drift"]]
    assert names == ["E", "modified_H", "H"]
    modified, plain = (entry["distribution"]["50%"] for entry in record["drift"][1:])
    assert modified < 1e-12 < 1e-9 < plain  # the map conserves the one and not the other


def test_without_every_the_file_holds_the_starts_and_the_ends(kahanmaps, tmp_path):
    path = tmp_path / "x.npy"
    for more in ("", " --integral F1"):
        kahanmaps(f"{TOP} --random 3 --steps 100{more} -o", path)
        two = np.load(path)
        kahanmaps(f"{TOP} --random 3 --steps 100 --every 50{more} -o", path)
        assert two.tolist() == np.load(path)[::2].tolist()
        assert two.dtype == np.float64


def test_an_interrupt_gives_130_and_leaves_a_valid_file(tmp_path):
    path = tmp_path / "x.npy"
    outcome = interrupted(f"{TOP} --steps {10**9} --random 5 --every 10 --json", path, signal.SIGTERM)
    result = outcome.json
    assert (outcome.status, result["status"]) == (130, "interrupted")
    assert f"interrupted after step {result['steps_taken']}" in outcome.err
    assert np.load(path).shape == tuple(result["output"]["shape"]) == (result["steps_taken"] // 10 + 1, 5, 3)


def npy(array) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=True)
    return stream.getvalue()


HUGE = npy(np.ones((2, 3))).replace(b"(2, 3), }          ", b"(999999999999, 3), }")
ABSURD = npy(np.ones((2, 3))).replace(b"(2, 3), }", b"(-2, 3),}")


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"1,2,\x1b[31m\n", r"s:1: entry 3: found '\x1b[31m'"),
        (b"1" * 2_000_000 + b",2,3\n", "s:1: entry 1: found a number of 2000000 characters"),
        (b"1," * 100_000 + b"1\n", "s:1: found 100001 numbers, expected 3"),
        (bytes(range(256)), "neither a .npy file nor UTF-8 text"),
        (b"\x93NUMPY", "a .npy file that cannot be read"),
        (b"\x93NUMPY\x09\x00" + b"x" * 100, "not (9, 0)"),
        (npy(np.ones(3)), "found an array of shape (3,), expected (n, 3)"),
        (npy(np.ones((2, 2))), "found an array of shape (2, 2), expected (n, 3)"),
        (npy(np.ones((2, 3)))[:-1], "expected 48 bytes got 47"),
        (HUGE, "Unable to allocate"),
        (ABSURD, "negative dimensions"),
        (npy(np.array([[1, 2, None]])), "Object arrays cannot be loaded"),
        (npy(np.ones((1, 3), dtype=complex)), "found an array of complex numbers"),
        (npy(np.array([(1.0, 2)], dtype=[("a", "f8"), ("b", "i4")])), "found an array of the type"),
        (npy(np.array([[1.0, 2, 3], [1, np.nan, 3], [np.inf, 1, 1]])), "row 1: found nan"),
    ],
    ids=lambda data: repr(data[:30]),
)
def test_wrong_starts_give_2_and_say_where(kahanmaps, tmp_path, data, words):
    path = tmp_path / "s"
    path.write_bytes(data)
    outcome = kahanmaps(f"{TOP} --steps 1 --starts", path)
    assert (outcome.status, outcome.out) == (2, "")
    assert outcome.err.startswith(f"Error: {path}:")
    assert len(outcome.err) < 600
    assert words in outcome.err.replace(str(path), "s")
    if not data.startswith(b"\x93NUMPY"):
        (tmp_path / "s.npy").write_bytes(data[:100])
        assert "found no .npy file" in kahanmaps(f"{TOP} --steps 1 --starts", tmp_path / "s.npy").err


def test_starts_are_not_awaited_from_a_pipe_that_nobody_may_write_to(kahanmaps, tmp_path):
    os.mkfifo(tmp_path / "s")
    outcome = kahanmaps(f"{TOP} --steps 1 --starts", tmp_path / "s")
    assert (outcome.status, outcome.out) == (2, "")
    assert "found a pipe or a device, expected a file" in outcome.err


def test_integrals_may_contain_an_algebraic_parameter(kahanmaps, tmp_path):
    path = tmp_path / "s.txt"
    path.write_text("1/2,1/3,1/5,1/11\n")
    command = "ensemble henon_heiles -p c='sqrt(2)' --eps 1/10 --steps 0 --json"
    record = kahanmaps(command, "--integral c*c --integral c*c*q1 --starts", path).json
    assert [entry["initial"] for entry in record["drift"]] == pytest.approx([2, 1])
    assert [entry["orbits"] for entry in record["drift"]] == [1, 1]
