"""What the tests of invariants and checks share: the Kahan map computed a second time, and witnesses put to the test.

But for rational functions written out beside their bounds, at the end, nothing here touches the library's arithmetic.
Numbers are Python's Fractions, linear systems are solved by the elimination written out below, Jacobi matrices come
from dual numbers instead of the formula for dPhi. Only coefficients are read from the library's objects.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
from flint import fmpq, fmpq_mat, fmpq_mpoly
from helpers import fraction, rationals
from hypothesis import strategies as st

from kahanmaps.algebra.bounds import CoefficientSize
from kahanmaps.algebra.functions import BudgetExceeded, FunctionField
from kahanmaps.algebra.parsing import parse_polynomial, parse_rational_function
from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.checks.claims import Certainty, Finding, Report, Witness
from kahanmaps.checks.settings import Settings
from kahanmaps.documents.files import SystemFile, parse_system
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import QuadraticSystem

# Short orbits: every claim is decided at random points as well.
QUICK = Settings(steps=2)

Rows = np.ndarray[Any, Any]  # of Fractions: numpy adds and multiplies them as Python does


@dataclass(frozen=True)
class Dual:
    """a + b t with t^2 = 0: arithmetic that differentiates."""

    a: Fraction
    b: Fraction

    def __add__(self, other: Any) -> Dual:
        other = dual(other)
        return Dual(self.a + other.a, self.b + other.b)

    def __sub__(self, other: Any) -> Dual:
        return self + -dual(other)

    def __mul__(self, other: Any) -> Dual:
        other = dual(other)
        return Dual(self.a * other.a, self.a * other.b + self.b * other.a)

    def __truediv__(self, other: Any) -> Dual:
        other = dual(other)
        return Dual(self.a / other.a, (self.b * other.a - self.a * other.b) / other.a**2)

    def __neg__(self) -> Dual:
        return Dual(-self.a, -self.b)

    def __rsub__(self, other: Any) -> Dual:
        return dual(other) - self

    def __rtruediv__(self, other: Any) -> Dual:
        return dual(other) / self

    __radd__, __rmul__ = __add__, __mul__


def dual(value: Any) -> Dual:
    """The number as a dual one."""
    return value if isinstance(value, Dual) else Dual(Fraction(value), Fraction(0))


def _vanishes(value: Any) -> bool:
    return bool((value.a if isinstance(value, Dual) else value) == 0)


def exact(*values: Any) -> tuple[Fraction, ...]:
    """The numbers (text, int, fmpq) as Fractions."""
    return tuple(Fraction(value) if isinstance(value, str) else fraction(value) for value in values)


def texts(values: Sequence[Fraction]) -> tuple[str, ...]:
    """Fractions as a witness writes them."""
    return tuple(str(value) for value in values)


def solve_by_elimination(matrix: Sequence[Sequence[Any]], right: Sequence[Any]) -> list[Any] | None:
    """The solution of a linear system, None where the matrix is singular."""
    n = len(matrix)
    rows = [[*row, entry] for row, entry in zip(matrix, right, strict=True)]
    for k in range(n):
        pivot = next((i for i in range(k, n) if not _vanishes(rows[i][k])), None)
        if pivot is None:
            return None
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [entry / rows[k][k] for entry in rows[k]]
        for i in range(n):
            if i != k:
                factor = rows[i][k]
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k], strict=True)]
    return [row[n] for row in rows]


def determinant(matrix: Rows) -> Any:
    """The determinant, by expansion along the first row."""
    if len(matrix) == 1:
        return matrix[0, 0]
    minors = (determinant(np.delete(matrix[1:], j, axis=1)) for j in range(len(matrix)))
    return sum(((-1) ** j * matrix[0, j] * minor for j, minor in enumerate(minors)), Fraction(0))


def unit(n: int) -> Rows:
    return np.eye(n, dtype=object)


def rows_of(matrix: fmpq_mat) -> Rows:
    """A rational matrix as an array of Fractions."""
    return np.array([[fraction(entry) for entry in row] for row in matrix.tolist()], dtype=object)


def slope(system: QuadraticSystem, x: Sequence[Any]) -> Rows:
    """f'(x)."""
    at, linear = np.array([*x], dtype=object), rows_of(system.B)
    return np.array([2 * rows_of(Q) @ at for Q in system.Q]) + linear


def kahan_step(system: QuadraticSystem, eps: Fraction, x: Sequence[Any]) -> tuple[Any, ...] | None:
    """The solution x~ of (x~ - x)/(2 eps) = Q(x, x~) + B (x + x~)/2 + c, None where there is no single one."""
    n = system.dim
    matrix, right = [], []
    for i in range(n):
        row, entry = [], x[i] + 2 * eps * fraction(system.c[i])
        for j in range(n):
            linear = eps * fraction(system.B[i, j])
            entry = entry + linear * x[j]
            quadratic = sum((2 * eps * fraction(system.Q[i][j, k]) * x[k] for k in range(n)), linear)
            row.append(int(i == j) - quadratic)
        matrix.append(row)
        right.append(entry)
    image = solve_by_elimination(matrix, right)
    return None if image is None else tuple(image)


def kahan_jacobian(system: QuadraticSystem, eps: Fraction, x: Sequence[Fraction]) -> Rows | None:
    """dPhi(x), one column for each direction in which x is moved by t."""
    columns = []
    for j in range(system.dim):
        moved = [Dual(entry, Fraction(int(i == j))) for i, entry in enumerate(x)]
        image = kahan_step(system, eps, moved)
        if image is None:
            return None
        columns.append([entry.b for entry in image])
    return np.array(columns, dtype=object).T


def polynomial_value(polynomial: fmpq_mpoly, point: Sequence[Any]) -> Any:
    """The value of a polynomial, term by term."""
    total: Any = Fraction(0)
    for monomial, coefficient in polynomial.terms():
        factors = (entry for entry, exponent in zip(point, monomial, strict=True) for _ in range(exponent))
        total = total + math.prod(factors, start=fraction(coefficient))
    return total


def function_value(function: RationalFunction, x: Sequence[Fraction], eps: Fraction) -> Fraction | None:
    """The value of a claimed rational function of x and eps, None at a pole."""
    below = polynomial_value(function.denominator, (*x, eps))
    return None if below == 0 else polynomial_value(function.numerator, (*x, eps)) / below


def modified_value(hamiltonian: CubicHamiltonian, eps: Fraction, x: Sequence[Fraction]) -> Fraction | None:
    """H + (2 eps/3) grad H^T (I - eps f')^{-1} f, as the formula stands."""
    system = hamiltonian.system
    f = [polynomial_value(component, x) for component in system.rhs]
    solution = solve_by_elimination(unit(system.dim) - eps * slope(system, x), f)
    if solution is None:
        return None
    grad = [polynomial_value(component, x) for component in hamiltonian.gradient]
    return polynomial_value(hamiltonian.H, x) + Fraction(2, 3) * eps * np.dot(grad, solution)


def tensor(hamiltonian: CubicHamiltonian, eps: Fraction, x: Sequence[Fraction]) -> Rows:
    """J - eps^2 f'(x)^2 J."""
    J, jacobian = rows_of(hamiltonian.J), slope(hamiltonian.system, x)
    return J - eps**2 * (jacobian @ jacobian @ J)


def verify_witness(witness: Witness | None, left: Sequence[Fraction], right: Sequence[Fraction]) -> None:
    """The sides that a witness shows are those computed independently, and they differ."""
    assert witness is not None
    assert witness.field == "QQ"
    assert witness.left == texts(left)
    assert witness.right == texts(right)
    assert tuple(left) != tuple(right)


def verify_commute_witness(witness: Witness | None, f: QuadraticSystem, g: QuadraticSystem, g_step: Any = 1) -> None:
    """Phi_g(Phi_f(x)) and Phi_f(Phi_g(x)) recomputed, the step of g being `g_step` times that of f."""
    assert witness is not None
    x, (eps,) = exact(*witness.point), exact(witness.eps)
    images = _both_ways(f, g, eps, eps * exact(g_step)[0], x)
    assert images is not None
    verify_witness(witness, *images)


def commute_at(f: QuadraticSystem, g: QuadraticSystem, eps: Fraction, x: Sequence[Fraction]) -> bool | None:
    """Whether the two maps commute at one point, None if one of them is not defined there."""
    images = _both_ways(f, g, eps, eps, x)
    return None if images is None else images[0] == images[1]


def _both_ways(f: QuadraticSystem, g: QuadraticSystem, eps: Fraction, eps_g: Fraction, x: Any) -> Any:
    after_f, after_g = kahan_step(f, eps, x), kahan_step(g, eps_g, x)
    if after_f is None or after_g is None:
        return None
    left, right = kahan_step(g, eps_g, after_f), kahan_step(f, eps, after_g)
    return None if left is None or right is None else (left, right)


ORIGINAL_STEP = KahanMap.step


def half_step(self: KahanMap, point: Sequence[Any]) -> tuple[Any, ...]:
    """x + eps (I - eps f')^{-1} f, to put in the place of KahanMap.step: eps where 2 eps belongs."""
    x = self.point(point)
    image = ORIGINAL_STEP(self, x)
    return tuple(a + (b - a) / self.field.convert(2) for a, b in zip(x, image, strict=True))


def verdicts(report: Report) -> list[Certainty]:
    """The verdicts of a report, claim by claim."""
    return [finding.verdict for finding in report.findings]


def only(report: Report) -> Finding:
    """The one finding of a report."""
    (finding,) = report.findings
    return finding


def system_of(variables: str, *rhs: str, **parameters: Any) -> QuadraticSystem:
    """A system from a text of names and its right-hand sides."""
    return QuadraticSystem.from_text(variables.split(), rhs, parameters)


def side_by_side(first: QuadraticSystem, second: QuadraticSystem) -> QuadraticSystem:
    """x' = f(x), y' = g(y) in the variables x1, x2, ..."""
    n = first.dim
    context = ring([f"x{i + 1}" for i in range(n + second.dim)])
    gens = context.gens()
    rhs = [polynomial.compose(*gens[:n], ctx=context) for polynomial in first.rhs]
    rhs += [polynomial.compose(*gens[n:], ctx=context) for polynomial in second.rhs]
    return QuadraticSystem(rhs)


def file_of(system: QuadraticSystem, name: str = "f", **claims: str) -> SystemFile:
    """A system file with claimed integrals; `phi` is a claimed density."""
    phi = claims.pop("phi", None)
    text = SystemFile.from_system(system, name).to_toml()
    if claims:
        text += "\n[integrals]\n" + "".join(f'{key} = "{value}"\n' for key, value in claims.items())
    if phi is not None:
        text += f'\n[density]\nphi = "{phi}"\n'
    return parse_system(text)


def claim(text: str, variables: str) -> RationalFunction:
    """A rational function of the variables and eps."""
    return parse_rational_function(text, (*variables.split(), "eps"))


def hamiltonian_of(variables: str, H: str, J: Sequence[Sequence[Any]] | None = None) -> CubicHamiltonian:
    """A Hamiltonian system; J is the standard one unless given."""
    names = variables.split()
    matrix = standard_structure(len(names)) if J is None else fmpq_mat([[fmpq(a) for a in row] for row in J])
    return CubicHamiltonian(parse_polynomial(H, names), matrix)


@st.composite
def hamiltonians(
    draw: Any, dims: Sequence[int] = (1, 2, 3), homogeneous: bool = False, standard: bool = False
) -> CubicHamiltonian:
    """Hamiltonian systems with small rational coefficients and any constant skew J, odd dimensions too."""
    n = draw(st.sampled_from(dims))
    names = tuple(f"x{i + 1}" for i in range(n))
    exponents = [e for e in product(range(4), repeat=n) if (sum(e) == 3 if homogeneous else sum(e) <= 3)]
    small = rationals(4)
    H = ring(names).from_dict({e: c for e in exponents if (c := draw(small)) != 0})
    if standard:
        return CubicHamiltonian(H, standard_structure(n))
    J = fmpq_mat(n, n)
    for i in range(n):
        for j in range(i):
            J[i, j] = draw(small)
            J[j, i] = -J[i, j]
    return CubicHamiltonian(H, J)


F = FunctionField(["x", "y", "z"], 10**9)


def true_size(polynomial: fmpq_mpoly) -> tuple[int, float]:
    """The degree, and log2 of the sum of the absolute coefficients, of a polynomial with integer coefficients."""
    assert all(coefficient.q == 1 for coefficient in polynomial.coeffs())
    total = sum(abs(int(coefficient.p)) for coefficient in polynomial.coeffs())
    return max((int(sum(monomial)) for monomial in polynomial.monoms()), default=0), math.log2(total) if total else 0.0


def primitive(polynomial: fmpq_mpoly) -> fmpq_mpoly:
    """The multiple with coprime integer coefficients."""
    denominator = math.lcm(*(int(coefficient.q) for coefficient in polynomial.coeffs()))
    content = math.gcd(*(int((coefficient * denominator).p) for coefficient in polynomial.coeffs()))
    return polynomial * fmpq(denominator, content or 1)


def lowest(function):
    """Numerator and denominator in lowest terms, coefficients coprime integers."""
    common = function.numerator.gcd(function.denominator)
    return primitive(function.numerator / common), primitive(function.denominator / common)


def covers(bound, function):
    """Whether the bound of a rational function is one: degrees of numerator and denominator in lowest terms."""
    numerator, denominator = lowest(function)
    return true_size(numerator)[0] <= bound.numerator.degree and true_size(denominator)[0] <= bound.pole_degree


def covers_polynomial(size: CoefficientSize, polynomial: fmpq_mpoly) -> bool:
    degree, bits = true_size(polynomial)
    return degree <= size.degree and bits <= size.bits + 1e-6


@st.composite
def polynomials(draw):
    """A polynomial in x, y, z with small integer coefficients, as an element of F."""
    monomials = st.tuples(*[st.integers(0, 2)] * 3)
    terms = draw(st.dictionaries(monomials, st.integers(-9, 9).filter(bool), max_size=4))
    total = F.zero
    for exponents, coefficient in terms.items():
        factors = (variable for variable, exponent in zip(F.variables, exponents, strict=True) for _ in range(exponent))
        total = total + math.prod(factors, start=F.convert(coefficient))
    return total


def numerator(element):
    assert element.denominator == 1
    return element.numerator


def written(identity):
    """Both sides over rational functions: pairs of elements, [] where they swell or have no values."""
    field = FunctionField([*(f"x{i + 1}" for i in range(identity.dim)), "e"], 2_000_000)
    eps = field.variables[-1] if identity.eps is None else field.convert(identity.eps)
    try:
        sides = identity.at(field, field.variables[:-1], eps)
    except BudgetExceeded:
        return []
    return [] if sides is None else list(zip(*sides, strict=True))


def differences(identity):
    """Numerator and denominator, in lowest terms, of the difference of the sides in each entry that differs."""
    results = (left - right for left, right in written(identity))
    return [lowest(difference) for difference in results if not difference.numerator.is_zero()]


def check(identity, *, differs=False):
    """Put the bound of an identity to the test; its sides have to differ where `differs` says so.

    The numerator of their difference in lowest terms divides the polynomial that is bounded: degrees compare directly,
    and coefficients by Gelfond's inequality, by which those of a factor are at most 2^degree times as large.
    """
    equation, poles = identity.bound
    result = differences(identity)
    assert bool(result) or not differs
    for numerator, denominator in result:
        assert true_size(numerator)[0] <= equation.degree
        assert true_size(numerator)[1] <= equation.bits + equation.degree
        assert sum(true_size(factor)[0] for factor, _ in denominator.factor_squarefree()[1]) <= poles
    return equation, poles
