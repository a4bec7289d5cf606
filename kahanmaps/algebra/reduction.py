"""Primes of bad reduction of elliptic curves over Q, and of the curves in the planes of a member of the family.

The latter may be over number fields. Integers are factored within bounds; unfactored cofactors are reported.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from flint import fmpq, fmpq_poly, fmpz

from kahanmaps.algebra.elliptic_curves import EllipticCurve
from kahanmaps.algebra.integers import coprime_part

_SMOOTH_BITS = 32  # prime factors with at most this number of bits are found
_MAX_FACTORED_BITS = 140  # a cofactor with at most this number of bits is factored completely, in about a second


@dataclass(frozen=True)
class BadPrimes:
    """The primes of bad reduction of an elliptic curve; for a curve over a number field, the primes of Q below these.

    At the primes `bad` the reduction is bad (proved); at `undecided` this is not known. `bad_cofactors` are unfactored
    composite integers all of whose prime factors are bad; `undecided_cofactors` may have bad prime factors. At all
    other primes the reduction is good (proved). `minimal_discriminant` is None if unknown.
    """

    bad: tuple[int, ...]
    undecided: tuple[int, ...] = ()
    bad_cofactors: tuple[int, ...] = ()
    undecided_cofactors: tuple[int, ...] = ()
    minimal_discriminant: int | None = None

    @property
    def text(self) -> str:
        """The bad primes, cofactors and undecided primes as text in one line."""
        texts = [", ".join(map(str, self.bad)) or "none"]
        if self.bad_cofactors:
            texts.append(f"and all primes of {', '.join(map(str, self.bad_cofactors))} (composite, not factored)")
        undecided_texts = [str(p) for p in self.undecided]
        undecided_texts += [f"primes of {n} (composite, not factored)" for n in self.undecided_cofactors]
        if undecided_texts:
            texts.append(f"undecided: {', '.join(undecided_texts)}")
        return "; ".join(texts)

    def to_json(self) -> dict[str, Any]:
        """Return plain data; integers are given as text, since they may be long."""
        names = ("bad", "undecided", "bad_cofactors", "undecided_cofactors")
        discriminant = self.minimal_discriminant
        lists = {name: [str(n) for n in getattr(self, name)] for name in names}
        return {**lists, "minimal_discriminant": None if discriminant is None else str(discriminant)}


def factor_within_bound(number: fmpz) -> tuple[set[int], set[int]]:
    """Return the prime factors of a nonzero integer found within the bounds, and the unfactored composite factors.

    >>> factor_within_bound(fmpz(-12))
    ({2, 3}, set())
    """
    primes, composites = set[int](), set[int]()
    for factor, _ in abs(number).factor_smooth(_SMOOTH_BITS) if abs(number) > 1 else ():
        if factor.is_prime():
            primes.add(int(factor))
        elif factor.bit_length() <= _MAX_FACTORED_BITS:
            primes.update(int(prime) for prime, _ in factor.factor())
        else:
            composites.add(int(factor))
    return primes, composites


def bad_primes(curve: EllipticCurve, divisors: Iterable[fmpz] | None = None) -> BadPrimes:
    """Return the primes of bad reduction of a curve over Q, i.e. the primes that divide its minimal discriminant.

    Args:
        curve: the curve.
        divisors: nonzero integers whose prime factors, with 2 and 3, include all bad primes; None: the discriminant.

    Source: laska-1982 for minimal models, with the conditions of kraus-1989 at 2 and 3.

    >>> primes = bad_primes(EllipticCurve(fmpq(0), fmpq(0), fmpq(16)))
    >>> primes.text, primes.minimal_discriminant
    ('3', -27)
    """
    scale = fmpq(curve.a2.q.lcm(curve.a4.q).lcm(curve.a6.q))
    a2, a4, a6 = ((a * scale**k).p for a, k in ((curve.a2, 2), (curve.a4, 4), (curve.a6, 6)))
    c4, c6 = 16 * (a2 * a2 - 3 * a4), 32 * (9 * a2 * a4 - 2 * a2**3 - 27 * a6)
    discriminant = (c4**3 - c6 * c6) // 1728
    primes, composites = _factors([fmpz(6), discriminant] if divisors is None else [fmpz(6), *divisors, scale.p])
    bad, reduced_discriminant = list[int](), discriminant
    for p in sorted(primes):
        scale_exponent = min(_valuation(c, p) // k for c, k in ((discriminant, 12), (c4, 4), (c6, 6)) if c != 0)
        if p == 2:
            a, b = c4 // fmpz(2) ** (4 * scale_exponent) % 16, c6 // fmpz(2) ** (6 * scale_exponent) % 32
            scale_exponent -= not (b % 4 == 3 or (a == 0 and b in (0, 8)))
        elif p == 3:
            scale_exponent -= c6 != 0 and _valuation(c6, 3) == 6 * scale_exponent + 2
        reduced_discriminant //= fmpz(p) ** (12 * scale_exponent)
        if reduced_discriminant % p == 0:
            bad.append(p)
    bad_composites = {n for n in composites if coprime_part(fmpz(n), curve.j.q) == 1}
    is_known = all(c4.gcd(fmpz(n)) == 1 for n in composites)
    minimal_discriminant = int(reduced_discriminant) if is_known else None
    return BadPrimes(
        tuple(bad), (), tuple(sorted(bad_composites)), tuple(sorted(composites - bad_composites)), minimal_discriminant
    )


def bad_primes_of_plane(gamma: Any) -> BadPrimes:
    """Return the primes of Q below the bad primes of the curve `Jacobian(gamma)` (level_curves.py).

    Let delta = 1 - gamma. At a prime not above 2 or 3 the reduction is bad if and only if the valuation of gamma is not
    0, or the valuation of delta is not a multiple of 6: docs/mathematics.md, "Geometry of the level sets".

    Args:
        gamma: an element of Q, or of Q[t]/g with g integral and irreducible; not 0 and not 1.
    """
    delta = 1 - gamma
    if isinstance(gamma, fmpq):
        curve = EllipticCurve(9 + 3 * gamma, 48 * gamma, 64 * gamma * gamma)
        return bad_primes(curve, [gamma.p, gamma.q, delta.p])
    K, denominator = gamma.field, norm_of_denominator(gamma)
    # The primes below the denominator of j are bad; they are the primes that divide the norm of this denominator.
    norm_of_j_denominator = norm_of_denominator(27 * delta * (delta + 8) ** 3 / (delta - 1) ** 3)
    primes, composites = _factors([denominator, *((K.norm(x) * denominator).p for x in (gamma, delta))])
    bad, undecided = list[int](), list[int]()
    polynomial, field_discriminant = fmpq_poly(delta.matrix.charpoly()), K.chi.discriminant().p
    for p in sorted(primes | {2, 3}):
        if norm_of_j_denominator % p == 0:
            bad.append(p)
        elif p < 5:
            undecided.append(p)
        else:
            # The slopes are valuations divided by ramification indices, which are 1 if p does not divide disc(g).
            indices = range(1, K.degree + 1) if field_discriminant % p == 0 else (1,)
            valuations = [[s * e for e in indices if (s * e).q == 1] for s in newton_slopes(polynomial, p)]
            if any(all(n.p % 6 != 0 for n in possible_valuations) for possible_valuations in valuations):
                bad.append(p)
            elif any(n.p % 6 != 0 for possible_valuations in valuations for n in possible_valuations):
                undecided.append(p)
    bad_composites = {n for n in composites if coprime_part(fmpz(n), norm_of_j_denominator) == 1}
    return BadPrimes(
        tuple(bad), tuple(undecided), tuple(sorted(bad_composites)), tuple(sorted(composites - bad_composites))
    )


def norm_of_denominator(element: Any) -> fmpz:
    """Return the norm of the denominator of an element of a number field.

    It is the leading coefficient of the primitive polynomial over Z whose roots are the conjugates of the element.
    """
    return fmpq_poly(element.matrix.charpoly()).denom()


def newton_slopes(polynomial: fmpq_poly, p: int) -> set[fmpq]:
    """Return the p-adic valuations of the roots of a polynomial whose constant coefficient is not 0.

    >>> newton_slopes(fmpq_poly([25, 0, 1, 0, 5]), 5) == {fmpq(1), fmpq(-1, 2)}
    True
    """
    points = [(k, _valuation(c.p, p) - _valuation(fmpz(c.q), p)) for k, c in enumerate(polynomial.coeffs()) if c != 0]
    slopes, (k, height) = set[fmpq](), points[0]
    while k < points[-1][0]:
        slope, negative_x = min((fmpq(y - height, x - k), -x) for x, y in points if x > k)
        slopes.add(-slope)
        k, height = -negative_x, height + int(slope * (-negative_x - k))
    return slopes


def _factors(numbers: Iterable[fmpz]) -> tuple[set[int], set[int]]:
    factorizations = [factor_within_bound(number) for number in numbers]
    return set().union(*(primes for primes, _ in factorizations)), set().union(
        *(composites for _, composites in factorizations)
    )


def _valuation(number: fmpz, p: int) -> int:
    exponent = 0
    while number % p == 0:
        number, exponent = number // p, exponent + 1
    return exponent
