"""Degrees for all times from what happens along the contracted hypersurfaces: their renewal equation.

Let C_i be the irreducible hypersurfaces that a birational map of degree d of projective space may contract, mu_i(t) the
power that is divided out at the t-th step along a generic curve through C_i, and nu_ij(t) the order of C_j there. A
generic line meets the strict preimage of C_i by the k-th iterate in s_i(k) points, and

    d_(k+1) = d d_k - sum over i, l <= k of mu_i(k+1-l) s_i(l)
    s_i(k)  = deg(C_i) d_k - sum over j, l < k of nu_ji(k-l) s_j(l)

with d_0 = 1: what is divided out is a product of powers of the forms of these preimages, and the zeros of C_i along
the image of the line are such preimages too. Summed up as power series in z this is a linear system over Q(z).
docs/mathematics.md proves it. Orders along hypersurfaces are measured, all else follows exactly.
"""

from __future__ import annotations

from collections.abc import Sequence

from flint import fmpz_poly

from kahanmaps.laboratory.growth.recurrences import Recurrence, find_recurrence, needed_checks
from kahanmaps.laboratory.singular.following import Fraction, OrbitData


def degree_series(
    degrees: Sequence[int], hypersurfaces: Sequence[tuple[int, OrbitData]], stages: Sequence[int] = ()
) -> Fraction:
    """The generating function of the degrees d_0 = 1, d_1, ... of the iterates, in lowest terms.

    `degrees` has d_1; of a word of maps, which are applied one after the other and from the beginning again, it has
    those of the maps, `stages` say which of them, from 0, contracts each hypersurface, and the series has the degrees
    after whole words only, with z for a single map. Of each contracted hypersurface its degree and its orders are
    given. These are settled ones, and the columns nu follow the hypersurfaces; orders beyond what is known must not be
    `needed`. Exact. Source: docs/mathematics.md.

    >>> free = OrbitData((), (), 0, True)
    >>> degree_series([2], [(1, free)])
    (1, (-2)*x + 1)
    >>> degree_series([2, 3], [])
    (1, (-6)*x^2 + 1)
    >>> degree_series([3], [(2, OrbitData(((0, 0, 0), (0, 1, 2), (2, 0, 0)), (), 0, True)),
    ...                   (2, OrbitData(((0, 0, 0), (0, 2, 1), (2, 0, 0)), (), 0, True))])
    (3*x^2 + 1, (-1)*x^3 + 3*x^2 + (-3)*x + 1)
    """
    z, one, zero = fmpz_poly([0, 1]), fmpz_poly([1]), fmpz_poly([])
    every = [orders for _, orders in hypersurfaces]
    which = needed(every)
    if which is None:
        raise ValueError("found orders that are not known, expected those needed")
    # The unknowns are S_i, i in `which`, then the D of the stages 1, 2, ..., 0, and 1.
    maps, rows = len(degrees), []
    stages = stages or [0] * len(every)

    def add(row: list[Fraction], k: int, term: fmpz_poly) -> None:
        above, below = row[k]
        row[k] = above + term * below, below

    for i, k in enumerate(which):
        row = [_through_returns(every, j, k + 1) for j in which] + [(zero, one)] * (maps + 1)
        add(row, i, one)
        add(row, len(which) + (stages[k] - 1) % maps, fmpz_poly([-hypersurfaces[k][0]]))
        rows.append(row)
    for stage, degree in enumerate(degrees, 1):
        mu = []
        for j in which:
            series, first = _through_returns(every, j, 0), (stage - stages[j]) % maps
            if maps > 1:  # the part with the exponents first, first + maps, ...
                above, below = (part(z**maps) for part in every_nth(series, maps, first))
                series = above * z**first, below
            mu.append(series)
        row = [*mu, *[(zero, one)] * maps, (-one if stage == maps else zero, one)]
        add(row, len(which) + stage - 1, one)
        add(row, len(which) + (stage - 2) % maps, -degree * z)
        rows.append(row)
    cleared = []
    for row in rows:
        common = one
        for _, below in row:
            common = common * (below // common.gcd(below))
        cleared.append([above * (common // below) for above, below in row])
    # Without fractions, after Bareiss. At z = 0 the matrix in front of the S_i is diagonal: no pivot is zero.
    previous = one
    for k, pivot in enumerate(cleared[:-1]):
        for entries in cleared[k + 1 :]:
            factor, pairs = entries[k], zip(entries[k + 1 :], pivot[k + 1 :], strict=True)
            entries[k + 1 :] = [(pivot[k] * entry - factor * other) // previous for entry, other in pairs]
        previous = pivot[k]
    below, above = cleared[-1][-2], -cleared[-1][-1]
    common = above.gcd(below)
    above, below = above // common, below // common
    sign = 1 if below[0] > 0 else -1
    return above * sign, below * sign


def needed(every: Sequence[OrbitData]) -> list[int] | None:
    """The hypersurfaces of which the degrees of preimages are needed for those of the iterates; None if unknown ones.

    Those that lower degrees, and those that meet such ones or others that do. Orders `beyond` what is known are unknown
    ones where they are those of hypersurfaces needed.

    >>> attracted = OrbitData(((0, 2),), (), 9, True, beyond=(0,))
    >>> needed([attracted]), needed([OrbitData(((1, 0),), (), 9, True), OrbitData(((0, 1),), (), 9, True, beyond=(0,))])
    ([], None)
    """
    chains = [[k] for k in range(len(every))]  # each with those that it becomes, in this order
    for chain in chains:
        while (returns := every[chain[-1]].returns) is not None and returns[1] not in chain:
            chain.append(returns[1])
    found = [k for k, chain in enumerate(chains) if any(row[0] for j in chain for row in every[j].rows)]
    for i in found:
        if any(i in every[j].beyond for chain in chains for j in chain):
            return None
        met_by = (k for k, chain in enumerate(chains) if any(row[i + 1] for j in chain for row in every[j].rows))
        found += [k for k in met_by if k not in found]
    return sorted(found)


def every_nth(series: Fraction, n: int, first: int = 0) -> Fraction:
    """The generating function of the coefficients a_first, a_(first + n), a_(first + 2 n), ... of a fraction.

    Its denominator has the roots to the power -n, so that it is no longer than the given one: exact. Raises
    ArithmeticError where its coefficients have more than 520 bits.

    >>> every_nth((fmpz_poly([1]), fmpz_poly([1, -1, -1])), 3)
    ((-1)*x + 1, (-1)*x^2 + (-4)*x + 1)
    """
    above, below = series
    order = max(int(below.degree()), int(above.degree()) + 1)
    count = 2 * order + needed_checks(order)
    values = coefficients(series, first + n * count)[first::n]
    found = find_recurrence(values)
    if found is None:
        raise ArithmeticError("found a recurrence with coefficients that are too large")
    below = fmpz_poly(found.characteristic.coeffs()[::-1])
    return (below * fmpz_poly(values[: found.order])).truncate(found.order), below


def recurrence_of(series: Fraction, measured: Sequence[int]) -> Recurrence:
    """The recurrence of the coefficients of a fraction, as that of the terms that were `measured` and more.

    >>> recurrence_of((fmpz_poly([1]), fmpz_poly([1, -2])), [1, 2, 4]).text
    'a(n) = 2*a(n-1) for n >= 1, derived from the singularity patterns; 3 measured terms agree'
    """
    above, below = series
    order = max(int(below.degree()), int(above.degree()) + 1)
    values = coefficients(series, max(len(measured), order))
    preperiod = [0] * (order - int(below.degree()))
    characteristic = fmpz_poly(preperiod + [int(c) for c in below.coeffs()[::-1]])
    return Recurrence(tuple(values), characteristic, len(measured))


def coefficients(series: Fraction, count: int) -> list[int]:
    """The first coefficients of a fraction of polynomials with integers, the lower one with the constant term 1."""
    above, below = series
    lower = [int(c) for c in below.coeffs()]
    found: list[int] = []
    for n in range(count):
        earlier = sum(c * found[n - k] for k, c in enumerate(lower[1 : n + 1], 1))
        found.append((int(above[n]) - earlier) // lower[0])
    return found


def _through_returns(every: Sequence[OrbitData], start: int, column: int) -> Fraction:
    """The generating function of a column for one hypersurface, those that it becomes later included."""
    z = fmpz_poly([0, 1])
    k, shift, above = start, 0, fmpz_poly([])
    seen: dict[int, tuple[int, fmpz_poly]] = {}
    while k not in seen:
        seen[k] = shift, above
        part, below = every[k].generating_function(column)
        returns = every[k].returns
        if returns is None:
            return above * below + z**shift * part, below
        above += z**shift * part
        shift, k = shift + returns[0], returns[1]
    begin, before = seen[k]
    around = 1 - z ** (shift - begin)
    return before * around + above - before, around
