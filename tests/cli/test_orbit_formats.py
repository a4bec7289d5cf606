"""kahanmaps orbit: one JSON object, the endings of files, options that are given twice."""

import json

import pytest

LV = "orbit lotka_volterra --start 1,2 --eps 1/10 --steps 3"


def test_json_has_the_points_of_jsonl(kahanmaps):
    whole = kahanmaps(f"{LV} --json --integral x*y").json
    header, *points, end = map(json.loads, kahanmaps(f"{LV} --format jsonl --integral x*y").out.splitlines())
    assert whole.pop("command") == "orbit"
    assert whole.pop("points") == [{k: v for k, v in one.items() if k != "record"} for one in points]
    assert {"record": "end", **whole.pop("end")} == end
    assert {"record": "header", **whole} == header


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--json --format csv", "give --json or --format csv, not both"),
        ("-o a.xlsx", "found the ending .xlsx of a.xlsx, expected .txt, .json, .jsonl, .csv, .npz, .npy, or --format"),
        ("--eps 1/5", "--eps is given 2 times, expected once"),
        ("--steps 1e-1", "found '1e-1', expected an integer"),
    ],
)
def test_what_contradicts_itself_is_refused(kahanmaps, tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    line = LV.removesuffix(" --steps 3") if "--steps" in words else LV
    outcome = kahanmaps(f"{line} {words}")
    assert (outcome.status, outcome.out, list(tmp_path.iterdir())) == (2, "", [])
    assert message in outcome.err


def test_integers_may_have_an_exponent(kahanmaps):
    assert kahanmaps(f"{LV[:-1]}3e0 -q").out == kahanmaps(f"{LV} -q").out
    assert kahanmaps(f"{LV[:-1]}1.2e1 -q").out.splitlines()[-1] == "# completed: 12 steps"
