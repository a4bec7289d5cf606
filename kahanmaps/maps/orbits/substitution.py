"""Steps that give one coordinate after the other, as those of explicit maps do: on fractions, with few gcds.

Each row of M x~ = r has one unknown that those before it have not. With x_k = p_k/q_k in lowest terms its entries are
made forms of each pair (p_k, q_k), whose integers are shorter than those over a common denominator, since a coordinate
that does not stand in the row is not there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flint import fmpz, fmpz_mat

from kahanmaps.maps.orbits.integer_point import Fraction, FractionsPoint, IntegerPoint

Exponents = Sequence[tuple[int, ...]]


@dataclass(frozen=True, eq=False)
class _Row:
    """The entries that are not 0 of a row: exponents of p_k and q_k in each monomial, and coefficients of these."""

    unknown: int
    known: tuple[int, ...]
    powers: tuple[tuple[tuple[int, int, int], ...], ...]
    entries: fmpz_mat  # the rows are those of the unknown, of the known ones, and of the right side
    divisors: tuple[int, ...]  # coordinates that divide all that is on the left

    def solved(self, point: Sequence[Fraction], found: Sequence[Fraction]) -> Fraction | None:
        """The unknown; None where its coefficient is 0."""
        monomials = []
        for powers in self.powers:
            total = fmpz(1)
            for x, of_p, of_q in powers:
                p, q = point[x]
                total *= (p**of_p if of_p else 1) * (q**of_q if of_q else 1)
            monomials.append(total)
        below, *others, above = (self.entries * fmpz_mat(len(monomials), 1, monomials)).entries()
        if below == 0 or any(point[x][0] == 0 for x in self.divisors):
            return None
        denominator = fmpz(1)
        for k, entry in zip(self.known, others, strict=True):
            # above/denominator - entry p/q, with all gcds of short numbers
            p, q = found[k]
            common = entry.gcd(q)
            p, q = entry // common * p, q // common
            shared = denominator.gcd(q)
            above = above * (q // shared) - p * (denominator // shared)
            again = above.gcd(shared)
            above, denominator = above // again, denominator // shared * (q // again)
        common = above.gcd(below) if below > 0 else -above.gcd(below)
        return above // common, denominator * (below // common)


@dataclass(frozen=True)
class ForwardSubstitution:
    """The rows in the order in which they are solved."""

    rows: Sequence[_Row]

    def step(self, point: IntegerPoint) -> IntegerPoint | None:
        """The image, or None where the map has no value."""
        here = point.lowest_terms()
        image = list(here)
        for row in self.rows:
            value = row.solved(here, image)
            if value is None:
                return None
            image[row.unknown] = value
        return FractionsPoint(image)


def forward_substitution(exponents: Exponents, forms: fmpz_mat, n: int) -> ForwardSubstitution | None:
    """Rows of (M | r) in the order to solve them; None where a row has always several new unknowns.

    `forms` has a row of coefficients for each entry, a column for each of the exponents.
    """
    table = forms.tolist()
    rows = [table[i * (n + 1) : (i + 1) * (n + 1)] for i in range(n)]
    solved: list[_Row] = []
    left = list(range(n))
    while left:
        known = {row.unknown for row in solved}
        used = {i: [j for j in range(n) if any(rows[i][j])] for i in left}
        i = next((i for i in left if len(set(used[i]) - known) == 1), None)
        if i is None:
            return None
        unknown = next(j for j in used[i] if j not in known)
        others = tuple(j for j in used[i] if j in known)
        entries = [rows[i][j] for j in (unknown, *others, n)]
        terms = [k for k in range(len(exponents)) if any(entry[k] for entry in entries)]
        least = [min(exponents[k][x] for k in terms) for x in range(n)]
        shifted = [[exponents[k][x] - least[x] for x in range(n)] for k in terms]
        most = [max(powers[x] for powers in shifted) for x in range(n)]
        on_left = [k for k in terms if any(entry[k] for entry in entries[:-1])]
        row = _Row(
            unknown,
            others,
            tuple(tuple((x, e, most[x] - e) for x, e in enumerate(powers) if most[x]) for powers in shifted),
            fmpz_mat([[entry[k] for k in terms] for entry in entries]),
            tuple(x for x in range(n) if min(exponents[k][x] for k in on_left) > 0),
        )
        solved.append(row)
        left.remove(i)
    return ForwardSubstitution(solved)
