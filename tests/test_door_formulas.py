"""Formulas and numbers of Python as equations, parameters and claims: exactly, or refused in words."""

from fractions import Fraction

import numpy as np
import pytest

import kahanmaps as km
from kahanmaps.errors import InexactNumber, InputError

sympy = pytest.importorskip("sympy")
x, y, t = sympy.symbols("x y t")
X, Y = sympy.Function("x")(t), sympy.Function("y")(t)
FISH = {x: y, y: x**2 - x}
PREY = "x' = x*(1 - y); y' = y*(x - 2)"


@pytest.mark.parametrize("given", [0.5, np.float64(0.5)])
def test_floats_are_refused_as_values_and_inside_of_formulas(given):
    for make in (
        lambda: km.System("x' = y; y' = a*x", a=given),
        lambda: km.System({x: y, y: given * x**2}),
        lambda: km.System({x: given, y: x}),
        lambda: km.check_integrals("weierstrass", given * x),
    ):
        with pytest.raises(InexactNumber, match=r"found the machine number 0\.5"):
            make()
    assert km.System({x: y, y: Fraction(1, 2)}).rhs == km.System("x' = y; y' = 1/2").rhs


def test_differential_equations_of_sympy_are_systems():
    made = km.System([sympy.Eq(X.diff(t), Y), sympy.Eq(Y.diff(t), X**2 - X)])
    assert made.system == km.System(FISH).system == km.System(sympy.Matrix([y, x**2 - x]), [x, y]).system
    for wrong in (sympy.Eq(X, Y), sympy.Eq(X.diff(t, 2), Y)):
        with pytest.raises(InputError, match="expected a first derivative on the left"):
            km.System([wrong])


def test_algebraic_numbers_of_sympy_are_values_of_parameters():
    golden = km.System("x' = y; y' = r*x - x^2", r=sympy.GoldenRatio)
    step = km.orbit(golden, [1, 2], "1/10", 1)[1].text
    x1, y1 = sympy.symbols("x1 y1")
    law = [(x1 - 1) * 5 - (y1 + 2) / 2, (y1 - 2) * 5 - (sympy.GoldenRatio * (1 + x1) / 2 - x1)]
    by_hand = sympy.solve(law, [x1, y1])
    for text, symbol in zip(step, (x1, y1), strict=True):
        found = sympy.sympify(text.replace("^", "**")).subs(t, (1 + sympy.sqrt(5)) / 2)
        assert sympy.simplify(found - by_hand[symbol].subs(sympy.GoldenRatio, (1 + sympy.sqrt(5)) / 2)) == 0
    inside = km.System({x: y, y: sympy.GoldenRatio * x - x**2})
    assert km.orbit(inside, [1, 2], "1/10", 1)[1].text == step
    for text, number in (("sqrt(2)", sympy.sqrt(2)), ("-sqrt(2/9)", -sympy.sqrt(2) / 3), ("sqrt(-1)", sympy.I)):
        assert km.load("euler_top", a1=text) == km.load("euler_top", a1=number)
    with pytest.raises(InputError, match="expected an irreducible"):
        km.load("euler_top", a1="sqrt(4)")
    assert km.load("euler_top", a1=sympy.sqrt(2)) == km.load("euler_top", a1="root of t^2 - 2 near 1.4")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: km.System({x: sympy.sqrt(3) * y, y: sympy.sqrt(2) * x}), r"found sqrt.* is the value of a parameter"),
        (lambda: km.check_integrals("weierstrass", sympy.sqrt(2) * x), r"found sqrt\(2\) .* is the value"),
        (lambda: km.System({x: y, y: sympy.pi * x}), "found pi, expected a rational or an algebraic"),
        (lambda: km.System("x' = a*x", a=sympy.pi), "found pi, expected a rational or an algebraic number"),
        (lambda: km.load("euler_top", a1=sympy.pi), "found pi, expected"),
        (lambda: km.System("x' = a*x", a="1 + sqrt(2)"), r"root of t\^2 - 2"),
        (lambda: km.System("x' = a*x"), r"System\(..., NAME=VALUE\)"),
        (lambda: km.System(None), "found a NoneType, expected equations"),
        (lambda: km.System([y, x]), "2 right-hand sides without variables"),
        (lambda: km.check_integrals("weierstrass", x, y), "as second and as third"),
        (lambda: km.check_poisson("weierstrass", 5), "expected a matrix of formulas"),
        (lambda: km.check_measure("x' = y; y' = x"), 'extra="EXPRESSION"'),
    ],
)
def test_what_is_no_exact_formula_is_refused_in_words(make, words):
    with pytest.raises(InputError, match=words):
        make()


def test_claims_are_text_or_expressions_by_name_or_without():
    energy = y**2 / 2 + x**2 / 2 - x**3 / 3
    for claim in (energy, str(energy), [energy], {"H": energy}):
        assert km.check_integrals(km.System(FISH), claim).verdict is km.Verdict.REFUTED
        assert km.check_integrals(km.System(FISH), claim, eps="1/5").verdict is km.Verdict.REFUTED
    [found] = km.find_integrals(km.System(FISH)).integrals
    for claim in (found.text, sympy.sympify(found.text), [found.text]):
        assert km.check_integrals(km.System(FISH), extra=claim).verdict is km.Verdict.PROVED
    assert [km.check_measure(PREY, phi).verdict.value for phi in (x * y, "x*y + 1")] == ["proved", "refuted"]
    canonical = sympy.Matrix([[0, x * y], [-x * y, 0]])
    for tensor, verdict in ((canonical, "proved"), ([["0", "1"], ["-1", "0"]], "refuted")):
        assert str(km.check_poisson(PREY, tensor).verdict) == verdict


def test_members_of_the_family_stand_for_maps():
    member = km.draw_with_eigenvalues([2, -3], seed=1)
    f, g = member.associate([1, 1]), member.associate([1, -1])
    assert km.check_commute(f, g).verdict is km.Verdict.PROVED
    assert km.check_commute(f, km.System("x' = y; y' = x; z' = w; w' = x^2")).verdict is km.Verdict.REFUTED
    assert km.map(f, "1/10")([1, 0, 2, 0]) == km.map(f.hamiltonian, "1/10")([1, 0, 2, 0])
    assert km.map(member, "1/10")([1, 0, 2, 0]) == km.KahanMap(member.chosen.system, "1/10")([1, 0, 2, 0])
