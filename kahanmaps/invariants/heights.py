"""Heights h_0, h_1, ... of the points of an exact orbit, their kind of growth, and the constant of this growth.

The height of a rational point x = (p_1 : ... : p_k : q), with integers without a common factor, is here the bit length
of the largest of these integers, floor(log2 max(|p_1|, ..., |p_k|, |q|)) + 1: within one bit of the logarithmic
projective height.

Over a number field Q[t]/g of degree r, the height is here that of the rational point of all coefficients of the
coordinates (polynomials in t). Up to a constant, it lies between 1 and r times the projective height, so the kind of
growth is the same. (Denominators are ideals, and the least positive integer in an ideal is at most its norm.)

Theory. One step is a rational map of some degree e, so h(Phi(x)) <= e h(x) + O(1): growth is at most exponential. If an
orbit stays on a curve, some power of the map is an automorphism of the smooth model of one component. On a rational
curve, this is a Moebius map: heights grow linearly, or logarithmically if the Moebius map has one fixed point, or the
orbit is periodic. On an elliptic curve of degree d in projective space, on which the map is a translation by T,

    h_n = c n^2 + b n + O(1),        c = d hhat(T)/log 2,

by the theory of Neron and Tate, where hhat is the canonical height of the divisor (O). In a plane of the normal form of
a member of the family, d = 3, and T is the point (0, 0) of the Jacobian in docs/mathematics.md. Heights of infinite
orbits are unbounded (Northcott).

In such a plane, c is known up to a bounded error. Over Q(gamma) the height pairing <T, T> is 1/12
(docs/mathematics.md, by shioda-1990), so hhat(T) = (log 2) h(gamma)/24 + O(1) for rational gamma (tate-1983), and

    c = h(gamma)/8 + O(1),       gamma = 1 - disc(h) level^2,

where h(gamma) is the height of gamma in bits. No explicit bound of the O(1) is known to us; measured values are -0.55
to 0.75 for random gamma of up to 160 bits, and -0.99 for gamma = 1 - 3^-40. So coefficients, eps or initial points with
more digits give faster growth.

Measured, not proved: for a member of the family, c is the sum of the constants of its m planes (six members with m = 1,
2, 3; at n = 120 the difference is 3 parts in 10^5). This is plausible as long as the denominators of different planes
have few common factors. If two planes have the same cubic and the same initial point, their denominators are equal, and
c is the constant of one plane.
"""

from __future__ import annotations

import decimal
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import Any

from kahanmaps.algebra.etale import EtaleAlgebra, EtaleElement
from kahanmaps.algebra.fields import QQ, rational
from kahanmaps.algebra.parsing import wrong_kind
from kahanmaps.algebra.work import Budget, count_work
from kahanmaps.display_protocols import ResultPart
from kahanmaps.errors import InputError, counted
from kahanmaps.family.system_normal_form import NoNormalForm, SystemNormalForm
from kahanmaps.invariants.growth import Growth
from kahanmaps.maps.implicit import Map
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.iteration import DEFAULT_MAX_DIGITS, Orbit, OrbitEnd, OrbitPoint, require_steps
from kahanmaps.maps.orbits.methods import choose_method

MIN_HEIGHTS = 9  # heights needed to report any kind but exponential growth, which soon exceeds the digit budget
_MIN_EXPONENTIAL_HEIGHTS = 6  # heights needed to report exponential growth
_MIN_LOGARITHMIC_HEIGHTS = 32  # heights needed to report logarithmic growth
_MAX_NOISE = 4  # in bits: smaller deviations of an increase r_j from a rule are ignored
_MAX_SHOWN_HEIGHTS = 20  # number of heights in the plain data of a result
_NO_NORMAL_FORM = NoNormalForm("none was given")


@dataclass(frozen=True)
class HeightGrowth(ResultPart):
    """The heights of an orbit at the steps 0, every, 2 every, ..., and how the orbit ended.

    The kind of growth is decided in exact arithmetic. Let w be a quarter of the number of heights, and r_1, ..., r_4
    the increases of the height over the last four intervals of w * `every` steps: each r_j is w times the slope of a
    least-squares line, since heights fluctuate. Let e_j = r_{j+1} - r_j. The first rule that holds gives the kind:

    * periodic: the orbit returned to its initial point;
    * exponential: e_1 > 0, e_2 >= 2 e_1, 10 e_1 e_3 >= 9 e_2^2, and e_1 + e_2 + e_3 >= 8 bits. (For C g^n,
      e_1 e_3 = e_2^2. For powers of n up to 8 with e_2 >= 2 e_1, e_1 e_3 is less than 0.9 e_2^2.)
    * quadratic: all e_j > 0, no e_j exceeds 5/3 of another, and e_1 + e_2 + e_3 >= 8 bits. (For c n^2 + b n all e_j are
      equal. For n^3, e_1 : e_2 : e_3 is 1 : 2 : 3 if the intervals begin at n = 0; otherwise e_3/e_1 >= 1.8.)
    * logarithmic: at least 32 heights; the largest height in the last interval exceeds that in the first; and from the
      second interval on, the mean change per height is less than 1/8 bit. (Linear growth is faster: a Moebius map of
      infinite order with two fixed points increases heights by at least 1/2 bit in each step, since its multiplier has
      a Mahler measure of at least 2.)
    * bounded: no height in the second half is larger or smaller than all heights in the first half;
    * linear: all r_j > 0, and they differ by at most a quarter of the least, and by at most 4 bits or 1/32 of the
      least, whichever is larger;
    * undecided otherwise, or with fewer than 9 heights (6 for exponential growth); n log n is undecided as well.
    """

    heights: tuple[int, ...]
    end: OrbitEnd
    every: int
    method: str = ""

    @property
    def steps(self) -> tuple[int, ...]:
        """The number of the step at which each height was measured."""
        return tuple(range(0, self.every * len(self.heights), self.every))

    @property
    def kind(self) -> Growth:
        """The kind of growth."""
        return self._decision[0]

    @property
    def reason(self) -> str:
        """The measured numbers that determined the kind of growth, as a phrase."""
        return self._decision[1]

    @cached_property
    def constant(self) -> Fraction | None:
        """The constant c in bits: h_n ~ c n^2 for quadratic growth, h_n ~ c n for linear growth; otherwise None.

        It is the leading coefficient of the least-squares polynomial through all heights. If h_n is c n^2 + b n up to
        fluctuations in [-s, s], the error of c is at most 12 s/n^2; for independent fluctuations of standard deviation
        s it is about 13 s/n^2.5. For linear growth the errors are 3 s/n and 3.5 s/n^1.5. A second difference of the
        heights at n/3, 2n/3 and n would have the errors 18 s/n^2 and 11 s/n^2. At n = 120, for six members with known
        c, its error was 2 to 18 parts in 10^5; that of the polynomial was below 3 parts.
        """
        match self.kind:
            case Growth.QUADRATIC:
                return _leading_coefficient(self.heights, 2) / self.every**2
            case Growth.LINEAR:
                return _leading_coefficient(self.heights, 1) / self.every
        return None

    @property
    def ratio(self) -> Fraction | None:
        """The quotient of the last two heights. For exponential growth it is the growth factor of `every` steps."""
        return Fraction(self.heights[-1], self.heights[-2]) if len(self.heights) > 1 else None

    def __str__(self) -> str:
        return self.text

    @property
    def text(self) -> str:
        """A sentence on the kind of growth and its reason."""
        phrases = [f"heights grow as: {self.kind}"]
        if self.constant is not None:
            phrases.append(
                f"about {decimal_text(self.constant)} {'n^2' if self.kind is Growth.QUADRATIC else 'n'} bits"
            )
        if self.kind is Growth.EXPONENTIAL and self.ratio is not None:
            phrases.append(f"by a factor of about {decimal_text(self.ratio)} in {counted(self.every, 'step')}")
        return f"{', '.join(phrases)}; {self.reason}"

    def to_json(self) -> dict[str, Any]:
        """Return plain data: the heights at 0, 1, 2, 4, 8, ... times `every` and the last; rounded numbers as text."""
        last = len(self.heights) - 1
        shown_indices = sorted({0, last, *(1 << k for k in range(last.bit_length()))})[-_MAX_SHOWN_HEIGHTS:]
        return {
            "steps": self.every * last,
            "every": self.every,
            "method": self.method,
            "status": self.end.status,
            "message": self.end.message,
            "period": self.end.period,
            "heights": [{"step": self.every * i, "bits": self.heights[i]} for i in shown_indices],
            "final_height": self.heights[-1],
            "kind": str(self.kind),
            "reason": self.reason,
            "constant": None if self.constant is None else decimal_text(self.constant),
            "ratio": None if self.ratio is None else decimal_text(self.ratio),
        }

    @cached_property
    def _decision(self) -> tuple[Growth, str]:
        if self.end.status == "periodic" or self.end.period is not None:
            return Growth.PERIODIC, self.end.message
        kind, reason = _decide(self.heights)
        if kind is Growth.UNDECIDED and not self.end.is_complete:
            reason = f"{reason}; {self.end.message}"
        return kind, reason


def height(point: Sequence[Any]) -> int:
    """Return the height in bits of a point with exact coordinates, as defined at the beginning of this module.

    >>> height(["3/4", "-1/6", 0])  # (9 : -2 : 0 : 12)
    4
    """
    if isinstance(point, str) or not hasattr(point, "__len__"):
        raise wrong_kind(point, "the coordinates of a point", 'write a list, e.g. [3, "1/2"]')
    # Over the least common denominator q, the numerators and q have no common factor: if p^k divides q exactly, then
    # p^k divides the denominator of some fraction, and p does not divide the numerator of this fraction.
    numbers = [entry.coefficients if isinstance(entry, EtaleElement) else [rational(entry)] for entry in point]
    return IntegerPoint.from_rationals([number for row in numbers for number in row]).bits


def height_of(point: OrbitPoint) -> int:
    """Return the height of a point of an exact orbit; no fractions are formed if the point is stored with integers."""
    value = point.value
    if isinstance(value, IntegerPoint):
        return value.bits  # the coordinates of an IntegerPoint are in lowest terms
    if isinstance(value, tuple):
        return height(value)
    return value.height


def height_growth(
    kahan_map: Map,
    start: Sequence[Any],
    steps: int,
    *,
    normal_form: SystemNormalForm | NoNormalForm | None = None,
    every: int = 1,
    max_digits: int | None = DEFAULT_MAX_DIGITS,
    budget: Budget | None = None,
) -> HeightGrowth:
    """Measure the heights of an orbit of a map over Q at the steps 0, every, 2 every, ... up to `steps`.

    Args:
        kahan_map: a map over Q at one eps.
        start: the initial point, with exact coordinates.
        steps: the number of steps.
        normal_form: the normal form of the system, if known (family.system_normal_form). It makes steps faster, and for
            large `every` points are computed directly, without intermediate steps. A height takes a gcd: for three
            planes 100 heights take 0.2 s and 300 heights 8 s; 300 steps take 0.8 s with `every` = 15.
        every: the number of steps from one height to the next.
        max_digits: the orbit ends at a coordinate with more digits than this; None means no limit.
        budget: the work limit; when it is spent, the orbit ends after the current step.

    Returns:
        The exact heights up to the end of the orbit; properties of the result give their kind of growth.

    >>> from kahanmaps.documents.catalog import load
    >>> from kahanmaps.maps.kahan import KahanMap
    >>> growth = height_growth(KahanMap(load("weierstrass").system, "1/10"), [1, "1/2"], 40)
    >>> growth.heights[:6], growth.kind, decimal_text(growth.constant)
    ((2, 7, 17, 32, 52, 82), <Growth.QUADRATIC: 'quadratic'>, '3.04132')
    """
    if kahan_map.field is not QQ and not isinstance(kahan_map.field, EtaleAlgebra):
        raise InputError(
            f"found a map over {kahan_map.field}, expected one over Q or a number field: only there are heights"
        )
    if every < 1:
        raise InputError(f"found every = {every}, expected at least 1")
    require_steps(steps)
    requested_steps = range(0, steps + 1, every)
    start_height = height(kahan_map.point(start))
    bits = start_height if kahan_map.eps is None else max(start_height, height([kahan_map.eps]))
    if max_digits is not None and 0 < max_digits * 100_000 // 30103 < bits:
        # A step from such a point could take minutes, and its result would usually exceed the budget as well.
        end = OrbitEnd("budget", 0, f"eps or the start has more digits than the budget of {max_digits} (--max-digits)")
        return HeightGrowth((start_height,), end, every)
    normal_form = _NO_NORMAL_FORM if normal_form is None else normal_form
    method = choose_method(None, "exact", normal_form, None if every == 1 else requested_steps).name
    if method == "doubling" and isinstance(normal_form, SystemNormalForm):
        iterates = Orbit(kahan_map, start, at=requested_steps, normal_form=normal_form, max_digits=max_digits)
        # Only requested steps are computed, so a return to the initial point is detected only at one of them.
        heights: list[int] = []
        start_value, return_step = None, None
        for point, bits in _points_with_heights(iterates, 1, budget):
            if start_value is None:
                start_value = point.value
            elif return_step is None and point.value == start_value:
                return_step = point.step
            heights.append(bits)
        if not heights:  # the initial point exceeds the budget; its height is reported, as for stepwise orbits
            heights.append(height(iterates.start))
        assert iterates.end is not None
        end = iterates.end
        if return_step is not None:
            end = OrbitEnd("periodic", end.steps, f"at step {return_step} the orbit is at its start")
    else:
        form = normal_form if method == "normal-form" and isinstance(normal_form, SystemNormalForm) else None
        orbit = Orbit(kahan_map, start, requested_steps[-1], normal_form=form, max_digits=max_digits)
        heights = [bits for _, bits in _points_with_heights(orbit, every, budget)]
        assert orbit.end is not None
        end = orbit.end
    if end.status == "interrupted":
        end = replace(end, message=f"work limit reached after step {end.steps}; raise --effort")
    return HeightGrowth(tuple(heights), end, every, method)


def decimal_text(value: Fraction, digits: int = 6) -> str:
    """Round a number to `digits` significant digits, ties to even. The text is the same on all machines.

    >>> decimal_text(Fraction(1, 3)), decimal_text(Fraction(-20, 3), 2), decimal_text(Fraction(5))
    ('0.333333', '-6.7', '5')
    """
    context = decimal.Context(prec=digits, rounding=decimal.ROUND_HALF_EVEN)
    # Decimal(int) is exact, so only the quotient is rounded.
    return format(context.divide(decimal.Decimal(value.numerator), decimal.Decimal(value.denominator)), "f")


def _points_with_heights(orbit: Orbit, every: int, budget: Budget | None) -> Iterator[tuple[OrbitPoint, int]]:
    """Yield (point, height) at steps that are multiples of `every`, until the budget is spent; count the work."""
    bits = increase = 0
    for point in orbit:
        if point.step % every == 0:
            previous_bits, bits = bits, height_of(point)
            increase = max(0, bits - previous_bits)
            yield point, bits
        # The work grows with the height and with its increase, since gcds of longer numbers are then computed.
        count_work(20 + len(orbit.start) ** 2 * (bits / 100 + increase / 15))
        if budget is not None and budget.is_spent:
            orbit.interrupt()


def _decide(heights: Sequence[int]) -> tuple[Growth, str]:
    """Apply the rules stated in the docstring of HeightGrowth."""
    if len(heights) < _MIN_EXPONENTIAL_HEIGHTS:
        return Growth.UNDECIDED, _too_few_heights(heights)
    width = (len(heights) - 1) // 4
    offset = len(heights) - 1 - 4 * width
    increases: list[Fraction] = [
        width * _leading_coefficient(heights[offset + j * width : offset + (j + 1) * width + 1], 1) for j in range(4)
    ]
    differences = [later - earlier for earlier, later in pairwise(increases)]
    text = f"four quarters raise them by {', '.join(decimal_text(increase, 4) for increase in increases)} bits"
    if min(differences) > 0 and sum(differences) >= 2 * _MAX_NOISE:
        e1, e2, e3 = differences
        if e2 >= 2 * e1 and 10 * e1 * e3 >= 9 * e2 * e2:
            return Growth.EXPONENTIAL, f"{text}, and the increases multiply"
        if 3 * max(differences) <= 5 * min(differences) and len(heights) >= MIN_HEIGHTS:
            return Growth.QUADRATIC, f"{text}, and the increases are about the same"
    if len(heights) < MIN_HEIGHTS:
        return Growth.UNDECIDED, _too_few_heights(heights)
    has_increased = max(heights[: width + 1]) < max(heights[-width - 1 :])
    if has_increased and -3 * width < 8 * sum(increases[1:]) < 3 * width and len(heights) >= _MIN_LOGARITHMIC_HEIGHTS:
        return Growth.LOGARITHMIC, f"{text}: less than linear growth would"
    middle = len(heights) // 2
    low, high = min(heights[:middle]), max(heights[:middle])
    if low <= min(heights[middle:]) and max(heights[middle:]) <= high:
        return Growth.BOUNDED, f"the second half of them stays within {low} to {high} bits, as the first"
    least_increase, spread = min(increases), max(increases) - min(increases)
    if least_increase > 0 and spread <= least_increase / 4 and (spread <= _MAX_NOISE or spread <= least_increase / 32):
        return Growth.LINEAR, f"{text}, about the same each time"
    return Growth.UNDECIDED, f"{text}, which fits no rule; more steps may decide"


def _too_few_heights(heights: Sequence[int]) -> str:
    return f"found {counted(len(heights), 'height')}, expected {MIN_HEIGHTS} or more"


def _leading_coefficient(values: Sequence[int], degree: int) -> Fraction:
    """Return the leading coefficient of the least-squares polynomial of degree 1 or 2 for values at 0, 1, 2, ...

    The coefficient is computed by projection to the orthogonal polynomial of this degree on these points.
    """
    n = len(values) - 1
    if degree == 1:
        weights = [2 * i - n for i in range(n + 1)]
    else:
        weights = [6 * i * (i - n) + n * (n - 1) for i in range(n + 1)]
    leading_factor = 2 if degree == 1 else 6
    product = sum(weight * value for weight, value in zip(weights, values, strict=True))
    return Fraction(leading_factor * product, sum(weight * weight for weight in weights))
