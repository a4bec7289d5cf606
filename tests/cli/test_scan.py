"""kahanmaps scan: files of members, and what stops it; what it prints is in answers.txt and said.txt."""

import re
import signal
import tomllib

import pytest

from kahanmaps.laboratory.scan.sweep import sweep

QUICK = "lotka_volterra --over a --terms 2 --primes 11,13,17"
PLANE = """--rhs "x' = x*(x+2*y); y' = -y*((g+1)*x+g*y)" --over g --terms 4 --primes 31,37,41"""


def test_the_json_has_what_is_needed_to_run_it_again_and_files_of_an_earlier_scan_are_replaced(kahanmaps, tmp_path):
    for name in ("lotka_volterra-1.toml", "lotka_volterra-2.toml", "lotka_volterra-x.toml"):
        (tmp_path / name).write_text("old")
    result = kahanmaps(f"scan {QUICK} --seed 3 --json --write-to {tmp_path}").json
    assert (result["command"], result["over"], result["seed"], result["eps"]) == ("scan", ["a"], 3, "every")
    assert result["document"]["name"] == "lotka_volterra"
    ((only,),) = [entry["components"] for entry in result["classes"]]
    assert (only["equations"], only["values"], only["growth"]) == (["a + 1"], {"a": "-1"}, "linear")
    assert (only["confirmed"], only["tried"], only["primes"]) == (3, 3, [11, 13, 17])
    assert [entry["measured"] for entry in result["sweeps"]] == [11, 13, 17]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["lotka_volterra-1.toml", "lotka_volterra-x.toml"]
    assert tomllib.loads((tmp_path / "lotka_volterra-1.toml").read_text())["parameters"]["a"] == "-1"


def test_an_inline_system_need_not_declare_what_varies(kahanmaps, tmp_path):
    cases = tmp_path / "cases"
    outcome = kahanmaps(f"scan {PLANE} --write-to {cases}")
    files = sorted(cases.iterdir())
    values = {tomllib.loads(path.read_text())["parameters"]["g"] for path in files}
    assert {"-2", "-1", "0", "1", "2"} <= values
    assert outcome.err == f"{cases}: {len(files)} system files\n"
    assert "verdict" not in outcome.out  # without --analyze
    assert kahanmaps(f"degrees {files[0]} --terms 2").status == 0


def test_a_folder_that_cannot_be_made_is_refused_before_the_scan(kahanmaps, tmp_path, monkeypatch):
    monkeypatch.setattr("kahanmaps.laboratory.scan.scan.scan", lambda *_, **__: pytest.fail("it was scanned"))
    (tmp_path / "file").write_text("")
    outcome = kahanmaps(f"scan {QUICK} --write-to {tmp_path}/file/cases")
    assert (outcome.status, outcome.out) == (2, "")
    assert "file/cases" in outcome.err
    assert kahanmaps(f"scan {QUICK} --terms 99 --write-to {tmp_path}/a/b").status == 2
    assert not (tmp_path / "a").exists()


def test_ctrl_c_ends_it_with_what_was_seen(kahanmaps, monkeypatch):
    def interrupted(map_, count, prime, *args, **options):
        if prime == 17:
            signal.raise_signal(signal.SIGINT)
        return sweep(map_, count, prime, *args, **options)

    monkeypatch.setattr("kahanmaps.laboratory.scan.scan.sweep", interrupted)
    outcome = kahanmaps(f"scan {QUICK}")
    assert outcome.status == 130
    assert outcome.out.splitlines()[1:3] == ["special\t2, 3\t1 members modulo 11", "special\t2, 3\t1 members modulo 13"]
    assert re.match("not done\tmembers modulo 17", outcome.out.splitlines()[-1])
    assert outcome.err.startswith("stopped early: interrupted; not done: members modulo 17")


def test_ctrl_c_before_anything_is_found_ends_the_process_at_once(kahanmaps, monkeypatch):
    """As a compiler loses what is raised within its callbacks, nothing is raised."""
    ends = []

    def interrupted(*_):
        signal.raise_signal(signal.SIGINT)
        raise AssertionError("the process went on")

    def ended(status):
        ends.append(status)
        raise SystemExit(status)

    monkeypatch.setattr("kahanmaps.laboratory.scan.scan._choose_terms", interrupted)
    monkeypatch.setattr("os._exit", ended)
    assert kahanmaps("scan zhukovski_volterra_2 --over a1").out == ""
    assert ends == [130]
