"""Values of the library in Python: equal, copied, pickled, shown in short, plain data, arrays."""

import copy
import json
import multiprocessing
import pickle
import re
from concurrent.futures import ProcessPoolExecutor
from fractions import Fraction
from importlib.util import find_spec

import numpy as np
import pytest
from flint import fmpq, fmpq_mat
from helpers import refuses, together

import kahanmaps as km
from kahanmaps.errors import InputError
from kahanmaps.function_calls import _ARGUMENT_HINTS
from kahanmaps.hints import HINTS

FISH = "q' = p; p' = q^2 - q"
DUMP = re.compile(r"\b[A-Z]\w+\(\w+=")  # a dataclass with all its fields: ClassName(field=...)


def test_maps_are_equal_when_their_equations_are():
    phi = km.map(FISH, "1/5")
    assert phi == km.map(FISH, Fraction(1, 5)) == copy.copy(phi)
    assert hash(phi) == hash(km.map(FISH, "1/5"))
    assert phi @ phi == phi**2 != phi
    assert phi**-1 == phi.inverse == km.map(FISH, "-1/5")
    for other in (km.map(FISH, "1/6"), km.map("q' = p; p' = q^2", "1/5"), km.map("x' = y; y' = x^2 - x", "1/5"), 3):
        assert phi != other


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
    with pytest.raises(InputError, match="the same field and dimension"):
        phi @ km.KahanMap(km.load("weierstrass").system, "1/10")
    with pytest.raises(TypeError):
        phi @ 3


def test_a_map_is_shown_with_its_eps_if_it_has_one():
    assert repr(km.map_at("lorenz", eps="1/10")) == "KahanMap(x, y, z; eps=1/10, over QQ)"
    assert repr(km.map_at("lyness")) == "ElementaryMap(x, y; over QQ)"


@pytest.mark.parametrize("again", [copy.deepcopy, lambda value: pickle.loads(pickle.dumps(value))])
def test_systems_maps_and_orbits_are_copied_and_pickled(again):
    for name in ("lorenz", "paper_m3", "lyness", "henon_heiles", "lv(5,1)"):
        file = km.load(name)
        assert again(file) == file
    for reference in (
        "lyness",
        "lotka_volterra_symplectic_euler",
        km.load("lotka_volterra", a="root of t^2 - 2 near 1.4"),
    ):
        phi = km.map(reference, "1/5")
        assert (again(phi), again(phi.inverse), again(phi.inverse).inverse) == (phi, phi.inverse, phi)
        assert again(phi.inverse)(phi([2, 3])) == phi.point([2, 3])
    phi = km.map(FISH, "1/5")
    assert again(phi @ phi) == phi**2
    assert again(phi).field is phi.field
    assert again(km.System(FISH).system) == km.System(FISH).system
    for arithmetic in ("exact", "float", "mod:101", f"mod:{2**127 - 1}", "ball:100"):
        walk = km.orbit(FISH, [1, 2], "1/5", 3, arithmetic=arithmetic)
        assert list(map(repr, again(walk))) == list(map(repr, walk))
    floats = km.ensemble(FISH, [["1/2", "1/3"], [0, "1/4"]], "1/5", 9)
    assert np.array_equal(again(floats).x, floats.x)


@together("name", [*km.__all__, "map", "plot"])
def test_public_names_are_the_same_after_a_pickle(name):
    value = getattr(km, name)
    again = pickle.loads(pickle.dumps(value))
    assert again is value or (isinstance(value, str) and again == value)


RESULTS = {
    "km.System(FISH)": "_repr_html_ _repr_latex_ latex to_sympy",
    "km.System(FISH).system": "_repr_latex_ latex to_sympy",
    "km.System(FISH).map": "_repr_latex_ latex to_sympy",
    "km.map(FISH, '1/10')": "_repr_latex_ latex to_sympy",
    "km.map(FISH, '1/10') ** 2": "_repr_latex_ latex to_sympy",
    "km.explicit_map({'x': 'y', 'y': '(1 + y)/x'}) ** 2": "_repr_latex_ latex to_sympy",
    "km.orbit(FISH, [1, 2], '1/10', 5)": "_repr_html_",
    "km.orbit(FISH, [1, 2], '1/10', 5, exact=False)": "_repr_html_",
    "km.orbit(FISH, [1, 2], '1/10', 5).end": "to_dict to_json",
    "km.lyapunov(FISH, [0.1, 0.2], '1/10', 9)": "to_dict to_json",
    "km.find_integrals(FISH)": "_repr_html_ latex to_sympy to_dict to_json",
    "km.find_integrals(FISH)[0]": "_repr_latex_ latex to_sympy to_dict to_json",
    "km.find_integrals(FISH)[0].function": "_repr_latex_ latex to_sympy",
    "km.find_density(FISH)": "_repr_html_ latex to_sympy to_dict to_json",
    "km.find_density(FISH)[0]": "_repr_latex_ latex to_sympy to_dict to_json",
    "km.find_poisson('weierstrass')": "_repr_html_ latex to_sympy to_dict to_json",
    "km.find_poisson('weierstrass')[0]": "_repr_latex_ latex to_sympy to_dict to_json",
    "km.darboux_polynomials('lotka_volterra', 1)": "_repr_html_ latex to_sympy to_dict to_json",
    "km.darboux_polynomials('lotka_volterra', 1)[0]": "_repr_latex_ latex to_sympy to_dict to_json",
    "km.analyze('riccati')": "_repr_html_ to_dict to_json",
    "km.analyze('riccati').conclusion": "",
    "km.degrees(FISH, max_terms=3)": "_repr_html_ to_dict to_json",
    "km.dynamical_degree('riccati')": "to_dict to_json",
    "km.singularities(FISH)": "_repr_html_ to_dict to_json",
    "km.singularities(FISH).hypersurfaces[0]": "to_dict to_json",
    "km.heights(FISH, '1/10', steps=9)": "_repr_html_ to_dict to_json",
    "km.height_growth(km.map(FISH, '1/10'), [1, 2], 9)": "to_dict to_json",
    "km.cycles(FISH, '1/10', 101)": "_repr_html_ to_dict to_json",
    "km.check_integrals(FISH, 'q')": "_repr_html_ to_dict to_json",
    "km.check_integrals(FISH, 'q').findings[0]": "_repr_html_ to_dict to_json",
    "km.check_integrals(FISH, 'q').findings[0].witness": "to_dict to_json",
    "km.find_symmetry('weierstrass')": "_repr_html_ to_dict to_json",
    "km.find_symmetry('weierstrass').generators[0]": "to_dict to_json",
    "km.find_commuting('weierstrass')": "_repr_html_ to_dict to_json",
    "km.find_commuting('weierstrass').solutions[1]": "to_dict to_json",
    "km.fixed_points('lotka_volterra')": "to_dict to_json",
    "km.fixed_points('lotka_volterra')[0]": "to_dict to_json",
    "km.geometry('paper_m2', [1, 2, 0, 1], '1/10')": "_repr_html_ to_dict to_json",
    "km.period('paper_m2', [1, 2, 0, 1], '1/10')": "_repr_html_ to_dict to_json",
    "km.constant_structures('euler_top')": "_repr_html_ to_dict to_json",
    "km.random_member(2, 1)": "_repr_html_",
    "km.random_member(2, 1).hamiltonians[0]": "_repr_latex_ latex to_sympy",
    "km.affine_darboux('lotka_volterra')": "",
    "km.affine_darboux('lotka_volterra').functions[0]": "",
    "km.system_normal_form('paper_m2')": "",
    "km.system_normal_form('lorenz')": "",
    "km.find_family_structure_of('paper_m2')": "",
    "km.tensor_structure('nahm_tetrahedral')": "",
    "km.catalogue()": "",
}


@together("expression", RESULTS)
def test_a_result_is_one_line_a_formula_or_a_table_and_plain_data(expression):
    value, has = eval(expression, globals()), RESULTS[expression].split()
    line = repr(value)
    for text in (line, str(value)):
        assert not DUMP.search(text), text
    assert "\n" not in line
    assert len(line) < 250
    for name in ("_repr_html_", "_repr_latex_", "latex", "to_sympy", "to_dict", "to_json"):
        if name not in has:
            assert name == "to_dict" or not hasattr(value, name), name
            continue
        result = getattr(value, name)()
        assert result
        assert not DUMP.search(str(result)) or name in ("to_sympy", "latex")
        if name in ("to_dict", "to_json"):
            assert result == value.to_json()
            assert json.loads(json.dumps(result))


def test_functions_and_their_results_go_to_other_processes_and_back():
    """`spawn`, so that the other process imports what it needs by what it is sent."""
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        assert [report.holds for report in pool.map(km.check_integrals, ["euler_top", "volterra_periodic_3"])] == [
            True
        ] * 2
        others = [
            pool.submit(km.check_integrals, "euler_top"),
            pool.submit(km.analyze, "riccati"),
            pool.submit(km.map, FISH, "1/5"),
            pool.submit(km.parse_polynomial, "x + y/2", ("x", "y")),
        ]
        report, analysis, phi, polynomial = (other.result() for other in others)
    assert report.to_json()["claims"] == km.check_integrals("euler_top").to_json()["claims"]
    assert analysis.sections
    assert phi == km.map(FISH, "1/5")
    assert polynomial == km.parse_polynomial("x + y/2", ("x", "y"))


POINTS = np.array([[0.5, 0.25], [-0.75, 1.0], [0.0, 2.0]])


def test_a_field_and_its_jacobian_are_exact_or_arrays():
    fish = km.System("q' = p; p' = a*q^2 - q", a="1/2")
    assert fish.f([2, 3]) == fish.f(2, 3) == fish.f({"q": 2, "p": 3}) == (3, 0)
    assert np.array_equal(fish.f(POINTS), [[p, q * q / 2 - q] for q, p in POINTS])
    assert fish.jacobian([2, 3]).tolist() == [[0, 1], [1, 0]]
    assert [[str(entry) for entry in row] for row in fish.jacobian()] == [["0", "1"], ["q - 1", "0"]]
    assert np.array_equal(fish.jacobian(POINTS), [[[0, 1], [q - 1, 0]] for q, _ in POINTS])
    assert fish.jacobian(POINTS[0]).shape == (2, 2)


FORMS = ([1, 2], (1, 2), np.array([1, 2]), fmpq_mat([[1], [2]]), "1,2", "(1 4/2)", {"p": 2, "q": 1})


@pytest.mark.parametrize("point", FORMS, ids=repr)
def test_every_function_takes_a_point_in_every_form(point):
    homogeneous = "q' = 3*p^2; p' = -3*q^2"
    fish, phi = km.System(FISH), km.map(FISH, "1/10")
    for f in (fish.f, fish.jacobian, fish.system.f, phi, phi.point, phi.jacobian, phi.inverse_step, (phi @ phi).step):
        assert f(point) == f([1, 2]) != f([2, 1])
    for f in (
        lambda x: km.orbit(FISH, x, "1/10", 3).x.tolist(),
        lambda x: phi.orbit(x, 3).x.tolist(),
        lambda x: km.ensemble(FISH, x, "1/10", 3).x.tolist(),
        lambda x: km.lyapunov(FISH, x, "1/10", 9).exponents.tolist(),
        lambda x: km.heights(FISH, "1/10", starts=x, steps=9).orbits[0].growth.to_json(),
        lambda x: km.geometry(homogeneous, x, "1/10").text,
        lambda x: str(km.period(homogeneous, x, "1/10").planes),
        lambda x: [line.get_ydata().tolist() for line in km.portrait(FISH, x, "1/10", 9).lines],
    ):
        assert f(point) == f([1, 2]) != f([2, "1/3"])


def test_wrong_points_are_refused_in_words():
    phi, walk = km.map(FISH, "1/10"), km.orbit(FISH, [1, 2], "1/10", 3)
    for point, words in [
        ("1,2,3", "found a point with 3 coordinates, expected 2: q, p"),
        ({"q": 1, "x": 2}, "found the coordinates q, x, expected q, p"),
        (walk, r"found 4 points, expected one: type \[f\(x\) for x in points\]"),
        ([[1, 2], [3, 4]], r"km.ensemble\(system, x0, eps, steps\)"),
        (5, "found the point 5, expected a sequence of 2 coordinates"),
    ]:
        refuses(words, phi.step, point)
        refuses(words, km.orbit, FISH, point, "1/10", 3)
    refuses("found a point and p=, expected", phi, [1, 2], p=2)
    refuses("found the symbols a", km.QuadraticSystem((km.parse_polynomial("a*x", ["x", "a"]),), ("a",)).f, [1])


def test_a_point_of_an_orbit_is_a_sequence_of_its_coordinates():
    walk, phi = km.orbit(FISH, [1, 2], "1/10", 3), km.map(FISH, "1/10")
    q, p = walk[1]
    assert (q, p) == walk[1].x == phi(walk[0])
    assert len(walk[1]) == 2
    assert walk[1][-1] == p


def test_parameters_are_substituted_and_systems_are_keys():
    fish = km.System("q' = p; p' = a*q^2 - q", a="1/2")
    assert fish.subs(a=3) == fish.with_parameters({"a": 3}) == km.System("q' = p; p' = a*q^2 - q", a=3) != fish
    assert fish.parameters == {"a": fmpq(1, 2)}
    assert {fish: 1, fish.subs(a=3): 2}[km.System("q' = p; p' = a*q^2 - q", a="1/2")] == 1


def test_a_map_takes_arrays_of_floats_and_rounds_what_is_exact():
    phi = km.map(FISH, "1/5")
    before = POINTS.copy()
    exact = [[float(x) for x in phi(list(map(Fraction, point)))] for point in POINTS.tolist()]
    assert np.allclose(phi(POINTS), exact, rtol=1e-15, atol=1e-15)
    assert np.allclose((phi @ phi)(POINTS[1]), phi(phi(POINTS[1])), rtol=1e-15)
    pole = km.map("x' = x^2", "1/2")  # 1 - x is the denominator
    assert np.array_equal(POINTS, before)
    assert np.array_equal(pole(np.array([[0.5], [1.0]])), [[1.0], [np.nan]], equal_nan=True)
    assert phi.h == phi.time_step == fmpq(2, 5)


def test_orbits_have_arrays_times_columns_and_slices():
    exact = km.orbit(FISH, x0=[1, 2], h="1/5", n=4)
    floats = km.orbit(FISH, x0=[1.0, 2], h=0.2, n=4, exact=False)
    assert exact.x.dtype == object
    assert exact.x.tolist() == [list(point.x) for point in exact]
    assert np.allclose(floats.x, np.asarray(exact), rtol=1e-13)
    assert exact["p"].tolist() == [point.x[1] for point in exact]
    assert exact.t.tolist() == [fmpq(k, 5) for k in range(5)]
    assert np.array_equal(floats.t, np.arange(5) * 0.2)
    assert km.orbit(FISH, [1, 2], h="1/5", n=2, backward=True).t.tolist() == [0, fmpq(-1, 5), fmpq(-2, 5)]
    assert km.orbit("lyness", [1, 2], n=2).t.tolist() == [0, 1, 2]
    assert [point.step for point in exact[1:4:2]] == [1, 3]
    assert km.orbit(FISH, {"p": 2, "q": 1}, h="1/5", n=4).x.tolist() == exact.x.tolist()


def test_a_float_stands_for_the_decimal_that_is_printed_in_float_orbits_only():
    for option in ({"eps": 0.1}, {"h": 0.2}, {"eps": np.float64(0.1)}):
        assert km.orbit(FISH, [1, 2], n=3, exact=False, **option).header()["eps"] == "1/10"
        refuses("or exact=False", km.orbit, FISH, [1, 2], n=3, **option)


@pytest.mark.parametrize("arithmetic", ["exact", "float", "mod:101", "ball:64"])
def test_orbits_are_written_to_parquet(arithmetic, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    walk = km.orbit(FISH, [1, 2], "1/10", 5, arithmetic=arithmetic)
    walk.write(tmp_path / "o.parquet")
    table = parquet.read_table(tmp_path / "o.parquet")
    assert table.to_pylist() == walk.rows()
    record = json.loads(table.schema.metadata[b"kahanmaps"])
    assert (record["header"]["eps"], record["end"]["status"]) == ("1/10", walk.end.status)


def test_an_orbit_is_a_dataset_of_xarray(monkeypatch):
    walk = km.orbit(FISH, [1, 2], "1/10", 3)
    if find_spec("xarray") is None:
        refuses("pip install xarray", walk.to_xarray)
        return
    data = walk.to_xarray()
    assert data["q"].values.tolist() == [float(point.x[0]) for point in walk]
    assert data["t"].values.tolist() == [0.0, 0.2, 0.4, 0.6]


def test_integrals_are_called_iterated_and_converted():
    sympy = pytest.importorskip("sympy")
    top, found = km.load("euler_top"), km.find_integrals("euler_top")
    walk = km.orbit(top, [1, 2, 3], "1/10", 4)
    assert repr(found) == "<IntegralSearch: 2 integrals, proved>"
    assert list(found) == [found[0], found[1]] == list(found.integrals)
    for integral in found:
        assert len({integral(point.x, "1/10") for point in walk}) == 1
        assert len({integral(point.x, "1/9") for point in walk}) > 1
        by_hand = sympy.sympify(integral)
        values = dict(zip(["x1", "x2", "x3", "eps"], [1, 2, 3, sympy.Rational(1, 10)], strict=True))
        assert str(integral([1, 2, 3], "1/10")) == str(by_hand.subs(values))
        assert np.allclose(integral(np.asarray(walk), 0.1), float(by_hand.subs(values)), rtol=1e-12)
        assert integral._repr_latex_() == rf"$\displaystyle {integral.latex()}$"
    assert repr(km.find_integrals("lotka_volterra")).startswith("<IntegralSearch: ")
    assert km.System(top.to_sympy()).rhs == top.rhs
    image = km.map("weierstrass", "1/10").to_sympy()
    at = dict(zip(image, [1, 2], strict=True))
    assert [str(value.subs(at)) for value in image.values()] == km.orbit("weierstrass", [1, 2], "1/10", 1)[1].text
    double = (km.map("weierstrass", "1/10") ** 2).to_sympy()
    assert [str(value.subs(at)) for value in double.values()] == km.orbit("weierstrass", [1, 2], "1/10", 2)[2].text


def test_a_slice_of_an_orbit_has_its_coordinates_and_times():
    walk = km.orbit(FISH, [1, 2], "1/10", 4)
    part = pickle.loads(pickle.dumps(walk[1:4:2]))
    assert [point.step for point in part] == [1, 3]
    assert part.x.tolist() == walk.x[[1, 3]].tolist() == [list(point) for point in part]
    assert part.t.tolist() == [fmpq(1, 5), fmpq(3, 5)]
    assert km.orbit(FISH, [1, 2], "1/10", 4, exact=False)[:2].x.dtype == float


def test_a_system_is_made_from_a_hamiltonian_or_in_the_manner_of_other_libraries():
    sympy = pytest.importorskip("sympy")
    q, p = sympy.symbols("q p")
    fish = km.System(hamiltonian="p^2/2 + q^2/2 - q^3/3", variables="q,p")
    assert fish.rhs == km.System(FISH).rhs == km.System.from_sympy([p, q**2 - q], (q, p)).rhs
    assert fish == km.System.from_hamiltonian("p^2/2 + q^2/2 - q^3/3", "q,p")
    assert fish == km.System(hamiltonian=p**2 / 2 + q**2 / 2 - q**3 / sympy.Integer(3), variables=[q, p])
    assert fish.hamiltonian is not None
    assert km.System(hamiltonian="a*q*p", variables="q,p", a=3).f([1, 2]) == (3, -6)
    for arguments, words in [
        ({}, 'hamiltonian="p\\^2/2'),
        ({"equations": FISH, "hamiltonian": "q*p"}, "expected either equations"),
        ({"hamiltonian": "q*p"}, "expected positions and momenta"),
        ({"hamiltonian": "q^4", "variables": "q,p"}, "degree 4, expected at most 3"),
        ({"equations": lambda x: x}, "found a function, expected equations.*km.System"),
    ]:
        refuses(words, km.System, **arguments)


def test_an_explicit_map_is_made_from_a_dictionary_called_and_composed():
    sympy = pytest.importorskip("sympy")
    x, y = sympy.symbols("x y")
    lyness = km.explicit_map({"x": "y", "y": "(1 + y)/x"})
    for same in (km.explicit_map(["x", "y"], ["y", "(1 + y)/x"]), km.explicit_map({x: y, y: (1 + y) / x})):
        assert same.seed_data == lyness.seed_data
    assert lyness([1, 2]) == lyness(x=1, y=2) == (2, 3)
    assert (lyness**5)([1, 2]) == (lyness**0)([1, 2]) == (lyness @ lyness**-1)([1, 2]) == (1, 2) != (lyness**4)([1, 2])
    inverse = km.explicit_map({x: y, y: (1 + y) / x}, inverse={y: x, x: (1 + x) / y})
    assert inverse.at(1).inverse([2, 3]) == (1, 2)
    refuses("found no eps", km.System(FISH).map, [1, 2])
    refuses("expected one of them", km.explicit_map, {"x": "y"}, ["x"])
    refuses("found no functions, expected image=", km.explicit_map, ["x"])
    refuses("floating-point number 0.5", km.explicit_map, {x: 0.5 * x})
    with pytest.raises(TypeError):
        lyness @ 3


def test_a_function_is_called_with_its_arguments_in_any_form():
    I = km.find_integrals(FISH)[0]
    value = I([1, 2], "1/10")
    assert value not in (I([1, 2], "1/9"), I([2, 1], "1/10"), None)
    for arguments, named in [
        ((1, 2, "1/10"), {}),
        (("1,2", "1/10"), {}),
        (([1, 2],), {"eps": "1/10"}),
        (([1, 2],), {"h": "1/5"}),
        (({"p": 2, "q": 1}, "1/10"), {}),
        ((), {"q": 1, "p": 2, "time_step": Fraction(1, 5)}),
    ]:
        assert I(*arguments, **named) == I.function(*arguments, **named) == value
    walk = km.orbit(FISH, [1, 2], "1/10", 3)
    assert set(I(walk, "1/10")) == {value} != set(I(walk, "1/9"))
    assert np.allclose(I(walk.x.astype(float), h=0.2), float(value))
    assert np.isclose(I([1.0, 2.0], h=0.2), float(value))
    refuses(r'found 2 values, expected 3: q, p, eps, for example I\(x, eps="1/10"\)', I, [1, 2])
    refuses("found 1 values, q=, a=, expected 3: q, p, eps", I, 2, q=1, a=3)
    refuses("found 4 values", I, [1, 2, 3], "1/10")


def test_the_verdict_of_an_analysis_in_a_word():
    assert km.analyze("weierstrass").integrable is True
    assert km.analyze("x' = x*(1 - y); y' = y*(x - 2)").integrable is False
    assert km.analyze("weierstrass", analyses=()).integrable is None
    assert repr(km.analyze("riccati", analyses=())) == "<Analysis: riccati, undecided>"


def test_dynamical_degree_and_entropy_are_those_of_the_degrees():
    assert str(km.dynamical_degree("lotka_volterra").digits) == km.degrees("lotka_volterra").dynamical_degree.digits
    assert km.algebraic_entropy("x' = x*(1 - y); y' = y*(x - 1)") == np.log(2)


def test_what_hints_name_exists():
    named = {name for text in (*HINTS.values(), *_ARGUMENT_HINTS.values()) for name in re.findall(r"\bkm\.(\w+)", text)}
    assert len(named) > 20
    for name in named:
        getattr(km, name)


@pytest.mark.parametrize("prime", [101, 2**53 + 5, 2**61 - 1, 2**127 - 1])
def test_arrays_of_residues_are_exact_or_refused(prime):
    walk = km.orbit("euler_top", [1, 2, 3], "1/10", 5, arithmetic=f"mod:{prime}")
    rows = [[int(x) for x in point.x] for point in walk]
    assert max(map(max, rows)) > prime // 2
    table = np.asarray(walk)
    assert table.dtype == (np.int64 if prime < 2**63 else object)
    assert table.tolist() == np.asarray(walk, dtype=object).tolist() == rows
    for kind in (np.int64, np.uint8):
        if max(map(max, rows)) <= np.iinfo(kind).max:
            assert np.asarray(walk, dtype=kind).tolist() == rows
        else:
            refuses(r"found the coordinate \d+.*, expected integers.*use dtype=object", np.asarray, walk, dtype=kind)
    if prime < 2**53:
        assert np.asarray(walk, dtype=float).tolist() == rows
    else:
        refuses(f"rounds residues modulo {prime}, expected dtype=int or dtype=object", np.asarray, walk, dtype=float)
