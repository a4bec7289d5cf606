"""Polarised maps of polynomial vector fields of any degree d, on d - 1 copies of the phase space.

For x' = f(x) let F be the symmetric d-linear form, in (x, 1), with F(x, ..., x) = f(x). The method

    (x_{k+d-1} - x_k) / ((d - 1) h) = F(x_k, x_{k+1}, ..., x_{k+d-1}),      h = 2 eps,

is linear in the last and in the first point: it gives a birational map of (x_k, ..., x_{k+d-2}), Kahan's map for d = 2.
Source: cmoq-2015.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations
from math import factorial
from typing import Any

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.polynomials import names_of, ring, substitute
from kahanmaps.errors import InputError
from kahanmaps.maps.implicit import ImplicitMap
from kahanmaps.systems.polynomial import PolynomialField

TITLE = "polarised map"
MAX_DEGREE = 6  # largest d


def polarised_map(rhs: Sequence[fmpq_mpoly], degree: int = 3) -> ImplicitMap:
    """Return the polarised map of x' = f(x), f of degree at most `degree`, with the time step 2 eps.

    Args:
        rhs: the n components of f, polynomials over Q in the n variables, then symbols (if any), then eps.
        degree: d, from 2 to 6; it may exceed the degree of f.

    Returns:
        The map, exact; its inverse is known. Its variables are the coordinates of x_k, ..., x_{k+d-2}, with names such
        as x, x_1, ... for a variable x of f.

    Raises:
        InputError: if the degree of f exceeds d, or d is out of range.

    >>> from kahanmaps.algebra.parsing import parse_polynomial
    >>> cubic = polarised_map([parse_polynomial("x^3", ["x", "eps"])])
    >>> cubic.variables, cubic.at("1/4").step(["1/2", "1/3"])
    (('x', 'x_1'), (1/3, 3/5))
    """
    if not 2 <= degree <= MAX_DEGREE:
        raise InputError(f"found the degree {degree}, expected 2 to {MAX_DEGREE}")
    n = len(rhs)
    names, parameters = names_of(rhs[0])[:n], names_of(rhs[0])[n:]
    degree_of_field = max((sum(m[:n]) for f in rhs for m in f.monoms()), default=0)
    if degree_of_field > degree:
        raise InputError(f"found right-hand sides of degree {degree_of_field}, expected at most {degree}")
    copy_count = degree - 1
    variables = (*names, *(f"{name}_{k}" for k in range(1, copy_count) for name in names))
    context = ring((*variables, *parameters))
    points = [context.gens()[k * n : (k + 1) * n] for k in range(copy_count)]
    step = 2 * copy_count * context.gens()[-1]
    one, zero = context.constant(1), context.constant(0)

    def unit_row(column: int, value: Any) -> tuple[fmpq_mpoly, ...]:
        """Return the row of the equation "coordinate number `column` of the image = value"."""
        return (*(context.constant(int(j == column)) for j in range(copy_count * n)), -value)

    # (x_k, ..., x_{k+d-2}) -> (x_{k+1}, ..., x_{k+d-1}); the inverse gives (x_{k-1}, ..., x_{k+d-3}), with -h for h.
    zeros = [zero] * ((copy_count - 1) * n)
    forward = [unit_row(k * n + i, points[k + 1][i]) for k in range(copy_count - 1) for i in range(n)]
    backward = [unit_row((k + 1) * n + i, points[k][i]) for k in range(copy_count - 1) for i in range(n)]
    for i, f in enumerate(rhs):
        # (d - 1) h F(x_k, ..., x_{k+d-2}, y) is linear in y: compute the coefficients of y and the constant term.
        linear_coefficients, constant = [zero] * n, zero
        for monomial, coefficient in f.terms():
            indices: list[int | None] = [j for j, exponent in enumerate(monomial[:n]) for _ in range(exponent)]
            indices += [None] * (degree - len(indices))
            exponents = (*[0] * (n * copy_count), *monomial[n:])
            term = step * context.from_dict({exponents: coefficient / factorial(degree)})
            # F is the mean over all arrangements of the variables of a monomial; equal arrangements count repeatedly.
            for arrangement in permutations(indices):
                product = term
                for point, j in zip(points, arrangement[:copy_count], strict=True):
                    product = product * (one if j is None else point[j])
                j = arrangement[-1]
                if j is None:
                    constant = constant + product
                else:
                    linear_coefficients[j] = linear_coefficients[j] + product
        deltas = [context.constant(int(i == j)) for j in range(n)]
        new_row = [delta - entry for delta, entry in zip(deltas, linear_coefficients, strict=True)]
        old_row = [delta + entry for delta, entry in zip(deltas, linear_coefficients, strict=True)]
        forward.append((*zeros, *new_row, -points[0][i] - constant))
        backward.append((*old_row, *zeros, -points[-1][i] + constant))
    field = PolynomialField(tuple(substitute(f, {parameters[-1]: fmpq(0)}) for f in rhs), parameters[:-1])
    return ImplicitMap(variables, tuple(forward), TITLE, time_steps=1, backward=tuple(backward), of_field=field)
