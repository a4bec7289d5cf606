"""Integrals of maps that approximate a flow, normalized: I = H + O(eps) with an integral H of the flow.

With I such a map conserves (alpha I + beta)/gamma, alpha, beta, gamma being functions of eps and the parameters alone.
Computations give one of these at random. Where its limit eps -> 0 is a constant, as that of the published integrals
(1 - eps^2 x^2)/(1 - eps^2 y^2) of the Euler top is, its values hide how well it is conserved: errors of H are
multiplied by a power of eps. So the constant is subtracted, and the rest is divided by that power.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.polynomials import RationalFunction, coefficients_in, degree_in, primitive_part, ring
from kahanmaps.algebra.printing import format_rational_function
from kahanmaps.algebra.work import count
from kahanmaps.documents.files import SystemFile


@dataclass(frozen=True)
class Normalized:
    """The integral `function` = (alpha I + beta)/gamma for an integral I, and its limit eps -> 0, `leading`.

    alpha, beta and gamma, the `coefficients`, are polynomials in the symbols and eps without common factor. `leading`
    is None where I is a constant.
    """

    function: RationalFunction
    leading: RationalFunction | None
    coefficients: tuple[fmpq_mpoly, fmpq_mpoly, fmpq_mpoly]

    @property
    def is_shifted(self) -> bool:
        """Whether something was subtracted, the limit of I being a constant."""
        return not self.coefficients[1].is_zero()

    def combination(self, name: str) -> str:
        """The integral as a formula in I, which is called `name`, the symbols and eps: "(F1 - 1)/eps^2"."""
        target = ring([name, *(other for other in self.function.names if other != name)])
        alpha, beta, gamma = (coefficient.project_to_context(target) for coefficient in self.coefficients)
        return format_rational_function(RationalFunction(alpha * target.gen(0) + beta, gamma))


def normalized(function: RationalFunction, dim: int) -> Normalized:
    """The integral (alpha I + beta)/gamma that tends to a function of x, of primitive polynomials, as eps -> 0.

    Args:
        function: an integral I of a map that approximates a flow, for every eps; a rational function of the variables,
            the symbols and eps, its last variable.
        dim: the number of variables.

    Returns:
        The integral, exact; I itself where it is a constant. The limit is in lowest terms, with coprime integers as
        coefficients above and below, the leading ones positive. Normalized integrals are returned unchanged.

    >>> from kahanmaps.algebra.parsing import parse_rational_function
    >>> found = normalized(parse_rational_function("(1 - eps^2*x^2)/(1 + 2*eps^2*y^2)", ["x", "y", "eps"]), 2)
    >>> [format_rational_function(one) for one in (found.function, found.leading)], found.combination("F")
    (['(x^2 + 2*y^2)/(2*y^2*eps^2 + 1)', 'x^2 + 2*y^2'], '(-F + 1)/eps^2')
    """
    P, Q = function.numerator, function.denominator
    eps = P.context().gens()[-1]
    alpha, beta, gamma = eps**0, eps * 0, eps**0  # alpha I + beta = gamma P/Q
    unchanged = Normalized(function, None, (alpha, beta, gamma))
    if P.is_zero():
        return unchanged
    while True:
        count(20 + len(P) + len(Q))
        # A factor that is free of x does not help to conserve anything.
        above, below = _content(P, dim), _content(Q, dim)
        P, Q = P / above, Q / below
        alpha, beta, gamma = alpha * below, beta * below, gamma * above
        p, q = _lowest(P), _lowest(Q)
        common = p.gcd(q)
        p, q = p / common, q / common
        if degree_in(p, dim) or degree_in(q, dim):
            break
        # P/Q = p/q + O(eps), constants: with content taken out neither begins with a power of eps. This ends, for I
        # is no function of eps alone: P(x) Q(y) - P(y) Q(x) has a lowest power of eps, and q P - p Q has it at most.
        P, alpha, beta = q * P - p * Q, q * alpha, q * beta - p * gamma
        if P.is_zero():
            return unchanged
    scale = primitive_part(p)[0] / primitive_part(q)[0]
    P, gamma = P / scale, gamma * scale
    common = reduce(lambda one, other: one.gcd(other), (alpha, beta, gamma))
    coefficients = (alpha / common, beta / common, gamma / common)
    leading = RationalFunction(primitive_part(p)[1], primitive_part(q)[1])
    return Normalized(RationalFunction(P, Q), leading, coefficients)


def measured_integrals(file: SystemFile) -> dict[str, RationalFunction]:
    """The integrals that a file claims, by name, as they are measured along orbits.

    One whose limit eps -> 0 is a constant is replaced by that combination of it which tends to an integral of the flow.

    >>> from kahanmaps.documents.catalog import load
    >>> list(measured_integrals(load("euler_top"))), list(measured_integrals(load("volterra_periodic_3")))
    (['(-F1 + 1)/eps^2', '(-F2/2 + 1/2)/eps^2'], ['I1', 'I2'])
    """
    found = {}
    for name, function in file.integrals.items():
        if file.map.has_eps and file.map.time_steps and file.map.root is None:
            one = normalized(function, file.dim)
            if one.is_shifted:
                name, function = one.combination(name), one.function
        found[name] = function
    return found


def _content(polynomial: fmpq_mpoly, dim: int) -> fmpq_mpoly:
    """The greatest common divisor of the coefficients of monomials in the first `dim` variables; 1 for numbers."""
    found = reduce(lambda one, other: one.gcd(other), coefficients_in(polynomial, dim))
    return found / found if found.is_constant() else found


def _lowest(polynomial: fmpq_mpoly) -> fmpq_mpoly:
    """The terms of lowest order in eps, without their power of it."""
    order = min(int(monomial[-1]) for monomial in polynomial.monoms())
    terms: dict[tuple[int, ...], fmpq] = {}
    for monomial, value in polynomial.terms():
        if monomial[-1] == order:
            terms[(*map(int, monomial[:-1]), 0)] = value
    return polynomial.context().from_dict(terms)
