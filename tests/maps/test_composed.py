"""A composition, stepped factor by factor, is its formula multiplied out; the words are short, so that this exists."""

import numpy as np
import pytest
from flint import fmpq
from helpers import refuses

from kahanmaps.algebra.duals import DualField
from kahanmaps.algebra.fields import GF, QQ, RR
from kahanmaps.algebra.matrices import det
from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import parse_system
from kahanmaps.documents.symbols import map_with_symbols
from kahanmaps.errors import SingularStep
from kahanmaps.invariants.integrals_and_densities import jacobian_determinant_fraction
from kahanmaps.maps.composed import composed_map
from kahanmaps.maps.convention import time_step
from kahanmaps.maps.explicit import explicit_map
from kahanmaps.maps.floats.float_orbit import FloatEnsemble
from kahanmaps.maps.orbits.orbit import orbit

F = load("lotka_volterra").map
G = parse_system('variables = ["x", "y"]\n[system]\nrhs = ["x*y - y", "x^2 - x*y"]').map
H = parse_system('variables = ["x", "y"]\n[bilinear]\nequations = ["X - x = 2*eps*X*(1 - y)", "Y - y = 2*eps*y*X"]').map
LYNESS, SYMBOLIC = load("lyness").map, map_with_symbols(load("lyness"), ["a"])
WORDS = {
    "Kahan": composed_map(F, (G, -1)),
    "three kinds": composed_map(F, (H, -1), LYNESS),
    "a power": composed_map((LYNESS, 3)),
}
START, EPS = (fmpq(1, 2), fmpq(2, 3)), "1/10"


def out(name):
    """The map multiplied out: an equation of its own, and an inverse."""
    word = WORDS[name]
    return explicit_map(word.variables, word.image, composed_map(*reversed([(p.map, 1 if p.is_inverse else -1)
                                                                           for p in word.parts])).image)  # fmt: skip


@pytest.mark.parametrize("name", WORDS)
@pytest.mark.parametrize("field", [QQ, GF(10007), GF(2**61 - 1), RR(200), DualField(QQ)], ids=str)
def test_a_step_and_its_derivatives_are_those_of_the_formula(name, field):
    word, formula = WORDS[name].at(EPS, field), out(name).at(EPS, field)
    for entry, other in ((word, formula), (word.inverse, formula.inverse)):
        x = tuple(field.convert(e) for e in START)
        assert all(field.equal(a, b) for a, b in zip(entry.step(x), other.step(x), strict=True))
        pairs = zip(entry.jacobian(x).entries(), other.jacobian(x).entries(), strict=True)
        assert all(field.equal(a, b) for a, b in pairs)
        above, below = jacobian_determinant_fraction(entry, x, entry.step(x))
        assert field.equal(above, below * det(other.jacobian(x)))


def test_an_orbit_stays_where_a_factor_has_no_value():
    """x -> 1/x -> 1/x is the identity, undefined at 0 if it is stepped."""
    inversion = parse_system('variables = ["x", "y"]\n[map]\nimage = ["1/x", "y"]').map
    shift = parse_system('variables = ["x", "y"]\n[map]\nimage = ["x - 1", "y"]').map
    word = composed_map(shift, inversion, shift)
    refuses(r"det M\(x\) = 0 at the point 1,2: ", word.at(1).step, [1, 2], error=SingularStep)
    walk = orbit(word, [1, 2], steps=2)
    assert ([point.text for point in walk], walk.end.status) == ([["1", "2"]], "singular")
    for kernel in ("numpy", "numba"):
        floats = FloatEnsemble(word, 1, np.array([[1.0, 2.0], [4.0, 2.0]]), kernel=kernel)
        floats.advance(2)
        assert floats.failed_at.tolist() == [1, -1]


def test_long_words_are_stepped_and_refused_where_formulas_are_asked_for():
    word = composed_map((load("henon_heiles").map, 4))
    over, x = load("henon_heiles").map.at(EPS), tuple(fmpq(1, k) for k in (2, 3, 5, 7))
    expected = over.step(over.step(over.step(over.step(x))))
    assert word.at(EPS).step(x) == expected
    assert word.at(EPS).inverse.step(expected) == x
    for what in ("rows", "inverse_rows"):
        refuses("4 maps whose formulas are too large to be multiplied out", getattr, word, what)
    assert str(word).startswith("4 maps one after the other, too large to be multiplied out:\nthe Kahan map in q1")
    assert len(word.to_record()["composition"]) == 4
    assert "4 maps one after the other" in word._repr_latex_()
    refuses("found a map with the symbol a", composed_map, SYMBOLIC, symbols=())


def test_maps_that_share_a_symbol_are_joined_by_its_name():
    word = composed_map(SYMBOLIC, (F, -1), SYMBOLIC)
    assert (word.symbols, word.names) == (("a",), ("x", "y", "a", "eps"))
    step = load("lyness", {"a": fmpq(2, 5)}).map.at(EPS).step
    assert word.at(EPS, values=[fmpq(2, 5)]).step(START) == step(F.at(EPS).inverse.step(step(START)))


@pytest.mark.parametrize(
    ("parts", "steps"),
    [
        ([(F, 3)], 3),
        ([(F, -2)], -2),
        ([F, (F, -1)], 0),
        ([(composed_map((F, 2)), -1), F, F, F], 1),
        ([F, G], 0),
        ([F, G, (F, -1)], 0),
        ([(LYNESS, 2)], 0),
        ([composed_map(F, G), composed_map(F, G)], 0),
    ],
)
def test_powers_of_one_map_have_its_time_step_so_many_times_and_products_of_fields_none(parts, steps):
    word = composed_map(*parts)
    assert word.time_steps == steps
    assert time_step(fmpq(1, 10), word) == (fmpq(steps, 5) if steps else None)
