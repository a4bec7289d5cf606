"""Do two Kahan maps commute: proved where a theorem applies, refuted with a witness, supported at random points.

Every witness is computed a second time, by an elimination over Python's Fractions.
"""

from fractions import Fraction
from functools import cache
from math import comb

import pytest
from check_helpers import QUICK, commute_at, exact, file_of, only, system_of, verify_commute_witness
from flint import fmpq, fmpq_poly
from helpers import EULER_TOP, FORCED_PLANE, LORENZ, LOTKA_VOLTERRA, points, rationals, refuses, systems
from hypothesis import assume, given

from kahanmaps.checks import certify, theorems
from kahanmaps.checks.claims import Certainty, Report
from kahanmaps.checks.commute import check_commute
from kahanmaps.checks.settings import Settings
from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import SystemFile, parse_system
from kahanmaps.documents.inline import System
from kahanmaps.family.associated import FamilyMember
from kahanmaps.family.random_members import random_member_with_chi, random_member_with_eigenvalues
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import QuadraticSystem

pytestmark = pytest.mark.usefixtures("at_points_only")
PROVED, REFUTED, SUPPORTED = Certainty.PROVED, Certainty.REFUTED, Certainty.SUPPORTED


def pair(f: QuadraticSystem, g: QuadraticSystem, how: Settings = QUICK, **more: object) -> Report:
    return check_commute(file_of(f, "f"), file_of(g, "g"), how, **more)


MEMBERS = {
    "m=1": random_member_with_eigenvalues([2], seed=3),
    "m=2, split": random_member_with_eigenvalues([1, -2], seed=3),
    "m=2, irreducible": random_member_with_chi(fmpq_poly([-2, 0, 1]), seed=3),
    "m=2, eigenvalue twice": random_member_with_eigenvalues([3, 3], seed=3),
    "m=3, split": random_member_with_eigenvalues([1, -2, 3], seed=3),
    "m=3, (t-1)(t^2-2)": random_member_with_chi(fmpq_poly([2, -2, -1, 1]), seed=3),
    "m=3, (t-1)^2 (t-2)": random_member_with_chi(fmpq_poly([-2, 5, -4, 1]), seed=3),
}
SPLIT3 = MEMBERS["m=3, split"]
over_members = pytest.mark.parametrize("name", MEMBERS)


@cache
def report_of(name: str) -> Report:
    """What is said of one of MEMBERS, asked once."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(certify, "expansion", lambda *_: None)
        return check_commute(SystemFile.from_member(MEMBERS[name]), settings=QUICK)


def parts(report: Report) -> tuple[list, list, list]:
    """The findings on pairs, on the splitting field, and the controls."""
    controls = [finding for finding in report.findings if finding.control]
    field = [finding for finding in report.findings if "splitting field" in finding.claim]
    return [finding for finding in report.findings if finding not in controls + field], field, controls


@over_members
def test_every_pair_of_associated_systems_up_to_sign_is_proved_to_commute(name):
    pairs, _, _ = parts(report_of(name))
    assert {entry.verdict for entry in pairs} == {PROVED}
    factors = len(MEMBERS[name].factors)
    # One factor: the only other rational associated system is -f_0.
    assert len(pairs) == (comb(2 ** (factors - 1), 2) if factors > 1 else 1)
    assert len({entry.claim for entry in pairs}) == len(pairs)


@over_members
def test_the_control_is_refuted_with_a_witness_that_stands(name):
    _, _, (control,) = parts(report_of(name))
    assert control.verdict is REFUTED
    member = MEMBERS[name]
    J = standard_structure(member.dim)
    f = CubicHamiltonian(member.chain[0], J).system
    if member.m == 1:
        verify_commute_witness(control.witness, f, f, 2)
    else:
        verify_commute_witness(control.witness, f, CubicHamiltonian(member.chain[1], J).system)


@over_members
def test_without_the_theorem_the_pairs_of_a_class_are_supported(name, monkeypatch):
    # The same claims by experiment alone: nothing of the proof is used.
    monkeypatch.setattr(theorems, "evidence", lambda theorem, hypotheses: None)
    report = check_commute(SystemFile.from_member(MEMBERS[name]), settings=QUICK)
    pairs, _, (control,) = parts(report)
    assert {entry.verdict for entry in pairs} == {SUPPORTED}
    assert control.verdict is REFUTED


def signed(member: FamilyMember, *signs: int) -> SystemFile:
    return SystemFile.from_member(FamilyMember(member.A, member.H, signs), "".join("+-"[sign < 0] for sign in signs))


def test_two_files_of_one_class_are_proved_to_commute_by_the_theorem():
    result = only(check_commute(signed(SPLIT3, 1, 1, -1), signed(SPLIT3, 1, -1, 1), QUICK))
    assert result.verdict is PROVED
    assert "Theorem 9" in result.evidence.data["theorem"]


def test_one_member_at_two_steps_is_refuted():
    file = SystemFile.from_member(SPLIT3)
    report = check_commute(file, file, Settings(eps="1/5", steps=2), eps2=fmpq(1, 3))
    result = only(report)
    assert result.verdict is REFUTED
    verify_commute_witness(result.witness, SPLIT3.chosen.system, SPLIT3.chosen.system, "5/3")
    assert result.witness.eps == "1/5"
    assert report.to_json()["eps2"] == "1/3"


@given(systems(dims=(2,)), systems(dims=(2,)), points(2, rationals(9)))
def test_the_verdict_on_a_random_pair_agrees_with_an_independent_computation(f, g, x):
    assume(any(f.rhs) and any(g.rhs))
    result = only(pair(f, g))
    if result.verdict is REFUTED:
        verify_commute_witness(result.witness, f, g)
    else:
        assert commute_at(f, g, Fraction(2, 7), exact(*x)) in (True, None)


@pytest.mark.parametrize(
    ("f", "g", "eps"),
    [
        (LORENZ, EULER_TOP, "-7/2"),
        (LOTKA_VOLTERRA, LOTKA_VOLTERRA.scaled(2), None),
        (system_of("x", "x^2"), system_of("x", "x^2 + 1"), "1/3"),
        (system_of("x y", "x^2 + 1", "y^2 - y + x/1000"), system_of("x y", "x^2 + 1", "-y^2 + y - x/1000"), None),
        (system_of("x y", "x + 2*y", "3*x + 4*y"), system_of("x y", "x + 2*y", "3*x + 5*y"), None),
        (system_of("x y", "y^2", "0"), system_of("x y", "0", "x^2"), None),
    ],
)
def test_a_pair_without_a_reason_to_commute_is_refuted(f, g, eps):
    result = only(pair(f, g, Settings(eps=eps, steps=2)))
    assert result.verdict is REFUTED
    verify_commute_witness(result.witness, f, g)


@pytest.mark.parametrize(("monomial", "power"), [("x1*x2", 40), ("1", 400)])
def test_a_commuting_pair_disturbed_in_a_far_digit_is_refuted(monomial, power):
    f, g = SPLIT3.associate((1, 1, 1)).system, SPLIT3.associate((1, 1, -1)).system
    tiny = system_of(" ".join(f.variables), *[f"({monomial})/10^{power}"] + ["0"] * 5)
    disturbed = QuadraticSystem([a + b for a, b in zip(g.rhs, tiny.rhs, strict=True)])
    result = only(pair(f, disturbed, Settings(steps=1)))
    assert result.verdict is REFUTED
    verify_commute_witness(result.witness, f, disturbed)


def test_shears_along_one_direction_are_supported():
    # x' = h(y), y' = 0: the maps are x + 2 eps h(y), and the components of f are dependent.
    f, g = system_of("x y", "y^2 + 3*y", "0"), system_of("x y", "y^2/7 - 1", "0")
    result = only(pair(f, g))
    assert result.verdict is SUPPORTED
    assert result.evidence.method == "random points over GF(p)"
    assert int(result.evidence.data["error_bound"].split("^")[1]) <= -100


def map_of(*image):
    return parse_system(f'variables = ["x", "y"]\n[map]\nimage = {list(image)}\n', "inline")


ZERO = System("x' = 0; y' = 0")
AT_A_TENTH = System("x' = (10*eps - 1)*(x + y); y' = (10*eps - 1)*x^2")  # 0 at eps = 1/10


@pytest.mark.parametrize(
    ("f", "g", "eps", "message"),
    [
        ("lotka_volterra", ZERO, None, "found g: .*whose map is the identity, expected another"),
        (ZERO, "lotka_volterra", "1/3", "found f: .*whose map is the identity, expected another"),
        ("lotka_volterra", AT_A_TENTH, "1/10", "found g = inline, whose map is the identity at eps = 1/10"),
        (AT_A_TENTH, "lotka_volterra", "1/10", "found f = inline, whose map is the identity at eps = 1/10"),
        (System("x' = a*x; y' = a*y^2", a=0), "lotka_volterra", None, "whose map is the identity"),
        (map_of("x", "y"), "lotka_volterra", "1/10", "found f = inline, whose map is the identity, expected"),
        (map_of("x + (10*eps - 1)*y^2", "y"), "lotka_volterra", "1/10", "whose map is the identity at eps = 1/10"),
    ],
)
def test_the_identity_is_no_map_that_commutes_with_another(f, g, eps, message):
    files = [load(entry) if isinstance(entry, str) else entry for entry in (f, g)]
    refuses(message, check_commute, *files, Settings(eps=eps, steps=2))


def test_a_map_that_is_the_identity_at_another_eps_is_compared():
    assert check_commute(load("lotka_volterra"), AT_A_TENTH, Settings(eps="1/9", steps=2)).verdict is REFUTED
    assert check_commute(AT_A_TENTH, AT_A_TENTH, Settings(steps=2)).verdict.holds  # at every eps but one
    refuses(
        "identity at eps = 1/10", check_commute, load("lotka_volterra"), AT_A_TENTH, Settings(eps="1/9"), eps2="1/10"
    )


@pytest.mark.parametrize("names", [("y", "x"), ("x", "y")])
def test_variables_are_matched_by_name_where_the_names_agree(names):
    # x' = x^2 + y, y' = x y, which commutes with itself, and by position does not.
    f = QuadraticSystem.from_text(["x", "y"], ["x^2+y", "x*y"])
    rhs = {"x": "x^2+y", "y": "x*y"}
    report = pair(f, QuadraticSystem.from_text(names, [rhs[name] for name in names]))
    assert report.verdict is PROVED
    assert report.notes == (["variables are matched by name: x, y with y, x"] if names[0] == "y" else [])
    assert pair(f, QuadraticSystem.from_text(["a", "b"], ["a*b", "b^2+a"])).verdict is REFUTED


def test_an_indeterminate_initial_point_is_reported():
    # x' = x^2 at eps = 1/10: det = 1 - 2 eps x vanishes at x = 5.
    f = system_of("x", "x^2")
    report = pair(f, f, Settings(eps="1/10", start=(5,), steps=3, orbit_is_requested=True))
    assert report.verdict is PROVED
    assert report.ended_early
    orbit = report.to_json()["orbit"]
    assert (orbit["start"], orbit["status"], orbit["steps"]) == (["5"], "singular", 0)
    assert "could not be tried at any point" in only(report).also[-1].summary
    assert "det(I - eps f'(x)) = 0 at step 0" in only(report).also[-1].summary


def test_a_second_step_of_length_0_is_refused():
    refuses("eps2 = 0", check_commute, file_of(LOTKA_VOLTERRA), file_of(FORCED_PLANE), Settings(eps=1), eps2=0)
