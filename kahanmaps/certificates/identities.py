"""The polynomial identities by which a map conserves a function or a volume form, as exact polynomials over Z.

A map M(x, eps) x~ = r(x, eps) has x~ = N/D with D = det M and N = adj(M) r, polynomials in x. A function F = P/Q of x
is an integral if P(x~) Q(x) = P(x) Q(x~). With k the larger degree of P and Q in the variables, D^k P(N/D) and
D^k Q(N/D) are polynomials, and if P and Q have no common factor, then F is an integral exactly if there is a polynomial
C (the cofactor of the Darboux polynomials P and Q) with

    D^k P(N/D) = C P   and   D^k Q(N/D) = C Q.

These two identities are far shorter than the expanded difference, and they are what a certificate states and another
program multiplies out. The volume form dx/phi, phi = P/Q, is invariant if phi(x~) = phi(x) det dPhi(x); differentiating
M x~ = r gives M dPhi = L(x, x~), L_ij = d/dx_j (r_i - sum_k M_ik x~_k), so that the identity is
P(x~) Q(x) det M = P(x) Q(x~) det L.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from flint import fmpq_mpoly

from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.algebra.polynomials import RationalFunction, common_denominator, degree_in, ring
from kahanmaps.errors import InputError

MAX_DIMENSION = 6
MAX_TERMS = 20_000  # of one side of an identity, multiplied out: some ten seconds for Coq
MAX_PRODUCTS = 20_000_000  # of terms, to multiply one side out: some ten seconds for PARI


class FalseClaim(InputError):
    """A claim for which no certificate exists, as an exact computation refutes it."""


@dataclass(frozen=True)
class MapData:
    """A map by its equation: `rows` of (M | r), its determinant D, its adjugate and N = adj(M) r, polynomials over Z.

    All polynomials are in `names`: the variables, the symbols and eps. `new` are names for the coordinates of x~.
    """

    variables: tuple[str, ...]
    new: tuple[str, ...]
    names: tuple[str, ...]
    rows: tuple[tuple[fmpq_mpoly, ...], ...]
    determinant: fmpq_mpoly
    adjugate: tuple[tuple[fmpq_mpoly, ...], ...]
    numerators: tuple[fmpq_mpoly, ...]

    @property
    def dim(self) -> int:
        """The dimension."""
        return len(self.variables)


@dataclass(frozen=True)
class ConservedFunction:
    """F = P/Q with D^k P(N/D) = C P and D^k Q(N/D) = C Q; P, Q and C are polynomials over Z."""

    name: str
    numerator: fmpq_mpoly
    denominator: fmpq_mpoly
    degree: int
    cofactor: fmpq_mpoly


@dataclass(frozen=True)
class InvariantVolume:
    """phi = P/Q with P(x~) Q(x) det M = P(x) Q(x~) det L; `derivative` is L, in the names and those of x~.

    `is_free`: the identity holds for any two points, also if x~ is not the image of x, as for Hamiltonian systems.
    """

    name: str
    numerator: fmpq_mpoly
    denominator: fmpq_mpoly
    degree: int
    derivative: tuple[tuple[fmpq_mpoly, ...], ...]
    is_free: bool


def map_data(
    equation: Sequence[Sequence[fmpq_mpoly]], variables: Sequence[str], new: Sequence[str], names: Sequence[str]
) -> MapData:
    """The determinant, adjugate and numerators of a map given by the rows of (M | r).

    Args:
        equation: n rows of n + 1 polynomials over Q in `names`.
        variables: the first n of `names`.
        new: names for x~.
        names: the variables, the symbols and eps.

    Raises:
        InputError: for more than six variables, or too many terms.
    """
    n = len(variables)
    if n > MAX_DIMENSION:
        raise InputError(f"expected a map in at most {MAX_DIMENSION} variables for a certificate, got {n}")
    rows = [tuple(_integral_row(row)) for row in equation]
    zero, one = rows[0][0] * 0, rows[0][0] ** 0

    def solution(right: Sequence[fmpq_mpoly]) -> list[fmpq_mpoly]:
        """det M and det M times the solution of M y = right: (M | right) annihilates (y, -1)."""
        *minors, last = kernel_minors([[*row[:-1], entry] for row, entry in zip(rows, right, strict=True)], _times)
        sign = -1 if n % 2 else 1  # the last of the signed minors is (-1)^n det M
        return [sign * last, *(-sign * minor for minor in minors)]

    determinant, *numerators = solution([row[-1] for row in rows])
    columns = [solution([one if i == j else zero for i in range(n)])[1:] for j in range(n)]
    adjugate = tuple(tuple(columns[j][i] for j in range(n)) for i in range(n))
    return MapData(tuple(variables), tuple(new), tuple(names), tuple(rows), determinant, adjugate, tuple(numerators))


def conserved_function(data: MapData, name: str, function: RationalFunction) -> ConservedFunction:
    """The identities that prove that the map conserves the function.

    Raises:
        FalseClaim: if it does not.
        InputError: if the identities have too many terms.
    """
    P, Q = _coprime(function, data.names)
    k = max(degree_in(P, data.dim), degree_in(Q, data.dim))
    moved = [homogeneous_value(polynomial, k, data) for polynomial in (P, Q)]
    cofactors = [_quotient(image, polynomial) for image, polynomial in zip(moved, (P, Q), strict=True)]
    if not cofactors[0] or cofactors[0] != cofactors[1]:  # 0: the image of the map lies in Q = 0
        raise FalseClaim(f"{name} is not conserved: no certificate can be written")
    return ConservedFunction(name, P, Q, k, cofactors[0])


def invariant_volume(data: MapData, function: RationalFunction) -> InvariantVolume:
    """The identity that proves that the map leaves the volume form dx/phi invariant, phi the function.

    Raises:
        FalseClaim: if it does not.
        InputError: if the identity has too many terms.
    """
    P, Q = _coprime(function, data.names)
    n, k = data.dim, max(degree_in(P, data.dim), degree_in(Q, data.dim))
    context = ring((*data.variables, *data.new, *data.names[n:]))
    letters = context.gens()
    old, new = [*letters[:n], *letters[2 * n :]], letters[n : 2 * n]
    residuals = []
    for row in data.rows:
        *entries, right = (entry.compose(*old, ctx=context) for entry in row)
        residuals.append(right - sum((e * y for e, y in zip(entries, new, strict=True)), context.constant(0)))
    derivative = tuple(tuple(residual.derivative(j) for j in range(n)) for residual in residuals)
    at_old, at_new = ([F.compose(*at, ctx=context) for F in (P, Q)] for at in (old, [*new, *letters[2 * n :]]))
    left = _times(_times(at_new[0], at_old[1]), data.determinant.compose(*old, ctx=context))
    if left == _times(_times(at_old[0], at_new[1]), determinant(derivative)):
        return InvariantVolume("volume", P, Q, k, derivative, True)
    # det L at x~ = N/D: D L(x, N/D) has polynomial entries, as L is of degree 1 in x~.
    point = [*data.numerators, *ring(data.names).gens()[n:]]
    entries_at_image = [[_at_numerators(entry, data, point) for entry in row] for row in derivative]
    left = _times(_times(homogeneous_value(P, k, data), Q), data.determinant ** (n + 1))
    right = _times(_times(homogeneous_value(Q, k, data), P), determinant(entries_at_image))
    if left != right:
        raise FalseClaim("dx/phi is not invariant: no certificate can be written")
    return InvariantVolume("volume", P, Q, k, derivative, False)


def determinant(matrix: Sequence[Sequence[fmpq_mpoly]]) -> fmpq_mpoly:
    """The determinant of a square matrix of polynomials. Raises InputError where it has too many terms."""
    *_, last = kernel_minors([[*row, row[0] * 0] for row in matrix], _times)
    signed: fmpq_mpoly = -last if len(matrix) % 2 else last  # the last of the signed minors
    return signed


def letters_of(data: MapData, taken: str) -> dict[str, str]:
    """Return names for the letters of a map in a script: x, x1, x1_new and eps stay as they are, others become v_NAME.

    `taken` is a regular expression for the names that the script itself defines.
    """
    letters: dict[str, str] = {}
    for name in (*data.names, *data.new):
        is_plain = re.fullmatch(r"eps|[a-z]\d*(_new)?", name) and not re.fullmatch(taken, name)
        text = name if is_plain else "v_" + re.sub(r"[^A-Za-z0-9_]", "_", name)
        while text in letters.values():
            text += "_"
        letters[name] = text
    return letters


def homogeneous_value(polynomial: fmpq_mpoly, degree: int, data: MapData) -> fmpq_mpoly:
    """D^degree P(N/D), a polynomial. Raises InputError where it has too many terms."""
    n = data.dim
    powers = [[value**0] for value in (*data.numerators, data.determinant)]
    letters = ring(data.names).gens()
    total, products = letters[0] * 0, 0
    for exponents, coefficient in polynomial.terms():
        term = letters[0] ** 0 * coefficient
        for letter, exponent in zip(letters[n:], exponents[n:], strict=True):
            term *= letter ** int(exponent)
        for k, exponent in enumerate((*map(int, exponents[:n]), degree - sum(map(int, exponents[:n])))):
            while len(powers[k]) <= exponent:
                powers[k].append(_times(powers[k][-1], (*data.numerators, data.determinant)[k]))
            products += len(term) * len(powers[k][exponent])
            if products > MAX_PRODUCTS:
                raise InputError(f"the identities take more than {MAX_PRODUCTS} products of terms to multiply out")
            term = _times(term, powers[k][exponent])
        total += term
    return total


def _at_numerators(entry: fmpq_mpoly, data: MapData, point: Sequence[fmpq_mpoly]) -> fmpq_mpoly:
    """Return D times an entry of L at x~ = N/D; entries are of degree at most 1 in x~."""
    n, letters = data.dim, ring(data.names).gens()
    total = letters[0] * 0
    for exponents, coefficient in entry.terms():
        term = letters[0] ** 0 * coefficient
        for letter, exponent in zip(letters, (*exponents[:n], *exponents[2 * n :]), strict=True):
            term *= letter ** int(exponent)
        (which,) = [k for k in range(n) if exponents[n + k]] or (None,)
        total += term * (data.determinant if which is None else point[which])
    return total


def _coprime(function: RationalFunction, names: tuple[str, ...]) -> tuple[fmpq_mpoly, fmpq_mpoly]:
    """Return numerator and denominator in lowest terms, with integral coefficients, in `names`."""
    context = ring(names)
    P, Q = function.numerator, function.denominator
    if function.names != names:
        letters = dict(zip(names, context.gens(), strict=True))
        P, Q = (polynomial.compose(*(letters[name] for name in function.names), ctx=context) for polynomial in (P, Q))
    common = P.gcd(Q)
    P, Q = P / common, Q / common
    scale = common_denominator(P), common_denominator(Q)
    multiple = scale[0] * scale[1] / scale[0].gcd(scale[1])
    return P * multiple, Q * multiple


def _integral_row(row: Sequence[fmpq_mpoly]) -> list[fmpq_mpoly]:
    """A row of (M | r) times the least number that makes its coefficients integers: the equation is the same."""
    multiple = common_denominator(row[0])
    for entry in row[1:]:
        other = common_denominator(entry)
        multiple = multiple * other / multiple.gcd(other)
    return [entry * multiple for entry in row]


def _quotient(product: fmpq_mpoly, factor: fmpq_mpoly) -> fmpq_mpoly | None:
    """product/factor, or None where it is no polynomial."""
    quotient, remainder = divmod(product, factor)
    return None if remainder else quotient


def _times(left: fmpq_mpoly, right: fmpq_mpoly) -> fmpq_mpoly:
    product = left * right
    if len(product) > MAX_TERMS:
        raise InputError(
            f"the identities of the certificate are too long: more than {MAX_TERMS} terms when multiplied out"
        )
    return product
