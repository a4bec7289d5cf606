"""What commands print as JSON satisfies their schemas, and does no longer when it is spoilt.

A schema that lets everything pass says nothing, so keys are left out, added and misspelt as well.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from cli_helpers import Outcome
from schema_helpers import mistakes, schema_of

Run = Callable[..., Outcome]

INLINE = "--vars x --rhs x^2"
ORBIT = "--eps 1/10 --steps 3 --format jsonl"

# Command lines that are done at once; {pair} is a member with m = 2, {here} an empty folder.
CASES = [
    "check-commute {pair} --json",
    "check-commute euler_top lorenz --json",  # refuted
    "check-commute lotka_volterra weierstrass --eps 1/10 --eps2 1/7 --json",
    "check-integrals {pair} --json",
    "check-integrals euler_top --json",
    "check-integrals euler_top --integral x1 --json",  # one of three refuted
    "check-integrals henon_heiles --start 1,2,3,4 --steps 9 --max-digits 20 --json -q",  # ended early
    "check-measure euler_top --json",
    "check-poisson {pair} --json",
    "check-poisson henon_heiles --eps 1/10 --json",
    "verify --m 2 --section 2 --json -q",
    "verify --m 2 --section 9 --json -q",  # misprints
    "verify --universal --m 1 --section 6 --json -q",
    "verify --m 2 --section 6 --controls --json -q",
    "verify {pair} --section 6 --balls 64 --json -q",
    "verify --chi (t-1)^2 --section 5 --json -q",  # undecided: outside the hypotheses
    f"orbit {{pair}} --start 1,2,3,4 --integral known {ORBIT}",
    f"orbit {INLINE} --start 5 {ORBIT} -q",  # singular
    f"orbit {INLINE} --start 1 --arithmetic ball:64 {ORBIT}",
    f"orbit lorenz --start 1,2,3 --max-digits 5 {ORBIT} -q",  # budget
    f"orbit euler_top --start 1,2,3 --arithmetic float --integral x1^2 {ORBIT}",
    f"orbit {INLINE} --eps 1e300 --steps 3 --arithmetic float --start 1e300 --format jsonl -q",  # overflow
    "orbit {pair} --start 1,2,3,4 --eps 1/10 --steps 40 --every 20 --arithmetic float --format jsonl",
    "orbit euler_top --start 1,2,3 --eps 1/10 --steps 30 --arithmetic mod:7 --format jsonl",  # periodic
    "orbit lorenz --start 1000,2,3 --eps 1/10 --steps 9 --arithmetic ball:32 --format jsonl -q",  # precision
    "orbit {pair} --start 1,2,3,4 --eps 1/10 --at 10,1000000000000000000000 --arithmetic mod:10007 --format jsonl",
    "period {pair} --start 1/2,-1/3,0,1 --eps 1/10 --json",
    "period {pair} --start 1/2,-1/3,0,1 --eps 1/10 --arithmetic mod:10007 --json",
    "period {pair} --start 0,0,0,0 --eps 1/10 --json",
    "period --levels 7 --json",
    "period {pair} --eps 1/10 --levels 6 --json",
    "ensemble euler_top --random 5 --eps 1/10 --steps 10 --integral x1 --backward --json",
    "ensemble {pair} --random 5 --eps 1/10 --steps 10 --json -q -o {here}/e.npy",
    "ensemble euler_top --random 5 --eps 1/10 --steps 10 --arithmetic mod:101 --integral x1 --json",
    "ensemble lorenz --random 3 --box 1e200 --eps 1/10 --steps 10 --json",  # all overflow
    "degrees euler_top --json -q",
    "degrees henon_heiles --max-degree 50 --json -q",  # ended early
    "degrees weierstrass --eps 1/10 --terms 3 --json -q",
    "degrees weierstrass --terms 0 --json -q",
    "scan henon_heiles --over c --primes 11,13,17 --terms 3 --json -q",
    "scan henon_heiles --over c --eps 1/10 --seconds 0.001 --json -q",  # nothing tried
    "heights weierstrass --steps 20 --starts 1 --json -q",
    "heights henon_heiles --starts 1 --max-digits 200 --json -q",
    "find-integrals weierstrass --json -q",
    "find-integrals weierstrass --eps 1/10 --json -q",
    "find-integrals lorenz --max-degree 2 --json -q",  # none
    "find-integrals euler_top --monomials x1^2,x2^2,1 --json -q",
    "find-integrals lotka_volterra --darboux 1 --json -q",
    "find-density weierstrass --json -q",
    "find-density lorenz --max-degree 1 --json -q",  # none
    "find-poisson weierstrass --json -q",
    "find-poisson euler_top --degree 3 --json -q",  # several, and Casimirs
    "find-poisson lorenz --degree 1 --json -q",  # none
    "find-poisson lotka_volterra --degree 3 --denominator x --json -q",
    "find-symmetry weierstrass --json -q",
    "find-symmetry harmonic --json -q",  # one-parameter groups
    "find-commuting {pair} --json -q",
    "find-commuting --vars x,y --rhs x^2 --rhs y^2 --shape quadratic --json -q",
    "find-commuting --vars x,y --rhs 0 --rhs 0 --json -q",
    "singularities weierstrass --json -q",
    "singularities lotka_volterra --seconds 0.001 --json -q",  # stopped by the clock
    f"singularities {INLINE} --eps 1/10 --json -q",
    "cycles weierstrass -p 31 --eps 1/10 --json -q",
    "cycles euler_top -p 101 --samples 5 --steps 20 --json -q",
    "lyapunov lorenz --eps 1/400 --random 3 --box 5 --steps 50 --json -q",
    "lyapunov lorenz --eps 1/10 --random 3 --box 1e200 --steps 50 --json -q",  # all ended
    "analyze --vars x --rhs 1 --json -q",
    "analyze weierstrass --json -q",
    "systems --json",
    "systems euler_top --json",
    "systems paper_m2 --json",
    "version --json",
    "schema --json",
    "family show {pair} --normal-form --json",
    "family space {pair} --json",
    "family space --matrix 1,0;0,1 --json",
    "family associated {pair} --json",
    "family associated {pair} --write-to {here} --json",
    "batch tasks --json",
    "batch tasks verify-universal --json",
]
SLOW = [
    "verify --m 2 --json -q",
    "verify --m 3 --universal --json -q",
    "verify --chi (t-1)^2 --json -q",
    "verify --eigenvalues 1,-1 --controls --json -q",
    "verify --beyond --m 2 --json -q",
    "analyze euler_top --symbolic a1 --json -q",
    "analyze lorenz --eps 1/10 --seconds 4 --json -q",
    "analyze {pair} --seconds 20 --json -q",
    "analyze zander_111 --seconds 4 --json -q",
]


@pytest.fixture
def lines(kahanmaps: Run, pair: Path, tmp_path: Path) -> Callable[[str], list[Any]]:
    """The JSON that a command prints, line by line."""

    def run(line: str) -> list[Any]:
        told = kahanmaps(line.format(pair=pair, here=tmp_path).replace("(", "'(").replace(")^2", ")^2'"))
        assert told.status in (0, 1, 3), told.err
        return [json.loads(row) for row in told.out.splitlines()]

    return run


@pytest.mark.parametrize("line", [*CASES, *(pytest.param(line, marks=pytest.mark.slow) for line in SLOW)])
def test_what_a_command_prints_satisfies_its_schema(lines: Callable[[str], list[Any]], line: str) -> None:
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


def test_what_batch_commands_print_satisfies_their_schemas(kahanmaps: Run, tmp_path: Path) -> None:
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


def test_what_plot_recipe_prints_satisfies_its_schema(kahanmaps: Run, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    assert kahanmaps("plot degrees euler_top -o", tmp_path / "picture.svg").status == 0
    assert mistakes("plot-recipe", kahanmaps("plot recipe --json", tmp_path / "picture.svg").json) == []


# One output of each kind that is then spoilt.
SPOILT = [
    "check-commute {pair} --json",
    "check-integrals euler_top --integral x1 --json",
    "verify --m 2 --section 6 --controls --json -q",
    f"orbit {{pair}} --start 1,2,3,4 --integral known {ORBIT}",
    "period {pair} --start 1/2,-1/3,0,1 --eps 1/10 --json",
    "ensemble lorenz --random 3 --box 1e200 --eps 1/10 --steps 10 --json",
    "degrees euler_top --json -q",
    "heights weierstrass --steps 20 --starts 1 --json -q",
    "find-integrals weierstrass --json -q",
    "find-integrals euler_top --monomials x1^2,x2^2,1 --json -q",
    "find-density weierstrass --json -q",
    "find-poisson weierstrass --json -q",
    "find-symmetry weierstrass --json -q",
    "find-commuting {pair} --json -q",
    "singularities weierstrass --json -q",
    "cycles weierstrass -p 31 --eps 1/10 --json -q",
    "lyapunov lorenz --eps 1/400 --random 3 --box 5 --steps 50 --json -q",
    pytest.param("analyze --vars x --rhs 1 --json -q", marks=pytest.mark.slow),
    "systems euler_top --json",
    "version --json",
    "family show {pair} --normal-form --json",
    "family associated {pair} --json",
    "batch tasks orbit --json",
]
FREE = ("document", "other_document", "parameters", "reasons", "integrals", "options", "vectors", "counts", "failures")
# Keys that are not always there, and do not come in company.
AT_WILL = {
    "check": {"also", "formula", "source", "m", "factors"},
    "verify": {"also", "formula", "source", "misprint"},
    "orbit": {"integrals"},
    "family-show": {"normal_form"},
}
OF_EVIDENCE = {"method", "summary"}


@pytest.mark.parametrize("line", SPOILT)
def test_a_key_left_out_added_or_a_misspelt_verdict_is_refused(lines: Callable[[str], list[Any]], line: str) -> None:
    name, found = schema_of(line), lines(line)
    for one in found:
        for place in list(_objects(one)):
            spoilt = copy.deepcopy(one)
            _at(spoilt, place)["surprise"] = 1
            assert mistakes(name, spoilt), ("surprise", place)
            for key in _at(one, place):
                is_detail = {"evidence", "also"} & set(place) and key not in OF_EVIDENCE
                if is_detail or key in AT_WILL.get(name, ()):
                    continue
                spoilt = copy.deepcopy(one)
                del _at(spoilt, place)[key]
                assert mistakes(name, spoilt), (key, place)
                if key == "verdict" and isinstance(_at(one, place)[key], str):
                    _at(spoilt, place)[key] = "proven"
                    assert mistakes(name, spoilt), (key, place)


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
        ("eps", 0.1),
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
def test_a_wrong_value_in_a_report_is_refused(lines: Callable[[str], list[Any]], change: str, value: Any) -> None:
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
        (END, {"steps": "9"}),
        (END, {"record": "ende"}),
        ({key: value for key, value in END.items() if key != "period"}, {}),  # periodic, and no word of the period
        (POINT, {"x": [0.5, -3]}),
        (POINT, {"x": ["1/2", "x"]}),
        (POINT, {"x": ["1/0", "-3"]}),
        (POINT, {"x": []}),
        (POINT, {"integrals": {"H": 3}}),
        (POINT, {"step": -1}),
    ],
)
def test_a_wrong_line_of_an_orbit_is_refused(record: dict[str, Any], change: dict[str, Any]) -> None:
    assert mistakes("orbit", {**record, **change})
    assert mistakes("orbit", END) == mistakes("orbit", POINT) == []


@pytest.mark.parametrize(
    "change", [{"verdict": word} for word in ("proved", "supported", "undecided")] + [{"witness": None}]
)
def test_a_claim_has_a_witness_exactly_if_it_is_refuted(
    lines: Callable[[str], list[Any]], change: dict[str, Any]
) -> None:
    [report] = lines("check-commute euler_top lorenz --json")
    assert mistakes("check", report) == []
    report["claims"][0] |= change
    assert mistakes("check", report)


def test_a_report_of_a_proof_with_a_claim_that_is_not_proved_is_refused(lines: Callable[[str], list[Any]]) -> None:
    [report] = lines("check-measure euler_top --json")
    report["claims"][0]["verdict"] = "undecided"
    assert mistakes("check", report)
    assert mistakes("check", {**report, "verdict": "undecided", "holds": None}) == []
