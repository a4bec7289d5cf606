"""`Size` bounds the polynomials behind an identity, in degree and in the sum of their absolute coefficients.

In low dimension the polynomials can be written out: the Kahan map is carried along as numerators X over one
denominator W, polynomials in x (and in eps, unless it is a number), by Cramer's rule with determinants from their
definition. The bounds have to hold for these polynomials, and for generic systems the degrees have to be attained.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from itertools import permutations
from typing import Any

import pytest
from check_helpers import claim, hamiltonian_of, hamiltonians, system_of
from flint import fmpq, fmpq_mat, fmpq_mpoly, fmpz
from helpers import HENON_HEILES, LOTKA_VOLTERRA, matrices, rationals, systems
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from kahanmaps.algebra.polynomials import RationalFunction, common_denominator, degree, monomials, ring
from kahanmaps.checks.commute import commutativity
from kahanmaps.checks.conserve import conservation
from kahanmaps.checks.preserve import density_identity, jacobi_identity, transformation_identity
from kahanmaps.invariants import poisson
from kahanmaps.invariants.integrals import ClaimedIntegral, CommutantIntegral, ModifiedHamiltonian, PaperIntegral
from kahanmaps.invariants.measures import ClaimedDensity, DeterminantDensity
from kahanmaps.invariants.sizes import (
    ONE,
    VARIABLE,
    Size,
    determinant_size,
    eps_size,
    function_size,
    polynomial_size,
    step_size,
)
from kahanmaps.invariants.sizes import Fraction as SizeFraction
from kahanmaps.systems.hamiltonian import CubicHamiltonian
from kahanmaps.systems.quadratic import QuadraticSystem

few = settings(max_examples=25)

# A Size is a float, rounded at every operation.
ROUNDING = 1e-6

GENERIC = system_of("x y", "x^2 + 3*x*y - y^2 + x + 1", "2*x^2 - x*y + 5*y^2 - y + 2")

some_eps = st.one_of(st.none(), rationals(6).filter(lambda eps: eps != 0))


class Written:
    """Everything written out in one ring: x1, ..., xn and, for an indeterminate eps, e."""

    def __init__(self, system: QuadraticSystem, eps: fmpq | None) -> None:
        n = system.dim
        names = [f"x{i + 1}" for i in range(n)]
        self.ring = ring([*names, "e"] if eps is None else names)
        self.n, self.system = n, system
        self.x = tuple(self.ring.gens()[:n])
        self.one = self.ring.constant(1)
        self.p = self.ring.gens()[n] if eps is None else self.ring.constant(eps.p)
        self.q = self.one if eps is None else self.ring.constant(eps.q)
        entries = [2 * entry for form in system.Q for entry in form.entries()]
        entries += [*system.B.entries(), *system.c]
        self.L = fmpz(1)
        for entry in entries:
            self.L = self.L.lcm(entry.q)

    def slope(self, X: Sequence[Any], W: Any) -> list[list[Any]]:
        """L W f'(X / W)."""
        n, system, zero = self.n, self.system, self.ring.constant(0)
        return [
            [
                sum((2 * self.L * system.Q[i][j, k] * X[k] for k in range(n)), zero) + self.L * system.B[i, j] * W
                for j in range(n)
            ]
            for i in range(n)
        ]

    def matrix(self, X: Sequence[Any], W: Any, sign: int = -1) -> list[list[Any]]:
        """q L W (I + sign eps f'(X / W))."""
        slope = self.slope(X, W)
        return [
            [(self.q * self.L * W if i == j else 0 * self.one) + sign * self.p * slope[i][j] for j in range(self.n)]
            for i in range(self.n)
        ]

    def step(self, X: Sequence[Any], W: Any) -> tuple[list[Any], Any]:
        """Numerators and denominator of the image of X / W, nothing cancelled."""
        matrix, right = self.matrix(X, W), []
        for i in range(self.n):
            entry = self.q * self.L * X[i] + 2 * self.p * self.L * self.system.c[i] * W
            for j in range(self.n):
                entry = entry + self.p * self.L * self.system.B[i, j] * X[j]
            right.append(entry)
        above = []
        for j in range(self.n):
            above.append(
                leibniz([[right[i] if k == j else matrix[i][k] for k in range(self.n)] for i in range(self.n)])
            )
        return above, leibniz(matrix)

    def value(self, polynomial: fmpq_mpoly, X: Sequence[Any], W: Any, total: int | None = None) -> Any:
        """W^total polynomial(X / W), times the common denominator of its coefficients."""
        below = common_denominator(polynomial)
        weight = max(degree(polynomial), 0) if total is None else total
        found = self.ring.constant(0)
        for monomial, coefficient in polynomial.terms():
            term = below * coefficient * W ** (weight - sum(monomial))
            for entry, exponent in zip(X, monomial, strict=True):
                term = term * entry**exponent
            found = found + term
        return found


def leibniz(matrix: list[list[Any]]) -> Any:
    """The determinant, as it is defined."""
    n = len(matrix)
    total = 0 * matrix[0][0]
    for order in permutations(range(n)):
        inversions = sum(order[i] > order[j] for i in range(n) for j in range(i + 1, n))
        product = (-1) ** inversions * matrix[0][order[0]]
        for i in range(1, n):
            product = product * matrix[i][order[i]]
        total = total + product
    return total


def product_of(*matrices: list[list[Any]]) -> list[list[Any]]:
    left = matrices[0]
    for right in matrices[1:]:
        n = len(right)
        left = [[sum((row[k] * right[k][j] for k in range(n)), 0 * row[0]) for j in range(n)] for row in left]
    return left


def flipped(matrix: list[list[Any]]) -> list[list[Any]]:
    return [list(column) for column in zip(*matrix, strict=True)]


def coefficient_sum(polynomial: fmpq_mpoly) -> fmpz:
    total = fmpz(0)
    for coefficient in polynomial.coeffs():
        assert coefficient.q == 1
        total += abs(coefficient.p)
    return total


def is_bounded(polynomial: fmpq_mpoly, size: Size) -> bool:
    """Whether the polynomial (integer coefficients) is within the bounds."""
    total = coefficient_sum(polynomial)
    return degree(polynomial) <= size.degree and (total == 0 or math.log2(int(total)) <= size.bits + ROUNDING)


def within(polynomial: fmpq_mpoly, size: Size) -> None:
    assert is_bounded(polynomial, size), (degree(polynomial), math.log2(int(coefficient_sum(polynomial))), size)


@st.composite
def polynomials(draw: Any, count: int = 2, up_to: int = 3) -> fmpq_mpoly:
    exponents = [e for d in range(up_to + 1) for e in monomials(count, d)]
    chosen = draw(st.dictionaries(st.sampled_from(exponents), rationals(9).filter(lambda c: c != 0), max_size=4))
    return ring([f"x{i + 1}" for i in range(count)]).from_dict(chosen)


# Arithmetic of bounds


@given(polynomials(), polynomials())
def test_the_size_of_a_product_bounds_the_product(f, g):
    (size_f, below_f), (size_g, below_g) = polynomial_size(f), polynomial_size(g)
    within(f * below_f * g * below_g, size_f * size_g)


@given(polynomials(), polynomials())
def test_the_size_of_a_sum_bounds_sum_and_difference(f, g):
    (size_f, below_f), (size_g, below_g) = polynomial_size(f), polynomial_size(g)
    within(f * below_f + g * below_g, size_f + size_g)
    within(f * below_f - g * below_g, size_f + size_g)


@given(polynomials(), st.integers(0, 4))
def test_the_size_of_a_power_bounds_the_power(f, exponent):
    size, below = polynomial_size(f)
    within((f * below) ** exponent, size**exponent)


@given(polynomials(), polynomials())
def test_the_size_of_either_bounds_both(f, g):
    (size_f, below_f), (size_g, below_g) = polynomial_size(f), polynomial_size(g)
    within(f * below_f, size_f | size_g)
    within(g * below_g, size_f | size_g)


@given(polynomials())
def test_the_size_of_a_polynomial_is_attained(f):
    size, below = polynomial_size(f)
    assume(not f.is_zero())
    assert size.degree == degree(f)
    assert size.bits == pytest.approx(math.log2(int(coefficient_sum(f * below))), abs=ROUNDING)


def test_the_size_of_a_number_of_a_thousand_digits_is_still_a_bound():
    x = ring(["x"]).gens()[0]
    large = fmpz(10) ** 1000 + 1
    size, _ = polynomial_size(large * x)
    assert 0 <= size.bits - 1000 * math.log2(10) < ROUNDING


def test_a_sum_of_sizes_far_apart_is_still_a_bound():
    # 2^300 + 1: the smaller one is lost in a float, but the bound does not fall below the sum.
    total = Size(0, 300.0) + Size(0, 0.0)
    assert fmpz(2) ** 300 + 1 <= fmpz(math.ceil(2 ** (total.bits - 300) * 2**60)) * fmpz(2) ** 240


def test_the_sum_of_two_large_sizes_is_twice_as_large():
    assert Size(0, 300.0) + Size(0, 300.0) == Size(0, 301.0)


@pytest.mark.parametrize(
    ("eps", "size"),
    [
        (None, VARIABLE),  # eps = e/1
        (fmpq(1), ONE),
        (fmpq(-8), Size(0, 3.0)),
        (fmpq(1, 8), Size(0, 3.0)),
        (fmpq(3, 1024), Size(0, 10.0)),
    ],
)
def test_the_size_of_eps_bounds_numerator_and_denominator(eps, size):
    found = eps_size(eps)
    assert found.degree == size.degree
    assert found.bits == pytest.approx(size.bits, abs=ROUNDING)


# Steps and determinants


@few
@given(systems(dims=(1, 2, 3)), some_eps)
def test_the_size_of_a_step_bounds_numerators_and_denominator(system, eps):
    written = Written(system, eps)
    above, below = written.step(written.x, written.one)
    size = step_size(system, eps_size(eps), VARIABLE)
    for polynomial in (*above, below):
        within(polynomial, size)


@few
@given(systems(dims=(1, 2)), some_eps)
def test_the_size_of_two_steps_bounds_the_second_image(system, eps):
    written = Written(system, eps)
    above, below = written.step(*written.step(written.x, written.one))
    size = eps_size(eps)
    for polynomial in (*above, below):
        within(polynomial, step_size(system, size, step_size(system, size, VARIABLE)))


@few
@given(systems(dims=(1, 2)), some_eps)
def test_the_size_of_the_determinant_bounds_numerator_and_denominator(system, eps):
    written = Written(system, eps)
    size = eps_size(eps)
    X, W = written.step(written.x, written.one)
    for point, at in (((written.x, written.one), VARIABLE), ((X, W), step_size(system, size, VARIABLE))):
        bound = determinant_size(system, size, at)
        for sign in (1, -1):
            within(leibniz(written.matrix(*point, sign)), bound.above)
        within((written.q * written.L * point[1]) ** written.n, bound.below)


@pytest.mark.parametrize(
    ("text", "above", "below"),
    [
        ("x/(x + y)", (1, 0.0), (1, 1.0)),
        ("(x^2 + 3*y)/8", (2, 2.0), (2, 3.0)),  # over 8 at x = X/W: (X^2 + 3 Y W) / (8 W^2)
        ("eps*x*y/(1 - eps^2)", (4, 0.0), (4, 1.0)),
    ],
)
def test_the_size_of_a_function_is_that_of_its_numerator_and_denominator(text, above, below):
    found = function_size(claim(text, "x y"), 2, VARIABLE, VARIABLE)
    for bound, (degree_, bits) in ((found.above, above), (found.below, below)):
        assert bound.degree == degree_
        assert bound.bits == pytest.approx(bits, abs=ROUNDING)


def test_eps_as_a_number_adds_nothing_to_the_degree_of_a_claimed_function():
    # x^2 y eps^3 at (X, Y)/W and 2/3: degree 3 in X, Y, W; numbers 2^3 and 3^3, of which the larger counts
    found = ClaimedDensity(claim("x^2*y*eps^3", "x y")).size(eps_size(fmpq(2, 3)), VARIABLE)
    assert (found.above.degree, found.below.degree) == (3, 3)
    assert found.above.bits == found.below.bits == pytest.approx(3 * math.log2(3), abs=ROUNDING)


@pytest.mark.parametrize("eps", [None, fmpq(2, 3)])
def test_a_generic_system_attains_the_degree_of_a_step(eps):
    written, size = Written(GENERIC, eps), eps_size(eps)
    above, below = written.step(written.x, written.one)
    assert {degree(polynomial) for polynomial in (*above, below)} == {step_size(GENERIC, size, VARIABLE).degree}


def test_a_generic_system_attains_the_degree_of_two_steps_at_a_fixed_eps():
    written, size = Written(GENERIC, fmpq(2, 3)), eps_size(fmpq(2, 3))
    _, below = written.step(*written.step(written.x, written.one))
    assert degree(below) == step_size(GENERIC, size, step_size(GENERIC, size, VARIABLE)).degree


# One large row, one large part of a row, large denominators: nothing makes up for a row that is left out.
LOPSIDED = [
    system_of("x", "10^30*x^2"),
    system_of("x", "10^30*x"),
    system_of("x", "10^30"),
    system_of("x y", "10^30*x^2", "x + y"),
    system_of("x y", "x + y", "10^30*x*y"),
    system_of("x y z", "x", "10^30*(y^2 + x*z)", "z"),
    system_of("x y z", "x", "y", "10^30*(z^2 - x*y)"),
    system_of("x y", "10^30*(x - y)", "y^2"),
    system_of("x y", "y^2", "10^30*(x - y)"),
    system_of("x y", "10^30", "1"),
    system_of("x y", "1", "10^30"),
    system_of("x y", "x^2/(10^30 + 57)", "y^2/(10^30 + 57)"),
    system_of("x y", "x/(10^30 + 57)", "y/(10^15 + 37)"),
    system_of("x y", "1/(10^30 + 57)", "0"),
]


@pytest.mark.parametrize("eps", [None, fmpq(2, 3), fmpq(10**20, 3), fmpq(3, 10**20)])
@pytest.mark.parametrize("system", LOPSIDED)
def test_a_system_with_one_large_part_is_bounded(system, eps):
    written = Written(system, eps)
    size, X, W = eps_size(eps), written.x, written.one
    for at in (VARIABLE, step_size(system, eps_size(eps), VARIABLE)):
        bound = determinant_size(system, size, at)
        for sign in (1, -1):
            within(leibniz(written.matrix(X, W, sign)), bound.above)
        within((written.q * written.L * W) ** written.n, bound.below)
        X, W = written.step(X, W)
        for polynomial in (*X, W):
            within(polynomial, step_size(system, size, at))


def test_the_equation_of_two_fractions_is_the_larger_of_the_cross_products():
    # By hand: a/b = c/d is a d - c b = 0.
    small, large = Size(1, 2.0), Size(10, 50.0)
    assert SizeFraction(large, small).equation(SizeFraction(small, large)).degree == 20
    assert SizeFraction(small, large).equation(SizeFraction(large, small)).degree == 20
    assert SizeFraction(large, small).equation(SizeFraction(small, large)).bits == pytest.approx(100, abs=ROUNDING)
    assert SizeFraction(small, small).equation(SizeFraction(small, small)) == Size(2, 5.0)


def test_a_smaller_size_would_not_bound_the_step():
    written = Written(HENON_HEILES, None)
    _, below = written.step(written.x, written.one)
    size = step_size(HENON_HEILES, VARIABLE, VARIABLE)
    assert is_bounded(below, size)
    assert not is_bounded(below, Size(degree(below) - 1, size.bits))
    assert not is_bounded(below, Size(size.degree, math.log2(int(coefficient_sum(below))) - 0.01))


# Equations of identities: the polynomials whose vanishing is decided


@few
@given(systems(dims=(1,)), systems(dims=(1,)), some_eps)
def test_commutativity_is_bounded_in_dimension_one(f, g, eps):
    check_commutativity(f, g, eps)


@few
@given(systems(dims=(2,)), systems(dims=(2,)), some_eps)
def test_commutativity_is_bounded_in_dimension_two(f, g, eps):
    check_commutativity(f, g, eps)


@pytest.mark.parametrize("seed", range(4))
def test_commutativity_is_bounded_for_dense_systems(seed):
    rng = random.Random(seed)

    def dense():
        rhs = ring(["x", "y"])
        exponents = [e for d in range(3) for e in monomials(2, d)]
        rows = [{e: fmpq(rng.randint(-99, 99), rng.randint(1, 9)) for e in exponents} for _ in range(2)]
        return QuadraticSystem.from_polynomials([rhs.from_dict(row) for row in rows])

    check_commutativity(dense(), dense(), None if seed % 2 else fmpq(rng.randint(1, 9), 7))


def check_commutativity(f, g, eps):
    written_f, written_g = Written(f, eps), Written(g, eps)
    left, below_left = written_g.step(*written_f.step(written_f.x, written_f.one))
    right, below_right = written_f.step(*written_g.step(written_f.x, written_f.one))
    identity = commutativity(f, g, eps, ("f", "g"))
    for a, b in zip(left, right, strict=True):
        within(a * below_right - b * below_left, identity.equation)
    denominators = below_left * below_right
    denominators *= written_f.step(written_f.x, written_f.one)[1] * written_g.step(written_f.x, written_f.one)[1]
    assert degree(denominators) <= identity.poles


@few
@given(hamiltonians(dims=(1, 2)), some_eps)
def test_conservation_of_modified_h_is_bounded(hamiltonian, eps):
    # The identity holds, so that its polynomial is zero: the bound is that of the two sides before they cancel.
    written = Written(hamiltonian.system, eps)
    image = written.step(written.x, written.one)
    after, before = modified(written, hamiltonian, *image), modified(written, hamiltonian, written.x, written.one)
    size, integral = eps_size(eps), ModifiedHamiltonian(hamiltonian)
    at_image = integral.size(size, step_size(hamiltonian.system, size, VARIABLE))
    for values, bound in ((before, integral.size(size, VARIABLE)), (after, at_image)):
        within(values[0], bound.above)
        within(values[1], bound.below)
    identity = conservation(hamiltonian.system, integral, eps)
    within(after[0] * before[1], identity.equation)
    within(before[0] * after[1], identity.equation)
    assert degree(image[1] * after[1] * before[1]) <= identity.poles


@few
@given(hamiltonians(dims=(2,)), hamiltonians(dims=(2,)))
def test_conservation_of_another_modified_h_is_bounded(hamiltonian, other):
    eps = fmpq(2, 3)
    written, foreign = Written(hamiltonian.system, eps), Written(other.system, eps)
    image = written.step(written.x, written.one)
    after, before = modified(foreign, other, *image), modified(foreign, other, written.x, written.one)
    identity = conservation(hamiltonian.system, ModifiedHamiltonian(other), eps)
    within(after[0] * before[1] - before[0] * after[1], identity.equation)


def modified(written: Written, hamiltonian: CubicHamiltonian, X: Sequence[Any], W: Any) -> tuple[Any, Any]:
    """Numerator and denominator of H + grad H . (x~ - x)/3 at X / W, over 3 d W^3 W~."""
    image, below = written.step(X, W)
    d = common_denominator(hamiltonian.H)
    total = 3 * written.value(hamiltonian.H, X, W, 3) * below
    for x, after, slope in zip(X, image, hamiltonian.gradient, strict=True):
        # grad H may have a smaller common denominator than H.
        scaled = written.value(slope, X, W, 2) * (d // common_denominator(slope))
        total = total + scaled * (after * W - x * below)
    return total, 3 * d * W**3 * below


@few
@given(hamiltonians(dims=(2,), homogeneous=True, standard=True), systems(dims=(2,)), some_eps)
def test_conservation_of_the_papers_integral_is_bounded(hamiltonian, system, eps):
    written, foreign = Written(system, eps), Written(hamiltonian.system, eps)

    def paper(X, W):
        image, below = foreign.step(X, W)
        return written.q * (X[0] * image[1] - X[1] * image[0]), written.p * W * below

    after, before = paper(*written.step(written.x, written.one)), paper(written.x, written.one)
    bound = PaperIntegral(hamiltonian).size(eps_size(eps), VARIABLE)
    within(before[0], bound.above)
    within(before[1], bound.below)
    identity = conservation(system, PaperIntegral(hamiltonian), eps)
    within(after[0] * before[1] - before[0] * after[1], identity.equation)


@few
@given(hamiltonians(dims=(2,), homogeneous=True, standard=True), matrices(2, 2), systems(dims=(2,)), some_eps)
def test_conservation_of_an_integral_of_the_commutant_is_bounded(hamiltonian, A, system, eps):
    written, foreign = Written(system, eps), Written(hamiltonian.system, eps)
    numerators, d = (hamiltonian.J * (A * A).transpose()).numer_denom()

    def value(X, W):
        image, below = foreign.step(X, W)
        above = sum((numerators[i, j] * X[i] * image[j] for i in range(2) for j in range(2)), 0 * W)
        return written.q * above, written.p * d * W * below

    after, before = value(*written.step(written.x, written.one)), value(written.x, written.one)
    bound = CommutantIntegral(hamiltonian, A, 2).size(eps_size(eps), VARIABLE)
    within(before[0], bound.above)
    within(before[1], bound.below)
    identity = conservation(system, CommutantIntegral(hamiltonian, A, 2), eps)
    within(after[0] * before[1] - before[0] * after[1], identity.equation)


def claimed(written: Written, function: RationalFunction, X: Sequence[Any], W: Any) -> tuple[Any, Any]:
    """Numerator and denominator of a rational function of x and eps at X / W and eps = p/q, over W^a q^b."""
    n = written.n
    both = (function.numerator, function.denominator)
    a = max(sum(monomial[:n]) for polynomial in both for monomial in polynomial.monoms())
    b = max(monomial[n] for polynomial in both for monomial in polynomial.monoms())
    d = common_denominator(function.numerator)
    values = []
    for polynomial in both:
        found = written.ring.constant(0)
        for monomial, coefficient in polynomial.terms():
            term = d * coefficient * W ** (a - sum(monomial[:n])) * written.p ** monomial[n]
            term = term * written.q ** (b - monomial[n])
            for entry, exponent in zip(X, monomial[:n], strict=True):
                term = term * entry**exponent
            found = found + term
        values.append(found)
    return values[0], values[1]


CLAIMS = [
    "x",
    "x^2/3 + eps*y",
    "(x^2 + y^2)/(1 - eps^2*y^2)",
    "x*y/(2*x - 3/5*y) + eps/7",
    "1/(x^3 + eps^4*y)",
    "5/8",
]


@pytest.mark.parametrize("eps", [None, fmpq(-3, 7), fmpq(10**9 + 7, 998244353)])
@pytest.mark.parametrize("text", CLAIMS)
def test_conservation_of_a_claimed_function_is_bounded(text, eps):
    function = claim(text, "x y")
    written = Written(LOTKA_VOLTERRA, eps)
    image = written.step(written.x, written.one)
    after, before = claimed(written, function, *image), claimed(written, function, written.x, written.one)
    size = eps_size(eps)
    for claimed_as in (ClaimedIntegral("I", function), ClaimedDensity(function)):
        at_image = claimed_as.size(size, step_size(LOTKA_VOLTERRA, size, VARIABLE))
        for values, bound in ((before, claimed_as.size(size, VARIABLE)), (after, at_image)):
            within(values[0], bound.above)
            within(values[1], bound.below)
    identity = conservation(LOTKA_VOLTERRA, ClaimedIntegral("I", function), eps)
    within(after[0] * before[1] - before[0] * after[1], identity.equation)
    assert degree(image[1] * after[1] * before[1]) <= identity.poles


@pytest.mark.parametrize("eps", [None, fmpq(-3, 7)])
@pytest.mark.parametrize("text", [None, *CLAIMS])
def test_invariance_of_a_density_is_bounded(text, eps):
    system = LOTKA_VOLTERRA
    written = Written(system, eps)
    here, image = (written.x, written.one), written.step(written.x, written.one)
    below = {id(point): (written.q * written.L * point[1]) ** written.n for point in (here, image)}

    def phi(point):
        if text is None:
            return leibniz(written.matrix(*point, -1)), below[id(point)]
        return claimed(written, claim(text, "x y"), *point)

    after, before = phi(image), phi(here)
    left = after[0] * leibniz(written.matrix(*here, -1)), after[1] * below[id(here)]
    right = before[0] * leibniz(written.matrix(*image, 1)), before[1] * below[id(image)]
    density = DeterminantDensity(system) if text is None else ClaimedDensity(claim(text, "x y"))
    identity = density_identity(system, density, eps)
    within(left[0] * right[1] - right[0] * left[1], identity.equation)
    assert degree(image[1] * left[1] * right[1]) <= identity.poles


def tensor(written: Written, J: fmpq_mat, X: Sequence[Any], W: Any) -> list[list[Any]]:
    """(q L W)^2 d Pi(X / W), d the common denominator of J."""
    n, slope = written.n, written.slope(X, W)
    numerators, _ = J.numer_denom()
    dJ = [[numerators[i, j] * written.one for j in range(n)] for i in range(n)]
    second = product_of(slope, slope, dJ)
    scale = (written.q * written.L * W) ** 2
    return [[scale * dJ[i][j] - written.p**2 * second[i][j] for j in range(n)] for i in range(n)]


def check_tensor(hamiltonian: CubicHamiltonian, eps: fmpq | None) -> None:
    written = Written(hamiltonian.system, eps)
    here, image = (written.x, written.one), written.step(written.x, written.one)
    forward, backward = written.matrix(*image, 1), written.matrix(*here, -1)
    left = product_of(forward, tensor(written, hamiltonian.J, *here), flipped(forward))
    right = product_of(backward, tensor(written, hamiltonian.J, *image), flipped(backward))
    identity = transformation_identity(hamiltonian, eps)
    for i in range(written.n):
        for j in range(written.n):
            within(left[i][j] - right[i][j], identity.equation)


@few
@given(hamiltonians(dims=(1, 2)), some_eps)
def test_the_transformation_law_is_bounded(hamiltonian, eps):
    check_tensor(hamiltonian, eps)


@pytest.mark.parametrize(
    ("names", "H"),
    [
        ("q p", "q^2*p + q*p^2"),
        ("q p", "q^2*p"),
        ("q p", "5*q^2*p - 3*q*p^2 + p"),
        ("q a b c p d e f", "q^2*p + q*p^2"),
    ],
)
@pytest.mark.parametrize("eps", [None, fmpq(1), fmpq(2, 3)])
def test_single_entries_of_the_tensor_and_of_the_matrices_beside_it_are_bounded(names, H, eps):
    hamiltonian = hamiltonian_of(names, H)
    written, size = Written(hamiltonian.system, eps), eps_size(eps)
    for row in tensor(written, hamiltonian.J, written.x, written.one):
        for entry in row:
            within(entry, poisson._tensor_entry(hamiltonian, size, VARIABLE))
    for sign in (1, -1):
        for row in written.matrix(written.x, written.one, sign):
            for entry in row:
                within(entry, poisson._denominator_entry(hamiltonian, size, VARIABLE))


@settings(max_examples=4)
@given(hamiltonians(dims=(3,)))
def test_the_transformation_law_is_bounded_in_dimension_three(hamiltonian):
    check_tensor(hamiltonian, fmpq(2, 3))


LOPSIDED_HAMILTONIANS = [
    hamiltonian_of("q p", "10^30*q^3 + p"),
    hamiltonian_of("q p", "q^2*p/(10^30 + 57) + p^2"),
    hamiltonian_of("q p", "10^30*q*p"),
    hamiltonian_of("q p", "q^3 + p^3", [[0, 10**30], [-(10**30), 0]]),
    hamiltonian_of("q p", "q^3 + p^3", [[0, fmpq(1, 10**30)], [fmpq(-1, 10**30), 0]]),
    hamiltonian_of("x y z", "x^2*z", [[0, 10**30, 0], [-(10**30), 0, 1], [0, -1, 0]]),
    hamiltonian_of("x y z", "10^30*z^3 + x*y*z", [[0, 1, fmpq(1, 10**9)], [-1, 0, 1], [fmpq(-1, 10**9), -1, 0]]),
]


@pytest.mark.parametrize("eps", [fmpq(2, 3), fmpq(10**20, 3), fmpq(3, 10**20)])
@pytest.mark.parametrize("hamiltonian", LOPSIDED_HAMILTONIANS)
def test_the_poisson_identities_of_a_system_with_one_large_part_are_bounded(hamiltonian, eps):
    check_tensor(hamiltonian, eps)
    written = Written(hamiltonian.system, eps)
    for defect in jacobi_sums(written, hamiltonian.J):
        within(defect, jacobi_identity(hamiltonian, eps).equation)


def jacobi_sums(written: Written, J: fmpq_mat) -> list[Any]:
    """The cyclic sums of (q L)^2 d Pi, by differentiating polynomials."""
    n, Pi = written.n, tensor(written, J, written.x, written.one)

    def along(i, j, k):
        return sum((Pi[i][l] * Pi[j][k].derivative(l) for l in range(n)), 0 * written.one)

    return [
        along(i, j, k) + along(j, k, i) + along(k, i, j)
        for i in range(n)
        for j in range(i + 1, n)
        for k in range(j + 1, n)
    ]


@few
@given(hamiltonians(dims=(3,)), some_eps)
def test_the_jacobi_identity_is_bounded(hamiltonian, eps):
    written = Written(hamiltonian.system, eps)
    for defect in jacobi_sums(written, hamiltonian.J):
        within(defect, jacobi_identity(hamiltonian, eps).equation)


# Primes of 21 bits: together they make a common denominator that no single entry has.
_PRIMES = (2097143, 2097133, 2097131, 2097097, 2097091, 2097083)
_ODD_DENOMINATORS = [
    [0, f"1/{_PRIMES[0]}", f"1/{_PRIMES[1]}", f"1/{_PRIMES[2]}"],
    [f"-1/{_PRIMES[0]}", 0, f"1/{_PRIMES[3]}", f"1/{_PRIMES[4]}"],
    [f"-1/{_PRIMES[1]}", f"-1/{_PRIMES[3]}", 0, f"1/{_PRIMES[5]}"],
    [f"-1/{_PRIMES[2]}", f"-1/{_PRIMES[4]}", f"-1/{_PRIMES[5]}", 0],
]


@pytest.mark.parametrize("H", ["x^3", "x^3 + y^2*z - w", "w^3 + z*y*x"])
def test_denominators_of_j_without_common_factors_are_bounded(H):
    hamiltonian = hamiltonian_of("x y z w", H, _ODD_DENOMINATORS)
    written = Written(hamiltonian.system, None)
    for row in tensor(written, hamiltonian.J, written.x, written.one):
        for entry in row:
            within(entry**2, jacobi_identity(hamiltonian, None).equation)
    for defect in jacobi_sums(written, hamiltonian.J):
        within(defect, jacobi_identity(hamiltonian, None).equation)
