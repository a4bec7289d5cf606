"""What may be passed to the functions of `import kahanmaps`, and what they refuse, in which words."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import sympy
from flint import fmpq

import kahanmaps as km
from kahanmaps.algebra.duals import DualField  # noqa: F401  # named in a row of REFUSED
from kahanmaps.algebra.fields import rational
from kahanmaps.errors import InexactNumber, InputError
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
    root = (1 + sympy.sqrt(5)) / 2
    for text, symbol in zip(step, (x1, y1), strict=True):
        difference = sympy.sympify(text.replace("^", "**")).subs(t, root) - by_hand[symbol].subs(
            sympy.GoldenRatio, root
        )
        assert sympy.simplify(difference) == 0
    assert km.orbit(km.System({x: y, y: sympy.GoldenRatio * x - x**2}), [1, 2], "1/10", 1)[1].text == step
    for text, number in (("sqrt(2)", sympy.sqrt(2)), ("-sqrt(2/9)", -sympy.sqrt(2) / 3), ("sqrt(-1)", sympy.I)):
        assert km.load("euler_top", a1=text) == km.load("euler_top", a1=number)


INTEGERS = [np.int64(3), np.uint8(3), np.array(3), np.array(3, dtype=object), fmpq(3), "3", np.str_("3")]
NO_NUMBERS = [
    (True, "found True, expected a number"),
    (np.True_, "found True, expected a number"),
    (np.array([3]), r"found array\(\[3\]\) of numpy, expected one exact number"),
    (np.timedelta64(3, "s"), "of numpy, expected one exact number"),
    *(
        (value, "found the floating-point number 3.*expected an exact one")
        for value in (3.0, np.float32(3), np.array(3.0))
    ),
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
        with pytest.raises(InputError, match=words):
            use(value)


COUNTS = {
    "steps": lambda value: len(km.orbit("weierstrass", [1, 2], "1/10", value)) - 1,
    "every": lambda value: km.orbit("weierstrass", [1, 2], "1/10", 3, every=value)[1].step,
    "a step of at": lambda value: km.orbit("weierstrass", [1, 2], "1/10", at=[value])[0].step,
    "max_terms": lambda value: len(km.degrees("weierstrass", max_terms=value).degrees) - 1,
    "degree": lambda value: km.darboux_polynomials("weierstrass", value).degree,
    "the power": lambda value: (km.map("weierstrass", "1/10") ** value == km.map("weierstrass", "1/10") ** 3) * 3,
    "the modulus": lambda value: km.GF(value).characteristic,
    "prime": lambda value: km.cycles("x' = y; y' = x - x^2", "1/5", value).prime,
    "m": lambda value: km.random_member(value, 1).m,
    "the seed": lambda value: (
        3 * (km.random_member_with_eigenvalues([1, 2], value) == km.random_member_with_eigenvalues([1, 2], 3))
    ),
    "an entry": lambda value: 3 if km.find_recurrence([value, 6, 12, 24, 48, 96]).rate.text == "2" else 0,
}


@pytest.mark.parametrize("name", COUNTS)
def test_counts_are_integers_of_any_library_but_no_booleans_and_floats(name):
    for value in (3, np.int64(3), np.uint8(3), np.array(3)):
        assert COUNTS[name](value) == 3
    for value in (True, np.True_, np.array(True), 3.0, np.float64(3), np.array(3.0), np.array([3]), "3"):
        with pytest.raises(InputError, match=f"found {name} = .*, expected an integer"):
            COUNTS[name](value)


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
    with pytest.raises(InputError, match="found eps and time_step"):
        OF_EPS[name](eps=1, time_step=2)


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
km.period("x' = 2*x*y; y' = -x^2 - y^2", [1, 2], "1/10").status
km.period("paper_m2", [1, 2, 0, 1], time_step="1/5", prime=10007).period
km.geometry("paper_m2", [1, 2, 3, 5], time_step="1/5").planes[0].rotations
km.ensemble("henon_heiles", np.full((5, 4), 0.1), "1/20", 50, kernel="numpy").x
km.ensemble("euler_top", [[1, 2, 3]], time_step="1/5", steps=3, kernel="numpy").x
km.ensemble(system="euler_top", starts=[[1, 2, 3]], eps="1/10", steps=3, kernel="numpy").x
km.FloatEnsemble("euler_top", "1/10", [[1, 2, 3]])
km.load("euler_top", a1="root of t^2 - 2")
km.load("lv(5,1)")
km.load("euler_top").save("top.toml")
km.orbit("euler_top", "1,2,3", "1/10", 3)
km.orbit("euler_top", np.array([1, 2, 3]), "1/10", 3, arithmetic="mod:101")
km.orbit("euler_top", start=[1, 2, 3], eps="1/10", steps=3).to_csv("o.csv")
str(km.check_integrals("euler_top")), km.check_integrals("euler_top").rows()
km.check_commute("x' = y; y' = x^2", "x' = 2*y; y' = 2*x^2")
str(km.find_integrals("weierstrass")), km.find_integrals("weierstrass").rows()
km.find_symmetry("euler_top"), km.find_commuting("euler_top"), km.constant_structures("euler_top")
km.affine_darboux("lorenz"), km.affine_integrals("lorenz"), km.tensor_structure("lorenz")
km.find_family_structure_of("henon_heiles"), km.system_normal_form("paper_m2"), km.equivalent_system("lorenz")
km.convert("euler_top", "latex")
km.certificate("harmonic", "gp")
km.load("euler_top").at("1/10")([1, 2, 3]) == km.load("euler_top")("1/10")([1, 2, 3])
km.map("euler_top", time_step="1/5") @ km.map("lorenz", "1/10")
np.array(km.map("euler_top", "1/10")([1, 2, 3]), dtype=float)
km.map("lyness")([1, 2])
km.lyapunov("lorenz", [[1, 2, 3], [1, 1, 1]], eps="1/100", steps=10)
km.plot.degrees(km.degrees("euler_top", max_terms=4))
km.plot.heights(km.heights("weierstrass", "1/10"))
km.plot.orbit(km.orbit("euler_top", [1, 2, 3], "1/10", 20))
km.plot.portrait("lotka_volterra", [1, 2], "1/10", 20)
km.portrait("lotka_volterra", [[1, 2], [1, 3]], time_step="1/10", steps=20)
km.latex_polynomial(km.load("euler_top").system.rhs[0])
""".strip().splitlines()


@pytest.mark.parametrize("expression", EXPRESSIONS)
def test_what_one_writes_works(expression, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    eval(expression, {"km": km, "np": np})


REFUSED = [
    *((f"km.{name}(3)", "found a int, expected a name of the catalogue") for name in ("analyze", "find_symmetry")),
    ("km.degrees(None)", "found a NoneType, expected a name"),
    ('km.degrees("nosuch")', "found the unknown system 'nosuch'"),
    ("km.degrees(\"x' = y^3; y' = x\")", "degree 3"),
    ("km.degrees(phi)", "a map at one eps, expected what it was made of"),
    ("km.degrees(FISH, effort=99)", "found the effort 99, expected an integer from -20 to 40"),
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
    ('km.load("euler_top", a1="sqrt(4)")', "expected an irreducible"),
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
    ("km.normal_form(FISH)", "expected a member of the family"),
    ('km.orbit_period(FISH, "1/10", [1, 0], 101)', "expected a normal form"),
    ('km.period("lorenz", [1, 2, 3], "1/10")', "found no normal form"),
    ("km.flow_and_map(FISH)", "km.find_integrals"),
    ("km.height(5)", "expected the coordinates"),
    ('km.System("x\' = a*x", a=sympy.pi)', "found pi, expected a rational or an algebraic number"),
    ("km.System(\"x' = a*x\", a='1 + sqrt(2)')", r"root of t\^2 - 2"),
    ('km.System("x\' = a*x")', r"System\(..., NAME=VALUE\)"),
    ("km.System({x: sympy.sqrt(3) * y, y: sympy.sqrt(2) * x})", "found sqrt.* is the value of a parameter"),
    ("km.System([sympy.Eq(X, Y)])", "expected a first derivative on the left"),
    ("km.System(None)", "found a NoneType, expected equations"),
    ("km.System([y, x])", "2 right-hand sides without variables"),
    ('km.check_integrals("weierstrass", x, y)', "expected Settings as second argument"),
    ('km.check_poisson("weierstrass", 5)', "expected a matrix of formulas"),
    ("km.check_measure(FISH)", 'extra="EXPRESSION"'),
    ("np.array(km.orbit(FISH, [1, 2], '1/10', 2, arithmetic='ball:64'))", 'use arithmetic="float"'),
]


@pytest.mark.parametrize(("expression", "words"), REFUSED)
def test_what_does_not_work_says_what_does(expression, words):
    with pytest.raises(InputError, match=words):
        eval(expression, {**globals(), "phi": km.map(FISH, "1/5")})


@pytest.mark.parametrize("given", [0.5, np.float64(0.5)])
def test_floats_are_refused_inside_of_formulas(given):
    for make in (
        lambda: km.System("x' = y; y' = a*x", a=given),
        lambda: km.System({x: y, y: given * x**2}),
        lambda: km.check_integrals("weierstrass", given * x),
    ):
        with pytest.raises(InexactNumber, match=r"found the floating-point number 0\.5"):
            make()
