"""Steps that give one coordinate after the other, as those of explicit maps do: on fractions, with few gcds.

Each row of M x~ = r has one unknown that those before it have not. With x_k = p_k/q_k in lowest terms its entries are
made forms of each pair (p_k, q_k), whose integers are shorter than those over a common denominator, since a coordinate
that does not stand in the row is not there.

Often the right side and the coefficient of the unknown are monomials in all coordinates but one. What two forms S and P
of one degree in that (p, q) have in common divides their resultant R, which is a number of the map: R p^k and R q^k are
combinations of S and P, and p and q have no common factor. So no long gcd is needed there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flint import fmpz, fmpz_mat

from kahanmaps.maps.orbits.integer_point import Fraction, FractionsPoint, IntegerPoint

Exponents = Sequence[tuple[int, ...]]

_MOST_DEGREE = 12  # a resultant of forms of higher degree is long itself, and takes long to find


@dataclass(frozen=True, eq=False)
class _Row:
    """The entries that are not 0 of a row: exponents of p_k and q_k in each monomial, and coefficients of these."""

    unknown: int
    known: tuple[int, ...]
    powers: tuple[tuple[tuple[int, int, int], ...], ...]
    entries: fmpz_mat  # the rows are those of the unknown, of the known ones, and of the right side
    divisors: tuple[int, ...]  # coordinates that divide all that is on the left
    resultant: fmpz  # that what the first and the last entry have in common divides; 0 where none is known
    factors: tuple[tuple[int, int], ...]  # coordinates with their exponents, left out of the entries

    def solved(self, point: Sequence[Fraction], found: Sequence[Fraction]) -> Fraction | None:
        """The unknown; None where its coefficient is 0."""
        monomials = fmpz_mat(len(self.powers), 1, [_monomial(factors, point) for factors in self.powers])
        below, *others, above = (self.entries * monomials).entries()
        if below == 0 or any(point[x][0] == 0 for x in self.divisors):
            return None
        if self.resultant:
            common = self.resultant.gcd(above % self.resultant).gcd(below % self.resultant)
            value = above // common, below // common
        else:
            value = above, fmpz(1)
            for k, entry in zip(self.known, others, strict=True):
                value = _sum(value, _product((-entry, fmpz(1)), found[k]))
            common = value[0].gcd(below)
            value = value[0] // common, value[1] * (below // common)
        for x, exponent in self.factors:
            p, q = (entry ** abs(exponent) for entry in point[x])
            value = _product(value, (p, q) if exponent > 0 else (q, p))
        sign = -1 if value[1] < 0 else 1
        return sign * value[0], sign * value[1]


class Substitution:
    """The rows in the order in which they are solved."""

    def __init__(self, rows: Sequence[_Row]) -> None:
        self._rows = rows

    def step(self, point: IntegerPoint) -> IntegerPoint | None:
        """The image, or None where the map has no value."""
        here = point.lowest_terms()
        image = list(here)
        for row in self._rows:
            value = row.solved(here, image)
            if value is None:
                return None
            image[row.unknown] = value
        return FractionsPoint(image)


def substitution(exponents: Exponents, forms: fmpz_mat, n: int) -> Substitution | None:
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
        solved.append(_row(rows[i], unknown, tuple(j for j in used[i] if j in known), exponents))
        left.remove(i)
    return Substitution(solved)


def _row(row: Sequence[Sequence[fmpz]], unknown: int, known: tuple[int, ...], exponents: Exponents) -> _Row:
    n = len(row) - 1
    entries = [row[j] for j in (unknown, *known, n)]
    used = [k for k in range(len(exponents)) if any(entry[k] for entry in entries)]
    least = [min(exponents[k][x] for k in used) for x in range(n)]
    shifted = {k: [exponents[k][x] - least[x] for x in range(n)] for k in used}
    resultant, factors = fmpz(0), dict[int, int]()
    if not known and any(entries[-1]):
        left, monomial = _factors(entries[0], entries[-1], shifted, n)
        if len(left) < 2:  # otherwise one gcd of longer integers takes less time than three
            variable, factors = left[0] if left else 0, monomial
            shifted = {k: [e if x in left else 0 for x, e in enumerate(shifted[k])] for k in used}
            resultant = _resultant(*({shifted[k][variable]: entry[k] for k in used if entry[k]} for entry in entries))
    most = [max(powers[x] for powers in shifted.values()) for x in range(n)]
    on_left = [k for k in used if any(entry[k] for entry in entries[:-1])]
    return _Row(
        unknown,
        known,
        tuple(tuple((x, e, most[x] - e) for x, e in enumerate(shifted[k]) if most[x]) for k in used),
        fmpz_mat([[entry[k] for k in used] for entry in entries]),
        tuple(x for x in range(n) if min(exponents[k][x] for k in on_left) > 0),
        resultant,
        tuple(factors.items()),
    )


def _factors(
    below: Sequence[fmpz], above: Sequence[fmpz], exponents: dict[int, list[int]], n: int
) -> tuple[list[int], dict[int, int]]:
    """The variables in which not both are monomials, and what exponents the others have in above / below."""
    S, P = ([powers for k, powers in exponents.items() if entry[k]] for entry in (above, below))
    left = [x for x in range(n) if any(len({powers[x] for powers in one}) != 1 for one in (S, P))]
    factors = {x: S[0][x] - P[0][x] for x in range(n) if x not in left}
    return left, {x: exponent for x, exponent in factors.items() if exponent}


def _resultant(*forms: dict[int, fmpz]) -> fmpz:
    """Of two forms in (p, q), made of one degree; the coefficients stand at the exponents of p. 0 if it is high."""
    degree = max(max(form) for form in forms)
    if degree > _MOST_DEGREE:
        return fmpz(0)
    rows = [
        [form.get(degree - (k - shift), fmpz(0)) for k in range(2 * degree)]
        for form in forms
        for shift in range(degree)
    ]
    return abs(fmpz_mat(rows).det()) if degree else forms[0][0].gcd(forms[1][0])


def _product(a: Fraction, b: Fraction) -> Fraction:
    """Of fractions without common factors, whatever the signs; the gcds are those of `a` with `b`."""
    one, other = a[0].gcd(b[1]), b[0].gcd(a[1])
    return (a[0] // one) * (b[0] // other), (a[1] // other) * (b[1] // one)


def _sum(a: Fraction, b: Fraction) -> Fraction:
    """Of fractions in lowest terms."""
    shared = a[1].gcd(b[1])
    above = a[0] * (b[1] // shared) + b[0] * (a[1] // shared)
    again = above.gcd(shared)
    return above // again, (a[1] // shared) * (b[1] // again)


def _monomial(factors: Sequence[tuple[int, int, int]], point: Sequence[Fraction]) -> fmpz:
    total = fmpz(1)
    for x, above, below in factors:
        p, q = point[x]
        if above:
            total *= p**above
        if below:
            total *= q**below
    return total
