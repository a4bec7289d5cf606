"""Claims about compositions of maps: two maps commute, or an iterate is the identity.

Each point of a composition is written as a vector of rational functions of x, and the equation of the map is verified
for each step. Let y = Phi_f(x) and z = Phi_g(x) for maps with the equations M_f x~ = r_f and M_g x~ = r_g. One vector w
with M_g(y) w = r_g(y) and M_f(z) w = r_f(z) is both Phi_g(y) and Phi_f(z), and is stored once.
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from flint import fmpq_mpoly, nmod, nmod_mat

from kahanmaps.algebra.chance import derive_seed
from kahanmaps.algebra.polynomials import common_denominator, ring
from kahanmaps.certificates.identities import EquationClaim, FalseClaim, MapData, check_limits
from kahanmaps.errors import InputError

MAX_PERIOD = 1000
_PRIME = 2**61 - 1


@dataclass(frozen=True)
class RationalPoint:
    """A point that depends rationally on x; each coordinate has a numerator and an index into `denominators`."""

    numerators: tuple[fmpq_mpoly, ...]
    denominators: tuple[fmpq_mpoly, ...]
    denominator_indices: tuple[int, ...]

    @classmethod
    def of(cls, fractions: Sequence[tuple[fmpq_mpoly, fmpq_mpoly]]) -> RationalPoint:
        """Return the point with these coordinates, reduced to lowest terms over Z."""
        numerators, denominators, denominator_indices = [], list[fmpq_mpoly](), []
        for numerator, denominator in fractions:
            gcd = numerator.gcd(denominator)
            P, Q = numerator / gcd, denominator / gcd
            Q, P = Q / Q.leading_coefficient(), P / Q.leading_coefficient()
            common_multiple = common_denominator(P) * common_denominator(Q)
            P, Q = P * common_multiple, Q * common_multiple
            if Q not in denominators:
                denominators.append(Q)
            numerators.append(P)
            denominator_indices.append(denominators.index(Q))
        return cls(tuple(numerators), tuple(denominators), tuple(denominator_indices))


@dataclass(frozen=True)
class Chain(EquationClaim):
    """The points x = point 0, point 1, ..., each the image of an earlier point, two of which are equal.

    `maps` has a letter for each map. `arrows` contains, for point 1, 2, ..., the letter of the map, the number of the
    preimage, and the index of the point in `values`; x has index 0. `equal_points` are the numbers of the equal points.
    """

    maps: Mapping[str, MapData]
    arrows: tuple[tuple[str, int, int], ...]
    values: tuple[RationalPoint, ...]
    equal_points: tuple[int, int]

    def value_of(self, point: int) -> int:
        """Return the index in `values` of the point with this number."""
        return self.arrows[point - 1][2] if point else 0


def commuting(name: str, f: MapData, g: MapData) -> Chain:
    """Return the identities that prove that two maps in the same variables commute.

    Raises:
        FalseClaim: if the maps do not commute.
        InputError: if a map is the identity, as for f = 0, or if the identities have too many terms.
    """
    x = _identity_point(f)
    y, z = apply(f, x), apply(g, x)
    if x in (y, z):
        raise InputError(
            f"{name}: one of the maps is the identity, as for the zero field, and commutes with every map: "
            "no certificate is written"
        )
    w = apply(g, y)
    if w != apply(f, z):
        raise FalseClaim(f"{name}: the maps do not commute: no certificate can be written")
    return Chain(name, f, {"f": f, "g": g}, (("f", 0, 1), ("g", 1, 3), ("g", 0, 2), ("f", 3, 3)), (x, y, z, w), (2, 4))


def periodic(f: MapData, period: int) -> Chain:
    """Return the identities that prove that an iterate of the map is the identity.

    Raises:
        FalseClaim: if the iterate is not the identity; before any expansion, a point modulo a prime is tested.
        InputError: for a period above 1000, or if the identities have too many terms.
    """
    if period > MAX_PERIOD:
        raise InputError(f"found period = {period}, expected at most {MAX_PERIOD} for a certificate")
    # First try a random point modulo a prime. The equation is over Z, so if det M is not 0 at x modulo the prime, then
    # x~ modulo the prime is the image of x modulo the prime: if the iterate is the identity, it fixes each such x.
    n, rng = f.dim, random.Random(f"period {derive_seed(0, period, f.rows)}")
    residues = [rng.randrange(_PRIME) for _ in f.names]
    x = residues[:n]
    for _ in range(period):
        rows = [[int(entry(*x, *residues[n:]).p) for entry in row] for row in f.rows]
        M, r = nmod_mat([row[:-1] for row in rows], _PRIME), nmod_mat([row[-1:] for row in rows], _PRIME)
        if M.det() == nmod(0, _PRIME):
            break  # the image is undefined modulo the prime: the identities decide
        x = [int(entry) for entry in M.solve(r).entries()]
    else:
        if x != residues[:n]:
            point = ", ".join(f"{name} = {residue}" for name, residue in zip(f.names, residues, strict=True))
            raise FalseClaim(
                f"iterate {period} is not the identity, as it moves a point modulo 2^61 - 1: {point}; "
                "no certificate can be written"
            )
    values = [_identity_point(f)]
    for _ in range(period):
        values.append(apply(f, values[-1]))
    if values.pop() != values[0]:
        raise FalseClaim(f"iterate {period} is not the identity: no certificate can be written")
    arrows = tuple(("f", k, (k + 1) % period) for k in range(period))
    return Chain(f"period {period}", f, {"f": f}, arrows, tuple(values), (0, period))


def apply(data: MapData, point: RationalPoint) -> RationalPoint:
    """Return the image of a rational point under the map. Raises InputError if the image has too many terms."""
    fractions = []
    for numerator in data.numerators:
        gcd = numerator.gcd(data.determinant)
        values = [value_at(polynomial / gcd, point, data) for polynomial in (numerator, data.determinant)]
        (P, exponents), (Q, other_exponents) = values
        for denominator, a, b in zip(point.denominators, exponents, other_exponents, strict=True):
            P, Q = P * denominator ** max(b - a, 0), Q * denominator ** max(a - b, 0)
        fractions.append((P, Q))
    return RationalPoint.of(fractions)


def value_at(polynomial: fmpq_mpoly, point: RationalPoint, data: MapData) -> tuple[fmpq_mpoly, list[int]]:
    """Return (v d, e): v is the value at the point, d the product of the point's denominators to the powers e.

    Raises InputError if the result has too many terms.
    """
    n, letters = data.dim, ring(data.names).gens()
    rows = [[int(e) for e in exponents] for exponents in polynomial.monoms()]

    def degree(row: Sequence[int], index: int) -> int:
        return sum(e for e, k in zip(row[:n], point.denominator_indices, strict=True) if k == index)

    max_exponents = [max((degree(row, k) for row in rows), default=0) for k in range(len(point.denominators))]
    total, products = letters[0] * 0, 0
    for row, coefficient in zip(rows, polynomial.coeffs(), strict=True):
        term = letters[0] ** 0 * coefficient
        factors = [*zip(letters[n:], row[n:], strict=True), *zip(point.numerators, row[:n], strict=True)]
        factors += [
            (q, max_exponent - degree(row, k))
            for k, (q, max_exponent) in enumerate(zip(point.denominators, max_exponents, strict=True))
        ]
        for factor, exponent in factors:
            for _ in range(exponent):
                products += len(term) * len(factor)
                term *= factor
                check_limits(len(term), products)
        total += term
    return total, max_exponents


def _identity_point(data: MapData) -> RationalPoint:
    letters = ring(data.names).gens()
    return RationalPoint.of([(x, x**0) for x in letters[: data.dim]])
