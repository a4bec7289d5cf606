"""Rational functions over Q from their values modulo primes, with few values.

The values come from a black box: modulo a prime p, at a point of GF(p)^s, a vector of numbers. What is sought are the
rational functions of s symbols that these numbers are the values of. Modulo one prime:

    axes    every entry is a fraction of two polynomials along each axis through one random point (the anchor): of the
            least degrees that explain the values, with one value more than they need. This gives the exponents of
            each symbol, so that functions of eps^2 are seen at once;
    stages  symbols join one by one, the others staying at the anchor. The monomials that can occur are those of the
            stage before times the exponents of the new symbol, up to a total degree known from a line; a linear system
            N(s_k) - v_k D(s_k) = 0 gives the coefficients, hence the monomials that do occur. One more value must
            agree.

Every value ever taken serves as an equation later, and entries with one denominator share its unknowns. Modulo further
primes the monomials are known. Coefficients follow by Chinese remainders, and the functions must give the values of
the black box at fresh points modulo fresh primes. For values of a rational function over Q a wrong answer passes with a
probability of about degree/2^60 at each of these points, by schwartz-1980; whether the black box is rational at all is
known from these points only. So an answer is strong evidence, not proof.
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
from kahanmaps.algebra.work import Budget, count
from kahanmaps.errors import BadPrime, InputError

__all__ = ["Reconstruction", "rational_reconstruction", "rational_vector", "reconstruct"]


_UNLUCKY_PRIMES = 3  # so many primes may fail before the black box is blamed
_CONFIRMATIONS = 5  # values modulo a fresh prime each; a box like the Legendre symbol passes any one half of the time


Point = tuple[int, ...]
Exponents = tuple[int, ...]
BlackBox = Callable[[int, Point], Sequence[int] | None]

NOTHING: Mapping[int, int] = MappingProxyType({})
_BAD_POINTS = 20  # in a row, before the prime is blamed
_DETERMINING = 4  # entries that determine their common denominator together: more would only make matrices larger


class Stop(Exception):
    """No answer, and another prime would not help."""


class Unlucky(Exception):
    """This prime, or these points, lead nowhere; another prime may."""


@dataclass
class Samples:
    """What may still be spent, and how long the vectors of values are."""

    max_samples: int
    budget: Budget | None
    spent: int = 0
    length: int | None = None

    def check(self, wanted: int = 0) -> None:
        if self.spent + wanted > self.max_samples:
            raise Stop(f"{self.spent} values were taken and {wanted} more are needed, the limit is {self.max_samples}")
        if self.budget is not None and self.budget.is_spent:
            raise Stop(f"the budget was spent after {self.spent} values (--effort)")


class SampledValues:
    """The values modulo one prime so far, and the monomials at their points."""

    def __init__(self, black_box: BlackBox, prime: int, samples: Samples) -> None:
        self.prime = prime
        self.samples = samples
        self.points: list[Point] = []
        self.values: list[tuple[int, ...]] = []
        self._black_box = black_box
        self._powers: list[dict[Exponents, int]] = []

    def take(self, draw: Callable[[], Point]) -> None:
        """One more value, at the first drawn point that has one."""
        for _ in range(_BAD_POINTS):
            self.samples.check(1)
            point = draw()
            self.samples.spent += 1
            found = self._black_box(self.prime, point)
            if found is not None:
                values = tuple(int(value) % self.prime for value in found)
                if self.samples.length is None:
                    self.samples.length = len(values)
                if len(values) != self.samples.length:
                    lengths = f"{self.samples.length} and {len(values)}"
                    raise InputError(f"found values of lengths {lengths}, expected equally many at all points")
                self.points.append(point)
                self.values.append(values)
                self._powers.append({})
                return
            if not point:
                break
        raise Unlucky(f"no value modulo {self.prime} at {_BAD_POINTS} points in a row")

    def anywhere(self, symbols: int, rng: random.Random, fixed: Mapping[int, int] = NOTHING) -> Callable[[], Point]:
        """What draws random points, some of their coordinates given."""
        return lambda: tuple(fixed[i] if i in fixed else rng.randrange(1, self.prime) for i in range(symbols))

    def monomials(self, k: int, exponents: Sequence[Exponents]) -> list[int]:
        """The values of the monomials at point k."""
        known, point, p = self._powers[k], self.points[k], self.prime
        row = []
        for monomial in exponents:
            value = known.get(monomial)
            if value is None:
                value = 1
                for base, exponent in zip(point, monomial, strict=True):
                    if exponent:
                        value = value * pow(base, exponent, p) % p
                known[monomial] = value
            row.append(value)
        return row


@dataclass(frozen=True)
class Shape:
    """The monomials of a numerator and of a denominator; `lead` of the latter has the coefficient 1."""

    numerator: tuple[Exponents, ...]
    denominator: tuple[Exponents, ...]

    @property
    def lead(self) -> Exponents:
        return max(self.denominator)

    @property
    def unknowns(self) -> int:
        return len(self.numerator) + len(self.denominator)


@dataclass(frozen=True)
class Quotient:
    """A fraction of two polynomials modulo a prime: coefficients in the order of the shape's monomials."""

    shape: Shape
    numerator: tuple[int, ...]
    denominator: tuple[int, ...]

    @classmethod
    def of(cls, shape: Shape, numerator: Sequence[int], denominator: Sequence[int], prime: int) -> Quotient | None:
        """The fraction normalised and without its zero terms; None where no denominator is left."""
        kept_above = {monomial: c for monomial, c in zip(shape.numerator, numerator, strict=True) if c}
        kept_below = {monomial: c for monomial, c in zip(shape.denominator, denominator, strict=True) if c}
        if not kept_below:
            return None
        kept = Shape(tuple(kept_above), tuple(kept_below))
        factor = pow(kept_below[kept.lead], -1, prime)
        return cls(
            kept,
            tuple(c * factor % prime for c in kept_above.values()),
            tuple(c * factor % prime for c in kept_below.values()),
        )


@dataclass(frozen=True)
class Reconstruction:
    """What `reconstruct` found: the functions, or None and the reason why not.

    `samples` counts the calls of the black box, those without a value included; `primes` are those that were used.
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
    """The rational functions over Q of the symbols `names` that a black box gives the values of.

    Args:
        black_box: `black_box(prime, point)` returns the values modulo the prime, always equally many integers, at a
            point of as many integers as there are names; None where there is no value (a pole, say).
        names: the symbols; without any, the numbers themselves are found from their residues.
        seed: decides the primes (of 61 bits) and points.
        max_degree: along any line the degrees of numerator and denominator add up to at most twice this number.
        max_samples: bound for the number of calls.
        budget: to give up when it is spent, looked at between calls; None for never.
        draw: what gives a random prime, where not all will do.

    Returns:
        A `Reconstruction`: functions in lowest terms, or None and a reason. A black box that is not rational, or that
        disagrees with itself modulo different primes, gives None. The answer is exact and has been compared with the
        black box at fresh points modulo fresh primes: it is strong evidence, not proof.

    Raises:
        InputError: where the black box returns values of different lengths.

    >>> def box(p, point):
    ...     x, y = point
    ...     return [(x + y) * pow(3 * x * y + 1, -1, p), 5 * pow(7, -1, p)]
    >>> found = reconstruct(box, ["x", "y"])
    >>> [f"({f.numerator})/({f.denominator})" for f in found.functions], found.samples
    (['(x + y)/(3*x*y + 1)', '(5/7)/(1)'], 17)
    >>> reconstruct(lambda p, point: [pow(point[0], (p + 5) // 2, p)], ["x"]).reason
    'not the values of a rational function of degree at most 40 along a line'
    """
    rng = random.Random(seed)
    samples = Samples(max_samples, budget)
    primes: list[int] = []

    def fresh() -> SampledValues:
        prime = draw(rng)
        while prime in primes:
            prime = draw(rng)
        primes.append(prime)
        return SampledValues(black_box, prime, samples)

    reason = ""
    try:
        for _ in range(_UNLUCKY_PRIMES):
            try:
                functions = _lift(_first_prime(fresh(), len(names), max_degree, rng), fresh, tuple(names), primes, rng)
                return Reconstruction(functions, "", samples.spent, tuple(primes))
            except Unlucky as unlucky:
                reason = str(unlucky)
    except Stop as stop:
        reason = str(stop)
    return Reconstruction(None, reason, samples.spent, tuple(primes))


# -- modulo the first prime --------------------------------------------------------------------------------------------


def _first_prime(values: SampledValues, symbols: int, max_degree: int, rng: random.Random) -> list[Quotient]:
    """The functions modulo one prime."""
    p = values.prime
    values.take(values.anywhere(symbols, rng))
    anchor = values.points[0]
    one: Exponents = (0,) * symbols
    entries = range(len(values.values[0]))
    found = [Quotient(Shape((one,) if v else (), (one,)), (v,) if v else (), (1,)) for v in values.values[0]]
    axes = []
    for j in range(symbols):
        direction = tuple(int(i == j) for i in range(symbols))
        axes.append(_along_line(values, anchor, direction, max_degree, rng))
    # Large degrees first: the last symbol multiplies all monomials found until then.
    order = sorted(range(symbols), key=lambda j: -max((_size(N) + _size(D) for N, D in axes[j]), default=0))
    keys: list[list[str]] = [[] for _ in entries]
    for stage, j in enumerate(order):
        active = order[: stage + 1]
        for i in entries:
            keys[i].append(str(axes[j][i][1]))
        moving = [i for i in entries if _size(axes[j][i][0]) or _size(axes[j][i][1])]
        for i in moving:
            if found[i].shape.unknowns <= 2 and set(found[i].shape.numerator + found[i].shape.denominator) <= {one}:
                N, D = ([int(c) for c in polynomial.coeffs()] for polynomial in axes[j][i])
                powers = [tuple(e if k == j else 0 for k in range(symbols)) for e in range(max(len(N), len(D)))]
                quotient = Quotient.of(Shape(tuple(powers[: len(N)]), tuple(powers[: len(D)])), N, D, p)
                assert quotient is not None  # D is monic
                found[i] = quotient
        moving = [
            i for i in moving if any(sum(m) != m[j] for m in (*found[i].shape.numerator, *found[i].shape.denominator))
        ]
        if not moving:
            continue
        shapes = {i: _extended(found[i].shape, axes[j][i], j) for i in moving}
        bound = max(sum(_size(axes[a][i][0]) + _size(axes[a][i][1]) for a in active) + 2 for i in moving)
        if max(shape.unknowns for shape in shapes.values()) > bound:
            direction = tuple(rng.randrange(1, p) if i in active else 0 for i in range(symbols))
            line = _along_line(values, anchor, direction, max_degree, rng)
            for i in moving:
                keys[i].append(str(line[i][1]))
                shapes[i] = Shape(
                    tuple(m for m in shapes[i].numerator if sum(m) <= _size(line[i][0])),
                    tuple(m for m in shapes[i].denominator if sum(m) <= _size(line[i][1])),
                )
        groups: dict[tuple[str, ...], list[int]] = {}
        for i in moving:
            groups.setdefault(tuple(keys[i]), []).append(i)
        monic = [str(N / N.leading_coefficient()) if int(N.degree()) >= 0 else "" for N, _ in axes[j]]
        pairs = [split_group(group, [monic[i] for i in group], shapes) for group in groups.values()]
        fixed = {i: anchor[i] for i in order[stage + 1 :]}
        for i, quotient in fit(values, shapes, pairs, symbols, rng, fixed).items():
            found[i] = quotient
    return found


def _size(polynomial: nmod_poly) -> int:
    return max(0, int(polynomial.degree()))


def _along_line(
    values: SampledValues, anchor: Point, direction: Point, max_degree: int, rng: random.Random
) -> list[tuple[nmod_poly, nmod_poly]]:
    """All entries as fractions (N, D) of polynomials in t at the points anchor + t direction; D is monic.

    Along an axis t is counted from the origin, so that exponents of t are exponents of the symbol.
    """
    p = values.prime
    moving = [i for i, d in enumerate(direction) if d]
    start = anchor[moving[0]] if len(moving) == 1 else 0
    where = [start]

    def draw() -> Point:
        t = rng.randrange(p)
        while t in where:
            t = rng.randrange(p)
        where.append(t)
        return tuple((a + (t - start) * d) % p for a, d in zip(anchor, direction, strict=True))

    entries = range(len(values.values[0]))
    vanishing = nmod_poly([-start, 1], p)
    through = [nmod_poly([v], p) for v in values.values[0]]
    found: list[tuple[nmod_poly, nmod_poly] | None] = [None for _ in entries]
    n = 1
    while any(pair is None for pair in found):
        if n > 2 * max_degree + 2:
            raise Stop(f"not the values of a rational function of degree at most {max_degree} along a line")
        values.take(draw)
        t, n = where[-1], n + 1
        slope = 1 / vanishing(t)
        for i in entries:
            if found[i] is None:
                values.samples.check()
                count(5 + n * (1 + n / 100))
                through[i] += vanishing * ((values.values[-1][i] - through[i](t)) * slope)
        vanishing *= nmod_poly([-t, 1], p)
        for i in entries:
            if found[i] is None:
                found[i] = _least_fraction(through[i], vanishing, n)
    return [pair for pair in found if pair is not None]


def _least_fraction(through: nmod_poly, vanishing: nmod_poly, n: int) -> tuple[nmod_poly, nmod_poly] | None:
    """The fraction N/D = through modulo `vanishing` with deg N + deg D <= n - 2, D monic: the euclidean algorithm."""
    p = through.modulus()
    before, after = (vanishing, nmod_poly([0], p)), (through, nmod_poly([1], p))
    while True:
        N, D = after
        if _size(N) + _size(D) <= n - 2:
            if int(D.gcd(vanishing).degree()) > 0:
                return None
            lead = D.leading_coefficient()
            return N / lead, D / lead
        if int(N.degree()) <= 0:
            return None
        quotient, rest = divmod(before[0], N)
        before, after = after, (rest, before[1] - quotient * D)


def _extended(shape: Shape, pair: tuple[nmod_poly, nmod_poly], j: int) -> Shape:
    """The monomials that can occur when symbol j joins, with its exponents along the axis."""

    def times(monomials: tuple[Exponents, ...], polynomial: nmod_poly) -> tuple[Exponents, ...]:
        exponents = [e for e, c in enumerate(polynomial.coeffs()) if int(c)]
        return tuple((*m[:j], e, *m[j + 1 :]) for m in monomials for e in exponents)

    return Shape(times(shape.numerator, pair[0]), times(shape.denominator, pair[1]))


# -- the linear systems: quotients with given monomials from values modulo a prime ------------------------------------
#
# A value v = N(s)/D(s) at a point s is an equation N(s) - v D(s) = 0 for the coefficients of N and D; as many of them
# as needed leave one solution up to a factor, as long as the monomials allow no common factor of N and D.


def split_group(group: list[int], numerators: Sequence[str], shapes: dict[int, Shape]) -> tuple[list[int], list[int]]:
    """Entries with one denominator, as (those that determine it, the others); equal numerators would not help."""
    if len(shapes[group[0]].denominator) == 1:
        return group[:1], group[1:]
    different = dict(reversed(list(zip(numerators, group, strict=True))))
    determining = sorted(different.values())[:_DETERMINING]
    return determining, [i for i in group if i not in determining]


def fit(
    values: SampledValues,
    shapes: dict[int, Shape],
    pairs: list[tuple[list[int], list[int]]],
    symbols: int,
    rng: random.Random,
    fixed: Mapping[int, int] = NOTHING,
) -> dict[int, Quotient]:
    """The fractions of these shapes through all values but the last, which must agree; takes as many as it needs.

    Some coordinates may be fixed: then the points are those where they have these values.
    """
    done: dict[int, Quotient] = {}
    draw = values.anywhere(symbols, rng, fixed)
    values.take(draw)
    while True:
        usable = [k for k, point in enumerate(values.points) if all(point[i] == v for i, v in fixed.items())]
        wanted = 0
        for determining, others in pairs:
            if determining[0] not in done:
                wanted = max(wanted, _solve(values, usable, shapes, determining, None, done))
            if determining[0] in done:
                denominator = done[determining[0]]
                for i in others:
                    if i not in done:
                        wanted = max(wanted, _solve(values, usable, shapes, [i], denominator, done))
        if wanted == 0:
            return done
        values.samples.check(wanted)
        for _ in range(wanted):
            values.take(draw)


def _solve(
    values: SampledValues,
    usable: list[int],
    shapes: dict[int, Shape],
    members: list[int],
    known: Quotient | None,
    done: dict[int, Quotient],
) -> int:
    """Enter the fractions of members with one denominator (perhaps `known`) into `done`, or tell how many values lack.

    Raises Unlucky where there are none.
    """
    p = values.prime
    values.samples.check()
    denominator = shapes[members[0]].denominator if known is None else known.shape.denominator
    widths = [len(shapes[i].numerator) for i in members]
    # A point more than is solved with is held out; without symbols all points are the same.
    last = usable[-1]
    rows: list[int] = []
    height = 0
    for k in usable[:-1] if values.points[0] else usable[:1]:
        lower = values.monomials(k, denominator)
        if known is not None:
            lower = [sum(c * m for c, m in zip(known.denominator, lower, strict=True)) % p]
        offset = 0
        for i, width in zip(members, widths, strict=True):
            v = p - values.values[k][i]
            rows += [0] * offset + values.monomials(k, shapes[i].numerator) + [0] * (sum(widths) - offset - width)
            rows += [v * m % p for m in lower]
            offset += width
            height += 1
    width = sum(widths) + (len(denominator) if known is None else 1)
    if height == 0:
        return max(1, -(-(width - 1) // len(members)))
    count(20 + len(rows) * (0.5 + min(height, width) / 1500))
    kernel, nullity = nmod_mat(height, width, rows, p).nullspace()
    if nullity > 1:
        return int(-(-(nullity - 1) // len(members)))
    if nullity == 0:
        raise Unlucky(f"the values modulo {p} do not fit the monomials found")
    solution = [int(kernel[i, 0]) for i in range(width)]
    lower = solution[sum(widths) :] if known is None else [solution[-1] * c % p for c in known.denominator]
    offset = 0
    for i, size in zip(members, widths, strict=True):
        quotient = Quotient.of(replace(shapes[i], denominator=denominator), solution[offset : offset + size], lower, p)
        offset += size
        fits = quotient is not None
        if quotient is not None:
            shape, v = quotient.shape, values.values[last][i]
            sums = ((quotient.numerator, shape.numerator), (quotient.denominator, shape.denominator))
            N, D = (sum(c * m for c, m in zip(cs, values.monomials(last, ms), strict=True)) % p for cs, ms in sums)
            fits = D != 0 and (N - v * D) % p == 0
        if quotient is None or not fits:
            raise Unlucky(f"a value modulo {p} that was held out does not agree")
        done[i] = quotient
    return 0


# -- modulo further primes ---------------------------------------------------------------------------------------------


def _lift(
    first: list[Quotient],
    fresh: Callable[[], SampledValues],
    names: tuple[str, ...],
    primes: list[int],
    rng: random.Random,
) -> tuple[RationalFunction, ...]:
    """The functions over Q. Raises Unlucky where values modulo other primes do not fit."""
    modulus = primes[-1]
    shapes = {i: quotient.shape for i, quotient in enumerate(first)}
    residues = [[*quotient.numerator, *quotient.denominator] for quotient in first]
    groups: dict[object, list[int]] = {}
    for i, quotient in enumerate(first):
        groups.setdefault((quotient.shape.denominator, quotient.denominator), []).append(i)
    # Numerators up to a factor: the first coefficient made 1.
    monic = [str([c * pow(one.numerator[0], -1, modulus) % modulus for c in one.numerator]) for one in first]
    pairs = [split_group(group, [monic[i] for i in group], shapes) for group in groups.values()]
    misfits = 0
    while True:
        functions = _recognised(list(shapes.values()), residues, modulus, names)
        try:
            if functions is None:
                values = fresh()
            elif (refuting := _refuting(functions, fresh, rng)) is not None:
                values = refuting
            else:
                return functions
            found = fit(values, shapes, pairs, len(names), rng)
            if any(found[i].shape.lead != shape.lead for i, shape in shapes.items()):
                raise Unlucky(f"the prime {values.prime} divides a leading coefficient")
        except Unlucky:
            misfits += 1
            if misfits >= _UNLUCKY_PRIMES:
                raise
            continue
        for i, shape in shapes.items():
            coefficients = dict(zip(found[i].shape.numerator, found[i].numerator, strict=True))
            lower = dict(zip(found[i].shape.denominator, found[i].denominator, strict=True))
            new = [*(coefficients.get(m, 0) for m in shape.numerator), *(lower.get(m, 0) for m in shape.denominator)]
            residues[i] = chinese(residues[i], modulus, new, values.prime)
        modulus *= values.prime


def _recognised(
    shapes: list[Shape], residues: list[list[int]], modulus: int, names: tuple[str, ...]
) -> tuple[RationalFunction, ...] | None:
    """The functions whose coefficients have these residues, if simple ones do."""
    context = ring(names)
    functions = []
    for shape, entries in zip(shapes, residues, strict=True):
        count((20 + 5 * len(entries)) * modulus.bit_length() / 60)
        coefficients = rational_vector(entries, modulus)
        if coefficients is None:
            return None
        size = len(shape.numerator)
        N = context.from_dict({m: c for m, c in zip(shape.numerator, coefficients[:size], strict=True) if c != 0})
        D = context.from_dict({m: c for m, c in zip(shape.denominator, coefficients[size:], strict=True) if c != 0})
        functions.append(RationalFunction.reduced(N, D))
    return tuple(functions)


def _refuting(
    functions: tuple[RationalFunction, ...], fresh: Callable[[], SampledValues], rng: random.Random
) -> SampledValues | None:
    """The black box modulo a prime where the functions do not give its value, if one of some fresh primes is such."""
    for _ in range(_CONFIRMATIONS):
        values = fresh()
        values.take(values.anywhere(len(functions[0].names) if functions else 0, rng))
        field = GF(values.prime)
        point = [field.convert(entry) for entry in values.points[-1]]
        try:
            found = [function.value(field, point) for function in functions]
        except BadPrime as error:
            raise Unlucky(str(error)) from error
        pairs = zip(found, values.values[-1], strict=True)
        if not all(mine is not None and field.convert(mine) == value for mine, value in pairs):
            return values
    return None
