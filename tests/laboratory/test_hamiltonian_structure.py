"""Constant Hamiltonian structures: those of the catalogue, of random systems, and none where there is none."""

import pytest
from flint import fmpq, fmpq_mat
from helpers import LORENZ, random_point
from hypothesis import given, settings
from hypothesis import strategies as st

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.matrices import rank
from kahanmaps.algebra.polynomials import gradient, linear_combinations, monomials, ring
from kahanmaps.documents.catalog import load
from kahanmaps.invariants.phase_functions import DeterminantDensity, ModifiedHamiltonian
from kahanmaps.laboratory.preserve.poisson.hamiltonian_structure import ConstantStructures, constant_structures
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.systems.hamiltonian import CubicHamiltonian
from kahanmaps.systems.quadratic import QuadraticSystem


def checked(system: QuadraticSystem) -> ConstantStructures:
    """What is found, after checking every claim of it exactly."""
    structures = constant_structures(system)
    for K, H in zip(structures.forms, structures.functions, strict=True):
        assert linear_combinations(K, system.rhs) == gradient(H)
    if structures.hamiltonian is None:
        assert structures.reason
        assert structures.casimirs == ()
        return structures
    assert structures.reason == ""
    assert structures.hamiltonian.system.rhs == system.rhs
    J = structures.hamiltonian.J
    assert len(structures.casimirs) == system.dim - rank(QQ, J)
    for casimir in structures.casimirs:
        slopes = fmpq_mat([[slope.leading_coefficient() for slope in gradient(casimir)]])
        assert all(entry == 0 for entry in (slopes * J).entries())
        assert linear_combinations(slopes, system.rhs)[0].is_zero()
    return structures


def conserved(structures: ConstantStructures, seed: int = 1) -> bool:
    """Whether the Kahan map conserves the integral and the measure at one exact point."""
    integral, density = ModifiedHamiltonian(structures.hamiltonian), DeterminantDensity(structures.system)
    eps = fmpq(1, 9)
    phi = KahanMap(structures.system, eps)
    x = random_point(structures.system.dim, seed)
    if phi.determinant(x) == 0 or phi.determinant(phi.step(x)) == 0:
        return True
    image = phi.step(x)
    same = integral.value(QQ, eps, x) == integral.value(QQ, eps, image)
    return same and density.value(QQ, eps, image) == density.value(QQ, eps, x) * phi.jacobian(x).det()


@pytest.mark.parametrize("name", ["henon_heiles", "planar_cubic_hamiltonian", "paper_m2"])
def test_the_hamiltonian_systems_of_the_catalogue(name: str) -> None:
    file = load(name)
    known = file.hamiltonian
    assert known is not None
    report = checked(file.system)
    assert report.hamiltonian is not None
    assert report.hamiltonian.is_standard == known.is_standard
    if known.is_standard:
        assert (report.hamiltonian.H - known.H).is_constant()
    assert report.casimirs == ()
    assert conserved(report)


def test_degenerate_structures() -> None:
    for name in ("dressing_chain_3", "volterra_periodic_3"):
        report = checked(load(name).system)
        assert [str(casimir) for casimir in report.casimirs] == ["x1 + x2 + x3"]
        assert conserved(report)
    assert report.hamiltonian is not None
    assert str(report.hamiltonian.H) == "-x1*x2*x3"
    assert report.hamiltonian.J == fmpq_mat([[0, 1, -1], [-1, 0, 1], [1, -1, 0]])


@pytest.mark.parametrize(
    ("system", "proved", "words"),
    [
        (LORENZ, True, "no affine integral"),
        (load("volterra_periodic_4").system, True, "impossible for a skew"),
        # The dimension is odd, and of the two integrals every combination might span the kernel.
        (QuadraticSystem.from_text(["x", "y", "z", "s", "t"], ["x^2 + y", "y^2", "x*y", "0", "0"]), False, ""),
    ],
)
def test_systems_without_a_constant_structure_say_why(system, proved, words) -> None:
    report = checked(system)
    assert (report.hamiltonian, report.proved) == (None, proved)
    assert words in report.reason


@st.composite
def hamiltonians(draw: st.DrawFn) -> CubicHamiltonian:
    """A random cubic H and a random skew J, perhaps singular."""
    n = draw(st.integers(1, 5))
    context = ring([f"x{i}" for i in range(n)])
    exponents = [m for d in range(1, 4) for m in monomials(n, d)]
    terms = draw(st.dictionaries(st.sampled_from(exponents), st.integers(-5, 5).filter(bool), max_size=12))
    J = fmpq_mat(n, n)
    for i in range(n):
        for j in range(i):
            J[i, j] = draw(st.integers(-3, 3))
            J[j, i] = -J[i, j]
    return CubicHamiltonian(context.from_dict({m: fmpq(c) for m, c in terms.items()}), J)


@settings(max_examples=20)
@given(hamiltonians(), st.integers(0, 50))
def test_random_structures(hamiltonian: CubicHamiltonian, seed: int) -> None:
    report = checked(hamiltonian.system)
    if hamiltonian.J.det() != 0:
        assert report.hamiltonian is not None
        assert report.casimirs == ()
    if report.hamiltonian is None:
        assert not report.proved  # there is one, with a kernel that was not tried
    else:
        assert conserved(report, seed)
