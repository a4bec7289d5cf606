"""Polynomial vector fields x' = f(x) of any degree, exact, possibly with symbols in the coefficients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from flint import fmpq_mpoly

from kahanmaps.algebra.parsing import parse_polynomial
from kahanmaps.algebra.polynomials import names_of
from kahanmaps.algebra.printing import format_polynomial


@dataclass(frozen=True, eq=False)
class PolynomialField:
    """A system x' = f(x); `rhs` lists for each variable a polynomial over Q in the variables and `symbols`.

    >>> from kahanmaps.algebra.parsing import parse_polynomial
    >>> field = PolynomialField(tuple(parse_polynomial(text, ["x", "y"]) for text in ("x^3*y", "x")))
    >>> field.degree, field.divergence
    (4, 3*x^2*y)
    """

    rhs: tuple[fmpq_mpoly, ...]
    symbols: tuple[str, ...] = ()

    @cached_property
    def variables(self) -> tuple[str, ...]:
        """The names of the variables."""
        names = names_of(self.rhs[0])
        return names[: len(names) - len(self.symbols)]

    @property
    def dim(self) -> int:
        """The number of variables."""
        return len(self.variables)

    @cached_property
    def degree(self) -> int:
        """The degree of f in the variables; 0 for f = 0."""
        return max((sum(m[: self.dim]) for polynomial in self.rhs for m in polynomial.monoms()), default=0)

    @cached_property
    def divergence(self) -> fmpq_mpoly:
        """The trace of f'(x), a polynomial of a degree below that of f."""
        return sum((p.derivative(i) for i, p in enumerate(self.rhs)), self.rhs[0].context().constant(0))

    def derivative(self, function: fmpq_mpoly) -> fmpq_mpoly:
        """Return f . grad P, the derivative of P = `function` along solutions; P may also contain symbols and eps.

        >>> from kahanmaps.algebra.parsing import parse_polynomial
        >>> field = PolynomialField(tuple(parse_polynomial(text, ["x", "y"]) for text in ("x*y", "x")))
        >>> [field.derivative(x) for x in field.rhs[0].context().gens()]
        [x*y, x]
        """
        context = function.context()
        gens = context.gens()[: self.dim + len(self.symbols)]
        derivatives = (p.compose(*gens, ctx=context) * function.derivative(i) for i, p in enumerate(self.rhs))
        return sum(derivatives, context.constant(0))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, PolynomialField):
            return NotImplemented
        return (self.variables, self.symbols) == (other.variables, other.symbols) and self.rhs == other.rhs

    def __reduce__(self) -> tuple[Any, ...]:
        names, texts = names_of(self.rhs[0]), [format_polynomial(polynomial) for polynomial in self.rhs]
        return _from_text, (type(self), names, texts, self.symbols)

    def __hash__(self) -> int:
        # Hashing all terms would be slow; equal fields have equal hashes anyway.
        return hash((self.variables, self.symbols, *(len(polynomial) for polynomial in self.rhs)))


def _from_text(
    kind: type[PolynomialField], names: tuple[str, ...], texts: Sequence[str], symbols: tuple[str, ...]
) -> PolynomialField:
    """Reconstruct a field from text, for `pickle` and `copy`, which do not support FLINT's polynomials."""
    return kind(tuple(parse_polynomial(text, names) for text in texts), symbols)
