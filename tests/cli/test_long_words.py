"""Compositions too large to be multiplied out: every command steps them, or says in one line that it needs formulas."""

import json

import pytest

WORDS = {
    "four": '[composition]\nof = [{ system = "henon_heiles", power = 4 }]\n'
    '[density]\nphi = "(1 + eps^2)^2 - 4*eps^4*(q1^2 + q2^2)"\n[integrals]\nI = "q1"',
    "ten letters": 'variables = ["x", "y"]\n[composition]\nof = ['
    + ", ".join(['{ system = "lotka_volterra" }, { system = "weierstrass", inverse = true }'] * 5)
    + ']\n[density]\nphi = "x*y"\n[integrals]\nI = "x"',
}
STARTS = {"four": "1/2,1/3,1/5,1/7", "ten letters": "1/2,1/3"}


@pytest.fixture
def word(tmp_path):
    def written(name):
        path = tmp_path / "word.toml"
        path.write_text(WORDS[name])
        return path

    return written


@pytest.mark.parametrize(
    ("name", "arithmetic"),
    [("four", "exact"), *(("ten letters", kind) for kind in ("exact", "mod:10007", "float", "ball:auto"))],
)
def test_orbits_are_stepped(kahanmaps, word, name, arithmetic):
    line = f"orbit {word(name)} --start {STARTS[name]} --eps 1/10 --steps 1 --arithmetic {arithmetic} --format jsonl -q"
    result = kahanmaps(line)
    records = [json.loads(text) for text in result.out.splitlines()]
    assert (result.status, records[-1]["status"]) == (0, "completed")
    assert len(records[0]["composition"]) == {"four": 4, "ten letters": 10}[name]


LINES = [
    "check-measure",
    "check-integrals",
    "find-density",
    "find-integrals --effort -4",
    "cycles --prime 11 --samples 5 --steps 5",
    "lyapunov --eps 1/50 --steps 20",
    "systems",
]


# Every command goes through four factors, but for degrees, which take their time there.
@pytest.mark.parametrize(("name", "line"), [*(("four", line) for line in LINES), ("ten letters", "degrees --terms 1")])
def test_commands_go_through_the_factors(kahanmaps, word, name, line):
    quiet = "" if line == "systems" else " -q"
    result = kahanmaps(f"{line} {word(name)} --json{quiet}")
    record = json.loads(result.out)
    if line.startswith("check"):
        is_density = name == "four" and "measure" in line
        assert (record["verdict"], result.status) == (("supported", 0) if is_density else ("refuted", 1))
    if line.startswith("find-density") and name == "four":
        assert record["densities"]


@pytest.mark.parametrize("line", ["systems {} --latex", "convert {} --to sympy", "convert {} --to c"])
def test_formulas_are_refused_in_one_line(kahanmaps, word, line):
    result = kahanmaps(line.format(word("ten letters")))
    assert result.status == 2
    (error,) = result.err.strip().splitlines()
    assert "formulas are too large to be multiplied out" in error
