"""Systems over an algebra Q[t]/(chi), written over Q: their Kahan maps are those over the algebra and inherit all.

The algebra is a product of fields or has nilpotent elements; what is not over an algebra is not taken for it.
"""

import random

import pytest
from check_helpers import claim, system_of
from flint import fmpq, fmpq_mat, fmpq_poly

from kahanmaps import QQ, InputError, KahanMap, QuadraticSystem, load, tensor_file
from kahanmaps.algebra.etale import EtaleAlgebra
from kahanmaps.algebra.polynomials import ring
from kahanmaps.family.tensor import (
    TensorStructure,
    centroid,
    commutes,
    inherited_density,
    inherited_integrals,
    over_algebra,
    tensor_structure,
)

t = fmpq_poly([0, 1])
MODULI = [t**2 - 2, t**2, t**2 - 1, t**3 - t - 1, t**3, (t - 1) ** 2 * (t + 2)]
PLANAR = system_of("x y", "x*y + x - 1", "y^2 - x^2 + 2*y")
over_moduli = pytest.mark.parametrize("chi", MODULI, ids=str)


@pytest.mark.parametrize("chi", [t**2 - 2, t**2 - 1, t**3 - t - 1], ids=str)
def test_the_map_over_Q_is_the_map_over_the_algebra(chi):
    K, m, rng = EtaleAlgebra(chi), chi.degree(), random.Random(1)
    point = [K.convert(fmpq_poly([QQ.random(rng) for _ in range(m)])) for _ in range(2)]
    expected = KahanMap(PLANAR, fmpq(1, 7), K).step(point)
    split = [element.polynomial[k] for element in point for k in range(m)]
    result = KahanMap(over_algebra(PLANAR, chi), fmpq(1, 7), QQ).step(split)
    assert list(result) == [element.polynomial[k] for element in expected for k in range(m)]


def test_over_nilpotent_elements_the_map_is_that_of_curves():
    # Over Q[t]/t^2 a step takes (x, v) to the image of x and the derivative of the map along v.
    map_ = KahanMap(PLANAR, fmpq(1, 7), QQ)
    x, v = [fmpq(1, 3), fmpq(2)], [fmpq(1), fmpq(-1, 2)]
    split = [x[0], v[0], x[1], v[1]]
    result = KahanMap(over_algebra(PLANAR, t**2), fmpq(1, 7), QQ).step(split)
    along = (KahanMap(PLANAR.over(QQ), fmpq(1, 7)).jacobian(x) * fmpq_mat([[v[0]], [v[1]]])).entries()
    assert list(result) == [value for pair in zip(map_.step(x), along, strict=True) for value in pair]


@over_moduli
def test_integrals_and_densities_are_inherited(chi):
    file = tensor_file(load("nahm_tetrahedral"), chi)
    point = [fmpq(k + 1, 2 * k + 5) for k in range(file.dim)]
    eps = fmpq(1, 9)
    image = KahanMap(file.system, eps, QQ).step(point)
    assert len(file.integrals) == chi.degree()
    for integral in file.integrals.values():
        assert integral.value(QQ, [*image, eps]) == integral.value(QQ, [*point, eps])
    before, after = (file.density.value(QQ, [*x, eps]) for x in (point, image))
    assert KahanMap(file.system.over(QQ), eps).jacobian(point).det() == after / before


def test_the_components_of_another_function_are_not_conserved():
    system = over_algebra(load("nahm_tetrahedral").system, t**2 - 2)
    point, eps = [fmpq(1), fmpq(2), fmpq(1, 3), fmpq(1, 5)], fmpq(1, 9)
    image = KahanMap(system, eps, QQ).step(point)
    wrong = inherited_integrals(claim("y*(3*x^2 - y^2)", "x y"), t**2 - 2)
    assert all(part.value(QQ, [*image, eps]) != part.value(QQ, [*point, eps]) for part in wrong)
    assert str(inherited_density(claim("x", "x y"), t**2).numerator) == "x_0^2"


@over_moduli
def test_what_was_made_over_an_algebra_is_recognised(chi):
    structure = tensor_structure(over_algebra(PLANAR, chi))
    assert structure is not None
    assert (structure.rank, structure.chi.degree()) == (2, chi.degree())
    assert sorted(e for _, e in structure.chi.factor()[1]) == sorted(e for _, e in chi.factor()[1])
    assert structure.text.startswith("a planar system over K = Q[t]/(")


@pytest.mark.parametrize("name", ["nahm_tetrahedral", "lotka_volterra", "euler_top", "kirchhoff_case"])
def test_what_is_over_no_algebra_is_not(name):
    assert tensor_structure(load(name).system) is None
    assert centroid(load(name).system) == [QQ.identity(load(name).dim)]


def test_a_perturbed_system_is_no_longer_over_the_algebra():
    system = over_algebra(PLANAR, t**2 - 2)
    moved = QuadraticSystem((system.rhs[0] + ring(system.variables).gens()[3] ** 2, *system.rhs[1:]))
    C = tensor_structure(system).C
    assert commutes(C, system)
    assert not commutes(C, moved)
    assert tensor_structure(moved) is None
    with pytest.raises(InputError, match="C does not make this a system"):
        TensorStructure(moved, C, t**2 - 2)
