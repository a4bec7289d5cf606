"""Darboux polynomials and their cofactors in factored form, so that no large product is expanded.

P is a Darboux polynomial of the map x~ = N/D, with degree k and cofactor C, if D^k P(N/D) = C P. If P is a product of
Darboux polynomials P_i, C is the product of their cofactors C_i and a power of D. The C_i often have common factors
c_1, c_2, ... Only the identities D^(k_i) P_i(N/D) = C_i P_i are expanded; the others compare monomials in D and c_j.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import gcd, prod

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.polynomials import RationalFunction, degree_in
from kahanmaps.certificates.identities import (
    FalseClaim,
    MapClaim,
    MapData,
    coprime,
    derivative_at_image,
    determinant,
    homogeneous_value,
    quotient,
    times,
)
from kahanmaps.errors import InputError

_MAX_FACTORED_TERMS = 3000  # terms of a cofactor; longer cofactors are not factored


@dataclass(frozen=True)
class Monomial:
    """A constant times a product of powers of D, c_1, c_2, ...; `powers` are the exponents in this order."""

    constant: int
    powers: tuple[int, ...]

    def __mul__(self, other: Monomial) -> Monomial:
        return Monomial(self.constant * other.constant, tuple(map(sum, zip(self.powers, other.powers, strict=True))))

    def __pow__(self, exponent: int) -> Monomial:
        return Monomial(self.constant**exponent, tuple(exponent * power for power in self.powers))

    def divide_by(self, exponents: Sequence[int]) -> Monomial:
        """Return the quotient of this monomial by the monomial with these exponents and constant 1."""
        return Monomial(self.constant, tuple(a - b for a, b in zip(self.powers, exponents, strict=True)))

    def at(self, values: Sequence[fmpq_mpoly]) -> fmpq_mpoly:
        """Return the monomial with the polynomials `values` for D, c_1, ...; InputError if it has too many terms."""
        total = values[0] ** 0 * self.constant
        for value, power in zip(values, self.powers, strict=True):
            for _ in range(power):
                total = times(total, value)
        return total

    def text(self, D: str, multiply: str = "*", power: str = "^") -> str:
        """Return the monomial as text, in which D has the name `D`; if this is empty, the power of D is omitted."""
        names = [D, *(f"c{j}" for j in range(1, len(self.powers)))]
        pairs = [(name, k) for name, k in zip(names, self.powers, strict=True) if name and k]
        factors = [name if k == 1 else f"{name}{power}{k}" for name, k in pairs]
        constant = [str(self.constant) if self.constant > 0 else f"({self.constant})"]
        return multiply.join(factors if self.constant == 1 and factors else constant + factors)


@dataclass(frozen=True)
class DarbouxFactor:
    """A Darboux polynomial P over Z, D^k P(N/D) = C P with `cofactor` C over Z, and its exponent in a product.

    k is `degree`: the degree of P in the variables, or a larger number if P has a factor of D.
    """

    polynomial: fmpq_mpoly
    degree: int
    exponent: int
    cofactor: Monomial


@dataclass(frozen=True)
class DarbouxProduct:
    """A product of Darboux polynomials and of `content`, a polynomial over Z that does not contain the variables."""

    content: fmpq_mpoly
    factors: tuple[DarbouxFactor, ...]

    @cached_property
    def polynomial(self) -> fmpq_mpoly:
        """The expanded product."""
        return prod((factor.polynomial**factor.exponent for factor in self.factors), start=self.content)

    @property
    def is_single(self) -> bool:
        """Whether the product is one factor with exponent 1, without a content other than 1."""
        return self.content.is_one() and [factor.exponent for factor in self.factors] == [1]

    @property
    def degree(self) -> int:
        """The sum of degree times exponent over the factors."""
        return sum(factor.degree * factor.exponent for factor in self.factors)

    def cofactor(self, degree: int, count: int) -> Monomial:
        """Return C with D^degree P(N/D) = C P for this product P: a monomial in D and c_1, ..., c_count."""
        total = Monomial(1, (degree - self.degree, *[0] * count))
        for factor in self.factors:
            total *= factor.cofactor**factor.exponent
        return total


@dataclass(frozen=True)
class DarbouxProducts:
    """Products whose cofactors are monomials in D and the same polynomials c_1, c_2, ... (`common_factors`) over Z."""

    products: tuple[DarbouxProduct, ...]
    common_factors: tuple[fmpq_mpoly, ...]

    @property
    def degree(self) -> int:
        """The largest degree of a product."""
        return max(product.degree for product in self.products)

    @property
    def cofactors(self) -> list[Monomial]:
        """The cofactors C of the products P: D^k P(N/D) = C P, where k is the same `degree` for all."""
        return [product.cofactor(self.degree, len(self.common_factors)) for product in self.products]


@dataclass(frozen=True)
class ConservedFunction(MapClaim):
    """F = P/Q is conserved, since the two products of Darboux polynomials have the same cofactor."""

    fraction: DarbouxProducts


@dataclass(frozen=True)
class DarbouxPolynomial(MapClaim):
    """A Darboux polynomial P of degree k with cofactor C: P(x~) = P C/D^k."""

    product: DarbouxProducts


@dataclass(frozen=True)
class InvariantVolume(MapClaim):
    """The volume form dx/phi, phi = P/Q, is invariant: P(x~) Q(x) det M = P(x) Q(x~) det L, with M and L of `data`.

    `fraction` contains P and Q as products of Darboux polynomials. It is None if the identity holds for arbitrary
    points x and x~, as for Hamiltonian systems.
    """

    numerator: fmpq_mpoly
    denominator: fmpq_mpoly
    fraction: DarbouxProducts | None

    @property
    def is_free(self) -> bool:
        """Whether the identity holds for arbitrary points x and x~."""
        return self.fraction is None

    @property
    def balance(self) -> tuple[Monomial, Monomial, Monomial]:
        """The monomials (c, l, r) with C D^(n + 1) = c l and B = c r; the claim is then l = r D^n det L(x, N/D).

        C is the cofactor of P, B the cofactor of Q, and n the dimension.
        """
        assert self.fraction is not None
        C, B = self.fraction.cofactors
        C = replace(C, powers=(C.powers[0] + self.data.dim + 1, *C.powers[1:]))
        common_powers = tuple(map(min, zip(C.powers, B.powers, strict=True)))
        return Monomial(1, common_powers), C.divide_by(common_powers), B.divide_by(common_powers)


def conserved_function(data: MapData, name: str, function: RationalFunction) -> ConservedFunction:
    """Return the identities that prove that the map conserves a function.

    Raises:
        FalseClaim: if the map does not conserve the function.
        InputError: if the identities have too many terms.
    """
    P, Q = coprime(function, data.names)
    if max(degree_in(P, data.dim), degree_in(Q, data.dim)) == 0:
        raise InputError(f"{name} is a constant, which every map conserves: no certificate is written")
    for splits in (True, False):
        fraction = darboux_products(data, [P, Q], splits)
        if fraction is not None and fraction.cofactors[0] == fraction.cofactors[1]:
            return ConservedFunction(name, data, fraction)
    raise FalseClaim(f"{name} is not conserved: no certificate can be written")


def darboux_polynomial(data: MapData, name: str, function: RationalFunction) -> DarbouxPolynomial:
    """Return the identity that proves that `function`, a polynomial, is a Darboux polynomial of the map.

    Raises:
        FalseClaim: if it is not a Darboux polynomial.
        InputError: if the identity has too many terms.
    """
    P, _ = coprime(function, data.names)
    if degree_in(P, data.dim) == 0:
        raise InputError(f"{name} is a constant, expected a polynomial of positive degree: no certificate is written")
    product = darboux_products(data, [P])
    if product is None:
        raise FalseClaim(f"{name} is no Darboux polynomial: no certificate can be written")
    return DarbouxPolynomial(name, data, product)


def invariant_volume(data: MapData, name: str, function: RationalFunction) -> InvariantVolume:
    """Return the identity that proves that the map preserves the volume form dx/phi, where phi is `function`.

    Raises:
        FalseClaim: if the map does not preserve this volume form.
        InputError: if the identity has too many terms.
    """
    P, Q = coprime(function, data.names)
    if not P:
        raise InputError("found the density 0, expected another function: no certificate is written")
    at_x, at_image = data.at_points(P, Q, data.determinant)
    if times(times(at_image[0], at_x[1]), at_x[2]) == times(times(at_x[0], at_image[1]), determinant(data.derivative)):
        return InvariantVolume(name, data, P, Q, None)
    volume = determinant(derivative_at_image(data))
    fraction = darboux_products(data, [P, Q])  # P and Q are Darboux polynomials if dx/phi is invariant
    if fraction is not None:
        claim = InvariantVolume(name, data, P, Q, fraction)
        values = (data.determinant, *fraction.common_factors)
        _, left, right = claim.balance
        if left.at(values) == times(right.at(values), volume):
            return claim
    raise FalseClaim("dx/phi is not invariant: no certificate can be written")


def darboux_products(data: MapData, polynomials: Sequence[fmpq_mpoly], splits: bool = True) -> DarbouxProducts | None:
    """Write polynomials over Z as products of Darboux polynomials of the map; return None if one is not such a product.

    Args:
        data: the map.
        polynomials: nonzero polynomials over Z in the names of the map.
        splits: whether the polynomials are also split into factors that are Darboux polynomials.
    """
    common_factors, D = list[fmpq_mpoly](), data.determinant
    max_degree = max(degree_in(P, data.dim) for P in polynomials)
    products = []
    for P in polynomials:
        factorization = _factor_with_cofactors(data, P, max_degree, splits=True) if splits else None
        factorization = factorization or _factor_with_cofactors(data, P, max_degree, splits=False)
        if factorization is None:
            return None
        content, factors = factorization
        cofactors = []  # each cofactor C, with D^k f(N/D) = C f, as a monomial in D and the common factors so far
        for _, k, _, C in factors:
            power, cofactor = 0, C
            if D.is_constant():  # D is a number: count how often it divides C, up to k times, as in D^k
                number, divisor = abs(int(D.coeffs()[0].p)), gcd(*(int(c.p) for c in C.coeffs()))
                while divisor % number == 0 and power < k:
                    power, divisor, cofactor = power + 1, divisor // number, cofactor / D
            elif gcd(*(int(c.p) for c in D.coeffs())) == 1:  # D is primitive, so that the quotients are over Z
                while (smaller_cofactor := quotient(cofactor, D)) is not None:
                    power, cofactor = power + 1, smaller_cofactor
            is_factored = len(cofactor) <= _MAX_FACTORED_TERMS
            constant, irreducible_factors = cofactor.factor() if is_factored else (fmpq(1), [(cofactor, 1)])
            powers = {}
            for c, exponent in irreducible_factors:
                if c not in common_factors:
                    common_factors.append(c)
                powers[common_factors.index(c)] = int(exponent)
            cofactors.append((int(constant), power, powers))
        products.append((content, factors, cofactors))
    indices = range(len(common_factors))
    return DarbouxProducts(
        tuple(
            DarbouxProduct(
                content,
                tuple(
                    DarbouxFactor(f, k, exponent, Monomial(constant, (power, *(powers.get(j, 0) for j in indices))))
                    for (f, k, exponent, _), (constant, power, powers) in zip(factors, cofactors, strict=True)
                ),
            )
            for content, factors, cofactors in products
        ),
        tuple(common_factors),
    )


def _factor_with_cofactors(
    data: MapData, P: fmpq_mpoly, max_degree: int, splits: bool
) -> tuple[fmpq_mpoly, list[tuple[fmpq_mpoly, int, int, fmpq_mpoly]]] | None:
    """Return (c, [(f, k, e, C), ...]): P = c times the product of f^e, D^k f(N/D) = C f; None if some f has no C.

    If `splits` is False, P is the only f. If f has a factor of D, f may divide D^k f(N/D) only for some k larger
    than deg f. Such k are tried up to `max_degree`, the degree of P and Q for an integral P/Q, and n + 1 more if dx/phi
    with phi = P/Q is invariant.
    """
    n, D = data.dim, data.determinant
    content, factors = P**0, [(P, 1)]
    if splits:  # factors without the variables belong to the content
        constant, irreducible_factors = P.factor()
        content = prod((f ** int(e) for f, e in irreducible_factors if degree_in(f, n) <= 0), start=P**0 * constant)
        factors = [(f, int(e)) for f, e in irreducible_factors if degree_in(f, n) > 0]
    result = []
    for f, exponent in factors:
        k = degree_in(f, n)
        value = homogeneous_value(f, k, data)
        cofactor = quotient(value, f)
        if cofactor is None and degree_in(f.gcd(D), n) > 0:
            while cofactor is None and k < max_degree + n + 1:
                value, k = times(value, D), k + 1
                cofactor = quotient(value, f)
        if not cofactor:  # the cofactor 0: the image of the map lies in f = 0
            return None
        result.append((f, k, exponent, cofactor))
    return content, result
