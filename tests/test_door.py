"""What stands for a map in the functions of `import kahanmaps`, and numbers of other libraries."""

import sys
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from flint import arb, fmpq

import kahanmaps as km
from kahanmaps.algebra.fields import rational
from kahanmaps.errors import InputError
from kahanmaps.laboratory.growth.degrees import degree_growth

WEIERSTRASS = "x' = y; y' = 6*x^2 - 2"


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
            assert [one.text for one in km.find_density(given).densities] == ["12*x*eps^2 - 1"]


@pytest.mark.parametrize(
    "given",
    [
        (WEIERSTRASS,),
        ({"x": "y", "y": "6*x^2 - 2"},),
        (["y", "6*x**2 - 2"], "x y"),
        (["y", "6*x**2 - 2"], "x, y"),
        (["y", "6*x**2 - 2"], ["x", "y"]),
    ],
)
def test_a_system_is_written_in_many_ways(given):
    assert km.System(*given).system == km.load("weierstrass").system


def test_expressions_and_numbers_of_sympy_are_read():
    sympy = pytest.importorskip("sympy")
    x, y, a = sympy.symbols("x y a")
    made = km.System({x: y, y: a * x**2 - 2}, a=sympy.Rational(12, 2))
    assert made.system == km.load("weierstrass").system
    assert rational(sympy.Rational(2, 6)) == fmpq(1, 3)


def test_numbers_of_other_libraries_are_exact_or_refused():
    assert rational(np.int64(7)) == rational(Fraction(14, 2)) == 7
    for value in (0.5, np.float64(0.5), Decimal("0.5"), True):
        with pytest.raises(InputError):
            rational(value)


INTEGERS = [np.int64(3), np.uint8(3), np.array(3), np.array(3, dtype=object), fmpq(3), "3", np.str_("3")]
NO_NUMBERS = [
    (True, "found True, expected a number"),
    (np.True_, "found True, expected a number"),
    (np.array(True), "found True, expected a number"),
    (np.array([3]), r"found array\(\[3\]\) of numpy, expected one exact number"),
    (np.timedelta64(3, "s"), "of numpy, expected one exact number"),
    *((value, "found the machine number 3.*expected an exact one") for value in (3.0, np.float32(3), np.array(3.0))),
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
    "degree": lambda value: km.darboux_polynomials("weierstrass", value, seconds=9).degree,
    "the power": lambda value: (km.map("weierstrass", "1/10") ** value == km.map("weierstrass", "1/10") ** 3) * 3,
    "the modulus": lambda value: km.GF(value).characteristic,
    "prime": lambda value: km.cycles("x' = y; y' = x - x^2", "1/5", value).prime,
    "m": lambda value: km.draw_generic(value, 1).m,
    "the seed": lambda value: (
        3 if km.draw_with_eigenvalues([1, 2], value).A == km.draw_with_eigenvalues([1, 2], 3).A else 0
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
    with pytest.raises(InputError, match=r"found at = 3, expected a sequence of steps, at=\[3\]"):
        km.orbit("weierstrass", [1, 2], "1/10", at=3)


def test_the_time_step_is_twice_eps():
    points = [[p.text for p in km.orbit("weierstrass", [1, 2], *eps, steps=2, **step)] for eps, step in STEPS]
    assert points[0] == points[1] == points[2]
    assert km.check_integrals("weierstrass", time_step="1/5").to_json()["eps"] == "1/10"
    for eps, step in ((("1/10",), {"time_step": "1/5"}), ((), {"eps": 1, "time_step": 2})):
        with pytest.raises(InputError, match="found eps and time_step"):
            km.orbit("weierstrass", [1, 2], *eps, steps=2, **step)


STEPS = [(("1/10",), {}), ((), {"time_step": "1/5"}), ((), {"eps": Fraction(1, 10)})]


def test_the_names_are_those_of_the_commands():
    for name in ("degrees", "heights", "cycles", "find_density", "find_commuting", "find_symmetry", "lyapunov"):
        assert name in km.__all__
    assert km.degrees.__doc__ == km.degree_growth.__doc__ == degree_growth.__doc__


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (3, "found a int, expected a name of the catalogue"),
        ("nosuch", "found the unknown system 'nosuch'"),
        ("x' = y^3; y' = x", "degree 3"),
        (None, "found a NoneType, expected a name"),
    ],
)
def test_what_stands_for_no_map_is_refused(given, words):
    for function in (km.analyze, km.degrees, km.find_symmetry):
        with pytest.raises(InputError, match=words):
            function(given)


def test_maps_are_called_and_composed():
    phi = km.KahanMap(km.load("euler_top").system, "1/10")
    psi = km.KahanMap(km.load("lorenz").system, "1/10")
    x = phi.point([1, 2, 3])
    assert (phi @ psi)(x) == phi(psi(x)) != psi(phi(x)) == (psi @ phi)(x)
    assert (phi**3)(x) == phi(phi(phi(x)))
    assert (phi**-2)((phi**2)(x)) == x == (phi**-1 @ phi)(x)
    assert phi.inverse()(phi(x)) == phi.inverse(phi(x)) == x
    identity = phi**0
    assert identity(x) == identity.inverse(x) == x != phi(x)
    assert (phi @ identity)(x) == phi(x)
    assert identity.determinant(x) == 1
    with pytest.raises(InputError, match="one dimension"):
        phi @ km.KahanMap(km.load("weierstrass").system, "1/10")
    with pytest.raises(TypeError):
        phi @ 3


# What a user of Python writes without having read much, one expression a line.
EXPRESSIONS = """
km.period("x' = 2*x*y; y' = -x^2 - y^2", [1, 2], "1/10").status
km.period("paper_m2", [1, 2, 0, 1], time_step="1/5", prime=10007).period
km.ensemble("henon_heiles", np.full((5, 4), 0.1), "1/20", 50).x
km.ensemble("euler_top", [[1, 2, 3]], time_step="1/5", steps=3, kernel="numpy").x
km.degrees("euler_top", max_terms=4)
km.degrees("euler_top", "1/10", max_terms=4)
km.degrees("euler_top", eps="1/10", max_terms=4)
km.degrees("euler_top", time_step="1/5", max_terms=4)
km.degrees(km.load("euler_top"), max_terms=4).degrees
km.degrees("x' = y; y' = 6*x^2 - 2", max_terms=4)
km.degrees("euler_top", max_terms=4).to_json()
km.degrees("euler_top", max_terms=4).rows()
str(km.degrees("euler_top", max_terms=4))
km.names()
km.load("euler_top")
km.load("euler_top", a1=2)
km.load("euler_top", a1="2/3")
km.load("euler_top", a1=Fraction(2, 3))
km.load("euler_top", a1="root of t^2 - 2")
km.load("lv(5,1)")
km.load("euler_top").system
km.load("euler_top").map
km.load("euler_top").integrals
km.load("euler_top").to_toml()
print(km.load("euler_top").map)
km.System("x' = y; y' = a*x^2", a=Fraction(1, 2))
km.System("x' = y; y' = a*x^2", a=np.int64(3))
km.System("x' = y; y' = a*x^2", a="1/2")
km.System(["y", "x^2"], ["x", "y"])
km.System({"x": "y", "y": "x^2"})
km.orbit("euler_top", [1, 2, 3], "1/10", 3)
km.orbit("euler_top", (1, 2, 3), eps="1/10", steps=3)
km.orbit("euler_top", "1,2,3", "1/10", 3)
km.orbit("euler_top", np.array([1, 2, 3]), "1/10", 3)
list(km.orbit("euler_top", [1, 2, 3], "1/10", 3))
[p.x for p in km.orbit("euler_top", [1, 2, 3], Fraction(1, 10), 3)]
[p.text for p in km.orbit("euler_top", [1, 2, 3], time_step="1/5", steps=3)]
km.orbit("euler_top", [1, 2, 3], "1/10", 3, arithmetic="float")
km.orbit("euler_top", [1, 2, 3], "1/10", 3, arithmetic="mod:101")
km.check_integrals("euler_top")
km.check_integrals("euler_top", eps="1/10").verdict
km.check_integrals("euler_top").holds
km.check_integrals("euler_top").rows()
str(km.check_integrals("euler_top"))
km.check_measure("euler_top")
km.check_poisson("henon_heiles")
km.check_commute("euler_top", "euler_top")
km.check_commute("x' = y; y' = x^2", "x' = 2*y; y' = 2*x^2")
km.find_integrals("weierstrass").integrals[0].text
km.find_integrals("weierstrass").rows()
str(km.find_integrals("weierstrass"))
km.find_density("euler_top").densities[0].text
str(km.find_density("weierstrass"))
km.find_symmetry("euler_top")
km.find_commuting("euler_top")
km.cycles("weierstrass", eps="1/10", prime=11)
km.heights("weierstrass", "1/10", seconds=2)
km.singularities("weierstrass", "1/10")
km.convert("euler_top", "sage")
km.Kahan(km.load("euler_top").system)
km.KahanMap(km.load("euler_top").system, "1/10")([1, 2, 3])
km.KahanMap(km.load("euler_top").system, "1/10") ** -2
km.load("euler_top").at("1/10")([1, 2, 3])
km.load("euler_top")("1/10")
km.load("euler_top").at(Fraction(1, 10)).inverse
km.load("euler_top").rhs
km.load("euler_top").dim
km.load("euler_top").parameters
km.load("euler_top").save("top.toml")
km.map("euler_top", eps="1/10")([1, 2, 3])
km.map("euler_top", "1/10") ** -2
km.map("euler_top", time_step="1/5") @ km.map("lorenz", "1/10")
np.array(km.map("euler_top", "1/10")([1, 2, 3]), dtype=float)
km.map("lyness")([1, 2])
len(km.orbit("euler_top", [1, 2, 3], "1/10", 3))
km.orbit("euler_top", [1, 2, 3], "1/10", 3)[2].x
km.orbit("euler_top", [1, 2, 3], "1/10", 3)[-1].text
km.orbit("euler_top", [1, 2, 3], "1/10", 3)[1:3]
float(km.orbit("euler_top", [1, 2, 3], "1/10", 3)[1].x[0])
np.asarray(km.orbit("euler_top", [1, 2, 3], "1/10", 3))
np.array(km.orbit("euler_top", [1, 2, 3], "1/10", 3, arithmetic="float"))
km.orbit("euler_top", [1, 2, 3], "1/10", 3).rows()
km.orbit("euler_top", [1, 2, 3], "1/10", 3).to_csv("o.csv")
km.orbit("euler_top", start=[1, 2, 3], eps="1/10", steps=3).end
km.cycles("weierstrass", 11, eps="1/10").lengths
km.cycles("weierstrass", "1/10", 11)
km.lyapunov("lorenz", [1, 2, 3], "1/100", 10).mean
km.lyapunov("lorenz", [[1, 2, 3], [1, 1, 1]], eps="1/100", steps=10)
km.singularities("weierstrass", eps="1/10")
km.verify(m=1)
km.analyze("weierstrass", seconds=2).conclusion.sentence
km.heights("weierstrass", "1/10", starts=[[1, 2]], seconds=2).kind
km.find_poisson("weierstrass", 1)
km.convert("euler_top", "latex")
km.plot.degrees(km.degrees("euler_top", max_terms=4))
km.plot.heights(km.heights("weierstrass", "1/10", seconds=2))
km.plot.orbit(km.orbit("euler_top", [1, 2, 3], "1/10", 20))
km.plot.portrait("lotka_volterra", [1, 2], "1/10", 20)
km.portrait("lotka_volterra", eps="1/20", steps=20)
km.portrait("lotka_volterra", [[1, 2], [1, 3]], "1/20", steps=20)
km.latex_polynomial(km.load("euler_top").system.rhs[0])
km.parse_point("1/2,3")
""".strip().splitlines()


@pytest.mark.parametrize("expression", EXPRESSIONS)
def test_what_one_writes_works(expression, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    eval(expression, {"km": km, "np": np, "Fraction": Fraction})


@pytest.mark.parametrize(
    ("expression", "words"),
    [
        ('km.orbit("euler_top", [1, 2, 3], 0.1, 5)', 'e.g. "0.1"'),
        ('km.KahanMap("euler_top", "1/10")', r"km.load\(...\).system is one"),
        ('km.plot.degrees("euler_top")', r"km.plot.degrees\(km.degrees"),
        ('km.plot.heights("euler_top")', r"km.plot.heights\(km.heights"),
        ('km.find_integral("euler_top")', "did you mean find_integrals"),
        ('km.load("euler_top")()', 'found no eps, expected an exact number such as "1/10"'),
        ('km.map("euler_top")', "euler_top depends on it"),
        ('km.orbit("euler_top", [1, 2, 3], "1/10")', "expected a number of steps"),
        ('km.cycles("weierstrass", 11, 13, eps="1/10")', "several values|multiple values|two values"),
        ("km.verify()", "expected a member of the family, or m"),
        ('np.array(km.orbit("euler_top", [1, 2, 3], "1/10", 2, arithmetic="ball:64"))', 'take arithmetic="float"'),
    ],
)
def test_what_does_not_work_says_what_does(expression, words):
    with pytest.raises((InputError, AttributeError, TypeError), match=words):
        eval(expression, {"km": km, "np": np})


def test_degrees_are_drawn_on_axes_and_refuted_claims_are_rows():
    axes = km.plot.degrees(km.degrees("euler_top", max_terms=5))
    assert axes.get_xlabel() == "iterate $n$"
    wrong = km.parse_rational_function("x1", ["x1", "x2", "x3", "eps"])
    rows = km.check_integrals("euler_top", extra={"I": wrong}).rows()
    assert [row["verdict"] for row in rows] == ["refuted"]


def test_points_of_an_orbit_are_the_same_however_one_asks():
    once = [point.x for point in km.orbit("euler_top", [1, 2, 3], "1/10", 5)]
    walk = km.orbit("euler_top", [1, 2, 3], "1/10", 5)
    assert len(walk) == 6
    assert [point.x for point in walk] == [walk[k].x for k in range(6)] == once
    assert walk.end.status == "completed"
    for kind in ("exact", "float", "mod:101"):
        walk = km.orbit("euler_top", [1, 2, 3], "1/10", 5, arithmetic=kind)
        assert np.asarray(walk).shape == (6, 3)
        assert [row["step"] for row in walk.rows()] == list(range(6))
    assert np.asarray(walk).tolist() == [[row[name] for name in walk.variables] for row in walk.rows()]
    table = np.asarray(km.orbit("euler_top", [1, 2, 3], "1/10", 5))
    assert table[1] == pytest.approx([65 / 37, 10 / 37, 125 / 37])
    field = km.load("euler_top", a1="root of t^2 - 2")
    with pytest.raises(InputError, match='arithmetic="float"'):
        np.asarray(km.orbit(field, [1, 2, 3], "1/10", 2))


@pytest.mark.parametrize("prime", [101, 2**53 + 5, 2**61 - 1, 2**127 - 1])
def test_arrays_of_residues_are_exact_or_refused(prime):
    walk = km.orbit("euler_top", [1, 2, 3], "1/10", 5, arithmetic=f"mod:{prime}")
    rows = [[int(x) for x in point.x] for point in walk]
    assert max(map(max, rows)) > prime // 2
    table = np.asarray(walk)
    assert table.dtype == (np.int64 if prime < 2**63 else object)
    assert table.tolist() == np.asarray(walk, dtype=object).tolist() == rows
    assert all(type(x) is int for x in np.asarray(walk, dtype=object).flat)
    for kind in (np.int64, np.uint64, np.int16, np.uint8):
        if max(map(max, rows)) <= np.iinfo(kind).max:
            assert np.asarray(walk, dtype=kind).tolist() == rows
        else:
            with pytest.raises(InputError, match=r"found the coordinate \d+.*, expected integers.*take dtype=object"):
                np.asarray(walk, dtype=kind)
    if prime < 2**53:
        assert np.asarray(walk, dtype=float).tolist() == rows
    else:
        with pytest.raises(InputError, match=f"rounds residues modulo {prime}, expected dtype=int or dtype=object"):
            np.asarray(walk, dtype=float)


def test_arrays_of_objects_have_the_coordinates_of_the_points():
    for arithmetic, kind in (("exact", fmpq), ("float", float), ("ball:64", arb)):
        walk = km.orbit("euler_top", [1, 2, 3], "1/10", 5, arithmetic=arithmetic)
        table = np.asarray(walk, dtype=object)
        assert table.shape == (6, 3)
        assert [tuple(map(repr, row)) for row in table] == [tuple(map(repr, point.x)) for point in walk]
        assert all(type(x) is kind for x in table.flat)
    field = km.load("euler_top", a1="root of t^2 - 2")
    walk = km.orbit(field, [1, 2, 3], "1/10", 2)
    assert [tuple(row) for row in np.asarray(walk, dtype=object)] == [point.x for point in walk]


def test_arrays_of_integers_are_exact_or_refused():
    grows = km.orbit("x' = x; y' = 0", [1, 5], 1 / fmpq(3), 70)  # x~ = 2 x
    assert np.asarray(grows, dtype=object)[70, 0] == 2**70
    for steps, kind in ((62, np.int64), (63, np.uint64), (6, np.int8)):
        assert np.asarray(km.orbit("x' = x; y' = 0", [1, 5], "1/3", steps), dtype=kind)[-1].tolist() == [2**steps, 5]
        with pytest.raises(InputError, match=f"found the coordinate {2 ** (steps + 1)}, expected integers"):
            np.asarray(km.orbit("x' = x; y' = 0", [1, 5], "1/3", steps + 1), dtype=kind)
    with pytest.raises(InputError, match="found the coordinate -1, expected integers from 0"):
        np.asarray(km.orbit("x' = x; y' = 0", [-1, 5], "1/3", 1), dtype=np.uint64)
    words = {"exact": "the coordinate 65/37", "float": r"the coordinate 1\.756\d*", "ball:64": "ball:64 arithmetic"}
    for arithmetic, found in words.items():
        with pytest.raises(InputError, match=f"found {found}, expected .*take .*dtype=object"):
            np.asarray(km.orbit("euler_top", [1, 2, 3], "1/10", 1, arithmetic=arithmetic), dtype=int)
    floats = km.orbit("x' = x; y' = 0", [1, 5], "1/3", 0, arithmetic="float")
    assert np.asarray(floats, dtype=int).tolist() == [[1, 5]]
    with pytest.raises(InputError, match="found the dtype bool, expected one of floats or integers, or object"):
        np.asarray(grows, dtype=bool)
    assert np.asarray(grows, dtype=np.float32).dtype == np.float32
    assert np.asarray(grows, dtype=complex)[2].tolist() == [4, 5]
    with pytest.raises(ValueError, match="expected copy=None"):
        np.array(grows, copy=False)


def test_a_table_of_pandas_is_made_of_the_rows(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "pandas", SimpleNamespace(DataFrame=list))
    walk, found = km.orbit("euler_top", [1, 2, 3], "1/10", 2), km.degrees("weierstrass", max_terms=2)
    assert walk.to_pandas() == walk.rows()
    assert found.to_pandas() == found.rows()
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(InputError, match="pip install pandas"):
        found.to_pandas()
    walk.to_csv(tmp_path / "o.csv")
    assert (tmp_path / "o.csv").read_text().splitlines()[:2] == ["step,x1,x2,x3", "0,1,2,3"]
