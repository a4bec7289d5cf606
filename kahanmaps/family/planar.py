"""The normal form of a member: one planar cubic over the algebra K = Q[t]/chi, for every chi without repeated roots.

Q^{2m} is a free K-module of rank 2 with t acting as A^T; f'(x) is K-linear. For a basis e1, e2 let S have the columns
e1, A^T e1, ..., (A^T)^{m-1} e1, e2, A^T e2, ...; then x = S z, where z contains the coefficients of two elements X, Y
of K. Let l(a) be the coefficient of t^(m-1) in a. Since A^T is self-adjoint for J, x^T J y = l(W(x, y)) for one
K-bilinear alternating W; e1 and e2 are chosen with W(e1, e2) = 1. Likewise, H(x) = l(h(X, Y)) for one binary cubic
h = a X^3 + b X^2 Y + c X Y^2 + d Y^3 over K. The system x' = J grad H(x) becomes X' = dh/dY, Y' = -dh/dX, and its Kahan
map is, with the Hessian determinant D = h_XX h_YY - h_XY^2,

    X~ = (X + 2 eps dh/dY) / (1 + eps^2 D(X, Y)),     Y~ = (Y - 2 eps dh/dX) / (1 + eps^2 D(X, Y)).

At a rational root r of chi, X, Y and h have the values u, v and h_r, and u' = dh_r/dv, v' = -dh_r/du is a separate
planar system over Q. If chi splits, there are m such systems, and H is the sum of h_r(u, v)/chi'(r), since l(a) is the
sum of a(r)/chi'(r) (Euler, Jacobi). Elements of K are stored as polynomials of degree < m.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly, fmpq_poly, fmpz, fmpz_mat

from kahanmaps.algebra.fields import rational
from kahanmaps.algebra.matrices import combination_of, primitive_integers
from kahanmaps.algebra.parsing import wrong_kind
from kahanmaps.algebra.polynomials import names_of, ring
from kahanmaps.algebra.printing import format_number, format_polynomial
from kahanmaps.display_protocols import HtmlDisplay, ResultPart
from kahanmaps.errors import HypothesisError, InputError, SingularStep
from kahanmaps.family.associated import FamilyMember
from kahanmaps.family.cubics import third_derivatives
from kahanmaps.family.skew_hamiltonian import bits_of, companion_matrix, format_univariate, two_blocks
from kahanmaps.family.skew_hamiltonian import chi as chi_of
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure

_CUBIC_MONOMIALS = ("X^3", "X^2*Y", "X*Y^2", "Y^3")
_QUADRATIC_MONOMIALS = ("X^2", "X*Y", "Y^2")

Quadruple = tuple[fmpq_poly, fmpq_poly, fmpq_poly, fmpq_poly]


@dataclass(frozen=True, eq=False)
class PlanarPart:
    """The planar system at a rational root of chi: u' = dh/dv, v' = -dh/du, with u = X(root) and v = Y(root).

    `h` is the value of the cubic h over K at t = root, in the variables u, v; its `weight` in H is 1/chi'(root).
    """

    root: fmpq
    weight: fmpq
    h: fmpq_mpoly

    @property
    def hamiltonian(self) -> CubicHamiltonian:
        """The cubic h with the standard structure of the plane."""
        return CubicHamiltonian(self.h, standard_structure(2))

    @property
    def text(self) -> str:
        """The cubic h as text."""
        return format_polynomial(self.h)

    @property
    def D(self) -> fmpq_mpoly:
        """h_uu h_vv - h_uv^2; the Kahan map of this planar system conserves h/(1 + eps^2 D)."""
        derivative = self.h.derivative
        h_uv = derivative(0).derivative(1)
        return derivative(0).derivative(0) * derivative(1).derivative(1) - h_uv * h_uv

    @property
    def D_text(self) -> str:
        """D as text."""
        return format_polynomial(self.D)


@dataclass(frozen=True, eq=False)
class NormalForm(HtmlDisplay, ResultPart):
    """The normal form of x' = J grad H(x): a planar system over K = Q[t]/chi with x = S z and H(x) = l(h(X, Y)).

    It is constructed by `normal_form`, and verified exactly at construction.

    >>> from kahanmaps.algebra.parsing import parse_polynomial
    >>> A = fmpq_mat(4, 4, [0, 1, 0, 0,  2, 0, 0, 0,  0, 0, 0, 2,  0, 0, 1, 0])
    >>> H = parse_polynomial("x1^3 + 6*x1*x2^2", ["x1", "x2", "x3", "x4"])
    >>> form = normal_form(FamilyMember(A, H))
    >>> form.chi_text, form.h_text, form.D_text
    ('t^2 - 2', 't*X^3', '0')
    >>> X, Y = form.coordinates([1, 0, "1/2", 0])
    >>> form.point(*form.step(X, Y, "1/10"))
    (1, 0, -1/10, 0)
    """

    A: fmpq_mat
    H: fmpq_mpoly
    S: fmpq_mat
    coefficients: Quadruple

    def __post_init__(self) -> None:
        self.verify()

    @property
    def text(self) -> str:
        """The polynomial chi and the cubic h, as text."""
        return f"chi = {self.chi_text}, h = {self.h_text}"

    @property
    def dim(self) -> int:
        """The dimension 2m."""
        return int(self.A.nrows())

    @property
    def m(self) -> int:
        """Half the dimension, the degree of chi."""
        return self.dim // 2

    @cached_property
    def chi(self) -> fmpq_poly:
        """The monic polynomial chi of degree m with det(t - A) = chi(t)^2."""
        return chi_of(self.A)

    @cached_property
    def S_inverse(self) -> fmpq_mat:
        """S^{-1}, so that z = S^{-1} x."""
        return self.S.inv()

    @cached_property
    def D_coefficients(self) -> tuple[fmpq_poly, fmpq_poly, fmpq_poly]:
        """The elements p, q, r of K with D = p X^2 + q X Y + r Y^2."""
        a, b, c, d = self.coefficients
        p, q, r = self._reduce(12 * a * c - 4 * b * b, 36 * a * d - 4 * b * c, 12 * b * d - 4 * c * c)
        return p, q, r

    def coordinates(self, x: Sequence[Any]) -> tuple[fmpq_poly, fmpq_poly]:
        """Return the elements X and Y of K that belong to a rational point x."""
        if isinstance(x, str) or len(x) != self.dim:
            raise InputError(f"found {x!r}, expected a sequence of {self.dim} numbers")
        z = (self.S_inverse * fmpq_mat(self.dim, 1, [rational(entry) for entry in x])).entries()
        return fmpq_poly(z[: self.m]), fmpq_poly(z[self.m :])

    def point(self, X: Any, Y: Any) -> tuple[fmpq, ...]:
        """Return the rational point x for X and Y in K (polynomials in t, or numbers)."""
        X, Y = self._as_elements(X, Y)
        z = [element[k] for element in (X, Y) for k in range(self.m)]
        return tuple((self.S * fmpq_mat(self.dim, 1, z)).entries())

    def h(self, X: Any, Y: Any) -> fmpq_poly:
        """Return h(X, Y), an element of K."""
        X, Y = self._as_elements(X, Y)
        a, b, c, d = self.coefficients
        XX, XY, YY = self._reduce(X * X, X * Y, Y * Y)
        return self._reduce((a * X + b * Y) % self.chi * XX + (c * XY + d * YY) % self.chi * Y)[0]

    def D(self, X: Any, Y: Any) -> fmpq_poly:
        """Return the determinant of the planar f' at (X, Y), i.e. the Hessian determinant of h, an element of K."""
        X, Y = self._as_elements(X, Y)
        p, q, r = self.D_coefficients
        XX, XY, YY = self._reduce(X * X, X * Y, Y * Y)
        return self._reduce(p * XX + q * XY + r * YY)[0]

    def vector_field(self, X: Any, Y: Any) -> tuple[fmpq_poly, fmpq_poly]:
        """Return dh/dY and -dh/dX at (X, Y)."""
        X, Y = self._as_elements(X, Y)
        a, b, c, d = self.coefficients
        XX, XY, YY = self._reduce(X * X, X * Y, Y * Y)
        dX, dY = self._reduce(b * XX + 2 * c * XY + 3 * d * YY, -(3 * a * XX + 2 * b * XY + c * YY))
        return dX, dY

    def step(self, X: Any, Y: Any, eps: Any) -> tuple[fmpq_poly, fmpq_poly]:
        """Return the image of (X, Y) under the Kahan map. Raises SingularStep if 1 + eps^2 D is not a unit of K."""
        X, Y = self._as_elements(X, Y)
        epsilon = rational(eps)
        denominator = 1 + epsilon * epsilon * self.D(X, Y)
        common_factor, inverse, _ = denominator.xgcd(self.chi)
        if not common_factor.is_one():
            raise SingularStep(
                f"1 + eps^2 D and chi have the factor {format_univariate(common_factor)} in common at this point for "
                f"eps = {format_number(epsilon)}: the Kahan map is not defined there",
                (X, Y),
                epsilon,
            )
        F, G = self.vector_field(X, Y)
        image_X, image_Y = self._reduce((X + 2 * epsilon * F) * inverse, (Y + 2 * epsilon * G) * inverse)
        return image_X, image_Y

    @cached_property
    def parts(self) -> tuple[PlanarPart, ...]:
        """The planar systems at the rational roots of chi, by increasing root; there are m of them if chi splits."""
        u, v = ring(["u", "v"]).gens()
        chi_prime = self.chi.derivative()
        parts = []
        for root in sorted(-factor[0] / factor[1] for factor, _ in self.chi.factor()[1] if factor.degree() == 1):
            a, b, c, d = (coefficient(root) for coefficient in self.coefficients)
            parts.append(PlanarPart(root, 1 / chi_prime(root), a * u**3 + b * u**2 * v + c * u * v**2 + d * v**3))
        return tuple(parts)

    @property
    def chi_text(self) -> str:
        """The polynomial chi as text, such as `t^2 - 2`."""
        return format_univariate(self.chi)

    @property
    def h_text(self) -> str:
        """The cubic h as text, such as `X^3 + (t - 1)*X*Y^2`."""
        return _format_form(self.coefficients, _CUBIC_MONOMIALS)

    @property
    def D_text(self) -> str:
        """D as text, a quadratic form in X and Y over K."""
        return _format_form(self.D_coefficients, _QUADRATIC_MONOMIALS)

    def verify(self) -> None:
        """Verify the normal form exactly. Raises AssertionError if it is wrong, which means an error in kahanmaps.

        The conditions are: A^T S = S diag(C, C) for the companion matrix C of chi; S^T J S is the matrix of l(W) in the
        coordinates z, an invertible matrix; and H(S z) = l(h) as symmetric trilinear forms.
        """
        n, m = self.dim, self.m
        if (self.S.nrows(), self.S.ncols(), len(names_of(self.H))) != (n, n, n):
            raise AssertionError("normal form: the sizes of A, H and S differ")
        if any(coefficient.degree() >= m for coefficient in self.coefficients):
            raise AssertionError("normal form: a coefficient of h is not reduced modulo chi")
        # Multiplication by t in the basis 1, t, ..., t^(m-1), for both X and Y.
        companion = companion_matrix(self.chi)
        times_t = two_blocks(companion, companion)
        if self.A.transpose() * self.S != self.S * times_t:
            raise AssertionError("normal form: t does not act as A^T")
        functional_values = self._functional_of_powers(fmpq_poly([1]), 2 * m - 1)
        gram = [[((i < m) - (j < m)) * functional_values[i % m + j % m] for j in range(n)] for i in range(n)]
        if self.S.transpose() * standard_structure(n) * self.S != fmpq_mat(gram):
            raise AssertionError("normal form: S^T J S is not the Gram matrix of l")
        a, b, c, d = self.coefficients
        expected_values = [self._functional_of_powers(element, 3 * m - 2) for element in (6 * a, 2 * b, 2 * c, 6 * d)]
        # The trilinear form of H in the coordinates z: one matrix for each column of S.
        S_transposed, tensors = self.S.transpose(), third_derivatives(self.H)
        for i, column in enumerate(S_transposed.tolist()):
            bilinear_form = S_transposed * combination_of(column, tensors) * self.S
            expected_form = [
                expected_values[(i >= m) + (j >= m) + (k >= m)][i % m + j % m + k % m]
                for j in range(n)
                for k in range(n)
            ]
            if bilinear_form != fmpq_mat(n, n, expected_form):
                raise AssertionError("normal form: H(S z) is not l(h)")

    def _functional_of_powers(self, element: fmpq_poly, count: int) -> list[fmpq]:
        """Return l(a t^k) for a = `element` and 0 <= k < count; l is the coefficient of t^(m-1)."""
        t, values = fmpq_poly([0, 1]), []
        for _ in range(count):
            values.append(element[self.m - 1])
            element = element * t % self.chi
        return values

    def _as_elements(self, *values: Any) -> tuple[fmpq_poly, ...]:
        return self._reduce(*(v if isinstance(v, fmpq_poly) else fmpq_poly([rational(v)]) for v in values))

    def _reduce(self, *polynomials: fmpq_poly) -> tuple[fmpq_poly, ...]:
        return tuple(polynomial % self.chi for polynomial in polynomials)


def normal_form(member: FamilyMember) -> NormalForm:
    """Return the normal form of the associated system given by the signs of the member.

    The result's `H` is the cubic of this system. The vector e1 is a unit vector or a small combination of unit vectors,
    and e2 is a short vector with W(e1, e2) = 1, found by LLL. At most 2m vectors e1 are tried; the normal form with the
    shortest numbers is returned. Exact. Raises HypothesisError if chi has repeated roots.
    """
    if not isinstance(member, FamilyMember):
        raise wrong_kind(member, "a member of the family", "km.load(...).member is one, of a file of kind [family]")
    if not member.is_generic:
        repeated_text = ", ".join(f"({factor})" for factor in member.factors if factor.multiplicity > 1)
        raise HypothesisError(
            f"chi has the repeated factor {repeated_text}, expected a member whose chi has no repeated roots: "
            "the normal form over K = Q[t]/chi is for generic A"
        )
    H = member.H if all(sign > 0 for sign in member.signs) else member.chosen.K
    n, m, chi, tensors = member.dim, member.m, chi_of(member.A), third_derivatives(H)
    # The basis dual to 1, t, ..., t^(m-1) under the form (a, b) -> l(a b).
    dual_basis = [fmpq_poly([chi[j] for j in range(k + 1, m + 1)]) for k in range(m)]
    candidates: list[tuple[int, fmpq_mat, Quadruple]] = []
    for e1 in _cyclic_vectors(member.A.transpose()):
        S = _symplectic_basis(member.A.transpose(), e1)
        columns = S.transpose().tolist()
        krylov_rows = [fmpq_mat(columns[:m]), fmpq_mat(columns[m:])]
        vectors = [fmpq_mat(n, 1, columns[0]), fmpq_mat(n, 1, columns[m])]
        hessians = [combination_of(columns[0], tensors), combination_of(columns[m], tensors)]
        elements = []
        # The coefficients of h follow from l(t^k 6a) = H'''(t^k e1, e1, e1), l(t^k 2b) = H'''(t^k e1, e1, e2), ...
        for divisor, i, j, k in ((6, 0, 0, 0), (2, 0, 0, 1), (2, 0, 1, 1), (6, 1, 1, 1)):
            values = (krylov_rows[i] * (hessians[j] * vectors[k])).entries()
            products = (value * element for value, element in zip(values, dual_basis, strict=True))
            elements.append(sum(products, fmpq_poly([0])) / divisor)
        a, b, c, d = elements
        coefficients = (a, b, c, d)
        bits = sum(map(bits_of, S.entries())) + sum(bits_of(entry) for c in coefficients for entry in c.coeffs())
        candidates.append((bits, S, coefficients))
    _, S, coefficients = min(candidates, key=lambda candidate: candidate[0])
    return NormalForm(member.A, H, S, coefficients)


def _cyclic_vectors(t: fmpq_mat) -> Iterator[fmpq_mat]:
    """Yield, for each unit vector, its sum with small multiples of a few others that generates a free K-module.

    For all but at most m numbers c, v + c w generates a module of the largest dimension that v and w allow: K acts as a
    field on the kernel of p(A^T) for each irreducible factor p of chi, where at most one c fails.
    """
    n = t.nrows()
    m = n // 2
    multiples = [(k + 2) // 2 * (-1) ** k for k in range(m + 1)]
    for i in range(n):
        v, rank = _unit_vector(n, i), _krylov_matrix(t, _unit_vector(n, i)).rank()
        for j in range(i + 1, i + n):
            if rank == m:
                break
            candidates = [v + c * _unit_vector(n, j % n) for c in multiples]
            ranks = [_krylov_matrix(t, w).rank() for w in candidates]
            if max(ranks) > rank:
                rank = max(ranks)
                v = candidates[ranks.index(rank)]
        yield v


def _symplectic_basis(t: fmpq_mat, e1: fmpq_mat) -> fmpq_mat:
    """Return S for this e1 and an e2 with W(e1, e2) = 1, that is (t^k e1)^T J e2 = l(t^k) for k < m.

    The integer vectors (y, s) with (t^k e1)^T J y = s l(t^k) form a lattice of rank m + 1; those with s = 0 form a
    lattice of rank m. By the bounds of LLL, the weights of s and of the equations are so large that the first m vectors
    of a reduced basis have s = 0 and the next vector has the least s > 0, up to sign; then e2 = y/s.
    """
    n = t.nrows()
    m = n // 2
    powers = _krylov_matrix(t, e1)
    equations = [
        primitive_integers((*row, fmpq(-(k == m - 1))))
        for k, row in enumerate((powers.transpose() * standard_structure(n)).tolist())
    ]
    bound = sum(max(abs(entry) for entry in row).bit_length() + n.bit_length() for row in equations) + n + 1
    weight, constraint_weight = fmpz(1) << bound, fmpz(1) << 2 * bound
    generators = [
        [int(i == j) for i in range(n)] + [weight * (j == n)] + [constraint_weight * row[j] for row in equations]
        for j in range(n + 1)
    ]
    reduced_basis = fmpz_mat(generators).lll()
    s = reduced_basis[m, n] // weight
    e2 = fmpq_mat(n, 1, [fmpq(reduced_basis[m, i], s) for i in range(n)])
    columns = zip(powers.tolist(), _krylov_matrix(t, e2).tolist(), strict=True)
    return fmpq_mat([[*left, *right] for left, right in columns])


def _krylov_matrix(t: fmpq_mat, vector: fmpq_mat) -> fmpq_mat:
    """Return the matrix with the columns v, t v, ..., t^{m-1} v for v = `vector`."""
    columns = [vector]
    for _ in range(t.nrows() // 2 - 1):
        columns.append(t * columns[-1])
    return fmpq_mat([column.entries() for column in columns]).transpose()


def _unit_vector(n: int, i: int) -> fmpq_mat:
    return fmpq_mat(n, 1, [int(i == j) for j in range(n)])


def _format_form(coefficients: Sequence[fmpq_poly], monomials: Sequence[str]) -> str:
    """Format a form over K as text."""
    text = ""
    for coefficient, monomial in zip(coefficients, monomials, strict=True):
        if coefficient.is_zero():
            continue
        # A coefficient with one term, or with negative terms only, is printed with its sign before the brackets.
        terms = [c for c in coefficient.coeffs() if c != 0]
        is_negative = all(c < 0 for c in terms)
        element = format_univariate(-coefficient if is_negative else coefficient)
        factor_text = "" if element == "1" else (f"({element})" if len(terms) > 1 else element) + "*"
        sign = "-" if is_negative else "+"
        text += f" {sign} {factor_text}{monomial}" if text else f"{'-' if is_negative else ''}{factor_text}{monomial}"
    return text or "0"
