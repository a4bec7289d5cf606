"""What may be passed to the functions of `import kahanmaps`, and what they refuse, in which words."""

import subprocess
import sys
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import sympy
from command_tree import all_commands
from flint import fmpq, fmpq_mat
from helpers import refuses

import kahanmaps as km
from kahanmaps.algebra.duals import DualField  # noqa: F401  # named in a row of REFUSED
from kahanmaps.algebra.fields import rational
from kahanmaps.errors import InexactNumber
from kahanmaps.laboratory.growth.degrees import degree_growth

WEIERSTRASS = "x' = y; y' = 6*x^2 - 2"
FISH = "q' = p; p' = q^2 - q"
PREY = "x' = x*(1 - y); y' = y*(x - 2)"
x, y, t, a = sympy.symbols("x y t a")
X, Y = sympy.Function("x")(t), sympy.Function("y")(t)


@pytest.fixture
def path(tmp_path) -> Path:
    file = tmp_path / "mine.toml"
    file.write_text(km.load("weierstrass").to_toml())
    return file


def test_all_that_stands_for_a_map_gives_the_same(path):
    file = km.load("weierstrass")
    known = degree_growth(file.map, max_terms=3).degrees
    for given in (file, file.system, file.map, "weierstrass", path, str(path), WEIERSTRASS, km.System(WEIERSTRASS)):
        assert km.degrees(given, max_terms=3).degrees == known
        if given is not file.map:
            assert [density.text for density in km.find_density(given).densities] == ["12*x*eps^2 - 1"]
            assert km.fixed_points(given) == km.fixed_points(file.system)


def test_members_of_the_family_stand_for_their_maps():
    member = km.random_member_with_eigenvalues([2, -3], seed=1)
    f, g = member.associate([1, 1]), member.associate([1, -1])
    assert km.check_commute(f, g).verdict is km.Certainty.PROVED
    assert km.check_commute(f, km.System("x' = y; y' = x; z' = w; w' = x^2")).verdict is km.Certainty.REFUTED
    assert km.map(f, "1/10")([1, 0, 2, 0]) == km.map(f.hamiltonian, "1/10")([1, 0, 2, 0])
    assert km.map(member, "1/10")([1, 0, 2, 0]) == km.KahanMap(member.chosen.system, "1/10")([1, 0, 2, 0])


@pytest.mark.parametrize(
    "given",
    [
        (WEIERSTRASS,),
        ({"x": "y", "y": "6*x^2 - 2"},),
        (["y", "6*x**2 - 2"], "x y"),
        (["y", "6*x**2 - 2"], "x, y"),
        (["y", "6*x**2 - 2"], ["x", "y"]),
        ({x: y, y: 6 * x**2 - 2},),
        ([sympy.Eq(X.diff(t), Y), sympy.Eq(Y.diff(t), 6 * X**2 - 2)],),
        (sympy.Matrix([y, 6 * x**2 - 2]), [x, y]),
    ],
)
def test_a_system_is_written_in_many_ways(given):
    assert km.System(*given).system == km.load("weierstrass").system


@pytest.mark.parametrize("value", [6, "6", Fraction(6), np.int64(6), sympy.Rational(12, 2), fmpq(6)])
def test_parameters_are_exact_numbers_of_any_library(value):
    assert km.System({x: y, y: a * x**2 - 2}, a=value).system == km.load("weierstrass").system
    assert rational(value) == 6


def test_algebraic_numbers_of_sympy_are_parameters():
    step = km.orbit(km.System("x' = y; y' = r*x - x^2", r=sympy.GoldenRatio), [1, 2], "1/10", 1)[1].text
    x1, y1 = sympy.symbols("x1 y1")
    law = [(x1 - 1) * 5 - (y1 + 2) / 2, (y1 - 2) * 5 - (sympy.GoldenRatio * (1 + x1) / 2 - x1)]
    by_hand = sympy.solve(law, [x1, y1])
    values = {t: (1 + sympy.sqrt(5)) / 2, sympy.GoldenRatio: (1 + sympy.sqrt(5)) / 2}
    for text, symbol in zip(step, (x1, y1), strict=True):
        difference = sympy.sympify(text.replace("^", "**")) - by_hand[symbol]
        assert sympy.simplify(difference.subs(values)) == 0
    assert km.orbit(km.System({x: y, y: sympy.GoldenRatio * x - x**2}), [1, 2], "1/10", 1)[1].text == step
    for text, number in (("sqrt(2)", sympy.sqrt(2)), ("-sqrt(2/9)", -sympy.sqrt(2) / 3), ("sqrt(-1)", sympy.I)):
        assert km.load("euler_top", a1=text) == km.load("euler_top", a1=number)


INTEGERS = [np.int64(3), np.uint8(3), np.array(3), np.array(3, dtype=object), fmpq(3), "3", np.str_("3")]
NO_NUMBERS = [
    (True, "found True, expected a number"),
    (np.True_, "found True, expected a number"),
    (np.array([3]), r"found array\(\[3\]\) of numpy, expected one exact number"),
    (np.timedelta64(3, "s"), "of numpy, expected one exact number"),
    *((x, "found the floating-point number 3.*expected an exact one") for x in (3.0, np.float32(3), np.array(3.0))),
]
EXACT = {
    "rational numbers": lambda value: km.QQ.convert(value),
    "residues": lambda value: int(km.GF(101).convert(value)),
    "eps": lambda value: km.KahanMap(km.load("weierstrass").system, value).eps,
    "a point": lambda value: km.orbit("weierstrass", [value, 2], "1/10", 1)[0].x[0],
    "a parameter": lambda value: km.System({"x": "a*y", "y": "x"}, a=value).system.rhs[0].leading_coefficient(),
    "a right-hand side": lambda value: km.System([value, "x"], "x y").system.rhs[0].leading_coefficient(),
}


@pytest.mark.parametrize("use", EXACT.values(), ids=EXACT)
def test_integers_of_numpy_are_exact_numbers_and_booleans_and_floats_are_not(use):
    for value in INTEGERS:
        assert use(value) == 3
    for value, words in NO_NUMBERS:
        refuses(words, use, value)


COUNTS = {
    "steps": lambda value: len(km.orbit("weierstrass", [1, 2], "1/10", value)) - 1,
    "every": lambda value: km.orbit("weierstrass", [1, 2], "1/10", 3, every=value)[1].step,
    "a step of at": lambda value: km.orbit("weierstrass", [1, 2], "1/10", at=[value])[0].step,
    "max_terms": lambda value: len(km.degrees("weierstrass", max_terms=value).degrees) - 1,
    "max_degree": lambda value: km.darboux_polynomials("weierstrass", value).degree,
    "the power": lambda value: (km.map("weierstrass", "1/10") ** value == km.map("weierstrass", "1/10") ** 3) * 3,
    "the modulus": lambda value: km.GF(value).characteristic,
    "prime": lambda value: km.cycles("x' = y; y' = x - x^2", "1/5", value).prime,
    "m": lambda value: km.random_member(value, 1).m,
    "the seed": lambda value: 3 * (km.random_member(2, value) == km.random_member(2, 3)),
    "an entry": lambda value: 3 if km.find_recurrence([value, 6, 12, 24, 48, 96]).rate.text == "2" else 0,
}


@pytest.mark.parametrize("name", COUNTS)
def test_counts_are_integers_of_any_library_but_no_booleans_and_floats(name):
    for value in (3, np.int64(3), np.uint8(3), np.array(3)):
        assert COUNTS[name](value) == 3
    for value in (True, np.True_, np.array(True), 3.0, np.float64(3), np.array(3.0), np.array([3]), "3"):
        refuses(f"found {name} = .*, expected an integer", COUNTS[name], value)


# Functions of eps; each takes the time step in its place.
OF_EPS = {
    "analyze": lambda **eps: km.analyze("riccati", **eps).to_json()["eps"],
    "check_integrals": lambda **eps: km.check_integrals("weierstrass", **eps).to_json()["eps"],
    "check_measure": lambda **eps: km.check_measure("weierstrass", "12*x*eps^2 - 1", **eps).to_json()["eps"],
    "check_poisson": lambda **eps: km.check_poisson("henon_heiles", **eps).to_json()["eps"],
    "check_commute": lambda **eps: km.check_commute("euler_top", "lorenz", **eps).to_json()["eps"],
    "cycles": lambda **eps: km.cycles("weierstrass", prime=11, **eps).to_json()["eps"],
    "darboux_polynomials": lambda **eps: str(km.darboux_polynomials("weierstrass", 1, **eps).eps),
    "degrees": lambda **eps: km.degrees("weierstrass", max_terms=2, **eps).to_json()["eps"],
    "find_density": lambda **eps: str(km.find_density("weierstrass", **eps).eps),
    "find_integrals": lambda **eps: str(km.find_integrals("weierstrass", **eps).eps),
    "find_poisson": lambda **eps: str(km.find_poisson("weierstrass", 1, **eps).eps),
    "heights": lambda **eps: str(km.heights("weierstrass", starts=1, steps=9, **eps).orbits[0].eps),
    "map": lambda **eps: str(km.map("weierstrass", **eps).eps),
    "orbit": lambda **eps: km.orbit("weierstrass", [1, 2], steps=2, **eps).header()["eps"],
    "singularities": lambda **eps: str(km.singularities("weierstrass", **eps).eps),
}


@pytest.mark.parametrize("name", OF_EPS)
def test_the_time_step_is_twice_eps(name):
    assert OF_EPS[name](eps="1/10") == OF_EPS[name](time_step="1/5") == "1/10"
    refuses("found eps and time_step", OF_EPS[name], eps=1, time_step=2)


def test_claims_are_text_or_expressions_by_name_or_without():
    energy = y**2 / 2 + x**2 / 2 - x**3 / 3
    fish = km.System({x: y, y: x**2 - x})
    for claim in (energy, str(energy), [energy], {"H": energy}):
        assert km.check_integrals(fish, claim).verdict is km.Certainty.REFUTED
        assert km.check_integrals(fish, claim, eps="1/5").verdict is km.Certainty.REFUTED
    [result] = km.find_integrals(fish).integrals
    for claim in (result.text, sympy.sympify(result.text), [result.text]):
        assert km.check_integrals(fish, extra=claim).verdict is km.Certainty.PROVED
    assert [km.check_measure(PREY, phi).verdict.value for phi in (x * y, "x*y + 1")] == ["proved", "refuted"]
    canonical = sympy.Matrix([[0, x * y], [-x * y, 0]])
    for tensor, verdict in ((canonical, "proved"), ([["0", "1"], ["-1", "0"]], "refuted")):
        assert str(km.check_poisson(PREY, tensor).verdict) == verdict


def test_orbits_go_over_every_field_that_has_numbers_to_print():
    K = km.load("euler_top", a1="root of t^2 - 2").map.root.number_field
    start = [K.generator, 2]
    walk = km.orbit(FISH, start, "1/10", 2, arithmetic=K)
    over = km.System(FISH).map.at("1/10", K)
    assert walk[2].x == over.step(over.step(start))
    assert (str(walk.arithmetic), walk.header()["start"]) == ("exact", ["t", "2"])
    for field, kind in [(km.QQ, "exact"), (km.GF(101), "mod:101"), (km.RR(64), "ball:64"), (km.CC(64), "ball:64")]:
        walk = km.orbit(FISH, [1, 2], "1/10", 2, arithmetic=field)
        assert (str(walk.arithmetic), walk[0].field) == (kind, field)


# What a user of Python writes without having read much.
EXPRESSIONS = """
km.period("paper_m2", [1, 2, 0, 1], time_step="1/5", prime=10007).period
km.period("paper_m2", "1, 2, 0, 1", "1/10^2").status, km.map("euler_top", "1/10^6")("1, 2, 1/3^2")
km.ensemble("henon_heiles", np.full((5, 4), 0.1), "1/20", 50, kernel="numpy").x
km.ensemble(system="euler_top", starts=[[1, 2, 3]], eps="1/10", steps=3, kernel="numpy").x
km.load("euler_top").save("top.toml")
km.orbit("euler_top", np.array([1, 2, 3]), "1/10", 3, arithmetic="mod:101")
km.orbit("euler_top", start=[1, 2, 3], eps="1/10", steps=3).to_csv("o.csv")
km.load("euler_top").at("1/10")([1, 2, 3]) == km.load("euler_top")("1/10")([1, 2, 3])
km.degrees(km.map("weierstrass", "1/10"), max_terms=3).degrees, km.analyze(km.map("harmonic", "1/10") ** 2).integrable
km.plot.degrees(km.degrees("euler_top", max_terms=4))
km.plot.heights(km.heights("weierstrass", "1/10"))
km.plot.orbit(km.orbit("euler_top", [1, 2, 3], "1/10", 20))
km.plot.portrait("lotka_volterra", [1, 2], "1/10", 20)
km.orbit("euler-top", x0=[1, 2, 3], h="1/5", n=5, exact=True)[1:3]
km.orbit("euler_top", fmpq_mat(3, 1, [1, 2, 3]), Decimal("0.1"), 3)["x1"]
km.orbit("euler_top", sympy.Matrix([1, 2, sympy.Rational(1, 3)]), sympy.Rational(1, 10), 3).t
km.orbit("euler_top", [1, 2, 3], "1/10", 5).plot()
km.orbit("euler_top", [1, 2, 3], "1/10", 5).save("o.npz")
km.lyapunov("lorenz", x0=[1, 1, 1], h=0.01, n=10)
km.plot("euler_top", x0=[1, 0.5, 0.2], h=0.1, n=20)
km.plot(km.degrees("euler_top", max_terms=3))
km.compare("euler_top", x0=[1, 0.5, 0.25], h=0.1, n=100, methods=["kahan", "rk4"])
km.plot.rotation("nahm_tetrahedral", ["1/10", "1/5"], [2, 3], eps="1/10", points=5)
km.plot.section("euler_top", "x1=0", x0=[-0.1, 1, 1], eps="1/10", n=500)
km.plot.escape("henon_heiles", eps="1/20", window=[[-1, 1], [-1, 1]], n=20, cells=4, show="basin")
km.plot.commute("paper_m2", x0=["1/2", "-1/3", 0, 1], eps="1/50")
km.plot.invariant_curves("paper_m2", x0=["1/2", "-1/3", 0, 1], eps="1/10", n=50)
km.load("lotka_volterra").plot(eps=0.05, n=20)
km.System({"x": "a*y", "y": "x"}, {"a": 2}) == km.System({"x": "a*y", "y": "x"}, params={"a": 2})
km.System({"x": "a*y", "y": "x"}, a=2).subs({sympy.Symbol("a"): sympy.Rational(1, 3)}).parameters
km.load("euler_top").latex(), km.load("euler_top").to_sympy(), km.load("euler_top").dimension
km.load("euler_top").kahan(h="1/5").orbit([1, 2, 3], 5), km.load("euler_top").kahan("1/10").latex()
km.check_integrals("weierstrass", km.find_integrals("weierstrass")[0]).holds and None
km.check_integrals("weierstrass", km.find_integrals("weierstrass")).rows()
km.check_measure("weierstrass", km.find_density("weierstrass")[0]).rows()
km.check_poisson("weierstrass", km.find_poisson("weierstrass")[0]).rows()
km.geometry("paper_m2", x0=[1, 2, 0, 1], h="1/5"), km.period("paper_m2", x0=[1, 2, 0, 1], h="1/5", prime=101)
km.find_density("lotka_volterra")[0](1, 2, "1/10"), km.invariant_measure("lotka_volterra")
km.systems()["lorenz"], km.systems("euler_top", a1=2), km.catalogue().rows()[0], print(km.catalogue())
km.family(m=2, seed=1).system, km.family.new(chi="t^2 - 2", seed=1), km.family.associated("paper_m3")
km.family.space("paper_m2"), km.family.show("paper_m2"), km.family.tensor("lorenz", "t^2 - 2")
km.batch.tasks()
km.scan("lotka_volterra", over="a", terms=2, primes=[11, 13, 17])
km.find_integrals("euler_top", symbols="a1, a2").symbols
km.report(km.check_integrals("euler_top"), "r.html", pictures=False)[:9]
km.KahanMap(km.load("euler_top"), h="1/5")([1, 2, 3])
""".strip().splitlines()


@pytest.mark.parametrize("expression", EXPRESSIONS)
def test_what_one_writes_works(expression, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    eval(expression, {"km": km, "np": np, "sympy": sympy, "fmpq_mat": fmpq_mat, "Decimal": Decimal})


REFUSED = [
    *((f"km.{name}(3)", "found a int, expected a name of the catalogue") for name in ("analyze", "find_symmetry")),
    ("km.degrees(None)", "found a NoneType, expected a name"),
    ("km.degrees(km.System(FISH).map.at(1, km.GF(101)))", "expected a map over the rational numbers"),
    ('km.orbit("euler_top", [1, 2, 3], 0.1, 5)', 'e.g. "0.1"'),
    ('km.orbit("euler_top", [1, 2, 3], "1/10")', "expected either steps="),
    ('km.orbit(FISH, [1, 2], "1/10", at=3)', r"found at = 3, expected a sequence of steps, at=\[3\]"),
    ('km.orbit(FISH, None, "1/5", 2)', "found the initial point None"),
    ('km.orbit(FISH, [0.5, 1], "1/5", 2)', "found the floating-point number"),
    ('km.orbit(FISH, [float("nan"), 0.0], "1/5", 3, arithmetic="float")', "expected finite numbers"),
    ('km.orbit(FISH, [1, 2], "1/5", 2, arithmetic=complex)', "expected exact, float"),
    ('km.orbit(FISH, [1, 2], "1/5", 2, arithmetic=DualField(km.QQ))', r"found the arithmetic DualField\(QQ\)"),
    ('km.orbit(FISH, [1, 2], "1/10", arithmetic=km.CC(64), at=[2])', r"orbits over CC\(64\) are computed step by step"),
    ('km.orbit(phi, [1, 2], "1/5", 3)', "has a fixed eps and field"),
    ('km.load("euler_top")()', 'found no eps, expected an exact number such as "1/10"'),
    ("km.load(None)", "found a NoneType, expected the name"),
    ('km.load("euler_top", a1=sympy.pi)', "found pi, expected"),
    ('km.map("euler_top")', "euler_top depends on it"),
    ("phi(None)", "expected 2: q, p"),
    ("phi ** 0.5", "expected an integer"),
    ("km.verify()", "expected a member of the family, or m"),
    ('km.plot.degrees("euler_top")', r"km.plot.degrees\(km.degrees"),
    ('km.plot.heights("euler_top")', r"km.plot.heights\(km.heights"),
    ("km.plot.orbit(5)", r"km\.plot\.orbit\(km\.orbit"),
    ('km.portrait(FISH, [1, 2], "1/5", 9, axes=(0, 5))', "numbers below 2"),
    ('km.lyapunov(FISH, ["a", 1], "1/5", 9)', "found 'a'"),
    ('km.lyapunov(FISH, [[1, 2], [1]], "1/5", 9)', "different lengths"),
    ("km.report_html(km.degrees(FISH, max_terms=2))", "found DegreeGrowth, expected an Analysis"),
    ("km.report_html('text')", "expected an Analysis"),
    ("km.normal_form(FISH)", "expected a member of the family"),
    ('km.orbit_period(FISH, "1/10", [1, 0], 101)', "expected a normal form"),
    ('km.period("lorenz", [1, 2, 3], "1/10")', "found no normal form"),
    ("km.flow_and_map(FISH)", "km.find_integrals"),
    ("km.height(5)", "expected the coordinates"),
    ('km.System("x\' = a*x", a=sympy.pi)', "found pi, expected a rational or an algebraic number"),
    ('km.System("x\' = a*x")', r"System\(..., NAME=VALUE\)"),
    ("km.System({x: sympy.sqrt(3) * y, y: sympy.sqrt(2) * x})", "found sqrt.* is the value of a parameter"),
    ("km.System([sympy.Eq(X, Y)])", "expected a first derivative on the left"),
    ("km.System(None)", "expected either equations, km.System"),
    ("km.System([y, x])", "2 right-hand sides without variables"),
    ('km.check_integrals("weierstrass", x, y)', "expected Settings as second argument"),
    ('km.check_poisson("weierstrass", 5)', "expected a matrix of formulas"),
    ("km.check_measure(FISH)", 'extra="EXPRESSION"'),
    ("np.array(km.orbit(FISH, [1, 2], '1/10', 2, arithmetic='ball:64'))", 'use arithmetic="float"'),
    ("km.orbit(FISH, [1, 2], eps=0.1, n=5)", 'e.g. "0.1"; or exact=False'),
    ("km.orbit(FISH, x0=[0.5, 2], eps='1/10', n=5)", "exact=False, for an orbit in floating point"),
    ("km.orbit(FISH, [1, 2], n=5)", 'eps="1/10" or h="1/5"'),
    ("km.orbit(FISH, [1, 2], '1/10', 5, x0=[1, 2])", "found start and x0"),
    ("km.orbit(FISH, [1, 2], h='1/5', eps='1/10', n=5)", "found eps and h"),
    ("km.orbit(FISH, [1, 2], '1/10', 5, exact=True, arithmetic='float')", "expected one of them"),
    ("km.orbit(FISH, [1, 2], '1/10', 5, exact='no')", "found exact = 'no', expected True or False"),
    ("km.orbit(FISH, {'q': 1}, '1/10', 5)", "found the coordinates q, expected q, p"),
    ("km.orbit(FISH, [1, 2], h='1/5', t_max=5)", r"no argument t_max=: n= is the number of steps"),
    ("km.orbit(FISH, [1, 2], '1/10', 5)['z']", "found the variable 'z', expected one of q, p"),
    ("km.degrees(FISH, seconds=3)", r"no argument seconds=: with km.time_limit\(10\)"),
    ("km.find_integrals(FISH, degree=2)", "max_degree= is the largest degree"),
    ("km.find_integrals(FISH, max_degree='2')", "found max_degree = '2', expected an integer"),
    ("km.analyze(FISH, 2)", "km.analyze: too many positional arguments; its arguments are system, symbols"),
    ("km.ensemble(FISH, [[1, 2]], '1/10', 3, dtype=float)", "km.ensemble has no argument dtype="),
    ("km.family(over=3)", "km.family has no argument over="),
    ("km.family()", "expected m=3, eigenvalues"),
    ("km.batch(['euler_top'])", r"type \[km.analyze"),
    ("km.systems()['euler-topp']", "did you mean euler_top"),
    ("phi([0.5, 1])", r"numpy.array\(\[...\]\) gives floats"),
    ("km.geometry('paper_m2', eps='1/10')", "found no initial point or no eps"),
    ("phi.jacobian(np.ones(2))", r"\[Fraction\(x\) for x in point\] is exact"),
    ("km.analyze(['weierstrass', 'lorenz'])", r"type \[f\(system\) for system in systems\]"),
    ("km.degrees(FISH, N=5)", "max_terms= is the number of iterates"),
    ("km.check_integrals('weierstrass', seed=3)", r"settings=km.Settings\(seed=3\)"),
    ("km.bilinear_map(['x'], ['X - x = x*X'])", "expected polynomials"),
    ("phi(np.ones((2, 3)))", "expected rows of 2 numbers"),
    ("km.System(FISH).f(0, np.ones(2))", "found two arguments, expected the point alone"),
    ("km.System(FISH)(np.ones(2))", r"system.at\(eps\)\(x\)"),
    ("km.cycles(FISH, prime=101)", 'found None, expected an exact number, e.g. eps="1/10"'),
    ("km.compare(FISH, x0=[1, 2])", "expected eps= or h="),
    ("km.load('lyness').kahan('1/10')", "expected a quadratic vector field"),
    ("km.orbit(FISH, [1, 2], '1/10', 4).plot(ax=1)", "km.plot.orbit has no argument ax=.*it has trajectory, x, y"),
    ("km.System(FISH).plot(eps='1/10', figsize=3)", "km.portrait has no argument figsize=.*axes are returned"),
    ('km.plot.portrait("euler_top", dt=1)', "h= is the time step"),
    ("km.certificate(FISH)", 'checker= is "sympy", "gp" or "rocq"'),
    ("km.fixed_points(FISH, eps=1)", "leave it out"),
    ('km.check_integrals(FISH, integral="q")', "extra= is the claim"),
    ('km.orbit(FISH, [1, 2], "1/10", 4, kernel="cuda")', "found the kernel 'cuda', expected numpy or numba"),
    ("km.catalogue()[:3]", "found slice.*expected a name"),
    ("phi({2, 1})", r"found the point \{1, 2\}, expected a sequence of 2 coordinates"),
    ("km.analyze('weierstrass', analyses=['degrees'])", r"found analyses = \['degrees'\], expected steps of kahanmaps"),
    ("km.explicit_map([], [])", "found no variables"),
    ('km.composed_map([km.load("lyness").map])', "expected maps for every eps"),
    ('km.composed_map(km.load("lyness").map, 5)', "found '5', expected maps for every eps"),
    ('km.composed_map(km.load("lyness").map, (km.load("lyness").map, 2.5))', "the power"),
    ('km.compare(FISH, eps="1/20", methods=5, steps=10)', "found methods = 5, expected a list such as"),
    ('km.compare(FISH, eps="1/20", methods="kahan", steps=10)', "found methods = 'kahan', expected a list"),
    ('km.certificate(FISH, "gp", claims="volume")', r"expected a list: claims=\['volume'\]"),
    ('km.plot.escape("riccati", eps="1/10")', "found 1 variable, expected at least 2"),
    ('km.orbit(FISH, [1, 2], "1/10", 3, max_digits=0)', "found a budget of 0 digits"),
    ('km.heights("mcmillan", "1,2")', "found '1,2', expected an integer, p/q or a decimal"),
    ('km.geometry("paper_m2", [1, 2, 3, 4], 0)', "found eps = 0, expected a nonzero number"),
    ('km.geometry("lyness", [0, 0])', "the map is not defined at step 0"),
    ("km.geometry(\"x' = 1 + x^2\", [0], '1/2')", "the map is not defined at step"),
]


@pytest.mark.parametrize(("expression", "words"), REFUSED)
def test_what_does_not_work_says_what_does(expression, words):
    refuses(words, eval, expression, {**globals(), "phi": km.map(FISH, "1/5")})


# Words of SciPy, SymPy and earlier releases, and what is to be typed instead.
MISSING = [
    ("km.parse", r"type km\.System\("),
    ("km.solve_ivp", r"type km\.orbit\(system, x0, eps, steps\)"),
    ("km.integrals", r"km\.find_integrals\(system\)"),
    ("km.analize", "did you mean analyze"),
    ("km.nothing_like_this", "see docs/howto/python.md"),
    ("km.System(FISH).equilibria", r"type km\.fixed_points\(system\)"),
    ("km.System(FISH).variabels", "did you mean variables"),
    ("phi.lyapunov", r"type km\.lyapunov\(\.\.\.\)"),
    ("phi.degree", r"km\.degrees\(system\)"),
    ("phi.invers", "did you mean inverse"),
    ("km.orbit(FISH, [1, 2], '1/10', 2).y", "orbit.x, an array"),
    ("km.degrees(FISH, max_terms=2).degreees", "did you mean degrees"),
    ("km.find_integrals('weierstrass')[0].subs", r"I\(x, eps\) for a value"),
    ("km.orbit(FISH, [1, 2], '1/10', 2).end.success", "orbit.end.is_complete"),
    ("km.analyze('riccati', analyses=()).is_integrable", r"km.analyze\(system\).integrable"),
    ("km.map('lyness').eigenvalues", "see docs/howto/python.md"),
    ("km.explicit_map(['x'], ['1/x']).inverse", r'map.at\("1/10"\).inverse'),
    ("km.plot.scatter", "'Plot' object has no attribute 'scatter'"),
    ("km.batch.runn", "did you mean run"),
]


@pytest.mark.parametrize(("expression", "words"), MISSING)
def test_a_missing_name_is_answered_with_what_to_type(expression, words):
    refuses(words, eval, expression, {**globals(), "phi": km.map(FISH, "1/5")}, error=AttributeError)


def test_protocols_are_asked_for_in_vain_without_a_hint():
    for value in (km.System(FISH), km.map(FISH, "1/5"), km.degrees(FISH, max_terms=2)):
        assert not hasattr(value, "_ipython_display_")
        assert not hasattr(value, "__array_interface__")


def test_each_command_has_its_function_or_its_group_of_functions():
    for words, _ in all_commands():
        names = words.replace("-", "_").split()
        if words in ("", "completion", "version"):  # of the command line alone; km.__version__
            continue
        value = km
        for name in names:
            value = getattr(value, name)
        assert callable(value), words
        assert names[0] in dir(km) or names[0] == "plot"


@pytest.mark.parametrize("given", [0.5, np.float64(0.5)])
def test_floats_are_refused_inside_of_formulas(given):
    for make in (
        lambda: km.System("x' = y; y' = a*x", a=given),
        lambda: km.System({x: y, y: given * x**2}),
        lambda: km.check_integrals("weierstrass", given * x),
    ):
        refuses(r"found the floating-point number 0\.5", make, error=InexactNumber)


def test_names_that_the_command_line_loads_do_not_replace_public_ones():
    code = (
        "import kahanmaps as km; from kahanmaps import internals; raw = internals.analyze; internals.format_of\n"
        "print(km.analyze is raw, km.analyze.__wrapped__ is raw, 'format_of' in vars(km), internals.analyze is raw)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False True False True\n"
