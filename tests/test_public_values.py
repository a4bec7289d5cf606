"""Values of the library in Python: equal, copied, pickled, shown in short, plain data, arrays."""

import copy
import multiprocessing
import pickle
from concurrent.futures import ProcessPoolExecutor
from fractions import Fraction

import numpy as np
import pytest
from helpers import together

import kahanmaps as km
from kahanmaps.errors import InputError

FISH = "q' = p; p' = q^2 - q"


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


@pytest.mark.parametrize("again", [copy.deepcopy, lambda value: pickle.loads(pickle.dumps(value))])
def test_systems_maps_and_orbits_are_copied_and_pickled(again):
    for name in ("lorenz", "paper_m3", "lyness", "henon_heiles", "lv(5,1)"):
        file = km.load(name)
        assert again(file) == file
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


def test_functions_and_their_results_go_to_other_processes_and_back():
    """`spawn`, so that the other process imports what it needs by what it is sent."""
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
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
            with pytest.raises(InputError, match=r"found the coordinate \d+.*, expected integers.*use dtype=object"):
                np.asarray(walk, dtype=kind)
    if prime < 2**53:
        assert np.asarray(walk, dtype=float).tolist() == rows
    else:
        with pytest.raises(InputError, match=f"rounds residues modulo {prime}, expected dtype=int or dtype=object"):
            np.asarray(walk, dtype=float)
