"""A command that does one analysis alone finds no less than `analyze`, both with their defaults."""

from collections.abc import Callable
from typing import Any

import pytest
from helpers import quick
from search_helpers import analysis_of, integrals_of

from kahanmaps.documents.catalog import load
from kahanmaps.laboratory.growth.degrees import degree_growth
from kahanmaps.laboratory.preserve.densities import find_densities
from kahanmaps.laboratory.preserve.poisson.poisson_tensors import find_poisson
from kahanmaps.laboratory.symmetry.commuting import find_commuting
from kahanmaps.laboratory.symmetry.symmetries import linear_symmetries

SEARCHES: list[tuple[str, Callable[[str], Any], Callable[[Any], list[str]]]] = [
    ("integrals", integrals_of, lambda result: [integral.text for integral in result.integrals]),
    (
        "densities",
        lambda name: find_densities(load(name)),
        lambda result: [density.text for density in result.densities],
    ),
    ("poisson", lambda name: find_poisson(load(name)), lambda result: [tensor.text for tensor in result.tensors]),
    (
        "symmetries",
        lambda name: linear_symmetries(load(name).system),
        lambda result: [generator.text for generator in result.generators],
    ),
    (
        "commuting",
        lambda name: find_commuting(load(name).system),
        lambda result: [str(g.rhs) for g in result.solutions],
    ),
    ("degrees", lambda name: degree_growth(load(name).map), lambda result: [result.growth_text]),
]


@pytest.mark.parametrize(
    "name",
    quick(["euler_top", "lotka_volterra", "volterra_periodic_3", "weierstrass"], ["euler_top", "lotka_volterra"]),
)
@pytest.mark.parametrize(("result", "search", "texts"), SEARCHES, ids=[row[0] for row in SEARCHES])
def test_what_analyze_finds_the_command_finds(
    name: str, result: str, search: Callable[[str], Any], texts: Callable[[Any], list[str]]
) -> None:
    together = analysis_of(name)[result]
    alone = search(name)
    if together is None:  # tensors of the plane are densities
        assert (result, load(name).dim) == ("poisson", 2)
        return
    # No integral is known of the map of Lotka and Volterra.
    assert texts(together) or (result, name) == ("integrals", "lotka_volterra")
    assert set(texts(together)) <= set(texts(alone))


def test_the_three_tensors_of_the_euler_top_are_found_without_a_degree() -> None:
    search = find_poisson(load("euler_top"), integrals=())
    assert (search.degree, len(search.tensors)) == (3, 3)
    assert find_poisson(load("euler_top"), 2, integrals=()).tensors == ()
