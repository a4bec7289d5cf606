"""Constant Hamiltonian structures: those of the catalogue, of random systems, none where there is none, and what
theorems give.
"""

from itertools import combinations

import pytest
from flint import fmpq, fmpq_mat
from helpers import LORENZ, random_point
from hypothesis import given, settings
from hypothesis import strategies as st
from search_helpers import system, values_on_orbits

from kahanmaps import QQ, Certainty, KahanMap, Laboratory, Orbit, QuadraticSystem, find_integrals, load
from kahanmaps.algebra.matrices import rank
from kahanmaps.algebra.polynomials import gradient, linear_combinations, monomials, ring
from kahanmaps.invariants.integrals_and_densities import DeterminantDensity, ModifiedHamiltonian
from kahanmaps.laboratory.preserve.poisson.hamiltonian_structure import (
    ConstantStructures,
    constant_structures,
    inherited_integrals,
)
from kahanmaps.systems.hamiltonian import CubicHamiltonian


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
        (system("x y z s t", "x^2 + y", "y^2", "x*y", "0", "0").system, False, ""),
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
    for i, j in combinations(range(n), 2):
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


# x' and y' are those of a cubic H(x, y), z' is anything: K f = grad H with a K of rank 2 in dimension 3.
DRIVEN = system("x y z", "x^2 + 2*x*y + 3*y + 1", "-2*x*y - y^2 + 4*x^2 + x + 7", "x*z + y^2 + z^2 - 5*x + 2")
# f = J grad H with a J of rank 4 in dimension 6, and H of degree 3 in all variables
DEGENERATE = system(
    "q1 q2 p1 p2 z w", "p1 + 2*q1*z", "p2 + q1^2", "-3*q1^2 - 2*p1*z - 2*q1*p2 + w", "-q2*z + w^2", "0", "0"
)
CASES = [
    (load("lv(8,2)"), 1, 1),
    (load("lv(5,0)"), 1, 0),
    (DRIVEN, 0, 1),
    (DEGENERATE, 2, 1),
    (load("paper_m3"), 0, 3),
    (load("euler_top"), 0, 0),
]


@pytest.mark.parametrize(("file", "affine", "modified"), CASES)
def test_the_numbers_of_integrals_that_theorems_give(file, affine, modified):
    integrals = inherited_integrals(file.system)
    assert (len(integrals.quotient.integrals), len(integrals.forms)) == (affine, modified)
    assert [integrals.count(map_) for map_ in Laboratory(file).maps] == [affine + modified] * 2


@pytest.mark.parametrize("file", [DRIVEN, DEGENERATE])
def test_modified_hamiltonians_are_constant_along_exact_orbits_also_for_a_singular_form(file):
    result, eps = inherited_integrals(file.system), fmpq(1, 9)
    points = [point.x for point in Orbit(KahanMap(file.system, eps), random_point(file.dim, 3), 3)]
    assert len(points) == 4
    for k, form in enumerate(result.forms):
        assert len({result.modified(k, QQ, eps, x) for x in points}) == 1
        assert len({result.hamiltonian(k)(*x) for x in points}) > 1  # H itself is not conserved
        assert form.transpose() == form * -1


@pytest.mark.parametrize("eps", [None, "1/9"])
def test_what_a_theorem_gives_is_written_out_where_relations_show_nothing(eps):
    (entry,) = find_integrals(DRIVEN, eps=eps, max_degree=1).integrals
    assert (entry.origin, entry.verdict) == ("modified Hamiltonian (cmoq-2013)", Certainty.PROVED)
    values = values_on_orbits(DRIVEN, entry.text, ["1/9"])
    assert [len(each) for each in values] == [1, 1, 1]
    assert len(set().union(*values)) > 1


def test_no_search_reports_fewer_integrals_than_theorems_give():
    """Relations of degree 1 show the affine integrals only; a product of invariant hyperplanes is found beside them."""
    search = find_integrals(load("lv(6,2)"), max_degree=1)
    assert search.codimension == search.by_theorems + 1 > search.profile.codimension
    assert not search.is_exact
    assert search.count_text.startswith("there are at least 3 in all (2 by theorems: ")
    as_json = search.to_json()
    assert [as_json[key] for key in ("codimension", "by_theorems", "codimension_is_exact")] == [3, 2, False]


def test_with_symbols_theorems_are_asked_at_random_values():
    file = system("x y z", "y + a*x^2", "-2*a*x*y - x", "x*z + b", a="1", b="0")
    search = find_integrals(file, symbols=["a", "b"], max_degree=1)
    assert (search.by_theorems, search.codimension, search.integrals) == (1, 1, ())
    assert "1 of the 1 independent integrals has no closed form" in search.reason
    assert "1 by theorems: 1 modified Hamiltonian, at random values of a, b" in search.count_text
    # x' has no y at a = 0: what holds there only is no theorem for every a
    special = system("x y", "x*y", "-x*y + a*x", a="0")
    assert find_integrals(special, symbols=["a"], max_degree=2).by_theorems == 0
    assert find_integrals(special, max_degree=2).by_theorems == 1
