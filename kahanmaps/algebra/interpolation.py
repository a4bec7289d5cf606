"""Interpolation of rational functions over Q from few values modulo primes.

A black box is a function that returns, for a prime p and a point of GF(p)^n, a vector of numbers modulo p. The aim is
to find the rational functions of n symbols that have these values. The steps modulo the first prime are:

    axes    On the line through a random point (the anchor) in the direction of a symbol, each entry of the vector is a
            fraction N/D of polynomials. The fraction of least degree that fits the values gives the exponents of the
            symbol; one value more than needed is a check.
    stages  Symbols are added one by one, while the remaining ones stay at the anchor. The possible monomials are those
            of the previous stage times powers of the new symbol, up to a total degree known from a random line. The
            linear system N(s_k) = v_k D(s_k) for values v_k at points s_k has the coefficients as solution.

All values computed so far are reused as equations. Entries with the same denominator share its unknown coefficients.
Modulo further primes the monomials are known. The coefficients follow by the Chinese remainder theorem, and the
functions must agree with the black box at new points modulo new primes. If the black box has the values of a rational
function over Q, a wrong answer passes at each of these points with probability about degree/2^60 (schwartz-1980). Only
these points support the assumption that the black box is rational: this is strong evidence, not a proof.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from flint import nmod_mat, nmod_poly

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.algebra.residues import chinese, random_prime, rational_reconstruction, rational_vector
from kahanmaps.algebra.work import Budget, count_work
from kahanmaps.errors import BadPrime, InputError

__all__ = ["Reconstruction", "rational_reconstruction", "rational_vector", "reconstruct"]


_MAX_UNLUCKY_PRIMES = 3  # after this number of failures the black box is declared not rational
# New primes with one test each; a black box such as the Legendre symbol passes each test with probability 1/2.
_CONFIRMING_PRIMES = 5


Point = tuple[int, ...]
Exponents = tuple[int, ...]
BlackBox = Callable[[int, Point], Sequence[int] | None]

NONE_FIXED: Mapping[int, int] = MappingProxyType({})
_MAX_BAD_POINTS = 20  # consecutive points without a value, before another prime is tried
_MAX_DETERMINING = 4  # entries that determine their common denominator; more would only enlarge the matrices


class Stop(Exception):
    """The interpolation failed, and another prime would not help."""


class Unlucky(Exception):
    """The interpolation failed for this prime or these points; another prime may work."""


@dataclass
class Samples:
    """The limits on calls of the black box, the number of `calls` so far, and the `length` of the lists it returns."""

    max_samples: int
    budget: Budget | None
    calls: int = 0
    length: int | None = None

    def check(self, needed: int = 0) -> None:
        """Raise Stop if `calls` + `needed` exceeds the limit, or if the budget is spent."""
        if self.calls + needed > self.max_samples:
            raise Stop(f"{self.calls} values requested and {needed} more needed, the limit is {self.max_samples}")
        if self.budget is not None and self.budget.is_spent:
            raise Stop(f"work limit reached after {self.calls} values; raise --effort")


class SampledValues:
    """Points modulo one prime, and at each point the values of the black box and cached values of monomials."""

    def __init__(self, black_box: BlackBox, prime: int, samples: Samples) -> None:
        self.prime = prime
        self.samples = samples
        self.points: list[Point] = []
        self.values: list[tuple[int, ...]] = []
        self._black_box = black_box
        self._monomial_values: list[dict[Exponents, int]] = []

    def take(self, draw: Callable[[], Point]) -> None:
        """Draw points until the black box has values at one of them; store this point and the values."""
        for _ in range(_MAX_BAD_POINTS):
            self.samples.check(1)
            point = draw()
            self.samples.calls += 1
            answer = self._black_box(self.prime, point)
            if answer is not None:
                values = tuple(int(value) % self.prime for value in answer)
                if self.samples.length is None:
                    self.samples.length = len(values)
                if len(values) != self.samples.length:
                    lengths_text = f"{self.samples.length} and {len(values)}"
                    raise InputError(f"found values of lengths {lengths_text}, expected equally many at all points")
                self.points.append(point)
                self.values.append(values)
                self._monomial_values.append({})
                return
            if not point:
                break
        raise Unlucky(f"no value modulo {self.prime} at {_MAX_BAD_POINTS} points in a row")

    def random_points(
        self, nvars: int, rng: random.Random, fixed: Mapping[int, int] = NONE_FIXED
    ) -> Callable[[], Point]:
        """Return a function that draws random points; `fixed` maps indices of coordinates to fixed values."""
        return lambda: tuple(fixed[i] if i in fixed else rng.randrange(1, self.prime) for i in range(nvars))

    def monomials(self, k: int, exponents: Sequence[Exponents]) -> list[int]:
        """Return the values of the monomials with these exponents at `points[k]`."""
        known_values, point, p = self._monomial_values[k], self.points[k], self.prime
        values = []
        for monomial in exponents:
            value = known_values.get(monomial)
            if value is None:
                value = 1
                for base, exponent in zip(point, monomial, strict=True):
                    if exponent:
                        value = value * pow(base, exponent, p) % p
                known_values[monomial] = value
            values.append(value)
        return values


@dataclass(frozen=True)
class Shape:
    """The monomials of a numerator and a denominator; the `leading_monomial` of the denominator has coefficient 1."""

    numerator: tuple[Exponents, ...]
    denominator: tuple[Exponents, ...]

    @property
    def leading_monomial(self) -> Exponents:
        return max(self.denominator)

    @property
    def unknowns(self) -> int:
        return len(self.numerator) + len(self.denominator)


@dataclass(frozen=True)
class Quotient:
    """A fraction modulo a prime: the coefficients of its two polynomials, in the order of the monomials of `shape`."""

    shape: Shape
    numerator: tuple[int, ...]
    denominator: tuple[int, ...]

    @classmethod
    def of(cls, shape: Shape, numerator: Sequence[int], denominator: Sequence[int], prime: int) -> Quotient | None:
        """Return the fraction without zero terms, scaled to the leading coefficient 1; None if the denominator is 0."""
        numerator_terms = {monomial: c for monomial, c in zip(shape.numerator, numerator, strict=True) if c}
        denominator_terms = {monomial: c for monomial, c in zip(shape.denominator, denominator, strict=True) if c}
        if not denominator_terms:
            return None
        nonzero_shape = Shape(tuple(numerator_terms), tuple(denominator_terms))
        factor = pow(denominator_terms[nonzero_shape.leading_monomial], -1, prime)
        return cls(
            nonzero_shape,
            tuple(c * factor % prime for c in numerator_terms.values()),
            tuple(c * factor % prime for c in denominator_terms.values()),
        )


@dataclass(frozen=True)
class Reconstruction:
    """The result of `reconstruct`: the `functions`, or None and the `reason` for the failure.

    `samples` is the number of calls of the black box, including calls that give no value; `primes` are the primes used.
    """

    functions: tuple[RationalFunction, ...] | None
    reason: str
    samples: int
    primes: tuple[int, ...]


def reconstruct(
    black_box: BlackBox,
    names: Sequence[str],
    *,
    seed: int = 0,
    max_degree: int = 40,
    max_samples: int = 3000,
    budget: Budget | None = None,
    draw: Callable[[random.Random], int] = random_prime,
) -> Reconstruction:
    """Interpolate rational functions over Q of the symbols `names` from values of a black box.

    Args:
        black_box: `black_box(prime, point)` returns a list of values modulo the prime, of constant length, at a point
            with one integer for each name; None if there is no value, for example at a pole.
        names: the symbols. Without symbols, the numbers themselves are reconstructed from their residues.
        seed: the random seed of primes (of 61 bits) and points.
        max_degree: on a line, the degrees of numerator and denominator may add up to twice this number.
        max_samples: the maximal number of calls of the black box.
        budget: the work limit, checked between calls; None means no limit.
        draw: a function that draws a random prime, for black boxes that accept only some primes.

    Returns:
        A `Reconstruction`: functions in lowest terms, or None and a reason. A black box that is not rational, or is
        inconsistent between primes, gives None. The functions have been compared with the black box at new points
        modulo new primes: strong evidence, not proof.

    Raises:
        InputError: if the black box returns values of different lengths.

    >>> def box(p, point):
    ...     x, y = point
    ...     return [(x + y) * pow(3 * x * y + 1, -1, p), 5 * pow(7, -1, p)]
    >>> result = reconstruct(box, ["x", "y"])
    >>> [f"({f.numerator})/({f.denominator})" for f in result.functions], result.samples
    (['(x + y)/(3*x*y + 1)', '(5/7)/(1)'], 17)
    >>> reconstruct(lambda p, point: [pow(point[0], (p + 5) // 2, p)], ["x"]).reason
    'not the values of a rational function of degree at most 40 along a line'
    """
    rng = random.Random(seed)
    samples = Samples(max_samples, budget)
    primes: list[int] = []

    def sample_new_prime() -> SampledValues:
        prime = draw(rng)
        while prime in primes:
            prime = draw(rng)
        primes.append(prime)
        return SampledValues(black_box, prime, samples)

    reason = ""
    try:
        for _ in range(_MAX_UNLUCKY_PRIMES):
            try:
                functions = _lift(
                    _interpolate_modulo_prime(sample_new_prime(), len(names), max_degree, rng),
                    sample_new_prime,
                    tuple(names),
                    primes,
                    rng,
                )
                return Reconstruction(functions, "", samples.calls, tuple(primes))
            except Unlucky as unlucky:
                reason = str(unlucky)
    except Stop as stop:
        reason = str(stop)
    return Reconstruction(None, reason, samples.calls, tuple(primes))


# -- modulo the first prime --------------------------------------------------------------------------------------------


def _interpolate_modulo_prime(values: SampledValues, nvars: int, max_degree: int, rng: random.Random) -> list[Quotient]:
    """Return the entries of the black box, functions of `nvars` symbols, as quotients modulo the prime of `values`."""
    p = values.prime
    values.take(values.random_points(nvars, rng))
    anchor = values.points[0]
    one: Exponents = (0,) * nvars
    entries = range(len(values.values[0]))
    quotients = [Quotient(Shape((one,) if v else (), (one,)), (v,) if v else (), (1,)) for v in values.values[0]]
    axes = []
    for j in range(nvars):
        direction = tuple(int(i == j) for i in range(nvars))
        axes.append(_interpolate_on_line(values, anchor, direction, max_degree, rng))
    # Symbols of large degree come first: each new symbol multiplies the number of monomials in the earlier symbols.
    symbol_order = sorted(range(nvars), key=lambda j: -max((_deg(N) + _deg(D) for N, D in axes[j]), default=0))
    denominator_texts: list[list[str]] = [[] for _ in entries]
    for stage, j in enumerate(symbol_order):
        stage_symbols = symbol_order[: stage + 1]
        for i in entries:
            denominator_texts[i].append(str(axes[j][i][1]))
        dependents = [i for i in entries if _deg(axes[j][i][0]) or _deg(axes[j][i][1])]
        for i in dependents:
            if quotients[i].shape.unknowns <= 2 and set(
                quotients[i].shape.numerator + quotients[i].shape.denominator
            ) <= {one}:
                N, D = ([int(c) for c in polynomial.coeffs()] for polynomial in axes[j][i])
                powers = [tuple(e if k == j else 0 for k in range(nvars)) for e in range(max(len(N), len(D)))]
                quotient = Quotient.of(Shape(tuple(powers[: len(N)]), tuple(powers[: len(D)])), N, D, p)
                assert quotient is not None  # D is monic
                quotients[i] = quotient
        dependents = [
            i
            for i in dependents
            if any(sum(m) != m[j] for m in (*quotients[i].shape.numerator, *quotients[i].shape.denominator))
        ]
        if not dependents:
            continue
        shapes = {}
        for i in dependents:  # monomials in the earlier symbols times powers of symbol j that occur on axis j
            sides = zip((quotients[i].shape.numerator, quotients[i].shape.denominator), axes[j][i], strict=True)
            shapes[i] = Shape(
                *(
                    tuple((*m[:j], e, *m[j + 1 :]) for m in monomials for e, c in enumerate(side.coeffs()) if int(c))
                    for monomials, side in sides
                )
            )
        limit = max(sum(_deg(axes[a][i][0]) + _deg(axes[a][i][1]) for a in stage_symbols) + 2 for i in dependents)
        if max(shape.unknowns for shape in shapes.values()) > limit:
            direction = tuple(rng.randrange(1, p) if i in stage_symbols else 0 for i in range(nvars))
            line_fractions = _interpolate_on_line(values, anchor, direction, max_degree, rng)
            for i in dependents:
                denominator_texts[i].append(str(line_fractions[i][1]))
                shapes[i] = Shape(
                    tuple(m for m in shapes[i].numerator if sum(m) <= _deg(line_fractions[i][0])),
                    tuple(m for m in shapes[i].denominator if sum(m) <= _deg(line_fractions[i][1])),
                )
        groups: dict[tuple[str, ...], list[int]] = {}
        for i in dependents:
            groups.setdefault(tuple(denominator_texts[i]), []).append(i)
        numerator_texts = [str(N / N.leading_coefficient()) if int(N.degree()) >= 0 else "" for N, _ in axes[j]]
        split_groups = [split_group(group, [numerator_texts[i] for i in group], shapes) for group in groups.values()]
        fixed = {i: anchor[i] for i in symbol_order[stage + 1 :]}
        for i, quotient in fit(values, shapes, split_groups, nvars, rng, fixed).items():
            quotients[i] = quotient
    return quotients


def _deg(polynomial: nmod_poly) -> int:
    """Return the degree, but 0 for the zero polynomial."""
    return max(0, int(polynomial.degree()))


def _interpolate_on_line(
    values: SampledValues, anchor: Point, direction: Point, max_degree: int, rng: random.Random
) -> list[tuple[nmod_poly, nmod_poly]]:
    """Interpolate all entries on the line anchor + t direction as fractions (N, D) of polynomials in t, D monic.

    If the line has the direction of one symbol, t is this symbol, so N and D have the exponents of the symbol.
    """
    p = values.prime
    symbols = [i for i, d in enumerate(direction) if d]
    t0 = anchor[symbols[0]] if len(symbols) == 1 else 0
    nodes = [t0]

    def draw() -> Point:
        t = rng.randrange(p)
        while t in nodes:
            t = rng.randrange(p)
        nodes.append(t)
        return tuple((a + (t - t0) * d) % p for a, d in zip(anchor, direction, strict=True))

    # In Newton's form, each new point adds one term to each interpolating polynomial. The degrees of the fractions are
    # not known, so points are taken one by one until all fractions are determined.
    entries = range(len(values.values[0]))
    node_polynomial = nmod_poly([-t0, 1], p)
    interpolants = [nmod_poly([v], p) for v in values.values[0]]
    fractions: list[tuple[nmod_poly, nmod_poly] | None] = [None for _ in entries]
    n = 1
    while any(fraction is None for fraction in fractions):
        if n > 2 * max_degree + 2:
            raise Stop(f"not the values of a rational function of degree at most {max_degree} along a line")
        values.take(draw)
        t, n = nodes[-1], n + 1
        inverse = 1 / node_polynomial(t)
        for i in entries:
            if fractions[i] is None:
                values.samples.check()
                count_work(5 + n * (1 + n / 100))
                interpolants[i] += node_polynomial * ((values.values[-1][i] - interpolants[i](t)) * inverse)
        node_polynomial *= nmod_poly([-t, 1], p)
        for i in entries:
            if fractions[i] is None:
                fractions[i] = _least_fraction(interpolants[i], node_polynomial, n)
    return [fraction for fraction in fractions if fraction is not None]


def _least_fraction(interpolant: nmod_poly, node_polynomial: nmod_poly, n: int) -> tuple[nmod_poly, nmod_poly] | None:
    """Return (N, D) with N/D = `interpolant` at n nodes, deg N + deg D <= n - 2 and D monic; None if there is none."""
    p = interpolant.modulus()
    previous, current = (node_polynomial, nmod_poly([0], p)), (interpolant, nmod_poly([1], p))
    while True:
        N, D = current
        if _deg(N) + _deg(D) <= n - 2:
            if int(D.gcd(node_polynomial).degree()) > 0:
                return None
            leading_coefficient = D.leading_coefficient()
            return N / leading_coefficient, D / leading_coefficient
        if int(N.degree()) <= 0:
            return None
        quotient, remainder = divmod(previous[0], N)
        previous, current = current, (remainder, previous[1] - quotient * D)


# -- the linear systems: quotients with given monomials from values modulo a prime ------------------------------------
#
# A value v = N(s)/D(s) at a point s is a linear equation N(s) - v D(s) = 0 for the coefficients of N and D. Enough
# equations determine N and D up to a scalar, provided that the monomials allow no common factor of N and D.


def split_group(group: list[int], numerators: Sequence[str], shapes: dict[int, Shape]) -> tuple[list[int], list[int]]:
    """Split a group of entries with the same denominator into some that determine the denominator, and all others.

    Entries with proportional numerators give the same equations, so only one of them is in the first list.
    """
    if len(shapes[group[0]].denominator) == 1:
        return group[:1], group[1:]
    entry_by_numerator = dict(reversed(list(zip(numerators, group, strict=True))))
    determining_entries = sorted(entry_by_numerator.values())[:_MAX_DETERMINING]
    return determining_entries, [i for i in group if i not in determining_entries]


def fit(
    values: SampledValues,
    shapes: dict[int, Shape],
    split_groups: list[tuple[list[int], list[int]]],
    nvars: int,
    rng: random.Random,
    fixed: Mapping[int, int] = NONE_FIXED,
) -> dict[int, Quotient]:
    """Return, for each entry, the fraction of the given shape that agrees with all values; compute missing values.

    The values at the last point are a check only. Only points with the coordinates `fixed` = {index: value} are used.
    """
    quotients: dict[int, Quotient] = {}
    draw = values.random_points(nvars, rng, fixed)
    values.take(draw)
    while True:
        point_indices = [k for k, point in enumerate(values.points) if all(point[i] == v for i, v in fixed.items())]
        needed = 0
        for determining_entries, other_entries in split_groups:
            if determining_entries[0] not in quotients:
                needed = max(needed, _solve(values, point_indices, shapes, determining_entries, None, quotients))
            if determining_entries[0] in quotients:
                denominator = quotients[determining_entries[0]]
                for i in other_entries:
                    if i not in quotients:
                        needed = max(needed, _solve(values, point_indices, shapes, [i], denominator, quotients))
        if needed == 0:
            return quotients
        values.samples.check(needed)
        for _ in range(needed):
            values.take(draw)


def _solve(
    values: SampledValues,
    point_indices: list[int],
    shapes: dict[int, Shape],
    entries: list[int],
    known_denominator: Quotient | None,
    quotients: dict[int, Quotient],
) -> int:
    """Compute the fractions of entries that have the same denominator, and store them in `quotients`.

    Returns the number of missing values, 0 on success. Raises Unlucky if no fractions with these shapes fit the values.
    """
    p = values.prime
    values.samples.check()
    denominator = shapes[entries[0]].denominator if known_denominator is None else known_denominator.shape.denominator
    widths = [len(shapes[i].numerator) for i in entries]
    # The equations do not use the last point, which is a check. Without symbols, all points are the same.
    test_index = point_indices[-1]
    rows: list[int] = []
    height = 0
    for k in point_indices[:-1] if values.points[0] else point_indices[:1]:
        denominator_values = values.monomials(k, denominator)
        if known_denominator is not None:
            denominator_values = [
                sum(c * m for c, m in zip(known_denominator.denominator, denominator_values, strict=True)) % p
            ]
        offset = 0
        for i, width in zip(entries, widths, strict=True):
            v = p - values.values[k][i]
            rows += [0] * offset + values.monomials(k, shapes[i].numerator) + [0] * (sum(widths) - offset - width)
            rows += [v * m % p for m in denominator_values]
            offset += width
            height += 1
    width = sum(widths) + (len(denominator) if known_denominator is None else 1)
    if height == 0:
        return max(1, -(-(width - 1) // len(entries)))
    count_work(20 + len(rows) * (0.5 + min(height, width) / 1500))
    kernel, nullity = nmod_mat(height, width, rows, p).nullspace()
    if nullity > 1:
        return int(-(-(nullity - 1) // len(entries)))
    if nullity == 0:
        raise Unlucky(f"the values modulo {p} do not fit the monomials found")
    solution = [int(kernel[i, 0]) for i in range(width)]
    denominator_values = (
        solution[sum(widths) :]
        if known_denominator is None
        else [solution[-1] * c % p for c in known_denominator.denominator]
    )
    offset = 0
    for i, size in zip(entries, widths, strict=True):
        quotient = Quotient.of(
            replace(shapes[i], denominator=denominator), solution[offset : offset + size], denominator_values, p
        )
        offset += size
        is_consistent = quotient is not None
        if quotient is not None:
            shape, v = quotient.shape, values.values[test_index][i]
            sums = ((quotient.numerator, shape.numerator), (quotient.denominator, shape.denominator))
            N, D = (
                sum(c * m for c, m in zip(cs, values.monomials(test_index, ms), strict=True)) % p for cs, ms in sums
            )
            is_consistent = D != 0 and (N - v * D) % p == 0
        if quotient is None or not is_consistent:
            raise Unlucky(f"a value modulo {p} that was held out does not agree")
        quotients[i] = quotient
    return 0


# -- modulo the next primes --------------------------------------------------------------------------------------------


def _lift(
    quotients: list[Quotient],
    sample_new_prime: Callable[[], SampledValues],
    names: tuple[str, ...],
    primes: list[int],
    rng: random.Random,
) -> tuple[RationalFunction, ...]:
    """Lift `quotients` from residues to functions over Q. Raises Unlucky if values modulo new primes disagree."""
    modulus, context = primes[-1], ring(names)
    shapes = {i: quotient.shape for i, quotient in enumerate(quotients)}
    residues = [[*quotient.numerator, *quotient.denominator] for quotient in quotients]
    groups: dict[object, list[int]] = {}
    for i, quotient in enumerate(quotients):
        groups.setdefault((quotient.shape.denominator, quotient.denominator), []).append(i)
    # Numerators are compared up to a factor: the first coefficient is made 1.
    numerator_texts = [str([c * pow(f.numerator[0], -1, modulus) % modulus for c in f.numerator]) for f in quotients]
    split_groups = [split_group(group, [numerator_texts[i] for i in group], shapes) for group in groups.values()]
    failures = 0
    while True:
        # Guess the functions whose coefficients are fractions of small height with these residues.
        functions = list[RationalFunction]()
        for shape, entries in zip(shapes.values(), residues, strict=True):
            count_work((20 + 5 * len(entries)) * modulus.bit_length() / 60)
            coefficients = rational_vector(entries, modulus)
            if coefficients is None:
                break
            size = len(shape.numerator)
            N = context.from_dict({m: c for m, c in zip(shape.numerator, coefficients[:size], strict=True) if c != 0})
            D = context.from_dict({m: c for m, c in zip(shape.denominator, coefficients[size:], strict=True) if c != 0})
            functions.append(RationalFunction.reduced(N, D))
        try:
            if len(functions) < len(shapes):
                values = sample_new_prime()
            elif (counterexample := _find_counterexample(functions, sample_new_prime, rng)) is not None:
                values = counterexample
            else:
                return tuple(functions)
            new_quotients = fit(values, shapes, split_groups, len(names), rng)
            if any(new_quotients[i].shape.leading_monomial != shape.leading_monomial for i, shape in shapes.items()):
                raise Unlucky(f"the prime {values.prime} divides a leading coefficient")
        except Unlucky:
            failures += 1
            if failures >= _MAX_UNLUCKY_PRIMES:
                raise
            continue
        for i, shape in shapes.items():
            numerator_terms = dict(zip(new_quotients[i].shape.numerator, new_quotients[i].numerator, strict=True))
            denominator_terms = dict(zip(new_quotients[i].shape.denominator, new_quotients[i].denominator, strict=True))
            new_residues = [
                *(numerator_terms.get(m, 0) for m in shape.numerator),
                *(denominator_terms.get(m, 0) for m in shape.denominator),
            ]
            residues[i] = chinese(residues[i], modulus, new_residues, values.prime)
        modulus *= values.prime


def _find_counterexample(
    functions: Sequence[RationalFunction], sample_new_prime: Callable[[], SampledValues], rng: random.Random
) -> SampledValues | None:
    """Compare the functions with the black box modulo new primes; return the values at the first difference."""
    for _ in range(_CONFIRMING_PRIMES):
        values = sample_new_prime()
        values.take(values.random_points(len(functions[0].names) if functions else 0, rng))
        field = GF(values.prime)
        point = [field.convert(entry) for entry in values.points[-1]]
        try:
            computed_values = [function.value(field, point) for function in functions]
        except BadPrime as error:
            raise Unlucky(str(error)) from error
        pairs = zip(computed_values, values.values[-1], strict=True)
        if not all(
            computed_value is not None and field.convert(computed_value) == value for computed_value, value in pairs
        ):
            return values
    return None
