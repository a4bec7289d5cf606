"""Invariant measures dx/phi and the Poisson tensor Pi(x) = J - eps^2 f'(x)^2 J.

Witnesses are computed a second time, det dPhi and dPhi from dual numbers.
"""

import re
from fractions import Fraction

import pytest
from check_helpers import (
    QUICK,
    claim,
    determinant,
    exact,
    file_of,
    function_value,
    half_step,
    hamiltonian_of,
    hamiltonians,
    kahan_jacobian,
    kahan_step,
    only,
    slope,
    system_of,
    tensor,
    unit,
    verdicts,
    verify_witness,
)
from flint import fmpq, fmpq_poly
from helpers import EULER_TOP, LORENZ, LOTKA_VOLTERRA, refuses
from hypothesis import assume, given
from hypothesis import strategies as st

from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.checks import preserve, theorems
from kahanmaps.checks.certify import Contradiction
from kahanmaps.checks.claims import Certainty, Finding
from kahanmaps.checks.preserve import check_measure, check_poisson
from kahanmaps.checks.settings import Settings
from kahanmaps.documents.files import SystemFile, parse_system
from kahanmaps.family.random_members import random_member_with_chi, random_member_with_eigenvalues
from kahanmaps.invariants.poisson import MatrixPoissonTensor
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.systems.hamiltonian import CubicHamiltonian
from kahanmaps.systems.quadratic import QuadraticSystem

PROVED, REFUTED, SUPPORTED, UNDECIDED = Certainty.PROVED, Certainty.REFUTED, Certainty.SUPPORTED, Certainty.UNDECIDED
pytestmark = pytest.mark.usefixtures("at_points_only")

PLANE = hamiltonian_of("q p", "p^2/2 - q^3/3 + q")
GENERIC = hamiltonian_of("x y z w", "x^3 + y^2*w - 2*x*z*w + z^3 + x*y*z + w^3/3")
MEMBERS = {
    "m=1": random_member_with_eigenvalues([2], seed=3),
    "m=2, irreducible": random_member_with_chi(fmpq_poly([-2, 0, 1]), seed=3),
    "m=3": random_member_with_eigenvalues([1, -2, 3], seed=3),
}


def file(hamiltonian: CubicHamiltonian) -> SystemFile:
    return SystemFile.from_hamiltonian(hamiltonian)


def at_witness(finding: Finding, system: QuadraticSystem):
    """x, eps, x~ of a witness, x~ computed anew."""
    assert finding.verdict is REFUTED
    x, (eps,) = exact(*finding.witness.point), exact(finding.witness.eps)
    image = kahan_step(system, eps, x)
    assert image is not None
    return x, eps, image


@given(hamiltonians(dims=(1, 2, 3)), st.sampled_from([None, "-2/3"]))
def test_the_determinant_density_is_proved_for_every_constant_skew_j_and_no_point_contradicts_it(hamiltonian, eps):
    result = only(check_measure(file(hamiltonian), Settings(eps=eps, steps=2)))
    # At one eps, as for H = q p at eps = 1, there may be no map at all.
    assert result.verdict is PROVED or (eps is not None and result.verdict is UNDECIDED)
    assert result.formula == "phi = det(I - eps f'(x))"


def check_density(system: QuadraticSystem, phi: str, how: Settings = QUICK) -> Finding:
    """The finding on a claimed density; a witness is verified with det dPhi from dual numbers."""
    result = only(check_measure(file_of(system, phi=phi), how))
    if result.verdict is REFUTED:
        x, eps, image = at_witness(result, system)
        function = claim(phi, " ".join(system.variables))
        here = determinant(unit(system.dim) - eps * slope(system, x))
        there = determinant(unit(system.dim) + eps * slope(system, image))
        after, before = function_value(function, image, eps), function_value(function, x, eps)
        verify_witness(result.witness, [after * here], [before * there])
        assert after != before * determinant(kahan_jacobian(system, eps, x))
    return result


@pytest.mark.parametrize(
    ("system", "phi", "verdict"),
    [
        (LOTKA_VOLTERRA, "-3/7*eps*x*y", SUPPORTED),  # a multiple of Sanz-Serna's
        (LOTKA_VOLTERRA, "1/(x*y)", REFUTED),  # the density of dx dy / phi upside down
        (LOTKA_VOLTERRA, "x*y*(1 + eps^2/10^40*x)", REFUTED),
        (PLANE.system, "1 - 2*eps^2*q", SUPPORTED),  # the determinant written out
        (PLANE.system, "1", REFUTED),  # the flow preserves dq dp
        # phi_ij = (1 - eps^2 a_i a_j x_k^2) times another such factor: petrera-suris-euler
        (EULER_TOP, "(1 - eps^2*x2^2)*(1 + 2*eps^2*x3^2)", SUPPORTED),
        (EULER_TOP, "(1 + eps^2*x2^2)*(1 + 2*eps^2*x3^2)", REFUTED),
    ],
)
def test_a_right_density_is_supported_and_a_wrong_one_refuted(system, phi, verdict):
    finding = check_density(system, phi)
    assert finding.verdict is verdict
    assert verdict is REFUTED or int(finding.evidence.data["error_bound"].split("^")[1]) <= -100


@pytest.mark.parametrize(("eps", "verdict"), [("1", SUPPORTED), ("1/2", REFUTED), (None, REFUTED)])
def test_a_density_that_is_right_at_one_eps_is_supported_there_only(eps, verdict):
    assert check_density(PLANE.system, "1 - 2*eps*q", Settings(eps=eps, steps=2)).verdict is verdict


@pytest.mark.parametrize(
    ("phi", "variables", "message"),
    [
        ("(10*eps - 1)*x*y/(10*eps - 1)", "x y", "which is 0/0 at eps = 1/10"),
        ("x", "y x", "expected a rational function of x, y, eps"),
    ],
)
def test_what_is_no_density_is_wrong_use(phi, variables, message):
    refuses(message, check_measure, file_of(LOTKA_VOLTERRA), Settings(eps="1/10"), claim(phi, variables))


@pytest.mark.parametrize("member", MEMBERS.values(), ids=MEMBERS)
def test_the_tensor_of_a_generic_member_is_proved_and_without_the_theorem_supported(member, monkeypatch):
    assert verdicts(check_poisson(SystemFile.from_member(member), QUICK)) == [PROVED, PROVED]
    monkeypatch.setattr(theorems, "evidence", lambda theorem, hypotheses: None)
    assert verdicts(check_poisson(SystemFile.from_member(member), QUICK)) == [SUPPORTED, SUPPORTED]


def test_the_tensor_of_a_generic_hamiltonian_in_dimension_four_is_refuted():
    law, jacobi = check_poisson(file(GENERIC), QUICK).findings
    at_entry, at_triple = (map(int, re.search(r"\((.*?)\)", f.witness.left_label)[1].split(",")) for f in (law, jacobi))
    x, eps, image = at_witness(law, GENERIC.system)
    forward = unit(4) + eps * slope(GENERIC.system, image)
    backward = unit(4) - eps * slope(GENERIC.system, x)
    left = forward @ tensor(GENERIC, eps, x) @ forward.T
    right = backward @ tensor(GENERIC, eps, image) @ backward.T
    i, j = at_entry
    verify_witness(law.witness, [left[i - 1][j - 1]], [right[i - 1][j - 1]])
    jacobian = kahan_jacobian(GENERIC.system, eps, x)
    assert (jacobian @ tensor(GENERIC, eps, x) @ jacobian.T != tensor(GENERIC, eps, image)).any()
    # Pi is of degree 2 in x: the central difference is the derivative.
    assert jacobi.verdict is REFUTED
    x, (eps,) = exact(*jacobi.witness.point), exact(jacobi.witness.eps)
    moved = [[tuple(a + (i == l) * s for i, a in enumerate(x)) for s in (1, -1)] for l in range(4)]
    up, down = ([tensor(GENERIC, eps, points[k]) for points in moved] for k in (0, 1))

    def along(a, b, c):
        Pi = tensor(GENERIC, eps, x)
        return sum((Pi[a - 1][l] * (up[l] - down[l])[b - 1][c - 1] / 2 for l in range(4)), Fraction(0))

    i, j, k = at_triple
    verify_witness(jacobi.witness, [along(i, j, k) + along(j, k, i) + along(k, i, j)], [Fraction(0)])


# J has rank 2: a phase space of dimension 3 is made of planes, on each of which the theorem on dimension 2 applies.
@pytest.mark.parametrize(("dim", "verdict"), [(2, PROVED), (3, SUPPORTED)])
@given(data=st.data())
def test_in_dimension_two_the_tensor_is_proved_for_every_h_and_in_dimension_three_supported(dim, verdict, data):
    hamiltonian = data.draw(hamiltonians(dims=(dim,)))
    assume(any(entry != 0 for entry in hamiltonian.J.entries()))
    assert verdicts(check_poisson(file(hamiltonian), QUICK)) == [verdict, verdict]


def test_where_A_is_derogatory_the_tensor_is_not_proved_but_decided():
    member = random_member_with_eigenvalues([1, 1, 2], seed=3)
    # These H are sums of planar ones: the tensor is Poisson although the theorem does not say so.
    assert not member.is_generic
    assert verdicts(check_poisson(SystemFile.from_member(member), QUICK)) == [SUPPORTED, SUPPORTED]


@pytest.mark.parametrize("check", [check_measure, check_poisson])
def test_a_step_of_half_the_length_contradicts_the_theorems(check, monkeypatch):
    monkeypatch.setattr(KahanMap, "step", half_step)
    with pytest.raises(Contradiction, match="defining equation of the Kahan map"):
        check(SystemFile.from_member(MEMBERS["m=1"]), QUICK)


LYNESS = """variables = ["x", "y"]
[map]
image = ["y", "(2 + y)/x"]
inverse = ["(2 + x)/y", "x"]
"""
NESTED = """variables = ["x", "y", "z", "w"]
[system]
rhs = ["x*(y + z + w)", "y*(-x + z + w)", "z*(-x - y + w)", "w*(-x - y - z)"]
"""


def log_canonical(names, a):
    """The tensor {x_i, x_j} = a_ij x_i x_j."""
    rows = [[f"({a[i][j]})*{p}*{q}" for j, q in enumerate(names)] for i, p in enumerate(names)]
    return MatrixPoissonTensor.from_text(rows, names)


PLANAR = [[0, 1], [-1, 0]]
SIGNS = [[(j > i) - (j < i) for j in range(4)] for i in range(4)]


@pytest.mark.parametrize(
    ("text", "given", "law"),
    [
        (LYNESS, log_canonical("xy", PLANAR), SUPPORTED),
        (LYNESS, MatrixPoissonTensor.from_text([["0", "x"], ["-x", "0"]], "xy"), REFUTED),
        (NESTED, log_canonical("xyzw", SIGNS), SUPPORTED),
        (NESTED, log_canonical("xyzw", [[2 * e if {i, j} == {0, 1} else e for j, e in enumerate(row)]
                                        for i, row in enumerate(SIGNS)]), REFUTED),
    ],
)  # fmt: skip
def test_a_given_tensor_is_tried_on_any_map(text, given, law):
    assert verdicts(check_poisson(parse_system(text), QUICK, given)) == [law, SUPPORTED]


def test_a_tensor_with_denominators_is_differentiated():
    # P = (x, y, z)/|x|^2 as {x,y} = z/r^2 and so on: rot P is orthogonal to P
    r = "x^2 + y^2 + z^2"
    rows = [["0", f"z/({r})", f"-y/({r})"], [f"-z/({r})", "0", f"x/({r})"], [f"y/({r})", f"-x/({r})", "0"]]
    result = check_poisson(file_of(LORENZ), QUICK, MatrixPoissonTensor.from_text(rows, "xyz")).findings[1]
    assert result.verdict is SUPPORTED
    rows = [["0", "1/y", "0"], ["-1/y", "0", "1/(x - z)"], ["0", "1/(z - x)", "0"]]
    result = check_poisson(file_of(LORENZ), QUICK, MatrixPoissonTensor.from_text(rows, "xyz")).findings[1]
    assert result.verdict is REFUTED
    # sum_l P_1l d_l P_23 + P_2l d_l P_31 + P_3l d_l P_12, of which only P_32 d_2 P_12 is not 0
    x, y, z = exact(*result.witness.point)
    assert exact(*result.witness.left) == (1 / ((x - z) * y**2),)


def test_a_map_without_an_inverse_has_no_measure_to_judge():
    """x' = -x, y' = -y at eps = 1 sends everything to 0, where both sides of the law vanish for many phi."""
    contraction = file_of(system_of("x y", "-x", "-y"))
    phi = parse_rational_function("x", ["x", "y", "eps"])
    assert check_measure(contraction, Settings(eps=fmpq(1)), phi).verdict is Certainty.UNDECIDED
    right = parse_rational_function("x*y", ["x", "y", "eps"])
    assert check_measure(contraction, Settings(eps=fmpq(1, 2)), right).holds is True
    assert check_measure(contraction, Settings(eps=fmpq(1, 2)), phi).verdict is REFUTED


def test_a_proof_of_something_false_is_contradicted_by_the_computation(monkeypatch):
    false = theorems.evidence("a theorem that does not apply", [("nothing", True)])
    monkeypatch.setattr(preserve.theorems, "poisson_tensor_invariant", lambda hamiltonian, member: false)
    refuses("a theorem that does not apply", check_poisson, file(GENERIC), QUICK, error=Contradiction)


# Tensors that are 0


@pytest.mark.parametrize(
    ("entry", "eps", "message"),
    [
        ("0", None, "found the tensor P = 0, expected one that is not zero: every map preserves 0"),
        ("(10*eps - 1)*(x + y^7)", "1/10", "which is identically 0 at eps = 1/10, expected one that is not zero"),
        ("a*x", None, "found the tensor P = 0"),
        ("x*(a + 10*eps - 1)", "1/10", "identically 0 at eps = 1/10"),
    ],
)
def test_a_tensor_that_is_0_at_the_eps_and_parameters_in_force_is_wrong_use(entry, eps, message, tmp_path):
    rows, how = [["0", entry], [f"-({entry})", "0"]], Settings(eps=eps, steps=1)
    file = parse_system('variables = ["x", "y"]\n[parameters]\na = "0"\n[system]\nrhs = ["x*(1 - y)", "y*(x - 1)"]\n')
    refuses(message, check_poisson, file, how, rows)
    path = tmp_path / "p.toml"
    path.write_text(f'[poisson]\ntensor = [["0", "{entry}"], ["-({entry})", "0"]]\n')
    refuses(message, check_poisson, file, how, MatrixPoissonTensor.read(path, file.variables, file.parameters))


@pytest.mark.parametrize(
    ("entry", "eps", "condition", "verdict"),
    [
        ("(10*eps - 1)*x*y", None, ", where 10*eps - 1 is not 0", SUPPORTED),
        ("(10*eps - 1)*x*y", "1/9", "", SUPPORTED),
        ("(10*eps - 1)*(x + y^7)", "1/9", "", REFUTED),
        ("x*y/(10*eps - 1)", None, ", where 10*eps - 1 is not 0", SUPPORTED),
        ("x*y/(10*eps - 1)", "1/10", "", UNDECIDED),  # no values
    ],
)
def test_the_claim_says_where_a_tensor_is_not_0(entry, eps, condition, verdict):
    rows = [["0", entry], [f"-({entry})", "0"]]
    law, jacobi = check_poisson(file_of(LOTKA_VOLTERRA), Settings(eps=eps, steps=1), rows).findings
    assert (law.claim, law.verdict) == (f"the Kahan map is Poisson for P{condition}", verdict)
    assert jacobi.claim == f"P is a Poisson tensor{condition}"


def test_of_the_tensor_0_of_a_hamiltonian_system_nothing_is_proved():
    zero = hamiltonian_of("x y", "x^3", [["0", "0"], ["0", "0"]])
    assert verdicts(check_poisson(SystemFile.from_hamiltonian(zero), QUICK)) == [UNDECIDED, UNDECIDED]
    saddle = SystemFile.from_hamiltonian(hamiltonian_of("q p", "q*p"))  # Pi = (1 - eps^2) J
    assert verdicts(check_poisson(saddle, Settings(eps=1, steps=1))) == [UNDECIDED, UNDECIDED]
    assert verdicts(check_poisson(saddle, Settings(eps=2, steps=1))) == [PROVED, PROVED]
