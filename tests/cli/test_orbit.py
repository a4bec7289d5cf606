"""kahanmaps orbit: exact iterates in four kinds of arithmetic and four formats, complete and valid whatever happens."""

import csv
import json
import shlex
import signal
from types import SimpleNamespace

import numpy as np
import pytest
from cli_helpers import interrupted, shell, terminal

TOP = "orbit euler_top --start 1,1/2,-1/3 --eps 1/10"
LORENZ = "orbit lorenz --start 1,-1/2,2 --eps 1/20"


def test_a_start_and_parameters_may_be_written_as_people_paste_them(kahanmaps):
    others = "--eps 1/10 --steps 2"
    plain = kahanmaps(f"orbit 'dx/dt = a*x - x*y, dy/dt = x*y - b*y' -p a=2 -p b=1/3 --start 1,-1/2 {others}")
    assert plain.status == 0, plain.err
    for start in ("'[1,-1/2]'", "'1 -1/2'", "'(1, -1/2)'"):
        line = f"orbit 'x_dot = a*x - x*y; y_dot = x*y - b*y' -p a=2,b=1/3 --start {start} {others}"
        assert kahanmaps(line).out == plain.out


def test_a_file_of_xpp_is_a_system(kahanmaps, tmp_path):
    path = tmp_path / "lorenz.ode"
    path.write_text("par s=10,r=28,b=8/3\nx'=s*(y-x)\ny'=x*(r-z)-y\nz'=x*y-b*z\ndone\n")
    others = "--start 1,2,3 --eps 1/10 --steps 2 --format csv"
    assert kahanmaps(f"orbit {path} {others}").out == kahanmaps(f"orbit lorenz {others}").out


@pytest.mark.parametrize("arithmetic", ["exact", "float", "mod:10007", "ball:100"])
def test_an_orbit_can_be_made_again_from_its_header(kahanmaps, arithmetic):
    first = kahanmaps(f"{LORENZ} --steps 4 --arithmetic {arithmetic} --format jsonl --backward")
    header = first.records[0]
    assert header["arithmetic"] == arithmetic
    words = ["orbit", "--vars", ",".join(header["variables"]), *(f"--rhs={text}" for text in header["rhs"])]
    words += ["--start", ",".join(header["start"]), "--eps", header["eps"], "--steps", str(header["steps"])]
    words += ["--arithmetic", header["arithmetic"], f"--{header['direction']}", "--format", "jsonl"]
    assert kahanmaps(shlex.join(words)).records[1:] == first.records[1:]


def test_a_system_comes_from_a_file_or_the_catalogue_or_standard_input_or_the_command_line(kahanmaps, tmp_path):
    toml = kahanmaps("systems euler_top --toml").out
    (tmp_path / "top.toml").write_text(toml)
    others = "--start 1,2,3 --eps 1/10 --steps 2 --format jsonl"
    from_catalogue = kahanmaps(f"orbit euler_top {others}").records[1:]
    assert kahanmaps("orbit", tmp_path / "top.toml", others).records[1:] == from_catalogue
    inline = "--vars x1,x2,x3 --rhs x2*x3 --rhs -2*x3*x1 --rhs=x1*x2"
    assert kahanmaps(f"orbit {inline} {others}").records[1:] == from_catalogue
    assert shell(f"kahanmaps orbit - {others}", tmp_path, stdin=toml.encode()).records[1:] == from_catalogue


def test_csv_is_read_by_the_csv_module(kahanmaps):
    command = f"{TOP} --steps 2 --integral 'a, \"b\"=x1*x2' --integral p=1/(x1-1)"
    lines = kahanmaps(f"{command} --format csv").out.splitlines()
    records = kahanmaps(f"{command} --format jsonl").records
    table = list(csv.DictReader(lines))
    for row, record in zip(table, records[1:-1], strict=True):
        assert [row["step"], row["x1"], row["x2"], row["x3"]] == [str(record["step"]), *record["x"]]
        assert row['a, "b"'] == record["integrals"]['a, "b"']
        assert row["p"] == (record["integrals"]["p"] or "")


@pytest.fixture
def npz(kahanmaps, tmp_path):
    """Run an orbit into an npz file and load it."""

    def run(command: str) -> SimpleNamespace:
        status = kahanmaps(command, "-q -o", tmp_path / "orbit.npz").status
        with np.load(tmp_path / "orbit.npz", allow_pickle=False) as arrays:
            results = {name: arrays[name] for name in arrays.files}
        results["meta"] = json.loads(str(results["meta"]))
        return SimpleNamespace(status=status, **results)

    return run


@pytest.mark.parametrize("prime", [10007, 2**63 - 25])
def test_npz_holds_residues_as_integers(npz, kahanmaps, prime):
    command = f"{TOP} --steps 3 --arithmetic mod:{prime}"
    result = npz(command)
    assert result.x.dtype == np.int64
    assert result.x.tolist() == kahanmaps(f"{command} --format jsonl").points


def test_npz_that_would_grow_too_large_keeps_what_it_holds(npz, kahanmaps, monkeypatch):
    monkeypatch.setattr("kahanmaps.maps.orbits.writers.MAX_PADDED_BYTES", 1000)
    result = npz(f"{TOP} --steps 20")
    assert (result.status, result.meta["end"]["status"]) == (3, "budget")
    assert result.step.tolist() == list(range(result.meta["end"]["steps"] + 1))
    assert 1 < len(result.x) < 20


def test_progress_goes_to_standard_error_only(kahanmaps, slow_clock):
    outcome = kahanmaps(f"{TOP} --steps 3")
    assert outcome.err.splitlines()[0] == "step 0 of 3 (10 s)"
    assert outcome.err.splitlines()[-1].startswith("step 3 of 3 (")
    assert "step 3 of 3" not in outcome.out


@pytest.mark.parametrize("form", ["--arithmetic float", "--integral x1^2", ""])
def test_parquet_holds_the_table_of_csv_and_its_metadata(kahanmaps, tmp_path, form):
    parquet = pytest.importorskip("pyarrow.parquet")
    for name in ("o.parquet", "o.csv"):
        assert kahanmaps(f"{TOP} --steps 5 {form} -q -o", tmp_path / name).status == 0
    found = parquet.read_table(tmp_path / "o.parquet")
    expected = list(csv.DictReader((tmp_path / "o.csv").read_text().splitlines()))
    assert [{key: str(value) for key, value in row.items()} for row in found.to_pylist()] == expected
    known = json.loads((tmp_path / "o.csv.meta.json").read_text())
    assert json.loads(found.schema.metadata[b"kahanmaps"]) == known


def test_npz_is_refused_on_a_terminal():
    outcome = terminal(*shlex.split(f"{TOP} --steps 5 --format npz"))
    assert (outcome.status, outcome.out) == (2, "")
    assert "npz is a binary format: add -o FILE" in outcome.err


def test_an_interrupted_orbit_leaves_valid_lines_up_to_its_end(tmp_path):
    path = tmp_path / "orbit.jsonl"
    line = f"{TOP} --steps {10**12} --arithmetic mod:10007 --every 100"
    assert interrupted(line, path, signal.SIGINT).status == 130
    _, *points, end = map(json.loads, path.read_text().splitlines())
    steps = [point["step"] for point in points]
    assert (end["record"], end["status"]) == ("end", "interrupted")
    assert steps == list(range(0, end["steps"] + 1, 100))
    assert len(steps) > 1


MEMBER = "orbit paper_m3 --start 1,2,3,4,5,6 --eps 1/10"


@pytest.mark.parametrize("suffix", ["jsonl", "csv", "npz"])
def test_steps_beyond_machine_integers_are_written_in_every_format(kahanmaps, tmp_path, suffix):
    path = tmp_path / f"far.{suffix}"
    assert kahanmaps(f"{MEMBER} --at 5,{10**30} --arithmetic mod:10007 --method doubling -o {path}").status == 0
    assert path.stat().st_size > 0


def test_npy_holds_the_points_of_a_float_orbit(kahanmaps, tmp_path):
    command = f"{MEMBER} --steps 30 --every 7 --arithmetic float"
    outcome = kahanmaps(f"{command} -o", tmp_path / "x.npy")
    assert (outcome.status, outcome.out) == (0, "")
    points = kahanmaps(f"{command} --format jsonl").points
    assert np.load(tmp_path / "x.npy").tolist() == np.asarray(points, dtype=float).tolist()
    said = f"{tmp_path / 'x.npy'}: completed: 30 steps; largest observed drift of the integrals h/(1 + eps^2 D): "
    assert outcome.err.startswith(said)


def test_the_end_of_a_float_orbit_has_the_drift_of_its_integrals_and_near_singular_steps(kahanmaps):
    end = kahanmaps(f"{MEMBER} --steps 30 --arithmetic float --format jsonl").records[-1]
    assert list(end["drift"]) == [f"h/(1 + eps^2 D) at t = {root}" for root in (1, 2, 3)]
    assert end["near_singular"] == 0
    assert f"drift of the integrals h/(1 + eps^2 D): {max(end['drift'].values()):.3g}" in end["message"]
    end = kahanmaps(f"{TOP} --steps 5 --arithmetic float --format jsonl").records[-1]
    assert (end["near_singular"], end["message"], "drift" in end) == (0, "5 steps", False)


@pytest.mark.parametrize("method", ["generic", "normal-form", "doubling"])
def test_the_budget_is_kept_by_every_method(kahanmaps, method):
    run = kahanmaps(f"{MEMBER} --at 0,5,30 --max-digits 10 --format jsonl --method {method}")
    assert run.status == 3
    _, point, end = run.records
    assert (point["step"], end["status"]) == (0, "budget")


@pytest.mark.parametrize("system", ["paper_m2", "henon_heiles"])
def test_a_start_may_lie_in_a_number_field(kahanmaps, system):
    line = f"orbit {system} --start 1,t,1,2 -p 't = root of t^2 + 1' --eps 1/3 --steps 2"
    outcome = kahanmaps(line)
    assert outcome.status == 0, outcome.err
    assert outcome.out.splitlines()[0].endswith("exact arithmetic, t = root of t^2 + 1")
    assert outcome.out.splitlines()[2] == "0\t1\tt\t1\t2"
    header, *points, end = kahanmaps(f"{line} --format jsonl").records
    assert (header["start"], header["algebraic"]) == (["1", "t", "1", "2"], {"t": "root of t^2 + 1"})
    assert (len(points), end["status"]) == (3, "completed")
    check = kahanmaps(f"check-integrals {system} --start 1,t,1,2 -p 't = root of t^2 + 1' --eps 1/3 --steps 2")
    assert "also: held exactly at 3 points of an orbit, eps = 1/3" in check.out


@pytest.mark.parametrize(("arithmetic", "second"), [("float", "1.4142135623730951"), ("mod:7", "3")])
def test_an_algebraic_start_has_an_image_in_every_arithmetic(kahanmaps, arithmetic, second):
    line = f"orbit \"x' = y^2; y' = x^2\" --start 1,s -p s='sqrt(2)' --eps 1/3 --steps 1 --arithmetic {arithmetic}"
    assert kahanmaps(line).out.splitlines()[2].split("\t")[2] == second


def test_json_has_the_points_of_jsonl(kahanmaps):
    line = "orbit lotka_volterra --start 1,2 --eps 1/10 --steps 3 --integral x*y"
    complete = kahanmaps(f"{line} --json").json
    header, *points, end = kahanmaps(f"{line} --format jsonl").records
    assert complete.pop("command") == "orbit"
    assert complete.pop("points") == [{k: v for k, v in point.items() if k != "record"} for point in points]
    assert {"record": "end", **complete.pop("end")} == end
    assert {"record": "header", **complete} == header
