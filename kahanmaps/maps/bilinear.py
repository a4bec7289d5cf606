"""Discretizations given by equations that are linear in the old point x and linear in the new point x~.

Among them are Kahan's method, and its adjusted and pseudo-Kahan variants with other coefficients or with skew terms
like x y~ - x~ y. The inverse map has the same equations with x and x~ exchanged.
"""

from __future__ import annotations

from collections.abc import Sequence

from flint import fmpq_mpoly

from kahanmaps.algebra.polynomials import names_of, ring
from kahanmaps.algebra.printing import format_polynomial
from kahanmaps.errors import InputError, counted
from kahanmaps.maps.implicit import ImplicitMap

TITLE = "bilinear map"


def bilinear_map(variables: Sequence[str], equations: Sequence[fmpq_mpoly]) -> ImplicitMap:
    """Return the map x -> x~ defined by n polynomial equations, each of degree at most 1 in x and at most 1 in x~.

    Args:
        variables: the names of the n coordinates of x.
        equations: n polynomials over Q in the coordinates of x, then of x~ (n each), then symbols (if any), then eps.

    Returns:
        The map, exact; its inverse is known.

    Raises:
        InputError: if the number of equations is not n, or an equation is not linear in x and in x~.

    >>> from kahanmaps.algebra.parsing import parse_polynomial
    >>> equation = parse_polynomial("X - x - 2*eps*x*X", ["x", "X", "eps"])
    >>> riccati = bilinear_map(["x"], [equation]).at("1/2")
    >>> riccati.step(["1/5"]), riccati.inverse_step(["1/4"])
    ((1/4,), (1/5,))
    """
    names, n = tuple(variables), len(variables)
    if len(equations) != n:
        raise InputError(f"found {counted(len(equations), 'equation')} for {counted(n, 'variable')}, expected as many")
    if not all(isinstance(equation, fmpq_mpoly) for equation in equations):
        raise InputError(
            f"found {equations!r}, expected polynomials: parse_polynomial('X - x - 2*eps*x*X', ['x', 'X', 'eps'])"
        )
    context = ring((*names, *names_of(equations[0])[2 * n :]))
    rows = []
    for equation in equations:
        row = [context.constant(0)] * (n + 1)
        for monomial, coefficient in equation.terms():
            old_exponents, new_exponents = monomial[:n], monomial[n : 2 * n]
            if sum(old_exponents) > 1 or sum(new_exponents) > 1:
                term = format_polynomial(equation.context().from_dict({monomial: coefficient}))
                raise InputError(
                    f"found the term {term}, expected terms of degree at most 1 in the old point and in the new one"
                )
            column = next((j for j, exponent in enumerate(new_exponents) if exponent), n)
            row[column] = row[column] + context.from_dict({(*old_exponents, *monomial[2 * n :]): coefficient})
        rows.append(tuple(row))
    return ImplicitMap(names, tuple(rows), TITLE)
