"""Integrals of the differential equation, by the searches that find those of maps."""

import pytest

from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import parse_system
from kahanmaps.laboratory.modular_points import ModularFlow, ModularMap, exponents_up_to
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import TwoPointBasis, TwoPointMap

PRIME = 2**61 - 1


@pytest.mark.parametrize("kind", ["map", "flow", "lifted"])
def test_values_before_and_after_a_step_are_multiplied_each_by_its_number(kind):
    system = load("lotka_volterra").system
    map_ = ModularFlow(system, PRIME) if kind == "flow" else ModularMap(system, PRIME, 7)
    map_ = TwoPointMap(map_, TwoPointBasis(1, 1)) if kind == "lifted" else map_
    ((x, image),) = map_.pairs(1)
    plain, weighed = map_.moved(x, image, 2), map_.moved(x, image, 2, (3, 5))
    for values, more, number in zip(plain, weighed, (3, 5), strict=True):
        assert [number * int(value) % PRIME for value in values] == [int(value) % PRIME for value in more]
    assert plain[0] != plain[1]


def test_the_series_of_a_solution_solve_the_equation():
    """x' = y, y' = -x from (a, b): x = a cos t + b sin t; and monomials are multiplied as series."""
    flow = ModularFlow(parse_system('variables = ["x", "y"]\n[system]\nrhs = ["y", "-x"]').system, PRIME)
    rows, (a, b), period = flow.along_orbit(2, 8)
    assert period is None
    support = exponents_up_to(2, 2)
    x, y, xy = ([int(row[support.index(e)]) for row in rows] for e in ((1, 0), (0, 1), (1, 1)))
    assert [(k + 1) * x[k + 1] % PRIME for k in range(7)] == y[:7]
    assert [-(k + 1) * y[k + 1] % PRIME for k in range(7)] == x[:7]
    assert xy == [sum(x[i] * y[k - i] for i in range(k + 1)) % PRIME for k in range(8)]
    assert (x[0], y[0]) == (a, b)
