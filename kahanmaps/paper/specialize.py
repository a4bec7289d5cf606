"""Constructors of the paper's objects over several fields, for a given member and for the generic member.

* `MemberObjects`: a member at a point, over QQ or GF(p). If the library has its own code for an object (the chain, the
  associated systems, the integrals, Pi), the claims test this code.
* `normal_form_objects`: the normal form with indeterminate roots, coefficients, x and eps. Over the splitting field of
  chi every member with distinct roots is symplectically similar to a specialization of it (docs/mathematics.md).
* `random_objects`: random data over GF(p), transformed by a random symplectic matrix.
* `etale_objects`: a member's own normal form, one planar system over Q[t]/chi.
* `bound_objects`, `universal_bound_objects`: bounds for degrees and coefficients instead of numbers.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Sequence
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_poly, nmod_poly

from kahanmaps.algebra.bounds import BoundField
from kahanmaps.algebra.chance import random_prime_field
from kahanmaps.algebra.etale import EtaleAlgebra
from kahanmaps.algebra.fields import CC, QQ, Field, PrimeField
from kahanmaps.algebra.functions import FunctionField
from kahanmaps.algebra.polynomials import evaluate
from kahanmaps.family.associated import AssociatedSystem, FamilyMember
from kahanmaps.family.cubics import third_derivatives
from kahanmaps.family.planar import normal_form
from kahanmaps.family.skew_hamiltonian import chi as chi_of
from kahanmaps.invariants.integrals_and_densities import ModifiedHamiltonian, PaperIntegral
from kahanmaps.invariants.poisson import poisson_tensor
from kahanmaps.paper.objects import PaperObjects
from kahanmaps.systems.quadratic import SystemOver

Draw = Callable[[str], Any]

_SHEAR_COUNT = 5  # symmetric shears, alternately upper and lower: products of 5 give every symplectic matrix
# If there are more sign vectors than this, a sample is tested: those with one sign -1, and random ones.
MAX_SIGN_VECTORS = 32


class MemberObjects(PaperObjects):
    """A given member at a point: values for which the library has code of its own are computed by this code.

    Over dual numbers (for derivatives) and in variations, values are computed as in `PaperObjects`.
    """

    member: FamilyMember

    @classmethod
    def at(cls, member: FamilyMember, K: Field, roots: tuple[Any, ...] | None, **options: Any) -> MemberObjects:
        """Return the objects of a member over K; `roots` are the roots of chi, None if they are not in K."""
        base, chi = member.hamiltonians[0].system.over(K), chi_of(member.A)
        known_chi = tuple(K.convert(chi[k]) for k in range(member.m + 1))
        objects = cls(**_member_data(member, K), roots=roots, base=base, known_chi=known_chi, **options)
        objects.member = member
        return objects

    def H(self, x: Any, i: int = 0) -> Any:
        """H_i(x) from the library's chain."""
        return evaluate(self.member.chain[i], self.K, x.entries())

    def gradient_of_chain(self, i: int, x: Any) -> Any:
        """The gradient of H_i, from the library."""
        gradient = self.member.hamiltonians[i].gradient
        return self.K.column([evaluate(component, self.K, x.entries()) for component in gradient])

    def f_i(self, i: int) -> SystemOver:
        """f_i from the library's chain."""
        return self.member.hamiltonians[i].system.over(self.K)

    def lagrange(self, i: int) -> list[Any]:
        """Return the coefficients of B_i, from the library if the roots of chi are rational."""
        if self._is_split:
            signs = tuple(-1 if j == i else 1 for j in self.each)
            return [self.K.convert(c) for c in self._associate(signs).coefficients]
        return super().lagrange(i)

    def B_signs(self, signs: Sequence[int]) -> Any:
        """Return B_s, from the library if the roots of chi are rational."""
        if self._is_split:
            return self.K.convert_matrix(self._associate(tuple(signs)).B)
        return super().B_signs(signs)

    def _associate(self, signs: tuple[int, ...]) -> AssociatedSystem:
        if ("associate", signs) not in self._cache:
            self._cache["associate", signs] = self.member.associate(signs)
        system: AssociatedSystem = self._cache["associate", signs]
        return system

    def H_tilde(self, x: Any) -> Any:
        """H~ from the library."""
        return PaperIntegral(self.member.hamiltonians[0]).value(self.K, self.eps, x.entries())

    def modified_H(self, x: Any) -> Any:
        """The modified H from the library."""
        return ModifiedHamiltonian(self.member.hamiltonians[0]).value(self.K, self.eps, x.entries())

    def Pi(self, x: Any) -> Any:
        """The Poisson tensor from the library."""
        return poisson_tensor(self.member.hamiltonians[0], self.K, self.eps, x.entries())

    @property
    def _is_split(self) -> bool:
        return self.roots is not None and rational_roots(self.member) is not None


def rational_roots(member: FamilyMember) -> tuple[fmpq, ...] | None:
    """Return the roots of chi in the order of the signs; None unless they are rational and distinct."""
    roots = [factor.root for factor in member.factors if factor.root is not None and factor.multiplicity == 1]
    return tuple(roots) if len(roots) == len(member.factors) else None


def sign_sample(m: int, rng: random.Random) -> tuple[tuple[int, ...], ...] | None:
    """Return all sign vectors with one sign -1, and some random ones; None, for all vectors, if there are few."""
    if 2 ** (m - 1) <= MAX_SIGN_VECTORS:
        return None
    single_flips = [tuple(-1 if j == i else 1 for j in range(m)) for i in range(m)]
    random_signs = [(1, *(rng.choice((1, -1)) for _ in range(m - 1))) for _ in range(4)]
    return tuple(dict.fromkeys(signs for signs in [*single_flips, *random_signs] if -1 in signs))


# ---- points over GF(p) and Q -----------------------------------------------------------------------------------


def random_draw(K: Field, n: int, rng: random.Random) -> Draw:
    """Return a function that returns a random vector of K^n for each name."""
    return lambda name: K.column([K.random(rng) for _ in range(n)])


def split_prime_field(chi: fmpq_poly, rng: random.Random, tries: int) -> tuple[PrimeField, tuple[Any, ...]] | None:
    """Return a random prime field of 63 bits in which chi has m distinct roots, with the roots, or None.

    The prime is uniform among the primes modulo which chi has m distinct roots; None after `tries` other primes.
    """
    m = chi.degree()
    for _ in range(tries):
        field = random_prime_field(rng)
        p = field.prime
        coefficients = [field.convert(chi[k]) for k in range(m + 1)]
        polynomial = nmod_poly([int(c) for c in coefficients], p)
        x = nmod_poly([0, 1], p)
        if m > 1 and pow(x, p, polynomial) != x:
            continue
        _, factors = polynomial.factor()
        roots = sorted(int(-factor[0] / factor[1]) for factor, _ in factors)
        if len(roots) == m:
            return field, tuple(field.convert(root) for root in roots)
    return None


def point_over(
    member: FamilyMember, K: Field, roots: tuple[Any, ...] | None, eps: fmpq | None, rng: random.Random, order: int
) -> MemberObjects:
    """Return the objects of a member at a random point over QQ or GF(p); `eps` None means a random eps."""
    eps_in_K = K.zero if eps is None else K.convert(eps)
    eps_in_K = _random_nonzero(K, rng) if eps_in_K == 0 else eps_in_K
    signs, draw = sign_sample(member.m, rng), random_draw(K, member.dim, rng)
    return MemberObjects.at(member, K, roots, eps=eps_in_K, draw=draw, sign_vectors=signs, order=order)


def random_objects(m: int, K: Field, rng: random.Random, order: int) -> PaperObjects:
    """Return random A, H, x and eps over GF(p): a random normal form, transformed by a random symplectic matrix S.

    S is a product of five symmetric shears, alternately upper and lower.
    """
    n = 2 * m
    roots = tuple(K.random(rng) for _ in range(m))
    cubics = [[K.random(rng) for _ in range(4)] for _ in range(m)]
    S, S_inverse = K.identity(n), K.identity(n)
    for k in range(_SHEAR_COUNT):
        entries = {}
        for i in range(m):
            for j in range(i, m):
                entries[i, j] = entries[j, i] = K.random(rng)
        shear, inverse_shear = ([K.one if i == j else K.zero for i in range(n) for j in range(n)] for _ in range(2))
        for (i, j), value in entries.items():
            position = i * n + m + j if k % 2 == 0 else (m + i) * n + j
            shear[position], inverse_shear[position] = value, -value
        S, S_inverse = S * K.matrix(n, n, shear), K.matrix(n, n, inverse_shear) * S_inverse
    A, d3H = _normal_form(K, roots, cubics)
    # x = S z: A becomes S^{-T} A S^T, and S^{-1} acts on each of the three indices of the third derivatives. The loop
    # applies it three times to the last index, which then becomes the first.
    for _ in range(3):
        d3H = K.matrix(n * n, n, (d3H * S_inverse).transpose().entries())
    eps = _random_nonzero(K, rng)
    signs = sign_sample(m, rng)
    A = S_inverse.transpose() * A * S.transpose()
    return PaperObjects(
        K=K, A=A, d3H=d3H, eps=eps, roots=roots, draw=random_draw(K, n, rng), sign_vectors=signs, order=order
    )


# ---- proofs: indeterminate data --------------------------------------------------------------------------------


def normal_form_objects(m: int, vectors: Sequence[str], budget: int, order: int) -> PaperObjects:
    """Return the normal form with indeterminate roots, planar cubics, eps, and vectors with the names `vectors`.

    In each block, a linear change of coordinates of determinant 1 moves the point to (u, v) = (1, 0) and makes the
    coefficient of u^2 v in the cubic h vanish, so that h = a u^3 + c u v^2 + d v^3. For m = 1 both signs count as
    associated, since the system stands for one block of a larger system.
    """
    n = 2 * m
    lower_letters = ["p", "q", "r", "s", "t"] if "linear" in vectors else []
    block_symbols = [f"{c}{i + 1}" for i in range(m) for c in ["a", "c", "d", *lower_letters]]
    generic_vectors = [vector for vector in vectors if vector not in ("x", "linear", "u1", "u2", "u3")]
    symbols = _symbol_names(generic_vectors, n)
    names = [
        *(f"l{i + 1}" for i in range(m)),
        *block_symbols,
        "eps",
        *(name for symbol_names in symbols.values() for name in symbol_names),
    ]
    K = FunctionField(names, budget, reduces=True)
    by_name = dict(zip(names, K.variables, strict=True))
    roots = tuple(by_name[f"l{i + 1}"] for i in range(m))
    cubics = [[by_name[f"a{i + 1}"], K.zero, by_name[f"c{i + 1}"], by_name[f"d{i + 1}"]] for i in range(m)]
    A, d3H = _normal_form(K, roots, cubics)

    def draw(name: str) -> Any:
        if name == "x":
            return K.column([K.one] * m + [K.zero] * m)
        return K.column([by_name[symbol] for symbol in symbols[name]])

    # Permutations of the blocks permute the signs: sign vectors with -1 on the first blocks represent all sign vectors.
    signs = tuple(tuple(-1 if j <= i else 1 for j in range(m)) for i in range(max(1, m - 1)))
    objects = PaperObjects(
        K=K,
        A=A,
        d3H=d3H,
        eps=by_name["eps"],
        roots=roots,
        draw=draw,
        sign_vectors=((1,), (-1,)) if m == 1 else signs,
        indices_to_test=(0,),
        order=order,
    )
    if lower_letters:
        p, q, r, s, t = ([by_name[f"{c}{i + 1}"] for i in range(m)] for c in lower_letters)
        entries = {(i, i): p[i] for i in range(m)} | {(m + i, m + i): r[i] for i in range(m)}
        entries |= {position: q[i] for i in range(m) for position in ((i, m + i), (m + i, i))}
        X = K.matrix(n, n, [entries.get((i, j), K.zero) for i in range(n) for j in range(n)])
        objects.lower_terms = (X, K.column([*s, *t]))
    return objects


def member_functions(
    member: FamilyMember, vectors: Sequence[str], eps: fmpq | None, budget: int, order: int
) -> MemberObjects:
    """Return the objects of a member over rational functions: x is indeterminate, and so is eps if `eps` is None."""
    n = member.dim
    symbols = _symbol_names(vectors, n)
    names = ["eps", *(name for symbol_names in symbols.values() for name in symbol_names)]
    K = FunctionField(names, budget)
    by_name = dict(zip(names, K.variables, strict=True))

    def draw(name: str) -> Any:
        return K.column([by_name[symbol] for symbol in symbols[name]])

    roots = rational_roots(member)
    K_roots = None if roots is None else tuple(K.convert(root) for root in roots)
    eps_in_K = by_name["eps"] if eps is None else K.convert(eps)
    signs = sign_sample(member.m, random.Random("signs"))
    return MemberObjects.at(member, K, K_roots, eps=eps_in_K, draw=draw, sign_vectors=signs, order=order)


def etale_objects(member: FamilyMember, rng: random.Random, eps: fmpq | None, order: int) -> PaperObjects:
    """Return a member's normal form, one planar system over Q[t]/chi for all roots of chi, at a random exact point."""
    planar_form = normal_form(member)
    K = EtaleAlgebra(planar_form.chi)
    root = K.generator
    A, d3H = _normal_form(K, (root,), [[K.convert(c) for c in planar_form.coefficients]])
    eps_in_K = K.convert(eps if eps is not None else fmpq(1, rng.randint(2, 9)))
    signs = ((1,), (-1,))
    return PaperObjects(
        K=K, A=A, d3H=d3H, eps=eps_in_K, roots=(root,), draw=random_draw(K, 2, rng), sign_vectors=signs, order=order
    )


def complex_roots(member: FamilyMember, bits: int) -> tuple[Any, ...]:
    """Return complex balls of `bits` bits that enclose the roots of chi."""
    K = CC(bits)
    chi = chi_of(member.A)
    with K.working():
        enclosures: Any = chi.numer().complex_roots()
        return tuple(K.convert(root) for root, _ in enclosures)


def ball_objects(member: FamilyMember, bits: int, rng: random.Random, eps: fmpq | None, order: int) -> PaperObjects:
    """Return the objects of a member at a random rational point over complex balls that enclose all roots of chi."""
    K = CC(bits)
    roots = complex_roots(member, bits)
    with K.working():
        eps_in_K = K.convert(eps if eps is not None else fmpq(1, rng.randint(2, 9)))
        return PaperObjects(
            **_member_data(member, K),
            eps=eps_in_K,
            roots=roots,
            draw=lambda name: K.column([K.convert(QQ.random(rng)) for _ in range(member.dim)]),
            sign_vectors=sign_sample(member.m, rng),
            order=order,
        )


# ---- bounds ----------------------------------------------------------------------------------------------------


def bound_objects(member: FamilyMember, eps: fmpq | None, order: int) -> PaperObjects:
    """Return objects of degree bounds for a member: x and all vectors are variables, and so is eps if `eps` is None."""
    K = BoundField()
    n = member.dim
    chi = chi_of(member.A)
    if rational_roots(member) is None:
        # If d is the common denominator of chi, d times a root is an algebraic integer. Cauchy's bound holds for all
        # conjugates.
        denominator = chi.denom()
        root_bound = denominator * (2 + max(abs(chi[k]) for k in range(member.m)))
        root = K.polynomial(0, float(root_bound.p.bit_length())) / K.convert(denominator)
    else:
        root = K.matrix(1, member.m, [K.convert(abs(r)) for r in rational_roots(member) or ()])[0, 0]
    eps_in_K = K.variable() if eps is None else K.convert(eps)
    return PaperObjects(
        **_member_data(member, K),
        eps=eps_in_K,
        roots=(root,) * member.m,
        draw=lambda name: K.matrix(n, 1, [K.variable()] * n),
        known_chi=tuple(K.convert(abs(chi[k])) for k in range(member.m + 1)),
        sign_vectors=_two_sign_vectors(member.m),
        order=order,
    )


def universal_bound_objects(m: int, order: int) -> PaperObjects:
    """Return objects of degree bounds for `random_objects`: roots, cubics, shears, x and eps are variables."""
    K = BoundField()
    n = 2 * m
    # The shears have entries of degree 1, so entries of S and S^{-1} are sums of m^4 monomials of degree 5.
    S = K.polynomial(_SHEAR_COUNT, (_SHEAR_COUNT - 1) * math.log2(m) + _SHEAR_COUNT)
    root, coefficient = K.variable(), K.variable()
    A = K.matrix(n, n, [S * S * root * K.convert(n * n)] * (n * n))
    d3H = K.matrix(n * n, n, [S * S * S * coefficient * K.convert(6 * n**3)] * n**3)
    return PaperObjects(
        K=K,
        A=A,
        d3H=d3H,
        eps=K.variable(),
        roots=(root,) * m,
        draw=lambda name: K.matrix(n, 1, [K.variable()] * n),
        sign_vectors=_two_sign_vectors(m),
        order=order,
    )


# ---- helpers ---------------------------------------------------------------------------------------------------


def _random_nonzero(K: Field, rng: random.Random) -> Any:
    return next(value for value in iter(lambda: K.random(rng), None) if value != 0)


def _symbol_names(vectors: Sequence[str], n: int) -> dict[str, list[str]]:
    return {vector: [f"w{k}_{i + 1}" for i in range(n)] for k, vector in enumerate(vectors)}


def _member_data(member: FamilyMember, K: Field) -> dict[str, Any]:
    """Return the data of a member over K: A, the third derivatives of H and, if chi has repeated roots, the matrices B.

    Such a B is I or -I on the kernel of p(A)^e, for each irreducible factor p of chi of multiplicity e.
    """
    n = member.dim
    slices = [matrix.entries() for matrix in third_derivatives(member.H)]
    d3H = fmpq_mat(n * n, n, [slices[l][row] for row in range(n * n) for l in range(n)])
    values = {"K": K, "A": K.convert_matrix(member.A), "d3H": K.convert_matrix(d3H)}
    if not member.is_generic:
        values["associate_matrices"] = tuple(K.convert_matrix(g.B) for g in list(member.associated())[1:])
    return values


def _normal_form(K: Field, roots: Sequence[Any], cubics: Sequence[Sequence[Any]]) -> tuple[Any, Any]:
    """Return A = diag(roots, roots) and the d3H of H = sum over the blocks of a u^3 + b u^2 v + c u v^2 + d v^3."""
    m = len(roots)
    n = 2 * m
    A = K.matrix(n, n, [roots[i % m] if i == j else K.zero for i in range(n) for j in range(n)])
    d3H = [K.zero] * n**3
    for i, coefficients in enumerate(cubics):
        for bits in range(8):
            indices = [i + m * (bits >> k & 1) for k in range(3)]
            number_of_v = bin(bits).count("1")
            factor = K.convert((6, 2, 2, 6)[number_of_v])
            d3H[(indices[0] * n + indices[1]) * n + indices[2]] = coefficients[number_of_v] * factor
    return A, K.matrix(n * n, n, d3H)


def _two_sign_vectors(m: int) -> tuple[tuple[int, ...], ...] | None:
    """Return the two sign vectors with the most factors B_i: bounds for these hold for all pairs; None for m = 1."""
    return None if m == 1 else ((-1,) * m, (1,) + (-1,) * (m - 1))
