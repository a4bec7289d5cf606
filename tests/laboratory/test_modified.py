"""The modified vector field: closed forms, B-series coefficients, an independent recursion, and what survives."""

from fractions import Fraction
from itertools import product

import pytest
from flint import fmpq
from helpers import refuses

from kahanmaps import QuadraticSystem, System, load, parse_polynomial
from kahanmaps.algebra.polynomials import gradient
from kahanmaps.laboratory.vector_field.modified import modified, modified_fields, modified_hamiltonian

# H = x^3/3 + x^2 y - x y^2 + 2/3 y^3 + x^2/2 + 3/2 y^2 - 2 y
PLANAR = "x' = x^2 - 2*x*y + 2*y^2 + 3*y - 2; y' = -x^2 - 2*x*y + y^2 - x"


def along(vector, function):
    return sum((v * d for v, d in zip(vector, gradient(function), strict=True)), 0 * function)


def test_linear_and_riccati_equations_have_known_series():
    def series(text, order=8):
        return [str(f) for (f,) in modified_fields(QuadraticSystem.from_text(["x"], [text]), order)]

    # x~ = (1 + eps)/(1 - eps) x is the flow of artanh(eps)/eps x; a Riccati equation without linear term is of the form
    # x' = x^2, whose map is its flow.
    assert series("x") == ["x", "0", "1/3*x", "0", "1/5*x", "0", "1/7*x", "0", "1/9*x"]
    assert series("x^2") == ["x^2", *8 * ["0"]]


def test_the_first_term_is_that_of_the_runge_kutta_method():
    # Kahan's method is the Runge-Kutta method with these coefficients (cmoq-2013, section 2); the term of h^2 in the
    # modified field of a method of order 2 is sum (weight - 1/gamma)/sigma over the trees with three vertices.
    b = [Fraction(-1, 2), 2, Fraction(-1, 2)]
    A = [[0, 0, 0], [Fraction(-1, 4), 1, Fraction(-1, 4)], b]
    c = [sum(row) for row in A]
    chain = sum(b[i] * A[i][j] * c[j] for i, j in product(range(3), repeat=2)) - Fraction(1, 6)
    bush = (sum(b[i] * c[i] ** 2 for i in range(3)) - Fraction(1, 3)) / 2
    assert (chain, bush) == (Fraction(1, 12), Fraction(-1, 6))
    for name in ("henon_heiles", "lorenz", "euler_top"):
        f = load(name).system.rhs
        derivative = [along(f, p) for p in f]  # f'f
        chains = [along(derivative, p) for p in f]  # f'f'f
        bushes = [along(f, p) - q for p, q in zip(derivative, chains, strict=True)]  # f''(f, f)
        # 4 times, as h = 2 eps
        expected = [fmpq(1, 3) * p - fmpq(2, 3) * q for p, q in zip(chains, bushes, strict=True)]
        assert list(modified_fields(load(name).system, 2)[2]) == expected


@pytest.mark.slow
def test_the_series_of_a_planar_cubic_agrees_with_an_independent_recursion():
    sympy = pytest.importorskip("sympy")
    x, y, e = sympy.symbols("x y e")
    f = sympy.Matrix([x**2 - 2 * x * y + 2 * y**2 + 3 * y - 2, -(x**2) - 2 * x * y + y**2 - x])
    image = sympy.Matrix([x, y]) + 2 * e * (sympy.eye(2) - e * f.jacobian([x, y])).LUsolve(f)
    mapped = [sympy.series(sympy.cancel(entry), e, 0, 6).removeO() for entry in image]
    # Picard's iteration for the flow of f + e^2 F2 + e^4 F4 at time 2 e, with unknown polynomials replaced one by one:
    # the difference of the map and the flow without F_k is 2 e^(k+1) F_k + higher terms.
    field = list(f)

    def flow():
        current, terms = [x, y], [x, y]
        for k in range(1, 6):
            current = [
                sympy.expand(sum(sympy.diff(entry, v) * w for v, w in zip((x, y), field, strict=True)))
                for entry in current
            ]
            current = [sum(entry.coeff(e, p) * e**p for p in range(6 - k)) for entry in current]
            terms = [t + (2 * e) ** k / sympy.factorial(k) * c for t, c in zip(terms, current, strict=True)]
        return [sympy.expand(t) for t in terms]

    for k in range(1, 5):
        rest = [sympy.expand(m - t).coeff(e, k + 1) / 2 for m, t in zip(mapped, flow(), strict=True)]
        field = [sympy.expand(g + e**k * r) for g, r in zip(field, rest, strict=True)]
    found = modified(PLANAR, 4).fields
    for k in range(1, 5):
        for component, polynomial in zip(field, found[k], strict=True):
            assert sympy.expand(component.coeff(e, k) - sympy.sympify(str(polynomial).replace("^", "**"))) == 0


def test_fields_are_tangent_to_the_modified_hamiltonian_which_is_that_of_the_theorem():
    for name in ("planar_cubic_hamiltonian", "henon_heiles", "paper_m2", "three_wave"):
        file = load(name)
        H, F = modified_hamiltonian(file.hamiltonian, 6), modified_fields(file.system, 6)
        for n in range(7):
            terms = [along(F[k], H[n - k]) for k in range(n + 1)]
            assert sum(terms[1:], terms[0]).is_zero()
        assert all(term.is_zero() for term in H[1::2])
        assert not along(F[2], H[0]).is_zero()  # the control: H itself is lost at eps^2


@pytest.mark.parametrize(("name", "order"), [("euler_top", 6), ("volterra_periodic_4", 4), ("weierstrass", 6)])
def test_integrals_of_integrable_maps_survive(name, order):
    result = modified(name, order)
    assert len(result.integrals) == load(name).dim - 1
    for found in result.integrals:
        assert (found.verdict, found.order) == ("survives", order)
        series = [found.integral, *found.corrections]
        for n in range(order // 2 + 1):
            total = [along(result.fields[2 * k], series[n - k]) for k in range(n + 1)]
            assert sum(total[1:], total[0]).is_zero()


def test_integrals_are_lost_where_the_map_is_not_integrable():
    # At c = -6 the flow of Henon and Heiles has a second integral, of degree 4; of the map modified H alone is left.
    kept, lost = sorted(modified(load("henon_heiles", {"c": -6}), 2).integrals, key=lambda i: i.integral.total_degree())
    assert (kept.verdict, lost.verdict) == ("survives", "lost")
    assert (kept.integral.total_degree(), lost.integral.total_degree()) == (3, 4)
    assert (lost.order, lost.corrections) == (0, ())
    assert lost.sentence == f"lost at eps^2: no polynomial correction of degree <= {lost.degree}"


def test_what_is_not_a_quadratic_system_or_an_order_is_refused():
    refuses("found the order 3, expected an even number from 2 to 12", modified, "harmonic", 3)
    refuses("found the order 14", modified, "harmonic", 14)
    refuses("lyness is of kind", modified, "lyness")
    assert modified(System("x' = a*x", a="1/2"), 2).fields[2] == (parse_polynomial("x/24", ["x"]),)
