"""Theorems presuppose that the map exists: where det(I - eps f'(x)) is zero for all x, nothing is proved.

For H = q p the determinant is 1 - eps^2, so at eps = 1 and eps = -1 the Kahan map is defined nowhere.
"""

import pytest
from flint import fmpq, fmpq_mat

from kahanmaps import (
    CubicHamiltonian,
    KahanMap,
    Settings,
    SystemFile,
    check_commute,
    check_integrals,
    check_measure,
    check_poisson,
    parse_polynomial,
    standard_structure,
)
from kahanmaps.algebra.fields import QQ
from kahanmaps.checks.theorems import commutant_integral
from kahanmaps.family.random_members import random_member_with_eigenvalues
from kahanmaps.invariants.phase_functions import CommutantIntegral

SADDLE = SystemFile.from_hamiltonian(
    CubicHamiltonian(parse_polynomial("q*p", ["q", "p"]), standard_structure(2)), "saddle"
)
CHECKS = [check_integrals, check_measure, check_poisson, lambda file, settings: check_commute(file, file, settings)]


@pytest.mark.parametrize("check", CHECKS, ids=["integrals", "measure", "poisson", "commute"])
def test_nothing_is_proved_of_a_map_without_values(check):
    report = check(SADDLE, Settings(eps="-1", steps=2))
    assert report.findings[0].verdict == "undecided"
    assert report.holds is None
    assert "not defined at any" in report.findings[0].evidence.summary
    assert check(SADDLE, Settings(eps="1/2", steps=2)).verdict == "proved"


def test_the_commutant_lemma_asks_for_the_standard_structure():
    member = random_member_with_eigenvalues([1, 2], seed=1)
    standard = member.chosen.hamiltonian
    other = CubicHamiltonian(standard.H, standard.J * 2)
    assert commutant_integral(standard, CommutantIntegral(standard, member.A, 1), "A^T") is not None
    assert commutant_integral(other, CommutantIntegral(other, member.A, 1), "A^T") is None


def test_the_commutant_lemma_asks_for_a_homogeneous_cubic():
    """Two planes side by side, H = q1^3 + q1 p1^2 + q2 p2: A commutes with f', and x^T J A^T x~ is not conserved."""
    A = fmpq_mat(4, 4, [1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2])
    H = parse_polynomial("q1^3 + q1*p1^2 + q2*p2 + p1", ["q1", "q2", "p1", "p2"])
    hamiltonian = CubicHamiltonian(H, standard_structure(4))
    jacobian = hamiltonian.system.over(QQ).jacobian([fmpq(2), fmpq(3), fmpq(5), fmpq(7)])
    assert A.transpose() * jacobian == jacobian * A.transpose()
    integral = CommutantIntegral(hamiltonian, A, 1)
    assert commutant_integral(hamiltonian, integral, "A^T") is None
    kahan = KahanMap(hamiltonian.system, "1/7")
    x = kahan.point([1, 2, 3, 4])
    values = [integral.value(QQ, kahan.eps, point) for point in (x, kahan.step(x))]
    assert values[0] != values[1]
