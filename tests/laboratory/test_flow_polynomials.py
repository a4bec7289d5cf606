"""Darboux polynomials of a flow, found with no cofactor given: known ones, and none where there are none."""

import random

import pytest
from search_helpers import system

from kahanmaps import find_integrals, flow_and_map, load, parse_polynomial, parse_rational_function
from kahanmaps.algebra.polynomials import monomials, primitive_part, ring
from kahanmaps.algebra.printing import format_polynomial
from kahanmaps.laboratory.laboratory import flow_preserves
from kahanmaps.laboratory.preserve.darboux.affine_functions import darboux_cofactor
from kahanmaps.laboratory.preserve.limit import flow_polynomials as searched
from kahanmaps.laboratory.preserve.limit.flow_polynomials import flow_polynomials
from kahanmaps.systems.polynomial import PolynomialField


def field(variables, *rhs):
    return PolynomialField(tuple(parse_polynomial(text, variables.split()) for text in rhs))


def lorenz(s, r, b):
    return load("lorenz", {"s": s, "r": r, "b": b})


def found_in(given, degree, seed=0):
    """The polynomials, and the degree up to which these are all."""
    polynomials = flow_polynomials(given, degree, seed=seed)
    return [format_polynomial(P) for P in polynomials.functions], polynomials.degree


@pytest.mark.parametrize(
    ("s", "r", "b", "known"),
    [
        ("10", "28", "20", ["x^2 - 20*z"]),  # b = 2 s
        ("10", "0", "1", ["y^2 + z^2"]),  # irreducible over Q, two conjugate planes
        ("1", "3", "1", ["3*x^2 - y^2 - z^2"]),  # b = s = 1: r x^2 - y^2 - z^2
        ("10", "28", "19", []),  # next to b = 2 s
    ],
)
def test_the_quadrics_of_the_lorenz_system_are_found(s, r, b, known):
    """The classical cases with an integral that depends on time, and parameters beside them."""
    assert found_in(lorenz(s, r, b).system, 2) == (known, 2)


def test_affine_integrals_do_not_hide_quadrics():
    """Products of two of x + y - c are at two points of a quadric what it is; at three they are not."""
    P = parse_polynomial("x^2 - y*z + 1", ["x", "y", "z"])
    px, py, pz = (P.derivative(k) for k in range(3))
    rhs = (pz + P, -pz - P, py - px + 2 * P)  # f . grad P is a multiple of P, and x + y is an integral
    made = PolynomialField(rhs)
    assert darboux_cofactor(made, P) is not None
    assert (rhs[0] + rhs[1]).is_zero()
    assert found_in(made, 2) == ([format_polynomial(P)], 2)


def test_a_polynomial_that_does_not_divide_its_derivative_is_none(monkeypatch):
    """Whatever the points modulo a prime say, it is put to the proof."""
    monkeypatch.setattr(searched._Line, "spaces", lambda line: [[[0, 1, *[0] * (line.count - 2)]]])
    assert found_in(field("x y", "y + x^2", "x*y + 1"), 2, 5)[0] == []
    assert found_in(field("x y", "x*y + x^2", "x*y + 1"), 2)[0] == ["x"]


def test_where_solutions_are_algebraic_one_point_is_not_enough():
    """18 of 35 quartics vanish along the solution from a point of P = 0; K = -4/3."""
    known = ["9*x^4 - 12*x^2*z + 24*x^2 - 8*x*y - 4*y^2"]
    assert found_in(lorenz("1/3", "2", "0").system, 4, 1) == (known, 4)


@pytest.mark.parametrize("seed", range(4))
def test_what_a_field_was_made_to_keep_is_found(seed):
    """f = a (P_y, -P_x) + P g is tangent to P = 0 whatever a and g; P is of degree up to 4."""
    rng, context = random.Random(f"made {seed}"), ring(["x", "y"])

    def drawn(degree):
        support = [m for k in range(degree + 1) for m in monomials(2, k)]
        return context.from_dict({m: rng.choice([-3, -2, -1, 1, 2, 3]) for m in support})

    P, a = drawn(1 + seed % 4), drawn(seed % 2)
    made = PolynomialField((P.derivative(1) * a + P * drawn(0), -P.derivative(0) * a + P * drawn(1)))
    found, known_degree = found_in(made, 4, seed)
    assert {format_polynomial(primitive_part(factor)[1]) for factor, _ in P.factor()[1]} <= {*found}
    assert known_degree == 4


def test_nothing_moves_on_a_common_factor():
    """Where it is 0 every polynomial that vanishes at the point does so along its solution."""
    rhs = ["y*(x^2 + y - 1)", "(x + y^2)*(x^2 + y - 1)"]
    assert found_in(field("x y", *rhs), 3)[0] == ["x^2 + y - 1", "2*y^2 + 2*x + 1"]


def test_of_a_pencil_no_member_is_taken_for_a_rational_one():
    """x^2 + y^2 - 1 + c y for every c: that of c = 2 i is a product of lines, and 2 i is a residue modulo primes."""
    known = ["x^2 + y^2 + 2*x + 1", "x^2 + y^2 - 2*x + 1", "y"]  # z = x + i y has z' = z^2 - 1
    for seed in range(3):
        assert sorted(found_in(field("x y", "x^2 - y^2 - 1", "2*x*y"), 3, seed)[0]) == known


def test_a_constant_cofactor_gives_an_integral_that_depends_on_time():
    file = lorenz("10", "28", "20")
    search = find_integrals(file, flow=True, max_degree=2)
    assert [(t.text, str(t.integral.verdict)) for t in search.time_dependent] == [("exp(20*t)*(x^2 - 20*z)", "proved")]
    assert find_integrals(lorenz("10", "28", "19"), flow=True, max_degree=2).time_dependent == ()
    beside = flow_and_map(find_integrals(file, max_degree=2))
    assert ("proved", "Darboux polynomials of the flow, apart from affine ones: x^2 - 20*z") in beside.lines()
    assert ("proved", "T1 = exp(20*t)*(x^2 - 20*z) is a time-dependent integral of the flow") in beside.lines()
    no_other = "no other Darboux polynomials of the flow of degree <= 3 were found except factors of known integrals"
    assert [text for _, text in beside.lines() if text.startswith("no other Darboux")] == [no_other]


@pytest.mark.parametrize(("factor", "kept"), [("-20", True), ("20", False), ("-19", False), ("0", False)])
def test_the_rate_of_what_depends_on_time_is_decided_by_multiplying_out(factor, kept):
    names = ["x", "y", "z", "eps"]
    I, c = (parse_rational_function(text, names) for text in ("x^2 - 20*z", factor))
    assert flow_preserves(lorenz("10", "28", "20").system, I, factor=c) is kept


@pytest.mark.parametrize("scale", [10**5, 10**150])
def test_long_coefficients_are_lifted(scale):
    """The Lorenz system with b = 2 s and z = scale w: x^2 - 20 scale w."""
    rhs = ["10*y - 10*x", f"28*x - y - {scale}*x*w", f"x*y/{scale} - 20*w"]
    assert found_in(field("x y w", *rhs), 2) == ([f"x^2 - {20 * scale}*w"], 2)
    assert flow_polynomials(field("x y w", *rhs), 2).reason == ""


def test_a_degree_is_not_settled_where_something_is_not_lifted(monkeypatch):
    """Two primes, and two digits in their bases, are not enough for 80 digits: the degree is left open."""
    monkeypatch.setattr(searched, "_PRIMES", 2)
    monkeypatch.setattr(searched, "_PRECISION", 2)
    rhs = "10*y - 10*x", f"28*x - y - {10**80}*x*w", f"x*y/{10**80} - 20*w"
    polynomials = flow_polynomials(field("x y w", *rhs), 2)
    assert (polynomials.functions, polynomials.degree) == ((), 1)
    assert polynomials.reason == "1 polynomial of degree 2 modulo a prime not lifted to Q (limit: 2 primes)"
    beside = flow_and_map(find_integrals(system("x y w", *rhs), max_degree=1))
    assert beside.polynomials_degree == 1
    messages = [text for known, text in beside.lines() if known == "undecided" and "Darboux" in text]
    assert messages == [f"Darboux polynomials of the flow of degree 2: {beside.polynomials_reason}"]
    assert "not lifted to Q (limit: 2 primes)" in beside.to_json()["polynomials_reason"]


def test_conjugate_lines_leave_no_degree_open():
    """The 9 lines of paper_m3 but one are those of three cubics."""
    cubic = parse_polynomial("x^3 - 2*y^3", ["x", "y"])
    made = PolynomialField((cubic.derivative(1) - cubic, -cubic.derivative(0) - 3 * cubic))
    for seed in range(2):
        assert found_in(made, 3, seed) == (["x^3 - 2*y^3"], 3)
    assert found_in(load("paper_m3").system, 1) == (["x1 - x5"], 1)
