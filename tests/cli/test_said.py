"""What commands say: their exit status, words of it, and that what is to be JSON is.

The table is tests/cli/said.txt: a command, behind a number where it does not end with 0, and behind each ` => ` words
of standard output or standard error, blanks for tabs and line breaks; behind ` => not: ` words that are in neither.
Behind ` <= ` stands what is in the file that the command names, with \\n for a new line. In tests/cli/wrong_use.txt all
end with 2. Exit statuses are listed in docs/cli.md.
"""

import re
from pathlib import Path

import pytest
from cli_helpers import with_its_file
from helpers import table, together

import kahanmaps as km
from kahanmaps.checks.claims import Certainty, Evidence, Finding, Report
from kahanmaps.checks.table import CHECKS
from kahanmaps_cli.screen.render import exit_status

TABLE = table(Path(__file__).with_name("said.txt"))
CASES = [(section, *line.split(" => ")) for section, lines in TABLE.items() for line in lines]


@pytest.mark.parametrize("case", CASES, ids=[command[:90] for _, command, *_ in CASES])
def test_a_command_says_what_it_found(kahanmaps, pair, tmp_path, monkeypatch, request, case):
    section, command, *expected = case
    if section.startswith("plot"):
        request.getfixturevalue("unrendered")
    monkeypatch.chdir(tmp_path)
    status, words = re.fullmatch(r"(?:([0-9]+) )?(.*)", command).groups()
    outcome = kahanmaps(with_its_file(words).replace("{pair}", str(pair)))
    assert outcome.status == int(status or 0), outcome.err
    said = " ".join(f"{outcome.out} {outcome.err}".split())
    missing = [entry for entry in expected if not entry.startswith("not: ") and entry not in said]
    wrongly = [entry for entry in expected if entry.startswith("not: ") and entry.removeprefix("not: ") in said]
    assert (missing, wrongly) == ([], []), said
    assert "Traceback" not in said
    if "jsonl" in words or (" --json" in words and not words.startswith("orbit")):  # whose --json is one object
        assert outcome.records
    assert all(Path(name).exists() for name in re.findall(r" -o (\S+)", words))


COMMANDS = table(Path(__file__).with_name("exit_statuses.txt"))
TOP = "euler_top --start 1,2,3 --eps 1/10"


def report(verdict: Certainty, ended_early: bool = False, control: Certainty = Certainty.REFUTED) -> Report:
    """A report of one claim and one control."""
    findings = [Finding("c", v, Evidence("m", "s"), control=c) for v, c in ((verdict, False), (control, True))]
    return Report("commute", tuple(findings), ended_early=ended_early)


STATUSES = {"proved": 0, "supported": 0, "refuted": 1, "undecided": 3}


@pytest.mark.parametrize(("verdict", "status"), [(Certainty(word), status) for word, status in STATUSES.items()])
def test_every_verdict_has_its_exit_status(verdict, status):
    assert exit_status(report(verdict)) == status


def test_an_undecided_check_gives_3(kahanmaps, monkeypatch):
    context = {"system": "henon_heiles", "eps": "every", "time_step": "every"}
    undecided = Report("poisson", report(Certainty.UNDECIDED).findings, context)
    monkeypatch.setattr("kahanmaps.checks.preserve.check_poisson", lambda *_: undecided)
    assert kahanmaps("check-poisson henon_heiles --json").status == 3


@pytest.mark.parametrize(("command", "status"), [line.split(" => ") for line in COMMANDS["orbits"]])
def test_an_orbit_stopped_early_gives_3_and_a_sentence_on_standard_error(kahanmaps, command, status):
    outcome = kahanmaps(command)
    assert outcome.status == 3
    assert outcome.err.startswith(f"{status}: ")
    assert outcome.out.splitlines()[-1] == f"# {outcome.err.strip()}"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.parametrize("form", ["text", "jsonl", "csv", "npz"])
def test_a_full_disk_is_no_wrong_use_gives_3_and_names_the_file(kahanmaps, form):
    outcome = kahanmaps(f"orbit {TOP} --steps 2 --format {form} -o /dev/full")
    assert (outcome.status, outcome.err) == (3, "Error: No space left on device: /dev/full\n")


WRONG = table(Path(__file__).with_name("wrong_use.txt"))
WRONG["checks are listed"] = [f"check euler_top => Did you mean {' or '.join(CHECKS)}?"]


@pytest.mark.parametrize("lines", WRONG.values(), ids=WRONG.keys())
def test_wrong_use_gives_2_and_says_what_was_found_and_expected(kahanmaps, tmp_path, monkeypatch, lines):
    @together("line", lines)
    def each(line):
        command, *expected = line.split(" => ")
        folder = tmp_path / str(len(list(tmp_path.iterdir())))
        folder.mkdir()
        monkeypatch.chdir(folder)
        outcome = kahanmaps(with_its_file(command))
        assert (outcome.status, outcome.out, len(list(folder.iterdir()))) == (2, "", " <= " in command)
        said = " ".join(outcome.err.split())
        for words in expected:
            assert (words.removeprefix("not: ") in said) is not words.startswith("not: ")
        assert "Traceback" not in outcome.err

    each()


def test_print_shows_what_the_command_prints(kahanmaps):
    assert f"{km.check_integrals('euler_top')}\n" == kahanmaps("check-integrals", "euler_top").out
    assert f"{km.analyze('nahm_tetrahedral')}\n" == kahanmaps("analyze", "nahm_tetrahedral").out


@pytest.mark.parametrize(
    ("result", "words"),
    [
        (lambda: km.degrees("euler_top", max_terms=4), "degrees euler_top --terms 4"),
        (lambda: km.find_symmetry("lorenz"), "find-symmetry lorenz"),
        (lambda: km.find_commuting("paper_m2"), "find-commuting paper_m2"),
        (lambda: km.darboux_polynomials("lotka_volterra", 2), "find-integrals lotka_volterra --darboux 2"),
        (lambda: km.find_poisson("lorenz", 1), "find-poisson lorenz --degree 1"),
        (
            lambda: km.scan("lotka_volterra", ["a"], primes=[5, 7, 11], terms=2),
            "scan lotka_volterra --over a --primes 5,7,11 --terms 2",
        ),
    ],
)
def test_print_shows_what_the_command_prints_below_its_heading(kahanmaps, result, words):
    assert f"{result()}\n" == kahanmaps(words).out.split("\n", 1)[1]


def test_rows_are_tables():
    darboux, run = km.darboux_polynomials("lotka_volterra", 1), km.singularities("weierstrass", "1/3")
    assert darboux.rows()[0] == {"cofactor": "C[x]", "polynomial": "x", "verdict": "proved"}
    assert (run.rows()[0]["polynomial"], run.rows()[0]["confined_at"]) == ("4*x - 3", 4)
    assert km.constant_structures("weierstrass").rows()[0]["function"] == "2*x^3 - y^2/2 - 2*x"
    assert km.heights("weierstrass", "1/10").rows()[0] == {"eps": "1/10", "start": "29/16,19/7", "growth": "quadratic"}
    assert km.cycles("weierstrass", "1/7", 101).rows()[0] == {"length": 3, "count": 1}
    assert km.find_symmetry("lorenz").rows()[1] == {"kind": "symmetry", "action": "(x, y, z) -> (-x, -y, z)"}
    assert km.find_commuting("lorenz").rows() == []
    assert {row["verdict"] for row in km.find_commuting("paper_m2").rows()} == {"proved"}
    first = km.analyze("riccati").rows()[0]
    assert first == {"section": "vector field", "status": "proved", "text": "div f = 2*x + 1"}
