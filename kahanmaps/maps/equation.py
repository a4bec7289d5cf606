"""The equation M x~ = r of a map over a field, as the matrix (M | -r) of forms of one degree in (X : Z), x = X/Z.

All evaluators use this equation: for integer points (orbits/integer_steps.py), for floating-point numbers
(floats/steps.py), and for curves and forms in projective space (projective.py).
"""

from __future__ import annotations

import operator
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any

from flint import Ordering, fmpq, fmpq_mpoly, fmpq_mpoly_ctx, nmod_mpoly_ctx

from kahanmaps.algebra.fields import QQ, Field, PrimeField
from kahanmaps.algebra.minors import Product, kernel_minors
from kahanmaps.algebra.polynomials import evaluate, names_of, ring
from kahanmaps.errors import InputError

_MAX_TERMS = 400  # explicit forms with at most this number of terms are faster than minors

Exponents = tuple[int, ...]
Terms = tuple[tuple[int, Any], ...]


@dataclass(frozen=True, eq=False)
class Equation:
    """The matrix L = (M | -r) over a field, whose entries are forms of the same degree in (X_1, ..., X_n, Z).

    `exponents` lists the monomials of this degree; entry (i, j) of L is the sum of c times monomial k over the pairs
    (k, c) in `terms[i][j]`. In degree 1 the monomials are X_1, ..., X_n, Z in this order.
    """

    over: Field
    exponents: tuple[Exponents, ...]
    terms: tuple[tuple[Terms, ...], ...]

    @property
    def dim(self) -> int:
        """The dimension n."""
        return len(self.terms)

    @cached_property
    def degree(self) -> int:
        """The degree of the forms."""
        return int(sum(self.exponents[0]))

    def monomials(self, X: Sequence[Any], times: Product = operator.mul) -> list[Any]:
        """Return the values of the monomials at X = (X_1, ..., X_n, Z) over any ring; `times` is its multiplication."""
        if self.degree == 1:
            return list(X)
        powers: list[list[Any]] = [[None, entry] for entry in X]
        monomials = []
        for exponent in self.exponents:
            product = None
            for powers_of_entry, e in zip(powers, exponent, strict=True):
                while len(powers_of_entry) <= e:
                    powers_of_entry.append(times(powers_of_entry[-1], powers_of_entry[1]))
                if e:
                    product = powers_of_entry[e] if product is None else times(product, powers_of_entry[e])
            monomials.append(product)
        return monomials

    def rows(self, monomials: Sequence[Any], zero: Any) -> list[list[Any]]:
        """Return the matrix L, given the values of the monomials; an entry of L without terms is `zero`."""
        return [
            [sum((monomials[k] * c for k, c in entry[1:]), monomials[entry[0][0]] * entry[0][1]) if entry else zero
             for entry in row]
            for row in self.terms
        ]  # fmt: skip

    def image(self, X: Sequence[Any], zero: Any, times: Product = operator.mul) -> list[Any]:
        """Return the image of (X_1 : ... : X_n : Z) over any ring, as a vector in the kernel of L.

        The entries may have a common factor. They are the values of the forms `explicit`, if any, or the minors of L.
        """
        if self.explicit is None:
            minors = kernel_minors(self.rows(self.monomials(X, times), None), times)
            return [zero if minor is None else minor for minor in minors]
        (image,) = self.explicit.rows(self.explicit.monomials(X, times), zero)
        return image

    @property
    def image_degree(self) -> int:
        """The degree of the forms that `image` evaluates."""
        return self.dim * self.degree if self.explicit is None else self.explicit.degree

    @cached_property
    def explicit(self) -> Equation | None:
        """The numerators and the common denominator of an explicit map (rows Q_i x~_i = P_i), as a single row.

        These forms have no common factor. The value is None if the map is not explicit, if the forms have more than
        `_MAX_TERMS` terms or are constant, and over fields other than QQ and GF(p).
        """
        if any(entry for i, row in enumerate(self.terms) for j, entry in enumerate(row[:-1]) if j != i):
            return None
        if self.over is not QQ and not isinstance(self.over, PrimeField):
            return None
        rows = self.polynomials()
        if any(row[i].is_zero() for i, row in enumerate(rows)):
            return None
        denominator = reduce(lambda P, Q: P * (Q / P.gcd(Q)), (row[i] for i, row in enumerate(rows)))
        forms = [-row[-1] * (denominator / row[i]) for i, row in enumerate(rows)] + [denominator]
        # If some P_i/Q_i is not in lowest terms, the common denominator may share a factor with all numerators.
        common_factor = reduce(lambda P, Q: P.gcd(Q), forms)
        forms = [form / common_factor for form in forms]
        degree = forms[-1].total_degree()
        if degree > 1:
            exponents = sorted({tuple(map(int, m)) for form in forms for m in form.monoms()})
        else:
            exponents = [tuple(int(i == k) for i in range(self.dim + 1)) for k in range(self.dim + 1)]
        if degree < 1 or sum(map(len, forms)) > _MAX_TERMS:
            return None
        index = {exponent: k for k, exponent in enumerate(exponents)}
        terms = (tuple((index[tuple(map(int, m))], self.over.convert(c)) for m, c in form.terms()) for form in forms)
        return Equation(self.over, tuple(exponents), (tuple(terms),))

    def polynomials(self) -> list[list[Any]]:
        """Return L over QQ or GF(p), p < 2^63, as a matrix of polynomials in x1, ..., xn, z."""
        names = (*(f"x{k}" for k in range(1, len(self.exponents[0]))), "z")
        context: Any
        if isinstance(self.over, PrimeField):
            context = nmod_mpoly_ctx.get(names, modulus=self.over.prime, ordering=Ordering.degrevlex)
        else:
            context = fmpq_mpoly_ctx.get(names, Ordering.degrevlex)
        coefficient_type = int if isinstance(self.over, PrimeField) else fmpq
        return [
            [context.from_dict({self.exponents[k]: coefficient_type(value) for k, value in entry}) for entry in row]
            for row in self.terms
        ]

    def transposed(self) -> Equation:
        """Return the equation of the inverse map, where x and x~ are exchanged (up to sign); degree 1 is required."""
        if self.degree != 1:
            raise InputError(f"found an equation of degree {self.degree} in the point, expected degree 1")
        n = self.dim
        terms = []
        for row in self.terms:
            columns: list[list[tuple[int, Any]]] = [[] for _ in range(n + 1)]
            with self.over.working():  # outside of this context, the negative of a ball has FLINT's default precision
                for j, entry in enumerate(row):
                    for k, coefficient in entry:
                        columns[k].append((j, -coefficient))
            terms.append(tuple(tuple(column) for column in columns))
        return Equation(self.over, self.exponents, tuple(terms))


def equation_of(rows: Iterable[Sequence[fmpq_mpoly]], over: Field, point: Sequence[Any]) -> Equation:
    """Return the equation with these `rows` of (M | -r) over a field; `point` gives the values of the symbols and eps.

    Raises BadPrime if a coefficient has no reduction modulo the prime.
    """
    rows = list(rows)
    n = len(rows)
    context = ring(names_of(rows[0][-1])[n:])
    rows_by_monomial: list[list[dict[Exponents, Any]]] = []
    for row in rows:
        entries: list[dict[Exponents, Any]] = []
        for entry in row:
            coefficients: dict[Exponents, dict[tuple[int, ...], fmpq]] = {}
            for monomial, coefficient in entry.terms():
                coefficients.setdefault(tuple(monomial[:n]), {})[tuple(monomial[n:])] = coefficient
            with over.working():
                entries.append({m: evaluate(context.from_dict(c), over, point) for m, c in coefficients.items()})
        rows_by_monomial.append(entries)
    degree = max((sum(m) for row in rows_by_monomial for entry in row for m in entry), default=0)
    if degree <= 1:
        exponents = [tuple(int(i == k) for i in range(n + 1)) for k in range(n + 1)]
    else:
        monomials = dict.fromkeys(m for row in rows_by_monomial for entry in row for m in entry)
        exponents = [(*m, degree - sum(m)) for m in monomials]
    is_exact = over is QQ or over.characteristic > 0  # a ball that contains 0 may represent a nonzero number
    index = {exponent[:n]: k for k, exponent in enumerate(exponents)}
    terms = tuple(
        tuple(tuple((index[m], c) for m, c in entry.items() if not is_exact or c != 0) for entry in row)
        for row in rows_by_monomial
    )
    return Equation(over, tuple(exponents), terms)
