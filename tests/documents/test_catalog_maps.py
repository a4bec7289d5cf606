"""The maps of the catalogue that are not Kahan's: what their files state is proved or measured again."""

import pytest
from flint import fmpq
from helpers import quick

from kahanmaps.algebra.fields import QQ
from kahanmaps.checks.conserve import check_integrals
from kahanmaps.checks.preserve import check_measure
from kahanmaps.documents.catalog import load, map_names
from kahanmaps.documents.files import SystemFile, parse_system
from kahanmaps.documents.structured_facts import relations
from kahanmaps.laboratory.analysis import analyze
from kahanmaps.laboratory.growth.degrees import degree_growth
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.preserve.hirota_kimura import hirota_kimura_basis
from kahanmaps.laboratory.preserve.identities import verdict_on
from kahanmaps.laboratory.preserve.integrals import find_integrals
from kahanmaps.systems.quadratic import QuadraticSystem

every_map = pytest.mark.parametrize("name", map_names())
FILES = {name: load(name) for name in map_names()}
# The flows whose Kahan maps were repaired: x' and y' for eps -> 0, and the degree of their integral.
UNREPAIRED = {
    "repaired_octahedral": ("2*x*y", "-2*y^2 - 4*x^2 - 6*x - 6", 4),
    "repaired_icosahedral": ("x*(2 + 2*x + 3*y)", "-y*(3 + 4*x + 3*y)", 6),
}


@every_map
def test_a_file_has_a_title_sources_and_facts_and_reads_back_equal(name):
    file = FILES[name]
    assert set(file.catalog) >= {"title", "sources", "facts", "degrees", "verdict"}
    assert parse_system(file.to_toml(), name) == file
    assert not file.is_quadratic


@every_map
def test_what_is_claimed_to_be_preserved_is_proved(name):
    file = FILES[name]
    if file.integrals:
        assert {str(finding.verdict) for finding in check_integrals(file).findings} == {"proved"}
    if file.density is not None:
        assert {str(finding.verdict) for finding in check_measure(file).findings} == {"proved"}


@every_map
def test_the_degrees_are_those_that_are_stated(name):
    known = FILES[name].catalog
    terms = min(len(known["degrees"]), 5)  # the others measures the slow test below
    found = degree_growth(FILES[name].map, None, max_terms=terms, seconds=60)
    assert list(found.degrees[1:]) == known["degrees"][:terms]


@pytest.mark.parametrize("name", [name for name in map_names() if "growth" in FILES[name].catalog])
@pytest.mark.slow
def test_the_growth_is_the_one_that_is_stated(name):
    known = FILES[name].catalog
    found = degree_growth(FILES[name].map, None, seconds=20, max_degree=20_000)
    assert list(found.degrees[1:])[: len(known["degrees"])] == known["degrees"][: len(found.degrees) - 1]
    assert str(found.growth if not found.looks_exponential else "exponential") == known["growth"]
    if "dynamical_degree" in known:
        assert known["dynamical_degree"].replace("x", "t") in found.growth_text.replace("root of ", "") or (
            known["dynamical_degree"] == "x - 2" and "dynamical degree 2" in found.growth_text
        )


@pytest.mark.parametrize("name", quick(map_names(), ["lyness", "mcmillan", "fibonacci", "hky"]))
def test_the_dimensions_of_the_relations_are_those_that_are_stated(name):
    file = FILES[name]
    maps = Laboratory(file).maps
    for stated in relations(file.catalog, file.variables):
        functions = list(map(str, stated.functions))
        assert hirota_kimura_basis(maps, stated.functions, functions).dimension == stated.dimension


@pytest.mark.parametrize("name", quick(map_names(), ["lyness", "mcmillan"]))
def test_the_analysis_that_is_told_nothing_finds_the_verdict(name):
    known = FILES[name].catalog
    found = analyze(FILES[name], seconds=8)
    assert found.conclusion.kind == known["verdict"]
    assert found.integral_count == known.get("codimension", found.integral_count)


@pytest.mark.parametrize("name", quick(UNREPAIRED, ["repaired_octahedral"]))
def test_without_the_terms_in_eps_the_repaired_maps_are_kahan_s_and_not_integrable(name):
    *rhs, degree = UNREPAIRED[name]
    flow = SystemFile.from_system(QuadraticSystem.from_text(["x", "y"], rhs))
    assert degree_growth(flow.map, None, max_terms=6).degrees[1:] == (2, 4, 8, 16, 32, 64)
    assert find_integrals(flow, max_degree=6).codimension == 0
    F = next(iter(FILES[name].integrals.values()))
    assert str(verdict_on(flow.map, F, None, is_density=False)[0]) == "refuted"
    (integral,) = find_integrals(flow, flow=True).integrals
    assert (str(integral.verdict), integral.function.numerator.total_degree()) == ("proved", degree)
    # The terms change a step by eps^3 at most.
    gaps = [_gap(FILES[name].map, flow.map, eps) for eps in (fmpq(1, 10**4), fmpq(1, 10**5))]
    assert all(abs(first / second) > 900 for first, second in zip(*gaps, strict=True))


def _gap(first, second, eps):
    one, other = (map_.at(eps, QQ).step((fmpq(1, 3), fmpq(2, 5))) for map_ in (first, second))
    return [a - b for a, b in zip(one, other, strict=True)]


def test_five_steps_of_lyness_and_eight_of_todd_close_for_a_1():
    for name, period in (("lyness", 5), ("todd", 8)):
        laboratory = Laboratory(load(name, {"a": 1}))
        assert {len(map_.orbit(20)) for map_ in laboratory.maps} == {period}
        assert {len(map_.orbit(20)) for map_ in Laboratory(load(name)).maps} == {20}
