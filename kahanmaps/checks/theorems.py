"""Proofs by theorems: each function verifies the finitely many hypotheses of a theorem exactly.

A function returns the evidence, or None if a hypothesis does not hold. Theorems are from petrera-suris-2016 and
cmoq-2013, or proved in docs/mathematics.md (splitting without J, repeated roots of chi, dimension 2).
"""

from __future__ import annotations

from collections.abc import Iterable

from flint import fmpq, fmpq_mat, fmpq_poly

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.matrices import rank
from kahanmaps.algebra.polynomials import RationalFunction, gradient, linear_combinations
from kahanmaps.checks.claims import Certainty, Evidence
from kahanmaps.family.associated import AssociatedSystem, FamilyMember
from kahanmaps.family.cubics import belongs
from kahanmaps.family.skew_hamiltonian import defects, evaluate_at_matrix, minimal_degree
from kahanmaps.family.tensor import commutes
from kahanmaps.invariants.integrals_and_densities import CommutantIntegral
from kahanmaps.systems.hamiltonian import CubicHamiltonian
from kahanmaps.systems.quadratic import QuadraticSystem

METHOD = "hypotheses"
PROVED = Certainty.PROVED
# For at most so many factors of chi all rational associated systems are compared: 2^(8 - 1) = 128 systems, 8128 pairs.
MAX_FACTORS = 8


def evidence(theorem: str, hypotheses: Iterable[tuple[str, bool]]) -> Evidence | None:
    """Return the evidence that a theorem applies, given pairs (hypothesis, whether it holds); None if one fails."""
    distinct_hypotheses = list(dict.fromkeys(hypotheses))
    if not all(is_true for _, is_true in distinct_hypotheses):
        return None
    names = [name for name, _ in distinct_hypotheses]
    return Evidence(METHOD, f"{theorem} applies: {'; '.join(names)}", {"theorem": theorem, "hypotheses": names})


def associated_hypotheses(member: FamilyMember, associate: AssociatedSystem) -> list[tuple[str, bool]]:
    """Return pairs (hypothesis, whether it holds), which together say that `associate` is associated to J grad H."""
    polynomial_at_A = evaluate_at_matrix(fmpq_poly(list(associate.coefficients)), member.A)
    return [
        (f"B_{associate.label} is a polynomial in A", bool(polynomial_at_A == associate.B)),
        (f"B_{associate.label}^2 = I", bool(associate.B * associate.B == QQ.identity(member.dim))),
        (
            f"grad K_{associate.label} = B_{associate.label} grad H",
            gradient(associate.K) == linear_combinations(associate.B, gradient(member.H)),
        ),
    ]


def listed_associates(member: FamilyMember) -> list[AssociatedSystem]:
    """Return the rational associated systems, f_0 first; for over 8 factors of chi, those with at most one sign -1."""
    count = len(member.factors)
    if count <= MAX_FACTORS:
        return list(member.associated())
    sign_choices = [tuple(-1 if i == k else 1 for i in range(count)) for k in range(count)]
    return [member.associate(signs) for signs in [(1,) * count, *sign_choices]]


def member_hypotheses(member: FamilyMember) -> list[tuple[str, bool]]:
    """Return pairs (hypothesis, whether it holds); together they say that (A, H) is a member of the family."""
    return [
        ("A^T J = J A", not defects(member.A)),
        ("H is a homogeneous cubic with A Hess(H) = Hess(H) A^T", belongs(member.A, member.H)),
    ]


def commuting_by_splitting(f: QuadraticSystem, g: QuadraticSystem) -> Evidence | None:
    """The maps of f and g commute if g = C f with a constant C, C^3 = C, C f'(x) = f'(x) C for every x.

    The space is the sum of the eigenspaces of C for 1, -1 and 0. f splits into a system on each of them, where g is f,
    -f and 0. So Phi_g is Phi_f, its inverse and the identity there. The lemma also holds for inhomogeneous f and needs
    no Hamiltonian structure.

    >>> f = QuadraticSystem.from_text(["x", "y"], ["x^2", "y^2"])
    >>> commuting_by_splitting(f, QuadraticSystem.from_text(["x", "y"], ["0", "-y^2"])).data["hypotheses"][1]
    'C^3 = C'
    """
    C = linear_relation(f, g)
    if C is None:
        return None
    return evidence(
        "the splitting lemma (docs/mathematics.md)",
        [
            ("g = C f with a constant matrix C", f.transformed(C) == g.renamed(f.variables)),
            ("C^3 = C", bool(C * C * C == C)),
            ("C f'(x) = f'(x) C for every x", commutes(C, f)),
        ],
    )


def commuting_by_involution_of_members(f: FamilyMember, g: FamilyMember) -> Evidence | None:
    """The maps of two members with equal A and H and any signs commute (petrera-suris-2016, Theorem 9)."""
    if f.A != g.A or f.variables != g.variables or f.H != g.H:
        return None
    return evidence(
        "Theorem 9 of Petrera and Suris",
        [*member_hypotheses(f), *associated_hypotheses(f, f.chosen), *associated_hypotheses(g, g.chosen)],
    )


def commuting_over_splitting_field(member: FamilyMember) -> Evidence | None:
    """Over the splitting field of chi all associated maps commute, since B_s^2 = I for every choice s of signs."""
    chi_at_A = QQ.identity(member.dim)
    for factor in member.factors:
        chi_at_A = chi_at_A * evaluate_at_matrix(factor.polynomial, member.A) ** factor.multiplicity
    is_zero = not any(entry != 0 for entry in chi_at_A.entries())
    return evidence(
        "Theorem 9 of Petrera and Suris over the splitting field",
        [
            *member_hypotheses(member),
            ("chi(A) = 0, so that B_s^2 = I for the Chinese remainders B_s of the signs", is_zero),
        ],
    )


def cubic_hamiltonian(hamiltonian: CubicHamiltonian) -> Evidence | None:
    """For f = J grad H, H cubic, J constant and skew: the modified H and dx/det(I - eps f'(x)) are invariant.

    Source: cmoq-2013.
    """
    return evidence("the theorem of Celledoni, McLachlan, Owren and Quispel", _cubic_hypotheses(hamiltonian))


def product_density_invariant(system: QuadraticSystem, phi: RationalFunction) -> Evidence | None:
    """For x_i' = x_i (r_i + sum_j a_ij x_j) with a skew matrix a, dx/(x_1 ... x_n) is invariant."""
    x = system.rhs[0].context().gens()[: system.dim]
    exponents = [tuple(map(int, monomial[: system.dim])) for monomial in phi.numerator.monoms()]
    hypotheses = [
        ("phi is a multiple of x_1 ... x_n", phi.is_polynomial and exponents == [(1,) * system.dim]),
        ("x_i divides f_i", all(monomial[i] for i, f in enumerate(system.rhs) for monomial in f.monoms())),
    ]
    proof = evidence("the lemma on Lotka-Volterra systems (docs/mathematics.md)", hypotheses)
    if proof is None:
        return None
    rates = [f / g for f, g in zip(system.rhs, x, strict=True)]
    is_skew = all(
        (rates[i].derivative(j) + rates[j].derivative(i)).is_zero() for i in range(len(x)) for j in range(i + 1)
    )
    return evidence(proof.data["theorem"], [*hypotheses, ("a is skew", is_skew)])


def shared_integral(member: FamilyMember, associate: AssociatedSystem) -> Evidence | None:
    """The map of a member conserves the integral K~ of each associated system (petrera-suris-2016, Theorem 11)."""
    return evidence(
        "Theorem 11 of Petrera and Suris",
        [
            *member_hypotheses(member),
            *associated_hypotheses(member, member.chosen),
            *associated_hypotheses(member, associate),
        ],
    )


def commutant_integral(hamiltonian: CubicHamiltonian, integral: CommutantIntegral, name: str) -> Evidence | None:
    """eps^{-1} x^T J C x~ is conserved for every constant C that commutes with f'(x) for all x."""
    return evidence(
        "the commutant lemma (docs/mathematics.md)",
        [
            (
                "H is a homogeneous cubic and J = [[0, I], [-I, 0]]",
                hamiltonian.is_homogeneous and hamiltonian.is_standard,
            ),
            (f"{name} f'(x) = f'(x) {name} for every x", commutes(integral.matrix, hamiltonian.system)),
        ],
    )


def poisson_tensor_invariant(hamiltonian: CubicHamiltonian, member: FamilyMember | None) -> Evidence | None:
    """Pi(x) = J - eps^2 f'(x)^2 J is an invariant Poisson tensor in dimension 2 and if A is nonderogatory."""
    if hamiltonian.dim == 2:
        # f' is a traceless 2 x 2 matrix: f'^2 = -det f' I, so Pi = det(I - eps f') J, and the claim is that the measure
        # is invariant.
        return evidence("the invariant measure in dimension 2", _cubic_hypotheses(hamiltonian))
    if member is None:
        return None
    return evidence(
        "Theorem 12 of Petrera and Suris",
        [
            *member_hypotheses(member),
            *associated_hypotheses(member, member.chosen),
            ("the minimal polynomial of A has degree m", minimal_degree(member.A) == member.m),
        ],
    )


def linear_relation(f: QuadraticSystem, g: QuadraticSystem) -> fmpq_mat | None:
    """Return a constant matrix C with g = C f; if the components of f are dependent, only C = I and -I are tried."""
    if f.dim != g.dim:
        return None
    n = f.dim
    F, G = _coefficient_matrix(f), _coefficient_matrix(g)
    if rank(QQ, F) < n:
        identity: fmpq_mat = QQ.identity(n)
        return next((identity * fmpq(sign) for sign in (1, -1) if G == F * fmpq(sign)), None)
    # F has full row rank, so C F = G has at most one solution, C = G F^T (F F^T)^{-1}.
    gram = F * F.transpose()
    C = gram.solve(F * G.transpose()).transpose()
    return C if C * F == G else None


def _cubic_hypotheses(hamiltonian: CubicHamiltonian) -> list[tuple[str, bool]]:
    J = hamiltonian.J
    return [
        ("H is a polynomial of degree at most 3", all(sum(m) <= 3 for m in hamiltonian.H.monoms())),
        ("J is constant and skew", bool(J.transpose() == -J)),
        ("f = J grad H", hamiltonian.system.rhs == linear_combinations(J, hamiltonian.gradient)),
    ]


def _coefficient_matrix(system: QuadraticSystem) -> fmpq_mat:
    """Return the coefficients of a system: a row for each component, a column for each monomial of degree <= 2."""
    n = system.dim
    rows = []
    for i in range(n):
        quadratic = [system.Q[i][j, k] for j in range(n) for k in range(j, n)]
        rows.append([*quadratic, *(system.B[i, j] for j in range(n)), system.c[i]])
    return fmpq_mat(rows)
