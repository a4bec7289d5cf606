"""Systems and claims made of the primes that another run drew gain nothing: what is drawn follows the question.

Euler's top with y z + N x^2 for y z is integrable modulo every prime that divides N, and over Q it is not: its degrees
grow like those of a map with one integral, and the second integral of the top is lost. N is made of all primes that
the same command drew, with the same seed, for the system before.
"""

from itertools import product
from math import prod

import pytest
from flint import fmpq

from kahanmaps import QuadraticSystem, check_commute, check_integrals, find_integrals, parse_rational_function
from kahanmaps.algebra.chance import derive_seed
from kahanmaps.algebra.parsing import parse_polynomial
from kahanmaps.algebra.polynomials import ring
from kahanmaps.checks.commute import commutativity
from kahanmaps.checks.conserve import conservation
from kahanmaps.checks.preserve import density_identity, jacobi_identity, transformation_identity
from kahanmaps.checks.settings import Settings
from kahanmaps.invariants.integrals_and_densities import ClaimedDensity, ClaimedIntegral, ModifiedHamiltonian
from kahanmaps.invariants.poisson import HamiltonianTensor
from kahanmaps.laboratory.growth.degrees import degree_growth
from kahanmaps.laboratory.preserve.darboux import affine_functions
from kahanmaps.maps.kahan import KahanFamily
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure

ROUNDS = 2


def top(N: int) -> QuadraticSystem:
    return QuadraticSystem.from_text(["x", "y", "z"], [f"y*z + {N}*x^2", "-2*z*x", "x*y"])


def test_degrees_are_not_those_of_a_system_made_for_its_primes():
    N = 1
    for _ in range(ROUNDS):
        growth = degree_growth(top(N), max_terms=7)
        assert growth.degrees[:6] == (1, 3, 9, 23, 57, 139)
        N = prod(growth.primes)


def test_integrals_are_not_those_of_a_system_made_for_its_primes():
    N = 0
    counts = []
    for _ in range(ROUNDS + 1):
        search = find_integrals(top(N), max_degree=2)
        counts.append(len(search.integrals))
        N = prod(search.primes)
    assert counts == [2] + [1] * ROUNDS


def test_no_invariant_line_hides_parallel_to_the_line_that_was_drawn_for_another_system(monkeypatch):
    # Invariant lines are read off from where a random line meets them; a x + b y = 7 is invariant here.
    directions = []

    def watched(local, start, direction, free, known=affine_functions._interpolate_determinant):
        directions.append(direction)
        return known(local, start, direction, free)

    monkeypatch.setattr(affine_functions, "_interpolate_determinant", watched)
    a, b = 2, 3
    for _ in range(ROUNDS + 1):
        line, first = f"({a}*x + ({b})*y - 7)", "(y^2 + x + 1)"
        system = QuadraticSystem.from_text(["x", "y"], [first, f"({line}*(x + 1) - ({a})*{first})/({b})"])
        polynomials = affine_functions.affine_darboux(system)
        assert [entry.function.degrees() for entry in polynomials.functions] == [(1, 1)]
        assert polynomials.complete
        a, b = directions[-1][1], -directions[-1][0]


def primes_of(report) -> int:
    """The product of all primes at which the claims of a report were tried."""
    evidence = [entry for finding in report.findings for entry in (finding.evidence, *finding.also)]
    return prod(int(p) for entry in evidence for p in entry.data.get("primes", ()))


@pytest.mark.parametrize("seed", [0, 5])
def test_claims_made_of_the_primes_of_others_are_refuted(seed):
    f = QuadraticSystem.from_text(["x", "y"], ["x^2 + x", "y^2 - y"])
    settings = Settings(seed=seed, steps=2)
    N = M = 0
    for k in range(ROUNDS + 1):
        claim = parse_rational_function(f"(y^2 + 2*z^2)/(1 + 2*eps^2*x^2) + {N}*x", ["x", "y", "z", "eps"])
        integral = check_integrals(top(0), settings, {"I": claim})
        g = QuadraticSystem.from_text(["x", "y"], [f"x^2 + x + {M}*x*y", "y - y^2"])
        commuting = check_commute(f, g, settings)
        assert str(integral.verdict) == str(commuting.verdict) == ("refuted" if k else "proved")
        N, M = primes_of(integral) or N + 1, primes_of(commuting) or M + 1


def claimed(text: str) -> ClaimedIntegral:
    return ClaimedIntegral("I", parse_rational_function(text, ["x", "y", "eps"]))


F, G = (QuadraticSystem.from_text(["x", "y"], [first, "y^2"]) for first in ("x^2 + y", "x^2 + 2*y"))
EPS = (None, fmpq(1, 10))
J = standard_structure(2)
H, K = (CubicHamiltonian(parse_polynomial(text, ["x", "y"]), J) for text in ("x^3 + y^2", "x^3 + 2*y^2"))
LIKE_EACH_OTHER = {
    "integrals": [conservation(f, claimed(I), eps) for f, I, eps in product((F, G), ("x", "x + eps"), EPS)],
    "modified Hamiltonians": [conservation(F, ModifiedHamiltonian(h), None) for h in (H, K)],
    "densities": [
        density_identity(f, ClaimedDensity(claimed(phi).function), eps)
        for f, phi, eps in product((F, G), ("x", "1/x"), EPS)
    ],
    "maps": [commutativity(f, g, eps, ("f", "g")) for f, g, eps in product((F, G), (F, G), EPS)],
    "Poisson tensors": [
        transformation_identity(KahanFamily(h.system), HamiltonianTensor(h), eps) for h, eps in product((H, K), EPS)
    ],
    "Jacobi": [jacobi_identity(HamiltonianTensor(h), eps) for h, eps in product((H, K), EPS)],
}


@pytest.mark.parametrize("kind", LIKE_EACH_OTHER)
def test_identities_that_differ_in_anything_have_points_of_their_own(kind):
    identities = LIKE_EACH_OTHER[kind]
    assert len({identity.seed(0) for identity in identities}) == len(identities)
    assert identities[0].seed(0) != identities[0].seed(1)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (("xy",), ("x", "y")),
        ((("x",), "y"), ("x", ("y",))),
        ((1,), ("1",)),
        ((None,), ("None",)),
        ((), ((),)),
        ((ring(["x", "y"]).gens()[0],), (ring(["y", "x"]).gens()[1],)),
        (([1, 2], 3), ([1], 2, 3)),
    ],
)
def test_subjects_that_differ_have_seeds_that_differ(first, second):
    assert derive_seed(0, *first) != derive_seed(0, *second)


def test_a_subject_of_a_kind_whose_text_might_leave_something_out_is_refused():
    with pytest.raises(TypeError, match="found a float"):
        derive_seed(0, 0.5)
