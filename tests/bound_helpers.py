"""Rational functions written out, beside their bounds (tests of kahanmaps.algebra.bounds and of all it bounds)."""

import math

from flint import fmpq, fmpq_mpoly
from hypothesis import strategies as st

from kahanmaps.algebra.bounds import CoefficientSize
from kahanmaps.algebra.functions import BudgetExceeded, FunctionField

F = FunctionField(["x", "y", "z"], 10**9)


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
    denominator, content = 1, 0
    for _, coefficient in polynomial.terms():
        denominator = math.lcm(denominator, int(coefficient.q))
    for _, coefficient in polynomial.terms():
        content = math.gcd(content, int(coefficient.p) * (denominator // int(coefficient.q)))
    return polynomial * fmpq(denominator, content or 1)


def lowest(function):
    """Numerator and denominator in lowest terms, coefficients coprime integers."""
    common = function.numerator.gcd(function.denominator)
    return primitive(function.numerator / common), primitive(function.denominator / common)


def covers(bound, function):
    """Whether the bound of a rational function is one: degrees of numerator and denominator in lowest terms."""
    numerator, denominator = lowest(function)
    return true_size(numerator)[0] <= bound.numerator.degree and true_size(denominator)[0] <= bound.pole_degree


def covers_polynomial(size: CoefficientSize, polynomial: fmpq_mpoly) -> bool:
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


def numerator(element):
    assert element.denominator == 1
    return element.numerator


def written(identity):
    """Both sides over rational functions: pairs of elements, [] where they swell or have no values."""
    field = FunctionField([*(f"x{i + 1}" for i in range(identity.dim)), "e"], 2_000_000)
    eps = field.variables[-1] if identity.eps is None else field.convert(identity.eps)
    try:
        sides = identity.at(field, field.variables[:-1], eps)
    except BudgetExceeded:
        return []
    return [] if sides is None else list(zip(*sides, strict=True))


def differences(identity):
    """Numerator and denominator, in lowest terms, of the difference of the sides in each entry that differs."""
    results = (left - right for left, right in written(identity))
    return [lowest(difference) for difference in results if not difference.numerator.is_zero()]


def check(identity, *, differs=False):
    """Put the bound of an identity to the test; its sides have to differ where `differs` says so.

    The numerator of their difference in lowest terms divides the polynomial that is bounded: degrees compare directly,
    and coefficients by Gelfond's inequality, by which those of a factor are at most 2^degree times as large.
    """
    equation, poles = identity.bound
    result = differences(identity)
    assert bool(result) or not differs
    for numerator, denominator in result:
        assert true_size(numerator)[0] <= equation.degree
        assert true_size(numerator)[1] <= equation.bits + equation.degree
        assert sum(true_size(factor)[0] for factor, _ in denominator.factor_squarefree()[1]) <= poles
    return equation, poles
