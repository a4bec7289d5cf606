"""What commands print as JSON satisfies their schemas, and does no longer when it is spoilt.

A schema that lets everything pass says nothing, so keys are left out, added and misspelt as well.
"""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from cli_helpers import Outcome
from helpers import table
from schema_helpers import is_wrong, mistakes, schema_of

COMMANDS = table(Path(__file__).with_name("json_commands.txt"))


@pytest.fixture
def lines(once: Callable[[str], Outcome], pair: Path, tmp_path) -> Callable[[str], list[Any]]:
    """The JSON that a command prints, line by line."""

    def run(line) -> list[Any]:
        told = once(line.format(pair=pair, here=tmp_path).replace("(", "'(").replace(")^2", ")^2'"))
        assert told.status in (0, 1, 3), told.err
        return [json.loads(row) for row in told.out.splitlines()]

    return run


@pytest.mark.parametrize(
    "line",
    [*COMMANDS["done at once"], *(pytest.param(line, marks=pytest.mark.slow) for line in COMMANDS["slow"])],
)
def test_what_a_command_prints_satisfies_its_schema(lines, line):
    found = lines(line)
    assert found
    assert [problem for one in found for problem in mistakes(schema_of(line), one)] == []


SPEC = """
limits = { time = "20 s", memory = "2 GB" }
[experiments.commute]
task = "check-commute"
system = "family"
axes = { m = [1, 2] }
[experiments.orbit]
task = "orbit"
system = "weierstrass"
options = { eps = 0.1, steps = 5, start = "0,0", parameters = { g2 = 1 } }
[experiments.broken]
task = "check-measure"
system = "lorenz"
"""


def test_what_batch_commands_print_satisfies_their_schemas(kahanmaps, tmp_path):
    spec, db, other = tmp_path / "spec.toml", tmp_path / "a.db", tmp_path / "b.db"
    spec.write_text(SPEC)
    outputs = {
        "batch-run": [
            kahanmaps("batch run", spec, "--db", db, "--dry-run --json"),
            kahanmaps("batch run", spec, "--db", db, "-e orbit --json -q"),
            kahanmaps("batch run", spec, "--db", other, "-e broken --jsonl -q"),
            kahanmaps("batch run", spec, "--db", db, "--dry-run --json"),
        ],
        "batch-export": [
            kahanmaps("batch export --jsonl --db", db),
            kahanmaps("batch export --jsonl --stable --db", other),
        ],
        "batch-status": [kahanmaps("batch status --json --db", db), kahanmaps("batch status --json --db", other)],
        "batch-summary": [kahanmaps("batch summary --json --by task,eps --db", db)],
        "batch-merge": [kahanmaps("batch merge --json", tmp_path / "all.db", db, other)],
    }
    [key] = {row["key"] for row in outputs["batch-export"][0].records if row.get("experiment") == "orbit"}
    [failed] = {row["key"] for row in outputs["batch-export"][1].records if row.get("experiment") == "broken"}
    outputs["batch-show"] = [kahanmaps(f"batch show {key} --json --db", db)]
    outputs["batch-show"] += [kahanmaps(f"batch show {failed} --json --db", other)]
    for name, told in outputs.items():
        for one in told:
            assert one.records, (name, one.err)
            assert [problem for row in one.records for problem in mistakes(name, row)] == [], name


def test_what_plot_recipe_prints_satisfies_its_schema(kahanmaps, tmp_path):
    pytest.importorskip("matplotlib")
    assert kahanmaps("plot degrees euler_top -o", tmp_path / "picture.svg").status == 0
    assert mistakes("plot-recipe", kahanmaps("plot recipe --json", tmp_path / "picture.svg").json) == []


FREE = ("document", "other_document", "parameters", "reasons", "integrals", "options", "vectors", "counts", "failures")
# Keys that are not always there, and do not come in company.
AT_WILL = {
    "check": {"also", "formula", "source", "m", "factors"},
    "verify": {"also", "formula", "source", "misprint"},
    "orbit": {"integrals"},
    "family-show": {"normal_form"},
}
OF_EVIDENCE = {"method", "summary"}


@pytest.mark.parametrize("line", COMMANDS["spoilt"])
def test_a_key_left_out_added_or_a_misspelt_verdict_is_refused(lines, line):
    name, found = schema_of(line), lines(line)
    for one in found:
        for place in list(_objects(one)):
            here = _at(one, place)
            here["surprise"] = 1
            assert is_wrong(name, one), ("surprise", place)
            del here["surprise"]
            for key in list(here):
                is_detail = {"evidence", "also"} & set(place) and key not in OF_EVIDENCE
                if is_detail or key in AT_WILL.get(name, ()):
                    continue
                value = here.pop(key)
                assert is_wrong(name, one), (key, place)
                if key == "verdict" and isinstance(value, str):
                    here[key] = "proven"
                    assert is_wrong(name, one), (key, place)
                here[key] = value
        assert not is_wrong(name, one)  # mended


def _objects(data: Any, place: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """The places of the objects in data whose keys are fixed; of a list, its first entry."""
    if isinstance(data, dict):
        yield place
        for key, value in data.items():
            if key not in FREE:
                yield from _objects(value, (*place, key))
    elif isinstance(data, list) and data:
        yield from _objects(data[0], (*place, 0))


def _at(data: Any, place: tuple[str | int, ...]) -> Any:
    for key in place:
        data = data[key]
    return data


@pytest.mark.parametrize(
    ("change", "value"),
    [
        ("holds", False),  # of a proved report
        ("eps", "0.1"),
        ("eps", "2/-3"),
        ("time_step", "02"),
        ("convention", "eps is the time step"),
        ("seed", "0"),
        ("seed", -1),
        ("document", {"name": "x"}),
        ("check", "comute"),
        ("claims", []),
        ("other", "another system"),  # which only check-commute has
    ],
)
def test_a_wrong_value_in_a_report_is_refused(lines, change, value):
    [report] = lines("check-measure euler_top --json")
    spoilt = {**report, change: value}
    assert mistakes("check", spoilt)
    assert mistakes("check", report) == []


END = {"record": "end", "status": "periodic", "steps": 9, "message": "the start came back after 3 steps", "period": 3}
POINT = {"record": "point", "step": 1, "x": ["1/2", "-3"], "integrals": {"H": None}}


@pytest.mark.parametrize(
    ("record", "change"),
    [
        (END, {"status": "finished"}),
        (END, {"period": 0}),
        (END, {"record": "ende"}),
        ({key: value for key, value in END.items() if key != "period"}, {}),  # periodic, and no word of the period
        (POINT, {"x": [0.5, -3]}),
        (POINT, {"x": ["1/0", "-3"]}),
        (POINT, {"x": []}),
        (POINT, {"integrals": {"H": 3}}),
        (POINT, {"step": -1}),
    ],
)
def test_a_wrong_line_of_an_orbit_is_refused(record, change):
    assert mistakes("orbit", {**record, **change})
    assert mistakes("orbit", END) == mistakes("orbit", POINT) == []


@pytest.mark.parametrize(
    "change", [{"verdict": word} for word in ("proved", "supported", "undecided")] + [{"witness": None}]
)
def test_a_claim_has_a_witness_exactly_if_it_is_refuted(lines, change):
    [report] = lines("check-commute euler_top lorenz --json")
    assert mistakes("check", report) == []
    report["claims"][0] |= change
    assert mistakes("check", report)
