"""Forward substitution for maps with a triangular equation, such as explicit maps, on points given by fractions.

Each row of M x~ = r contains exactly one unknown that is not in the rows solved before it. Let x_k = p_k/q_k in lowest
terms. The entries of a row are homogenized in each pair (p_k, q_k) separately. The resulting integers are shorter than
integers over a common denominator of all coordinates, since only the coordinates that occur in the row enter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flint import fmpz, fmpz_mat

from kahanmaps.maps.orbits.integer_point import Fraction, FractionsPoint, IntegerPoint

Exponents = Sequence[tuple[int, ...]]


@dataclass(frozen=True, eq=False)
class _Row:
    """A row of the equation: the exponents of p_k and q_k in each monomial, and the coefficients of the entries."""

    unknown: int
    earlier_unknowns: tuple[int, ...]  # the unknowns in the row that are solved before
    powers: tuple[tuple[tuple[int, int, int], ...], ...]
    entries: fmpz_mat  # rows: coefficients of the unknown and of the solved coordinates, then the right-hand side
    divisors: tuple[int, ...]  # indices of the coordinates that divide every entry of M in the row

    def solve_unknown(self, point: Sequence[Fraction], solved_coordinates: Sequence[Fraction]) -> Fraction | None:
        """Return the value of the unknown, given the point and the coordinates solved before; None if undefined."""
        monomials = []
        for powers in self.powers:
            monomial = fmpz(1)
            for x, p_exponent, q_exponent in powers:
                p, q = point[x]
                monomial *= (p**p_exponent if p_exponent else 1) * (q**q_exponent if q_exponent else 1)
            monomials.append(monomial)
        denominator_form, *known_entries, numerator = (self.entries * fmpz_mat(len(monomials), 1, monomials)).entries()
        if denominator_form == 0 or any(point[x][0] == 0 for x in self.divisors):
            return None
        denominator = fmpz(1)
        for k, entry in zip(self.earlier_unknowns, known_entries, strict=True):
            # Compute numerator/denominator - entry p/q with gcds of short numbers only.
            p, q = solved_coordinates[k]
            gcd = entry.gcd(q)
            p, q = entry // gcd * p, q // gcd
            denominator_gcd = denominator.gcd(q)
            numerator = numerator * (q // denominator_gcd) - p * (denominator // denominator_gcd)
            numerator_gcd = numerator.gcd(denominator_gcd)
            numerator, denominator = numerator // numerator_gcd, denominator // denominator_gcd * (q // numerator_gcd)
        gcd = numerator.gcd(denominator_form) if denominator_form > 0 else -numerator.gcd(denominator_form)
        return numerator // gcd, denominator * (denominator_form // gcd)


@dataclass(frozen=True)
class ForwardSubstitution:
    """The step of a map with a triangular equation: the rows, in the order in which they are solved."""

    rows: Sequence[_Row]

    def step(self, point: IntegerPoint) -> IntegerPoint | None:
        """Return the image, or None if the map is not defined at the point."""
        coordinates = point.lowest_terms()
        image = list(coordinates)
        for row in self.rows:
            value = row.solve_unknown(coordinates, image)
            if value is None:
                return None
            image[row.unknown] = value
        return FractionsPoint(image)


def forward_substitution(exponents: Exponents, forms: fmpz_mat, n: int) -> ForwardSubstitution | None:
    """Order the rows of (M | r) for forward substitution; return None if the equation is not triangular.

    `forms` has one row of coefficients for each entry of (M | r), and one column for each monomial in `exponents`.
    """
    form_rows = forms.tolist()
    rows = [form_rows[i * (n + 1) : (i + 1) * (n + 1)] for i in range(n)]
    solved_rows: list[_Row] = []
    remaining_rows = list(range(n))
    # The first row with a single new unknown is always a good choice: a row that can be solved now can be solved later.
    while remaining_rows:
        solved_unknowns = {row.unknown for row in solved_rows}
        unknowns_of_row = {i: [j for j in range(n) if any(rows[i][j])] for i in remaining_rows}
        i = next((i for i in remaining_rows if len(set(unknowns_of_row[i]) - solved_unknowns) == 1), None)
        if i is None:
            return None
        unknown = next(j for j in unknowns_of_row[i] if j not in solved_unknowns)
        earlier_unknowns = tuple(j for j in unknowns_of_row[i] if j in solved_unknowns)
        entries = [rows[i][j] for j in (unknown, *earlier_unknowns, n)]
        terms = [k for k in range(len(exponents)) if any(entry[k] for entry in entries)]
        min_exponents = [min(exponents[k][x] for k in terms) for x in range(n)]
        reduced_exponents = [[exponents[k][x] - min_exponents[x] for x in range(n)] for k in terms]
        max_exponents = [max(powers[x] for powers in reduced_exponents) for x in range(n)]
        matrix_terms = [k for k in terms if any(entry[k] for entry in entries[:-1])]
        row = _Row(
            unknown,
            earlier_unknowns,
            tuple(
                tuple((x, e, max_exponents[x] - e) for x, e in enumerate(powers) if max_exponents[x])
                for powers in reduced_exponents
            ),
            fmpz_mat([[entry[k] for k in terms] for entry in entries]),
            tuple(x for x in range(n) if min(exponents[k][x] for k in matrix_terms) > 0),
        )
        solved_rows.append(row)
        remaining_rows.remove(i)
    return ForwardSubstitution(solved_rows)
