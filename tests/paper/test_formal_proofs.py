"""The formal proofs of (5)-(12) hold, and each fails if one hypothesis is dropped."""

import random
from fractions import Fraction

import pytest

from kahanmaps.paper import formal_proofs
from kahanmaps.paper.formal_proofs import EPS, Expression, Multilinear, X, Y, letter
from kahanmaps.paper.registry import claims

PROOFS = {claim.key: claim.formal for claim in claims() if claim.formal is not None}
WITHOUT_SYMMETRY = Multilinear("Q")


def fails(pairs):
    return any(left != right for left, right in pairs)


def test_the_five_claims_about_any_system_have_formal_proofs():
    assert set(PROOFS) == {
        "any-quadratic-system",
        "any-homogeneous-system",
        "jacobi-matrix-of-any-map",
        "integral-of-any-hamiltonian-system",
        "measure-of-any-hamiltonian-system",
    }


@pytest.mark.parametrize("key", PROOFS)
def test_every_identity_of_a_formal_proof_holds(key):
    pairs = list(PROOFS[key]())
    assert pairs
    assert not fails(pairs)


@pytest.mark.parametrize(
    ("proof", "broken"),
    [
        (formal_proofs.map_of_any_quadratic_system, {"Q": WITHOUT_SYMMETRY}),
        (formal_proofs.map_of_any_homogeneous_system, {"Q": WITHOUT_SYMMETRY}),
        (formal_proofs.jacobian_of_any_map, {"Q": WITHOUT_SYMMETRY}),
        (formal_proofs.integral_of_any_cubic, {"T": Multilinear("T")}),
        (formal_proofs.integral_of_any_cubic, {"skew": Multilinear("G", symmetry=1)}),
        (formal_proofs.measure_of_any_hamiltonian_map, {"sign_of_transpose": 1}),
    ],
)
def test_a_formal_proof_fails_without_one_hypothesis(proof, broken):
    assert fails(proof(**broken))


def test_a_skew_map_changes_sign_and_vanishes_on_equal_arguments():
    skew = Multilinear("A", symmetry=-1)
    assert skew(X, Y) == skew(Y, X) * -1
    assert skew(X, X) == Expression({})
    assert skew(X + Y, X + Y) == Expression({})
    assert skew(X, Y) != Expression({})


def test_expressions_agree_with_matrices_in_coordinates():
    """A bilinear expression is evaluated on rational 2x2 matrices and vectors before and after it is expanded."""
    rng = random.Random(1)
    form = [[Fraction(rng.randint(-9, 9)) for _ in range(2)] for _ in range(2)]
    form[1][0] = form[0][1]
    values = {name: [Fraction(rng.randint(-9, 9), 7) for _ in range(2)] for name in "xyv"}
    eps = Fraction(3, 5)

    def of(term):
        u, v = (values[argument[0]] for argument in term[1:])
        return sum(u[i] * form[i][k] * v[k] for i in range(2) for k in range(2))

    def coefficient(polynomial):
        return sum(Fraction(int(c.p), int(c.q)) * eps**k for k, c in enumerate(polynomial.coeffs()))

    expanded = Multilinear("Q", symmetry=1)(X * 2 + Y * EPS, letter("v") - X * (EPS * EPS))
    u = [2 * a + eps * b for a, b in zip(values["x"], values["y"], strict=True)]
    w = [a - eps**2 * b for a, b in zip(values["v"], values["x"], strict=True)]
    direct = sum(u[i] * form[i][k] * w[k] for i in range(2) for k in range(2))
    assert sum(of(term) * coefficient(c) for term, c in expanded.coefficients.items()) == direct
