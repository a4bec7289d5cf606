"""Maps that are not Kahan's on the command line: what takes them, and what says that it does not."""

import json
import re
from pathlib import Path

import pytest
from helpers import THOROUGH

from kahanmaps.documents.files import read_system
from kahanmaps.maps.convention import NO_EPS

EXAMPLES = sorted((Path(__file__).parents[2] / "examples" / "maps").glob("*.toml"))
NAMES = [path.stem for path in EXAMPLES]


@pytest.mark.parametrize(
    ("name", "arithmetic"),
    [*((name, "exact") for name in NAMES), *(("mcmillan", kind) for kind in ("mod:10007", "float", "ball:auto"))],
)
def test_the_orbit_command_takes_every_map_and_every_arithmetic(kahanmaps, name, arithmetic):
    file = read_system(path := EXAMPLES[NAMES.index(name)])
    start = ",".join(["1/2", "1/3", "2/5", "1/7"][: file.dim])
    eps = " --eps 1/10" if file.map.has_eps else ""
    out = kahanmaps(f"orbit {path} --start {start}{eps} --steps 3 --arithmetic {arithmetic} --format jsonl -q").out
    header, *_, end = map(json.loads, out.splitlines())
    assert (header["time_step"] is None) == (not file.map.time_steps)
    assert ("equations" in header) == (file.kind != "system" or file.name == "duffing")
    assert end["status"] == "completed"


def test_a_map_with_eps_needs_it_and_one_without_does_not(kahanmaps):
    def status(name, eps=""):
        return kahanmaps(f"orbit {EXAMPLES[NAMES.index(name)]} --start 1/2,1/3 --steps 1 {eps} -q").status

    assert [status("mcmillan"), status("symplectic-euler"), status("symplectic-euler", "--eps 1/9")] == [0, 2, 0]


# Of maps without eps and with it; what takes long, of the first.
@pytest.mark.parametrize("name", ["mcmillan", pytest.param("duffing", marks=THOROUGH)])
@pytest.mark.parametrize(
    "command",
    [
        "analyze --effort -3",
        "degrees --terms 3",
        "singularities --eps 1/3",
        "find-integrals --max-degree 4",
        "find-integrals --darboux 2",
        "find-integrals --monomials 'q,p,1'",
        "find-density --max-degree 4",
        "heights --eps 1/10 --steps 8 --random 1",
        "ensemble --eps 1/10 --random 3 --box 1/4 --steps 5",
        "lyapunov --eps 1/10 --random 2 --box 1/8 --steps 20",
        "cycles --prime 7 --eps 1/3",
        "check-integrals --integral 'J=1' -v",
        "check-measure -v",
    ],
)
def test_what_is_found_out_about_any_map(kahanmaps, name, command):
    file = read_system(path := EXAMPLES[NAMES.index(name)])
    command = command.replace("q,p", ",".join(file.variables))
    result = kahanmaps(f"{command} {path} --json -q")
    assert result.status in (0, 3)
    record = json.loads(result.out)
    if not file.map.has_eps:
        assert record["convention"] == NO_EPS
    assert bool(re.search(r"\beps\b", kahanmaps(f"{command} {path} -q").out)) == file.map.has_eps


@pytest.mark.parametrize(
    "command", ["check-integrals --vars x,y --image 'y;(3+y)/x' --integral x", "check-commute lyness fibonacci"]
)
def test_a_witness_of_a_map_without_eps_has_none(kahanmaps, command):
    result = kahanmaps(f"{command} --json -q")
    assert result.status == 1
    assert json.loads(result.out)["claims"][0]["witness"]["eps"] is None
    assert not re.search(r"\beps\b", kahanmaps(f"{command} -q").out)


def test_a_page_about_a_map_without_eps_does_not_speak_of_it(kahanmaps, tmp_path):
    kahanmaps(f"report lyness --effort -2 --no-pictures -o {tmp_path}/page.html -q")
    text = re.sub(
        r"<style.*?</style>|<svg.*?</svg>|<script.*?</script>", "", (tmp_path / "page.html").read_text(), flags=re.S
    )
    assert not re.search(r"\beps\b|ε|time step", text)


WORDS = {
    "four": '[composition]\nof = [{ system = "henon_heiles", power = 4 }]\n'
    '[density]\nphi = "(1 + eps^2)^2 - 4*eps^4*(q1^2 + q2^2)"\n[integrals]\nI = "q1"',
    "ten letters": 'variables = ["x", "y"]\n[composition]\nof = ['
    + ", ".join(['{ system = "lotka_volterra" }, { system = "weierstrass", inverse = true }'] * 5)
    + ']\n[density]\nphi = "x*y"\n[integrals]\nI = "x"',
}


@pytest.fixture
def word(tmp_path):
    def written(name):
        path = tmp_path / "word.toml"
        path.write_text(WORDS[name])
        return path

    return written


# Every command goes through four factors, but for degrees, which take their time there.
@pytest.mark.parametrize(
    ("name", "line", "expected"),
    [
        ("four", "check-measure", (0, '"verdict": "supported"')),
        ("four", "check-integrals", (1, '"verdict": "refuted"')),
        ("four", "find-density", (0, '"verdict": "supported"')),
        ("four", "find-integrals --effort -4", (0, '"found": 1')),
        ("four", "cycles --prime 11 --samples 5 --steps 5", (0, '"runs"')),
        ("four", "lyapunov --eps 1/50 --steps 20", (0, '"per_time"')),
        ("four", "systems", (0, '"composition"')),
        ("ten letters", "degrees --terms 1", (0, '"degrees"')),
    ],
)
def test_commands_go_through_the_factors(kahanmaps, word, name, line, expected):
    result = kahanmaps(f"{line} {word(name)} --json")
    status, words = expected
    assert (result.status, words in result.out) == (status, True)


@pytest.mark.parametrize("line", ["systems {} --latex", "convert {} --to sympy", "convert {} --to c"])
def test_formulas_are_refused_in_one_line(kahanmaps, word, line):
    result = kahanmaps(line.format(word("ten letters")))
    assert result.status == 2
    (error,) = result.err.strip().splitlines()
    assert "formulas are too large to be multiplied out" in error
