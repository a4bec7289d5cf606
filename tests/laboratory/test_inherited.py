"""What theorems give counts: integrals of every Kahan map by linear algebra, and no analysis tells of fewer."""

import random

import pytest
from flint import fmpq
from search_helpers import system, values_on_orbits

from kahanmaps.algebra.fields import QQ
from kahanmaps.checks.claims import Certainty
from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import SystemFile
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.preserve.integrals import find_integrals
from kahanmaps.laboratory.preserve.poisson.hamiltonian_structure import inherited_integrals
from kahanmaps.maps.kahan import KahanMap


def lotka_volterra(n: int, k: int) -> SystemFile:
    """LV(n, k): x_i' = x_i sum_j a_ij x_j, a skew, a_ij = 1 for 0 < j - i <= k and -1 above."""

    def sign(i: int, j: int) -> int:
        return 0 if i == j else -sign(j, i) if i > j else 1 if j - i <= k else -1

    names = [f"x{i}" for i in range(n)]
    sums = ["+".join(f"({sign(i, j)})*{name}" for j, name in enumerate(names)) for i in range(n)]
    return system(" ".join(names), *(f"{name}*({total})" for name, total in zip(names, sums, strict=True)))


# x' and y' are those of a cubic H(x, y), z' is anything: K f = grad H with a K of rank 2 in dimension 3.
DRIVEN = system("x y z", "x^2 + 2*x*y + 3*y + 1", "-2*x*y - y^2 + 4*x^2 + x + 7", "x*z + y^2 + z^2 - 5*x + 2")
# f = J grad H with a J of rank 4 in dimension 6, and H of degree 3 in all variables
DEGENERATE = system(
    "q1 q2 p1 p2 z w",
    "p1 + 2*q1*z",
    "p2 + q1^2",
    "-3*q1^2 - 2*p1*z - 2*q1*p2 + w",
    "-q2*z + w^2",
    "0",
    "0",
)
CASES = [
    (lotka_volterra(4, 1), 1, 1),
    (lotka_volterra(8, 5), 1, 1),
    (lotka_volterra(5, 1), 1, 0),
    (DRIVEN, 0, 1),
    (DEGENERATE, 2, 1),
    (load("paper_m3"), 0, 3),
    (load("euler_top"), 0, 0),
]


@pytest.mark.parametrize(("file", "affine", "modified"), CASES)
def test_the_numbers_of_integrals_that_theorems_give(file, affine, modified):
    integrals = inherited_integrals(file.system)
    assert (len(integrals.quotient.integrals), len(integrals.forms)) == (affine, modified)
    assert [integrals.count(map_) for map_ in Laboratory(file).maps] == [affine + modified] * 2


@pytest.mark.parametrize("file", [DRIVEN, DEGENERATE])
def test_modified_hamiltonians_are_constant_along_exact_orbits_also_for_a_singular_form(file):
    result, rng = inherited_integrals(file.system), random.Random(3)
    for k, form in enumerate(result.forms):
        H, values = result.hamiltonian(k), []
        kahan = KahanMap(file.system, fmpq(1, 9))
        x = kahan.point([fmpq(rng.randint(-9, 9), rng.randint(2, 5)) for _ in range(file.system.dim)])
        energies = set()
        for _ in range(4):
            values.append(result.modified(k, QQ, fmpq(1, 9), x))
            energies.add(H(*x))
            x = kahan.step(x)
        assert len(set(values)) == 1
        assert len(energies) > 1  # H itself is not conserved
        assert form.transpose() == form * -1


@pytest.mark.parametrize("eps", [None, "1/9"])
def test_what_a_theorem_gives_is_written_out_where_relations_show_nothing(eps):
    (entry,) = find_integrals(DRIVEN, eps=eps, max_degree=1).integrals
    assert (entry.origin, entry.verdict) == ("modified Hamiltonian (cmoq-2013)", Certainty.PROVED)
    values = values_on_orbits(DRIVEN, entry.text, ["1/9"])
    assert [len(each) for each in values] == [1, 1, 1]
    assert len(set().union(*values)) > 1


@pytest.mark.parametrize(("file", "products"), [(lotka_volterra(6, 3), 1)])
def test_no_search_reports_fewer_integrals_than_theorems_give(file, products):
    """Relations of degree 1 show the affine integrals only; products of invariant hyperplanes are found beside them."""
    search = find_integrals(file, max_degree=1)
    assert search.codimension == search.by_theorems + products > search.profile.codimension
    assert not search.is_exact
    assert f"in all at least {search.codimension} independent ({search.by_theorems} by theorems" in search.count_text
    as_json = search.to_json()
    assert (as_json["codimension"], as_json["by_theorems"]) == (search.codimension, search.by_theorems)
    assert as_json["codimension_is_exact"] is False


def test_with_symbols_theorems_are_asked_at_random_values():
    file = system("x y z", "y + a*x^2", "-2*a*x*y - x", "x*z + b", a="1", b="0")
    search = find_integrals(file, symbols=["a", "b"], max_degree=1)
    assert (search.by_theorems, search.codimension, search.integrals) == (1, 1, ())
    assert "1 of the 1 independent integrals has no closed form" in search.reason
    assert "1 by theorems: 1 modified Hamiltonian, at random values of a, b" in search.count_text
    # x' has no y at a = 0: what holds there only is no theorem for every a
    special = system("x y", "x*y", "-x*y + a*x", a="0")
    assert find_integrals(special, symbols=["a"], max_degree=2).by_theorems == 0
    assert find_integrals(special, max_degree=2).by_theorems == 1
