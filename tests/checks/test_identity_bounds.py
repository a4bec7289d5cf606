"""Bounds of identities and broken claims, against their two sides written out as rational functions of x and eps."""

import random

import pytest
from check_helpers import check, claim, covers_polynomial, differences, hamiltonians, lowest, system_of, true_size
from flint import fmpq
from helpers import HENON_HEILES, LOTKA_VOLTERRA, quick, rationals, systems
from hypothesis import given
from hypothesis import strategies as st
from paper.members import member, verifier_of

from kahanmaps.algebra.bounds import CoefficientSize
from kahanmaps.algebra.polynomials import monomials, ring
from kahanmaps.checks.commute import commutativity
from kahanmaps.checks.conserve import conservation
from kahanmaps.checks.preserve import density_identity, jacobi_identity, transformation_identity
from kahanmaps.invariants.integrals_and_densities import ClaimedDensity, ClaimedIntegral, DeterminantDensity
from kahanmaps.invariants.poisson import HamiltonianTensor
from kahanmaps.maps.kahan import KahanFamily
from kahanmaps.paper import specialize
from kahanmaps.paper.controls import broken
from kahanmaps.paper.registry import ClaimKind, claims
from kahanmaps.paper.verify import ClaimAtPoints
from kahanmaps.systems.quadratic import QuadraticSystem

some_eps = st.one_of(st.none(), rationals(6).filter(lambda eps: eps != 0))


@given(st.sampled_from([1, 2]), st.data(), some_eps)
def test_commutativity_is_bounded(n, data, eps):
    f, g = (data.draw(systems(dims=(n,))) for _ in range(2))
    check(commutativity(f, g, eps, ("f", "g")))


@pytest.mark.parametrize("seed", range(2))
def test_commutativity_is_bounded_for_dense_systems_and_not_far_from_the_truth(seed):
    rng = random.Random(seed)

    def dense():
        rhs = ring(["x", "y"])
        exponents = [e for d in range(3) for e in monomials(2, d)]
        rows = [{e: fmpq(rng.randint(-99, 99), rng.randint(1, 9)) for e in exponents} for _ in range(2)]
        return QuadraticSystem([rhs.from_dict(row) for row in rows])

    identity = commutativity(dense(), dense(), None if seed % 2 else fmpq(rng.randint(1, 9), 7), ("f", "g"))
    equation, poles = check(identity, differs=True)
    largest = max(true_size(above)[0] for above, _ in differences(identity))
    assert largest <= equation.degree <= 4 * largest
    assert poles <= 2 * equation.degree


# One large row, one large part of a row, large denominators: nothing makes up for a row that is left out.
LOPSIDED = [
    system_of("x", "10^30*x^2"),
    system_of("x y", "x + y", "10^30*x*y"),
    system_of("x y", "10^30*(x - y)", "y^2"),
    system_of("x y", "1", "10^30"),
    system_of("x y", "x/(10^30 + 57)", "y/(10^15 + 37)"),
]


@pytest.mark.parametrize("eps", [None, fmpq(10**20, 3)])
@pytest.mark.parametrize("system", LOPSIDED)
def test_a_system_with_one_large_part_is_bounded(system, eps):
    other = system_of("x", "x^2 + 1") if system.dim == 1 else LOTKA_VOLTERRA
    check(commutativity(system, other, eps, ("f", "g")))
    function = ClaimedIntegral("I", claim("(x^2 + 1)/(x + eps)", " ".join(system.variables)))
    check(conservation(system, function, eps), differs=True)


def test_a_smaller_size_would_not_bound_the_difference():
    identity = conservation(HENON_HEILES, ClaimedIntegral("I", claim("q1", "q1 q2 p1 p2")), None)
    ((above, _),) = differences(identity)
    degree, bits = true_size(above)
    assert covers_polynomial(identity.bound[0], above)
    assert not covers_polynomial(CoefficientSize(degree - 1, identity.bound[0].bits), above)
    assert not covers_polynomial(CoefficientSize(identity.bound[0].degree, bits - 0.01), above)


# Of another system, so that the two sides differ.
CLAIMS = ["x^2/3 + eps*y", "x*y/(2*x - 3/5*y) + eps/7", "1/(x^3 + eps^4*y)"]


@pytest.mark.parametrize("eps", [None, fmpq(10**9 + 7, 998244353)])
@pytest.mark.parametrize("text", CLAIMS)
def test_conservation_of_a_claimed_function_is_bounded(text, eps):
    check(conservation(LOTKA_VOLTERRA, ClaimedIntegral("I", claim(text, "x y")), eps), differs=True)


@pytest.mark.parametrize("eps", [None, fmpq(-3, 7)])
@pytest.mark.parametrize("text", [None, *CLAIMS])
def test_invariance_of_a_density_is_bounded(text, eps):
    density = DeterminantDensity(LOTKA_VOLTERRA) if text is None else ClaimedDensity(claim(text, "x y"))
    check(density_identity(LOTKA_VOLTERRA, density, eps), differs=True)


@given(hamiltonians(dims=(1, 2)), some_eps)
def test_the_transformation_law_is_bounded(hamiltonian, eps):
    check(transformation_identity(KahanFamily(hamiltonian.system), HamiltonianTensor(hamiltonian), eps))


@given(hamiltonians(dims=(3,)), some_eps)
def test_the_jacobi_identity_is_bounded(hamiltonian, eps):
    check(jacobi_identity(HamiltonianTensor(hamiltonian), eps))


def is_short(claim):
    """Whether it speaks of x and two more vectors at most: equations for systems of many letters are too long here."""
    bounds = specialize.bound_objects(member("m=1"), None, 3)
    for _ in claim.function(bounds):
        pass
    return len(bounds.used - {"roots"}) <= 3


BROKEN = [
    (claim, control)
    for claim in claims()
    if claim.kind is ClaimKind.EQUAL and claim.makes_sense(1) and is_short(claim)
    for control in claim.controls
    if control in ("eps", "map", "B")
]


# What the Hesse cubics amount to is long.
@pytest.mark.parametrize("is_long", quick([False, True], [False]))
def test_the_equation_that_a_broken_claim_amounts_to_is_bounded(is_long, monkeypatch):
    result = member("m=1")
    examined = verifier_of(result)
    for broken_claim, control in BROKEN:
        if (broken_claim.key == "hesse-cubics") is not is_long:
            continue
        bounds = broken(control, specialize.bound_objects(result, None, 3))
        monkeypatch.setattr(examined, "bounds", lambda bounds=bounds: bounds)
        statement = ClaimAtPoints(examined, broken_claim)
        needs, (equation, poles) = statement.used_names, statement.bound
        functions = specialize.member_functions(result, sorted(needs - {"roots"}), None, 10**9, 3)
        pairs = (left - right for left, right in broken_claim.function(broken(control, functions)))
        entries = [x for pair in pairs for x in (pair.entries() if hasattr(pair, "entries") else [pair])]
        for above, below in (lowest(entry) for entry in entries if not entry.numerator.is_zero()):
            assert true_size(above)[0] <= equation.degree, (broken_claim.key, control)
            # A denominator that occurs to some power must not be zero once.
            assert sum(true_size(factor)[0] for factor, _ in below.factor_squarefree()[1]) <= poles, broken_claim.key
            assert true_size(above)[1] <= equation.bits, (broken_claim.key, control)
