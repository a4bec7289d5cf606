"""The relations of one degree along orbits, written out: which monomials, which numbers, which integrals.

Of the null space of an orbit the reduced echelon basis is taken for the monomials of the highest degree first, and what
lower degrees imply is left out. A coefficient that is the same for two orbits and both maps is a number; the others are
integrals, named c1, c2, ... Measured, as everything in hirota_kimura.py.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flint import fmpq

from kahanmaps.algebra.polynomials import ring
from kahanmaps.algebra.residues import rational_reconstruction
from kahanmaps.algebra.text import format_number, format_polynomial
from kahanmaps.laboratory.hirota_kimura import relations_on_orbit
from kahanmaps.laboratory.modular_points import ModularMap, echelon, exponents_up_to

_SIMPLE = 10**6  # a number that both maps share and that is no simpler is taken for an accident


@dataclass(frozen=True)
class SparseRelation:
    """A polynomial that vanishes along every orbit, with coefficients that are integrals.

    `terms` are pairs of a monomial and its coefficient: text of a number, or a name such as "c3" for an integral.
    """

    terms: tuple[tuple[str, str], ...]

    @property
    def text(self) -> str:
        """E.g. m1^2 + m2^2 + c1*p3^2 + c2 = 0."""
        parts = []
        for monomial, coefficient in self.terms:
            if monomial == "1":
                parts.append(coefficient)
            elif coefficient in ("1", "-1"):
                parts.append(coefficient[:-1] + monomial)
            else:
                parts.append(f"{coefficient}*{monomial}")
        return " + ".join(parts).replace("+ -", "- ") + " = 0"

    @property
    def integrals(self) -> tuple[str, ...]:
        """The names of the coefficients that are integrals."""
        return tuple(coefficient for _, coefficient in self.terms if coefficient.startswith("c"))


def sparse_relations(
    maps: Sequence[ModularMap], degree: int, variables: Sequence[str], most_terms: int = 12, first: int = 1
) -> tuple[SparseRelation, ...] | None:
    """The relations of degree `degree` that those of lower degree do not imply; None where orbits disagree.

    `maps` are two or more maps of one system, with different primes. A relation with more than `most_terms` terms is
    left out. The names of integrals go through all relations of the degree, from c1 or the given `first` on; those
    that are equal have one name. Raises NoPoint where orbits meet the singular set.

    Source: petrera-pfadler-suris-2009.

    >>> from kahanmaps.laboratory.integrals import Laboratory
    >>> from kahanmaps.systems.catalog import load
    >>> top = load("euler_top")
    >>> [one.text for one in sparse_relations(Laboratory(top).maps, 2, top.variables)]
    ['x1^2 + c1*x3^2 + c2 = 0', 'x2^2 + c3*x3^2 + c4 = 0']
    """
    dim = maps[0].dim
    support = sorted(exponents_up_to(dim, degree), key=lambda e: -sum(e))
    places = {exponent: k for k, exponent in enumerate(exponents_up_to(dim, degree))}
    order = [places[exponent] for exponent in support]
    tables = []
    for map_ in (maps[0], maps[0], maps[1]):
        vectors = relations_on_orbit(map_, degree).vectors
        tables.append(echelon([[vector[k] for k in order] for vector in vectors], map_.prime))
    patterns = {tuple(tuple(bool(c) for c in row) for row in table) for table in tables}
    if len(patterns) != 1:
        return None
    lower = _implied(maps[0], degree, support)
    found = []
    names: dict[tuple[int, int, int], str] = {}
    for one, again, other in zip(*tables, strict=True):
        used = [k for k, entry in enumerate(one) if entry]
        lead = used[0]
        if support[lead] in lower or len(used) > most_terms:
            continue
        terms = []
        for k in used:
            number = _number(one[k], again[k], other[k], maps[0].prime, maps[1].prime)
            if number is None:
                text = names.setdefault((one[k], again[k], other[k]), f"c{first + len(names)}")
            else:
                text = format_number(number)
            terms.append((_monomial(support[k], variables), text))
        found.append(SparseRelation(tuple(terms)))
    return tuple(found)


def _implied(map_: ModularMap, degree: int, support: Sequence[tuple[int, ...]]) -> set[tuple[int, ...]]:
    """The leading monomials of the multiples of all relations of lower degree."""
    if degree == 1:
        return set()
    below = sorted(exponents_up_to(map_.dim, degree - 1), key=lambda e: -sum(e))
    places = {exponent: k for k, exponent in enumerate(exponents_up_to(map_.dim, degree - 1))}
    vectors = relations_on_orbit(map_, degree - 1).vectors
    table = echelon([[vector[places[e]] for e in below] for vector in vectors], map_.prime)
    leads = [below[next(k for k, entry in enumerate(row) if entry)] for row in table]
    return {
        exponent
        for exponent in support
        if any(all(a >= b for a, b in zip(exponent, lead, strict=True)) for lead in leads)
    }


def _number(first: int, again: int, other: int, prime: int, other_prime: int) -> fmpq | None:
    """The rational number that a coefficient is for all orbits, None for an integral."""
    if first != again:
        return None
    value = rational_reconstruction(first, prime)
    if value is None or value != rational_reconstruction(other, other_prime):
        return None
    return value if abs(value.p) < _SIMPLE and value.q < _SIMPLE else None


def _monomial(exponent: tuple[int, ...], variables: Sequence[str]) -> str:
    return format_polynomial(ring(variables).from_dict({exponent: 1}))
