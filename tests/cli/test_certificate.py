"""kahanmaps certificate: a script on standard output or in a file; a false claim is refuted with status 1."""

import shutil
import subprocess

import pytest

EQUIVALENT = """"u' = 2*v; v' = 3*u^2 - 1" --for gp --equivalent weierstrass -p g2=4 --by 'u; 2*v'"""


@pytest.mark.parametrize(
    "options",
    [
        "--vars=x,y '--image=y; (3 + y)/x' --for gp --integral '(x+1)*(y+1)*(x+y+3)/(x*y)'",
        """"x' = y^2; y' = 0" --for rocq --integral I1=y""",  # quotes in a comment of Rocq
        """"x' = y; y' = -x" --for gp --commute "x' = 2*y; y' = -2*x" """,
        EQUIVALENT,
    ],
)
def test_the_command_in_the_comment_writes_the_same_certificate_again(kahanmaps, options):
    first = kahanmaps(f"certificate {options}")
    (line,) = [line for line in first.out.splitlines() if "kahanmaps certificate" in line]
    assert (first.status, kahanmaps(line.split("kahanmaps ", 2)[2]).out) == (0, first.out)


def test_a_false_claim_is_refuted_with_status_1_and_writes_nothing(kahanmaps, tmp_path):
    outcome = kahanmaps("certificate euler_top --for rocq --integral x1^2+x2^2 -o", tmp_path / "top.v")
    assert (outcome.status, outcome.out) == (1, "")
    assert outcome.err == "refuted: I1 is not conserved: no certificate can be written\n"
    assert list(tmp_path.iterdir()) == []


def test_a_certificate_goes_to_a_file(kahanmaps, tmp_path):
    path = tmp_path / "top.v"
    outcome = kahanmaps("certificate euler_top --for rocq --claim F1 -o", path)
    assert (outcome.status, outcome.out) == (0, "")
    text = path.read_text()
    first, second = outcome.err.splitlines()
    assert first == f"euler_top: 1 claim, {len(text)} bytes, about 3.2 seconds to check"
    assert second == f"{path}: euler_top: a certificate for rocq, {len(text.splitlines())} lines"
    assert kahanmaps("certificate euler_top --for rocq --claim F1 -q -o", path).err == ""
    record = kahanmaps("certificate euler_top --for rocq --claim F1 --json -o", path).json
    expected = {"for": "rocq", "claims": ["F1"], "bytes": len(text), "seconds": 3.2, "text": None}
    assert expected.items() <= record.items()
    record = kahanmaps("certificate euler_top --for gp --claim F1 --json").json
    assert (record["text"].splitlines()[-1], len(record["text"])) == ("quit(!ok)", record["bytes"])


def test_a_claim_that_is_too_long_says_what_to_raise(kahanmaps):
    outcome = kahanmaps("certificate repaired_icosahedral --for gp --claim F --effort -4")
    assert (outcome.status, outcome.out) == (2, "")
    assert "have more than 625 terms when multiplied out; raise --effort" in outcome.err
    first = kahanmaps("certificate lyness --for gp --claim I --effort 2").out
    assert "--claim I --effort 2" in first


def test_a_system_of_which_nothing_is_known_is_refused_with_what_to_type(kahanmaps):
    outcome = kahanmaps("certificate lorenz --for gp")
    assert outcome.status == 2
    assert "kahanmaps find-integrals lorenz --toml" in outcome.err


def test_all_certifies_what_searches_prove(kahanmaps):
    outcome = kahanmaps("certificate lotka_volterra --for gp --all")
    assert outcome.status == 0
    says = ["volume: dx/phi is invariant", "P: the map is Poisson", "D1: P is a Darboux", "entropy: positive entropy"]
    assert [text for text in (*says, "T1: x -> T takes the map to itself") if text not in outcome.out] == []


def test_a_period_is_certified_or_refuted_at_a_point(kahanmaps):
    assert "is the image of point 4 under f" in kahanmaps("certificate lyness -p a=1 --for gp --period 5").out
    outcome = kahanmaps("certificate lyness --for gp --period 5")
    assert (outcome.status, outcome.out) == (1, "")
    assert outcome.err.startswith("refuted: iterate 5 is not the identity, as it moves a point modulo 2^61 - 1: x = ")


def test_equivalent_systems(kahanmaps):
    first = kahanmaps(f"certificate {EQUIVALENT}")
    assert (first.status, first.err.splitlines()[0]) == (0, "-p g2: set in both systems")
    assert "equivalence: T takes the map of inline to that of weierstrass" in first.out
    outcome = kahanmaps("certificate", EQUIVALENT.replace("2*v'", "3*v'"))
    assert (outcome.status, outcome.out) == (1, "")
    assert "refuted: equivalence takes the map to another one" in outcome.err


@pytest.mark.parametrize(
    "rest",
    [
        "harmonic --equivalent harmonic",
        "harmonic --by u",
        "harmonic --equivalent harmonic --by u --commute harmonic",
        "paper_m2 --commute associates --claim volume",
        "lotka_volterra --all --claim volume",
    ],
)
def test_options_that_do_not_go_together_are_refused(kahanmaps, rest):
    assert kahanmaps(f"certificate --for gp {rest}").status == 2


@pytest.mark.parametrize(
    ("command", "status", "says"),
    [
        ("analyze \"x' = y + 1; y' = 24*(x-2)^2 - 8\"", 0, "equivalence: f is equivalent to weierstrass at g2 = 64"),
        ("check-integrals euler_top", 0, "F2: P/Q is an integral"),
        ("check-integrals euler_top --integral J=F1", 0, "J: P/Q is an integral"),
        ("check-measure lotka_volterra --density 3*x*y", 0, "volume: dx/phi is invariant"),
        ("check-poisson weierstrass", 0, "poisson: the map is Poisson"),
        ("check-commute paper_m2", 0, "is the image of point 3 under f"),
        ("find-integrals euler_top --symbolic a1,a2,a3", 0, "I2: P/Q is an integral"),
        ("find-integrals volterra_periodic_3 --darboux 1", 0, "D4: P is a Darboux polynomial"),
        ("find-density lotka_volterra", 0, "volume_1: dx/phi is invariant"),
        ("find-poisson lotka_volterra", 0, "P: the map is Poisson"),
        ("find-commuting paper_m2", 0, "g1_maps_1_and_2_commute: points are images of others"),
        ("find-symmetry lotka_volterra", 0, "T1: x -> T takes the map to itself"),
    ],
)
def test_checks_and_searches_write_a_certificate_of_what_they_prove(command, status, says, kahanmaps, tmp_path):
    path = tmp_path / "proof.gp"
    outcome = kahanmaps(f"{command} --certificate", path)
    assert outcome.status == status
    text = path.read_text()
    assert says in text
    assert f" {len(text)} bytes, less than a second to check\n" in outcome.err
    assert outcome.err.endswith(f"a certificate for gp, {len(text.splitlines())} lines\n")
    if shutil.which("gp") is not None:
        done = subprocess.run(["gp", "-q", path], capture_output=True, text=True, stdin=subprocess.DEVNULL)
        assert (done.returncode, "FALSE" in done.stdout) == (0, False)


@pytest.mark.parametrize(
    ("command", "ending", "status", "says"),
    [
        ("check-integrals euler_top --integral x1", ".gp", 1, "is not written: I1 is not conserved"),
        ("check-poisson henon_heiles", ".gp", 1, "is not written: Pi is no Poisson tensor"),
        ("find-integrals lorenz", ".v", 3, "is not written: nothing was found that is proved"),
        ("check-integrals euler_top", ".txt", 2, "expected a file that ends with .v, .gp or .py"),
        ("analyze euler_top --eps 1/10", ".gp", 2, "give --certificate or --eps, not both"),
        ("check-integrals euler_top --eps 1/10", ".gp", 2, "give --certificate or --eps, not both"),
        ("find-integrals euler_top --flow", ".gp", 2, "--certificate cannot be combined with --flow"),
        ("find-density euler_top --flow", ".gp", 2, "--flow cannot be combined with --certificate"),
    ],
)
def test_what_is_not_proved_for_every_eps_has_no_certificate(command, ending, status, says, kahanmaps, tmp_path):
    outcome = kahanmaps(f"{command} --certificate", tmp_path / f"proof{ending}")
    assert (outcome.status, list(tmp_path.iterdir())) == (status, [])
    assert says in outcome.err


def test_a_report_links_the_certificate_that_it_writes(kahanmaps, tmp_path):
    page, proof = tmp_path / "page.html", tmp_path / "proof 1.gp"
    command = f"report lotka_volterra --from checks --no-pictures --certificate '{proof}' -o"
    assert kahanmaps(command, page).status == 0
    assert '<a href="proof%201.gp">proof 1.gp</a>' in page.read_text()
    assert "dx/phi is invariant" in proof.read_text()
    assert "Certificate" not in kahanmaps("report lotka_volterra --from checks --no-pictures").out
    assert kahanmaps(f"report lotka_volterra --eps 1/2 --certificate '{proof}'").status == 2


def test_verify_writes_the_certificate_of_a_member(kahanmaps, tmp_path):
    path = tmp_path / "member.gp"
    outcome = kahanmaps("verify paper_m2 --section 1 --certificate", path)
    assert outcome.status == 0
    assert "paper_m2: a certificate for gp" in outcome.err
    text = path.read_text()
    assert all(name in text for name in ("H0", "H1", "volume", "poisson"))
    outcome = kahanmaps("verify --universal --m 1 --certificate", tmp_path / "none.gp")
    assert outcome.status == 2
    assert "a certificate is about one member" in outcome.err
    assert not (tmp_path / "none.gp").exists()
