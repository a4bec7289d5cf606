"""A composition, stepped factor by factor, is its formula multiplied out, for every evaluator; its power is an iterate.

The words are short, so that the formulas exist, and one of them is written in another order: that is another map.
"""

from __future__ import annotations

import numpy as np
import pytest
from flint import fmpq
from helpers import quick

from kahanmaps.algebra.duals import DualField
from kahanmaps.algebra.fields import GF, QQ, RR
from kahanmaps.algebra.matrices import det
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.algebra.written.text import parse_rational_function
from kahanmaps.checks.decide import decide
from kahanmaps.checks.preserve import density_identity, transformation_identity
from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import parse_system
from kahanmaps.errors import InputError, SingularStep
from kahanmaps.invariants.measures import ClaimedDensity, jacobian_determinant_sides
from kahanmaps.invariants.poisson import GivenTensor, transformation_sides
from kahanmaps.laboratory.growth.degrees import degree_growth
from kahanmaps.laboratory.singular.singularities import singularities
from kahanmaps.maps.composed import composed_map
from kahanmaps.maps.explicit import explicit_map
from kahanmaps.maps.floats.fast import FloatEnsemble
from kahanmaps.maps.floats.lyapunov import lyapunov_exponents
from kahanmaps.maps.orbits.orbit import orbit
from kahanmaps.maps.projective import homogeneous_map
from kahanmaps.maps.residues.ensemble import ModularEnsemble
from kahanmaps.maps.residues.projective import ProjectiveMap

F = load("lotka_volterra").map
G = parse_system('variables = ["x", "y"]\n[system]\nrhs = ["x*y - y", "x^2 - x*y"]').map
H = parse_system('variables = ["x", "y"]\n[bilinear]\nequations = ["X - x = 2*eps*X*(1 - y)", "Y - y = 2*eps*y*X"]').map
LYNESS = load("lyness").map
WORDS = {
    "Kahan": composed_map(F, (G, -1)),
    "three kinds": composed_map(F, (H, -1), LYNESS),
    "a power": composed_map((LYNESS, 3)),
}
every_word = pytest.mark.parametrize("name", WORDS)
START, EPS = (fmpq(1, 2), fmpq(2, 3)), "1/10"


def out(name):
    """The map multiplied out: an equation of its own, and an inverse."""
    word = WORDS[name]
    return explicit_map(word.variables, word.image, composed_map(*reversed([(p.map, 1 if p.is_inverse else -1)
                                                                           for p in word.parts])).image)  # fmt: skip


@every_word
@pytest.mark.parametrize("field", [QQ, GF(10007), GF(2**61 - 1), RR(200), DualField(QQ)], ids=str)
def test_a_step_and_its_derivatives_are_those_of_the_formula(name, field):
    word, formula = WORDS[name].at(EPS, field), out(name).at(EPS, field)
    for one, other in ((word, formula), (word.inverse, formula.inverse)):
        x = tuple(field.convert(e) for e in START)
        assert all(field.equal(a, b) for a, b in zip(one.step(x), other.step(x), strict=True))
        pairs = zip(one.jacobian(x).entries(), other.jacobian(x).entries(), strict=True)
        assert all(field.equal(a, b) for a, b in pairs)
        above, below = jacobian_determinant_sides(one, x, one.step(x))
        assert field.equal(above, below * det(other.jacobian(x)))


@every_word
def test_another_order_is_another_map(name):
    word = WORDS[name]
    parts = [(part.map, -1 if part.is_inverse else 1) for part in word.parts]
    turned = composed_map(*parts[1:], parts[0])
    same = turned.at(EPS).step(START) == word.at(EPS).step(START)
    assert same == (name == "a power")
    assert (turned.subject == word.subject) == (name == "a power")


@pytest.mark.parametrize("power", [1, 2, 5, -3])
def test_a_power_takes_as_many_steps(power):
    for map_ in (F, LYNESS, G):
        over = map_.at(EPS)
        x = START
        for _ in range(abs(power)):
            x = over.step(x) if power > 0 else over.inverse.step(x)
        assert composed_map((map_, power)).at(EPS).step(START) == x


@every_word
@pytest.mark.parametrize("text", ["exact", "mod:10007", "ball:200", "float"])
def test_orbits_are_those_of_the_formula(name, text):
    found, expected = (list(orbit(m, START, EPS, steps=3, arithmetic=text)) for m in (WORDS[name], out(name)))
    for one, other in zip(found, expected, strict=True):
        if text == "float":
            assert np.allclose(one.x, other.x, rtol=1e-11)
        elif text == "ball:200":
            assert all(a.overlaps(b) for a, b in zip(one.x, other.x, strict=True))
        else:
            assert one.text == other.text


def test_an_orbit_stays_where_a_factor_has_no_value():
    """x -> 1/x -> 1/x is the identity, without a value at 0 if it is stepped."""
    inversion = parse_system('variables = ["x", "y"]\n[map]\nimage = ["1/x", "y"]').map
    shift = parse_system('variables = ["x", "y"]\n[map]\nimage = ["x - 1", "y"]').map
    word = composed_map(shift, inversion, shift)
    with pytest.raises(SingularStep, match=r"det M\(x\) = 0 at the point 1,2 "):
        word.at(1).step([1, 2])
    walk = orbit(word, [1, 2], steps=2)
    assert ([point.text for point in walk], walk.end.status) == ([["1", "2"]], "singular")
    for kernel in ("numpy", "numba"):
        floats = FloatEnsemble(word, 1, np.array([[1.0, 2.0], [4.0, 2.0]]), kernel=kernel)
        floats.advance(2)
        assert floats.failed_at.tolist() == [1, -1]
    lines = composed_map(F, (G, -1), F)
    for kernel in ("numpy", "numba"):
        ensemble = ModularEnsemble(lines, EPS, [[k, l] for k in range(11) for l in range(11)], 11, kernel=kernel)
        ensemble.advance(3)
        for x, ended, start in zip(ensemble.x.tolist(), ensemble.singular_at.tolist(), range(121), strict=True):
            one = orbit(lines, divmod(start, 11), EPS, steps=3, arithmetic="mod:11")
            last = list(one)[-1]
            assert [int(e) for e in last.x] == x
            assert ended == (last.step if one.end.status == "singular" else -1)


@every_word
def test_forms_on_projective_space_are_those_of_the_formula(name):
    found, expected = (homogeneous_map(map_.at(EPS)).forms for map_ in (WORDS[name], out(name)))
    assert all(a * expected[-1] == b * found[-1] for a, b in zip(found, expected, strict=True))
    chart, other = (ProjectiveMap(map_, EPS, 101) for map_ in (WORDS[name], out(name)))
    assert chart.degree == other.degree
    one, two = chart.table(), other.table()
    assert (one[one >= 0] == two[one >= 0]).all()  # where every step has a value
    assert (one >= 0).sum() > 0.9 * len(one)


@pytest.mark.parametrize("name", quick(WORDS, ["a power"]))
def test_degrees_and_singularities_are_those_of_the_formula(name):
    found, expected = (degree_growth(map_, EPS, max_terms=4, seconds=30) for map_ in (WORDS[name], out(name)))
    assert found.degrees == expected.degrees
    runs = [singularities(map_, EPS, steps=6, seconds=30) for map_ in (WORDS[name], out(name))]
    assert runs[0].map_degree == runs[1].map_degree
    critical = [{h.polynomial: (h.status, [s.rank for s in h.steps]) for h in run.hypersurfaces if h.multiplicity}
                for run in runs]  # fmt: skip
    assert critical[0] == critical[1]


def test_degrees_of_a_power_are_every_other_degree_of_the_map():
    one, two = (degree_growth(map_, max_terms=terms) for map_, terms in ((F, 6), (composed_map((F, 2)), 3)))
    assert two.degrees[1:] == one.degrees[2::2]


@every_word
def test_lyapunov_exponents_are_those_of_the_formula(name):
    starts = np.array([[1.1, 0.9], [0.7, 1.2]])
    found, expected = (lyapunov_exponents(map_, starts, "1/50", 50).exponents for map_ in (WORDS[name], out(name)))
    assert np.allclose(found, expected, rtol=1e-6, atol=1e-9)  # of 50 steps with products of some digits' loss


def function(text):
    return parse_rational_function(text.replace("**", "^"), ["x", "y", "eps"])


@pytest.mark.parametrize(("text", "verdict"), [("x*y", "supported"), ("x + y", "refuted")])
def test_identities_are_decided_through_the_factors(text, verdict):
    word = composed_map(F, (F, 3), (H, -1)) if verdict == "refuted" else composed_map((F, 8))
    density = ClaimedDensity(function(text), None)
    assert decide(density_identity(word, density, None), 0).verdict.value == verdict
    zero = function("x - x")
    bracket = function(text)
    tensor = GivenTensor([[zero, bracket], [RationalFunction(-bracket.numerator, bracket.denominator), zero]])
    assert decide(transformation_identity(word, tensor, None), 0).verdict.value == verdict


@every_word
def test_both_sides_of_the_law_of_a_tensor_say_the_same_of_the_formula(name):
    tensor = GivenTensor([[function("x - x"), function("x*y")], [function("-x*y"), function("x - x")]])
    for map_ in (WORDS[name], out(name)):
        over = map_.at(EPS)
        left, right = transformation_sides(over, tensor, START, over.step(START))
        slopes = over.jacobian(START)
        law = slopes * tensor.value(QQ, over.eps, START) * slopes.transpose()
        assert (left[0, 1] / right[0, 1]) == law[0, 1] / tensor.value(QQ, over.eps, over.step(START))[0, 1]


def test_long_words_are_stepped_and_refused_where_formulas_are_asked_for():
    word = composed_map((load("henon_heiles").map, 4))
    over, x = load("henon_heiles").map.at(EPS), tuple(fmpq(1, k) for k in (2, 3, 5, 7))
    expected = over.step(over.step(over.step(over.step(x))))
    assert word.at(EPS).step(x) == expected
    assert word.at(EPS).inverse.step(expected) == x
    for what in ("rows", "image", "inverse_rows", "equations"):
        with pytest.raises(InputError, match="4 maps whose formulas are too large to be multiplied out"):
            getattr(word, what)
    assert str(word).startswith("4 maps one after the other, too large to be multiplied out:\nthe Kahan map in q1")
    assert len(word.written()["composition"]) == 4
    assert "4 maps one after the other" in word._repr_latex_()
    with pytest.raises(InputError, match="found a map with the symbol a"):
        composed_map(parse_symbolic(), symbols=())


def parse_symbolic():
    from kahanmaps.documents.symbols import map_with_symbols

    return map_with_symbols(load("lyness"), ["a"])


def test_maps_that_share_a_symbol_are_joined_by_its_name():
    one = parse_symbolic()
    word = composed_map(one, (F, -1), one)
    assert (word.symbols, word.names) == (("a",), ("x", "y", "a", "eps"))
    step = load("lyness", {"a": fmpq(2, 5)}).map.at(EPS).step
    assert word.at(EPS, values=[fmpq(2, 5)]).step(START) == step(F.at(EPS).inverse.step(step(START)))


def test_a_budget_ends_a_step_between_its_factors():
    walk = orbit(composed_map((F, 30)), START, EPS, steps=1, max_digits=200)
    list(walk)
    assert walk.end.status == "budget"
    assert int(walk.end.message.split("numbers of ")[1].split()[0]) < 2000
