"""Proof by expansion: both sides of an identity as rational functions of x (and eps), multiplied out and compared.

The same code that evaluates an identity at points over Q and GF(p) runs here over the field of rational functions. It
is a proof wherever it comes to an end; a budget on the products of terms ends it where the expressions swell.
"""

from __future__ import annotations

from kahanmaps.algebra.functions import DEFAULT_BUDGET, BudgetExceeded, FunctionField
from kahanmaps.checks.claims import Evidence
from kahanmaps.checks.decide import Identity

METHOD = "expansion"
# Beyond this dimension the budget would only be spent in vain.
MAX_DIMENSION = 6


class NotEqual(ArithmeticError):
    """Both sides were expanded and differ."""


def expansion(identity: Identity, budget: int | None = None) -> Evidence | None:
    """The evidence that both sides are equal as rational functions; None where the budget is exceeded.

    `budget` bounds the products of terms; the default is smaller where coefficients are long.
    Raises NotEqual where both sides were expanded and differ.
    """
    if budget is None:
        if identity.dim > MAX_DIMENSION:
            return None
        # A product takes longer than in proportion to its bits once it has left the innermost caches.
        bits = identity.bound[0].bits
        budget = int(DEFAULT_BUDGET / max(1.0, bits / 256) / max(1.0, bits / 10_000))
    names = [f"x{i + 1}" for i in range(identity.dim)] + ["eps"]
    modulus = None if identity.root is None else identity.root.polynomial.coeffs()
    if modulus is not None:
        names.append("root")
    field = FunctionField(names, budget, modulus=modulus)
    eps = field.variables[identity.dim] if identity.eps is None else field.convert(identity.eps)
    try:
        sides = identity.at(field, field.variables[: identity.dim], eps)
        if sides is None:
            return None
        left, right = sides
        if len(left) != len(right) or not all(field.equal(a, b) for a, b in zip(left, right, strict=True)):
            raise NotEqual("the two sides, expanded, are different rational functions")
    except BudgetExceeded:
        return None
    scope = " of x, multiplied out"
    if identity.has_eps:
        scope = f" of {'x and eps' if identity.eps is None else f'x, for eps = {identity.eps}'}, multiplied out"
    return Evidence(
        METHOD,
        f"both sides are the same rational function{f', {identity.scope}' if identity.scope else scope}",
        {"products_of_terms": budget - field.budget, "eps": "every" if identity.eps is None else str(identity.eps)},
    )
