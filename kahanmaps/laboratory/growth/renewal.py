"""The degrees of all iterates from the singularity patterns: the renewal equation.

Let C_i be the irreducible hypersurfaces that a birational map of degree d of projective space may contract. In step t
along a generic curve through C_i, let mu_i(t) be the power of the curve parameter that is divided out, and nu_ij(t) the
order of the form of C_j. If a generic line meets the strict preimage of C_i by the k-th iterate in s_i(k) points,

    d_(k+1) = d d_k - sum over i, l <= k of mu_i(k+1-l) s_i(l)
    s_i(k)  = deg(C_i) d_k - sum over j, l < k of nu_ji(k-l) s_j(l)

for the degrees d_k of the iterates, d_0 = 1: the factors that are divided out are powers of the forms of these
preimages, and the zeros of the form of C_i along the image of the line lie in such preimages, too. For the generating
functions in z, this is a linear system over Q(z). docs/mathematics.md has the proof. Only mu and nu are measured.
"""

from __future__ import annotations

from collections.abc import Sequence

from flint import fmpz_poly

from kahanmaps.laboratory.growth.recurrences import Recurrence, find_recurrence, needed_checks
from kahanmaps.laboratory.singular.following import Fraction, OrbitData


def degree_series(
    degrees: Sequence[int], hypersurfaces: Sequence[tuple[int, OrbitData]], stages: Sequence[int] = ()
) -> Fraction:
    """Return the generating function of the degrees d_0 = 1, d_1, ... of the iterates, in lowest terms; exact.

    Args:
        degrees: a list with the degree d_1 of the map; for a composition, the degrees of its factors, which are applied
            periodically.
        hypersurfaces: pairs (degree, settled orbit data) of the exceptional hypersurfaces. The rows of the data have
            columns for the hypersurfaces, in this order. All multiplicities of needed hypersurfaces must be known.
        stages: for a composition, the index (from 0) of the factor that contracts each hypersurface. The series then
            has the degrees of the iterates of the composition only, while the exponent of z counts factors.

    Source: docs/mathematics.md.

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
    patterns = [pattern for _, pattern in hypersurfaces]
    indices = needed_hypersurfaces(patterns)
    if indices is None:
        raise ValueError("expected known multiplicities of all hypersurfaces that are needed")
    # Unknowns: series S_i of needed hypersurfaces, then degree series D of stages 1, 2, ..., 0. Constants come last.
    period, rows = len(degrees), []
    stages = stages or [0] * len(patterns)

    def add_term(row: list[Fraction], k: int, term: fmpz_poly) -> None:
        numerator, denominator = row[k]
        row[k] = numerator + term * denominator, denominator

    for i, k in enumerate(indices):
        row = [_continued_series(patterns, j, k + 1) for j in indices] + [(zero, one)] * (period + 1)
        add_term(row, i, one)
        add_term(row, len(indices) + (stages[k] - 1) % period, fmpz_poly([-hypersurfaces[k][0]]))
        rows.append(row)
    for stage, degree in enumerate(degrees, 1):
        mu = []
        for j in indices:
            series, first_exponent = _continued_series(patterns, j, 0), (stage - stages[j]) % period
            if period > 1:  # keep the terms with exponents first_exponent + k period
                numerator, denominator = (f(z**period) for f in every_nth(series, period, first_exponent))
                series = numerator * z**first_exponent, denominator
            mu.append(series)
        row = [*mu, *[(zero, one)] * period, (-one if stage == period else zero, one)]
        add_term(row, len(indices) + stage - 1, one)
        add_term(row, len(indices) + (stage - 2) % period, -degree * z)
        rows.append(row)
    cleared_rows = []
    for row in rows:
        common_denominator = one
        for _, denominator in row:
            common_denominator = common_denominator * (denominator // common_denominator.gcd(denominator))
        cleared_rows.append([numerator * (common_denominator // denominator) for numerator, denominator in row])
    # Fraction-free Gaussian elimination (Bareiss). No pivot is zero: at z = 0 the matrix of the S_i is diagonal.
    previous_pivot = one
    for k, pivot in enumerate(cleared_rows[:-1]):
        for entries in cleared_rows[k + 1 :]:
            factor, pairs = entries[k], zip(entries[k + 1 :], pivot[k + 1 :], strict=True)
            entries[k + 1 :] = [(pivot[k] * e - factor * p) // previous_pivot for e, p in pairs]
        previous_pivot = pivot[k]
    denominator, numerator = cleared_rows[-1][-2], -cleared_rows[-1][-1]
    common_factor = numerator.gcd(denominator)
    numerator, denominator = numerator // common_factor, denominator // common_factor
    sign = 1 if denominator[0] > 0 else -1
    return numerator * sign, denominator * sign


def needed_hypersurfaces(patterns: Sequence[OrbitData]) -> list[int] | None:
    """Return the indices of the hypersurfaces on which the degrees depend; None if a multiplicity of these is unknown.

    These are the hypersurfaces that lower the degree, those with images in one of them, and so on. Multiplicities in
    the hypersurfaces `eventually_in` are unknown; this matters only if such a hypersurface is among the results.

    >>> attracted = OrbitData(((0, 2),), (), 9, True, eventually_in=(0,))
    >>> lowering = OrbitData(((1, 0),), (), 9, True)
    >>> needed_hypersurfaces([attracted])
    []
    >>> needed_hypersurfaces([lowering, OrbitData(((0, 1),), (), 9, True, eventually_in=(0,))]) is None
    True
    """
    # For each hypersurface, the indices of it and of those that continue its pattern, in this order.
    chains = [[k] for k in range(len(patterns))]
    for chain in chains:
        while (continuation := patterns[chain[-1]].continues_as) is not None and continuation[1] not in chain:
            chain.append(continuation[1])
    indices = [k for k, chain in enumerate(chains) if any(row[0] for j in chain for row in patterns[j].rows)]
    for i in indices:
        if any(i in patterns[j].eventually_in for chain in chains for j in chain):
            return None
        sources = (k for k, chain in enumerate(chains) if any(row[i + 1] for j in chain for row in patterns[j].rows))
        indices += [k for k in sources if k not in indices]
    return sorted(indices)


def every_nth(series: Fraction, n: int, first: int = 0) -> Fraction:
    """Return the generating function of the coefficients a_first, a_(first + n), a_(first + 2 n), ... of `series`.

    Exact. The roots of the new denominator are n-th powers of the roots of the given denominator, so that the degree
    does not grow. Raises ArithmeticError if coefficients of the new denominator have more than 520 bits.

    >>> every_nth((fmpz_poly([1]), fmpz_poly([1, -1, -1])), 3)
    ((-1)*x + 1, (-1)*x^2 + (-4)*x + 1)
    """
    numerator, denominator = series
    order = max(int(denominator.degree()), int(numerator.degree()) + 1)
    count = 2 * order + needed_checks(order)
    values = coefficients(series, first + n * count)[first::n]
    recurrence = find_recurrence(values)
    if recurrence is None:
        raise ArithmeticError("the recurrence has coefficients that are too large")
    denominator = fmpz_poly(recurrence.characteristic.coeffs()[::-1])
    return (denominator * fmpz_poly(values[: recurrence.order])).truncate(recurrence.order), denominator


def recurrence_of(series: Fraction, measured: Sequence[int]) -> Recurrence:
    """Return the recurrence of the power series coefficients of a fraction; `measured` are those that were measured.

    >>> recurrence_of((fmpz_poly([1]), fmpz_poly([1, -2])), [1, 2, 4]).text
    'a(n) = 2*a(n-1) for n >= 1, derived from the singularity patterns; 3 measured terms agree'
    """
    numerator, denominator = series
    order = max(int(denominator.degree()), int(numerator.degree()) + 1)
    values = coefficients(series, max(len(measured), order))
    preperiod = [0] * (order - int(denominator.degree()))
    characteristic = fmpz_poly(preperiod + [int(c) for c in denominator.coeffs()[::-1]])
    return Recurrence(tuple(values), characteristic, len(measured))


def coefficients(series: Fraction, count: int) -> list[int]:
    """Return the first `count` power series coefficients of a fraction; its denominator has the constant term 1."""
    numerator, denominator = series
    denominator_coefficients = [int(c) for c in denominator.coeffs()]
    values: list[int] = []
    for n in range(count):
        earlier_sum = sum(c * values[n - k] for k, c in enumerate(denominator_coefficients[1 : n + 1], 1))
        values.append((int(numerator[n]) - earlier_sum) // denominator_coefficients[0])
    return values


def _continued_series(patterns: Sequence[OrbitData], start: int, column: int) -> Fraction:
    """Return the generating function of a column of the pattern with index `start`, continued by other patterns."""
    z = fmpz_poly([0, 1])
    k, shift, numerator = start, 0, fmpz_poly([])
    visited: dict[int, tuple[int, fmpz_poly]] = {}
    while k not in visited:
        visited[k] = shift, numerator
        pattern_numerator, denominator = patterns[k].generating_function(column)
        continuation = patterns[k].continues_as
        if continuation is None:
            return numerator * denominator + z**shift * pattern_numerator, denominator
        numerator += z**shift * pattern_numerator
        shift, k = shift + continuation[0], continuation[1]
    earlier_shift, earlier_numerator = visited[k]
    cycle_factor = 1 - z ** (shift - earlier_shift)
    return earlier_numerator * cycle_factor + numerator - earlier_numerator, cycle_factor
