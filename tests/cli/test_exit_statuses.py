"""Exit statuses: what scripts branch on.

0 the claim holds (proved or supported) or the work is done; 1 refuted, and nothing else; 2 wrong use or bad input,
with a message that says what was found and what is expected; 3 undecided or stopped early; 70 an internal error;
130 interrupted. (70 and 130 are in test_main.py and test_orbit.py.) Wrong use prints nothing on standard output.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from kahanmaps.checks.claims import Evidence, Finding, Report, Verdict
from kahanmaps_cli.render import exit_status

TOP = "euler_top --start 1,2,3 --eps 1/10"
ROTATION = "--vars x,y --rhs y --rhs=-x"
SQUARE = "--vars x --rhs x^2"  # the Kahan map x/(1 - 2 eps x) ...
AT_ITS_POLE = f"{SQUARE} --start 1 --eps 1/2"  # ... where it has no value


def report(verdict: Verdict, ended_early: bool = False, control: Verdict = Verdict.REFUTED) -> Report:
    """A report of one claim and one control."""
    findings = [Finding("c", v, Evidence("m", "s"), control=c) for v, c in ((verdict, False), (control, True))]
    return Report("commute", tuple(findings), ended_early=ended_early)


@pytest.mark.parametrize(
    ("verdict", "status"),
    [(Verdict.PROVED, 0), (Verdict.SUPPORTED, 0), (Verdict.REFUTED, 1), (Verdict.UNDECIDED, 3)],
)
def test_every_verdict_has_its_exit_status(verdict, status):
    assert exit_status(report(verdict)) == status


@pytest.mark.parametrize("control", list(Verdict))
def test_a_control_does_not_change_the_exit_status(control):
    assert exit_status(report(Verdict.PROVED, control=control)) == 0


@pytest.mark.parametrize(("verdict", "status"), [(Verdict.PROVED, 3), (Verdict.SUPPORTED, 3), (Verdict.REFUTED, 1)])
def test_an_orbit_asked_for_and_cut_short_gives_3_unless_the_claim_is_refuted(verdict, status):
    assert exit_status(report(verdict, ended_early=True)) == status


def test_an_undecided_check_gives_3(kahanmaps, monkeypatch):
    context = {"system": "henon_heiles", "eps": "every", "time_step": "every"}
    undecided = Report("poisson", report(Verdict.UNDECIDED).findings, context)
    monkeypatch.setattr("kahanmaps.checks.preserve.check_poisson", lambda *_: undecided)
    assert kahanmaps("check-poisson henon_heiles --json").status == 3


# 0


@pytest.mark.parametrize(
    "command",
    [
        f"orbit {TOP} --steps 2",
        f"orbit {TOP} --steps 0",
        "orbit harmonic --start 1,0 --eps 1 --steps 8",  # the start comes back after four steps
        "check-integrals euler_top",
        "check-integrals euler_top --eps 1/10",
        f"check-integrals {ROTATION} --integral x^2+y^2",
        "check-measure euler_top",
        f"check-commute {ROTATION} harmonic",
        "family new --m 1",
        "family show paper_m2",
        "family space paper_m2",
        "family associated paper_m2",
        "systems",
        "systems euler_top",
        "version",
    ],
)
def test_work_that_is_done_and_claims_that_hold_give_0(kahanmaps, command):
    assert kahanmaps(command).status == 0


# 1


@pytest.mark.parametrize(
    "command",
    [
        "check-integrals euler_top --integral x1",
        "check-integrals euler_top --eps 1/10 --integral x1",
        f"check-integrals {SQUARE} --integral x --start 1 --eps 1/2",  # refuted, although the orbit cannot start
        "check-measure lorenz --density 1",
        "check-poisson henon_heiles",
        "check-commute euler_top lorenz",
        "check-commute harmonic harmonic --eps 1/10 --eps2 1/7 -p w=2",
    ],
)
def test_a_refuted_claim_gives_1(kahanmaps, command):
    outcome = kahanmaps(command)
    assert (outcome.status, outcome.err) == (1, "")
    assert "refuted" in outcome.out


# 3


@pytest.mark.parametrize(
    ("command", "status"),
    [
        (f"orbit {AT_ITS_POLE} --steps 2", "singular"),
        (f"orbit {AT_ITS_POLE} --steps 2 --arithmetic float", "singular"),
        (f"orbit {AT_ITS_POLE} --steps 2 --arithmetic ball:64", "singular"),
        (f"orbit {AT_ITS_POLE} --steps 2 --arithmetic mod:7", "singular"),
        (f"orbit {TOP} --steps 20 --max-digits 20", "budget"),
        (f"orbit {TOP} --steps 20 --arithmetic ball:2", "precision"),
        ("orbit lorenz --start 1,2,3 --eps 1/10 --steps 10000 --every 5000 --arithmetic float", "overflow"),
    ],
)
def test_an_orbit_stopped_early_gives_3_and_a_sentence_on_standard_error(kahanmaps, command, status):
    outcome = kahanmaps(command)
    assert outcome.status == 3
    assert outcome.err.startswith(f"{status}: ")
    assert outcome.out.splitlines()[-1] == f"# {outcome.err.strip()}"


@pytest.mark.parametrize(
    "command",
    [
        f"check-integrals {AT_ITS_POLE} --integral 7",
        f"check-integrals {SQUARE} --eps 1/2 --integral 7 --start 1/3 --steps 9",  # 1/3, 1/2, 1, pole
        "check-integrals euler_top --steps 30 --max-digits 20",
    ],
)
def test_a_check_whose_orbit_was_asked_for_and_cut_short_gives_3(kahanmaps, command):
    assert kahanmaps(command).status == 3


def test_a_check_whose_orbit_nobody_asked_for_may_cut_it_short(kahanmaps):
    assert kahanmaps("check-integrals euler_top --max-digits 20").status == 0


# 2


@pytest.mark.parametrize(
    ("command", "words"),
    [
        # the system
        ("orbit --start 1 --eps 1 --steps 1", "missing SYSTEM"),
        ("orbit nonsense --start 1 --eps 1 --steps 1", "found the unknown system 'nonsense'"),
        ("orbit nothing.toml --start 1 --eps 1 --steps 1", "nothing.toml: No such file"),
        ("orbit ./ --start 1 --eps 1 --steps 1", "./: Is a directory"),
        ("orbit /dev/zero --start 1 --eps 1 --steps 1", "larger than"),
        ("orbit euler_top -p q=1 --start 1,2,3 --eps 1 --steps 1", "unknown parameter 'q', this system has: a1, a2"),
        ("orbit euler_top -p a1 --start 1,2,3 --eps 1 --steps 1", "found 'a1', expected NAME=VALUE"),
        ("orbit euler_top -p a1=one --start 1,2,3 --eps 1 --steps 1", "parameters.a1: found 'one', expected an int"),
        ("orbit euler_top -p a1=1 -p a1=2 --start 1,2,3 --eps 1 --steps 1", "found -p a1=... twice"),
        # inline systems
        (f"orbit euler_top {SQUARE} --start 1 --eps 1 --steps 1", "not both"),
        ("orbit --vars x --start 1 --eps 1 --steps 1", "needs both --vars"),
        ("orbit --rhs x --start 1 --eps 1 --steps 1", "needs both --vars"),
        ("orbit --vars '' --rhs x --start 1 --eps 1 --steps 1", "variables: found '', expected a name"),
        ("orbit --vars x,y --rhs x --start 1,2 --eps 1 --steps 1", "found 1 right-hand side, expected 2"),
        ("orbit --vars x --rhs x^3 --start 1 --eps 1 --steps 1", "of degree 3, expected at most 2"),
        ("orbit --vars x --rhs 2x --start 1 --eps 1 --steps 1", "write 2*x"),
        # the start
        ("orbit euler_top --eps 1 --steps 1", "Missing option '--start'"),
        ("orbit euler_top --start 1,2 --eps 1 --steps 1", "found a point with 2 coordinates, expected 3: x1, x2, x3"),
        ("orbit euler_top --start 1,2 --eps 1 --steps 1 --arithmetic float", "with 2 coordinates, expected 3"),
        ("orbit euler_top --start nan,2,3 --eps 1 --steps 1", "entry 1: found 'nan'"),
        # eps
        ("orbit euler_top --start 1,2,3 --steps 1", "missing --eps E, or --time-step H"),
        ("orbit euler_top --start 1,2,3 --eps 1 --time-step 2 --steps 1", "not both"),
        ("orbit euler_top --start 1,2,3 --eps nan --steps 1", "Invalid value for '--eps': found 'nan'"),
        ("orbit euler_top --start 1,2,3 --eps 0 --steps 1", "found eps = 0"),
        ("check-integrals euler_top --eps 0", "found eps = 0"),
        # steps
        (f"orbit {TOP}", "give --steps N or --at N1,N2,..., one of the two"),
        (f"orbit {TOP} --steps 1 --at 1", "give --steps N or --at N1,N2,..., one of the two"),
        (f"orbit {TOP} --steps -1", "found --steps -1, expected 0 or more"),
        (f"orbit {TOP} --at 4 --every 2", "not both"),
        (f"orbit {TOP} --steps 1 --max-digits 0", "found --max-digits 0, expected at least 1"),
        # numbers to compute with
        (f"orbit {TOP} --steps 1 --arithmetic mod:91", "91 is composite"),
        (f"orbit {TOP} --steps 1 --arithmetic mod:2", "the prime 2 divides the denominator of 1/10"),
        ("orbit euler_top --start 1,2,3 --eps 7 --steps 1 --arithmetic mod:7", "divides the numerator of eps"),
        (f"orbit {TOP} --steps 1 --arithmetic ball:1", "found the precision 1, expected"),
        (
            "orbit euler_top --start 1,2,1e400 --eps 1 --steps 1 --arithmetic float",
            "beyond the range of machine floats",
        ),
        (
            "orbit euler_top --start 1,2,3 --eps 1e400 --steps 1 --arithmetic float",
            "beyond the range of machine floats",
        ),
        ("orbit euler_top --start 1,2,3 --eps 1e-400 --steps 1 --arithmetic float", "take a larger eps"),
        # columns
        (f"orbit {TOP} --steps 1 --integral nonsense", "found the unknown name 'nonsense'"),
        (f"orbit {TOP} --steps 1 --integral ''", "expected NAME=VALUE"),
        (f"orbit {TOP} --steps 1 --integral F1 --integral F1", "found two columns of the name F1"),
        (f"orbit {TOP} --steps 1 --integral x1=x2", "found two columns of the name x1"),
        ("orbit lorenz --start 1,2,3 --eps 1 --steps 1 --integral known", "no integral of lorenz is known or claimed"),
        # output
        (f"orbit {TOP} --steps 1 --format xml", "'xml' is not one of"),
        (f"orbit {TOP} --steps 1 -o .", "is a directory"),
        (f"orbit {TOP} --steps 1 -o no/such/folder/x.csv", "No such file or directory: no/such/folder/x.csv"),
        # checks
        ("check-commute", "missing SYSTEM"),
        ("check-commute euler_top", "one system commutes with itself: give a second system"),
        ("check-commute euler_top harmonic", "euler_top has dimension 3 and harmonic 2"),
        ("check-commute euler_top lorenz --eps2 1/3", "give both --eps and --eps2"),
        ("check-commute paper_m2 --eps 1 --eps2 2", "a second step needs a second system"),
        ("check-commute - -", "found - twice"),
        ("check-integrals lorenz", "no integral of lorenz is known or claimed"),
        ("check-integrals euler_top --integral I=x1 --integral I=x2", "found two integrals of the name I"),
        ("check-integrals euler_top --integral F1=x1", "found two integrals of the name F1"),
        ("check-integrals euler_top --start 1,2", "with 2 coordinates, expected 3"),
        ("check-integrals euler_top --steps -1", "found -1 steps, expected 0 to 10000"),
        ("check-integrals euler_top --max-digits 0", "found --max-digits 0"),
        ("check-measure lorenz", "no density of lorenz is known or claimed"),
        ("check-measure lorenz --density x-x", "found the density 0"),
        ("check-poisson euler_top", "needs a Hamiltonian system"),
        ("check-poisson euler_top --tensor nowhere.toml", "cannot read the tensor in nowhere.toml"),
        # the family
        ("family new", "missing --m M"),
        ("family new --m 0", "found m = 0, expected 1 <= m <= 16"),
        ("family new --eigenvalues 1,2 --m 3", "found 2 eigenvalues, expected m = 3"),
        ("family new --eigenvalues 1,2 --generic", "give one of"),
        ("family new --chi 5", "expected a polynomial in t of degree m >= 1"),
        ("family new --chi x^2", "found the unknown name 'x'"),
        ("family new --chi t^2-2 --m 3", "chi has degree 2, expected m = 3"),
        ("family new --m 2 --size 0", "found --size 0, expected 1 to 1000000"),
        ("family new --m 2 --signs 1,1,1", "expected 2 numbers 1 or -1"),
        ("family show", "missing SYSTEM: a file, a catalogue name"),
        ("family show euler_top", "expected one of kind [family]"),
        ("family space", "one of the two"),
        ("family space --matrix '1,0;0'", "expected a square matrix"),
        ("family space --matrix '1,0;0,2'", "A is not skew-Hamiltonian"),
        ("family nonsense", "There is no command 'nonsense'"),
        # the catalogue
        ("systems nonsense", "found the unknown system"),
        ("systems --toml", "need the NAME of a system"),
        ("systems -p a=1", "need the NAME of a system"),
        ("systems euler_top --toml --json", "one of the three"),
        # everything else
        ("nonsense", "There is no command 'nonsense'"),
        ("orbit --nonsense", "--nonsense"),
    ],
    ids=lambda text: text[:70],
)
def test_wrong_use_gives_2_and_says_what_was_found_and_expected(kahanmaps, command, words):
    outcome = kahanmaps(command)
    assert (outcome.status, outcome.out) == (2, "")
    assert words in outcome.err
    assert "Traceback" not in outcome.err


@pytest.mark.parametrize("word", ["x" * 100_000, "mod:" + "1" * 100_000, "(" * 100_000], ids=lambda word: word[:5])
@pytest.mark.parametrize("option", ["--arithmetic", "--at", "--start", "--eps", "--integral", "--steps"])
def test_messages_stay_short_whatever_was_written(kahanmaps, option, word):
    outcome = kahanmaps("orbit euler_top --start 1,2,3 --eps 1 --steps 1", option, Path(word))
    assert outcome.status == 2
    assert len(outcome.err) < 1000


# Wrong files

FAMILY = 'A = [["1", "0", "0", "0"], ["0", "2", "0", "0"], ["0", "0", "1", "0"], ["0", "0", "0", "2"]]'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "found none of the sections [system], [hamiltonian], [family]"),
        ('variables = ["x"', "TOML: "),
        ("\xff", "not UTF-8 text"),
        ("a = " + "[" * 100_000, "nested too deeply"),
        ('variables = ["x"]\n[system]\nrhs = ["' + "(" * 1_000_000 + '"]', "found 1000000 characters"),
        ('variables = ["x"]\n[system]\nrhs = ["' + "(" * 1_000 + '"]', "brackets"),
        ('variables = ["x"]\n[system]\nrhs = ["x^3"]', "system.rhs[1]: found a polynomial of degree 3"),
        ('variables = ["x", "x"]\n[system]\nrhs = ["x", "x"]', "variables: found the name 'x' twice"),
        ("variables = []\n[system]\nrhs = []", "variables: found [], expected a list of names"),
        ('variables = ["eps"]\n[system]\nrhs = ["eps"]', "variables: eps is the step of the map"),
        ('variables = ["x", "y"]\n[hamiltonian]\nH = "x^3"\nJ = [[0, 1], [1, 0]]', "J is not skew"),
        ('variables = ["x", "y", "z"]\n[hamiltonian]\nH = "x^3"\nJ = "standard"', "needs an even dimension, found 3"),
        ('variables = ["x", "y"]\n[hamiltonian]\nH = "x^4"\nJ = "standard"', "degree 4, expected at most 3"),
        (f'[family]\n{FAMILY.replace("2", "3", 1)}\nH = "x1^3"', "A is not skew-Hamiltonian"),
        (f'[family]\n{FAMILY}\nH = "x1*x2*x3"', "H is not in the space of A"),
        (f'[family]\n{FAMILY}\nH = "x1^3 + x2"', "expected a homogeneous cubic"),
        (f'[family]\n{FAMILY}\nH = "x1^3"\nsigns = [1, 2]', "found [1, 2], expected a list of 1 and -1"),
        (f'[family]\n{FAMILY}\nH = "x1^3"\nsigns = [1]', "expected 2 numbers 1 or -1"),
        (
            'variables = ["x"]\n[system]\nrhs = ["x"]\n[integrals]\nI = "1/(x - x)"',
            "integrals.I: found a division by 0",
        ),
        ('variables = ["x"]\n[system]\nrhs = ["x"]\n[density]\nphi = "0"', "density.phi: found 0"),
    ],
    ids=lambda text: text[-70:],
)
def test_a_wrong_file_gives_2_and_a_message_with_the_file_and_the_key(kahanmaps, tmp_path, text, words):
    path = tmp_path / "wrong.toml"
    path.write_bytes(text.encode("latin-1"))
    outcome = kahanmaps("check-measure", path)
    assert (outcome.status, outcome.out) == (2, "")
    assert outcome.err.startswith(f"Error: {path}: ")
    assert words in outcome.err


def test_all_mistakes_of_a_file_are_told_at_once(kahanmaps, tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text(
        'nam = "q"\nvariables = ["x", "y"]\n[parameters]\neps = "1"\n'
        '[system]\nrhs = ["x^3", "y +"]\nlhs = 1\n[integrals]\nI = "z"\n[density]\nphi = "0"\n'
    )
    outcome = kahanmaps("systems", path)
    keys = [line.split(":")[0].strip() for line in outcome.err.splitlines() if line.startswith("  ") and ": " in line]
    assert keys == [
        "nam",
        "parameters.eps",
        "system.lhs",
        "system.rhs[1]",
        "system.rhs[2]",
        "integrals.I",
        "density.phi",
    ]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_file_that_may_not_be_read_gives_2(kahanmaps, tmp_path):
    path = tmp_path / "secret.toml"
    path.write_text("")
    path.chmod(0)
    outcome = kahanmaps("systems", path)
    assert (outcome.status, "Permission denied" in outcome.err) == (2, True)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.parametrize("form", ["text", "jsonl", "csv", "npz"])
def test_a_full_disk_is_no_wrong_use_gives_3_and_names_the_file(kahanmaps, form):
    outcome = kahanmaps(f"orbit {TOP} --steps 2 --format {form} -o /dev/full")
    assert (outcome.status, outcome.err) == (3, "Error: No space left on device: /dev/full\n")
