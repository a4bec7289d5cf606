"""Members of the family and their associated systems.

Let chi^2 = det(t - A), chi the product of irreducible p_i^e_i, and f_0 = J grad H. For signs s, the polynomial B_s in A
acts as s_i on the kernel of p_i(A)^e_i. Then B_s^2 = I, and f_s = B_s^T f_0 = J grad K_s with grad K_s = B_s grad H.
The Kahan maps of all f_s commute. Source: petrera-suris-2016, Sect. 5; for every m and chi, docs/mathematics.md.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from flint import fmpq, fmpq_mat, fmpq_mpoly, fmpq_poly

from kahanmaps.algebra.etale import EtaleElement
from kahanmaps.algebra.polynomials import names_of
from kahanmaps.algebra.printing import format_polynomial, format_univariate
from kahanmaps.algebra.roots import MAX_DEGREE, Root
from kahanmaps.display_protocols import HtmlDisplay, ResultPart
from kahanmaps.errors import HypothesisError, InputError, counted
from kahanmaps.family.cubics import chain
from kahanmaps.family.skew_hamiltonian import Factor, chi, evaluate_at_matrix, factors_of_chi, require_skew_hamiltonian
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import QuadraticSystem


@dataclass(frozen=True, eq=False)
class AssociatedSystem(HtmlDisplay, ResultPart):
    """An associated system f_s = B^T f_0 = J grad K: signs s, matrix B, coefficients of B in powers of A, cubic K."""

    signs: tuple[int, ...]
    coefficients: tuple[fmpq, ...]
    B: fmpq_mat
    K: fmpq_mpoly

    @cached_property
    def hamiltonian(self) -> CubicHamiltonian:
        """The Hamiltonian K with the standard structure J."""
        return CubicHamiltonian(self.K, standard_structure(self.B.nrows()))

    @property
    def system(self) -> QuadraticSystem:
        """The quadratic system x' = J grad K(x)."""
        return self.hamiltonian.system

    @property
    def text(self) -> str:
        """The signs and the dimension, as a phrase."""
        return f"signs {self.label}, dimension {self.B.nrows()}"

    @property
    def label(self) -> str:
        """The signs as text, such as `++-`."""
        return "".join("+" if sign > 0 else "-" for sign in self.signs)


@dataclass(frozen=True, eq=False)
class ConjugateAssociate:
    """An associated system over Q[t]/g whose signs agree at all roots of each factor of chi, except at one `root` of g.

    For the `coefficients` c_i in Q[t]/g, B is the sum of c_i A^i, and K is the sum of c_i H_i over the `chain` of H.
    """

    root: Root
    signs: tuple[int, ...]
    coefficients: tuple[EtaleElement, ...]
    chain: tuple[fmpq_mpoly, ...]

    @cached_property
    def name(self) -> str:
        """A name for the root, different from the names of the variables."""
        names = names_of(self.chain[0])
        candidates = itertools.chain(["t"], (f"t{k}" for k in itertools.count()))
        return next(name for name in candidates if name not in names)

    @cached_property
    def K_text(self) -> str:
        """The cubic K with grad K = B grad H, as text; its coefficients are polynomials in the root."""
        terms: dict[tuple[int, ...], EtaleElement] = {}
        for coefficient, H in zip(self.coefficients, self.chain, strict=True):
            for monomial, number in H.terms():
                terms[monomial] = terms.get(monomial, 0 * coefficient) + coefficient * number
        context = self.chain[0].context()
        monomials = context.from_dict({monomial: 1 for monomial, c in terms.items() if c != 0}).monoms()
        term_texts = (
            f"({format_univariate(terms[monomial].polynomial, self.name)})*"
            f"{format_polynomial(context.from_dict({monomial: 1}))}"
            for monomial in monomials
        )
        return " + ".join(term_texts) or "0"


@dataclass(frozen=True, eq=False)
class FamilyMember(HtmlDisplay, ResultPart):
    """A member of the family: a skew-Hamiltonian A, a cubic H with A Hess(H) = Hess(H) A^T, and signs.

    The signs determine one associated system, `chosen`; if all signs are positive, it is f_0 = J grad H. Raises
    HypothesisError if A is not skew-Hamiltonian, or A Hess(H) is not Hess(H) A^T.

    >>> from kahanmaps.algebra.parsing import parse_polynomial
    >>> A = fmpq_mat(4, 4, [1, 0, 0, 0,  0, 2, 0, 0,  0, 0, 1, 0,  0, 0, 0, 2])
    >>> H = parse_polynomial("x1^3 + x2^2*x4", ["x1", "x2", "x3", "x4"])
    >>> [g.label for g in FamilyMember(A, H).associated()]
    ['++', '+-']
    """

    A: fmpq_mat
    H: fmpq_mpoly
    signs: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        require_skew_hamiltonian(self.A)
        chain(self.A, self.H, 1)
        count = len(self.factors)
        if not self.signs:
            object.__setattr__(self, "signs", (1,) * count)
        if len(self.signs) != count or any(sign not in (1, -1) for sign in self.signs):
            factors_text = ", ".join(f"({factor})" for factor in self.factors)
            raise HypothesisError(
                f"found the signs {list(self.signs)}, expected {count} numbers 1 or -1: "
                f"one for each irreducible factor of chi, here {factors_text}"
            )

    @property
    def dim(self) -> int:
        """The dimension 2m."""
        return int(self.A.nrows())

    @property
    def m(self) -> int:
        """Half the dimension."""
        return self.dim // 2

    @property
    def variables(self) -> tuple[str, ...]:
        return names_of(self.H)

    @cached_property
    def factors(self) -> tuple[Factor, ...]:
        """The irreducible factors of chi over Q, in the order of the signs."""
        return factors_of_chi(self.A)

    @property
    def is_generic(self) -> bool:
        """Whether chi has no repeated root."""
        return all(factor.multiplicity == 1 for factor in self.factors)

    @cached_property
    def chain(self) -> tuple[fmpq_mpoly, ...]:
        """H_0, ..., H_{m-1} with grad H_i = A grad H_{i-1}."""
        return chain(self.A, self.H)

    @cached_property
    def hamiltonians(self) -> tuple[CubicHamiltonian, ...]:
        """The cubics of the chain, with the standard structure J."""
        return tuple(CubicHamiltonian(H, standard_structure(self.dim)) for H in self.chain)

    def associate(self, signs: Sequence[int]) -> AssociatedSystem:
        """Return the associated system with these signs, 1 or -1 for each factor. Raises InputError for other signs."""
        if len(signs) != len(self.factors):
            raise InputError(
                f"found {counted(len(signs), 'sign')}, expected {len(self.factors)}, one for each factor of chi"
            )
        if any(sign not in (1, -1) for sign in signs):
            raise InputError(f"found the signs {list(signs)}, expected numbers 1 or -1")
        polynomial = sign_polynomial(self.factors, signs)
        coefficients = tuple(polynomial[k] for k in range(self.m))
        K = self.H.context().constant(0)
        for coefficient, H in zip(coefficients, self.chain, strict=True):
            if coefficient != 0:
                K = K + coefficient * H
        return AssociatedSystem(tuple(signs), coefficients, evaluate_at_matrix(polynomial, self.A), K)

    def associated(self) -> Iterator[AssociatedSystem]:
        """Yield the rational associated systems, one of each pair f, -f: 2^(r-1) for r factors; f_0 is the first."""
        for remaining_signs in itertools.product((1, -1), repeat=len(self.factors) - 1):
            yield self.associate((1, *remaining_signs))

    @cached_property
    def roots(self) -> dict[int, Root]:
        """One root of each factor of degree at least 2 and multiplicity 1, as {index of the factor: root}."""
        factors = enumerate(self.factors)
        return {k: Root(f.polynomial) for k, f in factors if f.multiplicity == 1 and 2 <= f.degree <= MAX_DEGREE}

    def conjugate_associates(self) -> Iterator[ConjugateAssociate]:
        """Yield the associated systems with the opposite sign at one root t of a factor g of degree 2 or more.

        There is one over Q[t]/g for every such g with multiplicity 1 and every choice of the signs at the remaining
        factors, up to an overall sign. Its matrix B has one conjugate for each root of g; the product of two conjugates
        changes the signs at both roots. If chi has no repeated root, these B and the rational B_s generate all B_s.

        >>> from kahanmaps.algebra.parsing import parse_polynomial
        >>> A = fmpq_mat(4, 4, [0, 2, 0, 0,  1, 0, 0, 0,  0, 0, 0, 1,  0, 0, 2, 0])
        >>> H = parse_polynomial("2*x1^3 + 3*x1*x2^2 + x3^3 + 6*x3*x4^2", ["x1", "x2", "x3", "x4"])
        >>> [(str(associate.root), associate.K_text) for associate in FamilyMember(A, H).conjugate_associates()]
        [('root of t^2 - 2', '(-3*t)*x1^2*x2 + (-1/2*t)*x2^3 + (-3*t)*x3^2*x4 + (-2*t)*x4^3')]
        """
        for k, root in self.roots.items():
            quotient = [root.number_field.one]  # the coefficients of chi(x)/(x - t), leading coefficient first
            for c in chi(self.A).coeffs()[-2:0:-1]:
                quotient.append(quotient[-1] * root.number_field.generator + c)
            value_at_root = sum(
                (c * root.number_field.generator**j for j, c in enumerate(reversed(quotient))), 0 * quotient[0]
            )
            twice_idempotent = [2 * c / value_at_root for c in reversed(quotient)]
            for signs in itertools.product((1, -1), repeat=len(self.factors) - 1):
                associate = self.associate((*signs[:k], 1, *signs[k:]))
                coefficients = tuple(a - b for a, b in zip(associate.coefficients, twice_idempotent, strict=True))
                yield ConjugateAssociate(root, associate.signs, coefficients, self.chain)

    @property
    def text(self) -> str:
        """The factors of chi and the signs, as a phrase."""
        chi_text = "".join(f"({factor})" for factor in self.factors)
        return f"m = {self.m}, roots of {chi_text}, signs {self.chosen.label}"

    @property
    def system(self) -> QuadraticSystem:
        """The system of `chosen`."""
        return self.chosen.system

    @cached_property
    def chosen(self) -> AssociatedSystem:
        """The associated system given by `signs`."""
        return self.associate(self.signs)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, FamilyMember):
            return NotImplemented
        return bool(
            self.A == other.A and self.signs == other.signs and self.variables == other.variables and self.H == other.H
        )

    def __hash__(self) -> int:
        return hash((self.variables, self.signs, str(self.H)))


def sign_polynomial(factors: Sequence[Factor], signs: Sequence[int]) -> fmpq_poly:
    """Return the polynomial of degree < m that is s_i modulo p_i^e_i, for factors p_i of multiplicity e_i, signs s_i.

    Its square is 1 modulo chi, and chi(A) = 0. So B = polynomial(A) satisfies B^2 = I for every skew-Hamiltonian A,
    even if chi has repeated roots.

    >>> t = fmpq_poly([0, 1])
    >>> sign_polynomial([Factor(t - 1, 1), Factor(t - 2, 1)], (1, -1))
    (-2)*x + 3
    """
    modulus = fmpq_poly([1])
    for factor in factors:
        modulus *= factor.polynomial**factor.multiplicity
    total = fmpq_poly([0])
    for factor, sign in zip(factors, signs, strict=True):
        factor_power = factor.polynomial**factor.multiplicity
        cofactor = modulus // factor_power
        _, inverse, _ = cofactor.xgcd(factor_power)
        total += sign * cofactor * (inverse % factor_power)
    return total % modulus
