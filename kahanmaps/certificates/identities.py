"""The identities that prove that a map conserves a function or a volume form, as exact polynomials over Z.

A map M(x, eps) x~ = r(x, eps) has x~ = N/D with D = det M and N = adj(M) r, polynomials in x. A function F = P/Q of x
is an integral if P(x~) Q(x) = P(x) Q(x~). With k the larger of the degrees of P and Q in x, D^k P(N/D) and D^k Q(N/D)
are polynomials. If P and Q have no common factor, F is an integral if and only if there is a polynomial C (the cofactor
of the Darboux polynomials P and Q) with

    D^k P(N/D) = C P   and   D^k Q(N/D) = C Q.

These two identities are far shorter than the expanded difference. A certificate states them, and another program
expands them. The volume form dx/phi, phi = P/Q, is invariant if phi(x~) = phi(x) det dPhi(x). Differentiating M x~ = r
gives M dPhi = L(x, x~), L_ij = d/dx_j (r_i - sum_k M_ik x~_k), so that the identity is P(x~) Q(x) det M = P(x) Q(x~)
det L. Likewise, dPhi T dPhi^T = T(x~) with T = (P_ij)/Q becomes Q(x~) L P(x) L^T = Q(x) M P(x~) M^T. If an identity
does not hold for all x and x~, then x~ = N/D is inserted, and both sides are multiplied by a power of D.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from itertools import combinations
from math import lcm

from flint import fmpq_mpoly

from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.algebra.polynomials import RationalFunction, common_denominator, degree_in, over_one_denominator, ring
from kahanmaps.algebra.work import units_at
from kahanmaps.errors import InputError

Row = Sequence[fmpq_mpoly]
MAX_DIMENSION = 6
MAX_TERMS = 20_000  # terms of one side of an expanded identity: some ten seconds for Coq
MAX_PRODUCTS = 20_000_000  # products of terms to expand one side: some ten seconds for PARI


@dataclass
class Limits:
    """`multiple` is a factor for MAX_TERMS and MAX_PRODUCTS, `terms` counts the terms of all sides checked so far."""

    multiple: float = 1.0
    terms: int = 0


_LIMITS: ContextVar[Limits] = ContextVar("limits", default=Limits())  # noqa: B039  # terms count in `limited` only


@contextmanager
def limited(effort: int) -> Iterator[Limits]:
    """Set the limits for the identities of a certificate; each increase of `effort` by 1 doubles them."""
    token = _LIMITS.set(limits := Limits(units_at(effort, 1.0)))
    try:
        yield limits
    finally:
        _LIMITS.reset(token)


def check_limits(terms: int, products: int = 0) -> None:
    """Check the size of one side of an identity: its terms, and the products of two terms that its expansion takes.

    Raises:
        InputError: if one of these numbers exceeds its limit.
    """
    limits = _LIMITS.get()
    limits.terms += terms
    for count, limit, text in (
        (products, MAX_PRODUCTS, "take more than {} products of terms to multiply out"),
        (terms, MAX_TERMS, "have more than {} terms when multiplied out"),
    ):
        if count > (max_count := round(limit * limits.multiple)):
            raise InputError(f"the identities of the certificate {text.format(max_count)}; raise --effort")


class FalseClaim(InputError):
    """A claim that an exact computation refutes, so that no certificate exists."""


@dataclass(frozen=True)
class MapData:
    """A map with the equation M x~ = r: `rows` of (M | r) over Z in the `names` of the variables, the symbols and eps.

    `new` are names for the coordinates of x~. The solution x~ = N/D is computed when it is first used. Raises
    InputError if the solution is too long.
    """

    variables: tuple[str, ...]
    new: tuple[str, ...]
    names: tuple[str, ...]
    rows: tuple[tuple[fmpq_mpoly, ...], ...]

    @property
    def dim(self) -> int:
        """The dimension."""
        return len(self.variables)

    @cached_property
    def solution(self) -> tuple[fmpq_mpoly, ...]:
        """D = det M, followed by N = adj(M) r."""
        return tuple(self._solve([row[-1] for row in self.rows]))

    @property
    def determinant(self) -> fmpq_mpoly:
        """D = det M."""
        return self.solution[0]

    @property
    def numerators(self) -> tuple[fmpq_mpoly, ...]:
        """N = adj(M) r."""
        return self.solution[1:]

    @cached_property
    def adjugate(self) -> tuple[tuple[fmpq_mpoly, ...], ...]:
        """The adjugate of M."""
        zero, one = self.rows[0][0] * 0, self.rows[0][0] ** 0
        columns = [self._solve([one if i == j else zero for i in range(self.dim)])[1:] for j in range(self.dim)]
        return tuple(zip(*columns, strict=True))

    @cached_property
    def residuals(self) -> tuple[fmpq_mpoly, ...]:
        """r - M x~, in the ring of `two_points`."""
        return tuple(-residual for residual in self.residual(self.two_points, 0, self.dim))

    @cached_property
    def derivative(self) -> tuple[tuple[fmpq_mpoly, ...], ...]:
        """L, the derivative of r - M x~ in x at fixed x~."""
        return tuple(tuple(residual.derivative(j) for j in range(self.dim)) for residual in self.residuals)

    @property
    def two_points(self) -> tuple[str, ...]:
        """The names for x and x~, then the constants: the symbols and eps."""
        return (*self.variables, *self.new, *self.names[self.dim :])

    def residual(self, names: Sequence[str], x_index: int, y_index: int) -> list[fmpq_mpoly]:
        """Return M(x) y - r(x) in the ring of `names`; x begins at the name with index `x_index`, y at `y_index`."""
        n, context = self.dim, ring(names)
        letters = context.gens()
        constants = letters[len(names) - len(self.names) + n :]
        result = []
        for row in self.rows:
            *entries, right = (entry.compose(*letters[x_index : x_index + n], *constants, ctx=context) for entry in row)
            result.append(sum((e * y for e, y in zip(entries, letters[y_index : y_index + n], strict=True)), -right))
        return result

    def at_points(self, *functions: fmpq_mpoly) -> tuple[list[fmpq_mpoly], list[fmpq_mpoly]]:
        """Return the values at x, and those at x~, of polynomials in x, in the ring of `two_points`."""
        n, context = self.dim, ring(self.two_points)
        letters = context.gens()
        points = letters[:n], letters[n : 2 * n]
        at_x, at_image = ([F.compose(*x, *letters[2 * n :], ctx=context) for F in functions] for x in points)
        return at_x, at_image

    def with_rows(self, rows: Sequence[Row]) -> MapData:
        """Return another map in the same variables: `rows` are those of (M | -r) in its equation M x~ = r."""
        return map_data([[*row[:-1], -row[-1]] for row in rows], self.variables, self.new, self.names)

    def _solve(self, right_side: Sequence[fmpq_mpoly]) -> list[fmpq_mpoly]:
        """Return [det M, det M y_1, ...] for the solution y of M y = r = `right_side`; (M | r) annihilates (y, -1)."""
        n = self.dim
        rows = [[*row[:-1], entry] for row, entry in zip(self.rows, right_side, strict=True)]
        *minors, last_minor = kernel_minors(rows, times)
        sign = -1 if n % 2 else 1  # the last signed minor is (-1)^n det M
        return [sign * last_minor, *(-sign * minor for minor in minors)]


@dataclass(frozen=True)
class MapClaim:
    """A claim about a map, and its name."""

    name: str
    data: MapData

    @property
    def is_at_image(self) -> bool:
        """Whether the proof inserts x~ = N/D; False if the identity holds for arbitrary points x and x~."""
        return not getattr(self, "is_free", False)


class EquationClaim(MapClaim):
    """A claim that follows from the equation of the map, without solving the equation for x~."""

    is_free = True


@dataclass(frozen=True)
class InvariantTensor(MapClaim):
    """A Poisson tensor (P_ij)/Q with Q(x~) L P(x) L^T = Q(x) M P(x~) M^T; P_ij with i < j are stored by (i, j).

    `is_free`: whether the identity holds for arbitrary points x and x~.
    """

    upper: dict[tuple[int, int], fmpq_mpoly]
    denominator: fmpq_mpoly
    degree: int
    is_free: bool

    @property
    def dim(self) -> int:
        """The dimension."""
        return self.data.dim

    def entry(self, i: int, j: int) -> fmpq_mpoly:
        """Return P_ij."""
        return self.upper[i, j] if i < j else -self.upper[j, i] if j < i else self.denominator * 0

    @property
    def triples(self) -> list[tuple[int, int, int]]:
        """The indices i < j < k of the Jacobi identities."""
        return list(combinations(range(self.dim), 3))


def map_data(
    equation: Sequence[Sequence[fmpq_mpoly]], variables: Sequence[str], new: Sequence[str], names: Sequence[str]
) -> MapData:
    """Return the map with the rows of (M | r), made integral and divided by their common factors.

    Args:
        equation: n rows of n + 1 polynomials over Q in `names`.
        variables: the first n of `names`.
        new: names for the coordinates of x~.
        names: the variables, the symbols and eps.

    Raises:
        InputError: if there are more than six variables.
    """
    n = len(variables)
    if n > MAX_DIMENSION:
        raise InputError(f"expected a map in at most {MAX_DIMENSION} variables for a certificate, got {n}")
    multiples = (lcm(*(int(common_denominator(entry)) for entry in row)) for row in equation)
    rows = [[entry * multiple for entry in row] for row, multiple in zip(equation, multiples, strict=True)]
    row_gcds = [reduce(fmpq_mpoly.gcd, row) for row in rows]  # monic; the next line makes the quotients integral again
    integer_gcds = (gcd * common_denominator(gcd) for gcd in row_gcds)
    primitive_rows = tuple(tuple(entry / c for entry in row) for row, c in zip(rows, integer_gcds, strict=True))
    return MapData(tuple(variables), tuple(new), tuple(names), primitive_rows)


def restrict(data: MapData, function: RationalFunction) -> MapData:
    """Restrict the map to the fewest variables that determine the function along orbits, such as those of one plane."""
    n, names = data.dim, data.names
    used_names = (occurring(function.numerator) | occurring(function.denominator)) & set(names[:n])
    while True:
        rows = [row for name, row in zip(names, data.rows, strict=False) if name in used_names]
        further_names = {names[j] for row in rows for j in range(n) if row[j]}
        further_names |= {name for row in rows for entry in row for name in occurring(entry)} & set(names[:n])
        if further_names <= used_names:
            break
        used_names |= further_names
    if len(used_names) in (0, n):
        return data
    indices = [j for j in range(n) if names[j] in used_names]
    variables, new = (tuple(letters[j] for j in indices) for letters in (names, data.new))
    context = ring((*variables, *names[n:]))
    generators = dict(zip(context.names(), context.gens(), strict=True))
    images = [generators.get(name, context.constant(0)) for name in names]
    restricted_rows = tuple(tuple(row[j].compose(*images, ctx=context) for j in (*indices, n)) for row in rows)
    return MapData(variables, new, tuple(context.names()), restricted_rows)


def invariant_tensor(data: MapData, name: str, rows: Sequence[Sequence[RationalFunction]]) -> InvariantTensor:
    """Return the identities that prove that a tensor is invariant under the map and satisfies the Jacobi identity.

    Raises:
        FalseClaim: if an identity does not hold.
        InputError: if an identity has too many terms.
    """
    n, context = data.dim, ring(data.names)
    letters = dict(zip(data.names, context.gens(), strict=True))
    entries = {(i, j): rows[i][j] for i, j in combinations(range(n), 2)}
    used_names = next(iter(entries.values())).names if entries else ()
    numerators, Q = over_one_denominator(list(entries.values()), context, [letters[name] for name in used_names])
    multiple = lcm(*(int(common_denominator(P)) for P in (*numerators, Q)))
    Q, upper = Q * multiple, {pair: P * multiple for pair, P in zip(entries, numerators, strict=True)}
    if not any(upper.values()):
        raise InputError(f"the tensor {name} is 0 or has dimension 1: expected another one for a certificate")
    k = max(degree_in(P, n) for P in (*upper.values(), Q))
    claim = InvariantTensor(name, data, upper, Q, k, True)
    P = [[claim.entry(i, j) for j in range(n)] for i in range(n)]
    for indices in claim.triples:
        total = context.constant(0)
        for i, j, l in (indices, (*indices[1:], indices[0]), (indices[2], *indices[:2])):
            for s in range(n):
                total += times(P[i][s], times(P[j][l].derivative(s), Q) - times(P[j][l], Q.derivative(s)))
        if total:
            raise FalseClaim(f"{name} is no Poisson tensor: no certificate can be written")
    x_entries, image_entries = data.at_points(*(entry for row in (*P, *data.rows) for entry in row), Q)
    P_at_x, M = (
        [x_entries[n * i : n * i + n] for i in range(n)],
        [x_entries[n * n + (n + 1) * i :][:n] for i in range(n)],
    )
    P_at_image = [image_entries[n * i : n * i + n] for i in range(n)]
    if _congruence(data.derivative, P_at_x, image_entries[-1]) == _congruence(M, P_at_image, x_entries[-1]):
        return claim
    P_values = [[homogeneous_value(entry, k, data) for entry in row] for row in P]
    left = _congruence(derivative_at_image(data), P, homogeneous_value(Q, k, data))
    if left != _congruence([row[:-1] for row in data.rows], P_values, times(Q, data.determinant**2)):
        raise FalseClaim(f"the map is not Poisson for {name}: no certificate can be written")
    return replace(claim, is_free=False)


def _congruence(A: Sequence[Row], P: Sequence[Row], factor: fmpq_mpoly) -> list[fmpq_mpoly]:
    """Return the entries of factor A P A^T with i < j."""
    n = len(P)
    zero = factor * 0
    AP = [[sum((times(row[k], P[k][j]) for k in range(n)), zero) for j in range(n)] for row in A]
    pairs = combinations(range(n), 2)
    return [times(factor, sum((times(AP[i][k], A[j][k]) for k in range(n)), zero)) for i, j in pairs]


def derivative_at_image(data: MapData) -> list[list[fmpq_mpoly]]:
    """Return D L(x, N/D), a matrix of polynomials, since L has degree at most 1 in x~."""
    n, context = data.dim, ring(data.names)

    def at_image(entry: fmpq_mpoly) -> fmpq_mpoly:
        total = context.constant(0)
        for exponents, coefficient in entry.terms():
            i = next((k for k in range(n) if exponents[n + k]), -1)  # x~_i = N_i/D, or 1 = D/D
            total += context.from_dict({exponents[:n] + exponents[2 * n :]: coefficient}) * data.solution[1 + i]
        return total

    return [[at_image(entry) for entry in row] for row in data.derivative]


def determinant(matrix: Sequence[Sequence[fmpq_mpoly]]) -> fmpq_mpoly:
    """Return the determinant of a square matrix of polynomials. Raises InputError if it has too many terms."""
    *_, last_minor = kernel_minors([[*row, row[0] * 0] for row in matrix], times)
    value: fmpq_mpoly = -last_minor if len(matrix) % 2 else last_minor  # the minors are signed
    return value


def letters_of(data: MapData, reserved: str) -> dict[str, str]:
    """Return names for the letters of a map in a script: x, x1, x1_new and eps do not change, others become v_NAME.

    `reserved` is a regular expression for the names that the script itself defines.
    """
    letters: dict[str, str] = {}
    for name in (*data.names, *data.new, *(f"{name}2" for name in data.new)):
        is_plain = re.fullmatch(r"eps|[a-z]\d*(_new2?)?", name) and not re.fullmatch(reserved, name)
        text = name if is_plain else "v_" + re.sub(r"[^A-Za-z0-9_]", "_", name)
        while text in letters.values():
            text += "_"
        letters[name] = text
    return letters


def homogeneous_value(polynomial: fmpq_mpoly, degree: int, data: MapData) -> fmpq_mpoly:
    """Return D^degree P(N/D), a polynomial. Raises InputError if it has too many terms."""
    n, context, values = data.dim, ring(data.names), (*data.numerators, data.determinant)
    powers = [[value**0] for value in values]
    total, products = context.constant(0), 0
    for exponents, coefficient in polynomial.terms():
        term = context.from_dict({(0,) * n + exponents[n:]: coefficient})
        for k, exponent in enumerate((*map(int, exponents[:n]), degree - sum(map(int, exponents[:n])))):
            while len(powers[k]) <= exponent:
                powers[k].append(times(powers[k][-1], values[k]))
            products += len(term) * len(powers[k][exponent])
            check_limits(0, products)
            term = times(term, powers[k][exponent])
        total += term
    return total


def occurring(polynomial: fmpq_mpoly) -> set[str]:
    """Return the names that occur in a polynomial."""
    return set(polynomial.context().names()) - set(polynomial.unused_gens())


def coprime(function: RationalFunction, names: tuple[str, ...]) -> tuple[fmpq_mpoly, fmpq_mpoly]:
    """Return numerator and denominator in lowest terms, over Z, in the ring of `names`."""
    context = ring(names)
    P, Q = function.numerator, function.denominator
    if function.names != names:
        letters = dict(zip(names, context.gens(), strict=True))
        if unknown := sorted((occurring(P) | occurring(Q)) - set(names)):
            raise InputError(f"found {unknown[0]} in a function, expected {', '.join(names)} for a certificate")
        images = [letters.get(name, context.constant(0)) for name in function.names]
        P, Q = (polynomial.compose(*images, ctx=context) for polynomial in (P, Q))
    gcd = P.gcd(Q)
    P, Q = P / gcd, Q / gcd
    denominators = common_denominator(P), common_denominator(Q)
    multiple = denominators[0] * denominators[1] / denominators[0].gcd(denominators[1])
    return P * multiple, Q * multiple


def quotient(product: fmpq_mpoly, factor: fmpq_mpoly) -> fmpq_mpoly | None:
    """Return product/factor, or None if it is not a polynomial."""
    quotient, remainder = divmod(product, factor)
    return None if remainder else quotient


def times(left: fmpq_mpoly, right: fmpq_mpoly) -> fmpq_mpoly:
    """Return the product. Raises InputError if it has too many terms."""
    product = left * right
    check_limits(len(product))
    return product
