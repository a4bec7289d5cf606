"""Integrals in iterates: relations of functions of (x, x~, ...) give integrals, exactly where there are some.

Ratios are compared along rational orbits with ==, apart from the search that found them.
"""

from dataclasses import replace

import pytest
from flint import fmpq
from search_helpers import system

from kahanmaps import QQ, Budget, Certainty, Laboratory, affine_integrals, load
from kahanmaps.laboratory.modular_points import IndependentGradients
from kahanmaps.laboratory.preserve.iterates import integrals_in_iterates, verdict_on_ratio

GAUDIN = system(
    *("x1 x2 x3 y1 y2 y3", "y2*x3 - y3*x2 - x2", "y3*x1 - y1*x3 + x1", "y1*x2 - y2*x1"),
    *("x2*y3 - x3*y2 - 3*y2", "x3*y1 - x1*y3 + 3*y1", "x1*y2 - x2*y1"),
)


def searched(file, count=6, symbols=()):
    """The laboratory, the integrals in x and those in iterates that do not depend on the affine ones."""
    laboratory = Laboratory(file, symbols)
    map_ = laboratory.maps[0]
    known = IndependentGradients(map_)
    known.rows = [[int(entry) % map_.prime for entry in v] for v in affine_integrals(laboratory.system)]
    plain, ratios, _ = integrals_in_iterates(laboratory, count, known, Budget())
    return laboratory, len(known.rows), [function for function, *_ in plain], [ratio for ratio, _ in ratios]


def values_along_orbit(file, ratio, count=3):
    eps = fmpq(2, 7)
    map_ = file.map.at(eps)
    points = [tuple(fmpq(k + 2, 3 * k + 5) for k in range(file.dim))]
    while len(points) < ratio.length + count:
        points.append(map_.step(points[-1]))
    return [P / Q for P, Q in [ratio.numerator_and_denominator(QQ, points[k:], [eps]) for k in range(count)]]


# Affine ones, of the others those in x, and in x and x~, ...: four with the one that bases of quadrics give.
@pytest.mark.parametrize(
    ("file", "numbers"),
    [(load("kirchhoff_case"), (1, 1, 2)), (load("lagrange_top"), (1, 2, 1)), (GAUDIN, (1, 2, 1))],
    ids=["kirchhoff_case", "lagrange_top", "gaudin"],
)
def test_all_four_integrals_of_tops_and_spin_systems_have_formulas(file, numbers):
    laboratory, affine, plain, ratios = searched(file)
    assert (affine, len(plain), len(ratios)) == numbers
    assert all(laboratory.verdict_on(function)[0] is Certainty.PROVED for function in plain)
    verdicts = [verdict_on_ratio(laboratory, ratio)[0] for ratio in ratios]
    assert all(verdict.holds for verdict in verdicts)
    assert verdicts.count(Certainty.PROVED) == 1
    for ratio in ratios:
        first, *others = values_along_orbit(file, ratio)
        assert others == [first, first]


# kirchhoff_generic has no relations at all; those of the others belong to the one integral that they have.
@pytest.mark.parametrize(("name", "numbers"), [("lorenz", (0, 0)), ("zhukovski_volterra_2", (0, 1))])
def test_a_map_that_is_not_integrable_gains_nothing(name, numbers):
    _, _, plain, ratios = searched(load(name))
    assert (len(plain), len(ratios)) == numbers


def test_a_ratio_that_is_not_conserved_is_refuted():
    file = load("clebsch_first_flow")
    laboratory, _, _, [ratio, *_] = searched(file, count=1)
    P, Q = ratio.functions
    wrong = replace(ratio, functions=(P + 1, Q))
    assert verdict_on_ratio(laboratory, wrong)[0] is Certainty.REFUTED
    assert len(set(values_along_orbit(file, wrong))) == 3


def test_ratios_of_functions_of_rank_two_are_no_integrals_but_those_of_minors_are():
    laboratory, _, _, ratios = searched(load("clebsch_first_flow"))
    minors = ratios[-1]
    assert minors.two_point_basis.rank == 2
    single = replace(minors, two_point_basis=minors.two_point_basis._replace(rank=1), numerator=(0,), denominator=(1,))
    assert verdict_on_ratio(laboratory, single)[0] is Certainty.REFUTED
