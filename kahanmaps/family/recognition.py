"""Recognition of members of the family: the search for a matrix A, given only H and J.

x' = J grad H(x), with a homogeneous cubic H and a constant invertible skew J, belongs to the family for every A with

    A^T J = J A   and   A Hess(H) = Hess(H) A^T.

These are linear conditions on the skew matrix S = J A: S T_l J is symmetric for each l, where T_l is the derivative of
Hess(H) along x_l. The multiples of I are always solutions. If H depends on all variables, the solutions A form a
commutative algebra, whose primitive idempotents give the finest splitting of H. Otherwise solutions need not commute,
and idempotents are split one after the other. docs/mathematics.md, "Hidden members", has the proofs.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly, fmpq_poly, fmpz, fmpz_mat

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.matrices import combination_of, nullspace, primitive_integers, rank, trace
from kahanmaps.algebra.polynomials import gradient, linear_combinations, names_of, ring
from kahanmaps.display_protocols import ResultPart
from kahanmaps.errors import HypothesisError, InputError
from kahanmaps.family.associated import FamilyMember, sign_polynomial
from kahanmaps.family.cubics import third_derivatives
from kahanmaps.family.skew_hamiltonian import Factor, bits_of, evaluate_at_matrix, factors_of_chi
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import QuadraticSystem, as_system

MAX_DIMENSION = 32  # as for random members; there are n(n-1)/2 unknowns in dimension n
_DRAWS = 24  # number of random combinations of a basis that are tried besides the basis itself
_TRIAL_DIVISION = 1000  # number of primes by which a gcd is divided
_T = fmpq_poly([0, 1])


@dataclass(frozen=True, eq=False)
class FamilyStructure(ResultPart):
    """The structure of a Hamiltonian system as a member: `member` is the system in coordinates y with x = T y.

    T is rational and invertible with J = T [[0, I], [-I, 0]] T^T; T = I for the standard J. `dimension` is that of the
    space of all A with A^T J = J A and A Hess(H) = Hess(H) A^T. `find_family_structure` constructs the structure. The
    constructor verifies exactly that `member` is the system, and raises HypothesisError otherwise.
    """

    hamiltonian: CubicHamiltonian
    member: FamilyMember
    T: fmpq_mat
    dimension: int

    def __post_init__(self) -> None:
        if self.T * standard_structure(self.member.dim) * self.T.transpose() != self.hamiltonian.J:
            raise HypothesisError("J is not T [[0, I], [-I, 0]] T^T")
        if any(sign < 0 for sign in self.member.signs):
            raise HypothesisError("found a member with a sign -1, expected f_0 itself")
        if _pull_back(self.hamiltonian.H, self.T, self.member.variables) != self.member.H:
            raise HypothesisError("the cubic of the member is not H(T y)")

    @cached_property
    def A(self) -> fmpq_mat:
        """The matrix A in the coordinates x, T^{-T} A_y T^T for the matrix A_y of `member`."""
        return self.T.inv().transpose() * self.member.A * self.T.transpose()

    @property
    def is_generic(self) -> bool:
        """Whether chi has no repeated root."""
        return self.member.is_generic

    @property
    def is_standard(self) -> bool:
        """Whether T = I, so that the coordinates of the member are those of the system."""
        return bool(self.T == QQ.identity(self.member.dim))

    @property
    def text(self) -> str:
        """A sentence that describes the structure."""
        factors = self.member.factors
        chi_text = " ".join(
            f"({factor})" + (f"^{factor.multiplicity}" * (factor.multiplicity > 1)) for factor in factors
        )
        if self.member.m == 1:
            sentence = f"every homogeneous cubic in dimension 2 is a member, with A = I and chi = {chi_text}"
        else:
            beginning_text = "H splits: A"
            if len(factors) == 1:
                is_nonlinear = factors[0].degree > 1
                beginning_text = (
                    "H splits over the splitting field of chi: A"
                    if is_nonlinear
                    else "H does not split: A, not scalar,"
                )
            sentence = f"{beginning_text} with A Hess(H) = Hess(H) A^T has chi = {chi_text}"
        return sentence if self.is_standard else f"{sentence}, in coordinates y with x = T y and standard J"


def structure_space(H: fmpq_mpoly, J: fmpq_mat | None = None) -> list[fmpq_mat]:
    """Return a basis of all A with A^T J = J A and A Hess(H) = Hess(H) A^T, for an invertible J (default: standard).

    H is a homogeneous cubic. The result is a reduced basis of the lattice of all integer solutions; the identity lies
    in its span. Exact.

    Raises InputError unless H is a homogeneous cubic, J an invertible skew matrix, and the dimension at most 32.

    >>> from kahanmaps.algebra.parsing import parse_polynomial
    >>> names = ["x1", "x2", "x3", "x4"]
    >>> len(structure_space(parse_polynomial("x1^3 + x3^3 + x2^2*x4", names)))
    2
    >>> structure_space(parse_polynomial("x1^3 + x1*x2*x3 + x2^2*x4", names))
    [[1, 0, 0, 0]
    [0, 1, 0, 0]
    [0, 0, 1, 0]
    [0, 0, 0, 1]]
    """
    if J is None:
        J = standard_structure(len(names_of(H)))
    reason = _unsupported_reason(CubicHamiltonian(H, J))
    if reason:
        raise InputError(reason)
    _require_dimension(J.nrows())
    n = J.nrows()
    inverse = J.inv()
    conditions: list[fmpz_mat] = [(T * J).numer_denom()[0] for T in third_derivatives(H)]
    # A few random combinations of the conditions are almost always equivalent to all conditions.
    rng = random.Random(n)
    combinations = [combination_of([rng.randint(-9, 9) for _ in conditions], conditions) for _ in range(3)]
    column = {pair: k for k, pair in enumerate(itertools.combinations(range(n), 2))}
    for condition_set in (combinations, conditions):
        # The linear equations for the skew matrices S for which S F is symmetric for each F in the set.
        rows = []
        for F, (i, j) in itertools.product(condition_set, column):
            row = [fmpz(0)] * len(column)
            for k in range(n):  # the entry i, j of S F - (S F)^T contains S[i, k] F[k, j] - S[j, k] F[k, i]
                if k != i:
                    row[column[min(i, k), max(i, k)]] += F[k, j] if i < k else -F[k, j]
                if k != j:
                    row[column[min(j, k), max(j, k)]] -= F[k, i] if j < k else -F[k, i]
            rows.append(row)
        solutions = []
        for vector in nullspace(QQ, fmpq_mat(fmpz_mat(rows))):
            S = fmpz_mat(n, n)
            for (i, j), value in zip(column, primitive_integers(vector), strict=True):
                S[i, j], S[j, i] = value, -value
            solutions.append(S)
        products = (S * F for S in solutions for F in conditions)
        if all(product == product.transpose() for product in products):
            break
    return _reduced_basis([inverse * fmpq_mat(S) for S in solutions])


def find_family_structure(hamiltonian: CubicHamiltonian) -> FamilyStructure | None:
    """Search for an A that makes the system a member of the family, with as many distinct eigenvalues as possible.

    Returns None if H is not a homogeneous cubic, J is not invertible, or only multiples of I satisfy A Hess(H) =
    Hess(H) A^T. (In dimension 2 the result is A = I for every H.) If chi of A splits over Q, its roots are 1, 2, ...,
    r. The member is verified exactly. If H depends on all variables, no A has more distinct eigenvalues (proved).
    Otherwise this is not proved, since only some combinations of solutions A are tried.

    Raises InputError above dimension 32.

    >>> from kahanmaps.algebra.parsing import parse_polynomial
    >>> H = parse_polynomial("x1^3 + x3^3 + x2^2*x4", ["x1", "x2", "x3", "x4"])
    >>> structure = find_family_structure(CubicHamiltonian(H, standard_structure(4)))
    >>> structure.text
    'H splits: A with A Hess(H) = Hess(H) A^T has chi = (t - 1) (t - 2)'
    >>> [g.label for g in structure.member.associated()]
    ['++', '+-']
    >>> H = parse_polynomial("x1^3 + x1*x2*x3 + x2^2*x4", ["x1", "x2", "x3", "x4"])
    >>> find_family_structure(CubicHamiltonian(H, standard_structure(4))) is None
    True
    """
    if _unsupported_reason(hamiltonian):
        return None
    _require_dimension(hamiltonian.dim)
    T = QQ.identity(hamiltonian.dim) if hamiltonian.is_standard else darboux_coordinates(hamiltonian.J)
    names, prefix = hamiltonian.variables, "y"
    if not hamiltonian.is_standard:  # new variables y1, y2, ..., or yy1, ... if the system uses these names
        while any(name.startswith(prefix) for name in names):
            prefix += "y"
        names = tuple(f"{prefix}{i + 1}" for i in range(len(names)))
    H = _pull_back(hamiltonian.H, T, names)
    space = structure_space(H)
    if len(space) == 1 and hamiltonian.dim > 2:
        return None
    # A gets as many distinct eigenvalues as possible, and small entries.
    blocks = list(_split_idempotent(space, QQ.identity(hamiltonian.dim)))
    A = fmpq_mat(hamiltonian.dim, hamiltonian.dim)
    # The idempotent E_1 with the longest entries gets the eigenvalue 1: if the r idempotents of linear blocks add up to
    # I, then E_1 + 2 E_2 + ... + r E_r = I + E_2 + ... + (r - 1) E_r does not contain E_1, so its entries are shorter.
    linear_blocks = sorted(
        (block for block in blocks if block.factor.degree() == 1), key=lambda block: -_total_bits(block.E)
    )
    for value, block in enumerate(linear_blocks, start=1):
        A = A + block.E * value + block.X
    used_factors: list[fmpq_poly] = []
    for block in blocks:
        if block.factor.degree() > 1:
            shifts = (k // 2 if k % 2 else -(k // 2) for k in itertools.count(1))  # 0, -1, 1, -2, ...
            shift = next(c for c in shifts if block.factor(fmpq_poly([-c, 1])) not in used_factors)
            used_factors.append(block.factor(fmpq_poly([-shift, 1])))
            A = A + block.X + block.E * shift
    return FamilyStructure(hamiltonian, FamilyMember(A, H), T, len(space))


def find_cubic_hamiltonian(system: QuadraticSystem) -> CubicHamiltonian | None:
    """Return the H without constant term with x' = J grad H for J = [[0, I], [-I, 0]]; None if no such H exists.

    The result is exact. Other structures J are not tried.

    >>> print(find_cubic_hamiltonian(QuadraticSystem.from_text(["q", "p"], ["p", "-q^2"])).H)
    1/3*q^3 + 1/2*p^2
    >>> find_cubic_hamiltonian(QuadraticSystem.from_text(["q", "p"], ["p", "p^2"])) is None
    True
    """
    if system.dim % 2:
        return None
    J = standard_structure(system.dim)
    field = linear_combinations(-J, system.rhs)
    context = field[0].context()
    H = context.constant(0)
    for i, component in enumerate(field):
        for exponent, coefficient in component.terms():
            integrated_monomial = tuple(power + (i == j) for j, power in enumerate(exponent))
            # Euler's formula for homogeneous functions, for each degree separately.
            H = H + context.from_dict({integrated_monomial: coefficient / sum(integrated_monomial)})
    return CubicHamiltonian(H, J) if gradient(H) == field else None


def find_family_structure_of(system: QuadraticSystem | Any) -> FamilyStructure | None:
    """Apply `find_family_structure` to a system x' = J grad H with the standard J; return None for other systems.

    >>> rhs = ["3*x3^2", "x2^2", "-3*x1^2", "-2*x2*x4"]
    >>> print(find_family_structure_of(QuadraticSystem.from_text(["x1", "x2", "x3", "x4"], rhs)).text)
    H splits: A with A Hess(H) = Hess(H) A^T has chi = (t - 1) (t - 2)
    """
    hamiltonian = find_cubic_hamiltonian(as_system(system))
    return None if hamiltonian is None else find_family_structure(hamiltonian)


def why_not_member(hamiltonian: CubicHamiltonian | None) -> str:
    """Return a sentence that says why a system is not a member; `hamiltonian` is None if the system has none."""
    if hamiltonian is None:
        return "x' is not J grad H with J = [[0, I], [-I, 0]]"
    return _unsupported_reason(hamiltonian) or "only the multiples of I satisfy A^T J = J A and A Hess(H) = Hess(H) A^T"


def darboux_coordinates(J: fmpq_mat) -> fmpq_mat:
    """Return T with J = T [[0, I], [-I, 0]] T^T, so that x' = J grad H becomes y' = [[0, I], [-I, 0]] grad H(T y).

    T = I for the standard J. Raises InputError unless J is skew and invertible.

    >>> darboux_coordinates(fmpq_mat([[0, 3], [-3, 0]]))
    [3, 0]
    [0, 1]
    """
    n = J.nrows()
    if n != J.ncols() or n % 2 or J.transpose() != -J:
        raise InputError("J is not a skew matrix of even size")
    remaining_form, q_columns, p_columns = J, [], []
    for _ in range(n // 2):
        positions = [(i, j) for i in range(n) for j in range(i + 1, n) if remaining_form[i, j] != 0]
        if not positions:
            raise InputError("J is singular, expected an invertible matrix")
        i, j = min(positions, key=lambda position: bits_of(remaining_form[position]))
        pivot = remaining_form[i, j]
        a, b = (fmpq_mat([[remaining_form[k, column]] for k in range(n)]) for column in (i, j))
        q_columns.append(b.entries())
        p_columns.append((a / -pivot).entries())
        remaining_form = remaining_form - (a * b.transpose() - b * a.transpose()) / pivot
    return fmpq_mat([*q_columns, *p_columns]).transpose()


@dataclass(frozen=True)
class _Block:
    """An idempotent E in the space of matrices A, not split further, and X = E X E, nilpotent or generating a field.

    The distinct eigenvalues of X on the image of E are the roots of `factor`, which is t if X is nilpotent.
    """

    E: fmpq_mat
    X: fmpq_mat
    factor: fmpq_poly


def _split_idempotent(space: Sequence[fmpq_mat], E: fmpq_mat) -> Iterator[_Block]:
    """Split the idempotent E as far as possible by elements E X E, X in `space`; yield each part as a block."""
    if trace(E) == 2:  # a self-adjoint matrix in a symplectic plane is scalar
        yield _Block(E, E * 0, _T)
        return
    for X in space:
        if len(idempotents := _split_by_factors(E * X * E, E)) > 1:
            for idempotent in idempotents:
                yield from _split_idempotent(space, idempotent)
            return
    block_basis = _reduced_basis([E * X * E for X in space])
    if len(block_basis) == 1:
        yield _Block(E, E * 0, _T)
        return
    # In a commutative algebra, the rank of the form tr(X Y) is the number of distinct eigenvalues of a generic element.
    is_commutative = all(X * Y == Y * X for X, Y in itertools.combinations(block_basis, 2))
    rows, rows_of_transposes = (
        fmpq_mat([M.entries() for M in matrices]) for matrices in (block_basis, [X.transpose() for X in block_basis])
    )
    target_degree = rank(QQ, rows * rows_of_transposes.transpose()) if is_commutative else 0
    candidates: list[tuple[tuple[int, int, int, int], fmpq_mat, fmpq_poly]] = []
    rng = random.Random(len(block_basis))
    # First the elements of the basis are tried, then random combinations of them with slowly growing coefficients.
    bounds = (count // _DRAWS - 1 for count in itertools.count(2 * _DRAWS))
    combinations = (combination_of([rng.randint(-bound, bound) for _ in block_basis], block_basis) for bound in bounds)
    for index, X in enumerate(itertools.chain(block_basis, combinations)):
        if len(idempotents := _split_by_factors(X, E)) > 1:
            for idempotent in idempotents:
                yield from _split_idempotent(space, idempotent)
            return
        polynomial = _factors_on_image(X, E)[0].polynomial
        value, power, length = evaluate_at_matrix(polynomial, X) * E, E, 0
        while power != 0 * power:  # length = degree of `polynomial` times the least k with polynomial(X)^k E = 0
            power, length = power * value, length + polynomial.degree()
        for Y, minimal_polynomial in _equivalent_generators(X, E, polynomial):
            height = sum(map(bits_of, minimal_polynomial.coeffs()))
            candidates.append(((minimal_polynomial.degree(), length, -height, -_total_bits(Y)), Y, minimal_polynomial))
        if index >= len(block_basis) + _DRAWS and max(key[0] for key, _, _ in candidates) >= target_degree:
            break
    _, X, polynomial = max(candidates, key=lambda candidate: candidate[0])
    is_field = polynomial.degree() > 1
    yield _Block(E, X, polynomial) if is_field else _Block(E, _reduced_basis([X + E * polynomial[0]])[0], _T)


def _split_by_factors(X: fmpq_mat, E: fmpq_mat) -> list[fmpq_mat]:
    """Split E into idempotents by X = E X E, one for each irreducible factor of X on the image of E; [E] for one."""
    factors = _factors_on_image(X, E)
    if len(factors) == 1:
        return [E]
    idempotents = []
    for index in range(len(factors)):
        signs = [2 * (i == index) - 1 for i in range(len(factors))]
        idempotents.append(evaluate_at_matrix((sign_polynomial(factors, signs) + 1) / 2, X) * E)
    return idempotents


def _factors_on_image(X: fmpq_mat, E: fmpq_mat) -> list[Factor]:
    """Return the irreducible factors of chi of the restriction of X = E X E to the image of E."""
    dim, factors = int(trace(E).p), []
    for factor in factors_of_chi(X):
        multiplicity = factor.multiplicity - (X.nrows() - dim) // 2 * (factor.root == 0)
        if multiplicity:
            factors.append(Factor(factor.polynomial, multiplicity))
    return factors


def _equivalent_generators(X: fmpq_mat, E: fmpq_mat, polynomial: fmpq_poly) -> Iterator[tuple[fmpq_mat, fmpq_poly]]:
    """Yield X, then Y = (X - a E)/b, each with its irreducible polynomial; integer coefficients stay integral."""
    yield X, polynomial
    d = polynomial.degree()
    if d == 1:
        return
    a = fmpq(-polynomial[d - 1] / d + fmpq(1, 2)).floor()
    X, polynomial = X - E * a, polynomial(fmpq_poly([a, 1]))
    gcd = fmpz(0)
    for k in range(d):
        gcd = gcd.gcd(polynomial[k].p)
    for b, _ in gcd.factor(trial_limit=_TRIAL_DIVISION):
        while b > 1 and all(polynomial[d - k].p % b**k == 0 for k in range(1, d + 1)):
            X, polynomial = X / b, fmpq_poly([polynomial[d - k] / b**k for k in range(d, -1, -1)])
    yield X, polynomial


def _reduced_basis(matrices: Sequence[fmpq_mat]) -> list[fmpq_mat]:
    """Return a reduced basis of all integer matrices in the span of `matrices`; it is empty if all of them are 0."""
    lattice = fmpz_mat([primitive_integers(tuple(matrix.entries())) for matrix in matrices])
    rows = lattice.tolist()
    is_alone = [sum(entry != 0 for entry in column) == 1 for column in lattice.transpose().tolist()]
    # If each row has an entry 1 or -1 that is alone in its column, the rows generate all integer points of their span.
    if not all(any(alone and abs(entry) == 1 for entry, alone in zip(row, is_alone, strict=True)) for row in rows):
        reduced_rows = lattice.lll()
        d = lattice.rank()
        lattice = fmpz_mat(
            d, lattice.ncols(), [entry for row in reduced_rows.tolist()[len(matrices) - d :] for entry in row]
        )
        if d == 0:
            return []
        # Let G be the Hermite form of the columns of B = `lattice`: for a row c, c B is integral if and only if c G is.
        G = fmpz_mat(lattice.transpose().hnf().tolist()[:d]).transpose()
        lattice = (fmpq_mat(G).inv() * fmpq_mat(lattice)).numer_denom()[0]
    shape = matrices[0].nrows(), matrices[0].ncols()
    return [fmpq_mat(*shape, primitive_integers(tuple(map(fmpq, row)))) for row in lattice.lll().tolist()]


def _unsupported_reason(hamiltonian: CubicHamiltonian) -> str:
    """Return why the search for A does not apply to a system; empty if it applies."""
    if hamiltonian.dim % 2:
        return f"the dimension is {hamiltonian.dim}, expected an even one"
    if not hamiltonian.is_homogeneous:
        return "H is not a homogeneous cubic"
    if hamiltonian.J.rank() < hamiltonian.dim:
        return "J is singular, expected an invertible matrix"
    return ""


def _require_dimension(dim: int) -> None:
    if dim > MAX_DIMENSION:
        raise InputError(f"A is searched for in dimensions up to {MAX_DIMENSION}, and the system has dimension {dim}")


def _pull_back(H: fmpq_mpoly, T: fmpq_mat, names: Sequence[str]) -> fmpq_mpoly:
    """Return H(T y) as a polynomial in the variables `names`."""
    context = ring(names)
    if T == QQ.identity(T.nrows()):
        return context.from_dict(H.to_dict())
    return H.compose(*linear_combinations(T, context.gens()), ctx=context)


def _total_bits(matrix: fmpq_mat) -> int:
    return sum(map(bits_of, matrix.entries()))
