"""kahanmaps certificate: a script on standard output or in a file; a false claim is refuted with status 1."""

from __future__ import annotations


def test_the_command_in_the_comment_writes_the_same_certificate_again(kahanmaps):
    first = kahanmaps("certificate --vars=x,y '--image=y; (3 + y)/x' --for gp --integral '(x+1)*(y+1)*(x+y+3)/(x*y)'")
    assert (first.status, first.err) == (0, "")
    (line,) = [line for line in first.out.splitlines() if "kahanmaps certificate" in line]
    assert kahanmaps(line.split("kahanmaps ", 2)[2]).out == first.out


def test_a_false_claim_is_refuted_with_status_1_and_writes_nothing(kahanmaps, tmp_path):
    outcome = kahanmaps("certificate euler_top --for rocq --integral x1^2+x2^2 -o", tmp_path / "top.v")
    assert (outcome.status, outcome.out) == (1, "")
    assert outcome.err == "refuted: I1 is not conserved: no certificate can be written\n"
    assert list(tmp_path.iterdir()) == []


def test_a_certificate_goes_to_a_file(kahanmaps, tmp_path):
    path = tmp_path / "top.v"
    outcome = kahanmaps("certificate euler_top --for rocq --claim F1 -o", path)
    assert (outcome.status, outcome.out) == (0, "")
    assert outcome.err == f"{path}: euler_top: a certificate for rocq, {len(path.read_text().splitlines())} lines\n"
    assert kahanmaps("certificate euler_top --for rocq --claim F1 -q -o", path).err == ""


def test_a_system_of_which_nothing_is_known_is_refused_with_what_to_type(kahanmaps):
    outcome = kahanmaps("certificate lorenz --for gp")
    assert outcome.status == 2
    assert "kahanmaps find-integrals lorenz --toml" in outcome.err


def test_all_certifies_what_searches_prove(kahanmaps):
    outcome = kahanmaps("certificate lotka_volterra --for gp --all")
    assert outcome.status == 0
    for says in (
        "volume: dx/phi is invariant",
        "P: the map is Poisson",
        "D1: P is a Darboux",
        "T1: x -> T takes the map to itself",
    ):
        assert says in outcome.out
    assert kahanmaps("certificate lotka_volterra --for gp --all --claim volume").status == 2


def test_commuting_maps_and_periods(kahanmaps):
    first = kahanmaps("""certificate "x' = y; y' = -x" --for gp --commute "x' = 2*y; y' = -2*x" """)
    assert (first.status, first.err) == (0, "")
    (line,) = [line for line in first.out.splitlines() if "kahanmaps certificate" in line]
    assert kahanmaps(line.split("kahanmaps ", 2)[2]).out == first.out
    assert "is the image of point 4 under f" in kahanmaps("certificate lyness -p a=1 --for gp --period 5").out
    outcome = kahanmaps("certificate lyness --for gp --period 5")
    assert (outcome.status, outcome.err) == (
        1,
        "refuted: iterate 5 is not the identity: no certificate can be written\n",
    )
    assert kahanmaps("certificate paper_m2 --for gp --commute associates --claim volume").status == 2
