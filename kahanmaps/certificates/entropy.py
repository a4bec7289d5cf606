"""Positive algebraic entropy of a map of the plane, proved by degrees that another program recomputes.

The criterion is the theorem of docs/mathematics.md, section "Positive entropy, proved in the plane": for a birational f
with D_n = deg f^n and dynamical degree lambda, 2 cosh(n log lambda) + 2 >= (D_2n - 1)/(D_n - 1). Here f is the map over
Q(eps). An upper bound of D_n and a lower bound of D_2n are needed:

* forms F_1, ..., F_n over Z[eps] with F_1(F_k) = c F_(k+1) show D_n <= deg F_n;
* modulo a prime and for a residue eps, 2n steps map a line to a curve of degree at most D_2n (without common factors),
  since the forms of f^(2n) map the line to a multiple of this curve, unless a step gives 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce

from flint import fmpq_mpoly, nmod_poly

from kahanmaps.algebra.polynomials import common_denominator, degree_in, ring
from kahanmaps.certificates.identities import MapClaim, MapData
from kahanmaps.errors import InputError
from kahanmaps.laboratory.growth.degree_bounds import lower_bound, round_up

PRIME = 2**61 - 1
EPS = 1234567  # the residue of eps
LINE = ((3, 5), (7, 11), (1, 0))  # the points (3 + 5 t : 7 + 11 t : 1)
_MAX_TERMS = 100  # forms F_n with more terms are not composed further
_MAX_DEGREE = 600  # maximal degree of the image of the line
_MAX_STEPS = 5  # the largest n


@dataclass(frozen=True)
class PositiveEntropy(MapClaim):
    """The proof that the dynamical degree is above `lower`; `forms` are F_1, ..., F_n, `inverse` is F_1 for f^-1.

    They are forms in the variables and a last, homogenizing variable. c_1 F_1 is (N : D), c_(k+1) F_(k+1) is F_1(F_k),
    where `factors` are the c_k. `degree` is deg F_n, `line_degree` is that of the 2n-th image of `LINE`.
    """

    inverse: tuple[fmpq_mpoly, ...]
    forms: tuple[tuple[fmpq_mpoly, ...], ...]
    factors: tuple[fmpq_mpoly, ...]
    degree: int
    line_degree: int
    lower: Fraction
    about = 'follows from one theorem, which is assumed: docs/mathematics.md, "Positive entropy, proved in the plane"'


def positive_entropy(data: MapData, inverse: MapData, is_short: bool = False) -> PositiveEntropy:
    """Return degrees that prove that the dynamical degree of a map of the plane, with this inverse, is above 1.

    These degrees give the best lower bound within the limits, or, if `is_short`, the first lower bound above 1.

    Raises:
        InputError: if no such degrees are found within the limits; this proves nothing about the map.
    """
    F_1, factor = _without_common_factor(_forms(data))
    iterates, factors = [F_1], [factor]
    line = [nmod_poly(list(point), PRIME) for point in LINE]
    degrees, best_bound = [1], None
    while len(degrees) <= 2 * len(iterates):
        line = _curve_image(F_1, line)
        degrees.append(max(X.degree() for X in line))
        if degrees[-1] > _MAX_DEGREE:
            break
        n, is_even = len(degrees) // 2, len(degrees) % 2 == 1
        if is_even:
            bound = lower_bound(degrees[2 * n], _degree(iterates[n - 1]), n)
            if bound is not None and (best_bound is None or float(bound) > best_bound[0]):
                best_bound = float(bound), n, degrees[2 * n], Fraction(round_up(bound.lower(), -1))
            if (is_short and best_bound) or n >= _MAX_STEPS or max(map(len, iterates[-1])) > _MAX_TERMS:
                break
            F_n, context = iterates[-1], F_1[0].context()
            images = [F_n[0], F_n[1], *context.gens()[2:-1], F_n[2]]
            F_next, factor = _without_common_factor([F.compose(*images, ctx=context) for F in F_1])
            iterates.append(F_next)
            factors.append(factor)
    if best_bound is None:
        raise InputError("no lower bound of the dynamical degree above 1 was found, which proves nothing")
    _, n, line_degree, lower = best_bound
    B, _ = _without_common_factor(_forms(inverse))
    forms = tuple(iterates[:n])
    return PositiveEntropy("entropy", data, B, forms, tuple(factors[:n]), _degree(forms[-1]), line_degree, lower)


def homogenizing(names: Sequence[str]) -> str:
    """Return a name for the homogenizing variable, different from the names of the map.

    >>> homogenizing(["x", "h", "eps"])
    'xhepsh'
    """
    return "".join(names) + "h"


def _degree(forms: Sequence[fmpq_mpoly]) -> int:
    """Return the degree of the forms in the two variables and the homogenizing variable."""
    return max(int(e[0] + e[1] + e[-1]) for form in forms for e in form.monoms())


def _forms(data: MapData) -> list[fmpq_mpoly]:
    """Return N and D as homogeneous forms in the variables and the homogenizing variable."""
    context, polynomials = ring((*data.names, homogenizing(data.names))), (*data.numerators, data.determinant)
    degree = max(degree_in(P, 2) for P in polynomials)
    return [context.from_dict({(*e, degree - e[0] - e[1]): c for e, c in P.terms()}) for P in polynomials]


def _without_common_factor(forms: Sequence[fmpq_mpoly]) -> tuple[tuple[fmpq_mpoly, ...], fmpq_mpoly]:
    """Return (forms/g, g), where g is the primitive greatest common divisor of the forms, over Z."""
    gcd = reduce(fmpq_mpoly.gcd, forms)
    gcd *= common_denominator(gcd)
    return tuple(form / gcd for form in forms), gcd


def image_degree(forms: Sequence[fmpq_mpoly], steps: int, prime: int) -> int | None:
    """Return the degree of the image of `LINE` after `steps` steps modulo a prime; None if a step is undefined."""
    line = [nmod_poly(list(point), prime) for point in LINE]
    try:
        for _ in range(steps):
            line = _curve_image(forms, line, prime)
    except InputError:
        return None
    return max(X.degree() for X in line)


def _curve_image(forms: Sequence[fmpq_mpoly], curve: Sequence[nmod_poly], prime: int = PRIME) -> list[nmod_poly]:
    """Return the image of a curve under the map with these forms, without common factors. InputError if it is 0."""
    powers: list[dict[int, nmod_poly]] = [{0: nmod_poly([1], prime)} for _ in curve]

    def power(k: int, exponent: int) -> nmod_poly:
        if exponent not in powers[k]:
            powers[k][exponent] = power(k, exponent - 1) * curve[k]
        return powers[k][exponent]

    values = []
    for form in forms:
        total = nmod_poly([], prime)
        for exponents, coefficient in form.terms():
            x, y, *constants, eps, h = map(int, exponents)
            if any(constants):
                raise InputError("expected numbers for all parameters to certify positive entropy")
            scalar = int(coefficient.p) * pow(EPS, eps, prime)
            total += power(0, x) * power(1, y) * power(2, h) * scalar
        values.append(total)
    gcd = reduce(nmod_poly.gcd, values)
    if not any(values):
        raise InputError("the image of the line modulo a prime is undefined: no degrees are computed")
    return [value // gcd for value in values]
