"""What stands for a map in the functions of `import kahanmaps`, and numbers of other libraries."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from flint import fmpq

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
    known = degree_growth(file.map, max_terms=8).degrees
    for given in (file, file.system, file.map, "weierstrass", path, str(path), WEIERSTRASS, km.System(WEIERSTRASS)):
        assert km.degrees(given, max_terms=8).degrees == known
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
    with pytest.raises(InputError, match="power 0"):
        phi**0
    with pytest.raises(InputError, match="one dimension"):
        phi @ km.KahanMap(km.load("weierstrass").system, "1/10")
    with pytest.raises(TypeError):
        phi @ 3
