"""The equation of a step over a field: the matrix (M | -r), whose entries are forms of one degree in (X : Z).

The evaluators start from it: integers over one denominator (integer_steps.py), residues (residues/ensemble.py), machine
numbers (floats/steps.py), curves and forms in projective space (projective.py).
"""

from __future__ import annotations

import operator
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.fields import QQ, Field
from kahanmaps.algebra.minors import Product
from kahanmaps.algebra.polynomials import evaluate, names_of, ring
from kahanmaps.errors import InputError

Exponents = tuple[int, ...]
Terms = tuple[tuple[int, Any], ...]


@dataclass(frozen=True, eq=False)
class Equation:
    """The matrix L = (M | -r) over a field, its entries forms of one degree in (X_1, ..., X_n, Z).

    `exponents` lists monomials of that degree in X_1, ..., X_n, Z; entry (i, j) of L is the sum of c times monomial k
    over the pairs (k, c) of `terms[i][j]`. In degree 1 the monomials are X_1, ..., X_n, Z in this order.
    """

    over: Field
    exponents: tuple[Exponents, ...]
    terms: tuple[tuple[Terms, ...], ...]

    @property
    def dim(self) -> int:
        """n."""
        return len(self.terms)

    @cached_property
    def degree(self) -> int:
        """The degree of the forms."""
        return int(sum(self.exponents[0]))

    def monomials(self, X: Sequence[Any], times: Product = operator.mul) -> list[Any]:
        """The values of the monomials at (X_1, ..., X_n, Z), elements of any ring that `times` multiplies."""
        if self.degree == 1:
            return list(X)
        powers: list[list[Any]] = [[None, entry] for entry in X]
        found = []
        for exponent in self.exponents:
            total = None
            for table, e in zip(powers, exponent, strict=True):
                while len(table) <= e:
                    table.append(times(table[-1], table[1]))
                if e:
                    total = table[e] if total is None else times(total, table[e])
            found.append(total)
        return found

    def rows(self, monomials: Sequence[Any], zero: Any) -> list[list[Any]]:
        """L at the point where the monomials have these values."""
        return [
            [sum((monomials[k] * c for k, c in entry[1:]), monomials[entry[0][0]] * entry[0][1]) if entry else zero
             for entry in row]
            for row in self.terms
        ]  # fmt: skip

    def transposed(self) -> Equation:
        """The equation with x and x~ exchanged (and another sign), that of the inverse map; in degree 1 only."""
        if self.degree != 1:
            raise InputError(f"found an equation of degree {self.degree} in the point, expected degree 1")
        n = self.dim
        terms = []
        for row in self.terms:
            columns: list[list[tuple[int, Any]]] = [[] for _ in range(n + 1)]
            with self.over.working():  # or the negative of a ball would have FLINT's default precision
                for j, entry in enumerate(row):
                    for k, coefficient in entry:
                        columns[k].append((j, -coefficient))
            terms.append(tuple(tuple(column) for column in columns))
        return Equation(self.over, self.exponents, tuple(terms))


def equation_of(rows: Iterable[Sequence[fmpq_mpoly]], over: Field, point: Sequence[Any]) -> Equation:
    """The equation of (M | -r) over a field, at values of what stands behind the variables, eps last.

    Raises BadPrime.
    """
    rows = list(rows)
    n = len(rows)
    context = ring(names_of(rows[0][-1])[n:])
    by_monomial: list[list[dict[Exponents, Any]]] = []
    for row in rows:
        found: list[dict[Exponents, Any]] = []
        for entry in row:
            collected: dict[Exponents, dict[tuple[int, ...], fmpq]] = {}
            for monomial, coefficient in entry.terms():
                collected.setdefault(tuple(monomial[:n]), {})[tuple(monomial[n:])] = coefficient
            with over.working():
                found.append({m: evaluate(context.from_dict(c), over, point) for m, c in collected.items()})
        by_monomial.append(found)
    degree = max((sum(m) for row in by_monomial for entry in row for m in entry), default=0)
    if degree <= 1:
        exponents = [tuple(int(i == k) for i in range(n + 1)) for k in range(n + 1)]
    else:
        seen = dict.fromkeys(m for row in by_monomial for entry in row for m in entry)
        exponents = [(*m, degree - sum(m)) for m in seen]
    droppable = over is QQ or over.characteristic > 0  # elsewhere a zero may be uncertain
    place = {exponent[:n]: k for k, exponent in enumerate(exponents)}
    terms = tuple(
        tuple(tuple((place[m], c) for m, c in entry.items() if not droppable or c != 0) for entry in row)
        for row in by_monomial
    )
    return Equation(over, tuple(exponents), terms)
