"""Do two Kahan maps commute: proved where a theorem applies, refuted with a witness, supported at random points.

Associated members of the family commute, whatever chi is; Phi_{H_0} and Phi_{H_1} do not, and neither do generic pairs,
maps of one system at two steps, or a pair that differs from a commuting one in the fortieth digit. Every witness is
computed a second time, by an elimination over Python's Fractions.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import cache
from math import comb

import pytest
from check_helpers import (
    QUICK,
    commute_at,
    exact,
    file_of,
    only,
    side_by_side,
    system_of,
    verdicts,
    verify_commute_witness,
)
from flint import fmpq, fmpq_mat, fmpq_poly
from helpers import EULER_TOP, FORCED_PLANE, LORENZ, LOTKA_VOLTERRA, THOROUGH, from_forms, points, rationals, systems
from hypothesis import assume, given, settings

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.written.text import parse_rational_function
from kahanmaps.checks import commute, judge, theorems
from kahanmaps.checks import settings as settings_module
from kahanmaps.checks.claims import Report, Verdict
from kahanmaps.checks.commute import check_commute
from kahanmaps.checks.judge import Contradiction
from kahanmaps.checks.settings import Settings
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError, SingularStep
from kahanmaps.family.associated import AssociatedSystem, FamilyMember
from kahanmaps.family.draw import draw_with_chi, draw_with_eigenvalues
from kahanmaps.maps.explicit import explicit_map
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.orbits.iteration import Orbit
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import QuadraticSystem

PROVED, REFUTED, SUPPORTED = Verdict.PROVED, Verdict.REFUTED, Verdict.SUPPORTED
few = settings(max_examples=20)
nonzero = rationals(6).filter(lambda eps: eps != 0)


@pytest.fixture(autouse=True, scope="module")
def claims_are_decided_at_points_alone():
    """Proof by expansion, which makes many a supported claim a proved one, has its own tests in test_expand.py."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(judge, "expansion", lambda *_: None)
        yield


def pair(f: QuadraticSystem, g: QuadraticSystem, how: Settings = QUICK, **more: object) -> Report:
    return check_commute(file_of(f, "f"), file_of(g, "g"), how, **more)


# Members of the family

# (how chi factors, the member, the number of irreducible factors)
MEMBERS = {
    "m=1": (draw_with_eigenvalues([2], seed=3), 1),
    "m=2, split": (draw_with_eigenvalues([1, -2], seed=3), 2),
    "m=2, fractions": (draw_with_eigenvalues(["1/2", "-2/3"], seed=4), 2),
    "m=2, irreducible": (draw_with_chi(fmpq_poly([-2, 0, 1]), seed=3), 1),
    "m=2, complex": (draw_with_chi(fmpq_poly([1, 0, 1]), seed=3), 1),
    "m=2, (t-1)^2": (draw_with_chi(fmpq_poly([1, -2, 1]), seed=3), 1),
    "m=2, eigenvalue twice": (draw_with_eigenvalues([3, 3], seed=3), 1),
    "m=3, split": (draw_with_eigenvalues([1, -2, 3], seed=3), 3),
    "m=3, (t-1)(t^2-2)": (draw_with_chi(fmpq_poly([2, -2, -1, 1]), seed=3), 2),
    "m=3, irreducible": (draw_with_chi(fmpq_poly([1, 1, 0, 1]), seed=3), 1),
    "m=3, (t-1)^2 (t-2)": (draw_with_chi(fmpq_poly([-2, 5, -4, 1]), seed=3), 2),
    "m=4, split": (draw_with_eigenvalues([1, -2, 3, 5], seed=3), 4),
    "m=4, (t^2-2)(t^2-3)": (draw_with_chi(fmpq_poly([6, 0, -5, 0, 1]), seed=3), 2),
    "m=4, (t-1)(t+2)(t^2+1)": (draw_with_chi(fmpq_poly([-2, 1, -1, 1, 1]), seed=3), 3),
    "m=4, irreducible": (draw_with_chi(fmpq_poly([1, 1, 0, 0, 1]), seed=3), 1),
}
over_members = pytest.mark.parametrize(
    ("member", "factors"),
    [
        pytest.param(
            *MEMBERS[name], id=name, marks=THOROUGH if name in ("m=4, (t-1)(t+2)(t^2+1)", "m=4, split") else ()
        )
        for name in MEMBERS
    ],
)


@cache
def _report(name: str) -> Report:
    return check_commute(SystemFile.from_member(MEMBERS[name][0]), settings=QUICK)


def report_of(member: FamilyMember) -> Report:
    """What is said of one of MEMBERS, asked once."""
    (name,) = (name for name, (known, _) in MEMBERS.items() if known is member)
    return _report(name)


def parts(report: Report) -> tuple[list, list, list]:
    """The findings on pairs, on the splitting field, and the controls."""
    controls = [found for found in report.findings if found.control]
    field = [found for found in report.findings if "splitting field" in found.claim]
    return [found for found in report.findings if found not in controls + field], field, controls


@over_members
def test_all_pairs_of_a_class_are_proved_to_commute(member, factors):
    pairs, _, _ = parts(report_of(member))
    assert {found.verdict for found in pairs} == {PROVED}


@over_members
def test_there_is_a_finding_for_every_pair_of_associated_systems_up_to_sign(member, factors):
    pairs, _, _ = parts(report_of(member))
    # One factor: the only other rational associated system is -f_0.
    assert len(pairs) == (comb(2 ** (factors - 1), 2) if factors > 1 else 1)
    assert len({found.claim for found in pairs}) == len(pairs)


@over_members
def test_the_splitting_field_is_spoken_of_exactly_where_chi_does_not_split(member, factors):
    _, field, _ = parts(report_of(member))
    assert len(field) == any(factor.degree > 1 for factor in member.factors)
    assert all(found.verdict is PROVED for found in field)


@over_members
def test_the_control_is_refuted_with_a_witness_that_stands(member, factors):
    _, _, (control,) = parts(report_of(member))
    assert control.verdict is REFUTED
    J = standard_structure(member.dim)
    f = CubicHamiltonian(member.chain[0], J).system
    if member.m == 1:
        verify_commute_witness(control.witness, f, f, 2)
    else:
        verify_commute_witness(control.witness, f, CubicHamiltonian(member.chain[1], J).system)


@over_members
def test_a_proof_is_confirmed_at_random_points_and_along_an_orbit(member, factors):
    pairs, _, _ = parts(report_of(member))
    for found in pairs:
        assert [evidence.method for evidence in found.also] == ["random points over GF(p)", "exact orbit"]
        assert "held" in found.also[0].summary
        assert "held exactly at 3 points" in found.also[1].summary


@over_members
def test_without_the_theorem_the_pairs_of_a_class_are_supported(member, factors, monkeypatch):
    # The same claims by experiment alone: nothing of the proof is used.
    monkeypatch.setattr(theorems, "evidence", lambda theorem, hypotheses: None)
    report = check_commute(SystemFile.from_member(member), settings=QUICK)
    pairs, _, (control,) = parts(report)
    assert {found.verdict for found in pairs} == {SUPPORTED}
    assert control.verdict is REFUTED


def test_a_member_at_one_named_eps_is_proved_and_its_control_refuted_at_that_eps():
    report = check_commute(SystemFile.from_member(MEMBERS["m=2, split"][0]), settings=Settings(eps="-3/5", steps=2))
    assert verdicts(report) == [PROVED, REFUTED]
    assert report.findings[1].witness.eps == "-3/5"


@pytest.mark.parametrize("eigenvalues", [[1, -1], [1, -1, 1]])
def test_a_control_that_commutes_is_noted(eigenvalues):
    # A^2 = I makes f_1 = A^T f_0 an associated system: the control cannot fail, and the report says so.
    report = check_commute(SystemFile.from_member(draw_with_eigenvalues(eigenvalues, seed=3)), settings=QUICK)
    assert report.findings[-1].control
    assert report.findings[-1].verdict is PROVED
    assert any("control was not refuted" in note for note in report.notes)
    assert report.verdict is PROVED


def test_a_class_of_more_than_256_systems_is_compared_at_single_minus_signs():
    report = check_commute(SystemFile.from_member(draw_with_eigenvalues(range(1, 10), seed=3)), settings=QUICK)
    assert len(report.findings) == comb(10, 2) + 1
    assert report.verdict is PROVED
    assert any("2^8" in note for note in report.notes)


def test_beyond_thirty_pairs_the_hypotheses_alone_are_verified():
    report = check_commute(SystemFile.from_member(draw_with_eigenvalues([1, -2, 3, 5, 7], seed=3)), settings=QUICK)
    pairs, _, _ = parts(report)
    assert len(pairs) == comb(16, 2)
    assert {found.verdict for found in pairs} == {PROVED}
    assert [bool(found.also) for found in pairs] == [True] * 30 + [False] * 90
    assert any("first 30 pairs" in note for note in report.notes)


# Pairs from two files


SPLIT3 = MEMBERS["m=3, split"][0]


def signed(member: FamilyMember, *signs: int) -> SystemFile:
    return SystemFile.from_member(FamilyMember(member.A, member.H, signs), "".join("+-"[sign < 0] for sign in signs))


def test_two_files_of_one_class_are_proved_to_commute_by_the_theorem():
    found = only(check_commute(signed(SPLIT3, 1, 1, -1), signed(SPLIT3, 1, -1, 1), QUICK))
    assert found.verdict is PROVED
    assert "Theorem 9" in found.evidence.data["theorem"]


def test_two_files_of_one_class_without_its_structure_are_proved_by_the_splitting_lemma():
    f, g = SPLIT3.associate((1, 1, -1)).system, SPLIT3.associate((1, -1, 1)).system
    found = only(pair(f, g))
    assert found.verdict is PROVED
    assert "splitting lemma" in found.evidence.data["theorem"]


def test_two_members_of_different_classes_are_refuted():
    other = draw_with_eigenvalues([1, -2, 3], seed=4)
    found = only(check_commute(SystemFile.from_member(SPLIT3), SystemFile.from_member(other), QUICK))
    assert found.verdict is REFUTED
    verify_commute_witness(found.witness, SPLIT3.chosen.system, other.chosen.system)


def test_one_member_at_two_steps_is_refuted():
    file = SystemFile.from_member(SPLIT3)
    report = check_commute(file, file, Settings(eps="1/5", steps=2), eps2=fmpq(1, 3))
    found = only(report)
    assert found.verdict is REFUTED
    verify_commute_witness(found.witness, SPLIT3.chosen.system, SPLIT3.chosen.system, "5/3")
    assert found.witness.eps == "1/5"
    assert report.to_json()["eps2"] == "1/3"


@pytest.mark.parametrize("eps2", ["1/5", "-1/5", fmpq(1, 5)])
def test_one_member_at_the_same_and_at_the_opposite_step_is_proved(eps2):
    file = SystemFile.from_member(SPLIT3)
    assert check_commute(file, file, Settings(eps="1/5", steps=2), eps2=eps2).verdict is PROVED


def test_associated_members_at_different_steps_are_refuted():
    report = check_commute(
        signed(SPLIT3, 1, 1, 1), signed(SPLIT3, 1, 1, -1), Settings(eps="1/5", steps=2), eps2=fmpq(1, 3)
    )
    verify_commute_witness(
        only(report).witness, SPLIT3.associate((1, 1, 1)).system, SPLIT3.associate((1, 1, -1)).system, "5/3"
    )


@few
@given(systems(dims=(2,)), systems(dims=(2,)), points(2, rationals(9)))
def test_the_verdict_on_a_random_pair_agrees_with_an_independent_computation(f, g, x):
    found = only(pair(f, g))
    if found.verdict is REFUTED:
        verify_commute_witness(found.witness, f, g)
    else:
        assert commute_at(f, g, Fraction(2, 7), exact(*x)) in (True, None)


@pytest.mark.parametrize("eps", [None, "1/3", "-7/2"])
@pytest.mark.parametrize(
    ("f", "g"),
    [
        (LOTKA_VOLTERRA, FORCED_PLANE),
        (LORENZ, EULER_TOP),
        (EULER_TOP, system_of("x1 x2 x3", "x2*x3", "-2*x3*x1", "3*x1*x2")),
        (LOTKA_VOLTERRA, LOTKA_VOLTERRA.scaled(2)),
        (system_of("x", "x^2"), system_of("x", "x^2 + 1")),
    ],
)
def test_a_pair_without_a_reason_to_commute_is_refuted(f, g, eps):
    found = only(pair(f, g, Settings(eps=eps, steps=2)))
    assert found.verdict is REFUTED
    verify_commute_witness(found.witness, f, g)


@pytest.mark.parametrize("power", [1, 10, 40, 400])
@pytest.mark.parametrize("monomial", ["x1*x2", "x3", "1"])
def test_a_commuting_pair_disturbed_in_a_far_digit_is_refuted(monomial, power):
    f, g = SPLIT3.associate((1, 1, 1)).system, SPLIT3.associate((1, 1, -1)).system
    tiny = system_of(" ".join(f.variables), *[f"({monomial})/10^{power}"] + ["0"] * 5)
    disturbed = QuadraticSystem([a + b for a, b in zip(g.rhs, tiny.rhs, strict=True)])
    found = only(pair(f, disturbed, Settings(steps=1)))
    assert found.verdict is REFUTED
    verify_commute_witness(found.witness, f, disturbed)


# Proved or supported without the family


@few
@given(systems(dims=(1, 2)), systems(dims=(1, 2)), nonzero)
def test_decoupled_inhomogeneous_systems_one_part_reversed_commute(first, second, eps):
    f, g = side_by_side(first, second), side_by_side(first, second.scaled(-1))
    report = pair(f, g, Settings(eps=eps, steps=2))
    # x' = x at eps = 1 has no map: det(I - eps f') = 0 everywhere.
    assume("not defined at any" not in report.findings[0].evidence.summary)
    assert report.holds
    C = theorems.linear_relation(f, g)
    assert C is None or report.verdict is PROVED


def test_a_coupling_of_the_two_parts_is_refuted():
    f = system_of("x y", "x^2 + 1", "y^2 - y + x/1000")
    g = system_of("x y", "x^2 + 1", "-y^2 + y - x/1000")
    found = only(pair(f, g))
    assert found.verdict is REFUTED
    verify_commute_witness(found.witness, f, g)


def linear(rows: list[list[int]]) -> QuadraticSystem:
    n = len(rows)
    names = tuple("xyz"[:n])
    return from_forms(names, [fmpq_mat(n, n)] * n, fmpq_mat(rows), [fmpq(0)] * n)


@pytest.mark.parametrize(
    ("A", "B"),
    [
        ([[1, 2], [3, 4]], [[2, 2], [3, 5]]),  # B = A + I
        ([[1, 2], [3, 4]], [[7, 10], [15, 22]]),  # B = A^2
        ([[0, 1, 0], [0, 0, 1], [1, 0, 0]], [[1, 2, 0], [0, 1, 2], [2, 0, 1]]),  # circulants
        ([[1, 2], [2, 4]], [[3, 2], [2, 6]]),  # singular
    ],
)
def test_linear_systems_with_commuting_matrices_are_supported(A, B):
    # Phi is the Cayley transform (I - eps A)^{-1} (I + eps A); no theorem of the library covers this.
    found = only(pair(linear(A), linear(B)))
    assert found.verdict is SUPPORTED
    assert found.evidence.method == "random points over GF(p)"
    assert int(found.evidence.data["error_bound"].split("^")[1]) <= -100


@pytest.mark.parametrize(("A", "B"), [([[1, 2], [3, 4]], [[1, 2], [3, 5]]), ([[0, 1], [0, 0]], [[0, 0], [1, 0]])])
def test_linear_systems_with_other_matrices_are_refuted(A, B):
    found = only(pair(linear(A), linear(B)))
    assert found.verdict is REFUTED
    verify_commute_witness(found.witness, linear(A), linear(B))


def test_shears_along_one_direction_are_supported():
    # x' = h(y), y' = 0: the maps are x + 2 eps h(y), and the components of f are dependent.
    f, g = system_of("x y", "y^2 + 3*y", "0"), system_of("x y", "y^2/7 - 1", "0")
    assert only(pair(f, g)).verdict is SUPPORTED


def test_shears_along_two_directions_are_refuted():
    f, g = system_of("x y", "y^2", "0"), system_of("x y", "0", "x^2")
    verify_commute_witness(only(pair(f, g)).witness, f, g)


def test_the_zero_system_commutes_with_everything():
    zero = system_of("x y", "0", "0")
    assert only(pair(LOTKA_VOLTERRA, zero)).verdict is PROVED
    assert only(pair(zero, zero)).verdict is PROVED


def goes_on(f: QuadraticSystem, first: Fraction, second: Fraction) -> bool:
    """Whether two steps, one with each eps, have a value at some point: x' = x at eps = 1 has no map at all."""
    field = GF(2**61 - 1)
    for k in range(1, 9):
        try:
            image = KahanMap(f, first, field).step([k**j + j for j in range(3, 3 + f.dim)])
            KahanMap(f, second, field).step(image)
        except SingularStep:
            continue
        return True
    return False


@few
@given(systems(dims=(1, 2)), nonzero)
def test_every_map_commutes_with_itself_and_with_its_inverse(f, eps):
    assume(goes_on(f, eps, eps) and goes_on(f, eps, -eps) and goes_on(f, -eps, eps))
    assert pair(f, f, Settings(eps=eps, steps=2)).verdict is PROVED
    assert pair(f, f, Settings(eps=eps, steps=2), eps2=-eps).verdict is PROVED


# What is told


def test_maps_are_compared_for_every_eps_where_one_of_them_has_it():
    turned = explicit_map(["x", "y"], [parse_rational_function(text, ["x", "y", "eps"]) for text in ("-y", "x")])
    pairs = [(LOTKA_VOLTERRA, turned), (turned, LOTKA_VOLTERRA), (turned, turned)]
    identities = [commute.commutativity(f, g, None, ("f", "g")) for f, g in pairs]
    assert [identity.where for identity in identities] == [", for every eps", ", for every eps", ""]


def test_variables_are_matched_by_position_and_that_is_noted():
    g = FORCED_PLANE.renamed(["a", "b"])
    report = pair(FORCED_PLANE, g)
    assert report.verdict is PROVED
    assert report.notes == ["variables are matched by position: x, y with a, b"]


@pytest.mark.parametrize("names", [("y", "x"), ("x", "y")])
def test_variables_are_matched_by_name_where_the_names_agree(names):
    # x' = x^2 + y, y' = x y, which commutes with itself, and by position does not.
    f = QuadraticSystem.from_text(["x", "y"], ["x^2+y", "x*y"])
    rhs = {"x": "x^2+y", "y": "x*y"}
    report = pair(f, QuadraticSystem.from_text(names, [rhs[name] for name in names]))
    assert report.verdict is PROVED
    assert report.notes == (["variables are matched by name: x, y with y, x"] if names[0] == "y" else [])
    assert pair(f, QuadraticSystem.from_text(["a", "b"], ["a*b", "b^2+a"])).verdict is REFUTED


def test_a_start_at_which_the_map_has_no_value_is_told():
    # x' = x^2 at eps = 1/10: det = 1 - 2 eps x vanishes at x = 5.
    f = system_of("x", "x^2")
    report = pair(f, f, Settings(eps="1/10", start=(5,), steps=3, orbit_is_asked=True))
    assert report.verdict is PROVED
    assert report.ended_early
    orbit = report.to_json()["orbit"]
    assert (orbit["start"], orbit["status"], orbit["steps"]) == (["5"], "singular", 0)
    assert "could not be tried at any point" in only(report).also[-1].summary
    assert "det(I - eps f'(x)) = 0 at step 0" in only(report).also[-1].summary


def test_an_orbit_that_runs_out_of_digits_is_told():
    report = pair(LORENZ, LORENZ, Settings(eps="1/10", steps=20, max_digits=50, orbit_is_asked=True))
    assert report.ended_early
    orbit = report.to_json()["orbit"]
    assert orbit["status"] == "budget"
    assert "the budget of 50 " in orbit["message"]
    assert orbit["message"] in only(report).also[-1].summary


def test_a_start_beyond_the_budget_is_tried_all_the_same():
    report = pair(LORENZ, LORENZ, Settings(start=("1/" + "3" * 100, 1, 1), max_digits=20))
    assert report.to_json()["orbit"]["start"][0] == "1/" + "3" * 100
    assert "held exactly at 1 point of an orbit" in only(report).also[-1].summary


def test_without_a_start_singular_starts_are_avoided(monkeypatch):
    # For x' = x^2 at eps = 1/10 a random start leads into the singular point 5 now and then.
    ends = []

    class Watched(Orbit):
        def __iter__(self):
            yield from super().__iter__()
            ends.append(self.end.status)

    monkeypatch.setattr(settings_module, "Orbit", Watched)
    f = system_of("x", "x^2")
    told = [pair(f, f, Settings(eps="1/10", steps=3, seed=k)).to_json()["orbit"]["status"] for k in range(30)]
    assert "singular" in ends
    assert "singular" not in told


# Wrong use


def test_one_plain_system_is_nothing_to_compare():
    with pytest.raises(InputError, match="one system commutes with itself"):
        check_commute(file_of(LOTKA_VOLTERRA))


def test_a_second_step_without_a_second_system_is_refused():
    with pytest.raises(InputError, match="second system"):
        check_commute(SystemFile.from_member(SPLIT3), settings=Settings(eps=1), eps2=fmpq(2))


def test_systems_of_different_dimension_are_refused():
    with pytest.raises(InputError, match=r"dimension 2 and g 3"):
        pair(LOTKA_VOLTERRA, EULER_TOP)


def test_a_second_step_without_the_first_is_refused():
    with pytest.raises(InputError, match="both --eps and --eps2"):
        pair(LOTKA_VOLTERRA, FORCED_PLANE, eps2=fmpq(1, 2))


def test_a_second_step_zero_is_refused():
    with pytest.raises(InputError, match="eps2 = 0"):
        pair(LOTKA_VOLTERRA, FORCED_PLANE, Settings(eps=1), eps2=fmpq(0))


# Mutations: a broken formula has to show


def half_step(self: KahanMap, point):
    """x + eps (I - eps f')^{-1} f: eps where 2 eps belongs."""
    x = self.point(point)
    image = ORIGINAL_STEP(self, x)
    return tuple(a + (b - a) / self.field.convert(2) for a, b in zip(x, image, strict=True))


ORIGINAL_STEP = KahanMap.step


def test_a_step_of_half_the_length_contradicts_the_theorem(monkeypatch):
    monkeypatch.setattr(KahanMap, "step", half_step)
    with pytest.raises(Contradiction, match="Theorem 9"):
        check_commute(SystemFile.from_member(SPLIT3), settings=QUICK)


def test_a_step_of_half_the_length_is_refuted_where_there_is_no_theorem(monkeypatch):
    monkeypatch.setattr(theorems, "evidence", lambda theorem, hypotheses: None)
    monkeypatch.setattr(KahanMap, "step", half_step)
    pairs, _, _ = parts(check_commute(SystemFile.from_member(SPLIT3), settings=QUICK))
    assert {found.verdict for found in pairs} == {REFUTED}


def test_a_b_whose_square_is_not_the_identity_is_refuted(monkeypatch):
    # 2 B in place of B: all else is as it should be, and the hypothesis B^2 = I catches it.
    def doubled(self: FamilyMember, signs) -> AssociatedSystem:
        right = ORIGINAL_ASSOCIATE(self, signs)
        if signs[-1] > 0:
            return right
        return replace(right, coefficients=tuple(2 * c for c in right.coefficients), B=right.B * fmpq(2), K=2 * right.K)

    monkeypatch.setattr(FamilyMember, "associate", doubled)
    member = MEMBERS["m=2, split"][0]
    pairs, _, _ = parts(check_commute(SystemFile.from_member(member), settings=QUICK))
    (found,) = pairs
    assert found.verdict is REFUTED
    f, g = member.associate((1, 1)).system, member.associate((1, -1)).system
    verify_commute_witness(found.witness, f, g)


ORIGINAL_ASSOCIATE = FamilyMember.associate


def test_a_proof_of_something_false_is_contradicted_by_the_computation(monkeypatch):
    false = theorems.evidence("a theorem that does not apply", [("nothing", True)])
    monkeypatch.setattr(commute.theorems, "commuting_by_splitting", lambda f, g: false)
    with pytest.raises(Contradiction, match="a theorem that does not apply"):
        pair(LOTKA_VOLTERRA, FORCED_PLANE)
