"""Bounds for degrees and coefficients: never below the truth.

A bound is compared with the polynomial that it is a bound of: sums, products, determinants and Cramer's rule on random
polynomials, then the letters of the paper and whole claims on broken input, where the two sides differ, over rational
functions of x and eps. Numerators are looked at in lowest terms, a divisor of the one that is bounded.
"""

from __future__ import annotations

import math

import pytest
from flint import fmpq, fmpq_mpoly
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from paper.members import member

from kahanmaps.algebra.functions import FunctionField
from kahanmaps.checks.settings import Settings
from kahanmaps.errors import InputError
from kahanmaps.invariants.sizes import Size
from kahanmaps.paper import realise
from kahanmaps.paper.bounds import BoundField
from kahanmaps.paper.controls import broken
from kahanmaps.paper.examiner import VerifyOptions
from kahanmaps.paper.registry import Kind, claims
from kahanmaps.paper.verify import _MemberExaminer

F = FunctionField(["x", "y", "z"], 10**9)
few = settings(max_examples=60)


def true_size(polynomial: fmpq_mpoly) -> tuple[int, float]:
    """The degree, and log2 of the sum of the absolute coefficients, of a polynomial with integer coefficients."""
    total, degree = 0, 0
    for monomial, coefficient in polynomial.terms():
        assert coefficient.q == 1
        total += abs(int(coefficient.p))
        degree = max(degree, int(sum(monomial)))
    return degree, math.log2(total) if total else 0.0


def primitive(polynomial: fmpq_mpoly) -> fmpq_mpoly:
    """The multiple with coprime integer coefficients."""
    below, content = 1, 0
    for _, coefficient in polynomial.terms():
        below = math.lcm(below, int(coefficient.q))
    for _, coefficient in polynomial.terms():
        content = math.gcd(content, int(coefficient.p) * (below // int(coefficient.q)))
    return polynomial * fmpq(below, content or 1)


def lowest(function):
    """Numerator and denominator in lowest terms, coefficients coprime integers."""
    common = function.above.gcd(function.below)
    return primitive(function.above / common), primitive(function.below / common)


def covers(bound, function):
    """Whether the bound of a rational function is one: degrees of numerator and denominator in lowest terms."""
    above, below = lowest(function)
    return true_size(above)[0] <= bound.above.degree and true_size(below)[0] <= bound.pole_degree


def covers_polynomial(size: Size, polynomial: fmpq_mpoly) -> bool:
    degree, bits = true_size(polynomial)
    return degree <= size.degree and bits <= size.bits + 1e-6


@st.composite
def polynomials(draw):
    """A polynomial in x, y, z with small integer coefficients, as an element of F."""
    monomials = st.tuples(*[st.integers(0, 2)] * 3)
    terms = draw(st.dictionaries(monomials, st.integers(-9, 9).filter(bool), max_size=4))
    total = F.zero
    for exponents, coefficient in terms.items():
        term = F.convert(coefficient)
        for variable, exponent in zip(F.variables, exponents, strict=True):
            for _ in range(exponent):
                term = term * variable
        total = total + term
    return total


def bounded(K, element):
    """A polynomial's own bound in K, as tight as can be."""
    return K.polynomial(*true_size(element.above))


def numerator(element):
    assert element.below == 1
    return element.above


# Numbers


@few
@given(polynomials(), polynomials(), polynomials())
def test_sums_differences_and_products_of_polynomials_are_bounded(p, q, r):
    K = BoundField()
    a, b, c = (bounded(K, element) for element in (p, q, r))
    assert covers_polynomial((a + b).above, numerator(p + q))
    assert covers_polynomial((a - b).above, numerator(p - q))
    assert covers_polynomial((a * b).above, numerator(p * q))
    assert covers_polynomial((-a).above, numerator(-p))
    assert covers_polynomial(((a + b) * c - a * a * a).above, numerator((p + q) * r - p * p * p))


@few
@given(st.lists(polynomials(), min_size=6, max_size=6))
def test_rational_functions_are_bounded(drawn):
    a, b, c, d, e, f = drawn
    assume(not any(element.above.is_zero() for element in (b, d, f)))
    K = BoundField()
    A, B, C, D, E, G = (bounded(K, element) for element in drawn)
    assert covers(A / B + C / D, a / b + c / d)
    assert covers(A / B - C / D * (E / G), a / b - c / d * (e / f))
    assert covers((A / B) * (C / B) + E / B, (a / b) * (c / b) + e / b)
    inner = b + c / d
    assume(not inner.above.is_zero())
    assert covers(A / (B + C / D), a / inner)


@few
@given(st.fractions(max_denominator=50), st.fractions(max_denominator=50), polynomials())
def test_rational_coefficients_are_cleared(r, s, p):
    K = BoundField()
    bound = K.convert(fmpq(r.numerator, r.denominator)) * bounded(K, p) + K.convert(fmpq(s.numerator, s.denominator))
    value = F.convert(fmpq(r.numerator, r.denominator)) * p + F.convert(fmpq(s.numerator, s.denominator))
    cleared = numerator(value) * fmpq(r.denominator * (s.denominator if s.denominator != r.denominator else 1))
    assert covers_polynomial(bound.above, cleared)


def test_one_denominator_is_counted_once():
    K = BoundField()
    a, b, c = K.variable(), K.polynomial(3, 1.0), K.variable()
    assert (a / b + c / b).pole_degree == 3


def test_two_denominators_are_both_counted():
    K = BoundField()
    assert (K.one / K.polynomial(3, 1.0) + K.one / K.polynomial(2, 1.0)).pole_degree == 5


def test_a_bound_never_says_that_something_is_zero():
    K = BoundField()
    assert not K.is_zero(K.zero)


# Matrices


@st.composite
def polynomial_matrices(draw, n, columns):
    return [[draw(polynomials()) for _ in range(columns)] for _ in range(n)]


def in_F(rows):
    return F.matrix(len(rows), len(rows[0]), [entry for row in rows for entry in row])


def in_K(K, rows):
    return K.matrix(len(rows), len(rows[0]), [bounded(K, entry) for row in rows for entry in row])


@few
@given(polynomial_matrices(2, 3), polynomial_matrices(3, 2))
def test_products_of_matrices_are_bounded(left, right):
    K = BoundField()
    bound = in_K(K, left) * in_K(K, right)
    for entry in (in_F(left) * in_F(right)).entries():
        assert covers_polynomial(bound.entry.above, numerator(entry))


@settings(max_examples=30)
@given(st.integers(1, 3).flatmap(lambda n: polynomial_matrices(n, n)))
def test_determinants_are_bounded(rows):
    K = BoundField()
    assert covers_polynomial(in_K(K, rows).det().above, numerator(in_F(rows).det()))


@settings(max_examples=30)
@given(st.integers(1, 3).flatmap(lambda n: st.tuples(polynomial_matrices(n, n), polynomial_matrices(n, 1))))
def test_solutions_are_bounded_by_cramers_rule(drawn):
    rows, right = drawn
    matrix = in_F(rows)
    determinant = matrix.det()
    assume(not determinant.above.is_zero())
    K = BoundField()
    bound = in_K(K, rows).solve(in_K(K, right)).entry
    assert true_size(numerator(determinant))[0] <= bound.pole_degree
    for entry in matrix.solve(in_F(right)).entries():
        assert covers_polynomial(bound.above, cleared(entry, determinant))


def cleared(entry, determinant):
    """The polynomial entry * determinant."""
    product = determinant.above * entry.above
    quotient = product / entry.below
    assert quotient * entry.below == product
    return quotient


def test_matrices_of_different_sizes_are_not_added_or_multiplied():
    K = BoundField()
    a, b = (K.matrix(n, n, [K.one] * (n * n)) for n in (2, 3))
    with pytest.raises(InputError):
        a + b
    with pytest.raises(InputError):
        a * b


# The letters of the paper

LETTERS = {
    "f": lambda o: o.fx,
    "f'": lambda o: o.df,
    "x~": lambda o: o.x_tilde,
    "f'(x~)": lambda o: o.jac(o.f, o.x_tilde),
    "Phi(Phi(x))": lambda o: o.step(o.f, o.x_tilde),
    "dPhi": lambda o: o.jacobian_of_step(o.f, o.x),
    "det": lambda o: o.det(o.minus_eps_jac(o.f, o.x)),
    "H": lambda o: o.H(o.x),
    "H_1": lambda o: o.H_tilde_(1, o.x),
    "H~": lambda o: o.H_tilde(o.x),
    "modified H": lambda o: o.modified_H(o.x),
    "Pi": lambda o: o.Pi(o.x),
    "Pi^-1": lambda o: o.inverse(o.Pi(o.x)),
    "p_0": lambda o: o.p0(o.x),
    "q_1": lambda o: o.q(0, o.x),
    "s_1": lambda o: o.s(0, o.x),
    "P_0": lambda o: o.P0(o.x),
    "Q_1": lambda o: o.Q(0, o.x),
    "K~_1": lambda o: o.integral(o.g_(0), o.x),
    "slope of H~": lambda o: o.slope(lambda o, x: o.H_tilde(x), o.x, o.vector("v")),
    "inhomogeneous x~": lambda o: o.inhomogeneous().step(o.inhomogeneous().f, o.x),
}
LARGE = {"Phi(Phi(x))", "Pi^-1", "inhomogeneous x~", "slope of H~", "dPhi"}


def both(name, letter):
    """A letter over rational functions and over bounds."""
    found = member(name)
    bounds = realise.bound_objects(found, None)
    bound = letter(bounds)
    functions = realise.member_functions(found, sorted(bounds.used - {"roots"}), None, 10**9)
    value = letter(functions)
    return (bound.entry if hasattr(bound, "entry") else bound), (
        value.entries() if hasattr(value, "entries") else [value]
    )


@pytest.mark.parametrize("name", ["m=1", "m=2, split"])
@pytest.mark.parametrize("letter", LETTERS)
def test_a_letter_is_bounded(letter, name):
    if name != "m=1" and letter in LARGE:
        name = "m=1"
    bound, entries = both(name, LETTERS[letter])
    assert all(covers(bound, entry) for entry in entries)


def test_the_bound_of_a_letter_is_not_far_from_the_truth():
    bound, entries = both("m=1", LETTERS["x~"])
    degrees = [true_size(lowest(entry)[0])[0] for entry in entries]
    assert max(degrees) <= bound.above.degree <= 3 * max(degrees)


# Claims


def is_short(claim):
    """Whether it speaks of x and two more vectors at most: equations for systems of many letters are too long here."""
    bounds = realise.bound_objects(member("m=1"), None)
    for _ in claim.function(bounds):
        pass
    return len(bounds.used - {"roots"}) <= 3


BROKEN = [
    (claim, control)
    for claim in claims()
    if claim.kind is Kind.EQUAL and claim.makes_sense(1) and is_short(claim)
    for control in claim.breaks
    if control in ("eps", "map", "f''", "B")
]


def difference_sizes(claim, o):
    """The numerators and denominators in lowest terms of the differences of all pairs of a claim."""
    found = []
    for left, right in claim.function(o):
        difference = left - right
        entries = difference.entries() if hasattr(difference, "entries") else [difference]
        found += [lowest(entry) for entry in entries if not entry.above.is_zero()]
    return found


@pytest.mark.parametrize(("claim", "control"), BROKEN, ids=[f"{claim.key}, {control}" for claim, control in BROKEN])
def test_the_equation_that_a_broken_claim_amounts_to_is_bounded(claim, control, monkeypatch):
    found = member("m=1")
    examined = _MemberExaminer(found, Settings(), VerifyOptions())
    bounds = broken(control, realise.bound_objects(found, None))
    monkeypatch.setattr(examined, "bounds", lambda: bounds)
    needs, equation, poles = examined._size(claim)
    functions = realise.member_functions(found, sorted(needs - {"roots"}), None, 10**9)
    sizes = difference_sizes(claim, broken(control, functions))
    for above, below in sizes:
        assert true_size(above)[0] <= equation.degree
        assert true_size(below)[0] <= poles
        assert true_size(above)[1] <= equation.bits
